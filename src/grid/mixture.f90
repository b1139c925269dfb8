!> Density and viscosity of the fluid from its liquid share, and their values on the faces.
module mixture_m
  use kinds_m, only: wp
  use case_types_m, only: fluid_t
  use fields_m, only: flow_t
  implicit none
  private
  public :: mix_fluid, mass_through, face_mean, harmonic_mean, pure_share

  !> Liquid shares this close to 0 or 1 are those of one phase: the transport leaves shares off by
  !! its round-off and by what it clips, some 1e-7 of a cell, all through water and air, and a
  !! surface there would be made of noise. What such a cell holds still counts in full; only the
  !! place of its surface is not asked for.
  real(wp), parameter :: pure_share = 1.0e-6_wp

contains

  !> Density and viscosity of the fluid in every cell, halo included:
  !! $$ \rho = \rho_g + (\rho_l - \rho_g) C, \quad \mu = \mu_g + (\mu_l - \mu_g) C $$
  !!
  !! C is the liquid share of the *fluid* (`flow%c`, extended through bodies), never of the mixture
  !! with the solid: gravity acts on the fluid alone, weight acts on the bodies in their own
  !! equations.
  subroutine mix_fluid(fluid, flow)
    type(fluid_t), intent(in) :: fluid
    type(flow_t), intent(inout) :: flow
    integer :: k

    !$omp parallel do schedule(static)
    do k = lbound(flow%c, 3), ubound(flow%c, 3)
      flow%rho(:, :, k) = fluid%gas_density &
                          + (fluid%liquid_density - fluid%gas_density)*flow%c(:, :, k)
      flow%mu(:, :, k) = fluid%gas_viscosity &
                         + (fluid%liquid_viscosity - fluid%gas_viscosity)*flow%c(:, :, k)
    end do
  end subroutine mix_fluid

  !> Mass of a volume of which a part is liquid [kg].
  elemental function mass_through(fluid, volume, liquid) result(mass)
    type(fluid_t), intent(in) :: fluid
    real(wp), intent(in) :: volume, liquid   !! [m3]
    real(wp) :: mass

    mass = fluid%liquid_density*liquid + fluid%gas_density*(volume - liquid)
  end function mass_through

  !> Density on a face: arithmetic mean, which makes 1/rho the harmonic mean of the paper's C-HSMAC.
  elemental function face_mean(a, b) result(m)
    real(wp), intent(in) :: a, b
    real(wp) :: m

    m = 0.5_wp*(a + b)
  end function face_mean

  !> Viscosity on the link between two cells: continuous stress across a jump halfway, none between
  !! two fluids without.
  elemental function harmonic_mean(a, b) result(m)
    real(wp), intent(in) :: a, b
    real(wp) :: m

    m = 2.0_wp*a*b/max(a + b, tiny(a))
  end function harmonic_mean

end module mixture_m
