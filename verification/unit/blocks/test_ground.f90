!> How far down a block can come: exact heights on planes, edges, corners and balls; and shapes in
!! random attitudes, which must lie apart there and overlap a little further down.
module test_ground_m
  use kinds_m, only: wp
  use check_m, only: check
  use case_types_m, only: case_t
  use case_input_m, only: read_case
  use errors_m, only: problems_t
  use tet_mesh_m, only: shape_t, extent_along
  use vectors_m, only: quaternion_from_axis, rotation_matrix
  use random_counter_m, only: uniform, random_rotation
  use case_check_m, only: make_shapes
  use bed_file_m, only: bed_form_t
  use bed_m, only: set_bed
  use rigid_body_m, only: blocks_t
  use case_blocks_m, only: blocks_init
  use walls_m, only: walls_t, walls_init
  use overlap_m, only: overlap_t, overlap_init, overlap_depth
  use ground_m, only: height_on_top, way_down, ground_gap, nothing_below
  implicit none
  private
  public :: test_ground

  character(*), parameter :: shapes_text = '&run t_end=1 physics=''dry''/ &grid cells=3*2 ' &
    //'length=3*1/ &shape name=''cube'' kind=''cube'' size=.1/ &shape name=''ball'' ' &
    //'kind=''sphere'' size=.1/ &shape name=''tetrapod'' kind=''tetrapod'' size=.15/ &shape ' &
    //'name=''hexapod'' kind=''hexapod'' size=.05/'
  real(wp), parameter :: gap = 0.1_wp*ground_gap   !! below a cube, a ball [m]
  type(case_t) :: case
  type(shape_t), allocatable :: shapes(:)
  type(blocks_t) :: blocks
  type(walls_t) :: walls
  type(overlap_t) :: overlap

