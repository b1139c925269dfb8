!> The numbers of a row of results: what the step reports, and sums over the fluid and the blocks.
module diagnostics_m
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
  use kinds_m, only: wp, i8
  use vectors_m, only: norm
  use parallel_m, only: global_max
  use exact_sum_m, only: accumulator_size, no_terms, exact_add, exact_add_columns, exact_totals
  use case_types_m, only: fluid_t
  use grid_m, only: grid_t
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use contacts_m, only: contact_report_t
  use pressure_m, only: pressure_report_t
  use rigid_body_m, only: kinetic_energy, potential_energy
  use state_m, only: run_state_t
  implicit none
  private
  public :: step_report_t, quantity_t, make_row, value_of
  public :: fluid_sums_t, measure_fluid, energy_of_level

  !> Of all the fluid.
  type :: fluid_sums_t
    real(wp) :: liquid_volume = 0.0_wp   !! [m3]
    real(wp) :: kinetic = 0.0_wp         !! energy [J]
    real(wp) :: potential = 0.0_wp       !! energy, zero at the lower corner of the tank [J]
    real(wp) :: excess_max = 0.0_wp      !! of the fluid of a cell over its open volume [V]
  end type fluid_sums_t

  !> The report of one fluid step with its body substeps.
  type :: step_report_t
    real(wp) :: cfl = 0.0_wp                  !! Courant number of liquid and blocks [-]
    integer :: transport_parts = 0            !! in which the volumes of the step moved
    type(contact_report_t) :: contact
    type(pressure_report_t) :: pressure       !! its divergence is that which the next step uses
    real(wp) :: max_overlap = -1.0_wp         !! of the true shapes with one another or a wall [m],
    logical :: overlap_known = .false.        !! measured for rows and frames only
    integer :: curvature_fallback = 0         !! cells whose curvature does not come from heights
    integer :: inertia_clips = 0              !! limits of added inertia that cut it
    integer :: warnings = 0                   !! printed in this step
    type(fluid_sums_t) :: fluid               !! at its end
    real(wp) :: energy_excess = 0.0_wp        !! over what was put in (`energy_m`) [-]
  end type step_report_t

  !> A number of a row of results.
  type :: quantity_t
    character(23) :: name = ''
    character(3) :: units = ''
    real(wp) :: value = 0.0_wp
  end type quantity_t

