!> Volume of a bed below a level: slopes, closed forms, overhangs.
module test_bed_measure_m
  use check_m, only: check, wp
  use case_types_m, only: case_t
  use bed_file_m, only: bed_form_t
  use bed_m, only: bed_t, set_bed
  use bed_measure_m, only: bed_volume
  implicit none
  private
  public :: test_bed_measure

contains

  subroutine test_bed_measure()
    call slope()
    call floating_box()
  end subroutine test_bed_measure

  !> A tank of 2 x 1 x 1 m with a form in it.
  subroutine bed_of(point, triangle, bed)
    real(wp), intent(in) :: point(:, :)
    integer, intent(in) :: triangle(:, :)
    type(bed_t), intent(out) :: bed
    type(case_t) :: case
    type(bed_form_t) :: form
    character(:), allocatable :: message

    case%grid%cells = [2, 1, 1]
    case%grid%length = [2.0_wp, 1.0_wp, 1.0_wp]
    form%point = point
    form%triangle = triangle
    call set_bed(case, form, bed, message)
    call check('the form is taken: '//message, len(message) == 0)
  end subroutine bed_of

  !> From the floor at x = 0 up to 1 m at x = 2 m, drawn wider than the tank.
  subroutine slope()
    type(bed_t) :: bed
    real(wp), parameter :: low(3) = 0.0_wp

    call bed_of(reshape([-1.0_wp, -1.0_wp, -0.5_wp, 3.0_wp, -1.0_wp, 1.5_wp, 3.0_wp, 2.0_wp, &
      1.5_wp, -1.0_wp, 2.0_wp, -0.5_wp], [3, 4]), reshape([1, 2, 3, 1, 3, 4], [3, 2]), bed)
    call check('whole slope', bed_volume(bed, low, [2.0_wp, 1.0_wp, 1.0_wp]), 1.0_wp, 1.0e-14_wp)
    call check('below half', bed_volume(bed, low, [2.0_wp, 1.0_wp, 0.5_wp]), 0.75_wp, 1.0e-14_wp)
    call check('at the floor', bed_volume(bed, low, [2.0_wp, 1.0_wp, 0.0_wp]), 0.0_wp, 1.0e-14_wp)
  end subroutine slope

  !> A box of 1 x 0.5 x 0.2 m that floats 0.3 m above the floor.
  subroutine floating_box()
    type(bed_t) :: bed
    real(wp), parameter :: low(3) = 0.0_wp
    real(wp) :: corner(3, 8)
    integer, parameter :: side(3, 12) = reshape([1, 3, 2, 2, 3, 4, 5, 6, 7, 6, 8, 7, 1, 2, 5, 2, &
      6, 5, 3, 7, 4, 4, 7, 8, 1, 5, 3, 3, 5, 7, 2, 4, 6, 4, 8, 6], [3, 12])
    integer :: i

    do i = 0, 7
      corner(:, i + 1) = [0.5_wp + iand(i, 1), 0.25_wp + 0.25_wp*iand(i, 2), &
        0.3_wp + 0.05_wp*iand(i, 4)]
    end do
    call bed_of(corner, side, bed)
    call check('whole box', bed_volume(bed, low, [2.0_wp, 1.0_wp, 1.0_wp]), 0.1_wp, 1.0e-14_wp)
    call check('half of it', bed_volume(bed, low, [2.0_wp, 1.0_wp, 0.4_wp]), 0.05_wp, 1.0e-14_wp)
    call check('none of it', bed_volume(bed, low, [2.0_wp, 1.0_wp, 0.2_wp]), 0.0_wp, 1.0e-14_wp)
  end subroutine floating_box

end module test_bed_measure_m
