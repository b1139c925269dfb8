!> Cases, grids, shapes and groups of a case as text.
module case_text_m
  use, intrinsic :: iso_fortran_env, only: error_unit
  use kinds_m, only: wp
  use errors_m, only: problems_t, to_text
  use case_types_m, only: case_t
  use case_input_m, only: read_case
  use grid_m, only: grid_t, grid_init
  use tet_mesh_m, only: shape_t
  use shapes_builtin_m, only: make_shape
  implicit none
  private
  public :: case_of, grid_of, shape_of, sides, body, slip

  !> A tank with slip walls all round.
  character(*), parameter :: slip = '&boundary x_min="slip" x_max="slip" y_min="slip" ' &
    //'y_max="slip" z_min="slip" z_max="slip"/ '

contains

  !> The case of a text, which may leave out &run.
  function case_of(text) result(case)
    character(*), intent(in) :: text
    type(case_t) :: case
    type(problems_t) :: problems

    if (index(text, '&run') > 0) then
      call read_case(text, case, problems)
    else
      call read_case('&run t_end=1/ '//text, case, problems)
    end if
    call problems%report(error_unit)
    if (problems%n > 0) error stop 'case_text_m: the case is refused'
  end function case_of

  !> The grid of &grid and &boundary.
  subroutine grid_of(text, grid)
    character(*), intent(in) :: text
    type(grid_t), intent(out) :: grid
    type(case_t) :: case

    case = case_of(text)
    call grid_init(case%grid, case%boundary, grid)
  end subroutine grid_of

  !> The shape of a group &shape with these variables.
  function shape_of(variables) result(shape)
    character(*), intent(in) :: variables
    type(shape_t) :: shape
    type(case_t) :: case
    character(:), allocatable :: message

    case = case_of('&grid cells=3*2 length=3*1/ &shape name="s" '//variables//'/')
    call make_shape(case%shape(1), shape, message)
    if (len(message) > 0) error stop 'case_text_m: the shape is refused'
  end function shape_of

  !> The group &boundary of six kinds, x_min first.
  function sides(kinds) result(text)
    character(*), intent(in) :: kinds
    character(:), allocatable :: text
    character(*), parameter :: name(6) = ['x_min', 'x_max', 'y_min', 'y_max', 'z_min', 'z_max']
    character(8) :: kind(6)
    integer :: s

    read (kinds, *) kind
    text = '&boundary'
    do s = 1, 6
      text = text//' '//name(s)//'="'//trim(kind(s))//'"'
    end do
    text = text//'/ '
  end function sides

  !> A group &body at x that moves with v.
  function body(shape, x, v, q, more) result(text)
    character(*), intent(in) :: shape
    real(wp), intent(in) :: x(3)               !! [m]
    real(wp), intent(in), optional :: v(3)     !! [m/s]
    real(wp), intent(in), optional :: q(4)     !! attitude
    character(*), intent(in), optional :: more
    character(:), allocatable :: text

    text = '&body shape="'//shape//'" position='//to_text(x)
    if (present(v)) text = text//' velocity='//to_text(v)
    if (present(q)) text = text//' quaternion='//to_text(q)
    if (present(more)) text = text//' '//more
    text = text//'/ '
  end function body

end module case_text_m
