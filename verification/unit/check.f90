!> Checks for the unit tests: count, name what failed, end with an exit code. Every test needs them
!! and the working precision, which comes along.
module check_m
  use, intrinsic :: iso_fortran_env, only: compiler_options, error_unit, output_unit
  use kinds_m, only: wp, sp, i8, pi
  implicit none
  private
  public :: check, checked, wanted, finish_checks, wp, sp, i8, pi

  !> With run-time checks, some eight times as slow: fewer random poses and damaged places do.
  logical, parameter :: checked = index(compiler_options(), '-fcheck=all') > 0
  integer :: n_passed = 0, n_failed = 0

  !> One check: of a condition, of equal integers, or of reals within an absolute tolerance, without
  !! one of equal reals; a number that is expected of an array is so of each element.
  interface check
    procedure :: check_condition, check_integer, check_real, check_reals
    procedure :: check_each_1, check_each_2, check_each_3, check_each_4
  end interface check

contains

  !> Is this part to run? All do, or the one that the command line names.
  logical function wanted(part)
    character(*), intent(in) :: part   !! test_PART is its procedure
    character(64) :: argument

    call get_command_argument(1, argument)
    wanted = argument == '' .or. argument == part
    if (wanted) write (output_unit, '(2a)') part, ':'
  end function wanted

  subroutine check_condition(name, condition)
    character(*), intent(in) :: name
    logical, intent(in) :: condition

    if (condition) then
      n_passed = n_passed + 1
    else
      n_failed = n_failed + 1
      write (error_unit, '(2a)') 'FAILED: ', name
    end if
  end subroutine check_condition

  subroutine check_integer(name, value, expected)
    character(*), intent(in) :: name
    integer, intent(in) :: value, expected

    call check_condition(name, value == expected)
    if (value /= expected) write (error_unit, '(2(a, i0))') '  got ', value, ', expected ', expected
  end subroutine check_integer

  !> Passes when |value - expected| <= tolerance; NaN fails.
  subroutine check_real(name, value, expected, tolerance)
    character(*), intent(in) :: name
    real(wp), intent(in) :: value, expected
    real(wp), intent(in), optional :: tolerance

    call check_reals(name, [value], [expected], tolerance)
  end subroutine check_real

  !> Passes when every |value - expected| <= tolerance.
  subroutine check_reals(name, value, expected, tolerance)
    character(*), intent(in) :: name
    real(wp), intent(in) :: value(:), expected(:)
    real(wp), intent(in), optional :: tolerance
    real(wp) :: most
    logical :: good
    integer :: i, shown

    most = 0.0_wp
    if (present(tolerance)) most = tolerance
    good = size(value) == size(expected)
    if (good) good = all(abs(value - expected) <= most)
    call check_condition(name, good)
    if (good) return
    shown = 0
    do i = 1, min(size(value), size(expected))
      if (abs(value(i) - expected(i)) <= most .or. shown == 10) cycle
      shown = shown + 1
      write (error_unit, '(a, i0, 3(a, es24.16))') '  element ', i, ': got ', value(i), &
        ', expected ', expected(i), ', tolerance ', most
    end do
  end subroutine check_reals

  subroutine check_each_1(name, value, expected, tolerance)
    character(*), intent(in) :: name
    real(wp), intent(in) :: value(:), expected
    real(wp), intent(in), optional :: tolerance

    call check_reals(name, [value], spread(expected, 1, size(value)), tolerance)
  end subroutine check_each_1

  subroutine check_each_2(name, value, expected, tolerance)
    character(*), intent(in) :: name
    real(wp), intent(in) :: value(:, :), expected
    real(wp), intent(in), optional :: tolerance

    call check_reals(name, [value], spread(expected, 1, size(value)), tolerance)
  end subroutine check_each_2

  subroutine check_each_3(name, value, expected, tolerance)
    character(*), intent(in) :: name
    real(wp), intent(in) :: value(:, :, :), expected
    real(wp), intent(in), optional :: tolerance

    call check_reals(name, [value], spread(expected, 1, size(value)), tolerance)
  end subroutine check_each_3

  subroutine check_each_4(name, value, expected, tolerance)
    character(*), intent(in) :: name
    real(wp), intent(in) :: value(:, :, :, :), expected
    real(wp), intent(in), optional :: tolerance

    call check_reals(name, [value], spread(expected, 1, size(value)), tolerance)
  end subroutine check_each_4

  !> Print the counts; stop with code 1 when a check failed or none was made.
  subroutine finish_checks()
    write (output_unit, '(i0, a, i0, a)') n_passed, ' passed, ', n_failed, ' failed'
    if (n_failed > 0 .or. n_passed == 0) stop 1
  end subroutine finish_checks

end module check_m
