!> The density of the mixture holds the mass of fluid and bodies.
module test_mass_average_m
  use check_m, only: check, wp
  use mass_average_m, only: density_of_mixture
  use one_body_m, only: one_body_t, place, slip
  implicit none
  private
  public :: test_mass_average

  integer, parameter :: n(3) = [13, 11, 12]
  real(wp), parameter :: length(3) = [0.13_wp, 0.11_wp, 0.12_wp]   !! [m]
  type(one_body_t) :: block
  real(wp), allocatable :: mixture(:, :, :)
  real(wp) :: fluid, solid

contains

  subroutine test_mass_average()
    call place('&grid cells=13,11,12 length=.13,.11,.12/ &shape name="h" kind="hexapod" ' &
               //'size=.02/ &body shape="h" position=.0611,.0517,.0564/ '//slip, block)
    allocate (mixture, source=block%flow%rho)
    fluid = block%case%fluid%liquid_density*(product(length) - block%bodies%volume(1))
    call density_of_mixture(block%grid, block%case%fluid, block%solid, block%bodies, &
      block%flow%rho, mixture)
    solid = block%bodies%mass(1)
    call check('fluid and a free body', mass(), fluid + solid, 1.0e-12_wp*fluid)
    call check('no lighter', &
               minval(mixture) >= block%case%fluid%liquid_density*(1.0_wp - 1.0e-15_wp))
    block%bodies%free = .false.
    call density_of_mixture(block%grid, block%case%fluid, block%solid, block%bodies, &
      block%flow%rho, mixture)
    call check('a held body is as good as unmovable', mass() - fluid > 100.0_wp*solid)
  end subroutine test_mass_average

  !> Mass in the tank [kg].
  real(wp) function mass()
    mass = sum(mixture(1:n(1), 1:n(2), 1:n(3)))*block%grid%volume
  end function mass

end module test_mass_average_m
