!> What the groups of a case are made of, as a describing visitor has found it.
module description_m
  use kinds_m, only: name_length
  use allowed_values_m, only: allowed_t
  use value_text_m, only: quoted_text
  implicit none
  private
  public :: variable_t, group_description_t, described, choices, word_text, &
    words_text, next_word

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

  !> The words of a list, as a message shows them.
  pure function choices(allowed) result(text)
    character(*), intent(in) :: allowed
    character(:), allocatable :: text
    integer :: first, last

    text = ''
    last = -1
    do while (last < len(allowed))
      call next_word(allowed, first, last)
      if (len(text) > 0) text = text//', '
      text = text//quoted_text(allowed(first:last))
    end do
  end function choices

  !> Where the next word of a list stands, one blank between the words; begin with `last` = -1.
  pure subroutine next_word(words, first, last)
    character(*), intent(in) :: words
    integer, intent(out) :: first
    integer, intent(inout) :: last   !! of the word before, then of this one

    first = last + 2
    last = first + scan(words(first:)//' ', ' ') - 2
  end subroutine next_word

  !> A word between quotes; empty for none.
  pure function word_text(word) result(text)
    character(*), intent(in) :: word
    character(:), allocatable :: text

    text = ''
    if (word /= '') text = quoted_text(trim(word))
  end function word_text

  !> Words between quotes, commas between several; empty for none.
  pure function words_text(words) result(text)
    character(*), intent(in) :: words(:)
    character(:), allocatable :: text
    integer :: i

    text = ''
    do i = 1, size(words)
      if (words(i) == '') cycle
      if (len(text) > 0) text = text//', '
      text = text//word_text(words(i))
    end do
  end function words_text

end module description_m
