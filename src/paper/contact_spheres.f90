!> Contact points of the contact spheres of the T-type model with one another, the plane walls and
!! the bed.
!!
!! Sphere pairs closer than a skin are listed, and the list is kept until a body has moved so far
!! that others may touch. What comes out, and its order, do not depend on when the list was made.
module contact_spheres_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use vectors_m, only: norm, norms, rotation_matrix
  use tet_mesh_m, only: shape_t
  use rigid_body_m, only: blocks_t
  use walls_m, only: walls_t
  use bed_m, only: bed_t, bed_counterpart, bed_place, bed_is_near, bed_distance
  use surface_search_m, only: found_t
  use neighbours_m, only: bins_t, bins_build, pair_list_t, near_pairs
  use contact_points_m, only: contact_point_t, contact_points_t, add_point
  implicit none
  private
  public :: contact_spheres_t, contact_spheres_init, find_sphere_points

  !> The spheres of a shape in bins, to find those near a point.
  type :: sphere_set_t
    type(bins_t) :: bins
    real(wp) :: bounding_radius = 0.0_wp
      !! of the sphere about the centre of mass that holds them all [m]
    real(wp) :: largest = 0.0_wp   !! largest radius [m]
  end type sphere_set_t

  !> Spheres that may touch: entries first(p) : first(p+1)-1 belong to pair p.
  type :: candidates_t
    integer :: n_pairs = 0
    integer, allocatable :: a(:), b(:), first(:)   !! (pairs) bodies; b < 0: wall, bed
    real(wp), allocatable :: shift(:, :)           !! (3, pairs) to the image of b near a [m]
    integer :: n = 0
    integer, allocatable :: i(:), j(:)             !! (n) spheres of a and of b; 0: wall, bed
  end type candidates_t

  type :: contact_spheres_t
    real(wp) :: skin = 0.0_wp                  !! pairs nearer than this are listed [m]
    real(wp) :: unlisted_gap = 0.0_wp          !! way of pairs that are not listed to touch [m]
    real(wp) :: valid_way = 0.0_wp             !! by which bodies may move before the next list [m]
    real(wp) :: smallest = 0.0_wp              !! smallest d_s of eq. (6): limits the substep [m]
    type(sphere_set_t), allocatable :: set(:)  !! (shapes)
    real(wp), allocatable :: bounding_radius(:)   !! (bodies) [m]
    type(candidates_t) :: list
    !> Poses at which the list was made.
    logical :: listed = .false.
    logical, allocatable :: present(:), fixed(:)
    real(wp), allocatable :: x(:, :), q(:, :)
    real(wp), allocatable :: turn(:, :, :)     !! (3, 3, bodies) body to space
    type(pair_list_t) :: near
    type(found_t) :: found                     !! of the bed
  end type contact_spheres_t

