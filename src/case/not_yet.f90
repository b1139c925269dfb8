!> What the contract of the input promises and this version cannot do yet.
!!
!! One table: whoever makes a feature work deletes its lines here.
module not_yet_m
  implicit none
  private
  public :: is_not_yet, not_yet_message

  character(*), parameter :: not_yet_message = 'not available yet'

  type :: entry_t
    character(16) :: group     !! name of the group
    character(16) :: variable  !! '' for the whole group
    character(16) :: value     !! an option; '*' for every value but the default
  end type entry_t

  type(entry_t), parameter :: table(*) = [ &
    entry_t('bed', '', '')]

contains

  !> Is this value of this variable (or, with empty names, this whole group) in the table?
  pure function is_not_yet(group, variable, value) result(yes)
    character(*), intent(in) :: group, variable, value
    logical :: yes

    yes = any(table%group == group .and. table%variable == variable .and. table%value == value)
  end function is_not_yet

end module not_yet_m
