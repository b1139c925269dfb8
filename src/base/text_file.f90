!> The bytes of a file and what makes text of them: UTF-8 or Latin-1, line ends of every system, a
!! byte-order mark. Each procedure takes a time in proportion to the size.
module text_file_m
  use, intrinsic :: iso_c_binding, only: c_int, c_long, c_size_t, c_null_char
  use c_library_m, only: c_close, c_lseek, c_open, c_read
  use value_text_m, only: byte_order_mark
  implicit none
  private
  public :: read_bytes, to_utf8, plain_lines

  character(*), parameter :: line_feed = achar(10), carriage_return = achar(13)

contains

  !> All bytes of a file or a pipe, or of standard input if `file` is empty; more than `most` are a
  !! problem. Devices without an end have no length either.
  subroutine read_bytes(file, most, text, problem)
    character(*), intent(in) :: file
    integer, intent(in) :: most
    character(:), allocatable, intent(out) :: text
    character(:), allocatable, intent(out) :: problem   !! empty: none
    integer(c_int), parameter :: from_start = 0, from_here = 1, from_end = 2
    integer(c_long) :: start, length
    integer(c_size_t) :: n, got
    integer(c_int) :: number

    number = 0   ! of standard input
    if (len(file) > 0) number = c_open(file//c_null_char, 0_c_int)
    length = 8192
    start = c_lseek(number, 0_c_long, from_here)   ! below 0: a pipe, whose length shows at its end
    if (start >= 0) then
      length = min(c_lseek(number, 0_c_long, from_end) - start, most + 1_c_long)
      start = c_lseek(number, start, from_start)
    end if
    allocate (character(length) :: text)
    n = 0
    do
      if (n == len(text) .and. start < 0) text = text//repeat(' ', len(text))
      got = c_read(number, text(n + 1:), len(text) - n)
      if (got <= 0) exit
      n = n + got
      if (n > most) exit
    end do
    text = text(:n)
    problem = ''
    if (n > most) problem = 'too long'
    if (got < 0) problem = 'could not be read'
    if (got < 0 .and. n == 0) problem = 'there is no such file, or it may not be read'
    if (c_close(number) /= 0) return   ! there was none
  end subroutine read_bytes

  !> A text that is not well formed in UTF-8 is taken as Latin-1, where each byte is a character:
  !! two bytes for each that is not ASCII.
  pure subroutine to_utf8(text)
    character(:), allocatable, intent(inout) :: text
    character(:), allocatable :: utf8
    integer :: i, n, byte

    if (is_utf8(text)) return
    allocate (character(2*len(text)) :: utf8)
    n = 0
    do i = 1, len(text)
      byte = ichar(text(i:i))
      if (byte < 128) then
        utf8(n + 1:n + 1) = text(i:i)
        n = n + 1
      else
        utf8(n + 1:n + 2) = char(192 + byte/64)//char(128 + mod(byte, 64))
        n = n + 2
      end if
    end do
    text = utf8(:n)
  end subroutine to_utf8

  !> Is every character of a text well formed in UTF-8? Source: table 3-7 of the Unicode standard.
  pure function is_utf8(text) result(yes)
    character(*), intent(in) :: text
    logical :: yes
    integer :: i, byte, following   ! bytes that belong to the character begun
    integer :: low, high            ! what the next of them may be

    following = 0
    low = 128
    high = 191
    yes = .false.
    do i = 1, len(text)
      byte = ichar(text(i:i))
      if (following > 0) then
        if (byte < low .or. byte > high) return
        following = following - 1
        low = 128
        high = 191
      else if (byte >= 128) then
        if (byte < 194 .or. byte > 244) return
        following = count(byte >= [194, 224, 240])
        low = merge(160, merge(144, 128, byte == 240), byte == 224)
        high = merge(159, merge(143, 191, byte == 244), byte == 237)
      end if
    end do
    yes = following == 0
  end function is_utf8

  !> The lines of a text, each ended by a single line feed, without a byte-order mark.
  pure function plain_lines(text) result(plain)
    character(*), intent(in) :: text
    character(:), allocatable :: plain
    integer :: i, n, first

    first = 1
    if (len(text) >= len(byte_order_mark)) then
      if (text(:len(byte_order_mark)) == byte_order_mark) first = len(byte_order_mark) + 1
    end if
    allocate (character(len(text) + 1) :: plain)
    n = 0
    do i = first, len(text)
      if (text(i:i) == line_feed .and. i > first) then
        if (text(i - 1:i - 1) == carriage_return) cycle
      end if
      n = n + 1
      plain(n:n) = text(i:i)
      if (text(i:i) == carriage_return) plain(n:n) = line_feed
    end do
    plain = plain(:n)//line_feed
  end function plain_lines

end module text_file_m
