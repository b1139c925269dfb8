!> Datasets of an HDF5 file that have one shape for good: stored and read as a whole, or by blocks.
module hdf5_file_m
  use, intrinsic :: iso_c_binding, only: c_ptr, c_loc
  use hdf5, only: hid_t, hsize_t, size_t, h5kind_to_type, H5_INTEGER_KIND
  use hdf5, only: h5dclose_f, h5dcreate_f, h5dget_space_f, h5dget_type_f, h5dopen_f, h5dread_f
  use hdf5, only: h5dwrite_f, H5D_FILL_TIME_ALLOC_F, H5P_DATASET_CREATE_F, H5P_DEFAULT_F
  use hdf5, only: h5pclose_f, h5pcreate_f, h5pset_fill_time_f
  use hdf5, only: h5sclose_f, h5screate_simple_f, h5sget_simple_extent_dims_f
  use hdf5, only: h5sget_simple_extent_ndims_f, h5sselect_hyperslab_f
  use hdf5, only: H5S_SELECT_SET_F, H5S_UNLIMITED_F
  use hdf5, only: h5tclose_f, h5tcopy_f, h5tget_size_f, h5tset_size_f, h5tset_strpad_f
  use hdf5, only: H5T_C_S1, H5T_FORTRAN_S1, H5T_NATIVE_DOUBLE, H5T_NATIVE_INTEGER, &
    H5T_NATIVE_REAL, H5T_STR_NULLPAD_F
  use kinds_m, only: wp, i8, name_length
  use parallel_m, only: is_root
  use hdf5_handle_m, only: h5_handle_t
  implicit none
  private
  public :: h5_file_t, dataset_t, type_of

  integer, parameter :: max_rank = 5

  !> Numbers in a file; in memory all but the single ones are doubles, which hold any integer that a
  !! file gets.
  integer, parameter, public :: as_double = 1, as_single = 2
  integer, parameter, public :: as_integer = 3, as_wide = 4   !! of 32 bits; of 64, as VTK counts

  type :: dataset_t
    character(:), allocatable :: name, units
    integer(hid_t) :: type = -1, here = -1       !! of its elements in the file, in memory
    integer(hid_t) :: id = -1                    !! while it is open
    integer(hsize_t), allocatable :: extent(:)   !! x fastest; h5py shows the reverse
  end type dataset_t

  !> A file with its datasets.
  type, extends(h5_handle_t) :: h5_file_t
  contains
    procedure, private :: store_numbers, store_texts, read_reals, read_integers, read_texts
    generic :: store => store_numbers, store_texts
    generic :: read => read_reals, read_integers, read_texts
    procedure :: shape_of, write_block
    procedure :: begin_dataset, find, pass_part   ! for columns
  end type h5_file_t

