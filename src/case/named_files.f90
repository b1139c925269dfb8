!> Where the files are that a case names: beside the case, else in the working folder.
module named_files_m
  use case_types_m, only: case_t
  implicit none
  private
  public :: look_beside, found_file, file_text

contains

  !> Look for the files that a case names beside it first; a case from standard input
  !! (`case_file` is empty) or from a pipe of the shell has no folder.
  pure subroutine look_beside(case_file, case)
    character(*), intent(in) :: case_file
    type(case_t), intent(inout) :: case
    character(:), allocatable :: folder
    integer :: s

    folder = case_file(:index(case_file, '/', back=.true.))
    if (index(folder, '/dev/') == 1 .or. index(folder, '/proc/') == 1) folder = ''
    case%fluid%folder = folder
    case%bed%folder = folder
    case%start%folder = folder
    do s = 1, size(case%shape)
      case%shape(s)%folder = folder
    end do
    do s = 1, size(case%drop)
      case%drop(s)%folder = folder
    end do
    do s = 1, size(case%body)
      case%body(s)%folder = folder
    end do
  end subroutine look_beside

  !> The path of a file with this name in a case that stands in `folder`.
  function found_file(folder, file) result(path)
    character(:), allocatable, intent(in) :: folder   !! with its last '/'
    character(*), intent(in) :: file
    character(:), allocatable :: path
    logical :: beside

    path = file
    if (.not. has_choice(folder, file)) return
    inquire (file=folder//file, exist=beside)
    if (beside) path = folder//file
  end function found_file

  !> The same for people: its name, and where it is if not beside the case.
  function file_text(folder, file) result(text)
    character(:), allocatable, intent(in) :: folder   !! with its last '/'
    character(*), intent(in) :: file
    character(:), allocatable :: text

    text = file
    if (.not. has_choice(folder, file)) return
    if (found_file(folder, file) == file) text = file//' in the working folder, not beside the case'
  end function file_text

  !> Can a file of this name be in two places?
  pure function has_choice(folder, file) result(yes)
    character(:), allocatable, intent(in) :: folder
    character(*), intent(in) :: file
    logical :: yes

    yes = .false.
    if (allocated(folder)) yes = len(folder) > 0 .and. index(file, '/') /= 1
  end function has_choice

end module named_files_m
