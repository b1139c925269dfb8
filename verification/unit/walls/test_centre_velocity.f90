!> Velocities at the centres of cut cells and the means over their fluid, above a box that moves.
module test_centre_velocity_m
  use kinds_m, only: wp
  use grid_m, only: n_halo
  use merged_cells_m, only: merged_cells_t, merged_cells_init, find_merged_cells
  use wall_layer_m, only: find_centres, to_centres
  use one_body_m, only: one_body_t, describe, place, wall_at, layer
  use check_m, only: check
  implicit none
  private
  public :: test_centre_velocity

  character(8), parameter :: sides(2, 3) = 'slip'
  integer, parameter :: cells(3) = [8, 8, 7]
  real(wp), parameter :: tank(3) = [0.8_wp, 0.8_wp, 0.7_wp]          !! cells of 0.1 m
  real(wp), parameter :: edges(3) = [0.36_wp, 0.36_wp, 0.345_wp]     !! of the box [m]
  real(wp), parameter :: middle(3) = [0.39_wp, 0.40_wp, 0.1725_wp]
  integer, parameter :: top = 4   !! cut 0.05 cells below its centre
  real(wp), parameter :: motion(6) = [0.3_wp, -0.5_wp, 0.4_wp, 2.0_wp, -1.0_wp, 3.0_wp]
    !! of the box [m/s, rad/s]
  real(wp), parameter :: at_centre = 0.05_wp, of_fluid = 0.275_wp   !! from the wall [cells]
  type(one_body_t) :: box
  real(wp) :: wall(3)   !! velocity of the box at the centre of the cut cell [m/s]
  type(merged_cells_t) :: merged
  real(wp), dimension(1 - n_halo:cells(1) + n_halo, 1 - n_halo:cells(2) + n_halo, &
                      1 - n_halo:cells(3) + n_halo, 3) :: u, means
  real(wp) :: shear

contains

  subroutine test_centre_velocity()
    call describe(cells, tank, sides, 'box', edges, middle, box%case)
    call place(box)
    box%bodies%motion(:, 1) = motion
    wall = wall_at(box, [4, 5, top])
    call merged_cells_init(box%grid, merged)
    call find_merged_cells(box%grid, box%solid, merged)
    call check('at first all centres have all', &
               all(abs(merged%centre(:merged%n) - 1.0_wp) <= 0.0_wp))
    call run_along(1.0e6_wp)
    call check('shear: linear', centre(), at_centre/of_fluid, 1.0e-5_wp)
    call there_and_back()
    call run_along(0.0_wp)
    call check('no layer: as of one as thick as the fluid is far', centre(), &
               layer(at_centre, of_fluid)/layer(of_fluid, of_fluid), 1.0e-12_wp)
    call run_along(1.0_wp)
    call check('a layer of one cell', centre(), &
               layer(at_centre, 1.0_wp)/layer(of_fluid, 1.0_wp), 1.0e-12_wp)
    call as_the_links_pull()
  end subroutine test_centre_velocity

  !> At the centre runs what the layer has there; the means come back.
  subroutine there_and_back()
    means = u
    call to_centres(box%grid, merged, box%bodies, u)
    call check('at the centre', u(4, 5, top, 2), wall(2) + shear*at_centre, 1.0e-5_wp)
    call check('whole cells keep theirs', maxval(abs(u(:, :, top + 1:, :) &
                                                     - means(:, :, top + 1:, :))), 0.0_wp, 0.0_wp)
    call to_centres(box%grid, merged, box%bodies, u, back=.true.)
    call check('there and back', maxval(abs(u - means)), 0.0_wp, 1.0e-13_wp)
  end subroutine there_and_back

  !> A link that ends elsewhere than the plane of the solid share, as at a curved wall, in a layer
  !! of one cell.
  subroutine as_the_links_pull()
    real(wp), parameter :: near = 0.01_wp   !! [cells]

    associate (link => box%solid%link_number(4, 5, top, 3))
      box%solid%link_length(2, link) = near
      box%solid%poses = 0   ! another geometry
      call find_merged_cells(box%grid, box%solid, merged)
      call find_centres(box%grid, box%solid, box%bodies, u, merged)
      call check('a short link', centre(), layer(near, 1.0_wp)/layer(of_fluid, 1.0_wp), 1.0e-12_wp)
      box%solid%link_length(2, link) = 0.0_wp
      call find_merged_cells(box%grid, box%solid, merged)
      call find_centres(box%grid, box%solid, box%bodies, u, merged)
      call check('the shortest', centre(), layer(1.0e-3_wp, 1.0_wp)/layer(of_fluid, 1.0_wp), &
                 1.0e-12_wp)
    end associate
  end subroutine as_the_links_pull

  real(wp) function centre()
    centre = merged%centre(merged%number(4, 5, top))
  end function centre

  !> A layer of thickness delta [cells] along x2, in the frame of the box at the centre of the cell:
  !! means over the fluid, of which the next cell tells as if its fluid lay a cell further out.
  subroutine run_along(delta)
    real(wp), intent(in) :: delta
    integer :: k

    shear = (1.0_wp + delta)*layer(1.0_wp, delta)
    do k = lbound(u, 3), ubound(u, 3)
      u(:, :, k, 1) = wall(1)
      u(:, :, k, 2) = wall(2) + (1.0_wp + delta)*layer(max(0.0_wp, k - top + of_fluid), delta)
      u(:, :, k, 3) = wall(3) + 7.0_wp*k
    end do
    call find_centres(box%grid, box%solid, box%bodies, u, merged)
  end subroutine run_along

end module test_centre_velocity_m
