!> Sealed pockets: cut cells from which no open faces lead to a cell without solid.
module pockets_m
  use kinds_m, only: wp, i8
  use grid_m, only: grid_t, n_halo, unit_step
  use boundary_kinds_m, only: is_wall
  use solid_geometry_m, only: solid_geometry_t, set_faces
  use parallel_m, only: halo_exchange, global_sum
  implicit none
  private
  public :: close_pockets

contains

  !> Close the faces of cut cells from which no open faces lead to a cell without solid.
  subroutine close_pockets(grid, low, high, solid)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: low(3), high(3)   !! first and last cell where the solids are kept
    type(solid_geometry_t), intent(inout) :: solid
    logical :: reached(solid%n_cut)          ! fluid gets there from uncut cells
    integer(i8) :: left(1), changed(1)
    integer :: m

    reached = .false.
    call spread_reached(grid, low, high, solid, reached)
    left(1) = own_unreached(grid, solid, reached)
    call global_sum(left)
    do while (left(1) > 0)
      call exchange_reached(grid, solid, reached)
      call spread_reached(grid, low, high, solid, reached)
      changed(1) = left(1)
      left(1) = own_unreached(grid, solid, reached)
      call global_sum(left)
      if (left(1) == changed(1)) exit
    end do
    if (left(1) == 0) return
    call exchange_reached(grid, solid, reached)
    do m = 1, solid%n_cut
      if (reached(m)) cycle
      solid%n_closed = solid%n_closed + 1
      solid%closed_cell(:, solid%n_closed) = solid%cut_cell(:, m)
      call set_faces(grid, solid%cut_cell(:, m), 0.0_wp, solid)
    end do
  end subroutine close_pockets

  !> Own cut cells not yet reached.
  pure function own_unreached(grid, solid, reached) result(n)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    logical, intent(in) :: reached(:)
    integer(i8) :: n
    integer :: m

    n = 0
    do m = 1, solid%n_cut
      if (reached(m)) cycle
      if (any(solid%cut_cell(:, m) < grid%lo) .or. any(solid%cut_cell(:, m) > grid%hi)) cycle
      n = n + 1_i8
    end do
  end function own_unreached

  !> Learn from the owners which cut cells of the halo are reached.
  subroutine exchange_reached(grid, solid, reached)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    logical, intent(inout) :: reached(:)
    integer, allocatable :: flag(:, :, :)   ! the same on the grid
    integer :: m

    allocate (flag(grid%first(1):grid%last(1), grid%first(2):grid%last(2), &
                   grid%first(3):grid%last(3)), source=0)
    do m = 1, solid%n_cut
      associate (i => solid%cut_cell(:, m))
        flag(i(1), i(2), i(3)) = merge(1, 0, reached(m))
      end associate
    end do
    call halo_exchange(flag, n_halo)
    do m = 1, solid%n_cut
      associate (i => solid%cut_cell(:, m))
        reached(m) = flag(i(1), i(2), i(3)) == 1
      end associate
    end do
  end subroutine exchange_reached

  !> Spread what is reached through the open faces of the cells kept here.
  subroutine spread_reached(grid, low, high, solid, reached)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: low(3), high(3)
    type(solid_geometry_t), intent(in) :: solid
    logical, intent(inout) :: reached(:)
    integer :: stack(solid%n_cut)   ! cells whose neighbours are still to be looked at
    integer :: m, n, n_stack, d, s

    !$omp parallel do schedule(static)
    do m = 1, solid%n_cut
      reached(m) = reached(m) .or. &
                   touches_free_cell(low, high, grid, solid, solid%cut_cell(:, m))
    end do
    n_stack = 0
    do n = 1, solid%n_cut   ! the few that touch one that is reached
      if (reached(n)) cycle
      do d = 1, 3
        do s = 1, 2
          m = cut_neighbour(low, high, solid, n, s, d)
          if (m == 0) cycle
          if (reached(m)) reached(n) = .true.
        end do
      end do
      if (reached(n)) call push(n)
    end do
    do while (n_stack > 0)
      n = stack(n_stack)
      n_stack = n_stack - 1
      do d = 1, 3
        do s = 1, 2
          m = cut_neighbour(low, high, solid, n, s, d)
          if (m == 0) cycle
          if (reached(m)) cycle
          reached(m) = .true.
          call push(m)
        end do
      end do
    end do
  contains
    subroutine push(m)
      integer, intent(in) :: m

      n_stack = n_stack + 1
      stack(n_stack) = m
    end subroutine push
  end subroutine spread_reached

  !> Number of the cut cell on side s of cut cell m in direction d, if the face between is open and
  !! the cell is kept here, else 0.
  pure integer function cut_neighbour(low, high, solid, m, s, d) result(number)
    integer, intent(in) :: low(3), high(3)
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: m, s, d
    integer :: i(3), n(3), f(3)

    number = 0
    i = solid%cut_cell(:, m)
    n = i + (2*s - 3)*unit_step(:, d)
    if (any(n < low) .or. any(n > high)) return
    f = merge(i, n, s == 1)
    if (solid%aperture(f(1), f(2), f(3), d) > 0.0_wp) number = solid%cut(n(1), n(2), n(3))
  end function cut_neighbour

  !> Does a cell share an open face with a cell without solid, or with an open side of the domain?
  pure logical function touches_free_cell(low, high, grid, solid, i)
    integer, intent(in) :: low(3), high(3)
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
        if (n(d) < low(d) .or. n(d) > high(d)) then
          if (grid%beyond(n(d), d) .and. .not. is_wall(grid%side(s, d))) return
        else if (solid%alpha(n(1), n(2), n(3)) <= 0.0_wp) then
          return
        end if
      end do
    end do
    touches_free_cell = .false.
  end function touches_free_cell

end module pockets_m
