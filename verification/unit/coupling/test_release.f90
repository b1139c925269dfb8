!> Release of blocks: due or not, room or not, the time of the next one.
module test_release_m
  use kinds_m, only: wp
  use case_types_m, only: case_t
  use tet_mesh_m, only: shape_t
  use shapes_builtin_m, only: make_shape
  use rigid_body_m, only: blocks_t, blocks_init
  use walls_m, only: walls_t, walls_init
  use overlap_m, only: overlap_t, overlap_init
  use release_m, only: release_due_blocks, next_release, n_pending
  use check_m, only: check
  implicit none
  private
  public :: test_release

  type(case_t) :: case
  type(shape_t) :: shapes(1)
  type(blocks_t) :: blocks
  type(walls_t) :: walls
  type(overlap_t) :: overlap
  character(:), allocatable :: message
  logical :: pending(4), released
  integer :: warnings

contains

  subroutine test_release()
    ! Block 1 is there from the start, 2 comes later beside it, 3 and 4 drop onto the place of 1.
    case%grid%cells = 10
    case%grid%length = 1.0_wp
    allocate (case%shape(1), case%body(2), case%drop(1))
    case%shape(1)%name = 'cube'
    case%shape(1)%kind = 'cube'
    case%shape(1)%size = 0.1_wp
    case%body%shape = 'cube'
    case%body(1)%position = [0.5_wp, 0.5_wp, 0.5_wp]
    case%body(1)%velocity = [0.0_wp, 0.3_wp, 0.0_wp]
    case%body(2)%position = [0.7_wp, 0.5_wp, 0.5_wp]
    case%body(2)%velocity = [0.0_wp, 0.0_wp, -0.2_wp]
    case%body(2)%angular_velocity = [0.0_wp, 3.0_wp, 0.0_wp]
    case%body(2)%release_time = 0.25_wp
    case%drop(1)%shape = 'cube'
    case%drop(1)%position = [0.5_wp, 0.5_wp, 0.58_wp]
    case%drop(1)%count = 2
    case%drop(1)%first_time = 0.0_wp
    case%drop(1)%interval = 0.75_wp
    call make_shape(case%shape(1), shapes(1), message)
    call walls_init(case%grid, case%boundary, walls)
    call blocks_init(case, shapes, blocks)
    call overlap_init(blocks%shapes, blocks%n, overlap)
    pending = .false.
    warnings = 0
    call check('one block at the start', all(blocks%present .eqv. [.true., .false., .false., &
                                                                   .false.]))
    call check('next release', next_release(0.0_wp, blocks), 0.25_wp, 0.0_wp)

    call try(0.0_wp)
    call check('no room: not released', .not. (released .or. blocks%present(3)))
    call check('no room: it waits', pending(3) .and. n_pending(0.1_wp, blocks) == 1)
    call check('due at the very end: not waiting', n_pending(0.0_wp, blocks), 0)
    call check('warned', warnings, 1)
    call try(0.1_wp)
    call check('warned once', warnings, 1)
    call check('not due', .not. blocks%present(2))
    call check('before its release: at rest', norm2(blocks%v(:, 2)), 0.0_wp, 0.0_wp)

    call try(0.25_wp - 1.0e-13_wp)
    call check('due to round-off', released .and. blocks%present(2))
    call check('its velocity', [blocks%v(:, 2), blocks%omega(:, 2)], &
               [0.0_wp, 0.0_wp, -0.2_wp, 0.0_wp, 3.0_wp, 0.0_wp], 0.0_wp)
    call check('its spin', blocks%l(2, 2), 3.0_wp*shapes(1)%inertia(2, 2), 1.0e-15_wp)
    call check('next release after that', next_release(0.25_wp, blocks), 0.75_wp, 0.0_wp)

    blocks%x(2, 1) = 0.58_wp
    call try(0.4_wp)
    call check('still no room', .not. blocks%present(3))
    blocks%x(2, 1) = 0.61_wp
    call try(0.5_wp)
    call check('room at last', released .and. blocks%present(3))
    call check('the true time is kept', blocks%release_time(3), 0.5_wp, 0.0_wp)
    call check('said once more', warnings, 2)
    call check('nobody waits', n_pending(0.5_wp, blocks), 0)

    call try(0.75_wp)
    call check('the next of the drop finds the one before', n_pending(0.8_wp, blocks), 1)
    blocks%x(3, 3) = 0.3_wp
    call try(0.8_wp)
    call check('all there', all(blocks%present))
    call check('no release to come', next_release(0.8_wp, blocks) > 1.0e300_wp)
    call try(0.9_wp)
    call check('nothing more to release', .not. released)
    call check_together()
  end subroutine test_release

  !> A row of blocks is due at once: a long one, named first, lies across three others, of which the
  !! last two touch, or overlap by less than a release allows; two more exclude one another.
  subroutine check_together()
    type(case_t) :: row
    type(shape_t) :: two(2)
    logical :: gone(6), waits(6)
    integer :: k

    allocate (row%shape(2), row%body(0), row%drop(6))
    row%shape%name = [character(4) :: 'cube', 'long']
    row%shape%kind = [character(4) :: 'cube', 'box']
    row%shape(1)%size = 0.1_wp
    row%shape(2)%size = [0.6_wp, 0.1_wp, 0.1_wp]
    do k = 1, 2
      call make_shape(row%shape(k), two(k), message)
    end do
    row%drop%shape = [character(4) :: 'long', 'cube', 'cube', 'cube', 'cube', 'cube']
    row%drop(1)%position = [0.5_wp, 0.45_wp, 0.5_wp]
    row%drop(2)%position = [0.3_wp, 0.5_wp, 0.5_wp]
    row%drop(3)%position = [0.5_wp, 0.5_wp, 0.5_wp]
    row%drop(4)%position = [0.5991_wp, 0.5_wp, 0.5_wp]
    row%drop(5)%position = [0.5_wp, 0.8_wp, 0.5_wp]
    row%drop(6)%position = [0.59_wp, 0.8_wp, 0.5_wp]
    row%drop%first_time = 1.0_wp
    call blocks_init(row, two, blocks)
    call overlap_init(blocks%shapes, blocks%n, overlap)
    waits = .false.
    call release_due_blocks(walls, 1.0_wp, overlap, blocks, waits, warnings, released)
    gone = [.false., .true., .true., .true., .true., .false.]
    call check('those that fit go together', all(blocks%present .eqv. gone))
    call check('the others wait', all(waits .eqv. .not. gone))
    blocks%x(3, 2:4) = 0.2_wp
    call release_due_blocks(walls, 1.1_wp, overlap, blocks, waits, warnings, released)
    call check('the long one when they have left', blocks%present(1) .and. .not. blocks%present(6))
  end subroutine check_together

  subroutine try(time)
    real(wp), intent(in) :: time   !! [s]

    call release_due_blocks(walls, time, overlap, blocks, pending, warnings, released)
  end subroutine try

end module test_release_m
