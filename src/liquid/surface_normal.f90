!> Normal of the liquid surface in a cell, never looking through the closed faces of bodies.
module surface_normal_m
  use kinds_m, only: wp
  use grid_m, only: grid_t
  use solid_geometry_m, only: solid_geometry_t
  use plic_m, only: unit_normal
  implicit none
  private
  public :: vertical_t, vertical_of, surface_normal, passable

  real(wp), parameter :: min_open = 1.0e-6_wp   !! open share of a face that can be looked through

  !> Which way is up: rows of cells with equal height lie normal to it.
  type :: vertical_t
    integer :: axis = 0                  !! main axis of gravity, 0: there is none
    real(wp) :: up(3) = 0.0_wp           !! unit vector along it, against gravity; else along z
  end type vertical_t

  !> The 26 neighbours, those across a face first, then edges, then corners.
  integer, parameter :: neighbour(3, 26) = reshape([ &
    -1, 0, 0, 1, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, -1, 0, 0, 1, &
    -1, -1, 0, 1, -1, 0, -1, 1, 0, 1, 1, 0, -1, 0, -1, 1, 0, -1, &
    -1, 0, 1, 1, 0, 1, 0, -1, -1, 0, 1, -1, 0, -1, 1, 0, 1, 1, &
    -1, -1, -1, 1, -1, -1, -1, 1, -1, 1, 1, -1, -1, -1, 1, 1, -1, 1, -1, 1, 1, 1, 1, 1], [3, 26])

contains

  !> The vertical of a gravity [m/s2].
  pure function vertical_of(gravity) result(vertical)
    real(wp), intent(in) :: gravity(3)
    type(vertical_t) :: vertical

    if (any(abs(gravity) > 0.0_wp)) vertical%axis = maxloc(abs(gravity), 1)
    if (vertical%axis == 0) vertical%up(3) = 1.0_wp
    if (vertical%axis > 0) vertical%up(vertical%axis) = -sign(1.0_wp, gravity(vertical%axis))
  end function vertical_of

  !> Can one look through a face of this open share?
  elemental function passable(aperture) result(yes)
    real(wp), intent(in) :: aperture
    logical :: yes

    yes = aperture > min_open
  end function passable

  !> Normal from liquid to gas on the unit cube of a cell (see `plic_m`); up where nothing shows
  !! one.
  pure function surface_normal(grid, solid, vertical, c, i, j, k) result(m)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(vertical_t), intent(in) :: vertical
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
      !! C^, halo filled
    integer, intent(in) :: i, j, k
    real(wp) :: m(3)
    real(wp) :: shares(3, 3, 3)

    if (any(solid%alpha(i - 1:i + 1, j - 1:j + 1, k - 1:k + 1) > 0.0_wp)) then
      shares = seen_shares(grid, solid, vertical%axis, c, [i, j, k])
    else
      shares = c(i - 1:i + 1, j - 1:j + 1, k - 1:k + 1)
    end if
    m = unit_normal(shares)
    if (.not. any(abs(m) > 0.0_wp)) m = vertical%up
  end function surface_normal

  !> Shares of the 27 cells as seen from the middle one near bodies.
  !!
  !! A neighbour counts if a path of open faces leads to it within the 27. A hidden one takes the
  !! value of its row above or below the middle cell if that can be seen, else its own, which is the
  !! extended one where there is a body. Outside the domain the last cell repeats.
  pure function seen_shares(grid, solid, axis, c, at) result(q)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: axis
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    integer, intent(in) :: at(3)
    real(wp) :: q(-1:1, -1:1, -1:1)
    logical :: seen(-1:1, -1:1, -1:1)
    integer :: n, d, o(3), before(3), f(3), cell(3)

    seen = .false.
    seen(0, 0, 0) = .true.
    q(0, 0, 0) = c(at(1), at(2), at(3))
    do n = 1, size(neighbour, 2)
      o = neighbour(:, n)
      cell = at + o
      if (grid%outside(cell)) cycle
      do d = 1, 3
        if (o(d) == 0) cycle
        before = o
        before(d) = 0
        f = at + before
        f(d) = f(d) + max(o(d), 0)
        if (.not. seen(before(1), before(2), before(3))) cycle
        if (passable(solid%aperture(f(1), f(2), f(3), d))) seen(o(1), o(2), o(3)) = .true.
      end do
      if (.not. seen(o(1), o(2), o(3))) then
        before = 0
        if (axis > 0) before(axis) = o(axis)
        if (seen(before(1), before(2), before(3))) cell = at + before
      end if
      q(o(1), o(2), o(3)) = c(cell(1), cell(2), cell(3))
    end do
    do n = 1, size(neighbour, 2)
      o = neighbour(:, n)
      cell = at + o
      where (grid%beyond(cell, [1, 2, 3])) cell = at
      q(o(1), o(2), o(3)) = q(cell(1) - at(1), cell(2) - at(2), cell(3) - at(3))
    end do
  end function seen_shares

end module surface_normal_m
