!> A result folder belongs to one running program.
!!
!! The program holds a lock on the file `run.lock` in the folder; the file says which program that
!! is. The system lets the lock go when the program ends, however it ends, so a file that was left
!! behind means nothing. The root process alone calls; a process that it started would keep the
!! lock, so it must start none.
module folder_lock_m
  use, intrinsic :: iso_fortran_env, only: error_unit
  use, intrinsic :: iso_c_binding, only: c_char, c_loc, c_null_char, c_size_t
  use kinds_m, only: wp
  use c_library_m, only: c_gethostname, c_getpid, text_of_letters
  use errors_m, only: to_text, exit_ok, exit_input, exit_files
  use parallel_m, only: parallel_pause
  use posix_file_m, only: posix_file_t, delete_file, lock_taken, lock_refused, lock_unknown
  implicit none
  private
  public :: folder_lock_t, lock_name, look_at_folder

  character(*), parameter :: lock_name = '/run.lock'

  type :: folder_lock_t
    logical :: held = .false.
    character(:), allocatable :: folder
    type(posix_file_t), private :: file
  contains
    procedure :: take => take_lock
    procedure :: release => release_lock
  end type folder_lock_t

contains

  !> Take the lock of a folder that is there, or say who has it.
  !!
  !! Between opening and locking, the file may have been deleted or moved away with its folder by
  !! the program that had it: then the path leads to another file, and we try again.
  subroutine take_lock(self, folder, code, message)
    class(folder_lock_t), intent(inout) :: self
    character(*), intent(in) :: folder
    integer, intent(out) :: code                       !! exit_ok, exit_input or exit_files
    character(:), allocatable, intent(out) :: message
    integer, parameter :: tries = 100
    integer :: i, outcome

    self%folder = folder
    self%held = .false.
    message = ''
    do i = 1, tries
      call self%file%open(folder//lock_name, 'a')
      call self%file%lock(.true., outcome)
      if (outcome == lock_refused) then
        call self%file%close()
        code = exit_input
        message = in_use_message(folder)
        return
      end if
      call self%file%rewrite(who_we_are())
      if (self%file%info /= 0) exit
      self%held = text_of(folder) == who_we_are()
      if (self%held) exit
      call self%file%close()
    end do
    code = merge(exit_ok, exit_files, self%held)
    if (self%file%info /= 0) message = self%file%message
    if (.not. self%held) call self%file%close()
    if (.not. self%held .and. len(message) == 0) message = folder//': cannot take '//lock_name
    if (self%held .and. outcome == lock_unknown) write (error_unit, '(a)') 'mics: warning: ' &
      //folder//': this file system keeps no locks; no other run may write there'
  end subroutine take_lock

  !> Give the folder free, wherever it has been moved.
  subroutine release_lock(self)
    class(folder_lock_t), intent(inout) :: self

    if (.not. self%held) return
    if (text_of(self%folder) == who_we_are()) call delete_file(self%folder//lock_name)
    call self%file%close()
    self%held = .false.
  end subroutine release_lock

  !> Is a running program writing to this folder? Nothing is changed.
  subroutine look_at_folder(folder, code, message)
    character(*), intent(in) :: folder
    integer, intent(out) :: code                       !! exit_ok or exit_input
    character(:), allocatable, intent(out) :: message
    type(posix_file_t) :: file
    integer :: outcome

    code = exit_ok
    message = ''
    call file%open(folder//lock_name, 'r')
    call file%lock(.false., outcome)
    call file%close()
    if (outcome /= lock_refused) return   ! free, or there is no such file
    code = exit_input
    message = in_use_message(folder)
  end subroutine look_at_folder

  !> Who has the folder; it may just be writing it down.
  function in_use_message(folder) result(message)
    character(*), intent(in) :: folder
    character(:), allocatable :: message
    character(:), allocatable :: holder
    integer :: i

    do i = 1, 100
      holder = text_of(folder)
      if (len(holder) > 0) exit
      call parallel_pause(0.01_wp)
    end do
    if (len(holder) == 0) holder = 'another program'
    message = folder//': the folder is in use by '//holder//'; wait until it ends, or choose ' &
      //'another folder (&run output, --output)'
  end function in_use_message

  !> What the lock file of a folder says; empty if it says nothing.
  function text_of(folder) result(text)
    character(*), intent(in) :: folder
    character(:), allocatable :: text
    type(posix_file_t) :: file
    character(:), allocatable :: bytes
    integer :: n

    allocate (character(400) :: bytes)
    call file%open(folder//lock_name, 'r')
    call file%read(bytes, n)
    call file%close()
    text = bytes(:n)
  end function text_of

  !> This process, as in 'pid 4711 on tank'.
  function who_we_are() result(text)
    character(:), allocatable :: text
    integer, parameter :: longest = 256
    character(kind=c_char), target :: name(longest)

    name = c_null_char
    if (c_gethostname(c_loc(name), int(longest - 1, c_size_t)) /= 0) name = c_null_char
    text = 'pid '//to_text(int(c_getpid()))//' on '//text_of_letters(name)
  end function who_we_are

end module folder_lock_m
