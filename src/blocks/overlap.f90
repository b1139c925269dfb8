!> How deep the true shapes of the blocks reach into one another, into the walls and the bed.
!!
!! The measure is independent of the contact model: the depth of two blocks is the largest distance
!! below the surface of one of a surface point of the other, points taken at the corners, along the
!! edges and on the faces. Balls and walls are exact. Every result is a maximum over points, which
!! no order of the work can change.
module overlap_m
  use kinds_m, only: wp, i8
  use vectors_m, only: cross, norm, inverse3, rotation_matrix
  use tet_mesh_m, only: shape_t, surface_of_tets
  use rigid_body_m, only: blocks_t
  use walls_m, only: walls_t
  use bed_m, only: bed_t, bed_place, bed_is_near, bed_covers, bed_distance
  use surface_search_m, only: found_t, gather_edges
  use neighbours_m, only: bins_t, bins_build, pair_list_t, near_pairs, nearest_shift
  implicit none
  private
  public :: overlap_t, overlap_init, overlap_depth, wall_depth, max_overlap, room_for
  public :: expected_samples

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
    real(wp), allocatable :: reach(:)            !! (clusters) [m]
    !> (3, 3, tets) turns x - tet_origin into the weights of corners 2 to 4 [1/m].
    real(wp), allocatable :: to_tet(:, :, :)
    real(wp), allocatable :: tet_origin(:, :)    !! (3, tets) corner 1 [m]
    real(wp), allocatable :: face(:, :, :)       !! (3, 3, triangles) corners of the surface [m]
    type(bins_t) :: tets, faces                  !! the same in bins
    real(wp) :: spacing = 0.0_wp                 !! of points along sharp edges [m]
  end type solid_t

  !> The shapes of a run made ready, and the lists of the search.
  type :: overlap_t
    type(solid_t), allocatable :: solid(:)
    type(pair_list_t) :: pairs
    real(wp), allocatable :: turn(:, :, :)       !! (3, 3, bodies) body to space
    real(wp), allocatable :: radius(:)           !! (bodies) [m]
    type(found_t) :: found                       !! of the bed
  end type overlap_t

