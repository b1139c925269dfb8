!> C-HSMAC: pressure and velocity correction until the face velocity is free of divergence.
!!
!! Each pass solves the system of `pressure_system_m` for a pressure change, corrects the faces and
!! the free bodies by it and looks at the divergence that is left.
module pressure_m
  use kinds_m, only: wp
  use case_types_m, only: numerics_t
  use fields_m, only: flow_t
  use stage_m, only: stage_t
  use grid_m, only: grid_t
  use boundary_m, only: fill_scalar_halo
  use rigid_motion_m, only: rigid_motion_t
  use rigid_flux_m, only: solid_face_flux, force_from_cells
  use face_velocity_m, only: push_faces
  use pressure_system_m, only: pressure_system_t, pressure_system_init, set_bodies, solve_linear, &
                               motion_of_force
  use krylov_m, only: krylov_work_t
  use exact_sum_m, only: exact_dot
  use parallel_m, only: global_max, halo_exchange
  implicit none
  private
  public :: pressure_t, pressure_report_t, pressure_init, solve_pressure, both_solves, divergence

  type :: pressure_report_t
    integer :: passes = 0              !! of the C-HSMAC loop
    integer :: iterations = 0          !! of the linear solver, all passes
    real(wp) :: divergence = 0.0_wp    !! max |div u| left [1/s]
    logical :: converged = .false.
  end type pressure_report_t

  type :: pressure_t
    type(pressure_system_t) :: system
    real(wp) :: tolerance = 0.0_wp         !! of the divergence [1/s]
    integer :: max_passes = 0
    real(wp), allocatable :: phi_total(:, :, :)                      !! full halo [Pa]
    type(pressure_report_t) :: report             !! of the last solve
  end type pressure_t

