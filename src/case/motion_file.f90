!> Tables that move fixed bodies: `&body motion`.
!!
!! Columns time [s], x, y, z [m], and qw, qx, qy, qz, all four or none: without them the attitude of
!! the body stays. Times ascend; an attitude is less than half a turn from that of the row before.
module motion_file_m
  use kinds_m, only: wp, name_length, pi
  use errors_m, only: problems_t, to_text, brief
  use vectors_m, only: norm, normalised
  use case_types_m, only: case_t, is_given
  use csv_table_m, only: csv_table_t, read_table
  use named_files_m, only: found_file
  use given_motion_m, only: given_motion_init, pose_at
  use value_text_m, only: quoted_text
  implicit none
  private
  public :: read_motions

  character(name_length), parameter :: columns(8) = [character(name_length) :: 'time', 'x', 'y', &
    'z', 'qw', 'qx', 'qy', 'qz']
  character(*), parameter :: units(8) = [character(3) :: 's', 'm', 'm', 'm', '', '', '', '']
  integer, parameter :: n_required = 4
  real(wp), parameter :: largest_turn = 170.0_wp   !! from row to row [degrees]
  real(wp), parameter :: same_place = 1.0e-6_wp    !! of `position` and the table, over the tank [-]

contains

  !> Read the tables of all bodies that name one; where a body is at its release comes from there.
  subroutine read_motions(case, problems, warnings)
    type(case_t), intent(inout) :: case
    type(problems_t), intent(inout) :: problems, warnings
    type(problems_t) :: found
    type(csv_table_t) :: table
    real(wp), allocatable :: time(:), x(:, :), q(:, :)
    real(wp) :: place(3), attitude(4), v(3), omega(3)
    logical :: turns   ! the table has attitudes
    integer :: b, i

    do b = 1, size(case%body)
      if (len_trim(case%body(b)%motion) == 0) cycle
      found = problems_t()
      associate (body => case%body(b))
        call read_table(found_file(body%motion), table, found)
        if (size(table%name) > 0) then
          call table%check_names(columns, units, n_required, found)
          turns = any([(table%column(columns(i)) > 0, i=n_required + 1, size(columns))])
          if (turns .and. body%attitude_given) call found%add_message('has an attitude, and so ' &
            //'has the &body; give one only')
          if (found%n == 0) call read_rows(body%quaternion)
        end if
        call table%warn_of_remarks('&body motion = '//quoted_text(body%motion), body%line, warnings)
        do i = 1, found%n
          call problems%add_message('&body motion = '//quoted_text(body%motion)//': ' &
            //found%message(i), body%line)
        end do
        body%faulty = body%faulty .or. found%n > 0
        if (found%n > 0) cycle
        call given_motion_init(time, x, q, body%path)
        call pose_at(body%path, max(body%release_time, 0.0_wp), place, attitude, v, omega)
        if (is_given(body%position(1))) then
          if (norm(body%position - place) > same_place*maxval(case%grid%length)) then
            call problems%add_message('&body position = '//to_text(body%position) &
              //': motion = '//quoted_text(body%motion)//' has the body at '//to_text(place) &
              //' then; leave position away, or give that', body%line)
            body%faulty = .true.
          end if
        end if
        body%position = place
        body%quaternion = attitude
      end associate
    end do
  contains
    !> The rows of a table, with every problem of any of its cells.
    subroutine read_rows(attitude)
      real(wp), intent(in) :: attitude(4)   !! that of all rows if the table has none
      real(wp) :: row(8), angle
      logical :: ok
      integer :: r, c, last

      if (allocated(time)) deallocate (time, x, q)
      allocate (time(table%n_rows), x(3, table%n_rows), q(4, table%n_rows), source=0.0_wp)
      if (table%n_rows == 0) call found%add_message('has no rows')
      if (turns) then
        do c = n_required + 1, size(columns)
          if (table%column(columns(c)) == 0) call found%add_message('missing: ' &
            //trim(columns(c))//'; give all four of qw, qx, qy, qz or none')
        end do
      end if
      last = 0
      do r = 1, table%n_rows
        row = [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, attitude]
        ok = .true.
        do c = 1, merge(size(columns), n_required, turns)
          call table%number(r, table%column(columns(c)), .true., row(c), ok, found)
        end do
        if (.not. ok) cycle
        time(r) = row(1)
        x(:, r) = row(2:4)
        q(:, r) = row(5:8)
        if (.not. norm(q(:, r)) > 0.0_wp) then
          call table%report(r, table%column('qw'), 'qw, qx, qy, qz must not all be 0', found)
          cycle
        end if
        q(:, r) = normalised(q(:, r))
        if (last > 0) then
          if (.not. time(r) > time(last)) call table%report(r, table%column('time'), &
            'must be later than '//to_text(time(last))//' on line '//to_text(table%line(last)), &
            found)
          angle = 2.0_wp*acos(min(1.0_wp, abs(dot_product(q(:, r), q(:, last)))))*180.0_wp/pi
          if (angle > largest_turn) call table%report(r, table%column('qw'), 'turns by ' &
            //brief(angle, 3)//' degrees since line '//to_text(table%line(last)) &
            //', which leaves open which way; at most '//to_text(largest_turn), found)
        end if
        last = r
      end do
    end subroutine read_rows
  end subroutine read_motions

end module motion_file_m
