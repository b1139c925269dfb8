!> Who falls asleep and who wakes at the start of a step, and where the displacements of its contact
!! points go.
module test_resting_m
  use kinds_m, only: wp
  use check_m, only: check
  use case_types_m, only: case_t
  use tet_mesh_m, only: shape_t
  use shapes_builtin_m, only: make_shape
  use rigid_body_m, only: blocks_t, blocks_init
  use walls_m, only: walls_t, walls_init
  use sleep_m, only: update_stillness
  use counterparts_m, only: update_counterparts
  use contact_detection_m, only: detect_contacts
  use contact_state_m, only: contacts_t, contacts_init
  use resting_m, only: wake_or_sleep
  implicit none
  private
  public :: test_resting

  !> A ball in balance on the floor, or on another ball that is held, slow for long.
  type :: world_t
    type(blocks_t) :: blocks
    type(walls_t) :: walls
    type(contacts_t) :: contacts
  end type world_t

  real(wp), parameter :: r = 0.05_wp          !! of the balls [m]
  real(wp), parameter :: k_n = 1.0e6_wp       !! of their springs [N/m]
  real(wp), parameter :: dt = 1.0e-3_wp, gravity(3) = [0.0_wp, 0.0_wp, -10.0_wp]
  type(shape_t) :: shapes(1)
  real(wp) :: load                            !! weight of a ball [N]

contains

  subroutine test_resting()
    call make_ball()
    call check_balance()
    call check_contact()
    call check_displacements()
    call check_held()
  end subroutine test_resting

  subroutine make_ball()
    type(case_t) :: case
    character(:), allocatable :: message

    allocate (case%shape(1))
    case%shape(1)%name = 'ball'
    case%shape(1)%kind = 'sphere'
    case%shape(1)%size = 2*r
    call make_shape(case%shape(1), shapes(1), message)
    load = 10.0_wp*shapes(1)%density*shapes(1)%volume
  end subroutine make_ball

  !> A ball whose spring carries a part of its weight.
  subroutine begin(part, support, speed, world)
    real(wp), intent(in) :: part         !! 1: in balance [-]
    integer, intent(in) :: support       !! 0: the floor, 1: a ball that is held
    real(wp), intent(in) :: speed        !! of the support [m/s]
    type(world_t), intent(out) :: world
    type(case_t) :: case
    integer :: b
    logical :: changed

    case%grid%length = 1.0_wp
    case%contact%law = 'constants'
    case%contact%k_n = k_n
    case%contact%eta_n = 0.0_wp
    case%contact%eta_t = 0.0_wp
    if (support == 0) case%boundary%velocity(1, 1, 3) = speed
    allocate (case%body(1 + support), case%drop(0))
    case%body%shape = 'ball'
    do b = 1, 1 + support
      case%body(b)%position = [0.5_wp, 0.5_wp, r]
    end do
    if (support == 1) then
      case%body(1)%fixed = .true.
      case%body(1)%velocity(1) = speed
    end if
    b = 1 + support
    case%body(b)%position(3) = r + 2*r*support - part*load/k_n
    call blocks_init(case, shapes, world%blocks)
    call walls_init(case%grid, case%boundary, world%walls)
    call contacts_init(case%contact, world%blocks, world%contacts)
    call update_counterparts(world%walls, gravity, world%blocks, &
      world%contacts%detected%counterparts)
    call update_stillness(world%blocks, changed)
    call detect_contacts(world%walls, world%blocks, 0.0_wp, world%contacts%detected)
    world%contacts%sleep%quiet = 1000.0_wp
  end subroutine begin

  subroutine start_step(world)
    type(world_t), intent(inout) :: world

    call wake_or_sleep(world%walls, gravity, dt, world%contacts, world%blocks)
  end subroutine start_step

  !> It sleeps where the forces balance within 0.2 % of the load, the fluid included. It
  !! wakes where they leave more than 2 %.
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
      call check('at rest', all([contacts%displacements%n, contacts%sleep%rest%n] == [0, 1]))
      call check('its force', contacts%sleep%rest%force(:, 1), [0.0_wp, 0.0_wp, load], &
        1.0e-9_wp*load)
      call check('its energy', contacts%sleep%rest%energy(1), energy, 1.0e-9_wp*energy)
      call check('bears the block', contacts%sleep%load(:, 1), [0.0_wp, 0.0_wp, load], &
        1.0e-9_wp*load)
      call check('no more contact points', contacts%detected%points%n, 0)
      call check('but a counterpart', all([contacts%met%n, contacts%met%a(1), contacts%met%b(1)] &
        == [1, 1, -5]))
      call check('stands', norm2(blocks%v(:, 1)), 0.0_wp, 0.0_wp)
      call check('its momentum', contacts%loads%impulse(1, 1), -blocks%mass(1)*slow, &
        1.0e-12_wp*blocks%mass(1)*slow)
      contacts%steady(1, 1) = 0.1_wp*load
      call start_step(world)
      call check('at work again', all([contacts%displacements%n, contacts%sleep%rest%n] == [1, 0]))
      call check('bears nobody now', norm2(contacts%sleep%load(:, 1)), 0.0_wp, 0.0_wp)
      call check('touches again', contacts%detected%points%n, 1)
    end associate
  end subroutine check_displacements

  !> A ball on one that is held sleeps, and the one held bears it.
  subroutine check_held()
    type(world_t) :: world

    call begin(1.0_wp, 1, 0.0_wp, world)
    call start_step(world)
    call check('on a ball that is held', all(world%blocks%asleep .eqv. [.false., .true.]))
    call check('which bears it', world%contacts%sleep%load(:, 1), [0.0_wp, 0.0_wp, -load], &
      1.0e-9_wp*load)
  end subroutine check_held

end module test_resting_m
