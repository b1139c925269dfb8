!> The linear system of the pressure and its solvers.
!!
!! The unknown is the pressure change phi. Fluid moves through the open part w of a face only,
!! bodies push through the rest:
!! $$ \sum_f \frac{w_f A_f}{\rho_f h_f} (\phi_c - \phi_{nb}) + \sum_k J_k M_k^{-1} J_k^T \phi =
!! -D_c/\Delta t $$
!! with D the net volume outflow of a cell, fluid and solid. Symmetric and positive, so conjugate
!! gradients with the multigrid of the first term. Without bodies in the list it is the paper's
!! system.
module pressure_system_m
  use kinds_m, only: wp, name_length
  use case_types_m, only: numerics_t
  use grid_m, only: grid_t, unit_step
  use boundary_kinds_m, only: gives_pressure
  use rigid_motion_m, only: rigid_motion_t
  use rigid_flux_m, only: rigid_flux_t, rigid_flux_init, force_from_cells, add_cell_flux
  use outflow_m, only: outflow_t, side_distance
  use mixture_m, only: face_mean
  use linear_operator_m, only: linear_operator_t, preconditioner_t, jacobi_t, identity_t, &
                               seven_points
  use exact_sum_m, only: exact_dot
  use solve_control_m, only: solve_control_t, solve_report_t
  use krylov_m, only: take_all_cells, find_null_space, conjugate_gradient, bicgstab
  use elliptic_solver_m, only: elliptic_solver_t, elliptic_solver_init
  use parallel_m, only: halo_exchange
  implicit none
  private
  public :: pressure_system_t, pressure_system_init, set_pressure_system, set_bodies, solve_linear
  public :: motion_of_force

  integer, parameter :: max_iterations = 2000   !! of one linear solve

  !> The operator of the module's head, on arrays with one halo cell.
  type, extends(linear_operator_t) :: pressure_operator_t
    real(wp), allocatable :: cf(:, :, :, :)    !! w A/(rho h) of the lower faces [m3 s2 / (kg m2)]
    integer :: lo(3) = 0, hi(3) = 0
    type(rigid_motion_t) :: bodies
    type(rigid_flux_t) :: flux
    real(wp), allocatable :: push(:, :)
      !! (6, bodies) force of a trial pressure, then its motion
    real(wp), allocatable :: is_open(:, :, :)    !! of a closed box: 1 in cells with an open face
    real(wp), allocatable :: wall_share(:, :)
      !! (6, bodies) what the walls of a closed box take of J, per open cell [m2, m3]
    logical :: pressed = .false.                 !! a free body covers whole cells at such a wall
  contains
    procedure :: apply => apply_pressure
  end type pressure_operator_t

  type :: pressure_system_t
    type(pressure_operator_t) :: operator
    type(elliptic_solver_t) :: solver   !! keeps nothing from one system to the next
    type(jacobi_t) :: jacobi
    logical, allocatable :: active(:, :, :)   !! the cell has an open face
    character(name_length) :: method = 'cg', preconditioner = 'multigrid'   !! by their names
  end type pressure_system_t

