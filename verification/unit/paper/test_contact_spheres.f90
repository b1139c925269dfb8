!> Contact points of contact spheres: depth, place and normal on bodies, walls and periodic images,
!! those that come soon, and none lost while a list is kept.
module test_contact_spheres_m
  use check_m, only: check, wp
  use vectors_m, only: rotation_matrix, quaternion_exp, quaternion_product
  use contact_points_m, only: contact_points_t
  use contact_spheres_m, only: contact_spheres_t, contact_spheres_init, find_sphere_points
  use world_m, only: world_t, set_up, body
  use two_cubes_m, only: vector
  implicit none
  private
  public :: test_contact_spheres

  real(wp), parameter :: r(2) = [0.03_wp, 0.05_wp]   !! radii of the two balls [m]
  real(wp), parameter :: d = 0.001_wp                !! overlap [m]
  real(wp), parameter :: x(3) = [1.0_wp, 0.0_wp, 0.0_wp], z(3) = [0.0_wp, 0.0_wp, 1.0_wp]
  type(world_t) :: world
  type(contact_spheres_t) :: spheres
  type(contact_points_t) :: points

contains

  subroutine test_contact_spheres()
    call check_pair()
    call check_floor()
    call check_image()
    call check_soon()
    call check_kept_list()
  end subroutine test_contact_spheres

  !> Bodies of some shapes, two balls and a cube of many spheres, in a tank of 1 m.
  subroutine begin(shapes, place, boundary)
    character(*), intent(in) :: shapes(:)
    real(wp), intent(in) :: place(:, :)   !! (3, bodies) [m]
    character(*), intent(in), optional :: boundary
    character(:), allocatable :: text
    integer :: b

    text = '&run t_end=1 physics="dry"/ &grid cells=3*2 length=3*1/ &shape name="small" ' &
      //'kind="sphere" size=.06/ &shape name="large" kind="sphere" size=.1/ &shape name="cube" ' &
      //'kind="cube" size=.1/ '
    if (present(boundary)) text = text//boundary
    do b = 1, size(shapes)
      text = text//body(shapes(b), place(:, b))
    end do
    call set_up(text, world)
    call contact_spheres_init(world%case%contact%courant_max, world%blocks, spheres)
  end subroutine begin

  subroutine find(ahead)
    real(wp), intent(in) :: ahead   !! [s]

    call find_sphere_points(world%walls, world%blocks, ahead, spheres, points)
  end subroutine find

  !> Two balls touch in the middle of their overlap; two that do not move are left out.
  subroutine check_pair()
    real(wp), parameter :: n(3) = [0.6_wp, 0.0_wp, 0.8_wp]
    real(wp) :: place(3, 2)
    integer :: b

    place(:, 1) = 0.5_wp
    place(:, 2) = 0.5_wp + (sum(r) - d)*n
    call begin(['small', 'large'], place)
    call find(0.0_wp)
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
      world%blocks%still = [b == 1, b == 2]
      call find(0.0_wp)
      call check('one moves', points%n, 1)
    end do
    world%blocks%still = .true.
    call find(0.0_wp)
    call check('both are still', points%n, 0)
  end subroutine check_pair

  !> A ball touches the floor on the floor.
  subroutine check_floor()

    call begin(['large'], reshape([0.5_wp, 0.5_wp, r(2) - d], [3, 1]))
    call find(0.0_wp)
    call check('one wall', points%n, 1)
    associate (point => points%item(1))
      call check('the floor', point%b, -5)
      call check('depth in the floor', point%depth, d, 1.0e-15_wp)
      call check('normal into the floor', point%normal, -z)
      call check('place on the floor', point%arm_a, -(r(2) - d)*z, 1.0e-15_wp)
    end associate
  end subroutine check_floor

  !> Balls on both sides of a periodic border touch through it.
  subroutine check_image()
    real(wp) :: place(3, 2)

    place = 0.5_wp
    place(1, :) = [0.01_wp, 1.01_wp - (sum(r) - d)]
    call begin(['small', 'large'], place, '&boundary x_min="periodic" x_max="periodic"/ ')
    call find(0.0_wp)
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
    real(wp) :: place(3, 2), rate

    place = 0.5_wp
    place(1, 2) = 0.5_wp + sum(r) + gap
    call begin(['small', 'large'], place)
    call find(1.0_wp)
    call check('nothing moves', points%n, 0)
    world%blocks%v(1, :) = speed*[2, 1]
    world%blocks%omega(2, 1) = 4.0_wp
    rate = speed + 4.0_wp*r(1)
    call find(1.001_wp*gap/rate)
    call check('soon', points%n, 1)
    call check('depth below zero', points%item(1)%depth, -gap, 1.0e-15_wp)
    call find(0.999_wp*gap/rate)
    call check('not yet', points%n, 0)
  end subroutine check_soon

  !> While a cube slides over another, and both tremble, the list kept finds as much overlap as all
  !! spheres tried on all spheres and on the floor.
  subroutine check_kept_list()
    real(wp), parameter :: drift(3) = [0.3_wp, 0.2_wp, -0.1_wp]
    real(wp) :: step
    integer :: i, b, n

    call begin(['cube', 'cube'], reshape([0.5_wp, 0.5_wp, 0.05_wp, 0.45_wp, 0.48_wp, 0.15_wp], &
      [3, 2]))
    step = 0.1_wp*minval(world%shapes(3)%sphere_radius)
    n = 0
    do i = 1, 200
      world%blocks%x(:, 2) = world%blocks%x(:, 2) + step*drift
      do b = 1, 2
        world%blocks%x(:, b) = world%blocks%x(:, b) + step*vector(i, b)
        world%blocks%q(:, b) = quaternion_product(quaternion_exp(step/r(2)*vector(i, 2 + b)), &
          world%blocks%q(:, b))
      end do
      call find(0.0_wp)
      n = n + points%n
      call check('overlap of all', sum(points%item(:points%n)%depth), overlap_of_all(), 1.0e-13_wp)
    end do
    call check('they touch often', n > 1000)
  end subroutine check_kept_list

  !> Sum of all overlaps of the spheres of two cubes with one another and with the floor [m].
  function overlap_of_all() result(total)
    real(wp) :: total, c(3, size(world%shapes(3)%sphere_radius), 2)
    integer :: b, i, j

    total = 0.0_wp
    associate (radius => world%shapes(3)%sphere_radius)
      do b = 1, 2
        c(:, :, b) = matmul(rotation_matrix(world%blocks%q(:, b)), world%shapes(3)%sphere_centre) &
          + spread(world%blocks%x(:, b), 2, size(radius))
        total = total + sum(max(0.0_wp, radius - c(3, :, b)))
      end do
      do j = 1, size(radius)
        do i = 1, size(radius)
          total = total + max(0.0_wp, radius(i) + radius(j) - norm2(c(:, i, 1) - c(:, j, 2)))
        end do
      end do
    end associate
  end function overlap_of_all

end module test_contact_spheres_m
