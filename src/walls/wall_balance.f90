!> What the fluid in the cells at walls and its faces disagree about, a force on the bodies.
!!
!! The faces of a cell move the share m_d of its mass, the mean of two open faces; the mass that is
!! there is m. What the faces gave and the fluid did not get, the bodies have felt too little:
!! $$ F = \frac{1}{\Delta t} \sum \left[ m_d (\delta u_f - \delta U) - m (\delta u - \delta U)
!! + I \right] $$
!! with delta u_f the change of velocity by the accelerations at the faces, delta u that which the
!! group took and delta U that of the wall, whose part `mass_defect` counts. It is the part of
!! the pressure on the wall that the trapezoid rule of the faces misses. I is the momentum of small
!! cells that the wall bears as one end of a lever (`group_momentum_m`). In the same way the half of
!! the old pressure that acts before the transport (`half_kick_m`) does so on the surface of the
!! start; the bodies get the difference. Fluid and bodies together keep their momentum.
module wall_balance_m
  use kinds_m, only: wp, i8
  use vectors_m, only: wrench
  use growing_m, only: ensure_capacity
  use case_types_m, only: fluid_t
  use grid_m, only: grid_t
  use fields_m, only: flow_t
  use mixture_m, only: mass_through
  use solid_geometry_m, only: solid_geometry_t, mean_apertures
  use rigid_motion_m, only: rigid_motion_t, wall_velocity
  use rigid_flux_m, only: arm_to_cell
  use merged_cells_m, only: merged_cells_t
  use exact_sum_m, only: exact_add_columns, exact_totals, accumulator_size, no_terms, terms_at_once
  implicit none
  private
  public :: wall_balance_t, wall_balance_init, begin_balance, store_change, store_velocity
  public :: force_of_walls, add_to_bodies

  integer, parameter :: worth_threads = 1000   !! fewer wall cells are looked at by one thread

  !> Of each wall cell of `merged_cells_t`.
  type :: wall_balance_t
    real(wp), allocatable :: mass(:)        !! of its fluid [kg]
    real(wp), allocatable :: pushed(:, :)   !! (3, *) change of velocity by the faces [m/s]
    real(wp), allocatable :: gained(:, :)   !! (3, *) that which the group took [m/s]
    real(wp), allocatable :: before(:, :)   !! (3, *) velocity noted before sharing [m/s]
    real(wp), allocatable :: to_wall(:, :)  !! (3, *) of small cells, borne by the wall [kg m/s]
  end type wall_balance_t

contains

  !> Empty lists.
  subroutine wall_balance_init(self)
    type(wall_balance_t), intent(out) :: self

    allocate (self%mass(0), self%pushed(3, 0), self%gained(3, 0), self%before(3, 0))
    allocate (self%to_wall(3, 0))
  end subroutine wall_balance_init

  !> The masses of the wall cells; nothing has changed yet.
  subroutine begin_balance(fluid, merged, flow, self)
    type(fluid_t), intent(in) :: fluid
    type(merged_cells_t), intent(in) :: merged
    type(flow_t), intent(in) :: flow
    type(wall_balance_t), intent(inout) :: self
    integer :: m

    call ensure_capacity(merged%n, self%mass)
    call ensure_capacity(merged%n, self%pushed)
    call ensure_capacity(merged%n, self%gained)
    call ensure_capacity(merged%n, self%before)
    call ensure_capacity(merged%n, self%to_wall)
    !$omp parallel do schedule(static)
    do m = 1, merged%n
      associate (c => merged%cell(:, m))
        self%mass(m) = mass_through(fluid, flow%fluid_volume(c(1), c(2), c(3)), &
                                    flow%liquid(c(1), c(2), c(3)))
      end associate
    end do
    self%pushed(:, :merged%n) = 0.0_wp
    self%gained(:, :merged%n) = 0.0_wp
    self%to_wall(:, :merged%n) = 0.0_wp
  end subroutine begin_balance

  !> Add dt a of each wall cell to a change of velocity.
  subroutine store_change(grid, merged, dt, a, change)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(in) :: merged
    real(wp), intent(in) :: dt   !! [s]
    real(wp), intent(in), contiguous :: a(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s2]
    real(wp), intent(inout) :: change(:, :)   !! (3, wall cells) [m/s]
    integer :: m

    !$omp parallel do schedule(static)
    do m = 1, merged%n
      associate (c => merged%cell(:, m))
        change(:, m) = change(:, m) + dt*a(c(1), c(2), c(3), :)
      end associate
    end do
  end subroutine store_change

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

  !> Force and torque on each body of what faces and masses disagree about [N, N m].
  subroutine force_of_walls(grid, solid, merged, bodies, at_start, dt, rho, self, force)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(merged_cells_t), intent(in) :: merged
    type(rigid_motion_t), intent(in) :: bodies, at_start   !! motion at the end and the start
    real(wp), intent(in) :: dt   !! [s]
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! [kg/m3]
    type(wall_balance_t), intent(in) :: self
    real(wp), intent(out) :: force(:, :)   !! (6, bodies)
    real(wp) :: owed(3, merged%n)
    real(wp) :: wall(3), moved(3), faster(6, bodies%n)   ! than at the start
    real(wp) :: total(6*bodies%n)
    integer(i8) :: accumulator(accumulator_size, 6*bodies%n)
    integer :: m

    faster = bodies%motion(:, :bodies%n) - at_start%motion(:, :bodies%n)
    !$omp parallel do private(wall, moved) schedule(static)
    do m = 1, merged%n
      associate (c => merged%cell(:, m), b => merged%body(m))
        if (.not. grid%owns(c)) cycle
        wall = wall_velocity(faster(:, b), arm_to_cell(grid, c, bodies%x(:, b)))
        moved = rho(c(1), c(2), c(3))*grid%volume*mean_apertures(grid, solid%aperture, c)
        owed(:, m) = (moved*(self%pushed(:, m) - wall) - self%mass(m)*(self%gained(:, m) - wall) &
                      + self%to_wall(:, m))/dt
      end associate
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
    real(wp), intent(in) :: f(:, :)                     !! (3, wall cells) [N]
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
            term(n, :) = wrench(f(:, m), arm_to_cell(grid, merged%cell(:, m), bodies%x(:, b)))
          end associate
        end do
        call exact_add_columns(term(:n, :), accumulator(:, 6*b - 5:6*b))
      end do
      !$omp end do nowait
    end do
    !$omp end parallel
  end subroutine add_to_bodies

end module wall_balance_m