contains

  !> Sort the spheres of all shapes and size the lists.
  subroutine contact_spheres_init(courant_max, blocks, self)
    real(wp), intent(in) :: courant_max   !! C_s of eq. (6): bodies move less in a substep, over d_s
    type(blocks_t), intent(in) :: blocks
    type(contact_spheres_t), intent(out) :: self
    real(wp), parameter :: share = 0.125_wp   !! of the smallest diameter: shorter lists, or fewer
    integer :: s, b

    allocate (self%set(size(blocks%shapes)))
    do s = 1, size(blocks%shapes)
      associate (shape => blocks%shapes(s))
        self%set(s)%largest = maxval(shape%sphere_radius)
        self%set(s)%bounding_radius = maxval(norms(shape%sphere_centre) + shape%sphere_radius)
        call bins_build(shape%sphere_centre, shape%sphere_centre, 2*self%set(s)%largest, &
          self%set(s)%bins)
      end associate
    end do
    allocate (self%bounding_radius(blocks%n), self%present(blocks%n), self%fixed(blocks%n))
    allocate (self%x(3, blocks%n), self%q(4, blocks%n), self%turn(3, 3, blocks%n), source=0.0_wp)
    self%smallest = huge(1.0_wp)
    do b = 1, blocks%n
      self%smallest = min(self%smallest, 2*minval(blocks%shapes(blocks%shape(b))%sphere_radius))
      self%bounding_radius(b) = self%set(blocks%shape(b))%bounding_radius
    end do
    if (blocks%n == 0) return
    self%valid_way = share*self%smallest
    self%unlisted_gap = courant_max*self%smallest
    self%skin = 2*self%valid_way + self%unlisted_gap
  end subroutine contact_spheres_init

  !> All contact points at the present poses, but for those between bodies that are still, and those
  !! (depth <= 0) that may come within a time `ahead`.
  subroutine find_sphere_points(walls, blocks, ahead, self, points)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(in) :: ahead   !! [s]
    type(contact_spheres_t), intent(inout) :: self
    type(contact_points_t), intent(inout) :: points
    real(wp) :: v(3), speed
    logical :: holds
    integer :: p, b

    holds = self%listed
    do b = 1, blocks%n
      if (blocks%present(b)) self%turn(:, :, b) = rotation_matrix(blocks%q(:, b))
      if (holds) holds = (blocks%present(b) .eqv. self%present(b)) &
        .and. (blocks%fixed(b) .eqv. self%fixed(b))
      ! a turn by phi: |dq| = 2 sin(phi/4), and a point at distance r moves 4 r sin(phi/4) at most
      if (holds .and. blocks%present(b)) holds = .not. norm(blocks%x(:, b) - self%x(:, b)) &
        + 2*self%bounding_radius(b)*norm(blocks%q(:, b) - self%q(:, b)) > self%valid_way
    end do
    if (.not. holds) call make_list(walls, blocks, self)
    points%n = 0
    do p = 1, self%list%n_pairs
      associate (a => self%list%a(p), c => self%list%b(p))
        v = blocks%v(:, a)
        speed = norm(blocks%omega(:, a))*self%bounding_radius(a)   ! of two points, at most
        if (c < 0) then
          if (blocks%still(a)) cycle
        else
          if (blocks%still(a) .and. blocks%still(c)) cycle
          v = v - blocks%v(:, c)
          speed = speed + norm(blocks%omega(:, c))*self%bounding_radius(c)
        end if
        speed = speed + norm(v)
        call add_points(walls, blocks, p, ahead*speed, self, points)
      end associate
    end do
  end subroutine find_sphere_points

  !> List the sphere pairs that may touch before a body has moved by half the skin.
  subroutine make_list(walls, blocks, self)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    type(contact_spheres_t), intent(inout) :: self
    integer :: a, p, w

    self%list%n_pairs = 0
    self%list%n = 0
    call near_pairs(blocks%x, self%bounding_radius, blocks%present, walls%period, self%skin, &
      self%near)
    p = 1
    do a = 1, blocks%n
      if (.not. blocks%present(a)) cycle
      if (.not. blocks%fixed(a)) then
        if (walls%bed%there) call list_bed(walls%bed, blocks, a, self)
        do w = 1, walls%n
          call list_wall(walls, blocks, a, w, self)
        end do
      end if
      do while (p <= self%near%n)
        if (self%near%a(p) /= a) exit
        if (.not. (blocks%fixed(a) .and. blocks%fixed(self%near%b(p)))) then
          call list_body(blocks, p, self)
        end if
        p = p + 1
      end do
    end do
    call ensure_capacity(self%list%n_pairs + 1, self%list%first)
    self%list%first(self%list%n_pairs + 1) = self%list%n + 1
    self%listed = .true.
    self%present = blocks%present
    self%fixed = blocks%fixed
    self%x = blocks%x
    self%q = blocks%q
  end subroutine make_list

  !> Begin a pair of bodies, or of a body and a wall.
  subroutine add_pair(a, b, shift, list)
    integer, intent(in) :: a, b
    real(wp), intent(in) :: shift(3)   !! to the image of b near a [m]
    type(candidates_t), intent(inout) :: list

    list%n_pairs = list%n_pairs + 1
    call ensure_capacity(list%n_pairs, list%a)
    call ensure_capacity(list%n_pairs, list%b)
    call ensure_capacity(list%n_pairs, list%first)
    call ensure_capacity(list%n_pairs, list%shift)
    list%a(list%n_pairs) = a
    list%b(list%n_pairs) = b
    list%first(list%n_pairs) = list%n + 1
    list%shift(:, list%n_pairs) = shift
  end subroutine add_pair

  !> Append a candidate to the last pair.
  subroutine add_candidate(i, j, list)
    integer, intent(in) :: i, j   !! spheres; j = 0 for a wall
    type(candidates_t), intent(inout) :: list

    list%n = list%n + 1
    call ensure_capacity(list%n, list%i)
    call ensure_capacity(list%n, list%j)
    list%i(list%n) = i
    list%j(list%n) = j
  end subroutine add_candidate

  !> Spheres of body a near wall w.
  subroutine list_wall(walls, blocks, a, w, self)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: a, w
    type(contact_spheres_t), intent(inout) :: self
    real(wp) :: beyond, height, n(3)
    integer :: i

    beyond = dot_product(walls%normal(:, w), blocks%x(:, a)) - walls%offset(w) + self%skin
    if (beyond + self%bounding_radius(a) <= 0.0_wp) return
    n = matmul(walls%normal(:, w), self%turn(:, :, a))
    call add_pair(a, walls%number(w), [0.0_wp, 0.0_wp, 0.0_wp], self%list)
    associate (shape => blocks%shapes(blocks%shape(a)))
      do i = 1, size(shape%sphere_radius)
        height = beyond + dot_product(n, shape%sphere_centre(:, i))
        if (height + shape%sphere_radius(i) <= 0.0_wp) cycle
        call add_candidate(i, 0, self%list)
      end do
    end associate
  end subroutine list_wall

  !> Spheres of body a near the bed.
  subroutine list_bed(bed, blocks, a, self)
    type(bed_t), intent(inout) :: bed
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: a
    type(contact_spheres_t), intent(inout) :: self
    real(wp) :: x(3), c(3), cutoff, distance, outward(3)
    integer :: i

    x = bed_place(bed, blocks%x(:, a))
    cutoff = self%bounding_radius(a) + self%skin
    if (.not. bed_is_near(bed, x - cutoff, x + cutoff)) return
    call add_pair(a, bed_counterpart, [0.0_wp, 0.0_wp, 0.0_wp], self%list)
    associate (shape => blocks%shapes(blocks%shape(a)))
      do i = 1, size(shape%sphere_radius)
        c = x + matmul(self%turn(:, :, a), shape%sphere_centre(:, i))
        cutoff = shape%sphere_radius(i) + self%skin
        call bed_distance(bed, c, cutoff, cutoff + self%bounding_radius(a), self%found, distance, &
          outward)
        if (distance > cutoff) cycle
        call add_candidate(i, 0, self%list)
      end do
    end associate
  end subroutine list_bed

  !> Sphere pairs of near pair p of bodies, in the order of the spheres of a, then of the bins of b.
  subroutine list_body(blocks, p, self)
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: p
    type(contact_spheres_t), intent(inout) :: self
    real(wp) :: d(3), d_a(3), c(3), turn(3, 3)
    integer :: a, b, i

    a = self%near%a(p)
    b = self%near%b(p)
    d = blocks%x(:, b) + self%near%shift(:, p) - blocks%x(:, a)
    d_a = matmul(d, self%turn(:, :, a))
    turn = matmul(transpose(self%turn(:, :, b)), self%turn(:, :, a))
    call add_pair(a, b, self%near%shift(:, p), self%list)
    associate (shape => blocks%shapes(blocks%shape(a)))
      do i = 1, size(shape%sphere_radius)
        c = shape%sphere_centre(:, i) - d_a
        if (dot_product(c, c) >= (self%bounding_radius(b) + shape%sphere_radius(i) &
          + self%skin)**2) cycle
        call list_sphere(blocks, a, i, b, matmul(turn, c), self)
      end do
    end associate
  end subroutine list_body

  !> Spheres of body b near sphere i of body a, whose centre is c in the axes of b.
  subroutine list_sphere(blocks, a, i, b, c, self)
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: a, i, b
    real(wp), intent(in) :: c(3)   !! [m]
    type(contact_spheres_t), intent(inout) :: self
    real(wp) :: cutoff, d(3)
    integer :: low(3), high(3), kx, ky, kz, bin, m, j

    associate (set => self%set(blocks%shape(b)), shape => blocks%shapes(blocks%shape(b)))
      cutoff = blocks%shapes(blocks%shape(a))%sphere_radius(i) + self%skin
      if (any(c + cutoff + set%largest < set%bins%low) &
        .or. any(c - cutoff - set%largest > set%bins%high)) return
      low = set%bins%place(c - cutoff - set%largest)
      high = set%bins%place(c + cutoff + set%largest)
      do kz = low(3), high(3)
        do ky = low(2), high(2)
          do kx = low(1), high(1)
            bin = set%bins%number([kx, ky, kz])
            do m = set%bins%first(bin), set%bins%first(bin + 1) - 1
              j = set%bins%item(m)
              d = shape%sphere_centre(:, j) - c
              if (dot_product(d, d) >= (cutoff + shape%sphere_radius(j))**2) cycle
              call add_candidate(i, j, self%list)
            end do
          end do
        end do
      end do
    end associate
  end subroutine list_sphere

  !> Contact points of pair p: on the wall, at the nearest place of the bed, or in the middle of the
  !! overlap of two spheres.
  subroutine add_points(walls, blocks, p, gap, self, points)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: p
    real(wp), intent(in) :: gap   !! still taken as a contact point [m]
    type(contact_spheres_t), intent(inout) :: self
    type(contact_points_t), intent(inout) :: points
    type(contact_point_t) :: point
    real(wp) :: c(3), d(3), to_b(3), radius, distance, outward(3)
    integer :: m, w

    associate (a => self%list%a(p), b => self%list%b(p))
      point%a = a
      point%b = b
      to_b = 0.0_wp
      if (b > 0) to_b = blocks%x(:, b) + self%list%shift(:, p) - blocks%x(:, a)
      w = findloc(walls%number(:walls%n), b, 1)
      do m = self%list%first(p), self%list%first(p + 1) - 1
        point%id = self%list%i(m)
        radius = blocks%shapes(blocks%shape(a))%sphere_radius(point%id)
        c = matmul(self%turn(:, :, a), blocks%shapes(blocks%shape(a))%sphere_centre(:, point%id))
        point%length = 2*radius
        if (b == bed_counterpart) then
          call bed_distance(walls%bed, bed_place(walls%bed, blocks%x(:, a) + c), radius + gap, &
            radius + gap + self%bounding_radius(a), self%found, distance, outward)
          if (all(abs(outward) <= 0.0_wp)) cycle
          point%normal = -outward
          point%depth = radius - distance
        else if (b < 0) then
          point%normal = walls%normal(:, w)
          distance = walls%offset(w) - dot_product(point%normal, blocks%x(:, a)) &
            - dot_product(point%normal, c)
          point%depth = radius - distance
        else
          associate (shape => blocks%shapes(blocks%shape(b)), j => self%list%j(m))
            d = to_b + matmul(self%turn(:, :, b), shape%sphere_centre(:, j)) - c
            distance = norm(d)
            point%normal = d/max(distance, tiny(1.0_wp))
            point%depth = radius + shape%sphere_radius(j) - distance
            point%length = 2*min(radius, shape%sphere_radius(j))
          end associate
          distance = radius - 0.5_wp*point%depth
        end if
        if (point%depth <= -gap) cycle
        point%arm_a = c + distance*point%normal   ! that of the contact
        if (b > 0) point%arm_b = point%arm_a - to_b
        call add_point(point, points)
      end do
    end associate
  end subroutine add_points

end module contact_spheres_m
