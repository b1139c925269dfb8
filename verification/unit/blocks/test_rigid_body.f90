!> Bodies of a case and their motion without contact.
module test_rigid_body_m
  use check_m, only: check, wp
  use tet_mesh_m, only: shape_t
  use rigid_body_m, only: blocks_t, release_body, drift, kick, &
    set_velocity_after_fluid, kinetic_energy, potential_energy
  use case_blocks_m, only: blocks_init
  use world_m, only: world_t, set_up
  implicit none
  private
  public :: test_rigid_body

  type(world_t), target :: world
  type(blocks_t), pointer :: blocks => world%blocks
  character(*), parameter :: brick = '&body shape="brick" position=.1,.2,.3 '

contains

  subroutine test_rigid_body()
    call check_start()
    call check_top_at_end()
    call check_free_fall()
    call check_survey()
    call check_after_fluid()
  end subroutine test_rigid_body

  !> Bricks with three different moments of inertia, and balls.
  subroutine start(bodies)
    character(*), intent(in) :: bodies

    call set_up('&run t_end=1 physics="dry"/ &grid cells=3*2 length=3*1/ &shape name="brick" ' &
      //'kind="box" size=.01,.02,.03/ &shape name="ball" kind="sphere" size=.02/ '//bodies, world)
  end subroutine start

  !> Order, masses, poses and presence of the bodies of a case.
  subroutine check_start()
    call start('&body shape="ball" position=3*.1 quaternion=-2,0,0,2 velocity=1,0,0/ &body ' &
      //'shape="brick" position=3*.2 release_time=.5 velocity=0,2,0 angular_velocity=3,0,0/ ' &
      //'&drop shape="brick" position=3*.3 count=3 first_time=1 interval=.25/')
    call check('five bodies', blocks%n, 5)
    call check('their shapes', all(blocks%shape == [2, 1, 1, 1, 1]))
    call check('one there', all(blocks%present .eqv. [.true., .false., .false., .false., .false.]))
    call check('due', blocks%release_time, [0.0_wp, 0.5_wp, 1.0_wp, 1.25_wp, 1.5_wp], 1.0e-15_wp)
    call check('mass of the brick', blocks%mass(2), 2300.0_wp*6.0e-6_wp, 1.0e-15_wp)
    call check('quaternion with w >= 0', &
      blocks%q(:, 1), sqrt([0.5_wp, 0.0_wp, 0.0_wp, 0.5_wp])*[1, 1, 1, -1], 1.0e-15_wp)
    call check('moves from the start', blocks%v(1, 1), 1.0_wp)
    call check('waits at rest', blocks%v(:, 2:), 0.0_wp)
    call check('energy before release', kinetic_energy(blocks), 0.5_wp*blocks%mass(1), 1.0e-15_wp)
    call release_body(0.6_wp, 2, blocks)
    call check('true time of release', blocks%release_time(2), 0.6_wp)
    call check('velocity at release', blocks%v(2, 2), 2.0_wp)
    call check('its momentum', blocks%l(1, 2), 3.0_wp*world%shapes(1)%inertia(1, 1), 1.0e-18_wp)
    call check('potential energy', potential_energy([0.0_wp, 0.0_wp, -10.0_wp], blocks), &
      10.0_wp*sum(blocks%mass*blocks%x(3, :)), 1.0e-15_wp)
  end subroutine check_start

  !> The top of the reference table D1_top_torque_free.csv at t = 3: moments 1, 2, 3 and
  !! omega = (1.7, 0, 1); second order in the step.
  subroutine check_top_at_end()
    real(wp), parameter :: t_end = 3.0_wp
    real(wp), parameter :: q_end(4) = [-0.622800788318_wp, -0.278080199769_wp, 0.328467519813_wp, &
      0.653375595653_wp]
    type(shape_t) :: top(1)
    type(blocks_t) :: bodies
    real(wp) :: error(2)
    integer :: n, m, steps

    call start(brick//'angular_velocity=1.7,0,1/')
    top = world%shapes(1:1)
    top(1)%inertia = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 2.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
      3.0_wp], [3, 3])
    do m = 1, 2
      steps = 200*m
      call blocks_init(world%case, top, bodies)
      do n = 1, steps
        call drift(t_end/real(steps, wp), bodies)
      end do
      error(m) = norm2(bodies%q(:, 1) - sign(1.0_wp, dot_product(bodies%q(:, 1), q_end))*q_end)
    end do
    call check('quaternion stays one', norm2(bodies%q(:, 1)), 1.0_wp, 1.0e-15_wp)
    call check('attitude of the top', error(2), 0.0_wp, 2.0e-4_wp)
    call check('second order', error(1)/error(2), 4.0_wp, 0.2_wp)
  end subroutine check_top_at_end

  !> Half drift, kick, half drift is exact for a constant force.
  subroutine check_free_fall()
    real(wp), parameter :: g(3) = [0.3_wp, 0.0_wp, -9.81_wp]
    real(wp) :: x(3), v(3), t
    integer :: n

    call start(brick//'velocity=.1,-.2,.3/')
    x = blocks%x(:, 1)
    v = blocks%v(:, 1)
    blocks%fluid_force(:, 1) = blocks%mass(1)*[0.0_wp, 1.0_wp, 0.0_wp]
    do n = 1, 7
      call drift(0.05_wp, blocks)
      call kick(g, 0.1_wp, blocks%fluid_force, blocks%fluid_torque, blocks)
      call drift(0.05_wp, blocks)
    end do
    t = 0.7_wp
    call check('free fall', &
      blocks%x(:, 1) - (x + t*v + 0.5_wp*t**2*(g + [0, 1, 0])), 0.0_wp, 1.0e-14_wp)
  end subroutine check_free_fall

  !> In coordinates of a survey a substep of a slow body is as long as their last digit.
  subroutine check_survey()
    integer :: n

    call start('&body shape="ball" position=512344,5621080,.1 velocity=1e-5,-3e-6,1e-6/ &body ' &
      //'shape="ball" position=512345,5621080,.1 velocity=1e-5,-3e-6,1e-6 fixed=t/')
    do n = 1, 10000
      call drift(1.0e-4_wp, blocks)
    end do
    do n = 1, 2
      call check('slow, far from zero', &
        blocks%x(:, n) - [512343.0_wp + n, 5621080.0_wp, 0.1_wp], blocks%v(:, n), 1.0e-9_wp)
    end do
  end subroutine check_survey

  !> M dU/dt = fluid + contact + M g and dL/dt = fluid + contact, from the start of the step.
  subroutine check_after_fluid()
    real(wp), parameter :: g(3) = [0.0_wp, 0.0_wp, -9.81_wp], dt = 0.01_wp
    real(wp) :: force(3, 1), torque(3, 1), v(3), l(3)

    call start(brick//'velocity=.1,-.2,.3 angular_velocity=5,2,1/')
    v = blocks%v(:, 1)
    l = blocks%l(:, 1)
    blocks%v_start = blocks%v
    blocks%l_start = blocks%l
    blocks%fluid_torque(:, 1) = [-1.0e-3_wp, 5.0e-3_wp, 0.0_wp]
    call kick(g, dt, blocks%fluid_force, blocks%fluid_torque, blocks)   ! what the substeps may do
    blocks%contact_force(:, 1) = [0.3_wp, 0.2_wp, 0.1_wp]
    blocks%contact_torque(:, 1) = [1.0e-3_wp, 2.0e-3_wp, 3.0e-3_wp]
    force(:, 1) = [-1.0_wp, 0.5_wp, 0.7_wp]
    torque(:, 1) = [2.0e-3_wp, 0.0_wp, -1.0e-3_wp]
    call set_velocity_after_fluid(g, dt, force, torque, blocks)
    call check('balance of momentum', blocks%mass(1)*((blocks%v(:, 1) - v)/dt - g) &
      - force(:, 1) - blocks%contact_force(:, 1), 0.0_wp, 1.0e-13_wp)
    call check('balance of angular momentum', &
      (blocks%l(:, 1) - l)/dt - torque(:, 1) - blocks%contact_torque(:, 1), 0.0_wp, 1.0e-16_wp)
    call check('fluid force is kept', blocks%fluid_force - force, 0.0_wp)
  end subroutine check_after_fluid

end module test_rigid_body_m
