!> A file with a table: columns that get a row each time.
!!
!! Its writer lists the columns once, in a procedure that gives each its name, unit and the values
!! of this moment:
!!
!!     call file%begin(appending)
!!     call file%column('/bodies/time', 's', t)
!!     call file%column('/bodies/position', 'm', x)
!!
!! The same list creates the columns (`creating`: the values only show the shape of a row), finds
!! them in a file that goes on (`reopening`) and appends a row to each (`appending`). The first
!! column is the time.
module hdf5_table_m
  use kinds_m, only: wp, sp, i8
  use hdf5_file_m, only: h5_file_t, h5_column_t, file_real64, file_real32, file_integer32, &
    file_integer64
  use file_space_m, only: bytes_for_change
  implicit none
  private
  public :: h5_table_t, creating, reopening, appending

  integer, parameter :: creating = 1, reopening = 2, appending = 3
  integer, parameter :: field_bytes = 2**18    !! of a compressed field
  integer, parameter :: min_chunk_rows = 8

  type :: table_column_t
    type(h5_column_t) :: column
    integer :: per_row = 1             !! rows of the column in a row of the table
  end type table_column_t

  type :: h5_table_t
    type(h5_file_t) :: file
    integer :: rows = 0
    integer :: chunk_bytes = 2**14     !! of a column that is not compressed
    logical :: up_to_date = .false.    !! a run that goes on has a row of its very start
    integer, private :: mode = creating
    integer, private :: at = 0         !! column that was listed last
    type(table_column_t), allocatable, private :: list(:)
  contains
    procedure, private :: number, vectors, integers, wide_number, wide_numbers
    generic :: column => number, vectors, integers, wide_number, wide_numbers
    procedure :: points, cells, field
    procedure :: begin, find_rows, keep, bytes_for_table, read_row_of
    procedure, private :: next_column
  end type h5_table_t

