!> What `--check` prints: what a run of this case will do, before anything is done.
module case_plan_m
  use, intrinsic :: iso_fortran_env, only: output_unit
  use kinds_m, only: wp, i8
  use vectors_m, only: cube_root, norm
  use errors_m, only: to_text, brief
  use case_types_m, only: case_t, is_given, smallest_spacing, has_flow, not_resolved
  use rigid_body_m, only: blocks_t
  use case_blocks_m, only: blocks_init
  use boundary_kinds_m, only: side_code, gives_pressure
  use named_files_m, only: file_text
  use contact_law_m, only: contact_law_t
  use contact_laws_m, only: choose_law, rest_overlap_share
  use rest_depth_m, only: heaviest_mass
  use tet_mesh_m, only: shape_t, extreme_of_family
  use given_motion_m, only: fastest_between
  use bed_m, only: bed_t
  use wave_step_m, only: gravity_step, capillary_step, viscous_step
  use machine_memory_m, only: available_memory
  use memory_plan_m, only: planned_memory, size_text
  use value_text_m, only: fixed_text
  use bed_measure_m, only: bed_volume
  use overlap_solid_m, only: expected_samples
  use panel_method_m, only: added_inertia_t
  use light_m, only: added_inertia_of
  use surface_features_m, only: surface_init
  use surface_search_m, only: surface_t
  implicit none
  private
  public :: print_plan

  integer, parameter :: label_width = 24      !! columns of the names
  real(wp), parameter :: speed = 1.0_wp       !! at which time-step limits are quoted [m/s]

  !> Time of one step on one core, as measured with a dozen blocks [s].
  real(wp), parameter :: seconds_per_cell = 2.0e-6_wp, seconds_per_block = 1.0e-4_wp
  real(wp), parameter :: seconds_per_substep = 5.5e-6_wp   !! of a block that is awake [s]
  real(wp), parameter :: seconds_per_row = 2.2e-4_wp       !! of results [s]
  real(wp), parameter :: seconds_per_sample = 9.0e-8_wp    !! of a shape, held against the bed [s]
  real(wp), parameter :: substeps_per_contact = 20.0_wp
  real(wp), parameter :: way_of_step = 0.1_wp   !! of a block that falls, over its smallest edge [-]
  real(wp), parameter :: time_awake = 20.0_wp   !! of a block dropped, over sqrt(size/g) [-]
  real(wp), parameter :: share_shaken = 0.035_wp
    !! of the time until the last release in which landing blocks keep one awake that lies [-]

