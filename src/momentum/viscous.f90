!> Implicit viscosity with no-slip on the bodies: the velocities of cells and bodies are unknowns of
!! one system.
!!
!! The force on a body is the sum over its wall legs (`viscous_legs_m`), so the stage conserves
!! momentum. Departure from the paper: its overlay gives a drag that depends on the time step.
!!
!! Solved by Jacobi sweeps as long as each leaves a tenth at most, as where a step moves momentum by
!! much less than a cell; from there on by conjugate gradients.
module viscous_m
  use kinds_m, only: wp, i8
  use grid_m, only: grid_t, n_halo
  use fields_m, only: flow_t
  use rigid_motion_m, only: rigid_motion_t, wall_velocity
  use viscous_system_m, only: viscous_t, wall_legs_t, wrench
  use exact_sum_m, only: exact_dot, exact_add_columns, exact_totals, bin_size, no_terms, &
    terms_at_once
  use parallel_m, only: halo_exchange, global_max
  implicit none
  private
  public :: solve_viscous
  public :: apply_viscous, force_of_legs, velocity_scale, inertial_momentum   ! for C-ISMAC

  real(wp), parameter :: tolerance = 1.0e-9_wp      !! of the largest velocity
  real(wp), parameter :: quick = 0.1_wp             !! of what is left after a sweep
  integer, parameter :: max_iterations = 500
  integer, parameter :: worth_threads = 1000        !! fewer legs are looked at by one thread

