!> A place in the text of a case, and the steps a reader takes from it.
module text_cursor_m
  use value_text_m, only: byte_order_mark
  implicit none
  private
  public :: cursor_t, start_of, next, at_end, skip_blanks, skip_line, past_blanks
  public :: take_run, take_until
  public :: line_feed, letters, name_characters, word_ends

  !> Where the reader stands in the text.
  type :: cursor_t
    character(:), allocatable :: text      !! each line ends in a single line feed
    integer :: at = 1                      !! next character
    integer :: line = 1
  end type cursor_t

  character(*), parameter :: line_feed = achar(10), carriage_return = achar(13), tab = achar(9)
  character(*), parameter :: blanks = ' '//tab//line_feed
  character(*), parameter :: letters = 'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ'
  character(*), parameter :: name_characters = letters//'0123456789_%'
  character(*), parameter :: word_ends = blanks//',;!=&/"'''

contains

  !> The start of a text.
  pure function start_of(text) result(cursor)
    character(*), intent(in) :: text
    type(cursor_t) :: cursor

    cursor%text = plain_lines(text)
  end function start_of

  !> Line ends of every system as one line feed; a byte-order mark dropped; blanks that do not break
  !! as blanks, but in strings; the last line ended.
  pure function plain_lines(text) result(plain)
    character(*), intent(in) :: text
    character(:), allocatable :: plain
    character(*), parameter :: no_break_space = char(194)//char(160)
    character(1) :: quote   ! that has begun a string on this line, or blank
    integer :: i, n, first

    first = 1
    if (index(text, byte_order_mark) == 1) first = len(byte_order_mark) + 1
    allocate (character(len(text) + 1) :: plain)
    n = 0
    quote = ' '
    do i = first, len(text)
      if (text(i:i) == line_feed .and. i > 1) then
        if (text(i - 1:i - 1) == carriage_return) cycle
      end if
      if (quote == ' ' .and. i > 1) then
        if (text(i - 1:i) == no_break_space) then
          plain(n:n) = ' '   ! where its first byte stands
          cycle
        end if
      end if
      n = n + 1
      plain(n:n) = text(i:i)
      if (text(i:i) == carriage_return) plain(n:n) = line_feed
      if (plain(n:n) == line_feed .or. plain(n:n) == quote) then
        quote = ' '
      else if (quote == ' ' .and. scan(plain(n:n), '"''') == 1) then
        quote = plain(n:n)
      end if
    end do
    plain = plain(:n)//line_feed
  end function plain_lines

  !> The next character; only to be asked before the end.
  pure function next(cursor) result(c)
    type(cursor_t), intent(in) :: cursor
    character(1) :: c

    c = cursor%text(cursor%at:cursor%at)
  end function next

  pure function at_end(cursor) result(yes)
    type(cursor_t), intent(in) :: cursor
    logical :: yes

    yes = cursor%at > len(cursor%text)
  end function at_end

  !> Go on past blanks, line ends and comments.
  pure subroutine skip_blanks(cursor)
    type(cursor_t), intent(inout) :: cursor

    do while (.not. at_end(cursor))
      if (next(cursor) == '!') then
        call skip_line(cursor)
      else if (scan(next(cursor), blanks) == 1) then
        if (next(cursor) == line_feed) cursor%line = cursor%line + 1
        cursor%at = cursor%at + 1
      else
        exit
      end if
    end do
  end subroutine skip_blanks

  !> Go on to the start of the next line.
  pure subroutine skip_line(cursor)
    type(cursor_t), intent(inout) :: cursor

    cursor%at = cursor%at + index(cursor%text(cursor%at:), line_feed)
    cursor%line = cursor%line + 1
  end subroutine skip_line

  !> First place at or after i that is no blank and no line end.
  pure function past_blanks(text, i) result(j)
    character(*), intent(in) :: text
    integer, intent(in) :: i
    integer :: j

    j = i
    do while (j <= len(text))
      if (scan(text(j:j), blanks) == 0) exit
      j = j + 1
    end do
  end function past_blanks

  !> Take the longest run of characters from `set`.
  function take_run(cursor, set) result(word)
    type(cursor_t), intent(inout) :: cursor
    character(*), intent(in) :: set
    character(:), allocatable :: word
    integer :: length

    length = verify(cursor%text(cursor%at:), set) - 1
    word = cursor%text(cursor%at:cursor%at + length - 1)
    cursor%at = cursor%at + length
  end function take_run

  !> Take everything up to the first character from `set`; the line feed at the end is always one.
  function take_until(cursor, set) result(word)
    type(cursor_t), intent(inout) :: cursor
    character(*), intent(in) :: set
    character(:), allocatable :: word
    integer :: length

    length = scan(cursor%text(cursor%at:), set) - 1
    word = cursor%text(cursor%at:cursor%at + length - 1)
    cursor%at = cursor%at + length
  end function take_until

end module text_cursor_m
