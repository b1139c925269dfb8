!> Normal of the surface: level water, nothing to see, and a wall that hides what lies behind it.
module test_surface_normal_m
  use check_m, only: check, wp
  use grid_m, only: grid_t
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use surface_normal_m, only: vertical_t, vertical_of, surface_normal, passable
  use box_solid_m, only: simple_grid
  implicit none
  private
  public :: test_surface_normal

  real(wp), parameter :: up(3) = [0.0_wp, 0.0_wp, 1.0_wp]
  type(grid_t) :: grid
  type(solid_geometry_t) :: solid
  real(wp), allocatable :: c(:, :, :)
  integer, parameter :: level = 4   !! layer of cells that the surface passes

contains

  subroutine test_surface_normal()
    call verticals()
    call level_water()
    call hidden_water()
    call sides_of_domain()
  end subroutine test_surface_normal

  subroutine verticals()
    type(vertical_t) :: vertical

    vertical = vertical_of([0.0_wp, 0.0_wp, 0.0_wp])
    call check('no gravity: no axis', vertical%axis, 0)
    vertical = vertical_of([1.0_wp, 0.0_wp, -9.81_wp])
    call check('main axis of gravity', vertical%axis, 3)
    call check('up against gravity', vertical%up, up)
    vertical = vertical_of([2.0_wp, 0.0_wp, 0.0_wp])
    call check('gravity along x', vertical%up, [-1.0_wp, 0.0_wp, 0.0_wp])
    call check('slits are not looked through', .not. passable(1.0e-7_wp) .and. passable(1.0e-5_wp))
  end subroutine verticals

  !> Shares of water with a level surface, halo included.
  subroutine still_water()
    call simple_grid([8, 6, 7], [0.8_wp, 0.6_wp, 0.7_wp], grid)
    call solid_geometry_init(grid, solid)
    if (.not. allocated(c)) allocate (c, source=solid%alpha)
    c = 0.0_wp
    c(:, :, :level - 1) = 1.0_wp
    c(:, :, level) = 0.3_wp
  end subroutine still_water

  subroutine level_water()
    type(vertical_t) :: vertical

    call still_water()
    vertical = vertical_of(-up)
    call check('level', surface_normal(grid, solid, vertical, c, 4, 3, level), up)
    call check('upside down', surface_normal(grid, solid, vertical, 1.0_wp - c, 4, 3, level), -up)
    c = 0.5_wp
    call check('nothing to see: up', surface_normal(grid, solid, vertical, c, 4, 3, level), up)
  end subroutine level_water

  !> Water stands higher behind a closed plane of faces; with one open face more it is seen.
  subroutine hidden_water()
    real(wp) :: normal(3)

    call still_water()
    c(5:, :, :) = 1.0_wp
    solid%aperture(5, :, :, 1) = 0.0_wp
    solid%alpha(5, 3, level) = 0.5_wp
    call check('behind a wall', surface_normal(grid, solid, vertical_of(-up), c, 4, 3, level), up)
    solid%aperture(5, 3, level, 1) = 1.0_wp
    normal = surface_normal(grid, solid, vertical_of(-up), c, 4, 3, level)
    call check('through a hole in it', normal(1) < 0.0_wp)
  end subroutine hidden_water

  !> Near a body the last cell repeats outside the domain, whatever stands in the halo.
  subroutine sides_of_domain()
    real(wp) :: normal(3)

    call still_water()
    c(9:, :, :) = 1.0_wp
    c(7, :, level) = 0.5_wp
    solid%alpha(8, 3, level - 1) = 0.5_wp
    normal = surface_normal(grid, solid, vertical_of(-up), c, 8, 3, level)
    call check('beside a side: half the slope of the last', normal(1)/normal(3), 0.1_wp, 1.0e-14_wp)
  end subroutine sides_of_domain

end module test_surface_normal_m
