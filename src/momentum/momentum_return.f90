!> Momentum that the velocity stage gives to cut cells, handed over to the mass that is there.
!!
!! The transport carries the momentum of all fluid in a cell, m = rho V (1 - alpha). Viscosity,
!! pressure and the forces on bodies move the mean open share of two faces instead, m_d = rho V w_d
!! (`open_share`), in which a uniform force accelerates all cells alike. So a change of velocity
!! du relative to that of the wall leaves (m_d - m) du of the momentum that a body has felt without
!! an owner, and so does what film cells lose when wall and faces set their velocity
!! (`film_velocity_m`). It goes to those of the 26 cells around that no body cuts, where the two
!! masses are the same, so that nothing comes back; where all of them are cut, as in the corners of
!! a block, to all of the 124 around. Fluid and bodies together keep their momentum.
module momentum_return_m
  use kinds_m, only: wp
  use case_types_m, only: fluid_t
  use grid_m, only: grid_t, n_halo, unit_step
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t, wall_velocity
  use rigid_flux_m, only: nearest_arm
  use momentum_conservative_m, only: mass_through
  use viscous_system_m, only: open_share
  use parallel_m, only: halo_exchange
  implicit none
  private
  public :: momentum_debt_t, momentum_debt_init, return_momentum

  real(wp), parameter :: heavy = 0.5_wp           !! mass of a full taker over that of a full giver
  real(wp), parameter :: least_sum = 14.0_wp
    !! full cells among which a giver without whole neighbours spreads at least: of what the cells
    !! give to each other less comes back than was given
  integer, parameter :: far = 2                   !! cells to which it may give

  type :: momentum_debt_t
    real(wp), allocatable :: u_before(:, :, :, :)   !! velocity before the stage [m/s]
    real(wp), allocatable :: tied(:, :, :, :)
      !! part of the change that no force made (`film_velocity_m`) [m/s]
    real(wp), allocatable :: whole(:, :, :, :), cut(:, :, :, :)
      !! what a cell owes to its whole neighbours, or to all around [m/s]
  end type momentum_debt_t

