!> Flat polygons cut along grid planes, and where lines pass cells. Lengths are in cells.
module facet_polygon_m
  use kinds_m, only: wp
  use tet_mesh_m, only: max_facet_corners
  implicit none
  private
  public :: polygon_t, clip_to_cells, cut_by_plane
  public :: cells_between, centres_between, value_on_line, point_at

  integer, parameter :: max_polygon = max_facet_corners + 12   !! corners of a facet cut to a cell

  !> Flat polygon.
  type :: polygon_t
    integer :: n = 0
    real(wp) :: x(3, max_polygon)
  end type polygon_t

contains

  !> The part of a polygon between the lower and the upper plane of cell i in direction d.
  pure subroutine clip_to_cells(p, d, i, low, high, part)
    type(polygon_t), intent(in) :: p
    integer, intent(in) :: d, i
    real(wp), intent(in) :: low, high     !! range of the polygon in direction d, or more [cells]
    type(polygon_t), intent(inout) :: part
    type(polygon_t) :: above

    if (low >= real(i - 1, wp)) then
      if (high <= real(i, wp)) then
        part%n = p%n
        part%x(:, :p%n) = p%x(:, :p%n)
      else
        call clip(p, d, real(i, wp), .false., part)
      end if
    else if (high <= real(i, wp)) then
      call clip(p, d, real(i - 1, wp), .true., part)
    else
      call clip(p, d, real(i - 1, wp), .true., above)
      call clip(above, d, real(i, wp), .false., part)
    end if
  end subroutine clip_to_cells

  !> Keep the part of a polygon above or below a plane, both with the plane itself.
  pure subroutine clip(p, d, plane, keep_above, part)
    type(polygon_t), intent(in) :: p
    integer, intent(in) :: d
    real(wp), intent(in) :: plane
    logical, intent(in) :: keep_above
    type(polygon_t), intent(inout) :: part
    real(wp) :: side, here, before
    integer :: v, w, n

    n = 0
    if (p%n > 0) then
      side = merge(1.0_wp, -1.0_wp, keep_above)
      w = p%n
      before = side*(p%x(d, w) - plane)
      do v = 1, p%n
        here = side*(p%x(d, v) - plane)
        if (here*before < 0.0_wp) then
          n = n + 1
          part%x(:, n) = crossing(p%x(:, w), p%x(:, v), d, plane)
        end if
        if (here >= 0.0_wp) then
          n = n + 1
          part%x(:, n) = p%x(:, v)
        end if
        w = v
        before = here
      end do
    end if
    part%n = n
  end subroutine clip

  !> Lines in which a polygon meets the plane x(d) = plane, from where its outline rises through the
  !! plane to where it falls; a flat convex polygon has one or none. Corners on the plane are below.
  pure subroutine cut_by_plane(p, d, plane, line, n)
    type(polygon_t), intent(in) :: p
    integer, intent(in) :: d
    real(wp), intent(in) :: plane
    real(wp), intent(inout) :: line(3, 2, 4)
    integer, intent(out) :: n
    logical :: above, was_above
    integer :: v, w, rising, falling

    rising = 0
    falling = 0
    w = p%n
    was_above = p%x(d, w) > plane
    do v = 1, p%n
      above = p%x(d, v) > plane
      if (above .neqv. was_above) then
        if (above .and. rising < 4) then
          rising = rising + 1
          line(:, 1, rising) = crossing(p%x(:, w), p%x(:, v), d, plane)
        else if (.not. above .and. falling < 4) then
          falling = falling + 1
          line(:, 2, falling) = crossing(p%x(:, w), p%x(:, v), d, plane)
        end if
      end if
      w = v
      was_above = above
    end do
    n = min(rising, falling)
  end subroutine cut_by_plane

  !> Where the edge between two points meets a plane; the same bits from either end.
  pure function crossing(a, b, d, plane) result(x)
    real(wp), intent(in) :: a(3), b(3)
    integer, intent(in) :: d
    real(wp), intent(in) :: plane
    real(wp) :: x(3)

    if (a(d) < b(d)) then
      x = a + (plane - a(d))/(b(d) - a(d))*(b - a)
    else
      x = b + (plane - b(d))/(a(d) - b(d))*(a - b)
    end if
    x(d) = plane
  end function crossing

  !> Cells that hold the stretch from a to b; a point on a plane belongs to the cell above it.
  pure subroutine cells_between(a, b, first, last)
    real(wp), intent(in) :: a, b          !! a <= b [cells]
    integer, intent(out) :: first, last

    first = floor(a) + 1
    last = max(first, ceiling(b))
  end subroutine cells_between

  !> Cells whose centre a line from a to b passes; its lower end counts, its upper end does not.
  pure subroutine centres_between(a, b, first, last)
    real(wp), intent(in) :: a, b          !! in any order [cells]
    integer, intent(out) :: first, last

    first = ceiling(min(a, b) + 0.5_wp)
    last = ceiling(max(a, b) + 0.5_wp) - 1
  end subroutine centres_between

  !> Coordinate e of the point of a line where its coordinate d has a given value.
  pure function value_on_line(a, b, d, value, e) result(x)
    real(wp), intent(in) :: a(3), b(3)
    integer, intent(in) :: d, e
    real(wp), intent(in) :: value
    real(wp) :: x

    if (a(d) < b(d)) then
      x = a(e) + (value - a(d))/(b(d) - a(d))*(b(e) - a(e))
    else
      x = b(e) + (value - b(d))/(a(d) - b(d))*(a(e) - b(e))
    end if
  end function value_on_line

  !> Point of a line in the plane where coordinate m has a value between those of its ends.
  pure function point_at(a, b, m, value) result(x)
    real(wp), intent(in) :: a(2), b(2)   !! a(m) < b(m)
    integer, intent(in) :: m
    real(wp), intent(in) :: value
    real(wp) :: x(2)

    x = a + (value - a(m))/(b(m) - a(m))*(b - a)
    x(m) = value
  end function point_at

end module facet_polygon_m
