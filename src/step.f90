!> One time step of fluid and blocks, stage by stage.
!!
!! Stage, what it does, what it keeps to round-off or to the tolerance of a solver:
!!
!!     1  release      blocks whose time has come enter where there is room; the surface rises by
!!                     the volume that they displace; those past an open side go
!!                                                                         [volume of the liquid]
!!     2  time step    dt = min(C h/|u|, C h/|U|, waves, 2 dt_before), to the next release
!!     3  half kick    u += dt/2 (g - grad p/rho), in the liquid, on the bodies of the start
!!     4  bodies       m dv/dt = F_fluid + F_contact + m g, dL/dt = T, in substeps
!!                                                    [momentum; the energy of contact never grows]
!!     5  voxelise     alpha of the cells, open shares w of the faces at the new poses
!!                                                                  [sum alpha V = volume of bodies]
!!     6  fluxes       Q = dt w A u_f, fitted: sum Q = V_f - V (1 - alpha) in every cell
!!     7  advection    W -= sum G, V_f -= sum Q, m u -= sum (rho_l G + rho_g (Q - G)) u~
!!                                         [0 <= W <= V_f; liquid; momentum; a uniform velocity]
!!     8  mixture      C of W and V_f; rho = C rho_l + (1 - C) rho_g, mu likewise
!!     9  merging      one momentum for a small cut cell and the cells beside it
!!                                                                  [momentum of fluid and bodies]
!!     10 forces       a_f = (rho g - grad p + sigma kappa grad C)/rho at the faces; u += dt/2 a in
!!                     the liquid; the same forces push the bodies                   [still water]
!!     11 viscosity    (m/dt) (u* - u) = div mu grad u*, cells and bodies in one system
!!     12 faces        u_f = mean(u*) + dt (a_f - mean(a)): Rhie-Chow
!!     13 projection   div (w u_f - dt w grad phi/rho) + flux of the bodies = 0 with
!!                     dv = dt M^-1 int phi n dA, p += phi            [divergence below tolerance]
!!     14 closing      motion of the blocks by the sum of the forces, u_f of the next step
!!                                                                      [m dv/dt = sum of forces]
!!
!! With `physics = 'light'` only 1, 2 and 4 are done, in a water without flow (`light_m`).
!! With `momentum = 'c_ismac'` momentum waits in 7 and is carried in 11, and 3 only notes the
!! acceleration. With `coupling = 'mics'` an object of its own does 9 to 14 (`mass_average_m`).
!! docs/architecture.md has the files of each stage.
module step_m
  use kinds_m, only: wp
  use solid_geometry_m, only: solid_geometry_t, hand_over_faces
  use stage_m, only: stage_t
  use solid_fraction_m, only: update_solid
  use liquid_fill_m, only: raise_surface
  use fluid_transport_m, only: begin_carrying, carry_fluid, finish_carrying
  use liquid_transport_m, only: begin_transport
  use mixture_m, only: mix_fluid
  use outflow_m, only: update_outflow
  use rigid_body_m, only: follow_motions, look_ahead
  use contacts_m, only: move_blocks
  use block_record_m, only: update_record
  use ground_m, only: stands
  use overlap_m, only: max_overlap
  use deep_overlaps_m, only: ask_for_deep, store_points, warn_of_overlaps
  use release_m, only: release_due_blocks, let_go_lowered, take_out, next_release, nothing_to_come
  use diagnostics_m, only: step_report_t, fluid_sums_t, measure_fluid
  use energy_m, only: store_energy, put_in_energy, energy_excess
  use coupling_m, only: copy_motion, start_of_stages, motion_after_fluid
  use added_mass_m, only: update_added_mass
  use courant_m, only: courant_rate_t, courant_rate
  use simulation_m, only: simulation_t, energies
  use light_m, only: step_in_water, enter_water, store_water_force
  use wave_step_m, only: gravity_step, capillary_step, viscous_step
  use timers_m, only: tic, toc
  implicit none
  private
  public :: take_step, measure_overlap

  real(wp), parameter :: growth_max = 2.0_wp   !! of a step over the one before

