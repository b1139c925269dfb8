!> Blocks in the flow: inertia turned into space, who is moved, and how far by a force.
module test_push_bodies_m
  use check_m, only: check, wp, pi
  use errors_m, only: to_text
  use vectors_m, only: quaternion_from_axis
  use rigid_motion_m, only: rigid_motion_t, rigid_motion_init
  use coupling_m, only: copy_motion, push_bodies
  use world_m, only: world_t, set_up, body
  implicit none
  private
  public :: test_push_bodies

  real(wp), parameter :: edge(3) = [0.1_wp, 0.2_wp, 0.3_wp]      !! of the box [m]
  real(wp), parameter :: mass = 2300*0.1_wp*0.2_wp*0.3_wp        !! [kg]
  real(wp), parameter :: j(3) = mass/12*[0.2_wp**2 + 0.3_wp**2, 0.3_wp**2 + 0.1_wp**2, &
    0.1_wp**2 + 0.2_wp**2]                                       !! of the box [kg m2]
  real(wp), parameter :: z(3) = [0.0_wp, 0.0_wp, 1.0_wp]
  type(rigid_motion_t) :: bodies

contains

  subroutine test_push_bodies()
    call make_blocks()
    call check_inertia()
    call check_who_moves()
    call check_push()
  end subroutine test_push_bodies

  !> Boxes: turned by an eighth about z, held, asleep, not there yet, turned by a quarter about x.
  subroutine make_blocks()
    type(world_t) :: world

    call set_up('&run t_end=1 physics="dry"/ &grid cells=3*2 length=3*3/ &shape name="box" ' &
      //'kind="box" size=.1,.2,.3/ '//box(1, quaternion_from_axis(z, 0.25_wp*pi)) &
      //box(2, more='fixed=T')//box(3)//box(4, more='release_time=1') &
      //box(5, quaternion_from_axis([1.0_wp, 0.0_wp, 0.0_wp], 0.5_wp*pi)), world)
    world%blocks%asleep(3) = .true.
    world%blocks%v(:, 4) = 7.0_wp   ! to no effect
    world%blocks%omega(:, 4) = 7.0_wp
    call rigid_motion_init(5, bodies)
    call copy_motion(world%blocks, bodies)
  end subroutine make_blocks

  !> Box b, as fast as its number.
  function box(b, q, more) result(text)
    integer, intent(in) :: b
    real(wp), intent(in), optional :: q(4)
    character(*), intent(in), optional :: more
    character(:), allocatable :: text

    text = 'angular_velocity='//to_text([4, 5, 6]*b)
    if (present(more)) text = text//' '//more
    text = body('box', spread(0.5_wp*b, 1, 3), real([1, 2, 3]*b, wp), q, text)
  end function box

  !> Half way between x and y both have the mean of the two, with half their difference between
  !! them; a quarter about x swaps y and z. The inverses belong to them.
  subroutine check_inertia()
    real(wp), parameter :: half = 0.5_wp*(j(1) + j(2)), rest = 0.5_wp*(j(1) - j(2)), &
      eye(9) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp]
    integer :: b

    call check('an eighth about z', [bodies%inertia(:, :, 1)], [half, rest, 0.0_wp, rest, half, &
      0.0_wp, 0.0_wp, 0.0_wp, j(3)], 1.0e-14_wp*j(1))
    call check('a quarter about x', [bodies%inertia(:, :, 5)], &
      [j(1), 0.0_wp, 0.0_wp, 0.0_wp, j(3), 0.0_wp, 0.0_wp, 0.0_wp, j(2)], 1.0e-14_wp*j(1))
    do b = 1, 5
      call check('the inverse is one', [matmul(bodies%inertia(:, :, b), &
        bodies%inverse_inertia(:, :, b))], eye, 1.0e-13_wp)
    end do
    call check('mass', bodies%mass, spread(mass, 1, 5), 1.0e-14_wp*mass)
    call check('volume', bodies%volume, spread(product(edge), 1, 5), 1.0e-16_wp)
  end subroutine check_inertia

  !> The fluid moves who is there, is not held and does not sleep; who is not there does not move.
  subroutine check_who_moves()
    call check('free', all(bodies%free .eqv. [.true., .false., .false., .false., .true.]))
    call check('present', all(bodies%present .eqv. [.true., .true., .true., .false., .true.]))
    call check('motion of one held', bodies%motion(:, 2), 2.0_wp*[1, 2, 3, 4, 5, 6])
    call check('no motion before its time', bodies%motion(:, 4), 0.0_wp)
    call check('place', bodies%x(:, 4), [2.0_wp, 2.0_wp, 2.0_wp])
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
    call check('the others stay', bodies%motion(:, 2:4) - before%motion(:, 2:4), 0.0_wp)
  end subroutine check_push

end module test_push_bodies_m
