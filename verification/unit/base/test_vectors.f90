!> Vector algebra, rotations and small solves, checked by identities.
module test_vectors_m
  use check_m, only: check, wp, pi
  use vectors_m, only: cross, norm, normalised, quaternion_product, quaternion_from_axis, &
    quaternion_exp, rotation_matrix, inverse3
  use rotations_m, only: rotate
  implicit none
  private
  public :: test_vectors

  real(wp), parameter :: ex(3) = [1.0_wp, 0.0_wp, 0.0_wp], ey(3) = [0.0_wp, 1.0_wp, 0.0_wp]
  real(wp), parameter :: ez(3) = [0.0_wp, 0.0_wp, 1.0_wp], round_off = 16*epsilon(1.0_wp)
  real(wp), parameter :: eye(3, 3) = reshape([ex, ey, ez], [3, 3])

contains

  subroutine test_vectors()
    call test_products()
    call test_quarter_turns()
    call test_random_rotations()
    call test_small_angles()
  end subroutine test_vectors

  subroutine test_products()
    call check('x cross y is z', cross(ex, ey), ez)
    call check('y cross z is x', cross(ey, ez), ex)
    call check('z cross x is y', cross(ez, ex), ey)
    call check('length', norm([2.0_wp, 3.0_wp, 6.0_wp]), 7.0_wp, round_off)
    call check('a unit', norm(normalised([1.0_wp, -2.0_wp, 5.0_wp, 9.0_wp])), 1.0_wp, round_off)
    call check('zero stays zero', normalised([0.0_wp, 0.0_wp]), [0.0_wp, 0.0_wp])
  end subroutine test_products

  !> Right-handed: a quarter turn about z takes x to y.
  subroutine test_quarter_turns()
    call check('about z', rotate(quaternion_from_axis(3*ez, pi/2), ex), ey, round_off)
    call check('about x', rotate(quaternion_from_axis(ex, pi/2), ey), ez, round_off)
    call check('about y', rotate(quaternion_from_axis(ey, pi/2), ez), ex, round_off)
    call check('product: right factor first', rotate(quaternion_product( &
      quaternion_from_axis(ex, pi/2), quaternion_from_axis(ez, pi/2)), ex), ez, round_off)
  end subroutine test_quarter_turns

  !> The matrix is a proper rotation, does what `rotate` does and multiplies like the quaternions.
  subroutine test_random_rotations()
    real(wp) :: p(4), q(4), r(3, 3), v(3)
    integer :: i

    do i = 1, 20
      call random_number(p)
      call random_number(q)
      call random_number(v)
      p = normalised(p - 0.5_wp)
      q = normalised(q - 0.5_wp)
      r = rotation_matrix(q)
      call check('orthogonal', [matmul(r, transpose(r))], [eye], round_off)
      call check('determinant', dot_product(cross(r(:, 1), r(:, 2)), r(:, 3)), 1.0_wp, round_off)
      call check('matrix and quaternion', matmul(r, v), rotate(q, v), round_off)
      call check('composition', [rotation_matrix(quaternion_product(p, q))], &
        [matmul(rotation_matrix(p), r)], round_off)
      call check('inverse', [matmul(inverse3(2*r), r)], [0.5_wp*eye], round_off)
    end do
  end subroutine test_random_rotations

  subroutine test_small_angles()
    real(wp) :: w(3), q(4)
    integer :: i

    do i = 0, 12
      w = [0.3_wp, -0.5_wp, 0.7_wp]*10.0_wp**(-i)
      q = quaternion_exp(w)
      call check('exponential is axis and angle', q, quaternion_from_axis(w, norm(w)), round_off)
      call check('small part keeps its digits', q(2:4)*10.0_wp**i, &
        10.0_wp**i*sin(0.5_wp*norm(w))*normalised(w), round_off)
    end do
    call check('none', quaternion_exp([0.0_wp, 0.0_wp, 0.0_wp]), [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
  end subroutine test_small_angles

end module test_vectors_m
