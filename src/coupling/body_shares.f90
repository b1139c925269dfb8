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
!! periods and other processes get the same bits. Corners within round-off of a grid plane are put
!! on it. A corner on a plane counts as below the plane, everywhere, so the lines of a face are
!! those just above it; a facet that lies in the plane and ends the body there adds its own area. A
!! face is therefore solid where the body touches it from either side, and full cells are closed
!! all round.
!!
!! Departure from the paper, which counts the centres of sub-cells that lie in a tetrahedron
!! (`subcell_shares_m`): those are off by up to 0.08 of a cell. Cutting the tetrahedra themselves
!! gives the same shares to round-off (tested), but takes all tetrahedra instead of the surface.
module body_shares_m
  use kinds_m, only: wp
  use growing_m, only: ensure_room
  use vectors_m, only: cross, rotation_matrix
  use grid_m, only: grid_t, unit_step
  use tet_mesh_m, only: shape_t, most_facet_corners
  use polyhedron_m, only: tet_volume
  implicit none
  private
  public :: body_shares_t, share_work_t, find_body_shares, list_cut_tets, full_cell, full_face
  public :: faces_of_tet, add_face, along, up   ! for counted shares

  real(wp), parameter :: least_share = 1.0e-13_wp     !! smaller shares are dropped
  real(wp), parameter :: full_cell = 1.0e-12_wp       !! a cell lacking less is full
  real(wp), parameter :: full_face = 1.0e-9_wp        !! a face lacking less is closed
  real(wp), parameter :: on_plane = 1.0e-13_wp     !! corners so near a grid plane are on it [cells]
  real(wp), parameter :: near_face = 1.0e-12_wp    !! a gap that parts no cell from a tetrahedron
  integer, parameter :: max_polygon = most_facet_corners + 12   !! corners of a facet cut to a cell

  !> Corners of the outward face opposite each corner of a tetrahedron.
  integer, parameter :: opposite(3, 4) = reshape([2, 3, 4, 1, 4, 3, 1, 2, 4, 1, 3, 2], [3, 4])

  !> What is known of one body. Cell i of these lists is cell `base + i` of the grid.
  type :: body_shares_t
    logical :: known = .false.                 !! the lists belong to the pose x, q
    real(wp) :: x(3) = 0.0_wp, q(4) = 0.0_wp
    integer :: base(3) = 0
    integer :: low(3) = 0, high(3) = 0         !! cells of the box around the body
    real(wp), allocatable :: corner(:, :, :)   !! (3, 4, tets) of the parts for the flow [cells]
    integer :: n_cell = 0
    integer, allocatable :: cell(:, :)         !! (3, *)
    logical, allocatable :: inside(:)          !! the body holds the centre of the cell
    real(wp), allocatable :: alpha(:)          !! share of the cell [-]
    real(wp), allocatable :: centroid(:, :)    !! (3, *) of the part, from the cell's corner [cells]
    !> Tetrahedra that may touch cell m, if it is cut: `tet(first_tet(m):first_tet(m+1)-1)`.
    integer, allocatable :: first_tet(:), tet(:)
    integer :: n_face = 0
    integer, allocatable :: face(:, :)         !! (4, *) cell and direction of its lower face
    real(wp), allocatable :: beta(:)           !! share of the face [-]
    real(wp), allocatable :: face_centroid(:, :)   !! (3, *) likewise
    integer :: n_hit = 0
    integer, allocatable :: hit(:, :)          !! (4, *) leg: cell and direction of the lower face
    real(wp), allocatable :: at(:)             !! (*) place on the leg, 0: lower centre, 1: upper
  end type body_shares_t

  !> Flat polygon.
  type :: polygon_t
    integer :: n = 0
    real(wp) :: x(3, max_polygon)
  end type polygon_t

  !> Sums over one row of cells (fixed y), for one thread.
  type :: share_work_t
    real(wp), allocatable :: point(:, :)       !! (3, points) corners of the body [cells]
    real(wp), allocatable :: low(:, :), high(:, :)   !! (3, facets) boxes of the facets [cells]
    !> (7, x, z) volume and first moment; area of the column further down and its moments in x, y.
    real(wp), allocatable :: volume(:, :, :)
    !> (5, x, z, d) area of the lower face d, first moments along and up the columns, length of the
    !! column further down and its moment.
    real(wp), allocatable :: area(:, :, :, :)
    integer, allocatable :: crossings(:, :)    !! (x, z) surfaces passed upwards between two centres
    logical, allocatable :: full(:, :)         !! (x, z) the cell of the row before is full
    ! To find the tetrahedra of cut cells.
    integer, allocatable :: number(:, :, :)    !! place in the list of a cut cell, 0 elsewhere
    integer, allocatable :: run(:, :, :)       !! (4, y, z) ends of the first run of cut cells,
                                               !! of the rest
    integer, allocatable :: pair(:, :)         !! (2, *) cell, tetrahedron
  end type share_work_t

  !> Columns of the faces of each direction: side by side along `along`, stacked in `up`; the sign
  !! makes areas under lines positive where the body is below the line.
  integer, parameter :: along(3) = [2, 1, 2], up(3) = [3, 3, 1]
  real(wp), parameter :: turn(3) = [1.0_wp, -1.0_wp, -1.0_wp]

