!> What both couplings share: the bodies as the flow sees them, the solvers, the parts of the force.
module velocity_stage_m
  use kinds_m, only: wp
  use swap_m, only: swap
  use grid_m, only: grid_t
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use rigid_motion_m, only: rigid_motion_t, rigid_motion_init, set_inertia
  use case_types_m, only: numerics_t, fluid_t
  use fields_m, only: flow_t, add_product
  use viscous_system_m, only: viscous_t, viscous_init
  use viscous_m, only: solve_viscous
  use momentum_c_ismac_m, only: c_ismac_t, c_ismac_init, begin_predictor, solve_predictor
  use pressure_m, only: pressure_t, pressure_report_t, pressure_init
  use face_velocity_m, only: acceleration_t, acceleration_init, face_acceleration, &
                             cell_mean_of_faces
  use linked_cells_m, only: linked_cells_t, linked_cells_init
  use mid_step_m, only: mid_step_t, mid_step_init
  use wall_balance_m, only: wall_balance_t, wall_balance_init
  use surface_tension_m, only: surface_tension_t, find_tension, add_tension
  use rigid_body_m, only: blocks_t, space_tensor
  implicit none
  private
  public :: stage_t, stage_report_t, stage_init, copy_motion, push_bodies
  public :: keep_acceleration, accelerate_cells, predict_velocity, renew_acceleration
  public :: find_surface_force, return_surface_force

  type :: stage_report_t
    type(pressure_report_t) :: pressure
    logical :: viscous_converged = .true.
  end type stage_report_t

  type :: stage_t
    type(rigid_motion_t) :: bodies
    type(rigid_motion_t) :: at_start
      !! the same with the motion at the start of the step
    type(viscous_t) :: viscous
    logical :: implicit_momentum = .false.         !! advection by C-ISMAC, in the predictor
    type(c_ismac_t) :: c_ismac                     !! allocated for it only
    type(pressure_t) :: pressure
    type(surface_tension_t) :: tension
    type(acceleration_t) :: acceleration
    real(wp), allocatable :: dry_motion(:, :)      !! (6, n) by weight and contact only
    real(wp), allocatable :: from_pressure(:, :)   !! (6, n) force and torque [N, N m]
    real(wp), allocatable :: from_level(:, :)      !! (6, n) buoyancy beyond the face pressures
    real(wp), allocatable :: lack(:, :, :)         !! (6, 3, n) displaced fluid no face counts
    real(wp), allocatable :: total(:, :)           !! (6, n)
    real(wp), allocatable :: terms(:, :)           !! (*, 6) of the sums over the cells of a body
    ! Of the monolithic coupling.
    type(rigid_motion_t) :: foreseen               !! the motion at the end, by `trend`
    real(wp), allocatable :: trend(:, :)
      !! (6, n) change of the motion in this step if the acceleration of the last one goes on
    type(linked_cells_t), allocatable :: links_before, links
      !! of the surface at the start and at the end of the step
    type(mid_step_t) :: mid_step
    type(wall_balance_t) :: balance
    real(wp), allocatable :: rho(:, :, :)          !! density that has inertia [kg/m3]
    real(wp), allocatable :: wall_speed(:)         !! at the ends of the legs (`wall_shear_m`) [m/s]
    real(wp), allocatable :: from_mid_step(:, :)   !! (6, n) what its two halves differ by
    real(wp), allocatable :: late(:, :)            !! (6, n) force of the walls of the step before
    real(wp), allocatable :: counted(:, :)         !! (6, n) motion that held fluid has got
    real(wp), allocatable :: deviation(:, :, :, :)
      !! of the faces at the start (`face_memory_m`); borrowed
    ! Of the mixture.
    type(solid_geometry_t) :: whole                !! the domain without solids
    real(wp), allocatable :: rho_mixture(:, :, :)  !! fluid and solid [kg/m3]
    real(wp), allocatable :: u_before(:, :, :, :)  !! velocity before the predictor [m/s]
  end type stage_t