contains

  subroutine test_ground()
    call exact_heights()
    call below_and_above()
    call on_a_slope()
    call random_pairs()
  end subroutine test_ground

  !> Bodies of the text, all of them there but the last, which comes down.
  subroutine set(bodies)
    character(*), intent(in) :: bodies
    type(problems_t) :: problems

    call read_case(shapes_text//bodies, case, problems)
    if (problems%n > 0) call check(problems%message(1), .false.)
    call make_shapes(case, shapes, problems)
    call walls_init(case%grid, case%boundary, walls)
    call blocks_init(case, shapes, blocks)
    call overlap_init(blocks%shapes, blocks%n, overlap)
    blocks%present(blocks%n) = .false.
  end subroutine set

  !> Height of the last body on what lies there.
  real(wp) function height()
    height = height_on_top(walls, blocks, blocks%n, overlap)
  end function height

  !> Floor, face on face, corner on face, edge across edge, ball on ball, on an edge, on a corner.
  subroutine exact_heights()
    character(*), parameter :: one = '&body shape=''cube'' position=.5,.5,.05/'
    character(*), parameter :: ball = '&body shape=''ball'' position='

    call set('&body shape=''cube'' position=.5,.5,.7/')
    call check('a cube on the floor', height(), 0.05_wp + gap, 1.0e-15_wp)
    call set('&body shape=''ball'' position=.5,.5,.7/')
    call check('a ball on the floor', height(), 0.05_wp + gap, 1.0e-15_wp)
    call set(one//'&body shape=''cube'' position=.53,.46,.7/')
    call check('face on face', height(), 0.15_wp + gap, 1.0e-15_wp)
    call set(one//'&body shape=''cube'' position=.6,.5,.7/')
    call check('side by side: on the floor', height(), 0.05_wp + gap, 1.0e-15_wp)
    call set(one//'&body shape=''cube'' position=.5999,.5,.7/')
    call check('a little aside: on the other', height(), 0.15_wp + gap, 1.0e-15_wp)
    call set(one//'&body shape=''cube'' position=.5,.5,.7 axis=1,-1,0 ' &
      //'angle_deg=54.735610317245346/')
    call check('corner down', height(), 0.1_wp + 0.05_wp*sqrt(3.0_wp) + gap, 1.0e-14_wp)
    call set('&body shape=''cube'' position=.5,.5,.3 axis=1,0,0 angle_deg=45 fixed=T/ ' &
      //'&body shape=''cube'' position=.53,.52,.7 axis=0,1,0 angle_deg=45/')
    ! each edge passes over the other one, which is at its full height there
    call check('edge across edge', height(), 0.3_wp + 0.1_wp*sqrt(2.0_wp) + gap, 1.0e-6_wp)
    call set(ball//'.5,.5,.3/ '//ball//'.53,.54,.7/')
    call check('ball on ball', height(), 0.3_wp + sqrt(0.01_wp - 0.0025_wp) + gap, 1.0e-15_wp)
    call set(one//ball//'.5,.52,.7/')
    call check('ball on a face', height(), 0.15_wp + gap, 1.0e-15_wp)
    call set(one//ball//'.58,.5,.7/')
    call check('ball on an edge', height(), 0.1_wp + sqrt(0.05_wp**2 - 0.03_wp**2) + gap, &
      1.0e-15_wp)
    call set(one//ball//'.57,.57,.7/')
    call check('ball on a corner', height(), 0.1_wp + sqrt(0.05_wp**2 - 2*0.02_wp**2) + gap, &
      1.0e-15_wp)
    call set(ball//'.5,.5,.05/ &body shape=''cube'' position=.58,.5,.7/')
    call check('edge of a cube on a ball', height(), 0.05_wp + sqrt(0.05_wp**2 - 0.03_wp**2) &
      + 0.05_wp + gap, 1.0e-7_wp)
  end subroutine exact_heights

  !> What lies above does not stop a block; what it touches does; without a floor nothing does.
  subroutine below_and_above()
    character(*), parameter :: pair = '&body shape=''cube'' position=.5,.5,.05/ ' &
      //'&body shape=''cube'' position=.5,.5,.6/ &body shape=''cube'' position=.5,.5,'

    call set(pair//'.4/')
    call check('between two', way_down(walls, blocks, 3, overlap), 0.25_wp - gap, 1.0e-15_wp)
    call check('on both', height(), 0.7_wp + gap, 1.0e-15_wp)
    call set(pair//'.15/')
    call check('it touches', way_down(walls, blocks, 3, overlap), -gap, 1.0e-15_wp)
    call set('&body shape=''ball'' position=.5,.5,.5/ &boundary z_min=''open''/')
    call check('no ground', way_down(walls, blocks, 1, overlap) >= nothing_below .and. &
      height() <= -nothing_below)
  end subroutine below_and_above

  !> On a plane bed the point that reaches furthest against its normal touches.
  subroutine on_a_slope()
    type(bed_form_t) :: form
    character(:), allocatable :: message
    real(wp) :: n(3), turn(3, 3), expected
    character(8) :: name
    integer :: k, s

    allocate (form%point(3, 4), form%triangle(3, 2))
    form%point = reshape([-1.0_wp, -1.0_wp, -0.5_wp, 3.0_wp, -1.0_wp, 1.5_wp, 3.0_wp, 2.0_wp, &
                          1.5_wp, -1.0_wp, 2.0_wp, -0.5_wp], [3, 4])
    form%triangle = reshape([1, 2, 3, 1, 3, 4], [3, 2])   ! z = x/2
    n = [-0.5_wp, 0.0_wp, 1.0_wp]/norm2([0.5_wp, 1.0_wp])
    do s = 1, 4
      name = shapes(s)%name(:8)
      call set('&body shape='''//trim(name)//''' position=.5,.5,.8/')
      call set_bed(case, form, walls%bed, message)
      call check('the bed is taken: '//message, len(message) == 0)
      do k = 1, 10
        blocks%q(:, 1) = random_rotation(s, k)
        turn = rotation_matrix(blocks%q(:, 1))
        expected = 0.25_wp + extent_along(shapes(s), -matmul(n, turn))/n(3) &
          + ground_gap*shapes(s)%smallest_edge
        call check('a '//trim(name)//' on a slope', height(), expected, 1.0e-6_wp*expected)
      end do
    end do
  end subroutine on_a_slope

  !> Where two shapes touch they lie apart, and overlap when lowered by a thirtieth of an edge.
  subroutine random_pairs()
    real(wp) :: depth
    integer :: k, a, b, n, apart, met

    n = 0
    apart = 0
    met = 0
    call set('&body shape=''cube'' position=.5,.5,.2/ &body shape=''cube'' position=.5,.5,.7/')
    walls%n = 0
    do k = 1, 200
      a = 1 + int(4*uniform(1, k, 11))
      b = 1 + int(4*uniform(1, k, 12))
      blocks%shape = [a, b]
      blocks%q(:, 1) = random_rotation(2, k)
      blocks%q(:, 2) = random_rotation(3, k)
      blocks%x(1, 2) = 0.5_wp + 0.05_wp*(2*uniform(1, k, 13) - 1.0_wp)
      blocks%x(2, 2) = 0.5_wp + 0.05_wp*(2*uniform(1, k, 14) - 1.0_wp)
      blocks%x(3, 2) = height()
      if (blocks%x(3, 2) < 0.0_wp) cycle   ! they pass
      n = n + 1
      depth = depth_now(a, b)
      if (depth <= 0.0_wp) apart = apart + 1
      blocks%x(3, 2) = blocks%x(3, 2) - 0.03_wp*min(shapes(a)%smallest_edge, &
                                                    shapes(b)%smallest_edge)
      depth = depth_now(a, b)
      if (depth > 0.0_wp) met = met + 1
    end do
    call check('most of them meet', n > 150)
    call check('they lie apart', apart, n)
    call check('and overlap below', met, n)
  end subroutine random_pairs

  real(wp) function depth_now(a, b)
    integer, intent(in) :: a, b

    depth_now = overlap_depth(shapes(a), blocks%x(:, 1), blocks%q(:, 1), shapes(b), &
                              blocks%x(:, 2), blocks%q(:, 2))
  end function depth_now

end module test_ground_m
