!> Sealed pockets: cut cells from which no open faces lead to a cell without solid.
module pockets_m
  use kinds_m, only: wp, i8
  use growing_m, only: ensure_capacity
  use grid_m, only: grid_t, n_halo, unit_step
  use boundary_kinds_m, only: is_wall
  use solid_geometry_m, only: solid_geometry_t, set_faces
  use parallel_m, only: halo_exchange, global_sum
  implicit none
  private
  public :: pockets_t, close_pockets

  type :: pockets_t
    integer :: low(3) = 1, high(3) = 0            !! first and last cell where the solids are kept
    logical, allocatable :: reached(:)            !! (cut cells) fluid gets there from uncut cells
    integer, allocatable :: stack(:)
    integer, allocatable :: flag(:, :, :)
      !! the same on the grid, for the exchange; not before the first pocket
  end type pockets_t

contains

  !> Close the faces of cut cells from which no open faces lead to a cell without solid.
  subroutine close_pockets(grid, self, solid)
    type(grid_t), intent(in) :: grid
    type(pockets_t), intent(inout) :: self
    type(solid_geometry_t), intent(inout) :: solid
    integer(i8) :: left(1), changed(1)
    integer :: m

    call ensure_capacity(solid%n_cut, self%reached)
    call ensure_capacity(solid%n_cut, self%stack)
    do m = 1, solid%n_cut
      self%reached(m) = .false.
    end do
    call spread_reached(grid, self, solid)
    left(1) = own_unreached(grid, self, solid)
    call global_sum(left)
    do while (left(1) > 0)
      call exchange_reached(grid, self, solid)
      call spread_reached(grid, self, solid)
      changed(1) = left(1)
      left(1) = own_unreached(grid, self, solid)
      call global_sum(left)
      if (left(1) == changed(1)) exit
    end do
    solid%n_sealed = int(left(1))
    if (left(1) == 0) return
    call exchange_reached(grid, self, solid)
    do m = 1, solid%n_cut
      if (self%reached(m)) cycle
      solid%n_closed = solid%n_closed + 1
      solid%closed_cell(:, solid%n_closed) = solid%cut_cell(:, m)
      call set_faces(grid, solid%cut_cell(:, m), 0.0_wp, solid)
    end do
  end subroutine close_pockets

  !> Own cut cells not yet reached.
  pure function own_unreached(grid, self, solid) result(n)
    type(grid_t), intent(in) :: grid
    type(pockets_t), intent(in) :: self
    type(solid_geometry_t), intent(in) :: solid
    integer(i8) :: n
    integer :: m

    n = 0
    do m = 1, solid%n_cut
      if (self%reached(m)) cycle
      if (any(solid%cut_cell(:, m) < grid%lo) .or. any(solid%cut_cell(:, m) > grid%hi)) cycle
      n = n + 1_i8
    end do
  end function own_unreached

  !> Learn from the owners which cut cells of the halo are reached.
  subroutine exchange_reached(grid, self, solid)
    type(grid_t), intent(in) :: grid
    type(pockets_t), intent(inout) :: self
    type(solid_geometry_t), intent(in) :: solid
    integer :: m

    if (.not. allocated(self%flag)) then
      allocate (self%flag(grid%first(1):grid%last(1), grid%first(2):grid%last(2), &
                          grid%first(3):grid%last(3)))
    end if
    self%flag = 0
    do m = 1, solid%n_cut
      associate (i => solid%cut_cell(:, m))
        self%flag(i(1), i(2), i(3)) = merge(1, 0, self%reached(m))
      end associate
    end do
    call halo_exchange(self%flag, n_halo)
    do m = 1, solid%n_cut
      associate (i => solid%cut_cell(:, m))
        self%reached(m) = self%flag(i(1), i(2), i(3)) == 1
      end associate
    end do
  end subroutine exchange_reached

  !> Spread what is reached through the open faces of the cells kept here.
  subroutine spread_reached(grid, self, solid)
    type(grid_t), intent(in) :: grid
    type(pockets_t), intent(inout) :: self
    type(solid_geometry_t), intent(in) :: solid
    integer :: m, n, n_stack, d, s

    !$omp parallel do schedule(static)
    do m = 1, solid%n_cut
      self%reached(m) = self%reached(m) .or. &
                        touches_free_cell(self, grid, solid, solid%cut_cell(:, m))
    end do
    n_stack = 0
    do n = 1, solid%n_cut   ! the few that touch one that is reached
      if (self%reached(n)) cycle
      do d = 1, 3
        do s = 1, 2
          m = cut_neighbour(self, solid, n, s, d)
          if (m == 0) cycle
          if (self%reached(m)) self%reached(n) = .true.
        end do
      end do
      if (self%reached(n)) call push(n)
    end do
    do while (n_stack > 0)
      n = self%stack(n_stack)
      n_stack = n_stack - 1
      do d = 1, 3
        do s = 1, 2
          m = cut_neighbour(self, solid, n, s, d)
          if (m == 0) cycle
          if (self%reached(m)) cycle
          self%reached(m) = .true.
          call push(m)
        end do
      end do
    end do
  contains
    subroutine push(m)
      integer, intent(in) :: m

      n_stack = n_stack + 1
      self%stack(n_stack) = m
    end subroutine push
  end subroutine spread_reached

  !> Number of the cut cell on side s of cut cell m in direction d, if the face between is open and
  !! the cell is kept here, else 0.
  pure integer function cut_neighbour(self, solid, m, s, d) result(number)
    type(pockets_t), intent(in) :: self
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: m, s, d
    integer :: i(3), n(3), f(3)

    number = 0
    i = solid%cut_cell(:, m)
    n = i + (2*s - 3)*unit_step(:, d)
    if (any(n < self%low) .or. any(n > self%high)) return
    f = merge(i, n, s == 1)
    if (solid%aperture(f(1), f(2), f(3), d) > 0.0_wp) number = solid%cut(n(1), n(2), n(3))
  end function cut_neighbour

  !> Does a cell share an open face with a cell without solid, or with an open side of the domain?
  pure logical function touches_free_cell(self, grid, solid, i)
    type(pockets_t), intent(in) :: self
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: i(3)
    integer :: d, s, n(3), f(3)

    touches_free_cell = .true.
    do d = 1, 3
      do s = 1, 2
        n = i + (2*s - 3)*unit_step(:, d)
        f = merge(i, n, s == 1)
        if (f(d) > grid%last(d)) cycle
        if (solid%aperture(f(1), f(2), f(3), d) <= 0.0_wp) cycle
        if (n(d) < self%low(d) .or. n(d) > self%high(d)) then
          if (grid%beyond(n(d), d) .and. .not. is_wall(grid%side(s, d))) return
        else if (solid%alpha(n(1), n(2), n(3)) <= 0.0_wp) then
          return
        end if
      end do
    end do
    touches_free_cell = .false.
  end function touches_free_cell

end module pockets_m
