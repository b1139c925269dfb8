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
  public :: cut_tets_t, list_cut_tets, faces_of_tet

  real(wp), parameter :: near_face = 1.0e-12_wp    !! a gap that parts no cell from a tetrahedron

  !> Work arrays over the box of a body, for one thread.
  type :: cut_tets_t
    integer, allocatable :: number(:, :, :)    !! place in the list of a cut cell, 0 elsewhere
    integer, allocatable :: run(:, :, :)       !! (4, y, z) ends of the first run of cut cells,
                                               !! of the rest
    integer, allocatable :: pair(:, :)         !! (2, *) cell, tetrahedron
  end type cut_tets_t

contains

  !> Tetrahedra of the cut cells among the cells listed: all but those with the cell wholly outside
  !! one face.
  subroutine list_cut_tets(work, self)
    type(cut_tets_t), intent(inout) :: work
    type(body_shares_t), intent(inout) :: self
    integer :: t, i, j, k, m, n_pair, low(3), high(3), first, last, c(3)
    real(wp) :: n(3, 4), d(4)

    c = max(abs(self%low), abs(self%high)) + 1
    if (allocated(work%number)) then   ! arrays long enough for the body; they only grow
      if (any(ubound(work%number) < c)) then
        c = max(c, ubound(work%number))
        deallocate (work%number, work%run)
      end if
    end if
    if (.not. allocated(work%number)) then
      allocate (work%number(-c(1):c(1), -c(2):c(2), -c(3):c(3)), source=0)
      allocate (work%run(4, -c(2):c(2), -c(3):c(3)))
      call ensure_capacity(1, work%pair, rows=2)
    end if
    ! Number the cut cells on the grid; in each row, ends of their first run, of all that follow.
    work%run(1, self%low(2):self%high(2), self%low(3):self%high(3)) = 0
    work%run(2, self%low(2):self%high(2), self%low(3):self%high(3)) = -1   ! no cut cells
    do m = 1, self%n_cell
      if (self%alpha(m) >= 1.0_wp) cycle
      c = self%cell(:, m)
      work%number(c(1), c(2), c(3)) = m
      associate (run => work%run(:, c(2), c(3)))
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
            call ensure_capacity(n_pair, work%pair)
            work%pair(:, n_pair) = [work%number(i, j, k), t]
          end do
        end do
      end do
    end do
    call sort_pairs(n_pair, work%pair, self)
    do t = 1, self%n_cell
      work%number(self%cell(1, t), self%cell(2, t), self%cell(3, t)) = 0
    end do
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
