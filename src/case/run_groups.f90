!> The groups of the run and its tank: `&run`, `&grid`, `&boundary`.
module run_groups_m
  use kinds_m, only: wp
  use errors_m, only: to_text
  use case_types_m, only: run_t, grid_input_t, boundary_input_t, is_given
  use boundary_kinds_m, only: side_code, side_names, is_wall, gives_velocity
  use allowed_values_m, only: allowed_t, any_number, positive, not_negative, between
  use group_visitor_m, only: group_visitor_t
  use value_text_m, only: quoted_text
  implicit none
  private
  public :: visit_run, visit_grid, visit_boundary, side_name, shortest

  real(wp), parameter :: max_cells = real(huge(0), wp)   !! cells are counted in default integers
  real(wp), parameter :: max_steps = 1.0e9_wp
  real(wp), parameter :: farthest_origin = 1.0e8_wp       !! in cells; beyond, digits are lost

  !> Volumes and inertias of lengths from this to its inverse stay in the number range [m].
  real(wp), parameter :: shortest = 1.0e-6_wp

contains

  !> `&run`
  subroutine visit_run(v, run)
    type(group_visitor_t), intent(inout) :: v
    type(run_t), intent(inout) :: run

    run%line = v%group%line
    call v%about('how long the run is, how fine in time, and where its results go')
    call v%text('title', run%title, 'a line about the case, for the plan and the results', &
      example='''Six blocks in a tank''')
    call v%option('physics', run%physics, 'coupled fluid dry light', &
      'what is computed: water, air and blocks; without the blocks; blocks alone, without ' &
      //'water and air; or blocks in a given water whose flow is not resolved', &
      example='''dry''')
    call v%real('t_end', run%t_end, positive('s'), 'the simulated time', example='10', &
      required=.true.)
    call v%real('dt', run%dt, positive('s'), 'largest time step of the fluid; in ''dry'' the ' &
      //'step of the history, in ''light'' the longest step of the blocks', example='0.005')
    call v%real('cfl_max', run%cfl_max, not_negative('-', zero='0 keeps dt fixed'), &
      'the time step is made shorter to keep the Courant number of liquid and blocks below ' &
      //'this; gas up to eight times as fast moves in parts of the step', example='0.25')
    call v%text('output', run%output, 'folder of the result files; an older result is renamed ' &
      //'first', example='''my-run''')
    call v%real('field_interval', run%field_interval, not_negative('s', zero='0 means never'), &
      'simulated time between frames of the fields and of the surfaces of the blocks', &
      example='0.05')
    call v%real('history_interval', run%history_interval, &
      not_negative('s', zero='0 means every step'), &
      'simulated time between rows of the histories in run.h5', example='0.01')
    call v%real('restart_interval', run%restart_interval, &
      not_negative('s', zero='0 means only at the end'), &
      'simulated time between restart files', example='0.5')
    call v%logical('stop_when_settled', run%stop_when_settled, 'ends the run before t_end, when ' &
      //'all blocks are released or find no room, no motion is to come, and all blocks are ' &
      //'slower than rest_speed during rest_time')
    call v%real('rest_speed', run%rest_speed, positive('m/s'), &
      'speed below which a block counts as at rest', example='5e-4')
    call v%without_meaning(.not. run%stop_when_settled .and. v%good('stop_when_settled'), &
      'rest_time', 'stop_when_settled = .false.', 'only .true. waits for it')
    call v%real('rest_time', run%rest_time, not_negative('s'), &
      'how long every block must be that slow for stop_when_settled', &
      example='stop_when_settled = .true.  rest_time = 1')

    if (is_given(run%t_end) .and. v%good('dt')) then
      call v%require('t_end', run%t_end <= max_steps*run%dt, 'must be at most ' &
                     //to_text(max_steps)//' steps of dt = '//to_text(run%dt)//' s')
    end if
    call v%require('output', len_trim(run%output) > 0, 'must name a folder')
  end subroutine visit_run

  !> `&grid`
  subroutine visit_grid(v, grid)
    type(group_visitor_t), intent(inout) :: v
    type(grid_input_t), intent(inout) :: grid

    call v%about('the tank and the cells it is cut into')
    call v%integer('cells', grid%cells, allowed_t(whole=.true., low=1.0_wp), &
      'how many cells in x, y, z', example='60, 20, 40', required=.true.)
    call v%real('length', grid%length, between(shortest, 1.0_wp/shortest, 'm'), &
      'the length of the tank in x, y, z', example='0.3, 0.1, 0.2', required=.true.)
    call v%real('origin', grid%origin, any_number('m'), &
      'the corner of the tank with the lowest x, y and z', example='-0.15, 0, 0')

    if (v%given('cells') .and. v%given('length') .and. v%good('cells')) then
      call v%require('cells', product(real(grid%cells, wp)) <= max_cells, &
        'too many cells, at most '//to_text(huge(0))//' in all')
      if (v%good('cells length')) call v%require('origin', all(abs(grid%origin) <= farthest_origin &
        *grid%length/real(grid%cells, wp)), 'too far from zero: cell faces would lose their digits')
    end if
    call v%judge('cells', grid%cells_faulty)
    call v%judge('length origin', grid%extent_faulty)
  end subroutine visit_grid

  !> `&boundary`
  subroutine visit_boundary(v, boundary)
    type(group_visitor_t), intent(inout) :: v
    type(boundary_input_t), intent(inout) :: boundary
    character(8), parameter :: along(3) = ['0, 0.1, ', '0.1, 0, ', '0.1, 0, ']
    integer :: d, s

    call v%about('what each of the six sides of the tank is')
    do d = 1, 3
      do s = 1, 2
        call v%option(side_name(s, d), boundary%kind(s, d), &
          side_names(), trim(side_meaning(s, d))//': a wall to ' &
          //'which the fluid sticks or along which it slips, open (pressure 0), periodic (with ' &
          //'the side across), or where a stream enters or leaves', example='''slip''')
      end do
    end do
    do d = 1, 3
      do s = 1, 2
        call v%real(side_name(s, d)//'_velocity', boundary%velocity(:, s, d), any_number('m/s'), &
          'velocity of '//trim(side_meaning(s, d))//': of a wall, in its own plane, or of an ' &
          //'inflow, into the tank', &
          example=side_name(s, d)//' = ''no_slip''  '//side_name(s, d)//'_velocity = '//along(d) &
          //'0')
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
    do d = 1, 3
      do s = 1, 2
        call v%judge(side_name(s, d), boundary%faulty(s, d))
      end do
    end do
  end subroutine visit_boundary

  !> A side of the tank in words.
  pure function side_meaning(s, d) result(meaning)
    integer, intent(in) :: s, d   !! 1 lower or 2 upper side; direction
    character(24) :: meaning
    character(1), parameter :: axis(3) = ['x', 'y', 'z']

    meaning = 'the side of lowest '//axis(d)
    if (s == 2) meaning = 'the side of highest '//axis(d)
  end function side_meaning

  !> A wall moves in its own plane, an inflow enters the tank, the other sides have no velocity.
  subroutine require_side_velocity(v, variable, kind, velocity, s, d)
    type(group_visitor_t), intent(inout) :: v
    character(*), intent(in) :: variable, kind
    real(wp), intent(in) :: velocity(3)   !! [m/s]
    integer, intent(in) :: s, d           !! 1 lower or 2 upper side; direction
    character(1), parameter :: axis(3) = ['x', 'y', 'z']
    character(8), parameter :: sign_word(2) = ['positive', 'negative']

    if (is_wall(side_code(kind))) then
      call v%require(variable, .not. abs(velocity(d)) > 0.0_wp, 'a wall moves in its own plane, ' &
                     //'the '//axis(d)//' component must be 0')
    else if (gives_velocity(side_code(kind))) then
      call v%require(variable, real(3 - 2*s, wp)*velocity(d) > 0.0_wp, 'an inflow must enter the ' &
                     //'tank, the '//axis(d)//' component must be '//sign_word(s))
    else
      call v%require(variable, .not. any(abs(velocity) > 0.0_wp), 'only walls and inflows have a ' &
                     //'velocity, not a side that is '//quoted_text(kind))
    end if
  end subroutine require_side_velocity

  !> Name of a side of the tank: `x_min`, `x_max`, `y_min`, ...
  pure function side_name(s, d) result(name)
    integer, intent(in) :: s, d   !! 1 lower or 2 upper side; direction
    character(5) :: name
    character(1), parameter :: axis(3) = ['x', 'y', 'z']
    character(4), parameter :: end_name(2) = ['_min', '_max']

    name = axis(d)//end_name(s)
  end function side_name

end module run_groups_m
