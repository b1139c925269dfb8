!> Who falls asleep or wakes at the start of a step, and where its displacements go.
module test_resting_m
  use check_m, only: check, wp
  use errors_m, only: to_text
  use sleep_m, only: update_stillness
  use walls_m, only: floor_wall
  use displacements_m, only: reserve_displacements
  use counterparts_m, only: update_counterparts
  use resting_m, only: wake_or_sleep
  use world_m, only: world_t, set_up, body
  implicit none
  private
  public :: test_resting

  real(wp), parameter :: r = 0.05_wp          !! of the balls [m]
  real(wp), parameter :: k_n = 1.0e6_wp       !! of their springs [N/m]
  real(wp), parameter :: gravity(3) = [0.0_wp, 0.0_wp, -10.0_wp]
  real(wp) :: load                            !! weight of a ball [N]

contains

  subroutine test_resting()
    call check_balance()
    call check_contact()
    call check_displacements()
    call check_held()
  end subroutine test_resting

  !> A ball, slow for long, on the floor or a held ball; its spring carries a part of its weight, as
  !! is remembered of the last substep.
  subroutine begin(part, support, speed, world)
    real(wp), intent(in) :: part         !! 1: in balance [-]
    integer, intent(in) :: support       !! 0: the floor, 1: a ball that is held
    real(wp), intent(in) :: speed        !! of the support [m/s]
    type(world_t), intent(out) :: world
    character(:), allocatable :: held, floor
    logical :: changed

    held = ''
    floor = ''
    if (support == 0) floor = ' z_min_velocity='//to_text([speed, 0.0_wp, 0.0_wp])
    if (support == 1) held = body('ball', [0.5_wp, 0.5_wp, r], [speed, 0.0_wp, 0.0_wp], &
      more='fixed=T')
    call set_up('&run t_end=1 physics="dry"/ &grid cells=3*2 length=3*1/ &fluid gravity=0,0,-10/ ' &
      //'&boundary z_min="no_slip"'//floor//'/ &contact model="spheres" ' &
      //'law="constants" k_n=1e6 eta_n=0 eta_t=0/ &shape name="ball" kind="sphere" size=.1/ ' &
      //held//body('ball', [0.5_wp, 0.5_wp, r]), world)
    load = 10.0_wp*world%shapes(1)%density*world%shapes(1)%volume
    world%blocks%x(3, 1 + support) = r + 2*r*support - part*load/k_n
    call update_counterparts(world%walls, gravity, world%blocks, &
      world%contacts%counterparts)
    call update_stillness(world%blocks, changed)
    call world%contacts%detect(world%walls, world%blocks)
    call reserve_displacements(1, world%contacts%displacements)
    associate (memory => world%contacts%displacements)
      memory%n = world%contacts%points%n
      memory%a(1) = 1 + support
      memory%b(1) = merge(1, floor_wall, support == 1)
      memory%id(1) = 1
      memory%xi = 0.0_wp
      memory%torque_a = 0.0_wp
      memory%torque_b = 0.0_wp
      memory%force(:, 1) = [0.0_wp, 0.0_wp, part*load]
      memory%energy(1) = 0.5_wp*(part*load)**2/k_n
    end associate
    world%contacts%sleep%quiet = 1000.0_wp
  end subroutine begin

  subroutine start_step(world)
    type(world_t), intent(inout) :: world

    call wake_or_sleep(world%walls, gravity, world%contacts, world%blocks)
  end subroutine start_step

  !> It sleeps where forces balance within 0.2 % of the load, fluid included, and wakes above 2 %.
  subroutine check_balance()
    real(wp), parameter :: off(4) = [-0.0021_wp, -0.0019_wp, 0.0019_wp, 0.0021_wp]
    type(world_t) :: world
    integer :: i

    do i = 1, 4
      call begin(1 + off(i), 0, 0.0_wp, world)
      call start_step(world)
      call check('sleeps in balance', world%blocks%asleep(1) .eqv. abs(off(i)) < 0.002_wp)
      call begin(0.5_wp*(1 + off(i)), 0, 0.0_wp, world)
      world%contacts%steady(3, 1) = 0.5_wp*load
      call start_step(world)
      call check('half afloat', world%blocks%asleep(1) .eqv. abs(off(i)) < 0.002_wp)
    end do
    call begin(1.0_wp, 0, 0.0_wp, world)
    call start_step(world)
    world%contacts%steady(3, 1) = 0.0195_wp*load
    call start_step(world)
    call check('sleeps on', world%blocks%asleep(1))
    world%contacts%steady(3, 1) = 0.0202_wp*load
    call start_step(world)
    call check('wakes', .not. world%blocks%asleep(1))
    call start_step(world)
    call check('not until it is in balance', .not. world%blocks%asleep(1))
    world%contacts%steady(3, 1) = 0.0019_wp*load
    call start_step(world)
    call check('sleeps again, for it has not moved', world%blocks%asleep(1))
  end subroutine check_balance

  !> What is no candidate, or touches nothing, or what is moved, stays awake.
  subroutine check_contact()
    type(world_t) :: world
    integer :: support

    call begin(1.0_wp, 0, 0.0_wp, world)
    world%contacts%sleep%quiet = 0.0_wp
    call start_step(world)
    call check('no candidate', .not. world%blocks%asleep(1))
    call begin(-1.0_wp, 0, 0.0_wp, world)
    world%contacts%steady(3, 1) = load
    call start_step(world)
    call check('afloat', .not. world%blocks%asleep(1))
    do support = 0, 1
      call begin(1.0_wp, support, 0.01_wp, world)
      call start_step(world)
      call check('on what is moved', .not. world%blocks%asleep(1 + support))
    end do
  end subroutine check_contact

  !> The displacement of a sleeper rests with the force and the energy of its contact, is told as a
  !! counterpart met, and is at work again when the sleeper wakes. What it had of momentum went into
  !! the contact point.
  subroutine check_displacements()
    type(world_t) :: world
    real(wp), parameter :: slow = 1.0e-6_wp   !! [m/s]
    real(wp) :: energy

    call begin(1.0_wp, 0, 0.0_wp, world)
    world%blocks%v(1, 1) = slow
    energy = 0.5_wp*load**2/k_n
    call start_step(world)
    associate (contacts => world%contacts, blocks => world%blocks)
      call check('at rest', all([contacts%displacements%n, contacts%sleep%frozen%n] == [0, 1]))
      call check('its force', contacts%sleep%frozen%force(:, 1), [0.0_wp, 0.0_wp, load], &
        1.0e-9_wp*load)
      call check('its energy', contacts%sleep%frozen%energy(1), energy, 1.0e-9_wp*energy)
      call check('bears it', contacts%sleep%load(:, 1), [0.0_wp, 0.0_wp, load], 1.0e-9_wp*load)
      call check('no more contact points', contacts%points%n, 0)
      call check('but a counterpart', all([contacts%met%n, contacts%met%a(1), contacts%met%b(1)] &
        == [1, 1, -5]))
      call check('stands', norm2(blocks%v(:, 1)), 0.0_wp)
      call check('its momentum', contacts%loads%impulse(1, 1), -blocks%mass(1)*slow, &
        1.0e-12_wp*blocks%mass(1)*slow)
      contacts%steady(1, 1) = 0.1_wp*load
      call start_step(world)
      call check('at work', all([contacts%displacements%n, contacts%sleep%frozen%n] == [1, 0]))
      call check('bears nobody now', norm2(contacts%sleep%load(:, 1)), 0.0_wp)
      call check('touches again', contacts%points%n, 1)
    end associate
  end subroutine check_displacements

  !> A ball on one that is held sleeps, and the one held bears it.
  subroutine check_held()
    type(world_t) :: world

    call begin(1.0_wp, 1, 0.0_wp, world)
    call start_step(world)
    call check('on a ball that is held', all(world%blocks%asleep .eqv. [.false., .true.]))
    call check('bears it', world%contacts%sleep%load(:, 1), [0.0_wp, 0.0_wp, -load], 1.0e-9_wp*load)
  end subroutine check_held

end module test_resting_m
