!> Free blocks narrower than a cell are refused where the water is resolved, and nowhere else.
module test_resolved_width_m
  use check_m, only: check
  use errors_m, only: problems_t
  use case_types_m, only: case_t
  use case_input_m, only: read_case
  use case_check_m, only: make_shapes, check_widths
  use tet_mesh_m, only: shape_t
  implicit none
  private
  public :: test_resolved_width

  character(*), parameter :: lf = new_line('a')
  character(*), parameter :: tank = '&run t_end = 1 /'//lf//'&grid cells = 10, ' &
    //'1, 10  length = 0.2, 0.5, 0.25 /'//lf//'&boundary y_min = ''slip'' y_max = ''slip'' /'//lf
  character(*), parameter :: rod = '&shape name=''r'' kind=''box'' size=0.02, 0.1, 0.02 /'//lf
  character(*), parameter :: there = '&body shape=''r'' position=0.1, 0.25, 0.1'
  character(*), parameter :: stones = '&shape name=''g'' kind=''rock'' density=2650 ' &
    //'mass_50=0.04 mass_min=0.01 mass_max=0.1 variants=9 /'//lf

contains

  subroutine test_resolved_width()
    ! the largest edge of a cell counts, without the direction of a single cell: 25 mm
    call expect(rod//there//'/', '&shape r is 0.02 m wide, 0.8 of a cell of 0.025 m; resolved ' &
      //'water needs one cell across a free block: finer &grid cells, physics = ''light'', or a ' &
      //'block at least 0.025 m wide')
    call expect(rod//there//' fixed=t/', '')
    call expect(rod, '')
    call expect(rod//'&drop shape=''r'' position=0.1, 0.25, 0.1 /', '&shape r is 0.02 m wide')
    ! one cell to round-off is enough
    call expect('&shape name=''r'' kind=''cube'' size=0.024999999999 /'//lf//there//'/', '')
    ! a plate may be thinner
    call expect('&shape name=''r'' kind=''box'' size=0.005, 0.1, 0.026 /'//lf//there//'/', '')
    ! the least stone is told once, with the mass that it should have
    call expect(stones//'&drop shape=''g'' count=9 position=0.1, 0.25, 0.1 /', '&shape g-')
    call expect('&shape name=''g'' kind=''rock'' density=2650 mass_50=0.2 mass_min=0.15 ' &
      //'variants=9 /'//lf//'&drop shape=''g'' count=9 position=0.1, 0.25, 0.1 /', '')
  end subroutine test_resolved_width

  !> The only problem of a case begins as told; none if it is empty.
  subroutine expect(text, told)
    character(*), intent(in) :: text, told
    type(case_t) :: case
    type(shape_t), allocatable :: shapes(:)
    type(problems_t) :: problems, warnings

    call read_case(tank//text, case, problems, warnings)
    call make_shapes(case, shapes, problems)
    call check('a sound case', problems%n == 0)
    call check_widths(case, shapes, problems)
    call check('number of problems: '//told, problems%n == merge(1, 0, len(told) > 0))
    if (problems%n == 1) call check(told, index(problems%message(1), told) == 1)
  end subroutine expect

end module test_resolved_width_m
