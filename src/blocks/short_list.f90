!> The few features of a pair of bodies that may touch in the next substeps, chosen from the lists
!! of those that are near: all that is read in most substeps.
module short_list_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use surface_search_m, only: surface_t, nearest_on_surface, nowhere
  use edge_crossing_m, only: edge_t
  use near_features_m, only: poses_t, view_t, meeting_t, seen_from, way_between, near_features_t, &
    near_vertices_t, search_t, append_facets, append_edges, edge_in_view, way_to_crossing
  implicit none
  private
  public :: short_list_t, short_list_holds, choose_features, n_chosen

  !> One list: for each vertex of b, then of a, its number, the numbers of facets and of edges of
  !! the other body that may be nearest to it, and these; then two edges for each crossing.
  type :: short_list_t
    type(poses_t) :: when                  !! poses at which it was made
    real(wp) :: until = -1.0_wp            !! way and gap since then for which it holds [m]
    real(wp) :: left = -1.0_wp             !! way since then for which the lists near it hold [m]
    real(wp) :: ahead = 0.0_wp             !! largest gap for which they do [m]
    integer :: n_of_b = 0, n_of_a = 0, n_edges = 0   !! vertices of each, crossings
    integer :: of_a = 1, edges = 1         !! where the parts of a and of the edges begin
    integer :: n = 0                       !! length
    integer, allocatable :: item(:)
  end type short_list_t

contains

  !> Number of features in a short list, and of contact points at most.
  pure function n_chosen(short) result(n)
    type(short_list_t), intent(in) :: short
    integer :: n

    n = short%n_of_b + short%n_of_a + short%n_edges
  end function n_chosen

  !> Whether a short list still holds.
  pure function short_list_holds(now, radius_a, radius_b, short) result(yes)
    type(meeting_t), intent(in) :: now
    real(wp), intent(in) :: radius_a, radius_b  !! of the bodies [m]
    type(short_list_t), intent(in) :: short
    logical :: yes
    real(wp) :: way

    way = way_between(short%when, now%poses, radius_a, radius_b)
    yes = way <= short%left .and. way + now%gap <= short%until .and. now%gap <= short%ahead
  end function short_list_holds

  !> Choose from the lists of a pair what may touch before the bodies have moved a little.
  subroutine choose_features(now, way, search, surface_a, surface_b, near, short)
    type(meeting_t), intent(in) :: now
    real(wp), intent(in) :: way               !! of the bodies since the lists were made [m]
    type(search_t), intent(in) :: search
    type(surface_t), intent(in) :: surface_a, surface_b
    type(near_features_t), intent(in) :: near
    type(short_list_t), intent(inout) :: short
    real(wp), parameter :: share = 0.02_wp    !! of a skin: least way for which the short list holds
    integer :: n, m, last
    type(edge_t) :: guest
    real(wp) :: margin

    short%when = now%poses
    short%left = near%valid - way
    short%ahead = near%ahead
    short%until = now%gap + max(share*search%skin, now%gap)
    short%n = 0
    call choose_vertices(now%b_in_a, way, surface_b, surface_a, near%of_b, short, n)
    short%n_of_b = n
    short%of_a = short%n + 1
    call choose_vertices(now%a_in_b, way, surface_a, surface_b, near%of_a, short, n)
    short%n_of_a = n
    short%edges = short%n + 1
    ! Append those pairs of edges that may cross while the short list holds.
    short%n_edges = 0
    margin = short%until
    last = 0
    do m = 1, near%n_crossings
      if (near%away(m) > way + margin) cycle
      if (near%edge_a(m) /= last) guest = edge_in_view(now%a_in_b, surface_a%edge(near%edge_a(m)))
      last = near%edge_a(m)
      if (way_to_crossing(guest, surface_b%edge(near%edge_b(m)), margin, &
        margin + min(surface_a%length, surface_b%length), &
        min(surface_a%bounding_radius, surface_b%bounding_radius)) > margin) cycle
      call ensure_capacity(short%n + 2, short%item)
      short%item(short%n + 1:short%n + 2) = [near%edge_a(m), near%edge_b(m)]
      short%n = short%n + 2
      short%n_edges = short%n_edges + 1
    end do
    call ensure_capacity(short%n + 1, short%item)
    ! without any feature in the lists nothing comes near as long as these hold
    if (near%of_a%n + near%of_b%n + near%n_crossings == 0) short%until = huge(1.0_wp)
  end subroutine choose_features

  !> Append those vertices of a guest, with the features of the host, that may touch while the short
  !! list holds.
  subroutine choose_vertices(guest_in_host, way, guest, host, list, short, n_vertices)
    type(view_t), intent(in) :: guest_in_host
    real(wp), intent(in) :: way                !! since the lists were made [m]
    type(surface_t), intent(in) :: guest, host
    type(near_vertices_t), intent(in) :: list
    type(short_list_t), intent(inout) :: short
    integer, intent(out) :: n_vertices         !! appended
    real(wp) :: margin, place(3), distance, outward(3), cutoff
    integer :: m, at

    n_vertices = 0
    margin = short%until
    do m = 1, list%n
      if (list%away(m) > way + margin) cycle
      associate (facets => list%facet(list%facet_first(m):list%facet_first(m + 1) - 1), &
        edges => list%edge(list%edge_first(m):list%edge_first(m + 1) - 1))
        place = seen_from(guest_in_host, guest%vertex(:, list%vertex(m)))
        call nearest_on_surface(host, place, facets, edges, distance, outward)
        if (distance - guest%ball > margin .and. distance < nowhere) cycle
        cutoff = max(abs(distance), guest%ball) + 2*margin
        at = short%n + 1
        short%n = short%n + 3
        call ensure_capacity(short%n, short%item)
        short%item(at) = list%vertex(m)
        call append_facets(host, facets, place, cutoff, short%n, short%item)
        short%item(at + 1) = short%n - at - 2
        call append_edges(host, edges, place, cutoff, short%n, short%item)
        short%item(at + 2) = short%n - at - 2 - short%item(at + 1)
        n_vertices = n_vertices + 1
      end associate
    end do
  end subroutine choose_vertices

end module short_list_m
