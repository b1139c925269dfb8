!> Cut cells with their centre in a block in which the wall is no plane but has an edge.
!!
!! Measure is a plane wall with the same normal that leaves the cell as much fluid: where the cell
!! has an edge of a block, its faces are open more than behind that, by 0.2 of a face and more where
!! an upright edge takes the centre of the cell, by less than 0.1 with a sphere eight cells wide.
module wall_edges_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use grid_m, only: grid_t
  use solid_geometry_m, only: solid_geometry_t, apertures
  use plic_m, only: unit_constant, unit_volume
  implicit none
  private
  public :: find_edges, openings_of_plane, min_normal, round_edge

  real(wp), parameter :: round_edge = 0.1_wp, sharp_edge = 0.2_wp
    !! excess of openings up to which a wall counts as plane, and from which it has an edge [faces]
  real(wp), parameter :: min_normal = 1.0e-6_wp   !! of a normal or its parts that count

contains

  !> Of each cut cell the openings behind a plane wall, `solid%behind_plane`, and how much of an
  !! edge it has, `solid%edge`: 0 behind a wall that is nearly plane, 1 with an edge; none if its
  !! centre lies in fluid.
  subroutine find_edges(grid, solid)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(inout) :: solid
    real(wp) :: w(3, 2), excess
    integer :: m

    call ensure_capacity(solid%n_cut, solid%edge)
    call ensure_capacity(solid%n_cut, solid%behind_plane)
    !$omp parallel do private(w, excess) schedule(static)
    do m = 1, solid%n_cut
      associate (c => solid%cut_cell(:, m), plane => solid%behind_plane(:, m))
        solid%edge(m) = 0.0_wp
        plane = 2.0_wp
        if (any(c >= grid%last)) cycle
        w = apertures(grid, solid%aperture, c)
        if (maxval(abs(w(:, 2) - w(:, 1))) < min_normal) cycle
        plane = openings_of_plane(w(:, 2) - w(:, 1), solid%alpha(c(1), c(2), c(3)))
        if (solid%inside(c(1), c(2), c(3)) == 0) cycle
        excess = maxval(sum(w, 2) - plane)
        solid%edge(m) = max(0.0_wp, min(1.0_wp, (excess - round_edge)/(sharp_edge - round_edge)))
      end associate
    end do
  end subroutine find_edges

  !> Open share of both faces of each direction together behind a plane wall in the unit cube; 2
  !! where the wall lies along these faces, since to round-off it is on either side of them.
  pure function openings_of_plane(normal, alpha) result(both)
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
  end function openings_of_plane

end module wall_edges_m
