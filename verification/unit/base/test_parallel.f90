!> The parallel layer: halos and order-free sums on any number of processes. Whole runs on them:
!! `verification/test_bits.py`.
! ranks: 2 4
module test_parallel_m
  use check_m, only: check, wp, sp, i8
  use exact_accumulator_m, only: accumulator_value
  use exact_sum_m, only: exact_sum, exact_dot, exact_add, exact_totals, &
    no_terms, accumulator_size
  use random_counter_m, only: uniform
  use parallel_m, only: decompose, halo_exchange, gather_all, &
    global_max, global_sum, nproc, my_rank, is_root, set_threads, get_threads
  implicit none
  private
  public :: test_parallel

  integer, parameter :: w = 3
  logical, parameter :: all_open(3) = .false., all_periodic(3) = .true.

contains

  subroutine test_parallel()
    call test_blocks([60, 20, 40])
    call test_blocks([16, 1, 32])
    call test_blocks([17, 23, 19])
    call test_halos([16, 5, 24], all_periodic)
    call test_halos([16, 1, 24], all_periodic)
    call test_halos([16, 8, 24], all_open)
    call test_halos([30, 18, 9], [.true., .false., .true.])
    call test_other_kinds([16, 8, 24])
    call test_sums([20, 12, 21])
    call set_threads(2)
    call check('threads', get_threads(), 2)
  end subroutine test_parallel

  !> The blocks are disjoint, cover the domain and are not thinner than the scheme needs.
  subroutine test_blocks(n)
    integer, intent(in) :: n(3)
    integer :: lo(3), hi(3)
    logical :: at_side(2, 3)
    real(wp), allocatable :: owned(:, :, :)
    integer(i8) :: cells(1)
    real(wp) :: most(1)

    call decompose(n, all_open, lo, hi, at_side)
    cells = product(hi - lo + 1)
    most = real(cells, wp)
    call global_sum(cells)
    call global_max(most)
    call check('blocks hold all cells', int(cells(1)), product(n))
    call check('busiest process has at most 1.5 fair shares', most(1)*nproc() <= 1.5_wp*product(n))
    call check('inside the domain', all(lo >= 1 .and. hi <= n))
    call check('lower sides known', all(lo == 1 .eqv. at_side(1, :)))
    call check('upper sides known', all(hi == n .eqv. at_side(2, :)))
    call check('cuts leave 4 cells', all(hi - lo + 1 >= 4 .or. (at_side(1, :) .and. at_side(2, :))))
    allocate (owned(n(1), n(2), n(3)), source=0.0_wp)
    call gather_all(spread(spread(spread(my_rank() + 1.0_wp, 1, hi(1) - lo(1) + 1), 2, &
      hi(2) - lo(2) + 1), 3, hi(3) - lo(3) + 1), lo, hi, owned)
    call check('no cell without owner', all(owned > 0.0_wp))
  end subroutine test_blocks

  !> A number that tells the cell; periodic directions wrap, cells beyond other sides are -1.
  pure real(wp) function label(i, n, periodic)
    integer, intent(in) :: i(3), n(3)
    logical, intent(in) :: periodic(3)
    integer :: j(3)

    j = i
    where (periodic) j = modulo(i - 1, n) + 1
    label = -1.0_wp
    if (all(j >= 1 .and. j <= n)) label = real(j(1) + 1000*j(2) + 1000000*j(3), wp)
  end function label

  !> Every cell of the block and its halo, edges and corners too, holds the label of its image.
  subroutine test_halos(n, periodic)
    integer, intent(in) :: n(3)
    logical, intent(in) :: periodic(3)
    integer :: lo(3), hi(3), i, j, k
    logical :: at_side(2, 3)
    real(wp), allocatable :: a(:, :, :), b(:, :, :, :), thin(:, :, :)

    call decompose(n, periodic, lo, hi, at_side)
    allocate (a(lo(1) - w:hi(1) + w, lo(2) - w:hi(2) + w, lo(3) - w:hi(3) + w), source=-1.0_wp)
    allocate (b(lo(1) - w:hi(1) + w, lo(2) - w:hi(2) + w, lo(3) - w:hi(3) + w, 2), source=-1.0_wp)
    do concurrent (k=lo(3):hi(3), j=lo(2):hi(2), i=lo(1):hi(1))
      a(i, j, k) = label([i, j, k], n, periodic)
    end do
    b(:, :, :, 1) = a
    b(:, :, :, 2) = merge(-2.0_wp - a, -1.0_wp, a > 0)
    thin = a
    call halo_exchange(thin, w, layers=1)
    call halo_exchange(a, w)
    associate (p => lo - 1, q => hi + 1)
      call check('one layer, its edges and corners', &
        all(abs(thin(p(1):q(1), p(2):q(2), p(3):q(3)) - a(p(1):q(1), p(2):q(2), p(3):q(3))) <= 0))
    end associate
    do i = 1, 3
      call halo_exchange(b, w, i)
    end do
    do concurrent (k=lo(3) - w:hi(3) + w, j=lo(2) - w:hi(2) + w, i=lo(1) - w:hi(1) + w)
      thin(i, j, k) = label([i, j, k], n, periodic)
    end do
    call check('halo, edge and corner cells', all(abs(a - thin) <= 0))
    call check('an array of several fields', all(abs(b(:, :, :, 1) - a) <= 0) &
      .and. all(abs(b(:, :, :, 2) - merge(-2 - a, a, a > 0)) <= 0))
  end subroutine test_halos

  !> Integers and single precision, width 1, one direction only.
  subroutine test_other_kinds(n)
    integer, intent(in) :: n(3)
    integer :: lo(3), hi(3), k
    logical :: at_side(2, 3)
    integer, allocatable :: m(:, :, :)
    real(sp), allocatable :: s(:, :, :)

    call decompose(n, all_periodic, lo, hi, at_side)
    allocate (m(lo(1) - 1:hi(1) + 1, lo(2) - 1:hi(2) + 1, lo(3) - 1:hi(3) + 1), source=0)
    do k = lo(3), hi(3)
      m(:, :, k) = k
    end do
    s = real(m, sp)
    call halo_exchange(m, 1, 3)
    call halo_exchange(s, 1, 3)
    call check('integers below', all(m(:, :, lo(3) - 1) == modulo(lo(3) - 2, n(3)) + 1))
    call check('integers above', all(m(:, :, hi(3) + 1) == modulo(hi(3), n(3)) + 1))
    call check('single precision like integers', all(nint(s) == m))
  end subroutine test_other_kinds

  !> Sums over blocks equal the sum of one process over everything, bit for bit.
  subroutine test_sums(n)
    integer, intent(in) :: n(3)
    integer :: lo(3), hi(3), a(3), b(3), i
    logical :: at_side(2, 3)
    real(wp), allocatable :: x(:, :, :), mine(:)
    real(wp) :: s, total(1)
    integer(i8) :: accumulator(accumulator_size, 1)

    call decompose(n, all_open, lo, hi, at_side)
    allocate (x(1 - w:n(1) + w, 1 - w:n(2) + w, 1 - w:n(3) + w))
    x = reshape([((uniform(1, 1, i) - 0.5_wp)**9, i=1, size(x))], shape(x))   ! on every process
    a = lo - w
    b = hi + w
    s = whole_sum([x(1:n(1), 1:n(2), 1:n(3))**2])
    call check('dot product', &
      exact_dot(x(a(1):b(1), a(2):b(2), a(3):b(3)), x(a(1):b(1), a(2):b(2), a(3):b(3)), w), s)
    mine = [x(lo(1):hi(1), lo(2):hi(2), lo(3):hi(3))]
    s = whole_sum([x(1:n(1), 1:n(2), 1:n(3))])
    call check('sum', exact_sum(mine), s)
    accumulator(:, 1) = no_terms
    if (my_rank() == nproc() - 1) call exact_add([2.0_wp**(-30), 3.0e10_wp], accumulator(:, 1))
    if (is_root()) call exact_add([-3.0e10_wp], accumulator(:, 1))
    call exact_totals(accumulator, total)
    call check('terms of different size on different processes', total(1), 2.0_wp**(-30))
  end subroutine test_sums

  !> Order-free sum of this process alone.
  real(wp) function whole_sum(x) result(s)
    real(wp), intent(in) :: x(:)
    integer(i8) :: accumulator(accumulator_size)

    accumulator = no_terms
    call exact_add(x, accumulator)
    s = accumulator_value(accumulator)
  end function whole_sum

end module test_parallel_m
