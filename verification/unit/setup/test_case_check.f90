!> Checks with geometry: walls, overlaps, drops without room, periods, the fixed blocks' pose.
module test_case_check_m
  use check_m, only: check
  use kinds_m, only: wp
  use errors_m, only: problems_t
  use rotations_m, only: rotate
  use case_types_m, only: case_t
  use case_input_m, only: read_case
  use case_check_m, only: make_shapes, check_case
  use tet_mesh_m, only: shape_t
  use bed_m, only: bed_t, make_bed
  implicit none
  private
  public :: test_case_check

  character(*), parameter :: lf = new_line('a')
  !> Three lines: a tank of 0.3 x 0.1 x 0.2 m and a cube of 20 mm.
  character(*), parameter :: tank = '&run t_end = 1 /'//lf &
    //'&grid cells = 6, 2, 4 length = 0.3, 0.1, 0.2 /'//lf &
    //'&shape name = ''c'' kind = ''cube'' size = 0.02 /'//lf
  character(*), parameter :: ball = '&shape name = ''s'' kind = ''sphere'' size = 0.02 /'//lf
  character(*), parameter :: cross_block = '&shape name = ''h'' kind = ''hexapod'' size = 0.02 ' &
    //'/'//lf
  character(*), parameter :: inside = '; a body must lie inside the tank'
  character(*), parameter :: apart = '; bodies must lie apart at the start'
  character(*), parameter :: never = '; it could never be released'

