!> The kinds of sides a tank can have: what each is called and what it asks of the flow.
!!
!! A new kind is one more entry of each list here, and its physics where a rule of its own begins.
module boundary_kinds_m
  use value_text_m, only: words_of
  implicit none
  private
  public :: no_side, side_no_slip, side_slip, side_open, side_periodic, side_inflow, side_outflow
  public :: side_code, side_names, is_wall, gives_pressure, gives_velocity, drags

  integer, parameter :: no_side = 0   !! a cell that has a neighbour there, and an unknown name
  integer, parameter :: side_no_slip = 1, side_slip = 2, side_open = 3, side_periodic = 4
  integer, parameter :: side_inflow = 5, side_outflow = 6

  character(*), parameter :: side_names = 'no_slip slip open periodic inflow outflow'

  logical, parameter :: t = .true., f = .false.
  !> What a side of each code is, in the order above; an array of codes makes one of answers. No
  !! fluid and no block passes a wall.
  logical, parameter :: is_wall(0:*) = [f, t, t, f, f, f, f]
  !> The pressure is given half a cell beyond the last cell: the flow is free.
  logical, parameter :: gives_pressure(0:*) = [f, f, f, t, f, f, t]
  !> The velocity normal to the side is given: none of a wall, an inflow's own.
  logical, parameter :: gives_velocity(0:*) = [f, t, t, f, f, t, f]
  !> Along the side the fluid moves with it.
  logical, parameter :: drags(0:*) = [f, t, f, f, f, t, f]

contains

  !> Code of a kind by its name; `no_side` for an unknown one.
  elemental function side_code(name) result(code)
    character(*), intent(in) :: name
    integer :: code

    code = findloc(words_of(side_names) == name, .true., 1)   ! `no_side` if there is none
  end function side_code

end module boundary_kinds_m
