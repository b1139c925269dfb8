!> The groups of the run, its tank and its fluid: `&run`, `&grid`, `&boundary`, `&fluid`, `&water`,
!! `&numerics`.
module run_groups_m
  use kinds_m, only: wp
  use errors_m, only: to_text
  use case_types_m, only: run_t, grid_input_t, boundary_input_t, fluid_t, water_t, numerics_t, &
    is_given
  use boundary_kinds_m, only: side_code, side_names, is_wall, gives_velocity
  use allowed_values_m, only: allowed_t, any_number, positive, not_negative, between
  use group_visitor_m, only: group_visitor_t
  use value_text_m, only: quoted_text
  implicit none
  private
  public :: visit_run, visit_grid, visit_boundary, visit_fluid, visit_water, visit_numerics
  public :: side_name, shortest, lightest

  real(wp), parameter :: max_cells = real(huge(0), wp)   !! cells are counted in default integers
  real(wp), parameter :: max_steps = 1.0e9_wp
  character(1), parameter :: axis(3) = ['x', 'y', 'z']
  character(5), parameter :: side_name(2, 3) = reshape([character(5) :: 'x_min', 'x_max', &
    'y_min', 'y_max', 'z_min', 'z_max'], [2, 3])
  character(*), parameter :: side_in_words(2, 3) = reshape([character(21) :: &
    'the side of lowest x', 'the side of highest x', 'the side of lowest y', &
    'the side of highest y', 'the side of lowest z', 'the side of highest z'], [2, 3])
  real(wp), parameter :: farthest_origin = 1.0e8_wp       !! in cells; beyond, digits are lost

  !> Volumes and inertias of lengths from this to its inverse stay in the number range [m].
  real(wp), parameter :: shortest = 1.0e-6_wp
  !> Masses of densities from this to its inverse stay in the number range [kg/m3].
  real(wp), parameter :: lightest = 1.0e-6_wp

