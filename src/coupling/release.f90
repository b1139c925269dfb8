!> Timed release of blocks into the tank.
!!
!! A block whose time has come appears at rest or with its given velocity if its place is free; the
!! liquid in its place comes back as an equal rise of the free surface in the same step. A block
!! whose place is taken waits and is tried at every step.
module release_m
  use, intrinsic :: iso_fortran_env, only: error_unit
  use kinds_m, only: wp
  use errors_m, only: to_text
  use parallel_m, only: is_root
  use rigid_body_m, only: blocks_t, release_body
  use walls_m, only: walls_t
  use overlap_m, only: overlap_t, room_for
  implicit none
  private
  public :: release_due_blocks, next_release, n_waiting, none_to_come

  real(wp), parameter :: same_time = 1.0e-12_wp   !! times this close are one [s]

contains

  !> Release every block that is due and finds room; a block that has to wait is warned of once.
  subroutine release_due_blocks(walls, time, overlap, blocks, waiting, warnings, released)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: time   !! [s]
    type(overlap_t), intent(in) :: overlap
    type(blocks_t), intent(inout) :: blocks
    logical, intent(inout) :: waiting(:)     !! blocks warned of
    integer, intent(inout) :: warnings       !! counted up
    logical, intent(out) :: released         !! there was one
    integer :: b

    released = .false.
    do b = 1, blocks%n
      if (blocks%present(b) .or. blocks%release_time(b) > time + same_time) cycle
      if (room_for(walls, blocks, b, overlap)) then
        if (waiting(b)) call warn(b, ' found room and was released at t = ')
        call release_body(time, b, blocks)
        released = .true.
      else if (.not. waiting(b)) then
        call warn(b, ' is due but its place is taken; it waits, t = ')
        waiting(b) = .true.
      end if
    end do
  contains
    subroutine warn(b, what)
      integer, intent(in) :: b
      character(*), intent(in) :: what

      warnings = warnings + 1
      if (.not. is_root()) return
      write (error_unit, '(5a)') 'mics: warning: body ', to_text(b), what, to_text(time), ' s'
      flush (error_unit)
    end subroutine warn
  end subroutine release_due_blocks

  !> Time of the next release that is still to come; huge if there is none [s].
  pure function next_release(time, blocks) result(next)
    real(wp), intent(in) :: time   !! [s]
    type(blocks_t), intent(in) :: blocks
    real(wp) :: next

    next = huge(next)
    if (blocks%n == 0) return
    next = minval(blocks%release_time, mask=.not. blocks%present &
                  .and. blocks%release_time > time + same_time)
  end function next_release

  !> Number of blocks whose time came before this moment but whose place was taken; one that is due
  !! at this very moment has not been tried.
  pure function n_waiting(time, blocks) result(n)
    real(wp), intent(in) :: time   !! [s]
    type(blocks_t), intent(in) :: blocks
    integer :: n

    n = 0
    if (blocks%n > 0) n = count(.not. blocks%present .and. blocks%release_time < time - same_time)
  end function n_waiting

  !> Is every block in the tank, or tried before this moment and without room? Once all blocks rest
  !! nobody makes room any more.
  pure function none_to_come(time, blocks) result(yes)
    real(wp), intent(in) :: time   !! [s]
    type(blocks_t), intent(in) :: blocks
    logical :: yes

    yes = count(.not. blocks%present) == n_waiting(time, blocks)
  end function none_to_come

end module release_m