contains

  !> Allocate all work arrays for a grid and n bodies.
  subroutine stage_init(grid, n, numerics, stage)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: n
    type(numerics_t), intent(in) :: numerics
    type(stage_t), intent(out) :: stage
    integer :: a(3), b(3)

    a = grid%first
    b = grid%last
    call rigid_motion_init(n, stage%bodies)
    call rigid_motion_init(n, stage%at_start)
    call rigid_motion_init(n, stage%foreseen)
    call viscous_init(grid, n, stage%viscous)
    stage%implicit_momentum = numerics%momentum == 'c_ismac'
    if (stage%implicit_momentum) call c_ismac_init(grid, n, numerics%advection, stage%c_ismac)
    call pressure_init(grid, n, numerics, stage%pressure)
    call acceleration_init(grid, stage%acceleration)
    allocate (stage%from_pressure(6, n), source=0.0_wp)
    allocate (stage%from_level, stage%total, stage%dry_motion, source=stage%from_pressure)
    allocate (stage%lack(6, 3, n), source=0.0_wp)
    allocate (stage%terms(0, 6))
    if (numerics%coupling == 'mics') then
      call solid_geometry_init(grid, stage%whole, n)
      allocate (stage%rho_mixture(a(1):b(1), a(2):b(2), a(3):b(3)), source=0.0_wp)
      allocate (stage%u_before(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
    else
      allocate (stage%links_before, stage%links)
      call linked_cells_init(grid, stage%links_before)
      call linked_cells_init(grid, stage%links)
      deallocate (stage%links_before%slip)   ! that of `links` serves both
      call mid_step_init(grid, stage%mid_step)
      deallocate (stage%mid_step%given)      ! borrowed when there is something to tell
      call wall_balance_init(stage%balance)
      allocate (stage%wall_speed(0))
      allocate (stage%from_mid_step, stage%late, stage%counted, stage%trend, source=stage%total)
      allocate (stage%rho(a(1):b(1), a(2):b(2), a(3):b(3)), source=0.0_wp)
    end if
  end subroutine stage_init

  !> Force of the surface, in arrays of the viscous stage, which has all of them back but that of
  !! the force itself (`return_surface_force`).
  subroutine find_surface_force(fluid, grid, solid, c, stage)
    type(fluid_t), intent(in) :: fluid
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
      !! C^, halo filled [-]
    type(stage_t), intent(inout) :: stage

    associate (viscous => stage%viscous, tension => stage%tension)
      call swap(viscous%r, tension%force)
      call swap(viscous%s, tension%surface%place)
      call swap(viscous%mass, tension%surface%curvature)
      call find_tension(grid, fluid, solid, c, tension)
      call swap(viscous%s, tension%surface%place)
      call swap(viscous%mass, tension%surface%curvature)
    end associate
  end subroutine find_surface_force

  !> The force of the surface has been counted: the viscous stage has its array back.
  subroutine return_surface_force(stage)
    type(stage_t), intent(inout) :: stage

    call swap(stage%viscous%r, stage%tension%force)
  end subroutine return_surface_force

  !> For C-ISMAC: note the acceleration of the cells at the start of the step, before density and
  !! solids change; `stage%tension` is that of the start.
  subroutine keep_acceleration(grid, gravity, open, rho, flow, stage)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in), contiguous :: open(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! that of the system [kg/m3]
    type(flow_t), intent(in) :: flow
    type(stage_t), intent(inout) :: stage

    associate (a => stage%acceleration)
      call face_acceleration(grid, gravity, flow%rho, rho, flow%p, a%face, flow%sides)
      call add_tension(grid, rho, stage%tension, a%face)
      call cell_mean_of_faces(grid, open, a%face, stage%c_ismac%a_old)
    end associate
  end subroutine keep_acceleration

  !> Add gravity and old pressure to all cells, for 'mics' and C-ISMAC; with C-ISMAC those of the
  !! start of the step, which stand in `acceleration%cell` then.
  subroutine accelerate_cells(grid, dt, flow, stage)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: dt   !! [s]
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage

    if (stage%implicit_momentum) then
      call begin_predictor(grid, flow%u, stage%c_ismac)
      stage%c_ismac%a_new = stage%acceleration%cell
      stage%acceleration%cell = stage%c_ismac%a_old
    end if
    call add_product(grid, dt, stage%acceleration%cell, flow%u)
  end subroutine accelerate_cells

  !> With C-ISMAC: exchange the acceleration in the cells for that of the density at hand, once the
  !! velocity of the faces is predicted.
  subroutine renew_acceleration(dt, flow, stage)
    real(wp), intent(in) :: dt   !! [s]
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(in) :: stage

    if (stage%implicit_momentum) flow%u = flow%u + dt*(stage%c_ismac%a_new - stage%c_ismac%a_old)
  end subroutine renew_acceleration

  !> Viscosity, and with C-ISMAC advection, into a velocity that has gravity and old pressure in.
  subroutine predict_velocity(grid, rho, flow, stage)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! that of the system [kg/m3]
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage

    if (stage%implicit_momentum) then
      call solve_predictor(grid, rho, stage%bodies, flow, stage%viscous, stage%c_ismac)
    else
      call solve_viscous(grid, stage%bodies, flow, stage%viscous)
    end if
  end subroutine predict_velocity

  !> What the flow has to know of the blocks, at their present pose and velocity.
  subroutine copy_motion(blocks, bodies)
    type(blocks_t), intent(in) :: blocks
    type(rigid_motion_t), intent(inout) :: bodies
    integer :: b

    do b = 1, blocks%n
      associate (shape => blocks%shapes(blocks%shape(b)))
        bodies%present(b) = blocks%present(b)
        bodies%free(b) = blocks%present(b) .and. .not. (blocks%fixed(b) .or. blocks%asleep(b))
        bodies%x(:, b) = blocks%x(:, b)
        bodies%motion(1:3, b) = merge(blocks%v(:, b), 0.0_wp, blocks%present(b))
        bodies%motion(4:6, b) = merge(blocks%omega(:, b), 0.0_wp, blocks%present(b))
        bodies%mass(b) = blocks%mass(b)
        bodies%volume(b) = shape%volume
        bodies%radius(b) = shape%radius
        bodies%inertia(:, :, b) = space_tensor(blocks%q(:, b), shape%inertia)
        bodies%inverse_inertia(:, :, b) = space_tensor(blocks%q(:, b), &
                                                       blocks%inverse_inertia(:, :, &
                                                           blocks%shape(b)))
      end associate
      call set_inertia(b, bodies)
    end do
  end subroutine copy_motion

  !> Change the motion of the free bodies by forces acting over dt.
  pure subroutine push_bodies(dt, force, bodies)
    real(wp), intent(in) :: dt
    real(wp), intent(in) :: force(:, :)   !! (6, n) [N, N m]
    type(rigid_motion_t), intent(inout) :: bodies
    integer :: b

    do b = 1, bodies%n
      if (.not. bodies%free(b)) cycle
      bodies%motion(:, b) = bodies%motion(:, b) + dt*matmul(bodies%mobility(:, :, b), force(:, b))
    end do
  end subroutine push_bodies

end module velocity_stage_m
