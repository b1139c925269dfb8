!> The HDF5 layer: what is written comes back, columns grow and shrink, errors are named.
! ranks: 2 3
module test_hdf5_file_m
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use check_m, only: check, wp, sp, i8
  use parallel_m, only: is_root, nproc, my_rank, global_max
  use hdf5_file_m, only: h5_file_t, as_integer
  use table_m, only: result_file_t, appending
  use state_m, only: run_state_t
  implicit none
  private
  public :: test_hdf5_file

  character(*), parameter :: path = 'test_hdf5_file.h5'
  integer, parameter :: layers = 12   !! of a dataset that all processes share

  type, extends(result_file_t) :: sample_t
    character(6) :: what = 'all'   !! kinds of columns; 'noise' and much in a row; 'shared' field
    real(sp) :: sign = -1.0_sp     !! of that field
  contains
    procedure :: write_head, list_columns
  end type sample_t

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

  subroutine write_head(self, state)
    class(sample_t), intent(inout) :: self
    type(run_state_t), intent(in) :: state

    call self%file%attribute('/', 'step', [state%clock%step])
  end subroutine write_head

  subroutine list_columns(self, state)
    class(sample_t), intent(inout) :: self
    type(run_state_t), intent(in) :: state
    real(wp) :: place(3, 2)
    real(sp) :: a(96)
    integer :: first, last, i

    associate (t => state%clock%t)
      place = t + reshape([0.1_wp, 0.2_wp, 0.3_wp, 0.4_wp, 0.5_wp, 0.6_wp], [3, 2])
      call self%column('/time', 's', t)
      select case (self%what)
      case ('all')
        a = real(t, sp)
        call self%column('/place', 'm', [place], 3)
        call self%column('/touched', '1', [t, -t], kind=as_integer)
        call self%column('/nobody', 'm', [real(wp) ::], 3)
        call self%points('/points', 'm', .true., place)
        call self%cells('/cells', '1', [t, t + 1, t + 2])
        call self%field('/field', 'Pa', [2, 3, 4], [1, 1, 1], [2, 3, 4], a(:24))
      case ('noise')
        a = [(real(mod(sin(t*size(a) + i)*43758.5453_wp, 1.0_wp), sp), i=1, size(a))]
        call self%field('/field', 'm', [3, size(a)/3], [1, 1], [3, size(a)/3], a)
        call self%column('/place', 'm', spread(1.0_wp, 1, 1200), 3)
      case default
        a = self%sign*[(sqrt(real(i, sp)), i=1, size(a))]
        first = 1
        last = layers
        if (self%file%shared) call own_layers(first, last)
        call self%field('/field', 'm', [layers], [first], [last - first + 1], a(first:last))
      end select
    end associate
  end subroutine list_columns

  subroutine test_columns()
    type(sample_t) :: table
    type(run_state_t) :: state
    real(wp) :: x(6), points(3*2*11)
    integer, allocatable :: found(:)
    integer :: step, touched(22), cells(33)

    if (.not. is_root()) return
    call remove(path)
    table%chunk_bytes = 64
    call table%create(path, .false., state)
    do step = 1, 11
      state%clock%t = step
      call table%append(step - 1, state)
    end do
    call table%file%close()
    call check_file('columns are written', table%file)
    call table%reopen(path, .false., 10, state)
    call check('rows are counted', table%rows == 11 .and. table%up_to_date)
    call table%file%read('/place', x, [1, 1, 7], [3, 2, 1])
    call check('a row comes back', x, 7 + [0.1_wp, 0.2_wp, 0.3_wp, 0.4_wp, 0.5_wp, 0.6_wp])
    call table%file%read('/touched', touched)
    call check('integers come back', all(touched(13:14) == [7, -7]))
    call table%file%read('/cells', cells)
    call check('several rows at once', all(cells(19:21) == [7, 8, 9]))
    call table%file%read('/points', points)
    call check('also in single precision', points(37:39), 7 + [0.1_wp, 0.2_wp, 0.3_wp], 1.0e-6_wp)
    state%clock%t = 20
    call table%append(6, state)
    call table%drop(9)
    call table%file%read('/place', x, [1, 1, 7], [3, 2, 1])
    call check('rows are dropped and others appended', x(2), 20.2_wp)
    call table%file%read('/place', x, [1, 1, 8], [3, 2, 1])
    call check('a row dropped does not come back', all(ieee_is_nan(x)))
    call table%file%shape_of('/nobody', found)
    call check('a column without elements has rows too', found(3), 9)
    call table%file%close()
    call table%reopen(path, .false., 10, state)
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
    type(sample_t) :: table
    type(run_state_t) :: state
    real(wp) :: x(layers)
    integer :: i

    table%what = 'shared'
    if (is_root()) then
      call remove(path)
      call table%create(path, .false., state)
      do i = 0, 2
        call table%append(i, state)
      end do
      call table%file%close()
    end if
    call meet()
    table%sign = 1.0_sp
    call table%reopen(path, .true., 2, state)
    call table%append(2, state)
    call table%file%close()
    call check_file('a file of one process goes on', table%file)
    if (.not. is_root()) return
    call table%file%open(path, .false., .false.)
    call table%file%read('/field', x, [1, 3], [layers, 1])
    call check('the new row stands in it', x, real([(sqrt(real(i, sp)), i=1, layers)], wp))
    call table%file%close()
  end subroutine test_go_on_together

  !> No row takes more than it has asked for, compressed or not, however large the index grows.
  subroutine test_room()
    type(sample_t) :: table
    type(run_state_t) :: state
    integer, parameter :: rows = 2500
    integer(i8) :: before, after, capacity
    integer :: row, too_large
    logical :: grew

    if (.not. is_root()) return
    table%what = 'noise'
    call remove(path)
    call table%create(path, .false., state)
    too_large = 0
    grew = .false.
    do row = 1, rows
      state%clock%t = row
      capacity = table%bytes_for_row()
      inquire (file=path, size=before)
      call table%append(row - 1, state)
      inquire (file=path, size=after)
      if (after > before + capacity) too_large = too_large + 1
      grew = grew .or. after > before + 50000
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
