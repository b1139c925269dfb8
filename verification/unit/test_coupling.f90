!> One monolithic step of a free block in liquid: momentum, divergence, added mass.
program test_coupling
  use kinds_m, only: wp
  use vectors_m, only: quaternion_from_axis
  use rigid_body_m, only: begin_step, set_velocity_after_fluid
  use monolithic_m, only: monolithic_stage, start_flow
  use velocity_stage_m, only: stage_t, stage_report_t, stage_init, copy_motion
  use coupling_m, only: advance_velocity
  use boundary_m, only: fill_velocity_halo
  use one_body_m, only: one_body_t, describe, place
  use check_m, only: check, finish_checks
  implicit none
  character(8), parameter :: tank(2, 3) = reshape([character(8) :: &
    'slip', 'slip', 'slip', 'slip', 'slip', 'open'], [2, 3])
  real(wp), parameter :: dt = 1.0e-3_wp, g = 9.81_wp
  type(one_body_t) :: block
  type(stage_t) :: stage
  type(stage_report_t) :: report

  call released_sphere(2.3_wp)
  call released_sphere(1.1_wp)
  call moving_box()
  call held_box()
  call block_of_water()
  call finish_checks()

contains

  !> A block in the middle of a tank full of liquid that is at rest, pressure in balance.
  subroutine build(cells, kind, size, density)
    integer, intent(in) :: cells
    character(*), intent(in) :: kind
    real(wp), intent(in) :: size(3), density

    block = one_body_t()
    stage = stage_t()
    call describe(spread(cells, 1, 3), spread(0.01_wp*cells, 1, 3), tank, kind, size, &
                  spread(0.005_wp*cells, 1, 3) + [0.0013_wp, -0.0007_wp, 0.0021_wp], block%case)
    block%case%run%dt = dt
    block%case%fluid%single_phase = .true.
    block%case%fluid%liquid_density = 1000.0_wp
    block%case%shape(1)%density = density
    block%case%body(1)%quaternion = quaternion_from_axis([1.0_wp, -0.3_wp, 0.5_wp], 0.7_wp)
    block%case%numerics%divergence_tolerance = 1.0e-8_wp
  end subroutine build

  subroutine ready()
    call place(block)
    call stage_init(block%grid, 1, block%case%numerics, stage)
    call copy_motion(block%blocks, stage%bodies)
    call start_flow(block%case, block%grid, block%solid, block%flow, stage, report)
    call fill_velocity_halo(block%grid, block%flow%u)
  end subroutine ready

  !> A sphere let go falls by a/g = (s - 1)/(s + Ca) with Ca = 1/2, a few per cent more in a tank of
  !! 16/5 diameters.
  subroutine released_sphere(s)
    real(wp), intent(in) :: s   !! density ratio
    real(wp) :: a(3), force(3)

    call build(16, 'sphere', [0.05_wp, 0.0_wp, 0.0_wp], 1000.0_wp*s)
    call ready()
    call begin_step(block%blocks)
    call advance_velocity(block%case, block%grid, block%solid, dt, block%flow, block%blocks, &
                          stage, report)
    a = block%blocks%v(:, 1)/dt
    force = block%blocks%fluid_force(:, 1) - block%blocks%mass(1)*[0.0_wp, 0.0_wp, g]
    call check('sphere: converged', report%pressure%converged .and. report%viscous_converged)
    call check('sphere: divergence', report%pressure%divergence < 1.0e-8_wp)
    call check('sphere: M a is fluid force and weight', force, block%blocks%mass(1)*a, &
               1.0e-13_wp*block%blocks%mass(1)*g)
    call check('sphere: acceleration', -a(3)/g, (s - 1.0_wp)/(s + 0.5_wp), &
               0.02_wp*(s - 1.0_wp)/(s + 0.5_wp))
    print '(a, 2f8.4)', 'sphere: a/g and without walls ', -a(3)/g, (s - 1.0_wp)/(s + 0.5_wp)
    call check('sphere: hardly sideways', norm2(a(1:2)) < 2.0e-3_wp*g)
  end subroutine released_sphere

  !> A box that moves and spins: the motion found with the pressure is that of the forces.
  subroutine moving_box()
    real(wp) :: motion(6), gain(6), arm(3)

    call build(12, 'box', [0.043_wp, 0.031_wp, 0.037_wp], 1700.0_wp)
    block%case%body(1)%velocity = [0.3_wp, -0.2_wp, 0.1_wp]
    block%case%body(1)%angular_velocity = [2.0_wp, 1.0_wp, -3.0_wp]
    call ready()
    call begin_step(block%blocks)
    stage%total = 0.0_wp
    call set_velocity_after_fluid(block%case%fluid%gravity, dt, stage%total(1:3, :), &
                                  stage%total(4:6, :), block%blocks)
    call copy_motion(block%blocks, stage%bodies)
    motion = stage%bodies%motion(:, 1)
    call monolithic_stage(block%case, block%grid, block%solid, dt, block%flow, stage, report)
    gain(1:3) = block%blocks%mass(1)*(stage%bodies%motion(1:3, 1) - motion(1:3))
    gain(4:6) = matmul(stage%bodies%inertia(:, :, 1), stage%bodies%motion(4:6, 1) - motion(4:6))
    call check('box: converged', report%pressure%converged .and. report%viscous_converged)
    call check('box: divergence', report%pressure%divergence < 1.0e-8_wp)
    ! To the tolerance of the viscous solver.
    call check('box: momentum by the solve is that of the force', gain(1:3), &
               dt*stage%total(1:3, 1), 1.0e-9_wp*norm2(gain(1:3)))
    call check('box: spin by the solve is that of the torque', gain(4:6), dt*stage%total(4:6, 1), &
               1.0e-7_wp*norm2(gain(4:6)))
    call check('box: torque acts', norm2(gain(4:6)) > 1.0e-8_wp)
    arm = block%grid%centre(6, [1, 2, 3]) - block%blocks%x(:, 1)
    call check('box: closed cells move with it', block%flow%u(6, 6, 6, 1), &
               stage%bodies%motion(1, 1) + stage%bodies%motion(5, 1)*arm(3) &
               - stage%bodies%motion(6, 1)*arm(2), 1.0e-14_wp)
  end subroutine moving_box

  !> Around a held box still water stays still, and carries it by Archimedes' force.
  subroutine held_box()
    real(wp) :: weight

    call build(12, 'box', [0.043_wp, 0.031_wp, 0.037_wp], 1700.0_wp)
    block%case%body(1)%fixed = .true.
    call ready()
    call begin_step(block%blocks)
    call advance_velocity(block%case, block%grid, block%solid, dt, block%flow, block%blocks, &
                          stage, report)
    weight = 1000.0_wp*g*product([0.043_wp, 0.031_wp, 0.037_wp])
    call check('held box: buoyancy', block%blocks%fluid_force(:, 1), [0.0_wp, 0.0_wp, weight], &
               1.0e-6_wp*weight)
    call check('held box: no torque', norm2(block%blocks%fluid_torque(:, 1)), 0.0_wp, &
               1.0e-6_wp*weight*0.04_wp)
    call check('held box: still', maxval(abs(block%flow%u(1:12, 1:12, 1:12, :))), 0.0_wp, &
               1.0e-8_wp)
    call check('held box: it does not move', maxval(abs(block%blocks%v)), 0.0_wp, 0.0_wp)
  end subroutine held_box

  !> A block as heavy as the liquid hovers.
  subroutine block_of_water()
    call build(12, 'hexapod', [0.02_wp, 0.0_wp, 0.0_wp], 1000.0_wp)
    call ready()
    call begin_step(block%blocks)
    call advance_velocity(block%case, block%grid, block%solid, dt, block%flow, block%blocks, &
                          stage, report)
    call check('block of water: hovers', maxval(abs(block%blocks%v)), 0.0_wp, 1.0e-8_wp)
    call check('block of water: does not turn', maxval(abs(block%blocks%omega)), 0.0_wp, 1.0e-7_wp)
  end subroutine block_of_water

end program test_coupling
