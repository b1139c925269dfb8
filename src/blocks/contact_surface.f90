!> Contact points of the exact surfaces of the blocks with one another, the plane walls and the bed.
!!
!! A vertex of one body (see `surface_features_m`) touches where it is inside the other; its depth
!! is its distance from the surface of the other. A sharp edge touches an edge of the other where
!! the two cross; the depth is the distance of the two lines. Both ways, so that a pair has all the
!! points that carry it. Spheres touch as spheres, wherever a place is nearer than all around it.
!!
!! Pairs of bodies keep a list of the features that may touch until they have moved against one
!! another by a skin (`near_features_m`). What comes out, and its order, do not depend on when the
!! lists were made.
!!
!! Of what comes near, only what does so by its own motion counts as a contact point to come.
module contact_surface_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use vectors_m, only: distance, norm, rotation_matrix
  use rigid_body_m, only: blocks_t
  use walls_m, only: walls_t
  use bed_m, only: bed_t, bed_counterpart, bed_place
  use neighbours_m, only: pair_list_t, near_pairs
  use contact_points_m, only: contact_point_t, contact_points_t, add_point
  use displacements_m, only: comes_before
  use surface_features_m, only: surface_init
  use surface_search_m, only: surface_t, nearest_on_surface, nearest_places
  use edge_crossing_m, only: edge_t, crossing_t, cross_edges
  use near_features_m, only: poses_t, view_t, meeting_t, update_views, way_between, closes, &
    near_features_t, near_vertices_t, search_t, list_features, list_bed, edge_in_view
  implicit none
  private
  public :: contact_surface_t, contact_surface_init, find_surface_points, cover_way, renew_pairs

  !> What may touch of a pair of bodies a > b.
  type :: pair_t
    integer :: a = 0, b = 0
    real(wp) :: shift(3) = 0.0_wp                !! to the image of b near a [m]
    type(near_features_t), allocatable :: near   !! before they have moved by a skin
  end type pair_t

  type :: contact_surface_t
    type(surface_t), allocatable :: surface(:)   !! (shapes)
    real(wp), allocatable :: bounding_radius(:)   !! (bodies) [m]
    type(search_t) :: search
    real(wp) :: wide_skin = 0.0_wp               !! the same for the list of pairs [m]
    real(wp) :: listed_skin = 0.0_wp             !! of the present list [m]
    real(wp) :: unlisted_gap = 0.0_wp            !! way of pairs that are not in it to touch [m]
    type(pair_list_t) :: near                    !! pairs of bodies whose bounding spheres meet
    type(pair_t), allocatable :: pairs(:)        !! (near%n)
    type(near_features_t), allocatable :: with_bed(:)   !! (bodies) each with the bed
    !> Bodies and places of the list of pairs.
    logical :: listed = .false.
    logical, allocatable :: present(:)
    real(wp), allocatable :: x(:, :)
    real(wp), allocatable :: turn(:, :, :)       !! (3, 3, bodies) body to space
    real(wp), allocatable :: q(:, :)             !! (4, bodies) the attitudes of that
    !> Pairs that can touch: not both still, not both fixed.
    logical :: moving_listed = .false.
    integer :: n_moving = 0
    integer, allocatable :: moving(:)            !! (n_moving) numbers in `near`, rising
    integer, allocatable :: state(:)             !! (bodies) of which they are, see `state_of`
  end type contact_surface_t

  real(wp), parameter :: skin_share = 0.2_wp     !! least skin over the smallest `length`
  real(wp), parameter :: min_ahead = 0.1_wp      !! least way of a contact point to come, likewise
  real(wp), parameter :: lasting_steps = 2.0_wp  !! contact times that lists of fast bodies last
  real(wp), parameter :: wide_share = 0.2_wp
    !! skin of the pairs over the largest bounding radius

