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
  use case_types_m, only: case_t
  use grid_m, only: grid_t, n_halo, unit_step
  use fields_m, only: flow_t, add_product
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t, wall_velocity
  use rigid_flux_m, only: build_rigid_flux, nearest_arm
  use viscous_legs_m, only: build_viscous
  use momentum_c_ismac_m, only: flux_of_faces, advected_velocity
  use pressure_system_m, only: set_pressure_system
  use pressure_m, only: solve_pressure, divergence
  use face_velocity_m, only: face_acceleration, cell_mean_of_faces, predict_face_velocity
  use buoyancy_m, only: displaced_force
  use surface_stress_m, only: surface_stress
  use surface_tension_m, only: add_tension
  use velocity_stage_m, only: stage_t, stage_report_t, push_bodies, accelerate_cells, &
    predict_velocity, renew_acceleration, find_surface_force, return_surface_force
  use mixture_m, only: face_mean
  use boundary_m, only: fill_velocity_halo, fill_scalar_halo
  use parallel_m, only: halo_exchange
  use growing_m, only: ensure_rows
  use exact_sum_m, only: exact_add_columns, exact_totals, bin_size, no_terms
  implicit none
  private
  public :: mass_average_stage, overlay_bodies, density_of_mixture

  real(wp), parameter :: held_density = 1.0e6_wp   !! inertia of a fixed body in the mixture [kg/m3]

