!> What may touch, be it a body, a wall or the bed: how it moves, and what it sets against a force.
module counterparts_m
  use kinds_m, only: wp
  use vectors_m, only: cross, norm
  use rigid_body_m, only: blocks_t, space_tensor, let_go
  use walls_m, only: walls_t
  use bed_m, only: bed_counterpart
  implicit none
  private
  public :: counterparts_t, inertia_t, motion_t, wrench_t
  public :: counterparts_init, update_counterparts, update_motion, update_inertia
  public :: inertia_of, inverse_effective_mass, act
  public :: motion_between, relative_velocity, kind_of

  !> What may touch: bodies (1..n), walls (-6..-1) and the bed (`bed_counterpart`) alike.
  type :: counterparts_t
    real(wp) :: gravity = 0.0_wp                       !! [m/s2]
    real(wp), allocatable :: v(:, :), omega(:, :)      !! (3, counterparts) [m/s], [rad/s]
    real(wp) :: heaviest = 0.0_wp                      !! mass of the heaviest free body [kg]
    real(wp), allocatable :: inverse_mass(:)
      !! (counterparts) 0: walls, fixed bodies [1/kg]
    real(wp), allocatable :: inverse_inertia(:, :, :)  !! (3, 3, counterparts) likewise [1/(kg m2)]
  end type counterparts_t

  !> One of two counterparts that touch: what it sets against a force.
  type :: inertia_t
    real(wp) :: inverse_mass = 0.0_wp            !! [1/kg]
    real(wp) :: inverse_inertia(3, 3) = 0.0_wp   !! [1/(kg m2)]
  end type inertia_t

  !> How two counterparts move: b against a, and the turning of each.
  type :: motion_t
    real(wp) :: v(3) = 0.0_wp                              !! of the centres [m/s]
    real(wp) :: omega_a(3) = 0.0_wp, omega_b(3) = 0.0_wp   !! [rad/s]
  end type motion_t

  !> What a contact point does to its two counterparts.
  type :: wrench_t
    real(wp) :: force(3) = 0.0_wp                            !! on a; the opposite on b [N]
    real(wp) :: torque_a(3) = 0.0_wp, torque_b(3) = 0.0_wp   !! about their centres [N m]
  end type wrench_t

contains

  !> What a counterpart is: 1 a body, 2 a wall, 3 the bed.
  elemental integer function kind_of(b)
    integer, intent(in) :: b

    kind_of = merge(1, merge(3, 2, b == bed_counterpart), b > 0)
  end function kind_of

  !> Room for the walls and n bodies.
  pure subroutine counterparts_init(n, counterparts)
    integer, intent(in) :: n
    type(counterparts_t), intent(out) :: counterparts

    allocate (counterparts%v(3, bed_counterpart:n), counterparts%omega(3, bed_counterpart:n), &
      counterparts%inverse_mass(bed_counterpart:n), &
      counterparts%inverse_inertia(3, 3, bed_counterpart:n), source=0.0_wp)
  end subroutine counterparts_init

  !> Masses of all counterparts, their gravity and the velocity of the walls.
  pure subroutine update_counterparts(walls, gravity, blocks, counterparts)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    type(blocks_t), intent(in) :: blocks
    type(counterparts_t), intent(inout) :: counterparts
    integer :: w, b

    counterparts%gravity = norm(gravity)
    counterparts%heaviest = max(0.0_wp, maxval(blocks%mass, &
      .not. blocks%fixed .and. blocks%status <= let_go))   ! left out ones never touch
    do w = 1, walls%n
      counterparts%v(:, walls%number(w)) = walls%velocity(:, w)
    end do
    do b = 1, blocks%n
      counterparts%inverse_mass(b) = merge(0.0_wp, 1.0_wp/(blocks%mass(b) &
                                                       + blocks%added_mass(b)), blocks%fixed(b))
    end do
  end subroutine update_counterparts

  !> Velocities of some bodies as counterparts.
  pure subroutine update_motion(blocks, bodies, counterparts)
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: bodies(:)
    type(counterparts_t), intent(inout) :: counterparts
    integer :: k

    do k = 1, size(bodies)
      counterparts%v(:, bodies(k)) = blocks%v(:, bodies(k))
      counterparts%omega(:, bodies(k)) = blocks%omega(:, bodies(k))
    end do
  end subroutine update_motion

  !> Moments of inertia of those of some bodies that are free, at their present poses.
  pure subroutine update_inertia(blocks, bodies, counterparts)
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: bodies(:)
    type(counterparts_t), intent(inout) :: counterparts
    integer :: k

    do k = 1, size(bodies)
      associate (b => bodies(k))
        if (.not. blocks%fixed(b)) counterparts%inverse_inertia(:, :, b) = &
          space_tensor(blocks%q(:, b), blocks%inverse_inertia(:, :, b))
      end associate
    end do
  end subroutine update_inertia

  !> Inertia of a counterpart.
  pure function inertia_of(counterparts, b) result(inertia)
    type(counterparts_t), intent(in) :: counterparts
    integer, intent(in) :: b
    type(inertia_t) :: inertia

    inertia%inverse_mass = counterparts%inverse_mass(b)
    inertia%inverse_inertia = counterparts%inverse_inertia(:, :, b)
  end function inertia_of

  !> One over the mass a counterpart sets against a push along n at the given arm [1/kg].
  pure function inverse_effective_mass(of, arm, n) result(inverse)
    type(inertia_t), intent(in) :: of
    real(wp), intent(in) :: arm(3), n(3)
    real(wp) :: inverse
    real(wp) :: lever(3)

    inverse = of%inverse_mass
    if (inverse <= 0.0_wp) return
    lever = cross(arm, n)
    inverse = inverse + dot_product(lever, of%inverse_inertia(:, 1)*lever(1) &
      + of%inverse_inertia(:, 2)*lever(2) + of%inverse_inertia(:, 3)*lever(3))
  end function inverse_effective_mass

  !> Motion of counterpart b against body a.
  pure function motion_between(counterparts, a, b) result(motion)
    type(counterparts_t), intent(in) :: counterparts
    integer, intent(in) :: a, b
    type(motion_t) :: motion

    motion%v = counterparts%v(:, b) - counterparts%v(:, a)
    motion%omega_a = counterparts%omega(:, a)
    motion%omega_b = counterparts%omega(:, b)
  end function motion_between

  !> Velocity of counterpart b relative to body a at a contact: v_r, counterpart minus self [m/s].
  pure function relative_velocity(motion, arm_a, arm_b) result(v)
    type(motion_t), intent(in) :: motion
    real(wp), intent(in) :: arm_a(3), arm_b(3)   !! [m]
    real(wp) :: v(3)

    v = motion%v + (cross(motion%omega_b, arm_b) - cross(motion%omega_a, arm_a))
  end function relative_velocity

  !> Add a force on body a at a contact, and its reaction on counterpart b.
  pure subroutine act(f, arm_a, arm_b, wrench)
    real(wp), intent(in) :: f(3), arm_a(3), arm_b(3)   !! [N], [m]
    type(wrench_t), intent(inout) :: wrench

    wrench%force = wrench%force + f
    wrench%torque_a = wrench%torque_a + cross(arm_a, f)
    wrench%torque_b = wrench%torque_b - cross(arm_b, f)
  end subroutine act

end module counterparts_m
