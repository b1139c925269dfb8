!> How fast the flow crosses the cells: what the length of a step follows, and what the transport
!! carries in it.
!!
!! The step follows liquid and blocks. Gas that a closing hole presses out, or that a jet drags
!! along, is ten times as fast and has a thousandth of the mass: it does not shorten the step, its
!! transport takes more subcycles (`fluid_transport_m`), unless it is faster still. Measured choice:
!! docs/decisions/time_step.md.
module courant_m
  use kinds_m, only: wp
  use grid_m, only: grid_t
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use rigid_body_m, only: blocks_t, fastest_point
  use parallel_m, only: global_max
  implicit none
  private
  public :: courant_rate_t, courant_rate

  real(wp), parameter :: min_open = 0.5_wp     !! share of a face whose velocity counts
  real(wp), parameter :: min_liquid = 0.5_wp   !! of a cell that the step follows
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
      !! largest share of itself that a cell gives through its faces
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

    fluid = fluid_rates(grid, flow%uf, solid%aperture, flow%c)
    call global_max(fluid)
    rate%followed = fluid(1)
    rate%carried = fluid(2)
    rate%has_surface = all(fluid(3:) >= min_liquid)
    do b = 1, blocks%n
      if (.not. blocks%present(b)) cycle
      rate%followed = max(rate%followed, past_wall/grid%min_spacing()*fastest_point(blocks, b))
    end do
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
    real(wp) :: west, east, front, back, below, above   !! velocities at the faces [cells/s]
    real(wp) :: followed, carried, liquid, gas
    integer :: i, j, k

    followed = 0.0_wp
    carried = 0.0_wp
    liquid = 0.0_wp
    gas = 0.0_wp
    !$omp parallel do private(i, j, west, east, front, back, below, above) schedule(static) &
    !$omp reduction(max: followed, carried, liquid, gas)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        !$omp simd private(west, east, front, back, below, above) &
        !$omp reduction(max: followed, carried, liquid, gas)
        do i = grid%lo(1), grid%hi(1)
          west = through(uf(i, j, k, 1), open(i, j, k, 1))/grid%h(1)
          east = through(uf(i + 1, j, k, 1), open(i + 1, j, k, 1))/grid%h(1)
          front = through(uf(i, j, k, 2), open(i, j, k, 2))/grid%h(2)
          back = through(uf(i, j + 1, k, 2), open(i, j + 1, k, 2))/grid%h(2)
          below = through(uf(i, j, k, 3), open(i, j, k, 3))/grid%h(3)
          above = through(uf(i, j, k + 1, 3), open(i, j, k + 1, 3))/grid%h(3)
          carried = max(carried, (max(0.0_wp, east) - min(0.0_wp, west)) &
                        + (max(0.0_wp, back) - min(0.0_wp, front)) &
                        + (max(0.0_wp, above) - min(0.0_wp, below)))
          liquid = max(liquid, c(i, j, k))
          gas = max(gas, 1.0_wp - c(i, j, k))
          followed = max(followed, merge(max(abs(west), abs(east), abs(front), abs(back), &
                                             abs(below), abs(above)), 0.0_wp, &
                                         c(i, j, k) >= min_liquid))
        end do
      end do
    end do
    rates = [followed, carried, liquid, gas]
  end function fluid_rates

  !> Velocity through a face, none where it is mostly closed.
  elemental function through(u, open)
    real(wp), intent(in) :: u, open
    real(wp) :: through

    through = merge(u, 0.0_wp, open >= min_open)
  end function through

end module courant_m
