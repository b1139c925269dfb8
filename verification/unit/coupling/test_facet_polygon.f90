!> Flat polygons cut along grid planes: pieces that fill the whole, lines that meet, shared ends.
module test_facet_polygon_m
  use check_m, only: check, wp
  use vectors_m, only: cross
  use facet_polygon_m, only: polygon_t, clip_to_cells, cut_by_plane, cells_between, &
    centres_between, value_on_line, point_at
  implicit none
  private
  public :: test_facet_polygon

  type(polygon_t) :: hexagon

contains

  subroutine test_facet_polygon()
    hexagon = slanted_hexagon()
    call pieces_fill_the_whole()
    call lines_in_planes()
    call corners_on_a_plane()
    call ranges()
    call the_same_from_either_end()
  end subroutine test_facet_polygon

  !> A hexagon in the plane z = 0.3 x - 0.7 y + 1, a few cells wide.
  function slanted_hexagon() result(p)
    type(polygon_t) :: p
    real(wp) :: angle
    integer :: v

    p%n = 6
    p%x = 0.0_wp
    do v = 1, 6
      angle = 0.2_wp + 1.0471975511965976_wp*v
      p%x(1:2, v) = [0.37_wp, -0.21_wp] + 2.3_wp*[cos(angle), sin(angle)]
      p%x(3, v) = 0.3_wp*p%x(1, v) - 0.7_wp*p%x(2, v) + 1.0_wp
    end do
  end function slanted_hexagon

  !> Twice the area as a vector.
  pure function area(p) result(a)
    type(polygon_t), intent(in) :: p
    real(wp) :: a(3)
    integer :: v

    a = 0.0_wp
    do v = 3, p%n
      a = a + cross(p%x(:, v - 1) - p%x(:, 1), p%x(:, v) - p%x(:, 1))
    end do
  end function area

  !> The pieces in the cells of each direction lie in their cells and add up to the polygon.
  subroutine pieces_fill_the_whole()
    type(polygon_t) :: part
    real(wp) :: total(3), low, high
    integer :: d, i, first, last
    logical :: inside

    do d = 1, 3
      low = minval(hexagon%x(d, :6))
      high = maxval(hexagon%x(d, :6))
      call cells_between(low, high, first, last)
      call check('several cells', last - first >= 3)
      total = 0.0_wp
      inside = .true.
      do i = first, last
        call clip_to_cells(hexagon, d, i, low, high, part)
        inside = inside .and. part%n >= 3 .and. all(part%x(d, :part%n) >= i - 1) &
                 .and. all(part%x(d, :part%n) <= i)
        total = total + area(part)
      end do
      call check('each piece in its cell', inside)
      call check('together the whole', total, area(hexagon), 1.0e-14_wp*norm2(area(hexagon)))
    end do
  end subroutine pieces_fill_the_whole

  !> The line in which a plane meets the polygon parts it: ends in the plane and on the outline.
  subroutine lines_in_planes()
    real(wp) :: line(3, 2, 4)
    integer :: d, n

    do d = 1, 3
      call cut_by_plane(hexagon, d, 0.25_wp, line, n)
      call check('one line', n, 1)
      call check('in the plane', line(d, :, 1), 0.25_wp)
      call check('in the polygon', line(3, :, 1), 0.3_wp*line(1, :, 1) - 0.7_wp*line(2, :, 1) &
        + 1.0_wp, 1.0e-14_wp)
    end do
    call cut_by_plane(hexagon, 1, 9.0_wp, line, n)
    call check('no line beyond it', n, 0)
  end subroutine lines_in_planes

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
