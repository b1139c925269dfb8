!> Heights of the surface in columns of cells (height functions).
!!
!! The liquid in a column of up to seven cells along a direction is the height of the surface there
!! (Cummins, Francois, Kothe, Comput. Struct. 83, 2005). Each column ends at its first full and its
!! first empty cell, so that another surface beyond does not count. Every cell at the surface keeps
!! its heights, so that a steep neighbour is found up to two cells higher or lower (Popinet, J.
!! Comput. Phys. 228, 2009). A column behind a closed face does not count; the one before the face
!! stands for it.
module surface_heights_m
  use kinds_m, only: wp
  use grid_m, only: grid_t, unit_step
  use solid_geometry_m, only: solid_geometry_t
  use boundary_m, only: fill_scalar_halo
  use surface_normal_m, only: passable
  use extended_fraction_m, only: nearly_pure
  implicit none
  private
  public :: column_t, find_places, nine_heights, is_full, is_empty

  integer, parameter :: half_length = 3    !! cells of a column on either side of its middle
  integer, parameter :: search = 2   !! cells up or down in which a neighbour's height is looked for
  real(wp), parameter :: no_height = huge(1.0_wp)

  !> The column of cells along direction d through a cell.
  type :: column_t
    integer :: at(3) = 0
    integer :: d = 0
    integer :: way = 1   !! 1: the gas lies above the liquid along d, -1: below
  end type column_t

