!> Stones: random convex polyhedra of given mass, elongation and blockiness.
!!
!! A stone is a cube of six tilted faces with its corners and some of its edges cut off, the deeper
!! the less blocky it is, then stretched along x, y, z. Its form depends on (seed, member) alone.
!!
!! Blockiness: volume over that of the box around it (CIRIA, CUR and CETMEF, The Rock Manual, 2007,
!! section 3.4.1; armourstone 0.4 to 0.8). Elongation: longest over shortest edge of that box, the
!! edges of which are the body axes, x the longest, z the shortest.
module rock_m
  use kinds_m, only: wp
  use vectors_m, only: cube_root, norm
  use case_types_m, only: shape_input_t
  use random_counter_m, only: uniform
  use polyhedron_m, only: polyhedron_t, polyhedron_of_box, cut_polyhedron, polyhedron_moments, &
    polyhedron_faces, max_corners
  use convex_parts_m, only: points_t, parts_t, begin_part, add_face, end_part
  use armour_units_m, only: assemble, cuts
  use tet_mesh_m, only: shape_t
  implicit none
  private
  public :: build_rock, rock_mass, share_in_grade

  integer, parameter :: n_edges = 4                  !! edges of the cube cut off, of 12
  integer, parameter :: n_planes = 6 + 8 + n_edges   !! faces, corners, edges of the cube
  real(wp), parameter :: tilt = 1.0_wp      !! slope of a face, at most [(1 - blockiness)^2]
  real(wp), parameter :: swing = 0.3_wp     !! of the normal of a cut from the diagonal, at most [-]
  real(wp), parameter :: deepest = 0.97_wp  !! cut, as a share of the way to the centre
  real(wp), parameter :: min_edge = 0.01_wp !! of a stone, below that another is drawn [cube edge]
  integer, parameter :: max_tries = 40      !! stones drawn for one; the best of them is taken
  integer, parameter :: max_halvings = 60   !! of the depth of the cuts
  real(wp), parameter :: same_point = 1.0e-9_wp   !! distance of points that are one [size]

  ! Numbers drawn for a stone: those of its mass, of its box, and for each try of its planes.
  integer, parameter :: k_mass = 1, k_order = 2, k_width = 3, k_planes = 100
  integer, parameter :: numbers_per_try = 4*n_planes

