!> A thin layer over the HDF5 Fortran interface: groups, attributes, whole datasets, growing
!! columns.
!!
!! Every status of HDF5 is looked at. The first trouble sets `info` and a `message` that names the
!! file, the dataset and the reason; from then on every procedure of that file returns at once, so a
!! caller may write a whole group of things and look at `info` once, before anything that waits for
!! others.
!!
!! A `shared` file is opened by all processes together: every procedure is then called by all of
!! them, and blocks of cells are written collectively. Any other file belongs to the process that
!! opens it.
!!
!! The files keep the oldest format and no locks, and columns without compression never move a chunk
!! once it is there: a file that was flushed opens again whatever happens to the program. Whoever
!! changes such a file asks for the room of it first (`make_room`). A file is left as it is on the
!! disk, without the changes that HDF5 still keeps in memory, once HDF5 has failed to write to it.
module hdf5_file_m
  use, intrinsic :: iso_c_binding, only: c_ptr, c_loc, c_char, c_null_char
  use hdf5, only: hid_t, hsize_t, size_t
  use hdf5, only: h5aclose_f, h5acreate_f, h5aexists_f, h5aget_type_f, h5aopen_by_name_f
  use hdf5, only: h5aopen_f, h5aread_f, h5awrite_f, h5dclose_f, h5dcreate_f, h5dget_space_f
  use hdf5, only: h5dopen_f, h5dread_f, h5dset_extent_f, h5dwrite_f, h5fclose_f, h5fcreate_f
  use hdf5, only: h5dget_create_plist_f, h5pget_chunk_f, h5pget_nfilters_f
  use hdf5, only: h5fflush_f, h5fget_filesize_f, h5fopen_f, h5gclose_f, h5gcreate_f
  use hdf5, only: h5ldelete_f, h5lexists_f
  use hdf5, only: h5oclose_f, h5oopen_f, h5pclose_f, h5pcreate_f, h5pset_cache_f, h5pset_chunk_f
  use hdf5, only: h5pset_alloc_time_f, h5pset_deflate_f, h5pset_fclose_degree_f, h5pset_fill_time_f
  use hdf5, only: h5pset_fill_value_f, h5pset_shuffle_f, h5sclose_f, h5screate_f
  use hdf5, only: h5screate_simple_f, h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f
  use hdf5, only: h5sselect_hyperslab_f, h5tclose_f, h5tcopy_f, h5tset_cset_f, h5tset_size_f
  use hdf5, only: h5tset_strpad_f
  use hdf5, only: H5_INTEGER_KIND, H5_REAL_KIND, H5D_ALLOC_TIME_EARLY_F, H5D_FILL_TIME_ALLOC_F
  use hdf5, only: H5F_ACC_RDONLY_F, H5F_ACC_RDWR_F, H5F_ACC_TRUNC_F, H5F_CLOSE_STRONG_F
  use hdf5, only: H5F_SCOPE_LOCAL_F
  use hdf5, only: h5kind_to_type, H5P_DATASET_CREATE_F, H5P_DATASET_XFER_F, H5P_DEFAULT_F
  use hdf5, only: H5P_FILE_ACCESS_F, H5S_SCALAR_F, H5S_SELECT_SET_F, H5S_UNLIMITED_F, H5T_C_S1
  use hdf5, only: H5T_CSET_UTF8_F, H5T_FORTRAN_S1, H5T_IEEE_F32LE, H5T_IEEE_F64LE
  use hdf5, only: H5T_NATIVE_DOUBLE, H5T_NATIVE_REAL, H5T_STD_I32LE, H5T_STD_I64LE
  use hdf5, only: H5T_STR_NULLPAD_F, H5T_STRING
  use kinds_m, only: wp, sp, i8
  use errors_m, only: fatal, exit_files
  use parallel_m, only: is_root, my_rank, set_file_access, set_collective, global_max, global_min
  use parallel_m, only: broadcast, share_trouble
  use hdf5_reason_m, only: hdf5_start, hdf5_reason
  use plain_file_m, only: cut_file, delete_file
  use file_room_m, only: lengthen_file, shorten_file, room_for_chunks
  implicit none
  private
  public :: h5_file_t, h5_column_t
  public :: file_real64, file_real32, file_integer32, file_integer64

  integer, parameter :: file_real64 = 1, file_real32 = 2, file_integer32 = 3, file_integer64 = 4
  integer, parameter :: max_rank = 5
  integer, parameter :: deflate_level = 1   !! higher levels cost time and gain little on fields

  !> A dataset that grows by rows; its last index (first for h5py) is the row.
  type :: h5_column_t
    character(:), allocatable :: name
    integer(hid_t) :: id = -1
    integer :: rank = 0                            !! with the row index
    integer(hsize_t) :: extent(max_rank) = 1       !! of a row; extent(rank) is the number of rows
    integer(hsize_t) :: chunk(max_rank) = 1        !! shape of the pieces that are stored
    integer :: kind = 0
    logical :: compressed = .false.
  contains
    procedure :: room_for
  end type h5_column_t

  type :: h5_file_t
    character(:), allocatable :: path
    logical :: shared = .false.
    integer :: info = 0                    !! 0: no trouble so far
    character(:), allocatable :: message   !! file, dataset and reason of the first trouble
    logical, private :: writing = .false.
    logical, private :: complete = .false.   !! it was whole on the disk at least once
    logical, private :: broken = .false.     !! HDF5 failed: what it has in memory is not to be used
    integer(hid_t), private :: id = -1
    integer(hid_t), private :: collective = -1   !! transfer list of blocks of cells
  contains
    procedure :: create => file_create
    procedure :: open => file_open
    procedure :: close => file_close
    procedure :: flush => file_flush
    procedure :: make_room, last_integer
    procedure :: group => file_group
    procedure :: has => file_has
    procedure :: shape_of
    procedure :: remove => file_remove
    procedure, private :: attribute_text, attribute_integer, attribute_integers, attribute_real
    procedure, private :: attribute_reals, attribute_matrix
    generic :: attribute => attribute_text, attribute_integer, attribute_integers, attribute_real, &
      attribute_reals, attribute_matrix
    procedure :: fixed_text_attribute
    procedure, private :: read_text_attribute, read_integer_attribute
    generic :: read_attribute => read_text_attribute, read_integer_attribute
    procedure, private :: store_reals, store_matrix, store_integers, store_table, store_texts
    generic :: store => store_reals, store_matrix, store_integers, store_table, store_texts
    procedure :: store_shaped_reals, store_shaped_integers
    procedure :: store_wide_integers
    procedure, private :: rewrite_reals
    generic :: rewrite => rewrite_reals
    procedure, private :: read_reals, read_integers
    generic :: read => read_reals, read_integers
    procedure :: new_blocks, write_block, read_block
    procedure :: new_column, open_column, resize, append, append_rows, append_integers, append_wide
    procedure :: append_block, read_row, count_rows
    procedure, private :: check, agree, write_attribute, new_dataset, select, transfer_rows
  end type h5_file_t

