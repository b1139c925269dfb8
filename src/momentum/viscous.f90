!> Implicit viscosity with no-slip on the bodies: the velocities of cells and bodies are unknowns of
!! one system.
!!
!! The force on a body is the sum over its wall legs (`viscous_legs_m`), so the stage conserves
!! momentum. Departure from the paper: its overlay gives a drag that depends on the time step.
!!
!! Solved by Chebyshev iteration, where a sweep is one pass over the grid without a scalar product,
!! unless a step is so long that this takes too many: then by conjugate gradients.
module viscous_m
  use kinds_m, only: wp, i8
  use swap_m, only: swap
  use grid_m, only: grid_t, n_halo
  use fields_m, only: flow_t
  use rigid_motion_m, only: rigid_motion_t, wall_velocity, inverse_of
  use viscous_system_m, only: viscous_t, wall_legs_t, wrench
  use exact_sum_m, only: exact_dot, exact_add_columns, exact_totals, bin_size, no_terms, &
    terms_at_once
  use parallel_m, only: halo_exchange, global_max
  implicit none
  private
  public :: solve_viscous
  public :: apply_viscous, force_of_legs, velocity_scale, inertial_momentum   ! for C-ISMAC

  real(wp), parameter :: tolerance = 1.0e-9_wp      !! of the largest velocity
  real(wp), parameter :: most_sweeps = 100.0_wp     !! of Chebyshev; CG may be quicker then
  real(wp), parameter :: smallest_spread = 1.0e-6_wp
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
    real(wp), dimension(6, bodies%n) :: r_body, y_body
    real(wp) :: inverse(6, 6, bodies%n)   ! of the blocks of the bodies
    real(wp) :: bound, worst   ! largest change by a Jacobi step that is allowed, and is left [m/s]
    integer :: b

    call velocity_scale(grid, flow%u, bodies, bound)
    bound = tolerance*bound
    call first_guess(grid, self%mass, flow%u, self%s, self%r)
    call apply_viscous(grid, bodies, self, bodies%motion, y_body)
    call add_side_pull(self)
    call improve(grid, 1.0_wp, self%y, self%r, self%inverse, self%z, worst)
    do b = 1, bodies%n
      r_body(:, b) = inertial_momentum(bodies, b, self%dt, bodies%motion(:, b)) - y_body(:, b)
      inverse(:, :, b) = 0.0_wp
      if (bodies%free(b)) inverse(:, :, b) = inverse_of(bodies%apparent(:, :, b)/self%dt &
                                                        + self%body_matrix(:, :, b))
    end do
    self%iterations = 0
    call chebyshev(grid, inverse, bound, worst, r_body, bodies, flow%u, self)
    if (.not. self%converged) call conjugate_gradients(grid, inverse, bound, r_body, bodies, &
                                                       flow%u, self)
    call force_of_legs(bodies, flow, self)
  end subroutine solve_viscous

  !> Chebyshev iteration on the system over its diagonal, whose eigenvalues lie between 1 - s and
  !! 1 + s with s the largest sum of the legs to other cells over the diagonal. It is left to
  !! conjugate gradients what that makes too slow.
  !!
  !! Source: Saad (2003), Iterative methods for sparse linear systems, algorithm 12.1. The lower
  !! bound takes bodies for held; if they are not, it converges too, perhaps more slowly.
  subroutine chebyshev(grid, inverse, bound, worst, r_body, bodies, u, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: inverse(:, :, :)   !! (6, 6, bodies) of their blocks
    real(wp), intent(in) :: bound              !! of the largest change by a Jacobi step [m/s]
    real(wp), intent(inout) :: worst           !! that change; it stands in `self%z` [m/s]
    real(wp), intent(inout) :: r_body(:, :)    !! (6, bodies) residual
    type(rigid_motion_t), intent(inout) :: bodies
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    type(viscous_t), intent(inout) :: self
    real(wp), dimension(6, bodies%n) :: change, z_body, y_body
    real(wp) :: s, rate, weight, next, before, fresh
    integer :: sweeps

    s = max(self%spread, smallest_spread)
    rate = s/(1.0_wp + sqrt(1.0_wp - min(s, 1.0_wp)**2))
    weight = s
    before = 0.0_wp
    fresh = 1.0_wp
    sweeps = 0
    change = 0.0_wp
    do
      z_body = of_blocks(inverse, r_body)
      worst = max(worst, maxval([0.0_wp, abs(z_body(1:3, :))]))
      self%converged = worst <= bound
      if (self%converged) exit
      if (self%iterations == 0) sweeps = sweeps_to(bound/worst)
      if (self%iterations >= sweeps) exit
      change = before*change + fresh*z_body
      next = 1.0_wp/(2.0_wp/s - weight)
      before = next*weight
      fresh = 2.0_wp*next/s
      weight = next
      call sweep(grid, change, before, fresh, u, self, worst)
      call apply_to_bodies(bodies, self, change, y_body)
      bodies%motion = bodies%motion + change
      r_body = r_body - y_body
      self%iterations = self%iterations + 1
    end do
  contains
    !> Sweeps that should reach a share of the error, and some more; none if they are too many.
    pure integer function sweeps_to(share)
      real(wp), intent(in) :: share
      real(wp) :: n

      n = most_sweeps + 1.0_wp
      if (rate < 1.0_wp) n = min(n, log(0.5_wp*share)/log(rate))
      sweeps_to = merge(0, ceiling(1.25_wp*n) + 3, n > most_sweeps)
    end function sweeps_to
  end subroutine chebyshev

  !> Conjugate gradients on the system over its diagonal, from where it is.
  subroutine conjugate_gradients(grid, inverse, bound, r_body, bodies, u, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: inverse(:, :, :)   !! (6, 6, bodies) of their blocks
    real(wp), intent(in) :: bound              !! of the largest change by a Jacobi step [m/s]
    real(wp), intent(inout) :: r_body(:, :)    !! (6, bodies) residual
    type(rigid_motion_t), intent(inout) :: bodies
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    type(viscous_t), intent(inout) :: self
    real(wp), dimension(6, bodies%n) :: s_body, z_body, y_body
    real(wp) :: rz, rz_before, alpha, beta, worst

    call improve(grid, 0.0_wp, self%y, self%r, self%inverse, self%z, worst)
    s_body = 0.0_wp
    rz = 0.0_wp
    do
      z_body = of_blocks(inverse, r_body)
      self%converged = max(worst, maxval([0.0_wp, abs(z_body(1:3, :))])) <= bound
      if (self%converged .or. self%iterations >= max_iterations) exit
      rz_before = rz
      rz = dot(self%r, self%z) + sum(r_body*z_body)
      beta = 0.0_wp
      if (rz_before > 0.0_wp) beta = rz/rz_before
      call new_direction(grid, beta, self%z, self%s)
      s_body = z_body + beta*s_body
      call apply_viscous(grid, bodies, self, s_body, y_body)
      alpha = rz/(dot(self%s, self%y) + sum(s_body*y_body))
      call improve(grid, -alpha, self%s, u)
      call improve(grid, alpha, self%y, self%r, self%inverse, self%z, worst)
      bodies%motion = bodies%motion + alpha*s_body
      r_body = r_body - alpha*y_body
      self%iterations = self%iterations + 1
    end do
  contains
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
  end subroutine conjugate_gradients

  !> Residual of the bodies over their blocks; none of held ones.
  pure function of_blocks(inverse, r_body) result(z_body)
    real(wp), intent(in) :: inverse(:, :, :), r_body(:, :)
    real(wp) :: z_body(size(r_body, 1), size(r_body, 2))
    integer :: b

    do b = 1, size(r_body, 2)
      z_body(:, b) = matmul(inverse(:, :, b), r_body(:, b))
    end do
  end function of_blocks

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

  !> The velocity gets the change z, and the residual r follows; the next change z is the one just
  !! made and that of a Jacobi step, each with its factor.
  subroutine sweep(grid, of_bodies, before, fresh, u, self, largest)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: of_bodies(:, :)   !! (6, bodies) change of their motion
    real(wp), intent(in) :: before, fresh     !! factors of the next change
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    type(viscous_t), intent(inout) :: self    !! the change just made stands in s on return
    real(wp), intent(out) :: largest          !! that a Jacobi step would change [m/s]
    integer :: i, j, k, c
    real(wp) :: row(grid%lo(1):grid%hi(1)), step, most, of_all(1)

    call swap(self%z, self%s)
    call halo_exchange(self%s, n_halo, layers=1)
    call add_walls(self%walls, of_bodies, 1.0_wp, lbound(self%r), self%r)
    most = 0.0_wp
    !$omp parallel do private(i, j, c, row, step) reduction(max: most) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do c = 1, 3
        do j = grid%lo(2), grid%hi(2)
          call apply_row(grid, self%diagonal, self%leg, self%s, j, k, c, row)
          !$omp simd private(step) reduction(max: most)
          do i = grid%lo(1), grid%hi(1)
            u(i, j, k, c) = u(i, j, k, c) + self%s(i, j, k, c)
            self%r(i, j, k, c) = self%r(i, j, k, c) - row(i)
            step = self%r(i, j, k, c)*self%inverse(i, j, k, c)
            self%z(i, j, k, c) = before*self%s(i, j, k, c) + fresh*step
            most = max(most, abs(step))
          end do
        end do
      end do
    end do
    of_all = most
    call global_max(of_all)
    largest = of_all(1)
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
