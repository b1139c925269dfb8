!> Fewer, larger polygons for the same surface: flat regions become one polygon where it is convex.
module surface_net_m
  use kinds_m, only: wp
  use vectors_m, only: cross, norm
  use tet_mesh_m, only: most_facet_corners
  implicit none
  private
  public :: merge_flat_facets, edge_twins

  real(wp), parameter :: flat = 1.0e-12_wp     !! distance from a plane or line [size of the block]

contains

  !> Join the polygons of each flat region, if its border is one convex polygon, and drop corners
  !! at which every polygon is straight. The net stays closed, and no corner of a joined polygon is
  !! straight; a region where that cannot be keeps its polygons.
  pure subroutine merge_flat_facets(point, facet, facet_point)
    real(wp), intent(in) :: point(:, :)                       !! (3, n) [m]
    integer, allocatable, intent(inout) :: facet(:)           !! (facets + 1) first corner of each
    integer, allocatable, intent(inout) :: facet_point(:)     !! corners, closed net
    integer :: region(size(facet) - 1), twin(size(facet_point)), owner(size(facet_point))
    integer :: next(size(facet_point)), start(size(facet) - 1), part(size(facet) - 1)
    integer :: border(size(facet) - 1)   ! edges at the border of each region
    logical :: joined(size(facet) - 1), needed(size(point, 2)), changed
    real(wp) :: near
    integer, allocatable :: new_facet(:), new_point(:)
    integer :: n, r, f, e

    near = flat*maxval(maxval(point, 2) - minval(point, 2))
    call edge_twins(facet, facet_point, twin)
    call owners(facet, owner, next)
    call find_regions(point, facet, facet_point, twin, owner, near, region, n)
    part = 0
    start = 0
    border = 0
    do f = 1, size(facet) - 1
      part(region(f)) = part(region(f)) + 1
      do e = facet(f), facet(f + 1) - 1
        if (.not. at_border(e, region, twin, owner)) cycle
        border(region(f)) = border(region(f)) + 1
        if (start(region(f)) == 0) start(region(f)) = e
      end do
    end do
    do r = 1, n
      joined(r) = part(r) > 1
      if (joined(r)) joined(r) = is_convex(point, facet_point, region, twin, owner, next, &
                                           start(r), border(r), near)
    end do
    do
      call mark_needed(point, facet, facet_point, region, joined, twin, owner, next, start(:n), &
                       near, needed)
      changed = .false.
      do r = 1, n
        if (.not. joined(r)) cycle
        if (.not. straight_corner_needed(point, facet_point, region, twin, owner, next, start(r), &
                                         near, needed)) cycle
        joined(r) = .false.
        changed = .true.
      end do
      if (.not. changed) exit
    end do
    call write_net(facet, facet_point, region, joined(:n), needed, twin, owner, next, start(:n), &
                   new_facet, new_point)
    call move_alloc(new_facet, facet)
    call move_alloc(new_point, facet_point)
  end subroutine merge_flat_facets

  !> Old polygons of the regions left alone, then the joined ones without needless corners.
  pure subroutine write_net(facet, facet_point, region, joined, needed, twin, owner, next, start, &
                            new_facet, new_point)
    integer, intent(in) :: facet(:), facet_point(:), region(:), twin(:), owner(:), next(:), start(:)
    logical, intent(in) :: joined(:), needed(:)
    integer, allocatable, intent(out) :: new_facet(:), new_point(:)
    integer :: first(size(facet)), point(size(facet_point)), f, e, r, m, p

    m = 1
    p = 0
    first(1) = 1
    do f = 1, size(facet) - 1
      if (joined(region(f))) cycle
      do e = facet(f), facet(f + 1) - 1
        p = p + 1
        point(p) = facet_point(e)
      end do
      m = m + 1
      first(m) = p + 1
    end do
    do r = 1, size(joined)
      if (.not. joined(r)) cycle
      e = start(r)
      do
        if (needed(facet_point(e))) then
          p = p + 1
          point(p) = facet_point(e)
        end if
        e = next_border_edge(e, region, twin, owner, next)
        if (e == start(r)) exit
      end do
      m = m + 1
      first(m) = p + 1
    end do
    new_facet = first(:m)
    new_point = point(:p)
  end subroutine write_net

  !> The other side of each directed edge; 0 if it has none or more than one.
  pure subroutine edge_twins(facet, facet_point, twin)
    integer, intent(in) :: facet(:), facet_point(:)
    integer, intent(out) :: twin(:)   !! edge e goes from corner e to the next of its polygon
    integer :: head(maxval(facet_point)), chain(size(facet_point)), finish(size(facet_point))
    integer :: owner(size(facet_point)), next(size(facet_point)), e, g, n

    call owners(facet, owner, next)
    finish = facet_point(next)
    head = 0
    do e = 1, size(facet_point)
      chain(e) = head(facet_point(e))
      head(facet_point(e)) = e
    end do
    do e = 1, size(facet_point)
      twin(e) = 0
      n = 0
      g = head(finish(e))
      do while (g > 0)
        if (finish(g) == facet_point(e)) then
          twin(e) = g
          n = n + 1
        end if
        g = chain(g)
      end do
      if (n /= 1) twin(e) = 0
    end do
  end subroutine edge_twins

  !> The polygon of each edge and the edge that follows in it.
  pure subroutine owners(facet, owner, next)
    integer, intent(in) :: facet(:)
    integer, intent(out) :: owner(:), next(:)
    integer :: f, e

    do f = 1, size(facet) - 1
      do e = facet(f), facet(f + 1) - 1
        owner(e) = f
        next(e) = merge(facet(f), e + 1, e == facet(f + 1) - 1)
      end do
    end do
  end subroutine owners

  !> Number the flat regions: polygons joined over edges that lie in the plane of the first one.
  pure subroutine find_regions(point, facet, facet_point, twin, owner, near, region, n)
    real(wp), intent(in) :: point(:, :), near
    integer, intent(in) :: facet(:), facet_point(:), twin(:), owner(:)
    integer, intent(out) :: region(:), n
    integer :: queue(size(region)), first, last, f, g, e
    real(wp) :: normal(3), origin(3)

    region = 0
    n = 0
    do f = 1, size(region)
      if (region(f) > 0) cycle
      n = n + 1
      region(f) = n
      origin = point(:, facet_point(facet(f)))
      normal = facet_normal(point(:, facet_point(facet(f):facet(f + 1) - 1)))
      queue(1) = f
      first = 1
      last = 1
      do while (first <= last)
        do e = facet(queue(first)), facet(queue(first) + 1) - 1
          if (twin(e) == 0) cycle
          g = owner(twin(e))
          if (region(g) > 0) cycle
          associate (x => point(:, facet_point(facet(g):facet(g + 1) - 1)))
            if (any(abs(matmul(normal, x - spread(origin, 2, size(x, 2)))) > near)) cycle
            if (dot_product(facet_normal(x), normal) <= 0.0_wp) cycle
          end associate
          region(g) = n
          last = last + 1
          queue(last) = g
        end do
        first = first + 1
      end do
    end do
  end subroutine find_regions

  !> Unit normal of a flat polygon.
  pure function facet_normal(x) result(normal)
    real(wp), intent(in) :: x(:, :)
    real(wp) :: normal(3)
    integer :: k

    normal = 0.0_wp
    do k = 2, size(x, 2) - 1
      normal = normal + cross(x(:, k) - x(:, 1), x(:, k + 1) - x(:, 1))
    end do
    normal = normal/norm(normal)
  end function facet_normal

  pure function at_border(e, region, twin, owner) result(yes)
    integer, intent(in) :: e, region(:), twin(:), owner(:)
    logical :: yes

    yes = twin(e) == 0
    if (.not. yes) yes = region(owner(twin(e))) /= region(owner(e))
  end function at_border

  !> The edge that follows at the border of the same region, going round inside it.
  pure function next_border_edge(e, region, twin, owner, next) result(g)
    integer, intent(in) :: e, region(:), twin(:), owner(:), next(:)
    integer :: g

    g = next(e)
    do while (.not. at_border(g, region, twin, owner))
      g = next(twin(g))
    end do
  end function next_border_edge

  !> Is the border of a region one polygon without inward corners, and not too long?
  pure function is_convex(point, facet_point, region, twin, owner, next, start, border, &
                          near) result(yes)
    real(wp), intent(in) :: point(:, :), near
    integer, intent(in) :: facet_point(:), region(:), twin(:), owner(:), next(:), start
    integer, intent(in) :: border   !! edges at the border
    logical :: yes
    real(wp) :: normal(3), total(3), origin(3), a(3), b(3)
    integer :: e, g, length, corners

    yes = .false.
    total = 0.0_wp
    origin = point(:, facet_point(start))
    length = 0
    e = start
    do
      a = point(:, facet_point(e)) - origin
      total = total + cross(a, point(:, facet_point(next(e))) - origin)
      length = length + 1
      e = next_border_edge(e, region, twin, owner, next)
      if (e == start) exit
    end do
    if (length /= border .or. norm(total) <= 0.0_wp) return
    normal = total/norm(total)
    corners = 0
    e = start
    do
      g = next_border_edge(e, region, twin, owner, next)
      a = point(:, facet_point(next(e))) - point(:, facet_point(e))
      b = point(:, facet_point(next(g))) - point(:, facet_point(g))
      if (.not. straight(a, b, near)) then
        if (dot_product(cross(a, b), normal) <= 0.0_wp) return
        corners = corners + 1
      end if
      e = g
      if (e == start) exit
    end do
    yes = corners >= 3 .and. corners <= most_facet_corners
  end function is_convex

  !> Do two edges that follow each other lie on one line?
  pure function straight(a, b, near) result(yes)
    real(wp), intent(in) :: a(3), b(3), near
    logical :: yes

    yes = norm(cross(a, b)) <= near*max(norm(a), norm(b)) .and. dot_product(a, b) > 0.0_wp
  end function straight

  !> Corners at which some polygon of the net bends: all of those left alone, the bent ones of the
  !! joined.
  pure subroutine mark_needed(point, facet, facet_point, region, joined, twin, owner, next, start, &
                              near, needed)
    real(wp), intent(in) :: point(:, :), near
    integer, intent(in) :: facet(:), facet_point(:), region(:), twin(:), owner(:), next(:), start(:)
    logical, intent(in) :: joined(:)
    logical, intent(out) :: needed(:)
    integer :: f, r, e, g

    needed = .false.
    do f = 1, size(facet) - 1
      if (.not. joined(region(f))) needed(facet_point(facet(f):facet(f + 1) - 1)) = .true.
    end do
    do r = 1, size(start)
      if (.not. joined(r)) cycle
      e = start(r)
      do
        g = next_border_edge(e, region, twin, owner, next)
        if (.not. straight(point(:, facet_point(next(e))) - point(:, facet_point(e)), &
                           point(:, facet_point(next(g))) - point(:, facet_point(g)), near)) then
          needed(facet_point(g)) = .true.
        end if
        e = g
        if (e == start(r)) exit
      end do
    end do
  end subroutine mark_needed

  !> Has the border of a region a straight corner that another polygon needs?
  pure function straight_corner_needed(point, facet_point, region, twin, owner, next, start, near, &
                                       needed) result(yes)
    real(wp), intent(in) :: point(:, :), near
    integer, intent(in) :: facet_point(:), region(:), twin(:), owner(:), next(:), start
    logical, intent(in) :: needed(:)
    logical :: yes
    integer :: e, g

    yes = .false.
    e = start
    do
      g = next_border_edge(e, region, twin, owner, next)
      yes = yes .or. (needed(facet_point(g)) .and. &
                      straight(point(:, facet_point(next(e))) - point(:, facet_point(e)), &
                               point(:, facet_point(next(g))) - point(:, facet_point(g)), near))
      e = g
      if (e == start) exit
    end do
  end function straight_corner_needed

end module surface_net_m
