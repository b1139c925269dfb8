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
  use scratch_m, only: take, give
  use stage_m, only: stage_t
  use fields_m, only: add_product
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t, set_inertia
  use rigid_flux_m, only: build_rigid_flux, force_from_faces, all_fluid_of_faces, velocity_in_cell
  use viscous_system_m, only: take_arrays, give_arrays
  use viscous_links_m, only: build_viscous
  use pressure_system_m, only: set_pressure_system
  use pressure_m, only: pressure_report_t, solve_pressure, both_solves
  use pressure_extension_m, only: extend_pressure
  use face_velocity_m, only: face_acceleration, cell_mean_of_faces, predict_face_velocity
  use effective_aperture_m, only: hold_in_cells
  use wall_faces_m, only: face_velocity_at_walls, shorten_at_walls
  use old_time_correction_m, only: store_correction
  use advected_pressure_m, only: advect_pressure
  use half_kick_m, only: find_liquid, find_first_half, add_first_half, change_where, &
                         force_of_half_kick
  use buoyancy_m, only: displaced_force, mass_defect, held_mass
  use merged_cells_m, only: merged_cells_t, merged_cells_init, find_merged_cells, match_densities
  use merged_momentum_m, only: share_momentum, share_acceleration, follow_targets
  use wall_layer_m, only: find_slip, find_centres, to_centres, find_wall_speeds
  use wall_balance_m, only: wall_balance_t, begin_balance, add_push, &
                            store_velocity, force_of_walls
  use surface_stress_m, only: surface_stress
  use surface_tension_m, only: add_tension, force_from_tension
  use coupling_m, only: coupling_t, coupling_init, push_bodies, move_by_forces, &
    by_old_pressure, by_displaced, by_half_kick, by_viscosity, by_new_pressure, by_walls, &
    accelerate_cells, keep_acceleration, predict_velocity, renew_acceleration, find_surface_force
  use rigid_body_m, only: blocks_t, change_by_motion
  use boundary_m, only: fill_velocity_halo
  use parallel_m, only: halo_exchange
  implicit none
  private
  public :: monolithic_t, monolithic_init

  real(wp), parameter :: rough_factor = 1.0e3_wp
    !! tolerance of the first of two pressure solves over that of the second

  type, extends(coupling_t) :: monolithic_t
    real(wp), allocatable :: extrapolated(:, :)
      !! (6, n) change of the motion in this step if the acceleration of the last one goes on
    type(merged_cells_t), allocatable :: merged_before, merged
      !! of the surface at the start and at the end of the step
    real(wp), allocatable :: kick(:, :, :, :)
      !! momentum of the first half kick [kg m/s]
    type(wall_balance_t) :: balance
    real(wp), allocatable :: rho(:, :, :)          !! density that has inertia [kg/m3]
    real(wp), allocatable :: defect(:, :, :)         !! (6, 3, n) displaced fluid no face counts
    real(wp), allocatable :: held(:, :, :)           !! (6, 3, n) fluid held at faces
    real(wp), allocatable :: held_motion(:, :)     !! (6, n) motion that held fluid has got
    real(wp), allocatable :: of_films(:, :)
      !! (6, n) force of what the pressure of films differs by from that around them [N, N m]
    real(wp), allocatable :: left_over(:, :)       !! (6, n) force of the walls for the next step
    real(wp), allocatable :: correction(:, :, :, :)
      !! of the faces at the start of the step (`old_time_correction_m`) [m/s]
  contains
    procedure :: force_at_release
    procedure :: begin
    procedure :: average_momentum
    procedure :: build_pressure_system
    procedure :: add_forces
    procedure :: add_viscosity
    procedure :: predict_faces
    procedure :: project
    procedure :: close => close_faces
  end type monolithic_t

