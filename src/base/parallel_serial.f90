!> The parallel layer of a run on one process: nothing to send, periodic halos wrap.
!!
!! `parallel_mpi.f90` holds the same module with the same names for many processes; the Makefile
!! picks one of them. Only plain arrays pass through here.
module parallel_m
  use, intrinsic :: iso_c_binding, only: c_int
  use omp_lib, only: omp_get_max_threads, omp_set_num_threads
  use kinds_m, only: wp, sp, i8
  use halo_copy_m, only: wrap_wp, wrap_sp, wrap_integer
  implicit none
  private
  public :: parallel_init, parallel_final, parallel_abort, parallel_pause
  public :: is_root, nproc, my_rank, set_threads, get_threads
  public :: decompose, halo_exchange, gather_all
  public :: global_max, global_min, global_sum, global_sum_bins, broadcast
  public :: set_file_access, set_collective, share_trouble

  logical :: wraps(3) = .false.   !! periodic directions of the last `decompose`

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
    subroutine c_exit(code) bind(c, name='exit')
      import :: c_int
      implicit none
      integer(c_int), value :: code
    end subroutine c_exit

    integer(c_int) function c_usleep(microseconds) bind(c, name='usleep')
      import :: c_int
      implicit none
      integer(c_int), value :: microseconds
    end function c_usleep
  end interface

