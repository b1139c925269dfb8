!> How the plan of a case is laid out: headings, and lines of a name and a text.
module plan_text_m
  use, intrinsic :: iso_fortran_env, only: output_unit
  use kinds_m, only: wp
  use errors_m, only: to_text, brief
  use value_text_m, only: fixed_text
  implicit none
  private
  public :: heading, entry, left, triple, place_text, count_text

  integer, parameter :: label_width = 24      !! columns of the names

contains

  subroutine heading(text)
    character(*), intent(in) :: text

    write (output_unit, '(a)') text
  end subroutine heading

  !> One line: a name and what is to be said about it.
  subroutine entry(name, text)
    character(*), intent(in) :: name, text

    write (output_unit, '(2x, a, a)') left(name, label_width), trim(text)
  end subroutine entry

  !> Text with blanks behind it, cut or filled to a width.
  pure function left(text, width) result(filled)
    character(*), intent(in) :: text
    integer, intent(in) :: width
    character(width) :: filled

    filled = text
  end function left

  !> Three numbers.
  pure function triple(x, between) result(text)
    real(wp), intent(in) :: x(3)
    character(*), intent(in), optional :: between
    character(:), allocatable :: text, gap

    gap = ' x '
    if (present(between)) gap = between
    text = brief(x(1))//gap//brief(x(2))//gap//brief(x(3))
  end function triple

  !> A coordinate to a ten-thousandth of the tank, however far from zero the tank lies.
  pure function place_text(x, length) result(text)
    real(wp), intent(in) :: x           !! [m]
    real(wp), intent(in) :: length(3)   !! of the tank [m]
    character(:), allocatable :: text
    character(400) :: buffer
    real(wp) :: rounded

    buffer = fixed_text(x, max(1, 4 - floor(log10(maxval(length)))))
    read (buffer, *) rounded
    text = to_text(rounded)
  end function place_text

  !> A count that may be too large for an integer, rounded down with a little tolerance.
  pure function count_text(x) result(text)
    real(wp), intent(in) :: x
    character(:), allocatable :: text

    text = brief(x)
    if (x < 1.0e9_wp) text = to_text(int(x*(1.0_wp + 1.0e-9_wp)))
  end function count_text

end module plan_text_m
