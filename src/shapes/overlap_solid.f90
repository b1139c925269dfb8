!> The shapes of blocks made ready to measure how deep they reach into one another: points on their
!! surface, tetrahedra and triangles in bins.
module overlap_solid_m
  use kinds_m, only: wp, i8
  use vectors_m, only: norms, cross, norm, inverse3
  use tet_mesh_m, only: shape_t, surface_of_tets
  use surface_features_m, only: surface_init, pair_edges
  use surface_search_m, only: surface_t
  use neighbours_m, only: bins_t, bins_build
  implicit none
  private
  public :: solid_t, prepare, inside, expected_samples

  real(wp), parameter :: per_edge_sharp = 16.0_wp   !! points on a sharp edge per smallest edge
  real(wp), parameter :: per_edge_flat = 4.0_wp     !! on the rest of the surface, each way

  !> What is worked out once per shape; body axes.
  type :: solid_t
    real(wp) :: ball = 0.0_wp                    !! radius, if the shape is a sphere [m]
    real(wp) :: radius = 0.0_wp                  !! of the bounding sphere [m]
    real(wp), allocatable :: corner(:, :)        !! (3, n) corners of the surface [m]
    real(wp), allocatable :: sample(:, :)        !! (3, n) surface points, cluster by cluster [m]
    integer, allocatable :: cluster(:)           !! (clusters + 1) first sample of each
    real(wp), allocatable :: middle(:, :)   !! (3, clusters) bounding spheres of the clusters [m]
    real(wp), allocatable :: bounding_radius(:)   !! (clusters) [m]
    !> (3, 3, tets) turns x - tet_origin into the weights of corners 2 to 4 [1/m].
    real(wp), allocatable :: to_tet(:, :, :)
    real(wp), allocatable :: tet_origin(:, :)    !! (3, tets) corner 1 [m]
    real(wp), allocatable :: face(:, :, :)       !! (3, 3, triangles) corners of the surface [m]
    type(bins_t) :: tets                         !! in bins
    type(surface_t) :: surface                   !! for the depth of a point below it
    real(wp) :: spacing = 0.0_wp                 !! of points along sharp edges [m]
  end type solid_t

