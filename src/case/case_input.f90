!> All groups of a case: their variables, defaults, and every check that needs no geometry.
!!
!! Each group stands in one `visit_...` procedure, which serves reading and writing alike. The order
!! of the procedures is that of the contract. Nothing stops here: all that is wrong is collected.
module case_input_m
  use kinds_m, only: wp, name_length, pi
  use errors_m, only: problems_t, to_text
  use vectors_m, only: quaternion_from_axis
  use case_types_m, only: case_t, run_t, grid_input_t, boundary_input_t, fluid_t, water_t, &
    numerics_t, contact_input_t, shape_input_t, body_input_t, drop_input_t, bed_input_t, absent, &
    is_given, size_count
  use namelist_text_m, only: namelist_text_t, group_text_t, cut_groups
  use group_visitor_m, only: group_visitor_t
  use value_text_m, only: nearest_name, lower_case, printable, quoted_text
  implicit none
  private
  public :: read_case, parameters_text, side_name

  !> The groups of the contract; those from `first_repeated` to `last_repeated` may be repeated.
  character(name_length), parameter :: groups(*) = [character(name_length) :: 'run', 'grid', &
    'boundary', 'fluid', 'numerics', 'contact', 'bed', 'water', 'shape', 'body', 'drop']
  integer, parameter :: first_repeated = 8

  real(wp), parameter :: most_cells = real(huge(0), wp)   !! cells are counted in default integers
  real(wp), parameter :: most_steps = 1.0e9_wp
  real(wp), parameter :: farthest_origin = 1.0e8_wp       !! in cells; beyond, digits are lost
  real(wp), parameter :: shortest = 1.0e-6_wp, lightest = 1.0e-6_wp   !! [m], [kg/m3]
  integer, parameter :: most_drops = 100000, finest_shape = 8

