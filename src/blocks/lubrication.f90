!> The film of liquid that the grid does not resolve between a sphere and what it is about to touch.
!!
!! Between plates N cells apart the grid lets pass 1 + 2/N^2 times what it should. In the thin film
!! under a sphere that is a pressure gradient too small by as much, everywhere; its integral is what
!! is missing of the resistance, at any thickness, without a constant (docs/theory.md, section 11).
module lubrication_m
  use kinds_m, only: wp, pi
  use vectors_m, only: norm
  use case_types_m, only: case_t
  use rigid_body_m, only: blocks_t
  use walls_m, only: walls_t
  use bed_m, only: bed_counterpart
  use neighbours_m, only: pair_list_t, near_pairs, nearest_shift
  implicit none
  private
  public :: lubrication_t, lubrication_init, lubricate, film_resistance, film_impulse, film_pull

  real(wp), parameter :: roughness = 1.0e-3_wp   !! thinnest film over the radius of the sphere [-]
  real(wp), parameter :: cutoff = 4.0_wp   !! of films: the grid misses 2 % of thicker ones [cells]

  type :: lubrication_t
    real(wp) :: viscosity = 0.0_wp       !! of the liquid [Pa s]
    real(wp) :: cavitation = 0.0_wp      !! suction at which it cavitates [Pa]
    real(wp) :: h(3) = 0.0_wp            !! edges of a cell [m]
    real(wp), allocatable :: radius(:)   !! (n) of a sphere, else 0; not allocated: no films [m]
    type(pair_list_t), private :: near   !! spheres with a film between them
  end type lubrication_t

