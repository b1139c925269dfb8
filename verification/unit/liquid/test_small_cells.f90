!> Small cells: who they are, what they give and that nothing gets lost.
module test_small_cells_m
  use check_m, only: check, wp
  use grid_m, only: grid_t
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use carried_volumes_m, only: carried_volumes_t, carried_volumes_init
  use small_cells_m, only: small_cells_t, small_cells_init, find_small_cells, give_small_cells, &
                           renew_shares
  use box_solid_m, only: simple_grid
  implicit none
  private
  public :: test_small_cells

  real(wp), parameter :: tiny_room = 1.0e-7_wp   !! of a small cell [V]
  real(wp), parameter :: through = 0.25_wp       !! volume that flows along the row [V]
  type(grid_t) :: grid
  type(solid_geometry_t) :: solid
  type(carried_volumes_t) :: volumes
  type(small_cells_t) :: small
  real(wp), allocatable :: share(:, :, :)

contains

  subroutine test_small_cells()
    call start()
    call who_is_small()
    call row_of_small_cells()
    call ring_of_small_cells()
  end subroutine test_small_cells

  !> Cells of volume 1, liquid up to i = 2; cells 3 and 4 of a row hold next to nothing.
  subroutine start()
    call simple_grid([6, 3, 3], [6.0_wp, 3.0_wp, 3.0_wp], grid)
    call solid_geometry_init(grid, solid)
    call carried_volumes_init(grid, volumes)
    call small_cells_init(grid, small)
    allocate (share, source=volumes%w)
    volumes%v = 1.0_wp
    volumes%v(3:4, 2, 2) = tiny_room
    volumes%w(1:2, :, :) = 1.0_wp
    volumes%q(3:5, 2, 2, 1) = through   ! from 2 through 3 and 4 into 5
    volumes%q(5, 1, 1, 1) = 0.97_wp     ! cell 4 may give that much, cell 2 not what follows
    volumes%q(2, 3, 3, 1) = -0.99_wp
  end subroutine start

  subroutine who_is_small()
    call find_small_cells(grid, solid, volumes, small)
    call check('small cells', small%n, 3)
    call check('two of a row are empty', small%number(3, 2, 2) > 0 .and. small%number(4, 2, 2) > 0)
    call check('one gives nearly all', small%number(2, 3, 3) > 0)
    call check('one gives just what it may', small%number(4, 1, 1), 0)
    call check('implicit faces', small%n_implicit, 3)
    call check('they are taken out of the sweeps', volumes%q(4:5, 2, 2, 1), [0.0_wp, 0.0_wp])
    call check('others are not', volumes%q(3, 2, 2, 1), through)
  end subroutine who_is_small

  !> C_3 = Q/(V_3 + Q), C_4 = Q C_3/(V_4 + Q): liquid of cell 2 passes the two cells in one step.
  subroutine row_of_small_cells()
    real(wp) :: before, c_3, c_4

    volumes%w(2:3, 2, 2) = volumes%w(2:3, 2, 2) + through*[-1.0_wp, 1.0_wp]   ! what a sweep does
    volumes%v(2:3, 2, 2) = volumes%v(2:3, 2, 2) + through*[-1.0_wp, 1.0_wp]
    before = total()
    call give_small_cells(grid, volumes, small, share)
    c_3 = through/(tiny_room + through)
    c_4 = through*c_3/(tiny_room + through)
    call check('liquid of the donors', volumes%g(4:5, 2, 2, 1), through*[c_3, c_4], 1.0e-15_wp)
    call check('volumes stand again', volumes%q(4:5, 2, 2, 1), spread(through, 1, 2))
    call check('against the axis', volumes%g(2, 3, 3, 1), -0.99_wp, 1.0e-15_wp)
    call check('room is as before', volumes%v(3:4, 2, 2), spread(tiny_room, 1, 2), 1.0e-15_wp)
    call check('what has come out', volumes%w(5, 2, 2), through*c_4, 1.0e-15_wp)
    call check('nothing is lost', total(), before, 1.0e-14_wp)
    call check('the donor values converged', small%converged)
    volumes%c = -1.0_wp
    call renew_shares(grid, solid, small, volumes)
    call check('new share of who gave', volumes%c(3, 2, 2), c_3, 1.0e-9_wp)
    call check('share of who got', volumes%c(5, 2, 2), through*c_4/(1.0_wp + through), 1.0e-12_wp)
    call check('no other', volumes%c(6, 2, 2), -1.0_wp)
  end subroutine row_of_small_cells

  !> Round a ring of four cells flows a million times what they hold: after ten thousand passes
  !! the values of the donors still change, which is told.
  subroutine ring_of_small_cells()
    solid%alpha = 0.0_wp
    volumes%v = 1.0_wp
    volumes%w = 0.0_wp
    volumes%q = 0.0_wp
    volumes%v(3:4, 1:2, 2) = 1.0e-6_wp
    volumes%w(3, 1, 2) = 1.0e-6_wp
    volumes%q(4, 1, 2, 1) = 1.0_wp
    volumes%q(4, 2, 2, 2) = 1.0_wp
    volumes%q(4, 2, 2, 1) = -1.0_wp
    volumes%q(3, 2, 2, 2) = -1.0_wp
    call find_small_cells(grid, solid, volumes, small)
    call check('ring: implicit faces', small%n_implicit, 4)
    call give_small_cells(grid, volumes, small, share)
    call check('ring: not converged', .not. small%converged)
    call check('ring: nothing is lost', total(), 1.0e-6_wp, 1.0e-15_wp)
  end subroutine ring_of_small_cells

  !> Liquid of all cells.
  real(wp) function total()
    total = sum(volumes%w(1:6, 1:3, 1:3))
  end function total

end module test_small_cells_m
