!> Sums over the fluid in a row of results: what a cell holds counts, not what its level tells.
module test_diagnostics_m
  use check_m, only: check, wp
  use case_types_m, only: case_t
  use world_m, only: world_t, set_up
  use diagnostics_m, only: step_report_t, quantity_t, make_row, value_of, measure_fluid, &
    energy_of_level
  implicit none
  private
  public :: test_diagnostics

  real(wp), parameter :: volume = 0.1_wp*0.2_wp*0.25_wp   !! of a cell [m3]
  type(case_t) :: case
  type(world_t) :: state
  type(step_report_t) :: report
  type(quantity_t), allocatable :: row(:)
  real(wp) :: mass

contains

  subroutine test_diagnostics()
    call set_up('&grid cells=3*4 length=.4,.8,1/ &fluid water_level=.5/', state)
    case = state%case
    state%flow%c = 1.0_wp      ! all of it under water,
    state%flow%liquid = 0.0_wp   ! as far as the surface around tells
    state%flow%rho = case%fluid%liquid_density
    state%flow%liquid(1:4, 1:4, 1:2) = volume
    state%flow%fluid_volume = volume
    call look()
    call check('liquid', of('liquid_volume'), 32*volume, 1.0e-15_wp)
    call check('no excess', of('volume_excess_max'), 0.0_wp, 1.0e-15_wp)
    call check('at rest', of('kinetic_energy_fluid'), 0.0_wp)

    state%flow%u(2, 2, 2, :) = [1.0_wp, -2.0_wp, 2.0_wp]   ! a cell of liquid
    call look()
    mass = case%fluid%liquid_density*volume
    call check('liquid that moves', of('kinetic_energy_fluid'), 0.5_wp*mass*9, 1.0e-12_wp*mass)

    state%flow%u = 0.0_wp
    state%solid%alpha(3, 2, 3) = 0.75_wp                   ! gas in a cut cell under water
    state%flow%u(3, 2, 3, :) = [0.0_wp, 0.0_wp, 80.0_wp]
    call look()
    mass = case%fluid%gas_density*0.25_wp*volume
    call check('gas in a cut cell', of('kinetic_energy_fluid'), 0.5_wp*mass*6400, 1.0e-9_wp*mass)

    state%flow%liquid(3, 2, 3) = 0.2_wp*volume             ! and with some liquid
    call look()
    mass = (case%fluid%gas_density*0.05_wp + case%fluid%liquid_density*0.2_wp)*volume
    call check('both in a cut cell', of('kinetic_energy_fluid'), 0.5_wp*mass*6400, 1.0e-9_wp*mass)

    state%flow%fluid_volume(3, 2, 3) = 0.25_wp*volume              ! just its open volume
    state%flow%fluid_volume(1, 4, 4) = (1.0_wp + 2.0e-6_wp)*volume
    state%flow%fluid_volume(4, 1, 1) = (1.0_wp - 3.0e-6_wp)*volume
    state%flow%fluid_volume(0, 1, 1) = 2.0_wp*volume               ! of the halo
    call look()
    call check('the largest excess, of either sign', of('volume_excess_max'), 3.0e-6_wp, 1.0e-15_wp)
    state%flow%fluid_volume(3, 2, 3) = 0.4_wp*volume
    call look()
    call check('excess of a cut cell', of('volume_excess_max'), 0.15_wp, 1.0e-15_wp)
    call potential()
  end subroutine test_diagnostics

  !> A number of the row.
  pure real(wp) function of(name)
    character(*), intent(in) :: name

    of = value_of(row, name)
  end function of

  subroutine look()
    report%fluid = measure_fluid(case%fluid, state%grid, state%flow, state%solid)
    row = make_row(case%fluid, 0.0_wp, state%run_state_t, report)
  end subroutine look

  !> Potential energy of level liquid is that of a prism, less what a block displaces of it.
  subroutine potential()
    real(wp), parameter :: area = 0.4_wp*0.8_wp, g = 9.81_wp   !! [m2], [m/s2]
    real(wp) :: depth, expected
    integer :: k, n

    state%solid%alpha = 0.0_wp
    do n = 0, 4
      depth = 0.25_wp + 0.0625_wp*n
      do k = 0, 5
        state%flow%c(:, :, k) = min(1.0_wp, max(0.0_wp, depth/0.25_wp - (k - 1)))
      end do
      state%flow%liquid = volume*state%flow%c
      call look()
      expected = 0.5_wp*g*area*(case%fluid%liquid_density*depth**2 &
                                + case%fluid%gas_density*(1.0_wp - depth**2))
      call check('of level liquid', of('potential_energy_fluid'), expected, 1.0e-12_wp*expected)
      call check('and of its level', energy_of_level(case%fluid, state%grid, state%flow%c), &
                 expected, 1.0e-12_wp*expected)
    end do
    expected = of('potential_energy_fluid') - case%fluid%liquid_density*0.5_wp*volume*g*0.125_wp
    state%solid%alpha(2, 2, 1) = 0.5_wp
    state%flow%liquid(2, 2, 1) = 0.5_wp*volume
    call look()
    call check('less the displaced', of('potential_energy_fluid'), expected, 1.0e-12_wp*expected)
  end subroutine potential

end module test_diagnostics_m
