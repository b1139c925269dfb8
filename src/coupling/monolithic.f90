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
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t, set_inertia, wall_velocity
  use rigid_flux_m, only: build_rigid_flux, force_from_faces, solid_face_flux, nearest_arm
  use viscous_m, only: build_viscous
  use pressure_m, only: set_pressure_system, solve_pressure, face_acceleration, &
    cell_mean_of_faces, &
                        predict_face_velocity, face_velocity_at_walls, &
                        extend_pressure
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
  subroutine monolithic_stage(case, grid, solid, dt, flow, self, report)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: self
    type(stage_report_t), intent(inout) :: report
    real(wp) :: free(6, self%bodies%n)   !! motion with weight and contact only
    real(wp), parameter :: weightless(3) = 0.0_wp

    associate (p => self%pressure, bodies => self%bodies)
      self%u_before = flow%u
      call set_pressure_system(grid, case%numerics, solid%open, flow%rho, p, flow%sides)
      call build_rigid_flux(grid, solid, bodies, p%active, p%operator%flux)

      call face_acceleration(grid, case%fluid%gravity, flow%rho, flow%rho, flow%p, p%a_face, &
                             flow%sides)
      call add_tension(grid, flow%rho, self%tension, p%a_face)
      call cell_mean_of_faces(grid, solid%open, p%a_face, p%a_cell)
      call surface_stress(grid, solid%alpha, flow%rho, flow%mu, flow%u, self%a_stress)
      call accelerate_cells(grid, dt, flow, self)
      flow%u = flow%u + dt*self%a_stress
      call force_from_faces(grid, solid, bodies, p%operator%flux, flow%p, self%from_pressure, &
                            flow%sides)
      call force_from_tension(grid, solid, bodies, p%operator%flux, self%tension, self%terms, &
                              self%from_pressure)
      call uncounted_fluid(grid, case%fluid, solid, bodies, p%operator%flux, flow%c, &
                           flow%rho, self%buoyancy, self%lack)
      free = bodies%motion
      call count_fluid(case%fluid%gravity, dt, self)
      call push_bodies(dt, self%from_pressure + self%from_level, bodies)

      call build_viscous(grid, solid, bodies, flow%rho, flow%mu, dt, self%viscous)
      call shift_films(grid, solid, self%films, -1.0_wp, flow%u)
      call predict_velocity(grid, flow%rho, dt, flow, self, report)
      call shift_films(grid, solid, self%films, 1.0_wp, flow%u)
      bodies%motion = free   ! to round-off the motion that the forces give, not the solver's
      call push_bodies(dt, self%from_pressure + self%from_level + self%from_viscosity, bodies)
      call impose_rigid_velocity(grid, solid, bodies, self%viscous%mass, flow%u)

      call fill_velocity_halo(grid, flow%u)
      call halo_exchange(p%a_cell, n_halo)
      call predict_face_velocity(grid, dt, flow%rho, p%a_face, p%a_cell, flow, self%deviation)
      call face_velocity_at_walls(grid, solid, self%at_start, dt, flow%rho, p%a_face, p%a_cell, &
                                  flow)
      call renew_acceleration(dt, flow, self)
      call solve_pressure(grid, case%numerics, solid, flow%rho, dt, flow, bodies, p, &
                          report%pressure)

      call face_acceleration(grid, weightless, flow%rho, flow%rho, p%phi_total, p%a_face, &
                             flow%sides)
      call cell_mean_of_faces(grid, solid%open, p%a_face, p%a_cell)
      flow%u = flow%u + dt*p%a_cell
      call impose_rigid_velocity(grid, solid, bodies, self%viscous%mass, flow%u)
      call tie_films(grid, solid, bodies, self%viscous%mass, flow%uf, flow%u, self%viscous%y)
      if (case%numerics%momentum == 'conservative') then
        call return_momentum(grid, case%fluid, solid, self%at_start, bodies, self%u_before, &
                             self%viscous%y, flow, self%viscous%z, self%viscous%r)
      end if
      call fill_velocity_halo(grid, flow%u)
      call extend_pressure(grid, case%fluid%gravity, flow%rho, p%active, p%known, flow%p)
      call force_from_faces(grid, solid, bodies, p%operator%flux, p%phi_total, self%total)
      self%total = self%total + self%from_pressure + self%from_level + self%from_viscosity
      call add_acceleration(dt, free, self)
    end associate
  end subroutine monolithic_stage

  !> Give the bodies the inertia of the fluid that the faces do not count, and `from_level` its
  !! force as far as it is known before the solve: -lack (g - a), a by weight and contact.
  subroutine count_fluid(gravity, dt, self)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: dt           !! [s]
    type(stage_t), intent(inout) :: self
    real(wp) :: lack(6, 6)
    integer :: b

    do b = 1, size(self%lack, 3)
      self%from_level(:, b) = -matmul(self%lack(:, :, b), gravity)
      if (.not. self%bodies%free(b)) cycle
      lack = 0.0_wp
      lack(:, 1:3) = self%lack(:, :, b)
      lack(1:3, 4:6) = transpose(lack(4:6, 1:3))
      call set_inertia(b, self%bodies, lack)
      self%from_level(:, b) = self%from_level(:, b) + &
        matmul(self%bodies%lack(:, :, b), self%bodies%motion(:, b) - self%at_start%motion(:, b))/dt
    end do
  end subroutine count_fluid

  !> The rest of that force, by the acceleration that the solve has found.
  subroutine add_acceleration(dt, free, self)
    real(wp), intent(in) :: dt           !! [s]
    real(wp), intent(in) :: free(:, :)   !! (6, n) motion before the solve
    type(stage_t), intent(inout) :: self
    integer :: b

    do b = 1, self%bodies%n
      if (.not. self%bodies%free(b)) cycle
      self%total(:, b) = self%total(:, b) + &
        matmul(self%bodies%lack(:, :, b), self%bodies%motion(:, b) - free(:, b))/dt
    end do
  end subroutine add_acceleration

  !> Face velocity of the start made free of divergence, and the pressure of the fluid under gravity
  !! around bodies held in place, so that the first step starts from a balance.
  subroutine start_flow(case, grid, solid, flow, stage, report)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage
    type(stage_report_t), intent(out) :: report
    type(rigid_motion_t) :: held
    real(wp), allocatable :: uf(:, :, :, :)

    held = stage%bodies
    held%free = .false.
    associate (p => stage%pressure, dt => case%run%dt)
      call set_pressure_system(grid, case%numerics, solid%open, flow%rho, p, flow%sides)
      call build_rigid_flux(grid, solid, held, p%active, p%operator%flux)
      call solve_pressure(grid, case%numerics, solid, flow%rho, dt, flow, held, p, report%pressure)
      allocate (uf, source=flow%uf)
      held%motion = 0.0_wp
      flow%p = 0.0_wp
      call face_acceleration(grid, case%fluid%gravity, flow%rho, flow%rho, flow%p, p%a_face, &
                             flow%sides)
      call find_tension(grid, case%fluid, solid, flow%c, stage%tension)
      call add_tension(grid, flow%rho, stage%tension, p%a_face)
      flow%uf = dt*p%a_face
      call solve_pressure(grid, case%numerics, solid, flow%rho, dt, flow, held, p, report%pressure)
      call extend_pressure(grid, case%fluid%gravity, flow%rho, p%active, p%known, flow%p)
      flow%uf = uf
      call solid_face_flux(grid, solid, stage%bodies, p%operator%flux, flow%solid_flux)
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
          u(i, j, k, :) = merge(u(i, j, k, :), wall_velocity(bodies%motion(:, b), arm), mass(i, &
              j, k, :) > 0.0_wp)
        end do
      end do
    end do
  end subroutine impose_rigid_velocity

end module monolithic_m
