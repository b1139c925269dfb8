!> What the transport gets of half a step of weight and pressure, which cells get it, and that the
!! momentum they give back is what they got.
program test_mid_step
  use kinds_m, only: wp
  use grid_m, only: n_halo
  use mid_step_m, only: mid_step_t, mid_step_init, to_mid_step, from_mid_step
  use mixture_m, only: mix_fluid
  use momentum_conservative_m, only: mass_through
  use solid_geometry_m, only: solid_geometry_t
  use one_body_m, only: one_body_t, describe, place, random_numbers
  use check_m, only: check, finish_checks
  implicit none
  character(8), parameter :: sides(2, 3) = 'slip'
  integer, parameter :: cells(3) = [9, 8, 7]
  real(wp), parameter :: tank(3) = 0.1_wp*cells                      !! [m]
  real(wp), parameter :: edges(3) = [0.26_wp, 0.28_wp, 0.26_wp]      !! of the box [m]
  real(wp), parameter :: middle(3) = [0.30_wp, 0.35_wp, 0.30_wp]     !! [m]
  real(wp), parameter :: rise(3) = [300.0_wp, -500.0_wp, 700.0_wp]   !! of the pressure [Pa/m]
  integer, parameter :: mixed(3) = [7, 6, 5]                         !! a cell with gas
  real(wp), parameter :: dt = 0.02_wp                                !! [s]
  type(one_body_t) :: box
  type(solid_geometry_t) :: later
  real(wp), dimension(1 - n_halo:cells(1) + n_halo, 1 - n_halo:cells(2) + n_halo, &
                      1 - n_halo:cells(3) + n_halo, 3) :: before
  type(mid_step_t) :: mid_step
  real(wp) :: half(3), momentum(3)
  integer :: i, j, k, seed

  call describe(cells, tank, sides, 'box', edges, middle, box%case)
  call place(box)
  seed = 5
  associate (flow => box%flow, grid => box%grid, fluid => box%case%fluid)
    flow%c(mixed(1), mixed(2), mixed(3)) = 0.5_wp
    call mix_fluid(fluid, flow)
    do k = 1 - n_halo, cells(3) + n_halo
      do j = 1 - n_halo, cells(2) + n_halo
        do i = 1 - n_halo, cells(1) + n_halo
          flow%p(i, j, k) = dot_product(rise, 0.1_wp*[i, j, k])
          call random_numbers(seed, flow%u(i, j, k, :))
        end do
      end do
    end do
    flow%room = grid%volume*(1.0_wp - box%solid%alpha)
    flow%liquid = flow%room*flow%c
    later = box%solid
    later%alpha(7, 2, 2) = 0.6_wp
    before = flow%u
    half = 0.5_wp*dt*(fluid%gravity - rise/fluid%liquid_density)
    call mid_step_init(grid, mid_step)
    call to_mid_step(grid, fluid, box%solid, later, dt, flow, mid_step)
    call check('liquid gets half a step', maxval(abs(change(7, 3, 2) - half)), 0.0_wp, 1.0e-14_wp)
    call check('a cell of which less than half is solid, too', &
               box%solid%alpha(5, 3, 3) > 0.0_wp .and. box%solid%alpha(5, 3, 3) < 0.5_wp &
               .and. maxval(abs(change(5, 3, 3) - half)) < 1.0e-14_wp)
    call check('none where more is solid at the start', box%solid%alpha(3, 3, 3) > 0.5_wp &
               .and. maxval(abs(change(3, 3, 3))) <= 0.0_wp)
    call check('none where more is solid at the end', maxval(abs(change(7, 2, 2))), 0.0_wp, 0.0_wp)
    call check('none at the surface and beside it', &
               maxval([abs(change(7, 6, 5)), abs(change(6, 5, 4)), abs(change(8, 7, 6))]), 0.0_wp, &
               0.0_wp)
    flow%room(7, 3, 2) = 0.8_wp*grid%volume   ! a block comes nearer
    flow%liquid(7, 3, 2) = flow%room(7, 3, 2)
    momentum = mass_through(fluid, flow%room(7, 3, 2), flow%liquid(7, 3, 2))*flow%u(7, 3, 2, :) &
               - fluid%liquid_density*grid%volume*half
    call from_mid_step(grid, fluid, mid_step, flow)
    call check('the momentum comes back, whatever the mass', &
               maxval(abs(0.8_wp*fluid%liquid_density*grid%volume*flow%u(7, 3, 2, :) - momentum)), &
               0.0_wp, 1.0e-13_wp)
    flow%u(7, 3, 2, :) = before(7, 3, 2, :)
    call check('elsewhere nothing is left', maxval(abs(flow%u(1:cells(1), 1:cells(2), &
      1:cells(3), :) - before(1:cells(1), 1:cells(2), 1:cells(3), :))), 0.0_wp, 1.0e-14_wp)
  end associate
  call finish_checks()

contains

  !> How the velocity of a cell has changed [m/s].
  pure function change(i, j, k) result(du)
    integer, intent(in) :: i, j, k
    real(wp) :: du(3)

    du = box%flow%u(i, j, k, :) - before(i, j, k, :)
  end function change
end program test_mid_step
