!> Shares of cells and faces by counting, as the paper does.
!!
!! Each cell is cut into n x n x n sub-cells; one whose centre lies in a tetrahedron of the body is
!! solid. The share of a cell is the share of its solid sub-cells, the centroid their mean. A face
!! is cut into n x n squares likewise. A full cell is closed all round, as with exact shares, so no
!! fluid is locked in a cell without fluid volume.
!!
!! Source: the volume average of Yoshikawa et al. (2008), section 3 (2); that they take it by
!! sub-cells is recalled from the earlier MICS papers. What counting does not give stays exact:
!! distances along grid lines, tetrahedra of cut cells.
module subcell_shares_m
  use kinds_m, only: wp
  use grid_m, only: unit_step
  use share_moments_m, only: along, up
  use share_lists_m, only: body_shares_t, add_face
  use cut_tets_m, only: faces_of_tet
  implicit none
  private
  public :: count_subcells

contains

  !> Put counted shares in place of the exact ones of a body whose lists are filled.
  subroutine count_subcells(n, self)
    integer, intent(in) :: n   !! sub-cells per direction
    type(body_shares_t), intent(inout) :: self
    logical, allocatable :: solid(:, :, :)   ! sub-cells of the box around the body
    logical, allocatable :: full(:, :, :)    ! cells of which all sub-cells are solid
    logical, allocatable :: square(:, :, :)  ! of the faces of one direction: solid
    integer :: d, cells(3), squares(3)

    cells = self%high - self%low + 1
    allocate (full(cells(1) + 1, cells(2) + 1, cells(3) + 1), source=.false.)
    call mark_points(self, n*cells, spread(n, 1, 3), spread(0.5_wp, 1, 3), solid)
    call count_cells(n, solid, full, self)
    self%n_face = 0
    do d = 1, 3
      squares = n
      squares(d) = 1
      call mark_points(self, squares*cells, squares, &
                       0.5_wp*real(1 - unit_step(:, d), wp), square)
      call count_faces(n, d, squares, full, square, self)
    end do
  end subroutine count_subcells

  !> Points of a lattice over the box of the body that lie in one of its tetrahedra; those on a
  !! face of a tetrahedron count.
  subroutine mark_points(self, n, per_cell, shift, mark)
    type(body_shares_t), intent(in) :: self
    integer, intent(in) :: n(3)             !! points
    integer, intent(in) :: per_cell(3)      !! points in a cell
    real(wp), intent(in) :: shift(3)        !! of the first from the corner of the box [points]
    logical, allocatable, intent(out) :: mark(:, :, :)
    real(wp), parameter :: near = 1.0e-9_wp   !! points so near the box of a tetrahedron are tried
    real(wp) :: normal(3, 4), limit(4), x(3), corner(3)
    integer :: t, i, j, k, first(3), last(3)

    allocate (mark(n(1), n(2), n(3)), source=.false.)
    corner = real(self%low - 1, wp)
    do t = 1, size(self%corner, 3)
      associate (c => self%corner(:, :, t))
        call faces_of_tet(c, normal, limit)
        first = max(ceiling((minval(c, 2) - corner)*per_cell - shift - near) + 1, 1)
        last = min(floor((maxval(c, 2) - corner)*per_cell - shift + near) + 1, n)
      end associate
      do k = first(3), last(3)
        do j = first(2), last(2)
          do i = first(1), last(1)
            if (mark(i, j, k)) cycle
            x = corner + (real([i, j, k] - 1, wp) + shift)/per_cell
            mark(i, j, k) = all(matmul(x, normal) <= limit)
          end do
        end do
      end do
    end do
  end subroutine mark_points

  !> Shares, centroids and full cells; cells without a solid sub-cell leave the list.
  subroutine count_cells(n, solid, full, self)
    integer, intent(in) :: n
    logical, intent(in) :: solid(:, :, :)   !! sub-cells
    logical, intent(inout) :: full(:, :, :)
    type(body_shares_t), intent(inout) :: self
    integer :: m, kept, count, i, j, k, c(3), s(3), total(3)

    kept = 0
    do m = 1, self%n_cell
      c = self%cell(:, m) - self%low
      count = 0
      total = 0
      do k = 1, n
        do j = 1, n
          do i = 1, n
            s = n*c + [i, j, k]
            if (.not. solid(s(1), s(2), s(3))) cycle
            count = count + 1
            total = total + [i, j, k]
          end do
        end do
      end do
      if (count == 0) cycle
      kept = kept + 1
      self%cell(:, kept) = self%cell(:, m)
      self%alpha(kept) = real(count, wp)/real(n**3, wp)
      self%centroid(:, kept) = (real(total, wp)/real(count, wp) - 0.5_wp)/real(n, wp)
      full(c(1) + 1, c(2) + 1, c(3) + 1) = count == n**3
      self%inside(kept) = self%inside(m) .or. count == n**3
    end do
    self%n_cell = kept
  end subroutine count_cells

  !> Shares and centroids of the lower faces in direction d.
  subroutine count_faces(n, d, squares, full, square, self)
    integer, intent(in) :: n, d, squares(3)   !! squares of a face in each direction
    logical, intent(in) :: full(:, :, :)      !! cells
    logical, intent(in) :: square(:, :, :)    !! solid ones
    type(body_shares_t), intent(inout) :: self
    integer :: i, j, k, a, b, count, c(3), s(3), below(3), total(3)

    do k = 1, self%high(3) - self%low(3) + 1
      do j = 1, self%high(2) - self%low(2) + 1
        do i = 1, self%high(1) - self%low(1) + 1
          c = [i, j, k]
          below = max(c - unit_step(:, d), 1)
          if (full(i, j, k) .or. full(below(1), below(2), below(3))) then
            call add_face([c + self%low - 1, d], [1.0_wp, 0.5_wp, 0.5_wp], self)
            cycle
          end if
          count = 0
          total = 0
          do b = 1, n
            do a = 1, n
              s(d) = c(d)
              s(along(d)) = squares(along(d))*(c(along(d)) - 1) + a
              s(up(d)) = squares(up(d))*(c(up(d)) - 1) + b
              if (.not. square(s(1), s(2), s(3))) cycle
              count = count + 1
              total(1:2) = total(1:2) + [a, b]
            end do
          end do
          if (count == 0) cycle
          call add_face([c + self%low - 1, d], &
                        [real(count, wp), (real(total(1:2), wp) - 0.5_wp*count)/real(n, wp)] &
                        /real(n**2, wp), self)
        end do
      end do
    end do
  end subroutine count_faces

end module subcell_shares_m
