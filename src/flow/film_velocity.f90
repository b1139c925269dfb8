!> Velocity of film cells, whose centre lies in a body, from that of the wall and their open faces.
!!
!! A face between a film cell and one whose centre lies in fluid takes its velocity from the latter
!! alone (`face_velocity_at_walls`). Pressure and weight at such faces accelerate the film cell too,
!! but nothing it does is felt by the flow, so no pressure would ever stop it: water at rest would
!! keep films that run for ever. A component that no open face sees is the mean of its faces here;
!! what of it is normal to the wall goes linearly from the faces to the wall, so half way. Along the
!! wall the film slips, until its legs to the wall hold it (`viscous_m`).
module film_velocity_m
  use kinds_m, only: wp
  use grid_m, only: grid_t, n_halo, unit_step
  use boundary_m, only: gives_pressure
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t, wall_velocity
  use rigid_flux_m, only: nearest_arm
  implicit none
  private
  public :: tie_films

contains

  !> Set the components of film cells that no face sees to the mean of their faces by open share,
  !! with the part normal to the wall half way to the velocity of the wall.
  subroutine tie_films(grid, solid, bodies, mass, uf, u, change)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in), dimension(grid%lo(1) - n_halo:, grid%lo(2) - n_halo:, &
                                    grid%lo(3) - n_halo:, :), &
      contiguous :: mass, uf     !! over dt, 0: moves with the wall [kg/s]; free of divergence [m/s]
    real(wp), intent(inout), dimension(grid%lo(1) - n_halo:, grid%lo(2) - n_halo:, &
                                       grid%lo(3) - n_halo:, :), &
      contiguous :: u, change    !! of the cells; what was added to it, else zero [m/s]
    integer :: m, b, d, c(3), n(3)
    real(wp) :: low(3), high(3)   !! open shares
    real(wp) :: v(3), wall(3)     !! of the film, of the wall [m/s]
    real(wp) :: area(3)           !! of the wall, a vector into the fluid [m2]

    change = 0.0_wp
    do m = 1, solid%body_cell(size(solid%body_cell)) - 1
      c = solid%cell(:, m)
      if (any(c < grid%lo) .or. any(c > grid%hi)) cycle
      b = solid%inside(c(1), c(2), c(3))
      if (b == 0) cycle
      v = u(c(1), c(2), c(3), :)
      do d = 1, 3
        n = c + unit_step(:, d)
        low(d) = solid%open(c(1), c(2), c(3), d)
        high(d) = solid%open(n(1), n(2), n(3), d)
        if (low(d) + high(d) > 0.0_wp) v(d) = (low(d)*uf(c(1), c(2), c(3), d) &
          + high(d)*uf(n(1), n(2), n(3), d))/(low(d) + high(d))
      end do
      wall = wall_velocity(bodies%motion(:, b), nearest_arm(grid, [grid%centre(c(1), 1), &
        grid%centre(c(2), 2), grid%centre(c(3), 3)], bodies%x(:, b)))
      area = grid%area*(high - low)
      v = v + 0.5_wp*area*dot_product(area, wall - v)/max(dot_product(area, area), tiny(1.0_wp))
      do d = 1, 3
        if (mass(c(1), c(2), c(3), d) <= 0.0_wp .or. low(d) + high(d) <= 0.0_wp) cycle
        n = c + unit_step(:, d)
        if ((low(d) <= 0.0_wp .or. seen(grid, solid, c, c - unit_step(:, d), d)) .and. &
            (high(d) <= 0.0_wp .or. seen(grid, solid, n, n, d))) cycle
        change(c(1), c(2), c(3), d) = change(c(1), c(2), c(3), d) + v(d) - u(c(1), c(2), c(3), d)
        u(c(1), c(2), c(3), d) = v(d)
      end do
    end do
  end subroutine tie_films

  !> Does the velocity of an open face f depend on the film cell on one side of it?
  pure function seen(grid, solid, f, beyond, d) result(answer)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: f(3), beyond(3), d   !! the face, the cell on its other side, direction
    logical :: answer

    if ((beyond(d) < 1 .or. beyond(d) > grid%n(d)) .and. .not. grid%periodic(d)) then
      answer = gives_pressure(grid%side(merge(1, 2, beyond(d) < 1), d))
      return
    end if
    answer = solid%inside(beyond(1), beyond(2), beyond(3)) /= 0 &
             .or. solid%leg_low(f(1), f(2), f(3), d) > 1.0_wp
  end function seen

end module film_velocity_m
