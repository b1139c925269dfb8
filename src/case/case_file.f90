!> The text of a case, from a file or from standard input.
module case_file_m
  use, intrinsic :: iso_c_binding, only: c_int
  use c_library_m, only: c_isatty
  use errors_m, only: problems_t
  use posix_file_m, only: is_pipe
  use text_file_m, only: read_bytes, read_stream, to_utf8
  implicit none
  private
  public :: read_text

  integer, parameter :: longest_text = 2**24   !! bytes of a case file

contains

  !> Read a whole file, or standard input if `file` is empty, and refuse what cannot be a case:
  !! nothing at all, binary data.
  !!
  !! Call it on one process and broadcast the text. A named pipe is refused, nobody may ever write
  !! to it; one of the shell (`/dev/fd/63`) has its writer.
  subroutine read_text(file, text, problems)
    character(*), intent(in) :: file
    character(:), allocatable, intent(out) :: text
    type(problems_t), intent(inout) :: problems
    character(:), allocatable :: source, problem

    text = ''
    source = file
    if (len(file) == 0) then
      source = 'standard input'
      if (c_isatty(0_c_int) /= 0) then
        call problems%add_message('no case given: name a file, or use ./mics < input/blocks.nml')
        return
      end if
    end if
    if (len(file) == 0 .or. index(file, '/dev/') == 1 .or. index(file, '/proc/') == 1) then
      call read_stream(file, longest_text, text, problem)
    else if (is_pipe(file)) then
      problem = 'is a pipe; name a file, or use ./mics < '//source
    else
      call read_bytes(file, longest_text, text, problem)
    end if
    if (problem == 'too long') then
      problem = 'longer than 16 MiB, this cannot be a case'
    else if (len(problem) == 0 .and. len(text) == 0) then
      problem = 'the case is empty'
    else if (len(problem) == 0 .and. index(text, achar(0)) > 0) then
      problem = 'holds zero bytes; a case is plain UTF-8 text'
    end if
    if (len(problem) > 0) call problems%add_message(source//': '//problem)
    call to_utf8(text)
  end subroutine read_text

end module case_file_m
