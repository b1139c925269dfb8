!> Shear stress at walls whose boundary layer the grid does not resolve.
!!
!! The stress of a fully rough turbulent layer, with the grid as its roughness:
!! $$ \tau = \rho \Big[ \frac{\kappa}{\ln (1 + 30 y/k_s)} \Big]^2 |u - U_w|\, (u - U_w),
!! \qquad k_s = 2 h $$
!! written as the viscosity \( \mu_w = \tau y/|u - U_w| \) with which the wall links of a cell pull.
!! It exceeds that of the fluid where the cell Reynolds number passes some 54. Without it walls slip
!! as the viscosity goes to zero, the flow past round bodies stays attached, and a sphere at
!! Re = 1e4 has a sixth of its drag (docs/decisions/drag.md).
module wall_shear_m
  use kinds_m, only: wp
  use grid_m, only: grid_t, unit_step
  use solid_geometry_m, only: solid_geometry_t, link_to_wall
  use rigid_motion_m, only: rigid_motion_t, wall_velocity
  use rigid_flux_m, only: arm_to_cell
  use growing_m, only: ensure_capacity
  implicit none
  private
  public :: find_wall_speeds, distance_of_links, rough_viscosity

  real(wp), parameter :: karman = 0.41_wp
  real(wp), parameter :: roughness = 2.0_wp   !! sand grains k_s of the grid [cells]

contains

  !> Speed of the fluid past the wall at either end of each link of `solid`; 0 where the end is no
  !! own cell with its centre in the fluid. Taken before the forces of the step: fluid and body that
  !! fall together do not rub.
  subroutine find_wall_speeds(grid, solid, bodies, u, speed)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies   !! at their new place, as they moved at the start
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s]
    real(wp), intent(inout), allocatable :: speed(:)   !! (at least 2 n_leg) [m/s]
    integer :: m, s, c(3)

    call ensure_capacity(2*solid%n_link, speed)
    !$omp parallel do private(s, c) schedule(static)
    do m = 1, solid%n_link
      do s = 1, 2
        c = solid%link(1:3, m)
        if (s == 1) c = c - unit_step(:, solid%link(4, m))
        speed(2*m - 2 + s) = 0.0_wp
        if (.not. grid%owns(c)) cycle
        if (solid%inside(c(1), c(2), c(3)) /= 0) cycle
        associate (b => solid%link_body(s, m))
          speed(2*m - 2 + s) = norm2(u(c(1), c(2), c(3), :) &
            - wall_velocity(bodies%motion(:, b), arm_to_cell(grid, c, bodies%x(:, b))))
        end associate
      end do
    end do
  end subroutine find_wall_speeds

  !> Distance of a centre from the plane on which the links of its cell end,
  !! 1/y^2 = sum 1/l^2 [m]; huge without links.
  pure function distance_of_links(grid, solid, c) result(y)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: c(3)
    real(wp) :: y
    real(wp) :: inverse, length
    integer :: d, sense

    inverse = 0.0_wp
    do d = 1, 3
      do sense = -1, 1, 2
        length = link_to_wall(solid, c, d, sense)*grid%h(d)
        if (length > 0.0_wp) inverse = inverse + 1.0_wp/length**2
      end do
    end do
    y = 1.0_wp/sqrt(max(inverse, tiny(inverse)))
  end function distance_of_links

  !> Viscosity mu_w of the rough layer between a centre and a wall [Pa s].
  elemental function rough_viscosity(rho, speed, y, h) result(mu)
    real(wp), intent(in) :: rho     !! [kg/m3]
    real(wp), intent(in) :: speed   !! of the centre past the wall [m/s]
    real(wp), intent(in) :: y       !! of the centre from the wall [m]
    real(wp), intent(in) :: h       !! spacing of the cells [m]
    real(wp) :: mu

    mu = rho*speed*y*(karman/log(1.0_wp + 30.0_wp*y/(roughness*h)))**2
  end function rough_viscosity

end module wall_shear_m
