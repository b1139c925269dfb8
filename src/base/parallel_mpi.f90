!> The parallel layer of a run on many processes, the only file that knows MPI.
submodule (parallel_m) parallel_mpi_m
  use, intrinsic :: iso_c_binding, only: c_ptr, c_f_pointer, c_null_char
  use, intrinsic :: iso_fortran_env, only: error_unit
  use mpi_f08, only: MPI_Init_thread, MPI_Finalize, MPI_Abort, MPI_Comm_size, MPI_Comm_rank
  use mpi_f08, only: MPI_Type_contiguous, MPI_Type_commit, MPI_Type_free, MPI_Op_create, MPI_Op_free
  use mpi_f08, only: MPI_Isend, MPI_Irecv, MPI_Waitall, MPI_Allreduce, MPI_Allgather
  use mpi_f08, only: MPI_Allgatherv, MPI_Bcast, MPI_Datatype, MPI_Op, MPI_Request
  use mpi_f08, only: MPI_COMM_WORLD, MPI_PROC_NULL, MPI_IN_PLACE, MPI_STATUSES_IGNORE
  use mpi_f08, only: MPI_Type_create_subarray, MPI_ORDER_FORTRAN
  use mpi_f08, only: MPI_DATATYPE_NULL, MPI_DOUBLE_PRECISION, MPI_REAL, MPI_INTEGER, MPI_INTEGER8
  use mpi_f08, only: MPI_INFO_NULL
  use mpi_f08, only: MPI_CHARACTER, MPI_LOGICAL, MPI_MAX, MPI_SUM, MPI_THREAD_FUNNELED
  use hdf5, only: h5pset_fapl_mpio_f, h5pset_dxpl_mpio_f, H5FD_MPIO_COLLECTIVE_F
  use c_library_m, only: c_setenv
  use decomposition_m, only: best_pieces, last_cell, min_cells
  use exact_accumulator_m, only: accumulator_size, merge_accumulators
  use halo_copy_m, only: wrap_wp, wrap_sp, wrap_integer
  implicit none

  integer :: n_processes = 1, rank = 0
  integer :: neighbour(2, 3) = MPI_PROC_NULL  !! rank below and above in each direction
  logical :: wraps(3) = .false.   !! periodic and not cut
  type(MPI_Datatype) :: accumulator_type !! an accumulator of an order-free sum
  type(MPI_Op) :: accumulator_sum

  !> Layers of arrays of one form that processes exchange.
  type :: layers_t
    integer :: key(8) = 0            !! all that they depend on
    type(MPI_Datatype) :: part(2, 2)
  end type layers_t
  type(layers_t) :: known(256)
  integer :: n_known = 0   !! so far, those that had to go included

