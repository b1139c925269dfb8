!> The exact surface of a shape, made ready for contact: what can touch, and what can be touched.
!!
!! What can touch are probes (corners, and points inside large flat faces) and sharp convex edges.
!! What is touched is the surface itself: flat convex facets and the edges between them, from which
!! the signed distance of a point follows exactly. Body axes, origin at the centre of mass.
module surface_features_m
  use kinds_m, only: wp
  use growing_m, only: ensure_room
  use vectors_m, only: cross, norm
  use tet_mesh_m, only: shape_t
  use neighbours_m, only: bins_t, bins_build
  use edge_crossing_m, only: edge_t
  implicit none
  private
  public :: surface_t, surface_init, near_list_t, found_t, gather_probes, gather_edges, &
    gather_facets, &
    nearest_on_surface, search_surface, least_distance, segment_distance2, nowhere, pair_edges

  type :: surface_t
    real(wp) :: ball = 0.0_wp                    !! radius of a sphere; 0: a polyhedron [m]
    real(wp) :: reach = 0.0_wp                   !! of the sphere about the origin around it [m]
    real(wp) :: length = 0.0_wp                  !! d_s of the contact Courant number, eq. (6) [m]
    real(wp) :: low(3) = 0.0_wp, high(3) = 0.0_wp    !! bounding box [m]
    real(wp), allocatable :: probe(:, :)         !! (3, n) points that touch; sphere: its centre [m]
    real(wp), allocatable :: weight(:)           !! (n) share of the stiffness [-]
    integer :: n_corners = 0                     !! the first probes are corners
    !> Facets: normal.x = offset; inside where side_normal.x >= side_offset for all of its sides.
    real(wp), allocatable :: normal(:, :), offset(:)              !! (3, n) outward, (n) [m]
    integer, allocatable :: side(:)              !! (n + 1) first side of each facet
    real(wp), allocatable :: side_normal(:, :), side_offset(:)    !! (3, :), (:) [m]
    type(edge_t), allocatable :: edge(:)         !! those that are not flat, convex ones first
    integer :: n_convex = 0
    real(wp), allocatable :: end_outward(:, :, :)   !! (3, 2, n) outward at the start, at the end
    type(bins_t) :: probes, facets, edges
    real(wp) :: net_step(3) = 1.0_wp             !! of a net over the bounding box [m]
    real(wp), allocatable :: net(:, :, :)        !! signed distance at its nodes, from 0 [m]
  end type surface_t

  !> Numbers found by a search, each once, ascending.
  type :: near_list_t
    integer :: n = 0
    integer, allocatable :: item(:)
    integer, allocatable, private :: mark(:)     !! search in which each item was seen last
    integer, private :: search = 0
  end type near_list_t

  !> Facets and edges found by a search.
  type :: found_t
    type(near_list_t) :: facets, edges
  end type found_t

  real(wp), parameter :: nowhere = 1.0e30_wp   !! distance from nothing [m]
  real(wp), parameter :: sharp = 0.02_wp       !! sine by which facets differ at a sharp edge
  real(wp), parameter :: flat_sum = 4.0_wp     !! weight of all corners of a flat face together
  real(wp), parameter :: face_sum = 1.0_wp     !! weight of all points inside a flat face
  real(wp), parameter :: inset = 0.36_wp       !! way of these points from the corner to the middle
  real(wp), parameter :: large = 0.01_wp       !! share of the surface of a face that has them

