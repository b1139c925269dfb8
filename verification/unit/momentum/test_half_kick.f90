!> What the transport gets of half a step of weight and pressure, which cells get it, how much
!! momentum that is, and what the cells get after it.
module test_half_kick_m
  use check_m, only: check, wp
  use grid_m, only: n_halo
  use half_kick_m, only: find_liquid, find_first_half, add_first_half, change_where
  use advected_pressure_m, only: advect_pressure
  use mixture_m, only: mix_fluid, mass_through
  use face_velocity_m, only: acceleration_t, acceleration_init, face_acceleration
  use merged_cells_m, only: merged_cells_t
  use one_body_m, only: one_body_t, place, random_field, slip
  implicit none
  private
  public :: test_half_kick

  integer, parameter :: cells(3) = [9, 8, 7]
  real(wp), parameter :: rise(3) = [300.0_wp, -500.0_wp, 700.0_wp]   !! of the pressure [Pa/m]
  integer, parameter :: mixed(3) = [7, 6, 5]                         !! a cell with gas
  real(wp), parameter :: dt = 0.02_wp                                !! [s]
  type(one_body_t) :: box
  type(merged_cells_t) :: merged
  type(acceleration_t) :: a
  real(wp), dimension(1 - n_halo:cells(1) + n_halo, 1 - n_halo:cells(2) + n_halo, &
                      1 - n_halo:cells(3) + n_halo, 3) :: before, kick
  real(wp) :: half(3), expected(3), extrapolated(6, 1) = 0.0_wp
  integer :: i, j, k, seed

contains

  subroutine test_half_kick()
    call place('&grid cells=9,8,7 length=.9,.8,.7/ &shape name="b" kind="box" size=.26,.28,.26/ ' &
               //'&body shape="b" position=.3,.35,.3/ '//slip, box, merged)
    seed = 5
    associate (flow => box%flow, grid => box%grid, fluid => box%case%fluid)
      flow%c(mixed(1), mixed(2), mixed(3)) = 0.5_wp
      call mix_fluid(fluid, flow)
      do concurrent (k=1 - n_halo:cells(3) + n_halo, &
        j=1 - n_halo:cells(2) + n_halo, i=1 - n_halo:cells(1) + n_halo)
        flow%p(i, j, k) = dot_product(rise, 0.1_wp*[i, j, k])
      end do
      call random_field(seed, flow%u)
      flow%liquid = flow%fluid_volume*flow%c
      before = flow%u
      half = 0.5_wp*dt*(fluid%gravity - rise/fluid%liquid_density)
      call acceleration_init(grid, a)
      extrapolated(1:3, 1) = 2*half   ! what the box holds of the liquid gets the same
      call find_liquid(grid, flow, a%kicked)
      call advect_pressure(grid, fluid%liquid_density*fluid%gravity, box%solid%alpha, box%bodies, &
                           dt, a, flow%p)
      call face_acceleration(grid, fluid%gravity, flow%rho, flow%rho, flow%p, a%face, flow%sides)
      call find_first_half(grid, box%solid, merged, box%bodies, extrapolated/dt, flow%rho, a)
      call add_first_half(grid, fluid, dt, a, flow, kick)
      call check('liquid gets half a step', change(7, 3, 2) - half, 0.0_wp, 1.0e-14_wp)
      call check('a cut cell, too', box%solid%alpha(5, 3, 3) > 0.0_wp &
                 .and. maxval(abs(change(5, 3, 3) - half)) < 1.0e-14_wp)
      call check('a small moves as its target', merged%number(4, 5, 3) <= merged%n_small &
                 .and. maxval(abs(change(4, 5, 3) - half)) < 1.0e-14_wp)
      call check('none in the box', change(3, 4, 3), 0.0_wp)
      call check('none at the surface and beside it', &
        maxval([abs(change(7, 6, 5)), abs(change(6, 5, 4)), abs(change(8, 7, 6))]), 0.0_wp)
      do k = 1, cells(3)
        do j = 1, cells(2)
          do i = 1, cells(1)
            expected = change(i, j, k) &
              *mass_through(fluid, flow%fluid_volume(i, j, k), flow%liquid(i, j, k))
            call check('the momentum is told', kick(i, j, k, :), expected, 1.0e-12_wp)
          end do
        end do
      end do
    end associate
    call after_transport()
  end subroutine test_half_kick

  !> Cells in liquid get the other half, all others the whole later; none is left out.
  subroutine after_transport()
    real(wp), parameter :: gain(3) = dt*[7.0_wp, -11.0_wp, 13.0_wp]   !! of the whole [m/s]

    do i = 1, 3
      a%cell(:, :, :, i) = gain(i)/dt
    end do
    before = box%flow%u
    call change_where(box%grid, a%kicked, .true., box%flow%u, 0.5_wp*dt, a%cell)
    call check('liquid: the other half', change(7, 3, 2) - 0.5_wp*gain, 0.0_wp, 1.0e-14_wp)
    call check('not at the surface', maxval([abs(change(7, 6, 5)), abs(change(6, 5, 4))]), 0.0_wp)
    call change_where(box%grid, a%kicked, .false., box%flow%u, dt, a%cell)
    call check('liquid: no more', change(7, 3, 2) - 0.5_wp*gain, 0.0_wp, 1.0e-14_wp)
    call check('the whole at the surface', change(7, 6, 5) - gain, 0.0_wp, 1.0e-14_wp)
    call check('and beside it', change(6, 5, 4) - gain, 0.0_wp, 1.0e-14_wp)
  end subroutine after_transport

  !> How the velocity of a cell has changed [m/s].
  pure function change(i, j, k) result(du)
    integer, intent(in) :: i, j, k
    real(wp) :: du(3)

    du = box%flow%u(i, j, k, :) - before(i, j, k, :)
  end function change

end module test_half_kick_m
