!> Fluid and bodies move each other: what both couplings share, and the stages that each has its own
!! way for.
!!
!! A coupling is an object with its own work. `step_m` calls its stages in order; what they hand on
!! to each other are the velocity of cells and faces, the pressure, the motion of the bodies, and
!! the fields of the type.
module coupling_m
  use kinds_m, only: wp
  use grid_m, only: grid_t
  use scratch_m, only: take, give
  use stage_m, only: stage_t
  use rigid_motion_m, only: rigid_motion_t, rigid_motion_init, set_inertia
  use case_types_m, only: case_t, fluid_t
  use fields_m, only: add_product
  use viscous_system_m, only: viscous_t, viscous_init
  use viscous_m, only: solve_viscous
  use momentum_c_ismac_m, only: c_ismac_t, c_ismac_init, begin_predictor, solve_predictor
  use pressure_m, only: pressure_t, pressure_init
  use face_velocity_m, only: acceleration_t, acceleration_init, face_acceleration, &
                             cell_mean_of_faces
  use surface_tension_m, only: surface_tension_t, surface_tension_init, find_tension, add_tension
  use rigid_body_m, only: blocks_t, space_tensor, set_velocity_after_fluid
  implicit none
  private
  public :: coupling_t, coupling_init, copy_motion, push_bodies, move_by_forces
  public :: by_old_pressure, by_displaced, by_half_kick, by_viscosity
  public :: by_new_pressure, by_walls
  public :: keep_acceleration, accelerate_cells, predict_velocity, renew_acceleration
  public :: find_surface_force, start_of_stages, motion_after_fluid

  !> Forces of the fluid on a body, in the order in which a step finds them.
  integer, parameter :: by_old_pressure = 1   !! that of the start, and surface tension
  integer, parameter :: by_displaced = 2      !! what the faces miss of the displaced fluid
  integer, parameter :: by_half_kick = 3      !! what the halves of the old pressure differ by
  integer, parameter :: left_by_walls = 4     !! of the walls, found too late in the last step
  integer, parameter :: by_viscosity = 5
  integer, parameter :: by_new_pressure = 6   !! what the projection adds to the old
  integer, parameter :: by_walls = 7          !! of the walls
  integer, parameter :: n_forces = 7

  type, abstract :: coupling_t
    type(fluid_t) :: fluid
    type(rigid_motion_t) :: bodies
    type(rigid_motion_t) :: expected
      !! the motion at the end of the step with the forces of the fluid in the last one
    type(rigid_motion_t) :: at_start
      !! the same with the motion at the start of the step
    type(viscous_t) :: viscous
    logical :: implicit_momentum = .false.         !! advection by C-ISMAC, in the predictor
    type(c_ismac_t) :: c_ismac                     !! allocated for it only
    type(pressure_t) :: pressure                   !! its report is that of the step
    type(surface_tension_t) :: tension
    type(acceleration_t) :: acceleration
    real(wp), allocatable :: unforced_motion(:, :)   !! (6, n) by weight and contact alone
    real(wp), allocatable :: force(:, :, :)
      !! (6, n, `by_old_pressure`...) of the fluid on the bodies in this step [N, N m]
    real(wp), allocatable :: total(:, :)   !! (6, n) their sum, with the inertia of displaced fluid
  contains
    procedure(of_release), deferred :: force_at_release
    procedure(of_start), deferred :: begin
    procedure(of_stage), deferred :: average_momentum
    procedure(of_stage), deferred :: build_pressure_system
    procedure(of_stage), deferred :: add_forces
    procedure(of_stage), deferred :: add_viscosity
    procedure(of_stage), deferred :: predict_faces
    procedure(of_stage), deferred :: project
    procedure(of_end), deferred :: close
  end type coupling_t

  abstract interface
    !> Force and torque with which bodies that are let go begin to move (6, bodies) [N, N m].
    subroutine of_release(self, s, begins, force)
      import :: coupling_t, stage_t, wp
      implicit none
      class(coupling_t), intent(inout) :: self   !! its bodies in place
      type(stage_t), intent(in) :: s
        !! with the time in which a block begins to move; of the flow only the pressure changes
      logical, intent(in) :: begins(:)           !! (blocks) those let go; all others are held
      real(wp), intent(out) :: force(:, :)
    end subroutine of_release

    !> What the stages will need of the start of the step, and what acts before the transport.
    subroutine of_start(self, s, blocks)
      import :: coupling_t, stage_t, blocks_t
      implicit none
      class(coupling_t), intent(inout) :: self   !! its bodies as they move at the start
      type(stage_t), intent(in) :: s
      type(blocks_t), intent(in) :: blocks
    end subroutine of_start

    !> A stage after the transport: fluid and bodies are where the step ends. After `project`
    !! pressure, velocity of faces, cells and bodies are final, force and torque on each body known.
    subroutine of_stage(self, s)
      import :: coupling_t, stage_t
      implicit none
      class(coupling_t), intent(inout) :: self
      type(stage_t), intent(in) :: s
    end subroutine of_stage

    !> The faces as the next step carries fluid through them, with the final motion of the bodies.
    subroutine of_end(self, s, blocks)
      import :: coupling_t, stage_t, blocks_t
      implicit none
      class(coupling_t), intent(inout) :: self
      type(stage_t), intent(in) :: s
      type(blocks_t), intent(inout) :: blocks
    end subroutine of_end
  end interface

