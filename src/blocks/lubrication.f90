!> The film of liquid that the grid does not resolve between a sphere and what it is about to touch.
module lubrication_m
  use kinds_m, only: wp, pi
  use vectors_m, only: norm
  use rigid_body_m, only: blocks_t
  use walls_m, only: walls_t
  use bed_m, only: bed_partner
  use neighbours_m, only: nearest_shift
  implicit none
  private
  public :: lubrication_t, lubrication_init, lubricate, film_impulse, film_pull

  real(wp), parameter :: roughness = 1.0e-3_wp   !! thinnest film over the radius of the sphere [-]
  real(wp), parameter :: atmosphere = 101325.0_wp   !! [Pa]

  type :: lubrication_t
    logical :: active = .false.
    real(wp) :: viscosity = 0.0_wp       !! of the liquid [Pa s]
    real(wp) :: resolved = 0.0_wp        !! films thicker than this are left to the grid [m]
    real(wp), allocatable :: radius(:)   !! (n) of a sphere; 0: no sphere, no film [m]
  end type lubrication_t

contains

  !> Films of liquid around all spheres of a run.
  subroutine lubrication_init(viscosity, resolved, blocks, lubrication)
    real(wp), intent(in) :: viscosity   !! of the liquid [Pa s]
    real(wp), intent(in) :: resolved    !! films thicker than this are left to the grid [m]
    type(blocks_t), intent(in) :: blocks
    type(lubrication_t), intent(out) :: lubrication
    integer :: b

    lubrication%active = .true.
    lubrication%viscosity = viscosity
    lubrication%resolved = resolved
    allocate (lubrication%radius(blocks%n), source=0.0_wp)
    do b = 1, blocks%n
      associate (shape => blocks%shapes(blocks%shape(b)))
        if (shape%kind == 'sphere') lubrication%radius(b) = shape%sphere_radius(1)
      end associate
    end do
  end subroutine lubrication_init

  !> Add the forces of the films of all spheres in the middle of a substep.
  !!
  !! Normal approach only: the resistance to sliding grows with the logarithm of the gap and is left
  !! out. A slip wall is a mirror: its film resists like that of two spheres, a quarter.
  subroutine lubricate(walls, blocks, dt, lubrication, force)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(in) :: dt                        !! substep [s]
    type(lubrication_t), intent(in) :: lubrication
    real(wp), intent(inout) :: force(:, bed_partner:) !! (3, partners) of all partners [N]
    real(wp) :: d(3), n(3), f(3), gap, distance, radius
    integer :: a, b, w

    do a = 1, blocks%n
      if (lubrication%radius(a) <= 0.0_wp .or. .not. blocks%present(a)) cycle
      do w = 1, walls%n
        n = walls%normal(:, w)
        gap = walls%offset(w) - dot_product(n, blocks%x(:, a)) - lubrication%radius(a)
        if (gap >= lubrication%resolved) cycle
        f = push(lubrication, merge(0.5_wp, 1.0_wp, walls%slip(w))*lubrication%radius(a), gap, &
                 -dot_product(n, blocks%v(:, a)), inverse_mass(blocks, a), dt)*n
        force(:, a) = force(:, a) - f
        force(:, walls%number(w)) = force(:, walls%number(w)) + f
      end do
      do b = a + 1, blocks%n
        if (lubrication%radius(b) <= 0.0_wp .or. .not. blocks%present(b)) cycle
        d = blocks%x(:, b) - blocks%x(:, a)
        d = d + nearest_shift(walls%period, d)
        distance = norm(d)
        gap = distance - lubrication%radius(a) - lubrication%radius(b)
        if (gap >= lubrication%resolved .or. distance <= 0.0_wp) cycle
        n = d/distance
        radius = lubrication%radius(a)*lubrication%radius(b) &
          /(lubrication%radius(a) + lubrication%radius(b))
        f = push(lubrication, radius, gap, dot_product(n, blocks%v(:, b) - blocks%v(:, a)), &
                 inverse_mass(blocks, a) + inverse_mass(blocks, b), dt)*n
        force(:, a) = force(:, a) - f
        force(:, b) = force(:, b) + f
      end do
    end do
  end subroutine lubricate

  !> Force that drives the two sides of a film apart; negative where it holds them together [N].
  !!
  !! The resistance is its mean over the gaps that the substep passes, and acts on the velocity in
  !! the middle of the substep, which the force itself changes (implicit midpoint rule).
  pure function push(lubrication, radius, gap, opening, inverse, dt) result(f)
    type(lubrication_t), intent(in) :: lubrication
    real(wp), intent(in) :: radius    !! a b/(a + b) of the two sides [m]
    real(wp), intent(in) :: gap       !! in the middle of the substep [m]
    real(wp), intent(in) :: opening   !! rate at which the gap opens [m/s]
    real(wp), intent(in) :: inverse   !! sum of the inverse masses [1/kg]
    real(wp), intent(in) :: dt        !! [s]
    real(wp) :: f
    real(wp) :: half, resistance, thinnest

    thinnest = roughness*radius
    half = max(0.5_wp*dt*abs(opening), 1.0e-3_wp*thinnest)
    resistance = (film_impulse(lubrication, radius, gap + half) &
      - film_impulse(lubrication, radius, gap - half))/(2*half)
    if (opening > 0.0_wp) resistance = min(resistance, &
                                           film_pull(lubrication, radius, gap, opening)/opening)
    f = -resistance*opening/(1.0_wp + 0.5_wp*resistance*inverse*dt)
  end function push

  !> What a film takes from the momentum between the two sides while it opens from nothing to a gap.
  !!
  !! Its resistance is \( 6\pi\mu R^2 (1/h - 1/h_0) \) between the roughness and h_0, where the grid
  !! takes over, and that of the roughness below; none while the sides touch, for the touch lasts
  !! longer than it does in truth.
  !!
  !! Source: leading term of Brenner (1961), Chem. Eng. Sci. 16, 242, for a sphere and a plane.
  pure function film_impulse(lubrication, radius, gap) result(impulse)
    type(lubrication_t), intent(in) :: lubrication
    real(wp), intent(in) :: radius, gap   !! [m]
    real(wp) :: impulse                   !! [N s]
    real(wp) :: thinnest, h

    thinnest = min(roughness*radius, lubrication%resolved)
    h = min(max(gap, 0.0_wp), lubrication%resolved)
    impulse = min(h, thinnest)*(1/thinnest - 1/lubrication%resolved)
    if (h > thinnest) impulse = impulse + log(h/thinnest) - (h - thinnest)/lubrication%resolved
    impulse = 6*pi*lubrication%viscosity*radius**2*impulse
  end function film_impulse

  !> Largest force with which a film that opens can pull [N].
  !!
  !! The liquid bears no tension: where the suction \( 3\mu R v/s^2 \) in a film as thick as s
  !! passes the pressure of the atmosphere, it cavitates. With s_0 the thickness where it just does,
  !! \( F = 2\pi R [p (s_0 - h) + 3\mu R v/s_0] \) for h < s_0, the integral over the film; less
  !! what the grid resolves.
  pure function film_pull(lubrication, radius, gap, opening) result(force)
    type(lubrication_t), intent(in) :: lubrication
    real(wp), intent(in) :: radius, gap   !! [m]
    real(wp), intent(in) :: opening       !! rate at which the gap opens, > 0 [m/s]
    real(wp) :: force
    real(wp) :: h, s

    h = min(max(gap, roughness*radius), lubrication%resolved)
    s = max(h, sqrt(3*lubrication%viscosity*radius*opening/atmosphere))
    force = 2*pi*radius*(atmosphere*(s - h) &
      + 3*lubrication%viscosity*radius*opening*(1/s - 1/lubrication%resolved))
    force = max(0.0_wp, force)
  end function film_pull

  !> One over the mass of a body, 0 if it is held [1/kg].
  pure function inverse_mass(blocks, b) result(inverse)
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: b
    real(wp) :: inverse

    inverse = merge(0.0_wp, 1.0_wp/blocks%mass(b), blocks%fixed(b))
  end function inverse_mass

end module lubrication_m
