!> State of the blocks and their equations of motion; the only place that moves them.
!!
!! $$ M \frac{dU}{dt} = F_{fluid} + F_{contact} + M g, \qquad
!!    \frac{dL}{dt} = T_{fluid} + T_{contact} $$
!!
!! The state is (x, q, v, l) with l the angular momentum in space axes, so that a free body keeps l
!! exactly and no gyroscopic term appears. A substep drifts for half its time, kicks, and drifts
!! again.
module rigid_body_m
  use kinds_m, only: wp, name_length
  use case_types_m, only: handling_t
  use vectors_m, only: norm, rotation_matrix, quaternion_exp, quaternion_product, normalised
  use tet_mesh_m, only: shape_t
  use given_motion_m, only: given_motion_t, pose_at, fastest_between
  implicit none
  private
  public :: blocks_t, record_t, release_body, body_text
  public :: to_come, lowering, let_go, left_out, out
  public :: drift, drift_body, angular_velocity, kick, kick_body, place_body
  public :: hold_sleepers, set_velocity_after_fluid
  public :: space_tensor, own_mass, kinetic_energy, potential_energy, fastest_point
  public :: follow_motions, look_ahead, change_by_motion, haste, are_driven

  !> Status of a block: not there yet (its time may have come), held and lowered, released, left
  !! out for good because its place was taken, or out of the tank through an open side.
  integer, parameter :: to_come = 0, lowering = 1, let_go = 2, left_out = 3, out = 4

  !> Given rates: (3, n) velocity [m/s], and spin, space frame [rad/s].
  type :: given_t
    real(wp), allocatable :: v(:, :), omega(:, :)
  end type given_t

  !> What the results keep of the blocks between rows (`block_record_m`).
  type :: record_t
    real(wp), allocatable :: hardest(:)        !! (n) largest contact force since the last row [N]
    real(wp), allocatable :: peak(:)           !! (n) the same within a step [N]
    real(wp), allocatable :: impact_speed(:)   !! (n) before the first touch, 0: none yet [m/s]
    real(wp), allocatable :: rest_since(:)     !! (n) [s], 0: it moves
    real(wp), allocatable :: approach(:, :)
      !! (3, n) way in this part of it [m], largest speed in it and in the one before [m/s]
  end type record_t

  !> All bodies of a run, in the order of the contract: `&body`, then `&drop`.
  type :: blocks_t
    integer :: n = 0
    type(shape_t), allocatable :: shapes(:)
    integer, allocatable :: shape(:)             !! (n) index into shapes
    !> Mass (n) [kg] and inverse inertia (3, 3, n), body axes [1/(kg m2)]; in 'light' with the water
    !! that the body carries (`light_m`).
    real(wp), allocatable :: mass(:), inverse_inertia(:, :, :)
    real(wp), allocatable :: added_mass(:)       !! (n) fluid that moves along in an impact [kg]
    logical, allocatable :: fixed(:)             !! (n) held, or moved at its constant given rate
    logical, allocatable :: present(:)
      !! (n) released or being lowered: displaces fluid, touches, moves
    integer, allocatable :: status(:)            !! (n) see `to_come`
    logical, allocatable :: asleep(:)            !! (n) at rest until woken (`sleep_m`)
    logical, allocatable :: still(:)             !! (n) asleep, or held at rest for ever
    real(wp), allocatable :: release_time(:)     !! (n) due, then true time of release [s]
    real(wp), allocatable :: entry_time(:)       !! (n) likewise of coming into the tank [s]
    real(wp), allocatable :: exit_time(:)        !! (n) when it was found out, 0: never [s]
    real(wp), allocatable :: raised(:)           !! (n) above its place when that was taken [m]
    real(wp), allocatable :: planned(:, :)       !! (2, n) x, y without the random shift [m]
    character(name_length), allocatable :: name(:)   !! (n) of the unit in a plan; '': none
    type(handling_t), allocatable :: handling(:)     !! (n) by the crane
    logical, allocatable :: on_ground(:)         !! (n) its height is found at the release
    real(wp), allocatable :: goal(:)             !! (n) height to which it is lowered at most [m]
    real(wp), allocatable :: sling(:)            !! (n) force of a sling on what hangs in it [N]
    real(wp), allocatable :: upright(:, :)       !! (3, n) body axis that pointed up then [-]
    type(given_t) :: given                       !! at release; of fixed bodies for ever
    type(given_motion_t), allocatable :: path(:) !! (n) that moves a fixed body; 0 rows: none
    real(wp) :: time = 0.0_wp                    !! at which the bodies are where they are [s]
    real(wp), allocatable :: ahead(:, :)         !! (2, n) bounds of speed and spin on a path in the
                                                 !! coming step [m/s], [rad/s]
    real(wp), allocatable :: x(:, :)             !! (3, n) centre of mass, never wrapped [m]
    real(wp), allocatable :: lost(:, :)          !! (3, n) of its way, by rounding so far [m]
    real(wp), allocatable :: q(:, :)             !! (4, n) attitude w, x, y, z [-]
    real(wp), allocatable :: v(:, :)             !! (3, n) velocity [m/s]
    real(wp), allocatable :: l(:, :)             !! (3, n) angular momentum, space frame [kg m2/s]
    real(wp), allocatable :: omega(:, :)         !! (3, n) angular velocity, space frame [rad/s]
    real(wp), allocatable :: speed(:)
      !! (n) of the fastest point of a free body at the end of its motion, 0 of others; rest is
      !! judged by it, for `v` has a push of the fluid that contact has still to answer [m/s]
    !> (3, n) v and l at the start of the fluid step.
    real(wp), allocatable :: v_start(:, :), l_start(:, :)
    !> Means over the last fluid step, space frame, torques about the centre of mass [N], [N m].
    real(wp), allocatable :: fluid_force(:, :), fluid_torque(:, :)
    real(wp), allocatable :: lagged_force(:, :), film_force(:, :)
      !! (6, n) force and torque of the fluid: what the next step adds (`wall_balance_m`), and what
      !! of this one does not last, of films (`pressure_extension_m`) [N, N m]
    real(wp), allocatable :: contact_force(:, :), contact_torque(:, :)
    integer, allocatable :: contacts(:)   !! (n) different counterparts touched during the last step
    integer, allocatable :: on_floor(:)          !! (n) 1 if the floor or the bed is one of them
    type(record_t) :: record
  end type blocks_t

