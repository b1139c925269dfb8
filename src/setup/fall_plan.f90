!> The part of the plan about how the blocks will fall: heights, depth, speeds.
module fall_plan_m
  use kinds_m, only: wp
  use errors_m, only: to_text, brief
  use case_types_m, only: case_t, drop_input_t, place_t, is_given
  use named_files_m, only: file_text
  use drops_m, only: place_of_block, place_of_body, shape_of_place
  use tet_mesh_m, only: shape_t
  use bed_m, only: bed_t
  use fall_m, only: fall_t, find_fall, gravity_down
  use plan_text_m, only: heading, entry, place_text
  implicit none
  private
  public :: print_falls

  integer, parameter :: max_reported = 20   !! groups &drop

contains

  !> The first block of each drop, and the free body that starts highest.
  subroutine print_falls(unit, case, shapes, bed)
    integer, intent(in) :: unit
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)   !! one for each `&shape`
    type(bed_t), intent(in) :: bed
    logical :: under_water, any_falls
    integer :: i, b

    b = 0
    do i = 1, size(case%body)
      if (case%body(i)%fixed) cycle
      if (b > 0) then
        if (case%body(i)%position(3) <= case%body(b)%position(3)) cycle
      end if
      b = i
    end do
    if (size(case%drop) == 0 .and. b == 0) return
    call heading(unit, 'Falls')
    under_water = .false.
    any_falls = .false.
    if (b > 0) call print_fall('&body', place_of_body(case%body(b)), case%body(b)%line, 1)
    do i = 1, min(size(case%drop), max_reported)
      if (case%drop(i)%handling%lowering_speed > 0.0_wp) then
        call entry(unit, '&drop on line '//to_text(case%drop(i)%line), to_text( &
          case%drop(i)%count)//' by crane')
      else
        call print_fall('&drop', place_of_block(case%drop(i), 1), case%drop(i)%line, &
                        case%drop(i)%count)
      end if
      call print_handling(unit, case%drop(i))
    end do
    if (size(case%drop) > max_reported) call entry(unit, '', 'and of ' &
      //to_text(size(case%drop) - max_reported)//' more groups &drop')
    if (gravity_down(case%fluid%gravity) <= 0.0_wp .or. .not. any_falls) return
    call entry(unit, 'in air', 'v^2 = v_0^2 + 2 g h, without drag')
    if (.not. under_water) return
    call entry(unit, 'in water, estimates', 'v_t^2 = 2 (s - 1) g V / (C A), ' &
      //'v^2 = v_t^2 + (v_0^2 - v_t^2) exp(-C A z / ((s + 0.5) V)),')
    if (case%run%physics == 'light') then
      call entry(unit, '', 's = density over that of the liquid, A = a third of the surface, C = ' &
        //'drag_coefficient')
    else
      call entry(unit, '', 's = density over that of the liquid, A = mean projected area, ' &
        //'C after Hoelzer and Sommerfeld (2008)')
    end if
  contains
    subroutine print_fall(group, place, line, count)
      character(*), intent(in) :: group
      type(place_t), intent(in) :: place
      integer, intent(in) :: line, count   !! of the group, blocks of it
      type(fall_t) :: fall
      character(:), allocatable :: label, start
      integer :: s

      s = shape_of_place(place, shapes)
      if (s == 0) return
      label = trim(place%shape)
      if (line > 0) label = group//' on line '//to_text(line)
      start = ''
      if (count > 1) start = 'the first of '//to_text(count)//': '
      if (.not. is_given(place%x(3))) then
        call entry(unit, label, start//'is set on what lies there')
        return
      end if
      any_falls = .true.
      call find_fall(case, place, shapes(s), bed, fall)
      call entry(unit, label, start//start_text(case, bed, fall))
      if (fall%at_surface >= 0.0_wp) call entry(unit, '', 'meets the water at ' &
        //brief(fall%at_surface, 3)//' m/s')
      if (fall%terminal >= 0.0_wp) then
        under_water = .true.
        if (fall%at_floor >= 0.0_wp) call entry(unit, '', 'meets the '//ground(bed, fall, case) &
          //' at about '//brief(fall%at_floor, 2)//' m/s, if no block is in its way')
        call entry(unit, '', 'a long fall in water ends at about '//brief(fall%terminal, 2) &
          //' m/s, C = '//brief(fall%drag, 2))
      else if (fall%at_floor >= 0.0_wp) then
        call entry(unit, '', 'meets the '//ground(bed, fall, case)//' at ' &
          //brief(fall%at_floor, 3)//' m/s, if no block is in its way')
      else if (fall%has_water .and. fall%drag > 0.0_wp) then
        call entry(unit, '', 'is lighter than the liquid and floats')
      end if
    end subroutine print_fall
  end subroutine print_falls

  !> What a crane does with the blocks of a drop, and the table that they come from.
  subroutine print_handling(unit, drop)
    integer, intent(in) :: unit
    type(drop_input_t), intent(in) :: drop
    integer :: n

    associate (handling => drop%handling)
      if (allocated(drop%row)) then
        n = count([(.not. is_given(drop%row(n)%x(3)), n=1, drop%count)])
        call entry(unit, '', 'places from '//file_text(drop%folder, trim(drop%file))//': ' &
          //to_text(drop%count)//' rows, '//to_text(n)//' on what lies there, ' &
          //to_text(count(drop%row%fixed))//' fixed')
      end if
      if (handling%lowering_speed > 0.0_wp) then
        select case (handling%release)
        case ('touch'); call lowered('where it touches what lies below')
        case ('height'); call lowered(brief(handling%release_height)//' m over what lies below')
        case default; call lowered('at its place, from the water level or the top of the tank')
        end select
      end if
      select case (handling%if_blocked)
      case ('raise'); call entry(unit, '', 'where a place is taken, raised above what lies there')
      case ('skip'); call entry(unit, '', 'where a place is taken, left out')
      case default   ! it waits
      end select
    end associate
  contains
    subroutine lowered(until)
      character(*), intent(in) :: until

      call entry(unit, '', 'lowered at '//brief(drop%handling%lowering_speed) &
        //' m/s, let go '//until)
    end subroutine lowered
  end subroutine print_handling

  !> Where the lowest point of a block is at the start.
  function start_text(case, bed, fall) result(text)
    type(case_t), intent(in) :: case
    type(bed_t), intent(in) :: bed
    type(fall_t), intent(in) :: fall
    character(:), allocatable :: text
    real(wp) :: depth, lower

    lower = case%grid%origin(3)
    if (fall%has_floor) lower = fall%floor
    text = 'lowest point at '//place_text(fall%bottom, case%grid%length)//' m'
    if (fall%has_floor) text = 'lowest point '//brief(fall%bottom - fall%floor, 3) &
      //' m above the '//ground(bed, fall, case)
    if (fall%has_water) then
      depth = fall%level - lower
      text = text//', '
      if (fall%bottom > fall%level) then
        text = text//brief(fall%bottom - fall%level, 3)//' m above the water'
      else if (case%fluid%single_phase) then
        text = text//'under water'
      else
        text = text//brief(fall%level - fall%bottom, 3)//' m under water'
      end if
      text = text//'; water '//brief(depth, 3)//' m deep there, ' &
        //brief(depth*case%grid%cells(3)/case%grid%length(3), 3)//' cells'
    end if
  end function start_text

  !> What is below a block, in a word.
  pure function ground(bed, fall, case) result(word)
    type(bed_t), intent(in) :: bed
    type(fall_t), intent(in) :: fall
    type(case_t), intent(in) :: case
    character(:), allocatable :: word

    word = 'floor'
    if (bed%there .and. fall%floor > case%grid%origin(3)) word = 'bed'
  end function ground

end module fall_plan_m
