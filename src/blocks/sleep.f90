!> Blocks at rest sleep: they keep their pose, and contact points among them are not looked for,
!! until the forces on them no longer balance.
!!
!! A block falls asleep when it has been slow for some time, rests on something, and the forces on
!! it balance within `rest_tolerance` of its load. It stays asleep as long as they balance within
!! `wake_tolerance`: contact from sleepers, held bodies and walls, which is frozen like the poses,
!! contact from what moves, the fluid, and weight. So a block wakes in the substep in which it is
!! hit, when the flow changes, and when a neighbour that it rests on wakes and moves away. Nothing
!! is lost meanwhile: frozen forces and displacements are those of the awake block at the same pose,
!! and a sleeper is never held by more than that share of its load.
!!
!! A block that its load leaves out of balance by `rest_tolerance` is no longer slow after a quarter
!! of the time asked. Measured choice: docs/decisions/sleep.md.
module sleep_m
  use kinds_m, only: wp
  use vectors_m, only: distance, norm
  use rigid_body_m, only: blocks_t
  use sling_m, only: hangs
  use displacements_m, only: displacements_t, reserve_displacements
  implicit none
  private
  public :: sleep_t, sleep_init, update_stillness, update_loads, sum_memory
  public :: store_quiet, may_sleep
  public :: balanced, rest_tolerance, wake_tolerance, put_to_sleep, wake, all_still

  real(wp), parameter :: slow = 5.0e-4_wp            !! speed of a candidate over sqrt(g radius)
  real(wp), parameter :: time_to_sleep = 1.0_wp      !! before it sleeps, over sqrt(radius/g)
  real(wp), parameter :: rest_tolerance = 2.0e-3_wp
    !! imbalance of what falls asleep, over weight and fluid force
  real(wp), parameter :: wake_tolerance = 2.0e-2_wp  !! imbalance that wakes, likewise

  type :: sleep_t
    real(wp), allocatable :: reach(:)          !! (n) farthest point that touches, if any sleep [m]
    real(wp), allocatable :: quiet(:)          !! (n) how long the block has been slow [s]
    real(wp), allocatable :: x(:, :), q(:, :)  !! (3, n), (4, n) poses when the step began
    type(displacements_t) :: frozen            !! contact points between what does not move
    !> (3, n) sums of these on each body [N], [N m].
    real(wp), allocatable :: load(:, :), load_torque(:, :)
  end type sleep_t

