!> The folder of the results: made or found fit, never at the cost of older results.
!!
!! A folder that holds a `run.h5` is renamed to `DIR.bak-N` first; any other folder that is not
!! empty is refused, and so is one in which another program is at work. Only the root process looks
!! and acts; the outcome is broadcast.
module output_folder_m
  use, intrinsic :: iso_c_binding, only: c_int, c_long, c_ptr, c_null_char, c_associated
  use, intrinsic :: iso_fortran_env, only: error_unit
  use c_library_m, only: c_closedir, c_mkdir, c_opendir, c_readdir, c_rename, c_stat, &
    stat_size
  use kinds_m, only: i8
  use errors_m, only: to_text, exit_ok, exit_input, exit_files
  use parallel_m, only: is_root, broadcast
  use posix_file_m, only: posix_file_t
  use folder_lock_m, only: folder_lock_t, lock_name, stop_name, look_at_folder
  implicit none
  private
  public :: check_folder, prepare_folder, continue_folder, same_folder

  character(*), parameter :: result_file(*) = [character(14) :: 'run.h5', 'fields.vtkhdf', &
    'blocks.vtkhdf']
  integer, parameter :: longest_path = 4000   !! characters; Linux takes 4095, files of it included

  character(*), &
    parameter :: refused = 'no permission, no room, or a part of the path is not a folder'

