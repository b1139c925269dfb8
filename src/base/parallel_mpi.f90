!> The parallel layer of a run on many processes, the only file that knows MPI.
!!
!! `parallel_serial.f90` holds the same module with the same names for one process; the Makefile
!! picks one of them. Only plain arrays pass through here.
module parallel_m
  use, intrinsic :: iso_c_binding, only: c_int, c_int8_t, c_ptr, c_f_pointer
  use, intrinsic :: iso_fortran_env, only: error_unit
  use mpi_f08, only: MPI_Init_thread, MPI_Finalize, MPI_Abort, MPI_Comm_size, MPI_Comm_rank
  use mpi_f08, only: MPI_Type_contiguous, MPI_Type_commit, MPI_Type_free, MPI_Op_create, MPI_Op_free
  use mpi_f08, only: MPI_Isend, MPI_Irecv, MPI_Waitall, MPI_Allreduce, MPI_Allgather
  use mpi_f08, only: MPI_Allgatherv, MPI_Bcast, MPI_Datatype, MPI_Op, MPI_Request, operator(==)
  use mpi_f08, only: MPI_COMM_WORLD, MPI_PROC_NULL, MPI_IN_PLACE, MPI_STATUSES_IGNORE
  use mpi_f08, only: MPI_Alloc_mem, MPI_Free_mem, MPI_ADDRESS_KIND
  use mpi_f08, only: MPI_DATATYPE_NULL, MPI_DOUBLE_PRECISION, MPI_REAL, MPI_INTEGER, MPI_INTEGER8
  use mpi_f08, only: MPI_INFO_NULL, MPI_Iallreduce, MPI_Test, MPI_Wtime, MPI_STATUS_IGNORE
  use mpi_f08, only: MPI_BYTE, MPI_CHARACTER, MPI_MAX, MPI_MIN, MPI_SUM, MPI_THREAD_FUNNELED
  use omp_lib, only: omp_get_max_threads, omp_set_num_threads
  use hdf5, only: h5pset_fapl_mpio_f, h5pset_dxpl_mpio_f, H5FD_MPIO_COLLECTIVE_F
  use kinds_m, only: wp, sp, i8
  use decomposition_m, only: best_pieces, last_cell, least_cells
  use exact_bins_m, only: bin_size, merge_bins
  use halo_copy_m, only: wrap_wp, wrap_sp, wrap_integer
  use halo_copy_m, only: pack_wp, pack_sp, pack_integer, unpack_wp, unpack_sp, unpack_integer
  implicit none
  private
  public :: parallel_init, parallel_final, parallel_abort, parallel_pause
  public :: is_root, nproc, my_rank, set_threads, get_threads
  public :: decompose, halo_exchange, gather_all
  public :: global_max, global_min, global_sum, global_sum_bins, broadcast
  public :: set_file_access, set_collective, share_trouble

  integer :: n_processes = 1, rank = 0
  integer :: neighbour(2, 3) = MPI_PROC_NULL  !! rank below and above in each direction
  logical :: wraps(3) = .false.   !! periodic and not cut
  type(MPI_Datatype) :: bins_type !! one set of bins of an order-free sum
  type(MPI_Op) :: bins_sum

  !> Memory of the layers going out and coming in, lower and upper side. MPI hands it out, so every
  !! kind of number may see it as its own and one set of messages serves them all; it only grows.
  type(c_ptr) :: going(2), coming(2)
  integer :: room = 0             !! of each [bytes]
  type(MPI_Request) :: request(4) !! two to receive, two to send

  !> Fill the halos of a block with `width` halo cells on every side.
  !!
  !! `halo_exchange(a, width, d)` fills those of direction d over the full extent of the other
  !! directions, so d = 1, 2, 3 in turn fill edges and corners too; without d that is done.
  !! Halos at sides of the domain that are not periodic stay as they are.
  interface halo_exchange
    procedure :: halo_wp_3, halo_wp_4, halo_sp_3, halo_integer_3
  end interface halo_exchange

  !> Blocks of all processes, without halos, put together on every process.
  interface gather_all
    procedure :: gather_wp, gather_sp
  end interface gather_all

  !> Give the value that the root process holds to all processes.
  interface broadcast
    procedure :: broadcast_character, broadcast_integer, broadcast_integers, broadcast_real
    procedure :: broadcast_reals
  end interface broadcast

  interface
    integer(c_int) function c_usleep(microseconds) bind(c, name='usleep')
      import :: c_int
      implicit none
      integer(c_int), value :: microseconds
    end function c_usleep
  end interface

