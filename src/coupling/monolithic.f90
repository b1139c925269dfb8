!> The monolithic coupling: pressure and the motion of the bodies in one solve.
!!
!! Fluid moves through the open part of a face, bodies push through the rest (Batty, Bertails &
!! Bridson 2007). The added mass is implicit, the velocity is free of divergence and rigid in the
!! bodies at once. Departure from the paper, whose mass average (`mass_average_m`) thickens the
!! body: how a released sphere starts depends on the step there, by 5 % to 20 %; here it is within
!! 2 % of theory at steps of 0.25 to 4 ms (docs/decisions/coupling.md).
module monolithic_m
  use kinds_m, only: wp
  use swap_m, only: swap
  use case_types_m, only: case_t
  use grid_m, only: grid_t, n_halo
  use fields_m, only: flow_t, add_product
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t, set_inertia, wall_velocity
  use rigid_flux_m, only: build_rigid_flux, force_from_faces, all_fluid_of_faces, arm_to_cell
  use viscous_legs_m, only: build_viscous
  use wall_shear_m, only: find_wall_speeds
  use pressure_system_m, only: set_pressure_system
  use pressure_m, only: solve_pressure, pressure_report_t
  use pressure_extension_m, only: extend_pressure
  use face_velocity_m, only: face_acceleration, cell_mean_of_faces, hold_in_cells, &
                             predict_face_velocity
  use wall_faces_m, only: face_velocity_at_walls, shorten_at_walls
  use mid_step_m, only: find_liquid, add_second_half, add_whole
  use buoyancy_m, only: displaced_force, uncounted_fluid
  use linked_cells_m, only: linked_cells_t, link_cells, match_densities
  use group_momentum_m, only: share_momentum, share_acceleration, follow_masters
  use wall_layer_m, only: find_slip
  use centre_velocity_m, only: find_centres, to_centres, to_means
  use wall_balance_m, only: begin_balance, note_change, note_velocity, force_of_walls, &
    force_of_mid_step
  use surface_stress_m, only: surface_stress
  use surface_tension_m, only: add_tension, force_from_tension
  use velocity_stage_m, only: stage_t, stage_report_t, push_bodies, accelerate_cells, &
    predict_velocity, renew_acceleration, find_surface_force, return_surface_force
  use boundary_m, only: fill_velocity_halo
  use parallel_m, only: halo_exchange
  implicit none
  private
  public :: monolithic_stage, start_flow, begin_motion

