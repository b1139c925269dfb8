!> Halo values of every boundary kind, on sides, edges and corners.
module test_boundary_m
  use check_m, only: check, wp
  use case_types_m, only: grid_input_t, boundary_input_t
  use boundary_kinds_m, only: side_no_slip, side_slip, side_inflow, is_wall
  use grid_m, only: grid_t, grid_init, n_halo
  use boundary_m, only: fill_scalar_halo, fill_velocity_halo, set_side_velocity
  implicit none
  private
  public :: test_boundary

  real(wp), parameter :: lid(3) = [0.5_wp, -0.25_wp, 0.0_wp]   !! velocity of a moving wall [m/s]
  real(wp), parameter :: stream(3) = [0.75_wp, 0.5_wp, -1.25_wp]   !! of an inflow [m/s]

contains

  subroutine test_boundary()
    call all_halos('tank', [6, 4, 5], reshape([character(8) :: &
                   'periodic', 'periodic', 'no_slip', 'slip', 'no_slip', 'open'], [2, 3]))
    call all_halos('other way round', [4, 5, 6], reshape([character(8) :: &
                   'open', 'no_slip', 'slip', 'no_slip', 'periodic', 'periodic'], [2, 3]))
    call all_halos('one cell thick', [5, 1, 4], reshape([character(8) :: &
                   'no_slip', 'open', 'slip', 'slip', 'slip', 'no_slip'], [2, 3]))
    call all_halos('one periodic cell', [5, 1, 4], reshape([character(8) :: &
                   'slip', 'slip', 'periodic', 'periodic', 'open', 'open'], [2, 3]))
    call all_halos('river', [6, 4, 5], reshape([character(8) :: &
                   'inflow', 'outflow', 'slip', 'slip', 'no_slip', 'inflow'], [2, 3]))
  end subroutine test_boundary

  !> Every cell of the halo against the rules, followed back to the domain direction by direction.
  subroutine all_halos(name, cells, sides)
    character(*), intent(in) :: name
    integer, intent(in) :: cells(3)
    character(*), intent(in) :: sides(2, 3)
    type(grid_input_t) :: input
    type(boundary_input_t) :: boundary
    type(grid_t) :: grid
    real(wp), allocatable :: u(:, :, :, :), a(:, :, :)
    integer :: i, j, k, c

    input%cells = cells
    input%length = 1.0_wp
    boundary%kind = sides
    do c = 1, 3
      where (boundary%kind(2, :) == 'no_slip') boundary%velocity(c, 2, :) = lid(c)
      where (boundary%kind == 'inflow') boundary%velocity(c, :, :) = stream(c)
    end do
    call grid_init(input, boundary, grid)
    associate (p => 1 - n_halo, q => cells + n_halo)
      allocate (u(p:q(1), p:q(2), p:q(3), 3), source=-1.0e30_wp)
      allocate (a(p:q(1), p:q(2), p:q(3)), source=-1.0e30_wp)
    end associate
    do concurrent (k=1:cells(3), j=1:cells(2), i=1:cells(1))
      a(i, j, k) = original([i, j, k], 1)
      u(i, j, k, :) = [(original([i, j, k], c), c=1, 3)]
    end do
    call fill_scalar_halo(grid, a)
    call fill_velocity_halo(grid, u)
    do k = 1 - n_halo, cells(3) + n_halo
      do j = 1 - n_halo, cells(2) + n_halo
        do i = 1 - n_halo, cells(1) + n_halo
          call check(name//': scalar', a(i, j, k), expected_scalar(grid, [i, j, k]))
          call check(name//': velocity', u(i, j, k, :), &
            [(expected_velocity(grid, [i, j, k], c), c=1, 3)])
        end do
      end do
    end do
    u = -1.0e30_wp
    call set_side_velocity(grid, u)
    call check(name//': normal velocity of the sides', side_errors(grid, u), 0.0_wp)
  end subroutine all_halos

  !> Largest error of the face velocity where a side gives it; elsewhere it must be untouched.
  pure real(wp) function side_errors(grid, uf) result(worst)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: uf(1 - n_halo:, 1 - n_halo:, 1 - n_halo:, :)
    real(wp) :: expected
    integer :: i, j, k, d, s, at(3)

    worst = 0.0_wp
    do d = 1, 3
      do k = 1, grid%n(3) + 1
        do j = 1, grid%n(2) + 1
          do i = 1, grid%n(1) + 1
            at = [i, j, k]
            expected = -1.0e30_wp
            s = merge(1, 2, at(d) == 1)
            if ((at(d) == 1 .or. at(d) == grid%n(d) + 1) .and. .not. grid%periodic(d) &
                .and. all(at <= grid%n .or. [1, 2, 3] == d)) then
              if (is_wall(grid%side(s, d))) expected = grid%side_velocity(d, s, d)
              if (grid%side(s, d) == side_inflow) expected = stream(d)
            end if
            worst = max(worst, abs(uf(i, j, k, d) - expected))
          end do
        end do
      end do
    end do
  end function side_errors

  !> A value that tells the cell and the component, exact in any order of summing.
  pure real(wp) function original(at, c) result(value)
    integer, intent(in) :: at(3), c

    value = real(c, wp) + 0.125_wp*real(at(1), wp) + 0.0625_wp*real(at(2), wp)**2 &
            - 0.3125_wp*real(at(3), wp)
  end function original

  !> Nearest cell of the domain; the image in a periodic direction.
  pure real(wp) function expected_scalar(grid, at) result(value)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: at(3)
    integer :: from(3)

    from = merge(modulo(at - 1, grid%n) + 1, min(max(at, 1), grid%n), grid%periodic)
    value = original(from, 1)
  end function expected_scalar

  !> The rules of the sides applied one after the other; walls mirror, open sides carry outward.
  pure real(wp) function expected_velocity(grid, at, c) result(value)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: at(3), c
    real(wp) :: factor, shift
    integer :: from(3), d, s, beyond

    factor = 1.0_wp
    shift = 0.0_wp
    from = at
    do d = 3, 1, -1
      if (grid%periodic(d)) from(d) = modulo(at(d) - 1, grid%n(d)) + 1
      if (from(d) >= 1 .and. from(d) <= grid%n(d)) cycle
      s = merge(1, 2, from(d) < 1)
      beyond = merge(1 - from(d), from(d) - grid%n(d), s == 1)
      if (.not. is_wall(grid%side(s, d))) beyond = 1
      beyond = min(beyond, grid%n(d))
      from(d) = merge(beyond, grid%n(d) + 1 - beyond, s == 1)
      if (grid%side(s, d) == side_inflow) then
        shift = shift + factor*stream(c)
        factor = 0.0_wp
      else if (grid%side(s, d) == side_no_slip) then
        if (s == 2) shift = shift + factor*2.0_wp*lid(c)
        factor = -factor
      else if (grid%side(s, d) == side_slip .and. c == d) then
        factor = -factor
      end if
    end do
    value = factor*original(from, c) + shift
  end function expected_velocity

end module test_boundary_m
