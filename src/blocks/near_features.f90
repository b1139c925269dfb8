!> How two bodies that may touch stand to one another, each seen from the other, and what of them
!! may touch before they have moved against one another by a skin: vertices of each with the facets
!! and edges of the other that may be nearest to them, and edges that may cross.
module near_features_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use vectors_m, only: cross, norm
  use bed_m, only: bed_t, bed_is_near, bed_distance
  use bed_surface_m, only: make_ready
  use surface_search_m, only: surface_t, near_list_t, found_t, gather, gather_edges, &
    gather_facets, search_surface, min_distance, segment_distance2, nowhere
  use edge_crossing_m, only: edge_t, turn_before, way_apart
  implicit none
  private
  public :: near_features_t, near_vertices_t, search_t, list_features, list_bed
  public :: edge_in_view
  public :: poses_t, view_t, meeting_t
  public :: update_views, seen_from, box_in_view, way_between, closes

  !> Poses of a pair of bodies.
  type :: poses_t
    real(wp) :: x_a(3) = 0.0_wp, x_b(3) = 0.0_wp, q_a(4) = 0.0_wp, q_b(4) = 0.0_wp
  end type poses_t

  !> One body seen from the other: a place p in its axes is turn.p + x in those of the other.
  type :: view_t
    real(wp) :: turn(3, 3) = 0.0_wp    !! [-]
    real(wp) :: x(3) = 0.0_wp          !! [m]
  end type view_t

  !> Bodies a and b, or body a and the bed, at one moment.
  type :: meeting_t
    integer :: a = 0, b = 0                      !! their numbers
    type(poses_t) :: poses
    real(wp) :: way = 0.0_wp                     !! since their lists were made [m]
    real(wp) :: turn_a(3, 3) = 0.0_wp, turn_b(3, 3) = 0.0_wp   !! body axes to space
    real(wp) :: to_b(3) = 0.0_wp       !! from the centre of a to that of b, space [m]
    real(wp) :: speed = 0.0_wp         !! of any two points against one another, at most [m/s]
    real(wp) :: gap = 0.0_wp           !! still taken as a contact point [m]
    real(wp) :: margin = 0.0_wp        !! part of it whatever the speed [m]
    real(wp) :: ahead = 0.0_wp         !! time in which contacts may come [s]
    real(wp) :: v(3) = 0.0_wp          !! of a past b, space [m/s]
    real(wp) :: omega_a(3) = 0.0_wp, omega_b(3) = 0.0_wp       !! spins, space [rad/s]
    type(view_t) :: a_in_b, b_in_a     !! see `update_views`
  end type meeting_t

  !> Vertices of one body near the other, and the features of the other they may touch.
  type :: near_vertices_t
    integer :: n = 0
    integer, allocatable :: vertex(:)
    real(wp), allocatable :: away(:)                        !! (n) from the other body [m]
    integer, allocatable :: facet_first(:), edge_first(:)   !! (n + 1) into the next two
    integer :: n_facets = 0, n_edges = 0
    integer, allocatable :: facet(:), edge(:)
  end type near_vertices_t

  !> The lists of a pair of bodies.
  type :: near_features_t
    type(poses_t) :: when                        !! poses at which they were made
    real(wp) :: valid = -1.0_wp                  !! way since then for which they hold [m]
    real(wp) :: ahead = 0.0_wp                   !! largest gap for which they hold [m]
    real(wp) :: nearest = nowhere                !! way and gap before anything touches [m]
    type(near_vertices_t) :: of_a, of_b
    integer :: n_crossings = 0
    integer, allocatable :: edge_a(:), edge_b(:) !! sorted by edge of a, then of b
    real(wp), allocatable :: away(:)             !! way before the two may cross [m]
    real(wp) :: ready(3, 2) = 0.0_wp             !! corners of a box in which the bed is ready [m]
  end type near_features_t

  !> How far to look for features, and the lists of the search.
  type :: search_t
    real(wp) :: skin = 0.0_wp                    !! least way before lists are renewed [m]
    real(wp) :: lasting = 0.0_wp                 !! time that lists of fast bodies last [s]
    real(wp) :: min_ahead = 0.0_wp
      !! way of a contact point that comes soon, at least [m],
    real(wp) :: ahead = 0.0_wp                   !! and of the pair whose lists are made [m]
    real(wp) :: margin = 0.0_wp                  !! added to all gaps [m]
    type(near_list_t) :: guests, hosts
    type(found_t) :: found
  end type search_t

  real(wp), parameter :: max_skin = 4.0_wp      !! largest skin over the least
  real(wp), parameter :: ready_share = 0.25_wp  !! way for which a bed is made ready, over a radius

