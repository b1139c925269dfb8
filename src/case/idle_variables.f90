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
  use entries_m, only: words_of
  use group_visitor_m, only: group_visitor_t
  use run_groups_m, only: side_name
  implicit none
  private
  public :: find_idle

contains

  !> Look through all groups of a case that has been read: one warning for all groups of a name
  !! without a meaning, then one for each group with variables without one.
  subroutine find_idle(list, case, v)
    type(namelist_text_t), intent(inout) :: list
    type(case_t), intent(in) :: case
    type(group_visitor_t), intent(inout) :: v
    character(:), allocatable :: chosen, groups, subject
    integer :: i, k, n, line

    chosen = 'physics = '''//trim(case%run%physics)//''''
    groups = ''
    if (case%run%physics == 'fluid') groups = 'contact start shape body drop'
    if (any(case%run%physics == ['dry  ', 'light'])) groups = 'water numerics'
    associate (names => words_of(groups))
      do k = 1, size(names)
        n = 0
        do i = list%n, 1, -1
          if (list%group(i)%name /= names(k)) cycle
          n = n + 1
          line = list%group(i)%line
        end do
        subject = '&'//trim(names(k))//': has'
        if (n > 1) subject = to_text(n)//' groups &'//trim(names(k))//': have'
        if (n > 0) call v%passed_over%add_message(subject//' no meaning with '//chosen &
          //', passed over', line)
      end do
    end associate
    do i = 1, list%n
      call v%start(list%group(i))
      call v%pass_over(idle_variables(list%group(i)%name, case), chosen)
      if (list%group(i)%name == 'water' .and. case%fluid%single_phase .and. has_flow(case%run)) then
        call v%report(': has no meaning with &fluid single_phase = .true.; the liquid fills the ' &
          //'whole tank')
      end if
      list%group(i) = v%group
    end do
  end subroutine find_idle

  !> Variables of a group without a meaning in the physics of the case, one blank between them:
  !! 'dry' has of the fluid only gravity; 'light' a water of given density, level and current;
  !! without blocks nothing settles, nothing rubs on a slippery wall, and only a bed is solid.
  pure function idle_variables(group, case) result(names)
    character(*), intent(in) :: group
    type(case_t), intent(in) :: case
    character(:), allocatable :: names

    names = ''
    select case (trim(case%run%physics)//' '//group)
    case ('dry run', 'light run'); names = 'cfl_max'
    case ('fluid run'); names = 'stop_when_settled rest_speed rest_time'
    case ('dry boundary'); names = velocities_of('inflow', case)
    case ('fluid boundary'); names = velocities_of('slip', case)
    case ('dry fluid'); names = 'liquid_density liquid_viscosity gas_density gas_viscosity ' &
      //'water_level surface_tension single_phase velocity initial_state'
    case ('light fluid'); names = 'liquid_viscosity gas_density gas_viscosity surface_tension ' &
      //'initial_state'
    case ('fluid numerics'); if (len_trim(case%bed%file) == 0) names = 'solid_fraction subcells'
    case ('dry contact', 'light contact'); names = 'lubrication'
    case ('dry shape', 'coupled shape'); names = 'drag_coefficient'
    case default   ! all of it counts, or nothing
    end select
  end function idle_variables

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
    names = trim(adjustl(names))
  end function velocities_of

end module idle_variables_m
