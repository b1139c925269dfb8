!> Convex polyhedra cut by planes: volume and first moment, without allocation.
!!
!! A polyhedron is kept as its corners and, for each corner, the three corners it is joined to.
!! Cutting by a plane decides once per corner (`n.x <= d` is kept, so nothing is lost or counted
!! twice when corners lie on the plane), puts new corners on the edges that cross and joins them;
!! only signs enter the topology. Source: corner graph of Powell & Abel (2015), arXiv 1412.4941.
module polyhedron_m
  use kinds_m, only: wp
  implicit none
  private
  public :: polyhedron_t, max_corners
  public :: polyhedron_of_tet, polyhedron_of_box, cut_polyhedron, cut_polyhedron_by_box
  public :: polyhedron_moments, polyhedron_moments_below, polyhedron_faces
  public :: tet_volume, tet_moments_below, clip_tet_to_box, box_clip_moments_below

  integer, parameter :: max_corners = 64   !! a polyhedron of up to 30 faces can be cut safely

  type :: polyhedron_t
    integer :: n = 0                     !! corners in use; 0: empty
    real(wp) :: x(3, max_corners)        !! [m]
    !> The three neighbours of each corner, counter-clockwise as seen from outside.
    integer :: adjacent(3, max_corners)
  end type polyhedron_t

  integer, parameter :: before(3) = [3, 1, 2]   !! slot before a slot of `adjacent`, cyclic

