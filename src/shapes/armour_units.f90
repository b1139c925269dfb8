!> Cylinder, tetrapod and dolos as convex parts.
!!
!! Round sections become polygons of 6 `refinement` sides with the area of the circle, so their
!! corners stand slightly outside. The dolos has eight-sided sections and is the same for every
!! `refinement`.
module armour_units_m
  use kinds_m, only: wp, pi
  use vectors_m, only: cross, norm
  use convex_parts_m, only: points_t, parts_t, begin_part, add_face, end_part, add_frustum, &
    tets_of_parts, net_of_parts
  use surface_net_m, only: merge_flat_facets
  use tet_mesh_m, only: shape_t
  implicit none
  private
  public :: build_cylinder, build_tetrapod, build_dolos, tetrapod_tip, dolos_tip, assemble, cuts

  real(wp), parameter :: same_point = 1.0e-9_wp   !! distance of points that are one [size]

  ! Tetrapod of unit height: four cones around the regular tetrahedron whose inscribed circles are
  ! the roots of the cones. Source: Danel (1967), Proc. 10th Coastal Engineering Conf.; figures as
  ! in the Shore Protection Manual (1984), figure 7-109: D = 0.470 H, A = 0.302 H, leg 0.477 H,
  ! volume 0.280 H^3.
  real(wp), parameter :: tetrapod_root = 0.470_wp, tetrapod_tip = 0.302_wp   !! diameters

  ! Dolos of unit height: waist 0.32, tips 0.20 between flat sides; its volume is 0.166. Source:
  ! Merrifield and Zwamborn (1966), Proc. 10th Coastal Engineering Conf.; figures as in the Shore
  ! Protection Manual, figure 7-111: B = 0.32 C, A = 0.20 C, volume 0.16 C^3. The fillets between
  ! shank and flukes (0.057 C) are left out.
  real(wp), parameter :: dolos_waist = 0.32_wp, dolos_tip = 0.20_wp

  !> A cone along an axis through the origin, with a polygon across it.
  type :: leg_t
    real(wp) :: axis(3), side(3)   !! unit vector; the first corner lies towards the side
    integer :: n                   !! corners of the polygon
    real(wp) :: at(2), radius(2)   !! inner and outer end: place on the axis, of the corners [m]
  end type leg_t

