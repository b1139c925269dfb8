!> One sweep: the slabs below a level surface, what sides bring, and the balance of the cells.
module test_liquid_sweep_m
  use check_m, only: check, wp
  use boundary_kinds_m, only: side_inflow, side_outflow
  use grid_m, only: grid_t
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use carried_volumes_m, only: carried_volumes_t, carried_volumes_init
  use liquid_sweep_m, only: liquid_sweep_t, liquid_sweep_init, sweep_volumes
  use box_solid_m, only: simple_grid
  implicit none
  private
  public :: test_liquid_sweep

  real(wp), parameter :: gravity(3) = [0.0_wp, 0.0_wp, -9.81_wp], close = 1.0e-14_wp
  integer, parameter :: layer = 3   !! of the surface
  type(grid_t) :: grid
  type(solid_geometry_t) :: solid
  type(carried_volumes_t) :: volumes
  type(liquid_sweep_t) :: sweeps

contains

  subroutine test_liquid_sweep()
    call upward(0.9_wp, 0.2_wp)   ! the slab of 0.3 beside the upper face holds 0.9 - 0.7
    call upward(0.6_wp, 0.0_wp)
    call downward(0.9_wp, 0.3_wp)
    call downward(0.2_wp, 0.2_wp)
    call sideways()
    call through_sides()
  end subroutine test_liquid_sweep

  !> Water with a share in its uppermost layer, cells of volume 1; nothing flows yet.
  subroutine start(share)
    real(wp), intent(in) :: share

    call simple_grid([4, 3, 6], [4.0_wp, 3.0_wp, 6.0_wp], grid)
    call solid_geometry_init(grid, solid)
    call carried_volumes_init(grid, volumes)
    call liquid_sweep_init(grid, gravity, sweeps)
    volumes%v = 1.0_wp
    volumes%w(:, :, :layer - 1) = 1.0_wp
    volumes%w(:, :, layer) = share
    volumes%c = volumes%w
  end subroutine start

  subroutine upward(share, expected)
    real(wp), intent(in) :: share, expected
    real(wp) :: before

    call start(share)
    before = sum(volumes%w(1:4, 1:3, 1:6))
    volumes%q(:, :, layer:layer + 1, 3) = 0.3_wp
    call sweep_volumes(grid, solid, 3, volumes, sweeps)
    call check('up: from the surface', volumes%g(2, 2, layer + 1, 3), expected, close)
    call check('up: from below', volumes%g(2, 2, layer, 3), 0.3_wp)
    call check('up: of the surface', volumes%w(2, 2, layer), share + 0.3_wp - expected, close)
    call check('up: room', volumes%v(2, 2, layer - 1:layer + 1), [0.7_wp, 1.0_wp, 1.3_wp], close)
    call check('up: nothing is lost', sum(volumes%w(1:4, 1:3, 1:6)), before, 100*close)
    call check('up: before the sweep', volumes%w_before(2, 2, layer), share)
    call check('up: running share', volumes%c(2, 2, layer), volumes%w(2, 2, layer), close)
  end subroutine upward

  subroutine downward(share, expected)
    real(wp), intent(in) :: share, expected

    call start(share)
    volumes%q(:, :, layer, 3) = -0.3_wp
    call sweep_volumes(grid, solid, 3, volumes, sweeps)
    call check('down: from the surface', volumes%g(2, 2, layer, 3), -expected, close)
  end subroutine downward

  subroutine sideways()
    call start(0.4_wp)
    volumes%q(2:4, :, :, 1) = 0.25_wp
    call sweep_volumes(grid, solid, 1, volumes, sweeps)
    call check('sideways: a level slab', volumes%g(3, 2, layer, 1), 0.1_wp, close)
    call check('sideways: pure cells', volumes%g(3, 2, [1, 6], 1), [0.25_wp, 0.0_wp])
  end subroutine sideways

  !> An inflow brings liquid below its level, an outflow gives back what stands beside it.
  subroutine through_sides()
    call start(0.4_wp)
    grid%side(:, 1) = [side_inflow, side_outflow]
    sweeps%level = 3.7_wp
    volumes%q(1, :, :, 1) = 0.2_wp
    volumes%q(5, :, :, 1) = -0.2_wp
    call sweep_volumes(grid, solid, 1, volumes, sweeps)
    call check('inflow', volumes%g(1, 2, 1:5, 1), 0.2_wp*[1.0_wp, 1.0_wp, 1.0_wp, 0.7_wp, 0.0_wp], &
               close)
    call check('outflow', volumes%g(5, 2, 1:4, 1), -0.2_wp*[1.0_wp, 1.0_wp, 0.4_wp, 0.0_wp], close)
    sweeps%incoming = 0.5_wp
    volumes%q = 0.0_wp
    volumes%q(:, :, 7, 3) = -0.1_wp   ! in through the open top
    call sweep_volumes(grid, solid, 3, volumes, sweeps)
    call check('an open side', volumes%g(2, 2, 7, 3), -0.05_wp, close)
  end subroutine through_sides

end module test_liquid_sweep_m
