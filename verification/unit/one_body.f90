!> A fluid at rest around one block: everything that a test of the coupling needs.
module one_body_m
  use kinds_m, only: wp
  use case_types_m, only: case_t
  use grid_m, only: grid_t, grid_init
  use fields_m, only: flow_t, flow_init
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use rigid_motion_m, only: rigid_motion_t, rigid_motion_init, wall_velocity
  use solid_fraction_m, only: solid_fraction_t, solid_fraction_init, update_solid
  use tet_mesh_m, only: shape_t
  use shapes_builtin_m, only: make_shape
  use rigid_body_m, only: blocks_t
  use case_blocks_m, only: blocks_init
  use coupling_m, only: copy_motion
  implicit none
  private
  public :: one_body_t, describe, place, wall_at, layer, random_numbers

  type :: one_body_t
    type(case_t) :: case
    type(grid_t) :: grid
    type(flow_t) :: flow
    type(blocks_t) :: blocks
    type(solid_fraction_t) :: fraction
    type(solid_geometry_t) :: solid
    type(rigid_motion_t) :: bodies
  end type one_body_t

contains

  !> A case with one block; the caller may change what it likes before `place`.
  subroutine describe(cells, length, sides, kind, size, position, case)
    integer, intent(in) :: cells(3)
    real(wp), intent(in) :: length(3)                !! [m]
    character(*), intent(in) :: sides(2, 3)
    character(*), intent(in) :: kind
    real(wp), intent(in) :: size(3), position(3)     !! of the block [m]
    type(case_t), intent(out) :: case

    case%grid%cells = cells
    case%grid%length = length
    case%boundary%kind = sides
    allocate (case%shape(1), case%body(1), case%drop(0), case%water(0))
    case%shape(1)%name = kind
    case%shape(1)%kind = kind
    case%shape(1)%size = size
    case%body(1)%shape = kind
    case%body(1)%position = position
  end subroutine describe

  !> Grid, block and solids of `self%case`; the fluid is liquid everywhere.
  subroutine place(self)
    type(one_body_t), intent(inout) :: self
    type(shape_t) :: shapes(1)
    character(:), allocatable :: message

    call grid_init(self%case%grid, self%case%boundary, self%grid)
    call make_shape(self%case%shape(1), shapes(1), message)
    if (message /= '') error stop 'one_body_m: the shape cannot be built'
    call blocks_init(self%case, shapes, self%blocks)
    call flow_init(self%grid, self%flow)
    self%flow%c = 1.0_wp
    self%flow%rho = self%case%fluid%liquid_density
    self%flow%mu = self%case%fluid%liquid_viscosity
    call solid_geometry_init(self%grid, self%solid, self%blocks%n)
    call solid_fraction_init(self%grid, self%blocks, self%fraction)
    call update_solid(self%fraction, self%grid, self%blocks, self%solid)
    call rigid_motion_init(self%blocks%n, self%bodies)
    call copy_motion(self%blocks, self%bodies)
  end subroutine place

  !> Velocity of the block, once placed, at the centre of a cell [m/s].
  function wall_at(self, cell) result(velocity)
    type(one_body_t), intent(in) :: self
    integer, intent(in) :: cell(3)
    real(wp) :: velocity(3)

    velocity = wall_velocity(self%bodies%motion(:, 1), (cell - 0.5_wp) &
      *self%case%grid%length/self%case%grid%cells - self%case%body(1)%position)
  end function wall_at

  !> Velocity at the distance y from a wall in a layer of thickness delta, over that far from it.
  elemental function layer(y, delta) result(v)
    real(wp), intent(in) :: y, delta
    real(wp) :: v

    v = y/max(y + delta, tiny(y))
  end function layer

  !> The same random numbers on every machine, between -1 and 1.
  subroutine random_numbers(seed, a)
    integer, intent(inout) :: seed   !! positive
    real(wp), intent(out) :: a(:)
    integer :: m

    do m = 1, size(a)
      seed = 16807*mod(seed, 127773) - 2836*(seed/127773)
      if (seed <= 0) seed = seed + 2147483647
      a(m) = 2.0_wp*real(seed, wp)/2147483647.0_wp - 1.0_wp
    end do
  end subroutine random_numbers

end module one_body_m
