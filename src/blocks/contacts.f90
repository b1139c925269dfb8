!> The substeps of a fluid step, in which bodies touch.
!!
!! Each substep moves the bodies half way, finds what touches, changes the velocities, and moves
!! them the other half, so that springs are second order in time and a free fall is exact.
module contacts_m
  use kinds_m, only: wp
  use rigid_body_m, only: blocks_t, begin_step, drift, kick_body, hold_sleepers, look_ahead, &
    follow_motions, fastest_point
  use walls_m, only: walls_t
  use sleep_m, only: update_stillness, store_poses, store_quiet, put_to_sleep, all_still
  use lubrication_m, only: lubricate
  use counterparts_m, only: update_counterparts, update_motion
  use acting_bodies_m, only: list_present
  use contact_detection_m, only: detect_contacts
  use contact_forces_m, only: contact_report_t, match_displacements, integrate_displacements, &
    sum_forces, elastic_energy, energy_in_memory
  use impulse_step_m, only: move_by_impulses
  use substep_limits_m, only: substep_limit, stiffness_limit, equal_substep
  use counterparts_met_m, only: store_counterparts, count_counterparts
  use contact_state_m, only: contacts_t, contacts_init
  use resting_m, only: wake_or_sleep, hold_or_wake, restore_contacts
  implicit none
  private
  public :: contacts_t, contacts_init, move_blocks, contact_report_t

  integer, parameter :: max_substeps = 1000000   !! of a fluid step; beyond, something went wrong

