!> Contact of whole bodies: impacts, friction, rest, balances, and independence of bookkeeping.
module test_contacts_m
  use kinds_m, only: wp, pi
  use check_m, only: check, checked
  use case_types_m, only: case_t, body_input_t
  use tet_mesh_m, only: shape_t
  use shapes_builtin_m, only: make_shape
  use vectors_m, only: cross, quaternion_from_axis
  use random_counter_m, only: uniform, random_rotation
  use rigid_body_m, only: blocks_t, blocks_init, kinetic_energy, potential_energy, release_body
  use walls_m, only: walls_t, walls_init
  use law_restitution_m, only: min_restitution
  use contacts_m, only: contacts_t, contacts_init, contact_report_t, move_blocks
  implicit none
  private
  public :: test_contacts

  !> A small world of its own.
  type :: world_t
    type(case_t) :: case
    real(wp) :: gravity(3) = 0.0_wp
    type(blocks_t) :: blocks
    type(walls_t) :: walls
    type(contacts_t) :: contacts
    type(contact_report_t) :: report
  end type world_t

  real(wp), parameter :: d = 0.02_wp         !! diameter of the ball, edge of the cube [m]
  real(wp), parameter :: g = 9.81_wp         !! [m/s2]
  real(wp), parameter :: dt = 2.0e-3_wp   !! twenty substeps of a twentieth of the contact time [s]
  real(wp), parameter :: upright(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
  character(*), parameter :: models(3) = [character(7) :: 'spheres', 'surface', 'surface']
  character(*), parameter :: solvers(3) = [character(8) :: 'springs', 'springs', 'impulses']
  type(shape_t), allocatable :: shapes(:)
  integer :: model

contains

  subroutine test_contacts()
    call make_shapes()
    do model = 1, 3
      call check_model()
    end do
  end subroutine test_contacts

  !> Everything, for one of the two models, or for impulses.
  subroutine check_model()
    print '(5a)', 'model ', trim(models(model)), ', ', trim(solvers(model)), ':'
    call check_bouncing_ball()
    call check_fast_impact()
    call check_colliding_balls()
    call check_landing_cube()
    call check_landing_slab()
    if (models(model) == 'surface') call check_edge_on_edge()
    if (solvers(model) == 'springs') call check_swinging_ball()
    call check_slip_to_roll()
    call check_incline()
    call check_incline_on_body()
    call check_stack()
    call check_momentum()
    call check_energy()
    if (solvers(model) == 'springs') call check_constants()
    call check_added_mass()
    call check_moving_counterparts()
    call check_periodic_image()
    call check_bookkeeping()
    call check_runaway()
  end subroutine check_model

  subroutine make_shapes()
    character(:), allocatable :: message
    type(case_t) :: case
    integer :: s

    allocate (case%shape(5), shapes(5))
    case%shape%name = [character(8) :: 'ball', 'cube', 'plain', 'hexapod', 'slab']
    case%shape%kind = [character(8) :: 'sphere', 'cube', 'cube', 'hexapod', 'box']
    case%shape%refinement = [1, 2, 1, 1, 2]
    do s = 1, 5
      case%shape(s)%size = d
      if (s == 5) case%shape(s)%size = [6*d, 6*d, d]
      call make_shape(case%shape(s), shapes(s), message)
    end do
  end subroutine make_shapes

  !> A tank of 1 m with n bodies of a shape, all in the middle at rest, no friction.
  subroutine new_world(world, n, shape)
    type(world_t), intent(out) :: world
    integer, intent(in) :: n
    character(*), intent(in) :: shape
    integer :: b

    allocate (world%case%body(n), world%case%drop(0))
    world%case%grid%length = 1.0_wp
    world%case%contact%model = models(model)
    world%case%contact%solver = solvers(model)
    world%case%contact%friction = 0.0_wp
    world%case%contact%wall_friction = 0.0_wp
    world%case%contact%sleep = .false.   ! see test_sleep
    do b = 1, n
      world%case%body(b)%shape = shape
      world%case%body(b)%position = 0.5_wp
    end do
  end subroutine new_world

  !> Make the bodies, walls and contacts of the case, with the shapes that it uses.
  subroutine start(world)
    type(world_t), intent(inout) :: world
    integer :: s

    call blocks_init(world%case, shapes(pack([1, 2, 3, 4, 5], [(any(world%case%body%shape &
      == shapes(s)%name), s=1, 5)])), world%blocks)
    call walls_init(world%case%grid, world%case%boundary, world%walls)
    call contacts_init(world%case%contact, world%blocks, world%contacts)
  end subroutine start

  !> Take n steps.
  subroutine run(world, n, step)
    type(world_t), intent(inout) :: world
    integer, intent(in) :: n
    real(wp), intent(in), optional :: step   !! [s]; else dt
    real(wp) :: step_now
    integer :: i

    step_now = dt
    if (present(step)) step_now = step
    do i = 1, n
      call move_blocks(world%walls, world%gravity, step_now, world%contacts, world%blocks, &
        world%report)
    end do
  end subroutine run

  !> The restitution asked for, whatever part of a substep the impact begins in; and its duration.
  subroutine check_bouncing_ball()
    real(wp), parameter :: e(7) = [0.0_wp, 0.02_wp, 0.1_wp, 0.3_wp, 0.5_wp, 0.7_wp, 0.9_wp]
    type(world_t) :: world
    real(wp) :: worst, duration
    integer :: m, phase

    do m = 1, size(e)
      worst = 0.0_wp
      do phase = 0, 9
        call new_world(world, 1, 'ball')
        world%case%contact%restitution = e(m)
        world%case%body(1)%position(3) = 0.5_wp*d &
          + 0.8_wp*(1.0_wp + 0.1_wp*real(phase, wp))*1.0e-4_wp
        world%case%body(1)%velocity(3) = -0.8_wp
        call start(world)
        call run(world, 4)
        worst = max(worst, abs(world%blocks%v(3, 1)/0.8_wp - merge( &
          max(e(m), min_restitution), e(m), solvers(model) == 'springs')))
      end do
      call check('restitution of a ball', worst, 0.0_wp, 0.004_wp)
      call check('no spin', maxval(abs(world%blocks%omega)), 0.0_wp, 0.0_wp)
    end do
    if (solvers(model) == 'impulses') return
    call new_world(world, 1, 'ball')
    world%case%body(1)%position(3) = 0.5_wp*d
    world%case%body(1)%velocity(3) = -0.8_wp
    call start(world)
    duration = 0.0_wp
    do while (world%blocks%v(3, 1) < 0.2999_wp*0.8_wp .and. duration < 0.1_wp)
      call run(world, 1, 2.0e-5_wp)
      duration = duration + 2.0e-5_wp
    end do
    call check('duration of the impact', duration, world%case%contact%contact_time, 1.0e-4_wp)
  end subroutine check_bouncing_ball

  !> Blocks that come down fast do not sink in far, and return what is asked for.
  subroutine check_fast_impact()
    real(wp), parameter :: e(3) = [0.1_wp, 0.3_wp, 0.9_wp], speed = 8.0_wp
    character(4), parameter :: kind(2) = ['ball', 'cube']
    type(world_t) :: world
    real(wp) :: worst, deepest
    integer :: m, s, phase, i

    do s = 1, size(kind)
      do m = 1, size(e)
        worst = 0.0_wp
        deepest = 0.0_wp
        do phase = 0, 4
          call new_world(world, 1, kind(s))
          world%case%contact%restitution = e(m)
          world%case%body(1)%position(3) = 0.5_wp*d + 1.0e-3_wp + 1.0e-4_wp*real(phase, wp)
          world%case%body(1)%velocity(3) = -speed
          call start(world)
          world%gravity = 0.0_wp
          do i = 1, 4
            call run(world, 1)
            deepest = max(deepest, world%report%overlap_max)
          end do
          worst = max(worst, abs(world%blocks%v(3, 1)/speed - e(m)))
        end do
        call check('restitution of a fast '//kind(s), worst, 0.0_wp, 0.02_wp)
        call check('it does not sink in far', deepest < 0.2_wp*d)   ! linear: a third of d
      end do
    end do
  end subroutine check_fast_impact

  !> A ball that carries fluid along: restitution and momentum are those of both, and a force that
  !! lasts acts in full.
  subroutine check_added_mass()
    type(world_t) :: world
    real(wp) :: impulse, weight

    call new_world(world, 1, 'ball')
    world%case%contact%restitution = 0.9_wp
    world%case%body(1)%position(3) = 0.5_wp*d + 1.0e-4_wp
    world%case%body(1)%velocity(3) = -0.8_wp
    call start(world)
    world%blocks%added_mass(1) = 0.25_wp*world%blocks%mass(1)
    call run(world, 1, 4.0e-3_wp)
    call check('restitution with added mass', world%blocks%v(3, 1)/0.8_wp, 0.9_wp, 0.01_wp)
    impulse = world%blocks%contact_force(3, 1)*4.0e-3_wp
    call check('impulse on ball and fluid', impulse, 1.25_wp*world%blocks%mass(1) &
               *(world%blocks%v(3, 1) + 0.8_wp), 1.0e-12_wp)
    weight = world%blocks%mass(1)*g
    world%blocks%x(3, 1) = 0.5_wp
    world%blocks%v = 0.0_wp
    world%blocks%contact_force(:, 1) = [0.0_wp, 0.0_wp, weight]
    world%gravity = [0.0_wp, 0.0_wp, -g]
    call run(world, 1)
    call check('what the fluid took of the last force', world%blocks%v(3, 1), -dt*g/1.25_wp, &
               1.0e-12_wp)
  end subroutine check_added_mass

  !> Two balls, head on; and off centre, where only the normal velocity is reversed.
  subroutine check_colliding_balls()
    real(wp), parameter :: e(3) = [0.1_wp, 0.5_wp, 0.9_wp]
    type(world_t) :: world
    real(wp) :: n(3), before, after
    integer :: m

    do m = 1, size(e)
      call new_world(world, 2, 'ball')
      world%case%contact%restitution = e(m)
      n = [0.6_wp, 0.0_wp, 0.8_wp]
      world%case%body(2)%position = 0.5_wp + 1.001_wp*d*n
      world%case%body(1)%velocity = [0.0_wp, 0.1_wp, 0.9_wp]
      world%case%body(2)%velocity = [0.0_wp, 0.0_wp, -0.3_wp]
      call start(world)
      before = dot_product(world%blocks%v(:, 2) - world%blocks%v(:, 1), n)
      call run(world, 1)
      if (solvers(model) == 'springs') n = world%blocks%x(:, 2) - world%blocks%x(:, 1)
        ! has hardly turned; impulses are those of where they stood
      call run(world, 3)
      after = dot_product(world%blocks%v(:, 2) - world%blocks%v(:, 1), n/norm2(n))
      call check('restitution of two balls', -after/before, e(m), 0.02_wp)
    end do
  end subroutine check_colliding_balls

  !> Many contact points at once damp like one: a cube on its face, edge and corner.
  subroutine check_landing_cube()
    real(wp), parameter :: e(3) = [0.1_wp, 0.3_wp, 0.7_wp]
    type(world_t) :: world
    real(wp) :: q(4, 3), worst, corner
    integer :: m, pose, phase

    corner = atan(sqrt(2.0_wp))
    q(:, 1) = upright
    q(:, 2) = quaternion_from_axis([1.0_wp, 0.0_wp, 0.0_wp], atan(1.0_wp))
    q(:, 3) = quaternion_from_axis([1.0_wp, -1.0_wp, 0.0_wp], corner)
    do pose = 1, 3
      do m = 1, size(e)
        worst = 0.0_wp
        do phase = 0, 4
          call new_world(world, 1, 'cube')
          world%case%contact%restitution = e(m)
          world%case%body(1)%quaternion = q(:, pose)
          world%case%body(1)%velocity(3) = -0.8_wp
          world%case%body(1)%position(3) = lowest(shapes(2), q(:, pose)) + 1.0e-4_wp &
            + 2.0e-5_wp*real(phase, wp)
          call start(world)
          call run(world, 8)
          worst = max(worst, abs(world%blocks%v(3, 1)/0.8_wp - e(m)))
        end do
        call check('restitution of a cube', worst, 0.0_wp, 0.02_wp)
      end do
    end do
  end subroutine check_landing_cube

  !> A slab comes down on a hundred spheres at once, seventeen times as stiff as one: the substeps
  !! become short before it touches, and no energy is made.
  subroutine check_landing_slab()
    type(world_t) :: world
    real(wp) :: worst, turned, first, e
    integer :: phase

    worst = 0.0_wp
    turned = 0.0_wp
    do phase = 0, 3
      call new_world(world, 1, 'slab')
      world%case%body(1)%angular_velocity(3) = 5.0_wp
      e = merge(0.9_wp, 0.5_wp, phase < 2)
      world%case%contact%restitution = e
      world%case%body(1)%velocity(3) = -0.8_wp
      world%case%body(1)%position(3) = lowest(shapes(5), upright) &
        + 1.0e-4_wp*(1.0_wp + 0.3_wp*phase)
      call start(world)
      call run(world, 4)
      worst = max(worst, abs(world%blocks%v(3, 1)/0.8_wp - e))
      turned = max(turned, abs(2*atan2(world%blocks%q(4, 1), world%blocks%q(1, 1)) - 20*dt))
    end do
    call check('restitution of a slab', worst, 0.0_wp, 0.03_wp)
    call check('it goes on turning meanwhile', turned, 0.0_wp, 1.0e-9_wp)
    if (solvers(model) == 'impulses') return
    call new_world(world, 1, 'ball')
    world%case%contact%law = 'constants'   ! t_c = 0.05 ms, not told by contact_time
    world%case%contact%k_n = 4.0e7_wp
    world%case%contact%eta_n = 0.0_wp
    world%case%body(1)%position(3) = 0.5_wp*d + 1.3e-4_wp
    world%case%body(1)%velocity(3) = -0.8_wp
    call start(world)
    first = kinetic_energy(world%blocks)
    call run(world, 1)
    call check('a stiff spring gives the energy back', kinetic_energy(world%blocks)/first, 1.0_wp, &
      0.05_wp)
  end subroutine check_landing_slab

  !> Edges that meet exactly along one another touch along oblique normals with weights that change
  !! with position: the pair still returns what is asked for, and makes no energy.
  subroutine check_edge_on_edge()
    real(wp), parameter :: e(4) = [0.1_wp, 0.3_wp, 0.7_wp, 1.0_wp]
    type(world_t) :: world
    real(wp) :: worst
    integer :: m, k, phase

    do m = 1, size(e)
      worst = 0.0_wp
      do phase = 0, 2
        call new_world(world, 2, 'cube')
        world%case%contact%restitution = e(m)
        do k = 1, 2
          world%case%body(k)%quaternion = quaternion_from_axis([1.0_wp, 0.0_wp, 0.0_wp], &
            atan(1.0_wp))
          world%case%body(k)%velocity(3) = merge(0.4_wp, -0.4_wp, k == 1)
        end do
        world%case%body(2)%position(3) = 0.5_wp + sqrt(2.0_wp)*d + 1.0e-4_wp &
          + 3.0e-5_wp*real(phase, wp)
        call start(world)
        world%gravity = 0.0_wp
        call run(world, 8)
        worst = max(worst, abs((world%blocks%v(3, 2) - world%blocks%v(3, 1))/0.8_wp - e(m)))
        call check('no turn of edges', maxval(abs(world%blocks%omega)), 0.0_wp, 1.0e-9_wp)
      end do
      call check('restitution of edge on edge', worst, 0.0_wp, 0.02_wp)
    end do
  end subroutine check_edge_on_edge

  !> Height of the centre at which the lowest contact sphere or corner of a shape stands on the
  !! floor [m].
  function lowest(shape, q) result(height)
    use rotations_m, only: rotate
    type(shape_t), intent(in) :: shape
    real(wp), intent(in) :: q(4)
    real(wp) :: height
    real(wp) :: c(3)
    integer :: i

    height = 0.0_wp
    if (models(model) == 'surface') then
      do i = 1, size(shape%point, 2)
        c = rotate(q, shape%point(:, i))
        height = max(height, -c(3))
      end do
      return
    end if
    do i = 1, size(shape%sphere_radius)
      c = rotate(q, shape%sphere_centre(:, i))
      height = max(height, shape%sphere_radius(i) - c(3))
    end do
  end function lowest

  !> A ball at rest on the floor, nudged, swings on its tangential displacement: with k_t = 2/7 k_n
  !! and the mass 2/7 M that a ball sets against a tangential push, half a period is the contact
  !! time.
  subroutine check_swinging_ball()
    real(wp), parameter :: nudge = 1.0e-4_wp   ! too small to slip [m/s]
    type(world_t) :: world
    real(wp) :: slip, energy

    call new_world(world, 1, 'ball')
    world%case%contact%restitution = 1.0_wp
    world%case%contact%wall_friction = 0.4_wp
    world%gravity(3) = -g
    world%case%body(1)%position(3) = 0.5_wp*d - g*(world%case%contact%contact_time/pi)**2
    world%case%body(1)%velocity(1) = nudge
    call start(world)
    energy = kinetic_energy(world%blocks)
    call run(world, 1)
    slip = world%blocks%v(1, 1) - 0.5_wp*d*world%blocks%omega(2, 1)
    call check('swings back', slip, -nudge, 0.01_wp*nudge)
    call check('rolls on meanwhile', world%blocks%v(1, 1), 3*nudge/7, 0.01_wp*nudge)
    call run(world, 1, 1.25_wp*dt)
    call check('energy while swinging', kinetic_energy(world%blocks) + world%report%energy &
      - 0.5_wp*world%blocks%mass(1)*(g*world%case%contact%contact_time/pi)**2, energy, &
      0.01_wp*energy)
  end subroutine check_swinging_ball

  !> A ball set down sliding ends rolling at 5/7 of its speed after 2 v/(7 mu g).
  subroutine check_slip_to_roll()
    real(wp), parameter :: v = 0.5_wp, mu = 0.3_wp
    type(world_t) :: world
    real(wp) :: rolling

    call new_world(world, 1, 'ball')
    world%case%contact%wall_friction = mu
    world%gravity(3) = -g
    world%case%body(1)%position = [0.3_wp, 0.5_wp, 0.5_wp*d]
    world%case%body(1)%velocity(1) = v
    call start(world)
    rolling = 2*v/(7*mu*g)
    call run(world, nint(0.5_wp*rolling/dt))
    call check('slows down by mu g', world%blocks%v(1, 1), &
      v - mu*g*dt*real(nint(0.5_wp*rolling/dt), wp), 0.01_wp*v)
    call run(world, nint(1.0_wp*rolling/dt))
    call check('rolls at 5/7', world%blocks%v(1, 1), 5*v/7, 0.002_wp*v)
    call check('without slip', world%blocks%omega(2, 1)*0.5_wp*d, world%blocks%v(1, 1), 0.002_wp*v)
    call check('in a line', maxval(abs(world%blocks%v(2:3, 1))), 0.0_wp, 1.0e-10_wp)
    call run(world, 50)
    call check('and goes on', world%blocks%v(1, 1), 5*v/7, 0.002_wp*v)
  end subroutine check_slip_to_roll

  !> A cube on a slope of the floor: stays below the angle of friction, and slides as it should
  !! above.
  subroutine check_incline()
    real(wp), parameter :: mu = 0.4_wp
    type(world_t) :: world
    real(wp) :: slope, x(3), v

    slope = 0.95_wp*atan(mu)
    call new_world(world, 1, 'cube')
    world%case%contact%wall_friction = mu
    world%gravity = g*[sin(slope), 0.0_wp, -cos(slope)]
    world%case%body(1)%position(3) = lowest(shapes(2), upright)
    call start(world)
    call run(world, 200)
    x = world%blocks%x(:, 1)
    call run(world, 100)
    call check('does not creep', maxval(abs(world%blocks%x(:, 1) - x)), 0.0_wp, &
      merge(1.0e-12_wp, 1.0e-10_wp, solvers(model) == 'springs'))
    call check('friction holds the weight', world%blocks%contact_force(1, 1), &
      -world%blocks%mass(1)*g*sin(slope), merge(1.0e-9_wp, 1.0e-7_wp, solvers(model) == 'springs'))
    slope = 1.5_wp*atan(mu)
    world%gravity = g*[sin(slope), 0.0_wp, -cos(slope)]
    call run(world, 50)
    v = world%blocks%v(1, 1)
    call run(world, 50)
    call check('slides', world%blocks%v(1, 1) - v, 50*dt*g*(sin(slope) - mu*cos(slope)), 1.0e-3_wp)
  end subroutine check_incline

  !> The same on a fixed body, spheres on spheres.
  subroutine check_incline_on_body()
    type(world_t) :: world
    real(wp) :: slope, x(3)

    slope = 0.3_wp
    call new_world(world, 2, 'cube')
    world%case%contact%friction = 0.6_wp
    world%gravity = g*[sin(slope), 0.0_wp, -cos(slope)]
    world%case%body(1)%shape = 'slab'
    world%case%body(1)%fixed = .true.
    world%case%body(2)%position = [0.503_wp, 0.501_wp, 0.5_wp + 1.2_wp*d]
    call start(world)
    call run(world, 500)
    call check('lies on the slab', world%blocks%contacts(2), 1)
    x = world%blocks%x(:, 2)
    call run(world, 250)
    call check('does not creep on spheres', maxval(abs(world%blocks%x(:, 2) - x)), 0.0_wp, &
      1.0e-9_wp)
    call check('the slab bears the cube', maxval(abs(world%blocks%contact_force(:, 1) &
      - world%blocks%mass(2)*world%gravity)), 0.0_wp, 1.0e-4_wp)
    call check('action and reaction', maxval(abs(sum(world%blocks%contact_force, 2))), 0.0_wp, &
      0.0_wp)
  end subroutine check_incline_on_body

  !> Two cubes set one on the other come to rest; counterparts are counted; forces balance the
  !! weight.
  subroutine check_stack()
    type(world_t) :: world
    real(wp) :: height, change(3, 2), weight, v(3, 2)

    call new_world(world, 2, 'cube')
    world%case%contact%friction = 0.6_wp
    world%case%contact%wall_friction = 0.4_wp
    world%gravity(3) = -g
    height = lowest(shapes(2), upright)
    world%case%body(1)%position(3) = height
    world%case%body(2)%position(3) = 3*height
    call start(world)
    call run(world, 10)
    v = world%blocks%v
    call run(world, 1)
    weight = g*world%blocks%mass(1)
    change = world%blocks%mass(1)*(world%blocks%v - v)/dt
    change(3, :) = change(3, :) + weight
    call check('M dU/dt = contact + M g', maxval(abs(change - world%blocks%contact_force)), &
      0.0_wp, 1.0e-12_wp)
    call run(world, 500)
    call check('at rest', maxval(abs(world%blocks%v)), 0.0_wp, &
      merge(1.0e-9_wp, 1.0e-8_wp, solvers(model) == 'springs'))
    call check('on the floor', all(world%blocks%on_floor == [1, 0]))
    call check('counterparts', all(world%blocks%contacts == [2, 1]))
    call check('weight on each', maxval(abs(world%blocks%contact_force(3, :) - weight)), 0.0_wp, &
      1.0e-8_wp)
    call check('no torque', maxval(abs(world%blocks%contact_torque)), 0.0_wp, 1.0e-10_wp)
    if (solvers(model) == 'springs') call check('energy of the springs', &
      world%report%energy > 0.0_wp)
    call check('upright', abs(world%blocks%q(1, 2)), 1.0_wp, 1.0e-6_wp)
  end subroutine check_stack

  !> Momentum and angular momentum of colliding bodies, with friction and damping, no walls near.
  subroutine check_momentum()
    type(world_t) :: world
    real(wp) :: p(3), l(3), p0(3), l0(3), round_off
    integer :: b, i, drifts

    call new_world(world, 4, 'hexapod')
    world%case%contact%friction = 0.6_wp
    do b = 1, 4
      world%case%body(b)%position = 0.45_wp + 0.08_wp*real([mod(b, 2), b/2, 0], wp)
      world%case%body(b)%quaternion = random_rotation(1, b)
      world%case%body(b)%velocity = 0.8_wp*(0.5_wp &
        - (world%case%body(b)%position - 0.45_wp)/0.08_wp)
      world%case%body(b)%angular_velocity = 10*[uniform(1, b, 11), uniform(1, b, 12), &
        uniform(1, b, 13)]
    end do
    call start(world)
    call total(world%blocks, p0, l0)
    drifts = 0
    do i = 1, 60
      call run(world, 1)
      drifts = drifts + 2*world%report%substeps
    end do
    call total(world%blocks, p, l)
    ! each drift rounds the places, by the same amount while nothing touches
    round_off = real(drifts, wp)*0.5_wp*spacing(0.5_wp)*sum(world%blocks%mass)*0.8_wp
    call check('they met', kinetic_energy(world%blocks) &
      < 0.9_wp*sum(world%blocks%mass)*0.5_wp*0.64_wp &
      .and. world%contacts%displacements%n >= 0)
    call check('momentum', maxval(abs(p - p0)), 0.0_wp, 1.0e-14_wp)
    call check('angular momentum', maxval(abs(l - l0)), 0.0_wp, round_off)
    call check('to round-off', round_off < 1.0e-12_wp)
  end subroutine check_momentum

  !> Momentum of all bodies, and angular momentum about the middle of the tank.
  pure subroutine total(blocks, p, l)
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(out) :: p(3), l(3)
    integer :: b

    p = 0.0_wp
    l = 0.0_wp
    do b = 1, blocks%n
      p = p + blocks%mass(b)*blocks%v(:, b)
      l = l + blocks%l(:, b) + blocks%mass(b)*cross(blocks%x(:, b) - 0.5_wp, blocks%v(:, b))
    end do
  end subroutine total

  !> Without damping and friction the energy comes back; with friction none is made.
  subroutine check_energy()
    real(wp), parameter :: mu(2) = [0.0_wp, 0.5_wp]
    type(world_t) :: world
    real(wp) :: energy, least, most, now, band
    integer :: i, m, n

    band = merge(5.0e-3_wp, 2.0e-3_wp, models(model) == 'surface')   ! crossing edges fade steeply

    do m = 1, 2
      least = 1.0_wp
      most = 0.0_wp
      do i = 1, merge(3, 12, checked)
        call new_world(world, 2, 'cube')
        world%case%contact%restitution = merge(1.0_wp, 0.6_wp, solvers(model) == 'springs')
        world%case%contact%wall_friction = mu(m)
        world%case%contact%friction = mu(m)
        world%case%contact%substep_ratio = merge(0.001_wp, 0.01_wp, models(model) == 'surface')
        world%case%body(1)%position(3) = 0.03_wp
        world%case%body(2)%position(2:3) = [0.49_wp, 0.066_wp]
        world%case%body(1)%quaternion = random_rotation(2, i)
        world%case%body(2)%quaternion = random_rotation(3, i)
        world%case%body(1)%velocity(3) = -0.5_wp
        world%case%body(2)%velocity(3) = -0.8_wp
        world%case%body(1)%angular_velocity = 15*[uniform(1, i, 11), uniform(1, i, 12), &
          uniform(1, i, 13)]
        call start(world)
        energy = kinetic_energy(world%blocks)
        do n = 1, 40
          call run(world, 1)
          now = (kinetic_energy(world%blocks) + world%report%energy)/energy
          least = min(least, now)
          most = max(most, now)
        end do
      end do
      call check('no energy is made', most, 1.0_wp, band)
      if (solvers(model) == 'impulses') cycle   ! they lose some in each impact
      if (m == 1) call check('no energy is lost', least, 1.0_wp, band)
      if (m == 2) call check('friction takes some', least < 0.9_wp)
    end do
  end subroutine check_energy

  !> The law with given constants, linear and with a power: a lasting contact of pi sqrt(m/k), and
  !! the deepest overlap from the energy.
  subroutine check_constants()
    type(world_t) :: world
    real(wp) :: deepest, m
    integer :: i, power

    do power = 1, 2
      call new_world(world, 1, 'ball')
      world%case%contact%law = 'constants'
      world%case%contact%k_n = merge(1.0e5_wp, 1.0e7_wp, power == 1)
      world%case%contact%gamma_n = 0.5_wp*(1 + power)
      world%case%contact%eta_n = 0.0_wp
      world%case%contact%eta_t = 0.0_wp
      world%case%contact%contact_time = 2.0e-4_wp
      world%case%body(1)%position(3) = 0.5_wp*d + 1.0e-4_wp
      world%case%body(1)%velocity(3) = -0.5_wp
      call start(world)
      m = world%blocks%mass(1)
      deepest = 0.0_wp
      do i = 1, 200
        call run(world, 1, 1.0e-5_wp)
        deepest = max(deepest, world%report%overlap_max)
      end do
      associate (c => world%case%contact)
        call check('deepest overlap', c%k_n*deepest**(c%gamma_n + 1)/(c%gamma_n + 1), &
          0.5_wp*m*0.25_wp, 1.0e-3_wp*m)
      end associate
      call check('springs back', world%blocks%v(3, 1), 0.5_wp, 1.0e-3_wp)
    end do
    world%case%contact%eta_n = 5.0_wp
    call start(world)
    call run(world, 200, 1.0e-5_wp)
    call check('damped', world%blocks%v(3, 1) > 0.05_wp .and. world%blocks%v(3, 1) < 0.45_wp)
  end subroutine check_constants

  !> A sliding floor drags a cube along; a moved body pushes a ball to (1 + e) times its own speed.
  subroutine check_moving_counterparts()
    type(world_t) :: world

    call new_world(world, 1, 'cube')
    world%case%contact%wall_friction = 0.4_wp
    world%case%boundary%velocity(:, 1, 3) = [0.2_wp, -0.1_wp, 0.0_wp]
    world%gravity(3) = -g
    world%case%body(1)%position(3) = lowest(shapes(2), upright)
    call start(world)
    call run(world, 20)
    call check('dragged by mu g', norm2(world%blocks%v(1:2, 1)), 0.4_wp*g*20*dt, 5.0e-3_wp)
    call run(world, 200)
    call check('moves with the floor', &
      maxval(abs(world%blocks%v(:, 1) - [0.2_wp, -0.1_wp, 0.0_wp])), &
      0.0_wp, 1.0e-6_wp)
    call new_world(world, 2, 'ball')
    world%case%contact%restitution = 0.5_wp
    world%case%body(1)%fixed = .true.
    world%case%body(1)%velocity(1) = 0.4_wp
    world%case%body(2)%position(1) = 0.5_wp + 1.01_wp*d
    call start(world)
    call run(world, 10)
    call check('pushed', world%blocks%v(1, 2), 0.6_wp, 0.005_wp)
    call check('the pusher keeps its speed', world%blocks%v(1, 1), 0.4_wp, 0.0_wp)
    call check('and its way', world%blocks%x(1, 1), 0.5_wp + 10*dt*0.4_wp, 1.0e-14_wp)
  end subroutine check_moving_counterparts

  !> Two balls collide through a periodic side as they do in the middle.
  subroutine check_periodic_image()
    type(world_t) :: inner, outer

    call new_world(inner, 2, 'ball')
    inner%case%contact%friction = 0.3_wp
    inner%case%boundary%kind(:, 1) = 'periodic'
    inner%case%body(2)%position = 0.5_wp + [1.02_wp*d, 0.2_wp*d, 0.0_wp]
    inner%case%body(2)%velocity(1) = -0.5_wp
    outer%case = inner%case
    outer%case%body(1)%position(1) = 0.99_wp
    outer%case%body(2)%position(1) = 0.99_wp + 1.02_wp*d - 1.0_wp
    call start(inner)
    call start(outer)
    call run(inner, 10)
    call run(outer, 10)
    call check('met', inner%blocks%v(1, 1) < -0.1_wp)
    call check('same velocities', maxval(abs(inner%blocks%v - outer%blocks%v)), 0.0_wp, 1.0e-10_wp)
    call check('same spins', maxval(abs(inner%blocks%omega - outer%blocks%omega)), 0.0_wp, &
      1.0e-8_wp)
  end subroutine check_periodic_image

  !> A pile moves the same to the last bit however often the lists are made anew, and from the state
  !! of a restart: poses, momenta, displacements and who sleeps.
  subroutine check_bookkeeping()
    type(world_t) :: one, two
    integer :: b, n

    call new_world(one, 6, 'plain')
    one%case%contact%sleep = .true.
    one%case%contact%friction = 0.6_wp
    one%case%contact%wall_friction = 0.4_wp
    one%case%grid%length = [0.06_wp, 0.05_wp, 1.0_wp]
    one%gravity = [1.0_wp, 0.0_wp, -g]
    do b = 1, 6
      one%case%body(b)%position = [0.02_wp*real(1 + mod(b, 2), wp), 0.025_wp, 0.03_wp*real(b, wp)]
      one%case%body(b)%quaternion = random_rotation(4, b)
    end do
    one%case%body(6)%release_time = 1.0_wp
    call start(one)
    two%case = one%case
    two%gravity = one%gravity
    call start(two)
    associate (spheres => two%contacts%detected%spheres)
      spheres%skin = spheres%skin - 1.98_wp*spheres%free_way
      spheres%free_way = 0.01_wp*spheres%free_way
    end associate
    do n = 1, 3
      call run(one, 40, 1.0e-2_wp)
      call run(two, 40, 1.0e-2_wp)
      call check('same bits with another skin', same(one%blocks, two%blocks))
      call check('touching', sum(one%blocks%contacts) > 5)
      call contacts_init(two%case%contact, two%blocks, two%contacts)   ! as after a restart
      two%contacts%displacements = one%contacts%displacements
      two%contacts%sleep%quiet = one%contacts%sleep%quiet
      two%contacts%sleep%rest = one%contacts%sleep%rest
      if (n == 1) then
        call release_body(0.4_wp, 6, one%blocks)
        call release_body(0.4_wp, 6, two%blocks)
      end if
    end do
    two%contacts%displacements%xi = 0.0_wp
    two%contacts%sleep%rest%force = 0.0_wp   ! where they sleep
    call run(one, 1)
    call run(two, 1)
    call check('the displacements matter', .not. same(one%blocks, two%blocks))
  end subroutine check_bookkeeping

  !> Whether two states are equal to the last bit.
  pure function same(a, b) result(yes)
    type(blocks_t), intent(in) :: a, b
    logical :: yes

    yes = all(abs(a%x - b%x) <= 0.0_wp) .and. all(abs(a%q - b%q) <= 0.0_wp) &
      .and. all(abs(a%v - b%v) <= 0.0_wp) &
      .and. all(abs(a%l - b%l) <= 0.0_wp) &
      .and. all(abs(a%contact_force - b%contact_force) <= 0.0_wp)
  end function same

  !> A speed beyond all bounds is reported, not followed; and the Courant limit shortens the
  !! substeps.
  subroutine check_runaway()
    type(world_t) :: world

    call new_world(world, 1, 'ball')
    world%case%body(1)%velocity(3) = -100.0_wp
    call start(world)
    call run(world, 1)
    call check('substeps by C_s, one where nothing is near', world%report%substeps, &
      merge(100, 1, solvers(model) == 'springs'))   ! v dt/(0.1 d)
    call check('nothing wrong', world%report%info, 0)
    call new_world(world, 1, 'ball')
    world%case%body(1)%velocity(3) = 1.0e10_wp
    call start(world)
    call run(world, 1)
    call check('runaway', world%report%info, 1)
  end subroutine check_runaway

end module test_contacts_m