contains

  !> Velocity after predictor and projection of the mixture, `coupling_passes` times, and the force.
  !!
  !! Weight less buoyancy and the contact force act on the mixture before the projection, in the
  !! cells of the body; gravity in the mixture is that of the fluid, so still water stays still.
  subroutine mass_average_stage(case, grid, solid, dt, flow, stage, report)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt   !! [s]
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage
    type(stage_report_t), intent(inout) :: report
    integer :: pass

    associate (bodies => stage%bodies, system => stage%pressure%system)
      call displaced_force(grid, case%fluid, solid, bodies, flow%c, stage%from_level)
      call push_bodies(dt, stage%from_level, bodies)
      stage%total = stage%from_level
      call density_of_mixture(grid, solid, bodies, flow%rho, stage%rho_mixture)
      call set_pressure_system(grid, stage%whole%open, stage%rho_mixture, system, flow%sides)
      call build_rigid_flux(grid, stage%whole, bodies, system%active, system%operator%flux)
      do pass = 1, case%numerics%coupling_passes
        call average_cells(grid, solid, bodies, flow, stage%rho_mixture)
        stage%u_before = flow%u
        if (pass == 1) then
          call predict_mixture(case, grid, solid, dt, flow, stage)
        else
          call predict_again(grid, dt, flow, stage)
        end if
        call project_mixture(grid, dt, flow, stage)
        report%pressure%passes = report%pressure%passes + stage%pressure%report%passes
        report%pressure%iterations = report%pressure%iterations + stage%pressure%report%iterations
        report%pressure%converged = stage%pressure%report%converged &
                                    .and. (pass == 1 .or. report%pressure%converged)
        call momentum_gained(grid, solid, dt, flow%u, stage)
        call push_bodies(dt, stage%from_pressure, bodies)
        stage%total = stage%total + stage%from_pressure
      end do
    end associate
    report%viscous_converged = stage%viscous%converged
  end subroutine mass_average_stage

  !> Density of fluid and solids in each cell: rho = (1 - alpha) rho_fl + sum alpha_k rho_k [kg/m3].
  subroutine density_of_mixture(grid, solid, bodies, rho, mixture)
    type(grid_t), intent(in) :: grid
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
            + solid%cell_alpha(m)*body_density(bodies, b)
        end associate
      end do
    end do
    call fill_scalar_halo(grid, mixture)
  end subroutine density_of_mixture

  !> Density with which a body enters the mixture [kg/m3].
  pure function body_density(bodies, b) result(rho)
    type(rigid_motion_t), intent(in) :: bodies
    integer, intent(in) :: b
    real(wp) :: rho

    rho = merge(bodies%mass(b)/bodies%volume(b), held_density, bodies%free(b))
  end function body_density

  !> Mass average of the fluid velocity and the rigid velocity in every cell a body reaches:
  !! u = [(1 - alpha) rho_fl u + sum alpha_k rho_k (U_k + Omega_k x r)]/rho, r to the solid
  !! centroid.
  subroutine average_cells(grid, solid, bodies, flow, mixture)
    type(grid_t), intent(in) :: grid
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
            *body_density(bodies, b)/mixture(i(1), i(2), i(3))*wall_velocity(bodies%motion(:, b), &
                arm)
        end associate
      end do
    end do
    call fill_velocity_halo(grid, flow%u)
  end subroutine average_cells

  !> Predictor of the mixture: old pressure and gravity of the fluid, then viscosity.
  subroutine predict_mixture(case, grid, solid, dt, flow, stage)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage

    ! `y` is free until the viscous stage.
    associate (a => stage%acceleration, rho => stage%rho_mixture, by_stress => stage%viscous%y)
      call face_acceleration(grid, case%fluid%gravity, flow%rho, rho, flow%p, a%face, flow%sides)
      call find_surface_force(case%fluid, grid, solid, flow%c, stage)
      call add_tension(grid, rho, stage%tension, a%face)
      call return_surface_force(stage)
      call cell_mean_of_faces(grid, stage%whole%open, a%face, a%cell)
      if (stage%implicit_momentum) call flux_of_faces(grid, dt, flow%uf, stage%c_ismac%q)
      call surface_stress(grid, solid%alpha, rho, flow%mu, flow%u, by_stress)
      call accelerate_cells(grid, dt, flow, stage)
      call add_product(grid, dt, by_stress, flow%u)
      call build_viscous(grid, stage%whole, stage%bodies, rho, flow%mu, dt, stage%viscous)
      call predict_velocity(grid, rho, flow, stage)
      if (stage%implicit_momentum) then   ! the force on a body has no part in advection
        call advected_velocity(grid, rho, dt, stage%viscous, stage%c_ismac, stage%u_before)
      end if
      call halo_exchange(a%cell, n_halo)
      call fill_velocity_halo(grid, flow%u)
      call predict_face_velocity(grid, dt, rho, a, flow)
    end associate
    call renew_acceleration(dt, flow, stage)
  end subroutine predict_mixture

  !> Later passes start from the mass average alone.
  subroutine predict_again(grid, dt, flow, stage)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: dt
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage

    stage%acceleration%cell = 0.0_wp
    stage%acceleration%face = 0.0_wp
    call fill_velocity_halo(grid, flow%u)
    call predict_face_velocity(grid, dt, stage%rho_mixture, stage%acceleration, flow)
  end subroutine predict_again

  !> Projection of the mixture velocity, on the faces and in the cells.
  subroutine project_mixture(grid, dt, flow, stage)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: dt
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage
    real(wp), parameter :: weightless(3) = 0.0_wp
    type(rigid_motion_t) :: none

    none%n = 0
    allocate (none%free(0))
    associate (p => stage%pressure, a => stage%acceleration)
      call solve_pressure(grid, stage%whole, stage%rho_mixture, dt, flow, none, p)
      call face_acceleration(grid, weightless, flow%rho, stage%rho_mixture, p%phi_total, a%face, &
                             flow%sides)
      call cell_mean_of_faces(grid, stage%whole%open, a%face, a%cell)
      call add_product(grid, dt, a%cell, flow%u)
    end associate
    call fill_velocity_halo(grid, flow%u)
  end subroutine project_mixture

  !> Volume integral of -grad p + div tau less its hydrostatic part over each body: the momentum
  !! that the mixture gained in its cells since `u_before`.
  subroutine momentum_gained(grid, solid, dt, u, stage)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    type(stage_t), intent(inout) :: stage
    integer(i8) :: bins(bin_size, 6*stage%bodies%n)
    real(wp) :: total(6*stage%bodies%n), f(3)
    integer :: b, m, n

    bins = spread(no_terms, 2, 6*stage%bodies%n)
    do b = 1, stage%bodies%n
      n = 0
      call ensure_rows(solid%body_cell(b + 1) - solid%body_cell(b), stage%terms)
      do m = solid%body_cell(b), solid%body_cell(b + 1) - 1
        associate (i => solid%cell(:, m))
          if (any(i < grid%lo) .or. any(i > grid%hi)) cycle
          n = n + 1
          f = solid%cell_alpha(m)*grid%volume*stage%rho_mixture(i(1), i(2), i(3))/dt &
              *(u(i(1), i(2), i(3), :) - stage%u_before(i(1), i(2), i(3), :))
          stage%terms(n, 1:3) = f
          stage%terms(n, 4:6) = cross(nearest_arm(grid, solid%cell_centroid(:, m), &
                                                  stage%bodies%x(:, b)), f)
        end associate
      end do
      call exact_add_columns(stage%terms(1:n, :), bins(:, 6*b - 5:6*b))
    end do
    call exact_totals(bins, total)
    stage%from_pressure(:, :stage%bodies%n) = reshape(total, [6, stage%bodies%n])
  end subroutine momentum_gained

  !> Give cells and faces the final rigid velocity by mass average; what divergence that leaves is
  !! reported, since it is what the next step transports with.
  subroutine overlay_bodies(grid, solid, flow, stage, report)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(flow_t), intent(inout) :: flow
    type(stage_t), intent(inout) :: stage
    type(stage_report_t), intent(inout) :: report
    integer :: b, d, m, i(3), low(3)
    real(wp) :: rigid(3), share

    call average_cells(grid, solid, stage%bodies, flow, stage%rho_mixture)
    do b = 1, stage%bodies%n
      do m = solid%body_face(b), solid%body_face(b + 1) - 1
        d = solid%face(4, m)
        i = solid%face(1:3, m)
        low = i - unit_step(:, d)
        if (any((i < 1 .or. low < 1 .or. i > grid%n) .and. .not. grid%periodic)) cycle
        rigid = wall_velocity(stage%bodies%motion(:, b), &
                              nearest_arm(grid, solid%face_centroid(:, m), stage%bodies%x(:, b)))
        share = mass_share(solid%face_beta(m), body_density(stage%bodies, b), &
                           face_mean(flow%rho(low(1), low(2), low(3)), flow%rho(i(1), i(2), i(3))))
        flow%uf(i(1), i(2), i(3), d) = flow%uf(i(1), i(2), i(3), d) + share*(rigid(d) &
            - flow%uf(i(1), i(2), i(3), d))
      end do
    end do
    do d = 1, 3
      flow%solid_flux(:, :, :, d) = (1.0_wp - solid%open(:, :, :, d))*grid%area(d)*flow%uf(:, :, &
          :, d)
    end do
    associate (system => stage%pressure%system)
      call divergence(grid, solid%open, flow, system%active, system%solver%rhs, &
                      report%pressure%divergence)
    end associate
  end subroutine overlay_bodies

  !> Share of the solid in the mass at a face that it covers by `beta`.
  elemental function mass_share(beta, rho_solid, rho_fluid) result(share)
    real(wp), intent(in) :: beta, rho_solid, rho_fluid
    real(wp) :: share

    share = beta*rho_solid/(beta*rho_solid + (1.0_wp - beta)*rho_fluid)
  end function mass_share

end module mass_average_m