contains

  subroutine test_case_check()
    call test_walls()
    call test_pairs()
    call test_drops()
    call test_periods()
    call test_together()
    call test_three_legs()
  end subroutine test_case_check

  subroutine test_walls()
    call expect(tank//'&body shape=''c'' position=0.01, 0.01, 0.01 /', '')
    ! 1 % of 20 mm is 0.2 mm
    call expect(tank//'&body shape=''c'' position=0.01, 0.01, 0.0099 /', '')
    call expect(tank//'&body shape=''c'' position=0.1, 0.05, 0.0095 /', &
      '&body position = 0.1, 0.05, 0.0095: reaches 0.0005 m through the wall z_min'//inside &
      //' (line 4)')
    call expect(tank//'&body shape=''c'' position=0.32, 0.05, 0.1 /', &
      '&body position = 0.32, 0.05, 0.1: reaches 0.03 m through the wall x_max'//inside &
      //' (line 4)')
    call expect(tank//'&body shape=''c'' position=0.1, 0.012, 0.1 axis=0,0,1 angle_deg=45 /', &
      '&body position = 0.1, 0.012, 0.1: reaches 0.00214 m through the wall y_min'//inside &
      //' (line 4)')
    ! half out of the open top
    call expect(tank//'&body shape=''c'' position=0.1, 0.05, 0.2 /', '')
    call expect(tank//'&body shape=''c'' position=0.1, 0.05, 0.5 /', '')       ! above it
    call expect(tank//'&boundary z_max=''slip''/ &body shape=''c'' position=0.1, 0.05, 0.2 /', &
      '&body position = 0.1, 0.05, 0.2: reaches 0.01 m through the wall z_max'//inside//' (line 4)')
    call expect(tank//'&boundary x_min=''open''/ &body shape=''c'' position=-0.005, 0.05, 0.1 /', &
      '&body position = -0.005, 0.05, 0.1: its centre lies 0.005 m beyond x_min'//inside &
      //' (line 4)')
    call expect(tank//'&boundary x_min=''open''/ &body shape=''c'' position=0.005, 0.05, 0.1 /', '')
    call expect(tank//ball//'&body shape=''s'' position=0.1, 0.05, 0.009 /', &
      '&body position = 0.1, 0.05, 0.009: reaches 0.001 m through the wall z_min'//inside &
      //' (line 5)')
    call expect(tank//'&run2/ &body shape=''c'' position=9,9,9 release_time=5 fixed=t /', &
      '&run2: unknown group, nearest known: &run (line 4)|' &
      //'&body position = 9, 9, 9: reaches 8.91 m through the wall y_max'//inside//' (line 4)')
    call expect(tank//'&water min=0,0,0.3 max=1,1,1 / &water min=-1,-1,-1 max=1,1,0.1/', &
      '&water min = 0, 0, 0.3, max = 1, 1, 1: lies outside the tank (line 4)')
    call expect('&run t_end = 1 physics=''fluid'' /'//lf &
      //'&grid cells = 6, 2, 4 length = 0.3, 0.1, 0.2 /'//lf &
      //'&shape name = ''c'' kind = ''cube'' size = 0.02 / &body shape=''c'' position=9,9,9/', '')
  end subroutine test_walls

  subroutine test_pairs()
    call expect(tank//'&body shape=''c'' position=0.1, 0.05, 0.05 /'//lf &
      //'&body shape=''c'' position=0.12, 0.05, 0.05 /'//lf, '')
    call expect(tank//'&body shape=''c'' position=0.1, 0.05, 0.05 /'//lf &
      //'&body shape=''c'' position=0.115, 0.05, 0.05 /'//lf, &
      '&body position = 0.115, 0.05, 0.05: overlaps the &body on line 4 by 0.005 m'//apart &
      //' (line 5)')
    call expect(tank//'&body shape=''c'' position=0.1, 0.05, 0.05 fixed=t/'//lf &
      //'&body shape=''c'' position=0.1, 0.05, 0.05 fixed=t/', &
      '&body position = 0.1, 0.05, 0.05: overlaps the &body on line 4 by 0.01 m'//apart &
      //' (line 5)')
    call expect(tank//'&body shape=''c'' position=0.1, 0.05, 0.05 /'//lf &
      ! the first may move away
      //'&body shape=''c'' position=0.1, 0.05, 0.05 release_time=0.5/', '')
    call expect(tank//'&body shape=''c'' position=0.1, 0.05, 0.05 fixed=t velocity=1,0,0/'//lf &
      //'&body shape=''c'' position=0.1, 0.05, 0.05 release_time=0.5/', '')
    call expect(tank//'&body shape=''c'' position=0.1, 0.05, 0.05 fixed=t/'//lf &
      //'&body shape=''c'' position=0.1, 0.05, 0.05 release_time=0.5/', &
      '&body position = 0.1, 0.05, 0.05: overlaps the &body on line 4 by 0.01 m'//apart &
      //' (line 5)')
    call expect(tank//ball//'&body shape=''s'' position=0.1, 0.05, 0.05 /'//lf &
      //'&body shape=''s'' position=0.1, 0.065, 0.05 /', &
      '&body position = 0.1, 0.065, 0.05: overlaps the &body on line 5 by 0.005 m'//apart &
      //' (line 6)')
    ! crosses that interlock do not overlap, though their bounding spheres do
    call expect(tank//cross_block//'&body shape=''h'' position=0.1, 0.05, 0.05 /'//lf &
      //'&body shape=''h'' position=0.141, 0.05, 0.091/', '')
  end subroutine test_pairs

  !> A place is taken for ever by a wall or a held body, never by a free one.
  subroutine test_drops()
    character(*), parameter :: held = '&body shape=''c'' position=0.1, 0.05, 0.01 fixed=t /'//lf

    call expect(tank//held//'&drop shape=''c'' position=0.1, 0.05, 0.03 count=6/', '')
    call expect(tank//held//'&drop shape=''c'' position=0.1, 0.05, 0.025/', &
      '&drop position = 0.1, 0.05, 0.025: lies inside the fixed &body on line 4'//never &
      //' (line 5)')
    call expect(tank//held//'&drop shape=''c'' position=0.1, 0.05, 0.025 count=3/', &
      '&drop position = 0.1, 0.05, 0.025: block 1 at 0.1, 0.05, 0.025 lies inside the fixed ' &
      //'&body on' &
      //' line 4'//never//'; 3 of 3 blocks have such places (line 5)')
    call expect(tank//'&body shape=''c'' position=0.1, 0.05, 0.01 /'//lf &
      //'&drop shape=''c'' position=0.1, 0.05, 0.02/', '')
    call expect(tank//'&drop shape=''c'' position=0.1, 0.05, 0.0/', &
      '&drop position = 0.1, 0.05, 0: reaches 0.01 m through the wall z_min'//never//' (line 4)')
    call expect(tank//'&drop shape=''c'' position=0.1, 0.05, 0.3/', '')
    call expect(tank//'&drop shape=''c'' position=0.1, 0.05, 0.1 spread=0.05,0.02,0.05 count=50' &
      //' orientation=''random''/', '')
    call expect(tank//'&body shape=''c'' position=0.1, 0.05, 0.01 fixed=t release_time=2/'//lf &
      //'&drop shape=''c'' position=0.1, 0.05, 0.02 first_time=1/', '')
    call check('a wide spread meets the walls', index(messages(tank &
      //'&drop shape=''c'' position=0.15,0.05,0.1 spread=0.3,0.1,0.1 count=40/'), &
      'of 40 blocks have such places (line 4)') > 0)
  end subroutine test_drops

  subroutine test_periods()
    character(*), parameter :: around = '&boundary y_min=''periodic'' y_max=''periodic''/'//lf

    call expect(tank//cross_block//around//'&body shape=''h'' position=0.15, 0.05, 0.1/', &
      '&shape name = ''h'': 0.0663 m long, must not be more than half the period 0.1 m between ' &
      //'y_min' &
      //' and y_max (line 4)')
    call expect(tank//cross_block//around//'&body shape=''c'' position=0.15, 0.0, 0.1/', '')
    call expect(tank//around//'&body shape=''c'' position=0.15, 0.001, 0.1/'//lf &
      //'&body shape=''c'' position=0.15, 0.095, 0.1/', &
      '&body position = 0.15, 0.095, 0.1: overlaps the &body on line 5 by 0.006 m'//apart &
      //' (line 6)')
  end subroutine test_periods

  !> Problems of the text and of the geometry come together; faulty groups are left alone.
  subroutine test_together()
    call expect(tank//'&shape name=''d'' kind=''cube'' size=-1/'//lf &
      //'&body shape=''d'' position=9,9,9/'//lf//'&body shape=''c'' position=9,9/'//lf &
      //'&body shape=''c'' position=0.1,0.05,9.0/ &drop shape=''x'' position=1,1,1/'//lf &
      //'&body shape=''c'' position=-1,0.05,0.1/', &
      '&shape size = -1: must be positive [m] (line 4)|' &
      //'&body position = 9, 9: 2 values given, 3 needed (line 6)|' &
      //'&drop shape = ''x'': no &shape has this name, nearest known: ''c'' (line 7)|' &
      //'&body position = -1, 0.05, 0.1: reaches 1.01 m through the wall x_min'//inside &
      //' (line 8)')
    call expect('&run t_end=1/ &grid cells=4,4,4 length=1,1,-1/'//lf &
      //'&shape name=''c'' kind=''cube''' &
      //' size=0.02/ &body shape=''c'' position=9,9,9/', &
      '&grid length = 1, 1, -1: must be positive [m]' &
      //' (line 1)')
    call expect('', '&run t_end: missing, required: the simulated time [s] (there is no group ' &
      //'&run)' &
      //'|&grid cells: missing, required: how many cells in x, y, z (there is no group &grid)' &
      //'|&grid length: missing, required: the length of the tank in x, y, z [m]' &
      //' (there is no group &grid)')
    call expect(tank//'&shape name=''d'' kind=''cube'' size=1 refinement=8/', '')
    call test_partly_known()
  end subroutine test_together

  !> What is wrong with a group hides only what depends on it.
  subroutine test_partly_known()
    character(*), parameter :: run = '&run t_end = 1 /'//lf
    character(*), parameter :: grid = '&grid cells = 6, 2, 4 length = 0.3, 0.1, 0.2 /'//lf
    character(*), parameter :: shape = '&shape name = ''c'' kind = ''cube'' size = 0.02 /'//lf
    character(*), parameter :: out = '&body shape=''c'' position=-0.1, 0.05, 0.1 '
    character(*), parameter :: is_out = '&body position = -0.1, 0.05, 0.1: reaches 0.11 m ' &
      //'through the wall x_min'//inside
    character(*), parameter :: two = '&body shape=''c'' position=0.1, 0.05, 0.1 /'//lf &
      //'&body shape=''c'' position=0.11, 0.05, 0.1 '
    character(*), parameter :: overlap = '&body position = 0.11, 0.05, 0.1: overlaps the &body ' &
      //'on line 4 by 0.01 m'//apart//' (line 5)'

    call expect(run//'&grid cells = 6, 2, 4 length = 0.3, 0.1 /'//lf//shape//two//'/ '//out//'/', &
      '&grid length = 0.3, 0.1: 2 values given, 3 needed (line 2)|'//overlap)
    call expect(run//'&grid length = 0.3, 0.1, 0.2 /'//lf//shape//out//'/', '&grid cells: ' &
      //'missing, required: how many cells in x, y, z (line 2)|'//is_out//' (line 4)')
    call expect(run//'&grid cells = 6, 2, 4 lenght = 0.3, 0.1, 0.2 /'//lf//shape//out//'/', &
      '&grid length: missing, required: the length of the tank in x, y, z [m] (line 2)|&grid ' &
      //'lenght = 0.3, 0.1, 0.2: unknown variable, nearest known: length (line 2)')
    call expect(tank//out//'/ &boundary y_min=''wall'' z_maxi=''slip''/', '&boundary y_min = ' &
      //'''wall'': unknown, must be one of ''no_slip'', ''slip'', ''open'', ''periodic'', ' &
      //'''inflow'', ''outflow'' (line 4)|&boundary z_maxi = ''slip'': unknown variable, ' &
      //'nearest known: z_max (line 4)|'//is_out//' (line 4)')
    call expect(tank//out//'/ &boundary xmin=''open''/', '&boundary xmin = ''open'': unknown ' &
      //'variable, nearest known: x_min (line 4)')
    call expect(tank//out//'colour=1/', '&body colour = 1: unknown variable, nearest known: ' &
      //'motion (line 4)|'//is_out//' (line 4)')
    call expect(tank//out//'positoin=1/', '&body positoin = 1: unknown variable, nearest known: ' &
      //'position (line 4)')
    call expect(tank//two//'velocity=1/', '&body velocity = 1: 1 value given, 3 needed (line 5)')
    call expect(tank//two//'relase_time=1/', '&body relase_time = 1: unknown variable, nearest ' &
      //'known: release_time (line 5)')
    call expect(tank//two//'colour=1/', '&body colour = 1: unknown variable, nearest known: ' &
      //'motion (line 5)|'//overlap)
    call expect(run//grid//'&shape name = ''c'' kind = ''cube'' size = 0.02 density=-1 /'//lf//two &
      //'/', '&shape density = -1: must be positive [kg/m3] (line 3)|'//overlap)
    call expect(run//grid//'&shape name = ''c'' kind = ''cube'' /'//lf//two//'/', &
      '&shape size: missing, required: the edge [m] (line 3)')
    call expect(tank//'&drop shape=''c'' position=-0.1, 0.05, 0.1 velocity=1/', '&drop velocity ' &
      //'= 1: 1 value given, 3 needed (line 4)|&drop position = -0.1, 0.05, 0.1: reaches 0.11 m ' &
      //'through the wall x_min'//never//' (line 4)')
  end subroutine test_partly_known

  !> The fixed blocks of the paper stand on three corners: side of the triangle sqrt 2 d.
  subroutine test_three_legs()
    real(wp), parameter :: d = 0.02_wp
    type(case_t) :: case
    type(shape_t), allocatable :: shapes(:)
    type(bed_t) :: bed
    type(problems_t) :: problems
    real(wp) :: corner(3), feet(3, 3)
    integer :: i, n

    call read_case(tank//cross_block//'&body shape=''h'' fixed=t position=0.15, 0.05, ' &
      //'0.0288675134594813 quaternion = 0.540625096237162, 0.455768038939282, ' &
      //'-0.060003000646866, -0.704556342610988/', case, problems)
    call make_shapes(case, shapes, problems)
    call make_bed(case, bed, problems)
    call check_case(case, shapes, bed, problems)
    call check('fixed block is a good case', problems%n, 0)
    n = 0
    do i = 1, size(shapes(2)%point, 2)
      corner = case%body(1)%position + rotate(case%body(1)%quaternion, shapes(2)%point(:, i))
      if (corner(3) > 1.0e-4_wp) cycle
      n = n + 1
      if (n <= 3) feet(:, n) = corner
    end do
    call check('three corners at the floor', n, 3)
    if (n /= 3) return
    call check('on the floor', feet(3, :), [0.0_wp, 0.0_wp, 0.0_wp], 1.0e-15_wp)
    call check('sides of the triangle', [norm2(feet(:, 1) - feet(:, 2)), &
      norm2(feet(:, 2) - feet(:, 3)), norm2(feet(:, 3) - feet(:, 1))], &
      sqrt(2.0_wp)*[d, d, d], 1.0e-15_wp)
    call check('a foot towards the viewer', minval(feet(2, :)), 0.05_wp - d*sqrt(2.0_wp/3.0_wp), &
               1.0e-15_wp)
  end subroutine test_three_legs

  !> All messages about a case, '|' between them.
  function messages(text) result(found)
    character(*), intent(in) :: text
    character(:), allocatable :: found
    type(case_t) :: case
    type(shape_t), allocatable :: shapes(:)
    type(bed_t) :: bed
    type(problems_t) :: problems
    integer :: i

    call read_case(text, case, problems)
    call make_shapes(case, shapes, problems)
    call make_bed(case, bed, problems)
    call check_case(case, shapes, bed, problems)
    found = ''
    do i = 1, problems%n
      if (i > 1) found = found//'|'
      found = found//problems%message(i)
    end do
  end function messages

  subroutine expect(text, wanted)
    character(*), intent(in) :: text, wanted
    character(:), allocatable :: found

    found = messages(text)
    call check('messages: '//wanted, found == wanted)
    if (found /= wanted) print '(4a)', '  case: ', text, lf//'  got: ', found
  end subroutine expect

end module test_case_check_m
