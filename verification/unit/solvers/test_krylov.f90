!> Conjugate gradients and BiCGSTAB with all preconditioners, and how they end.
! ranks: 2
module test_krylov_m
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan, ieee_invalid, &
    ieee_set_halting_mode, ieee_set_flag
  use check_m, only: check, wp
  use grid_m, only: grid_t
  use errors_m, only: to_text
  use krylov_m, only: find_null_space, conjugate_gradient, bicgstab
  use linear_operator_m, only: preconditioner_t, jacobi_t, identity_t
  use solve_control_m, only: solve_control_t, solve_report_t, solved, not_converged, broken_down
  use multigrid_m, only: multigrid_t
  use exact_sum_m, only: exact_dot
  use linear_systems_m, only: system_t, make_grid, set_random, complete
  implicit none
  private
  public :: test_krylov

  logical, parameter :: walls(3) = .false., periodic(3) = .true.
  real(wp), parameter :: unit_box(3) = 1.0_wp
  type(solve_report_t) :: report

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
    call complete(system)
  end subroutine make_system

  !> Solve by method 1, conjugate gradients, or 2, BiCGSTAB.
  subroutine solve(method, prec, tol, relative, max_it, system)
    integer, intent(in) :: method, max_it
    class(preconditioner_t), intent(inout) :: prec
    real(wp), intent(in) :: tol, relative
    type(system_t), intent(inout) :: system

    associate (control => solve_control_t(tol, relative, max_it))
      if (method == 1) then
        call conjugate_gradient(system%op, prec, system%b, system%x, control, report, system%work)
      else
        call bicgstab(system%op, prec, system%b, system%x, control, report, system%work)
      end if
    end associate
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
    integer :: seed

    do seed = 1, 3
      call make_system(n, length, top, wraps, seed, system)
      multigrid = system%multigrid
      call jacobi%setup(system%grid, system%op%cf)
      call both_methods(multigrid, 'multigrid', system)
      call both_methods(jacobi, 'Jacobi', system)
      call both_methods(identity, 'no preconditioner', system)
    end do
  end subroutine test_methods

  subroutine both_methods(prec, name, system)
    class(preconditioner_t), intent(inout) :: prec
    character(*), intent(in) :: name
    type(system_t), intent(inout) :: system
    integer :: method

    do method = 1, 2
      system%x = 0.0_wp
      call solve(method, prec, 0.0_wp, 1.0e-11_wp, 5000, system)
      call check('end of method '//to_text(method)//', '//name, report%info, solved)
      call check('residual of method '//to_text(method)//', '//name, residual(system), 0.0_wp, &
        1.0e-10_wp*norm(system%b))
    end do
  end subroutine both_methods

  !> Euclidean norm of b - A x.
  real(wp) function residual(system)
    type(system_t), intent(inout) :: system
    real(wp), allocatable :: y(:, :, :)

    allocate (y, source=0*system%b)
    call system%op%apply(system%x, y)
    residual = norm(system%b - y)
  end function residual

  !> First guess, limits on iterations and residual, zero right side.
  subroutine test_ends()
    type(system_t) :: system
    type(multigrid_t) :: multigrid
    real(wp) :: small
    integer :: method

    do method = 1, 2
      call make_system([12, 6, 10], unit_box, 'open', walls, 5, system)
      multigrid = system%multigrid
      call solve(method, multigrid, 0.0_wp, 0.0_wp, 0, system)
      small = 1.0e-5_wp*report%residual
      call check('no iteration allowed', ended(not_converged, 0) .and. all(abs(system%x) <= 0))
      call solve(method, multigrid, 0.0_wp, 0.0_wp, 2, system)
      call check('stopped by the limit', ended(not_converged, 2))
      call solve(method, multigrid, small, 0.0_wp, 100, system)
      call check('goes on from a first guess', report%info == solved .and. report%residual <= small)
      call check('the residual of the solution', residual(system) <= 1.01_wp*small*sqrt(720.0_wp))
      call solve(method, multigrid, 1.01_wp*small, 0.0_wp, 100, system)
      call check('nothing left to do', ended(solved, 0))
      system%b = 0.0_wp
      system%x = 0.0_wp
      call solve(method, multigrid, 0.0_wp, 0.0_wp, 10, system)
      call check('zero right side', ended(solved, 0) .and. all(abs(system%x) <= 0))
    end do
  end subroutine test_ends

  !> Did the last solve end like this?
  logical function ended(info, iterations)
    integer, intent(in) :: info, iterations

    ended = report%info == info .and. report%iterations == iterations
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
    call check('all cells are open', system%work%n_open, 720.0_wp)
    system%b = system%b + mean*system%work%is_open
    call solve(1, multigrid, 0.0_wp, 1.0e-10_wp, 100, system)
    call check('right side with a mean', report%info, solved)
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
      call check('matrix not positive', report%info, broken_down)
      call make_system([4, 4, 8], unit_box, 'open', walls, 1, system)
      system%b(system%grid%lo(1), system%grid%lo(2), system%grid%lo(3)) = &
        ieee_value(1.0_wp, ieee_quiet_nan)
      call solve(method, identity, 0.0_wp, 0.0_wp, 10, system)
      call check('not a number', report%info, broken_down)
    end do
    call ieee_set_flag(ieee_invalid, .false.)
  end subroutine test_failures

end module test_krylov_m
