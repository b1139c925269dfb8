!> How a domain is cut into blocks, one for each process.
!!
!! The cuts lie at multiples of a power of two of the cell index, so that coarser grids can be cut
!! at the same places.
module decomposition_m
  use kinds_m, only: wp
  implicit none
  private
  public :: best_pieces, last_cell, min_cells

  integer, parameter :: min_cells = 4   !! every block has so many in each direction that is cut

contains

  !> Number of pieces in each direction with the least work for the busiest process; zero if none.
  pure function best_pieces(n, n_pieces) result(best)
    integer, intent(in) :: n(3), n_pieces
    integer :: best(3)
    real(wp) :: cost, least
    integer :: pieces(3), px, py

    best = 0
    least = huge(1.0_wp)
    do px = 1, n_pieces
      do py = 1, n_pieces/px
        pieces = [px, py, n_pieces/(px*py)]
        if (product(pieces) /= n_pieces) cycle
        if (any(grain(n, pieces) == 0)) cycle
        cost = work(n, pieces)
        if (cost < least) then
          least = cost
          best = pieces
        end if
      end do
    end do
  end function best_pieces

  !> Cells of the largest piece, and its halo cells with a weight that keeps lines in x whole.
  pure function work(n, pieces) result(cost)
    integer, intent(in) :: n(3), pieces(3)
    real(wp) :: cost
    real(wp), parameter :: weight(3) = [18.0_wp, 9.0_wp, 6.0_wp]   !! halo layers, dearer in x
    integer :: d, longest(3)

    longest = longest_piece(n, pieces, grain(n, pieces))
    cost = 1.0_wp
    do d = 1, 3
      if (pieces(d) > 1) cost = cost + weight(d)/real(longest(d), wp)
    end do
    cost = cost*product(real(longest, wp))
  end function work

  !> Largest power of two, up to 16, whose multiples cut n cells about evenly; zero if no cut works.
  !!
  !! 4 is taken when it is possible at all; 8 and 16 when no piece gets longer by them.
  elemental function grain(n, pieces) result(g)
    integer, intent(in) :: n, pieces
    integer :: g
    integer :: power, shortest, i

    g = 0
    do power = 0, 4
      shortest = minval([(cut(n, pieces, 2**power, i) - cut(n, pieces, 2**power, i - 1), &
                          i=1, pieces)])
      if (shortest < min_cells .and. pieces > 1) cycle
      if (power > 2 .and. g > 0) then
        if (longest_piece(n, pieces, 2**power) > longest_piece(n, pieces, g)) cycle
      end if
      g = 2**power
    end do
  end function grain

  !> Last cell of piece number `place`, counted from 1, when the cuts are multiples of g.
  elemental function cut(n, pieces, g, place) result(cell)
    integer, intent(in) :: n, pieces, g, place
    integer :: cell

    cell = g*nint(real(n, wp)*real(place, wp)/(real(pieces, wp)*real(g, wp)))
    if (place == pieces) cell = n
  end function cut

  !> Last cell of piece number `place`, counted from 1; 0 for place 0.
  elemental function last_cell(n, pieces, place) result(cell)
    integer, intent(in) :: n, pieces, place
    integer :: cell

    cell = cut(n, pieces, grain(n, pieces), place)
  end function last_cell

  elemental function longest_piece(n, pieces, g) result(length)
    integer, intent(in) :: n, pieces, g
    integer :: length
    integer :: i

    length = maxval([(cut(n, pieces, g, i) - cut(n, pieces, g, i - 1), i=1, pieces)])
  end function longest_piece

end module decomposition_m
