!> A block of the T-type model: tetrahedra, their surface, contact spheres and mass.
!!
!! Body axes: origin at the centre of mass. Source: Yoshikawa et al. (2008), section 2 (1).
module tet_mesh_m
  use kinds_m, only: wp, name_length
  implicit none
  private
  public :: shape_t, is_called, extreme_of_family, extent_along, surface_of_tets, opposite
  public :: max_facet_corners

  integer, parameter :: max_facet_corners = 48   !! of one polygon of the surface

  type :: shape_t
    character(name_length) :: name = '', kind = ''
    character(name_length) :: family = ''      !! of a stone: the name of its `&shape`
    real(wp) :: density = 0.0_wp               !! [kg/m3]
    real(wp) :: volume = 0.0_wp                !! [m3]
    real(wp) :: inertia(3, 3) = 0.0_wp         !! about the centroid, body axes [kg m2]
    real(wp) :: radius = 0.0_wp                !! of the sphere about the centroid that holds the
                                               !! block and its contact spheres [m]
    real(wp) :: smallest_edge = 0.0_wp         !! of the form, not of its tetrahedra; sphere:
                                               !! its diameter [m]
    real(wp), allocatable :: point(:, :)       !! (3, n) corners relative to the centroid [m]
    integer, allocatable :: tet(:, :)          !! (4, n) corners, positive volume
    integer, allocatable :: triangle(:, :)     !! (3, n) surface, counter-clockwise from outside
    integer, allocatable :: triangle_tet(:)    !! (n) the tetrahedron behind each surface triangle
    !> The same body in the fewest parts, for the flow: tetrahedra (4, n), and the surface as closed
    !! net of flat convex polygons. Polygon m has the corners `facet_point(facet(m):facet(m+1)-1)`,
    !! counter-clockwise from outside; each edge belongs to two polygons.
    integer, allocatable :: flow_tet(:, :)
    integer, allocatable :: facet(:), facet_point(:)
    real(wp), allocatable :: sphere_centre(:, :)  !! (3, n) contact spheres [m]
    real(wp), allocatable :: sphere_radius(:)     !! (n) [m]
  end type shape_t

  !> Corners of the face opposite each corner of a tetrahedron of positive volume, outward.
  integer, parameter :: opposite(3, 4) = reshape([2, 3, 4, 1, 4, 3, 1, 2, 4, 1, 3, 2], [3, 4])

contains

  !> Does a name of a case mean this shape, by itself or as one of a family?
  elemental function is_called(shape, name) result(yes)
    type(shape_t), intent(in) :: shape
    character(*), intent(in) :: name
    logical :: yes

    yes = shape%name == name .or. (shape%family == name .and. name /= '')
  end function is_called

  !> Is shape s the least or the largest of its family, or of none? Messages name only these.
  pure function extreme_of_family(shapes, s) result(yes)
    type(shape_t), intent(in) :: shapes(:)
    integer, intent(in) :: s
    logical :: yes

    yes = shapes(s)%family == ''
    if (yes) return
    yes = s == minloc(shapes%volume, 1, shapes%family == shapes(s)%family) &
      .or. s == maxloc(shapes%volume, 1, shapes%family == shapes(s)%family)
  end function extreme_of_family

  !> How far a shape reaches from its centre of mass along a direction [m].
  pure function extent_along(shape, n) result(extent)
    type(shape_t), intent(in) :: shape
    real(wp), intent(in) :: n(3)   !! unit vector, body axes
    real(wp) :: extent
    integer :: i

    if (shape%kind == 'sphere') then
      extent = shape%sphere_radius(1)
      return
    end if
    extent = 0.0_wp
    do i = 1, size(shape%point, 2)
      extent = max(extent, dot_product(n, shape%point(:, i)))
    end do
  end function extent_along

  !> The faces that belong to one tetrahedron only, and that tetrahedron.
  pure subroutine surface_of_tets(n_point, tet, triangle, triangle_tet, overlaps)
    integer, intent(in) :: n_point
    integer, intent(in) :: tet(:, :)                  !! (4, n), positive volume
    integer, allocatable, intent(out) :: triangle(:, :)   !! (3, m) counter-clockwise from outside
    integer, allocatable, intent(out) :: triangle_tet(:)  !! (m)
    integer, intent(out), optional :: overlaps
      !! faces with two tetrahedra on the same side; of three at one face two are
    integer, allocatable :: face(:, :), next(:), head(:)
    logical, allocatable :: single(:)
    integer :: f, g, m, n

    allocate (face(3, 4*size(tet, 2)), next(4*size(tet, 2)), single(4*size(tet, 2)))
    ! Faces are chained by the sum of their corners, the same in whatever order these are: few share
    ! it, even where all tetrahedra share a point.
    allocate (head(n_point), source=0)
    single = .true.
    n = 0
    do f = 1, size(face, 2)
      face(:, f) = tet(opposite(:, mod(f - 1, 4) + 1), (f - 1)/4 + 1)
      m = 1 + modulo(sum(face(:, f)), n_point)
      g = head(m)
      do while (g > 0)
        if (all([any(face(1, f) == face(:, g)), any(face(2, f) == face(:, g)), &
                 any(face(3, f) == face(:, g))])) then
          single([f, g]) = .false.
          if (any([all(face(:, f) == face(:, g)), all(face([2, 3, 1], f) == face(:, g)), &
                   all(face([3, 1, 2], f) == face(:, g))])) n = n + 1
        end if
        g = next(g)
      end do
      next(f) = head(m)
      head(m) = f
    end do
    triangle_tet = pack([(f, f=1, size(single))], single)
    triangle = face(:, triangle_tet)
    triangle_tet = (triangle_tet - 1)/4 + 1
    if (present(overlaps)) overlaps = n
  end subroutine surface_of_tets

end module tet_mesh_m
