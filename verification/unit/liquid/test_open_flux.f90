!> Volumes through the faces that fit a moving body, in every cell of the narrow band around it.
module test_open_flux_m
  use check_m, only: check, wp
  use boundary_kinds_m, only: side_slip
  use grid_m, only: grid_t
  use fields_m, only: flow_t, flow_init
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use elliptic_solver_m, only: elliptic_solver_t, elliptic_solver_init
  use narrow_band_m, only: narrow_band_init
  use open_flux_m, only: open_flux_t, flux_of_velocity, fit_to_bodies
  use random_counter_m, only: uniform
  use box_solid_m, only: simple_grid, set_boxes
  implicit none
  private
  public :: test_open_flux

  real(wp), parameter :: low(3) = [0.23_wp, 0.22_wp, 0.51_wp], high(3) = [0.55_wp, 0.51_wp, 0.86_wp]
  real(wp), parameter :: move(3) = [0.03_wp, -0.02_wp, 0.015_wp]   !! of the body in the step [m]
  real(wp), parameter :: dt = 0.01_wp
  type(grid_t) :: grid
  type(flow_t) :: flow
  type(solid_geometry_t) :: old, new
  type(open_flux_t) :: flux
  type(elliptic_solver_t) :: solver
  real(wp), allocatable :: q(:, :, :, :)

contains

  subroutine test_open_flux()
    call start(.false.)
    call find_flux(new)
    call check('tank: solved', flux%iterations > 0 .and. flux%residual <= 1.0e-12_wp)
    call check('tank: few iterations', flux%iterations <= 10)   ! 9
    call check('tank: one part', flux%band%parts, 1)
    call check('tank: balance of the band', imbalance(1, 10, 0.0_wp), 0.0_wp, 2.0e-12_wp)
    call check('tank: flux elsewhere', q(2, 9, 9, 1), dt*grid%area(1)*flow%uf(2, 9, 9, 1))
    call check('tank: none through walls', q(1, 1:9, 1:10, 1), 0.0_wp)

    call start(.true.)
    call find_flux(new)
    call check('closed: told', flux%unmatched > 1.0e-3_wp)
    call check('closed: two parts', flux%band%parts, 2)
    call check('closed: the lower one balances', imbalance(1, 5, 0.0_wp), 0.0_wp, 2.0e-12_wp)
    call check('closed: the upper one shares', imbalance(6, 10, flux%unmatched), 0.0_wp, 2.0e-12_wp)

    call start(.false.)
    call stand_on_floor()
    call find_flux(new)
    call check('stopped by the floor: told', flux%unmatched, 0.0_wp)
    call check('stopped by the floor: all is the band', all(flux%band%marked(1:8, 1:9, 1:10) == 1))
    call check('stopped by the floor: balance', imbalance(1, 10, 0.0_wp), 0.0_wp, 2.0e-12_wp)
    call check('on the floor: out on top', sum(q(1:8, 1:9, 11, 3)), -0.01_wp*0.25_wp, 1.0e-12_wp)

    call start(.false.)
    call stand_on_floor()
    grid%side = side_slip
    new = old
    flow%fluid_volume = (1.0_wp + 1.0e-4_wp)*flow%fluid_volume
    call find_flux(new)
    call check('no way out: told', flux%unmatched, 1.0e-4_wp, 1.0e-12_wp)
    call check('no way out: the rest is left alone', any(flux%band%marked(1:8, 1:9, 1:10) == 0))

    call start(.true.)
    call set_boxes(grid, [0.15_wp, -1.0_wp, -1.0_wp], [0.65_wp, 2.0_wp, 2.0_wp], old)
    call find_flux(old)
    call check('side by side: two parts', flux%band%parts, 2)
    associate (x => flux%band%cell(1, :), first => flux%band%first)
      call check('side by side: the left one', all(x(1:first(2) - 1) <= 2))
      call check('side by side: the right one', all(x(first(2):first(3) - 1) >= 7))
    end associate
  end subroutine test_open_flux

  !> Volumes through the faces in the step that ends with these bodies.
  subroutine find_flux(after)
    type(solid_geometry_t), intent(in) :: after

    call flux_of_velocity(grid, old, after, flow%uf, dt, q)
    call fit_to_bodies(grid, old, after, flow%fluid_volume, solver, flux, q)
  end subroutine find_flux

  !> A box on the floor whose top sinks by 0.01 m, in fluid at rest.
  subroutine stand_on_floor()
    call set_boxes(grid, [0.1_wp, 0.2_wp, -1.0_wp], [0.6_wp, 0.7_wp, 0.46_wp], old)
    call set_boxes(grid, [0.1_wp, 0.2_wp, -1.0_wp], [0.6_wp, 0.7_wp, 0.45_wp], new)
    flow%fluid_volume = grid%volume*(1.0_wp - old%alpha)
    flow%uf = 0.0_wp
  end subroutine stand_on_floor

  !> A box near the open top in any flow; or a plate across a closed tank whose upper side rises.
  subroutine start(closed)
    logical, intent(in) :: closed
    integer :: i, j, k, d

    call simple_grid([8, 9, 10], [0.8_wp, 0.9_wp, 1.0_wp], grid)
    if (closed) grid%side = side_slip
    call flow_init(grid, flow)
    call solid_geometry_init(grid, old)
    call solid_geometry_init(grid, new)
    if (closed) then
      call set_boxes(grid, [-1.0_wp, -1.0_wp, 0.15_wp], [2.0_wp, 2.0_wp, 0.85_wp], old)
      call set_boxes(grid, [-1.0_wp, -1.0_wp, 0.15_wp], [2.0_wp, 2.0_wp, 0.86_wp], new)
    else
      call set_boxes(grid, low, high, old)
      call set_boxes(grid, low + move, high + move, new)
    end if
    call narrow_band_init(grid, flux%band)
    call elliptic_solver_init(grid, solver)
    flow%fluid_volume = grid%volume*(1.0_wp - old%alpha)
    do concurrent (d=1:3, k=1:11, j=1:10, i=1:9)
      if (.not. closed) flow%uf(i, j, k, d) = uniform(d, i, j + 20*k) - 0.5_wp
    end do
    if (allocated(q)) deallocate (q)
    allocate (q, source=flow%uf)
  end subroutine start

  !> Largest error of the layers first..last of the band: outflow against the change of room, less
  !! what stays, a share of the open volume [V].
  real(wp) function imbalance(first, last, share)
    integer, intent(in) :: first, last
    real(wp), intent(in) :: share

    associate (a => first, b => last, open => 1.0_wp - new%alpha(1:8, 1:9, first:last), &
               room => flow%fluid_volume(1:8, 1:9, first:last))
      imbalance = maxval(abs((room - q(2:9, 1:9, a:b, 1) + q(1:8, 1:9, a:b, 1) &
        - q(1:8, 2:10, a:b, 2) + q(1:8, 1:9, a:b, 2) &
        - q(1:8, 1:9, a + 1:b + 1, 3) + q(1:8, 1:9, a:b, 3))/grid%volume &
        - (1.0_wp + share)*open), flux%band%number(1:8, 1:9, a:b) > 0)
    end associate
  end function imbalance

end module test_open_flux_m
