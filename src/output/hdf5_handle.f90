!> An HDF5 file: opened and closed, given room; its groups and attributes. Datasets of one shape are
!! in `hdf5_file_m`, columns, which grow by rows, in `table_m`.
!!
!! The first error sets `info` and a `message` that names the file, the dataset and the reason; from
!! then on every procedure of that file returns at once, so a caller may write a whole group of
!! things and look at `info` once, before anything that waits for others.
!!
!! A file belongs to the process that opens it. One that is `shared` is written by all processes
!! together: every procedure is then called by all of them, arrays and rows come from the root
!! process, and blocks of cells are written collectively. What the root process does alone there, to
!! create the file and to give it room, is an error of all; any other error ends the run at once,
!! since the others may be waiting inside MPI.
!!
!! The files keep the oldest format and no locks, and columns without compression never move a chunk
!! once it is there: a file that was flushed opens again whatever happens to the program. Whoever
!! changes such a file reserves its space first (`reserve`). A file is left as it is on the
!! disk, without the changes that HDF5 still keeps in memory, once HDF5 has failed to write to it.
!!
!! The High-Level library of HDF5 is not used: its attributes are neither single values nor texts
!! of any length, and it loses the reason of an error.
module hdf5_handle_m
  use, intrinsic :: iso_c_binding, only: c_int, c_int64_t, c_ptr, c_loc, c_char, c_null_char, &
    c_f_pointer, c_funptr, c_funloc, c_associated
  use hdf5, only: hid_t, hsize_t, size_t, h5kind_to_type, H5_INTEGER_KIND, H5P_DEFAULT_F
  use hdf5, only: h5fclose_f, h5fcreate_f, h5fflush_f, h5fget_filesize_f, h5fopen_f
  use hdf5, only: h5gclose_f, h5gcreate_f, h5ldelete_f, h5lexists_f
  use hdf5, only: h5pclose_f, h5pcreate_f, h5pset_cache_f, h5pset_fclose_degree_f
  use hdf5, only: H5F_ACC_EXCL_F, H5F_ACC_RDONLY_F, H5F_ACC_RDWR_F, H5F_CLOSE_STRONG_F
  use hdf5, only: H5F_SCOPE_LOCAL_F, H5P_DATASET_XFER_F, H5P_FILE_ACCESS_F
  use hdf5, only: h5aclose_f, h5acreate_f, h5aexists_f, h5aget_type_f
  use hdf5, only: h5aopen_by_name_f, h5aopen_f, h5aread_f, h5awrite_f, h5oclose_f, h5oopen_f
  use hdf5, only: h5sclose_f, h5screate_f, h5screate_simple_f, H5S_SCALAR_F
  use hdf5, only: h5tclose_f, h5tcopy_f, h5tset_cset_f, h5tset_size_f
  use hdf5, only: H5T_CSET_UTF8_F, H5T_FORTRAN_S1, H5T_NATIVE_DOUBLE, H5T_STRING
  use hdf5, only: h5open_f, h5eset_auto_f, h5dont_atexit_f
  use c_library_m, only: c_setenv, text_at
  use kinds_m, only: wp, i8
  use errors_m, only: fatal, exit_files
  use parallel_m, only: is_root, nproc, set_file_access, set_collective, broadcast, &
    global_max
  use posix_file_m, only: is_pipe
  use file_space_m, only: held_file_t
  implicit none
  private
  public :: h5_handle_t

  integer, parameter :: longest_reason = 512
  logical :: started = .false.             !! is HDF5?

  type :: h5_handle_t
    character(:), allocatable :: path
    integer :: info = 0                      !! 0: no error so far
    character(:), allocatable :: message     !! file, dataset and reason of the first error
    logical :: shared = .false.
    integer(hid_t) :: id = -1
    integer(hid_t) :: transfer = -1          !! how blocks of cells are written
    logical, private :: writing = .false.
    logical, private :: broken = .false.     !! what HDF5 has in memory is not to be used
    logical, private :: complete = .false.   !! it was whole on the disk at least once
    type(held_file_t), private :: held       !! while it is written
  contains
    procedure :: create => file_create
    procedure :: open => file_open
    procedure :: close => file_close
    procedure :: flush => file_flush
    procedure :: reserve, check, fail
    procedure :: group, has, remove
    procedure, private :: attribute_text, attribute_integers, attribute_reals
    generic :: attribute => attribute_text, attribute_integers, attribute_reals
    procedure :: last_integer, read_attribute
  end type h5_handle_t

  !> What HDF5 notes about one level of a failed call.
  type, bind(c) :: record_t
    integer(c_int64_t) :: class, major, minor
    integer(c_int) :: line
    type(c_ptr) :: function_name, file_name, description
  end type record_t

  interface
    !> The address of the number of the open file.
    integer(c_int) function h5fget_vfd_handle(file, access, handle) &
      bind(c, name='H5Fget_vfd_handle')
      import :: c_int, c_int64_t, c_ptr
      implicit none
      integer(c_int64_t), value :: file, access
      type(c_ptr), intent(out) :: handle
    end function h5fget_vfd_handle

    !> Walk the stack of errors; `upward` begins at the innermost.
    integer(c_int) function h5e_walk(stack, direction, visit, data) bind(c, name='H5Ewalk2')
      import :: c_int, c_int64_t, c_funptr, c_ptr
      implicit none
      integer(c_int64_t), value :: stack
      integer(c_int), value :: direction
      type(c_funptr), value :: visit
      type(c_ptr), value :: data
    end function h5e_walk
  end interface

