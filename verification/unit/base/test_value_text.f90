!> Numbers, logicals and names as text.
module test_value_text_m
  use check_m, only: check
  use value_text_m, only: parse_real, parse_integer, parse_logical, edit_distance, nearest_name, &
    printable, sanitise, quoted_text, fixed_text, value_ok, value_malformed, value_not_finite, &
    value_too_large, value_not_whole
  use kinds_m, only: wp
  implicit none
  private
  public :: test_value_text

contains

  subroutine test_value_text()
    call test_values()
    call test_spelling()
  end subroutine test_value_text

  !> Numbers and logicals of every form.
  subroutine test_values()
    real(wp) :: x
    integer :: n, info
    logical :: flag

    call check('a digit before the point', fixed_text(0.2_wp, 5) == '0.20000')
    call check('also of a negative number', fixed_text(-0.04_wp, 1) == '-0.0')
    call check('large', fixed_text(123456.789_wp, 2) == '123456.79')
    call check('plain', number('1.25'), 1.25_wp, 0.0_wp)
    call check('no digit in front', number('.5'), 0.5_wp, 0.0_wp)
    call check('no digit behind', number('5.'), 5.0_wp, 0.0_wp)
    call check('exponent', number('-1e-3'), -1.0e-3_wp, 0.0_wp)
    call check('exponent of Fortran', number('+2.5D+2'), 250.0_wp, 0.0_wp)
    call check('smallest', number('1e-20'), 1.0e-20_wp, 0.0_wp)
    call check('zero with a large exponent', number('0.000e99999'), 0.0_wp, 0.0_wp)
    call check('leading zeros', number('000.00012'), 1.2e-4_wp, 0.0_wp)
    call check('all digits', number('0.5406250000000001'), 0.5406250000000001_wp, 0.0_wp)
    call check('word', real_info('abc'), value_malformed)
    call check('empty', real_info(''), value_malformed)
    call check('sign alone', real_info('-'), value_malformed)
    call check('point alone', real_info('.'), value_malformed)
    call check('two points', real_info('1.2.3'), value_malformed)
    call check('two signs', real_info('--1'), value_malformed)
    call check('no exponent', real_info('1e'), value_malformed)
    call check('exponent with a point', real_info('1e2.5'), value_malformed)
    call check('exponent without letter', real_info('1.0+3'), value_malformed)
    call check('exponent alone', real_info('e5'), value_malformed)
    call check('unit', real_info('5mm'), value_malformed)
    call check('comma of decimals', real_info('1;5'), value_malformed)
    call check('hexadecimal', real_info('0x10'), value_malformed)
    call check('NaN', real_info('NaN'), value_not_finite)
    call check('NaN with load', real_info('nan(1)'), value_not_finite)
    call check('infinite', real_info('-Inf'), value_not_finite)
    call check('infinity', real_info('+infinity'), value_not_finite)
    call check('overflow', real_info('1e999'), value_too_large)
    call check('long overflow', real_info('1e99999999999999999999'), value_too_large)
    call check('overflow by digits', real_info('1'//repeat('0', 40)), value_too_large)
    call check('underflow', real_info('1e-400'), value_too_large)
    call check('underflow by digits', real_info('0.'//repeat('0', 40)//'1'), value_too_large)
    x = 7.0_wp
    call parse_real('1e999', x, info)
    call check('a bad number changes nothing', x, 7.0_wp, 0.0_wp)

    call parse_integer('-12', n, info)
    call check('whole', info == value_ok .and. n == -12)
    call parse_integer('2147483647', n, info)
    call check('largest whole', info == value_ok .and. n == huge(n))
    call check('too large whole', integer_info('2147483648'), value_too_large)
    call check('much too large whole', integer_info(repeat('9', 50)), value_too_large)
    call check('broken', integer_info('60.0'), value_not_whole)
    call check('whole by exponent', integer_info('6e1'), value_not_whole)
    call check('no whole', integer_info('ten'), value_malformed)
    call check('no whole at all', integer_info(''), value_malformed)

    call parse_logical('.True.', flag, info)
    call check('true', info == value_ok .and. flag)
    call parse_logical('F', flag, info)
    call check('false', info == value_ok .and. .not. flag)
    call parse_logical('1', flag, info)
    call check('a number is no logical', info, value_malformed)
  end subroutine test_values

  !> Value of a good number; -huge for a bad one.
  function number(text) result(x)
    character(*), intent(in) :: text
    real(wp) :: x
    integer :: info

    x = -huge(x)
    call parse_real(text, x, info)
  end function number

  function real_info(text) result(info)
    character(*), intent(in) :: text
    integer :: info
    real(wp) :: x

    x = 0.0_wp
    call parse_real(text, x, info)
  end function real_info

  function integer_info(text) result(info)
    character(*), intent(in) :: text
    integer :: info
    integer :: n

    n = 0
    call parse_integer(text, n, info)
  end function integer_info

  subroutine test_spelling()
    call check('same', edit_distance('dt', 'dt'), 0)
    call check('insert', edit_distance('tend', 't_end'), 1)
    call check('swap', edit_distance('lenght', 'length'), 1)
    call check('replace and delete', edit_distance('kitten', 'sitting'), 3)
    call check('empty', edit_distance('', 'abc'), 3)
    call check('nearest', nearest_name('refinment', [character(12) :: 'name', 'refinement', &
      'size']) &
               == 'refinement')
    call check('nearest of none', nearest_name('a', [character(4) ::]) == '')
    call check('control characters', printable('a'//achar(7)//'b') == 'a?b')
    call check('control characters of two bytes', &
               sanitise('a'//char(194)//char(155)//'b') == 'a??b')
    call check('control characters of one byte', sanitise(char(155)//'31m'//char(144)) == '?31m?')
    call check('letters of three bytes stay', sanitise(char(226)//char(155)//char(143)) == &
               char(226)//char(155)//char(143))
    call check('letters of two bytes stay', sanitise(char(195)//char(159)) == char(195)//char(159))
    call check('long value', len(printable(repeat('x', 1000))) == 60)
    call check('quotes inside', quoted_text('it''s') == '''it''''s''')
  end subroutine test_spelling

end module test_value_text_m
