!> The restart checksum sees every kind of damage and does not depend on how the data is cut.
module test_checksum_m
  use check_m, only: check, wp, i8
  use checksum_m, only: checksum_t
  implicit none
  private
  public :: test_checksum

  integer, parameter :: n = 10000
  real(wp) :: a(n)
  integer :: i

contains

  subroutine test_checksum()
    a = [(sin(real(i, wp)), i=1, n)]
    a(500:5000) = 0.0_wp
    call test_parts()
    call test_damage()
    call test_other_kinds()
  end subroutine test_checksum

  function sum_of(x) result(text)
    real(wp), intent(in) :: x(:)
    character(18) :: text
    type(checksum_t) :: s

    call s%add_reals(size(x), x)
    text = s%text()
  end function sum_of

  subroutine test_parts()
    type(checksum_t) :: s

    call s%add_reals(777, a(:777))
    call s%add_reals(n - 777, a(778:))
    call check('parts in order give the same', s%text() == sum_of(a))
    s = checksum_t()
    call s%add_reals(n, reshape(a, [10, 100, 10]))
    call check('rank 3 gives the same', s%text() == sum_of(a))
  end subroutine test_parts

  !> Flip each bit of one number, set a stretch to ones, swap, shorten, lengthen.
  subroutine test_damage()
    real(wp) :: b(n)
    integer :: bit, missed

    missed = 0
    do bit = 0, 63
      b = a
      b(4321) = transfer(ieor(transfer(a(4321), 0_i8), ishft(1_i8, bit)), 0.0_wp)
      if (sum_of(b) == sum_of(a)) missed = missed + 1
    end do
    call check('any flipped bit shows', missed, 0)
    b = a
    b(600:1111) = transfer(-1_i8, 0.0_wp)
    call check('zeros turned into ones show', sum_of(b) /= sum_of(a))
    b = a
    b([1, 2]) = a([2, 1])
    call check('exchanged numbers show', sum_of(b) /= sum_of(a))
    call check('a lost number shows', sum_of(a(:n - 1)) /= sum_of(a))
    call check('an added zero shows', sum_of([a, 0.0_wp]) /= sum_of(a))
  end subroutine test_damage

  subroutine test_other_kinds()
    type(checksum_t) :: s, t

    call s%add_integers(3, [1, 2, 3])
    call t%add_integers(3, [1, 2, -3])
    call check('integers', s%text() /= t%text())
    s = checksum_t()
    t = checksum_t()
    call s%add_text('a')
    call s%add_text('bc')
    call t%add_text('ab')
    call t%add_text('c')
    call check('texts keep their limits', s%text() /= t%text())
  end subroutine test_other_kinds

end module test_checksum_m
