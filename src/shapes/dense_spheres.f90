!> Contact spheres that touch the surface of a block from inside, independent of its tetrahedra.
!!
!! On every facet stand points on rings parallel to its border, a quarter of the spacing and then
!! whole spacings inward. Each carries the largest ball that touches the facet there and stays
!! inside the block, up to two spacings in radius. Near an edge the balls are small and lie close to
!! it, inside a face they are large and make it smooth.
!!
!! Departure from the paper, which names dense spheres as an improvement and says no more.
module dense_spheres_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use vectors_m, only: norms, cross, norm
  use polygon_m, only: area_vector
  use tet_mesh_m, only: shape_t, max_facet_corners
  implicit none
  private
  public :: place_densely

  real(wp), parameter :: first_ring = 0.25_wp    !! distance of the first ring [spacing]
  real(wp), parameter :: largest = 2.0_wp        !! radius of the largest ball [spacing]
  real(wp), parameter :: smallest = 0.1_wp       !! smaller balls are left out [spacing]
  real(wp), parameter :: alike = 0.3_wp          !! difference of balls that are one [spacing]
  integer, parameter :: max_clip_corners = 2*max_facet_corners

  !> The facets as loose polygons.
  type :: facets_t
    integer :: n = 0
    integer, allocatable :: corners(:)
    real(wp), allocatable :: x(:, :, :)      !! (3, corners, facets) [m]
    real(wp), allocatable :: normal(:, :)    !! (3, facets) outward
    real(wp), allocatable :: middle(:, :), bounding_radius(:)   !! bounding spheres [m]
  end type facets_t

