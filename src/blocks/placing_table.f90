!> Places of blocks from the tables that `&drop file` names: who, where, when, how.
!!
!! Attitude: a quaternion, or three angles. The block stands as its shape is defined and is turned
!! first by roll about x, then by pitch about y, then by yaw about z, axes of the tank, right-hand:
!!
!! $$ q = q_z(yaw) \, q_y(pitch) \, q_x(roll) . $$
module placing_table_m
  use kinds_m, only: wp, name_length, pi
  use errors_m, only: problems_t, to_text
  use vectors_m, only: quaternion_product, quaternion_from_axis, normalised
  use case_types_m, only: case_t, drop_input_t, place_t, member_name
  use csv_table_m, only: csv_table_t, read_table
  use named_files_m, only: found_file
  use value_text_m, only: quoted_text, nearest_name, lower_case, parse_logical, sanitise, value_ok
  implicit none
  private
  public :: read_places

  integer, parameter :: max_rows = 100000
  integer, parameter :: max_reported = 100   !! problems of one table

  !> Columns, the five that every table has first.
  character(name_length), parameter :: known(*) = [character(name_length) :: 'shape', 'x', 'y', &
    'z', 'time', 'qw', 'qx', 'qy', 'qz', 'yaw_deg', 'pitch_deg', 'roll_deg', 'vx', 'vy', 'vz', &
    'fixed', 'name', 'heading']
  character(*), parameter :: units(*) = [character(3) :: '', 'm', 'm', 'm', 's', '', '', '', '', &
    'deg', 'deg', 'deg', 'm/s', 'm/s', 'm/s', '', '', 'deg']
  !> Names in the tables of clients, and those of the program.
  character(name_length), parameter :: client(2, 6) = reshape([character(name_length) :: &
    'type', 'shape', 'easting', 'x', 'northing', 'y', 'elevation', 'z', 'unit', 'name', &
    'heading_deg', 'heading'], [2, 6])
  integer, parameter :: n_required = 5, c_shape = 1, c_x = 2, c_time = 5, c_q = 6, c_yaw = 10, &
    c_v = 13, c_fixed = 16, c_name = 17, c_heading = 18

