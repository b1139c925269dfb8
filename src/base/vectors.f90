!> Vectors, rotations as quaternions (w, x, y, z) and small matrices; all pure.
module vectors_m
  use kinds_m, only: wp
  implicit none
  private
  public :: cross, wrench, norm, norms, distance, normalised, cube_root
  public :: quaternion_product, quaternion_from_axis, quaternion_exp, quaternion_log
  public :: rotation_matrix, inverse3

contains

  !> Vector product a x b.
  pure function cross(a, b) result(c)
    real(wp), intent(in) :: a(3), b(3)
    real(wp) :: c(3)

    c(1) = a(2)*b(3) - a(3)*b(2)
    c(2) = a(3)*b(1) - a(1)*b(3)
    c(3) = a(1)*b(2) - a(2)*b(1)
  end function cross

  !> Force at a point and its torque about the centre of mass, as one vector of six.
  pure function wrench(f, arm) result(w)
    real(wp), intent(in) :: f(3), arm(3)
    real(wp) :: w(6)

    w(1:3) = f
    w(4:6) = cross(arm, f)
  end function wrench

  !> Euclidean length of a vector of any length. It has the same digits in other units, powers of
  !! two apart; `norm2` of gfortran has not, it rounds otherwise where a component passes 1.
  pure function norm(a) result(length)
    real(wp), intent(in) :: a(:)
    real(wp) :: length

    length = sqrt(dot_product(a, a))
  end function norm

  !> The lengths of the columns.
  pure function norms(a) result(length)
    real(wp), intent(in) :: a(:, :)
    real(wp) :: length(size(a, 2))

    length = sqrt(sum(a**2, 1))
  end function norms

  !> Third root, of the same digits in other units, which `x**(1/3)` has not.
  elemental function cube_root(x) result(root)
    real(wp), intent(in) :: x   !! >= 0
    real(wp) :: root
    integer :: thirds

    thirds = (exponent(x) - modulo(exponent(x), 3))/3
    root = scale(scale(x, -3*thirds)**(1.0_wp/3.0_wp), thirds)
  end function cube_root

  !> Distance of two points.
  pure function distance(a, b) result(length)
    real(wp), intent(in) :: a(3), b(3)
    real(wp) :: length

    length = norm(a - b)
  end function distance

  !> The vector (or quaternion) divided by its length; a zero vector stays zero.
  pure function normalised(q) result(r)
    real(wp), intent(in) :: q(:)
    real(wp) :: r(size(q))
    real(wp) :: length

    length = norm(q)
    r = q
    if (length > 0.0_wp) r = q/length
  end function normalised

  !> Product a b: the rotation b followed by the rotation a.
  pure function quaternion_product(a, b) result(c)
    real(wp), intent(in) :: a(4), b(4)
    real(wp) :: c(4)

    c(1) = a(1)*b(1) - dot_product(a(2:4), b(2:4))
    c(2:4) = a(1)*b(2:4) + b(1)*a(2:4) + cross(a(2:4), b(2:4))
  end function quaternion_product

  !> Rotation by an angle about an axis of any length, right-handed.
  pure function quaternion_from_axis(axis, angle_rad) result(q)
    real(wp), intent(in) :: axis(3)
    real(wp), intent(in) :: angle_rad   !! [rad]
    real(wp) :: q(4)

    q(1) = cos(0.5_wp*angle_rad)
    q(2:4) = sin(0.5_wp*angle_rad)*normalised(axis)
  end function quaternion_from_axis

  !> Rotation by the vector w = angle*axis; exact also as w goes to zero.
  pure function quaternion_exp(w) result(q)
    real(wp), intent(in) :: w(3)   !! rotation vector [rad]
    real(wp) :: q(4)
    real(wp), parameter :: small = 1.0e-4_wp   !! where the next term of the series is below 1e-17
    real(wp) :: angle, sine_over_angle

    angle = norm(w)
    if (angle > small) then
      sine_over_angle = sin(0.5_wp*angle)/angle
    else
      sine_over_angle = 0.5_wp - angle**2/48.0_wp
    end if
    q(1) = cos(0.5_wp*angle)
    q(2:4) = sine_over_angle*w
  end function quaternion_exp

  !> The rotation vector of a unit quaternion, the inverse of `quaternion_exp`, at most half a turn
  !! [rad].
  pure function quaternion_log(q) result(w)
    real(wp), intent(in) :: q(4)
    real(wp) :: w(3)
    real(wp) :: sine

    sine = norm(q(2:4))
    w = 0.0_wp
    if (sine > 0.0_wp) w = 2.0_wp*atan2(sine, abs(q(1)))/sine*q(2:4)
    if (q(1) < 0.0_wp) w = -w
  end function quaternion_log

  !> Matrix r from body to space axes, x_space = matmul(r, x_body), for a unit quaternion.
  pure function rotation_matrix(q) result(r)
    real(wp), intent(in) :: q(4)
    real(wp) :: r(3, 3)
    real(wp) :: w, x, y, z

    w = q(1)
    x = q(2)
    y = q(3)
    z = q(4)
    r(:, 1) = [1 - 2*(y*y + z*z), 2*(x*y + w*z), 2*(x*z - w*y)]
    r(:, 2) = [2*(x*y - w*z), 1 - 2*(x*x + z*z), 2*(y*z + w*x)]
    r(:, 3) = [2*(x*z + w*y), 2*(y*z - w*x), 1 - 2*(x*x + y*y)]
  end function rotation_matrix

  !> Inverse of a regular 3 x 3 matrix.
  pure function inverse3(a) result(b)
    real(wp), intent(in) :: a(3, 3)
    real(wp) :: b(3, 3)
    real(wp) :: determinant

    b(1, :) = cross(a(:, 2), a(:, 3))
    b(2, :) = cross(a(:, 3), a(:, 1))
    b(3, :) = cross(a(:, 1), a(:, 2))
    determinant = dot_product(b(1, :), a(:, 1))
    b = b/determinant
  end function inverse3

end module vectors_m
