!> Blocks of convex parts: volumes of frusta, faces outward whatever way round they are given,
!! tetrahedra of equal volume that fit, and closed nets by Euler's formula.
module test_convex_parts_m
  use check_m, only: check, wp
  use polyhedron_m, only: tet_volume
  use tet_mesh_m, only: surface_of_tets
  use convex_parts_m, only: points_t, parts_t, begin_part, add_face, end_part, add_frustum, &
    tets_of_parts, net_of_parts
  use surface_nets_m, only: check_net
  implicit none
  private
  public :: test_convex_parts

  real(wp), parameter :: square(3, 4) = reshape([0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0]*1.0_wp, [3, 4])
  type(points_t) :: points
  type(parts_t) :: parts

contains

  subroutine begin()
    points = points_t(same=1.0e-9_wp)
    parts = parts_t()
  end subroutine begin

  subroutine test_convex_parts()
    call check_frustum()
    call check_either_way_round()
    call check_fine()
    call check_from_middle()
    call check_glued()
    call check_ring()
  end subroutine test_convex_parts

  !> A frustum of height 3 between squares of edge 2 and 1 has the volume
  !! 3/3 (4 + sqrt(4) + 1) = 7, eight corners, twelve edges and six faces.
  subroutine check_frustum()
    call begin()
    call add_frustum(2*square, square + at(0, 0, 3), points, parts)
    call check_parts(2, 6, 7.0_wp)
    call check('corners', points%n, 8)
  end subroutine check_frustum

  !> A tetrahedron of volume 1/6 from faces given in all 16 ways round.
  subroutine check_either_way_round()
    real(wp), parameter :: x(3, 4) = reshape([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]*1.0_wp, [3, 4])
    integer, parameter :: other(3, 4) = reshape([2, 3, 4, 3, 4, 1, 4, 1, 2, 1, 2, 3], [3, 4])
    integer :: i, f

    do i = 0, 15
      call begin()
      call begin_part(parts)
      do f = 1, 4
        if (btest(i, f - 1)) call add_face(x(:, other(:, f)), points, parts)
        if (.not. btest(i, f - 1)) call add_face(x(:, other([3, 2, 1], f)), points, parts)
      end do
      call end_part(points, parts)
      call check_parts(2, 4, 1.0_wp/6)
    end do
  end subroutine check_either_way_round

  !> Each tetrahedron of a part is cut into n^3 of equal volume; those of a part and of the next
  !! fit, so that the surface has n^2 triangles for each of before.
  subroutine check_fine()
    integer, allocatable :: coarse(:, :), tet(:, :), triangle(:, :), behind(:)
    real(wp) :: volume
    integer :: n, t

    do n = 1, 4
      call begin()
      call add_frustum(2*square, square + at(0, 0, 3), points, parts)
      call add_frustum(square + at(0, 0, 3), 2*square + at(-1, -1, 5), points, parts)
      call tets_of_parts(parts, .false., 1, points, coarse)
      call tets_of_parts(parts, .false., n, points, tet)
      call check('tetrahedra: two of each face and its part', size(coarse, 2), 2*6*2)
      call check('n cubed of each', size(tet, 2), n**3*size(coarse, 2))
      do t = 1, size(tet, 2)
        volume = tet_volume(points%x(:, coarse(:, 1 + (t - 1)/n**3)))/n**3
        if (abs(tet_volume(points%x(:, tet(:, t))) - volume) > 1.0e-15_wp) exit
      end do
      call check('of equal volume', t > size(tet, 2))
      call surface_of_tets(points%n, tet, triangle, behind)
      call check('they fit', size(triangle, 2), n**2*2*10)
    end do
  end subroutine check_fine

  !> A hexagon of a prism is cut into four triangles from a corner, into six from its middle; its
  !! four-sided faces into two either way.
  subroutine check_from_middle()
    integer, allocatable :: tet(:, :)
    real(wp), parameter :: hexagon(3, 6) = reshape([2, 0, 0, 1, 1, 0, -1, 1, 0, -2, 0, 0, &
      -1, -1, 0, 1, -1, 0]*1.0_wp, [3, 6])

    call begin()
    call add_frustum(hexagon, hexagon + spread([0.0_wp, 0.0_wp, 1.0_wp], 2, 6), points, parts)
    call check_parts(2, 8, 6.0_wp)
    call tets_of_parts(parts, .false., 1, points, tet)
    call check('from a corner', size(tet, 2), 2*4 + 6*2)
    call tets_of_parts(parts, .true., 1, points, tet)
    call check('from the middle', size(tet, 2), 2*6 + 6*2)
  end subroutine check_from_middle

  !> Two parts share the face between them, which is no part of the surface, and its corners.
  subroutine check_glued()
    call begin()
    call add_frustum(2*square, square + at(0, 0, 3), points, parts)
    call add_frustum(square + at(0, 0, 3) + 1.0e-10_wp, 2*square + at(-1, -1, 6), points, parts)
    call check('shared corners', points%n, 12)
    call check_parts(2, 10, 14.0_wp)
  end subroutine check_glued

  !> Eight cubes in a ring: Euler's formula tells the hole.
  subroutine check_ring()
    integer :: i, j

    call begin()
    do j = -1, 1
      do i = -1, 1
        if (i == 0 .and. j == 0) cycle
        call add_frustum(square + at(i, j, 0), square + at(i, j, 1), points, parts)
      end do
    end do
    call check_parts(0, 8*4, 8.0_wp)
  end subroutine check_ring

  !> The net of the surface: Euler's number, faces, volume.
  subroutine check_parts(euler, faces, volume)
    integer, intent(in) :: euler, faces
    real(wp), intent(in) :: volume
    integer, allocatable :: facet(:), corner(:)

    call net_of_parts(parts, facet, corner)
    call check('faces', size(facet) - 1, faces)
    call check_net('parts', points%x(:, :points%n), facet, corner, euler, volume)
  end subroutine check_parts

  !> A shift of four points.
  pure function at(i, j, k) result(shift)
    integer, intent(in) :: i, j, k
    real(wp) :: shift(3, 4)

    shift = spread(real([i, j, k], wp), 2, 4)
  end function at

end module test_convex_parts_m
