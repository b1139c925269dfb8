!> Sums of real numbers that do not depend on the order of adding.
!!
!! The number axis is cut into bins of 36 binary digits at fixed places: bin t counts in units
!! `2**(36 t)`. A term is rounded to the unit of the highest bin, the rest to the unit of the next
!! bin, and so on for three bins below the largest term; each part is a whole number of units.
!! Adding whole numbers is exact, so any order, blocking, thread or process count gives the same
!! three numbers. They hold at least 73 digits below the largest term, far more than a plain sum.
!!
!! An accumulator is a plain `integer(i8) :: accumulator(accumulator_size)`: the index of the
!! highest bin, the lower 32 digits of the three counts from high to low, then what is above these.
!! A term adds up to 2**35 to a count, so one word would hold 2**28 terms; two hold 2**50, more than
!! any grid has cells.
!!
!! Source: the pre-rounded sums of Demmel and Nguyen, IEEE Trans. Comput. 64 (2015), with whole
!! numbers as accumulators so that no carry is ever needed.
module exact_accumulator_m
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
  use kinds_m, only: wp, i8
  implicit none
  private
  public :: accumulator_size, no_terms, chunk_size, add_terms, merge_accumulators, accumulator_value

  integer, parameter :: accumulator_size = 7   !! index of the highest bin, counts of three in two
  integer, parameter :: chunk_size = 1024    !! most terms in one call of `add_terms`, on the stack
  integer, parameter :: bin_digits = 36
  integer, parameter :: low_digits = 32      !! of a count, in its lower word
  integer, parameter :: lowest = -24         !! smallest index, so that no unit is subnormal
  integer, parameter :: highest = 26         !! largest index, so that nothing overflows
  integer, parameter :: not_a_number = highest + 1

  !> Bins of an empty sum.
  integer(i8), parameter :: no_terms(accumulator_size) = [int(lowest, i8), 0_i8, 0_i8, 0_i8, &
    0_i8, 0_i8, 0_i8]

contains

  !> Add terms to an accumulator.
  pure subroutine add_terms(p, accumulator)
    real(wp), intent(in), contiguous :: p(:)   !! at most `chunk_size` terms
    integer(i8), intent(inout) :: accumulator(accumulator_size)
    integer(i8) :: part(accumulator_size)
    real(wp) :: total(3), largest, m1, m2, m3, m4
    integer :: top, b, i, q

    part = 0_i8
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
    top = top_bin(largest)
    if (top < not_a_number) then
      call split_terms(p, top, total)
      if (abs(total(1)) <= huge(total)) then
        do b = 1, 3
          part(1 + b) = int(scale(total(b), -bin_digits*(top + 1 - b)), i8)
        end do
      else
        top = not_a_number
      end if
    end if
    part(1) = int(top, i8)
    call merge_accumulators(part, accumulator)
  end subroutine add_terms

  !> Index of the highest bin that terms up to `largest` reach.
  pure function top_bin(largest) result(top)
    real(wp), intent(in) :: largest   !! >= 0
    integer :: top
    integer :: above

    top = lowest
    if (.not. largest > 0.0_wp) return
    top = not_a_number
    if (.not. largest < scale(1.0_wp, bin_digits*highest + bin_digits - 1)) return
    above = exponent(largest) - (bin_digits - 1)
    top = above/bin_digits
    if (above > 0 .and. modulo(above, bin_digits) > 0) top = top + 1
    top = max(top, lowest)
  end function top_bin

  !> Cut each term into the parts that three bins hold, and add these parts.
  !!
  !! Adding and subtracting 1.5 units of the 53rd digit rounds to the unit. No sum here passes
  !! 2**47 units, so every addition is exact and may go in any order.
  pure subroutine split_terms(p, top, total)
    real(wp), intent(in), contiguous :: p(:)
    integer, intent(in) :: top          !! index of the highest bin
    real(wp), intent(out) :: total(3)   !! from high to low
    real(wp) :: shift_1, shift_2, shift_3, high, middle, low, sum_1, sum_2, sum_3
    integer :: i

    shift_1 = scale(1.5_wp, bin_digits*top + digits(1.0_wp) - 1)
    shift_2 = scale(shift_1, -bin_digits)
    shift_3 = scale(shift_2, -bin_digits)
    sum_1 = 0.0_wp
    sum_2 = 0.0_wp
    sum_3 = 0.0_wp
    !$omp simd reduction(+: sum_1, sum_2, sum_3) private(high, middle, low)
    do i = 1, size(p)
      high = (p(i) + shift_1) - shift_1
      middle = ((p(i) - high) + shift_2) - shift_2
      low = (((p(i) - high) - middle) + shift_3) - shift_3
      sum_1 = sum_1 + high
      sum_2 = sum_2 + middle
      sum_3 = sum_3 + low
    end do
    total = [sum_1, sum_2, sum_3]
  end subroutine split_terms

  !> Add the accumulator of one sum to those of another.
  pure subroutine merge_accumulators(part, accumulator)
    integer(i8), intent(in) :: part(accumulator_size)
    integer(i8), intent(inout) :: accumulator(accumulator_size)
    integer(i8) :: carry(3)
    integer :: down

    if (part(1) > accumulator(1)) then
      down = int(min(part(1) - accumulator(1), 3_i8))
      call move_down(down, accumulator(2:4))
      call move_down(down, accumulator(5:7))
      accumulator(1) = part(1)
    end if
    down = int(min(accumulator(1) - part(1), 3_i8))
    accumulator(2 + down:4) = accumulator(2 + down:4) + part(2:4 - down)
    accumulator(5 + down:7) = accumulator(5 + down:7) + part(5:7 - down)
    carry = shifta(accumulator(2:4), low_digits)
    accumulator(2:4) = accumulator(2:4) - shiftl(carry, low_digits)
    accumulator(5:7) = accumulator(5:7) + carry
  end subroutine merge_accumulators

  !> Words of three counts become those of lower bins; the lowest are dropped.
  pure subroutine move_down(down, word)
    integer, intent(in) :: down   !! bins, 1 to 3
    integer(i8), intent(inout) :: word(3)

    word(1 + down:) = word(:3 - down)
    word(:down) = 0_i8
  end subroutine move_down

  !> Value of a sum; NaN when a term was not a number or above 1e292.
  pure function accumulator_value(accumulator) result(value)
    integer(i8), intent(in) :: accumulator(accumulator_size)
    real(wp) :: value
    integer, parameter :: between = bin_digits - low_digits   ! digits of the upper word in a bin
    integer(i8), parameter :: radix = 2_i8**bin_digits
    integer(i8) :: low(3), high(3), carry
    real(wp) :: unit
    integer :: b

    if (accumulator(1) == not_a_number) then
      value = ieee_value(value, ieee_quiet_nan)
      return
    end if
    low = accumulator(2:4)
    high = accumulator(5:7)
    do b = 3, 2, -1   ! leave at most half a unit of the next bin, so that nothing cancels below
      low(b) = low(b) + shiftl(iand(high(b), 2_i8**between - 1_i8), low_digits)
      carry = shifta(low(b) + radix/2, bin_digits)
      low(b) = low(b) - carry*radix
      low(b - 1) = low(b - 1) + carry + shifta(high(b), between)
    end do
    unit = scale(1.0_wp, bin_digits*(int(accumulator(1)) - 2))
    value = real(low(2), wp)*scale(unit, bin_digits) + real(low(3), wp)*unit
    value = (scale(real(high(1), wp), low_digits) + real(low(1), wp))*scale(unit, 2*bin_digits) &
            + value
  end function accumulator_value

end module exact_accumulator_m
