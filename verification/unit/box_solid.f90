!> Axis-parallel boxes as solids in the grid, by exact intervals, without bodies.
module box_solid_m
  use kinds_m, only: wp
  use boundary_kinds_m, only: side_slip, side_open, side_periodic
  use grid_m, only: grid_t
  use parallel_m, only: decompose
  use solid_geometry_m, only: solid_geometry_t
  implicit none
  private
  public :: set_boxes, set_tetrahedra, simple_grid

  !> Boxes, or one.
  interface set_boxes
    procedure :: set_many, set_one
  end interface set_boxes

  integer, parameter :: path(3, 6) = reshape([1, 2, 3, 2, 3, 1, 3, 1, 2, 3, 2, 1, &
                                             2, 1, 3, 1, 3, 2], [3, 6])

contains

  !> Grid with slip walls, an open top and, if asked, periodic directions.
  subroutine simple_grid(n, length, grid, periodic)
    integer, intent(in) :: n(3)
    real(wp), intent(in) :: length(3)   !! [m]
    type(grid_t), intent(out) :: grid
    logical, intent(in), optional :: periodic(3)
    integer :: d, lo(3), hi(3)

    grid%n = n
    grid%length = length
    grid%h = length/real(n, wp)
    grid%volume = product(grid%h)
    grid%area = grid%volume/grid%h
    grid%side = side_slip
    grid%side(2, 3) = side_open
    if (present(periodic)) grid%periodic = periodic
    do d = 1, 3
      if (grid%periodic(d)) grid%side(:, d) = side_periodic
    end do
    call decompose(n, grid%periodic, lo, hi, grid%at_side)
    call grid%own(lo, hi)
  end subroutine simple_grid

  !> Fill shares, open faces and tetrahedra of boxes that do not overlap.
  subroutine set_many(grid, low, high, solid)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: low(:, :), high(:, :)   !! (3, boxes) [m]
    type(solid_geometry_t), intent(inout) :: solid
    integer :: i, j, k, d, b
    real(wp) :: part(3), cover

    call set_tetrahedra(low, high, solid)
    solid%n_cut = 0
    solid%cut = 0
    do k = grid%first(3), grid%last(3)
      do j = grid%first(2), grid%last(2)
        do i = grid%first(1), grid%last(1)
          cover = 0.0_wp
          do b = 1, size(low, 2)
            cover = cover + product(inside([i, j, k], b))
          end do
          solid%alpha(i, j, k) = min(cover, 1.0_wp)
          if (cover > 1.0_wp - 1.0e-12_wp) solid%alpha(i, j, k) = 1.0_wp
          if (cover < 1.0e-13_wp) solid%alpha(i, j, k) = 0.0_wp
          do d = 1, 3
            cover = 0.0_wp
            do b = 1, size(low, 2)
              part = inside([i, j, k], b)
              associate (x => grid%face(merge(i, merge(j, k, d == 2), d == 1), d))
                part(d) = merge(1.0_wp, 0.0_wp, low(d, b) <= x .and. x <= high(d, b))
              end associate
              cover = cover + product(part)
            end do
            solid%aperture(i, j, k, d) = max(1.0_wp - cover, 0.0_wp)
            if (solid%aperture(i, j, k, d) < 1.0e-9_wp) solid%aperture(i, j, k, d) = 0.0_wp
          end do
          cover = solid%alpha(i, j, k)
          if (cover > 0.0_wp .and. cover < 1.0_wp) call add_cut_cell([i, j, k])
        end do
      end do
    end do
  contains
    !> Shares of the edges of a cell that lie in a box.
    pure function inside(c, b) result(part)
      integer, intent(in) :: c(3), b
      real(wp) :: part(3)

      part = min(grid%face(c + 1, [1, 2, 3]), high(:, b)) - max(grid%face(c, [1, 2, 3]), low(:, b))
      part = max(part, 0.0_wp)/grid%h
    end function inside

    subroutine add_cut_cell(c)
      integer, intent(in) :: c(3)
      integer :: m, t

      m = solid%n_cut + 1
      if (m + 1 > size(solid%tets%first)) solid%tets%first = [solid%tets%first, spread(0, 1, m + 1)]
      solid%tets%first(1) = 1
      if (solid%tets%first(m) + 6*size(low, 2) > size(solid%tets%list)) then
        solid%tets%list = [solid%tets%list, spread(0, 1, size(solid%tets%list) + 6*size(low, 2))]
      end if
      solid%tets%first(m + 1) = solid%tets%first(m)
      do t = 1, 6*size(low, 2)
        if (any(inside(c, (t + 5)/6) <= 0.0_wp)) cycle
        solid%tets%list(solid%tets%first(m + 1)) = t
        solid%tets%first(m + 1) = solid%tets%first(m + 1) + 1
      end do
      solid%edge = spread(0.0_wp, 1, m)
      solid%n_cut = m
      solid%cut(c(1), c(2), c(3)) = m
    end subroutine add_cut_cell
  end subroutine set_many

  subroutine set_one(grid, low, high, solid)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: low(3), high(3)   !! [m]
    type(solid_geometry_t), intent(inout) :: solid

    call set_many(grid, reshape(low, [3, 1]), reshape(high, [3, 1]), solid)
  end subroutine set_one

  !> Each box as six tetrahedra around its diagonal.
  subroutine set_tetrahedra(low, high, solid)
    real(wp), intent(in) :: low(:, :), high(:, :)
    type(solid_geometry_t), intent(inout) :: solid
    integer :: b, t, v, m
    real(wp) :: x(3)

    solid%tets%n = 6*size(low, 2)
    if (size(solid%tets%corner, 3) < solid%tets%n) then
      deallocate (solid%tets%corner)
      allocate (solid%tets%corner(3, 4, solid%tets%n))
    end if
    m = 0
    do b = 1, size(low, 2)
      do t = 1, 6
        m = m + 1
        x = low(:, b)
        solid%tets%corner(:, 1, m) = x
        do v = 1, 3
          x(path(v, t)) = high(path(v, t), b)
          solid%tets%corner(:, v + 1, m) = x
        end do
        ! every other way along the edges turns the other way round; volumes are positive
        if (t > 3) solid%tets%corner(:, 2:3, m) = solid%tets%corner(:, [3, 2], m)
      end do
    end do
  end subroutine set_tetrahedra

end module box_solid_m
