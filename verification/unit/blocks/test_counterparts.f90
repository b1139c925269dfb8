!> Two counterparts that touch: how they move against one another, and what a force does to both.
module test_counterparts_m
  use check_m, only: check, wp
  use vectors_m, only: cross
  use counterparts_m, only: inertia_t, motion_t, wrench_t, inverse_effective_mass, act, &
    relative_velocity
  use two_cubes_m, only: vector
  implicit none
  private
  public :: test_counterparts

contains

  subroutine test_counterparts()
    call check_motion()
    call check_inertia()
    call check_reaction()
  end subroutine test_counterparts

  !> The velocity of b against a at a contact.
  subroutine check_motion()
    type(motion_t) :: motion
    real(wp) :: v(3)

    motion%v = [1.0_wp, 0.0_wp, 0.0_wp]
    motion%omega_a = [0.0_wp, 0.0_wp, 2.0_wp]
    motion%omega_b = [0.0_wp, 3.0_wp, 0.0_wp]
    v = relative_velocity(motion, [1.0_wp, 0.0_wp, 0.0_wp], [0.0_wp, 0.0_wp, 1.0_wp])
    call check('both spins count', v, [4.0_wp, -2.0_wp, 0.0_wp], 1.0e-15_wp)
  end subroutine check_motion

  !> A ball of mass 2 and moment of inertia 1/2, pushed through its centre and beside it.
  subroutine check_inertia()
    type(inertia_t) :: ball, wall
    real(wp), parameter :: x(3) = [1.0_wp, 0.0_wp, 0.0_wp], z(3) = [0.0_wp, 0.0_wp, 1.0_wp]
    integer :: d

    ball%inverse_mass = 0.5_wp
    do d = 1, 3
      ball%inverse_inertia(d, d) = 2.0_wp
    end do
    call check('through the centre', inverse_effective_mass(ball, 3*z, z), 0.5_wp)
    call check('beside it', inverse_effective_mass(ball, 3*x, z), 18.5_wp, 1.0e-14_wp)
    call check('a wall gives nothing way', inverse_effective_mass(wall, 3*x, z), 0.0_wp)
  end subroutine check_inertia

  !> A force and its reaction leave momentum and angular momentum of both together as they are.
  subroutine check_reaction()
    type(wrench_t) :: wrench
    real(wp) :: x_a(3), x_b(3), place(3), f(3), twist(3)
    integer :: i

    x_a = vector(1, 6)
    x_b = vector(2, 6)
    twist = 0.0_wp
    do i = 1, 5
      place = vector(i, 7)
      f = vector(i, 8)
      call act(f, place - x_a, place - x_b, wrench)
    end do
    twist = cross(x_a, wrench%force) + wrench%torque_a - cross(x_b, wrench%force) + wrench%torque_b
    call check('forces add up', wrench%force, sum(reshape([(vector(i, 8), i=1, 5)], [3, 5]), 2), &
      1.0e-14_wp)
    call check('no twist together', twist, [0.0_wp, 0.0_wp, 0.0_wp], 1.0e-14_wp)
  end subroutine check_reaction

end module test_counterparts_m
