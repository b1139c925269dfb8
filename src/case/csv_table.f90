!> A table in a text file: a line with the names of the columns, then rows of cells.
!!
!! Commas part the cells; semicolons, or tabs, if the line of names holds any. A cell may stand
!! between double quotes, a quote inside doubled. Blanks around a cell, empty lines, lines of empty
!! cells and lines that begin with `#` mean nothing; neither do a byte-order mark, nor how lines
!! end. Text is UTF-8; any other is taken as Latin-1. A unit in brackets after a name is that of the
!! numbers below, which are converted.
module csv_table_m
  use kinds_m, only: wp, name_length, pi
  use errors_m, only: problems_t, to_text
  use file_words_m, only: words_t, read_whole
  use value_text_m, only: parse_real, nearest_name, lower_case, printable, quoted_text, &
    value_ok, value_not_finite, value_too_large
  use text_file_m, only: to_utf8, plain_lines
  implicit none
  private
  public :: csv_table_t, read_table

  integer, parameter :: max_columns = 64   !! of a table
  integer, parameter :: n_units = 16
  character(*), parameter :: unit(n_units) = [character(12) :: 'm', 'cm', 'mm', 'ft', &
    'us survey ft', 's', 'min', 'h', 'deg', 'degrees', 'rad', 'm/s', 'cm/s', 'mm/s', 'ft/s', 'km/h']
  character(*), parameter :: si(n_units) = [character(3) :: 'm', 'm', 'm', 'm', 'm', 's', 's', &
    's', 'deg', 'deg', 'deg', 'm/s', 'm/s', 'm/s', 'm/s', 'm/s']   !! what it is converted to
  real(wp), parameter :: factor(n_units) = [1.0_wp, 0.01_wp, 0.001_wp, 0.3048_wp, &
    1200.0_wp/3937.0_wp, 1.0_wp, 60.0_wp, 3600.0_wp, 1.0_wp, 1.0_wp, 180.0_wp/pi, 1.0_wp, &
    0.01_wp, 0.001_wp, 0.3048_wp, 1.0_wp/3.6_wp]
  character(*), parameter :: blank = ' '//achar(9)

  type :: csv_table_t
    integer :: n_rows = 0
    integer :: head = 0                              !! line of the names
    character(name_length), allocatable :: name(:)   !! (columns) in small letters, without units
    real(wp), allocatable, private :: factor(:)      !! (columns) of its numbers
    integer, allocatable :: line(:)                  !! (rows) of the file
    integer :: n_doubtful = 0, doubtful = 0   !! remarks that look like rows, line of the first
    character(:), allocatable, private :: text       !! the file; rows by their ends in it
    integer, allocatable, private :: first(:, :), last(:, :)   !! (columns, 0:rows), 0: the names
  contains
    procedure :: cell, column, number, place, report => table_report
    procedure :: check_names, warn_of_remarks
  end type csv_table_t