contains

  !> Pressure and rigid motions in one solve, after the implicit viscous stage.
  subroutine monolithic_stage(case, grid, solid, dt, flow, stage, report)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt   !! [s]
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage
    type(stage_report_t), intent(inout) :: report

    stage%dry_motion = stage%bodies%motion
    call link_cells(grid, solid, stage%links)
    call begin_balance(case%fluid, stage%links, flow, stage%balance)
    call find_inertia(grid, stage%links, stage%balance%mass, flow, stage%rho)
    call match_densities(grid, stage%rho, stage%links)
    call find_slip(grid, solid, stage%at_start, flow%u, stage%links)
    call note_velocity(grid, stage%links, flow%u, stage%balance%before)
    call share_momentum(grid, stage%links, stage%balance%mass, stage%at_start, &
                        stage%balance%before, flow%u, stage%balance%to_wall)
    call find_wall_speeds(grid, solid, stage%at_start, flow%u, stage%wall_speed)
    associate (system => stage%pressure%system)
      call set_pressure_system(grid, solid%free, stage%rho, system, flow%sides)
      call build_rigid_flux(grid, solid, stage%bodies, system%active, system%operator%flux)
    end associate
    call find_surface_force(case%fluid, grid, solid, flow%c, stage)
    call accelerate_fluid(case, grid, solid, dt, flow, stage)
    call push_by_known_forces(case, grid, solid, dt, flow, stage)
    call return_surface_force(stage)
    call add_viscosity(grid, solid, dt, flow, stage)
    call predict_faces(grid, solid, dt, flow, stage)
    call find_pressure(grid, solid, dt, flow, stage, report)
    call extend_pressure(grid, case%fluid%gravity, flow%rho, solid%alpha, &
                         stage%pressure%system%active, stage%pressure%known, &
                         stage%pressure%closed, flow%p)
    call sum_forces(dt, stage)
    report%viscous_converged = stage%viscous%converged
  end subroutine monolithic_stage

  !> Density with which the fluid resists an acceleration. Weight has that of the level at which a
  !! cell lies, bodies thought away, so that still water stays still; inertia in a cut cell that of
  !! the fluid in its open part.
  subroutine find_inertia(grid, links, mass, flow, rho)
    type(grid_t), intent(in) :: grid
    type(linked_cells_t), intent(in) :: links
    real(wp), intent(in) :: mass(:)   !! of the fluid in the cells at walls [kg]
    type(flow_t), intent(in) :: flow
    real(wp), intent(inout), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), parameter :: least_room = 1.0e-3_wp   !! of a cell with a density of its own
    integer :: k, m

    !$omp parallel do schedule(static)
    do k = grid%first(3), grid%last(3)
      rho(:, :, k) = flow%rho(:, :, k)
    end do
    do m = 1, links%n
      associate (c => links%cell(:, m))
        associate (room => flow%room(c(1), c(2), c(3)))
          if (room > least_room*grid%volume) rho(c(1), c(2), c(3)) = mass(m)/room
        end associate
      end associate
    end do
  end subroutine find_inertia

  !> Weight, old pressure, surface tension and surface stress into the velocity of the cells in
  !! liquid; those at the surface and in gas get the first three after the faces.
  subroutine accelerate_fluid(case, grid, solid, dt, flow, stage)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage

    ! `y` is free until the viscous stage.
    associate (a => stage%acceleration, by_stress => stage%viscous%y)
      call face_acceleration(grid, case%fluid%gravity, flow%rho, stage%rho, flow%p, a%face, &
                             flow%sides)
      call add_tension(grid, stage%rho, stage%tension, a%face)
      stage%counted = stage%at_start%motion + stage%trend
      call accelerations_of_groups(grid, solid, dt, stage%trend, stage)
      if (stage%implicit_momentum) call fill_velocity_halo(grid, flow%u)   ! groups have shared
      call surface_stress(grid, solid%alpha, stage%rho, flow%mu, flow%u, by_stress)
      if (stage%implicit_momentum) then
        call accelerate_cells(grid, dt, flow, stage)
      else
        call add_second_half(grid, dt, a%cell, stage%mid_step, flow%u)
      end if
      call add_product(grid, dt, by_stress, flow%u)
      if (.not. allocated(stage%mid_step%given)) return   ! nothing has been given before
      call force_of_mid_step(grid, case%fluid, stage%links_before, stage%links, stage%bodies, dt, &
                             flow, a%cell, stage%mid_step, stage%from_mid_step)
      call swap(stage%viscous%leg, stage%mid_step%given)
    end associate
  end subroutine accelerate_fluid

  !> Accelerations of the cells from those of the faces, and what groups make of them.
  subroutine accelerations_of_groups(grid, solid, dt, change, stage)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt
    real(wp), intent(in) :: change(:, :)   !! (6, bodies) of their motion that held fluid gets
    type(stage_t), intent(inout) :: stage

    associate (a => stage%acceleration, balance => stage%balance)
      call cell_mean_of_faces(grid, solid%open, a%face, a%cell)
      call hold_in_cells(grid, solid, stage%bodies, change/dt, a%face, a%cell)
      call note_change(grid, stage%links, dt, a%cell, balance%pushed)
      call halo_exchange(a%cell, n_halo)
      call share_acceleration(grid, solid%open, stage%rho, stage%links, a%cell)
      call note_change(grid, stage%links, dt, a%cell, balance%gained)
    end associate
  end subroutine accelerations_of_groups

  !> The same forces on the bodies.
  subroutine push_by_known_forces(case, grid, solid, dt, flow, stage)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt
    type(flow_t), intent(in) :: flow
    type(stage_t), intent(inout) :: stage

    associate (bodies => stage%bodies, flux => stage%pressure%system%operator%flux)
      call force_from_faces(grid, bodies, flux, flow%p, stage%from_pressure, flow%sides)
      call force_from_tension(grid, bodies, flux, stage%tension, stage%from_pressure)
      stage%lack = uncounted_fluid(grid, case%fluid, solid, bodies, flux, flow)
      call count_fluid(case%fluid%gravity, dt, stage)
      stage%from_level = stage%from_level + stage%from_mid_step + stage%late
      call push_bodies(dt, stage%from_pressure + stage%from_level, bodies)
    end associate
  end subroutine push_by_known_forces

  !> Viscosity, in cells and bodies at once.
  subroutine add_viscosity(grid, solid, dt, flow, stage)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage

    associate (bodies => stage%bodies, viscous => stage%viscous, links => stage%links, &
               balance => stage%balance)
      call fill_velocity_halo(grid, flow%u)
      call note_velocity(grid, links, flow%u, balance%before)
      if (.not. stage%implicit_momentum) then   ! that carries the mean in the same solve
        call find_centres(grid, solid, stage%at_start, flow%u, links)
        call to_centres(grid, links, stage%at_start, flow%u)
      end if
      call build_viscous(grid, solid, bodies, stage%rho, flow%mu, dt, viscous, links, &
                         stage%wall_speed)
      call predict_velocity(grid, stage%rho, flow, stage)
      call to_means(grid, links, stage%at_start, flow%u)
      call fill_velocity_halo(grid, flow%u, layers=1)
      call follow_masters(grid, links, balance%mass, balance%before, flow%u, balance%to_wall)
      ! To round-off the motion that the forces give, not that of the solver.
      bodies%motion = stage%dry_motion
      call push_bodies(dt, stage%from_pressure + stage%from_level + viscous%force, bodies)
      call impose_rigid_velocity(grid, solid, links, bodies, flow%u)
    end associate
  end subroutine add_viscosity

  !> Velocity of the faces before the pressure stage.
  subroutine predict_faces(grid, solid, dt, flow, stage)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage

    stage%foreseen%x = stage%bodies%x
    stage%foreseen%motion = stage%at_start%motion + stage%trend
    call fill_velocity_halo(grid, flow%u, layers=1)
    call halo_exchange(stage%acceleration%cell, n_halo, layers=1)
    associate (a => stage%acceleration, links => stage%links, &
               given => stage%mid_step%takes_part, in_liquid => stage%mid_step%in_liquid)
      call find_liquid(grid, flow, in_liquid, among=given)   ! the surface may have come
      if (stage%implicit_momentum) then
        call predict_face_velocity(grid, dt, stage%rho, a, flow)
      else
        call predict_face_velocity(grid, dt, stage%rho, a, flow, stage%deviation, given, in_liquid)
        if (allocated(stage%deviation)) call swap(flow%solid_flux, stage%deviation)
        call shorten_at_walls(grid, dt, stage%bodies, links%cell(:, :links%n), links%body, &
                              links%number, in_liquid, stage%rho, a, flow)
      end if
      call face_velocity_at_walls(grid, solid, stage%at_start, stage%foreseen, links%slip, dt, &
                                  stage%implicit_momentum, given, in_liquid, stage%rho, a, flow)
      if (stage%implicit_momentum) then
        call renew_acceleration(dt, flow, stage)
      else
        call add_whole(grid, dt, a%cell, stage%mid_step, flow%u)
      end if
    end associate
  end subroutine predict_faces

  !> Pressure and motion of the bodies in one solve. What the fluid at the walls owes the bodies
  !! (`wall_balance_m`) is known only afterwards: free bodies get it, and the pressure follows in a
  !! second solve; the little that this one changes of it is left to the next step.
  subroutine find_pressure(grid, solid, dt, flow, stage, report)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage
    type(stage_report_t), intent(inout) :: report
    real(wp) :: from_faces(6, stage%bodies%n), from_walls(6, stage%bodies%n)
    integer :: solve, b

    stage%total = 0.0_wp
    associate (bodies => stage%bodies, links => stage%links, balance => stage%balance, &
               pressure => stage%pressure)
      do solve = 1, 2
        pressure%rough = solve == 1 .and. any(bodies%free)
        call solve_pressure(grid, solid, stage%rho, dt, flow, bodies, pressure)
        report%pressure = added(report%pressure, pressure%report)
        call correct_cells(grid, solid, dt, flow, stage)
        call force_from_faces(grid, bodies, pressure%system%operator%flux, pressure%phi_total, &
                              from_faces)
        stage%total = stage%total + from_faces
        call force_of_walls(grid, solid, links, bodies, stage%at_start, dt, stage%rho, balance, &
                            from_walls)
        if (solve == 1) then
          stage%late = from_walls
          if (.not. any(bodies%free)) exit
          call push_bodies(dt, stage%late, bodies)
        end if
      end do
      stage%total = stage%total + stage%late
      do b = 1, bodies%n
        stage%late(:, b) = merge(from_walls(:, b) - stage%late(:, b), 0.0_wp, bodies%free(b))
      end do
      call impose_rigid_velocity(grid, solid, links, bodies, flow%u)
      call fill_velocity_halo(grid, flow%u)
    end associate
  end subroutine find_pressure

  !> Report of two solves of a step.
  pure function added(first, second) result(both)
    type(pressure_report_t), intent(in) :: first, second
    type(pressure_report_t) :: both

    both = second
    both%passes = first%passes + second%passes
    both%iterations = first%iterations + second%iterations
  end function added

  !> What the new pressure does to the cells.
  subroutine correct_cells(grid, solid, dt, flow, stage)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage
    real(wp), parameter :: weightless(3) = 0.0_wp

    associate (a => stage%acceleration)
      call face_acceleration(grid, weightless, stage%rho, stage%rho, stage%pressure%phi_total, &
                             a%face, flow%sides)
      call accelerations_of_groups(grid, solid, dt, stage%bodies%motion - stage%counted, stage)
      stage%counted = stage%bodies%motion
      call add_product(grid, dt, a%cell, flow%u)
    end associate
  end subroutine correct_cells

  !> Force and torque of the step on each body, the inertia of the fluid that no face counts
  !! included, by the acceleration that the solve has found.
  subroutine sum_forces(dt, stage)
    real(wp), intent(in) :: dt
    type(stage_t), intent(inout) :: stage
    integer :: b

    associate (bodies => stage%bodies)
      stage%total = stage%total + stage%from_pressure + stage%from_level + stage%viscous%force
      do b = 1, bodies%n
        if (.not. bodies%free(b)) cycle
        stage%total(:, b) = stage%total(:, b) + &
          matmul(bodies%lack(:, :, b), bodies%motion(:, b) - stage%dry_motion(:, b))/dt
      end do
    end associate
  end subroutine sum_forces

  !> Give the bodies the inertia of the fluid that the faces do not count, and `from_level` its
  !! force as far as it is known before the solve: -lack (g - a), a by weight and contact.
  subroutine count_fluid(gravity, dt, stage)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: dt           !! [s]
    type(stage_t), intent(inout) :: stage
    real(wp) :: lack(6, 6)
    integer :: b

    do b = 1, size(stage%lack, 3)
      stage%from_level(:, b) = -matmul(stage%lack(:, :, b), gravity)
      if (.not. stage%bodies%free(b)) cycle
      lack = 0.0_wp
      lack(:, 1:3) = stage%lack(:, :, b)
      lack(1:3, 4:6) = transpose(lack(4:6, 1:3))
      call set_inertia(b, stage%bodies, lack)
      stage%from_level(:, b) = stage%from_level(:, b) + &
        matmul(stage%bodies%lack(:, :, b), &
               stage%bodies%motion(:, b) - stage%at_start%motion(:, b))/dt
    end do
  end subroutine count_fluid

  !> Face velocity of the start made free of divergence, and the pressure of the fluid under gravity
  !! around bodies held in place, so that the first step starts from a balance.
  subroutine start_flow(case, grid, solid, flow, stage, converged)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage
    logical, intent(out) :: converged
    type(rigid_motion_t) :: held
    real(wp), allocatable :: uf(:, :, :, :)

    held = stage%bodies
    held%free = .false.
    associate (p => stage%pressure, system => stage%pressure%system, a => stage%acceleration, &
               dt => case%run%dt)
      call set_pressure_system(grid, solid%free, flow%rho, system, flow%sides)
      call build_rigid_flux(grid, solid, held, system%active, system%operator%flux)
      call solve_pressure(grid, solid, flow%rho, dt, flow, held, p)
      converged = p%report%converged
      allocate (uf, source=flow%uf)
      held%motion = 0.0_wp
      flow%p = 0.0_wp
      call face_acceleration(grid, case%fluid%gravity, flow%rho, flow%rho, flow%p, a%face, &
                             flow%sides)
      call find_surface_force(case%fluid, grid, solid, flow%c, stage)
      call add_tension(grid, flow%rho, stage%tension, a%face)
      call return_surface_force(stage)
      flow%uf = dt*a%face
      call solve_pressure(grid, solid, flow%rho, dt, flow, held, p)
      converged = converged .and. p%report%converged
      call extend_pressure(grid, case%fluid%gravity, flow%rho, solid%alpha, system%active, &
                           p%known, p%closed, flow%p)
      flow%uf = uf
      call all_fluid_of_faces(grid, solid, stage%bodies, system%operator%flux, flow%uf, &
                              flow%solid_flux)
    end associate
  end subroutine start_flow

  !> Force and torque of the fluid on bodies that are let go, with the pressure by which they
  !! accelerate it, which is added to the pressure: (M + M_a) a = (M - M_displaced) g.
  subroutine begin_motion(case, grid, solid, begins, flow, stage, force)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    logical, intent(in) :: begins(:)         !! (blocks) those let go; all others are held
    type(flow_t), intent(inout) :: flow      !! only its pressure changes
    type(stage_t), intent(inout) :: stage    !! its bodies in place
    real(wp), intent(out) :: force(:, :)     !! (6, bodies), of those let go [N, N m]
    real(wp), parameter :: weightless(3) = 0.0_wp
    real(wp), allocatable :: uf(:, :, :, :), solid_flux(:, :, :, :)
    type(rigid_motion_t) :: moving
    real(wp) :: a(6)
    integer :: b

    moving = stage%bodies
    allocate (uf, source=flow%uf)
    allocate (solid_flux, source=flow%solid_flux)
    call displaced_force(grid, case%fluid, solid, stage%bodies, flow%c, force)
    associate (bodies => stage%bodies, system => stage%pressure%system, dt => case%run%dt)
      bodies%motion = 0.0_wp
      do b = 1, bodies%n
        bodies%free(b) = .false.
        if (b <= size(begins)) bodies%free(b) = moving%free(b) .and. begins(b)
        force(1:3, b) = force(1:3, b) + bodies%mass(b)*case%fluid%gravity
      end do
      stage%at_start = bodies
      call set_pressure_system(grid, solid%free, flow%rho, system, flow%sides)
      call build_rigid_flux(grid, solid, bodies, system%active, system%operator%flux)
      stage%lack = uncounted_fluid(grid, case%fluid, solid, bodies, system%operator%flux, flow)
      call count_fluid(weightless, dt, stage)
      call push_bodies(dt, force, bodies)
      flow%uf = 0.0_wp
      stage%pressure%rough = .false.
      call solve_pressure(grid, solid, flow%rho, dt, flow, bodies, stage%pressure)
      do b = 1, bodies%n
        a = bodies%motion(:, b)/dt
        force(1:3, b) = bodies%mass(b)*(a(1:3) - case%fluid%gravity)
        force(4:6, b) = matmul(bodies%inertia(:, :, b), a(4:6))
      end do
      call extend_pressure(grid, case%fluid%gravity, flow%rho, solid%alpha, system%active, &
                           stage%pressure%known, stage%pressure%closed, flow%p)
    end associate
    stage%bodies = moving
    call move_alloc(uf, flow%uf)
    call move_alloc(solid_flux, flow%solid_flux)
  end subroutine begin_motion

  !> Cells in a body that hold no film move with it.
  subroutine impose_rigid_velocity(grid, solid, links, bodies, u)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(linked_cells_t), intent(in) :: links
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    integer :: i, j, k, b
    real(wp) :: arm(3)

    !$omp parallel do private(i, j, b, arm) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        if (maxval(solid%inside(grid%lo(1):grid%hi(1), j, k)) == 0) cycle
        do i = grid%lo(1), grid%hi(1)
          b = solid%inside(i, j, k)
          if (b == 0 .or. links%number(i, j, k) > 0) cycle
          arm = arm_to_cell(grid, [i, j, k], bodies%x(:, b))
          u(i, j, k, :) = wall_velocity(bodies%motion(:, b), arm)
        end do
      end do
    end do
  end subroutine impose_rigid_velocity

end module monolithic_m
