!> Transport of the liquid: exact volumes, bounds, moving boxes, parted basins.
module test_liquid_transport_m
  use check_m, only: check, checked, wp, pi
  use case_types_m, only: fluid_t, water_t
  use boundary_kinds_m, only: side_slip
  use grid_m, only: grid_t
  use fields_m, only: flow_t, flow_init
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use extended_fraction_m, only: extend_fraction
  use liquid_transport_m, only: liquid_transport_t, liquid_transport_init
  use liquid_alone_m, only: transport_liquid
  use liquid_fill_m, only: fill_liquid, liquid_volume
  use vectors_m, only: quaternion_from_axis
  use solid_fraction_m, only: update_solid
  use one_body_m, only: one_body_t, place_body => place
  use box_solid_m, only: set_boxes, simple_grid
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
  real(wp) :: nothing(3, 0)
  real(wp) :: room, bound, drift   !! largest errors since `start` [V], [V], [-]

contains

  subroutine test_liquid_transport()
    if (.not. checked) call ball_in_uniform_stream(80, 1)
    call ball_in_uniform_stream(20, 4)
    call column_in_rotation()
    call box_under_water(1)
    call box_under_water(3)
    call hexapod_through_the_surface()
    call no_way_out()
    call two_basins()
  end subroutine test_liquid_transport

  !> Grid, flow and transport; liquid below the level and in boxes.
  subroutine start(n, length, periodic, low, high, level, water)
    integer, intent(in) :: n(3)
    real(wp), intent(in) :: length(3), low(:, :), high(:, :), level
    logical, intent(in) :: periodic(3)
    type(water_t), intent(in) :: water(:)

    call simple_grid(n, length, grid, periodic)
    call flow_init(grid, flow)
    call solid_geometry_init(grid, old)
    call solid_geometry_init(grid, new)
    call liquid_transport_init(grid, gravity, transport)
    call set_boxes(grid, low, high, new)
    call fill_liquid(grid, fluid_t(water_level=level), water, new, flow)
    call extend_fraction(grid, new, transport%extension, flow)
    room = 0.0_wp
    bound = 0.0_wp
    drift = 0.0_wp
  end subroutine start

  !> A box about a place in the tank with walls.
  subroutine start_box(centre, level)
    real(wp), intent(in) :: centre(3), level

    call start(tank_cells, tank, walls, reshape(centre - half, [3, 1]), &
               reshape(centre + half, [3, 1]), level, [water_t ::])
  end subroutine start_box

  !> A step at whose end the box is there, by so much larger.
  subroutine carry_box(step, centre, grown)
    integer, intent(in) :: step
    real(wp), intent(in) :: centre(3)
    real(wp), intent(in), optional :: grown   !! half edges [m]
    real(wp) :: edge(3)

    edge = half
    if (present(grown)) edge = half + grown
    old = new
    call set_boxes(grid, centre - edge, centre + edge, new)
    call carry(step, 0.01_wp, old, new)
  end subroutine carry_box

  !> One step, and the largest errors so far.
  subroutine carry(step, dt, before, after)
    integer, intent(in) :: step
    real(wp), intent(in) :: dt
    type(solid_geometry_t), intent(in) :: before, after

    call transport_liquid(grid, before, after, dt, step, transport, flow)
    associate (a => grid%lo, b => grid%hi)
      associate (fluid => flow%fluid_volume(a(1):b(1), a(2):b(2), a(3):b(3))/grid%volume, &
                 liquid => flow%liquid(a(1):b(1), a(2):b(2), a(3):b(3))/grid%volume)
        room = max(room, maxval(abs(fluid - 1.0_wp + after%alpha(a(1):b(1), a(2):b(2), a(3):b(3)))))
        bound = max(bound, maxval(-liquid), maxval(liquid - fluid))
      end associate
    end associate
    drift = max(drift, abs((liquid_volume(grid, flow%liquid) - flow%liquid_inflow) &
                           /flow%liquid_initial - 1.0_wp))
  end subroutine carry

  !> No liquid is lost in any step, bounds hold to the tolerance of the volumes, the room follows.
  subroutine check_books(name)
    character(*), intent(in) :: name

    call check(name//': volume at every step', drift, 0.0_wp, 1.0e-13_wp)
    call check(name//': bounds', bound, 0.0_wp, 1.0e-12_wp)
    call check(name//': room follows', room, 0.0_wp, 2.0e-12_wp)
  end subroutine check_books

  !> Liquid that is in one field but not in the other [m3].
  real(wp) function misplaced(liquid, other) result(volume)
    real(wp), intent(in), dimension(grid%first(1):, grid%first(2):, grid%first(3):) :: liquid, other

    associate (a => grid%lo, b => grid%hi)
      volume = 0.5_wp*sum(abs(liquid(a(1):b(1), a(2):b(2), a(3):b(3)) &
                              - other(a(1):b(1), a(2):b(2), a(3):b(3))))
    end associate
  end function misplaced

  !> A ball of liquid goes once around a periodic domain, cells not cubes.
  subroutine ball_in_uniform_stream(steps, subcycles)
    integer, intent(in) :: steps, subcycles   !! of the turn, of each step
    integer :: i, j, k

    call start([24, 16, 20], spread(0.24_wp, 1, 3), .not. walls, nothing, nothing, -1.0_wp, &
               [water_t ::])
    do concurrent (k=1:grid%n(3), j=1:grid%n(2), i=1:grid%n(1))
      flow%liquid(i, j, k) = grid%volume*ball_share([i, j, k])
    end do
    call extend_fraction(grid, new, transport%extension, flow)
    flow%uf(:, :, :, 1) = 0.24_wp
    flow%uf(:, :, :, 2) = -0.24_wp
    flow%uf(:, :, :, 3) = 0.24_wp
    transport%subcycles = subcycles
    call one_turn('ball', steps)
    call check('ball: room', room, 0.0_wp, 1.0e-13_wp)
    call check('ball: no small cells give', transport%small%n_implicit, 0)
  end subroutine ball_in_uniform_stream

  !> After a second the liquid is where it was.
  subroutine one_turn(name, steps)
    character(*), intent(in) :: name
    integer, intent(in) :: steps
    real(wp), allocatable :: before(:, :, :)
    real(wp) :: error
    integer :: step

    allocate (before, source=flow%liquid)
    flow%liquid_initial = liquid_volume(grid, before)
    do step = 1, steps
      call carry(step, 1.0_wp/real(steps, wp), new, new)
    end do
    error = misplaced(flow%liquid, before)/flow%liquid_initial
    call check(name//': volume', drift, 0.0_wp, 1.0e-14_wp)
    call check(name//': bounds', bound, 0.0_wp, 1.0e-15_wp)
    call check(name//': shape after one turn', error < 0.05_wp)
  end subroutine one_turn

  !> Share of a ball of radius 0.06 m in the middle, by points.
  pure real(wp) function ball_share(at) result(share)
    integer, intent(in) :: at(3)
    integer, parameter :: n = 8
    real(wp) :: x(3)
    integer :: m

    share = 0.0_wp
    do m = 0, n**3 - 1
      x = grid%face(at, [1, 2, 3]) + grid%h*(modulo(m/[1, n, n**2], n) + 0.5_wp)/n
      if (norm2(x - 0.5_wp*grid%length) < 0.06_wp) share = share + 1.0_wp/n**3
    end do
  end function ball_share

  !> A block of liquid in solid rotation about the y axis.
  subroutine column_in_rotation()
    real(wp) :: x(2)
    integer :: i, k

    call start([32, 4, 32], [0.32_wp, 0.04_wp, 0.32_wp], [.false., .true., .false.], nothing, &
               nothing, -1.0_wp, [water_t(min=[0.13_wp, 0.0_wp, 0.05_wp], &
               max=[0.19_wp, 0.04_wp, 0.21_wp])])
    do concurrent (k=grid%lo(3):grid%hi(3) + 1, i=grid%lo(1):grid%hi(1) + 1)
      x = [grid%face(i, 1), grid%face(k, 3)]
      flow%uf(i, :, k, 1) = (stream(x + [0.0_wp, grid%h(3)]) - stream(x))/grid%h(3)
      flow%uf(i, :, k, 3) = (stream(x) - stream(x + [grid%h(1), 0.0_wp]))/grid%h(1)
    end do
    call one_turn('rotation', 160)
  end subroutine column_in_rotation

  !> Stream function of one turn per second about the middle, at rest outside a circle.
  pure real(wp) function stream(x) result(psi)
    real(wp), intent(in) :: x(2)   !! x and z [m]

    psi = pi*min(sum((x - 0.16_wp)**2), 0.15_wp**2)
  end function stream

  !> A box on a loop deep under water, fluid moved by the correction alone: all liquid at all times.
  subroutine box_under_water(subcycles)
    integer, intent(in) :: subcycles   !! of each step
    real(wp) :: impure
    integer :: step, small

    call start_box(place(0.0_wp), 0.19_wp)
    impure = 0.0_wp
    small = 0
    transport%subcycles = subcycles
    do step = 1, 60
      call carry_box(step, place(2.0_wp*pi*real(step, wp)/60.0_wp))
      impure = max(impure, maxval(abs(flow%liquid(1:16, 1:12, 1:16) &
                                      - flow%fluid_volume(1:16, 1:12, 1:16))))
      small = max(small, transport%small%n_implicit)
    end do
    call check_books('box under water')
    call check('box under water: only liquid, to the last bit', impure <= 0.0_wp)
    call check('box under water: C^ is one', all(abs(flow%c(1:16, 1:12, 1:16) - 1.0_wp) <= 0.0_wp))
    call check('box under water: cells opened and closed', small > 0)
  end subroutine box_under_water

  !> Centre of a box on a closed loop.
  pure function place(angle) result(x)
    real(wp), intent(in) :: angle
    real(wp) :: x(3)

    x = [0.08_wp + 0.021_wp*cos(angle), 0.06_wp + 0.01_wp*sin(2.0_wp*angle), &
         0.09_wp + 0.03_wp*sin(angle)]
  end function place

  !> A turning hexapod dips into the water and comes out again, fluid moved by the correction alone.
  subroutine hexapod_through_the_surface()
    type(one_body_t) :: block
    type(solid_geometry_t) :: before
    real(wp) :: clamped
    integer :: step

    clamped = 0.0_wp
    call start(tank_cells, tank, walls, nothing, nothing, 0.1013_wp, [water_t ::])
    call place_body('&grid cells=16,12,20 length=.16,.12,.2/ &shape name="h" kind="hexapod" ' &
      //'size=.03 refinement=1/ &body shape="h" position=.0771,.0611,.14/', block)
    call fill_liquid(grid, fluid_t(water_level=0.1013_wp), [water_t ::], block%solid, flow)
    call extend_fraction(grid, block%solid, transport%extension, flow)
    do step = 1, 40
      before = block%solid
      block%blocks%x(3, 1) = 0.14_wp - 0.06_wp*sin(2.0_wp*pi*real(step, wp)/40.0_wp)
      block%blocks%q(:, 1) = quaternion_from_axis([1.0_wp, -0.4_wp, 0.3_wp], 0.08_wp*real(step, wp))
      call update_solid(block%fraction, grid, block%blocks, block%solid)
      call carry(step, 0.01_wp, before, block%solid)
      clamped = max(clamped, transport%sweeps%clamped)
    end do
    call check('hexapod: slabs need no clipping', clamped, 0.0_wp, 1.0e-13_wp)
    call check_books('hexapod')
    call check('hexapod: C^ within 0 and 1', all(flow%c >= 0.0_wp .and. flow%c <= 1.0_wp))
  end subroutine hexapod_through_the_surface

  !> A box swells in a closed tank: the volume has nowhere to go, yet no liquid is lost, all bounds
  !! hold and the cells that close give all they had.
  subroutine no_way_out()
    real(wp) :: held
    integer :: step

    call start_box(place(0.0_wp), 0.1013_wp)
    grid%side(2, 3) = side_slip
    held = 0.0_wp
    do step = 1, 8
      call carry_box(step, place(0.0_wp), 0.002_wp*real(step, wp))
      associate (n => grid%n)
        held = max(held, sum(flow%liquid(1:n(1), 1:n(2), 1:n(3)), &
                             new%alpha(1:n(1), 1:n(2), 1:n(3)) >= 1.0_wp - 1.0e-12_wp)/grid%volume)
      end associate
    end do
    call check('no way out: volume', drift, 0.0_wp, 1.0e-14_wp)
    call check('no way out: bounds', bound, 0.0_wp, 1.0e-12_wp)
    call check('no way out: closed cells are empty', held, 0.0_wp, 1.0e-10_wp)
    call check('no way out: it is told', transport%flux%unmatched > 0.01_wp)
  end subroutine no_way_out

  !> A wall parts the tank, the levels differ; a box dips into one basin. Each keeps its liquid, the
  !! other one its level to the last bit.
  subroutine two_basins()
    real(wp) :: low(3, 2), high(3, 2), shift(3, 2), left, right, worst
    integer :: step

    low = reshape([0.0837_wp, -0.01_wp, -0.01_wp, 0.0213_wp, 0.0281_wp, 0.1111_wp], [3, 2])
    high = reshape([0.0971_wp, 0.13_wp, 0.21_wp, 0.0671_wp, 0.0837_wp, 0.1577_wp], [3, 2])
    shift = 0.0_wp
    call start(tank_cells, tank, walls, low, high, 0.0613_wp, &
               [water_t(min=[0.0_wp, 0.0_wp, 0.0_wp], max=[0.09_wp, 0.12_wp, 0.1_wp])])
    left = sum(flow%liquid(1:9, 1:12, 1:20))
    right = sum(flow%liquid(10:16, 1:12, 1:20))
    worst = 0.0_wp
    do step = 1, 60
      shift(3, 2) = -0.0011_wp*real(step, wp)
      old = new
      call set_boxes(grid, low + shift, high + shift, new)
      call carry(step, 0.01_wp, old, new)
      worst = max(worst, abs(sum(flow%liquid(1:9, 1:12, 1:20))/left - 1.0_wp), &
                  abs(sum(flow%liquid(10:16, 1:12, 1:20))/right - 1.0_wp))
    end do
    call check_books('two basins')
    call check('two basins: each keeps its liquid', worst, 0.0_wp, 1.0e-13_wp)
    call check('two basins: parts of the band', transport%flux%band%parts >= 2)
    call check('two basins: level of the right one stands', &
      maxval(flow%c(11:16, 1:12, 7)) - minval(flow%c(11:16, 1:12, 7)), 0.0_wp)
  end subroutine two_basins

end module test_liquid_transport_m
