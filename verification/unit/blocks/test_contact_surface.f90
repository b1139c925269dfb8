!> Contact points of exact surfaces: where they are, how deep, and which may come.
module test_contact_surface_m
  use check_m, only: check, wp, pi
  use vectors_m, only: cross, quaternion_from_axis, quaternion_exp, quaternion_product, normalised
  use random_counter_m, only: uniform, random_rotation
  use contact_points_m, only: contact_points_t
  use contact_surface_m, only: contact_surface_t, contact_surface_init, find_surface_points
  use world_m, only: world_t, set_up, body
  implicit none
  private
  public :: test_contact_surface

  type, extends(world_t) :: touching_t
    type(contact_surface_t) :: surface
    type(contact_points_t) :: points
  end type touching_t

  real(wp), parameter :: d = 0.02_wp         !! edge of the cubes, diameter of the ball [m]
  real(wp), parameter :: upright(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]

contains

  subroutine test_contact_surface()
    call check_rest_heights()
    call check_corner_in_face()
    call check_crossing_edges()
    call check_faces_on_one_another()
    call check_points_to_come()
    call check_balls()
    call check_balls_held()
    call check_lists()
  end subroutine test_contact_surface

  !> A tank of 1 m with bodies of the given shapes.
  subroutine new_world(world, names)
    type(touching_t), intent(out) :: world
    character(*), intent(in) :: names(:)
    character(:), allocatable :: text
    integer :: b

    text = '&run t_end=1 physics="dry"/ &grid cells=3*2 length=3*1/ &shape name="hexapod" ' &
      //'kind="hexapod" size=.02 refinement=1/ &shape name="cube" kind="cube" size=.02 ' &
      //'refinement=1/ &shape name="ball" kind="sphere" size=.02/ &shape name="fine" ' &
      //'kind="hexapod" size=.02 refinement=3/ '
    do b = 1, size(names)
      text = text//body(trim(names(b)), [0.5_wp, 0.5_wp, 0.5_wp])
    end do
    call set_up(text, world%world_t)
    call contact_surface_init(1.0e-3_wp, world%blocks, world%surface)
  end subroutine new_world

  subroutine find(world)
    type(touching_t), intent(inout) :: world

    call find_surface_points(world%walls, world%blocks, 0.0_wp, world%surface, world%points)
  end subroutine find

  !> A hexapod on one, two, three legs: heights 1.5 d, sqrt(2) d, 2.5 d/sqrt(3), standing corners.
  subroutine check_rest_heights()
    type(touching_t) :: world
    real(wp), parameter :: sunk = 1.0e-5_wp, &
      height(3) = d*[1.5_wp, sqrt(2.0_wp), 2.5_wp/sqrt(3.0_wp)]
    integer, parameter :: corners(3) = [4, 4, 3]
    character(8), parameter :: names(2) = [character(8) :: 'hexapod', 'fine']
    real(wp) :: q(4, 3)
    integer :: pose, shape

    q(:, 1) = upright
    q(:, 2) = quaternion_from_axis([1.0_wp, 0.0_wp, 0.0_wp], 0.25_wp*pi)
    q(:, 3) = quaternion_product(quaternion_from_axis([0.0_wp, 1.0_wp, 0.0_wp], &
      atan(sqrt(0.5_wp))), q(:, 2))
    do shape = 1, 2
      do pose = 1, 3
        call new_world(world, names(shape:shape))
        world%blocks%q(:, 1) = q(:, pose)
        world%blocks%x(3, 1) = height(pose) + sunk
        call find(world)
        call check('above its height it does not touch', world%points%n, 0)
        world%blocks%x(3, 1) = height(pose) - sunk
        call find(world)
        call check('corners that stand', world%points%n, corners(pose))
        call check('sunk', maxval(world%points%item(:world%points%n)%depth), sunk, 1.0e-15_wp)
      end do
    end do
  end subroutine check_rest_heights

  !> The corner of a cube in the face of another, from both sides.
  subroutine check_corner_in_face()
    type(touching_t) :: world
    real(wp), parameter :: depth = 2.0e-4_wp, at(3) = [0.503_wp, 0.498_wp, 0.51_wp - 0.5_wp*depth]
    integer :: upper

    do upper = 1, 2
      call new_world(world, ['cube', 'cube'])
      world%blocks%q(:, upper) = quaternion_from_axis([1.0_wp, -1.0_wp, 0.0_wp], atan(sqrt(2.0_wp)))
      world%blocks%x(:, upper) = [at(:2), 0.5_wp + 0.5_wp*d*(1.0_wp + sqrt(3.0_wp)) - depth]
      call find(world)
      call check('one corner in a face', world%points%n, 1)
      associate (point => world%points%item(1))
        call check('its depth', point%depth, depth, 1.0e-15_wp)
        call check('normal from a to b', point%normal(3), 3.0_wp - 2*upper, 1.0e-14_wp)
        call check('its arm', point%arm_a + world%blocks%x(:, 2), at, 1.0e-15_wp)
        call check('both arms meet', point%arm_b + world%blocks%x(:, 1), at, 1.0e-15_wp)
      end associate
    end do
  end subroutine check_corner_in_face

  !> Two cubes on edge, crossed: the edges touch at one point, where no corner is near.
  subroutine check_crossing_edges()
    type(touching_t) :: world
    real(wp), parameter :: depth = 2.0e-4_wp

    call new_world(world, ['cube', 'cube'])
    world%blocks%q(:, 1) = quaternion_from_axis([1.0_wp, 0.0_wp, 0.0_wp], 0.25_wp*pi)
    world%blocks%q(:, 2) = quaternion_from_axis([0.0_wp, 1.0_wp, 0.0_wp], 0.25_wp*pi)
    world%blocks%x(:, 2) = [0.503_wp, 0.496_wp, 0.5_wp + sqrt(2.0_wp)*d - depth]
    call find(world)
    call check('two edges cross', world%points%n, 1)
    call check('depth between the edges', world%points%item(1)%depth, depth, 1.0e-15_wp)
    call check('they count', world%points%item(1)%weight, 1.0_wp, 1.0e-15_wp)
    call check('normal to both', world%points%item(1)%normal, [0.0_wp, 0.0_wp, -1.0_wp], 1.0e-14_wp)
    call check('where they cross', world%points%item(1)%arm_b(1:2), [0.003_wp, 0.0_wp], 1.0e-15_wp)
    world%blocks%x(3, 2) = world%blocks%x(3, 2) + 2*depth
    call find(world)
    call check('apart', world%points%n, 0)
  end subroutine check_crossing_edges

  !> Cubes exactly on one another, and two beams crossed flat: carried without tilt.
  subroutine check_faces_on_one_another()
    type(touching_t) :: world
    real(wp), parameter :: depth = 1.0e-5_wp
    real(wp) :: force, torque(3)
    integer :: t, cross_laid

    do cross_laid = 0, 1
      call new_world(world, spread(merge('cube   ', 'hexapod', cross_laid == 0), 1, 2))
      world%blocks%x(3, 2) = 0.5_wp + d - depth
      ! the middle of a leg of each on that of the other
      if (cross_laid == 1) world%blocks%x(:, 2) = 0.5_wp + [d, d, d - depth]
      call find(world)
      force = 0.0_wp
      torque = 0.0_wp
      do t = 1, world%points%n
        associate (point => world%points%item(t))
          if (abs(point%normal(3)) < 0.5_wp) cycle
          force = force + point%weight*point%depth
          torque = torque + cross(point%arm_b, point%normal)*point%weight*point%depth
        end associate
      end do
      call check('a face carries', force > 0.9_wp*depth)
      if (cross_laid == 0) call check('tilt', torque, [0.0_wp, 0.0_wp, 0.0_wp], 1.0e-9_wp*d*force)
    end do
  end subroutine check_faces_on_one_another

  !> A cube a gap above another may touch soon if it comes down, by its fall or its spin, not if it
  !! goes sideways.
  subroutine check_points_to_come()
    real(wp), parameter :: ahead = 2.0e-3_wp, gap = 4.0e-4_wp, speed = 0.5_wp
    type(touching_t) :: world
    real(wp), parameter :: spin(4) = [0.0_wp, 0.0_wp, 0.0_wp, 2*speed/d], &
      v(3, 4) = speed*reshape([0, 0, -1, 1, 0, 0, 0, 0, 1, 0, 0, 0], [3, 4])
    integer :: m

    do m = 1, 4
      call new_world(world, ['cube', 'cube'])
      world%blocks%x(3, 2) = 0.5_wp + d + gap
      world%blocks%v(:, 2) = v(:, m)
      world%blocks%omega(2, 2) = spin(m)
      world%surface%search%margin = 1.0e-4_wp
      call find_surface_points(world%walls, world%blocks, ahead, world%surface, world%points)
      call check('comes', (world%points%n > 0) .eqv. (m == 1 .or. m == 4))
      if (m == 4) call check('side', minval(world%points%item(:world%points%n)%arm_a(1)) > 0.0_wp)
    end do
  end subroutine check_points_to_come

  !> A ball touches a ball, a face, an edge, a corner and a wall at one point each.
  subroutine check_balls()
    type(touching_t) :: world
    real(wp), parameter :: depth = 1.0e-4_wp, half = 0.5_wp*d, &
      way(3, 5) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, sqrt(0.5_wp), &
      sqrt(0.5_wp), 0.0_wp, spread(sqrt(1/3.0_wp), 1, 3), 0.0_wp, 0.0_wp, 1.0_wp], [3, 5]), &
      at(3, 5) = reshape([0.5_wp + half, 0.5_wp, 0.5_wp, 0.5_wp + half, 0.5_wp, 0.5_wp, &
      0.5_wp + half, 0.5_wp + half, 0.5_wp, spread(0.5_wp + half, 1, 3), 0.2_wp, 0.3_wp, 0.0_wp], &
      [3, 5])   ! where the ball would touch
    integer :: m

    do m = 1, 5
      call new_world(world, [merge('ball', 'cube', m == 1), 'ball'])
      world%blocks%x(:, 2) = at(:, m) + way(:, m)*(half - depth)
      call find(world)
      call check('a ball touches once', world%points%n, 1)
      call check('its depth', world%points%item(1)%depth, depth, 1.0e-15_wp)
      call check('its normal', world%points%item(1)%normal, -way(:, m), 1.0e-12_wp)
    end do
  end subroutine check_balls

  !> A ball between the legs of a hexapod touches all of them: two faces in a groove, three edges.
  subroutine check_balls_held()
    type(touching_t) :: world
    real(wp), parameter :: depth = 1.0e-4_wp, half = 0.5_wp*d, away = half - depth, &
      at(3, 2) = reshape([half + away, half + away, 0.3_wp*half, &
      spread(half + away*sqrt(0.5_wp), 1, 3)], [3, 2]), &
      normals(3, 2) = reshape([-1.0_wp, -1.0_wp, 0.0_wp, spread(-sqrt(2.0_wp), 1, 3)], [3, 2])
    integer :: m, k, i

    do m = 1, 2
      call new_world(world, [character(7) :: 'hexapod', 'ball'])
      world%blocks%x(:, 2) = world%blocks%x(:, 1) + at(:, m)
      call find(world)
      call check('a ball that is held', world%points%n, m + 1)
      associate (item => world%points%item(:world%points%n))
        call check('its depths', item%depth, [(depth, k=1, m + 1)], 1.0e-15_wp)
        call check('its normals', [(sum(item%normal(i)), i=1, 3)], normals(:, m), 1.0e-12_wp)
      end associate
    end do
  end subroutine check_balls_held

  !> Shift and turn body 2.
  subroutine move(world, shift, turn)
    type(touching_t), intent(inout) :: world
    real(wp), intent(in) :: shift(3), turn(3)   !! [m], [rad]

    world%blocks%x(:, 2) = world%blocks%x(:, 2) + shift
    world%blocks%q(:, 2) = normalised(quaternion_product(quaternion_exp(turn), &
                                                         world%blocks%q(:, 2)))
  end subroutine move

  !> What is found does not depend on when the lists were made: a body carried past another, in
  !! strides within which it trembles a little.
  subroutine check_lists()
    type(touching_t), save :: new, world, fresh
    integer :: step, tremble, differ, touched

    call new_world(new, ['hexapod', 'hexapod'])
    world = new
    world%blocks%q(:, 2) = random_rotation(7, 1)
    differ = 0
    touched = 0
    do step = 1, 400
      world%blocks%x(:, 2) = 0.5_wp + [0.08_wp - 4.0e-4_wp*step, 0.03_wp, 0.035_wp]
      call move(world, [0.0_wp, 0.0_wp, 0.0_wp], [0.0_wp, 0.002_wp, 0.001_wp])
      do tremble = 1, 6
        call move(world, [-5.0e-6_wp, 3.0e-6_wp, -4.0e-6_wp], [1.0e-4_wp, 0.0_wp, 0.0_wp])
        call find(world)
        fresh = new
        fresh%blocks%x = world%blocks%x
        fresh%blocks%q = world%blocks%q
        call find(fresh)
        if (world%points%n > 0) touched = touched + 1
        if (.not. same_points(world, fresh)) differ = differ + 1
      end do
    end do
    call check('lists of any age give the same', differ, 0)
    call check('while the bodies touch', touched > 300)
  end subroutine check_lists

  !> Whether what touches is the same in two worlds, bit by bit.
  logical function same_points(one, two) result(same)
    type(touching_t), intent(in) :: one, two
    integer :: n

    n = one%points%n
    same = n == two%points%n
    if (.not. same .or. n == 0) return
    same = all(one%points%item(:n)%id == two%points%item(:n)%id) &
      .and. .not. any(abs(one%points%item(:n)%depth - two%points%item(:n)%depth) > 0.0_wp)
  end function same_points

end module test_contact_surface_m