contains

  elemental function is_full(c) result(yes)
    real(wp), intent(in) :: c
    logical :: yes

    yes = c >= 1.0_wp - nearly_pure
  end function is_full

  elemental function is_empty(c) result(yes)
    real(wp), intent(in) :: c
    logical :: yes

    yes = c <= nearly_pure
  end function is_empty

  !> Place of the surface in the columns through every cell at it.
  subroutine find_places(grid, c, place)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(inout), contiguous :: place(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! from the centre of the cell along each direction, `no_height` where none is found [cells]
    integer :: i, j, k, d, way
    real(wp) :: height
    logical :: found

    do d = 1, 3
      !$omp parallel do private(i, j, way, height, found) schedule(dynamic, 4)
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            place(i, j, k, d) = no_height
            way = way_of_gas(grid, c, [i, j, k], d)
            if (way == 0) cycle
            call column_height(grid, c, column_t([i, j, k], d, way), height, found)
            if (found) place(i, j, k, d) = real(way, wp)*height
          end do
        end do
      end do
      call fill_scalar_halo(grid, place(:, :, :, d))
    end do
  end subroutine find_places

  !> Does the share fall (1) or rise (-1) along direction d at a cell? 0: neither.
  pure function way_of_gas(grid, c, at, d) result(way)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    integer, intent(in) :: at(3), d
    integer :: way
    integer :: up(3), low(3)
    real(wp) :: fall

    up = at + unit_step(:, d)
    low = at - unit_step(:, d)
    fall = c(low(1), low(2), low(3)) - c(up(1), up(2), up(3))
    way = 0
    if (abs(fall) > nearly_pure) way = nint(sign(1.0_wp, fall))
  end function way_of_gas

  !> Heights of the surface in the nine columns along direction d around a cell, over the centre of
  !! the cell, in cells.
  pure subroutine nine_heights(grid, solid, c, place, column, height, found)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in), contiguous, dimension(grid%first(1):, grid%first(2):, grid%first(3):) :: &
      c, place
    type(column_t), intent(in) :: column   !! the middle one
    real(wp), intent(out) :: height(-1:1, -1:1)
    logical, intent(out) :: found
    type(column_t) :: aside
    logical :: seen(-1:1, -1:1)
    integer :: a, b, x, y

    x = modulo(column%d, 3) + 1
    y = modulo(column%d + 1, 3) + 1
    seen = .true.
    associate (at => column%at)
      if (any(solid%alpha(at(1) - 1:at(1) + 1, at(2) - 1:at(2) + 1, at(3) - 1:at(3) + 1) &
              > 0.0_wp)) call look_around(solid, at, [x, y], seen)
    end associate
    height = 0.0_wp
    do b = -1, 1
      do a = -1, 1
        if (.not. seen(a, b)) cycle
        aside = column
        aside%at = column%at + a*unit_step(:, x) + b*unit_step(:, y)
        call nearest_height(grid, c, place, aside, height(a, b), found)
        if (.not. found) return
      end do
    end do
    do b = -1, 1
      do a = -1, 1
        if (seen(a, b)) cycle
        if (seen(a, 0)) then
          height(a, b) = height(a, 0)
        else if (seen(0, b)) then
          height(a, b) = height(0, b)
        else
          height(a, b) = height(0, 0)
        end if
      end do
    end do
  end subroutine nine_heights

  !> Height of the surface in the column of a cell, over its centre, from the nearest cell of the
  !! column that knows it: upwards if the cell is full, downwards if it is empty.
  pure subroutine nearest_height(grid, c, place, column, height, found)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous, dimension(grid%first(1):, grid%first(2):, grid%first(3):) :: &
      c, place
    type(column_t), intent(in) :: column
    real(wp), intent(out) :: height   !! [cells]
    logical, intent(out) :: found
    integer :: n, s, cell(3)

    found = .false.
    height = 0.0_wp
    associate (at => column%at, d => column%d, way => column%way)
      do n = 0, search
        do s = 1, -1, -2
          if (s > 0 .and. is_empty(c(at(1), at(2), at(3))) .and. n > 0) cycle
          if (s < 0 .and. (is_full(c(at(1), at(2), at(3))) .or. n == 0)) cycle
          cell = at + s*way*n*unit_step(:, d)
          if (grid%beyond(cell(d), d)) cycle
          if (place(cell(1), cell(2), cell(3)) >= no_height) cycle
          if (way_of_gas(grid, c, cell, d) /= way) cycle
          height = real(s*n, wp) + real(way, wp)*place(cell(1), cell(2), cell(3))
          found = .true.
          return
        end do
      end do
    end associate
  end subroutine nearest_height

  !> Which of the eight columns around that of a cell are joined to it by open faces beside it.
  pure subroutine look_around(solid, at, axis, seen)
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: at(3), axis(2)   !! the two directions across the columns
    logical, intent(out) :: seen(-1:1, -1:1)
    integer :: a, b

    seen(0, 0) = .true.
    do a = -1, 1, 2
      seen(a, 0) = through(at, 1, a)
      seen(0, a) = through(at, 2, a)
    end do
    do b = -1, 1, 2
      do a = -1, 1, 2
        seen(a, b) = (seen(a, 0) .and. through(at + a*unit_step(:, axis(1)), 2, b)) .or. &
                     (seen(0, b) .and. through(at + b*unit_step(:, axis(2)), 1, a))
      end do
    end do
  contains
    !> Is the face of a cell towards the next column open?
    pure logical function through(cell, direction, side)
      integer, intent(in) :: cell(3), direction, side
      integer :: f(3)

      f = cell + max(side, 0)*unit_step(:, axis(direction))
      through = passable(solid%aperture(f(1), f(2), f(3), axis(direction)))
    end function through
  end subroutine look_around

  !> Height of the surface in the column along d through a cell, over its centre, in cells.
  !!
  !! From the surface nearest to the cell the column reaches to the first full cell on one side and
  !! the first empty one on the other, or to a wall. Not found if it is longer.
  pure subroutine column_height(grid, c, middle, height, found)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    type(column_t), intent(in) :: middle   !! cell from which it is followed
    real(wp), intent(out) :: height
    logical, intent(out) :: found
    real(wp) :: column(-half_length:half_length)
    integer :: l, low, high, first, last

    height = 0.0_wp
    first = -half_length
    last = half_length
    associate (at => middle%at, d => middle%d, way => middle%way)
      if (.not. grid%periodic(d)) then
        if (way > 0) then
          first = max(first, 1 - at(d))
          last = min(last, grid%n(d) - at(d))
        else
          first = max(first, at(d) - grid%n(d))
          last = min(last, at(d) - 1)
        end if
      end if
      do l = first, last
        associate (o => at + way*l*unit_step(:, d))
          column(l) = c(o(1), o(2), o(3))
        end associate
      end do
    end associate
    low = 0
    do while (is_full(column(low)))   ! up to the surface
      if (low == last) exit
      low = low + 1
    end do
    high = low
    do while (is_empty(column(high)))   ! or down to it
      if (high == first) exit
      high = high - 1
    end do
    low = high
    do while (low > first .and. .not. is_full(column(low)))
      low = low - 1
    end do
    do while (high < last .and. .not. is_empty(column(high)))
      high = high + 1
    end do
    found = ends_well(column(low), is_full(column(low)), first) .and. &
            ends_well(1.0_wp - column(high), is_empty(column(high)), last)
    if (found) height = real(low, wp) - 0.5_wp + sum(column(low:high))
  contains
    !> A column ends in a pure cell, or at a wall behind a cell that holds some of that phase.
    pure logical function ends_well(share, pure_cell, limit)
      real(wp), intent(in) :: share
      logical, intent(in) :: pure_cell
      integer, intent(in) :: limit

      ends_well = pure_cell .or. (abs(limit) < half_length .and. .not. is_empty(share))
    end function ends_well
  end subroutine column_height

end module surface_heights_m