contains

  !> Keep an error: `status` is what HDF5 returned when it was asked to do `what`.
  subroutine check(self, status, what)
    class(h5_handle_t), intent(inout) :: self
    integer, intent(in) :: status
    character(*), intent(in) :: what   !! like 'write /series/time'

    if (status >= 0 .or. self%info /= 0) return
    call self%fail('cannot '//what//': '//reason_of_error())
  end subroutine check

  !> The same for a reason of our own.
  subroutine fail(self, reason)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: reason

    self%info = 1
    self%broken = .true.
    self%message = self%path//': '//reason
    if (self%shared) call fatal(exit_files, self%message)
  end subroutine fail

  !> Create an empty file; one that exists is an error, whoever made it. One that all processes are
  !! to write together is created by the root process.
  subroutine file_create(self, path, shared)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: path
    logical, intent(in) :: shared   !! all processes call

    self%info = 0
    self%message = ''
    if (is_root() .or. .not. shared) call begin_file(self, path, .false., .true., new=.true.)
    if (.not. shared .or. nproc() == 1) return
    if (is_root()) call self%close()
    call broadcast(self%info)
    if (self%info /= 0) return
    call self%open(path, .true., .true.)
    self%complete = .false.
  end subroutine file_create

  !> Open a file that exists.
  subroutine file_open(self, path, shared, writing)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: path
    logical, intent(in) :: shared    !! all processes call, to write
    logical, intent(in) :: writing

    call begin_file(self, path, shared .and. nproc() > 1, writing, new=.false.)
  end subroutine file_open

  !> Start HDF5, make the lists that say how the file is accessed, and open or create it.
  subroutine begin_file(self, path, shared, writing, new)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: path
    logical, intent(in) :: shared, writing, new
    integer(hid_t) :: access
    integer :: status(6)

    self%path = path
    self%shared = shared
    self%writing = writing
    self%info = 0
    self%message = ''
    self%broken = .false.
    self%complete = .not. new
    self%id = -1
    access = -1
    status = 0
    call start_hdf5(status(1))
    call self%check(status(1), 'start HDF5')
    if (self%info /= 0) return
    call h5pcreate_f(H5P_FILE_ACCESS_F, access, status(1))
    call h5pset_fclose_degree_f(access, H5F_CLOSE_STRONG_F, status(2))
    call h5pset_cache_f(access, 0, 1_size_t, 0_size_t, 0.0, status(3))   ! rows go to the file
    call h5pcreate_f(H5P_DATASET_XFER_F, self%transfer, status(4))
    if (shared) call set_file_access(access, status(5))
    if (shared) call set_collective(self%transfer, status(6))
    call self%check(minval(status), 'set the access')
    if (self%info /= 0) return
    if (new) then
      call h5fcreate_f(path, H5F_ACC_EXCL_F, self%id, status(1), access_prp=access)
      call self%check(status(1), 'create the file')
    else if (is_pipe(path)) then
      call self%fail('cannot open the file: it is a pipe')
    else
      call h5fopen_f(path, merge(H5F_ACC_RDWR_F, H5F_ACC_RDONLY_F, writing), self%id, status(1), &
        access)
      call self%check(status(1), 'open the file')
    end if
    call h5pclose_f(access, status(1))
    if (writing) call hold_file(self)
  end subroutine begin_file

  !> Hold the file by the number under which HDF5 has it. MPI tells none: then the root process
  !! opens the path once more.
  subroutine hold_file(self)
    class(h5_handle_t), intent(inout) :: self
    character(:), allocatable :: message
    type(c_ptr) :: handle
    integer(c_int), pointer :: number

    if (self%info /= 0 .or. (self%shared .and. .not. is_root())) return
    if (self%shared) then
      call self%held%hold(self%path, message)
    else
      call self%check(h5fget_vfd_handle(self%id, H5P_DEFAULT_F, handle), 'open the file')
      if (self%info /= 0) return
      call c_f_pointer(handle, number)
      call self%held%hold(self%path, message, number)
    end if
    if (len(message) > 0) call self%fail(message)
  end subroutine hold_file

  !> Write everything out and close the file, its datasets with it; done even after an error. Once
  !! HDF5 has failed the file is left as it is on the disk, for to close it would write half of what
  !! is in memory; one that was created and never complete there is deleted.
  subroutine file_close(self, stored)
    class(h5_handle_t), intent(inout) :: self
    logical, intent(in), optional :: stored   !! wait until the disk has it
    character(:), allocatable :: message
    integer(hsize_t) :: used
    real(wp) :: here(1)
    integer :: status

    if (self%id < 0) return
    if (self%writing) call self%flush()
    if (self%writing .and. (self%broken .or. .not. self%complete)) then
      if (.not. self%complete) call self%held%discard()
      call self%held%let_go()
      self%id = -1
      return
    end if
    if (.not. self%shared) call h5fget_filesize_f(self%id, used, status)
    call h5pclose_f(self%transfer, status)
    call h5fclose_f(self%id, status)
    self%id = -1
    call self%check(status, 'close the file')
    here = 0.0_wp
    if (self%shared) call global_max(here)   ! what the others write is in the file only then
    if (self%writing .and. .not. self%shared) call self%held%shorten(int(used, i8))
    if (present(stored) .and. self%info == 0 .and. (is_root() .or. .not. self%shared)) then
      call self%held%store(message)
      if (len(message) > 0) call self%held%discard()
      if (len(message) > 0) call self%fail(message)
    end if
    call self%held%let_go()
  end subroutine file_close

  !> Hand everything written so far to the operating system.
  subroutine file_flush(self)
    class(h5_handle_t), intent(inout) :: self
    integer :: status

    if (self%info /= 0) return
    call h5fflush_f(self%id, H5F_SCOPE_LOCAL_F, status)
    call self%check(status, 'write')
    if (self%info == 0) self%complete = .true.
  end subroutine file_flush

  !> See to it that the next changes of a file that was just flushed find this much room at its end.
  !! Without room nothing more is written to it but by `last_integer`. Of a shared file HDF5 does
  !! not know the length in use; it cuts it to that when it flushes.
  subroutine reserve(self, bytes)
    class(h5_handle_t), intent(inout) :: self
    integer(i8), intent(in) :: bytes
    character(:), allocatable :: reason
    integer(hsize_t) :: used
    integer :: status

    if (self%info /= 0) return
    reason = ''
    if (is_root() .or. .not. self%shared) then
      used = int(self%held%length(), hsize_t)
      if (.not. self%shared) call h5fget_filesize_f(self%id, used, status)
      call self%held%lengthen(int(used, i8) + bytes, reason)
    end if
    if (self%shared) call broadcast(reason)
    if (len(reason) == 0) return
    self%info = 1
    self%message = self%path//': '//reason
  end subroutine reserve

  !> Create a group; the group around it must exist.
  subroutine group(self, name)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: name   !! full path in the file
    integer(hid_t) :: id
    integer :: status

    if (self%info /= 0) return
    call h5gcreate_f(self%id, name, id, status)
    call self%check(status, 'create '//name)
    if (self%info == 0) call h5gclose_f(id, status)
  end subroutine group

  !> Is there an object of this name? The group around it must exist.
  function has(self, name) result(yes)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: name
    logical :: yes
    integer :: status

    yes = .false.
    if (self%info /= 0) return
    call h5lexists_f(self%id, name, yes, status)
    call self%check(status, 'look for '//name)
  end function has

  !> Remove a dataset, or a group with all it holds.
  subroutine remove(self, name)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer :: status

    if (self%info /= 0) return
    call h5ldelete_f(self%id, name, status)
    call self%check(status, 'remove '//name)
  end subroutine remove

  !> A text as an attribute of any length, which h5py shows as str, or of a fixed one in ASCII, the
  !! form that VTK asks for. Any attribute that exists is replaced.
  subroutine attribute_text(self, object, name, value, fixed)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: object, name, value
    logical, intent(in), optional :: fixed   !! its length; else any
    character(kind=c_char), target :: letters(len(value) + 1)
    type(c_ptr), target :: start
    integer(hid_t) :: text_type
    integer :: status

    if (self%info /= 0) return
    letters = transfer(value//c_null_char, letters)
    start = c_loc(letters)
    if (present(fixed)) then
      call h5tcopy_f(H5T_FORTRAN_S1, text_type, status)
      call h5tset_size_f(text_type, int(len(value), size_t), status)
      call put_attribute(self, object, name, text_type, [1_hsize_t], start)
    else
      call h5tcopy_f(H5T_STRING, text_type, status)
      call h5tset_cset_f(text_type, H5T_CSET_UTF8_F, status)
      call put_attribute(self, object, name, text_type, [1_hsize_t], c_loc(start))
    end if
    call h5tclose_f(text_type, status)
  end subroutine attribute_text

  subroutine attribute_integers(self, object, name, value)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    integer, intent(in) :: value(:)
    integer(i8), target :: wide(size(value))

    wide = int(value, i8)
    call put_attribute(self, object, name, h5kind_to_type(i8, H5_INTEGER_KIND), &
                       shape(value, kind=hsize_t), c_loc(wide))
  end subroutine attribute_integers

  !> Reals of any shape; h5py shows its reverse.
  subroutine attribute_reals(self, object, name, value, extent)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    real(wp), intent(in), target, contiguous :: value(:)
    integer, intent(in), optional :: extent(:)   !! else they are a row

    if (present(extent)) then
      call put_attribute(self, object, name, H5T_NATIVE_DOUBLE, int(extent, hsize_t), c_loc(value))
    else
      call put_attribute(self, object, name, H5T_NATIVE_DOUBLE, shape(value, kind=hsize_t), &
                         c_loc(value))
    end if
  end subroutine attribute_reals

  !> Create the attribute, a single value if it has one element, or overwrite the one that is there,
  !! which must have the same type and shape.
  subroutine put_attribute(self, object, name, type, extent, data)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    integer(hid_t), intent(in) :: type
    integer(hsize_t), intent(in) :: extent(:)
    type(c_ptr), intent(in) :: data
    character(:), allocatable :: what
    integer(hid_t) :: owner, space, id
    integer :: status
    logical :: exists

    if (self%info /= 0) return
    what = 'write '//object//'@'//name
    call h5oopen_f(self%id, object, owner, status)
    call self%check(status, what)
    if (self%info /= 0) return
    call h5aexists_f(owner, name, exists, status)
    call self%check(status, what)
    if (exists) then
      call h5aopen_f(owner, name, id, status)
    else
      if (product(extent) == 1) call h5screate_f(H5S_SCALAR_F, space, status)
      if (product(extent) /= 1) call h5screate_simple_f(size(extent), extent, space, status)
      call h5acreate_f(owner, name, type, space, id, status)
    end if
    call self%check(status, what)
    if (.not. exists) call h5sclose_f(space, status)
    if (self%info /= 0) return
    call h5awrite_f(id, type, data, status)
    call self%check(status, what)
    call h5aclose_f(id, status)
    call h5oclose_f(owner, status)
  end subroutine put_attribute

  !> Overwrite an attribute that is there, also when there is no room for anything else.
  subroutine last_integer(self, object, name, value)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    integer, intent(in) :: value
    integer :: before

    if (self%broken .or. self%id < 0) return
    before = self%info
    self%info = 0
    call self%attribute(object, name, [value])
    call self%flush()
    if (before /= 0) self%info = before
  end subroutine last_integer

  !> Read an attribute that `attribute` wrote, a text or a single integer.
  subroutine read_attribute(self, object, name, text, number)
    class(h5_handle_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    character(:), allocatable, intent(out), optional :: text
    integer, intent(out), optional :: number
    type(c_ptr), target :: start
    integer(i8), target :: wide
    type(c_ptr) :: data
    integer(hid_t) :: id, there, here   ! types of the attribute, in memory
    integer :: status

    if (present(text)) text = ''
    if (present(number)) number = 0
    if (self%info /= 0) return
    call h5aopen_by_name_f(self%id, object, name, id, status)
    call self%check(status, 'read '//object//'@'//name)
    if (self%info /= 0) return
    call h5aget_type_f(id, there, status)
    here = there
    data = c_loc(start)
    if (present(number)) then
      here = h5kind_to_type(i8, H5_INTEGER_KIND)
      data = c_loc(wide)
    end if
    call h5aread_f(id, here, data, status)
    call self%check(status, 'read '//object//'@'//name)
    if (self%info == 0 .and. present(text)) text = text_at(start)
    if (self%info == 0 .and. present(number)) number = int(wide)
    call h5tclose_f(there, status)
    call h5aclose_f(id, status)
  end subroutine read_attribute

  !> Start HDF5: without file locks, so that a run can be read while it goes on, unless the user has
  !! set `HDF5_USE_FILE_LOCKING`; without its own messages; without a routine at exit, because we
  !! close our files ourselves. Further calls do nothing: HDF5 would keep some 30 kB for each.
  subroutine start_hdf5(status)
    integer, intent(out) :: status   !! < 0: failed
    integer :: ignored

    status = 0
    if (started) return
    status = -1
    if (c_setenv('HDF5_USE_FILE_LOCKING'//c_null_char, 'FALSE'//c_null_char, 0_c_int) /= 0) return
    call h5dont_atexit_f(ignored)   ! fails when HDF5 is already there
    call h5open_f(status)
    if (status >= 0) call h5eset_auto_f(0, status)
    started = status >= 0
  end subroutine start_hdf5

  !> Why the last call of HDF5 failed: the system's words if it was the system, else those of HDF5.
  function reason_of_error() result(reason)
    character(:), allocatable :: reason
    character(longest_reason), target :: found
    character(*), parameter :: mark = "error message = '"
    integer(c_int) :: status
    integer :: first

    found = ''
    status = h5e_walk(0_c_int64_t, 0_c_int, c_funloc(keep_innermost), c_loc(found))
    reason = trim(found)
    if (status /= 0 .or. len(reason) == 0) reason = 'unknown reason'
    first = index(reason, mark)
    if (first == 0) return
    reason = reason(first + len(mark):)
    reason = reason(:index(reason//"'", "'") - 1)
  end function reason_of_error

  !> Copy the description of level 0, the innermost, into the text that `data` points to.
  function keep_innermost(level, record, data) result(status) bind(c)
    integer(c_int), value :: level
    type(record_t), intent(in) :: record
    type(c_ptr), value :: data
    integer(c_int) :: status
    character(longest_reason), pointer :: found

    status = 0
    if (level /= 0 .or. .not. c_associated(record%description)) return
    call c_f_pointer(data, found)
    found = text_at(record%description)
  end function keep_innermost

end module hdf5_handle_m
