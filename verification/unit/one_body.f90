!> A fluid at rest around one block: everything that a test of the coupling needs.
module one_body_m
  use, intrinsic :: iso_fortran_env, only: error_unit
  use kinds_m, only: wp
  use errors_m, only: problems_t
  use case_types_m, only: case_t
  use case_check_m, only: make_shapes
  use case_text_m, only: case_of, slip, sides, body
  use grid_m, only: grid_t, grid_init
  use fields_m, only: flow_t, flow_init
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use rigid_motion_m, only: rigid_motion_t, rigid_motion_init, wall_velocity
  use solid_fraction_m, only: solid_fraction_t, solid_fraction_init, update_solid
  use merged_cells_m, only: merged_cells_t, merged_cells_init, find_merged_cells
  use tet_mesh_m, only: shape_t
  use rigid_body_m, only: blocks_t
  use case_blocks_m, only: blocks_init
  use coupling_m, only: copy_motion
  implicit none
  private
  public :: one_body_t, place, slip, sides, body, wall_at, layer, random_numbers, random_field

  type :: one_body_t
    type(case_t) :: case
    type(grid_t) :: grid
    type(flow_t) :: flow
    type(blocks_t) :: blocks
    type(solid_fraction_t) :: fraction
    type(solid_geometry_t) :: solid
    type(rigid_motion_t) :: bodies
  end type one_body_t

  !> Put the block of a text or of a case into liquid that is everywhere.
  interface place
    procedure :: place_text, place_case
  end interface place

contains

  subroutine place_text(text, self, merged)
    character(*), intent(in) :: text
    type(one_body_t), intent(out) :: self
    type(merged_cells_t), intent(out), optional :: merged

    call place_case(case_of(text), self, merged)
  end subroutine place_text

  subroutine place_case(case, self, merged)
    type(case_t), intent(in) :: case
    type(one_body_t), intent(out) :: self
    type(merged_cells_t), intent(out), optional :: merged   !! cells at the walls of the block
    type(shape_t), allocatable :: shapes(:)
    type(problems_t) :: problems

    self%case = case
    call make_shapes(case, shapes, problems)
    call problems%report(error_unit)
    if (problems%n > 0) error stop 'one_body_m: the shape is refused'
    call grid_init(case%grid, case%boundary, self%grid)
    call blocks_init(case, shapes, self%blocks)
    call flow_init(self%grid, self%flow)
    self%flow%c = 1.0_wp
    self%flow%rho = case%fluid%liquid_density
    self%flow%mu = case%fluid%liquid_viscosity
    call solid_geometry_init(self%grid, self%solid, self%blocks%n)
    call solid_fraction_init(self%grid, self%blocks, self%fraction)
    call update_solid(self%fraction, self%grid, self%blocks, self%solid)
    self%flow%fluid_volume = self%grid%volume*(1.0_wp - self%solid%alpha)
    self%flow%liquid = self%flow%fluid_volume
    call rigid_motion_init(self%blocks%n, self%bodies)
    call copy_motion(self%blocks, self%bodies)
    if (.not. present(merged)) return
    call merged_cells_init(self%grid, merged)
    call find_merged_cells(self%grid, self%solid, merged)
  end subroutine place_case

  !> Velocity of the block at the centre of a cell [m/s].
  function wall_at(self, cell) result(velocity)
    type(one_body_t), intent(in) :: self
    integer, intent(in) :: cell(3)
    real(wp) :: velocity(3)

    velocity = wall_velocity(self%bodies%motion(:, 1), (cell - 0.5_wp) &
      *self%case%grid%length/self%case%grid%cells - self%case%body(1)%position)
  end function wall_at

  !> Velocity at the distance y from a wall in a layer of thickness delta, over that far from it.
  elemental real(wp) function layer(y, delta) result(v)
    real(wp), intent(in) :: y, delta

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

  subroutine random_field(seed, a)
    integer, intent(inout) :: seed
    real(wp), intent(out) :: a(:, :, :, :)
    integer :: j, k, d

    do d = 1, size(a, 4)
      do k = 1, size(a, 3)
        do j = 1, size(a, 2)
          call random_numbers(seed, a(:, j, k, d))
        end do
      end do
    end do
  end subroutine random_field

end module one_body_m
