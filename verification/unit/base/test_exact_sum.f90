!> Order-free sums: the same bits in any order, right to round-off of the sum of magnitudes.
module test_exact_sum_m
  use, intrinsic :: iso_fortran_env, only: real128
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_set_halting_mode, &
    ieee_set_flag, ieee_invalid
  use check_m, only: check, wp, i8
  use exact_sum_m, only: exact_sum, exact_dot, exact_dots, exact_add, exact_totals, &
    exact_add_columns, no_terms, accumulator_size
  use exact_accumulator_m, only: merge_accumulators
  use parallel_m, only: set_threads
  implicit none
  private
  public :: test_exact_sum

  integer, parameter :: n = 20000
  real(wp), allocatable :: a(:)

contains

  subroutine test_exact_sum()
    allocate (a(n))
    call mixed_numbers(a)
    call test_orders()
    call test_blocks()
    call test_exact_cases()
    call test_units()
    call test_many_terms()
    call test_columns()
    call test_dots()
    call test_not_a_number()
  end subroutine test_exact_sum

  !> Numbers of both signs over thirty decades, with some exact zeros.
  subroutine mixed_numbers(x)
    real(wp), intent(out) :: x(:)
    real(wp) :: r(size(x))

    call random_number(x)
    call random_number(r)
    x = (x - 0.5_wp)*10.0_wp**(30*r - 15)
    where (r < 0.01_wp) x = 0.0_wp
  end subroutine mixed_numbers

  subroutine shuffle(x)
    real(wp), intent(inout) :: x(:)
    real(wp) :: r, t
    integer :: i, j

    do i = size(x), 2, -1
      call random_number(r)
      j = 1 + int(r*i)
      t = x(i)
      x(i) = x(j)
      x(j) = t
    end do
  end subroutine shuffle

  subroutine test_orders()
    real(wp) :: s
    integer :: i

    s = exact_sum(a)
    call check('in quadruple precision', s, real(sum(real(a, real128)), wp), 1.0e-15_wp*sum(abs(a)))
    do i = 1, 40
      call set_threads(1 + modulo(i, 3))
      call shuffle(a)
      call check('same bits in any order on 1 to 3 threads', exact_sum(a), s)
    end do
    call set_threads(2)
  end subroutine test_orders

  !> Sums of parts of any lengths, merged in any order.
  subroutine test_blocks()
    integer(i8) :: accumulator(accumulator_size, 1), part(accumulator_size)
    real(wp) :: s(1), r
    integer :: trial, first, last

    do trial = 1, 40
      accumulator(:, 1) = no_terms
      first = 1
      do while (first <= n)
        call random_number(r)
        last = min(n, first + int(r**4*9000))
        part = no_terms
        call exact_add(a(first:last), part)
        call merge_accumulators(part, accumulator(:, 1))
        first = last + 1
      end do
      call exact_totals(accumulator, s)
      call check('same bits in any blocking', s(1), exact_sum(a))
    end do
  end subroutine test_blocks

  subroutine test_exact_cases()
    integer :: i
    real(wp) :: x

    call check('empty sum', exact_sum(a(1:0)), 0.0_wp)
    call check('cancellation', exact_sum([1.0e16_wp, 1.0_wp, -1.0e16_wp]), 1.0_wp)
    call check('one and many small', exact_sum([1.0_wp, (1.0e-17_wp, i=1, 10000)]), &
      1.0_wp + 1.0e-13_wp, epsilon(1.0_wp))
    do i = -200, 200, 9
      x = -1.2345678901234567_wp*10.0_wp**i
      call check('one term comes back', exact_sum([x]), x)
      call check('a term and its opposite', exact_sum([x, -x]), 0.0_wp)
      call check('powers of two at bin borders', exact_sum([2.0_wp**i, 2.0_wp**i]), 2.0_wp**(i + 1))
    end do
  end subroutine test_exact_cases

  !> In units that are powers of two apart a sum has the same digits, though most of it cancels.
  subroutine test_units()
    real(wp) :: x(n), s
    integer :: k, cancels

    do cancels = 0, 75, 5
      x = a
      x(2::2) = -x(1::2)*(1.0_wp + 0.37_wp*2.0_wp**(-cancels))
      s = exact_sum(x)
      do k = -75, 75
        call check('same digits in any unit', exact_sum(scale(x, k)), scale(s, k))
      end do
    end do
  end subroutine test_units

  !> As many terms as the largest grid has cells, 2**31, and more: the sums of two halves are merged
  !! until there are so many. Counts of all bins grow as fast as they can, up and down.
  subroutine test_many_terms()
    integer, parameter :: first = 4096, doublings(2) = [19, 28]
    real(wp), parameter :: terms(4) = [1.0_wp, 0.7_wp, -1.0_wp/3.0_wp, &
      (1.0_wp - epsilon(1.0_wp))*2.0_wp**35]
    integer(i8) :: accumulator(accumulator_size, 1), half(accumulator_size)
    real(wp) :: s(1), expected
    integer :: t, d, m

    do t = 1, size(terms)
      do m = 1, size(doublings)
        accumulator(:, 1) = no_terms
        call exact_add(spread(terms(t), 1, first), accumulator(:, 1))
        do d = 1, doublings(m)
          half = accumulator(:, 1)
          call merge_accumulators(half, accumulator(:, 1))
        end do
        call exact_totals(accumulator, s)
        expected = scale(first*terms(t), doublings(m))
        call check('a sum of very many terms', s(1), expected, abs(expected)*epsilon(1.0_wp))
      end do
    end do
  end subroutine test_many_terms

  subroutine test_columns()
    real(wp) :: c(500, 3), s(3), by_blocks(3)
    integer(i8) :: accumulator(accumulator_size, 3)
    integer :: m, from

    call mixed_numbers(c(:, 1))
    c(:, 2) = -3*c(:, 1)
    c(:, 3) = 1.0e-200_wp
    accumulator = spread(no_terms, 2, 3)
    call exact_add_columns(c, accumulator)
    call exact_totals(accumulator, s)
    do m = 1, 3
      call check('a column is summed like alone', s(m), exact_sum(c(:, m)))
    end do
    call check('constant column', s(3), 500.0e-200_wp, 1.0e-213_wp)

    accumulator = spread(no_terms, 2, 3)
    !$omp parallel do schedule(dynamic, 1)
    do from = 1, 500, 70
      call exact_add_columns(c(from:min(from + 69, 500), :), accumulator)
    end do
    call exact_totals(accumulator, by_blocks)
    call check('columns are summed block by block as at once', by_blocks, s)
  end subroutine test_columns

  !> Dot products leave the halo out and agree with the sum of the products.
  subroutine test_dots()
    integer, parameter :: w = 2, m(3) = [70, 41, 9]
    real(wp), allocatable :: x(:, :, :), y(:, :, :)
    real(wp) :: s, pair(2)
    integer :: i

    allocate (x(m(1) + 2*w, m(2) + 2*w, m(3) + 2*w))
    allocate (y, mold=x)
    call random_number(x)
    call random_number(y)
    x = x - 0.5_wp
    s = exact_sum([x(w + 1:w + m(1), w + 1:w + m(2), w + 1:w + m(3)) &
      *y(w + 1:w + m(1), w + 1:w + m(2), w + 1:w + m(3))])
    call check('dot product of the inner cells', exact_dot(x, y, w), s)
    call test_lines(x, y, w)
    do i = 1, 3
      call set_threads(i)
      pair = exact_dots(x, y, x, x, w)
      call check('first of two dot products', pair(1), s)
      call check('second of two dot products', pair(2), exact_dot(x, x, w))
    end do
  end subroutine test_dots

  !> Only a part of each line takes part: the rest zero in one of the two gives the same.
  subroutine test_lines(x, y, w)
    real(wp), intent(in) :: x(:, :, :), y(:, :, :)
    integer, intent(in) :: w
    real(wp) :: z(size(x, 1), size(x, 2), size(x, 3))
    integer :: line(2, size(x, 2), size(x, 3)), j, k

    z = 0.0_wp
    do concurrent (k=1:size(x, 3), j=1:size(x, 2))
      line(:, j, k) = [w + 1 + modulo(j, 3), size(x, 1) - w - modulo(j + k, 3)]
      if (modulo(j*k, 5) == 0) line(2, j, k) = line(1, j, k) - 1
      z(line(1, j, k):line(2, j, k), j, k) = x(line(1, j, k):line(2, j, k), j, k)
    end do
    call check('dot product of parts of lines', exact_dot(x, y, w, line), exact_dot(z, y, w))
  end subroutine test_lines

  subroutine test_not_a_number()
    real(wp) :: bad, s

    call ieee_set_halting_mode(ieee_invalid, .false.)   ! the debug build would stop here
    bad = transfer(int(z'7FF8000000000000', i8), 1.0_wp)
    s = exact_sum([1.0_wp, bad, 2.0_wp])
    call check('NaN stays visible', ieee_is_nan(s))
    bad = huge(1.0_wp)
    s = exact_sum([1.0_wp, bad])
    call check('a number too large counts as NaN', ieee_is_nan(s))
    call ieee_set_flag(ieee_invalid, .false.)
  end subroutine test_not_a_number

end module test_exact_sum_m
