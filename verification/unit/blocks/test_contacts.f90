!> Contact of whole bodies: impacts, friction, rest, balances, and independence of bookkeeping.
module test_contacts_m
  use check_m, only: check, checked, wp, pi
  use errors_m, only: to_text
  use tet_mesh_m, only: shape_t
  use vectors_m, only: cross, quaternion_from_axis
  use random_counter_m, only: uniform, random_rotation
  use rigid_body_m, only: blocks_t, kinetic_energy, release_body
  use law_restitution_m, only: min_restitution
  use simulation_m, only: choose_contact
  use springs_m, only: springs_t
  use impulse_step_m, only: impulses_t
  use world_m, only: world_t, set_up, begin, body, move
  implicit none
  private
  public :: test_contacts

  real(wp), parameter :: d = 0.02_wp         !! diameter of the ball, edge of the cube [m]
  real(wp), parameter :: g = 9.81_wp         !! [m/s2]
  real(wp), parameter :: dt = 2.0e-3_wp   !! twenty substeps of a twentieth of the contact time [s]
  real(wp), parameter :: upright(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
  real(wp), parameter :: middle(3) = 0.5_wp, up(3) = [0.0_wp, 0.0_wp, 1.0_wp]   !! of the tank [m]
  character(*), parameter :: smooth = 'friction=0 wall_friction=0 restitution='
  character(*), parameter :: tank = '&grid cells=3*2 length=3*1/ '
  character(*), parameter :: space = tank//'&fluid gravity=3*0/ '
  character(*), parameter :: ball = '&shape name="ball" kind="sphere" size=.02 refinement=1/ '
  character(*), parameter :: cube = '&shape name="cube" kind="cube" size=.02 refinement=2/ '
  character(*), parameter :: slab = '&shape name="slab" kind="box" size=.12,.12,.02 refinement=2/ '
  character(*), parameter :: models(2) = [character(7) :: 'spheres', 'surface']
  integer :: model

contains

  subroutine test_contacts()
    do model = 1, 2
      call check_model()
    end do
  end subroutine test_contacts

  !> Set up other groups with this &contact for the model, without sleep (see test_sleep).
  subroutine start(contact, groups, world)
    character(*), intent(in) :: contact, groups
    type(world_t), intent(out) :: world

    call set_up('&run t_end=1 physics="dry"/ &contact model="'//models(model)//'" '//contact &
      //merge('         ', ' sleep=F ', &
      index(contact, 'sleep') > 0)//'/ '//groups, world)
  end subroutine start

  !> Everything, for springs between spheres or for impulses between surfaces.
  subroutine check_model()
    print '(3a)', 'model ', models(model), ':'
    call check_bouncing_ball()
    call check_fast_impact()
    call check_landing_cube()
    call check_landing_slab()
    if (models(model) == 'spheres') call check_swinging_ball()
    if (models(model) == 'spheres') call check_turning_is_fast()
    call check_momentum()
    call check_energy()
    if (models(model) == 'spheres') call check_constants()
    call check_added_mass()
    call check_moving_floor()
    call check_periodic_image()
    call check_bookkeeping()
    call check_runaway()
  end subroutine check_model

  !> The restitution asked for, whatever part of a substep the impact begins in; and its duration.
  subroutine check_bouncing_ball()
    real(wp), parameter :: e(7) = [0.0_wp, 0.02_wp, 0.1_wp, 0.3_wp, 0.5_wp, 0.7_wp, 0.9_wp]
    type(world_t) :: world
    real(wp) :: worst, duration
    integer :: m, phase

    do m = 1, size(e)
      worst = 0.0_wp
      do phase = 0, 9
        call start(smooth//to_text(e(m)), space//ball//body('ball', [0.5_wp, 0.5_wp, 0.5_wp*d &
          + 0.8_wp*(1.0_wp + 0.1_wp*real(phase, wp))*1.0e-4_wp], -0.8_wp*up), world)
        call move(world, 4, dt)
        worst = max(worst, abs(world%blocks%v(3, 1)/0.8_wp - merge( &
          max(e(m), min_restitution), e(m), models(model) == 'spheres')))
      end do
      call check('restitution of a ball', worst, 0.0_wp, 0.004_wp)
      call check('no spin', world%blocks%omega, 0.0_wp)
    end do
    if (models(model) == 'surface') return
    call start(smooth//'.3', space//ball//body('ball', [0.5_wp, 0.5_wp, 0.5_wp*d], -0.8_wp*up), &
      world)
    duration = 0.0_wp
    do while (world%blocks%v(3, 1) < 0.2999_wp*0.8_wp .and. duration < 0.1_wp)
      call move(world, 1, 2.0e-5_wp)
      duration = duration + 2.0e-5_wp
    end do
    call check('duration of the impact', duration, world%case%contact%contact_time, 1.0e-4_wp)
  end subroutine check_bouncing_ball

  !> A cube beside the floor that only turns takes short substeps, too.
  subroutine check_turning_is_fast()
    type(world_t) :: still, turning

    call start('', space//cube//body('cube', [0.5_wp, 0.5_wp, 0.02_wp]), still)
    call start('', space//cube//body('cube', [0.5_wp, 0.5_wp, 0.02_wp], &
      more='angular_velocity=0,0,1e3'), turning)
    call move(still, 1, dt)
    call move(turning, 1, dt)
    call check('substeps', turning%contact%substeps > 2*still%contact%substeps)
  end subroutine check_turning_is_fast

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
          call start(smooth//to_text(e(m)), space//ball//cube//body(kind(s), &
            [0.5_wp, 0.5_wp, 0.5_wp*d + 1.0e-3_wp + 1.0e-4_wp*real(phase, wp)], -speed*up), world)
          do i = 1, 4
            call move(world, 1, dt)
            deepest = max(deepest, world%contact%overlap_max)
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

    call start(smooth//'.9', space//ball//body('ball', [0.5_wp, 0.5_wp, 0.5_wp*d + 1.0e-4_wp], &
      -0.8_wp*up), world)
    world%blocks%added_mass(1) = 0.25_wp*world%blocks%mass(1)
    call move(world, 1, 4.0e-3_wp)
    call check('restitution with added mass', world%blocks%v(3, 1)/0.8_wp, 0.9_wp, 0.01_wp)
    impulse = world%blocks%contact_force(3, 1)*4.0e-3_wp
    call check('impulse on ball and fluid', impulse, 1.25_wp*world%blocks%mass(1) &
               *(world%blocks%v(3, 1) + 0.8_wp), 1.0e-12_wp)
    weight = world%blocks%mass(1)*g
    world%blocks%x(3, 1) = 0.5_wp
    world%blocks%v = 0.0_wp
    world%blocks%contact_force(:, 1) = [0.0_wp, 0.0_wp, weight]
    world%case%fluid%gravity = -g*up
    call move(world, 1, dt)
    call check('what the fluid took of the force', world%blocks%v(3, 1), -dt*g/1.25_wp, &
               1.0e-12_wp)
  end subroutine check_added_mass

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
          call start(smooth//to_text(e(m)), space//cube//body('cube', middle, -0.8_wp*up, &
            q(:, pose)), world)
          world%blocks%x(3, 1) = lowest(world%shapes(1), q(:, pose)) + 1.0e-4_wp &
            + 2.0e-5_wp*real(phase, wp)
          call move(world, 8, dt)
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
      e = merge(0.9_wp, 0.5_wp, phase < 2)
      call start(smooth//to_text(e), space//slab//body('slab', middle, -0.8_wp*up, &
        more='angular_velocity=0,0,5'), world)
      world%blocks%x(3, 1) = lowest(world%shapes(1), upright) + 1.0e-4_wp*(1.0_wp + 0.3_wp*phase)
      call move(world, 4, dt)
      worst = max(worst, abs(world%blocks%v(3, 1)/0.8_wp - e))
      turned = max(turned, abs(2*atan2(world%blocks%q(4, 1), world%blocks%q(1, 1)) - 20*dt))
    end do
    call check('restitution of a slab', worst, 0.0_wp, 0.03_wp)
    call check('it goes on turning meanwhile', turned, 0.0_wp, 1.0e-9_wp)
    if (models(model) == 'surface') return
    ! t_c = 0.05 ms, not told by contact_time
    call start('law="constants" k_n=4e7 eta_n=0 friction=0 wall_friction=0', space//ball &
      //body('ball', [0.5_wp, 0.5_wp, 0.5_wp*d + 1.3e-4_wp], -0.8_wp*up), world)
    first = kinetic_energy(world%blocks)
    call move(world, 1, dt)
    call check('a stiff spring returns it', kinetic_energy(world%blocks)/first, 1.0_wp, 0.05_wp)
  end subroutine check_landing_slab

  !> Height of the centre at which the lowest contact sphere or corner of a shape stands on the
  !! floor [m].
  real(wp) function lowest(shape, q) result(height)
    use rotations_m, only: rotate
    type(shape_t), intent(in) :: shape
    real(wp), intent(in) :: q(4)
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

    call start('restitution=1', tank//ball//body('ball', middle, [nudge, 0.0_wp, 0.0_wp]), world)
    world%blocks%x(3, 1) = 0.5_wp*d - g*(world%case%contact%contact_time/pi)**2
    energy = kinetic_energy(world%blocks)
    call move(world, 1, dt)
    slip = world%blocks%v(1, 1) - 0.5_wp*d*world%blocks%omega(2, 1)
    call check('swings back', slip, -nudge, 0.01_wp*nudge)
    call check('rolls on meanwhile', world%blocks%v(1, 1), 3*nudge/7, 0.01_wp*nudge)
    call move(world, 1, 1.25_wp*dt)
    call check('energy while swinging', kinetic_energy(world%blocks) + world%contact%energy &
      - 0.5_wp*world%blocks%mass(1)*(g*world%case%contact%contact_time/pi)**2, energy, &
      0.01_wp*energy)
  end subroutine check_swinging_ball

  !> Momentum and angular momentum of colliding bodies, with friction and damping, no walls near.
  subroutine check_momentum()
    type(world_t) :: world
    real(wp) :: p(3), l(3), p0(3), l0(3), place(3), round_off
    character(:), allocatable :: bodies
    integer :: b, i, drifts

    bodies = ''
    do b = 1, 4
      place = real([mod(b, 2), b/2, 0], wp)
      bodies = bodies//body('hexapod', 0.45_wp + 0.08_wp*place, 0.8_wp*(0.5_wp - place), &
        random_rotation(1, b), spin(b, 10.0_wp))
    end do
    call start('friction=.6', space//'&shape name="hexapod" kind="hexapod" size=.02/ '//bodies, &
      world)
    call total(world%blocks, p0, l0)
    drifts = 0
    do i = 1, 60
      call move(world, 1, dt)
      drifts = drifts + 2*world%contact%substeps
    end do
    call total(world%blocks, p, l)
    ! each drift rounds the places, by the same amount while nothing touches
    round_off = real(drifts, wp)*0.5_wp*spacing(0.5_wp)*sum(world%blocks%mass)*0.8_wp
    call check('they met', kinetic_energy(world%blocks) &
      < 0.9_wp*sum(world%blocks%mass)*0.5_wp*0.64_wp)
    call check('momentum', p - p0, 0.0_wp, 1.0e-14_wp)
    call check('angular momentum', l - l0, 0.0_wp, round_off)
    call check('to round-off', round_off < 1.0e-12_wp)
  end subroutine check_momentum

  !> The angular velocity of a body by chance, up to `most`.
  function spin(b, most) result(text)
    integer, intent(in) :: b
    real(wp), intent(in) :: most   !! [rad/s]
    character(:), allocatable :: text

    text = 'angular_velocity='//to_text(most*[uniform(1, b, 11), uniform(1, b, 12), &
      uniform(1, b, 13)])
  end function spin

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
    character(*), parameter :: finer(2) = [character(35) :: ' restitution=1 substep_ratio=.01', &
      ' restitution=.6']
    type(world_t) :: world
    real(wp) :: energy, least, most, now
    integer :: i, m, n

    do m = 1, 2
      least = 1.0_wp
      most = 0.0_wp
      do i = 1, merge(3, 12, checked)
        call start('friction='//to_text(mu(m))//' wall_friction='//to_text(mu(m)) &
          //trim(finer(model)), space//cube &
          //body('cube', [0.5_wp, 0.5_wp, 0.03_wp], -0.5_wp*up, random_rotation(2, i), &
          spin(i, 15.0_wp))//body('cube', [0.5_wp, 0.49_wp, 0.066_wp], -0.8_wp*up, &
          random_rotation(3, i)), world)
        energy = kinetic_energy(world%blocks)
        do n = 1, 40
          call move(world, 1, dt)
          now = (kinetic_energy(world%blocks) + world%contact%energy)/energy
          least = min(least, now)
          most = max(most, now)
        end do
      end do
      call check('no energy is made', most, 1.0_wp, 2.0e-3_wp)
      if (models(model) == 'surface') cycle   ! they lose some in each impact
      if (m == 1) call check('no energy is lost', least, 1.0_wp, 2.0e-3_wp)
      if (m == 2) call check('friction takes some', least < 0.9_wp)
    end do
  end subroutine check_energy

  !> The law with given constants, linear and with a power: a lasting contact of pi sqrt(m/k), and
  !! the deepest overlap from the energy.
  subroutine check_constants()
    type(world_t) :: world, damped
    real(wp) :: deepest, m
    integer :: i, power

    do power = 1, 2
      call start('law="constants" eta_n=0 eta_t=0 contact_time=2e-4 friction=0 wall_friction=0' &
        //merge(' k_n=1e5 gamma_n=1  ', ' k_n=1e7 gamma_n=1.5', power == 1), space//ball &
        //body('ball', [0.5_wp, 0.5_wp, 0.5_wp*d + 1.0e-4_wp], -0.5_wp*up), world)
      m = world%blocks%mass(1)
      deepest = 0.0_wp
      do i = 1, 200
        call move(world, 1, 1.0e-5_wp)
        deepest = max(deepest, world%contact%overlap_max)
      end do
      associate (c => world%case%contact)
        call check('deepest overlap', c%k_n*deepest**(c%gamma_n + 1)/(c%gamma_n + 1), &
          0.5_wp*m*0.25_wp, 1.0e-3_wp*m)
      end associate
      call check('springs back', world%blocks%v(3, 1), 0.5_wp, 1.0e-3_wp)
    end do
    world%case%contact%eta_n = 5.0_wp
    call begin(world%case, world, damped)
    call move(damped, 200, 1.0e-5_wp)
    call check('damped', damped%blocks%v(3, 1) > 0.05_wp .and. damped%blocks%v(3, 1) < 0.45_wp)
  end subroutine check_constants

  !> A sliding floor drags a cube along; what a moved body pushes is in test_motion.py.
  subroutine check_moving_floor()
    type(world_t) :: world

    call start('', tank//'&boundary z_min="no_slip" z_min_velocity=.2,-.1,0/ '//cube &
      //body('cube', middle), world)
    world%blocks%x(3, 1) = lowest(world%shapes(1), upright)
    call move(world, 20, dt)
    call check('dragged by mu g', norm2(world%blocks%v(1:2, 1)), 0.4_wp*g*20*dt, 5.0e-3_wp)
    call move(world, 200, dt)
    call check('moves with the floor', world%blocks%v(:, 1), [0.2_wp, -0.1_wp, 0.0_wp], 1.0e-6_wp)
  end subroutine check_moving_floor

  !> Two balls collide through a periodic side as they do in the middle.
  subroutine check_periodic_image()
    type(world_t) :: inner, outer

    call start('friction=.3', space//'&boundary x_min="periodic" x_max="periodic"/ '//ball &
      //body('ball', middle)//body('ball', middle + [1.02_wp*d, 0.2_wp*d, 0.0_wp], &
      [-0.5_wp, 0.0_wp, 0.0_wp]), inner)
    inner%case%body%position(1) = [0.99_wp, 0.99_wp + 1.02_wp*d - 1.0_wp]
    call begin(inner%case, inner, outer)
    call move(inner, 10, dt)
    call move(outer, 10, dt)
    call check('met', inner%blocks%v(1, 1) < -0.1_wp)
    call check('same velocities', inner%blocks%v - outer%blocks%v, 0.0_wp, 1.0e-10_wp)
    call check('same spins', inner%blocks%omega - outer%blocks%omega, 0.0_wp, 1.0e-8_wp)
  end subroutine check_periodic_image

  !> A pile moves the same to the last bit however often the lists are made anew, and from the state
  !! of a restart: poses, momenta, displacements and who sleeps.
  subroutine check_bookkeeping()
    type(world_t) :: one, two
    character(:), allocatable :: bodies
    integer :: b, n

    bodies = ''
    do b = 1, 6
      bodies = bodies//body('plain', [0.02_wp*(1 + mod(b, 2)), 0.025_wp, 0.03_wp*b], &
        q=random_rotation(4, b), more=trim(merge('release_time=1', '              ', b == 6)))
    end do
    call start('sleep=T', '&grid cells=3*2 length=.06,.05,1/ &fluid gravity=1,0,-9.81/ ' &
      //'&shape name="plain" kind="cube" size=.02 refinement=1/ '//bodies, one)
    call begin(one%case, one, two)
    select type (contacts => two%contacts)
    type is (springs_t)
      contacts%spheres%skin = contacts%spheres%skin - 1.98_wp*contacts%spheres%valid_way
      contacts%spheres%valid_way = 0.01_wp*contacts%spheres%valid_way
    type is (impulses_t)
      contacts%surface%search%skin = 0.1_wp*contacts%surface%search%skin
    end select
    do n = 1, 3
      call move(one, 40, 1.0e-2_wp)
      call move(two, 40, 1.0e-2_wp)
      call check('same bits with another skin', same(one%blocks, two%blocks))
      call check('touching', sum(one%blocks%contacts) > 5)
      call choose_contact(two%case%contact, two%blocks, two%contacts)   ! as after a restart
      two%contacts%displacements = one%contacts%displacements
      two%contacts%sleep%quiet = one%contacts%sleep%quiet
      two%contacts%sleep%frozen = one%contacts%sleep%frozen
      if (n == 1) then
        call release_body(0.4_wp, 6, one%blocks)
        call release_body(0.4_wp, 6, two%blocks)
      end if
    end do
    two%contacts%displacements%xi = 0.0_wp
    two%contacts%sleep%frozen%force = 0.0_wp   ! where they sleep
    call move(one, 1, dt)
    call move(two, 1, dt)
    call check('the displacements matter', .not. same(one%blocks, two%blocks))
  end subroutine check_bookkeeping

  !> Whether two states are equal to the last bit.
  pure logical function same(a, b) result(yes)
    type(blocks_t), intent(in) :: a, b

    yes = all(abs(a%x - b%x) <= 0.0_wp) .and. all(abs(a%q - b%q) <= 0.0_wp) &
      .and. all(abs(a%v - b%v) <= 0.0_wp) .and. all(abs(a%l - b%l) <= 0.0_wp) &
      .and. all(abs(a%contact_force - b%contact_force) <= 0.0_wp)
  end function same

  !> A speed beyond all bounds is reported, not followed; and the Courant limit shortens the
  !! substeps.
  subroutine check_runaway()
    type(world_t) :: world

    call start(smooth//'.3', space//ball//body('ball', middle, -100.0_wp*up), world)
    call move(world, 1, dt)
    call check('substeps by C_s, one where nothing is near', world%contact%substeps, &
      merge(100, 1, models(model) == 'spheres'))   ! v dt/(0.1 d)
    call check('nothing wrong', world%contact%info, 0)
    call start(smooth//'.3', space//ball//body('ball', middle, 1.0e10_wp*up), world)
    call move(world, 1, dt)
    call check('runaway', world%contact%info, 1)
  end subroutine check_runaway

end module test_contacts_m
