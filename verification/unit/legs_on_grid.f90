!> The legs of a solid geometry as arrays over the faces, for tests.
module legs_on_grid_m
  use kinds_m, only: wp
  use solid_geometry_m, only: solid_geometry_t
  implicit none
  private
  public :: legs_t, legs_on_grid, no_hit

  real(wp), parameter :: no_hit = 2.0_wp   !! length of a leg that meets no surface

  type :: legs_t
    real(wp), allocatable, dimension(:, :, :, :) :: low, high      !! lengths from both cells [h]
    integer, allocatable, dimension(:, :, :, :) :: body_low, body_high   !! 0: none
  end type legs_t

contains

  !> Lengths of all legs and the bodies that they meet.
  function legs_on_grid(solid) result(legs)
    type(solid_geometry_t), intent(in) :: solid
    type(legs_t) :: legs
    integer :: m

    allocate (legs%body_low, mold=solid%leg_number)
    legs%body_low = 0
    allocate (legs%body_high, source=legs%body_low)
    associate (a => lbound(solid%leg_number), b => ubound(solid%leg_number))
      allocate (legs%low(a(1):b(1), a(2):b(2), a(3):b(3), a(4):b(4)), source=no_hit)
    end associate
    allocate (legs%high, source=legs%low)
    do m = 1, solid%n_leg
      associate (f => solid%leg(:, m))
        legs%low(f(1), f(2), f(3), f(4)) = solid%leg_length(1, m)
        legs%high(f(1), f(2), f(3), f(4)) = solid%leg_length(2, m)
        legs%body_low(f(1), f(2), f(3), f(4)) = solid%leg_body(1, m)
        legs%body_high(f(1), f(2), f(3), f(4)) = solid%leg_body(2, m)
      end associate
    end do
  end function legs_on_grid

end module legs_on_grid_m
