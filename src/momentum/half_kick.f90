!> Half of the old pressure before the transport, half after it.
!!
!! With the velocity of the start carried and pressure and weight added after, what a fluid element
!! gains while it is on its way is late by half a step: in front of a body in a stream, where
!! pressure turns the stream, this is a false drag of the first order in the step (a sphere without
!! viscosity, `docs/theory.md`, section 8). So the liquid gets \( (\Delta t/2)(g - \nabla p/\rho) \)
!! on the surface of the bodies at the start of the step, before the transport, and the other half
!! in the velocity stage, on the surface at its end: the impulse of a pressure acts on the surface
!! of the middle of the step, and each half is a gradient on its own surface. Near the bodies the
!! old pressure is carried along with them first (`advected_pressure_m`).
!!
!! Only liquid away from the free surface takes part. At the surface and in gas the density changes
!! from step to step, and the old pressure of a cell that was liquid would act on gas, 830 times as
!! strongly: there it is only a guess. Neither transport nor viscosity sees it, the faces take it as
!! a whole, and the cells get it after them: velocity depends on the sum of old and
!! new pressure alone. Else columns of viscous liquid made a thousand times the energy that they had
!! (docs/decisions/surface.md). Cells at an outflow do not take part either: the drag of the
!! side, half of which they take (`predict_face_velocity`), is no part of it.
module half_kick_m
  use kinds_m, only: wp, i8
  use case_types_m, only: fluid_t
  use grid_m, only: grid_t, n_halo
  use fields_m, only: flow_t
  use boundary_m, only: fill_velocity_halo
  use merged_cells_m, only: merged_cells_t
  use merged_momentum_m, only: share_acceleration
  use effective_aperture_m, only: hold_in_cells
  use wall_balance_m, only: add_to_bodies
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t
  use face_velocity_m, only: acceleration_t, cell_mean_of_faces
  use mixture_m, only: pure_share, mass_through
  use exact_sum_m, only: exact_totals, accumulator_size, no_terms
  use parallel_m, only: halo_exchange
  implicit none
  private
  public :: find_liquid, find_first_half, add_first_half, change_where
  public :: force_of_half_kick

  real(wp), parameter :: full = 1.0_wp - pure_share   !! liquid share of a cell without gas [-]

