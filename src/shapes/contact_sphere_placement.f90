!> Where the contact spheres of a block sit, and how well they stand for its surface.
!!
!! Source: Yoshikawa et al. (2008), section 2 (2): one sphere for each tetrahedron that has a face
!! on the surface, at its centroid, with the volume of the tetrahedron. As improvements the paper
!! names the spheres inscribed in the tetrahedra, and dense spheres (`dense_spheres_m`).
module contact_sphere_placement_m
  use kinds_m, only: wp, pi
  use vectors_m, only: cube_root, norm
  use polygon_m, only: area_vector
  use polyhedron_m, only: tet_volume
  use tet_mesh_m, only: shape_t, opposite
  implicit none
  private
  public :: place_in_tets, height_errors

contains

  !> A sphere for each tetrahedron that has a face on the surface.
  !!
  !! At its centroid with its volume, or inscribed, touching all four faces:
  !! $$ r = 3 V/\sum_a A_a, \quad c = \sum_a A_a x_a/\sum_a A_a $$ with A_a the face opposite x_a.
  pure subroutine place_in_tets(inscribed, shape)
    logical, intent(in) :: inscribed
    type(shape_t), intent(inout) :: shape
    integer, allocatable :: tet(:)
    logical :: at_surface(size(shape%tet, 2))
    real(wp) :: x(3, 4), area(4)
    integer :: m, a

    at_surface = .false.
    at_surface(shape%triangle_tet) = .true.
    tet = pack([(m, m=1, size(at_surface))], at_surface)
    allocate (shape%sphere_centre(3, size(tet)), shape%sphere_radius(size(tet)))
    do m = 1, size(tet)
      x = shape%point(:, shape%tet(:, tet(m)))
      if (inscribed) then
        area = [(norm(area_vector(x(:, opposite(:, a)))), a=1, 4)]
        shape%sphere_centre(:, m) = matmul(x, area)/sum(area)
        shape%sphere_radius(m) = 3.0_wp*tet_volume(x)/sum(area)
      else
        shape%sphere_centre(:, m) = sum(x, 2)/4.0_wp
        shape%sphere_radius(m) = cube_root(0.75_wp*tet_volume(x)/pi)
      end if
    end do
  end subroutine place_in_tets

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
