!> Grids without a case, and axis-parallel boxes in them.
module box_solid_m
  use kinds_m, only: wp
  use boundary_kinds_m, only: side_slip, side_open, side_periodic
  use grid_m, only: grid_t
  use parallel_m, only: decompose
  use case_types_m, only: shape_input_t
  use shapes_builtin_m, only: make_shape
  use rigid_body_m, only: blocks_t
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use solid_fraction_m, only: solid_fraction_t, solid_fraction_init, update_solid
  implicit none
  private
  public :: set_boxes, simple_grid

  !> Boxes, or one.
  interface set_boxes
    procedure :: set_many, set_one
  end interface set_boxes

contains

  !> Grid with slip walls, an open top and, if asked, periodic directions.
  subroutine simple_grid(n, length, grid, periodic)
    integer, intent(in) :: n(3)
    real(wp), intent(in) :: length(3)   !! [m]
    type(grid_t), intent(out) :: grid
    logical, intent(in), optional :: periodic(3)
    integer :: d, lo(3), hi(3)

    grid%n = n
    grid%length = length
    grid%h = length/real(n, wp)
    grid%volume = product(grid%h)
    grid%area = grid%volume/grid%h
    grid%side = side_slip
    grid%side(2, 3) = side_open
    if (present(periodic)) grid%periodic = periodic
    do d = 1, 3
      if (grid%periodic(d)) grid%side(:, d) = side_periodic
    end do
    call decompose(n, grid%periodic, lo, hi, grid%at_side)
    call grid%own(lo, hi)
  end subroutine simple_grid

  !> Boxes that do not overlap, as bodies in the grid.
  subroutine set_many(grid, low, high, solid)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: low(:, :), high(:, :)   !! (3, boxes) [m]
    type(solid_geometry_t), intent(out) :: solid
    type(solid_fraction_t) :: fraction
    type(blocks_t) :: blocks
    character(:), allocatable :: message
    integer :: b

    blocks%n = size(low, 2)
    allocate (blocks%shapes(blocks%n), blocks%present(blocks%n))
    blocks%shape = [(b, b=1, blocks%n)]
    blocks%present = .true.
    blocks%x = 0.5_wp*(low + high)
    blocks%q = spread([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], 2, blocks%n)
    do b = 1, blocks%n
      call make_shape(shape_input_t(kind='box', size=high(:, b) - low(:, b)), blocks%shapes(b), &
        message)
    end do
    call solid_geometry_init(grid, solid, blocks%n)
    call solid_fraction_init(grid, blocks, fraction)
    call update_solid(fraction, grid, blocks, solid)
    solid%poses = 0   ! another geometry next time
  end subroutine set_many

  subroutine set_one(grid, low, high, solid)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: low(3), high(3)   !! [m]
    type(solid_geometry_t), intent(out) :: solid

    call set_many(grid, reshape(low, [3, 1]), reshape(high, [3, 1]), solid)
  end subroutine set_one

end module box_solid_m
