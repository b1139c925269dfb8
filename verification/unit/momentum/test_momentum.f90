!> Transport of momentum: uniform velocity, balance, order of accuracy, moving boxes.
module test_momentum_m
  use check_m, only: check, wp, pi
  use case_types_m, only: fluid_t, water_t
  use grid_m, only: grid_t
  use fields_m, only: flow_t, flow_init
  use boundary_m, only: fill_velocity_halo
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use extended_fraction_m, only: extend_fraction
  use elliptic_solver_m, only: elliptic_solver_t, elliptic_solver_init
  use liquid_transport_m, only: liquid_transport_t, liquid_transport_init, begin_transport, &
    begin_subcycle, finish_transport
  use liquid_fill_m, only: fill_liquid
  use mixture_m, only: mass_through
  use momentum_conservative_m, only: momentum_t, momentum_init, momentum_begin, momentum_sweep, &
    momentum_implicit
  use box_solid_m, only: set_boxes, simple_grid
  implicit none
  private
  public :: test_momentum

  real(wp), parameter :: gravity(3) = [0.0_wp, 0.0_wp, -9.81_wp], &
    stream(3) = [0.7_wp, -0.4_wp, 0.3_wp]   !! uniform velocity [m/s]
  logical, parameter :: everywhere(3) = .true., sideways(3) = [.true., .true., .false.]
  type(grid_t) :: grid
  type(solid_geometry_t) :: old, new
  type(flow_t) :: flow
  type(liquid_transport_t) :: transport
  type(momentum_t) :: momentum
  real(wp) :: nothing(3, 0)
  type(fluid_t) :: fluid

