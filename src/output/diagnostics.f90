!> The numbers of a row of results: what the step reports, and sums over the fluid and the blocks.
module diagnostics_m
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
  use kinds_m, only: wp, i8
  use parallel_m, only: global_max
  use exact_sum_m, only: bin_size, no_terms, exact_add, merge_bins, exact_totals
  use case_types_m, only: fluid_t
  use grid_m, only: grid_t
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use rigid_body_m, only: blocks_t, kinetic_energy, potential_energy
  use run_state_m, only: run_state_t
  implicit none
  private
  public :: step_report_t, row_t, make_row, row_values, column_name, column_units, n_columns

  !> What one fluid step, with its body substeps, tells about itself.
  type :: step_report_t
    real(wp) :: cfl = 0.0_wp                  !! Courant number of liquid and blocks [-]
    real(wp) :: cfl_carried = 0.0_wp          !! largest share of itself that a cell gives [-]
    integer :: transport_parts = 0            !! in which the volumes of the step moved
    real(wp) :: divergence_max = 0.0_wp       !! of the face velocity that the next step uses [1/s]
    integer :: pressure_passes = 0
    integer :: solver_iterations = 0          !! of all passes together
    real(wp) :: contact_energy = 0.0_wp       !! elastic, at the end of the step [J]
    real(wp) :: max_overlap = 0.0_wp          !! of the true shapes with one another or a wall [m]
    real(wp) :: contact_courant_max = 0.0_wp  !! C_s of eq. (6) [-]
    integer :: substeps = 0
    integer :: sealed_cells = 0               !! cells without any open face that held fluid
    integer :: curvature_fallback = 0         !! cells whose curvature does not come from heights
    integer :: warnings = 0                   !! printed in this step
    logical :: pressure_converged = .true., viscous_converged = .true., contacts_solved = .true.
    logical :: transport_converged = .true.
  end type step_report_t

  !> The columns of /series, in the order of `column_name`.
  type :: row_t
    real(wp) :: time = 0.0_wp                 !! [s]
    real(wp) :: dt = 0.0_wp                   !! of the step that ends here [s]
    real(wp) :: cfl = 0.0_wp
    real(wp) :: divergence_max = 0.0_wp       !! [1/s]
    real(wp) :: pressure_passes = 0.0_wp
    real(wp) :: solver_iterations = 0.0_wp
    real(wp) :: liquid_volume = 0.0_wp        !! [m3]
    real(wp) :: liquid_volume_drift = 0.0_wp  !! (volume - initial - inflow)/initial
    real(wp) :: volume_excess_max = 0.0_wp
      !! largest |Vt - V (1 - alpha)|/V of a cell: fluid it holds beyond its room, or lacks
    real(wp) :: kinetic_energy_fluid = 0.0_wp, kinetic_energy_bodies = 0.0_wp      !! [J]
    real(wp) :: potential_energy_bodies = 0.0_wp, contact_energy = 0.0_wp          !! [J]
    real(wp) :: max_overlap = 0.0_wp          !! [m]
    real(wp) :: contact_courant_max = 0.0_wp
    real(wp) :: substeps = 0.0_wp
    real(wp) :: sleeping = 0.0_wp             !! blocks asleep
    real(wp) :: curvature_fallback = 0.0_wp   !! cells whose curvature does not come from heights
    real(wp) :: transport_parts = 0.0_wp      !! in which the volumes of the step moved
    real(wp) :: wall_time = 0.0_wp            !! since the start of the run [s]
  end type row_t

  integer, parameter :: n_columns = 20
  character(*), parameter :: column_name(n_columns) = [character(23) :: 'time', 'dt', 'cfl', &
    'divergence_max', 'pressure_passes', 'solver_iterations', 'liquid_volume', &
    'liquid_volume_drift', 'volume_excess_max', &
    'kinetic_energy_fluid', 'kinetic_energy_bodies', 'potential_energy_bodies', 'contact_energy', &
    'max_overlap', 'contact_courant_max', 'substeps', 'sleeping', &
    'curvature_fallback', 'transport_parts', 'wall_time']
  character(*), parameter :: column_units(n_columns) = [character(3) :: 's', 's', '1', &
    '1/s', '1', '1', 'm3', '1', '1', 'J', 'J', 'J', 'J', 'm', '1', '1', '1', &
    '1', '1', 's']