contains

  !> Read the text of a case. Variables that are wrong keep their defaults; see `problems%n` first.
  subroutine read_case(text, case, problems)
    character(*), intent(in) :: text
    type(case_t), intent(out) :: case
    type(problems_t), intent(inout) :: problems
    type(namelist_text_t) :: list
    type(group_visitor_t) :: v
    character(name_length), allocatable :: shapes(:)
    integer :: i
    integer :: n(size(groups))            ! how many of each group came by
    integer :: first_line(size(groups))   ! where the first of each begins

    call set_empty(case)
    case%text = text
    v%problems = problems
    call cut_groups(text, list, v%problems)
    allocate (case%water(count_groups(list, 'water')), case%shape(count_groups(list, 'shape')))
    allocate (case%body(count_groups(list, 'body')), case%drop(count_groups(list, 'drop')))
    shapes = shape_names(list)
    n = 0
    do i = 1, list%n
      call read_group(list%group(i), shapes, n, first_line, v, case)
    end do
    call read_missing_groups(n, v, case)
    call check_together(list, case, v)
    problems = v%problems
  end subroutine read_case

  !> Texts that the types of a case cannot give a default to.
  subroutine set_empty(case)
    type(case_t), intent(inout) :: case

    case%run%title = ''
    case%run%output = 'mics-out'
    case%bed%file = ''
    case%fluid%initial_state = ''
  end subroutine set_empty

  !> Number of groups of a name.
  pure function count_groups(list, name) result(n)
    type(namelist_text_t), intent(in) :: list
    character(*), intent(in) :: name
    integer :: n
    integer :: i

    n = 0
    do i = 1, list%n
      if (list%group(i)%name == name) n = n + 1
    end do
  end function count_groups

  !> Hand a group to its procedure.
  subroutine read_group(group, shapes, n, first_line, v, case)
    type(group_text_t), intent(inout) :: group
    character(name_length), intent(in) :: shapes(:)   !! names of all shapes
    integer, intent(inout) :: n(:), first_line(:)     !! of each name: groups so far, line
    type(group_visitor_t), intent(inout) :: v
    type(case_t), intent(inout) :: case
    integer :: g

    call v%start_reading(group)
    do g = 1, size(groups)
      if (groups(g) == group%name) exit
    end do
    if (g > size(groups)) then
      call v%note(': unknown group, nearest known: &'//nearest_name(printable(group%name), groups))
      return
    else if (n(g) > 0 .and. g < first_repeated) then
      call v%note(': the group is given twice, first on line '//to_text(first_line(g)))
      return
    end if
    if (n(g) == 0) first_line(g) = group%line
    n(g) = n(g) + 1
    call visit_group(v, case, groups(g), n(g), shapes)
    group = v%group   ! remembers which variables are faulty
  end subroutine read_group

  !> Read or write one group: the n-th of its name.
  subroutine visit_group(v, case, name, n, shapes)
    type(group_visitor_t), intent(inout) :: v
    type(case_t), intent(inout) :: case
    character(*), intent(in) :: name
    integer, intent(in) :: n
    character(name_length), intent(in) :: shapes(:)   !! names of all shapes

    select case (name)
    case ('run'); call visit_run(v, case%run)
    case ('grid'); call visit_grid(v, case%grid)
    case ('boundary'); call visit_boundary(v, case%boundary)
    case ('fluid'); call visit_fluid(v, case%fluid)
    case ('water'); call visit_water(v, case%water(n))
    case ('numerics'); call visit_numerics(v, case%numerics)
    case ('contact'); call visit_contact(v, case%contact)
    case ('shape'); call visit_shape(v, case%shape(n))
    case ('body'); call visit_body(v, case%body(n), shapes)
    case ('drop'); call visit_drop(v, case%drop(n), shapes)
    case ('bed'); call visit_bed(v, case%bed)
    case default; error stop 'visit_group: a group of the list has no procedure'
    end select
    call v%finish()
    if (.not. v%all_good()) call mark_faulty(case, name, n)
  end subroutine visit_group

  !> Remember that a group is faulty, so that later checks leave it alone.
  subroutine mark_faulty(input, name, n)
    type(case_t), intent(inout) :: input
    character(*), intent(in) :: name
    integer, intent(in) :: n

    select case (name)
    case ('grid')
      input%grid%faulty = .true.
    case ('boundary')
      input%boundary%faulty = .true.
    case ('water')
      input%water(n)%faulty = .true.
    case ('shape')
      input%shape(n)%faulty = .true.
    case ('body')
      input%body(n)%faulty = .true.
    case ('drop')
      input%drop(n)%faulty = .true.
    case ('bed')
      input%bed%faulty = .true.
    case default   ! nobody asks about the others
    end select
  end subroutine mark_faulty

  !> Groups that hold required variables and are not there at all.
  subroutine read_missing_groups(n, v, case)
    integer, intent(in) :: n(:)
    type(group_visitor_t), intent(inout) :: v
    type(case_t), intent(inout) :: case
    type(group_text_t) :: nothing
    character(name_length) :: no_shapes(0)
    integer :: g

    allocate (nothing%assignment(0))
    do g = 1, 2   ! run and grid
      if (n(g) > 0) cycle
      nothing%name = trim(groups(g))
      call v%start_reading(nothing)
      call visit_group(v, case, groups(g), 1, no_shapes)
    end do
  end subroutine read_missing_groups

  !> The names the shapes of the case were given, right or wrong.
  pure function shape_names(list) result(names)
    type(namelist_text_t), intent(in) :: list
    character(name_length), allocatable :: names(:)
    integer :: i, j, n

    allocate (names(count_groups(list, 'shape')))
    names = ''
    n = 0
    do i = 1, list%n
      if (list%group(i)%name /= 'shape') cycle
      n = n + 1
      j = list%group(i)%find('name')
      if (j == 0) cycle
      if (list%group(i)%assignment(j)%n > 0) names(n) = list%group(i)%assignment(j)%value(1)%text
    end do
  end function shape_names

  !> `&run`
  subroutine visit_run(v, run)
    type(group_visitor_t), intent(inout) :: v
    type(run_t), intent(inout) :: run

    run%line = v%group%line
    call v%needed('t_end', 'the simulated time [s]')
    call v%item('title', run%title)
    call v%option('physics', run%physics, 'coupled fluid dry')
    call v%item('t_end', run%t_end)
    call v%item('dt', run%dt)
    call v%item('cfl_max', run%cfl_max)
    call v%item('output', run%output)
    call v%item('field_interval', run%field_interval)
    call v%item('history_interval', run%history_interval)
    call v%item('restart_interval', run%restart_interval)
    call v%item('stop_when_settled', run%stop_when_settled)
    call v%item('rest_speed', run%rest_speed)
    call v%item('rest_time', run%rest_time)

    call v%require('dt', run%dt > 0.0_wp, 'must be positive [s]')
    if (is_given(run%t_end)) then
      call v%require('t_end', run%t_end > 0.0_wp, 'must be positive [s]')
      if (v%good('dt')) then
        call v%require('t_end', run%t_end >= run%dt, &
                       'must be at least dt = '//to_text(run%dt)//' s')
        call v%require('t_end', run%t_end <= most_steps*run%dt, 'must be at most ' &
                       //to_text(most_steps)//' steps of dt = '//to_text(run%dt)//' s')
      end if
    end if
    call require_not_negative(v, 'cfl_max', run%cfl_max, '[-]; 0 keeps dt fixed')
    call v%require('output', len_trim(run%output) > 0, 'must name a folder')
    call require_not_negative(v, 'field_interval', run%field_interval, '[s]; 0 means never')
    call require_not_negative(v, 'history_interval', run%history_interval, &
                              '[s]; 0 means every step')
    call require_not_negative(v, 'restart_interval', run%restart_interval, &
                              '[s]; 0 means only at the end')
    call v%require('rest_speed', run%rest_speed > 0.0_wp, 'must be positive [m/s]')
    call require_not_negative(v, 'rest_time', run%rest_time, '[s]')
  end subroutine visit_run

  !> `&grid`
  subroutine visit_grid(v, grid)
    type(group_visitor_t), intent(inout) :: v
    type(grid_input_t), intent(inout) :: grid

    call v%needed('cells', 'how many cells in x, y, z')
    call v%needed('length', 'the length of the tank in x, y, z [m]')
    call v%item('cells', grid%cells)
    call v%item('length', grid%length)
    call v%item('origin', grid%origin)

    if (v%writing .or. .not. v%given('cells') .or. .not. v%given('length')) return
    call v%require('cells', all(grid%cells >= 1), 'must be 1 or more in each direction')
    call v%require('cells', product(real(grid%cells, wp)) <= most_cells, &
                   'too many cells, at most '//to_text(huge(0))//' in all')
    call require_length(v, 'length', grid%length)
    if (.not. (v%good('cells') .and. v%good('length'))) return
    call v%require('origin', &
                   all(abs(grid%origin) <= farthest_origin*grid%length/real(grid%cells, wp)), &
                   'too far from zero: cell faces would lose their digits')
  end subroutine visit_grid

  !> `&boundary`
  subroutine visit_boundary(v, boundary)
    type(group_visitor_t), intent(inout) :: v
    type(boundary_input_t), intent(inout) :: boundary
    integer :: d, s

    do d = 1, 3
      do s = 1, 2
        call v%option(side_name(s, d), boundary%kind(s, d), &
                      'no_slip slip open periodic inflow outflow')
      end do
    end do
    do d = 1, 3
      do s = 1, 2
        call v%item(side_name(s, d)//'_velocity', boundary%velocity(:, s, d))
      end do
    end do
    do d = 1, 3
      if (.not. (v%good(side_name(1, d)) .and. v%good(side_name(2, d)))) cycle
      do s = 1, 2
        call v%require(side_name(s, d), boundary%kind(s, d) /= 'periodic' &
          .or. boundary%kind(3 - s, d) == 'periodic', 'needs periodic on both sides, but ' &
          //side_name(3 - s, d)//' = '//quoted_text(trim(boundary%kind(3 - s, d))))
      end do
    end do
    do d = 1, 3
      do s = 1, 2
        if (.not. (v%good(side_name(s, d)) .and. v%good(side_name(s, d)//'_velocity'))) cycle
        call require_side_velocity(v, side_name(s, d)//'_velocity', trim(boundary%kind(s, d)), &
                                   boundary%velocity(:, s, d), s, d)
      end do
    end do
  end subroutine visit_boundary

  !> A wall moves in its own plane, an inflow enters the tank, the other sides have no velocity.
  subroutine require_side_velocity(v, variable, kind, velocity, s, d)
    type(group_visitor_t), intent(inout) :: v
    character(*), intent(in) :: variable, kind
    real(wp), intent(in) :: velocity(3)   !! [m/s]
    integer, intent(in) :: s, d           !! 1 lower or 2 upper side; direction
    character(1), parameter :: axis(3) = ['x', 'y', 'z']
    character(8), parameter :: sign_word(2) = ['positive', 'negative']

    select case (kind)
    case ('no_slip', 'slip')
      call v%require(variable, .not. abs(velocity(d)) > 0.0_wp, 'a wall moves in its own plane, ' &
                     //'the '//axis(d)//' component must be 0')
    case ('inflow')
      call v%require(variable, real(3 - 2*s, wp)*velocity(d) > 0.0_wp, 'an inflow must enter the ' &
                     //'tank, the '//axis(d)//' component must be '//sign_word(s))
    case default
      call v%require(variable, .not. any(abs(velocity) > 0.0_wp), 'only walls and inflows have a ' &
                     //'velocity, not a side that is '//quoted_text(kind))
    end select
  end subroutine require_side_velocity

  !> Name of a side of the tank: `x_min`, `x_max`, `y_min`, ...
  pure function side_name(s, d) result(name)
    integer, intent(in) :: s, d   !! 1 lower or 2 upper side; direction
    character(5) :: name
    character(1), parameter :: axis(3) = ['x', 'y', 'z']
    character(4), parameter :: end_name(2) = ['_min', '_max']

    name = axis(d)//end_name(s)
  end function side_name

  !> `&fluid`
  subroutine visit_fluid(v, fluid)
    type(group_visitor_t), intent(inout) :: v
    type(fluid_t), intent(inout) :: fluid

    fluid%line = v%group%line
    call v%item('liquid_density', fluid%liquid_density)
    call v%item('liquid_viscosity', fluid%liquid_viscosity)
    call v%item('gas_density', fluid%gas_density)
    call v%item('gas_viscosity', fluid%gas_viscosity)
    call v%item('gravity', fluid%gravity)
    call v%item('water_level', fluid%water_level)
    call v%item('surface_tension', fluid%surface_tension)
    call v%item('single_phase', fluid%single_phase)
    call v%item('velocity', fluid%velocity)
    call v%item('initial_state', fluid%initial_state)

    call require_density(v, 'liquid_density', fluid%liquid_density)
    call require_density(v, 'gas_density', fluid%gas_density)
    call require_not_negative(v, 'liquid_viscosity', fluid%liquid_viscosity, '[Pa s]')
    call require_not_negative(v, 'gas_viscosity', fluid%gas_viscosity, '[Pa s]')
    call require_not_negative(v, 'surface_tension', fluid%surface_tension, '[N/m]')
  end subroutine visit_fluid

  !> `&water`
  subroutine visit_water(v, water)
    type(group_visitor_t), intent(inout) :: v
    type(water_t), intent(inout) :: water

    water%line = v%group%line
    call v%needed('min', 'the lower corner of the box of liquid [m]')
    call v%needed('max', 'the upper corner of the box of liquid [m]')
    call v%item('min', water%min)
    call v%item('max', water%max)
    if (.not. (all(is_given(water%min)) .and. all(is_given(water%max)))) return
    call v%require('max', all(water%max > water%min), 'must be larger than min in every direction')
  end subroutine visit_water

  !> `&numerics`
  subroutine visit_numerics(v, numerics)
    type(group_visitor_t), intent(inout) :: v
    type(numerics_t), intent(inout) :: numerics

    call v%option('coupling', numerics%coupling, 'monolithic mics')
    call v%item('coupling_passes', numerics%coupling_passes)
    call v%option('momentum', numerics%momentum, 'conservative c_ismac')
    call v%option('advection', numerics%advection, 'tvd5 upwind')
    call v%option('interface', numerics%interface, 'plic')
    call v%option('solid_fraction', numerics%solid_fraction, 'exact subcell')
    call v%item('subcells', numerics%subcells)
    call v%option('pressure_solver', numerics%pressure_solver, 'cg bicgstab')
    call v%option('preconditioner', numerics%preconditioner, 'multigrid jacobi none')
    call v%item('divergence_tolerance', numerics%divergence_tolerance)
    call v%item('max_pressure_passes', numerics%max_pressure_passes)

    call require_range(v, 'coupling_passes', numerics%coupling_passes, 1, 1000)
    if (v%good('coupling')) then
      call v%require('coupling_passes', &
                     numerics%coupling_passes == 1 .or. numerics%coupling == 'mics', &
                     'only coupling = ''mics'' makes more than one pass')
    end if
    call require_range(v, 'subcells', numerics%subcells, 1, 32)
    call v%require('divergence_tolerance', numerics%divergence_tolerance > 0.0_wp, &
                   'must be positive [1/s]')
    call require_range(v, 'max_pressure_passes', numerics%max_pressure_passes, 1, 1000)
  end subroutine visit_numerics

  !> `&contact`
  subroutine visit_contact(v, contact)
    type(group_visitor_t), intent(inout) :: v
    type(contact_input_t), intent(inout) :: contact

    call v%option('model', contact%model, 'surface spheres')
    call v%option('law', contact%law, 'restitution constants')
    call v%item('restitution', contact%restitution)
    call v%item('contact_time', contact%contact_time)
    call v%item('k_n', contact%k_n)
    call v%item('gamma_n', contact%gamma_n)
    call v%item('eta_n', contact%eta_n)
    call v%item('k_t', contact%k_t)
    call v%item('gamma_t', contact%gamma_t)
    call v%item('eta_t', contact%eta_t)
    call v%item('friction', contact%friction)
    call v%item('wall_friction', contact%wall_friction)
    call v%item('substep_ratio', contact%substep_ratio)
    call v%item('courant_max', contact%courant_max)
    call v%item('sleep', contact%sleep)
    call v%item('lubrication', contact%lubrication)

    call require_share(v, 'restitution', contact%restitution)
    call v%require('contact_time', contact%contact_time > 0.0_wp, 'must be positive [s]')
    call v%require('k_n', contact%k_n > 0.0_wp, 'must be positive [N/m^gamma_n]')
    call v%require('gamma_n', contact%gamma_n > 0.0_wp, 'must be positive [-]')
    call require_not_negative(v, 'eta_n', contact%eta_n, '[N s/m]')
    call require_not_negative(v, 'k_t', contact%k_t, '[N/m^gamma_t]')
    call v%require('gamma_t', contact%gamma_t > 0.0_wp, 'must be positive [-]')
    call require_not_negative(v, 'eta_t', contact%eta_t, '[N s/m]')
    call require_not_negative(v, 'friction', contact%friction, '[-]')
    call require_not_negative(v, 'wall_friction', contact%wall_friction, '[-]')
    call require_share(v, 'substep_ratio', contact%substep_ratio)
    call require_share(v, 'courant_max', contact%courant_max)
  end subroutine visit_contact

  !> `&shape`
  subroutine visit_shape(v, shape)
    type(group_visitor_t), intent(inout) :: v
    type(shape_input_t), intent(inout) :: shape
    integer :: n

    shape%line = v%group%line
    if (.not. allocated(shape%file)) shape%file = ''
    call v%needed('name', 'what &body and &drop call the shape')
    call v%needed('kind', 'the form, such as ''hexapod''')
    call v%name('name', shape%name)
    call v%option('kind', shape%kind, &
                  'hexapod cube box sphere cylinder tetrapod dolos reef_cube file')
    n = size_count(shape%kind)
    if (shape%kind /= '' .and. n > 0) call v%needed('size', size_meaning(shape%kind))
    if (shape%kind == '') n = 0
    call v%list('size', shape%size, max(n, 1), merge(3, n, n == 0))
    call v%item('density', shape%density)
    call v%item('file', shape%file)
    call v%item('scale', shape%scale)
    call v%item('refinement', shape%refinement)
    call v%option('spheres', shape%spheres, 'centroid inscribed dense')
    call v%item('sphere_spacing', shape%sphere_spacing)

    if (shape%kind == 'file') call v%needed('file', 'a Gmsh .msh file or a mics-shape file')
    call v%require('file', shape%kind == 'file' .or. shape%file == '', &
                   'only a shape of kind ''file'' is read from one')
    call require_length(v, 'size', pack(shape%size, is_given(shape%size)))
    call require_density(v, 'density', shape%density)
    call v%require('scale', shape%scale > 0.0_wp, 'must be positive [-]')
    call require_range(v, 'refinement', shape%refinement, 1, finest_shape)
    call require_not_negative(v, 'sphere_spacing', shape%sphere_spacing, '[m]')
  end subroutine visit_shape

  !> What the size of a kind of shape means.
  pure function size_meaning(kind) result(meaning)
    character(*), intent(in) :: kind
    character(:), allocatable :: meaning

    select case (kind)
    case ('box'); meaning = 'the three edges [m]'
    case ('cylinder'); meaning = 'diameter and height [m]'
    case ('hexapod'); meaning = 'the edge of its seven cubes [m]'
    case ('cube'); meaning = 'the edge [m]'
    case ('sphere'); meaning = 'the diameter [m]'
    case default; meaning = 'the overall height [m]'
    end select
  end function size_meaning

  !> `&body`
  subroutine visit_body(v, body, shapes)
    type(group_visitor_t), intent(inout) :: v
    type(body_input_t), intent(inout) :: body
    character(name_length), intent(in) :: shapes(:)

    body%line = v%group%line
    call visit_shape_name(v, body%shape, shapes)
    call v%needed('position', 'the centre of mass [m]')
    call v%item('position', body%position)
    call visit_attitude(v, body%quaternion)
    call v%item('velocity', body%velocity)
    call v%item('angular_velocity', body%angular_velocity)
    call v%item('fixed', body%fixed)
    call v%item('release_time', body%release_time)
    call require_not_negative(v, 'release_time', body%release_time, '[s]')
  end subroutine visit_body

  !> `&drop`
  subroutine visit_drop(v, drop, shapes)
    type(group_visitor_t), intent(inout) :: v
    type(drop_input_t), intent(inout) :: drop
    character(name_length), intent(in) :: shapes(:)
    logical :: given_attitude
    integer :: i
    character(10), parameter :: attitude(4) = &
      [character(10) :: 'quaternion', 'axis', 'angle_deg', 'tilt_deg']

    drop%line = v%group%line
    call visit_shape_name(v, drop%shape, shapes)
    call v%needed('position', 'the centre of mass [m]')
    call v%item('position', drop%position)
    call v%item('count', drop%count)
    call v%item('first_time', drop%first_time)
    call v%item('interval', drop%interval)
    call v%item('spread', drop%spread)
    call v%option('orientation', drop%orientation, 'given random')
    given_attitude = drop%orientation == 'given'
    if (given_attitude .or. .not. v%writing) then
      call visit_attitude(v, drop%quaternion)
      call v%item('tilt_deg', drop%tilt_deg)
    end if
    call v%item('velocity', drop%velocity)
    call v%item('seed', drop%seed)

    call require_range(v, 'count', drop%count, 1, most_drops)
    call require_not_negative(v, 'first_time', drop%first_time, '[s]')
    call require_not_negative(v, 'interval', drop%interval, '[s]')
    call v%require('spread', all(drop%spread >= 0.0_wp), 'must not be negative [m]')
    call v%require('tilt_deg', drop%tilt_deg >= 0.0_wp .and. drop%tilt_deg <= 180.0_wp, &
                   'must lie between 0 and 180 degrees')
    do i = 1, size(attitude)
      call v%require(trim(attitude(i)), given_attitude .or. .not. v%given(trim(attitude(i))), &
                     'has no meaning with orientation = ''random''')
    end do
  end subroutine visit_drop

  !> `&bed`
  subroutine visit_bed(v, bed)
    type(group_visitor_t), intent(inout) :: v
    type(bed_input_t), intent(inout) :: bed

    bed%line = v%group%line
    call v%item('file', bed%file)
    call v%option('kind', bed%kind, 'heightmap stl')
    call v%require('file', len_trim(bed%file) > 0, 'must name a file with the form of the bed')
  end subroutine visit_bed

  !> The shape of a body or drop: one that exists.
  subroutine visit_shape_name(v, shape, shapes)
    type(group_visitor_t), intent(inout) :: v
    character(name_length), intent(inout) :: shape
    character(name_length), intent(in) :: shapes(:)

    call v%needed('shape', 'the name of a &shape')
    call v%name('shape', shape)
    if (v%writing .or. shape == '') return
    if (size(shapes) == 0) then
      call v%require('shape', .false., 'the case has no &shape group')
    else
      call v%require('shape', any(shapes == shape), 'no &shape has this name, nearest known: ' &
                     //quoted_text(nearest_name(trim(shape), shapes)))
    end if
  end subroutine visit_shape_name

  !> Attitude as a unit quaternion, read from `quaternion` or from `axis` with `angle_deg`.
  subroutine visit_attitude(v, q)
    type(group_visitor_t), intent(inout) :: v
    real(wp), intent(inout) :: q(4)
    real(wp) :: axis(3), angle_deg

    call v%item('quaternion', q)
    if (v%writing) return
    axis = absent
    angle_deg = absent
    call v%item('axis', axis)
    call v%item('angle_deg', angle_deg)

    if (v%given('quaternion')) then
      call v%require('quaternion', .not. (v%given('axis') .or. v%given('angle_deg')), &
                     'give the quaternion, or axis with angle_deg, not both')
      call v%require('quaternion', any(abs(q) > 0.0_wp), 'must not be zero')
    else
      call v%require('axis', v%given('angle_deg') .or. .not. v%given('axis'), &
                     'needs angle_deg as well')
      call v%require('angle_deg', v%given('axis') .or. .not. v%given('angle_deg'), &
                     'needs axis as well')
      call v%require('axis', any(abs(axis) > 0.0_wp), 'must not be zero')
      if (v%good('axis') .and. v%good('angle_deg') .and. v%given('axis')) then
        q = quaternion_from_axis(axis, modulo(angle_deg, 720.0_wp)*pi/180.0_wp)
      end if
    end if
    if (.not. v%good('quaternion')) q = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    q = unit_quaternion(q)
  end subroutine visit_attitude

  !> A quaternion of length one; one that is so already, to round-off, stays as it is, so that
  !! writing and reading again changes nothing.
  pure function unit_quaternion(q) result(unit)
    real(wp), intent(in) :: q(4)
    real(wp) :: unit(4)

    unit = q
    if (abs(dot_product(q, q) - 1.0_wp) > 4.0_wp*epsilon(1.0_wp)) unit = q/norm2(q)
  end function unit_quaternion

  !> Checks across groups.
  subroutine check_together(list, case, v)
    type(namelist_text_t), intent(in) :: list
    type(case_t), intent(in) :: case
    type(group_visitor_t), intent(inout) :: v
    integer :: d, i

    call check_names(case, v%problems)
    if (.not. case%boundary%faulty) call check_streams(list, case, v)
    if (case%grid%faulty .or. case%boundary%faulty) return
    do i = 1, list%n
      if (list%group(i)%name == 'grid') exit
    end do
    if (i > list%n) return
    call v%start_reading(list%group(i))
    do d = 1, 3
      if (case%grid%cells(d) /= 1) cycle
      call v%require('cells', all(case%boundary%kind(:, d) == 'slip') .or. &
        all(case%boundary%kind(:, d) == 'periodic'), &
        'one cell in a direction makes the case 2-D, then '//side_name(1, d)//' and ' &
        //side_name(2, d)//' must both be ''slip'' or ''periodic''')
    end do
  end subroutine check_together

  !> What enters through an inflow must find a way out; an outflow needs a level to keep, and
  !! gravity along it.
  subroutine check_streams(list, case, v)
    type(namelist_text_t), intent(in) :: list
    type(case_t), intent(in) :: case
    type(group_visitor_t), intent(inout) :: v
    logical :: way_out
    integer :: d, s, i

    if (case%run%physics == 'dry') return
    do i = 1, list%n
      if (list%group(i)%name == 'boundary') exit
    end do
    if (i > list%n) return
    call v%start_reading(list%group(i))
    way_out = any(case%boundary%kind == 'open' .or. case%boundary%kind == 'outflow')
    associate (fluid => case%fluid)
      do d = 1, 3
        do s = 1, 2
          call v%require(side_name(s, d), case%boundary%kind(s, d) /= 'inflow' .or. way_out, &
            'what flows in must leave, another side must be ''open'' or ''outflow''')
          if (case%boundary%kind(s, d) /= 'outflow') cycle
          if (.not. any(abs(fluid%gravity) > 0.0_wp)) cycle
          call v%require(side_name(s, d), maxloc(abs(fluid%gravity), 1) /= d, &
            'gravity acts across this side, it can be ''open''')
          call v%require(side_name(s, d), fluid%single_phase .or. is_given(fluid%water_level), &
            'needs &fluid water_level, the level it keeps')
        end do
      end do
    end associate
  end subroutine check_streams

  !> Names of shapes are unique, capital or small letters apart.
  subroutine check_names(case, problems)
    type(case_t), intent(in) :: case
    type(problems_t), intent(inout) :: problems
    integer :: i, j

    do i = 2, size(case%shape)
      do j = 1, i - 1
        if (case%shape(i)%name == '') cycle
        if (lower_case(case%shape(i)%name) /= lower_case(case%shape(j)%name)) cycle
        call problems%add_message('&shape name = '//quoted_text(trim(case%shape(i)%name)) &
          //': the &shape on line '//to_text(case%shape(j)%line)//' has this name already', &
          case%shape(i)%line)
        exit
      end do
    end do
  end subroutine check_names

  !> Every parameter of a case after defaults, as the text of a case with the same meaning.
  function parameters_text(case) result(text)
    type(case_t), intent(in) :: case
    character(:), allocatable :: text
    type(group_visitor_t) :: v
    type(case_t) :: copy   ! what is visited may be changed, though writing never does
    character(name_length) :: no_names(0)
    integer :: g, i

    copy = case
    do g = 1, size(groups)
      do i = 1, number_of(copy, groups(g))
        call v%start_writing(trim(groups(g)))
        call visit_group(v, copy, groups(g), i, no_names)
      end do
    end do
    text = v%text
  end function parameters_text

  !> How many groups of a name a case has; an unused bed is none.
  pure function number_of(case, group) result(n)
    type(case_t), intent(in) :: case
    character(*), intent(in) :: group
    integer :: n

    select case (group)
    case ('water'); n = size(case%water)
    case ('shape'); n = size(case%shape)
    case ('body'); n = size(case%body)
    case ('drop'); n = size(case%drop)
    case ('bed'); n = merge(1, 0, len_trim(case%bed%file) > 0)
    case default; n = 1
    end select
  end function number_of

  subroutine require_not_negative(v, variable, x, unit)
    type(group_visitor_t), intent(inout) :: v
    character(*), intent(in) :: variable
    real(wp), intent(in) :: x
    character(*), intent(in) :: unit

    call v%require(variable, x >= 0.0_wp, 'must not be negative '//unit)
  end subroutine require_not_negative

  !> Lengths of a size that volumes and inertias can be made of without leaving the number range.
  subroutine require_length(v, variable, x)
    type(group_visitor_t), intent(inout) :: v
    character(*), intent(in) :: variable
    real(wp), intent(in) :: x(:)

    call v%require(variable, all(x > 0.0_wp), 'must be positive [m]')
    call v%require(variable, all(x >= shortest .and. x <= 1.0_wp/shortest), &
                   'must lie between '//to_text(shortest)//' and '//to_text(1.0_wp/shortest)//' m')
  end subroutine require_length

  !> Densities likewise.
  subroutine require_density(v, variable, x)
    type(group_visitor_t), intent(inout) :: v
    character(*), intent(in) :: variable
    real(wp), intent(in) :: x

    call v%require(variable, x > 0.0_wp, 'must be positive [kg/m3]')
    call v%require(variable, x >= lightest .and. x <= 1.0_wp/lightest, 'must lie between ' &
                   //to_text(lightest)//' and '//to_text(1.0_wp/lightest)//' kg/m3')
  end subroutine require_density

  !> Above zero, at most one.
  subroutine require_share(v, variable, x)
    type(group_visitor_t), intent(inout) :: v
    character(*), intent(in) :: variable
    real(wp), intent(in) :: x

    call v%require(variable, x > 0.0_wp .and. x <= 1.0_wp, 'must be above 0 and at most 1')
  end subroutine require_share

  subroutine require_range(v, variable, n, least, most)
    type(group_visitor_t), intent(inout) :: v
    character(*), intent(in) :: variable
    integer, intent(in) :: n, least, most

    call v%require(variable, n >= least .and. n <= most, &
                   'must lie between '//to_text(least)//' and '//to_text(most))
  end subroutine require_range

end module case_input_m
