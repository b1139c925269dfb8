!> What the length of a step follows, and what the transport carries.
module test_courant_m
  use check_m, only: check, wp
  use case_text_m, only: grid_of
  use grid_m, only: grid_t
  use fields_m, only: flow_t, flow_init
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use rigid_body_m, only: blocks_t
  use courant_m, only: courant_rate_t, courant_rate
  implicit none
  private
  public :: test_courant

  type(grid_t) :: grid
  type(flow_t) :: flow
  type(solid_geometry_t) :: solid
  type(blocks_t) :: blocks
  type(courant_rate_t) :: rate

contains

  subroutine test_courant()
    call stage()
    call look('at rest nothing is followed or carried', 0.0_wp, 0.0_wp)
    call check('gas alone has no surface', .not. rate%has_surface)
    flow%uf(:, :, :, 1) = 0.3_wp
    flow%uf(:, :, :, 2) = -0.8_wp
    flow%uf(:, :, :, 3) = 0.4_wp
    flow%c(3, 3, 3) = 0.5_wp
    call look('the largest direction in liquid; what leaves a cell', 40.0_wp, 80.0_wp)
    call check('liquid and gas have a surface', rate%has_surface)
    flow%uf(3, 5, 3, 2) = 4.0_wp
    call look('fast gas is not followed; it is carried, given on both sides', 40.0_wp, 280.0_wp)
    flow%uf(3, 5, 3, 2) = 20.0_wp
    call look('an eighth of very fast gas is followed', 135.0_wp)
    flow%uf(3, 4, 3, 2) = 10.0_wp
    call look('upper face of a cell with liquid; what the gas above gives', 500.0_wp, 1040.0_wp)
    solid%aperture(3, 4, 3, 2) = 0.4_wp
    call look('a face that is mostly closed is not looked at', 130.0_wp)
  end subroutine test_courant

  subroutine look(name, followed, carried)
    character(*), intent(in) :: name
    real(wp), intent(in) :: followed   !! [1/s]
    real(wp), intent(in), optional :: carried

    rate = courant_rate(grid, flow, solid, blocks)
    call check(name, rate%followed, followed, 1.0e-12_wp*followed)
    if (present(carried)) call check(name, rate%carried, carried, 1.0e-12_wp*carried)
  end subroutine look

  !> A box of cells of 0.01 x 0.02 x 0.04 m, all open, all gas, all at rest.
  subroutine stage()
    call grid_of('&grid cells=3*6 length=.06,.12,.24/', grid)
    call flow_init(grid, flow)
    call solid_geometry_init(grid, solid, 0)
    solid%aperture = 1.0_wp
    flow%c = 0.0_wp
  end subroutine stage

end module test_courant_m
