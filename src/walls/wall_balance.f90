!> Momentum balance of the cells at walls: what faces and cells disagree about is a force on the
!! bodies (docs/theory.md, section 17).
!!
!! The faces of a cell move the mass `moved`, the mean of two apertures; the mass that is there is
!! `mass`. What the faces gave and the fluid did not get, and what merging leaves to it, the wall
!! bears: `to_wall`. Fluid and bodies together keep their momentum.
module wall_balance_m
  use kinds_m, only: wp, i8
  use vectors_m, only: cross
  use growing_m, only: ensure_capacity
  use case_types_m, only: fluid_t
  use grid_m, only: grid_t
  use fields_m, only: flow_t
  use mixture_m, only: mass_through
  use solid_geometry_m, only: solid_geometry_t, mean_apertures
  use rigid_motion_m, only: rigid_motion_t
  use rigid_flux_m, only: arm_to_cell
  use merged_cells_m, only: merged_cells_t, velocity_at_wall
  use exact_sum_m, only: exact_add_columns, exact_totals, accumulator_size, no_terms, terms_at_once
  implicit none
  private
  public :: wall_balance_t, begin_balance, add_push, store_velocity
  public :: force_of_walls, add_to_bodies

  integer, parameter :: worth_threads = 1000   !! fewer wall cells are looked at by one thread

  !> Of each wall cell of `merged_cells_t`.
  type :: wall_balance_t
    real(wp), allocatable :: mass(:)        !! of its fluid [kg]
    real(wp), allocatable :: moved(:, :)    !! (3, *) mass that its faces move [kg]
    real(wp), allocatable :: before(:, :)   !! (3, *) velocity noted before sharing [m/s]
    real(wp), allocatable :: to_wall(:, :)  !! (3, *) momentum that the wall bears [kg m/s]
  end type wall_balance_t

