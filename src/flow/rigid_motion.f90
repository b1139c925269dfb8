!> What the flow has to know about the motion of the bodies: positions, velocities, inertia.
!!
!! Data only: `coupling/` copies it from the blocks and carries the result back.
module rigid_motion_m
  use kinds_m, only: wp
  use vectors_m, only: cross
  implicit none
  private
  public :: rigid_motion_t, rigid_motion_init, wall_velocity

  type :: rigid_motion_t
    integer :: n = 0   !! bodies, and the bed if there is one: at rest, not free, not `present`
    logical, allocatable :: present(:)         !! (n) in the fluid
    logical, allocatable :: free(:)            !! (n) moved by the fluid
    real(wp), allocatable :: x(:, :)           !! (3, n) centre of mass [m]
    real(wp), allocatable :: motion(:, :)      !! (6, n) velocity and angular velocity [m/s, rad/s]
    real(wp), allocatable :: mass(:)           !! (n) [kg]
    real(wp), allocatable :: inertia(:, :, :)  !! (3, 3, n) space frame [kg m2]
    real(wp), allocatable :: inverse_inertia(:, :, :)   !! (3, 3, n) [1/(kg m2)]
    real(wp), allocatable :: volume(:)         !! (n) [m3]
  end type rigid_motion_t

contains

  !> Room for n bodies.
  subroutine rigid_motion_init(n, bodies)
    integer, intent(in) :: n
    type(rigid_motion_t), intent(out) :: bodies

    bodies%n = n
    allocate (bodies%present(n), bodies%free(n), source=.false.)
    allocate (bodies%x(3, n), bodies%motion(6, n), bodies%mass(n), bodies%volume(n))
    allocate (bodies%inertia(3, 3, n), bodies%inverse_inertia(3, 3, n))
    bodies%x = 0.0_wp
    bodies%motion = 0.0_wp
    bodies%mass = 1.0_wp   ! of the bed, which never moves
    bodies%volume = 1.0_wp
    bodies%inertia = 0.0_wp
    bodies%inverse_inertia = 0.0_wp
  end subroutine rigid_motion_init

  !> Velocity of a point at `arm` from the centre of mass [m/s].
  pure function wall_velocity(motion, arm) result(u)
    real(wp), intent(in) :: motion(6)   !! velocity and angular velocity
    real(wp), intent(in) :: arm(3)      !! [m]
    real(wp) :: u(3)

    u = motion(1:3) + cross(motion(4:6), arm)
  end function wall_velocity

end module rigid_motion_m
