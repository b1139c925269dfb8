!> Blocks at rest sleep, bear what lies on them, and wake by touch, by flow and with a support: the
!! rules one by one, and worlds beside others without sleep.
module test_sleep_m
  use check_m, only: check, wp
  use vectors_m, only: quaternion_from_axis, quaternion_product
  use rigid_body_m, only: release_body, kinetic_energy, potential_energy, set_velocity_after_fluid
  use displacements_m, only: reserve_displacements
  use sleep_m, only: sleep_t, sleep_init, balanced, rest_tolerance, wake_tolerance, store_quiet, &
    may_sleep, update_loads, update_stillness
  use world_m, only: world_t, set_up, begin, body, move
  implicit none
  private
  public :: test_sleep

  real(wp), parameter :: d = 0.02_wp         !! edge of the cube [m]
  real(wp), parameter :: g = 9.81_wp, gravity(3) = [0.0_wp, 0.0_wp, -g]   !! [m/s2]
  real(wp), parameter :: mu = 0.4_wp         !! friction of all [-]
  real(wp), parameter :: dt = 1.0e-2_wp      !! [s]
  character(*), parameter :: models(2) = [character(7) :: 'spheres', 'surface']
  integer :: model

contains

  subroutine test_sleep()
    call check_balanced()
    call check_loads()
    do model = 1, size(models)
      call check_quiet()
      call check_rest()
      call check_hit(1, 3)
      call check_hit(3, 1)
      if (model == 1) cycle   ! the spheres of a cube stick out: it stands on few, and rolls
      call check_support()
      call check_slope()
      call check_flow()
      call check_chain()
      call check_edge()
    end do
  end subroutine test_sleep

  !> Contact balances all else within a tolerance of it, torques within that at the radius of the
  !! body; without any load only in full.
  subroutine check_balanced()
    real(wp), parameter :: x(3) = [1.0_wp, 0.0_wp, 0.0_wp], none(3) = 0.0_wp, radius = 0.3_wp
    real(wp), parameter :: load(3) = [0.0_wp, 6.0_wp, -8.0_wp]   !! of size 10
    real(wp), parameter :: off(2) = [0.0999_wp, 0.1001_wp]

    call check('force', all([balanced(0.01_wp, off(1)*x - load, none, load, none, radius), &
      .not. balanced(0.01_wp, off(2)*x - load, none, load, none, radius)]))
    call check('torque', all([balanced(0.01_wp, -load, off(1)*radius*x - 3*x, load, 3*x, radius), &
      .not. balanced(0.01_wp, -load, off(2)*radius*x - 3*x, load, 3*x, radius)]))
    call check('no load', all([balanced(0.01_wp, none, none, none, none, radius), &
      .not. balanced(0.01_wp, 1.0e-30_wp*x, none, none, none, radius)]))
  end subroutine check_balanced

  !> A block is a candidate that has been slower than 5e-4 sqrt(g r) for sqrt(r/g) on end;
  !! its turning counts, and one that is held or not there is never one.
  subroutine check_quiet()
    type(world_t) :: world
    type(sleep_t) :: sleep
    real(wp) :: way, fall
    logical :: woke
    integer :: b, n
    real(wp), parameter :: radius = 0.3_wp

    call start(tower(1, 4), world)
    call sleep_init(.true., spread(radius, 1, 4), sleep)
    fall = sqrt(radius/g)
    way = 5.0e-4_wp*sqrt(g*radius)*0.101_wp*fall
    associate (blocks => world%blocks)
      blocks%v = 1.0_wp   ! does not count, but how far it comes
      blocks%fixed(3) = .true.
      blocks%present(4) = .false.
      do n = 1, 9
        call creep(world, way, [0.99_wp, 0.5_wp], 0.49_wp, sleep)
      end do
      call check('not yet', .not. any([(may_sleep(gravity, b, blocks, sleep), b=1, 4)]))
      call creep(world, way, [0.99_wp, 0.5_wp], 0.49_wp, sleep)
      call check('candidates', all([(may_sleep(gravity, b, blocks, sleep), b=1, 4)] &
        .eqv. [.true., .true., .false., .false.]))
      call creep(world, way, [0.99_wp, 0.5_wp], 0.51_wp, sleep)
      call check('turns too fast', sleep%quiet(:2), [11*0.101_wp*fall, 0.0_wp], 1.0e-13_wp)
      call creep(world, way, [1.01_wp, 0.0_wp], 0.0_wp, sleep)
      call check('moves too fast', sleep%quiet(1), 0.0_wp)
      blocks%asleep(2) = .true.
      blocks%still(1) = .true.
      blocks%path(1)%n = 2
      call update_stillness(blocks, woke)
      call check('what starts on a path wakes all', woke .and. .not. blocks%asleep(2))
    end associate
  end subroutine check_quiet

  !> A step in which two blocks come so far, by the way of a slow one, and the second turns too.
  subroutine creep(world, way, share, turn, sleep)
    type(world_t), intent(inout) :: world
    real(wp), intent(in) :: way           !! of a slow block in this step [m]
    real(wp), intent(in) :: share(2), turn
    type(sleep_t), intent(inout) :: sleep

    associate (blocks => world%blocks)
      sleep%x = blocks%x
      sleep%q = blocks%q
      blocks%x(1, 1:2) = blocks%x(1, 1:2) + share*way
      blocks%q(:, 2) = quaternion_product(quaternion_from_axis([0.0_wp, 1.0_wp, 0.0_wp], &
        turn*way/sleep%reach(2)), blocks%q(:, 2))
      call store_quiet(gravity, 0.101_wp*sqrt(sleep%reach(2)/g), blocks, sleep)
    end associate
  end subroutine creep

  !> What rests bears on body and counterpart, on the counterpart the other way, and on no wall.
  subroutine check_loads()
    type(sleep_t) :: sleep
    real(wp), parameter :: x(3) = [1.0_wp, 0.0_wp, 0.0_wp]

    call sleep_init(.true., [1.0_wp, 1.0_wp, 1.0_wp], sleep)
    call reserve_displacements(3, sleep%frozen)
    sleep%frozen%n = 3
    sleep%frozen%a(:3) = [1, 2, 3]
    sleep%frozen%b(:3) = [-5, 1, 1]
    sleep%frozen%force(:, :3) = reshape([5*x, 2*x, 3*x], [3, 3])
    sleep%frozen%torque_a(:, :3) = reshape([7*x, 20*x, 30*x], [3, 3])
    sleep%frozen%torque_b(:, :3) = reshape([1000*x, 100*x, 300*x], [3, 3])
    call update_loads(sleep)
    call check('forces at rest', sleep%load(1, :), [5.0_wp - 2 - 3, 2.0_wp, 3.0_wp])
    call check('torques at rest', sleep%load_torque(1, :), [407.0_wp, 20.0_wp, 30.0_wp])
  end subroutine check_loads

  !> Bodies in a tank of 1 m; another one without sleep, too.
  subroutine start(groups, world, awake, contact)
    character(*), intent(in) :: groups
    type(world_t), intent(out) :: world
    type(world_t), intent(out), optional :: awake
    character(*), intent(in), optional :: contact   !! variables of &contact
    character(:), allocatable :: friction

    friction = '" friction=.4 wall_friction=.4 '
    if (present(contact)) friction = friction//contact
    call set_up('&run t_end=1 physics="dry"/ &grid cells=3*2 length=3*1/ &shape name="cube" ' &
      //'kind="cube" size=.02 refinement=1/ &shape name="slab" kind="box" size=.12,.12,.02 ' &
      //'refinement=1/ &contact model="'//models(model)//friction//'/ '//groups, world)
    if (.not. present(awake)) return
    world%case%contact%sleep = .false.
    call begin(world%case, world, awake)
  end subroutine start

  !> Cubes above one another on the floor, the lowest ones left out.
  function tower(first, last) result(text)
    integer, intent(in) :: first, last
    character(:), allocatable :: text
    integer :: b

    text = ''
    do b = first, last
      text = text//body('cube', [0.5_wp, 0.5_wp, d*(real(b, wp) - 0.5_wp)])
    end do
  end function tower

  !> Let worlds go on for a time.
  subroutine run(time, world, other)
    real(wp), intent(in) :: time   !! [s]
    type(world_t), intent(inout) :: world
    type(world_t), intent(inout), optional :: other

    call move(world, nint(time/dt), dt)
    if (present(other)) call move(other, nint(time/dt), dt)
  end subroutine run

  !> Cubes on a slab that is held (three; on contact spheres one) sleep where they stand, cost
  !! nothing, and what is told of them is the same as of blocks that do not sleep.
  subroutine check_rest()
    character(*), parameter :: held = '&body shape="slab" position=.5,.5,.01 fixed=T/ '
    type(world_t) :: one, two
    integer :: n

    n = merge(1, 3, model == 1)
    if (model == 1) then   ! on the tips of its spheres
      call start(held//body('cube', [0.5_wp, 0.5_wp, 1.6826_wp*d]), one, two)
    else
      call start(held//tower(2, 4), one, two)
    end if
    call run(0.9_wp, one, two)
    call check('all sleep', count(one%blocks%asleep), n)
    call check('nobody sleeps without sleep', count(two%blocks%asleep), 0)
    call check('no velocity', maxval(abs(one%blocks%v)) + maxval(abs(one%blocks%l)), 0.0_wp)
    call check('no substeps', one%contact%substeps, 0)
    call check('same poses', one%blocks%x - two%blocks%x, 0.0_wp, &
      merge(1.0e-7_wp, 1.0e-8_wp, models(model) == 'surface'))   ! overlaps creep back
    call check('same energy', one%contact%energy, two%contact%energy, &
      2*rest_tolerance*two%contact%energy)
    call check('same counterparts', all(one%blocks%contacts == two%blocks%contacts))
    call check('balance', &
      one%blocks%contact_force(3, 2:)/one%blocks%mass(2:) - g, 0.0_wp, 1.0e-12_wp)
    call check('the slab bears all', one%blocks%contact_force(3, 1), -n*one%blocks%mass(2)*g, &
      n*rest_tolerance*one%blocks%mass(2)*g)
    call check('torque', one%blocks%contact_torque(:, 1), 0.0_wp, 1.0e-4_wp*one%blocks%mass(2)*g*d)
  end subroutine check_rest

  !> A cube that slides into a sleeper pushes it as if it had been awake, momentum is kept, and both
  !! come to rest.
  subroutine check_hit(sleeper, other)
    integer, intent(in) :: sleeper, other   !! their places in the case
    type(world_t) :: one, two
    character(200) :: place(3)
    real(wp) :: before(3), dropped
    integer :: n

    place(sleeper) = tower(1, 1)
    place(2) = body('cube', [0.5_wp, 0.5_wp, 1.5_wp*d], more='release_time=9')
    place(other) = body('cube', [0.5_wp - 1.2_wp*d, 0.5_wp, 0.51_wp*d], [0.5_wp, 0.0_wp, 0.0_wp], &
      more='release_time=1')
    call start(place(1)//place(2)//place(3), one, two)
    call run(1.0_wp, one, two)
    call check('sleeps', one%blocks%asleep(sleeper))
    call check('on the floor alone', all([one%blocks%contacts(sleeper), &
      one%blocks%on_floor(sleeper)] == 1))
    call release_body(1.0_wp, other, one%blocks)
    call release_body(1.0_wp, other, two%blocks)
    call check('energy of the rest', kinetic_energy(one%blocks), one%blocks%mass(other)/8, &
      1.0e-15_wp)
    dropped = 0.0_wp
    do n = 1, 10
      before = momentum(one)
      call move(one, 1, dt)
      call move(two, 1, dt)
      dropped = max(dropped, maxval(abs(momentum(one) - before &
        - dt*(sum(one%blocks%contact_force, 2) + 2*one%blocks%mass(1)*one%case%fluid%gravity))))
    end do
    call check('awake', .not. one%blocks%asleep(sleeper))
    call check('momentum is kept', dropped, 0.0_wp, 1.0e-12_wp)
    call check('pushed', two%blocks%x(1, sleeper) > 0.5_wp + 0.1_wp*d)
    call check('as if awake', one%blocks%x - two%blocks%x, 0.0_wp, 5.0e-3_wp*d)
    call check('as fast', one%blocks%v - two%blocks%v, 0.0_wp, 5.0e-3_wp*0.5_wp)
    call run(1.5_wp, one)
    call check('both sleep again', count(one%blocks%asleep), 2)
  end subroutine check_hit

  !> Momentum of what moves [N s].
  function momentum(world) result(p)
    type(world_t), intent(in) :: world
    real(wp) :: p(3)

    p = world%blocks%mass(1)*world%blocks%v(:, 1) + world%blocks%mass(3)*world%blocks%v(:, 3)
  end function momentum

  !> A fixed body that is moved pushes a sleeper away under another: both wake, and move as without
  !! sleep.
  subroutine check_support()
    type(world_t) :: one, two

    call start(tower(1, 1)//body('cube', [0.5_wp + 0.3_wp*d, 0.5_wp, 1.5_wp*d]) &
      //body('cube', [0.5_wp - 4*d, 0.5_wp, 0.55_wp*d], [1.0_wp, 0.0_wp, 0.0_wp], &
      more='fixed=T release_time=1'), one, two, &
      merge('courant_max=.01 ', repeat(' ', 16), models(model) == 'spheres'))   ! free of substeps
    call run(1.0_wp, one, two)
    call check('both sleep', count(one%blocks%asleep), 2)
    call release_body(1.0_wp, 3, one%blocks)
    call release_body(1.0_wp, 3, two%blocks)
    call run(0.03_wp, one, two)
    call check('sleep until touched', count(one%blocks%asleep), 2)
    call run(0.05_wp, one, two)   ! before it tumbles: which way depends on the order of contacts
    call check('both are awake', count(one%blocks%asleep), 0)
    call check('pushed away', one%blocks%x(1, 1) - 0.5_wp > d)
    call check('the upper one moves', norm2(one%blocks%v(:, 2)) > 0.05_wp)
    call check('both as awake', one%blocks%x(:, :2) - two%blocks%x(:, :2), 0.0_wp, &
      merge(0.1_wp, 0.01_wp, models(model) == 'surface')*d)   ! its steps are others
  end subroutine check_support

  !> On a slope a little steeper than friction bears a cube never sleeps, on one less steep it does.
  subroutine check_slope()
    type(world_t) :: world
    real(wp) :: slope, v, energy, x(3)

    slope = atan(mu*1.002_wp)
    call start(body('cube', [0.1_wp, 0.5_wp, 0.5_wp*d]), world)
    world%case%fluid%gravity = g*[sin(slope), 0.0_wp, -cos(slope)]
    call run(0.5_wp, world)
    v = world%blocks%v(1, 1)
    call run(1.0_wp, world)
    call check('slides', world%blocks%v(1, 1) - v, g*(sin(slope) - mu*cos(slope)), 1.0e-4_wp)
    call check('does not sleep on a slope too steep', .not. world%blocks%asleep(1))
    slope = atan(mu*0.95_wp)
    call start(tower(1, 1), world)
    world%case%fluid%gravity = g*[sin(slope), 0.0_wp, -cos(slope)]
    call run(1.5_wp, world)
    call check('sleeps on a slope less steep', world%blocks%asleep(1))
    x = world%blocks%x(:, 1)
    energy = world%contact%energy
    world%blocks%fluid_force(2, 1) = 0.03_wp*world%blocks%mass(1)*g
    call move(world, 1, dt)
    call check('awake on the slope', .not. world%blocks%asleep(1))
    call check('keeps its displacements: place', norm2(world%blocks%x(:, 1) - x), 0.0_wp, 5.0e-7_wp)
    call check('keeps its displacements: energy', world%contact%energy, energy, 0.01_wp*energy)
  end subroutine check_slope

  !> Fluid force on a sleeper grows: it slides once it passes friction by 2 % of all that loads it,
  !! and not before; then it comes to rest when the force ends.
  subroutine check_flow()
    type(world_t) :: world
    real(wp) :: force, late
    integer :: n

    call start(tower(1, 1), world)
    call run(1.0_wp, world)
    call check('sleeps in still water', world%blocks%asleep(1))
    do n = 1, 1000
      force = 1.2_wp*mu*world%blocks%mass(1)*g*real(n, wp)/1000.0_wp
      world%blocks%fluid_force(1, 1) = force
      call move(world, 1, dt)
      call set_velocity_after_fluid(world%case%fluid%gravity, dt, world%blocks%fluid_force, &
        world%blocks%fluid_torque, world%blocks)
      call check_balance(world)
      if (world%blocks%v(1, 1) > 1.0e-3_wp) exit
    end do
    late = merge(wake_tolerance*sqrt(1.0_wp + mu**2)/mu, 0.01_wp, models(model) == 'surface')
    call check('slides at mu W', force/(mu*world%blocks%mass(1)*g), 1.0_wp + late/2, &
      0.01_wp + late/2)
    call check('awake in the current', .not. world%blocks%asleep(1))
    world%blocks%fluid_force = 0.0_wp
    call run(1.0_wp, world)
    call check('sleeps again', world%blocks%asleep(1))
    world%blocks%fluid_torque(2, 1) = 0.03_wp*world%blocks%mass(1)*g*d
    call move(world, 1, dt)
    call check('a torque wakes', .not. world%blocks%asleep(1))
  end subroutine check_flow

  !> Contact, weight and fluid make the change of velocity, asleep or awake.
  subroutine check_balance(world)
    type(world_t), intent(in) :: world
    real(wp) :: rest(3)

    associate (b => world%blocks)
      rest = b%mass(1)*((b%v(:, 1) - b%v_start(:, 1))/dt - world%case%fluid%gravity) &
        - b%contact_force(:, 1) - b%fluid_force(:, 1)
    end associate
    if (maxval(abs(rest)) > 1.0e-12_wp) call check('balance of forces', rest, 0*rest, 1.0e-12_wp)
  end subroutine check_balance

  !> A cube on its edge that leans by 5e-4 falls over, though the torque on it is less than what a
  !! sleeper is held by.
  subroutine check_edge()
    type(world_t) :: world
    real(wp), parameter :: upright = atan(1.0_wp), up(2) = [sqrt(0.5_wp), 0.5_wp]

    call start(body('cube', [0.5_wp, 0.5_wp, up(1)*d], q=quaternion_from_axis( &
      [0.0_wp, 1.0_wp, 0.0_wp], upright + 5.0e-4_wp)), world)
    call run(1.5_wp, world)
    call check('falls from its edge', world%blocks%x(3, 1), up(2)*d, 1.0e-3_wp*d)
    call check('sleeps on its face', world%blocks%asleep(1))
  end subroutine check_edge

  !> A push at one end of a row of sleepers reaches the other end, as if all were awake.
  subroutine check_chain()
    type(world_t) :: one, two
    character(:), allocatable :: row
    integer, parameter :: n = 5
    integer :: b

    row = ''
    do b = 1, n
      row = row//body('cube', [0.4_wp + d*real(b, wp), 0.5_wp, 0.5_wp*d])
    end do
    call start(row//body('cube', [0.4_wp - 0.1_wp*d, 0.5_wp, 0.52_wp*d], [1.0_wp, 0.0_wp, 0.0_wp], &
      more='release_time=1'), one, two)
    call run(1.0_wp, one, two)
    call check('all of the row sleep', count(one%blocks%asleep), n)
    call release_body(1.0_wp, n + 1, one%blocks)
    call release_body(1.0_wp, n + 1, two%blocks)
    call run(0.04_wp, one, two)
    call check('all of the row are awake', count(one%blocks%asleep), 0)
    call check('the last one moves', two%blocks%v(1, n) > 0.05_wp)
    call check('row as fast', one%blocks%v(1, :) - two%blocks%v(1, :), 0.0_wp, 0.02_wp)
    call check('energy of the row', (kinetic_energy(one%blocks) &
      + potential_energy(one%case%fluid%gravity, one%blocks) + one%contact%energy) &
      /(kinetic_energy(two%blocks) + potential_energy(two%case%fluid%gravity, two%blocks) &
        + two%contact%energy), 1.0_wp, 0.01_wp)
  end subroutine check_chain

end module test_sleep_m
