!> Everything that lives as long as the run, and how it begins.
module simulation_m
  use kinds_m, only: wp
  use case_types_m, only: case_t, contact_input_t
  use grid_m, only: grid_init
  use scratch_m, only: scratch_t, scratch_init
  use fields_m, only: flow_init
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use solid_fraction_m, only: solid_fraction_t, solid_fraction_init, update_solid
  use liquid_fill_m, only: fill_liquid
  use initial_state_m, only: read_initial_state
  use extended_fraction_m, only: extend_fraction
  use fluid_transport_m, only: fluid_transport_t, fluid_transport_init
  use mixture_m, only: mix_fluid
  use outflow_m, only: outflow_init, start_outflow, update_outflow
  use boundary_m, only: fill_velocity_halo, fill_scalar_halo, set_side_velocity
  use tet_mesh_m, only: shape_t
  use rigid_body_m, only: blocks_t, lowering, kinetic_energy, potential_energy
  use sling_m, only: hangs, brace
  use case_blocks_m, only: blocks_init, turn_with_fluid
  use walls_m, only: walls_t, walls_init
  use bed_m, only: bed_t
  use contact_solver_m, only: contact_solver_t
  use impulse_step_m, only: impulses_t
  use springs_m, only: springs_t
  use lubrication_m, only: lubrication_init
  use overlap_m, only: overlap_t, overlap_init
  use deep_overlaps_m, only: deep_overlaps_t, deep_overlaps_init
  use diagnostics_m, only: step_report_t, fluid_sums_t, measure_fluid, energy_of_level
  use energy_m, only: energy_parts_t, energy_init, put_in_energy, energy_excess
  use coupling_m, only: coupling_t, copy_motion
  use light_m, only: light_init, load_block
  use monolithic_m, only: monolithic_t, monolithic_init
  use mass_average_m, only: mass_average_t, mass_average_init
  use flow_start_m, only: start_flow
  use stage_m, only: stage_t
  use clock_m, only: clock_init
  use state_m, only: run_state_t
  use timers_m, only: name_phase
  implicit none
  private
  public :: simulation_t, simulation_init, choose_contact, resume, measure, energies

  !> The state, what is made of the case, and the work of the stages.
  type, extends(run_state_t) :: simulation_t
    type(case_t) :: case
    type(solid_geometry_t), allocatable :: before    !! solids at the start of the step
    type(solid_fraction_t) :: fraction
    type(scratch_t) :: scratch                       !! work arrays of the stages
    type(fluid_transport_t) :: transport
    class(coupling_t), allocatable :: coupling
    type(walls_t) :: walls
    type(overlap_t) :: overlap
    type(deep_overlaps_t) :: deep
    logical :: wet = .true.                !! there is a flow of water and air
    logical :: start_converged = .true.    !! flow at t = 0 and at releases
    logical, allocatable :: initialised(:)        !! blocks whose motion in the fluid has begun
  end type simulation_t

