!> What is said of a variable of the case once, for the check, the help and the schema: which values
!! it may have, its unit, default and meaning.
module allowed_values_m
  use kinds_m, only: wp, name_length
  use errors_m, only: to_text
  use value_text_m, only: quoted_text
  implicit none
  private
  public :: entry_t, choices
  public :: allowed_t, any_number, positive, not_negative, share, whole, between

  type :: allowed_t
    real(wp) :: low = -huge(1.0_wp), high = huge(1.0_wp)   !! these: no bound
    logical :: with_low = .true.             !! may the value be `low` itself?
    logical :: whole = .false.
    character(16) :: unit = ''               !! '-' for a pure number, empty for a count
    character(48) :: zero = ''               !! what 0 means if that is special, else empty
    integer :: fewest = 0                    !! values of a list that may be short; 0: all
  contains
    procedure :: problem => allowed_problem
    procedure :: words => allowed_words
  end type allowed_t

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

  type(allowed_t), parameter :: whole = allowed_t(whole=.true.)   !! any whole number
  !> Above 0, at most 1.
  type(allowed_t), parameter :: share = allowed_t(unit='-', low=0.0_wp, with_low=.false., &
    high=1.0_wp)

  !> From the first to the second number, both included.
  interface between
    procedure :: between_reals, between_wholes
  end interface between

contains

  pure function any_number(unit) result(allowed)
    character(*), intent(in) :: unit
    type(allowed_t) :: allowed

    allowed = allowed_t(unit=unit)
  end function any_number

  pure function positive(unit) result(allowed)
    character(*), intent(in) :: unit
    type(allowed_t) :: allowed

    allowed = allowed_t(unit=unit, low=0.0_wp, with_low=.false.)
  end function positive

  pure function not_negative(unit, zero) result(allowed)
    character(*), intent(in) :: unit
    character(*), intent(in), optional :: zero   !! such as '0 means never'
    type(allowed_t) :: allowed

    allowed = allowed_t(unit=unit, low=0.0_wp)
    if (present(zero)) allowed%zero = zero
  end function not_negative

  pure function between_reals(low, high, unit) result(allowed)
    real(wp), intent(in) :: low, high
    character(*), intent(in) :: unit
    type(allowed_t) :: allowed

    allowed = allowed_t(unit=unit, low=low, high=high)
  end function between_reals

  pure function between_wholes(low, high) result(allowed)
    integer, intent(in) :: low, high
    type(allowed_t) :: allowed

    allowed = allowed_t(whole=.true., low=real(low, wp), high=real(high, wp))
  end function between_wholes

  !> What is wrong with some of the values, and what is allowed; empty if nothing is.
  pure function allowed_problem(self, x) result(text)
    class(allowed_t), intent(in) :: self
    real(wp), intent(in) :: x(:)
    character(:), allocatable :: text

    text = ''
    if (all(x > self%low .or. (self%with_low .and. x >= self%low)) .and. all(x <= self%high)) return
    if (self%low > 0.0_wp .and. .not. self%whole .and. any(x <= 0.0_wp)) then
      text = 'must be positive ['//trim(self%unit)//']'
    else if (self%high < huge(x) .and. self%with_low) then
      text = 'must lie '//self%words()
      if (self%unit /= '-') text = trim(text//' '//self%unit)
    else if (self%high < huge(x) .or. self%whole) then
      text = 'must be '//self%words()
      if (size(x) > 1) text = text//' in each direction'
    else
      text = 'must be '
      if (self%with_low) text = 'must not be '
      text = text//merge('negative', 'positive', self%with_low)//' ['//trim(self%unit)//']'
      if (self%zero /= '') text = text//'; '//trim(self%zero)
    end if
  end function allowed_problem

  !> What is allowed, in words; empty if every number is.
  pure function allowed_words(self) result(text)
    class(allowed_t), intent(in) :: self
    character(:), allocatable :: text

    text = ''
    if (self%low <= -huge(self%low)) return
    if (self%high < huge(self%high) .and. self%with_low) then
      text = 'between '//to_text(self%low)//' and '//to_text(self%high)
    else if (self%high < huge(self%high)) then
      text = 'above '//to_text(self%low)//' and at most '//to_text(self%high)
    else if (self%whole) then
      text = to_text(self%low)//' or more'
    else if (self%with_low) then
      text = 'not negative'
      if (self%zero /= '') text = text//'; '//trim(self%zero)
    else
      text = 'positive'
    end if
  end function allowed_words

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

end module allowed_values_m
