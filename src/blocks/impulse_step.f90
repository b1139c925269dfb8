!> Contact by impulses: few long steps within a fluid step, each of which finds what touches or may
!! come to touch once, and solves for the impulses of all contact points together.
!!
!! A step is as long as the fastest motion of what can meet in it allows; what is far from all
!! others falls in one step.
module impulse_step_m
  use kinds_m, only: wp
  use case_types_m, only: contact_input_t
  use vectors_m, only: cross, distance, norm
  use rigid_body_m, only: blocks_t, drift_body, kick_body, place_body, haste, change_by_motion
  use walls_m, only: walls_t
  use bed_m, only: bed_counterpart, bed_is_near, bed_place
  use contact_surface_m, only: contact_surface_t, contact_surface_init, find_surface_points, &
    cover_way, renew_pairs
  use counterparts_m, only: update_motion, update_inertia
  use contact_solver_m, only: contact_solver_t, contact_report_t, start_solver, equal_substep, &
    list_bodies, store_counterparts
  use impulse_rows_m, only: rows_t, rows_init, make_rows, store_memory, sum_loads
  use impulse_sweeps_m, only: solve_rows
  use lubrication_m, only: lubricate
  use resting_m, only: hold_or_wake, restore_contacts
  implicit none
  private
  public :: impulses_t

  integer, parameter :: max_steps = 1000000       !! of a fluid step; beyond, something went wrong
  integer, parameter :: n_sub_sweeps = 8          !! of a contact time; fewer let stacks creep
  real(wp), parameter :: max_way = 0.3_wp         !! of a step, over the smallest edge [-]
  real(wp), parameter :: margin = 0.05_wp         !! of a contact point to come, over that edge [-]
  real(wp), parameter :: max_opening = 0.05_wp    !! of an overlap in a contact time, likewise [-]
  real(wp), parameter :: free_way = 0.5_wp
    !! covered by the list of pairs, over a bounding radius [-]
  real(wp), parameter :: film_steps = 20.0_wp     !! of a contact time, where films are computed

  type, extends(contact_solver_t) :: impulses_t
    type(contact_surface_t) :: surface
    type(rows_t) :: rows
    real(wp), allocatable :: film(:, :)      !! (3, counterparts) forces of films and slings [N]
    real(wp), allocatable :: spread(:, :)    !! (3, counterparts) see `sum_loads` [N]
    real(wp), allocatable :: gain(:)         !! (n) work: speed gained in free fall [m/s]
    real(wp) :: restitution = 0.0_wp         !! [-]
    real(wp) :: smallest_edge = 0.0_wp       !! of all blocks [m]
  contains
    procedure, pass(contacts) :: init
    procedure, pass(contacts) :: advance => move_by_impulses
  end type impulses_t

