!> A step of the liquid transport by itself, without momentum.
module liquid_alone_m
  use kinds_m, only: wp
  use grid_m, only: grid_t
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use elliptic_solver_m, only: elliptic_solver_t, elliptic_solver_init
  use liquid_transport_m, only: liquid_transport_t, begin_transport, begin_subcycle, &
                                small_cells, finish_transport
  use liquid_sweep_m, only: sweep_volumes
  implicit none
  private
  public :: transport_liquid

contains

  !> Carry the liquid through one step.
  subroutine transport_liquid(grid, old, new, dt, step, self, flow)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old, new   !! bodies at the begin and the end of the step
    real(wp), intent(in) :: dt     !! [s]
    integer, intent(in) :: step    !! number of the step
    type(liquid_transport_t), intent(inout) :: self
    type(flow_t), intent(inout) :: flow
    type(elliptic_solver_t) :: solver
    integer :: n, subcycle

    call elliptic_solver_init(grid, solver)
    call begin_transport(grid, old, new, dt, solver, self, flow)
    do subcycle = 1, self%subcycles
      call begin_subcycle(grid, old, subcycle, step, self)
      do n = 1, 3
        call sweep_volumes(grid, old, self%order(n), self%volumes, self%sweeps)
      end do
      call small_cells(grid, self)
    end do
    call finish_transport(grid, new, self, flow)
  end subroutine transport_liquid

end module liquid_alone_m