contains

  !> Lists of a pair of bodies, wider for fast ones.
  subroutine list_features(now, a, b, search, near)
    type(meeting_t), intent(in) :: now
    type(surface_t), intent(in) :: a, b
    type(search_t), intent(inout) :: search
    type(near_features_t), intent(inout) :: near
    real(wp) :: apart, skin

    call begin_lists(now%poses, search%ahead, near)
    apart = norm(now%to_b) - a%bounding_radius - b%bounding_radius - search%ahead
    skin = skin_for(now%speed, search)
    near%valid = max(apart, skin)
    if (apart > skin) return
    call list_vertices(now%b_in_a, now%a_in_b, skin, b, a, search, near%of_b)
    call list_vertices(now%a_in_b, now%b_in_a, skin, a, b, search, near%of_a)
    call list_crossings(now, a, b, search, near)
    call find_nearest(near)
  end subroutine list_features

  !> Lists of a body and the bed.
  subroutine list_bed(bed, now, surface, search, near)
    type(bed_t), intent(inout) :: bed
    type(meeting_t), intent(in) :: now
    type(surface_t), intent(in) :: surface       !! of the body
    type(search_t), intent(inout) :: search
    type(near_features_t), intent(inout) :: near
    real(wp) :: margin, reach, place(3), distance, outward(3)
    integer :: i

    call begin_lists(now%poses, search%ahead, near)
    near%valid = skin_for(now%speed, search)
    margin = near%valid + search%ahead
    ! no search below looks further from the centre, but for a corner deep in the bed
    reach = surface%bounding_radius + 3*margin + surface%length
    associate (x => now%poses%x_a, cutoff => surface%bounding_radius + margin)
      if (.not. bed_is_near(bed, x - cutoff, x + cutoff)) return
      if (any(x - reach < near%ready(:, 1)) .or. any(x + reach > near%ready(:, 2))) then
        near%ready(:, 1) = x - reach - ready_share*surface%bounding_radius
        near%ready(:, 2) = x + reach + ready_share*surface%bounding_radius
        call make_ready(near%ready(:, 1), near%ready(:, 2), bed, search%found, .true.)
      end if
    end associate
    call list_vertices(now%b_in_a, now%a_in_b, near%valid, bed%surface, surface, search, &
      near%of_b)
    call list_crossings(now, surface, bed%surface, search, near)
    near%of_a%n_facets = 0
    near%of_a%n_edges = 0
    margin = margin + surface%ball
    do i = 1, merge(1, surface%n_corners, surface%ball > 0.0_wp)
      place = now%poses%x_a + matmul(now%turn_a, surface%vertex(:, i))
      call bed_distance(bed, place, margin, max(margin, surface%bounding_radius), search%found, &
        distance, outward)
      if (distance > margin .or. all(abs(outward) <= 0.0_wp)) cycle
      reach = max(abs(distance), surface%ball) + 2*(near%valid + search%ahead)
      if (distance < -margin) call make_ready(place - reach, place + reach, bed, search%found, &
        .true.)
      call append_near(bed%surface, i, place, reach, search, near%of_a)
      near%of_a%away(near%of_a%n) = distance - surface%ball
    end do
    call end_lists(near%of_a)
    call find_nearest(near)
  end subroutine list_bed

  !> Empty lists for the present poses.
  pure subroutine begin_lists(poses, ahead, near)
    type(poses_t), intent(in) :: poses
    real(wp), intent(in) :: ahead                !! largest gap for which they hold [m]
    type(near_features_t), intent(inout) :: near

    near%when = poses
    near%ahead = ahead
    near%of_a%n = 0
    near%of_b%n = 0
    near%n_crossings = 0
    near%nearest = nowhere
  end subroutine begin_lists

  !> Way and gap before anything of the lists touches.
  pure subroutine find_nearest(near)
    type(near_features_t), intent(inout) :: near

    if (near%of_a%n > 0) near%nearest = minval(near%of_a%away(:near%of_a%n))
    if (near%of_b%n > 0) near%nearest = min(near%nearest, minval(near%of_b%away(:near%of_b%n)))
    if (near%n_crossings > 0) near%nearest = min(near%nearest, minval(near%away(:near%n_crossings)))
  end subroutine find_nearest

  !> Way by which bodies may move before their lists are renewed: wider for fast bodies [m].
  pure function skin_for(speed, search) result(skin)
    real(wp), intent(in) :: speed                 !! of any two points, at most [m/s]
    type(search_t), intent(in) :: search
    real(wp) :: skin

    skin = min(max(search%skin, speed*search%lasting), max_skin*search%skin)
  end function skin_for

  !> Vertices of the guest near the surface of the host or inside, each with the facets and edges
  !! that may be nearest to it before the bodies have moved by the skin.
  subroutine list_vertices(guest_in_host, host_in_guest, skin, guest, host, search, list)
    type(view_t), intent(in) :: guest_in_host, host_in_guest
    real(wp), intent(in) :: skin               !! [m]
    type(surface_t), intent(in) :: guest, host
    type(search_t), intent(inout) :: search
    type(near_vertices_t), intent(inout) :: list
    real(wp) :: margin, place(3), distance, outward(3), low(3), high(3)
    integer :: m

    list%n_facets = 0
    list%n_edges = 0
    if (host%ball > 0.0_wp) return   ! its own centre is the vertex
    margin = skin + search%ahead + guest%ball
    call box_in_view(host_in_guest, host%low - margin, host%high + margin, low, high)
    call gather(guest%vertices, size(guest%weight), low, high, search%guests)
    do m = 1, search%guests%n
      place = seen_from(guest_in_host, guest%vertex(:, search%guests%item(m)))
      if (any(place < host%low - margin) .or. any(place > host%high + margin)) cycle
      if (min_distance(host, place) > margin) cycle
      call search_surface(host, place, margin, search%found, distance, outward)
      if (distance > margin) cycle
      call append_near(host, search%guests%item(m), place, &
        max(abs(distance), guest%ball) + 2*(skin + search%ahead), search, list)
      list%away(list%n) = distance - guest%ball
    end do
    call end_lists(list)
  end subroutine list_vertices

  !> Append a vertex with the facets and edges of the host within the cutoff; `away` is not set.
  subroutine append_near(host, vertex, place, cutoff, search, list)
    type(surface_t), intent(in) :: host
    integer, intent(in) :: vertex
    real(wp), intent(in) :: place(3), cutoff      !! of the vertex, host axes [m]
    type(search_t), intent(inout) :: search
    type(near_vertices_t), intent(inout) :: list

    call gather_facets(host, place - cutoff, place + cutoff, search%found%facets)
    call gather_edges(host, place - cutoff, place + cutoff, search%found%edges)
    list%n = list%n + 1
    call ensure_capacity(list%n, list%vertex)
    call ensure_capacity(list%n, list%away)
    call ensure_capacity(list%n, list%facet_first)
    call ensure_capacity(list%n, list%edge_first)
    list%vertex(list%n) = vertex
    list%facet_first(list%n) = list%n_facets + 1
    list%edge_first(list%n) = list%n_edges + 1
    associate (facets => search%found%facets, edges => search%found%edges)
      call append_facets(host, facets%item(:facets%n), place, cutoff, list%n_facets, list%facet)
      call append_edges(host, edges%item(:edges%n), place, cutoff, list%n_edges, list%edge)
    end associate
  end subroutine append_near

  !> Close the lists of facets and edges of the last vertex.
  subroutine end_lists(list)
    type(near_vertices_t), intent(inout) :: list

    call ensure_capacity(list%n + 1, list%facet_first)
    call ensure_capacity(list%n + 1, list%edge_first)
    list%facet_first(list%n + 1) = list%n_facets + 1
    list%edge_first(list%n + 1) = list%n_edges + 1
  end subroutine end_lists

  !> Append those of some facets that may be nearest to a place, within the cutoff of it, to a list
  !! of n numbers.
  subroutine append_facets(host, facets, place, cutoff, n, list)
    type(surface_t), intent(in) :: host
    integer, intent(in) :: facets(:)
    real(wp), intent(in) :: place(3), cutoff   !! host axes [m]
    integer, intent(inout) :: n
    integer, allocatable, intent(inout) :: list(:)
    logical :: near
    integer :: k, c

    call ensure_capacity(n + size(facets), list)
    do k = 1, size(facets)
      associate (f => facets(k))
        near = abs(dot_product(host%normal(:, f), place) - host%offset(f)) <= cutoff
        do c = host%side(f), host%side(f + 1) - 1
          if (.not. near) exit
          near = dot_product(host%side_normal(:, c), place) >= host%side_offset(c) - cutoff
        end do
        if (.not. near) cycle
        n = n + 1
        list(n) = f
      end associate
    end do
  end subroutine append_facets

  !> Append those of some edges that are within the cutoff of a place to a list of n numbers.
  subroutine append_edges(host, edges, place, cutoff, n, list)
    type(surface_t), intent(in) :: host
    integer, intent(in) :: edges(:)
    real(wp), intent(in) :: place(3), cutoff   !! host axes [m]
    integer, intent(inout) :: n
    integer, allocatable, intent(inout) :: list(:)
    integer :: k
    real(wp) :: d(3)

    call ensure_capacity(n + size(edges), list)
    do k = 1, size(edges)
      associate (edge => host%edge(edges(k)))
        d = place - edge%start
        d = d - min(max(dot_product(d, edge%along), 0.0_wp), edge%extent)*edge%along
      end associate
      if (.not. dot_product(d, d) <= cutoff**2) cycle
      n = n + 1
      list(n) = edges(k)
    end do
  end subroutine append_edges

  !> Pairs of convex edges that may cross before the bodies have moved by the skin.
  subroutine list_crossings(now, surface_a, surface_b, search, near)
    type(meeting_t), intent(in) :: now
    type(surface_t), intent(in) :: surface_a, surface_b
    type(search_t), intent(inout) :: search
    type(near_features_t), intent(inout) :: near
    type(edge_t) :: guest
    real(wp) :: cutoff, away, low(3), high(3)
    integer :: m, k, i, j, n

    if (surface_a%ball > 0.0_wp .or. surface_b%ball > 0.0_wp) return
    cutoff = near%valid + search%ahead + min(surface_a%length, surface_b%length)
    call box_in_view(now%b_in_a, surface_b%low - cutoff, surface_b%high + cutoff, low, high)
    call gather_edges(surface_a, low, high, search%guests)
    do m = 1, search%guests%n
      i = search%guests%item(m)
      if (i > surface_a%n_convex) exit
      guest = edge_in_view(now%a_in_b, surface_a%edge(i))
      low = min(guest%start, guest%start + guest%extent*guest%along) - cutoff
      high = max(guest%start, guest%start + guest%extent*guest%along) + cutoff
      if (any(low > surface_b%high) .or. any(high < surface_b%low)) cycle
      call gather_edges(surface_b, low, high, search%hosts)
      do k = 1, search%hosts%n
        j = search%hosts%item(k)
        if (surface_b%edge_number(j) > surface_b%n_convex) exit
        away = way_to_crossing(guest, surface_b%edge(j), near%valid, cutoff, &
          min(surface_a%bounding_radius, surface_b%bounding_radius))
        ! Append a pair of edges that may cross.
        if (away < nowhere) then
          n = near%n_crossings + 1
          near%n_crossings = n
          call ensure_capacity(n, near%edge_a)
          call ensure_capacity(n, near%edge_b)
          call ensure_capacity(n, near%away)
          near%edge_a(n) = i
          near%edge_b(n) = j
          near%away(n) = away
        end if
      end do
    end do
  end subroutine list_crossings

  !> An edge seen from the other body.
  pure function edge_in_view(view, edge) result(seen)
    type(view_t), intent(in) :: view
    type(edge_t), intent(in) :: edge
    type(edge_t) :: seen

    seen%start = seen_from(view, edge%start)
    seen%along = matmul(view%turn, edge%along)
    seen%extent = edge%extent
    seen%into = matmul(view%turn, edge%into)
  end function edge_in_view

  !> Way that two bodies may move before two edges of theirs may cross; `nowhere` where they cannot
  !! before the bodies have moved by a margin [m].
  pure function way_to_crossing(guest, host, margin, cutoff, arm) result(way)
    type(edge_t), intent(in) :: guest, host   !! in the same axes
    real(wp), intent(in) :: margin            !! [m]
    real(wp), intent(in) :: cutoff             !! distance from which edges cannot come to cross [m]
    real(wp), intent(in) :: arm               !! radius of the smaller body: it turns by way/arm [m]
    real(wp) :: way
    real(wp) :: angle

    way = nowhere
    if (segment_distance2(guest%start, guest%along, guest%extent, host%start, host%along, &
                          host%extent) > cutoff**2) return
    angle = turn_before(guest, host)
    if (angle >= margin/arm) return
    way = max(way_apart(guest, host, margin/arm), angle*arm)
  end function way_to_crossing

  !> Each body seen from the other.
  pure subroutine update_views(now)
    type(meeting_t), intent(inout) :: now

    now%a_in_b%turn = matmul(transpose(now%turn_b), now%turn_a)
    now%a_in_b%x = matmul(-now%to_b, now%turn_b)
    now%b_in_a%turn = transpose(now%a_in_b%turn)
    now%b_in_a%x = matmul(now%to_b, now%turn_a)
  end subroutine update_views

  !> A place of one body in the axes of the other [m].
  pure function seen_from(view, place) result(seen)
    type(view_t), intent(in) :: view
    real(wp), intent(in) :: place(3)   !! [m]
    real(wp) :: seen(3)

    seen = view%x + matmul(view%turn, place)
  end function seen_from

  !> Box in the axes of the other body around a box.
  pure subroutine box_in_view(view, low, high, new_low, new_high)
    type(view_t), intent(in) :: view
    real(wp), intent(in) :: low(3), high(3)           !! [m]
    real(wp), intent(out) :: new_low(3), new_high(3)  !! [m]
    real(wp) :: middle(3), half(3)

    middle = seen_from(view, 0.5_wp*(low + high))
    half = matmul(abs(view%turn), 0.5_wp*(high - low))
    new_low = middle - half
    new_high = middle + half
  end subroutine box_in_view

  !> Largest way that points of two bodies move against one another from one pair of poses to
  !! another [m].
  pure function way_between(before, now, radius_a, radius_b) result(way)
    type(poses_t), intent(in) :: before, now
    real(wp), intent(in) :: radius_a, radius_b   !! of the bodies [m]
    real(wp) :: way

    ! a turn by phi: |dq| = 2 sin(phi/4), and a point at distance r moves 4 r sin(phi/4) at most
    way = norm((now%x_a - before%x_a) - (now%x_b - before%x_b)) &
      + 2*radius_a*norm(now%q_a - before%q_a) + 2*radius_b*norm(now%q_b - before%q_b)
  end function way_between

  !> Whether two places touch, or come as near as the margin in the time ahead. Where there is one,
  !! others are left out: contact points to come that the bodies pass by would hold them.
  pure function closes(now, arm_a, arm_b, normal, depth) result(yes)
    type(meeting_t), intent(in) :: now
    real(wp), intent(in) :: arm_a(3), arm_b(3)   !! from the centres, space [m]
    real(wp), intent(in) :: normal(3)            !! from a to b, space [-]
    real(wp), intent(in) :: depth                !! now [m]
    logical :: yes
    real(wp) :: closing(3)

    yes = depth > 0.0_wp
    if (yes) return
    closing = now%v + cross(now%omega_a, arm_a) - cross(now%omega_b, arm_b)
    yes = depth + now%margin + now%ahead*dot_product(normal, closing) > 0.0_wp
  end function closes

end module near_features_m
