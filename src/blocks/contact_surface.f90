!> Touches of the exact surfaces of the blocks with one another, the plane walls and the bed.
!!
!! A probe of one body (see `surface_features_m`) touches where it is inside the other; its depth is
!! its distance from the surface of the other. A sharp edge touches an edge of the other where the
!! two cross; the depth is the distance of the two lines. Both ways, so that a pair has all the
!! points that carry it. Each depth has a fixed weight: the elastic energy is a function of
!! position. Spheres touch as spheres, at one point.
!!
!! Pairs of bodies keep a list of the features that may touch until they have moved against one
!! another by a skin. What comes out, and its order, do not depend on when the list was made.
module contact_surface_m
  use kinds_m, only: wp
  use growing_m, only: ensure_room
  use vectors_m, only: norm, rotation_matrix
  use rigid_body_m, only: blocks_t
  use walls_m, only: walls_t
  use bed_m, only: bed_t, bed_partner, bed_place, bed_is_near, bed_distance
  use neighbours_m, only: pair_list_t, near_pairs
  use touches_m, only: touch_t, touches_t, ensure_touches, add_touch
  use surface_features_m, only: surface_t, surface_init, near_list_t, gather_probes, gather_edges, &
    gather_facets, nearest_on_surface, search_surface, least_distance, segment_distance2, nowhere
  use edge_crossing_m, only: edge_t, crossing_t, cross_edges, turn_before, way_apart, &
    weight_slope
  implicit none
  private
  public :: contact_surface_t, contact_surface_init, find_surface_touches

  !> Probes of one body near the other, and the features of the other they may touch.
  type :: probes_near_t
    integer :: n = 0
    integer, allocatable :: probe(:)
    real(wp), allocatable :: away(:)                        !! (n) from the other body [m]
    integer, allocatable :: facet_first(:), edge_first(:)   !! (n + 1) into the next two
    integer :: n_facets = 0, n_edges = 0
    integer, allocatable :: facet(:), edge(:)
  end type probes_near_t

  !> Poses of a pair of bodies.
  type :: poses_t
    real(wp) :: x_a(3) = 0.0_wp, x_b(3) = 0.0_wp, q_a(4) = 0.0_wp, q_b(4) = 0.0_wp
  end type poses_t

  !> What may touch of a pair of bodies a > b, and the poses at which that was found.
  !!
  !! From the lists at the end those that are near enough now are packed into one short list, which
  !! is all that is read in most substeps: for each probe of b, then of a, its number, the numbers
  !! of facets and of edges of the other body that may be nearest to it, and these; then two edges
  !! for each crossing.
  type :: pair_t
    integer :: a = 0, b = 0
    real(wp) :: shift(3) = 0.0_wp                !! to the image of b near a [m]
    type(poses_t) :: when_chosen                 !! poses of the short list
    real(wp) :: close_until = -1.0_wp            !! way and gap since then for which it holds [m]
    real(wp) :: left = -1.0_wp                   !! way since then for which the lists hold [m]
    integer :: n_close_b = 0, n_close_a = 0, n_close_edges = 0
    integer :: close_a = 1, close_edges = 1      !! begin of these parts of the short list
    integer, allocatable :: close(:)
    type(poses_t) :: when_listed                 !! poses of the lists
    real(wp) :: valid = -1.0_wp                  !! way since then for which they hold [m]
    type(probes_near_t) :: of_a, of_b
    integer :: n_crossings = 0
    integer, allocatable :: edge_a(:), edge_b(:) !! sorted by edge of a, then of b
    real(wp), allocatable :: away(:)             !! way before the two may cross [m]
  end type pair_t

  !> How far to look for features, and the lists of the search.
  type :: search_t
    real(wp) :: skin = 0.0_wp                    !! least way before lists are renewed [m]
    real(wp) :: lasting = 0.0_wp                 !! time that lists of fast bodies last [s]
    real(wp) :: ahead = 0.0_wp                   !! longest way of a touch that comes soon [m]
    type(near_list_t) :: guests, hosts, facets, edges
  end type search_t

  type :: contact_surface_t
    type(surface_t), allocatable :: surface(:)   !! (shapes)
    real(wp), allocatable :: reach(:)            !! (bodies) [m]
    real(wp) :: smallest = 0.0_wp                !! smallest d_s of eq. (6): limits the substep [m]
    type(search_t) :: search
    real(wp) :: wide_skin = 0.0_wp               !! the same for the list of pairs [m]
    real(wp) :: clear = 0.0_wp                   !! way of pairs that are not in it to touch [m]
    type(pair_list_t) :: near                    !! pairs of bodies whose bounding spheres meet
    integer, allocatable :: slot(:)              !! (near%n) place of each in `pairs`
    type(pair_t), allocatable :: pairs(:)
    logical, allocatable :: taken(:)             !! (size of pairs)
    type(pair_t), allocatable :: with_bed(:)     !! (bodies) each with the bed
    !> Bodies and poses of the list of pairs.
    logical :: listed = .false.
    logical, allocatable :: present(:)
    real(wp), allocatable :: x(:, :), q(:, :)
    real(wp), allocatable :: turn(:, :, :)       !! (3, 3, bodies) body to space
    integer, allocatable :: old_slot(:), old_a(:), old_b(:)   !! work
  end type contact_surface_t

  real(wp), parameter :: skin_share = 0.2_wp     !! least skin over the smallest d_s
  real(wp), parameter :: most_skin = 4.0_wp      !! largest skin over the least
  integer, parameter :: lasting_substeps = 10    !! that lists of fast bodies last
  real(wp), parameter :: wide_share = 0.2_wp     !! skin of the pairs over the largest reach