contains

  !> Nobody sleeps yet.
  subroutine sleep_init(active, radius, sleep)
    logical, intent(in) :: active
    real(wp), intent(in) :: radius(:)           !! (n) [m]
    type(sleep_t), intent(out) :: sleep

    if (active) sleep%reach = radius
    allocate (sleep%quiet(size(radius)), source=0.0_wp)
    allocate (sleep%load(3, size(radius)), sleep%load_torque(3, size(radius)), source=0.0_wp)
    call reserve_displacements(1, sleep%frozen)
  end subroutine sleep_init

  !> Which bodies do not move: sleepers, and fixed ones without a given velocity that no path moves
  !! in this step. Where a body on a path starts or stops, all sleepers wake.
  pure subroutine update_stillness(blocks, changed)
    type(blocks_t), intent(inout) :: blocks
    logical, intent(out) :: changed   !! one has started or stopped
    logical :: held
    integer :: b

    changed = .false.
    do b = 1, blocks%n
      held = blocks%fixed(b) .and. all(abs(blocks%given%v(:, b)) <= 0.0_wp) &
        .and. all(abs(blocks%given%omega(:, b)) <= 0.0_wp) .and. all(blocks%ahead(:, b) <= 0.0_wp)
      if (blocks%path(b)%n > 0) changed = changed .or. (held .neqv. blocks%still(b))
      blocks%still(b) = blocks%asleep(b) .or. held
    end do
    if (.not. changed) return
    do b = 1, blocks%n
      if (blocks%asleep(b)) call wake(b, blocks)
    end do
  end subroutine update_stillness

  !> Whether no body moves.
  pure function all_still(blocks) result(yes)
    type(blocks_t), intent(in) :: blocks
    logical :: yes

    yes = all(blocks%still .or. .not. blocks%present)
  end function all_still

  !> Force and torque on each body of the contact points at rest.
  pure subroutine update_loads(sleep)
    type(sleep_t), intent(inout) :: sleep

    sleep%load = 0.0_wp
    sleep%load_torque = 0.0_wp
    call sum_memory(sleep%frozen, sleep%load, sleep%load_torque)
  end subroutine update_loads

  !> Add the forces and torques on bodies of contact points that remember them.
  pure subroutine sum_memory(displacements, force, torque)
    type(displacements_t), intent(in) :: displacements
    real(wp), intent(inout) :: force(:, :), torque(:, :)   !! (3, n) [N], [N m]
    integer :: i, a, b

    do i = 1, displacements%n
      a = displacements%a(i)
      b = displacements%b(i)
      force(:, a) = force(:, a) + displacements%force(:, i)
      torque(:, a) = torque(:, a) + displacements%torque_a(:, i)
      if (b < 1) cycle
      force(:, b) = force(:, b) - displacements%force(:, i)
      torque(:, b) = torque(:, b) + displacements%torque_b(:, i)
    end do
  end subroutine sum_memory

  !> Count the time for which each block has been slow, by a fluid step.
  !!
  !! What counts is how far it has come in the step. The velocity at the end of a step has the
  !! change of the fluid force in it, to which contact answers only in the next one: under waves a
  !! block that its supports hold has 50 times the velocity with which it moves.
  pure subroutine store_quiet(gravity, dt, blocks, sleep)
    real(wp), intent(in) :: gravity(3), dt     !! [m/s2], the fluid step [s]
    type(blocks_t), intent(in) :: blocks
    type(sleep_t), intent(inout) :: sleep
    real(wp) :: way
    integer :: b

    do b = 1, blocks%n
      way = distance(blocks%x(:, b), sleep%x(:, b)) &
        + 2.0_wp*norm(blocks%q(:, b) - sleep%q(:, b))*sleep%reach(b)
      if (blocks%present(b) .and. .not. blocks%fixed(b) .and. &
          way <= slow*sqrt(norm(gravity)*sleep%reach(b))*dt) then
        sleep%quiet(b) = sleep%quiet(b) + dt
      else
        sleep%quiet(b) = 0.0_wp
      end if
    end do
  end subroutine store_quiet

  !> Whether a block has been slow for long: some time of a fall by its size.
  pure function may_sleep(gravity, b, blocks, sleep) result(yes)
    real(wp), intent(in) :: gravity(3)         !! [m/s2]
    integer, intent(in) :: b
    type(blocks_t), intent(in) :: blocks
    type(sleep_t), intent(in) :: sleep
    logical :: yes

    yes = .not. (blocks%still(b) .or. hangs(b, blocks)) .and. sleep%quiet(b) > 0.0_wp
    if (yes) yes = sleep%quiet(b)**2*norm(gravity) >= time_to_sleep**2*sleep%reach(b)
  end function may_sleep

  !> Whether contact forces balance weight and fluid within a tolerance.
  pure function balanced(tolerance, force, torque, steady, steady_torque, radius) result(yes)
    real(wp), intent(in) :: tolerance          !! over `steady` [-]
    real(wp), intent(in) :: force(3), torque(3)               !! of contact [N], [N m]
    real(wp), intent(in) :: steady(3), steady_torque(3)       !! all else [N], [N m]
    real(wp), intent(in) :: radius              !! of the body [m]
    logical :: yes
    real(wp) :: bound

    bound = tolerance*norm(steady)
    yes = norm(force + steady) <= bound
    if (yes) yes = norm(torque + steady_torque) <= bound*radius
  end function balanced

  !> Let body b sleep at its pose.
  pure subroutine put_to_sleep(b, blocks)
    integer, intent(in) :: b
    type(blocks_t), intent(inout) :: blocks

    blocks%asleep(b) = .true.
    blocks%still(b) = .true.
    blocks%v(:, b) = 0.0_wp
    blocks%l(:, b) = 0.0_wp
    blocks%omega(:, b) = 0.0_wp
  end subroutine put_to_sleep

  !> Wake body b. If it hardly moves then, it may sleep again once it is in balance: under waves a
  !! pile wakes for a step, leans into its supports, and sleeps on.
  pure subroutine wake(b, blocks)
    integer, intent(in) :: b
    type(blocks_t), intent(inout) :: blocks

    blocks%asleep(b) = .false.
    blocks%still(b) = .false.
  end subroutine wake

end module sleep_m
