!> Two sharp edges of two bodies that cross: how deep, along which normal, and whether it counts.
!!
!! Each edge is the border of a wedge. They touch along n, the normal of both lines, if n lies in
!! the fan of outward normals of each wedge (between those of its two facets), and if the deepest
!! place of one of them in the wedge of the other lies between its ends and beside the other edge:
!! past its ends its corners touch instead. These conditions fade in and out.
module edge_crossing_m
  use kinds_m, only: wp
  use vectors_m, only: cross, norm
  implicit none
  private
  public :: edge_t, crossing_t, cross_edges, turn_before, way_apart

  !> A convex edge, in any axes.
  type :: edge_t
    real(wp) :: start(3) = 0.0_wp, along(3) = 0.0_wp   !! one end [m], unit vector to the other
    real(wp) :: extent = 0.0_wp                        !! length [m]
    real(wp) :: into(3, 2) = 0.0_wp      !! unit vectors across the edge, into its two facets
    real(wp) :: outward(3) = 0.0_wp      !! between the normals of the two facets
  end type edge_t

  type :: crossing_t
    real(wp) :: depth = 0.0_wp           !! of one line behind the other; < 0: apart [m]
    real(wp) :: weight = 0.0_wp          !! 0: does not count, 1: counts [-]
    real(wp) :: normal(3) = 0.0_wp       !! unit vector from the guest into the host
    real(wp) :: place(3) = 0.0_wp        !! half way between the lines [m]
  end type crossing_t

  real(wp), parameter :: min_sine2 = 1.0e-4_wp   !! edges nearer to parallel never cross
  real(wp), parameter :: beside = 0.15_wp   !! sine of the angle by which n may leave a fan
  real(wp), parameter :: share = 1.0_wp    !! of the depth: width in which an end fades
  real(wp), parameter :: min_weight = 0.02_wp      !! what is below is nothing
  real(wp), parameter :: min_share = 0.01_wp   !! of the edge: the least such width

