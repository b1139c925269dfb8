!> Liquid and momentum through the faces that the moving bodies leave open, in one step.
module fluid_transport_m
  use kinds_m, only: wp
  use case_types_m, only: case_t
  use grid_m, only: grid_t
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use mixture_m, only: mix_fluid
  use liquid_transport_m, only: liquid_transport_t, liquid_transport_init, begin_transport, &
    begin_part, finish_transport, transport_liquid
  use momentum_conservative_m, only: momentum_t, momentum_init, momentum_begin, momentum_sweep, &
                                     momentum_late
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

  !> Allocate, and tell what enters through the sides.
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
    call momentum_init(grid, self%momentum, case%numerics%advection)
  end subroutine fluid_transport_init

  !> Carry liquid and momentum, direction by direction; new density and viscosity. With C-ISMAC
  !! momentum waits for the predictor, which uses the same volumes (`self%liquid%q_step`).
  subroutine carry_fluid(case, grid, before, after, span, flow, self)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: before, after   !! at the start and the end of the step
    type(span_t), intent(in) :: span
    type(flow_t), intent(inout) :: flow   !! halos filled on entry and return
    type(fluid_transport_t), intent(inout) :: self
    integer :: n, part

    associate (fluid => case%fluid, liquid => self%liquid, momentum => self%momentum)
      liquid%parts = parts_of_step(span%courant)
      if (case%numerics%momentum == 'c_ismac') then
        call transport_liquid(grid, before, after, span%dt, span%number, liquid, flow)
        call mix_fluid(fluid, flow)
        return
      end if
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
      call mix_fluid(fluid, flow)
    end associate
  end subroutine carry_fluid

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
