!> Conjugate gradients and BiCGSTAB against elimination, with all preconditioners, and how they end.
! ranks: 2
module test_krylov_m
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan, ieee_invalid, &
    ieee_set_halting_mode, ieee_set_flag
  use kinds_m, only: wp
  use grid_m, only: grid_t
  use krylov_m, only: krylov_work_t, krylov_init, find_null_space, conjugate_gradient, bicgstab
  use linear_operator_m, only: preconditioner_t, jacobi_t, identity_t
  use solve_control_m, only: solve_control_t, solve_report_t, solved, not_converged, broken_down
  use multigrid_m, only: multigrid_t
  use exact_sum_m, only: exact_dot
  use parallel_m, only: gather_all
  use linear_systems_m, only: face_operator_t, make_grid, set_random, set_right_side
  use check_m, only: check
  implicit none
  private
  public :: test_krylov

  logical, parameter :: walls(3) = .false., periodic(3) = .true.
  real(wp), parameter :: unit_box(3) = 1.0_wp

  !> A system on the grid with its preconditioner and the arrays of the solvers.
  type :: system_t
    type(grid_t) :: grid
    type(face_operator_t) :: op
    type(multigrid_t) :: multigrid
    type(krylov_work_t) :: work
    real(wp), allocatable :: b(:, :, :), x(:, :, :)
    type(solve_report_t) :: report
  end type system_t

  !> The same system for all cells as one matrix, and its solution.
  type :: dense_t
    real(wp), allocatable :: a(:, :)
    real(wp), allocatable :: cf(:, :, :, :), x(:, :, :)
  end type dense_t

