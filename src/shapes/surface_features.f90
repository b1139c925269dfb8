!> The exact surface of a shape, made ready for contact: what can touch, and what can be touched.
!!
!! What can touch are vertices (corners, and points inside large flat faces) and sharp convex edges.
!! What is touched is the surface itself: flat convex facets and the edges between them
!! (`surface_search_m`).
module surface_features_m
  use kinds_m, only: wp
  use vectors_m, only: norms, cross, norm
  use polygon_m, only: area_vector
  use tet_mesh_m, only: shape_t
  use neighbours_m, only: bins_build
  use surface_search_m, only: surface_t, found_t, search_surface
  use edge_crossing_m, only: edge_t
  implicit none
  private
  public :: surface_init, pair_edges, find_features, set_plane, set_facet, edge_between

  real(wp), parameter :: sharp = 1.0e-3_wp     !! sine by which facets differ at a sharp edge: more
    !! than by the digits of a file, less than on a smooth form that is cut finely
  real(wp), parameter :: flat_sum = 4.0_wp     !! weight of all corners of a flat face together
  real(wp), parameter :: face_sum = 1.0_wp     !! weight of all points inside a flat face
  real(wp), parameter :: inset = 0.36_wp       !! way of these points from the corner to the middle
  real(wp), parameter :: large = 0.01_wp       !! share of the surface of a face that has them

