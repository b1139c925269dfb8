!> Blocks in a given water: buoyancy and level, added mass, entry, drag, the books.
module test_light_m
  use kinds_m, only: wp
  use check_m, only: check
  use case_types_m, only: case_t
  use tet_mesh_m, only: shape_t
  use shapes_builtin_m, only: make_shape
  use vectors_m, only: quaternion_from_axis
  use bed_m, only: bed_t
  use rigid_body_m, only: blocks_t, blocks_init, release_body, begin_step, drift, kick, own_mass, &
    kinetic_energy, potential_energy
  use panel_method_m, only: added_inertia_t, added_inertia
  use panels_m, only: surface_panels
  use light_m, only: light_t, light_init, resume_light, step_in_water, enter_water, &
    store_water_force, added_inertia_of
  implicit none
  private
  public :: test_light

  real(wp), parameter :: g = 9.81_wp, gravity(3) = [0.0_wp, 0.0_wp, -g], rho = 1000.0_wp
  real(wp), parameter :: edge = 0.02_wp, area = 0.03_wp, level = 0.15_wp   ! of the tank
  type(bed_t) :: no_bed

contains

  subroutine test_light()
    call check_coefficients()
    call check_level()
    call check_start()
    call check_terminal()
    call check_floating()
    call check_neutral()
    call check_entry()
    call check_let_go()
    call check_spin()
    call check_energy()
    call check_current()
    call check_sleepers()
    call check_resumed()
  end subroutine test_light

  !> A case of cubes in the tank of the paper.
  subroutine make_case(density, z, case, blocks, light)
    real(wp), intent(in) :: density    !! [kg/m3]
    real(wp), intent(in) :: z(:)       !! heights of their centres [m]
    type(case_t), intent(out) :: case
    type(blocks_t), intent(out) :: blocks
    type(light_t), intent(out) :: light

    call describe(density, z, case)
    call start(case, blocks, light)
  end subroutine make_case

  subroutine describe(density, z, case)
    real(wp), intent(in) :: density, z(:)
    type(case_t), intent(out) :: case
    integer :: b

    case%run%physics = 'light'
    case%grid%length = [0.3_wp, 0.1_wp, 0.2_wp]
    case%fluid%liquid_density = rho
    case%fluid%water_level = level
    allocate (case%shape(1), case%body(size(z)), case%drop(0))
    case%shape(1)%name = 'cube'
    case%shape(1)%kind = 'cube'
    case%shape(1)%size = edge
    case%shape(1)%density = density
    case%body%shape = 'cube'
    do b = 1, size(z)
      case%body(b)%position = [0.05_wp*real(b, wp), 0.05_wp, z(b)]
    end do
  end subroutine describe

  subroutine start(case, blocks, light)
    type(case_t), intent(in) :: case
    type(blocks_t), intent(out) :: blocks
    type(light_t), intent(out) :: light
    type(shape_t) :: shapes(1)
    character(:), allocatable :: message

    call make_shape(case%shape(1), shapes(1), message)
    call blocks_init(case, shapes, blocks)
    call light_init(case, no_bed, blocks, light)
  end subroutine start

  !> A step without contact.
  subroutine step(dt, blocks, initialised, light)
    real(wp), intent(in) :: dt
    type(blocks_t), intent(inout) :: blocks
    logical, intent(inout) :: initialised(:)
    type(light_t), intent(inout) :: light

    call enter_water(gravity, dt, blocks, initialised, light)
    call begin_step(blocks)
    call drift(0.5_wp*dt, blocks)
    call kick(gravity, dt, blocks%fluid_force, blocks%fluid_torque, blocks)
    call drift(0.5_wp*dt, blocks)
    call store_water_force(gravity, dt, blocks, light)
  end subroutine step

  !> Added mass of known bodies: Lamb (art. 92) for the sphere; the others after the panels of
  !! another program, extrapolated to none.
  subroutine check_coefficients()
    character(8), parameter :: kind(4) = ['sphere  ', 'cube    ', 'hexapod ', 'tetrapod']
    real(wp), parameter :: mass(4) = [0.5_wp, 0.64_wp, 0.69_wp, 0.62_wp]
    type(case_t) :: case
    type(shape_t) :: shape
    type(added_inertia_t) :: added, turned
    character(:), allocatable :: message
    integer :: s, d

    allocate (case%shape(1))
    case%shape(1)%name = 'one'
    case%shape(1)%refinement = 2
    do s = 1, size(kind)
      case%shape(1)%kind = kind(s)
      case%shape(1)%size = 1.0_wp
      call make_shape(case%shape(1), shape, message)
      added = added_inertia_of(shape)
      call check('added mass of the '//trim(kind(s)), abs(added%mass - mass(s)) < 0.01_wp)
      call check('the same in all directions', added%spread < 0.01_wp)
    end do
    case%shape(1)%kind = 'sphere'
    call make_shape(case%shape(1), shape, message)
    added = added_inertia(surface_panels(shape), &
                          sum([(shape%inertia(d, d), d=1, 3)])/shape%density)
    call check('panels of a sphere', abs(added%mass - 0.5_wp) < 0.02_wp)
    call check('a sphere turns nothing', added%inertia < 0.01_wp)
    case%shape(1)%kind = 'box'
    case%shape(1)%size = [1.0_wp, 1.0_wp, 0.25_wp]
    call make_shape(case%shape(1), shape, message)
    added = added_inertia_of(shape)
    call check('a slab pushes more one way than the other', added%spread > 1.0_wp)
    case%shape(1)%size = [1.0_wp, 0.25_wp, 1.0_wp]
    call make_shape(case%shape(1), shape, message)
    turned = added_inertia_of(shape)
    call check('a turned slab has the same mean', abs(turned%mass/added%mass - 1.0_wp) < 0.01_wp)
    call check('and the same inertia', abs(turned%inertia/added%inertia - 1.0_wp) < 0.02_wp)
  end subroutine check_coefficients

  !> Held bodies: what is there at the start does not lift the level, what comes later does, and
  !! buoyancy is that of the part below it.
  subroutine check_level()
    type(case_t) :: case
    type(blocks_t) :: blocks
    type(light_t) :: light
    logical :: initialised(3)
    real(wp) :: cut, want

    call describe(2300.0_wp, [0.05_wp, level, 0.06_wp], case)
    case%body%fixed = .true.
    case%body(3)%release_time = 1.0_wp
    call start(case, blocks, light)
    initialised = .false.
    call enter_water(gravity, 0.0_wp, blocks, initialised, light)
    call check('the level of the start', abs(light%level - level) < 1.0e-15_wp)
    call check('buoyancy of a whole block', &
               abs(blocks%fluid_force(3, 1)/(rho*g*edge**3) - 1.0_wp) < 1.0e-12_wp)
    call check('buoyancy of a half', &
               abs(blocks%fluid_force(3, 2)/(0.5_wp*rho*g*edge**3) - 1.0_wp) < 1.0e-12_wp)
    call release_body(1.0_wp, 3, blocks)
    call enter_water(gravity, 0.0_wp, blocks, initialised, light)
    want = level + edge**3/(area - edge**2)   ! the held half below and above takes its place
    cut = 0.5_wp*edge + want - level
    call check('the level over a block that came', abs(light%level - want) < 1.0e-15_wp)
    call check('and more of the cut block', &
               abs(blocks%fluid_force(3, 2)/(cut*rho*g*edge**2) - 1.0_wp) < 1.0e-12_wp)
    call check('no torque on an upright block', &
               all(abs(blocks%fluid_torque) < 1.0e-15_wp*rho*g*edge**4))
  end subroutine check_level

  !> A block let go under water: (s - 1) g/(s + a), and the force in the books.
  subroutine check_start()
    type(case_t) :: case
    type(blocks_t) :: blocks
    type(light_t) :: light
    logical :: initialised(1)
    real(wp), parameter :: dt = 1.0e-6_wp, s = 2.3_wp
    real(wp) :: want

    call make_case(s*rho, [0.07_wp], case, blocks, light)
    initialised = .false.
    call step(dt, blocks, initialised, light)
    want = -(s - 1.0_wp)*g/(s + light%added(1)%mass)
    call check('start of a fall', abs(blocks%v(3, 1)/dt/want - 1.0_wp) < 1.0e-5_wp)
    call check('M dU/dt is the sum of forces', abs(own_mass(blocks, 1)*(blocks%v(3, 1)/dt + g) &
      - blocks%fluid_force(3, 1)) < 1.0e-12_wp*own_mass(blocks, 1)*g)
    call check('shares in the added mass', abs(blocks%mass(1)/own_mass(blocks, 1) &
      - 1.0_wp - light%added(1)%mass/s) < 1.0e-12_wp)
  end subroutine check_start

  !> A long fall: sqrt(2 (s - 1) g V/(C S/3)), whatever the attitude.
  subroutine check_terminal()
    type(case_t) :: case
    type(blocks_t) :: blocks
    type(light_t) :: light
    logical :: initialised(1)
    real(wp), parameter :: s = 2.3_wp
    real(wp) :: want
    integer :: i

    call describe(s*rho, [-1.0_wp], case)
    case%body(1)%quaternion = quaternion_from_axis([1.0_wp, 2.0_wp, 0.5_wp], 0.7_wp)
    call start(case, blocks, light)
    initialised = .false.
    do i = 1, 4000
      call step(min(1.0e-3_wp, step_in_water(gravity, blocks, light)), blocks, initialised, light)
    end do
    want = sqrt(2.0_wp*(s - 1.0_wp)*g*edge**3/(0.55_wp*2.0_wp*edge**2))
    call check('terminal speed', abs(-blocks%v(3, 1)/want - 1.0_wp) < 1.0e-3_wp)
    call check('straight down', norm2(blocks%v(1:2, 1)) < 1.0e-6_wp*want)
  end subroutine check_terminal

  !> A block of half the density at half draught, in balance.
  subroutine check_floating()
    type(case_t) :: case
    type(blocks_t) :: blocks
    type(light_t) :: light
    logical :: initialised(1)
    integer :: i

    call make_case(0.5_wp*rho, [level], case, blocks, light)
    initialised = .false.
    do i = 1, 1000
      call step(1.0e-3_wp, blocks, initialised, light)
    end do
    call check('floats at half draught', abs(blocks%x(3, 1) - level) < 1.0e-12_wp)
  end subroutine check_floating

  !> A block as heavy as the water, let go in it.
  subroutine check_neutral()
    type(case_t) :: case
    type(blocks_t) :: blocks
    type(light_t) :: light
    logical :: initialised(1)
    integer :: i

    call make_case(rho, [0.07_wp], case, blocks, light)
    initialised = .false.
    do i = 1, 1000
      call step(1.0e-2_wp, blocks, initialised, light)
    end do
    call check('a neutral block stays', abs(blocks%x(3, 1) - 0.07_wp) < 1.0e-13_wp)
  end subroutine check_neutral

  !> Entry without weight and drag: U (M + A)^e stays, however many steps it takes.
  subroutine check_entry()
    type(case_t) :: case
    type(blocks_t) :: blocks
    type(light_t) :: light
    logical :: initialised(1)
    real(wp), parameter :: fall = -0.5_wp
    real(wp) :: want
    integer :: i, n

    do n = 40, 400, 360
      call describe(2300.0_wp, [level + 0.6_wp*edge], case)
      case%shape(1)%drag_coefficient = 0.0_wp
      case%body(1)%velocity = [0.0_wp, 0.0_wp, fall]
      call start(case, blocks, light)
      initialised = .false.
      do i = 1, n
        call enter_water(0.0_wp*gravity, 0.0_wp, blocks, initialised, light)
        call drift(1.2_wp*edge/real(n, wp)/0.4_wp, blocks)
      end do
      call enter_water(0.0_wp*gravity, 0.0_wp, blocks, initialised, light)
      want = fall*(own_mass(blocks, 1)/blocks%mass(1))**1.2_wp
      call check('entry takes momentum', abs(blocks%v(3, 1)/want - 1.0_wp) < 1.0e-12_wp)
    end do
    call check('all of it is in the water', abs(light%wet(1)/edge**3 - 1.0_wp) < 1.0e-12_wp)
    blocks%x(3, 1) = level + edge
    call enter_water(0.0_wp*gravity, 0.0_wp, blocks, initialised, light)
    call check('leaving the water takes none', abs(blocks%v(3, 1)/want - 1.0_wp) < 1.0e-12_wp)
    call check('nor leaves it any', abs(blocks%mass(1)/own_mass(blocks, 1) - 1.0_wp) < 1.0e-15_wp)
  end subroutine check_entry

  !> A block that a crane has lowered half into the water and lets go loses nothing then.
  subroutine check_let_go()
    type(case_t) :: case
    type(blocks_t) :: blocks
    type(light_t) :: light
    logical :: initialised(1)
    real(wp), parameter :: speed = -0.1_wp
    integer :: i

    call describe(2300.0_wp, [level + 0.5_wp*edge], case)
    case%body(1)%fixed = .true.
    case%body(1)%velocity = [0.0_wp, 0.0_wp, speed]
    call start(case, blocks, light)
    initialised = .false.
    do i = 1, 10
      call step(1.0e-2_wp, blocks, initialised, light)
    end do
    call check('it is half in the water', light%wet(1) > 0.3_wp*edge**3 .and. &
               light%wet(1) < 0.6_wp*edge**3)
    call check('a crane moves the block alone', &
               abs(blocks%mass(1)/own_mass(blocks, 1) - 1.0_wp) < 1.0e-15_wp)
    blocks%fixed = .false.
    call step(1.0e-9_wp, blocks, initialised, light)
    call check('let go it carries water', blocks%mass(1) > 1.05_wp*own_mass(blocks, 1))
    call check('and has kept its speed but for the last step', abs(blocks%v(3, 1)/speed &
      - 1.0_wp) < 0.02_wp)
  end subroutine check_let_go

  !> Spin: kept by a release in the water, braked by drag, slowed by entry and not by leaving.
  subroutine check_spin()
    type(case_t) :: case
    type(blocks_t) :: blocks
    type(light_t) :: light
    logical :: initialised(1)
    real(wp), parameter :: spin = 5.0_wp
    real(wp) :: grown
    integer :: i

    call describe(rho, [0.07_wp], case)
    case%body(1)%angular_velocity = [0.0_wp, 0.0_wp, spin]
    call start(case, blocks, light)
    initialised = .false.
    call enter_water(gravity, 0.0_wp, blocks, initialised, light)
    call step(1.0e-9_wp, blocks, initialised, light)
    call check('a release in the water keeps the spin', &
               abs(blocks%omega(3, 1)/spin - 1.0_wp) < 1.0e-6_wp)
    do i = 1, 400
      call step(1.0e-3_wp, blocks, initialised, light)
    end do
    call check('drag brakes it', blocks%omega(3, 1) < 0.9_wp*spin .and. blocks%omega(3, 1) > 0.0_wp)
    grown = 1.0_wp + light%added(1)%inertia
    blocks%omega(3, 1) = spin
    blocks%l(3, 1) = spin*grown*blocks%shapes(1)%inertia(3, 3)
    blocks%x(3, 1) = level + edge
    call enter_water(gravity, 0.0_wp, blocks, initialised, light)
    call step(1.0e-9_wp, blocks, initialised, light)
    call check('leaving the water keeps it', abs(blocks%omega(3, 1)/spin - 1.0_wp) < 1.0e-6_wp)
    blocks%x(3, 1) = 0.07_wp
    call step(1.0e-9_wp, blocks, initialised, light)
    call check('entry shares it', abs(blocks%omega(3, 1)*grown/spin - 1.0_wp) < 1.0e-6_wp)
  end subroutine check_spin

  !> Without drag, under water, the energy stays. A float that bobs only loses.
  subroutine check_energy()
    type(case_t) :: case
    type(blocks_t) :: blocks
    type(light_t) :: light
    logical :: initialised(1)
    real(wp) :: first, largest
    integer :: i

    call describe(1.5_wp*rho, [0.12_wp], case)
    case%shape(1)%drag_coefficient = 0.0_wp
    case%body(1)%velocity = [0.1_wp, 0.0_wp, 0.3_wp]
    case%body(1)%angular_velocity = [3.0_wp, 2.0_wp, 5.0_wp]
    call start(case, blocks, light)
    initialised = .false.
    call step(1.0e-12_wp, blocks, initialised, light)
    first = energy(blocks, light)
    do i = 1, 50
      call step(1.0e-3_wp, blocks, initialised, light)
    end do
    call check('energy under water stays', &
               abs(energy(blocks, light)/first - 1.0_wp) < 1.0e-12_wp)
    call make_case(0.9_wp*rho, [level - 0.35_wp*edge], case, blocks, light)   ! at rest at -0.4
    initialised = .false.
    largest = 0.0_wp
    do i = 1, 1000
      call step(1.0e-2_wp, blocks, initialised, light)
      if (i > 500) largest = max(largest, abs(blocks%x(3, 1) - light%level + 0.4_wp*edge))
    end do
    call check('a float bobs ever less, at long steps', largest < 0.03_wp*edge)
  end subroutine check_energy

  !> Energy of a block under water with the water that it carries, less what buoyancy does [J].
  real(wp) function energy(blocks, light)
    type(blocks_t), intent(in) :: blocks
    type(light_t), intent(in) :: light

    energy = kinetic_energy(blocks) + potential_energy(gravity, blocks) &
             - light%density*g*light%wet(1)*blocks%x(3, 1)
  end function energy

  !> A current takes a block along; one that enters keeps its share of it.
  subroutine check_current()
    type(case_t) :: case
    type(blocks_t) :: blocks
    type(light_t) :: light
    logical :: initialised(1)
    integer :: i

    call describe(rho, [0.07_wp], case)
    case%fluid%velocity = [0.2_wp, 0.0_wp, 0.0_wp]
    call start(case, blocks, light)
    initialised = .false.
    do i = 1, 20000
      call step(1.0e-3_wp, blocks, initialised, light)
    end do
    call check('a neutral block swims with the current', &
               abs(blocks%v(1, 1)/0.2_wp - 1.0_wp) < 2.0e-2_wp)
    call check('and no other way', norm2(blocks%v(2:3, 1)) < 1.0e-12_wp)
  end subroutine check_current

  !> A sleeper costs nothing and keeps its force, until the level reaches it.
  subroutine check_sleepers()
    type(case_t) :: case
    type(blocks_t) :: blocks
    type(light_t) :: light
    logical :: initialised(2)
    real(wp) :: force

    call make_case(2300.0_wp, [0.02_wp, level], case, blocks, light)
    initialised = .false.
    call enter_water(gravity, 0.0_wp, blocks, initialised, light)
    blocks%asleep = .true.
    light%force(3, 1) = 7.0_wp   ! a mark: it must not be found anew
    force = light%force(3, 2)
    light%displaced_start = light%displaced_start - area*1.0e-3_wp
    call enter_water(gravity, 0.0_wp, blocks, initialised, light)
    call check('the force on a sleeper stays', abs(light%force(3, 1) - 7.0_wp) <= 0.0_wp)
    call check('a sleeper that sticks out feels the level', light%force(3, 2) > 1.05_wp*force)
  end subroutine check_sleepers

  !> What a restart file does not hold follows from what it holds, to the bit.
  subroutine check_resumed()
    type(case_t) :: case
    type(blocks_t) :: blocks, again
    type(light_t) :: light, copy
    logical :: initialised(1), same(1)
    integer :: i

    call make_case(2300.0_wp, [level + 0.4_wp*edge], case, blocks, light)
    initialised = .false.
    do i = 1, 30
      call step(1.0e-3_wp, blocks, initialised, light)
    end do
    call start(case, again, copy)
    again%x = blocks%x
    again%q = blocks%q
    again%v = blocks%v
    again%l = blocks%l
    again%omega = blocks%omega
    copy%level = light%level
    copy%wet = light%wet
    copy%force = light%force
    same = initialised
    call resume_light(again, copy)
    do i = 1, 30
      call step(1.0e-3_wp, blocks, initialised, light)
      call step(1.0e-3_wp, again, same, copy)
    end do
    call check('a restart goes on as it would have', all(abs(again%v - blocks%v) <= 0.0_wp) &
      .and. all(abs(again%fluid_force - blocks%fluid_force) <= 0.0_wp))
    call check('in the middle of an entry', light%wet(1) > 0.0_wp)
  end subroutine check_resumed

end module test_light_m
