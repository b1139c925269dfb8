!> Datasets of an HDF5 file that have one shape for good: stored and read as a whole, or by blocks.
module hdf5_datasets_m
  use, intrinsic :: iso_c_binding, only: c_ptr, c_loc, c_char, c_null_char
  use hdf5, only: hid_t, hsize_t, size_t, h5dclose_f, h5dcreate_f, h5dget_space_f, h5dopen_f
  use hdf5, only: h5dread_f, h5dwrite_f, h5pclose_f, h5pcreate_f, h5pset_fill_time_f, h5sclose_f
  use hdf5, only: h5screate_simple_f, h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f
  use hdf5, only: h5dget_type_f, h5sselect_hyperslab_f, h5tclose_f, h5tcopy_f, h5tget_size_f
  use hdf5, only: h5tset_size_f, h5tset_strpad_f
  use hdf5, only: H5D_FILL_TIME_ALLOC_F, H5P_DATASET_CREATE_F, H5P_DEFAULT_F, H5S_SELECT_SET_F
  use hdf5, only: H5S_UNLIMITED_F, H5T_C_S1, H5T_STR_NULLPAD_F
  use kinds_m, only: wp, i8, name_length
  use parallel_m, only: is_root
  use hdf5_kinds_m, only: file_real64, file_integer32, file_integer64, type_in_file, memory_type
  use hdf5_attributes_m, only: h5_attributes_t
  implicit none
  private
  public :: h5_datasets_t, max_rank, close_selection

  integer, parameter :: max_rank = 5

  !> A file, its attributes and its datasets.
  type, extends(h5_attributes_t) :: h5_datasets_t
  contains
    procedure, private :: store_reals, store_matrix, store_integers, store_table, store_texts
    generic :: store => store_reals, store_matrix, store_integers, store_table, store_texts
    procedure :: store_shaped_reals, store_shaped_integers
    procedure :: store_wide_integers
    procedure, private :: rewrite_reals, rewrite_integers
    generic :: rewrite => rewrite_reals, rewrite_integers
    procedure, private :: read_reals, read_integers, read_texts
    generic :: read => read_reals, read_integers, read_texts
    procedure :: new_blocks, write_block, read_block
    procedure :: shape_of, get_extent
    procedure :: new_dataset, select   ! for columns
  end type h5_datasets_t

