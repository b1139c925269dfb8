!> A result folder belongs to one running program.
!!
!! The program holds a lock on the file `run.lock` in the folder; the file says which program that
!! is. The system lets the lock go when the program ends, however it ends, so a file that was left
!! behind means nothing. The root process alone calls; a process that it started would keep the
!! lock, so it must start none.
!!
!! A folder that is moved, replaced or deleted is lost to the run, though the lock stays: the path
!! leads to another `run.lock` then, or to none (`verify`). Where nodes do not see each other's
!! locks a run may also be put off by a second one that takes the same file, and says so in it.
!! Files are deleted and renamed in the folder that is held, never by its path.
module folder_lock_m
  use, intrinsic :: iso_fortran_env, only: error_unit
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_loc, c_null_char, c_size_t
  use kinds_m, only: wp
  use c_library_m, only: c_close, c_faccessat, c_gethostname, c_getpid, c_open, c_renameat, &
    c_unlinkat, text_of_letters
  use errors_m, only: to_text, exit_ok, exit_input, exit_files
  use parallel_m, only: parallel_pause
  use posix_file_m, only: posix_file_t, is_file_at, system_reason, lock_refused, lock_unknown
  implicit none
  private
  public :: folder_lock_t, lock_name, stop_name, look_at_folder

  character(*), parameter :: lock_name = '/run.lock'
  character(*), parameter :: stop_name = 'stop'   !! of the file that asks the run to end

  type :: folder_lock_t
    logical :: held = .false.
    logical :: taken = .false.             !! by another run: also files that are open are its now
    character(:), allocatable :: folder
    type(posix_file_t), private :: file
    integer(c_int), private :: number = -1   !! of the open folder
  contains
    procedure :: take => take_lock
    procedure :: release => release_lock
    procedure :: verify, has, remove, rename
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
    real(wp), parameter :: notice = 1.0_wp   !! that a run on another node is given to end [s]
    character(:), allocatable :: before, here
    integer :: i, outcome

    self%folder = folder
    self%held = .false.
    message = ''
    here = who_we_are()
    here = here(index(here, ' on '):)//'|'
    do i = 1, tries
      self%number = c_open(folder//c_null_char, 0_c_int)
      call self%file%open(folder//lock_name, 'a+')
      call self%file%lock(.true., outcome)
      if (outcome == lock_refused) then
        call close_all(self)
        code = exit_input
        message = in_use_message(folder)
        return
      end if
      before = self%file%content()
      call self%file%rewrite(who_we_are())
      if (self%file%info /= 0) exit
      if (len(before) > 0 .and. index(before//'|', here) == 0) call parallel_pause(notice)
      self%held = is_ours(self)
      if (self%held) exit
      call close_all(self)
    end do
    code = merge(exit_ok, exit_files, self%held)
    if (self%file%info /= 0) message = self%file%message
    if (.not. self%held) call close_all(self)
    if (.not. self%held .and. len(message) == 0) message = folder//': cannot take '//lock_name
    if (self%held .and. outcome == lock_unknown) write (error_unit, '(a)') 'mics: warning: ' &
      //folder//': this file system keeps no locks; no other run may write there'
  end subroutine take_lock

  !> Is the folder still that of this run? Called before anything is created, renamed or deleted
  !! there, and before rows and frames.
  subroutine verify(self, code, message)
    class(folder_lock_t), intent(inout) :: self
    integer, intent(inout) :: code                             !! exit_files if it is not
    character(:), allocatable, intent(inout) :: message

    if (.not. self%held) return
    if (is_ours(self)) return
    code = exit_files
    message = self%folder//': the folder was moved, replaced or deleted'
    if (self%taken) message = self%folder//': another run has taken the folder'
    message = message//'; this run ends and changes nothing there'
  end subroutine verify

  !> Does the path lead to the lock that is held, and has nobody else taken it? The path is opened
  !! anew, for a network file system may keep an old text of an open file.
  function is_ours(self) result(yes)
    class(folder_lock_t), intent(inout) :: self
    logical :: yes

    yes = is_file_at(self%file%number, self%folder//lock_name)
    if (yes) self%taken = text_of(self%folder) /= who_we_are()
    if (.not. yes) self%taken = self%file%content() /= who_we_are()
    yes = yes .and. self%number >= 0 .and. .not. self%taken
  end function is_ours

  !> Does the folder that is held have a file of this name?
  function has(self, name) result(yes)
    class(folder_lock_t), intent(in) :: self
    character(*), intent(in) :: name
    logical :: yes

    yes = c_faccessat(self%number, name//c_null_char, 0_c_int, 0_c_int) == 0
  end function has

  !> Delete a file of the folder that is held, if it is there and the folder is still that of this
  !! run.
  subroutine remove(self, name)
    class(folder_lock_t), intent(inout) :: self
    character(*), intent(in) :: name

    if (.not. self%held) return
    if (.not. is_ours(self)) return
    if (c_unlinkat(self%number, name//c_null_char, 0_c_int) /= 0) return   ! it was not there
  end subroutine remove

  !> Rename a file of the folder that is held; one of the new name is replaced in one stroke.
  subroutine rename(self, from, to, info, message)
    class(folder_lock_t), intent(in) :: self
    character(*), intent(in) :: from, to
    integer, intent(out) :: info   !! 0: done
    character(:), allocatable, intent(inout) :: message

    info = c_renameat(self%number, from//c_null_char, self%number, to//c_null_char)
    if (info /= 0) message = self%folder//'/'//from//': cannot rename it to '//to//': ' &
      //system_reason()
  end subroutine rename

  !> Give the folder free.
  subroutine release_lock(self)
    class(folder_lock_t), intent(inout) :: self

    if (.not. self%held) return
    call self%remove(lock_name(2:))
    call close_all(self)
    self%held = .false.
  end subroutine release_lock

  subroutine close_all(self)
    class(folder_lock_t), intent(inout) :: self

    call self%file%close()
    if (c_close(self%number) /= 0) continue   ! there was none
    self%number = -1
  end subroutine close_all

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

    call file%open(folder//lock_name, 'r')
    text = file%content()
    call file%close()
  end function text_of

  !> This process, as in 'pid 4711 on tank'.
  function who_we_are() result(text)
    character(:), allocatable :: text
    character(kind=c_char), target :: name(256)

    name = c_null_char
    if (c_gethostname(c_loc(name), int(size(name) - 1, c_size_t)) /= 0) name = c_null_char
    text = 'pid '//to_text(int(c_getpid()))//' on '//text_of_letters(name)
  end function who_we_are

end module folder_lock_m
