!> The text of a case, from a file or from standard input; and where the files are that it names:
!! beside the case, else in the working folder.
module named_files_m
  use, intrinsic :: iso_c_binding, only: c_int
  use c_library_m, only: c_isatty
  use errors_m, only: problems_t
  use posix_file_m, only: is_pipe
  use text_file_m, only: read_bytes, to_utf8
  implicit none
  private
  public :: read_case_text, look_beside, found_file, file_text

  integer, parameter :: longest_text = 2**24   !! bytes of a case file

  character(:), allocatable :: folder   !! of the case, with its last '/'; not there: none

contains

  !> Read a whole file, or standard input if `file` is empty, and refuse what cannot be a case:
  !! nothing at all, binary data.
  !!
  !! Call it on one process and broadcast the text. A named pipe is refused, nobody may ever write
  !! to it; one of the shell (`/dev/fd/63`) has its writer.
  subroutine read_case_text(file, text, problems)
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
    problem = ''
    if (len(file) > 0 .and. index(file, '/dev/') /= 1 .and. index(file, '/proc/') /= 1) then
      if (is_pipe(file)) problem = 'is a pipe; name a file, or use ./mics < '//source
    end if
    if (len(problem) == 0) call read_bytes(file, longest_text, text, problem)
    if (problem == 'too long') then
      problem = 'longer than 16 MiB, this cannot be a case'
    else if (len(problem) == 0 .and. len(text) == 0) then
      problem = 'the case is empty'
    else if (len(problem) == 0 .and. index(text, achar(0)) > 0) then
      problem = 'holds zero bytes; a case is plain UTF-8 text'
    end if
    if (len(problem) > 0) call problems%add_message(source//': '//problem)
    call to_utf8(text)
  end subroutine read_case_text

  !> Look for the files that a case names beside it first; a case from standard input
  !! (`case_file` is empty) or from a pipe of the shell has no folder.
  subroutine look_beside(case_file)
    character(*), intent(in) :: case_file

    folder = case_file(:index(case_file, '/', back=.true.))
    if (index(folder, '/dev/') == 1 .or. index(folder, '/proc/') == 1) folder = ''
  end subroutine look_beside

  !> The path of a file with this name in the case.
  function found_file(file) result(path)
    character(*), intent(in) :: file
    character(:), allocatable :: path
    logical :: beside

    path = file
    if (index(file, '/') == 1 .or. len_trim(file) == 0 .or. .not. allocated(folder)) return
    inquire (file=folder//file, exist=beside)
    if (beside) path = folder//file
  end function found_file

  !> The same for people: its name, and where it is if not beside the case.
  function file_text(file) result(text)
    character(*), intent(in) :: file
    character(:), allocatable :: text

    text = file
    if (index(file, '/') == 1 .or. .not. allocated(folder)) return
    if (len(folder) == 0) return
    if (found_file(file) == file) text = file//' in the working folder, not beside the case'
  end function file_text

end module named_files_m