contains

  subroutine test_krylov()
    call test_methods([5, 4, 8], unit_box, 'open', walls)
    call test_methods([7, 1, 9], [0.7_wp, 0.3_wp, 0.9_wp], 'open', walls)
    call test_methods([6, 3, 11], [6.0_wp, 0.4_wp, 2.2_wp], 'slip', walls)
    call test_methods([5, 4, 9], unit_box, 'slip', periodic)
    call test_methods([8, 1, 8], unit_box, 'open', [.true., .true., .false.])
    call test_ends()
    call test_mean()
    call test_failures()
  end subroutine test_krylov

  !> A random system with closed faces and cells.
  subroutine make_system(n, length, top, wraps, seed, system)
    integer, intent(in) :: n(3), seed
    real(wp), intent(in) :: length(3)
    character(*), intent(in) :: top
    logical, intent(in) :: wraps(3)
    type(system_t), intent(out) :: system

    call make_grid(n, length, top, wraps, system%grid)
    call set_random(system%grid, seed, system%op)
    call set_right_side(system%grid, system%op, system%b)
    allocate (system%x, source=0*system%b)
    call system%multigrid%init(system%grid)
    call system%multigrid%setup(system%op%cf)
    call krylov_init(system%grid, system%work)
  end subroutine make_system

  !> Solve by method 1, conjugate gradients, or 2, BiCGSTAB.
  subroutine solve(method, prec, tol, relative, max_it, system)
    integer, intent(in) :: method, max_it
    class(preconditioner_t), intent(inout) :: prec
    real(wp), intent(in) :: tol, relative
    type(system_t), intent(inout) :: system
    type(solve_control_t) :: control

    control = solve_control_t(tol, relative, max_it)
    if (method == 1) then
      call conjugate_gradient(system%op, prec, system%b, system%x, control, system%report, &
        system%work)
    else
      call bicgstab(system%op, prec, system%b, system%x, control, system%report, system%work)
    end if
  end subroutine solve

  !> Both methods and all preconditioners on a few random systems.
  subroutine test_methods(n, length, top, wraps)
    integer, intent(in) :: n(3)
    real(wp), intent(in) :: length(3)
    character(*), intent(in) :: top
    logical, intent(in) :: wraps(3)
    type(system_t) :: system
    type(multigrid_t) :: multigrid
    type(jacobi_t) :: jacobi
    type(identity_t) :: identity
    type(dense_t) :: dense
    integer :: seed

    do seed = 1, 3
      call make_system(n, length, top, wraps, seed, system)
      call solve_dense(system%grid, seed, dense)
      multigrid = system%multigrid
      call jacobi%setup(system%grid, system%op%cf)
      call both_methods(multigrid, 'multigrid', dense, system)
      call both_methods(jacobi, 'Jacobi', dense, system)
      call both_methods(identity, 'no preconditioner', dense, system)
    end do
  end subroutine test_methods

  subroutine both_methods(prec, name, dense, system)
    class(preconditioner_t), intent(inout) :: prec
    character(*), intent(in) :: name
    type(dense_t), intent(in) :: dense
    type(system_t), intent(inout) :: system
    integer :: method
    character(*), parameter :: method_name(2) = [character(22) :: 'conjugate gradients', 'BiCGSTAB']

    do method = 1, 2
      system%x = 0.0_wp
      call solve(method, prec, 0.0_wp, 1.0e-11_wp, 5000, system)
      call check('end of '//trim(method_name(method))//', '//name, system%report%info, solved)
      call check(trim(method_name(method))//', '//name, &
        energy_error(system%grid, dense, system%x), 0.0_wp, 1.0e-8_wp)
    end do
  end subroutine both_methods

  !> Solve the system of all cells by elimination, on every process.
  subroutine solve_dense(grid, seed, dense)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: seed
    type(dense_t), intent(out) :: dense
    type(grid_t) :: whole
    type(face_operator_t) :: op
    real(wp), allocatable :: b(:, :, :), diagonal(:), x(:)
    integer :: m, q

    whole = grid
    call whole%own([1, 1, 1], grid%n)
    whole%at_side = .true.
    call set_random(whole, seed, op)
    call set_right_side(whole, op, b)
    call assemble(whole, op%cf, dense%a)
    m = size(dense%a, 1)
    allocate (x(m), diagonal(m))
    x = reshape(b(1:grid%n(1), 1:grid%n(2), 1:grid%n(3)), [m])
    diagonal = [(dense%a(q, q), q=1, m)]
    do q = 1, m   ! a vanishing pivot is a closed cell or a constant that nothing fixes: take zero
      if (dense%a(q, q) <= 1.0e-11_wp*diagonal(q)) then
        dense%a(q, :) = 0.0_wp
        dense%a(:, q) = 0.0_wp
        dense%a(q, q) = 1.0_wp
        x(q) = 0.0_wp
      end if
      call eliminate(q, dense%a, x)
    end do
    do q = m, 1, -1
      x(q) = (x(q) - dot_product(dense%a(q, q + 1:), x(q + 1:)))/dense%a(q, q)
    end do
    allocate (dense%x(0:grid%n(1) + 1, 0:grid%n(2) + 1, 0:grid%n(3) + 1), source=0.0_wp)
    dense%x(1:grid%n(1), 1:grid%n(2), 1:grid%n(3)) = reshape(x, grid%n)
    call move_alloc(op%cf, dense%cf)
  end subroutine solve_dense

  !> Take row q off the rows below.
  pure subroutine eliminate(q, a, x)
    integer, intent(in) :: q
    real(wp), intent(inout) :: a(:, :), x(:)
    integer :: p

    x(q + 1:) = x(q + 1:) - a(q + 1:, q)/a(q, q)*x(q)
    do p = q + 1, size(a, 2)
      if (abs(a(q, p)) > 0.0_wp) a(q + 1:, p) = a(q + 1:, p) - a(q + 1:, q)/a(q, q)*a(q, p)
    end do
  end subroutine eliminate

  !> Matrix of all cells from the coefficients of the faces between them.
  subroutine assemble(grid, cf, a)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: cf(0:, 0:, 0:, :)
    real(wp), allocatable, intent(out) :: a(:, :)
    integer :: i, j, k, d, p, q, c(3)

    allocate (a(product(grid%n), product(grid%n)), source=0.0_wp)
    do d = 1, 3
      do k = 1, grid%n(3) + merge(1, 0, d == 3)
        do j = 1, grid%n(2) + merge(1, 0, d == 2)
          do i = 1, grid%n(1) + merge(1, 0, d == 1)
            c = [i, j, k]
            if (grid%periodic(d) .and. c(d) > grid%n(d)) cycle
            p = row_of(grid, c)
            c(d) = c(d) - 1
            if (grid%periodic(d)) c(d) = modulo(c(d) - 1, grid%n(d)) + 1
            q = row_of(grid, c)
            if (p == q) cycle
            if (p > 0) a(p, p) = a(p, p) + cf(i, j, k, d)
            if (q > 0) a(q, q) = a(q, q) + cf(i, j, k, d)
            if (p == 0 .or. q == 0) cycle
            a(p, q) = a(p, q) - cf(i, j, k, d)
            a(q, p) = a(q, p) - cf(i, j, k, d)
          end do
        end do
      end do
    end do
  end subroutine assemble

  !> Row of a cell in the matrix, zero outside the domain.
  pure integer function row_of(grid, c)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: c(3)

    row_of = 0
    if (all(c >= 1 .and. c <= grid%n)) row_of = c(1) + grid%n(1)*(c(2) - 1 + grid%n(2)*(c(3) - 1))
  end function row_of

  !> Relative error in the norm of the matrix, which does not see constants that nothing fixes.
  function energy_error(grid, dense, x) result(error)
    type(grid_t), intent(in) :: grid
    type(dense_t), intent(in) :: dense
    real(wp), intent(in), contiguous :: x(grid%lo(1) - 1:, grid%lo(2) - 1:, grid%lo(3) - 1:)
    real(wp) :: error
    real(wp) :: e(0:grid%n(1) + 1, 0:grid%n(2) + 1, 0:grid%n(3) + 1)
    real(wp) :: whole(grid%n(1), grid%n(2), grid%n(3))

    call gather_all(x(grid%lo(1):grid%hi(1), grid%lo(2):grid%hi(2), grid%lo(3):grid%hi(3)), &
      grid%lo, grid%hi, whole)
    e = -dense%x
    e(1:grid%n(1), 1:grid%n(2), 1:grid%n(3)) = e(1:grid%n(1), 1:grid%n(2), 1:grid%n(3)) + whole
    error = sqrt(energy(grid, dense%cf, e)/energy(grid, dense%cf, dense%x))
  end function energy_error

  !> Sum over all faces of the coefficient times the square of the step across it.
  pure function energy(grid, cf, e) result(total)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: cf(0:, 0:, 0:, :), e(0:, 0:, 0:)
    real(wp) :: total
    integer :: i, j, k, d, c(3)

    total = 0.0_wp
    do d = 1, 3
      do k = 1, grid%n(3) + merge(1, 0, d == 3)
        do j = 1, grid%n(2) + merge(1, 0, d == 2)
          do i = 1, grid%n(1) + merge(1, 0, d == 1)
            c = [i, j, k]
            if (grid%periodic(d) .and. c(d) > grid%n(d)) cycle
            c(d) = c(d) - 1
            if (grid%periodic(d)) c(d) = modulo(c(d) - 1, grid%n(d)) + 1
            total = total + cf(i, j, k, d)*(e(i, j, k) - e(c(1), c(2), c(3)))**2
          end do
        end do
      end do
    end do
  end function energy

  !> First guess, limits on iterations and residual, zero right side.
  subroutine test_ends()
    type(system_t) :: system
    type(multigrid_t) :: multigrid
    real(wp), allocatable :: y(:, :, :)
    real(wp) :: small
    integer :: method

    do method = 1, 2
      call make_system([12, 6, 10], unit_box, 'open', walls, 5, system)
      if (method == 1) allocate (y, source=system%b)
      multigrid = system%multigrid
      call solve(method, multigrid, 0.0_wp, 0.0_wp, 0, system)
      small = 1.0e-5_wp*system%report%residual
      call check('no iteration allowed', ended(system, not_converged, 0) &
        .and. all(abs(system%x) <= 0))
      call solve(method, multigrid, 0.0_wp, 0.0_wp, 2, system)
      call check('stopped by the limit', ended(system, not_converged, 2))
      call solve(method, multigrid, small, 0.0_wp, 100, system)
      call check('goes on from a first guess', system%report%info == solved &
        .and. system%report%residual <= small)
      y = system%b
      call system%op%apply(system%x, y)
      call check('the residual is that of the solution', &
        norm(system%b - y) <= 1.01_wp*small*sqrt(720.0_wp))
      call solve(method, multigrid, 1.01_wp*small, 0.0_wp, 100, system)
      call check('nothing left to do', ended(system, solved, 0))
      system%b = 0.0_wp
      system%x = 0.0_wp
      call solve(method, multigrid, 0.0_wp, 0.0_wp, 10, system)
      call check('zero right side', ended(system, solved, 0) &
        .and. all(abs(system%x) <= 0))
    end do
  end subroutine test_ends

  !> Did the last solve end like this?
  pure logical function ended(system, info, iterations)
    type(system_t), intent(in) :: system
    integer, intent(in) :: info, iterations

    ended = system%report%info == info .and. system%report%iterations == iterations
  end function ended

  !> Euclidean norm over the cells of all processes.
  real(wp) function norm(a)
    real(wp), intent(in), contiguous :: a(:, :, :)

    norm = sqrt(exact_dot(a, a, 1))
  end function norm

  !> A closed box: the mean of a right side that has one is taken off, and that of the solution.
  subroutine test_mean()
    type(system_t) :: system
    type(multigrid_t) :: multigrid
    real(wp), parameter :: mean = 0.1_wp

    call make_system([10, 6, 12], unit_box, 'slip', walls, 7, system)
    call fill_inside(system%grid, system%op%cf)
    call system%multigrid%setup(system%op%cf)
    multigrid = system%multigrid
    call find_null_space(system%grid, system%op%cf, system%work)
    call check('closed box is singular', system%work%singular)
    call check('all cells are open', system%work%n_open, 720.0_wp, 0.0_wp)
    system%b = system%b + mean*system%work%is_open
    call solve(1, multigrid, 0.0_wp, 1.0e-10_wp, 100, system)
    call check('right side with a mean', system%report%info, solved)
    call check('solution without a mean', exact_dot(system%x, system%work%is_open, 1), 0.0_wp, &
      1.0e-11_wp*norm(system%x))
    call system%op%apply(system%x, system%work%q)
    call check('solves but for the mean', &
      norm(system%b - mean*system%work%is_open - system%work%q), 0.0_wp, 1.0e-8_wp*norm(system%b))
    call make_system([10, 6, 12], unit_box, 'open', walls, 7, system)
    call find_null_space(system%grid, system%op%cf, system%work)
    call check('open box is not singular', .not. system%work%singular)
  end subroutine test_mean

  !> Open all faces inside the domain.
  subroutine fill_inside(grid, cf)
    type(grid_t), intent(in) :: grid
    real(wp), intent(inout), contiguous :: cf(grid%lo(1) - 1:, grid%lo(2) - 1:, grid%lo(3) - 1:, :)
    integer :: d, a(3), b(3)

    do d = 1, 3
      a = grid%lo
      b = grid%hi
      a(d) = max(grid%lo(d), 2)
      b(d) = min(grid%hi(d) + 1, grid%n(d))
      cf(a(1):b(1), a(2):b(2), a(3):b(3), d) = max(cf(a(1):b(1), a(2):b(2), a(3):b(3), d), 1.0_wp)
    end do
  end subroutine fill_inside

  !> A matrix that is not positive and a right side that is not a number are found out.
  subroutine test_failures()
    type(system_t) :: system
    type(identity_t) :: identity
    integer :: method

    call ieee_set_halting_mode(ieee_invalid, .false.)
    do method = 1, 2
      call make_system([4, 4, 8], unit_box, 'open', walls, 1, system)
      if (method == 1) system%op%cf = -system%op%cf
      if (method == 2) system%op%cf = 0.0_wp
      call solve(method, identity, 0.0_wp, 0.0_wp, 10, system)
      call check('matrix not positive', system%report%info, broken_down)
      call make_system([4, 4, 8], unit_box, 'open', walls, 1, system)
      system%b(system%grid%lo(1), system%grid%lo(2), system%grid%lo(3)) = &
        ieee_value(1.0_wp, ieee_quiet_nan)
      call solve(method, identity, 0.0_wp, 0.0_wp, 10, system)
      call check('not a number', system%report%info, broken_down)
    end do
    call ieee_set_flag(ieee_invalid, .false.)
  end subroutine test_failures

end module test_krylov_m
