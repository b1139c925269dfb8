!> Sums of real numbers that do not depend on the order of adding, nor on the unit.
!!
!! The number axis is cut into bins of 36 binary digits at fixed places: bin t counts in units
!! `2**(36 t)`. A term is rounded to the unit of the highest bin, the rest to the unit of the next
!! bin, and so on for four bins below the largest term; each part is a whole number of units.
!! Adding whole numbers is exact, so any order, blocking, thread or process count gives the same
!! four numbers. They hold at least 109 digits below the largest term. The value keeps 67 of them,
!! far more than a plain sum, counted from the largest term and not from the bins: the same terms
!! in other units, a power of two apart, have a sum of the same bits.
!!
!! An accumulator is a plain `integer(i8) :: accumulator(accumulator_size)`: the exponent of the
!! largest term, the lower 32 digits of the four counts from high to low, then what is above these.
!! A term adds up to 2**35 to a count, so one word would hold 2**28 terms; two hold 2**50, more than
!! any grid has cells.
!!
!! Source: the pre-rounded sums of Demmel and Nguyen, IEEE Trans. Comput. 64 (2015), with whole
!! numbers as accumulators so that no carry is ever needed.
module exact_accumulator_m
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
  use, intrinsic :: iso_fortran_env, only: real128
  use kinds_m, only: wp, i8
  implicit none
  private
  public :: accumulator_size, no_terms, chunk_size, add_terms, merge_accumulators, accumulator_value

  integer, parameter :: n_bins = 4
  integer, parameter :: accumulator_size = 1 + 2*n_bins   !! exponent, counts of the bins in two
  integer, parameter :: chunk_size = 1024    !! most terms in one call of `add_terms`, on the stack
  integer, parameter :: bin_digits = 36
  integer, parameter :: low_digits = 32      !! of a count, in its lower word
  integer, parameter :: value_digits = 67    !! of a value, below the exponent of the largest term
  integer, parameter :: lowest = -24*bin_digits       !! exponent, so that no unit is subnormal
  integer, parameter :: highest = 27*bin_digits - 1   !! exponent, so that nothing overflows
  integer, parameter :: not_a_number = highest + 1

  !> Bins of an empty sum.
  integer(i8), parameter :: no_terms(accumulator_size) = [integer(i8) :: lowest, 0, 0, 0, 0, 0, 0, &
    0, 0]

