!> Exchange of two allocatable arrays without copying, allocated or not.
module swap_m
  use kinds_m, only: wp
  implicit none
  private
  public :: swap

  interface swap
    module procedure swap_scalars, swap_vectors
  end interface swap

contains

  pure subroutine swap_scalars(a, b)
    real(wp), allocatable, intent(inout) :: a(:, :, :), b(:, :, :)
    real(wp), allocatable :: c(:, :, :)

    call move_alloc(a, c)
    call move_alloc(b, a)
    call move_alloc(c, b)
  end subroutine swap_scalars

  pure subroutine swap_vectors(a, b)
    real(wp), allocatable, intent(inout) :: a(:, :, :, :), b(:, :, :, :)
    real(wp), allocatable :: c(:, :, :, :)

    call move_alloc(a, c)
    call move_alloc(b, a)
    call move_alloc(c, b)
  end subroutine swap_vectors

end module swap_m
