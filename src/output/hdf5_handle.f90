!> An HDF5 file as such: opened and closed, flushed, given room, asked what it holds.
!!
!! Every status of HDF5 is looked at. The first error sets `info` and a `message` that names the
!! file, the dataset and the reason; from then on every procedure of that file returns at once, so a
!! caller may write a whole group of things and look at `info` once, before anything that waits for
!! others.
!!
!! A `shared` file is opened by all processes together: every procedure is then called by all of
!! them, and blocks of cells are written collectively. Any other file, and all files of a run on one
!! process, belong to the process that opens them.
!!
!! The files keep the oldest format and no locks, and columns without compression never move a chunk
!! once it is there: a file that was flushed opens again whatever happens to the program. Whoever
!! changes such a file reserves its space first (`reserve`). A file is left as it is on the
!! disk, without the changes that HDF5 still keeps in memory, once HDF5 has failed to write to it.
module hdf5_handle_m
  use, intrinsic :: iso_c_binding, only: c_int, c_int64_t, c_ptr, c_f_pointer
  use hdf5, only: hid_t, hsize_t, size_t, h5fclose_f, h5fcreate_f, h5fflush_f, h5fget_filesize_f
  use hdf5, only: h5fopen_f, h5gclose_f, h5gcreate_f, h5ldelete_f, h5lexists_f, h5pclose_f
  use hdf5, only: h5pcreate_f, h5pset_cache_f, h5pset_fclose_degree_f, H5F_ACC_RDONLY_F
  use hdf5, only: H5F_ACC_RDWR_F, H5F_ACC_EXCL_F, H5F_CLOSE_STRONG_F, H5F_SCOPE_LOCAL_F
  use hdf5, only: H5P_DATASET_XFER_F, H5P_DEFAULT_F, H5P_FILE_ACCESS_F
  use kinds_m, only: wp, i8
  use errors_m, only: fatal, exit_files
  use parallel_m, only: is_root, my_rank, nproc, set_file_access, set_collective, global_max
  use parallel_m, only: global_min, broadcast, share_failure
  use hdf5_reason_m, only: hdf5_start, hdf5_reason
  use posix_file_m, only: is_pipe
  use file_space_m, only: held_file_t
  implicit none
  private
  public :: h5_handle_t

  !> What `hdf5_attributes_m`, `hdf5_datasets_m` and `hdf5_file_m` extend, in this order.
  type :: h5_handle_t
    character(:), allocatable :: path
    logical :: shared = .false.
    integer :: info = 0                    !! 0: no error so far
    character(:), allocatable :: message   !! file, dataset and reason of the first error
    ! Only for the modules that extend this type:
    logical :: broken = .false.            !! HDF5 failed: what it has in memory is not to be used
    integer(hid_t) :: id = -1
    integer(hid_t) :: collective = -1      !! transfer list of blocks of cells
    logical, private :: writing = .false.
    logical, private :: complete = .false.   !! it was whole on the disk at least once
    type(held_file_t), private :: held       !! while it is written
  contains
    procedure :: create => file_create
    procedure :: open => file_open
    procedure :: close => file_close
    procedure :: abandon
    procedure :: flush => file_flush
    procedure :: reserve
    procedure :: group => file_group
    procedure :: has => file_has
    procedure :: remove => file_remove
    procedure :: check, agree
  end type h5_handle_t

  interface
    !> The address of the number of the open file.
    integer(c_int) function h5fget_vfd_handle(file, access, handle) &
      bind(c, name='H5Fget_vfd_handle')
      import :: c_int, c_int64_t, c_ptr
      implicit none
      integer(c_int64_t), value :: file, access
      type(c_ptr), intent(out) :: handle
    end function h5fget_vfd_handle
  end interface

