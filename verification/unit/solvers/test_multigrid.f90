!> The multigrid cycle: symmetric, positive, quick, and the same bits on any threads and processes.
!!
!! Prints a checksum of each solution, which `test_bits.py` compares between processes.
! ranks: 2 4
module test_multigrid_m
  use check_m, only: check, wp
  use grid_m, only: grid_t
  use krylov_m, only: find_null_space, conjugate_gradient
  use solve_control_m, only: solve_control_t, solve_report_t, solved
  use multigrid_m, only: multigrid_t
  use exact_sum_m, only: exact_dot
  use random_counter_m, only: uniform
  use checksum_m, only: checksum_t
  use parallel_m, only: set_threads, nproc, is_root, gather_all
  use linear_systems_m, only: system_t, make_grid, set_tank, set_random, complete
  implicit none
  private
  public :: test_multigrid

  logical, parameter :: walls(3) = .false., periodic(3) = .true.
  logical, parameter :: sideways(3) = [.true., .true., .false.]
  real(wp), parameter :: tank(3) = [0.3_wp, 0.1_wp, 0.2_wp], unit_box(3) = 1.0_wp

  type(solve_report_t) :: report

contains

  subroutine test_multigrid()
    call set_threads(1)
    call test_tank([60, 20, 40], 'open', walls, 12)
    call test_tank([61, 19, 41], 'open', walls, 9)
    call test_tank([60, 10, 20], 'open', walls, 9)
    call test_tank([60, 20, 40], 'slip', walls, 12)
    call test_tank([30, 10, 20], 'open', sideways, 8)
    call test_tank([45, 15, 30], 'open', sideways, 9)
    call test_random([64, 8, 8], 'open', walls)
    call test_random([9, 40, 6], 'open', walls)
    call test_random([13, 11, 10], 'slip', walls)
    call test_random([16, 1, 24], 'open', [.false., .true., .false.])
    call test_random([16, 12, 20], 'slip', periodic)
    call test_random([9, 7, 15], 'slip', periodic)
    call test_one_cell()
  end subroutine test_multigrid

  !> The paper's tank, sometimes with other cells or sides: iterations to 1e-6 of the right side.
  subroutine test_tank(n, top, wraps, most)
    integer, intent(in) :: n(3), most   !! cells, iterations
    character(*), intent(in) :: top
    logical, intent(in) :: wraps(3)
    type(system_t) :: system

    call make_grid(n, tank, top, wraps, system%grid)
    call set_tank(system%grid, system%op)
    call test_all('tank', system)
    call check('iterations in the tank', report%iterations <= most)
  end subroutine test_tank

  !> A box with random coefficients, closed faces and closed cells.
  subroutine test_random(n, top, wraps)
    integer, intent(in) :: n(3)
    character(*), intent(in) :: top
    logical, intent(in) :: wraps(3)
    type(system_t) :: system

    call make_grid(n, unit_box, top, wraps, system%grid)
    call set_random(system%grid, 1, system%op)
    call test_all('random box', system)
  end subroutine test_random

  !> What both have to show, named in what they tell.
  subroutine test_all(name, system)
    character(*), intent(in) :: name
    type(system_t), intent(inout) :: system

    call complete(system)
    call find_null_space(system%grid, system%op%cf, system%work)
    call test_form(name, system)
    call test_bits(name, system)
  end subroutine test_all

  !> x.My = y.Mx, x.Mx > 0; M(2 x) = 2 Mx to the bit, on 5 threads too; closed cells give nothing.
  subroutine test_form(name, system)
    character(*), intent(in) :: name
    type(system_t), intent(inout) :: system
    real(wp), allocatable, dimension(:, :, :) :: x, y, mx, my, m2x
    real(wp) :: xmx, ymy, asymmetry

    allocate (x, source=system%b)
    allocate (y, source=system%b)
    allocate (mx, source=0*x)
    allocate (my, source=0*x)
    allocate (m2x, source=0*x)
    call fill_noise(system%grid, 1, x)
    call fill_noise(system%grid, 2, y)
    call system%multigrid%apply(x, 0.5_wp, mx)
    call system%multigrid%apply(y, 0.5_wp, my)
    xmx = exact_dot(x, mx, 1)
    ymy = exact_dot(y, my, 1)
    asymmetry = (exact_dot(x, my, 1) - exact_dot(y, mx, 1))/sqrt(xmx*ymy)
    call check(name//': symmetric', asymmetry, 0.0_wp, 1.0e-6_wp)
    call check(name//': positive', xmx > 0.0_wp .and. ymy > 0.0_wp)
    if (nproc() == 1) call set_threads(5)
    call system%multigrid%apply(2.0_wp**80*x, 2.0_wp**79, m2x)
    call set_threads(1)
    call check(name//': scales', all(abs(m2x - 2.0_wp**80*mx) <= 0))
    call check(name//': closed cells stay zero', closed_cells_zero(system, mx))
  end subroutine test_form

  !> Noise between -1/2 and 1/2 in the own cells, a function of the cell.
  subroutine fill_noise(grid, seed, x)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: seed
    real(wp), intent(inout), contiguous :: x(grid%lo(1) - 1:, grid%lo(2) - 1:, grid%lo(3) - 1:)
    integer :: i, j, k

    do concurrent (k=grid%lo(3):grid%hi(3), j=grid%lo(2):grid%hi(2), i=grid%lo(1):grid%hi(1))
      x(i, j, k) = uniform(seed, 4, i + 1000*(j + 1000*k)) - 0.5_wp
    end do
  end subroutine fill_noise

  logical function closed_cells_zero(system, x)
    type(system_t), intent(in) :: system
    real(wp), intent(in), contiguous :: x(system%grid%lo(1) - 1:, system%grid%lo(2) - 1:, &
                                          system%grid%lo(3) - 1:)

    associate (a => system%grid%lo, b => system%grid%hi, cf => system%op%cf)
      closed_cells_zero = all(abs(x(a(1):b(1), a(2):b(2), a(3):b(3))) &
        <= 0.0_wp .or. sum(cf(a(1):b(1), a(2):b(2), a(3):b(3), :), 4) > 0.0_wp .or. &
        cf(a(1) + 1:b(1) + 1, a(2):b(2), a(3):b(3), 1) > 0.0_wp .or. cf(a(1):b(1), a(2) + 1:b(2) &
        + 1, a(3):b(3), 2) > 0.0_wp .or. cf(a(1):b(1), a(2):b(2), a(3) + 1:b(3) + 1, 3) > 0.0_wp)
    end associate
  end function closed_cells_zero

  !> One process: the same bits on 1 and 2 threads. The checksum goes to standard output.
  subroutine test_bits(name, system)
    character(*), intent(in) :: name
    type(system_t), intent(inout) :: system
    real(wp), allocatable :: first(:, :, :)
    integer :: t

    allocate (first, source=system%x)
    do t = 1, merge(2, 1, nproc() == 1)
      call set_threads(t)
      system%x = 0.0_wp
      call conjugate_gradient(system%op, system%multigrid, system%b, system%x, &
        solve_control_t(relative=1.0e-6_wp, max_iterations=200), report, system%work)
      call check(name//': solved', report%info, solved)
      if (t == 1) first(:, :, :) = system%x
      call check(name//': bits do not depend on threads', all(abs(system%x - first) <= 0))
    end do
    call set_threads(1)
    call print_checksum(name, system%grid, first)
  end subroutine test_bits

  !> Name, cells, iterations and checksum of the solution of all processes.
  subroutine print_checksum(name, grid, x)
    character(*), intent(in) :: name
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: x(grid%lo(1) - 1:, grid%lo(2) - 1:, grid%lo(3) - 1:)
    real(wp) :: whole(grid%n(1), grid%n(2), grid%n(3))
    type(checksum_t) :: checksum

    whole = 0.0_wp
    call gather_all(x(grid%lo(1):grid%hi(1), grid%lo(2):grid%hi(2), grid%lo(3):grid%hi(3)), &
      grid%lo, grid%hi, whole)
    call checksum%add_reals(size(whole), whole)
    if (is_root()) print '(2a, 4(1x, i0), 1x, a)', 'solution ', name, grid%n, &
      report%iterations, checksum%text()
  end subroutine print_checksum

  !> One cell under an open top: the cycle divides by the coefficient of the top.
  subroutine test_one_cell()
    type(grid_t) :: grid
    type(multigrid_t) :: multigrid
    real(wp) :: cf(0:2, 0:2, 0:2, 3), r(3, 3, 3), z(3, 3, 3)

    grid%n = 1
    call grid%own([1, 1, 1], grid%n)
    grid%h = 1.0_wp
    cf = 0.0_wp
    cf(1, 1, 2, 3) = 4.0_wp
    r = 6.0_wp
    z = 0.0_wp
    call multigrid%init(grid)
    call multigrid%setup(cf)
    call multigrid%apply(r, 6.0_wp, z)
    call check('one cell', z(2, 2, 2), 1.5_wp, 1.0e-6_wp)
  end subroutine test_one_cell

end module test_multigrid_m