contains

  !> Allocate the system and what the loop needs.
  subroutine pressure_init(grid, n_bodies, numerics, self)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: n_bodies
    type(numerics_t), intent(in) :: numerics
    type(pressure_t), intent(out) :: self
    integer :: a(3), b(3)

    self%tolerance = numerics%divergence_tolerance
    self%max_passes = numerics%max_pressure_passes
    call pressure_system_init(grid, n_bodies, numerics, self%system)
    a = grid%first
    b = grid%last
    allocate (self%phi_total(a(1):b(1), a(2):b(2), a(3):b(3)), source=0.0_wp)
  end subroutine pressure_init

  !> Make the face velocity free of divergence; pressure and motion of the free bodies follow.
  !!
  !! On entry `flow%uf` and `bodies%motion` are predictions and the system is set. On return both
  !! are final, `flow%p` has changed by `self%phi_total`, `flow%solid_flux` is that of the final
  !! motion; `self%report` holds how it went.
  subroutine solve_pressure(s, rho, bodies, self, tolerance)
    type(stage_t), intent(in) :: s
    real(wp), intent(in), contiguous :: rho(s%grid%first(1):, s%grid%first(2):, s%grid%first(3):)
      !! that of the system [kg/m3]
    type(rigid_motion_t), intent(inout) :: bodies
    type(pressure_t), intent(inout) :: self
    real(wp), intent(in), optional :: tolerance   !! of the divergence, in place of the usual [1/s]
    integer :: d, iterations, k
    real(wp) :: allowed   !! divergence [1/s]
    real(wp) :: residual  !! of the linear system, allowed [m3/s2]

    self%report = pressure_report_t()
    allowed = self%tolerance
    if (present(tolerance)) allowed = tolerance
    residual = 0.5_wp*allowed*s%grid%volume/s%dt
    call start_from_none(self%phi_total)
    do d = 1, 3
      call start_from_none(s%flow%solid_flux(:, :, :, d))
    end do
    call set_bodies(s%grid, bodies, self%system)
    associate (grid => s%grid, flow => s%flow, system => self%system, report => self%report, &
               rhs => self%system%solver%rhs, work => self%system%solver%work)
      do
        call solid_face_flux(grid, bodies, system%operator%flux, flow%solid_flux, held=.true.)
        call divergence(grid, s%solid%effective, flow, system%active, rhs, report%divergence)
        if (work%singular) report%divergence = uneven(grid, rhs, work)
        report%converged = report%divergence < allowed
        if (report%converged .or. report%passes == self%max_passes) exit
        call start_from_none(system%solver%x)
        !$omp parallel do schedule(static)
        do k = lbound(rhs, 3), ubound(rhs, 3)
          rhs(:, :, k) = -rhs(:, :, k)/s%dt
        end do
        call solve_linear(residual, system, iterations)
        report%passes = report%passes + 1
        report%iterations = report%iterations + iterations
        call add_correction(grid, rho, s%dt, bodies, flow, self)
      end do
      call fill_scalar_halo(grid, self%phi_total, layers=1)
      !$omp parallel do schedule(static)
      do k = grid%first(3), grid%last(3)
        flow%p(:, :, k) = flow%p(:, :, k) + self%phi_total(:, :, k)
      end do
    end associate
  end subroutine solve_pressure

  !> Report of two solves of a step, of which the second goes on from the first. What the first left
  !! undone is told, too.
  pure function both_solves(first, second) result(both)
    type(pressure_report_t), intent(in) :: first, second
    type(pressure_report_t) :: both

    both = second
    both%passes = first%passes + second%passes
    both%iterations = first%iterations + second%iterations
    if (first%converged) return
    both%converged = .false.
    both%divergence = max(first%divergence, second%divergence)
  end function both_solves

  !> Zero everywhere.
  subroutine start_from_none(phi)
    real(wp), intent(inout), contiguous :: phi(:, :, :)
    integer :: k

    !$omp parallel do schedule(static)
    do k = 1, size(phi, 3)
      phi(:, :, k) = 0.0_wp
    end do
  end subroutine start_from_none

  !> Largest divergence in a closed box less its mean over the open cells [1/s], which is what the
  !! walls take (`pressure_system_m`). The transport shares it out, too (`open_flux_m`).
  function uneven(grid, outflow, work) result(largest)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: outflow(grid%lo(1) - 1:, grid%lo(2) - 1:, grid%lo(3) - 1:)
      !! [m3/s]
    type(krylov_work_t), intent(in) :: work
    real(wp) :: largest
    real(wp) :: mean, worst(1)
    integer :: i, j, k

    mean = exact_dot(outflow, work%is_open, 1)/max(work%n_open, 1.0_wp)
    worst = 0.0_wp
    !$omp parallel do private(i, j) reduction(max: worst) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          worst = max(worst, abs(outflow(i, j, k) - mean*work%is_open(i, j, k)))
        end do
      end do
    end do
    call global_max(worst)
    largest = worst(1)/grid%volume
  end function uneven

  !> Add phi to the total, its gradient to the face velocity, its push to the bodies.
  subroutine add_correction(grid, rho, dt, bodies, flow, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(in) :: dt
    type(rigid_motion_t), intent(inout) :: bodies
    type(flow_t), intent(inout) :: flow
    type(pressure_t), intent(inout) :: self
    integer :: b, k

    associate (a => grid%lo, z => grid%hi, total => self%phi_total, phi => self%system%solver%x, &
               op => self%system%operator)
      !$omp parallel do schedule(static)
      do k = grid%lo(3), grid%hi(3)
        total(a(1):z(1), a(2):z(2), k) = total(a(1):z(1), a(2):z(2), k) &
                                         + phi(a(1):z(1), a(2):z(2), k)
      end do
      call halo_exchange(phi, 1)
      call push_faces(grid, dt, rho, phi, flow%sides, flow%uf)
      call force_from_cells(bodies, op%flux, phi, grid%lo - 1, op%push)
      call motion_of_force(bodies, op%push)
      do b = 1, bodies%n
        if (bodies%free(b)) bodies%motion(:, b) = bodies%motion(:, b) + dt*op%push(:, b)
      end do
    end associate
  end subroutine add_correction

  !> Net volume outflow of fluid and solid from each own cell [m3/s], and its largest value per cell
  !! volume among the cells that hold moving fluid [1/s].
  subroutine divergence(grid, aperture, flow, active, outflow, largest)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: aperture(grid%first(1):, grid%first(2):, grid%first(3):, :)
    type(flow_t), intent(in) :: flow
    logical, intent(in), contiguous :: active(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(inout), contiguous :: outflow(grid%lo(1) - 1:, grid%lo(2) - 1:, &
                                                   grid%lo(3) - 1:)
    real(wp), intent(out) :: largest
    integer :: i, j, k
    real(wp) :: a(3), worst(1)

    a = grid%area
    worst = 0.0_wp
    associate (uf => flow%uf, solid_flux => flow%solid_flux)
      !$omp parallel do private(i, j) reduction(max: worst) schedule(static)
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          !$omp simd
          do i = grid%lo(1), grid%hi(1)
            outflow(i, j, k) = merge( &
              (aperture(i + 1, j, k, 1)*a(1)*uf(i + 1, j, k, 1) + solid_flux(i + 1, j, k, 1)) &
              - (aperture(i, j, k, 1)*a(1)*uf(i, j, k, 1) + solid_flux(i, j, k, 1)) &
              + (aperture(i, j + 1, k, 2)*a(2)*uf(i, j + 1, k, 2) + solid_flux(i, j + 1, k, 2)) &
              - (aperture(i, j, k, 2)*a(2)*uf(i, j, k, 2) + solid_flux(i, j, k, 2)) &
              + (aperture(i, j, k + 1, 3)*a(3)*uf(i, j, k + 1, 3) + solid_flux(i, j, k + 1, 3)) &
              - (aperture(i, j, k, 3)*a(3)*uf(i, j, k, 3) + solid_flux(i, j, k, 3)), 0.0_wp, &
              active(i, j, k))
          end do
          worst = max(worst, maxval(abs(outflow(grid%lo(1):grid%hi(1), j, k))))
        end do
      end do
    end associate
    call global_max(worst)
    largest = worst(1)/grid%volume
  end subroutine divergence

end module pressure_m
