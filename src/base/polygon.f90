!> Polygons in space.
module polygon_m
  use kinds_m, only: wp
  use vectors_m, only: cross
  implicit none
  private
  public :: clip_polygon, area_vector

contains

  !> Area of a flat polygon times the unit normal of the side from which its corners run
  !! counter-clockwise [m2].
  pure function area_vector(p) result(area)
    real(wp), intent(in) :: p(:, :)   !! (3, n) corners [m]
    real(wp) :: area(3)
    integer :: c

    area = 0.0_wp
    do c = 2, size(p, 2) - 1
      area = area + 0.5_wp*cross(p(:, c) - p(:, 1), p(:, c + 1) - p(:, 1))
    end do
  end function area_vector

  !> Keep the part of a convex polygon where side*(x(d) - plane) >= 0; it has one corner more at
  !! most.
  pure subroutine clip_polygon(d, plane, side, n, p)
    integer, intent(in) :: d
    real(wp), intent(in) :: plane, side
    integer, intent(inout) :: n
    real(wp), intent(inout) :: p(:, :)   !! (3, at least n + 1)
    real(wp) :: old(3, n), here, before
    integer :: v, w

    if (n == 0) return
    old = p(:, :n)
    w = n
    n = 0
    before = side*(old(d, w) - plane)
    do v = 1, size(old, 2)
      here = side*(old(d, v) - plane)
      if (here*before < 0.0_wp) then
        n = n + 1
        p(:, n) = old(:, w) + before/(before - here)*(old(:, v) - old(:, w))
        p(d, n) = plane
      end if
      if (here >= 0.0_wp) then
        n = n + 1
        p(:, n) = old(:, v)
      end if
      w = v
      before = here
    end do
  end subroutine clip_polygon

end module polygon_m
