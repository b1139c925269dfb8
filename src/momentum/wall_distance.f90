!> How far the fluid and the centre of a cell are from the wall in a cut cell, taken as a plane.
module wall_distance_m
  use kinds_m, only: wp
  use grid_m, only: grid_t
  use solid_geometry_m, only: solid_geometry_t, wall_area, link_to_wall
  use plic_m, only: unit_constant
  implicit none
  private
  public :: wall_normal, distance_to_fluid, distance_to_centre, distance_by_links

contains

  !> Normal of the wall in a cell, into the fluid, from what its open faces lack to close; zero
  !! where the walls cancel.
  pure function wall_normal(grid, solid, c) result(n)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: c(3)
    real(wp) :: n(3)
    real(wp), parameter :: min_wall = 1.0e-6_wp   !! area of a wall that has a normal, in faces

    n = wall_area(grid, solid, c)
    if (norm2(n) > min_wall*minval(grid%area)) then
      n = n/norm2(n)
    else
      n = 0.0_wp
    end if
  end function wall_normal

  !> Distance of the middle of the fluid of a cell from the wall in a cut cell c, taken as a plane
  !! [m].
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

  !> Distance of the centre of a cut cell c from its wall, taken as a plane; below zero in a small
  !! cell [m].
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

  !> Distance of the centre of cell c from a plane wall of normal n that pulls as its wall links do
  !! together; 0 if it has none [m].
  pure function distance_by_links(grid, solid, c, n) result(y)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: c(3)
    real(wp), intent(in) :: n(3)
    real(wp) :: y
    real(wp) :: length, seen, pull   !! cells; area of the wall along the links, area over length
    integer :: d

    seen = 0.0_wp
    pull = 0.0_wp
    do d = 1, 3
      length = link_to_wall(solid, c, d, -nint(sign(1.0_wp, n(d))))
      if (length <= 0.0_wp) cycle
      seen = seen + grid%area(d)*abs(n(d))
      pull = pull + grid%area(d)/(length*grid%h(d))
    end do
    y = seen/max(pull, tiny(pull))
  end function distance_by_links

end module wall_distance_m
