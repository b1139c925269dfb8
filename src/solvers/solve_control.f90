!> When an iterative solver stops, and how it ended.
module solve_control_m
  use kinds_m, only: wp
  implicit none
  private
  public :: solve_control_t, solve_report_t, solved, not_converged, broken_down

  integer, parameter :: solved = 0          !! the residual is small enough
  integer, parameter :: not_converged = 1   !! stopped after `max_iterations`
  integer, parameter :: broken_down = 2     !! matrix or preconditioner not positive, or NaN

  type :: solve_control_t
    real(wp) :: tolerance = 0.0_wp   !! stop at max |r| <= tolerance, in the unit of the right side
    real(wp) :: relative = 0.0_wp    !! ... or at max |r| <= relative*max |r_0| [-]
    integer :: max_iterations = 0
  end type solve_control_t

  type :: solve_report_t
    integer :: iterations = 0
    real(wp) :: residual = 0.0_wp   !! max |r| at the end
    integer :: info = solved        !! one of the codes above
  end type solve_report_t

end module solve_control_m
