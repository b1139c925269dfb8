!> The bed as one more fixed solid for the flow: the part of it that lies in the grid, as a shape.
!!
!! Under each facet, cut to the grid as seen from above, stands a prism down to below the floor of
!! the tank; it counts as solid where the facet looks up, and is taken away again where it looks
!! down. The sum is exact for slopes, trenches, overhangs and closed stones alike. The surface of
!! the sum are the facets, the floors of the prisms, and walls at the sides of the grid. Between
!! periodic sides the bed reaches beyond the cells that are kept there, so it has no images.
module bed_solid_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use grid_m, only: grid_t, n_halo
  use polygon_m, only: clip_polygon
  use bed_m, only: bed_t, facet_within, max_clip_corners, round_off
  use polyhedron_m, only: tet_volume
  use tet_mesh_m, only: shape_t
  implicit none
  private
  public :: make_bed_solid

  real(wp), parameter :: min_tet = 1.0e-15_wp   !! smaller parts are dropped [cells]

  !> Polygons of the surface, one after the other, and tetrahedra, four corners each; those of
  !! facets that look down have negative volumes.
  type :: parts_t
    integer :: n_facet = 0, n_corner = 0, n_tet_corner = 0
    integer, allocatable :: first(:)                           !! (n_facet) first corner
    real(wp), allocatable :: corner(:, :), tet_corner(:, :)    !! (3, *) [m]
  end type parts_t

contains

  !> The bed in the grid, coordinates relative to `centre`.
  subroutine make_bed_solid(grid, bed, centre, solid)
    type(grid_t), intent(in) :: grid
    type(bed_t), intent(in) :: bed
    real(wp), intent(out) :: centre(3)   !! a corner of cells [m]
    type(shape_t), intent(out) :: solid
    type(parts_t) :: parts
    real(wp), dimension(3, max_clip_corners) :: p, floor
    real(wp) :: low(3), high(3)
    integer :: d, f, n, beyond(3)

    beyond = merge(n_halo + 1, 0, grid%periodic)
    do d = 1, 3
      centre(d) = grid%face(1 + grid%n(d)/2, d)
      low(d) = grid%face(1 - beyond(d), d)
      high(d) = grid%face(grid%n(d) + 1 + beyond(d), d)
    end do
    low(3) = grid%face(0, 3)
    do f = 1, size(bed%triangle, 2)
      call facet_within(bed, f, low, high, n, p)
      call clip_polygon(3, low(3), 1.0_wp, n, p)
      if (n < 3) cycle
      do d = 1, 2   ! a bed that ends at a side but for rounding ends there
        where (p(d, :n) < low(d) + round_off*grid%length(d)) p(d, :n) = low(d)
        where (p(d, :n) > high(d) - round_off*grid%length(d)) p(d, :n) = high(d)
      end do
      ! in a side walls are put anyway
      if (any(all(p(:2, :n) <= spread(low(:2), 2, n), 2)) &
          .or. any(all(p(:2, :n) >= spread(high(:2), 2, n), 2))) cycle
      call add_facet(p(:, :n), parts)
      ! the floor of the prism under it; that under a vertical one has no area and no effect
      floor(1:2, :n) = p(1:2, n:1:-1)
      floor(3, :n) = low(3)
      call add_facet(floor(:, :n), parts)
      call add_walls(p(:, :n), low, high, parts)
      call add_prism(p(:, :n), low(3), min_tet*grid%volume, parts)
    end do
    n = parts%n_corner
    allocate (solid%point(3, n + parts%n_tet_corner))
    if (n > 0) solid%point(:, :n) = parts%corner(:, :n)
    if (parts%n_tet_corner > 0) solid%point(:, n + 1:) = parts%tet_corner(:, :parts%n_tet_corner)
    solid%point = solid%point - spread(centre, 2, size(solid%point, 2))
    allocate (solid%facet(parts%n_facet + 1), source=n + 1)
    if (n > 0) solid%facet(:parts%n_facet) = parts%first(:parts%n_facet)
    solid%facet_point = [(f, f=1, n)]
    solid%flow_tet = reshape([(n + f, f=1, parts%n_tet_corner)], [4, parts%n_tet_corner/4])
  end subroutine make_bed_solid

  !> Append a polygon of the surface.
  subroutine add_facet(p, parts)
    real(wp), intent(in) :: p(:, :)   !! (3, n) counter-clockwise from outside [m]
    type(parts_t), intent(inout) :: parts
    integer :: v

    parts%n_facet = parts%n_facet + 1
    call ensure_capacity(parts%n_facet, parts%first)
    parts%first(parts%n_facet) = parts%n_corner + 1
    do v = 1, size(p, 2)
      parts%n_corner = parts%n_corner + 1
      call ensure_capacity(parts%n_corner, parts%corner)
      parts%corner(:, parts%n_corner) = p(:, v)
    end do
  end subroutine add_facet

  !> Walls of the prism under a polygon where it reaches a side of the grid; the others are hidden
  !! by the prisms next to it.
  subroutine add_walls(p, low, high, parts)
    real(wp), intent(in) :: p(:, :), low(3), high(3)   !! [m]
    type(parts_t), intent(inout) :: parts
    real(wp) :: q(3, 4)
    integer :: v, w, d

    do v = 1, size(p, 2)
      w = 1 + mod(v, size(p, 2))
      do d = 1, 2
        if (.not. (max(p(d, v), p(d, w)) <= low(d) .or. min(p(d, v), p(d, w)) >= high(d))) cycle
        q(:, 1) = p(:, w)
        q(:, 2) = p(:, v)
        q(:, 3:4) = q(:, [2, 1])
        q(3, 3:4) = low(3)
        if (abs(q(3 - d, 1) - q(3 - d, 2)) > 0.0_wp) call add_facet(q, parts)
      end do
    end do
  end subroutine add_walls

  !> The prism under a polygon as tetrahedra, three under each of its triangles.
  subroutine add_prism(p, bottom, least, parts)
    real(wp), intent(in) :: p(:, :), bottom   !! [m]
    real(wp), intent(in) :: least             !! volume of those that count [m3]
    type(parts_t), intent(inout) :: parts
    real(wp) :: top(3, 3), floor(3, 3)
    integer :: v

    do v = 3, size(p, 2)
      top = p(:, [1, v - 1, v])
      floor = top
      floor(3, :) = bottom
      call add_tet(reshape([floor, top(:, 1)], [3, 4]))
      call add_tet(reshape([top(:, 1), floor(:, 2), floor(:, 3), top(:, 3)], [3, 4]))
      call add_tet(reshape([top(:, 1), floor(:, 2), top(:, 3), top(:, 2)], [3, 4]))
    end do
  contains
    subroutine add_tet(corner)
      real(wp), intent(in) :: corner(3, 4)

      if (abs(tet_volume(corner)) < least) return
      call ensure_capacity(parts%n_tet_corner + 4, parts%tet_corner)
      parts%tet_corner(:, parts%n_tet_corner + 1:parts%n_tet_corner + 4) = corner
      parts%n_tet_corner = parts%n_tet_corner + 4
    end subroutine add_tet
  end subroutine add_prism

end module bed_solid_m
