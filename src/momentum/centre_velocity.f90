!> The velocity at the centre of a cut cell, where viscosity acts, and the mean over its fluid.
!!
!! Transport and pressure know the mean over the open part of a cut cell whose centre lies in the
!! fluid; links of viscosity pull at the centre, which lies nearer to the wall. With the layer along
!! the wall (`wall_layer_m`),
!! $$ u_c = U_w + T_c (u - U_w), \qquad T_c = r + (1 - r) s $$
!! with r the distance y of the centre from the wall over that of the middle of the fluid and s the
!! slip of the layer there (`wall_profile_m`). The viscous stage solves for u_c with the mass m/T_c,
!! so that m du is what the links give. In a plane layer the shear at the wall is then right
!! wherever the wall lies in the cell; with the mean at the centre the layer is pulled too hard.
!!
!! A link pulls with mu over its length, so T_c must fall with that when the wall passes the centre,
!! or a body that moves pays for every centre that it passes. Two things see to it: y is that of a
!! plane wall that pulls as the links of the cell do together, and no layer is taken for thinner
!! than the middle of the fluid is far from the wall (docs/decisions/cut_cells.md).
module centre_velocity_m
  use kinds_m, only: wp
  use grid_m, only: grid_t
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t
  use merged_cells_m, only: merged_cells_t, velocity_at_wall
  use wall_layer_m, only: slip_by_two
  use wall_profile_m, only: slip_at
  implicit none
  private
  public :: find_centres, to_centres, to_means

  real(wp), parameter :: min_share = 1.0e-3_wp
    !! T_c of a centre on the wall: what it has of the velocity means nothing, its link holds it
  real(wp), parameter :: max_slip = 0.5_wp
    !! s of a layer as thick as the middle of the fluid is far from the wall

contains

  !> T_c of the own cut cells with their centre in the fluid (`merged%centre`); one elsewhere.
  subroutine find_centres(grid, solid, bodies, u, merged)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies   !! the walls
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! halo filled [m/s]
    type(merged_cells_t), intent(inout) :: merged
    real(wp) :: slip
    integer :: m

    !$omp parallel do private(slip) schedule(dynamic, 64)
    do m = merged%n_small + 1, merged%n
      merged%centre(m) = 1.0_wp
      if (merged%middle(m) <= 0.0_wp) cycle
      associate (r => merged%ratio(m))
        slip = slip_at(min(max_slip, slip_beside(m, merged%normal(:, m), merged%middle(m))), r)
        merged%centre(m) = max(r + (1.0_wp - r)*slip, min_share)
      end associate
    end do
  contains
    !> Slip of the layer as the cells across the open faces away from the wall give it, by what
    !! of these faces lies along the wall.
    pure function slip_beside(m, n, middle) result(slip)
      integer, intent(in) :: m
      real(wp), intent(in) :: n(3), middle   !! normal; distance of the fluid from the wall [m]
      real(wp) :: slip
      real(wp) :: wall(3), weight, weights
      integer :: d, next(3), f(3)

      slip = 0.0_wp
      weights = 0.0_wp
      wall = velocity_at_wall(grid, merged, m, bodies)
      do d = 1, 3
        associate (c => merged%cell(:, m))
          next = c
          next(d) = c(d) + nint(sign(1.0_wp, n(d)))
          if (grid%outside(next)) cycle
          if (solid%inside(next(1), next(2), next(3)) /= 0) cycle
          f = max(c, next)
          weight = abs(n(d))*solid%aperture(f(1), f(2), f(3), d)
          if (weight <= 0.0_wp) cycle
          slip = slip + weight*slip_by_two(u(c(1), c(2), c(3), :) - wall, &
                                           u(next(1), next(2), next(3), :) - wall, n, middle, &
                                           abs(n(d))*grid%h(d))
          weights = weights + weight
        end associate
      end do
      slip = slip/max(weights, tiny(weights))
    end function slip_beside
  end subroutine find_centres

  !> Mean velocities of the own wall cells become those at their centres.
  subroutine to_centres(grid, merged, bodies, u)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(in) :: merged
    type(rigid_motion_t), intent(in) :: bodies   !! the walls, as for `to_means`
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s]

    call stretch(grid, merged, bodies, merged%centre(:merged%n), u)
  end subroutine to_centres

  !> And back.
  subroutine to_means(grid, merged, bodies, u)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(in) :: merged
    type(rigid_motion_t), intent(in) :: bodies   !! the walls
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s]

    call stretch(grid, merged, bodies, 1.0_wp/merged%centre(:merged%n), u)
  end subroutine to_means

  !> Velocities of the own wall cells, seen from the wall, times a factor each.
  subroutine stretch(grid, merged, bodies, factor, u)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(in) :: merged
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in) :: factor(:)   !! (wall cells)
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp) :: wall(3)
    integer :: m

    !$omp parallel do private(wall) schedule(static)
    do m = merged%n_small + 1, merged%n
      associate (c => merged%cell(:, m))
        if (.not. grid%owns(c) .or. abs(factor(m) - 1.0_wp) <= 0.0_wp) cycle
        wall = velocity_at_wall(grid, merged, m, bodies)
        u(c(1), c(2), c(3), :) = wall + factor(m)*(u(c(1), c(2), c(3), :) - wall)
      end associate
    end do
  end subroutine stretch

end module centre_velocity_m
