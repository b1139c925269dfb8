!> The bed as a surface that blocks touch: few bytes for a point, made ready near the blocks.
!!
!! Blocks lie on few of a million facets: planes, sides and directions of facets and edges are made
!! when something first comes near.
module bed_surface_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use vectors_m, only: norms
  use neighbours_m, only: bins_t, bins_build
  use edge_crossing_m, only: edge_t
  use surface_features_m, only: find_features, set_plane, set_facet, edge_between
  use surface_search_m, only: surface_t, found_t, gather
  implicit none
  private
  public :: bed_t, make_bed_surface, make_ready

  real(wp), parameter :: no_gap = 1.0e-13_wp     !! by which facets overlap, over the bed [-]

  type :: bed_t
    logical :: there = .false.
    real(wp), allocatable :: point(:, :)       !! (3, n) with the repetitions [m]
    integer, allocatable :: triangle(:, :)     !! (3, m) counter-clockwise from outside
    real(wp) :: origin(3) = 0.0_wp             !! lower corner of the tank [m]
    real(wp) :: period(3) = 0.0_wp             !! length of the tank where it is periodic, else 0
    type(surface_t) :: surface                 !! what touches and is touched, as far as it is made
    integer :: n_made(2) = 0                   !! facets, edges that are
    integer, allocatable :: edge(:, :)         !! (4, e) of `find_features`
    real(wp), allocatable :: point_normal(:, :)   !! (3, n) outward, of any length
    type(bins_t) :: columns                    !! the facets seen from above
    integer :: n_given = 0                     !! triangles of the file, without the repetitions
    character(:), allocatable :: checksum      !! of the file
  end type bed_t

contains

  !> Find the edges and corners of the bed and sort all into bins.
  subroutine make_bed_surface(spacing, bed)
    real(wp), intent(in) :: spacing   !! of the bins: the mean side of a facet [m]
    type(bed_t), intent(inout) :: bed
    logical, allocatable :: is_corner(:)
    integer, parameter :: first_edges = 16
    integer :: c, f, m, n

    n = size(bed%triangle, 2)
    associate (surface => bed%surface)
      call find_features(bed%point, [(3*f - 2, f=1, n + 1)], bed%triangle, bed%edge, &
        surface%n_convex, bed%point_normal, is_corner)
      do f = 1, n
        surface%bounding_radius = max(surface%bounding_radius, &
                                      maxval(norms(bed%point(:, bed%triangle(:, f)))))
      end do
      m = count(bed%edge(4, :) > 0)
      call bins_build(bed%point, bed%triangle, spacing, surface%facets)
      call bins_build(bed%point, bed%edge(1:2, :m), spacing, surface%edges)
      surface%low = surface%facets%low
      surface%high = surface%facets%high
      allocate (surface%facet_at(n), surface%edge_at(m), source=0)
      allocate (surface%edge(first_edges), surface%end_outward(3, 2, first_edges))
      surface%vertex = bed%point(:, pack([(c, c=1, size(is_corner))], is_corner))
      n = size(surface%vertex, 2)
      surface%n_corners = n
      allocate (surface%weight(n), source=1.0_wp)
      surface%length = huge(1.0_wp)   ! the block limits the contact, as on a wall
      call bins_build(surface%vertex, reshape([(c, c=1, n)], [1, n]), spacing, surface%vertices)
    end associate
  end subroutine make_bed_surface

  !> Facets and edges whose bins meet a box: make those that are not there yet, and list them.
  subroutine make_ready(low, high, bed, found, any_order)
    real(wp), intent(in) :: low(3), high(3)      !! [m]
    type(bed_t), intent(inout) :: bed
    type(found_t), intent(inout) :: found        !! their places in the surface
    logical, intent(in), optional :: any_order   !! see `gather`
    integer :: m

    call gather(bed%surface%facets, size(bed%surface%facet_at), low, high, found%facets, any_order)
    associate (s => bed%surface, f => found%facets%item)
      do m = 1, found%facets%n
        if (s%facet_at(f(m)) == 0) call add_facet(f(m), bed)
        f(m) = s%facet_at(f(m))
      end do
    end associate
    call gather(bed%surface%edges, size(bed%surface%edge_at), low, high, found%edges, any_order)
    associate (s => bed%surface, e => found%edges%item)
      do m = 1, found%edges%n
        if (s%edge_at(e(m)) == 0) call add_edge(e(m), bed)
        e(m) = s%edge_at(e(m))
      end do
    end associate
  end subroutine make_ready

  !> Append facet f to the surface.
  subroutine add_facet(f, bed)
    integer, intent(in) :: f
    type(bed_t), intent(inout) :: bed
    integer :: n

    n = bed%n_made(1) + 1
    bed%n_made(1) = n
    associate (s => bed%surface)
      call ensure_capacity(n, s%normal)
      call ensure_capacity(n, s%offset)
      call ensure_capacity(n, s%facet_number)
      s%facet_at(f) = n
      s%facet_number(n) = size(s%edge_at) + f
      call ensure_capacity(n + 1, s%side)
      call ensure_capacity(3*n, s%side_normal)
      call ensure_capacity(3*n, s%side_offset)
      s%side(n:n + 1) = [3*n - 2, 3*n + 1]
      call set_facet(bed%point(:, bed%triangle(:, f)), s%normal(:, n), s%offset(n), &
        s%side_normal(:, 3*n - 2:3*n), s%side_offset(3*n - 2:3*n))
      ! a place on the edge between two flat facets must not slip between them
      s%side_offset(3*n - 2:3*n) = s%side_offset(3*n - 2:3*n) - no_gap*maxval(abs([s%low, s%high]))
    end associate
  end subroutine add_facet

  !> Append edge e to the surface.
  subroutine add_edge(e, bed)
    integer, intent(in) :: e
    type(bed_t), intent(inout) :: bed
    type(edge_t), allocatable :: edge(:)
    real(wp), allocatable :: end_outward(:, :, :)
    real(wp) :: normal(3, 2), offset
    integer :: m, n

    n = bed%n_made(2) + 1
    bed%n_made(2) = n
    associate (s => bed%surface)
      if (n > size(s%edge)) then
        allocate (edge(2*n), end_outward(3, 2, 2*n))
        edge(:n - 1) = s%edge(:n - 1)
        end_outward(:, :, :n - 1) = s%end_outward(:, :, :n - 1)
        call move_alloc(edge, s%edge)
        call move_alloc(end_outward, s%end_outward)
      end if
      call ensure_capacity(n, s%edge_number)
      s%edge_at(e) = n
      s%edge_number(n) = e
      do m = 1, 2
        call set_plane(bed%point(:, bed%triangle(:, bed%edge(2 + m, e))), normal(:, m), offset)
      end do
      s%edge(n) = edge_between(bed%point(:, bed%edge(1:2, e)), normal)
      s%end_outward(:, :, n) = bed%point_normal(:, bed%edge(1:2, e))
    end associate
  end subroutine add_edge

end module bed_surface_m
