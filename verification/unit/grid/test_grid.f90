!> Kinds of sides, and which cells and faces lie at them, outside the domain or with this process.
module test_grid_m
  use check_m, only: check, wp
  use boundary_kinds_m, only: no_side, side_no_slip, side_slip, side_open, side_periodic, &
    side_inflow, side_outflow, side_code, side_names, is_wall, gives_pressure, gives_velocity, drags
  use grid_m, only: grid_t
  use case_text_m, only: grid_of
  implicit none
  private
  public :: test_grid

  integer, parameter :: kinds(6) = [side_no_slip, side_slip, side_open, side_periodic, &
                                    side_inflow, side_outflow]
  integer, parameter :: cells(3) = [6, 4, 5]
  type(grid_t) :: grid

contains

  !> Of a tank with inflow and outflow in x, periodic in y, walls below and above.
  subroutine test_grid()
    call table_of_kinds()
    call grid_of('&grid cells=6,4,5 length=3*1/ &fluid water_level=.5/ &boundary x_min="inflow" ' &
      //'x_min_velocity=1,0,0 x_max="outflow" y_min="periodic" y_max="periodic" ' &
      //'z_min="no_slip" z_max="slip"/', grid)
    call places_of_cells(grid)
    call sides_of_domain(grid)
    call sides_of_part(grid)
  end subroutine test_grid

  !> Every row by its name, and what it asks for.
  subroutine table_of_kinds()
    call check('codes by name', all(side_code([character(8) :: 'no_slip', 'slip', 'open', &
      'periodic', 'inflow', 'outflow']) == kinds))
    call check('unknown name', side_code('window') == no_side)
    call check('no name', side_code('') == no_side)
    call check('names', side_names == 'no_slip slip open periodic inflow outflow')
    call check('walls', all(is_wall(kinds) .eqv. kinds <= side_slip))
    call check('pressure given', all(gives_pressure(kinds) .eqv. &
                                     (kinds == side_open .or. kinds == side_outflow)))
    call check('velocity given', all(gives_velocity(kinds) .eqv. &
                                     (is_wall(kinds) .or. kinds == side_inflow)))
    call check('drag', all(drags(kinds) .eqv. (kinds == side_no_slip .or. kinds == side_inflow)))
    call check('no side asks for anything', .not. any([is_wall(no_side), gives_pressure(no_side), &
                                                       gives_velocity(no_side), drags(no_side)]))
  end subroutine table_of_kinds

  subroutine places_of_cells(grid)
    type(grid_t), intent(in) :: grid

    call check('first and last inside', .not. (grid%outside([1, 1, 1]) .or. grid%outside(cells)))
    call check('beyond x, z', all([grid%outside([0, 2, 2]), grid%outside([7, 2, 2]), &
                                   grid%outside([2, 2, 0]), grid%outside([2, 2, 6])]))
    call check('none beyond a period', .not. (grid%outside([2, 0, 2]) .or. grid%outside([2, 5, 2])))
    call check('beyond', all(grid%beyond([0, 0, 0], [1, 2, 3]) .eqv. [.true., .false., .true.]))
    call check('lower', all(grid%beside([1, 1, 1], 1, [1, 2, 3]) .eqv. [.true., .false., .true.]))
    call check('upper', all(grid%beside(cells, 2, [1, 2, 3]) .eqv. [.true., .false., .true.]))
    call check('not beside', .not. any([grid%beside(2, 1, 1), grid%beside(1, 2, 1)]))
    call check('side of the faces in x', all(grid%side_of_face([1, 2, 6, 7], 1) == &
                                             [side_inflow, no_side, no_side, side_outflow]))
    call check('a period has no side', all(grid%side_of_face([1, 5], 2) == no_side))
  end subroutine places_of_cells

  !> One process has all sides.
  subroutine sides_of_domain(grid)
    type(grid_t), intent(in) :: grid
    integer :: a(3), b(3)

    call grid%side_faces(1, 1, a, b)
    call check('faces of x_min', all(a == [1, 1, 1]) .and. all(b == [1, 4, 5]))
    call grid%side_faces(2, 1, a, b)
    call check('faces of x_max', all(a == [7, 1, 1]) .and. all(b == [7, 4, 5]))
    call grid%side_cells(1, 3, a, b)
    call check('cells at z_min', all(a == [1, 1, 1]) .and. all(b == [6, 4, 1]))
    call grid%side_cells(2, 3, a, b)
    call check('cells at z_max', all(a == [1, 1, 5]) .and. all(b == [6, 4, 5]))
    call grid%side_faces(2, 2, a, b)
    call check('no faces between periods', any(b < a))
    call grid%side_cells(1, 2, a, b)
    call check('no cells between periods', any(b < a))
  end subroutine sides_of_domain

  !> The upper half in z of the tank, as one of two processes has it.
  subroutine sides_of_part(grid)
    type(grid_t), intent(inout) :: grid
    integer :: a(3), b(3)

    call grid%own([1, 1, 3], cells)
    grid%at_side(1, 3) = .false.
    call check('own cells', grid%owns([1, 1, 3]) .and. grid%owns(cells))
    call check('cells of another process', .not. (grid%owns([1, 1, 2]) .or. grid%owns([7, 1, 3])))
    call grid%side_faces(1, 3, a, b)
    call check('z_min belongs to another process', any(b < a))
    call grid%side_faces(2, 3, a, b)
    call check('z_max is ours', all(a == [1, 1, 6]) .and. all(b == [6, 4, 6]))
    call grid%side_faces(1, 1, a, b)
    call check('our part of x_min', all(a == [1, 1, 3]) .and. all(b == [1, 4, 5]))
  end subroutine sides_of_part

end module test_grid_m
