!> What of the exact surface of a shape lies near a point or in a box, and how far away.
!!
!! The signed distance of a point follows exactly from the flat convex facets and the edges between
!! them (`surface_features_m` makes them). Body axes, origin at the centre of mass.
module surface_search_m
  use kinds_m, only: wp, i8
  use growing_m, only: ensure_capacity
  use vectors_m, only: norm
  use neighbours_m, only: bins_t
  use edge_crossing_m, only: edge_t
  implicit none
  private
  public :: surface_t, near_list_t, found_t, gather, gather_edges, gather_facets
  public :: nearest_on_surface, nearest_places, search_surface, min_distance
  public :: segment_distance2, nowhere

  type :: surface_t
    real(wp) :: ball = 0.0_wp                    !! radius of a sphere; 0: a polyhedron [m]
    real(wp) :: bounding_radius = 0.0_wp         !! of the sphere about the origin around it [m]
    real(wp) :: length = 0.0_wp                  !! d_s of the contact Courant number, eq. (6) [m]
    real(wp) :: low(3) = 0.0_wp, high(3) = 0.0_wp    !! bounding box [m]
    real(wp), allocatable :: vertex(:, :)        !! (3, n) points that touch; sphere: its centre [m]
    real(wp), allocatable :: weight(:)           !! (n) share of the stiffness [-]
    integer :: n_corners = 0                     !! the first vertices are corners
    real(wp), allocatable :: facing(:, :)
      !! (3, n_corners+1:n) normals of the flat faces in which the others lie
    !> Facets: normal.x = offset; inside where side_normal.x >= side_offset for all of its sides.
    real(wp), allocatable :: normal(:, :), offset(:)              !! (3, n) outward, (n) [m]
    integer, allocatable :: side(:)              !! (n + 1) first side of each facet
    real(wp), allocatable :: side_normal(:, :), side_offset(:)    !! (3, :), (:) [m]
    type(edge_t), allocatable :: edge(:)         !! those that are not flat, convex ones first
    integer, allocatable :: edge_number(:)       !! (n) of each, where convex ones come first
    integer, allocatable :: facet_number(:)      !! (n) of each, above those of the edges
    integer :: n_convex = 0
    real(wp), allocatable :: end_outward(:, :, :)   !! (3, 2, n) outward at the start, at the end
    integer, allocatable :: facet_at(:), edge_at(:)
      !! a bed: where in these lists a facet, an edge is by its number; 0: not made yet
    type(bins_t) :: vertices, facets, edges
    real(wp) :: net_step(3) = 1.0_wp             !! of a net over the bounding box [m]
    real(wp), allocatable :: net(:, :, :)        !! signed distance at its nodes, from 0 [m]
  end type surface_t

  !> Numbers found by a search, each once, ascending.
  type :: near_list_t
    integer :: n = 0
    integer, allocatable :: item(:)
    integer(i8), allocatable, private :: mark(:)     !! search in which each item was seen last
    integer(i8), private :: search = 0
  end type near_list_t

  !> Facets and edges found by a search.
  type :: found_t
    type(near_list_t) :: facets, edges
    type(near_list_t) :: of_bed   !! edges that are visited while others are searched
  end type found_t

  real(wp), parameter :: nowhere = 1.0e30_wp   !! distance from nothing [m]

