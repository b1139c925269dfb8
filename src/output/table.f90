!> A result file of a run: columns, datasets that grow by rows and get one each time.
!!
!! Its writer lists the columns once, in a procedure that gives each its name, unit and the values
!! of this moment:
!!
!!     call file%column('/bodies/time', 's', t)
!!     call file%column('/bodies/position', 'm', [x], 3)
!!
!! The same list creates the columns (`creating`: the values only show the shape of a row), finds
!! them in a file that goes on (`reopening`) and appends a row to each (`appending`). The first
!! column is the time. A row is the last index of a dataset, for h5py the first.
module table_m
  use, intrinsic :: iso_c_binding, only: c_ptr, c_loc, c_null_ptr, c_associated
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
  use hdf5, only: hid_t, hsize_t, size_t
  use hdf5, only: h5dset_extent_f, h5dget_create_plist_f, h5pclose_f
  use hdf5, only: h5pcreate_f, h5pget_chunk_f, h5pget_nfilters_f, h5pset_alloc_time_f
  use hdf5, only: h5pset_chunk_f, h5pset_deflate_f, h5pset_fill_value_f, h5pset_fletcher32_f
  use hdf5, only: h5pset_shuffle_f, h5tget_size_f
  use hdf5, only: H5D_ALLOC_TIME_EARLY_F, H5P_DATASET_CREATE_F, H5P_DEFAULT_F, H5T_NATIVE_DOUBLE
  use hdf5, only: H5T_NATIVE_REAL
  use kinds_m, only: wp, sp, i8
  use parallel_m, only: is_root
  use hdf5_file_m, only: h5_file_t, dataset_t, type_of, as_single, as_double, as_integer
  use file_space_m, only: bytes_for_change, bytes_for_chunks
  use state_m, only: run_state_t
  implicit none
  private
  public :: result_file_t, appending

  integer, parameter :: creating = 1, reopening = 2, appending = 3
  integer, parameter :: deflate_level = 1      !! higher levels cost time and gain little on fields
  integer, parameter :: field_bytes = 2**18    !! of a compressed field
  integer, parameter :: min_chunk_rows = 8

  !> A dataset whose last index is that of the row.
  type, extends(dataset_t) :: column_t
    integer, allocatable :: row(:)     !! shape of a row; empty: a number
    integer :: per_row = 1             !! rows of the column in a row of the table
    integer :: layers = 0              !! of a chunk: it is compressed; 0: it is not
    integer(hsize_t), allocatable :: chunk(:)    !! shape of the pieces that are stored
  end type column_t

  !> A result file whose columns one procedure lists from the state of the run. The root process
  !! alone writes it, unless it is shared by all.
  type, abstract :: result_file_t
    type(h5_file_t) :: file
    character(:), allocatable :: counter
      !! group whose `@NSteps` counts the rows, if any does; `list_columns` sets it
    integer :: rows = 0
    integer :: chunk_bytes = 2**14     !! of a column that is not compressed
    logical :: up_to_date = .false.    !! a run that goes on has a row of its very start
    integer :: mode = creating         !! what listing the columns does
    integer, private :: at = 0         !! column that was listed last
    type(column_t), allocatable, private :: list(:)
  contains
    procedure, private :: number, numbers, next, pass_list, count_rows
    generic :: column => number, numbers
    procedure :: points, cells, field
    procedure(of_state), deferred :: write_head     !! all but columns
    procedure(of_state), deferred :: list_columns   !! as above
    procedure :: create, reopen, drop, append, bytes_for_row
  end type result_file_t

  abstract interface
    subroutine of_state(self, state)
      import :: result_file_t, run_state_t
      implicit none
      class(result_file_t), intent(inout) :: self
      type(run_state_t), intent(in) :: state
    end subroutine of_state
  end interface

