!> True overlap of bodies and walls against depths known from geometry; pairs of near bodies.
module test_overlap_m
  use check_m, only: check, wp, pi
  use case_types_m, only: case_t
  use tet_mesh_m, only: shape_t
  use vectors_m, only: quaternion_from_axis
  use rotations_m, only: rotate
  use random_counter_m, only: uniform, random_rotation
  use walls_m, only: walls_t, walls_init
  use world_m, only: world_t, set_up, body
  use neighbours_m, only: pair_list_t, near_pairs, nearest_shift, bins_t, bins_build
  use overlap_m, only: overlap_depth, wall_depth, max_overlap, has_place
  implicit none
  private
  public :: test_overlap

  real(wp), parameter :: upright(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], origin(3) = 0.0_wp
  real(wp), parameter :: d = 0.02_wp   !! edge of the cube, diameter of the ball [m]
  character(*), parameter :: tank = '&run t_end=1 physics="dry"/ &shape name="cube" kind="cube" ' &
    //'size=.02/ &shape name="ball" kind="sphere" size=.02/ &shape name="hexapod" ' &
    //'kind="hexapod" size=.02/ '
  type(shape_t), allocatable :: shapes(:)

contains

  subroutine test_overlap()
    type(world_t) :: world

    call set_up(tank//'&grid cells=3*2 length=3*1/', world)
    shapes = world%shapes
    call check_pairs_of_boxes()
    call check_turned_pairs()
    call check_balls()
    call check_walls()
    call check_run()
    call check_near_pairs()
    call check_bins()
  end subroutine test_overlap

  !> Depth of shape b at x in shape a at the origin; upright if not told otherwise.
  real(wp) function depth_in(a, b, x, q_b, q_a)
    integer, intent(in) :: a, b
    real(wp), intent(in) :: x(3)
    real(wp), intent(in), optional :: q_b(4), q_a(4)
    real(wp) :: q(4, 2)

    q = spread(upright, 2, 2)
    if (present(q_a)) q(:, 1) = q_a
    if (present(q_b)) q(:, 2) = q_b
    depth_in = overlap_depth(shapes(a), origin, q(:, 1), shapes(b), x, q(:, 2))
  end function depth_in

  !> Cubes pushed into one another along a face normal, corner first, and edge across edge.
  subroutine check_pairs_of_boxes()
    real(wp), parameter :: deep = 1.3e-3_wp
    real(wp) :: corner(4), edge(4), across(4), x(3)

    corner = quaternion_from_axis([1.0_wp, -1.0_wp, 0.0_wp], atan(sqrt(2.0_wp)))
    edge = quaternion_from_axis([1.0_wp, 0.0_wp, 0.0_wp], 0.25_wp*pi)
    across = quaternion_from_axis([0.0_wp, 1.0_wp, 0.0_wp], 0.25_wp*pi)
    call check('face on face', depth_in(1, 1, [2.0e-3_wp, 1.0e-3_wp, d - deep]), deep, 1.0e-15_wp)
    call check('apart', depth_in(1, 1, [0.0_wp, 0.0_wp, d + 1.0e-6_wp]), 0.0_wp)
    call check('touching', depth_in(1, 1, [0.0_wp, 0.0_wp, d]), 0.0_wp, 1.0e-15_wp)
    x = [1.0e-3_wp, 2.0e-3_wp, 0.5_wp*d*(1 + sqrt(3.0_wp)) - deep]
    call check('corner on face', depth_in(1, 1, x, corner), deep, 1.0e-14_wp)
    call check('and the other way round', depth_in(1, 1, -x, q_a=corner), deep, 1.0e-14_wp)
    ! each edge lies below the ridge of the other and is nearest to one of its two faces
    call check('edge across edge', depth_in(1, 1, [0.0_wp, 0.0_wp, d*sqrt(2.0_wp) - deep], across, &
      edge), deep/sqrt(2.0_wp), 1.0e-14_wp)
    call check('cube in the notch of a hexapod', depth_in(3, 1, [d - deep, d - 2*deep, 0.0_wp]), &
      sqrt(5.0_wp)*deep, 1.0e-15_wp)
    call check('cube beside a leg', depth_in(3, 1, [d, d, 0.0_wp]), 0.0_wp, 1.0e-15_wp)
  end subroutine check_pairs_of_boxes

  !> The depth does not depend on the place and attitude of the pair as a whole.
  subroutine check_turned_pairs()
    real(wp), parameter :: r(3) = [15.0e-3_wp, 22.0e-3_wp, -8.0e-3_wp]
    real(wp) :: depth, other, q(4), x(3)
    integer :: n

    depth = depth_in(3, 3, r)
    ! the deepest point lies on a face of one, 5 and 10 mm from an inner edge of the other
    call check('hexapods overlap, no deeper', depth <= sqrt(125.0e-6_wp))
    call check('and found by a sample near by', depth, sqrt(125.0e-6_wp), 0.07_wp*d)
    do n = 1, 5
      q = random_rotation(1, n)
      x = [uniform(1, n, 11), uniform(1, n, 12), uniform(1, n, 13)]
      other = overlap_depth(shapes(3), x, q, shapes(3), x + rotate(q, r), q)
      call check('turned and moved', other, depth, 1.0e-14_wp)
    end do
  end subroutine check_turned_pairs

  !> Balls are round, whatever their tetrahedra.
  subroutine check_balls()
    call check('ball on ball', depth_in(2, 2, [0.0_wp, 0.6_wp*d, 0.7_wp*d]), &
      d*(1.0_wp - sqrt(0.85_wp)), 1.0e-16_wp)
    call check('ball on face', depth_in(2, 1, -[3.0e-3_wp, 0.0_wp, 0.9_wp*d]), 0.1_wp*d, 1.0e-16_wp)
    call check('ball at corner', depth_in(1, 2, spread(0.75_wp*d, 1, 3)), &
      d*(0.5_wp - 0.25_wp*sqrt(3.0_wp)), 1.0e-16_wp)
    call check('ball inside', depth_in(1, 2, [0.0_wp, 0.1_wp*d, 0.2_wp*d]), 0.8_wp*d, 1.0e-16_wp)
  end subroutine check_balls

  !> Bodies behind walls.
  subroutine check_walls()
    type(case_t) :: case
    type(walls_t) :: walls

    case%grid%origin = [0.0_wp, 0.0_wp, 1.0_wp]
    case%grid%length = [0.3_wp, 0.1_wp, 0.2_wp]
    case%boundary%velocity(:, 1, 3) = [0.5_wp, 0.0_wp, 7.0_wp]
    call walls_init(case%grid, case%boundary, walls)
    call check('five walls, the top is open', all(walls%number(:5) == [-5, -4, -3, -2, -1]))
    call check('the floor slides in its plane', walls%velocity(:, 1), [0.5_wp, 0.0_wp, 0.0_wp])
    call check('cube in the floor', &
      wall_depth(shapes(1), [0.1_wp, 0.05_wp, 1.008_wp], upright, walls), 2.0e-3_wp, 1.0e-15_wp)
    call check('cube in the upper wall in x', &
      wall_depth(shapes(1), [0.3_wp, 0.05_wp, 1.1_wp], upright, walls), 0.01_wp, 1.0e-15_wp)
    call check('open top', wall_depth(shapes(1), [0.1_wp, 0.05_wp, 1.5_wp], upright, walls), 0.0_wp)
    call check('ball in the floor', &
      wall_depth(shapes(2), [0.1_wp, 0.05_wp, 1.008_wp], upright, walls), 2.0e-3_wp, 1.0e-15_wp)
    case%boundary%kind(:, 2) = 'periodic'
    case%boundary%kind(2, 1) = 'slip'
    call walls_init(case%grid, case%boundary, walls)
    call check('three walls left', all(walls%number(:3) == [-5, -2, -1]) .and. walls%n == 3)
    call check('one period', walls%period, [0.0_wp, 0.1_wp, 0.0_wp])
  end subroutine check_walls

  !> Largest overlap of a run: that of all pairs asked one by one; and room for a new body.
  subroutine check_run()
    integer, parameter :: n = 12
    type(world_t) :: world
    character(:), allocatable :: text
    real(wp) :: depth, expected, x(3), one, share(n + 1)
    integer :: a, b, deepest, counterpart

    text = tank//'&grid cells=3*2 length=3*.2/ &boundary x_min="periodic" x_max="periodic"/ '
    do a = 1, n + 1
      text = text//body(trim(merge('hexapod', 'cube   ', mod(a, 2) == 0)), 0.03_wp &
        + 0.14_wp*[uniform(2, a, 11), uniform(2, a, 12), uniform(2, a, 13)], &
        q=random_rotation(2, a), more=trim(merge('release_time=1', '              ', a == n + 1)))
    end do
    call set_up(text, world)
    world%deep%asked = .true.
    expected = 0.0_wp
    share = 0.0_wp
    do a = 1, n
      one = wall_depth(shapes(world%blocks%shape(a)), world%blocks%x(:, a), world%blocks%q(:, a), &
        world%walls)
      expected = max(expected, one)
      share(a) = max(share(a), one/world%deep%size(a))
      do b = 1, a - 1
        x = world%blocks%x(:, b) + nearest_shift(world%walls%period, &
          world%blocks%x(:, b) - world%blocks%x(:, a))
        one = overlap_depth(shapes(world%blocks%shape(a)), world%blocks%x(:, a), &
          world%blocks%q(:, a), shapes(world%blocks%shape(b)), x, world%blocks%q(:, b))
        expected = max(expected, one)
        share([a, b]) = max(share([a, b]), one/min(world%deep%size(a), world%deep%size(b)))
      end do
    end do
    call max_overlap(world%walls, world%blocks, world%overlap, depth, world%deep)
    call check('some overlap', expected > 1.0e-3_wp)
    call check('largest overlap', depth, expected, 1.0e-15_wp)
    call check('that of the body with the deepest', maxval(world%deep%depth), expected, 1.0e-15_wp)
    counterpart = world%deep%counterpart(maxloc(share, 1))
    where (share <= 0.05_wp) share = 0.0_wp
    call check('several reach deep', count(share > 0.0_wp) > 3)
    call check('all that reach deep are noted', world%deep%share, share, 1.0e-12_wp)
    world%deep%asked = .false.
    call max_overlap(world%walls, world%blocks, world%overlap, depth, world%deep)
    call check('nothing is asked for', depth <= 0.0_wp .and. all(world%deep%share <= 0.0_wp))
    deepest = maxloc(share, 1)
    world%deep%asked([deepest, counterpart]) = .true.
    call max_overlap(world%walls, world%blocks, world%overlap, depth, world%deep)
    call check('of two', world%deep%share(deepest), share(deepest), 1.0e-12_wp)
    call check('and of no more', count(world%deep%share > 0.0_wp), 2)
    world%blocks%present = .false.
    world%blocks%present(1) = .true.
    world%blocks%q = spread(upright, 2, n + 1)
    world%blocks%x(:, 1) = [0.15_wp, 0.1_wp, 0.1_wp]
    world%blocks%x(:, n + 1) = world%blocks%x(:, 1) + [d - 0.011_wp*d, 0.0_wp, 0.0_wp]
    call check('no room', .not. has_place(world%walls, world%blocks, n + 1, world%overlap))
    world%blocks%x(:, n + 1) = world%blocks%x(:, 1) + [d - 0.009_wp*d, 0.0_wp, 0.0_wp]
    call check('room', has_place(world%walls, world%blocks, n + 1, world%overlap))
    world%blocks%x(:, n + 1) = world%blocks%x(:, 1) + [d - 0.2_wp - 0.5_wp*d, 0.0_wp, 0.0_wp]
    call check('beside the image', .not. has_place(world%walls, world%blocks, n + 1, world%overlap))
    world%blocks%x(:, n + 1) = [0.05_wp, 0.1_wp, 0.5_wp*d - 0.011_wp*d]
    call check('in the floor', .not. has_place(world%walls, world%blocks, n + 1, world%overlap))
  end subroutine check_run

  !> The list of near pairs against all pairs, with and without periods.
  subroutine check_near_pairs()
    integer, parameter :: n = 200
    real(wp) :: x(3, n), radius(n), period(3), r(3)
    logical :: active(n)
    type(pair_list_t) :: pairs
    integer :: a, b, k, m, expected(2, n*n)

    do k = 1, 4
      period = merge(1.0_wp, 0.0_wp, [k == 2 .or. k == 3, k == 3, k == 3])
      radius = [(0.02_wp + 0.05_wp*uniform(3, a, 20), a=1, n)]
      if (k == 4) radius = 0.2_wp
      active = [(mod(a, 7) /= 0, a=1, n)]
      do a = 1, n
        x(:, a) = 1.6_wp*[uniform(3, a, 11), uniform(3, a, 12), uniform(3, a, 13)] - 0.3_wp
      end do
      m = 0
      do a = 1, n
        do b = 1, a - 1
          r = x(:, b) - x(:, a)
          r = r + nearest_shift(period, r)
          if (.not. (active(a) .and. active(b))) cycle
          if (norm2(r) >= radius(a) + radius(b) + 0.01_wp) cycle
          m = m + 1
          expected(:, m) = [a, b]
        end do
      end do
      call near_pairs(x, radius, active, period, 0.01_wp, pairs)
      call check('number of near pairs', pairs%n, m)
      if (pairs%n == m) call check('near pairs in order', &
        all(pairs%a(:m) == expected(1, :m)) .and. all(pairs%b(:m) == expected(2, :m)))
    end do
  end subroutine check_near_pairs

  !> Every box is in the bins of all its points, and in no bin twice.
  subroutine check_bins()
    integer, parameter :: n = 60
    real(wp) :: low(3, n), high(3, n), x(3)
    type(bins_t) :: bins
    logical :: found
    integer :: i, c, k

    do i = 1, n
      low(:, i) = [uniform(4, i, 1), uniform(4, i, 2), uniform(4, i, 3)]
      high(:, i) = low(:, i) + 0.3_wp*uniform(4, i, 4)
    end do
    call bins_build(low, high, 0.15_wp, bins)
    found = .true.
    do i = 1, n
      do k = 0, 4
        x = low(:, i) + 0.25_wp*real(k, wp)*(high(:, i) - low(:, i))
        c = bins%number(bins%place(x))
        found = found .and. count(bins%item(bins%first(c):bins%first(c + 1) - 1) == i) == 1
      end do
    end do
    call check('boxes are in their bins', found)
    call check('size of the bins', maxval(bins%size) <= 0.15_wp*(1 + 1.0e-12_wp))
  end subroutine check_bins

end module test_overlap_m