contains

  !> Volume of a tetrahedron, positive if 2, 3, 4 turn clockwise as seen from 1 [m3].
  pure function tet_volume(corner) result(volume)
    real(wp), intent(in) :: corner(3, 4)   !! [m]
    real(wp) :: volume
    real(wp) :: a(3), b(3), c(3)

    a = corner(:, 2) - corner(:, 1)
    b = corner(:, 3) - corner(:, 1)
    c = corner(:, 4) - corner(:, 1)
    volume = triple(a, b, c)/6.0_wp
  end function tet_volume

  !> a . (b x c)
  pure function triple(a, b, c) result(t)
    real(wp), intent(in) :: a(3), b(3), c(3)
    real(wp) :: t

    t = a(1)*(b(2)*c(3) - b(3)*c(2)) + a(2)*(b(3)*c(1) - b(1)*c(3)) + a(3)*(b(1)*c(2) - b(2)*c(1))
  end function triple

  !> Corners of a tetrahedron sorted: those below the plane first; their heights above it.
  pure subroutine sort_by_side(corner, n, d, s, order, n_below)
    real(wp), intent(in) :: corner(3, 4), n(3), d
    real(wp), intent(out) :: s(4)          !! n.x - d of the corners in the new order
    integer, intent(out) :: order(4), n_below
    real(wp) :: height
    integer :: v, n_above

    n_below = 0
    n_above = 0
    do v = 1, 4
      height = n(1)*corner(1, v) + n(2)*corner(2, v) + n(3)*corner(3, v) - d
      if (height <= 0.0_wp) then
        n_below = n_below + 1
        s(n_below) = height
        order(n_below) = v
      else
        s(4 - n_above) = height
        order(4 - n_above) = v
        n_above = n_above + 1
      end if
    end do
  end subroutine sort_by_side

  !> Share below the plane of the edge from height a up to height b [-].
  pure function share_below(a, b) result(t)
    real(wp), intent(in) :: a   !! <= 0
    real(wp), intent(in) :: b   !! > 0
    real(wp) :: t

    t = a/(a - b)
  end function share_below

  !> Volume and first moment of the part of a tetrahedron with `n.x <= d`.
  pure subroutine tet_moments_below(corner, n, d, volume, moment)
    real(wp), intent(in) :: corner(3, 4)   !! in any order [m]
    real(wp), intent(in) :: n(3), d        !! plane; n need not be a unit vector
    real(wp), intent(out) :: volume        !! [m3]
    real(wp), intent(out) :: moment(3)     !! integral of x [m4]
    real(wp) :: s(4), c(3, 4), e(3, 4)
    integer :: order(4), n_below, v

    volume = 0.0_wp
    moment = 0.0_wp
    call sort_by_side(corner, n, d, s, order, n_below)
    c = corner(:, order)
    select case (n_below)
    case (1)
      do v = 2, 4
        e(:, v) = on_edge(c, s, 1, v)
      end do
      call add_tet(c(:, 1), e(:, 2), e(:, 3), e(:, 4), volume, moment)
    case (2)
      e(:, 1) = on_edge(c, s, 1, 3)
      e(:, 2) = on_edge(c, s, 1, 4)
      e(:, 3) = on_edge(c, s, 2, 3)
      e(:, 4) = on_edge(c, s, 2, 4)
      call add_tet(c(:, 1), c(:, 2), e(:, 1), e(:, 2), volume, moment)
      call add_tet(c(:, 2), e(:, 1), e(:, 2), e(:, 4), volume, moment)
      call add_tet(c(:, 2), e(:, 1), e(:, 4), e(:, 3), volume, moment)
    case (3)
      do v = 1, 3
        e(:, v) = on_edge(c, s, v, 4)
      end do
      call add_tet(c(:, 1), c(:, 2), c(:, 3), e(:, 1), volume, moment)
      call add_tet(e(:, 1), c(:, 2), c(:, 3), e(:, 2), volume, moment)
      call add_tet(e(:, 1), e(:, 2), c(:, 3), e(:, 3), volume, moment)
    case (4)
      call add_tet(c(:, 1), c(:, 2), c(:, 3), c(:, 4), volume, moment)
    case default
      return   ! none below
    end select
  end subroutine tet_moments_below

  !> Where the edge from corner a (below) to corner b (above) meets the plane [m].
  pure function on_edge(c, s, a, b) result(x)
    real(wp), intent(in) :: c(3, 4), s(4)
    integer, intent(in) :: a, b
    real(wp) :: x(3)

    x = c(:, a) + share_below(s(a), s(b))*(c(:, b) - c(:, a))
  end function on_edge

  !> Add a tetrahedron to a volume and first moment.
  pure subroutine add_tet(p1, p2, p3, p4, volume, moment)
    real(wp), intent(in) :: p1(3), p2(3), p3(3), p4(3)
    real(wp), intent(inout) :: volume, moment(3)
    real(wp) :: v

    v = abs(triple(p2 - p1, p3 - p1, p4 - p1))/6.0_wp
    volume = volume + v
    moment = moment + 0.25_wp*v*(p1 + p2 + p3 + p4)
  end subroutine add_tet

  !> The polyhedron of a tetrahedron, whatever the order of its corners.
  pure subroutine polyhedron_of_tet(corner, p)
    real(wp), intent(in) :: corner(3, 4)   !! [m]
    type(polyhedron_t), intent(out) :: p

    p%n = 4
    p%x(:, 1:4) = corner
    if (tet_volume(corner) < 0.0_wp) p%x(:, 3:4) = corner(:, 4:3:-1)
    p%adjacent(:, 1) = [2, 4, 3]
    p%adjacent(:, 2) = [1, 3, 4]
    p%adjacent(:, 3) = [1, 4, 2]
    p%adjacent(:, 4) = [1, 2, 3]
  end subroutine polyhedron_of_tet

  !> The polyhedron of a box; corner 1 + a + 2b + 4c takes `hi` in x, y, z where a, b, c = 1.
  pure subroutine polyhedron_of_box(lo, hi, p)
    real(wp), intent(in) :: lo(3), hi(3)   !! lo < hi [m]
    type(polyhedron_t), intent(out) :: p
    integer :: v, d, bit(3), step(3)

    p%n = 8
    do v = 1, 8
      do d = 1, 3
        bit(d) = ibits(v - 1, d - 1, 1)
        p%x(d, v) = merge(hi(d), lo(d), bit(d) == 1)
        step(d) = v + merge(-1, 1, bit(d) == 1)*2**(d - 1)
      end do
      if (mod(sum(bit), 2) == 0) then
        p%adjacent(:, v) = [step(1), step(3), step(2)]
      else
        p%adjacent(:, v) = step
      end if
    end do
  end subroutine polyhedron_of_box

  !> Keep the part with `n.x <= d`.
  pure subroutine cut_polyhedron(p, n, d)
    type(polyhedron_t), intent(inout) :: p
    real(wp), intent(in) :: n(3), d   !! n need not be a unit vector
    real(wp) :: s(max_corners)
    integer :: v

    do v = 1, p%n
      s(v) = n(1)*p%x(1, v) + n(2)*p%x(2, v) + n(3)*p%x(3, v) - d
    end do
    call cut_at_heights(p, s)
  end subroutine cut_polyhedron

  !> Keep the part inside a box.
  pure subroutine cut_polyhedron_by_box(p, lo, hi)
    type(polyhedron_t), intent(inout) :: p
    real(wp), intent(in) :: lo(3), hi(3)   !! [m]
    real(wp) :: s(max_corners)
    integer :: d, m

    do d = 1, 3
      m = p%n
      s(1:m) = p%x(d, 1:m) - hi(d)
      if (any(s(1:m) > 0.0_wp)) call cut_at_heights(p, s)
      m = p%n
      s(1:m) = lo(d) - p%x(d, 1:m)
      if (any(s(1:m) > 0.0_wp)) call cut_at_heights(p, s)
    end do
  end subroutine cut_polyhedron_by_box

  !> Remove the corners of positive height; new corners where edges cross zero, joined in a face.
  pure subroutine cut_at_heights(p, s)
    type(polyhedron_t), intent(inout) :: p
    real(wp), intent(in) :: s(max_corners)   !! height of each corner above the plane [any]
    integer :: v, w, slot, n_old, n_new, start, here, from, to, step

    n_old = p%n
    n_new = n_old
    do v = 1, n_old
      if (s(v) > 0.0_wp) cycle
      do slot = 1, 3
        w = p%adjacent(slot, v)
        if (s(w) <= 0.0_wp) cycle
        n_new = n_new + 1
        p%x(:, n_new) = p%x(:, v) + share_below(s(v), s(w))*(p%x(:, w) - p%x(:, v))
        p%adjacent(:, n_new) = [v, 0, 0]
        p%adjacent(slot, v) = n_new
      end do
    end do
    if (n_new == n_old) then
      if (all(s(1:n_old) > 0.0_wp)) p%n = 0
      return
    end if
    p%n = n_new
    ! Join the new corners (numbers above n_old) along the faces they cut. From a new corner, walk
    ! its face through the part that stays up to the other new corner of that face: the new edge
    ! leads back from there.
    do start = n_old + 1, p%n
      from = start
      here = p%adjacent(1, start)
      do step = 1, p%n
        to = p%adjacent(before(slot_of(p%adjacent(:, here), from)), here)
        from = here
        here = to
        if (here > n_old) exit
      end do
      p%adjacent(2, start) = here
      p%adjacent(3, here) = start
    end do
    call drop_corners(p, n_old, s)
  end subroutine cut_at_heights

  !> Slot of a neighbour in the list of a corner.
  pure function slot_of(adjacent, neighbour) result(slot)
    integer, intent(in) :: adjacent(3), neighbour
    integer :: slot

    slot = 3
    if (adjacent(1) == neighbour) slot = 1
    if (adjacent(2) == neighbour) slot = 2
  end function slot_of

  !> Number the corners anew without those of positive height.
  pure subroutine drop_corners(p, n_old, s)
    type(polyhedron_t), intent(inout) :: p
    integer, intent(in) :: n_old
    real(wp), intent(in) :: s(max_corners)
    integer :: number(max_corners), v, n

    n = 0
    do v = 1, p%n
      if (v <= n_old) then
        if (s(v) > 0.0_wp) cycle
      end if
      n = n + 1
      number(v) = n
      p%x(:, n) = p%x(:, v)
      p%adjacent(:, n) = p%adjacent(:, v)
    end do
    do v = 1, n
      p%adjacent(:, v) = number(p%adjacent(:, v))
    end do
    p%n = n
  end subroutine drop_corners

  !> Volume and first moment, by tetrahedra from one corner over the triangles of the faces.
  pure subroutine polyhedron_moments(p, volume, moment)
    type(polyhedron_t), intent(in) :: p
    real(wp), intent(out) :: volume      !! [m3]
    real(wp), intent(out) :: moment(3)   !! integral of x [m4]
    logical :: done(3, max_corners)
    real(wp) :: a(3), b(3), c(3), six_v
    integer :: v, slot, from, here, to, at, step

    volume = 0.0_wp
    moment = 0.0_wp
    if (p%n == 0) return
    done(:, 1:p%n) = .false.
    do v = 1, p%n
      do slot = 1, 3
        if (done(slot, v)) cycle
        done(slot, v) = .true.
        a = p%x(:, v) - p%x(:, 1)
        from = v
        here = p%adjacent(slot, v)
        b = p%x(:, here) - p%x(:, 1)
        do step = 1, p%n
          at = before(slot_of(p%adjacent(:, here), from))
          done(at, here) = .true.
          to = p%adjacent(at, here)
          if (to == v) exit
          c = p%x(:, to) - p%x(:, 1)
          six_v = triple(a, b, c)
          volume = volume + six_v
          moment = moment + six_v*(a + b + c)
          b = c
          from = here
          here = to
        end do
      end do
    end do
    volume = volume/6.0_wp
    moment = moment/24.0_wp + volume*p%x(:, 1)
  end subroutine polyhedron_moments

  !> Faces of a polyhedron: face f has the corners `corner(first(f):first(f + 1) - 1)` in order.
  pure subroutine polyhedron_faces(p, n_faces, first, corner)
    type(polyhedron_t), intent(in) :: p
    integer, intent(out) :: n_faces, first(:)   !! a polyhedron of n corners has n/2 + 2 faces
    integer, intent(out) :: corner(:)           !! (3*n)
    logical :: done(3, max_corners)
    integer :: v, slot, from, here, at, m

    done = .false.
    n_faces = 0
    m = 0
    do v = 1, p%n
      do slot = 1, 3
        if (done(slot, v)) cycle
        n_faces = n_faces + 1
        first(n_faces) = m + 1
        from = v
        at = slot
        do
          done(at, from) = .true.
          m = m + 1
          corner(m) = from
          here = p%adjacent(at, from)
          at = before(slot_of(p%adjacent(:, here), from))
          from = here
          if (from == v) exit
        end do
      end do
    end do
    first(n_faces + 1) = m + 1
  end subroutine polyhedron_faces

  !> Volume and first moment of the part with `n.x <= d`; the polyhedron stays as it is.
  pure subroutine polyhedron_moments_below(p, n, d, volume, moment)
    type(polyhedron_t), intent(in) :: p
    real(wp), intent(in) :: n(3), d
    real(wp), intent(out) :: volume, moment(3)   !! [m3], [m4]
    type(polyhedron_t) :: part

    ! Copy the corners in use only.
    part%n = p%n
    part%x(:, 1:p%n) = p%x(:, 1:p%n)
    part%adjacent(:, 1:p%n) = p%adjacent(:, 1:p%n)
    call cut_polyhedron(part, n, d)
    call polyhedron_moments(part, volume, moment)
  end subroutine polyhedron_moments_below

  !> The part of a tetrahedron in a box; cut it again by planes with `polyhedron_moments_below`.
  pure subroutine clip_tet_to_box(corner, lo, hi, p)
    real(wp), intent(in) :: corner(3, 4)   !! [m]
    real(wp), intent(in) :: lo(3), hi(3)   !! [m]
    type(polyhedron_t), intent(out) :: p

    call polyhedron_of_tet(corner, p)
    call cut_polyhedron_by_box(p, lo, hi)
  end subroutine clip_tet_to_box

  !> Volume and first moment of the part of a tetrahedron that lies in a box and below a plane.
  pure subroutine box_clip_moments_below(corner, lo, hi, n, d, volume, moment)
    real(wp), intent(in) :: corner(3, 4)         !! [m]
    real(wp), intent(in) :: lo(3), hi(3)         !! [m]
    real(wp), intent(in) :: n(3), d              !! `n.x <= d` is below
    real(wp), intent(out) :: volume, moment(3)   !! [m3], [m4]
    type(polyhedron_t) :: p

    if (all(minval(corner, 2) >= lo) .and. all(maxval(corner, 2) <= hi)) then
      call tet_moments_below(corner, n, d, volume, moment)
      return
    end if
    call clip_tet_to_box(corner, lo, hi, p)
    call cut_polyhedron(p, n, d)
    call polyhedron_moments(p, volume, moment)
  end subroutine box_clip_moments_below

end module polyhedron_m
