!> How deep the true shapes of the blocks reach into one another, into the walls and the bed.
!!
!! The measure is independent of the contact model: the depth of two blocks is the largest distance
!! below the surface of one of a surface point of the other, points taken at the corners, along the
!! edges and on the faces. Balls and walls are exact. Every result is a maximum over points, which
!! no order of the work can change.
module overlap_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use vectors_m, only: norm, rotation_matrix
  use tet_mesh_m, only: shape_t
  use rigid_body_m, only: blocks_t
  use walls_m, only: walls_t
  use bed_m, only: bed_t, bed_place, bed_is_near, bed_covers, bed_distance
  use bed_surface_m, only: make_ready
  use surface_search_m, only: found_t, search_surface
  use neighbours_m, only: pair_list_t, near_pairs, nearest_shift
  use overlap_solid_m, only: solid_t, prepare, inside
  use deep_overlaps_m, only: deep_overlaps_t, store_overlap, size_of_pair, reported_share
  implicit none
  private
  public :: overlap_t, overlap_init, overlap_depth, wall_depth, max_overlap, has_place, exclude
  public :: release_overlap

  real(wp), parameter :: release_overlap = 0.01_wp   !! allowed overlap over smallest edge

  !> The shapes of a run made ready, and the lists of the search.
  type :: overlap_t
    type(solid_t), allocatable :: solid(:)
    type(pair_list_t) :: pairs
    type(found_t) :: found                       !! work
    real(wp), allocatable :: at(:, :)            !! (7, n) where `in_bed` was found
    real(wp), allocatable :: in_bed(:, :)
      !! (2, n) depth of interest and depth in the bed, if that is larger [m]
  end type overlap_t