contains

  !> State at t = 0: bodies in place, liquid filled in, everything at rest or at its given velocity.
  subroutine simulation_init(case, shapes, bed, sim)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)
    type(bed_t), intent(in), target :: bed   !! which stays where it is
    type(simulation_t), intent(inout), target :: sim
    integer :: d, n_solids, subcells   ! the latter 0: exact solid shares

    sim%case = case
    select case (case%run%physics)
    case ('coupled', 'fluid'); sim%wet = .true.
    case ('dry', 'light'); sim%wet = .false.
    case default; error stop 'simulation_init: no such physics'
    end select
    call name_phase('blocks')
    call name_phase('solid shares')
    call name_phase('transport')
    call name_phase('velocity and pressure')
    call clock_init(case%run, sim%clock)
    call grid_init(case%grid, case%boundary, sim%grid)
    call walls_init(case%grid, case%boundary, sim%walls)
    sim%walls%bed => bed
    call blocks_init(case, shapes, sim%blocks, bed)
    call choose_contact(case%contact, sim%blocks, sim%contacts)
    call overlap_init(sim%blocks%shapes, sim%overlap)
    call deep_overlaps_init(sim%blocks, sim%deep)
    allocate (sim%initialised(sim%blocks%n), source=.false.)
    allocate (sim%solid, sim%before)
    if (case%run%physics == 'light') call light_init(case, bed, sim%blocks, sim%light)
    if (.not. sim%wet) return
    call energy_init(case, sim%grid, sim%blocks, sim%energy)
    call turn_with_fluid(case%fluid%liquid_density, sim%blocks)
    if (case%contact%lubrication) call lubrication_init(case, sim%grid%h, sim%blocks, &
      sim%contacts%lubrication)
    select case (case%numerics%solid_fraction)
    case ('exact'); subcells = 0
    case ('subcell'); subcells = case%numerics%subcells
    case default; error stop 'simulation_init: no such solid_fraction'
    end select
    call flow_init(sim%grid, sim%flow)
    n_solids = sim%blocks%n
    if (bed%there) n_solids = n_solids + 1
    call solid_geometry_init(sim%grid, sim%solid, n_solids)
    call solid_geometry_init(sim%grid, sim%before, n_solids)
    call solid_fraction_init(sim%grid, sim%blocks, sim%fraction, subcells, bed)
    call scratch_init(sim%grid, sim%scratch)
    call fluid_transport_init(case, sim%grid, sim%transport)
    call choose_coupling(case, n_solids, sim)
    call update_solid(sim%fraction, sim%grid, sim%blocks, sim%solid)
    call fill_liquid(sim%grid, case%fluid, case%water, sim%solid, sim%flow)
    do d = 1, 3
      sim%flow%u(:, :, :, d) = case%fluid%velocity(d)
      sim%flow%uf(:, :, :, d) = case%fluid%velocity(d)
    end do
    call fill_velocity_halo(sim%grid, sim%flow%u)
    call read_initial_state(case%fluid, sim%grid, sim%flow)
    call extend_fraction(sim%grid, sim%solid, sim%transport%liquid%extension, sim%flow)
    call mix_fluid(case%fluid, sim%flow)
    call set_side_velocity(sim%grid, sim%flow%uf)
    call outflow_init(sim%grid, case%fluid, sim%flow%sides)
    call update_outflow(sim%grid, case%fluid, 0.0_wp, sim%flow%c, sim%flow%uf, sim%flow%sides)
    call copy_motion(sim%blocks, sim%coupling%bodies)
    call start_flow(stage_t(sim%grid, sim%solid, sim%flow, sim%scratch, case%run%dt), &
                    sim%coupling, sim%start_converged)
    call start_outflow(sim%grid, case%fluid, sim%solid%alpha, sim%flow%c, sim%flow%uf, &
                       sim%flow%sides)
  end subroutine simulation_init

  !> The contact solver of a case.
  subroutine choose_contact(input, blocks, contacts)
    type(contact_input_t), intent(in) :: input
    type(blocks_t), intent(in) :: blocks
    class(contact_solver_t), allocatable, intent(out) :: contacts

    select case (input%solver)
    case ('springs'); allocate (springs_t :: contacts)
    case ('impulses'); allocate (impulses_t :: contacts)
    case default; error stop 'choose_contact: no such solver'
    end select
    call contacts%init(input, blocks)
  end subroutine choose_contact

  !> The coupling of the case, with its work arrays.
  subroutine choose_coupling(case, n_solids, sim)
    type(case_t), intent(in) :: case
    integer, intent(in) :: n_solids
    type(simulation_t), intent(inout) :: sim

    select case (trim(case%numerics%coupling))
    case ('monolithic'); allocate (monolithic_t :: sim%coupling)
    case ('mics'); allocate (mass_average_t :: sim%coupling)
    case default; error stop 'simulation: unknown coupling'
    end select
    select type (coupling => sim%coupling)
    type is (monolithic_t); call monolithic_init(sim%grid, n_solids, case, coupling)
    type is (mass_average_t)
      call mass_average_init(sim%grid, n_solids, case, coupling)
    end select
  end subroutine choose_coupling

  !> What follows from the state after it was read: solids in the grid, density, halos, outflows.
  subroutine resume(sim)
    type(simulation_t), intent(inout) :: sim
    integer :: b

    where (sim%blocks%handling%lowering_speed > 0.0_wp) sim%blocks%fixed = &
      sim%blocks%status == lowering
    do b = 1, sim%blocks%n
      if (hangs(b, sim%blocks)) sim%blocks%fixed(b) = .false.
      if (sim%light%on .and. sim%clock%step > 0 .and. sim%blocks%present(b) &
          .and. .not. sim%blocks%fixed(b)) call load_block(b, sim%light, sim%blocks)
      if (hangs(b, sim%blocks)) call brace(sim%clock%dt, b, sim%blocks)
    end do
    if (sim%clock%step > 0) sim%initialised = sim%blocks%present
    if (.not. sim%wet) return
    call update_solid(sim%fraction, sim%grid, sim%blocks, sim%solid)
    call fill_velocity_halo(sim%grid, sim%flow%u)
    call fill_scalar_halo(sim%grid, sim%flow%p)
    call fill_scalar_halo(sim%grid, sim%flow%liquid)
    call fill_scalar_halo(sim%grid, sim%flow%fluid_volume)
    call fill_scalar_halo(sim%grid, sim%flow%c)
    call mix_fluid(sim%case%fluid, sim%flow)
    call update_outflow(sim%grid, sim%case%fluid, sim%clock%dt, sim%flow%c, sim%flow%uf, &
                        sim%flow%sides, resumed=.true.)
  end subroutine resume

  !> Sums over the fluid before the first step of a run, or after a restart; of a run that begins,
  !! the energy that it has, too.
  subroutine measure(sim, report)
    type(simulation_t), intent(inout) :: sim
    type(step_report_t), intent(inout) :: report

    if (.not. sim%wet) return
    report%fluid = measure_fluid(sim%case%fluid, sim%grid, sim%flow, sim%solid)
    if (sim%clock%step == 0) then
      call put_in_energy(energies(sim, report%fluid, 0.0_wp), sim%energy)
      ! what the liquid sets free when it comes to lie level counts from the start
      sim%energy%set_free = sim%energy%parts%kinetic + max(0.0_wp, report%fluid%potential &
        - energy_of_level(sim%case%fluid, sim%grid, sim%flow%c))
    end if
    report%energy_excess = energy_excess(sim%energy)
  end subroutine measure

  !> Energies of fluid and blocks.
  function energies(sim, fluid, contact) result(parts)
    type(simulation_t), intent(in) :: sim
    type(fluid_sums_t), intent(in) :: fluid
    real(wp), intent(in) :: contact   !! elastic energy [J]
    type(energy_parts_t) :: parts

    parts%kinetic = fluid%kinetic + kinetic_energy(sim%blocks)
    parts%contact = contact
    parts%potential = fluid%potential + potential_energy(sim%case%fluid%gravity, sim%blocks)
  end function energies

end module simulation_m