contains

  !> Features of a shape. `least_distance` needs the net of distances; a bed does without.
  subroutine surface_init(shape, surface, with_net)
    type(shape_t), intent(in) :: shape
    type(surface_t), intent(out) :: surface
    logical, intent(in), optional :: with_net   !! default: yes
    integer, allocatable :: edge(:, :), bend(:)
    real(wp), allocatable :: point_normal(:, :)
    logical, allocatable :: is_corner(:)
    integer :: e

    if (shape%kind == 'sphere') then
      surface%ball = shape%sphere_radius(1)
      surface%reach = surface%ball
      surface%length = 2*surface%ball
      allocate (surface%probe(3, 1), source=0.0_wp)
      allocate (surface%weight(1), source=1.0_wp)
      call bins_build(surface%probe, surface%probe, surface%ball, surface%probes)
      return
    end if
    surface%length = 0.25_wp*shape%smallest_edge
    call make_facets(shape, surface)
    call pair_edges(shape, edge)
    call outward_at_points(shape, surface%normal, point_normal)
    bend = [(bend_of(shape, edge(:, e), surface%normal), e=1, size(edge, 2))]
    call find_corners(shape, edge, bend, point_normal, is_corner)
    call make_edges(shape, edge, bend, point_normal, surface)
    call make_probes(shape, is_corner, surface)
    call sort_into_bins(shape, surface)
    if (present(with_net)) then
      if (.not. with_net) return
    end if
    call make_net(surface)
  end subroutine surface_init

  !> Planes and sides of the facets.
  pure subroutine make_facets(shape, surface)
    type(shape_t), intent(in) :: shape
    type(surface_t), intent(inout) :: surface
    real(wp) :: p(3), next(3), middle(3)
    integer :: f, c, n, m

    n = size(shape%facet) - 1
    surface%side = shape%facet
    allocate (surface%normal(3, n), surface%offset(n))
    allocate (surface%side_normal(3, size(shape%facet_point)))
    allocate (surface%side_offset(size(shape%facet_point)))
    do f = 1, n
      surface%normal(:, f) = facet_normal(shape, f)
      m = shape%facet(f + 1) - shape%facet(f)
      middle = sum(shape%point(:, corners(shape, f)), 2)/real(m, wp)
      surface%offset(f) = dot_product(surface%normal(:, f), middle)
      do c = shape%facet(f), shape%facet(f + 1) - 1
        p = shape%point(:, shape%facet_point(c))
        next = shape%point(:, next_corner(shape, f, c))
        surface%side_normal(:, c) = cross(surface%normal(:, f), (next - p)/norm(next - p))
        surface%side_offset(c) = dot_product(surface%side_normal(:, c), p)
      end do
    end do
  end subroutine make_facets

  !> Numbers of the corners of facet f.
  pure function corners(shape, f) result(p)
    type(shape_t), intent(in) :: shape
    integer, intent(in) :: f
    integer :: p(shape%facet(f + 1) - shape%facet(f))

    p = shape%facet_point(shape%facet(f):shape%facet(f + 1) - 1)
  end function corners

  !> The corner of facet f after place c of `facet_point`.
  pure function next_corner(shape, f, c) result(p)
    type(shape_t), intent(in) :: shape
    integer, intent(in) :: f, c
    integer :: p

    p = shape%facet_point(merge(c + 1, shape%facet(f), c + 1 < shape%facet(f + 1)))
  end function next_corner

  !> Twice the area of facet f times its outward unit normal, without the length: the unit normal.
  pure function facet_normal(shape, f) result(normal)
    type(shape_t), intent(in) :: shape
    integer, intent(in) :: f
    real(wp) :: normal(3)

    normal = area_vector(shape, f)
    normal = normal/norm(normal)
  end function facet_normal

  !> Area of facet f times its outward unit normal [m2].
  pure function area_vector(shape, f) result(area)
    type(shape_t), intent(in) :: shape
    integer, intent(in) :: f
    real(wp) :: area(3)
    real(wp) :: p(3)
    integer :: c

    p = shape%point(:, shape%facet_point(shape%facet(f)))
    area = 0.0_wp
    do c = shape%facet(f) + 1, shape%facet(f + 1) - 2
      area = area + 0.5_wp*cross(shape%point(:, shape%facet_point(c)) - p, &
        shape%point(:, shape%facet_point(c + 1)) - p)
    end do
  end function area_vector

  !> Edges of the net of facets, each once: start, end, the facet that runs it that way, the other.
  pure subroutine pair_edges(shape, edge)
    type(shape_t), intent(in) :: shape
    integer, allocatable, intent(out) :: edge(:, :)   !! (4, edges)
    integer, allocatable :: head(:), chain(:), found(:, :)
    integer :: f, c, a, b, e, n

    allocate (found(4, size(shape%facet_point)), chain(size(shape%facet_point)))
    allocate (head(size(shape%point, 2)), source=0)   ! edges by their lower corner
    n = 0
    do f = 1, size(shape%facet) - 1
      do c = shape%facet(f), shape%facet(f + 1) - 1
        a = shape%facet_point(c)
        b = next_corner(shape, f, c)
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

  !> Sum of the normals of the facets at each point, weighted by their angle there: it points
  !! outward as seen from any place nearest to that point (Baerentzen and Aanaes, 2005).
  pure subroutine outward_at_points(shape, normal, point_normal)
    type(shape_t), intent(in) :: shape
    real(wp), intent(in) :: normal(:, :)                       !! (3, facets)
    real(wp), allocatable, intent(out) :: point_normal(:, :)   !! (3, points)
    real(wp) :: p(3), u(3), w(3)
    integer :: f, c, before

    allocate (point_normal(3, size(shape%point, 2)), source=0.0_wp)
    do f = 1, size(normal, 2)
      before = shape%facet(f + 1) - 1
      do c = shape%facet(f), shape%facet(f + 1) - 1
        p = shape%point(:, shape%facet_point(c))
        u = shape%point(:, next_corner(shape, f, c)) - p
        w = shape%point(:, shape%facet_point(before)) - p
        associate (sum_here => point_normal(:, shape%facet_point(c)))
          sum_here = sum_here + atan2(norm(cross(u, w)), dot_product(u, w))*normal(:, f)
        end associate
        before = c
      end do
    end do
  end subroutine outward_at_points

  !> Corners that may touch: where a sharp convex edge ends, since past its end the crossing with
  !! another edge does not count (on a saddle of a bed an edge rests on such a corner though others
  !! rise from it); and those that stick out, from which all edges fall away.
  pure subroutine find_corners(shape, edge, bend, point_normal, is_corner)
    type(shape_t), intent(in) :: shape
    integer, intent(in) :: edge(:, :), bend(:)    !! (4, edges), (edges)
    real(wp), intent(in) :: point_normal(:, :)    !! (3, points)
    logical, allocatable, intent(out) :: is_corner(:)  !! (points)
    real(wp), parameter :: jut = 0.01_wp          !! sine by which edges fall away from a corner
    real(wp) :: along(3)
    integer :: e, c

    allocate (is_corner(size(shape%point, 2)))
    is_corner = norm2(point_normal, 1) > 0.0_wp
    do e = 1, size(edge, 2)
      along = shape%point(:, edge(2, e)) - shape%point(:, edge(1, e))
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

  !> The edges that are not flat.
  pure subroutine make_edges(shape, edge, bend, point_normal, surface)
    type(shape_t), intent(in) :: shape
    integer, intent(in) :: edge(:, :), bend(:)    !! (4, edges), (edges)
    real(wp), intent(in) :: point_normal(:, :)    !! (3, points)
    type(surface_t), intent(inout) :: surface
    integer :: e, m, wanted

    m = count(bend /= 0)
    allocate (surface%edge(m), surface%end_outward(3, 2, m))
    surface%n_convex = count(bend > 0)
    m = 0
    do wanted = 1, -1, -2   ! convex, then reentrant
      do e = 1, size(edge, 2)
        if (bend(e) /= wanted) cycle
        m = m + 1
        surface%end_outward(:, :, m) = point_normal(:, edge(1:2, e))
        associate (new => surface%edge(m))
          new%start = shape%point(:, edge(1, e))
          new%along = shape%point(:, edge(2, e)) - new%start
          new%extent = norm(new%along)
          new%along = new%along/new%extent
          new%into(:, 1) = cross(surface%normal(:, edge(3, e)), new%along)
          new%into(:, 2) = -cross(surface%normal(:, edge(4, e)), new%along)
          new%outward = surface%normal(:, edge(3, e)) + surface%normal(:, edge(4, e))
        end associate
      end do
    end do
  end subroutine make_edges

  !> 1: the edge is convex and sharp, -1: reentrant or convex but not sharp, 0: flat or open.
  pure function bend_of(shape, edge, normal) result(bend)
    type(shape_t), intent(in) :: shape
    integer, intent(in) :: edge(4)
    real(wp), intent(in) :: normal(:, :)          !! (3, facets)
    integer :: bend
    real(wp), parameter :: flat = 1.0e-9_wp
    real(wp) :: along(3), fall

    bend = 0
    if (edge(4) == 0) return
    along = shape%point(:, edge(2)) - shape%point(:, edge(1))
    along = along/norm(along)
    fall = dot_product(normal(:, edge(3)), cross(normal(:, edge(4)), along))
    if (abs(fall) < flat .and. dot_product(normal(:, edge(3)), normal(:, edge(4))) > 0.0_wp) return
    bend = merge(1, -1, fall > sharp)
  end function bend_of

  !> Corners that stick out, and points inside large faces.
  !!
  !! The corners of one flat face weigh `flat_sum` together, or one each where they are fewer: a
  !! many-cornered face is no stiffer than a square one. The points inside carry equal faces that
  !! lie exactly on one another, where no corner is inside the other body.
  pure subroutine make_probes(shape, is_corner, surface)
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
    whole = sum([(norm(area_vector(shape, f)), f=1, size(shape%facet) - 1)])
    n = count(is_corner)
    surface%n_corners = n
    do f = 1, size(shape%facet) - 1
      if (norm(area_vector(shape, f)) > large*whole) n = n + size(corners(shape, f))
    end do
    allocate (surface%probe(3, n), surface%weight(n))
    n = 0
    do c = 1, size(is_corner)
      if (.not. is_corner(c)) cycle
      n = n + 1
      surface%probe(:, n) = shape%point(:, c)
      surface%weight(n) = weight(c)
    end do
    do f = 1, size(shape%facet) - 1
      if (norm(area_vector(shape, f)) <= large*whole) cycle
      m = size(corners(shape, f))
      middle = sum(shape%point(:, corners(shape, f)), 2)/real(m, wp)
      do c = shape%facet(f), shape%facet(f + 1) - 1
        n = n + 1
        surface%probe(:, n) = (1.0_wp - inset)*shape%point(:, shape%facet_point(c)) + inset*middle
        surface%weight(n) = face_sum/real(m, wp)
      end do
    end do
  end subroutine make_probes

  !> Bounding box, reach and bins.
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
    surface%reach = maxval(norm2(shape%point(:, shape%facet_point), 1))
    call bins_build(low, high, 2*surface%length, surface%facets)
    call bins_build(surface%probe, surface%probe, 2*surface%length, surface%probes)
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

  !> Probes inside a box.
  subroutine gather_probes(surface, low, high, list)
    type(surface_t), intent(in) :: surface
    real(wp), intent(in) :: low(3), high(3)   !! [m]
    type(near_list_t), intent(inout) :: list

    call gather(surface%probes, size(surface%weight), low, high, list)
  end subroutine gather_probes

  !> Edges whose bins meet a box; the box should not be much smaller than a bin.
  subroutine gather_edges(surface, low, high, list)
    type(surface_t), intent(in) :: surface
    real(wp), intent(in) :: low(3), high(3)   !! [m]
    type(near_list_t), intent(inout) :: list

    call gather(surface%edges, size(surface%edge), low, high, list)
  end subroutine gather_edges

  !> Facets whose bins meet a box.
  subroutine gather_facets(surface, low, high, list)
    type(surface_t), intent(in) :: surface
    real(wp), intent(in) :: low(3), high(3)   !! [m]
    type(near_list_t), intent(inout) :: list

    call gather(surface%facets, size(surface%offset), low, high, list)
  end subroutine gather_facets

  !> Items of the bins that meet a box, each once, ascending; all where there are more such bins.
  subroutine gather(bins, n_items, low, high, list)
    type(bins_t), intent(in) :: bins
    integer, intent(in) :: n_items
    real(wp), intent(in) :: low(3), high(3)   !! [m]
    type(near_list_t), intent(inout) :: list
    integer, parameter :: scan = 8   !! marks looked at for each item found: quicker than sorting
    integer :: a(3), b(3), i, j, k, m, bin, item

    list%n = 0
    call ensure_room(1, list%item)
    if (any(low > bins%high) .or. any(high < bins%low)) return
    if (.not. allocated(list%mark)) allocate (list%mark(n_items), source=0)
    if (size(list%mark) < n_items) then
      deallocate (list%mark)
      allocate (list%mark(n_items), source=0)
    end if
    a = bins%place(low)
    b = bins%place(high)
    if (product(b - a + 1) > n_items) then
      call ensure_room(n_items, list%item)
      list%n = n_items
      list%item(:n_items) = [(item, item=1, n_items)]
      return
    end if
    list%search = list%search + 1
    do k = a(3), b(3)
      do j = a(2), b(2)
        do i = a(1), b(1)
          bin = bins%number([i, j, k])
          call ensure_room(list%n + bins%first(bin + 1) - bins%first(bin), list%item)
          do m = bins%first(bin), bins%first(bin + 1) - 1
            item = bins%item(m)
            if (list%mark(item) == list%search) cycle
            list%mark(item) = list%search
            list%n = list%n + 1
            list%item(list%n) = item
          end do
        end do
      end do
    end do
    if (n_items > scan*list%n) then
      call sort_items(list%item(:list%n))
    else
      list%n = 0
      do item = 1, n_items
        if (list%mark(item) /= list%search) cycle
        list%n = list%n + 1
        list%item(list%n) = item
      end do
    end if
  end subroutine gather

  !> Ascending order, by Shell's method: lists may be long over a fine bed.
  pure subroutine sort_items(item)
    integer, intent(inout) :: item(:)
    integer, parameter :: gap(7) = [701, 301, 132, 57, 23, 10, 4]   !! Ciura (2001), and 1
    integer :: g

    do g = 1, size(gap)
      if (gap(g) < size(item)) call sort_by_gap(gap(g), item)
    end do
    call sort_by_gap(1, item)
  end subroutine sort_items

  !> Ascending order of the items at places that differ by a gap.
  pure subroutine sort_by_gap(gap, item)
    integer, intent(in) :: gap
    integer, intent(inout) :: item(:)
    integer :: i, j, here

    do i = 1 + gap, size(item)
      here = item(i)
      j = i - gap
      do while (j >= 1)
        if (item(j) < here) exit
        item(j + gap) = item(j)
        j = j - gap
      end do
      item(j + gap) = here
    end do
  end subroutine sort_by_gap

  !> Signed distance of a point from the listed facets and edges, and the unit vector along which
  !! it grows; `nowhere` where none of them is nearest. Positive outside.
  pure subroutine nearest_on_surface(surface, x, facet, edge, distance, outward)
    type(surface_t), intent(in) :: surface
    real(wp), intent(in) :: x(3)                !! body axes [m]
    integer, intent(in) :: facet(:), edge(:)    !! numbers of facets and edges
    real(wp), intent(out) :: distance           !! [m]
    real(wp), intent(out) :: outward(3)         !! [-]
    real(wp) :: best, s, d(3), square, above_edge(3)
    integer :: m, f, c
    logical :: above

    best = nowhere
    distance = nowhere
    outward = 0.0_wp
    do m = 1, size(facet)
      f = facet(m)
      s = dot_product(surface%normal(:, f), x) - surface%offset(f)
      if (abs(s) >= best) cycle
      above = .true.
      do c = surface%side(f), surface%side(f + 1) - 1
        above = dot_product(surface%side_normal(:, c), x) >= surface%side_offset(c)
        if (.not. above) exit
      end do
      if (.not. above) cycle
      best = abs(s)
      distance = s
      outward = surface%normal(:, f)
    end do
    do m = 1, size(edge)
      associate (e => surface%edge(edge(m)))
        d = x - e%start
        s = dot_product(d, e%along)
        above_edge = e%outward
        if (s < 0.0_wp) above_edge = surface%end_outward(:, 1, edge(m))
        if (s > e%extent) above_edge = surface%end_outward(:, 2, edge(m))
        d = d - min(max(s, 0.0_wp), e%extent)*e%along
        square = dot_product(d, d)
        if (square >= best**2) cycle
        best = sqrt(square)
        distance = sign(best, dot_product(d, above_edge))
        if (best > 0.0_wp) then
          outward = d/distance
        else
          outward = above_edge/norm(above_edge)
        end if
      end associate
    end do
  end subroutine nearest_on_surface

  !> Signed distance of a point from the surface, searched in a growing box: exact.
  subroutine search_surface(surface, x, begin, found, distance, outward)
    type(surface_t), intent(in) :: surface
    real(wp), intent(in) :: x(3), begin              !! body axes; half the first box [m]
    type(found_t), intent(inout) :: found            !! work
    real(wp), intent(out) :: distance, outward(3)    !! [m], see `nearest_on_surface`
    real(wp) :: reach

    reach = begin
    do
      call gather_facets(surface, x - reach, x + reach, found%facets)
      call gather_edges(surface, x - reach, x + reach, found%edges)
      call nearest_on_surface(surface, x, found%facets%item(:found%facets%n), &
        found%edges%item(:found%edges%n), distance, outward)
      if (abs(distance) <= reach .or. reach > 2*surface%reach) return
      reach = merge(abs(distance), 2*reach, abs(distance) < 2*reach)
    end do
  end subroutine search_surface

  !> Signed distance at the nodes of a net over the bounding box.
  subroutine make_net(surface)
    type(surface_t), intent(inout) :: surface
    integer, parameter :: most_steps = 24   ! along the longest side
    type(found_t) :: found
    real(wp) :: x(3), outward(3), step
    integer :: n(3), i, j, k

    step = maxval(surface%high - surface%low)/real(most_steps, wp)
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

  !> The signed distance of a point from the surface is not below this [m].
  pure function least_distance(surface, x) result(least)
    type(surface_t), intent(in) :: surface
    real(wp), intent(in) :: x(3)   !! body axes [m]
    real(wp) :: least
    integer :: n(3)

    n = nint(min(max((x - surface%low)/surface%net_step, 0.0_wp), real(ubound(surface%net), wp)))
    ! it changes by no more than the way from the node to the point
    least = surface%net(n(1), n(2), n(3)) - norm(x - surface%low - surface%net_step*real(n, wp))
  end function least_distance

  !> Square of the distance of two segments from p along u (unit) for a, from q along w for b [m2].
  pure function segment_distance2(p, u, a, q, w, b) result(square)
    real(wp), intent(in) :: p(3), u(3), a, q(3), w(3), b   !! [m]
    real(wp) :: square
    real(wp) :: d(3), uw, ud, wd, s, t, det

    d = q - p
    uw = dot_product(u, w)
    ud = dot_product(u, d)
    wd = dot_product(w, d)
    det = 1.0_wp - uw**2
    s = 0.0_wp
    if (det > epsilon(det)) s = min(max((ud - uw*wd)/det, 0.0_wp), a)
    t = min(max(uw*s - wd, 0.0_wp), b)
    s = min(max(ud + uw*t, 0.0_wp), a)
    d = d + t*w - s*u
    square = dot_product(d, d)
  end function segment_distance2

end module surface_features_m
