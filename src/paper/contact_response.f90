!> The springs and dashpots of what touches: how stiff and how damped each contact point is, and how
!! fast bodies can swing on them.
module contact_response_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use contact_points_m, only: contact_points_t
  use contact_groups_m, only: groups_t
  use rigid_body_m, only: blocks_t
  use bed_m, only: bed_counterpart
  use contact_laws_m, only: choose_law, hard_depth, rest_overlap_share
  use case_types_m, only: contact_input_t
  use contact_law_m, only: contact_law_t, stiffness_t
  use counterparts_m, only: counterparts_t, inertia_t, motion_t, wrench_t, inertia_of, &
    inverse_effective_mass, relative_velocity, act
  implicit none
  private
  public :: response_t, response_init, respond, stiffness_limit

  !> The law at work at each contact point.
  type :: response_t
    class(contact_law_t), allocatable :: law
    real(wp), allocatable :: hard(:)             !! (counterparts) depth where contacts harden [m]
    real(wp), allocatable :: rest_overlap(:)     !! (counterparts) largest overlap at rest [m]
    type(groups_t) :: groups                     !! contact points of one tangential displacement
    real(wp), allocatable :: k(:)                !! k_n of the contact point [N/m^gamma]
    real(wp), allocatable :: elastic(:)          !! force [N]
    real(wp), allocatable :: energy(:)           !! [J]
    real(wp), allocatable :: eta(:)              !! eta_n of the contact point [N s/m]
    real(wp), allocatable :: decay(:)            !! eta of the pair over twice its mass m* [1/s]
    real(wp) :: frequency2 = 0.0_wp              !! square of the highest of a pair [1/s2]
    !> Sums over the contact points of a body: stiffness and damping over the mass that it sets
    !! against a force there, rotation included.
    real(wp), allocatable :: stiffness(:), damping(:)       !! (counterparts) [1/s2], [1/s]
  end type response_t

