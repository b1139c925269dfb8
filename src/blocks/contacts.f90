!> Contact forces of all blocks and the substeps in which they act.
!!
!! Each substep moves the bodies half way, finds what touches, changes the velocities, and moves
!! them the other half, so that springs are second order in time and a free fall is exact.
module contacts_m
  use kinds_m, only: wp
  use growing_m, only: ensure_room
  use case_types_m, only: contact_input_t
  use vectors_m, only: norm
  use rigid_body_m, only: blocks_t, begin_step, drift, kick, hold_sleepers
  use walls_m, only: walls_t, floor_wall
  use bed_m, only: bed_is_near, bed_partner
  use neighbours_m, only: pair_list_t
  use touches_m, only: touch_t, touches_t, ensure_touches, set_apart
  use springs_m, only: springs_t, reserve_springs, comes_before, move_springs
  use sleep_m, only: sleep_t, sleep_init, know_stillness, know_loads, note_quiet, note_quiet_end, &
    is_tired, balanced, put_to_sleep, stop_sleepers, hold_or_wake, all_still
  use contact_spheres_m, only: contact_spheres_t, contact_spheres_init, find_sphere_touches
  use contact_surface_m, only: contact_surface_t, contact_surface_init, find_surface_touches
  use lubrication_m, only: lubrication_t, lubricate
  use contact_law_m, only: contact_law_t, contact_law_init, tangential_constant, stored_energy, &
    normal_force, tangential_force, tangential_slip
  use contact_partners_m, only: partners_t, motion_t, wrench_t, partners_init, know_partners, &
    know_motion, know_inertia, motion_between, relative_velocity, act
  use contact_response_m, only: response_t, respond, add_frequencies, highest_frequency2, &
    opening_speed, push_to_weight, impact_turn
  implicit none
  private
  public :: contacts_t, contacts_init, move_blocks, contact_report_t

  integer, parameter :: most_substeps = 1000000   !! of a fluid step; beyond, something went wrong

  !> Touches with one key and one partner act on one tangential spring.
  type :: groups_t
    integer :: n = 0
    logical, allocatable :: new(:)               !! (n) was not there in the substep before
    integer, allocatable :: first(:)             !! (n + 1) touches first(g) : first(g+1)-1
    real(wp), allocatable :: normal(:, :)        !! (3, n) mean, unit [-]
    real(wp), allocatable :: arm_a(:, :), arm_b(:, :)   !! (3, n) mean contact point [m]
  end type groups_t

  type :: contacts_t
    type(contact_law_t) :: law
    real(wp) :: substep_ratio = 0.0_wp           !! [-]
    real(wp) :: longest_substep = 0.0_wp         !! twentieth of the contact time [s]
    real(wp) :: courant_max = 0.0_wp             !! C_s of eq. (6) [-]
    type(springs_t) :: springs                   !! the memory: part of the state of a run
    type(springs_t) :: before                    !! work: springs of the substep before
    type(sleep_t) :: sleep                       !! blocks at rest: part of the state too
    logical, allocatable :: woken(:)             !! (n) work
    logical :: exact = .false.                   !! the exact surfaces touch, not contact spheres
    type(contact_spheres_t) :: spheres
    type(contact_surface_t) :: surface
    type(lubrication_t) :: lubrication
    real(wp), allocatable :: share(:)            !! (n) of a contact force that moves the body [-]
    real(wp), allocatable :: steady(:, :)        !! (3, n) force all through the step [N]
    real(wp), allocatable :: reach(:)            !! (n) farthest point that touches [m]
    real(wp) :: smallest = 0.0_wp                !! smallest d_s of eq. (6) [m]
    real(wp) :: clear = 0.0_wp                   !! way of bodies that are not near to touch [m]
    type(touches_t) :: touches
    type(touches_t) :: soon                        !! those that may come before the substep ends
    type(groups_t) :: groups
    type(response_t) :: response, response_soon
    real(wp) :: frequency2 = 0.0_wp              !! square of the highest frequency, or above [1/s2]
    type(partners_t) :: partners
    real(wp), allocatable :: force(:, :), torque(:, :)   !! (3, partners) of this substep [N], [N m]
    real(wp), allocatable :: impulse(:, :), twist(:, :)  !! (3, partners) of the step [N s], [N m s]
    !> The place to go back to: (3, n), (4, n), (3, n), (3, n).
    real(wp), allocatable :: x(:, :), q(:, :), l(:, :), spin(:, :)
    integer :: n_met = 0
    integer, allocatable :: met_a(:), met_b(:)           !! pairs that touched in this step, sorted
  end type contacts_t

  !> What happened in the substeps of one fluid step.
  type :: contact_report_t
    integer :: substeps = 0
    integer :: info = 0                 !! 1: it would take more than `most_substeps`, or NaN
    real(wp) :: energy = 0.0_wp         !! elastic, at the end [J]
    real(wp) :: courant_max = 0.0_wp    !! largest C_s = |v_r.n| dt_b/d_s of a touch [-]
    real(wp) :: overlap_max = 0.0_wp    !! largest overlap d_n of a touch [m]
  end type contact_report_t

