!> What solves an elliptic system on the grid: the levels of multigrid, the arrays of the iteration,
!! right side and unknown.
!!
!! A step has two such systems, the open flux and the pressure, one after the other; both are set up
!! anew in each step, so they share one solver.
module elliptic_solver_m
  use kinds_m, only: wp
  use grid_m, only: grid_t
  use krylov_m, only: krylov_work_t, krylov_init
  use multigrid_m, only: multigrid_t
  implicit none
  private
  public :: elliptic_solver_t, elliptic_solver_init

  type :: elliptic_solver_t
    type(multigrid_t) :: multigrid
    type(krylov_work_t) :: work
    real(wp), allocatable :: rhs(:, :, :), x(:, :, :)   !! right side and unknown, one halo cell
  end type elliptic_solver_t

contains

  !> Allocate for a grid.
  subroutine elliptic_solver_init(grid, self)
    type(grid_t), intent(in) :: grid
    type(elliptic_solver_t), intent(out) :: self

    call self%multigrid%init(grid)
    call krylov_init(grid, self%work)
    allocate (self%rhs, self%x, source=self%work%r)
  end subroutine elliptic_solver_init

end module elliptic_solver_m