contains

  !> Keep an error: `status` is what HDF5 returned when it was asked to do `what`.
  subroutine check(self, status, what)
    class(h5_handle_t), intent(inout) :: self
    integer, intent(in) :: status
    character(*), intent(in) :: what   !! like 'write /series/time'

    if (status >= 0 .or. self%info /= 0) return
    self%info = 1
    self%broken = .true.
    self%message = self%path//': cannot '//what//': '//hdf5_reason()
  end subroutine check

  !> An error of one process of a shared file becomes that of all.
  !!
  !! A process that failed may find that the others wait for it inside MPI (seen with a full disk):
  !! then nothing is left but to end them all, though this is a lower procedure.
  subroutine agree(self)
    class(h5_handle_t), intent(inout) :: self
    real(wp), parameter :: timeout = 3.0_wp   ! [s]
    logical :: failed, answered

    if (.not. self%shared) return
    if (self%info /= 0 .and. .not. self%broken) return   ! all have the reason
    failed = self%info /= 0
    call share_failure(timeout, failed, answered)
    if (.not. answered) then
      call leave(self)
      call fatal(exit_files, self%message)
    end if
    if (failed) call share_message(self)
  end subroutine agree

  !> Give all processes the message of the first one that failed.
  subroutine share_message(self)
    class(h5_handle_t), intent(inout) :: self
    integer, parameter :: longest = 500
    real(wp) :: first(1), letter(longest)
    integer :: i

    first = huge(1.0_wp)
    if (self%info /= 0) first = real(my_rank(), wp)
    call global_min(first)
    letter = 0.0_wp
    if (nint(first(1)) == my_rank()) then
      do i = 1, min(longest, len(self%message))
        letter(i) = real(ichar(self%message(i:i)), wp)
      end do
    end if
    call global_max(letter)
    self%info = 1
    self%broken = .true.
    self%message = repeat(' ', count(letter > 0.0_wp))
    do i = 1, len(self%message)
      self%message(i:i) = char(nint(letter(i)))
    end do
  end subroutine share_message

  !> Create an empty file; one that exists is an error, whoever made it.
  subroutine file_create(self, path, shared)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: path
    logical, intent(in) :: shared   !! all processes call
    integer(hid_t) :: access
    integer :: status

    call begin_file(self, path, shared, access)
    self%writing = .true.
    if (self%info /= 0) return
    call h5fcreate_f(path, H5F_ACC_EXCL_F, self%id, status, access_prp=access)
    call self%check(status, 'create the file')
    call h5pclose_f(access, status)
    call hold_file(self)
    call self%agree()
  end subroutine file_create

  !> Open a file that exists.
  subroutine file_open(self, path, shared, writing)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: path
    logical, intent(in) :: shared    !! all processes call
    logical, intent(in) :: writing
    integer(hid_t) :: access
    integer :: status

    call begin_file(self, path, shared, access)
    self%writing = writing
    self%complete = .true.
    if (is_pipe(path)) then
      self%info = 1
      self%message = path//': cannot open the file: it is a pipe'
    end if
    if (self%info /= 0) return
    call h5fopen_f(path, merge(H5F_ACC_RDWR_F, H5F_ACC_RDONLY_F, writing), self%id, status, access)
    call self%check(status, 'open the file')
    call h5pclose_f(access, status)
    if (writing) call hold_file(self)
    call self%agree()
  end subroutine file_open

  !> Hold the file by the number under which HDF5 has it. MPI tells none: then each process opens
  !! the path once more.
  subroutine hold_file(self)
    class(h5_handle_t), intent(inout) :: self
    type(c_ptr) :: handle
    integer(c_int), pointer :: number

    if (self%info /= 0) return
    if (self%shared) then
      call self%held%hold(self%path, self%message)
    else
      call self%check(h5fget_vfd_handle(self%id, H5P_DEFAULT_F, handle), 'open the file')
      if (self%info /= 0) return
      call c_f_pointer(handle, number)
      call self%held%hold(self%path, self%message, number)
    end if
    self%broken = len(self%message) > 0
    if (self%broken) self%info = 1
  end subroutine hold_file

  !> Start HDF5 and make the lists that say how the file is accessed.
  subroutine begin_file(self, path, shared, access)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: path
    logical, intent(in) :: shared
    integer(hid_t), intent(out) :: access
    integer :: status

    self%path = path
    self%shared = shared .and. nproc() > 1
    self%info = 0
    self%complete = .false.
    self%broken = .false.
    self%id = -1
    access = -1
    call hdf5_start(status)
    call self%check(status, 'start HDF5')
    if (self%info /= 0) return
    call h5pcreate_f(H5P_FILE_ACCESS_F, access, status)
    call self%check(status, 'set the access')
    call h5pset_fclose_degree_f(access, H5F_CLOSE_STRONG_F, status)
    call self%check(status, 'set the access')
    call h5pset_cache_f(access, 0, 1_size_t, 0_size_t, 0.0, status)   ! rows go straight to the file
    call self%check(status, 'set the access')
    call h5pcreate_f(H5P_DATASET_XFER_F, self%collective, status)
    call self%check(status, 'set the access')
    if (.not. self%shared) return
    call set_file_access(access, status)
    call self%check(status, 'set the access')
    call set_collective(self%collective, status)
    call self%check(status, 'set the access')
  end subroutine begin_file

  !> Write everything out and close the file, its datasets with it; done even after an error.
  subroutine file_close(self, stored)
    class(h5_handle_t), intent(inout) :: self
    logical, intent(in), optional :: stored   !! wait until the disk has it
    integer(i8) :: used
    integer :: status

    if (self%id < 0) return
    if (self%writing) call self%flush()
    if (self%writing .and. (self%broken .or. .not. self%complete)) then
      call leave(self)
    else
      used = length_of(self)
      call h5pclose_f(self%collective, status)
      call h5fclose_f(self%id, status)
      call self%check(status, 'close the file')
      if (self%writing .and. .not. self%shared) call self%held%shorten(used)
      if (present(stored) .and. self%info == 0) call store_file(self)
    end if
    self%id = -1
    call self%agree()
    call self%held%let_go()
  end subroutine file_close

  !> Wait until a file that was closed is on the disk; one that does not get there is deleted.
  subroutine store_file(self)
    class(h5_handle_t), intent(inout) :: self

    call self%held%store(self%message)
    self%broken = len(self%message) > 0
    if (.not. self%broken) return
    self%info = 1
    call self%held%discard()
  end subroutine store_file

  !> Close a file that was created, and delete it.
  subroutine abandon(self)
    class(h5_handle_t), intent(inout) :: self

    self%complete = .false.
    self%broken = .true.
    if (self%info == 0) self%info = 1
    if (self%id >= 0) call leave(self)
    self%id = -1
  end subroutine abandon

  !> Bytes of a file that are in use. Of a shared file HDF5 does not know; it cuts it to that length
  !! when it flushes.
  function length_of(self) result(bytes)
    class(h5_handle_t), intent(inout) :: self
    integer(i8) :: bytes
    integer(hsize_t) :: used
    integer :: status

    if (self%shared) then
      bytes = self%held%length()
    else
      call h5fget_filesize_f(self%id, used, status)
      call self%check(status, 'tell the size of the file')
      bytes = int(used, i8)
    end if
  end function length_of

  !> Leave a file that could not be written: to close it would write half of what is in memory.
  !! One that was never complete is deleted.
  subroutine leave(self)
    class(h5_handle_t), intent(inout) :: self

    if (.not. self%complete) call self%held%discard()
  end subroutine leave

  !> Hand everything written so far to the operating system.
  subroutine file_flush(self)
    class(h5_handle_t), intent(inout) :: self
    integer :: status

    if (self%info /= 0) return
    call h5fflush_f(self%id, H5F_SCOPE_LOCAL_F, status)
    call self%check(status, 'write')
    call self%agree()
    if (self%info == 0) self%complete = .true.
  end subroutine file_flush

  !> See to it that the next changes of a file that was just flushed find this much room at its end.
  !! Without room nothing more is written to it but by `last_integer`.
  subroutine reserve(self, bytes)
    class(h5_handle_t), intent(inout) :: self
    integer(i8), intent(in) :: bytes
    character(:), allocatable :: reason

    if (self%info /= 0) return
    reason = ''
    if (is_root() .or. .not. self%shared) call self%held%lengthen(length_of(self) + bytes, reason)
    if (self%shared) call broadcast(reason)
    if (len(reason) == 0) return
    self%info = 1
    self%message = reason
  end subroutine reserve

  !> Create a group; the group around it must exist.
  subroutine file_group(self, name)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: name   !! full path in the file
    integer(hid_t) :: group
    integer :: status

    if (self%info /= 0) return
    call h5gcreate_f(self%id, name, group, status)
    call self%check(status, 'create '//name)
    if (self%info == 0) call h5gclose_f(group, status)
    call self%agree()
  end subroutine file_group

  !> Is there an object of this name? The group around it must exist.
  function file_has(self, name) result(yes)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: name
    logical :: yes
    integer :: status

    yes = .false.
    if (self%info /= 0) return
    call h5lexists_f(self%id, name, yes, status)
    call self%check(status, 'look for '//name)
  end function file_has

  !> Remove a dataset, or a group with all it holds.
  subroutine file_remove(self, name)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer :: status

    if (self%info /= 0) return
    call h5ldelete_f(self%id, name, status)
    call self%check(status, 'remove '//name)
  end subroutine file_remove

end module hdf5_handle_m
