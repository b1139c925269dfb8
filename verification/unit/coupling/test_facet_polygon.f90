!> Flat polygons cut along grid planes: corners on planes, ranges of cells, shared ends.
!> test_solid_fraction sees whether the pieces fill the whole.
module test_facet_polygon_m
  use check_m, only: check, wp
  use facet_polygon_m, only: polygon_t, cut_by_plane, cells_between, centres_between, &
    value_on_line, point_at
  implicit none
  private
  public :: test_facet_polygon

contains

  subroutine test_facet_polygon()
    call corners_on_a_plane()
    call ranges()
    call the_same_from_either_end()
  end subroutine test_facet_polygon

  !> Corners on the plane count as below: a polygon that only touches it from below has no line.
  subroutine corners_on_a_plane()
    type(polygon_t) :: p
    real(wp) :: line(3, 2, 4)
    integer :: n

    p%n = 3
    p%x(:, :3) = reshape([0, 0, 0, 1, 0, 1, 0, 1, 0]*1.0_wp, [3, 3])
    call cut_by_plane(p, 3, 1.0_wp, line, n)
    call check('touched from below: none', n, 0)
    call cut_by_plane(p, 3, 0.0_wp, line, n)
    call check('an edge on the plane: just above it', n, 1)
    call check('along the edge', line(1, :, 1), 0.0_wp)
  end subroutine corners_on_a_plane

  !> Points on a plane belong to the cell above; the lower end of a line counts, the upper not.
  subroutine ranges()
    integer :: first(5), last(5)

    call cells_between(0.0_wp, 2.0_wp, first(1), last(1))      ! from plane to plane
    call cells_between(2.0_wp, 2.0_wp, first(2), last(2))      ! a point on a plane
    call centres_between(1.5_wp, 3.5_wp, first(3), last(3))
    call centres_between(3.4_wp, 1.6_wp, first(4), last(4))    ! in any order
    call centres_between(1.6_wp, 2.4_wp, first(5), last(5))    ! none
    call check('from the first', all(first(:4) == [1, 3, 2, 3]))
    call check('to the last', all(last(:4) == [2, 3, 3, 3]))
    call check('no centre between', first(5) > last(5))
  end subroutine ranges

  !> Neighbours share edges, so a point on one has the same bits whichever end comes first.
  subroutine the_same_from_either_end()
    real(wp), parameter :: a(3) = [0.1_wp, 0.7_wp, -0.3_wp], b(3) = [1.3_wp, -0.9_wp, 2.1_wp]
    real(wp) :: x(2)

    x(1) = value_on_line(a, b, 1, 0.77_wp, 3)
    call check('on the line', x(1), -0.3_wp + 2.4_wp*0.67_wp/1.2_wp, 1.0e-15_wp)
    call check('the same bits', value_on_line(b, a, 1, 0.77_wp, 3), x(1))
    call check('falling', value_on_line(a, b, 2, -0.1_wp, 1), value_on_line(b, a, 2, -0.1_wp, 1))
    x = point_at(a(1:2), b(1:2), 1, 0.7_wp)
    call check('half way', x, [0.7_wp, -0.1_wp], 1.0e-15_wp)
  end subroutine the_same_from_either_end

end module test_facet_polygon_m
