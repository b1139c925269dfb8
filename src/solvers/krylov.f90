!> Conjugate gradients and BiCGSTAB on an operator and a preconditioner passed in.
!!
!! Both stop when the largest residual of any cell is small enough. All sums over cells are free of
!! their order (`exact_sum_m`), so the iterates have the same bits on any threads and processes.
!! The right side must be zero in cells whose row of the matrix is empty; the solution stays there.
module krylov_m
  use kinds_m, only: wp
  use grid_m, only: grid_t
  use exact_sum_m, only: exact_dot, exact_dots
  use parallel_m, only: global_max
  use solve_control_m, only: solve_control_t, solve_report_t, solved, not_converged, broken_down
  use linear_operator_m, only: linear_operator_t, preconditioner_t
  implicit none
  private
  public :: krylov_work_t, krylov_init, take_all_cells, find_null_space
  public :: conjugate_gradient, bicgstab

  integer, parameter :: worth_threads = 8192   !! fewer cells are the work of one thread

  !> Arrays of the solvers, own cells and one halo cell; allocated once.
  type :: krylov_work_t
    real(wp), allocatable, dimension(:, :, :) :: r, z   !! residual, M r
    real(wp), allocatable, dimension(:, :, :) :: p, q   !! direction, A p or A M p
    real(wp), allocatable, dimension(:, :, :) :: shadow, y, t
      !! BiCGSTAB, which makes them: first r, M p, A M r
    !> First and last cell of each line that take part, (2, j, k), from 1: all if not set otherwise.
    !! What stands in the others is not touched and must be finite.
    integer, allocatable :: line(:, :, :)
    logical :: singular = .false.                !! constants are in the null space of the operator
    real(wp), allocatable :: is_open(:, :, :)
      !! 1 in own cells with an open face, else 0; made as soon as a system is singular
    real(wp) :: n_open = 0.0_wp                  !! cells of all processes with an open face
  end type krylov_work_t