contains

  !> Allocate the system and its solvers.
  subroutine pressure_system_init(grid, n_bodies, numerics, self)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: n_bodies
    type(numerics_t), intent(in) :: numerics   !! names of solver and preconditioner
    type(pressure_system_t), intent(out) :: self
    integer :: a(3), b(3)

    ! Names of the solver and the preconditioner that nothing below handles end the program.
    select case (numerics%pressure_solver)
    case ('cg', 'bicgstab')
    case default; error stop 'pressure_system_init: no such solver'
    end select
    select case (numerics%preconditioner)
    case ('multigrid', 'jacobi', 'none')
    case default; error stop 'pressure_system_init: no such preconditioner'
    end select
    self%method = numerics%pressure_solver
    self%preconditioner = numerics%preconditioner
    a = grid%lo - 1
    b = grid%hi + 1
    allocate (self%operator%cf(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
    allocate (self%operator%push(6, n_bodies), source=0.0_wp)
    allocate (self%operator%wall_share, source=self%operator%push)
    a = grid%first
    b = grid%last
    allocate (self%active(a(1):b(1), a(2):b(2), a(3):b(3)), source=.true.)
    call rigid_flux_init(n_bodies, self%operator%flux)
    self%operator%lo = grid%lo
    self%operator%hi = grid%hi
    call elliptic_solver_init(grid, self%solver)
  end subroutine pressure_system_init

  !> Coefficients of the system for the open shares and densities at hand, and of its
  !! preconditioner.
  !!
  !! `sides` says what lies outside the outflows; without it the pressure there is zero.
  subroutine set_pressure_system(grid, aperture, rho, self, sides)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: aperture(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [-]
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! [kg/m3]
    type(pressure_system_t), intent(inout) :: self
    type(outflow_t), intent(in), optional :: sides(2, 3)
    integer :: i, j, k, d, e(3), s, a(3), b(3), c(3)
    real(wp) :: area_over_h

    do d = 1, 3
      e = unit_step(:, d)
      area_over_h = grid%area(d)/grid%h(d)
      !$omp parallel do private(i, j) schedule(static)
      do k = grid%lo(3), grid%hi(3) + e(3)
        do j = grid%lo(2), grid%hi(2) + e(2)
          do i = grid%lo(1), grid%hi(1) + e(1)
            self%operator%cf(i, j, k, d) = aperture(i, j, k, d)*area_over_h &
              /face_mean(rho(i - e(1), j - e(2), k - e(3)), rho(i, j, k))
          end do
        end do
      end do
      ! Sides of the domain: the velocity is given, or the pressure half a cell away.
      do s = 1, 2
        call grid%side_faces(s, d, a, b)
        if (.not. gives_pressure(grid%side(s, d))) then
          self%operator%cf(a(1):b(1), a(2):b(2), a(3):b(3), d) = 0.0_wp
          cycle
        end if
        do k = a(3), b(3)
          do j = a(2), b(2)
            do i = a(1), b(1)
              c = [i, j, k] - merge(0, 1, s == 1)*e
              self%operator%cf(i, j, k, d) = aperture(i, j, k, d)*grid%area(d) &
                /(rho(c(1), c(2), c(3))*side_distance(grid, s, d, c, rho(c(1), c(2), c(3)), sides))
            end do
          end do
        end do
      end do
    end do
    associate (cf => self%operator%cf)   ! own cells with a face through which fluid can move
      !$omp parallel do private(i, j) schedule(static)
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            self%active(i, j, k) = cf(i, j, k, 1) + cf(i + 1, j, k, 1) + cf(i, j, k, 2) &
              + cf(i, j + 1, k, 2) + cf(i, j, k, 3) + cf(i, j, k + 1, 3) > 0.0_wp
          end do
        end do
      end do
    end associate
    call take_all_cells(self%solver%work)
    call find_null_space(grid, self%operator%cf, self%solver%work)
    select case (trim(self%preconditioner))
    case ('multigrid'); call self%solver%multigrid%setup(self%operator%cf)
    case ('jacobi'); call self%jacobi%setup(grid, self%operator%cf)
    case default   ! 'none' needs nothing
    end select
  end subroutine set_pressure_system

  !> The bodies that a pressure moves.
  !!
  !! In a closed box take the mean over the open cells off J, where a free body covers whole cells
  !! at a wall. These take no part, so that J would not sum up to zero: an even pressure would push
  !! the body, and no pressure balance what it displaces. So all cells share what the wall takes.
  subroutine set_bodies(grid, bodies, self)
    type(grid_t), intent(in) :: grid
    type(rigid_motion_t), intent(in) :: bodies
    type(pressure_system_t), intent(inout) :: self
    real(wp), parameter :: rounding = 1.0e-9_wp   !! [area of a face, volume of a cell]

    associate (op => self%operator, work => self%solver%work)
      op%bodies = bodies
      op%pressed = .false.
      if (.not. (work%singular .and. any(op%bodies%free))) return
      call force_from_cells(op%bodies, op%flux, work%is_open, op%lo - 1, op%wall_share)
      op%pressed = any(abs(op%wall_share(1:3, :)) > rounding*minval(grid%area)) .or. &
        any(abs(op%wall_share(4:6, :)) > rounding*grid%volume)
      if (.not. op%pressed) return
      op%wall_share = op%wall_share/work%n_open
      op%is_open = work%is_open
    end associate
  end subroutine set_bodies

  !> y = A x: outflow that a pressure x drives, through open faces and by moving the free bodies.
  subroutine apply_pressure(self, x, y)
    class(pressure_operator_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: x(:, :, :)
    real(wp), intent(inout), contiguous :: y(:, :, :)

    call halo_exchange(x, 1)
    call seven_points(self%cf, x, y)
    if (.not. any(self%bodies%free)) return
    call force_from_cells(self%bodies, self%flux, x, self%lo - 1, self%push)
    if (self%pressed) self%push = self%push - self%wall_share*exact_dot(x, self%is_open, 1)
    call motion_of_force(self%bodies, self%push)
    call add_cell_flux(self%bodies, self%flux, self%push, self%lo - 1, y)
    if (self%pressed) y = y - sum(self%wall_share*self%push)*self%is_open
  end subroutine apply_pressure

  !> Acceleration of the free bodies by given forces: a = M^{-1} F, in place.
  pure subroutine motion_of_force(bodies, a)
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(inout) :: a(:, :)   !! (6, bodies) force and torque in, acceleration out
    integer :: b

    do b = 1, bodies%n
      if (.not. bodies%free(b)) cycle
      a(:, b) = matmul(bodies%mobility(:, :, b), a(:, b))
    end do
  end subroutine motion_of_force

  !> One linear solve with the chosen method: phi in `self%solver%x` for what stands in its `rhs`.
  subroutine solve_linear(tolerance, self, iterations)
    real(wp), intent(in) :: tolerance   !! of the residual [m3/s2]
    type(pressure_system_t), intent(inout) :: self
    integer, intent(out) :: iterations
    type(identity_t) :: identity

    select case (trim(self%preconditioner))
    case ('multigrid'); call solve_with(self%solver%multigrid)
    case ('jacobi'); call solve_with(self%jacobi)
    case default; call solve_with(identity)   ! 'none', as `pressure_system_init` has made sure
    end select
  contains
    subroutine solve_with(preconditioner)
      class(preconditioner_t), intent(inout) :: preconditioner
      type(solve_control_t) :: control
      type(solve_report_t) :: report   ! how it ended does not matter: the next pass sees the rest

      control%tolerance = tolerance
      control%max_iterations = max_iterations
      associate (s => self%solver)
        if (trim(self%method) == 'bicgstab') then
          call bicgstab(self%operator, preconditioner, s%rhs, s%x, control, report, s%work)
        else
          call conjugate_gradient(self%operator, preconditioner, s%rhs, s%x, control, report, &
                                  s%work)
        end if
      end associate
      iterations = report%iterations
    end subroutine solve_with
  end subroutine solve_linear

end module pressure_system_m