contains

  !> Release body b with its given velocity. One that a crane lowers is held first: it comes in, and
  !! is let go by a second call.
  pure subroutine release_body(time, b, blocks)
    real(wp), intent(in) :: time   !! [s]
    integer, intent(in) :: b
    type(blocks_t), intent(inout) :: blocks

    if (.not. blocks%present(b)) blocks%entry_time(b) = time
    if (blocks%handling(b)%lowering_speed > 0.0_wp) blocks%fixed(b) = .not. blocks%present(b)
    blocks%status(b) = merge(lowering, let_go, blocks%handling(b)%lowering_speed > 0.0_wp &
                             .and. blocks%fixed(b))
    blocks%present(b) = .true.
    if (blocks%status(b) == let_go) blocks%release_time(b) = time
    blocks%v(:, b) = blocks%given%v(:, b)
    blocks%omega(:, b) = blocks%given%omega(:, b)
    call set_momentum(b, blocks)
    if (blocks%path(b)%n > 0) call follow(b, blocks)
  end subroutine release_body

  !> A body for people: its number, and its name in the plan.
  pure function body_text(b, blocks) result(text)
    integer, intent(in) :: b
    type(blocks_t), intent(in) :: blocks
    character(:), allocatable :: text
    character(12) :: number

    write (number, '(i0)') b
    text = 'body '//trim(number)
    if (blocks%name(b) /= '') text = text//' ('//trim(blocks%name(b))//')'
  end function body_text

  !> Put body b where its path has it at `blocks%time`; before its release where that has it then.
  pure subroutine follow(b, blocks)
    integer, intent(in) :: b
    type(blocks_t), intent(inout) :: blocks
    real(wp) :: t

    t = blocks%time
    if (.not. blocks%present(b)) t = max(t, blocks%release_time(b))
    call pose_at(blocks%path(b), t, blocks%x(:, b), blocks%q(:, b), blocks%v(:, b), &
      blocks%omega(:, b))
    if (.not. blocks%present(b)) then
      blocks%v(:, b) = 0.0_wp
      blocks%omega(:, b) = 0.0_wp
    end if
    call set_momentum(b, blocks)
  end subroutine follow

  !> Put all bodies on paths where these have them at a time.
  pure subroutine follow_motions(time, blocks)
    real(wp), intent(in) :: time   !! [s]
    type(blocks_t), intent(inout) :: blocks
    integer :: b

    blocks%time = time
    do b = 1, blocks%n
      if (blocks%path(b)%n > 0) call follow(b, blocks)
    end do
  end subroutine follow_motions

  !> How fast the bodies on paths get within a time dt from now.
  pure subroutine look_ahead(dt, blocks)
    real(wp), intent(in) :: dt   !! [s]
    type(blocks_t), intent(inout) :: blocks
    integer :: b

    do b = 1, blocks%n
      if (blocks%path(b)%n > 0) blocks%ahead(:, b) = fastest_between(blocks%path(b), blocks%time, &
        blocks%time + dt)
    end do
  end subroutine look_ahead

  !> By how much a body on a path may get faster in this step than it is now; 0 for others [m/s].
  pure function haste(blocks, b, radius) result(more)
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: b
    real(wp), intent(in) :: radius   !! [m]
    real(wp) :: more

    more = max(0.0_wp, blocks%ahead(1, b) - norm(blocks%v(:, b))) &
      + max(0.0_wp, blocks%ahead(2, b) - norm(blocks%omega(:, b)))*radius
  end function haste

  !> By how much the velocity and spin of a body on a path change within a time dt from now.
  pure function change_by_motion(blocks, b, dt) result(change)
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: b
    real(wp), intent(in) :: dt   !! [s]
    real(wp) :: change(6)        !! [m/s], [rad/s]
    real(wp) :: x(3), q(4)

    call pose_at(blocks%path(b), blocks%time + dt, x, q, change(1:3), change(4:6))
    change = change - [blocks%v(:, b), blocks%omega(:, b)]
  end function change_by_motion

  !> Angular momentum of body b from its angular velocity.
  pure subroutine set_momentum(b, blocks)
    integer, intent(in) :: b
    type(blocks_t), intent(inout) :: blocks
    real(wp) :: inertia(3, 3)

    inertia = space_tensor(blocks%q(:, b), blocks%shapes(blocks%shape(b))%inertia)
    blocks%l(:, b) = matmul(inertia, blocks%omega(:, b))
  end subroutine set_momentum

  !> Move the bodies for a time dt with their present v and l; fixed bodies at their given rates.
  pure subroutine drift(dt, blocks)
    real(wp), intent(in) :: dt   !! [s]
    type(blocks_t), intent(inout) :: blocks
    integer :: b

    blocks%time = blocks%time + dt
    do b = 1, blocks%n
      if (blocks%present(b) .and. .not. blocks%asleep(b)) call drift_body(dt, b, blocks)
    end do
  end subroutine drift

  !> Move one body that is awake.
  !!
  !! Rotation by the midpoint rule: the angular velocity half a step ahead turns the body for the
  !! whole step, in parts where it turns far. `omega` belongs to the new attitude afterwards.
  pure subroutine drift_body(dt, b, blocks)
    real(wp), intent(in) :: dt   !! [s]
    integer, intent(in) :: b
    type(blocks_t), intent(inout) :: blocks
    real(wp), parameter :: max_turn = 0.05_wp   !! of a part [rad]
    real(wp) :: omega(3), half_way(4), part
    integer :: n, i

    if (blocks%fixed(b)) then
      ! Move a fixed body for a time dt at its constant given rate, or to `blocks%time` on its path.
      if (blocks%path(b)%n > 0) then
        call follow(b, blocks)
        return
      end if
      call shift_body(dt*blocks%v(:, b), b, blocks)
      if (all(abs(blocks%omega(:, b)) <= 0.0_wp)) return
      blocks%q(:, b) = normalised(quaternion_product(quaternion_exp(dt*blocks%omega(:, b)), &
                                                     blocks%q(:, b)))
      call set_momentum(b, blocks)
      return
    end if
    call shift_body(dt*blocks%v(:, b), b, blocks)
    associate (inverse => blocks%inverse_inertia(:, :, b), l => blocks%l(:, b), &
      q => blocks%q(:, b))
      n = max(1, ceiling(dt*norm(blocks%omega(:, b))/max_turn))
      part = dt/real(n, wp)
      do i = 1, n
        omega = angular_velocity(q, l, inverse)
        half_way = quaternion_product(quaternion_exp(0.5_wp*part*omega), q)
        omega = angular_velocity(half_way, l, inverse)
        q = normalised(quaternion_product(quaternion_exp(part*omega), q))
      end do
      blocks%omega(:, b) = angular_velocity(q, l, inverse)
    end associate
  end subroutine drift_body

  !> Move a body by a way, with what rounding has lost of it before: coordinates of a survey have
  !! 1e-9 m, as much as a slow body goes in a substep. Source: Kahan (1965), Comm. ACM 8, 40.
  pure subroutine shift_body(way, b, blocks)
    real(wp), intent(in) :: way(3)   !! [m]
    integer, intent(in) :: b
    type(blocks_t), intent(inout) :: blocks
    real(wp) :: whole(3), x(3)

    whole = way + blocks%lost(:, b)
    x = blocks%x(:, b) + whole
    blocks%lost(:, b) = whole - (x - blocks%x(:, b))
    blocks%x(:, b) = x
  end subroutine shift_body

  !> Move a free body by a way and a turn, and give it a velocity and more angular momentum.
  pure subroutine place_body(b, way, v, twist, blocks)
    integer, intent(in) :: b
    real(wp), intent(in) :: way(6)             !! of the centre, and rotation vector [m], [rad]
    real(wp), intent(in) :: v(3), twist(3)     !! space frame [m/s], [N m s]
    type(blocks_t), intent(inout) :: blocks

    call shift_body(way(1:3), b, blocks)
    blocks%q(:, b) = normalised(quaternion_product(quaternion_exp(way(4:6)), blocks%q(:, b)))
    blocks%v(:, b) = v
    blocks%l(:, b) = blocks%l(:, b) + twist
    blocks%omega(:, b) = angular_velocity(blocks%q(:, b), blocks%l(:, b), &
      blocks%inverse_inertia(:, :, b))
  end subroutine place_body

  !> Angular velocity of a body with angular momentum l, space frame [rad/s].
  pure function angular_velocity(q, l, inverse) result(omega)
    real(wp), intent(in) :: q(4), l(3)      !! attitude, [kg m2/s]
    real(wp), intent(in) :: inverse(3, 3)   !! inverse inertia, body axes [1/(kg m2)]
    real(wp) :: omega(3)
    real(wp) :: r(3, 3)

    r = rotation_matrix(q)
    omega = matmul(r, matmul(inverse, matmul(l, r)))
  end function angular_velocity

  !> A tensor given in body axes, in space axes: R t R^T.
  pure function space_tensor(q, t) result(s)
    real(wp), intent(in) :: q(4), t(3, 3)
    real(wp) :: s(3, 3)
    real(wp) :: r(3, 3)

    r = rotation_matrix(q)
    s = matmul(r, matmul(t, transpose(r)))
  end function space_tensor

  !> Let gravity and the given forces and torques act on the free present bodies for a time dt.
  pure subroutine kick(gravity, dt, force, torque, blocks)
    real(wp), intent(in) :: gravity(3)                !! [m/s2]
    real(wp), intent(in) :: dt                        !! [s]
    real(wp), intent(in) :: force(:, :), torque(:, :) !! (3, n) [N], [N m]
    type(blocks_t), intent(inout) :: blocks
    integer :: b

    do b = 1, blocks%n
      if (blocks%present(b)) call kick_body(gravity, dt, force(:, b), torque(:, b), b, blocks)
    end do
  end subroutine kick

  !> Let them act on one body, unless it is fixed.
  pure subroutine kick_body(gravity, dt, force, torque, b, blocks)
    real(wp), intent(in) :: gravity(3)           !! [m/s2]
    real(wp), intent(in) :: dt                   !! [s]
    real(wp), intent(in) :: force(3), torque(3)  !! [N], [N m]
    integer, intent(in) :: b
    type(blocks_t), intent(inout) :: blocks

    if (blocks%fixed(b)) return
    blocks%v(:, b) = blocks%v(:, b) + dt*(gravity + force/blocks%mass(b))
    blocks%l(:, b) = blocks%l(:, b) + dt*torque
    blocks%omega(:, b) = angular_velocity(blocks%q(:, b), blocks%l(:, b), &
      blocks%inverse_inertia(:, :, b))
  end subroutine kick_body

  !> Velocities at the end of a fluid step from those at its start, the mean contact forces of the
  !! substeps and the fluid forces of this step, which are stored.
  pure subroutine set_velocity_after_fluid(gravity, dt, force, torque, blocks)
    real(wp), intent(in) :: gravity(3)                !! [m/s2]
    real(wp), intent(in) :: dt                        !! [s]
    real(wp), intent(in) :: force(:, :), torque(:, :) !! (3, n) mean over the step [N], [N m]
    type(blocks_t), intent(inout) :: blocks
    integer :: b

    blocks%fluid_force = force
    blocks%fluid_torque = torque
    do b = 1, blocks%n
      if (blocks%fixed(b)) cycle
      blocks%v(:, b) = blocks%v_start(:, b)
      blocks%l(:, b) = blocks%l_start(:, b)
    end do
    call hold_sleepers(gravity, dt, blocks)
    call kick(gravity, dt, force + blocks%contact_force, torque + blocks%contact_torque, blocks)
    do b = 1, blocks%n
      if (.not. blocks%asleep(b)) cycle
      blocks%v(:, b) = 0.0_wp   ! it is, to round-off
      blocks%l(:, b) = 0.0_wp
      blocks%omega(:, b) = 0.0_wp
    end do
  end subroutine set_velocity_after_fluid

  !> Contact forces on sleepers: what they rest on gives what holds them.
  pure subroutine hold_sleepers(gravity, dt, blocks)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: dt           !! fluid step [s]
    type(blocks_t), intent(inout) :: blocks
    integer :: b

    do b = 1, blocks%n
      if (.not. blocks%asleep(b)) cycle
      blocks%contact_force(:, b) = -blocks%mass(b)*(gravity + blocks%v_start(:, b)/dt) &
        - blocks%fluid_force(:, b)
      blocks%contact_torque(:, b) = -blocks%l_start(:, b)/dt - blocks%fluid_torque(:, b)
    end do
  end subroutine hold_sleepers

  !> Mass of body b without water [kg].
  pure function own_mass(blocks, b) result(mass)
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: b
    real(wp) :: mass

    associate (shape => blocks%shapes(blocks%shape(b)))
      mass = shape%density*shape%volume
    end associate
  end function own_mass

  !> Kinetic energy of the free present bodies [J].
  pure function kinetic_energy(blocks) result(energy)
    type(blocks_t), intent(in) :: blocks
    real(wp) :: energy
    integer :: b

    energy = 0.0_wp
    do b = 1, blocks%n
      if (blocks%fixed(b) .or. .not. blocks%present(b)) cycle
      energy = energy + 0.5_wp*blocks%mass(b)*dot_product(blocks%v(:, b), blocks%v(:, b)) &
        + 0.5_wp*dot_product(blocks%l(:, b), blocks%omega(:, b))
    end do
  end function kinetic_energy

  !> Potential energy -M g.x of the free bodies, zero at the origin [J].
  !!
  !! Bodies not yet released count too, so that a release makes no jump.
  pure function potential_energy(gravity, blocks) result(energy)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    type(blocks_t), intent(in) :: blocks
    real(wp) :: energy
    integer :: b

    energy = 0.0_wp
    do b = 1, blocks%n
      if (blocks%fixed(b)) cycle
      energy = energy - own_mass(blocks, b)*dot_product(gravity, blocks%x(:, b))
    end do
  end function potential_energy

  !> Bound of the speed of all points of body b: that of the centre, and by rotation that of the
  !! point furthest from it [m/s].
  pure function fastest_point(blocks, b) result(speed)
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: b
    real(wp) :: speed

    speed = max(norm(blocks%v(:, b)), blocks%ahead(1, b)) &
            + max(norm(blocks%omega(:, b)), blocks%ahead(2, b)) &
            *blocks%shapes(blocks%shape(b))%radius
  end function fastest_point

  !> Which blocks have given rates or a table; held and lowered ones move by them.
  pure function are_driven(blocks) result(yes)
    type(blocks_t), intent(in) :: blocks
    logical :: yes(blocks%n)

    yes = blocks%path%n > 0 .or. any(abs(blocks%given%v) > 0.0_wp, 1) &
      .or. any(abs(blocks%given%omega) > 0.0_wp, 1)
  end function are_driven

end module rigid_body_m
