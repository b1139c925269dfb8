!> The layer at a wall: a line where it is thick, free slip where there is none; velocities at the
!! centres of cut cells and the means over their fluid, above a box that moves.
module test_wall_layer_m
  use check_m, only: check, wp
  use grid_m, only: n_halo
  use merged_cells_m, only: merged_cells_t, find_merged_cells
  use wall_layer_m, only: find_slip, layer_slip, share_along, find_centres, to_centres
  use one_body_m, only: one_body_t, place, wall_at, layer, slip
  implicit none
  private
  public :: test_wall_layer

  character(*), parameter :: tank = '&grid cells=8,8,7 length=.8,.8,.7/ '//slip   ! cells of .1 m
  character(*), parameter :: moving = ' velocity=.3,-.5,.4 angular_velocity=2,-1,3/ '
  integer, parameter :: top = 4                    !! layer of cells that the top of the box cuts
  real(wp), parameter :: r = 0.15_wp/0.8_wp   !! middle of a top cell over its target, from the wall
  real(wp), parameter :: at_centre = 0.05_wp, of_fluid = 0.275_wp   !! from the wall [cells]
  type(one_body_t) :: box
  real(wp) :: wall(3)   !! velocity of the box at the centre of the cut cell [m/s]
  type(merged_cells_t) :: merged
  real(wp), dimension(1 - n_halo:8 + n_halo, 1 - n_halo:8 + n_halo, 1 - n_halo:7 + n_halo, 3) :: &
    u, means

contains

  subroutine test_wall_layer()
    call the_formula()
    call above_the_box()
    call at_centres()
  end subroutine test_wall_layer

  !> Thick and thin layers, cells at distances 1 and 3 from the wall.
  subroutine the_formula()
    integer :: m
    real(wp) :: delta

    do m = -3, 3
      delta = 2.0_wp**m
      call check('a layer', share_along(r, layer_slip(layer(1.0_wp, delta)/layer(3.0_wp, delta), &
        1.0_wp/3.0_wp)), layer(r, delta)/layer(1.0_wp, delta), 1.0e-12_wp)
    end do
    call check('a line has no slip', layer_slip(0.4_wp, 0.4_wp), 0.0_wp)
    call check('nor has what is below it', layer_slip(-0.4_wp, 0.4_wp), 0.0_wp)
    call check('without a layer all slips', layer_slip(1.0_wp, 0.4_wp), 1.0_wp)
    call check('faster at the wall: likewise', layer_slip(1.5_wp, 0.4_wp), 1.0_wp)
  end subroutine the_formula

  !> Flows over a box that leaves 0.3 of its top cells open; the target lies 0.8 cells above it.
  subroutine above_the_box()
    call place(tank//'&shape name="b" kind="box" size=.36,.36,.37/ &body shape="b" ' &
               //'position=.39,.4,.185'//moving, box, merged)
    wall = wall_at(box, [4, 5, top])
    call run_along(1.0e6_wp, -0.2_wp)
    call check('shear: linear', share(), r, 1.0e-5_wp)
    call run_along(0.0_wp, -0.2_wp)
    call check('no layer: free slip', share(), 1.0_wp, 1.0e-12_wp)
    call run_along(0.0_wp, -0.2_wp, 1.0e-14_wp)
    call check('as good as at rest: none', share(), r, 1.0e-5_wp)
    call run_along(1.0_wp, -0.2_wp)
    call check('one cell', share(), layer(0.15_wp, 1.0_wp)/layer(0.8_wp, 1.0_wp), 1.0e-12_wp)
  end subroutine above_the_box

  !> A box that ends 0.05 cells below the centres of its top cells.
  subroutine at_centres()
    call place(tank//'&shape name="b" kind="box" size=.36,.36,.345/ &body shape="b" ' &
               //'position=.39,.4,.1725'//moving, box, merged)
    wall = wall_at(box, [4, 5, top])
    call check('at first centres have all', all(abs(merged%centre(:merged%n) - 1.0_wp) <= 0.0_wp))
    call run_along(1.0e6_wp, of_fluid)
    call check('shear: linear', centre(), at_centre/of_fluid, 1.0e-5_wp)
    call there_and_back()
    call run_along(0.0_wp, of_fluid)
    call check('no layer: as of one as thick as the fluid is far', centre(), &
               layer(at_centre, of_fluid)/layer(of_fluid, of_fluid), 1.0e-12_wp)
    call run_along(1.0_wp, of_fluid)
    call check('one cell', centre(), layer(at_centre, 1.0_wp)/layer(of_fluid, 1.0_wp), 1.0e-12_wp)
    call as_the_links_pull()
  end subroutine at_centres

  !> At the centre runs what the layer has there; the means come back.
  subroutine there_and_back()
    means = u
    call to_centres(box%grid, merged, box%bodies, u)
    call check('at the centre', u(4, 5, top, 2), wall(2) + at_centre, 1.0e-5_wp)
    call check('whole cells keep theirs', u(:, :, top + 1:, :) - means(:, :, top + 1:, :), 0.0_wp)
    call to_centres(box%grid, merged, box%bodies, u, back=.true.)
    call check('there and back', u - means, 0.0_wp, 1.0e-13_wp)
  end subroutine there_and_back

  !> A link that ends elsewhere than the plane of the solid share, as at a curved wall, in a layer
  !! of one cell: as long as the shortest at least.
  subroutine as_the_links_pull()
    real(wp), parameter :: given(2) = [0.01_wp, 0.0_wp], counts(2) = [0.01_wp, 1.0e-3_wp]
      !! [cells]
    integer :: i

    do i = 1, 2
      box%solid%link_length(2, box%solid%link_number(4, 5, top, 3)) = given(i)
      box%solid%poses = 0   ! another geometry
      call find_merged_cells(box%grid, box%solid, merged)
      call find_centres(box%grid, box%solid, box%bodies, 1.0_wp, u, merged)
      call check('link', centre(), layer(counts(i), 1.0_wp)/layer(of_fluid, 1.0_wp), 1.0e-12_wp)
    end do
  end subroutine as_the_links_pull

  !> A layer of thickness delta along x2, in the frame of the box at the centre of the cut cell,
  !! whose own distance from the wall is `offset` [cells].
  subroutine run_along(delta, offset, speed)
    real(wp), intent(in) :: delta, offset
    real(wp), intent(in), optional :: speed   !! of the free stream, else 1
    real(wp) :: free
    integer :: k

    free = 1.0_wp + delta
    if (present(speed)) free = speed*free
    do k = lbound(u, 3), ubound(u, 3)
      u(:, :, k, 1) = wall(1)
      u(:, :, k, 2) = wall(2) + free*layer(max(0.0_wp, k - top + offset), delta)
      u(:, :, k, 3) = wall(3) + 7.0_wp*k
    end do
    call find_slip(box%grid, box%solid, box%bodies, 1.0_wp, u, merged)
    call find_centres(box%grid, box%solid, box%bodies, 1.0_wp, u, merged)
  end subroutine run_along

  !> Of the velocity of the target that the small cell has.
  real(wp) function share()
    share = share_along(r, merged%slip(4, 5, top))
  end function share

  real(wp) function centre()
    centre = merged%centre(merged%number(4, 5, top))
  end function centre

end module test_wall_layer_m
