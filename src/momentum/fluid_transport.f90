!> Liquid and momentum through the faces that the moving bodies leave open, in one step.
module fluid_transport_m
  use kinds_m, only: wp
  use case_types_m, only: case_t, fluid_t
  use grid_m, only: grid_t
  use scratch_m, only: scratch_t, take, give
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use liquid_transport_m, only: liquid_transport_t, liquid_transport_init, begin_subcycle, &
                                small_cells, finish_transport
  use liquid_sweep_m, only: sweep_volumes
  use momentum_conservative_m, only: momentum_t, momentum_init, momentum_begin, momentum_sweep, &
                                     momentum_implicit
  implicit none
  private
  public :: fluid_transport_t, fluid_transport_init, begin_carrying, carry_fluid, finish_carrying

  real(wp), parameter :: subcycle_courant = 0.9_wp
    !! of one subcycle at most: a cell gives less than it has
  integer, parameter :: max_subcycles = 100    !! of one step

  type :: fluid_transport_t
    type(liquid_transport_t) :: liquid
    type(momentum_t) :: momentum
    logical :: carries_momentum = .true.   !! with the liquid; C-ISMAC does it in its predictor
  end type fluid_transport_t

contains

  !> Allocate but the work arrays of the pool; what enters through the sides.
  subroutine fluid_transport_init(case, grid, self)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(fluid_transport_t), intent(out) :: self

    call liquid_transport_init(grid, case%fluid%gravity, self%liquid, pooled=.true.)
    if (case%fluid%single_phase) then
      self%liquid%sweeps%incoming = 1.0_wp
    else
      self%liquid%sweeps%level = case%fluid%water_level
    end if
    self%carries_momentum = case%numerics%momentum /= 'c_ismac'
    if (.not. self%carries_momentum) return
    call momentum_init(grid, self%momentum, case%numerics%advection, pooled=.true.)
  end subroutine fluid_transport_init

  !> The subcycles of a step and its work arrays.
  subroutine begin_carrying(courant, scratch, self)
    real(wp), intent(in) :: courant   !! largest share of itself that a cell gives in the step [-]
    type(scratch_t), intent(inout) :: scratch
    type(fluid_transport_t), intent(inout) :: self
    real(wp), parameter :: round_off = 1.0e-9_wp

    ! Number of equal subcycles in which the volumes of a step move, so that none passes the Courant
    ! number that the sweeps can follow.
    self%liquid%subcycles = ceiling(min(courant/subcycle_courant - round_off, &
                                        real(max_subcycles, wp)))
    self%liquid%subcycles = max(self%liquid%subcycles, 1)
    associate (volumes => self%liquid%volumes)   ! nobody needs them after the transport
      call take(scratch, volumes%w)
      call take(scratch, volumes%v)
      call take(scratch, volumes%c)
      call take(scratch, volumes%w_before)
      call take(scratch, volumes%v_before)
      call take(scratch, volumes%q)
      call take(scratch, volumes%g)
    end associate
    if (self%carries_momentum) call take(scratch, self%momentum%momentum)
  end subroutine begin_carrying

  !> Stage 7: liquid and momentum pass the faces, direction by direction, small cells last. With
  !! C-ISMAC momentum waits for the predictor, which uses the volumes of the same subcycles.
  subroutine carry_fluid(fluid, grid, before, step, flow, self)
    type(fluid_t), intent(in) :: fluid
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: before   !! bodies at the start of the step
    integer, intent(in) :: step   !! its number, which decides the order of the sweeps
    type(flow_t), intent(inout) :: flow            !! its velocity
    type(fluid_transport_t), intent(inout) :: self
    integer :: n, subcycle

    associate (liquid => self%liquid, volumes => self%liquid%volumes, momentum => self%momentum)
      do subcycle = 1, liquid%subcycles
        call begin_subcycle(grid, before, subcycle, step, liquid)
        if (self%carries_momentum) then
          call momentum_begin(grid, fluid, volumes%w, volumes%v, volumes%c, flow%u, momentum)
          do n = 1, 3
            call momentum_sweep(grid, fluid, before, liquid%order(n), liquid, flow%u, momentum)
          end do
          call momentum_implicit(grid, fluid, liquid, flow%u, momentum)
        else
          do n = 1, 3
            call sweep_volumes(grid, before, liquid%order(n), volumes, liquid%sweeps)
          end do
          call small_cells(grid, liquid)
        end if
      end do
    end associate
  end subroutine carry_fluid

  !> The liquid in the cells and its share C, at the end of the step; the work arrays go back.
  subroutine finish_carrying(grid, after, flow, scratch, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: after   !! bodies at the end of the step
    type(flow_t), intent(inout) :: flow           !! halos filled on return
    type(scratch_t), intent(inout) :: scratch
    type(fluid_transport_t), intent(inout) :: self

    call finish_transport(grid, after, self%liquid, flow)
    associate (volumes => self%liquid%volumes)
      call give(scratch, volumes%w)
      call give(scratch, volumes%v)
      call give(scratch, volumes%c)
      call give(scratch, volumes%w_before)
      call give(scratch, volumes%v_before)
      call give(scratch, volumes%q)
      call give(scratch, volumes%g)
    end associate
    if (self%carries_momentum) call give(scratch, self%momentum%momentum)
  end subroutine finish_carrying

end module fluid_transport_m