contains

  subroutine init(input, blocks, contacts)
    type(contact_input_t), intent(in) :: input
    type(blocks_t), intent(in) :: blocks
    class(impulses_t), intent(inout) :: contacts
    integer :: b

    call contact_surface_init(input%contact_time, blocks, contacts%surface)
    call start_solver(input, blocks, contacts%surface%bounding_radius, contacts)
    contacts%exact = .true.
    call rows_init(input, blocks%n, contacts%rows)
    allocate (contacts%film(3, bed_counterpart:blocks%n), contacts%gain(blocks%n), &
      contacts%spread(3, bed_counterpart:blocks%n), source=0.0_wp)
    contacts%restitution = input%restitution
    if (blocks%n > 0) contacts%smallest_edge &
      = minval([(blocks%shapes(blocks%shape(b))%smallest_edge, b=1, blocks%n)])
  end subroutine init

  !> Move the blocks through a fluid step; impulses of contact are added to the loads of the step.
  subroutine move_by_impulses(walls, gravity, dt, contacts, blocks, report)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: dt           !! fluid step [s]
    class(impulses_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    type(contact_report_t), intent(inout) :: report
    real(wp) :: left, longest, step, h
    logical :: woke
    integer :: n

    left = dt
    do while (left > 0.0_wp)
      call longest_step(walls, gravity, left, contacts, blocks, longest)
      if (.not. left < longest*real(max_steps, wp)) then
        report%info = 1
        return
      end if
      step = equal_substep(left, longest)
      n = ceiling(step*real(n_sub_sweeps, wp)/contacts%rows%contact_time*(1.0_wp - 1.0e-9_wp))
      h = step/real(n, wp)
      do
        call solve_step(walls, gravity, h, n, step, contacts, blocks)
        if (.not. allocated(contacts%sleep%reach)) exit
        call hold_or_wake(gravity, contacts, blocks, woke)
        if (.not. woke) exit
        call restore_contacts(blocks, contacts)   ! what wakes takes part: once more
      end do
      call finish_step(gravity, step, h, contacts, blocks, report)
      left = merge(left - step, 0.0_wp, step < left)
      report%substeps = report%substeps + 1
    end do
  end subroutine move_by_impulses

  !> Longest contact step now [s].
  !!
  !! Bodies that can meet, or touch, move by a share of the smallest edge at most, and for a contact
  !! time; others may move until they can.
  subroutine longest_step(walls, gravity, left, contacts, blocks, longest)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: left         !! of the fluid step [s]
    type(impulses_t), intent(inout) :: contacts
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(out) :: longest
    real(wp) :: speed, most, two(2), edge
    integer :: p, b, w

    two = 0.0_wp
    do b = 1, blocks%n
      if (.not. blocks%present(b) .or. blocks%still(b)) then
        contacts%gain(b) = 0.0_wp
        cycle
      end if
      contacts%gain(b) = merge(0.0_wp, norm(gravity + contacts%steady(1:3, b)/blocks%mass(b)), &
                               blocks%fixed(b))*left &
        + haste(blocks, b, contacts%surface%bounding_radius(b))
      speed = fastest(b)
      if (.not. speed <= two(2)) two(2) = speed
      if (.not. two(2) <= two(1)) two = two([2, 1])
    end do
    most = sum(two)
    longest = 0.0_wp
    if (.not. most <= huge(most)) return   ! not a number
    associate (s => contacts%surface)
      edge = contacts%smallest_edge
      longest = left
      if (allocated(contacts%lubrication%radius)) longest = min(left, &
        contacts%rows%contact_time/film_steps)
      if (most*longest > free_way*maxval(s%bounding_radius)) longest = min(longest, &
        max(contacts%rows%contact_time, free_way*maxval(s%bounding_radius)/most))
      call cover_way(most*longest + margin*edge + norm(gravity)*longest**2, s)
      call renew_pairs(walls, blocks, s)
      do b = 1, blocks%n
        if (.not. blocks%present(b) .or. blocks%still(b) .or. blocks%fixed(b)) cycle
        speed = fastest(b)
        do w = 1, walls%n
          call limit_by(walls%offset(w) - dot_product(walls%normal(:, w), blocks%x(:, b)) &
                        - s%bounding_radius(b), speed)
        end do
        if (walls%bed%there) then
          associate (place => bed_place(walls%bed, blocks%x(:, b)), far => s%bounding_radius(b) &
            + left*speed)
            if (bed_is_near(walls%bed, place - far, place + far)) call limit_by(0.0_wp, speed)
          end associate
        end if
      end do
      do p = 1, s%near%n
        associate (a => s%near%a(p), c => s%near%b(p))
          if (blocks%still(a) .and. blocks%still(c)) cycle
          speed = distance(blocks%v(:, a), blocks%v(:, c)) + norm(blocks%omega(:, &
            a))*s%bounding_radius(a) + norm(blocks%omega(:, c))*s%bounding_radius(c) &
            + contacts%gain(a) + contacts%gain(c)
          call limit_by(distance(blocks%x(:, a), blocks%x(:, c) + s%near%shift(:, p)) &
                        - s%bounding_radius(a) - s%bounding_radius(c), speed)
        end associate
      end do
    end associate
  contains
    !> Speed of any point of a body until the fluid step ends, at most [m/s].
    pure real(wp) function fastest(b)
      integer, intent(in) :: b

      fastest = norm(blocks%v(:, b)) + norm(blocks%omega(:, &
        b))*contacts%surface%bounding_radius(b) + contacts%gain(b)
    end function fastest

    !> What a gap allows that closes at a speed.
    subroutine limit_by(gap, closing)
      real(wp), intent(in) :: gap, closing   !! [m], [m/s]

      if (gap > closing*longest) return
      longest = min(longest, max(max(gap, 0.0_wp)/max(closing, tiny(closing)), &
        min(contacts%rows%contact_time, max_way*edge/max(closing, tiny(closing)))))
    end subroutine limit_by
  end subroutine longest_step

  !> Find the contact points of a contact step and their impulses; the bodies stay where they are.
  !! The step may become shorter.
  subroutine solve_step(walls, gravity, h, n, step, contacts, blocks)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: h            !! sub-sweep [s]
    integer, intent(inout) :: n          !! of them
    real(wp), intent(inout) :: step      !! all of them [s]
    type(impulses_t), intent(inout) :: contacts
    type(blocks_t), intent(in) :: blocks
    real(wp) :: by_film(3)
    integer :: k, asked

    associate (surface => contacts%surface, rows => contacts%rows, loads => contacts%loads)
      surface%search%margin = margin*contacts%smallest_edge + norm(gravity)*step**2
      call find_surface_points(walls, blocks, step, surface, contacts%points)
      call list_bodies(blocks%present, contacts%acting)
      associate (there => contacts%acting%body(:contacts%acting%n))
        call update_motion(blocks, there, contacts%counterparts)
        call update_inertia(blocks, there, contacts%counterparts)
      end associate
      contacts%film = 0.0_wp
      contacts%film(3, 1:) = blocks%sling
      if (allocated(contacts%lubrication%radius)) call lubricate(walls, blocks, step, 0.5_wp*step, &
        contacts%lubrication, contacts%film)
      call make_rows(h, contacts%points, contacts%counterparts, blocks, &
        contacts%displacements, rows)
      if (rows%n > 0) then
        ! Accelerations of all bodies with rows but for contact, at the start of the step.
        do k = 1, rows%n_active
          associate (b => rows%active(k))
            rows%a_free(:, b) = 0.0_wp
            if (b > 0) then
              if (blocks%path(b)%n > 0) rows%a_free(:, b) = change_by_motion(blocks, b, step)/step
            end if
            if (rows%inverse_mass(b) <= 0.0_wp) cycle
            by_film = rows%inverse_mass(b)*contacts%film(:, b)
            rows%a_free(1:3, b) = gravity + contacts%steady(1:3, b)/blocks%mass(b) + by_film
            rows%a_free(4:6, b) = matmul(rows%inverse_inertia(:, :, b), &
              contacts%steady(4:6, b) - cross(blocks%omega(:, b), blocks%l(:, b)))
          end associate
        end do
        asked = n
        call solve_rows(h, norm(gravity), max_opening*contacts%smallest_edge/rows%contact_time, &
          contacts%restitution, n, rows)
        if (n < asked) step = h*real(n, wp)   ! else rounding would leave a step of no length
      end if
      call sum_loads(step, rows, loads%force, loads%torque, contacts%spread)
      loads%force = loads%force + contacts%film
    end associate
  end subroutine solve_step

  !> Move the bodies by what was found, book the impulses, remember the contact points.
  subroutine finish_step(gravity, step, h, contacts, blocks, report)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: step, h      !! [s]
    type(impulses_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    type(contact_report_t), intent(inout) :: report
    real(wp) :: force(3)
    integer :: b, k, r
    logical :: touched(contacts%rows%n_pairs)

    blocks%time = blocks%time + step
    associate (rows => contacts%rows, loads => contacts%loads)
      do b = 1, blocks%n
        if (.not. blocks%present(b) .or. blocks%asleep(b)) cycle
        if (rows%busy(b) .and. .not. blocks%fixed(b)) then
          call place_body(b, rows%way(:, b), rows%v(1:3, b), &
            step*(contacts%steady(4:6, b) + loads%torque(:, b)), blocks)
        else
          force = contacts%steady(1:3, b) + contacts%share(b)*contacts%film(:, b)
          call kick_body(gravity, 0.5_wp*step, force, contacts%steady(4:6, b), b, blocks)
          call drift_body(step, b, blocks)
          call kick_body(gravity, 0.5_wp*step, force, contacts%steady(4:6, b), b, blocks)
        end if
      end do
      do b = 1, blocks%n
        loads%peak(b) = max(loads%peak(b), norm(loads%force(:, b) + contacts%spread(:, b)))
      end do
      loads%impulse = loads%impulse + step*loads%force
      loads%twist = loads%twist + step*loads%torque
      ! Counterparts that touched, how deep at the start of the step, and how far they came in it.
      do k = 1, rows%n_pairs
        associate (first => rows%first(k), last => rows%first(k + 1) - 1)
          touched(k) = any(rows%largest(first:last) > 0.0_wp)
          do r = first, last
            report%overlap_max = max(report%overlap_max, -rows%row(r)%gap_start)
            if (rows%largest(r) > 0.0_wp) report%courant_max = max(report%courant_max, &
              abs(rows%closing(r))*step/contacts%points%item(rows%point(r))%length)
          end do
        end associate
      end do
      call store_counterparts(pack(rows%a(:rows%n_pairs), touched), pack(rows%b(:rows%n_pairs), &
        touched), contacts%met)
      call store_memory(h, contacts%points, rows, contacts%displacements)
    end associate
  end subroutine finish_step

end module impulse_step_m
