!> Implicit viscosity with no-slip on the bodies: the velocities of cells and bodies are unknowns of
!! one system.
!!
!! The force on a body is the sum over its wall links (`viscous_links_m`), so the stage conserves
!! momentum. Departure from the paper: its overlay gives a drag that depends on the time step.
!!
!! Solved by overrelaxation of two colours of cells, without scalar products, unless a step is so
!! long that this takes too many sweeps: then by conjugate gradients.
module viscous_m
  use omp_lib, only: omp_get_num_threads, omp_get_thread_num
  use kinds_m, only: wp, i8
  use vectors_m, only: wrench
  use grid_m, only: grid_t, n_halo
  use fields_m, only: flow_t
  use rigid_motion_m, only: rigid_motion_t, wall_velocity, inverse_of
  use viscous_system_m, only: viscous_t, wall_links_t
  use exact_sum_m, only: exact_dot, exact_add_columns, exact_totals, accumulator_size, no_terms, &
    terms_at_once
  use parallel_m, only: halo_exchange, global_max, nproc
  implicit none
  private
  public :: solve_viscous
  public :: apply_viscous, pull_of_links, velocity_scale, inertial_momentum   ! for C-ISMAC

  real(wp), parameter :: tolerance = 1.0e-9_wp      !! of the largest velocity
  real(wp), parameter :: max_sweeps = 100.0_wp     !! of relaxation; CG may be quicker then
  real(wp), parameter :: smallest_rate = 1.0e-3_wp  !! at which a sweep is taken to converge
  integer, parameter :: max_iterations = 500        !! sweeps included
  integer, parameter :: worth_threads = 1000        !! fewer links are looked at by one thread

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
    real(wp) :: momentum(6, bodies%n)     ! of the bodies, over dt, before the stage
    real(wp) :: inverse(6, 6, bodies%n)   ! of the blocks of the bodies
    real(wp) :: bound   ! of the largest change that is left [m/s]
    integer :: b, m

    call velocity_scale(grid, flow%u, bodies, bound)
    bound = tolerance*bound
    call right_side(grid, self%mass, flow%u, self%r)
    ! What the moving sides pull goes to the right side.
    do m = 1, self%sides%n
      associate (c => self%sides%cell(:, m))
        self%r(c(1), c(2), c(3), :) = self%r(c(1), c(2), c(3), :) + self%sides%pull(:, m)
      end associate
    end do
    do b = 1, bodies%n
      momentum(:, b) = inertial_momentum(bodies, b, self%dt, bodies%motion(:, b))
      inverse(:, :, b) = 0.0_wp
      if (bodies%free(b)) inverse(:, :, b) = inverse_of(bodies%apparent(:, :, b)/self%dt &
                                                        + self%body_matrix(:, :, b))
    end do
    call relaxation(grid, momentum, inverse, bound, bodies, flow%u, self)
    if (.not. self%converged) call conjugate_gradients(grid, momentum, inverse, bound, bodies, &
                                                       flow%u, self)
    call pull_of_links(self, flow%u, bodies%motion, self%force)
  end subroutine solve_viscous

  !> Successive overrelaxation: cells whose numbers have an even sum, those of an odd one, bodies.
  !! The weight goes from one to the best one as those of Chebyshev do. What would take too many
  !! sweeps is left to conjugate gradients.
  !!
  !! Source: Young (1971), Iterative solution of large linear systems, chapters 6 and 10. The bodies
  !! are a third colour, which the best weight leaves out of account; any weight below 2 converges.
  subroutine relaxation(grid, momentum, inverse, bound, bodies, u, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: momentum(:, :)     !! (6, bodies) over dt, before the stage
    real(wp), intent(in) :: inverse(:, :, :)   !! (6, 6, bodies) of their blocks
    real(wp), intent(in) :: bound              !! of the largest change by a weight of one [m/s]
    type(rigid_motion_t), intent(inout) :: bodies
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    type(viscous_t), intent(inout) :: self
    real(wp) :: change(6, bodies%n)
    real(wp) :: weight(2), worst(1)   !! of the change in either colour, and the largest one
    integer :: most

    self%iterations = 0
    self%converged = .false.
    most = sweeps_allowed(grid, self%spread)
    if (most == 0) return
    call add_walls(self%walls, bodies%motion, 1.0_wp, lbound(self%r), self%r)
    weight = [1.0_wp, 1.0_wp/(1.0_wp - 0.5_wp*self%spread**2)]
    do while (self%iterations < most .and. .not. self%converged)
      call relax(grid, weight, u, self, worst(1))
      change = of_blocks(inverse, momentum - rows_of_bodies(bodies, self, u, bodies%motion))
      call global_max(worst)
      worst = max(worst, maxval([0.0_wp, abs(change(1:3, :))]))
      weight(1) = 1.0_wp/(1.0_wp - 0.25_wp*weight(2)*self%spread**2)
      change = weight(1)*change
      bodies%motion = bodies%motion + change
      call add_walls(self%walls, change, 1.0_wp, lbound(self%r), self%r)
      weight(2) = 1.0_wp/(1.0_wp - 0.25_wp*weight(1)*self%spread**2)
      self%iterations = self%iterations + 1
      self%converged = worst(1) <= bound
    end do
    if (.not. self%converged) call add_walls(self%walls, bodies%motion, -1.0_wp, lbound(self%r), &
                                             self%r)
  end subroutine relaxation

  !> Twice the sweeps that should reach the tolerance; none if they are too many, or if the weight
  !! would be too large for the first and the last cell of a period of an odd number of cells. These
  !! are of one colour: a weight w converges as long as 2/w - 1 exceeds the share that their link
  !! has in the diagonal, at most the spread s, and w is in the end 2/(1 + sqrt(1 - s^2)).
  pure integer function sweeps_allowed(grid, s)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: s   !! largest share of the links to other cells in the diagonal
    real(wp) :: rate

    sweeps_allowed = 0
    if (s >= 1.0_wp) return
    if (any(grid%periodic .and. grid%n > 1 .and. modulo(grid%n, 2) == 1) .and. s**2 > 0.5_wp) return
    rate = max((s/(1.0_wp + sqrt(1.0_wp - s**2)))**2, smallest_rate)
    if (log(tolerance)/log(rate) > max_sweeps) return
    sweeps_allowed = 2*ceiling(log(tolerance)/log(rate)) + 3
  end function sweeps_allowed

  !> Relax the cells of one colour, then those of the other, each by its weight.
  !!
  !! Where nothing has to be exchanged between the colours the second follows the first one plane
  !! behind, so that a plane comes from memory once for both. Each thread then has some planes next
  !! to each other, of which the first colour of the outer two comes first.
  subroutine relax(grid, weight, u, self, worst)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: weight(2)
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    type(viscous_t), intent(in) :: self
    real(wp), intent(out) :: worst   !! largest change by a weight of one here [m/s]
    integer :: colour, k, low, high, planes, me, n
    logical :: alone   ! with nothing to exchange

    worst = 0.0_wp
    alone = nproc() == 1 .and. .not. any(grid%periodic)
    do colour = 1, 2   ! asked for alone, too: a run in one process foretells the messages of many
      call halo_exchange(u, n_halo, layers=1)
      if (.not. alone) then
        !$omp parallel do reduction(max: worst) schedule(static)
        do k = grid%lo(3), grid%hi(3)
          call relax_plane(grid, colour, k, weight(colour), u, self, worst)
        end do
      end if
    end do
    if (.not. alone) return
    !$omp parallel private(k, low, high, planes, me, n) reduction(max: worst)
    ! Planes low..high of this thread, none if high < low.
    planes = grid%hi(3) - grid%lo(3) + 1
    me = omp_get_thread_num()
    n = omp_get_num_threads()
    low = grid%lo(3) + planes*me/n
    high = grid%lo(3) + planes*(me + 1)/n - 1
    do k = low, high, max(1, high - low)
      call relax_plane(grid, 1, k, weight(1), u, self, worst)
    end do
    !$omp barrier
    do k = low + 1, high - 1
      call relax_plane(grid, 1, k, weight(1), u, self, worst)
      call relax_plane(grid, 2, k - 1, weight(2), u, self, worst)
    end do
    do k = max(low, high - 1), high
      call relax_plane(grid, 2, k, weight(2), u, self, worst)
    end do
    !$omp end parallel
  end subroutine relax

  !> Relax the cells of one colour in plane k by a weight; colour 1 has even sums of its numbers.
  subroutine relax_plane(grid, colour, k, weight, u, self, worst)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: colour, k
    real(wp), intent(in) :: weight
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    type(viscous_t), intent(in) :: self
    real(wp), intent(inout) :: worst   !! largest change by a weight of one so far [m/s]
    integer :: i, j, c
    real(wp) :: change

    do j = grid%lo(2), grid%hi(2)
      do c = 1, 3
        do i = grid%lo(1) + modulo(grid%lo(1) + j + k + colour - 1, 2), grid%hi(1), 2
          associate (l => self%link)
            change = (self%r(i, j, k, c) &
                      + l(i, j, k, 1)*u(i - 1, j, k, c) + l(i + 1, j, k, 1)*u(i + 1, j, k, c) &
                      + l(i, j, k, 2)*u(i, j - 1, k, c) + l(i, j + 1, k, 2)*u(i, j + 1, k, c) &
                      + l(i, j, k, 3)*u(i, j, k - 1, c) + l(i, j, k + 1, 3)*u(i, j, k + 1, c)) &
                     /self%diagonal(i, j, k, c) - u(i, j, k, c)
          end associate
          u(i, j, k, c) = u(i, j, k, c) + weight*change
          worst = max(worst, abs(change))
        end do
      end do
    end do
  end subroutine relax_plane

  !> Conjugate gradients on the system over its diagonal, from where it is.
  subroutine conjugate_gradients(grid, momentum, inverse, bound, bodies, u, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: momentum(:, :)     !! (6, bodies) over dt, before the stage
    real(wp), intent(in) :: inverse(:, :, :)   !! (6, 6, bodies) of their blocks
    real(wp), intent(in) :: bound              !! of the largest change by a Jacobi step [m/s]
    type(rigid_motion_t), intent(inout) :: bodies
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    type(viscous_t), intent(inout) :: self
    real(wp), dimension(6, bodies%n) :: r_body, s_body, z_body, y_body
    real(wp), allocatable :: z(:, :, :, :)   ! residual over the diagonal
    real(wp) :: rz, rz_before, alpha, beta, worst

    allocate (z, source=self%y)
    call new_direction(grid, 0.0_wp, u, self%s)
    call apply_viscous(grid, bodies, self, bodies%motion, y_body)
    r_body = momentum - y_body
    call improve(grid, 1.0_wp, self%y, self%r, self%diagonal, z, worst)
    s_body = 0.0_wp
    rz = 0.0_wp
    do
      z_body = of_blocks(inverse, r_body)
      self%converged = max(worst, maxval([0.0_wp, abs(z_body(1:3, :))])) <= bound
      if (self%converged .or. self%iterations >= max_iterations) exit
      rz_before = rz
      rz = dot(self%r, z) + sum(r_body*z_body)
      beta = 0.0_wp
      if (rz_before > 0.0_wp) beta = rz/rz_before
      call new_direction(grid, beta, z, self%s)
      s_body = z_body + beta*s_body
      call apply_viscous(grid, bodies, self, s_body, y_body)
      alpha = rz/(dot(self%s, self%y) + sum(s_body*y_body))
      call improve(grid, -alpha, self%s, u)
      call improve(grid, alpha, self%y, self%r, self%diagonal, z, worst)
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

  !> Momentum over dt of the velocity at hand, which is none where it is the wall's
  !! (`impose_rigid_velocity` sets it).
  subroutine right_side(grid, mass, u, r)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: mass(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(inout), dimension(grid%first(1):, grid%first(2):, grid%first(3):, :), &
      contiguous :: u, r
    integer :: i, j, k, c

    !$omp parallel do collapse(2) private(i, j) schedule(static)
    do c = 1, 3
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            u(i, j, k, c) = merge(u(i, j, k, c), 0.0_wp, mass(i, j, k) > 0.0_wp)
            r(i, j, k, c) = mass(i, j, k)*u(i, j, k, c)
          end do
        end do
      end do
    end do
  end subroutine right_side

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
    scale = max(m(1), tiny(scale), maxval([0.0_wp, abs(bodies%motion(1:3, :))]), &
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

  !> x := x - a y on the own cells; with `diagonal` also z := x/diagonal and the largest |z|.
  subroutine improve(grid, a, y, x, diagonal, z, largest)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: a
    real(wp), intent(in), contiguous :: y(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(inout), contiguous :: x(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(in), contiguous, optional :: &
      diagonal(grid%first(1):, grid%first(2):, grid%first(3):, :)
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
          if (.not. present(diagonal)) cycle
          do i = grid%lo(1), grid%hi(1)
            z(i, j, k, c) = x(i, j, k, c)/diagonal(i, j, k, c)
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

  !> y := the system applied to velocities s and body motions x_body.
  subroutine apply_viscous(grid, bodies, self, x_body, y_body)
    type(grid_t), intent(in) :: grid
    type(rigid_motion_t), intent(in) :: bodies
    type(viscous_t), intent(inout) :: self
    real(wp), intent(in) :: x_body(:, :)
    real(wp), intent(out) :: y_body(:, :)

    integer :: i, j, k, c

    call halo_exchange(self%s, n_halo, layers=1)
    associate (l => self%link, s => self%s)
      !$omp parallel do collapse(2) private(i, j) schedule(static)
      do c = 1, 3
        do k = grid%lo(3), grid%hi(3)
          do j = grid%lo(2), grid%hi(2)
            do i = grid%lo(1), grid%hi(1)
              self%y(i, j, k, c) = self%diagonal(i, j, k, c)*s(i, j, k, c) &
                - l(i, j, k, 1)*s(i - 1, j, k, c) - l(i + 1, j, k, 1)*s(i + 1, j, k, c) &
                - l(i, j, k, 2)*s(i, j - 1, k, c) - l(i, j + 1, k, 2)*s(i, j + 1, k, c) &
                - l(i, j, k, 3)*s(i, j, k - 1, c) - l(i, j, k + 1, 3)*s(i, j, k + 1, c)
            end do
          end do
        end do
      end do
    end associate
    call add_walls(self%walls, x_body, -1.0_wp, lbound(self%y), self%y)
    y_body = rows_of_bodies(bodies, self, self%s, x_body)
  end subroutine apply_viscous

  !> Add to the cells what the links to bodies do that move, times a factor.
  pure subroutine add_walls(walls, motion, factor, first, y)
    type(wall_links_t), intent(in) :: walls
    real(wp), intent(in) :: motion(:, :)   !! (6, bodies)
    real(wp), intent(in) :: factor
    integer, intent(in) :: first(4)
    real(wp), intent(inout), contiguous :: y(first(1):, first(2):, first(3):, :)   !! [kg m/s2]
    real(wp) :: wall(3)
    integer :: b, m

    do b = 1, size(motion, 2)
      if (all(abs(motion(:, b)) <= 0.0_wp)) cycle
      do m = walls%first(b), walls%first(b + 1) - 1
        associate (n => walls%cell(:, m))
          wall = wall_velocity(motion(:, b), walls%arm(:, m))
          y(n(1), n(2), n(3), :) = y(n(1), n(2), n(3), :) + factor*walls%k(m)*wall
        end associate
      end do
    end do
  end subroutine add_walls

  !> The rows of the bodies, applied to velocities of the cells and motions of the bodies.
  function rows_of_bodies(bodies, self, u, motion) result(y)
    type(rigid_motion_t), intent(in) :: bodies
    type(viscous_t), intent(in) :: self
    real(wp), intent(in), contiguous :: &
      u(lbound(self%mass, 1):, lbound(self%mass, 2):, lbound(self%mass, 3):, :)   !! [m/s]
    real(wp), intent(in) :: motion(:, :)   !! (6, bodies)
    real(wp) :: y(6, bodies%n)
    real(wp) :: pull(6, bodies%n)
    integer :: b

    y = 0.0_wp
    if (.not. any(bodies%free)) return
    call pull_of_links(self, u, motion, pull)
    do b = 1, bodies%n
      if (.not. bodies%free(b)) cycle
      y(:, b) = inertial_momentum(bodies, b, self%dt, motion(:, b)) - pull(:, b)
    end do
  end function rows_of_bodies

  !> Force and torque on each body of its wall links, and of the stress that they leave out, for
  !! velocities of the cells and motions of the bodies [N, N m].
  subroutine pull_of_links(self, u, motion, pull)
    type(viscous_t), intent(in) :: self
    real(wp), intent(in), contiguous :: &
      u(lbound(self%mass, 1):, lbound(self%mass, 2):, lbound(self%mass, 3):, :)   !! [m/s]
    real(wp), intent(in) :: motion(:, :)   !! (6, bodies)
    real(wp), intent(out) :: pull(:, :)    !! (6, bodies)
    integer(i8) :: accumulator(accumulator_size, size(pull))
    real(wp) :: total(size(pull)), term(terms_at_once, 6), slip(3)
    integer :: b, m, n, from

    accumulator = spread(no_terms, 2, size(pull))
    associate (walls => self%walls)
      !$omp parallel private(b, m, n, term, slip) if (walls%n > worth_threads)
      do b = 1, size(pull, 2)
        !$omp do schedule(dynamic)
        do from = walls%first(b), walls%first(b + 1) - 1, terms_at_once
          n = 0
          do m = from, min(from + terms_at_once, walls%first(b + 1)) - 1
            n = n + 1
            associate (c => walls%cell(:, m))
              slip = u(c(1), c(2), c(3), :) - wall_velocity(motion(:, b), walls%arm(:, m))
              term(n, :) = wrench(walls%k(m)*slip, walls%arm(:, m))
            end associate
          end do
          call exact_add_columns(term(:n, :), accumulator(:, 6*b - 5:6*b))
        end do
        !$omp end do nowait
      end do
      !$omp end parallel
    end associate
    call exact_totals(accumulator, total)
    pull = reshape(total, shape(pull))
    do b = 1, size(pull, 2)
      pull(4:6, b) = pull(4:6, b) - self%spin_drag(b)*motion(4:6, b)
    end do
  end subroutine pull_of_links

end module viscous_m
