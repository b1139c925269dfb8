!> A name of a scheme that no branch handles ends the program; it is never taken for another one.
!! The reader of the case refuses such names, so this happens to who adds one and forgets a branch.
!!
!! The program calls itself with the choice to make as its argument: the call must fail.
module test_unknown_names_m
  use check_m, only: check, wp
  use case_types_m, only: case_t, place_t
  use case_text_m, only: case_of
  use tet_mesh_m, only: shape_t
  use shapes_builtin_m, only: make_shape
  use drops_m, only: place_of_block
  use rigid_body_m, only: blocks_t
  use case_blocks_m, only: blocks_init
  use contact_detection_m, only: contact_detection_t, detection_init
  use grid_m, only: grid_t, grid_init
  use tvd_m, only: scheme_of
  use fluid_transport_m, only: fluid_transport_t, fluid_transport_init
  use pressure_system_m, only: pressure_system_t, pressure_system_init
  use monolithic_m, only: monolithic_t, monolithic_init
  use solid_fraction_m, only: subcells_of
  implicit none
  private
  public :: test_unknown_names

  character(*), parameter :: choices(9) = [character(14) :: 'spheres', 'kind', 'orientation', &
    'model', 'advection', 'momentum', 'solver', 'preconditioner', 'solid_fraction']
  character(14) :: choice
  integer :: c

contains

  subroutine test_unknown_names()
    call get_command_argument(2, choice)
    if (len_trim(choice) > 0) then
      call choose(choice, 'unheard')
      stop
    end if
    do c = 1, size(choices)
      call check(trim(choices(c)), status_of(trim(choices(c))), 1)
    end do
    call check('what is known passes', status_of('nothing'), 0)
  end subroutine test_unknown_names

  !> Exit status of this program with an argument.
  integer function status_of(argument) result(status)
    character(*), intent(in) :: argument
    character(4096) :: program

    call get_command_argument(0, program)
    call execute_command_line('"'//trim(program)//'" unknown_names '//argument//' 2> /dev/null', &
      exitstat=status)
  end function status_of

  !> Make all choices that a run makes by name, one of them by an unknown name.
  subroutine choose(choice, name)
    character(*), intent(in) :: choice, name
    type(case_t) :: case
    type(grid_t) :: grid
    type(shape_t) :: shapes(1)
    type(blocks_t) :: blocks
    type(contact_detection_t) :: detected
    type(fluid_transport_t) :: transport
    type(pressure_system_t) :: system
    type(monolithic_t) :: coupling
    character(:), allocatable :: message
    type(place_t) :: place
    integer :: subcells

    case = case_of('&grid cells=3*4 length=3*1/ &shape name="b" kind="cube" size=.1/ ' &
      //'&body shape="b" position=3*.2/ &drop shape="b" position=3*.5/')
    associate (shape => case%shape(1), drop => case%drop(1), contact => case%contact, &
               numerics => case%numerics)
      select case (choice)
      case ('spheres'); shape%spheres = name
      case ('kind'); shape%kind = name
      case ('orientation'); drop%orientation = name
      case ('model'); contact%model = name
      case ('advection'); numerics%advection = name
      case ('momentum'); numerics%momentum = name
      case ('solver'); numerics%pressure_solver = name
      case ('preconditioner'); numerics%preconditioner = name
      case ('solid_fraction'); numerics%solid_fraction = name
      case ('nothing')
      case default; error stop 'test_unknown_names: no such choice'
      end select
      call make_shape(shape, shapes(1), message)
      if (len(message) > 0) error stop 'test_unknown_names: a shape that the program refuses'
      place = place_of_block(drop, 1)
      call blocks_init(case, shapes, blocks)
      call detection_init(contact, 1.0e-4_wp, blocks, detected)
      call grid_init(case%grid, case%boundary, grid)
      if (scheme_of(numerics%advection) == 0) error stop 'test_unknown_names: scheme 0'
      subcells = subcells_of(numerics)
      call pressure_system_init(grid, 1, numerics, system)
      call fluid_transport_init(case, grid, transport)
      call monolithic_init(grid, 1, case, coupling)
    end associate
  end subroutine choose

end module test_unknown_names_m
