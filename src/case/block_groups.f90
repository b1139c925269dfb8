!> The groups of the blocks: `&contact`, `&bed`, `&shape`, `&body`, `&drop`.
module block_groups_m
  use kinds_m, only: wp, name_length, pi
  use vectors_m, only: norm, quaternion_from_axis
  use errors_m, only: to_text
  use case_types_m, only: contact_input_t, shape_input_t, body_input_t, drop_input_t, &
    bed_input_t, start_t, handling_t, absent, is_given, size_count, max_variants
  use allowed_values_m, only: allowed_t, any_number, positive, not_negative, share, whole, &
    between
  use group_visitor_m, only: group_visitor_t
  use run_groups_m, only: shortest, lightest
  use value_text_m, only: nearest_name, quoted_text
  implicit none
  private
  public :: visit_contact, visit_bed, visit_start, visit_shape, visit_body, visit_drop

  integer, parameter :: max_drops = 100000, finest_shape = 8

contains

  !> `&contact`
  subroutine visit_contact(v, contact)
    type(group_visitor_t), intent(inout) :: v
    type(contact_input_t), intent(inout) :: contact
    character(*), parameter :: law = 'law = ''constants''', spheres = 'model = ''spheres''  '

    call v%about('how blocks touch one another, the walls and the bed')
    call v%option('model', contact%model, 'surface spheres', 'what touches: points of the ' &
      //'surface against the exact surface, or the contact spheres of the paper', &
      example='''spheres''')
    call v%option('law', contact%law, 'restitution constants', 'where the forces come from: ' &
      //'restitution and contact_time, or, with model = ''spheres'', the ' &
      //'constants k_n to eta_t', example=spheres//law)
    if (contact%law == 'restitution') then
      call v%pass_over('k_n gamma_n eta_n k_t gamma_t eta_t', 'law = ''restitution''')
    else
      call v%pass_over('restitution', 'law = ''constants''')
    end if
    call v%require('law', contact%law == 'restitution' .or. contact%model == 'spheres', &
      'needs model = ''spheres''')
    call v%option('solver', contact%solver, 'impulses springs', 'how the forces are found: ' &
      //'impulses of all contact points together in long steps, with model = ''surface'', or ' &
      //'springs in short ones, with model = ''spheres''; the default follows the model', &
      example=spheres//'solver = ''springs''')
    if (.not. v%given('solver') .and. contact%model == 'spheres') contact%solver = 'springs'
    call v%require('solver', contact%solver == 'impulses' .or. contact%model == 'spheres', &
      'needs model = ''spheres''; surfaces take solver = ''impulses'', the default')
    call v%require('solver', contact%solver == 'springs' .or. contact%model == 'surface', &
      'needs model = ''surface''')
    if (contact%solver == 'impulses') call v%pass_over('substep_ratio courant_max', &
      'solver = ''impulses''')
    call v%real('restitution', contact%restitution, between(0.0_wp, 1.0_wp, '-'), &
      'speed after over speed before a central impact without friction; springs: 0.01 at least', &
      example='0.5')
    call v%real('contact_time', contact%contact_time, positive('s'), &
      'how long an impact acts, and the longest step of blocks that touch; shorter makes them ' &
      //'stiffer. Springs: steps of a twentieth; impacts are shorter below restitution 0.135', &
      example='0.001')
    call v%real('k_n', contact%k_n, positive('N/m^gamma_n'), 'stiffness normal to the surface, ' &
      //'with '//law//', of each pair of spheres', example=spheres//law//'  k_n = 2e5')
    call v%real('gamma_n', contact%gamma_n, between(1.0_wp, 10.0_wp, '-'), &
      'power of the overlap, with '//law, example=spheres//law//'  gamma_n = 1.5')
    call v%real('eta_n', contact%eta_n, not_negative('N s/m'), &
      'damping normal to the surface, with '//law, example=spheres//law//'  eta_n = 5')
    call v%real('k_t', contact%k_t, not_negative('N/m^gamma_t'), &
      'stiffness along the surface, with '//law, example=spheres//law//'  k_t = 2e5')
    call v%real('gamma_t', contact%gamma_t, positive('-'), &
      'power of the displacement along the surface, with '//law, &
      example=spheres//law//'  gamma_t = 1.5')
    call v%real('eta_t', contact%eta_t, not_negative('N s/m'), &
      'damping along the surface, with '//law, example=spheres//law//'  eta_t = 5')
    call v%real('friction', contact%friction, not_negative('-'), &
      'coefficient of Coulomb friction, block on block', example='0.5')
    call v%real('wall_friction', contact%wall_friction, not_negative('-'), &
      'coefficient of Coulomb friction, block on wall, and on the bed but for &bed friction', &
      example='0.5')
    call v%real('substep_ratio', contact%substep_ratio, share, &
      'longest step of the blocks over that of the run, with springs', &
      example=spheres//'substep_ratio = 0.02')
    call v%real('courant_max', contact%courant_max, share, 'way of a block in one of its ' &
      //'steps over the size of its contact spheres, at most: eq. (6) of the paper, springs', &
      example=spheres//'courant_max = 0.05')
    call v%logical('sleep', contact%sleep, 'blocks at rest cost nothing until something ' &
      //'disturbs them')
    call v%logical('lubrication', contact%lubrication, 'what the grid misses of the films of ' &
      //'liquid between spheres, and between spheres and walls, brakes them')
    if (.not. contact%lubrication) call v%pass_over('cavitation_pressure', 'lubrication = .false.')
    call v%real('cavitation_pressure', contact%cavitation_pressure, positive('Pa'), 'suction at ' &
      //'which such a film cavitates: pressure of the air and of the water above', &
      example='lubrication = .true.  cavitation_pressure = 2.0e5')
  end subroutine visit_contact

  !> `&bed`
  subroutine visit_bed(v, bed)
    type(group_visitor_t), intent(inout) :: v
    type(bed_input_t), intent(inout) :: bed

    bed%line = v%group%line
    call v%about('a fixed floor of any form, for blocks and water')
    call v%text('file', bed%file, 'the file with the form of the bed; the group needs it', &
      example='''mound.txt''')
    call v%option('kind', bed%kind, 'heightmap stl', 'what the file holds: a map of heights, or ' &
      //'triangles in m', example='file = ''slope.stl''  kind = ''stl''')
    call v%real('friction', bed%friction, not_negative('-'), 'coefficient of Coulomb friction, ' &
      //'block on bed; by default wall_friction', example='file = ''mound.txt''  friction = 0.7')
    call v%require('file', len_trim(bed%file) > 0, 'must name a file with the form of the bed')
    call v%judge('file kind', bed%faulty)
  end subroutine visit_bed

  !> `&start`
  subroutine visit_start(v, start)
    type(group_visitor_t), intent(inout) :: v
    type(start_t), intent(inout) :: start

    start%line = v%group%line
    call v%about('free blocks begin where another run left them')
    call v%text('file', start%file, 'results of that run; the group needs it. Its blocks that ' &
      //'were released by then and move freely begin at their place, attitude and velocity of ' &
      //'then: the first of a shape is the first free block of that shape here, and so on; a ' &
      //'shape of which this case names no free block brings its own', example='''fill/run.h5''')
    call v%real('time', start%time, any_number('s'), &
      'time of that run, -1: its end; the last row until then counts', &
      example='file = ''fill/run.h5''  time = 0.01')
    call v%real('shift', start%shift, any_number('m'), 'these blocks are shifted by it', &
      example='file = ''fill/run.h5''  shift = 0.1, 0, 0')
    call v%require('file', len_trim(start%file) > 0, 'must name the run.h5 of a run')
    call v%require('time', start%time >= 0.0_wp .or. abs(start%time + 1.0_wp) <= 0.0_wp, &
      'must not be negative [s]; -1 means the end of that run')
  end subroutine visit_start

  !> `&shape`
  subroutine visit_shape(v, shape)
    type(group_visitor_t), intent(inout) :: v
    type(shape_input_t), intent(inout) :: shape
    type(allowed_t) :: lengths
    integer :: n, most

    shape%line = v%group%line
    call v%about('a kind of block: its form, size and density')
    call v%name('name', shape%name, 'what &body and &drop call the shape', &
      example='''hexapod''', required=.true.)
    call v%option('kind', shape%kind, &
      'hexapod cube box sphere cylinder tetrapod dolos reef_cube rock file', &
      'the form, such as ''hexapod''', example='size = 0.02  kind = ''hexapod''', &
      required=.true.)
    if (shape%kind /= '') then
      call v%without_meaning(shape%kind == 'file', 'size refinement', 'kind = ''file''', &
        'the file has the size and the tetrahedra')
      call v%without_meaning(shape%kind /= 'file', 'file scale', &
        'kind = '//quoted_text(trim(shape%kind)), 'only kind = ''file'' has it')
      call v%without_meaning(shape%kind == 'rock', 'size', 'kind = ''rock''', &
        'mass_50 and density give the size')
      call v%without_meaning(shape%kind /= 'rock', 'seed variants mass_50 uniformity mass_min ' &
        //'mass_max elongation blockiness', 'kind = '//quoted_text(trim(shape%kind)), &
        'only kind = ''rock'' has it')
      call v%without_meaning(shape%kind == 'sphere', 'spheres sphere_spacing', &
        'kind = ''sphere''', 'a sphere touches as one')
    end if
    n = size_count(shape%kind)
    if (shape%kind /= '' .and. n > 0) call v%needed('size', size_meaning(shape%kind)//' [m]')
    if (shape%kind == '') n = 0
    most = merge(3, n, n == 0)
    lengths = between(shortest, 1.0_wp/shortest, 'm')
    lengths%fewest = max(n, 1)
    call v%real('size', shape%size(:most), lengths, 'for every kind but ''file'' and ' &
      //'''rock''. box: '//size_meaning('box')//'; cylinder: '//size_meaning('cylinder') &
      //'; hexapod: '//size_meaning('hexapod')//'; cube: '//size_meaning('cube')//'; sphere: ' &
      //size_meaning('sphere')//'; others: '//size_meaning('tetrapod'), &
      example='kind = ''box''  size = 0.02, 0.03, 0.04')
    call v%real('density', shape%density, between(lightest, 1.0_wp/lightest, 'kg/m3'), &
      'density of the material', example='2400')
    if (shape%kind == 'file') call v%needed('file', 'a Gmsh .msh file or a mics-shape file')
    call v%text('file', shape%file, 'for kind = ''file'': tetrahedra, as a Gmsh .msh file or ' &
      //'a mics-shape file (tools/make_shape.py)', &
      example='kind = ''file''  file = ''block.txt''')
    call v%real('scale', shape%scale, positive('-'), 'for kind = ''file'': the coordinates ' &
      //'are multiplied by it to be in m', &
      example='kind = ''file''  file = ''block.txt''  scale = 0.001')
    call v%integer('refinement', shape%refinement, between(1, finest_shape), &
      'how finely a built-in form is cut into tetrahedra', example='3')
    call v%option('spheres', shape%spheres, 'centroid inscribed dense', 'contact spheres of the ' &
      //'shape: about the centroid of each tetrahedron at the surface as in the paper, the ' &
      //'largest in each of these, or close together along the surface', example='''dense''')
    if (shape%spheres /= 'dense' .and. v%good('spheres')) call v%pass_over('sphere_spacing', &
      'spheres = '//quoted_text(trim(shape%spheres)))
    call v%real('sphere_spacing', shape%sphere_spacing, &
      not_negative('m', zero='0 means a tenth of the smallest edge'), &
      'distance of the contact spheres, for spheres = ''dense''', &
      example='spheres = ''dense''  sphere_spacing = 0.002')
    call v%real('drag_coefficient', shape%drag_coefficient, not_negative('-'), &
      'for physics = ''light'' only: C of the drag on each facet, C/3 of the whole surface for ' &
      //'a compact block; `mics-tools calibrate` fits it to resolved falls', example='0.6')
    call visit_rock()
    call v%judge('name kind size file scale refinement seed variants mass_50 uniformity mass_min ' &
      //'mass_max elongation blockiness', shape%faulty)
  contains
    !> The variables of `&shape` that a family of stones has.
    subroutine visit_rock()
      character(*), parameter :: kind = 'kind = ''rock''  '

      call v%integer('seed', shape%seed, whole, 'for kind = ''rock'': the stones; another ' &
        //'number draws others, the same number the same on every machine', &
        example=kind//'seed = 7')
      call v%integer('variants', shape%variants, between(1, max_variants), 'for kind = ''rock'': ' &
        //'stones of the family, NAME-01 and so on; each drop draws one, each &body takes the ' &
        //'next', &
        example=kind//'variants = 50')
      call v%real('mass_50', shape%mass_50, positive('kg'), 'for kind = ''rock'': half of the ' &
        //'stones are lighter, before mass_min and mass_max cut the grade', &
        example=kind//'mass_50 = 60')
      call v%real('uniformity', shape%uniformity, between(0.1_wp, 100.0_wp, '-'), 'for kind = ' &
        //'''rock'': n of Rosin and Rammler, mass = mass_50 (ln(1/(1 - y))/ln 2)^(1/n) with the ' &
        //'share y of the stones lighter; larger is more uniform', example=kind//'uniformity = 5')
      call v%real('mass_min', shape%mass_min, not_negative('kg', zero='0 means no bound'), &
        'for kind = ''rock'': no stone is lighter', example=kind//'mass_min = 0.05')
      call v%real('mass_max', shape%mass_max, not_negative('kg', zero='0 means no bound'), &
        'for kind = ''rock'': no stone is heavier', example=kind//'mass_max = 0.2')
      call v%real('elongation', shape%elongation, between(1.0_wp, 10.0_wp, '-'), &
        'for kind = ''rock'': longest over shortest edge of the box around a stone', &
        example=kind//'elongation = 2')
      call v%real('blockiness', shape%blockiness, between(0.3_wp, 0.9_wp, '-'), &
        'for kind = ''rock'': volume of a stone over that of the box around it', &
        example=kind//'blockiness = 0.6')
      if (shape%kind /= 'rock') return
      call v%require('name', len_trim(shape%name) <= name_length - 5, 'the name of a family has ' &
        //'at most '//to_text(name_length - 5)//' letters, its stones are numbered')
      if (shape%mass_max <= 0.0_wp .or. .not. v%good('mass_min mass_max mass_50 uniformity')) return
      call v%require('mass_max', shape%mass_max > shape%mass_min, 'must be above mass_min = ' &
        //to_text(shape%mass_min)//' kg, or 0 for no bound')
    end subroutine visit_rock
  end subroutine visit_shape

  !> What the size of a kind of shape means [m].
  pure function size_meaning(kind) result(meaning)
    character(*), intent(in) :: kind
    character(:), allocatable :: meaning

    select case (kind)
    case ('box'); meaning = 'the three edges'
    case ('cylinder'); meaning = 'diameter and height'
    case ('hexapod'); meaning = 'the edge of its seven cubes'
    case ('cube'); meaning = 'the edge'
    case ('sphere'); meaning = 'the diameter'
    case default; meaning = 'the overall height'
    end select
  end function size_meaning

  !> `&body`
  subroutine visit_body(v, body, shapes)
    type(group_visitor_t), intent(inout) :: v
    type(body_input_t), intent(inout) :: body
    character(name_length), intent(in) :: shapes(:)

    body%line = v%group%line
    call v%about('one block, there from the start or released later', &
      ways='shape position|shape motion')
    call visit_shape_name(v, body%shape, shapes, required=.true.)
    call v%text('motion', body%motion, 'a table that moves a fixed block, in place of position: ' &
      //'a CSV file of columns time, x, y, z and, if it turns, qw, qx, qy, qz; smooth ' &
      //'between rows, held before and after', example='fixed = .true.  motion = ''door.csv''')
    call v%real('position', body%position, any_number('m'), 'the centre of mass', &
      example='0.15, 0.05, 0.1', required=len_trim(body%motion) == 0)
    body%attitude_given = v%given('quaternion') .or. v%given('axis')
    call visit_attitude(v, body%quaternion)
    call v%without_meaning(len_trim(body%motion) > 0, 'velocity angular_velocity', 'motion', &
      'the table has the motion')
    call v%real('velocity', body%velocity, any_number('m/s'), &
      'velocity at the release; a fixed block keeps it', example='0, 0, -0.1')
    call v%real('angular_velocity', body%angular_velocity, any_number('rad/s'), &
      'spin about the axes of the tank, likewise', example='0, 0, 6.28')
    call v%logical('fixed', body%fixed, 'held in its place, or moved at its given velocity ' &
      //'for ever, or by motion')
    if (len_trim(body%motion) > 0) call v%require('motion', body%fixed .or. .not. v%good('fixed'), &
      'moves a fixed block, needs fixed = .true.')
    call v%real('release_time', body%release_time, not_negative('s'), &
      'when the block is let go; before, it displaces and touches nothing', example='2')
    call v%judge('shape position quaternion axis angle_deg motion', body%faulty)
    call v%judge('fixed velocity angular_velocity release_time motion', body%time_faulty)
  end subroutine visit_body

  !> `&drop`
  subroutine visit_drop(v, drop, shapes)
    type(group_visitor_t), intent(inout) :: v
    type(drop_input_t), intent(inout) :: drop
    character(name_length), intent(in) :: shapes(:)
    logical :: table   ! names a file

    drop%line = v%group%line
    call v%about('blocks dropped one after another: at one place, along a line, or as a table ' &
      //'says', ways='shape position|shapes position|file')
    call v%text('file', drop%file, 'a table of places in CSV, in place of shape to interval, ' &
      //'orientation to angle_deg, velocity: columns shape, x, y, z (empty: on what lies there), ' &
      //'time; if wanted qw, qx, qy, qz or yaw_deg, pitch_deg, roll_deg; vx, vy, vz; fixed; name', &
      example='''plan.csv''')
    table = len_trim(drop%file) > 0
    if (.not. v%good('file')) table = v%given('file')
    call v%without_meaning(table, 'shape shapes weights position to count first_time interval ' &
      //'orientation quaternion axis angle_deg velocity', 'a file of places', 'the file has it')
    call visit_drop_shapes()
    call v%real('position', drop%position, any_number('m'), 'the centre of mass', &
      example='0.15, 0.05, 0.16', required=.not. table)
    call v%integer('count', drop%count, between(1, max_drops), 'how many blocks', example='6')
    if (drop%count == 1 .and. v%good('count') .and. .not. table) call v%pass_over('to', 'count = 1')
    call v%real('to', drop%to, any_number('m'), 'the last block is here, the others evenly ' &
      //'between position and here', example='count = 6  to = 0.2, 0.05, 0.16')
    call v%real('first_time', drop%first_time, not_negative('s'), 'when the first is let go, or ' &
      //'begins to be lowered', example='0.5')
    call v%real('interval', drop%interval, not_negative('s'), 'time from one to the next', &
      example='2')
    call v%real('spread', drop%spread, not_negative('m'), &
      'each block is shifted at random by up to this to both sides, in x, y, z', &
      example='0.005, 0.005, 0')
    call v%option('orientation', drop%orientation, 'given random', 'attitude of the blocks: by ' &
      //'quaternion, or axis and angle_deg; or at random, any rotation as likely as another', &
      example='''random''')
    if (drop%orientation == 'random') call v%pass_over('quaternion axis angle_deg tilt_deg', &
      'orientation = ''random''')
    call visit_attitude(v, drop%quaternion)
    call v%real('tilt_deg', drop%tilt_deg, between(0.0_wp, 180.0_wp, 'degrees'), &
      'each block is tilted at random by up to this about an axis at random', example='10')
    call v%integer('seed', drop%seed, whole, 'the random places and attitudes: ' &
      //'another number draws others, the same number the same on every machine', example='7')
    call visit_handling(drop%handling)
    if (drop%handling%lowering_speed > 0.0_wp) call v%pass_over('velocity', 'lowering_speed > 0')
    call v%real('velocity', drop%velocity, any_number('m/s'), 'velocity at the release', &
      example='0, 0, -0.1')
    call v%judge('file shape shapes weights position count to first_time interval spread ' &
      //'orientation quaternion axis angle_deg tilt_deg seed', drop%faulty)
  contains
    !> What a drop drops: blocks of one shape, or of several drawn by weight.
    subroutine visit_drop_shapes()
      type(allowed_t) :: weights
      logical :: several
      integer :: i, n

      several = v%given('shapes') .or. drop%shapes(1) /= ''
      call v%without_meaning(several, 'shape', 'shapes', 'give one of the two')
      call visit_shape_name(v, drop%shape, shapes, required=.not. (table .or. several))
      call v%names('shapes', drop%shapes, 'several shapes, of which the seed draws one for each ' &
        //'block, in place of shape', example='''hexapod'', ''hexapod''')
      n = count(drop%shapes /= '')
      do i = 1, n
        call require_shape(v, 'shapes', drop%shapes(i), shapes)
      end do
      call v%without_meaning(.not. (several .or. table), 'weights', 'one shape', &
        'shapes draws from several')
      weights = not_negative('-')
      weights%fewest = 1
      call v%real('weights', drop%weights, weights, 'how likely each of shapes is beside others', &
        example='shapes = ''hexapod'', ''hexapod''  weights = 3, 1')
      if (.not. (several .and. v%good('shapes weights'))) return
      if (.not. v%given('weights')) drop%weights(:n) = 1.0_wp
      call v%require('weights', count(is_given(drop%weights)) == n, &
        'must be '//to_text(n)//', one for each of shapes')
      call v%require('weights', any(drop%weights > 0.0_wp), 'one of them must be above 0')
    end subroutine visit_drop_shapes

    !> How a crane handles the blocks of a drop.
    subroutine visit_handling(handling)
      type(handling_t), intent(inout) :: handling
      logical :: lowered

      call v%option('if_blocked', handling%if_blocked, 'wait raise skip', 'what happens to a ' &
        //'block whose place is taken: it waits for room, is raised above what lies there, or ' &
        //'left out', example='''raise''')
      call v%real('lowering_speed', handling%lowering_speed, &
        not_negative('m/s', zero='0 means let go at once'), &
        'the block is held and lowered at this speed until its release', example='0.1')
      lowered = handling%lowering_speed > 0.0_wp .or. .not. v%good('lowering_speed')
      call v%option('release', handling%release, 'place height touch set_down', &
        'where a lowered block is let go: at its place, to which it comes from the water level ' &
        //'(without one the top of the tank); or, lowered from its place, at release_height over ' &
        //'what lies below, or where it touches that; or set down there: its sling gives way to ' &
        //'what it stands on, until it carries less than 5 % of the weight under water', &
        example='lowering_speed = 0.1  release = ''touch''')
      call v%require('release', lowered .or. handling%release == 'place', &
        'needs lowering_speed above 0')
      if (handling%release /= 'height') call v%pass_over('release_height', &
        'release = '//quoted_text(trim(handling%release)))
      call v%real('release_height', handling%release_height, not_negative('m'), &
        'how far above what lies below a lowered block is let go', &
        example='lowering_speed = 0.1  release = ''height''  release_height = 0.02')
      if (handling%release /= 'set_down') call v%pass_over('swivel', &
        'release = '//quoted_text(trim(handling%release)))
      call v%logical('swivel', handling%swivel, 'the sling of a block that is set down holds it ' &
        //'against tilt only: it turns freely about the vertical')
      call v%option('attitude', handling%attitude, 'given bed', 'as given, or turned from that ' &
        //'so that what is level lies on the slope of the bed below (''bed'', with a &bed)', &
        example='''given''')
    end subroutine visit_handling
  end subroutine visit_drop

  !> The shape of a body or drop: one that exists.
  subroutine visit_shape_name(v, shape, shapes, required)
    type(group_visitor_t), intent(inout) :: v
    character(name_length), intent(inout) :: shape
    character(name_length), intent(in) :: shapes(:)
    logical, intent(in) :: required

    call v%name('shape', shape, 'the name of a &shape', example='''hexapod''', required=required)
    if (shape /= '') call require_shape(v, 'shape', shape, shapes)
  end subroutine visit_shape_name

  !> A name must be that of a `&shape`.
  subroutine require_shape(v, variable, shape, shapes)
    type(group_visitor_t), intent(inout) :: v
    character(*), intent(in) :: variable
    character(name_length), intent(in) :: shape, shapes(:)

    if (size(shapes) == 0) then
      call v%require(variable, .false., 'the case has no &shape group')
    else
      call v%require(variable, any(shapes == shape), 'no &shape has this name, nearest known: ' &
                     //quoted_text(nearest_name(trim(shape), shapes)))
    end if
  end subroutine require_shape

  !> Attitude as a unit quaternion, read from `quaternion` or from `axis` with `angle_deg`.
  subroutine visit_attitude(v, q)
    type(group_visitor_t), intent(inout) :: v
    real(wp), intent(inout) :: q(4)
    real(wp) :: axis(3), angle_deg

    call v%real('quaternion', q, any_number('-'), 'attitude as a quaternion w, x, y, z of any ' &
      //'length but 0', example='0.707, 0, 0.707, 0')
    axis = absent
    angle_deg = absent
    call v%real('axis', axis, any_number('-'), 'attitude, in place of quaternion: turned about ' &
      //'this axis through the centre of mass by angle_deg', &
      example='angle_deg = 45  axis = 1, 0, 0')
    call v%real('angle_deg', angle_deg, any_number('degrees'), 'angle of that turn', &
      example='axis = 1, 0, 0  angle_deg = 45')

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
    ! of length one; what is so already, to round-off, stays, so that reading again changes nothing
    if (abs(dot_product(q, q) - 1.0_wp) > 4.0_wp*epsilon(1.0_wp)) q = q/norm(q)
  end subroutine visit_attitude

end module block_groups_m