contains

  !> A cylinder that stands on z.
  pure subroutine build_cylinder(diameter, height, refinement, shape)
    real(wp), intent(in) :: diameter, height   !! [m]
    integer, intent(in) :: refinement
    type(shape_t), intent(inout) :: shape
    type(points_t) :: points
    type(parts_t) :: coarse, fine
    type(leg_t) :: leg
    real(wp) :: radius
    integer :: n, layers

    n = 6*refinement
    radius = 0.5_wp*diameter*area_factor(n)
    layers = max(1, nint(real(refinement, wp)*height/(diameter*real(cuts(refinement), wp))))
    points%same = same_point*max(diameter, height)
    leg = leg_t([0.0_wp, 0.0_wp, 1.0_wp], [1.0_wp, 0.0_wp, 0.0_wp], n, [-0.5_wp, 0.5_wp]*height, &
      [radius, radius])
    call add_leg(leg, 1, points, coarse)
    call add_leg(leg, layers, points, fine)
    call assemble(points, coarse, fine, cuts(refinement), shape)
  end subroutine build_cylinder

  !> A tetrapod that stands on three legs, the fourth along z, another in the plane y = 0.
  pure subroutine build_tetrapod(height, refinement, shape)
    real(wp), intent(in) :: height             !! overall [m]
    integer, intent(in) :: refinement
    type(shape_t), intent(inout) :: shape
    real(wp), parameter :: cosine = -1.0_wp/3.0_wp, sine = sqrt(8.0_wp)/3.0_wp   ! of two axes
    type(points_t) :: points
    type(parts_t) :: coarse, fine
    type(leg_t) :: leg(4)
    real(wp) :: axis(3, 4), ring(3, 6*refinement, 4), root, tip, inner, outer, angle
    integer :: k, n, layers

    n = 6*refinement
    layers = max(1, nint(real(refinement, wp)/real(cuts(refinement), wp)))
    points%same = same_point*height
    axis(:, 1) = [0.0_wp, 0.0_wp, 1.0_wp]
    do k = 2, 4
      angle = real(k - 2, wp)*2.0_wp*pi/3.0_wp
      axis(:, k) = [sine*cos(angle), sine*sin(angle), cosine]
    end do
    root = 0.5_wp*tetrapod_root*height*area_factor(n)
    tip = 0.5_wp*tetrapod_tip*height*area_factor(n)
    inner = root/sqrt(2.0_wp)                  ! roots touch each other
    outer = 0.75_wp*(height - sine*tip)        ! height = outer/3 + outer + sine*tip
    do k = 1, 4
      leg(k) = leg_t(axis(:, k), axis(:, 1 + mod(k, 4)), n, [inner, outer], [root, tip])
      ring(:, :, k) = section(leg(k), 0.0_wp)
    end do
    call add_core(ring, points, coarse)
    call add_core(ring, points, fine)
    do k = 1, 4
      call add_leg(leg(k), 1, points, coarse)
      call add_leg(leg(k), layers, points, fine)
    end do
    call assemble(points, coarse, fine, cuts(refinement), shape)
  end subroutine build_tetrapod

  !> A dolos: the fluke at negative x stands along z, that at positive x lies along y.
  subroutine build_dolos(height, refinement, shape)
    real(wp), intent(in) :: height             !! overall, the same in x, y, z [m]
    integer, intent(in) :: refinement
    type(shape_t), intent(inout) :: shape
    real(wp), parameter :: unit(3, 3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
                                                 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
    type(points_t) :: points
    type(parts_t) :: parts
    real(wp) :: waist, middle, ends(3, 8, 2)
    integer :: k

    points%same = same_point*height
    waist = dolos_waist*height
    middle = 0.5_wp*(height - waist)
    call add_fluke(height, -middle*unit(:, 1), unit, points, parts)
    call add_fluke(height, middle*unit(:, 1), &
                   reshape([-unit(:, 1), unit(:, 3), unit(:, 2)], [3, 3]), points, parts)
    ends(:, :, 1) = octagon(unit(:, 1), unit(:, 2), unit(:, 3), -middle + 0.5_wp*waist, waist)
    ends(:, :, 2) = octagon(unit(:, 1), unit(:, 2), unit(:, 3), middle - 0.5_wp*waist, waist)
    ! The shank between the two flukes; each of its ends meets a flat side and two wedges.
    call begin_part(parts)
    do k = 1, 8
      call add_face(reshape([ends(:, k, 1), ends(:, 1 + mod(k, 8), 1), ends(:, 1 + mod(k, 8), 2), &
                             ends(:, k, 2)], [3, 4]), points, parts)
    end do
    ! Corners 1 to 8 from 22.5 degrees: 2, 3, 6, 7 lie near the second axis, which is that of the
    ! first fluke; 1, 4, 5, 8 near the first, that of the second.
    call add_face(ends(:, [2, 3, 6, 7], 1), points, parts)
    call add_face(ends(:, [1, 2, 7, 8], 1), points, parts)
    call add_face(ends(:, [3, 4, 5, 6], 1), points, parts)
    call add_face(ends(:, [1, 4, 5, 8], 2), points, parts)
    call add_face(ends(:, [1, 2, 3, 4], 2), points, parts)
    call add_face(ends(:, [5, 6, 7, 8], 2), points, parts)
    call end_part(points, parts)
    call assemble(points, parts, parts, refinement, shape)
  end subroutine build_dolos

  !> Into how many parts each edge of a tetrahedron of a round block is cut.
  pure integer function cuts(refinement)
    integer, intent(in) :: refinement

    cuts = (refinement + 1)/2
  end function cuts

  !> Radius of the corners of a polygon with the area of a circle [radius of the circle].
  pure function area_factor(n) result(factor)
    integer, intent(in) :: n   !! corners
    real(wp) :: factor

    factor = sqrt(2.0_wp*pi/(real(n, wp)*sin(2.0_wp*pi/real(n, wp))))
  end function area_factor

  !> Corners of a leg across its axis, at a share of its length; the first lies towards `side`.
  pure function section(leg, share) result(x)
    type(leg_t), intent(in) :: leg
    real(wp), intent(in) :: share   !! 0: inner end, 1: outer end
    real(wp) :: x(3, leg%n)
    real(wp) :: u(3), v(3), angle, at, radius
    integer :: k

    at = leg%at(1) + share*(leg%at(2) - leg%at(1))
    radius = leg%radius(1) + share*(leg%radius(2) - leg%radius(1))
    u = leg%side - dot_product(leg%side, leg%axis)*leg%axis
    u = u/norm(u)
    v = cross(leg%axis, u)
    do k = 1, leg%n
      angle = 2.0_wp*pi*real(k - 1, wp)/real(leg%n, wp)
      x(:, k) = at*leg%axis + radius*(cos(angle)*u + sin(angle)*v)
    end do
  end function section

  !> A cone along an axis, in layers of equal height.
  pure subroutine add_leg(leg, layers, points, parts)
    type(leg_t), intent(in) :: leg
    integer, intent(in) :: layers
    type(points_t), intent(inout) :: points
    type(parts_t), intent(inout) :: parts
    real(wp) :: a, b
    integer :: m

    do m = 1, layers
      a = real(m - 1, wp)/real(layers, wp)
      b = real(m, wp)/real(layers, wp)
      call add_frustum(section(leg, a), section(leg, b), points, parts)
    end do
  end subroutine add_leg

  !> The core of a tetrapod: the hull of the roots of its legs, which touch in six points.
  !!
  !! Around each corner of the tetrahedron stand three arcs of three roots. Strips join two arcs
  !! from the point where they touch to their middles, and a triangle the three middles.
  pure subroutine add_core(ring, points, parts)
    real(wp), intent(in) :: ring(:, :, :)   !! (3, corners, legs)
    type(points_t), intent(inout) :: points
    type(parts_t), intent(inout) :: parts
    integer :: leg(3), half, i, j, h, q
    real(wp) :: middle(3, 3)

    half = size(ring, 2)/6
    call begin_part(parts)
    do q = 1, 4
      call add_face(ring(:, :, q), points, parts)
    end do
    do q = 1, 4
      leg = pack([1, 2, 3, 4], [1, 2, 3, 4] /= q)
      do i = 1, 3
        j = 1 + mod(i, 3)
        middle(:, i) = arc(leg(i), leg(j), leg(6 - i - j), half)
        call add_face(reshape([arc(leg(i), leg(j), leg(6 - i - j), 0), &
                               arc(leg(i), leg(j), leg(6 - i - j), 1), &
                               arc(leg(j), leg(i), leg(6 - i - j), 1)], [3, 3]), points, parts)
        do h = 1, half - 1
          call add_face(reshape([arc(leg(i), leg(j), leg(6 - i - j), h), &
                                 arc(leg(i), leg(j), leg(6 - i - j), h + 1), &
                                 arc(leg(j), leg(i), leg(6 - i - j), h + 1), &
                                 arc(leg(j), leg(i), leg(6 - i - j), h)], [3, 4]), points, parts)
        end do
      end do
      call add_face(middle, points, parts)
    end do
    call end_part(points, parts)
  contains
    !> Point of the root of leg k, h steps from where it touches leg a towards where it touches b.
    pure function arc(k, a, b, h) result(x)
      integer, intent(in) :: k, a, b, h
      real(wp) :: x(3)
      integer :: from

      from = meeting_point(k, a)
      if (modulo(meeting_point(k, b) - from, 6*half) == 2*half) then
        x = ring(:, 1 + modulo(from + h, 6*half), k)
      else
        x = ring(:, 1 + modulo(from - h, 6*half), k)
      end if
    end function arc

    !> Place in the ring of leg k, from 0, of the point nearest to leg a.
    pure function meeting_point(k, a) result(place)
      integer, intent(in) :: k, a
      integer :: place
      real(wp) :: distance(3), centre(3)
      integer :: m

      centre = sum(ring(:, :, a), 2)/real(6*half, wp)
      do m = 1, 3
        distance(m) = norm(ring(:, 1 + 2*half*(m - 1), k) - centre)
      end do
      place = 2*half*(minloc(distance, 1) - 1)
    end function meeting_point
  end subroutine add_core

  !> Regular octagon across e1, its flat sides towards e2 and e3.
  pure function octagon(e1, e2, e3, at, width) result(x)
    real(wp), intent(in) :: e1(3), e2(3), e3(3)
    real(wp), intent(in) :: at, width   !! place along e1, between flat sides [m]
    real(wp) :: x(3, 8)
    real(wp) :: angle
    integer :: k

    do k = 1, 8
      angle = pi*(2.0_wp*real(k, wp) - 1.0_wp)/8.0_wp
      x(:, k) = at*e1 + 0.5_wp*width/cos(pi/8.0_wp)*(cos(angle)*e2 + sin(angle)*e3)
    end do
  end function octagon

  !> A fluke of the dolos: two tapered legs, the stretch between them that carries the shank, and
  !! the two wedges that fill the corners between its slanted sides and the end of the shank.
  subroutine add_fluke(height, origin, axes, points, parts)
    real(wp), intent(in) :: height, origin(3)   !! of the fluke, its middle [m]
    real(wp), intent(in) :: axes(3, 3)          !! towards the shank, across, along the fluke
    type(points_t), intent(inout) :: points
    type(parts_t), intent(inout) :: parts
    real(wp) :: w, a, b, h, ring(3, 8, 2)
    integer :: s

    w = 0.5_wp*dolos_waist*height
    a = w*tan(pi/8.0_wp)
    do s = -1, 1, 2
      ring(:, :, 1) = at_origin(octagon(axes(:, 3), axes(:, 1), axes(:, 2), real(s, wp)*w, 2*w))
      ring(:, :, 2) = at_origin(octagon(axes(:, 3), axes(:, 1), axes(:, 2), &
                                        real(s, wp)*0.5_wp*height, dolos_tip*height))
      call add_frustum(ring(:, :, 1), ring(:, :, 2), points, parts)
    end do
    call begin_part(parts)
    call add_face(at_origin(octagon(axes(:, 3), axes(:, 1), axes(:, 2), w, 2*w)), points, parts)
    call add_face(at_origin(octagon(axes(:, 3), axes(:, 1), axes(:, 2), -w, 2*w)), points, parts)
    call face([w, -a, -w, w, a, -w, w, a, w, w, -a, w])
    call face([-w, -a, -w, -w, a, -w, -w, a, w, -w, -a, w])
    do s = -1, 1, 2   ! the sides of the middle stretch, cut where the wedge begins
      b = real(s, wp)*a
      h = real(s, wp)*w
      call face([w, b, -w, w, b, w, a, h, a, a, h, -a])
      call face([w, b, w, a, h, w, a, h, a])
      call face([w, b, -w, a, h, -w, a, h, -a])
      call face([-a, h, w, a, h, w, a, h, a])
      call face([-a, h, w, a, h, a, a, h, -a, -a, h, -w])
      call face([-a, h, -w, a, h, -a, a, h, -w])
      call face([-a, h, -w, -a, h, w, -w, b, w, -w, b, -w])
    end do
    call end_part(points, parts)
    do s = -1, 1, 2   ! wedges
      b = real(s, wp)*a
      h = real(s, wp)*w
      call begin_part(parts)
      call face([w, b, -w, w, b, w, a, h, a, a, h, -a])
      call face([w, b, -w, w, b, w, w, h, a, w, h, -a])
      call face([w, b, w, w, h, a, a, h, a])
      call face([w, b, -w, w, h, -a, a, h, -a])
      call face([w, h, a, w, h, -a, a, h, -a, a, h, a])
      call end_part(points, parts)
    end do
  contains
    pure function at_origin(x) result(y)
      real(wp), intent(in) :: x(:, :)
      real(wp) :: y(3, size(x, 2))

      y = x + spread(origin, 2, size(x, 2))
    end function at_origin

    !> Add a face by its corners along the axes.
    subroutine face(x)
      real(wp), intent(in) :: x(:)

      call add_face(at_origin(matmul(axes, reshape(x, [3, size(x)/3]))), points, parts)
    end subroutine face

  end subroutine add_fluke

  !> Tetrahedra and surface of a block from its parts in the fewest pieces and in finer ones.
  pure subroutine assemble(points, coarse, fine, n_cuts, shape)
    type(points_t), intent(inout) :: points
    type(parts_t), intent(in) :: coarse, fine
    integer, intent(in) :: n_cuts
    type(shape_t), intent(inout) :: shape

    call tets_of_parts(coarse, .false., 1, points, shape%flow_tet)
    call net_of_parts(coarse, shape%facet, shape%facet_point)
    call tets_of_parts(fine, .true., n_cuts, points, shape%tet)
    shape%point = points%x(:, :points%n)
    call merge_flat_facets(shape%point, shape%facet, shape%facet_point)
  end subroutine assemble

end module armour_units_m
