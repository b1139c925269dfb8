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
  use overlap_m, only: overlap_t, room_for, exclude
  implicit none
  private
  public :: release_due_blocks, next_release, n_waiting, none_to_come

  real(wp), parameter :: same_time = 1.0e-12_wp   !! times this close are one [s]

contains

  !> Release every block that is due and finds room; a block that has to wait is warned of once.
  !!
  !! Of blocks that are due at the same time and whose places exclude one another those go that
  !! leave room to most others, so that many go together.
  subroutine release_due_blocks(walls, time, overlap, blocks, waiting, warnings, released)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: time   !! [s]
    type(overlap_t), intent(in) :: overlap
    type(blocks_t), intent(inout) :: blocks
    logical, intent(inout) :: waiting(:)     !! blocks warned of
    integer, intent(inout) :: warnings       !! counted up
    logical, intent(out) :: released         !! there was one
    integer, allocatable :: due(:)
    logical, allocatable :: free(:)
    integer :: b, i

    released = .false.
    if (blocks%n == 0) return
    if (.not. any(is_due(time, blocks))) return
    due = pack([(b, b=1, blocks%n)], is_due(time, blocks))
    free = [(room_for(walls, blocks, due(i), overlap), i=1, size(due))]
    call order_due(walls, overlap, blocks, due, free)
    do i = 1, size(due)
      b = due(i)
      if (free(i) .and. released) free(i) = room_for(walls, blocks, b, overlap)
      if (free(i)) then
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

  !> Which blocks are due and not there yet.
  pure function is_due(time, blocks) result(due)
    real(wp), intent(in) :: time   !! [s]
    type(blocks_t), intent(in) :: blocks
    logical :: due(blocks%n)

    due = .not. (blocks%present .or. blocks%release_time > time + same_time)
  end function is_due

  !> Put due blocks into the order in which they are tried: as they are numbered, but of those that
  !! became due at the same time first those whose places exclude fewest of the others. What finds
  !! no room beside the blocks that are there excludes nobody.
  subroutine order_due(walls, overlap, blocks, due, free)
    type(walls_t), intent(in) :: walls
    type(overlap_t), intent(in) :: overlap
    type(blocks_t), intent(in) :: blocks
    integer, intent(inout) :: due(:)
    logical, intent(inout) :: free(:)   !! (due) there is room beside the blocks that are there
    integer, parameter :: max_compared = 100   ! of each block, with those next to it in the list
    integer :: conflicts(size(due)), i, j, place

    conflicts = 0
    do i = 1, size(due)
      if (.not. free(i)) cycle
      do j = max(1, i - max_compared), i - 1
        if (.not. (free(j) .and. same_moment(due(i), due(j)))) cycle
        if (.not. exclude(walls, blocks, due(i), due(j), overlap)) cycle
        conflicts([i, j]) = conflicts([i, j]) + 1
      end do
    end do
    do i = 2, size(due)   ! by insertion, which leaves equal ones as they are
      place = i
      do j = i - 1, 1, -1
        if (.not. same_moment(due(place), due(j))) cycle
        if (conflicts(j) <= conflicts(place)) exit
        due([j, place]) = due([place, j])
        free([j, place]) = free([place, j])
        conflicts([j, place]) = conflicts([place, j])
        place = j
      end do
    end do
  contains
    pure function same_moment(a, b) result(yes)
      integer, intent(in) :: a, b
      logical :: yes

      yes = abs(blocks%release_time(a) - blocks%release_time(b)) <= same_time
    end function same_moment
  end subroutine order_due

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