contains

  !> Work out the sample points, the tetrahedra and the surface of one shape.
  subroutine prepare(shape, solid)
    type(shape_t), intent(in) :: shape
    type(solid_t), intent(out) :: solid
    real(wp), parameter :: bins_per_edge = 8.0_wp   !! of the smallest edge
    real(wp), allocatable :: low(:, :), high(:, :)
    integer, allocatable :: triangle(:, :), triangle_tet(:)
    real(wp) :: edges(3, 3)
    integer :: n, t, c

    if (shape%kind == 'sphere') solid%ball = shape%sphere_radius(1)
    solid%radius = max(shape%radius, solid%ball)
    solid%spacing = shape%smallest_edge/per_edge_sharp
    n = size(shape%flow_tet, 2)
    allocate (solid%to_tet(3, 3, n), solid%tet_origin(3, n), low(3, n), high(3, n))
    do t = 1, n
      solid%tet_origin(:, t) = shape%point(:, shape%flow_tet(1, t))
      do c = 1, 3
        edges(:, c) = shape%point(:, shape%flow_tet(c + 1, t)) - solid%tet_origin(:, t)
      end do
      solid%to_tet(:, :, t) = inverse3(edges)
      low(:, t) = minval(shape%point(:, shape%flow_tet(:, t)), 2)
      high(:, t) = maxval(shape%point(:, shape%flow_tet(:, t)), 2)
    end do
    call bins_build(low, high, shape%smallest_edge/bins_per_edge, solid%tets)
    call surface_of_tets(size(shape%point, 2), shape%flow_tet, triangle, triangle_tet)
    allocate (solid%face(3, 3, size(triangle, 2)))
    do t = 1, size(triangle, 2)
      solid%face(:, :, t) = shape%point(:, triangle(:, t))
    end do
    call surface_init(shape, solid%surface, with_net=.false.)
    call place_samples(shape, triangle, solid)
    call cluster_samples(0.5_wp*shape%smallest_edge, solid)
  end subroutine prepare

  !> About how many points on its surface a shape takes, no fewer than it does: they grow with the
  !! square of length over thickness, and so do memory and time.
  pure function expected_samples(shape) result(n)
    type(shape_t), intent(in) :: shape
    real(wp) :: n
    integer, allocatable :: triangle(:, :), triangle_tet(:)
    real(wp) :: longest   ! edge of a triangle [smallest edge]
    integer :: t

    call surface_of_tets(size(shape%point, 2), shape%flow_tet, triangle, triangle_tet)
    n = 0.0_wp
    do t = 1, size(triangle, 2)
      longest = longest_edge(shape%point(:, triangle(:, t)))/shape%smallest_edge
      n = n + 0.5_wp*(per_edge_flat*longest)**2 + 1.5_wp*per_edge_sharp*longest + 2.0_wp
    end do
  end function expected_samples

  !> Points on the surface: its corners, along its edges, and inside its triangles; and the centre
  !! of mass, since of two equal blocks in one place no surface point lies below the other's
  !! surface.
  !!
  !! Sharp edges carry sixteen points per smallest edge, because two crossing edges touch at one
  !! point only; the rest of the surface carries four.
  subroutine place_samples(shape, triangle, solid)
    type(shape_t), intent(in) :: shape
    integer, intent(in) :: triangle(:, :)        !! (3, n) surface of the shape
    type(solid_t), intent(inout) :: solid
    real(wp), parameter :: flat = 1.0e-6_wp      !! 1 - cosine between coplanar triangles
    real(wp), parameter :: centre(3) = 0.0_wp    !! body axes
    integer, allocatable :: edge(:, :)
    real(wp), allocatable :: normal(:, :)
    logical, allocatable :: on_surface(:)
    real(wp) :: p(3, 3), spacing
    integer :: t, e, i, j, m, pass
    integer(i8) :: total

    allocate (normal(3, size(triangle, 2)))
    allocate (on_surface(size(shape%point, 2)), source=.false.)
    do t = 1, size(triangle, 2)
      p = solid%face(:, :, t)
      normal(:, t) = cross(p(:, 2) - p(:, 1), p(:, 3) - p(:, 1))
      normal(:, t) = normal(:, t)/norm(normal(:, t))
      on_surface(triangle(:, t)) = .true.
    end do
    solid%corner = shape%point(:, pack([(i, i=1, size(on_surface))], on_surface))
    call pair_edges(size(shape%point, 2), [(3*t + 1, t=0, size(triangle, 2))], triangle, edge)
    do pass = 1, 2   ! count, then fill
      total = size(solid%corner, 2)
      if (pass == 2) solid%sample(:, :total) = solid%corner
      if (inside(solid, centre)) then
        total = total + 1
        if (pass == 2) solid%sample(:, total) = centre
      end if
      do e = 1, size(edge, 2)
        p(:, 1) = shape%point(:, minval(edge(1:2, e)))
        p(:, 2) = shape%point(:, maxval(edge(1:2, e)))
        spacing = solid%spacing
        if (edge(4, e) > 0) then
          if (dot_product(normal(:, edge(3, e)), normal(:, edge(4, e))) > 1.0_wp - flat) then
            spacing = shape%smallest_edge/per_edge_flat
          end if
        end if
        m = ceiling(norm(p(:, 2) - p(:, 1))/spacing*(1.0_wp - flat))
        do i = 1, m - 1
          total = total + 1
          if (pass == 2) solid%sample(:, total) = p(:, 1) &
            + (real(i, wp)/real(m, wp))*(p(:, 2) - p(:, 1))
        end do
      end do
      do t = 1, size(triangle, 2)
        p = solid%face(:, :, t)
        m = ceiling(longest_edge(p)*per_edge_flat/shape%smallest_edge*(1.0_wp - flat))
        do j = 1, m - 2
          do i = 1, m - 1 - j
            total = total + 1
            if (pass == 2) solid%sample(:, total) = p(:, 1) &
              + (real(i, wp)/real(m, wp))*(p(:, 2) - p(:, 1)) &
              + (real(j, wp)/real(m, wp))*(p(:, 3) - p(:, 1))
          end do
        end do
      end do
      if (pass == 1) allocate (solid%sample(3, total))
    end do
  end subroutine place_samples

  !> Length of the longest edge of a triangle [m].
  pure function longest_edge(p) result(length)
    real(wp), intent(in) :: p(3, 3)
    real(wp) :: length

    length = max(norm(p(:, 2) - p(:, 1)), norm(p(:, 3) - p(:, 2)), norm(p(:, 1) - p(:, 3)))
  end function longest_edge

  !> Reorder the sample points into clusters with small bounding spheres.
  subroutine cluster_samples(spacing, solid)
    real(wp), intent(in) :: spacing   !! wanted size of a cluster [m]
    type(solid_t), intent(inout) :: solid
    type(bins_t) :: bins
    integer :: c, n, i, last

    call bins_build(solid%sample, solid%sample, spacing, bins)
    solid%sample = solid%sample(:, bins%item)
    n = count(bins%first(2:) > bins%first(:size(bins%first) - 1))
    allocate (solid%cluster(n + 1), solid%middle(3, n), solid%bounding_radius(n))
    n = 0
    do c = 1, size(bins%first) - 1
      i = bins%first(c)
      last = bins%first(c + 1) - 1
      if (last < i) cycle
      n = n + 1
      solid%cluster(n) = i
      solid%middle(:, n) = 0.5_wp*(minval(solid%sample(:, i:last), 2) &
        + maxval(solid%sample(:, i:last), 2))
      solid%bounding_radius(n) = maxval(norms(solid%sample(:, i:last) &
        - spread(solid%middle(:, n), 2, last - i + 1)))
    end do
    solid%cluster(n + 1) = size(solid%sample, 2) + 1
  end subroutine cluster_samples

  !> Whether a point lies in one of the tetrahedra.
  pure function inside(solid, p) result(yes)
    type(solid_t), intent(in) :: solid
    real(wp), intent(in) :: p(3)                        !! body axes [m]
    logical :: yes
    real(wp), parameter :: round_off = 1.0e-12_wp   !! so that no point slips between two tetrahedra
    real(wp) :: d(3), w(3)
    integer :: c, i, t

    yes = .true.
    c = solid%tets%number(solid%tets%place(p))
    do i = solid%tets%first(c), solid%tets%first(c + 1) - 1
      t = solid%tets%item(i)
      d = p - solid%tet_origin(:, t)
      w = solid%to_tet(:, 1, t)*d(1) + solid%to_tet(:, 2, t)*d(2) + solid%to_tet(:, 3, t)*d(3)
      if (minval(w) >= -round_off .and. sum(w) <= 1.0_wp + round_off) return
    end do
    yes = .false.
  end function inside

end module overlap_solid_m
