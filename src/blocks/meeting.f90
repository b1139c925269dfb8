!> How two bodies that may touch stand to one another, and each seen from the other.
module meeting_m
  use kinds_m, only: wp
  use vectors_m, only: cross, norm
  implicit none
  private
  public :: poses_t, view_t, meeting_t
  public :: update_views, inverse_view, seen_from, box_in_view, way_between, closes

  !> Poses of a pair of bodies.
  type :: poses_t
    real(wp) :: x_a(3) = 0.0_wp, x_b(3) = 0.0_wp, q_a(4) = 0.0_wp, q_b(4) = 0.0_wp
  end type poses_t

  !> One body seen from the other: a place p in its axes is turn.p + x in those of the other.
  type :: view_t
    real(wp) :: turn(3, 3) = 0.0_wp    !! [-]
    real(wp) :: x(3) = 0.0_wp          !! [m]
  end type view_t

  !> Bodies a and b, or body a and the bed, at one moment.
  type :: meeting_t
    type(poses_t) :: poses
    real(wp) :: turn_a(3, 3) = 0.0_wp, turn_b(3, 3) = 0.0_wp   !! body axes to space
    real(wp) :: to_b(3) = 0.0_wp       !! from the centre of a to that of b, space [m]
    real(wp) :: speed = 0.0_wp         !! of any two points against one another, at most [m/s]
    real(wp) :: gap = 0.0_wp           !! still taken as a contact point [m]
    real(wp) :: margin = 0.0_wp        !! part of it whatever the speed [m]
    real(wp) :: ahead = 0.0_wp         !! time in which contacts may come [s]
    real(wp) :: v(3) = 0.0_wp          !! of a past b, space [m/s]
    real(wp) :: omega_a(3) = 0.0_wp, omega_b(3) = 0.0_wp       !! spins, space [rad/s]
    type(view_t) :: a_in_b, b_in_a     !! see `update_views`
  end type meeting_t

contains

  !> Each body seen from the other.
  pure subroutine update_views(now)
    type(meeting_t), intent(inout) :: now

    now%a_in_b%turn = matmul(transpose(now%turn_b), now%turn_a)
    now%a_in_b%x = matmul(-now%to_b, now%turn_b)
    now%b_in_a%turn = transpose(now%a_in_b%turn)
    now%b_in_a%x = matmul(now%to_b, now%turn_a)
  end subroutine update_views

  !> The other body seen from the one.
  pure function inverse_view(view) result(inverse)
    type(view_t), intent(in) :: view
    type(view_t) :: inverse

    inverse%turn = transpose(view%turn)
    inverse%x = -matmul(view%x, view%turn)
  end function inverse_view

  !> A place of one body in the axes of the other [m].
  pure function seen_from(view, place) result(seen)
    type(view_t), intent(in) :: view
    real(wp), intent(in) :: place(3)   !! [m]
    real(wp) :: seen(3)

    seen = view%x + matmul(view%turn, place)
  end function seen_from

  !> Box in the axes of the other body around a box.
  pure subroutine box_in_view(view, low, high, new_low, new_high)
    type(view_t), intent(in) :: view
    real(wp), intent(in) :: low(3), high(3)           !! [m]
    real(wp), intent(out) :: new_low(3), new_high(3)  !! [m]
    real(wp) :: middle(3), half(3)

    middle = seen_from(view, 0.5_wp*(low + high))
    half = matmul(abs(view%turn), 0.5_wp*(high - low))
    new_low = middle - half
    new_high = middle + half
  end subroutine box_in_view

  !> Largest way that points of two bodies move against one another from one pair of poses to
  !! another [m].
  pure function way_between(before, now, radius_a, radius_b) result(way)
    type(poses_t), intent(in) :: before, now
    real(wp), intent(in) :: radius_a, radius_b   !! of the bodies [m]
    real(wp) :: way

    ! a turn by phi: |dq| = 2 sin(phi/4), and a point at distance r moves 4 r sin(phi/4) at most
    way = norm((now%x_a - before%x_a) - (now%x_b - before%x_b)) &
      + 2*radius_a*norm(now%q_a - before%q_a) + 2*radius_b*norm(now%q_b - before%q_b)
  end function way_between

  !> Whether two places touch, or come as near as the margin in the time ahead. Where there is one,
  !! others are left out: contact points to come that the bodies pass by would hold them.
  pure function closes(now, arm_a, arm_b, normal, depth) result(yes)
    type(meeting_t), intent(in) :: now
    real(wp), intent(in) :: arm_a(3), arm_b(3)   !! from the centres, space [m]
    real(wp), intent(in) :: normal(3)            !! from a to b, space [-]
    real(wp), intent(in) :: depth                !! now [m]
    logical :: yes
    real(wp) :: closing(3)

    yes = depth > 0.0_wp .or. now%margin <= 0.0_wp
    if (yes) return
    closing = now%v + cross(now%omega_a, arm_a) - cross(now%omega_b, arm_b)
    yes = depth + now%margin + now%ahead*dot_product(normal, closing) > 0.0_wp
  end function closes

end module meeting_m