contains

  module procedure parallel_init
    integer :: provided
    integer(c_int) :: status

    ! A process that waits gives its core away, unless the user has it otherwise: with more
    ! processes than cores Open MPI else waits for those that it keeps from running.
    status = c_setenv('OMPI_MCA_mpi_yield_when_idle'//c_null_char, '1'//c_null_char, 0_c_int)
    call MPI_Init_thread(MPI_THREAD_FUNNELED, provided)
    call MPI_Comm_size(MPI_COMM_WORLD, n_processes)
    call MPI_Comm_rank(MPI_COMM_WORLD, rank)
    call MPI_Type_contiguous(accumulator_size, MPI_INTEGER8, accumulator_type)
    call MPI_Type_commit(accumulator_type)
    call MPI_Op_create(add_accumulators, .true., accumulator_sum)
  end procedure parallel_init

  module procedure parallel_final
    call MPI_Op_free(accumulator_sum)
    call MPI_Type_free(accumulator_type)
    call MPI_Finalize()
  end procedure parallel_final

  module procedure parallel_abort
    call MPI_Abort(MPI_COMM_WORLD, code)
  end procedure parallel_abort

  module procedure is_root
    is_root = rank == 0
  end procedure is_root

  module procedure nproc
    nproc = n_processes
  end procedure nproc

  module procedure my_rank
    my_rank = rank
  end procedure my_rank

  !> The blocks are cut z first, then y, x last.
  !!
  !! The cuts lie at multiples of a power of two of the cell index, so that coarser grids can be
  !! cut at the same places; every process gets at least `min_cells` in a direction that is cut.
  module procedure decompose
    integer, parameter :: exit_input = 2
    integer :: pieces(3), place(3), d

    pieces = best_pieces(n, n_processes)
    if (product(pieces) /= n_processes) then
      if (rank == 0) write (error_unit, '(a, 2(i0, a), i0, a, i0, a, i0, a)') 'mics: ', n(1), &
        ' x ', n(2), ' x ', n(3), ' cells cannot be cut for ', n_processes, &
        ' processes with at least ', min_cells, &
        ' cells in each direction that is cut; use fewer processes'
      if (rank > 0) call parallel_pause(1.0_wp)
      call parallel_abort(exit_input)
    end if
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
  end procedure decompose

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

  module procedure fill_wp
    type(MPI_Datatype) :: part(2, 2)
    type(MPI_Request) :: request(4)
    integer :: e, s

    do e = 1, 3
      if (.not. chosen(e)) cycle
      if (wraps(e)) call wrap_wp(a, product(extent(:e - 1)), extent(e), &
                                 product(extent(e + 1:)), width)
      if (all(neighbour(:, e) == MPI_PROC_NULL)) cycle
      call find_parts(extent, width, layers, e, MPI_DOUBLE_PRECISION, part)
      do s = 1, 2
        call MPI_Irecv(a, 1, part(2, s), neighbour(s, e), 3 - s, MPI_COMM_WORLD, request(s))
        call MPI_Isend(a, 1, part(1, s), neighbour(s, e), s, MPI_COMM_WORLD, request(2 + s))
      end do
      call MPI_Waitall(4, request, MPI_STATUSES_IGNORE)
    end do
  end procedure fill_wp

  module procedure fill_sp
    type(MPI_Datatype) :: part(2, 2)
    type(MPI_Request) :: request(4)
    integer :: e, s

    do e = 1, 3
      if (.not. chosen(e)) cycle
      if (wraps(e)) call wrap_sp(a, product(extent(:e - 1)), extent(e), &
                                 product(extent(e + 1:)), width)
      if (all(neighbour(:, e) == MPI_PROC_NULL)) cycle
      call find_parts(extent, width, layers, e, MPI_REAL, part)
      do s = 1, 2
        call MPI_Irecv(a, 1, part(2, s), neighbour(s, e), 3 - s, MPI_COMM_WORLD, request(s))
        call MPI_Isend(a, 1, part(1, s), neighbour(s, e), s, MPI_COMM_WORLD, request(2 + s))
      end do
      call MPI_Waitall(4, request, MPI_STATUSES_IGNORE)
    end do
  end procedure fill_sp

  module procedure fill_integer
    type(MPI_Datatype) :: part(2, 2)
    type(MPI_Request) :: request(4)
    integer :: e, s

    do e = 1, 3
      if (.not. chosen(e)) cycle
      if (wraps(e)) call wrap_integer(a, product(extent(:e - 1)), extent(e), &
                                 product(extent(e + 1:)), width)
      if (all(neighbour(:, e) == MPI_PROC_NULL)) cycle
      call find_parts(extent, width, layers, e, MPI_INTEGER, part)
      do s = 1, 2
        call MPI_Irecv(a, 1, part(2, s), neighbour(s, e), 3 - s, MPI_COMM_WORLD, request(s))
        call MPI_Isend(a, 1, part(1, s), neighbour(s, e), s, MPI_COMM_WORLD, request(2 + s))
      end do
      call MPI_Waitall(4, request, MPI_STATUSES_IGNORE)
    end do
  end procedure fill_integer

  !> Layers that pass through the two sides of direction e: all of the block in the other
  !! directions, with as many layers of its halos. Message s leaves through side s (1 lower, 2
  !! upper) and comes in through the other. MPI takes longer to describe layers than to send them,
  !! so they are kept.
  subroutine find_parts(extent, width, layers, e, element, part)
    integer, intent(in) :: extent(4), width, layers, e
    type(MPI_Datatype), intent(in) :: element
    type(MPI_Datatype), intent(out) :: part(2, 2)   !! sent, received; at the lower, upper side
    integer :: key(8), box(4), first(4), start(2, 2), n, i, s

    key = [extent, width, layers, e, element%MPI_VAL]
    do n = 1, min(n_known, size(known))
      if (any(known(n)%key /= key)) cycle
      part = known(n)%part
      return
    end do
    if (extent(e) < 3*width) error stop 'halo_exchange: the block is thinner than its halo'
    box = [extent(:3) - 2*(width - layers), extent(4)]
    box(e) = layers
    first = [width - layers + [0, 0, 0], 0]   ! counted from 0
    start(:, 1) = [width, width - layers]
    start(:, 2) = [extent(e) - width - layers, extent(e) - width]
    n = 1 + modulo(n_known, size(known))   ! when all are in use the oldest goes
    do s = 1, 2
      do i = 1, 2
        first(e) = start(i, s)
        if (n_known >= size(known)) call MPI_Type_free(known(n)%part(i, s))
        call MPI_Type_create_subarray(4, extent, box, first, MPI_ORDER_FORTRAN, element, part(i, s))
        call MPI_Type_commit(part(i, s))
      end do
    end do
    known(n)%key = key
    known(n)%part = part
    n_known = n_known + 1
  end subroutine find_parts

  module procedure gather_wp
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
  end procedure gather_wp

  module procedure gather_sp
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
  end procedure gather_sp

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

  module procedure global_max
    call MPI_Allreduce(MPI_IN_PLACE, x, size(x), MPI_DOUBLE_PRECISION, MPI_MAX, MPI_COMM_WORLD)
  end procedure global_max

  module procedure global_sum
    call MPI_Allreduce(MPI_IN_PLACE, n, size(n), MPI_INTEGER8, MPI_SUM, MPI_COMM_WORLD)
  end procedure global_sum

  module procedure global_sum_accumulators
    call MPI_Allreduce(MPI_IN_PLACE, accumulator, size(accumulator, 2), accumulator_type, &
                       accumulator_sum, MPI_COMM_WORLD)
  end procedure global_sum_accumulators

  !> The operation of `global_sum_accumulators`, in the form MPI asks for.
  subroutine add_accumulators(from, into, length, datatype)
    type(c_ptr), value :: from, into
    ! allow(C061)
    integer :: length
    ! allow(C061)
    type(MPI_Datatype) :: datatype
    integer(i8), pointer :: part(:, :), accumulator(:, :)
    integer :: m

    if (datatype%MPI_VAL == MPI_DATATYPE_NULL%MPI_VAL) return
    call c_f_pointer(from, part, [accumulator_size, length])
    call c_f_pointer(into, accumulator, [accumulator_size, length])
    do m = 1, length
      call merge_accumulators(part(:, m), accumulator(:, m))
    end do
  end subroutine add_accumulators

  module procedure broadcast_character
    integer :: length

    length = 0
    if (rank == 0) length = len(x)
    call MPI_Bcast(length, 1, MPI_INTEGER, 0, MPI_COMM_WORLD)
    if (rank > 0) x = repeat(' ', length)
    call MPI_Bcast(x, length, MPI_CHARACTER, 0, MPI_COMM_WORLD)
  end procedure broadcast_character

  module procedure broadcast_integer
    call MPI_Bcast(x, 1, MPI_INTEGER, 0, MPI_COMM_WORLD)
  end procedure broadcast_integer

  module procedure broadcast_logical
    call MPI_Bcast(x, 1, MPI_LOGICAL, 0, MPI_COMM_WORLD)
  end procedure broadcast_logical

  module procedure set_file_access
    call h5pset_fapl_mpio_f(access, MPI_COMM_WORLD%MPI_VAL, MPI_INFO_NULL%MPI_VAL, status)
  end procedure set_file_access

  module procedure set_collective
    call h5pset_dxpl_mpio_f(transfer, H5FD_MPIO_COLLECTIVE_F, status)
  end procedure set_collective

end submodule parallel_mpi_m
