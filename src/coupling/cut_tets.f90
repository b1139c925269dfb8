!> Which tetrahedra of a body may reach into each of its cut cells.
module cut_tets_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use vectors_m, only: cross
  use polyhedron_m, only: tet_volume
  use tet_mesh_m, only: opposite
  use share_lists_m, only: body_shares_t
  implicit none
  private
  public :: list_cut_tets, faces_of_tet

  real(wp), parameter :: near_face = 1.0e-12_wp    !! a gap that parts no cell from a tetrahedron

contains

  !> Tetrahedra of the cut cells among the cells listed: all but those with the cell wholly outside
  !! one face.
  subroutine list_cut_tets(self)
    type(body_shares_t), intent(inout) :: self
    integer, allocatable :: number(:, :, :)    ! place in the list of a cut cell, 0 elsewhere
    integer, allocatable :: runs(:, :, :)      ! (4, y, z) ends of the first run of cut cells,
                                               ! of the rest
    integer, allocatable :: pair(:, :)         ! (2, *) cell, tetrahedron
    integer :: t, i, j, k, m, n_pair, low(3), high(3), first, last, c(3)
    real(wp) :: n(3, 4), d(4)

    low = self%low - 1   ! a corner may lie beyond the facets by round-off
    high = self%high + 1
    allocate (number(low(1):high(1), low(2):high(2), low(3):high(3)), source=0)
    allocate (runs(4, low(2):high(2), low(3):high(3)))
    call ensure_capacity(1, pair, rows=2)
    ! Number the cut cells on the grid; in each row, ends of their first run, of all that follow.
    runs(1, :, :) = 0
    runs(2, :, :) = -1   ! no cut cells
    do m = 1, self%n_cell
      if (self%alpha(m) >= 1.0_wp) cycle
      c = self%cell(:, m)
      number(c(1), c(2), c(3)) = m
      associate (run => runs(:, c(2), c(3)))
        if (run(1) > run(2)) then
          run = c(1)
        else
          if (c(1) /= run(4) + 1 .and. run(3) <= run(2)) run(3) = c(1)
          if (c(1) == run(2) + 1) run(2) = c(1)
          run(4) = c(1)
        end if
      end associate
    end do
    n_pair = 0
    do t = 1, size(self%corner, 3)
      low = floor(minval(self%corner(:, :, t), 2)) + 1
      high = ceiling(maxval(self%corner(:, :, t), 2))
      call faces_of_tet(self%corner(:, :, t), n, d)
      do k = low(3), high(3)
        do j = low(2), high(2)
          associate (run => runs(:, j, k))
            first = max(low(1), run(1))
            last = min(high(1), run(4))
            if (run(1) > run(2) .or. first > last) cycle
            if (first > run(2) .and. last < run(3)) cycle
          end associate
          call row_range(n, d, j, k, first, last)
          do i = first, last
            if (number(i, j, k) == 0) cycle
            n_pair = n_pair + 1
            call ensure_capacity(n_pair, pair)
            pair(:, n_pair) = [number(i, j, k), t]
          end do
        end do
      end do
    end do
    call sort_pairs(n_pair, pair, self)
  end subroutine list_cut_tets

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

    call ensure_capacity(n_pair, self%tet)
    call ensure_capacity(self%n_cell + 1, self%first_tet)
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

end module cut_tets_m
