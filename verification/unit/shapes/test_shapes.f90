!> The built-in shapes: closed conforming meshes, symmetry, contact spheres, messages.
module test_shapes_m
  use kinds_m, only: wp, pi
  use check_m, only: check
  use case_types_m, only: shape_input_t
  use tet_mesh_m, only: shape_t
  use polyhedron_m, only: tet_volume
  use shapes_builtin_m, only: make_shape
  implicit none
  private
  public :: test_shapes

  integer :: r

contains

  subroutine test_shapes()
    call check_kind('hexapod', [0.02_wp, 0.0_wp, 0.0_wp], 1, 24)
    call check_kind('hexapod', [0.02_wp, 0.0_wp, 0.0_wp], 2, 144)
    call check_kind('hexapod', [0.02_wp, 0.0_wp, 0.0_wp], 3, -1)
    call check_kind('cube', [0.03_wp, 0.0_wp, 0.0_wp], 1, 4)
    call check_kind('box', [0.01_wp, 0.03_wp, 0.05_wp], 2, -1)
    call check_kind('sphere', [0.06_wp, 0.0_wp, 0.0_wp], 1, 1)
    call check_kind('sphere', [0.06_wp, 0.0_wp, 0.0_wp], 2, 1)
    do r = 1, 4
      call check_kind('cylinder', [0.03_wp, 0.05_wp, 0.0_wp], r, -1)
      call check_kind('tetrapod', [0.06_wp, 0.0_wp, 0.0_wp], r, -1)
      if (r == 4) cycle
      call check_kind('dolos', [0.06_wp, 0.0_wp, 0.0_wp], r, -1)
      call check_kind('reef_cube', [0.05_wp, 0.0_wp, 0.0_wp], r, -1)
    end do
    call hexapod_sizes()
    call hexapod_symmetry()
    call sphere_sizes()
    call armour_sizes()
    call refusals()
  end subroutine test_shapes

  subroutine build(kind, size, refinement, shape)
    character(*), intent(in) :: kind
    real(wp), intent(in) :: size(3)
    integer, intent(in) :: refinement
    type(shape_t), intent(out) :: shape
    type(shape_input_t) :: input
    character(:), allocatable :: message

    input%name = kind
    input%kind = kind
    input%size = size
    input%refinement = refinement
    call make_shape(input, shape, message)
    call check(kind//' is built', message == '')
  end subroutine build

  !> Properties every mesh must have; `n_spheres` < 0 where the number is not stated.
  subroutine check_kind(kind, size_m, refinement, n_spheres)
    character(*), intent(in) :: kind
    real(wp), intent(in) :: size_m(3)
    integer, intent(in) :: refinement, n_spheres
    type(shape_t) :: s
    real(wp) :: area(3), total, smallest, flow_total, x(3, 4)
    integer :: t, m, k

    call build(kind, size_m, refinement, s)
    smallest = huge(1.0_wp)
    total = 0.0_wp
    flow_total = 0.0_wp
    do t = 1, size(s%tet, 2)
      smallest = min(smallest, tet_volume(s%point(:, s%tet(:, t))))
      total = total + tet_volume(s%point(:, s%tet(:, t)))
    end do
    call check(kind//': the tetrahedra fill the block', total, s%volume, &
               epsilon(1.0_wp)*real(size(s%tet, 2), wp)*s%volume)
    call check(kind//': tetrahedra of positive volume', smallest > 1e-7_wp*s%volume)
    smallest = huge(1.0_wp)
    do t = 1, size(s%flow_tet, 2)
      smallest = min(smallest, tet_volume(s%point(:, s%flow_tet(:, t))))
      flow_total = flow_total + tet_volume(s%point(:, s%flow_tet(:, t)))
    end do
    call check(kind//': the parts for the flow fill the block', flow_total, s%volume, &
               1e-14_wp*s%volume)
    call check(kind//': and have positive volume', smallest > 1e-6_wp*s%volume)

    area = 0.0_wp
    total = 0.0_wp
    do t = 1, size(s%triangle, 2)
      x(:, 1) = 0.0_wp
      x(:, 2:4) = s%point(:, s%triangle(:, t))
      total = total + tet_volume(x)
      area = area + area_vector(x(:, 2:4))
    end do
    call check(kind//': the surface is closed', area, [0.0_wp, 0.0_wp, 0.0_wp], 1e-17_wp)
    call check(kind//': the surface encloses the volume', total, s%volume, &
               epsilon(1.0_wp)*real(size(s%triangle, 2) + 100, wp)*s%volume)
    call check(kind//': each surface triangle is a face of its tetrahedron', faces_match(s))

    area = 0.0_wp
    total = 0.0_wp
    do m = 1, size(s%facet) - 1
      do k = s%facet(m) + 1, s%facet(m + 1) - 2
        x(:, 1) = 0.0_wp
        x(:, 2:4) = s%point(:, s%facet_point([s%facet(m), k, k + 1]))
        total = total + tet_volume(x)
        area = area + area_vector(x(:, 2:4))
      end do
    end do
    call check(kind//': the facets are closed', area, [0.0_wp, 0.0_wp, 0.0_wp], 1e-17_wp)
    call check(kind//': the facets enclose the volume', total, s%volume, 1e-13_wp*s%volume)
    call check(kind//': each edge of the facets joins two of them', &
               edges_paired(s, s%facet, s%facet_point))
    call check(kind//': facets are flat and bend at every corner', all([(flat_and_convex( &
      s%point(:, s%facet_point(s%facet(m):s%facet(m + 1) - 1))), m=1, size(s%facet) - 1)]))
    call check(kind//': the surface has two triangles at every edge', edges_paired(s, &
      [(1 + 3*m, m=0, size(s%triangle, 2))], reshape(s%triangle, [size(s%triangle)])))
    call check(kind//': the centroid is the origin', weighted_centroid(s), &
               [0.0_wp, 0.0_wp, 0.0_wp], 1e-15_wp)
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
    logical :: good

    good = .true.
    m = 0
    do t = 1, size(s%tet, 2)
      if (.not. any(s%triangle_tet == t)) cycle
      m = m + 1
      x = s%point(:, s%tet(:, t))
      good = good .and. all(abs(s%sphere_centre(:, m) - sum(x, 2)/4) < 1e-17_wp)
      good = good .and. abs(4*pi/3*s%sphere_radius(m)**3/tet_volume(x) - 1) < 1e-14_wp
    end do
    call check(kind//': spheres of equal volume at the centroids', &
               good .and. m == size(s%sphere_radius))
  end subroutine check_spheres

  pure function area_vector(x) result(a)
    real(wp), intent(in) :: x(3, 3)
    real(wp) :: a(3), u(3), v(3)

    u = x(:, 2) - x(:, 1)
    v = x(:, 3) - x(:, 1)
    a = 0.5_wp*[u(2)*v(3) - u(3)*v(2), u(3)*v(1) - u(1)*v(3), u(1)*v(2) - u(2)*v(1)]
  end function area_vector

  pure function weighted_centroid(s) result(x)
    type(shape_t), intent(in) :: s
    real(wp) :: x(3)
    integer :: t

    x = 0.0_wp
    do t = 1, size(s%tet, 2)
      x = x + tet_volume(s%point(:, s%tet(:, t)))*sum(s%point(:, s%tet(:, t)), 2)/(4*s%volume)
    end do
  end function weighted_centroid

  pure function faces_match(s) result(good)
    type(shape_t), intent(in) :: s
    logical :: good
    integer :: m, v

    good = .true.
    do m = 1, size(s%triangle, 2)
      do v = 1, 3
        good = good .and. any(s%tet(:, s%triangle_tet(m)) == s%triangle(v, m))
      end do
    end do
  end function faces_match

  !> Is a polygon flat, and is each of its corners a true one, turned the same way?
  pure function flat_and_convex(x) result(good)
    real(wp), intent(in) :: x(:, :)
    logical :: good
    real(wp) :: normal(3), u(3), v(3)
    integer :: k, m

    m = size(x, 2)
    normal = 0.0_wp
    do k = 2, m - 1
      normal = normal + area_vector(x(:, [1, k, k + 1]))
    end do
    normal = normal/norm2(normal)
    good = m >= 3
    do k = 1, m
      good = good .and. abs(dot_product(x(:, k) - x(:, 1), normal)) < 1e-14_wp
      u = x(:, 1 + mod(k, m)) - x(:, k)
      v = x(:, 1 + mod(k + 1, m)) - x(:, 1 + mod(k, m))
      good = good .and. dot_product(area_vector(reshape([0*u, u, u + v], [3, 3])), normal) &
        > 1e-4_wp*norm2(u)*norm2(v)
    end do
  end function flat_and_convex

  !> Every directed edge of the polygons is met exactly once the other way round.
  pure function edges_paired(s, facet, facet_point) result(good)
    type(shape_t), intent(in) :: s
    integer, intent(in) :: facet(:), facet_point(:)
    logical :: good
    integer, allocatable :: net(:, :)
    integer :: m, k, a, b, n

    n = size(s%point, 2)
    allocate (net(n, n), source=0)
    good = .true.
    do m = 1, size(facet) - 1
      do k = facet(m), facet(m + 1) - 1
        a = facet_point(k)
        b = facet_point(merge(facet(m), k + 1, k == facet(m + 1) - 1))
        net(a, b) = net(a, b) + 1
        good = good .and. net(a, b) == 1
      end do
    end do
    good = good .and. all(net == transpose(net))
  end function edges_paired

  subroutine hexapod_sizes()
    type(shape_t) :: s
    real(wp), parameter :: d = 0.02_wp

    call build('hexapod', [d, 0.0_wp, 0.0_wp], 2, s)
    call check('hexapod: volume 7 d^3', s%volume, 7*d**3, 1e-13_wp*7*d**3)
    call check('hexapod: 280 tetrahedra', size(s%tet, 2), 280)
    call check('hexapod: 35 of them for the flow', size(s%flow_tet, 2), 35)
    call check('hexapod: 30 facets', size(s%facet) - 1, 30)
    call check('hexapod: 240 surface triangles', size(s%triangle, 2), 240)
    call check('hexapod: smallest edge', s%smallest_edge, d, 0.0_wp)
    call check('hexapod: farthest corner', maxval(norm2(s%point, 1)), d*sqrt(2.75_wp), 1e-17_wp)
  end subroutine hexapod_sizes

  !> Turning an even mesh by a quarter about z, or mirroring it, maps spheres on spheres.
  subroutine hexapod_symmetry()
    type(shape_t) :: s
    real(wp) :: x(3)
    integer :: m
    logical :: turned, mirrored

    call build('hexapod', [0.02_wp, 0.0_wp, 0.0_wp], 2, s)
    turned = .true.
    mirrored = .true.
    do m = 1, size(s%sphere_radius)
      x = s%sphere_centre(:, m)
      turned = turned .and. is_centre(s, [-x(2), x(1), x(3)])
      mirrored = mirrored .and. is_centre(s, [-x(1), x(2), x(3)])
    end do
    call check('hexapod: spheres keep their places in a quarter turn', turned)
    call check('hexapod: spheres keep their places in a mirror', mirrored)
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
      call build('sphere', [2*a, 0.0_wp, 0.0_wp], r, s)
      call check('sphere: true volume', s%volume, 4*pi/3*a**3, 1e-13_wp*a**3)
      call check('sphere: 20 (2 r)^2 triangles', size(s%triangle, 2), 20*(2*r)**2)
      call check('sphere: contact points with its true radius', s%sphere_radius(1), a, 0.0_wp)
      outside(r) = maxval(norm2(s%point, 1))/a - 1
    end do
    call check('sphere: corners stand out by 4.6 and 1.2 per cent', outside, &
               [4.61e-2_wp, 1.15e-2_wp], 1e-4_wp)
    call check('sphere: second order in the refinement', outside(1)/outside(2), 4.0_wp, 0.1_wp)
  end subroutine sphere_sizes

  !> Overall sizes, and facets as few as the forms have.
  subroutine armour_sizes()
    type(shape_t) :: s
    real(wp) :: extent(3)
    integer :: r

    do r = 1, 3
      call build('tetrapod', [0.06_wp, 0.0_wp, 0.0_wp], r, s)
      extent = maxval(s%point, 2) - minval(s%point, 2)
      call check('tetrapod: overall height', extent(3), 0.06_wp, 1e-15_wp)
      call check('tetrapod: stands on three corners', &
        count(abs(s%point(3, :) - minval(s%point(3, :))) < 1e-12_wp), 3)
      call build('dolos', [0.06_wp, 0.0_wp, 0.0_wp], r, s)
      call check('dolos: as long as high and wide', maxval(s%point, 2) - minval(s%point, 2), &
                 [0.06_wp, 0.06_wp, 0.06_wp], 1e-15_wp)
      call build('cylinder', [0.03_wp, 0.05_wp, 0.0_wp], r, s)
      extent = maxval(s%point, 2) - minval(s%point, 2)
      call check('cylinder: height', extent(3), 0.05_wp, 1e-15_wp)
      call check('cylinder: two ends and 6 r sides', size(s%facet) - 1, 2 + 6*r)
      call build('reef_cube', [0.05_wp, 0.0_wp, 0.0_wp], r, s)
      call check('reef cube: eight rectangles around each window, and its four sides', &
                 size(s%facet) - 1, 72)
      call check('reef cube: edges', maxval(s%point, 2) - minval(s%point, 2), &
                 [0.05_wp, 0.05_wp, 0.05_wp], 1e-15_wp)
    end do
  end subroutine armour_sizes

  subroutine refusals()
    type(shape_input_t) :: input
    type(shape_t) :: s
    character(:), allocatable :: message

    input%size = 0.02_wp
    input%kind = 'cubo'
    call make_shape(input, s, message)
    call check('unknown kind is refused', index(message, 'unknown') > 0)
    input%kind = 'cube'
    input%size(1) = -1.0_wp
    call make_shape(input, s, message)
    call check('negative size is refused', index(message, 'size') > 0)
  end subroutine refusals

end module test_shapes_m