contains

  !> Read the tables of all drops; every problem is reported with file, line and column.
  subroutine read_places(case, problems, warnings)
    type(case_t), intent(inout) :: case
    type(problems_t), intent(inout) :: problems, warnings
    type(problems_t) :: found
    integer :: i, k

    do i = 1, size(case%drop)
      associate (drop => case%drop(i))
        if (len_trim(drop%file) == 0) cycle
        found = problems_t()
        call read_drop([case%shape%name, (member_name(case%shape(k), case%shape(k)%member), &
          k=1, size(case%shape))], drop, found, warnings)
        drop%faulty = drop%faulty .or. found%n > 0
        do k = 1, min(found%n, max_reported)
          call problems%add_message('&drop file = '//quoted_text(drop%file)//': ' &
            //found%message(k), drop%line)
        end do
        if (found%n > max_reported) call problems%add_message('&drop file = ' &
          //quoted_text(drop%file)//': '//to_text(found%n - max_reported)//' more problems', &
          drop%line)
      end associate
    end do
  end subroutine read_places

  !> The table of one drop.
  subroutine read_drop(shapes, drop, problems, warnings)
    character(name_length), intent(in) :: shapes(:)
    type(drop_input_t), intent(inout) :: drop
    type(problems_t), intent(inout) :: problems, warnings
    type(csv_table_t) :: table
    character(120), allocatable :: pose(:)
    integer :: column(size(known)), r, k, c

    call read_table(found_file(drop%file), table, problems)
    drop%count = table%n_rows
    allocate (drop%row(table%n_rows))
    if (size(table%name) == 0) return
    do k = 1, size(client, 2)   ! unless there is one of the program's name
      c = table%column(client(1, k))
      if (c > 0 .and. table%column(client(2, k)) == 0) table%name(c) = client(2, k)
    end do
    call table%check_names(known, units, n_required, problems)
    column = [(table%column(known(k)), k=1, size(known))]
    if (column(c_heading) > 0 .and. column(c_yaw) > 0) call problems%add_message('line ' &
      //to_text(table%head)//': give yaw_deg or a heading, not both')
    if (any(column(c_q:c_q + 3) > 0) .and. (any(column(c_yaw:c_yaw + 2) > 0) &
                                            .or. column(c_heading) > 0)) then
      call problems%add_message('line '//to_text(table%head) &
        //': give a quaternion or angles, not both')
    else if (any(column(c_q:c_q + 3) > 0) .and. any(column(c_q:c_q + 3) == 0)) then
      call problems%add_message('line '//to_text(table%head) &
        //': a quaternion needs qw, qx, qy and qz')
    end if
    if (table%n_rows == 0) call problems%add_message('holds no places')
    if (table%n_rows > max_rows) call problems%add_message('holds '//to_text(table%n_rows) &
      //' places, at most '//to_text(max_rows))
    do r = 1, table%n_rows
      call read_row(r)
    end do
    call table%warn_of_remarks('&drop file = '//quoted_text(drop%file), drop%line, warnings)
    if (problems%n > 0) return
    allocate (pose(table%n_rows))
    do r = 1, table%n_rows
      pose(r) = to_text([drop%row(r)%x, drop%row(r)%time])
    end do
    call warn_of_twins(pose, 'place and time')
    call warn_of_twins(drop%row%name, 'the name')
  contains
    !> One row; what is wrong with it keeps its default.
    subroutine read_row(r)
      integer, intent(in) :: r
      integer :: d
      logical :: ok

      associate (row => drop%row(r))
        row%line = table%line(r)
        do d = 1, 3
          ok = .true.
          call table%number(r, column(c_x + d - 1), d < 3, row%x(d), ok, problems)
          ok = .true.
          call table%number(r, column(c_v + d - 1), .false., row%v(d), ok, problems)
          if (ok .and. drop%handling%lowering_speed > 0.0_wp .and. abs(row%v(d)) > 0.0_wp) then
            call table%report(r, column(c_v + d - 1), 'has no meaning with lowering_speed > 0', &
                                problems)
          end if
        end do
        ok = .true.
        call table%number(r, column(c_time), .true., row%time, ok, problems)
        if (ok .and. row%time < 0.0_wp) call table%report(r, column(c_time), &
          'must not be negative', problems)
        call read_words(r, row)
        if (row%fixed .and. drop%handling%lowering_speed > 0.0_wp) call table%report(r, &
          column(c_fixed), 'a fixed block is not lowered', problems)
        call read_attitude(r, row%q)
      end associate
    end subroutine read_row

    !> Shape, name and whether the block is fixed.
    subroutine read_words(r, row)
      integer, intent(in) :: r
      type(place_t), intent(inout) :: row
      character(:), allocatable :: text
      integer :: info

      if (column(c_shape) > 0) then
        text = table%cell(r, column(c_shape))
        if (size(shapes) == 0) then
          call table%report(r, column(c_shape), 'the case has no &shape group', problems)
        else if (any(shapes == text) .and. len(text) > 0) then
          row%shape = text
        else
          call table%report(r, column(c_shape), 'no &shape has this name, nearest known: ' &
            //quoted_text(nearest_name(text, shapes)), problems)
        end if
      end if
      text = table%cell(r, column(c_name))
      if (len(text) > name_length .or. sanitise(text) /= text) then
        call table%report(r, column(c_name), 'must have at most '//to_text(name_length) &
          //' bytes and no control characters', problems)
      else
        row%name = text
      end if
      text = lower_case(table%cell(r, column(c_fixed)))
      if (any(text == [character(3) :: '', '0', 'no'])) return
      row%fixed = any(text == [character(3) :: '1', 'yes'])
      if (row%fixed) return
      call parse_logical(text, row%fixed, info)
      if (info /= value_ok) call table%report(r, column(c_fixed), &
        'must be true or false, yes or no, 1 or 0', problems)
    end subroutine read_words

    !> Attitude from four columns or three; where they are empty the block stands as its shape does.
    subroutine read_attitude(r, q)
      integer, intent(in) :: r
      real(wp), intent(inout) :: q(4)
      real(wp), parameter :: axis(3, 3) = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
        1.0_wp, 0.0_wp, 0.0_wp], [3, 3])   ! of yaw, pitch, roll
      real(wp) :: part(4), angle(3), heading
      logical :: ok
      integer :: k

      ok = .true.
      if (all(column(c_q:c_q + 3) > 0)) then
        if (all([(len(table%cell(r, column(c_q + k))) == 0, k=0, 3)])) return
        part = 0.0_wp
        do k = 1, 4
          call table%number(r, column(c_q + k - 1), .true., part(k), ok, problems)
        end do
        if (.not. ok) return
        if (all(abs(part) <= 0.0_wp)) then
          call table%report(r, column(c_q), 'a quaternion must not be zero', problems)
        else
          q = normalised(part)
        end if
      else
        angle = 0.0_wp
        do k = 1, 3
          call table%number(r, column(c_yaw + k - 1), .false., angle(k), ok, problems)
        end do
        if (column(c_heading) > 0) then   ! of the x axis of the body, from north towards east
          heading = 90.0_wp
          call table%number(r, column(c_heading), .false., heading, ok, problems)
          angle(1) = 90.0_wp - heading
        end if
        angle = modulo(angle, 720.0_wp)*pi/180.0_wp
        q = quaternion_from_axis(axis(:, 3), angle(3))   ! roll about x, then pitch, then yaw
        do k = 2, 1, -1
          q = quaternion_product(quaternion_from_axis(axis(:, k), angle(k)), q)
        end do
      end if
    end subroutine read_attitude

    !> Tell of rows that say the same of their unit as one of the rows before them.
    subroutine warn_of_twins(word, what)
      character(*), intent(in) :: word(:)   !! (rows); empty: the same as none
      character(*), intent(in) :: what      !! it says of the unit
      integer, parameter :: looked_at = 10000   ! rows before
      integer :: r, k, n, last, twin

      n = 0
      do r = 2, size(word)
        if (word(r) == '') cycle
        k = max(1, r - looked_at)
        k = k - 1 + findloc(word(k:r - 1), word(r), 1)
        if (k < max(1, r - looked_at)) cycle
        n = n + 1
        last = table%line(r)
        twin = table%line(k)
      end do
      if (n > 0) call warnings%add_message('&drop file = '//quoted_text(drop%file)//': ' &
        //to_text(n)//' of '//to_text(size(word))//' rows have '//what//' of an earlier one, as ' &
        //'line '//to_text(last)//' that of line '//to_text(twin)//'; is a unit there twice?', &
        drop%line)
    end subroutine warn_of_twins
  end subroutine read_drop

end module placing_table_m
