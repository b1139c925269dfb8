!> The paper's coupling: one mass-averaged velocity for fluid and solids.
!!
!! The mixture density carries the inertia of the bodies into the projection; the force on a body is
!! the volume integral of -grad p + div tau over it; then the cells take the rigid velocity by mass
!! average. Known (measured, docs/decisions/coupling.md): the average thickens the body and the
!! force lags, so a released sphere starts some per cent off, by an amount that depends on the step;
!! and the last average leaves some divergence, which the report shows.
!! Source: Yoshikawa et al. (2008), section 3 (2); order of the steps as in Sharma & Patankar
!! (2005).
module mass_average_m
  use kinds_m, only: wp, i8
  use vectors_m, only: cross
  use case_types_m, only: case_t, fluid_t
  use grid_m, only: grid_t, n_halo, unit_step
  use scratch_m, only: take, give
  use stage_m, only: stage_t
  use fields_m, only: flow_t, add_product
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use rigid_motion_m, only: rigid_motion_t, wall_velocity
  use rigid_flux_m, only: build_rigid_flux, nearest_arm
  use viscous_system_m, only: take_arrays, give_arrays
  use viscous_links_m, only: build_viscous
  use momentum_c_ismac_m, only: advected_velocity
  use pressure_system_m, only: set_pressure_system
  use pressure_m, only: pressure_report_t, solve_pressure, both_solves, divergence
  use face_velocity_m, only: face_acceleration, cell_mean_of_faces, predict_face_velocity
  use buoyancy_m, only: displaced_force
  use surface_stress_m, only: surface_stress
  use surface_tension_m, only: add_tension
  use coupling_m, only: coupling_t, coupling_init, move_by_forces, &
    by_displaced, by_new_pressure, &
    accelerate_cells, keep_acceleration, predict_velocity, renew_acceleration, find_surface_force
  use rigid_body_m, only: blocks_t
  use mixture_m, only: face_mean
  use boundary_m, only: fill_velocity_halo, fill_scalar_halo
  use parallel_m, only: halo_exchange
  use exact_sum_m, only: exact_add_columns, exact_totals, accumulator_size, no_terms
  implicit none
  private
  public :: mass_average_t, mass_average_init, density_of_mixture

  real(wp), parameter :: held_ratio = 1.0e3_wp   !! density of a fixed body over the liquid's [-]

  type, extends(coupling_t) :: mass_average_t
    integer :: passes = 1
    type(solid_geometry_t) :: whole                !! the domain without solids
    real(wp), allocatable :: rho(:, :, :)          !! of the mixture of fluid and solid [kg/m3]
    real(wp), allocatable :: u_before(:, :, :, :)  !! velocity before the predictor [m/s]
  contains
    procedure :: force_at_release
    procedure :: begin
    procedure :: average_momentum
    procedure :: build_pressure_system
    procedure :: add_forces
    procedure :: add_viscosity
    procedure :: predict_faces
    procedure :: project
    procedure :: close => overlay_bodies
  end type mass_average_t

