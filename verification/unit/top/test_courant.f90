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
    rate = courant_rate(grid, flow, solid, blocks)
    call check('at rest nothing is followed', rate%followed, 0.0_wp)
    call check('at rest nothing is carried', rate%carried, 0.0_wp)
    call check('gas alone has no surface', .not. rate%has_surface)

    flow%uf(:, :, :, 1) = 0.3_wp
    flow%uf(:, :, :, 2) = -0.8_wp
    flow%uf(:, :, :, 3) = 0.4_wp
    flow%c(3, 3, 3) = 0.5_wp
    rate = courant_rate(grid, flow, solid, blocks)
    call check('the largest direction is followed in liquid', rate%followed, 40.0_wp, 1.0e-12_wp)
    call check('what leaves a cell is carried', rate%carried, 80.0_wp, 1.0e-12_wp)
    call check('liquid and gas have a surface', rate%has_surface)

    flow%uf(3, 5, 3, 2) = 4.0_wp
    rate = courant_rate(grid, flow, solid, blocks)
    call check('fast gas is not followed', rate%followed, 40.0_wp, 1.0e-12_wp)
    call check('fast gas is carried, given on both sides', rate%carried, 280.0_wp, 1.0e-10_wp)

    flow%uf(3, 5, 3, 2) = 20.0_wp
    rate = courant_rate(grid, flow, solid, blocks)
    call check('an eighth of very fast gas is followed', rate%followed, 135.0_wp, 1.0e-10_wp)

    flow%uf(3, 4, 3, 2) = 10.0_wp
    rate = courant_rate(grid, flow, solid, blocks)
    call check('upper face of a cell with liquid', rate%followed, 500.0_wp, 1.0e-10_wp)
    call check('what the gas above it gives is carried', rate%carried, 1040.0_wp, 1.0e-10_wp)
    solid%aperture(3, 4, 3, 2) = 0.4_wp
    rate = courant_rate(grid, flow, solid, blocks)
    call check('a face that is mostly closed is not looked at', rate%followed, 130.0_wp, 1.0e-10_wp)
  end subroutine test_courant

  !> A box of cells of 0.01 x 0.02 x 0.04 m, all open, all gas, all at rest.
  subroutine stage()
    call grid_of('&grid cells=3*6 length=.06,.12,.24/', grid)
    call flow_init(grid, flow)
    call solid_geometry_init(grid, solid, 0)
    solid%aperture = 1.0_wp
    flow%c = 0.0_wp
  end subroutine stage

end module test_courant_m
