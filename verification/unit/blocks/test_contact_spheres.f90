!> Contact points of contact spheres: depth, place and normal on bodies, walls and periodic images,
!! those that come soon, and none lost while a list is kept.
module test_contact_spheres_m
  use kinds_m, only: wp
  use check_m, only: check
  use case_types_m, only: case_t
  use random_counter_m, only: uniform
  use vectors_m, only: rotation_matrix, quaternion_exp, quaternion_product
  use tet_mesh_m, only: shape_t
  use shapes_builtin_m, only: make_shape
  use rigid_body_m, only: blocks_t, blocks_init
  use walls_m, only: walls_t, walls_init
  use contact_points_m, only: contact_points_t
  use contact_spheres_m, only: contact_spheres_t, contact_spheres_init, find_sphere_points
  implicit none
  private
  public :: test_contact_spheres

  real(wp), parameter :: r(2) = [0.03_wp, 0.05_wp]   !! radii of the two balls [m]
  real(wp), parameter :: d = 0.001_wp                !! overlap [m]
  real(wp), parameter :: x(3) = [1.0_wp, 0.0_wp, 0.0_wp], z(3) = [0.0_wp, 0.0_wp, 1.0_wp]
  type(shape_t) :: shapes(3)

contains

  subroutine test_contact_spheres()
    call make_shapes()
    call check_pair()
    call check_floor()
    call check_image()
    call check_soon()
    call check_kept_list()
  end subroutine test_contact_spheres

  !> Two balls and a cube of many spheres.
  subroutine make_shapes()
    character(:), allocatable :: message
    type(case_t) :: case
    integer :: s

    allocate (case%shape(3))
    case%shape%name = [character(5) :: 'small', 'large', 'cube']
    case%shape%kind = [character(6) :: 'sphere', 'sphere', 'cube']
    do s = 1, 3
      case%shape(s)%size = 2*r(min(s, 2))
      call make_shape(case%shape(s), shapes(s), message)
    end do
  end subroutine make_shapes

  !> Bodies of some shapes in a tank of 1 m, with their contact spheres.
  subroutine begin(kinds, place, blocks, walls, spheres, periodic)
    character(*), intent(in) :: kinds(:)
    real(wp), intent(in) :: place(:, :)   !! (3, bodies) [m]
    type(blocks_t), intent(out) :: blocks
    type(walls_t), intent(out) :: walls
    type(contact_spheres_t), intent(out) :: spheres
    logical, intent(in), optional :: periodic
    type(case_t) :: case
    integer :: b

    allocate (case%body(size(kinds)), case%drop(0))
    case%grid%length = 1.0_wp
    if (present(periodic)) case%boundary%kind(:, 1) = 'periodic'
    do b = 1, size(kinds)
      case%body(b)%shape = kinds(b)
      case%body(b)%position = place(:, b)
    end do
    call blocks_init(case, shapes, blocks)
    call walls_init(case%grid, case%boundary, walls)
    call contact_spheres_init(case%contact%courant_max, blocks, spheres)
  end subroutine begin

  !> Two balls touch in the middle of their overlap; two that do not move are left out.
  subroutine check_pair()
    real(wp), parameter :: n(3) = [0.6_wp, 0.0_wp, 0.8_wp]
    type(blocks_t) :: blocks
    type(walls_t) :: walls
    type(contact_spheres_t) :: spheres
    type(contact_points_t) :: points
    real(wp) :: place(3, 2)
    integer :: b

    place(:, 1) = 0.5_wp
    place(:, 2) = 0.5_wp + (sum(r) - d)*n
    call begin(['small', 'large'], place, blocks, walls, spheres)
    call find_sphere_points(walls, blocks, 0.0_wp, spheres, points)
    call check('one contact point', points%n, 1)
    associate (point => points%item(1))
      call check('of the second and the first', all([point%a, point%b, point%id] == [2, 1, 1]))
      call check('overlap', point%depth, d, 1.0e-15_wp)
      call check('from the second to the first', point%normal, -n, 1.0e-13_wp)
      call check('middle seen from the second', point%arm_a, -(r(2) - 0.5_wp*d)*n, 1.0e-15_wp)
      call check('middle seen from the first', point%arm_b, (r(1) - 0.5_wp*d)*n, 1.0e-15_wp)
      call check('diameter of the smaller one', point%length, 2*r(1), 1.0e-16_wp)
    end associate
    do b = 1, 2
      blocks%still = [b == 1, b == 2]
      call find_sphere_points(walls, blocks, 0.0_wp, spheres, points)
      call check('one moves', points%n, 1)
    end do
    blocks%still = .true.
    call find_sphere_points(walls, blocks, 0.0_wp, spheres, points)
    call check('both are still', points%n, 0)
  end subroutine check_pair

  !> A ball touches the floor on the floor.
  subroutine check_floor()
    type(blocks_t) :: blocks
    type(walls_t) :: walls
    type(contact_spheres_t) :: spheres
    type(contact_points_t) :: points

    call begin(['large'], reshape([0.5_wp, 0.5_wp, r(2) - d], [3, 1]), blocks, walls, spheres)
    call find_sphere_points(walls, blocks, 0.0_wp, spheres, points)
    call check('one wall', points%n, 1)
    associate (point => points%item(1))
      call check('the floor', point%b, -5)
      call check('depth in the floor', point%depth, d, 1.0e-15_wp)
      call check('normal into the floor', point%normal, -z, 0.0_wp)
      call check('place on the floor', point%arm_a, -(r(2) - d)*z, 1.0e-15_wp)
    end associate
  end subroutine check_floor

  !> Balls on both sides of a periodic border touch through it.
  subroutine check_image()
    type(blocks_t) :: blocks
    type(walls_t) :: walls
    type(contact_spheres_t) :: spheres
    type(contact_points_t) :: points
    real(wp) :: place(3, 2)

    place = 0.5_wp
    place(1, :) = [0.01_wp, 1.01_wp - (sum(r) - d)]
    call begin(['small', 'large'], place, blocks, walls, spheres, .true.)
    call find_sphere_points(walls, blocks, 0.0_wp, spheres, points)
    call check('one image', points%n, 1)
    associate (point => points%item(1))
      call check('its overlap', point%depth, d, 1.0e-15_wp)
      call check('over the border', point%normal, x, 1.0e-13_wp)
      call check('seen from the image', point%arm_b, -(r(1) - 0.5_wp*d)*x, 1.0e-15_wp)
    end associate
  end subroutine check_image

  !> Balls a gap apart are told if they may meet in the time ahead, with what they move and turn.
  subroutine check_soon()
    real(wp), parameter :: gap = 1.0e-4_wp, speed = 0.1_wp
    type(blocks_t) :: blocks
    type(walls_t) :: walls
    type(contact_spheres_t) :: spheres
    type(contact_points_t) :: points
    real(wp) :: place(3, 2), rate

    place = 0.5_wp
    place(1, 2) = 0.5_wp + sum(r) + gap
    call begin(['small', 'large'], place, blocks, walls, spheres)
    call find_sphere_points(walls, blocks, 1.0_wp, spheres, points)
    call check('nothing moves', points%n, 0)
    blocks%v(1, :) = speed*[2, 1]
    blocks%omega(2, 1) = 4.0_wp
    rate = speed + 4.0_wp*r(1)
    call find_sphere_points(walls, blocks, 1.001_wp*gap/rate, spheres, points)
    call check('soon', points%n, 1)
    call check('depth below zero', points%item(1)%depth, -gap, 1.0e-15_wp)
    call find_sphere_points(walls, blocks, 0.999_wp*gap/rate, spheres, points)
    call check('not yet', points%n, 0)
  end subroutine check_soon

  !> While a cube slides over another, and both tremble, the list kept finds as much overlap as all
  !! spheres tried on all spheres and on the floor.
  subroutine check_kept_list()
    real(wp), parameter :: drift(3) = [0.3_wp, 0.2_wp, -0.1_wp]
    type(blocks_t) :: blocks
    type(walls_t) :: walls
    type(contact_spheres_t) :: spheres
    type(contact_points_t) :: points
    real(wp) :: step
    integer :: i, b, n

    call begin(['cube', 'cube'], reshape([0.5_wp, 0.5_wp, 0.05_wp, 0.45_wp, 0.48_wp, 0.15_wp], &
      [3, 2]), blocks, walls, spheres)
    step = 0.1_wp*minval(shapes(3)%sphere_radius)
    n = 0
    do i = 1, 200
      blocks%x(:, 2) = blocks%x(:, 2) + step*drift
      do b = 1, 2
        blocks%x(:, b) = blocks%x(:, b) + step*vector(i, b)
        blocks%q(:, b) = quaternion_product(quaternion_exp(step/r(2)*vector(i, 2 + b)), &
          blocks%q(:, b))
      end do
      call find_sphere_points(walls, blocks, 0.0_wp, spheres, points)
      n = n + points%n
      call check('overlap of all', sum(points%item(:points%n)%depth), overlap_of_all(blocks), &
        1.0e-13_wp)
    end do
    call check('they touch often', n > 1000)
  end subroutine check_kept_list

  !> Sum of all overlaps of the spheres of two cubes with one another and with the floor [m].
  function overlap_of_all(blocks) result(total)
    type(blocks_t), intent(in) :: blocks
    real(wp) :: total
    real(wp) :: c(3, size(shapes(3)%sphere_radius), 2)
    integer :: b, i, j

    total = 0.0_wp
    associate (radius => shapes(3)%sphere_radius)
      do b = 1, 2
        c(:, :, b) = matmul(rotation_matrix(blocks%q(:, b)), shapes(3)%sphere_centre) &
          + spread(blocks%x(:, b), 2, size(radius))
        total = total + sum(max(0.0_wp, radius - c(3, :, b)))
      end do
      do j = 1, size(radius)
        do i = 1, size(radius)
          total = total + max(0.0_wp, radius(i) + radius(j) - norm2(c(:, i, 1) - c(:, j, 2)))
        end do
      end do
    end associate
  end function overlap_of_all

  !> Three numbers between -1/2 and 1/2.
  pure function vector(i, k) result(v)
    integer, intent(in) :: i, k
    real(wp) :: v(3)

    v = [uniform(i, k, 1), uniform(i, k, 2), uniform(i, k, 3)] - 0.5_wp
  end function vector

end module test_contact_spheres_m