contains

  !> The masses of the wall cells; the walls bear nothing yet. `rho` of the wall cells becomes that
  !! of the fluid in their open part.
  subroutine begin_balance(grid, fluid, solid, merged, flow, rho, self)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(solid_geometry_t), intent(in) :: solid
    type(merged_cells_t), intent(in) :: merged
    type(flow_t), intent(in) :: flow
    real(wp), intent(inout), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! [kg/m3]
    type(wall_balance_t), intent(inout) :: self
    real(wp), parameter :: min_volume = 1.0e-3_wp   !! of a cell with a density of its own
    integer :: m

    call ensure_capacity(merged%n, self%mass)
    call ensure_capacity(merged%n, self%moved)
    call ensure_capacity(merged%n, self%before)
    call ensure_capacity(merged%n, self%to_wall)
    self%to_wall(:, :merged%n) = 0.0_wp
    !$omp parallel do schedule(static)
    do m = 1, merged%n
      associate (c => merged%cell(:, m))
        associate (volume => flow%fluid_volume(c(1), c(2), c(3)))
          self%mass(m) = mass_through(fluid, volume, flow%liquid(c(1), c(2), c(3)))
          if (volume > min_volume*grid%volume) rho(c(1), c(2), c(3)) = self%mass(m)/volume
        end associate
        if (.not. grid%owns(c)) cycle
        self%moved(:, m) = rho(c(1), c(2), c(3))*grid%volume &
                           *mean_apertures(grid, solid%aperture, c)
      end associate
    end do
  end subroutine begin_balance

  !> The wall of an own wall cell bears what the faces give the mass that they move in dt, at the
  !! mean acceleration a; less what the fluid takes by an acceleration a, with `taken`.
  subroutine add_push(grid, merged, dt, a, self, taken)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(in) :: merged
    real(wp), intent(in) :: dt   !! [s]
    real(wp), intent(in), contiguous :: a(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s2]
    type(wall_balance_t), intent(inout) :: self
    logical, intent(in), optional :: taken
    real(wp) :: mass(3)
    integer :: m

    !$omp parallel do private(mass) schedule(static)
    do m = 1, merged%n
      associate (c => merged%cell(:, m))
        if (.not. grid%owns(c)) cycle
        mass = self%moved(:, m)
        if (present(taken)) then
          if (taken) mass = -self%mass(m)
        end if
        self%to_wall(:, m) = self%to_wall(:, m) + dt*mass*a(c(1), c(2), c(3), :)
      end associate
    end do
  end subroutine add_push

  !> Velocity of each wall cell.
  subroutine store_velocity(grid, merged, u, velocity)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(in) :: merged
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s]
    real(wp), intent(inout) :: velocity(:, :)   !! (3, wall cells) [m/s]
    integer :: m

    !$omp parallel do schedule(static)
    do m = 1, merged%n
      associate (c => merged%cell(:, m))
        velocity(:, m) = u(c(1), c(2), c(3), :)
      end associate
    end do
  end subroutine store_velocity

  !> Force and torque on each body of what its walls bear; the torque less that of the part of the
  !! fluid that moves with them, cell by cell [N, N m].
  subroutine force_of_walls(grid, merged, bodies, at_start, dt, self, force)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(in) :: merged
    type(rigid_motion_t), intent(in) :: bodies, at_start   !! motion at the end and the start
    real(wp), intent(in) :: dt   !! [s]
    type(wall_balance_t), intent(in) :: self
    real(wp), intent(out) :: force(:, :)   !! (6, bodies)
    real(wp) :: owed(6, merged%n), total(6*bodies%n)
    real(wp) :: wall(3)   ! change of its velocity in the step [m/s]
    integer(i8) :: accumulator(accumulator_size, 6*bodies%n)
    integer :: m

    !$omp parallel do private(wall) schedule(static)
    do m = 1, merged%n
      if (.not. grid%owns(merged%cell(:, m))) cycle
      wall = velocity_at_wall(grid, merged, m, bodies) - velocity_at_wall(grid, merged, m, at_start)
      owed(1:3, m) = self%to_wall(:, m)/dt
      owed(4:6, m) = (self%to_wall(:, m) - (self%moved(:, m) - self%mass(m))*wall)/dt
    end do
    accumulator = spread(no_terms, 2, 6*bodies%n)
    call add_to_bodies(grid, merged, bodies, owed, accumulator)
    call exact_totals(accumulator, total)
    force(:, :bodies%n) = reshape(total, [6, bodies%n])
  end subroutine force_of_walls

  !> Add forces at the own wall cells, and their torques, to the sums of the bodies.
  subroutine add_to_bodies(grid, merged, bodies, f, accumulator)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(in) :: merged
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in) :: f(:, :)   !! (6, wall cells) force, and that which makes the torque [N]
    integer(i8), intent(inout) :: accumulator(:, :)   !! (accumulator_size, 6 bodies)
    real(wp) :: term(terms_at_once, 6)
    integer :: b, e, n, from

    if (merged%n == 0) return
    !$omp parallel private(b, e, n, term) if (merged%n > worth_threads)
    do b = 1, bodies%n
      !$omp do schedule(dynamic)
      do from = merged%first_of_body(b), merged%first_of_body(b + 1) - 1, terms_at_once
        n = 0
        do e = from, min(from + terms_at_once, merged%first_of_body(b + 1)) - 1
          associate (m => merged%by_body(e))
            if (.not. grid%owns(merged%cell(:, m))) cycle
            n = n + 1
            term(n, 1:3) = f(1:3, m)
            term(n, 4:6) = cross(arm_to_cell(grid, merged%cell(:, m), bodies%x(:, b)), f(4:6, m))
          end associate
        end do
        call exact_add_columns(term(:n, :), accumulator(:, 6*b - 5:6*b))
      end do
      !$omp end do nowait
    end do
    !$omp end parallel
  end subroutine add_to_bodies

end module wall_balance_m