contains

  !> Begin to list the columns.
  subroutine begin(self, mode)
    class(h5_table_t), intent(inout) :: self
    integer, intent(in) :: mode   !! creating, reopening, appending

    self%mode = mode
    self%at = 0
    if (mode /= appending) self%list = [table_column_t ::]
  end subroutine begin

  !> Go to the next column; one that is not known yet is created or found in the file.
  subroutine next_column(self, name, units, kind, row, per_row, layers)
    class(h5_table_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: kind                  !! file_real64, ...
    integer, intent(in) :: row(:)                !! shape of a row; empty: a number
    integer, intent(in), optional :: per_row     !! rows of the column each time, else one
    integer, intent(in), optional :: layers      !! of a chunk: it is compressed
    type(table_column_t) :: new
    integer :: chunk

    self%at = self%at + 1
    if (self%mode == appending) return
    if (present(per_row)) new%per_row = per_row
    chunk = max(min_chunk_rows, self%chunk_bytes/(8*max(1, product(row))))
    if (present(per_row)) chunk = per_row
    if (self%mode == reopening) then
      call self%file%open_column(name, kind, new%column)
    else if (present(layers)) then
      call self%file%new_compressed_column(name, units, kind, row, [layers, new%per_row], &
                                           new%column)
    else
      call self%file%new_column(name, units, kind, row, chunk, new%column)
    end if
    self%list = [self%list, new]
  end subroutine next_column

  !> A number.
  subroutine number(self, name, units, x)
    class(h5_table_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    real(wp), intent(in) :: x

    call self%next_column(name, units, file_real64, [integer ::])
    if (self%mode == appending) call self%file%append(self%list(self%at)%column, [x])
  end subroutine number

  !> Vectors, one of each block.
  subroutine vectors(self, name, units, x)
    class(h5_table_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    real(wp), intent(in) :: x(:, :)   !! (components, blocks)

    call self%next_column(name, units, file_real64, shape(x))
    if (self%mode == appending) call self%file%append(self%list(self%at)%column, &
      reshape(x, [size(x)]))
  end subroutine vectors

  !> Integers, one of each block.
  subroutine integers(self, name, units, n)
    class(h5_table_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: n(:)

    call self%next_column(name, units, file_integer32, shape(n))
    if (self%mode == appending) call self%file%append_integers(self%list(self%at)%column, n)
  end subroutine integers

  !> An integer of 64 bits, the kind that VTK uses for numbers of points and cells.
  subroutine wide_number(self, name, units, n)
    class(h5_table_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer(i8), intent(in) :: n

    call self%next_column(name, units, file_integer64, [integer ::])
    if (self%mode == appending) call self%file%append_wide(self%list(self%at)%column, [n])
  end subroutine wide_number

  subroutine wide_numbers(self, name, units, n)
    class(h5_table_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer(i8), intent(in) :: n(:)

    call self%next_column(name, units, file_integer64, shape(n))
    if (self%mode == appending) call self%file%append_wide(self%list(self%at)%column, n)
  end subroutine wide_numbers

  !> Vectors of points, which follow one another in the file; compressed.
  subroutine points(self, name, units, kind, x)
    class(h5_table_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: kind       !! file_real64, file_real32
    real(wp), intent(in) :: x(:, :)   !! (3, points)

    call self%next_column(name, units, kind, [3], size(x, 2), 3)
    if (self%mode == appending) call self%file%append_rows(self%list(self%at)%column, &
      size(x, 2), reshape(x, [size(x)]))
  end subroutine points

  !> Integers of cells, which follow one another in the file.
  subroutine cells(self, name, units, n)
    class(h5_table_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: n(:)

    call self%next_column(name, units, file_integer32, [integer ::], size(n))
    if (self%mode == appending) call self%file%append_integers(self%list(self%at)%column, &
      n, size(n))
  end subroutine cells

  !> Numbers of the cells of a grid in single precision, of which this process gives a block;
  !! compressed. All processes together.
  subroutine field(self, name, units, whole, first, extent, a)
    class(h5_table_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: whole(:)              !! shape of the field
    integer, intent(in) :: first(:), extent(:)   !! of the block
    real(sp), intent(in), target, contiguous :: a(:)   !! its elements in a row
    integer :: layers

    layers = max(1, field_bytes/(4*product(whole(:size(whole) - 1))))
    call self%next_column(name, units, file_real32, whole, 1, layers)
    if (self%mode == appending) call self%file%append_block(self%list(self%at)%column, first, &
      extent, a)
  end subroutine field

  !> Rows that a run keeps which goes on, see `count_rows`; later ones stay until `keep`.
  subroutine find_rows(self, counted, time)
    class(h5_table_t), intent(inout) :: self
    integer, intent(in) :: counted   !! by the run
    real(wp), intent(in) :: time     !! [s]

    call self%file%count_rows(self%list(1)%column, counted, time, self%rows, self%up_to_date)
  end subroutine find_rows

  !> Give the table so many rows.
  subroutine keep(self, rows)
    class(h5_table_t), intent(inout) :: self
    integer, intent(in) :: rows
    integer :: c

    self%rows = rows
    do c = 1, size(self%list)
      associate (column => self%list(c)%column)
        call self%file%resize(column, int(rows, i8)*self%list(c)%per_row)
      end associate
    end do
  end subroutine keep

  !> Most that another row takes at the end of the file [bytes].
  pure function bytes_for_table(self) result(bytes)
    class(h5_table_t), intent(in) :: self
    integer(i8) :: bytes
    integer :: c

    bytes = bytes_for_change
    do c = 1, size(self%list)
      bytes = bytes + self%list(c)%column%bytes_for(self%list(c)%per_row)
    end do
  end function bytes_for_table

  !> Row number `row` of a column of reals.
  subroutine read_row_of(self, name, row, a)
    class(h5_table_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: row
    real(wp), intent(inout) :: a(:)
    integer :: c

    if (self%file%info /= 0) return
    do c = 1, size(self%list)
      if (self%list(c)%column%name == name) call self%file%read_row(self%list(c)%column, row, a)
    end do
  end subroutine read_row_of

end module hdf5_table_m
