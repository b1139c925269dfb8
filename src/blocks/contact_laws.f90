!> The contact laws by their names: a new one is a file and a line here.
module contact_laws_m
  use case_types_m, only: contact_input_t
  use contact_law_m, only: contact_law_t
  use law_restitution_m, only: law_restitution
  use law_constants_m, only: law_constants
  implicit none
  private
  public :: choose_law

contains

  !> The law of a case.
  subroutine choose_law(input, law)
    type(contact_input_t), intent(in) :: input
    class(contact_law_t), allocatable, intent(out) :: law

    select case (input%law)
    case ('restitution'); allocate (law, source=law_restitution(input))
    case ('constants'); allocate (law, source=law_constants(input))
    case default; error stop 'choose_law: no such law'
    end select
    law%friction = input%friction
    law%wall_friction = input%wall_friction
  end subroutine choose_law

end module contact_laws_m
