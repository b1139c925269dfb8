!> All groups of a case: which there are, reading them, and the checks across groups that need no
!! geometry.
!!
!! Each group stands in one `visit_...` procedure. Nothing stops here: all that is wrong is
!! collected.
!!
!! A switch, `physics` or another variable of words, .true. or .false., leaves others idle: they are
!! passed over with a warning, so that a case can be tried with other physics. What a file, a motion
!! or the kind of a shape leaves without meaning is an error (`visit_...`).
module case_input_m
  use kinds_m, only: wp, name_length
  use errors_m, only: problems_t, to_text
  use case_types_m, only: case_t, shape_input_t, is_given, has_flow, member_name, max_variants
  use boundary_kinds_m, only: side_code, gives_pressure
  use namelist_text_m, only: group_text_t, cut_groups
  use string_builder_m, only: string_builder_t
  use group_visitor_m, only: group_visitor_t
  use run_groups_m, only: visit_run, visit_grid, visit_boundary, visit_fluid, visit_water, &
    visit_numerics, side_name
  use block_groups_m, only: visit_contact, visit_bed, visit_start, visit_shape, visit_body, &
    visit_drop
  use value_text_m, only: nearest_name, lower_case, printable, quoted_text, &
    parse_integer, words_of
  implicit none
  private
  public :: read_case, parameters_text, group_names, first_repeated, list_entries

  !> The groups of the contract; those from `first_repeated` on may be repeated.
  character(name_length), parameter :: group_names(*) = [character(name_length) :: 'run', 'grid', &
    'boundary', 'fluid', 'numerics', 'contact', 'bed', 'start', 'water', 'shape', 'body', 'drop']
  integer, parameter :: first_repeated = 9
  integer, parameter :: g_bed = 7, g_start = 8, g_water = 9, g_shape = 10, g_body = 11, g_drop = 12

