!> What lies outside an outflow: columns at rest, the level, the part that yields to a wave.
module test_outflow_m
  use check_m, only: check, wp
  use case_types_m, only: case_t, fluid_t
  use case_text_m, only: case_of
  use grid_m, only: grid_t, grid_init
  use fields_m, only: flow_t, flow_init
  use outflow_m, only: outflow_init, start_outflow, update_outflow, side_distance, &
    pressure_outside, mean_velocity
  implicit none
  private
  public :: test_outflow

  real(wp), parameter :: g = 10.0_wp, rho_l = 1000.0_wp, rho_g = 2.0_wp, dt = 0.02_wp
  type(grid_t) :: grid
  type(flow_t) :: flow
  type(fluid_t) :: fluid

contains

  subroutine test_outflow()
    call columns()
    call level_and_wave()
    call mean_follows()
    call upside_down()
    call no_level()
  end subroutine test_outflow

  !> 4 x 3 x 5 cells of 1 x 2 x 0.1 m with an outflow at x_max; liquid up to 0.25 m.
  subroutine make(gravity, single_phase)
    real(wp), intent(in) :: gravity(3)
    logical, intent(in) :: single_phase
    type(case_t) :: case

    case = case_of('&grid cells=4,3,5 length=4,6,.5 origin=0,0,.05/ &boundary x_max="outflow"/ ' &
      //'&fluid water_level=.3 liquid_density=1000 gas_density=2/')
    fluid = case%fluid
    fluid%gravity = gravity
    fluid%single_phase = single_phase
    call grid_init(case%grid, case%boundary, grid)
    call flow_init(grid, flow)
    flow%c = 0.0_wp
    flow%c(:, :, 1:2) = 1.0_wp
    flow%c(:, :, 3) = 0.5_wp
    if (single_phase) flow%c = 1.0_wp
    call outflow_init(grid, fluid, flow%sides)
    call start_outflow(grid, fluid, 0*flow%c, flow%c, flow%uf, flow%sides)
  end subroutine make

  subroutine update()
    call update_outflow(grid, fluid, dt, flow%c, flow%uf, flow%sides)
  end subroutine update

  !> At the level: hydrostatic, half a cell of gas at the top, then means of two weights; the cell
  !! of the surface has the mean of the true pressure over its height.
  subroutine columns()
    real(wp) :: weight(5), p
    integer :: k

    call make([0.0_wp, 0.0_wp, -g], .false.)
    call update()
    weight = g*0.1_wp*[rho_l, rho_l, 0.5_wp*(rho_l + rho_g), rho_g, rho_g]
    p = 0.5_wp*weight(5)
    do k = 5, 1, -1
      if (k < 5) p = p + 0.5_wp*(weight(k) + weight(min(k + 1, 5)))
      if (k == 3) then
        call check('mean in the surface cell', pressure_outside(flow%sides(2, 1), [5, 2, k]), &
                   weight(4) + weight(5) + g*0.1_wp*(3.0_wp*rho_g + rho_l)/8.0_wp, 1.0e-10_wp)
        cycle
      end if
      call check('column at rest', pressure_outside(flow%sides(2, 1), [5, 2, k]), p, 1.0e-10_wp)
    end do
    call check('other sides', pressure_outside(flow%sides(1, 1), [0, 2, 1]), 0.0_wp)
    call check('speed of long waves', flow%sides(2, 1)%celerity, sqrt(g*0.25_wp), 1.0e-14_wp)
    flow%p = 0.0_wp   ! a bed: one of three columns up to 0.1 m, and the others up to 0.05 m
    flow%p(4, :, 1) = 0.5_wp
    flow%p(4, 2, 1) = 1.0_wp
    call start_outflow(grid, fluid, flow%p, flow%c, flow%uf, flow%sides)
    call check('over a bed', flow%sides(2, 1)%celerity, sqrt(g*(0.25_wp - 0.2_wp/3)), 1.0e-14_wp)
  end subroutine columns

  !> One column stands 0.05 m higher: its liquid cells lack the weight of 0.05 m; a wave meets the
  !! resistance rho c of the liquid share.
  subroutine level_and_wave()
    real(wp) :: at_rest, c

    call make([0.0_wp, 0.0_wp, -g], .false.)
    call update()
    at_rest = pressure_outside(flow%sides(2, 1), [5, 3, 1])
    flow%c(4, 3, 3) = 1.0_wp
    call update()
    call check('higher column', pressure_outside(flow%sides(2, 1), [5, 3, 1]), &
               at_rest + g*0.05_wp*(rho_l - rho_g) - g*0.05_wp*rho_l, 1.0e-9_wp)
    c = sqrt(g*0.25_wp)
    call check('distance in liquid', side_distance(grid, 2, 1, [4, 3, 1], rho_l, flow%sides), &
               0.5_wp + c*dt, 1.0e-14_wp)
    call check('distance in a mixed cell', side_distance(grid, 2, 1, [4, 1, 3], &
               501.0_wp, flow%sides), 0.5_wp + 0.5_wp*rho_l*c*dt/501.0_wp, 1.0e-14_wp)
    call check('in gas', side_distance(grid, 2, 1, [4, 3, 5], rho_g, flow%sides), 0.5_wp)
    call check('elsewhere', side_distance(grid, 1, 1, [1, 3, 1], rho_l, flow%sides), 0.5_wp)
  end subroutine level_and_wave

  !> The mean velocity starts from that of the faces and follows it in 4 L/c where there is liquid.
  subroutine mean_follows()
    real(wp) :: t

    call make([0.0_wp, 0.0_wp, -g], .false.)
    flow%uf(5, :, :, 1) = 0.3_wp
    call start_outflow(grid, fluid, 0*flow%c, flow%c, flow%uf, flow%sides)
    flow%uf(5, :, :, 1) = 0.7_wp
    call update()
    t = 4.0_wp*4.0_wp/sqrt(g*0.25_wp)
    call check('mean of liquid', mean_velocity(flow%sides(2, 1), [4, 1, 1]), &
               0.3_wp + 0.4_wp*dt/(t + dt), 1.0e-14_wp)
    call check('mean of gas', mean_velocity(flow%sides(2, 1), [4, 1, 5]), 0.3_wp)
  end subroutine mean_follows

  !> Gravity along +y: the floor is y_max, the vertical is the other direction of the side.
  subroutine upside_down()
    call make([0.0_wp, g, 0.0_wp], .false.)
    flow%c = 0.0_wp
    flow%c(:, 3, :) = 1.0_wp
    fluid%water_level = 4.0_wp
    call outflow_init(grid, fluid, flow%sides)
    call start_outflow(grid, fluid, 0*flow%c, flow%c, flow%uf, flow%sides)
    call update()
    call check('upside down: bottom', pressure_outside(flow%sides(2, 1), [5, 3, 4]), &
               g*(2.0_wp*rho_g + 2.0_wp*rho_g + rho_l), 1.0e-9_wp)
    call check('turned: top', pressure_outside(flow%sides(2, 1), [5, 1, 4]), g*rho_g, 1.0e-9_wp)
    call check('upside down: speed of waves', flow%sides(2, 1)%celerity, sqrt(g*2.0_wp), 1.0e-14_wp)
  end subroutine upside_down

  !> Full of liquid there is no level: weight only, no waves.
  subroutine no_level()
    call make([0.0_wp, 0.0_wp, -g], .true.)
    call update()
    call check('bottom', pressure_outside(flow%sides(2, 1), [5, 1, 1]), 0.45_wp*g*rho_l, 1.0e-9_wp)
    call check('distance', side_distance(grid, 2, 1, [4, 3, 1], rho_l, flow%sides), 0.5_wp)
  end subroutine no_level

end module test_outflow_m
