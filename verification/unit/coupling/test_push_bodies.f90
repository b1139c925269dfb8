!> What the flow knows of the blocks: inertia turned into space, who is moved, and how far a force
!! moves them.
module test_push_bodies_m
  use kinds_m, only: wp, pi
  use check_m, only: check
  use case_types_m, only: case_t
  use vectors_m, only: quaternion_from_axis
  use tet_mesh_m, only: shape_t
  use shapes_builtin_m, only: make_shape
  use rigid_body_m, only: blocks_t, blocks_init
  use rigid_motion_m, only: rigid_motion_t, rigid_motion_init
  use coupling_m, only: copy_motion, push_bodies
  implicit none
  private
  public :: test_push_bodies

  real(wp), parameter :: edge(3) = [0.1_wp, 0.2_wp, 0.3_wp]      !! of the box [m]
  real(wp), parameter :: mass = 2300*0.1_wp*0.2_wp*0.3_wp        !! [kg]
  real(wp), parameter :: j(3) = mass/12*[0.2_wp**2 + 0.3_wp**2, 0.3_wp**2 + 0.1_wp**2, &
    0.1_wp**2 + 0.2_wp**2]                                       !! of the box [kg m2]
  real(wp), parameter :: z(3) = [0.0_wp, 0.0_wp, 1.0_wp]
  type(blocks_t) :: blocks
  type(rigid_motion_t) :: bodies

contains

  subroutine test_push_bodies()
    call make_blocks()
    call copy_motion(blocks, bodies)
    call check_inertia()
    call check_who_moves()
    call check_push()
  end subroutine test_push_bodies

  !> Boxes: one turned by an eighth about z, one held, one asleep, one not there yet, one by a
  !! quarter about x.
  subroutine make_blocks()
    character(:), allocatable :: message
    type(case_t) :: case
    type(shape_t) :: shapes(1)
    integer :: b

    allocate (case%shape(1), case%body(5), case%drop(0))
    case%shape%name = 'box'
    case%shape%kind = 'box'
    case%shape(1)%size = edge
    call make_shape(case%shape(1), shapes(1), message)
    do b = 1, 5
      case%body(b)%shape = 'box'
      case%body(b)%position = 0.5_wp*b
      case%body(b)%velocity = [1, 2, 3]*b
      case%body(b)%angular_velocity = [4, 5, 6]*b
    end do
    case%body(1)%quaternion = quaternion_from_axis(z, 0.25_wp*pi)
    case%body(2)%fixed = .true.
    case%body(4)%release_time = 1.0_wp
    case%body(5)%quaternion = quaternion_from_axis([1.0_wp, 0.0_wp, 0.0_wp], 0.5_wp*pi)
    call blocks_init(case, shapes, blocks)
    blocks%asleep(3) = .true.
    blocks%v(:, 4) = 7.0_wp   ! to no effect
    blocks%omega(:, 4) = 7.0_wp
    call rigid_motion_init(5, bodies)
  end subroutine make_blocks

  !> Half way between x and y both have the mean of the two, with half their difference between
  !! them; a quarter about x swaps y and z. The inverses belong to them.
  subroutine check_inertia()
    real(wp) :: want(3, 3)
    integer :: b

    want = 0.0_wp
    want(1, 1) = 0.5_wp*(j(1) + j(2))
    want(2, 2) = want(1, 1)
    want(1, 2) = 0.5_wp*(j(1) - j(2))
    want(2, 1) = want(1, 2)
    want(3, 3) = j(3)
    call check('an eighth about z', reshape(bodies%inertia(:, :, 1), [9]), reshape(want, [9]), &
      1.0e-14_wp*j(1))
    want = 0.0_wp
    want(1, 1) = j(1)
    want(2, 2) = j(3)
    want(3, 3) = j(2)
    call check('a quarter about x', reshape(bodies%inertia(:, :, 5), [9]), reshape(want, [9]), &
      1.0e-14_wp*j(1))
    want = 0.0_wp
    do b = 1, 3
      want(b, b) = 1.0_wp
    end do
    do b = 1, 5
      call check('the inverse is one', reshape(matmul(bodies%inertia(:, :, b), &
        bodies%inverse_inertia(:, :, b)), [9]), reshape(want, [9]), 1.0e-13_wp)
    end do
    call check('mass', bodies%mass, spread(mass, 1, 5), 1.0e-14_wp*mass)
    call check('volume', bodies%volume, spread(product(edge), 1, 5), 1.0e-16_wp)
  end subroutine check_inertia

  !> The fluid moves who is there, is not held and does not sleep; who is not there does not move.
  subroutine check_who_moves()
    call check('free', all(bodies%free .eqv. [.true., .false., .false., .false., .true.]))
    call check('present', all(bodies%present .eqv. [.true., .true., .true., .false., .true.]))
    call check('motion of one held', bodies%motion(:, 2), 2.0_wp*[1, 2, 3, 4, 5, 6], 0.0_wp)
    call check('no motion before its time', maxval(abs(bodies%motion(:, 4))), 0.0_wp, 0.0_wp)
    call check('place', bodies%x(:, 4), [2.0_wp, 2.0_wp, 2.0_wp], 0.0_wp)
  end subroutine check_who_moves

  !> A force over a time changes the momentum, a torque the angular momentum, of the free ones only.
  subroutine check_push()
    real(wp), parameter :: dt = 0.1_wp
    type(rigid_motion_t) :: before
    real(wp) :: force(6, 5), change(6)
    integer :: b

    before = bodies
    do b = 1, 5
      force(:, b) = [3.0_wp, -1.0_wp, 2.0_wp, 0.5_wp, -0.7_wp, 0.9_wp]*b
    end do
    call push_bodies(dt, force, bodies)
    do b = 1, 5, 4
      change = bodies%motion(:, b) - before%motion(:, b)
      call check('momentum', mass*change(1:3), dt*force(1:3, b), 1.0e-13_wp)
      call check('angular momentum', matmul(bodies%inertia(:, :, b), change(4:6)), &
        dt*force(4:6, b), 1.0e-13_wp)
    end do
    call check('the others stay', maxval(abs(bodies%motion(:, 2:4) - before%motion(:, 2:4))), &
      0.0_wp, 0.0_wp)
  end subroutine check_push

end module test_push_bodies_m