contains

  !> Make the features of all shapes and size the lists.
  subroutine contact_surface_init(courant_max, longest_substep, blocks, self)
    real(wp), intent(in) :: courant_max   !! C_s of eq. (6): bodies move less in a substep, over d_s
    real(wp), intent(in) :: longest_substep   !! [s]
    type(blocks_t), intent(in) :: blocks
    type(contact_surface_t), intent(out) :: self
    integer :: s, b

    allocate (self%surface(size(blocks%shapes)))
    do s = 1, size(blocks%shapes)
      call surface_init(blocks%shapes(s), self%surface(s))
    end do
    allocate (self%reach(blocks%n), self%present(blocks%n))
    allocate (self%x(3, blocks%n), self%q(4, blocks%n), self%turn(3, 3, blocks%n), source=0.0_wp)
    allocate (self%pairs(0), self%taken(0), self%with_bed(blocks%n))
    self%smallest = huge(1.0_wp)
    do b = 1, blocks%n
      self%reach(b) = self%surface(blocks%shape(b))%reach
      self%smallest = min(self%smallest, self%surface(blocks%shape(b))%length)
      self%with_bed(b)%a = b
      self%with_bed(b)%b = bed_partner
    end do
    if (blocks%n == 0) return
    self%search%skin = skin_share*self%smallest
    self%search%lasting = real(lasting_substeps, wp)*longest_substep
    self%search%ahead = courant_max*self%smallest
    self%wide_skin = max(wide_share*maxval(self%reach), 2*self%search%ahead)
    self%clear = 0.5_wp*self%wide_skin
  end subroutine contact_surface_init

  !> All touches at the present poses, but for those between bodies that are still, and those
  !! (depth <= 0) that may come within a time `ahead`.
  subroutine find_surface_touches(walls, blocks, ahead, self, touches)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(in) :: ahead   !! [s]
    type(contact_surface_t), intent(inout) :: self
    type(touches_t), intent(inout) :: touches
    integer :: a, b, p, w

    do b = 1, blocks%n
      if (blocks%present(b)) self%turn(:, :, b) = rotation_matrix(blocks%q(:, b))
    end do
    if (pairs_may_be_missing(self, blocks)) call list_pairs(walls, blocks, self)
    touches%n = 0
    p = 1
    do a = 1, blocks%n
      if (.not. blocks%present(a)) cycle
      if (.not. (blocks%fixed(a) .or. blocks%still(a))) then
        if (walls%bed%there) call touch_bed(walls%bed, blocks, a, ahead, self, touches)
        do w = 1, walls%n
          call touch_wall(walls, blocks, a, w, ahead, self, touches)
        end do
      end if
      do while (p <= self%near%n)
        if (self%near%a(p) /= a) exit
        b = self%near%b(p)
        if (.not. ((blocks%fixed(a) .and. blocks%fixed(b)) &
                   .or. (blocks%still(a) .and. blocks%still(b)))) then
          call touch_pair(blocks, ahead, self%reach, self%turn, self%surface, self%search, &
            self%pairs(self%slot(p)), touches)
        end if
        p = p + 1
      end do
    end do
  end subroutine find_surface_touches

  !> Whether a pair may have come near that is not in the list.
  pure function pairs_may_be_missing(self, blocks) result(yes)
    type(contact_surface_t), intent(in) :: self
    type(blocks_t), intent(in) :: blocks
    logical :: yes
    integer :: b

    yes = .true.
    if (.not. self%listed) return
    do b = 1, blocks%n
      if (blocks%present(b) .neqv. self%present(b)) return
      if (.not. blocks%present(b)) cycle
      if (norm(blocks%x(:, b) - self%x(:, b)) > 0.5_wp*(self%wide_skin - self%clear)) return
    end do
    yes = .false.
  end function pairs_may_be_missing

  !> List the pairs of bodies whose bounding spheres may meet before a body has moved far; pairs
  !! that were listed before keep their place.
  subroutine list_pairs(walls, blocks, self)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    type(contact_surface_t), intent(inout) :: self
    integer :: p, m, n_old, place

    n_old = self%near%n
    call ensure_room(n_old, self%old_slot)
    call ensure_room(n_old, self%old_a)
    call ensure_room(n_old, self%old_b)
    if (n_old > 0) then
      self%old_slot(:n_old) = self%slot(:n_old)
      self%old_a(:n_old) = self%near%a(:n_old)
      self%old_b(:n_old) = self%near%b(:n_old)
    end if
    call near_pairs(blocks%x, self%reach, blocks%present, walls%period, self%wide_skin, self%near)
    call ensure_room(self%near%n, self%slot)
    self%taken = .false.
    m = 1
    do p = 1, self%near%n
      self%slot(p) = 0
      do while (m <= n_old)
        if (self%old_a(m) > self%near%a(p)) exit
        if (self%old_a(m) == self%near%a(p) .and. self%old_b(m) >= self%near%b(p)) exit
        m = m + 1
      end do
      if (m > n_old) cycle
      if (self%old_a(m) /= self%near%a(p) .or. self%old_b(m) /= self%near%b(p)) cycle
      self%slot(p) = self%old_slot(m)
      self%taken(self%slot(p)) = .true.
    end do
    place = 1
    do p = 1, self%near%n
      if (self%slot(p) == 0) then
        do while (place <= size(self%taken))
          if (.not. self%taken(place)) exit
          place = place + 1
        end do
        call reserve_pairs(place, self)
        self%taken(place) = .true.
        self%slot(p) = place
        self%pairs(place)%a = self%near%a(p)
        self%pairs(place)%b = self%near%b(p)
        call forget(self%pairs(place))
      end if
      associate (pair => self%pairs(self%slot(p)))
        if (any(abs(pair%shift - self%near%shift(:, p)) > 0.0_wp)) call forget(pair)
        pair%shift = self%near%shift(:, p)
      end associate
    end do
    self%listed = .true.
    self%present = blocks%present
    self%x = blocks%x
    self%q = blocks%q
  end subroutine list_pairs

  !> Let no list of a pair hold any more.
  pure subroutine forget(pair)
    type(pair_t), intent(inout) :: pair

    pair%valid = -1.0_wp
    pair%left = -1.0_wp
  end subroutine forget

  !> Make room for n pairs.
  subroutine reserve_pairs(n, self)
    integer, intent(in) :: n
    type(contact_surface_t), intent(inout) :: self
    type(pair_t), allocatable :: longer(:)
    logical, allocatable :: longer_taken(:)
    integer :: m

    m = size(self%pairs)
    if (n <= m) return
    allocate (longer(max(n, 2*m, 16)))
    longer(:m) = self%pairs
    call move_alloc(longer, self%pairs)
    allocate (longer_taken(size(self%pairs)), source=.false.)
    longer_taken(:m) = self%taken
    call move_alloc(longer_taken, self%taken)
  end subroutine reserve_pairs

  !> Touches of body a and wall w: its corners, or its lowest point where it is a sphere.
  subroutine touch_wall(walls, blocks, a, w, ahead, self, touches)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: a, w
    real(wp), intent(in) :: ahead   !! [s]
    type(contact_surface_t), intent(in) :: self
    type(touches_t), intent(inout) :: touches
    real(wp) :: above, gap, n(3), depth, arm(3)
    integer :: i

    above = walls%offset(w) - dot_product(walls%normal(:, w), blocks%x(:, a))
    if (above > self%reach(a) + self%search%ahead) return
    gap = ahead*(norm(blocks%v(:, a)) + norm(blocks%omega(:, a))*self%reach(a))
    associate (surface => self%surface(blocks%shape(a)), turn => self%turn(:, :, a))
      if (above > self%reach(a) + gap) return
      n = matmul(walls%normal(:, w), turn)
      call ensure_touches(touches%n + max(1, surface%n_corners), touches)
      if (surface%ball > 0.0_wp) then
        arm = (surface%ball - 0.5_wp*(surface%ball - above))*walls%normal(:, w)
        call add_touch(touch_t(a, walls%number(w), 1, arm, [0.0_wp, 0.0_wp, 0.0_wp], &
          walls%normal(:, w), surface%ball - above, 1.0_wp, surface%length), touches)
        return
      end if
      do i = 1, surface%n_corners
        depth = dot_product(n, surface%probe(:, i)) - above
        if (depth <= -gap) cycle
        arm = matmul(turn, surface%probe(:, i))
        call add_touch(touch_t(a, walls%number(w), i, arm, [0.0_wp, 0.0_wp, 0.0_wp], &
          walls%normal(:, w), depth, surface%weight(i), surface%length), touches)
      end do
    end associate
  end subroutine touch_wall

  !> Touches of body a and the bed: corners of the bed, corners of the body, crossing edges. The
  !! points inside the faces of a body do not touch it: as on a wall, some corner always does.
  subroutine touch_bed(bed, blocks, a, ahead, self, touches)
    type(bed_t), intent(in) :: bed
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: a
    real(wp), intent(in) :: ahead   !! [s]
    type(contact_surface_t), intent(inout) :: self
    type(touches_t), intent(inout) :: touches
    real(wp), parameter :: no_turn(3, 3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, &
      0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
    type(poses_t) :: now
    real(wp) :: x(3), speed

    x = bed_place(bed, blocks%x(:, a))
    now%x_a = x
    now%q_a = blocks%q(:, a)
    speed = norm(blocks%v(:, a)) + norm(blocks%omega(:, a))*self%reach(a)
    call touch_features(self%turn(:, :, a), no_turn, -x, now, speed, ahead, &
      self%surface(blocks%shape(a)), bed%surface, self%search, self%with_bed(a), touches, bed)
  end subroutine touch_bed

  !> List what may touch of a body and the bed before the body has moved by a skin.
  subroutine list_bed(bed, turn, surface, speed, search, pair)
    type(bed_t), intent(in) :: bed
    real(wp), intent(in) :: turn(3, 3)           !! body to space
    type(surface_t), intent(in) :: surface       !! of the body
    real(wp), intent(in) :: speed                !! of any point of the body, at most [m/s]
    type(search_t), intent(inout) :: search
    type(pair_t), intent(inout) :: pair
    real(wp) :: margin, place(3), distance, outward(3)
    integer :: i

    pair%of_a%n = 0
    pair%of_b%n = 0
    pair%n_crossings = 0
    pair%valid = skin_for(speed, search)
    margin = pair%valid + search%ahead
    associate (x => pair%when_listed%x_a, reach => surface%reach + margin)
      if (.not. bed_is_near(bed, x - reach, x + reach)) return
      call list_probes(transpose(turn), -matmul(x, turn), pair%valid, bed%surface, surface, &
        search, pair%of_b)
      call list_crossings(turn, x, surface, bed%surface, search, pair)
    end associate
    pair%of_a%n_facets = 0
    pair%of_a%n_edges = 0
    margin = margin + surface%ball
    do i = 1, merge(1, surface%n_corners, surface%ball > 0.0_wp)
      place = pair%when_listed%x_a + matmul(turn, surface%probe(:, i))
      call bed_distance(bed, place, margin, max(margin, surface%reach), search%facets, &
        search%edges, distance, outward)
      if (distance > margin .or. all(abs(outward) <= 0.0_wp)) cycle
      call append_near(bed%surface, pair%valid, surface%ball, i, place, distance, search, pair%of_a)
    end do
    call end_lists(pair%of_a)
  end subroutine list_bed

  !> Touches of a pair of bodies: probes of b, probes of a, crossing edges.
  subroutine touch_pair(blocks, ahead, reach, turns, surface, search, pair, touches)
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(in) :: ahead                !! [s]
    real(wp), intent(in) :: reach(:)             !! (bodies) [m]
    real(wp), intent(in) :: turns(:, :, :)       !! (3, 3, bodies) body to space
    type(surface_t), intent(in) :: surface(:)    !! (shapes)
    type(search_t), intent(inout) :: search
    type(pair_t), intent(inout) :: pair
    type(touches_t), intent(inout) :: touches
    type(poses_t) :: now
    real(wp) :: to_b(3), speed
    integer :: a, b

    a = pair%a
    b = pair%b
    speed = norm(blocks%v(:, a) - blocks%v(:, b)) &
      + norm(blocks%omega(:, a))*reach(a) + norm(blocks%omega(:, b))*reach(b)
    now = poses_t(blocks%x(:, a), blocks%x(:, b), blocks%q(:, a), blocks%q(:, b))
    to_b = now%x_b + pair%shift - now%x_a
    associate (surface_a => surface(blocks%shape(a)), surface_b => surface(blocks%shape(b)))
      if (surface_a%ball > 0.0_wp .and. surface_b%ball > 0.0_wp) then
        call touch_balls(a, b, to_b, ahead*speed, surface_a, surface_b, touches)
      else
        call touch_features(turns(:, :, a), turns(:, :, b), to_b, now, speed, ahead, surface_a, &
          surface_b, search, pair, touches)
      end if
    end associate
  end subroutine touch_pair

  !> Touches of a pair of bodies, or of body a and the bed: probes of b, probes of a, crossing
  !! edges. They come from the short list of the pair; this and the lists it comes from are renewed
  !! first where they no longer hold.
  subroutine touch_features(turn_a, turn_b, to_b, now, speed, ahead, surface_a, surface_b, &
      search, pair, touches, bed)
    real(wp), intent(in) :: turn_a(3, 3), turn_b(3, 3)   !! body axes to space
    real(wp), intent(in) :: to_b(3)           !! from the centre of a to that of b, space [m]
    type(poses_t), intent(in) :: now
    real(wp), intent(in) :: speed             !! of any two points, at most [m/s]
    real(wp), intent(in) :: ahead             !! [s]
    type(surface_t), intent(in) :: surface_a, surface_b
    type(search_t), intent(inout) :: search
    type(pair_t), intent(inout) :: pair
    type(touches_t), intent(inout) :: touches
    type(bed_t), intent(in), optional :: bed  !! where it is b
    real(wp) :: turn(3, 3), x(3)              ! axes of a to those of b: turn.p + x
    real(wp) :: gap, way
    logical :: holds

    gap = ahead*speed
    holds = short_list_holds(now, gap, surface_a%reach, surface_b%reach, pair)
    if (holds .and. n_close(pair) == 0) return
    turn = matmul(transpose(turn_b), turn_a)
    x = matmul(-to_b, turn_b)
    if (.not. holds) then
      way = way_between(pair%when_listed, now, surface_a%reach, surface_b%reach)
      if (way > pair%valid) then
        pair%when_listed = now
        if (present(bed)) then
          call list_bed(bed, turn_a, surface_a, speed, search, pair)
        else
          call list_features(turn, x, to_b, turn_a, surface_a, surface_b, speed, search, pair)
        end if
        way = 0.0_wp
      end if
      call know_close(turn, x, to_b, turn_a, now, gap, way, search%skin, surface_a, surface_b, pair)
      if (n_close(pair) == 0) return
    end if
    call ensure_touches(touches%n + n_close(pair), touches)
    call touch_probes(.false., pair%a, pair%b, turn_a, to_b, transpose(turn), &
      matmul(to_b, turn_a), gap, surface_b, surface_a, pair%n_close_b, pair%close, touches)
    call touch_probes(.true., pair%a, pair%b, turn_b, to_b, turn, x, gap, surface_a, surface_b, &
      pair%n_close_a, pair%close(pair%close_a:), touches)
    call touch_edges(turn_b, to_b, turn, x, gap, surface_a, surface_b, pair, touches)
  end subroutine touch_features

  !> Number of features in the short list of a pair, and of its touches at most.
  pure function n_close(pair) result(n)
    type(pair_t), intent(in) :: pair
    integer :: n

    n = pair%n_close_b + pair%n_close_a + pair%n_close_edges
  end function n_close

  !> Whether the short list of a pair still holds.
  pure function short_list_holds(now, gap, reach_a, reach_b, pair) result(yes)
    type(poses_t), intent(in) :: now
    real(wp), intent(in) :: gap               !! still taken as a touch [m]
    real(wp), intent(in) :: reach_a, reach_b  !! of the bodies [m]
    type(pair_t), intent(in) :: pair
    logical :: yes
    real(wp) :: way

    way = way_between(pair%when_chosen, now, reach_a, reach_b)
    yes = way <= pair%left .and. way + gap <= pair%close_until
  end function short_list_holds

  !> Choose from the lists of a pair what may touch before the bodies have moved a little.
  subroutine know_close(turn, x, to_b, turn_a, now, gap, way, skin, surface_a, surface_b, pair)
    real(wp), intent(in) :: turn(3, 3), x(3)  !! axes of a to those of b: turn.p + x [-], [m]
    real(wp), intent(in) :: to_b(3)           !! from the centre of a to that of b, space [m]
    real(wp), intent(in) :: turn_a(3, 3)      !! axes of a to space
    type(poses_t), intent(in) :: now
    real(wp), intent(in) :: gap               !! still taken as a touch [m]
    real(wp), intent(in) :: way               !! of the bodies since the lists were made [m]
    real(wp), intent(in) :: skin              !! least way before lists are renewed [m]
    type(surface_t), intent(in) :: surface_a, surface_b
    type(pair_t), intent(inout) :: pair
    real(wp), parameter :: share = 0.02_wp    !! of a skin: way for which the short list holds,
    real(wp), parameter :: lasting = 10.0_wp  !! or such a multiple of the gap
    integer :: n

    pair%when_chosen = now
    pair%left = pair%valid - way
    pair%close_until = gap + max(share*skin, lasting*gap)
    n = 0
    call choose_probes(transpose(turn), matmul(to_b, turn_a), way, pair%close_until, surface_b, &
      surface_a, pair%of_b, n, pair%n_close_b, pair%close)
    pair%close_a = n + 1
    call choose_probes(turn, x, way, pair%close_until, surface_a, surface_b, pair%of_a, n, &
      pair%n_close_a, pair%close)
    pair%close_edges = n + 1
    call choose_edges(turn, x, way, surface_a, surface_b, n, pair)
    call ensure_room(n + 1, pair%close)
    ! without any feature in the lists nothing comes near as long as these hold
    if (pair%of_a%n + pair%of_b%n + pair%n_crossings == 0) pair%close_until = huge(1.0_wp)
  end subroutine know_close

  !> Append to the short list those probes of a guest, with the features of the host, that may touch
  !! before the bodies have moved by a margin.
  subroutine choose_probes(turn, x, way, margin, guest, host, list, n, n_chosen, chosen)
    real(wp), intent(in) :: turn(3, 3), x(3)   !! guest to host axes: turn.p + x [-], [m]
    real(wp), intent(in) :: way                !! since the lists were made [m]
    real(wp), intent(in) :: margin             !! [m]
    type(surface_t), intent(in) :: guest, host
    type(probes_near_t), intent(in) :: list
    integer, intent(inout) :: n                !! length of the short list
    integer, intent(out) :: n_chosen
    integer, allocatable, intent(inout) :: chosen(:)
    real(wp) :: place(3), distance, outward(3), reach
    integer :: m, at

    n_chosen = 0
    do m = 1, list%n
      if (list%away(m) > way + margin) cycle
      associate (facets => list%facet(list%facet_first(m):list%facet_first(m + 1) - 1), &
        edges => list%edge(list%edge_first(m):list%edge_first(m + 1) - 1))
        place = x + matmul(turn, guest%probe(:, list%probe(m)))
        call nearest_on_surface(host, place, facets, edges, distance, outward)
        if (distance - guest%ball > margin .and. distance < nowhere) cycle
        reach = abs(distance) + 2*margin
        at = n + 1
        n = n + 3
        call ensure_room(n, chosen)
        chosen(at) = list%probe(m)
        call append_facets(host, facets, place, reach, n, chosen)
        chosen(at + 1) = n - at - 2
        call append_edges(host, edges, place, reach, n, chosen)
        chosen(at + 2) = n - at - 2 - chosen(at + 1)
        n_chosen = n_chosen + 1
      end associate
    end do
  end subroutine choose_probes

  !> Append to the short list those pairs of edges that may cross while it holds.
  subroutine choose_edges(turn, x, way, surface_a, surface_b, n, pair)
    real(wp), intent(in) :: turn(3, 3), x(3)   !! axes of a to those of b: turn.p + x [-], [m]
    real(wp), intent(in) :: way                !! since the lists were made [m]
    type(surface_t), intent(in) :: surface_a, surface_b
    integer, intent(inout) :: n                !! length of the short list
    type(pair_t), intent(inout) :: pair
    type(edge_t) :: guest
    real(wp) :: margin
    integer :: m, last

    pair%n_close_edges = 0
    margin = pair%close_until
    last = 0
    do m = 1, pair%n_crossings
      if (pair%away(m) > way + margin) cycle
      if (pair%edge_a(m) /= last) guest = edge_in_axes(surface_a%edge(pair%edge_a(m)), turn, x)
      last = pair%edge_a(m)
      if (way_to_crossing(guest, surface_b%edge(pair%edge_b(m)), margin, &
        margin + min(surface_a%length, surface_b%length), &
        min(surface_a%reach, surface_b%reach)) > margin) cycle
      call ensure_room(n + 2, pair%close)
      pair%close(n + 1) = pair%edge_a(m)
      pair%close(n + 2) = pair%edge_b(m)
      n = n + 2
      pair%n_close_edges = pair%n_close_edges + 1
    end do
  end subroutine choose_edges

  !> Way that two bodies may move before two edges of theirs may cross; `nowhere` where they cannot
  !! before the bodies have moved by a margin [m].
  pure function way_to_crossing(guest, host, margin, reach, arm) result(way)
    type(edge_t), intent(in) :: guest, host   !! in the same axes
    real(wp), intent(in) :: margin            !! [m]
    real(wp), intent(in) :: reach             !! distance from which edges cannot come to cross [m]
    real(wp), intent(in) :: arm               !! reach of the smaller body: it turns by way/arm [m]
    real(wp) :: way
    real(wp) :: angle

    way = nowhere
    if (segment_distance2(guest%start, guest%along, guest%extent, host%start, host%along, &
                          host%extent) > reach**2) return
    angle = turn_before(guest, host)
    if (angle >= margin/arm) return
    way = max(way_apart(guest, host, margin/arm), angle*arm)
  end function way_to_crossing

  !> Whether a facet may be the nearest to a place, within reach of it.
  pure function facet_is_near(host, f, place, reach) result(yes)
    type(surface_t), intent(in) :: host
    integer, intent(in) :: f
    real(wp), intent(in) :: place(3), reach   !! body axes [m]
    logical :: yes
    integer :: c

    yes = abs(dot_product(host%normal(:, f), place) - host%offset(f)) <= reach
    if (.not. yes) return
    do c = host%side(f), host%side(f + 1) - 1
      yes = dot_product(host%side_normal(:, c), place) >= host%side_offset(c) - reach
      if (.not. yes) return
    end do
  end function facet_is_near

  !> Whether an edge is within reach of a place.
  pure function edge_is_near(edge, place, reach) result(yes)
    type(edge_t), intent(in) :: edge
    real(wp), intent(in) :: place(3), reach   !! body axes [m]
    logical :: yes
    real(wp) :: d(3)

    d = place - edge%start
    d = d - min(max(dot_product(d, edge%along), 0.0_wp), edge%extent)*edge%along
    yes = dot_product(d, d) <= reach**2
  end function edge_is_near

  !> Way by which bodies may move before their lists are renewed: wider for fast bodies [m].
  pure function skin_for(speed, search) result(skin)
    real(wp), intent(in) :: speed                 !! of any two points, at most [m/s]
    type(search_t), intent(in) :: search
    real(wp) :: skin

    skin = min(max(search%skin, speed*search%lasting), most_skin*search%skin)
  end function skin_for

  !> Largest way that points of two bodies move against one another from one pair of poses to
  !! another [m].
  pure function way_between(before, now, reach_a, reach_b) result(way)
    type(poses_t), intent(in) :: before, now
    real(wp), intent(in) :: reach_a, reach_b   !! of the bodies [m]
    real(wp) :: way

    ! a turn by phi: |dq| = 2 sin(phi/4), and a point at distance r moves 4 r sin(phi/4) at most
    way = norm((now%x_a - before%x_a) - (now%x_b - before%x_b)) &
      + 2*reach_a*norm(now%q_a - before%q_a) + 2*reach_b*norm(now%q_b - before%q_b)
  end function way_between

  !> The one touch of two spheres.
  subroutine touch_balls(a, b, to_b, gap, surface_a, surface_b, touches)
    integer, intent(in) :: a, b
    real(wp), intent(in) :: to_b(3), gap   !! from the centre of a to that of b; [m]
    type(surface_t), intent(in) :: surface_a, surface_b
    type(touches_t), intent(inout) :: touches
    real(wp) :: distance, depth, normal(3), arm(3)

    distance = norm(to_b)
    depth = surface_a%ball + surface_b%ball - distance
    if (depth <= -gap) return
    normal = to_b/max(distance, tiny(1.0_wp))
    arm = (surface_a%ball - 0.5_wp*depth)*normal
    call ensure_touches(touches%n + 1, touches)
    call add_touch(touch_t(a, b, 1, arm, arm - to_b, normal, depth, 1.0_wp, &
      min(surface_a%length, surface_b%length)), touches)
  end subroutine touch_balls

  !> Touches of the listed probes of one body (the guest) with the surface of the other (the host).
  subroutine touch_probes(guest_is_a, a, b, turn_host, to_b, turn, x, gap, guest, host, n, list, &
      touches)
    logical, intent(in) :: guest_is_a
    integer, intent(in) :: a, b
    real(wp), intent(in) :: turn_host(3, 3)   !! host axes to space
    real(wp), intent(in) :: to_b(3)           !! from the centre of a to that of b, space [m]
    real(wp), intent(in) :: turn(3, 3), x(3)  !! guest to host axes: turn.p + x [-], [m]
    real(wp), intent(in) :: gap               !! still taken as a touch [m]
    type(surface_t), intent(in) :: guest, host
    integer, intent(in) :: n                  !! probes
    integer, intent(in) :: list(:)            !! their part of the short list, see `pair_t`
    type(touches_t), intent(inout) :: touches
    real(wp) :: place(3), distance, depth, outward(3), arm(3)
    integer :: c, m, i, edges, next

    next = 1
    do c = 1, n
      m = next
      i = list(m)
      edges = m + 3 + list(m + 1)
      next = edges + list(m + 2)
      place = x + turn(:, 1)*guest%probe(1, i) + turn(:, 2)*guest%probe(2, i) &
        + turn(:, 3)*guest%probe(3, i)
      call nearest_on_surface(host, place, list(m + 3:edges - 1), list(edges:next - 1), distance, &
        outward)
      depth = guest%ball - distance
      if (depth <= -gap) cycle
      arm = matmul(turn_host, place - (guest%ball - 0.5_wp*depth)*outward)
      outward = matmul(turn_host, outward)
      if (guest_is_a) then
        call add_touch(touch_t(a, b, i, arm + to_b, arm, -outward, depth, guest%weight(i), &
          min(guest%length, host%length)), touches)
      else
        call add_touch(touch_t(a, b, i - size(guest%weight) - 1, arm, arm - to_b, outward, depth, &
          guest%weight(i), min(guest%length, host%length)), touches)
      end if
    end do
  end subroutine touch_probes

  !> Touches of the listed pairs of edges that cross.
  subroutine touch_edges(turn_b, to_b, turn, x, gap, surface_a, surface_b, pair, touches)
    real(wp), intent(in) :: turn_b(3, 3)      !! axes of b to space
    real(wp), intent(in) :: to_b(3)           !! from the centre of a to that of b, space [m]
    real(wp), intent(in) :: turn(3, 3), x(3)  !! axes of a to those of b: turn.p + x [-], [m]
    real(wp), intent(in) :: gap               !! still taken as a touch [m]
    type(surface_t), intent(in) :: surface_a, surface_b
    type(pair_t), intent(in) :: pair
    type(touches_t), intent(inout) :: touches
    type(edge_t) :: guest
    type(crossing_t) :: crossing
    real(wp) :: length, arm(3), with_shift(3), with_turn(3)
    integer :: m, i, j, last

    length = min(surface_a%length, surface_b%length)
    last = 0
    do m = pair%close_edges, pair%close_edges + 2*pair%n_close_edges - 1, 2
      i = pair%close(m)
      j = pair%close(m + 1)
      if (i /= last) guest = edge_in_axes(surface_a%edge(i), turn, x)
      last = i
      call cross_edges(guest, surface_b%edge(j), -gap, length, crossing)
      if (crossing%weight <= 0.0_wp) cycle
      arm = matmul(turn_b, crossing%place)
      call add_touch(touch_t(pair%a, pair%b, size(surface_a%weight) + i, arm + to_b, arm, &
        matmul(turn_b, crossing%normal), crossing%depth, crossing%weight, length), touches)
      if (crossing%weight >= 1.0_wp .or. crossing%depth <= 0.0_wp) cycle
      call weight_slope(guest, surface_b%edge(j), crossing, with_shift, with_turn)
      touches%item(touches%n)%weight_shift = matmul(turn_b, with_shift)
      touches%item(touches%n)%weight_turn = matmul(turn_b, with_turn)
    end do
  end subroutine touch_edges

  !> An edge seen from other axes.
  pure function edge_in_axes(edge, turn, x) result(seen)
    type(edge_t), intent(in) :: edge
    real(wp), intent(in) :: turn(3, 3), x(3)  !! the other axes: turn.p + x [-], [m]
    type(edge_t) :: seen

    seen%start = x + matmul(turn, edge%start)
    seen%along = matmul(turn, edge%along)
    seen%extent = edge%extent
    seen%into = matmul(turn, edge%into)
  end function edge_in_axes

  !> List what may touch of a pair before the bodies have moved by a skin: wider for fast bodies.
  subroutine list_features(turn, x, to_b, turn_a, a, b, speed, search, pair)
    real(wp), intent(in) :: turn(3, 3), x(3)  !! axes of a to those of b: turn.p + x [-], [m]
    real(wp), intent(in) :: to_b(3)           !! from the centre of a to that of b, space [m]
    real(wp), intent(in) :: turn_a(3, 3)      !! axes of a to space
    type(surface_t), intent(in) :: a, b
    real(wp), intent(in) :: speed                !! of any two points, at most [m/s]
    type(search_t), intent(inout) :: search
    type(pair_t), intent(inout) :: pair
    real(wp) :: apart, skin

    pair%of_a%n = 0
    pair%of_b%n = 0
    pair%n_crossings = 0
    apart = norm(to_b) - a%reach - b%reach - search%ahead
    skin = skin_for(speed, search)
    pair%valid = max(apart, skin)
    if (apart > skin) return
    call list_probes(transpose(turn), matmul(to_b, turn_a), skin, b, a, search, pair%of_b)
    call list_probes(turn, x, skin, a, b, search, pair%of_a)
    call list_crossings(turn, x, a, b, search, pair)
  end subroutine list_features

  !> Probes of the guest near the surface of the host or inside, each with the facets and edges that
  !! may be nearest to it before the bodies have moved by the skin.
  subroutine list_probes(turn, x, skin, guest, host, search, list)
    real(wp), intent(in) :: turn(3, 3), x(3)   !! guest to host axes: turn.p + x [-], [m]
    real(wp), intent(in) :: skin               !! [m]
    type(surface_t), intent(in) :: guest, host
    type(search_t), intent(inout) :: search
    type(probes_near_t), intent(inout) :: list
    real(wp) :: margin, place(3), distance, outward(3), low(3), high(3)
    integer :: m

    list%n_facets = 0
    list%n_edges = 0
    if (host%ball > 0.0_wp) return   ! its own centre is the probe
    margin = skin + search%ahead + guest%ball
    call box_in_axes(transpose(turn), -matmul(x, turn), host%low - margin, host%high + margin, &
      low, high)
    call gather_probes(guest, low, high, search%guests)
    do m = 1, search%guests%n
      place = x + matmul(turn, guest%probe(:, search%guests%item(m)))
      if (any(place < host%low - margin) .or. any(place > host%high + margin)) cycle
      if (least_distance(host, place) > margin) cycle
      call search_surface(host, place, margin, search%facets, search%edges, distance, outward)
      if (distance > margin) cycle
      call append_near(host, skin, guest%ball, search%guests%item(m), place, distance, search, list)
    end do
    call end_lists(list)
  end subroutine list_probes

  !> Append a probe with the facets and edges that may be nearest to it before the bodies have moved
  !! by the skin.
  subroutine append_near(host, skin, ball, probe, place, distance, search, list)
    type(surface_t), intent(in) :: host
    real(wp), intent(in) :: skin, ball           !! radius if the guest is a sphere, else 0 [m]
    integer, intent(in) :: probe
    real(wp), intent(in) :: place(3), distance   !! of the probe, host axes; from the surface [m]
    type(search_t), intent(inout) :: search
    type(probes_near_t), intent(inout) :: list
    real(wp) :: reach

    reach = abs(distance) + 2*(skin + search%ahead)
    call gather_facets(host, place - reach, place + reach, search%facets)
    call gather_edges(host, place - reach, place + reach, search%edges)
    call append(place, reach, probe, host, search, list)
    list%away(list%n) = distance - ball
  end subroutine append_near

  !> Close the lists of facets and edges of the last probe.
  subroutine end_lists(list)
    type(probes_near_t), intent(inout) :: list

    call ensure_room(list%n + 1, list%facet_first)
    call ensure_room(list%n + 1, list%edge_first)
    list%facet_first(list%n + 1) = list%n_facets + 1
    list%edge_first(list%n + 1) = list%n_edges + 1
  end subroutine end_lists

  !> Box around a box given in other axes.
  pure subroutine box_in_axes(turn, x, low, high, new_low, new_high)
    real(wp), intent(in) :: turn(3, 3), x(3)          !! the other axes to these: turn.p + x
    real(wp), intent(in) :: low(3), high(3)           !! [m]
    real(wp), intent(out) :: new_low(3), new_high(3)  !! [m]
    real(wp) :: middle(3), half(3)

    middle = x + matmul(turn, 0.5_wp*(low + high))
    half = matmul(abs(turn), 0.5_wp*(high - low))
    new_low = middle - half
    new_high = middle + half
  end subroutine box_in_axes

  !> Append a probe with those of the gathered facets and edges that are within reach.
  subroutine append(place, reach, probe, host, search, list)
    real(wp), intent(in) :: place(3), reach   !! host axes [m]
    integer, intent(in) :: probe
    type(surface_t), intent(in) :: host
    type(search_t), intent(in) :: search
    type(probes_near_t), intent(inout) :: list

    list%n = list%n + 1
    call ensure_room(list%n, list%probe)
    call ensure_room(list%n, list%away)
    call ensure_room(list%n, list%facet_first)
    call ensure_room(list%n, list%edge_first)
    list%probe(list%n) = probe
    list%facet_first(list%n) = list%n_facets + 1
    list%edge_first(list%n) = list%n_edges + 1
    call append_facets(host, search%facets%item(:search%facets%n), place, reach, list%n_facets, &
      list%facet)
    call append_edges(host, search%edges%item(:search%edges%n), place, reach, list%n_edges, &
      list%edge)
  end subroutine append

  !> Append those of some facets that are within reach of a place to a list of n numbers.
  subroutine append_facets(host, facets, place, reach, n, list)
    type(surface_t), intent(in) :: host
    integer, intent(in) :: facets(:)
    real(wp), intent(in) :: place(3), reach   !! host axes [m]
    integer, intent(inout) :: n
    integer, allocatable, intent(inout) :: list(:)
    integer :: k

    call ensure_room(n + size(facets), list)
    do k = 1, size(facets)
      if (.not. facet_is_near(host, facets(k), place, reach)) cycle
      n = n + 1
      list(n) = facets(k)
    end do
  end subroutine append_facets

  !> Append those of some edges that are within reach of a place to a list of n numbers.
  subroutine append_edges(host, edges, place, reach, n, list)
    type(surface_t), intent(in) :: host
    integer, intent(in) :: edges(:)
    real(wp), intent(in) :: place(3), reach   !! host axes [m]
    integer, intent(inout) :: n
    integer, allocatable, intent(inout) :: list(:)
    integer :: k

    call ensure_room(n + size(edges), list)
    do k = 1, size(edges)
      if (.not. edge_is_near(host%edge(edges(k)), place, reach)) cycle
      n = n + 1
      list(n) = edges(k)
    end do
  end subroutine append_edges

  !> Pairs of convex edges that may cross before the bodies have moved by the skin.
  subroutine list_crossings(turn, x, surface_a, surface_b, search, pair)
    real(wp), intent(in) :: turn(3, 3), x(3)  !! axes of a to those of b: turn.p + x [-], [m]
    type(surface_t), intent(in) :: surface_a, surface_b
    type(search_t), intent(inout) :: search
    type(pair_t), intent(inout) :: pair
    type(edge_t) :: guest
    real(wp) :: reach, away, low(3), high(3)
    integer :: m, k, i, j

    if (surface_a%ball > 0.0_wp .or. surface_b%ball > 0.0_wp) return
    reach = pair%valid + search%ahead + min(surface_a%length, surface_b%length)
    call box_in_axes(transpose(turn), -matmul(x, turn), surface_b%low - reach, &
      surface_b%high + reach, low, high)
    call gather_edges(surface_a, low, high, search%guests)
    do m = 1, search%guests%n
      i = search%guests%item(m)
      if (i > surface_a%n_convex) exit
      guest = edge_in_axes(surface_a%edge(i), turn, x)
      low = min(guest%start, guest%start + guest%extent*guest%along) - reach
      high = max(guest%start, guest%start + guest%extent*guest%along) + reach
      if (any(low > surface_b%high) .or. any(high < surface_b%low)) cycle
      call gather_edges(surface_b, low, high, search%hosts)
      do k = 1, search%hosts%n
        j = search%hosts%item(k)
        if (j > surface_b%n_convex) exit
        away = way_to_crossing(guest, surface_b%edge(j), pair%valid, reach, &
          min(surface_a%reach, surface_b%reach))
        if (away >= nowhere) cycle
        pair%n_crossings = pair%n_crossings + 1
        call ensure_room(pair%n_crossings, pair%edge_a)
        call ensure_room(pair%n_crossings, pair%edge_b)
        call ensure_room(pair%n_crossings, pair%away)
        pair%edge_a(pair%n_crossings) = i
        pair%edge_b(pair%n_crossings) = j
        pair%away(pair%n_crossings) = away
      end do
    end do
  end subroutine list_crossings

end module contact_surface_m
