!> Sides of kind 'outflow': they keep a water level and let waves leave.
!!
!! Half a cell outside the last cell the pressure is that of a column of water at rest, raised or
!! lowered so that the level is the given one, and a part that yields to a passing wave,
!! $$ p = \int \rho g\,dz + C \rho_l [\, c (u - \bar u) - g (\eta - \eta_0)\, ], \quad
!!    c = \sqrt{g H} $$
!! u is the outward velocity of the face, eta the level of the last column of cells, eta_0 the given
!! level, H its depth there. A long wave that runs out has u - u_bar = (g/c)(eta - eta_0)
!! and meets no resistance (the linear condition of a characteristic that brings nothing in); one of
!! phase speed c' is reflected by (c - c')/(c + c'). u enters implicitly.
!!
!! u_bar follows u in the time T = 4 L/c, L the length of the tank: a steady current leaves at the
!! given level whatever its profile, and the level of a tank comes back without overshoot (the
!! slowest wave is critically damped), while waves, shorter than T, hardly change u_bar.
module outflow_m
  use kinds_m, only: wp
  use case_types_m, only: fluid_t, is_given
  use grid_m, only: grid_t, unit_step
  use boundary_kinds_m, only: side_outflow
  use face_weight_m, only: uneven_share
  use parallel_m, only: global_max
  implicit none
  private
  public :: outflow_t, outflow_init, start_outflow, update_outflow
  public :: side_distance, pressure_outside, mean_velocity

  real(wp), parameter :: elsewhere = -huge(1.0_wp)   !! mark of cells of other processes

  !> One side of the tank; maps over its faces, whole on every process. Empty for other kinds.
  type :: outflow_t
    logical :: active = .false.     !! the side is an outflow
    integer :: along(2) = 0         !! the two directions in the side
    integer :: up = 0               !! which of them is the vertical, 0: no gravity
    logical :: upward = .true.      !! coordinate grows against gravity
    logical :: levelled = .false.   !! a level is kept
    real(wp) :: depth = 0.0_wp      !! of the given level above the floor [m]
    real(wp) :: celerity = 0.0_wp   !! of long waves [m/s]
    real(wp) :: memory = 0.0_wp     !! time in which the mean velocity follows [s]
    real(wp), allocatable :: c(:, :)          !! liquid share of the last cells [-]
    real(wp), allocatable :: velocity(:, :)   !! outward velocity of the faces [m/s]
    real(wp), allocatable :: mean(:, :)       !! the same, followed slowly; part of the state [m/s]
    real(wp), allocatable :: pressure(:, :)   !! outside, of a face at its mean velocity [Pa]
    real(wp), allocatable :: impulse(:, :)
      !! dt times what a velocity beyond the mean adds to the pressure [kg/m2]
  end type outflow_t

contains

  !> The sides of a grid.
  subroutine outflow_init(grid, fluid, sides)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(outflow_t), intent(out) :: sides(2, 3)
    integer :: s, d, n(2), axis

    do d = 1, 3
      do s = 1, 2
        associate (side => sides(s, d))
          side%along = pack([1, 2, 3], [1, 2, 3] /= d)
          side%active = grid%side(s, d) == side_outflow
          n = merge(grid%n(side%along), 0, side%active)
          allocate (side%c(n(1), n(2)), side%velocity(n(1), n(2)), side%mean(n(1), n(2)), &
                    side%pressure(n(1), n(2)), side%impulse(n(1), n(2)), source=0.0_wp)
          if (.not. side%active .or. .not. any(abs(fluid%gravity) > 0.0_wp)) cycle
          ! Where up is, and how deep the water.
          axis = maxloc(abs(fluid%gravity), 1)
          side%up = findloc(side%along, axis, 1)
          side%upward = fluid%gravity(axis) < 0.0_wp
          side%levelled = is_given(fluid%water_level) .and. .not. fluid%single_phase &
                          .and. side%up > 0
          if (.not. side%levelled) cycle
          side%depth = fluid%water_level - grid%origin(axis)
          if (.not. side%upward) side%depth = grid%length(axis) - side%depth
        end associate
      end do
    end do
  end subroutine outflow_init

  !> The mean velocity of the start is that of the faces. Waves run as over what stands in the last
  !! cells, a bed: H is the mean over the side.
  subroutine start_outflow(grid, fluid, alpha, c, uf, sides)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    real(wp), intent(in), contiguous, dimension(grid%first(1):, grid%first(2):, grid%first(3):) &
      :: alpha, c   !! solid share, C^ [-]
    real(wp), intent(in), contiguous :: uf(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! lower faces [m/s]
    type(outflow_t), intent(inout) :: sides(2, 3)
    real(wp), allocatable :: held(:)   ! share of each layer of cells in the depth
    integer :: s, d, l, axis

    do d = 1, 3
      do s = 1, 2
        associate (side => sides(s, d))
          if (.not. side%active) cycle
          if (side%depth > 0.0_wp) then
            call gather(grid, s, d, alpha, uf, side)
            held = sum(side%c, 3 - side%up)/size(side%c, 3 - side%up)
            if (.not. side%upward) held = held(size(held):1:-1)
            axis = side%along(side%up)
            held = [(held(l)*min(1.0_wp, max(0.0_wp, side%depth/grid%h(axis) - l + 1)), &
                     l=1, size(held))]
            side%celerity = sqrt(abs(fluid%gravity(axis)) &
                                 *max(0.0_wp, side%depth - grid%h(axis)*sum(held)))
            if (side%celerity > 0.0_wp) side%memory = 4.0_wp*grid%length(d)/side%celerity
          end if
          call gather(grid, s, d, c, uf, side)
          side%mean = side%velocity
        end associate
      end do
    end do
  end subroutine start_outflow

  !> Pressure outside for a step of dt, from the liquid of its end and the velocity of its start,
  !! and what a velocity beyond the mean adds to it.
  subroutine update_outflow(grid, fluid, dt, c, uf, sides, resumed)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    real(wp), intent(in) :: dt   !! [s]
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(in), contiguous :: uf(grid%first(1):, grid%first(2):, grid%first(3):, :)
    type(outflow_t), intent(inout) :: sides(2, 3)
    logical, intent(in), optional :: resumed
      !! the step has been, velocity and mean are those that it left; default: no
    integer :: s, d
    logical :: follow

    follow = .true.
    if (present(resumed)) follow = .not. resumed
    do d = 1, 3
      do s = 1, 2
        associate (side => sides(s, d))
          if (.not. side%active) cycle
          call gather(grid, s, d, c, uf, side)
          if (follow .and. side%memory > 0.0_wp) then
            side%mean = side%mean + dt/(side%memory + dt)*side%c*(side%velocity - side%mean)
          end if
          side%impulse = dt*side%c*fluid%liquid_density*side%celerity
          call set_pressure(grid, fluid, side)
        end associate
      end do
    end do
  end subroutine update_outflow

  !> Liquid shares and outward velocities of a side, from the processes that touch it.
  subroutine gather(grid, s, d, c, uf, side)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: s, d
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(in), contiguous :: uf(grid%first(1):, grid%first(2):, grid%first(3):, :)
    type(outflow_t), intent(inout) :: side
    real(wp) :: values(2*size(side%c))
    integer :: lower(3), upper(3), at(3), face(3), i, j, k, m, n

    n = size(side%c)
    values = elsewhere
    call grid%side_cells(s, d, lower, upper)
    do k = lower(3), upper(3)
      do j = lower(2), upper(2)
        do i = lower(1), upper(1)
          at = [i, j, k]
          face = at + merge(0, 1, s == 1)*unit_step(:, d)
          m = at(side%along(1)) + (at(side%along(2)) - 1)*size(side%c, 1)
          values(m) = c(i, j, k)
          values(n + m) = merge(-1.0_wp, 1.0_wp, s == 1)*uf(face(1), face(2), face(3), d)
        end do
      end do
    end do
    call global_max(values)
    side%c = reshape(values(:n), shape(side%c))
    side%velocity = reshape(values(n + 1:), shape(side%c))
  end subroutine gather

  !> Pressure of the columns at rest, less the weight of what stands above the given level.
  pure subroutine set_pressure(grid, fluid, side)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(outflow_t), intent(inout) :: side
    integer :: column

    if (side%up == 0) return   ! no weight: the pressure stays zero
    do column = 1, size(side%c, 3 - side%up)
      if (side%up == 1) then
        call one_column(side%c(:, column), side%pressure(:, column))
      else
        call one_column(side%c(column, :), side%pressure(column, :))
      end if
    end do
  contains
    pure subroutine one_column(c, p)
      real(wp), intent(in) :: c(:)    !! along the vertical axis [-]
      real(wp), intent(out) :: p(:)   !! [Pa]
      real(wp) :: weight, above, head, rise, lean, lean_above, half_jump
      integer :: axis, k, l, up

      axis = side%along(side%up)
      above = 0.0_wp
      head = 0.0_wp
      lean_above = 0.0_wp
      half_jump = 0.5_wp*(fluid%liquid_density - fluid%gas_density)*abs(fluid%gravity(axis)) &
                  *grid%h(axis)
      do l = 1, size(c)
        k = merge(size(c) + 1 - l, l, side%upward)   ! from the top down
        up = merge(1, -1, side%upward)   ! the last cells repeat beyond the ends of the column
        lean = uneven_share(c(k), c(min(max(k - up, 1), size(c))), c(min(max(k + up, 1), size(c))))
        if (l > 1) head = head + half_jump*(lean_above - lean)   ! as `weight_at_faces`
        lean_above = lean
        weight = abs(fluid%gravity(axis))*grid%h(axis) &
                 *(fluid%gas_density + (fluid%liquid_density - fluid%gas_density)*c(k))
        head = head + 0.5_wp*(above + weight)
        above = weight
        p(k) = head
      end do
      if (.not. side%levelled) return
      rise = grid%h(axis)*sum(c) - max(side%depth, 0.0_wp)
      p = p - c*fluid%liquid_density*abs(fluid%gravity(axis))*rise
    end subroutine one_column
  end subroutine set_pressure

  !> Pressure outside the side beside a cell, for a face at its mean velocity [Pa].
  pure function pressure_outside(side, at) result(p)
    type(outflow_t), intent(in) :: side
    integer, intent(in) :: at(3)
    real(wp) :: p

    p = 0.0_wp
    if (side%active) p = side%pressure(at(side%along(1)), at(side%along(2)))
  end function pressure_outside

  !> Mean outward velocity of the side beside a cell; zero where there is none [m/s].
  pure function mean_velocity(side, at) result(u)
    type(outflow_t), intent(in) :: side
    integer, intent(in) :: at(3)
    real(wp) :: u

    u = 0.0_wp
    if (side%active) u = side%mean(at(side%along(1)), at(side%along(2)))
  end function mean_velocity

  !> Length over which the pressure difference of a cell to the outside acts: half a cell, and at an
  !! outflow as much water as the wave takes along [m].
  pure function side_distance(grid, s, d, cell, rho, sides) result(length)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: s, d, cell(3)
    real(wp), intent(in) :: rho   !! of the cell, that of the system [kg/m3]
    type(outflow_t), intent(in), optional :: sides(2, 3)
    real(wp) :: length

    length = 0.5_wp*grid%h(d)
    if (.not. present(sides)) return
    associate (side => sides(s, d))
      if (.not. side%active) return
      length = length + side%impulse(cell(side%along(1)), cell(side%along(2)))/rho
    end associate
  end function side_distance

end module outflow_m
