!> The tokenizer: groups, values and lines of good texts, and one clear message for each bad one.
module test_namelist_text_m
  use check_m, only: check
  use errors_m, only: problems_t
  use case_file_m, only: read_text
  use namelist_text_m, only: namelist_text_t, cut_groups
  use value_text_m, only: parse_real, parse_integer, parse_logical, edit_distance, nearest_name, &
    printable, sanitise, quoted_text, fixed_text, value_ok, value_malformed, value_not_finite, &
    value_too_large, value_not_whole
  use kinds_m, only: wp
  implicit none
  private
  public :: test_namelist_text

  character(*), parameter :: lf = new_line('a')

contains

  subroutine test_namelist_text()
    call test_values()
    call test_spelling()
    call test_form()
    call test_line_ends()
    call test_no_break_space()
    call test_faults()
    call test_files()
  end subroutine test_namelist_text

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

  !> Everything a good text may do.
  subroutine test_form()
    type(namelist_text_t) :: list
    type(problems_t) :: problems
    character(*), parameter :: text = &
      '! a case: schön, größe &run t_end = 1 /'//lf// &
      '&Run title = ''a / b ! c, it''''s "so"'', T_END=10.0 dt  ='//lf// &
      '  1.0e-2 ! comment with a '' and a /'//lf// &
      '/'//lf// &
      ' &grid cells = 3*4, length = 0.3 0.1,0.2, / &fluid'// &
      achar(9)//'gravity=0,0 -9.81/'//lf// &
      '&shape name = "say ""yes""" file=''''/'//lf// &
      '&bed/'

    call cut_groups(text, list, problems)
    call check('good text', problems%n, 0)
    call check('groups', list%n, 5)
    if (problems%n > 0 .or. list%n /= 5) return
    call check('names in small letters', list%group(1)%name == 'run')
    call check('line of the group', list%group(1)%line, 2)
    call check('string', list%group(1)%assignment(1)%value(1)%text == 'a / b ! c, it''s "so"')
    call check('string is quoted', list%group(1)%assignment(1)%value(1)%quoted)
    call check('variable in small letters', list%group(1)%find('t_end'), 2)
    call check('value on the next line', list%group(1)%assignment(3)%value(1)%text == '1.0e-2')
    call check('line of the name', list%group(1)%assignment(3)%line, 2)
    call check('repeat count', list%group(2)%assignment(1)%n, 3)
    call check('repeated value', list%group(2)%assignment(1)%value(3)%text == '4')
    call check('comma at the end', list%group(2)%assignment(2)%n, 3)
    call check('two groups on a line', list%group(3)%line, 5)
    call check('mixed separators', list%group(3)%assignment(1)%shown() == '0, 0, -9.81')
    call check('doubled double quotes', list%group(4)%assignment(1)%value(1)%text == 'say "yes"')
    call check('empty string', list%group(4)%assignment(2)%n, 1)
    call check('empty group', list%group(5)%n, 0)
  end subroutine test_form

  !> Line ends of three systems count the same, and a byte-order mark is no text.
  subroutine test_line_ends()
    character(*), parameter :: ends(3) = [character(2) :: achar(13)//achar(10), achar(10), &
      achar(13)]
    type(namelist_text_t) :: list
    type(problems_t) :: problems
    character(:), allocatable :: e
    integer :: i

    do i = 1, 3
      e = trim(ends(i))
      call cut_groups(char(239)//char(187)//char(191)//'&run'//e//e//'dt=1'//e//'/'//e//'&grid/', &
                      list, problems)
      call check('no problem with line ends', problems%n, 0)
      call check('two groups', list%n, 2)
      call check('line of dt', list%group(1)%assignment(1)%line, 3)
      call check('line of grid', list%group(2)%line, 5)
    end do
  end subroutine test_line_ends

  !> Blanks that do not break, as word processors write them, are blanks, but in strings.
  subroutine test_no_break_space()
    character(*), parameter :: b = char(194)//char(160)
    type(namelist_text_t) :: list
    type(problems_t) :: problems

    call cut_groups(b//'! it''s'//b//lf//'&run'//b//'dt'//b//'='//b//'1'//b//'title = ''a'//b &
      //'"'''//b//'n = 2'//b//'/'//b//lf, list, problems)
    call check('no problem with blanks that do not break', problems%n, 0)
    call check('three variables', list%group(1)%n, 3)
    call check('number', list%group(1)%assignment(1)%value(1)%text == '1')
    call check('a string keeps it', list%group(1)%assignment(2)%value(1)%text == 'a'//b//'"')
    call check('lines', list%group(1)%line, 2)
  end subroutine test_no_break_space

  !> One message for each fault, all of them in one go.
  subroutine test_faults()
    call expect('&run dt = 1'//lf//'t_end = 2'//lf, &
                '&run: no ''/'' closes the group before the end of the text (line 1)')
    call expect('&run dt = 1'//lf//'&grid/', &
                '&run: no ''/'' closes the group before the next ''&'' on line 2 (line 1)')
    call expect('&run'//lf//'title = ''abc'//lf//'dt = 1 /', &
                '&run title: the string ''abc is not closed on its line (line 2)')
    call expect('&run title = "abc /', &
                '&run title: the string "abc / is not closed on its line (line 1)')
    call expect('hello'//lf//'more'//lf//'&run/', 'text outside the groups: hello (line 1)')
    call expect('&run/ dt = 1'//lf//'t_end = 2'//lf//'/', &
                'text outside the groups: dt = 1 ; &run has ended with its ''/'' (line 1)')
    call expect('&run dt = 1, dt = 2/', '&run dt: given twice in one group, first on line 1 ' &
      //'(line 1)')
    call expect('&run'//lf//'DT = 1'//lf//'dt = 2/', &
                '&run dt: given twice in one group, first on line 2 (line 3)')
    call expect('&run t_end 10 /', '&run t_end: no ''='' follows; write name = value (line 1)')
    call expect('&run = 10 /', '&run: ''='' without a name in front of it (line 1)')
    call expect('&run dt = 1 = 2 /', '&run dt: ''='' without a name in front of it (line 1)')
    call expect('&run dt = t_end = 2 /', '&run dt = : the value is missing (line 1)')
    call expect('&run'//lf//'dt ='//lf//'/', '&run dt = : the value is missing (line 2)')
    call expect('&grid cells = 1,,3 /', &
                '&grid cells: nothing in front of a comma; write every value (line 1)')
    call expect('&grid cells = ,1,2 /', &
                '&grid cells: nothing in front of a comma; write every value (line 1)')
    call expect('&grid , cells = 1 /', &
                '&grid: nothing in front of a comma; write every value (line 1)')
    call expect('&grid cells = 1;2;3 /', &
                '&grid cells: values are separated by commas or blanks, not by '';'' (line 1)')
    call expect('&grid cells = 3* /', '&grid cells: a repeat count without its value (line 1)')
    call expect('&grid cells = 0*1 /', '&grid cells: repeat count 0 must be 1 to 1000 (line 1)')
    call expect('&grid cells = 99999999999*1 /', &
                '&grid cells: repeat count 99999999999 must be 1 to 1000 (line 1)')
    call expect('&grid cells = 999*1, 2, 3 /', '&grid cells: more than 1000 values (line 1)')
    call expect('&grid'//lf//'cells(1) = 4 cells(2)=5/', &
                '&grid cells: parts of a list cannot be set; write the whole list, ' &
                //'cells = first, second, ... (line 2)' &
                //'|&grid cells: parts of a list cannot be set; write the whole list, ' &
                //'cells = first, second, ... (line 2)')
    call expect('& run dt = 1 /', '''&'' without the name of a group (line 1)' &
                //'|text outside the groups: run dt = 1 / (line 1)')
    call expect('&run dt = 1 &END', '&run: no ''/'' closes the group before &end (line 1)')
    call expect('&run dt = 1 /'//lf//'&end', '&end: a group ends with ''/'' (line 2)')
    call expect('', '')
    call expect('! only a comment', '')
    call expect('&', '''&'' without the name of a group (line 1)')
    call expect('''', 'text outside the groups: '' (line 1)')
  end subroutine test_faults

  !> Cut a text and compare all messages, '|' between them.
  subroutine expect(text, messages)
    character(*), intent(in) :: text, messages
    type(namelist_text_t) :: list
    type(problems_t) :: problems
    character(:), allocatable :: found
    integer :: i

    call cut_groups(text, list, problems)
    found = ''
    do i = 1, problems%n
      if (i > 1) found = found//'|'
      found = found//problems%message(i)
    end do
    call check('messages of '//printable(text), found == messages)
    if (found /= messages) print '(2a)', '  got: ', found
  end subroutine expect

  !> Reading files: byte for byte, and a message where there is nothing to read.
  subroutine test_files()
    character(*), parameter :: path = 'test_namelist_text.tmp'
    character(*), parameter :: content = '&run'//achar(13)//lf//' ! größe'//lf//lf//'/'
    character(:), allocatable :: text
    type(problems_t) :: problems
    integer :: unit

    open (newunit=unit, file=path, access='stream', form='unformatted', status='replace')
    write (unit) content
    close (unit)
    call read_text(path, text, problems)
    call check('file read without problems', problems%n, 0)
    call check('file read byte for byte', text == content .and. len(text) == len(content))

    open (newunit=unit, file=path, access='stream', form='unformatted', status='replace')
    write (unit) repeat('! line of a comment'//lf, 20000)
    close (unit)
    call read_text(path, text, problems)
    call check('long file', len(text), 400000)

    call check_encoding('B'//char(246)//'e'//char(228)//char(223), &
                        'B'//char(195)//char(182)//'e'//char(195)//char(164)//char(195)//char(159))
    call check_encoding(char(195)//char(182)//char(226)//char(137)//char(164)//' ')
    call check_encoding(char(240)//char(159)//char(140)//char(138))
    call check_encoding(char(195), char(195)//char(131))
    call check_encoding(char(192)//char(128), char(195)//char(128)//char(194)//char(128))
    call check_encoding(char(237)//char(160)//char(128), &
                        char(195)//char(173)//char(194)//char(160)//char(194)//char(128))

    open (newunit=unit, file=path, access='stream', form='unformatted', status='replace')
    write (unit) 'a'//achar(0)//'b'
    close (unit)
    call read_text(path, text, problems)
    call check('zero bytes refused', problems%n, 1)
    open (newunit=unit, file=path)
    close (unit, status='delete')

    call read_text('no/such/case.nml', text, problems)
    call check('missing file', problems%n, 2)
    call read_text('.', text, problems)
    call check('folder in place of a file', problems%n, 3)
    call read_text('/dev/null', text, problems)
  end subroutine test_files

  !> A text in UTF-8 stays, any other is Latin-1.
  subroutine check_encoding(content, wanted)
    character(*), intent(in) :: content
    character(*), intent(in), optional :: wanted   !! default: the content
    character(*), parameter :: path = 'test_encoding.nml'
    type(problems_t) :: problems
    character(:), allocatable :: text, expected
    integer :: unit

    expected = content
    if (present(wanted)) expected = wanted
    open (newunit=unit, file=path, access='stream', form='unformatted', status='replace')
    write (unit) content
    close (unit)
    call read_text(path, text, problems)
    call check('in UTF-8: '//expected, text == expected .and. problems%n == 0)
    open (newunit=unit, file=path)
    close (unit, status='delete')
  end subroutine check_encoding

end module test_namelist_text_m
