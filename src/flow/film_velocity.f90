!> Velocity of film cells, whose centre lies in a body, from that of their open faces.
!!
!! A face between a film cell and one whose centre lies in fluid takes its velocity from the latter
!! alone (`face_velocity_at_walls`). Pressure and weight at such faces accelerate the film cell too,
!! but nothing it does is felt by the flow, so no pressure would ever stop it: water at rest would
!! keep films that run for ever. A component that no open face sees is the mean of its faces here.
module film_velocity_m
  use kinds_m, only: wp
  use grid_m, only: grid_t, n_halo, unit_step
  use boundary_m, only: gives_pressure
  use solid_geometry_m, only: solid_geometry_t
  implicit none
  private
  public :: tie_films

contains

  !> Set the components of film cells that no face sees to the mean of their faces by open share.
  subroutine tie_films(grid, solid, mass, uf, u, change)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in), dimension(grid%lo(1) - n_halo:, grid%lo(2) - n_halo:, &
                                    grid%lo(3) - n_halo:, :), &
      contiguous :: mass, uf     !! over dt, 0: moves with the wall [kg/s]; free of divergence [m/s]
    real(wp), intent(inout), dimension(grid%lo(1) - n_halo:, grid%lo(2) - n_halo:, &
                                       grid%lo(3) - n_halo:, :), &
      contiguous :: u, change    !! of the cells; what was added to it, else zero [m/s]
    integer :: m, d, c(3), n(3)
    real(wp) :: low, high   !! open shares

    change = 0.0_wp
    do m = 1, solid%body_cell(size(solid%body_cell)) - 1
      c = solid%cell(:, m)
      if (any(c < grid%lo) .or. any(c > grid%hi)) cycle
      if (solid%inside(c(1), c(2), c(3)) == 0) cycle
      do d = 1, 3
        if (mass(c(1), c(2), c(3), d) <= 0.0_wp) cycle
        n = c + unit_step(:, d)
        low = solid%open(c(1), c(2), c(3), d)
        high = solid%open(n(1), n(2), n(3), d)
        if (low + high <= 0.0_wp) cycle
        if ((low <= 0.0_wp .or. seen(grid, solid, c, c - unit_step(:, d), d)) .and. &
            (high <= 0.0_wp .or. seen(grid, solid, n, n, d))) cycle
        associate (v => u(c(1), c(2), c(3), d), dv => change(c(1), c(2), c(3), d))
          dv = dv - v
          v = (low*uf(c(1), c(2), c(3), d) + high*uf(n(1), n(2), n(3), d))/(low + high)
          dv = dv + v
        end associate
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