contains

  !> Allocate for a grid; nothing owed.
  subroutine momentum_debt_init(grid, self)
    type(grid_t), intent(in) :: grid
    type(momentum_debt_t), intent(out) :: self
    integer :: a(3), b(3)

    a = grid%first
    b = grid%last
    allocate (self%u_before(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
    allocate (self%tied, self%whole, self%cut, source=self%u_before)
  end subroutine momentum_debt_init

  !> Complete the velocity stage: `flow%u` on entry is its result in all cells.
  subroutine return_momentum(grid, fluid, solid, before, bodies, self, flow)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: before, bodies   !! at the start and at the end of the step
    type(momentum_debt_t), intent(inout) :: self
    type(flow_t), intent(inout) :: flow
    integer :: b, m, c(3), low(3), high(3)

    if (bodies%n == 0) return
    self%whole = 0.0_wp
    self%cut = 0.0_wp
    low = grid%hi
    high = grid%lo
    do b = 1, bodies%n
      do m = solid%body_face(b), solid%body_face(b + 1) - 1
        c = solid%face(1:3, m)
        call owe(b, c, .true.)
        call owe(b, c - unit_step(:, solid%face(4, m)), .true.)
      end do
      do m = solid%body_cell(b), solid%body_cell(b + 1) - 1
        call owe(b, solid%cell(:, m), .false.)
      end do
    end do
    call halo_exchange(self%whole, n_halo)
    call halo_exchange(self%cut, n_halo)
    call take(max(low - 1, grid%lo), min(high + 1, grid%hi))
    call take_far(max(low - far, grid%lo - far), min(high + far, grid%hi + far))
  contains
    !> What cell c at body b owes, per share of the takers.
    subroutine owe(b, c, beside)
      integer, intent(in) :: b, c(3)
      logical, intent(in) :: beside   !! only if no body reaches into the cell
      real(wp) :: arm(3), wall(3), moved(3), mass, mass_whole, mass_cut, full, owed, m
      integer :: i, j, k, d, u(3)

      low = min(low, c)
      high = max(high, c)
      if (any(c < grid%lo) .or. any(c > grid%hi)) return
      if (beside .and. solid%alpha(c(1), c(2), c(3)) > 0.0_wp) return
      arm = nearest_arm(grid, [grid%centre(c(1), 1), grid%centre(c(2), 2), grid%centre(c(3), 3)], &
                        bodies%x(:, b))
      wall = wall_velocity(bodies%motion(:, b) - before%motion(:, b), arm)
      full = flow%rho(c(1), c(2), c(3))*grid%volume
      mass = mass_of(c(1), c(2), c(3))
      do d = 1, 3
        u = c + unit_step(:, d)
        moved(d) = full*open_share(solid%open(c(1), c(2), c(3), d), solid%open(u(1), u(2), u(3), d))
      end do
      if (mass <= 0.0_wp .and. all(moved <= 0.0_wp)) return
      mass_whole = 0.0_wp
      mass_cut = 0.0_wp
      do k = c(3) - 1, c(3) + 1
        do j = c(2) - 1, c(2) + 1
          do i = c(1) - 1, c(1) + 1
            m = mass_of(i, j, k)
            if (is_whole(i, j, k) .and. m > heavy*full) mass_whole = mass_whole + m
          end do
        end do
      end do
      if (mass_whole <= 0.0_wp) mass_cut = sum_around(c, full)
      do d = 1, 3
        owed = (moved(d) - mass)*(flow%u(c(1), c(2), c(3), d) - self%tied(c(1), c(2), c(3), d) &
                                  - self%u_before(c(1), c(2), c(3), d) - wall(d)) &
               - mass*self%tied(c(1), c(2), c(3), d)
        if (mass_whole > 0.0_wp) then
          self%whole(c(1), c(2), c(3), d) = owed/mass_whole
        else
          self%cut(c(1), c(2), c(3), d) = owed/max(mass_cut, least_sum*full)
        end if
      end do
    end subroutine owe

    !> Sum of m**2/full of the cells around a giver without whole neighbours.
    pure function sum_around(c, full) result(total)
      integer, intent(in) :: c(3)
      real(wp), intent(in) :: full   !! mass that a full cell of it would have [kg]
      real(wp) :: total
      integer :: i, j, k

      total = 0.0_wp
      do k = c(3) - far, c(3) + far
        do j = c(2) - far, c(2) + far
          do i = c(1) - far, c(1) + far
            total = total + mass_of(i, j, k)**2/full
          end do
        end do
      end do
    end function sum_around

    !> The own cells between two corners take what their neighbours owe to whole cells.
    subroutine take(first, last)
      integer, intent(in) :: first(3), last(3)
      integer :: i, j, k, p, q, r
      real(wp) :: mass, full, total(3)

      !$omp parallel do private(i, j, p, q, r, mass, full, total) schedule(static)
      do k = first(3), last(3)
        do j = first(2), last(2)
          do i = first(1), last(1)
            mass = mass_of(i, j, k)
            if (.not. is_whole(i, j, k)) cycle
            total = 0.0_wp
            do r = k - 1, k + 1
              do q = j - 1, j + 1
                do p = i - 1, i + 1
                  full = flow%rho(p, q, r)*grid%volume
                  if (mass > heavy*full) total = total + self%whole(p, q, r, :)
                end do
              end do
            end do
            flow%u(i, j, k, :) = flow%u(i, j, k, :) + total
          end do
        end do
      end do
    end subroutine take

    !> What is owed to all around by the givers between two corners, in the order of their places.
    subroutine take_far(first, last)
      integer, intent(in) :: first(3), last(3)
      integer :: i, j, k, p, q, r
      real(wp) :: full

      do r = first(3), last(3)
        do q = first(2), last(2)
          do p = first(1), last(1)
            if (all(abs(self%cut(p, q, r, :)) <= 0.0_wp)) cycle
            full = flow%rho(p, q, r)*grid%volume
            do k = max(r - far, grid%lo(3)), min(r + far, grid%hi(3))
              do j = max(q - far, grid%lo(2)), min(q + far, grid%hi(2))
                do i = max(p - far, grid%lo(1)), min(p + far, grid%hi(1))
                  flow%u(i, j, k, :) = flow%u(i, j, k, :) &
                    + self%cut(p, q, r, :)*mass_of(i, j, k)/full
                end do
              end do
            end do
          end do
        end do
      end do
    end subroutine take_far

    !> Mass of the fluid in a cell [kg]; none outside the domain.
    pure function mass_of(i, j, k) result(mass)
      integer, intent(in) :: i, j, k
      real(wp) :: mass

      mass = 0.0_wp
      if (any(([i, j, k] < 1 .or. [i, j, k] > grid%n) .and. .not. grid%periodic)) return
      mass = mass_through(fluid, flow%room(i, j, k), flow%liquid(i, j, k))
    end function mass_of

    !> No body touches the cell or one of its faces.
    pure function is_whole(i, j, k) result(answer)
      integer, intent(in) :: i, j, k
      logical :: answer

      answer = solid%alpha(i, j, k) <= 0.0_wp &
        .and. all(solid%open(i, j, k, :) >= 1.0_wp) .and. solid%open(i + 1, j, k, 1) >= 1.0_wp &
        .and. solid%open(i, j + 1, k, 2) >= 1.0_wp .and. solid%open(i, j, k + 1, 3) >= 1.0_wp
    end function is_whole
  end subroutine return_momentum

end module momentum_return_m
