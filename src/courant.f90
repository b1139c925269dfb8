!> How fast the flow crosses the cells: what the length of a step follows, and what the transport
!! carries in it.
!!
!! The step follows liquid and blocks. Gas that a closing hole presses out, or that a jet drags
!! along, is ten times as fast and has a thousandth of the mass: it does not shorten the step, its
!! transport takes more parts (`fluid_transport_m`), unless it is faster still. Measured choice:
!! docs/decisions/time_step.md.
module courant_m
  use kinds_m, only: wp
  use grid_m, only: grid_t
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use rigid_body_m, only: blocks_t
  use parallel_m, only: global_max
  implicit none
  private
  public :: courant_rate_t, courant_rate

  real(wp), parameter :: least_open = 0.5_wp     !! share of a face whose velocity counts
  real(wp), parameter :: least_liquid = 0.5_wp   !! of a cell that the step follows
  real(wp), parameter :: gas_lead = 8.0_wp
    !! gas faster than so many times what is followed shortens the step all the same
  real(wp), parameter :: past_wall = 1.5_wp
    !! flow past a body over the body's speed: of a sphere in an ideal fluid, at its equator

  !> Courant numbers per second [1/s]; a step times one of them is a Courant number.
  type :: courant_rate_t
    real(wp) :: followed = 0.0_wp
      !! largest |u_d|/h_d of the cells that are at least half liquid, and of the flow past the
      !! blocks; at least an eighth of `carried`
    real(wp) :: carried = 0.0_wp
      !! largest of all cells, summed over the directions: what a cell may lose in a step
    logical :: has_surface = .false.   !! are there cells of liquid and cells of gas?
  end type courant_rate_t

contains

  !> Of fluid and blocks. All processes call, all get the same.
  function courant_rate(grid, flow, solid, blocks) result(rate)
    type(grid_t), intent(in) :: grid
    type(flow_t), intent(in) :: flow
    type(solid_geometry_t), intent(in) :: solid
    type(blocks_t), intent(in) :: blocks
    type(courant_rate_t) :: rate
    real(wp) :: fluid(4)
    integer :: b

    fluid = fluid_rates(grid, flow%uf, solid%open, flow%c)
    call global_max(fluid)
    rate%followed = fluid(1)
    rate%carried = fluid(2)
    rate%has_surface = all(fluid(3:) >= least_liquid)
    do b = 1, blocks%n
      if (.not. blocks%present(b)) cycle
      rate%followed = max(rate%followed, past_wall/minval(grid%h)*( &
                      norm2(blocks%v(:, b)) &
                      + norm2(blocks%omega(:, b))*blocks%shapes(blocks%shape(b))%radius))
    end do
    rate%carried = max(rate%carried, rate%followed)
    rate%followed = max(rate%followed, rate%carried/gas_lead)
  end function courant_rate

  !> Followed and carried, the most liquid and the most gas in a cell, of this process.
  function fluid_rates(grid, uf, open, c) result(rates)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous, dimension(grid%first(1):, grid%first(2):, grid%first(3):, :) &
      :: uf, open   !! velocity [m/s] and open share of the lower faces
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
      !! liquid share
    real(wp) :: rates(4)
    real(wp) :: x, y, z, followed, carried, liquid, gas
    integer :: i, j, k

    followed = 0.0_wp
    carried = 0.0_wp
    liquid = 0.0_wp
    gas = 0.0_wp
    !$omp parallel do private(i, j, x, y, z) schedule(static) &
    !$omp reduction(max: followed, carried, liquid, gas)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        !$omp simd private(x, y, z) reduction(max: followed, carried, liquid, gas)
        do i = grid%lo(1), grid%hi(1)
          x = max(speed(uf(i, j, k, 1), open(i, j, k, 1)), &
                  speed(uf(i + 1, j, k, 1), open(i + 1, j, k, 1)))/grid%h(1)
          y = max(speed(uf(i, j, k, 2), open(i, j, k, 2)), &
                  speed(uf(i, j + 1, k, 2), open(i, j + 1, k, 2)))/grid%h(2)
          z = max(speed(uf(i, j, k, 3), open(i, j, k, 3)), &
                  speed(uf(i, j, k + 1, 3), open(i, j, k + 1, 3)))/grid%h(3)
          carried = max(carried, x + y + z)
          liquid = max(liquid, c(i, j, k))
          gas = max(gas, 1.0_wp - c(i, j, k))
          followed = max(followed, merge(max(x, y, z), 0.0_wp, c(i, j, k) >= least_liquid))
        end do
      end do
    end do
    rates = [followed, carried, liquid, gas]
  end function fluid_rates

  !> Speed at a face, zero where it is mostly closed.
  elemental function speed(u, open)
    real(wp), intent(in) :: u, open
    real(wp) :: speed

    speed = merge(abs(u), 0.0_wp, open >= least_open)
  end function speed

end module courant_m
