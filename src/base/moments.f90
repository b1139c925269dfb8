!> Times as sums of steps: which are one but for rounding.
module moments_m
  use kinds_m, only: wp
  implicit none
  private
  public :: has_come

  real(wp), parameter :: same_time = 1.0e-12_wp   !! times closer than this are one, over them [-]

contains

  !> Has a time come, or is it ahead by rounding alone?
  elemental logical function has_come(time, now)
    real(wp), intent(in) :: time, now   !! not negative [s]

    has_come = now >= time*(1.0_wp - same_time)
  end function has_come

end module moments_m