contains

  !> List the columns: create them, find them, or append a row to each.
  subroutine pass_list(self, mode, state)
    class(result_file_t), intent(inout) :: self
    integer, intent(in) :: mode   !! creating, reopening, appending
    type(run_state_t), intent(in) :: state

    self%mode = mode
    self%at = 0
    if (mode /= appending) self%list = [column_t ::]
    call self%list_columns(state)
  end subroutine pass_list

  !> The next column: create it, find it in the file, or append a row to it.
  subroutine next(self, name, units, kind, row, data, per_row, layers)
    class(result_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in), optional :: kind        !! of its numbers in the file, else doubles
    integer, intent(in) :: row(:)                !! its shape; empty: a number
    type(c_ptr), intent(in) :: data              !! its values; null: the caller writes them
    integer, intent(in), optional :: per_row, layers   !! as in `column_t`
    type(column_t) :: new

    self%at = self%at + 1
    if (self%file%info /= 0) return
    if (self%mode == appending) then
      call append_row(self%file, self%list(self%at), data)
      return
    end if
    new = column_t(name=name, units=units, type=type_of(kind), here=H5T_NATIVE_DOUBLE, row=row)
    if (new%type == H5T_NATIVE_REAL) new%here = new%type
    if (present(per_row)) new%per_row = per_row
    if (present(layers)) new%layers = layers
    if (self%mode == reopening) call open_column(self%file, new)
    if (self%mode == creating) call create_column(self%file, self%chunk_bytes, new)
    self%list = [self%list, new]
  end subroutine next

  !> A number.
  subroutine number(self, name, units, x, kind)
    class(result_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    real(wp), intent(in), target :: x
    integer, intent(in), optional :: kind   !! in the file, else `as_double`

    call self%next(name, units, kind, [integer ::], c_loc(x))
  end subroutine number

  !> Numbers or vectors, one of each block.
  subroutine numbers(self, name, units, x, components, kind)
    class(result_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    real(wp), intent(in), target, contiguous :: x(:)
    integer, intent(in), optional :: components, kind   !! of a vector; as above
    integer :: row(2)

    row = size(x)
    if (present(components)) row = [components, size(x)/components]
    call self%next(name, units, kind, row(:merge(2, 1, present(components))), c_loc(x))
  end subroutine numbers

  !> Vectors of points, which follow one another in the file; compressed.
  subroutine points(self, name, units, single, x)
    class(result_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    logical, intent(in) :: single     !! precision in the file
    real(wp), intent(in), target, contiguous :: x(:, :)   !! (3, points)
    real(sp), allocatable, target :: short(:, :)

    if (single) then
      allocate (short(3, size(x, 2)), source=real(x, sp))
      call self%next(name, units, as_single, [3], c_loc(short), size(x, 2), 3)
    else
      call self%next(name, units, as_double, [3], c_loc(x), size(x, 2), 3)
    end if
  end subroutine points

  !> Integers of cells, which follow one another in the file.
  subroutine cells(self, name, units, n)
    class(result_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    real(wp), intent(in), target, contiguous :: n(:)

    call self%next(name, units, as_integer, [integer ::], c_loc(n), size(n))
  end subroutine cells

  !> Numbers of the cells of a grid in single precision, of which this process gives a block;
  !! compressed. All processes together write them.
  subroutine field(self, name, units, whole, first, extent, a)
    class(result_file_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: whole(:)              !! shape of the field
    integer, intent(in) :: first(:), extent(:)   !! of the block
    real(sp), intent(in), target, contiguous :: a(:)   !! its elements in a row
    integer :: layers

    layers = max(1, field_bytes/(4*product(whole(:size(whole) - 1))))
    call self%next(name, units, as_single, whole, c_null_ptr, &
                   layers=min(layers, whole(size(whole))))
    if (self%mode /= appending .or. self%file%info /= 0) return
    associate (file => self%file, column => self%list(self%at))
      call file%pass_part(column, [int(first - 1, hsize_t), last_row(column)], &
                           [int(extent, hsize_t), 1_hsize_t], c_loc(a), file%transfer)
    end associate
  end subroutine field

  !> Number of the last row, from 0.
  pure integer(hsize_t) function last_row(column)
    type(column_t), intent(in) :: column

    last_row = column%extent(size(column%extent)) - 1
  end function last_row

  !> Create a column without rows. Chunks of whole rows are written in place at once; those of a
  !! column that is compressed must be written whole.
  subroutine create_column(file, chunk_bytes, column)
    type(h5_file_t), intent(inout) :: file
    integer, intent(in) :: chunk_bytes   !! if it is not compressed
    type(column_t), intent(inout) :: column
    integer(hid_t) :: list
    real(wp), target :: nothing
    real(sp), target :: nothing_single
    integer :: status(7), rows

    rows = max(min_chunk_rows, chunk_bytes/(8*max(1, product(column%row))))
    if (column%per_row > 1 .or. column%layers > 0) rows = column%per_row
    column%extent = int([column%row, 0], hsize_t)
    column%chunk = int([max(1, column%row), rows], hsize_t)
    if (column%layers > 0) column%chunk(size(column%row)) = int(column%layers, hsize_t)
    status = 0
    call h5pcreate_f(H5P_DATASET_CREATE_F, list, status(1))
    call h5pset_chunk_f(list, size(column%chunk), column%chunk, status(2))
    if (column%layers > 0) then
      call h5pset_shuffle_f(list, status(3))
      call h5pset_deflate_f(list, deflate_level, status(4))
      call h5pset_fletcher32_f(list, status(5))   ! a chunk that was changed on the disk is not read
      call h5pset_alloc_time_f(list, H5D_ALLOC_TIME_EARLY_F, status(6))   ! many processes need it
    end if
    nothing = -1.0_wp   ! in a row that never arrived; NaN in reals, which HDF5 must not convert
    if (column%type == H5T_NATIVE_DOUBLE) nothing = ieee_value(nothing, ieee_quiet_nan)
    if (column%type == H5T_NATIVE_REAL) then
      nothing_single = ieee_value(nothing_single, ieee_quiet_nan)
      call h5pset_fill_value_f(list, H5T_NATIVE_REAL, c_loc(nothing_single), status(7))
    else
      call h5pset_fill_value_f(list, H5T_NATIVE_DOUBLE, c_loc(nothing), status(7))
    end if
    call file%check(minval(status), 'create '//column%name)
    call file%begin_dataset(column, list)
    call h5pclose_f(list, status(1))
  end subroutine create_column

  !> Open a column of a file that exists.
  subroutine open_column(file, column)
    type(h5_file_t), intent(inout) :: file
    type(column_t), intent(inout) :: column
    integer(hid_t) :: list
    integer :: status, filters

    call file%find(column)
    if (file%info /= 0) return
    allocate (column%chunk, mold=column%extent)
    call h5dget_create_plist_f(column%id, list, status)
    call file%check(status, 'open '//column%name)
    if (file%info /= 0) return
    call h5pget_chunk_f(list, size(column%chunk), column%chunk, status)
    call file%check(status, 'open '//column%name)
    call h5pget_nfilters_f(list, filters, status)
    call file%check(status, 'open '//column%name)
    column%layers = merge(int(column%chunk(max(1, size(column%chunk) - 1))), 0, filters > 0)
    call h5pclose_f(list, status)
  end subroutine open_column

  !> Give a column this many rows: later ones are dropped, missing ones have the fill value.
  subroutine resize(file, column, rows)
    type(h5_file_t), intent(inout) :: file
    type(column_t), intent(inout) :: column
    integer(hsize_t), intent(in) :: rows
    integer :: status

    if (file%info /= 0) return
    column%extent(size(column%extent)) = rows
    call h5dset_extent_f(column%id, column%extent, status)
    call file%check(status, 'write '//column%name)
  end subroutine resize

  !> Append a row of the table; of a shared file the root process writes it.
  subroutine append_row(file, column, data)
    type(h5_file_t), intent(inout) :: file
    type(column_t), intent(inout) :: column
    type(c_ptr), intent(in) :: data   !! null: the caller writes it
    integer(hsize_t) :: first(size(column%extent)), extent(size(column%extent))

    first = 0
    first(size(first)) = last_row(column) + 1
    extent = [int(column%row, hsize_t), int(column%per_row, hsize_t)]
    call resize(file, column, last_row(column) + 1 + column%per_row)
    if (.not. c_associated(data) .or. product(extent) == 0) return
    if (file%shared .and. .not. is_root()) return
    call file%pass_part(column, first, extent, data, H5P_DEFAULT_F)
  end subroutine append_row

  !> Most that another row takes at the end of the file [bytes].
  function bytes_for_row(self) result(bytes)
    class(result_file_t), intent(in) :: self
    integer(i8) :: bytes
    integer(i8) :: layers, before, after
    integer(size_t) :: element
    integer :: c, n, status

    bytes = bytes_for_change
    if (self%file%info /= 0) return
    do c = 1, size(self%list)
      associate (column => self%list(c), extent => int(self%list(c)%extent, i8), &
        chunk => int(self%list(c)%chunk, i8))
        n = size(extent)
        call h5tget_size_f(column%type, element, status)
        layers = product((extent(:n - 1) + chunk(:n - 1) - 1)/chunk(:n - 1))
        before = layers*((extent(n) + chunk(n) - 1)/chunk(n))
        after = layers*((extent(n) + column%per_row + chunk(n) - 1)/chunk(n))
        bytes = bytes + bytes_for_chunks(product(chunk)*int(element, i8), column%layers > 0, &
          before, after - before, n)
      end associate
    end do
  end function bytes_for_row

  !> Create the file without rows.
  subroutine create(self, path, shared, state)
    class(result_file_t), intent(inout) :: self
    character(*), intent(in) :: path
    logical, intent(in) :: shared   !! all processes call and write
    type(run_state_t), intent(in) :: state

    if (.not. (is_root() .or. shared)) return
    call self%file%create(path, shared)
    call self%write_head(state)
    call self%pass_list(creating, state)
    call self%count_rows(0)
  end subroutine create

  !> Open the file of a run that goes on from `state`; nothing in it is changed yet. The run keeps
  !! the rows that it has counted, and one more if that one is of this very time; later ones stay
  !! until `drop`.
  subroutine reopen(self, path, shared, counted, state)
    class(result_file_t), intent(inout) :: self
    character(*), intent(in) :: path
    logical, intent(in) :: shared
    integer, intent(in) :: counted   !! rows
    type(run_state_t), intent(in) :: state
    real(wp) :: last(1)
    integer :: row, there

    if (.not. (is_root() .or. shared)) return
    call self%file%open(path, shared, .true.)
    call self%pass_list(reopening, state)
    self%rows = counted
    self%up_to_date = .false.
    if (self%file%info /= 0) return
    there = int(last_row(self%list(1))) + 1
    if (there < counted) then
      self%file%info = 1
      self%file%message = self%file%path//': has lost rows, the run cannot go on in it'
    end if
    do row = max(1, counted), min(counted + 1, there)
      call self%file%read(self%list(1)%name, last, [row], [1])
      if (self%file%info /= 0 .or. abs(last(1) - state%clock%t) > 0.0_wp) cycle
      self%rows = row
      self%up_to_date = .true.
    end do
  end subroutine reopen

  !> Keep the first rows.
  subroutine drop(self, rows)
    class(result_file_t), intent(inout) :: self
    integer, intent(in) :: rows
    integer :: c

    if (.not. (is_root() .or. self%file%shared)) return
    call self%count_rows(rows)
    self%rows = rows
    if (self%file%info /= 0) return
    do c = 1, size(self%list)
      call resize(self%file, self%list(c), int(rows, hsize_t)*self%list(c)%per_row)
    end do
    call self%file%flush()
  end subroutine drop

  !> Write a row as number `rows_before` + 1, in the place of a row that only ended an earlier run.
  subroutine append(self, rows_before, state)
    class(result_file_t), intent(inout) :: self
    integer, intent(in) :: rows_before   !! due rows written so far
    type(run_state_t), intent(in) :: state

    if (.not. (is_root() .or. self%file%shared)) return
    if (self%rows /= rows_before) call self%drop(rows_before)
    call self%file%reserve(self%bytes_for_row())
    call self%pass_list(appending, state)
    self%rows = self%rows + 1
    call self%count_rows(self%rows)
  end subroutine append

  !> Say how many rows are complete, once they are in the file.
  subroutine count_rows(self, rows)
    class(result_file_t), intent(inout) :: self
    integer, intent(in) :: rows

    call self%file%flush()
    if (.not. allocated(self%counter)) return
    call self%file%attribute(self%counter, 'NSteps', [rows])
    call self%file%flush()
  end subroutine count_rows

end module table_m
