!> Velocity and pressure of the fluid at t = 0.
module flow_start_m
  use kinds_m, only: wp
  use scratch_m, only: give
  use stage_m, only: stage_t
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
  subroutine start_flow(s, self, converged)
    type(stage_t), intent(in) :: s
    class(coupling_t), intent(inout) :: self   !! its bodies in place
    logical, intent(out) :: converged
    type(rigid_motion_t) :: held
    real(wp), allocatable :: uf(:, :, :, :)

    held = self%bodies
    held%free = .false.
    associate (grid => s%grid, solid => s%solid, flow => s%flow, p => self%pressure, &
               system => self%pressure%system, a => self%acceleration)
      call set_pressure_system(grid, solid%effective, flow%rho, system, flow%sides)
      call build_rigid_flux(grid, solid, held, system%active, system%operator%flux)
      call solve_pressure(s, flow%rho, held, p)
      converged = p%report%converged
      allocate (uf, source=flow%uf)
      held%motion = 0.0_wp
      flow%p = 0.0_wp
      call face_acceleration(grid, self%fluid%gravity, flow%rho, flow%rho, flow%p, a%face, &
                             flow%sides)
      call find_surface_force(s, self)
      call add_tension(grid, flow%rho, self%tension, a%face)
      call give(s%scratch, self%tension%force)
      flow%uf = s%dt*a%face
      call solve_pressure(s, flow%rho, held, p)
      converged = converged .and. p%report%converged
      call extend_pressure(grid, self%fluid%gravity, solid, flow, p)
      flow%uf = uf
      call all_fluid_of_faces(grid, solid, self%bodies, system%operator%flux, flow%uf, &
                              flow%solid_flux)
    end associate
  end subroutine start_flow

end module flow_start_m