contains

  !> A whole dataset of reals with its unit; (n) for h5py.
  subroutine store_reals(self, name, units, a)
    class(h5_datasets_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    real(wp), intent(in) :: a(:)

    call self%store_shaped_reals(name, units, shape(a), a)
  end subroutine store_reals

  !> A whole matrix of reals with its unit; h5py shows its transpose.
  subroutine store_matrix(self, name, units, a)
    class(h5_datasets_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    real(wp), intent(in) :: a(:, :)

    call self%store_shaped_reals(name, units, shape(a), [a])
  end subroutine store_matrix

  subroutine store_integers(self, name, units, a)
    class(h5_datasets_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: a(:)

    call self%store_shaped_integers(name, units, shape(a), a)
  end subroutine store_integers

  !> A whole table of integers with its unit; h5py shows its transpose.
  subroutine store_table(self, name, units, a)
    class(h5_datasets_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: a(:, :)

    call self%store_shaped_integers(name, units, shape(a), [a])
  end subroutine store_table

  !> A dataset of reals of any shape, its elements given in a row.
  subroutine store_shaped_reals(self, name, units, extent, a)
    class(h5_datasets_t), intent(inout) :: self
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
    class(h5_datasets_t), intent(inout) :: self
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
    class(h5_datasets_t), intent(inout) :: self
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
    class(h5_datasets_t), intent(inout) :: self
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
    class(h5_datasets_t), intent(inout) :: self
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
    class(h5_datasets_t), intent(inout) :: self
    character(*), intent(in) :: name
    real(wp), intent(in) :: a(:)
    real(wp), target :: copy(max(1, size(a)))

    copy(:size(a)) = a
    call rewrite_whole(self, name, memory_type(file_real64), size(a), c_loc(copy))
  end subroutine rewrite_reals

  subroutine rewrite_integers(self, name, a)
    class(h5_datasets_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: a(:)
    integer, target :: copy(max(1, size(a)))

    copy(:size(a)) = a
    call rewrite_whole(self, name, memory_type(file_integer32), size(a), c_loc(copy))
  end subroutine rewrite_integers

  subroutine rewrite_whole(self, name, mem_type, n, data)
    class(h5_datasets_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer(hid_t), intent(in) :: mem_type
    integer, intent(in) :: n            !! elements
    type(c_ptr), intent(in) :: data
    integer(hid_t) :: id
    integer :: status

    if (self%info /= 0) return
    call h5dopen_f(self%id, name, id, status)
    call self%check(status, 'open '//name)
    call write_whole(self, name, id, mem_type, n, data)
  end subroutine rewrite_whole

  !> All elements of a dataset, in a row; their number must be right.
  subroutine read_reals(self, name, a)
    class(h5_datasets_t), intent(inout) :: self
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
    class(h5_datasets_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(inout) :: a(:)
    integer, target :: copy(max(1, size(a)))
    type(c_ptr) :: data

    if (self%info /= 0) return
    data = c_loc(copy)
    call read_whole(self, name, size(a), memory_type(file_integer32), data)
    if (self%info == 0) a = copy(:size(a))
  end subroutine read_integers

  !> All texts of a dataset, cut or filled to the length of `a`.
  subroutine read_texts(self, name, a)
    class(h5_datasets_t), intent(inout) :: self
    character(*), intent(in) :: name
    character(name_length), intent(inout) :: a(:)
    character(kind=c_char), target :: letters(max(1, size(a)*len(a)))
    integer(hid_t) :: text_type
    type(c_ptr) :: data
    integer :: status, i, j

    if (self%info /= 0) return
    call h5tcopy_f(H5T_C_S1, text_type, status)
    call self%check(status, 'make a text type')
    call h5tset_size_f(text_type, int(len(a), size_t), status)
    call self%check(status, 'make a text type')
    call h5tset_strpad_f(text_type, H5T_STR_NULLPAD_F, status)
    call self%check(status, 'make a text type')
    data = c_loc(letters)
    call read_whole(self, name, size(a), text_type, data)
    call h5tclose_f(text_type, status)
    if (self%info /= 0) return
    a = ''
    do i = 1, size(a)
      do j = 1, len(a)
        if (letters(j + (i - 1)*len(a)) == c_null_char) exit
        a(i)(j:j) = letters(j + (i - 1)*len(a))
      end do
    end do
  end subroutine read_texts

  !> Read a whole dataset of n elements.
  subroutine read_whole(self, name, n, mem_type, data)
    class(h5_datasets_t), intent(inout) :: self
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
    call self%get_extent(name, id, rank, extent)
    if (self%info /= 0) return
    if (product(extent(:rank)) /= int(n, hsize_t)) then
      self%info = 1
      self%message = self%path//': '//name//' has another size than this case needs'
    end if
    call check_size(self, name, id, mem_type)
    if (n > 0 .and. self%info == 0) call h5dread_f(id, mem_type, data, status)
    call self%check(status, 'read '//name)
    call h5dclose_f(id, status)
  end subroutine read_whole

  !> Refuse elements larger than any number and than what is to be read: in a damaged file they make
  !! the library read past its buffers.
  subroutine check_size(self, name, id, mem_type)
    class(h5_datasets_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer(hid_t), intent(in) :: id, mem_type
    integer(size_t), parameter :: largest_number = 16   ! [B]
    integer(size_t) :: in_file, asked
    integer(hid_t) :: file_type
    integer :: status

    if (self%info /= 0) return
    call h5dget_type_f(id, file_type, status)
    call self%check(status, 'read '//name)
    if (self%info /= 0) return
    call h5tget_size_f(file_type, in_file, status)
    call h5tget_size_f(mem_type, asked, status)
    call h5tclose_f(file_type, status)
    if (in_file <= max(asked, largest_number)) return
    self%info = 1
    self%message = self%path//': '//name//' has elements of a size that no number has'
  end subroutine check_size

  !> Create a dataset of doubles that all processes fill block by block; zero where none is written.
  subroutine new_blocks(self, name, units, extent)
    class(h5_datasets_t), intent(inout) :: self
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
    class(h5_datasets_t), intent(inout) :: self
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
    class(h5_datasets_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: first(:), extent(:)
    real(wp), intent(inout), target, contiguous :: a(:)
    integer(hid_t) :: id, there, here
    type(c_ptr) :: data
    integer :: status

    if (self%info /= 0) return
    call h5dopen_f(self%id, name, id, status)
    call self%check(status, 'open '//name)
    call check_size(self, name, id, memory_type(file_real64))
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

  !> Extents of a dataset, x fastest (h5py shows them reversed).
  subroutine shape_of(self, name, found)
    class(h5_datasets_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, allocatable, intent(out) :: found(:)
    integer(hsize_t) :: extent(max_rank)
    integer(hid_t) :: id
    integer :: status, rank

    allocate (found(0))
    if (self%info /= 0) return
    call h5dopen_f(self%id, name, id, status)
    call self%check(status, 'open '//name)
    call self%get_extent(name, id, rank, extent)
    if (self%info /= 0) return
    found = int(min(extent(:rank), int(huge(rank), hsize_t)))
    call h5dclose_f(id, status)
  end subroutine shape_of

  !> Shape of a dataset.
  subroutine get_extent(self, name, id, rank, extent)
    class(h5_datasets_t), intent(inout) :: self
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

  !> Create a dataset of any type, with its unit; `list` of a growing one says how it is cut.
  subroutine new_dataset(self, name, units, file_type, extent, list, id)
    class(h5_datasets_t), intent(inout) :: self
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
    class(h5_datasets_t), intent(inout) :: self
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

end module hdf5_datasets_m
