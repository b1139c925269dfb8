!> Where the contact spheres of a block sit, and how well they stand for its surface.
!!
!! Source: Yoshikawa et al. (2008), section 2 (2): one sphere for each tetrahedron that has a face
!! on the surface, at its centroid, with the volume of the tetrahedron. As improvements the paper
!! names the spheres inscribed in the tetrahedra, and dense spheres (`dense_spheres_m`).
module contact_sphere_placement_m
  use kinds_m, only: wp, pi
  use vectors_m, only: cube_root, cross, norm
  use polyhedron_m, only: tet_volume
  use tet_mesh_m, only: shape_t, opposite
  implicit none
  private
  public :: place_at_centroids, place_inscribed, height_errors

contains

  !> Spheres of equal volume at the centroids of the tetrahedra under the surface.
  pure subroutine place_at_centroids(shape)
    type(shape_t), intent(inout) :: shape
    integer, allocatable :: tet(:)
    real(wp) :: x(3, 4)
    integer :: m

    call find_tets_at_surface(shape, tet)
    allocate (shape%sphere_centre(3, size(tet)), shape%sphere_radius(size(tet)))
    do m = 1, size(tet)
      x = shape%point(:, shape%tet(:, tet(m)))
      shape%sphere_centre(:, m) = sum(x, 2)/4.0_wp
      ! the sphere has the volume of the tetrahedron
      shape%sphere_radius(m) = cube_root(0.75_wp*tet_volume(x)/pi)
    end do
  end subroutine place_at_centroids

  !> Spheres inscribed in the tetrahedra under the surface: they touch all four faces.
  !!
  !! $$ r = 3 V/\sum_a A_a, \quad c = \sum_a A_a x_a/\sum_a A_a $$ with A_a the face opposite x_a.
  pure subroutine place_inscribed(shape)
    type(shape_t), intent(inout) :: shape
    integer, allocatable :: tet(:)
    real(wp) :: x(3, 4), y(3, 3), area(4)
    integer :: m, a

    call find_tets_at_surface(shape, tet)
    allocate (shape%sphere_centre(3, size(tet)), shape%sphere_radius(size(tet)))
    do m = 1, size(tet)
      x = shape%point(:, shape%tet(:, tet(m)))
      do a = 1, 4
        y = x(:, opposite(:, a))
        area(a) = 0.5_wp*norm(cross(y(:, 2) - y(:, 1), y(:, 3) - y(:, 1)))
      end do
      shape%sphere_centre(:, m) = matmul(x, area)/sum(area)
      shape%sphere_radius(m) = 3.0_wp*tet_volume(x)/sum(area)
    end do
  end subroutine place_inscribed

  !> Numbers of the tetrahedra that have a face on the surface.
  pure subroutine find_tets_at_surface(shape, tet)
    type(shape_t), intent(in) :: shape
    integer, allocatable, intent(out) :: tet(:)
    logical, allocatable :: at_surface(:)
    integer :: t

    allocate (at_surface(size(shape%tet, 2)), source=.false.)
    at_surface(shape%triangle_tet) = .true.
    tet = pack([(t, t=1, size(at_surface))], at_surface)
  end subroutine find_tets_at_surface

  !> How far the contact spheres reach short of the block, and beyond it, over all directions [m].
  !!
  !! On a flat floor the centroid stands as high as the block reaches down, so these are the largest
  !! errors of the heights at rest: the first is negative or zero, the second positive or zero.
  pure subroutine height_errors(shape, lowest, highest)
    type(shape_t), intent(in) :: shape
    real(wp), intent(out) :: lowest, highest
    integer, parameter :: directions = 5000
    real(wp), parameter :: turn = pi*(3.0_wp - sqrt(5.0_wp))   ! even over the sphere
    real(wp) :: z, u(3), error
    integer :: i

    lowest = 0.0_wp
    highest = 0.0_wp
    if (shape%kind == 'sphere') return
    do i = 1, directions
      z = (2.0_wp*real(i, wp) - 1.0_wp)/real(directions, wp) - 1.0_wp
      u = [sqrt(1.0_wp - z*z)*cos(turn*real(i, wp)), sqrt(1.0_wp - z*z)*sin(turn*real(i, wp)), z]
      error = maxval(matmul(u, shape%sphere_centre) + shape%sphere_radius) &
        - maxval(matmul(u, shape%point))
      lowest = min(lowest, error)
      highest = max(highest, error)
    end do
  end subroutine height_errors

end module contact_sphere_placement_m
