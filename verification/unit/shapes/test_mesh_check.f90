!> Meshes of tetrahedra from outside: what is put right, and what is refused with how many faults.
module test_mesh_check_m
  use kinds_m, only: wp
  use check_m, only: check
  use polyhedron_m, only: tet_volume
  use mesh_check_m, only: check_mesh
  implicit none
  private
  public :: test_mesh_check

  !> Corners of a cube, x first, and the five tetrahedra in it: the middle one last.
  real(wp), parameter :: cube(3, 8) = reshape([0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, &
    0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1]*1.0_wp, [3, 8])
  integer, parameter :: five(4, 5) = reshape([1, 2, 3, 5, 4, 3, 2, 8, 6, 2, 5, 8, 7, 5, 3, 8, &
    2, 3, 5, 8], [4, 5])

contains

  subroutine test_mesh_check()
    call check_mended()
    call check_refused()
    call check_counted_once()
  end subroutine test_mesh_check

  !> Tetrahedra inside out are turned, points in no use dropped; a mesh in order stays as it is.
  subroutine check_mended()
    real(wp), allocatable :: point(:, :)
    integer, allocatable :: tet(:, :)
    character(:), allocatable :: message
    integer :: t, k

    allocate (point, source=cube)
    allocate (tet, source=five)
    call check_mesh(point, tet, message)
    call check('a good cube: '//message, message == '')
    call check('stays', all(tet == five) .and. all(abs(point - cube) <= 0.0_wp))
    point = reshape([cube(:, :2), cube(:, 1:1) + 7, cube(:, 3:), cube(:, 1:1) - 7], [3, 10])
    where (five > 2) tet = five + 1
    tet(:, 2) = tet([2, 1, 3, 4], 2)
    tet(:, 5) = tet([1, 2, 4, 3], 5)
    call check_mesh(point, tet, message)
    call check('is mended: '//message, message == '')
    call check('points in use', all(shape(point) == shape(cube)))
    call check('in their order', all(abs(point - cube) <= 0.0_wp))
    do t = 1, 5
      call check('the same corners', all([(any(tet(:, t) == five(k, t)), k=1, 4)]))
    end do
    call check('volumes', [(tet_volume(point(:, tet(:, t))), t=1, 5)], [1, 1, 1, 1, 2]/6.0_wp, &
      1.0e-15_wp)
  end subroutine check_mended

  !> Each fault by itself.
  subroutine check_refused()
    integer, parameter :: none(4, 0) = 0

    call expect(cube, none, 'holds no tetrahedra; a surface alone has to be meshed first ' &
      //'(tools/make_shape.py)')
    call expect(cube, five(:, :4), 'the surface meets itself along 6 edges')
    call expect(sliver(0.99_wp), five(:, :1), '1 tetrahedra are flat')
    call expect(sliver(1.01_wp), five(:, :1), '')
    call expect(cube, five(:, [1, 2, 3, 4, 5, 1]), 'tetrahedra overlap at 4 of their faces')
    call expect(reshape([cube, cube + 2], [3, 16]), reshape([five, five + 8], [4, 10]), &
      'falls into 2 separate pieces')
    call expect(reshape([cube, cube + spread([0, 1, 0], 2, 8)*2], [3, 16]), &
      reshape([five, five + 8], [4, 10]), 'falls into 2 separate pieces')
  end subroutine check_refused

  !> A tetrahedron with a multiple of the least volume, a thousand millionth of its longest edge
  !! cubed; that edge is the square root of 2.
  pure function sliver(multiple) result(x)
    real(wp), intent(in) :: multiple
    real(wp) :: x(3, 8)

    x = cube
    x(:, 5) = [0.2_wp, 0.2_wp, multiple*6.0e-9_wp*sqrt(2.0_wp)**3]
  end function sliver

  !> Two cubes side by side that do not share their points: each of four is named once, wherever it
  !! stands. A row of four has twelve.
  subroutine check_counted_once()
    real(wp) :: shift(3)
    integer :: d, sense, i

    do d = 1, 3
      do sense = -1, 1, 2
        shift = 0.0_wp
        shift(d) = real(sense, wp)
        call expect(reshape([cube, cube + spread(shift, 2, 8)], [3, 16]), &
          reshape([five, five + 8], [4, 10]), '4 points stand in the place of another, join them')
      end do
    end do
    call expect(reshape([(cube + spread([real(i, wp), 0.0_wp, 0.0_wp], 2, 8), i=0, 3)], [3, 32]), &
      reshape([(five + 8*i, i=0, 3)], [4, 20]), &
      '12 points stand in the place of another, join them')
  end subroutine check_counted_once

  !> A mesh is refused with this message.
  subroutine expect(x, corners, problem)
    real(wp), intent(in) :: x(:, :)
    integer, intent(in) :: corners(:, :)
    character(*), intent(in) :: problem
    real(wp), allocatable :: point(:, :)
    integer, allocatable :: tet(:, :)
    character(:), allocatable :: message

    allocate (point, source=x)
    allocate (tet, source=corners)
    call check_mesh(point, tet, message)
    call check('got: '//message//', expected: '//problem, message == problem)
  end subroutine expect

end module test_mesh_check_m