contains

  !> Fill `sphere_centre` and `sphere_radius` of a shape.
  pure subroutine place_densely(spacing, shape)
    real(wp), intent(in) :: spacing   !! [m]
    type(shape_t), intent(inout) :: shape
    type(facets_t) :: facets
    real(wp), allocatable :: ball(:, :)   ! (4, *) centre and radius
    real(wp) :: polygon(3, max_clip_corners), p(3), side(3)
    integer :: n, n_ball, m, ring, c, k, parts

    facets%n = size(shape%facet) - 1
    facets%corners = shape%facet(2:) - shape%facet(:facets%n)
    allocate (facets%x(3, maxval(facets%corners), facets%n), facets%normal(3, facets%n))
    allocate (facets%middle(3, facets%n), facets%bounding_radius(facets%n))
    do m = 1, facets%n
      n = facets%corners(m)
      facets%x(:, :n, m) = shape%point(:, shape%facet_point(shape%facet(m):shape%facet(m + 1) - 1))
      associate (x => facets%x(:, :n, m))
        facets%middle(:, m) = sum(x, 2)/real(n, wp)
        facets%bounding_radius(m) = maxval(norms(x - spread(facets%middle(:, m), 2, n)))
        facets%normal(:, m) = area_vector(x)/norm(area_vector(x))
      end associate
    end do
    allocate (ball(4, 64))
    n_ball = 0
    do m = 1, facets%n
      ring = 0
      do
        call inset(facets%x(:, :facets%corners(m), m), facets%normal(:, m), &
                   spacing*merge(first_ring, real(ring, wp), ring == 0), polygon, n)
        if (n < 3) exit
        do c = 1, n
          side = polygon(:, 1 + mod(c, n)) - polygon(:, c)
          parts = max(1, ceiling(norm(side)/spacing))
          do k = 0, parts - 1
            p = polygon(:, c) + real(k, wp)/real(parts, wp)*side
            call add_ball(p, m, facets, spacing, ball, n_ball)
          end do
        end do
        ring = ring + 1
      end do
      if (ring == 0) call add_ball(facets%middle(:, m), m, facets, spacing, ball, n_ball)
    end do
    shape%sphere_centre = ball(1:3, :n_ball)
    shape%sphere_radius = ball(4, :n_ball)
  end subroutine place_densely

  !> The part of a convex polygon farther than `distance` from each of its sides; n < 3 if none.
  pure subroutine inset(x, normal, distance, part, n)
    real(wp), intent(in) :: x(:, :), normal(3), distance
    real(wp), intent(out) :: part(3, max_clip_corners)
    integer, intent(out) :: n
    real(wp) :: old(3, max_clip_corners), h(max_clip_corners), inward(3), side(3)
    integer :: c, k, next, m

    n = size(x, 2)
    part(:, :n) = x
    do c = 1, size(x, 2)
      side = x(:, 1 + mod(c, size(x, 2))) - x(:, c)
      inward = cross(normal, side/norm(side))
      m = n
      old(:, :m) = part(:, :m)
      do k = 1, m
        h(k) = dot_product(old(:, k) - x(:, c), inward) - distance
      end do
      n = 0
      do k = 1, m
        next = 1 + mod(k, m)
        if (h(k) >= 0.0_wp) then
          n = n + 1
          part(:, n) = old(:, k)
        end if
        if ((h(k) >= 0.0_wp) .neqv. (h(next) >= 0.0_wp)) then
          n = n + 1
          part(:, n) = old(:, k) + h(k)/(h(k) - h(next))*(old(:, next) - old(:, k))
        end if
      end do
      if (n < 3) return
    end do
  end subroutine inset

  !> Add the ball that touches facet m at p, unless it is too small or there is one like it.
  pure subroutine add_ball(p, m, facets, spacing, ball, n)
    real(wp), intent(in) :: p(3), spacing
    integer, intent(in) :: m
    type(facets_t), intent(in) :: facets
    real(wp), allocatable, intent(inout) :: ball(:, :)
    integer, intent(inout) :: n
    real(wp) :: radius, c(3)
    integer :: i

    radius = ball_radius(p, m, facets, largest*spacing)
    if (radius < smallest*spacing) return
    c = p - radius*facets%normal(:, m)
    do i = 1, n
      if (norm(ball(1:3, i) - c) + abs(ball(4, i) - radius) < alike*spacing) return
    end do
    n = n + 1
    call ensure_capacity(n, ball)
    ball(:, n) = [c, radius]
  end subroutine add_ball

  !> Radius of the largest ball inside the block that touches facet m at p, at most `limit`.
  !!
  !! Shrinks the ball until no other facet reaches into it: a ball that touches at p with the
  !! normal n passes through q if its radius is |q - p|^2/(2 n.(p - q)).
  pure function ball_radius(p, m, facets, limit) result(radius)
    real(wp), intent(in) :: p(3), limit
    integer, intent(in) :: m
    type(facets_t), intent(in) :: facets
    real(wp) :: radius
    real(wp), parameter :: tolerance = 1.0e-9_wp
    integer, parameter :: max_rounds = 60
    real(wp) :: c(3), q(3), nearest(3), d, least, height
    integer :: round, f

    radius = limit
    do round = 1, max_rounds
      c = p - radius*facets%normal(:, m)
      least = radius*(1.0_wp - tolerance)
      nearest = p
      do f = 1, facets%n
        if (f == m) cycle
        if (norm(facets%middle(:, f) - c) - facets%bounding_radius(f) >= least) cycle
        if (abs(dot_product(facets%x(:, 1, f) - c, facets%normal(:, f))) >= least) cycle
        q = nearest_on_facet(c, facets%x(:, :facets%corners(f), f), facets%normal(:, f))
        d = norm(q - c)
        if (d >= least) cycle
        least = d
        nearest = q
      end do
      height = dot_product(facets%normal(:, m), p - nearest)
      if (height <= 0.0_wp) return
      radius = min(radius, dot_product(nearest - p, nearest - p)/(2.0_wp*height))
    end do
  end function ball_radius

  !> Point of a convex polygon nearest to c.
  pure function nearest_on_facet(c, x, normal) result(q)
    real(wp), intent(in) :: c(3), x(:, :), normal(3)
    real(wp) :: q(3)
    real(wp) :: side(3), r(3), least, d
    integer :: k, n
    logical :: inside

    n = size(x, 2)
    q = c - dot_product(c - x(:, 1), normal)*normal
    inside = .true.
    do k = 1, n
      side = x(:, 1 + mod(k, n)) - x(:, k)
      if (dot_product(cross(normal, side), q - x(:, k)) < 0.0_wp) inside = .false.
    end do
    if (inside) return
    least = huge(least)
    do k = 1, n
      side = x(:, 1 + mod(k, n)) - x(:, k)
      r = x(:, k) + min(1.0_wp, max(0.0_wp, dot_product(c - x(:, k), side) &
        /dot_product(side, side)))*side
      d = norm(r - c)
      if (d >= least) cycle
      least = d
      q = r
    end do
  end function nearest_on_facet

end module dense_spheres_m
