!> Two bodies seen from one another, and how far their points move.
module test_meeting_m
  use kinds_m, only: wp
  use check_m, only: check
  use vectors_m, only: rotation_matrix, quaternion_from_axis, quaternion_product
  use random_counter_m, only: random_rotation
  use meeting_m, only: poses_t, view_t, meeting_t, update_views, inverse_view, seen_from, &
    box_in_view, way_between
  use two_cubes_m, only: vector
  implicit none
  private
  public :: test_meeting

contains

  subroutine test_meeting()
    call check_views()
    call check_box()
    call check_way()
  end subroutine test_meeting

  !> A place of a in space, and from there in the axes of b; and the way back.
  subroutine check_views()
    type(meeting_t) :: now
    real(wp) :: p(3), seen(3)
    integer :: i

    do i = 1, 10
      now%turn_a = rotation_matrix(random_rotation(1, i))
      now%turn_b = rotation_matrix(random_rotation(2, i))
      now%to_b = vector(i, 1)
      call update_views(now)
      p = vector(i, 2)
      seen = matmul(matmul(now%turn_a, p) - now%to_b, now%turn_b)
      call check('a seen from b', seen_from(now%a_in_b, p), seen, 1.0e-15_wp)
      call check('b seen from a', seen_from(now%b_in_a, seen), p, 1.0e-15_wp)
      call check('the reverse of a view', seen_from(inverse_view(now%a_in_b), seen), p, 1.0e-15_wp)
    end do
  end subroutine check_views

  !> A box seen from elsewhere holds its corners, and no more than it has to.
  subroutine check_box()
    type(view_t) :: view
    real(wp) :: low(3), high(3), new_low(3), new_high(3), corner(3, 8)
    integer :: i, c

    do i = 1, 10
      view%turn = rotation_matrix(random_rotation(3, i))
      view%x = vector(i, 3)
      low = vector(i, 4) - 1.0_wp
      high = vector(i, 5) + 1.0_wp
      call box_in_view(view, low, high, new_low, new_high)
      do c = 0, 7
        corner(:, c + 1) = seen_from(view, merge(high, low, btest(c, [0, 1, 2])))
      end do
      call check('lower corner', new_low, minval(corner, 2), 1.0e-14_wp)
      call check('upper corner', new_high, maxval(corner, 2), 1.0e-14_wp)
    end do
  end subroutine check_box

  !> No two points within the radius move further against one another, and some move nearly as far.
  subroutine check_way()
    real(wp), parameter :: radius_a = 2.0_wp, radius_b = 1.0_wp, x(3) = [1.0_wp, 0.0_wp, 0.0_wp], &
      y(3) = [0.0_wp, 1.0_wp, 0.0_wp]
    type(poses_t) :: before, now
    real(wp) :: way, longest, turn
    integer :: i, k

    do i = 1, 10
      turn = 0.02_wp*i
      before = poses_t(vector(i, 6), vector(i, 7), random_rotation(4, i), random_rotation(5, i))
      now = before
      now%x_a = before%x_a + 0.1_wp*vector(i, 8)
      now%q_a = quaternion_product(quaternion_from_axis(y, turn), before%q_a)
      now%q_b = quaternion_product(quaternion_from_axis(x, 2*turn), before%q_b)
      way = way_between(before, now, radius_a, radius_b)
      longest = 0.0_wp
      do k = 1, 100
        longest = max(longest, norm2(place(now%x_a, now%q_a, radius_a, 2*k) &
          - place(before%x_a, before%q_a, radius_a, 2*k) &
          - place(now%x_b, now%q_b, radius_b, 2*k + 1) &
          + place(before%x_b, before%q_b, radius_b, 2*k + 1)))
      end do
      call check('none goes further', longest <= way)
      call check('some nearly as far', longest > 0.6_wp*way)
    end do
    now = before
    now%q_a = quaternion_product(quaternion_from_axis(y, 0.1_wp), before%q_a)
    way = way_between(before, now, radius_a, radius_b)
    call check('a turn alone', way, 4*radius_a*sin(0.1_wp/4), 1.0e-14_wp)
  end subroutine check_way

  !> Point number k at a distance from the centre of a body.
  pure function place(x, q, radius, k) result(p)
    real(wp), intent(in) :: x(3), q(4), radius
    integer, intent(in) :: k
    real(wp) :: p(3)

    p = vector(k, 9)
    p = x + matmul(rotation_matrix(q), radius*p/norm2(p))
  end function place

end module test_meeting_m
