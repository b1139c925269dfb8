!> Rotation of a vector by a quaternion, for tests: another formula than that of the program.
module rotations_m
  use kinds_m, only: wp
  use vectors_m, only: cross
  implicit none
  private
  public :: rotate

contains

  !> Vector v turned by the unit quaternion q, from body to space axes.
  pure function rotate(q, v) result(r)
    real(wp), intent(in) :: q(4), v(3)
    real(wp) :: r(3), t(3)

    t = 2*cross(q(2:4), v)
    r = v + q(1)*t + cross(q(2:4), t)
  end function rotate

end module rotations_m
