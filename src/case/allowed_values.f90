!> Which values a number may have, and its unit: said once, for the check, the help and the schema.
module allowed_values_m
  use kinds_m, only: wp
  use errors_m, only: to_text
  implicit none
  private
  public :: allowed_t, any_number, positive, not_negative, share, whole, between

  real(wp), parameter :: boundless = huge(1.0_wp)

  type :: allowed_t
    real(wp) :: low = -boundless, high = boundless
    logical :: with_low = .true.             !! may the value be `low` itself?
    logical :: whole = .false.
    character(16) :: unit = ''               !! '-' for a pure number, empty for a count
    character(48) :: zero = ''               !! what 0 means if that is special, else empty
    integer :: fewest = 0                    !! values of a list that may be short; 0: all
  contains
    procedure :: problem => allowed_problem
    procedure :: words => allowed_words
    procedure :: bounded_below, bounded_above
  end type allowed_t

  type(allowed_t), parameter :: whole = allowed_t(whole=.true.)   !! any whole number

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

  !> Above 0, at most 1.
  pure function share() result(allowed)
    type(allowed_t) :: allowed

    allowed = allowed_t(unit='-', low=0.0_wp, with_low=.false., high=1.0_wp)
  end function share

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
    else if (self%bounded_above() .and. self%with_low) then
      text = 'must lie '//self%words()
      if (self%unit /= '-') text = trim(text//' '//self%unit)
    else if (self%bounded_above() .or. self%whole) then
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
    if (.not. self%bounded_below()) return
    if (self%bounded_above() .and. self%with_low) then
      text = 'between '//to_text(self%low)//' and '//to_text(self%high)
    else if (self%bounded_above()) then
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

  pure function bounded_below(self) result(yes)
    class(allowed_t), intent(in) :: self
    logical :: yes

    yes = self%low > -boundless
  end function bounded_below

  pure function bounded_above(self) result(yes)
    class(allowed_t), intent(in) :: self
    logical :: yes

    yes = self%high < boundless
  end function bounded_above

end module allowed_values_m
