!> Fewer, larger polygons for the same surface: flat regions become one polygon where they are
!! convex, and few convex ones elsewhere.
module surface_net_m
  use kinds_m, only: wp
  use vectors_m, only: cross, norm
  use polygon_m, only: area_vector
  use tet_mesh_m, only: max_facet_corners
  implicit none
  private
  public :: merge_flat_facets, edge_twins

  real(wp), parameter :: flat = 1.0e-12_wp     !! distance from a plane or line [size of the block]

  !> The net while its polygons are joined. Edge e leads from corner e to the next corner of its
  !! polygon; a piece is a set of polygons with the same label, that of one of them.
  type :: net_t
    real(wp) :: near = 0.0_wp                          !! what counts as flat [m]
    real(wp), allocatable :: x(:, :)                   !! (3, edges) where each edge begins [m]
    integer, allocatable :: twin(:), owner(:), next(:) !! of each edge; twin: the other side, or 0
    integer, allocatable :: label(:)                   !! of each polygon
    !> For each label: its polygons in a chain, their number, an edge at the border, edges there.
    integer, allocatable :: head(:), chain(:), members(:), start(:), border(:)
  end type net_t

contains

  !> Join the polygons of flat regions to convex ones, drop corners at which no polygon bends, and
  !! cut polygons at straight corners that others need. The net stays closed, its polygons flat, and
  !! every corner of a polygon bends.
  pure subroutine merge_flat_facets(point, facet, facet_point)
    real(wp), intent(in) :: point(:, :)                       !! (3, n) [m]
    integer, allocatable, intent(inout) :: facet(:)           !! (facets + 1) first corner of each
    integer, allocatable, intent(inout) :: facet_point(:)     !! corners, closed net
    type(net_t) :: net
    integer, allocatable :: region(:), new_facet(:), new_point(:)
    logical, allocatable :: done(:)
    integer :: n, f, e, g, a, b
    logical :: joined, changed

    n = size(facet) - 1
    net%near = flat*maxval(maxval(point, 2) - minval(point, 2))
    allocate (net%x(3, size(facet_point)), source=point(:, facet_point))
    allocate (net%twin(size(facet_point)), net%owner(size(facet_point)))
    allocate (net%next(size(facet_point)), region(n), done(n))
    allocate (net%label(n), net%head(n), net%chain(n), net%members(n), net%start(n), net%border(n))
    call edge_twins(facet, facet_point, net%twin)
    call owners(facet, net%owner, net%next)
    call find_regions(facet, net, region)
    net%label = region
    call gather(facet, net)
    do f = 1, n
      done(f) = net%members(f) < 2
      if (.not. done(f)) done(f) = is_convex(net, f)
    end do
    do f = 1, n
      if (.not. done(region(f))) net%label(f) = f
    end do
    call gather(facet, net)
    ! Join neighbours in the regions not done wherever the two are convex together, until no more
    ! can be.
    do
      changed = .false.
      do e = 1, size(net%owner)
        f = net%owner(e)
        if (done(region(f)) .or. net%twin(e) == 0) cycle
        g = net%owner(net%twin(e))
        if (region(f) /= region(g) .or. net%label(f) == net%label(g)) cycle
        a = merge(net%label(f), net%label(g), &
                  net%members(net%label(f)) >= net%members(net%label(g)))
        b = net%label(f) + net%label(g) - a
        call try_to_join(facet, a, b, net, joined)
        changed = changed .or. joined
      end do
      if (.not. changed) exit
    end do
    call write_net(facet_point, size(point, 2), net, new_facet, new_point)
    call move_alloc(new_facet, facet)
    call move_alloc(new_point, facet_point)
  end subroutine merge_flat_facets

  !> The other side of each directed edge; 0 if it has none or more than one.
  pure subroutine edge_twins(facet, facet_point, twin)
    integer, intent(in) :: facet(:), facet_point(:)
    integer, intent(out) :: twin(:)   !! edge e goes from corner e to the next of its polygon
    integer, allocatable :: head(:), chain(:), finish(:), owner(:), next(:)
    integer :: e, g, n

    n = size(facet_point)
    allocate (head(maxval(facet_point)), chain(n), finish(n), owner(n), next(n))
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

  !> Label the flat regions with their first polygons: those joined over edges that lie in the plane
  !! of the first one.
  pure subroutine find_regions(facet, net, region)
    integer, intent(in) :: facet(:)
    type(net_t), intent(in) :: net
    integer, intent(out) :: region(:)
    integer, allocatable :: queue(:)
    integer :: first, last, f, g, e
    real(wp) :: normal(3), origin(3)

    allocate (queue(size(region)))
    region = 0
    do f = 1, size(region)
      if (region(f) > 0) cycle
      region(f) = f
      origin = net%x(:, facet(f))
      normal = area_vector(net%x(:, facet(f):facet(f + 1) - 1))
      normal = normal/norm(normal)
      queue(1) = f
      first = 1
      last = 1
      do while (first <= last)
        do e = facet(queue(first)), facet(queue(first) + 1) - 1
          if (net%twin(e) == 0) cycle
          g = net%owner(net%twin(e))
          if (region(g) > 0) cycle
          associate (x => net%x(:, facet(g):facet(g + 1) - 1))
            if (any(abs(matmul(normal, x - spread(origin, 2, size(x, 2)))) > net%near)) cycle
            if (dot_product(area_vector(x), normal) <= 0.0_wp) cycle
          end associate
          region(g) = f
          last = last + 1
          queue(last) = g
        end do
        first = first + 1
      end do
    end do
  end subroutine find_regions

  !> Chains, border edges and border lengths of all labels.
  pure subroutine gather(facet, net)
    integer, intent(in) :: facet(:)
    type(net_t), intent(inout) :: net
    integer :: f, e

    net%head = 0
    net%members = 0
    net%start = 0
    net%border = 0
    do f = size(facet) - 1, 1, -1
      associate (l => net%label(f))
        net%chain(f) = net%head(l)
        net%head(l) = f
        net%members(l) = net%members(l) + 1
        do e = facet(f), facet(f + 1) - 1
          if (.not. at_border(e, net)) cycle
          net%border(l) = net%border(l) + 1
          net%start(l) = e
        end do
      end associate
    end do
  end subroutine gather

  !> Give piece b the label of a, if the two are convex together.
  pure subroutine try_to_join(facet, a, b, net, joined)
    integer, intent(in) :: facet(:), a, b
    type(net_t), intent(inout) :: net
    logical, intent(out) :: joined
    integer :: f, e, last, old_start, old_border

    old_start = net%start(a)
    old_border = net%border(a)
    net%border(a) = net%border(a) + net%border(b)
    f = net%head(b)
    last = f
    do while (f > 0)
      do e = facet(f), facet(f + 1) - 1
        if (net%twin(e) == 0) cycle
        if (net%label(net%owner(net%twin(e))) == a) net%border(a) = net%border(a) - 2
      end do
      last = f
      f = net%chain(f)
    end do
    net%chain(last) = net%head(a)   ! b before a
    f = net%head(b)
    do
      net%label(f) = a
      if (f == last) exit
      f = net%chain(f)
    end do
    net%start(a) = 0   ! an edge at the border of the new piece
    f = net%head(b)
    find: do while (f > 0)
      do e = facet(f), facet(f + 1) - 1
        if (.not. at_border(e, net)) cycle
        net%start(a) = e
        exit find
      end do
      f = net%chain(f)
    end do find
    joined = is_convex(net, a)
    if (joined) then
      net%head(a) = net%head(b)
      net%members(a) = net%members(a) + net%members(b)
      return
    end if
    net%start(a) = old_start
    net%border(a) = old_border
    net%chain(last) = 0
    f = net%head(b)
    do while (f > 0)
      net%label(f) = b
      f = net%chain(f)
    end do
  end subroutine try_to_join

  !> Does an edge part two pieces?
  pure function at_border(e, net) result(yes)
    integer, intent(in) :: e
    type(net_t), intent(in) :: net
    logical :: yes

    yes = net%twin(e) == 0
    if (.not. yes) yes = net%label(net%owner(net%twin(e))) /= net%label(net%owner(e))
  end function at_border

  !> The edge that follows at the border of the same piece, going round inside it.
  pure function next_at_border(e, net) result(g)
    integer, intent(in) :: e
    type(net_t), intent(in) :: net
    integer :: g

    g = net%next(e)
    do while (.not. at_border(g, net))
      g = net%next(net%twin(g))
    end do
  end function next_at_border

  !> Is the border of a piece one polygon without inward corners, and not too long?
  pure function is_convex(net, label) result(yes)
    type(net_t), intent(in) :: net
    integer, intent(in) :: label
    logical :: yes
    real(wp) :: total(3), origin(3), a(3), b(3)
    integer :: e, g, length, corners

    yes = .false.
    total = 0.0_wp
    length = 0
    e = net%start(label)
    if (e == 0) return
    origin = net%x(:, e)
    do
      total = total + cross(net%x(:, e) - origin, net%x(:, net%next(e)) - origin)
      length = length + 1
      e = next_at_border(e, net)
      if (e == net%start(label)) exit
    end do
    if (length /= net%border(label)) return
    corners = 0
    do
      g = next_at_border(e, net)
      a = net%x(:, net%next(e)) - net%x(:, e)
      b = net%x(:, net%next(g)) - net%x(:, g)
      if (.not. straight(a, b, net%near)) then
        if (dot_product(cross(a, b), total) <= 0.0_wp) return
        corners = corners + 1
      end if
      e = g
      if (e == net%start(label)) exit
    end do
    yes = corners >= 3 .and. corners <= max_facet_corners
  end function is_convex

  !> Do two edges that follow each other lie on one line?
  pure function straight(a, b, near) result(yes)
    real(wp), intent(in) :: a(3), b(3), near
    logical :: yes

    yes = norm(cross(a, b)) <= near*max(norm(a), norm(b)) .and. dot_product(a, b) > 0.0_wp
  end function straight

  !> The pieces as polygons, without the corners at which no piece bends.
  pure subroutine write_net(facet_point, n_point, net, new_facet, new_point)
    integer, intent(in) :: facet_point(:), n_point
    type(net_t), intent(in) :: net
    integer, allocatable, intent(out) :: new_facet(:), new_point(:)
    integer, allocatable :: edge(:), first(:), corner(:)
    logical, allocatable :: needed(:)
    integer :: f, e, g, n, m, p

    allocate (needed(n_point), source=.false.)
    allocate (edge(size(facet_point)))
    do f = 1, size(net%label)
      if (net%label(f) /= f) cycle
      e = net%start(f)
      do
        g = next_at_border(e, net)
        if (.not. straight(net%x(:, net%next(e)) - net%x(:, e), &
                           net%x(:, net%next(g)) - net%x(:, g), net%near)) then
          needed(facet_point(g)) = .true.
        end if
        e = g
        if (e == net%start(f)) exit
      end do
    end do
    allocate (first(size(facet_point)), corner(3*size(facet_point)))
    first(1) = 1
    m = 0
    p = 0
    do f = 1, size(net%label)
      if (net%label(f) /= f) cycle
      n = 0
      e = net%start(f)
      do
        if (needed(facet_point(e))) then
          n = n + 1
          edge(n) = e
        end if
        e = next_at_border(e, net)
        if (e == net%start(f)) exit
      end do
      call cut_at_straight_corners(edge(:n), facet_point, net, first, corner, m, p)
    end do
    new_facet = first(:m + 1)
    new_point = corner(:p)
  end subroutine write_net

  !> Write a convex polygon; one with straight corners is cut in two at such a corner, and so on.
  pure recursive subroutine cut_at_straight_corners(edge, facet_point, net, first, corner, m, p)
    integer, intent(in) :: edge(:), facet_point(:)   !! edges that begin at its corners
    type(net_t), intent(in) :: net
    integer, intent(inout) :: first(:), corner(:)
    integer, intent(inout) :: m, p                   !! polygons and corners written
    integer :: k, l, n, far
    real(wp) :: side(3), onward(3), height, highest

    n = size(edge)
    do k = 1, n
      side = net%x(:, edge(k)) - net%x(:, edge(1 + modulo(k - 2, n)))
      onward = net%x(:, edge(1 + modulo(k, n))) - net%x(:, edge(k))
      if (.not. straight(side, onward, net%near)) cycle
      highest = 0.0_wp
      far = k
      do l = 1, n
        height = norm(cross(side, net%x(:, edge(l)) - net%x(:, edge(k))))
        if (height <= highest) cycle
        highest = height
        far = l
      end do
      call cut_at_straight_corners(edge(part(k, far)), facet_point, net, first, corner, m, p)
      call cut_at_straight_corners(edge(part(far, k)), facet_point, net, first, corner, m, p)
      return
    end do
    corner(p + 1:p + n) = facet_point(edge)
    p = p + n
    m = m + 1
    first(m + 1) = p + 1
  contains
    !> Places from a to b, going round.
    pure function part(a, b) result(places)
      integer, intent(in) :: a, b
      integer :: places(1 + modulo(b - a, n))
      integer :: i

      places = [(1 + modulo(a - 1 + i, n), i=0, modulo(b - a, n))]
    end function part
  end subroutine cut_at_straight_corners

end module surface_net_m