contains

  !> Tetrahedra, facets and size of a stone of a family.
  pure subroutine build_rock(input, shape, found)
    type(shape_input_t), intent(in) :: input
    type(shape_t), intent(inout) :: shape
    logical, intent(out) :: found   !! a stone of this blockiness
    type(polyhedron_t) :: stone, form
    type(points_t) :: points
    type(parts_t) :: parts
    integer :: first(max_corners + 2), corner(6*max_corners), n_faces, f, try, v, k
    real(wp) :: volume, moment(3), normal(3, n_planes), weight(n_planes), edge, longest, width

    ! A stone of any volume with its box along the axes. Of some draws the first without short edges
    ! counts, or the one whose shortest is longest.
    longest = -1.0_wp
    do try = 1, max_tries
      call draw_planes(input, try, normal, weight)
      call cut_to_blockiness(input%blockiness, normal, weight, form)
      if (form%n == 0) cycle
      edge = huge(edge)
      do v = 1, form%n
        do k = 1, 3
          edge = min(edge, norm(form%x(:, form%adjacent(k, v)) - form%x(:, v)))
        end do
      end do
      if (edge <= longest) cycle
      longest = edge
      stone%n = form%n
      stone%x(:, :form%n) = form%x(:, :form%n)
      stone%adjacent(:, :form%n) = form%adjacent(:, :form%n)
      if (edge >= min_edge) exit
    end do
    found = stone%n > 0
    if (.not. found) return
    width = input%elongation**(0.2_wp + 0.6_wp*uniform(input%seed, input%member, k_width))
    call stretch([input%elongation, width, 1.0_wp], stone)
    call polyhedron_moments(stone, volume, moment)
    stone%x(:, :stone%n) = stone%x(:, :stone%n) &
      *cube_root(rock_mass(input, input%member)/(input%density*volume))
    points%same = same_point*maxval(abs(stone%x(:, :stone%n)))
    call polyhedron_faces(stone, n_faces, first, corner)
    call begin_part(parts)
    do f = 1, n_faces
      call add_face(stone%x(:, corner(first(f):first(f + 1) - 1)), points, parts)
    end do
    call end_part(points, parts)
    call assemble(points, parts, parts, cuts(input%refinement), shape)
  end subroutine build_rock

  !> Mass of a stone of a family [kg].
  !!
  !! Rosin and Rammler (1933): M = M50 (ln(1/(1 - y))/ln 2)^(1/n), y the share of stones that are
  !! lighter. The members share the range of y in equal parts, in random order, and stand at random
  !! within their parts: so a small family has the grade, too.
  pure function rock_mass(input, member) result(mass)
    type(shape_input_t), intent(in) :: input
    integer, intent(in) :: member   !! 1 .. variants
    real(wp) :: mass
    real(wp) :: u, above
    integer :: k, rank

    u = uniform(input%seed, member, k_order)
    rank = count([(uniform(input%seed, k, k_order) < u, k=1, input%variants)])
    u = (real(rank, wp) + uniform(input%seed, member, k_mass))/real(input%variants, wp)
    above = share_above(input, input%mass_min) - u*share_in_grade(input)
    mass = input%mass_50*(-log(above)/log(2.0_wp))**(1.0_wp/input%uniformity)
    mass = max(mass, input%mass_min)   ! to round-off
    if (input%mass_max > 0.0_wp) mass = min(mass, input%mass_max)
  end function rock_mass

  !> Share of the stones of a grade that are heavier than a mass, before it is cut [-].
  pure function share_above(input, mass) result(share)
    type(shape_input_t), intent(in) :: input
    real(wp), intent(in) :: mass   !! [kg]
    real(wp) :: share

    share = 2.0_wp**(-(mass/input%mass_50)**input%uniformity)
  end function share_above

  !> Share of the stones of a grade that its least and largest mass leave [-].
  pure function share_in_grade(input) result(share)
    type(shape_input_t), intent(in) :: input
    real(wp) :: share

    share = share_above(input, input%mass_min)
    if (input%mass_max > 0.0_wp) share = share - share_above(input, input%mass_max)
  end function share_in_grade

  !> Normals of the planes of a stone, faces of the cube first, and how much each takes part in the
  !! cutting; the faces do not.
  pure subroutine draw_planes(input, try, normal, weight)
    type(shape_input_t), intent(in) :: input
    integer, intent(in) :: try
    real(wp), intent(out) :: normal(3, n_planes)   !! unit vectors, outward
    real(wp), intent(out) :: weight(n_planes)
    real(wp) :: u(4), slope
    integer :: p, k, d, first

    first = int(12*uniform(input%seed, input%member, k_width + try))
    do p = 1, n_planes
      do k = 1, 4
        u(k) = uniform(input%seed, input%member, k_planes + (try - 1)*numbers_per_try + 4*p + k)
      end do
      weight(p) = 0.0_wp
      slope = tilt*(1.0_wp - input%blockiness)**2
      normal(:, p) = 0.0_wp
      if (p <= 6) then
        normal(1 + mod(p, 3), p) = merge(1.0_wp, -1.0_wp, p > 3)
      else if (p <= 14) then
        do d = 1, 3
          normal(d, p) = merge(1.0_wp, -1.0_wp, btest(p - 7, d - 1))/sqrt(3.0_wp)
        end do
        weight(p) = 0.5_wp + 0.5_wp*u(4)
        slope = swing
      else
        k = mod(first + 5*(p - 15), 12)   ! towards the middle of one of the twelve edges of a cube
        d = k/4
        normal(1 + mod(d, 3), p) = merge(1.0_wp, -1.0_wp, btest(k, 0))/sqrt(2.0_wp)
        normal(1 + mod(d + 1, 3), p) = merge(1.0_wp, -1.0_wp, btest(k, 1))/sqrt(2.0_wp)
        weight(p) = 0.4_wp + 0.25_wp*u(4)
        slope = swing
      end if
      normal(:, p) = normal(:, p) + slope*(2*u(:3) - 1.0_wp)
      normal(:, p) = normal(:, p)/norm(normal(:, p))
    end do
  end subroutine draw_planes

  !> The stone of these planes with the wanted blockiness, in a box of edge 1; empty if there is
  !! none. The deeper the cuts, the less is left of the box.
  pure subroutine cut_to_blockiness(blockiness, normal, weight, stone)
    real(wp), intent(in) :: blockiness
    real(wp), intent(in) :: normal(:, :), weight(:)   !! from `draw_planes`
    type(polyhedron_t), intent(out) :: stone
    real(wp) :: low, high, depth
    integer :: n

    low = 0.0_wp
    high = deepest
    call cut_cube(normal, weight, low, stone)
    if (share_of_box(stone) < blockiness) stone%n = 0
    if (stone%n == 0) return
    call cut_cube(normal, weight, high, stone)
    if (share_of_box(stone) > blockiness) stone%n = 0
    if (stone%n == 0) return
    do n = 1, max_halvings
      depth = 0.5_wp*(low + high)
      call cut_cube(normal, weight, depth, stone)
      if (share_of_box(stone) > blockiness) then
        low = depth
      else
        high = depth
      end if
      if (high - low <= 2.0_wp*epsilon(1.0_wp)) exit
    end do
    call stretch([1.0_wp, 1.0_wp, 1.0_wp], stone)
  end subroutine cut_to_blockiness

  !> A cube of edge 1 about the origin, its faces tilted, cut by planes that stand at the corners
  !! and outside the edges with depth 0; with depth 1 half way to the centre, or nearer.
  pure subroutine cut_cube(normal, weight, depth, stone)
    real(wp), intent(in) :: normal(:, :), weight(:), depth
    type(polyhedron_t), intent(out) :: stone
    real(wp) :: at
    integer :: p

    call polyhedron_of_box(spread(-1.0_wp, 1, 3), spread(1.0_wp, 1, 3), stone)
    do p = 1, n_planes
      at = 0.5_wp
      if (p > 6) at = 0.5_wp*sqrt(3.0_wp)*(1.0_wp - depth*weight(p))
      if (p > 14) at = 0.5_wp*sqrt(2.0_wp)*(1.2_wp - depth*weight(p))
      call cut_polyhedron(stone, normal(:, p), at)
    end do
  end subroutine cut_cube

  !> Volume over that of the box along the axes [-].
  pure function share_of_box(stone) result(share)
    type(polyhedron_t), intent(in) :: stone
    real(wp) :: share
    real(wp) :: volume, moment(3)

    call polyhedron_moments(stone, volume, moment)
    share = volume/product(maxval(stone%x(:, :stone%n), 2) - minval(stone%x(:, :stone%n), 2))
  end function share_of_box

  !> Give a stone a box with these edges, its centre at the origin.
  pure subroutine stretch(edges, stone)
    real(wp), intent(in) :: edges(3)
    type(polyhedron_t), intent(inout) :: stone
    real(wp) :: low(3), high(3)
    integer :: v

    low = minval(stone%x(:, :stone%n), 2)
    high = maxval(stone%x(:, :stone%n), 2)
    do v = 1, stone%n
      stone%x(:, v) = edges*(stone%x(:, v) - 0.5_wp*(low + high))/(high - low)
    end do
  end subroutine stretch

end module rock_m
