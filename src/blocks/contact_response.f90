!> How stiff and how damped each contact point is, and how fast the pairs of bodies swing on them:
!! the first for the forces, the second for the length of the substep.
module contact_response_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use vectors_m, only: norm
  use contact_points_m, only: contact_point_t, contact_points_t
  use displacements_m, only: comes_before
  use contact_law_m, only: contact_law_t, stiffness_t, energy_of_force
  use counterparts_m, only: counterparts_t, inertia_t, motion_t, wrench_t, inertia_of, &
    inverse_effective_mass, motion_between, relative_velocity, act
  implicit none
  private
  public :: response_t, respond, add_frequencies, highest_frequency2, opening_speed, push_apart
  public :: bound_by_sums
  public :: impact_turn, pile_turn

  !> Frequency times substep (2 is the bound of stability) of a pair of bodies in an impact, of a
  !! pair too slow for one, and of a pile.
  real(wp), parameter :: impact_turn = 0.35_wp, slow_turn = 0.7_wp, pile_turn = 1.2_wp

  !> The law at work at each contact point.
  type :: response_t
    real(wp), allocatable :: k(:)                !! k_n of the contact point [N/m^gamma]
    real(wp), allocatable :: elastic(:)          !! force [N]
    real(wp), allocatable :: energy(:)           !! [J]
    real(wp), allocatable :: stiff(:)
      !! k_n times the hardness of the contact point [N/m^gamma]
    real(wp), allocatable :: eta(:)              !! eta_n of the contact point [N s/m]
    real(wp), allocatable :: decay(:)            !! eta of the pair over twice its mass m* [1/s]
    real(wp), allocatable :: pair_frequency2(:)  !! square of the frequency of the pair [1/s2]
    real(wp), allocatable :: frequency2(:)
      !! (counterparts) sum over pairs of a free body [1/s2]
    !> Sums over the contact points of a pair, and over all contact points of a body: stiffness and
    !! damping over the mass that the bodies, or the body, set against a force there, rotation
    !! included.
    real(wp), allocatable :: pair_damping(:)                !! (points) [1/s]
    real(wp), allocatable :: stiffness(:), damping(:)       !! (counterparts) [1/s2], [1/s]
  end type response_t

  !> Two counterparts that touch.
  type :: couple_t
    type(inertia_t) :: a, b
    real(wp) :: k = 0.0_wp   !! stiffness of a contact point of weight one [N/m^gamma]
  end type couple_t

