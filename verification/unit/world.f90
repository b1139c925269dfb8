!> A case as text, set up as the program does it: the same reader, the same start.
module world_m
  use, intrinsic :: iso_fortran_env, only: error_unit
  use kinds_m, only: wp
  use errors_m, only: problems_t
  use case_types_m, only: case_t
  use case_text_m, only: case_of, body
  use tet_mesh_m, only: shape_t
  use case_check_m, only: make_shapes
  use bed_m, only: bed_t, make_bed
  use contacts_m, only: contact_report_t, move_blocks
  use diagnostics_m, only: step_report_t
  use simulation_m, only: simulation_t, simulation_init
  use step_m, only: take_step
  implicit none
  private
  public :: world_t, set_up, begin, run, move, body

  type, extends(simulation_t) :: world_t
    type(shape_t), allocatable :: shapes(:)
    type(bed_t), pointer :: bed => null()
    type(step_report_t) :: report       !! of the last step
    type(contact_report_t) :: contact   !! of the last step of the bodies alone
  end type world_t

contains

  !> The world of a text at t = 0.
  subroutine set_up(text, world)
    character(*), intent(in) :: text
    type(world_t), intent(out) :: world
    type(case_t) :: case
    type(problems_t) :: problems

    case = case_of(text)
    call make_shapes(case, world%shapes, problems)
    allocate (world%bed)
    call make_bed(case, world%bed, problems)
    call problems%report(error_unit)
    if (problems%n > 0) error stop 'world_m: the case is refused'
    call simulation_init(case, world%shapes, world%bed, world%simulation_t)
  end subroutine set_up

  !> Another world of the same case, or of the same with changes.
  subroutine begin(case, other, world)
    type(case_t), intent(in) :: case
    type(world_t), intent(in) :: other
    type(world_t), intent(out) :: world

    world%shapes = other%shapes
    world%bed => other%bed
    call simulation_init(case, world%shapes, world%bed, world%simulation_t)
  end subroutine begin

  !> Take n steps.
  subroutine run(world, n)
    type(world_t), intent(inout) :: world
    integer, intent(in) :: n
    integer :: i

    do i = 1, n
      call take_step(world%simulation_t, world%report)
    end do
  end subroutine run

  !> Take n steps of the bodies alone, the fluid forces as they are.
  subroutine move(world, n, dt)
    type(world_t), intent(inout) :: world
    integer, intent(in) :: n
    real(wp), intent(in) :: dt   !! of each [s]
    integer :: i

    do i = 1, n
      call move_blocks(world%walls, world%case%fluid%gravity, dt, world%contacts, world%blocks, &
                       world%contact)
    end do
  end subroutine move

end module world_m