contains

  !> Allocate the arrays of conjugate gradients.
  subroutine krylov_init(grid, work)
    type(grid_t), intent(in) :: grid
    type(krylov_work_t), intent(out) :: work
    integer :: a(3), b(3)

    a = grid%lo - 1
    b = grid%hi + 1
    allocate (work%r(a(1):b(1), a(2):b(2), a(3):b(3)), source=0.0_wp)
    allocate (work%z, source=work%r)
    allocate (work%p, source=work%r)
    allocate (work%q, source=work%r)
    allocate (work%line(2, size(work%r, 2), size(work%r, 3)))
    call take_all_cells(work)
  end subroutine krylov_init

  !> All cells take part.
  subroutine take_all_cells(work)
    type(krylov_work_t), intent(inout) :: work

    work%line(1, :, :) = 2
    work%line(2, :, :) = size(work%r, 1) - 1
  end subroutine take_all_cells

  !> Find out whether constants are in the null space: no side of the domain with p given.
  !!
  !! If so the solvers take the mean off the right side and off the solution, over the cells with an
  !! open face. Call it whenever the coefficients have changed; without it nothing is taken off.
  subroutine find_null_space(grid, cf, work)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: cf(grid%lo(1) - 1:, grid%lo(2) - 1:, grid%lo(3) - 1:, :)
    type(krylov_work_t), intent(inout) :: work
    real(wp) :: side(1)
    integer :: i, j, k, d, s, a(3), b(3)

    side = 0.0_wp
    do d = 1, 3
      do s = 1, 2
        call grid%side_faces(s, d, a, b)
        side = max(side, maxval(cf(a(1):b(1), a(2):b(2), a(3):b(3), d)))
      end do
    end do
    call global_max(side)
    work%singular = side(1) <= 0.0_wp
    if (.not. work%singular) return
    if (.not. allocated(work%is_open)) allocate (work%is_open, mold=work%r)
    work%is_open = 0.0_wp
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          work%is_open(i, j, k) = merge(1.0_wp, 0.0_wp, &
            any(cf(i, j, k, :) > 0.0_wp) .or. cf(i + 1, j, k, 1) > 0.0_wp &
            .or. cf(i, j + 1, k, 2) > 0.0_wp .or. cf(i, j, k + 1, 3) > 0.0_wp)
        end do
      end do
    end do
    work%n_open = exact_dot(work%is_open, work%is_open, 1, work%line)
  end subroutine find_null_space

  !> Solve A x = b with A and M symmetric and positive (constants excepted, see `find_null_space`).
  subroutine conjugate_gradient(op, prec, b, x, control, report, work)
    class(linear_operator_t), intent(inout) :: op
    class(preconditioner_t), intent(inout) :: prec
    real(wp), intent(in), contiguous :: b(:, :, :)      !! right side, one halo cell
    real(wp), intent(inout), contiguous :: x(:, :, :)   !! first guess, then solution
    type(solve_control_t), intent(in) :: control
    type(solve_report_t), intent(out) :: report
    type(krylov_work_t), intent(inout) :: work
    real(wp) :: bound, rz, rz_before, pq

    call first_residual(op, b, x, work, report%residual)
    bound = max(control%tolerance, control%relative*report%residual)
    rz = 1.0_wp
    do while (.not. report%residual <= bound)
      report%info = not_converged
      if (report%iterations == control%max_iterations) exit
      report%info = broken_down
      rz_before = rz
      call prec%apply(work%r, report%residual, work%z)
      rz = exact_dot(work%r, work%z, 1, work%line)
      if (.not. rz > 0.0_wp) exit
      if (report%iterations == 0) then
        call copy(work%line, work%z, work%p)
      else
        call new_direction(work%line, work%z, rz/rz_before, work%p)
      end if
      call op%apply(work%p, work%q)
      pq = exact_dot(work%p, work%q, 1, work%line)
      if (.not. pq > 0.0_wp) exit
      call step(work%line, rz/pq, work%p, work%q, x, work%r, report%residual)
      report%iterations = report%iterations + 1
      report%info = solved
    end do
    if (work%singular) call remove_mean(work, x)
  end subroutine conjugate_gradient

  !> Solve A x = b for any regular A; two products with A and M per iteration.
  !!
  !! Source: van der Vorst, SIAM J. Sci. Stat. Comput. 13 (1992), preconditioned from the right.
  !! When the residual is nearly orthogonal to its shadow, the iteration starts again where it is.
  subroutine bicgstab(op, prec, b, x, control, report, work)
    class(linear_operator_t), intent(inout) :: op
    class(preconditioner_t), intent(inout) :: prec
    real(wp), intent(in), contiguous :: b(:, :, :)      !! right side, one halo cell
    real(wp), intent(inout), contiguous :: x(:, :, :)   !! first guess, then solution
    type(solve_control_t), intent(in) :: control
    type(solve_report_t), intent(out) :: report
    type(krylov_work_t), intent(inout) :: work
    real(wp), parameter :: orthogonal = 1.0e-14_wp      !! cosine of vectors at a right angle
    real(wp) :: bound, alpha, omega, rho, rho_before, shadows, sums(2), p_max
      ! `shadows`: square of the length of the shadow
    logical :: fresh   !! the iteration starts at the residual at hand

    if (.not. allocated(work%shadow)) then
      allocate (work%shadow, work%y, work%t, mold=work%r)
      work%shadow = 0.0_wp
      work%y = 0.0_wp
      work%t = 0.0_wp
    end if
    call first_residual(op, b, x, work, report%residual)
    bound = max(control%tolerance, control%relative*report%residual)
    fresh = .true.
    do while (.not. report%residual <= bound)
      report%info = not_converged
      if (report%iterations == control%max_iterations) exit
      report%info = broken_down
      ! rho = shadow . r, against the norms of both
      sums = exact_dots(work%shadow, work%r, work%r, work%r, 1, work%line)
      if (.not. fresh) fresh = abs(sums(1)) <= orthogonal*sqrt(shadows*sums(2))
      if (fresh) then
        call copy(work%line, work%r, work%shadow)
        call copy(work%line, work%r, work%p)
        rho = sums(2)
        shadows = sums(2)
        p_max = report%residual
      else
        rho = sums(1)
        call next_direction(work%line, rho/rho_before*alpha/omega, omega, work%r, work%q, &
                            work%p, p_max)
      end if
      if (.not. abs(rho) > 0.0_wp) exit
      call prec%apply(work%p, p_max, work%y)
      call op%apply(work%y, work%q)
      sums = exact_dots(work%shadow, work%q, work%q, work%q, 1, work%line)
      if (.not. abs(sums(1)) > orthogonal*sqrt(shadows*sums(2))) then
        if (fresh) exit
        fresh = .true.
        cycle
      end if
      alpha = rho/sums(1)
      call step(work%line, alpha, work%y, work%q, x, work%r, report%residual)
      report%iterations = report%iterations + 1
      report%info = solved
      if (report%residual <= bound) exit
      report%info = broken_down
      call prec%apply(work%r, report%residual, work%z)
      call op%apply(work%z, work%t)
      sums = exact_dots(work%t, work%r, work%t, work%t, 1, work%line)
      if (.not. sums(2) > 0.0_wp) exit
      omega = sums(1)/sums(2)
      call step(work%line, omega, work%z, work%t, x, work%r, report%residual)
      fresh = .not. abs(omega) > 0.0_wp
      rho_before = rho
      report%info = solved
    end do
    if (work%singular) call remove_mean(work, x)
  end subroutine bicgstab

  !> r = b - A x and its largest value; a zero first guess costs no product with A.
  subroutine first_residual(op, b, x, work, r_max)
    class(linear_operator_t), intent(inout) :: op
    real(wp), intent(in), contiguous :: b(:, :, :)
    real(wp), intent(inout), contiguous :: x(:, :, :)
    type(krylov_work_t), intent(inout) :: work
    real(wp), intent(out) :: r_max
    real(wp) :: largest(2)

    largest = [largest_inside(work%line, b), largest_inside(work%line, x)]
    call global_max(largest)
    r_max = largest(1)
    call copy(work%line, b, work%r)
    if (largest(2) > 0.0_wp) then
      call copy(work%line, x, work%p)
      call op%apply(work%p, work%q)
      call subtract(work%line, 1.0_wp, work%q, work%r)
    end if
    if (work%singular) call remove_mean(work, work%r)
    if (.not. (largest(2) > 0.0_wp .or. work%singular)) return
    largest(1) = largest_inside(work%line, work%r)
    call global_max(largest(:1))
    r_max = largest(1)
  end subroutine first_residual

  !> Take the mean over the open cells off these cells.
  subroutine remove_mean(work, a)
    type(krylov_work_t), intent(in) :: work
    real(wp), intent(inout), contiguous :: a(:, :, :)

    if (work%n_open > 0.0_wp) then
      call subtract(work%line, exact_dot(a, work%is_open, 1, work%line)/work%n_open, &
                    work%is_open, a)
    end if
  end subroutine remove_mean

  !> Largest magnitude in the own cells of this process.
  function largest_inside(line, a) result(largest)
    integer, intent(in), contiguous :: line(:, :, :)   !! (2, j, k) first and last cell
    real(wp), intent(in), contiguous :: a(:, :, :)
    real(wp) :: largest
    integer :: j, k

    largest = 0.0_wp
    !$omp parallel do private(j) reduction(max: largest) schedule(static) &
    !$omp if (size(a) > worth_threads)
    do k = 2, size(a, 3) - 1
      do j = 2, size(a, 2) - 1
        largest = max(largest, largest_of(a(line(1, j, k):line(2, j, k), j, k)))
      end do
    end do
  end function largest_inside

  !> Largest magnitude of a line, in several lanes: a single maximum waits for the one before.
  pure function largest_of(a) result(largest)
    real(wp), intent(in), contiguous :: a(:)
    real(wp) :: largest
    integer, parameter :: lanes = 16
    real(wp) :: lane(lanes)
    integer :: i, l, n

    n = size(a)
    lane = 0.0_wp
    do i = 0, n - lanes, lanes
      do l = 1, lanes
        lane(l) = max(lane(l), abs(a(i + l)))
      end do
    end do
    largest = maxval(lane)
    do i = n - modulo(n, lanes) + 1, n
      largest = max(largest, abs(a(i)))
    end do
  end function largest_of

  !> b = a in the own cells.
  subroutine copy(line, a, b)
    integer, intent(in), contiguous :: line(:, :, :)   !! (2, j, k) first and last cell
    real(wp), intent(in), contiguous :: a(:, :, :)
    real(wp), intent(inout), contiguous :: b(:, :, :)
    integer :: i, j, k

    !$omp parallel do private(i, j) schedule(static) &
    !$omp if (size(a) > worth_threads)
    do k = 2, size(a, 3) - 1
      do j = 2, size(a, 2) - 1
        do i = line(1, j, k), line(2, j, k)
          b(i, j, k) = a(i, j, k)
        end do
      end do
    end do
  end subroutine copy

  !> b = b - s a in the own cells.
  subroutine subtract(line, s, a, b)
    integer, intent(in), contiguous :: line(:, :, :)   !! (2, j, k) first and last cell
    real(wp), intent(in) :: s
    real(wp), intent(in), contiguous :: a(:, :, :)
    real(wp), intent(inout), contiguous :: b(:, :, :)
    integer :: i, j, k

    !$omp parallel do private(i, j) schedule(static) &
    !$omp if (size(a) > worth_threads)
    do k = 2, size(a, 3) - 1
      do j = 2, size(a, 2) - 1
        do i = line(1, j, k), line(2, j, k)
          b(i, j, k) = b(i, j, k) - s*a(i, j, k)
        end do
      end do
    end do
  end subroutine subtract

  !> x = x + s p and r = r - s q in the own cells, and the largest |r| of all processes.
  subroutine step(line, s, p, q, x, r, r_max)
    integer, intent(in), contiguous :: line(:, :, :)   !! (2, j, k) first and last cell
    real(wp), intent(in) :: s
    real(wp), intent(in), contiguous :: p(:, :, :), q(:, :, :)
    real(wp), intent(inout), contiguous :: x(:, :, :), r(:, :, :)
    real(wp), intent(out) :: r_max
    real(wp) :: largest, of_all(1)
    integer :: i, j, k

    largest = 0.0_wp
    !$omp parallel do private(i, j) reduction(max: largest) schedule(static) &
    !$omp if (size(x) > worth_threads)
    do k = 2, size(x, 3) - 1
      do j = 2, size(x, 2) - 1
        do i = line(1, j, k), line(2, j, k)
          x(i, j, k) = x(i, j, k) + s*p(i, j, k)
          r(i, j, k) = r(i, j, k) - s*q(i, j, k)
        end do
        largest = max(largest, largest_of(r(line(1, j, k):line(2, j, k), j, k)))
      end do
    end do
    of_all = largest
    call global_max(of_all)
    r_max = of_all(1)
  end subroutine step

  !> p = z + beta p in the own cells.
  subroutine new_direction(line, z, beta, p)
    integer, intent(in), contiguous :: line(:, :, :)   !! (2, j, k) first and last cell
    real(wp), intent(in), contiguous :: z(:, :, :)
    real(wp), intent(in) :: beta
    real(wp), intent(inout), contiguous :: p(:, :, :)
    integer :: i, j, k

    !$omp parallel do private(i, j) schedule(static) &
    !$omp if (size(p) > worth_threads)
    do k = 2, size(p, 3) - 1
      do j = 2, size(p, 2) - 1
        do i = line(1, j, k), line(2, j, k)
          p(i, j, k) = z(i, j, k) + beta*p(i, j, k)
        end do
      end do
    end do
  end subroutine new_direction

  !> p = r + beta (p - omega q) in the own cells, and the largest |p| of all processes.
  subroutine next_direction(line, beta, omega, r, q, p, p_max)
    integer, intent(in), contiguous :: line(:, :, :)   !! (2, j, k) first and last cell
    real(wp), intent(in) :: beta, omega
    real(wp), intent(in), contiguous :: r(:, :, :), q(:, :, :)
    real(wp), intent(inout), contiguous :: p(:, :, :)
    real(wp), intent(out) :: p_max
    real(wp) :: largest, of_all(1)
    integer :: i, j, k

    largest = 0.0_wp
    !$omp parallel do private(i, j) reduction(max: largest) schedule(static) &
    !$omp if (size(p) > worth_threads)
    do k = 2, size(p, 3) - 1
      do j = 2, size(p, 2) - 1
        do i = line(1, j, k), line(2, j, k)
          p(i, j, k) = r(i, j, k) + beta*(p(i, j, k) - omega*q(i, j, k))
        end do
        largest = max(largest, largest_of(p(line(1, j, k):line(2, j, k), j, k)))
      end do
    end do
    of_all = largest
    call global_max(of_all)
    p_max = of_all(1)
  end subroutine next_direction

end module krylov_m
