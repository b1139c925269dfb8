!> Velocity and pressure of the fluid at t = 0.
module flow_start_m
  use kinds_m, only: wp
  use case_types_m, only: case_t
  use grid_m, only: grid_t
  use scratch_m, only: scratch_t, give, take_faces, give_faces
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t
  use rigid_flux_m, only: build_rigid_flux, all_fluid_of_faces
  use pressure_system_m, only: set_pressure_system
  use pressure_m, only: solve_pressure
  use pressure_extension_m, only: extend_pressure
  use face_velocity_m, only: face_acceleration
  use surface_tension_m, only: add_tension
  use coupling_m, only: coupling_t, find_surface_force
  implicit none
  private
  public :: start_flow

contains

  !> Face velocity of the start made free of divergence, and the pressure of the fluid under gravity
  !! around bodies held in place, so that the first step starts from a balance.
  subroutine start_flow(case, grid, solid, flow, scratch, self, converged)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(flow_t), intent(inout) :: flow
    type(scratch_t), intent(inout) :: scratch
    class(coupling_t), intent(inout) :: self   !! its bodies in place
    logical, intent(out) :: converged
    type(rigid_motion_t) :: held
    real(wp), allocatable :: uf(:, :, :, :)

    held = self%bodies
    held%free = .false.
    associate (p => self%pressure, system => self%pressure%system, a => self%acceleration, &
               dt => case%run%dt)
      call take_faces(scratch, system%operator%cf)
      call set_pressure_system(grid, solid%effective, flow%rho, system, flow%sides)
      call build_rigid_flux(grid, solid, held, system%active, system%operator%flux)
      call solve_pressure(grid, solid, flow%rho, dt, flow, held, p)
      converged = p%report%converged
      allocate (uf, source=flow%uf)
      held%motion = 0.0_wp
      flow%p = 0.0_wp
      call face_acceleration(grid, case%fluid%gravity, flow%rho, flow%rho, flow%p, a%face, &
                             flow%sides)
      call find_surface_force(case%fluid, grid, solid, flow%c, scratch, self)
      call add_tension(grid, flow%rho, self%tension, a%face)
      call give(scratch, self%tension%force)
      flow%uf = dt*a%face
      call solve_pressure(grid, solid, flow%rho, dt, flow, held, p)
      converged = converged .and. p%report%converged
      call extend_pressure(grid, case%fluid%gravity, solid%alpha, flow, p)
      call give_faces(scratch, system%operator%cf)
      flow%uf = uf
      call all_fluid_of_faces(grid, solid, self%bodies, system%operator%flux, flow%uf, &
                              flow%solid_flux)
    end associate
  end subroutine start_flow

end module flow_start_m