contains

  !> Edges whose bins meet a box; the box should not be much smaller than a bin. Those of a bed are
  !! made before (`make_ready` in `bed_surface_m`).
  subroutine gather_edges(surface, low, high, list)
    type(surface_t), intent(in) :: surface
    real(wp), intent(in) :: low(3), high(3)   !! [m]
    type(near_list_t), intent(inout) :: list

    if (allocated(surface%edge_at)) then
      call gather(surface%edges, size(surface%edge_at), low, high, list)
      list%item(:list%n) = surface%edge_at(list%item(:list%n))
    else
      call gather(surface%edges, size(surface%edge), low, high, list)
    end if
  end subroutine gather_edges

  !> Facets whose bins meet a box, made before as edges are.
  subroutine gather_facets(surface, low, high, list)
    type(surface_t), intent(in) :: surface
    real(wp), intent(in) :: low(3), high(3)   !! [m]
    type(near_list_t), intent(inout) :: list

    if (allocated(surface%facet_at)) then
      call gather(surface%facets, size(surface%facet_at), low, high, list)
      list%item(:list%n) = surface%facet_at(list%item(:list%n))
    else
      call gather(surface%facets, size(surface%offset), low, high, list)
    end if
  end subroutine gather_facets

  !> Items of the bins that meet a box, each once, ascending; all where there are more such bins.
  subroutine gather(bins, n_items, low, high, list, any_order)
    type(bins_t), intent(in) :: bins
    integer, intent(in) :: n_items
    real(wp), intent(in) :: low(3), high(3)   !! [m]
    type(near_list_t), intent(inout) :: list
    logical, intent(in), optional :: any_order   !! need not ascend, default false
    integer, parameter :: scan = 8   !! marks looked at for each item found: quicker than sorting
    integer :: a(3), b(3), i, j, k, m, bin, item, g
    integer, parameter :: gap(7) = [701, 301, 132, 57, 23, 10, 4]   !! Ciura (2001), and 1

    list%n = 0
    call ensure_capacity(1, list%item)
    if (any(low > bins%high) .or. any(high < bins%low)) return
    if (.not. allocated(list%mark)) allocate (list%mark(n_items), source=0_i8)
    if (size(list%mark) < n_items) then
      deallocate (list%mark)
      allocate (list%mark(n_items), source=0_i8)
    end if
    a = bins%place(low)
    b = bins%place(high)
    if (product(b - a + 1) > n_items) then
      call ensure_capacity(n_items, list%item)
      list%n = n_items
      list%item(:n_items) = [(item, item=1, n_items)]
      return
    end if
    list%search = list%search + 1
    do k = a(3), b(3)
      do j = a(2), b(2)
        do i = a(1), b(1)
          bin = bins%number([i, j, k])
          call ensure_capacity(list%n + bins%first(bin + 1) - bins%first(bin), list%item)
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
    if (present(any_order)) then
      if (any_order) return
    end if
    if (n_items > scan*list%n) then
      ! Ascending order, by Shell's method: lists may be long over a fine bed.
      do g = 1, size(gap)
        if (gap(g) < list%n) call sort_by_gap(gap(g), list%item(:list%n))
      end do
      call sort_by_gap(1, list%item(:list%n))
    else
      list%n = 0
      do item = 1, n_items
        if (list%mark(item) /= list%search) cycle
        list%n = list%n + 1
        list%item(list%n) = item
      end do
    end if
  end subroutine gather

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

  !> Places of a surface that are nearer to a point outside than all around them: on the facets that
  !! the point is straight above, on convex edges and corners. A place is left out that lies behind
  !! the plane through a nearer one, across the way from there to the point: as facets are convex,
  !! this leaves of each its nearest place at most, and of places that meet one.
  pure subroutine nearest_places(surface, x, reach, facet, edge, n, number, way)
    type(surface_t), intent(in) :: surface
    real(wp), intent(in) :: x(3), reach         !! body axes; farther places are left out [m]
    integer, intent(in) :: facet(:), edge(:)    !! places of facets and edges in their lists
    integer, intent(out) :: n                   !! found; 0 too if the point is inside
    integer, intent(out) :: number(:)           !! (n) of edges, then of facets, rising
    real(wp), intent(out) :: way(:, :)          !! (3, n) from the place to the point [m]
    real(wp), parameter :: level = 1.0e-10_wp   !! behind a plane, over the square of the way [-]
    real(wp) :: square(size(number)), s, d(3), above_edge(3)
    logical :: hidden(size(number))
    integer :: m, k, c

    n = 0
    do m = 1, size(edge)
      associate (e => surface%edge(edge(m)))
        d = x - e%start
        s = dot_product(d, e%along)
        above_edge = e%outward
        if (s < 0.0_wp) above_edge = surface%end_outward(:, 1, edge(m))
        if (s > e%extent) above_edge = surface%end_outward(:, 2, edge(m))
        d = d - min(max(s, 0.0_wp), e%extent)*e%along
        if (dot_product(d, above_edge) <= 0.0_wp) cycle
        n = n + 1
        number(n) = surface%edge_number(edge(m))
        way(:, n) = d
      end associate
    end do
    do m = 1, size(facet)
      associate (f => facet(m))
        s = dot_product(surface%normal(:, f), x) - surface%offset(f)
        if (s <= 0.0_wp) cycle
        do c = surface%side(f), surface%side(f + 1) - 1
          if (dot_product(surface%side_normal(:, c), x) < surface%side_offset(c)) exit
        end do
        if (c < surface%side(f + 1)) cycle
        n = n + 1
        number(n) = surface%facet_number(f)
        way(:, n) = s*surface%normal(:, f)
      end associate
    end do
    do m = 1, n
      square(m) = dot_product(way(:, m), way(:, m))
    end do
    do m = 1, n
      hidden(m) = square(m) >= reach**2
      do k = 1, n
        if (hidden(m)) exit
        if (square(k) > square(m) .or. (k >= m .and. square(k) >= square(m))) cycle
        hidden(m) = (1.0_wp - level)*square(k) <= dot_product(way(:, m), way(:, k))
      end do
    end do
    m = n
    n = 0
    do k = 1, m
      if (hidden(k)) cycle
      n = n + 1
      number(n) = number(k)
      way(:, n) = way(:, k)
    end do
  end subroutine nearest_places

  !> Signed distance of a point from the surface, searched in a growing box: exact.
  subroutine search_surface(surface, x, begin, found, distance, outward)
    type(surface_t), intent(in) :: surface
    real(wp), intent(in) :: x(3), begin              !! body axes; half the first box [m]
    type(found_t), intent(inout) :: found            !! work
    real(wp), intent(out) :: distance, outward(3)    !! [m], see `nearest_on_surface`
    real(wp) :: cutoff

    cutoff = begin
    do
      call gather_facets(surface, x - cutoff, x + cutoff, found%facets)
      call gather_edges(surface, x - cutoff, x + cutoff, found%edges)
      call nearest_on_surface(surface, x, found%facets%item(:found%facets%n), &
        found%edges%item(:found%edges%n), distance, outward)
      if (abs(distance) <= cutoff .or. cutoff > 2*surface%bounding_radius) return
      cutoff = merge(abs(distance), 2*cutoff, abs(distance) < 2*cutoff)
    end do
  end subroutine search_surface

  !> The signed distance of a point from the surface is not below this [m].
  pure function min_distance(surface, x) result(least)
    type(surface_t), intent(in) :: surface
    real(wp), intent(in) :: x(3)   !! body axes [m]
    real(wp) :: least
    integer :: n(3)

    n = nint(min(max((x - surface%low)/surface%net_step, 0.0_wp), real(ubound(surface%net), wp)))
    ! it changes by no more than the way from the node to the point
    least = surface%net(n(1), n(2), n(3)) - norm(x - surface%low - surface%net_step*real(n, wp))
  end function min_distance

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

end module surface_search_m
