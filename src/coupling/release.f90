!> Timed release of blocks into the tank.
!!
!! A block whose time has come appears at rest or with its given velocity if its place is free; the
!! liquid in its place comes back as an equal rise of the free surface in the same step. A block
!! whose place is taken waits and is tried at every step, or is raised above what lies there, or is
!! left out. A block whose height is not given is set on what lies there.
!!
!! A block that is lowered comes in the same way, but is held: it moves down at a constant speed
!! until it is let go at its place, at a height over what lies below, or where it touches that.
!! Where it touches something earlier, or its sling goes slack, it is let go too; or, set down, it
!! hangs in its sling from just above what lies there until that is slack (`sling_m`).
!!
!! A block that passes an open side is taken out.
module release_m
  use, intrinsic :: iso_fortran_env, only: error_unit
  use kinds_m, only: wp
  use vectors_m, only: norm
  use errors_m, only: to_text, brief
  use parallel_m, only: is_root
  use moments_m, only: has_come
  use grid_m, only: grid_t
  use rigid_body_m, only: blocks_t, release_body, body_text, own_mass, to_come, lowering, &
    let_go, left_out, out
  use walls_m, only: walls_t
  use overlap_m, only: overlap_t, has_place, exclude
  use sling_m, only: hang, hangs, let_off, slack_share, slows_at
  use ground_m, only: way_down, height_on_top, ground_gap, nothing_below
  implicit none
  private
  public :: release_due_blocks, let_go_lowered, next_release, are_waiting, nothing_to_come
  public :: take_out

