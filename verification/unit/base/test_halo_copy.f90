!> Copies of halo layers: each layer of each direction, in every kind of number.
module test_halo_copy_m
  use kinds_m, only: wp, sp
  use halo_copy_m, only: wrap_wp, wrap_sp, wrap_integer, pack_wp, pack_sp, pack_integer, &
    unpack_wp, unpack_sp, unpack_integer
  use check_m, only: check
  implicit none
  private
  public :: test_halo_copy

contains

  subroutine test_halo_copy()
    call wrapped([7, 9, 8], 2, 2)
    call wrapped([3, 9, 8], 3, 3)
    call wrapped([5, 7, 6], 1, 3)
    call thinner_than_its_halo()
    call packed()
  end subroutine test_halo_copy

  !> A number that tells the place.
  pure integer function label(i, j, k)
    integer, intent(in) :: i, j, k

    label = i + 100*j + 10000*k
  end function label

  !> Direction d of an array of n places with its halos: each halo layer holds its image.
  subroutine wrapped(n, d, width)
    integer, intent(in) :: n(3), d, width
    integer :: a(n(1), n(2), n(3)), expected(n(1), n(2), n(3)), i, j, k, c(3)
    real(wp) :: x(n(1), n(2), n(3))
    real(sp) :: s(n(1), n(2), n(3))

    do k = 1, n(3)
      do j = 1, n(2)
        do i = 1, n(1)
          a(i, j, k) = label(i, j, k)
          c = [i, j, k]
          c(d) = modulo(c(d) - width - 1, n(d) - 2*width) + width + 1
          expected(i, j, k) = label(c(1), c(2), c(3))
        end do
      end do
    end do
    x = a
    s = real(a, sp)
    associate (before => product(n(:d - 1)), after => product(n(d + 1:)))
      call wrap_integer(a, before, n(d), after, width)
      call wrap_wp(x, before, n(d), after, width)
      call wrap_sp(s, before, n(d), after, width)
    end associate
    call check('wrapped integers', all(a == expected))
    call check('wrapped reals', all(nint(x) == expected))
    call check('wrapped short reals', all(nint(s) == expected))
  end subroutine wrapped

  !> A single cell between halos of three layers is its own image in all of them.
  subroutine thinner_than_its_halo()
    integer :: a(2, 7)

    a = -1
    a(:, 4) = [8, 9]
    call wrap_integer(a, 2, 7, 1, 3)
    call check('a single layer', all(a(1, :) == 8) .and. all(a(2, :) == 9))
  end subroutine thinner_than_its_halo

  !> What is packed is what lies in the box; unpacked elsewhere it is there and nowhere else.
  subroutine packed()
    integer, parameter :: n(4) = [3, 5, 4, 2], box(4) = [2, 3, 2, 2]
    integer, parameter :: from(4) = [1, 2, 3, 1], there(4) = [2, 1, 2, 1]   !! first corners
    integer, dimension(n(1), n(2), n(3), n(4)) :: a, b
    integer, dimension(box(1), box(2), box(3), box(4)) :: layers
    real(wp) :: x(n(1), n(2), n(3), n(4)), y(box(1), box(2), box(3), box(4))
    real(sp) :: s(n(1), n(2), n(3), n(4)), t(box(1), box(2), box(3), box(4))
    integer :: k

    a = reshape([(k, k=1, size(a))], shape(a))
    x = a
    s = real(a, sp)
    call pack_integer(a, n, from, from + box - 1, layers)
    call pack_wp(x, n, from, from + box - 1, y)
    call pack_sp(s, n, from, from + box - 1, t)
    call check('packed integers', all(layers == a(1:2, 2:4, 3:4, :)))
    call check('packed reals', all(nint(y) == layers))
    call check('packed short reals', all(nint(t) == layers))
    b = a
    b(2:3, 1:3, 2:3, :) = a(1:2, 2:4, 3:4, :)
    call unpack_integer(layers, n, there, there + box - 1, a)
    call unpack_wp(y, n, there, there + box - 1, x)
    call unpack_sp(t, n, there, there + box - 1, s)
    call check('unpacked integers', all(a == b))
    call check('unpacked reals', all(nint(x) == b))
    call check('unpacked short reals', all(nint(s) == b))
  end subroutine packed

end module test_halo_copy_m
