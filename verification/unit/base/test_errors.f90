!> Numbers as text stay short and read back. Messages: `verification/messages`.
module test_errors_m
  use check_m, only: check, wp
  use errors_m, only: to_text
  implicit none
  private
  public :: test_errors

contains

  subroutine test_errors()
    real(wp) :: x, y
    character(40) :: line
    integer :: i, unequal

    call check('zero', to_text(0.0_wp) == '0')
    call check('a tenth', to_text(0.1_wp) == '0.1')
    call check('hundredth', to_text(-0.01_wp) == '-0.01')
    call check('many digits', to_text(998.2_wp) == '998.2')
    call check('third', to_text(1/3.0_wp) == '0.3333333333333333')
    call check('round', to_text(-2300.0_wp) == '-2300')
    call check('small', to_text(1.5e-7_wp) == '1.5e-7')
    call check('large', to_text(1.0e25_wp) == '1e25')
    call check('largest', to_text(huge(x)) == '1.7976931348623157e308')
    call check('integer', to_text(-42) == '-42')
    call check('logical', to_text(.false.) == '.false.')
    unequal = 0
    do i = 1, 2000
      call random_number(x)
      x = (x - 0.5_wp)*10.0_wp**modulo(i, 40)/1.0e20_wp
      line = to_text(x)
      read (line, *) y
      if (abs(y - x) > 0) unequal = unequal + 1
    end do
    call check('reading back gives the same number', unequal, 0)
  end subroutine test_errors

end module test_errors_m
