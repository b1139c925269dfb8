!> The simple preconditioners: nothing, and the inverse of the diagonal.
module test_linear_operator_m
  use check_m, only: check, wp
  use grid_m, only: grid_t
  use linear_operator_m, only: jacobi_t, identity_t
  use box_solid_m, only: simple_grid
  implicit none
  private
  public :: test_linear_operator

  type(grid_t) :: grid
  type(jacobi_t) :: jacobi
  type(identity_t) :: identity
  real(wp) :: cf(0:4, 0:4, 0:4, 3), r(0:4, 0:4, 0:4), z(0:4, 0:4, 0:4)

contains

  subroutine test_linear_operator()
    call simple_grid([3, 3, 3], [1.0_wp, 1.0_wp, 1.0_wp], grid)
    cf = 0.0_wp
    cf(2, 2, 2, :) = [1.0_wp, 2.0_wp, 4.0_wp]   ! lower faces of the middle cell
    cf(3, 2, 2, 1) = 8.0_wp                     ! and its upper ones
    cf(2, 3, 2, 2) = 16.0_wp
    cf(2, 2, 3, 3) = 32.0_wp
    call jacobi%setup(grid, cf)
    r = 126.0_wp
    z = 0.0_wp
    call jacobi%apply(r, 126.0_wp, z)
    call check('all six faces', z(2, 2, 2), 2.0_wp, 1.0e-15_wp)
    call check('neighbours', [z(1, 2, 2), z(3, 2, 2), z(2, 1, 2), z(2, 3, 2), z(2, 2, 1), &
               z(2, 2, 3)], 126.0_wp/[1.0_wp, 8.0_wp, 2.0_wp, 16.0_wp, 4.0_wp, 32.0_wp], 1.0e-13_wp)
    call check('closed cell', z(1, 1, 1), 0.0_wp)
    call jacobi%setup(grid, 2*cf)
    call jacobi%apply(r, 126.0_wp, z)
    call check('coefficients anew', z(2, 2, 2), 1.0_wp, 1.0e-15_wp)
    call identity%apply(r, 126.0_wp, z)
    call check('nothing', z - r, 0.0_wp)
  end subroutine test_linear_operator

end module test_linear_operator_m
