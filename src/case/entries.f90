!> Entries of the case file: what the reader, the help and the schema say of a variable.
module entries_m
  use kinds_m, only: wp, name_length
  use errors_m, only: to_text
  use allowed_values_m, only: allowed_t
  use value_text_m, only: quoted_text
  implicit none
  private
  public :: entry_t, words_of, choices

  !> One variable of a group.
  type :: entry_t
    character(name_length) :: name = ''
    character(8) :: kind = ''               !! 'number', 'text', 'name', 'logical' or 'choice'
    real(wp), allocatable :: number(:)      !! values that are given or by default, of a number
    character(:), allocatable :: text       !! of the other kinds, as a case would write it
    character(:), allocatable :: meaning
    character(:), allocatable :: example    !! assignments, that of this variable the last
    character(:), allocatable :: choices    !! words, one blank between them, if a choice
    type(allowed_t) :: allowed              !! if a number
    integer :: most = 1                     !! values of a list
    logical :: required = .false.
    logical :: idle = .false.               !! without meaning, because of what was chosen
  contains
    procedure :: value => entry_value, with_unit
  end type entry_t

contains

  !> The value as a case would write it; empty for none.
  pure function entry_value(self) result(text)
    class(entry_t), intent(in) :: self
    character(:), allocatable :: text

    if (self%kind /= 'number') then
      text = self%text
    else if (self%allowed%whole) then
      text = to_text(nint(self%number))
    else
      text = to_text(self%number)
    end if
  end function entry_value

  !> The meaning, with the unit if there is one.
  pure function with_unit(self) result(text)
    class(entry_t), intent(in) :: self
    character(:), allocatable :: text

    text = self%meaning
    if (self%allowed%unit /= '') text = text//' ['//trim(self%allowed%unit)//']'
  end function with_unit

  !> The words of a list with one blank between them.
  pure function words_of(list) result(words)
    character(*), intent(in) :: list
    character(name_length), allocatable :: words(:)
    integer :: first, last

    allocate (words(0))
    first = 1
    do while (first <= len(list))
      last = first + scan(list(first:)//' ', ' ') - 2
      words = [character(name_length) :: words, list(first:last)]
      first = last + 2
    end do
  end function words_of

  !> Words as a message or a case shows them, between quotes with commas; empty ones left out.
  pure function choices(words) result(text)
    character(*), intent(in) :: words(:)
    character(:), allocatable :: text
    integer :: i

    text = ''
    do i = 1, size(words)
      if (words(i) == '') cycle
      if (len(text) > 0) text = text//', '
      text = text//quoted_text(trim(words(i)))
    end do
  end function choices

end module entries_m
