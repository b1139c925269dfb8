!> Transport of the liquid: exact volumes, bounds, still water, moving boxes, parted basins.
module test_liquid_transport_m
  use kinds_m, only: wp, pi
  use case_types_m, only: case_t, fluid_t, water_t
  use boundary_kinds_m, only: side_slip
  use grid_m, only: grid_t
  use fields_m, only: flow_t, flow_init
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use extended_fraction_m, only: extend_fraction
  use liquid_transport_m, only: liquid_transport_t, liquid_transport_init
  use liquid_alone_m, only: transport_liquid
  use liquid_fill_m, only: fill_liquid, liquid_volume
  use vectors_m, only: quaternion_from_axis
  use tet_mesh_m, only: shape_t
  use shapes_builtin_m, only: make_shape
  use rigid_body_m, only: blocks_t
  use case_blocks_m, only: blocks_init
  use solid_fraction_m, only: solid_fraction_t, solid_fraction_init, update_solid
  use box_solid_m, only: set_boxes, simple_grid
  use check_m, only: check, checked
  implicit none
  private
  public :: test_liquid_transport

  integer, parameter :: tank_cells(3) = [16, 12, 20]
  real(wp), parameter :: tank(3) = [0.16_wp, 0.12_wp, 0.2_wp]   !! edges of the tank with boxes [m]
  logical, parameter :: walls(3) = .false.                      !! no direction is periodic
  real(wp), parameter :: gravity(3) = [0.0_wp, 0.0_wp, -9.81_wp]
  real(wp), parameter :: half(3) = [0.033_wp, 0.027_wp, 0.0318_wp]   !! of the moving box [m]
  type(grid_t) :: grid
  type(solid_geometry_t) :: old, new
  type(flow_t) :: flow
  type(liquid_transport_t) :: transport