contains

  !> Solve for the velocity after viscosity, in place, together with the motion of the free bodies.
  !!
  !! On entry `flow%u` and `bodies%motion` are the velocities with all other forces in; on return
  !! with viscosity too. `self%force` is what the fluid did to each body, fixed ones included.
  subroutine solve_viscous(grid, bodies, flow, self)
    type(grid_t), intent(in) :: grid
    type(rigid_motion_t), intent(inout) :: bodies
    type(flow_t), intent(inout) :: flow
    type(viscous_t), intent(inout) :: self
    real(wp), dimension(6, bodies%n) :: r_body, z_body, s_body, y_body, start
    real(wp) :: rz, rz_before, alpha, beta, scale
    real(wp) :: worst, worst_before   !! velocity change that one Jacobi sweep would make [m/s]
    logical :: sweeps                 !! it does so well that there is no need of a direction
    integer :: b

    start = bodies%motion
    s_body = bodies%motion
    call velocity_scale(grid, flow%u, bodies, scale)
    call first_guess(grid, self%mass, flow%u, self%s, self%r)
    call apply_viscous(grid, bodies, self, s_body, y_body)
    call add_side_pull(self)
    do b = 1, bodies%n
      r_body(:, b) = inertial_momentum(bodies, b, self%dt, start(:, b))
    end do
    call improve(grid, 1.0_wp, self%y, self%r, self%inverse, self%z, worst)
    r_body = r_body - y_body
    sweeps = .true.
    worst_before = huge(worst)
    rz = 0.0_wp
    self%iterations = 0
    do
      call precondition_bodies()
      worst = max(worst, maxval([0.0_wp, abs(z_body(1:3, :))]))
      self%converged = worst <= tolerance*scale
      if (self%converged .or. self%iterations == max_iterations) exit
      sweeps = sweeps .and. worst < quick*worst_before
      if (sweeps) then
        worst_before = worst
        s_body = z_body
        alpha = 1.0_wp
        call sweep(grid, bodies, s_body, flow%u, self, y_body, worst)
      else
        rz_before = rz
        rz = dot(self%r, self%z) + sum_bodies(r_body, z_body)
        beta = 0.0_wp
        if (rz_before > 0.0_wp) beta = rz/rz_before
        call new_direction(grid, beta, self%z, self%s)
        s_body = z_body + beta*s_body
        call apply_viscous(grid, bodies, self, s_body, y_body)
        alpha = rz/(dot(self%s, self%y) + sum_bodies(s_body, y_body))
        call improve(grid, -alpha, self%s, flow%u)
        call improve(grid, alpha, self%y, self%r, self%inverse, self%z, worst)
      end if
      bodies%motion = bodies%motion + alpha*s_body
      r_body = r_body - alpha*y_body
      self%iterations = self%iterations + 1
    end do
    call force_of_legs(bodies, flow, self)
  contains
    !> Residual of the bodies over their translational or rotational inertia.
    subroutine precondition_bodies()
      integer :: b, c

      z_body = 0.0_wp
      do b = 1, bodies%n
        if (.not. bodies%free(b)) cycle
        associate (m => self%body_matrix(:, :, b))
          do c = 1, 6
            z_body(c, b) = r_body(c, b)/(bodies%apparent(c, c, b)/self%dt + m(c, c))
          end do
        end associate
      end do
    end subroutine precondition_bodies

    !> Scalar product over the cells of all processes.
    function dot(a, b) result(total)
      real(wp), intent(in), contiguous :: a(:, :, :, :), b(:, :, :, :)
      real(wp) :: total
      integer :: c

      total = 0.0_wp
      do c = 1, 3
        total = total + exact_dot(a(:, :, :, c), b(:, :, :, c), n_halo)
      end do
    end function dot

    !> Scalar product over the free bodies.
    pure function sum_bodies(a, b) result(total)
      real(wp), intent(in) :: a(:, :), b(:, :)
      real(wp) :: total
      integer :: n

      total = 0.0_wp
      do n = 1, size(a, 2)
        if (bodies%free(n)) total = total + dot_product(a(:, n), b(:, n))
      end do
    end function sum_bodies
  end subroutine solve_viscous

  !> The velocity at hand as the guess s, with its momentum over dt, r; none where the velocity is
  !! the wall's (`impose_rigid_velocity` sets it).
  subroutine first_guess(grid, mass, u, s, r)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: mass(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(inout), dimension(grid%first(1):, grid%first(2):, grid%first(3):, :), &
      contiguous :: u, s, r
    integer :: i, j, k, c

    !$omp parallel do collapse(2) private(i, j) schedule(static)
    do c = 1, 3
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            u(i, j, k, c) = merge(u(i, j, k, c), 0.0_wp, mass(i, j, k) > 0.0_wp)
            s(i, j, k, c) = u(i, j, k, c)
            r(i, j, k, c) = mass(i, j, k)*u(i, j, k, c)
          end do
        end do
      end do
    end do
  end subroutine first_guess

  !> What the moving sides pull goes to the right side.
  pure subroutine add_side_pull(self)
    type(viscous_t), intent(inout) :: self
    integer :: m

    do m = 1, self%sides%n
      associate (c => self%sides%cell(:, m))
        self%r(c(1), c(2), c(3), :) = self%r(c(1), c(2), c(3), :) + self%sides%pull(:, m)
      end associate
    end do
  end subroutine add_side_pull

  !> Largest velocity of the fluid in own cells, of the bodies and of the sides [m/s]; never zero.
  subroutine velocity_scale(grid, u, bodies, scale)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(out) :: scale
    real(wp) :: m(1)
    integer :: k, c

    m = 0.0_wp
    associate (a => grid%lo, z => grid%hi)
      !$omp parallel do collapse(2) reduction(max: m) schedule(static)
      do c = 1, 3
        do k = grid%lo(3), grid%hi(3)
          m = max(m, maxval(abs(u(a(1):z(1), a(2):z(2), k, c))))
        end do
      end do
    end associate
    call global_max(m)
    scale = max(m(1), 1.0e-12_wp, maxval([0.0_wp, abs(bodies%motion(1:3, :))]), &
                maxval(abs(grid%side_velocity)))
  end subroutine velocity_scale

  !> Momentum and angular momentum over dt of a motion of body b.
  pure function inertial_momentum(bodies, b, dt, motion) result(p)
    type(rigid_motion_t), intent(in) :: bodies
    integer, intent(in) :: b
    real(wp), intent(in) :: dt, motion(6)
    real(wp) :: p(6)

    p = matmul(bodies%apparent(:, :, b), motion)/dt
  end function inertial_momentum

  !> x := x - a y on the own cells; with `inverse` also z := x*inverse and the largest |z|.
  subroutine improve(grid, a, y, x, inverse, z, largest)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: a
    real(wp), intent(in), contiguous :: y(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(inout), contiguous :: x(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(in), contiguous, optional :: &
      inverse(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(inout), contiguous, optional :: &
      z(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(out), optional :: largest
    integer :: i, j, k, c
    real(wp) :: most(1)

    most = 0.0_wp
    !$omp parallel do collapse(2) private(i, j) reduction(max: most) schedule(static)
    do c = 1, 3
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            x(i, j, k, c) = x(i, j, k, c) - a*y(i, j, k, c)
          end do
          if (.not. present(inverse)) cycle
          do i = grid%lo(1), grid%hi(1)
            z(i, j, k, c) = x(i, j, k, c)*inverse(i, j, k, c)
            most(1) = max(most(1), abs(z(i, j, k, c)))
          end do
        end do
      end do
    end do
    if (.not. present(largest)) return
    call global_max(most)
    largest = most(1)
  end subroutine improve

  !> s := z + beta s on the own cells.
  subroutine new_direction(grid, beta, z, s)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: beta
    real(wp), intent(in), contiguous :: z(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(inout), contiguous :: s(grid%first(1):, grid%first(2):, grid%first(3):, :)
    integer :: i, j, k, c

    !$omp parallel do collapse(2) private(i, j) schedule(static)
    do c = 1, 3
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            s(i, j, k, c) = z(i, j, k, c) + beta*s(i, j, k, c)
          end do
        end do
      end do
    end do
  end subroutine new_direction

  !> A Jacobi sweep: the velocity gets the change z, and the residual r follows, with its z.
  subroutine sweep(grid, bodies, change, u, self, y_body, largest)
    type(grid_t), intent(in) :: grid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in) :: change(:, :)    !! (6, bodies) of their motion
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    type(viscous_t), intent(inout) :: self
    real(wp), intent(out) :: y_body(:, :)   !! what the residual of the bodies loses
    real(wp), intent(out) :: largest        !! |z| [m/s]
    integer :: j, k, c
    real(wp) :: row(grid%lo(1):grid%hi(1)), most(1)

    call swap(self%z, self%s)
    call halo_exchange(self%s, n_halo, layers=1)
    call add_walls(self%walls, change, 1.0_wp, lbound(self%r), self%r)
    most = 0.0_wp
    associate (a => grid%lo(1), z => grid%hi(1))
      !$omp parallel do collapse(2) private(j, row) reduction(max: most) schedule(static)
      do c = 1, 3
        do k = grid%lo(3), grid%hi(3)
          do j = grid%lo(2), grid%hi(2)
            call apply_row(grid, self%diagonal, self%leg, self%s, j, k, c, row)
            u(a:z, j, k, c) = u(a:z, j, k, c) + self%s(a:z, j, k, c)
            self%r(a:z, j, k, c) = self%r(a:z, j, k, c) - row
            self%z(a:z, j, k, c) = self%r(a:z, j, k, c)*self%inverse(a:z, j, k, c)
            most(1) = max(most(1), maxval(abs(self%z(a:z, j, k, c))))
          end do
        end do
      end do
    end associate
    call global_max(most)
    largest = most(1)
    call apply_to_bodies(bodies, self, change, y_body)
  contains
    !> Exchange two arrays without copying.
    pure subroutine swap(a, b)
      real(wp), allocatable, intent(inout) :: a(:, :, :, :), b(:, :, :, :)
      real(wp), allocatable :: c(:, :, :, :)

      call move_alloc(a, c)
      call move_alloc(b, a)
      call move_alloc(c, b)
    end subroutine swap
  end subroutine sweep

  !> y := the system applied to velocities s and body motions x_body.
  subroutine apply_viscous(grid, bodies, self, x_body, y_body)
    type(grid_t), intent(in) :: grid
    type(rigid_motion_t), intent(in) :: bodies
    type(viscous_t), intent(inout) :: self
    real(wp), intent(in) :: x_body(:, :)
    real(wp), intent(out) :: y_body(:, :)
    integer :: j, k, c

    call halo_exchange(self%s, n_halo, layers=1)
    !$omp parallel do collapse(2) private(j) schedule(static)
    do c = 1, 3
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          call apply_row(grid, self%diagonal, self%leg, self%s, j, k, c, &
                         self%y(grid%lo(1):grid%hi(1), j, k, c))
        end do
      end do
    end do
    call add_walls(self%walls, x_body, -1.0_wp, lbound(self%y), self%y)
    call apply_to_bodies(bodies, self, x_body, y_body)
  end subroutine apply_viscous

  !> One line of the system, the legs to bodies left out, applied to component c of s.
  pure subroutine apply_row(grid, diagonal, leg, s, j, k, c, y)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), dimension(grid%first(1):, grid%first(2):, grid%first(3):, :), &
      contiguous :: diagonal, leg, s
    integer, intent(in) :: j, k, c
    real(wp), intent(inout), contiguous :: y(grid%lo(1):)
    integer :: i

    do i = grid%lo(1), grid%hi(1)
      y(i) = diagonal(i, j, k, c)*s(i, j, k, c) &
        - leg(i, j, k, 1)*s(i - 1, j, k, c) - leg(i + 1, j, k, 1)*s(i + 1, j, k, c) &
        - leg(i, j, k, 2)*s(i, j - 1, k, c) - leg(i, j + 1, k, 2)*s(i, j + 1, k, c) &
        - leg(i, j, k, 3)*s(i, j, k - 1, c) - leg(i, j, k + 1, 3)*s(i, j, k + 1, c)
    end do
  end subroutine apply_row

  !> Add to the cells what the legs to bodies do that move, times a factor.
  pure subroutine add_walls(walls, motion, factor, first, y)
    type(wall_legs_t), intent(in) :: walls
    real(wp), intent(in) :: motion(:, :)   !! (6, bodies)
    real(wp), intent(in) :: factor
    integer, intent(in) :: first(4)
    real(wp), intent(inout), contiguous :: y(first(1):, first(2):, first(3):, :)   !! [kg m/s2]
    integer :: b, m

    do b = 1, size(motion, 2)
      if (all(abs(motion(:, b)) <= 0.0_wp)) cycle
      do m = walls%first(b), walls%first(b + 1) - 1
        associate (n => walls%cell(:, m))
          y(n(1), n(2), n(3), :) = y(n(1), n(2), n(3), :) &
            + factor*walls%k(m)*wall_velocity(motion(:, b), walls%arm(:, m))
        end associate
      end do
    end do
  end subroutine add_walls

  !> The rows of the bodies, applied to velocities s and motions x_body.
  subroutine apply_to_bodies(bodies, self, x_body, y_body)
    type(rigid_motion_t), intent(in) :: bodies
    type(viscous_t), intent(in) :: self
    real(wp), intent(in) :: x_body(:, :)
    real(wp), intent(out) :: y_body(:, :)
    real(wp) :: pull(6, bodies%n)
    integer :: b

    call pull_of_legs(self, self%s, x_body, pull)
    do b = 1, bodies%n
      y_body(:, b) = 0.0_wp
      if (.not. bodies%free(b)) cycle
      y_body(:, b) = inertial_momentum(bodies, b, self%dt, x_body(:, b)) - pull(:, b)
    end do
  end subroutine apply_to_bodies

  !> Viscous force and torque on each body, from its wall legs [N, N m].
  subroutine force_of_legs(bodies, flow, self)
    type(rigid_motion_t), intent(in) :: bodies
    type(flow_t), intent(in) :: flow
    type(viscous_t), intent(inout) :: self

    call pull_of_legs(self, flow%u, bodies%motion, self%force)
  end subroutine force_of_legs

  !> Force and torque on each body of its wall legs, and of the stress that they leave out, for
  !! velocities of the cells and motions of the bodies [N, N m].
  subroutine pull_of_legs(self, u, motion, pull)
    type(viscous_t), intent(in) :: self
    real(wp), intent(in), contiguous :: &
      u(lbound(self%mass, 1):, lbound(self%mass, 2):, lbound(self%mass, 3):, :)   !! [m/s]
    real(wp), intent(in) :: motion(:, :)   !! (6, bodies)
    real(wp), intent(out) :: pull(:, :)    !! (6, bodies)
    integer(i8) :: bins(bin_size, size(pull))
    real(wp) :: total(size(pull)), term(terms_at_once, 6), slip(3)
    integer :: b, m, n, from

    bins = spread(no_terms, 2, size(pull))
    associate (walls => self%walls)
      !$omp parallel private(b, m, n, term, slip) if (walls%n > worth_threads)
      do b = 1, size(pull, 2)
        !$omp do schedule(static)
        do from = walls%first(b), walls%first(b + 1) - 1, terms_at_once
          n = 0
          do m = from, min(from + terms_at_once, walls%first(b + 1)) - 1
            n = n + 1
            associate (c => walls%cell(:, m))
              slip = u(c(1), c(2), c(3), :) - wall_velocity(motion(:, b), walls%arm(:, m))
              term(n, :) = wrench(walls%k(m)*slip, walls%arm(:, m))
            end associate
          end do
          call exact_add_columns(term(:n, :), bins(:, 6*b - 5:6*b))
        end do
        !$omp end do nowait
      end do
      !$omp end parallel
    end associate
    call exact_totals(bins, total)
    pull = reshape(total, shape(pull))
    do b = 1, size(pull, 2)
      pull(4:6, b) = pull(4:6, b) - self%spin_drag(b)*motion(4:6, b)
    end do
  end subroutine pull_of_legs

end module viscous_m
