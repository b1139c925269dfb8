!> Motion of a fixed body by a table of times, places and attitudes: smooth between its rows, held
!! before the first and after the last.
!!
!! In each interval place and attitude are cubic curves with given velocities at both ends, so
!! velocity and angular velocity are continuous. With the control steps d1, d2, d3 of the interval,
!!
!!     x(t) = x0 + B1 d1 + B2 d2 + B3 d3,   q(t) = exp(B3 w3) exp(B2 w2) exp(B1 w1) q0,
!!     B1 = 1 - (1 - s)^3,  B2 = 3 s^2 - 2 s^3,  B3 = s^3,  s = (t - t0)/h
!!
!! Source: Kim, Kim and Shin (1995), A general construction scheme for unit quaternion curves,
!! SIGGRAPH. The velocities at the rows are those of Fritsch and Butland (1984), SIAM J. Sci. Stat.
!! Comput. 5, 300-304, in each component: nothing swings beyond its rows, and a motion starts and
!! ends at rest.
module given_motion_m
  use kinds_m, only: wp
  use vectors_m, only: norms, quaternion_exp, quaternion_log, quaternion_product, normalised, &
    rotation_matrix
  implicit none
  private
  public :: given_motion_t, given_motion_init, pose_at, fastest_between

  type :: given_motion_t
    integer :: n = 0                             !! rows; 0: no motion
    real(wp), allocatable :: time(:)             !! (n) ascending [s]
    real(wp), allocatable :: x(:, :), q(:, :)    !! (3, n) [m], (4, n) unit quaternions
    real(wp), allocatable :: step(:, :, :)       !! (6, 3, n - 1) d and w of each interval [m, rad]
    real(wp), allocatable :: fastest(:, :)
      !! (2, n - 1) bounds of speed and spin in each interval [m/s, rad/s]
  end type given_motion_t

