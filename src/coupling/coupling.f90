!> Fluid and bodies move each other: one velocity stage for both, by the chosen coupling.
module coupling_m
  use kinds_m, only: wp
  use swap_m, only: swap
  use case_types_m, only: case_t
  use grid_m, only: grid_t
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use face_memory_m, only: note_deviation
  use linked_cells_m, only: linked_cells_t, link_cells
  use mid_step_m, only: to_mid_step, find_liquid
  use rigid_flux_m, only: all_fluid_of_faces
  use monolithic_m, only: monolithic_stage
  use mass_average_m, only: mass_average_stage, overlay_bodies, density_of_mixture
  use velocity_stage_m, only: stage_t, stage_report_t, copy_motion, keep_acceleration, &
    find_surface_force, return_surface_force
  use rigid_body_m, only: blocks_t, set_velocity_after_fluid
  implicit none
  private
  public :: advance_velocity, note_start

contains

  !> What the velocity stage will need of the start of the step: for C-ISMAC the acceleration, else
  !! how the faces at the surface differ from the cells; and the first half of the old pressure.
  subroutine note_start(case, grid, solid, dt, dt_before, flow, blocks, stage)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt, dt_before   !! of this step and of the one before, 0: none [s]
    type(flow_t), intent(inout) :: flow
    type(blocks_t), intent(in) :: blocks
    type(stage_t), intent(inout) :: stage   !! its bodies as they move at the start

    if (case%numerics%coupling == 'monolithic') then
      call find_trend(case%fluid%gravity, dt, blocks, stage)
      stage%late(:, :blocks%n) = dt_before/dt*blocks%late_force   ! what is owed is an impulse
      call find_links_before(grid, solid, stage)
    end if
    if (case%numerics%coupling == 'monolithic' .and. .not. stage%implicit_momentum) then
      if (.not. allocated(stage%deviation)) then
        call swap(flow%solid_flux, stage%deviation)          ! lent until the pressure and
        call swap(stage%viscous%leg, stage%mid_step%given)   ! the viscosity need them
      end if
      call note_deviation(grid, solid%alpha, flow%rho, flow%u, flow%uf, stage%deviation)
      call to_mid_step(grid, case%fluid, solid, stage%links_before, stage%bodies, stage%trend, dt, &
                       flow, stage%acceleration, stage%mid_step)
    end if
    if (.not. stage%implicit_momentum) return
    call find_surface_force(case%fluid, grid, solid, flow%c, stage)
    if (case%numerics%coupling == 'mics') then
      call density_of_mixture(grid, solid, stage%bodies, flow%rho, stage%rho_mixture)
      call keep_acceleration(grid, case%fluid%gravity, stage%whole%open, stage%rho_mixture, flow, &
                             stage)
    else
      call find_liquid(grid, flow, stage%mid_step%takes_part)
      call keep_acceleration(grid, case%fluid%gravity, solid%open, flow%rho, flow, stage)
    end if
    call return_surface_force(stage)
  end subroutine note_start

  !> The links of the start of the step: those of the end of the last one, or new ones if blocks
  !! have come.
  subroutine find_links_before(grid, solid, stage)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid   !! at the start
    type(stage_t), intent(inout) :: stage
    type(linked_cells_t), allocatable :: keep

    call move_alloc(stage%links_before, keep)
    call move_alloc(stage%links, stage%links_before)
    call move_alloc(keep, stage%links)
    call move_alloc(stage%links_before%slip, stage%links%slip)   ! nothing reads it at the start
    call link_cells(grid, solid, stage%links_before)
  end subroutine find_links_before

  !> What the motion changes by in this step if the bodies accelerate as in the step before, like
  !! the fluid that gets the old pressure.
  subroutine find_trend(gravity, dt, blocks, stage)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: dt           !! [s]
    type(blocks_t), intent(in) :: blocks
    type(stage_t), intent(inout) :: stage
    integer :: b

    stage%trend = 0.0_wp
    do b = 1, blocks%n
      if (.not. stage%bodies%free(b)) cycle
      stage%trend(1:3, b) = dt*(gravity + (blocks%fluid_force(:, b) + blocks%contact_force(:, b)) &
                                          /blocks%mass(b))
      stage%trend(4:6, b) = dt*matmul(stage%bodies%inverse_inertia(:, :, b), &
                                      blocks%fluid_torque(:, b) + blocks%contact_torque(:, b))
    end do
  end subroutine find_trend

  !> Velocity of the fluid and of the bodies at the end of the step.
  !!
  !! On entry the liquid and the bodies are where the step ends, `flow%u` is the transported
  !! velocity; the bodies carry the mean contact force of the step. On return the bodies have their
  !! final velocity and the force from the fluid; face velocity and solid flux are those the next
  !! step uses.
  subroutine advance_velocity(case, grid, solid, dt, flow, blocks, stage, report)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt   !! [s]
    type(flow_t), intent(inout) :: flow
    type(blocks_t), intent(inout) :: blocks
    type(stage_t), intent(inout) :: stage
    type(stage_report_t), intent(out) :: report

    stage%total = 0.0_wp
    call set_velocity()
    call motion_at_start(blocks, stage)
    if (case%numerics%coupling == 'mics') then
      call mass_average_stage(case, grid, solid, dt, flow, stage, report)
      call set_velocity()
      call overlay_bodies(grid, solid, flow, stage, report)
    else
      call monolithic_stage(case, grid, solid, dt, flow, stage, report)
      blocks%late_force = stage%late(:, :blocks%n)
      call set_velocity()
      call all_fluid_of_faces(grid, solid, stage%bodies, stage%pressure%system%operator%flux, &
                              flow%uf, flow%solid_flux)
    end if
  contains
    !> Velocity of the blocks from contact, weight and the total fluid force; the flow sees it too.
    subroutine set_velocity()
      call set_velocity_after_fluid(case%fluid%gravity, dt, stage%total(1:3, :blocks%n), &
                                    stage%total(4:6, :blocks%n), blocks)
      call copy_motion(blocks, stage%bodies)
    end subroutine set_velocity
  end subroutine advance_velocity

  !> The bodies at their new place with the motion they had when the step began.
  subroutine motion_at_start(blocks, stage)
    type(blocks_t), intent(in) :: blocks
    type(stage_t), intent(inout) :: stage
    integer :: b

    stage%at_start = stage%bodies
    do b = 1, blocks%n
      if (.not. stage%bodies%free(b)) cycle
      stage%at_start%motion(1:3, b) = blocks%v_start(:, b)
      stage%at_start%motion(4:6, b) = matmul(stage%bodies%inverse_inertia(:, :, b), &
                                             blocks%l_start(:, b))
    end do
  end subroutine motion_at_start

end module coupling_m
