!> How fast the fluid of a small cell runs along the wall.
!!
!! Between the wall and the cell behind its target the velocity along the wall is taken as that of
!! a layer, \( U y/(y + \delta) \), which is linear where the layer is thick against the cells and
!! free slip where it is thin, as without viscosity. The two cells give its thickness: with y_m and
!! y_n their distances from the wall and a the ratio of their velocities along it,
!! $$ \frac{\delta}{y_m} = \frac{1 - a}{a - y_m/y_n}, \qquad
!! s = \frac{1}{1 + \delta/y_m} = \frac{a - y_m/y_n}{1 - y_m/y_n} $$
!! s is the slip of the layer; small cells and the faces beside them take their velocity along the
!! wall by it (`wall_profile_m`).
!! If small cells had all of the velocity of their targets, the wall layer would carry momentum that
!! no fluid has, and friction be too large (docs/decisions/cut_cells.md).
module wall_layer_m
  use kinds_m, only: wp
  use grid_m, only: grid_t, n_halo
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t
  use merged_cells_m, only: merged_cells_t, velocity_at_wall
  use parallel_m, only: halo_exchange
  implicit none
  private
  public :: find_slip, slip_by_two, layer_slip

contains

  !> The slip of the layer at each small cell: the mean over its targets with fluid behind them, by
  !! share times 1 - r (what lies as far out as its target says little of the layer); none in gaps
  !! where there is no such target.
  subroutine find_slip(grid, solid, bodies, u, merged)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies   !! the walls
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! halo filled [m/s]
    type(merged_cells_t), intent(inout) :: merged
    real(wp) :: slip, weight, weights
    integer :: m, n, behind(3)

    !$omp parallel do private(n, behind, slip, weight, weights) schedule(static)
    do m = 1, merged%n_small
      associate (f => merged%cell(:, m))
        if (.not. grid%owns(f)) cycle
        slip = 0.0_wp
        weights = 0.0_wp
        do n = 1, size(merged%target, 1)
          if (merged%target(n, m) == 0) cycle
          behind = 2*merged%cell(:, merged%target(n, m)) - f
          if (.not. is_fluid(behind)) cycle
          weight = merged%share(n, m)*merged%nearer(n, m)
          if (weight <= 0.0_wp) cycle
          slip = slip + weight*slip_beside(m, n)
          weights = weights + weight
        end do
        merged%slip(f(1), f(2), f(3)) = slip/max(weights, tiny(weights))
      end associate
    end do
    call halo_exchange(merged%slip, n_halo)
  contains
    !> Has a cell its centre in the fluid?
    pure logical function is_fluid(c)
      integer, intent(in) :: c(3)

      is_fluid = .not. grid%outside(c)
      if (is_fluid) is_fluid = solid%inside(c(1), c(2), c(3)) == 0
    end function is_fluid

    !> Slip of the layer at small cell m by its target number n and the cell behind that one.
    pure real(wp) function slip_beside(m, n)
      integer, intent(in) :: m, n
      real(wp) :: wall(3)
      integer :: next(3)

      associate (f => merged%cell(:, m), c => merged%cell(:, merged%target(n, m)), &
                 normal => merged%normal(:, m))
        next = 2*c - f
        wall = velocity_at_wall(grid, merged, m, bodies)
        slip_beside = slip_by_two(u(c(1), c(2), c(3), :) - wall, &
                                  u(next(1), next(2), next(3), :) - wall, normal, &
                                  merged%distance(n, m), &
                                  dot_product(normal, (c - f)*grid%h))
      end associate
    end function slip_beside
  end subroutine find_slip

  !> Slip of the layer as a cell and the next one behind it give it.
  pure function slip_by_two(u, u_next, normal, distance, behind) result(slip)
    real(wp), intent(in) :: u(3), u_next(3)   !! their velocities, seen from the wall [m/s]
    real(wp), intent(in) :: normal(3)         !! of the wall
    real(wp), intent(in) :: distance          !! of the fluid of the cell from the wall [m]
    real(wp), intent(in) :: behind            !! > 0, of the next one from there [m]
    real(wp) :: slip
    real(wp) :: along(3), along_next(3)

    along = along_wall(u, normal)
    along_next = along_wall(u_next, normal)
    slip = layer_slip(dot_product(along, along_next) &
                      /max(dot_product(along_next, along_next), tiny(1.0_wp)), &
                      distance/(distance + behind))
  end function slip_by_two

  !> Part of a velocity along a wall of normal n.
  pure function along_wall(v, n) result(along)
    real(wp), intent(in) :: v(3), n(3)
    real(wp) :: along(3)

    along = v - n*dot_product(n, v)
  end function along_wall

  !> Slip of a layer: 0 if its velocity is linear to the wall, 1 if it is the same everywhere.
  elemental function layer_slip(ratio, distances) result(slip)
    real(wp), intent(in) :: ratio       !! of the velocities of the target and the next cell
    real(wp), intent(in) :: distances   !! of their distances from the wall, below 1
    real(wp) :: slip

    slip = max(0.0_wp, min(1.0_wp, ratio) - distances)/(1.0_wp - distances)
  end function layer_slip

end module wall_layer_m