contains

  !> Stiffness and damping of all contact points of a list.
  subroutine respond(points, law, counterparts, response)
    type(contact_points_t), intent(in) :: points
    class(contact_law_t), intent(in) :: law
    type(counterparts_t), intent(in) :: counterparts
    type(response_t), intent(inout) :: response
    integer :: first, last

    if (.not. allocated(response%frequency2)) allocate (response%frequency2, response%stiffness, &
      response%damping, mold=counterparts%inverse_mass)
    response%frequency2 = 0.0_wp
    response%stiffness = 0.0_wp
    response%damping = 0.0_wp
    call ensure_capacity(points%n, response%k)
    call ensure_capacity(points%n, response%pair_damping)
    call ensure_capacity(points%n, response%elastic)
    call ensure_capacity(points%n, response%energy)
    call ensure_capacity(points%n, response%stiff)
    call ensure_capacity(points%n, response%eta)
    call ensure_capacity(points%n, response%decay)
    call ensure_capacity(points%n, response%pair_frequency2)
    first = 1
    do while (first <= points%n)
      last = last_of_pair(points, first)
      call respond_pair(points, first, last, law, counterparts, response)
      first = last + 1
    end do
  end subroutine respond

  !> Last contact point of the pair of bodies whose first one is given.
  pure function last_of_pair(points, first) result(last)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: first
    integer :: last

    do last = first, points%n - 1
      if (points%item(last + 1)%a /= points%item(first)%a) return
      if (points%item(last + 1)%b /= points%item(first)%b) return
    end do
    last = points%n
  end function last_of_pair

  !> Stiffness and damping of the contact points `first:last` of one pair of bodies.
  !!
  !! Stiffness belongs to each contact point alone. Damping is shared: N contact points that act
  !! together must damp like one. Seen along the normal n_i of contact point i the pair has the
  !! stiffness K_i = sum_j k_j (n_i.n_j)^2 and, at the mean of the contact points with the same
  !! weights, the effective mass m_i; then eta_i = (k_i/K_i) 2 zeta sqrt(K_i m_i).
  !!
  !! It is no impact where the bodies move against one another no faster than weight, or a share of
  !! their load, makes them move within a swing.
  pure subroutine respond_pair(points, first, last, law, counterparts, response)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: first, last
    class(contact_law_t), intent(in) :: law
    type(counterparts_t), intent(in) :: counterparts
    type(response_t), intent(inout) :: response
    type(couple_t) :: of
    type(stiffness_t) :: elastic
    type(motion_t) :: motion
    real(wp), parameter :: calm_share = 0.25_wp   !! of the load
    real(wp) :: weights(6), centres(3, 6), nn(6), arm(3)
    real(wp) :: load(3), total, inverse, hard, share, highest, steep, calm, speed
    integer :: a, b, t, i

    a = points%item(first)%a
    b = points%item(first)%b
    of = couple_t(inertia_of(counterparts, a), inertia_of(counterparts, b))
    weights = 0.0_wp
    centres = 0.0_wp
    load = 0.0_wp
    steep = 0.0_wp
    of%k = law%normal_constant(1.0_wp/(of%a%inverse_mass + of%b%inverse_mass), &
      counterparts%heaviest, counterparts%gravity, &
      min(counterparts%rest_overlap(a), counterparts%rest_overlap(b)))
    hard = min(counterparts%hard(a), counterparts%hard(b))
    do t = first, last
      associate (point => points%item(t))
        response%k(t) = point%weight*of%k
        call law%normal_stiffness(of%k, point%weight, point%depth, hard, elastic)
        response%elastic(t) = elastic%force
        response%energy(t) = elastic%energy
        response%eta(t) = point%weight*elastic%hardness
        response%stiff(t) = of%k*response%eta(t)
        steep = max(steep, elastic%steepness)
        load = load + elastic%force*point%normal
        nn = response%eta(t)*square(point%normal)
        weights = weights + nn
        do i = 1, 6
          centres(:, i) = centres(:, i) + nn(i)*point%arm_a
        end do
      end associate
    end do
    highest = 0.0_wp
    do t = first, last
      associate (point => points%item(t))
        nn = square(point%normal)*[1, 1, 1, 2, 2, 2]
        total = dot_product(nn, weights)
        arm = matmul(centres, nn)/total
        inverse = inverse_effective_mass(of%a, arm, point%normal)
        arm = arm + (point%arm_b - point%arm_a)
        inverse = inverse + inverse_effective_mass(of%b, arm, point%normal)
      end associate
      highest = max(highest, of%k*total*inverse)
      share = response%eta(t)
      call law%damping(share, of%k, total, inverse, response%eta(t), response%decay(t))
      if (points%item(t)%weight < 1.0_wp .and. points%item(t)%depth > 0.0_wp) then
        call damp_alone(points%item(t), share, law, of, response%eta(t), response%decay(t), highest)
      end if
    end do
    if (law%damping_ratio > 0.0_wp) call damp_as_one(points, first, last, law, of, response, &
                                                     highest)
    call sum_up(points, first, last, steep, of, response)
    highest = steep*highest
    calm = max(counterparts%gravity, calm_share*norm(load)*(of%a%inverse_mass + of%b%inverse_mass))
    motion = motion_between(counterparts, a, b)
    speed = norm(motion%v) + norm(motion%omega_a)*norm(points%item(first)%arm_a) &
      + norm(motion%omega_b)*norm(points%item(first)%arm_b)   ! of points as far out, at most
    if (speed**2*highest < calm**2) highest = highest*(impact_turn/slow_turn)**2
    response%pair_frequency2(first:last) = highest
    if (of%a%inverse_mass > 0.0_wp) response%frequency2(a) = response%frequency2(a) + highest
    if (of%b%inverse_mass > 0.0_wp) response%frequency2(b) = response%frequency2(b) + highest
  end subroutine respond_pair

  !> Add the stiffness and damping of a pair, over the mass that each body sets against a force at
  !! each contact point, to the sums of its bodies.
  pure subroutine sum_up(points, first, last, steep, of, response)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: first, last
    real(wp), intent(in) :: steep   !! largest `steepness` of the springs
    type(couple_t), intent(in) :: of
    type(response_t), intent(inout) :: response
    real(wp) :: inverse(2), stiffness(2), damping(2)   ! of a and b
    integer :: t

    stiffness = 0.0_wp
    damping = 0.0_wp
    do t = first, last
      associate (point => points%item(t))
        inverse = [inverse_effective_mass(of%a, point%arm_a, point%normal), &
                   inverse_effective_mass(of%b, point%arm_b, point%normal)]
        stiffness = stiffness + steep*response%stiff(t)*inverse
        damping = damping + response%eta(t)*inverse
      end associate
    end do
    response%pair_damping(first:last) = sum(damping)
    associate (a => points%item(first)%a, b => points%item(first)%b)
      response%stiffness(a) = response%stiffness(a) + stiffness(1)
      response%stiffness(b) = response%stiffness(b) + stiffness(2)
      response%damping(a) = response%damping(a) + damping(1)
      response%damping(b) = response%damping(b) + damping(2)
    end associate
  end subroutine sum_up

  !> Damping of a contact point whose weight changes with position: no more than it needs alone.
  !!
  !! Its force goes along the gradient of its energy. Where the weight begins, that is steep, and
  !! the mass that the contact point moves by a change of its depth a million times smaller than
  !! along the normal: a dashpot for that mass would throw the bodies.
  pure subroutine damp_alone(point, share, law, of, eta, decay, highest)
    type(contact_point_t), intent(in) :: point
    real(wp), intent(in) :: share   !! of the stiffness of a contact point of weight one [-]
    class(contact_law_t), intent(in) :: law
    type(couple_t), intent(in) :: of
    real(wp), intent(inout) :: eta, decay   !! lowered, raised [N s/m, 1/s]
    real(wp), intent(inout) :: highest      !! square of the frequency of the pair, raised [1/s2]
    type(wrench_t) :: wrench
    type(motion_t) :: motion
    real(wp) :: inverse   ! of the mass [1/kg]
    real(wp) :: eta_alone, decay_alone

    call push_apart(point, law%gamma_n, 1.0_wp, wrench)
    call drive(of, wrench, motion, inverse)
    call law%damping(share, of%k, share, inverse, eta_alone, decay_alone)
    eta = min(eta, eta_alone)
    decay = max(decay, 0.5_wp*eta*inverse)
    highest = max(highest, of%k*share*inverse)
  end subroutine damp_alone

  !> The motion M^-1 W that a wrench gives the pair at once, and its power W.M^-1 W.
  pure subroutine drive(of, wrench, motion, power)
    type(couple_t), intent(in) :: of
    type(wrench_t), intent(in) :: wrench
    type(motion_t), intent(out) :: motion   !! of b against a
    real(wp), intent(out) :: power

    motion%v = -(of%a%inverse_mass + of%b%inverse_mass)*wrench%force
    if (of%a%inverse_mass > 0.0_wp) motion%omega_a = matmul(of%a%inverse_inertia, wrench%torque_a)
    if (of%b%inverse_mass > 0.0_wp) motion%omega_b = matmul(of%b%inverse_inertia, wrench%torque_b)
    power = dot_product(motion%omega_a, wrench%torque_a) &
      + dot_product(motion%omega_b, wrench%torque_b) - dot_product(motion%v, wrench%force)
  end subroutine drive

  !> Scale the damping of the contact points of a pair so that together they damp the swing they
  !! drive like one spring and dashpot.
  !!
  !! The elastic wrench W of the pair drives the motion u = M^-1 W, whose mass is u.W and whose
  !! stiffness (W.u)^2/(2 E) follows from the elastic energy E. Contacts along oblique normals,
  !! which part sideways, and weights that change with position make W other than by each normal.
  pure subroutine damp_as_one(points, first, last, law, of, response, highest)
    type(contact_points_t), intent(in) :: points
    integer, intent(in) :: first, last
    class(contact_law_t), intent(in) :: law
    type(couple_t), intent(in) :: of
    type(response_t), intent(inout) :: response
    real(wp), intent(inout) :: highest   !! square of the frequency of the pair, raised [1/s2]
    type(wrench_t) :: wrench
    type(motion_t) :: motion   ! that the wrench drives
    real(wp) :: energy, mass, drag, omega2
    integer :: t

    energy = 0.0_wp
    do t = first, last
      associate (point => points%item(t))
        if (point%depth <= 0.0_wp) cycle
        call push_apart(point, law%gamma_n, response%elastic(t), wrench)
      end associate
      energy = energy + response%energy(t)
    end do
    call drive(of, wrench, motion, mass)
    drag = 0.0_wp
    do t = first, last
      if (points%item(t)%depth <= 0.0_wp) cycle
      drag = drag + response%eta(t)*opening_speed(points%item(t), law%gamma_n, motion)**2
    end do
    if (.not. (energy > 0.0_wp .and. drag > 0.0_wp)) return
    omega2 = 0.5_wp*mass/energy
    highest = max(highest, omega2)
    drag = 2*law%damping_ratio*mass*sqrt(omega2)/drag
    response%eta(first:last) = drag*response%eta(first:last)
    response%decay(first:last) = drag*response%decay(first:last)
  end subroutine damp_as_one

  !> The products n_x n_x, n_y n_y, n_z n_z, n_y n_z, n_z n_x, n_x n_y.
  pure function square(n) result(nn)
    real(wp), intent(in) :: n(3)
    real(wp) :: nn(6)

    nn = [n*n, n([2, 3, 1])*n([3, 1, 2])]
  end function square

  !> Add the frequencies of what may touch soon to those of what touches, of each pair and of each
  !! body: springs together swing no faster than the squares of both frequencies together.
  pure subroutine add_frequencies(points, soon, response, response_soon)
    type(contact_points_t), intent(in) :: points, soon
    type(response_t), intent(inout) :: response, response_soon
    real(wp) :: both
    integer :: first, last, m, m_last

    response%frequency2 = response%frequency2 + response_soon%frequency2
    response_soon%frequency2 = response%frequency2
    m = 1
    first = 1
    do while (first <= soon%n)
      last = last_of_pair(soon, first)
      do while (m <= points%n)
        if (.not. comes_before(points%item(m)%a, points%item(m)%b, 0, soon%item(first)%a, &
                               soon%item(first)%b, 0)) exit
        m = m + 1
      end do
      if (m > points%n) return
      if (points%item(m)%a == soon%item(first)%a &
        .and. points%item(m)%b == soon%item(first)%b) then
        m_last = last_of_pair(points, m)
        both = response%pair_frequency2(m) + response_soon%pair_frequency2(first)
        response%pair_frequency2(m:m_last) = both
        response_soon%pair_frequency2(first:last) = both
      end if
      first = last + 1
    end do
  end subroutine add_frequencies

  !> Square of the highest frequency of a pair of bodies in contact, or of all pairs together with a
  !! share; a little above [1/s2].
  !!
  !! A pile swings no faster than all the pairs of two bodies in contact taken together. It only has
  !! to be stable, so it may turn further in a substep than a single pair.
  pure function highest_frequency2(points, response) result(highest)
    type(contact_points_t), intent(in) :: points
    type(response_t), intent(in) :: response
    real(wp) :: highest
    real(wp), parameter :: share = (impact_turn/pile_turn)**2
    real(wp) :: pair
    integer :: t

    highest = 0.0_wp
    do t = 1, points%n
      pair = response%pair_frequency2(t)
      highest = max(highest, pair, share*(pair &
        + max(0.0_wp, response%frequency2(points%item(t)%a) - pair) &
        + max(0.0_wp, response%frequency2(points%item(t)%b) - pair)))
    end do
  end function highest_frequency2

  !> Frequency and rate that bound a substep by the springs and dashpots of all contact points of
  !! two bodies that touch, rotation included.
  !!
  !! No motion is faster than the sums over both bodies; most are slower by half, as the sums count
  !! shifts and turns together. Each pair damps by itself, so that together dashpots could turn the
  !! motion round and drive it; one pair takes no more than its motion, so that it counts as much
  !! as all others at most.
  pure subroutine bound_by_sums(points, response, frequency2, rate)
    type(contact_points_t), intent(in) :: points
    type(response_t), intent(in) :: response
    real(wp), intent(out) :: frequency2   !! its square [1/s2]
    real(wp), intent(out) :: rate         !! [1/s]
    real(wp) :: others
    integer :: t

    frequency2 = 0.0_wp
    rate = 0.0_wp
    do t = 1, points%n
      associate (a => points%item(t)%a, b => points%item(t)%b)
        frequency2 = max(frequency2, response%stiffness(a) + response%stiffness(b))
        others = max(0.0_wp, response%damping(a) + response%damping(b) - response%pair_damping(t))
        rate = max(rate, others + min(others, response%pair_damping(t)))
      end associate
    end do
  end subroutine bound_by_sums

  !> Speed at which a contact point lets its elastic energy E go, -(dE/dt)/(dE/dd): that of the
  !! depth and, where the weight changes with position, of the weight [m/s].
  pure function opening_speed(point, gamma, motion) result(speed)
    type(contact_point_t), intent(in) :: point
    real(wp), intent(in) :: gamma             !! power of the spring; 1 where it hardens [-]
    type(motion_t), intent(in) :: motion
    real(wp) :: speed
    real(wp) :: v(3)

    v = relative_velocity(motion, point%arm_a, point%arm_b)
    speed = dot_product(v, point%normal)
    if (point%weight < 1.0_wp) speed = speed &
      + energy_of_force(1.0_wp, gamma, point%depth)*( &
        dot_product(v, point%weight_shift) &
        + dot_product(motion%omega_b - motion%omega_a, point%weight_turn))
  end function opening_speed

  !> The force of a contact point on its bodies: along the normal, and where its weight changes with
  !! position by that, too: the energy of the spring is k(position) d^(gamma+1)/(gamma+1). Damping
  !! changes that part as it changes the normal force.
  pure subroutine push_apart(point, gamma, force_n, wrench)
    type(contact_point_t), intent(in) :: point
    real(wp), intent(in) :: gamma     !! power of the spring; 1 where it hardens [-]
    real(wp), intent(in) :: force_n   !! normal force of the contact point, damping included [N]
    type(wrench_t), intent(inout) :: wrench
    real(wp) :: energy

    call act(-force_n*point%normal, point%arm_a, point%arm_b, wrench)
    if (point%weight >= 1.0_wp) return
    energy = energy_of_force(force_n, gamma, point%depth)
    call act(-energy*point%weight_shift, point%arm_a, point%arm_b, wrench)
    wrench%torque_a = wrench%torque_a - energy*point%weight_turn
    wrench%torque_b = wrench%torque_b + energy*point%weight_turn
  end subroutine push_apart

end module contact_response_m
