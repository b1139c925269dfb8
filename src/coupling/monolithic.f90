!> The monolithic coupling: pressure and the motion of the bodies in one solve.
!!
!! Fluid moves through the open part of a face, bodies push through the rest (Batty, Bertails &
!! Bridson 2007). The added mass is implicit, the velocity is free of divergence and rigid in the
!! bodies at once. Departure from the paper, whose mass average (`mass_average_m`) thickens the
!! body: how a released sphere starts depends on the step there, by 5 % to 20 %; here it is within
!! 2 % of theory at steps of 0.25 to 4 ms (docs/decisions/coupling.md).
module monolithic_m
  use kinds_m, only: wp
  use case_types_m, only: case_t
  use grid_m, only: grid_t, n_halo
  use fields_m, only: flow_t, add_product
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t, set_inertia, wall_velocity
  use rigid_flux_m, only: build_rigid_flux, force_from_faces, solid_face_flux, nearest_arm
  use viscous_legs_m, only: build_viscous
  use pressure_system_m, only: set_pressure_system
  use pressure_m, only: solve_pressure
  use pressure_extension_m, only: extend_pressure
  use face_velocity_m, only: face_acceleration, cell_mean_of_faces, predict_face_velocity, &
                             face_velocity_at_walls
  use buoyancy_m, only: uncounted_fluid
  use film_velocity_m, only: shift_films, tie_films
  use momentum_return_m, only: return_momentum
  use surface_stress_m, only: surface_stress
  use surface_tension_m, only: find_tension, add_tension, force_from_tension
  use velocity_stage_m, only: stage_t, stage_report_t, push_bodies, accelerate_cells, &
    predict_velocity, renew_acceleration
  use boundary_m, only: fill_velocity_halo
  use parallel_m, only: halo_exchange
  implicit none
  private
  public :: monolithic_stage, start_flow

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

    stage%debt%u_before = flow%u
    stage%dry_motion = stage%bodies%motion
    associate (system => stage%pressure%system)
      call set_pressure_system(grid, solid%open, flow%rho, system, flow%sides)
      call build_rigid_flux(grid, solid, stage%bodies, system%active, system%operator%flux)
    end associate
    call accelerate_fluid(case, grid, solid, dt, flow, stage)
    call push_by_known_forces(case, grid, solid, dt, flow, stage)
    call add_viscosity(grid, solid, dt, flow, stage)
    call predict_faces(grid, solid, dt, flow, stage)
    call solve_pressure(grid, solid, flow%rho, dt, flow, stage%bodies, stage%pressure)
    call correct_cells(case, grid, solid, dt, flow, stage)
    call extend_pressure(grid, case%fluid%gravity, flow%rho, stage%pressure%system%active, &
                         stage%pressure%known, flow%p)
    call sum_forces(grid, solid, dt, stage)
    report%pressure = stage%pressure%report
    report%viscous_iterations = stage%viscous%iterations
    report%viscous_converged = stage%viscous%converged
  end subroutine monolithic_stage

  !> Weight, old pressure, surface tension and surface stress into the velocity of the cells.
  subroutine accelerate_fluid(case, grid, solid, dt, flow, stage)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage

    associate (a => stage%acceleration)
      call face_acceleration(grid, case%fluid%gravity, flow%rho, flow%rho, flow%p, a%face, &
                             flow%sides)
      call add_tension(grid, flow%rho, stage%tension, a%face)
      call cell_mean_of_faces(grid, solid%open, a%face, a%cell)
    end associate
    call surface_stress(grid, solid%alpha, flow%rho, flow%mu, flow%u, stage%a_stress)
    call accelerate_cells(grid, dt, flow, stage)
    call add_product(grid, dt, stage%a_stress, flow%u)
  end subroutine accelerate_fluid

  !> The same forces on the bodies.
  subroutine push_by_known_forces(case, grid, solid, dt, flow, stage)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt
    type(flow_t), intent(in) :: flow
    type(stage_t), intent(inout) :: stage

    associate (bodies => stage%bodies, flux => stage%pressure%system%operator%flux)
      call force_from_faces(grid, solid, bodies, flux, flow%p, stage%from_pressure, flow%sides)
      call force_from_tension(grid, solid, bodies, flux, stage%tension, stage%terms, &
                              stage%from_pressure)
      stage%lack = uncounted_fluid(grid, case%fluid, solid, bodies, flux, flow)
      call count_fluid(case%fluid%gravity, dt, stage)
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

    associate (bodies => stage%bodies, viscous => stage%viscous)
      call build_viscous(grid, solid, bodies, flow%rho, flow%mu, dt, viscous)
      call shift_films(grid, solid, stage%films, -1.0_wp, flow%u)
      call predict_velocity(grid, flow%rho, flow, stage)
      call shift_films(grid, solid, stage%films, 1.0_wp, flow%u)
      ! To round-off the motion that the forces give, not that of the solver.
      bodies%motion = stage%dry_motion
      call push_bodies(dt, stage%from_pressure + stage%from_level + viscous%force, bodies)
      call impose_rigid_velocity(grid, solid, bodies, viscous%mass, flow%u)
    end associate
  end subroutine add_viscosity

  !> Velocity of the faces before the pressure stage.
  subroutine predict_faces(grid, solid, dt, flow, stage)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage

    call fill_velocity_halo(grid, flow%u)
    call halo_exchange(stage%acceleration%cell, n_halo)
    call predict_face_velocity(grid, dt, flow%rho, stage%acceleration, flow, stage%deviation)
    call face_velocity_at_walls(grid, solid, stage%at_start, dt, flow%rho, stage%acceleration, flow)
    call renew_acceleration(dt, flow, stage)
  end subroutine predict_faces

  !> What the new pressure does to the cells, and what films and cut cells owe for it.
  subroutine correct_cells(case, grid, solid, dt, flow, stage)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage
    real(wp), parameter :: weightless(3) = 0.0_wp

    associate (bodies => stage%bodies, a => stage%acceleration, mass => stage%viscous%mass)
      call face_acceleration(grid, weightless, flow%rho, flow%rho, stage%pressure%phi_total, &
                             a%face, flow%sides)
      call cell_mean_of_faces(grid, solid%open, a%face, a%cell)
      call add_product(grid, dt, a%cell, flow%u)
      call impose_rigid_velocity(grid, solid, bodies, mass, flow%u)
      call tie_films(grid, solid, bodies, mass, flow%uf, flow%u, stage%debt%tied)
      if (case%numerics%momentum == 'conservative') then
        call return_momentum(grid, case%fluid, solid, stage%at_start, bodies, stage%debt, flow)
      end if
      call fill_velocity_halo(grid, flow%u)
    end associate
  end subroutine correct_cells

  !> Force and torque of the step on each body, the inertia of the fluid that no face counts
  !! included, by the acceleration that the solve has found.
  subroutine sum_forces(grid, solid, dt, stage)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt
    type(stage_t), intent(inout) :: stage
    integer :: b

    associate (bodies => stage%bodies)
      call force_from_faces(grid, solid, bodies, stage%pressure%system%operator%flux, &
                            stage%pressure%phi_total, stage%total)
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
  subroutine start_flow(case, grid, solid, flow, stage)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage
    type(rigid_motion_t) :: held
    real(wp), allocatable :: uf(:, :, :, :)

    held = stage%bodies
    held%free = .false.
    associate (p => stage%pressure, system => stage%pressure%system, a => stage%acceleration, &
               dt => case%run%dt)
      call set_pressure_system(grid, solid%open, flow%rho, system, flow%sides)
      call build_rigid_flux(grid, solid, held, system%active, system%operator%flux)
      call solve_pressure(grid, solid, flow%rho, dt, flow, held, p)
      allocate (uf, source=flow%uf)
      held%motion = 0.0_wp
      flow%p = 0.0_wp
      call face_acceleration(grid, case%fluid%gravity, flow%rho, flow%rho, flow%p, a%face, &
                             flow%sides)
      call find_tension(grid, case%fluid, solid, flow%c, stage%tension)
      call add_tension(grid, flow%rho, stage%tension, a%face)
      flow%uf = dt*a%face
      call solve_pressure(grid, solid, flow%rho, dt, flow, held, p)
      call extend_pressure(grid, case%fluid%gravity, flow%rho, system%active, p%known, flow%p)
      flow%uf = uf
      call solid_face_flux(grid, solid, stage%bodies, system%operator%flux, flow%solid_flux)
    end associate
  end subroutine start_flow

  !> Cells inside a body move with it, in the components that no open face carries.
  subroutine impose_rigid_velocity(grid, solid, bodies, mass, u)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in), contiguous :: mass(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    integer :: i, j, k, b
    real(wp) :: arm(3)

    !$omp parallel do private(i, j, b, arm) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          b = solid%inside(i, j, k)
          if (b == 0) cycle
          arm = nearest_arm(grid, [grid%centre(i, 1), grid%centre(j, 2), grid%centre(k, 3)], &
                            bodies%x(:, b))
          u(i, j, k, :) = merge(u(i, j, k, :), wall_velocity(bodies%motion(:, b), arm), &
                                mass(i, j, k, :) > 0.0_wp)
        end do
      end do
    end do
  end subroutine impose_rigid_velocity

end module monolithic_m