contains

  !> Find the shares of a body of some shape at a pose; nothing is done if they are known already.
  !! When they have changed, `list_cut_tets` completes them.
  subroutine find_body_shares(grid, shape, x, q, work, self, changed)
    type(grid_t), intent(in) :: grid
    type(shape_t), intent(in) :: shape
    real(wp), intent(in) :: x(3), q(4)        !! centroid [m], attitude
    type(share_work_t), intent(inout) :: work
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
    call prepare_rows(self, work)
    do j = self%low(2), self%high(2)
      call sum_row(shape, j, self, work)
      call close_columns(self, work)
      call close_full_cells(self, work)
      call list_row(j, self, work)
    end do
    call hits_along_y(shape, self, work)
  end subroutine find_body_shares

  !> Tetrahedra of the cut cells among the cells listed.
  subroutine list_cut_tets(work, self)
    type(share_work_t), intent(inout) :: work
    type(body_shares_t), intent(inout) :: self

    call mark_cut_cells(self, work)
    call pair_tets(self, work)
  end subroutine list_cut_tets

  !> Corners in cells, from a base cell near the centroid; boxes around the facets and the body.
  subroutine place_corners(grid, shape, self, work)
    type(grid_t), intent(in) :: grid
    type(shape_t), intent(in) :: shape
    type(body_shares_t), intent(inout) :: self
    type(share_work_t), intent(inout) :: work
    real(wp) :: r(3, 3), centre(3), tolerance(3)
    integer :: d, v, m, n

    n = size(shape%point, 2)
    call ensure_room(n, work%point)
    r = rotation_matrix(self%q)
    centre = (self%x - grid%origin)/grid%h
    self%base = floor(centre)
    tolerance = on_plane + 4.0_wp*epsilon(1.0_wp)*abs(centre)
    centre = centre - real(self%base, wp)
    do v = 1, n
      do d = 1, 3
        work%point(d, v) = centre(d) + dot_product(r(d, :), shape%point(:, v))/grid%h(d)
        if (abs(work%point(d, v) - anint(work%point(d, v))) < tolerance(d)) then
          work%point(d, v) = anint(work%point(d, v))
        end if
      end do
    end do
    n = size(shape%facet) - 1
    call ensure_room(n, work%low)
    call ensure_room(n, work%high)
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

  !> Cells that hold the stretch from a to b; a point on a plane belongs to the cell above it.
  pure subroutine cells_between(a, b, first, last)
    real(wp), intent(in) :: a, b          !! a <= b [cells]
    integer, intent(out) :: first, last

    first = floor(a) + 1
    last = max(first, ceiling(b))
  end subroutine cells_between

  !> Make the arrays of a row long enough for the body; they only grow.
  subroutine prepare_rows(self, work)
    type(body_shares_t), intent(inout) :: self
    type(share_work_t), intent(inout) :: work
    integer :: m(3)

    m = max(abs(self%low), abs(self%high)) + 1
    if (allocated(work%volume)) then
      if (any(ubound(work%number) < m)) then
        m = max(m, ubound(work%number))
        deallocate (work%volume, work%area, work%crossings, work%full, work%number, work%run)
      end if
    end if
    if (.not. allocated(work%volume)) then
      allocate (work%volume(7, -m(1):m(1), -m(3):m(3)), work%area(5, -m(1):m(1), -m(3):m(3), 3))
      allocate (work%crossings(-m(1):m(1), -m(3):m(3)), work%full(-m(1):m(1), -m(3):m(3)))
      allocate (work%number(-m(1):m(1), -m(2):m(2), -m(3):m(3)), source=0)
      allocate (work%run(4, -m(2):m(2), -m(3):m(3)))
    end if
    work%full(self%low(1):self%high(1), self%low(3):self%high(3)) = .false.
    call ensure_room(1, work%pair, rows=2)   ! a body may have no cell, no face or no hit
    call ensure_cell(1, self)
    call ensure_face(1, self)
    call ensure_hit(1, self)
  end subroutine prepare_rows

  !> Make room for n cells.
  pure subroutine ensure_cell(n, self)
    integer, intent(in) :: n
    type(body_shares_t), intent(inout) :: self

    call ensure_room(n, self%cell)
    call ensure_room(n, self%inside)
    call ensure_room(n, self%alpha)
    call ensure_room(n, self%centroid)
  end subroutine ensure_cell

  !> Make room for n faces.
  pure subroutine ensure_face(n, self)
    integer, intent(in) :: n
    type(body_shares_t), intent(inout) :: self

    call ensure_room(n, self%face, rows=4)
    call ensure_room(n, self%beta)
    call ensure_room(n, self%face_centroid)
  end subroutine ensure_face

  !> Make room for n hits.
  pure subroutine ensure_hit(n, self)
    integer, intent(in) :: n
    type(body_shares_t), intent(inout) :: self

    call ensure_room(n, self%hit, rows=4)
    call ensure_room(n, self%at)
  end subroutine ensure_hit

  !> Prisms, areas and crossings of all facets in the row of cells number j.
  subroutine sum_row(shape, j, self, work)
    type(shape_t), intent(in) :: shape
    integer, intent(in) :: j
    type(body_shares_t), intent(inout) :: self
    type(share_work_t), intent(inout) :: work
    type(polygon_t) :: facet, piece
    integer :: m, first, last

    work%volume(:, self%low(1):self%high(1), self%low(3):self%high(3)) = 0.0_wp
    work%area(:, self%low(1):self%high(1), self%low(3):self%high(3), :) = 0.0_wp
    work%crossings(self%low(1):self%high(1), self%low(3):self%high(3) + 1) = 0
    do m = 1, size(shape%facet) - 1
      call cells_between(work%low(2, m), work%high(2, m), first, last)
      if (j < first .or. j > last) cycle
      call load_facet(shape, m, work, facet)
      if (work%low(2, m) <= real(j - 1, wp)) call lines_in_plane(facet, real(j - 1, wp), work)
      call hits_in_row(facet, j, self, work)
      call clip_to_cells(facet, 2, j, work%low(2, m), work%high(2, m), piece)
      call sum_columns(piece, j, flat_direction(work%low(:, m), work%high(:, m)), work)
    end do
  end subroutine sum_row

  !> Direction of the grid plane in which a facet lies, 0 if it does not.
  pure function flat_direction(low, high) result(d)
    real(wp), intent(in) :: low(3), high(3)   !! box around the facet [cells]
    integer :: d

    do d = 3, 1, -1
      if (high(d) <= low(d) .and. abs(low(d) - anint(low(d))) <= 0.0_wp) return
    end do
  end function flat_direction

  !> The corners of a facet [cells].
  pure subroutine load_facet(shape, m, work, facet)
    type(shape_t), intent(in) :: shape
    integer, intent(in) :: m
    type(share_work_t), intent(in) :: work
    type(polygon_t), intent(inout) :: facet
    integer :: v

    facet%n = shape%facet(m + 1) - shape%facet(m)
    do v = 1, facet%n
      facet%x(:, v) = work%point(:, shape%facet_point(shape%facet(m) + v - 1))
    end do
  end subroutine load_facet

  !> Follow a piece of a facet, in row j, through the columns and cells of the row.
  subroutine sum_columns(piece, j, flat, work)
    type(polygon_t), intent(in) :: piece
    integer, intent(in) :: j
    integer, intent(in) :: flat   !! direction of the grid plane the facet lies in, 0: none
    type(share_work_t), intent(inout) :: work
    type(polygon_t) :: column, part
    real(wp) :: low, high, line(3, 2, 4), corner(3)
    integer :: i, k, m, n, first(2), last(2)

    if (piece%n < 3) return
    corner(2) = real(j - 1, wp)
    call cells_between(minval(piece%x(1, :piece%n)), maxval(piece%x(1, :piece%n)), &
                       first(1), last(1))
    do i = first(1), last(1)
      corner(1) = real(i - 1, wp)
      call cut_by_plane(piece, 1, corner(1), line, n)
      do m = 1, n
        call add_line(line(2:3, 1, m), line(2:3, 2, m), corner(2), i, 1, turn(1), work)
      end do
      call clip_to_cells(piece, 1, i, real(first(1) - 1, wp), real(last(1), wp), column)
      if (column%n < 3) cycle
      low = minval(column%x(3, :column%n))
      high = maxval(column%x(3, :column%n))
      call cells_between(low, high, first(2), last(2))
      do k = first(2), last(2)
        corner(3) = real(k - 1, wp)
        call cut_by_plane(column, 3, corner(3), line, n)
        do m = 1, n
          call add_piece(turn(3), line([2, 1], 1, m) - corner([2, 1]), &
                         line([2, 1], 2, m) - corner([2, 1]), work%area(:, i, k, 3))
        end do
        call clip_to_cells(column, 3, k, low, high, part)
        call add_prism(part, corner, work%volume(:, i, k))
        if (flat > 0) call add_end(part, corner, flat, work%area(:, i, k, flat))
      end do
    end do
  end subroutine sum_columns

  !> The part of a polygon between the lower and the upper plane of cell i in direction d.
  pure subroutine clip_to_cells(p, d, i, low, high, part)
    type(polygon_t), intent(in) :: p
    integer, intent(in) :: d, i
    real(wp), intent(in) :: low, high     !! range of the polygon in direction d, or more [cells]
    type(polygon_t), intent(inout) :: part
    type(polygon_t) :: above

    if (low >= real(i - 1, wp)) then
      if (high <= real(i, wp)) then
        call copy_polygon(p, part)
      else
        call clip(p, d, real(i, wp), .false., part)
      end if
    else if (high <= real(i, wp)) then
      call clip(p, d, real(i - 1, wp), .true., part)
    else
      call clip(p, d, real(i - 1, wp), .true., above)
      call clip(above, d, real(i, wp), .false., part)
    end if
  end subroutine clip_to_cells

  pure subroutine copy_polygon(p, q)
    type(polygon_t), intent(in) :: p
    type(polygon_t), intent(inout) :: q

    q%n = p%n
    q%x(:, :p%n) = p%x(:, :p%n)
  end subroutine copy_polygon

  !> Keep the part of a polygon above or below a plane, both with the plane itself.
  pure subroutine clip(p, d, plane, keep_above, part)
    type(polygon_t), intent(in) :: p
    integer, intent(in) :: d
    real(wp), intent(in) :: plane
    logical, intent(in) :: keep_above
    type(polygon_t), intent(inout) :: part
    real(wp) :: side, here, before
    integer :: v, w, n

    n = 0
    if (p%n > 0) then
      side = merge(1.0_wp, -1.0_wp, keep_above)
      w = p%n
      before = side*(p%x(d, w) - plane)
      do v = 1, p%n
        here = side*(p%x(d, v) - plane)
        if (here*before < 0.0_wp) then
          n = n + 1
          part%x(:, n) = crossing(p%x(:, w), p%x(:, v), d, plane)
        end if
        if (here >= 0.0_wp) then
          n = n + 1
          part%x(:, n) = p%x(:, v)
        end if
        w = v
        before = here
      end do
    end if
    part%n = n
  end subroutine clip

  !> Where the edge between two points meets a plane; the same bits from either end.
  pure function crossing(a, b, d, plane) result(x)
    real(wp), intent(in) :: a(3), b(3)
    integer, intent(in) :: d
    real(wp), intent(in) :: plane
    real(wp) :: x(3)

    if (a(d) < b(d)) then
      x = a + (plane - a(d))/(b(d) - a(d))*(b - a)
    else
      x = b + (plane - b(d))/(a(d) - b(d))*(a - b)
    end if
    x(d) = plane
  end function crossing

  !> Lines in which a polygon meets the plane x(d) = plane, from where its outline rises through the
  !! plane to where it falls; a flat convex polygon has one or none. Corners on the plane are below.
  pure subroutine cut_by_plane(p, d, plane, line, n)
    type(polygon_t), intent(in) :: p
    integer, intent(in) :: d
    real(wp), intent(in) :: plane
    real(wp), intent(inout) :: line(3, 2, 4)
    integer, intent(out) :: n
    logical :: above, was_above
    integer :: v, w, rising, falling

    rising = 0
    falling = 0
    w = p%n
    was_above = p%x(d, w) > plane
    do v = 1, p%n
      above = p%x(d, v) > plane
      if (above .neqv. was_above) then
        if (above .and. rising < 4) then
          rising = rising + 1
          line(:, 1, rising) = crossing(p%x(:, w), p%x(:, v), d, plane)
        else if (.not. above .and. falling < 4) then
          falling = falling + 1
          line(:, 2, falling) = crossing(p%x(:, w), p%x(:, v), d, plane)
        end if
      end if
      w = v
      was_above = above
    end do
    n = min(rising, falling)
  end subroutine cut_by_plane

  !> Add the prism between a piece of a facet in one cell and the floor of the cell, and the column
  !! further down.
  pure subroutine add_prism(part, corner, total)
    type(polygon_t), intent(in) :: part
    real(wp), intent(in) :: corner(3)        !! lower corner of the cell [cells]
    real(wp), intent(inout) :: total(7)
    real(wp) :: a(3), b(3), c(3), s(3), twice
    integer :: v

    if (part%n < 3) return
    a = part%x(:, 1) - corner
    c = part%x(:, 2) - corner
    do v = 3, part%n
      b = c
      c = part%x(:, v) - corner
      s = a + b + c
      twice = (b(1) - a(1))*(c(2) - a(2)) - (c(1) - a(1))*(b(2) - a(2))
      total(1) = total(1) + twice*s(3)/6.0_wp
      total(2:3) = total(2:3) + &
                   twice/24.0_wp*(s(1:2)*s(3) + a(1:2)*a(3) + b(1:2)*b(3) + c(1:2)*c(3))
      total(4) = total(4) + twice/48.0_wp*(s(3)**2 + a(3)**2 + b(3)**2 + c(3)**2)
      total(5) = total(5) + 0.5_wp*twice
      total(6:7) = total(6:7) + twice*s(1:2)/6.0_wp
    end do
  end subroutine add_prism

  !> Add the area of a facet that lies in the lower face d of a cell and ends the body there.
  pure subroutine add_end(part, corner, d, total)
    type(polygon_t), intent(in) :: part
    real(wp), intent(in) :: corner(3)        !! lower corner of the cell [cells]
    integer, intent(in) :: d
    real(wp), intent(inout) :: total(5)
    real(wp) :: a(2), b(2), c(2), twice, sum3(3)
    integer :: v

    if (part%n < 3) return
    associate (m => [along(d), up(d)])
      sum3 = 0.0_wp
      a = part%x(m, 1) - corner(m)
      c = part%x(m, 2) - corner(m)
      do v = 3, part%n
        b = c
        c = part%x(m, v) - corner(m)
        twice = turn(d)*((b(1) - a(1))*(c(2) - a(2)) - (c(1) - a(1))*(b(2) - a(2)))
        sum3 = sum3 + twice*[0.5_wp, (a + b + c)/6.0_wp]
      end do
    end associate
    if (sum3(1) > 0.0_wp) total(1:3) = total(1:3) + sum3   ! looks up: the body ends
  end subroutine add_end

  !> Add the area under a line in one cell of a face, and the column further down.
  pure subroutine add_piece(sign, a, b, total)
    real(wp), intent(in) :: sign
    real(wp), intent(in) :: a(2), b(2)   !! ends: along and up the columns, from the cell's corner
    real(wp), intent(inout) :: total(5)
    real(wp) :: width, height

    width = sign*(b(1) - a(1))
    height = a(2) + b(2)
    total(1) = total(1) + 0.5_wp*width*height
    total(2) = total(2) + width*((a(1) + b(1))*height + a(1)*a(2) + b(1)*b(2))/6.0_wp
    total(3) = total(3) + width*(a(2)**2 + a(2)*b(2) + b(2)**2)/6.0_wp
    total(4) = total(4) + width
    total(5) = total(5) + 0.5_wp*width*(a(1) + b(1))
  end subroutine add_piece

  !> Follow a line in the faces of direction d up the column of cells number i.
  subroutine add_line(a, b, f0, i, d, sign, work)
    real(wp), intent(in) :: a(2), b(2)   !! ends: along and up the columns [cells]
    real(wp), intent(in) :: f0           !! lower edge of the column [cells]
    integer, intent(in) :: i, d
    real(wp), intent(in) :: sign         !! of the area under a line from a to b
    type(share_work_t), intent(inout) :: work
    real(wp) :: low(2), high(2), here(2), next(2), corner(2), way
    integer :: k, first, last

    if (a(2) <= b(2)) then
      low = a
      high = b
      way = sign
    else
      low = b
      high = a
      way = -sign
    end if
    call cells_between(low(2), high(2), first, last)
    here = low
    do k = first, last
      next = high
      if (k < last) next = point_at(low, high, 2, real(k, wp))
      corner = [f0, real(k - 1, wp)]
      call add_piece(way, here - corner, next - corner, work%area(:, i, k, d))
      here = next
    end do
  end subroutine add_line

  !> Point of a line in the plane where coordinate m has a value between those of its ends.
  pure function point_at(a, b, m, value) result(x)
    real(wp), intent(in) :: a(2), b(2)   !! a(m) < b(m)
    integer, intent(in) :: m
    real(wp), intent(in) :: value
    real(wp) :: x(2)

    x = a + (value - a(m))/(b(m) - a(m))*(b - a)
    x(m) = value
  end function point_at

  !> Lines of a facet in the plane between two rows, column by column.
  subroutine lines_in_plane(facet, plane, work)
    type(polygon_t), intent(in) :: facet
    real(wp), intent(in) :: plane
    type(share_work_t), intent(inout) :: work
    real(wp) :: line(3, 2, 4), low(2), high(2), a(2), b(2), sign
    integer :: m, n, i, first, last

    call cut_by_plane(facet, 2, plane, line, n)
    do m = 1, n
      low = line([1, 3], 1, m)
      high = line([1, 3], 2, m)
      sign = turn(2)
      if (low(1) > high(1)) then
        a = low
        low = high
        high = a
        sign = -sign
      end if
      call cells_between(low(1), high(1), first, last)
      a = low
      do i = first, last
        b = high
        if (i < last) b = point_at(low, high, 1, real(i, wp))
        call add_line(a, b, real(i - 1, wp), i, 2, sign, work)
        a = b
      end do
    end do
  end subroutine lines_in_plane

  !> Where the grid lines in x and z through the cell centres of a row meet a facet.
  subroutine hits_in_row(facet, j, self, work)
    type(polygon_t), intent(in) :: facet
    integer, intent(in) :: j
    type(body_shares_t), intent(inout) :: self
    type(share_work_t), intent(inout) :: work
    real(wp) :: line(3, 2, 4), x, z
    integer :: m, n, i, k, first, last

    call cut_by_plane(facet, 2, real(j, wp) - 0.5_wp, line, n)
    do m = 1, n
      call centres_between(line(3, 1, m), line(3, 2, m), first, last)
      do k = first, last
        x = value_on_line(line(:, 1, m), line(:, 2, m), 3, real(k, wp) - 0.5_wp, 1)
        i = ceiling(x + 0.5_wp)
        call add_hit([i, j, k, 1], x - real(i, wp) + 1.5_wp, self)
      end do
      call centres_between(line(1, 1, m), line(1, 2, m), first, last)
      do i = first, last
        z = value_on_line(line(:, 1, m), line(:, 2, m), 1, real(i, wp) - 0.5_wp, 3)
        k = ceiling(z + 0.5_wp)
        call add_hit([i, j, k, 3], z - real(k, wp) + 1.5_wp, self)
        work%crossings(i, k) = work%crossings(i, k) + merge(1, -1, line(1, 1, m) < line(1, 2, m))
      end do
    end do
  end subroutine hits_in_row

  !> Where the grid lines in y through the cell centres meet the body.
  subroutine hits_along_y(shape, self, work)
    type(shape_t), intent(in) :: shape
    type(body_shares_t), intent(inout) :: self
    type(share_work_t), intent(in) :: work
    type(polygon_t) :: facet
    real(wp) :: line(3, 2, 4), y
    integer :: f, m, n, i, j, k, first(2), last(2)

    do f = 1, size(shape%facet) - 1
      call centres_between(work%low(1, f), work%high(1, f), first(1), last(1))
      if (first(1) > last(1)) cycle
      call load_facet(shape, f, work, facet)
      do i = first(1), last(1)
        call cut_by_plane(facet, 1, real(i, wp) - 0.5_wp, line, n)
        do m = 1, n
          call centres_between(line(3, 1, m), line(3, 2, m), first(2), last(2))
          do k = first(2), last(2)
            y = value_on_line(line(:, 1, m), line(:, 2, m), 3, real(k, wp) - 0.5_wp, 2)
            j = ceiling(y + 0.5_wp)
            call add_hit([i, j, k, 2], y - real(j, wp) + 1.5_wp, self)
          end do
        end do
      end do
    end do
  end subroutine hits_along_y

  !> Cells whose centre a line from a to b passes; its lower end counts, its upper end does not.
  pure subroutine centres_between(a, b, first, last)
    real(wp), intent(in) :: a, b          !! in any order [cells]
    integer, intent(out) :: first, last

    first = ceiling(min(a, b) + 0.5_wp)
    last = ceiling(max(a, b) + 0.5_wp) - 1
  end subroutine centres_between

  !> Coordinate e of the point of a line where its coordinate d has a given value.
  pure function value_on_line(a, b, d, value, e) result(x)
    real(wp), intent(in) :: a(3), b(3)
    integer, intent(in) :: d, e
    real(wp), intent(in) :: value
    real(wp) :: x

    if (a(d) < b(d)) then
      x = a(e) + (value - a(d))/(b(d) - a(d))*(b(e) - a(e))
    else
      x = b(e) + (value - b(d))/(a(d) - b(d))*(a(e) - b(e))
    end if
  end function value_on_line

  !> Running sums down the columns: what stands above a cell fills it as a column.
  pure subroutine close_columns(self, work)
    type(body_shares_t), intent(in) :: self
    type(share_work_t), intent(inout) :: work
    integer :: i, k, d

    do k = self%high(3) - 1, self%low(3), -1
      do i = self%low(1), self%high(1)
        associate (here => work%volume(:, i, k), above => work%volume(5:7, i, k + 1))
          here(1:3) = here(1:3) + above
          here(4) = here(4) + 0.5_wp*above(1)
          here(5:7) = here(5:7) + above
        end associate
        do d = 1, 2
          call add_above(work%area(:, i, k + 1, d), work%area(:, i, k, d))
        end do
      end do
    end do
    do k = self%low(3), self%high(3)
      do i = self%high(1) - 1, self%low(1), -1
        call add_above(work%area(:, i + 1, k, 3), work%area(:, i, k, 3))
      end do
    end do
    do k = self%low(3) + 1, self%high(3)
      do i = self%low(1), self%high(1)
        work%crossings(i, k) = work%crossings(i, k) + work%crossings(i, k - 1)
      end do
    end do
  end subroutine close_columns

  !> A cell that is full but for round-off has six closed faces.
  pure subroutine close_full_cells(self, work)
    type(body_shares_t), intent(in) :: self
    type(share_work_t), intent(inout) :: work
    integer :: i, k
    logical :: full

    do k = self%low(3), self%high(3)
      do i = self%low(1), self%high(1)
        full = work%volume(1, i, k) > 1.0_wp - full_cell
        if (full .or. work%full(i, k)) work%area(1, i, k, 2) = 1.0_wp
        work%full(i, k) = full
        if (.not. full) cycle
        work%area(1, i:i + 1, k, 1) = 1.0_wp
        work%area(1, i, k:k + 1, 3) = 1.0_wp
      end do
    end do
  end subroutine close_full_cells

  !> A cell of a face takes the column that stands above it.
  pure subroutine add_above(above, here)
    real(wp), intent(in) :: above(5)
    real(wp), intent(inout) :: here(5)

    here(1) = here(1) + above(4)
    here(2) = here(2) + above(5)
    here(3) = here(3) + 0.5_wp*above(4)
    here(4) = here(4) + above(4)
    here(5) = here(5) + above(5)
  end subroutine add_above

  !> List the cells and faces of a row that hold part of the body.
  subroutine list_row(j, self, work)
    integer, intent(in) :: j
    type(body_shares_t), intent(inout) :: self
    type(share_work_t), intent(in) :: work
    integer :: i, k, d

    do k = self%low(3), self%high(3)
      do i = self%low(1), self%high(1)
        if (work%volume(1, i, k) > least_share) then
          call add_cell([i, j, k], work%volume(1:4, i, k), work%crossings(i, k) > 0, self)
        end if
        do d = 1, 3
          if (work%area(1, i, k, d) > least_share) then
            call add_face([i, j, k, d], work%area(1:3, i, k, d), self)
          end if
        end do
      end do
    end do
  end subroutine list_row

  !> Append a cell.
  subroutine add_cell(cell, moment, inside, self)
    integer, intent(in) :: cell(3)
    real(wp), intent(in) :: moment(4)   !! volume, first moment
    logical, intent(in) :: inside
    type(body_shares_t), intent(inout) :: self
    integer :: n

    n = self%n_cell + 1
    self%n_cell = n
    call ensure_cell(n, self)
    self%cell(:, n) = cell
    self%inside(n) = inside
    if (moment(1) > 1.0_wp - full_cell) then
      self%alpha(n) = 1.0_wp
      self%centroid(:, n) = 0.5_wp
    else
      self%alpha(n) = moment(1)
      self%centroid(:, n) = min(max(moment(2:4)/moment(1), 0.0_wp), 1.0_wp)
    end if
  end subroutine add_cell

  !> Append a face.
  subroutine add_face(face, moment, self)
    integer, intent(in) :: face(4)
    real(wp), intent(in) :: moment(3)   !! area, first moments along and up the columns
    type(body_shares_t), intent(inout) :: self
    integer :: n, d

    n = self%n_face + 1
    self%n_face = n
    call ensure_face(n, self)
    self%face(:, n) = face
    d = face(4)
    self%face_centroid(d, n) = 0.0_wp
    if (moment(1) > 1.0_wp - full_face) then
      self%beta(n) = 1.0_wp
      self%face_centroid([along(d), up(d)], n) = 0.5_wp
    else
      self%beta(n) = moment(1)
      self%face_centroid([along(d), up(d)], n) = min(max(moment(2:3)/moment(1), 0.0_wp), 1.0_wp)
    end if
  end subroutine add_face

  !> Append a hit.
  subroutine add_hit(leg, at, self)
    integer, intent(in) :: leg(4)
    real(wp), intent(in) :: at          !! 0 < at <= 1
    type(body_shares_t), intent(inout) :: self
    integer :: n

    n = self%n_hit + 1
    self%n_hit = n
    call ensure_hit(n, self)
    self%hit(:, n) = leg
    self%at(n) = at
  end subroutine add_hit

  !> Number the cut cells on the grid; in each row, ends of their first run, and of all that follow.
  pure subroutine mark_cut_cells(self, work)
    type(body_shares_t), intent(in) :: self
    type(share_work_t), intent(inout) :: work
    integer :: m, i(3)

    work%run(1, self%low(2):self%high(2), self%low(3):self%high(3)) = 0
    work%run(2, self%low(2):self%high(2), self%low(3):self%high(3)) = -1   ! no cut cells
    do m = 1, self%n_cell
      if (self%alpha(m) >= 1.0_wp) cycle
      i = self%cell(:, m)
      work%number(i(1), i(2), i(3)) = m
      associate (run => work%run(:, i(2), i(3)))
        if (run(1) > run(2)) then
          run = i(1)
        else
          if (i(1) /= run(4) + 1 .and. run(3) <= run(2)) run(3) = i(1)
          if (i(1) == run(2) + 1) run(2) = i(1)
          run(4) = i(1)
        end if
      end associate
    end do
  end subroutine mark_cut_cells

  !> Tetrahedra that may touch each cut cell: all but those with the cell wholly outside one face.
  subroutine pair_tets(self, work)
    type(body_shares_t), intent(inout) :: self
    type(share_work_t), intent(inout) :: work
    integer :: t, i, j, k, n_pair, low(3), high(3), first, last
    real(wp) :: n(3, 4), d(4)

    n_pair = 0
    do t = 1, size(self%corner, 3)
      low = floor(minval(self%corner(:, :, t), 2)) + 1
      high = ceiling(maxval(self%corner(:, :, t), 2))
      call faces_of_tet(self%corner(:, :, t), n, d)
      do k = low(3), high(3)
        do j = low(2), high(2)
          associate (run => work%run(:, j, k))
            first = max(low(1), run(1))
            last = min(high(1), run(4))
            if (run(1) > run(2) .or. first > last) cycle
            if (first > run(2) .and. last < run(3)) cycle
          end associate
          call row_range(n, d, j, k, first, last)
          do i = first, last
            if (work%number(i, j, k) == 0) cycle
            n_pair = n_pair + 1
            call ensure_room(n_pair, work%pair)
            work%pair(:, n_pair) = [work%number(i, j, k), t]
          end do
        end do
      end do
    end do
    call sort_pairs(n_pair, work%pair, self)
    do t = 1, self%n_cell
      work%number(self%cell(1, t), self%cell(2, t), self%cell(3, t)) = 0
    end do
  end subroutine pair_tets

  !> Outward normals and plane constants of a tetrahedron: n.x <= d inside. One of negative volume,
  !! a part to be taken away again (see `bed_solid_m`), is turned inside out.
  pure subroutine faces_of_tet(corner, n, d)
    real(wp), intent(in) :: corner(3, 4)   !! [cells]
    real(wp), intent(out) :: n(3, 4), d(4)
    real(wp) :: sense
    integer :: f

    sense = sign(1.0_wp, tet_volume(corner))
    do f = 1, 4
      associate (a => corner(:, opposite(1, f)))
        n(:, f) = sense*cross(corner(:, opposite(2, f)) - a, corner(:, opposite(3, f)) - a)
        d(f) = dot_product(n(:, f), a) + near_face*sum(abs(n(:, f)))
      end associate
    end do
  end subroutine faces_of_tet

  !> Narrow a range of cells i of row (j, k) to those not wholly outside one of four planes.
  pure subroutine row_range(n, d, j, k, first, last)
    real(wp), intent(in) :: n(3, 4), d(4)
    integer, intent(in) :: j, k
    integer, intent(inout) :: first, last
    real(wp) :: rest
    integer :: f

    do f = 1, 4
      rest = d(f) - n(2, f)*real(merge(j - 1, j, n(2, f) > 0.0_wp), wp) &
             - n(3, f)*real(merge(k - 1, k, n(3, f) > 0.0_wp), wp)   ! n(1) x <= rest is inside
      if (n(1, f) > 0.0_wp) then
        if (n(1, f)*real(last - 1, wp) > rest) then
          if (n(1, f)*real(first - 1, wp) > rest) last = first - 1
          if (last >= first) last = floor(rest/n(1, f)) + 1
        end if
      else if (n(1, f)*real(first, wp) > rest) then
        if (n(1, f)*real(last, wp) > rest) last = first - 1
        if (last >= first) first = ceiling(rest/n(1, f))
      end if
      if (last < first) return
    end do
  end subroutine row_range

  !> Lists of tetrahedra by cell, in the order of the tetrahedra.
  pure subroutine sort_pairs(n_pair, pair, self)
    integer, intent(in) :: n_pair, pair(:, :)
    type(body_shares_t), intent(inout) :: self
    integer :: p, m

    call ensure_room(n_pair, self%tet)
    call ensure_room(self%n_cell + 1, self%first_tet)
    self%first_tet(:self%n_cell + 1) = 0
    do p = 1, n_pair
      m = pair(1, p)
      self%first_tet(m) = self%first_tet(m) + 1
    end do
    p = 1
    do m = 1, self%n_cell
      p = p + self%first_tet(m)
      self%first_tet(m) = p
    end do
    self%first_tet(self%n_cell + 1) = p
    do p = n_pair, 1, -1
      m = pair(1, p)
      self%first_tet(m) = self%first_tet(m) - 1
      self%tet(self%first_tet(m)) = pair(2, p)
    end do
  end subroutine sort_pairs

end module body_shares_m
