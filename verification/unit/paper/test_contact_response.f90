!> Response of contact points: damping of a pair, stiffness under a load, longest substep.
module test_contact_response_m
  use check_m, only: check, wp
  use case_types_m, only: contact_input_t
  use contact_points_m, only: contact_point_t, contact_points_t, add_point
  use contact_laws_m, only: choose_law
  use counterparts_m, only: counterparts_t
  use contact_response_m, only: response_t, respond, stiffness_limit
  use two_cubes_m, only: free_bodies
  implicit none
  private
  public :: test_contact_response

  real(wp), parameter :: mass(3) = [2.0_wp, 3.0_wp, 6.0_wp]   !! of three balls [kg]
  real(wp), parameter :: z(3) = [0.0_wp, 0.0_wp, 1.0_wp]
  type(response_t) :: response
  type(counterparts_t) :: counterparts

contains

  subroutine test_contact_response()
    call make_balls()
    call check_damping()
    call check_oblique()
    call check_limit()
    call check_load()
  end subroutine test_contact_response

  !> Three balls that do not turn.
  subroutine make_balls()
    type(contact_input_t) :: input

    input%restitution = 0.3_wp
    call free_bodies(mass, counterparts, response)
    call choose_law(input, response%law)
  end subroutine make_balls

  !> So many contact points between balls a and b along z.
  subroutine add_ball_points(a, b, n, points)
    integer, intent(in) :: a, b, n
    type(contact_points_t), intent(inout) :: points
    integer :: t

    do t = 1, n
      call add_point(contact_point_t(a, b, t, normal=-z, depth=1.0e-6_wp), points)
    end do
  end subroutine add_ball_points

  !> Two contact points along oblique normals damp the swing that they drive together.
  subroutine check_oblique()
    real(wp), parameter :: depth = 1.0e-6_wp, s(2) = [0.5_wp, -0.5_wp], c = sqrt(0.75_wp)
    type(contact_points_t) :: points
    real(wp) :: reduced, k
    integer :: t

    do t = 1, 2
      call add_point(contact_point_t(2, 1, t, normal=[s(t), 0.0_wp, -c], depth=depth), points)
    end do
    call respond(points, counterparts, response)
    reduced = 1/(1/mass(1) + 1/mass(2))
    k = 2*c**2*response%elastic(1)/depth   ! of both along z
    call check('damping of oblique contact points', 2*c**2*response%eta(1:2), &
      2*response%law%damping_ratio*sqrt(k*reduced), 1.0e-6_wp*sqrt(k*reduced))
  end subroutine check_oblique

  !> One contact point damps with the ratio of the law, and so do many together.
  subroutine check_damping()
    type(contact_points_t) :: one, many
    real(wp) :: reduced, k, eta

    reduced = 1/(1/mass(1) + 1/mass(2))
    k = response%law%normal_constant(reduced, 0.0_wp, 0.0_wp, 1.0_wp)
    call add_ball_points(2, 1, 1, one)
    call respond(one, counterparts, response)
    eta = 2*response%law%damping_ratio*sqrt(k*reduced)
    call check('damping of one contact point', response%eta(1), eta, 1.0e-6_wp*eta)
    call check('its decay', response%decay(1), 0.5_wp*eta/reduced, 1.0e-6_wp*eta/reduced)
    call check('its force', response%elastic(1), k*1.0e-6_wp, 1.0e-6_wp*k*1.0e-6_wp)
    call add_ball_points(2, 1, 4, many)
    call respond(many, counterparts, response)
    call check('four are twice as fast', sum(response%eta(:4)), 2*eta, 1.0e-6_wp*eta)
    call check('each by its share', response%eta(3), 0.5_wp*eta, 1.0e-6_wp*eta)
    call check('with one decay', response%decay(2), eta/reduced, 1.0e-6_wp*eta/reduced)
  end subroutine check_damping

  !> What bounds a substep: the frequency of a pair, and stiffness and damping of all contact points
  !! of two bodies over what each sets against a force, rotation included.
  subroutine check_limit()
    real(wp), parameter :: arm(3) = [0.5_wp, 0.0_wp, 0.0_wp], inverse_inertia = 4.0_wp
    type(contact_points_t) :: points
    real(wp) :: at_2, k(2), eta(2)
    integer :: i

    do i = 1, 3
      counterparts%inverse_inertia(i, i, 2) = inverse_inertia
    end do
    at_2 = 1/mass(2) + inverse_inertia*arm(1)**2
    call add_point(contact_point_t(2, 1, 1, arm_a=arm, normal=-z, depth=1.0e-6_wp), points)
    call add_point(contact_point_t(3, 2, 1, arm_b=arm, normal=-z, depth=1.0e-6_wp), points)
    call respond(points, counterparts, response)
    k = response%k(1:2)
    call check('the faster pair', stiffness_limit(points, response), 0.35_wp/sqrt(max(k(1) &
      *(1/mass(1) + at_2), k(2)*(1/mass(3) + at_2))), 1.0e-9_wp)
    response%frequency2 = 0.0_wp
    call check('two pairs', stiffness_limit(points, response), 1.2_wp/sqrt(max(k(1)*(1/mass(1) &
      + at_2) + k(2)*at_2, k(2)*(1/mass(3) + at_2) + k(1)*at_2)), 1.0e-9_wp)
    response%stiffness = 0.0_wp
    eta = response%eta(1:2)
    call check('by their dashpots', stiffness_limit(points, response), 4.0_wp/max(eta(1) &
      *(1/mass(1) + at_2) + eta(2)*at_2, eta(2)*(1/mass(3) + at_2) + eta(1)*at_2), 1.0e-9_wp)
    response%damping = 0.0_wp
    call check('nothing pushes', stiffness_limit(points, response) > 1.0e30_wp)
    counterparts%inverse_inertia = 0.0_wp
  end subroutine check_limit

  !> A pair carries the heaviest body within what the smaller of the two may give way.
  subroutine check_load()
    type(contact_points_t) :: points

    counterparts%heaviest = 1.0e9_wp
    counterparts%gravity = 10.0_wp
    response%rest_overlap(1) = 1.0e-2_wp
    call add_ball_points(2, 1, 1, points)
    call respond(points, counterparts, response)
    call check('stiffness under a load', response%k(1), 1.0e12_wp, 1.0_wp)
    counterparts%heaviest = 0.0_wp
    counterparts%gravity = 0.0_wp
    response%rest_overlap = 1.0_wp
  end subroutine check_load

end module test_contact_response_m
