!> Cutting a domain into blocks: at multiples of powers of two, none too thin, little surface.
module test_decomposition_m
  use decomposition_m, only: best_pieces, last_cell, min_cells
  use check_m, only: check
  implicit none
  private
  public :: test_decomposition

contains

  subroutine test_decomposition()
    call check('one process: one piece', all(best_pieces([60, 20, 40], 1) == [1, 1, 1]))
    call check('a tall tank is cut in z', all(best_pieces([16, 16, 64], 4) == [1, 1, 4]))
    call check('halos in z are the cheapest', all(best_pieces([32, 32, 32], 4) == [1, 1, 4]))
    call check('then those in y', all(best_pieces([32, 32, 32], 8) == [1, 2, 4]))
    call check('x only where it is longer by far', all(best_pieces([40, 32, 32], 2) == [1, 1, 2]))
    call check('x where z is short', all(best_pieces([64, 1, 8], 4) == [4, 1, 1]))
    call check('too many processes: none', all(best_pieces([7, 7, 7], 8) == [0, 0, 0]))
    call cuts(60, 3)
    call cuts(19, 3)
    call cuts(17, 2)
    call cuts(256, 5)
    call check('cuts at multiples of 16', all(last_cell(64, 4, [1, 2, 3, 4]) == [16, 32, 48, 64]))
    call check('a single piece', all(last_cell(13, 1, [0, 1]) == [0, 13]))
  end subroutine test_decomposition

  !> The pieces of n cells follow each other, none is thinner than allowed, cuts are multiples of 4
  !! where that leaves the pieces thick enough.
  subroutine cuts(n, pieces)
    integer, intent(in) :: n, pieces
    integer :: last(0:pieces), i

    do i = 0, pieces
      last(i) = last_cell(n, pieces, i)
    end do
    call check('from the first to the last cell', last(0) == 0 .and. last(pieces) == n)
    call check('thick enough', all(last(1:) - last(:pieces - 1) >= min_cells))
    call check('cuts at multiples of 4', all(modulo(last(1:pieces - 1), 4) == 0))
  end subroutine cuts

end module test_decomposition_m
