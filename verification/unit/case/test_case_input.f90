!> Every group of a case: defaults, values, attitudes and the way back to text. What is said to bad
!! inputs: `verification/test_messages.py`.
module test_case_input_m
  use check_m, only: check, wp, pi
  use errors_m, only: problems_t
  use case_types_m, only: case_t, is_given
  use case_input_m, only: read_case, parameters_text
  implicit none
  private
  public :: test_case_input

  character(*), parameter :: lf = new_line('a'), run = '&run t_end = 1 /'//lf
  character(*), parameter :: grid = '&grid cells = 6, 2, 4 length = 0.3, 0.1, 0.2 /'//lf
  character(*), parameter :: base = run//grid   ! two lines
  character(*), parameter :: cube = base//'&shape name = ''c'' kind = ''cube'' size = 0.02 /'//lf

contains

  subroutine test_case_input()
    call test_values()
    call test_attitudes()
    call test_way_back()
    call test_rock()
  end subroutine test_case_input

  !> Values arrive where they belong; each repeated group starts from the defaults.
  subroutine test_values()
    type(case_t) :: case
    type(problems_t) :: problems

    call read_case('&drop shape=''b'' position=1,2,3 count=4 first_time=5 interval=6 spread=3*.1 ' &
      //'tilt_deg=7 velocity=0,0,-1 seed=-8 /'//lf//cube// '&shape name=''b'' kind=''box'' ' &
      //'size=0.1, 0.2 0.3 density=2400 refinement=3 /'//lf// '&body shape=''b'' position=3*0.1 ' &
      //'velocity=1,2,3 angular_velocity=4,5,6 fixed=T release_time=2/'//lf//'&body ' &
      //'shape=''c'' position=3*0.2 /'//lf//'&water min=3*0 max=3*0.1 /'//lf// &
      '&boundary x_min=''periodic'' x_max="periodic" z_max=''slip''/', case, problems)
    call check('good case', problems%n, 0)
    if (problems%n > 0) return
    call check('drop', case%drop(1)%count == 4 .and. case%drop(1)%seed == -8)
    call check('drop numbers', &
      [case%drop(1)%position, case%drop(1)%first_time, case%drop(1)%interval, &
      case%drop(1)%spread, case%drop(1)%tilt_deg, case%drop(1)%velocity], [1.0_wp, &
      2.0_wp, 3.0_wp, 5.0_wp, 6.0_wp, 0.1_wp, 0.1_wp, 0.1_wp, 7.0_wp, 0.0_wp, 0.0_wp, -1.0_wp])
    call check('size of the box', case%shape(2)%size, [0.1_wp, 0.2_wp, 0.3_wp])
    call check('size of the cube', case%shape(1)%size(1), 0.02_wp)
    call check('rest of the size', count(is_given(case%shape(1)%size)), 1)
    call check('second shape only', [case%shape%density], [2300.0_wp, 2400.0_wp])
    call check('first body', case%body(1)%fixed .and. case%body(1)%shape == 'b')
    call check('motion', [case%body(1)%velocity, case%body(1)%angular_velocity, &
      case%body(1)%release_time], [1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp, 5.0_wp, 6.0_wp, 2.0_wp])
    call check('second body starts from defaults', .not. case%body(2)%fixed .and. &
      all(abs(case%body(2)%velocity) <= 0.0_wp) .and. abs(case%body(2)%release_time) <= 0.0_wp)
    call check('lines', all([case%drop(1)%line, case%shape(1)%line, case%shape(2)%line, &
      case%body(1)%line, case%body(2)%line, case%water(1)%line] == [1, 4, 5, 6, 7, 8]))
    call check('periodic', all(case%boundary%kind(:, 1) == 'periodic'))
  end subroutine test_values

  !> Quaternion, axis and angle.
  subroutine test_attitudes()
    call check('none', attitude(''), [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
    call check('normalised', attitude('quaternion=3,0,4,0'), [0.6_wp, 0.0_wp, 0.8_wp, 0.0_wp], &
      1.0e-15_wp)
    call check('tiny', attitude('quaternion=0,0,0,1e-20'), [0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], &
      1.0e-15_wp)
    call check('quarter turn', attitude('axis=0,0,5 angle_deg=90'), &
               [sqrt(0.5_wp), 0.0_wp, 0.0_wp, sqrt(0.5_wp)], 1.0e-15_wp)
    call check('no turn', attitude('axis=1,0,0 angle_deg=0'), [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
    call check('backwards', attitude('axis=1,1,1 angle_deg=-60'), &
               [cos(pi/6.0_wp), -sin(pi/6.0_wp)/sqrt([3.0_wp, 3.0_wp, 3.0_wp])], 1.0e-15_wp)
  end subroutine test_attitudes

  !> Attitude of a body with these variables.
  function attitude(variables) result(q)
    character(*), intent(in) :: variables
    real(wp) :: q(4)
    type(case_t) :: case
    type(problems_t) :: problems

    call read_case(cube//'&body shape=''c'' position=3*0.05 '//variables//'/', case, problems)
    q = 0.0_wp
    if (problems%n == 0) q = case%body(1)%quaternion
  end function attitude

  !> The parameters written out read back as the same case, bit for bit, also a second time.
  subroutine test_way_back()
    type(case_t) :: case, again
    type(problems_t) :: problems
    character(:), allocatable :: text

    call read_case(cube//'&body shape=''c'' ' &
      //'position=0.1, 0.3333333333333333, 1e-7 quaternion = 0.540625, 0.455768, -0.060003, ' &
      //'-0.704554 /&body shape=''h'' position=3*1e20 axis=1,2,3 angle_deg=17 fixed=t/&shape ' &
      //'name=''h'' kind=''hexapod'' size=.02 spheres=''centroid''/&shape name=''b'' ' &
      //'kind=''box'' size=.02,.03,.04/ &drop shape=''h'' position=1,2,3 tilt_deg=1/&drop ' &
      //'shape=''h'' position=1,2,3 orientation=''random''/ &water min=3*0 max=3*1/&fluid ' &
      //'water_level=0.1513 single_phase=f/ &contact sleep=f model=''spheres'' law=''constants''/' &
      //'&numerics coupling=''mics'' coupling_passes=3 divergence_tolerance=1d-10/', case, problems)
    case%run%title = 'it''s "a" / test ! größe'
    call check('case for the way back', problems%n, 0)
    text = parameters_text(case)
    call read_case(text, again, problems)
    call check('parameters are a good case', problems%n, 0)
    call check('same text again', parameters_text(again) == text)
    call check('title', again%run%title == case%run%title)
    call check('position', again%body(1)%position, case%body(1)%position)
    call check('quaternion 1', again%body(1)%quaternion, case%body(1)%quaternion)
    call check('quaternion 2', again%body(2)%quaternion, case%body(2)%quaternion)
    call check('tolerance', again%numerics%divergence_tolerance, 1.0e-10_wp)
    call check('passes', again%numerics%coupling_passes, 3)
    call check('level', again%fluid%water_level, 0.1513_wp)
    call check('no sleep', .not. again%contact%sleep)
    call check('random drop', again%drop(2)%orientation == 'random')
    call read_case(parameters_text(again), case, problems)
    call check('third time', parameters_text(case) == text)
    call check('no restitution with constants', index(text, 'restitution =') == 0)
    call check('no sizes of a file', index(text, 'scale =') == 0)
    call read_case(base//'&shape name=''f'' kind=''file'' file=''a''/ &shape name=''s'' ' &
      //'kind=''sphere'' size=1/', case, problems)
    text = parameters_text(case)
    call read_case(text, again, problems)
    call check('parameters of files and spheres are a good case', problems%n, 0)
    call check('a file has a scale', index(text, 'scale = 1') > 0)
    call read_case('&run t_end=1 stop_when_settled=t rest_time=3/'//grid &
      //'&fluid single_phase=t/', case, problems)
    text = parameters_text(case)
    call read_case(text, again, problems)
    call check('parameters of one phase are a good case', problems%n, 0)
    call check('the time of rest is kept', again%run%rest_time, 3.0_wp)
    call read_case(base, case, problems)
    call check('an absent level is not written', index(parameters_text(case), 'water_level') == 0)
  end subroutine test_way_back

  !> A family of stones: its variables, its members, and who gets which.
  subroutine test_rock()
    character(*), parameter :: a = '&shape name=''a'' kind=', rock = base//a//'''rock'' '
    type(case_t) :: case
    type(problems_t) :: problems

    call read_case(rock//'variants=3/ &body shape=''a'' position=3*0/ &body shape=''a-03'' ' &
      //'position=3*0/ &body shape=''a'' position=3*0/ &body shape=''a'' position=3*0/ ' &
      //'&body shape=''a'' position=3*0/ &drop shape=''a'' position=3*0/', case, problems)
    call check('a good family', problems%n, 0)
    call check('a shape for each stone', size(case%shape), 3)
    call check('members', all(case%shape%member == [1, 2, 3]))
    call check('bodies take the next one', all(case%body%shape == [character(4) :: 'a-01', &
      'a-03', 'a-02', 'a-03', 'a-01']))
    call check('a drop draws', case%drop(1)%shape == 'a')
    call check('one group is written', index(parameters_text(case), '&shape', back=.true.), &
      index(parameters_text(case), '&shape'))
    call read_case(rock//'variants=200/ &body shape=''a-007'' position=3*0/', case, problems)
    call check('three digits', problems%n, 0)
  end subroutine test_rock

end module test_case_input_m