contains

  !> The motion of a table.
  pure subroutine given_motion_init(time, x, q, motion)
    real(wp), intent(in) :: time(:)              !! (n) ascending [s]
    real(wp), intent(in) :: x(:, :), q(:, :)     !! (3, n) [m], (4, n) of any length
    type(given_motion_t), intent(out) :: motion
    real(wp) :: way(6, size(time) - 1), rate(6, size(time)), h, middle(4)
    integer :: i, k, n

    n = size(time)
    motion%n = n
    motion%time = time
    motion%x = x
    allocate (motion%q(4, n), motion%step(6, 3, n - 1), motion%fastest(2, n - 1))
    do i = 1, n
      motion%q(:, i) = normalised(q(:, i))
      if (i == 1) cycle
      if (dot_product(motion%q(:, i), motion%q(:, i - 1)) < 0.0_wp) motion%q(:, i) = -motion%q(:, i)
    end do
    do i = 1, n - 1
      way(1:3, i) = x(:, i + 1) - x(:, i)
      way(4:6, i) = quaternion_log(quaternion_product(motion%q(:, i + 1), inverse(motion%q(:, i))))
    end do
    rate = 0.0_wp
    do i = 2, n - 1
      rate(:, i) = rate_at_row(way(:, i - 1)/(time(i) - time(i - 1)), &
        way(:, i)/(time(i + 1) - time(i)), time(i) - time(i - 1), time(i + 1) - time(i))
    end do
    do i = 1, n - 1
      h = time(i + 1) - time(i)
      associate (step => motion%step(:, :, i))
        step(:, 1) = rate(:, i)*h/3.0_wp
        step(:, 3) = rate(:, i + 1)*h/3.0_wp
        step(:, 2) = way(:, i) - step(:, 1) - step(:, 3)
        middle = quaternion_product(motion%q(:, i + 1), &
          inverse(quaternion_product(quaternion_exp(step(4:6, 1)), motion%q(:, i))))
        step(4:6, 2) = quaternion_log(quaternion_product(quaternion_exp(-step(4:6, 3)), middle))
        do k = 1, 2
          motion%fastest(k, i) = bound(norms(step(3*k - 2:3*k, :))*3.0_wp/h)
        end do
      end associate
    end do
  end subroutine given_motion_init

  !> The conjugate of a unit quaternion.
  pure function inverse(q) result(r)
    real(wp), intent(in) :: q(4)
    real(wp) :: r(4)

    r = [q(1), -q(2:4)]
  end function inverse

  !> Rate of a component at a row from the mean rates before and after it: 0 where these differ in
  !! sign, else their weighted harmonic mean.
  elemental function rate_at_row(before, after, h_before, h_after) result(rate)
    real(wp), intent(in) :: before, after      !! [1/s]
    real(wp), intent(in) :: h_before, h_after  !! [s]
    real(wp) :: rate

    rate = 0.0_wp
    if (before*after <= 0.0_wp) return
    rate = 3.0_wp*(h_before + h_after)/((h_before + 2.0_wp*h_after)/before &
      + (2.0_wp*h_before + h_after)/after)
  end function rate_at_row

  !> Bound of c1 (1 - s)^2 + c2 2 s (1 - s) + c3 s^2 for s from 0 to 1: the largest coefficient of
  !! its two halves.
  pure function bound(c) result(most)
    real(wp), intent(in) :: c(3)   !! not negative
    real(wp) :: most

    most = max(c(1), 0.5_wp*(c(1) + c(2)), 0.25_wp*(c(1) + 2.0_wp*c(2) + c(3)), &
               0.5_wp*(c(2) + c(3)), c(3))
  end function bound

  !> Number of the interval that holds a time: 0 before the first row, n from the last one on.
  pure function interval_at(motion, t) result(i)
    type(given_motion_t), intent(in) :: motion
    real(wp), intent(in) :: t   !! [s]
    integer :: i
    integer :: high, middle

    i = 0
    high = motion%n + 1
    do while (high - i > 1)
      middle = (i + high)/2
      if (motion%time(middle) <= t) then
        i = middle
      else
        high = middle
      end if
    end do
  end function interval_at

  !> Pose and rates at a time.
  pure subroutine pose_at(motion, t, x, q, v, omega)
    type(given_motion_t), intent(in) :: motion
    real(wp), intent(in) :: t                    !! [s]
    real(wp), intent(out) :: x(3), q(4)          !! [m], unit quaternion
    real(wp), intent(out) :: v(3), omega(3)      !! space frame [m/s], [rad/s]
    real(wp) :: s, b(3), db(3), turn(4)
    integer :: i, k

    i = interval_at(motion, t)
    v = 0.0_wp
    omega = 0.0_wp
    if (i == 0 .or. i == motion%n) then
      x = motion%x(:, max(i, 1))
      q = motion%q(:, max(i, 1))
      return
    end if
    associate (h => motion%time(i + 1) - motion%time(i), step => motion%step(:, :, i))
      s = (t - motion%time(i))/h
      b = [s*(3.0_wp - s*(3.0_wp - s)), s**2*(3.0_wp - 2.0_wp*s), s**3]
      db = [3.0_wp*(1.0_wp - s)**2, 6.0_wp*s*(1.0_wp - s), 3.0_wp*s**2]/h
      x = motion%x(:, i) + matmul(step(1:3, :), b)
      v = matmul(step(1:3, :), db)
      q = motion%q(:, i)
      do k = 1, 3
        turn = quaternion_exp(b(k)*step(4:6, k))
        q = quaternion_product(turn, q)
        omega = matmul(rotation_matrix(turn), omega) + db(k)*step(4:6, k)
      end do
      q = normalised(q)
    end associate
  end subroutine pose_at

  !> Bounds of speed and spin between two times [m/s, rad/s].
  pure function fastest_between(motion, from, to) result(fastest)
    type(given_motion_t), intent(in) :: motion
    real(wp), intent(in) :: from, to   !! from <= to [s]
    real(wp) :: fastest(2)
    integer :: i

    fastest = 0.0_wp
    do i = max(1, interval_at(motion, from)), min(interval_at(motion, to), motion%n - 1)
      fastest = max(fastest, motion%fastest(:, i))
    end do
  end function fastest_between

end module given_motion_m
