!> The layer along a wall that the cells do not resolve: velocity of small cut cells and of cell
!! centres nearer to the wall than the fluid around them, and the stress of a rough wall
!! (docs/theory.md, section 17).
!!
!! A layer has the velocity U y/(y + delta), seen from the wall. A cell at distance y_m and the one
!! behind it give its thickness as the slip s = 1/(1 + delta/y_m): 0 is a line to the wall, 1 free
!! slip, as without viscosity.
module wall_layer_m
  use kinds_m, only: wp
  use vectors_m, only: norm
  use grid_m, only: grid_t, n_halo, unit_step
  use solid_geometry_m, only: solid_geometry_t, centre_in_fluid
  use rigid_motion_m, only: rigid_motion_t
  use rigid_flux_m, only: velocity_in_cell
  use merged_cells_m, only: merged_cells_t, max_targets, velocity_at_wall
  use parallel_m, only: halo_exchange
  implicit none
  private
  public :: scaled_to_wall, share_along, layer_slip, along_share, find_slip, find_centres
  public :: to_centres, find_wall_speeds, rough_viscosity

  real(wp), parameter :: min_share = 1.0e-3_wp
    !! T_c of a centre on the wall: its velocity means nothing, the wall flux holds it
  real(wp), parameter :: max_slip = 0.5_wp
    !! s at centres, of a layer as thick as the middle of the fluid is far from the wall
  real(wp), parameter :: round_off = 1.0e-9_wp   !! of weights; of speeds [cells in a step]
  real(wp), parameter :: karman = 0.41_wp
  real(wp), parameter :: roughness = 2.0_wp   !! sand grains k_s of the grid [cells]