contains

  !> A whole dataset of numbers with its unit; one that exists is overwritten. h5py shows the
  !! reverse of its shape.
  subroutine store_numbers(self, name, units, a, extent, kind)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    real(wp), intent(in), target, contiguous :: a(:)   !! its elements in a row
    integer, intent(in), optional :: extent(:)         !! its shape, else it is a row
    integer, intent(in), optional :: kind              !! in the file, else `as_double`
    type(dataset_t) :: dataset

    dataset = dataset_t(name, units, type_of(kind), H5T_NATIVE_DOUBLE, &
                        extent=shape(a, kind=hsize_t))
    if (present(extent)) dataset%extent = int(extent, hsize_t)
    call put(self, dataset, c_loc(a))
  end subroutine store_numbers

  !> The type in a file of a kind of numbers.
  integer(hid_t) function type_of(kind)
    integer, intent(in), optional :: kind

    type_of = H5T_NATIVE_DOUBLE
    if (.not. present(kind)) return
    if (kind == as_single) type_of = H5T_NATIVE_REAL
    if (kind == as_integer) type_of = H5T_NATIVE_INTEGER
    if (kind == as_wide) type_of = h5kind_to_type(i8, H5_INTEGER_KIND)
  end function type_of

  !> Texts, each as long as the longest of them.
  subroutine store_texts(self, name, units, a)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    character(*), intent(in), target, contiguous :: a(:)
    type(dataset_t) :: dataset
    integer :: status

    if (self%info /= 0) return
    dataset = dataset_t(name, units, here=type_of_texts(len(a)), extent=shape(a, kind=hsize_t))
    call h5tcopy_f(H5T_C_S1, dataset%type, status)
    call h5tset_size_f(dataset%type, int(maxval([1, len_trim(a)]), size_t), status)
    call h5tset_strpad_f(dataset%type, H5T_STR_NULLPAD_F, status)
    call put(self, dataset, c_loc(a))
    call h5tclose_f(dataset%type, status)
    call h5tclose_f(dataset%here, status)
  end subroutine store_texts

  !> Texts in memory, blanks at their end.
  function type_of_texts(length) result(type)
    integer, intent(in) :: length
    integer(hid_t) :: type
    integer :: status

    call h5tcopy_f(H5T_FORTRAN_S1, type, status)
    call h5tset_size_f(type, int(length, size_t), status)
  end function type_of_texts

  !> Write a whole dataset; of a shared file the root process fills it.
  subroutine put(self, dataset, data)
    class(h5_file_t), intent(inout) :: self
    type(dataset_t), intent(inout) :: dataset
    type(c_ptr), intent(in) :: data
    integer :: status

    call self%begin_dataset(dataset, H5P_DEFAULT_F)
    if (self%info /= 0) return
    if (product(dataset%extent) > 0 .and. (is_root() .or. .not. self%shared)) then
      call h5dwrite_f(dataset%id, dataset%here, data, status)
      call self%check(status, 'write '//dataset%name)
    end if
    call h5dclose_f(dataset%id, status)
  end subroutine put

  !> Open a dataset, or create it with its unit; `list` says how it is stored.
  subroutine begin_dataset(self, dataset, list)
    class(h5_file_t), intent(inout) :: self
    class(dataset_t), intent(inout) :: dataset
    integer(hid_t), intent(in) :: list
    integer(hsize_t) :: largest(size(dataset%extent))
    integer(hid_t) :: space
    integer :: status

    if (self%has(dataset%name)) then
      call h5dopen_f(self%id, dataset%name, dataset%id, status)
      call self%check(status, 'open '//dataset%name)
      return
    end if
    if (self%info /= 0) return
    largest = dataset%extent
    if (list /= H5P_DEFAULT_F) then   ! a column grows
      where (dataset%extent == 0) largest = H5S_UNLIMITED_F
    end if
    call h5screate_simple_f(size(largest), dataset%extent, space, status, largest)
    call h5dcreate_f(self%id, dataset%name, dataset%type, space, dataset%id, status, list)
    call self%check(status, 'create '//dataset%name)
    if (self%info == 0) call h5sclose_f(space, status)
    call self%attribute(dataset%name, 'units', dataset%units)
  end subroutine begin_dataset

  !> All elements of a dataset, in a row; their number must be right. Or those of its block
  !! `first : first + extent - 1`.
  subroutine read_reals(self, name, a, first, extent)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    real(wp), intent(inout), target, contiguous :: a(:)
    integer, intent(in), optional :: first(:), extent(:)

    call get(self, name, H5T_NATIVE_DOUBLE, size(a), c_loc(a), first, extent)
  end subroutine read_reals

  subroutine read_integers(self, name, a)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(inout), target, contiguous :: a(:)

    call get(self, name, H5T_NATIVE_INTEGER, size(a), c_loc(a))
  end subroutine read_integers

  !> All texts of a dataset, cut or filled to the length of `a`.
  subroutine read_texts(self, name, a)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    character(name_length), intent(inout), target, contiguous :: a(:)
    integer(hid_t) :: here
    integer :: status

    if (self%info /= 0) return
    here = type_of_texts(len(a))
    call get(self, name, here, size(a), c_loc(a))
    call h5tclose_f(here, status)
  end subroutine read_texts

  !> Read a whole dataset of n elements, or a block of it.
  subroutine get(self, name, here, n, data, first, extent)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer(hid_t), intent(in) :: here   !! type in memory
    integer, intent(in) :: n
    type(c_ptr), value :: data
    integer, intent(in), optional :: first(:), extent(:)   !! of the block
    type(dataset_t) :: dataset
    integer :: status

    dataset = dataset_t(name, here=here)
    call self%find(dataset)
    if (self%info /= 0) return
    if (present(first)) then
      call self%pass_part(dataset, int(first - 1, hsize_t), int(extent, hsize_t), data)
    else if (product(dataset%extent) /= int(n, hsize_t)) then
      call self%fail(name//' has another size than this case needs')
    else if (n > 0) then
      call h5dread_f(dataset%id, here, data, status)
      call self%check(status, 'read '//name)
    end if
    call h5dclose_f(dataset%id, status)
  end subroutine get

  !> Open a dataset. Elements larger than any number and than what is to be read are refused: in a
  !! damaged file they make the library read past its buffers.
  subroutine find(self, dataset)
    class(h5_file_t), intent(inout) :: self
    class(dataset_t), intent(inout) :: dataset   !! its name, and type in memory
    integer(size_t), parameter :: largest_number = 16   ! [B]
    integer(hsize_t) :: now(max_rank), largest(max_rank)
    integer(size_t) :: in_file, asked
    integer(hid_t) :: space, file_type
    integer :: status, rank

    dataset%extent = [integer(hsize_t) ::]
    if (self%info /= 0) return
    call h5dopen_f(self%id, dataset%name, dataset%id, status)
    call self%check(status, 'open '//dataset%name)
    if (self%info /= 0) return
    call h5dget_space_f(dataset%id, space, status)
    call h5sget_simple_extent_ndims_f(space, rank, status)
    call self%check(merge(status, -1, rank <= max_rank), 'open '//dataset%name)
    if (self%info /= 0) return
    call h5sget_simple_extent_dims_f(space, now(:rank), largest(:rank), status)
    call self%check(status, 'open '//dataset%name)
    dataset%extent = now(:rank)
    call h5sclose_f(space, status)
    call h5dget_type_f(dataset%id, file_type, status)
    call self%check(status, 'read '//dataset%name)
    if (self%info /= 0) return
    call h5tget_size_f(file_type, in_file, status)
    call h5tget_size_f(dataset%here, asked, status)
    call h5tclose_f(file_type, status)
    if (in_file <= max(asked, largest_number)) return
    call self%fail(dataset%name//' has elements of a size that no number has')
  end subroutine find

  !> Extents of a dataset, x fastest.
  subroutine shape_of(self, name, found)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, allocatable, intent(out) :: found(:)
    type(dataset_t) :: dataset
    integer :: status

    dataset = dataset_t(name, here=H5T_NATIVE_DOUBLE)
    call self%find(dataset)
    found = int(min(dataset%extent, int(huge(0), hsize_t)))
    if (self%info == 0) call h5dclose_f(dataset%id, status)
  end subroutine shape_of

  !> Write the block `first : first + extent - 1` of a dataset of doubles that all processes fill
  !! block by block; zero where none is written. All together in a shared file.
  subroutine write_block(self, name, units, whole, first, extent, a)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: whole(:)   !! extent of the dataset
    integer, intent(in) :: first(:), extent(:)
    real(wp), intent(in), target, contiguous :: a(:)   !! the block's elements in a row
    type(dataset_t) :: dataset
    integer(hid_t) :: list
    integer :: status

    if (self%info /= 0) return
    call h5pcreate_f(H5P_DATASET_CREATE_F, list, status)
    call h5pset_fill_time_f(list, H5D_FILL_TIME_ALLOC_F, status)
    dataset = dataset_t(name, units, H5T_NATIVE_DOUBLE, H5T_NATIVE_DOUBLE, &
                        extent=int(whole, hsize_t))
    call self%begin_dataset(dataset, list)
    call h5pclose_f(list, status)
    call self%pass_part(dataset, int(first - 1, hsize_t), int(extent, hsize_t), c_loc(a), &
                        self%transfer)
    if (self%info == 0) call h5dclose_f(dataset%id, status)
  end subroutine write_block

  !> Write or read a block of a dataset that is open.
  subroutine pass_part(self, dataset, first, extent, data, transfer)
    class(h5_file_t), intent(inout) :: self
    class(dataset_t), intent(in) :: dataset
    integer(hsize_t), intent(in) :: first(:)   !! from 0
    integer(hsize_t), intent(in) :: extent(:)
    type(c_ptr), value :: data
    integer(hid_t), intent(in), optional :: transfer
      !! write it, H5P_DEFAULT_F: this process alone; else read it
    integer(hid_t) :: there, here   ! in the file, in memory
    integer :: status

    if (self%info /= 0) return
    call h5dget_space_f(dataset%id, there, status)
    call h5sselect_hyperslab_f(there, H5S_SELECT_SET_F, first, extent, status)
    call self%check(status, 'select a part of '//dataset%name)
    call h5screate_simple_f(size(extent), extent, here, status)
    call self%check(status, 'select a part of '//dataset%name)
    if (self%info /= 0) return
    if (present(transfer)) then
      call h5dwrite_f(dataset%id, dataset%here, data, status, here, there, transfer)
      call self%check(status, 'write '//dataset%name)
    else
      call h5dread_f(dataset%id, dataset%here, data, status, here, there)
      call self%check(status, 'read '//dataset%name)
    end if
    call h5sclose_f(there, status)
    call h5sclose_f(here, status)
  end subroutine pass_part

end module hdf5_file_m
