!> The parallel layer, all that the rest of the program knows of other processes.
!!
!! What depends on them is in two submodules, `parallel_serial.f90` for one process and
!! `parallel_mpi.f90` for many; the Makefile links one of them. Only plain arrays pass through here.
module parallel_m
  use, intrinsic :: iso_c_binding, only: c_int
  use omp_lib, only: omp_get_max_threads, omp_set_num_threads
  use kinds_m, only: wp, sp, i8
  use c_library_m, only: c_usleep
  implicit none
  private
  public :: parallel_init, parallel_final, parallel_abort, parallel_pause
  public :: is_root, nproc, my_rank, set_threads, get_threads, spins_for_long
  public :: decompose, halo_exchange, gather_all
  public :: global_max, global_sum, global_sum_accumulators, broadcast
  public :: set_file_access, set_collective

  !> Fill the halos of a block with `width` halo cells on every side.
  !!
  !! `halo_exchange(a, width, d)` fills those of direction d over the full extent of the other
  !! directions, so d = 1, 2, 3 in turn fill edges and corners too; without d that is done.
  !! Halos at sides of the domain that are not periodic stay as they are.
  !!
  !! With `layers` less than the width only so many layers beside the block are filled, edges and
  !! corners of that width too: for who reads no others. Those beyond may then hold anything.
  interface halo_exchange
    procedure :: halo_wp_3, halo_wp_4, halo_sp_3, halo_integer_3
  end interface halo_exchange

  !> Blocks of all processes, without halos, put together on every process.
  interface gather_all
    module subroutine gather_wp(local, lo, hi, whole)
      real(wp), intent(in), contiguous :: local(:, :, :)     !! cells lo:hi
      integer, intent(in) :: lo(3), hi(3)
      real(wp), intent(inout), contiguous :: whole(:, :, :)  !! all cells of the domain
    end subroutine gather_wp

    module subroutine gather_sp(local, lo, hi, whole)
      real(sp), intent(in), contiguous :: local(:, :, :)     !! cells lo:hi
      integer, intent(in) :: lo(3), hi(3)
      real(sp), intent(inout), contiguous :: whole(:, :, :)  !! all cells of the domain
    end subroutine gather_sp
  end interface gather_all

  !> Give the value that the root process holds to all processes.
  interface broadcast
    module subroutine broadcast_character(x)
      character(:), allocatable, intent(inout) :: x
    end subroutine broadcast_character

    module subroutine broadcast_integer(x)
      integer, intent(inout) :: x
    end subroutine broadcast_integer

    module subroutine broadcast_logical(x)
      logical, intent(inout) :: x
    end subroutine broadcast_logical
  end interface broadcast

  interface
    !> Begin; call once, before anything else of this module.
    module subroutine parallel_init()
    end subroutine parallel_init

    !> End in good order; call once, at the end.
    module subroutine parallel_final()
    end subroutine parallel_final

    !> End every process now with this exit code.
    module subroutine parallel_abort(code)
      integer, intent(in) :: code
    end subroutine parallel_abort

    !> The one process that prints and writes single files.
    pure module logical function is_root()
    end function is_root

    !> Number of processes.
    pure module integer function nproc()
    end function nproc

    !> Number of this process, from 0.
    pure module integer function my_rank()
    end function my_rank

    !> Cut the domain of n cells into blocks, one for each process.
    module subroutine decompose(n, periodic, lo, hi, at_side)
      integer, intent(in) :: n(3)              !! cells of the domain
      logical, intent(in) :: periodic(3)
      integer, intent(out) :: lo(3), hi(3)     !! first and last cell of this process
      logical, intent(out) :: at_side(2, 3)    !! touches the lower, upper side
    end subroutine decompose

    !> Layers of the neighbours, or periodic images, into the halos of an array of up to four
    !! directions.
    module subroutine fill_wp(a, extent, width, layers, chosen)
      integer, intent(in) :: extent(4), width, layers
      real(wp), intent(inout), asynchronous :: a(extent(1), extent(2), extent(3), extent(4))
      logical, intent(in) :: chosen(3)   !! directions to fill
    end subroutine fill_wp

    module subroutine fill_sp(a, extent, width, layers, chosen)
      integer, intent(in) :: extent(4), width, layers
      real(sp), intent(inout), asynchronous :: a(extent(1), extent(2), extent(3), extent(4))
      logical, intent(in) :: chosen(3)
    end subroutine fill_sp

    module subroutine fill_integer(a, extent, width, layers, chosen)
      integer, intent(in) :: extent(4), width, layers
      integer, intent(inout), asynchronous :: a(extent(1), extent(2), extent(3), extent(4))
      logical, intent(in) :: chosen(3)
    end subroutine fill_integer

    !> Largest of the values of all processes, element by element, in place.
    module subroutine global_max(x)
      real(wp), intent(inout), contiguous :: x(:)
    end subroutine global_max

    !> Sum over all processes of counts, element by element, in place.
    module subroutine global_sum(n)
      integer(i8), intent(inout), contiguous :: n(:)
    end subroutine global_sum

    !> Sum over all processes of the accumulators of several order-free sums, in place, in one
    !! message.
    module subroutine global_sum_accumulators(accumulator)
      integer(i8), intent(inout), contiguous :: accumulator(:, :)   !! (accumulator_size, sums)
    end subroutine global_sum_accumulators

    !> Let all processes open a file together: property list of its access, as an HDF5 identifier.
    module subroutine set_file_access(access, status)
      integer(i8), intent(in) :: access
      integer, intent(out) :: status   !! < 0: failed
    end subroutine set_file_access

    !> Let all processes write a dataset together: property list of the transfer.
    module subroutine set_collective(transfer, status)
      integer(i8), intent(in) :: transfer
      integer, intent(out) :: status   !! < 0: failed
    end subroutine set_collective
  end interface