contains

  !> Prepare the shapes of a run with n bodies.
  subroutine overlap_init(shapes, n, overlap)
    type(shape_t), intent(in) :: shapes(:)
    integer, intent(in) :: n                     !! bodies
    type(overlap_t), intent(out) :: overlap
    integer :: s

    allocate (overlap%solid(size(shapes)), overlap%turn(3, 3, n), overlap%radius(n))
    do s = 1, size(shapes)
      call prepare(shapes(s), overlap%solid(s))
    end do
  end subroutine overlap_init

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
    deallocate (low, high)
    call surface_of_tets(size(shape%point, 2), shape%flow_tet, triangle, triangle_tet)
    n = size(triangle, 2)
    allocate (solid%face(3, 3, n), low(3, n), high(3, n))
    do t = 1, n
      solid%face(:, :, t) = shape%point(:, triangle(:, t))
      low(:, t) = minval(solid%face(:, :, t), 2)
      high(:, t) = maxval(solid%face(:, :, t), 2)
    end do
    call bins_build(low, high, shape%smallest_edge/bins_per_edge, solid%faces)
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
    integer :: t, e, i, j, m, n_edges, pass
    integer(i8) :: total

    allocate (normal(3, size(triangle, 2)), edge(4, 3*size(triangle, 2)))
    allocate (on_surface(size(shape%point, 2)), source=.false.)
    do t = 1, size(triangle, 2)
      p = solid%face(:, :, t)
      normal(:, t) = cross(p(:, 2) - p(:, 1), p(:, 3) - p(:, 1))
      normal(:, t) = normal(:, t)/norm(normal(:, t))
      on_surface(triangle(:, t)) = .true.
    end do
    solid%corner = shape%point(:, pack([(i, i=1, size(on_surface))], on_surface))
    call surface_edges(triangle, edge, n_edges)
    do pass = 1, 2   ! count, then fill
      total = size(solid%corner, 2)
      if (pass == 2) solid%sample(:, :total) = solid%corner
      if (inside(solid, centre)) then
        total = total + 1
        if (pass == 2) solid%sample(:, total) = centre
      end if
      do e = 1, n_edges
        p(:, 1:2) = shape%point(:, edge(1:2, e))
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

  !> Edges of a closed surface, each once: its two corners and the two triangles at it.
  pure subroutine surface_edges(triangle, edge, n)
    integer, intent(in) :: triangle(:, :)   !! (3, triangles)
    integer, intent(out) :: edge(:, :)      !! (4, :) up to n; second triangle 0 if there is none
    integer, intent(out) :: n
    integer, allocatable :: head(:), chain(:)   ! edges by their lower corner
    integer :: t, c, a, b, e

    allocate (head(maxval(triangle)), chain(size(edge, 2)))
    head = 0
    n = 0
    do t = 1, size(triangle, 2)
      do c = 1, 3
        a = min(triangle(c, t), triangle(1 + mod(c, 3), t))
        b = max(triangle(c, t), triangle(1 + mod(c, 3), t))
        e = head(a)
        do while (e > 0)
          if (edge(2, e) == b .and. edge(4, e) == 0) exit
          e = chain(e)
        end do
        if (e > 0) then
          edge(4, e) = t
        else
          n = n + 1
          edge(:, n) = [a, b, t, 0]
          chain(n) = head(a)
          head(a) = n
        end if
      end do
    end do
  end subroutine surface_edges

  !> Reorder the sample points into clusters with small bounding spheres.
  subroutine cluster_samples(spacing, solid)
    real(wp), intent(in) :: spacing   !! wanted size of a cluster [m]
    type(solid_t), intent(inout) :: solid
    type(bins_t) :: bins
    integer :: c, n, i, last

    call bins_build(solid%sample, solid%sample, spacing, bins)
    solid%sample = solid%sample(:, bins%item)
    n = count(bins%first(2:) > bins%first(:size(bins%first) - 1))
    allocate (solid%cluster(n + 1), solid%middle(3, n), solid%reach(n))
    n = 0
    do c = 1, size(bins%first) - 1
      i = bins%first(c)
      last = bins%first(c + 1) - 1
      if (last < i) cycle
      n = n + 1
      solid%cluster(n) = i
      solid%middle(:, n) = 0.5_wp*(minval(solid%sample(:, i:last), 2) &
        + maxval(solid%sample(:, i:last), 2))
      solid%reach(n) = maxval(norm2(solid%sample(:, i:last) &
        - spread(solid%middle(:, n), 2, last - i + 1), 1))
    end do
    solid%cluster(n + 1) = size(solid%sample, 2) + 1
  end subroutine cluster_samples

  !> Depth of two bodies in one another; zero where they are apart [m].
  !!
  !! For single questions, such as the checks of the input: prepares both shapes each time.
  function overlap_depth(shape_a, x_a, q_a, shape_b, x_b, q_b) result(depth)
    type(shape_t), intent(in) :: shape_a, shape_b
    real(wp), intent(in) :: x_a(3), x_b(3)   !! centres of mass [m]
    real(wp), intent(in) :: q_a(4), q_b(4)   !! attitudes
    real(wp) :: depth
    type(solid_t) :: a, b

    depth = 0.0_wp
    if (norm(x_a - x_b) >= shape_a%radius + shape_b%radius) return
    call prepare(shape_a, a)
    call prepare(shape_b, b)
    call deepen_pair(a, rotation_matrix(q_a), b, rotation_matrix(q_b), x_a - x_b, depth)
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
  function room_for(walls, blocks, c, overlap) result(free)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: c
    type(overlap_t), intent(in) :: overlap
    logical :: free
    real(wp), parameter :: share = 0.01_wp   !! of the smallest edge

    free = body_overlap(overlap, walls, blocks, c) &
      <= share*blocks%shapes(blocks%shape(c))%smallest_edge
  end function room_for

  !> Largest depth of body c in the other present bodies, the walls and the bed [m].
  function body_overlap(overlap, walls, blocks, c) result(depth)
    type(overlap_t), intent(in) :: overlap
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: c
    real(wp) :: depth
    type(found_t) :: found
    real(wp) :: turn(3, 3), d(3)
    integer :: b

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
          rotation_matrix(blocks%q(:, b)), d, depth)
      end do
    end associate
  end function body_overlap

  !> Largest depth of the present bodies in one another, in the walls and in the bed [m].
  !!
  !! Pairs of bodies that are both held or moved are left out.
  subroutine max_overlap(walls, blocks, overlap, depth)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    type(overlap_t), intent(inout) :: overlap
    real(wp), intent(out) :: depth
    integer :: a, b, p

    depth = 0.0_wp
    do a = 1, blocks%n
      overlap%turn(:, :, a) = rotation_matrix(blocks%q(:, a))
      associate (solid => overlap%solid(blocks%shape(a)))
        overlap%radius(a) = solid%radius
        if (.not. blocks%present(a) .or. blocks%fixed(a)) cycle
        call deepen_wall(solid%corner, solid%ball, solid%radius, blocks%x(:, a), &
          overlap%turn(:, :, a), walls, depth)
        if (walls%bed%there) call deepen_bed(solid, blocks%x(:, a), overlap%turn(:, :, a), &
          walls%bed, overlap%found, depth)
      end associate
    end do
    call near_pairs(blocks%x, overlap%radius, blocks%present, walls%period, 0.0_wp, overlap%pairs)
    do p = 1, overlap%pairs%n
      a = overlap%pairs%a(p)
      b = overlap%pairs%b(p)
      if (blocks%fixed(a) .and. blocks%fixed(b)) cycle
      call deepen_pair(overlap%solid(blocks%shape(a)), overlap%turn(:, :, a), &
        overlap%solid(blocks%shape(b)), overlap%turn(:, :, b), &
        blocks%x(:, a) - blocks%x(:, b) - overlap%pairs%shift(:, p), depth)
    end do
  end subroutine max_overlap

  !> Raise `depth` to the depth of two bodies in one another, if that is larger.
  pure subroutine deepen_pair(a, turn_a, b, turn_b, d, depth)
    type(solid_t), intent(in) :: a, b
    real(wp), intent(in) :: turn_a(3, 3), turn_b(3, 3)   !! body to space
    real(wp), intent(in) :: d(3)                         !! centre of a minus centre of b [m]
    real(wp), intent(inout) :: depth

    if (a%ball > 0.0_wp .and. b%ball > 0.0_wp) then
      depth = max(depth, a%ball + b%ball - norm(d))
    else if (a%ball > 0.0_wp) then
      call deepen_ball(a%ball, matmul(d, turn_b), b, depth)
    else if (b%ball > 0.0_wp) then
      call deepen_ball(b%ball, matmul(-d, turn_a), a, depth)
    else
      call deepen_samples(a, matmul(transpose(turn_b), turn_a), matmul(d, turn_b), b, depth)
      call deepen_samples(b, matmul(transpose(turn_a), turn_b), matmul(-d, turn_a), a, depth)
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
    type(bed_t), intent(in) :: bed
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
    do c = 1, size(body%reach)
      p = x + matmul(turn, body%middle(:, c))
      if (.not. bed_is_near(bed, p - body%reach(c), p + body%reach(c))) then
        if (.not. bed_covers(bed, p)) cycle
      end if
      do i = body%cluster(c), body%cluster(c + 1) - 1
        p = x + matmul(turn, body%sample(:, i))
        if (.not. bed_covers(bed, p)) cycle
        call bed_distance(bed, p, body%reach(c), 2*body%radius, found, distance, outward)
        depth = max(depth, -distance)
      end do
    end do
    call gather_edges(bed%surface, x - body%radius, x + body%radius, found%edges)
    do m = 1, found%edges%n
      if (found%edges%item(m) > bed%surface%n_convex) exit
      associate (edge => bed%surface%edge(found%edges%item(m)))
        do i = 0, ceiling(edge%extent/body%spacing)
          p = edge%start + min(real(i, wp)*body%spacing, edge%extent)*edge%along - x
          if (dot_product(p, p) > body%radius**2) cycle
          p = matmul(p, turn)
          if (any(p < body%tets%low) .or. any(p > body%tets%high)) cycle
          if (inside(body, p)) call deepen_point(body, p, depth)
        end do
      end associate
    end do
  end subroutine deepen_bed

  !> Raise `depth` to the largest depth of the sample points of a below the surface of b.
  pure subroutine deepen_samples(a, turn, d, b, depth)
    type(solid_t), intent(in) :: a, b
    real(wp), intent(in) :: turn(3, 3)   !! axes of a to axes of b
    real(wp), intent(in) :: d(3)         !! centre of a, axes of b [m]
    real(wp), intent(inout) :: depth
    real(wp) :: p(3)
    integer :: c, i

    do c = 1, size(a%reach)
      p = d + matmul(turn, a%middle(:, c))
      if (any(p < b%tets%low - a%reach(c)) .or. any(p > b%tets%high + a%reach(c))) cycle
      do i = a%cluster(c), a%cluster(c + 1) - 1
        p = d + turn(:, 1)*a%sample(1, i) + turn(:, 2)*a%sample(2, i) + turn(:, 3)*a%sample(3, i)
        if (any(p < b%tets%low) .or. any(p > b%tets%high)) cycle
        if (inside(b, p)) call deepen_point(b, p, depth)
      end do
    end do
  end subroutine deepen_samples

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

  !> Raise `depth` to the distance of an inner point from the surface, if that is larger.
  !!
  !! The bins round the point are searched ring by ring, and no further than needed: the search ends
  !! as soon as the surface is found nearer than `depth`, or nearer than what is left to search.
  pure subroutine deepen_point(solid, p, depth)
    type(solid_t), intent(in) :: solid
    real(wp), intent(in) :: p(3)             !! body axes [m]
    real(wp), intent(inout) :: depth
    real(wp) :: nearest, searched
    integer :: home(3), a(3), b(3), ring, i, j, k, c, m

    home = solid%faces%place(p)
    nearest = huge(1.0_wp)
    do ring = 0, maxval(solid%faces%n)
      a = max(home - ring, 1)
      b = min(home + ring, solid%faces%n)
      do k = a(3), b(3)
        do j = a(2), b(2)
          do i = a(1), b(1)
            if (maxval(abs([i, j, k] - home)) /= ring) cycle
            c = solid%faces%number([i, j, k])
            do m = solid%faces%first(c), solid%faces%first(c + 1) - 1
              nearest = min(nearest, distance_squared(p, solid%face(:, :, solid%faces%item(m))))
            end do
          end do
        end do
      end do
      if (nearest <= depth**2) return
      searched = real(ring, wp)*minval(solid%faces%size)
      if (nearest <= searched**2) exit
    end do
    depth = sqrt(nearest)
  end subroutine deepen_point

  !> Raise `depth` to the depth of a ball in a body, if that is larger.
  pure subroutine deepen_ball(radius, centre, solid, depth)
    real(wp), intent(in) :: radius      !! [m]
    real(wp), intent(in) :: centre(3)   !! axes of the body [m]
    type(solid_t), intent(in) :: solid
    real(wp), intent(inout) :: depth
    real(wp) :: nearest
    integer :: m

    if (any(centre < solid%tets%low - radius) .or. any(centre > solid%tets%high + radius)) return
    nearest = huge(1.0_wp)
    do m = 1, size(solid%face, 3)
      nearest = min(nearest, distance_squared(centre, solid%face(:, :, m)))
    end do
    if (any(centre < solid%tets%low) .or. any(centre > solid%tets%high)) then
      depth = max(depth, radius - sqrt(nearest))
    else if (inside(solid, centre)) then
      depth = max(depth, radius + sqrt(nearest))
    else
      depth = max(depth, radius - sqrt(nearest))
    end if
  end subroutine deepen_ball

  !> Square of the distance of a point from a triangle [m2].
  !!
  !! The point nearest in the plane if it lies in the triangle, else the nearest point of an edge.
  pure function distance_squared(p, corner) result(s)
    real(wp), intent(in) :: p(3)
    real(wp), intent(in) :: corner(3, 3)
    real(wp) :: s
    real(wp) :: edge(3, 3), n(3), d(3, 3), r(3), u
    integer :: c
    logical :: in_plane

    do c = 1, 3
      edge(:, c) = corner(:, 1 + mod(c, 3)) - corner(:, c)
      d(:, c) = p - corner(:, c)
    end do
    n = cross(edge(:, 1), edge(:, 2))
    in_plane = .true.
    do c = 1, 3
      in_plane = in_plane .and. dot_product(cross(n, edge(:, c)), d(:, c)) >= 0.0_wp
    end do
    if (in_plane) then
      s = dot_product(n, d(:, 1))**2/dot_product(n, n)
      return
    end if
    s = huge(1.0_wp)
    do c = 1, 3
      u = dot_product(d(:, c), edge(:, c))/dot_product(edge(:, c), edge(:, c))
      r = d(:, c) - min(max(u, 0.0_wp), 1.0_wp)*edge(:, c)
      s = min(s, dot_product(r, r))
    end do
  end function distance_squared

end module overlap_m
