"""Sizes are counted as budgets.py says."""

from pathlib import Path

import budgets

SOURCE = """\
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
"""


def test_what_a_source_holds(tmp_path: Path) -> None:
    (tmp_path / "a.f90").write_text(SOURCE)
    assert budgets.of_fortran([tmp_path / "a.f90"]) == {
        "public names": 2,
        "derived types": 1,
        "components of types": 2,
        "called once and short": 1,
        "executable lines per procedure": 1.0,
        "longest procedure": 5,
        "longest file": 27,
    }
