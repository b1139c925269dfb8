!> One body in one row of cells (fixed y): sums over its facets, then shares of cells and faces.
!! Prisms under facets, areas under lines and running sums down the columns: see `body_shares_m`.
module share_row_m
  use kinds_m, only: wp
  use tet_mesh_m, only: shape_t
  use facet_polygon_m, only: polygon_t, clip_to_cells, cut_by_plane, cells_between, &
    centres_between, value_on_line, point_at
  use share_moments_m, only: turn, add_prism, add_end, add_piece, add_above
  use share_lists_m, only: body_shares_t, add_cell, add_face, add_hit, full_cell
  implicit none
  private
  public :: share_row_t, ensure_row, sum_row, close_columns, list_row
  public :: hits_along_y

  real(wp), parameter :: min_share = 1.0e-13_wp     !! smaller shares are dropped

  !> The corners and facets of the body, and the sums over one row, for one thread.
  type :: share_row_t
    real(wp), allocatable :: point(:, :)       !! (3, points) corners of the body [cells]
    real(wp), allocatable :: seen(:, :)        !! the same as the centres of cells see them
    real(wp), allocatable :: low(:, :), high(:, :)   !! (3, facets) boxes of the facets [cells]
    !> (7, x, z) volume and first moment; area of the column further down and its moments in x, y.
    real(wp), allocatable :: volume(:, :, :)
    !> (5, x, z, d) area of the lower face d, first moments along and up the columns, length of the
    !! column further down and its moment.
    real(wp), allocatable :: area(:, :, :, :)
    integer, allocatable :: crossings(:, :)    !! (x, z) surfaces passed upwards between two centres
    logical, allocatable :: full(:, :)         !! (x, z) the cell of the row before is full
  end type share_row_t

