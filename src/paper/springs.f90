!> Contact by springs and dashpots: the substeps of a fluid step.
!!
!! Each substep moves the bodies half way, finds what touches, changes the velocities, and moves
!! them the other half, so that springs are second order in time and a free fall is exact.
module springs_m
  use kinds_m, only: wp
  use case_types_m, only: contact_input_t
  use vectors_m, only: distance, norm
  use rigid_body_m, only: blocks_t, drift, kick_body, haste
  use walls_m, only: walls_t
  use bed_m, only: bed_is_near, bed_place
  use sleep_m, only: put_to_sleep
  use lubrication_m, only: lubricate
  use counterparts_m, only: update_motion, update_inertia
  use displacements_m, only: displacements_t, reserve_displacements
  use contact_groups_m, only: form_groups, keep_touching
  use contact_spheres_m, only: contact_spheres_t, contact_spheres_init, find_sphere_points
  use contact_response_m, only: response_t, response_init, respond, stiffness_limit
  use contact_forces_m, only: match_displacements, integrate_displacements, sum_groups, &
    elastic_energy
  use contact_solver_m, only: contact_solver_t, contact_report_t, start_solver, equal_substep, &
    list_bodies, store_counterparts
  use resting_m, only: hold_or_wake, restore_contacts
  implicit none
  private
  public :: springs_t

  real(wp), parameter :: substeps_per_contact = 20.0_wp   !! at least
  integer, parameter :: max_substeps = 1000000   !! of a fluid step; beyond, something went wrong

  type, extends(contact_solver_t) :: springs_t
    type(contact_spheres_t) :: spheres
    type(response_t) :: response
    real(wp) :: substep_ratio = 0.0_wp           !! longest substep over the fluid step [-]
    real(wp) :: contact_time = 0.0_wp            !! [s]
    real(wp) :: courant_max = 0.0_wp             !! C_s of eq. (6) [-]
    real(wp) :: stiffness_limit = 0.0_wp         !! longest substep for all springs [s]
    type(displacements_t) :: before              !! work: displacements of the substep before
    real(wp), allocatable :: support(:, :)
      !! (6, n) force and torque that hold a sleeper when the step begins [N], [N m]
  contains
    procedure, pass(contacts) :: init
    procedure, pass(contacts) :: detect
    procedure, pass(contacts) :: advance
    procedure, pass(contacts) :: energy
  end type springs_t

