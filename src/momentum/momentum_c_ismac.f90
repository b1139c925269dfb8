!> C-ISMAC: the paper's implicit predictor, in velocity and delta form.
!!
!! The change of the velocity in the predictor, `delta = u* - u^n`, follows from
!! $$ \rho\Big[\delta + \Delta t\, a\, (u_f\cdot\nabla)_{up}\, \delta\Big]
!!    - \Delta t \nabla\cdot\mu\nabla\delta
!!    = \Delta t \Big[\rho g - \nabla p^n + \nabla\cdot\mu\nabla u^n
!!    - \rho (u_f\cdot\nabla) u^n\Big] $$
!! The right side has the accurate advection (fifth order, or the donor's value), the left side
!! that of first order, whose matrix is diagonally dominant at any Courant number. Where the flow is
!! steady delta is zero, so neither the step nor the first-order operator leaves a trace in it. The
!! viscous part, the wall links and the motion of the free bodies are those of `viscous_links_m`, in
!! the same system; the bodies are eliminated, the rest is solved with BiCGSTAB.
!!
!! Advection is written with the volumes q that pass the open faces in the step,
!! $$ V\Delta t\,(u_f\cdot\nabla) u = \sum_f q_f (\tilde u_f - u_c), $$
!! the form of div(u u) in which a uniform velocity stays whatever the bodies or the rounding of the
!! divergence do.
!!
!! Density and pressure of the right side are those of the start of the step. With the density of
!! its end, a cell that the surface has left would fall with the pressure gradient of the liquid
!! over the density of the gas, 830 g, and what advection makes of that no projection takes back.
!!
!! Source: Yoshikawa et al. (2008) name the method; its form after Ikohagi, Shin & Daiguji (1992),
!! who weight the first-order operator by 1/2. Departure: 3/4, since 1/2 beside a fifth-order right
!! side lets long waves grow at any Courant number, and short ones above one; linear waves decay at
!! any Courant number in one direction from 0.70 on.
module momentum_c_ismac_m
  use kinds_m, only: wp, i8
  use vectors_m, only: wrench
  use grid_m, only: grid_t, unit_step
  use boundary_kinds_m, only: side_inflow
  use fields_m, only: flow_t
  use rigid_motion_m, only: rigid_motion_t, wall_velocity, inverse_of
  use tvd_m, only: face_values, scheme_of, mp_scheme
  use viscous_system_m, only: viscous_t, wall_links_t
  use viscous_m, only: apply_viscous, pull_of_links, velocity_scale, inertial_momentum
  use linear_operator_m, only: linear_operator_t, identity_t
  use solve_control_m, only: solve_control_t, solve_report_t, solved
  use krylov_m, only: krylov_work_t, krylov_init, bicgstab
  use exact_sum_m, only: accumulator_size, no_terms, exact_add_columns, exact_totals
  use parallel_m, only: halo_exchange
  implicit none
  private
  public :: c_ismac_t, c_ismac_init, begin_predictor, solve_predictor, &
            advected_velocity

  real(wp), parameter :: implicit_share = 0.75_wp   !! a, weight of the first-order operator
  real(wp), parameter :: tolerance = 1.0e-9_wp      !! of the largest velocity
  integer, parameter :: max_iterations = 500
  integer, parameter :: worth_threads = 8192        !! fewer numbers are the work of one thread

  !> The left side over its diagonal, for the three components one above the other along z.
  type, extends(linear_operator_t) :: predictor_operator_t
    integer :: lo(3) = 1, hi(3) = 0
    !> Conductance of viscosity and of inflow to the cell from its lower and its upper neighbour in
    !! each direction [kg/s].
    real(wp), allocatable :: low(:, :, :, :), high(:, :, :, :)
    real(wp), allocatable :: inverse(:, :, :, :)   !! of the diagonal, 0: not an unknown [s/kg]
    real(wp), allocatable :: x(:, :, :, :), y(:, :, :, :)   !! by component, one halo cell
    ! Wall links of the viscous system while it is solved, and the bodies eliminated.
    logical, allocatable :: free(:)                !! (bodies)
    type(wall_links_t), pointer :: walls => null()
    real(wp), allocatable :: mobility(:, :, :)     !! (6, 6, n) motion per impulse rate, 0: held
  contains
    procedure :: apply => apply_predictor
  end type predictor_operator_t

  type :: c_ismac_t
    integer :: scheme = mp_scheme                  !! of the advection on the right side
    real(wp), allocatable :: q(:, :, :, :)         !! volumes of the step, lower faces [m3]
    real(wp), allocatable :: u_old(:, :, :, :)     !! velocity u^n, halo filled [m/s]
    !> Gravity less pressure gradient over density at u^n, and with the density at u* [m/s2].
    real(wp), allocatable :: a_old(:, :, :, :), a_new(:, :, :, :)
    real(wp), allocatable :: gain(:, :, :, :)      !! -sum_f q_f (u~_f - u_c) of u^n [m4/s]
    type(predictor_operator_t) :: operator
    type(krylov_work_t) :: work
    real(wp), allocatable :: rhs(:, :, :), delta(:, :, :)   !! components one above the other
  end type c_ismac_t

contains

  !> Allocate for a grid and n bodies.
  subroutine c_ismac_init(grid, n, advection, self)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: n
    character(*), intent(in) :: advection   !! 'mp5' | 'tvd5' | 'upwind'
    type(c_ismac_t), intent(out) :: self
    type(grid_t) :: stacked   !! three components as one block
    integer :: a(3), b(3)

    self%scheme = scheme_of(advection)
    a = grid%first
    b = grid%last
    allocate (self%q(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
    allocate (self%u_old, self%a_old, self%a_new, self%gain, source=self%q)
    associate (op => self%operator)
      op%lo = grid%lo
      op%hi = grid%hi
      a = grid%lo - 1
      b = grid%hi + 1
      allocate (op%low(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
      allocate (op%high, op%inverse, op%x, op%y, source=op%low)
      allocate (op%free(n), source=.false.)
      allocate (op%mobility(6, 6, n), source=0.0_wp)
    end associate
    call stacked%own(grid%lo, [grid%hi(1:2), grid%lo(3) + 3*(grid%hi(3) - grid%lo(3) + 1) - 1])
    call krylov_init(stacked, self%work)
    allocate (self%rhs, self%delta, source=self%work%r)
  end subroutine c_ismac_init

  !> Advection of the right side, at the velocity from which the step starts; `self%q` is set.
  subroutine begin_predictor(grid, u, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! u^n, halo filled [m/s]
    type(c_ismac_t), intent(inout) :: self
    real(wp), allocatable :: face(:, :, :)   ! u~ on the lower faces of one direction [m/s]
    integer :: i, j, k, m, d, e(3)

    associate (a => grid%first, b => grid%last)
      allocate (face(a(1):b(1), a(2):b(2), a(3):b(3)))
    end associate
    self%u_old = u
    self%gain = 0.0_wp
    do m = 1, 3
      do d = 1, 3
        e = unit_step(:, d)
        call face_values(grid, self%scheme, e, self%q(:, :, :, d), u(:, :, :, m), face)
        !$omp parallel do private(i, j) schedule(static)
        do k = grid%lo(3), grid%hi(3)
          do j = grid%lo(2), grid%hi(2)
            do i = grid%lo(1), grid%hi(1)
              self%gain(i, j, k, m) = self%gain(i, j, k, m) &
                + self%q(i, j, k, d)*(face(i, j, k) - u(i, j, k, m)) &
                - self%q(i + e(1), j + e(2), k + e(3), d) &
                  *(face(i + e(1), j + e(2), k + e(3)) - u(i, j, k, m))
            end do
          end do
        end do
      end do
    end do
  end subroutine begin_predictor

  !> Solve for the velocity u*, in place, together with the motion of the free bodies.
  !!
  !! On entry `flow%u` is u^n with gravity and old pressure in, `bodies%motion` likewise, `viscous`
  !! is built and `begin_predictor` done; on return viscosity and advection are in too.
  !! `viscous%force` is what viscosity did to each body [N, N m].
  subroutine solve_predictor(grid, rho, bodies, flow, viscous, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! that of the system [kg/m3]
    type(rigid_motion_t), intent(inout) :: bodies
    type(flow_t), intent(inout) :: flow
    type(viscous_t), intent(inout), target :: viscous
    type(c_ismac_t), intent(inout) :: self
    real(wp), dimension(6, bodies%n) :: none, pull, motion
    type(solve_control_t) :: control
    type(solve_report_t) :: report
    type(identity_t) :: identity
    real(wp) :: scale
    integer :: m, b

    call velocity_scale(grid, flow%u, bodies, scale)
    call set_operator(grid, rho, bodies, viscous%dt, viscous, self)
    do m = 1, 3
      viscous%s(:, :, :, m) = merge(self%u_old(:, :, :, m), 0.0_wp, viscous%mass > 0.0_wp)
    end do
    none = 0.0_wp
    call apply_viscous(grid, bodies, viscous, none, pull)
    do b = 1, bodies%n   ! motion if the fluid kept its velocity
      motion(:, b) = bodies%motion(:, b)
      if (bodies%free(b)) motion(:, b) = matmul(self%operator%mobility(:, :, b), &
        inertial_momentum(bodies, b, viscous%dt, bodies%motion(:, b)) - pull(:, b))
    end do
    call right_side(grid, rho, viscous%dt, flow%u, motion, viscous, self)
    self%delta = 0.0_wp
    control%tolerance = tolerance*scale
    control%max_iterations = max_iterations
    call bicgstab(self%operator, identity, self%rhs, self%delta, control, report, self%work)
    viscous%iterations = report%iterations
    viscous%converged = report%info == solved
    call unpack_components(self%delta, self%operator)
    associate (a => grid%lo, z => grid%hi)
      do m = 1, 3
        where (viscous%mass(a(1):z(1), a(2):z(2), a(3):z(3)) > 0.0_wp)
          flow%u(a(1):z(1), a(2):z(2), a(3):z(3), m) = &
            self%u_old(a(1):z(1), a(2):z(2), a(3):z(3), m) &
            + self%operator%x(a(1):z(1), a(2):z(2), a(3):z(3), m)
        else where
          flow%u(a(1):z(1), a(2):z(2), a(3):z(3), m) = 0.0_wp   ! the wall's; set by the coupling
        end where
      end do
    end associate
    do b = 1, bodies%n
      if (bodies%free(b)) bodies%motion(:, b) = motion(:, b) &
        + matmul(self%operator%mobility(:, :, b), pull_of_walls(self%operator, b))
    end do
    call pull_of_links(viscous, flow%u, bodies%motion, viscous%force)
  end subroutine solve_predictor

  !> Coefficients of the left side from the viscous links and the inflow of each cell.
  subroutine set_operator(grid, rho, bodies, dt, viscous, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in) :: dt
    type(viscous_t), intent(in), target :: viscous
    type(c_ismac_t), intent(inout) :: self
    integer :: i, j, k, d, m, e(3)
    real(wp) :: inflow, unit(6), matrix(6, 6)

    associate (op => self%operator)
      !$omp parallel do private(i, j, d, m, e, inflow) schedule(static)
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            inflow = 0.0_wp
            do d = 1, 3
              e = unit_step(:, d)
              op%low(i, j, k, d) = share_of(rho(i, j, k), self%q(i, j, k, d), &
                                            i*e(1) + j*e(2) + k*e(3), 1, d)
              op%high(i, j, k, d) = share_of(rho(i, j, k), &
                                             -self%q(i + e(1), j + e(2), k + e(3), d), &
                                             i*e(1) + j*e(2) + k*e(3), 2, d)
              inflow = inflow + op%low(i, j, k, d) + op%high(i, j, k, d)
              op%low(i, j, k, d) = op%low(i, j, k, d) + viscous%link(i, j, k, d)
              op%high(i, j, k, d) = op%high(i, j, k, d) &
                                    + viscous%link(i + e(1), j + e(2), k + e(3), d)
            end do
            do m = 1, 3
              op%inverse(i, j, k, m) = 0.0_wp
              if (viscous%mass(i, j, k) > 0.0_wp) op%inverse(i, j, k, m) = &
                1.0_wp/(viscous%diagonal(i, j, k, m) + inflow)
            end do
          end do
        end do
      end do
    end associate
    ! Wall links, and the motion that an impulse rate gives each free body when the links hold it.
    associate (op => self%operator, walls => viscous%walls)
      op%walls => viscous%walls
      op%free = bodies%free
      do i = 1, bodies%n
        op%mobility(:, :, i) = 0.0_wp
        if (.not. bodies%free(i)) cycle
        do m = 1, 6
          unit = 0.0_wp
          unit(m) = 1.0_wp
          matrix(:, m) = viscous%body_matrix(:, m, i) + inertial_momentum(bodies, i, dt, unit)
        end do
        op%mobility(:, :, i) = inverse_of(matrix)
      end do
    end associate
  contains
    !> Conductance a rho q/dt of the volume that enters a cell through one face [kg/s]; none where
    !! it enters with the velocity of the cell itself, through an open side of the domain.
    pure function share_of(rho, q, cell, s, d) result(conductance)
      real(wp), intent(in) :: rho, q   !! [kg/m3], volume that enters [m3]
      integer, intent(in) :: cell, s, d
      real(wp) :: conductance

      conductance = implicit_share*rho*max(q, 0.0_wp)/dt
      if (grid%periodic(d) .or. cell /= merge(1, grid%n(d), s == 1)) return
      if (grid%side(s, d) /= side_inflow) conductance = 0.0_wp
    end function share_of
  end subroutine set_operator

  !> The right side over the diagonal: all accelerations at u^n, walls with the given motions.
  subroutine right_side(grid, rho, dt, u, motion, viscous, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(in) :: dt
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(in) :: motion(:, :)      !! (6, bodies)
    type(viscous_t), intent(in) :: viscous    !! its y is the viscous system applied to u^n
    type(c_ismac_t), intent(inout) :: self
    integer :: i, j, k, m, b, l

    associate (op => self%operator)
      !$omp parallel do collapse(2) private(i, j) schedule(static)
      do m = 1, 3
        do k = grid%lo(3), grid%hi(3)
          do j = grid%lo(2), grid%hi(2)
            do i = grid%lo(1), grid%hi(1)
              op%y(i, j, k, m) = viscous%mass(i, j, k)*u(i, j, k, m) - viscous%y(i, j, k, m) &
                                 + rho(i, j, k)*self%gain(i, j, k, m)/dt
            end do
          end do
        end do
      end do
      do b = 1, size(op%free)
        do l = op%walls%first(b), op%walls%first(b + 1) - 1
          associate (c => op%walls%cell(:, l))
            op%y(c(1), c(2), c(3), :) = op%y(c(1), c(2), c(3), :) &
              + op%walls%k(l)*wall_velocity(motion(:, b), op%walls%arm(:, l))
          end associate
        end do
      end do
      do l = 1, viscous%sides%n
        associate (c => viscous%sides%cell(:, l))
          op%y(c(1), c(2), c(3), :) = op%y(c(1), c(2), c(3), :) + viscous%sides%pull(:, l)
        end associate
      end do
      op%y = op%inverse*op%y
    end associate
    call pack_components(self%operator, self%rhs)
  end subroutine right_side

  !> y = A x: the left side over its diagonal.
  subroutine apply_predictor(self, x, y)
    class(predictor_operator_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: x(:, :, :)
    real(wp), intent(inout), contiguous :: y(:, :, :)
    integer :: b, i, j, k, l, m
    real(wp) :: motion(6)

    call unpack_components(x, self)
    call halo_exchange(self%x, 1)
    associate (v => self%x, low => self%low, high => self%high)
      !$omp parallel do collapse(2) private(i, j) schedule(static) if (size(x) > worth_threads)
      do m = 1, 3
        do k = self%lo(3), self%hi(3)
          do j = self%lo(2), self%hi(2)
            do i = self%lo(1), self%hi(1)
              self%y(i, j, k, m) = v(i, j, k, m) - self%inverse(i, j, k, m) &
                *(low(i, j, k, 1)*v(i - 1, j, k, m) + high(i, j, k, 1)*v(i + 1, j, k, m) &
                  + low(i, j, k, 2)*v(i, j - 1, k, m) + high(i, j, k, 2)*v(i, j + 1, k, m) &
                  + low(i, j, k, 3)*v(i, j, k - 1, m) + high(i, j, k, 3)*v(i, j, k + 1, m))
            end do
          end do
        end do
      end do
    end associate
    do b = 1, size(self%free)
      if (.not. self%free(b)) cycle
      motion = matmul(self%mobility(:, :, b), pull_of_walls(self, b))
      do l = self%walls%first(b), self%walls%first(b + 1) - 1
        associate (c => self%walls%cell(:, l))
          self%y(c(1), c(2), c(3), :) = self%y(c(1), c(2), c(3), :) - self%inverse(c(1), c(2), &
            c(3), :)*self%walls%k(l)*wall_velocity(motion, self%walls%arm(:, l))
        end associate
      end do
    end do
    call pack_components(self, y)
  end subroutine apply_predictor

  !> Force and torque per velocity of what stands in `op%x` on body b, through its wall links.
  function pull_of_walls(op, b) result(pull)
    type(predictor_operator_t), intent(inout) :: op
    integer, intent(in) :: b
    real(wp) :: pull(6)
    real(wp) :: terms(op%walls%first(b + 1) - op%walls%first(b), 6)   ! of its links
    integer(i8) :: accumulator(accumulator_size, 6)
    integer :: l

    do l = 1, size(terms, 1)
      associate (m => op%walls%first(b) + l - 1)
        associate (c => op%walls%cell(:, m))
          terms(l, :) = wrench(op%walls%k(m)*op%x(c(1), c(2), c(3), :), op%walls%arm(:, m))
        end associate
      end associate
    end do
    accumulator = spread(no_terms, 2, 6)
    call exact_add_columns(terms, accumulator)
    call exact_totals(accumulator, pull)
  end function pull_of_walls

  !> The stacked components of a vector of the solver into `op%x`.
  subroutine unpack_components(stacked, op)
    real(wp), intent(in), contiguous :: stacked(:, :, :)
    class(predictor_operator_t), intent(inout) :: op
    integer :: m, k, n(3)

    n = op%hi - op%lo + 1
    !$omp parallel do collapse(2) schedule(static) if (size(stacked) > worth_threads)
    do m = 1, 3
      do k = 1, n(3)
        op%x(op%lo(1):op%hi(1), op%lo(2):op%hi(2), op%lo(3) + k - 1, m) = &
          stacked(2:n(1) + 1, 2:n(2) + 1, 1 + (m - 1)*n(3) + k)
      end do
    end do
  end subroutine unpack_components

  !> `op%y` into a vector of the solver.
  subroutine pack_components(op, stacked)
    class(predictor_operator_t), intent(in) :: op
    real(wp), intent(inout), contiguous :: stacked(:, :, :)
    integer :: m, k, n(3)

    n = op%hi - op%lo + 1
    !$omp parallel do collapse(2) schedule(static) if (size(stacked) > worth_threads)
    do m = 1, 3
      do k = 1, n(3)
        stacked(2:n(1) + 1, 2:n(2) + 1, 1 + (m - 1)*n(3) + k) = &
          op%y(op%lo(1):op%hi(1), op%lo(2):op%hi(2), op%lo(3) + k - 1, m)
      end do
    end do
  end subroutine pack_components

  !> Add to u, in own cells, what advection alone changed in the last `solve_predictor`.
  subroutine advected_velocity(grid, rho, dt, viscous, self, u)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(in) :: dt
    type(viscous_t), intent(in) :: viscous
    type(c_ismac_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s]
    integer :: i, j, k, d, m, e(3)
    real(wp) :: rate(3)   !! of momentum [kg m/s2]

    call unpack_components(self%delta, self%operator)
    call halo_exchange(self%operator%x, 1)
    associate (op => self%operator, x => self%operator%x)
      !$omp parallel do private(i, j, d, m, e, rate) schedule(static)
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            rate = rho(i, j, k)*self%gain(i, j, k, :)/dt
            do d = 1, 3
              e = unit_step(:, d)
              rate = rate + (op%low(i, j, k, d) - viscous%link(i, j, k, d)) &
                     *(x(i - e(1), j - e(2), k - e(3), :) - x(i, j, k, :)) &
                     + (op%high(i, j, k, d) - viscous%link(i + e(1), j + e(2), k + e(3), d)) &
                     *(x(i + e(1), j + e(2), k + e(3), :) - x(i, j, k, :))
            end do
            do m = 1, 3
              associate (mass => viscous%mass(i, j, k))
                if (mass > 0.0_wp) u(i, j, k, m) = u(i, j, k, m) + rate(m)/mass
              end associate
            end do
          end do
        end do
      end do
    end associate
  end subroutine advected_velocity

end module momentum_c_ismac_m
