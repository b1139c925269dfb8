!> Response of contact points: damping of a pair, forces of an energy, highest frequencies.
module test_contact_response_m
  use check_m, only: check, wp
  use case_types_m, only: contact_input_t
  use contact_points_m, only: contact_point_t, contact_points_t, add_point
  use contact_law_m, only: contact_law_t
  use contact_laws_m, only: choose_law
  use counterparts_m, only: counterparts_t, motion_t, wrench_t
  use contact_response_m, only: response_t, respond, highest_frequency2, bound_by_sums, &
    opening_speed, push_apart, impact_turn
  use two_cubes_m, only: vector, free_bodies
  implicit none
  private
  public :: test_contact_response

  real(wp), parameter :: mass(3) = [2.0_wp, 3.0_wp, 6.0_wp]   !! of three balls [kg]
  real(wp), parameter :: z(3) = [0.0_wp, 0.0_wp, 1.0_wp]
  class(contact_law_t), allocatable :: law
  type(counterparts_t) :: counterparts

contains

  subroutine test_contact_response()
    call make_balls()
    call check_damping()
    call check_beginning()
    call check_frequencies()
    call check_sums()
    call check_load()
    call check_power()
  end subroutine test_contact_response

  !> Three balls that do not turn, fast enough for impacts.
  subroutine make_balls()
    type(contact_input_t) :: input

    input%restitution = 0.3_wp
    call choose_law(input, law)
    call free_bodies(mass, counterparts)
    counterparts%v(3, 1) = 1.0e3_wp
    counterparts%v(3, 3) = -1.0e3_wp
  end subroutine make_balls

  !> Contact points (weight, depth) between balls a and b along z.
  subroutine add_ball_point(a, b, weight, points)
    integer, intent(in) :: a, b
    real(wp), intent(in) :: weight(:)
    type(contact_points_t), intent(inout) :: points
    integer :: t

    do t = 1, size(weight)
      call add_point(contact_point_t(a, b, t, normal=-z, depth=1.0e-6_wp, weight=weight(t)), points)
    end do
  end subroutine add_ball_point

  !> One contact point damps with the ratio of the law, and so do many together.
  subroutine check_damping()
    type(contact_points_t) :: one, many
    type(response_t) :: response
    real(wp) :: reduced, k, eta

    reduced = 1/(1/mass(1) + 1/mass(2))
    k = law%normal_constant(reduced, 0.0_wp, 0.0_wp, 1.0_wp)
    call add_ball_point(2, 1, [1.0_wp], one)
    call respond(one, law, counterparts, response)
    eta = 2*law%damping_ratio*sqrt(k*reduced)
    call check('damping of one contact point', response%eta(1), eta, 1.0e-6_wp*eta)
    call check('its decay', response%decay(1), 0.5_wp*eta/reduced, 1.0e-6_wp*eta/reduced)
    call check('its force', response%elastic(1), k*1.0e-6_wp, 1.0e-6_wp*k*1.0e-6_wp)
    call add_ball_point(2, 1, [0.1_wp, 0.3_wp, 0.4_wp, 0.2_wp], many)
    call respond(many, law, counterparts, response)
    call check('four that are as stiff as one', sum(response%eta(:4)), eta, 1.0e-6_wp*eta)
    call check('each by its share', response%eta(3), 0.4_wp*eta, 1.0e-6_wp*eta)
    call check('with one decay', response%decay(2), 0.5_wp*eta/reduced, 1.0e-6_wp*eta/reduced)
  end subroutine check_damping

  !> Deep inside a contact point begins across another one, with next to no weight that grows
  !! steeply with a shift. It moves as little mass as that says, and damps no more than it would
  !! alone.
  subroutine check_beginning()
    real(wp), parameter :: depth = 2.2e-3_wp, weight = 3.0e-10_wp, growth = 7.0e6_wp
    type(contact_points_t) :: points
    type(response_t) :: response
    real(wp) :: lever   ! change of depth that stands for a shift [-]

    call add_ball_point(2, 1, [1.0_wp], points)
    call add_point(contact_point_t(2, 1, 2, normal=[1.0_wp, 0.0_wp, 0.0_wp], depth=depth, &
                           weight=weight, weight_shift=[0.0_wp, growth, 0.0_wp]), points)
    call respond(points, law, counterparts, response)
    lever = sqrt(1.0_wp + (0.5_wp*depth*growth)**2)
    call check('a contact point that begins: damping', response%eta(2)/response%eta(1), &
               sqrt(weight)/lever, 1.0e-6_wp*sqrt(weight)/lever)
  end subroutine check_beginning

  !> A pair swings with sqrt(k/m*); a ball between two with both pairs, which has to be stable only.
  subroutine check_frequencies()
    type(contact_points_t) :: points
    type(response_t) :: response
    real(wp) :: pair(2), together

    call add_ball_point(2, 1, [1.0_wp], points)
    call add_ball_point(3, 2, [1.0_wp], points)
    call respond(points, law, counterparts, response)
    pair = law%normal_constant(1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp)   ! k/m* does not depend on the mass
    call check('frequency of a pair', response%pair_frequency2(:2), pair, 1.0e-6_wp*pair(1))
    call check('of the ball between two', response%frequency2(2), sum(pair), 1.0e-6_wp*sum(pair))
    call check('a wall has none', response%frequency2(-1), 0.0_wp)
    together = max(pair(1), sum(pair)*(impact_turn/1.2_wp)**2)
    call check('the highest', highest_frequency2(points, response), together, 1.0e-6_wp*together)
    pair = pair*100*[1, 100]
    response%frequency2(1:3) = 20*pair(2)
    together = pair(2)*39*(impact_turn/1.2_wp)**2
    response%pair_frequency2(:2) = pair(2)
    call check('of a pile', highest_frequency2(points, response), together, 1.0e-6_wp*together)
  end subroutine check_frequencies

  !> What bounds a substep: stiffness and damping of all contact points of two bodies over what each
  !! sets against a force, rotation included; dashpots only of several pairs.
  subroutine check_sums()
    real(wp), parameter :: arm(3) = [0.5_wp, 0.0_wp, 0.0_wp], inverse_inertia = 4.0_wp
    type(contact_points_t) :: points
    type(response_t) :: response
    real(wp) :: frequency2, rate, k, at_2, eta, pair(2)
    integer :: i

    do i = 1, 3
      counterparts%inverse_inertia(i, i, 2) = inverse_inertia
    end do
    call add_point(contact_point_t(2, 1, 1, arm_a=arm, normal=-z, depth=1.0e-6_wp), points)
    call respond(points, law, counterparts, response)
    call bound_by_sums(points, response, frequency2, rate)
    k = response%k(1)
    at_2 = 1/mass(2) + inverse_inertia*arm(1)**2
    call check('one pair: stiffness', frequency2, k*(1/mass(1) + at_2), 1.0e-6_wp*frequency2)
    call check('one pair: dashpots bound nothing', rate, 0.0_wp, 1.0e-9_wp)
    call add_point(contact_point_t(3, 2, 1, arm_b=arm, normal=-z, depth=1.0e-6_wp), points)
    call respond(points, law, counterparts, response)
    call bound_by_sums(points, response, frequency2, rate)
    k = response%k(1)*(1/mass(1) + at_2)
    k = max(k + response%k(2)*at_2, response%k(2)*(1/mass(3) + at_2) + response%k(1)*at_2)
    call check('two pairs: stiffness', frequency2, k, 1.0e-6_wp*frequency2)
    pair = [response%eta(1)*(1/mass(1) + at_2), response%eta(2)*(1/mass(3) + at_2)]
    eta = min(response%eta(2)*at_2, pair(1)) + response%eta(2)*at_2
    eta = max(eta, min(response%eta(1)*at_2, pair(2)) + response%eta(1)*at_2)
    call check('two pairs: dashpots', rate, eta, 1.0e-6_wp*rate)
    counterparts%inverse_inertia = 0.0_wp
  end subroutine check_sums

  !> A pair carries the heaviest body within what the smaller of the two may give way.
  subroutine check_load()
    type(contact_points_t) :: points
    type(response_t) :: response

    counterparts%heaviest = 1.0e9_wp
    counterparts%gravity = 10.0_wp
    counterparts%rest_overlap(1) = 1.0e-2_wp
    call add_ball_point(2, 1, [1.0_wp, 0.5_wp], points)
    call respond(points, law, counterparts, response)
    call check('stiffness under a load', response%k(:2), 1.0e12_wp*[1.0_wp, 0.5_wp], 1.0_wp)
    counterparts%heaviest = 0.0_wp
    counterparts%gravity = 0.0_wp
    counterparts%rest_overlap = 1.0_wp
  end subroutine check_load

  !> What the force of a contact point does to its counterparts is what its spring gives: F times
  !! the speed at which it lets its energy go, also where its weight changes with position.
  subroutine check_power()
    type(contact_point_t) :: point
    type(motion_t) :: motion
    type(wrench_t) :: wrench
    real(wp) :: power, gamma
    real(wp), parameter :: force = 7.0_wp
    integer :: i

    do i = 1, 20
      point = contact_point_t(2, 1, 1, vector(i, 1), vector(i, 2), vector(i, 3), 0.01_wp, 0.5_wp, &
        1.0_wp, 100*vector(i, 4), 100*vector(i, 5))
      if (i > 10) point%weight = 1.0_wp
      gamma = 1.0_wp + 0.05_wp*i
      motion = motion_t(vector(i, 6), vector(i, 7), vector(i, 8))
      wrench = wrench_t()
      call push_apart(point, gamma, force, wrench)
      power = -dot_product(wrench%force, motion%v) + dot_product(wrench%torque_a, motion%omega_a) &
        + dot_product(wrench%torque_b, motion%omega_b)
      call check('power of a point', power, force*opening_speed(point, gamma, motion), 1.0e-13_wp)
    end do
  end subroutine check_power

end module test_contact_response_m
