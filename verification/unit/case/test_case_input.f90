!> Every group of a case: defaults, values, attitudes, the way back to text, and dozens of bad
!! inputs, each with exactly the messages it must give.
module test_case_input_m
  use check_m, only: check
  use kinds_m, only: wp, pi
  use errors_m, only: problems_t
  use case_types_m, only: case_t, contact_input_t, contact_of, is_given
  use case_input_m, only: read_case, parameters_text
  implicit none
  private
  public :: test_case_input

  character(*), parameter :: lf = new_line('a')
  character(*), parameter :: run = '&run t_end = 1 /'//lf
  character(*), parameter :: grid = '&grid cells = 6, 2, 4 length = 0.3, 0.1, 0.2 /'//lf
  character(*), parameter :: base = run//grid   ! two lines
  character(*), parameter :: cube = base//'&shape name = ''c'' kind = ''cube'' size = 0.02 /'//lf

contains

  subroutine test_case_input()
    call test_defaults()
    call test_substeps()
    call test_values()
    call test_attitudes()
    call test_way_back()
    call test_missing()
    call test_form_of_values()
    call test_run_and_grid()
    call test_sides()
    call test_fluid_and_numerics()
    call test_contact()
    call test_shapes()
    call test_rock()
    call test_bodies()
    call test_idle()
    call test_physics()
    call test_given_water()
    call test_options()
    call test_all_at_once()
  end subroutine test_case_input

  !> What the contract promises for a case that says next to nothing.
  subroutine test_defaults()
    type(case_t) :: case
    type(problems_t) :: problems

    call read_case(base, case, problems)
    call check('shortest case', problems%n, 0)
    call check('text is kept', case%text == base)
    call check('physics', case%run%physics == 'coupled')
    call check('output', case%run%output == 'mics-out' .and. case%run%title == '')
    call check('run', [case%run%dt, case%run%cfl_max, case%run%field_interval, &
      case%run%history_interval, case%run%restart_interval, case%run%rest_speed, &
      case%run%rest_time], &
      [1.0e-2_wp, 0.5_wp, 0.1_wp, 0.0_wp, 1.0_wp, 1.0e-3_wp, 0.5_wp], 0.0_wp)
    call check('cells', all(case%grid%cells == [6, 2, 4]))
    call check('sides', all(case%boundary%kind(:, :2) == 'no_slip') &
               .and. case%boundary%kind(1, 3) == 'no_slip' .and. case%boundary%kind(2, 3) == 'open')
    call check('fluid', [case%fluid%liquid_density, case%fluid%liquid_viscosity, &
      case%fluid%gas_density, case%fluid%gas_viscosity, case%fluid%gravity], &
      [998.2_wp, 1.002e-3_wp, 1.204_wp, 1.82e-5_wp, 0.0_wp, 0.0_wp, -9.81_wp], 0.0_wp)
    call check('no level', .not. is_given(case%fluid%water_level))
    call check('numerics', case%numerics%momentum == 'conservative' &
      .and. case%numerics%advection == 'mp5' &
      .and. case%numerics%solid_fraction == 'exact' .and. case%numerics%pressure_solver == 'cg' &
      .and. case%numerics%preconditioner == 'multigrid')
    call check('contact', case%contact%model == 'surface' .and. case%contact%law == 'restitution' &
               .and. case%contact%sleep)
    call check('no ' &
      //'groups', size(case%water) + size(case%shape) + size(case%body) + size(case%drop), 0)
  end subroutine test_defaults

  !> A substep is a share of a step; in 'light' it may be one.
  subroutine test_substeps()
    call check('substeps', [substep_ratio('coupled', ''), substep_ratio('dry', ''), &
      substep_ratio('light', ''), substep_ratio('light', 'substep_ratio = 0.05')], &
      [0.05_wp, 0.05_wp, 1.0_wp, 0.05_wp], 0.0_wp)
  end subroutine test_substeps

  function substep_ratio(physics, contact)
    character(*), intent(in) :: physics, contact
    real(wp) :: substep_ratio
    type(contact_input_t) :: contact_input
    type(case_t) :: case
    type(problems_t) :: problems

    call read_case('&run t_end = 1  physics = '''//physics//''' /'//grid &
      //'&fluid water_level = 0.1 / &contact '//contact//' /', case, problems)
    contact_input = contact_of(case)
    substep_ratio = contact_input%substep_ratio
  end function substep_ratio

  !> Values arrive where they belong; each repeated group starts from the defaults.
  subroutine test_values()
    type(case_t) :: case
    type(problems_t) :: problems

    call read_case('&drop shape=''b'' position=1,2,3 count=4 first_time=5 interval=6 spread=3*.1' &
      //' tilt_deg=7 velocity=0,0,-1 seed=-8 /'//lf//cube// &
      '&shape name=''b'' kind=''box'' size=0.1, 0.2 0.3 density=2400 refinement=3 /'//lf// &
      '&body shape=''b'' position=3*0.1 velocity=1,2,3 angular_velocity=4,5,6 fixed=T ' &
      //'release_time=2/' &
      //lf//'&body shape=''c'' position=3*0.2 /'//lf//'&water min=3*0 max=3*0.1 /'//lf// &
      '&boundary x_min=''periodic'' x_max="periodic" z_max=''slip''/', case, problems)
    call check('good case', problems%n, 0)
    if (problems%n > 0) return
    call check('drop', case%drop(1)%count == 4 .and. case%drop(1)%seed == -8)
    call check('drop numbers', [case%drop(1)%position, case%drop(1)%first_time, &
      case%drop(1)%interval, case%drop(1)%spread, case%drop(1)%tilt_deg, case%drop(1)%velocity], &
      [1.0_wp, 2.0_wp, 3.0_wp, 5.0_wp, 6.0_wp, 0.1_wp, 0.1_wp, 0.1_wp, 7.0_wp, 0.0_wp, 0.0_wp, &
       -1.0_wp], 0.0_wp)
    call check('size of the box', case%shape(2)%size, [0.1_wp, 0.2_wp, 0.3_wp], 0.0_wp)
    call check('size of the cube', case%shape(1)%size(1), 0.02_wp, 0.0_wp)
    call check('rest of the size', count(is_given(case%shape(1)%size)), 1)
    call check('second shape only', [case%shape%density], [2300.0_wp, 2400.0_wp], 0.0_wp)
    call check('first body', case%body(1)%fixed .and. case%body(1)%shape == 'b')
    call check('motion', [case%body(1)%velocity, case%body(1)%angular_velocity, &
      case%body(1)%release_time], [1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp, 5.0_wp, 6.0_wp, 2.0_wp], 0.0_wp)
    call check('second body starts from defaults', .not. case%body(2)%fixed &
      .and. all(abs(case%body(2)%velocity) <= 0.0_wp) &
      .and. abs(case%body(2)%release_time) <= 0.0_wp)
    call check('lines', all([case%drop(1)%line, case%shape(1)%line, case%shape(2)%line, &
      case%body(1)%line, case%body(2)%line, case%water(1)%line] == [1, 4, 5, 6, 7, 8]))
    call check('periodic', all(case%boundary%kind(:, 1) == 'periodic'))
  end subroutine test_values

  !> Quaternion, axis and angle.
  subroutine test_attitudes()
    character(*), parameter :: idle = 'has no meaning with orientation = ''random''; any ' &
      //'attitude is as likely as another (line 4)'

    call check('none', attitude(''), [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], 0.0_wp)
    call check('normalised', attitude('quaternion=3,0,4,0'), [0.6_wp, 0.0_wp, 0.8_wp, 0.0_wp], &
      1.0e-15_wp)
    call check('tiny', attitude('quaternion=0,0,0,1e-20'), [0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], &
      1.0e-15_wp)
    call check('quarter turn', attitude('axis=0,0,5 angle_deg=90'), &
               [sqrt(0.5_wp), 0.0_wp, 0.0_wp, sqrt(0.5_wp)], 1.0e-15_wp)
    call check('no turn', attitude('axis=1,0,0 angle_deg=0'), [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], &
      0.0_wp)
    call check('backwards', attitude('axis=1,1,1 angle_deg=-60'), &
               [cos(pi/6.0_wp), -sin(pi/6.0_wp)/sqrt([3.0_wp, 3.0_wp, 3.0_wp])], 1.0e-15_wp)
    call expect(cube//'&body shape=''c'' position=3*0.05 quaternion=1,0,0,0 axis=1,0,0 ' &
      //'angle_deg=4 /', &
      '&body quaternion = 1, 0, 0, 0: give the quaternion, or axis with angle_deg, not both ' &
      //'(line 4)')
    call expect(cube//'&body shape=''c'' position=3*0.05 quaternion=1,0,0,0 angle_deg=4 /', &
      '&body quaternion = 1, 0, 0, 0: give the quaternion, or axis with angle_deg, not both ' &
      //'(line 4)')
    call expect(cube//'&body shape=''c'' position=3*0.05 axis=1,0,0/', &
      '&body axis = 1, 0, 0: needs angle_deg as well (line 4)')
    call expect(cube//'&drop shape=''c'' position=3*0.05 angle_deg=3/', &
      '&drop angle_deg = 3: needs axis as well (line 4)')
    call expect(cube//'&body shape=''c'' position=3*0.05 quaternion=4*0/', &
      '&body quaternion = 0, 0, 0, 0: must not be zero (line 4)')
    call expect(cube//'&body shape=''c'' position=3*0.05 axis=3*0.0 angle_deg=5/', &
      '&body axis = 0.0, 0.0, 0.0: must not be zero (line 4)')
    call expect(cube//'&body shape=''c'' position=3*0.05 quaternion=1,0,0/', &
      '&body quaternion = 1, 0, 0: 3 values given, 4 needed (line 4)')
    call expect(cube//'&drop shape=''c'' position=3*0.05 orientation=''random'' tilt_deg=3 ' &
      //'axis=1,0,0' &
      //' angle_deg=4/', '&drop axis = 1, 0, 0: '//idle//'|&drop angle_deg = 4: '//idle &
      //'|&drop tilt_deg = 3: '//idle)
    call expect(cube//'&drop shape=''c'' position=3*0.05 orientation=''random'' ' &
      //'quaternion=1,0,0,0/', '&drop quaternion = 1, 0, 0, 0: '//idle)
  end subroutine test_attitudes

  !> Attitude of a body with these variables.
  function attitude(variables) result(q)
    character(*), intent(in) :: variables
    real(wp) :: q(4)
    type(case_t) :: case
    type(problems_t) :: problems

    call read_case(cube//'&body shape=''c'' position=3*0.05 '//variables//'/', case, problems)
    q = 0.0_wp
    if (problems%n == 0) q = case%body(1)%quaternion
  end function attitude

  !> The parameters written out read back as the same case, bit for bit, also a second time.
  subroutine test_way_back()
    type(case_t) :: case, again
    type(problems_t) :: problems
    character(:), allocatable :: text

    call read_case(cube//'&body shape=''c'' position=0.1, 0.3333333333333333, 1e-7 ' &
      //'quaternion = 0.540625, 0.455768, -0.060003, -0.704554 /' &
      //'&body shape=''h'' position=3*1e20 axis=1,2,3 angle_deg=17 fixed=t/' &
      //'&shape name=''h'' kind=''hexapod'' size=.02 spheres=''centroid''/' &
      //'&shape name=''b'' kind=''box'' size=.02,.03,.04/ &drop shape=''h'' position=1,2,3 ' &
      //'tilt_deg=1/' &
      //'&drop shape=''h'' position=1,2,3 orientation=''random''/ &water min=3*0 max=3*1/' &
      //'&fluid water_level=0.1513 single_phase=f/ &contact sleep=f law=''constants''/' &
      //'&numerics coupling=''mics'' coupling_passes=3 divergence_tolerance=1d-10/', case, problems)
    case%run%title = 'it''s "a" / test ! größe'
    call check('case for the way back', problems%n, 0)
    text = parameters_text(case)
    call read_case(text, again, problems)
    call check('parameters are a good case', problems%n, 0)
    call check('same text again', parameters_text(again) == text)
    call check('title', again%run%title == case%run%title)
    call check('position', again%body(1)%position, case%body(1)%position, 0.0_wp)
    call check('quaternion 1', again%body(1)%quaternion, case%body(1)%quaternion, 0.0_wp)
    call check('quaternion 2', again%body(2)%quaternion, case%body(2)%quaternion, 0.0_wp)
    call check('tolerance', again%numerics%divergence_tolerance, 1.0e-10_wp, 0.0_wp)
    call check('passes', again%numerics%coupling_passes, 3)
    call check('level', again%fluid%water_level, 0.1513_wp, 0.0_wp)
    call check('no sleep', .not. again%contact%sleep)
    call check('random drop', again%drop(2)%orientation == 'random')
    call read_case(parameters_text(again), case, problems)
    call check('third time', parameters_text(case) == text)
    call check('no restitution with constants', index(text, 'restitution =') == 0)
    call check('no sizes of a file', index(text, 'scale =') == 0)
    call read_case(base//'&shape name=''f'' kind=''file'' file=''a''/ &shape name=''s'' ' &
      //'kind=''sphere'' size=1/', case, problems)
    text = parameters_text(case)
    call read_case(text, again, problems)
    call check('parameters of files and spheres are a good case', problems%n, 0)
    call check('a file has a scale', index(text, 'scale = 1') > 0)
    call read_case('&run t_end=1 stop_when_settled=t rest_time=3/'//grid &
      //'&fluid single_phase=t/', case, problems)
    text = parameters_text(case)
    call read_case(text, again, problems)
    call check('parameters of one phase are a good case', problems%n, 0)
    call check('the time of rest is kept', again%run%rest_time, 3.0_wp, 0.0_wp)
    call read_case(base, case, problems)
    call check('an absent level is not written', index(parameters_text(case), 'water_level') == 0)
  end subroutine test_way_back

  !> Required groups and variables.
  subroutine test_missing()
    character(*), parameter :: no_run = '&run t_end: missing, required: the simulated time [s]'
    character(*), parameter :: no_grid = '&grid cells: missing, required: how many cells in x, ' &
      //'y, z' &
      //' (there is no group &grid)|&grid length: missing, required: the length of the tank in ' &
      //'x, y, z' &
      //' [m] (there is no group &grid)'

    call expect('', no_run//' (there is no group &run)|'//no_grid)
    call expect(run, no_grid)
    call expect('&run /'//lf//grid, no_run//' (line 1)')
    call expect(run//'&grid cells=2,2,2/', &
      '&grid length: missing, required: the length of the tank in x, y, z [m] (line 2)')
    call expect(base//'&water min=0,0,0/', &
      '&water max: missing, required: the upper corner of the box of liquid [m] (line 3)')
    call expect(base//'&shape/', &
      '&shape name: missing, required: what &body and &drop call the shape (line 3)|' &
      //'&shape kind: missing, required: the form, such as ''hexapod'' (line 3)')
    call expect(base//'&shape name=''a'' kind=''sphere''/', &
      '&shape size: missing, required: the diameter [m] (line 3)')
    call expect(cube//'&body shape=''c''/', &
      '&body position: missing, required: the centre of mass [m] (line 4)')
    call expect(cube//'&drop position=1,1,1/', &
      '&drop shape: missing, required: the name of a &shape (line 4)')
    call expect(base//run, '&run: the group is given twice, first on line 1 (line 3)')
    call expect(base//'&runs t_end=2/', '&runs: unknown group, nearest known: &run (line 3)')
    call expect(base//'&bodies/', '&bodies: unknown group, nearest known: &body (line 3)')
  end subroutine test_missing

  !> Wrong types, wrong counts, unknown names.
  subroutine test_form_of_values()
    call expect('&run t_end=1 tend=2/'//grid, '&run tend = 2: unknown variable, nearest known: ' &
      //'t_end (line 1)')
    call expect('&run t_end=1 cell=2,3,4/'//grid, &
      '&run cell = 2, 3, 4: unknown variable, nearest known: title (line 1)')
    call expect(base//'&numerics interface=''plic''/', '&numerics interface = ''plic'': unknown ' &
      //'variable, nearest known: momentum (line 3)')
    call expect('&run t_end=ten/'//grid, '&run t_end = ten: must be a number (line 1)')
    call expect('&run t_end=''10''/'//grid, '&run t_end = ''10'': must be a number, without ' &
      //'quotes (line 1)')
    call expect('&run t_end=10s/'//grid, '&run t_end = 10s: must be a number (line 1)')
    call expect('&run t_end=nan/'//grid, '&run t_end = nan: must be a finite number (line 1)')
    call expect('&run t_end=+Infinity/'//grid, '&run t_end = +Infinity: must be a finite ' &
      //'number (line 1)')
    call expect('&run t_end=1e31/'//grid, &
      '&run t_end = 1e31: must be 0 or between 1e-20 and 1e20 in size (line 1)')
    call expect('&run t_end=1, 2/'//grid, '&run t_end = 1, 2: 2 values given, 1 needed (line 1)')
    call expect('&run t_end=1'//lf//'dt 0.1/'//grid, &
      '&run t_end = 1, dt, 0.1: 3 values given, 1 needed; is an ''='' missing after dt? (line 1)')
    call expect('&run t_end=1 physics=dry/'//grid, &
      '&run physics = dry: text needs quotes, ''dry'' (line 1)')
    call expect('&run t_end=1 output=results/run1 dt=0.1/'//grid, &
      '&run output = results/run1: text needs quotes, ''results/run1'' (line 1)')
    call expect('&run t_end=1 title=''a'' ''b''/'//grid, &
      '&run title = ''a'', ''b'': 2 values given, 1 needed (line 1)')
    call expect('&run t_end=1 stop_when_settled=yes/'//grid, &
      '&run stop_when_settled = yes: must be .true. or .false. (line 1)')
    call expect('&run t_end=1 stop_when_settled=1/'//grid, &
      '&run stop_when_settled = 1: must be .true. or .false. (line 1)')
    call expect('&run t_end=1 stop_when_settled=''T''/'//grid, &
      '&run stop_when_settled = ''T'': must be .true. or .false. (line 1)')
    call expect(run//'&grid cells=6.0,2,4 length=3*1/', &
      '&grid cells = 6.0, 2, 4: value 1 must be a whole number (line 2)')
    call expect(run//'&grid cells=6,2 length=3*1/', &
      '&grid cells = 6, 2: 2 values given, 3 needed (line 2)')
    call expect(run//'&grid cells=6,2,9999999999 length=3*1/', &
      '&grid cells = 6, 2, 9999999999: value 3 must be at most 2147483647 in size (line 2)')
    call expect(run//'&grid cells=6,2,4 length=0.3,,0.2/', &
      '&grid length: nothing in front of a comma; write every value (line 2)')
    call expect(run//'&grid cells=6,2,4 length=0.3,0.1,-nan/', &
      '&grid length = 0.3, 0.1, -nan: value 3 must be a finite number (line 2)')
    call expect(run//'&grid cells(1)=6 length=3*0.1/', &
      '&grid cells: parts of a list cannot be set; write the whole list, cells = first, ' &
      //'second, ...' &
      //' (line 2)')
  end subroutine test_form_of_values

  subroutine test_run_and_grid()
    call expect('&run t_end=1 dt=0/'//grid, '&run dt = 0: must be positive [s] (line 1)')
    call expect('&run t_end=1'//lf//'dt=-1/'//grid, '&run dt = -1: must be positive [s] (line 2)')
    call expect('&run t_end=0/'//grid, '&run t_end = 0: must be positive [s] (line 1)')
    call expect('&run t_end=0.001/'//grid, '')
    call expect('&run t_end=1e20/'//grid, &
      '&run t_end = 1e20: must be at most 1e9 steps of dt = 0.01 s (line 1)')
    call expect('&run t_end=1 physics=''wet''/'//grid, &
      '&run physics = ''wet'': unknown, must be one of ''coupled'', ''fluid'', ''dry'', ' &
      //'''light'' (line 1)')
    call expect('&run t_end=1 physics=''Dry''/'//grid, &
      '&run physics = ''Dry'': unknown, must be one of ''coupled'', ''fluid'', ''dry'', ' &
      //'''light'' (line 1)')
    call expect('&run t_end=1 physics=''''/'//grid, &
      '&run physics = '''': unknown, must be one of ''coupled'', ''fluid'', ''dry'', ' &
      //'''light'' (line 1)')
    call expect('&run t_end=1 physics=''fluid dry''/'//grid, &
      '&run physics = ''fluid dry'': unknown, must be one of ''coupled'', ''fluid'', ''dry'', ' &
      //'''light'' (line 1)')
    call expect('&run t_end=1 cfl_max=-.1/'//grid, &
      '&run cfl_max = -.1: must not be negative [-]; 0 keeps dt fixed (line 1)')
    call expect('&run t_end=1 output='' ''/'//grid, &
      '&run output = '' '': must name a folder (line 1)')
    call expect('&run t_end=1 field_interval=-1 history_interval=-2 restart_interval=-3/'//grid, &
      '&run field_interval = -1: must not be negative [s]; 0 means never (line 1)|' &
      //'&run history_interval = -2: must not be negative [s]; 0 means every step (line 1)|' &
      //'&run restart_interval = -3: must not be negative [s]; 0 means only at the end (line 1)')
    call expect('&run t_end=1 stop_when_settled=T rest_speed=0 rest_time=-1/'//grid, &
      '&run rest_speed = 0: must be positive [m/s] (line 1)|' &
      //'&run rest_time = -1: must not be negative [s] (line 1)')
    call expect(run//'&grid cells=0,2,4 length=3*1/', &
      '&grid cells = 0, 2, 4: must be 1 or more in each direction (line 2)')
    call expect(run//'&grid cells=2000000000,2000000000,2000000000 length=3*1/', &
      '&grid cells = 2000000000, 2000000000, 2000000000: too many cells, at most 2147483647 in ' &
      //'all' &
      //' (line 2)')
    call expect(run//'&grid cells=4,4,4 length=1,0,1/', &
      '&grid length = 1, 0, 1: must be positive [m] (line 2)')
    call expect(run//'&grid cells=4,4,4 length=3*1 origin=0,0,1e12/', &
      '&grid origin = 0, 0, 1e12: too far from zero: cell faces would lose their digits (line 2)')
    call expect(run//'&grid cells=4,1,4 length=3*1/', &
      '&grid cells = 4, 1, 4: one cell in a direction makes the case 2-D, then y_min and y_max ' &
      //'must' &
      //' both be ''slip'' or ''periodic'' (line 2)')
    call expect(run//'&grid cells=4,1,4 length=3*1/ &boundary y_min=''slip'' y_max=''slip''/', '')
  end subroutine test_run_and_grid

  subroutine test_sides()
    call expect(base//'&boundary x_min=''periodic''/', &
      '&boundary x_min = ''periodic'': needs periodic on both sides, but x_max = ''no_slip'' ' &
      //'(line 3)')
    call expect(base//'&boundary z_max=''periodic'' z_min=''slip''/', &
      '&boundary z_max = ''periodic'': needs periodic on both sides, but z_min = ''slip'' (line 3)')
    call expect(base//'&boundary y_min=''no-slip''/', &
      '&boundary y_min = ''no-slip'': unknown, must be' &
      //' one of ''no_slip'', ''slip'', ''open'', ''periodic'', ''inflow'', ''outflow'' (line 3)')
    call expect(base//'&boundary left=''slip''/', &
      '&boundary left = ''slip'': unknown variable, nearest known: x_min (line 3)')
    call expect(base//'&boundary z_max=''no_slip'' z_max_velocity=1,2,0 x_min_velocity=0,0,-1/', '')
    call expect(base//'&boundary z_min_velocity=0,0,1 y_max=''slip'' y_max_velocity=3,2,1 ' &
      //'z_max_velocity=1,0,0/', &
      '&boundary y_max_velocity = 3, 2, 1: a wall moves in its own plane, the y component must ' &
      //'be 0 (line 3)|' &
      //'&boundary z_min_velocity = 0, 0, 1: a wall moves in its own plane, the z component must ' &
      //'be 0 (line 3)|' &
      //'&boundary z_max_velocity = 1, 0, 0: only walls and inflows have a velocity, not a side ' &
      //'that is ''open'' (line 3)')
    call expect(base//'&fluid water_level=0.1/'//lf//'&boundary x_min=''inflow'' ' &
      //'x_max=''outflow'' x_min_velocity=0.2,0.1,0/', '')
    call expect(base//'&boundary x_min=''inflow'' x_max=''inflow'' y_min=''inflow'' ' &
      //'y_min_velocity=1,0,0 x_max_velocity=0.1,0,0/', &
      '&boundary x_min_velocity (by default): an inflow must enter the tank, the x component ' &
      //'must be positive (line 3)|' &
      //'&boundary x_max_velocity = 0.1, 0, 0: an inflow must enter the tank, the x component ' &
      //'must be negative (line 3)|' &
      //'&boundary y_min_velocity = 1, 0, 0: an inflow must enter the tank, the y component ' &
      //'must be positive (line 3)')
    call expect(base//'&boundary x_min=''inflow'' x_min_velocity=1,0,0 z_max=''slip''/', &
      '&boundary x_min = ''inflow'': what flows in must leave, another side must be ''open'' or ' &
      //'''outflow'' (line 3)')
    call expect(base//'&boundary x_min=''outflow'' z_max=''outflow''/', &
      '&boundary x_min = ''outflow'': needs &fluid water_level, the level it keeps (line 3)|' &
      //'&boundary z_max = ''outflow'': gravity acts across this side, it can be ''open'' ' &
      //'(line 3)')
    call expect(base//'&fluid single_phase=T/'//lf//'&boundary x_min=''outflow''/', '')
  end subroutine test_sides

  subroutine test_fluid_and_numerics()
    call expect(base//'&fluid liquid_density=0 gas_density=-1 liquid_viscosity=-1 ' &
      //'gas_viscosity=-1/', &
      '&fluid liquid_density = 0: must be positive [kg/m3] (line 3)|' &
      //'&fluid liquid_viscosity = -1: must not be negative [Pa s] (line 3)|' &
      //'&fluid gas_density = -1: must be positive [kg/m3] (line 3)|' &
      //'&fluid gas_viscosity = -1: must not be negative [Pa s] (line 3)')
    call expect(base//'&fluid gravity=0,0,inf/', &
      '&fluid gravity = 0, 0, inf: value 3 must be a finite number (line 3)')
    call expect(base//'&fluid gravity=9.81/', '&fluid gravity = 9.81: 1 value given, 3 needed ' &
      //'(line 3)')
    call expect(base//'&water min=0,0,0 max=1,0,1/', &
      '&water max = 1, 0, 1: must be larger than min in every direction (line 3)')
    call expect(base//'&numerics coupling=''mix''/', &
      '&numerics coupling = ''mix'': unknown, must be one of ''monolithic'', ''mics'' (line 3)')
    call expect(base//'&numerics coupling=''mics'' coupling_passes=0/', &
      '&numerics coupling_passes = 0: must lie between 1 and 1000 (line 3)')
    call expect(base//'&numerics coupling=''monolithic'' coupling_passes=1/', &
      '&numerics coupling_passes = 1: has no meaning with coupling = ''monolithic''; only ' &
      //'''mics'' makes passes (line 3)')
    call expect(base//'&numerics coupling=''mix'' coupling_passes=2/', &
      '&numerics coupling = ''mix'': unknown, must be one of ''monolithic'', ''mics'' (line 3)')
    call expect(base//'&numerics subcells=4/', '&numerics subcells = 4: has no meaning with ' &
      //'solid_fraction = ''exact''; only ''subcell'' counts sub-cells (line 3)')
    call expect(base//'&numerics divergence_tolerance=0 max_pressure_passes=0 subcells=0 ' &
      //'solid_fraction=''subcell''/', &
      '&numerics subcells = 0: must lie between 1 and 32 (line 3)|' &
      //'&numerics divergence_tolerance = 0: must be positive [1/s] (line 3)|' &
      //'&numerics max_pressure_passes = 0: must lie between 1 and 1000 (line 3)')
    call expect(base//'&numerics pressure_solver=''bicgstab'' preconditioner=''jacobi''/', '')
    call expect(base//'&numerics preconditioner=''ilu''/', &
      '&numerics preconditioner = ''ilu'': unknown,' &
      //' must be one of ''multigrid'', ''jacobi'', ''none'' (line 3)')
  end subroutine test_fluid_and_numerics

  subroutine test_contact()
    character(*), parameter :: idle = ': has no meaning with law = ''restitution''; only law = ' &
      //'''constants'' has them (line 3)|'
    character(*), parameter :: share = 'must be above 0 and at most 1 (line 3)', &
      from_0 = 'must lie between 0 and 1 (line 3)'

    call expect(base//'&contact restitution=0/', '')
    call expect(base//'&contact restitution=-1e-9/', '&contact restitution = -1e-9: '//from_0)
    call expect(base//'&contact restitution=1.01/', '&contact restitution = 1.01: '//from_0)
    call expect(base//'&contact contact_time=1 law=''constants''/', '')
    call expect(base//'&contact restitution=1 law=''constants''/', '&contact restitution = 1: ' &
      //'has no meaning with law = ''constants''; only law = ''restitution'' has it (line 3)')
    call expect(base//'&contact k_n=1 gamma_n=1 eta_n=1 k_t=1 gamma_t=1 eta_t=1 friction=-1/', &
      '&contact k_n = 1'//idle//'&contact gamma_n = 1'//idle//'&contact eta_n = 1'//idle &
      //'&contact k_t = 1'//idle//'&contact gamma_t = 1'//idle//'&contact eta_t = 1'//idle &
      //'&contact friction = -1: must not be negative [-] (line 3)')
    call expect(base//'&contact law=''constants'' contact_time=0 k_n=0 gamma_n=0 gamma_t=0/', &
      '&contact contact_time = 0: must be positive [s] (line 3)|' &
      //'&contact k_n = 0: must be positive [N/m^gamma_n] (line 3)|' &
      //'&contact gamma_n = 0: must be positive [-] (line 3)|' &
      //'&contact gamma_t = 0: must be positive [-] (line 3)')
    call expect(base//'&contact law=''constants'' eta_n=-1 k_t=-1 eta_t=-1 friction=-1 ' &
      //'wall_friction=-1/', &
      '&contact eta_n = -1: must not be negative [N s/m] (line 3)|' &
      //'&contact k_t = -1: must not be negative [N/m^gamma_t] (line 3)|' &
      //'&contact eta_t = -1: must not be negative [N s/m] (line 3)|' &
      //'&contact friction = -1: must not be negative [-] (line 3)|' &
      //'&contact wall_friction = -1: must not be negative [-] (line 3)')
    call expect(base//'&contact substep_ratio=0 courant_max=2/', '&contact substep_ratio = 0: ' &
      //share &
      //'|&contact courant_max = 2: '//share)
  end subroutine test_contact

  subroutine test_shapes()
    character(*), parameter :: a = '&shape name=''a'' kind='
    character(*), parameter :: idle = ': has no meaning with kind = ''cube''; only kind = ' &
      //'''file'' has it (line 3)'
    character(*), parameter :: of_file = ': has no meaning with kind = ''file''; the file has ' &
      //'the size and the tetrahedra (line 3)'
    character(*), parameter :: of_sphere = ': has no meaning with kind = ''sphere''; a sphere ' &
      //'touches as one (line 3)'
    character(*), parameter :: rule = 'a name has 1 to 64 letters, digits or _ - . and does ' &
      //'not begin' &
      //' with a point (line 3)'

    call expect(base//a//'''box'' size=1/', '&shape size = 1: 1 value given, 3 needed (line 3)')
    call expect(base//a//'''cube'' size=1,1,1/', '&shape size = 1, 1, 1: 3 values given, 1 ' &
      //'needed (line 3)')
    call expect(base//a//'''cube'' size=1,1,1,1/', &
      '&shape size = 1, 1, 1, 1: 4 values given, 1 needed (line 3)')
    call expect(base//a//'''cube'' size=-1/', '&shape size = -1: must be positive [m] (line 3)')
    call expect(base//a//'''cube'' size=1e7 density=1e-9/', &
      '&shape size = 1e7: must lie between 1e-6 and 1000000 m (line 3)|' &
      //'&shape density = 1e-9: must lie between 1e-6 and 1000000 kg/m3 (line 3)')
    call expect(base//a//'''box'' size=1,0,1/', '&shape size = 1, 0, 1: must be positive [m] ' &
      //'(line 3)')
    call expect(base//a//'''ball'' size=1/', '&shape kind = ''ball'': unknown, must be one of' &
      //' ''hexapod'', ''cube'', ''box'', ''sphere'', ''cylinder'', ''tetrapod'', ''dolos'', ' &
      //'''reef_cube'', ''rock'', ''file'' (line 3)')
    call expect(base//a//'''file''/', &
      '&shape file: missing, required: a Gmsh .msh file or a mics-shape file (line 3)')
    call expect(base//a//'''cube'' size=1 file=''a.msh''/', &
      '&shape file = ''a.msh'''//idle)
    call expect(base//a//'''cube'' size=1 file='''' scale=1/', '&shape file = '''''//idle &
      //'|&shape scale = 1'//idle)
    call expect(base//a//'''file'' file=''a.msh'' size=1 refinement=2 scale=2/', &
      '&shape size = 1'//of_file//'|&shape refinement = 2'//of_file)
    call expect(base//a//'''file'' file=''a.msh'' scale=0/', &
      '&shape scale = 0: must be positive [-] (line 3)')
    call expect(base//a//'''sphere'' size=1 refinement=2 spheres=''dense'' sphere_spacing=1/', &
      '&shape spheres = ''dense'''//of_sphere//'|&shape sphere_spacing = 1'//of_sphere)
    call expect(base//a//'''cube'' size=1 sphere_spacing=1/', '&shape sphere_spacing = 1: has no ' &
      //'meaning with spheres = ''centroid''; only ''dense'' has it (line 3)')
    call expect(base//a//'''cube'' size=1 sphere_spacing=1 spheres=''dense''/', '')
    call expect(base//'&shape name=''a'' size=1 scale=2/', '&shape kind: missing, required: the ' &
      //'form, such as ''hexapod'' (line 3)')
    call expect(base//a//'''cylinder'' size=1/', &
      '&shape size = 1: 1 value given, 2 needed (line 3)')
    call expect(base//a//'''cube'' size=1 spheres=''many''/', &
      '&shape spheres = ''many'': unknown, must be one of ''centroid'', ''inscribed'', ' &
      //'''dense'' (line 3)')
    call expect(base//a//'''cube'' size=1 density=0 refinement=0 spheres=''dense'' ' &
      //'sphere_spacing=-1/', &
      '&shape density = 0: must be positive [kg/m3] (line 3)|' &
      //'&shape refinement = 0: must lie between 1 and 8 (line 3)|' &
      //'&shape sphere_spacing = -1: must not be negative [m]; 0 means a tenth of the smallest ' &
      //'edge (line 3)')
    call expect(base//'&shape name='''' kind=''cube'' size=1/', '&shape name = '''': '//rule)
    call expect(base//'&shape name=''a/b'' kind=''cube'' size=1/', '&shape name = ''a/b'': '//rule)
    call expect(base//'&shape name=''..'' kind=''cube'' size=1/', '&shape name = ''..'': '//rule)
    call expect(base//'&shape name='''//repeat('x', 65)//''' kind=''cube'' size=1/', &
      '&shape name = '''//repeat('x', 56)//'...: '//rule)
    call expect(cube//'&shape name=''c'' kind=''cube'' size=1/', &
      '&shape name = ''c'': the &shape on line 3 has this name already (line 4)')
    call expect(cube//'&shape name=''C'' kind=''cube'' size=1/', &
      '&shape name = ''C'': the &shape on line 3 has this name already (line 4)')
  end subroutine test_shapes

  !> A family of stones: its variables, its members, and who gets which.
  subroutine test_rock()
    character(*), parameter :: a = '&shape name=''a'' kind='
    character(*), parameter :: rock = base//a//'''rock'' '
    type(case_t) :: case
    type(problems_t) :: problems

    call expect(rock//'size=1/', '&shape size = 1: has no meaning with kind = ''rock''; mass_50 ' &
      //'and density give the size (line 3)')
    call expect(base//a//'''cube'' size=1 mass_50=2/', '&shape mass_50 = 2: has no meaning with ' &
      //'kind = ''cube''; only kind = ''rock'' has it (line 3)')
    call expect(rock//'variants=0 mass_50=0 uniformity=0 mass_min=-1 elongation=0.9 ' &
      //'blockiness=1/', '&shape variants = 0: must lie between 1 and 5000 (line 3)|' &
      //'&shape mass_50 = 0: must be positive [kg] (line 3)|' &
      //'&shape uniformity = 0: must be positive [-] (line 3)|' &
      //'&shape mass_min = -1: must not be negative [kg]; 0 means no bound (line 3)|' &
      //'&shape elongation = 0.9: must lie between 1 and 10 (line 3)|' &
      //'&shape blockiness = 1: must lie between 0.3 and 0.9 (line 3)')
    call expect(rock//'mass_min=2 mass_max=1/', '&shape mass_max = 1: must be above mass_min = 2 ' &
      //'kg, or 0 for no bound (line 3)')
    call expect(rock//'/ &body shape=''a-21'' position=3*0/', '&body shape = ''a-21'': no &shape ' &
      //'has this name, nearest known: ''a-01'' (line 3)')
    call expect(rock//'/ &shape name=''A-07'' kind=''cube'' size=1/', '&shape name = ''A-07'': ' &
      //'the &shape on line 3 has this name already (line 3)')
    call read_case(rock//'variants=3/ &body shape=''a'' position=3*0/ &body shape=''a-03'' ' &
      //'position=3*0/ &body shape=''a'' position=3*0/ &body shape=''a'' position=3*0/ ' &
      //'&body shape=''a'' position=3*0/ &drop shape=''a'' position=3*0/', case, problems)
    call check('a good family', problems%n, 0)
    call check('a shape for each stone', size(case%shape), 3)
    call check('members', all(case%shape%member == [1, 2, 3]))
    call check('bodies take the next one', all(case%body%shape == [character(4) :: 'a-01', &
      'a-03', 'a-02', 'a-03', 'a-01']))
    call check('a drop draws', case%drop(1)%shape == 'a')
    call check('one group is written', index(parameters_text(case), '&shape', back=.true.), &
      index(parameters_text(case), '&shape'))
    call read_case(rock//'variants=200/ &body shape=''a-007'' position=3*0/', case, problems)
    call check('three digits', problems%n, 0)
  end subroutine test_rock

  subroutine test_bodies()
    call expect(base//'&body shape=''x'' position=3*0/', &
      '&body shape = ''x'': the case has no &shape group (line 3)')
    call expect(cube//'&body shape=''cc'' position=3*0/', &
      '&body shape = ''cc'': no &shape has this name, nearest known: ''c'' (line 4)')
    call expect(cube//'&body shape=''C'' position=3*0/', &
      '&body shape = ''C'': no &shape has this name, nearest known: ''c'' (line 4)')
    call expect(cube//'&body shape=''c'' position=3*0 fixed=0 release_time=-1/', &
      '&body fixed = 0: must be .true. or .false. (line 4)|' &
      //'&body release_time = -1: must not be negative [s] (line 4)')
    call expect(cube//'&drop shape=''c'' position=3*0 count=0 first_time=-1 interval=-1 ' &
      //'spread=0,-1,0' &
      //' tilt_deg=181 seed=1.5/', '&drop count = 0: must lie between 1 and 100000 (line 4)|' &
      //'&drop first_time = -1: must not be negative [s] (line 4)|' &
      //'&drop interval = -1: must not be negative [s] (line 4)|' &
      //'&drop spread = 0, -1, 0: must not be negative [m] (line 4)|' &
      //'&drop tilt_deg = 181: must lie between 0 and 180 degrees (line 4)|' &
      //'&drop seed = 1.5: must be a whole number (line 4)')
    call expect(cube//'&drop shape=''c'' position=3*0 orientation=''any''/', &
      '&drop orientation = ''any'': unknown, must be one of ''given'', ''random'' (line 4)')
    call expect(cube//'&body shape=''c'' position=3*0 colour=''red''/', &
      '&body colour = ''red'': unknown variable, nearest known: motion (line 4)')
  end subroutine test_bodies

  !> What a choice leaves without meaning is an error, of its own group or of another.
  subroutine test_idle()
    character(*), parameter :: phase = ': has no meaning with single_phase = .true.; there is no ' &
      //'gas and no surface (line 3)'

    call expect(base//'&fluid gas_density=1 single_phase=T gas_viscosity=1 water_level=1 ' &
      //'surface_tension=0/', '&fluid gas_density = 1'//phase//'|&fluid gas_viscosity = 1'//phase &
      //'|&fluid water_level = 1'//phase//'|&fluid surface_tension = 0'//phase)
    call expect(base//'&fluid gas_density=1 single_phase=F water_level=1/', '')
    call expect(base//'&water min=3*0 max=3*1/ &fluid single_phase=T/ &water min=3*0 max=3*1/', &
      '&water: has no meaning with &fluid single_phase = .true.; the liquid fills the whole tank ' &
      //'(line 3)|&water: has no meaning with &fluid single_phase = .true.; the liquid fills ' &
      //'the whole tank (line 3)')
    call expect('&run t_end=1 rest_time=1/'//grid, '&run rest_time = 1: has no meaning with ' &
      //'stop_when_settled = .false.; only .true. waits for it (line 1)')
    call expect('&run t_end=1 rest_time=1 stop_when_settled=T/'//grid, '')
    call expect('&run t_end=1 rest_time=1 stop_when_settled=yes/'//grid, &
      '&run stop_when_settled = yes: must be .true. or .false. (line 1)')
    call expect('&run t_end=1 rest_speed=1/'//grid, '')   ! the table counts those that move
  end subroutine test_idle

  !> What `physics` leaves without meaning is passed over, for a case can be tried with each.
  subroutine test_physics()
    character(*), parameter :: blocks = '&shape name=''c'' kind=''cube'' size=1/ &body ' &
      //'shape=''c'' position=3*0/'//lf &
      //'&body shape=''c'' position=3*0/ &drop shape=''c'' position=3*1/'//lf
    character(*), parameter :: dry = ' no meaning with physics = ''dry'', passed over (line '
    character(*), parameter :: fluid = ' no meaning with physics = ''fluid'', passed over (line '
    character(*), parameter :: light = ' no meaning with physics = ''light'', passed over (line '

    call warn('physics=''dry'' cfl_max=1', '&fluid gravity=3*1 water_level=1 single_phase=F/'//lf &
      //'&numerics coupling=''mics''/ &contact friction=1 lubrication=F/'//lf &
      //'&water min=3*0 max=3*1/ &water min=3*0 max=3*2/'//lf//blocks//'&boundary x_min=' &
      //'''inflow'' x_min_velocity=1,0,0 y_min_velocity=1,0,0 x_max=''open''/', &
      '2 groups &water: have'//dry//'5)|&numerics: has'//dry//'4)|&run cfl_max: has'//dry//'1)|' &
      //'&fluid water_level, single_phase: have'//dry//'3)|&contact lubrication: has'//dry//'4)|' &
      //'&boundary x_min_velocity: has'//dry//'8)')
    call warn('physics=''dry''', '&fluid gravity=3*1/'//lf//'&contact friction=1/ ' &
      //'&bed file=''b''/ '//blocks, '')
    call warn('physics=''fluid'' stop_when_settled=T'//lf//' rest_speed=1 rest_time=2', &
      blocks//'&contact law=''constants''/ &numerics subcells=3 solid_fraction=''subcell'' ' &
      //'coupling=''mics''/'//lf//'&boundary x_min=''slip'' x_min_velocity=0,1,0 ' &
      //'x_max_velocity=0,1,0/', '&contact: has'//fluid//'6)|&shape: has'//fluid &
      //'4)|2 groups &body: have'//fluid//'4)|&drop: has'//fluid//'5)|&run stop_when_settled, ' &
      //'rest_speed, rest_time: have'//fluid//'1)|&numerics solid_fraction, subcells: have' &
      //fluid//'6)|&boundary x_min_velocity: has'//fluid//'7)')
    call warn('physics=''fluid''', '&bed file=''b''/ &numerics solid_fraction=''subcell''/', '')
    call warn('physics=''coupled''', '&water min=3*0 max=3*1/ &numerics coupling=''mics''/ ' &
      //'&contact lubrication=T/'//lf//blocks, '')
    call warn('physics=''dry''', '&fluid single_phase=T/ &water min=3*0 max=3*1/', '&water: has' &
      //dry//'3)|&fluid single_phase: has'//dry//'3)')
    call warn('physics=''dry''', '&shape name=''c'' kind=''cube'' size=1 drag_coefficient=1/', &
      '&shape drag_coefficient: has'//dry//'3)')
    call warn('physics=''coupled''', '&shape name=''c'' kind=''cube'' size=1 drag_coefficient=1/', &
      '&shape drag_coefficient: has no meaning with physics = ''coupled'', passed over (line 3)')
    call warn('physics=''light'' cfl_max=1', '&fluid water_level=1 velocity=1,0,0 ' &
      //'gas_density=1/ &numerics coupling=''mics''/ &contact lubrication=T/'//lf &
      //'&shape name=''c'' kind=''cube'' size=1 drag_coefficient=0/', '&numerics: has'//light &
      //'3)|&run cfl_max: has'//light//'1)|&fluid gas_density: has'//light &
      //'3)|&contact lubrication: has'//light//'3)')
  end subroutine test_physics

  !> What a water without a flow must have and cannot have.
  subroutine test_given_water()
    character(*), parameter :: given = '&run t_end=1 physics=''light''/ '
    character(*), parameter :: light = 'physics = ''light'' '
    character(*), parameter :: stream = 'has no stream through a side; the current is &fluid ' &
      //'velocity (line 2)'

    call expect(given//'&fluid water_level=.1/ &boundary x_min=''open'' y_min=''periodic'' ' &
      //'y_max=''periodic''/'//grid, '')
    call expect(given//grid, '&fluid: '//light &
      //'needs water_level, the level of the water that is given [m]')
    call expect(given//'&fluid single_phase=T/'//grid, '&fluid single_phase = T: '//light &
      //'needs a level of the water (line 1)')
    call expect(given//'&fluid water_level=.1 gravity=1,0,-9 velocity=0,0,1/'//grid, &
      '&fluid gravity = 1, 0, -9: '//light//'has a level, gravity must point straight down ' &
      //'(line 1)|&fluid velocity = 0, 0, 1: '//light//'has a current along the level, its z ' &
      //'component must be 0 (line 1)')
    call expect(given//'&fluid water_level=.1 gravity=0,0,9/'//grid, &
      '&fluid gravity = 0, 0, 9: '//light//'has a level, gravity must point straight down (line 1)')
    call expect(given//'&fluid water_level=.1/'//lf//'&boundary x_min=''inflow'' ' &
      //'x_min_velocity=1,0,0 x_max=''outflow'' z_min=''open''/'//grid, &
      '&boundary x_min = ''inflow'': '//light//stream//'|&boundary x_max = ''outflow'': ' &
      //light//stream//'|&boundary z_min = ''open'': '//light &
      //'keeps its water, the floor cannot be open (line 2)')
  end subroutine test_given_water

  !> Read a good case with these variables of &run and compare all warnings, '|' between them.
  subroutine warn(of_run, groups, messages)
    character(*), intent(in) :: of_run, groups, messages
    type(case_t) :: case
    type(problems_t) :: problems, passed_over
    character(:), allocatable :: found
    integer :: i

    call read_case('&run t_end=1 '//of_run//'/'//lf//grid//groups, case, problems, passed_over)
    call check('problems with: '//groups, problems%n, 0)
    found = ''
    do i = 1, passed_over%n
      if (i > 1) found = found//'|'
      found = found//passed_over%message(i)
    end do
    call check('passed over: '//messages, found == messages)
    if (found /= messages) print '(2a)', '  got: ', found
  end subroutine warn

  !> Options that came late.
  subroutine test_options()
    call expect(base//'&numerics momentum=''c_ismac'' solid_fraction=''subcell'' ' &
      //'advection=''upwind''/', '')
    call expect(base//'&boundary z_max_velocity=0,0,0/', '')
    call expect(base//'&fluid surface_tension=0.0/', '')
    call expect(base//'&fluid surface_tension=0.072/', '')
    call expect(base//'&contact model=''surface''/', '')
    call expect(base//'&bed file=''a.stl'' kind = ''stl''/', '')
    call expect(base//'&bed file=''a.stl'' kind = ''map''/', '&bed kind = ''map'': unknown, ' &
      //'must be one of ''heightmap'', ''stl'' (line 3)')
    call expect(base//'&bed kind = ''stl''/', '&bed file (by default): must name a file ' &
      //'with the form of the bed (line 3)')
  end subroutine test_options

  !> Faults of form, of type, of range and between groups come out together.
  subroutine test_all_at_once()
    call expect('&run'//lf//'t_end = 1'//lf//'dt = -1'//lf//'titel = ''x'''//lf//'/'//lf// &
      '&grid cells = 4, 4 length = 1, 1, 1 /'//lf//'&fliud/'//lf// &
      '&body shape = ''c'' /'//lf//'stray'//lf//'&fluid gravity = 0,,1'//lf, &
      'text outside the groups: stray ; &body has ended with its ''/'' (line 9)|' &
      //'&fluid gravity: nothing in front of a comma; write every value (line 10)|' &
      //'&fluid: no ''/'' closes the group before the end of the text (line 10)|' &
      //'&run dt = -1: must be positive [s] (line 3)|' &
      //'&run titel = ''x'': unknown variable, nearest known: title (line 4)|' &
      //'&grid cells = 4, 4: 2 values given, 3 needed (line 6)|' &
      //'&fliud: unknown group, nearest known: &fluid (line 7)|' &
      //'&body shape = ''c'': the case has no &shape group (line 8)|' &
      //'&body position: missing, required: the centre of mass [m] (line 8)')
  end subroutine test_all_at_once

  !> Read a case and compare all messages, '|' between them; none means a good case.
  subroutine expect(text, messages)
    character(*), intent(in) :: text, messages
    type(case_t) :: case
    type(problems_t) :: problems
    character(:), allocatable :: found
    integer :: i

    call read_case(text, case, problems)
    found = ''
    do i = 1, problems%n
      if (i > 1) found = found//'|'
      found = found//problems%message(i)
    end do
    call check('messages: '//messages, found == messages)
    if (found /= messages) print '(4a)', '  case: ', text, lf//'  got: ', found
  end subroutine expect

end module test_case_input_m
