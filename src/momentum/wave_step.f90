!> The longest step for the shortest waves of a grid: surface and its stress move explicitly.
module wave_step_m
  use kinds_m, only: wp, pi
  use vectors_m, only: norm
  use case_types_m, only: fluid_t
  implicit none
  private
  public :: gravity_step, capillary_step, viscous_step

contains

  !> Longest step with waves under gravity [s]; huge where nothing drives them.
  !!
  !! $$ \Delta t = \sqrt{\frac{h}{g} \frac{\rho_l + \rho_g}{|\rho_l - \rho_g|}} $$
  !! Differences over two cells make of the shortest wave one of k = 2/h, along a diagonal of the
  !! surface 2 sqrt(2)/h. It grows where omega dt > 2: from 1.19 times this step on.
  pure function gravity_step(fluid, h) result(dt)
    type(fluid_t), intent(in) :: fluid
    real(wp), intent(in) :: h   !! smallest spacing of the cells [m]
    real(wp) :: dt
    real(wp) :: drive

    dt = huge(1.0_wp)
    if (fluid%single_phase) return
    drive = norm(fluid%gravity)*abs(fluid%liquid_density - fluid%gas_density)
    if (drive > 0.0_wp) dt = sqrt(h*(fluid%liquid_density + fluid%gas_density)/drive)
  end function gravity_step

  !> Longest step with surface tension [s]; huge without.
  !!
  !! $$ \Delta t = \sqrt{(\rho_l + \rho_g) h^3/(4\pi\sigma)} $$
  !! The shortest wave of the grid must not pass a cell in a step (Brackbill, Kothe, Zemach,
  !! J. Comput. Phys. 100, 1992).
  pure function capillary_step(fluid, h) result(dt)
    type(fluid_t), intent(in) :: fluid
    real(wp), intent(in) :: h   !! smallest spacing of the cells [m]
    real(wp) :: dt

    dt = huge(1.0_wp)
    if (fluid%single_phase .or. fluid%surface_tension <= 0.0_wp) return
    dt = sqrt((fluid%liquid_density + fluid%gas_density)*h**3/(4.0_wp*pi*fluid%surface_tension))
  end function capillary_step

  !> Longest step with `surface_stress` of unlike fluids [s]; huge in one fluid.
  !!
  !! $$ \Delta t = 2\,\Big(\nu \sum_d 1/h_d^2\Big)^{-1}, \qquad \nu = |\mu_l - \mu_g|/\rho $$
  !! with the density of the more viscous one. At 1.5 times this step the shortest waves begin to
  !! grow, slowly: the explicit stress of such waves is somewhat larger than the implicit one.
  pure function viscous_step(fluid, inverse_h2) result(dt)
    type(fluid_t), intent(in) :: fluid
    real(wp), intent(in) :: inverse_h2   !! sum of 1/h**2 over directions of several cells [1/m2]
    real(wp) :: dt
    real(wp) :: drive

    dt = huge(1.0_wp)
    if (fluid%single_phase) return
    drive = inverse_h2*abs(fluid%liquid_viscosity - fluid%gas_viscosity) &
      /merge(fluid%liquid_density, fluid%gas_density, fluid%liquid_viscosity > fluid%gas_viscosity)
    if (drive > 0.0_wp) dt = 2.0_wp/drive
  end function viscous_step

end module wave_step_m