contains

  !> Add terms to an accumulator.
  pure subroutine add_terms(p, accumulator)
    real(wp), intent(in), contiguous :: p(:)   !! at most `chunk_size` terms
    integer(i8), intent(inout) :: accumulator(accumulator_size)
    integer(i8) :: part(accumulator_size)
    real(wp) :: total(n_bins), largest, m1, m2, m3, m4
    integer :: b, i, q

    part = 0_i8
    part(1) = lowest
    ! Largest magnitude of the terms; four at a time, for a maximum waits for the one before.
    q = size(p)/4
    m1 = 0.0_wp
    m2 = 0.0_wp
    m3 = 0.0_wp
    m4 = 0.0_wp
    !$omp simd reduction(max: m1, m2, m3, m4)
    do i = 1, q
      m1 = max(m1, abs(p(i)))
      m2 = max(m2, abs(p(q + i)))
      m3 = max(m3, abs(p(2*q + i)))
      m4 = max(m4, abs(p(3*q + i)))
    end do
    largest = max(m1, m2, m3, m4)
    do i = 4*q + 1, size(p)
      largest = max(largest, abs(p(i)))
    end do
    if (largest > 0.0_wp) part(1) = max(exponent(largest), lowest)
    if (largest < scale(1.0_wp, highest)) then
      call split_terms(p, top_bin(part(1)), total)
      if (abs(total(1)) <= huge(total)) then
        do b = 1, n_bins
          part(1 + b) = int(scale(total(b), -bin_digits*(top_bin(part(1)) + 1 - b)), i8)
        end do
      else
        part(1) = not_a_number
      end if
    else
      part(1) = not_a_number
    end if
    call merge_accumulators(part, accumulator)
  end subroutine add_terms

  !> Index of the highest bin that terms of this exponent reach.
  pure function top_bin(largest) result(top)
    integer(i8), intent(in) :: largest   !! exponent
    integer :: top

    top = int((largest - modulo(largest, int(bin_digits, i8)))/bin_digits)
  end function top_bin

  !> Cut each term into the parts that the bins hold, and add these parts.
  !!
  !! Adding and subtracting 1.5 units of the 53rd digit rounds to the unit. No sum here passes
  !! 2**47 units, so every addition is exact and may go in any order.
  pure subroutine split_terms(p, top, total)
    real(wp), intent(in), contiguous :: p(:)
    integer, intent(in) :: top               !! index of the highest bin
    real(wp), intent(out) :: total(n_bins)   !! from high to low
    real(wp) :: shift_1, shift_2, shift_3, shift_4, part_1, part_2, part_3, part_4
    real(wp) :: sum_1, sum_2, sum_3, sum_4
    integer :: i

    shift_1 = scale(1.5_wp, bin_digits*top + digits(1.0_wp) - 1)
    shift_2 = scale(shift_1, -bin_digits)
    shift_3 = scale(shift_2, -bin_digits)
    shift_4 = scale(shift_3, -bin_digits)
    sum_1 = 0.0_wp
    sum_2 = 0.0_wp
    sum_3 = 0.0_wp
    sum_4 = 0.0_wp
    !$omp simd reduction(+: sum_1, sum_2, sum_3, sum_4) private(part_1, part_2, part_3, part_4)
    do i = 1, size(p)
      part_1 = (p(i) + shift_1) - shift_1
      part_2 = ((p(i) - part_1) + shift_2) - shift_2
      part_3 = (((p(i) - part_1) - part_2) + shift_3) - shift_3
      part_4 = ((((p(i) - part_1) - part_2) - part_3) + shift_4) - shift_4
      sum_1 = sum_1 + part_1
      sum_2 = sum_2 + part_2
      sum_3 = sum_3 + part_3
      sum_4 = sum_4 + part_4
    end do
    total = [sum_1, sum_2, sum_3, sum_4]
  end subroutine split_terms

  !> Add the accumulator of one sum to those of another.
  pure subroutine merge_accumulators(part, accumulator)
    integer(i8), intent(in) :: part(accumulator_size)
    integer(i8), intent(inout) :: accumulator(accumulator_size)
    integer, parameter :: l = 1 + n_bins, h = 1 + 2*n_bins   ! last lower and upper word
    integer(i8) :: carry(n_bins)
    integer :: down

    down = top_bin(part(1)) - top_bin(accumulator(1))
    call move_down(min(max(down, 0), n_bins), accumulator(2:l))
    call move_down(min(max(down, 0), n_bins), accumulator(l + 1:h))
    accumulator(1) = max(accumulator(1), part(1))
    down = min(max(-down, 0), n_bins)
    accumulator(2 + down:l) = accumulator(2 + down:l) + part(2:l - down)
    accumulator(l + 1 + down:h) = accumulator(l + 1 + down:h) + part(l + 1:h - down)
    carry = shifta(accumulator(2:l), low_digits)
    accumulator(2:l) = accumulator(2:l) - shiftl(carry, low_digits)
    accumulator(l + 1:h) = accumulator(l + 1:h) + carry
  end subroutine merge_accumulators

  !> Words of the counts become those of lower bins; the lowest are dropped.
  pure subroutine move_down(down, word)
    integer, intent(in) :: down   !! bins, 0 to `n_bins`
    integer(i8), intent(inout) :: word(n_bins)

    word(1 + down:) = word(:n_bins - down)
    word(:down) = 0_i8
  end subroutine move_down

  !> Value of a sum; NaN when a term was not a number or above 1e292.
  !!
  !! Counts times units have less than 113 digits, and so have sums from the highest on that lower
  !! bins may still cancel.
  pure function accumulator_value(accumulator) result(value)
    integer(i8), intent(in) :: accumulator(accumulator_size)
    real(wp) :: value
    real(real128) :: sum
    integer :: b, last

    if (accumulator(1) == not_a_number) then
      value = ieee_value(value, ieee_quiet_nan)
      return
    end if
    sum = 0
    do b = 1, n_bins
      sum = sum + scale(scale(real(accumulator(1 + n_bins + b), real128), low_digits) &
                        + accumulator(1 + b), bin_digits*(top_bin(accumulator(1)) + 1 - b))
    end do
    value = real(sum, wp)
    last = int(accumulator(1)) - value_digits
    if (exponent(value) - last < digits(value)) value = scale(anint(scale(value, -last)), last)
  end function accumulator_value

end module exact_accumulator_m
