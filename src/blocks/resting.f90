!> Who falls asleep and who wakes, and what becomes of the displacements between them.
module resting_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use vectors_m, only: norm
  use rigid_body_m, only: blocks_t
  use walls_m, only: walls_t
  use displacements_m, only: move_displacements
  use sleep_m, only: update_loads, sum_memory, may_sleep, balanced, rest_tolerance, &
    wake_tolerance, put_to_sleep, wake, all_still
  use contact_law_m, only: stored_energy
  use counterparts_m, only: counterparts_t, wrench_t, update_motion, motion_between
  use acting_bodies_m, only: list_present
  use contact_detection_m, only: detect_contacts
  use contact_forces_m, only: contact_report_t, match_displacements, sum_forces, push_group
  use substep_limits_m, only: substep_limit, equal_substep
  use counterparts_met_m, only: store_counterparts
  use contact_state_m, only: contacts_t
  implicit none
  private
  public :: wake_or_sleep, hold_or_wake, restore_contacts

contains

  !> At the start of a step: wake those that the fluid has put out of balance where nothing moves
  !! (else they wake in the substeps), and let those sleep that are candidates and in balance.
  subroutine wake_or_sleep(walls, gravity, dt, contacts, blocks)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: dt           !! fluid step [s]
    type(contacts_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    real(wp) :: dt_b
    logical :: changed
    integer :: b

    call update_loads(contacts%sleep)
    if (all_still(blocks)) then
      contacts%loads%force = 0.0_wp
      contacts%loads%torque = 0.0_wp
      call list_present(blocks, contacts%detected%acting)
      call hold_or_wake(gravity, contacts, blocks)
      changed = any(contacts%woken)
      if (changed) call restore_contacts(blocks, contacts)
    else
      changed = .false.
      do b = 1, blocks%n
        contacts%sleep%candidate(b) = may_sleep(gravity, b, blocks, contacts%sleep)
      end do
      if (any(contacts%sleep%candidate)) then
        dt_b = dt
        if (.not. contacts%by_impulses) dt_b = equal_substep(dt, substep_limit(walls, &
          contacts%detected, blocks, dt, contacts%limits))
        call let_sleep(gravity, dt_b, contacts, blocks, changed)
      end if
    end if
    contacts%woken = .false.
    if (changed .and. .not. contacts%by_impulses) call detect_contacts(walls, blocks, 0.0_wp, &
      contacts%detected)
    associate (rest => contacts%sleep%rest)
      call store_counterparts(rest%a(:rest%n), rest%b(:rest%n), contacts%met)
    end associate
  end subroutine wake_or_sleep

  !> Complete the contact forces on the acting bodies by those of the contact points at rest, and
  !! wake who is out of balance.
  !!
  !! Nothing at rest has moved, and in the middle of a substep sleepers have the velocity that the
  !! other forces give them, like all blocks: what wakes now moves as if it had been awake. Those
  !! who sleep on get the force and torque that hold them.
  subroutine hold_or_wake(gravity, contacts, blocks)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    type(contacts_t), intent(inout) :: contacts   !! its loads and `woken`
    type(blocks_t), intent(inout) :: blocks
    real(wp) :: other(3)
    integer :: k

    contacts%woken = .false.
    associate (acting => contacts%detected%acting, loads => contacts%loads, &
               sleep => contacts%sleep, woken => contacts%woken)
      do k = 1, acting%n
        associate (b => acting%body(k))
          if (.not. blocks%still(b)) cycle
          loads%force(:, b) = loads%force(:, b) + sleep%load(:, b)
          loads%torque(:, b) = loads%torque(:, b) + sleep%load_torque(:, b)
          if (.not. blocks%asleep(b)) cycle
          other = contacts%steady(:, b) + blocks%mass(b)*gravity
          woken(b) = .not. balanced(wake_tolerance, loads%force(:, b), loads%torque(:, b), other, &
            blocks%fluid_torque(:, b), sleep%bounding_radius(b))
          if (woken(b)) then
            call wake(b, blocks)
          else
            loads%force(:, b) = -other
            loads%torque(:, b) = -blocks%fluid_torque(:, b)
          end if
        end associate
      end do
    end associate
  end subroutine hold_or_wake

  !> Let candidates sleep that are held up, touch nothing that is moved at a given rate, and on
  !! which the forces of a substep balance if they do not move.
  subroutine let_sleep(gravity, dt_b, contacts, blocks, changed)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: dt_b         !! the substep [s]
    type(contacts_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    logical, intent(out) :: changed      !! somebody fell asleep
    type(contact_report_t) :: ignored
    integer :: b

    if (contacts%by_impulses) then
      contacts%loads%force = 0.0_wp
      contacts%loads%torque = 0.0_wp
      call sum_memory(contacts%displacements, contacts%loads%force(:, 1:), &
        contacts%loads%torque(:, 1:))
    else
      call match_displacements(contacts%detected, contacts%before, contacts%displacements)
      ! Velocities of the counterparts in the middle of a substep, if the candidates begin it at
      ! rest.
      associate (acting => contacts%detected%acting)
        call update_motion(blocks, acting%body(:acting%n), contacts%detected%counterparts)
      end associate
      do b = 1, blocks%n
        if (blocks%fixed(b) .or. .not. blocks%present(b)) cycle
        associate (v => contacts%detected%counterparts%v(:, b), &
                   omega => contacts%detected%counterparts%omega(:, b))
          if (contacts%sleep%candidate(b)) v = 0.0_wp
          if (contacts%sleep%candidate(b)) omega = 0.0_wp
          v = v + 0.5_wp*dt_b*(gravity + contacts%steady(:, b)/blocks%mass(b))
          omega = omega + 0.5_wp*dt_b &
            *matmul(contacts%detected%counterparts%inverse_inertia(:, :, b), &
                    blocks%fluid_torque(:, b))
        end associate
      end do
      call sum_forces(dt_b, contacts%detected, contacts%displacements, contacts%loads, ignored)
    end if
    call update_supported(blocks, contacts)
    changed = .false.
    associate (sleep => contacts%sleep, loads => contacts%loads)
      do b = 1, blocks%n
        if (.not. (sleep%candidate(b) .and. sleep%supported(b))) cycle
        if (.not. balanced(rest_tolerance, loads%force(:, b), loads%torque(:, b), &
                           contacts%steady(:, b) + blocks%mass(b)*gravity, &
                           blocks%fluid_torque(:, b), sleep%bounding_radius(b))) cycle
        ! should it wake before the step ends, contact has taken this
        loads%impulse(:, b) = loads%impulse(:, b) - blocks%mass(b)*blocks%v(:, b)
        loads%twist(:, b) = loads%twist(:, b) - blocks%l(:, b)
        call put_to_sleep(b, blocks)
        changed = .true.
      end do
    end associate
    if (changed) call freeze_contacts(dt_b, blocks, contacts)
  end subroutine let_sleep

  !> Which blocks are held up: they touch a wall, the bed, a body that is fixed or asleep, or others
  !! that are held up. Those are no candidates that touch what is moved at a given rate.
  subroutine update_supported(blocks, contacts)
    type(blocks_t), intent(in) :: blocks
    type(contacts_t), intent(inout) :: contacts
    logical :: changed
    integer :: g, a, b

    associate (sleep => contacts%sleep, displacements => contacts%displacements)
      do g = 1, displacements%n
        a = displacements%a(g)
        b = displacements%b(g)
        if (is_carried(blocks, contacts%detected%counterparts, b)) sleep%candidate(a) = .false.
        if (b < 1) cycle
        if (is_carried(blocks, contacts%detected%counterparts, a)) sleep%candidate(b) = .false.
      end do
      sleep%supported = blocks%fixed .or. blocks%asleep
      changed = .true.
      do while (changed)
        changed = .false.
        do g = 1, displacements%n
          a = displacements%a(g)
          b = displacements%b(g)
          if (b < 1) then
            changed = changed .or. .not. sleep%supported(a)
            sleep%supported(a) = .true.
          else if (sleep%supported(a) .neqv. sleep%supported(b)) then
            changed = .true.
            sleep%supported([a, b]) = .true.
          end if
        end do
      end do
    end associate
  end subroutine update_supported

  !> Whether a counterpart is moved at a given rate.
  pure function is_carried(blocks, counterparts, b) result(yes)
    type(blocks_t), intent(in) :: blocks
    type(counterparts_t), intent(in) :: counterparts
    integer, intent(in) :: b
    logical :: yes

    if (b < 0) then
      yes = any(abs(counterparts%v(:, b)) > 0.0_wp)
    else
      yes = blocks%fixed(b) .and. .not. blocks%still(b)
    end if
  end function is_carried

  !> Move the displacements of contact points between what does not move to those at rest, with
  !! their forces.
  subroutine freeze_contacts(dt_b, blocks, contacts)
    real(wp), intent(in) :: dt_b         !! the substep [s]
    type(blocks_t), intent(in) :: blocks
    type(contacts_t), intent(inout) :: contacts
    type(contact_report_t) :: ignored
    type(wrench_t) :: wrench
    integer :: g, t, a, b

    associate (sleep => contacts%sleep, displacements => contacts%displacements)
      call ensure_capacity(displacements%n, sleep%chosen)
      do g = 1, displacements%n
        a = displacements%a(g)
        b = displacements%b(g)
        sleep%chosen(g) = at_rest(blocks, a, b)
        if (contacts%by_impulses .or. .not. sleep%chosen(g)) cycle
        wrench = wrench_t()
        call push_group(g, dt_b, motion_between(contacts%detected%counterparts, a, b), &
          contacts%detected, displacements, wrench, ignored)
        displacements%force(:, g) = wrench%force
        displacements%torque_a(:, g) = wrench%torque_a
        displacements%torque_b(:, g) = wrench%torque_b
        displacements%energy(g) = stored_energy(displacements%k(g), contacts%detected%law%gamma_t, &
          norm(displacements%xi(:, g)))
        do t = contacts%detected%groups%first(g), contacts%detected%groups%first(g + 1) - 1
          displacements%energy(g) = displacements%energy(g) + contacts%detected%response%energy(t)
        end do
      end do
      call move_displacements(sleep%chosen, displacements, sleep%rest)
      call update_loads(sleep)
    end associate
  end subroutine freeze_contacts

  !> Give the displacements of contact points with a body that moves now back to those at work.
  subroutine restore_contacts(blocks, contacts)
    type(blocks_t), intent(in) :: blocks
    type(contacts_t), intent(inout) :: contacts
    integer :: i

    associate (sleep => contacts%sleep)
      call ensure_capacity(sleep%rest%n, sleep%chosen)
      do i = 1, sleep%rest%n
        sleep%chosen(i) = .not. at_rest(blocks, sleep%rest%a(i), sleep%rest%b(i))
      end do
      call move_displacements(sleep%chosen, sleep%rest, contacts%displacements)
      call update_loads(sleep)
    end associate
  end subroutine restore_contacts

  !> Whether neither body a nor its counterpart moves.
  pure function at_rest(blocks, a, b) result(yes)
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: a, b
    logical :: yes

    yes = blocks%still(a)
    if (yes .and. b > 0) yes = blocks%still(b)
  end function at_rest

end module resting_m