contains

  !> Crossing of an edge of the guest and one of the host; weight 0 where there is none with a depth
  !! between `least` and `most`.
  pure subroutine cross_edges(guest, host, least, most, crossing)
    type(edge_t), intent(in) :: guest, host   !! in the same axes
    real(wp), intent(in) :: least             !! <= 0 [m]
    real(wp), intent(in) :: most              !! > 0 [m]
    type(crossing_t), intent(out) :: crossing
    real(wp) :: d(3), n(3), sine2, sine, depth, s, t, cosine, peak_s, peak_t, ends(2)

    associate (u => guest%along, w => host%along)
      d = host%start - guest%start
      n(1) = u(2)*w(3) - u(3)*w(2)   ! written out: most calls end here
      n(2) = u(3)*w(1) - u(1)*w(3)
      n(3) = u(1)*w(2) - u(2)*w(1)
      sine2 = n(1)*n(1) + n(2)*n(2) + n(3)*n(3)
      if (sine2 < min_sine2) return
      depth = d(1)*n(1) + d(2)*n(2) + d(3)*n(3)
      if (dot_product(n, host%outward) < 0.0_wp) depth = -depth
      if (depth <= 0.0_wp .and. depth**2 >= least**2*sine2) return
      if (depth > 0.0_wp .and. depth**2 >= most**2*sine2) return
      s = dot_product(cross(d, w), n)/sine2   ! nearest places of the two lines
      t = dot_product(cross(d, u), n)/sine2
      depth = depth/sqrt(sine2)
      n = n/sign(sqrt(sine2), -dot_product(n, host%outward))
      crossing%weight = in_fan(n, guest%into)*in_fan(-n, host%into)
      if (crossing%weight <= 0.0_wp) return
      cosine = dot_product(u, w)
      peak_s = s + depth*lean(n, u, host%into)
      peak_t = t + depth*lean(-n, w, guest%into)
      sine = sqrt(sine2)
      ends = [between_ends(peak_s, guest%extent, depth, sine) &
        *between_ends(t + cosine*(peak_s - s), host%extent, depth, sine), &
        between_ends(peak_t, host%extent, depth, sine) &
        *between_ends(s + cosine*(peak_t - t), guest%extent, depth, sine)]
      crossing%weight = crossing%weight*(ends(1) + ends(2) - ends(1)*ends(2))   ! one of both
      if (crossing%weight < min_weight) crossing%weight = 0.0_wp
      crossing%depth = depth
      crossing%normal = n
      crossing%place = guest%start + s*u - 0.5_wp*depth*n
    end associate
  end subroutine cross_edges

  !> Angle by which two edges may turn before they can count; zero where they may at once [rad].
  pure function turn_before(guest, host) result(angle)
    type(edge_t), intent(in) :: guest, host   !! in the same axes
    real(wp) :: angle
    real(wp), parameter :: safety = 1.5_wp
    real(wp) :: n(3), sine, outside

    n = cross(guest%along, host%along)
    sine = norm(n)
    angle = 0.0_wp
    if (sine <= 0.0_wp) return
    n = n/sign(sine, -dot_product(n, host%outward))
    outside = max(maxval(matmul(n, guest%into)), maxval(matmul(-n, host%into))) - beside
    ! n turns by angle/sine, the fans by the angle
    angle = min(0.2_wp*sine, max(0.0_wp, outside)/(safety*(1.0_wp + 1.0_wp/sine)))
  end function turn_before

  !> Way that two bodies may move before two edges of theirs that are apart can cross; zero where
  !! that is hard to say [m].
  !!
  !! The distance of two lines changes by the way of their nearest places along the normal. As long
  !! as the lines are far from parallel these places, and so their way, stay within bounds.
  pure function way_apart(guest, host, angle) result(way)
    type(edge_t), intent(in) :: guest, host   !! in the same axes
    real(wp), intent(in) :: angle             !! by which the edges may turn [rad]
    real(wp) :: way
    real(wp), parameter :: min_sine = 0.3_wp, max_angle = 0.1_wp, min_cosine = 0.5_wp
    real(wp), parameter :: lever = 3.0_wp     !! way of the nearest places over that of the bodies
    real(wp) :: n(3), d(3), sine, s, t

    way = 0.0_wp
    if (angle > max_angle) return
    n = cross(guest%along, host%along)
    sine = norm(n)
    if (sine < min_sine) return
    n = n/sign(sine, -dot_product(n, host%outward))
    if (-dot_product(n, host%outward) < min_cosine*norm(host%outward)) return
    d = host%start - guest%start
    s = dot_product(cross(d, host%along), cross(guest%along, host%along))/sine**2
    t = dot_product(cross(d, guest%along), cross(guest%along, host%along))/sine**2
    if (abs(s - 0.5_wp*guest%extent) > guest%extent) return
    if (abs(t - 0.5_wp*host%extent) > host%extent) return
    way = max(0.0_wp, dot_product(d, n)/lever)
  end function way_apart

  !> One where a normal is in the fan of an edge, falling to zero beside it.
  pure function in_fan(normal, into) result(part)
    real(wp), intent(in) :: normal(3), into(3, 2)
    real(wp) :: part

    part = fade(1.0_wp - maxval(matmul(normal, into))/beside)
  end function in_fan

  !> From 0 to 1 as x goes from 0 to 1, without a kink: a block would tremble on one.
  elemental function fade(x) result(part)
    real(wp), intent(in) :: x
    real(wp) :: part

    part = max(0.0_wp, min(1.0_wp, x))
    part = part**2*(3.0_wp - 2*part)
  end function fade

  !> From the place of an edge nearest to another to the place where it is deepest between the two
  !! facets of the other, over the depth [-].
  !!
  !! At s from the nearest place the edge is depth*(n.n_i) + s (u.n_i) above facet i, whose outward
  !! normal is n_i; where it is deepest the two are equal.
  pure function lean(n, u, into) result(way)
    real(wp), intent(in) :: n(3)         !! into the other body; normal to both edges
    real(wp), intent(in) :: u(3)         !! along the edge
    real(wp), intent(in) :: into(3, 2)   !! across the other edge, into its facets
    real(wp) :: way
    real(wp) :: slope

    ! n_1 ~ c into_1 - into_2 and n_2 ~ c into_2 - into_1 with the cosine c of the two directions
    slope = dot_product(u, into(:, 1) - into(:, 2))
    way = 0.0_wp
    if (abs(slope) > 0.0_wp) way = -dot_product(n, into(:, 1) - into(:, 2))/slope
  end function lean

  !> One along an edge, falling to zero at its ends. By a shift of the bodies the crossing runs
  !! along the edge up to 1/sine times as far: the force that turns it back is no stiffer.
  pure function between_ends(place, extent, depth, sine) result(part)
    real(wp), intent(in) :: place, extent   !! from the start of the edge; of the edge [m]
    real(wp), intent(in) :: depth           !! [m]
    real(wp), intent(in) :: sine            !! of the angle between the edges
    real(wp) :: part

    part = fade(min(place, extent - place)/(max(share*depth, min_share*extent)/sine))
  end function between_ends

end module edge_crossing_m