contains

  subroutine test_momentum()
    call check('mass of a mixed volume', mass_through(fluid_t(liquid_density=10.0_wp, &
      gas_density=2.0_wp), 0.5_wp, 0.1_wp), 1.8_wp, 1.0e-15_wp)
    call uniform_through_an_interface(1)
    call uniform_through_an_interface(3)
    call momentum_of_a_period()
    call boxes_in_uniform_fluid()
    call order_of_accuracy()
    call donor_value()
  end subroutine test_momentum

  !> Boxes of liquid and of solid in gas.
  subroutine start(n, length, periodic, water, low, high)
    integer, intent(in) :: n(3)
    real(wp), intent(in) :: length(3)
    logical, intent(in) :: periodic(3)
    type(water_t), intent(in) :: water(:)
    real(wp), intent(in) :: low(:, :), high(:, :)   !! (3, boxes) solid [m]

    call simple_grid(n, length, grid, periodic)
    call flow_init(grid, flow)
    call solid_geometry_init(grid, old)
    call solid_geometry_init(grid, new)
    call liquid_transport_init(grid, gravity, transport)
    call momentum_init(grid, momentum)
    call set_boxes(grid, low, high, old)
    call set_boxes(grid, low, high, new)
    call fill_liquid(grid, fluid, water, new, flow)
    call extend_fraction(grid, new, transport%extension, flow)
  end subroutine start

  !> One step of liquid and momentum.
  subroutine carry(dt, step, subcycles)
    real(wp), intent(in) :: dt
    integer, intent(in) :: step
    integer, intent(in), optional :: subcycles   !! of the step, else 1
    type(elliptic_solver_t) :: solver
    integer :: n, subcycle

    transport%subcycles = 1
    if (present(subcycles)) transport%subcycles = subcycles
    call elliptic_solver_init(grid, solver)
    call begin_transport(grid, old, new, dt, solver, transport, flow)
    do subcycle = 1, transport%subcycles
      call begin_subcycle(grid, old, subcycle, step, transport)
      call momentum_begin(grid, fluid, transport%volumes%w, transport%volumes%v, &
                          transport%volumes%c, flow%u, momentum)
      do n = 1, 3
        call momentum_sweep(grid, fluid, old, transport%order(n), transport, flow%u, momentum)
      end do
      call momentum_implicit(grid, fluid, transport, flow%u, momentum)
    end do
    call finish_transport(grid, new, transport, flow)
  end subroutine carry

  !> Face velocity of a vortex about the y axis, without divergence, with a uniform stream.
  subroutine vortex(speed, with_stream)
    real(wp), intent(in) :: speed, with_stream(3)
    integer :: i, k

    do concurrent (k=1:grid%n(3) + 1, i=1:grid%n(1) + 1)
      flow%uf(i, :, k, 1) = with_stream(1) + (psi(speed, i, k + 1) - psi(speed, i, k))/grid%h(3)
      flow%uf(i, :, k, 3) = with_stream(3) - (psi(speed, i + 1, k) - psi(speed, i, k))/grid%h(1)
    end do
    flow%uf(:, :, :, 2) = with_stream(2)
  end subroutine vortex

  !> Stream function of the vortex at a corner of cell (i, k) [m2/s].
  pure real(wp) function psi(speed, i, k) result(value)
    real(wp), intent(in) :: speed   !! [m/s]
    integer, intent(in) :: i, k

    value = speed*grid%length(1)/pi*sin(pi*real(i - 1, wp)/real(grid%n(1), wp)) &
            *sin(pi*real(k - 1, wp)/real(grid%n(3), wp))
  end function psi

  !> Largest change of a velocity that was uniform, in cells that hold more than the given share.
  real(wp) function deviation(min_volume) result(worst)
    real(wp), intent(in) :: min_volume   !! [V]
    integer :: d

    worst = 0.0_wp
    associate (n => grid%n)
      do d = 1, 3
        worst = max(worst, maxval(abs(flow%u(1:n(1), 1:n(2), 1:n(3), d) - stream(d)), &
          mask=flow%fluid_volume(1:n(1), 1:n(2), 1:n(3)) > min_volume*grid%volume))
      end do
    end associate
  end function deviation

  !> A uniform velocity carried by another, sheared flow through boxes of liquid stays.
  subroutine uniform_through_an_interface(subcycles)
    integer, intent(in) :: subcycles   !! of each step
    integer :: step, d

    call start([16, 8, 12], [0.16_wp, 0.08_wp, 0.12_wp], everywhere, &
      [water_t(min=[0.033_wp, 0.011_wp, 0.027_wp], max=[0.091_wp, 0.057_wp, 0.083_wp])], &
      nothing, nothing)
    call vortex(0.2_wp, stream)
    do d = 1, 3
      flow%u(:, :, :, d) = stream(d)
    end do
    do step = 1, 8
      call carry(2.5e-3_wp*real(subcycles, wp), step, subcycles)
    end do
    call check('uniform velocity through an interface', deviation(0.0_wp), 0.0_wp, 1.0e-14_wp)
    call check('an interface is there', count(abs(flow%c(1:16, 1:8, 1:12) - 0.5_wp) < 0.49_wp) > 50)
    call check('subcycles keep cells from being small', transport%small%n_implicit, 0)
  end subroutine uniform_through_an_interface

  !> Total momentum of a domain without sides, velocity and liquid of any form.
  subroutine momentum_of_a_period()
    real(wp) :: before(3), after(3), scale
    integer :: i, j, k, step

    call start([16, 8, 12], [0.16_wp, 0.08_wp, 0.12_wp], everywhere, &
      [water_t(min=[0.033_wp, 0.011_wp, 0.027_wp], max=[0.091_wp, 0.057_wp, 0.083_wp])], &
      nothing, nothing)
    call vortex(0.2_wp, stream)
    do concurrent (k=1:12, j=1:8, i=1:16)
      flow%u(i, j, k, :) = [sin(0.9_wp*i), 0.3_wp + cos(0.7_wp*j)*sin(1.3_wp*k), cos(0.4_wp*i*j)]
    end do
    call fill_velocity_halo(grid, flow%u)
    before = total_momentum()
    scale = sum(mass())
    do step = 1, 6
      call carry(2.5e-3_wp, step)
    end do
    after = total_momentum()
    call check('momentum of a period', after, before, 1.0e-14_wp*scale)
    call check('mass of a period', sum(mass()), scale, 1.0e-14_wp*scale)
  end subroutine momentum_of_a_period

  function total_momentum() result(p)
    real(wp) :: p(3)
    integer :: d

    associate (n => grid%n)
      p = [(sum(mass()*flow%u(1:n(1), 1:n(2), 1:n(3), d)), d=1, 3)]
    end associate
  end function total_momentum

  !> Mass of the fluid in each cell [kg].
  function mass()
    real(wp) :: mass(grid%n(1), grid%n(2), grid%n(3))

    associate (n => grid%n)
      mass = mass_through(fluid, flow%fluid_volume(1:n(1), 1:n(2), 1:n(3)), &
        flow%liquid(1:n(1), 1:n(2), 1:n(3)))
    end associate
  end function mass

  !> A box dips into liquid, moves and leaves through the top; the fluid keeps its velocity.
  subroutine boxes_in_uniform_fluid()
    real(wp), parameter :: half(3) = [0.033_wp, 0.027_wp, 0.0318_wp]
    real(wp) :: centre(3), worst, angle
    integer :: step, d, small

    fluid%water_level = 0.1013_wp
    centre = [0.0771_wp, 0.0613_wp, 0.15_wp]
    call start([16, 12, 20], [0.16_wp, 0.12_wp, 0.2_wp], sideways, [water_t ::], &
      reshape(centre - half, [3, 1]), reshape(centre + half, [3, 1]))
    do d = 1, 3
      flow%u(:, :, :, d) = stream(d)
    end do
    call fill_velocity_halo(grid, flow%u)
    worst = 0.0_wp
    small = 0
    do step = 1, 20
      call set_boxes(grid, centre - half, centre + half, old)
      angle = 2.0_wp*pi*real(step, wp)/20.0_wp
      centre = [0.0771_wp + 0.01_wp*sin(2*angle), 0.0613_wp, 0.15_wp - 0.05_wp*sin(angle)]
      call set_boxes(grid, centre - half, centre + half, new)
      call carry(0.01_wp, step)
      worst = max(worst, deviation(1.0e-9_wp))
      do d = 1, 3   ! the velocity stage gives closed cells the velocity of the body
        where (new%alpha >= 1.0_wp) flow%u(:, :, :, d) = stream(d)
      end do
      small = max(small, transport%small%n_implicit)
    end do
    call check('uniform velocity around a moving box', worst, 0.0_wp, 1.0e-9_wp)
    call check('cells opened and closed', small > 0)
    fluid = fluid_t()
  end subroutine boxes_in_uniform_fluid

  !> A smooth velocity rides on a uniform stream in one phase; the step is refined with the grid.
  subroutine order_of_accuracy()
    real(wp) :: coarse, fine

    coarse = wave_error(16, 0.25_wp)
    fine = wave_error(32, 0.25_wp)
    call check('second order', coarse/fine > 3.8_wp)
    call check('error at 32 cells', fine < 8.0e-3_wp)
  end subroutine order_of_accuracy

  !> Mean error of a sine wave after half a period at a given Courant number.
  real(wp) function wave_error(n, courant) result(error)
    integer, intent(in) :: n
    real(wp), intent(in) :: courant
    real(wp) :: dt, exact(n)
    integer :: i, step, steps

    fluid%single_phase = .true.
    call start([n, 4, 4], [1.0_wp, 0.25_wp, 0.25_wp], everywhere, [water_t ::], nothing, nothing)
    flow%uf(:, :, :, 1) = 1.0_wp
    flow%u(:, :, :, 1) = 1.0_wp
    do i = 1, n
      flow%u(i, :, :, 2) = wave(grid%face(i, 1))
    end do
    call fill_velocity_halo(grid, flow%u)
    steps = nint(0.5_wp*n/courant)
    dt = 0.5_wp/real(steps, wp)
    do step = 1, steps
      call carry(dt, step)
    end do
    do i = 1, n
      exact(i) = wave(grid%face(i, 1) - 0.5_wp)
    end do
    error = sum(abs(flow%u(1:n, 2, 2, 2) - exact))/real(n, wp)
    fluid%single_phase = .false.
  end function wave_error

  !> With 'upwind' a face carries the value of its donor: u_i := (1 - C) u_i + C u_(i-1).
  subroutine donor_value()
    real(wp), parameter :: courant = 0.3_wp
    real(wp) :: before(0:16)

    fluid%single_phase = .true.
    call start([16, 4, 4], [1.0_wp, 0.25_wp, 0.25_wp], everywhere, [water_t ::], nothing, nothing)
    call momentum_init(grid, momentum, 'upwind')
    flow%uf(:, :, :, 1) = 1.0_wp
    flow%u(:, :, :, 1) = 1.0_wp
    flow%u(1:16, :, :, 2) = spread(spread(sin([1.0_wp, 2.0_wp, 4.0_wp, 4.5_wp, 9.0_wp, 7.0_wp, &
      6.0_wp, 2.5_wp, 3.0_wp, 5.5_wp, 8.0_wp, 0.5_wp, 1.5_wp, 6.5_wp, 7.5_wp, 5.0_wp]), 2, &
      size(flow%u, 2)), 3, size(flow%u, 3))
    call fill_velocity_halo(grid, flow%u)
    before = flow%u(0:16, 2, 2, 2)
    call carry(courant*grid%h(1), 1)
    call check('value of the donor', flow%u(1:16, 2, 2, 2), &
               (1.0_wp - courant)*before(1:16) + courant*before(0:15), 1.0e-14_wp)
    fluid%single_phase = .false.
  end subroutine donor_value

  !> Mean of a sine over the cell above face x.
  pure real(wp) function wave(x) result(value)
    real(wp), intent(in) :: x   !! [m]

    value = (cos(2.0_wp*pi*x) - cos(2.0_wp*pi*(x + grid%h(1))))/(2.0_wp*pi*grid%h(1))
  end function wave

end module test_momentum_m