contains

  !> Allocate what both couplings need, for a grid and n bodies, but the work arrays of the pool.
  subroutine coupling_init(grid, n, case, self)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: n
    type(case_t), intent(in) :: case
    class(coupling_t), intent(inout) :: self

    self%fluid = case%fluid
    call rigid_motion_init(n, self%bodies)
    call rigid_motion_init(n, self%at_start)
    call rigid_motion_init(n, self%expected)
    call viscous_init(grid, n, self%viscous, pooled=.true.)
    select case (case%numerics%momentum)
    case ('c_ismac'); self%implicit_momentum = .true.
    case ('conservative'); self%implicit_momentum = .false.
    case default; error stop 'coupling_init: no such momentum'
    end select
    if (self%implicit_momentum) call c_ismac_init(grid, n, case%numerics%advection, self%c_ismac)
    call pressure_init(grid, n, case%numerics, self%pressure)
    call acceleration_init(grid, self%acceleration)
    call surface_tension_init(grid, case%fluid, self%tension)
    allocate (self%force(6, n, n_forces), source=0.0_wp)
    allocate (self%unforced_motion(6, n), self%total(6, n), source=0.0_wp)
  end subroutine coupling_init

  !> Before the stages that follow the transport: the bodies move as contact and weight make them,
  !! no force of the fluid is known yet.
  subroutine start_of_stages(gravity, dt, blocks, self)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: dt           !! [s]
    type(blocks_t), intent(inout) :: blocks
    class(coupling_t), intent(inout) :: self
    integer :: b

    self%total = 0.0_wp
    self%force = 0.0_wp
    self%force(:, :blocks%n, left_by_walls) = blocks%lagged_force
    call copy_motion(blocks, self%expected)
    call motion_after_fluid(gravity, dt, blocks, self)
    self%unforced_motion = self%bodies%motion
    self%at_start = self%bodies
    do b = 1, blocks%n
      if (.not. (self%bodies%free(b) .or. blocks%path(b)%n > 0)) cycle
      self%at_start%motion(1:3, b) = blocks%v_start(:, b)
      self%at_start%motion(4:6, b) = matmul(self%bodies%inverse_inertia(:, :, b), &
                                            blocks%l_start(:, b))
    end do
  end subroutine start_of_stages

  !> Velocity of the blocks from contact, weight and the total fluid force; the flow sees it too.
  subroutine motion_after_fluid(gravity, dt, blocks, self)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: dt           !! [s]
    type(blocks_t), intent(inout) :: blocks
    class(coupling_t), intent(inout) :: self

    call set_velocity_after_fluid(gravity, dt, self%total(1:3, :blocks%n), &
                                  self%total(4:6, :blocks%n), blocks)
    call copy_motion(blocks, self%bodies)
  end subroutine motion_after_fluid

  !> Force of the surface at the faces; `tension%force` is taken and has to be given back.
  subroutine find_surface_force(s, self)
    type(stage_t), intent(in) :: s
    class(coupling_t), intent(inout) :: self

    associate (tension => self%tension)
      call take(s%scratch, tension%force)
      call take(s%scratch, tension%surface%place)
      call take(s%scratch, tension%surface%curvature)
      call find_tension(s%grid, self%fluid, s%solid, s%flow%c, tension)
      call give(s%scratch, tension%surface%place)
      call give(s%scratch, tension%surface%curvature)
    end associate
  end subroutine find_surface_force

  !> For C-ISMAC: note the acceleration of the cells at the start of the step, before density and
  !! solids change; `self%tension` is that of the start.
  subroutine keep_acceleration(s, aperture, rho, self)
    type(stage_t), intent(in) :: s
    real(wp), intent(in), contiguous :: &
      aperture(s%grid%first(1):, s%grid%first(2):, s%grid%first(3):, :)
    real(wp), intent(in), contiguous :: rho(s%grid%first(1):, s%grid%first(2):, s%grid%first(3):)
      !! that of the system [kg/m3]
    class(coupling_t), intent(inout) :: self

    associate (flow => s%flow, a => self%acceleration)
      call face_acceleration(s%grid, self%fluid%gravity, flow%rho, rho, flow%p, a%face, flow%sides)
      call add_tension(s%grid, rho, self%tension, a%face)
      call cell_mean_of_faces(s%grid, aperture, a%face, self%c_ismac%a_old)
    end associate
  end subroutine keep_acceleration

  !> Add gravity and old pressure to all cells, for 'mics' and C-ISMAC; with C-ISMAC those of the
  !! start of the step, which stand in `acceleration%cell` then.
  subroutine accelerate_cells(s, self)
    type(stage_t), intent(in) :: s
    class(coupling_t), intent(inout) :: self

    if (self%implicit_momentum) then
      call begin_predictor(s%grid, s%flow%u, self%c_ismac)
      self%c_ismac%a_new = self%acceleration%cell
      self%acceleration%cell = self%c_ismac%a_old
    end if
    call add_product(s%grid, s%dt, self%acceleration%cell, s%flow%u)
  end subroutine accelerate_cells

  !> With C-ISMAC: exchange the acceleration in the cells for that of the density at hand, once the
  !! velocity of the faces is predicted.
  subroutine renew_acceleration(s, self)
    type(stage_t), intent(in) :: s
    class(coupling_t), intent(in) :: self

    if (self%implicit_momentum) s%flow%u = s%flow%u + s%dt*(self%c_ismac%a_new - self%c_ismac%a_old)
  end subroutine renew_acceleration

  !> Viscosity, and with C-ISMAC advection, into a velocity that has gravity and old pressure in.
  subroutine predict_velocity(s, rho, self)
    type(stage_t), intent(in) :: s
    real(wp), intent(in), contiguous :: rho(s%grid%first(1):, s%grid%first(2):, s%grid%first(3):)
      !! that of the system [kg/m3]
    class(coupling_t), intent(inout) :: self

    if (self%implicit_momentum) then
      call solve_predictor(s%grid, rho, self%bodies, s%flow, self%viscous, self%c_ismac)
    else
      call solve_viscous(s%grid, self%bodies, s%flow, self%viscous)
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
        bodies%inverse_inertia(:, :, b) = &
          space_tensor(blocks%q(:, b), blocks%inverse_inertia(:, :, b))
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

  !> Motion at the end of the step by weight, contact and the forces of the fluid found so far.
  subroutine move_by_forces(dt, self)
    real(wp), intent(in) :: dt   !! [s]
    class(coupling_t), intent(inout) :: self

    self%bodies%motion = self%unforced_motion
    call push_bodies(dt, sum(self%force, 3), self%bodies)
  end subroutine move_by_forces

end module coupling_m