contains

  !> The row of this moment, a column of `/series` each. Without fluid its quantities are NaN.
  function make_row(fluid, wall_time, state, report) result(row)
    type(fluid_t), intent(in) :: fluid            !! its properties
    real(wp), intent(in) :: wall_time             !! since the start of the run [s]
    type(run_state_t), intent(in) :: state
    type(step_report_t), intent(in) :: report
    type(quantity_t), allocatable :: row(:)

    row = [ &
      quantity_t('time', 's', state%clock%t), &
      quantity_t('dt', 's', state%clock%dt), &
      quantity_t('cfl', '1', wet(report%cfl)), &
      quantity_t('divergence_max', '1/s', wet(report%pressure%divergence)), &
      quantity_t('pressure_passes', '1', wet(real(report%pressure%passes, wp))), &
      quantity_t('solver_iterations', '1', wet(real(report%pressure%iterations, wp))), &
      quantity_t('liquid_volume', 'm3', wet(report%fluid%liquid_volume)), &
      quantity_t('liquid_volume_drift', '1', wet(drift())), &
      quantity_t('volume_excess_max', '1', wet(report%fluid%excess_max)), &
      quantity_t('kinetic_energy_fluid', 'J', wet(report%fluid%kinetic)), &
      quantity_t('kinetic_energy_bodies', 'J', kinetic_energy(state%blocks)), &
      quantity_t('potential_energy_fluid', 'J', wet(report%fluid%potential)), &
      quantity_t('potential_energy_bodies', 'J', potential_energy(fluid%gravity, state%blocks)), &
      quantity_t('contact_energy', 'J', report%contact%energy), &
      quantity_t('energy_excess', '1', wet(report%energy_excess)), &
      quantity_t('max_overlap', 'm', report%max_overlap), &
      quantity_t('contact_courant_max', '1', report%contact%courant_max), &
      quantity_t('substeps', '1', real(report%contact%substeps, wp)), &
      quantity_t('sleeping', '1', real(count(state%blocks%asleep), wp)), &
      quantity_t('curvature_fallback', '1', wet(real(report%curvature_fallback, wp))), &
      quantity_t('transport_parts', '1', wet(real(report%transport_parts, wp))), &
      quantity_t('inertia_clips', '1', wet(real(report%inertia_clips, wp))), &
      quantity_t('wall_time', 's', wall_time)]
  contains
    !> A number that only a flow has.
    real(wp) function wet(value)
      real(wp), intent(in) :: value

      wet = value
      if (.not. allocated(state%flow%u)) wet = ieee_value(value, ieee_quiet_nan)
    end function wet

    !> (volume - initial - inflow)/initial of the liquid.
    real(wp) function drift()
      drift = 0.0_wp
      associate (flow => state%flow)
        if (flow%liquid_initial > 0.0_wp) drift = (report%fluid%liquid_volume &
          - flow%liquid_initial - flow%liquid_inflow)/flow%liquid_initial
      end associate
    end function drift
  end function make_row

  !> A number of a row by its name; NaN if there is none.
  pure real(wp) function value_of(row, name)
    type(quantity_t), intent(in) :: row(:)
    character(*), intent(in) :: name
    integer :: c

    value_of = ieee_value(value_of, ieee_quiet_nan)
    do c = 1, size(row)
      if (row(c)%name == name) value_of = row(c)%value
    end do
  end function value_of

  !> Volume of liquid, energies and largest excess of the fluid. The sums are exact and therefore
  !! the same on any number of threads and processes. All processes call.
  function measure_fluid(fluid, grid, flow, solid) result(sums)
    type(fluid_t), intent(in) :: fluid
    type(grid_t), intent(in) :: grid
    type(flow_t), intent(in) :: flow
    type(solid_geometry_t), intent(in) :: solid
    type(fluid_sums_t) :: sums
    integer(i8) :: accumulator(accumulator_size, 3)
    real(wp), allocatable :: terms(:, :)   ! of one plane
    real(wp) :: total(3), excess(1)
    integer :: k

    accumulator = spread(no_terms, 2, 3)
    excess = 0.0_wp
    !$omp parallel private(terms, k) reduction(max: excess)
    allocate (terms(product(grid%hi(:2) - grid%lo(:2) + 1), 3))
    !$omp do schedule(static)
    do k = grid%lo(3), grid%hi(3)
      call plane_terms(fluid, grid, k, flow, solid%alpha, terms, excess(1))
      call exact_add_columns(terms, accumulator)
    end do
    !$omp end do nowait
    !$omp end parallel
    call exact_totals(accumulator, total)
    call global_max(excess)
    sums = fluid_sums_t(total(1), total(2), total(3), excess(1))
  end function measure_fluid

  !> Potential energy that the fluid would have if its liquid, and what blocks displace of it, lay
  !! level; gravity along a direction of the grid [J].
  function energy_of_level(fluid, grid, c) result(energy)
    type(fluid_t), intent(in) :: fluid
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp) :: energy
    integer(i8) :: accumulator(accumulator_size, 1)
    real(wp) :: total(1), depth, g
    integer :: j, k, d

    accumulator(:, 1) = no_terms
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        call exact_add(c(grid%lo(1):grid%hi(1), j, k), accumulator(:, 1))
      end do
    end do
    call exact_totals(accumulator, total)
    d = maxloc(abs(fluid%gravity), 1)
    g = abs(fluid%gravity(d))
    associate (area => product(grid%length)/grid%length(d), length => grid%length(d))
      depth = total(1)*grid%volume/area
      energy = 0.5_wp*g*area*(fluid%liquid_density*depth**2 &
                              + fluid%gas_density*(length**2 - depth**2))
      if (fluid%gravity(d) > 0.0_wp) energy = energy - g*length*area &   ! down is the upper side
        *(fluid%liquid_density*depth + fluid%gas_density*(length - depth))
    end associate
  end function energy_of_level

  !> Volume of liquid, kinetic energy 1/2 m |u|^2 and potential energy -m g.x of the cells of plane
  !! k. The mass is that of the liquid and the gas in the open part: `flow%rho` of a cut cell is
  !! that of its level, gas that leaves a cut cell under water would have a thousand times its
  !! energy.
  pure subroutine plane_terms(fluid, grid, k, flow, alpha, terms, excess)
    type(fluid_t), intent(in) :: fluid
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: k
    type(flow_t), intent(in) :: flow
    real(wp), intent(in), contiguous :: alpha(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(out), contiguous :: terms(:, :)   !! (cells of the plane, 3) [m3], [J]
    real(wp), intent(inout) :: excess
      !! largest difference of the fluid in a cell from its open volume [V]
    integer :: i, j, first, last, at
    real(wp) :: mass, gas, height, rest   !! [kg], [m3], times gravity, without that along x [m2/s2]

    first = grid%lo(1)
    last = grid%hi(1)
    do j = grid%lo(2), grid%hi(2)
      at = (j - grid%lo(2))*(last - first + 1) + 1 - first
      rest = -fluid%gravity(2)*(grid%centre(j, 2) - grid%origin(2)) &
             - fluid%gravity(3)*(grid%centre(k, 3) - grid%origin(3))
      do i = first, last
        associate (liquid => flow%liquid(i, j, k), u => flow%u(i, j, k, :), c => flow%c)
          excess = max(excess, abs(flow%fluid_volume(i, j, k)/grid%volume &
                                   - (1.0_wp - alpha(i, j, k))))
          gas = max(0.0_wp, grid%volume*(1.0_wp - alpha(i, j, k)) - liquid)
          mass = fluid%liquid_density*liquid + fluid%gas_density*gas
          height = rest - fluid%gravity(1)*(grid%centre(i, 1) - grid%origin(1))
          terms(at + i, 1) = liquid
          terms(at + i, 2) = 0.5_wp*mass*(u(1)**2 + u(2)**2 + u(3)**2)
          terms(at + i, 3) = mass*height
          if (liquid <= 0.0_wp .or. gas <= 0.0_wp) cycle
          terms(at + i, 3) = terms(at + i, 3) - (fluid%liquid_density - fluid%gas_density) &
            *gas*liquid/(gas + liquid)*below(fluid%gravity, grid%h, &
            [c(i + 1, j, k) - c(i - 1, j, k), c(i, j + 1, k) - c(i, j - 1, k), &
             c(i, j, k + 1) - c(i, j, k - 1)])
        end associate
      end do
    end do
  end subroutine plane_terms

  !> How much deeper the liquid of a cell with a surface lies than its gas, times gravity, by the
  !! change of the liquid share along each direction: half a cell where the surface is level
  !! [m2/s2].
  pure function below(gravity, h, change) result(depth)
    real(wp), intent(in) :: gravity(3), h(3), change(3)
    real(wp) :: depth
    real(wp) :: normal(3)

    normal = change/h
    depth = 0.5_wp*dot_product(gravity, h*normal)/max(norm(normal), tiny(depth))
  end function below

end module diagnostics_m
