!> Forces of all contact points, and the tangential displacements that remember them.
module contact_forces_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use vectors_m, only: norm
  use displacements_m, only: displacements_t, reserve_displacements, comes_before
  use contact_points_m, only: contact_points_t
  use contact_groups_m, only: groups_t
  use contact_law_m, only: stored_energy, normal_force, tangential_force, tangential_slip
  use counterparts_m, only: counterparts_t, motion_t, wrench_t, motion_between, &
    relative_velocity, act, kind_of
  use contact_response_m, only: response_t
  use contact_solver_m, only: loads_t, contact_report_t, energy_in_memory
  implicit none
  private
  public :: match_displacements, integrate_displacements, sum_groups, elastic_energy

  !> What the contact points of one group do along their normals.
  type :: push_t
    real(wp) :: force = 0.0_wp          !! sum [N]
    real(wp) :: eta = 0.0_wp            !! largest damping [N s/m]
    real(wp) :: slowing = 1.0_wp        !! of force by damping within the substep, `slowing_of`
  end type push_t

contains

  !> Give each group its tangential displacement: that in memory turned into the present plane, or
  !! none yet.
  subroutine match_displacements(points, groups, before, displacements)
    type(contact_points_t), intent(in) :: points
    type(groups_t), intent(inout) :: groups
    type(displacements_t), intent(inout) :: before   !! work: displacements of the substep before
    type(displacements_t), intent(inout) :: displacements
    real(wp) :: xi(3)
    integer :: g, m, t

    associate (old => before, new => displacements)
      call reserve_displacements(new%n, old)
      old%n = new%n
      old%a(:old%n) = new%a(:old%n)
      old%b(:old%n) = new%b(:old%n)
      old%id(:old%n) = new%id(:old%n)
      old%xi(:, :old%n) = new%xi(:, :old%n)
      call reserve_displacements(groups%n, new)
      new%n = groups%n
      m = 1
      do g = 1, groups%n
        t = groups%first(g)
        new%a(g) = points%item(t)%a
        new%b(g) = points%item(t)%b
        new%id(g) = points%item(t)%id
        new%xi(:, g) = 0.0_wp
        groups%new(g) = .true.
        do while (m <= old%n)
          if (.not. comes_before(old%a(m), old%b(m), old%id(m), &
                                 new%a(g), new%b(g), new%id(g))) exit
          m = m + 1
        end do
        if (m > old%n) cycle
        groups%new(g) = old%a(m) /= new%a(g) .or. old%b(m) /= new%b(g) .or. old%id(m) /= new%id(g)
        if (groups%new(g)) cycle
        xi = old%xi(:, m) - dot_product(old%xi(:, m), groups%normal(:, g))*groups%normal(:, g)
        if (norm(xi) > 0.0_wp) new%xi(:, g) = xi*(norm(old%xi(:, m))/norm(xi))   ! as long as it was
      end do
    end associate
  end subroutine match_displacements

  !> Let the displacements follow the present tangential velocities for a time dt.
  pure subroutine integrate_displacements(dt, groups, counterparts, displacements)
    real(wp), intent(in) :: dt   !! [s]
    type(groups_t), intent(in) :: groups
    type(counterparts_t), intent(in) :: counterparts
    type(displacements_t), intent(inout) :: displacements
    type(motion_t) :: motion
    real(wp) :: v(3)
    integer :: g

    do g = 1, groups%n
      motion = motion_between(counterparts, displacements%a(g), displacements%b(g))
      v = relative_velocity(motion, groups%arm_a(:, g), groups%arm_b(:, g))
      displacements%xi(:, g) = displacements%xi(:, g) &
        + dt*(v - dot_product(v, groups%normal(:, g))*groups%normal(:, g))
    end do
  end subroutine integrate_displacements

  !> Contact forces and torques of this substep, added to those on the counterparts, and remembered
  !! with their energy: by them blocks fall asleep, and are held then.
  !!
  !! The damping acts on the velocity in the middle of the substep, which the force itself changes:
  !! F = (k d - eta v_n)/s, see `slowing_of`.
  pure subroutine sum_groups(dt, points, response, counterparts, displacements, loads, report)
    real(wp), intent(in) :: dt   !! [s]
    type(contact_points_t), intent(in) :: points
    type(response_t), intent(in) :: response
    type(counterparts_t), intent(in) :: counterparts
    type(displacements_t), intent(inout) :: displacements
    type(loads_t), intent(inout) :: loads
    type(contact_report_t), intent(inout) :: report
    type(wrench_t) :: wrench
    integer :: g

    do g = 1, response%groups%n
      associate (a => displacements%a(g), b => displacements%b(g), &
        first => response%groups%first(g), last => response%groups%first(g + 1) - 1)
        wrench = wrench_t()
        call push_group(g, dt, motion_between(counterparts, a, b), points, response, &
          displacements, wrench, report)
        loads%force(:, a) = loads%force(:, a) + wrench%force
        loads%force(:, b) = loads%force(:, b) - wrench%force
        loads%torque(:, a) = loads%torque(:, a) + wrench%torque_a
        loads%torque(:, b) = loads%torque(:, b) + wrench%torque_b
        displacements%force(:, g) = wrench%force
        displacements%torque_a(:, g) = wrench%torque_a
        displacements%torque_b(:, g) = wrench%torque_b
        displacements%energy(g) = sum(response%energy(first:last)) &
          + stored_energy(displacements%k(g), response%law%gamma_t, norm(displacements%xi(:, g)))
      end associate
    end do
  end subroutine sum_groups

  !> Normal and tangential forces of one group.
  pure subroutine push_group(g, dt, motion, points, response, displacements, wrench, report)
    integer, intent(in) :: g
    real(wp), intent(in) :: dt   !! [s]
    type(motion_t), intent(in) :: motion
    type(contact_points_t), intent(in) :: points
    type(response_t), intent(in) :: response
    type(displacements_t), intent(inout) :: displacements
    type(wrench_t), intent(inout) :: wrench
    type(contact_report_t), intent(inout) :: report
    type(push_t) :: push
    real(wp) :: v_n, part, force_n, decay
    integer :: t

    decay = 0.0_wp
    associate (groups => response%groups)
      do t = groups%first(g), groups%first(g + 1) - 1
        associate (point => points%item(t))
          v_n = dot_product(relative_velocity(motion, point%arm_a, point%arm_b), point%normal)
          part = 1.0_wp
          ! Time since a new contact point began up to the end of the substep, over the substep: 1/2
          ! to 3/2. Damping sets in with a jump. A contact point is seen first when bodies touch in
          ! the middle of a substep, and may have begun up to a substep before.
          if (groups%new(g) .and. v_n < 0.0_wp) part = 0.5_wp + min(point%depth, -v_n*dt)/(-v_n*dt)
          force_n = normal_force(response%elastic(t), part*response%eta(t), v_n) &
            /slowing_of(part*response%decay(t)*dt)
          call act(-force_n*point%normal, point%arm_a, point%arm_b, wrench)
          report%courant_max = max(report%courant_max, abs(v_n)*dt/point%length)
          report%overlap_max = max(report%overlap_max, point%depth)
        end associate
        push%force = push%force + force_n
        decay = max(decay, response%decay(t))
        push%eta = max(push%eta, response%eta(t))
      end do
    end associate
    push%slowing = slowing_of(decay*dt)
    call rub(g, push, motion, response, displacements, wrench)
  end subroutine push_group

  !> Force of a dashpot at the velocity of the start of a substep over that which acts.
  !!
  !! With D = eta dt/(2 m) this is 1 + D, the implicit midpoint rule, as long as the motion goes on
  !! in its direction. A stronger dashpot (D > 1) stops it within the substep and does not turn it
  !! round.
  elemental function slowing_of(d) result(s)
    real(wp), intent(in) :: d   !! >= 0 [-]
    real(wp) :: s

    s = max(1.0_wp + d, 2*d)
  end function slowing_of

  !> Tangential force of one group, no larger than friction allows.
  !!
  !! The force of the spring alone is limited too: while it slips, the displacement is what friction
  !! lets it hold, and the dashpot puts no energy into it.
  pure subroutine rub(g, push, motion, response, displacements, wrench)
    integer, intent(in) :: g
    type(push_t), intent(in) :: push   !! along the normal
    type(motion_t), intent(in) :: motion
    type(response_t), intent(in) :: response
    type(displacements_t), intent(inout) :: displacements
    type(wrench_t), intent(inout) :: wrench
    real(wp) :: v(3), f(3), f_elastic(3), k, k_n, eta, bound, size_f

    associate (groups => response%groups, law => response%law)
      k_n = response%k(groups%first(g))
      k = law%tangential_constant(k_n)
      displacements%k(g) = k
      eta = law%tangential_damping(push%eta, k, k_n)
      bound = push%force*law%friction(kind_of(displacements%b(g)))
      v = relative_velocity(motion, groups%arm_a(:, g), groups%arm_b(:, g))
      v = v - dot_product(v, groups%normal(:, g))*groups%normal(:, g)
      f = tangential_force(k, law%gamma_t, eta, displacements%xi(:, g), v)/push%slowing
      size_f = norm(f)
      if (size_f > bound) then
        f = f*(bound/size_f)
        f_elastic = tangential_force(k, law%gamma_t, 0.0_wp, displacements%xi(:, g), v)
        size_f = norm(f_elastic)
        if (size_f > bound) displacements%xi(:, g) = tangential_slip(k, law%gamma_t, 0.0_wp, &
          f_elastic*(bound/size_f), v)
      end if
      call act(f, groups%arm_a(:, g), groups%arm_b(:, g), wrench)
    end associate
  end subroutine rub

  !> Energy in the normal springs at the present poses and in the tangential displacements [J].
  pure function elastic_energy(n, response, displacements, rest) result(energy)
    integer, intent(in) :: n                !! contact points
    type(response_t), intent(in) :: response
    type(displacements_t), intent(in) :: displacements, rest
      !! of contact points at work, of those at rest
    real(wp) :: energy
    integer :: t, g

    energy = 0.0_wp
    do t = 1, n
      energy = energy + response%energy(t)
    end do
    do g = 1, displacements%n
      energy = energy + stored_energy(displacements%k(g), response%law%gamma_t, &
        norm(displacements%xi(:, g)))
    end do
    energy = energy + energy_in_memory(rest)
  end function elastic_energy

end module contact_forces_m
