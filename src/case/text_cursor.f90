!> A place in the text of a case, and the steps a reader takes from it.
module text_cursor_m
  use text_file_m, only: plain_lines
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

  character(*), parameter :: line_feed = achar(10), tab = achar(9)
  character(*), parameter :: blanks = ' '//tab//line_feed
  character(*), parameter :: letters = 'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ'
  character(*), parameter :: name_characters = letters//'0123456789_%'
  character(*), parameter :: word_ends = blanks//',;!=&/"'''

contains

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