contains

  !> Allocate for a grid and n bodies.
  subroutine mass_average_init(grid, n, case, self)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: n
    type(case_t), intent(in) :: case
    type(mass_average_t), intent(out) :: self
    integer :: a(3), b(3)

    call coupling_init(grid, n, case, self)
    self%passes = case%numerics%coupling_passes
    a = grid%first
    b = grid%last
    call solid_geometry_init(grid, self%whole, n)
    allocate (self%rho(a(1):b(1), a(2):b(2), a(3):b(3)), source=0.0_wp)
    allocate (self%u_before(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
  end subroutine mass_average_init

  !> Archimedes' force: the mixture makes the inertia of the fluid.
  subroutine force_at_release(self, s, begins, force)
    class(mass_average_t), intent(inout) :: self
    type(stage_t), intent(in) :: s
    logical, intent(in) :: begins(:)
    real(wp), intent(out) :: force(:, :)

    associate (unused => begins)
    end associate
    call displaced_force(s%grid, self%fluid, s%solid, self%bodies, s%flow%c, force)
  end subroutine force_at_release

  !> Stage 3: with C-ISMAC the acceleration of the cells.
  subroutine begin(self, s, blocks)
    class(mass_average_t), intent(inout) :: self
    type(stage_t), intent(in) :: s
    type(blocks_t), intent(in) :: blocks

    associate (unused => blocks)
    end associate
    if (.not. self%implicit_momentum) return
    call find_surface_force(s, self)
    call density_of_mixture(s%grid, self%fluid, s%solid, self%bodies, s%flow%rho, self%rho)
    call keep_acceleration(s, self%whole%aperture, self%rho, self)
    call give(s%scratch, self%tension%force)
  end subroutine begin

  !> Stage 9: one velocity for fluid and bodies in a cell, the mean by mass. Buoyancy and the
  !! contact force act on the bodies before; gravity in the mixture is that of the fluid, so still
  !! water stays still.
  subroutine average_momentum(self, s)
    class(mass_average_t), intent(inout) :: self
    type(stage_t), intent(in) :: s

    associate (bodies => self%bodies)
      call displaced_force(s%grid, self%fluid, s%solid, bodies, s%flow%c, &
                           self%force(:, :, by_displaced))
      call move_by_forces(s%dt, self)
      call density_of_mixture(s%grid, self%fluid, s%solid, bodies, s%flow%rho, self%rho)
      call average_cells(s%grid, self%fluid, s%solid, bodies, s%flow, self%rho)
    end associate
    self%u_before = s%flow%u
  end subroutine average_momentum

  !> The same for the mixture, which has no walls.
  subroutine build_pressure_system(self, s)
    class(mass_average_t), intent(inout) :: self
    type(stage_t), intent(in) :: s

    associate (system => self%pressure%system)
      call set_pressure_system(s%grid, self%whole%aperture, self%rho, system, s%flow%sides)
      call build_rigid_flux(s%grid, self%whole, self%bodies, system%active, system%operator%flux)
    end associate
  end subroutine build_pressure_system

  !> Stage 10: old pressure, weight of the fluid, surface tension and surface stress.
  subroutine add_forces(self, s)
    class(mass_average_t), intent(inout) :: self
    type(stage_t), intent(in) :: s
    real(wp), allocatable :: by_stress(:, :, :, :)   ! acceleration of the cells [m/s2]
    integer :: d

    call take(s%scratch, by_stress)
    associate (grid => s%grid, flow => s%flow, a => self%acceleration)
      call face_acceleration(grid, self%fluid%gravity, flow%rho, self%rho, flow%p, a%face, &
                             flow%sides)
      call find_surface_force(s, self)
      call add_tension(grid, self%rho, self%tension, a%face)
      call give(s%scratch, self%tension%force)
      call cell_mean_of_faces(grid, self%whole%aperture, a%face, a%cell)
      if (self%implicit_momentum) then   ! the mixture passes whole faces
        do d = 1, 3
          self%c_ismac%q(:, :, :, d) = s%dt*grid%area(d)*flow%uf(:, :, :, d)
        end do
      end if
      call surface_stress(grid, s%solid%alpha, self%rho, flow%mu, flow%u, by_stress)
      call accelerate_cells(s, self)
      call add_product(grid, s%dt, by_stress, flow%u)
    end associate
    call give(s%scratch, by_stress)
  end subroutine add_forces

  !> Stage 11: viscosity of the mixture; with C-ISMAC advection, too.
  subroutine add_viscosity(self, s)
    class(mass_average_t), intent(inout) :: self
    type(stage_t), intent(in) :: s

    call take_arrays(s%scratch, self%viscous)
    call build_viscous(s%grid, self%whole, self%bodies, self%rho, s%flow%mu, s%dt, self%viscous)
    call predict_velocity(s, self%rho, self)
    if (self%implicit_momentum) then   ! the force on a body has no part in advection
      call advected_velocity(s%grid, self%rho, s%dt, self%viscous, self%c_ismac, self%u_before)
    end if
    call give_arrays(s%scratch, self%viscous)
  end subroutine add_viscosity

  !> Stage 12: velocity of the faces before the pressure.
  subroutine predict_faces(self, s)
    class(mass_average_t), intent(inout) :: self
    type(stage_t), intent(in) :: s

    call halo_exchange(self%acceleration%cell, n_halo)
    call fill_velocity_halo(s%grid, s%flow%u)
    call predict_face_velocity(s%grid, s%dt, self%rho, self%acceleration, s%flow)
    call renew_acceleration(s, self)
  end subroutine predict_faces

  !> Stage 13: projection of the mixture and the force on the bodies; `coupling_passes` times, later
  !! passes from the mean by mass alone.
  subroutine project(self, s)
    class(mass_average_t), intent(inout) :: self
    type(stage_t), intent(in) :: s
    type(pressure_report_t) :: before   ! of the passes so far
    integer :: pass

    associate (grid => s%grid, flow => s%flow, a => self%acceleration)
      do pass = 1, self%passes
        if (pass > 1) then
          call average_cells(grid, self%fluid, s%solid, self%bodies, flow, self%rho)
          self%u_before = flow%u
          a%cell = 0.0_wp
          a%face = 0.0_wp
          call fill_velocity_halo(grid, flow%u)
          call predict_face_velocity(grid, s%dt, self%rho, a, flow)
        end if
        before = self%pressure%report
        call project_mixture(s, self)
        if (pass > 1) self%pressure%report = both_solves(before, self%pressure%report)
        call momentum_gained(grid, s%solid, s%dt, flow%u, self)
        call move_by_forces(s%dt, self)
      end do
    end associate
    self%total = sum(self%force, 3)
  end subroutine project

  !> Density of fluid and solids in each cell: rho = (1 - alpha) rho_fl + sum alpha_k rho_k [kg/m3].
  subroutine density_of_mixture(grid, fluid, solid, bodies, rho, mixture)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(inout), contiguous :: mixture(grid%first(1):, grid%first(2):, grid%first(3):)
    integer :: b, m

    mixture = (1.0_wp - solid%alpha)*rho
    do b = 1, bodies%n
      do m = solid%body_cell(b), solid%body_cell(b + 1) - 1
        associate (i => solid%cell(:, m))
          mixture(i(1), i(2), i(3)) = mixture(i(1), i(2), i(3)) &
            + solid%cell_alpha(m)*body_density(fluid, bodies, b)
        end associate
      end do
    end do
    call fill_scalar_halo(grid, mixture)
  end subroutine density_of_mixture

  !> Density with which a body enters the mixture [kg/m3].
  pure function body_density(fluid, bodies, b) result(rho)
    type(fluid_t), intent(in) :: fluid
    type(rigid_motion_t), intent(in) :: bodies
    integer, intent(in) :: b
    real(wp) :: rho

    rho = merge(bodies%mass(b)/bodies%volume(b), held_ratio*fluid%liquid_density, bodies%free(b))
  end function body_density

  !> Mass average of the fluid velocity and the rigid velocity in every cell a body reaches:
  !! u = [(1 - alpha) rho_fl u + sum alpha_k rho_k (U_k + Omega_k x r)]/rho, r to the solid
  !! centroid.
  subroutine average_cells(grid, fluid, solid, bodies, flow, mixture)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    type(flow_t), intent(inout) :: flow
    real(wp), intent(in), contiguous :: mixture(grid%first(1):, grid%first(2):, grid%first(3):)
    integer :: b, c, m
    real(wp) :: arm(3)

    do c = 1, 3
      where (solid%alpha > 0.0_wp) flow%u(:, :, :, c) = (1.0_wp - solid%alpha)*flow%rho*flow%u(:, &
          :, :, c)/mixture
    end do
    do b = 1, bodies%n
      do m = solid%body_cell(b), solid%body_cell(b + 1) - 1
        arm = nearest_arm(grid, solid%cell_centroid(:, m), bodies%x(:, b))
        associate (i => solid%cell(:, m))
          flow%u(i(1), i(2), i(3), :) = flow%u(i(1), i(2), i(3), :) + solid%cell_alpha(m) &
            *body_density(fluid, bodies, b)/mixture(i(1), i(2), i(3)) &
            *wall_velocity(bodies%motion(:, b), arm)
        end associate
      end do
    end do
    call fill_velocity_halo(grid, flow%u)
  end subroutine average_cells

  !> Projection of the mixture velocity, on the faces and in the cells.
  subroutine project_mixture(s, self)
    type(stage_t), intent(in) :: s
    class(mass_average_t), intent(inout), target :: self
    real(wp), parameter :: weightless(3) = 0.0_wp
    type(stage_t) :: of_mixture
    type(rigid_motion_t) :: none

    of_mixture = s
    of_mixture%solid => self%whole
    none%n = 0
    allocate (none%free(0))
    associate (grid => s%grid, flow => s%flow, p => self%pressure, a => self%acceleration)
      call solve_pressure(of_mixture, self%rho, none, p)
      call face_acceleration(grid, weightless, flow%rho, self%rho, p%phi_total, a%face, &
                             flow%sides)
      call cell_mean_of_faces(grid, self%whole%aperture, a%face, a%cell)
      call add_product(grid, s%dt, a%cell, flow%u)
      call fill_velocity_halo(grid, flow%u)
    end associate
  end subroutine project_mixture

  !> Add to the force by pressure the volume integral of -grad p + div tau less its hydrostatic part
  !! over each body: the momentum that the mixture gained in its cells since `u_before`.
  subroutine momentum_gained(grid, solid, dt, u, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    class(mass_average_t), intent(inout) :: self
    integer(i8) :: accumulator(accumulator_size, 6*self%bodies%n)
    real(wp) :: total(6*self%bodies%n), f(3)
    real(wp), allocatable :: terms(:, :)   ! (cells of a body, 6)
    integer :: b, m, n

    accumulator = spread(no_terms, 2, 6*self%bodies%n)
    do b = 1, self%bodies%n
      allocate (terms(solid%body_cell(b + 1) - solid%body_cell(b), 6))
      n = 0
      do m = solid%body_cell(b), solid%body_cell(b + 1) - 1
        associate (i => solid%cell(:, m))
          if (any(i < grid%lo) .or. any(i > grid%hi)) cycle
          n = n + 1
          f = solid%cell_alpha(m)*grid%volume*self%rho(i(1), i(2), i(3))/dt &
              *(u(i(1), i(2), i(3), :) - self%u_before(i(1), i(2), i(3), :))
          terms(n, 1:3) = f
          terms(n, 4:6) = cross(nearest_arm(grid, solid%cell_centroid(:, m), &
                                            self%bodies%x(:, b)), f)
        end associate
      end do
      call exact_add_columns(terms(1:n, :), accumulator(:, 6*b - 5:6*b))
      deallocate (terms)
    end do
    call exact_totals(accumulator, total)
    self%force(:, :, by_new_pressure) = self%force(:, :, by_new_pressure) &
                                        + reshape(total, [6, self%bodies%n])
  end subroutine momentum_gained

  !> Stage 14: give cells and faces the final rigid velocity by mass average; what divergence that
  !! leaves is reported, since it is what the next step transports with.
  subroutine overlay_bodies(self, s, blocks)
    class(mass_average_t), intent(inout) :: self
    type(stage_t), intent(in) :: s
    type(blocks_t), intent(inout) :: blocks
    integer :: b, d, m, i(3), low(3)
    real(wp) :: rigid(3), share

    associate (unused => blocks)
    end associate
    associate (grid => s%grid, solid => s%solid, flow => s%flow, system => self%pressure%system)
      call average_cells(grid, self%fluid, solid, self%bodies, flow, self%rho)
      do b = 1, self%bodies%n
        do m = solid%body_face(b), solid%body_face(b + 1) - 1
          d = solid%face(4, m)
          i = solid%face(1:3, m)
          low = i - unit_step(:, d)
          if (any((i < 1 .or. low < 1 .or. i > grid%n) .and. .not. grid%periodic)) cycle
          rigid = wall_velocity(self%bodies%motion(:, b), &
                                nearest_arm(grid, solid%face_centroid(:, m), self%bodies%x(:, b)))
          share = solid%face_beta(m)*body_density(self%fluid, self%bodies, b)   ! of the mass
          share = share/(share + (1.0_wp - solid%face_beta(m))*face_mean( &
            flow%rho(low(1), low(2), low(3)), flow%rho(i(1), i(2), i(3))))
          flow%uf(i(1), i(2), i(3), d) = flow%uf(i(1), i(2), i(3), d) + share*(rigid(d) &
              - flow%uf(i(1), i(2), i(3), d))
        end do
      end do
      do d = 1, 3
        flow%solid_flux(:, :, :, d) = (1.0_wp - solid%aperture(:, :, :, d))*grid%area(d) &
                                      *flow%uf(:, :, :, d)
      end do
      call divergence(grid, solid%aperture, flow, system%active, system%solver%rhs, &
                      self%pressure%report%divergence)
    end associate
  end subroutine overlay_bodies

end module mass_average_m