contains

  !> The row of this moment. Without fluid its columns are NaN. All processes call.
  subroutine make_row(fluid, wall_time, state, report, row)
    type(fluid_t), intent(in) :: fluid            !! its properties
    real(wp), intent(in) :: wall_time             !! [s]
    type(run_state_t), intent(in) :: state
    type(step_report_t), intent(in) :: report
    type(row_t), intent(out) :: row

    row%time = state%clock%t
    row%dt = state%clock%dt
    row%wall_time = wall_time
    call add_fluid(fluid, state%grid, state%flow, state%solid, report, row)
    row%kinetic_energy_bodies = kinetic_energy(state%blocks)
    row%potential_energy_bodies = potential_energy(fluid%gravity, state%blocks)
    row%contact_energy = report%contact_energy
    row%max_overlap = report%max_overlap
    row%contact_courant_max = report%contact_courant_max
    row%substeps = real(report%substeps, wp)
    row%sleeping = real(count(state%blocks%asleep), wp)
  end subroutine make_row

  !> The columns of the fluid.
  subroutine add_fluid(fluid, grid, flow, solid, report, row)
    type(fluid_t), intent(in) :: fluid
    type(grid_t), intent(in) :: grid
    type(flow_t), intent(in) :: flow
    type(solid_geometry_t), intent(in) :: solid
    type(step_report_t), intent(in) :: report
    type(row_t), intent(inout) :: row

    if (.not. allocated(flow%u)) then
      row%cfl = ieee_value(row%cfl, ieee_quiet_nan)
      row%divergence_max = row%cfl
      row%pressure_passes = row%cfl
      row%solver_iterations = row%cfl
      row%liquid_volume = row%cfl
      row%liquid_volume_drift = row%cfl
      row%volume_excess_max = row%cfl
      row%kinetic_energy_fluid = row%cfl
      row%curvature_fallback = row%cfl
      row%transport_parts = row%cfl
      return
    end if
    row%cfl = report%cfl
    row%divergence_max = report%divergence_max
    row%pressure_passes = real(report%pressure_passes, wp)
    row%solver_iterations = real(report%solver_iterations, wp)
    row%curvature_fallback = real(report%curvature_fallback, wp)
    row%transport_parts = real(report%transport_parts, wp)
    call sum_fluid(fluid, grid, flow, solid, row)
    if (flow%liquid_initial > 0.0_wp) row%liquid_volume_drift = &
      (row%liquid_volume - flow%liquid_initial - flow%liquid_inflow)/flow%liquid_initial
  end subroutine add_fluid

  !> Volume of liquid, and kinetic energy sum 1/2 m |u|^2 of the fluid that a cell holds, exact and
  !! therefore the same on any number of threads and processes, and the largest excess of a cell.
  subroutine sum_fluid(fluid, grid, flow, solid, row)
    type(fluid_t), intent(in) :: fluid
    type(grid_t), intent(in) :: grid
    type(flow_t), intent(in) :: flow
    type(solid_geometry_t), intent(in) :: solid
    type(row_t), intent(inout) :: row
    integer(i8) :: bins(bin_size, 2), mine(bin_size, 2)
    real(wp), allocatable :: terms(:, :)   ! of one plane
    real(wp) :: total(2), excess(1)
    integer :: k, m

    do m = 1, 2
      bins(:, m) = no_terms
    end do
    excess = 0.0_wp
    !$omp parallel private(mine, terms, k, m) reduction(max: excess)
    allocate (terms(product(grid%hi(:2) - grid%lo(:2) + 1), 2))
    do m = 1, 2
      mine(:, m) = no_terms
    end do
    !$omp do schedule(static)
    do k = grid%lo(3), grid%hi(3)
      call plane_terms(fluid, grid, k, flow%liquid, solid%alpha, flow%u, terms)
      do m = 1, 2
        call exact_add(terms(:, m), mine(:, m))
      end do
      excess = max(excess, excess_of_plane(grid, k, flow%room, solid%alpha))
    end do
    !$omp end do nowait
    !$omp critical (merge_fluid_sums)
    do m = 1, 2
      call merge_bins(mine(:, m), bins(:, m))
    end do
    !$omp end critical (merge_fluid_sums)
    !$omp end parallel
    call exact_totals(bins, total)
    call global_max(excess)
    row%liquid_volume = total(1)
    row%kinetic_energy_fluid = total(2)
    row%volume_excess_max = excess(1)
  end subroutine sum_fluid

  !> Volume of liquid and kinetic energy of the cells of plane k. The mass is that of the liquid and
  !! the gas in the open part: `flow%rho` of a cut cell is that of its level, gas that leaves a cut
  !! cell under water would have a thousand times its energy.
  pure subroutine plane_terms(fluid, grid, k, liquid, alpha, u, terms)
    type(fluid_t), intent(in) :: fluid
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: k
    real(wp), intent(in), contiguous, dimension(grid%first(1):, grid%first(2):, grid%first(3):) :: &
      liquid, alpha
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(out), contiguous :: terms(:, :)   !! (cells of the plane, 2) [m3], [J]
    integer :: i, j, first, last, at
    real(wp) :: mass

    first = grid%lo(1)
    last = grid%hi(1)
    do j = grid%lo(2), grid%hi(2)
      at = (j - grid%lo(2))*(last - first + 1) + 1 - first
      do i = first, last
        terms(at + i, 1) = liquid(i, j, k)
        mass = fluid%liquid_density*liquid(i, j, k) + fluid%gas_density &
          *max(0.0_wp, grid%volume*(1.0_wp - alpha(i, j, k)) - liquid(i, j, k))
        terms(at + i, 2) = 0.5_wp*mass*(u(i, j, k, 1)**2 + u(i, j, k, 2)**2 + u(i, j, k, 3)**2)
      end do
    end do
  end subroutine plane_terms

  !> Largest difference of the fluid that a cell of plane k holds from its open volume [V].
  pure function excess_of_plane(grid, k, room, alpha) result(excess)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: k
    real(wp), intent(in), contiguous, dimension(grid%first(1):, grid%first(2):, grid%first(3):) :: &
      room, alpha
    real(wp) :: excess
    integer :: i, j

    excess = 0.0_wp
    do j = grid%lo(2), grid%hi(2)
      do i = grid%lo(1), grid%hi(1)
        excess = max(excess, abs(room(i, j, k)/grid%volume - (1.0_wp - alpha(i, j, k))))
      end do
    end do
  end function excess_of_plane

  !> The columns as an array, in the order of `column_name`.
  pure function row_values(row) result(v)
    type(row_t), intent(in) :: row
    real(wp) :: v(n_columns)

    v = [row%time, row%dt, row%cfl, row%divergence_max, row%pressure_passes, &
      row%solver_iterations, &
         row%liquid_volume, row%liquid_volume_drift, row%volume_excess_max, &
         row%kinetic_energy_fluid, &
         row%kinetic_energy_bodies, &
         row%potential_energy_bodies, row%contact_energy, row%max_overlap, &
         row%contact_courant_max, &
         row%substeps, row%sleeping, row%curvature_fallback, row%transport_parts, row%wall_time]
  end function row_values

end module diagnostics_m