contains

  subroutine test_liquid_transport()
    if (.not. checked) call ball_in_uniform_stream(80, 1)
    call ball_in_uniform_stream(20, 4)
    call column_in_rotation()
    call box_under_water(1)
    call box_under_water(3)
    call box_through_the_surface()
    call box_leaves_through_the_top()
    call hexapod_through_the_surface()
    call no_way_out()
    call still_water()
    call two_basins()
  end subroutine test_liquid_transport

  !> Grid, flow and transport of a tank; liquid below the level and in boxes.
  subroutine start(n, length, periodic, low, high, fluid, water)
    integer, intent(in) :: n(3)
    real(wp), intent(in) :: length(3), low(:, :), high(:, :)
    logical, intent(in) :: periodic(3)
    type(fluid_t), intent(in) :: fluid
    type(water_t), intent(in) :: water(:)

    call simple_grid(n, length, grid, periodic)
    call flow_init(grid, flow)
    call solid_geometry_init(grid, old)
    call solid_geometry_init(grid, new)
    call liquid_transport_init(grid, gravity, transport)
    call set_boxes(grid, low, high, old)
    call set_boxes(grid, low, high, new)
    call fill_liquid(grid, fluid, water, new, flow)
    call extend_fraction(grid, new, transport%extension, flow)
  end subroutine start

  !> Liquid that is in one field but not in the other [m3].
  function misplaced(liquid, other) result(volume)
    real(wp), intent(in), dimension(grid%first(1):, grid%first(2):, grid%first(3):) :: liquid, other
    real(wp) :: volume

    associate (a => grid%lo, b => grid%hi)
      volume = 0.5_wp*sum(abs(liquid(a(1):b(1), a(2):b(2), a(3):b(3)) &
                              - other(a(1):b(1), a(2):b(2), a(3):b(3))))
    end associate
  end function misplaced

  !> Largest violation of 0 <= W <= Vt [V].
  function out_of_bounds() result(worst)
    real(wp) :: worst

    associate (a => grid%lo, b => grid%hi)
      worst = max(maxval(-flow%liquid(a(1):b(1), a(2):b(2), a(3):b(3))), &
                  maxval(flow%liquid(a(1):b(1), a(2):b(2), a(3):b(3)) &
                         - flow%fluid_volume(a(1):b(1), a(2):b(2), a(3):b(3))))/grid%volume
    end associate
  end function out_of_bounds

  !> Largest difference between the carried and the true open volume [V].
  function room_error(grid, solid, flow) result(worst)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(flow_t), intent(in) :: flow
    real(wp) :: worst

    associate (a => grid%lo, b => grid%hi)
      worst = maxval(abs(flow%fluid_volume(a(1):b(1), a(2):b(2), a(3):b(3))/grid%volume &
                         - (1.0_wp - solid%alpha(a(1):b(1), a(2):b(2), a(3):b(3)))))
    end associate
  end function room_error

  !> A ball of liquid goes once around a periodic domain, cells not cubes.
  subroutine ball_in_uniform_stream(steps, subcycles)
    integer, intent(in) :: steps, subcycles   !! of the turn, of each step
    real(wp) :: nothing(3, 0), before, worst, shape_error
    real(wp), allocatable :: start_liquid(:, :, :)
    integer :: step, i, j, k

    call start([24, 16, 20], spread(0.24_wp, 1, 3), .not. walls, nothing, nothing, fluid_t(), &
               [water_t ::])
    do k = 1, grid%n(3)
      do j = 1, grid%n(2)
        do i = 1, grid%n(1)
          flow%liquid(i, j, k) = grid%volume*ball_share([i, j, k])
        end do
      end do
    end do
    call extend_fraction(grid, new, transport%extension, flow)
    allocate (start_liquid, source=flow%liquid)
    before = liquid_volume(grid, flow%liquid)
    flow%uf(:, :, :, 1) = 0.24_wp
    flow%uf(:, :, :, 2) = -0.24_wp
    flow%uf(:, :, :, 3) = 0.24_wp
    worst = 0.0_wp
    transport%subcycles = subcycles
    do step = 1, steps
      call transport_liquid(grid, old, new, 1.0_wp/real(steps, wp), step, transport, flow)
      worst = max(worst, out_of_bounds())
    end do
    shape_error = misplaced(flow%liquid, start_liquid)/before
    call check('ball: volume', liquid_volume(grid, flow%liquid)/before, 1.0_wp, 1.0e-14_wp)
    call check('ball: bounds', worst, 0.0_wp, 1.0e-15_wp)
    call check('ball: room', room_error(grid, new, flow), 0.0_wp, 1.0e-13_wp)
    call check('ball: shape after one turn', shape_error < 0.05_wp)
    call check('ball: no small cells give', transport%small%n_implicit, 0)
    print '(a, es9.2)', 'ball: share of the ball in the wrong place ', shape_error
  end subroutine ball_in_uniform_stream

  !> Share of a ball of radius 0.06 m in the middle, by points.
  function ball_share(at) result(share)
    integer, intent(in) :: at(3)
    real(wp) :: share
    integer, parameter :: n = 8
    integer :: i, j, k, hits
    real(wp) :: x(3)

    hits = 0
    do k = 1, n
      do j = 1, n
        do i = 1, n
          x = (real([i, j, k], wp) - 0.5_wp)/real(n, wp)
          x = grid%face(at, [1, 2, 3]) + grid%h*x - 0.5_wp*grid%length
          if (sum(x*x) < 0.06_wp**2) hits = hits + 1
        end do
      end do
    end do
    share = real(hits, wp)/real(n**3, wp)
  end function ball_share

  !> A block of liquid in solid rotation about the y axis.
  subroutine column_in_rotation()
    real(wp) :: nothing(3, 0), before, worst, shape_error
    real(wp), allocatable :: start_liquid(:, :, :)
    real(wp) :: x(2)
    integer :: step, i, k
    integer, parameter :: steps = 160

    call start([32, 4, 32], [0.32_wp, 0.04_wp, 0.32_wp], [.false., .true., .false.], nothing, &
               nothing, &
               fluid_t(), [water_t([0.13_wp, 0.0_wp, 0.05_wp], [0.19_wp, 0.04_wp, 0.21_wp])])
    allocate (start_liquid, source=flow%liquid)
    before = liquid_volume(grid, flow%liquid)
    do k = grid%lo(3), grid%hi(3) + 1
      do i = grid%lo(1), grid%hi(1) + 1
        x = [grid%face(i, 1), grid%face(k, 3)]
        flow%uf(i, :, k, 1) = (stream(x + [0.0_wp, grid%h(3)]) - stream(x))/grid%h(3)
        flow%uf(i, :, k, 3) = (stream(x) - stream(x + [grid%h(1), 0.0_wp]))/grid%h(1)
      end do
    end do
    worst = 0.0_wp
    do step = 1, steps
      call transport_liquid(grid, old, new, 1.0_wp/real(steps, wp), step, transport, flow)
      worst = max(worst, out_of_bounds())
    end do
    shape_error = misplaced(flow%liquid, start_liquid)/before
    call check('rotation: volume', liquid_volume(grid, flow%liquid)/before, 1.0_wp, 1.0e-14_wp)
    call check('rotation: bounds', worst, 0.0_wp, 1.0e-15_wp)
    call check('rotation: shape after one turn', shape_error < 0.05_wp)
    print '(a, es9.2)', 'rotation: share of the block in the wrong place ', shape_error
  end subroutine column_in_rotation

  !> Stream function of one turn per second about the middle, at rest outside a circle.
  pure function stream(x) result(psi)
    real(wp), intent(in) :: x(2)   !! x and z [m]
    real(wp) :: psi

    psi = pi*min(sum((x - 0.16_wp)**2), 0.15_wp**2)
  end function stream

  !> Corners of the moving box at a time in steps.
  pure subroutine box_at(centre, half, low, high)
    real(wp), intent(in) :: centre(3), half(3)
    real(wp), intent(out) :: low(3, 1), high(3, 1)

    low(:, 1) = centre - half
    high(:, 1) = centre + half
  end subroutine box_at

  !> A box on a loop deep under water, fluid moved by the correction alone: all liquid, all the
  !! time.
  subroutine box_under_water(subcycles)
    integer, intent(in) :: subcycles   !! of each step
    real(wp) :: low(3, 1), high(3, 1), before, worst, impure, angle
    type(fluid_t) :: fluid
    integer :: step, small

    fluid%water_level = 0.19_wp
    call box_at(place(0.0_wp), half, low, high)
    call start(tank_cells, tank, walls, low, high, fluid, [water_t ::])
    before = liquid_volume(grid, flow%liquid)
    worst = 0.0_wp
    impure = 0.0_wp
    small = 0
    transport%subcycles = subcycles
    do step = 1, 60
      call set_boxes(grid, low, high, old)
      angle = 2.0_wp*pi*real(step, wp)/60.0_wp
      call box_at(place(angle), half, low, high)
      call set_boxes(grid, low, high, new)
      call transport_liquid(grid, old, new, 0.01_wp, step, transport, flow)
      worst = max(worst, room_error(grid, new, flow))
      impure = max(impure, maxval(abs(flow%liquid(1:16, 1:12, 1:16) &
                                      - flow%fluid_volume(1:16, 1:12, 1:16))))
      small = max(small, transport%small%n_implicit)
    end do
    call check('box under water: volume', liquid_volume(grid, flow%liquid)/before, 1.0_wp, &
               1.0e-14_wp)
    call check('box under water: room follows the box', worst, 0.0_wp, 2.0e-12_wp)
    call check('box under water: only liquid, to the last bit', impure <= 0.0_wp)
    call check('box under water: C^ is one', all(abs(flow%c(1:16, 1:12, 1:16) - 1.0_wp) <= 0.0_wp))
    call check('box under water: cells opened and closed', small > 0)
    print '(2(a, i0), a, es9.2)', 'box under water: small cells up to ', small, &
      ', iterations ', transport%flux%iterations, ', room error ', worst
  end subroutine box_under_water

  !> Centre of a box on a closed loop.
  pure function place(angle) result(x)
    real(wp), intent(in) :: angle
    real(wp) :: x(3)

    x = [0.08_wp + 0.021_wp*cos(angle), 0.06_wp + 0.01_wp*sin(2.0_wp*angle), &
         0.09_wp + 0.03_wp*sin(angle)]
  end function place

  !> A box dips into the water and comes out again.
  subroutine box_through_the_surface()
    real(wp) :: low(3, 1), high(3, 1), before, worst, bound, drift, clamped, centre(3)
    type(fluid_t) :: fluid
    integer :: step, late

    fluid%water_level = 0.1013_wp
    centre = [0.0771_wp, 0.0613_wp, 0.15_wp]
    call box_at(centre, half, low, high)
    call start(tank_cells, tank, walls, low, high, fluid, [water_t ::])
    before = liquid_volume(grid, flow%liquid)
    worst = 0.0_wp
    bound = 0.0_wp
    drift = 0.0_wp
    clamped = 0.0_wp
    late = 0
    do step = 1, 80
      call set_boxes(grid, low, high, old)
      centre(3) = 0.15_wp - 0.05_wp*sin(2.0_wp*pi*real(step, wp)/80.0_wp)
      centre(1) = 0.0771_wp + 0.01_wp*sin(4.0_wp*pi*real(step, wp)/80.0_wp)
      call box_at(centre, half, low, high)
      call set_boxes(grid, low, high, new)
      call transport_liquid(grid, old, new, 0.01_wp, step, transport, flow)
      worst = max(worst, room_error(grid, new, flow))
      bound = max(bound, out_of_bounds())
      drift = max(drift, abs(liquid_volume(grid, flow%liquid) - flow%liquid_inflow - before)/before)
      clamped = max(clamped, transport%sweeps%clamped)
      late = max(late, transport%small%iterations)
    end do
    call check('box through the surface: volume at every step', drift, 0.0_wp, 1.0e-13_wp)
    call check('box through the surface: bounds, to the tolerance of the volumes', bound, 0.0_wp, &
               1.0e-12_wp)
    call check('box through the surface: room follows the box', worst, 0.0_wp, 2.0e-12_wp)
    call check('box through the surface: slabs need no clipping', clamped, 0.0_wp, 1.0e-13_wp)
    print '(3(a, es9.2), a, i0)', 'box through the surface: drift ', drift, ', bounds ', bound, &
      ', clamped ', clamped, ', late iterations ', late
  end subroutine box_through_the_surface

  !> A turning hexapod dips into the water and comes out again, fluid moved by the correction alone.
  subroutine hexapod_through_the_surface()
    type(solid_geometry_t), allocatable :: old, new, keep
    type(case_t) :: case
    type(shape_t) :: shapes(1)
    type(blocks_t) :: blocks
    type(solid_fraction_t) :: fraction
    character(:), allocatable :: message
    real(wp) :: worst, bound, drift, volume
    integer :: step

    allocate (case%shape(1), case%body(1), case%drop(0), old, new)
    case%shape(1)%name = 'hexapod'
    case%shape(1)%kind = 'hexapod'
    case%shape(1)%size = 0.03_wp
    case%shape(1)%refinement = 1
    case%body(1)%shape = 'hexapod'
    case%body(1)%position = [0.0771_wp, 0.0611_wp, 0.14_wp]
    case%fluid%water_level = 0.1013_wp
    call make_shape(case%shape(1), shapes(1), message)
    call blocks_init(case, shapes, blocks)
    call simple_grid(tank_cells, tank, grid)
    call flow_init(grid, flow)
    call solid_geometry_init(grid, old, blocks%n)
    call solid_geometry_init(grid, new, blocks%n)
    call solid_fraction_init(grid, blocks, fraction)
    call liquid_transport_init(grid, gravity, transport)
    call update_solid(fraction, grid, blocks, new)
    call fill_liquid(grid, case%fluid, [water_t ::], new, flow)
    call extend_fraction(grid, new, transport%extension, flow)
    worst = 0.0_wp
    bound = 0.0_wp
    drift = 0.0_wp
    do step = 1, 40
      call move_alloc(old, keep)
      call move_alloc(new, old)
      call move_alloc(keep, new)
      blocks%x(3, 1) = 0.14_wp - 0.06_wp*sin(2.0_wp*pi*real(step, wp)/40.0_wp)
      blocks%q(:, 1) = quaternion_from_axis([1.0_wp, -0.4_wp, 0.3_wp], 0.08_wp*real(step, wp))
      call update_solid(fraction, grid, blocks, new)
      call transport_liquid(grid, old, new, 0.01_wp, step, transport, flow)
      worst = max(worst, room_error(grid, new, flow))
      bound = max(bound, out_of_bounds())
      volume = liquid_volume(grid, flow%liquid) - flow%liquid_inflow
      drift = max(drift, abs(volume/flow%liquid_initial - 1.0_wp))
    end do
    call check('hexapod: volume at every step', drift, 0.0_wp, 1.0e-13_wp)
    call check('hexapod: bounds, to the tolerance of the volumes', bound, 0.0_wp, 1.0e-12_wp)
    call check('hexapod: room follows the block', worst, 0.0_wp, 2.0e-12_wp)
    call check('hexapod: C^ within 0 and 1', all(flow%c >= 0.0_wp .and. flow%c <= 1.0_wp))
    print '(3(a, es9.2))', 'hexapod: drift ', drift, ', bounds ', bound, ', room error ', worst
  end subroutine hexapod_through_the_surface

  !> A box moves out through the open top: what it leaves behind comes in as gas.
  subroutine box_leaves_through_the_top()
    real(wp) :: low(3, 1), high(3, 1), before, worst, centre(3)
    type(fluid_t) :: fluid
    integer :: step

    fluid%water_level = 0.0613_wp
    centre = [0.0771_wp, 0.0613_wp, 0.15_wp]
    call box_at(centre, half, low, high)
    call start(tank_cells, tank, walls, low, high, fluid, [water_t ::])
    before = liquid_volume(grid, flow%liquid)
    worst = 0.0_wp
    do step = 1, 30
      call set_boxes(grid, low, high, old)
      centre(3) = centre(3) + 0.0031_wp
      call box_at(centre, half, low, high)
      call set_boxes(grid, low, high, new)
      call transport_liquid(grid, old, new, 0.01_wp, step, transport, flow)
      worst = max(worst, room_error(grid, new, flow))
    end do
    call check('box leaves: volume', liquid_volume(grid, flow%liquid)/before, 1.0_wp, 1.0e-14_wp)
    call check('box leaves: room', worst, 0.0_wp, 2.0e-12_wp)
    call check('box leaves: no liquid through the top', flow%liquid_inflow, 0.0_wp, 0.0_wp)
  end subroutine box_leaves_through_the_top

  !> A box swells in a closed tank: the volume has nowhere to go, yet no liquid is lost, all bounds
  !! hold and the cells that close give all they had.
  subroutine no_way_out()
    real(wp) :: low(3, 1), high(3, 1), before, bound, held
    type(fluid_t) :: fluid
    integer :: step

    fluid%water_level = 0.1013_wp
    call box_at(place(0.0_wp), half, low, high)
    call start(tank_cells, tank, walls, low, high, fluid, [water_t ::])
    grid%side(2, 3) = side_slip
    before = liquid_volume(grid, flow%liquid)
    bound = 0.0_wp
    held = 0.0_wp
    do step = 1, 8
      call set_boxes(grid, low, high, old)
      call box_at(place(0.0_wp), half + 0.002_wp*real(step, wp), low, high)
      call set_boxes(grid, low, high, new)
      call transport_liquid(grid, old, new, 0.01_wp, step, transport, flow)
      bound = max(bound, out_of_bounds())
      associate (n => grid%n)
        held = max(held, sum(flow%liquid(1:n(1), 1:n(2), 1:n(3)), &
                             new%alpha(1:n(1), 1:n(2), 1:n(3)) >= 1.0_wp - 1.0e-12_wp)/grid%volume)
      end associate
    end do
    call check('no way out: volume', liquid_volume(grid, flow%liquid)/before, 1.0_wp, 1.0e-14_wp)
    call check('no way out: bounds', bound, 0.0_wp, 1.0e-12_wp)
    call check('no way out: closed cells are empty', held, 0.0_wp, 1.0e-10_wp)
    call check('no way out: it is told', transport%flux%unmatched > 0.01_wp)
  end subroutine no_way_out

  !> Level inside a cell, boxes through the surface: nothing moves, each row has one C^.
  subroutine still_water()
    real(wp) :: low(3, 3), high(3, 3), spread_of_row
    real(wp), allocatable :: liquid(:, :, :), c(:, :, :)
    type(fluid_t) :: fluid
    integer :: step, k

    fluid%water_level = 0.1513_wp
    low(:, 1) = [0.0213_wp, 0.0181_wp, 0.1111_wp]
    high(:, 1) = [0.0671_wp, 0.0537_wp, 0.1777_wp]
    low(:, 2) = [0.08_wp, 0.0_wp, 0.0_wp]
    high(:, 2) = [0.111_wp, 0.033_wp, 0.2_wp]
    low(:, 3) = [0.12_wp, 0.05_wp, 0.1502_wp]
    high(:, 3) = [0.151_wp, 0.1_wp, 0.153_wp]
    call start(tank_cells, tank, walls, low, high, fluid, [water_t ::])
    allocate (liquid, source=flow%liquid)
    allocate (c, source=flow%c)
    do step = 1, 3
      call transport_liquid(grid, old, new, 0.01_wp, step, transport, flow)
    end do
    call check('still water: liquid untouched', all(abs(flow%liquid - liquid) <= 0.0_wp))
    call check('still water: C^ untouched', all(abs(flow%c - c) <= 0.0_wp))
    spread_of_row = 0.0_wp
    do k = 1, grid%n(3)
      associate (row => flow%c(1:16, 1:12, k))
        spread_of_row = max(spread_of_row, maxval(row) - minval(row))
      end associate
    end do
    call check('still water: each row has one C^', spread_of_row, 0.0_wp, 0.0_wp)
    call check('still water: C^ of the surface row', flow%c(1, 12, 16), 0.13_wp, 1.0e-14_wp)
    call check('still water: exact volume', flow%liquid_initial, 0.16_wp*0.12_wp*0.1513_wp &
               - product([0.0458_wp, 0.0356_wp, 0.0402_wp]) &
               - product([0.031_wp, 0.033_wp, 0.1513_wp]) &
               - product([0.031_wp, 0.05_wp, 0.0011_wp]), 1.0e-16_wp)
  end subroutine still_water

  !> A wall parts the tank, the levels differ; a box dips into one basin. Each keeps its liquid.
  subroutine two_basins()
    real(wp) :: low(3, 2), high(3, 2), left, right, worst, bound
    type(fluid_t) :: fluid
    integer :: step

    fluid%water_level = 0.0613_wp
    low(:, 1) = [0.0837_wp, -0.01_wp, -0.01_wp]
    high(:, 1) = [0.0971_wp, 0.13_wp, 0.21_wp]
    low(:, 2) = [0.0213_wp, 0.0281_wp, 0.1111_wp]
    high(:, 2) = [0.0671_wp, 0.0837_wp, 0.1577_wp]
    call start(tank_cells, tank, walls, low, high, fluid, &
               [water_t([0.0_wp, 0.0_wp, 0.0_wp], [0.09_wp, 0.12_wp, 0.1_wp])])
    left = sum(flow%liquid(1:9, 1:12, 1:20))
    right = sum(flow%liquid(10:16, 1:12, 1:20))
    worst = 0.0_wp
    bound = 0.0_wp
    do step = 1, 60
      call set_boxes(grid, low, high, old)
      low(3, 2) = 0.1111_wp - 0.0011_wp*real(step, wp)
      high(3, 2) = 0.1577_wp - 0.0011_wp*real(step, wp)
      call set_boxes(grid, low, high, new)
      call transport_liquid(grid, old, new, 0.01_wp, step, transport, flow)
      worst = max(worst, abs(sum(flow%liquid(1:9, 1:12, 1:20))/left - 1.0_wp), &
                  abs(sum(flow%liquid(10:16, 1:12, 1:20))/right - 1.0_wp))
      bound = max(bound, out_of_bounds())
    end do
    call check('two basins: each keeps its liquid', worst, 0.0_wp, 1.0e-13_wp)
    call check('two basins: bounds, to the tolerance of the volumes', bound, 0.0_wp, 1.0e-12_wp)
    call check('two basins: parts of the band', transport%flux%band%parts >= 2)
    call check('two basins: level of the right one stands', &
               maxval(flow%c(11:16, 1:12, 7)) - minval(flow%c(11:16, 1:12, 7)), 0.0_wp, 0.0_wp)
  end subroutine two_basins

end module test_liquid_transport_m
