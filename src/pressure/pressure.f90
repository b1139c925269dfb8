!> C-HSMAC: pressure and velocity correction until the face velocity is free of divergence.
!!
!! The unknown of a pass is the pressure change phi. Fluid moves through the open part w of a face
!! only, bodies push through the rest:
!! $$ \sum_f \frac{w_f A_f}{\rho_f h_f} (\phi_c - \phi_{nb}) + \sum_k J_k M_k^{-1} J_k^T \phi =
!! -D_c/\Delta t $$
!! with D the net volume outflow of a cell, fluid and solid. Symmetric and positive, so conjugate
!! gradients with the multigrid of the first term. Without bodies in the list it is the paper's
!! system.
module pressure_m
  use kinds_m, only: wp, i8
  use case_types_m, only: numerics_t
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use grid_m, only: grid_t, n_halo, unit_step
  use boundary_m, only: fill_scalar_halo, set_side_velocity, gives_pressure
  use rigid_motion_m, only: rigid_motion_t, wall_velocity
  use rigid_flux_m, only: rigid_flux_t, rigid_flux_init, solid_face_flux, force_from_cells, &
                          add_cell_flux, nearest_arm
  use outflow_m, only: outflow_t, reach, pressure_outside, mean_velocity
  use mixture_m, only: face_mean
  use linear_operator_m, only: linear_operator_t, preconditioner_t, jacobi_t, identity_t
  use exact_sum_m, only: exact_dot
  use krylov_m, only: krylov_work_t, krylov_init, find_null_space, conjugate_gradient, bicgstab
  use multigrid_m, only: multigrid_t
  use parallel_m, only: global_max, global_sum, halo_exchange
  implicit none
  private
  public :: pressure_t, pressure_report_t, pressure_init, set_pressure_system, solve_pressure
  public :: face_acceleration, cell_mean_of_faces, predict_face_velocity, face_velocity_at_walls
  public :: divergence, extend_pressure

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
    real(wp), allocatable :: swallowed(:, :)
      !! (6, bodies) what the walls of a closed box swallow of J, per open cell [m2, m3]
    logical :: pressed = .false.                 !! a free body covers whole cells at such a wall
  contains
    procedure :: apply => apply_pressure
  end type pressure_operator_t

  type :: pressure_report_t
    integer :: passes = 0              !! of the C-HSMAC loop
    integer :: iterations = 0          !! of the linear solver, all passes
    real(wp) :: divergence = 0.0_wp    !! max |div u| left [1/s]
    logical :: converged = .false.
  end type pressure_report_t

  type :: pressure_t
    type(pressure_operator_t) :: operator
    type(multigrid_t) :: multigrid
    type(jacobi_t) :: jacobi
    type(identity_t) :: identity
    type(krylov_work_t) :: work
    real(wp), allocatable :: rhs(:, :, :), phi(:, :, :)   !! one halo cell
    real(wp), allocatable :: phi_pass(:, :, :), phi_total(:, :, :)   !! full halo [Pa]
    real(wp), allocatable :: a_face(:, :, :, :), a_cell(:, :, :, :)  !! accelerations [m/s2]
    logical, allocatable :: active(:, :, :)    !! the cell has an open face
    integer, allocatable :: known(:, :, :)     !! work of the extension into closed cells
  end type pressure_t

