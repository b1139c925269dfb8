!> C^ of full cells: one value in a row of level water; sealed cells keep their own.
module test_extended_fraction_m
  use check_m, only: check, wp
  use case_types_m, only: fluid_t, water_t
  use grid_m, only: grid_t
  use fields_m, only: flow_t, flow_init
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use extended_fraction_m, only: extended_fraction_t, extended_fraction_init, extend_fraction, &
                                 liquid_share
  use liquid_fill_m, only: fill_liquid
  use box_solid_m, only: simple_grid, set_boxes
  implicit none
  private
  public :: test_extended_fraction

  real(wp), parameter :: level = 0.437_wp   !! of the water; 0.37 of its layer of cells
  type(grid_t) :: grid
  type(flow_t) :: flow
  type(solid_geometry_t) :: solid
  type(extended_fraction_t) :: extension

contains

  subroutine test_extended_fraction()
    call check('share of the open part', liquid_share([0.2_wp, 0.0_wp, 0.3_wp, -0.1_wp], &
      [0.8_wp, 0.0_wp, 0.2_wp, 0.5_wp]), [0.25_wp, 0.0_wp, 1.0_wp, 0.0_wp])
    call start()
    call rows('box in the surface')
    call own_plane()
    call sealed_cell()
    call notch()
  end subroutine test_extended_fraction

  !> A box that cuts cells of the surface and holds some of them, in level water.
  subroutine start()
    type(fluid_t) :: fluid

    call simple_grid([9, 8, 8], [0.9_wp, 0.8_wp, 0.8_wp], grid)
    call flow_init(grid, flow)
    call solid_geometry_init(grid, solid)
    call set_boxes(grid, [0.23_wp, 0.22_wp, 0.31_wp], [0.65_wp, 0.61_wp, 0.66_wp], solid)
    fluid%water_level = level
    call extended_fraction_init(fluid%gravity, extension)
    call fill_liquid(grid, fluid, [water_t ::], solid, flow)
    call extend_fraction(grid, solid, extension, flow)
  end subroutine start

  !> The same value in all cells of a row, that of its water.
  subroutine rows(name)
    character(*), intent(in) :: name
    real(wp) :: expected
    integer :: k

    do k = 1, 8
      expected = min(max(10.0_wp*level - real(k - 1, wp), 0.0_wp), 1.0_wp)
      call check(name, flow%c(1:9, 1:8, k) - expected, 0.0_wp, 1.0e-14_wp)
    end do
  end subroutine rows

  !> A cut cell with other liquid than its row has its own share; the others do not change.
  subroutine own_plane()
    integer, parameter :: at(3) = [3, 4, 5]   !! open below x = 0.23 only
    real(wp) :: before(3)

    before = flow%c([2, 4, 5], 4, 5)
    flow%liquid(3, 4, 5) = 0.8_wp*flow%fluid_volume(3, 4, 5)
    call extend_fraction(grid, solid, extension, flow)
    call check('own share', flow%c(at(1), at(2), at(3)) > 0.7_wp)
    call check('neighbour in the water', flow%c(2, 4, 5), before(1))
    flow%liquid(3, 4, 5) = 0.37_wp*flow%fluid_volume(3, 4, 5)
  end subroutine own_plane

  !> A nearly full cell in the body, closed all round: nobody can tell it a value.
  subroutine sealed_cell()
    solid%alpha(5, 4, 5) = 0.99_wp
    flow%fluid_volume(5, 4, 5) = 0.01_wp*grid%volume
    flow%liquid(5, 4, 5) = 0.6_wp*flow%fluid_volume(5, 4, 5)
    call extend_fraction(grid, solid, extension, flow)
    call check('sealed cell', flow%c(5, 4, 5), 0.6_wp, 1.0e-14_wp)
    call check('the full cell beside it has the row', flow%c(4, 4, 5), flow%c(1, 1, 5), 1.0e-14_wp)
  end subroutine sealed_cell

  !> A nearly full cell in the top of the body, open to the gas only: it has the value of its row,
  !! not that of the row above.
  subroutine notch()
    real(wp) :: row

    row = flow%c(1, 1, 5)
    call start()
    solid%alpha(5, 4, 5:6) = [0.99_wp, 0.5_wp]
    solid%aperture(5, 4, 6, 3) = 0.1_wp
    call extend_fraction(grid, solid, extension, flow)
    call check('notch', flow%c(5, 4, 5), row, 1.0e-14_wp)
  end subroutine notch

end module test_extended_fraction_m
