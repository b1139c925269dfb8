!> Forces of the surface at the faces, in balance with the pressure gradient: surface tension, and
!! what the weight gains where the liquid of a cell lies (`face_weight_m`).
!!
!! $$ f_f = \sigma \kappa_f \frac{C_{high} - C_{low}}{h} $$
!! It joins gravity and the pressure gradient at the same faces, so a pressure that jumps by
!! sigma kappa where C jumps holds a surface of constant curvature at rest to round-off (balanced
!! force: Francois et al., J. Comput. Phys. 213, 2006). The curvature comes from
!! `surface_curvature_m`.
!!
!! C is the share extended through bodies (`extended_fraction_m`) and repeated at the sides of the
!! domain: the surface meets walls and upright sides of bodies at 90 degrees.
module surface_tension_m
  use kinds_m, only: wp, i8
  use case_types_m, only: fluid_t
  use boundary_kinds_m, only: no_side
  use grid_m, only: grid_t, unit_step
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t
  use rigid_flux_m, only: rigid_flux_t
  use mixture_m, only: face_mean
  use face_weight_m, only: weight_at_faces
  use surface_curvature_m, only: surface_curvature_t, find_curvature, no_surface
  use exact_sum_m, only: exact_add_columns, exact_totals, accumulator_size, no_terms, terms_at_once
  implicit none
  private
  public :: surface_tension_t, surface_tension_init, find_tension, add_tension, force_from_tension

  integer, parameter :: worth_threads = 1000   !! fewer faces of bodies are the work of one thread

  type :: surface_tension_t
    logical :: acts = .false.
    type(surface_curvature_t) :: surface
    real(wp), allocatable :: force(:, :, :, :)   !! at the lower faces, per volume [N/m3]
  end type surface_tension_t

contains

  !> What stays from step to step: nothing in one fluid, which has no surface, little without
  !! tension. Force, places and curvature are work arrays of the caller.
  subroutine surface_tension_init(grid, fluid, self)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(surface_tension_t), intent(out) :: self

    self%acts = .not. fluid%single_phase
    if (.not. self%acts .or. fluid%surface_tension <= 0.0_wp) return
    associate (a => grid%first, b => grid%last)
      allocate (self%surface%state(a(1):b(1), a(2):b(2), a(3):b(3)), source=no_surface)
    end associate
  end subroutine surface_tension_init

  !> Curvature of the surface and its force at all faces of own cells.
  subroutine find_tension(grid, fluid, solid, c, self)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
      !! C^, halo filled [-]
    type(surface_tension_t), intent(inout) :: self
    integer :: k

    if (.not. self%acts) return
    !$omp parallel do schedule(static)
    do k = lbound(self%force, 3), ubound(self%force, 3)
      self%force(:, :, k, :) = 0.0_wp
    end do
    call weight_at_faces(grid, fluid, c, self%force)
    if (fluid%surface_tension <= 0.0_wp) return
    call find_curvature(grid, solid, c, self%surface)
    call force_at_faces(grid, fluid%surface_tension, c, self)
  end subroutine find_tension

  !> Force at the lower faces: the curvature of a face is the mean of its cells that have one. None
  !! on the sides of the domain.
  subroutine force_at_faces(grid, sigma, c, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: sigma   !! [N/m]
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    type(surface_tension_t), intent(inout) :: self
    integer :: i, j, k, d, e(3), known
    integer :: f(3)

    do d = 1, 3
      e = unit_step(:, d)
      !$omp parallel do private(i, j, f, known) schedule(static)
      do k = grid%lo(3), grid%hi(3) + e(3)
        do j = grid%lo(2), grid%hi(2) + e(2)
          do i = grid%lo(1), grid%hi(1) + e(1)
            f = [i, j, k]
            if (grid%side_of_face(f(d), d) /= no_side) cycle
            associate (low => self%surface%state(i - e(1), j - e(2), k - e(3)), &
                       high => self%surface%state(i, j, k))
              known = count([low, high] /= no_surface)
            end associate
            if (known == 0) cycle
            self%force(i, j, k, d) = self%force(i, j, k, d) &
              + sigma*(self%surface%curvature(i - e(1), j - e(2), k - e(3)) &
                       + self%surface%curvature(i, j, k))/real(known, wp) &
              *(c(i, j, k) - c(i - e(1), j - e(2), k - e(3)))/grid%h(d)
          end do
        end do
      end do
    end do
  end subroutine force_at_faces

  !> Add the acceleration by surface tension to that of the faces: a_f += f_f/rho_f [m/s2].
  subroutine add_tension(grid, rho, self, a)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! that of the system [kg/m3]
    type(surface_tension_t), intent(in) :: self
    real(wp), intent(inout), contiguous :: a(grid%first(1):, grid%first(2):, grid%first(3):, :)
    integer :: i, j, k, d, e(3)

    if (.not. self%acts) return
    do d = 1, 3
      e = unit_step(:, d)
      !$omp parallel do private(i, j) schedule(static)
      do k = grid%lo(3), grid%hi(3) + e(3)
        do j = grid%lo(2), grid%hi(2) + e(2)
          do i = grid%lo(1), grid%hi(1) + e(1)
            a(i, j, k, d) = a(i, j, k, d) + self%force(i, j, k, d) &
                            /face_mean(rho(i - e(1), j - e(2), k - e(3)), rho(i, j, k))
          end do
        end do
      end do
    end do
  end subroutine add_tension

  !> Add force and torque of the surface on each body to those of the pressure: the tension of the
  !! surface as continued through the body acts on the solid part of the faces, as the pressure
  !! does. With an angle of 90 degrees that is the pull along the line of contact.
  subroutine force_from_tension(grid, bodies, flux, self, force)
    type(grid_t), intent(in) :: grid
    type(rigid_motion_t), intent(in) :: bodies
    type(rigid_flux_t), intent(in) :: flux
    type(surface_tension_t), intent(in) :: self
    real(wp), intent(inout) :: force(:, :)   !! (6, bodies) about the centre of mass [N, N m]
    integer(i8) :: accumulator(accumulator_size, 6*bodies%n)
    real(wp) :: total(6*bodies%n), term(terms_at_once, 6)
    integer :: b, m, n, from

    if (.not. self%acts) return
    accumulator = spread(no_terms, 2, 6*bodies%n)
    !$omp parallel private(b, m, n, term) if (flux%first_face(bodies%n + 1) > worth_threads)
    do b = 1, bodies%n
      !$omp do schedule(dynamic)
      do from = flux%first_face(b), flux%first_face(b + 1) - 1, terms_at_once
        n = 0
        do m = from, min(from + terms_at_once, flux%first_face(b + 1)) - 1
          if (.not. flux%mine(m)) cycle
          n = n + 1
          associate (f => flux%face(:, m))
            term(n, :) = flux%s(:, m)*grid%h(f(4))*self%force(f(1), f(2), f(3), f(4))
          end associate
        end do
        call exact_add_columns(term(:n, :), accumulator(:, 6*b - 5:6*b))
      end do
      !$omp end do nowait
    end do
    !$omp end parallel
    call exact_totals(accumulator, total)
    force(:, :bodies%n) = force(:, :bodies%n) + reshape(total, [6, bodies%n])
  end subroutine force_from_tension

end module surface_tension_m