contains

  !> Print the plan of a checked case on standard output.
  subroutine print_plan(case, shapes, bed)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)   !! one for each `&shape`
    type(bed_t), intent(in) :: bed
    type(blocks_t) :: blocks   ! all there will be
    logical :: wet, with_blocks
    type(surface_t) :: surface
    integer :: n_points(size(shapes))   ! of the surface, or contact spheres
    real(wp) :: d_s   ! smallest length of the contact Courant number, eq. (6), of all shapes [m]
    integer :: s

    wet = has_flow(case%run)
    with_blocks = case%run%physics /= 'fluid'
    call blocks_init(case, shapes, blocks, bed)
    d_s = huge(d_s)
    do s = 1, size(shapes)
      if (case%contact%model == 'surface') then
        call surface_init(shapes(s), surface)
        n_points(s) = size(surface%vertex, 2)
        d_s = min(d_s, surface%length)
      else
        n_points(s) = size(shapes(s)%sphere_radius)
        d_s = min(d_s, 2*minval(shapes(s)%sphere_radius))
      end if
    end do
    call print_run(case, wet)
    if (bed%there) call entry('bed from', file_text(trim(case%bed%file))//', ' &
      //to_text(bed%n_given)//' facets, heights from '//place_text(minval(bed%point(3, :)), &
      case%grid%length)//' to '//place_text(maxval(bed%point(3, :)), case%grid%length)//' m')
    if (case%run%physics /= 'dry') call print_liquid(case, bed)
    if (with_blocks) call print_shapes(case, shapes, n_points)
    if (with_blocks) call print_bodies(case, blocks, bed)
    call print_steps(case, blocks, bed, d_s, wet)
    call print_memory(case, shapes, bed)
    call print_files(case, wet)
  end subroutine print_plan

  !> The run, and the tank with its cells.
  subroutine print_run(case, wet)
    type(case_t), intent(in) :: case
    logical, intent(in) :: wet
    character(*), parameter :: axis = 'xyz'
    character(:), allocatable :: corner
    integer :: d

    call heading('Run')
    if (len_trim(case%run%title) > 0) call entry('title', case%run%title)
    select case (case%run%physics)
    case ('coupled'); call entry('physics', 'coupled: water, air and blocks')
    case ('fluid'); call entry('physics', 'fluid: water and air, no blocks')
    case ('light'); call entry('physics', not_resolved//'; blocks in a given water')
    case default; call entry('physics', 'dry: blocks alone')
    end select
    call entry('simulated time', brief(case%run%t_end)//' s')
    if (case%run%stop_when_settled) call entry('ends early', 'when every block is slower than ' &
      //brief(case%run%rest_speed)//' m/s for '//brief(case%run%rest_time)//' s')
    call heading('Tank')
    call entry('length', triple(case%grid%length)//' m')
    corner = ''
    do d = 1, 3
      corner = corner//', '//place_text(case%grid%origin(d), case%grid%length)
    end do
    call entry('lower corner', corner(3:)//' m')
    do d = 1, 3
      call entry('sides in '//axis(d:d), trim(case%boundary%kind(1, d))//' and ' &
        //trim(case%boundary%kind(2, d)))
    end do
    if (.not. wet) return
    associate (n => case%grid%cells)
      call entry('cells', to_text(n(1))//' x '//to_text(n(2))//' x '//to_text(n(3))//' = ' &
        //to_text(product(n)))
    end associate
    call entry('spacing', triple(case%grid%length/real(case%grid%cells, wp))//' m')
  end subroutine print_run

  subroutine print_liquid(case, bed)
    type(case_t), intent(in) :: case
    type(bed_t), intent(in) :: bed
    character(:), allocatable :: without
    real(wp) :: height, volume, high(3)

    call heading('Fluid')
    if (.not. has_flow(case%run)) then
      call entry('liquid', brief(case%fluid%liquid_density)//' kg/m3')
      call entry('water level', place_text(case%fluid%water_level, case%grid%length) &
                 //' m; rises by what is displaced, if no side is open')
      call entry('current', triple(case%fluid%velocity, ', ')//' m/s')
      return
    end if
    call entry('liquid', brief(case%fluid%liquid_density)//' kg/m3, ' &
               //brief(case%fluid%liquid_viscosity)//' Pa s')
    if (case%fluid%single_phase) then
      call entry('liquid at the start', 'everywhere, single phase')
      return
    end if
    call entry('gas', brief(case%fluid%gas_density)//' kg/m3, ' &
               //brief(case%fluid%gas_viscosity)//' Pa s')
    if (is_given(case%fluid%water_level)) then
      height = min(max(case%fluid%water_level - case%grid%origin(3), 0.0_wp), case%grid%length(3))
      volume = height*case%grid%length(1)*case%grid%length(2)
      without = ', bodies included'
      if (bed%there) then
        high = case%grid%origin + case%grid%length
        high(3) = case%grid%origin(3) + height
        volume = volume - bed_volume(bed, case%grid%origin, high)
        without = ' without the bed'//without
      end if
      call entry('water level', place_text(case%fluid%water_level, case%grid%length)//' m; ' &
                 //brief(volume)//' m3 below it'//without)
    end if
    if (size(case%water) == 1 .and. .not. bed%there) then
      volume = product(max(0.0_wp, min(case%water(1)%max, case%grid%origin + case%grid%length) &
        - max(case%water(1)%min, case%grid%origin)))
      call entry('boxes of liquid', '1, '//brief(volume)//' m3, bodies included')
    else if (size(case%water) > 0) then
      call entry('boxes of liquid', to_text(size(case%water)))
    end if
    if (len(case%fluid%initial_state) > 0) then
      call entry('initial state', 'from '//file_text(case%fluid%initial_state))
    else if (size(case%water) == 0 .and. .not. is_given(case%fluid%water_level)) then
      call entry('water level', 'none: no liquid at all')
    end if
  end subroutine print_liquid

  !> A table with one line for each shape: its tetrahedra, what of it touches (points and the
  !! smallest edge of the form, or spheres and the smallest diameter), mass and weight.
  subroutine print_shapes(case, shapes, n_points)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)
    integer, intent(in) :: n_points(:)   !! points or spheres of each
    character(*), parameter :: form = '(2x, a14, 1x, a9, 2(1x, a7), 4(1x, a12), 1x, a13)'
    type(added_inertia_t) :: added
    character(10) :: touching(2)   ! what touches, and its size
    character(:), allocatable :: submerged
    real(wp) :: mass, g, smallest
    integer :: s

    if (size(shapes) == 0) return
    call heading('Shapes')
    touching = ['spheres   ', 'sphere [m]']
    if (case%contact%model == 'surface') touching = ['points    ', 'edge [m]  ']
    write (output_unit, form) 'name          ', 'kind     ', 'tets', trim(touching(1)), &
      trim(touching(2)), 'volume [m3]', 'mass [kg]', 'weight [N]', 'submerged [N]'
    g = norm(case%fluid%gravity)
    do s = 1, size(shapes)
      if (.not. extreme_of_family(shapes, s)) cycle
      mass = shapes(s)%density*shapes(s)%volume
      submerged = '-'
      if (case%run%physics /= 'dry') submerged = brief((mass - case%fluid%liquid_density &
        *shapes(s)%volume)*g)
      smallest = 2*minval(shapes(s)%sphere_radius)
      if (case%contact%model == 'surface') smallest = shapes(s)%smallest_edge
      write (output_unit, form) shapes(s)%name(:14), shapes(s)%kind(:9), &
        to_text(size(shapes(s)%tet, 2)), to_text(n_points(s)), brief(smallest), &
        brief(shapes(s)%volume), brief(mass), brief(mass*g), submerged
    end do
    do s = 1, size(shapes)
      if (shapes(s)%kind == 'file') call entry(trim(shapes(s)%name)//' from', &
        file_text(case%shape(s)%file)//', ' &
        //triple(maxval(shapes(s)%point, 2) - minval(shapes(s)%point, 2))//' m, ' &
        //to_text(size(shapes(s)%facet) - 1)//' facets')   ! its length shows a wrong unit
      if (case%shape(s)%member == 1) call print_family(pack(shapes, shapes%family &
        == shapes(s)%family))
      if (case%run%physics == 'light' .and. extreme_of_family(shapes, s)) then
        added = added_inertia_of(shapes(s))
        call entry(trim(shapes(s)%name)//' in water', 'added mass '//brief(added%mass, 3) &
          //' and inertia '//brief(added%inertia, 2)//' of the displaced, drag coefficient ' &
          //brief(case%shape(s)%drag_coefficient)//' on the facets')
      end if
    end do
  end subroutine print_shapes

  !> The stones of a family; the table has its lightest and its heaviest.
  subroutine print_family(stones)
    type(shape_t), intent(in) :: stones(:)
    real(wp) :: mass(size(stones))
    logical :: heavier(size(stones))
    real(wp) :: half(2)   ! half of the stones, half of the mass is lighter [kg]
    integer :: s

    mass = stones%density*stones%volume
    half = maxval(mass)
    do s = 1, size(mass)
      heavier = mass > mass(s)
      if (2*count(heavier) <= size(mass)) half(1) = min(half(1), mass(s))
      if (2*sum(mass, heavier) <= sum(mass)) half(2) = min(half(2), mass(s))
    end do
    call entry(trim(stones(1)%family), to_text(size(stones))//' stones of '//brief(sum(mass) &
      /real(size(mass), wp))//' kg on average; half of the stones up to '//brief(half(1)) &
      //' kg, half of the mass up to '//brief(half(2))//' kg')
  end subroutine print_family

  subroutine print_bodies(case, blocks, bed)
    type(case_t), intent(in) :: case
    type(blocks_t), intent(in) :: blocks
    type(bed_t), intent(in) :: bed
    real(wp) :: fastest(2)   ! speed and spin [m/s], [rad/s]
    character(:), allocatable :: last
    integer :: n_fixed, n_moved, i

    n_fixed = count(case%body%fixed)
    call heading('Bodies')
    call entry('fixed', to_text(n_fixed))
    call entry('free', to_text(size(case%body) - n_fixed))
    last = ''
    if (blocks%n > size(case%body)) last = ', the last one at ' &
      //brief(maxval(blocks%release_time(size(case%body) + 1:)))//' s'
    call entry('dropped', to_text(blocks%n - size(case%body))//last)
    if (case%begun%n > 0) call entry('begin elsewhere', to_text(case%begun%n)//', where ' &
      //file_text(case%start%file)//' left them at '//brief(case%begun%time)//' s')
    n_moved = 0
    fastest = 0.0_wp
    do i = 1, size(case%body)
      if (case%body(i)%path%n == 0) cycle
      n_moved = n_moved + 1
      fastest = max(fastest, fastest_between(case%body(i)%path, 0.0_wp, case%run%t_end))
    end do
    if (n_moved > 0) call entry('moved by a table', to_text(n_moved)//', up to ' &
      //brief(fastest(1))//' m/s and '//brief(fastest(2))//' rad/s')
    call print_rise(case, blocks, bed)
  end subroutine print_bodies

  !> The level when all that comes later is under water: it rises by the volume of that over the
  !! area of the tank, but not where water can leave through a side or a bed reaches out of it.
  subroutine print_rise(case, blocks, bed)
    type(case_t), intent(in) :: case
    type(blocks_t), intent(in) :: blocks
    type(bed_t), intent(in) :: bed
    character(:), allocatable :: text
    real(wp) :: rise   ! [m]
    logical :: keeps
    integer :: b

    keeps = case%run%physics == 'light'
    if (has_flow(case%run)) keeps = len_trim(case%fluid%initial_state) == 0 &
      .and. .not. case%fluid%single_phase .and. is_given(case%fluid%water_level)
    if (any(gives_pressure([side_code(case%boundary%kind(:, 1:2))])) &
        .or. any(case%boundary%kind(:, 1:2) == 'inflow') &
        .or. gives_pressure(side_code(case%boundary%kind(1, 3))) .or. .not. keeps) return
    if (bed%there) then
      if (maxval(bed%point(3, :)) > case%fluid%water_level) return
    end if
    rise = 0.0_wp
    do b = 1, blocks%n
      if (.not. blocks%present(b)) rise = rise + blocks%shapes(blocks%shape(b))%volume
    end do
    if (rise <= 0.0_wp) return
    rise = rise/(case%grid%length(1)*case%grid%length(2))
    text = 'rises by '//brief(rise)//' m if all that comes later ends under water'
    if (case%fluid%water_level + rise > case%grid%origin(3) + case%grid%length(3)) text = text &
      //', over the top of the tank'
    call entry('water level', text)
  end subroutine print_rise

  !> What limits the steps of the fluid and of the bodies.
  subroutine print_steps(case, blocks, bed, d_s, wet)
    type(case_t), intent(in) :: case
    type(blocks_t), intent(in) :: blocks
    type(bed_t), intent(in) :: bed
    real(wp), intent(in) :: d_s   !! of the contact Courant number [m]
    logical, intent(in) :: wet
    real(wp) :: h, limit

    call heading('Time steps')
    call entry('largest', brief(case%run%dt)//' s, at least ' &
               //count_text(max(1.0_wp, case%run%t_end/case%run%dt))//' steps')
    call entry('time of the run', 'about '//time_text(wet, case, blocks, bed) &
               //' or more on one core')
    h = smallest_spacing(case%grid)
    if (wet .and. maxval(case%grid%cells) > 1) then
      if (case%run%cfl_max > 0.0_wp) then
        call entry('Courant limit', brief(case%run%cfl_max*h/speed)//' s at '//brief(speed) &
                   //' m/s, Courant number '//brief(case%run%cfl_max))
      else
        call entry('Courant limit', 'none, dt is kept')
      end if
      if (gravity_step(case%fluid, h) < huge(h)) then
        call entry('shortest waves', brief(gravity_step(case%fluid, h))//' s')
      end if
      if (capillary_step(case%fluid, h) < huge(h)) then
        call entry('surface tension', brief(capillary_step(case%fluid, h))//' s')
      end if
      limit = viscous_step(case%fluid, sum((case%grid%cells/case%grid%length)**2, &
        case%grid%cells > 1))
      if (limit < case%run%dt) call entry('viscous surface', brief(limit)//' s')
    end if
    if (case%run%physics /= 'fluid' .and. size(blocks%shapes) > 0) call print_body_steps(&
      case, blocks%shapes, d_s)
  end subroutine print_steps

  !> Time for the fewest steps that the run can take.
  function time_text(wet, case, blocks, bed) result(text)
    logical, intent(in) :: wet
    type(case_t), intent(in) :: case
    type(blocks_t), intent(in) :: blocks
    type(bed_t), intent(in) :: bed
    character(:), allocatable :: text
    real(wp) :: seconds

    if (wet) then
      seconds = seconds_per_block*real(blocks%n, wp) &
        + seconds_per_cell*product(real(case%grid%cells, wp))
      seconds = seconds*case%run%t_end/case%run%dt
    else
      seconds = seconds_without_flow(case, blocks, bed)
    end if
    if (seconds < 100.0_wp) then
      text = brief(seconds, 2)//' s'
    else if (seconds < 6000.0_wp) then
      text = brief(seconds/60.0_wp, 2)//' minutes'
    else
      text = brief(seconds/3600.0_wp, 2)//' hours'
    end if
  end function time_text

  !> Time for the substeps of the blocks that are awake, while they come down and until they lie
  !! still; for the rows of results; and for the depth of these blocks in the bed, in each row [s].
  function seconds_without_flow(case, blocks, bed) result(seconds)
    type(case_t), intent(in) :: case
    type(blocks_t), intent(in) :: blocks
    type(bed_t), intent(in) :: bed
    real(wp) :: seconds
    real(wp) :: samples(size(blocks%shapes))
    real(wp) :: g, low, size_of, speed, step, row, fall, moves   ! step, row: times between rows [s]
    real(wp) :: awake, rows, looks   ! of all blocks: time [s], rows, points held against the bed
    integer :: b, n, s

    g = norm(case%fluid%gravity)
    low = case%grid%origin(3)
    samples = 0.0_wp
    if (bed%there) then
      low = max(low, sum(bed%point(3, :))/real(size(bed%point, 2), wp))
      samples = [(expected_samples(blocks%shapes(s)), s=1, size(samples))]
    end if
    n = size(case%body)
    row = max(case%run%dt, case%run%history_interval)
    rows = case%run%t_end/row
    awake = 0.0_wp
    looks = 0.0_wp
    do b = 1, blocks%n
      if (b <= n .and. blocks%fixed(b)) cycle
      associate (shape => blocks%shapes(blocks%shape(b)))
        size_of = cube_root(shape%volume)
        speed = sqrt(g*size_of)   ! about that of a long fall
        step = row
        if (case%run%physics == 'light' .and. speed > 0.0_wp) step = max( &
          case%run%history_interval, min(case%run%dt, way_of_step*shape%smallest_edge/speed))
        if (blocks%handling(b)%lowering_speed > 0.0_wp) then
          speed = blocks%handling(b)%lowering_speed
          step = row
        end if
      end associate
      moves = max(case%run%t_end - blocks%release_time(b), 0.0_wp)
      fall = min(moves, max(blocks%x(3, b) - low, 0.0_wp)/max(speed, tiny(speed)))
      moves = moves - fall
      if (case%contact%sleep .and. g > 0.0_wp) moves = min(moves, time_awake*sqrt(size_of/g))
      awake = awake + fall + moves
      rows = rows + fall*(1.0_wp/step - 1.0_wp/row)
      looks = looks + samples(blocks%shape(b))*(fall/step + moves/row)
    end do
    associate (time => min(blocks%release_time(n + 1:), case%run%t_end))   ! of the drops
      if (case%contact%sleep .and. size(time) > 0) awake = awake &
        + share_shaken*sum(maxval(time) - time)
    end associate
    seconds = seconds_per_substep*awake*substeps_per_contact/case%contact%contact_time &
      + seconds_per_row*rows + seconds_per_sample*looks
  end function seconds_without_flow

  !> Limits of the body steps and, with springs, how far the shapes give way.
  subroutine print_body_steps(case, shapes, d_s)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)
    real(wp), intent(in) :: d_s   !! of the contact Courant number [m]
    class(contact_law_t), allocatable :: law
    character(:), allocatable :: units
    real(wp) :: ratio_step, time_step, courant_step, heaviest, mass, k
    integer :: s

    if (case%contact%solver == 'impulses') then
      call entry('contact step', brief(case%contact%contact_time)//' s, the contact time, at most')
      return
    end if
    ratio_step = case%contact%substep_ratio*case%run%dt
    time_step = case%contact%contact_time/substeps_per_contact
    courant_step = case%contact%courant_max*d_s/speed
    call entry('body step', brief(min(ratio_step, time_step, courant_step)) &
               //' s, the smallest of')
    call entry('  share of dt', brief(ratio_step)//' s')
    call entry('  contact time / 20', brief(time_step)//' s')
    call entry('  contact Courant', brief(courant_step)//' s at '//brief(speed) &
               //' m/s, C_s = '//brief(case%contact%courant_max))
    call choose_law(case%contact, law)
    heaviest = heaviest_mass(case, shapes)
    do s = 1, size(shapes)
      if (.not. extreme_of_family(shapes, s)) cycle
      mass = shapes(s)%density*shapes(s)%volume
      k = law%normal_constant(mass, heaviest, norm(case%fluid%gravity), &
        rest_overlap_share*shapes(s)%smallest_edge)
      units = ' N/m'
      if (abs(law%gamma_n - 1.0_wp) > 0.0_wp) units = ' N/m^'//brief(law%gamma_n)
      call entry('stiffness on a wall', brief(k)//units//' for '//trim(shapes(s)%name))
      if (units /= ' N/m') cycle
      call entry('', 'gives way '//brief(speed*sqrt(mass/k))//' m at '//brief(speed) &
                 //' m/s, '//brief(mass*norm(case%fluid%gravity)/k)//' m at rest')
    end do
  end subroutine print_body_steps

  !> Estimate of the memory of all processes together, and what there is.
  subroutine print_memory(case, shapes, bed)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)
    type(bed_t), intent(in) :: bed
    character(:), allocatable :: text
    integer(i8) :: planned, available

    planned = planned_memory(case, shapes, bed)
    available = available_memory()
    text = size_text(real(planned, wp))
    if (planned > available .and. available > 0) text = text//', MORE than the'
    if (planned <= available) text = text//' of'
    if (available > 0) text = text//' '//size_text(real(available, wp)) &
      //' that this machine has left'
    call heading('Memory')
    call entry('about', text)
  end subroutine print_memory

  !> Files to come, with upper bounds of their size (fields and surfaces are compressed).
  subroutine print_files(case, wet)
    type(case_t), intent(in) :: case
    logical, intent(in) :: wet
    real(wp), parameter :: min_bytes = 6.0e5_wp     ! of run.h5: first blocks of all datasets
    real(wp), parameter :: series_bytes = 23*8.0_wp   ! so many series
    real(wp), parameter :: body_bytes = 27*8.0_wp     ! pose, motion, forces, contacts
    real(wp), parameter :: cell_bytes = 6*4.0_wp      ! liquid, solid, pressure, velocity
    real(wp) :: frames, rows
    integer :: n

    n = size(case%body) + sum(case%drop%count)
    frames = 0.0_wp
    if (case%run%field_interval > 0.0_wp) frames = written(case%run%field_interval)
    rows = written(case%run%history_interval)
    call heading('Files in '//case%run%output)
    call entry('run.h5', 'history of '//to_text(n)//' bodies, '//count_text(rows) &
               //' rows or more, '//size_text(min_bytes &
               + rows*(series_bytes + body_bytes*real(n, wp))))
    if (frames > 0.0_wp .and. wet) then
      call entry('fields.vtkhdf', count_text(frames)//' frames, at most ' &
                 //size_text(frames*cell_bytes*product(real(case%grid%cells, wp))))
    end if
    if (frames > 0.0_wp .and. n > 0) then
      call entry('blocks.vtkhdf', count_text(frames)//' frames')
    end if
    if (case%run%restart_interval > 0.0_wp) then
      call entry('restart-a.h5, -b.h5', 'in turn, every ' &
                 //brief(case%run%restart_interval)//' s')
    else
      call entry('restart-a.h5', 'at the end')
    end if
  contains
    !> How often something is written at the start, at an interval and at the end, in steps of dt.
    pure real(wp) function written(interval)
      real(wp), intent(in) :: interval   !! [s]
      real(wp) :: times

      times = case%run%t_end/max(case%run%dt, interval)
      written = 1.0_wp + aint(times)
      if (times - aint(times) > 1.0e-9_wp) written = written + 1.0_wp
    end function written
  end subroutine print_files

  subroutine heading(text)
    character(*), intent(in) :: text

    write (output_unit, '(a)') text
  end subroutine heading

  !> One line: a name and what is to be said about it.
  subroutine entry(name, text)
    character(*), intent(in) :: name, text
    character(label_width) :: label

    label = name
    write (output_unit, '(2x, a, a)') label, trim(text)
  end subroutine entry

  !> Three numbers.
  pure function triple(x, between) result(text)
    real(wp), intent(in) :: x(3)
    character(*), intent(in), optional :: between
    character(:), allocatable :: text, gap

    gap = ' x '
    if (present(between)) gap = between
    text = brief(x(1))//gap//brief(x(2))//gap//brief(x(3))
  end function triple

  !> A coordinate to a ten-thousandth of the tank, however far from zero the tank lies.
  pure function place_text(x, length) result(text)
    real(wp), intent(in) :: x           !! [m]
    real(wp), intent(in) :: length(3)   !! of the tank [m]
    character(:), allocatable :: text
    character(400) :: buffer
    real(wp) :: rounded

    buffer = fixed_text(x, max(1, 4 - floor(log10(maxval(length)))))
    read (buffer, *) rounded
    text = to_text(rounded)
  end function place_text

  !> A count that may be too large for an integer, rounded down with a little tolerance.
  pure function count_text(x) result(text)
    real(wp), intent(in) :: x
    character(:), allocatable :: text

    text = brief(x)
    if (x < 1.0e9_wp) text = to_text(int(x*(1.0_wp + 1.0e-9_wp)))
  end function count_text

end module case_plan_m
