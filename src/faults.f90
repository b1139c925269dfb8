!> What can go wrong in the numbers of a run, found and named after each step.
module faults_m
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use kinds_m, only: wp
  use vectors_m, only: norm, norms
  use errors_m, only: exit_ok, exit_numerics, to_text, brief
  use grid_m, only: grid_t
  use boundary_kinds_m, only: is_wall
  use simulation_m, only: simulation_t
  use courant_m, only: courant_rate_t, courant_rate
  use diagnostics_m, only: step_report_t
  use deep_overlaps_m, only: overlap_fault
  implicit none
  private
  public :: fault_t, store_places, find_fault, set_fault

  type :: fault_t
    integer :: code = exit_ok
    character(:), allocatable :: message
    real(wp), allocatable, private :: place(:, :)   !! (3, n) of the blocks before the step [m]
    real(wp), allocatable, private :: speed(:)      !! (n) of theirs [m/s]
    logical, allocatable, private :: there(:)       !! (n) were they in the tank?
  end type fault_t

  !> A step that carries fluid through so many cells does not follow it: the water of a dam break
  !! in steps of 18 cells still had its energy, in steps of 400 eight times as much.
  real(wp), parameter :: highest_courant = 50.0_wp

  real(wp), parameter :: excess_max = 0.1_wp   !! energy made, over that set free

contains

  !> Where the blocks are and how fast; call it before the first step, `find_fault` does it later.
  subroutine store_places(sim, fault)
    type(simulation_t), intent(in) :: sim
    type(fault_t), intent(inout) :: fault

    fault%place = sim%blocks%x(:, :sim%blocks%n)
    fault%speed = norms(sim%blocks%v(:, :sim%blocks%n))
    fault%there = sim%blocks%present
  end subroutine store_places

  !> The first fault of the step that just ended, if there is one. All processes call.
  subroutine find_fault(sim, report, fault)
    type(simulation_t), intent(in) :: sim
    type(step_report_t), intent(in) :: report
    type(fault_t), intent(inout) :: fault
    character(:), allocatable :: overlap
    type(courant_rate_t) :: rate
    real(wp) :: courant

    if (.not. sim%start_converged) call set_fault(sim, &
      'the flow at the start or at a release did not converge', fault)
    if (report%contact%info /= 0) call set_fault(sim, 'a step would need more than a million ' &
      //'body steps: blocks are too fast, or `contact_time` or `substep_ratio` too small', fault)
    if (sim%wet) then
      if (.not. sim%transport%liquid%small%converged) call set_fault(sim, &
        'what small cells of the transport give did not converge', fault)
      if (.not. sim%coupling%viscous%converged) call set_fault(sim, &
        'the viscous stage did not converge', fault)
      if (.not. report%pressure%converged) call set_fault(sim, 'divergence ' &
        //to_text(report%pressure%divergence)//' 1/s after '//to_text(report%pressure%passes) &
        //' passes: above `divergence_tolerance`', fault)
    end if
    if (sim%energy%known) then   ! else the excess is NaN
      if (report%energy_excess > excess_max) call set_fault(sim, 'fluid and blocks have ' &
        //brief(100.0_wp*report%energy_excess, 3)//' % more energy than was put in, of what was ' &
        //'set free: &run dt or cfl_max is too long for this flow', fault)
    end if
    overlap = overlap_fault(sim%deep)
    if (len(overlap) > 0) call set_fault(sim, overlap, fault)
    call look_at_blocks(sim, fault)
    if (.not. sim%wet) return
    call look_for_jumps(sim, fault)
    call store_places(sim, fault)
    if (sim%case%run%cfl_max > 0.0_wp .and. sim%case%run%cfl_max <= highest_courant) return
    rate = courant_rate(sim%grid, sim%flow, sim%solid, sim%blocks)   ! nothing shortens the step
    courant = sim%clock%dt*max(rate%carried, rate%followed)
    if (.not. courant <= highest_courant) call set_fault(sim, 'Courant number '//brief(courant) &
      //', above '//brief(highest_courant)//': &run dt is too long for this flow, and cfl_max' &
      //' lets it', fault)
  end subroutine find_fault

  !> A block moves as far as its speeds at both ends of the step and its weight let it; a cell more
  !! is a fault.
  subroutine look_for_jumps(sim, fault)
    type(simulation_t), intent(in) :: sim
    type(fault_t), intent(inout) :: fault
    real(wp) :: moved, explained
    integer :: b

    do b = 1, sim%blocks%n
      if (.not. fault%there(b) .or. sim%blocks%fixed(b)) cycle
      associate (dt => sim%clock%dt, v => norm(sim%blocks%v(:, b)))
        moved = norm(sim%blocks%x(:, b) - fault%place(:, b))
        explained = dt*(fault%speed(b) + v + dt*norm(sim%case%fluid%gravity)) &
          + sim%grid%min_spacing()
        if (moved > explained) call set_fault(sim, 'body '//to_text(b)//' jumped '//brief(moved) &
          //' m in a step of '//brief(dt)//' s, though its speed is '//brief(v) &
          //' m/s: its mass of '//brief(sim%blocks%mass(b))//' kg is too small for &run dt', fault)
      end associate
    end do
  end subroutine look_for_jumps

  !> Every block must have a place that is a number, inside the tank.
  subroutine look_at_blocks(sim, fault)
    type(simulation_t), intent(in) :: sim
    type(fault_t), intent(inout) :: fault
    integer :: b

    do b = 1, sim%blocks%n
      if (.not. sim%blocks%present(b)) cycle
      associate (x => sim%blocks%x(:, b))
        if (.not. all(ieee_is_finite(x)) .or. .not. all(ieee_is_finite(sim%blocks%v(:, b)))) then
          call set_fault(sim, 'body '//to_text(b)//': its place or speed is not a number', fault)
        else if (has_left(sim%grid, sim%case%fluid%gravity, x, sim%blocks%v(:, b))) then
          call set_fault(sim, 'body '//to_text(b)//' left the tank at ('//to_text(x)//') m', fault)
        end if
      end associate
    end do
  end subroutine look_at_blocks

  !> Is a centre of mass behind a wall? One behind an open side is out (`release_m`), but that above
  !! an open top falls back, unless it rises by more than the height of the tank.
  pure function has_left(grid, gravity, x, v) result(left)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: gravity(3), x(3)
    real(wp), intent(in) :: v(3)   !! [m/s]
    logical :: left
    real(wp) :: beyond
    integer :: d, s

    left = .false.
    do d = 1, 3
      do s = 1, 2
        if (grid%periodic(d)) cycle
        if (grid%is_exit(gravity, s, d)) cycle
        beyond = merge(grid%origin(d) - x(d), x(d) - grid%origin(d) - grid%length(d), s == 1)
        if (.not. is_wall(grid%side(s, d))) then   ! the top
          beyond = beyond - grid%length(d)
          if (merge(-v(d), v(d), s == 1) <= 0.0_wp) beyond = 0.0_wp
        end if
        left = left .or. beyond > 0.0_wp
      end do
    end do
  end function has_left

  !> Keep the first fault, with its time and step.
  subroutine set_fault(sim, what, fault)
    type(simulation_t), intent(in) :: sim
    character(*), intent(in) :: what
    type(fault_t), intent(inout) :: fault

    if (fault%code /= exit_ok) return
    fault%code = exit_numerics
    fault%message = 't = '//brief(sim%clock%t, 7)//' s, step '//to_text(sim%clock%step)//': '//what
  end subroutine set_fault

end module faults_m