contains

  !> Make the features of all shapes and size the lists.
  subroutine contact_surface_init(contact_time, blocks, self)
    real(wp), intent(in) :: contact_time   !! [s]
    type(blocks_t), intent(in) :: blocks
    type(contact_surface_t), intent(out) :: self
    real(wp) :: smallest
    integer :: s, b

    allocate (self%surface(size(blocks%shapes)))
    do s = 1, size(blocks%shapes)
      call surface_init(blocks%shapes(s), self%surface(s))
    end do
    allocate (self%bounding_radius(blocks%n), self%present(blocks%n))
    allocate (self%x(3, blocks%n), self%turn(3, 3, blocks%n), self%q(4, blocks%n), source=0.0_wp)
    allocate (self%pairs(0), self%with_bed(blocks%n))
    allocate (self%state(blocks%n), source=0)
    smallest = huge(1.0_wp)
    do b = 1, blocks%n
      self%bounding_radius(b) = self%surface(blocks%shape(b))%bounding_radius
      smallest = min(smallest, self%surface(blocks%shape(b))%length)
    end do
    if (blocks%n == 0) return
    self%search%skin = skin_share*smallest
    self%search%lasting = lasting_steps*contact_time
    self%search%min_ahead = min_ahead*smallest
    call cover_way(max(0.5_wp*wide_share*maxval(self%bounding_radius), self%search%min_ahead), self)
  end subroutine contact_surface_init

  !> Let the list of pairs hold all that may meet before any two bodies have come nearer by a way.
  pure subroutine cover_way(way, self)
    real(wp), intent(in) :: way     !! [m]
    type(contact_surface_t), intent(inout) :: self

    self%unlisted_gap = way
    self%wide_skin = max(wide_share*maxval(self%bounding_radius), 2*way)
  end subroutine cover_way

  !> All contact points at the present poses, but for those between bodies that are still, and those
  !! (depth <= 0) that may come within a time `ahead`.
  subroutine find_surface_points(walls, blocks, ahead, self, points)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(in) :: ahead   !! [s]
    type(contact_surface_t), intent(inout) :: self
    type(contact_points_t), intent(inout) :: points
    real(wp) :: speed, gap
    integer :: a, b, p, w

    do b = 1, blocks%n
      if (.not. blocks%present(b)) cycle
      if (all(abs(blocks%q(:, b) - self%q(:, b)) <= 0.0_wp)) cycle   ! as when it was last here
      self%q(:, b) = blocks%q(:, b)
      self%turn(:, :, b) = rotation_matrix(blocks%q(:, b))
    end do
    call renew_pairs(walls, blocks, self)
    if (.not. self%moving_listed .or. any(self%state /= state_of(blocks%still, blocks%fixed))) then
      self%state = state_of(blocks%still, blocks%fixed)
      call ensure_capacity(self%near%n, self%moving)
      self%n_moving = 0
      do p = 1, self%near%n
        if (iand(self%state(self%near%a(p)), self%state(self%near%b(p))) /= 0) cycle
        self%n_moving = self%n_moving + 1
        self%moving(self%n_moving) = p
      end do
      self%moving_listed = .true.
    end if
    points%n = 0
    p = 1
    do a = 1, blocks%n
      if (.not. blocks%present(a)) cycle
      if (.not. (blocks%fixed(a) .or. blocks%still(a))) then
        speed = norm(blocks%v(:, a)) + norm(blocks%omega(:, a))*self%bounding_radius(a)
        gap = ahead*speed + self%search%margin
        if (walls%bed%there) call add_bed_points(walls%bed, blocks, a, speed, ahead, self, points)
        do w = 1, walls%n
          call add_wall_points(walls, blocks, a, w, gap, self, points)
        end do
      end if
      do while (p <= self%n_moving)
        if (self%near%a(self%moving(p)) /= a) exit
        call add_pair_points(blocks, ahead, self%moving(p), self, points)
        p = p + 1
      end do
    end do
  end subroutine find_surface_points

  !> Renew the list of pairs where one may have come near that is not in it.
  subroutine renew_pairs(walls, blocks, self)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    type(contact_surface_t), intent(inout) :: self
    logical :: holds
    integer :: b

    holds = self%listed
    do b = 1, merge(blocks%n, 0, holds)
      holds = blocks%present(b) .eqv. self%present(b)
      if (holds .and. blocks%present(b)) holds = .not. distance(blocks%x(:, b), self%x(:, b)) &
        > 0.5_wp*(self%listed_skin - self%unlisted_gap)
      if (.not. holds) exit
    end do
    if (.not. holds) call list_pairs(walls, blocks, self)
  end subroutine renew_pairs

  !> Bit 0: still, bit 1: fixed. Two bodies with a bit in common cannot touch.
  elemental integer function state_of(still, fixed)
    logical, intent(in) :: still, fixed

    state_of = merge(1, 0, still) + merge(2, 0, fixed)
  end function state_of

  !> List the pairs of bodies whose bounding spheres may meet before a body has moved far; pairs
  !! that were listed before keep their features.
  subroutine list_pairs(walls, blocks, self)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    type(contact_surface_t), intent(inout) :: self
    type(pair_t), allocatable :: before(:)
    logical :: same
    integer :: p, m

    call near_pairs(blocks%x, self%bounding_radius, blocks%present, walls%period, self%wide_skin, &
      self%near)
    call move_alloc(self%pairs, before)
    allocate (self%pairs(self%near%n))
    m = 1
    do p = 1, self%near%n
      associate (a => self%near%a(p), b => self%near%b(p), shift => self%near%shift(:, p))
        self%pairs(p)%a = a
        self%pairs(p)%b = b
        self%pairs(p)%shift = shift
        do while (m <= size(before))
          if (.not. comes_before(before(m)%a, before(m)%b, 0, a, b, 0)) exit
          m = m + 1
        end do
        same = m <= size(before)
        if (same) same = before(m)%a == a .and. before(m)%b == b &
          .and. all(abs(before(m)%shift - shift) <= 0.0_wp)
      end associate
      if (same) then
        call move_alloc(before(m)%near, self%pairs(p)%near)
      else
        allocate (self%pairs(p)%near)
      end if
    end do
    self%listed = .true.
    self%moving_listed = .false.
    self%listed_skin = self%wide_skin
    self%present = blocks%present
    self%x = blocks%x
  end subroutine list_pairs

  !> Contact points of body a and wall w: its corners, or its lowest point where it is a sphere.
  subroutine add_wall_points(walls, blocks, a, w, gap, self, points)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: a, w
    real(wp), intent(in) :: gap     !! still taken as a contact point [m]
    type(contact_surface_t), intent(in) :: self
    type(contact_points_t), intent(inout) :: points
    real(wp) :: above, n(3), depth, arm(3)
    integer :: i

    above = walls%offset(w) - dot_product(walls%normal(:, w), blocks%x(:, a))
    associate (surface => self%surface(blocks%shape(a)), turn => self%turn(:, :, a))
      if (above > self%bounding_radius(a) + gap) return
      n = matmul(walls%normal(:, w), turn)
      if (surface%ball > 0.0_wp) then
        arm = (surface%ball - 0.5_wp*(surface%ball - above))*walls%normal(:, w)
        call add_point(contact_point_t(a, walls%number(w), 1, arm, [0.0_wp, 0.0_wp, 0.0_wp], &
          walls%normal(:, w), surface%ball - above, 1.0_wp, surface%length), points)
        return
      end if
      do i = 1, surface%n_corners
        depth = dot_product(n, surface%vertex(:, i)) - above
        if (depth <= -gap) cycle
        arm = matmul(turn, surface%vertex(:, i))
        call add_point(contact_point_t(a, walls%number(w), i, arm, [0.0_wp, 0.0_wp, 0.0_wp], &
          walls%normal(:, w), depth, surface%weight(i), surface%length), points)
      end do
    end associate
  end subroutine add_wall_points

  !> Contact points of body a and the bed: corners of the bed, corners of the body, crossing edges.
  !! The points inside the faces of a body do not touch it: as on a wall, some corner always does.
  subroutine add_bed_points(bed, blocks, a, speed, ahead, self, points)
    type(bed_t), intent(inout) :: bed
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: a
    real(wp), intent(in) :: speed   !! of its points, at most [m/s]
    real(wp), intent(in) :: ahead   !! [s]
    type(contact_surface_t), intent(inout) :: self
    type(contact_points_t), intent(inout) :: points
    real(wp), parameter :: no_turn(3, 3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, &
      0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
    type(meeting_t) :: now
    logical :: ended

    now%a = a
    now%b = bed_counterpart
    now%poses%x_a = bed_place(bed, blocks%x(:, a))
    now%poses%q_a = blocks%q(:, a)
    now%turn_a = self%turn(:, :, a)
    now%turn_b = no_turn
    now%to_b = -now%poses%x_a
    now%v = blocks%v(:, a)
    now%omega_a = blocks%omega(:, a)
    now%speed = speed
    now%gap = ahead*speed + self%search%margin
    now%ahead = ahead
    now%margin = self%search%margin
    associate (surface => self%surface(blocks%shape(a)), near => self%with_bed(a))
      call check_lists(surface, bed%surface, near, self%search, now, ended)
      if (.not. ended .and. now%way + now%gap < near%nearest) return
      call update_views(now)
      if (ended) call list_bed(bed, now, surface, self%search, near)
      call add_feature_points(surface, bed%surface, now, near, points)
    end associate
  end subroutine add_bed_points

  !> Contact points of a listed pair of bodies.
  subroutine add_pair_points(blocks, ahead, p, self, points)
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(in) :: ahead                !! [s]
    integer, intent(in) :: p                     !! pair
    type(contact_surface_t), intent(inout) :: self
    type(contact_points_t), intent(inout) :: points
    type(meeting_t) :: now
    real(wp) :: apart, depth, normal(3), arm(3)
    integer :: a, b
    logical :: ended

    a = self%pairs(p)%a
    b = self%pairs(p)%b
    now%a = a
    now%b = b
    now%poses = poses_t(blocks%x(:, a), blocks%x(:, b), blocks%q(:, a), blocks%q(:, b))
    now%turn_a = self%turn(:, :, a)
    now%turn_b = self%turn(:, :, b)
    now%to_b = now%poses%x_b + self%pairs(p)%shift - now%poses%x_a
    now%v = blocks%v(:, a) - blocks%v(:, b)
    now%omega_a = blocks%omega(:, a)
    now%omega_b = blocks%omega(:, b)
    now%speed = norm(now%v) + norm(now%omega_a)*self%bounding_radius(a) &
      + norm(now%omega_b)*self%bounding_radius(b)
    now%gap = ahead*now%speed + self%search%margin
    now%ahead = ahead
    now%margin = self%search%margin
    if (norm(now%to_b) > self%bounding_radius(a) + self%bounding_radius(b) + now%gap) return
    associate (surface_a => self%surface(blocks%shape(a)), &
      surface_b => self%surface(blocks%shape(b)))
      if (surface_a%ball > 0.0_wp .and. surface_b%ball > 0.0_wp) then
        apart = norm(now%to_b)
        depth = surface_a%ball + surface_b%ball - apart
        if (depth <= -now%gap) return
        normal = now%to_b/max(apart, tiny(1.0_wp))
        arm = (surface_a%ball - 0.5_wp*depth)*normal
        call add_point(contact_point_t(a, b, 1, arm, arm - now%to_b, normal, depth, 1.0_wp, &
          min(surface_a%length, surface_b%length)), points)
      else
        call check_lists(surface_a, surface_b, self%pairs(p)%near, self%search, now, ended)
        if (.not. ended .and. now%way + now%gap < self%pairs(p)%near%nearest) return
        call update_views(now)
        if (ended) call list_features(now, surface_a, surface_b, self%search, self%pairs(p)%near)
        call add_feature_points(surface_a, surface_b, now, self%pairs(p)%near, points)
      end if
    end associate
  end subroutine add_pair_points

  !> How far a pair has moved since its lists were made. Do they hold no longer, and how far must
  !! new ones look?
  pure subroutine check_lists(surface_a, surface_b, near, search, now, ended)
    type(surface_t), intent(in) :: surface_a, surface_b
    type(near_features_t), intent(in) :: near
    type(search_t), intent(inout) :: search
    type(meeting_t), intent(inout) :: now
    logical, intent(out) :: ended
    real(wp), parameter :: wider = 1.5_wp     !! lists hold for such a multiple of the gap

    now%way = way_between(near%when, now%poses, surface_a%bounding_radius, &
      surface_b%bounding_radius)
    ended = now%gap > near%ahead .or. now%way > near%valid
    if (.not. ended) return
    now%way = 0.0_wp
    search%ahead = max(search%min_ahead, wider*now%gap)
  end subroutine check_lists

  !> Contact points of a pair of bodies, or of body a and the bed: vertices of b, vertices of a,
  !! crossing edges.
  subroutine add_feature_points(surface_a, surface_b, now, near, points)
    type(surface_t), intent(in) :: surface_a, surface_b
    type(meeting_t), intent(in) :: now
    type(near_features_t), intent(in) :: near
    type(contact_points_t), intent(inout) :: points

    call add_vertex_points(.false., now, surface_b, surface_a, near%of_b, points)
    call add_vertex_points(.true., now, surface_a, surface_b, near%of_a, points)
    call add_edge_points(now, surface_a, surface_b, near, points)
  end subroutine add_feature_points

  !> Contact points of the vertices listed of one body (the guest) with the surface of the other
  !! (the host).
  !!
  !! A point inside a flat face of the guest may come only to a surface that the face
  !! looks at: else, level with the edge of a face ahead, it would hold a body that slides over it.
  subroutine add_vertex_points(guest_is_a, now, guest, host, list, points)
    logical, intent(in) :: guest_is_a
    type(meeting_t), intent(in) :: now
    type(surface_t), intent(in) :: guest, host
    type(near_vertices_t), intent(in) :: list
    type(contact_points_t), intent(inout) :: points
    real(wp), parameter :: max_cosine = -0.2_wp   !! of a face and the surface that it looks at [-]
    type(view_t) :: view                      ! of the guest, host axes
    type(contact_point_t) :: point
    real(wp) :: turn_host(3, 3), place(3), apart, outward(3)
    integer :: m, i

    point%a = now%a
    point%b = now%b
    point%length = min(guest%length, host%length)
    if (guest_is_a) then
      view = now%a_in_b
      turn_host = now%turn_b
    else
      view = now%b_in_a
      turn_host = now%turn_a
    end if
    do m = 1, list%n
      if (list%away(m) > now%way + now%gap) cycle
      i = list%vertex(m)
      place = view%x + view%turn(:, 1)*guest%vertex(1, i) + view%turn(:, 2)*guest%vertex(2, i) &
        + view%turn(:, 3)*guest%vertex(3, i)
      associate (facets => list%facet(list%facet_first(m):list%facet_first(m + 1) - 1), &
        edges => list%edge(list%edge_first(m):list%edge_first(m + 1) - 1))
        if (guest%ball > 0.0_wp) then
          call add_ball_points(facets, edges)
          cycle
        end if
        call nearest_on_surface(host, place, facets, edges, apart, outward)
      end associate
      if (apart >= now%gap) cycle
      if (i > guest%n_corners) then
        if (.not. dot_product(matmul(view%turn, guest%facing(:, i)), outward) < max_cosine) cycle
      end if
      call add_place(apart, outward)
    end do

  contains

    !> A ball touches each place that is the nearest of those around it; a ball whose centre is
    !! inside, the nearest of all.
    subroutine add_ball_points(facet, edge)
      integer, intent(in) :: facet(:), edge(:)
      integer :: number(size(facet) + size(edge)), n_places, k
      real(wp) :: way(3, size(facet) + size(edge))

      call nearest_places(host, place, guest%ball + now%gap, facet, edge, n_places, number, way)
      do k = 1, n_places
        point%other = number(k)
        apart = norm(way(:, k))
        call add_place(apart, way(:, k)/apart)
      end do
      if (n_places > 0) return
      call nearest_on_surface(host, place, facet, edge, apart, outward)
      point%other = 0
      if (apart <= 0.0_wp) call add_place(apart, outward)
    end subroutine add_ball_points

    !> Add the contact point of a vertex with a place of the host.
    subroutine add_place(apart, outward)
      real(wp), intent(in) :: apart         !! outside the host [m]
      real(wp), intent(in) :: outward(3)    !! from the host, its axes [-]
      real(wp) :: arm(3)

      point%depth = guest%ball - apart
      point%weight = guest%weight(i)
      point%normal = matmul(turn_host, outward)
      arm = matmul(turn_host, place) - (guest%ball - 0.5_wp*point%depth)*point%normal
      if (guest_is_a) then
        point%id = i
        point%arm_a = arm + now%to_b
        point%arm_b = arm
        point%normal = -point%normal
      else
        point%id = i - size(guest%weight) - 1
        point%arm_a = arm
        point%arm_b = arm - now%to_b
      end if
      if (.not. closes(now, point%arm_a, point%arm_b, point%normal, point%depth)) return
      call add_point(point, points)
    end subroutine add_place

  end subroutine add_vertex_points

  !> Contact points of the pairs of edges listed that cross.
  subroutine add_edge_points(now, surface_a, surface_b, near, points)
    type(meeting_t), intent(in) :: now
    type(surface_t), intent(in) :: surface_a, surface_b
    type(near_features_t), intent(in) :: near
    type(contact_points_t), intent(inout) :: points
    type(edge_t) :: guest
    type(crossing_t) :: crossing
    type(contact_point_t) :: point
    real(wp) :: arm(3)
    integer :: m, i, j, last

    last = 0
    do m = 1, near%n_crossings
      if (near%away(m) > now%way + now%gap) cycle
      i = near%edge_a(m)
      j = near%edge_b(m)
      if (i /= last) guest = edge_in_view(now%a_in_b, surface_a%edge(i))
      last = i
      point = contact_point_t(a=now%a, b=now%b, id=size(surface_a%weight) + i, &
        other=surface_b%edge_number(j), length=min(surface_a%length, surface_b%length))
      call cross_edges(guest, surface_b%edge(j), -now%gap, point%length, crossing)
      if (crossing%weight <= 0.0_wp) cycle
      arm = matmul(now%turn_b, crossing%place)
      point%arm_a = arm + now%to_b
      point%arm_b = arm
      point%normal = matmul(now%turn_b, crossing%normal)
      point%depth = crossing%depth
      point%weight = crossing%weight
      if (.not. closes(now, point%arm_a, point%arm_b, point%normal, point%depth)) cycle
      call add_point(point, points)
    end do
  end subroutine add_edge_points

end module contact_surface_m
