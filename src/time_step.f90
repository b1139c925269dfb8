!> One step of fluid and blocks, in the order of the paper.
!!
!! The blocks move first, under the fluid force of the step before and in short substeps for
!! contact; then the liquid and the momentum are carried through the faces that the moving blocks
!! leave open; then pressure, viscosity and the rigid motions are solved together at the new place
!! of the blocks.
module time_step_m
  use kinds_m, only: wp
  use case_types_m, only: case_t
  use grid_m, only: grid_init
  use fields_m, only: flow_init
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init, hand_over_faces
  use solid_fraction_m, only: solid_fraction_t, solid_fraction_init, update_solid
  use liquid_fill_m, only: fill_liquid, raise_surface
  use initial_state_m, only: read_initial_liquid, read_initial_velocity
  use extended_fraction_m, only: extend_fraction
  use fluid_transport_m, only: fluid_transport_t, fluid_transport_init, carry_fluid, span_t
  use mixture_m, only: mix_fluid
  use outflow_m, only: outflow_init, start_outflow, update_outflow, resume_outflow
  use boundary_m, only: fill_velocity_halo, fill_scalar_halo, set_side_velocity
  use tet_mesh_m, only: shape_t
  use rigid_body_m, only: blocks_init, fastest_point, turn_with_fluid, kinetic_energy, &
                          potential_energy
  use walls_m, only: walls_t, walls_init
  use bed_m, only: bed_t
  use contacts_m, only: contacts_init, contact_report_t, move_blocks
  use lubrication_m, only: lubrication_init
  use overlap_m, only: overlap_t, overlap_init, max_overlap
  use release_m, only: release_due_blocks, next_release, none_to_come
  use diagnostics_m, only: step_report_t, fluid_sums_t, measure_fluid, energy_of_level
  use energy_m, only: energy_parts_t, energy_init, begin_energy, note_energy, note_release, &
                      energy_excess
  use velocity_stage_m, only: stage_t, stage_report_t, stage_init, copy_motion
  use monolithic_m, only: start_flow, begin_motion
  use buoyancy_m, only: displaced_force
  use added_mass_m, only: know_added_mass
  use coupling_m, only: advance_velocity, note_start
  use clock_m, only: clock_init
  use courant_m, only: courant_rate_t, courant_rate
  use run_state_m, only: run_state_t
  use wave_step_m, only: gravity_step, capillary_step
  use timers_m, only: timer, tic, toc
  implicit none
  private

  real(wp), parameter :: growth_max = 2.0_wp   !! of a step over the one before

  public :: simulation_t, simulation_init, resume, take_step, measure

  !> Everything that lives as long as the run.
  type, extends(run_state_t) :: simulation_t
    type(case_t) :: case
    type(solid_geometry_t), allocatable :: before    !! solids at the start of the step
    type(solid_fraction_t) :: fraction
    type(fluid_transport_t) :: transport
    type(stage_t) :: stage
    type(walls_t) :: walls
    type(overlap_t) :: overlap
    logical :: wet = .true.                !! there is a fluid
    logical :: start_converged = .true.    !! velocity and pressure at t = 0
    logical, allocatable :: felt(:)        !! blocks that have felt the fluid
    logical, allocatable :: waiting(:)     !! blocks that are due, found no room and were warned of
    integer :: timer_blocks = 0, timer_solid = 0, timer_transport = 0, timer_velocity = 0
  end type simulation_t

