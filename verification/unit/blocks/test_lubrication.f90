!> Films between spheres and walls: what they take from a fall, whom they push, and where they end.
module test_lubrication_m
  use check_m, only: check, wp, pi
  use bed_m, only: bed_counterpart
  use lubrication_m, only: lubrication_init, lubricate, film_resistance, film_impulse, film_pull
  use world_m, only: world_t, set_up, body, move
  implicit none
  private
  public :: test_lubrication

  real(wp), parameter :: d = 0.006_wp           !! diameter of the spheres [m]
  real(wp), parameter :: mu = 0.1_wp            !! [Pa s]
  real(wp), parameter :: cell = d/10            !! [m]
  real(wp), parameter :: a = sqrt(2.0_wp)*cell  !! film of which twice as much passes [m]
  real(wp), parameter :: dt = 5.0e-4_wp         !! [s]
  real(wp), parameter :: restitution = 0.9_wp
  real(wp), parameter :: p = 101325.0_wp        !! outside of films that cavitate [Pa]

contains

  subroutine test_lubrication()
    call check_resistance()
    call check_fall('no_slip', 1)
    call check_fall('slip', 2)
    call check_bounce('spheres')
    call check_bounce('surface')
    call check_pair()
    call check_swarm()
    call check_cavitation()
  end subroutine test_lubrication

  !> Spheres in a tank of 1 m without gravity, and films.
  subroutine start(kind, x, v, world, model)
    character(*), intent(in) :: kind          !! of the floor
    real(wp), intent(in) :: x(:, :), v(:, :)  !! (3, n)
    type(world_t), intent(out) :: world
    character(*), intent(in), optional :: model
    character(:), allocatable :: text
    integer :: b

    text = '&run t_end=1 physics="dry"/ &grid cells=3*2 length=3*1/ &boundary z_min="'//kind &
      //'"/ &fluid gravity=3*0 liquid_viscosity=.1/ &shape name="ball" kind="sphere" size=.006 ' &
      //'density=7800/ &contact restitution=.9 contact_time=1e-4 '
    if (present(model)) text = text//'model="'//model//'"'
    text = text//'/ '
    do b = 1, size(x, 2)
      text = text//body('ball', x(:, b), v(:, b))
    end do
    call set_up(text, world)
    call lubrication_init(world%case, spread(cell, 1, 3), world%blocks, world%contacts%lubrication)
  end subroutine start

  !> The resistance is what plates at the thickness of the film say the grid misses, summed over the
  !! film, and all of it in the thinnest films; the impulse is its integral.
  subroutine check_resistance()
    real(wp), parameter :: share(4) = [0.02_wp, 0.1_wp, 0.7_wp, 2.5_wp]
    integer, parameter :: n = 200000
    real(wp) :: h, s, t, found, expected, step
    integer :: i, j

    do i = 1, size(share)
      h = share(i)*cell
      expected = 0.0_wp
      do j = 1, n   ! s = h/t, ds = h/t^2 dt
        t = (real(j, wp) - 0.5_wp)/real(n, wp)
        s = h/t
        expected = expected + 12*pi*mu*(d/2)**2*(s - h)*(1/s**3 - 1/(s**3*(1 + 2*(cell/s)**2))) &
                                                       *h/t**2/real(n, wp)
      end do
      found = film_resistance(mu, d/2, a, h)
      call check('resistance of a film', found, expected, 1.0e-6_wp*expected)
      step = 1.0e-4_wp*h
      found = (film_impulse(mu, d/2, a, h + step) - film_impulse(mu, d/2, a, h - step))/(2*step)
      call check('change of the impulse', found, expected, 1.0e-6_wp*expected)
    end do
    h = 1.0e-3_wp*d/2
    call check('a thin film', film_resistance(mu, d/2, 1.0e3_wp*d, h), 6*pi*mu*(d/2)**2/h, &
               1.0e-3_wp*6*pi*mu*(d/2)**2/h)
    call check('none below', film_impulse(mu, d/2, a, -h), 0.0_wp)
  end subroutine check_resistance

  !> A sphere that flies on to a wall loses what the film takes, just once on its way.
  subroutine check_fall(kind, sides)
    character(*), intent(in) :: kind
    integer, intent(in) :: sides   !! 2: the wall is a mirror
    real(wp), parameter :: v = 0.5_wp
    type(world_t) :: world
    real(wp) :: expected, gap
    integer :: i

    call start(kind, reshape([0.5_wp, 0.5_wp, d/2 + 5*cell], [3, 1]), &
               reshape([0.0_wp, 0.0_wp, -v], [3, 1]), world)
    do i = 1, 4000
      call move(world, 1, 2.5e-6_wp)
      gap = world%blocks%x(3, 1) - d/2
      if (gap < 0.02_wp*cell) exit
    end do
    expected = v - (film_impulse(mu, d/2/sides, a, 4*cell) &
      - film_impulse(mu, d/2/sides, a, sides*gap))/world%blocks%mass(1)
    call check(kind//': speed lost', -world%blocks%v(3, 1), expected, 1.0e-3_wp*(v - expected))
    call check(kind//': not touched yet', world%blocks%contacts(1), 0)
  end subroutine check_fall

  !> A sphere that bounces loses what the film takes on both ways, below one step's way, too.
  subroutine check_bounce(model)
    character(*), intent(in) :: model
    real(wp), parameter :: v = 0.3_wp, dh = 1.0e-8_wp
    type(world_t) :: world
    real(wp) :: expected, h
    integer :: i

    call start('no_slip', reshape([0.5_wp, 0.5_wp, d/2 + 4.1_wp*cell], [3, 1]), &
               reshape([0.0_wp, 0.0_wp, -v], [3, 1]), world, model)
    do i = 1, 100000
      call move(world, 1, 2.0e-6_wp)
      if (world%blocks%v(3, 1) > 0.0_wp .and. world%blocks%x(3, 1) - d/2 > 4*cell) exit
    end do
    expected = restitution*(v - film_impulse(mu, d/2, a, 4*cell)/world%blocks%mass(1))
    h = 0.5_wp*dh
    do while (h < 4*cell)
      expected = expected - film_pull(p, mu, d/2, a, h, expected)/(world%blocks%mass(1)*expected)*dh
      h = h + dh
    end do
    call check(model//': speed after the bounce', world%blocks%v(3, 1), expected, 0.003_wp*v)
  end subroutine check_bounce

  !> Two spheres that part hold one another back, with opposite forces, along the line of centres.
  subroutine check_pair()
    type(world_t) :: world
    real(wp) :: before(3), after(3), expected, gap(2), n(3)

    n = [0.6_wp, 0.0_wp, 0.8_wp]
    call start('no_slip', reshape([0.5_wp + 0*n, 0.5_wp + (d + 0.3_wp*cell)*n], [3, 2]), &
               reshape([0.0_wp, 0.0_wp, 0.0_wp, 0.1_wp*n], [3, 2]), world)
    before = world%blocks%v(:, 1) + world%blocks%v(:, 2)
    gap(1) = 0.3_wp*cell
    call move(world, 1, dt)
    after = world%blocks%v(:, 1) + world%blocks%v(:, 2)
    gap(2) = norm2(world%blocks%x(:, 2) - world%blocks%x(:, 1)) - d
    call check('momentum of a pair', after, before, 1.0e-15_wp)
    expected = 0.1_wp - 2*(film_impulse(mu, d/4, a, gap(2)) &
      - film_impulse(mu, d/4, a, gap(1)))/world%blocks%mass(1)
    call check('speed of parting', dot_product(world%blocks%v(:, 2) - world%blocks%v(:, 1), n), &
               expected, 1.0e-3_wp*(0.1_wp - expected))
    call check('contact force tells it', world%blocks%contact_force(:, 2)*dt/world%blocks%mass(2), &
               world%blocks%v(:, 2) - 0.1_wp*n, 1.0e-12_wp)
  end subroutine check_pair

  !> In a swarm each sphere feels the films of all its neighbours, those across a period too, and of
  !! nobody else: the forces are those of all pairs, each alone in the tank.
  subroutine check_swarm()
    integer, parameter :: n = 40
    real(wp), parameter :: capacity = 4*d   ! of the swarm, astride the periodic side [m]
    type(world_t) :: world
    real(wp) :: x(3, n), v(3, n), force(3, bed_counterpart:n), pair(3, bed_counterpart:2), &
      expected(3, n)
    integer :: i, j, active

    call random_number(x)
    call random_number(v)
    x = 0.5_wp + capacity*(x - 0.5_wp)
    x(1, :) = modulo(x(1, :) - 0.5_wp, 1.0_wp)
    v = v - 0.5_wp
    expected = 0.0_wp
    active = 0
    do i = 1, n
      do j = i + 1, n
        call start('no_slip', x(:, [i, j]), v(:, [i, j]), world)
        world%walls%period = [1.0_wp, 0.0_wp, 0.0_wp]
        world%walls%n = 0
        pair = 0.0_wp
        call lubricate(world%walls, world%blocks, dt, 0.0_wp, world%contacts%lubrication, pair)
        expected(:, i) = expected(:, i) + pair(:, 1)
        expected(:, j) = expected(:, j) + pair(:, 2)
        if (norm2(pair(:, 1)) > 0.0_wp) active = active + 1
      end do
    end do
    call start('no_slip', x, v, world)
    world%walls%period = [1.0_wp, 0.0_wp, 0.0_wp]
    world%walls%n = 0
    force = 0.0_wp
    call lubricate(world%walls, world%blocks, dt, 0.0_wp, world%contacts%lubrication, force)
    call check('some pairs have a film, most have none', active > n/2 .and. active < n*(n - 1)/4)
    do i = 1, n
      call check('of the swarm', force(:, i), expected(:, i), 1.0e-12_wp*maxval(abs(expected)))
    end do
  end subroutine check_swarm

  !> A film that opens pulls with its own resistance, or with the atmosphere where it is too thin:
  !! the suction, capped, summed over the film.
  subroutine check_cavitation()
    real(wp), parameter :: v = 0.25_wp
    integer, parameter :: n = 200000
    real(wp) :: h, s, t, force
    integer :: i

    h = 0.4_wp*cell
    call check('thick film', film_pull(p, mu, d/2, a, h, v), film_resistance(mu, d/2, a, h)*v, &
               1.0e-12_wp*film_resistance(mu, d/2, a, h)*v)
    h = 1.0e-2_wp*cell
    force = 0.0_wp
    do i = 1, n   ! s = h/t, ds = h/t^2 dt
      t = (real(i, wp) - 0.5_wp)/real(n, wp)
      s = h/t
      force = force + 2*pi*(d/2)*min(p, 3*mu*(d/2)*v/s**2)*h/t**2/real(n, wp)
    end do
    force = force - (6*pi*mu*(d/2)**2/h - film_resistance(mu, d/2, a, h))*v
    call check('thin film', film_pull(p, mu, d/2, a, h, v), force, 1.0e-4_wp*force)
    call check('lengths times 4, times times 2, masses times 64', film_pull(4*p, 8*mu, 2*d, 4*a, &
      4*h, 2*v), 64*film_pull(p, mu, d/2, a, h, v), 0.0_wp)
  end subroutine check_cavitation

end module test_lubrication_m