contains

  !> Note trouble: `status` is what HDF5 returned when it was asked to do `what`.
  subroutine check(self, status, what)
    class(h5_file_t), intent(inout) :: self
    integer, intent(in) :: status
    character(*), intent(in) :: what   !! like 'write /series/time'

    if (status >= 0 .or. self%info /= 0) return
    self%info = 1
    self%broken = .true.
    self%message = self%path//': cannot '//what//': '//hdf5_reason()
  end subroutine check

  !> Trouble of one process of a shared file becomes that of all.
  !!
  !! A process in trouble may find that the others wait for it inside MPI (seen with a full disk):
  !! then nothing is left but to end them all, though this is a lower procedure.
  subroutine agree(self)
    class(h5_file_t), intent(inout) :: self
    real(wp), parameter :: patience = 3.0_wp   ! [s]
    logical :: trouble, answered

    if (.not. self%shared) return
    if (self%info /= 0 .and. .not. self%broken) return   ! all have been told why
    trouble = self%info /= 0
    call share_trouble(patience, trouble, answered)
    if (.not. answered) then
      call leave(self)
      call fatal(exit_files, self%message)
    end if
    if (trouble) call share_message(self)
  end subroutine agree

  !> Give all processes the message of the first one in trouble.
  subroutine share_message(self)
    class(h5_file_t), intent(inout) :: self
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

  !> Create an empty file; one that exists is overwritten.
  subroutine file_create(self, path, shared)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: path
    logical, intent(in) :: shared   !! all processes call
    integer(hid_t) :: access
    integer :: status

    call begin_file(self, path, shared, access)
    self%writing = .true.
    if (self%info /= 0) return
    call h5fcreate_f(path, H5F_ACC_TRUNC_F, self%id, status, access_prp=access)
    call self%check(status, 'create the file')
    call h5pclose_f(access, status)
    call self%agree()
  end subroutine file_create

  !> Open a file that exists.
  subroutine file_open(self, path, shared, writing)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: path
    logical, intent(in) :: shared    !! all processes call
    logical, intent(in) :: writing
    integer(hid_t) :: access
    integer :: status

    call begin_file(self, path, shared, access)
    self%writing = writing
    self%complete = .true.
    if (self%info /= 0) return
    call h5fopen_f(path, merge(H5F_ACC_RDWR_F, H5F_ACC_RDONLY_F, writing), self%id, status, access)
    call self%check(status, 'open the file')
    call h5pclose_f(access, status)
    call self%agree()
  end subroutine file_open

  !> Start HDF5 and make the lists that say how the file is accessed.
  subroutine begin_file(self, path, shared, access)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: path
    logical, intent(in) :: shared
    integer(hid_t), intent(out) :: access
    integer :: status

    self%path = path
    self%shared = shared
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
    if (.not. shared) return
    call set_file_access(access, status)
    call self%check(status, 'set the access')
    call set_collective(self%collective, status)
    call self%check(status, 'set the access')
  end subroutine begin_file

  !> Write everything out and close the file, its datasets with it; done even after trouble.
  subroutine file_close(self)
    class(h5_file_t), intent(inout) :: self
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
      if (self%writing .and. .not. self%shared) call shorten_file(self%path, used)
    end if
    self%id = -1
    call self%agree()
  end subroutine file_close

  !> Bytes of a file that are in use. Of a shared file HDF5 does not tell; it cuts it to that length
  !! when it flushes.
  function length_of(self) result(bytes)
    class(h5_file_t), intent(inout) :: self
    integer(i8) :: bytes
    integer(hsize_t) :: used
    integer :: status

    if (self%shared) then
      inquire (file=self%path, size=bytes)
    else
      call h5fget_filesize_f(self%id, used, status)
      call self%check(status, 'tell the size of the file')
      bytes = int(used, i8)
    end if
  end function length_of

  !> Leave a file that could not be written: to close it would write half of what is in memory.
  !! One that was never complete is deleted; it gives its room back at once.
  subroutine leave(self)
    class(h5_file_t), intent(in) :: self

    if (self%complete) return
    call cut_file(self%path, 0_i8)
    call delete_file(self%path)
  end subroutine leave

  !> Hand everything written so far to the operating system.
  subroutine file_flush(self)
    class(h5_file_t), intent(inout) :: self
    integer :: status

    if (self%info /= 0) return
    call h5fflush_f(self%id, H5F_SCOPE_LOCAL_F, status)
    call self%check(status, 'write')
    call self%agree()
    if (self%info == 0) self%complete = .true.
  end subroutine file_flush

  !> See to it that the next changes of a file that was just flushed find this much room at its end.
  !! Without room nothing more is written to it but by `last_integer`.
  subroutine make_room(self, bytes)
    class(h5_file_t), intent(inout) :: self
    integer(i8), intent(in) :: bytes
    character(:), allocatable :: trouble

    if (self%info /= 0) return
    trouble = ''
    if (is_root() .or. .not. self%shared) call lengthen_file(self%path, length_of(self) + bytes, &
      trouble)
    if (self%shared) call broadcast(trouble)
    if (len(trouble) == 0) return
    self%info = 1
    self%message = trouble
  end subroutine make_room

  !> Overwrite an attribute that is there, also when there is no room for anything else.
  subroutine last_integer(self, object, name, value)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    integer, intent(in) :: value
    integer :: before

    if (self%broken .or. self%id < 0) return
    before = self%info
    self%info = 0
    call self%attribute(object, name, value)
    call self%flush()
    if (before /= 0) self%info = before
  end subroutine last_integer

  !> Create a group; the group around it must exist.
  subroutine file_group(self, name)
    class(h5_file_t), intent(inout) :: self
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
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    logical :: yes
    integer :: status

    yes = .false.
    if (self%info /= 0) return
    call h5lexists_f(self%id, name, yes, status)
    call self%check(status, 'look for '//name)
  end function file_has

  !> Extents of a dataset, x fastest (h5py shows them reversed).
  subroutine shape_of(self, name, found)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, allocatable, intent(out) :: found(:)
    integer(hsize_t) :: extent(max_rank)
    integer(hid_t) :: id
    integer :: status, rank

    allocate (found(0))
    if (self%info /= 0) return
    call h5dopen_f(self%id, name, id, status)
    call self%check(status, 'open '//name)
    call get_extent(self, name, id, rank, extent)
    if (self%info /= 0) return
    found = int(min(extent(:rank), int(huge(rank), hsize_t)))
    call h5dclose_f(id, status)
  end subroutine shape_of

  !> Remove a dataset, or a group with all it holds.
  subroutine file_remove(self, name)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer :: status

    if (self%info /= 0) return
    call h5ldelete_f(self%id, name, status)
    call self%check(status, 'remove '//name)
  end subroutine file_remove

  !> A text of any length as an attribute; h5py shows it as str. An attribute that exists is
  !! replaced.
  subroutine attribute_text(self, object, name, value)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: object, name, value
    character(kind=c_char), target :: buffer(len(value) + 1)
    type(c_ptr), target :: start(1)
    integer :: i
    integer(hid_t) :: text_type
    integer :: status

    if (self%info /= 0) return
    do i = 1, len(value)
      buffer(i) = value(i:i)
    end do
    buffer(len(value) + 1) = c_null_char
    start(1) = c_loc(buffer)
    call h5tcopy_f(H5T_STRING, text_type, status)
    call self%check(status, 'make a text type')
    call h5tset_cset_f(text_type, H5T_CSET_UTF8_F, status)
    call self%check(status, 'make a text type')
    call self%write_attribute(object, name, text_type, text_type, [integer(hsize_t) ::], &
      c_loc(start))
    call h5tclose_f(text_type, status)
  end subroutine attribute_text

  !> A text as an attribute of fixed length in ASCII, the form that VTK asks for.
  subroutine fixed_text_attribute(self, object, name, value)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    character(*), intent(in), target :: value
    integer(hid_t) :: text_type
    integer :: status

    if (self%info /= 0) return
    call h5tcopy_f(H5T_FORTRAN_S1, text_type, status)
    call self%check(status, 'make a text type')
    call h5tset_size_f(text_type, int(len(value), size_t), status)
    call self%check(status, 'make a text type')
    call self%write_attribute(object, name, text_type, text_type, [integer(hsize_t) ::], &
                              c_loc(value))
    call h5tclose_f(text_type, status)
  end subroutine fixed_text_attribute

  subroutine attribute_integer(self, object, name, value)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    integer, intent(in) :: value
    integer(i8), target :: wide

    if (self%info /= 0) return
    wide = int(value, i8)
    call self%write_attribute(object, name, H5T_STD_I64LE, memory_type(file_integer64), &
                              [integer(hsize_t) ::], c_loc(wide))
  end subroutine attribute_integer

  subroutine attribute_integers(self, object, name, value)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    integer, intent(in) :: value(:)
    integer(i8), target :: wide(size(value))

    if (self%info /= 0) return
    wide = int(value, i8)
    call self%write_attribute(object, name, H5T_STD_I64LE, memory_type(file_integer64), &
                              [size(value, kind=hsize_t)], c_loc(wide))
  end subroutine attribute_integers

  subroutine attribute_real(self, object, name, value)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    real(wp), intent(in), target :: value

    if (self%info /= 0) return
    call self%write_attribute(object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &
                              [integer(hsize_t) ::], c_loc(value))
  end subroutine attribute_real

  subroutine attribute_reals(self, object, name, value)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    real(wp), intent(in), target, contiguous :: value(:)

    if (self%info /= 0) return
    call self%write_attribute(object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &
                              shape(value, kind=hsize_t), c_loc(value))
  end subroutine attribute_reals

  !> A matrix as an attribute; h5py shows its transpose.
  subroutine attribute_matrix(self, object, name, value)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    real(wp), intent(in), target, contiguous :: value(:, :)

    if (self%info /= 0) return
    call self%write_attribute(object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &
                              shape(value, kind=hsize_t), c_loc(value))
  end subroutine attribute_matrix

  !> Create the attribute, or overwrite the one that is there, which must have the same type and
  !! shape.
  subroutine write_attribute(self, object, name, file_type, mem_type, extent, data)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    integer(hid_t), intent(in) :: file_type, mem_type
    integer(hsize_t), intent(in) :: extent(:)   !! empty: a single value
    type(c_ptr), intent(in) :: data

    if (self%info == 0) call put_attribute(self, object, name, file_type, mem_type, extent, data)
    call self%agree()
  end subroutine write_attribute

  !> The work of `write_attribute` on one process.
  subroutine put_attribute(self, object, name, file_type, mem_type, extent, data)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    integer(hid_t), intent(in) :: file_type, mem_type
    integer(hsize_t), intent(in) :: extent(:)   !! empty: a single value
    type(c_ptr), intent(in) :: data
    character(:), allocatable :: what
    integer(hid_t) :: space, attribute, owner
    integer :: status
    logical :: exists

    what = 'write '//object//'@'//name
    call h5oopen_f(self%id, object, owner, status)
    call self%check(status, what)
    if (self%info /= 0) return
    call h5aexists_f(owner, name, exists, status)
    call self%check(status, what)
    if (exists) then
      call h5aopen_f(owner, name, attribute, status)
    else
      if (size(extent) == 0) then
        call h5screate_f(H5S_SCALAR_F, space, status)
      else
        call h5screate_simple_f(size(extent), extent, space, status)
      end if
      call self%check(status, what)
      call h5acreate_f(owner, name, file_type, space, attribute, status)
      call self%check(status, what)
      call h5sclose_f(space, status)
    end if
    call self%check(status, what)
    call h5awrite_f(attribute, mem_type, data, status)
    call self%check(status, what)
    call h5aclose_f(attribute, status)
    call h5oclose_f(owner, status)
  end subroutine put_attribute

  !> A text attribute that `attribute` wrote.
  subroutine read_text_attribute(self, object, name, value)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    character(:), allocatable, intent(out) :: value
    type(c_ptr), target :: start(1)
    type(c_ptr) :: data
    integer(hid_t) :: attribute, text_type
    integer :: status

    value = ''
    if (self%info /= 0) return
    call h5aopen_by_name_f(self%id, object, name, attribute, status)
    call self%check(status, 'read '//object//'@'//name)
    if (self%info /= 0) return
    call h5aget_type_f(attribute, text_type, status)
    call self%check(status, 'read '//object//'@'//name)
    data = c_loc(start)
    call h5aread_f(attribute, text_type, data, status)
    call self%check(status, 'read '//object//'@'//name)
    if (self%info == 0) value = text_at(start(1))
    call h5tclose_f(text_type, status)
    call h5aclose_f(attribute, status)
  end subroutine read_text_attribute

  !> The text that begins at a C address, up to its null character.
  function text_at(start) result(text)
    use, intrinsic :: iso_c_binding, only: c_f_pointer, c_size_t
    type(c_ptr), intent(in) :: start
    character(:), allocatable :: text
    character(kind=c_char), pointer :: letter(:)
    integer(c_size_t) :: n
    interface
      integer(c_size_t) function c_strlen(s) bind(c, name='strlen')
        import :: c_ptr, c_size_t
        implicit none
        type(c_ptr), value :: s
      end function c_strlen
    end interface

    n = c_strlen(start)
    allocate (character(n) :: text)
    call c_f_pointer(start, letter, [n])
    text = transfer(letter, text)
  end function text_at

  subroutine read_integer_attribute(self, object, name, value)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    integer, intent(out) :: value
    integer(i8), target :: wide
    type(c_ptr) :: data
    integer(hid_t) :: attribute
    integer :: status

    value = 0
    if (self%info /= 0) return
    wide = 0
    call h5aopen_by_name_f(self%id, object, name, attribute, status)
    call self%check(status, 'read '//object//'@'//name)
    if (self%info /= 0) return
    data = c_loc(wide)
    call h5aread_f(attribute, memory_type(file_integer64), data, status)
    call self%check(status, 'read '//object//'@'//name)
    call h5aclose_f(attribute, status)
    value = int(wide)
  end subroutine read_integer_attribute

  !> A whole dataset of reals with its unit; (n) for h5py.
  subroutine store_reals(self, name, units, a)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    real(wp), intent(in) :: a(:)

    call self%store_shaped_reals(name, units, shape(a), a)
  end subroutine store_reals

  !> A whole matrix of reals with its unit; h5py shows its transpose.
  subroutine store_matrix(self, name, units, a)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    real(wp), intent(in) :: a(:, :)

    call self%store_shaped_reals(name, units, shape(a), [a])
  end subroutine store_matrix

  subroutine store_integers(self, name, units, a)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: a(:)

    call self%store_shaped_integers(name, units, shape(a), a)
  end subroutine store_integers

  !> A whole table of integers with its unit; h5py shows its transpose.
  subroutine store_table(self, name, units, a)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: a(:, :)

    call self%store_shaped_integers(name, units, shape(a), [a])
  end subroutine store_table

  !> A dataset of reals of any shape, its elements given in a row.
  subroutine store_shaped_reals(self, name, units, extent, a)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: extent(:)
    real(wp), intent(in) :: a(:)
    real(wp), target :: copy(max(1, size(a)))
    integer(hid_t) :: id

    if (self%info /= 0) return
    copy(:size(a)) = a
    call self%new_dataset(name, units, type_in_file(file_real64), int(extent, hsize_t), &
                          H5P_DEFAULT_F, id)
    call write_whole(self, name, id, memory_type(file_real64), size(a), c_loc(copy))
  end subroutine store_shaped_reals

  !> A dataset of integers of any shape, its elements given in a row.
  subroutine store_shaped_integers(self, name, units, extent, a)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: extent(:)
    integer, intent(in) :: a(:)
    integer, target :: copy(max(1, size(a)))
    integer(hid_t) :: id

    if (self%info /= 0) return
    copy(:size(a)) = a
    call self%new_dataset(name, units, type_in_file(file_integer32), int(extent, hsize_t), &
                          H5P_DEFAULT_F, id)
    call write_whole(self, name, id, memory_type(file_integer32), size(a), c_loc(copy))
  end subroutine store_shaped_integers

  !> A dataset of 64-bit integers, the kind that VTK uses for numbers of points and cells.
  subroutine store_wide_integers(self, name, units, a)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: a(:)
    integer(i8), target :: copy(max(1, size(a)))
    integer(hid_t) :: id

    if (self%info /= 0) return
    copy(:size(a)) = int(a, i8)
    call self%new_dataset(name, units, type_in_file(file_integer64), &
                          [size(a, kind=hsize_t)], H5P_DEFAULT_F, id)
    call write_whole(self, name, id, memory_type(file_integer64), size(a), c_loc(copy))
  end subroutine store_wide_integers

  !> A dataset of texts, each as long as the longest of them.
  subroutine store_texts(self, name, units, a)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    character(*), intent(in) :: a(:)
    character(kind=c_char), target :: letters(max(1, size(a)*len(a)))
    integer(hid_t) :: id, text_type
    integer :: status, i, j, width

    if (self%info /= 0) return
    width = max(1, maxval([0, len_trim(a)]))
    do i = 1, size(a)
      do j = 1, width
        letters(j + (i - 1)*width) = merge(c_null_char, a(i)(j:j), j > len_trim(a(i)))
      end do
    end do
    call h5tcopy_f(H5T_C_S1, text_type, status)
    call self%check(status, 'make a text type')
    call h5tset_size_f(text_type, int(width, size_t), status)
    call self%check(status, 'make a text type')
    call h5tset_strpad_f(text_type, H5T_STR_NULLPAD_F, status)
    call self%check(status, 'make a text type')
    call self%new_dataset(name, units, text_type, [size(a, kind=hsize_t)], H5P_DEFAULT_F, id)
    call write_whole(self, name, id, text_type, size(a), c_loc(letters))
    call h5tclose_f(text_type, status)
  end subroutine store_texts

  !> Fill a new dataset and close it; of a shared file the root process fills it.
  subroutine write_whole(self, name, id, mem_type, n, data)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer(hid_t), intent(in) :: id, mem_type
    integer, intent(in) :: n            !! elements
    type(c_ptr), intent(in) :: data
    integer :: status

    if (self%info /= 0) return
    status = 0
    if (n > 0 .and. (is_root() .or. .not. self%shared)) call h5dwrite_f(id, mem_type, data, status)
    call self%check(status, 'write '//name)
    call h5dclose_f(id, status)
    call self%agree()
  end subroutine write_whole

  !> Overwrite a dataset that `store` made; the shape stays.
  subroutine rewrite_reals(self, name, a)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    real(wp), intent(in) :: a(:)
    real(wp), target :: copy(max(1, size(a)))
    integer(hid_t) :: id
    integer :: status

    if (self%info /= 0) return
    copy(:size(a)) = a
    call h5dopen_f(self%id, name, id, status)
    call self%check(status, 'open '//name)
    call write_whole(self, name, id, memory_type(file_real64), size(a), c_loc(copy))
  end subroutine rewrite_reals

  !> All elements of a dataset, in a row; their number must be right.
  subroutine read_reals(self, name, a)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    real(wp), intent(inout) :: a(:)
    real(wp), target :: copy(max(1, size(a)))
    type(c_ptr) :: data

    if (self%info /= 0) return
    data = c_loc(copy)
    call read_whole(self, name, size(a), memory_type(file_real64), data)
    if (self%info == 0) a = copy(:size(a))
  end subroutine read_reals

  subroutine read_integers(self, name, a)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(inout) :: a(:)
    integer, target :: copy(max(1, size(a)))
    type(c_ptr) :: data

    if (self%info /= 0) return
    data = c_loc(copy)
    call read_whole(self, name, size(a), memory_type(file_integer32), data)
    if (self%info == 0) a = copy(:size(a))
  end subroutine read_integers

  !> Read a whole dataset of n elements.
  subroutine read_whole(self, name, n, mem_type, data)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: n
    integer(hid_t), intent(in) :: mem_type
    type(c_ptr), intent(inout) :: data
    integer(hsize_t) :: extent(max_rank)
    integer(hid_t) :: id
    integer :: status, rank

    if (self%info /= 0) return
    call h5dopen_f(self%id, name, id, status)
    call self%check(status, 'open '//name)
    call get_extent(self, name, id, rank, extent)
    if (self%info /= 0) return
    if (product(extent(:rank)) /= int(n, hsize_t)) then
      self%info = 1
      self%message = self%path//': '//name//' has another size than this case needs'
    end if
    if (n > 0 .and. self%info == 0) call h5dread_f(id, mem_type, data, status)
    call self%check(status, 'read '//name)
    call h5dclose_f(id, status)
  end subroutine read_whole

  !> Create a dataset of doubles that all processes fill block by block; zero where none is written.
  subroutine new_blocks(self, name, units, extent)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: extent(:)
    integer(hid_t) :: id, list
    integer :: status

    if (self%info /= 0) return
    call h5pcreate_f(H5P_DATASET_CREATE_F, list, status)
    call self%check(status, 'create '//name)
    call h5pset_fill_time_f(list, H5D_FILL_TIME_ALLOC_F, status)
    call self%check(status, 'create '//name)
    call self%new_dataset(name, units, type_in_file(file_real64), int(extent, hsize_t), list, id)
    call h5pclose_f(list, status)
    if (self%info == 0) call h5dclose_f(id, status)
  end subroutine new_blocks

  !> Write the block `first : first + extent - 1` of a dataset of `new_blocks`; all processes
  !! together in a shared file.
  subroutine write_block(self, name, first, extent, a)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: first(:), extent(:)
    real(wp), intent(in), target, contiguous :: a(:)   !! the block's elements in a row
    integer(hid_t) :: id, there, here
    integer :: status

    if (self%info /= 0) return
    call h5dopen_f(self%id, name, id, status)
    call self%check(status, 'open '//name)
    call self%select(name, id, int(first - 1, hsize_t), int(extent, hsize_t), there, here)
    if (self%info == 0) then
      call h5dwrite_f(id, memory_type(file_real64), c_loc(a), status, here, there, &
                     self%collective)
      call self%check(status, 'write '//name)
      call close_selection(there, here)
      call h5dclose_f(id, status)
    end if
    call self%agree()
  end subroutine write_block

  !> Read the block `first : first + extent - 1` of a dataset of `new_blocks`.
  subroutine read_block(self, name, first, extent, a)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: first(:), extent(:)
    real(wp), intent(inout), target, contiguous :: a(:)
    integer(hid_t) :: id, there, here
    type(c_ptr) :: data
    integer :: status

    if (self%info /= 0) return
    call h5dopen_f(self%id, name, id, status)
    call self%check(status, 'open '//name)
    call self%select(name, id, int(first - 1, hsize_t), int(extent, hsize_t), there, here)
    if (self%info == 0) then
      data = c_loc(a)
      call h5dread_f(id, memory_type(file_real64), data, status, here, there, &
                     self%collective)
      call self%check(status, 'read '//name)
      call close_selection(there, here)
      call h5dclose_f(id, status)
    end if
    call self%agree()
  end subroutine read_block

  !> Create a column without rows. Rows are `row` in shape, for h5py (rows, reversed row).
  !!
  !! Not compressed: chunks of `chunk_rows` rows, written in place at once. Compressed:
  !! `row(size(row))` is cut into layers of `chunk_layers`, and a row must be written whole by
  !! `append_block`.
  subroutine new_column(self, name, units, kind, row, chunk_rows, column, chunk_layers)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: kind              !! file_real64, ...
    integer, intent(in) :: row(:)            !! shape of a row; empty: a number
    integer, intent(in) :: chunk_rows
    type(h5_column_t), intent(out) :: column
    integer, intent(in), optional :: chunk_layers   !! given: compress
    integer(hsize_t) :: chunk(size(row) + 1)
    integer(hid_t) :: list
    integer :: status

    if (self%info /= 0) return
    column%name = name
    column%kind = kind
    column%rank = size(row) + 1
    column%extent(:size(row)) = int(row, hsize_t)
    column%extent(column%rank) = 0
    column%compressed = present(chunk_layers)
    chunk(:size(row)) = int(max(1, row), hsize_t)
    chunk(column%rank) = int(chunk_rows, hsize_t)
    if (present(chunk_layers)) chunk(size(row)) = int(min(chunk_layers, row(size(row))), hsize_t)
    column%chunk(:column%rank) = chunk
    call h5pcreate_f(H5P_DATASET_CREATE_F, list, status)
    call self%check(status, 'create '//name)
    call h5pset_chunk_f(list, column%rank, chunk, status)
    call self%check(status, 'create '//name)
    if (column%compressed) then
      call h5pset_shuffle_f(list, status)
      call self%check(status, 'create '//name)
      call h5pset_deflate_f(list, deflate_level, status)
      call self%check(status, 'create '//name)
      call h5pset_alloc_time_f(list, H5D_ALLOC_TIME_EARLY_F, status)   ! as many processes need it
      call self%check(status, 'create '//name)
    end if
    call set_fill(self, name, kind, list)
    call self%new_dataset(name, units, type_in_file(kind), column%extent(:column%rank), list, &
      column%id)
    call h5pclose_f(list, status)
  end subroutine new_column

  !> What a row that never arrived shows: NaN, or -1 for integers.
  subroutine set_fill(self, name, kind, list)
    use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: kind
    integer(hid_t), intent(in) :: list
    real(wp), target :: nothing
    real(sp), target :: nothing_single
    integer, target :: none
    type(c_ptr) :: value
    integer :: status

    nothing = ieee_value(nothing, ieee_quiet_nan)
    nothing_single = ieee_value(nothing_single, ieee_quiet_nan)
    none = -1
    select case (kind)
    case (file_real64); value = c_loc(nothing)
    case (file_real32); value = c_loc(nothing_single)
    case default; value = c_loc(none)
    end select
    call h5pset_fill_value_f(list, memory_type(merge(file_integer32, kind, &
      kind == file_integer64)), value, &
                             status)
    call self%check(status, 'create '//name)
  end subroutine set_fill

  !> Open a column of a file that exists.
  subroutine open_column(self, name, kind, column)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: kind
    type(h5_column_t), intent(out) :: column
    integer(hid_t) :: list
    integer :: status, filters

    if (self%info /= 0) return
    column%name = name
    column%kind = kind
    call h5dopen_f(self%id, name, column%id, status)
    call self%check(status, 'open '//name)
    if (self%info /= 0) return
    call get_extent(self, name, column%id, column%rank, column%extent)
    call h5dget_create_plist_f(column%id, list, status)
    call self%check(status, 'open '//name)
    if (self%info /= 0) return
    call h5pget_chunk_f(list, column%rank, column%chunk(:column%rank), status)
    call self%check(status, 'open '//name)
    call h5pget_nfilters_f(list, filters, status)
    call self%check(status, 'open '//name)
    column%compressed = filters > 0
    call h5pclose_f(list, status)
  end subroutine open_column

  !> Most that `n` more rows take at the end of the file [bytes].
  pure function room_for(column, n) result(bytes)
    class(h5_column_t), intent(in) :: column
    integer, intent(in) :: n   !! rows
    integer(i8) :: bytes
    integer(i8) :: layers, before, after

    bytes = 0
    if (column%rank == 0) return   ! of a file in trouble
    associate (r => column%rank, extent => int(column%extent, i8), chunk => int(column%chunk, i8))
      layers = product((extent(:r - 1) + chunk(:r - 1) - 1)/chunk(:r - 1))
      before = layers*((extent(r) + chunk(r) - 1)/chunk(r))
      after = layers*((extent(r) + n + chunk(r) - 1)/chunk(r))
      bytes = room_for_chunks(product(chunk(:r))*bytes_of(column%kind), column%compressed, before, &
        after - before, r)
    end associate
  end function room_for

  pure integer function bytes_of(kind)
    integer, intent(in) :: kind   !! file_real64, ...

    bytes_of = merge(8, 4, kind == file_real64 .or. kind == file_integer64)
  end function bytes_of

  !> Shape of a dataset.
  subroutine get_extent(self, name, id, rank, extent)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer(hid_t), intent(in) :: id
    integer, intent(out) :: rank
    integer(hsize_t), intent(out) :: extent(max_rank)
    integer(hsize_t) :: largest(max_rank)
    integer(hid_t) :: space
    integer :: status

    rank = 0
    extent = 1
    if (self%info /= 0) return
    call h5dget_space_f(id, space, status)
    call self%check(status, 'open '//name)
    call h5sget_simple_extent_ndims_f(space, rank, status)
    call self%check(status, 'open '//name)
    if (rank > max_rank) call self%check(-1, 'open '//name)
    if (self%info /= 0) return
    call h5sget_simple_extent_dims_f(space, extent(:rank), largest(:rank), status)
    call self%check(status, 'open '//name)
    call h5sclose_f(space, status)
  end subroutine get_extent

  !> Give a column this many rows: later ones are dropped, missing ones have the fill value.
  subroutine resize(self, column, rows)
    class(h5_file_t), intent(inout) :: self
    type(h5_column_t), intent(inout) :: column
    integer(i8), intent(in) :: rows
    integer :: status

    if (self%info /= 0) return
    column%extent(column%rank) = int(rows, hsize_t)
    call h5dset_extent_f(column%id, column%extent(:column%rank), status)
    call self%check(status, 'write '//column%name)
    call self%agree()
  end subroutine resize

  !> Append a row of reals, its elements in a row; of a shared file the root process writes it.
  subroutine append(self, column, a)
    class(h5_file_t), intent(inout) :: self
    type(h5_column_t), intent(inout) :: column
    real(wp), intent(in) :: a(:)

    call self%append_rows(column, 1, a)
  end subroutine append

  !> Append several rows of reals, their elements in a row.
  subroutine append_rows(self, column, n, a)
    class(h5_file_t), intent(inout) :: self
    type(h5_column_t), intent(inout) :: column
    integer, intent(in) :: n      !! rows
    real(wp), intent(in) :: a(:)
    real(wp), target :: copy(max(1, size(a)))
    real(sp), target :: single(max(1, size(a)))

    if (self%info /= 0) return
    if (column%kind == file_real32) then
      single(:size(a)) = real(a, sp)
      call self%transfer_rows(column, memory_type(file_real32), n, size(a), c_loc(single))
    else
      copy(:size(a)) = a
      call self%transfer_rows(column, memory_type(file_real64), n, size(a), c_loc(copy))
    end if
  end subroutine append_rows

  !> Append a row of integers, or several, their elements in a row.
  subroutine append_integers(self, column, a, n)
    class(h5_file_t), intent(inout) :: self
    type(h5_column_t), intent(inout) :: column
    integer, intent(in) :: a(:)
    integer, intent(in), optional :: n   !! rows, else one
    integer, target :: copy(max(1, size(a)))
    integer :: rows

    if (self%info /= 0) return
    copy(:size(a)) = a
    rows = 1
    if (present(n)) rows = n
    call self%transfer_rows(column, memory_type(file_integer32), rows, size(a), c_loc(copy))
  end subroutine append_integers

  !> Append a row of integers of 64 bits.
  subroutine append_wide(self, column, a)
    class(h5_file_t), intent(inout) :: self
    type(h5_column_t), intent(inout) :: column
    integer(i8), intent(in) :: a(:)
    integer(i8), target :: copy(max(1, size(a)))

    if (self%info /= 0) return
    copy(:size(a)) = a
    call self%transfer_rows(column, memory_type(file_integer64), 1, size(a), c_loc(copy))
  end subroutine append_wide

  !> Make a column n rows longer and fill them from the root process.
  subroutine transfer_rows(self, column, mem_type, n, elements, data)
    class(h5_file_t), intent(inout) :: self
    type(h5_column_t), intent(inout) :: column
    integer(hid_t), intent(in) :: mem_type
    integer, intent(in) :: n, elements
    type(c_ptr), intent(in) :: data
    integer(hsize_t) :: first(max_rank), extent(max_rank)
    integer(hid_t) :: there, here
    integer :: status

    first = 0
    first(column%rank) = column%extent(column%rank)
    call self%resize(column, int(column%extent(column%rank), i8) + n)
    if (elements > 0 .and. (is_root() .or. .not. self%shared)) then
      extent = column%extent
      extent(column%rank) = int(n, hsize_t)
      call self%select(column%name, column%id, first(:column%rank), extent(:column%rank), there, &
        here)
      if (self%info == 0) then
        call h5dwrite_f(column%id, mem_type, data, status, here, there)
        call self%check(status, 'write '//column%name)
        call close_selection(there, here)
      end if
    end if
    call self%agree()
  end subroutine transfer_rows

  !> Append a row of 32-bit reals of which this process gives the block `first : first + extent -
  !! 1`; all processes together in a shared file. The kind in memory must be that of the file: HDF5
  !! does not convert what it compresses for several processes.
  subroutine append_block(self, column, first, extent, a)
    class(h5_file_t), intent(inout) :: self
    type(h5_column_t), intent(inout) :: column
    integer, intent(in) :: first(:), extent(:)
    real(sp), intent(in), target, contiguous :: a(:)   !! the block's elements in a row
    integer(hid_t) :: there, here
    integer :: status

    call self%resize(column, int(column%extent(column%rank), i8) + 1_i8)
    call self%select(column%name, column%id, &
                     [int(first - 1, hsize_t), column%extent(column%rank) - 1], &
                     [int(extent, hsize_t), 1_hsize_t], there, here)
    if (self%info == 0) then
      call h5dwrite_f(column%id, H5T_NATIVE_REAL, c_loc(a), status, here, there, self%collective)
      call self%check(status, 'write '//column%name)
      call close_selection(there, here)
    end if
    call self%agree()
  end subroutine append_block

  !> Row number `row` (from 1) of a column of reals.
  subroutine read_row(self, column, row, a)
    class(h5_file_t), intent(inout) :: self
    type(h5_column_t), intent(in) :: column
    integer, intent(in) :: row
    real(wp), intent(inout) :: a(:)
    real(wp), target :: copy(max(1, size(a)))
    integer(hsize_t) :: first(max_rank), extent(max_rank)
    integer(hid_t) :: there, here
    type(c_ptr) :: data
    integer :: status

    if (self%info /= 0 .or. size(a) == 0) return
    first = 0
    first(column%rank) = int(row - 1, hsize_t)
    extent = column%extent
    extent(column%rank) = 1
    call self%select(column%name, column%id, first(:column%rank), extent(:column%rank), there, here)
    if (self%info /= 0) return
    data = c_loc(copy)
    call h5dread_f(column%id, memory_type(file_real64), data, status, here, there)
    call self%check(status, 'read '//column%name)
    call close_selection(there, here)
    a = copy(:size(a))
  end subroutine read_row

  !> How many rows of a column of times a run keeps that goes on: those that it has counted, and one
  !! more if that one is of this very time.
  subroutine count_rows(self, column, counted, time, rows, up_to_date)
    class(h5_file_t), intent(inout) :: self
    type(h5_column_t), intent(in) :: column
    integer, intent(in) :: counted
    real(wp), intent(in) :: time        !! [s]
    integer, intent(out) :: rows
    logical, intent(out) :: up_to_date  !! the last row kept is of this very time
    real(wp) :: last(1)
    integer :: row

    rows = counted
    up_to_date = .false.
    if (self%info /= 0) return
    if (column%extent(column%rank) < int(counted, hsize_t)) then
      self%info = 1
      self%message = self%path//': has lost rows, the run cannot go on in it'
      return
    end if
    do row = max(1, counted), min(counted + 1, int(column%extent(column%rank)))
      call self%read_row(column, row, last)
      if (self%info /= 0 .or. abs(last(1) - time) > 0.0_wp) cycle
      rows = row
      up_to_date = .true.
    end do
  end subroutine count_rows

  !> Create a dataset of any type, with its unit; `list` of a growing one says how it is cut.
  subroutine new_dataset(self, name, units, file_type, extent, list, id)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer(hid_t), intent(in) :: file_type
    integer(hsize_t), intent(in) :: extent(:)
    integer(hid_t), intent(in) :: list     !! H5P_DEFAULT_F: the shape never changes
    integer(hid_t), intent(out) :: id
    integer(hsize_t) :: largest(size(extent))
    integer(hid_t) :: space
    integer :: status

    id = -1
    largest = extent
    if (list /= H5P_DEFAULT_F) then
      where (extent == 0) largest = H5S_UNLIMITED_F
    end if
    call h5screate_simple_f(size(extent), extent, space, status, largest)
    call self%check(status, 'create '//name)
    if (self%info == 0) then
      call h5dcreate_f(self%id, name, file_type, space, id, status, list)
      call self%check(status, 'create '//name)
      call h5sclose_f(space, status)
    end if
    call self%agree()
    call self%attribute(name, 'units', units)
  end subroutine new_dataset

  !> Select a block of a dataset and describe it in memory.
  subroutine select(self, name, id, first, extent, there, here)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer(hid_t), intent(in) :: id
    integer(hsize_t), intent(in) :: first(:)    !! from 0
    integer(hsize_t), intent(in) :: extent(:)
    integer(hid_t), intent(out) :: there, here  !! in the file, in memory
    integer :: status

    there = -1
    here = -1
    if (self%info /= 0) return
    call h5dget_space_f(id, there, status)
    call self%check(status, 'select a part of '//name)
    call h5sselect_hyperslab_f(there, H5S_SELECT_SET_F, first, extent, status)
    call self%check(status, 'select a part of '//name)
    call h5screate_simple_f(size(extent), extent, here, status)
    call self%check(status, 'select a part of '//name)
  end subroutine select

  subroutine close_selection(there, here)
    integer(hid_t), intent(in) :: there, here
    integer :: status

    call h5sclose_f(there, status)
    call h5sclose_f(here, status)
  end subroutine close_selection

  !> HDF5 type of a kind in the file.
  function type_in_file(kind) result(t)
    integer, intent(in) :: kind
    integer(hid_t) :: t

    select case (kind)
    case (file_real64); t = H5T_IEEE_F64LE
    case (file_real32); t = H5T_IEEE_F32LE
    case (file_integer32); t = H5T_STD_I32LE
    case (file_integer64); t = H5T_STD_I64LE
    case default; error stop 'hdf5_file_m: unknown kind'
    end select
  end function type_in_file

  !> HDF5 type of a kind in memory.
  function memory_type(element) result(t)
    integer, intent(in) :: element   !! file_real64, ...
    integer(hid_t) :: t

    select case (element)
    case (file_real64); t = h5kind_to_type(wp, H5_REAL_KIND)
    case (file_real32); t = h5kind_to_type(sp, H5_REAL_KIND)
    case (file_integer32); t = h5kind_to_type(kind(element), H5_INTEGER_KIND)
    case (file_integer64); t = h5kind_to_type(i8, H5_INTEGER_KIND)
    case default; error stop 'hdf5_file_m: unknown kind'
    end select
  end function memory_type

end module hdf5_file_m
