! What test_budgets.py counts.
module a_m
  implicit none
  private
  public :: one, &
    two
  type :: box_t
    integer :: n(2, 3), m  ! call two
  end type box_t
  interface
    subroutine far(x)
      real :: x
    end subroutine far
  end interface
contains
  subroutine one(b)
    type(box_t) :: b
    call two(b%n, &
             'one')
  end subroutine one
  pure subroutine two(n, text)
    integer, intent(in) :: n
  contains
    subroutine inner
      print *, 1
    end subroutine inner
  end subroutine two
end module a_m
