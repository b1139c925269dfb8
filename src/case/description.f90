!> What the groups of a case are made of, as a describing visitor has found it.
module description_m
  use kinds_m, only: name_length
  use allowed_values_m, only: allowed_t
  implicit none
  private
  public :: variable_t, group_description_t, described

  !> One variable of a group.
  type :: variable_t
    character(:), allocatable :: name
    character(:), allocatable :: kind       !! 'number', 'text', 'name', 'logical' or 'choice'
    character(:), allocatable :: value      !! as a case would write it, the default; empty: none
    character(:), allocatable :: meaning
    character(:), allocatable :: example    !! assignments, that of this variable the last
    character(:), allocatable :: choices    !! words, one blank between them, if a choice
    type(allowed_t) :: allowed              !! if a number
    integer :: most = 1                     !! values of a list
    logical :: required = .false.
  end type variable_t

  !> One group; its variables in the order of their reading.
  type :: group_description_t
    character(name_length) :: name = ''
    logical :: repeated = .false.           !! may a case hold several?
    character(:), allocatable :: meaning
    integer :: n = 0                        !! number of variables
    type(variable_t), allocatable :: variable(:)
  end type group_description_t

contains

  !> A variable with what all kinds have.
  pure function described(name, kind, value, meaning, example, required) result(variable)
    character(*), intent(in) :: name, kind, value, meaning
    character(*), intent(in) :: example   !! its value, or assignments with this one as the last
    logical, intent(in), optional :: required
    type(variable_t) :: variable

    variable%name = name
    variable%kind = kind
    variable%value = value
    variable%meaning = meaning
    variable%example = example
    if (index(example, ' = ') == 0) variable%example = name//' = '//example
    variable%choices = ''
    if (present(required)) variable%required = required
  end function described

end module description_m