contains

  !> Read the text of a case. Variables that are wrong keep their defaults; see `problems%n` first.
  subroutine read_case(text, case, problems, passed_over)
    character(*), intent(in) :: text
    type(case_t), intent(out) :: case
    type(problems_t), intent(inout) :: problems
    type(problems_t), intent(out), optional :: passed_over   !! what a switch leaves idle
    type(group_text_t), allocatable :: list(:)
    type(group_visitor_t) :: v
    character(name_length), allocatable :: shapes(:)
    integer :: i, g
    integer :: n(size(group_names))            ! how many of each group came by
    integer :: first_line(size(group_names))   ! where the first of each begins

    call set_empty(case)
    case%text = text
    v%problems = problems
    call cut_groups(text, list, v%problems)
    n = [(count([(list(i)%name == group_names(g), i=1, size(list))]), g=1, size(n))]
    allocate (case%water(n(g_water)), case%shape(n(g_shape)), case%body(n(g_body)), &
              case%drop(n(g_drop)))
    shapes = shape_names(list)
    n = 0
    do i = 1, size(list)
      call v%start(list(i))
      g = findloc(group_names == list(i)%name, .true., 1)
      if (g == 0) then
        call v%report(': unknown group, nearest known: &' &
                      //nearest_name(printable(list(i)%name), group_names))
      else if (n(g) > 0 .and. g < first_repeated) then
        call v%report(': the group is given twice, first on line '//to_text(first_line(g)))
      else
        if (n(g) == 0) first_line(g) = list(i)%line
        n(g) = n(g) + 1
        call visit_group(v, case, group_names(g), n(g), shapes)
        list(i) = v%group   ! remembers which variables are faulty
      end if
    end do
    do g = 1, 2   ! run and grid hold required variables
      if (n(g) > 0) cycle
      call v%start_empty(group_names(g))
      call visit_group(v, case, group_names(g), 1, shapes)
    end do
    call check_together(list, case, v)
    call name_members(case)
    case%contact%bed_friction = merge(case%bed%friction, case%contact%wall_friction, &
      is_given(case%bed%friction))
    problems = v%problems
    if (present(passed_over)) passed_over = v%passed_over
    if (case%fluid%single_phase) then   ! the liquid fills the whole tank
      deallocate (case%water)
      allocate (case%water(0))
    end if
    if (case%run%physics /= 'fluid') return
    deallocate (case%shape, case%body, case%drop)   ! fluid alone
    allocate (case%shape(0), case%body(0), case%drop(0))
  end subroutine read_case

  !> A family of stones becomes one shape for each; each body that names the family takes the next.
  subroutine name_members(case)
    type(case_t), intent(inout) :: case
    type(shape_input_t), allocatable :: all(:)
    integer :: s, k, n, b

    allocate (all(sum([(max(1, members(case%shape(s))), s=1, size(case%shape))])))
    n = 0
    do s = 1, size(case%shape)
      associate (family => case%shape(s))
        do k = min(1, members(family)), members(family)
          n = n + 1
          all(n) = family
          all(n)%member = k
        end do
        if (members(family) == 0) cycle
        k = 0
        do b = 1, size(case%body)
          if (case%body(b)%shape /= family%name) cycle
          case%body(b)%shape = member_name(family, 1 + mod(k, family%variants))
          k = k + 1
        end do
      end associate
    end do
    call move_alloc(all, case%shape)
  end subroutine name_members

  !> Stones of a family; 0 for any other shape.
  pure function members(shape) result(n)
    type(shape_input_t), intent(in) :: shape
    integer :: n

    n = merge(shape%variants, 0, shape%kind == 'rock')
  end function members

  !> Texts that the types of a case cannot give a default to.
  subroutine set_empty(case)
    type(case_t), intent(inout) :: case

    case%run%output = 'mics-out'
    case%bed%file = ''
    case%start%file = ''
    case%fluid%initial_state = ''
  end subroutine set_empty

  !> Read one group: the n-th of its name.
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
    case ('start'); call visit_start(v, case%start)
    case default; error stop 'visit_group: a group of the list has no procedure'
    end select
    call v%finish()
  end subroutine visit_group

  !> The names the shapes of the case were given, right or wrong, and those of the stones of
  !! families.
  pure function shape_names(list) result(names)
    type(group_text_t), intent(in) :: list(:)
    character(name_length), allocatable :: names(:)
    type(shape_input_t) :: family, by_default
    integer :: i, k, info

    allocate (names(0))
    do i = 1, size(list)
      if (list(i)%name /= 'shape') cycle
      family = shape_input_t(name=first_value(list(i), 'name'), &
        kind=first_value(list(i), 'kind'))
      names = [character(name_length) :: names, family%name]
      if (family%kind /= 'rock') cycle
      if (first_value(list(i), 'variants') /= '') then   ! as far as it can be read
        call parse_integer(trim(first_value(list(i), 'variants')), family%variants, info)
        if (family%variants < 1 .or. family%variants > max_variants) family%variants = &
          by_default%variants
      end if
      names = [character(name_length) :: names, &
        [(member_name(family, k), k=1, family%variants)]]
    end do
  end function shape_names

  !> The first value that a group gives a variable, as text; empty if it gives none.
  pure function first_value(group, variable) result(text)
    type(group_text_t), intent(in) :: group
    character(*), intent(in) :: variable
    character(name_length) :: text
    integer :: j

    text = ''
    j = group%find(variable)
    if (j == 0) return
    if (size(group%assignment(j)%value) > 0) text = group%assignment(j)%value(1)%text
  end function first_value

  !> Checks across groups.
  subroutine check_together(list, case, v)
    type(group_text_t), intent(inout) :: list(:)
    type(case_t), intent(in) :: case
    type(group_visitor_t), intent(inout) :: v
    integer :: d, i, n

    call check_names()
    call check_streams()
    if (case%run%physics == 'light') call check_given_water()
    call find_idle()
    n = 0
    do i = 1, size(list)
      if (list(i)%name /= 'drop') cycle
      n = n + 1
      call v%start(list(i))
      call v%require('attitude', case%drop(n)%handling%attitude == 'given' &
        .or. len_trim(case%bed%file) > 0, 'needs a &bed')
    end do
    i = first_of(list, 'grid')
    if (i == 0 .or. case%grid%cells_faulty) return
    call v%start(list(i))
    do d = 1, 3
      if (case%grid%cells(d) /= 1 .or. any(case%boundary%faulty(:, d))) cycle
      call v%require('cells', all(case%boundary%kind(:, d) == 'slip') .or. &
        all(case%boundary%kind(:, d) == 'periodic'), &
        'one cell in a direction makes the case 2-D, then '//side_name(1, d)//' and ' &
        //side_name(2, d)//' must both be ''slip'' or ''periodic''')
    end do
  contains
    !> Names of shapes are unique, capital or small letters apart, those of stones included.
    subroutine check_names()
      character(name_length) :: small
      integer :: i, j, k

      do i = 1, size(case%shape)
        small = lower_case(case%shape(i)%name)
        if (small == '') cycle
        do j = 1, size(case%shape)
          if (j == i) cycle
          if (small /= lower_case(case%shape(j)%name) .or. j > i) then
            if (.not. any([(lower_case(member_name(case%shape(j), k)) == small, &
              k=1, members(case%shape(j)))])) cycle   ! nor that of a stone
          end if
          call v%problems%add_message('&shape name = '//quoted_text(trim(case%shape(i)%name)) &
            //': the &shape on line '//to_text(case%shape(j)%line)//' has this name already', &
            case%shape(i)%line)
          exit
        end do
      end do
    end subroutine check_names

    !> What enters through an inflow must find a way out; an outflow needs a level to keep, and
    !! gravity along it.
    subroutine check_streams()
      logical :: way_out
      integer :: d, s, i

      i = first_of(list, 'boundary')
      if (i == 0 .or. .not. has_flow(case%run)) return
      call v%start(list(i))
      way_out = any(gives_pressure([side_code(case%boundary%kind)])) .or. any(case%boundary%faulty)
      associate (fluid => case%fluid)
        do d = 1, 3
          do s = 1, 2
            if (case%boundary%faulty(s, d)) cycle
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

    !> What a water without a flow has: a level between gravity and the sides, and a current along
    !! it.
    subroutine check_given_water()
      character(*), parameter :: light = 'physics = ''light'' '
      integer :: i

      call v%start_empty('fluid')
      i = first_of(list, 'fluid')
      if (i > 0) call v%start(list(i))
      associate (fluid => case%fluid)
        call v%require('single_phase', .not. fluid%single_phase, &
          light//'needs a level of the water')
        if (.not. (fluid%single_phase .or. is_given(fluid%water_level)) &
            .and. v%good('water_level')) call v%report(': '//light//'needs water_level, the ' &
          //'level of the water that is given [m]')
        call v%require('gravity', .not. any(abs(fluid%gravity(1:2)) > 0.0_wp) &
          .and. fluid%gravity(3) < 0.0_wp, light//'has a level, gravity must point straight down')
        call v%require('velocity', .not. abs(fluid%velocity(3)) > 0.0_wp, &
          light//'has a current along the level, its z component must be 0')
      end associate
      i = first_of(list, 'boundary')
      if (i == 0) return
      call v%start(list(i))
      call v%require('z_min', all(case%boundary%kind(1, 3) /= ['open   ', 'inflow ', 'outflow']), &
        light//'keeps its water, the floor cannot be open')
      call v%require('z_max', case%boundary%kind(2, 3) /= 'periodic', &
        light//'has a level, z cannot be periodic')
    end subroutine check_given_water

    !> Look through all groups of a case that has been read: one warning for all groups of a name
    !! without a meaning, then one for each group with variables without one.
    subroutine find_idle()
      character(:), allocatable :: chosen, groups, subject, why
      integer :: i, k, n, line

      chosen = 'physics = '''//trim(case%run%physics)//''''
      groups = ''
      if (case%run%physics == 'fluid') groups = 'contact start shape body drop'
      if (any(case%run%physics == ['dry  ', 'light'])) groups = 'water numerics'
      if (has_flow(case%run) .and. case%fluid%single_phase) groups = trim('water '//groups)
      associate (names => words_of(groups))
        do k = 1, size(names)
          n = 0
          do i = size(list), 1, -1
            if (list(i)%name /= names(k)) cycle
            n = n + 1
            line = list(i)%line
          end do
          subject = '&'//trim(names(k))//': has'
          if (n > 1) subject = to_text(n)//' groups &'//trim(names(k))//': have'
          why = chosen
          if (names(k) == 'water' .and. has_flow(case%run)) why = 'single_phase = .true.'
          if (n > 0) call v%passed_over%add_message(subject//' no meaning with '//why &
            //', passed over', line)
        end do
      end associate
      do i = 1, size(list)
        call v%start(list(i))
        call v%pass_over(idle_variables(list(i)%name), chosen)
        list(i) = v%group
      end do
    end subroutine find_idle

    !> Variables of a group without a meaning in the physics of the case, one blank between them:
    !! 'dry' has of the fluid only gravity; 'light' a water of given density, level and current;
    !! without blocks nothing settles, nothing rubs on a slippery wall, and only a bed is solid.
    pure function idle_variables(group) result(names)
      character(*), intent(in) :: group
      character(:), allocatable :: names

      names = ''
      select case (trim(case%run%physics)//' '//group)
      case ('dry run', 'light run'); names = 'cfl_max'
      case ('fluid run'); names = 'stop_when_settled rest_speed rest_time'
      case ('dry boundary', 'light boundary'); names = velocities_of('inflow')
      case ('fluid boundary'); names = velocities_of('slip')
      case ('dry fluid'); names = 'liquid_density liquid_viscosity gas_density gas_viscosity ' &
        //'water_level surface_tension single_phase velocity initial_state'
      case ('light fluid'); names = 'liquid_viscosity gas_density gas_viscosity surface_tension ' &
        //'initial_state'
      case ('fluid numerics'); if (len_trim(case%bed%file) == 0) names = 'solid_fraction subcells'
      case ('dry contact', 'light contact'); names = 'lubrication cavitation_pressure'
      case ('dry shape', 'coupled shape'); names = 'drag_coefficient'
      case default   ! all of it counts, or nothing
      end select
    end function idle_variables

    !> The names of the velocities of all sides of a kind, one blank between them.
    pure function velocities_of(kind) result(names)
      character(*), intent(in) :: kind
      character(:), allocatable :: names
      integer :: d, s

      names = ''
      do d = 1, 3
        do s = 1, 2
          if (case%boundary%kind(s, d) == kind) names = names//' '//side_name(s, d)//'_velocity'
        end do
      end do
      names = trim(adjustl(names))
    end function velocities_of
  end subroutine check_together

  !> Number of the first group of a name; 0 if there is none.
  pure function first_of(list, name) result(i)
    type(group_text_t), intent(in) :: list(:)
    character(*), intent(in) :: name
    integer :: i
    integer :: k

    i = findloc([(list(k)%name == name, k=1, size(list))], .true., 1)
  end function first_of

  !> Every parameter of a case after defaults, as the text of a case with the same meaning.
  function parameters_text(case) result(text)
    type(case_t), intent(in) :: case
    character(:), allocatable :: text, value
    type(string_builder_t) :: lines
    type(case_t) :: copy   ! reading a group in which nothing is given leaves it as it is
    type(group_visitor_t) :: v
    character(name_length) :: no_names(0)
    integer :: n(size(group_names))   ! groups of each name; an unused bed is none
    integer :: g, i, k

    copy = case
    n = 1
    n(g_bed) = merge(1, 0, len_trim(case%bed%file) > 0)
    n(g_start) = merge(1, 0, len_trim(case%start%file) > 0)
    n(g_water:g_drop) = [size(case%water), size(case%shape), size(case%body), size(case%drop)]
    do g = 1, size(group_names)
      do i = 1, n(g)
        if (g == g_shape) then
          if (copy%shape(i)%member > 1) cycle   ! of a family already written
        end if
        call v%start_empty(group_names(g))
        call visit_group(v, copy, group_names(g), i, no_names)
        call lines%add_line('&'//trim(group_names(g)))
        do k = 1, v%n
          value = v%entry(k)%value()
          if (v%entry(k)%idle .or. len(value) == 0) cycle
          call lines%add_line('  '//trim(v%entry(k)%name)//' = '//value)
        end do
        call lines%add_line('/')
      end do
    end do
    text = lines%text()
  end function parameters_text

  !> The entries of a group, with the defaults of a case that says nothing.
  subroutine list_entries(group, v)
    character(*), intent(in) :: group
    type(group_visitor_t), intent(out) :: v
    type(case_t) :: case
    character(name_length) :: no_names(0)

    call set_empty(case)
    allocate (case%water(1), case%shape(1), case%body(1), case%drop(1))
    call v%start_empty(group)
    call visit_group(v, case, group, 1, no_names)
  end subroutine list_entries

end module case_input_m
