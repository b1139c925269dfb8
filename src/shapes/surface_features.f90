!> The exact surface of a shape, made ready for contact: what can touch, and what can be touched.
!!
!! What can touch are vertices (corners, and points inside large flat faces) and sharp convex edges.
!! What is touched is the surface itself: flat convex facets and the edges between them
!! (`surface_search_m`).
module surface_features_m
  use kinds_m, only: wp
  use vectors_m, only: norms, cross, norm
  use tet_mesh_m, only: shape_t
  use neighbours_m, only: bins_build
  use surface_search_m, only: surface_t, found_t, search_surface
  implicit none
  private
  public :: surface_init, pair_edges

  real(wp), parameter :: sharp = 1.0e-3_wp     !! sine by which facets differ at a sharp edge: more
    !! than by the digits of a file, less than on a smooth form that is cut finely
  real(wp), parameter :: flat_sum = 4.0_wp     !! weight of all corners of a flat face together
  real(wp), parameter :: face_sum = 1.0_wp     !! weight of all points inside a flat face
  real(wp), parameter :: inset = 0.36_wp       !! way of these points from the corner to the middle
  real(wp), parameter :: large = 0.01_wp       !! share of the surface of a face that has them

contains

  !> Features of a shape. `min_distance` needs the net of distances; a bed does without.
  subroutine surface_init(shape, surface, with_net)
    type(shape_t), intent(in) :: shape
    type(surface_t), intent(out) :: surface
    logical, intent(in), optional :: with_net   !! default: yes
    integer, allocatable :: edge(:, :), bend(:)
    real(wp), allocatable :: point_normal(:, :)
    logical, allocatable :: is_corner(:)
    integer :: e, f, c, before
    real(wp) :: p(3), u(3), w(3)

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
    call make_facets(shape, surface)
    call pair_edges(shape, edge)
    ! Sum of the normals of the facets at each point, weighted by their angle there: it points
    ! outward as seen from any place nearest to that point (Baerentzen and Aanaes, 2005).
    allocate (point_normal(3, size(shape%point, 2)), source=0.0_wp)
    do f = 1, size(surface%normal, 2)
      before = shape%facet(f + 1) - 1
      do c = shape%facet(f), shape%facet(f + 1) - 1
        p = shape%point(:, shape%facet_point(c))
        u = shape%point(:, next_corner(shape, f, c)) - p
        w = shape%point(:, shape%facet_point(before)) - p
        associate (sum_here => point_normal(:, shape%facet_point(c)))
          sum_here = sum_here + atan2(norm(cross(u, w)), dot_product(u, w))*surface%normal(:, f)
        end associate
        before = c
      end do
    end do
    bend = [(bend_of(shape, edge(:, e), surface%normal), e=1, size(edge, 2))]
    call find_corners(shape, edge, bend, point_normal, is_corner)
    call make_edges(shape, edge, bend, point_normal, surface)
    call make_vertices(shape, is_corner, surface)
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

  !> Corners that may touch: where a sharp convex edge ends, since past its end the crossing with
  !! another edge does not count (on a saddle of a bed an edge rests on such a corner though others
  !! rise from it); and those that stick out, from which all edges fall away.
  pure subroutine find_corners(shape, edge, bend, point_normal, is_corner)
    type(shape_t), intent(in) :: shape
    integer, intent(in) :: edge(:, :), bend(:)    !! (4, edges), (edges)
    real(wp), intent(in) :: point_normal(:, :)    !! (3, points)
    logical, allocatable, intent(out) :: is_corner(:)  !! (points)
    real(wp), parameter :: jut = 0.5_wp*sharp     !! sine by which edges fall away from a corner
    real(wp) :: along(3)
    integer :: e, c

    allocate (is_corner(size(shape%point, 2)))
    is_corner = norms(point_normal) > 0.0_wp
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
    whole = sum([(norm(area_vector(shape, f)), f=1, size(shape%facet) - 1)])
    n = count(is_corner)
    surface%n_corners = n
    do f = 1, size(shape%facet) - 1
      if (norm(area_vector(shape, f)) > large*whole) n = n + size(corners(shape, f))
    end do
    allocate (surface%vertex(3, n), surface%weight(n), surface%facing(3, surface%n_corners + 1:n))
    n = 0
    do c = 1, size(is_corner)
      if (.not. is_corner(c)) cycle
      n = n + 1
      surface%vertex(:, n) = shape%point(:, c)
      surface%weight(n) = weight(c)
    end do
    do f = 1, size(shape%facet) - 1
      if (norm(area_vector(shape, f)) <= large*whole) cycle
      m = size(corners(shape, f))
      middle = sum(shape%point(:, corners(shape, f)), 2)/real(m, wp)
      do c = shape%facet(f), shape%facet(f + 1) - 1
        n = n + 1
        surface%vertex(:, n) = (1.0_wp - inset)*shape%point(:, shape%facet_point(c)) + inset*middle
        surface%weight(n) = face_sum/real(m, wp)
        surface%facing(:, n) = surface%normal(:, f)
      end do
    end do
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
