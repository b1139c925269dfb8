!> The wall in a cut cell taken as a plane: its normal, how far from it fluid and centre of a cell
!! are, and the apertures behind it (docs/theory.md, section 17).
module wall_plane_m
  use kinds_m, only: wp
  use vectors_m, only: norm
  use grid_m, only: grid_t
  use solid_geometry_m, only: solid_geometry_t, wall_area, link_to_wall
  use plic_m, only: unit_constant, unit_volume
  implicit none
  private
  public :: wall_normal, distance_to_fluid, distance_to_centre, distance_by_links
  public :: distance_of_links, apertures_of_plane, min_normal

  real(wp), parameter :: min_normal = 1.0e-6_wp   !! of a normal or its parts that count [faces]

contains

  !> Normal of the wall in a cell, into the fluid, from what its open faces lack to close; zero
  !! where the walls cancel.
  pure function wall_normal(grid, solid, c) result(n)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: c(3)
    real(wp) :: n(3)

    n = wall_area(grid, solid, c)
    if (norm(n) > min_normal*minval(grid%area)) then
      n = n/norm(n)
    else
      n = 0.0_wp
    end if
  end function wall_normal

  !> Distance of the middle of the fluid of a cell from the wall in cut cell c [m].
  pure function distance_to_fluid(grid, solid, c, step, n) result(distance)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: c(3), step(3)   !! from the cut cell to the cell of the fluid
    real(wp), intent(in) :: n(3)           !! of the wall
    real(wp) :: distance
    integer :: o(3)

    o = c + step
    distance = distance_to_centre(grid, solid, c, n) + dot_product(n, real(step, wp)*grid%h) &
               + level_of(grid, n, 0.5_wp*(1.0_wp + solid%alpha(o(1), o(2), o(3))))
  end function distance_to_fluid

  !> Distance of the centre of cut cell c from its wall; below zero in a small cell [m].
  pure function distance_to_centre(grid, solid, c, n) result(distance)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: c(3)
    real(wp), intent(in) :: n(3)           !! of the wall
    real(wp) :: distance

    distance = -level_of(grid, n, solid%alpha(c(1), c(2), c(3)))
  end function distance_to_centre

  !> Place along the normal of the plane below which a share of a cell lies, from its centre [m].
  pure function level_of(grid, n, share) result(level)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: n(3), share
    real(wp) :: level

    level = unit_constant(n*grid%h, share) - 0.5_wp*sum(n*grid%h)
  end function level_of

  !> Distance of the centre of cell c from a wall of normal n that drags as the face coefficients of
  !! the cell to walls do together, sum A_d |n_d|/sum A_d/l_d; 0 if it has none [m].
  pure function distance_by_links(grid, solid, c, n) result(y)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: c(3)
    real(wp), intent(in) :: n(3)
    real(wp) :: y
    real(wp) :: length, seen, pull   !! cells; area of the wall along the lines, area over length
    integer :: d

    seen = 0.0_wp
    pull = 0.0_wp
    do d = 1, 3
      length = link_to_wall(solid, c, d, -nint(sign(1.0_wp, n(d))))
      if (length <= 0.0_wp .or. abs(n(d)) < min_normal) cycle   ! or the wall is on neither side
      seen = seen + grid%area(d)*abs(n(d))
      pull = pull + grid%area(d)/(length*grid%h(d))
    end do
    y = seen/max(pull, tiny(pull))
  end function distance_by_links

  !> The same without a normal, of the plane on which the lines from the centre end,
  !! 1/y^2 = sum 1/l^2 [m]; huge without walls.
  pure function distance_of_links(grid, solid, c) result(y)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: c(3)
    real(wp) :: y
    real(wp) :: inverse, length
    integer :: d, sense

    inverse = 0.0_wp
    do d = 1, 3
      do sense = -1, 1, 2
        length = link_to_wall(solid, c, d, sense)*grid%h(d)
        if (length > 0.0_wp) inverse = inverse + 1.0_wp/length**2
      end do
    end do
    y = 1.0_wp/sqrt(max(inverse, tiny(inverse)))
  end function distance_of_links

  !> Apertures of both faces of each direction together behind a plane wall in the unit cube; 2
  !! where the wall lies along these faces, since to round-off it is on either side of them.
  pure function apertures_of_plane(normal, alpha) result(both)
    real(wp), intent(in) :: normal(3)   !! of the wall, into the fluid, of any length
    real(wp), intent(in) :: alpha       !! solid share of the cell
    real(wp) :: both(3)
    real(wp) :: n(3), across(3), at
    integer :: d

    n = normal/sum(abs(normal))
    at = unit_constant(n, alpha)
    both = 2.0_wp
    do d = 1, 3
      across = n
      across(d) = 0.0_wp
      if (sum(abs(across)) < min_normal) cycle
      both(d) = 2.0_wp - unit_volume(across, at) - unit_volume(across, at - n(d))
    end do
  end function apertures_of_plane

end module wall_plane_m
