!> The groups of the fluid and of how it is solved: `&fluid`, `&water`, `&numerics`.
module fluid_groups_m
  use kinds_m, only: wp
  use case_types_m, only: fluid_t, water_t, numerics_t, is_given
  use allowed_values_m, only: any_number, positive, not_negative, between
  use group_visitor_m, only: group_visitor_t
  implicit none
  private
  public :: visit_fluid, visit_water, visit_numerics, lightest

  !> Masses of densities from this to its inverse stay in the number range [kg/m3].
  real(wp), parameter :: lightest = 1.0e-6_wp

contains

  !> `&fluid`
  subroutine visit_fluid(v, fluid)
    type(group_visitor_t), intent(inout) :: v
    type(fluid_t), intent(inout) :: fluid

    fluid%line = v%group%line
    call v%about('water and air: what they are made of, and where they are at the start')
    call v%logical('single_phase', fluid%single_phase, 'the liquid fills the whole tank, there ' &
      //'is no gas')
    call v%without_meaning(fluid%single_phase, &
      'gas_density gas_viscosity water_level surface_tension', 'single_phase = .true.', &
      'there is no gas and no surface')
    call v%real('liquid_density', fluid%liquid_density, &
      between(lightest, 1.0_wp/lightest, 'kg/m3'), 'density of the liquid', example='1025')
    call v%real('liquid_viscosity', fluid%liquid_viscosity, not_negative('Pa s'), &
      'dynamic viscosity of the liquid', example='1.3e-3')
    call v%real('gas_density', fluid%gas_density, between(lightest, 1.0_wp/lightest, 'kg/m3'), &
      'density of the gas', example='1.29')
    call v%real('gas_viscosity', fluid%gas_viscosity, not_negative('Pa s'), &
      'dynamic viscosity of the gas', example='1.7e-5')
    call v%real('gravity', fluid%gravity, any_number('m/s2'), 'acceleration of gravity, also ' &
      //'for blocks without a fluid; along a periodic direction a plain force on all there is', &
      example='0.1, 0, -9.81')
    call v%real('water_level', fluid%water_level, any_number('m'), 'height z below which there ' &
      //'is liquid at the start, and which an inflow and an outflow keep; without it there is ' &
      //'only the liquid of &water', example='0.15')
    call v%real('surface_tension', fluid%surface_tension, not_negative('N/m'), &
      'tension of the surface between liquid and gas', example='0.072')
    call v%real('velocity', fluid%velocity, any_number('m/s'), &
      'velocity of the fluid at the start, everywhere the same; with physics = ''light'' the ' &
      //'current, for ever', example='0.1, 0, 0')
    call v%text('initial_state', fluid%initial_state, 'HDF5 file with the liquid shares and the ' &
      //'velocities of the cells at the start', example='''start.h5''')
  end subroutine visit_fluid

  !> `&water`
  subroutine visit_water(v, water)
    type(group_visitor_t), intent(inout) :: v
    type(water_t), intent(inout) :: water

    water%line = v%group%line
    call v%about('a box of liquid at the start; where boxes overlap the liquid counts once')
    call v%real('min', water%min, any_number('m'), 'the lower corner of the box of liquid', &
      example='0, 0, 0', required=.true.)
    call v%real('max', water%max, any_number('m'), 'the upper corner of the box of liquid', &
      example='0.1, 0.1, 0.15', required=.true.)
    if (all(is_given([water%min, water%max]))) call v%require('max', all(water%max > water%min), &
      'must be larger than min in every direction')
    call v%judge('min max', water%faulty)
  end subroutine visit_water

  !> `&numerics`
  subroutine visit_numerics(v, numerics)
    type(group_visitor_t), intent(inout) :: v
    type(numerics_t), intent(inout) :: numerics

    call v%about('how the equations are solved')
    call v%option('coupling', numerics%coupling, 'monolithic mics', 'fluid and blocks: pressure ' &
      //'and rigid motions in one solve, or the mass-averaged mixture of the paper', &
      example='''mics''')
    call v%without_meaning(numerics%coupling == 'monolithic' .and. v%good('coupling'), &
      'coupling_passes', 'coupling = ''monolithic''', 'only ''mics'' makes passes')
    call v%integer('coupling_passes', numerics%coupling_passes, between(1, 1000), &
      'passes of projection and rigid motion in a step, for coupling = ''mics'' only', &
      example='coupling = ''mics''  coupling_passes = 3')
    call v%option('momentum', numerics%momentum, 'conservative c_ismac', 'predictor of the ' &
      //'velocity: mass and momentum carried by one flux, or that of the paper', &
      example='''c_ismac''')
    call v%option('advection', numerics%advection, 'mp5 tvd5 upwind', &
      'values carried through the faces: of fifth order, clipped where not monotone (mp5) or ' &
      //'with the limiter of the paper (tvd5), or of the cell upstream', &
      example='''upwind''')
    call v%option('solid_fraction', numerics%solid_fraction, 'exact subcell', &
      'share of a cell that is block: from clipped tetrahedra, or counted in the sub-cells of ' &
      //'the paper', example='''subcell''')
    call v%without_meaning(numerics%solid_fraction == 'exact' .and. v%good('solid_fraction'), &
      'subcells', 'solid_fraction = ''exact''', 'only ''subcell'' counts sub-cells')
    call v%integer('subcells', numerics%subcells, between(1, 32), 'sub-cells in each direction ' &
      //'of a cell, for solid_fraction = ''subcell''', &
      example='solid_fraction = ''subcell''  subcells = 8')
    call v%option('pressure_solver', numerics%pressure_solver, 'cg bicgstab', &
      'linear solver of the pressure: conjugate gradients, or that of the paper', &
      example='''bicgstab''')
    call v%option('preconditioner', numerics%preconditioner, 'multigrid jacobi none', &
      'what makes the linear solver quicker', example='''jacobi''')
    call v%real('divergence_tolerance', numerics%divergence_tolerance, positive('1/s'), &
      'the passes of the pressure end when no cell has a divergence above this', example='1e-7')
    call v%integer('max_pressure_passes', numerics%max_pressure_passes, between(1, 1000), &
      'passes of the pressure in a step after which the run ends with code 3', example='20')
  end subroutine visit_numerics

end module fluid_groups_m
