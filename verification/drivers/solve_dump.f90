!> The pressure system of a file, solved by conjugate gradients and multigrid of the program.
!!
!! usage: solve_dump FILE TOLERANCE REPEATS THREADS
!!
!! Prints one row: cells in x, y, z, threads, iterations to |b - A x| <= TOLERANCE |b| (sums over
!! all cells), seconds of the set-up and of the solve, each the least of REPEATS, CPU seconds of
!! the pair likewise, and the residual. `tools/micstools/bench/pressure_dump.py` tells the format.
program solve_dump
  use, intrinsic :: iso_fortran_env, only: int64, real64
  use kinds_m, only: wp
  use case_types_m, only: numerics_t
  use grid_m, only: grid_t
  use rigid_motion_m, only: rigid_motion_t, rigid_motion_init
  use pressure_system_m, only: pressure_system_t, pressure_system_init, set_bodies
  use krylov_m, only: conjugate_gradient, find_null_space
  use solve_control_m, only: solve_control_t, solve_report_t
  use linear_systems_m, only: make_grid
  use exact_sum_m, only: exact_dot
  use parallel_m, only: parallel_init, parallel_final, set_threads
  use timers_m, only: wall_clock
  implicit none
  integer, parameter :: most = 1000   !! iterations
  logical, parameter :: walls(3) = .false.
  type(grid_t) :: grid
  type(pressure_system_t) :: system
  type(solve_report_t) :: report
  real(wp), allocatable :: b(:, :, :), x(:, :, :)
  real(wp) :: tolerance, residual, at_start, after_setup, cpu(2)
  real(wp) :: least(3) = huge(1.0_wp)   !! set-up, solve, CPU of both [s]
  integer :: repeat, threads, iterations

  tolerance = number(2)
  threads = nint(number(4))
  call parallel_init()
  call set_threads(threads)
  call read_system(argument(1))
  do iterations = 1, most
    call solve()
    residual = residual_share()
    if (residual <= tolerance) exit
  end do
  do repeat = 1, nint(number(3))
    call cpu_time(cpu(1))
    at_start = wall_clock()
    call system%solver%multigrid%setup(system%operator%cf)
    after_setup = wall_clock()
    call solve()
    least(2) = min(least(2), wall_clock() - after_setup)
    least(1) = min(least(1), after_setup - at_start)
    call cpu_time(cpu(2))
    least(3) = min(least(3), cpu(2) - cpu(1))
  end do
  print '(5(i0, ","), 3(es12.5, ","), es12.5)', grid%n, threads, iterations, least, residual
  call parallel_final()

contains

  !> So many iterations from nothing.
  subroutine solve()
    x = 0.0_wp
    call conjugate_gradient(system%operator, system%solver%multigrid, b, x, &
      solve_control_t(max_iterations=iterations), report, system%solver%work)
  end subroutine solve

  !> |b - A x|/|b|.
  function residual_share() result(share)
    real(wp) :: share

    call system%operator%apply(x, system%solver%work%q)
    system%solver%work%q = b - system%solver%work%q
    share = sqrt(exact_dot(system%solver%work%q, system%solver%work%q, 1)/exact_dot(b, b, 1))
  end function residual_share

  !> Grid, coefficients and right side of a file, times the volume of a cell.
  subroutine read_system(name)
    character(*), intent(in) :: name
    type(rigid_motion_t) :: nobody
    character(8) :: magic
    integer(int64) :: n64(3)
    integer :: unit, n(3), d, e(3)
    real(real64) :: h(3)
    real(real64), allocatable :: part(:, :, :)

    open (newunit=unit, file=name, access='stream', form='unformatted', status='old', &
          action='read')
    read (unit) magic, n64, h
    if (magic /= 'POIS7P01') error stop 'solve_dump: no pressure system'
    n = int(n64)
    call make_grid(n, n*h, 'open', walls, grid)
    call pressure_system_init(grid, 0, numerics_t(), system)
    call rigid_motion_init(0, nobody)
    call set_bodies(grid, nobody, system)
    do d = 1, 3
      e = n
      e(d) = n(d) + 1
      allocate (part(e(1), e(2), e(3)))
      read (unit) part
      system%operator%cf(1:e(1), 1:e(2), 1:e(3), d) = grid%volume*part
      deallocate (part)
    end do
    allocate (b(0:n(1) + 1, 0:n(2) + 1, 0:n(3) + 1), source=0.0_wp)
    allocate (x, source=b)
    allocate (part(n(1), n(2), n(3)))
    read (unit) part
    b(1:n(1), 1:n(2), 1:n(3)) = grid%volume*part
    close (unit)
    call find_null_space(grid, system%operator%cf, system%solver%work)
    call system%solver%multigrid%setup(system%operator%cf)
  end subroutine read_system

  function argument(m) result(word)
    integer, intent(in) :: m
    character(:), allocatable :: word
    integer :: length

    call get_command_argument(m, length=length)
    allocate (character(length) :: word)
    call get_command_argument(m, word)
  end function argument

  real(wp) function number(m)
    integer, intent(in) :: m
    character(:), allocatable :: word

    word = argument(m)
    read (word, *) number
  end function number
end program solve_dump
