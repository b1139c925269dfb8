!> Open part of one box cell that bodies cut: its volume below a plane, in a slab, and the plane of
!! a given volume.
!!
!! The tetrahedra of the bodies are clipped to the box and cut into tetrahedra that lie inside it.
!! All is kept in the unit cube of the cell (see `plic_m`): shares of the box instead of volumes.
!! One object per thread serves one cell after the other.
module cut_cell_m
  use kinds_m, only: wp
  use solid_geometry_m, only: solid_geometry_t
  use polyhedron_m, only: polyhedron_t, max_corners, clip_tet_to_box, tet_volume
  use plic_m, only: unit_volume, unit_area, unit_constant
  implicit none
  private
  public :: cut_cell_t, cut_cell_init, load_cut_cell
  public :: open_below, open_constant, open_slab_below

  real(wp), parameter :: min_piece = 1.0e-20_wp   !! of pieces that count [share]
  real(wp), parameter :: round_off = 1.0e-15_wp     !! volume below a found plane [share]

  type :: cut_cell_t
    integer :: n = 0                            !! pieces
    real(wp) :: open = 1.0_wp                   !! open share of the box
    real(wp), allocatable :: corner(:, :, :)    !! (3, 4, *) corners of the pieces, 0..1
    real(wp), allocatable :: share(:)   !! (*) their volumes, < 0: taken away [share of the box]
    real(wp), allocatable :: height(:, :)       !! (4, *) rising m.x of the corners for one m
  end type cut_cell_t

