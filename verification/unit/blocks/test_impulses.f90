!> Impacts by impulses: chains of bodies, energy, and heavy blocks on light ones.
module test_impulses_m
  use kinds_m, only: wp
  use check_m, only: check, checked
  use errors_m, only: to_text
  use parallel_m, only: get_threads, set_threads
  use random_counter_m, only: uniform, random_rotation
  use rigid_body_m, only: kinetic_energy
  use world_m, only: world_t, set_up, body, move
  implicit none
  private
  public :: test_impulses

  real(wp), parameter :: d = 0.02_wp   !! edge of the cubes [m]
  real(wp), parameter :: g = 9.81_wp, dt = 2.0e-3_wp   !! [m/s2], [s]
  character(*), parameter :: cube = '&shape name="cube" kind="cube" size=.02/ '

contains

  subroutine test_impulses()
    call check_chains()
    call check_whole_steps()
    call check_peak()
    call check_random_pairs()
    call check_heavy_on_light()
    call check_raft()
    call check_gyration()
  end subroutine test_impulses

  subroutine start(contact, groups, world)
    character(*), intent(in) :: contact, groups
    type(world_t), intent(out) :: world

    call set_up('&run t_end=1 physics="dry"/ &contact solver="impulses" sleep=F '//contact//'/ ' &
      //groups, world)
  end subroutine start

  !> A brick spins just above the floor, near enough for rows: its acceleration counts for the whole
  !! step, half of it far above.
  subroutine check_gyration()
    real(wp), parameter :: height(2) = [0.5_wp, 0.0154_wp], half = 1.0e-4_wp   !! [m], [s]
    type(world_t) :: world
    real(wp) :: gain(3, 2)
    integer :: i

    do i = 1, 2
      call start('', '&grid cells=3*2 length=3*1/ &fluid gravity=3*0/ &shape name="b" kind="box" ' &
        //'size=.01,.02,.03/ '//body('b', [0.5_wp, 0.5_wp, height(i)], &
        more='angular_velocity=40,20,10'), world)
      call move(world, 1, 2*half)
      gain(:, i) = world%blocks%q(2:, 1) - half*[40.0_wp, 20.0_wp, 10.0_wp]
    end do
    call check('spin of a brick before an impact', gain(:, 2), 2*gain(:, 1), 1.0e-7_wp)
  end subroutine check_gyration

  !> A cube at 1 m/s on a column of k resting cubes: all stop at once, the upper one returns with e
  !! of it (Poisson), and never more than e^2 of the energy. The sweeps end before 12 are at rest.
  subroutine check_chains()
    integer, parameter :: columns(5) = [0, 1, 2, 4, 12]
    real(wp), parameter :: e(8) = [0.3_wp, 0.3_wp, 0.3_wp, 0.3_wp, 0.3_wp, 0.0_wp, 0.6_wp, 0.9_wp]
    type(world_t) :: world
    character(:), allocatable :: bodies
    real(wp) :: back, energy
    integer :: i, j, k

    do i = 1, size(e)
      k = columns(merge(i, 3, i <= 5))
      bodies = ''
      do j = 1, k
        bodies = bodies//body('cube', [0.5_wp, 0.5_wp, (j - 0.5_wp)*d])
      end do
      call start('restitution='//to_text(e(i)), '&grid cells=3*2 length=3*1/ '//cube//bodies &
        //body('cube', [0.5_wp, 0.5_wp, (k + 0.5_wp)*d + 0.1_wp - 0.05_wp*g*0.1_wp], &
        [0.0_wp, 0.0_wp, -1.0_wp + 0.1_wp*g]), world)
      call move(world, 48, dt)
      back = 0.0_wp
      energy = 0.0_wp
      do j = 1, 5
        call move(world, 1, dt)
        associate (m => world%blocks%mass(1), list => world%contacts%displacements)
          if (world%blocks%v(3, k + 1) > back) energy = 2*kinetic_energy(world%blocks)/m
          back = max(back, world%blocks%v(3, k + 1))
          call check('no impact is remembered', maxval(abs(list%force(:, :list%n))) < 99*m*g)
        end associate
      end do
      call check('a cube on '//to_text(k)//', e = '//to_text(e(i)), back, &
        merge(0.248_wp, e(i), k == 12), max(0.1_wp*e(i), 0.01_wp))
      call check('no more than e^2 of the energy', energy < 1.02_wp*e(i)**2 + 1.0e-3_wp)
    end do
  end subroutine check_chains

  !> However a step divides into sub-sweeps, rounding leaves no step of next to no length behind it,
  !! whose remembered force would be infinite.
  subroutine check_whole_steps()
    type(world_t) :: world
    integer :: i, steps

    call start('', '&grid cells=3*2 length=3*1/ '//cube//body('cube', [0.5_wp, 0.5_wp, 0.5_wp*d]), &
      world)
    steps = 0
    do i = 1, 200
      call move(world, 1, (0.2_wp + 0.8_wp*uniform(7, i, 1))*dt)
      steps = steps + world%contact%substeps
    end do
    call check('one contact step each', steps, 200)
  end subroutine check_whole_steps

  !> The largest force of an impact is its impulse over the contact time, whatever the step:
  !! m (1 + e) v/t_c, with the weight; then the weight alone.
  subroutine check_peak()
    real(wp), parameter :: step(3) = [4.0e-4_wp, 2.0e-3_wp, 7.0e-3_wp], e = 0.3_wp
    real(wp), parameter :: fall = 0.011_wp, v = sqrt(1.0_wp + 2*g*fall)   !! [m], [m/s]
    type(world_t) :: world
    integer :: i

    do i = 1, 3
      call start('restitution='//to_text(e), '&grid cells=3*2 length=3*1/ '//cube//body('cube', &
        [0.5_wp, 0.5_wp, 0.5_wp*d + fall], [0.0_wp, 0.0_wp, -1.0_wp]), world)
      call move(world, ceiling(0.02_wp/step(i)), step(i))
      associate (peak => world%blocks%record%peak, m => world%blocks%mass(1))
        call check('impact, steps of '//to_text(step(i)), peak(1)/m, &
          (1.0_wp + e)*v/dt + 0.5_wp*g, 8.0_wp)
        call move(world, ceiling(0.5_wp/step(i)), step(i))
        peak = 0.0_wp
        call move(world, 1, step(i))
        call check('then its weight', peak(1)/m, g, 0.1_wp)
      end associate
    end do
  end subroutine check_peak

  !> Two cubes that meet anyhow in space gain no energy at e = 1, and lose next to none without
  !! friction.
  subroutine check_random_pairs()
    type(world_t) :: world
    real(wp) :: energy, most, mean
    integer :: i, n

    n = merge(5, 60, checked)
    most = 0.0_wp
    mean = 0.0_wp
    do i = 1, n
      call start('restitution=1 friction=0', '&grid cells=3*2 length=3*1/ &fluid gravity=3*0/ ' &
        //cube//body('cube', 0.5_wp - 0.5_wp*[d*uniform(5, i, 1), d*uniform(5, i, 2), 0.036_wp], &
        [0.0_wp, 0.0_wp, 0.5_wp], random_rotation(5, i))//body('cube', 0.5_wp &
        + [0.0_wp, 0.0_wp, 0.018_wp], [0.0_wp, 0.0_wp, -0.5_wp], random_rotation(6, i)), world)
      energy = kinetic_energy(world%blocks)
      call move(world, 20, dt)
      energy = kinetic_energy(world%blocks)/energy
      most = max(most, energy)
      mean = mean + energy/n
    end do
    call check('no energy is made', most, 1.0_wp, 0.02_wp)
    call check('nor lost', mean, 1.0_wp, 0.005_wp)
  end subroutine check_random_pairs

  !> A heavy cube on a plate of a hundredth of its mass, at a long contact time, sinks in by less
  !! than 1 % of its thickness.
  subroutine check_heavy_on_light()
    type(world_t) :: world
    real(wp) :: deepest
    integer :: i

    call start('contact_time=.02', '&grid cells=3*2 length=3*8/ &shape name="cube" kind="cube" ' &
      //'size=2 density=2300/ &shape name="plate" kind="box" size=2,2,.43 density=107/ ' &
      //body('plate', [4.0_wp, 4.0_wp, 0.215_wp])//body('cube', [4.0_wp, 4.0_wp, 1.43_wp]), world)
    deepest = 0.0_wp
    do i = 1, 30
      call move(world, 1, 0.02_wp)
      if (i > 15) deepest = max(deepest, world%contact%overlap_max)
    end do
    call check('a plate under a heavy cube', deepest < 0.01_wp*0.43_wp)
    call check('both at rest', maxval(abs(world%blocks%v)), 0.0_wp, 1.0e-4_wp)
  end subroutine check_heavy_on_light

  !> A raft under 100 cubes, more than pairs of one body have colours: any number of threads gives
  !! the same bits.
  subroutine check_raft()
    type(world_t) :: world(2)
    character(:), allocatable :: bodies
    integer :: i, threads

    bodies = '&shape name="raft" kind="box" size=.3,.3,.02/ ' &
      //body('raft', [0.5_wp, 0.5_wp, 0.01_wp])
    do i = 0, 99
      bodies = bodies//body('cube', [0.37_wp, 0.37_wp, 0.03002_wp] &
        + [0.028_wp*modulo(i, 10), 0.028_wp*(i/10), 0.0_wp])
    end do
    threads = get_threads()
    do i = 1, 2
      call set_threads(i)
      call start('', '&grid cells=3*2 length=3*1/ '//cube//bodies, world(i))
      call move(world(i), merge(4, 8, checked), dt)
    end do
    call set_threads(threads)
    call check('on one thread or two', all(abs(world(1)%blocks%x - world(2)%blocks%x) <= 0.0_wp))
    call check('they lie on it', world(1)%blocks%x(3, 2:), 0.03_wp, 1.0e-5_wp)
  end subroutine check_raft

end module test_impulses_m
