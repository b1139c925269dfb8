!> Liquid and momentum through the faces that the moving bodies leave open, in one step.
module fluid_transport_m
  use kinds_m, only: wp
  use swap_m, only: swap
  use case_types_m, only: case_t, fluid_t
  use grid_m, only: grid_t
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use mixture_m, only: mix_fluid
  use liquid_transport_m, only: liquid_transport_t, liquid_transport_init, begin_transport, &
    begin_part, finish_transport, transport_liquid
  use momentum_conservative_m, only: momentum_t, momentum_init, momentum_begin, momentum_sweep, &
                                     momentum_late
  use viscous_system_m, only: viscous_t
  use elliptic_solver_m, only: elliptic_solver_t
  use pressure_m, only: pressure_t
  implicit none
  private
  public :: fluid_transport_t, fluid_transport_init, span_t, carry_fluid

  real(wp), parameter :: part_courant = 0.9_wp !! of one part at most: a cell gives less than it has
  integer, parameter :: max_parts = 100        !! of one step

  type :: fluid_transport_t
    type(liquid_transport_t) :: liquid
    type(momentum_t) :: momentum
  end type fluid_transport_t

  !> The step at hand.
  type :: span_t
    real(wp) :: dt = 0.0_wp        !! [s]
    real(wp) :: courant = 0.0_wp   !! largest share of itself that a cell gives [-]
    integer :: number = 0          !! of the step, which decides the order of the sweeps
  end type span_t

contains

  !> Allocate what the transport does not borrow, and tell what enters through the sides.
  subroutine fluid_transport_init(case, grid, self)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(fluid_transport_t), intent(out) :: self

    call liquid_transport_init(grid, case%fluid%gravity, self%liquid)
    if (case%fluid%single_phase) then
      self%liquid%sweeps%incoming = 1.0_wp
    else
      self%liquid%sweeps%level = case%fluid%water_level
    end if
    deallocate (self%liquid%flux%solver, self%liquid%flux%band%k)
    deallocate (self%liquid%volumes%w_before, self%liquid%volumes%v_before)
    if (case%numerics%momentum == 'c_ismac') return
    call momentum_init(grid, self%momentum, case%numerics%advection)
    deallocate (self%liquid%volumes%q, self%liquid%volumes%g, self%momentum%momentum)
  end subroutine fluid_transport_init

  !> Borrow solver and coefficients of the pressure and arrays of the viscous stage, which need them
  !! later in the step and keep nothing there; called once more, give them back. Nothing is copied.
  subroutine borrow(viscous, pressure, self)
    type(viscous_t), intent(inout) :: viscous
    type(pressure_t), intent(inout) :: pressure
    type(fluid_transport_t), intent(inout) :: self
    type(elliptic_solver_t), allocatable :: other

    associate (system => pressure%system, flux => self%liquid%flux, volumes => self%liquid%volumes)
      call move_alloc(system%solver, other)
      call move_alloc(flux%solver, system%solver)
      call move_alloc(other, flux%solver)
      call swap(system%operator%cf, flux%band%k)
      call swap(pressure%phi_total, volumes%w_before)
      call swap(viscous%mass, volumes%v_before)
    end associate
    if (allocated(self%momentum%mixed_near)) then
      call swap(viscous%r, self%liquid%volumes%q)
      call swap(viscous%s, self%liquid%volumes%g)
      call swap(viscous%y, self%momentum%momentum)
    end if
  end subroutine borrow

  !> Carry liquid and momentum, direction by direction; new density and viscosity. With C-ISMAC
  !! momentum waits for the predictor, which uses the volumes of the same parts.
  subroutine carry_fluid(case, grid, before, after, span, flow, viscous, pressure, self)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: before, after   !! at the start and the end of the step
    type(span_t), intent(in) :: span
    type(flow_t), intent(inout) :: flow   !! halos filled on entry and return
    type(viscous_t), intent(inout) :: viscous            !! lends arrays
    type(pressure_t), intent(inout) :: pressure          !! lends its solver and arrays
    type(fluid_transport_t), intent(inout) :: self

    self%liquid%parts = parts_of_step(span%courant)
    call borrow(viscous, pressure, self)
    if (case%numerics%momentum == 'c_ismac') then
      call transport_liquid(grid, before, after, span%dt, span%number, self%liquid, flow)
    else
      call carry_all(case%fluid, grid, before, after, span, flow, self%liquid, self%momentum)
    end if
    call borrow(viscous, pressure, self)
    call mix_fluid(case%fluid, flow)
  end subroutine carry_fluid

  !> Liquid and momentum together.
  subroutine carry_all(fluid, grid, before, after, span, flow, liquid, momentum)
    type(fluid_t), intent(in) :: fluid
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: before, after
    type(span_t), intent(in) :: span
    type(flow_t), intent(inout) :: flow
    type(liquid_transport_t), intent(inout) :: liquid
    type(momentum_t), intent(inout) :: momentum
    integer :: n, part

    call begin_transport(grid, before, after, span%dt, liquid, flow)
    do part = 1, liquid%parts
      call begin_part(grid, before, part, span%number, liquid)
      call momentum_begin(grid, fluid, liquid%volumes%w, liquid%volumes%v, liquid%volumes%c, &
                          flow%u, momentum)
      do n = 1, 3
        call momentum_sweep(grid, fluid, before, liquid%order(n), liquid, flow%u, momentum)
      end do
      call momentum_late(grid, fluid, liquid, flow%u, momentum)
    end do
    call finish_transport(grid, after, liquid, flow)
  end subroutine carry_all

  !> Number of equal parts in which the volumes of a step move, so that none passes the Courant
  !! number that the sweeps can follow.
  pure function parts_of_step(courant) result(parts)
    real(wp), intent(in) :: courant   !! of the whole step [-]
    integer :: parts
    real(wp), parameter :: round_off = 1.0e-9_wp

    parts = ceiling(min(courant/part_courant - round_off, real(max_parts, wp)))
    parts = max(parts, 1)
  end function parts_of_step

end module fluid_transport_m