contains

  !> The contact law of a case, without any touch yet.
  subroutine contacts_init(input, blocks, contacts)
    type(contact_input_t), intent(in) :: input
    type(blocks_t), intent(in) :: blocks
    type(contacts_t), intent(out) :: contacts
    integer :: n

    call contact_law_init(input, contacts%law)
    contacts%substep_ratio = input%substep_ratio
    contacts%longest_substep = input%contact_time/20.0_wp
    contacts%courant_max = input%courant_max
    contacts%exact = input%model == 'surface'
    if (contacts%exact) then
      call contact_surface_init(input%courant_max, contacts%longest_substep, blocks, &
        contacts%surface)
      contacts%reach = contacts%surface%reach
      contacts%smallest = contacts%surface%smallest
      contacts%clear = contacts%surface%clear
    else
      call contact_spheres_init(input%courant_max, blocks, contacts%spheres)
      contacts%reach = contacts%spheres%reach
      contacts%smallest = contacts%spheres%smallest
      contacts%clear = contacts%spheres%clear
    end if
    n = blocks%n
    call partners_init(blocks, contacts%partners)
    allocate (contacts%force(3, bed_partner:n), contacts%torque(3, bed_partner:n), source=0.0_wp)
    allocate (contacts%impulse(3, bed_partner:n), contacts%twist(3, bed_partner:n), source=0.0_wp)
    allocate (contacts%response%frequency2(bed_partner:n))
    allocate (contacts%response_soon%frequency2(bed_partner:n))
    allocate (contacts%share(n), contacts%steady(3, n), source=0.0_wp)
    allocate (contacts%x(3, n), contacts%q(4, n), contacts%l(3, n), contacts%spin(3, n))
    call ensure_touches(1, contacts%touches)
    call ensure_touches(1, contacts%soon)
    call reserve_springs(1, contacts%springs)
    call reserve_springs(1, contacts%before)
    call sleep_init(input%sleep, contacts%reach, contacts%sleep)
    allocate (contacts%woken(n), source=.false.)
  end subroutine contacts_init

  !> Move the blocks through one fluid step under gravity, the last fluid forces and contact.
  !!
  !! The mean contact forces and torques of the step are left in `blocks`, and v and l at its start
  !! in `v_start` and `l_start`.
  subroutine move_blocks(walls, gravity, dt, contacts, blocks, report)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: dt           !! fluid step [s]
    type(contacts_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    type(contact_report_t), intent(out) :: report
    real(wp) :: left, dt_b, limit

    call begin_step(blocks)
    call share_with_fluid(blocks, contacts%share, contacts%steady)
    contacts%impulse = 0.0_wp
    contacts%twist = 0.0_wp
    contacts%n_met = 0
    call know_partners(walls, gravity, blocks, contacts%partners)
    if (contacts%sleep%active) call know_stillness(blocks)
    call find_touches(walls, blocks, 0.0_wp, contacts)
    if (contacts%sleep%active) call wake_or_sleep(walls, gravity, dt, contacts, blocks)
    left = dt
    if (all_still(blocks)) then
      contacts%impulse(:, 1:) = dt*contacts%sleep%load
      contacts%twist(:, 1:) = dt*contacts%sleep%load_torque
      left = 0.0_wp
    end if
    do while (left > 0.0_wp)
      limit = substep_limit(walls, contacts, blocks, dt)
      if (.not. left < limit*real(most_substeps, wp)) then
        report%info = 1
        return
      end if
      call go_half_way(walls, left, limit, contacts, blocks, dt_b)
      call finish_substep(walls, gravity, dt_b, contacts, blocks, report)
      left = merge(left - dt_b, 0.0_wp, dt_b < left)
      report%substeps = report%substeps + 1
    end do
    blocks%contact_force = contacts%impulse(:, 1:)/dt
    blocks%contact_torque = contacts%twist(:, 1:)/dt
    call hold_sleepers(gravity, dt, blocks)
    call count_partners(contacts, blocks)
    call find_touches(walls, blocks, 0.0_wp, contacts)
    report%energy = elastic_energy(contacts)
  end subroutine move_blocks

  !> Begin a substep: drift for half of it and find what touches then.
  !!
  !! The step is an equal part of the time left. Where the bodies come down on more touches than the
  !! step is short enough for, now or before its end, they go back and take a shorter one.
  subroutine go_half_way(walls, left, limit, contacts, blocks, dt_b)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: left, limit   !! time left, longest substep allowed [s]
    type(contacts_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    real(wp), intent(out) :: dt_b         !! the substep [s]
    real(wp), parameter :: bearable = 1.3_wp   !! times the limit of stiffness: not worth going back
    real(wp) :: longest, allowed

    contacts%x = blocks%x
    contacts%q = blocks%q
    contacts%l = blocks%l
    contacts%spin = blocks%omega
    longest = limit
    do
      dt_b = equal_part(left, longest)
      call drift(0.5_wp*dt_b, blocks)
      call find_touches(walls, blocks, 0.5_wp*dt_b, contacts)
      allowed = stiffness_limit(contacts)
      if (.not. dt_b > bearable*min(allowed, longest)) exit
      blocks%x = contacts%x
      blocks%q = contacts%q
      blocks%l = contacts%l
      blocks%omega = contacts%spin
      longest = allowed
    end do
  end subroutine go_half_way

  !> An equal part of the time left, no longer than allowed [s].
  pure function equal_part(left, longest) result(dt_b)
    real(wp), intent(in) :: left, longest   !! [s]
    real(wp) :: dt_b

    dt_b = left/real(max(1, ceiling(left/longest*(1.0_wp - 1.0e-9_wp))), wp)
  end function equal_part

  !> The rest of a substep: contact and the other half of the drift.
  subroutine finish_substep(walls, gravity, dt_b, contacts, blocks, report)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: gravity(3), dt_b   !! [m/s2, s]
    type(contacts_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    type(contact_report_t), intent(inout) :: report
    integer :: b

    associate (touching => contacts%touches%item(:contacts%touches%n))
      call note_partners(size(touching), touching%a, touching%b, contacts)
    end associate
    call match_springs(contacts)
    call stretch_springs(0.5_wp*dt_b, contacts)
    call kick(gravity, 0.5_wp*dt_b, contacts%steady, blocks%fluid_torque, blocks)
    call know_motion(blocks, contacts%partners)
    call sum_forces(dt_b, contacts, report)
    if (contacts%lubrication%active) call lubricate(walls, blocks, dt_b, contacts%lubrication, &
                                                    contacts%force)
    if (contacts%sleep%active) call hold_or_wake(gravity, contacts%steady, blocks, contacts%sleep, &
      contacts%force(:, 1:), contacts%torque(:, 1:), contacts%woken)
    contacts%impulse = contacts%impulse + dt_b*contacts%force
    contacts%twist = contacts%twist + dt_b*contacts%torque
    do b = 1, blocks%n
      contacts%force(:, b) = contacts%share(b)*contacts%force(:, b)
    end do
    call kick([0.0_wp, 0.0_wp, 0.0_wp], dt_b, contacts%force(:, 1:), contacts%torque(:, 1:), blocks)
    call kick(gravity, 0.5_wp*dt_b, contacts%steady, blocks%fluid_torque, blocks)
    call stop_sleepers(blocks)
    call know_motion(blocks, contacts%partners)
    call stretch_springs(0.5_wp*dt_b, contacts)
    call drift(0.5_wp*dt_b, blocks)
    if (.not. contacts%sleep%active) return
    if (any(contacts%woken)) call rouse(blocks, contacts)
    call note_quiet(gravity, dt_b, blocks, contacts%sleep)
  end subroutine finish_substep

  !> At the start of a step: wake those that the fluid has put out of balance where nothing moves
  !! (else they wake in the substeps), and let those sleep that are tired and in balance.
  subroutine wake_or_sleep(walls, gravity, dt, contacts, blocks)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: dt           !! fluid step [s]
    type(contacts_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    real(wp) :: dt_b
    logical :: changed
    integer :: b

    call know_loads(contacts%sleep)
    if (all_still(blocks)) then
      contacts%force = 0.0_wp
      contacts%torque = 0.0_wp
      call hold_or_wake(gravity, contacts%steady, blocks, contacts%sleep, contacts%force(:, 1:), &
        contacts%torque(:, 1:), contacts%woken)
      changed = any(contacts%woken)
      if (changed) call rouse(blocks, contacts)
    else
      call note_quiet_end(gravity, blocks, contacts%sleep)
      changed = .false.
      do b = 1, blocks%n
        contacts%sleep%tired(b) = is_tired(gravity, b, blocks, contacts%sleep)
      end do
      if (any(contacts%sleep%tired)) then
        dt_b = equal_part(dt, substep_limit(walls, contacts, blocks, dt))
        call let_sleep(gravity, dt_b, contacts, blocks, changed)
      end if
    end if
    contacts%woken = .false.
    if (changed) call find_touches(walls, blocks, 0.0_wp, contacts)
    call note_partners(contacts%sleep%rest%n, contacts%sleep%rest%a, contacts%sleep%rest%b, &
      contacts)
  end subroutine wake_or_sleep

  !> Let tired blocks sleep that touch something, but nothing that is moved at a given rate, and on
  !! which the forces of a substep balance if they do not move.
  subroutine let_sleep(gravity, dt_b, contacts, blocks, changed)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: dt_b         !! the substep [s]
    type(contacts_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    logical, intent(out) :: changed      !! somebody fell asleep
    real(wp), parameter :: half = 0.5_wp
    type(contact_report_t) :: ignored
    integer :: g, a, b

    call match_springs(contacts)
    call know_motion(blocks, contacts%partners)
    do b = 1, blocks%n   ! as in the middle of a substep
      if (blocks%fixed(b) .or. .not. blocks%present(b)) cycle
      associate (v => contacts%partners%v(:, b), omega => contacts%partners%omega(:, b))
        if (contacts%sleep%tired(b)) v = 0.0_wp
        if (contacts%sleep%tired(b)) omega = 0.0_wp
        v = v + 0.5_wp*dt_b*(gravity + contacts%steady(:, b)/blocks%mass(b))
        omega = omega + 0.5_wp*dt_b*matmul(contacts%partners%inverse_inertia(:, :, b), &
          blocks%fluid_torque(:, b))
      end associate
    end do
    call sum_forces(dt_b, contacts, ignored)
    contacts%sleep%touching = .false.
    associate (sleep => contacts%sleep, springs => contacts%springs)
      do g = 1, springs%n
        a = springs%a(g)
        b = springs%b(g)
        sleep%touching(a) = .true.
        if (is_carried(b)) sleep%tired(a) = .false.
        if (b < 1) cycle
        sleep%touching(b) = .true.
        if (is_carried(a)) sleep%tired(b) = .false.
      end do
      changed = .false.
      do b = 1, blocks%n
        if (.not. (sleep%tired(b) .and. sleep%touching(b))) cycle
        if (.not. balanced(half, contacts%force(:, b), contacts%torque(:, b), &
                           contacts%steady(:, b) + blocks%mass(b)*gravity, &
                           blocks%fluid_torque(:, b), sleep%reach(b))) cycle
        ! should it wake before the step ends, contact has taken this
        contacts%impulse(:, b) = contacts%impulse(:, b) - blocks%mass(b)*blocks%v(:, b)
        contacts%twist(:, b) = contacts%twist(:, b) - blocks%l(:, b)
        call put_to_sleep(b, blocks)
        changed = .true.
      end do
    end associate
    if (changed) call lay_down(dt_b, blocks, contacts)
  contains
    !> Whether a partner is moved at a given rate.
    pure function is_carried(b) result(yes)
      integer, intent(in) :: b
      logical :: yes

      if (b < 0) then
        yes = any(abs(contacts%partners%v(:, b)) > 0.0_wp)
      else
        yes = blocks%fixed(b) .and. .not. blocks%still(b)
      end if
    end function is_carried
  end subroutine let_sleep

  !> Move the springs of touches between what does not move to those at rest, with their forces.
  subroutine lay_down(dt_b, blocks, contacts)
    real(wp), intent(in) :: dt_b         !! the substep [s]
    type(blocks_t), intent(in) :: blocks
    type(contacts_t), intent(inout) :: contacts
    type(contact_report_t) :: ignored
    type(wrench_t) :: wrench
    integer :: g, t, a, b

    associate (sleep => contacts%sleep, springs => contacts%springs)
      call ensure_room(springs%n, sleep%chosen)
      do g = 1, springs%n
        a = springs%a(g)
        b = springs%b(g)
        sleep%chosen(g) = at_rest(blocks, a, b)
        if (.not. sleep%chosen(g)) cycle
        wrench = wrench_t()
        call push_group(g, dt_b, motion_between(contacts%partners, a, b), contacts, wrench, ignored)
        springs%force(:, g) = wrench%force
        springs%torque_a(:, g) = wrench%torque_a
        springs%torque_b(:, g) = wrench%torque_b
        springs%energy(g) = stored_energy(springs%k(g), contacts%law%gamma_t, &
          norm(springs%xi(:, g)))
        do t = contacts%groups%first(g), contacts%groups%first(g + 1) - 1
          springs%energy(g) = springs%energy(g) + contacts%response%energy(t)
        end do
      end do
      call move_springs(sleep%chosen, springs, sleep%rest)
      call know_loads(sleep)
    end associate
  end subroutine lay_down

  !> Give the springs of touches with a body that moves now back to those at work.
  subroutine rouse(blocks, contacts)
    type(blocks_t), intent(in) :: blocks
    type(contacts_t), intent(inout) :: contacts
    integer :: i

    associate (sleep => contacts%sleep)
      call ensure_room(sleep%rest%n, sleep%chosen)
      do i = 1, sleep%rest%n
        sleep%chosen(i) = .not. at_rest(blocks, sleep%rest%a(i), sleep%rest%b(i))
      end do
      call move_springs(sleep%chosen, sleep%rest, contacts%springs)
      call know_loads(sleep)
    end associate
  end subroutine rouse

  !> Whether neither body a nor its partner moves.
  pure function at_rest(blocks, a, b) result(yes)
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: a, b
    logical :: yes

    yes = blocks%still(a)
    if (yes .and. b > 0) yes = blocks%still(b)
  end function at_rest

  !> The part of a contact force that moves a body, and what else acts on it all through the step.
  !!
  !! A body M carries fluid M_a along, so a new contact force F changes its velocity by
  !! F/(M + M_a); the rest of F reaches the fluid when the step ends. The fluid force of the step
  !! before holds that part of the contact force of then, which is made good: a force that lasts
  !! acts in full.
  pure subroutine share_with_fluid(blocks, share, steady)
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(inout) :: share(:)       !! (n) [-]
    real(wp), intent(inout) :: steady(:, :)   !! (3, n) [N]
    integer :: b

    do b = 1, blocks%n
      share(b) = blocks%mass(b)/(blocks%mass(b) + blocks%added_mass(b))
      steady(:, b) = blocks%fluid_force(:, b) + (1.0_wp - share(b))*blocks%contact_force(:, b)
    end do
  end subroutine share_with_fluid

  !> Longest substep allowed now [s].
  !!
  !! The smallest of `substep_ratio` dt, a twentieth of the contact time, the limit of stiffness,
  !! and the Courant limit of eq. (6) with the highest relative speed any two points can have of two
  !! bodies near one another or of a body near a wall. Bodies that are not near stay apart.
  pure function substep_limit(walls, contacts, blocks, dt) result(limit)
    type(walls_t), intent(in) :: walls
    type(contacts_t), intent(in) :: contacts
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(in) :: dt   !! fluid step [s]
    real(wp) :: limit
    real(wp) :: speed, near, fastest(2)
    integer :: b

    limit = min(contacts%substep_ratio*dt, contacts%longest_substep, stiffness_limit(contacts))
    if (contacts%exact) then
      near = fastest_near(blocks, contacts%reach, contacts%surface%near)
    else
      near = fastest_near(blocks, contacts%reach, contacts%spheres%near)
    end if
    fastest = 0.0_wp
    do b = 1, blocks%n
      if (.not. blocks%present(b)) cycle
      speed = norm(blocks%v(:, b)) + norm(blocks%omega(:, b))*contacts%reach(b)
      if (.not. speed <= fastest(2)) fastest(2) = speed
      if (.not. fastest(2) <= fastest(1)) fastest = fastest([2, 1])
      if (.not. speed <= near) then
        if (near_wall(walls, blocks%x(:, b), contacts%reach(b) + contacts%clear)) near = speed
      end if
    end do
    if (.not. near*limit <= contacts%courant_max*contacts%smallest) then
      limit = contacts%courant_max*contacts%smallest/near
    end if
    speed = sum(fastest)
    if (.not. speed*limit <= contacts%clear) limit = contacts%clear/speed
  end function substep_limit

  !> Highest relative speed of any two points of listed pairs of bodies [m/s].
  pure function fastest_near(blocks, reach, near) result(fastest)
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(in) :: reach(:)         !! (bodies) [m]
    type(pair_list_t), intent(in) :: near
    real(wp) :: fastest
    real(wp) :: speed
    integer :: p

    fastest = 0.0_wp
    do p = 1, near%n
      associate (a => near%a(p), b => near%b(p))
        speed = norm(blocks%v(:, a) - blocks%v(:, b)) + norm(blocks%omega(:, a))*reach(a) &
          + norm(blocks%omega(:, b))*reach(b)
      end associate
      if (.not. speed <= fastest) fastest = speed
    end do
  end function fastest_near

  !> Whether a wall or the bed is within reach of a place.
  pure function near_wall(walls, x, reach) result(yes)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: x(3), reach   !! [m]
    logical :: yes
    integer :: w

    yes = .true.
    do w = 1, walls%n
      if (dot_product(walls%normal(:, w), x) + reach > walls%offset(w)) return
    end do
    yes = walls%bed%there
    if (yes) yes = bed_is_near(walls%bed, x - reach, x + reach)
  end function near_wall

  !> Longest substep the present touches allow [s].
  !!
  !! For one pair of bodies a sixth of the bound of stability, which keeps the restitution within
  !! 0.01, or a third where they are slow; for all pairs together little more than half of it.
  pure function stiffness_limit(contacts) result(limit)
    type(contacts_t), intent(in) :: contacts
    real(wp) :: limit

    limit = huge(1.0_wp)
    if (contacts%frequency2 > 0.0_wp) limit = impact_turn/sqrt(contacts%frequency2)
  end function stiffness_limit

  !> Find what touches at the present poses, how each touch responds, and how stiff all is together,
  !! counting also what may touch within a time `ahead`.
  subroutine find_touches(walls, blocks, ahead, contacts)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(in) :: ahead   !! [s]
    type(contacts_t), intent(inout) :: contacts

    if (contacts%exact) then
      call find_surface_touches(walls, blocks, ahead, contacts%surface, contacts%touches)
    else
      call find_sphere_touches(walls, blocks, ahead, contacts%spheres, contacts%touches)
    end if
    call set_apart(contacts%touches, contacts%soon)
    call form_groups(contacts%touches, contacts%groups)
    contacts%frequency2 = 0.0_wp
    call know_motion(blocks, contacts%partners)
    if (contacts%touches%n + contacts%soon%n == 0) return
    call know_inertia(blocks, contacts%partners)
    associate (response => contacts%response, soon => contacts%response_soon)
      call respond(contacts%touches, contacts%law, contacts%partners, response)
      if (contacts%soon%n > 0) then
        call respond(contacts%soon, contacts%law, contacts%partners, soon)
        call add_frequencies(contacts%touches, contacts%soon, response, soon)
        contacts%frequency2 = highest_frequency2(contacts%soon, soon)
      end if
      contacts%frequency2 = max(contacts%frequency2, highest_frequency2(contacts%touches, response))
    end associate
  end subroutine find_touches

  !> Gather the touches of each key and partner; mean normal and point weighted by overlap.
  subroutine form_groups(touches, groups)
    type(touches_t), intent(in) :: touches
    type(groups_t), intent(inout) :: groups
    real(wp) :: w, total
    integer :: t, g, i, last

    groups%n = 0
    call ensure_room(touches%n + 1, groups%first)
    call ensure_room(touches%n, groups%new)
    call ensure_room(touches%n, groups%normal)
    call ensure_room(touches%n, groups%arm_a)
    call ensure_room(touches%n, groups%arm_b)
    t = 1
    do while (t <= touches%n)
      g = groups%n + 1
      groups%n = g
      groups%first(g) = t
      do last = t, touches%n - 1
        if (.not. same_spring(touches%item(t), touches%item(last + 1))) exit
      end do
      groups%normal(:, g) = touches%item(t)%normal
      groups%arm_a(:, g) = touches%item(t)%arm_a
      groups%arm_b(:, g) = touches%item(t)%arm_b
      if (last > t) then
        total = 0.0_wp
        groups%normal(:, g) = 0.0_wp
        groups%arm_a(:, g) = 0.0_wp
        do i = t, last
          w = touches%item(i)%weight*touches%item(i)%depth
          total = total + w
          groups%normal(:, g) = groups%normal(:, g) + w*touches%item(i)%normal
          groups%arm_a(:, g) = groups%arm_a(:, g) + w*touches%item(i)%arm_a
        end do
        groups%arm_a(:, g) = groups%arm_a(:, g)/total
        groups%arm_b(:, g) = groups%arm_a(:, g) + (touches%item(t)%arm_b - touches%item(t)%arm_a)
        w = norm(groups%normal(:, g))
        if (w > epsilon(w)*total) then
          groups%normal(:, g) = groups%normal(:, g)/w
        else
          groups%normal(:, g) = touches%item(t)%normal
        end if
      end if
      t = last + 1
    end do
    groups%first(groups%n + 1) = touches%n + 1
  end subroutine form_groups

  !> Whether two touches act on one tangential spring.
  pure function same_spring(one, two) result(yes)
    type(touch_t), intent(in) :: one, two
    logical :: yes

    yes = one%key == two%key .and. one%b == two%b .and. one%a == two%a
  end function same_spring

  !> Give each group its spring: that in memory turned into the present plane, or a new one.
  subroutine match_springs(contacts)
    type(contacts_t), intent(inout) :: contacts
    integer :: g, m, t

    associate (touches => contacts%touches, groups => contacts%groups, old => contacts%before, &
      new => contacts%springs)
      call reserve_springs(new%n, old)
      old%n = new%n
      old%a(:old%n) = new%a(:old%n)
      old%b(:old%n) = new%b(:old%n)
      old%key(:old%n) = new%key(:old%n)
      old%xi(:, :old%n) = new%xi(:, :old%n)
      call reserve_springs(groups%n, new)
      new%n = groups%n
      m = 1
      do g = 1, groups%n
        t = groups%first(g)
        new%a(g) = touches%item(t)%a
        new%b(g) = touches%item(t)%b
        new%key(g) = touches%item(t)%key
        new%xi(:, g) = 0.0_wp
        groups%new(g) = .true.
        do while (m <= old%n)
          if (.not. comes_before(old%a(m), old%b(m), old%key(m), &
                                 new%a(g), new%b(g), new%key(g))) exit
          m = m + 1
        end do
        if (m > old%n) cycle
        groups%new(g) = old%a(m) /= new%a(g) .or. old%b(m) /= new%b(g) .or. old%key(m) /= new%key(g)
        if (.not. groups%new(g)) new%xi(:, g) = turned_into_plane(old%xi(:, m), groups%normal(:, g))
      end do
    end associate
  end subroutine match_springs

  !> The vector xi turned into the plane normal to n, its length kept.
  pure function turned_into_plane(xi, n) result(turned)
    real(wp), intent(in) :: xi(3), n(3)
    real(wp) :: turned(3)
    real(wp) :: length

    turned = xi - dot_product(xi, n)*n
    length = norm(turned)
    if (length > 0.0_wp) turned = turned*(norm(xi)/length)
  end function turned_into_plane

  !> Let the springs follow the present tangential velocities for a time dt.
  pure subroutine stretch_springs(dt, contacts)
    real(wp), intent(in) :: dt   !! [s]
    type(contacts_t), intent(inout) :: contacts
    type(motion_t) :: motion
    real(wp) :: v(3)
    integer :: g

    associate (groups => contacts%groups, springs => contacts%springs)
      do g = 1, groups%n
        if (begins_pair(springs, g)) motion = motion_between(contacts%partners, springs%a(g), &
                                                             springs%b(g))
        v = relative_velocity(motion, groups%arm_a(:, g), groups%arm_b(:, g))
        springs%xi(:, g) = springs%xi(:, g) &
          + dt*(v - dot_product(v, groups%normal(:, g))*groups%normal(:, g))
      end do
    end associate
  end subroutine stretch_springs

  !> Whether spring g is the first of its pair of partners.
  pure function begins_pair(springs, g) result(yes)
    type(springs_t), intent(in) :: springs
    integer, intent(in) :: g
    logical :: yes

    yes = g == 1
    if (.not. yes) yes = springs%a(g) /= springs%a(g - 1) .or. springs%b(g) /= springs%b(g - 1)
  end function begins_pair

  !> Contact forces and torques of this substep on all bodies.
  !!
  !! The damping acts on the velocity in the middle of the substep, which the force itself changes:
  !! F = (k d - eta v_n)/(1 + eta dt/(2 m)), the implicit midpoint rule.
  pure subroutine sum_forces(dt, contacts, report)
    real(wp), intent(in) :: dt   !! [s]
    type(contacts_t), intent(inout) :: contacts
    type(contact_report_t), intent(inout) :: report
    type(motion_t) :: motion
    type(wrench_t) :: wrench
    integer :: g

    contacts%force = 0.0_wp
    contacts%torque = 0.0_wp
    associate (springs => contacts%springs, n => contacts%groups%n)
      do g = 1, n
        if (begins_pair(springs, g)) then
          motion = motion_between(contacts%partners, springs%a(g), springs%b(g))
          wrench = wrench_t()
        end if
        call push_group(g, dt, motion, contacts, wrench, report)
        if (g < n) then
          if (.not. begins_pair(springs, g + 1)) cycle
        end if
        associate (a => springs%a(g), b => springs%b(g))
          contacts%force(:, a) = contacts%force(:, a) + wrench%force
          contacts%force(:, b) = contacts%force(:, b) - wrench%force
          contacts%torque(:, a) = contacts%torque(:, a) + wrench%torque_a
          contacts%torque(:, b) = contacts%torque(:, b) + wrench%torque_b
        end associate
      end do
    end associate
  end subroutine sum_forces

  !> Normal and tangential forces of one group.
  pure subroutine push_group(g, dt, motion, contacts, wrench, report)
    integer, intent(in) :: g
    real(wp), intent(in) :: dt   !! [s]
    type(motion_t), intent(in) :: motion
    type(contacts_t), intent(inout) :: contacts
    type(wrench_t), intent(inout) :: wrench
    type(contact_report_t), intent(inout) :: report
    real(wp) :: v_n, opening, part, force_n, sum_n, decay, eta
    integer :: t

    associate (touches => contacts%touches, groups => contacts%groups, r => contacts%response)
      sum_n = 0.0_wp
      decay = 0.0_wp
      eta = 0.0_wp
      do t = groups%first(g), groups%first(g + 1) - 1
        associate (touch => touches%item(t))
          v_n = dot_product(relative_velocity(motion, touch%arm_a, touch%arm_b), touch%normal)
          part = 1.0_wp
          if (groups%new(g)) part = damped_part(touch%depth, v_n, dt)
          opening = opening_speed(touch, contacts%law%gamma_n, motion)
          force_n = normal_force(r%elastic(t), part*r%eta(t), opening)/(1.0_wp + part*r%decay(t)*dt)
          call act(-force_n*touch%normal, touch%arm_a, touch%arm_b, wrench)
          if (touch%weight < 1.0_wp) call push_to_weight(touch, contacts%law%gamma_n, force_n, &
            wrench)
          report%courant_max = max(report%courant_max, abs(v_n)*dt/touch%length)
          report%overlap_max = max(report%overlap_max, touch%depth)
        end associate
        sum_n = sum_n + force_n
        decay = max(decay, r%decay(t))
        eta = max(eta, r%eta(t))
      end do
      call rub(g, sum_n, eta, 1.0_wp + decay*dt, motion, contacts, wrench)
    end associate
  end subroutine push_group

  !> Time since a new touch began up to the end of the substep, over the substep: 1/2 to 3/2.
  !!
  !! Damping sets in with a jump. A touch is seen first when bodies touch in the middle of a
  !! substep, and may have begun up to a substep before.
  pure function damped_part(depth, v_n, dt) result(part)
    real(wp), intent(in) :: depth, v_n, dt   !! [m, m/s, s]
    real(wp) :: part

    part = 1.0_wp
    if (v_n < 0.0_wp) part = 0.5_wp + min(depth, -v_n*dt)/(-v_n*dt)
  end function damped_part

  !> Tangential force of one group, no larger than friction allows.
  !!
  !! The force of the spring alone is limited too: while it slips, the spring holds what friction
  !! lets it hold, and the dashpot puts no energy into it.
  pure subroutine rub(g, force_n, eta_n, implicit, motion, contacts, wrench)
    integer, intent(in) :: g
    real(wp), intent(in) :: force_n    !! sum of the normal forces [N]
    real(wp), intent(in) :: eta_n      !! normal damping of the group [N s/m]
    real(wp), intent(in) :: implicit   !! 1 + eta dt/(2 m): damping acts in mid-substep
    type(motion_t), intent(in) :: motion
    type(contacts_t), intent(inout) :: contacts
    type(wrench_t), intent(inout) :: wrench
    real(wp) :: v(3), f(3), f_spring(3), k, k_n, eta, bound, size_f
    integer :: t

    associate (groups => contacts%groups, springs => contacts%springs, law => contacts%law)
      t = groups%first(g)
      k_n = contacts%response%k(t)
      k = tangential_constant(law, k_n, contacts%touches%item(t)%weight)
      springs%k(g) = k
      eta = contacts%touches%item(t)%weight*law%eta_t
      if (.not. law%constants) eta = eta_n*(k/k_n)
      bound = force_n*merge(law%wall_friction, law%friction, springs%b(g) < 0)
      v = relative_velocity(motion, groups%arm_a(:, g), groups%arm_b(:, g))
      v = v - dot_product(v, groups%normal(:, g))*groups%normal(:, g)
      f = tangential_force(k, law%gamma_t, eta, springs%xi(:, g), v)/implicit
      size_f = norm(f)
      if (size_f > bound) then
        f = f*(bound/size_f)
        f_spring = tangential_force(k, law%gamma_t, 0.0_wp, springs%xi(:, g), v)
        size_f = norm(f_spring)
        if (size_f > bound) springs%xi(:, g) = tangential_slip(k, law%gamma_t, 0.0_wp, &
          f_spring*(bound/size_f), v)
      end if
      call act(f, groups%arm_a(:, g), groups%arm_b(:, g), wrench)
    end associate
  end subroutine rub

  !> Energy in the normal springs at the present poses and in the tangential springs [J].
  pure function elastic_energy(contacts) result(energy)
    type(contacts_t), intent(in) :: contacts
    real(wp) :: energy
    integer :: t, g

    energy = 0.0_wp
    associate (touches => contacts%touches, r => contacts%response, law => contacts%law, &
      springs => contacts%springs)
      do t = 1, touches%n
        energy = energy + r%energy(t)
      end do
      do g = 1, springs%n
        energy = energy + stored_energy(springs%k(g), law%gamma_t, norm(springs%xi(:, g)))
      end do
    end associate
    do g = 1, contacts%sleep%rest%n
      energy = energy + contacts%sleep%rest%energy(g)
    end do
  end function elastic_energy

  !> Add pairs that touch to those that touched in this step.
  subroutine note_partners(n, touches_a, touches_b, contacts)
    integer, intent(in) :: n                              !! of touches
    integer, intent(in) :: touches_a(:), touches_b(:)     !! (n) sorted
    type(contacts_t), intent(inout) :: contacts
    integer :: t, m, a, b

    a = 0
    b = 0
    m = 1
    do t = 1, n
      if (a == touches_a(t) .and. b == touches_b(t)) cycle
      a = touches_a(t)
      b = touches_b(t)
      do while (m <= contacts%n_met)
        if (.not. comes_before(contacts%met_a(m), contacts%met_b(m), 0, a, b, 0)) exit
        m = m + 1
      end do
      if (met(contacts, m, a, b)) cycle
      call ensure_room(contacts%n_met + 1, contacts%met_a)
      call ensure_room(contacts%n_met + 1, contacts%met_b)
      contacts%met_a(m + 1:contacts%n_met + 1) = contacts%met_a(m:contacts%n_met)
      contacts%met_b(m + 1:contacts%n_met + 1) = contacts%met_b(m:contacts%n_met)
      contacts%met_a(m) = a
      contacts%met_b(m) = b
      contacts%n_met = contacts%n_met + 1
    end do
  end subroutine note_partners

  !> Whether entry m of the pairs met is the pair (a, b).
  pure function met(contacts, m, a, b) result(yes)
    type(contacts_t), intent(in) :: contacts
    integer, intent(in) :: m, a, b
    logical :: yes

    yes = m <= contacts%n_met
    if (yes) yes = contacts%met_a(m) == a .and. contacts%met_b(m) == b
  end function met

  !> Number of partners each body met in this step, and whether the floor was one of them.
  pure subroutine count_partners(contacts, blocks)
    type(contacts_t), intent(in) :: contacts
    type(blocks_t), intent(inout) :: blocks
    integer :: m, a, b

    blocks%contacts = 0
    blocks%on_floor = 0
    do m = 1, contacts%n_met
      a = contacts%met_a(m)
      b = contacts%met_b(m)
      blocks%contacts(a) = blocks%contacts(a) + 1
      if (b > 0) blocks%contacts(b) = blocks%contacts(b) + 1
      if (b == floor_wall .or. b == bed_partner) blocks%on_floor(a) = 1
    end do
  end subroutine count_partners

end module contacts_m