contains

  !> Prepare the shapes of a run.
  subroutine overlap_init(shapes, overlap)
    type(shape_t), intent(in) :: shapes(:)
    type(overlap_t), intent(out) :: overlap
    integer :: s

    allocate (overlap%solid(size(shapes)))
    do s = 1, size(shapes)
      call prepare(shapes(s), overlap%solid(s))
    end do
  end subroutine overlap_init

  !> Depth of two bodies in one another; zero where they are apart [m].
  !!
  !! For single questions, such as the checks of the input: prepares both shapes each time.
  function overlap_depth(shape_a, x_a, q_a, shape_b, x_b, q_b) result(depth)
    type(shape_t), intent(in) :: shape_a, shape_b
    real(wp), intent(in) :: x_a(3), x_b(3)   !! centres of mass [m]
    real(wp), intent(in) :: q_a(4), q_b(4)   !! attitudes
    real(wp) :: depth
    type(solid_t) :: a, b
    type(found_t) :: found

    depth = 0.0_wp
    if (norm(x_a - x_b) >= shape_a%radius + shape_b%radius) return
    call prepare(shape_a, a)
    call prepare(shape_b, b)
    call deepen_pair(a, rotation_matrix(q_a), b, rotation_matrix(q_b), x_a - x_b, found, depth)
  end function overlap_depth

  !> Depth of a body behind the walls; zero where it is inside the tank [m].
  pure function wall_depth(shape, x, q, walls) result(depth)
    type(shape_t), intent(in) :: shape
    real(wp), intent(in) :: x(3)   !! centre of mass [m]
    real(wp), intent(in) :: q(4)   !! attitude
    type(walls_t), intent(in) :: walls
    real(wp) :: depth
    real(wp) :: ball

    ball = 0.0_wp
    if (shape%kind == 'sphere') ball = shape%sphere_radius(1)
    depth = 0.0_wp
    call deepen_wall(shape%point, ball, max(shape%radius, ball), x, rotation_matrix(q), walls, &
      depth)
  end function wall_depth

  !> Whether body c has room where it is: nothing reaches deeper into it than 1 % of its size.
  function has_place(walls, blocks, c, overlap) result(free)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: c
    type(overlap_t), intent(in) :: overlap
    logical :: free
    real(wp) :: depth, turn(3, 3), d(3)
    type(found_t) :: found
    integer :: b

    ! Largest depth in the other present bodies, the walls and the bed [m].
    depth = 0.0_wp
    turn = rotation_matrix(blocks%q(:, c))
    associate (own => overlap%solid(blocks%shape(c)))
      call deepen_wall(own%corner, own%ball, own%radius, blocks%x(:, c), turn, walls, depth)
      if (walls%bed%there) call deepen_bed(own, blocks%x(:, c), turn, walls%bed, found, depth)
      do b = 1, blocks%n
        if (b == c .or. .not. blocks%present(b)) cycle
        d = blocks%x(:, c) - blocks%x(:, b)
        d = d - nearest_shift(walls%period, -d)
        if (norm(d) >= own%radius + overlap%solid(blocks%shape(b))%radius) cycle
        call deepen_pair(own, turn, overlap%solid(blocks%shape(b)), &
          rotation_matrix(blocks%q(:, b)), d, found, depth)
      end do
    end associate
    free = depth <= release_overlap*blocks%shapes(blocks%shape(c))%smallest_edge
  end function has_place

  !> Whether the places of two bodies exclude one another: they reach deeper into one another than a
  !! release allows the smaller.
  function exclude(walls, blocks, a, b, overlap) result(yes)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: a, b
    type(overlap_t), intent(in) :: overlap
    logical :: yes
    real(wp) :: d(3), depth, allowed
    type(found_t) :: found

    d = blocks%x(:, a) - blocks%x(:, b)
    d = d - nearest_shift(walls%period, -d)
    associate (one => overlap%solid(blocks%shape(a)), two => overlap%solid(blocks%shape(b)))
      yes = .false.
      if (norm(d) >= one%radius + two%radius) return
      allowed = release_overlap*min(blocks%shapes(blocks%shape(a))%smallest_edge, &
        blocks%shapes(blocks%shape(b))%smallest_edge)
      depth = allowed
      call deepen_pair(one, rotation_matrix(blocks%q(:, a)), two, rotation_matrix(blocks%q(:, b)), &
        d, found, depth)
    end associate
    yes = depth > allowed
  end function exclude

  !> Largest depth of the bodies that are asked for in one another, in the walls and in the bed [m],
  !! and those that reach deep for their size.
  !!
  !! Pairs of bodies that are both held or moved are left out.
  subroutine max_overlap(walls, blocks, overlap, depth, deep)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    type(overlap_t), intent(inout) :: overlap
    real(wp), intent(out) :: depth
    type(deep_overlaps_t), intent(inout) :: deep
    integer, parameter :: wall = 0
    logical :: asked(blocks%n)
    real(wp), allocatable :: turn(:, :, :)   ! (3, 3, bodies) body to space
    real(wp) :: radius(blocks%n), deepest    ! [m]
    integer :: a, b, p

    depth = 0.0_wp
    deep%depth = 0.0_wp
    deep%share = 0.0_wp
    if (.not. any(deep%asked)) return
    asked = deep%asked .and. blocks%present
    allocate (turn(3, 3, blocks%n))
    if (.not. allocated(overlap%at)) then
      allocate (overlap%at(7, blocks%n), source=huge(1.0_wp))
      allocate (overlap%in_bed(2, blocks%n), source=0.0_wp)
    end if
    radius = 0.0_wp
    do a = 1, blocks%n
      if (.not. asked(a)) cycle
      turn(:, :, a) = rotation_matrix(blocks%q(:, a))
      associate (solid => overlap%solid(blocks%shape(a)))
        radius(a) = solid%radius
        if (blocks%fixed(a)) cycle
        deepest = worth_finding(a, wall, depth, deep)
        call deepen_wall(solid%corner, solid%ball, solid%radius, blocks%x(:, a), &
          turn(:, :, a), walls, deepest)
        if (walls%bed%there) call deepen_bed_once(a, deepest)
        call store_overlap(a, wall, deepest, deep)
        depth = max(depth, deepest)
      end associate
    end do
    call near_pairs(blocks%x, radius, asked, walls%period, 0.0_wp, overlap%pairs)
    do p = 1, overlap%pairs%n
      a = overlap%pairs%a(p)
      b = overlap%pairs%b(p)
      if (blocks%fixed(a) .and. blocks%fixed(b)) cycle
      deepest = worth_finding(a, b, depth, deep)
      call deepen_pair(overlap%solid(blocks%shape(a)), turn(:, :, a), &
        overlap%solid(blocks%shape(b)), turn(:, :, b), &
        blocks%x(:, a) - blocks%x(:, b) - overlap%pairs%shift(:, p), overlap%found, deepest)
      call store_overlap(a, b, deepest, deep)
      depth = max(depth, deepest)
    end do
  contains
    !> The same as `deepen_bed`; of a body that has not moved since, what was found.
    subroutine deepen_bed_once(a, depth)
      integer, intent(in) :: a
      real(wp), intent(inout) :: depth
      real(wp) :: here(7)

      here = [blocks%x(:, a), blocks%q(:, a)]
      associate (least => overlap%in_bed(1, a), known => overlap%in_bed(2, a))
        if (any(abs(overlap%at(:, a) - here) > 0.0_wp) &
            .or. (depth < least .and. known <= least)) then
          overlap%at(:, a) = here
          least = depth
          call deepen_bed(overlap%solid(blocks%shape(a)), blocks%x(:, a), turn(:, :, a), &
            walls%bed, overlap%found, depth)
          known = depth
        else if (known > least) then
          depth = max(depth, known)
        end if
      end associate
    end subroutine deepen_bed_once
  end subroutine max_overlap

  !> Depth below which that of a body and its counterpart is of no interest: neither the largest of
  !! all nor deep for their size [m].
  pure function worth_finding(a, b, depth, deep) result(least)
    integer, intent(in) :: a, b           !! body; body, or below 1: wall or bed
    real(wp), intent(in) :: depth         !! largest so far [m]
    type(deep_overlaps_t), intent(in) :: deep
    real(wp) :: least

    least = min(depth, reported_share*size_of_pair(a, b, deep))
  end function worth_finding

  !> Raise `depth` to the depth of two bodies in one another, if that is larger.
  subroutine deepen_pair(a, turn_a, b, turn_b, d, found, depth)
    type(solid_t), intent(in) :: a, b
    real(wp), intent(in) :: turn_a(3, 3), turn_b(3, 3)   !! body to space
    real(wp), intent(in) :: d(3)                         !! centre of a minus centre of b [m]
    type(found_t), intent(inout) :: found                !! work
    real(wp), intent(inout) :: depth

    if (a%ball > 0.0_wp .and. b%ball > 0.0_wp) then
      depth = max(depth, a%ball + b%ball - norm(d))
    else if (a%ball > 0.0_wp) then
      call deepen_ball(a%ball, matmul(d, turn_b), b, found, depth)
    else if (b%ball > 0.0_wp) then
      call deepen_ball(b%ball, matmul(-d, turn_a), a, found, depth)
    else
      call deepen_samples(a, matmul(transpose(turn_b), turn_a), matmul(d, turn_b), b, found, depth)
      call deepen_samples(b, matmul(transpose(turn_a), turn_b), matmul(-d, turn_a), a, found, depth)
    end if
  end subroutine deepen_pair

  !> Raise `depth` to the depth of a body behind the walls, if that is larger.
  pure subroutine deepen_wall(corner, ball, radius, x, turn, walls, depth)
    real(wp), intent(in) :: corner(:, :)   !! (3, n) body axes [m]
    real(wp), intent(in) :: ball, radius   !! of the ball if it is one, of the bounding sphere [m]
    real(wp), intent(in) :: x(3)           !! centre of mass [m]
    real(wp), intent(in) :: turn(3, 3)     !! body to space
    type(walls_t), intent(in) :: walls
    real(wp), intent(inout) :: depth
    real(wp) :: beyond, n(3)
    integer :: w, i

    do w = 1, walls%n
      beyond = dot_product(walls%normal(:, w), x) - walls%offset(w)
      if (beyond + radius <= depth) cycle
      if (ball > 0.0_wp) then
        depth = max(depth, beyond + ball)
      else
        n = matmul(walls%normal(:, w), turn)
        do i = 1, size(corner, 2)
          depth = max(depth, beyond + dot_product(n, corner(:, i)))
        end do
      end if
    end do
  end subroutine deepen_wall

  !> Raise `depth` to the depth of a body in the bed, if that is larger: of its sample points below
  !! the surface of the bed, and of the sharp edges and corners of the bed below its own.
  subroutine deepen_bed(body, position, turn, bed, found, depth)
    type(solid_t), intent(in) :: body
    real(wp), intent(in) :: position(3)  !! centre of mass [m]
    real(wp), intent(in) :: turn(3, 3)   !! body to space
    type(bed_t), intent(inout) :: bed
    type(found_t), intent(inout) :: found   !! work
    real(wp), intent(inout) :: depth
    real(wp) :: x(3), p(3), distance, outward(3)
    integer :: c, i, m

    x = bed_place(bed, position)
    if (.not. bed_is_near(bed, x - body%radius, x + body%radius)) then
      if (bed_covers(bed, x)) depth = max(depth, body%radius)
      return
    end if
    if (body%ball > 0.0_wp) then
      call bed_distance(bed, x, body%ball, 2*body%ball, found, distance, outward)
      depth = max(depth, body%ball - distance)
      return
    end if
    do c = 1, size(body%bounding_radius)
      p = x + matmul(turn, body%middle(:, c))
      if (.not. bed_is_near(bed, p - body%bounding_radius(c), p + body%bounding_radius(c))) then
        if (.not. bed_covers(bed, p)) cycle
      end if
      do i = body%cluster(c), body%cluster(c + 1) - 1
        p = x + matmul(turn, body%sample(:, i))
        if (.not. bed_covers(bed, p)) cycle
        call bed_distance(bed, p, body%bounding_radius(c), 2*body%radius, found, distance, outward)
        depth = max(depth, -distance)
      end do
    end do
    call make_ready(x - body%radius, x + body%radius, bed, found, any_order=.true.)
    found%of_bed%n = found%edges%n
    call ensure_capacity(found%edges%n, found%of_bed%item)
    found%of_bed%item(:found%edges%n) = found%edges%item(:found%edges%n)
    do m = 1, found%of_bed%n
      if (bed%surface%edge_number(found%of_bed%item(m)) > bed%surface%n_convex) cycle
      associate (edge => bed%surface%edge(found%of_bed%item(m)))
        do i = 0, ceiling(edge%extent/body%spacing)
          p = edge%start + min(real(i, wp)*body%spacing, edge%extent)*edge%along - x
          if (dot_product(p, p) > body%radius**2) cycle
          call deepen_point(body, matmul(p, turn), found, depth)
        end do
      end associate
    end do
  end subroutine deepen_bed

  !> Raise `depth` to the largest depth of the sample points of a below the surface of b.
  subroutine deepen_samples(a, turn, d, b, found, depth)
    type(solid_t), intent(in) :: a, b
    real(wp), intent(in) :: turn(3, 3)   !! axes of a to axes of b
    real(wp), intent(in) :: d(3)         !! centre of a, axes of b [m]
    type(found_t), intent(inout) :: found   !! work
    real(wp), intent(inout) :: depth
    real(wp) :: p(3)
    integer :: c, i

    do c = 1, size(a%bounding_radius)
      p = d + matmul(turn, a%middle(:, c))
      if (any(p < b%tets%low - a%bounding_radius(c)) .or. any(p > b%tets%high &
        + a%bounding_radius(c))) cycle
      do i = a%cluster(c), a%cluster(c + 1) - 1
        p = d + turn(:, 1)*a%sample(1, i) + turn(:, 2)*a%sample(2, i) + turn(:, 3)*a%sample(3, i)
        call deepen_point(b, p, found, depth)
      end do
    end do
  end subroutine deepen_samples

  !> Raise `depth` to that of a point below the surface of a body, if that is larger.
  subroutine deepen_point(body, p, found, depth)
    type(solid_t), intent(in) :: body
    real(wp), intent(in) :: p(3)            !! body axes [m]
    type(found_t), intent(inout) :: found   !! work
    real(wp), intent(inout) :: depth
    real(wp) :: distance, outward(3)

    if (any(p < body%tets%low) .or. any(p > body%tets%high)) return
    if (.not. inside(body, p)) return
    call search_surface(body%surface, p, max(depth, body%spacing), found, distance, outward)
    depth = max(depth, -distance)
  end subroutine deepen_point

  !> Raise `depth` to the depth of a ball in a body, if that is larger.
  subroutine deepen_ball(radius, centre, body, found, depth)
    real(wp), intent(in) :: radius          !! [m]
    real(wp), intent(in) :: centre(3)       !! axes of the body [m]
    type(solid_t), intent(in) :: body
    type(found_t), intent(inout) :: found   !! work
    real(wp), intent(inout) :: depth
    real(wp) :: distance, outward(3)

    if (any(centre < body%tets%low - radius) .or. any(centre > body%tets%high + radius)) return
    call search_surface(body%surface, centre, radius, found, distance, outward)
    depth = max(depth, radius - distance)
  end subroutine deepen_ball

end module overlap_m
