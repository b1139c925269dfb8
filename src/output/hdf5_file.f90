!> The result file as its writers know it, and its columns, the datasets that grow by rows.
!!
!! `h5_file_t` has what is in `hdf5_handle_m` (the file; what happens on an error and who calls),
!! `hdf5_attributes_m` and `hdf5_datasets_m`; here come the columns.
module hdf5_file_m
  use, intrinsic :: iso_c_binding, only: c_ptr, c_loc
  use hdf5, only: hid_t, hsize_t, h5dopen_f, h5dread_f, h5dset_extent_f, h5dwrite_f
  use hdf5, only: h5dget_create_plist_f, h5pget_chunk_f, h5pget_nfilters_f, h5pclose_f
  use hdf5, only: h5pcreate_f, h5pset_chunk_f, h5pset_alloc_time_f, h5pset_deflate_f
  use hdf5, only: h5pset_fill_value_f, h5pset_fletcher32_f, h5pset_shuffle_f, H5D_ALLOC_TIME_EARLY_F
  use hdf5, only: H5P_DATASET_CREATE_F, H5T_NATIVE_REAL
  use kinds_m, only: wp, sp, i8
  use parallel_m, only: is_root
  use file_space_m, only: bytes_for_chunks
  use hdf5_kinds_m, only: file_real64, file_real32, file_integer32, file_integer64, bytes_of
  use hdf5_kinds_m, only: type_in_file, memory_type
  use hdf5_datasets_m, only: h5_datasets_t, max_rank, close_selection
  implicit none
  private
  public :: h5_file_t, h5_column_t
  public :: file_real64, file_real32, file_integer32, file_integer64

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
    procedure :: bytes_for
  end type h5_column_t

  !> A file with all that a writer or reader asks of it.
  type, extends(h5_datasets_t) :: h5_file_t
  contains
    procedure :: new_column, new_compressed_column, open_column, resize
    procedure :: append, append_rows, append_integers, append_wide, append_block
    procedure :: read_row, count_rows
    procedure, private :: transfer_rows
  end type h5_file_t

contains

  !> Create a column without rows, in chunks of `chunk_rows` rows that are written in place at once.
  !! Rows are `row` in shape, for h5py (rows, reversed row).
  subroutine new_column(self, name, units, kind, row, chunk_rows, column)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: kind         !! file_real64, ...
    integer, intent(in) :: row(:)       !! shape of a row; empty: a number
    integer, intent(in) :: chunk_rows
    type(h5_column_t), intent(out) :: column

    if (self%info /= 0) return
    column = empty_column(name, kind, row, chunk_rows)
    call create_column(self, units, column)
  end subroutine new_column

  !> Create a column that is compressed; a row must be written whole.
  subroutine new_compressed_column(self, name, units, kind, row, chunk, column)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: kind           !! file_real64, ...
    integer, intent(in) :: row(:)         !! shape of a row, not empty
    integer, intent(in) :: chunk(2)       !! of the `row(size(row))` layers of a row, rows
    type(h5_column_t), intent(out) :: column

    if (self%info /= 0) return
    column = empty_column(name, kind, row, chunk(2))
    column%compressed = .true.
    column%chunk(size(row)) = int(min(chunk(1), row(size(row))), hsize_t)
    call create_column(self, units, column)
  end subroutine new_compressed_column

  !> A column that is not in the file yet, in chunks of whole rows.
  pure function empty_column(name, kind, row, chunk_rows) result(column)
    character(*), intent(in) :: name
    integer, intent(in) :: kind, row(:), chunk_rows
    type(h5_column_t) :: column

    column%name = name
    column%kind = kind
    column%rank = size(row) + 1
    column%extent(:column%rank) = int([row, 0], hsize_t)
    column%chunk(:column%rank) = int([max(1, row), chunk_rows], hsize_t)
  end function empty_column

  !> Create a column in the file as it is described.
  subroutine create_column(self, units, column)
    class(h5_file_t), intent(inout) :: self
    character(*), intent(in) :: units
    type(h5_column_t), intent(inout) :: column
    character(:), allocatable :: what
    integer(hid_t) :: list
    integer :: status

    what = 'create '//column%name
    call h5pcreate_f(H5P_DATASET_CREATE_F, list, status)
    call self%check(status, what)
    call h5pset_chunk_f(list, column%rank, column%chunk(:column%rank), status)
    call self%check(status, what)
    if (column%compressed) then
      call h5pset_shuffle_f(list, status)
      call self%check(status, what)
      call h5pset_deflate_f(list, deflate_level, status)
      call self%check(status, what)
      call h5pset_fletcher32_f(list, status)   ! a chunk that was changed on the disk is not read
      call self%check(status, what)
      call h5pset_alloc_time_f(list, H5D_ALLOC_TIME_EARLY_F, status)   ! as many processes need it
      call self%check(status, what)
    end if
    call set_fill(self, column%name, column%kind, list)
    call self%new_dataset(column%name, units, type_in_file(column%kind), &
                          column%extent(:column%rank), list, column%id)
    call h5pclose_f(list, status)
  end subroutine create_column

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
    call self%get_extent(name, column%id, column%rank, column%extent)
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
  pure function bytes_for(column, n) result(bytes)
    class(h5_column_t), intent(in) :: column
    integer, intent(in) :: n   !! rows
    integer(i8) :: bytes
    integer(i8) :: layers, before, after

    bytes = 0
    if (column%rank == 0) return   ! of a file that failed
    associate (r => column%rank, extent => int(column%extent, i8), chunk => int(column%chunk, i8))
      layers = product((extent(:r - 1) + chunk(:r - 1) - 1)/chunk(:r - 1))
      before = layers*((extent(r) + chunk(r) - 1)/chunk(r))
      after = layers*((extent(r) + n + chunk(r) - 1)/chunk(r))
      bytes = bytes_for_chunks(product(chunk(:r))*bytes_of(column%kind), column%compressed, &
        before, after - before, r)
    end associate
  end function bytes_for

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

end module hdf5_file_m
