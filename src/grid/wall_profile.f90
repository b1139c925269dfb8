!> Velocity along a wall nearer to it than a cell: between a line to the wall and free slip.
module wall_profile_m
  use kinds_m, only: wp
  implicit none
  private
  public :: slip_at

contains

  !> Share of the velocity of a cell along the wall that the fluid at r times its distance has
  !! beyond the line to the wall.
  !!
  !! In a layer U y/(y + delta), s = 1/(1 + delta/y_c), y_c the distance of the cell: 0 in a thick
  !! layer, 1 without one (`momentum/wall_layer.f90`).
  elemental function slip_at(layer, r) result(slip)
    real(wp), intent(in) :: layer   !! slip s of the layer, 0 to 1
    real(wp), intent(in) :: r       !! distance from the wall over that of the cell, 0 to 1
    real(wp) :: slip

    slip = r*layer/max(r*layer + 1.0_wp - layer, tiny(1.0_wp))
  end function slip_at
end module wall_profile_m
