!> Blocks in a given water: buoyancy and level, added mass, entry, drag, the books.
module test_light_m
  use check_m, only: check, wp
  use errors_m, only: to_text
  use rigid_body_m, only: release_body, drift, kick, own_mass, kinetic_energy, &
    potential_energy
  use panel_method_m, only: added_inertia_t, added_inertia
  use panels_m, only: surface_panels
  use light_m, only: step_in_water, enter_water, store_water_force, added_inertia_of
  use vectors_m, only: quaternion_from_axis
  use world_m, only: world_t, set_up, body
  implicit none
  private
  public :: test_light

  real(wp), parameter :: g = 9.81_wp, gravity(3) = [0.0_wp, 0.0_wp, -g], rho = 1000.0_wp
  real(wp), parameter :: edge = 0.02_wp, area = 0.03_wp, level = 0.15_wp   ! of the tank
  character(*), parameter :: head = '&run t_end=1 physics="light"/ &grid cells=3*2 ' &
    //'length=.3,.1,.2/ '

contains

  subroutine test_light()
    call check_coefficients()
    call check_level()
    call check_start()
    call check_terminal()
    call check_in_balance()
    call check_draught()
    call check_entry()
    call check_let_go()
    call check_spin()
    call check_energy()
    call check_sleepers()
  end subroutine test_light

  !> Cubes in the tank of the paper.
  subroutine start(density, world, bodies, shape, velocity)
    real(wp), intent(in) :: density    !! [kg/m3]
    type(world_t), intent(out) :: world
    character(*), intent(in) :: bodies   !! groups
    character(*), intent(in), optional :: shape, velocity   !! variables of &shape and &fluid
    character(:), allocatable :: text

    text = head//'&fluid liquid_density=1000 water_level=.15'
    if (present(velocity)) text = text//velocity
    text = text//'/ &shape name="cube" kind="cube" size=.02 density='//to_text(density)
    if (present(shape)) text = text//shape
    call set_up(text//'/ '//bodies, world)
  end subroutine start

  !> A cube in the middle at a height.
  function at(z, v, q, more) result(text)
    real(wp), intent(in) :: z   !! [m]
    real(wp), intent(in), optional :: v(3), q(4)
    character(*), intent(in), optional :: more
    character(:), allocatable :: text

    text = body('cube', [0.05_wp, 0.05_wp, z], v, q, more)
  end function at

  !> n steps without contact.
  subroutine step(n, dt, world)
    integer, intent(in) :: n
    real(wp), intent(in) :: dt
    type(world_t), intent(inout) :: world
    integer :: i

    associate (blocks => world%blocks)
      do i = 1, n
        call enter_water(gravity, dt, blocks, world%initialised, world%light)
        blocks%v_start = blocks%v
        blocks%l_start = blocks%l
        call drift(0.5_wp*dt, blocks)
        call kick(gravity, dt, blocks%fluid_force, blocks%fluid_torque, blocks)
        call drift(0.5_wp*dt, blocks)
        call store_water_force(gravity, dt, blocks, world%light)
      end do
    end associate
  end subroutine step

  !> The water takes blocks as they are.
  subroutine enter(weight, world)
    real(wp), intent(in) :: weight(3)   !! [m/s2]
    type(world_t), intent(inout) :: world

    call enter_water(weight, 0.0_wp, world%blocks, world%initialised, world%light)
  end subroutine enter

  !> Added mass of known bodies: Lamb (art. 92) for the sphere; the others after the panels of
  !! another program, extrapolated to none.
  subroutine check_coefficients()
    character(8), parameter :: kind(4) = ['sphere  ', 'cube    ', 'hexapod ', 'tetrapod']
    real(wp), parameter :: mass(4) = [0.5_wp, 0.64_wp, 0.69_wp, 0.62_wp]
    type(world_t) :: world
    type(added_inertia_t) :: added, turned
    integer :: s, d

    call set_up('&run t_end=1 physics="dry"/ &grid cells=3*2 length=3*1/ ' &
      //'&shape name="sphere" kind="sphere" size=1 refinement=2/ &shape name="cube" ' &
      //'kind="cube" size=1 refinement=2/ &shape name="hexapod" kind="hexapod" size=1/ &shape ' &
      //'name="tetrapod" kind="tetrapod" size=1/ &shape name="lies" kind="box" size=1,1,.25/ ' &
      //'&shape name="stands" kind="box" size=1,.25,1/', world)
    do s = 1, size(kind)
      added = added_inertia_of(world%shapes(s))
      call check('added mass of the '//trim(kind(s)), added%mass, mass(s), 0.01_wp)
      call check('the same in all directions', added%spread < 0.01_wp)
    end do
    associate (sphere => world%shapes(1))
      added = added_inertia(surface_panels(sphere), &
                            sum([(sphere%inertia(d, d), d=1, 3)])/sphere%density)
    end associate
    call check('panels of a sphere', added%mass, 0.5_wp, 0.02_wp)
    call check('a sphere turns nothing', added%inertia < 0.01_wp)
    associate (ball => world%shapes(1))   ! twice as long: .240 about two axes (Lamb, art. 115)
      ball%point(3, :) = 2*ball%point(3, :)
      added = added_inertia(surface_panels(ball), 12*ball%inertia(3, 3)/ball%density)
    end associate
    call check('it does if it is longer', added%inertia, 0.2_wp, 0.01_wp)
    added = added_inertia_of(world%shapes(5))
    call check('a slab pushes more one way than the other', added%spread > 1.0_wp)
    turned = added_inertia_of(world%shapes(6))
    call check('a turned slab has the same mean', turned%mass/added%mass, 1.0_wp, 0.01_wp)
    call check('and the same inertia', turned%inertia/added%inertia, 1.0_wp, 0.02_wp)
  end subroutine check_coefficients

  !> Held bodies: what is there at the start does not lift the level, what comes later does, and
  !! buoyancy is that of the part below it.
  subroutine check_level()
    real(wp), parameter :: tilt = 0.2_wp
    type(world_t) :: world
    real(wp) :: cut, want

    call start(2300.0_wp, world, at(0.05_wp, more='fixed=T')//at(level, more='fixed=T') &
      //at(0.06_wp, more='fixed=T release_time=1'))
    call enter(gravity, world)
    call check('the level of the start', world%light%level, level, 1.0e-15_wp)
    call check('of a whole block', &
      world%blocks%fluid_force(3, 1)/(rho*g*edge**3), 1.0_wp, 1.0e-12_wp)
    call check('of a half', &
      world%blocks%fluid_force(3, 2)/(0.5_wp*rho*g*edge**3), 1.0_wp, 1.0e-12_wp)
    call release_body(1.0_wp, 3, world%blocks)
    call enter(gravity, world)
    want = level + edge**3/(area - edge**2)   ! the held half below and above takes its place
    cut = 0.5_wp*edge + want - level
    call check('the level over a block that came', world%light%level, want, 1.0e-15_wp)
    call check('and more of the cut block', &
      world%blocks%fluid_force(3, 2)/(cut*rho*g*edge**2), 1.0_wp, 1.0e-12_wp)
    call check('none if upright', all(abs(world%blocks%fluid_torque) < 1.0e-15_wp*rho*g*edge**4))
    world%blocks%present(3) = .false.
    call enter(gravity, world)
    call check('the level after it left', world%light%level, level, 1.0e-15_wp)
    call start(2300.0_wp, world, '&boundary x_max="outflow"/ '//at(0.06_wp, &
      more='fixed=T release_time=1'))
    call enter(gravity, world)
    call release_body(1.0_wp, 1, world%blocks)
    call enter(gravity, world)
    call check('the sea outside keeps its level', world%light%level, level, 1.0e-15_wp)
    call start(2300.0_wp, world, at(level, q=quaternion_from_axis([0.0_wp, 1.0_wp, 0.0_wp], &
      tilt), more='fixed=T'))
    call enter(gravity, world)
    want = rho*g*edge**4*sin(tilt)*(1.0_wp - tan(tilt)**2)/24
    call check('a tilted cube is turned on', world%light%force(4:6, 1)/want, &
      [0.0_wp, 1.0_wp, 0.0_wp], 1.0e-12_wp)
  end subroutine check_level

  !> A block let go under water: (s - 1) g/(s + a), and the force in the books.
  subroutine check_start()
    type(world_t) :: world
    real(wp), parameter :: dt = 1.0e-6_wp, s = 2.3_wp
    real(wp) :: want

    call start(s*rho, world, at(0.07_wp))
    call step(1, dt, world)
    want = -(s - 1.0_wp)*g/(s + world%light%added(1)%mass)
    call check('start of a fall', world%blocks%v(3, 1)/dt/want, 1.0_wp, 1.0e-5_wp)
    call check('M dU/dt is the sum of forces', own_mass(world%blocks, 1)*(world%blocks%v(3, 1)/dt &
      + g), world%blocks%fluid_force(3, 1), 1.0e-12_wp*own_mass(world%blocks, 1)*g)
    call check('which is that of the water less what its added mass takes', world%light%force(3, &
      1) - (world%blocks%mass(1) - own_mass(world%blocks, 1))*world%blocks%v(3, 1)/dt, &
      world%blocks%fluid_force(3, 1), 1.0e-12_wp*own_mass(world%blocks, 1)*g)
    call check('shares in the added mass', world%blocks%mass(1)/own_mass(world%blocks, 1) &
      - 1.0_wp, world%light%added(1)%mass/s, 1.0e-12_wp)
  end subroutine check_start

  !> A long fall: sqrt(2 (s - 1) g V/(C S/3)), whatever the attitude.
  subroutine check_terminal()
    type(world_t) :: world
    real(wp), parameter :: s = 2.3_wp
    real(wp) :: want

    call start(s*rho, world, at(-1.0_wp, q=quaternion_from_axis([1.0_wp, 2.0_wp, 0.5_wp], &
      0.7_wp)))
    call step(4000, min(1.0e-3_wp, step_in_water(gravity, world%blocks, world%light)), world)
    want = sqrt(2.0_wp*(s - 1.0_wp)*g*edge**3/(0.55_wp*2.0_wp*edge**2))
    call check('terminal speed', -world%blocks%v(3, 1)/want, 1.0_wp, 1.0e-3_wp)
    call check('straight down', norm2(world%blocks%v(1:2, 1)) < 1.0e-6_wp*want)
  end subroutine check_terminal

  !> A block of half the density at half draught, one as heavy as the water, one in a current.
  subroutine check_in_balance()
    type(world_t) :: world

    call start(0.5_wp*rho, world, at(level))
    call step(1000, 1.0e-3_wp, world)
    call check('floats at half draught', world%blocks%x(3, 1), level, 1.0e-12_wp)
    call start(rho, world, at(0.07_wp))
    call step(1000, 1.0e-2_wp, world)
    call check('a neutral block stays', world%blocks%x(3, 1), 0.07_wp, 1.0e-13_wp)
    call start(rho, world, at(0.07_wp), velocity=' velocity=.2,0,0')
    call step(20000, 1.0e-3_wp, world)
    call check('neutral: with the current', world%blocks%v(1, 1)/0.2_wp, 1.0_wp, 2.0e-2_wp)
    call check('and no other way', norm2(world%blocks%v(2:3, 1)) < 1.0e-12_wp)
  end subroutine check_in_balance

  !> An upright cube is dragged along by as much as its sides are wet.
  subroutine check_draught()
    real(wp), parameter :: draught(2) = [1.0_wp, 0.3_wp], along(3) = [0.1_wp, 0.0_wp, 0.0_wp]
    type(world_t) :: world
    real(wp) :: force(2)
    integer :: i

    do i = 1, 2
      call start(2300.0_wp, world, at(level + (0.5_wp - draught(i))*edge, along))
      call enter(gravity, world)
      force(i) = world%light%force(1, 1)
    end do
    call check('drag of a part', force(2)/force(1), draught(2), 1.0e-3_wp)
  end subroutine check_draught

  !> Entry without weight and drag: U (M + A)^e stays, however many steps it takes.
  subroutine check_entry()
    type(world_t) :: world
    real(wp), parameter :: fall = -0.5_wp
    real(wp) :: want
    integer :: i, n

    do n = 40, 400, 360
      call start(2300.0_wp, world, at(level + 0.6_wp*edge, [0.0_wp, 0.0_wp, fall]), &
        shape=' drag_coefficient=0', velocity=' velocity=.2,0,0')
      do i = 1, n
        call enter(0.0_wp*gravity, world)
        call drift(1.2_wp*edge/real(n, wp)/0.4_wp, world%blocks)
      end do
      call enter(0.0_wp*gravity, world)
      want = fall*(own_mass(world%blocks, 1)/world%blocks%mass(1))**1.2_wp
      call check('entry takes momentum', world%blocks%v(3, 1)/want, 1.0_wp, 1.0e-12_wp)
      call check('the current gives some', world%blocks%v(1, 1), 0.2_wp*(1.0_wp - want/fall), &
        1.0e-12_wp)
    end do
    call check('all of it is in the water', world%light%wet(1)/edge**3, 1.0_wp, 1.0e-12_wp)
    world%blocks%x(3, 1) = level + edge
    call enter(0.0_wp*gravity, world)
    call check('leaving the water takes none', world%blocks%v(3, 1)/want, 1.0_wp, 1.0e-12_wp)
    call check('nor gives', world%blocks%mass(1)/own_mass(world%blocks, 1), 1.0_wp, 1.0e-15_wp)
  end subroutine check_entry

  !> A block that a crane has lowered half into the water and lets go loses nothing then.
  subroutine check_let_go()
    type(world_t) :: world
    real(wp), parameter :: speed = -0.1_wp

    call start(2300.0_wp, world, at(level + 0.5_wp*edge, [0.0_wp, 0.0_wp, speed], &
      more='fixed=T'))
    call step(10, 1.0e-2_wp, world)
    call check('it is half in the water', world%light%wet(1) > 0.3_wp*edge**3 .and. &
               world%light%wet(1) < 0.6_wp*edge**3)
    call check('a crane moves the block alone', &
      world%blocks%mass(1)/own_mass(world%blocks, 1), 1.0_wp, 1.0e-15_wp)
    world%blocks%fixed = .false.
    call step(1, 1.0e-9_wp, world)
    call check('let go it carries water', world%blocks%mass(1) > 1.05_wp*own_mass(world%blocks, 1))
    call check('and has kept its speed', world%blocks%v(3, 1)/speed, 1.0_wp, 0.02_wp)
  end subroutine check_let_go

  !> Spin: kept by a release in the water, braked by drag, slowed by entry and not by leaving.
  subroutine check_spin()
    type(world_t) :: world
    real(wp), parameter :: spin = 5.0_wp
    real(wp) :: grown, brake

    call start(rho, world, at(0.07_wp, more='angular_velocity=0,0,5'))
    call enter(gravity, world)
    call step(1, 1.0e-9_wp, world)
    call check('release keeps the spin', world%blocks%omega(3, 1)/spin, 1.0_wp, 1.0e-6_wp)
    ! The integral of C/2 rho w^2 y^2 sqrt(y^2 + a^2) over four sides; facets see .78 of it.
    brake = rho*0.55_wp*spin**2*(3*sqrt(2.0_wp) - asinh(1.0_wp))*(edge/2)**5
    call check('torque of the drag', world%light%force(6, 1)/brake, -1.0_wp, 0.25_wp)
    call step(400, 1.0e-3_wp, world)
    call check('drag brakes it', world%blocks%omega(3, 1) < 0.9_wp*spin .and. &
      world%blocks%omega(3, 1) > 0.0_wp)
    grown = 1.0_wp + world%light%added(1)%inertia
    call check('which is in the books without what the water takes', &
      world%blocks%fluid_torque(3, 1)*grown/world%light%force(6, 1), 1.0_wp, 1.0e-9_wp)
    world%blocks%omega(3, 1) = spin
    world%blocks%l(3, 1) = spin*grown*world%blocks%shapes(1)%inertia(3, 3)
    world%blocks%x(3, 1) = level + edge
    call enter(gravity, world)
    call step(1, 1.0e-9_wp, world)
    call check('leaving keeps it', world%blocks%omega(3, 1)/spin, 1.0_wp, 1.0e-6_wp)
    world%blocks%x(3, 1) = 0.07_wp
    call step(1, 1.0e-9_wp, world)
    call check('entry shares it', world%blocks%omega(3, 1)*grown/spin, 1.0_wp, 1.0e-6_wp)
  end subroutine check_spin

  !> Without drag, under water, the energy stays. A float that bobs only loses.
  subroutine check_energy()
    type(world_t) :: world
    real(wp) :: first, largest
    integer :: i

    call start(1.5_wp*rho, world, at(0.12_wp, [0.1_wp, 0.0_wp, 0.3_wp], &
      more='angular_velocity=3,2,5'), shape=' drag_coefficient=0')
    call step(1, 1.0e-12_wp, world)
    first = energy(world)
    call step(50, 1.0e-3_wp, world)
    call check('energy under water stays', energy(world)/first, 1.0_wp, 1.0e-12_wp)
    call start(0.9_wp*rho, world, at(level - 0.35_wp*edge))   ! at rest at -0.4
    largest = 0.0_wp
    do i = 1, 1000
      call step(1, 1.0e-2_wp, world)
      if (i > 500) largest = max(largest, abs(world%blocks%x(3, &
        1) - world%light%level + 0.4_wp*edge))
    end do
    call check('a float bobs ever less, at long steps', largest < 0.03_wp*edge)
  end subroutine check_energy

  !> Energy of a block under water with the water that it carries, less what buoyancy does [J].
  real(wp) function energy(world)
    type(world_t), intent(in) :: world

    energy = kinetic_energy(world%blocks) + potential_energy(gravity, world%blocks) &
             - world%light%density*g*world%light%wet(1)*world%blocks%x(3, 1)
  end function energy

  !> A sleeper costs nothing and keeps its force, until the level reaches it.
  subroutine check_sleepers()
    type(world_t) :: world
    real(wp) :: force

    call start(2300.0_wp, world, at(0.02_wp)//at(level))
    call enter(gravity, world)
    world%blocks%asleep = .true.
    world%light%force(3, 1) = 7.0_wp   ! a mark: it must not be found anew
    force = world%light%force(3, 2)
    world%light%displaced_start = world%light%displaced_start - area*1.0e-3_wp
    call enter(gravity, world)
    call check('the force on a sleeper stays', world%light%force(3, 1), 7.0_wp)
    call check('a sleeper that sticks out feels the level', world%light%force(3, 2) > 1.05_wp*force)
  end subroutine check_sleepers

end module test_light_m