contains

  !> Allocate the system and its solvers.
  subroutine pressure_init(grid, n_bodies, self)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: n_bodies
    type(pressure_t), intent(out) :: self
    integer :: a(3), b(3)

    a = grid%lo - 1
    b = grid%hi + 1
    allocate (self%operator%cf(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
    allocate (self%operator%push(6, n_bodies), source=0.0_wp)
    allocate (self%operator%swallowed, source=self%operator%push)
    allocate (self%rhs(a(1):b(1), a(2):b(2), a(3):b(3)), source=0.0_wp)
    allocate (self%phi, source=self%rhs)
    allocate (self%operator%is_open, source=self%rhs)
    a = grid%first
    b = grid%last
    allocate (self%active(a(1):b(1), a(2):b(2), a(3):b(3)), source=.true.)
    allocate (self%known(a(1):b(1), a(2):b(2), a(3):b(3)), source=0)
    allocate (self%phi_pass(a(1):b(1), a(2):b(2), a(3):b(3)), source=0.0_wp)
    allocate (self%phi_total, source=self%phi_pass)
    allocate (self%a_face(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
    allocate (self%a_cell, source=self%a_face)
    call rigid_flux_init(grid, n_bodies, self%operator%flux)
    self%operator%lo = grid%lo
    self%operator%hi = grid%hi
    call self%multigrid%init(grid)
    call krylov_init(grid, self%work)
  end subroutine pressure_init

  !> Coefficients of the system for the open shares and densities at hand, and of its
  !! preconditioner.
  !!
  !! `sides` tells what lies outside the outflows; without it the pressure there is zero.
  subroutine set_pressure_system(grid, numerics, open, rho, self, sides)
    type(grid_t), intent(in) :: grid
    type(numerics_t), intent(in) :: numerics
    real(wp), intent(in), contiguous :: open(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [-]
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! [kg/m3]
    type(pressure_t), intent(inout) :: self
    type(outflow_t), intent(in), optional :: sides(2, 3)
    integer :: i, j, k, d, s, e(3), face
    real(wp) :: area_over_h

    do d = 1, 3
      e = unit_step(:, d)
      area_over_h = grid%area(d)/grid%h(d)
      !$omp parallel do private(i, j) schedule(static)
      do k = grid%lo(3), grid%hi(3) + e(3)
        do j = grid%lo(2), grid%hi(2) + e(2)
          do i = grid%lo(1), grid%hi(1) + e(1)
            self%operator%cf(i, j, k, d) = open(i, j, k, d)*area_over_h &
              /face_mean(rho(i - e(1), j - e(2), k - e(3)), rho(i, j, k))
          end do
        end do
      end do
      do s = 1, 2
        if (.not. grid%at_side(s, d) .or. grid%periodic(d)) cycle
        face = merge(1, grid%n(d) + 1, s == 1)
        call side_coefficients(face, merge(face, face - 1, s == 1))
      end do
    end do
    call mark_active(grid, self%operator%cf, self%active)
    call find_null_space(grid, self%operator%cf, self%work)
    select case (trim(numerics%preconditioner))
    case ('multigrid'); call self%multigrid%setup(self%operator%cf)
    case ('jacobi'); call self%jacobi%setup(grid, self%operator%cf)
    case default   ! 'none' needs nothing
    end select
  contains
    !> A side of the domain: the velocity is given, or the pressure half a cell away.
    subroutine side_coefficients(face, cell)
      integer, intent(in) :: face, cell
      integer :: a(3), b(3), c(3)

      a = grid%lo
      b = grid%hi
      a(d) = face
      b(d) = face
      if (.not. gives_pressure(grid%side(s, d))) then
        self%operator%cf(a(1):b(1), a(2):b(2), a(3):b(3), d) = 0.0_wp
        return
      end if
      do k = a(3), b(3)
        do j = a(2), b(2)
          do i = a(1), b(1)
            c = [i, j, k] + (cell - face)*e
            self%operator%cf(i, j, k, d) = open(i, j, k, d)*grid%area(d) &
              /(rho(c(1), c(2), c(3))*side_reach(grid, s, d, c, rho(c(1), c(2), c(3)), sides))
          end do
        end do
      end do
    end subroutine side_coefficients
  end subroutine set_pressure_system

  !> Length over which the pressure difference of a cell to the outside acts [m].
  pure function side_reach(grid, s, d, cell, rho, sides) result(length)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: s, d, cell(3)
    real(wp), intent(in) :: rho   !! of the cell [kg/m3]
    type(outflow_t), intent(in), optional :: sides(2, 3)
    real(wp) :: length

    length = 0.5_wp*grid%h(d)
    if (present(sides)) length = reach(sides(s, d), cell, length, rho)
  end function side_reach

  !> Own cells that have a face through which fluid can move.
  subroutine mark_active(grid, cf, active)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: cf(grid%lo(1) - 1:, grid%lo(2) - 1:, grid%lo(3) - 1:, :)
    logical, intent(inout), contiguous :: active(grid%first(1):, grid%first(2):, grid%first(3):)
    integer :: i, j, k

    !$omp parallel do private(i, j) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          active(i, j, k) = cf(i, j, k, 1) + cf(i + 1, j, k, 1) + cf(i, j, k, 2) &
                            + cf(i, j + 1, k, 2) + cf(i, j, k, 3) + cf(i, j, k + 1, 3) > 0.0_wp
        end do
      end do
    end do
  end subroutine mark_active

  !> y = A x: outflow that a pressure x drives, through open faces and by moving the free bodies.
  subroutine apply_pressure(self, x, y)
    class(pressure_operator_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: x(:, :, :)
    real(wp), intent(inout), contiguous :: y(:, :, :)

    call halo_exchange(x, 1)
    call seven_points(self%lo, self%hi, self%cf, x, y)
    if (.not. any(self%bodies%free)) return
    call force_from_cells(self%bodies, self%flux, x, self%lo - 1, self%push)
    if (self%pressed) self%push = self%push - self%swallowed*exact_dot(x, self%is_open, 1)
    call motion_of_force(self%bodies, self%push)
    call add_cell_flux(self%bodies, self%flux, self%push, self%lo - 1, y)
    if (self%pressed) y = y - sum(self%swallowed*self%push)*self%is_open
  end subroutine apply_pressure

  !> In a closed box take the mean over the open cells off J, where a free body covers whole cells
  !! at a wall. These take no part, so that J would not sum up to zero: an even pressure would push
  !! the body, and no pressure balance what it displaces. So all cells share what the wall swallows.
  subroutine find_swallowed(grid, self)
    type(grid_t), intent(in) :: grid
    type(pressure_t), intent(inout) :: self
    real(wp), parameter :: rounding = 1.0e-9_wp   !! [area of a face]

    associate (op => self%operator)
      op%pressed = .false.
      if (.not. (self%work%singular .and. any(op%bodies%free))) return
      call force_from_cells(op%bodies, op%flux, self%work%is_open, op%lo - 1, op%swallowed)
      op%pressed = any(abs(op%swallowed(1:3, :)) > rounding*minval(grid%area))
      if (.not. op%pressed) return
      op%swallowed = op%swallowed/self%work%n_open
      op%is_open = self%work%is_open
    end associate
  end subroutine find_swallowed

  !> The part of the operator on the grid.
  subroutine seven_points(lo, hi, cf, x, y)
    integer, intent(in) :: lo(3), hi(3)
    real(wp), intent(in), contiguous :: cf(lo(1) - 1:, lo(2) - 1:, lo(3) - 1:, :)
    real(wp), intent(in), contiguous :: x(lo(1) - 1:, lo(2) - 1:, lo(3) - 1:)
    real(wp), intent(inout), contiguous :: y(lo(1) - 1:, lo(2) - 1:, lo(3) - 1:)
    integer :: i, j, k

    !$omp parallel do private(i, j) schedule(static)
    do k = lo(3), hi(3)
      do j = lo(2), hi(2)
        do i = lo(1), hi(1)
          y(i, j, k) = cf(i, j, k, 1)*(x(i, j, k) - x(i - 1, j, k)) &
                       + cf(i + 1, j, k, 1)*(x(i, j, k) - x(i + 1, j, k)) &
                       + cf(i, j, k, 2)*(x(i, j, k) - x(i, j - 1, k)) &
                       + cf(i, j + 1, k, 2)*(x(i, j, k) - x(i, j + 1, k)) &
                       + cf(i, j, k, 3)*(x(i, j, k) - x(i, j, k - 1)) &
                       + cf(i, j, k + 1, 3)*(x(i, j, k) - x(i, j, k + 1))
        end do
      end do
    end do
  end subroutine seven_points

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

  !> Acceleration at the faces: a_f = (rho_w,f g - (p_high - p_low)/h)/rho_f [m/s2].
  !!
  !! Gravity, pressure gradient and density live at the same face, so still water stays still. The
  !! density rho_w that has weight is the fluid's; rho is it too, or that of the mixture. Zero on
  !! walls and inflows; on an open side p = 0 half a cell away. Outside an outflow (`sides`) lies
  !! what `outflow_m` says: its pressure comes from weight, so it counts only with gravity, and a
  !! pressure correction sees none.
  subroutine face_acceleration(grid, gravity, rho_w, rho, p, a, sides)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in), dimension(grid%first(1):, grid%first(2):, grid%first(3):), &
      contiguous :: rho_w, rho           !! [kg/m3]
    real(wp), intent(in), contiguous :: p(grid%first(1):, grid%first(2):, grid%first(3):)
      !! [Pa], halo filled
    real(wp), intent(inout), contiguous :: a(grid%first(1):, grid%first(2):, grid%first(3):, :)
    type(outflow_t), intent(in), optional :: sides(2, 3)
    integer :: i, j, k, d, e(3)
    logical :: heavy

    heavy = any(abs(gravity) > 0.0_wp)
    do d = 1, 3
      e = unit_step(:, d)
      !$omp parallel do private(i, j) schedule(static)
      do k = grid%lo(3), grid%hi(3) + e(3)
        do j = grid%lo(2), grid%hi(2) + e(2)
          do i = grid%lo(1), grid%hi(1) + e(1)
            a(i, j, k, d) = &
              (face_mean(rho_w(i - e(1), j - e(2), k - e(3)), rho_w(i, j, k))*gravity(d) &
               - (p(i, j, k) - p(i - e(1), j - e(2), k - e(3)))/grid%h(d)) &
              /face_mean(rho(i - e(1), j - e(2), k - e(3)), rho(i, j, k))
          end do
        end do
      end do
      if (.not. grid%periodic(d)) call sides_of_direction()
    end do
  contains
    subroutine sides_of_direction()
      integer :: s, lower(3), upper(3), c(3)
      real(wp) :: outward, outside, length

      do s = 1, 2
        if (.not. grid%at_side(s, d)) cycle
        lower = grid%lo
        upper = grid%hi
        lower(d) = merge(1, grid%n(d) + 1, s == 1)
        upper(d) = lower(d)
        outward = merge(-1.0_wp, 1.0_wp, s == 1)
        do k = lower(3), upper(3)
          do j = lower(2), upper(2)
            do i = lower(1), upper(1)
              c = [i, j, k] - merge(0, 1, s == 1)*e
              a(i, j, k, d) = 0.0_wp
              if (.not. gives_pressure(grid%side(s, d))) cycle
              outside = 0.0_wp
              if (heavy .and. present(sides)) outside = pressure_outside(sides(s, d), c)
              length = side_reach(grid, s, d, c, rho(c(1), c(2), c(3)), sides)
              a(i, j, k, d) = (rho_w(c(1), c(2), c(3))*gravity(d)*0.5_wp*grid%h(d) &
                + outward*(p(c(1), c(2), c(3)) - outside))/(length*rho(c(1), c(2), c(3)))
            end do
          end do
        end do
      end do
    end subroutine sides_of_direction
  end subroutine face_acceleration

  !> Cell vector from a face vector: mean of the two faces of each direction by their open shares.
  subroutine cell_mean_of_faces(grid, open, a_face, a_cell)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: open(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(in), contiguous :: a_face(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(inout), contiguous :: a_cell(grid%first(1):, grid%first(2):, grid%first(3):, :)
    integer :: i, j, k, d, e(3)
    real(wp) :: w_low, w_high

    do d = 1, 3
      e = unit_step(:, d)
      !$omp parallel do private(i, j, w_low, w_high) schedule(static)
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            w_low = open(i, j, k, d)
            w_high = open(i + e(1), j + e(2), k + e(3), d)
            a_cell(i, j, k, d) = (w_low*a_face(i, j, k, d) &
                                  + w_high*a_face(i + e(1), j + e(2), k + e(3), d)) &
                                 /max(w_low + w_high, tiny(1.0_wp))
          end do
        end do
      end do
    end do
  end subroutine cell_mean_of_faces

  !> Net volume outflow of fluid and solid from each own cell [m3/s], and its largest value per cell
  !! volume among the cells that hold moving fluid [1/s].
  subroutine divergence(grid, open, uf, solid_flux, active, outflow, largest)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), dimension(grid%first(1):, grid%first(2):, grid%first(3):, :), &
      contiguous :: open, uf, solid_flux
    logical, intent(in), contiguous :: active(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(inout), contiguous :: outflow(grid%lo(1) - 1:, grid%lo(2) - 1:, grid%lo(3) &
                                                   - 1:)
    real(wp), intent(out) :: largest
    integer :: i, j, k
    real(wp) :: worst(1), a(3)

    a = grid%area
    worst = 0.0_wp
    !$omp parallel do private(i, j) reduction(max: worst) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          outflow(i, j, k) = merge(through(i + 1, j, k, 1) - through(i, j, k, 1) &
                                   + through(i, j + 1, k, 2) - through(i, j, k, 2) &
                                   + through(i, j, k + 1, 3) - through(i, j, k, 3), 0.0_wp, &
                                     active(i, j, k))
          worst = max(worst, abs(outflow(i, j, k)))
        end do
      end do
    end do
    call global_max(worst)
    largest = worst(1)/grid%volume
  contains
    pure function through(i, j, k, d) result(q)
      integer, intent(in) :: i, j, k, d
      real(wp) :: q

      q = open(i, j, k, d)*a(d)*uf(i, j, k, d) + solid_flux(i, j, k, d)
    end function through
  end subroutine divergence

  !> Face velocity before the pressure stage, interpolated from the cells:
  !! $$ u_f = \overline{u} + \Delta t' (a_f - \overline{a}), \quad \Delta t' = \Delta t/(1 + 2 \nu
  !! \Delta t \sum_d h_d^{-2}) $$
  !!
  !! The compact face acceleration takes the place of the interpolated one; dt' instead of dt keeps
  !! the steady drag right when viscosity is strong (measured: error 9 % down to 1 %).
  !!
  !! `deviation` is what a face at the surface differed from its cells before (`face_memory_m`). It
  !! fades with viscosity like the rest that the cells do not see.
  !!
  !! At sides with a given pressure it is the cell's; at an outflow the part of the length `reach`
  !! beyond half a cell has the mean velocity of the side. This drag is an acceleration of the face
  !! that `a_face` does not hold, so half of it goes to the cell, too.
  subroutine predict_face_velocity(grid, dt, rho, a_face, a_cell, flow, deviation)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: dt   !! [s]
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! that of the system [kg/m3]
    real(wp), intent(in), dimension(grid%first(1):, grid%first(2):, grid%first(3):, :), &
      contiguous :: a_face, a_cell
        !! accelerations already in `flow%u` [m/s2], halo of a_cell filled
    type(flow_t), intent(inout) :: flow   !! halo of u filled
    real(wp), intent(in), contiguous, optional :: &
      deviation(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s]
    integer :: i, j, k, d, e(3)
    real(wp) :: nu

    do d = 1, 3
      e = unit_step(:, d)
      !$omp parallel do private(i, j, nu) schedule(static)
      do k = grid%lo(3), grid%hi(3) + e(3)
        do j = grid%lo(2), grid%hi(2) + e(2)
          do i = grid%lo(1), grid%hi(1) + e(1)
            associate (il => i - e(1), jl => j - e(2), kl => k - e(3))
              nu = face_mean(flow%mu(il, jl, kl), flow%mu(i, j, k)) &
                   /face_mean(rho(il, jl, kl), rho(i, j, k))
              flow%uf(i, j, k, d) = face_mean(flow%u(il, jl, kl, d), flow%u(i, j, k, d)) &
                + face_step(grid, dt, nu)*(a_face(i, j, k, d) - face_mean(a_cell(il, jl, kl, d), &
                    a_cell(i, j, k, d)))
              if (present(deviation)) flow%uf(i, j, k, d) = flow%uf(i, j, k, d) &
                + face_step(grid, dt, nu)/dt*deviation(i, j, k, d)
            end associate
          end do
        end do
      end do
      if (.not. grid%periodic(d)) call sides_of_direction()
    end do
    call set_side_velocity(grid, flow%uf)
    do d = 1, 3
      call drag_of_outflows()
    end do
  contains
    !> Cells beside an outflow take half of what the face gained by the drag of the side.
    subroutine drag_of_outflows()
      integer :: s, lower(3), upper(3), f(3)

      do s = 1, 2
        if (.not. (grid%at_side(s, d) .and. flow%sides(s, d)%active)) cycle
        lower = grid%lo
        upper = grid%hi
        lower(d) = merge(1, grid%n(d), s == 1)
        upper(d) = lower(d)
        do k = lower(3), upper(3)
          do j = lower(2), upper(2)
            do i = lower(1), upper(1)
              f = [i, j, k] + merge(0, 1, s == 1)*unit_step(:, d)
              flow%u(i, j, k, d) = flow%u(i, j, k, d) + 0.5_wp*(flow%uf(f(1), f(2), f(3), d) &
                - flow%u(i, j, k, d) + dt*(a_cell(i, j, k, d) - a_face(f(1), f(2), f(3), d)))
            end do
          end do
        end do
      end do
    end subroutine drag_of_outflows

    !> Sides with a given pressure: the velocity of the last cell.
    subroutine sides_of_direction()
      integer :: s, lower(3), upper(3), c(3)
      real(wp) :: share, mean

      do s = 1, 2
        if (.not. (grid%at_side(s, d) .and. gives_pressure(grid%side(s, d)))) cycle
        lower = grid%lo
        upper = grid%hi
        lower(d) = merge(1, grid%n(d) + 1, s == 1)
        upper(d) = lower(d)
        do k = lower(3), upper(3)
          do j = lower(2), upper(2)
            do i = lower(1), upper(1)
              c = [i, j, k] - merge(0, 1, s == 1)*e
              share = 0.5_wp*grid%h(d)/side_reach(grid, s, d, c, rho(c(1), c(2), c(3)), flow%sides)
              mean = merge(-1.0_wp, 1.0_wp, s == 1)*mean_velocity(flow%sides(s, d), c)
              flow%uf(i, j, k, d) = share*(flow%u(c(1), c(2), c(3), d) &
                - dt*a_cell(c(1), c(2), c(3), d)) + (1.0_wp - share)*mean + dt*a_face(i, j, k, d)
            end do
          end do
        end do
      end do
    end subroutine sides_of_direction
  end subroutine predict_face_velocity

  !> Time for which the compact acceleration of a face counts: dt' = dt/(1 + 2 nu dt sum 1/h^2) [s].
  pure function face_step(grid, dt, nu) result(step)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: dt   !! [s]
    real(wp), intent(in) :: nu   !! kinematic viscosity [m2/s]
    real(wp) :: step

    step = dt/(1.0_wp + 2.0_wp*nu*dt*sum(1.0_wp/grid%h**2))
  end function face_step

  !> Faces beside a moving surface: what of the velocity is normal to the wall goes linearly from
  !! that of the cell to that of the wall, where the leg through the face ends; the rest is the
  !! cell's.
  !!
  !! A face that opens or closes under a flat side then does so with the velocity of the wall. With
  !! the mean of the two cells instead, each layer of faces that the side crosses takes an impulse
  !! of about rho A h (U - u) from the body, which neither a finer grid nor a shorter step makes
  !! smaller (measured: docs/decisions/coupling.md). Along the wall the fluid slips past it: taking
  !! the wall's whole velocity there makes the added mass wrong by some per cent.
  subroutine face_velocity_at_walls(grid, solid, bodies, dt, rho, a_face, a_cell, flow)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies   !! motion at the start of the step
    real(wp), intent(in) :: dt                   !! [s]
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! that of the system [kg/m3]
    real(wp), intent(in), dimension(grid%first(1):, grid%first(2):, grid%first(3):, :), &
      contiguous :: a_face, a_cell
    type(flow_t), intent(inout) :: flow
    integer :: m, d, f(3), low(3), sides
    real(wp) :: total

    do m = 1, solid%n_leg
      f = solid%leg(1:3, m)
      d = solid%leg(4, m)
      low = f - unit_step(:, d)
      if (any(f < grid%lo) .or. any(f > grid%hi + unit_step(:, d))) cycle
      if (any((low < 1 .or. f > grid%n) .and. .not. grid%periodic)) cycle
      associate (i => f(1), j => f(2), k => f(3))
        if (solid%open(i, j, k, d) <= 0.0_wp) cycle
        sides = 0
        total = 0.0_wp
        if (solid%inside(low(1), low(2), low(3)) == 0) then
          call add_side(low, 1, solid%leg_low(i, j, k, d), solid%leg_body_low(i, j, k, d))
        end if
        if (solid%inside(i, j, k) == 0) then
          call add_side(f, -1, solid%leg_high(i, j, k, d), solid%leg_body_high(i, j, k, d))
        end if
        if (sides > 0) flow%uf(i, j, k, d) = total/real(sides, wp)
      end associate
    end do
  contains
    !> Velocity of the face as seen from cell c, whose leg along +d or -d ends at theta cells.
    subroutine add_side(c, sense, theta, body)
      integer, intent(in) :: c(3), sense, body
      real(wp), intent(in) :: theta   !! [cells]
      real(wp) :: x_wall(3), wall(3), n(3), u(3), nu, dt_face
      integer :: a

      if (body == 0) return
      nu = flow%mu(c(1), c(2), c(3))/rho(c(1), c(2), c(3))
      dt_face = face_step(grid, dt, nu)
      do a = 1, 3
        x_wall(a) = grid%centre(c(a), a)
      end do
      x_wall(d) = x_wall(d) + real(sense, wp)*theta*grid%h(d)
      wall = wall_velocity(bodies%motion(:, body), nearest_arm(grid, x_wall, bodies%x(:, body)))
      u = flow%u(c(1), c(2), c(3), :) - dt_face*a_cell(c(1), c(2), c(3), :)
      n = wall_normal(low) + wall_normal(f)
      sides = sides + 1
      total = total + u(d) + min(1.0_wp, 0.5_wp/theta)*n(d)*dot_product(n, wall - u) &
              /max(dot_product(n, n), tiny(1.0_wp)) + dt_face*a_face(f(1), f(2), f(3), d)
    end subroutine add_side

    !> Wall area of a cell as a vector into the fluid: what its open faces lack to close [m2].
    pure function wall_normal(c) result(area)
      integer, intent(in) :: c(3)
      real(wp) :: area(3)
      integer :: a, e(3)

      do a = 1, 3
        e = unit_step(:, a)
        area(a) = grid%area(a)*(solid%open(c(1) + e(1), c(2) + e(2), c(3) + e(3), a) &
                                - solid%open(c(1), c(2), c(3), a))
      end do
    end function wall_normal
  end subroutine face_velocity_at_walls

  !> Make the face velocity free of divergence; pressure and motion of the free bodies follow.
  !!
  !! On entry `flow%uf` and `bodies%motion` are predictions and the system is set. On return both
  !! are final, `flow%p` has changed by `self%phi_total`, `flow%solid_flux` is that of the final
  !! motion.
  subroutine solve_pressure(grid, numerics, solid, rho, dt, flow, bodies, self, report)
    type(grid_t), intent(in) :: grid
    type(numerics_t), intent(in) :: numerics
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! that of the system [kg/m3]
    real(wp), intent(in) :: dt   !! [s]
    type(flow_t), intent(inout) :: flow
    type(rigid_motion_t), intent(inout) :: bodies
    type(pressure_t), intent(inout) :: self
    type(pressure_report_t), intent(out) :: report
    integer :: iterations
    real(wp) :: tolerance   !! of the residual of the linear system [m3/s2]

    self%phi_total = 0.0_wp
    self%operator%bodies = bodies
    call find_swallowed(grid, self)
    tolerance = 0.5_wp*numerics%divergence_tolerance*grid%volume/dt
    do
      call solid_face_flux(grid, solid, bodies, self%operator%flux, flow%solid_flux)
      call divergence(grid, solid%open, flow%uf, flow%solid_flux, self%active, self%rhs, &
                      report%divergence)
      if (self%work%singular) report%divergence = uneven(grid, self%rhs, self%work)
      report%converged = report%divergence < numerics%divergence_tolerance
      if (report%converged .or. report%passes == numerics%max_pressure_passes) exit
      self%rhs = -self%rhs/dt
      self%phi = 0.0_wp
      call solve_linear(numerics, tolerance, self, iterations)
      report%passes = report%passes + 1
      report%iterations = report%iterations + iterations
      call add_correction(grid, rho, dt, bodies, flow, self)
    end do
    call fill_scalar_halo(grid, self%phi_total)
    flow%p = flow%p + self%phi_total
  end subroutine solve_pressure

  !> Largest divergence in a closed box less its mean over the open cells [1/s], which is what the
  !! walls swallow (`find_swallowed`). The transport shares it out, too (`open_flux_m`).
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

  !> One linear solve for phi with the chosen method.
  subroutine solve_linear(numerics, tolerance, self, iterations)
    type(numerics_t), intent(in) :: numerics
    real(wp), intent(in) :: tolerance
    type(pressure_t), intent(inout) :: self
    integer, intent(out) :: iterations

    select case (trim(numerics%preconditioner))
    case ('multigrid'); call solve_with(self%multigrid)
    case ('jacobi'); call solve_with(self%jacobi)
    case default; call solve_with(self%identity)
    end select
  contains
    subroutine solve_with(preconditioner)
      class(preconditioner_t), intent(inout) :: preconditioner
      real(wp) :: residual
      integer :: info   !! 0: converged; the next pass sees what is left either way

      if (trim(numerics%pressure_solver) == 'bicgstab') then
        call bicgstab(self%operator, preconditioner, self%rhs, self%phi, tolerance, &
                      max_iterations, iterations, residual, info, self%work)
      else
        call conjugate_gradient(self%operator, preconditioner, self%rhs, self%phi, tolerance, &
                                max_iterations, iterations, residual, info, self%work)
      end if
    end subroutine solve_with
  end subroutine solve_linear

  !> Add phi to the total, its gradient to the face velocity, its push to the bodies.
  subroutine add_correction(grid, rho, dt, bodies, flow, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(in) :: dt
    type(rigid_motion_t), intent(inout) :: bodies
    type(flow_t), intent(inout) :: flow
    type(pressure_t), intent(inout) :: self
    real(wp), parameter :: weightless(3) = 0.0_wp
    integer :: b

    associate (a => grid%lo, z => grid%hi)
      self%phi_pass(a(1):z(1), a(2):z(2), a(3):z(3)) = self%phi(a(1):z(1), a(2):z(2), a(3):z(3))
    end associate
    call fill_scalar_halo(grid, self%phi_pass)
    call face_acceleration(grid, weightless, rho, rho, self%phi_pass, self%a_face, flow%sides)
    flow%uf = flow%uf + dt*self%a_face
    self%phi_total = self%phi_total + self%phi_pass
    call force_from_cells(bodies, self%operator%flux, self%phi, grid%lo - 1, self%operator%push)
    call motion_of_force(bodies, self%operator%push)
    do b = 1, bodies%n
      if (bodies%free(b)) bodies%motion(:, b) = bodies%motion(:, b) + dt*self%operator%push(:, b)
    end do
  end subroutine add_correction

  !> Pressure of cells without open faces, for the cells that will open and for looking: mean of the
  !! known neighbours of the same height, and only where there are none, hydrostatic from above or
  !! below.
  subroutine extend_pressure(grid, gravity, rho, active, known, p)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: gravity(3)
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
    logical, intent(in), contiguous :: active(grid%first(1):, grid%first(2):, grid%first(3):)
    integer, intent(inout), contiguous :: known(grid%first(1):, grid%first(2):, grid%first(3):)
                                                  !! work: pass in which p was found, 0 unknown
    real(wp), intent(inout), contiguous :: p(grid%first(1):, grid%first(2):, grid%first(3):)
      !! [Pa]
    integer :: i, j, k, pass, n_found
    integer(i8) :: left(1)
    logical :: sideways

    known = 0
    where (active) known = 1
    sideways = .true.
    pass = 1
    do
      call halo_exchange(p, n_halo)
      call halo_exchange(known, n_halo)
      pass = pass + 1
      n_found = 0
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            if (known(i, j, k) == 0) call from_neighbours([i, j, k])
          end do
        end do
      end do
      left = n_found
      call global_sum(left)
      if (left(1) > 0_i8) cycle
      if (.not. sideways) exit
      sideways = .false.
    end do
    call fill_scalar_halo(grid, p)
  contains
    !> Mean over the neighbours known before this pass.
    subroutine from_neighbours(c)
      integer, intent(in) :: c(3)
      integer :: d, s, n(3), count
      real(wp) :: total

      count = 0
      total = 0.0_wp
      do d = 1, 3
        if (sideways .and. abs(gravity(d)) > 0.0_wp) cycle
        do s = -1, 1, 2
          n = c + s*unit_step(:, d)
          if (any((n < 1 .or. n > grid%n) .and. .not. grid%periodic)) cycle
          if (known(n(1), n(2), n(3)) == 0 .or. known(n(1), n(2), n(3)) == pass) cycle
          count = count + 1
          total = total + p(n(1), n(2), n(3)) - real(s, wp)*gravity(d)*grid%h(d) &
                  *face_mean(rho(n(1), n(2), n(3)), rho(c(1), c(2), c(3)))
        end do
      end do
      if (count == 0) return
      p(c(1), c(2), c(3)) = total/real(count, wp)
      known(c(1), c(2), c(3)) = pass
      n_found = n_found + 1
    end subroutine from_neighbours
  end subroutine extend_pressure

end module pressure_m
