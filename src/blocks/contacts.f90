!> The motion of the blocks through a fluid step, in which they touch.
module contacts_m
  use kinds_m, only: wp
  use vectors_m, only: norms
  use rigid_body_m, only: blocks_t, hold_sleepers, look_ahead, follow_motions, &
    fastest_point
  use walls_m, only: walls_t, floor_wall
  use bed_m, only: bed_counterpart
  use sling_m, only: hangs, pull_sling
  use sleep_m, only: update_stillness, store_quiet, all_still
  use counterparts_m, only: update_counterparts
  use contact_solver_m, only: contact_solver_t, contact_report_t
  use resting_m, only: wake_or_sleep, restore_contacts
  implicit none
  private
  public :: contact_solver_t, move_blocks, contact_report_t

contains

  !> Move the blocks through one fluid step under gravity, the last fluid forces and contact.
  !!
  !! The mean contact forces and torques of the step are left in `blocks`, and v and l at its start
  !! in `v_start` and `l_start`.
  subroutine move_blocks(walls, gravity, dt, contacts, blocks, report)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: dt           !! fluid step [s]
    class(contact_solver_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    type(contact_report_t), intent(out) :: report
    real(wp) :: t_end

    t_end = blocks%time + dt
    call begin(walls, gravity, dt, contacts, blocks)
    call contacts%detect(walls, blocks)
    if (allocated(contacts%sleep%reach)) call wake_or_sleep(walls, gravity, contacts, blocks)
    if (all_still(blocks)) then
      contacts%loads%impulse(:, 1:) = dt*contacts%sleep%load
      contacts%loads%twist(:, 1:) = dt*contacts%sleep%load_torque
    else
      call contacts%advance(walls, gravity, dt, blocks, report)
      if (report%info > 0) return
    end if
    call follow_motions(t_end, blocks)
    call finish(gravity, dt, contacts, blocks)
    call contacts%detect(walls, blocks)
    report%energy = contacts%energy()
  end subroutine move_blocks

  !> What is the same all through the step: the forces besides contact, masses, which bodies move;
  !! no load yet.
  !!
  !! A body M carries fluid M_a along, so a new contact force F changes its velocity by
  !! F/(M + M_a); the rest of F reaches the fluid when the step ends. The fluid force of the step
  !! before holds that part of the contact force of then, which is made good: a force that lasts
  !! acts in full.
  subroutine begin(walls, gravity, dt, contacts, blocks)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: gravity(3), dt   !! [m/s2], fluid step [s]
    class(contact_solver_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    logical :: changed
    integer :: b

    blocks%v_start = blocks%v
    blocks%l_start = blocks%l
    call look_ahead(dt, blocks)
    associate (share => contacts%share)
      do b = 1, blocks%n
        share(b) = blocks%mass(b)/(blocks%mass(b) + blocks%added_mass(b))
        contacts%steady(1:3, b) = blocks%fluid_force(:, b) - blocks%film_force(1:3, b) &
          + (1.0_wp - share(b))*blocks%contact_force(:, b)
        if (hangs(b, blocks)) call pull_sling(-contacts%steady(3, b) - blocks%mass(b)*gravity(3), &
          dt, b, blocks)
        contacts%steady(4:6, b) = blocks%fluid_torque(:, b) - blocks%film_force(4:6, b)
      end do
    end associate
    contacts%loads%impulse = 0.0_wp
    contacts%loads%twist = 0.0_wp
    contacts%loads%twist(:, 1:) = blocks%l - blocks%l_start   ! by slings
    contacts%loads%peak = 0.0_wp
    contacts%met%n = 0
    call update_counterparts(walls, gravity, blocks, contacts%counterparts)
    if (.not. allocated(contacts%sleep%reach)) return
    contacts%sleep%x = blocks%x
    contacts%sleep%q = blocks%q
    call update_stillness(blocks, changed)
    if (changed) call restore_contacts(blocks, contacts)
  end subroutine begin

  !> What the step tells of each block: speed, mean contact force, time of rest, counterparts.
  subroutine finish(gravity, dt, contacts, blocks)
    real(wp), intent(in) :: gravity(3), dt   !! [m/s2], fluid step [s]
    class(contact_solver_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    integer :: b, m

    do b = 1, blocks%n   ! at which the free bodies end their motion
      blocks%speed(b) = 0.0_wp
      if (blocks%fixed(b) .or. blocks%asleep(b) .or. .not. blocks%present(b)) cycle
      blocks%speed(b) = fastest_point(blocks, b)
    end do
    blocks%contact_force = contacts%loads%impulse(:, 1:)/dt
    blocks%contact_torque = contacts%loads%twist(:, 1:)/dt
    if (allocated(contacts%sleep%reach)) call store_quiet(gravity, dt, blocks, contacts%sleep)
    call hold_sleepers(gravity, dt, blocks)
    associate (peak => contacts%loads%peak)
      where (blocks%asleep) peak = max(peak, norms(blocks%contact_force))
      blocks%record%peak = max(blocks%record%peak, peak)
    end associate
    blocks%contacts = 0
    blocks%on_floor = 0
    do m = 1, contacts%met%n
      associate (a => contacts%met%a(m), c => contacts%met%b(m))
        blocks%contacts(a) = blocks%contacts(a) + 1
        if (c > 0) blocks%contacts(c) = blocks%contacts(c) + 1
        if (c == floor_wall .or. c == bed_counterpart) blocks%on_floor(a) = 1
      end associate
    end do
  end subroutine finish

end module contacts_m
