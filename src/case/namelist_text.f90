!> The text of a case, cut into groups of assignments with their line numbers.
!!
!! Our own small tokenizer in place of the namelist `read` of Fortran, which stops at the first
!! error of a group, skips unknown groups without a word and lets a repeated group keep old values.
!! Here every fault of form is noted with its line and reading goes on. The grammar:
!!
!!     text       = { group | comment }
!!     group      = '&' name { assignment | comment } '/'
!!     assignment = name '=' value { separator value }
!!     value      = [ count '*' ] ( word | quoted string )
!!
!! Separators are blanks, line ends and single commas (one more after the last value is fine); a
!! comment runs from '!' to the end of the line; strings stand between ' or ", doubled inside.
module namelist_text_m
  use errors_m, only: problems_t, to_text
  use text_file_m, only: plain_lines
  use value_text_m, only: lower_case, printable, quoted_text, parse_integer, value_ok
  implicit none
  private
  public :: cut_groups, group_text_t

  !> One value as it stands in the text, without its quotes.
  type :: value_t
    character(:), allocatable :: text
    logical :: quoted = .false.
  end type value_t

  type :: assignment_t
    character(:), allocatable :: name      !! in small letters
    integer :: line = 0
    type(value_t), allocatable :: value(:)  !! repeat counts multiplied out
    logical :: faulty = .false.            !! a problem with it has been reported already
  contains
    procedure :: shown => assignment_shown
  end type assignment_t

  type :: group_text_t
    character(:), allocatable :: name      !! in small letters, without '&'
    integer :: line = 0                    !! where the group begins
    type(assignment_t), allocatable :: assignment(:)
    logical :: faulty = .false.            !! damaged: assignments may be missing from it
  contains
    procedure :: find => group_find
  end type group_text_t

  !> Where the reader stands in the text.
  type :: cursor_t
    character(:), allocatable :: text      !! each line ends in a single line feed
    integer :: at = 1                      !! next character
    integer :: line = 1
  end type cursor_t

  character(*), parameter :: line_feed = achar(10), tab = achar(9)
  character(*), parameter :: blanks = ' '//tab//line_feed
  character(*), parameter :: letters = 'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ'
  character(*), parameter :: name_characters = letters//'0123456789_%'
  character(*), parameter :: word_ends = blanks//',;!=&/"'''
  integer, parameter :: max_values = 1000     !! values of one variable
  integer, parameter :: max_variables = 1000  !! assignments in one group

