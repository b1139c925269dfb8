!> The kinds of sides a tank can have, a row each: what it is called and what it asks of the flow.
!!
!! A new kind is a row here, and its physics where a rule of its own begins.
module boundary_kinds_m
  use kinds_m, only: name_length
  implicit none
  private
  public :: no_side, side_no_slip, side_slip, side_open, side_periodic, side_inflow, side_outflow
  public :: side_code, side_names, is_wall, gives_pressure, gives_velocity, drags

  integer, parameter :: no_side = 0   !! a cell that has a neighbour there, and an unknown name
  integer, parameter :: side_no_slip = 1, side_slip = 2, side_open = 3, side_periodic = 4
  integer, parameter :: side_inflow = 5, side_outflow = 6

  type :: boundary_kind_t
    character(name_length) :: name   !! in the case file
    logical :: wall                  !! no fluid and no block passes
    logical :: pressure              !! given half a cell beyond the last cell: the flow is free
    logical :: velocity              !! given normal to the side: none of a wall, an inflow's own
    logical :: drag                  !! along the side the fluid moves with it
  end type boundary_kind_t

  type(boundary_kind_t), parameter :: kind_of(0:*) = [ &
    !                            wall     pressure velocity drag
    boundary_kind_t('',          .false., .false., .false., .false.), &
    boundary_kind_t('no_slip',   .true.,  .false., .true.,  .true.), &
    boundary_kind_t('slip',      .true.,  .false., .true.,  .false.), &
    boundary_kind_t('open',      .false., .true.,  .false., .false.), &
    boundary_kind_t('periodic',  .false., .false., .false., .false.), &
    boundary_kind_t('inflow',    .false., .false., .true.,  .true.), &
    boundary_kind_t('outflow',   .false., .true.,  .false., .false.)]

  !> What a side of each code is; an array of codes makes one of answers.
  logical, parameter :: is_wall(0:*) = kind_of%wall
  logical, parameter :: gives_pressure(0:*) = kind_of%pressure
  logical, parameter :: gives_velocity(0:*) = kind_of%velocity
  logical, parameter :: drags(0:*) = kind_of%drag

contains

  !> Code of a kind by its name; `no_side` for an unknown one.
  elemental function side_code(name) result(code)
    character(*), intent(in) :: name
    integer :: code

    code = max(no_side, findloc(kind_of%name == name, .true., 1) - 1)   ! the first is 0
  end function side_code

  !> The names of all kinds, one blank between them.
  pure function side_names() result(names)
    character(:), allocatable :: names
    integer :: code

    names = trim(kind_of(1)%name)
    do code = 2, ubound(kind_of, 1)
      names = names//' '//trim(kind_of(code)%name)
    end do
  end function side_names

end module boundary_kinds_m
