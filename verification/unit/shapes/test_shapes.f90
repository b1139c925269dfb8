!> The built-in shapes: closed conforming meshes, symmetry, contact spheres, messages.
module test_shapes_m
  use check_m, only: check, wp, pi
  use errors_m, only: to_text
  use case_text_m, only: shape_of
  use tet_mesh_m, only: shape_t
  use polyhedron_m, only: tet_volume
  use surface_nets_m, only: check_net, check_moments
  implicit none
  private
  public :: test_shapes

  integer :: r

contains

  subroutine test_shapes()
    call check_kind('hexapod', 'size=.02 refinement=1', 24)
    call check_kind('hexapod', 'size=.02 refinement=2', 144)
    call check_kind('hexapod', 'size=.02 refinement=3', -1)
    call check_kind('cube', 'size=.03 refinement=1', 4)
    call check_kind('box', 'size=.01,.03,.05 refinement=2', -1)
    call check_kind('sphere', 'size=.06 refinement=1', 1)
    call check_kind('sphere', 'size=.06 refinement=2', 1)
    do r = 1, 4
      call check_kind('cylinder', 'size=.03,.05 refinement='//to_text(r), -1)
      call check_kind('tetrapod', 'size=.06 refinement='//to_text(r), -1)
      if (r == 4) cycle
      call check_kind('dolos', 'size=.06 refinement='//to_text(r), -1)
      call check_kind('reef_cube', 'size=.05 refinement='//to_text(r), -1)
      call reef_cube_sizes()
    end do
    call hexapod_sizes()
    call hexapod_symmetry()
    call sphere_sizes()
  end subroutine test_shapes

  !> Properties every mesh must have; `n_spheres` < 0 where the number is not stated.
  subroutine check_kind(kind, variables, n_spheres)
    character(*), intent(in) :: kind, variables   !! of &shape
    integer, intent(in) :: n_spheres
    type(shape_t) :: s
    real(wp), allocatable :: volume(:)
    integer :: t, m

    s = shape_of('kind="'//kind//'" '//variables)
    allocate (volume, source=[(tet_volume(s%point(:, s%tet(:, t))), t=1, size(s%tet, 2))])
    call check(kind//': the tetrahedra fill the block', sum(volume), s%volume, &
               epsilon(1.0_wp)*real(size(s%tet, 2), wp)*s%volume)
    call check(kind//': tetrahedra of positive volume', all(volume > 1e-7_wp*s%volume))
    volume = [(tet_volume(s%point(:, s%flow_tet(:, t))), t=1, size(s%flow_tet, 2))]
    call check(kind//': the parts for the flow fill it', sum(volume), s%volume, 1e-14_wp*s%volume)
    call check(kind//': and have positive volume', all(volume > 1e-6_wp*s%volume))

    call check_net(kind//', triangles', s%point, [(1 + 3*m, m=0, size(s%triangle, 2))], &
                   reshape(s%triangle, [size(s%triangle)]), volume=s%volume)
    call check_net(kind//', facets', s%point, s%facet, s%facet_point, volume=s%volume)
    call check_moments(kind, s)
    call check(kind//': each surface triangle is a face of its tetrahedron', all([(all([( &
      any(s%tet(:, s%triangle_tet(m)) == s%triangle(t, m)), t=1, 3)]), m=1, size(s%triangle, 2))]))
    call check(kind//': centroid', weighted_centroid(s), [0.0_wp, 0.0_wp, 0.0_wp], 1e-15_wp)
    call check(kind//': the radius holds all corners', all(norm2(s%point, 1) <= s%radius))
    if (n_spheres >= 0) call check(kind//': contact spheres', size(s%sphere_radius), n_spheres)
    if (kind /= 'sphere') call check_spheres(kind, s)
  end subroutine check_kind

  !> One sphere of equal volume per tetrahedron under the surface, at its centroid.
  subroutine check_spheres(kind, s)
    character(*), intent(in) :: kind
    type(shape_t), intent(in) :: s
    real(wp) :: x(3, 4)
    integer :: m, t

    m = 0
    do t = 1, size(s%tet, 2)
      if (.not. any(s%triangle_tet == t)) cycle
      m = m + 1
      x = s%point(:, s%tet(:, t))
      call check(kind//': sphere at the centroid', s%sphere_centre(:, m), sum(x, 2)/4, 1e-17_wp)
      call check(kind//': of equal volume', 4*pi/3*s%sphere_radius(m)**3/tet_volume(x), 1.0_wp, &
        1e-14_wp)
    end do
    call check(kind//': one for each', m, size(s%sphere_radius))
  end subroutine check_spheres

  pure function weighted_centroid(s) result(x)
    type(shape_t), intent(in) :: s
    real(wp) :: x(3)
    integer :: t

    x = 0.0_wp
    do t = 1, size(s%tet, 2)
      x = x + tet_volume(s%point(:, s%tet(:, t)))*sum(s%point(:, s%tet(:, t)), 2)/(4*s%volume)
    end do
  end function weighted_centroid

  subroutine hexapod_sizes()
    type(shape_t) :: s
    real(wp), parameter :: d = 0.02_wp

    s = shape_of('kind="hexapod" size=.02 refinement=2')
    call check('hexapod: 280 tetrahedra', size(s%tet, 2), 280)
    call check('hexapod: 35 of them for the flow', size(s%flow_tet, 2), 35)
    call check('hexapod: 30 facets', size(s%facet) - 1, 30)
    call check('hexapod: 240 surface triangles', size(s%triangle, 2), 240)
    call check('hexapod: smallest edge', s%smallest_edge, d)
    call check('hexapod: farthest corner', maxval(norm2(s%point, 1)), d*sqrt(2.75_wp), 1e-17_wp)
  end subroutine hexapod_sizes

  !> Turning an even mesh by a quarter about z, or mirroring it, maps spheres on spheres.
  subroutine hexapod_symmetry()
    type(shape_t) :: s
    real(wp) :: x(3)
    integer :: m

    s = shape_of('kind="hexapod" size=.02 refinement=2')
    do m = 1, size(s%sphere_radius)
      x = s%sphere_centre(:, m)
      call check('hexapod: a quarter turn', is_centre(s, [-x(2), x(1), x(3)]))
      call check('hexapod: a mirror', is_centre(s, [-x(1), x(2), x(3)]))
    end do
  end subroutine hexapod_symmetry

  pure logical function is_centre(s, y)
    type(shape_t), intent(in) :: s
    real(wp), intent(in) :: y(3)

    is_centre = any(abs(s%sphere_centre(1, :) - y(1)) + abs(s%sphere_centre(2, :) - y(2)) + &
                    abs(s%sphere_centre(3, :) - y(3)) < 1e-15_wp)
  end function is_centre

  !> True volume, one sphere of the true radius, corners outside by a second-order distance.
  subroutine sphere_sizes()
    type(shape_t) :: s
    real(wp) :: outside(2)
    integer :: r
    real(wp), parameter :: a = 0.03_wp

    do r = 1, 2
      s = shape_of('kind="sphere" size=.06 refinement='//to_text(r))
      call check('sphere: true volume', s%volume, 4*pi/3*a**3, 1e-13_wp*a**3)
      call check('sphere: 20 (2 r)^2 triangles', size(s%triangle, 2), 20*(2*r)**2)
      call check('sphere: contact points with its true radius', s%sphere_radius(1), a)
      outside(r) = maxval(norm2(s%point, 1))/a - 1
    end do
    call check('sphere: corners stand out, in per cent', outside, [4.61e-2_wp, 1.15e-2_wp], 1e-4_wp)
    call check('sphere: second order in the refinement', outside(1)/outside(2), 4.0_wp, 0.1_wp)
  end subroutine sphere_sizes

  !> Eight rectangles around each window, and its four sides.
  subroutine reef_cube_sizes()
    type(shape_t) :: s

    s = shape_of('kind="reef_cube" size=.05 refinement='//to_text(r))
    call check('reef cube: facets', size(s%facet) - 1, 72)
    call check('edges', maxval(s%point, 2) - minval(s%point, 2), spread(0.05_wp, 1, 3), 1e-15_wp)
  end subroutine reef_cube_sizes

end module test_shapes_m
