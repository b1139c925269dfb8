!> The parallel layer of a run on one process: nothing to send, periodic halos wrap.
submodule (parallel_m) parallel_serial_m
  use c_library_m, only: c_exit
  use halo_copy_m, only: wrap_wp, wrap_sp, wrap_integer
  implicit none

  logical :: wraps(3) = .false.   !! periodic directions of the last `decompose`

contains

  module procedure parallel_init
    wraps = .false.
  end procedure parallel_init

  module procedure parallel_final
    wraps = .false.
  end procedure parallel_final

  module procedure parallel_abort
    call c_exit(int(code, c_int))
  end procedure parallel_abort

  module procedure is_root
    is_root = .true.
  end procedure is_root

  module procedure nproc
    nproc = 1
  end procedure nproc

  module procedure my_rank
    my_rank = 0
  end procedure my_rank

  module procedure decompose
    wraps = periodic
    lo = 1
    hi = n
    at_side = .true.
  end procedure decompose

  module procedure fill_wp
    integer :: e

    do e = 1, 3
      if (.not. (chosen(e) .and. wraps(e) .and. layers > 0)) cycle
      call wrap_wp(a, product(extent(:e - 1)), extent(e), product(extent(e + 1:)), width)
    end do
  end procedure fill_wp

  module procedure fill_sp
    integer :: e

    do e = 1, 3
      if (.not. (chosen(e) .and. wraps(e) .and. layers > 0)) cycle
      call wrap_sp(a, product(extent(:e - 1)), extent(e), product(extent(e + 1:)), width)
    end do
  end procedure fill_sp

  module procedure fill_integer
    integer :: e

    do e = 1, 3
      if (.not. (chosen(e) .and. wraps(e) .and. layers > 0)) cycle
      call wrap_integer(a, product(extent(:e - 1)), extent(e), product(extent(e + 1:)), width)
    end do
  end procedure fill_integer

  module procedure gather_wp
    whole(lo(1):hi(1), lo(2):hi(2), lo(3):hi(3)) = local
  end procedure gather_wp

  module procedure gather_sp
    whole(lo(1):hi(1), lo(2):hi(2), lo(3):hi(3)) = local
  end procedure gather_sp

  module procedure global_max
    x = x   ! the only process holds the result
  end procedure global_max

  module procedure global_sum
    n = n   ! the only process holds the result
  end procedure global_sum

  module procedure global_sum_accumulators
    accumulator = accumulator   ! the only process holds the result
  end procedure global_sum_accumulators

  module procedure broadcast_character
    x = x
  end procedure broadcast_character

  module procedure broadcast_integer
    x = x
  end procedure broadcast_integer

  module procedure broadcast_logical
    x = x
  end procedure broadcast_logical

  module procedure set_file_access
    status = merge(0, -1, access >= 0)   ! one process opens files as ever
  end procedure set_file_access

  module procedure set_collective
    status = merge(0, -1, transfer >= 0)   ! one process writes as ever
  end procedure set_collective

end submodule parallel_serial_m
