!> Bodies of a case and their motion without contact.
module test_rigid_body_m
  use kinds_m, only: wp
  use check_m, only: check
  use case_types_m, only: case_t, body_input_t
  use tet_mesh_m, only: shape_t
  use shapes_builtin_m, only: make_shape
  use vectors_m, only: quaternion_exp, rotation_matrix
  use rigid_body_m, only: blocks_t, blocks_init, release_body, begin_step, drift, kick, &
    set_velocity_after_fluid, space_tensor, kinetic_energy, potential_energy
  implicit none
  private
  public :: test_rigid_body

  real(wp), parameter :: no_gravity(3) = 0.0_wp
  type(shape_t), allocatable :: shapes(:)

contains

  subroutine test_rigid_body()
    call make_shapes()
    call check_start()
    call check_free_top()
    call check_t_endop()
    call check_free_fall()
    call check_prescribed()
    call check_after_fluid()
  end subroutine test_rigid_body

  !> A box with three different moments of inertia, and a sphere.
  subroutine make_shapes()
    character(:), allocatable :: message
    type(case_t) :: case

    allocate (case%shape(2), shapes(2))
    case%shape%name = [character(8) :: 'brick', 'ball']
    case%shape%kind = [character(8) :: 'box', 'sphere']
    case%shape%refinement = 1
    case%shape(1)%size = [0.01_wp, 0.02_wp, 0.03_wp]
    case%shape(2)%size = 0.02_wp
    call make_shape(case%shape(1), shapes(1), message)
    call make_shape(case%shape(2), shapes(2), message)
  end subroutine make_shapes

  !> A case of one brick.
  subroutine one_brick(case)
    type(case_t), intent(out) :: case

    allocate (case%body(1), case%drop(0))
    case%body(1)%shape = 'brick'
    case%body(1)%position = [0.1_wp, 0.2_wp, 0.3_wp]
  end subroutine one_brick

  !> Order, masses, poses and presence of the bodies of a case.
  subroutine check_start()
    type(case_t) :: case
    type(blocks_t) :: blocks

    allocate (case%body(2), case%drop(1))
    case%body(1)%shape = 'ball'
    case%body(1)%position = 0.1_wp
    case%body(1)%quaternion = [-2.0_wp, 0.0_wp, 0.0_wp, 2.0_wp]
    case%body(1)%velocity = [1.0_wp, 0.0_wp, 0.0_wp]
    case%body(2)%shape = 'brick'
    case%body(2)%position = 0.2_wp
    case%body(2)%release_time = 0.5_wp
    case%body(2)%velocity = [0.0_wp, 2.0_wp, 0.0_wp]
    case%body(2)%angular_velocity = [3.0_wp, 0.0_wp, 0.0_wp]
    case%drop(1)%shape = 'brick'
    case%drop(1)%position = 0.3_wp
    case%drop(1)%count = 3
    case%drop(1)%first_time = 1.0_wp
    case%drop(1)%interval = 0.25_wp
    call blocks_init(case, shapes, blocks)
    call check('five bodies', blocks%n, 5)
    call check('their shapes', all(blocks%shape == [2, 1, 1, 1, 1]))
    call check('only the first is there', &
      all(blocks%present .eqv. [.true., .false., .false., .false., .false.]))
    call check('due times', maxval(abs(blocks%release_time &
      - [0.0_wp, 0.5_wp, 1.0_wp, 1.25_wp, 1.5_wp])), &
      0.0_wp, 1.0e-15_wp)
    call check('mass of the brick', blocks%mass(2), 2300.0_wp*6.0e-6_wp, 1.0e-15_wp)
    call check('quaternion with w >= 0', blocks%q(:, 1), &
      sqrt([0.5_wp, 0.0_wp, 0.0_wp, 0.5_wp])*[1, 1, 1, -1], &
      1.0e-15_wp)
    call check('moves from the start', blocks%v(1, 1), 1.0_wp, 0.0_wp)
    call check('waits at rest', maxval(abs(blocks%v(:, 2:))), 0.0_wp, 0.0_wp)
    call check('energy before release', kinetic_energy(blocks), 0.5_wp*blocks%mass(1), 1.0e-15_wp)
    call release_body(0.6_wp, 2, blocks)
    call check('true time of release', blocks%release_time(2), 0.6_wp, 0.0_wp)
    call check('velocity at release', blocks%v(2, 2), 2.0_wp, 0.0_wp)
    call check('momentum at release', blocks%l(1, 2), 3.0_wp*shapes(1)%inertia(1, 1), 1.0e-18_wp)
    call check('potential energy', potential_energy([0.0_wp, 0.0_wp, -10.0_wp], blocks), &
      10.0_wp*sum(blocks%mass*blocks%x(3, :)), 1.0e-15_wp)
  end subroutine check_start

  !> A torque-free top keeps its angular momentum exactly and its energy to second order.
  subroutine check_free_top()
    type(case_t) :: case
    type(blocks_t) :: blocks
    real(wp) :: l(3), energy, worst, time_step
    integer :: n

    call one_brick(case)
    case%body(1)%angular_velocity = [1.0_wp, 10.0_wp, 0.5_wp]   ! near the unstable middle axis
    call blocks_init(case, shapes, blocks)
    l = blocks%l(:, 1)
    energy = kinetic_energy(blocks)
    worst = 0.0_wp
    time_step = 2.0e-3_wp
    do n = 1, 10000
      call drift(0.5_wp*time_step, blocks)
      call kick(no_gravity, time_step, blocks%contact_force, blocks%contact_torque, blocks)
      call drift(0.5_wp*time_step, blocks)
      worst = max(worst, abs(kinetic_energy(blocks)/energy - 1.0_wp))
    end do
    call check('angular momentum', maxval(abs(blocks%l(:, 1) - l)), 0.0_wp, 1.0e-12_wp*norm2(l))
    call check('energy of the top', worst, 0.0_wp, 1.0e-4_wp)
    call check('quaternion stays one', norm2(blocks%q(:, 1)), 1.0_wp, 1.0e-15_wp)
    call check('omega belongs to l', maxval(abs(blocks%l(:, 1) - &
      matmul(space_tensor(blocks%q(:, 1), shapes(1)%inertia), blocks%omega(:, 1)))), 0.0_wp, &
      1.0e-12_wp*norm2(l))
  end subroutine check_free_top

  !> The top of the reference table D1_top_torque_free.csv at t = 3: moments 1, 2, 3 and
  !! omega = (1.7, 0, 1); second order in the step.
  subroutine check_t_endop()
    real(wp), parameter :: t_end = 3.0_wp
    real(wp), parameter :: q_end(4) = [-0.622800788318_wp, -0.278080199769_wp, 0.328467519813_wp, &
      0.653375595653_wp]
    type(shape_t) :: top(1)
    type(case_t) :: case
    type(blocks_t) :: blocks
    real(wp) :: error(2)
    integer :: n, m, steps

    top = shapes(1:1)
    top(1)%inertia = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 2.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
      3.0_wp], [3, 3])
    call one_brick(case)
    case%body(1)%angular_velocity = [1.7_wp, 0.0_wp, 1.0_wp]
    do m = 1, 2
      steps = 200*m
      call blocks_init(case, top, blocks)
      do n = 1, steps
        call drift(t_end/real(steps, wp), blocks)
      end do
      error(m) = norm2(blocks%q(:, 1) - sign(1.0_wp, dot_product(blocks%q(:, 1), q_end))*q_end)
    end do
    call check('attitude of the top', error(2), 0.0_wp, 2.0e-4_wp)
    call check('second order', error(1)/error(2), 4.0_wp, 0.2_wp)
  end subroutine check_t_endop

  !> Half drift, kick, half drift is exact for a constant force.
  subroutine check_free_fall()
    real(wp), parameter :: g(3) = [0.3_wp, 0.0_wp, -9.81_wp]
    type(case_t) :: case
    type(blocks_t) :: blocks
    real(wp) :: x(3), v(3), t
    integer :: n

    call one_brick(case)
    case%body(1)%velocity = [0.1_wp, -0.2_wp, 0.3_wp]
    call blocks_init(case, shapes, blocks)
    x = blocks%x(:, 1)
    v = blocks%v(:, 1)
    blocks%fluid_force(:, 1) = blocks%mass(1)*[0.0_wp, 1.0_wp, 0.0_wp]
    do n = 1, 7
      call drift(0.05_wp, blocks)
      call kick(g, 0.1_wp, blocks%fluid_force, blocks%fluid_torque, blocks)
      call drift(0.05_wp, blocks)
    end do
    t = 0.7_wp
    call check('free fall', maxval(abs(blocks%x(:, 1) - (x + t*v + 0.5_wp*t**2*(g + [0, 1, 0])))), &
      0.0_wp, 1.0e-14_wp)
  end subroutine check_free_fall

  !> A fixed body with given rates moves and turns at them whatever acts on it.
  subroutine check_prescribed()
    type(case_t) :: case
    type(blocks_t) :: blocks
    real(wp), parameter :: omega(3) = [0.0_wp, 0.5_wp, 2.0_wp]
    integer :: n

    call one_brick(case)
    case%body(1)%fixed = .true.
    case%body(1)%velocity = [0.0_wp, 0.0_wp, 0.4_wp]
    case%body(1)%angular_velocity = omega
    call blocks_init(case, shapes, blocks)
    blocks%contact_force = 1.0e3_wp
    blocks%contact_torque = 1.0e3_wp
    do n = 1, 10
      call kick([0.0_wp, 0.0_wp, -9.81_wp], 0.1_wp, blocks%contact_force, blocks%contact_torque, &
        blocks)
      call drift(0.1_wp, blocks)
    end do
    call check('given velocity', maxval(abs(blocks%x(:, 1) - [0.1_wp, 0.2_wp, 0.7_wp])), 0.0_wp, &
      1.0e-15_wp)
    call check('given rotation', maxval(abs(rotation_matrix(blocks%q(:, 1)) &
      - rotation_matrix(quaternion_exp(omega)))), &
      0.0_wp, 1.0e-14_wp)
    call check('rate unchanged', maxval(abs(blocks%omega(:, 1) - omega)), 0.0_wp, 0.0_wp)
  end subroutine check_prescribed

  !> After the fluid: M dU/dt = fluid + contact + M g and dL/dt = fluid + contact, from the start of
  !! the step.
  subroutine check_after_fluid()
    real(wp), parameter :: g(3) = [0.0_wp, 0.0_wp, -9.81_wp], dt = 0.01_wp
    type(case_t) :: case
    type(blocks_t) :: blocks
    real(wp) :: force(3, 1), torque(3, 1), v(3), l(3)

    call one_brick(case)
    case%body(1)%velocity = [0.1_wp, -0.2_wp, 0.3_wp]
    case%body(1)%angular_velocity = [5.0_wp, 2.0_wp, 1.0_wp]
    call blocks_init(case, shapes, blocks)
    v = blocks%v(:, 1)
    l = blocks%l(:, 1)
    call begin_step(blocks)
    blocks%fluid_torque(:, 1) = [-1.0e-3_wp, 5.0e-3_wp, 0.0_wp]
    call kick(g, dt, blocks%fluid_force, blocks%fluid_torque, blocks)   ! what the substeps may do
    blocks%contact_force(:, 1) = [0.3_wp, 0.2_wp, 0.1_wp]
    blocks%contact_torque(:, 1) = [1.0e-3_wp, 2.0e-3_wp, 3.0e-3_wp]
    force(:, 1) = [-1.0_wp, 0.5_wp, 0.7_wp]
    torque(:, 1) = [2.0e-3_wp, 0.0_wp, -1.0e-3_wp]
    call set_velocity_after_fluid(g, dt, force, torque, blocks)
    call check('balance of momentum', maxval(abs(blocks%mass(1)*((blocks%v(:, 1) - v)/dt - g) &
      - force(:, 1) - blocks%contact_force(:, 1))), 0.0_wp, 1.0e-13_wp)
    call check('balance of angular momentum', maxval(abs((blocks%l(:, 1) - l)/dt &
      - torque(:, 1) - blocks%contact_torque(:, 1))), 0.0_wp, 1.0e-16_wp)
    call check('fluid force is kept', maxval(abs(blocks%fluid_force - force)), 0.0_wp, 0.0_wp)
  end subroutine check_after_fluid

end module test_rigid_body_m
