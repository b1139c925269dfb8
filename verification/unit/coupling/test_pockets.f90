!> Sealed pockets in a geometry made by hand: two cut cells behind closed faces.
module test_pockets_m
  use kinds_m, only: wp
  use grid_m, only: grid_t
  use boundary_kinds_m, only: side_open
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use pockets_m, only: pockets_t, close_pockets
  use box_solid_m, only: simple_grid
  use check_m, only: check
  implicit none
  private
  public :: test_pockets

  type(grid_t) :: grid
  type(solid_geometry_t) :: solid
  type(pockets_t) :: pockets

contains

  subroutine test_pockets()
    call simple_grid([6, 5, 4], [0.6_wp, 0.5_wp, 0.4_wp], grid)
    pockets = pockets_t([1, 1, 1], grid%n)

    call two_cells([3, 3, 2])
    call close_pockets(grid, pockets, solid)
    call check('both are sealed', solid%n_sealed, 2)
    call check('the face between them is closed', solid%aperture(4, 3, 2, 1), 0.0_wp, 0.0_wp)
    call check('they are listed', solid%n_closed, 2)
    call check('others stay open', solid%aperture(2, 3, 2, 1), 1.0_wp, 0.0_wp)

    call two_cells([3, 3, 2])
    solid%aperture(5, 3, 2, 1) = 1.0e-6_wp
    call close_pockets(grid, pockets, solid)
    call check('a gap from the second frees both', solid%n_sealed, 0)
    call check('the face between them stays', solid%aperture(4, 3, 2, 1), 0.3_wp, 0.0_wp)

    call two_cells([1, 3, 2])
    solid%aperture(1, 3, 2, 1) = 1.0_wp
    call close_pockets(grid, pockets, solid)
    call check('a wall is no way out', solid%n_sealed, 2)

    call two_cells([3, 3, 4])
    solid%aperture(3, 3, 5, 3) = 1.0_wp
    grid%side(2, 3) = side_open
    call close_pockets(grid, pockets, solid)
    call check('an open side is', solid%n_sealed, 0)
  end subroutine test_pockets

  !> Cut cells at a place and above it in x, open to each other and closed to all others.
  subroutine two_cells(place)
    integer, intent(in) :: place(3)
    integer :: m, d, c(3), above(3)

    call solid_geometry_init(grid, solid)
    deallocate (solid%cut_cell, solid%closed_cell)
    allocate (solid%cut_cell(3, 2), solid%closed_cell(3, 2))
    solid%n_cut = 2
    do m = 1, 2
      c = place
      c(1) = place(1) + m - 1
      solid%cut_cell(:, m) = c
      solid%cut(c(1), c(2), c(3)) = m
      solid%alpha(c(1), c(2), c(3)) = 0.5_wp
      do d = 1, 3
        above = c
        above(d) = c(d) + 1
        solid%aperture(c(1), c(2), c(3), d) = 0.0_wp
        solid%aperture(above(1), above(2), above(3), d) = 0.0_wp
      end do
    end do
    solid%aperture(place(1) + 1, place(2), place(3), 1) = 0.3_wp
  end subroutine two_cells

end module test_pockets_m