contains

  !> The law of a case; the depth at which contact points of each counterpart harden, and the
  !! overlap that each may have at rest, a share of its smallest edge.
  subroutine response_init(input, blocks, response)
    type(contact_input_t), intent(in) :: input
    type(blocks_t), intent(in) :: blocks
    type(response_t), intent(out) :: response
    integer :: b

    call choose_law(input, response%law)
    allocate (response%hard(bed_counterpart:blocks%n), &
      response%rest_overlap(bed_counterpart:blocks%n), source=huge(1.0_wp))
    do b = 1, blocks%n
      associate (shape => blocks%shapes(blocks%shape(b)))
        response%hard(b) = hard_depth(shape)
        response%rest_overlap(b) = rest_overlap_share*shape%smallest_edge
      end associate
    end do
  end subroutine response_init

  !> Stiffness and damping of all contact points.
  subroutine respond(points, counterparts, response)
    type(contact_points_t), intent(in) :: points
    type(counterparts_t), intent(in) :: counterparts
    type(response_t), intent(inout) :: response
    integer :: first, last

    if (.not. allocated(response%stiffness)) allocate (response%stiffness, response%damping, &
      mold=counterparts%inverse_mass)
    response%frequency2 = 0.0_wp
    response%stiffness = 0.0_wp
    response%damping = 0.0_wp
    call ensure_capacity(points%n, response%k)
    call ensure_capacity(points%n, response%elastic)
    call ensure_capacity(points%n, response%energy)
    call ensure_capacity(points%n, response%eta)
    call ensure_capacity(points%n, response%decay)
    first = 1
    do while (first <= points%n)
      do last = first, points%n - 1   ! of the pair
        if (points%item(last + 1)%a /= points%item(first)%a) exit
        if (points%item(last + 1)%b /= points%item(first)%b) exit
      end do
      call respond_pair(points, first, last, counterparts, response)
      first = last + 1
    end do
  end subroutine respond

  !> Stiffness and damping of the contact points `first:last` of one pair of bodies.
  !!
  !! Stiffness belongs to each contact point alone. Damping is shared: N contact points that act
  !! together must damp like one. Seen along the normal n_i of contact point i the pair has the
  !! stiffness K_i = sum_j k_j (n_i.n_j)^2 and, at the mean of the contact points with the same
  !! weights, the effective mass m_i; then eta_i = (k_i/K_i) 2 zeta sqrt(K_i m_i).
  pure subroutine respond_pair(points, first, last, counterparts, response)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: first, last
    type(counterparts_t), intent(in) :: counterparts
    type(response_t), intent(inout) :: response
    type(stiffness_t) :: elastic
    type(inertia_t) :: of_a, of_b
    real(wp) :: weights(6), centres(3, 6), nn(6), arm(3), inverse_a, inverse_b
    real(wp) :: k, total, hard, share, steep
    integer :: t, i

    associate (a => points%item(first)%a, b => points%item(first)%b, law => response%law)
      of_a = inertia_of(counterparts, a)
      of_b = inertia_of(counterparts, b)
      k = law%normal_constant(1.0_wp/(of_a%inverse_mass + of_b%inverse_mass), &
        counterparts%heaviest, counterparts%gravity, &
        min(response%rest_overlap(a), response%rest_overlap(b)))
      hard = min(response%hard(a), response%hard(b))
      weights = 0.0_wp
      centres = 0.0_wp
      steep = 0.0_wp
      do t = first, last
        associate (point => points%item(t))
          call law%normal_stiffness(k, point%depth, hard, elastic)
          response%k(t) = k
          response%elastic(t) = elastic%force
          response%energy(t) = elastic%energy
          response%eta(t) = elastic%hardness
          steep = max(steep, elastic%steepness)
          nn = elastic%hardness*square(point%normal)
          weights = weights + nn
          do i = 1, 6
            centres(:, i) = centres(:, i) + nn(i)*point%arm_a
          end do
        end associate
      end do
      do t = first, last
        associate (point => points%item(t))
          share = response%eta(t)
          nn = square(point%normal)*[1, 1, 1, 2, 2, 2]
          total = dot_product(nn, weights)
          arm = matmul(centres, nn)/total
          inverse_a = inverse_effective_mass(of_a, arm, point%normal)
          arm = arm + (point%arm_b - point%arm_a)
          inverse_b = inverse_effective_mass(of_b, arm, point%normal)
          response%frequency2 = max(response%frequency2, steep*k*total*(inverse_a + inverse_b))
          call law%damping(share, k, total, inverse_a + inverse_b, response%eta(t), &
            response%decay(t))
          response%stiffness(a) = response%stiffness(a) + steep*k*share &
            *inverse_effective_mass(of_a, point%arm_a, point%normal)
          response%stiffness(b) = response%stiffness(b) + steep*k*share &
            *inverse_effective_mass(of_b, point%arm_b, point%normal)
        end associate
      end do
      if (law%damping_ratio > 0.0_wp) call damp_as_one(points, first, last, of_a, of_b, response)
      do t = first, last
        associate (point => points%item(t))
          response%damping(a) = response%damping(a) + response%eta(t) &
            *inverse_effective_mass(of_a, point%arm_a, point%normal)
          response%damping(b) = response%damping(b) + response%eta(t) &
            *inverse_effective_mass(of_b, point%arm_b, point%normal)
        end associate
      end do
    end associate
  end subroutine respond_pair

  !> Scale the damping of the contact points of a pair so that together they damp the swing they
  !! drive like one spring and dashpot.
  !!
  !! The elastic wrench W of the pair drives the motion u = M^-1 W, whose mass is u.W and whose
  !! stiffness (W.u)^2/(2 E) follows from the elastic energy E. Contacts along oblique normals part
  !! sideways, and make W other than by each normal.
  pure subroutine damp_as_one(points, first, last, of_a, of_b, response)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: first, last
    type(inertia_t), intent(in) :: of_a, of_b
    type(response_t), intent(inout) :: response
    type(wrench_t) :: wrench
    type(motion_t) :: motion   ! that the wrench drives
    real(wp) :: energy, mass, drag, v(3)
    integer :: t

    energy = 0.0_wp
    do t = first, last
      associate (point => points%item(t))
        call act(-response%elastic(t)*point%normal, point%arm_a, point%arm_b, wrench)
      end associate
      energy = energy + response%energy(t)
    end do
    motion%v = -(of_a%inverse_mass + of_b%inverse_mass)*wrench%force
    motion%omega_a = matmul(of_a%inverse_inertia, wrench%torque_a)
    motion%omega_b = matmul(of_b%inverse_inertia, wrench%torque_b)
    mass = dot_product(motion%omega_a, wrench%torque_a) &
      + dot_product(motion%omega_b, wrench%torque_b) - dot_product(motion%v, wrench%force)
    drag = 0.0_wp
    do t = first, last
      associate (point => points%item(t))
        v = relative_velocity(motion, point%arm_a, point%arm_b)
        drag = drag + response%eta(t)*dot_product(v, point%normal)**2
      end associate
    end do
    if (.not. (energy > 0.0_wp .and. drag > 0.0_wp)) return
    drag = 2*response%law%damping_ratio*mass*sqrt(0.5_wp*mass/energy)/drag
    response%eta(first:last) = drag*response%eta(first:last)
    response%decay(first:last) = drag*response%decay(first:last)
  end subroutine damp_as_one

  !> The products n_x n_x, n_y n_y, n_z n_z, n_y n_z, n_z n_x, n_x n_y.
  pure function square(n) result(nn)
    real(wp), intent(in) :: n(3)
    real(wp) :: nn(6)

    nn = [n*n, n([2, 3, 1])*n([3, 1, 2])]
  end function square

  !> Longest substep that the springs and dashpots allow [s].
  !!
  !! For a pair of bodies a sixth of the bound of stability, which keeps the restitution. No motion
  !! of two bodies that touch is faster than the sums over all contact points of both, rotation
  !! included; most are slower by half, as the sums count shifts and turns together.
  pure function stiffness_limit(points, response) result(limit)
    type(contact_points_t), intent(in) :: points
    type(response_t), intent(in) :: response
    real(wp) :: limit
    real(wp), parameter :: pair_turn = 0.35_wp, pile_turn = 1.2_wp   ! frequency times substep
    real(wp), parameter :: damped = 4.0_wp    ! rate times substep; 2 is stable
    real(wp) :: frequency2, rate              ! [1/s2], [1/s]
    integer :: t

    frequency2 = 0.0_wp
    rate = 0.0_wp
    do t = 1, points%n
      associate (a => points%item(t)%a, b => points%item(t)%b)
        frequency2 = max(frequency2, response%stiffness(a) + response%stiffness(b))
        rate = max(rate, response%damping(a) + response%damping(b))
      end associate
    end do
    limit = huge(1.0_wp)
    if (response%frequency2 > 0.0_wp) limit = pair_turn/sqrt(response%frequency2)
    if (frequency2 > 0.0_wp) limit = min(limit, pile_turn/sqrt(frequency2))
    if (rate > 0.0_wp) limit = min(limit, damped/rate)
  end function stiffness_limit

end module contact_response_m