contains

  !> Could `prepare_folder` use this folder? Nothing is changed. All processes call.
  subroutine check_folder(what, path, code, message)
    character(*), intent(in) :: what   !! who asks for it: '&run output' or '--output'
    character(*), intent(in) :: path
    integer, intent(out) :: code                           !! exit_ok or exit_input
    character(:), allocatable, intent(out) :: message
    logical :: free

    message = ''
    code = exit_ok
    if (is_root()) then
      if (len(path) > longest_path) then
        message = what//' = '''//path(:40)//'...'': has '//to_text(len(path)) &
          //' characters, must have at most '//to_text(longest_path)
      else if (.not. exists(path)) then
        continue
      else if (.not. exists(path//'/.')) then
        message = what//' = '''//path//''': is a file, must be a folder'
      else if (.not. exists(path//'/run.h5')) then
        free = is_empty(path)
        if (.not. free) free = exists(path//'/run.h5')   ! a run may just have begun there
        if (.not. free) message = what//' = '''//path &
          //''': the folder is not empty and holds no run.h5, ' &
          //'must be new, empty, or that of an older run'
      end if
      if (len(message) > 0) code = exit_input
    end if
    call share_outcome(code, message)
  end subroutine check_folder

  !> Make an empty folder for a new run; the results of an older run are renamed away first.
  subroutine prepare_folder(what, path, lock, code, message)
    character(*), intent(in) :: what                       !! '&run output' or '--output'
    character(*), intent(in) :: path
    type(folder_lock_t), intent(inout) :: lock             !! of the root process, if all went well
    integer, intent(out) :: code                           !! exit_ok, exit_input or exit_files
    character(:), allocatable, intent(out) :: message      !! of an error

    call check_folder(what, path, code, message)
    if (code /= exit_ok) return
    if (is_root()) call take_folder(trimmed(path), lock, code, message)
    call share_outcome(code, message)
  end subroutine prepare_folder

  !> Lock the folder and rename it away while it holds older results. The lock moves with it, and is
  !! kept until the new folder has one, so that of many programs that start here one goes on.
  subroutine take_folder(path, lock, code, message)
    character(*), intent(in) :: path
    type(folder_lock_t), intent(inout) :: lock
    integer, intent(out) :: code
    character(:), allocatable, intent(out) :: message
    type(folder_lock_t) :: old
    integer, parameter :: tries = 100
    logical :: gone, used
    integer :: i

    do i = 1, tries
      code = exit_ok
      message = ''
      call make_folder(path, code, message)
      if (code == exit_ok) call lock%take(path, code, message)
      call old%release()
      gone = .not. exists(path)
      used = exists(path//'/run.h5')
      if (code == exit_files .and. gone) cycle   ! another program has just renamed it
      if (code /= exit_ok .or. .not. used) return
      call keep_old_results(path, lock, code, message)
      if (code /= exit_ok) then
        call lock%release()
        return
      end if
      old = lock
    end do
  end subroutine take_folder

  !> Rename a folder that is locked to the first free DIR.bak-N.
  subroutine keep_old_results(path, lock, code, message)
    character(*), intent(in) :: path
    type(folder_lock_t), intent(inout) :: lock             !! of this folder
    integer, intent(inout) :: code
    character(:), allocatable, intent(inout) :: message
    character(:), allocatable :: older
    integer :: n

    n = 1
    do while (exists(path//'.bak-'//to_text(n)))
      n = n + 1
    end do
    older = path//'.bak-'//to_text(n)
    call lock%verify(code, message)
    if (code /= exit_ok) return
    if (c_rename(path//c_null_char, older//c_null_char) /= 0) then
      code = exit_files
      message = path//': cannot rename it to '//older//': '//refused
      return
    end if
    lock%folder = older
    write (error_unit, '(a)') 'mics: the older results in '//path//' are kept as '//older
  end subroutine keep_old_results

  !> Are these names of one folder that is there? Device and inode tell.
  logical function same_folder(one, other) result(same)
    character(*), intent(in) :: one, other
    integer(c_long) :: there(stat_size, 2)

    same = .false.
    if (c_stat(one//c_null_char, there(:, 1)) /= 0) return
    if (c_stat(other//c_null_char, there(:, 2)) == 0) same = all(there(:2, 1) == there(:2, 2))
  end function same_folder

  !> Make a folder and those around it, as far as they are missing.
  subroutine make_folder(path, code, message)
    character(*), intent(in) :: path
    integer, intent(inout) :: code
    character(:), allocatable, intent(inout) :: message
    integer, parameter :: all_may = int(o'777')   ! cut down by the user's mask
    integer :: at

    do at = 1, len(path)
      if (at < len(path)) then
        if (path(at + 1:at + 1) /= '/') cycle
      end if
      if (exists(path(:at))) cycle
      if (c_mkdir(path(:at)//c_null_char, int(all_may, c_int)) == 0) cycle
      if (exists(path(:at))) cycle   ! another program was quicker
      message = path//': cannot make the folder: '//refused
      code = exit_files
      return
    end do
  end subroutine make_folder

  !> Where a run that goes on from `restart` writes: the folder of that file, or, if `output` is not
  !! empty, a new folder with copies of its results.
  subroutine continue_folder(restart, output, lock, path, code, message)
    character(*), intent(in) :: restart, output
    type(folder_lock_t), intent(inout) :: lock             !! of the root process, if all went well
    character(:), allocatable, intent(out) :: path         !! of the folder
    integer, intent(out) :: code
    character(:), allocatable, intent(out) :: message
    character(:), allocatable :: from
    integer :: i, made

    code = exit_ok
    message = ''
    from = '.'
    if (index(restart, '/') > 0) from = trimmed(restart(:index(restart, '/', back=.true.)))
    path = from
    if (len(output) > 0) path = trimmed(output)
    if (same_folder(path, from)) then
      if (is_root()) call lock%take(path, code, message)
      if (is_root() .and. code == exit_ok) call lock%remove(stop_name)   ! it was for an earlier run
    else
      if (is_root()) call look_at_folder(from, code, message)   ! no copy of a growing file
      if (is_root() .and. code == exit_ok) then
        if (.not. exists(from//'/run.h5')) then
          code = exit_files
          message = from//'/run.h5: is missing; a restart file goes on with the run.h5 beside it'
        end if
      end if
      call share_outcome(code, message)
      if (code == exit_ok) call prepare_folder('--output', output, lock, code, message)
      if (code == exit_ok .and. is_root()) then   ! the result files, all or none
        made = 0
        do i = 1, size(result_file)
          if (code /= exit_ok) exit
          if (exists(from//'/'//trim(result_file(i)))) call copy_file(from, trim(result_file(i)), &
            lock, code, message)
          if (code == exit_ok) made = i
        end do
        if (code /= exit_ok) then
          do i = 1, made
            call lock%remove(trim(result_file(i)))
          end do
          call lock%release()
        end if
      end if
    end if
    call share_outcome(code, message)
  end subroutine continue_folder

  !> The root process broadcasts code and message.
  subroutine share_outcome(code, message)
    integer, intent(inout) :: code
    character(:), allocatable, intent(inout) :: message

    call broadcast(code)
    call broadcast(message)
  end subroutine share_outcome

  !> A path without the slashes and blanks at its end.
  pure function trimmed(path) result(short)
    character(*), intent(in) :: path
    character(:), allocatable :: short

    short = path(:max(verify(path, '/ ', back=.true.), min(1, len(path))))
  end function trimmed

  function exists(path) result(yes)
    character(*), intent(in) :: path
    logical :: yes

    inquire (file=path, exist=yes)
  end function exists

  !> Does a folder hold nothing but itself, its parent and a lock? One that cannot be read counts as
  !! full.
  function is_empty(path) result(yes)
    character(*), intent(in) :: path
    logical :: yes
    type(c_ptr) :: folder
    integer :: n

    yes = .false.
    folder = c_opendir(path//c_null_char)
    if (.not. c_associated(folder)) return
    n = 0
    do while (c_associated(c_readdir(folder)))
      n = n + 1
    end do
    yes = n <= merge(3, 2, exists(path//lock_name))
    if (c_closedir(folder) /= 0) yes = .false.
  end function is_empty

  !> Copy a file to a folder where there is none of its name; a copy that cannot be completed is
  !! deleted.
  subroutine copy_file(from, name, lock, code, message)
    character(*), intent(in) :: from, name
    type(folder_lock_t), intent(inout) :: lock             !! of the folder
    integer, intent(inout) :: code
    character(:), allocatable, intent(inout) :: message
    character(:), allocatable :: bytes
    type(posix_file_t) :: source, target
    logical :: made
    integer(i8) :: place
    integer :: n

    bytes = repeat(' ', 2**20)
    call source%open(from//'/'//name, 'r')
    call target%open(lock%folder//'/'//name, 'wx')
    made = target%info == 0
    place = 0
    do
      call source%read(place, bytes, n)
      if (n <= 0 .or. target%info /= 0) exit
      call target%write(place, bytes(:n))
      place = place + n
    end do
    call source%close()
    call target%close()
    if (source%info == 0 .and. target%info == 0) return
    code = exit_files
    message = source%message
    if (source%info == 0) message = target%message
    if (made) call lock%remove(name)
  end subroutine copy_file

end module output_folder_m