contains

  !> Advance by one step.
  subroutine take_step(sim, report)
    type(simulation_t), intent(inout), target :: sim
    type(step_report_t), intent(out) :: report
    type(stage_t) :: stage
    real(wp) :: dt_before   ! of the last step [s]
    real(wp) :: next_let_go   ! when a lowered block will be let go [s]
    real(wp) :: cfl_carried   ! largest share of itself that a cell gives [-]
    real(wp) :: depth       ! [m]

    dt_before = sim%clock%dt
    ! 1 release
    call release(sim, report, next_let_go)
    ! 2 time step
    call choose_step(next_let_go, sim, report%cfl, cfl_carried)
    associate (case => sim%case, grid => sim%grid, flow => sim%flow, blocks => sim%blocks, &
               coupling => sim%coupling, dt => sim%clock%dt, scratch => sim%scratch, &
               liquid => sim%transport%liquid)
      ! 3 half kick
      if (sim%wet) call begin(sim, dt_before, report%inertia_clips)
      ! 4 bodies
      call tic('blocks')
      if (sim%light%on) call enter_water(case%fluid%gravity, dt, blocks, sim%initialised, sim%light)
      call move_blocks(sim%walls, case%fluid%gravity, dt, sim%contacts, blocks, report%contact)
      if (sim%light%on) call store_water_force(case%fluid%gravity, dt, blocks, sim%light)
      call toc('blocks')
      if (sim%wet) then
        ! 5 voxelise
        call tic('solid shares')
        call voxelise(sim)
        call toc('solid shares')
        ! 6 fluxes
        call tic('transport')
        call begin_carrying(cfl_carried, scratch, sim%transport)
        call begin_transport(grid, sim%before, sim%solid, dt, coupling%pressure%system%solver, &
                             liquid, flow)
        ! 7 advection
        call carry_fluid(case%fluid, grid, sim%before, sim%clock%step, flow, sim%transport)
        if (coupling%implicit_momentum) coupling%c_ismac%q = liquid%subcycles*liquid%volumes%q
        call finish_carrying(grid, sim%solid, flow, scratch, sim%transport)
        ! 8 mixture
        call mix_fluid(case%fluid, flow)
        call toc('transport')
        call tic('velocity and pressure')
        call update_outflow(grid, case%fluid, dt, flow%c, flow%uf, flow%sides)
        call start_of_stages(case%fluid%gravity, dt, blocks, coupling)
        stage = stage_t(sim%grid, sim%solid, sim%flow, sim%scratch, dt)
        ! 9 merging
        call coupling%average_momentum(stage)
        call coupling%build_pressure_system(stage)
        ! 10 forces
        call coupling%add_forces(stage)
        ! 11 viscosity
        call coupling%add_viscosity(stage)
        ! 12 faces
        call coupling%predict_faces(stage)
        ! 13 projection
        call coupling%project(stage)
        ! 14 closing
        call motion_after_fluid(case%fluid%gravity, dt, blocks, coupling)
        call coupling%close(stage, blocks)
        call toc('velocity and pressure')
      end if
    end associate
    sim%clock%t = sim%clock%t_next
    sim%clock%step = sim%clock%step + 1
    call describe(sim, report)
    report%overlap_known = .false.
    if (sim%clock%rows%due(sim%clock%t) .or. sim%clock%frames%due(sim%clock%t) &
        .or. sim%clock%finished()) then
      call measure_overlap(sim, report)
    else if (sim%contacts%exact) then
      call tic('blocks')   ! for warnings and faults only where bodies have deep contacts
      call ask_for_deep(sim%contacts%points, sim%blocks, sim%deep)
      call max_overlap(sim%walls, sim%blocks, sim%overlap, depth, sim%deep)
      call toc('blocks')
    end if
    if (.not. sim%contacts%exact) call store_points(sim%contacts%points, sim%deep)
    call warn_of_overlaps(sim%clock%t, sim%deep, report%warnings)
  end subroutine take_step

  !> How deep the true shapes are in one another, for rows, unless it is known.
  subroutine measure_overlap(sim, report)
    type(simulation_t), intent(inout) :: sim
    type(step_report_t), intent(inout) :: report

    if (report%overlap_known) return
    call tic('blocks')
    sim%deep%asked = .true.
    call max_overlap(sim%walls, sim%blocks, sim%overlap, report%max_overlap, sim%deep)
    call toc('blocks')
    report%overlap_known = .true.
  end subroutine measure_overlap

  !> What the parts of the step found out, in one report.
  subroutine describe(sim, report)
    type(simulation_t), intent(inout) :: sim
    type(step_report_t), intent(inout) :: report
    logical :: any_free, all_there   ! nothing else moves or is to come, but for lack of room

    any_free = .not. all(sim%blocks%fixed)
    call update_record(sim%clock%t, sim%clock%dt, sim%case%run%rest_speed, sim%blocks)
    all_there = any_free .and. nothing_to_come(sim%clock%t, sim%blocks)
    if (.not. all_there .or. maxval(sim%blocks%speed) >= sim%case%run%rest_speed) then
      sim%clock%rest_began = -1.0_wp
    else if (sim%clock%rest_began < 0.0_wp) then
      sim%clock%rest_began = sim%clock%t
    end if
    if (.not. sim%wet) return
    report%fluid = measure_fluid(sim%case%fluid, sim%grid, sim%flow, sim%solid)
    call store_energy(energies(sim, report%fluid, report%contact%energy), sim%energy)
    report%energy_excess = energy_excess(sim%energy)
    report%transport_parts = sim%transport%liquid%subcycles
    report%pressure = sim%coupling%pressure%report
    report%inertia_clips = report%inertia_clips + count(sim%coupling%bodies%clipped)
    report%curvature_fallback = sim%coupling%tension%surface%fallback
  end subroutine describe

  !> Blocks whose time has come enter, with the force and the pressure with which they begin to
  !! move; then those that have passed an open side go, whose place the fluxes fill.
  subroutine release(sim, report, next_let_go)
    type(simulation_t), intent(inout), target :: sim
    type(step_report_t), intent(inout) :: report
    real(wp), intent(out) :: next_let_go   !! when a lowered block will be let go, huge: none [s]
    type(fluid_sums_t) :: fluid
    logical :: released

    call follow_motions(sim%clock%t, sim%blocks)
    call release_due_blocks(sim%walls, sim%clock%t, sim%overlap, sim%blocks, report%warnings, &
                            released)
    call let_go_lowered(sim%walls, sim%case%fluid%gravity, sim%clock%t, sim%case%run%dt, &
                        sim%overlap, sim%blocks, next_let_go, report%warnings)
    if (sim%wet .and. released) then   ! the liquid in their place raises the free surface
      call voxelise(sim)
      call raise_surface(sim%grid, sim%before, sim%solid, sim%transport%liquid%extension, sim%flow)
      call mix_fluid(sim%case%fluid, sim%flow)
      fluid = measure_fluid(sim%case%fluid, sim%grid, sim%flow, sim%solid)
      call put_in_energy(energies(sim, fluid, sim%energy%parts%contact), sim%energy)
    end if
    if (sim%wet .and. any(sim%blocks%present .and. .not. sim%initialised)) call first_forces(sim)
    call take_out(sim%grid, sim%case%fluid%gravity, sim%clock%t, sim%blocks)
  end subroutine release

  !> A block that has just appeared gets the force of a fluid at rest in which it is let go; one
  !! that stands on something gets its buoyancy, and contact bears the rest. Later the forces are
  !! those of the step before.
  subroutine first_forces(sim)
    type(simulation_t), intent(inout), target :: sim
    real(wp) :: force(6, size(sim%coupling%total, 2))
    logical :: begins(sim%blocks%n), stand(sim%blocks%n)
    integer :: b

    associate (blocks => sim%blocks, bodies => sim%coupling%bodies)
      call copy_motion(blocks, bodies)
      begins = blocks%present .and. .not. sim%initialised
      do b = 1, blocks%n
        stand(b) = begins(b) .and. bodies%free(b) .and. all(abs(bodies%motion(:, b)) <= 0.0_wp)
        if (stand(b)) stand(b) = stands(sim%walls, blocks, b, sim%overlap)
      end do
      call sim%coupling%force_at_release(stage_t(sim%grid, sim%solid, sim%flow, sim%scratch, &
        sim%case%run%dt), begins .and. .not. stand, force)
      sim%start_converged = sim%start_converged .and. sim%coupling%pressure%report%converged
      do b = 1, blocks%n
        if (.not. begins(b)) cycle
        blocks%fluid_force(:, b) = force(1:3, b)
        blocks%fluid_torque(:, b) = force(4:6, b)
        sim%initialised(b) = .true.
        if (.not. stand(b)) cycle
        blocks%contact_force(:, b) = -(force(1:3, b) + blocks%mass(b)*sim%case%fluid%gravity)
        blocks%contact_torque(:, b) = -force(4:6, b)
      end do
    end associate
  end subroutine first_forces

  !> What acts before the transport, and what the later stages need of the start of the step.
  subroutine begin(sim, dt_before, n_clipped)
    type(simulation_t), intent(inout), target :: sim
    real(wp), intent(in) :: dt_before   !! [s]
    integer, intent(out) :: n_clipped   !! bodies whose added mass in impacts a limit cuts

    call copy_motion(sim%blocks, sim%coupling%bodies)
    call update_added_mass(sim%grid, sim%case%fluid, sim%solid, sim%coupling%bodies, sim%flow%c, &
                         sim%blocks, n_clipped)
    ! the impulse that is left of the last step, as a force over this one
    sim%blocks%lagged_force = dt_before/sim%clock%dt*sim%blocks%lagged_force
    call sim%coupling%begin(stage_t(sim%grid, sim%solid, sim%flow, sim%scratch, sim%clock%dt), &
      sim%blocks)
  end subroutine begin

  !> The blocks in the grid at their poses; where they were before stays in `sim%before`, whose
  !! links and effective aperture are not used.
  subroutine voxelise(sim)
    type(simulation_t), intent(inout) :: sim
    type(solid_geometry_t), allocatable :: keep

    call move_alloc(sim%solid, keep)
    call move_alloc(sim%before, sim%solid)
    call move_alloc(keep, sim%before)
    call hand_over_faces(sim%before, sim%solid)
    call update_solid(sim%fraction, sim%grid, sim%blocks, sim%solid)
  end subroutine voxelise

  !> Length of the step: `cfl_max` of liquid and blocks, `&run dt` and surface tension, or less to
  !! land on a release or on the end. With fluid at most `growth_max` times the step before, whose
  !! pressure and acceleration this one begins with.
  subroutine choose_step(next_let_go, sim, cfl, cfl_carried)
    real(wp), intent(in) :: next_let_go   !! when a lowered block will be let go [s]
    type(simulation_t), intent(inout) :: sim
    real(wp), intent(out) :: cfl           !! of liquid and blocks [-]
    real(wp), intent(out) :: cfl_carried   !! largest share of itself that a cell gives [-]
    type(courant_rate_t) :: rate
    real(wp) :: allowed, h

    allowed = sim%case%run%dt
    if (sim%wet .and. sim%clock%step > 0) allowed = min(allowed, growth_max*sim%clock%dt)
    if (sim%light%on) allowed = min(allowed, step_in_water(sim%case%fluid%gravity, sim%blocks, &
      sim%light))
    call look_ahead(allowed, sim%blocks)
    if (sim%wet) rate = courant_rate(sim%grid, sim%flow, sim%solid, sim%blocks)
    if (sim%case%run%cfl_max > 0.0_wp) then
      if (rate%followed > 0.0_wp) allowed = min(allowed, sim%case%run%cfl_max/rate%followed)
      if (rate%has_surface) then
        h = sim%grid%min_spacing()
        allowed = min(allowed, gravity_step(sim%case%fluid, h), capillary_step(sim%case%fluid, h), &
          viscous_step(sim%case%fluid, sim%grid%inverse_h2))
      end if
    end if
    call sim%clock%choose_step(allowed, min(next_let_go, next_release(sim%clock%t, sim%blocks)))
    cfl = sim%clock%dt*rate%followed
    cfl_carried = sim%clock%dt*rate%carried
  end subroutine choose_step

end module step_m
