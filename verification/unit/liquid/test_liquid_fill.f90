!> Initial liquid and the rise of the surface when a block appears: exact volumes, level surfaces.
module test_liquid_fill_m
  use check_m, only: check, wp
  use case_types_m, only: fluid_t, water_t
  use polyhedron_m, only: tet_moments_below
  use grid_m, only: grid_t
  use fields_m, only: flow_t, flow_init
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use one_body_m, only: one_body_t, place
  use extended_fraction_m, only: extended_fraction_t, extended_fraction_init, extend_fraction
  use liquid_fill_m, only: fill_liquid, raise_surface, liquid_volume
  use box_solid_m, only: set_boxes, simple_grid
  implicit none
  private
  public :: test_liquid_fill

  integer, parameter :: cells(3) = [16, 12, 20]
  real(wp), parameter :: tank(3) = [0.16_wp, 0.06_wp, 0.2_wp]   !! cells are not cubes [m]
  real(wp), parameter :: low_m(3) = [0.0333_wp, 0.0222_wp, 0.0444_wp]    !! of a solid box [m]
  real(wp), parameter :: high_m(3) = [0.0777_wp, 0.0333_wp, 0.0888_wp]
  real(wp), parameter :: up(3) = [0.0_wp, 0.0_wp, 1.0_wp]

  type(grid_t) :: grid
  type(flow_t) :: flow
  type(solid_geometry_t) :: before, after
  type(extended_fraction_t) :: extension

