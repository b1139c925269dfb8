!> The bytes of a file and what makes text of them: UTF-8 or Latin-1, line ends of every system, a
!! byte-order mark. Each procedure takes a time in proportion to the size.
module text_file_m
  use, intrinsic :: iso_c_binding, only: c_int, c_size_t, c_char, c_ptr, c_null_char, &
    c_associated, c_loc
  use kinds_m, only: i8
  use c_library_m, only: c_fclose, c_fdopen, c_ferror, c_fopen, c_fread
  use string_builder_m, only: string_builder_t
  use value_text_m, only: byte_order_mark
  implicit none
  private
  public :: read_bytes, read_stream, to_utf8, plain_lines

  character(*), parameter :: line_feed = achar(10), carriage_return = achar(13)

contains

  !> All bytes of a file; more than `most` are a problem that is found before they are read.
  subroutine read_bytes(file, most, text, problem)
    character(*), intent(in) :: file
    integer, intent(in) :: most
    character(:), allocatable, intent(out) :: text
    character(:), allocatable, intent(out) :: problem   !! empty: none
    integer(i8) :: length
    integer :: unit, status

    text = ''
    problem = ''
    inquire (file=file, size=length)
    open (newunit=unit, file=file, access='stream', form='unformatted', action='read', &
          status='old', iostat=status)
    if (status /= 0) then
      problem = 'there is no such file, or it may not be read'
      return
    end if
    if (length > most) then
      problem = 'too long'
    else
      deallocate (text)
      allocate (character(max(length, 0_i8)) :: text)
      read (unit, iostat=status) text
      if (status /= 0) problem = 'could not be read'
    end if
    close (unit)
  end subroutine read_bytes

  !> The same of a pipe or a device, or of standard input if `file` is empty: read through the C
  !! library to its end, or until it is too long.
  subroutine read_stream(file, most, text, problem)
    character(*), intent(in) :: file
    integer, intent(in) :: most
    character(:), allocatable, intent(out) :: text, problem
    integer, parameter :: length = 8192   ! of a piece, short enough for a small stack
    character(kind=c_char), target :: piece(length)
    character(length) :: part
    type(string_builder_t) :: whole
    type(c_ptr) :: stream
    integer :: n, i, total, status

    text = ''
    problem = ''
    if (len(file) == 0) then
      stream = c_fdopen(0_c_int, 'r'//c_null_char)
    else
      stream = c_fopen(file//c_null_char, 'r'//c_null_char)
    end if
    if (.not. c_associated(stream)) then
      problem = 'there is no such file, or it may not be read'
      return
    end if
    total = 0
    do
      n = int(c_fread(c_loc(piece), 1_c_size_t, size(piece, kind=c_size_t), stream))
      total = total + n
      if (n == 0 .or. total > most) exit
      do i = 1, n
        part(i:i) = piece(i)
      end do
      call whole%add(part(:n))
    end do
    text = whole%text()
    if (total > most) problem = 'too long'
    if (c_ferror(stream) /= 0) problem = 'could not be read'
    status = c_fclose(stream)
  end subroutine read_stream

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
