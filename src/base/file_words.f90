!> Text files that are read word by word: words between blanks and line ends, `#` begins a remark.
!! A byte-order mark at the start of a file is passed over.
module file_words_m
  use kinds_m, only: wp
  use errors_m, only: to_text
  use posix_file_m, only: is_pipe
  use text_file_m, only: read_bytes
  use value_text_m, only: byte_order_mark, parse_real, parse_integer, value_ok, value_too_large, &
    quoted_text, printable
  implicit none
  private
  public :: words_t, read_whole, next_word, skip_line, get_integer, get_real, get_count
  public :: expected, report, place_of

  integer, parameter :: longest_text = 500000000   !! bytes
  character(*), parameter :: line_feed = achar(10), blanks = ' '//achar(9)//achar(13)//line_feed

  !> A text that is read word by word; after a problem nothing more is read.
  type :: words_t
    character(:), allocatable :: text
    integer :: at = 1, line = 1
    character(:), allocatable :: problem   !! empty, or the first one
  end type words_t

contains

  !> The bytes of a file.
  subroutine read_whole(file, words)
    character(*), intent(in) :: file
    type(words_t), intent(out) :: words

    words%problem = 'is a pipe, must be a file'
    words%text = ''
    words%line = 0
    if (.not. is_pipe(file)) call read_bytes(file, longest_text, words%text, words%problem)
    if (words%problem == 'too long') words%problem = 'longer than 500 MB'
    if (len(words%problem) == 0) words%line = 1
  end subroutine read_whole

  !> Note a problem; only the first counts.
  subroutine report(words, text)
    type(words_t), intent(inout) :: words
    character(*), intent(in) :: text

    if (len(words%problem) == 0) words%problem = text
  end subroutine report

  !> The next word; empty at the end of the text or after a problem.
  function next_word(words) result(word)
    type(words_t), intent(inout) :: words
    character(:), allocatable :: word
    integer :: first

    word = ''
    if (len(words%problem) > 0) return
    if (words%at == 1) then   ! not joined by .and.: `index` may pass over the whole text each time
      if (index(words%text, byte_order_mark) == 1) words%at = len(byte_order_mark) + 1
    end if
    do while (words%at <= len(words%text))
      associate (c => words%text(words%at:words%at))
        if (c == '#') then
          call skip_line(words)
          cycle
        end if
        if (scan(c, blanks) == 0) exit
        if (c == line_feed) words%line = words%line + 1
      end associate
      words%at = words%at + 1
    end do
    first = words%at
    words%at = first - 1 + scan(words%text(first:), blanks)
    if (words%at < first) words%at = len(words%text) + 1
    word = words%text(first:words%at - 1)
  end function next_word

  !> Pass over the rest of the line.
  subroutine skip_line(words)
    type(words_t), intent(inout) :: words
    integer :: rest

    if (len(words%problem) > 0 .or. words%at > len(words%text)) return
    rest = index(words%text(words%at:), line_feed)
    words%at = merge(words%at + rest - 1, len(words%text) + 1, rest > 0)
  end subroutine skip_line

  subroutine get_integer(words, n)
    type(words_t), intent(inout) :: words
    integer, intent(out) :: n
    character(:), allocatable :: word
    integer :: info

    n = 0
    word = next_word(words)
    if (len(words%problem) > 0) return
    call parse_integer(word, n, info)
    if (info == value_too_large) then
      call report(words, quoted_text(printable(word))//' is too large for a whole number')
    else if (info /= value_ok) then
      call expected(words, 'a whole number', word)
    end if
  end subroutine get_integer

  subroutine get_real(words, x)
    type(words_t), intent(inout) :: words
    real(wp), intent(out) :: x
    character(:), allocatable :: word
    integer :: info

    x = 0.0_wp
    word = next_word(words)
    if (len(words%problem) > 0) return
    call parse_real(word, x, info)
    if (info == value_too_large .and. scan(word, 'eEdD') > 0) then
      if (index(word, '-', back=.true.) > scan(word, 'eEdD')) info = value_ok   ! as good as zero
    end if
    if (info == value_too_large) then
      call report(words, quoted_text(printable(word))//' is too large a number')
    else if (info /= value_ok) then
      call expected(words, 'a number', word)
    end if
  end subroutine get_real

  subroutine expected(words, what, word)
    type(words_t), intent(inout) :: words
    character(*), intent(in) :: what, word

    if (len(word) == 0) then
      call report(words, 'the file ends where '//what//' should stand')
    else
      call report(words, quoted_text(printable(word))//' stands where '//what//' should')
    end if
  end subroutine expected

  !> A count of things that the rest of the text has room for, and zero after a problem.
  subroutine get_count(words, what, words_each, n)
    type(words_t), intent(inout) :: words
    character(*), intent(in) :: what
    integer, intent(in) :: words_each   !! words of one of them at least
    integer, intent(out) :: n
    integer :: most

    call get_integer(words, n)
    most = (len(words%text) - words%at + 1)/words_each   ! a word has a character at least
    if (n < 0 .or. n > most) call report(words, 'the file does not hold '//to_text(n)//' '//what)
    if (len(words%problem) > 0) n = 0
  end subroutine get_count

  !> The line of the problem, to stand before it; empty where there is none.
  pure function place_of(words) result(text)
    type(words_t), intent(in) :: words
    character(:), allocatable :: text

    text = ''
    if (len(words%problem) > 0 .and. words%line > 0) text = 'line '//to_text(words%line)//': '
  end function place_of

end module file_words_m