contains

  !> Acceleration of the cells that take part from that of the faces, by weight and old pressure;
  !! halo filled, small cells as their targets.
  subroutine find_first_half(grid, solid, merged, bodies, held_acceleration, rho, a)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid   !! at the start of the step
    type(merged_cells_t), intent(in) :: merged     !! likewise
    type(rigid_motion_t), intent(in) :: bodies    !! likewise
    real(wp), intent(in) :: held_acceleration(:, :)
      !! (6, bodies) acceleration of what they hold of the fluid [m/s2, rad/s2]
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! [kg/m3]
    type(acceleration_t), intent(inout) :: a

    call cell_mean_of_faces(grid, solid%aperture, a%face, a%cell)
    call hold_in_cells(grid, solid, bodies, held_acceleration, a%face, a%cell)
    call change_where(grid, a%kicked, .false., a%cell)
    call halo_exchange(a%cell, n_halo)
    call share_acceleration(grid, solid%aperture, rho, merged, a%cell)
  end subroutine find_first_half

  !> Add half a step of weight and old pressure to the velocity of the liquid, halo filled.
  subroutine add_first_half(grid, fluid, dt, a, flow, kick)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    real(wp), intent(in) :: dt            !! [s]
    type(acceleration_t), intent(in) :: a
    type(flow_t), intent(inout) :: flow   !! of the start of the step
    real(wp), intent(inout), contiguous :: kick(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! momentum that the cells get [kg m/s]
    integer :: i, j, k
    real(wp) :: mass

    !$omp parallel do private(i, j, mass) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          if (.not. a%kicked(i, j, k)) then
            kick(i, j, k, :) = 0.0_wp
            cycle
          end if
          mass = mass_through(fluid, flow%fluid_volume(i, j, k), flow%liquid(i, j, k))
          flow%u(i, j, k, :) = flow%u(i, j, k, :) + 0.5_wp*dt*a%cell(i, j, k, :)
          kick(i, j, k, :) = 0.5_wp*dt*mass*a%cell(i, j, k, :)
        end do
      end do
    end do
    call fill_velocity_halo(grid, flow%u)
  end subroutine add_first_half

  !> u += time a, or u = 0 without a, in the own cells that take part or in those that do not: the
  !! second half of weight and old pressure in the ones, the whole of it in the others.
  subroutine change_where(grid, takes_part, those, u, time, a)
    type(grid_t), intent(in) :: grid
    logical, intent(in), contiguous :: takes_part(grid%first(1):, grid%first(2):, grid%first(3):)
    logical, intent(in) :: those
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(in), optional :: time   !! [s]
    real(wp), intent(in), contiguous, optional :: &
      a(grid%first(1):, grid%first(2):, grid%first(3):, :)
    integer :: i, j, k, d

    !$omp parallel do private(i, j, d) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do d = 1, 3
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            if (takes_part(i, j, k) .neqv. those) cycle
            if (present(a)) then
              u(i, j, k, d) = u(i, j, k, d) + time*a(i, j, k, d)
            else
              u(i, j, k, d) = 0.0_wp
            end if
          end do
        end do
      end do
    end do
  end subroutine change_where

  !> The cells in liquid, of all or `among` some: away from outflows, full of liquid with all cells
  !! around.
  subroutine find_liquid(grid, flow, in_liquid, among)
    type(grid_t), intent(in) :: grid
    type(flow_t), intent(in) :: flow
    logical, intent(inout), contiguous :: in_liquid(grid%first(1):, grid%first(2):, grid%first(3):)
    logical, intent(in), contiguous, optional :: &
      among(grid%first(1):, grid%first(2):, grid%first(3):)
    integer :: i, j, k, low(3), high(3)
    real(wp) :: least(grid%first(1):grid%last(1))   ! share of the nine cells around a line
    logical :: inside

    low = merge(2, grid%first, flow%sides(1, :)%active)
    high = merge(grid%n - 1, grid%last, flow%sides(2, :)%active)
    !$omp parallel do private(i, j, least, inside) schedule(static)
    do k = grid%first(3) + 1, grid%last(3) - 1
      do j = grid%first(2) + 1, grid%last(2) - 1
        inside = all([j, k] >= low(2:) .and. [j, k] <= high(2:))
        associate (c => flow%c(:, j - 1:j + 1, k - 1:k + 1))
          least = min(c(:, 1, 1), c(:, 2, 1), c(:, 3, 1), c(:, 1, 2), c(:, 2, 2), c(:, 3, 2), &
                      c(:, 1, 3), c(:, 2, 3), c(:, 3, 3))
        end associate
        do i = grid%first(1) + 1, grid%last(1) - 1
          in_liquid(i, j, k) = inside .and. i >= low(1) .and. i <= high(1) &
                               .and. min(least(i - 1), least(i), least(i + 1)) >= full
        end do
        if (present(among)) in_liquid(:, j, k) = in_liquid(:, j, k) .and. among(:, j, k)
      end do
    end do
  end subroutine find_liquid

  !> Force and torque on each body by which the impulses of the old pressure on the surface of the
  !! start (`kick`) and on that of the end differ [N, N m].
  function force_of_half_kick(grid, fluid, before, merged, bodies, dt, flow, a, kick) &
    result(force)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(merged_cells_t), intent(in) :: before, merged   !! of the start and of the end
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in) :: dt   !! [s]
    type(flow_t), intent(in) :: flow
    type(acceleration_t), intent(in) :: a   !! on the surface of the end, of groups
    real(wp), intent(in), contiguous :: kick(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [kg m/s]
    real(wp) :: force(6, bodies%n)
    integer(i8) :: accumulator(accumulator_size, 6*bodies%n)
    real(wp) :: total(6*bodies%n), owed(6, max(before%n, merged%n))
    integer :: m

    accumulator = spread(no_terms, 2, 6*bodies%n)
    !$omp parallel do schedule(static)
    do m = 1, merged%n
      owed(1:3, m) = of_cell(merged%cell(:, m))
      owed(4:6, m) = owed(1:3, m)
    end do
    call add_to_bodies(grid, merged, bodies, owed, accumulator)
    !$omp parallel do schedule(static)
    do m = 1, before%n
      owed(1:3, m) = 0.0_wp   ! what is a wall cell at the end is there already
      associate (c => before%cell(:, m))
        if (merged%number(c(1), c(2), c(3)) == 0) owed(1:3, m) = of_cell(c)
      end associate
      owed(4:6, m) = owed(1:3, m)
    end do
    call add_to_bodies(grid, before, bodies, owed, accumulator)
    call exact_totals(accumulator, total)
    force = reshape(total, [6, bodies%n])
  contains
    !> Force that own cell c owes the body of its wall [N].
    pure function of_cell(c) result(f)
      integer, intent(in) :: c(3)
      real(wp) :: f(3)
      real(wp) :: mass

      f = 0.0_wp
      if (.not. grid%owns(c)) return
      f = -kick(c(1), c(2), c(3), :)
      if (a%kicked(c(1), c(2), c(3))) then
        mass = mass_through(fluid, flow%fluid_volume(c(1), c(2), c(3)), &
                            flow%liquid(c(1), c(2), c(3)))
        f = f + 0.5_wp*dt*mass*a%cell(c(1), c(2), c(3), :)
      end if
      f = f/dt
    end function of_cell
  end function force_of_half_kick

end module half_kick_m