contains

  !> A velocity seen from a wall of normal n, its part along the wall and that across it scaled.
  pure function scaled_to_wall(v, n, along, across) result(scaled)
    real(wp), intent(in) :: v(3), n(3), along, across
    real(wp) :: scaled(3)

    scaled = along*v + (across - along)*dot_product(n, v)*n
  end function scaled_to_wall

  !> T_t = r + (1 - r) S, S = r s/(r s + 1 - s): share of the velocity of a cell along the wall that
  !! the fluid at r times its distance has.
  elemental function share_along(r, layer) result(share)
    real(wp), intent(in) :: r       !! distance from the wall over that of the cell, 0 to 1
    real(wp), intent(in) :: layer   !! slip s of the layer, 0 to 1
    real(wp) :: share

    share = r + (1.0_wp - r)*r*layer/max(r*layer + 1.0_wp - layer, tiny(1.0_wp))
  end function share_along

  !> s of a layer by the velocities of two cells: 0 if they are on a line to the wall or below it.
  elemental function layer_slip(ratio, distances) result(slip)
    real(wp), intent(in) :: ratio       !! of the velocities of the cell and the one behind it
    real(wp), intent(in) :: distances   !! of their distances from the wall, below 1
    real(wp) :: slip

    slip = max(0.0_wp, min(1.0_wp, ratio) - distances)/(1.0_wp - distances)
  end function layer_slip

  !> T_t: share of the velocity of its target number n along the wall that a small cell has, both
  !! seen from the wall.
  pure function along_share(merged, small, n) result(share)
    type(merged_cells_t), intent(in) :: merged
    integer, intent(in) :: small, n
    real(wp) :: share

    associate (c => merged%cell(:, small))
      share = share_along(merged%r(n, small), merged%slip(c(1), c(2), c(3)))
    end associate
  end function along_share

  !> s at each small cell (`merged%slip`): the mean over its targets with fluid behind them, by
  !! share times 1 - r (what lies as far out as its target says little); none without such a one.
  subroutine find_slip(grid, solid, bodies, dt, u, merged)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies   !! the walls
    real(wp), intent(in) :: dt                   !! [s]
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! halo filled [m/s]
    type(merged_cells_t), intent(inout) :: merged
    real(wp) :: wall(3), slip, weight, weights
    integer :: m, n, c(3), behind(3)

    !$omp parallel do private(n, c, behind, wall, slip, weight, weights) schedule(static)
    do m = 1, merged%n_small
      associate (f => merged%cell(:, m))
        if (.not. grid%owns(f)) cycle
        wall = velocity_at_wall(grid, merged, m, bodies)
        slip = 0.0_wp
        weights = 0.0_wp
        do n = 1, max_targets
          if (merged%target(n, m) == 0) cycle
          c = merged%cell(:, merged%target(n, m))
          behind = 2*c - f
          if (.not. centre_in_fluid(grid, solid, behind)) cycle
          weight = merged%share(n, m)*(1.0_wp - merged%r(n, m))
          if (weight <= 0.0_wp) cycle
          slip = slip + weight*slip_by_two(grid, dt, wall, merged%normal(:, m), u, c, behind, &
                                           merged%distance(n, m))
          weights = weights + weight
        end do
        merged%slip(f(1), f(2), f(3)) = slip/max(weights, round_off)
      end associate
    end do
    call halo_exchange(merged%slip, n_halo)
  end subroutine find_slip

  !> s of the layer at a wall as cell c and the one behind it have it; none in water at rest.
  pure function slip_by_two(grid, dt, wall, n, u, c, behind, distance) result(slip)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: dt, wall(3), n(3)   !! [s]; the wall's velocity [m/s] and normal
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    integer, intent(in) :: c(3), behind(3)
    real(wp), intent(in) :: distance   !! of the fluid of c from the wall [m]
    real(wp) :: slip
    real(wp) :: near(3), far(3), ratio   !! velocities past the wall, along it

    near = scaled_to_wall(u(c(1), c(2), c(3), :) - wall, n, 1.0_wp, 0.0_wp)
    far = scaled_to_wall(u(behind(1), behind(2), behind(3), :) - wall, n, 1.0_wp, 0.0_wp)
    ratio = dot_product(near, far)/max(dot_product(far, far), sum((round_off*grid%h/dt)**2))
    slip = layer_slip(ratio, distance/(distance + dot_product(n, (behind - c)*grid%h)))
  end function slip_by_two

  !> T_c of the own cut cells with their centre in the fluid (`merged%centre`), one elsewhere: share
  !! of the mean velocity of the fluid that the centre has, where viscosity acts, both seen from the
  !! wall. The layer is that of the cells across the open faces away from the wall.
  !!
  !! T_c falls with the distance over which the wall drags the centre, or a body that moves pays for
  !! every centre that it passes: y is that of a plane wall that drags as the face coefficients of
  !! the cell do together, and no layer is taken for thinner than the middle of the fluid is far
  !! from the wall (docs/decisions/cut_cells.md).
  subroutine find_centres(grid, solid, bodies, dt, u, merged)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies   !! the walls
    real(wp), intent(in) :: dt                   !! [s]
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! halo filled [m/s]
    type(merged_cells_t), intent(inout) :: merged
    real(wp) :: wall(3), slip, weight, weights
    integer :: m, d, behind(3), f(3)

    !$omp parallel do private(d, behind, f, wall, slip, weight, weights) schedule(dynamic, 64)
    do m = merged%n_small + 1, merged%n
      merged%centre(m) = 1.0_wp
      if (merged%middle(m) <= 0.0_wp) cycle
      wall = velocity_at_wall(grid, merged, m, bodies)
      slip = 0.0_wp
      weights = 0.0_wp
      associate (c => merged%cell(:, m), n => merged%normal(:, m))
        do d = 1, 3
          behind = c + nint(sign(1.0_wp, n(d)))*unit_step(:, d)
          if (.not. centre_in_fluid(grid, solid, behind)) cycle
          f = max(c, behind)
          weight = abs(n(d))*solid%aperture(f(1), f(2), f(3), d)
          if (weight <= 0.0_wp) cycle
          slip = slip + weight*slip_by_two(grid, dt, wall, n, u, c, behind, merged%middle(m))
          weights = weights + weight
        end do
      end associate
      slip = min(max_slip, slip/max(weights, round_off))
      merged%centre(m) = max(share_along(merged%ratio(m), slip), min_share)
    end do
  end subroutine find_centres

  !> Mean velocities of the own wall cells become those at their centres, U_w + T_c (u - U_w), or
  !! back.
  subroutine to_centres(grid, merged, bodies, u, back)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(in) :: merged
    type(rigid_motion_t), intent(in) :: bodies   !! the walls, the same there and back
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s]
    logical, intent(in), optional :: back
    real(wp) :: wall(3), factor
    integer :: m

    !$omp parallel do private(wall, factor) schedule(static)
    do m = merged%n_small + 1, merged%n
      associate (c => merged%cell(:, m))
        if (.not. grid%owns(c) .or. abs(merged%centre(m) - 1.0_wp) <= 0.0_wp) cycle
        factor = merged%centre(m)
        if (present(back)) factor = 1.0_wp/factor
        wall = velocity_at_wall(grid, merged, m, bodies)
        u(c(1), c(2), c(3), :) = wall + factor*(u(c(1), c(2), c(3), :) - wall)
      end associate
    end do
  end subroutine to_centres

  !> Speed of the fluid past the wall at either end of each line between centres that a surface cuts
  !! (`merged%wall_speed`); 0 where the end is no own cell with its centre in the fluid. It is that
  !! before the forces of the step: fluid and body that fall together do not rub.
  subroutine find_wall_speeds(grid, solid, bodies, u, merged)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies   !! at their new place, as they moved at the start
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s]
    type(merged_cells_t), intent(inout) :: merged
    integer :: m, s, c(3)

    !$omp parallel do private(s, c) schedule(static)
    do m = 1, solid%n_link
      do s = 1, 2
        c = solid%link(1:3, m)
        if (s == 1) c = c - unit_step(:, solid%link(4, m))
        merged%wall_speed(2*m - 2 + s) = 0.0_wp
        if (.not. grid%owns(c)) cycle
        if (solid%inside(c(1), c(2), c(3)) /= 0) cycle
        merged%wall_speed(2*m - 2 + s) = norm(u(c(1), c(2), c(3), :) &
          - velocity_in_cell(grid, bodies, solid%link_body(s, m), c))
      end do
    end do
  end subroutine find_wall_speeds

  !> Viscosity mu_w of a rough layer between a centre and a wall [Pa s], tau y/|u - U_w|. Without it
  !! walls slip as the viscosity goes to zero, the flow past round bodies stays attached, and a
  !! sphere at Re = 1e4 has a sixth of its drag (docs/decisions/drag.md).
  elemental function rough_viscosity(rho, speed, y, h) result(mu)
    real(wp), intent(in) :: rho     !! [kg/m3]
    real(wp), intent(in) :: speed   !! of the centre past the wall [m/s]
    real(wp), intent(in) :: y       !! of the centre from the wall [m]
    real(wp), intent(in) :: h       !! spacing of the cells [m]
    real(wp) :: mu

    mu = rho*speed*y*(karman/log(1.0_wp + 30.0_wp*y/(roughness*h)))**2
  end function rough_viscosity

end module wall_layer_m