contains

  !> Begin; call once, before anything else of this module.
  subroutine parallel_init()
    integer :: provided

    call MPI_Init_thread(MPI_THREAD_FUNNELED, provided)
    call MPI_Comm_size(MPI_COMM_WORLD, n_processes)
    call MPI_Comm_rank(MPI_COMM_WORLD, rank)
    call MPI_Type_contiguous(bin_size, MPI_INTEGER8, bins_type)
    call MPI_Type_commit(bins_type)
    call MPI_Op_create(add_bins, .true., bins_sum)
  end subroutine parallel_init

  !> End in good order; call once, at the end.
  subroutine parallel_final()
    call free_buffers()
    call MPI_Op_free(bins_sum)
    call MPI_Type_free(bins_type)
    call MPI_Finalize()
  end subroutine parallel_final

  !> End every process now with this exit code.
  subroutine parallel_abort(code)
    integer, intent(in) :: code

    call MPI_Abort(MPI_COMM_WORLD, code)
  end subroutine parallel_abort

  !> Let this process sleep.
  subroutine parallel_pause(seconds)
    real(wp), intent(in) :: seconds   !! [s]
    integer(c_int) :: info

    info = c_usleep(int(1.0e6_wp*seconds, c_int))
    if (info /= 0) return   ! woken by a signal: the pause is over
  end subroutine parallel_pause

  !> The one process that prints and writes single files.
  logical function is_root()
    is_root = rank == 0
  end function is_root

  !> Number of processes.
  integer function nproc()
    nproc = n_processes
  end function nproc

  !> Number of this process, from 0.
  integer function my_rank()
    my_rank = rank
  end function my_rank

  !> Let n threads do the loops of this process; n <= 0 means one when there are many processes,
  !! unless the environment variable OMP_NUM_THREADS says more.
  subroutine set_threads(n)
    integer, intent(in) :: n
    integer :: length

    call get_environment_variable('OMP_NUM_THREADS', length=length)
    if (n > 0) then
      call omp_set_num_threads(n)
    else if (n_processes > 1 .and. length == 0) then
      call omp_set_num_threads(1)
    end if
  end subroutine set_threads

  !> Threads per process.
  integer function get_threads()
    get_threads = omp_get_max_threads()
  end function get_threads

  !> Cut the domain of n cells into blocks, one for each process, z first, then y, x last.
  !!
  !! The cuts lie at multiples of a power of two of the cell index, so that coarser grids can be
  !! cut at the same places; every process gets at least `least_cells` in a direction that is cut.
  subroutine decompose(n, periodic, lo, hi, at_side)
    integer, intent(in) :: n(3)              !! cells of the domain
    logical, intent(in) :: periodic(3)
    integer, intent(out) :: lo(3), hi(3)     !! first and last cell of this process
    logical, intent(out) :: at_side(2, 3)    !! touches the lower, upper side
    integer :: pieces(3), place(3), d

    pieces = best_pieces(n, n_processes)
    if (product(pieces) /= n_processes) call no_room(n)
    place(1) = modulo(rank, pieces(1))
    place(2) = modulo(rank/pieces(1), pieces(2))
    place(3) = rank/(pieces(1)*pieces(2))
    do d = 1, 3
      lo(d) = last_cell(n(d), pieces(d), place(d)) + 1
      hi(d) = last_cell(n(d), pieces(d), place(d) + 1)
      neighbour(1, d) = rank_beside(place, pieces, periodic, d, -1)
      neighbour(2, d) = rank_beside(place, pieces, periodic, d, 1)
      wraps(d) = periodic(d) .and. pieces(d) == 1
    end do
    at_side(1, :) = place == 0
    at_side(2, :) = place == pieces - 1
  end subroutine decompose

  !> Say that there are too many processes and end them all.
  subroutine no_room(n)
    integer, intent(in) :: n(3)
    integer, parameter :: exit_input = 2

    if (rank == 0) write (error_unit, '(a, 2(i0, a), i0, a, i0, a, i0, a)') 'mics: ', n(1), ' x ', &
      n(2), ' x ', n(3), ' cells cannot be cut for ', n_processes, ' processes with at least ', &
      least_cells, ' cells in each direction that is cut; use fewer processes'
    if (rank > 0) call parallel_pause(1.0_wp)
    call parallel_abort(exit_input)
  end subroutine no_room

  !> Rank of the process one step away in direction d; itself or none where nothing is sent.
  pure function rank_beside(place, pieces, periodic, d, step) result(beside)
    integer, intent(in) :: place(3), pieces(3), d, step
    logical, intent(in) :: periodic(3)
    integer :: beside
    integer :: there(3)

    beside = MPI_PROC_NULL
    if (pieces(d) == 1) return
    there = place
    there(d) = place(d) + step
    if (periodic(d)) there(d) = modulo(there(d), pieces(d))
    if (there(d) < 0 .or. there(d) >= pieces(d)) return
    beside = there(1) + pieces(1)*(there(2) + pieces(2)*there(3))
  end function rank_beside

  !> Is direction e asked for? All are when d is not given.
  pure logical function chosen(e, d)
    integer, intent(in) :: e
    integer, intent(in), optional :: d

    chosen = .true.
    if (present(d)) chosen = d == e
  end function chosen

  subroutine halo_wp_3(a, width, d)
    real(wp), intent(inout), contiguous :: a(:, :, :)
    integer, intent(in) :: width
    integer, intent(in), optional :: d

    call fill_wp(a, [shape(a), 1], width, d)
  end subroutine halo_wp_3

  subroutine halo_wp_4(a, width, d)
    real(wp), intent(inout), contiguous :: a(:, :, :, :)
    integer, intent(in) :: width
    integer, intent(in), optional :: d

    call fill_wp(a, shape(a), width, d)
  end subroutine halo_wp_4

  subroutine halo_sp_3(a, width, d)
    real(sp), intent(inout), contiguous :: a(:, :, :)
    integer, intent(in) :: width
    integer, intent(in), optional :: d

    call fill_sp(a, [shape(a), 1], width, d)
  end subroutine halo_sp_3

  subroutine halo_integer_3(a, width, d)
    integer, intent(inout), contiguous :: a(:, :, :)
    integer, intent(in) :: width
    integer, intent(in), optional :: d

    call fill_integer(a, [shape(a), 1], width, d)
  end subroutine halo_integer_3

  !> Layers of the neighbours, or periodic images, into the halos of an array of up to four
  !! directions.
  subroutine fill_wp(a, extent, width, d)
    real(wp), intent(inout) :: a(*)
    integer, intent(in) :: extent(4), width
    integer, intent(in), optional :: d
    real(wp), pointer, contiguous :: layers(:)
    integer :: e, s, before, m, after, n, bytes

    do e = 1, 3
      if (.not. chosen(e, d)) cycle
      before = product(extent(:e - 1))
      m = extent(e)
      after = product(extent(e + 1:))
      n = before*width*after
      if (wraps(e)) call wrap_wp(a, before, m, after, width)
      if (all(neighbour(:, e) == MPI_PROC_NULL)) cycle
      if (m < 3*width) error stop 'halo_exchange: the block is thinner than its halo'
      bytes = n*storage_size(layers)/8
      call expect_layers(e, bytes)
      do s = 1, 2
        call c_f_pointer(going(s), layers, [n])
        call pack_wp(a, before, m, after, inner(s, m, width), width, layers)
        call send_layers(e, s, bytes)
      end do
      call MPI_Waitall(4, request, MPI_STATUSES_IGNORE)
      do s = 1, 2
        if (neighbour(s, e) == MPI_PROC_NULL) cycle
        call c_f_pointer(coming(s), layers, [n])
        call unpack_wp(layers, before, m, after, outer(s, m, width), width, a)
      end do
    end do
  end subroutine fill_wp

  subroutine fill_sp(a, extent, width, d)
    real(sp), intent(inout) :: a(*)
    integer, intent(in) :: extent(4), width
    integer, intent(in), optional :: d
    real(sp), pointer, contiguous :: layers(:)
    integer :: e, s, before, m, after, n, bytes

    do e = 1, 3
      if (.not. chosen(e, d)) cycle
      before = product(extent(:e - 1))
      m = extent(e)
      after = product(extent(e + 1:))
      n = before*width*after
      if (wraps(e)) call wrap_sp(a, before, m, after, width)
      if (all(neighbour(:, e) == MPI_PROC_NULL)) cycle
      if (m < 3*width) error stop 'halo_exchange: the block is thinner than its halo'
      bytes = n*storage_size(layers)/8
      call expect_layers(e, bytes)
      do s = 1, 2
        call c_f_pointer(going(s), layers, [n])
        call pack_sp(a, before, m, after, inner(s, m, width), width, layers)
        call send_layers(e, s, bytes)
      end do
      call MPI_Waitall(4, request, MPI_STATUSES_IGNORE)
      do s = 1, 2
        if (neighbour(s, e) == MPI_PROC_NULL) cycle
        call c_f_pointer(coming(s), layers, [n])
        call unpack_sp(layers, before, m, after, outer(s, m, width), width, a)
      end do
    end do
  end subroutine fill_sp

  subroutine fill_integer(a, extent, width, d)
    integer, intent(inout) :: a(*)
    integer, intent(in) :: extent(4), width
    integer, intent(in), optional :: d
    integer, pointer, contiguous :: layers(:)
    integer :: e, s, before, m, after, n, bytes

    do e = 1, 3
      if (.not. chosen(e, d)) cycle
      before = product(extent(:e - 1))
      m = extent(e)
      after = product(extent(e + 1:))
      n = before*width*after
      if (wraps(e)) call wrap_integer(a, before, m, after, width)
      if (all(neighbour(:, e) == MPI_PROC_NULL)) cycle
      if (m < 3*width) error stop 'halo_exchange: the block is thinner than its halo'
      bytes = n*storage_size(layers)/8
      call expect_layers(e, bytes)
      do s = 1, 2
        call c_f_pointer(going(s), layers, [n])
        call pack_integer(a, before, m, after, inner(s, m, width), width, layers)
        call send_layers(e, s, bytes)
      end do
      call MPI_Waitall(4, request, MPI_STATUSES_IGNORE)
      do s = 1, 2
        if (neighbour(s, e) == MPI_PROC_NULL) cycle
        call c_f_pointer(coming(s), layers, [n])
        call unpack_integer(layers, before, m, after, outer(s, m, width), width, a)
      end do
    end do
  end subroutine fill_integer

  !> Get ready for layers of so many bytes through the two sides of direction e.
  !!
  !! Message s leaves through side s (1 lower, 2 upper) and comes in through the other.
  subroutine expect_layers(e, n)
    integer, intent(in) :: e, n
    integer(c_int8_t), pointer, contiguous, asynchronous :: bytes(:)
    integer :: s

    call grow(n)
    do s = 1, 2
      call c_f_pointer(coming(s), bytes, [n])
      call MPI_Irecv(bytes, n, MPI_BYTE, neighbour(s, e), 3 - s, MPI_COMM_WORLD, request(s))
    end do
  end subroutine expect_layers

  !> Send the n bytes in `going(s)` through side s of direction e.
  subroutine send_layers(e, s, n)
    integer, intent(in) :: e, s, n
    integer(c_int8_t), pointer, contiguous, asynchronous :: bytes(:)

    call c_f_pointer(going(s), bytes, [n])
    call MPI_Isend(bytes, n, MPI_BYTE, neighbour(s, e), s, MPI_COMM_WORLD, request(2 + s))
  end subroutine send_layers

  !> Make room for n bytes in each buffer.
  subroutine grow(n)
    integer, intent(in) :: n
    integer :: s

    if (room >= n) return
    call free_buffers()
    room = 2*n
    do s = 1, 2
      call MPI_Alloc_mem(int(room, MPI_ADDRESS_KIND), MPI_INFO_NULL, going(s))
      call MPI_Alloc_mem(int(room, MPI_ADDRESS_KIND), MPI_INFO_NULL, coming(s))
    end do
  end subroutine grow

  subroutine free_buffers()
    integer(c_int8_t), pointer, contiguous, asynchronous :: bytes(:)
    integer :: s

    if (room == 0) return
    do s = 1, 2
      call c_f_pointer(going(s), bytes, [room])
      call MPI_Free_mem(bytes)
      call c_f_pointer(coming(s), bytes, [room])
      call MPI_Free_mem(bytes)
    end do
    room = 0
  end subroutine free_buffers

  !> First of the layers that side s sends.
  pure integer function inner(s, m, width)
    integer, intent(in) :: s, m, width

    inner = merge(width + 1, m - 2*width + 1, s == 1)
  end function inner

  !> First of the halo layers of side s.
  pure integer function outer(s, m, width)
    integer, intent(in) :: s, m, width

    outer = merge(1, m - width + 1, s == 1)
  end function outer

  subroutine gather_wp(local, lo, hi, whole)
    real(wp), intent(in), contiguous :: local(:, :, :)   !! cells lo:hi
    integer, intent(in) :: lo(3), hi(3)
    real(wp), intent(inout), contiguous :: whole(:, :, :)  !! all cells of the domain
    real(wp), allocatable :: cells(:)   !! block after block
    integer :: box(3, 2, n_processes), length(n_processes), start(n_processes), p, a(3), b(3)

    call gather_boxes(lo, hi, box, length, start)
    allocate (cells(size(whole)))
    call MPI_Allgatherv(local, size(local), MPI_DOUBLE_PRECISION, cells, length, &
      start, MPI_DOUBLE_PRECISION, MPI_COMM_WORLD)
    do p = 1, n_processes
      a = box(:, 1, p)
      b = box(:, 2, p)
      whole(a(1):b(1), a(2):b(2), a(3):b(3)) = &
        reshape(cells(start(p) + 1:start(p) + length(p)), b - a + 1)
    end do
  end subroutine gather_wp

  subroutine gather_sp(local, lo, hi, whole)
    real(sp), intent(in), contiguous :: local(:, :, :)   !! cells lo:hi
    integer, intent(in) :: lo(3), hi(3)
    real(sp), intent(inout), contiguous :: whole(:, :, :)  !! all cells of the domain
    real(sp), allocatable :: cells(:)   !! block after block
    integer :: box(3, 2, n_processes), length(n_processes), start(n_processes), p, a(3), b(3)

    call gather_boxes(lo, hi, box, length, start)
    allocate (cells(size(whole)))
    call MPI_Allgatherv(local, size(local), MPI_REAL, cells, length, start, MPI_REAL, &
      MPI_COMM_WORLD)
    do p = 1, n_processes
      a = box(:, 1, p)
      b = box(:, 2, p)
      whole(a(1):b(1), a(2):b(2), a(3):b(3)) = &
        reshape(cells(start(p) + 1:start(p) + length(p)), b - a + 1)
    end do
  end subroutine gather_sp

  !> Blocks of all processes, their number of cells and where each begins in a buffer (from 0).
  subroutine gather_boxes(lo, hi, box, length, start)
    integer, intent(in) :: lo(3), hi(3)
    integer, intent(out) :: box(:, :, :), length(:), start(:)
    integer :: mine(3, 2), p

    mine(:, 1) = lo
    mine(:, 2) = hi
    call MPI_Allgather(mine, 6, MPI_INTEGER, box, 6, MPI_INTEGER, MPI_COMM_WORLD)
    do p = 1, n_processes
      length(p) = product(box(:, 2, p) - box(:, 1, p) + 1)
      start(p) = sum(length(:p - 1))
    end do
  end subroutine gather_boxes

  !> Largest of the values of all processes, element by element, in place.
  subroutine global_max(x)
    real(wp), intent(inout), contiguous :: x(:)

    call MPI_Allreduce(MPI_IN_PLACE, x, size(x), MPI_DOUBLE_PRECISION, MPI_MAX, MPI_COMM_WORLD)
  end subroutine global_max

  !> Smallest of the values of all processes, element by element, in place.
  subroutine global_min(x)
    real(wp), intent(inout), contiguous :: x(:)

    call MPI_Allreduce(MPI_IN_PLACE, x, size(x), MPI_DOUBLE_PRECISION, MPI_MIN, MPI_COMM_WORLD)
  end subroutine global_min

  !> Sum over all processes of counts, element by element, in place.
  subroutine global_sum(n)
    integer(i8), intent(inout), contiguous :: n(:)

    call MPI_Allreduce(MPI_IN_PLACE, n, size(n), MPI_INTEGER8, MPI_SUM, MPI_COMM_WORLD)
  end subroutine global_sum

  !> Sum over all processes of the bins of several order-free sums, in place, in one message.
  subroutine global_sum_bins(bins)
    integer(i8), intent(inout), contiguous :: bins(:, :)   !! (bin_size, number of sums)

    call MPI_Allreduce(MPI_IN_PLACE, bins, size(bins, 2), bins_type, bins_sum, MPI_COMM_WORLD)
  end subroutine global_sum_bins

  !> The operation of `global_sum_bins`, in the form MPI asks for.
  subroutine add_bins(from, into, length, datatype)
    type(c_ptr), value :: from, into
    ! allow(C061)
    integer :: length
    ! allow(C061)
    type(MPI_Datatype) :: datatype
    integer(i8), pointer :: part(:, :), bins(:, :)
    integer :: m

    if (datatype == MPI_DATATYPE_NULL) return
    call c_f_pointer(from, part, [bin_size, length])
    call c_f_pointer(into, bins, [bin_size, length])
    do m = 1, length
      call merge_bins(part(:, m), bins(:, m))
    end do
  end subroutine add_bins

  subroutine broadcast_character(x)
    character(:), allocatable, intent(inout) :: x
    integer :: length

    length = 0
    if (rank == 0) length = len(x)
    call MPI_Bcast(length, 1, MPI_INTEGER, 0, MPI_COMM_WORLD)
    if (rank > 0) x = repeat(' ', length)
    call MPI_Bcast(x, length, MPI_CHARACTER, 0, MPI_COMM_WORLD)
  end subroutine broadcast_character

  subroutine broadcast_integer(x)
    integer, intent(inout) :: x

    call MPI_Bcast(x, 1, MPI_INTEGER, 0, MPI_COMM_WORLD)
  end subroutine broadcast_integer

  subroutine broadcast_integers(x)
    integer, intent(inout), contiguous :: x(:)

    call MPI_Bcast(x, size(x), MPI_INTEGER, 0, MPI_COMM_WORLD)
  end subroutine broadcast_integers

  subroutine broadcast_real(x)
    real(wp), intent(inout) :: x

    call MPI_Bcast(x, 1, MPI_DOUBLE_PRECISION, 0, MPI_COMM_WORLD)
  end subroutine broadcast_real

  subroutine broadcast_reals(x)
    real(wp), intent(inout), contiguous :: x(:)

    call MPI_Bcast(x, size(x), MPI_DOUBLE_PRECISION, 0, MPI_COMM_WORLD)
  end subroutine broadcast_reals

  !> Let all processes open a file together: property list of its access, as an HDF5 identifier.
  subroutine set_file_access(access, status)
    integer(i8), intent(in) :: access
    integer, intent(out) :: status   !! < 0: failed

    call h5pset_fapl_mpio_f(access, MPI_COMM_WORLD%MPI_VAL, MPI_INFO_NULL%MPI_VAL, status)
  end subroutine set_file_access

  !> Let all processes write a dataset together: property list of the transfer.
  subroutine set_collective(transfer, status)
    integer(i8), intent(in) :: transfer
    integer, intent(out) :: status   !! < 0: failed

    call h5pset_dxpl_mpio_f(transfer, H5FD_MPIO_COLLECTIVE_F, status)
  end subroutine set_collective

  !> Does any process have trouble? One that has waits for the others only as long as its patience
  !! lasts, for they may be held up by the very trouble.
  subroutine share_trouble(patience, trouble, answered)
    real(wp), intent(in) :: patience      !! [s]
    logical, intent(inout) :: trouble     !! of this process; then of any
    logical, intent(out) :: answered      !! all have told
    integer, asynchronous :: worst(1)
    type(MPI_Request) :: request
    real(wp) :: began, waited

    worst = merge(1, 0, trouble)
    began = MPI_Wtime()
    call MPI_Iallreduce(MPI_IN_PLACE, worst, 1, MPI_INTEGER, MPI_MAX, MPI_COMM_WORLD, request)
    do
      call MPI_Test(request, answered, MPI_STATUS_IGNORE)
      if (answered) exit
      waited = MPI_Wtime() - began
      if (trouble .and. waited > patience) return
    end do
    trouble = worst(1) > 0
  end subroutine share_trouble

end module parallel_m
