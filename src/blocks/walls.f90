!> The plane walls of the tank, and its bed, as counterparts of the blocks.
module walls_m
  use kinds_m, only: wp
  use case_types_m, only: grid_input_t, boundary_input_t
  use boundary_kinds_m, only: side_code, is_wall
  use bed_m, only: bed_t
  implicit none
  private
  public :: walls_t, walls_init, floor_wall

  integer, parameter :: floor_wall = -5   !! number of the side z_min

  type(bed_t), target :: no_bed

  !> Sides that blocks can touch (`no_slip` and `slip`), and the periods of the others.
  !!
  !! A wall is a counterpart with a negative number: -1 x_min, -2 x_max, -3 y_min ... -6 z_max; the
  !! bed is `bed_counterpart`.
  type :: walls_t
    integer :: n = 0
    integer :: number(6) = 0                !! -6..-1, ascending
    real(wp) :: normal(3, 6) = 0.0_wp       !! unit vector out of the tank [-]
    real(wp) :: offset(6) = 0.0_wp          !! normal.x of the points of the wall [m]
    real(wp) :: velocity(3, 6) = 0.0_wp     !! of the wall in its own plane [m/s]
    logical :: slip(6) = .false.            !! no friction with the fluid
    type(bed_t), pointer :: bed => no_bed   !! large, so it is there once
    real(wp) :: period(3) = 0.0_wp          !! length of the tank where it is periodic, else 0 [m]
  end type walls_t

contains

  !> The contact walls of a case, without a bed.
  subroutine walls_init(grid, boundary, walls)
    type(grid_input_t), intent(in) :: grid
    type(boundary_input_t), intent(in) :: boundary
    type(walls_t), intent(out) :: walls
    integer :: s, d, m
    real(wp) :: sense

    do d = 3, 1, -1
      if (boundary%kind(1, d) == 'periodic') walls%period(d) = grid%length(d)
      do s = 2, 1, -1
        if (.not. is_wall(side_code(boundary%kind(s, d)))) cycle
        m = walls%n + 1
        sense = real(2*s - 3, wp)
        walls%n = m
        walls%number(m) = -(2*(d - 1) + s)
        walls%normal(d, m) = sense
        walls%offset(m) = sense*(grid%origin(d) + real(s - 1, wp)*grid%length(d))
        walls%velocity(:, m) = boundary%velocity(:, s, d)
        walls%velocity(d, m) = 0.0_wp
        walls%slip(m) = boundary%kind(s, d) == 'slip'
      end do
    end do
  end subroutine walls_init

end module walls_m