contains

  !> Allocate for a grid and n bodies.
  subroutine monolithic_init(grid, n, case, self)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: n
    type(case_t), intent(in) :: case
    type(monolithic_t), intent(out) :: self
    integer :: a(3), b(3)

    call coupling_init(grid, n, case, self)
    a = grid%first
    b = grid%last
    allocate (self%merged_before, self%merged)
    call merged_cells_init(grid, self%merged_before)
    call merged_cells_init(grid, self%merged)
    allocate (self%defect(6, 3, n), self%held(6, 3, n), source=0.0_wp)
    allocate (self%held_motion, self%left_over, self%of_films, self%extrapolated, source=self%total)
    allocate (self%rho(a(1):b(1), a(2):b(2), a(3):b(3)), source=0.0_wp)
    if (self%implicit_momentum) return
    allocate (self%kick(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
    allocate (self%correction, source=self%kick)
  end subroutine monolithic_init

  !> Stage 3: the motion of the bodies as it goes on, the merged cells at the start; for C-ISMAC the
  !! acceleration of the cells, else how the faces at the surface differ from them, and the first
  !! half of the old pressure.
  subroutine begin(self, s, blocks)
    class(monolithic_t), intent(inout) :: self
    type(stage_t), intent(in) :: s
    type(blocks_t), intent(in) :: blocks
    type(merged_cells_t), allocatable :: keep
    integer :: b

    ! what the motion changes by in this step if the bodies accelerate as in the step before, like
    ! the fluid that gets the old pressure
    self%extrapolated = 0.0_wp
    do b = 1, blocks%n
      if (blocks%path(b)%n > 0 .and. blocks%present(b)) then
        self%extrapolated(:, b) = change_by_motion(blocks, b, s%dt)
      end if
      if (.not. self%bodies%free(b)) cycle
      self%extrapolated(1:3, b) = s%dt*(self%fluid%gravity + (blocks%fluid_force(:, b) &
        - blocks%film_force(1:3, b) + blocks%contact_force(:, b))/blocks%mass(b))
      self%extrapolated(4:6, b) = s%dt*matmul(self%bodies%inverse_inertia(:, :, b), &
        blocks%fluid_torque(:, b) - blocks%film_force(4:6, b) + blocks%contact_torque(:, b))
    end do
    ! the merged cells of the end of the last step, or new ones if blocks have come
    call move_alloc(self%merged_before, keep)
    call move_alloc(self%merged, self%merged_before)
    call move_alloc(keep, self%merged)
    call find_merged_cells(s%grid, s%solid, self%merged_before)
    associate (grid => s%grid, solid => s%solid, flow => s%flow, fluid => self%fluid, &
               a => self%acceleration)
      call find_liquid(grid, flow, a%kicked)
      if (self%implicit_momentum) then
        call find_surface_force(s, self)
        call keep_acceleration(s, solid%aperture, flow%rho, self)
        call give(s%scratch, self%tension%force)
      else
        call store_correction(grid, solid%alpha, flow%rho, flow%u, flow%uf, self%correction)
        call advect_pressure(grid, fluid%liquid_density*merge(0.0_wp, fluid%gravity, &
                             grid%periodic), solid%alpha, self%bodies, s%dt, a, flow%p)
        call face_acceleration(grid, fluid%gravity, flow%rho, flow%rho, flow%p, a%face, flow%sides)
        call find_first_half(grid, solid, self%merged_before, self%bodies, &
                             self%extrapolated/s%dt, flow%rho, a)
        call add_first_half(grid, fluid, s%dt, a, flow, self%kick)
      end if
    end associate
  end subroutine begin

  !> Stage 9: small cells at the new places and their targets, one momentum for each group; inertia
  !! of the fluid in cut cells; how fast the fluid runs past the walls.
  subroutine average_momentum(self, s)
    class(monolithic_t), intent(inout) :: self
    type(stage_t), intent(in) :: s
    integer :: k

    associate (grid => s%grid, solid => s%solid, flow => s%flow, merged => self%merged, &
               balance => self%balance)
      call find_merged_cells(grid, solid, merged)
      ! Weight has the density of the level at which a cell lies, bodies thought away, so that still
      ! water stays still; inertia has it, too, but in the cells at walls (`begin_balance`).
      !$omp parallel do schedule(static)
      do k = grid%first(3), grid%last(3)
        self%rho(:, :, k) = flow%rho(:, :, k)
      end do
      call begin_balance(grid, self%fluid, solid, merged, flow, self%rho, balance)
      call match_densities(grid, self%rho, merged)
      call find_slip(grid, solid, self%at_start, s%dt, flow%u, merged)
      call store_velocity(grid, merged, flow%u, balance%before)
      call share_momentum(grid, merged, balance%mass, self%at_start, balance%before, flow%u, &
                          balance%to_wall)
      call find_wall_speeds(grid, solid, self%at_start, flow%u, merged)
    end associate
  end subroutine average_momentum

  !> The system of the pressure, and the flux of the unit motions of the bodies.
  subroutine build_pressure_system(self, s)
    class(monolithic_t), intent(inout) :: self
    type(stage_t), intent(in) :: s

    associate (system => self%pressure%system)
      call set_pressure_system(s%grid, s%solid%effective, self%rho, system, s%flow%sides)
      call build_rigid_flux(s%grid, s%solid, self%bodies, system%active, system%operator%flux)
    end associate
  end subroutine build_pressure_system

  !> Stage 10: weight, old pressure, surface tension and surface stress, on cells and bodies. Cells
  !! at the surface and in gas get the first three after the faces.
  subroutine add_forces(self, s)
    class(monolithic_t), intent(inout) :: self
    type(stage_t), intent(in) :: s
    real(wp), allocatable :: by_stress(:, :, :, :)   ! acceleration of the cells [m/s2]

    call take(s%scratch, by_stress)
    call find_surface_force(s, self)
    associate (grid => s%grid, flow => s%flow, bodies => self%bodies, a => self%acceleration, &
               force => self%force, flux => self%pressure%system%operator%flux)
      call face_acceleration(grid, self%fluid%gravity, flow%rho, self%rho, flow%p, a%face, &
                             flow%sides)
      call add_tension(grid, self%rho, self%tension, a%face)
      self%held_motion = self%at_start%motion + self%extrapolated
      call accelerations_of_groups(s, self%extrapolated, self)
      if (self%implicit_momentum) call fill_velocity_halo(grid, flow%u)   ! groups have shared
      call surface_stress(grid, s%solid%alpha, self%rho, flow%mu, flow%u, by_stress)
      if (self%implicit_momentum) then
        call accelerate_cells(s, self)
      else
        call change_where(grid, a%kicked, .true., flow%u, 0.5_wp*s%dt, a%cell)   ! the second half
        force(:, :, by_half_kick) = force_of_half_kick(grid, self%fluid, self%merged_before, &
          self%merged, bodies, s%dt, flow, a, self%kick)
      end if
      call add_product(grid, s%dt, by_stress, flow%u)

      call force_from_faces(grid, bodies, flux, flow%p, force(:, :, by_old_pressure), flow%sides)
      call force_from_tension(grid, bodies, flux, self%tension, force(:, :, by_old_pressure))
      self%defect = mass_defect(grid, self%fluid, s%solid, bodies, flux, flow)
      self%held = held_mass(grid, bodies, flux, flow%rho)
      call set_fluid_inertia(self%fluid%gravity, s%dt, self)
      call move_by_forces(s%dt, self)
    end associate
    call give(s%scratch, self%tension%force)
    call give(s%scratch, by_stress)
  end subroutine add_forces

  !> Accelerations of the cells from those of the faces, and what groups make of them.
  subroutine accelerations_of_groups(s, change, self)
    type(stage_t), intent(in) :: s
    real(wp), intent(in) :: change(:, :)   !! (6, bodies) of their motion that held fluid gets
    class(monolithic_t), intent(inout) :: self

    associate (grid => s%grid, aperture => s%solid%aperture, a => self%acceleration)
      call cell_mean_of_faces(grid, aperture, a%face, a%cell)
      call hold_in_cells(grid, s%solid, self%bodies, change/s%dt, a%face, a%cell)
      call add_push(grid, self%merged, s%dt, a%cell, self%balance)
      call halo_exchange(a%cell, n_halo)
      call share_acceleration(grid, aperture, self%rho, self%merged, a%cell)
      call add_push(grid, self%merged, s%dt, a%cell, self%balance, taken=.true.)
    end associate
  end subroutine accelerations_of_groups

  !> Stage 11: viscosity, in cells and bodies at once; with C-ISMAC advection, too.
  subroutine add_viscosity(self, s)
    class(monolithic_t), intent(inout) :: self
    type(stage_t), intent(in) :: s

    call take_arrays(s%scratch, self%viscous)
    associate (grid => s%grid, solid => s%solid, u => s%flow%u, bodies => self%bodies, &
               viscous => self%viscous, merged => self%merged, balance => self%balance)
      call fill_velocity_halo(grid, u)
      call store_velocity(grid, merged, u, balance%before)
      ! The wall as contact leaves it, with the fluid forces of the last step: one that stops drags
      ! the centres near it to rest, and seen from it as it was the mean would turn back by 1/T_c;
      ! without those forces a sphere in a narrow tube never falls steadily.
      if (.not. self%implicit_momentum) then   ! that carries the mean in the same solve
        call find_centres(grid, solid, self%expected, s%dt, u, merged)
        call to_centres(grid, merged, self%expected, u)
      end if
      call build_viscous(grid, solid, bodies, self%rho, s%flow%mu, s%dt, viscous, merged)
      call predict_velocity(s, self%rho, self)
      call to_centres(grid, merged, self%expected, u, back=.true.)
      call fill_velocity_halo(grid, u, layers=1)
      call follow_targets(grid, merged, balance%mass, balance%before, u, balance%to_wall)
      self%force(:, :, by_viscosity) = viscous%force
      call move_by_forces(s%dt, self)   ! to round-off, unlike the motion of the solver
      call impose_rigid_velocity(grid, solid, merged, bodies, u)
    end associate
    call give_arrays(s%scratch, self%viscous)
  end subroutine add_viscosity

  !> Stage 12: velocity of the faces before the pressure.
  subroutine predict_faces(self, s)
    class(monolithic_t), intent(inout) :: self
    type(stage_t), intent(in) :: s
    type(rigid_motion_t) :: predicted   ! at the end, by `extrapolated`

    predicted%x = self%bodies%x
    predicted%motion = self%at_start%motion + self%extrapolated
    associate (grid => s%grid, dt => s%dt, flow => s%flow, a => self%acceleration, &
               merged => self%merged)
      call fill_velocity_halo(grid, flow%u, layers=1)
      call halo_exchange(a%cell, n_halo, layers=1)
      call find_liquid(grid, flow, a%in_liquid, among=a%kicked)   ! the surface may have come
      if (self%implicit_momentum) then
        call predict_face_velocity(grid, dt, self%rho, a, flow)
      else
        call predict_face_velocity(grid, dt, self%rho, a, flow, self%correction)
        call shorten_at_walls(grid, dt, self%bodies, merged, self%rho, a, flow)
      end if
      call face_velocity_at_walls(grid, s%solid, self%at_start, predicted, merged, dt, &
                                  self%implicit_momentum, self%rho, a, flow)
      if (self%implicit_momentum) then
        call renew_acceleration(s, self)
      else
        call change_where(grid, a%kicked, .false., flow%u, dt, a%cell)   ! the whole
      end if
    end associate
  end subroutine predict_faces

  !> Stage 13: pressure and motion of the bodies in one solve. What the walls bear
  !! (`wall_balance_m`) is known only afterwards: free bodies get it, and the pressure follows in a
  !! second solve; the little that this one changes of it is left to the next step.
  subroutine project(self, s)
    class(monolithic_t), intent(inout) :: self
    type(stage_t), intent(in) :: s
    real(wp), dimension(6, self%bodies%n) :: of_walls, without
    type(pressure_report_t) :: rough   ! of the first solve
    integer :: b

    associate (bodies => self%bodies, pressure => self%pressure)
      self%left_over = 0.0_wp
      if (any(bodies%free)) then
        call solve_once(s, rough_factor*pressure%tolerance, self, of_walls)
        rough = pressure%report
        self%force(:, :, by_walls) = of_walls
        call move_by_forces(s%dt, self)
        call solve_once(s, pressure%tolerance, self, of_walls)
        pressure%report = both_solves(rough, pressure%report)
        do b = 1, bodies%n
          if (bodies%free(b)) self%left_over(:, b) = of_walls(:, b) - self%force(:, b, by_walls)
        end do
      else
        call solve_once(s, pressure%tolerance, self, of_walls)
        self%force(:, :, by_walls) = of_walls
      end if
      call impose_rigid_velocity(s%grid, s%solid, self%merged, bodies, s%flow%u)
      call fill_velocity_halo(s%grid, s%flow%u)
      call force_from_faces(s%grid, bodies, pressure%system%operator%flux, s%flow%p, self%of_films)
      call extend_pressure(s%grid, self%fluid%gravity, s%solid, s%flow, pressure)
      call force_from_faces(s%grid, bodies, pressure%system%operator%flux, s%flow%p, without)
      self%of_films = self%of_films - without
      self%total = sum(self%force, 3)
      do b = 1, bodies%n   ! the displaced fluid resists the acceleration that the solve has found
        if (bodies%free(b)) self%total(:, b) = self%total(:, b) &
          + matmul(bodies%defect(:, :, b), bodies%motion(:, b) - self%unforced_motion(:, b))/s%dt
      end do
    end associate
  end subroutine project

  !> Pressure and motion of the bodies, the cells after them, and the force that the walls bear so
  !! far.
  subroutine solve_once(s, tolerance, self, of_walls)
    type(stage_t), intent(in) :: s
    real(wp), intent(in) :: tolerance   !! of the divergence [1/s]
    class(monolithic_t), intent(inout) :: self
    real(wp), intent(out) :: of_walls(:, :)   !! (6, bodies) [N, N m]
    real(wp), parameter :: weightless(3) = 0.0_wp
    real(wp) :: from_faces(6, self%bodies%n), inertia(6, 6)
    integer :: b

    associate (grid => s%grid, flow => s%flow, bodies => self%bodies, pressure => self%pressure, &
               a => self%acceleration, by_pressure => self%force(:, :, by_new_pressure))
      call solve_pressure(s, self%rho, bodies, pressure, tolerance)
      call face_acceleration(grid, weightless, self%rho, self%rho, pressure%phi_total, a%face, &
                             flow%sides)
      call accelerations_of_groups(s, bodies%motion - self%held_motion, self)
      self%held_motion = bodies%motion
      call add_product(grid, s%dt, a%cell, flow%u)
      call force_from_faces(grid, bodies, pressure%system%operator%flux, pressure%phi_total, &
                            from_faces)
      by_pressure = by_pressure + from_faces
      call force_of_walls(grid, self%merged, bodies, self%at_start, s%dt, self%balance, of_walls)
      ! less what they bear as the fluid that no aperture counts moves with the bodies, which
      ! `set_fluid_inertia` has given them
      do b = 1, bodies%n
        inertia = symmetric(self%defect(:, :, b) + self%held(:, :, b))
        of_walls(1:3, b) = of_walls(1:3, b) - matmul(inertia(1:3, :), &
          bodies%motion(:, b) - self%at_start%motion(:, b))/s%dt
      end do
    end associate
  end subroutine solve_once

  !> Stage 14: the velocity of all the fluid in a face, held fluid included, and the flux of the
  !! solids; what is left of the force of the walls acts in the next step.
  subroutine close_faces(self, s, blocks)
    class(monolithic_t), intent(inout) :: self
    type(stage_t), intent(in) :: s
    type(blocks_t), intent(inout) :: blocks

    blocks%lagged_force = self%left_over(:, :blocks%n)
    blocks%film_force = self%of_films(:, :blocks%n)
    call all_fluid_of_faces(s%grid, s%solid, self%bodies, self%pressure%system%operator%flux, &
                            s%flow%uf, s%flow%solid_flux)
  end subroutine close_faces

  !> Give free bodies the inertia of the fluid that the faces do not count, and the force of it as
  !! far as it is known before the solve: -defect (g - a), a by weight and contact, or by the given
  !! motion.
  subroutine set_fluid_inertia(gravity, dt, self)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: dt           !! [s]
    class(monolithic_t), intent(inout) :: self
    real(wp) :: inertia(6, 6)
    integer :: b

    self%bodies%clipped = .false.
    do b = 1, size(self%defect, 3)
      inertia = symmetric(self%defect(:, :, b))
      if (self%bodies%free(b)) then
        call set_inertia(b, self%bodies, inertia)
        inertia = self%bodies%defect(:, :, b)
      end if
      self%force(:, b, by_displaced) = matmul(inertia, self%bodies%motion(:, b) &
        - self%at_start%motion(:, b))/dt - matmul(self%defect(:, :, b), gravity)
    end do
  end subroutine set_fluid_inertia

  !> A defect as an inertia, without that of rotations.
  pure function symmetric(defect) result(inertia)
    real(wp), intent(in) :: defect(6, 3)   !! [kg, kg m]
    real(wp) :: inertia(6, 6)

    inertia = 0.0_wp
    inertia(:, 1:3) = defect
    inertia(1:3, 4:6) = transpose(defect(4:6, :))
  end function symmetric

  !> Force and torque of the fluid on bodies that are let go, with the pressure by which they
  !! accelerate it, which is added to the pressure: (M + M_a) a = (M - M_displaced) g.
  subroutine force_at_release(self, s, begins, force)
    class(monolithic_t), intent(inout) :: self   !! its bodies in place
    type(stage_t), intent(in) :: s
      !! with the time in which they begin to move; of the flow only the pressure changes
    logical, intent(in) :: begins(:)             !! (blocks) those let go; all others are held
    real(wp), intent(out) :: force(:, :)         !! (6, bodies), buoyancy of the others [N, N m]
    real(wp), parameter :: weightless(3) = 0.0_wp
    real(wp), allocatable :: uf(:, :, :, :), solid_flux(:, :, :, :)
    type(rigid_motion_t) :: moving
    real(wp) :: a(6)
    integer :: b

    moving = self%bodies
    associate (grid => s%grid, solid => s%solid, flow => s%flow, dt => s%dt, &
               bodies => self%bodies, system => self%pressure%system)
      allocate (uf, source=flow%uf)
      allocate (solid_flux, source=flow%solid_flux)
      call displaced_force(grid, self%fluid, solid, bodies, flow%c, force)
      bodies%motion = 0.0_wp
      do b = 1, bodies%n
        bodies%free(b) = .false.
        if (b <= size(begins)) bodies%free(b) = moving%free(b) .and. begins(b)
        if (bodies%free(b)) force(1:3, b) = force(1:3, b) + bodies%mass(b)*self%fluid%gravity
      end do
      self%at_start = bodies
      call set_pressure_system(grid, solid%effective, flow%rho, system, flow%sides)
      call build_rigid_flux(grid, solid, bodies, system%active, system%operator%flux)
      self%defect = mass_defect(grid, self%fluid, solid, bodies, system%operator%flux, flow)
      call set_fluid_inertia(weightless, dt, self)
      call push_bodies(dt, force, bodies)
      flow%uf = 0.0_wp
      call solve_pressure(s, flow%rho, bodies, self%pressure)
      do b = 1, bodies%n
        if (.not. bodies%free(b)) cycle
        a = bodies%motion(:, b)/dt
        force(1:3, b) = bodies%mass(b)*(a(1:3) - self%fluid%gravity)
        force(4:6, b) = matmul(bodies%inertia(:, :, b), a(4:6))
      end do
      call extend_pressure(grid, self%fluid%gravity, solid, flow, self%pressure)
      self%bodies = moving
      call move_alloc(uf, s%flow%uf)
      call move_alloc(solid_flux, s%flow%solid_flux)
    end associate
  end subroutine force_at_release

  !> Cells in a body that hold no small cell move with it.
  subroutine impose_rigid_velocity(grid, solid, merged, bodies, u)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(merged_cells_t), intent(in) :: merged
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    integer :: i, j, k, b

    !$omp parallel do private(i, j, b) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        if (maxval(solid%inside(grid%lo(1):grid%hi(1), j, k)) == 0) cycle
        do i = grid%lo(1), grid%hi(1)
          b = solid%inside(i, j, k)
          if (b == 0 .or. merged%number(i, j, k) > 0) cycle
          u(i, j, k, :) = velocity_in_cell(grid, bodies, b, [i, j, k])
        end do
      end do
    end do
  end subroutine impose_rigid_velocity

end module monolithic_m
