!> Where the files are that a case names: beside the case, else in the working folder.
module named_files_m
  implicit none
  private
  public :: look_beside, found_file, file_text

  character(:), allocatable :: folder   !! of the case, with its last '/'; not there: none

contains

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
    if (.not. has_choice(file)) return
    inquire (file=folder//file, exist=beside)
    if (beside) path = folder//file
  end function found_file

  !> The same for people: its name, and where it is if not beside the case.
  function file_text(file) result(text)
    character(*), intent(in) :: file
    character(:), allocatable :: text

    text = file
    if (.not. has_choice(file)) return
    if (found_file(file) == file) text = file//' in the working folder, not beside the case'
  end function file_text

  !> Can a file of this name be in two places?
  function has_choice(file) result(yes)
    character(*), intent(in) :: file
    logical :: yes

    yes = .false.
    if (allocated(folder)) yes = len(folder) > 0 .and. index(file, '/') /= 1
  end function has_choice

end module named_files_m