contains

  !> State at t = 0: bodies in place, liquid filled in, everything at rest or at its given velocity.
  subroutine simulation_init(case, shapes, bed, sim)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)
    type(bed_t), intent(in) :: bed
    type(simulation_t), intent(inout) :: sim
    integer :: d, n_solids

    sim%case = case
    sim%wet = case%run%physics /= 'dry'
    sim%timer_blocks = timer('blocks')
    sim%timer_solid = timer('solid shares')
    sim%timer_transport = timer('transport')
    sim%timer_velocity = timer('velocity and pressure')
    call clock_init(case%run, sim%clock)
    call grid_init(case%grid, case%boundary, sim%grid)
    call walls_init(case%grid, case%boundary, sim%walls)
    sim%walls%bed = bed
    call blocks_init(case, shapes, sim%blocks)
    call contacts_init(case%contact, sim%blocks, sim%contacts)
    call overlap_init(sim%blocks%shapes, sim%blocks%n, sim%overlap)
    allocate (sim%waiting(sim%blocks%n), sim%felt(sim%blocks%n), source=.false.)
    allocate (sim%solid, sim%before)
    if (.not. sim%wet) return
    call energy_init(case, sim%grid, sim%blocks, sim%energy)
    call turn_with_fluid(case%fluid%liquid_density, sim%blocks)
    if (case%contact%lubrication) call lubrication_init(case%fluid%liquid_viscosity, &
      sim%grid%h, sim%blocks, sim%contacts%lubrication)
    call flow_init(sim%grid, sim%flow)
    n_solids = sim%blocks%n
    if (bed%there) n_solids = n_solids + 1
    call solid_geometry_init(sim%grid, sim%solid, n_solids)
    call solid_geometry_init(sim%grid, sim%before, n_solids)
    call solid_fraction_init(sim%grid, sim%blocks, sim%fraction, &
                             merge(case%numerics%subcells, 0, &
                                   case%numerics%solid_fraction == 'subcell'), bed)
    call fluid_transport_init(case, sim%grid, sim%transport)
    call stage_init(sim%grid, n_solids, case%numerics, sim%stage)
    call update_solid(sim%fraction, sim%grid, sim%blocks, sim%solid)
    call fill_liquid(sim%grid, case%fluid, case%water, sim%solid, sim%flow)
    call read_initial_liquid(case%fluid, sim%grid, sim%flow)
    call extend_fraction(sim%grid, sim%solid, sim%transport%liquid%extension, sim%flow)
    call mix_fluid(case%fluid, sim%flow)
    do d = 1, 3
      sim%flow%u(:, :, :, d) = case%fluid%velocity(d)
      sim%flow%uf(:, :, :, d) = case%fluid%velocity(d)
    end do
    call fill_velocity_halo(sim%grid, sim%flow%u)
    call read_initial_velocity(case%fluid, sim%grid, sim%flow)
    call set_side_velocity(sim%grid, sim%flow%uf)
    call outflow_init(sim%grid, case%fluid, sim%flow%sides)
    call update_outflow(sim%grid, case%fluid, 0.0_wp, sim%flow%c, sim%flow%uf, sim%flow%sides)
    call copy_motion(sim%blocks, sim%stage%bodies)
    call start_flow(case, sim%grid, sim%solid, sim%flow, sim%stage, sim%start_converged)
    call start_outflow(sim%grid, sim%flow%c, sim%flow%uf, sim%flow%sides)
  end subroutine simulation_init

  !> What follows from the state after it was read: solids in the grid, density, halos, outflows.
  subroutine resume(sim)
    type(simulation_t), intent(inout) :: sim

    if (.not. sim%wet) return
    if (sim%clock%step > 0) sim%felt = sim%blocks%present
    call update_solid(sim%fraction, sim%grid, sim%blocks, sim%solid)
    call fill_velocity_halo(sim%grid, sim%flow%u)
    call fill_scalar_halo(sim%grid, sim%flow%p)
    call fill_scalar_halo(sim%grid, sim%flow%liquid)
    call fill_scalar_halo(sim%grid, sim%flow%room)
    call fill_scalar_halo(sim%grid, sim%flow%c)
    call mix_fluid(sim%case%fluid, sim%flow)
    call resume_outflow(sim%grid, sim%case%fluid, sim%clock%dt, sim%flow%c, sim%flow%uf, &
                        sim%flow%sides)
  end subroutine resume

  !> Advance by one step.
  subroutine take_step(sim, report)
    type(simulation_t), intent(inout) :: sim
    type(step_report_t), intent(out) :: report
    type(contact_report_t) :: contact
    type(stage_report_t) :: stage_report
    real(wp) :: dt_before   !! of the last step [s]

    dt_before = sim%clock%dt
    call release(sim, report)
    if (sim%wet) call first_force(sim)
    call choose_step(sim, report)
    associate (case => sim%case, grid => sim%grid, flow => sim%flow, blocks => sim%blocks, &
               dt => sim%clock%dt)
      if (sim%wet) then
        call copy_motion(blocks, sim%stage%bodies)
        call know_added_mass(grid, case%fluid, sim%solid, sim%stage%bodies, flow%c, blocks)
        call note_start(case, grid, sim%solid, dt, dt_before, flow, blocks, sim%stage)
      end if
      call tic(sim%timer_blocks)
      call move_blocks(sim%walls, case%fluid%gravity, dt, sim%contacts, blocks, contact)
      call max_overlap(sim%walls, blocks, sim%overlap, report%max_overlap)
      call toc(sim%timer_blocks)
      if (sim%wet) then
        call tic(sim%timer_solid)
        call swap_solids(sim)
        call update_solid(sim%fraction, grid, blocks, sim%solid)
        call toc(sim%timer_solid)
        call tic(sim%timer_transport)
        call carry_fluid(case, grid, sim%before, sim%solid, &
                         span_t(dt, report%cfl_carried, sim%clock%step), flow, &
                         sim%stage%viscous, sim%stage%pressure, sim%transport)
        if (sim%stage%implicit_momentum) sim%stage%c_ismac%q = sim%transport%liquid%parts &
                                                               *sim%transport%liquid%volumes%q
        call toc(sim%timer_transport)
        call tic(sim%timer_velocity)
        call update_outflow(grid, case%fluid, dt, flow%c, flow%uf, flow%sides)
        call advance_velocity(case, grid, sim%solid, dt, flow, blocks, sim%stage, &
                              stage_report)
        call toc(sim%timer_velocity)
      end if
    end associate
    call sim%clock%advance()
    call tell(sim, contact, stage_report, report)
  end subroutine take_step

  !> What the parts of the step found out, in one report.
  subroutine tell(sim, contact, stage, report)
    type(simulation_t), intent(inout) :: sim
    type(contact_report_t), intent(in) :: contact
    type(stage_report_t), intent(in) :: stage
    type(step_report_t), intent(inout) :: report
    real(wp) :: speed
    logical :: any_free
    integer :: b

    report%contact_energy = contact%energy
    report%contact_courant_max = contact%courant_max
    report%substeps = contact%substeps
    report%contacts_solved = contact%info == 0
    speed = 0.0_wp
    any_free = .false.
    do b = 1, sim%blocks%n
      if (.not. sim%blocks%present(b) .or. sim%blocks%fixed(b)) cycle
      any_free = .true.
      speed = max(speed, fastest_point(sim%blocks, b))
    end do
    call sim%clock%note_speed(speed, any_free .and. none_to_come(sim%clock%t, sim%blocks))
    if (.not. sim%wet) return
    report%divergence_max = stage%pressure%divergence
    report%pressure_passes = stage%pressure%passes
    report%solver_iterations = stage%pressure%iterations
    report%pressure_converged = stage%pressure%converged
    report%viscous_converged = stage%viscous_converged
    report%fluid = measure_fluid(sim%case%fluid, sim%grid, sim%flow, sim%solid)
    call note_energy(parts_of(sim, report%fluid, report%contact_energy), sim%energy)
    report%energy_excess = energy_excess(sim%energy)
    report%transport_parts = sim%transport%liquid%parts
    report%transport_converged = sim%transport%liquid%small%converged
    report%sealed_cells = sim%solid%n_sealed
    report%curvature_fallback = sim%stage%tension%surface%fallback
  end subroutine tell

  !> Sums over the fluid before the first step of a run, or after a restart; of a run that begins,
  !! the energy that it has, too.
  subroutine measure(sim, report)
    type(simulation_t), intent(inout) :: sim
    type(step_report_t), intent(inout) :: report

    if (.not. sim%wet) return
    report%fluid = measure_fluid(sim%case%fluid, sim%grid, sim%flow, sim%solid)
    if (sim%clock%step == 0) call begin_energy(parts_of(sim, report%fluid, 0.0_wp), &
      report%fluid%potential - energy_of_level(sim%case%fluid, sim%grid, sim%flow%c), sim%energy)
    report%energy_excess = energy_excess(sim%energy)
  end subroutine measure

  !> Energies of fluid and blocks.
  function parts_of(sim, fluid, contact) result(parts)
    type(simulation_t), intent(in) :: sim
    type(fluid_sums_t), intent(in) :: fluid
    real(wp), intent(in) :: contact   !! elastic energy [J]
    type(energy_parts_t) :: parts

    parts%kinetic = fluid%kinetic + kinetic_energy(sim%blocks)
    parts%contact = contact
    parts%potential = fluid%potential + potential_energy(sim%case%fluid%gravity, sim%blocks)
  end function parts_of

  !> Blocks whose time has come; the liquid in their place raises the free surface.
  subroutine release(sim, report)
    type(simulation_t), intent(inout) :: sim
    type(step_report_t), intent(inout) :: report
    type(fluid_sums_t) :: fluid
    logical :: released

    call release_due_blocks(sim%walls, sim%clock%t, sim%overlap, sim%blocks, sim%waiting, &
                            report%warnings, released)
    if (.not. released .or. .not. sim%wet) return
    call swap_solids(sim)
    call update_solid(sim%fraction, sim%grid, sim%blocks, sim%solid)
    call raise_surface(sim%grid, sim%before, sim%solid, sim%transport%liquid%extension, sim%flow)
    call mix_fluid(sim%case%fluid, sim%flow)
    fluid = measure_fluid(sim%case%fluid, sim%grid, sim%flow, sim%solid)
    call note_release(parts_of(sim, fluid, sim%energy%parts%contact), sim%energy)
  end subroutine release

  !> A block that has just appeared feels what a fluid at rest does to it when it is let go; after
  !! each step the fluid force of that step takes over.
  subroutine first_force(sim)
    type(simulation_t), intent(inout) :: sim
    integer :: b

    if (all(sim%felt .or. .not. sim%blocks%present)) return
    call copy_motion(sim%blocks, sim%stage%bodies)
    associate (force => sim%stage%total)
      if (sim%case%numerics%coupling == 'monolithic') then
        call begin_motion(sim%case, sim%grid, sim%solid, sim%blocks%present .and. .not. sim%felt, &
                          sim%flow, sim%stage, force)
      else
        call displaced_force(sim%grid, sim%case%fluid, sim%solid, sim%stage%bodies, sim%flow%c, &
                             force)
      end if
      do b = 1, sim%blocks%n
        if (sim%felt(b) .or. .not. sim%blocks%present(b)) cycle
        sim%blocks%fluid_force(:, b) = force(1:3, b)
        sim%blocks%fluid_torque(:, b) = force(4:6, b)
        sim%felt(b) = .true.
      end do
    end associate
  end subroutine first_force

  !> The present solids become those of the start of the step. Of these nobody asks for the legs
  !! and the free share, which stay with the present ones.
  subroutine swap_solids(sim)
    type(simulation_t), intent(inout) :: sim
    type(solid_geometry_t), allocatable :: keep

    call move_alloc(sim%solid, keep)
    call move_alloc(sim%before, sim%solid)
    call move_alloc(keep, sim%before)
    call hand_over_faces(sim%before, sim%solid)
  end subroutine swap_solids

  !> Length of the step: `cfl_max` of liquid and blocks, `&run dt` and surface tension, or less to
  !! land on a release or on the end. With fluid at most `growth_max` times the step before, whose
  !! pressure and acceleration this one begins with.
  subroutine choose_step(sim, report)
    type(simulation_t), intent(inout) :: sim
    type(step_report_t), intent(inout) :: report
    type(courant_rate_t) :: rate
    real(wp) :: allowed, h

    allowed = sim%case%run%dt
    if (sim%wet .and. sim%clock%step > 0) allowed = min(allowed, growth_max*sim%clock%dt)
    if (sim%wet) rate = courant_rate(sim%grid, sim%flow, sim%solid, sim%blocks)
    if (sim%case%run%cfl_max > 0.0_wp) then
      if (rate%followed > 0.0_wp) allowed = min(allowed, sim%case%run%cfl_max/rate%followed)
      if (rate%has_surface) then
        h = sim%grid%least_spacing()
        allowed = min(allowed, gravity_step(sim%case%fluid, h), capillary_step(sim%case%fluid, h))
      end if
    end if
    call sim%clock%choose_step(allowed, next_release(sim%clock%t, sim%blocks))
    report%cfl = sim%clock%dt*rate%followed
    report%cfl_carried = sim%clock%dt*rate%carried
  end subroutine choose_step

end module time_step_m
