!> How far down a block can come: exact heights on planes, edges, corners and balls; and shapes in
!! random attitudes, which must lie apart there and overlap a little further down.
module test_ground_m
  use check_m, only: check, wp
  use tet_mesh_m, only: extent_along
  use vectors_m, only: rotation_matrix
  use random_counter_m, only: uniform, random_rotation
  use bed_file_m, only: bed_form_t
  use bed_m, only: set_bed
  use overlap_m, only: overlap_depth
  use ground_m, only: height_on_top, way_down, ground_gap, nothing_below
  use world_m, only: world_t, set_up
  implicit none
  private
  public :: test_ground

  character(*), parameter :: tank = '&run t_end=1 physics="dry"/ &grid cells=3*2 length=3*1/ ' &
    //'&shape name="cube" kind="cube" size=.1/ &shape name="ball" kind="sphere" size=.1/ &shape ' &
    //'name="tetrapod" kind="tetrapod" size=.15/ &shape name="hexapod" kind="hexapod" size=.05/ ', &
    cube = '&body shape="cube" position=', ball = '&body shape="ball" position='
  real(wp), parameter :: gap = 0.1_wp*ground_gap   !! below a cube, a ball [m]
  type(world_t) :: world

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

    call set_up(tank//bodies, world)
    world%blocks%present(world%blocks%n) = .false.
  end subroutine set

  !> Height of the last body on what lies there.
  real(wp) function height()
    height = height_on_top(world%walls, world%blocks, world%blocks%n, world%overlap)
  end function height

  !> The last of the bodies comes down to a height.
  subroutine lies(name, bodies, at, tolerance)
    character(*), intent(in) :: name, bodies
    real(wp), intent(in) :: at, tolerance   !! [m]

    call set(bodies)
    call check(name, height(), at + gap, tolerance)
  end subroutine lies

  !> Floor, face on face, corner on face, edge across edge, ball on ball, on an edge, on a corner.
  subroutine exact_heights()
    character(*), parameter :: one = cube//'.5,.5,.05/ '
    real(wp), parameter :: near = 1.0e-15_wp

    call lies('a cube on the floor', cube//'.5,.5,.7/', 0.05_wp, near)
    call lies('a ball on the floor', ball//'.5,.5,.7/', 0.05_wp, near)
    call lies('face on face', one//cube//'.53,.46,.7/', 0.15_wp, near)
    call lies('side by side: on the floor', one//cube//'.6,.5,.7/', 0.05_wp, near)
    call lies('a little aside: on the other', one//cube//'.5999,.5,.7/', 0.15_wp, near)
    call lies('corner down', one//cube//'.5,.5,.7 axis=1,-1,0 angle_deg=54.735610317245346/', &
      0.1_wp + 0.05_wp*sqrt(3.0_wp), 1.0e-14_wp)
    ! each edge passes over the other one, which is at its full height there
    call lies('edge across edge', cube//'.5,.5,.3 axis=1,0,0 angle_deg=45 fixed=T/ '//cube &
      //'.53,.52,.7 axis=0,1,0 angle_deg=45/', 0.3_wp + 0.1_wp*sqrt(2.0_wp), 1.0e-6_wp)
    call lies('ball on ball', ball//'.5,.5,.3/ '//ball//'.53,.54,.7/', &
      0.3_wp + sqrt(0.01_wp - 0.0025_wp), near)
    call lies('ball on a face', one//ball//'.5,.52,.7/', 0.15_wp, near)
    call lies('ball on an edge', one//ball//'.58,.5,.7/', &
      0.1_wp + sqrt(0.05_wp**2 - 0.03_wp**2), near)
    call lies('ball on a corner', one//ball//'.57,.57,.7/', &
      0.1_wp + sqrt(0.05_wp**2 - 2*0.02_wp**2), near)
    call lies('edge of a cube on a ball', ball//'.5,.5,.05/ '//cube//'.58,.5,.7/', &
      0.1_wp + sqrt(0.05_wp**2 - 0.03_wp**2), 1.0e-7_wp)
  end subroutine exact_heights

  !> What lies above does not stop a block; what it touches does; without a floor nothing does.
  subroutine below_and_above()
    character(*), parameter :: pair = cube//'.5,.5,.05/ '//cube//'.5,.5,.6/ '//cube//'.5,.5,'

    associate (walls => world%walls, blocks => world%blocks, overlap => world%overlap)
      call set(pair//'.4/')
      call check('between two', way_down(walls, blocks, 3, overlap), 0.25_wp - gap, 1.0e-15_wp)
      call check('on both', height(), 0.7_wp + gap, 1.0e-15_wp)
      call set(pair//'.15/')
      call check('it touches', way_down(walls, blocks, 3, overlap), -gap, 1.0e-15_wp)
      call set(ball//'.5,.5,.5/ &boundary z_min="open"/')
      call check('no ground', way_down(walls, blocks, 1, overlap) >= nothing_below .and. &
        height() <= -nothing_below)
    end associate
  end subroutine below_and_above

  !> On a plane bed the point that reaches furthest against its normal touches.
  subroutine on_a_slope()
    type(bed_form_t) :: form, once
    character(:), allocatable :: message
    real(wp) :: n(3), turn(3, 3), expected
    integer :: k, s

    allocate (form%point(3, 4), form%triangle(3, 2))
    form%point = reshape([-1.0_wp, -1.0_wp, -0.5_wp, 3.0_wp, -1.0_wp, 1.5_wp, 3.0_wp, 2.0_wp, &
                          1.5_wp, -1.0_wp, 2.0_wp, -0.5_wp], [3, 4])
    form%triangle = reshape([1, 2, 3, 1, 3, 4], [3, 2])   ! z = x/2
    n = [-0.5_wp, 0.0_wp, 1.0_wp]/norm2([0.5_wp, 1.0_wp])
    call set(cube//'.5,.5,.8/')
    do s = 1, 4
      call set('&body shape="'//trim(world%shapes(s)%name)//'" position=.5,.5,.8/')
      once = form
      call set_bed(world%case, once, world%walls%bed, message)
      call check('the bed is taken: '//message, len(message) == 0)
      do k = 1, 10
        world%blocks%q(:, 1) = random_rotation(s, k)
        turn = rotation_matrix(world%blocks%q(:, 1))
        expected = 0.25_wp + extent_along(world%shapes(s), -matmul(n, turn))/n(3) &
          + ground_gap*world%shapes(s)%smallest_edge
        call check(trim(world%shapes(s)%name)//' on a slope', height(), expected, &
          1.0e-6_wp*expected)
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
    call set(cube//'.5,.5,.2/ '//cube//'.5,.5,.7/')
    world%walls%n = 0
    do k = 1, 200
      a = 1 + int(4*uniform(1, k, 11))
      b = 1 + int(4*uniform(1, k, 12))
      world%blocks%shape = [a, b]
      world%blocks%q(:, 1) = random_rotation(2, k)
      world%blocks%q(:, 2) = random_rotation(3, k)
      world%blocks%x(1, 2) = 0.5_wp + 0.05_wp*(2*uniform(1, k, 13) - 1.0_wp)
      world%blocks%x(2, 2) = 0.5_wp + 0.05_wp*(2*uniform(1, k, 14) - 1.0_wp)
      world%blocks%x(3, 2) = height()
      if (world%blocks%x(3, 2) < 0.0_wp) cycle   ! they pass
      n = n + 1
      depth = depth_now(a, b)
      if (depth <= 0.0_wp) apart = apart + 1
      world%blocks%x(3, 2) = world%blocks%x(3, 2) - 0.03_wp*min(world%shapes(a)%smallest_edge, &
                                                    world%shapes(b)%smallest_edge)
      depth = depth_now(a, b)
      if (depth > 0.0_wp) met = met + 1
    end do
    call check('most of them meet', n > 150)
    call check('they lie apart', apart, n)
    call check('and overlap below', met, n)
  end subroutine random_pairs

  real(wp) function depth_now(a, b)
    integer, intent(in) :: a, b

    associate (shapes => world%shapes, x => world%blocks%x, q => world%blocks%q)
      depth_now = overlap_depth(shapes(a), x(:, 1), q(:, 1), shapes(b), x(:, 2), q(:, 2))
    end associate
  end function depth_now

end module test_ground_m