contains

  !> Features of a shape. `min_distance` needs the net of distances.
  subroutine surface_init(shape, surface, with_net)
    type(shape_t), intent(in) :: shape
    type(surface_t), intent(out) :: surface
    logical, intent(in), optional :: with_net   !! default: yes
    integer, allocatable :: edge(:, :)
    real(wp), allocatable :: point_normal(:, :)
    logical, allocatable :: is_corner(:)
    integer :: e, f, m

    if (shape%kind == 'sphere') then
      surface%ball = shape%sphere_radius(1)
      surface%bounding_radius = surface%ball
      surface%length = 2*surface%ball
      allocate (surface%vertex(3, 1), source=0.0_wp)
      allocate (surface%weight(1), source=1.0_wp)
      call bins_build(surface%vertex, surface%vertex, surface%ball, surface%vertices)
      return
    end if
    surface%length = 0.25_wp*shape%smallest_edge
    m = size(shape%facet) - 1   ! planes and sides of the facets
    surface%side = shape%facet
    allocate (surface%normal(3, m), surface%offset(m))
    allocate (surface%side_normal(3, size(shape%facet_point)))
    allocate (surface%side_offset(size(shape%facet_point)))
    do f = 1, m
      associate (a => shape%facet(f), b => shape%facet(f + 1) - 1)
        call set_facet(shape%point(:, corners(shape, f)), surface%normal(:, f), &
          surface%offset(f), surface%side_normal(:, a:b), surface%side_offset(a:b))
      end associate
    end do
    call find_features(shape%point, shape%facet, shape%facet_point, edge, surface%n_convex, &
      point_normal, is_corner)
    m = count(edge(4, :) > 0)
    surface%edge_number = [(e, e=1, m)]
    surface%facet_number = [(m + e, e=1, size(surface%offset))]
    allocate (surface%edge(m), surface%end_outward(3, 2, m))
    do e = 1, m
      surface%edge(e) = edge_between(shape%point(:, edge(1:2, e)), surface%normal(:, edge(3:4, e)))
      surface%end_outward(:, :, e) = point_normal(:, edge(1:2, e))
    end do
    call make_vertices(shape, is_corner, surface)
    call sort_into_bins(shape, surface)
    if (present(with_net)) then
      if (.not. with_net) return
    end if
    call make_net(surface)
  end subroutine surface_init

  !> What of a net of facets touches: edges that are not flat, and corners; and the outward
  !! directions at its points.
  pure subroutine find_features(point, first, corner, edge, n_convex, point_normal, is_corner)
    real(wp), intent(in) :: point(:, :)             !! (3, points) [m]
    integer, intent(in) :: first(:)
    integer, intent(in) :: corner(first(size(first)) - 1)   !! see `pair_edges`
    integer, allocatable, intent(out) :: edge(:, :)
      !! (4, edges) of `pair_edges`: sharp convex ones first, those of one facet last
    integer, intent(out) :: n_convex                !! the sharp convex ones
    real(wp), allocatable, intent(out) :: point_normal(:, :)   !! (3, points) of any length
    logical, allocatable, intent(out) :: is_corner(:)          !! (points)
    integer, allocatable :: pair(:, :), bend(:), e(:)
    real(wp), allocatable :: normal(:, :)
    real(wp) :: offset
    integer :: f, n

    allocate (normal(3, size(first) - 1), point_normal(3, size(point, 2)))
    point_normal = 0.0_wp
    do f = 1, size(first) - 1
      associate (c => corner(first(f):first(f + 1) - 1))
        call set_plane(point(:, c), normal(:, f), offset)
        point_normal(:, c) = point_normal(:, c) + spread(normal(:, f), 2, size(c)) &
          *spread(angles_of(point(:, c)), 1, 3)
      end associate
    end do
    call pair_edges(size(point, 2), first, corner, pair)
    n = size(pair, 2)
    allocate (bend(n), source=0)
    do f = 1, n
      if (pair(4, f) > 0) bend(f) = bend_of(point(:, pair(1:2, f)), normal(:, pair(3:4, f)))
    end do
    call find_corners(point, pair, bend, point_normal, is_corner)
    n_convex = count(bend > 0)
    e = [(f, f=1, n)]
    edge = pair(:, [pack(e, bend > 0), pack(e, bend < 0), pack(e, pair(4, :) == 0)])
  end subroutine find_features

  !> Plane and sides of a facet.
  pure subroutine set_facet(p, normal, offset, side_normal, side_offset)
    real(wp), intent(in) :: p(:, :)          !! (3, n) corners, counter-clockwise from outside [m]
    real(wp), intent(out) :: normal(3), offset, side_normal(:, :), side_offset(:)
      !! see `surface_t`
    integer :: c

    call set_plane(p, normal, offset)
    do c = 1, size(p, 2)
      associate (along => p(:, 1 + mod(c, size(p, 2))) - p(:, c))
        side_normal(:, c) = cross(normal, along/norm(along))
      end associate
      side_offset(c) = dot_product(side_normal(:, c), p(:, c))
    end do
  end subroutine set_facet

  !> Outward unit normal of a facet, and its product with the points of the plane.
  pure subroutine set_plane(p, normal, offset)
    real(wp), intent(in) :: p(:, :)               !! as in `set_facet`
    real(wp), intent(out) :: normal(3), offset    !! [-], [m]

    normal = area_vector(p)
    normal = normal/norm(normal)
    offset = dot_product(normal, sum(p, 2)/real(size(p, 2), wp))
  end subroutine set_plane

  !> Angles of a facet at its corners.
  !!
  !! The sum of the normals of the facets at a point, weighted by these, points outward as seen from
  !! any place nearest to that point (Baerentzen and Aanaes, 2005).
  pure function angles_of(p) result(angle)
    real(wp), intent(in) :: p(:, :)   !! as in `set_facet`
    real(wp) :: angle(size(p, 2))
    real(wp) :: u(3), w(3)
    integer :: c, n

    n = size(p, 2)
    do c = 1, n
      u = p(:, 1 + mod(c, n)) - p(:, c)
      w = p(:, 1 + mod(c + n - 2, n)) - p(:, c)
      angle(c) = atan2(norm(cross(u, w)), dot_product(u, w))
    end do
  end function angles_of

  !> Numbers of the corners of facet f.
  pure function corners(shape, f) result(p)
    type(shape_t), intent(in) :: shape
    integer, intent(in) :: f
    integer :: p(shape%facet(f + 1) - shape%facet(f))

    p = shape%facet_point(shape%facet(f):shape%facet(f + 1) - 1)
  end function corners

  !> Edges of the net of facets, each once: start, end, the facet that runs it that way, the other.
  pure subroutine pair_edges(n_points, first, corner, edge)
    integer, intent(in) :: n_points, first(:)
    integer, intent(in) :: corner(first(size(first)) - 1)
      !! those of facet f are corner(first(f):first(f+1)-1)
    integer, allocatable, intent(out) :: edge(:, :)   !! (4, edges)
    integer, allocatable :: head(:), chain(:), found(:, :)
    integer :: f, c, a, b, e, n

    allocate (found(4, size(corner)), chain(size(corner)))
    allocate (head(n_points), source=0)   ! edges by their lower corner
    n = 0
    do f = 1, size(first) - 1
      do c = first(f), first(f + 1) - 1
        a = corner(c)
        b = corner(merge(c + 1, first(f), c + 1 < first(f + 1)))
        e = head(min(a, b))
        do while (e > 0)
          if (found(1, e) == b .and. found(2, e) == a .and. found(4, e) == 0) exit
          e = chain(e)
        end do
        if (e > 0) then
          found(4, e) = f
        else
          n = n + 1
          found(:, n) = [a, b, f, 0]
          chain(n) = head(min(a, b))
          head(min(a, b)) = n
        end if
      end do
    end do
    edge = found(:, :n)
  end subroutine pair_edges

  !> Corners that may touch: where a sharp convex edge ends, since past its end the crossing with
  !! another edge does not count (on a saddle of a bed an edge rests on such a corner though others
  !! rise from it); and those that stick out, from which all edges fall away.
  pure subroutine find_corners(point, edge, bend, point_normal, is_corner)
    real(wp), intent(in) :: point(:, :)           !! (3, points) [m]
    integer, intent(in) :: edge(:, :), bend(:)    !! (4, edges), (edges)
    real(wp), intent(in) :: point_normal(:, :)    !! (3, points)
    logical, allocatable, intent(out) :: is_corner(:)  !! (points)
    real(wp), parameter :: jut = 0.5_wp*sharp     !! sine by which edges fall away from a corner
    real(wp) :: along(3)
    integer :: e, c

    allocate (is_corner(size(point, 2)))
    is_corner = norms(point_normal) > 0.0_wp
    do e = 1, size(edge, 2)
      along = point(:, edge(2, e)) - point(:, edge(1, e))
      along = along/norm(along)
      do c = 1, 2
        associate (outward => point_normal(:, edge(c, e)))
          if (dot_product(along, outward) > -jut*norm(outward)) is_corner(edge(c, e)) = .false.
        end associate
        along = -along
      end do
    end do
    do e = 1, size(edge, 2)
      if (bend(e) > 0) is_corner(edge(1:2, e)) = .true.
    end do
  end subroutine find_corners

  !> The edge between two facets.
  pure function edge_between(ends, normal) result(edge)
    real(wp), intent(in) :: ends(3, 2)     !! start, end [m]
    real(wp), intent(in) :: normal(3, 2)   !! of the facet that runs it that way, of the other
    type(edge_t) :: edge

    edge%start = ends(:, 1)
    edge%along = ends(:, 2) - edge%start
    edge%extent = norm(edge%along)
    edge%along = edge%along/edge%extent
    edge%into(:, 1) = cross(normal(:, 1), edge%along)
    edge%into(:, 2) = -cross(normal(:, 2), edge%along)
    edge%outward = normal(:, 1) + normal(:, 2)
  end function edge_between

  !> 1: the edge is convex and sharp, -1: reentrant or convex but not sharp, 0: flat.
  pure function bend_of(ends, normal) result(bend)
    real(wp), intent(in) :: ends(3, 2), normal(3, 2)   !! as in `edge_between`
    integer :: bend
    real(wp), parameter :: flat = 1.0e-9_wp
    real(wp) :: along(3), fall

    bend = 0
    along = ends(:, 2) - ends(:, 1)
    along = along/norm(along)
    fall = dot_product(normal(:, 1), cross(normal(:, 2), along))
    if (abs(fall) < flat .and. dot_product(normal(:, 1), normal(:, 2)) > 0.0_wp) return
    bend = merge(1, -1, fall > sharp)
  end function bend_of

  !> Corners that stick out, and points inside large faces.
  !!
  !! The corners of one flat face weigh `flat_sum` together, or one each where they are fewer: a
  !! many-cornered face is no stiffer than a square one. The points inside carry equal faces that
  !! lie exactly on one another, where no corner is inside the other body.
  pure subroutine make_vertices(shape, is_corner, surface)
    type(shape_t), intent(in) :: shape
    logical, intent(in) :: is_corner(:)                !! (points)
    type(surface_t), intent(inout) :: surface
    real(wp) :: weight(size(is_corner)), middle(3), whole
    integer :: f, c, n, m

    weight = 1.0_wp
    do f = 1, size(shape%facet) - 1
      n = shape%facet(f + 1) - shape%facet(f)
      weight(corners(shape, f)) = min(weight(corners(shape, f)), flat_sum/real(n, wp))
    end do
    whole = sum([(area(f), f=1, size(shape%facet) - 1)])
    n = count(is_corner)
    surface%n_corners = n
    do f = 1, size(shape%facet) - 1
      if (area(f) > large*whole) n = n + size(corners(shape, f))
    end do
    allocate (surface%vertex(3, n), surface%weight(n), surface%facing(3, surface%n_corners + 1:n))
    n = surface%n_corners
    surface%vertex(:, :n) = shape%point(:, pack([(c, c=1, size(is_corner))], is_corner))
    surface%weight(:n) = pack(weight, is_corner)
    do f = 1, size(shape%facet) - 1
      if (area(f) <= large*whole) cycle
      m = size(corners(shape, f))
      middle = sum(shape%point(:, corners(shape, f)), 2)/real(m, wp)
      do c = shape%facet(f), shape%facet(f + 1) - 1
        n = n + 1
        surface%vertex(:, n) = (1.0_wp - inset)*shape%point(:, shape%facet_point(c)) + inset*middle
        surface%weight(n) = face_sum/real(m, wp)
        surface%facing(:, n) = surface%normal(:, f)
      end do
    end do
  contains
    !> Area of facet f [m2].
    pure real(wp) function area(f)
      integer, intent(in) :: f

      area = norm(area_vector(shape%point(:, corners(shape, f))))
    end function area
  end subroutine make_vertices

  !> Bounding box and radius, bins.
  subroutine sort_into_bins(shape, surface)
    type(shape_t), intent(in) :: shape
    type(surface_t), intent(inout) :: surface
    real(wp), allocatable :: low(:, :), high(:, :)
    integer :: f, n

    n = size(surface%offset)
    allocate (low(3, n), high(3, n))
    do f = 1, n
      low(:, f) = minval(shape%point(:, corners(shape, f)), 2)
      high(:, f) = maxval(shape%point(:, corners(shape, f)), 2)
    end do
    surface%low = minval(low, 2)
    surface%high = maxval(high, 2)
    surface%bounding_radius = maxval(norms(shape%point(:, shape%facet_point)))
    call bins_build(low, high, 2*surface%length, surface%facets)
    call bins_build(surface%vertex, surface%vertex, 2*surface%length, surface%vertices)
    n = size(surface%edge)
    deallocate (low, high)
    allocate (low(3, n), high(3, n))
    do f = 1, n
      associate (edge => surface%edge(f))
        low(:, f) = min(edge%start, edge%start + edge%extent*edge%along)
        high(:, f) = max(edge%start, edge%start + edge%extent*edge%along)
      end associate
    end do
    call bins_build(low, high, 2*surface%length, surface%edges)
  end subroutine sort_into_bins

  !> Signed distance at the nodes of a net over the bounding box.
  subroutine make_net(surface)
    type(surface_t), intent(inout) :: surface
    integer, parameter :: max_steps = 24   ! along the longest side
    type(found_t) :: found
    real(wp) :: x(3), outward(3), step
    integer :: n(3), i, j, k

    step = maxval(surface%high - surface%low)/real(max_steps, wp)
    n = max(1, ceiling((surface%high - surface%low)/step))
    surface%net_step = max((surface%high - surface%low)/real(n, wp), tiny(1.0_wp))
    allocate (surface%net(0:n(1), 0:n(2), 0:n(3)))
    do k = 0, n(3)
      do j = 0, n(2)
        do i = 0, n(1)
          x = surface%low + surface%net_step*real([i, j, k], wp)
          call search_surface(surface, x, step, found, surface%net(i, j, k), outward)
        end do
      end do
    end do
  end subroutine make_net

end module surface_features_m