contains

  !> Release every block that is due and finds room; a block that has to wait is warned of once.
  !!
  !! Of blocks that are due at the same time and whose places exclude one another those go that
  !! leave room to most others, so that many go together.
  subroutine release_due_blocks(walls, time, overlap, blocks, warnings, released)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: time   !! [s]
    type(overlap_t), intent(in) :: overlap
    type(blocks_t), intent(inout) :: blocks
    integer, intent(inout) :: warnings       !! counted up
    logical, intent(out) :: released         !! there was one
    integer, allocatable :: due(:)
    logical, allocatable :: free(:)
    logical, dimension(blocks%n) :: is_due, waiting   ! these were warned of
    real(wp) :: given(blocks%n), place   ! heights: of the case, and above what lies there [m]
    integer :: b, i

    released = .false.
    is_due = blocks%status == to_come .and. .not. blocks%present &
             .and. has_come(blocks%release_time, time)
    if (.not. any(is_due)) return
    due = pack([(b, b=1, blocks%n)], is_due)
    waiting = are_waiting(time, blocks)
    given = blocks%x(3, :blocks%n)
    allocate (free(size(due)))
    do i = 1, size(due)
      call check_place(walls, overlap, due(i), blocks, free(i))
    end do
    call order_due(walls, overlap, blocks, due, free)
    do i = 1, size(due)
      b = due(i)
      if (free(i) .and. released) call check_place(walls, overlap, b, blocks, free(i))
      if (.not. free(i) .and. blocks%handling(b)%if_blocked == 'raise') then
        place = blocks%x(3, b)   ! above all that lies there, if it has room
        blocks%x(3, b) = height_on_top(walls, blocks, b, overlap)
        free(i) = blocks%x(3, b) > place
        if (free(i)) free(i) = has_place(walls, blocks, b, overlap)
        if (free(i)) then
          blocks%raised(b) = blocks%x(3, b) - place
          call warn(time, b, 'was raised by '//brief(blocks%raised(b), 3) &
            //' m, its place is taken', blocks, warnings)
        end if
      end if
      if (.not. free(i)) blocks%x(3, b) = given(b)
      if (free(i)) then
        if (waiting(b)) call warn(time, b, 'found room and was released', blocks, warnings)
        call release_body(time, b, blocks)
        released = .true.
      else if (blocks%handling(b)%if_blocked == 'skip') then
        call warn(time, b, 'is left out, its place is taken', blocks, warnings)
        blocks%status(b) = left_out
      else if (.not. waiting(b)) then
        call warn(time, b, 'is due but its place is taken; it waits', blocks, warnings)
      end if
    end do
  end subroutine release_due_blocks

  !> Tell what became of a block.
  subroutine warn(time, b, what, blocks, warnings)
    real(wp), intent(in) :: time   !! [s]
    integer, intent(in) :: b
    character(*), intent(in) :: what
    type(blocks_t), intent(in) :: blocks
    integer, intent(inout) :: warnings

    warnings = warnings + 1
    if (.not. is_root()) return
    write (error_unit, '(7a)') 'mics: warning: ', body_text(b, blocks), ' ', what, ', t = ', &
      brief(time, 7), ' s'
    flush (error_unit)
  end subroutine warn

  !> Has a block room at its place? One without a given height is set on what lies there first.
  subroutine check_place(walls, overlap, b, blocks, free)
    type(walls_t), intent(in) :: walls
    type(overlap_t), intent(in) :: overlap
    integer, intent(in) :: b
    type(blocks_t), intent(inout) :: blocks
    logical, intent(out) :: free
    real(wp) :: height

    if (blocks%on_ground(b)) then
      height = height_on_top(walls, blocks, b, overlap)
      if (blocks%handling(b)%lowering_speed > 0.0_wp) then   ! it begins above all that stands there
        blocks%x(3, b) = max(blocks%x(3, b), height)
      else
        free = height > -nothing_below
        if (.not. free) return
        blocks%x(3, b) = height
      end if
    end if
    free = has_place(walls, blocks, b, overlap)
  end subroutine check_place

  !> Let go the lowered blocks that are where they should be, and find when the next of them will be
  !! if nothing changes.
  subroutine let_go_lowered(walls, gravity, time, dt, overlap, blocks, next, warnings)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: gravity(3)        !! [m/s2]
    real(wp), intent(in) :: time, dt          !! [s], of the longest step
    type(overlap_t), intent(in) :: overlap
    type(blocks_t), intent(inout) :: blocks
    real(wp), intent(out) :: next             !! huge if there is none [s]
    integer, intent(inout) :: warnings        !! counted up
    real(wp) :: left, way, gap, weight, carried   ! [m], [N]
    integer :: b

    next = huge(next)
    do b = 1, blocks%n
      if (blocks%status(b) /= lowering) cycle
      associate (handling => blocks%handling(b))
        weight = -own_mass(blocks, b)*gravity(3)
        carried = weight - blocks%fluid_force(3, b)
        if (hangs(b, blocks)) then
          call let_off(carried, time, b, blocks)
          cycle
        end if
        gap = ground_gap*blocks%shapes(blocks%shape(b))%smallest_edge
        if (handling%release == 'set_down') gap = max(handling%lowering_speed*dt, &
          slows_at*blocks%shapes(blocks%shape(b))%smallest_edge)
        way = way_down(walls, blocks, b, overlap)
        left = way
        if (handling%release == 'height') left = max(0.0_wp, way - handling%release_height)
        left = min(left, blocks%x(3, b) - blocks%goal(b))
        ! what it lies on carries it, all but a small share of its weight: the sling is slack
        carried = carried - blocks%contact_force(3, b)
        if (time > blocks%entry_time(b) .and. blocks%contact_force(3, b) > 0.0_wp &
            .and. carried < slack_share*weight) left = 0.0_wp
        if (left > gap) then
          if (left < nothing_below) next = min(next, &   ! the step ends within the gap
            time + (left - 0.9_wp*gap)/handling%lowering_speed)
          cycle
        end if
        if (handling%release == 'set_down') then
          call hang(b, blocks)
          cycle
        end if
        if (handling%release == 'place' .and. blocks%x(3, b) - blocks%goal(b) > gap &
            .and. .not. blocks%on_ground(b)) call warn(time, b, 'touches what lies below and was ' &
          //'let go '//brief(blocks%x(3, b) - blocks%goal(b), 3)//' m above its place', blocks, &
          warnings)
        call release_body(time, b, blocks)
      end associate
    end do
  end subroutine let_go_lowered

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

      yes = has_come(blocks%release_time(a), blocks%release_time(b)) &
        .and. has_come(blocks%release_time(b), blocks%release_time(a))
    end function same_moment
  end subroutine order_due

  !> Take the free and lowered blocks out whose centre of mass has passed an open side: they keep
  !! the place and the speed of then, displace nothing and touch nothing any more. The fluxes of the
  !! step bring fluid into the space that opens.
  subroutine take_out(grid, gravity, time, blocks)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: time         !! [s]
    type(blocks_t), intent(inout) :: blocks
    logical :: passed
    integer :: b, d

    do b = 1, blocks%n
      if (.not. blocks%present(b)) cycle
      if (blocks%fixed(b) .and. blocks%status(b) /= lowering) cycle
      passed = .false.
      do d = 1, 3
        associate (x => blocks%x(d, b) - grid%origin(d))
          passed = passed .or. (x < 0.0_wp .and. grid%is_exit(gravity, 1, d)) &
                   .or. (x > grid%length(d) .and. grid%is_exit(gravity, 2, d))
        end associate
      end do
      if (.not. passed) cycle
      blocks%status(b) = out
      blocks%exit_time(b) = time
      blocks%present(b) = .false.
      blocks%asleep(b) = .false.
      blocks%fluid_force(:, b) = 0.0_wp
      blocks%fluid_torque(:, b) = 0.0_wp
      blocks%lagged_force(:, b) = 0.0_wp
      blocks%film_force(:, b) = 0.0_wp
      blocks%sling(b) = 0.0_wp
      if (is_root()) write (error_unit, '(a)') 'mics: t = '//brief(time, 6)//' s: ' &
        //body_text(b, blocks)//' is out: it passed an open side at ('//to_text(blocks%x(:, b)) &
        //') m with '//brief(norm(blocks%v(:, b)))//' m/s'
    end do
  end subroutine take_out

  !> Time of the next release that is still to come; huge if there is none [s].
  pure function next_release(time, blocks) result(next)
    real(wp), intent(in) :: time   !! [s]
    type(blocks_t), intent(in) :: blocks
    real(wp) :: next

    next = huge(next)
    if (blocks%n == 0) return
    next = minval(blocks%release_time, mask=blocks%status == to_come .and. .not. blocks%present &
                  .and. .not. has_come(blocks%release_time, time))
  end function next_release

  !> Of which blocks the time came before this moment but the place was taken. One that is due at
  !! this very moment has not been tried.
  pure function are_waiting(time, blocks) result(yes)
    real(wp), intent(in) :: time   !! [s]
    type(blocks_t), intent(in) :: blocks
    logical :: yes(blocks%n)

    yes = blocks%status == to_come .and. .not. blocks%present &
          .and. .not. has_come(time, blocks%release_time)
  end function are_waiting

  !> Does nothing but the free blocks move from now on? Every block is let go, left out, or tried
  !! before this moment and without room (once all blocks rest nobody makes room any more), no fixed
  !! body moves, and no row of a motion is to come.
  pure function nothing_to_come(time, blocks) result(yes)
    real(wp), intent(in) :: time   !! [s]
    type(blocks_t), intent(in) :: blocks
    logical :: yes
    integer :: b

    yes = all(blocks%status >= let_go .or. are_waiting(time, blocks))
    do b = 1, blocks%n
      if (.not. blocks%fixed(b)) cycle
      associate (path => blocks%path(b))
        if (path%n > 0) then
          yes = yes .and. time >= path%time(path%n)
        else
          yes = yes .and. all(abs([blocks%v(:, b), blocks%omega(:, b)]) <= 0.0_wp)
        end if
      end associate
    end do
  end function nothing_to_come

end module release_m
