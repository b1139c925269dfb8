!> The HDF5 layer: what is written comes back, columns grow and shrink, errors are named.
! ranks: 2 3
module test_hdf5_file_m
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use, intrinsic :: iso_c_binding, only: c_funptr, c_int, c_long, c_null_char
  use c_library_m, only: c_getrlimit, c_rename, c_signal
  use kinds_m, only: wp, sp, i8
  use parallel_m, only: is_root, nproc, my_rank, broadcast
  use hdf5_file_m, only: h5_file_t, h5_column_t, file_real64, file_real32, file_integer32
  use file_space_m, only: bytes_for_change
  use check_m, only: check
  implicit none
  private
  public :: test_hdf5_file

  character(*), parameter :: path = 'test_hdf5_file.h5'

  interface
    integer(c_int) function c_setrlimit(resource, limit) bind(c, name='setrlimit')
      import :: c_int, c_long
      implicit none
      integer(c_int), value :: resource
      integer(c_long), intent(in) :: limit(2)
    end function c_setrlimit
  end interface

contains

  subroutine test_hdf5_file()
    call test_attributes()
    call test_datasets()
    call test_columns()
    call test_read_while_open()
    call test_shared_blocks()
    call test_go_on_together()
    call test_room()
    call test_no_room()
    call test_another_in_its_place()
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

  !> No error so far; otherwise the error is shown.
  subroutine check_file(name, file)
    character(*), intent(in) :: name
    type(h5_file_t), intent(in) :: file

    call check(name, file%info, 0)
    if (file%info /= 0) print '(2x, a)', file%message
  end subroutine check_file

  !> Wait until all processes are here.
  subroutine meet()
    integer :: n

    n = 0
    call broadcast(n)
  end subroutine meet

  subroutine test_attributes()
    type(h5_file_t) :: file
    character(:), allocatable :: long, text
    integer :: n

    if (.not. is_root()) return
    long = repeat('&body position = 0.1, 0.2, 0.3 /'//new_line('a'), 5000)   ! more than 64 kB
    call remove(path)
    call file%create(path, .false.)
    call file%group('/provenance')
    call file%attribute('/provenance', 'namelist', long)
    call file%attribute('/provenance', 'empty', '')
    call file%attribute('/provenance', 'finished', '')
    call file%attribute('/provenance', 'exit_status', -1)
    call file%attribute('/provenance', 'exit_status', 3)
    call file%attribute('/provenance', 'finished', 'now')
    call file%close()
    call check_file('attributes are written', file)
    call file%open(path, .false., .false.)
    call file%read_attribute('/provenance', 'namelist', text)
    call check('a text longer than 64 kB comes back', text == long .and. len(text) == len(long))
    call file%read_attribute('/provenance', 'empty', text)
    call check('an empty text comes back', len(text), 0)
    call file%read_attribute('/provenance', 'finished', text)
    call check('a text can be replaced by a longer one', text == 'now')
    call file%read_attribute('/provenance', 'exit_status', n)
    call check('a number can be replaced', n, 3)
    call file%close()
  end subroutine test_attributes

  subroutine test_datasets()
    type(h5_file_t) :: file
    real(wp) :: a(2, 3), b(6)
    integer :: i, n(4)

    if (.not. is_root()) return
    a = reshape([(1.0_wp/i, i=1, 6)], [2, 3])
    call remove(path)
    call file%create(path, .false.)
    call file%store('/a', 'm', a)
    call file%store('/n', '1', [5, 6, 7, 8])
    call file%store('/nothing', 'm', [real(wp) ::])
    call file%store('/name', '1', ['hexapod', 'box    '])
    call file%rewrite('/a', [(2.0_wp/i, i=1, 6)])
    call file%close()
    call check_file('datasets are written', file)
    call file%open(path, .false., .false.)
    call file%read('/a', b)
    call check('reals come back bit by bit', b, [(2.0_wp/i, i=1, 6)], 0.0_wp)
    call file%read('/n', n)
    call check('integers come back', all(n == [5, 6, 7, 8]))
    call file%read('/nothing', b(:0))
    call check_file('an empty dataset comes back', file)
    call file%read('/n', n(:3))
    call check('another size is noticed', file%info /= 0)
    call file%close()
  end subroutine test_datasets

  subroutine test_columns()
    type(h5_file_t) :: file
    type(h5_column_t) :: time, place, touched, field, nobody
    real(sp) :: cells(24)
    real(wp) :: x(6)
    integer :: step

    if (.not. is_root()) return
    call remove(path)
    call file%create(path, .false.)
    call file%new_column('/time', 's', file_real64, [integer ::], 4, time)
    call file%new_column('/place', 'm', file_real64, [3, 2], 4, place)
    call file%new_column('/touched', '1', file_integer32, [2], 4, touched)
    call file%new_column('/nobody', 'm', file_real64, [3, 0], 4, nobody)
    call file%new_compressed_column('/field', 'Pa', file_real32, [2, 3, 4], [2, 1], field)
    do step = 1, 11
      call file%append(time, [real(step, wp)])
      call file%append(place, step + [0.1_wp, 0.2_wp, 0.3_wp, 0.4_wp, 0.5_wp, 0.6_wp])
      call file%append_integers(touched, [step, -step])
      call file%append(nobody, [real(wp) ::])
      cells = real(step, sp)
      call file%append_block(field, [1, 1, 1], [2, 3, 4], cells)
      call file%flush()
    end do
    call file%close()
    call check_file('columns are written', file)

    call file%open(path, .false., .true.)
    call file%open_column('/place', file_real64, place)
    call check('rows are counted', int(place%extent(place%rank)), 11)
    call file%read_row(place, 7, x)
    call check('a row comes back', x, 7 + [0.1_wp, 0.2_wp, 0.3_wp, 0.4_wp, 0.5_wp, 0.6_wp], 0.0_wp)
    call file%resize(place, 6_i8)
    call file%append(place, [1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp, 5.0_wp, 6.0_wp])
    call file%resize(place, 9_i8)
    call file%read_row(place, 7, x)
    call check('rows are dropped and others appended', x(2), 2.0_wp, 0.0_wp)
    call file%read_row(place, 8, x)
    call check('a row dropped does not come back', all(ieee_is_nan(x)))
    call file%open_column('/nobody', file_real64, nobody)
    call check('a column without elements has rows too', int(nobody%extent(3)), 11)
    call file%close()
    call check_file('no error with columns', file)
  end subroutine test_columns

  !> What was flushed can be read while the writer holds the file: no locks.
  subroutine test_read_while_open()
    type(h5_file_t) :: writer, reader
    type(h5_column_t) :: time, seen
    real(wp) :: x(1)

    if (.not. is_root()) return
    call remove(path)
    call writer%create(path, .false.)
    call writer%new_column('/time', 's', file_real64, [integer ::], 64, time)
    call writer%append(time, [42.0_wp])
    call writer%flush()
    call execute_command_line('cp '//path//' copy_' &
      //path)   ! what a reader, or a crash, finds on disk
    call reader%open('copy_'//path, .false., .false.)
    call reader%open_column('/time', file_real64, seen)
    call reader%read_row(seen, 1, x)
    call check('a flushed row is on disk', x(1), 42.0_wp, 0.0_wp)
    call reader%close()
    call writer%close()
    call check('no error while reading', reader%info + writer%info, 0)
    call remove('copy_'//path)
  end subroutine test_read_while_open

  !> All processes write their layers of one dataset; what is read does not depend on their number.
  subroutine test_shared_blocks()
    type(h5_file_t) :: file
    type(h5_column_t) :: field, count
    integer, parameter :: layers = 12
    real(wp) :: mine(2*layers), all_of_it(2*layers), x(2*layers)
    integer :: first, last, i

    first = 1 + (layers*my_rank())/nproc()
    last = (layers*(my_rank() + 1))/nproc()
    mine = [(sqrt(real(i, wp)), i=1, 2*layers)]
    call remove(path)
    call meet()
    call file%create(path, .true.)
    call file%attribute('/', 'note', 'shared')
    call file%new_blocks('/blocks', 'm', [2, layers])
    call file%write_block('/blocks', [1, first], [2, last - first + 1], mine(2*first - 1:2*last))
    call file%new_compressed_column('/field', 'm', file_real32, [2, layers], [5, 1], field)
    call file%new_column('/count', '1', file_real64, [integer ::], 8, count)
    do i = 1, 3
      call file%append_block(field, [1, first], [2, last - first + 1], real(i*mine(2*first &
        - 1:2*last), sp))
      call file%append(count, [real(i, wp)])
      call file%attribute('/', 'steps', i)
      call file%flush()
    end do
    call file%close()
    call check_file('a shared file is written', file)

    call file%open(path, .true., .false.)
    all_of_it = 0.0_wp
    call file%read_block('/blocks', [1, first], [2, last - first + 1], all_of_it(2*first &
      - 1:2*last))
    call check('own block comes back', all_of_it(2*first - 1:2*last), mine(2*first - 1:2*last), &
      0.0_wp)
    call file%close()
    if (.not. is_root()) return
    call file%open(path, .false., .false.)
    call file%read('/blocks', all_of_it)
    call check('blocks of all processes fit together', all_of_it, mine, 0.0_wp)
    call file%open_column('/field', file_real32, field)
    call file%read_row(field, 3, x)
    call check('compressed blocks fit together', x, real(real(3*mine, sp), wp), 0.0_wp)
    call file%read('/count', x(:3))
    call check('rows of the root process arrive', x(:3), [1.0_wp, 2.0_wp, 3.0_wp], 0.0_wp)
    call file%close()
    call check_file('no error with a shared file', file)
  end subroutine test_shared_blocks

  !> All processes together go on in a file that one process began.
  subroutine test_go_on_together()
    type(h5_file_t) :: file
    type(h5_column_t) :: field
    integer, parameter :: layers = 12
    real(sp) :: a(layers)
    real(wp) :: x(layers)
    integer :: first, last, i

    first = 1 + (layers*my_rank())/nproc()
    last = (layers*(my_rank() + 1))/nproc()
    a = [(sqrt(real(i, sp)), i=1, layers)]
    if (is_root()) then
      call remove(path)
    call file%create(path, .false.)
      call file%new_compressed_column('/field', 'm', file_real32, [layers], [layers, 1], field)
      do i = 1, 3
        call file%append_block(field, [1], [layers], -a)
      end do
      call file%close()
    end if
    call meet()
    call file%open(path, .true., .true.)
    call file%open_column('/field', file_real32, field)
    call file%resize(field, 2_i8)
    call file%append_block(field, [first], [last - first + 1], a(first:last))
    call file%close()
    call check_file('a file of one process goes on', file)
    if (.not. is_root()) return
    call file%open(path, .false., .false.)
    call file%open_column('/field', file_real32, field)
    call file%read_row(field, 3, x)
    call check('the new row stands in it', x, real(a, wp), 0.0_wp)
    call file%close()
  end subroutine test_go_on_together

  !> No row takes more than it has asked for, compressed or not, however large the index grows.
  subroutine test_room()
    type(h5_file_t) :: file
    type(h5_column_t) :: time, field, place
    integer, parameter :: rows = 2500, n = 96
    integer(i8) :: before, after, capacity
    real(sp) :: noise(n)
    integer :: i, row, too_large
    logical :: grew

    if (.not. is_root()) return
    call remove(path)
    call file%create(path, .false.)
    call file%new_column('/time', 's', file_real64, [integer ::], 3, time)
    call file%new_compressed_column('/field', 'm', file_real32, [3, n/3], [9, 1], field)
    call file%new_column('/place', 'm', file_real64, [3, 400], 8, place)
    call file%flush()
    too_large = 0
    grew = .false.
    inquire (file=path, size=before)
    do row = 1, rows
      capacity = bytes_for_change + time%bytes_for(1) + field%bytes_for(1) + place%bytes_for(1)
      noise = [(real(mod(sin(real(row*n + i, wp))*43758.5453_wp, 1.0_wp), sp), i=1, n)]
      call file%append(time, [1.0_wp*row])
      call file%append_block(field, [1, 1], [3, n/3], noise)
      call file%append(place, [(1.0_wp*i, i=1, 1200)])
      call file%flush()
      inquire (file=path, size=after)
      if (after > before + capacity) too_large = too_large + 1
      grew = grew .or. after > before + 50000
      before = after
    end do
    call file%close()
    call check_file('many rows are written', file)
    call check('rows that take more room than they asked for', too_large, 0)
    call check('some rows take much room', grew)
  end subroutine test_room

  !> Without room nothing is written but the last word, and the file stays whole.
  subroutine test_no_room()
    type(h5_file_t) :: file
    type(h5_column_t) :: time
    real(wp) :: x(2)
    integer(i8) :: before, after
    integer :: n

    if (.not. is_root()) return
    call remove(path)
    call file%create(path, .false.)
    call file%attribute('/', 'exit_status', -1)
    call file%new_column('/time', 's', file_real64, [integer ::], 3, time)
    call file%append_rows(time, 2, [1.0_wp, 2.0_wp])
    call file%flush()
    inquire (file=path, size=before)
    call limit_files(before + 100)
    call file%reserve(1000_i8)
    call limit_files(-1_i8)
    call check('no room is an error', file%info /= 0)
    call check('and named', index(file%message, path//': cannot write: ') == 1)
    inquire (file=path, size=after)
    call check('the file is as long as before', after == before)
    call file%append(time, [3.0_wp])
    call file%last_integer('/', 'exit_status', 4)
    call file%close()
    call file%open(path, .false., .false.)
    call file%read('/time', x)
    call file%read_attribute('/', 'exit_status', n)
    call file%close()
    call check_file('the file stays whole', file)
    call check('the last word is in it', n, 4)
  end subroutine test_no_room

  !> Let no file become longer; -1: as long as the system likes.
  subroutine limit_files(bytes)
    integer(i8), intent(in) :: bytes
    integer(c_int), parameter :: file_size = 1, too_large = 25   ! RLIMIT_FSIZE, SIGXFSZ
    type(c_funptr) :: before
    integer(c_long) :: limit(2)

    before = c_signal(too_large, transfer(1_i8, before))   ! ignored: the call fails instead
    if (c_getrlimit(file_size, limit) /= 0) error stop 'getrlimit'
    limit(1) = merge(limit(2), int(bytes, c_long), bytes < 0)
    if (c_setrlimit(file_size, limit) /= 0) error stop 'setrlimit'
  end subroutine limit_files

  !> A file that is there is not overwritten; what is done to a file that has been moved is not done
  !! to the one in its place.
  subroutine test_another_in_its_place()
    type(h5_file_t) :: file, other
    character(*), parameter :: kept = 'test_hdf5_kept.h5'
    integer(i8) :: before, after
    integer :: i

    if (.not. is_root()) return
    call remove(path)
    call file%create(path, .false.)
    call file%store('/a', 'm', [1.0_wp])
    call file%flush()
    if (c_rename(path//c_null_char, kept//c_null_char) /= 0) error stop 'rename'
    call other%create(path, .false.)
    call other%store('/b', 'm', [(1.0_wp*i, i=1, 5000)])
    call other%close()
    inquire (file=path, size=before)
    call file%reserve(10000_i8*100)
    call file%store('/c', 'm', [2.0_wp])
    call file%close()
    inquire (file=path, size=after)
    call check('the other file keeps its length', after == before)
    call file%create(path, .false.)
    call check('a file that is there is not overwritten', file%info /= 0)
    call file%abandon()
    call file%open(kept, .false., .false.)
    call check('the moved file has what was written', file%has('/c'))
    call file%close()
    call remove(path)
    call file%create(path, .false.)
    if (c_rename(kept//c_null_char, path//c_null_char) /= 0) error stop 'rename'
    call file%abandon()
    call file%open(path, .false., .false.)
    call check('nor is it deleted in place of the moved one', file%has('/a'))
    call file%close()
    call check_file('files are held, not named', file)
  end subroutine test_another_in_its_place

  subroutine test_trouble()
    type(h5_file_t) :: file
    integer :: unit
    real(wp) :: x(1)

    if (.not. is_root()) return
    call file%create('no/such/folder/run.h5', .false.)
    call check('a folder that is not there is an error', file%info /= 0)
    call check('the message names file and reason', index(file%message, &
      'no/such/folder/run.h5') == 1 &
               .and. index(file%message, 'No such file or directory') > 0)
    call file%store('/a', 'm', [1.0_wp])   ! after an error everything returns at once
    call file%flush()
    call file%close()
    open (newunit=unit, file=path, status='replace')
    write (unit, '(a)') 'this is no HDF5 file'
    close (unit)
    call file%open(path, .false., .false.)
    call check('a file of another kind is an error', file%info /= 0)
    call file%close()
    call remove(path)
    call file%create(path, .false.)
    call file%read('/series/time', x)
    call check('a missing dataset is named', file%info /= 0 .and. index(file%message, &
      '/series/time') > 0)
    call file%close()
  end subroutine test_trouble

end module test_hdf5_file_m
