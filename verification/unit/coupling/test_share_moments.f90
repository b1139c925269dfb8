!> Prisms under facets and areas under lines, with first moments, against integrals done by hand.
module test_share_moments_m
  use check_m, only: check, wp
  use facet_polygon_m, only: polygon_t
  use share_moments_m, only: along, up, turn, add_prism, add_end, add_piece, add_above
  implicit none
  private
  public :: test_share_moments

  real(wp), parameter :: corner(3) = [3.0_wp, -2.0_wp, 5.0_wp], eps = 1.0e-14_wp

contains

  subroutine test_share_moments()
    call prism_of_a_flat_top()
    call prism_of_a_slope()
    call area_under_a_line()
    call columns()
    call ends()
  end subroutine test_share_moments

  !> Polygon of points in a cell.
  function polygon(x) result(p)
    real(wp), intent(in) :: x(:, :)   !! from the corner of the cell
    type(polygon_t) :: p

    p%n = size(x, 2)
    p%x(:, :p%n) = spread(corner, 2, p%n) + x
  end function polygon

  !> A square at height 1/4, seen from above; from below it takes the same away.
  subroutine prism_of_a_flat_top()
    real(wp) :: x(3, 4), total(7)

    x = reshape([0, 0, 1, 4, 0, 1, 4, 4, 1, 0, 4, 1]*0.25_wp, [3, 4])
    total = 0.0_wp
    call add_prism(polygon(x), corner, total)
    call check('volume, moments, column', total, [0.25_wp, 0.125_wp, 0.125_wp, 1/32.0_wp, &
                                                  1.0_wp, 0.5_wp, 0.5_wp], eps)
    call add_prism(polygon(x(:, 4:1:-1)), corner, total)
    call check('seen from below', total, spread(0.0_wp, 1, 7), eps)
  end subroutine prism_of_a_flat_top

  !> z = y over the triangle (0, 0), (1, 0), (0, 1).
  subroutine prism_of_a_slope()
    real(wp) :: total(7)

    total = 0.0_wp
    call add_prism(polygon(reshape([0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, &
                                    0.0_wp, 1.0_wp, 1.0_wp], [3, 3])), corner, total)
    call check('under a slope', total, [1/6.0_wp, 1/24.0_wp, 1/12.0_wp, 1/24.0_wp, &
                                        0.5_wp, 1/6.0_wp, 1/6.0_wp], eps)
  end subroutine prism_of_a_slope

  !> The diagonal of a face; two halves of it give the same.
  subroutine area_under_a_line()
    real(wp), parameter :: expected(5) = [0.5_wp, 1/3.0_wp, 1/6.0_wp, 1.0_wp, 0.5_wp]
    real(wp) :: whole(5), halves(5)

    whole = 0.0_wp
    halves = 0.0_wp
    call add_piece(1.0_wp, [0.0_wp, 0.0_wp], [1.0_wp, 1.0_wp], whole)
    call add_piece(1.0_wp, [0.0_wp, 0.0_wp], [0.5_wp, 0.5_wp], halves)
    call add_piece(-1.0_wp, [1.0_wp, 1.0_wp], [0.5_wp, 0.5_wp], halves)
    call check('under the diagonal', whole, expected, eps)
    call check('in two parts, one backwards', halves, expected, eps)
  end subroutine area_under_a_line

  !> What stands above fills the face; it stands on in the cells further down.
  subroutine columns()
    real(wp) :: above(5), here(5)

    above = [0.2_wp, 0.1_wp, 0.1_wp, 0.6_wp, 0.18_wp]
    here = 0.0_wp
    call add_above(above, here)
    call check('a column', here, [0.6_wp, 0.18_wp, 0.3_wp, 0.6_wp, 0.18_wp], eps)
  end subroutine columns

  !> Half a face, covered by a facet that looks along d; one that looks back adds nothing.
  subroutine ends()
    real(wp) :: x(3, 4), total(5)
    integer :: d

    do d = 1, 3
      x = 0.0_wp
      x(along(d), 2:3) = 0.5_wp
      x(up(d), 3:4) = 1.0_wp
      if (turn(d) < 0.0_wp) x = x(:, 4:1:-1)
      total = 0.0_wp
      call add_end(polygon(x), corner, d, total)
      call check('an end that looks up', total, [0.5_wp, 0.125_wp, 0.25_wp, 0.0_wp, 0.0_wp], eps)
      call add_end(polygon(x(:, 4:1:-1)), corner, d, total)
      call check('one that looks down', total(1), 0.5_wp, eps)
    end do
  end subroutine ends

end module test_share_moments_m