contains

  !> Make the sums long enough for the body; they only grow. No cell before the first row is full.
  subroutine ensure_row(self, work)
    type(body_shares_t), intent(in) :: self
    type(share_row_t), intent(inout) :: work
    integer :: m(2)

    m = max(abs(self%low([1, 3])), abs(self%high([1, 3]))) + 1
    if (allocated(work%full)) then
      if (any(ubound(work%full) < m)) then
        m = max(m, ubound(work%full))
        deallocate (work%volume, work%area, work%crossings, work%full)
      end if
    end if
    if (.not. allocated(work%full)) then
      allocate (work%volume(7, -m(1):m(1), -m(2):m(2)), work%area(5, -m(1):m(1), -m(2):m(2), 3))
      allocate (work%crossings(-m(1):m(1), -m(2):m(2)), work%full(-m(1):m(1), -m(2):m(2)))
    end if
    work%full(self%low(1):self%high(1), self%low(3):self%high(3)) = .false.
  end subroutine ensure_row

  !> Prisms, areas and crossings of all facets in the row of cells number j.
  subroutine sum_row(shape, j, self, work)
    type(shape_t), intent(in) :: shape
    integer, intent(in) :: j
    type(body_shares_t), intent(inout) :: self
    type(share_row_t), intent(inout) :: work
    type(polygon_t) :: facet, piece
    integer :: m, first, last, flat

    work%volume(:, self%low(1):self%high(1), self%low(3):self%high(3)) = 0.0_wp
    work%area(:, self%low(1):self%high(1), self%low(3):self%high(3), :) = 0.0_wp
    work%crossings(self%low(1):self%high(1), self%low(3):self%high(3) + 1) = 0
    do m = 1, size(shape%facet) - 1
      call cells_between(work%low(2, m), work%high(2, m), first, last)
      if (j < first .or. j > last) cycle
      call load_facet(shape, m, work%seen, facet)
      call hits_in_row(facet, j, self, work)
      call load_facet(shape, m, work%point, facet)
      if (work%low(2, m) <= real(j - 1, wp)) call lines_in_plane(facet, real(j - 1, wp), work)
      call clip_to_cells(facet, 2, j, work%low(2, m), work%high(2, m), piece)
      do flat = 3, 1, -1   ! the grid plane it lies in, if it does
        if (work%high(flat, m) <= work%low(flat, m) &
            .and. abs(work%low(flat, m) - anint(work%low(flat, m))) <= 0.0_wp) exit
      end do
      call sum_columns(piece, j, flat, work)
    end do
  end subroutine sum_row

  !> The corners of a facet [cells].
  pure subroutine load_facet(shape, m, point, facet)
    type(shape_t), intent(in) :: shape
    integer, intent(in) :: m
    real(wp), intent(in) :: point(:, :)   !! (3, points) [cells]
    type(polygon_t), intent(inout) :: facet
    integer :: v

    facet%n = shape%facet(m + 1) - shape%facet(m)
    do v = 1, facet%n
      facet%x(:, v) = point(:, shape%facet_point(shape%facet(m) + v - 1))
    end do
  end subroutine load_facet

  !> Follow a piece of a facet, in row j, through the columns and cells of the row.
  subroutine sum_columns(piece, j, flat, work)
    type(polygon_t), intent(in) :: piece
    integer, intent(in) :: j
    integer, intent(in) :: flat   !! direction of the grid plane the facet lies in, 0: none
    type(share_row_t), intent(inout) :: work
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

  !> Follow a line in the faces of direction d up the column of cells number i.
  subroutine add_line(a, b, f0, i, d, sign, work)
    real(wp), intent(in) :: a(2), b(2)   !! ends: along and up the columns [cells]
    real(wp), intent(in) :: f0           !! lower edge of the column [cells]
    integer, intent(in) :: i, d
    real(wp), intent(in) :: sign         !! of the area under a line from a to b
    type(share_row_t), intent(inout) :: work
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

  !> Lines of a facet in the plane between two rows, column by column.
  subroutine lines_in_plane(facet, plane, work)
    type(polygon_t), intent(in) :: facet
    real(wp), intent(in) :: plane
    type(share_row_t), intent(inout) :: work
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
    type(share_row_t), intent(inout) :: work
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
    type(share_row_t), intent(in) :: work
    type(polygon_t) :: facet
    real(wp) :: line(3, 2, 4), y
    integer :: f, m, n, i, j, k, first(2), last(2)

    do f = 1, size(shape%facet) - 1
      call load_facet(shape, f, work%seen, facet)
      call centres_between(minval(facet%x(1, :facet%n)), maxval(facet%x(1, :facet%n)), first(1), &
                           last(1))
      if (first(1) > last(1)) cycle
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

  !> Running sums down the columns: what stands above a cell fills it as a column.
  pure subroutine close_columns(self, work)
    type(body_shares_t), intent(in) :: self
    type(share_row_t), intent(inout) :: work
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

  !> List the cells and faces of a row that hold part of the body; a cell that is full but for
  !! round-off has six closed faces.
  subroutine list_row(j, self, work)
    integer, intent(in) :: j
    type(body_shares_t), intent(inout) :: self
    type(share_row_t), intent(inout) :: work
    integer :: i, k, d
    logical :: full

    do k = self%low(3), self%high(3)
      do i = self%low(1), self%high(1)
        full = work%volume(1, i, k) > 1.0_wp - full_cell
        if (full .or. work%full(i, k)) work%area(1, i, k, 2) = 1.0_wp
        work%full(i, k) = full
        if (full) work%area(1, i:i + 1, k, 1) = 1.0_wp
        if (full) work%area(1, i, k:k + 1, 3) = 1.0_wp
        if (work%volume(1, i, k) > min_share) then
          call add_cell([i, j, k], work%volume(1:4, i, k), work%crossings(i, k) > 0, self)
        end if
        do d = 1, 3
          if (work%area(1, i, k, d) > min_share) then
            call add_face([i, j, k, d], work%area(1:3, i, k, d), self)
          end if
        end do
      end do
    end do
  end subroutine list_row

end module share_row_m
