!> The links of a solid geometry as arrays over the faces, for tests.
module links_on_grid_m
  use kinds_m, only: wp
  use solid_geometry_m, only: solid_geometry_t
  implicit none
  private
  public :: links_t, links_on_grid, no_hit

  real(wp), parameter :: no_hit = 2.0_wp   !! length of a link that meets no surface

  type :: links_t
    real(wp), allocatable, dimension(:, :, :, :) :: low, high      !! lengths from both cells [h]
    integer, allocatable, dimension(:, :, :, :) :: body_low, body_high   !! 0: none
  end type links_t

contains

  !> Lengths of all links and the bodies that they meet.
  function links_on_grid(solid) result(links)
    type(solid_geometry_t), intent(in) :: solid
    type(links_t) :: links
    integer :: m

    allocate (links%body_low, mold=solid%link_number)
    links%body_low = 0
    allocate (links%body_high, source=links%body_low)
    associate (a => lbound(solid%link_number), b => ubound(solid%link_number))
      allocate (links%low(a(1):b(1), a(2):b(2), a(3):b(3), a(4):b(4)), source=no_hit)
    end associate
    allocate (links%high, source=links%low)
    do m = 1, solid%n_link
      associate (f => solid%link(:, m))
        links%low(f(1), f(2), f(3), f(4)) = solid%link_length(1, m)
        links%high(f(1), f(2), f(3), f(4)) = solid%link_length(2, m)
        links%body_low(f(1), f(2), f(3), f(4)) = solid%link_body(1, m)
        links%body_high(f(1), f(2), f(3), f(4)) = solid%link_body(2, m)
      end associate
    end do
  end function links_on_grid

end module links_on_grid_m
