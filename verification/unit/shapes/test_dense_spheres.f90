!> Dense contact spheres: each is the largest that touches its face where it does and stays inside,
!! up to two spacings, in wedges and between parallel faces where that is known.
module test_dense_spheres_m
  use check_m, only: check, wp
  use vectors_m, only: cross
  use tet_mesh_m, only: shape_t
  use dense_spheres_m, only: place_densely
  implicit none
  private
  public :: test_dense_spheres

  real(wp), parameter :: spacing = 0.05_wp          !! [m]

contains

  subroutine test_dense_spheres()
    call check_solid('tetrahedron', tetrahedron(), sqrt(0.5_wp))   ! cos of the dihedral angle: 1/3
    call check_solid('slab', slab(0.12_wp), 1.0_wp)
    call check_small_cube()
  end subroutine test_dense_spheres

  !> A regular tetrahedron with edges of sqrt(2) m.
  pure function tetrahedron() result(s)
    type(shape_t) :: s

    allocate (s%point, source=reshape([0, 0, 0, 1, 1, 0, 1, 0, 1, 0, 1, 1]*1.0_wp, [3, 4]))
    allocate (s%facet, source=[1, 4, 7, 10, 13])
    allocate (s%facet_point, source=[2, 4, 3, 1, 3, 4, 1, 4, 2, 1, 2, 3])
  end function tetrahedron

  !> A slab of 1 m by 1 m on z = 0.
  pure function slab(thickness) result(s)
    real(wp), intent(in) :: thickness   !! [m]
    type(shape_t) :: s

    allocate (s%point, source=reshape([0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 1, 0, 1, &
      0, 1, 1, 1, 1, 1]*1.0_wp, [3, 8]))
    s%point(3, :) = thickness*s%point(3, :)
    allocate (s%facet, source=[1, 5, 9, 13, 17, 21, 25])
    allocate (s%facet_point, source=[1, 3, 4, 2, 5, 6, 8, 7, 1, 2, 6, 5, 3, 7, 8, 4, &
      1, 5, 7, 3, 2, 4, 8, 6])
  end function slab

  !> A ball that touches a face at s from an edge, at which the next face stands at the angle theta,
  !! reaches that face with the radius s tan(theta/2), and one parallel to it with half the
  !! distance.
  subroutine check_solid(name, solid, tan_half)
    character(*), intent(in) :: name
    type(shape_t), intent(in) :: solid
    real(wp), intent(in) :: tan_half   !! of the dihedral angle [-]
    type(shape_t) :: s
    real(wp), allocatable :: normal(:, :), depth(:)
    real(wp) :: radius, p(3), sine, least
    integer :: b, f, k, n

    s = solid
    call place_densely(spacing, s)
    n = size(s%facet) - 1
    allocate (normal(3, n), depth(n))
    do f = 1, n
      associate (x => s%point(:, s%facet_point(s%facet(f):s%facet(f) + 2)))
        normal(:, f) = cross(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1))
        normal(:, f) = normal(:, f)/norm2(normal(:, f))
      end associate
    end do
    least = 1.0_wp
    sine = 2*tan_half/(1 + tan_half**2)
    do b = 1, size(s%sphere_radius)
      depth = depth_below(s, normal, s%sphere_centre(:, b))
      call check(name//': inside, and touches', minval(depth), s%sphere_radius(b), 1.0e-9_wp)
      f = minloc(depth, 1)
      p = s%sphere_centre(:, b) + s%sphere_radius(b)*normal(:, f)
      depth = depth_below(s, normal, p)
      radius = 2*spacing
      do k = 1, n
        if (k == f) cycle
        if (dot_product(normal(:, k), normal(:, f)) < -0.9_wp) then
          radius = min(radius, 0.5_wp*depth(k))
        else
          radius = min(radius, depth(k)/sine*tan_half)
        end if
      end do
      call check(name//': no larger one does', s%sphere_radius(b), radius, 1.0e-8_wp)
      least = min(least, s%sphere_radius(b))
    end do
    call check(name//': the first ring', least, 0.25_wp*spacing*tan_half, 1.0e-9_wp)
    call check(name//': many', size(s%sphere_radius) > 500)
  end subroutine check_solid

  !> Depth of a point below all faces [m].
  pure function depth_below(s, normal, x) result(depth)
    type(shape_t), intent(in) :: s
    real(wp), intent(in) :: normal(:, :), x(3)
    real(wp) :: depth(size(normal, 2))
    integer :: f

    do f = 1, size(depth)
      depth(f) = dot_product(normal(:, f), s%point(:, s%facet_point(s%facet(f))) - x)
    end do
  end function depth_below

  !> Faces too small for a ring have one ball in their middle: a cube its inscribed sphere, once, or
  !! none where its radius is below a tenth of the spacing.
  subroutine check_small_cube()
    real(wp), parameter :: edge(2) = spacing*[0.4_wp, 0.199_wp]
    type(shape_t) :: s
    integer :: i

    do i = 1, 2
      s = slab(1.0_wp)
      s%point = edge(i)*s%point
      call place_densely(spacing, s)
      call check('spheres of a small cube', size(s%sphere_radius), 2 - i)
      if (i == 2) cycle
      call check('it is the inscribed one', [s%sphere_centre(:, 1), s%sphere_radius(1)], &
        spread(0.5_wp*edge(1), 1, 4), 1.0e-15_wp)
    end do
  end subroutine check_small_cube

end module test_dense_spheres_m
