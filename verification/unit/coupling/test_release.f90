!> Release of blocks: due or not, room or not, the time of the next one.
module test_release_m
  use check_m, only: check, wp
  use rigid_body_m, only: blocks_t
  use release_m, only: release_due_blocks, next_release, are_waiting
  use world_m, only: world_t, set_up
  implicit none
  private
  public :: test_release

  character(*), parameter :: head = '&run t_end=1 physics="dry"/ &grid cells=3*10 length=3*1/ ' &
    //'&shape name="cube" kind="cube" size=.1/ '
  type(world_t), target :: world
  logical :: released
  integer :: warnings

contains

  subroutine test_release()
    ! Block 1 is there from the start, 2 comes later beside it, 3 and 4 drop onto the place of 1.
    call set_up(head//'&body shape="cube" position=.5,.5,.5 velocity=0,.3,0/ &body shape="cube" ' &
      //'position=.7,.5,.5 velocity=0,0,-.2 angular_velocity=0,3,0 release_time=.25/ &drop ' &
      //'shape="cube" position=.5,.5,.58 count=2 first_time=0 interval=.75/', world)
    associate (blocks => world%blocks)
      call one_after_another(blocks)
    end associate
    call check_together()
  end subroutine test_release

  !> Who comes when.
  subroutine one_after_another(blocks)
    type(blocks_t), intent(inout) :: blocks

    warnings = 0
    call check('one at the start', all(blocks%present .eqv. [.true., .false., .false., .false.]))
    call check('next release', next_release(0.0_wp, blocks), 0.25_wp)

    call try(0.0_wp)
    call check('no room: not released', .not. (released .or. blocks%present(3)))
    call check('no room: it waits', count(are_waiting(0.1_wp, blocks)) == 1 .and. .not. &
      blocks%present(3))
    call check('due at the very end: not waiting', count(are_waiting(0.0_wp, blocks)), 0)
    call check('warned', warnings, 1)
    call try(0.1_wp)
    call check('warned once', warnings, 1)
    call check('not due', .not. blocks%present(2))
    call check('before its release: at rest', norm2(blocks%v(:, 2)), 0.0_wp)

    call try(0.25_wp - 1.0e-13_wp)
    call check('due to round-off', released .and. blocks%present(2))
    call check('its velocity', &
      [blocks%v(:, 2), blocks%omega(:, 2)], [0.0_wp, 0.0_wp, -0.2_wp, 0.0_wp, 3.0_wp, 0.0_wp])
    call check('its spin', blocks%l(2, 2), 3.0_wp*world%shapes(1)%inertia(2, 2), 1.0e-15_wp)
    call check('next release after that', next_release(0.25_wp, blocks), 0.75_wp)

    blocks%x(2, 1) = 0.58_wp
    call try(0.4_wp)
    call check('still no room', .not. blocks%present(3))
    blocks%x(2, 1) = 0.61_wp
    call try(0.5_wp)
    call check('room at last', released .and. blocks%present(3))
    call check('the true time is kept', blocks%release_time(3), 0.5_wp)
    call check('said once more', warnings, 2)
    call check('nobody waits', count(are_waiting(0.5_wp, blocks)), 0)

    call try(0.75_wp)
    call check('the next of the drop finds the one before', count(are_waiting(0.8_wp, blocks)), 1)
    blocks%x(3, 3) = 0.3_wp
    call try(0.8_wp)
    call check('all there', all(blocks%present))
    call check('no release to come', next_release(0.8_wp, blocks) > 1.0e300_wp)
    call try(0.9_wp)
    call check('nothing more to release', .not. released)
  end subroutine one_after_another

  !> A row of blocks is due at once: a long one, named first, lies across three others, of which the
  !! last two touch, or overlap by less than a release allows; two more exclude one another.
  subroutine check_together()
    type(world_t), target :: row
    logical :: gone(6)

    call set_up(head//'&shape name="long" kind="box" size=.6,.1,.1/ &drop shape="long" ' &
      //'position=.5,.45,.5 count=1 first_time=1/ '//cube('.3,.5,.5')//cube('.5,.5,.5') &
      //cube('.5991,.5,.5')//cube('.5,.8,.5')//cube('.59,.8,.5'), row)
    call release_due_blocks(row%walls, 1.0_wp, row%overlap, row%blocks, warnings, released)
    gone = [.false., .true., .true., .true., .true., .false.]
    call check('those that fit go together', all(row%blocks%present .eqv. gone))
    call check('the others wait', all(are_waiting(1.05_wp, row%blocks) .eqv. .not. gone))
    row%blocks%x(3, 2:4) = 0.2_wp
    call release_due_blocks(row%walls, 1.1_wp, row%overlap, row%blocks, warnings, released)
    call check('the long one after them', row%blocks%present(1) .and. .not. row%blocks%present(6))
  end subroutine check_together

  !> A cube that drops after a second.
  function cube(place) result(text)
    character(*), intent(in) :: place
    character(:), allocatable :: text

    text = '&drop shape="cube" count=1 first_time=1 position='//place//'/ '
  end function cube

  subroutine try(time)
    real(wp), intent(in) :: time   !! [s]

    call release_due_blocks(world%walls, time, world%overlap, world%blocks, warnings, released)
  end subroutine try

end module test_release_m
