!> The layer at a wall: a line where it is thick, free slip where there is none.
module test_wall_layer_m
  use kinds_m, only: wp
  use grid_m, only: n_halo
  use merged_cells_m, only: merged_cells_t, merged_cells_init, find_merged_cells
  use wall_layer_m, only: find_slip, layer_slip, share_along
  use one_body_m, only: one_body_t, describe, place, wall_at, layer
  use check_m, only: check
  implicit none
  private
  public :: test_wall_layer

  character(8), parameter :: sides(2, 3) = 'slip'
  integer, parameter :: cells(3) = [8, 8, 7]
  real(wp), parameter :: tank(3) = [0.8_wp, 0.8_wp, 0.7_wp]         !! cells of 0.1 m
  real(wp), parameter :: edges(3) = [0.36_wp, 0.36_wp, 0.37_wp]     !! of the box [m]
  real(wp), parameter :: middle(3) = [0.39_wp, 0.40_wp, 0.185_wp]
  integer, parameter :: top = 4                                     !! open share 0.3 above the box
  real(wp), parameter :: r = 0.15_wp/0.8_wp   !! middle of a top cell over its target, from the wall
  real(wp), parameter :: motion(6) = [0.3_wp, -0.5_wp, 0.4_wp, 2.0_wp, -1.0_wp, 3.0_wp]
    !! of the box [m/s, rad/s]
  type(one_body_t) :: box
  real(wp) :: wall(3)   !! velocity of the box at the centre of the cut cell [m/s]
  type(merged_cells_t) :: merged
  real(wp), dimension(1 - n_halo:cells(1) + n_halo, 1 - n_halo:cells(2) + n_halo, &
                      1 - n_halo:cells(3) + n_halo, 3) :: u

contains

  subroutine test_wall_layer()
    call the_formula()
    call describe(cells, tank, sides, 'box', edges, middle, box%case)
    call place(box)
    box%bodies%motion(:, 1) = motion
    wall = wall_at(box, [4, 5, top])
    call merged_cells_init(box%grid, merged)
    call find_merged_cells(box%grid, box%solid, merged)
    call above_the_box()
  end subroutine test_wall_layer

  !> Thick and thin layers, cells at distances 1 and 3 from the wall.
  subroutine the_formula()
    integer :: m
    real(wp) :: delta

    do m = -3, 3
      delta = 2.0_wp**m
      call check('a layer', share_along(r, layer_slip( &
        layer(1.0_wp, delta)/layer(3.0_wp, delta), 1.0_wp/3.0_wp)), &
        layer(r, delta)/layer(1.0_wp, delta), 1.0e-12_wp)
    end do
    call check('a line has no slip', layer_slip(0.4_wp, 0.4_wp), 0.0_wp, 0.0_wp)
    call check('nor has what is below it', layer_slip(-0.4_wp, 0.4_wp), 0.0_wp, 0.0_wp)
    call check('without a layer all slips', layer_slip(1.0_wp, 0.4_wp), 1.0_wp, 0.0_wp)
    call check('faster at the wall: likewise', layer_slip(1.5_wp, 0.4_wp), 1.0_wp, 0.0_wp)
  end subroutine the_formula

  !> Flows over the top of a box that moves and turns; the target lies 0.8 cells above it.
  subroutine above_the_box()
    call run_along(1.0e6_wp)
    call check('shear: linear', share(), r, 1.0e-5_wp)
    call run_along(0.0_wp)
    call check('no layer: free slip', share(), 1.0_wp, 1.0e-12_wp)
    call run_along(1.0_wp)
    call check('a layer of one cell', share(), layer(0.15_wp, 1.0_wp) &
               /layer(0.8_wp, 1.0_wp), 1.0e-12_wp)
  end subroutine above_the_box

  !> A layer of thickness delta [cells] along x2, in the frame of the box at the small cell's
  !! centre.
  subroutine run_along(delta)
    real(wp), intent(in) :: delta
    integer :: k

    do k = lbound(u, 3), ubound(u, 3)
      u(:, :, k, 1) = wall(1)
      u(:, :, k, 2) = wall(2) + (1.0_wp + delta)*layer(max(0.0_wp, k - top - 0.2_wp), delta)
      u(:, :, k, 3) = wall(3) + 7.0_wp*k
    end do
    call find_slip(box%grid, box%solid, box%bodies, u, merged)
  end subroutine run_along

  !> Of the velocity of the target that the small cell has.
  real(wp) function share()
    share = share_along(r, merged%slip(4, 5, top))
  end function share

end module test_wall_layer_m