contains

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
    real(wp) :: left, dt_b, limit, began
    logical :: changed
    integer :: b

    call begin_step(blocks)
    began = blocks%time
    call look_ahead(dt, blocks)
    if (contacts%sleep%active) call store_poses(blocks, contacts%sleep)
    call share_with_fluid(blocks, contacts%share, contacts%steady)
    contacts%loads%impulse = 0.0_wp
    contacts%loads%twist = 0.0_wp
    contacts%met%n = 0
    call update_counterparts(walls, gravity, blocks, contacts%detected%counterparts)
    if (contacts%sleep%active) then
      call update_stillness(blocks, changed)
      if (changed) call restore_contacts(blocks, contacts)
    end if
    if (.not. contacts%by_impulses) call detect_contacts(walls, blocks, 0.0_wp, contacts%detected)
    if (contacts%sleep%active) call wake_or_sleep(walls, gravity, dt, contacts, blocks)
    left = dt
    if (all_still(blocks)) then
      contacts%loads%impulse(:, 1:) = dt*contacts%sleep%load
      contacts%loads%twist(:, 1:) = dt*contacts%sleep%load_torque
      left = 0.0_wp
    else if (contacts%by_impulses) then
      call move_by_impulses(walls, gravity, dt, contacts, blocks, report)
      left = 0.0_wp
    end if
    if (left > 0.0_wp) call hold_for_step(gravity, dt, contacts, blocks)
    do while (left > 0.0_wp)
      limit = substep_limit(walls, contacts%detected, blocks, dt, contacts%limits)
      if (.not. left < limit*real(max_substeps, wp)) then
        report%info = 1
        return
      end if
      call go_half_way(walls, left, limit, contacts, blocks, dt_b)
      call finish_substep(walls, gravity, dt_b, contacts, blocks, report)
      left = merge(left - dt_b, 0.0_wp, dt_b < left)
      report%substeps = report%substeps + 1
    end do
    call follow_motions(began + dt, blocks)
    do b = 1, blocks%n   ! at which the free bodies end their motion
      blocks%speed(b) = 0.0_wp
      if (blocks%fixed(b) .or. blocks%asleep(b) .or. .not. blocks%present(b)) cycle
      blocks%speed(b) = fastest_point(blocks, b)
    end do
    blocks%contact_force = contacts%loads%impulse(:, 1:)/dt
    blocks%contact_torque = contacts%loads%twist(:, 1:)/dt
    if (contacts%sleep%active) call store_quiet(gravity, dt, blocks, contacts%sleep)
    call hold_sleepers(gravity, dt, blocks)
    call count_counterparts(contacts%met, blocks)
    if (contacts%by_impulses) then
      report%energy = energy_in_memory(contacts%displacements) &
        + energy_in_memory(contacts%sleep%rest)
    else
      call detect_contacts(walls, blocks, 0.0_wp, contacts%detected)
      report%energy = elastic_energy(contacts%detected, contacts%displacements, contacts%sleep%rest)
    end if
  end subroutine move_blocks

  !> Begin a substep: drift for half of it and find what touches then.
  !!
  !! The step is an equal part of the time left. Where the bodies come down on more contact points
  !! than the step is short enough for, now or before its end, they go back and take a shorter one.
  subroutine go_half_way(walls, left, limit, contacts, blocks, dt_b)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: left, limit   !! time left, longest substep allowed [s]
    type(contacts_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    real(wp), intent(out) :: dt_b         !! the substep [s]
    real(wp), parameter :: bearable = 1.3_wp   !! times the limit of stiffness: not worth going back
    real(wp) :: longest, allowed, time
    integer :: b

    time = blocks%time
    do b = 1, blocks%n
      if (.not. moves(b)) cycle
      contacts%start%x(:, b) = blocks%x(:, b)
      contacts%start%q(:, b) = blocks%q(:, b)
      contacts%start%l(:, b) = blocks%l(:, b)
      contacts%start%omega(:, b) = blocks%omega(:, b)
    end do
    longest = limit
    do
      dt_b = equal_substep(left, longest)
      call drift(0.5_wp*dt_b, blocks)
      call detect_contacts(walls, blocks, 0.5_wp*dt_b, contacts%detected)
      allowed = stiffness_limit(contacts%detected)
      if (.not. dt_b > bearable*min(allowed, longest)) exit
      do b = 1, blocks%n
        if (.not. moves(b)) cycle
        blocks%x(:, b) = contacts%start%x(:, b)
        blocks%q(:, b) = contacts%start%q(:, b)
        blocks%l(:, b) = contacts%start%l(:, b)
        blocks%omega(:, b) = contacts%start%omega(:, b)
      end do
      blocks%time = time
      longest = allowed
    end do
  contains
    pure logical function moves(b)
      integer, intent(in) :: b

      moves = blocks%present(b) .and. .not. blocks%asleep(b)
    end function moves
  end subroutine go_half_way

  !> The rest of a substep: contact and the other half of the drift.
  subroutine finish_substep(walls, gravity, dt_b, contacts, blocks, report)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: gravity(3), dt_b   !! [m/s2, s]
    type(contacts_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    type(contact_report_t), intent(inout) :: report
    real(wp), parameter :: none(3) = 0.0_wp
    integer :: k

    if (report%substeps == 0 .or. contacts%lubrication%active) call list_present(blocks, &
      contacts%detected%acting)
    associate (detected => contacts%detected, displacements => contacts%displacements, &
               loads => contacts%loads, held => contacts%held, &
               acting => contacts%detected%acting%body(:contacts%detected%acting%n))
      associate (point => detected%points%item(:detected%points%n))
        call store_counterparts(point%a, point%b, contacts%met)
      end associate
      call match_displacements(detected, contacts%before, displacements)
      call integrate_displacements(0.5_wp*dt_b, detected, displacements)
      do k = 1, size(acting)
        associate (b => acting(k))
          call kick_body(gravity, 0.5_wp*dt_b, contacts%steady(:, b), blocks%fluid_torque(:, b), &
                         b, blocks)
        end associate
      end do
      call update_motion(blocks, acting, detected%counterparts)
      call sum_forces(dt_b, detected, displacements, loads, report)
      if (contacts%lubrication%active) call lubricate(walls, blocks, dt_b, 0.0_wp, &
        contacts%lubrication, loads%force)
      if (contacts%sleep%active) call hold_or_wake(gravity, contacts, blocks)
      do k = 1, size(acting)
        associate (b => acting(k))
          loads%impulse(:, b) = loads%impulse(:, b) + dt_b*(loads%force(:, b) - held(1:3, b))
          loads%twist(:, b) = loads%twist(:, b) + dt_b*(loads%torque(:, b) - held(4:6, b))
          call kick_body(none, dt_b, contacts%share(b)*loads%force(:, b), loads%torque(:, b), b, &
                         blocks)
          call kick_body(gravity, 0.5_wp*dt_b, contacts%steady(:, b), blocks%fluid_torque(:, b), &
                         b, blocks)
          ! sleepers had the velocity of the middle of the substep, and have none at its end
          if (blocks%asleep(b)) call put_to_sleep(b, blocks)
        end associate
      end do
      call update_motion(blocks, acting, detected%counterparts)
      call integrate_displacements(0.5_wp*dt_b, detected, displacements)
    end associate
    call drift(0.5_wp*dt_b, blocks)
    if (contacts%sleep%active .and. any(contacts%woken)) call restore_contacts(blocks, contacts)
  end subroutine finish_substep

  !> Hold those asleep for the whole step: a substep adds by how much the force on them differs. All
  !! of them are tested in the first substep, those that something touches in the others.
  pure subroutine hold_for_step(gravity, dt, contacts, blocks)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: dt           !! fluid step [s]
    type(contacts_t), intent(inout) :: contacts
    type(blocks_t), intent(in) :: blocks
    integer :: b

    do b = 1, blocks%n
      contacts%held(:, b) = 0.0_wp
      if (.not. blocks%asleep(b)) cycle
      contacts%held(1:3, b) = -(contacts%steady(:, b) + blocks%mass(b)*gravity)
      contacts%held(4:6, b) = -blocks%fluid_torque(:, b)
      contacts%loads%impulse(:, b) = contacts%loads%impulse(:, b) + dt*contacts%held(1:3, b)
      contacts%loads%twist(:, b) = contacts%loads%twist(:, b) + dt*contacts%held(4:6, b)
    end do
  end subroutine hold_for_step

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

end module contacts_m
