!> Volumes under facets and areas under lines, with their moments. Lengths are in cells.
!!
!! A column is the pile of cells that a facet or a line stands above; columns of the faces of
!! direction d lie side by side along `along(d)` and are stacked in `up(d)`.
module share_moments_m
  use kinds_m, only: wp
  use facet_polygon_m, only: polygon_t
  implicit none
  private
  public :: along, up, turn, add_prism, add_end, add_piece, add_above

  !> The sign makes areas under lines positive where the body is below the line.
  integer, parameter :: along(3) = [2, 1, 2], up(3) = [3, 3, 1]
  real(wp), parameter :: turn(3) = [1.0_wp, -1.0_wp, -1.0_wp]

contains

  !> Add the prism between a piece of a facet in one cell and the floor of the cell, and the column
  !! further down.
  pure subroutine add_prism(part, corner, total)
    type(polygon_t), intent(in) :: part
    real(wp), intent(in) :: corner(3)        !! lower corner of the cell [cells]
    real(wp), intent(inout) :: total(7)
    real(wp) :: a(3), b(3), c(3), s(3), twice
    integer :: v

    if (part%n < 3) return
    a = part%x(:, 1) - corner
    c = part%x(:, 2) - corner
    do v = 3, part%n
      b = c
      c = part%x(:, v) - corner
      s = a + b + c
      twice = (b(1) - a(1))*(c(2) - a(2)) - (c(1) - a(1))*(b(2) - a(2))
      total(1) = total(1) + twice*s(3)/6.0_wp
      total(2:3) = total(2:3) + &
                   twice/24.0_wp*(s(1:2)*s(3) + a(1:2)*a(3) + b(1:2)*b(3) + c(1:2)*c(3))
      total(4) = total(4) + twice/48.0_wp*(s(3)**2 + a(3)**2 + b(3)**2 + c(3)**2)
      total(5) = total(5) + 0.5_wp*twice
      total(6:7) = total(6:7) + twice*s(1:2)/6.0_wp
    end do
  end subroutine add_prism

  !> Add the area of a facet that lies in the lower face d of a cell and ends the body there.
  pure subroutine add_end(part, corner, d, total)
    type(polygon_t), intent(in) :: part
    real(wp), intent(in) :: corner(3)        !! lower corner of the cell [cells]
    integer, intent(in) :: d
    real(wp), intent(inout) :: total(5)
    real(wp) :: a(2), b(2), c(2), twice, sum3(3)
    integer :: v

    if (part%n < 3) return
    associate (m => [along(d), up(d)])
      sum3 = 0.0_wp
      a = part%x(m, 1) - corner(m)
      c = part%x(m, 2) - corner(m)
      do v = 3, part%n
        b = c
        c = part%x(m, v) - corner(m)
        twice = turn(d)*((b(1) - a(1))*(c(2) - a(2)) - (c(1) - a(1))*(b(2) - a(2)))
        sum3 = sum3 + twice*[0.5_wp, (a + b + c)/6.0_wp]
      end do
    end associate
    if (sum3(1) > 0.0_wp) total(1:3) = total(1:3) + sum3   ! looks up: the body ends
  end subroutine add_end

  !> Add the area under a line in one cell of a face, and the column further down.
  pure subroutine add_piece(sign, a, b, total)
    real(wp), intent(in) :: sign
    real(wp), intent(in) :: a(2), b(2)   !! ends: along and up the columns, from the cell's corner
    real(wp), intent(inout) :: total(5)
    real(wp) :: width, height

    width = sign*(b(1) - a(1))
    height = a(2) + b(2)
    total(1) = total(1) + 0.5_wp*width*height
    total(2) = total(2) + width*((a(1) + b(1))*height + a(1)*a(2) + b(1)*b(2))/6.0_wp
    total(3) = total(3) + width*(a(2)**2 + a(2)*b(2) + b(2)**2)/6.0_wp
    total(4) = total(4) + width
    total(5) = total(5) + 0.5_wp*width*(a(1) + b(1))
  end subroutine add_piece

  !> A cell of a face takes the column that stands above it.
  pure subroutine add_above(above, here)
    real(wp), intent(in) :: above(5)
    real(wp), intent(inout) :: here(5)

    here(1) = here(1) + above(4)
    here(2) = here(2) + above(5)
    here(3) = here(3) + 0.5_wp*above(4)
    here(4) = here(4) + above(4)
    here(5) = here(5) + above(5)
  end subroutine add_above

end module share_moments_m