contains

  !> Make room; it grows by doubling when a cell needs more.
  subroutine cut_cell_init(self)
    type(cut_cell_t), intent(out) :: self
    integer, parameter :: first_size = 256

    allocate (self%corner(3, 4, first_size), self%share(first_size), self%height(4, first_size))
  end subroutine cut_cell_init

  !> Take up the box `low`..`low + h`, which lies in the cut cell number m of the solid geometry.
  subroutine load_cut_cell(solid, m, low, h, self)
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: m                 !! number of the cut cell, 0: no body there
    real(wp), intent(in) :: low(3), h(3)     !! lower corner and edges of the box [m]
    type(cut_cell_t), intent(inout) :: self
    real(wp) :: x(3, 4)
    integer :: t, v

    self%n = 0
    self%open = 1.0_wp
    if (m == 0) return
    do t = solid%tets%first(m), solid%tets%first(m + 1) - 1
      do v = 1, 4
        x(:, v) = (solid%tets%corner(:, v, solid%tets%list(t)) - low)/h
      end do
      if (any(minval(x, 2) >= 1.0_wp) .or. any(maxval(x, 2) <= 0.0_wp)) cycle
      if (tet_volume(x) >= 0.0_wp) then
        call add_tetrahedron(x, 1.0_wp, self)
      else
        call add_tetrahedron(x(:, [2, 1, 3, 4]), -1.0_wp, self)
      end if
    end do
    self%open = max(1.0_wp - sum(self%share(1:self%n)), 0.0_wp)
  end subroutine load_cut_cell

  !> Clip a tetrahedron to the unit cube and add the pieces: tetrahedra from one corner of the rest
  !! over the triangles of its faces.
  subroutine add_tetrahedron(x, sense, self)
    real(wp), intent(in) :: x(3, 4)   !! of positive volume
    real(wp), intent(in) :: sense     !! 1: solid, -1: a part that is taken away again
    type(cut_cell_t), intent(inout) :: self
    type(polyhedron_t) :: p
    logical :: done(3, max_corners)
    integer :: v, slot, from, here, to, at, step

    call clip_tet_to_box(x, [0.0_wp, 0.0_wp, 0.0_wp], [1.0_wp, 1.0_wp, 1.0_wp], p)
    done(:, 1:p%n) = .false.
    do v = 1, p%n
      do slot = 1, 3
        if (done(slot, v)) cycle
        done(slot, v) = .true.
        from = v
        here = p%adjacent(slot, v)
        do step = 1, p%n   ! along the face to the left of the edge, back to v
          ! Slot before the one that holds a neighbour, cyclic.
          at = 2
          if (p%adjacent(1, here) == from) at = 3
          if (p%adjacent(2, here) == from) at = 1
          done(at, here) = .true.
          to = p%adjacent(at, here)
          if (to == v) exit
          call add_piece(p%x(:, 1), p%x(:, v), p%x(:, here), p%x(:, to), sense, self)
          from = here
          here = to
        end do
      end do
    end do
  end subroutine add_tetrahedron

  !> Add one tetrahedron inside the unit cube.
  subroutine add_piece(apex, p, q, r, sense, self)
    real(wp), intent(in) :: apex(3), p(3), q(3), r(3), sense
    type(cut_cell_t), intent(inout) :: self
    real(wp), allocatable :: corners(:, :, :), shares(:)
    real(wp) :: corner(3, 4), share

    corner(:, 1) = apex
    corner(:, 2) = p
    corner(:, 3) = q
    corner(:, 4) = r
    share = tet_volume(corner)
    if (share < min_piece) return
    if (self%n == size(self%share)) then   ! twice the room
      allocate (corners(3, 4, 2*self%n), shares(2*self%n))
      corners(:, :, 1:self%n) = self%corner
      shares(1:self%n) = self%share
      call move_alloc(corners, self%corner)
      call move_alloc(shares, self%share)
      deallocate (self%height)
      allocate (self%height(4, 2*self%n))
    end if
    self%n = self%n + 1
    self%share(self%n) = sense*share
    self%corner(:, :, self%n) = corner
  end subroutine add_piece

  !> Open share of the box where `m.x <= a`.
  subroutine open_below(self, m, a, share)
    type(cut_cell_t), intent(inout) :: self
    real(wp), intent(in) :: m(3), a
    real(wp), intent(out) :: share
    real(wp) :: area

    call set_heights(m, self)
    call below_heights(self, m, a, share, area)
  end subroutine open_below

  !> Plane constant a such that the open share below `m.x <= a` is `share`.
  !!
  !! Newton's method inside a bracket; where bodies overlap by their contact the share counts the
  !! overlap twice, which at most costs a few bisections.
  subroutine open_constant(self, m, share, a)
    type(cut_cell_t), intent(inout) :: self
    real(wp), intent(in) :: m(3)
    real(wp), intent(in) :: share   !! 0..open
    real(wp), intent(out) :: a
    integer, parameter :: max_iterations = 100
    real(wp) :: low, high, held, area, next
    integer :: it

    low = sum(min(m, 0.0_wp))
    high = sum(max(m, 0.0_wp))
    a = unit_constant(m, min(max(share/max(self%open, tiny(share)), 0.0_wp), 1.0_wp))
    call set_heights(m, self)
    do it = 1, max_iterations
      call below_heights(self, m, a, held, area)
      if (abs(held - share) <= round_off) return
      if (held > share) then
        high = a
      else
        low = a
      end if
      next = low
      if (area > 0.0_wp) next = a - (held - share)/area
      if (.not. (next > low .and. next < high)) next = 0.5_wp*(low + high)
      if (high - low <= epsilon(a)*max(abs(low), abs(high))) return
      a = next
    end do
  end subroutine open_constant

  !> Values of m.x at the corners of all pieces, rising.
  pure subroutine set_heights(m, self)
    real(wp), intent(in) :: m(3)
    type(cut_cell_t), intent(inout) :: self
    real(wp) :: z(4)
    integer :: t, v

    do t = 1, self%n
      do v = 1, 4
        z(v) = m(1)*self%corner(1, v, t) + m(2)*self%corner(2, v, t) + m(3)*self%corner(3, v, t)
      end do
      self%height(:, t) = rising(z)
    end do
  end subroutine set_heights

  !> Open share below a and its derivative, for the normal of the last `set_heights`.
  pure subroutine below_heights(self, m, a, share, area)
    type(cut_cell_t), intent(in) :: self
    real(wp), intent(in) :: m(3), a
    real(wp), intent(out) :: share, area
    real(wp) :: solid, solid_area
    integer :: t

    solid = 0.0_wp
    solid_area = 0.0_wp
    do t = 1, self%n
      if (a <= self%height(1, t)) cycle
      if (a >= self%height(4, t)) then
        solid = solid + self%share(t)
      else
        solid = solid + self%share(t)*tet_share_below(self%height(:, t), a)
        solid_area = solid_area + self%share(t)*tet_area(self%height(:, t), a)
      end if
    end do
    share = unit_volume(m, a) - solid
    area = unit_area(m, a) - solid_area
  end subroutine below_heights

  !> Open share of the box where both `m.x <= a` and `x(d) <= limit`.
  subroutine open_slab_below(self, m, a, d, limit, share)
    type(cut_cell_t), intent(in) :: self
    real(wp), intent(in) :: m(3), a
    integer, intent(in) :: d
    real(wp), intent(in) :: limit   !! 0..1
    real(wp), intent(out) :: share
    real(wp) :: solid, x(4), z(4), squeezed(3)
    integer :: t, v

    share = 0.0_wp
    if (limit <= 0.0_wp) return
    solid = 0.0_wp
    do t = 1, self%n
      x = self%corner(d, :, t)
      if (minval(x) >= limit) cycle
      do v = 1, 4
        z(v) = m(1)*self%corner(1, v, t) + m(2)*self%corner(2, v, t) + m(3)*self%corner(3, v, t)
      end do
      if (minval(z) >= a) cycle
      solid = solid + self%share(t)*tet_share_below_both(x, limit, z, a)
    end do
    squeezed = m
    squeezed(d) = m(d)*limit
    share = limit*unit_volume(squeezed, a) - solid
  end subroutine open_slab_below

  !> Four numbers in rising order.
  pure function rising(z) result(s)
    real(wp), intent(in) :: z(4)
    real(wp) :: s(4)
    real(wp) :: low(2), high(2), middle(2)

    low = [min(z(1), z(2)), min(z(3), z(4))]
    high = [max(z(1), z(2)), max(z(3), z(4))]
    middle = [max(low(1), low(2)), min(high(1), high(2))]
    s = [min(low(1), low(2)), min(middle(1), middle(2)), &
         max(middle(1), middle(2)), max(high(1), high(2))]
  end function rising

  !> Share of a tetrahedron below height a; no term cancels another.
  pure function tet_share_below(z, a) result(share)
    real(wp), intent(in) :: z(4)   !! heights of the corners, rising
    real(wp), intent(in) :: a
    real(wp) :: share
    real(wp) :: t13, t14, t23, t24

    if (a <= z(1)) then
      share = 0.0_wp
    else if (a >= z(4)) then
      share = 1.0_wp
    else if (a < z(2)) then
      share = (a - z(1))/(z(2) - z(1))*((a - z(1))/(z(3) - z(1)))*((a - z(1))/(z(4) - z(1)))
    else if (a >= z(3)) then
      share = 1.0_wp - (z(4) - a)/(z(4) - z(1))*((z(4) - a)/(z(4) - z(2))) &
                       *((z(4) - a)/(z(4) - z(3)))
    else
      t13 = (a - z(1))/(z(3) - z(1))
      t14 = (a - z(1))/(z(4) - z(1))
      t23 = (a - z(2))/(z(3) - z(2))
      t24 = (a - z(2))/(z(4) - z(2))
      share = t23*t24 + t13*t14*(1.0_wp - t24) + t13*t24*(1.0_wp - t23)
    end if
  end function tet_share_below

  !> Derivative of `tet_share_below` for z(1) < a < z(4).
  pure function tet_area(z, a) result(area)
    real(wp), intent(in) :: z(4), a
    real(wp) :: area
    real(wp) :: r13, r14, r23, r24, t13, t14, t23, t24

    if (a < z(2)) then
      area = 3.0_wp*((a - z(1))/(z(2) - z(1)))*((a - z(1))/(z(3) - z(1)))/(z(4) - z(1))
    else if (a >= z(3)) then
      area = 3.0_wp*((z(4) - a)/(z(4) - z(3)))*((z(4) - a)/(z(4) - z(2)))/(z(4) - z(1))
    else
      r13 = 1.0_wp/(z(3) - z(1))
      r14 = 1.0_wp/(z(4) - z(1))
      r23 = 1.0_wp/(z(3) - z(2))
      r24 = 1.0_wp/(z(4) - z(2))
      t13 = (a - z(1))*r13
      t14 = (a - z(1))*r14
      t23 = (a - z(2))*r23
      t24 = (a - z(2))*r24
      area = r23*t24 + t23*r24 + (r13*t14 + t13*r14)*(1.0_wp - t24) - t13*t14*r24 &
             + (r13*t24 + t13*r24)*(1.0_wp - t23) - t13*t24*r23
    end if
  end function tet_area

  !> Share of a tetrahedron where both x <= limit and z <= a.
  !!
  !! The part below `limit` is cut into tetrahedra; z is linear, so only its corner values are
  !! needed.
  pure function tet_share_below_both(x, limit, z, a) result(share)
    real(wp), intent(in) :: x(4), limit   !! corner values of the first function
    real(wp), intent(in) :: z(4), a       !! corner values of the second function
    real(wp) :: share
    real(wp) :: s(4), y(4), t(4, 4)
    integer :: i, j, below

    call sort_pairs(x, z, s, y)
    below = count(s <= limit)
    do i = 1, below
      do j = below + 1, 4
        t(i, j) = (limit - s(i))/(s(j) - s(i))
      end do
    end do
    select case (below)
    case (0)
      share = 0.0_wp
    case (1)
      share = t(1, 2)*t(1, 3)*t(1, 4)*cut([y(1), at(1, 2), at(1, 3), at(1, 4)])
    case (2)
      share = t(2, 3)*t(2, 4)*cut([y(1), y(2), at(2, 3), at(2, 4)]) &
              + t(1, 3)*t(1, 4)*(1.0_wp - t(2, 4))*cut([y(1), at(1, 3), at(1, 4), at(2, 4)]) &
              + t(1, 3)*t(2, 4)*(1.0_wp - t(2, 3))*cut([y(1), at(1, 3), at(2, 4), at(2, 3)])
    case (3)
      share = cut(y) - (1.0_wp - t(1, 4))*(1.0_wp - t(2, 4))*(1.0_wp - t(3, 4)) &
              *cut([y(4), at(1, 4), at(2, 4), at(3, 4)])
    case default
      share = cut(y)
    end select
  contains
    !> Second function where the first reaches the limit on edge i-j.
    pure function at(i, j) result(value)
      integer, intent(in) :: i, j
      real(wp) :: value

      value = y(i) + t(i, j)*(y(j) - y(i))
    end function at

    pure function cut(corners) result(part)
      real(wp), intent(in) :: corners(4)
      real(wp) :: part

      part = tet_share_below(rising(corners), a)
    end function cut
  end function tet_share_below_both

  !> Sort four pairs by their first numbers.
  pure subroutine sort_pairs(x, z, s, y)
    real(wp), intent(in) :: x(4), z(4)
    real(wp), intent(out) :: s(4), y(4)
    real(wp) :: key, value
    integer :: i, j

    s = x
    y = z
    do i = 2, 4
      key = s(i)
      value = y(i)
      j = i - 1
      do while (j >= 1)
        if (s(j) <= key) exit
        s(j + 1) = s(j)
        y(j + 1) = y(j)
        j = j - 1
      end do
      s(j + 1) = key
      y(j + 1) = value
    end do
  end subroutine sort_pairs

end module cut_cell_m