contains

  !> `&run`
  subroutine visit_run(v, run)
    type(group_visitor_t), intent(inout) :: v
    type(run_t), intent(inout) :: run

    run%line = v%group%line
    call v%about('how long the run is, how fine in time, and where its results go')
    call v%text('title', run%title, 'a line about the case, for the plan and the results', &
      example='''Six blocks in a tank''')
    call v%option('physics', run%physics, 'coupled fluid dry light', &
      'what is computed: water, air and blocks; without the blocks; blocks alone, without ' &
      //'water and air; or blocks in a given water whose flow is not resolved', &
      example='''dry''')
    call v%real('t_end', run%t_end, positive('s'), 'the simulated time', example='10', &
      required=.true.)
    call v%real('dt', run%dt, positive('s'), 'largest time step of the fluid; in ''dry'' the ' &
      //'step of the history, in ''light'' the longest step of the blocks', example='0.005')
    call v%real('cfl_max', run%cfl_max, not_negative('-', zero='0 keeps dt fixed'), &
      'the time step is made shorter to keep the Courant number of liquid and blocks below ' &
      //'this; gas up to eight times as fast moves in parts of the step', example='0.25')
    call v%text('output', run%output, 'folder of the result files; an older result is renamed ' &
      //'first', example='''my-run''')
    call v%real('field_interval', run%field_interval, not_negative('s', zero='0 means never'), &
      'simulated time between frames of the fields and of the surfaces of the blocks', &
      example='0.05')
    call v%real('history_interval', run%history_interval, &
      not_negative('s', zero='0 means every step'), &
      'simulated time between rows of the histories in run.h5', example='0.01')
    call v%real('restart_interval', run%restart_interval, &
      not_negative('s', zero='0 means only at the end'), &
      'simulated time between restart files', example='0.5')
    call v%logical('stop_when_settled', run%stop_when_settled, 'ends the run before t_end, when ' &
      //'all blocks are released or find no room, no motion is to come, and all blocks are ' &
      //'slower than rest_speed during rest_time')
    call v%real('rest_speed', run%rest_speed, positive('m/s'), &
      'speed below which a block counts as at rest', example='5e-4')
    if (.not. run%stop_when_settled) call v%pass_over('rest_time', 'stop_when_settled = .false.')
    call v%real('rest_time', run%rest_time, not_negative('s'), &
      'how long every block must be that slow for stop_when_settled', &
      example='stop_when_settled = .true.  rest_time = 1')

    if (is_given(run%t_end) .and. v%good('dt')) then
      call v%require('t_end', run%t_end <= max_steps*run%dt, 'must be at most ' &
                     //to_text(max_steps)//' steps of dt = '//to_text(run%dt)//' s')
    end if
    call v%require('output', len_trim(run%output) > 0, 'must name a folder')
  end subroutine visit_run

  !> `&grid`
  subroutine visit_grid(v, grid)
    type(group_visitor_t), intent(inout) :: v
    type(grid_input_t), intent(inout) :: grid
    real(wp) :: cells(3)

    call v%about('the tank and the cells it is cut into')
    cells = grid%cells
    call v%real('cells', cells, allowed_t(whole=.true., low=1.0_wp), &
      'how many cells in x, y, z', example='60, 20, 40', required=.true.)
    grid%cells = nint(cells)
    call v%real('length', grid%length, between(shortest, 1.0_wp/shortest, 'm'), &
      'the length of the tank in x, y, z', example='0.3, 0.1, 0.2', required=.true.)
    call v%real('origin', grid%origin, any_number('m'), &
      'the corner of the tank with the lowest x, y and z', example='-0.15, 0, 0')

    if (v%given('cells') .and. v%given('length') .and. v%good('cells')) then
      call v%require('cells', product(real(grid%cells, wp)) <= max_cells, &
        'too many cells, at most '//to_text(huge(0))//' in all')
      if (v%good('cells length')) call v%require('origin', all(abs(grid%origin) <= farthest_origin &
        *grid%length/real(grid%cells, wp)), 'too far from zero: cell faces would lose their digits')
    end if
    call v%judge('cells', grid%cells_faulty)
    call v%judge('length origin', grid%extent_faulty)
  end subroutine visit_grid

  !> `&boundary`
  subroutine visit_boundary(v, boundary)
    type(group_visitor_t), intent(inout) :: v
    type(boundary_input_t), intent(inout) :: boundary
    character(8), parameter :: inward(2) = ['positive', 'negative']
    character(8), parameter :: along(3) = ['0, 0.1, ', '0.1, 0, ', '0.1, 0, ']
    integer :: d, s

    call v%about('what each of the six sides of the tank is')
    do d = 1, 3
      do s = 1, 2
        call v%option(side_name(s, d), boundary%kind(s, d), &
          side_names, trim(side_in_words(s, d))//': a wall to ' &
          //'which the fluid sticks or along which it slips, open (pressure 0), periodic (with ' &
          //'the side across), or where a stream enters or leaves', example='''slip''')
      end do
    end do
    do d = 1, 3
      do s = 1, 2
        call v%real(side_name(s, d)//'_velocity', boundary%velocity(:, s, d), any_number('m/s'), &
          'velocity of '//trim(side_in_words(s, d))//': of a wall, in its own plane, or of an ' &
          //'inflow, into the tank', &
          example=side_name(s, d)//' = ''no_slip''  '//side_name(s, d)//'_velocity = '//along(d) &
          //'0')
      end do
    end do
    do d = 1, 3
      do s = 1, 2
        if (v%good(side_name(1, d)) .and. v%good(side_name(2, d))) call v%require(side_name(s, d), &
          boundary%kind(s, d) /= 'periodic' .or. boundary%kind(3 - s, d) == 'periodic', &
          'needs periodic on both sides, but '//side_name(3 - s, d)//' = ' &
          //quoted_text(trim(boundary%kind(3 - s, d))))
        if (v%good(side_name(s, d)) .and. v%good(side_name(s, d)//'_velocity')) then
          associate (variable => side_name(s, d)//'_velocity', velocity => boundary%velocity(:, s, &
            d), code => side_code(boundary%kind(s, d)))
            if (is_wall(code)) then
              call v%require(variable, .not. abs(velocity(d)) > 0.0_wp, 'a wall moves in its own ' &
                //'plane, the '//axis(d)//' component must be 0')
            else if (gives_velocity(code)) then
              call v%require(variable, real(3 - 2*s, wp)*velocity(d) > 0.0_wp, 'an inflow must ' &
                //'enter the tank, the '//axis(d)//' component must be '//inward(s))
            else
              call v%require(variable, .not. any(abs(velocity) > 0.0_wp), 'only walls and ' &
                //'inflows have a velocity, not a side that is ' &
                //quoted_text(trim(boundary%kind(s, d))))
            end if
          end associate
        end if
        call v%judge(side_name(s, d), boundary%faulty(s, d))
      end do
    end do
  end subroutine visit_boundary

  !> `&fluid`
  subroutine visit_fluid(v, fluid)
    type(group_visitor_t), intent(inout) :: v
    type(fluid_t), intent(inout) :: fluid

    fluid%line = v%group%line
    call v%about('water and air: what they are made of, and where they are at the start')
    call v%logical('single_phase', fluid%single_phase, 'the liquid fills the whole tank, there ' &
      //'is no gas')
    if (fluid%single_phase) call v%pass_over( &
      'gas_density gas_viscosity water_level surface_tension', 'single_phase = .true.')
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
    if (numerics%coupling == 'monolithic') call v%pass_over('coupling_passes', &
      'coupling = ''monolithic''')
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
    if (numerics%solid_fraction == 'exact') call v%pass_over('subcells', &
      'solid_fraction = ''exact''')
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
      'passes of one solve of the pressure after which the run ends with code 3', example='20')
  end subroutine visit_numerics

end module run_groups_m
