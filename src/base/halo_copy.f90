!> Periodic images of halo layers, shared by both parallel layers.
!!
!! An array of any rank with a direction of `m` layers is seen as
!! `a(before, m, after)`, where `before` and `after` are the products of the extents of the
!! directions before and after it; so each copy is written once for all directions and ranks.
module halo_copy_m
  use kinds_m, only: wp, sp
  implicit none
  private
  public :: wrap_wp, wrap_sp, wrap_integer

contains

  !> Inner layer whose periodic image is the halo layer h, counted from the first halo layer.
  pure function image(h, m, width) result(i)
    integer, intent(in) :: h, m, width
    integer :: i

    i = width + 1 + modulo(h - 1 - width, m - 2*width)
  end function image

  !> Fill `width` halo layers on both sides with their periodic images.
  pure subroutine wrap_wp(a, before, m, after, width)
    integer, intent(in) :: before, m, after, width
    real(wp), intent(inout) :: a(before, m, after)
    integer :: h, k

    do k = 1, after
      do h = 1, width
        a(:, h, k) = a(:, image(h, m, width), k)
        a(:, m + 1 - h, k) = a(:, image(m + 1 - h, m, width), k)
      end do
    end do
  end subroutine wrap_wp

  pure subroutine wrap_sp(a, before, m, after, width)
    integer, intent(in) :: before, m, after, width
    real(sp), intent(inout) :: a(before, m, after)
    integer :: h, k

    do k = 1, after
      do h = 1, width
        a(:, h, k) = a(:, image(h, m, width), k)
        a(:, m + 1 - h, k) = a(:, image(m + 1 - h, m, width), k)
      end do
    end do
  end subroutine wrap_sp

  pure subroutine wrap_integer(a, before, m, after, width)
    integer, intent(in) :: before, m, after, width
    integer, intent(inout) :: a(before, m, after)
    integer :: h, k

    do k = 1, after
      do h = 1, width
        a(:, h, k) = a(:, image(h, m, width), k)
        a(:, m + 1 - h, k) = a(:, image(m + 1 - h, m, width), k)
      end do
    end do
  end subroutine wrap_integer

end module halo_copy_m
