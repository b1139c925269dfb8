!> One body in the grid: its share of every cell and face, and where grid lines meet its surface.
!!
!! Only the surface is looked at, never the inside. Under each facet stands a prism that reaches
!! down to the bottom of the grid; the volume of the body in a cell is the sum of the prisms of the
!! facets that look up less those of the facets that look down. In the cell a facet passes through,
!! its prism is integrated over the piece of the facet in that cell; cells further down take the
!! whole column, by a running sum. The same one dimension lower gives the solid share of a face:
!! areas under the lines in which the facets cut the plane of the face. Nothing has to be classified
!! as inside or outside, so nothing can be misjudged: the sums are exact to round-off wherever the
!! facets lie.
!!
!! Lengths are in cells and counted from a whole number of cells near the body, so images in other
!! periods and other processes get the same bits. Corners that lie on a grid plane but for round-off
!! are put on it, facets within a hundred-thousandth of a cell, too, and those as near to a plane of
!! centres beyond it: the two sides of a body that is aligned with the grid are then seen alike,
!! whatever the last digits of its pose, and a cube that falls straight down does not spin. A corner
!! on a plane counts as below the plane, everywhere, so the lines of a face are those just above it;
!! a facet that lies in the plane and ends the body there adds its own area. A face is therefore
!! solid where the body touches it from either side, and full cells are closed all round.
!!
!! Departure from the paper, which counts the centres of sub-cells that lie in a tetrahedron
!! (`subcell_shares_m`): those are off by up to 0.08 of a cell. Cutting the tetrahedra themselves
!! gives the same shares to round-off (tested), but takes all tetrahedra instead of the surface.
module body_shares_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use vectors_m, only: rotation_matrix
  use grid_m, only: grid_t
  use tet_mesh_m, only: shape_t
  use share_lists_m, only: body_shares_t, start_lists, full_face
  use share_row_m, only: share_row_t, ensure_row, sum_row, close_columns, &
    list_row, hits_along_y
  implicit none
  private
  public :: find_body_shares

  real(wp), parameter :: round_off = 1.0e-9_wp     !! corners so near a plane are on it [cells]
  real(wp), parameter :: on_plane = 1.0e-5_wp      !! facets so near a plane are in it [cells]

contains

  !> Find the shares of a body of some shape at a pose; nothing is done if they are known already.
  !! When they have changed, `list_cut_tets` completes them.
  subroutine find_body_shares(grid, shape, x, q, work, self, changed)
    type(grid_t), intent(in) :: grid
    type(shape_t), intent(in) :: shape
    real(wp), intent(in) :: x(3), q(4)        !! centroid [m], attitude
    type(share_row_t), intent(inout) :: work
    type(body_shares_t), intent(inout) :: self
    logical, intent(out) :: changed
    integer :: j

    changed = .not. (self%known .and. all(abs(self%x - x) <= 0.0_wp) &
                     .and. all(abs(self%q - q) <= 0.0_wp))
    if (.not. changed) return
    self%x = x
    self%q = q
    self%known = .true.
    self%n_cell = 0
    self%n_face = 0
    self%n_hit = 0
    call place_corners(grid, shape, self, work)
    call start_lists(self)
    call ensure_row(self, work)
    do j = self%low(2), self%high(2)
      call sum_row(shape, j, self, work)
      call close_columns(self, work)
      call list_row(j, self, work)
    end do
    call hits_along_y(shape, self, work)
  end subroutine find_body_shares

  !> Corners in cells, from a base cell near the centroid; boxes around the facets and the body.
  subroutine place_corners(grid, shape, self, work)
    type(grid_t), intent(in) :: grid
    type(shape_t), intent(in) :: shape
    type(body_shares_t), intent(inout) :: self
    type(share_row_t), intent(inout) :: work
    real(wp) :: r(3, 3), x(3), centre(3), digits(3), tolerance(3), plane
    integer :: d, v, m, n

    n = size(shape%point, 2)
    call ensure_capacity(n, work%point)
    call ensure_capacity(n, work%seen)
    r = rotation_matrix(self%q)
    centre = (self%x - grid%origin)/grid%h
    self%base = floor(centre)
    digits = 4.0_wp*epsilon(1.0_wp)*abs(centre)
    tolerance = on_plane + digits
    centre = centre - real(self%base, wp)
    do v = 1, n
      x = centre + matmul(r, shape%point(:, v))/grid%h
      work%point(:, v) = merge(anint(x), x, abs(x - anint(x)) < round_off + digits)
    end do
    work%seen(:, :n) = work%point(:, :n)
    ! facets that lie in a plane, but for a little: of the grid; of centres, which see them a little
    ! beyond it, seen from the middle of the body
    do m = 1, size(shape%facet) - 1
      associate (p => shape%facet_point(shape%facet(m):shape%facet(m + 1) - 1))
        do d = 1, 3
          plane = 0.5_wp*anint(2.0_wp*work%point(d, p(1)))
          if (.not. all(abs(work%point(d, p) - plane) < tolerance(d))) cycle
          if (abs(plane - anint(plane)) > 0.0_wp) then
            work%seen(d, p) = plane + sign(tolerance(d), plane - centre(d))
          else
            work%point(d, p) = plane
            work%seen(d, p) = plane
          end if
        end do
      end associate
    end do
    n = size(shape%facet) - 1
    call ensure_capacity(n, work%low)
    call ensure_capacity(n, work%high)
    do m = 1, n
      associate (p => shape%facet_point(shape%facet(m):shape%facet(m + 1) - 1))
        do d = 1, 3
          work%low(d, m) = minval(work%point(d, p))
          work%high(d, m) = maxval(work%point(d, p))
        end do
      end associate
    end do
    do d = 1, 3
      self%low(d) = floor(minval(work%low(d, :n))) + 1
      self%high(d) = floor(maxval(work%high(d, :n)) + full_face) + 1   ! also above its last plane
    end do
    n = size(shape%flow_tet, 2)
    if (allocated(self%corner)) then
      if (size(self%corner, 3) /= n) deallocate (self%corner)
    end if
    if (.not. allocated(self%corner)) allocate (self%corner(3, 4, n))
    do m = 1, n
      self%corner(:, :, m) = work%point(:, shape%flow_tet(:, m))
    end do
  end subroutine place_corners

end module body_shares_m
