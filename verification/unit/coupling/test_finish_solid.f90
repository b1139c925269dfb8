!> Faces and cells that two bodies share, and links that round-off left open, made by hand.
module test_finish_solid_m
  use check_m, only: check, wp
  use grid_m, only: grid_t
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init, clear_cells, clear_faces
  use links_on_grid_m, only: links_t, links_on_grid, no_hit
  use voxels_m, only: voxels_t, voxels_init
  use finish_solid_m, only: make_way, finish_faces, finish_cells, guard_links
  use box_solid_m, only: simple_grid
  implicit none
  private
  public :: test_finish_solid

  integer, parameter :: c(3) = [3, 2, 2]   !! the cell looked at
  type(grid_t) :: grid
  type(solid_geometry_t) :: solid
  type(voxels_t) :: voxels
  type(links_t) :: links

contains

  subroutine test_finish_solid()
    call simple_grid([6, 5, 4], [0.6_wp, 0.5_wp, 0.4_wp], grid)
    call voxels_init(grid, 2, voxels)

    call shared_face(0.7_wp, 0.6_wp)
    call finish_faces(solid)
    call check('scaled to one', solid%face_beta, [7/13.0_wp, 6/13.0_wp], 1.0e-15_wp)
    call check('closed', open_share(), 0.0_wp)
    call shared_face(0.7_wp, 0.6_wp)
    call make_way(2, solid)
    call check('the bed makes way', solid%face_beta, [0.7_wp, 0.3_wp], 1.0e-15_wp)
    call check('none is left open', open_share(), 0.0_wp, 1.0e-15_wp)
    call shared_face(0.3_wp, 0.2_wp)
    call make_way(2, solid)
    call finish_faces(solid)
    call check('shares that fit stay', solid%face_beta, [0.3_wp, 0.2_wp])
    call check('open by the rest', open_share(), 0.5_wp, 1.0e-15_wp)

    call shared_cell(0.6_wp, 0.6_wp)
    call finish_cells(grid, solid)
    call check('full', solid%alpha(c(1), c(2), c(3)), 1.0_wp)
    call check('closed all round', &
      sum(solid%aperture(c(1), c(2), c(3), :)) + solid%aperture(c(1) + 1, c(2), c(3), 1) &
      + solid%aperture(c(1), c(2) + 1, c(3), 2) + solid%aperture(c(1), c(2), c(3) + 1, 3), 0.0_wp)
    call check('not cut', solid%n_cut, 0)
    call clear_cells(solid)
    call clear_faces(grid, solid)
    call check('nothing left of it', all(solid%aperture >= 1.0_wp) .and. all(solid%alpha <= 0.0_wp))
    call shared_cell(0.6_wp, 0.2_wp)
    call finish_cells(grid, solid)
    call check('cut, counted once', solid%n_cut == 1 .and. solid%cut(c(1), c(2), c(3)) == 1)

    call guard_links(voxels, solid)
    links = links_on_grid(solid)
    call check('the wall is at the centre, below', links%high(c(1), c(2), c(3), 1), 1.0e-3_wp)
    call check('and above', links%low(c(1) + 1, c(2), c(3), 1), 1.0e-3_wp)
    call check('six, of the body', solid%n_link == 6 .and. links%body_low(c(1), c(2), c(3), 2) == 1)
    call check('no others', count(links%low < no_hit), 6)
  end subroutine test_finish_solid

  !> A face that two bodies cover by so much.
  subroutine shared_face(first, second)
    real(wp), intent(in) :: first, second

    call solid_geometry_init(grid, solid, 2)
    solid%body_face = [1, 2, 3]
    solid%face = reshape([c, 1, c, 1], [4, 2])
    solid%face_beta = [first, second]
    solid%aperture(c(1), c(2), c(3), 1) = 1.0_wp - first - second
  end subroutine shared_face

  !> A cell that two bodies fill by so much, its centre inside the first.
  subroutine shared_cell(first, second)
    real(wp), intent(in) :: first, second

    call solid_geometry_init(grid, solid, 2)
    solid%body_cell = [1, 2, 3]
    solid%cell = reshape([c, c], [3, 2])
    solid%cell_alpha = [first, second]
    deallocate (solid%cut_cell, solid%closed_cell, solid%link, solid%link_length, solid%link_body)
    allocate (solid%cut_cell(3, 2), solid%closed_cell(3, 2), solid%link(4, 12), &
              solid%link_length(2, 12), solid%link_body(2, 12))
    solid%alpha(c(1), c(2), c(3)) = first + second
    solid%inside(c(1), c(2), c(3)) = 1
  end subroutine shared_cell

  real(wp) function open_share()
    open_share = solid%aperture(c(1), c(2), c(3), 1)
  end function open_share

end module test_finish_solid_m
