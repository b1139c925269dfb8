!> Whole steps: water beside an outflow, a current, length of the step, a release, noise in gas.
module test_step_m
  use check_m, only: check, wp
  use errors_m, only: to_text
  use rigid_body_m, only: let_go
  use liquid_fill_m, only: liquid_volume
  use boundary_m, only: fill_scalar_halo
  use one_body_m, only: random_numbers
  use world_m, only: world_t, set_up, body, run
  implicit none
  private
  public :: test_step

  real(wp), parameter :: g = 9.81_wp

contains

  subroutine test_step()
    call water_beside_outflow()
    call uniform_current()
    call moved_block()
    call slice_with_odd_cells()
    call length_of_steps()
    call growth_of_steps()
    call spinning_ball()
    call release_into_water()
    call comes_as_another_goes()
    call comes_late_and_is_held()
    call nobody_is_left()
    call set_down_softly()
    call slice_of_any_width(1.0_wp)
    call slice_of_any_width(1.0e-3_wp)
    call noise_in_gas(0.0_wp, 1.0e-3_wp)
    call noise_in_gas(1.0_wp, 2.0e-3_wp)
  end subroutine test_step

  !> Groups in a tank half full, with boxes of 4 cm; other variables of &run and &fluid.
  subroutine tank(groups, sim, variables, fluid)
    character(*), intent(in) :: groups
    type(world_t), intent(out) :: sim
    character(*), intent(in), optional :: variables, fluid   !! else dt=2e-3, water_level=.0613
    character(:), allocatable :: text

    text = '&run t_end=1 dt=2e-3'
    if (present(variables)) text = '&run t_end=1 '//variables
    if (present(fluid)) then
      text = text//'/ &fluid '//fluid
    else if (index(text, 'dry') == 0) then
      text = text//'/ &fluid water_level=.0613'
    end if
    if (index(groups, '&grid') == 0) text = text//'/ &grid cells=12,8,12 length=.12,.08,.12'
    if (index(groups, '&numerics') == 0) text = text//'/ &numerics divergence_tolerance=1e-8'
    if (index(groups, '&shape') == 0) text = text &
      //'/ &shape name="box" kind="box" size=.04,.03,.035'
    call set_up(text//'/ '//groups, sim)
  end subroutine tank

  !> Water at rest at the level an outflow keeps, and a held block that sticks out of that side.
  subroutine water_beside_outflow()
    type(world_t) :: sim
    real(wp) :: weight

    call tank('&boundary x_max="outflow"/ &body shape="box" position=.1113,.0389,.0371 fixed=T/', &
      sim)   ! 1.1 of 4 cm outside
    call run(sim, 3)
    weight = 998.2_wp*g*0.04_wp*0.03_wp*0.035_wp
    call check('outflow: water at rest', sim%flow%u(1:12, 1:8, 1:12, :), 0.0_wp, 1.0e-8_wp)
    call check('outflow: no push sideways', sim%blocks%fluid_force(1, 1), 0.0_wp, 1.0e-6_wp*weight)
    call check('outflow: nothing has left', sim%flow%liquid_inflow, 0.0_wp, 1.0e-16_wp)
  end subroutine water_beside_outflow

  !> In by one side and out by the other; the liquid of the balance is that of the level.
  subroutine uniform_current()
    type(world_t) :: sim
    real(wp), parameter :: speed = 0.3_wp   !! [m/s]
    integer :: step

    call tank('&boundary x_min="outflow" x_max="inflow" y_min="slip" y_max="slip" z_min="slip" ' &
      //'x_max_velocity=-.3,0,0/', sim, fluid='water_level=.0613 velocity=-.3,0,0')
    do step = 1, 5
      call run(sim, 1)
      call check('current: stays uniform', maxval(abs(sim%flow%u(1:12, 1:8, 1:12, 1) + speed)) &
                 + maxval(abs(sim%flow%u(1:12, 1:8, 1:12, 2:3))), 0.0_wp, 1.0e-8_wp)
    end do
    call check('current: as much out as in', abs(sim%flow%liquid_inflow) <= 1.0e-12_wp)
    call check('current: what enters', sum(sim%transport%liquid%side(8*12 + 1:2*8*12)), &
               speed*sim%clock%dt*0.08_wp*0.0613_wp, 1.0e-15_wp)
  end subroutine uniform_current

  !> A block moved at a constant rate goes on whatever pushes, feels the water, and keeps the water.
  subroutine moved_block()
    type(world_t) :: sim
    real(wp), parameter :: rate(3) = [0.2_wp, -0.1_wp, 0.15_wp], spin(3) = [0.0_wp, 0.0_wp, 5.0_wp]
    real(wp), parameter :: place(3) = [0.0613_wp, 0.0389_wp, 0.0571_wp]
    real(wp) :: before

    call tank(body('box', place, rate, more='fixed=T angular_velocity=0,0,5'), sim)
    before = liquid_volume(sim%grid, sim%flow%liquid)
    call run(sim, 5)
    call check('moved: place', sim%blocks%x(:, 1) - place - rate*sim%clock%t, 0.0_wp, 1.0e-14_wp)
    call check('moved block: speed', sim%blocks%v(:, 1) - rate, 0.0_wp)
    call check('moved: turned', sim%blocks%q(4, 1), sin(0.5_wp*spin(3)*sim%clock%t), 1.0e-14_wp)
    call check('moved: water', liquid_volume(sim%grid, sim%flow%liquid), before, 1.0e-13_wp*before)
    call check('moved block: divergence', sim%report%pressure%divergence <= 1.0e-8_wp)
    call check('moved block: feels the water', norm2(sim%blocks%fluid_force(:, 1)) > 0.1_wp)
  end subroutine moved_block

  !> Odd numbers of cells, one of them across: a slice between slip walls is the same as one between
  !! periodic sides, and nothing moves across it.
  subroutine slice_with_odd_cells()
    type(world_t) :: sim(2)
    integer :: n
    character(8), parameter :: kind(2) = [character(8) :: 'slip', 'periodic']

    do n = 1, 2
      call tank('&grid cells=13,1,11 length=.12,.01,.12/ &boundary y_min="'//trim(kind(n)) &
        //'" y_max="'//trim(kind(n))//'"/ &water min=0,-1,0 max=.051,1,.083/', sim(n), fluid='')
      call run(sim(n), 10)
      call check('solved', sim(n)%report%pressure%converged &
                 .and. sim(n)%coupling%viscous%converged)
      call check('slice: water falls', minval(sim(n)%flow%u(1:13, 1, 1:11, 3)) < -0.02_wp)
      call check('slice: nothing across', sim(n)%flow%u(1:13, 1, 1:11, 2), 0.0_wp, 1.0e-15_wp)
      call check('slice: volume', liquid_volume(sim(n)%grid, sim(n)%flow%liquid), &
                 0.051_wp*0.01_wp*0.083_wp, 1.0e-17_wp)
    end do
    call check('slice: slip or periodic', &
      sim(1)%flow%u(1:13, 1, 1:11, :) - sim(2)%flow%u(1:13, 1, 1:11, :), 0.0_wp, 1.0e-9_wp)
  end subroutine slice_with_odd_cells

  !> Steps obey the Courant number of fluid and blocks, and land on a release.
  subroutine length_of_steps()
    type(world_t) :: sim

    call tank('&body shape="box" position=.0613,.0389,.09 velocity=0,0,-4/ ' &
      //'&body shape="box" position=.0613,.0389,.03 release_time=2e-3/', sim)
    call run(sim, 1)
    call check('a fast block shortens the step', sim%clock%dt <= 0.5_wp*0.01_wp/6.0_wp)
    call check('Courant number', sim%report%cfl <= 0.5_wp + 1.0e-12_wp)
    call check('not released before its time', .not. sim%blocks%present(2))
    do while (sim%clock%t < 2.0e-3_wp - 1.0e-9_wp)
      call run(sim, 1)
    end do
    call check('a step ends at the release', sim%clock%t, 2.0e-3_wp, 1.0e-12_wp)
    call run(sim, 1)
    call check('released', sim%blocks%present(2))
  end subroutine length_of_steps

  !> With fluid a step is at most twice as long as the one before, whatever the case allows.
  subroutine growth_of_steps()
    type(world_t) :: sim(2)
    character(7), parameter :: physics(2) = [character(7) :: 'coupled', 'dry']
    real(wp), parameter :: short = 1.0e-4_wp   !! [s]
    integer :: n

    do n = 1, 2
      call tank('', sim(n), 'dt=1e-4 physics="'//trim(physics(n))//'"')
      call run(sim(n), 1)
      call check('growth: the first step', sim(n)%clock%dt, short, 1.0e-9_wp*short)
      sim(n)%case%run%dt = 10.0_wp*short
      call run(sim(n), 1)
      call check('growth: the second, '//physics(n), sim(n)%clock%dt, merge(2, 10, n == 1)*short, &
                 1.0e-3_wp*short)
    end do
  end subroutine growth_of_steps

  !> A ball that spins moves its surface, not the fluid; its surface speed counts all the same.
  subroutine spinning_ball()
    type(world_t) :: sim
    real(wp), parameter :: spin = 400.0_wp   !! [rad/s]

    call tank('&shape name="ball" kind="sphere" size=.04/ &body shape="ball" ' &
      //'position=.0613,.0389,.03 angular_velocity=0,400,0/', sim)
    call run(sim, 1)
    call check('a spinning ball shortens the step', sim%clock%dt, &
               0.5_wp*0.01_wp/(1.5_wp*spin*0.02_wp), 0.02_wp*0.01_wp/(spin*0.02_wp))
  end subroutine spinning_ball

  !> The liquid in the place of a released block is not lost.
  subroutine release_into_water()
    type(world_t) :: sim
    real(wp) :: before, row(2)

    call tank('&body shape="box" position=.0613,.0389,.03 release_time=2e-3/', sim)
    before = liquid_volume(sim%grid, sim%flow%liquid)
    row(1) = sum(sim%flow%liquid(1:12, 1:8, 7))
    call run(sim, 1)
    call check('before: full tank', before, 0.12_wp*0.08_wp*0.0613_wp, 1.0e-14_wp*before)
    call run(sim, 1)
    row(2) = sum(sim%flow%liquid(1:12, 1:8, 7))
    call check('release: it is there', sim%blocks%present(1))
    call check('its volume', liquid_volume(sim%grid, sim%flow%liquid), before, 1.0e-12_wp*before)
    call check('release: the level has risen by the block', row(2) - row(1), &
               0.04_wp*0.03_wp*0.035_wp, 0.05_wp*0.04_wp*0.03_wp*0.035_wp)
    call check('release: it falls', sim%blocks%v(3, 1) < 0.0_wp)
  end subroutine release_into_water

  !> A box passes the outflow in the step in which another comes: what flows in fills its place.
  subroutine comes_as_another_goes()
    type(world_t) :: sim

    call tank('&boundary x_max="outflow"/ &body shape="box" position=.1195,.0389,.03 ' &
      //'velocity=.5,0,0/ &body shape="box" position=.04,.0389,.03 release_time=2e-3/', sim)
    call run(sim, 2)
    call check('one came, one is out', all(sim%blocks%present .eqv. [.false., .true.]))
    call check('no gas in its place', minval(sim%flow%c(1:12, 1:8, 1:5)) > 0.999_wp)
  end subroutine comes_as_another_goes

  !> A held box that comes after the start carries what falls on it.
  subroutine comes_late_and_is_held()
    type(world_t) :: sim

    call tank('&body shape="box" position=.06,.04,.03 fixed=T release_time=.01/ ' &
      //'&body shape="box" position=.06,.04,.075/', sim, 'dt=2e-3 physics="dry"')
    call run(sim, 150)
    call check('it lies on it', sim%blocks%x(3, 2), 0.03_wp + 0.035_wp, 1.0e-4_wp)
  end subroutine comes_late_and_is_held

  !> Where no free block is left that could move, all is at rest.
  subroutine nobody_is_left()
    type(world_t) :: sim

    call tank('&body shape="box" position=.06,.04,.03 fixed=T/ &drop shape="box" ' &
      //'position=.06,.04,.03 if_blocked="skip"/', sim, 'dt=2e-3 physics="dry"')
    call run(sim, 2)
    call check('skipped: the others rest', sim%clock%rest_began >= 0.0_wp)
  end subroutine nobody_is_left

  !> However far it is lowered in a step, a block slows down above the floor.
  subroutine set_down_softly()
    type(world_t) :: sim
    real(wp) :: up
    integer :: i

    call tank('&drop shape="box" position=.06,.04,.1 lowering_speed=.3 release="set_down"/', sim, &
      'dt=.02 physics="dry"')
    up = 0.0_wp
    do i = 1, 45
      call run(sim, 1)
      up = max(up, sim%blocks%v(3, 1))
    end do
    call check('it was set down', sim%blocks%status(1), let_go)
    call check('and does not hop', up < 0.1_wp)
  end subroutine set_down_softly

  !> How wide a slice is says nothing: the water around a held box is the same.
  subroutine slice_of_any_width(viscosity)
    real(wp), intent(in) :: viscosity   !! [Pa s]
    character(4), parameter :: width(2) = ['.01 ', '.001']
    type(world_t) :: sim(2)
    integer :: n

    do n = 1, 2
      call tank('&grid cells=12,1,12 length=.12,'//width(n)//',.12/ &boundary y_min="slip" ' &
        //'y_max="slip"/ &shape name="b" kind="box" size=.037,.02,.035/ &body shape="b" ' &
        //'position=.0613,.0005,.0571 fixed=T/', sim(n), fluid='single_phase=T velocity=.5,0,0 ' &
        //'liquid_viscosity='//to_text(viscosity))
      call run(sim(n), 5)
    end do
    call check('slices of two widths', sim(1)%flow%u(1:12, 1, 1:12, :) &
      - sim(2)%flow%u(1:12, 1, 1:12, :), 0.0_wp, 1.0e-6_wp)
  end subroutine slice_of_any_width

  !> The old pressure of gas is a guess that the solve replaces. Noise in it hardly changes the
  !! velocity of a block that falls through the level, with gas in its cut cells: without viscosity
  !! by 7e-5 of what the noise as a pressure under the block would give, by small cells; with it by
  !! 0.017, as the walls rub the gas before the solve. With the old acceleration of gas in the faces
  !! at walls it is 0.18 either way. C-ISMAC carries the noise into the liquid, and is not tried.
  subroutine noise_in_gas(viscosity, most)
    real(wp), intent(in) :: viscosity   !! of both fluids over that of water and air
    real(wp), intent(in) :: most        !! change, in that unit
    real(wp), parameter :: noise = 1.0e5_wp   !! [Pa]
    real(wp) :: unit, change
    type(world_t) :: calm, noisy

    call fall_into_water(viscosity, 0.0_wp, calm)
    call fall_into_water(viscosity, noise, noisy)
    unit = noise*2.0_wp*1.5_wp*calm%clock%dt/calm%blocks%mass(1)
    change = norm2(noisy%blocks%v(:, 1) - calm%blocks%v(:, 1))
    call check('noise in gas: the block', change/unit, 0.0_wp, most)
    call check('noise in gas: there was some', change > 0.0_wp)
  end subroutine noise_in_gas

  !> Four steps of a box of 2 m that falls through the level; before the last of them the pressure
  !! of cells with more gas than liquid gets noise.
  subroutine fall_into_water(viscosity, noise, sim)
    real(wp), intent(in) :: viscosity, noise   !! over that of water and air; [Pa]
    type(world_t), intent(inout) :: sim
    real(wp) :: r(12)
    integer :: seed, j, k

    call tank('&grid cells=12,8,12 length=4.8,3.2,4.8/ &numerics divergence_tolerance=1e-9/ ' &
      //'&shape name="box" kind="box" size=2,1.5,1.75/ &body shape="box" ' &
      //'position=2.452,1.556,2.684 velocity=.3,0,-4 angular_velocity=.2,.4,0/', sim, 'dt=.02', &
      'water_level=2.452 liquid_viscosity='//to_text(viscosity*1.002e-3_wp) &
      //' gas_viscosity='//to_text(viscosity*1.82e-5_wp))
    call run(sim, 3)
    seed = 7
    do k = 1, 12
      do j = 1, 8
        call random_numbers(seed, r)
        where (sim%flow%c(1:12, j, k) < 0.5_wp) &
          sim%flow%p(1:12, j, k) = sim%flow%p(1:12, j, k) + noise*r
      end do
    end do
    call fill_scalar_halo(sim%grid, sim%flow%p)
    call run(sim, 1)
    call check('noise in gas', sim%report%pressure%converged .and. sim%coupling%viscous%converged)
  end subroutine fall_into_water

end module test_step_m