contains

  subroutine test_liquid_fill()
    call simple_grid(cells, tank, grid)
    call flow_init(grid, flow)
    call solid_geometry_init(grid, before)
    call solid_geometry_init(grid, after)
    call extended_fraction_init([0.0_wp, 0.0_wp, -9.81_wp], extension)
    call level_and_boxes()
    call boxes_around_a_solid()
    call box_appears(0.1513_wp, [0.031_wp, 0.011_wp, 0.1211_wp], [0.0713_wp, 0.043_wp, 0.1611_wp], &
                     'box')
    call box_appears(0.1487_wp, [0.0_wp, 0.0_wp, 0.0_wp], [0.0713_wp, 0.0491_wp, 0.0611_wp], &
                     'box that lifts the surface by more than a cell')
    call box_appears(0.1951_wp, [0.031_wp, 0.011_wp, 0.1211_wp], [0.0713_wp, 0.043_wp, 0.1311_wp], &
                     'box in a tank that is full but for half a cell')
    call block_appears()
    call no_surface()
  end subroutine test_liquid_fill

  !> No solid in the tank.
  subroutine empty(solid)
    type(solid_geometry_t), intent(inout) :: solid
    real(wp) :: nothing(3, 0)

    call set_boxes(grid, nothing, nothing, solid)
  end subroutine empty

  !> Still water up to a level, before anything appears; everywhere without one.
  subroutine still(level)
    real(wp), intent(in), optional :: level   !! [m]

    call empty(before)
    if (present(level)) then
      call fill_liquid(grid, fluid_t(water_level=level), [water_t ::], before, flow)
    else
      call fill_liquid(grid, fluid_t(single_phase=.true.), [water_t ::], before, flow)
    end if
    call extend_fraction(grid, before, extension, flow)
  end subroutine still

  !> Largest difference of C^ within a row.
  real(wp) function spread_of_rows()
    integer :: k

    spread_of_rows = 0.0_wp
    do k = 1, grid%n(3)
      associate (row => flow%c(1:grid%n(1), 1:grid%n(2), k))
        spread_of_rows = max(spread_of_rows, maxval(row) - minval(row))
      end associate
    end do
  end function spread_of_rows

  subroutine level_and_boxes()
    type(fluid_t) :: fluid
    type(water_t) :: water(3)

    call empty(after)
    fluid%water_level = 0.0513_wp
    call fill_liquid(grid, fluid, [water_t ::], after, flow)
    call check('level', flow%liquid_initial, 0.16_wp*0.06_wp*0.0513_wp, 1.0e-17_wp)
    water(1) = water_t(min=[0.011_wp, 0.013_wp, 0.07_wp], max=[0.0533_wp, 0.041_wp, 0.1111_wp])
    water(2) = water_t(min=[0.042_wp, 0.020_wp, 0.05_wp], max=[0.0833_wp, 0.049_wp, 0.0911_wp])
    water(3) = water_t(min=[0.1_wp, -1.0_wp, -1.0_wp], max=[2.0_wp, 0.0021_wp, 2.0_wp])
    call fill_liquid(grid, fluid, water, after, flow)
    call check('level and boxes, overlaps once', &
      flow%liquid_initial, 0.16_wp*0.06_wp*0.0513_wp + product([0.0423_wp, 0.028_wp, 0.0411_wp]) &
      + product([0.0413_wp, 0.029_wp, 0.0398_wp]) - product([0.0113_wp, 0.021_wp, 0.0211_wp]) &
      + product([0.06_wp, 0.0021_wp, 0.1487_wp]), 1.0e-17_wp)
    fluid = fluid_t(gravity=[9.81_wp, 0.0_wp, 0.0_wp], water_level=0.1_wp)
    call fill_liquid(grid, fluid, [water_t ::], after, flow)
    call check('gravity along +x: beyond', flow%liquid_initial, 0.06_wp*0.06_wp*0.2_wp, 1.0e-17_wp)
    call check('and dry before it', maxval(flow%liquid(1:10, :, :)), 0.0_wp)
    call fill_liquid(grid, fluid_t(), [water_t ::], after, flow)
    call check('no level, no liquid', flow%liquid_initial, 0.0_wp)
  end subroutine level_and_boxes

  !> Two boxes of liquid that overlap, cut by a solid.
  subroutine boxes_around_a_solid()
    type(water_t) :: water(2)

    call set_boxes(grid, low_m, high_m, after)
    water(1) = water_t(min=[0.0111_wp, 0.0_wp, 0.0_wp], max=[0.0666_wp, 0.06_wp, 0.0666_wp])
    water(2) = water_t(min=[0.0555_wp, 0.0255_wp, 0.0_wp], max=[0.1_wp, 0.06_wp, 0.1_wp])
    call fill_liquid(grid, fluid_t(), water, after, flow)
    call check('boxes around a solid', flow%liquid_initial, &
      product([0.0555_wp, 0.06_wp, 0.0666_wp]) + product([0.0445_wp, 0.0345_wp, 0.1_wp]) &
      - product([0.0111_wp, 0.0345_wp, 0.0666_wp]) - product([0.0333_wp, 0.0111_wp, 0.0222_wp]) &
      - product([0.0222_wp, 0.0078_wp, 0.0444_wp]) + product([0.0111_wp, 0.0078_wp, 0.0222_wp]), &
      1.0e-17_wp)
    call check('room is the open volume', sum(flow%fluid_volume(1:16, 1:12, 1:20)), product(tank) &
               - product(high_m - low_m), 1.0e-16_wp)
  end subroutine boxes_around_a_solid

  !> A box appears in still water: the surface is as high as it must be, and level.
  subroutine box_appears(level, low, high, name)
    real(wp), intent(in) :: level, low(3), high(3)
    character(*), intent(in) :: name
    real(wp) :: rest, new_level, volume, foot
    integer :: k

    call still(level)
    call set_boxes(grid, low, high, after)
    call raise_surface(grid, before, after, extension, flow, rest)
    volume = liquid_volume(grid, flow%liquid)
    call check(name//': volume', volume/flow%liquid_initial, 1.0_wp, 1.0e-14_wp)
    call check(name//': all of it found a place', rest, 0.0_wp)
    call check(name//': each row has one C^', spread_of_rows(), 0.0_wp, 1.0e-12_wp)
    foot = product(high(1:2) - low(1:2))
    if (high(3) > level) then   ! the new surface still cuts the box
      new_level = (volume - foot*low(3))/(tank(1)*tank(2) - foot)
    else
      new_level = (volume + foot*(high(3) - low(3)))/(tank(1)*tank(2))
    end if
    k = grid%cell_of(new_level, 3)
    call check(name//': new level', flow%c(16, 12, k), (new_level - grid%face(k, 3))/grid%h(3), &
               1.0e-11_wp)
    call check(name//': full below, dry above', all(abs(flow%c(:, :, 1:k - 1) - 1.0_wp) <= 0.0_wp) &
               .and. all(abs(flow%c(:, :, k + 1:20)) <= 0.0_wp))
  end subroutine box_appears

  !> A tilted hexapod through the surface: liquid around it by its tetrahedra, then as it appears.
  subroutine block_appears()
    type(one_body_t) :: block
    real(wp), parameter :: level = 0.1413_wp
    real(wp) :: rest, displaced, part, moment(3)
    integer :: t

    call place('&grid cells=16,12,20 length=.16,.06,.2/ &shape name="h" kind="hexapod" ' &
      //'size=.016 refinement=1/ &body shape="h" position=.0771,.0311,.1371 axis=1,.3,.7 ' &
      //'angle_deg=34/', block)
    call fill_liquid(grid, fluid_t(water_level=level), [water_t ::], block%solid, flow)
    displaced = 0.0_wp
    do t = 1, block%solid%tets%n
      call tet_moments_below(block%solid%tets%corner(:, :, t), up, level, part, moment)
      displaced = displaced + part
    end do
    call check('hexapod: liquid around it', flow%liquid_initial, &
               tank(1)*tank(2)*level - displaced, 1.0e-13_wp*flow%liquid_initial)
    call extend_fraction(grid, block%solid, extension, flow)
    call check('hexapod: each row has one C^', spread_of_rows(), 0.0_wp, 1.0e-12_wp)

    call still(level)
    call raise_surface(grid, before, block%solid, extension, flow, rest)
    call check('volume then', liquid_volume(grid, flow%liquid)/flow%liquid_initial, 1.0_wp, &
      1.0e-14_wp)
    call check('hexapod appears: all of it found a place', rest, 0.0_wp)
    call check('hexapod appears: each row has one C^', spread_of_rows(), 0.0_wp, 1.0e-12_wp)
  end subroutine block_appears

  !> Liquid everywhere: what the box displaces leaves the tank and is booked.
  subroutine no_surface()
    real(wp) :: rest

    call still()
    call set_boxes(grid, low_m, high_m, after)
    call raise_surface(grid, before, after, extension, flow, rest)
    call check('single phase: displaced', rest, product(high_m - low_m), 1.0e-17_wp)
    call check('single phase: all liquid', flow%liquid - flow%fluid_volume, 0.0_wp)
    call check('single phase: balance', liquid_volume(grid, flow%liquid) - flow%liquid_initial &
               - flow%liquid_inflow, 0.0_wp, 1.0e-17_wp)
  end subroutine no_surface

end module test_liquid_fill_m
