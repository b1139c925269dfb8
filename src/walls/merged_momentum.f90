!> One momentum for each group of linked cells (`merged_cells_m`): what its cells were given is
!! summed, and every small cell moves with its targets.
!!
!! Normal to the wall the velocity of a small cell is linear from its target to the wall; along the
!! wall it has more of the target's, by the slip s at r (`wall_profile_m`),
!! $$ u_{small} = T u + (1 - T) U_w, \qquad T = 1 - (1 - r) (1 - s + s\, n\, n^T) $$
!! with r the distance of the middle of the small cell from the wall over that of the target, from
!! the plane of the cut cell. A force on a small cell along the wall bends the layer: target and
!! wall bear it like the ends of a lever, T_t of it the target, with T_t = r + (1 - r) s the share
!! of its velocity that the small cell has there, and the rest the wall. What the group cannot give
!! to a small cell so that it keeps this profile is the same kind of force. Derivation and trials:
!! docs/decisions/cut_cells.md.
module merged_momentum_m
  use kinds_m, only: wp
  use vectors_m, only: inverse3
  use grid_m, only: grid_t
  use solid_geometry_m, only: mean_apertures
  use rigid_motion_m, only: rigid_motion_t
  use merged_cells_m, only: merged_cells_t, max_targets, is_unmerged, velocity_at_wall
  use wall_layer_m, only: slip_at, along_share
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
    real(wp) :: matrix(3, 3), given(3), part
    real(wp) :: excess(3, self%n_small)   !! of a small cell over the mean that its targets make it
    real(wp) :: t(3, 3, max_targets, self%n_small), wall(3, max_targets, self%n_small)
      !! T and (1 - T) U_w of the parts of small cells
    integer :: g, m, d, n

    !$omp parallel do private(n, given) schedule(static)
    do m = 1, self%n_small
      if (is_unmerged(self, m)) cycle
      do n = 1, max_targets
        if (self%target(n, m) == 0) cycle
        call profile(grid, self, [m, n], bodies, t(:, :, n, m), wall(:, n, m))
      end do
      given = small_velocity(grid, self, m, t(:, :, :, m), wall(:, :, m), u)
      excess(:, m) = before(:, m) - given
    end do
    !$omp parallel do private(matrix, given, part, m, d) schedule(static)
    do g = 1, self%n_groups
      associate (leader => self%leader(g), c => self%cell(:, self%leader(g)))
        matrix = 0.0_wp
        do d = 1, 3
          matrix(d, d) = mass(leader)
        end do
        given = 0.0_wp
        do m = self%first(g), self%first(g + 1) - 1
          associate (small => self%part(1, m), which => self%part(2, m))
            part = self%share(which, small)*mass(small)
            given = given + part*to_target(self, self%part(:, m), excess(:, small))
            do d = 1, 3
              matrix(:, d) = matrix(:, d) &
                             + part*to_target(self, self%part(:, m), t(:, d, which, small))
            end do
          end associate
        end do
        if (matrix(1, 1) + matrix(2, 2) + matrix(3, 3) > 0.0_wp) then
          u(c(1), c(2), c(3), :) = before(:, leader) + matmul(inverse3(matrix), given)
        end if
      end associate
    end do
    !$omp parallel do private(given, n) schedule(static)
    do m = 1, self%n_small
      if (is_unmerged(self, m) .or. .not. grid%owns(self%cell(:, m))) cycle
      given = small_velocity(grid, self, m, t(:, :, :, m), wall(:, :, m), u)
      associate (f => self%cell(:, m))
        u(f(1), f(2), f(3), :) = given
      end associate
      do n = 1, max_targets
        if (self%target(n, m) == 0) cycle
        associate (c => self%cell(:, self%target(n, m)))
          given = u(c(1), c(2), c(3), :) - before(:, self%target(n, m))
          given = excess(:, m) - matmul(t(:, :, n, m), given)
        end associate
        to_wall(:, m) = to_wall(:, m) &
                        + self%share(n, m)*mass(m)*(given - to_target(self, [m, n], given))
      end do
    end do
  end subroutine share_momentum

  !> L e: what the target bears of a force on a part of a small cell.
  pure function to_target(self, part, e) result(borne)
    type(merged_cells_t), intent(in) :: self
    integer, intent(in) :: part(2)   !! small cell, which of its targets
    real(wp), intent(in) :: e(3)
    real(wp) :: borne(3)

    associate (n => self%normal(:, part(1)))
      borne = e - (1.0_wp - along_share(self, part(1), part(2)))*(e - n*dot_product(n, e))
    end associate
  end function to_target

  !> Velocity of a small cell by those of its targets [m/s].
  pure function small_velocity(grid, self, small, t, wall, u) result(velocity)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(in) :: self
    integer, intent(in) :: small
    real(wp), intent(in) :: t(:, :, :), wall(:, :)   !! T and (1 - T) U_w of its parts
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp) :: velocity(3)
    integer :: n

    velocity = 0.0_wp
    do n = 1, max_targets
      if (self%target(n, small) == 0) cycle
      associate (c => self%cell(:, self%target(n, small)))
        velocity = velocity + self%share(n, small)*(matmul(t(:, :, n), u(c(1), c(2), c(3), :)) &
                                                   + wall(:, n))
      end associate
    end do
  end function small_velocity

  !> T and (1 - T) U_w of a part of a small cell.
  pure subroutine profile(grid, self, part, bodies, t, wall)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(in) :: self
    integer, intent(in) :: part(2)   !! small cell, which of its targets
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(out) :: t(3, 3), wall(3)
    real(wp) :: v(3), less(3, 3), slip
    integer :: d

    associate (m => part(1), n => self%normal(:, part(1)), c => self%cell(:, part(1)))
      slip = slip_at(self%slip(c(1), c(2), c(3)), 1.0_wp - self%nearer(part(2), m))
      v = velocity_at_wall(grid, self, m, bodies)
      do d = 1, 3
        less(:, d) = slip*n*n(d)
        less(d, d) = less(d, d) + 1.0_wp - slip
      end do
      less = self%nearer(part(2), m)*less
    end associate
    wall = matmul(less, v)
    t = -less
    do d = 1, 3
      t(d, d) = t(d, d) + 1.0_wp
    end do
  end subroutine profile

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

    !$omp parallel do private(total) schedule(static)
    do m = 1, self%n_small
      if (is_unmerged(self, m)) cycle
      call mean_of_targets(grid, self, m, a, total)
      associate (f => self%cell(:, m))
        excess(:, m) = a(f(1), f(2), f(3), :) - total
      end associate
    end do
    !$omp parallel do private(weight, total, w, m) schedule(static)
    do g = 1, self%n_groups
      associate (c => self%cell(:, self%leader(g)))
        weight = rho(c(1), c(2), c(3))*mean_apertures(grid, aperture, c)
      end associate
      total = 0.0_wp
      do m = self%first(g), self%first(g + 1) - 1
        associate (f => self%cell(:, self%part(1, m)))
          w = self%share(self%part(2, m), self%part(1, m))*rho(f(1), f(2), f(3)) &
              *mean_apertures(grid, aperture, f)
          weight = weight + w
          total = total + w*excess(:, self%part(1, m))
        end associate
      end do
      associate (c => self%cell(:, self%leader(g)))
        a(c(1), c(2), c(3), :) = a(c(1), c(2), c(3), :) + total/max(weight, tiny(1.0_wp))
      end associate
    end do
    !$omp parallel do private(total) schedule(static)
    do m = 1, self%n_small
      if (is_unmerged(self, m) .or. .not. grid%owns(self%cell(:, m))) cycle
      call mean_of_targets(grid, self, m, a, total)
      associate (f => self%cell(:, m))
        a(f(1), f(2), f(3), :) = total
      end associate
    end do
  end subroutine share_acceleration

  !> Mean of the targets of a small cell by shares.
  pure subroutine mean_of_targets(grid, self, small, a, mean)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(in) :: self
    integer, intent(in) :: small
    real(wp), intent(in), contiguous :: a(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(out) :: mean(3)
    integer :: n

    mean = 0.0_wp
    do n = 1, max_targets
      if (self%target(n, small) == 0) cycle
      associate (c => self%cell(:, self%target(n, small)))
        mean = mean + self%share(n, small)*a(c(1), c(2), c(3), :)
      end associate
    end do
  end subroutine mean_of_targets

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