contains

  !> Let this process sleep.
  subroutine parallel_pause(seconds)
    real(wp), intent(in) :: seconds   !! [s]
    integer(c_int) :: info

    info = c_usleep(int(1.0e6_wp*seconds, c_int))
    if (info /= 0) return   ! woken by a signal: the pause is over
  end subroutine parallel_pause

  !> Let n threads do the loops of this process; n <= 0 means one when there are many processes,
  !! unless the environment variable OMP_NUM_THREADS says more, and else what the system chooses.
  subroutine set_threads(n)
    integer, intent(in) :: n
    integer :: length

    call get_environment_variable('OMP_NUM_THREADS', length=length)
    if (n > 0) then
      call omp_set_num_threads(n)
    else if (nproc() > 1 .and. length == 0) then
      call omp_set_num_threads(1)
    end if
  end subroutine set_threads

  !> Threads per process.
  integer function get_threads()
    get_threads = omp_get_max_threads()
  end function get_threads

  !> Do threads of this process wait as the OpenMP library likes, which is a spin of 15 ms with
  !! libgomp? The environment alone can change that (docs/performance.md).
  logical function spins_for_long()
    integer :: policy, count

    call get_environment_variable('OMP_WAIT_POLICY', status=policy)
    call get_environment_variable('GOMP_SPINCOUNT', status=count)
    spins_for_long = get_threads() > 1 .and. policy /= 0 .and. count /= 0
  end function spins_for_long

  !> Is direction 1, 2, 3 asked for? All are when d is not given.
  pure function asked_for(d) result(chosen)
    integer, intent(in), optional :: d
    logical :: chosen(3)

    chosen = .true.
    if (present(d)) chosen = [1, 2, 3] == d
  end function asked_for

  !> Layers of a halo that are filled: all, unless fewer are asked for.
  pure integer function asked_layers(width, layers)
    integer, intent(in) :: width
    integer, intent(in), optional :: layers

    asked_layers = width
    if (present(layers)) asked_layers = min(layers, width)
  end function asked_layers

  subroutine halo_wp_3(a, width, d, layers)
    real(wp), intent(inout), contiguous :: a(:, :, :)
    integer, intent(in) :: width
    integer, intent(in), optional :: d, layers

    call fill_wp(a, [shape(a), 1], width, asked_layers(width, layers), asked_for(d))
  end subroutine halo_wp_3

  subroutine halo_wp_4(a, width, d, layers)
    real(wp), intent(inout), contiguous :: a(:, :, :, :)
    integer, intent(in) :: width
    integer, intent(in), optional :: d, layers

    call fill_wp(a, shape(a), width, asked_layers(width, layers), asked_for(d))
  end subroutine halo_wp_4

  subroutine halo_sp_3(a, width, d)
    real(sp), intent(inout), contiguous :: a(:, :, :)
    integer, intent(in) :: width
    integer, intent(in), optional :: d

    call fill_sp(a, [shape(a), 1], width, width, asked_for(d))
  end subroutine halo_sp_3

  subroutine halo_integer_3(a, width, d, layers)
    integer, intent(inout), contiguous :: a(:, :, :)
    integer, intent(in) :: width
    integer, intent(in), optional :: d, layers

    call fill_integer(a, [shape(a), 1], width, asked_layers(width, layers), asked_for(d))
  end subroutine halo_integer_3

end module parallel_m
