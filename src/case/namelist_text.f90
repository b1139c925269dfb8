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

  !> The text, where the reader stands in it, the group that it reads, and all that is wrong so far.
  type :: reader_t
    character(:), allocatable :: text      !! each line ends in a single line feed
    integer :: at = 1                      !! next character
    integer :: line = 1
    type(group_text_t) :: group
    type(problems_t) :: problems
  end type reader_t

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
    type(reader_t) :: r
    type(group_text_t), allocatable :: longer(:)
    character(:), allocatable :: ended
    integer :: n, length
    logical :: stray_reported   ! text where only a group may stand

    r%text = with_plain_blanks(text)
    r%problems = problems
    allocate (groups(8))
    n = 0
    stray_reported = .false.
    do
      call skip_blanks(r)
      if (r%at > len(r%text)) exit
      if (next(r) == '&') then
        call read_group(r)
        stray_reported = .false.
        if (len(r%group%name) == 0) cycle
        if (n == size(groups)) then
          allocate (longer(2*n))
          longer(:n) = groups
          call move_alloc(longer, groups)
        end if
        n = n + 1
        groups(n) = r%group
        cycle
      end if
      ended = ''
      if (n > 0) ended = ' ; &'//groups(n)%name//' has ended with its ''/'''
      length = index(r%text(r%at:), line_feed) - 1
      if (.not. stray_reported) call r%problems%add_message('text outside the groups: ' &
        //printable(trim(r%text(r%at:r%at + length - 1)))//ended, r%line)
      stray_reported = .true.
      r%at = r%at + length
    end do
    groups = groups(:n)
    problems = r%problems
  end subroutine cut_groups

  !> Read one group from its '&' to its '/'.
  subroutine read_group(r)
    type(reader_t), intent(inout) :: r
    logical :: comma    ! the last thing read is a comma
    logical :: valued   ! the last assignment has a value already

    r%group = group_text_t(line=r%line)
    allocate (r%group%assignment(0))
    r%at = r%at + 1
    r%group%name = next_name(r)
    if (len(r%group%name) == 0) then
      call r%problems%add_message('''&'' without the name of a group', r%line)
      return
    else if (r%group%name == 'end') then
      call r%problems%add_message('&end: a group ends with ''/''', r%line)
      r%group%name = ''
      return
    end if
    comma = .false.
    do
      call skip_blanks(r)
      if (group_ends(r)) exit
      if (next(r) == ',') then
        valued = .false.
        associate (a => r%group%assignment)
          if (size(a) > 0) valued = size(a(size(a))%value) > 0 .or. a(size(a))%faulty
        end associate
        if (comma .or. .not. valued) call report(r, &
          'nothing in front of a comma; write every value')
        comma = .true.
        r%at = r%at + 1
        cycle
      end if
      comma = .false.
      if (starts_assignment(r)) then
        call start_assignment(r)
      else
        call read_value(r)
      end if
    end do
    call check_last(r)
  end subroutine read_group

  !> Is the group over: its '/', or the next group or the end of the text without one?
  function group_ends(r) result(yes)
    type(reader_t), intent(inout) :: r
    logical :: yes

    yes = .true.
    if (r%at > len(r%text)) then
      call spoil(r, ': no ''/'' closes the group before the end of the text', r%group%line)
    else if (next(r) == '/') then
      r%at = r%at + 1
    else if (next(r) /= '&') then
      yes = .false.
    else if (lower_case(r%text(r%at:min(r%at + 3, len(r%text)))) == '&end') then
      r%at = r%at + 4
      call spoil(r, ': no ''/'' closes the group before &end', r%group%line)
    else
      call spoil(r, ': no ''/'' closes the group before the next ''&'' on line ' &
        //to_text(r%line), r%group%line)
    end if
  end function group_ends

  !> Does a name with its '=' follow? (A word alone is a value.)
  pure function starts_assignment(r) result(yes)
    type(reader_t), intent(in) :: r
    logical :: yes
    integer :: i, closing

    yes = .false.
    if (scan(next(r), letters//'_') == 0) return
    i = past_blanks(r%text, r%at + verify(r%text(r%at:), name_characters) - 1)
    if (r%text(i:i) == '(') then
      closing = scan(r%text(i:), ')'//line_feed)
      if (closing > 0) i = past_blanks(r%text, i + closing)
    end if
    yes = r%text(i:i) == '='
  end function starts_assignment

  !> Open the assignment whose name and '=' follow.
  subroutine start_assignment(r)
    type(reader_t), intent(inout) :: r
    type(assignment_t) :: new
    integer :: same

    call check_last(r)
    new%line = r%line
    new%name = next_name(r)
    allocate (new%value(0))
    same = r%group%find(new%name)
    if (size(r%group%assignment) < max_variables) then
      r%group%assignment = [r%group%assignment, new]
    else   ! one problem; what follows is read over
      call spoil(r, ': more than '//to_text(max_variables)//' variables in one group', new%line)
      new%faulty = .true.
      r%group%assignment(max_variables) = new
    end if
    call skip_blanks(r)
    if (next(r) == '(') then
      call report(r, 'parts of a list cannot be set; write the whole list, '//new%name &
        //' = first, second, ...')
    else if (same > 0) then
      call report(r, 'given twice in one group, first on line ' &
        //to_text(r%group%assignment(same)%line))
    end if
    do while (next(r) /= '=')
      if (next(r) == line_feed) r%line = r%line + 1
      r%at = r%at + 1
    end do
    r%at = r%at + 1
  end subroutine start_assignment

  !> Read one value, repeat count included, into the last assignment of the group.
  subroutine read_value(r)
    type(reader_t), intent(inout) :: r
    type(value_t) :: value
    character(:), allocatable :: number
    integer :: count, digits, info, i

    count = 1
    digits = verify(r%text(r%at:), '0123456789') - 1
    if (digits > 0 .and. r%text(r%at + digits:r%at + digits) == '*') then
      number = taken(r, digits)
      r%at = r%at + 1
      count = 0
      call parse_integer(number, count, info)
      if (info /= value_ok .or. count < 1 .or. count > max_values) then
        call report(r, 'repeat count '//printable(number)//' must be 1 to '//to_text(max_values))
        count = 1
      end if
      if (scan(next(r), word_ends) > 0 .and. scan(next(r), '"''') == 0) then
        call report(r, 'a repeat count without its value')
        return
      end if
    end if
    select case (next(r))
    case ('''', '"')
      call take_string(r, value)
    case ('=')
      call report(r, '''='' without a name in front of it')
      r%at = r%at + 1
    case (';')
      call report(r, 'values are separated by commas or blanks, not by '';''')
      r%at = r%at + 1
    case default
      value%text = taken(r, scan(r%text(r%at:), word_ends) - 1)
      call take_path(r, value%text)
    end select
    if (.not. allocated(value%text)) return
    if (size(r%group%assignment) == 0) then
      call spoil(r, ' '//printable(value%text)//': no ''='' follows; write name = value', r%line)
      return
    end if
    associate (last => r%group%assignment(size(r%group%assignment)))
      if (size(last%value) + count > max_values) then
        call report(r, 'more than '//to_text(max_values)//' values')
        return
      end if
      do i = 1, count
        last%value = [last%value, value]
      end do
    end associate
  end subroutine read_value

  !> A quoted string; left unallocated if its line ends first.
  subroutine take_string(r, value)
    type(reader_t), intent(inout) :: r
    type(value_t), intent(inout) :: value
    character(1) :: quote
    integer :: i, first

    quote = next(r)
    value%quoted = .true.
    first = r%at
    i = first
    do
      i = i + scan(r%text(i + 1:), quote//line_feed)
      if (r%text(i:i) == line_feed) then
        call report(r, 'the string '//printable(r%text(first:i - 1))//' is not closed on its line')
        r%group%faulty = .true.
        if (allocated(value%text)) deallocate (value%text)
        r%at = i
        return
      end if
      if (.not. allocated(value%text)) value%text = ''
      value%text = value%text//r%text(r%at + 1:i - 1)
      r%at = i + 1
      if (next(r) /= quote) return
      value%text = value%text//quote   ! doubled
      i = r%at
    end do
  end subroutine take_string

  !> An unquoted path: a '/' between characters of a word that is no number belongs to the word, so
  !! that one missing pair of quotes is one problem and does not end the group.
  subroutine take_path(r, word)
    type(reader_t), intent(inout) :: r
    character(:), allocatable, intent(inout) :: word
    integer :: first

    if (scan(word, letters//'~') == 0 .or. verify(word(1:1), '0123456789+-') == 0) return
    first = r%at
    do while (next(r) == '/')
      if (scan(r%text(r%at + 1:r%at + 1), word_ends) > 0) exit
      r%at = r%at + scan(r%text(r%at + 1:), word_ends)
    end do
    word = word//r%text(first:r%at - 1)
  end subroutine take_path

  !> Report the last assignment if it ended up without a value.
  subroutine check_last(r)
    type(reader_t), intent(inout) :: r

    if (size(r%group%assignment) == 0 .or. r%group%faulty) return
    associate (last => r%group%assignment(size(r%group%assignment)))
      if (size(last%value) > 0 .or. last%faulty) return
      call r%problems%add_message('&'//r%group%name//' '//last%name &
        //' = : the value is missing', last%line)
      last%faulty = .true.
    end associate
  end subroutine check_last

  !> Note a fault of form of the last assignment, once for each assignment.
  subroutine report(r, what)
    type(reader_t), intent(inout) :: r
    character(*), intent(in) :: what

    if (size(r%group%assignment) == 0) then
      call spoil(r, ': '//what, r%line)
      return
    end if
    associate (last => r%group%assignment(size(r%group%assignment)))
      if (.not. last%faulty) call r%problems%add_message('&'//r%group%name//' '//last%name//': ' &
        //what, r%line)
      last%faulty = .true.
    end associate
  end subroutine report

  !> Note a fault of form of the group, the first one alone; `what` goes on right after its name.
  subroutine spoil(r, what, line)
    type(reader_t), intent(inout) :: r
    character(*), intent(in) :: what
    integer, intent(in) :: line

    if (.not. r%group%faulty) call r%problems%add_message('&'//r%group%name//what, line)
    r%group%faulty = .true.
  end subroutine spoil

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

  !> The lines of a text, with blanks that do not break as blanks, but in strings.
  pure function with_plain_blanks(raw) result(text)
    character(*), intent(in) :: raw
    character(:), allocatable :: text
    character(*), parameter :: no_break_space = char(194)//char(160)
    character(1) :: quote   ! that has begun a string on this line, or blank
    integer :: i

    text = plain_lines(raw)
    quote = ' '
    do i = 1, len(text) - 1
      associate (c => text(i:i))
        if (c == line_feed .or. c == quote) then
          quote = ' '
        else if (quote == ' ' .and. scan(c, '"''') == 1) then
          quote = c
        end if
      end associate
      if (quote == ' ' .and. text(i:i + 1) == no_break_space) text(i:i + 1) = '  '
    end do
  end function with_plain_blanks

  !> The next character; only to be asked before the end.
  pure function next(r) result(c)
    type(reader_t), intent(in) :: r
    character(1) :: c

    c = r%text(r%at:r%at)
  end function next

  !> Take so many characters.
  function taken(r, length) result(word)
    type(reader_t), intent(inout) :: r
    integer, intent(in) :: length
    character(:), allocatable :: word

    word = r%text(r%at:r%at + length - 1)
    r%at = r%at + length
  end function taken

  !> Take a name, in small letters; empty if none follows.
  function next_name(r) result(name)
    type(reader_t), intent(inout) :: r
    character(:), allocatable :: name

    name = printable(lower_case(taken(r, verify(r%text(r%at:), name_characters) - 1)))
  end function next_name

  !> Go on past blanks, line ends and comments.
  pure subroutine skip_blanks(r)
    type(reader_t), intent(inout) :: r

    do while (r%at <= len(r%text))
      if (next(r) == '!') then
        r%at = r%at + index(r%text(r%at:), line_feed) - 1
      else if (scan(next(r), blanks) == 0) then
        exit
      end if
      if (next(r) == line_feed) r%line = r%line + 1
      r%at = r%at + 1
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
