!> Sums of real numbers that do not depend on the order of adding.
!!
!! The number axis is cut into bins of 36 binary digits at fixed places: bin t counts in units
!! `2**(36 t)`. A term is rounded to the unit of the highest bin, the rest to the unit of the next
!! bin, and so on for three bins below the largest term; each part is a whole number of units.
!! Adding whole numbers is exact, so any order, blocking, thread or process count gives the same
!! three numbers. They hold at least 73 digits below the largest term, far more than a plain sum.
!!
!! A set of bins is a plain `integer(i8) :: bins(bin_size)`: the index of the highest bin, then the
!! three counts from high to low. Valid for up to 2**28 terms.
!!
!! Source: the pre-rounded sums of Demmel and Nguyen, IEEE Trans. Comput. 64 (2015), with whole
!! numbers as accumulators so that no carry is ever needed.
module exact_bins_m
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
  use kinds_m, only: wp, i8
  implicit none
  private
  public :: bin_size, no_terms, chunk_size, add_terms, merge_bins, bins_value

  integer, parameter :: bin_size = 4         !! index of the highest bin and three counts
  integer, parameter :: chunk_size = 4096    !! most terms in one call of `add_terms`
  integer, parameter :: bin_digits = 36
  integer, parameter :: lowest = -24         !! smallest index, so that no unit is subnormal
  integer, parameter :: highest = 26         !! largest index, so that nothing overflows
  integer, parameter :: not_a_number = highest + 1

  !> Bins of an empty sum.
  integer(i8), parameter :: no_terms(bin_size) = [int(lowest, i8), 0_i8, 0_i8, 0_i8]

contains

  !> Add the terms p to the bins; p is used up.
  pure subroutine add_terms(p, bins)
    real(wp), intent(inout), contiguous :: p(:)   !! at most `chunk_size` terms
    integer(i8), intent(inout) :: bins(bin_size)
    integer(i8) :: part(bin_size)
    real(wp) :: largest, total, unit
    integer :: i, top, b

    largest = 0.0_wp
    !$omp simd reduction(max: largest)
    do i = 1, size(p)
      largest = max(largest, abs(p(i)))
    end do
    top = top_bin(largest)
    if (top < not_a_number) then
      do b = 1, 3
        call split_terms(p, top + 1 - b, total)
        if (.not. abs(total) <= huge(total)) then
          top = not_a_number
          exit
        end if
        unit = scale(1.0_wp, -bin_digits*(top + 1 - b))
        part(1 + b) = int(total*unit, i8)
      end do
    end if
    part(1) = int(top, i8)
    if (top == not_a_number) part(2:) = 0_i8
    call merge_bins(part, bins)
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

  !> Take from each term the part that bin t holds, and add these parts.
  !!
  !! Adding and subtracting 1.5 units of the 53rd digit rounds to the unit. No sum here passes
  !! 2**47 units, so every addition is exact and may go in any order.
  pure subroutine split_terms(p, t, total)
    real(wp), intent(inout), contiguous :: p(:)
    integer, intent(in) :: t
    real(wp), intent(out) :: total
    real(wp) :: shifter, high
    integer :: i

    shifter = scale(1.5_wp, bin_digits*t + digits(1.0_wp) - 1)
    total = 0.0_wp
    !$omp simd reduction(+: total) private(high)
    do i = 1, size(p)
      high = (p(i) + shifter) - shifter
      p(i) = p(i) - high
      total = total + high
    end do
  end subroutine split_terms

  !> Add the bins of one sum to those of another.
  pure subroutine merge_bins(part, bins)
    integer(i8), intent(in) :: part(bin_size)
    integer(i8), intent(inout) :: bins(bin_size)
    integer :: down

    if (part(1) > bins(1)) then
      down = int(min(part(1) - bins(1), 3_i8))
      bins(2 + down:) = bins(2:bin_size - down)
      bins(2:1 + down) = 0_i8
      bins(1) = part(1)
    end if
    down = int(min(bins(1) - part(1), 3_i8))
    bins(2 + down:) = bins(2 + down:) + part(2:bin_size - down)
  end subroutine merge_bins

  !> Value of a sum; NaN when a term was not a number or above 1e292.
  pure function bins_value(bins) result(value)
    integer(i8), intent(in) :: bins(bin_size)
    real(wp) :: value
    integer(i8), parameter :: radix = 2_i8**bin_digits
    integer(i8) :: held(3), carry
    real(wp) :: unit
    integer :: b

    if (bins(1) == not_a_number) then
      value = ieee_value(value, ieee_quiet_nan)
      return
    end if
    held = bins(2:)
    do b = 3, 2, -1   ! leave at most half a unit of the next bin, so that nothing cancels below
      carry = shifta(held(b) + radix/2, bin_digits)
      held(b) = held(b) - carry*radix
      held(b - 1) = held(b - 1) + carry
    end do
    unit = scale(1.0_wp, bin_digits*(int(bins(1)) - 2))
    value = real(held(2), wp)*scale(unit, bin_digits) + real(held(3), wp)*unit
    value = real(held(1), wp)*scale(unit, 2*bin_digits) + value
  end function bins_value

end module exact_bins_m
