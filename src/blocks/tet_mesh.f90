!> A block of the T-type model: tetrahedra, their surface, contact spheres and mass.
!!
!! Body axes: origin at the centre of mass. Source: Yoshikawa et al. (2008), section 2 (1).
module tet_mesh_m
  use kinds_m, only: wp, name_length
  implicit none
  private
  public :: shape_t

  type :: shape_t
    character(name_length) :: name = '', kind = ''
    real(wp) :: density = 0.0_wp               !! [kg/m3]
    real(wp) :: volume = 0.0_wp                !! [m3]
    real(wp) :: inertia(3, 3) = 0.0_wp         !! about the centroid, body axes [kg m2]
    real(wp) :: radius = 0.0_wp                !! of the sphere about the centroid that holds the block [m]
    real(wp) :: smallest_edge = 0.0_wp         !! [m]
    real(wp), allocatable :: point(:, :)       !! (3, n) corners relative to the centroid [m]
    integer, allocatable :: tet(:, :)          !! (4, n) corners, positive volume
    integer, allocatable :: triangle(:, :)     !! (3, n) surface, seen counter-clockwise from outside
    integer, allocatable :: triangle_tet(:)    !! (n) the tetrahedron behind each surface triangle
    real(wp), allocatable :: sphere_centre(:, :)  !! (3, n) contact spheres [m]
    real(wp), allocatable :: sphere_radius(:)     !! (n) [m]
  end type shape_t

end module tet_mesh_m
