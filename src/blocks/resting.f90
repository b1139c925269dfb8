!> Who falls asleep and who wakes, and what becomes of the displacements between them.
module resting_m
  use kinds_m, only: wp
  use rigid_body_m, only: blocks_t
  use walls_m, only: walls_t
  use displacements_m, only: move_displacements
  use sleep_m, only: update_loads, sum_memory, may_sleep, balanced, rest_tolerance, &
    wake_tolerance, put_to_sleep, wake, all_still
  use counterparts_m, only: counterparts_t
  use contact_solver_m, only: contact_solver_t, list_bodies, store_counterparts
  implicit none
  private
  public :: wake_or_sleep, hold_or_wake, restore_contacts

contains

  !> At the start of a step: wake those that the fluid has put out of balance where nothing moves
  !! (else they wake in the substeps), and let those sleep that are candidates and in balance.
  subroutine wake_or_sleep(walls, gravity, contacts, blocks)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    class(contact_solver_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    logical :: changed, candidate(blocks%n)
    integer :: b

    call update_loads(contacts%sleep)
    contacts%loads%force = 0.0_wp
    contacts%loads%torque = 0.0_wp
    if (all_still(blocks)) then
      call list_bodies(blocks%present, contacts%acting)
      call hold_or_wake(gravity, contacts, blocks, changed)
      if (changed) call restore_contacts(blocks, contacts)
    else
      candidate = [(may_sleep(gravity, b, blocks, contacts%sleep), b=1, blocks%n)]
      changed = any(candidate)
      if (changed) then
        call sum_memory(contacts%displacements, contacts%loads%force(:, 1:), &
          contacts%loads%torque(:, 1:))
        call let_sleep(gravity, candidate, contacts, blocks, changed)
      end if
      if (changed) then   ! contact points between what does not move join the frozen ones
        associate (memory => contacts%displacements)
          call move_displacements([(at_rest(blocks, memory%a(b), memory%b(b)), b=1, memory%n)], &
            memory, contacts%sleep%frozen)
        end associate
        call update_loads(contacts%sleep)
      end if
    end if
    if (changed) call contacts%detect(walls, blocks)
    associate (frozen => contacts%sleep%frozen)
      call store_counterparts(frozen%a(:frozen%n), frozen%b(:frozen%n), contacts%met)
    end associate
  end subroutine wake_or_sleep

  !> Complete the contact forces on the acting bodies by the frozen ones, and wake who is out of
  !! balance.
  !!
  !! Nothing at rest has moved, and in the middle of a substep sleepers have the velocity that the
  !! other forces give them, like all blocks: what wakes now moves as if it had been awake. Those
  !! who sleep on get the force and torque that hold them.
  subroutine hold_or_wake(gravity, contacts, blocks, woke)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    class(contact_solver_t), intent(inout) :: contacts   !! its loads
    type(blocks_t), intent(inout) :: blocks
    logical, intent(out) :: woke         !! somebody
    real(wp) :: other(3)
    integer :: k

    woke = .false.
    associate (acting => contacts%acting, loads => contacts%loads, &
               sleep => contacts%sleep)
      do k = 1, acting%n
        associate (b => acting%body(k))
          if (.not. blocks%still(b)) cycle
          loads%force(:, b) = loads%force(:, b) + sleep%load(:, b)
          loads%torque(:, b) = loads%torque(:, b) + sleep%load_torque(:, b)
          if (.not. blocks%asleep(b)) cycle
          other = contacts%steady(1:3, b) + blocks%mass(b)*gravity
          if (balanced(wake_tolerance, loads%force(:, b), loads%torque(:, b), other, &
                       contacts%steady(4:6, b), sleep%reach(b))) then
            loads%force(:, b) = -other
            loads%torque(:, b) = -contacts%steady(4:6, b)
          else
            call wake(b, blocks)
            woke = .true.
          end if
        end associate
      end do
    end associate
  end subroutine hold_or_wake

  !> Let candidates sleep that are supported, touch nothing that is moved at a given rate, and on
  !! which the forces balance if they do not move.
  !!
  !! Supported is what touches a wall, the bed, a body that is fixed or asleep, or others that are
  !! supported.
  subroutine let_sleep(gravity, candidate, contacts, blocks, changed)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    logical, intent(inout) :: candidate(:)   !! (n)
    class(contact_solver_t), intent(inout) :: contacts
    type(blocks_t), intent(inout) :: blocks
    logical, intent(out) :: changed      !! somebody fell asleep
    logical :: supported(blocks%n)
    integer :: g, b

    associate (displacements => contacts%displacements)
      do g = 1, displacements%n
        associate (a => displacements%a(g), c => displacements%b(g))
          if (is_carried(blocks, contacts%counterparts, c)) candidate(a) = .false.
          if (c < 1) cycle
          if (is_carried(blocks, contacts%counterparts, a)) candidate(c) = .false.
        end associate
      end do
      supported = blocks%fixed .or. blocks%asleep
      changed = .true.
      do while (changed)
        changed = .false.
        do g = 1, displacements%n
          associate (a => displacements%a(g), c => displacements%b(g))
            if (c < 1) then
              changed = changed .or. .not. supported(a)
              supported(a) = .true.
            else if (supported(a) .neqv. supported(c)) then
              changed = .true.
              supported([a, c]) = .true.
            end if
          end associate
        end do
      end do
    end associate
    associate (loads => contacts%loads)
      do b = 1, blocks%n
        if (.not. (candidate(b) .and. supported(b))) cycle
        if (.not. balanced(rest_tolerance, loads%force(:, b), loads%torque(:, b), &
                           contacts%steady(1:3, b) + blocks%mass(b)*gravity, &
                           contacts%steady(4:6, b), contacts%sleep%reach(b))) cycle
        ! should it wake before the step ends, contact has taken this
        loads%impulse(:, b) = loads%impulse(:, b) - blocks%mass(b)*blocks%v(:, b)
        loads%twist(:, b) = loads%twist(:, b) - blocks%l(:, b)
        call put_to_sleep(b, blocks)
        changed = .true.
      end do
    end associate
  end subroutine let_sleep

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

  !> Give the displacements of contact points with a body that moves now back to those at work.
  subroutine restore_contacts(blocks, contacts)
    type(blocks_t), intent(in) :: blocks
    class(contact_solver_t), intent(inout) :: contacts
    logical :: chosen(contacts%sleep%frozen%n)
    integer :: i

    associate (frozen => contacts%sleep%frozen)
      chosen = [(.not. at_rest(blocks, frozen%a(i), frozen%b(i)), i=1, frozen%n)]
      call move_displacements(chosen, frozen, contacts%displacements)
    end associate
    call update_loads(contacts%sleep)
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