contains

  !> Films of liquid around all spheres of a run.
  subroutine lubrication_init(case, h, blocks, lubrication)
    type(case_t), intent(in) :: case
    real(wp), intent(in) :: h(3)   !! edges of a cell [m]
    type(blocks_t), intent(in) :: blocks
    type(lubrication_t), intent(out) :: lubrication
    integer :: b

    lubrication%viscosity = case%fluid%liquid_viscosity
    lubrication%cavitation = case%contact%cavitation_pressure
    lubrication%h = h
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
  !! out.
  subroutine lubricate(walls, blocks, dt, ahead, lubrication, force)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(in) :: dt                        !! substep [s]
    real(wp), intent(in) :: ahead                     !! time until its middle [s]
    type(lubrication_t), intent(inout) :: lubrication
    real(wp), intent(inout) :: force(:, bed_counterpart:)
      !! (3, counterparts) of all counterparts [N]
    real(wp), parameter :: round_off = 1.0e-9_wp
    logical :: active(blocks%n)
    real(wp) :: f(3), d(3), n(3), gap, sides, opening
    integer :: a, b, p, w

    active = blocks%present(:blocks%n) .and. lubrication%radius > 0.0_wp
    associate (near => lubrication%near)
      call near_pairs(blocks%x(:, :blocks%n), lubrication%radius, active, walls%period, &
                      (1.0_wp + round_off)*cutoff*maxval(lubrication%h), near)
      p = 1
      do a = 1, blocks%n
        if (.not. active(a)) cycle
        do while (p <= near%n)
          if (near%a(p) /= a) exit
          b = near%b(p)
          d = blocks%x(:, a) - blocks%x(:, b)
          d = d + nearest_shift(walls%period, d)
          n = d/max(norm(d), tiny(1.0_wp))
          associate (r_a => lubrication%radius(a), r_b => lubrication%radius(b))
            opening = dot_product(n, blocks%v(:, a) - blocks%v(:, b))
            f = push(lubrication, r_b*r_a/(r_b + r_a), n, norm(d) - r_b - r_a + ahead*opening, &
                     opening, inverse_mass(blocks, b) + inverse_mass(blocks, a), dt)*n
          end associate
          force(:, b) = force(:, b) - f
          force(:, a) = force(:, a) + f
          p = p + 1
        end do
        ! Films between sphere a and the walls. A slip wall is a mirror: behind it comes a second
        ! sphere, as fast, at twice the gap.
        do w = 1, walls%n
          n = walls%normal(:, w)
          gap = walls%offset(w) - dot_product(n, blocks%x(:, a)) - lubrication%radius(a)
          sides = merge(2.0_wp, 1.0_wp, walls%slip(w))
          opening = -sides*dot_product(n, blocks%v(:, a))
          f = push(lubrication, lubrication%radius(a)/sides, n, sides*gap + ahead*opening, &
                   opening, sides*inverse_mass(blocks, a), dt)*n
          force(:, a) = force(:, a) - f
          force(:, walls%number(w)) = force(:, walls%number(w)) + f
        end do
      end do
    end associate
  end subroutine lubricate

  !> Force that drives the two sides of a film apart; negative where it holds them together [N].
  !!
  !! The resistance is its mean over the gaps that the substep passes, and acts on the velocity in
  !! the middle of the substep, which the force itself changes (implicit midpoint rule).
  pure function push(lubrication, radius, n, gap, opening, inverse, dt) result(f)
    type(lubrication_t), intent(in) :: lubrication
    real(wp), intent(in) :: radius    !! a b/(a + b) of the two sides [m]
    real(wp), intent(in) :: n(3)      !! unit vector across the film
    real(wp), intent(in) :: gap       !! in the middle of the substep [m]
    real(wp), intent(in) :: opening   !! rate at which the gap opens [m/s]
    real(wp), intent(in) :: inverse   !! sum of the inverse masses [1/kg]
    real(wp), intent(in) :: dt        !! [s]
    real(wp) :: f
    real(wp) :: cell, a, half, resistance

    cell = norm(n*lubrication%h)
    f = 0.0_wp
    if (gap >= cutoff*cell .or. .not. cell > 0.0_wp) return
    a = sqrt(2.0_wp)*cell
    half = max(0.5_wp*dt*abs(opening), 1.0e-3_wp*roughness*radius)
    associate (mu => lubrication%viscosity, p => lubrication%cavitation)
      resistance = (film_impulse(mu, radius, a, gap + half) &
        - film_impulse(mu, radius, a, gap - half))/(2*half)
      if (opening > 0.0_wp) resistance = min(resistance, &
        film_pull(p, mu, radius, a, gap, opening)/opening)
    end associate
    f = -resistance*opening/(1.0_wp + 0.5_wp*resistance*inverse*dt)
  end function push

  !> What the grid misses of the resistance of a film [N s/m].
  !!
  !! Of the pressure gradient 6 mu r v/s^3 where the film is s thick the grid has
  !! 6 mu r v/(s^3 + a^2 s), where a is the thickness of which it lets pass twice what it should,
  !! sqrt(2) cells. The difference, summed over the film:
  !! \( 6\pi\mu R^2 [1/h - (2/a) \arctan(a/h) + (h/a^2) \ln(1 + a^2/h^2)] \).
  !!
  !! Source: leading term of Brenner (1961), Chem. Eng. Sci. 16, 242, for a sphere and a plane, the
  !! first part; the rest is ours.
  pure function film_resistance(viscosity, radius, a, gap) result(resistance)
    real(wp), intent(in) :: viscosity   !! of the liquid [Pa s]
    real(wp), intent(in) :: radius, a   !! [m]
    real(wp), intent(in) :: gap         !! > 0 [m]
    real(wp) :: resistance

    resistance = 6*pi*viscosity*radius**2 &
      *(1/gap - 2/a*atan(a/gap) + gap/a**2*log(1.0_wp + (a/gap)**2))
  end function film_resistance

  !> What a film takes from the momentum between the two sides while it opens from nothing to a gap:
  !! the integral of `film_resistance` down to the roughness, and below that of the roughness; none
  !! while the sides touch, for the contact lasts longer than it does in truth [N s].
  pure function film_impulse(viscosity, radius, a, gap) result(impulse)
    real(wp), intent(in) :: viscosity        !! of the liquid [Pa s]
    real(wp), intent(in) :: radius, a, gap   !! [m]
    real(wp) :: impulse
    real(wp) :: thinnest

    thinnest = roughness*radius
    impulse = min(max(gap, 0.0_wp), thinnest)*film_resistance(viscosity, radius, a, thinnest)
    if (gap > thinnest) then
      impulse = impulse + 6*pi*viscosity*radius**2*(integral(gap) - integral(thinnest))
    end if
  contains
    !> Of what stands in the brackets of `film_resistance`.
    pure real(wp) function integral(h)
      real(wp), intent(in) :: h

      integral = -2*h/a*atan(a/h) - 0.5_wp*(1.0_wp - (h/a)**2)*log(1.0_wp + (a/h)**2)
    end function integral
  end function film_impulse

  !> Largest force with which a film that opens can pull [N].
  !!
  !! The liquid bears no tension: where the suction \( 3\mu R v/s^2 \) in a film as thick as s
  !! passes the pressure p outside, it cavitates. With s_0 the thickness where it just does,
  !! \( F = 2\pi R [p (s_0 - h) + 3\mu R v/s_0] \) for h < s_0, the integral over the film; less
  !! what the grid resolves.
  pure function film_pull(p, viscosity, radius, a, gap, opening) result(force)
    real(wp), intent(in) :: p, viscosity     !! outside, of the liquid [Pa], [Pa s]
    real(wp), intent(in) :: radius, a, gap   !! [m]
    real(wp), intent(in) :: opening          !! rate at which the gap opens, > 0 [m/s]
    real(wp) :: force, h, s, less

    h = max(gap, roughness*radius)
    s = max(h, sqrt(3*viscosity*radius*opening/p))
    less = 6*pi*viscosity*radius**2/h - film_resistance(viscosity, radius, a, h)
    force = max(0.0_wp, 2*pi*radius*(p*(s - h) + 3*viscosity*radius*opening/s) - less*opening)
  end function film_pull

  !> One over the mass of a body, 0 if it is held [1/kg].
  pure function inverse_mass(blocks, b) result(inverse)
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: b
    real(wp) :: inverse

    inverse = merge(0.0_wp, 1.0_wp/blocks%mass(b), blocks%fixed(b))
  end function inverse_mass

end module lubrication_m