contains

  !> Begin; call once, before anything else of this module.
  subroutine parallel_init()
    wraps = .false.
  end subroutine parallel_init

  !> End in good order; call once, at the end.
  subroutine parallel_final()
    wraps = .false.
  end subroutine parallel_final

  !> End every process now with this exit code.
  subroutine parallel_abort(code)
    integer, intent(in) :: code

    call c_exit(int(code, c_int))
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
    is_root = .true.
  end function is_root

  !> Number of processes.
  integer function nproc()
    nproc = 1
  end function nproc

  !> Number of this process, from 0.
  integer function my_rank()
    my_rank = 0
  end function my_rank

  !> Let n threads do the loops of this process; n <= 0 leaves the choice to the system.
  subroutine set_threads(n)
    integer, intent(in) :: n

    if (n > 0) call omp_set_num_threads(n)
  end subroutine set_threads

  !> Threads per process.
  integer function get_threads()
    get_threads = omp_get_max_threads()
  end function get_threads

  !> Cut the domain of n cells into blocks; here one block holds it all.
  subroutine decompose(n, periodic, lo, hi, at_side)
    integer, intent(in) :: n(3)              !! cells of the domain
    logical, intent(in) :: periodic(3)
    integer, intent(out) :: lo(3), hi(3)     !! first and last cell of this process
    logical, intent(out) :: at_side(2, 3)    !! touches the lower, upper side

    wraps = periodic
    lo = 1
    hi = n
    at_side = .true.
  end subroutine decompose

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

  !> Periodic images into the halos of an array of up to four directions.
  subroutine fill_wp(a, extent, width, d)
    real(wp), intent(inout) :: a(*)
    integer, intent(in) :: extent(4), width
    integer, intent(in), optional :: d
    integer :: e

    do e = 1, 3
      if (.not. (wraps(e) .and. chosen(e, d))) cycle
      call wrap_wp(a, product(extent(:e - 1)), extent(e), product(extent(e + 1:)), width)
    end do
  end subroutine fill_wp

  subroutine fill_sp(a, extent, width, d)
    real(sp), intent(inout) :: a(*)
    integer, intent(in) :: extent(4), width
    integer, intent(in), optional :: d
    integer :: e

    do e = 1, 3
      if (.not. (wraps(e) .and. chosen(e, d))) cycle
      call wrap_sp(a, product(extent(:e - 1)), extent(e), product(extent(e + 1:)), width)
    end do
  end subroutine fill_sp

  subroutine fill_integer(a, extent, width, d)
    integer, intent(inout) :: a(*)
    integer, intent(in) :: extent(4), width
    integer, intent(in), optional :: d
    integer :: e

    do e = 1, 3
      if (.not. (wraps(e) .and. chosen(e, d))) cycle
      call wrap_integer(a, product(extent(:e - 1)), extent(e), product(extent(e + 1:)), width)
    end do
  end subroutine fill_integer

  subroutine gather_wp(local, lo, hi, whole)
    real(wp), intent(in), contiguous :: local(:, :, :)   !! cells lo:hi
    integer, intent(in) :: lo(3), hi(3)
    real(wp), intent(inout), contiguous :: whole(:, :, :)  !! all cells of the domain

    whole(lo(1):hi(1), lo(2):hi(2), lo(3):hi(3)) = local
  end subroutine gather_wp

  subroutine gather_sp(local, lo, hi, whole)
    real(sp), intent(in), contiguous :: local(:, :, :)   !! cells lo:hi
    integer, intent(in) :: lo(3), hi(3)
    real(sp), intent(inout), contiguous :: whole(:, :, :)  !! all cells of the domain

    whole(lo(1):hi(1), lo(2):hi(2), lo(3):hi(3)) = local
  end subroutine gather_sp

  !> Largest of the values of all processes, element by element, in place.
  subroutine global_max(x)
    real(wp), intent(inout), contiguous :: x(:)

    x = x   ! the only process holds the result
  end subroutine global_max

  !> Smallest of the values of all processes, element by element, in place.
  subroutine global_min(x)
    real(wp), intent(inout), contiguous :: x(:)

    x = x   ! the only process holds the result
  end subroutine global_min

  !> Sum over all processes of counts, element by element, in place.
  subroutine global_sum(n)
    integer(i8), intent(inout), contiguous :: n(:)

    n = n   ! the only process holds the result
  end subroutine global_sum

  !> Sum over all processes of the bins of several order-free sums, in place, in one message.
  subroutine global_sum_bins(bins)
    integer(i8), intent(inout), contiguous :: bins(:, :)   !! (bin_size, number of sums)

    bins = bins   ! the only process holds the result
  end subroutine global_sum_bins

  subroutine broadcast_character(x)
    character(:), allocatable, intent(inout) :: x

    x = x
  end subroutine broadcast_character

  subroutine broadcast_integer(x)
    integer, intent(inout) :: x

    x = x
  end subroutine broadcast_integer

  subroutine broadcast_integers(x)
    integer, intent(inout), contiguous :: x(:)

    x = x
  end subroutine broadcast_integers

  subroutine broadcast_real(x)
    real(wp), intent(inout) :: x

    x = x
  end subroutine broadcast_real

  subroutine broadcast_reals(x)
    real(wp), intent(inout), contiguous :: x(:)

    x = x
  end subroutine broadcast_reals

  !> Let all processes open a file together: property list of its access, as an HDF5 identifier.
  subroutine set_file_access(access, status)
    integer(i8), intent(in) :: access
    integer, intent(out) :: status   !! < 0: failed

    status = merge(0, -1, access >= 0)   ! one process opens files as ever
  end subroutine set_file_access

  !> Let all processes write a dataset together: property list of the transfer.
  subroutine set_collective(transfer, status)
    integer(i8), intent(in) :: transfer
    integer, intent(out) :: status   !! < 0: failed

    status = merge(0, -1, transfer >= 0)   ! one process writes as ever
  end subroutine set_collective

  !> Does any process have trouble? One that has waits for the others only as long as its patience
  !! lasts, for they may be held up by the very trouble.
  subroutine share_trouble(patience, trouble, answered)
    real(wp), intent(in) :: patience      !! [s]
    logical, intent(inout) :: trouble     !! of this process; then of any
    logical, intent(out) :: answered      !! all have told

    answered = patience >= 0.0_wp .or. .not. trouble   ! the only process has told
  end subroutine share_trouble

end module parallel_m
