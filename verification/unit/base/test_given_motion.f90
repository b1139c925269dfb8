!> Bodies moved by a table: through its rows, at rest outside, smooth, rates those of the pose.
module test_given_motion_m
  use check_m, only: check, wp
  use vectors_m, only: quaternion_from_axis, quaternion_product, quaternion_log, quaternion_exp
  use given_motion_m, only: given_motion_t, given_motion_init, pose_at, fastest_between
  implicit none
  private
  public :: test_given_motion

contains

  subroutine test_given_motion()
    real(wp), parameter :: w(3) = [0.3_wp, -1.1_wp, 0.7_wp]

    call check('logarithm', quaternion_log(quaternion_exp(w)), w, 1.0e-15_wp)
    call check('the shorter way', quaternion_log(-quaternion_exp(w)), w, 1.0e-15_wp)
    call check('of none', quaternion_log([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]), 0.0_wp)
    call check_rows_and_rates()
    call check_hinge()
    call check_steady()
    call check_one_row()
  end subroutine test_given_motion

  !> A motion with uneven times and turns about all axes.
  subroutine make_any(time, x, q, motion)
    real(wp), intent(out) :: time(5), x(3, 5), q(4, 5)
    type(given_motion_t), intent(out) :: motion
    integer :: i

    time = [1.0_wp, 1.3_wp, 2.0_wp, 2.1_wp, 4.0_wp]
    q(:, 1) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    do i = 1, 5
      x(:, i) = [sin(1.1_wp*i), i**2*0.1_wp, cos(3.0_wp*i)]
      if (i > 1) q(:, i) = quaternion_product(quaternion_from_axis([1.0_wp, 0.3_wp*i, &
        -0.1_wp*i**2], 0.2_wp*i), q(:, i - 1))
    end do
    q(:, 3) = -2.0_wp*q(:, 3)   ! the same attitude
    call given_motion_init(time, x, q, motion)
  end subroutine make_any

  subroutine check_rows_and_rates()
    type(given_motion_t) :: motion
    real(wp) :: time(5), x(3, 5), q(4, 5), at(3), turned(4), v(3), omega(3), t
    real(wp) :: before(3), after(3), back(4), ahead(4), fastest(2), spin(3)
    real(wp), parameter :: h = 1.0e-5_wp
    integer :: i

    call make_any(time, x, q, motion)
    do i = 1, 5
      call pose_at(motion, time(i), at, turned, v, omega)
      call check('through the place of a row', at, x(:, i), 1.0e-15_wp)
      call check('attitude', abs(dot_product(turned, q(:, i)/norm2(q(:, i)))), 1.0_wp, 1.0e-15_wp)
    end do
    call check('starts and ends at rest', [v, omega], spread(0.0_wp, 1, 6))
    call pose_at(motion, 0.5_wp, at, turned, v, omega)
    call check('held before', [at - x(:, 1), v, omega], spread(0.0_wp, 1, 9))
    call pose_at(motion, 9.0_wp, at, turned, v, omega)
    call check('held after', [at - x(:, 5), v, omega], spread(0.0_wp, 1, 9))
    ! differences: an error of h^2 times the third derivative, and round-off over h
    do i = 1, 300
      t = 0.9_wp + 0.0107_wp*i
      call pose_at(motion, t - h, before, back, v, omega)
      call pose_at(motion, t + h, after, ahead, v, omega)
      call pose_at(motion, t, at, turned, v, omega)
      call check('a unit quaternion', norm2(turned), 1.0_wp, 4.0_wp*epsilon(1.0_wp))
      if (any(abs(time - t) < 2*h)) cycle
      call check('velocity', (after - before)/(2*h), v, 1.0e-5_wp)
      spin = quaternion_log(quaternion_product(ahead, [back(1), -back(2:4)]))/(2*h)
      call check('angular velocity', spin, omega, 1.0e-5_wp)
      fastest = fastest_between(motion, t, t + 0.01_wp)
      call check('bounds', fastest(1) >= norm2(v)*(1.0_wp - 1.0e-12_wp) .and. fastest(2) &
        >= norm2(omega)*(1.0_wp - 1.0e-12_wp))
    end do
    do i = 1, 5   ! continuous rates
      call pose_at(motion, time(i)*(1.0_wp - 1.0e-14_wp), at, turned, before, spin)
      call pose_at(motion, time(i), at, turned, v, omega)
      call check('no jump at a row', [before - v, spin - omega], spread(0.0_wp, 1, 6), 1.0e-10_wp)
    end do
  end subroutine check_rows_and_rates

  !> A door of two rows turns about its hinge by 3 s^2 - 2 s^3 of its way and passes no stop; one of
  !! several rows neither swings back nor beyond.
  subroutine check_hinge()
    type(given_motion_t) :: motion
    real(wp), parameter :: axis(3) = [0.0_wp, 1.0_wp, 0.0_wp]
    real(wp) :: angle(4), q(4, 4), x(3, 4), at(3), turned(4), v(3), omega(3), s, last
    integer :: i

    x = 0.0_wp
    angle = [0.0_wp, 1.2_wp, 0.0_wp, 0.0_wp]
    do i = 1, 2
      q(:, i) = quaternion_from_axis(axis, angle(i))
    end do
    call given_motion_init([0.0_wp, 2.0_wp], x(:, :2), q(:, :2), motion)
    do i = 0, 10
      s = 0.1_wp*i
      call pose_at(motion, 2.0_wp*s, at, turned, v, omega)
      call check('angle', turned, quaternion_from_axis(axis, 1.2_wp*s**2*(3.0_wp - 2.0_wp*s)), &
        1.0e-15_wp)
      call check('spin', omega, 1.2_wp*3.0_wp*s*(1.0_wp - s)*axis, 1.0e-15_wp)
    end do
    call check('fastest', fastest_between(motion, 0.1_wp, 0.2_wp), [0.0_wp, 0.9_wp], 1.0e-15_wp)
    call check('none later', maxval(fastest_between(motion, 2.0_wp, 3.0_wp)), 0.0_wp)
    call check('none before', maxval(fastest_between(motion, -2.0_wp, -1.0_wp)), 0.0_wp)

    angle = [0.0_wp, 0.0_wp, 0.1_wp, 1.2_wp]
    do i = 1, 4
      q(:, i) = quaternion_from_axis(axis, angle(i))
    end do
    call given_motion_init([0.0_wp, 1.0_wp, 2.0_wp, 2.5_wp], x, q, motion)
    last = 0.0_wp
    do i = 0, 250
      call pose_at(motion, 0.01_wp*i, at, turned, v, omega)
      s = 2.0_wp*atan2(turned(3), turned(1))
      call check('turns one way only', s >= last - 1.0e-15_wp .and. s <= 1.2_wp + 1.0e-15_wp)
      if (i <= 100) call check('held', abs(s), 0.0_wp)
      last = s
    end do
    call given_motion_init([0.0_wp, 1.0_wp, 2.0_wp, 2.5_wp], x, q(:, [1, 4, 3, 1]), motion)
    do i = 0, 250
      call pose_at(motion, 0.01_wp*i, at, turned, v, omega)
      s = 2.0_wp*atan2(turned(3), turned(1))
      call check('turns back at a row', s >= -1.0e-15_wp .and. s <= 1.2_wp + 1.0e-15_wp)
    end do
  end subroutine check_hinge

  !> Rows of a steady motion: between the inner ones it is steady.
  subroutine check_steady()
    type(given_motion_t) :: motion
    real(wp) :: time(6), x(3, 6), q(4, 6), at(3), turned(4), v(3), omega(3)
    integer :: i

    do i = 1, 6
      time(i) = 0.5_wp*(i - 1)
      x(:, i) = time(i)*[1.0_wp, -2.0_wp, 0.5_wp]
      q(:, i) = quaternion_from_axis([1.0_wp, 1.0_wp, 0.0_wp], time(i))
    end do
    call given_motion_init(time, x, q, motion)
    do i = 0, 20
      call pose_at(motion, 0.5_wp + 0.075_wp*i, at, turned, v, omega)
      call check('steady velocity', v, [1.0_wp, -2.0_wp, 0.5_wp], 1.0e-14_wp)
      call check('steady spin', omega, [1.0_wp, 1.0_wp, 0.0_wp]/sqrt(2.0_wp), 1.0e-14_wp)
      call check('place', at, (0.5_wp + 0.075_wp*i)*[1.0_wp, -2.0_wp, 0.5_wp], 1.0e-14_wp)
    end do
  end subroutine check_steady

  subroutine check_one_row()
    type(given_motion_t) :: motion
    real(wp) :: at(3), turned(4), v(3), omega(3)

    call given_motion_init([1.0_wp], reshape([1.0_wp, 2.0_wp, 3.0_wp], [3, 1]), &
      reshape([0.0_wp, 0.0_wp, 2.0_wp, 0.0_wp], [4, 1]), motion)
    call pose_at(motion, 2.0_wp, at, turned, v, omega)
    call check('held for ever', [at, turned, v, omega], &
      [1.0_wp, 2.0_wp, 3.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, spread(0.0_wp, 1, 6)])
    call check('no speed', maxval(fastest_between(motion, 0.0_wp, 2.0_wp)), 0.0_wp)
  end subroutine check_one_row

end module test_given_motion_m
