!> The bytes of a case file, from a file or from standard input.
!!
!! Read through the C library: pipes work, nothing is rewound. Text in UTF-8 stays as it is; any
!! other is taken as Latin-1, where each byte is a character, and comes back in UTF-8.
module case_file_m
  use, intrinsic :: iso_c_binding, only: c_int, c_size_t, c_char, c_ptr, c_null_char, &
    c_associated, c_loc
  use c_library_m, only: c_fclose, c_fdopen, c_ferror, c_fopen, c_fread, c_isatty
  use errors_m, only: problems_t
  use posix_file_m, only: is_pipe
  implicit none
  private
  public :: read_text, is_utf8, utf8_of_latin1

  integer, parameter :: longest_text = 2**24   !! bytes of a case file

contains

  !> Read a whole file, or standard input if `file` is empty.
  !!
  !! Call it on one process and broadcast the text. Pipes work; nothing is ever rewound. A named
  !! pipe is refused, nobody may ever write to it; one of the shell (`/dev/fd/63`) has its writer.
  subroutine read_text(file, text, problems)
    character(*), intent(in) :: file
    character(:), allocatable, intent(out) :: text
    type(problems_t), intent(inout) :: problems
    integer, parameter :: length = 8192   ! of a piece, short enough for a small stack
    character(kind=c_char), target :: piece(length)
    character(length) :: part
    character(:), allocatable :: source
    type(c_ptr) :: stream
    integer :: n, i, status

    text = ''
    source = file
    if (len(file) == 0) then
      source = 'standard input'
      if (c_isatty(0_c_int) /= 0) then
        call problems%add_message('no case given: name a file, or use ./mics < input/blocks.nml')
        return
      end if
      stream = c_fdopen(0_c_int, 'r'//c_null_char)
    else
      if (is_pipe(file) .and. index(file, '/dev/') /= 1 .and. index(file, '/proc/') /= 1) then
        call problems%add_message(source//': is a pipe; name a file, or ' &
          //'use ./mics < '//source)
        return
      end if
      stream = c_fopen(file//c_null_char, 'r'//c_null_char)
    end if
    if (.not. c_associated(stream)) then
      call problems%add_message(source//': there is no such file, or it may not be read')
      return
    end if
    do
      n = int(c_fread(c_loc(piece), 1_c_size_t, size(piece, kind=c_size_t), stream))
      if (n == 0 .or. len(text) > longest_text) exit
      do i = 1, n
        part(i:i) = piece(i)
      end do
      text = text//part(:n)
    end do
    if (c_ferror(stream) /= 0) call problems%add_message(source//': could not be read')
    status = c_fclose(stream)
    call check_text(source, text, problems)
    if (.not. is_utf8(text)) text = utf8_of_latin1(text)
  end subroutine read_text

  !> Refuse what cannot be a case: nothing at all, binary data.
  subroutine check_text(source, text, problems)
    character(*), intent(in) :: source
    character(*), intent(in) :: text
    type(problems_t), intent(inout) :: problems

    if (problems%n > 0) return
    if (len(text) == 0) then
      call problems%add_message(source//': the case is empty')
    else if (len(text) > longest_text) then
      call problems%add_message(source//': longer than 16 MiB, this cannot be a case')
    else if (index(text, achar(0)) > 0) then
      call problems%add_message(source//': holds zero bytes; a case is plain UTF-8 text')
    end if
  end subroutine check_text

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

  !> A text in Latin-1 in UTF-8: two bytes for each that is not ASCII.
  pure function utf8_of_latin1(text) result(utf8)
    character(*), intent(in) :: text
    character(:), allocatable :: utf8
    integer :: i, n, byte

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
    utf8 = utf8(:n)
  end function utf8_of_latin1

end module case_file_m
