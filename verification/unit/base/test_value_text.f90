!> Numbers and names as text. What is no number: `verification/messages/case.txt`.
module test_value_text_m
  use value_text_m, only: parse_real, parse_integer, edit_distance, nearest_name, printable, &
    sanitise, quoted_text, fixed_text, value_ok, value_too_large
  use check_m, only: check, wp
  implicit none
  private
  public :: test_value_text

contains

  subroutine test_value_text()
    call test_values()
    call test_spelling()
  end subroutine test_value_text

  subroutine test_values()
    character(*), parameter :: text(9) = [character(18) :: '1.25', '.5', '5.', '-1e-3', '+2.5D+2', &
      '1e-20', '0.000e99999', '000.00012', '0.5406250000000001']
    real(wp), parameter :: value(9) = [1.25_wp, 0.5_wp, 5.0_wp, -1.0e-3_wp, 250.0_wp, 1.0e-20_wp, &
      0.0_wp, 1.2e-4_wp, 0.5406250000000001_wp]
    real(wp) :: x
    integer :: i, n, info

    call check('a digit before the point', fixed_text(0.2_wp, 5) == '0.20000')
    call check('also of a negative number', fixed_text(-0.04_wp, 1) == '-0.0')
    call check('large', fixed_text(123456.789_wp, 2) == '123456.79')
    do i = 1, size(text)
      x = -huge(x)
      call parse_real(trim(text(i)), x, info)
      call check(text(i), x, value(i))
    end do
    x = 7.0_wp
    call parse_real('1e999', x, info)
    call check('a bad number changes nothing', x, 7.0_wp)
    call parse_integer('-12', n, info)
    call check('whole', info == value_ok .and. n == -12)
    call parse_integer('2147483647', n, info)
    call check('largest whole', info == value_ok .and. n == huge(n))
    call parse_integer('2147483648', n, info)
    call check('too large', info, value_too_large)
  end subroutine test_values

  subroutine test_spelling()
    call check('same', edit_distance('dt', 'dt'), 0)
    call check('insert', edit_distance('tend', 't_end'), 1)
    call check('swap', edit_distance('lenght', 'length'), 1)
    call check('replace and delete', edit_distance('kitten', 'sitting'), 3)
    call check('empty', edit_distance('', 'abc'), 3)
    call check('nearest of none', nearest_name('a', [character(4) ::]) == '')
    call check('control characters', printable('a'//achar(7)//'b') == 'a?b')
    call check('of two bytes', sanitise('a'//char(194)//char(155)//'b') == 'a??b')
    call check('of one byte', sanitise(char(155)//'31m'//char(144)) == '?31m?')
    call check('letters of three bytes stay', sanitise(char(226)//char(155)//char(143)) == &
               char(226)//char(155)//char(143))
    call check('quotes inside', quoted_text('it''s') == '''it''''s''')
  end subroutine test_spelling

end module test_value_text_m
