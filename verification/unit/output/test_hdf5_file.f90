!> The HDF5 layer: what is written comes back, columns grow and shrink, errors are named.
! ranks: 2 3
module test_hdf5_file_m
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use check_m, only: check, wp, sp, i8
  use parallel_m, only: is_root, nproc, my_rank, global_max
  use hdf5_file_m, only: h5_file_t
  use table_m, only: table_t, creating, reopening, appending
  implicit none
  private
  public :: test_hdf5_file

  character(*), parameter :: path = 'test_hdf5_file.h5'
  integer, parameter :: layers = 12   !! of a dataset that all processes share

contains

  subroutine test_hdf5_file()
    call test_columns()
    call test_go_on_together()
    call test_room()
    call test_trouble()
    call remove(path)
  end subroutine test_hdf5_file

  subroutine remove(name)
    character(*), intent(in) :: name
    integer :: unit, info

    if (.not. is_root()) return
    open (newunit=unit, file=name, iostat=info)
    if (info == 0) close (unit, status='delete')
  end subroutine remove

  !> An empty file of the root process.
  subroutine fresh(file)
    type(h5_file_t), intent(inout) :: file

    call remove(path)
    call file%create(path, .false.)
  end subroutine fresh

  !> No error so far; otherwise the error is shown.
  subroutine check_file(name, file)
    character(*), intent(in) :: name
    type(h5_file_t), intent(in) :: file

    call check(name, file%info, 0)
    if (file%info /= 0) print '(2x, a)', file%message
  end subroutine check_file

  !> Wait until all processes are here.
  subroutine meet()
    real(wp) :: here(1)

    here = 0.0_wp
    call global_max(here)
  end subroutine meet

  !> The columns of a table that has all kinds of them.
  subroutine list_columns(step, mode, table)
    integer, intent(in) :: step, mode
    type(table_t), intent(inout) :: table
    real(wp) :: place(3, 2), nobody(3, 0)
    real(sp) :: cells(24)

    place = step + reshape([0.1_wp, 0.2_wp, 0.3_wp, 0.4_wp, 0.5_wp, 0.6_wp], [3, 2])
    cells = real(step, sp)
    call table%begin(mode)
    call table%column('/time', 's', real(step, wp))
    call table%column('/place', 'm', place)
    call table%column('/touched', '1', [step, -step])
    call table%column('/nobody', 'm', nobody)
    call table%points('/points', 'm', .true., place)
    call table%cells('/cells', '1', [step, step + 1, step + 2])
    call table%field('/field', 'Pa', [2, 3, 4], [1, 1, 1], [2, 3, 4], cells)
  end subroutine list_columns

  subroutine test_columns()
    type(table_t) :: table
    real(wp) :: x(6), points(3*2*11)
    integer, allocatable :: found(:)
    integer :: step, touched(22), cells(33)

    if (.not. is_root()) return
    call fresh(table%file)
    table%chunk_bytes = 64
    call list_columns(0, creating, table)
    do step = 1, 11
      call list_columns(step, appending, table)
      call table%file%flush()
    end do
    call table%file%close()
    call check_file('columns are written', table%file)
    call table%file%open(path, .false., .true.)
    call list_columns(0, reopening, table)
    call table%find_rows(10, 11.0_wp)
    call check('rows are counted', table%rows == 11 .and. table%up_to_date)
    call table%read_row('/place', 7, x)
    call check('a row comes back', x, 7 + [0.1_wp, 0.2_wp, 0.3_wp, 0.4_wp, 0.5_wp, 0.6_wp])
    call table%file%read('/touched', touched)
    call check('integers come back', all(touched(13:14) == [7, -7]))
    call table%file%read('/cells', cells)
    call check('several rows at once', all(cells(19:21) == [7, 8, 9]))
    call table%file%read('/points', points)
    call check('also in single precision', points(37:39), 7 + [0.1_wp, 0.2_wp, 0.3_wp], 1.0e-6_wp)
    call table%keep(6)
    call list_columns(20, appending, table)
    call table%keep(9)
    call table%read_row('/place', 7, x)
    call check('rows are dropped and others appended', x(2), 20.2_wp)
    call table%read_row('/place', 8, x)
    call check('a row dropped does not come back', all(ieee_is_nan(x)))
    call table%file%shape_of('/nobody', found)
    call check('a column without elements has rows too', found(3), 9)
    call table%find_rows(10, 1.0_wp)
    call check('rows that are lost are noticed', index(table%file%message, 'has lost rows') > 0)
    call table%file%close()
  end subroutine test_columns

  subroutine own_layers(first, last)
    integer, intent(out) :: first, last

    first = 1 + (layers*my_rank())/nproc()
    last = (layers*(my_rank() + 1))/nproc()
  end subroutine own_layers

  !> All processes together go on in a file that one process began.
  subroutine test_go_on_together()
    type(table_t) :: table
    real(sp) :: a(layers)
    real(wp) :: x(layers)
    integer :: first, last, i

    call own_layers(first, last)
    a = [(sqrt(real(i, sp)), i=1, layers)]
    if (is_root()) then
      call fresh(table%file)
      do i = 0, 3
        call table%begin(merge(creating, appending, i == 0))
        call table%field('/field', 'm', [layers], [1], [layers], -a)
      end do
      call table%file%close()
    end if
    call meet()
    call table%file%open(path, .true., .true.)
    call table%begin(reopening)
    call table%field('/field', 'm', [layers], [first], [last - first + 1], a(first:last))
    call table%keep(2)
    call table%begin(appending)
    call table%field('/field', 'm', [layers], [first], [last - first + 1], a(first:last))
    call table%file%close()
    call check_file('a file of one process goes on', table%file)
    if (.not. is_root()) return
    call table%file%open(path, .false., .false.)
    call table%file%read_block('/field', [1, 3], [layers, 1], x)
    call check('the new row stands in it', x, real(a, wp))
    call table%file%close()
  end subroutine test_go_on_together

  !> No row takes more than it has asked for, compressed or not, however large the index grows.
  subroutine test_room()
    type(table_t) :: table
    integer, parameter :: rows = 2500, n = 96
    integer(i8) :: before, after, capacity
    real(sp) :: noise(n)
    real(wp) :: place(3, 400)
    integer :: i, row, too_large
    logical :: grew

    if (.not. is_root()) return
    call fresh(table%file)
    too_large = 0
    grew = .false.
    place = 1.0_wp
    do row = 0, rows
      noise = [(real(mod(sin(real(row*n + i, wp))*43758.5453_wp, 1.0_wp), sp), i=1, n)]
      capacity = 0
      if (row > 0) capacity = table%bytes_for_row()
      inquire (file=path, size=before)
      call table%begin(merge(creating, appending, row == 0))
      call table%column('/time', 's', 1.0_wp*row)
      call table%field('/field', 'm', [3, n/3], [1, 1], [3, n/3], noise)
      call table%column('/place', 'm', place)
      call table%file%flush()
      inquire (file=path, size=after)
      if (row > 0 .and. after > before + capacity) too_large = too_large + 1
      grew = grew .or. (row > 0 .and. after > before + 50000)
    end do
    call table%file%close()
    call check_file('many rows are written', table%file)
    call check('rows that take more room than they asked for', too_large, 0)
    call check('some rows take much room', grew)
  end subroutine test_room

  subroutine test_trouble()
    type(h5_file_t) :: file
    integer :: unit
    real(wp) :: x(1)

    if (.not. is_root()) return
    call file%create('no/such/folder/run.h5', .false.)
    call check('a folder that is not there is an error', file%info /= 0)
    call check('the message names file and reason', index(file%message, 'no/such/folder/run.h5') &
      == 1 .and. index(file%message, 'No such file or directory') > 0)
    call file%store('/a', 'm', [1.0_wp])   ! after an error everything returns at once
    call file%flush()
    call file%close()
    open (newunit=unit, file=path, status='replace')
    write (unit, '(a)') 'this is no HDF5 file'
    close (unit)
    call file%open(path, .false., .false.)
    call check('a file of another kind is an error', file%info /= 0)
    call file%close()
    call fresh(file)
    call file%read('/series/time', x)
    call check('none is named', file%info /= 0 .and. index(file%message, '/series/time') > 0)
    call file%close()
  end subroutine test_trouble

end module test_hdf5_file_m