contains

  !> Read a file; faults of its form are reported with line and column.
  subroutine read_table(file, table, problems)
    character(*), intent(in) :: file
    type(csv_table_t), intent(out) :: table
    type(problems_t), intent(inout) :: problems
    type(words_t) :: words
    character(1) :: separator
    integer :: at, last, line, n_lines, i
    integer :: n          ! cells of a line; what is beyond `max_columns` is cut off
    integer :: first(max_columns), final(max_columns)   ! character of each
    logical :: quoted     ! the last one has no second "
    logical :: remark

    allocate (table%name(0), table%line(0), table%first(0, 0), table%last(0, 0))
    call read_whole(file, words)
    if (len(words%problem) == 0 .and. index(words%text, achar(0)) > 0) words%problem = &
      'holds zero bytes; a table is plain text in UTF-8'
    if (len(words%problem) > 0) then
      call problems%add_message(words%problem)
      return
    end if
    call to_utf8(words%text)
    table%text = plain_lines(words%text)
    n_lines = 0
    do i = 1, len(table%text)
      if (table%text(i:i) == new_line('a')) n_lines = n_lines + 1
    end do
    at = 1
    separator = ','
    do line = 1, n_lines
      last = at + index(table%text(at:), new_line('a')) - 2
      associate (row => table%text(at:last))
        first(1) = at
        at = last + 2
        if (verify(row, blank//separator) == 0) cycle
        remark = index(adjustl(row), '#') == 1
        if (remark .and. size(table%name) == 0) cycle
        if (size(table%name) == 0) then   ! the line of names says what parts the cells
          if (index(row, ',') == 0 .and. index(row, achar(9)) > 0) separator = achar(9)
          if (index(row, ';') > 0) separator = ';'
        end if
      end associate
      call cut_line(first(1))
      do while (n > max(1, size(table%name)))   ! a comma at the end of each line
        if (final(n) >= first(n)) exit
        n = n - 1
      end do
      if (remark) then   ! it may be a row that is lost if it has as many cells and a number in them
        if (n /= size(table%name)) cycle
        if (.not. any([(first(i) <= final(i) .and. verify(table%text(first(i):final(i)), &
          '+-.0123456789') == 0, i=2, n)])) cycle
        table%n_doubtful = table%n_doubtful + 1
        if (table%n_doubtful == 1) table%doubtful = line
        cycle
      end if
      if (quoted) call problems%add_message('line '//to_text(line)//', column '//to_text(n) &
        //': no second " closes the text on this line')
      if (size(table%name) > 0) then
        call add_row()
        cycle
      end if
      deallocate (table%line, table%first, table%last)
      allocate (table%line(n_lines), table%first(n, 0:n_lines), table%last(n, 0:n_lines))
      table%first(:, 0) = first(:n)
      table%last(:, 0) = final(:n)
      call set_names()
    end do
    if (size(table%name) == 0) call problems%add_message('the file is empty')
  contains
    !> The cells of a line: first and last character of each, quotes included.
    subroutine cut_line(begin)
      integer, value :: begin   !! of the line, then of a cell
      integer :: i

      n = 0
      quoted = .false.
      do i = begin, last + 1
        if (i <= last) then
          if (table%text(i:i) == '"') quoted = .not. quoted
          if (quoted .or. table%text(i:i) /= separator) cycle
        end if
        if (n == size(first)) exit
        n = n + 1
        first(n) = begin + verify(table%text(begin:i - 1)//'.', blank) - 1
        final(n) = begin + verify(table%text(begin:i - 1), blank, back=.true.) - 1
        begin = i + 1
      end do
    end subroutine cut_line

    !> The names of the columns.
    subroutine set_names()
      character(:), allocatable :: word
      integer :: c

      deallocate (table%name)
      allocate (table%name(n))
      allocate (table%factor(n), source=1.0_wp)
      table%head = line
      do c = 1, n
        word = lower_case(table%cell(0, c))//'['
        table%name(c) = word(:scan(word(2:), '[('))
        if (len_trim(table%name(c)) == 0) call problems%add_message('line '//to_text(line) &
          //', column '//to_text(c)//': has no name')
        if (any(table%name(:c - 1) == table%name(c)) .and. len_trim(table%name(c)) > 0) then
          call problems%add_message(table%place(0, c)//': is there twice')
        end if
      end do
    end subroutine set_names

    !> A row, which has a cell for each name.
    subroutine add_row()
      integer :: width

      width = size(table%name)
      if (n /= width) then
        call problems%add_message('line '//to_text(line)//', column '//to_text(min(n, width) + 1) &
          //': '//to_text(n)//trim(merge(' cell ', ' cells', n == 1)) &
          //', but the table has '//to_text(width)//' columns')
        return
      end if
      table%n_rows = table%n_rows + 1
      table%line(table%n_rows) = line
      table%first(:, table%n_rows) = first(:width)
      table%last(:, table%n_rows) = final(:width)
    end subroutine add_row
  end subroutine read_table

  !> A cell without the quotes around it.
  pure function plain(raw) result(text)
    character(*), intent(in) :: raw
    character(:), allocatable :: text
    integer :: i

    text = raw
    if (len(raw) < 2) return
    if (raw(1:1) /= '"' .or. raw(len(raw):len(raw)) /= '"') return
    text = ''
    i = 2
    do while (i < len(raw))
      text = text//raw(i:i)
      if (raw(i:i + 1) == '""') i = i + 1
      i = i + 1
    end do
    text = trim(adjustl(text))
  end function plain

  !> The text of a cell; empty where its column is not there.
  pure function cell(self, row, column) result(text)
    class(csv_table_t), intent(in) :: self
    integer, intent(in) :: row, column   !! column 0: not there
    character(:), allocatable :: text

    text = ''
    if (column > 0) text = plain(self%text(self%first(column, row):self%last(column, row)))
  end function cell

  !> Number of the column of that name; 0 if there is none.
  pure function column(self, name) result(c)
    class(csv_table_t), intent(in) :: self
    character(*), intent(in) :: name
    integer :: c

    c = findloc(self%name == name, .true., 1)
  end function column

  !> Where a cell stands, its column named as the file does; row 0: the name itself.
  function place(self, row, column) result(text)
    class(csv_table_t), intent(in) :: self
    integer, intent(in) :: row, column
    character(:), allocatable :: text

    text = 'line '//to_text(self%head)
    if (row > 0) text = 'line '//to_text(self%line(row))
    text = text//', column '//to_text(column)//' ('//printable(self%cell(0, column))//')'
  end function place

  !> Tell what is wrong with a cell.
  subroutine table_report(self, row, column, what, problems)
    class(csv_table_t), intent(in) :: self
    integer, intent(in) :: row, column
    character(*), intent(in) :: what
    type(problems_t), intent(inout) :: problems

    call problems%add_message(self%place(row, column)//' = ' &
      //quoted_text(printable(self%cell(row, column)))//': '//what)
  end subroutine table_report

  !> Read a cell as a number. An empty one, or one whose column is not there, leaves `x` as it is;
  !! it is a problem if the number is required.
  subroutine number(self, row, column, required, x, ok, problems)
    class(csv_table_t), intent(in) :: self
    integer, intent(in) :: row, column
    logical, intent(in) :: required
    real(wp), intent(inout) :: x
    logical, intent(inout) :: ok          !! false where something is wrong
    type(problems_t), intent(inout) :: problems
    character(:), allocatable :: text, what
    integer :: info

    text = self%cell(row, column)
    what = ''
    if (len(text) == 0) then
      if (required .and. column > 0) what = 'is empty, a number is needed'
    else
      call parse_real(text, x, info)
      select case (info)
      case (value_ok); x = self%factor(column)*x
      case (value_not_finite); what = 'must be a finite number'
      case (value_too_large); what = 'must be 0 or between 1e-20 and 1e20 in size'
      case default
        what = 'must be a number'
        if (verify(text, '+-0123456789,') == 0) what = 'must be a number, with a decimal point'
      end select
    end if
    if (len(what) == 0) return
    ok = .false.
    call self%report(row, column, what, problems)
  end subroutine number

  !> Tell of remarks that may be rows.
  subroutine warn_of_remarks(self, subject, line, warnings)
    class(csv_table_t), intent(in) :: self
    character(*), intent(in) :: subject   !! group, variable and value that name the table
    integer, intent(in) :: line           !! of the case
    type(problems_t), intent(inout) :: warnings

    if (self%n_doubtful > 0) call warnings%add_message(subject//': remarks look like rows, ' &
      //to_text(self%n_doubtful)//' in all, the first on line '//to_text(self%doubtful) &
      //'; a text that begins with # stands in quotes', line)
  end subroutine warn_of_remarks

  !> Columns that are not known, required ones that are missing, and units; numbers are converted
  !! to those of the program.
  subroutine check_names(self, known, units, n_required, problems)
    class(csv_table_t), intent(inout) :: self
    character(*), intent(in) :: known(:)      !! the required ones first
    character(*), intent(in) :: units(:)      !! of the known ones; empty: none
    integer, intent(in) :: n_required
    type(problems_t), intent(inout) :: problems
    character(:), allocatable :: list, word
    integer :: c, k, u

    list = ''
    do c = 1, size(self%name)
      if (self%name(c) == '') cycle
      k = findloc(known == self%name(c), .true., 1)
      if (k == 0) then
        call problems%add_message(self%place(0, c)//': unknown, nearest known: ' &
          //nearest_name(trim(self%name(c)), known))
        cycle
      end if
      word = lower_case(self%cell(0, c))
      word = trim(adjustl(word(scan(word//'[', '[(') + 1:scan(word//']', '])') - 1)))
      if (units(k) == '' .or. len(word) == 0) cycle
      u = findloc(unit == word .and. si == units(k), .true., 1)
      if (u > 0) then
        self%factor(c) = factor(u)
        cycle
      end if
      list = ''
      do u = 1, n_units
        if (si(u) == units(k)) list = list//', '//trim(unit(u))
      end do
      call problems%add_message(self%place(0, c)//': no unit that is known here, must be one of ' &
        //list(3:))
    end do
    list = ''
    do c = 1, n_required
      if (.not. any(self%name == known(c))) list = list//', '//trim(known(c))
    end do
    if (len(list) > 0) call problems%add_message('line '//to_text(self%head) &
      //': missing: '//list(3:))
  end subroutine check_names

end module csv_table_m
