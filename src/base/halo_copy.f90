!> Copying of halo layers, shared by both parallel layers.
!!
!! For periodic images an array of any rank with a direction of `m` layers is seen as
!! `a(before, m, after)`, where `before` and `after` are the products of the extents of the
!! directions before and after it; so each copy is written once for all directions and ranks.
!! What goes to other processes is a box of an array of four directions, from one corner to another.
module halo_copy_m
  use kinds_m, only: wp, sp
  implicit none
  private
  public :: wrap_wp, wrap_sp, wrap_integer
  public :: pack_wp, pack_sp, pack_integer
  public :: unpack_wp, unpack_sp, unpack_integer

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

  !> Copy a box into a buffer.
  pure subroutine pack_wp(a, n, from, to, buffer)
    integer, intent(in) :: n(4), from(4), to(4)
    real(wp), intent(in) :: a(n(1), n(2), n(3), n(4))
    real(wp), intent(inout) :: buffer(from(1):to(1), from(2):to(2), from(3):to(3), from(4):to(4))

    buffer = a(from(1):to(1), from(2):to(2), from(3):to(3), from(4):to(4))
  end subroutine pack_wp

  pure subroutine pack_sp(a, n, from, to, buffer)
    integer, intent(in) :: n(4), from(4), to(4)
    real(sp), intent(in) :: a(n(1), n(2), n(3), n(4))
    real(sp), intent(inout) :: buffer(from(1):to(1), from(2):to(2), from(3):to(3), from(4):to(4))

    buffer = a(from(1):to(1), from(2):to(2), from(3):to(3), from(4):to(4))
  end subroutine pack_sp

  pure subroutine pack_integer(a, n, from, to, buffer)
    integer, intent(in) :: n(4), from(4), to(4)
    integer, intent(in) :: a(n(1), n(2), n(3), n(4))
    integer, intent(inout) :: buffer(from(1):to(1), from(2):to(2), from(3):to(3), from(4):to(4))

    buffer = a(from(1):to(1), from(2):to(2), from(3):to(3), from(4):to(4))
  end subroutine pack_integer

  !> Copy a buffer into a box.
  pure subroutine unpack_wp(buffer, n, from, to, a)
    integer, intent(in) :: n(4), from(4), to(4)
    real(wp), intent(in) :: buffer(from(1):to(1), from(2):to(2), from(3):to(3), from(4):to(4))
    real(wp), intent(inout) :: a(n(1), n(2), n(3), n(4))

    a(from(1):to(1), from(2):to(2), from(3):to(3), from(4):to(4)) = buffer
  end subroutine unpack_wp

  pure subroutine unpack_sp(buffer, n, from, to, a)
    integer, intent(in) :: n(4), from(4), to(4)
    real(sp), intent(in) :: buffer(from(1):to(1), from(2):to(2), from(3):to(3), from(4):to(4))
    real(sp), intent(inout) :: a(n(1), n(2), n(3), n(4))

    a(from(1):to(1), from(2):to(2), from(3):to(3), from(4):to(4)) = buffer
  end subroutine unpack_sp

  pure subroutine unpack_integer(buffer, n, from, to, a)
    integer, intent(in) :: n(4), from(4), to(4)
    integer, intent(in) :: buffer(from(1):to(1), from(2):to(2), from(3):to(3), from(4):to(4))
    integer, intent(inout) :: a(n(1), n(2), n(3), n(4))

    a(from(1):to(1), from(2):to(2), from(3):to(3), from(4):to(4)) = buffer
  end subroutine unpack_integer

end module halo_copy_m