contains

  subroutine init(input, blocks, contacts)
    type(contact_input_t), intent(in) :: input
    type(blocks_t), intent(in) :: blocks
    class(springs_t), intent(inout) :: contacts

    call contact_spheres_init(input%courant_max, blocks, contacts%spheres)
    call start_solver(input, blocks, contacts%spheres%bounding_radius, contacts)
    call response_init(input, blocks, contacts%response)
    contacts%contact_time = input%contact_time
    contacts%courant_max = input%courant_max
    contacts%substep_ratio = input%substep_ratio
    call reserve_displacements(1, contacts%before)
    allocate (contacts%support(6, blocks%n), source=0.0_wp)
  end subroutine init

  !> Find what touches at the present poses.
  subroutine detect(walls, contacts, blocks)
    type(walls_t), intent(in) :: walls
    class(springs_t), intent(inout) :: contacts
    type(blocks_t), intent(in) :: blocks

    call find_springs(walls, blocks, 0.0_wp, contacts)
  end subroutine detect

  !> Find what touches at the present poses, how each contact point responds, and how long a substep
  !! may be, also for what may touch within a time `ahead`.
  subroutine find_springs(walls, blocks, ahead, contacts)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(in) :: ahead   !! [s]
    type(springs_t), intent(inout) :: contacts
    logical :: acts(blocks%n)
    integer :: t, n

    associate (points => contacts%points, response => contacts%response)
      call find_sphere_points(walls, blocks, ahead, contacts%spheres, points)
      acts = blocks%present .and. .not. blocks%asleep
      do t = 1, points%n   ! also sleepers that are touched, or may be soon
        acts(points%item(t)%a) = .true.
        if (points%item(t)%b > 0) acts(points%item(t)%b) = .true.
      end do
      call list_bodies(acts, contacts%acting)
      associate (acting => contacts%acting%body(:contacts%acting%n))
        call update_motion(blocks, acting, contacts%counterparts)
        call update_inertia(blocks, acting, contacts%counterparts)
      end associate
      call respond(points, contacts%counterparts, response)
      contacts%stiffness_limit = stiffness_limit(points, response)
      n = points%n
      call keep_touching(points)
      if (points%n < n) call respond(points, contacts%counterparts, response)
      call form_groups(points, response%groups)
    end associate
  end subroutine find_springs

  !> Move the blocks through a fluid step in substeps.
  subroutine advance(walls, gravity, dt, contacts, blocks, report)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: dt           !! fluid step [s]
    class(springs_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    type(contact_report_t), intent(inout) :: report
    real(wp) :: left, longest, dt_b
    integer :: b

    ! What holds those asleep acts for the whole step: a substep adds by how much the force on them
    ! differs. All of them are tested in the first substep, those that something touches in others.
    do b = 1, blocks%n
      contacts%support(:, b) = 0.0_wp
      if (.not. blocks%asleep(b)) cycle
      associate (support => contacts%support(:, b), loads => contacts%loads)
        support(1:3) = -(contacts%steady(1:3, b) + blocks%mass(b)*gravity)
        support(4:6) = -contacts%steady(4:6, b)
        loads%impulse(:, b) = loads%impulse(:, b) + dt*support(1:3)
        loads%twist(:, b) = loads%twist(:, b) + dt*support(4:6)
      end associate
    end do
    left = dt
    do while (left > 0.0_wp)
      longest = substep_limit(walls, dt, contacts, blocks)
      if (.not. left < longest*real(max_substeps, wp)) then
        report%info = 1
        return
      end if
      call drift_to_middle(walls, left, longest, contacts, blocks, dt_b)
      call push_bodies(walls, gravity, dt_b, contacts, blocks, report)
      left = merge(left - dt_b, 0.0_wp, dt_b < left)
      report%substeps = report%substeps + 1
    end do
  end subroutine advance

  !> Begin a substep: drift for half of it and find what touches then.
  !!
  !! The step is an equal part of the time left. Where the bodies come down on more contact points
  !! than the step is short enough for, now or before its end, they go back and take a shorter one.
  subroutine drift_to_middle(walls, left, limit, contacts, blocks, dt_b)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: left, limit   !! time left, longest substep allowed [s]
    type(springs_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    real(wp), intent(out) :: dt_b         !! the substep [s]
    real(wp), parameter :: bearable = 1.3_wp   !! times the limit of stiffness: not worth going back
    real(wp) :: longest, allowed, time, x(3, blocks%n), lost(3, blocks%n), q(4, blocks%n)
    real(wp) :: l(3, blocks%n), omega(3, blocks%n)

    time = blocks%time
    x = blocks%x
    lost = blocks%lost
    q = blocks%q
    l = blocks%l
    omega = blocks%omega
    longest = limit
    do
      dt_b = equal_substep(left, longest)
      call drift(0.5_wp*dt_b, blocks)
      call find_springs(walls, blocks, 0.5_wp*dt_b, contacts)
      allowed = contacts%stiffness_limit
      if (.not. dt_b > bearable*min(allowed, longest)) exit
      blocks%time = time
      blocks%x = x
      blocks%lost = lost
      blocks%q = q
      blocks%l = l
      blocks%omega = omega
      longest = allowed
    end do
  end subroutine drift_to_middle

  !> Longest substep allowed now [s].
  !!
  !! The smallest of a share of the fluid step, a twentieth of the contact time, the limit of
  !! stiffness, and the Courant limit of eq. (6) with the highest relative speed of any two points
  !! of two bodies near one another or of a body near a wall. Bodies that are not near stay apart.
  pure function substep_limit(walls, dt, contacts, blocks) result(limit)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: dt            !! fluid step [s]
    type(springs_t), intent(in) :: contacts
    type(blocks_t), intent(in) :: blocks
    real(wp) :: limit
    real(wp) :: speed, near, fastest(2)
    integer :: b, p

    limit = min(contacts%substep_ratio*dt, contacts%contact_time/substeps_per_contact, &
      contacts%stiffness_limit)
    near = 0.0_wp
    associate (spheres => contacts%spheres, radius => contacts%spheres%bounding_radius)
      do p = 1, spheres%near%n
        associate (a => spheres%near%a(p), c => spheres%near%b(p))
          if (blocks%still(a) .and. blocks%still(c)) cycle
          if (distance(blocks%x(:, a), blocks%x(:, c) + spheres%near%shift(:, p)) &
              > radius(a) + radius(c) + spheres%unlisted_gap) cycle
          speed = distance(blocks%v(:, a), blocks%v(:, c)) + norm(blocks%omega(:, a))*radius(a) &
            + norm(blocks%omega(:, c))*radius(c) + haste(blocks, a, radius(a)) &
            + haste(blocks, c, radius(c))
        end associate
        if (.not. speed <= near) near = speed
      end do
      fastest = 0.0_wp
      do b = 1, blocks%n
        if (.not. blocks%present(b) .or. blocks%still(b)) cycle
        speed = norm(blocks%v(:, b)) + norm(blocks%omega(:, b))*radius(b) &
          + haste(blocks, b, radius(b))
        if (.not. speed <= fastest(2)) fastest(2) = speed
        if (.not. fastest(2) <= fastest(1)) fastest = fastest([2, 1])
        if (.not. speed <= near) then
          if (near_wall(walls, blocks%x(:, b), radius(b) + spheres%unlisted_gap)) near = speed
        end if
      end do
      if (.not. near*limit <= contacts%courant_max*spheres%smallest) then
        limit = contacts%courant_max*spheres%smallest/near
      end if
      speed = sum(fastest)
      if (.not. speed*limit <= spheres%unlisted_gap) limit = spheres%unlisted_gap/speed
    end associate
  end function substep_limit

  !> Whether a wall or the bed is within a radius of a place.
  pure function near_wall(walls, x, radius) result(yes)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: x(3), radius   !! [m]
    logical :: yes
    real(wp) :: place(3)
    integer :: w

    yes = .true.
    do w = 1, walls%n
      if (dot_product(walls%normal(:, w), x) + radius > walls%offset(w)) return
    end do
    yes = walls%bed%there
    if (.not. yes) return
    place = bed_place(walls%bed, x)
    yes = bed_is_near(walls%bed, place - radius, place + radius)
  end function near_wall

  !> The rest of a substep: contact and the other half of the drift.
  subroutine push_bodies(walls, gravity, dt_b, contacts, blocks, report)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: gravity(3), dt_b   !! [m/s2, s]
    type(springs_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    type(contact_report_t), intent(inout) :: report
    real(wp), parameter :: none(3) = 0.0_wp
    logical :: woke
    integer :: k

    if (report%substeps == 0 .or. allocated(contacts%lubrication%radius)) call list_bodies( &
      blocks%present, contacts%acting)
    associate (groups => contacts%response%groups, displacements => contacts%displacements, &
      loads => contacts%loads, support => contacts%support, counterparts => contacts%counterparts, &
      acting => contacts%acting%body(:contacts%acting%n))
      associate (point => contacts%points%item(:contacts%points%n))
        call store_counterparts(point%a, point%b, contacts%met)
      end associate
      call match_displacements(contacts%points, groups, contacts%before, displacements)
      call integrate_displacements(0.5_wp*dt_b, groups, counterparts, displacements)
      do k = 1, size(acting)
        associate (b => acting(k))
          call kick_body(gravity, 0.5_wp*dt_b, contacts%steady(1:3, b), contacts%steady(4:6, b), &
                         b, blocks)
        end associate
      end do
      call update_motion(blocks, acting, counterparts)
      loads%force = 0.0_wp
      loads%torque = 0.0_wp
      loads%force(3, 1:) = blocks%sling
      call sum_groups(dt_b, contacts%points, contacts%response, counterparts, displacements, &
        loads, report)
      if (allocated(contacts%lubrication%radius)) call lubricate(walls, blocks, dt_b, 0.0_wp, &
        contacts%lubrication, loads%force)
      woke = .false.
      if (allocated(contacts%sleep%reach)) call hold_or_wake(gravity, contacts, blocks, woke)
      do k = 1, size(acting)
        associate (b => acting(k))
          loads%impulse(:, b) = loads%impulse(:, b) + dt_b*(loads%force(:, b) - support(1:3, b))
          loads%twist(:, b) = loads%twist(:, b) + dt_b*(loads%torque(:, b) - support(4:6, b))
          loads%peak(b) = max(loads%peak(b), norm(loads%force(:, b)))
          call kick_body(none, dt_b, contacts%share(b)*loads%force(:, b), loads%torque(:, b), b, &
                         blocks)
          call kick_body(gravity, 0.5_wp*dt_b, contacts%steady(1:3, b), contacts%steady(4:6, b), &
                         b, blocks)
          ! sleepers had the velocity of the middle of the substep, and have none at its end
          if (blocks%asleep(b)) call put_to_sleep(b, blocks)
        end associate
      end do
      call update_motion(blocks, acting, counterparts)
      call integrate_displacements(0.5_wp*dt_b, groups, counterparts, displacements)
    end associate
    call drift(0.5_wp*dt_b, blocks)
    if (woke) call restore_contacts(blocks, contacts)
  end subroutine push_bodies

  !> Energy of the springs, at the present poses, and of those asleep [J].
  pure function energy(contacts)
    class(springs_t), intent(in) :: contacts
    real(wp) :: energy

    energy = elastic_energy(contacts%points%n, contacts%response, contacts%displacements, &
      contacts%sleep%frozen)
  end function energy

end module springs_m