contains

  !> Cut the text of a case into its groups.
  subroutine cut_groups(text, groups, problems)
    character(*), intent(in) :: text
    type(group_text_t), allocatable, intent(out) :: groups(:)
    type(problems_t), intent(inout) :: problems
    type(cursor_t) :: cursor
    type(group_text_t) :: group
    type(group_text_t), allocatable :: longer(:)
    character(:), allocatable :: ended
    integer :: n, length
    logical :: stray_reported   ! text where only a group may stand

    cursor = start_of(text)
    allocate (groups(8))
    n = 0
    stray_reported = .false.
    do
      call skip_blanks(cursor)
      if (cursor%at > len(cursor%text)) exit
      if (next(cursor) == '&') then
        call read_group(cursor, group, problems)
        stray_reported = .false.
        if (len(group%name) == 0) cycle
        if (n == size(groups)) then
          allocate (longer(2*n))
          longer(:n) = groups
          call move_alloc(longer, groups)
        end if
        n = n + 1
        groups(n) = group
        cycle
      end if
      ended = ''
      if (n > 0) ended = ' ; &'//groups(n)%name//' has ended with its ''/'''
      length = index(cursor%text(cursor%at:), line_feed) - 1
      if (.not. stray_reported) call problems%add_message('text outside the groups: ' &
        //printable(trim(cursor%text(cursor%at:cursor%at + length - 1)))//ended, cursor%line)
      stray_reported = .true.
      cursor%at = cursor%at + length
    end do
    groups = groups(:n)
  end subroutine cut_groups

  !> Read one group from its '&' to its '/'.
  subroutine read_group(cursor, group, problems)
    type(cursor_t), intent(inout) :: cursor
    type(group_text_t), intent(out) :: group
    type(problems_t), intent(inout) :: problems
    logical :: comma    ! the last thing read is a comma
    logical :: valued   ! the last assignment has a value already

    group%line = cursor%line
    cursor%at = cursor%at + 1
    group%name = printable(lower_case(taken(cursor, verify(cursor%text(cursor%at:), &
      name_characters) - 1)))
    allocate (group%assignment(0))
    if (len(group%name) == 0) then
      call problems%add_message('''&'' without the name of a group', cursor%line)
      return
    else if (group%name == 'end') then
      call problems%add_message('&end: a group ends with ''/''', cursor%line)
      group%name = ''
      return
    end if
    comma = .false.
    do
      call skip_blanks(cursor)
      if (group_ends(cursor, group, problems)) exit
      if (next(cursor) == ',') then
        valued = .false.
        associate (a => group%assignment)
          if (size(a) > 0) valued = size(a(size(a))%value) > 0 .or. a(size(a))%faulty
        end associate
        if (comma .or. .not. valued) call report(cursor, group, &
          'nothing in front of a comma; write every value', problems)
        comma = .true.
        cursor%at = cursor%at + 1
        cycle
      end if
      comma = .false.
      if (starts_assignment(cursor)) then
        call start_assignment(cursor, group, problems)
      else
        call read_value(cursor, group, problems)
      end if
    end do
    call check_last(group, problems)
  end subroutine read_group

  !> Is the group over: its '/', or the next group or the end of the text without one?
  function group_ends(cursor, group, problems) result(yes)
    type(cursor_t), intent(inout) :: cursor
    type(group_text_t), intent(inout) :: group
    type(problems_t), intent(inout) :: problems
    logical :: yes
    character(:), allocatable :: rest

    yes = .true.
    if (cursor%at > len(cursor%text)) then
      rest = 'the end of the text'
    else if (next(cursor) == '/') then
      cursor%at = cursor%at + 1
      return
    else if (next(cursor) == '&') then
      rest = 'the next ''&'' on line '//to_text(cursor%line)
      if (lower_case(cursor%text(cursor%at:min(cursor%at + 3, len(cursor%text)))) == '&end') then
        rest = '&end'
        cursor%at = cursor%at + 4
      end if
    else
      yes = .false.
      return
    end if
    if (.not. group%faulty) then
      call problems%add_message('&'//group%name//': no ''/'' closes the group before '//rest, &
                                group%line)
    end if
    group%faulty = .true.
  end function group_ends

  !> Does a name with its '=' follow? (A word alone is a value.)
  pure function starts_assignment(cursor) result(yes)
    type(cursor_t), intent(in) :: cursor
    logical :: yes
    integer :: i, closing

    yes = .false.
    if (scan(next(cursor), letters//'_') == 0) return
    associate (text => cursor%text)
      i = past_blanks(text, cursor%at + verify(text(cursor%at:), name_characters) - 1)
      if (text(i:i) == '(') then
        closing = scan(text(i:), ')'//line_feed)
        if (closing > 0) i = past_blanks(text, i + closing)
      end if
      yes = text(i:i) == '='
    end associate
  end function starts_assignment

  !> Open the assignment whose name and '=' follow.
  subroutine start_assignment(cursor, group, problems)
    type(cursor_t), intent(inout) :: cursor
    type(group_text_t), intent(inout) :: group
    type(problems_t), intent(inout) :: problems
    type(assignment_t) :: new
    integer :: same

    call check_last(group, problems)
    new%line = cursor%line
    new%name = printable(lower_case(taken(cursor, verify(cursor%text(cursor%at:), &
      name_characters) - 1)))
    allocate (new%value(0))
    same = group%find(new%name)
    if (size(group%assignment) < max_variables) then
      group%assignment = [group%assignment, new]
    else   ! one problem; what follows is read over
      if (.not. group%faulty) call problems%add_message('&'//group%name//': more than ' &
        //to_text(max_variables)//' variables in one group', new%line)
      group%faulty = .true.
      group%assignment(max_variables) = new
      group%assignment(max_variables)%faulty = .true.
    end if
    call skip_blanks(cursor)
    if (next(cursor) == '(') then
      call report(cursor, group, 'parts of a list cannot be set; write the whole list, ' &
                  //new%name//' = first, second, ...', problems)
    else if (same > 0) then
      call report(cursor, group, 'given twice in one group, first on line ' &
                  //to_text(group%assignment(same)%line), problems)
    end if
    do while (next(cursor) /= '=')
      if (next(cursor) == line_feed) cursor%line = cursor%line + 1
      cursor%at = cursor%at + 1
    end do
    cursor%at = cursor%at + 1
  end subroutine start_assignment

  !> Read one value, repeat count included, into the last assignment of the group.
  subroutine read_value(cursor, group, problems)
    type(cursor_t), intent(inout) :: cursor
    type(group_text_t), intent(inout) :: group
    type(problems_t), intent(inout) :: problems
    type(value_t) :: value
    character(:), allocatable :: number
    integer :: count, digits, info, i

    count = 1
    digits = verify(cursor%text(cursor%at:), '0123456789') - 1
    if (digits > 0 .and. cursor%text(cursor%at + digits:cursor%at + digits) == '*') then
      number = taken(cursor, digits)
      cursor%at = cursor%at + 1
      count = 0
      call parse_integer(number, count, info)
      if (info /= value_ok .or. count < 1 .or. count > max_values) then
        call report(cursor, group, 'repeat count '//printable(number)//' must be 1 to ' &
          //to_text(max_values), problems)
        count = 1
      end if
      if (scan(next(cursor), word_ends) > 0 .and. scan(next(cursor), '"''') == 0) then
        call report(cursor, group, 'a repeat count without its value', problems)
        return
      end if
    end if
    select case (next(cursor))
    case ('''', '"')
      call take_string(cursor, group, value, problems)
    case ('=')
      call report(cursor, group, '''='' without a name in front of it', problems)
      cursor%at = cursor%at + 1
      return
    case (';')
      call report(cursor, group, 'values are separated by commas or blanks, not by '';''', problems)
      cursor%at = cursor%at + 1
      return
    case default
      value%text = taken(cursor, scan(cursor%text(cursor%at:), word_ends) - 1)
      call take_path(cursor, value%text)
    end select
    if (.not. allocated(value%text)) return
    if (size(group%assignment) == 0) then
      if (.not. group%faulty) then
        call problems%add_message('&'//group%name//' '//printable(value%text) &
                                  //': no ''='' follows; write name = value', cursor%line)
      end if
      group%faulty = .true.
      return
    end if
    associate (last => group%assignment(size(group%assignment)))
      if (size(last%value) + count > max_values) then
        call report(cursor, group, 'more than '//to_text(max_values)//' values', problems)
        return
      end if
      do i = 1, count
        last%value = [last%value, value]
      end do
    end associate
  end subroutine read_value

  !> A quoted string; left unallocated if its line ends first.
  subroutine take_string(cursor, group, value, problems)
    type(cursor_t), intent(inout) :: cursor
    type(group_text_t), intent(inout) :: group
    type(value_t), intent(inout) :: value
    type(problems_t), intent(inout) :: problems
    character(1) :: quote
    integer :: i, first

    quote = next(cursor)
    value%quoted = .true.
    first = cursor%at
    i = first
    do
      i = i + scan(cursor%text(i + 1:), quote//line_feed)
      if (cursor%text(i:i) == line_feed) then
        call report(cursor, group, 'the string '//printable(cursor%text(first:i - 1)) &
                    //' is not closed on its line', problems)
        group%faulty = .true.
        if (allocated(value%text)) deallocate (value%text)
        cursor%at = i
        return
      end if
      if (.not. allocated(value%text)) value%text = ''
      value%text = value%text//cursor%text(cursor%at + 1:i - 1)
      cursor%at = i + 1
      if (next(cursor) /= quote) return
      value%text = value%text//quote   ! doubled
      i = cursor%at
    end do
  end subroutine take_string

  !> An unquoted path: a '/' between characters of a word that is no number belongs to the word, so
  !! that one missing pair of quotes is one problem and does not end the group.
  subroutine take_path(cursor, word)
    type(cursor_t), intent(inout) :: cursor
    character(:), allocatable, intent(inout) :: word
    integer :: first

    if (scan(word, letters//'~') == 0 .or. verify(word(1:1), '0123456789+-') == 0) return
    first = cursor%at
    do while (next(cursor) == '/')
      if (scan(cursor%text(cursor%at + 1:cursor%at + 1), word_ends) > 0) exit
      cursor%at = cursor%at + scan(cursor%text(cursor%at + 1:), word_ends)
    end do
    word = word//cursor%text(first:cursor%at - 1)
  end subroutine take_path

  !> Report the last assignment if it ended up without a value.
  subroutine check_last(group, problems)
    type(group_text_t), intent(inout) :: group
    type(problems_t), intent(inout) :: problems

    if (size(group%assignment) == 0) return
    associate (last => group%assignment(size(group%assignment)))
      if (size(last%value) > 0 .or. last%faulty .or. group%faulty) return
      call problems%add_message('&'//group%name//' '//last%name//' = : the value is missing', &
                                last%line)
      last%faulty = .true.
    end associate
  end subroutine check_last

  !> Note a fault of form of the last assignment, once for each assignment.
  subroutine report(cursor, group, what, problems)
    type(cursor_t), intent(in) :: cursor
    type(group_text_t), intent(inout) :: group
    character(*), intent(in) :: what
    type(problems_t), intent(inout) :: problems

    if (size(group%assignment) == 0) then
      if (.not. group%faulty) call problems%add_message('&'//group%name//': '//what, cursor%line)
      group%faulty = .true.
      return
    end if
    associate (last => group%assignment(size(group%assignment)))
      if (.not. last%faulty) then
        call problems%add_message('&'//group%name//' '//last%name//': '//what, cursor%line)
      end if
      last%faulty = .true.
    end associate
  end subroutine report

  !> Number of the first assignment to `name`; 0 if there is none.
  pure function group_find(self, name) result(i)
    class(group_text_t), intent(in) :: self
    character(*), intent(in) :: name
    integer :: i

    do i = 1, size(self%assignment)
      if (self%assignment(i)%name == name) return
    end do
    i = 0
  end function group_find

  !> The values of an assignment as a message shows them.
  pure function assignment_shown(self) result(text)
    class(assignment_t), intent(in) :: self
    character(:), allocatable :: text
    integer :: i

    text = ''
    do i = 1, size(self%value)
      if (i > 1) text = text//', '
      if (self%value(i)%quoted) then
        text = text//quoted_text(self%value(i)%text)
      else
        text = text//self%value(i)%text
      end if
    end do
    text = printable(text)
  end function assignment_shown

  !> The start of a text, with blanks that do not break as blanks, but in strings.
  pure function start_of(text) result(cursor)
    character(*), intent(in) :: text
    type(cursor_t) :: cursor
    character(*), parameter :: no_break_space = char(194)//char(160)
    character(1) :: quote   ! that has begun a string on this line, or blank
    integer :: i

    cursor%text = plain_lines(text)
    quote = ' '
    do i = 1, len(cursor%text) - 1
      associate (c => cursor%text(i:i))
        if (c == line_feed .or. c == quote) then
          quote = ' '
        else if (quote == ' ' .and. scan(c, '"''') == 1) then
          quote = c
        end if
      end associate
      if (quote == ' ' .and. cursor%text(i:i + 1) == no_break_space) cursor%text(i:i + 1) = '  '
    end do
  end function start_of

  !> The next character; only to be asked before the end.
  pure function next(cursor) result(c)
    type(cursor_t), intent(in) :: cursor
    character(1) :: c

    c = cursor%text(cursor%at:cursor%at)
  end function next

  !> Take so many characters.
  function taken(cursor, length) result(word)
    type(cursor_t), intent(inout) :: cursor
    integer, intent(in) :: length
    character(:), allocatable :: word

    word = cursor%text(cursor%at:cursor%at + length - 1)
    cursor%at = cursor%at + length
  end function taken

  !> Go on past blanks, line ends and comments.
  pure subroutine skip_blanks(cursor)
    type(cursor_t), intent(inout) :: cursor

    do while (cursor%at <= len(cursor%text))
      if (next(cursor) == '!') then
        cursor%at = cursor%at + index(cursor%text(cursor%at:), line_feed) - 1
      else if (scan(next(cursor), blanks) == 0) then
        exit
      end if
      if (next(cursor) == line_feed) cursor%line = cursor%line + 1
      cursor%at = cursor%at + 1
    end do
  end subroutine skip_blanks

  !> First place at or after i that is no blank and no line end; at the end of the text its last.
  pure function past_blanks(text, i) result(j)
    character(*), intent(in) :: text
    integer, intent(in) :: i
    integer :: j

    j = min(i, len(text))
    j = j - 1 + verify(text(j:), blanks)
    if (j < i) j = len(text)
  end function past_blanks

end module namelist_text_m
