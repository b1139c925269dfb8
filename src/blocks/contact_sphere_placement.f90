!> Where the contact spheres of a block sit.
!!
!! Source: Yoshikawa et al. (2008), section 2 (2): one sphere for each tetrahedron that has a face
!! on the surface, at its centroid, with the volume of the tetrahedron.
module contact_sphere_placement_m
  use kinds_m, only: wp, pi
  use polyhedron_m, only: tet_volume
  use tet_mesh_m, only: shape_t
  implicit none
  private
  public :: place_at_centroids, place_one_sphere

contains

  !> Spheres of equal volume at the centroids of the tetrahedra under the surface.
  pure subroutine place_at_centroids(shape)
    type(shape_t), intent(inout) :: shape
    logical :: at_surface(size(shape%tet, 2))
    integer :: t, n

    at_surface = .false.
    at_surface(shape%triangle_tet) = .true.
    n = count(at_surface)
    allocate (shape%sphere_centre(3, n), shape%sphere_radius(n))
    n = 0
    do t = 1, size(shape%tet, 2)
      if (.not. at_surface(t)) cycle
      n = n + 1
      shape%sphere_centre(:, n) = sum(shape%point(:, shape%tet(:, t)), 2)/4.0_wp
      shape%sphere_radius(n) = sphere_of_volume(tet_volume(shape%point(:, shape%tet(:, t))))
    end do
  end subroutine place_at_centroids

  !> A sphere touches as a sphere: one contact sphere of the true radius.
  pure subroutine place_one_sphere(radius, shape)
    real(wp), intent(in) :: radius   !! [m]
    type(shape_t), intent(inout) :: shape

    allocate (shape%sphere_centre(3, 1), source=0.0_wp)
    allocate (shape%sphere_radius(1), source=radius)
  end subroutine place_one_sphere

  !> Radius of the sphere with a given volume [m].
  pure function sphere_of_volume(volume) result(radius)
    real(wp), intent(in) :: volume   !! [m3]
    real(wp) :: radius

    radius = (0.75_wp*volume/pi)**(1.0_wp/3.0_wp)
  end function sphere_of_volume

end module contact_sphere_placement_m
