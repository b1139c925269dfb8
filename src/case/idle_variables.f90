!> What a choice in one group leaves without meaning in others.
!!
!! A choice is a variable of words, .true. or .false. What it leaves without meaning is an error if
!! it is given: of its own group the `visit_...` procedures find it, of others this module. What
!! `physics` leaves without meaning is passed over with a warning instead, in all groups, so that a
!! case can be tried with other physics as it is.
module idle_variables_m
  use errors_m, only: to_text
  use case_types_m, only: case_t, has_flow
  use namelist_text_m, only: namelist_text_t
  use description_m, only: next_word
  use group_visitor_m, only: group_visitor_t
  use run_groups_m, only: side_name
  implicit none
  private
  public :: find_idle

contains

  !> Look through all groups of a case that has been read.
  subroutine find_idle(list, case, v)
    type(namelist_text_t), intent(inout) :: list
    type(case_t), intent(in) :: case
    type(group_visitor_t), intent(inout) :: v
    integer :: i

    select case (case%run%physics)
    case ('dry'); call pass_over_groups(list, 'water numerics', 'physics = ''dry''', v)
    case ('light'); call pass_over_groups(list, 'water numerics', 'physics = ''light''', v)
    case ('fluid')
      call pass_over_groups(list, 'contact start shape body drop', 'physics = ''fluid''', v)
    case default   ! all groups count
    end select
    do i = 1, list%n
      call v%start_reading(list%group(i))
      select case (case%run%physics)
      case ('dry'); call pass_over_in_dry(list%group(i)%name, case, v)
      case ('light'); call pass_over_in_light(list%group(i)%name, v)
      case ('fluid'); call pass_over_in_fluid(list%group(i)%name, case, v)
      case default
        if (list%group(i)%name == 'shape') call v%pass_over('drag_coefficient', &
          'physics = '''//trim(case%run%physics)//'''')
      end select
      if (list%group(i)%name == 'water' .and. case%fluid%single_phase &
          .and. has_flow(case%run)) call v%report( &
        ': has no meaning with &fluid single_phase = .true.; the liquid fills the whole tank')
      list%group(i) = v%group
    end do
  end subroutine find_idle

  !> Blocks alone: of the fluid only gravity acts.
  subroutine pass_over_in_dry(group, case, v)
    character(*), intent(in) :: group
    type(case_t), intent(in) :: case
    type(group_visitor_t), intent(inout) :: v
    character(*), parameter :: chosen = 'physics = ''dry'''

    select case (group)
    case ('run'); call v%pass_over('cfl_max', chosen)
    case ('boundary'); call v%pass_over(velocities_of('inflow', case), chosen)
    case ('fluid'); call v%pass_over('liquid_density liquid_viscosity gas_density gas_viscosity ' &
      //'water_level surface_tension single_phase velocity initial_state', chosen)
    case ('contact'); call v%pass_over('lubrication', chosen)
    case ('shape'); call v%pass_over('drag_coefficient', chosen)
    case default   ! all of it counts, or nothing
    end select
  end subroutine pass_over_in_dry

  !> A given water: its density, level and current count.
  subroutine pass_over_in_light(group, v)
    character(*), intent(in) :: group
    type(group_visitor_t), intent(inout) :: v
    character(*), parameter :: chosen = 'physics = ''light'''

    select case (group)
    case ('run'); call v%pass_over('cfl_max', chosen)
    case ('fluid'); call v%pass_over('liquid_viscosity gas_density gas_viscosity ' &
      //'surface_tension initial_state', chosen)
    case ('contact'); call v%pass_over('lubrication', chosen)
    case default   ! all of it counts, or nothing
    end select
  end subroutine pass_over_in_light

  !> No blocks: nothing settles, nothing rubs on a slippery wall, only a bed is solid.
  subroutine pass_over_in_fluid(group, case, v)
    character(*), intent(in) :: group
    type(case_t), intent(in) :: case
    type(group_visitor_t), intent(inout) :: v
    character(*), parameter :: chosen = 'physics = ''fluid'''

    select case (group)
    case ('run'); call v%pass_over('stop_when_settled rest_speed rest_time', chosen)
    case ('boundary'); call v%pass_over(velocities_of('slip', case), chosen)
    case ('numerics')
      if (len_trim(case%bed%file) == 0) call v%pass_over('solid_fraction subcells', chosen)
    case default   ! all of it counts, or nothing
    end select
  end subroutine pass_over_in_fluid

  !> The names of the velocities of all sides of a kind, one blank between them.
  pure function velocities_of(kind, case) result(names)
    character(*), intent(in) :: kind
    type(case_t), intent(in) :: case
    character(:), allocatable :: names
    integer :: d, s

    names = ''
    do d = 1, 3
      do s = 1, 2
        if (case%boundary%kind(s, d) == kind) names = names//' '//side_name(s, d)//'_velocity'
      end do
    end do
    names = adjustl(names)
    names = trim(names)
  end function velocities_of

  !> Whole groups without a meaning: one warning for all of a name.
  subroutine pass_over_groups(list, names, chosen, v)
    type(namelist_text_t), intent(in) :: list
    character(*), intent(in) :: names    !! one blank between them
    character(*), intent(in) :: chosen   !! as in `physics = 'dry'`
    type(group_visitor_t), intent(inout) :: v
    character(:), allocatable :: subject
    integer :: first, last, line, n, i

    last = -1
    do while (last < len(names))
      call next_word(names, first, last)
      n = 0
      do i = list%n, 1, -1
        if (list%group(i)%name /= names(first:last)) cycle
        n = n + 1
        line = list%group(i)%line
      end do
      if (n == 0) cycle
      subject = '&'//names(first:last)//': has'
      if (n > 1) subject = to_text(n)//' groups &'//names(first:last)//': have'
      call v%passed_over%add_message(subject//' no meaning with '//chosen//', passed over', line)
    end do
  end subroutine pass_over_groups

end module idle_variables_m
