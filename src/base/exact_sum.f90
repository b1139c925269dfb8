!> Sums over all cells of all processes that give the same bits in any order (see
!! `exact_accumulator_m`).
!!
!! `exact_sum`, `exact_dot` and `exact_dots` need one message each. For terms that
!! arise here and there, like forces on bodies, keep accumulators: start from `no_terms`,
!! `exact_add` terms, `merge_accumulators` of threads, and turn all of them into numbers with one
!! `exact_totals`.
module exact_sum_m
  use kinds_m, only: wp, i8
  use exact_accumulator_m, only: accumulator_size, no_terms, chunk_size, add_terms, &
                                 merge_accumulators, accumulator_value
  use parallel_m, only: global_sum_accumulators
  use timers_m, only: tic, toc
  implicit none
  private
  public :: exact_sum, exact_dot, exact_dots
  public :: accumulator_size, no_terms, exact_add, exact_add_columns, exact_totals
  public :: terms_at_once

  integer, parameter :: terms_at_once = 256    !! for `exact_add_columns`: they stay in the cache
  integer, parameter :: worth_threads = 8192   !! fewer terms are summed by one thread

contains

  !> Sum of all elements of all processes.
  function exact_sum(a) result(s)
    real(wp), intent(in) :: a(:)
    real(wp) :: s
    integer(i8) :: accumulator(accumulator_size, 1), mine(accumulator_size)
    real(wp) :: total(1)
    integer :: first

    accumulator(:, 1) = no_terms
    ! chunk by chunk, on all threads if there are many terms
    !$omp parallel private(mine) if (size(a) > worth_threads)
    mine = no_terms
    !$omp do schedule(static)
    do first = 1, size(a), chunk_size
      call exact_add(a(first:min(first + chunk_size - 1, size(a))), mine)
    end do
    !$omp end do nowait
    !$omp critical (merge_columns)
    call merge_accumulators(mine, accumulator(:, 1))
    !$omp end critical (merge_columns)
    !$omp end parallel
    call exact_totals(accumulator, total)
    s = total(1)
  end function exact_sum

  !> Sum of x*y over the inner cells of all processes.
  function exact_dot(x, y, width, line) result(s)
    real(wp), intent(in), contiguous :: x(:, :, :), y(:, :, :)   !! blocks with halos
    integer, intent(in) :: width   !! halo cells on every side of both
    integer, intent(in), optional :: line(:, :, :)
      !! (2, j, k) first and last cell of each line that take part, from 1; all if not given (not
      !! contiguous: handing one on that is not given, gfortran would look into it)
    real(wp) :: s
    integer(i8) :: accumulator(accumulator_size, 1)
    real(wp) :: total(1)

    accumulator(:, 1) = no_terms
    call add_products(x, y, width, line, accumulator(:, 1))
    call exact_totals(accumulator, total)
    s = total(1)
  end function exact_dot

  !> Sums of x1*y1 and of x2*y2 over the inner cells of all processes, with one message.
  function exact_dots(x1, y1, x2, y2, width, line) result(s)
    real(wp), intent(in), contiguous :: x1(:, :, :), y1(:, :, :), x2(:, :, :), y2(:, :, :)
    integer, intent(in) :: width   !! halo cells on every side of all four
    integer, intent(in), optional :: line(:, :, :)   !! see `exact_dot`
    real(wp) :: s(2)
    integer(i8) :: accumulator(accumulator_size, 2)

    accumulator(:, 1) = no_terms
    accumulator(:, 2) = no_terms
    call add_products(x1, y1, width, line, accumulator(:, 1))
    call add_products(x2, y2, width, line, accumulator(:, 2))
    call exact_totals(accumulator, s)
  end function exact_dots

  !> Add terms of this process to a sum kept in accumulators.
  pure subroutine exact_add(terms, accumulator)
    real(wp), intent(in) :: terms(:)
    integer(i8), intent(inout) :: accumulator(accumulator_size)
    real(wp) :: p(chunk_size)
    integer :: first, n

    do first = 1, size(terms), chunk_size
      n = min(chunk_size, size(terms) - first + 1)
      p(:n) = terms(first:first + n - 1)
      call add_terms(p(:n), accumulator)
    end do
  end subroutine exact_add

  !> Add the columns of `a` to as many sums kept in accumulators, which the threads share.
  subroutine exact_add_columns(a, accumulator)
    real(wp), intent(in) :: a(:, :)              !! (terms, sums)
    integer(i8), intent(inout) :: accumulator(:, :)     !! (accumulator_size, sums)
    integer(i8) :: mine(accumulator_size, size(a, 2))
    integer :: m

    do m = 1, size(a, 2)
      mine(:, m) = no_terms
      call exact_add(a(:, m), mine(:, m))
    end do
    !$omp critical (merge_shared)
    do m = 1, size(a, 2)
      call merge_accumulators(mine(:, m), accumulator(:, m))
    end do
    !$omp end critical (merge_shared)
  end subroutine exact_add_columns

  !> Values of sums kept in accumulators, over all processes, with one message.
  subroutine exact_totals(accumulator, s)
    integer(i8), intent(inout), contiguous :: accumulator(:, :)   !! (accumulator_size, sums)
    real(wp), intent(out) :: s(:)
    integer :: m

    call tic('sums over processes')
    call global_sum_accumulators(accumulator)
    call toc('sums over processes')
    do m = 1, size(s)
      s(m) = accumulator_value(accumulator(:, m))
    end do
  end subroutine exact_totals

  !> Add the products of the inner cells, plane by plane, on all threads if there are many.
  subroutine add_products(x, y, width, line, accumulator)
    real(wp), intent(in), contiguous :: x(:, :, :), y(:, :, :)
    integer, intent(in) :: width
    integer, intent(in), optional :: line(:, :, :)
    integer(i8), intent(inout) :: accumulator(accumulator_size)
    integer(i8) :: mine(accumulator_size)
    integer :: k, first(3), last(3), range(2, size(x, 2))

    first = width + 1
    last = shape(x) - width
    range(1, :) = first(1)
    range(2, :) = last(1)
    !$omp parallel private(mine) firstprivate(range) &
    !$omp if (product(last - first + 1) > worth_threads)
    mine = no_terms
    !$omp do schedule(static)
    do k = first(3), last(3)
      if (present(line)) range = line(:, :, k)
      call add_plane(x(:, :, k), y(:, :, k), range(:, first(2):last(2)), width, mine)
    end do
    !$omp end do nowait
    !$omp critical (merge_products)
    call merge_accumulators(mine, accumulator)
    !$omp end critical (merge_products)
    !$omp end parallel
  end subroutine add_products

  !> Add the products of one plane, gathered row by row into chunks.
  pure subroutine add_plane(x, y, range, above, accumulator)
    real(wp), intent(in), contiguous :: x(:, :), y(:, :)
    integer, intent(in), contiguous :: range(:, :)   !! (2, rows) first and last cell of each row
    integer, intent(in) :: above                     !! rows of the halo before them
    integer(i8), intent(inout) :: accumulator(accumulator_size)
    real(wp) :: p(chunk_size)
    integer :: i, j, row, start, n, held

    held = 0
    do row = 1, size(range, 2)
      j = above + row
      do start = range(1, row), range(2, row), chunk_size
        n = min(chunk_size, range(2, row) - start + 1)
        if (held + n > chunk_size) then
          call add_terms(p(:held), accumulator)
          held = 0
        end if
        do i = 0, n - 1
          p(held + 1 + i) = x(start + i, j)*y(start + i, j)
        end do
        held = held + n
      end do
    end do
    if (held > 0) call add_terms(p(:held), accumulator)
  end subroutine add_plane

end module exact_sum_m
