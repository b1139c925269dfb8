!> Density and viscosity of the fluid by its liquid share, and the two means on faces.
module test_mixture_m
  use check_m, only: check, wp
  use case_types_m, only: fluid_t
  use grid_m, only: grid_t, n_halo
  use fields_m, only: flow_t, flow_init
  use mixture_m, only: mix_fluid, face_mean, harmonic_mean
  use box_solid_m, only: simple_grid
  implicit none
  private
  public :: test_mixture

  type(grid_t) :: grid
  type(flow_t) :: flow
  type(fluid_t) :: fluid
  real(wp), parameter :: a = 1.82e-5_wp, b = 1.002e-3_wp, u_low = 0.3_wp, u_high = 1.1_wp
  real(wp) :: u_between

contains

  subroutine test_mixture()
    call simple_grid([2, 3, 4], [0.1_wp, 0.1_wp, 0.1_wp], grid)
    call flow_init(grid, flow)
    fluid%liquid_density = 1000.0_wp
    fluid%gas_density = 2.0_wp
    fluid%liquid_viscosity = 8.0e-3_wp
    fluid%gas_viscosity = 4.0e-4_wp
    flow%c(1, 1, 1) = 1.0_wp
    flow%c(2, 3, 4) = 0.25_wp
    flow%c(1 - n_halo, 3 + n_halo, 1) = 1.0_wp
    call mix_fluid(fluid, flow)
    call check('liquid', [flow%rho(1, 1, 1), flow%mu(1, 1, 1)], [1000.0_wp, 8.0e-3_wp], 1.0e-12_wp)
    call check('gas', [flow%rho(1, 2, 1), flow%mu(1, 2, 1)], [2.0_wp, 4.0e-4_wp])
    call check('a quarter of liquid: density', flow%rho(2, 3, 4), 251.5_wp, 1.0e-12_wp)
    call check('a quarter of liquid: viscosity', flow%mu(2, 3, 4), 2.3e-3_wp, 1.0e-17_wp)
    call check('halo too', flow%rho(1 - n_halo, 3 + n_halo, 1), 1000.0_wp, 1.0e-12_wp)

    call check('density on a face', face_mean(1.0_wp, 4.0_wp), 2.5_wp)
    call check('1/rho is the harmonic mean', 1.0_wp/face_mean(1.0_wp, 4.0_wp), &
               harmonic_mean(1.0_wp, 0.25_wp), 1.0e-16_wp)
    call check('equal viscosities stay', harmonic_mean(b, b), b, 1.0e-18_wp)
    ! Velocity at the jump, halfway, where the stresses of both sides agree.
    u_between = (a*u_low + b*u_high)/(a + b)
    call check('stress is continuous: below', 2.0_wp*a*(u_between - u_low), &
               harmonic_mean(a, b)*(u_high - u_low), 1.0e-18_wp)
    call check('stress is continuous: above', 2.0_wp*b*(u_high - u_between), &
               harmonic_mean(a, b)*(u_high - u_low), 1.0e-18_wp)
  end subroutine test_mixture

end module test_mixture_m
