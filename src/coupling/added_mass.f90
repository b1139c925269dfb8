!> Fluid that moves along with a body in an impact.
module added_mass_m
  use kinds_m, only: wp
  use vectors_m, only: norm
  use case_types_m, only: fluid_t
  use grid_m, only: grid_t
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t
  use buoyancy_m, only: displaced_fluid
  use rigid_body_m, only: blocks_t
  implicit none
  private
  public :: update_added_mass

contains

  !> Fluid that moves along with each body in an impact: of what it displaces, as much as with a
  !! sphere that touches a wall and moves normal to it.
  !!
  !! Bodies that rest on others push with no more than a few times their weight; there the fluid has
  !! no part. Too large a mass would swing from step to step, hence the limit.
  subroutine update_added_mass(grid, fluid, solid, bodies, c, blocks, n_clipped)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
      !! liquid share of the fluid [-]
    type(blocks_t), intent(inout) :: blocks
    integer, intent(out) :: n_clipped   !! bodies whose added mass the limit cuts
    real(wp), parameter :: coefficient = 0.803_wp   !! Lamb, Hydrodynamics, art. 98 [-]
    real(wp), parameter :: largest = 0.35_wp        !! over the mass of the body [-]
    real(wp), parameter :: at_rest = 3.0_wp         !! contact force over weight [-]
    real(wp) :: displaced(4, bodies%n)
    logical :: moved(bodies%n), rests
    real(wp) :: push
    integer :: b

    moved = .false.
    do b = 1, blocks%n
      push = norm(blocks%contact_force(:, b))
      rests = push > 0.0_wp .and. push <= at_rest*blocks%mass(b)*norm(fluid%gravity) &
              .and. blocks%contacts(b) > 0   ! a film of liquid alone lets nothing rest
      moved(b) = blocks%present(b) .and. .not. (blocks%fixed(b) .or. rests)
    end do
    displaced = displaced_fluid(grid, fluid, solid, bodies, c, moved)
    n_clipped = 0
    do b = 1, blocks%n
      blocks%added_mass(b) = min(coefficient*displaced(1, b), largest*blocks%mass(b))
      if (coefficient*displaced(1, b) > largest*blocks%mass(b)) n_clipped = n_clipped + 1
    end do
  end subroutine update_added_mass

end module added_mass_m
