!> One momentum for each group of merged cells: what its cells were given is summed, every small
!! cell moves with its targets, and the wall bears the rest (docs/theory.md, section 17).
!!
!! Along the wall target and wall bear a force on a small cell like the ends of a lever, T_t of it
!! the target. What the group cannot give to a small cell so that it keeps the profile of the layer
!! is the same kind of force.
module merged_momentum_m
  use kinds_m, only: wp
  use vectors_m, only: inverse3
  use grid_m, only: grid_t
  use solid_geometry_m, only: mean_apertures
  use rigid_motion_m, only: rigid_motion_t
  use merged_cells_m, only: merged_cells_t, max_targets, is_unmerged, velocity_at_wall
  use wall_layer_m, only: along_share, scaled_to_wall
  implicit none
  private
  public :: share_momentum, share_acceleration, follow_targets

contains

  !> Find the velocity of each group that keeps its momentum, but for what the wall bears.
  !!
  !! With e what a small cell has more than its targets make it, the velocity u of a target changes
  !! by
  !! $$ \left( m + \sum p L T \right) \delta u = \sum p L e, \qquad
  !! L = n n^T + T_t (1 - n n^T) $$
  !! with p the masses of its parts of small cells; the wall gets (1 - L) p (e - T delta u). `u`
  !! holds any velocities of the members, halo filled; on return those of the groups with a target
  !! beside an own cell are shared, which makes all own cells right.
  subroutine share_momentum(grid, self, mass, bodies, before, u, to_wall)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(in) :: self
    real(wp), intent(in) :: mass(:)              !! (wall cells) of the fluid [kg]
    type(rigid_motion_t), intent(in) :: bodies   !! the walls
    real(wp), intent(in) :: before(:, :)         !! (3, wall cells) the velocities in `u` [m/s]
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s]
    real(wp), intent(inout) :: to_wall(:, :)
      !! (3, wall cells) momentum that the wall bears at own small cells, added to [kg m/s]
    real(wp), parameter :: unit(3, 3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
                                                 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
    real(wp) :: matrix(3, 3), given(3), part, t
    real(wp) :: excess(3, self%n_small)   !! of a small cell over the mean that its targets make it
    integer :: g, m, d, n

    !$omp parallel do schedule(static)
    do m = 1, self%n_small
      if (is_unmerged(self, m)) cycle
      excess(:, m) = before(:, m) - small_velocity(grid, self, m, bodies, u)
    end do
    !$omp parallel do private(matrix, given, part, t, m, d) schedule(static)
    do g = 1, self%n_groups
      associate (leader => self%leader(g), c => self%cell(:, self%leader(g)))
        matrix = mass(leader)*unit
        given = 0.0_wp
        do m = self%first(g), self%first(g + 1) - 1
          associate (small => self%part(1, m), which => self%part(2, m))
            part = self%share(which, small)*mass(small)
            t = along_share(self, small, which)
            given = given + part*scaled_to_wall(excess(:, small), self%normal(:, small), t, 1.0_wp)
            do d = 1, 3   ! L T
              matrix(:, d) = matrix(:, d) + part*scaled_to_wall( &
                unit(:, d), self%normal(:, small), t**2, self%r(which, small))
            end do
          end associate
        end do
        if (matrix(1, 1) + matrix(2, 2) + matrix(3, 3) > 0.0_wp) then
          u(c(1), c(2), c(3), :) = before(:, leader) + matmul(inverse3(matrix), given)
        end if
      end associate
    end do
    !$omp parallel do private(given, n, t) schedule(static)
    do m = 1, self%n_small
      if (is_unmerged(self, m) .or. .not. grid%owns(self%cell(:, m))) cycle
      given = small_velocity(grid, self, m, bodies, u)
      associate (f => self%cell(:, m))
        u(f(1), f(2), f(3), :) = given
      end associate
      do n = 1, max_targets
        if (self%target(n, m) == 0) cycle
        t = along_share(self, m, n)
        associate (c => self%cell(:, self%target(n, m)), normal => self%normal(:, m))
          given = u(c(1), c(2), c(3), :) - before(:, self%target(n, m))
          given = excess(:, m) - scaled_to_wall(given, normal, t, self%r(n, m))
          to_wall(:, m) = to_wall(:, m) &
            + self%share(n, m)*mass(m)*scaled_to_wall(given, normal, 1.0_wp - t, 0.0_wp)
        end associate
      end do
    end do
  end subroutine share_momentum

  !> Velocity of a small cell by those of its targets, sum of s (U_w + T (u - U_w)) [m/s].
  pure function small_velocity(grid, self, small, bodies, u) result(velocity)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(in) :: self
    integer, intent(in) :: small
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp) :: velocity(3)
    real(wp) :: wall(3)
    integer :: n

    wall = velocity_at_wall(grid, self, small, bodies)
    velocity = 0.0_wp
    do n = 1, max_targets
      if (self%target(n, small) == 0) cycle
      associate (c => self%cell(:, self%target(n, small)))
        velocity = velocity + self%share(n, small)*(wall + scaled_to_wall( &
          u(c(1), c(2), c(3), :) - wall, self%normal(:, small), along_share(self, small, n), &
          self%r(n, small)))
      end associate
    end do
  end function small_velocity

  !> Acceleration of each group: the mean over its cells by the mass that the faces move, component
  !! by component. Halo filled on entry.
  subroutine share_acceleration(grid, aperture, rho, self, a)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: aperture(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! [kg/m3]
    type(merged_cells_t), intent(in) :: self
    real(wp), intent(inout), contiguous :: a(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp) :: weight(3), total(3), w(3)
    real(wp) :: excess(3, self%n_small)   !! of a small cell over the mean of its targets
    integer :: g, m

    !$omp parallel do schedule(static)
    do m = 1, self%n_small
      if (is_unmerged(self, m)) cycle
      associate (f => self%cell(:, m))
        excess(:, m) = a(f(1), f(2), f(3), :) - mean_of_targets(grid, self, m, a)
      end associate
    end do
    !$omp parallel do private(weight, total, w, m) schedule(static)
    do g = 1, self%n_groups
      associate (c => self%cell(:, self%leader(g)))
        weight = rho(c(1), c(2), c(3))*mean_apertures(grid, aperture, c)
        total = 0.0_wp
        do m = self%first(g), self%first(g + 1) - 1
          associate (f => self%cell(:, self%part(1, m)))
            w = self%share(self%part(2, m), self%part(1, m))*rho(f(1), f(2), f(3)) &
                *mean_apertures(grid, aperture, f)
            weight = weight + w
            total = total + w*excess(:, self%part(1, m))
          end associate
        end do
        a(c(1), c(2), c(3), :) = a(c(1), c(2), c(3), :) + total/max(weight, tiny(1.0_wp))
      end associate
    end do
    !$omp parallel do schedule(static)
    do m = 1, self%n_small
      if (is_unmerged(self, m) .or. .not. grid%owns(self%cell(:, m))) cycle
      associate (f => self%cell(:, m))
        a(f(1), f(2), f(3), :) = mean_of_targets(grid, self, m, a)
      end associate
    end do
  end subroutine share_acceleration

  !> Mean of the targets of a small cell by shares.
  pure function mean_of_targets(grid, self, small, a) result(mean)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(in) :: self
    integer, intent(in) :: small
    real(wp), intent(in), contiguous :: a(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp) :: mean(3)
    integer :: n

    mean = 0.0_wp
    do n = 1, max_targets
      if (self%target(n, small) == 0) cycle
      associate (c => self%cell(:, self%target(n, small)))
        mean = mean + self%share(n, small)*a(c(1), c(2), c(3), :)
      end associate
    end do
  end function mean_of_targets

  !> The own small cells change along with their targets since the velocities `before`, by forces
  !! that act on targets alone: by T_t of what those change. The wall bears what the group lacks of
  !! that.
  subroutine follow_targets(grid, self, mass, before, u, to_wall)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(in) :: self
    real(wp), intent(in) :: mass(:)        !! (wall cells) of the fluid [kg]
    real(wp), intent(in) :: before(:, :)   !! (3, wall cells) [m/s]
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! halo filled on entry [m/s]
    real(wp), intent(inout) :: to_wall(:, :)
      !! (3, wall cells) momentum that the wall bears at own small cells, added to [kg m/s]
    real(wp) :: change(3), changed(3), t
    integer :: m, n

    !$omp parallel do private(n, t, change, changed) schedule(static)
    do m = 1, self%n_small
      if (is_unmerged(self, m) .or. .not. grid%owns(self%cell(:, m))) cycle
      changed = before(:, m)
      do n = 1, max_targets
        if (self%target(n, m) == 0) cycle
        t = along_share(self, m, n)
        associate (c => self%cell(:, self%target(n, m)))
          change = self%share(n, m)*t*(u(c(1), c(2), c(3), :) - before(:, self%target(n, m)))
        end associate
        changed = changed + change
        to_wall(:, m) = to_wall(:, m) - (1.0_wp - t)*mass(m)*change
      end do
      associate (f => self%cell(:, m))
        u(f(1), f(2), f(3), :) = changed
      end associate
    end do
  end subroutine follow_targets

end module merged_momentum_m
