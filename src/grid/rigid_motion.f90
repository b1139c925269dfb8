!> What the flow has to know about the motion of the bodies: positions, velocities, inertia.
!!
!! Data only: `coupling/` copies it from the blocks and carries the result back.
module rigid_motion_m
  use kinds_m, only: wp
  use vectors_m, only: cross
  implicit none
  private
  public :: rigid_motion_t, rigid_motion_init, set_inertia, wall_velocity, inverse_of

  real(wp), parameter :: largest_defect = 0.5_wp   !! of the inertia that may be taken off [-]

  type :: rigid_motion_t
    integer :: n = 0   !! bodies, and the bed if there is one: at rest, not free, not `present`
    logical, allocatable :: present(:)         !! (n) in the fluid
    logical, allocatable :: free(:)            !! (n) moved by the fluid
    logical, allocatable :: clipped(:)         !! (n) `defect` was cut at its limit
    real(wp), allocatable :: x(:, :)           !! (3, n) centre of mass [m]
    real(wp), allocatable :: motion(:, :)      !! (6, n) velocity and angular velocity [m/s, rad/s]
    real(wp), allocatable :: mass(:)           !! (n) [kg]
    real(wp), allocatable :: inertia(:, :, :)  !! (3, 3, n) space frame [kg m2]
    real(wp), allocatable :: inverse_inertia(:, :, :)   !! (3, 3, n) [1/(kg m2)]
    real(wp), allocatable :: volume(:)         !! (n) [m3]
    real(wp), allocatable :: radius(:)         !! (n) of the ball around `x` that holds it [m]
    real(wp), allocatable :: defect(:, :, :)
      !! (6, 6, n) of what a body displaces, the inertia that the faces of the grid do not count
    real(wp), allocatable :: apparent(:, :, :)
      !! (6, 6, n) inertia with which the forces at the faces move a body: its own less `defect`
    real(wp), allocatable :: mobility(:, :, :) !! (6, 6, n) inverse of `apparent`
  end type rigid_motion_t

contains

  !> Room for n bodies.
  subroutine rigid_motion_init(n, bodies)
    integer, intent(in) :: n
    type(rigid_motion_t), intent(out) :: bodies

    bodies%n = n
    allocate (bodies%present(n), bodies%free(n), bodies%clipped(n), source=.false.)
    allocate (bodies%x(3, n), bodies%motion(6, n), bodies%mass(n), bodies%volume(n), &
              bodies%radius(n))
    allocate (bodies%inertia(3, 3, n), bodies%inverse_inertia(3, 3, n))
    bodies%x = 0.0_wp
    bodies%motion = 0.0_wp
    bodies%mass = 1.0_wp   ! of the bed, which never moves
    bodies%volume = 1.0_wp
    bodies%radius = 1.0_wp
    bodies%inertia = 0.0_wp
    bodies%inverse_inertia = 0.0_wp
    allocate (bodies%defect(6, 6, n), bodies%apparent(6, 6, n), bodies%mobility(6, 6, n), &
              source=0.0_wp)
  end subroutine rigid_motion_init

  !> Inertia of body b and its inverse, with a part taken off if it is given; no more of it than
  !! leaves the rest positive, `clipped` whether that cut it.
  pure subroutine set_inertia(b, bodies, defect)
    integer, intent(in) :: b
    type(rigid_motion_t), intent(inout) :: bodies
    real(wp), intent(in), optional :: defect(6, 6)
    real(wp) :: part(6, 6), share, coupling
    integer :: d

    bodies%defect(:, :, b) = 0.0_wp
    bodies%apparent(:, :, b) = 0.0_wp
    bodies%mobility(:, :, b) = 0.0_wp
    do d = 1, 3
      bodies%apparent(d, d, b) = bodies%mass(b)
      bodies%mobility(d, d, b) = 1.0_wp/bodies%mass(b)
    end do
    bodies%apparent(4:6, 4:6, b) = bodies%inertia(:, :, b)
    bodies%mobility(4:6, 4:6, b) = bodies%inverse_inertia(:, :, b)
    if (.not. present(defect)) return
    part = defect
    bodies%clipped(b) = .false.
    do d = 1, 3
      share = sqrt(largest_defect/max(largest_defect, part(d, d)/bodies%mass(b)))
      bodies%clipped(b) = bodies%clipped(b) .or. share < 1.0_wp
      part(d, :) = share*part(d, :)
      part(:, d) = share*part(:, d)
    end do
    coupling = sqrt(sum(part(4:6, 1:3)*matmul(bodies%inverse_inertia(:, :, b), part(4:6, 1:3))) &
                    /bodies%mass(b))
    share = largest_defect/max(largest_defect, coupling)
    bodies%clipped(b) = bodies%clipped(b) .or. share < 1.0_wp
    part(4:6, 1:3) = share*part(4:6, 1:3)
    part(1:3, 4:6) = share*part(1:3, 4:6)
    bodies%defect(:, :, b) = part
    bodies%apparent(:, :, b) = bodies%apparent(:, :, b) - bodies%defect(:, :, b)
    bodies%mobility(:, :, b) = inverse_of(bodies%apparent(:, :, b))
  end subroutine set_inertia

  !> Inverse of a symmetric positive matrix, by Gauss-Jordan elimination.
  pure function inverse_of(matrix) result(a)
    real(wp), intent(in) :: matrix(:, :)
    real(wp) :: a(size(matrix, 1), size(matrix, 1))
    real(wp) :: pivot, row(size(matrix, 1))
    integer :: i, p

    a = matrix
    do p = 1, size(a, 1)
      pivot = a(p, p)
      a(p, p) = 1.0_wp
      a(p, :) = a(p, :)/pivot
      row = a(p, :)
      do i = 1, size(a, 1)
        if (i == p) cycle
        pivot = a(i, p)
        a(i, p) = 0.0_wp
        a(i, :) = a(i, :) - pivot*row
      end do
    end do
  end function inverse_of

  !> Velocity of a point at `arm` from the centre of mass [m/s].
  pure function wall_velocity(motion, arm) result(u)
    real(wp), intent(in) :: motion(6)   !! velocity and angular velocity
    real(wp), intent(in) :: arm(3)      !! [m]
    real(wp) :: u(3)

    u = motion(1:3) + cross(motion(4:6), arm)
  end function wall_velocity

end module rigid_motion_m
