!> One description of a namelist group for three ends: reading its values, writing them out, and
!! telling the user what the group is made of.
!!
!! A `visit_...` procedure names each variable of a group once, what it may be and what it means:
!!
!!     call v%real('dt', run%dt, positive('s'), 'largest time step', example='0.005')
!!
!! A reading visitor fills the variable from the text if the user gave it and notes what is wrong
!! with it; a writing visitor appends `dt = 0.01` to its text; a describing visitor lists what it
!! was given, the value at hand as the default. The names asked for are the known names, so an
!! unknown variable and its nearest neighbour need no second list.
module group_visitor_m
  use kinds_m, only: wp, name_length
  use errors_m, only: problems_t, to_text
  use string_builder_m, only: string_builder_t
  use allowed_values_m, only: allowed_t
  use description_m, only: variable_t, group_description_t, described, choices, &
    word_text, words_text, next_word
  use case_types_m, only: is_given
  use namelist_text_m, only: group_text_t
  use value_text_m, only: parse_real, parse_integer, parse_logical, nearest_name, &
    edit_distance, quoted_text, printable, sanitise, value_ok, value_not_finite, value_too_large, &
    value_not_whole, value_malformed, looks_like_name
  implicit none
  private
  public :: group_visitor_t

  integer, parameter :: max_variables = 64   !! of one group
  integer, parameter :: slip_of_pen = 2       !! letters by which a misspelt name may differ

  type :: group_visitor_t
    logical :: reading = .false., writing = .false., describing = .false.   !! one of them
    type(string_builder_t) :: written           !! what a writing visitor has written
    type(group_description_t) :: description      !! what a describing visitor collects
    type(problems_t) :: problems           !! what a reading visitor has found
    type(problems_t) :: passed_over        !! and what it passes over, for warnings
    type(group_text_t) :: group            !! the group being read
    integer, private :: n_known = 0
    character(name_length), private :: known(max_variables) = ''
    character(:), allocatable, private :: left_out   !! not written: they have no meaning
    character(:), allocatable, private :: unsure   !! required and missing, or misspelt, it seems
  contains
    procedure :: start_reading, start_writing, start_describing, about, finish
    procedure :: given, good, needed, require, without_meaning, report, pass_over
    procedure :: name, names, option, text => text_value, logical => logical_value
    generic :: real => real_value, real_values
    generic :: integer => integer_value, integer_values
    procedure, private :: real_value, real_values, integer_value, integer_values
    procedure, private :: numbers, lookup, fault, count_is, read_number, read_text, put_variable
  end type group_visitor_t

contains

  !> Begin to read a group; a group the user did not write has an empty one in its place.
  subroutine start_reading(self, group)
    class(group_visitor_t), intent(inout) :: self
    type(group_text_t), intent(in) :: group

    self%reading = .true.
    self%group = group
    self%n_known = 0
    self%unsure = ' '
  end subroutine start_reading

  !> Begin to write a group.
  subroutine start_writing(self, group)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: group

    self%writing = .true.
    self%unsure = ' '
    self%left_out = ' '
    call self%written%add_line('&'//group)
  end subroutine start_writing

  !> Begin to describe a group.
  subroutine start_describing(self, group)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: group

    self%describing = .true.
    self%unsure = ' '
    self%description = group_description_t(name=group)
    allocate (self%description%variable(max_variables))
  end subroutine start_describing

  !> What the group is about, in a line.
  subroutine about(self, meaning)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: meaning

    if (self%describing) self%description%meaning = meaning
  end subroutine about

  !> End a group: report the variables nobody asked for, or close the group written.
  subroutine finish(self)
    class(group_visitor_t), intent(inout) :: self
    character(:), allocatable :: nearest
    integer :: i

    if (self%writing) call self%written%add_line('/')
    if (.not. self%reading) return
    do i = 1, self%group%n
      associate (name => self%group%assignment(i)%name)
        if (any(self%known(:self%n_known) == name)) cycle
        nearest = nearest_name(name, self%known(:self%n_known))
        call self%fault(i, 'unknown variable, nearest known: '//nearest)
        if (edit_distance(name, nearest) <= slip_of_pen) self%unsure = self%unsure//nearest//' '
      end associate
    end do
  end subroutine finish

  !> Did the user write this variable?
  pure function given(self, variable) result(yes)
    class(group_visitor_t), intent(in) :: self
    character(*), intent(in) :: variable
    logical :: yes

    yes = .false.
    if (self%reading) yes = self%group%find(variable) > 0
  end function given

  !> Is nothing wrong with these variables so far? A default is good, unless the variable is
  !! required, or an unknown name looks like it (that is known after `finish`).
  pure function good(self, variables) result(yes)
    class(group_visitor_t), intent(in) :: self
    character(*), intent(in) :: variables   !! one blank between them
    logical :: yes
    integer :: first, last, i

    yes = .true.
    last = -1
    do while (last < len(variables))
      call next_word(variables, first, last)
      i = self%group%find(variables(first:last))
      if (i > 0) yes = yes .and. .not. self%group%assignment(i)%faulty
      if (index(self%unsure, ' '//variables(first:last)//' ') > 0) yes = .false.
    end do
  end function good

  !> Report a required variable that is missing.
  subroutine needed(self, variable, meaning)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    character(*), intent(in) :: meaning   !! what it stands for, with its unit

    if (.not. self%reading .or. self%group%faulty) return
    if (self%group%find(variable) > 0) return
    self%unsure = self%unsure//variable//' '
    if (self%group%line > 0) then
      call self%report(' '//variable//': missing, required: '//meaning)
    else
      call self%report(' '//variable//': missing, required: '//meaning &
                     //' (there is no group &'//self%group%name//')')
    end if
  end subroutine needed

  !> Report what is wrong with a variable unless `ok`; only the first problem of each is reported.
  subroutine require(self, variable, ok, allowed)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    logical, intent(in) :: ok
    character(*), intent(in) :: allowed   !! what is wrong and what is allowed
    integer :: i

    if (ok .or. .not. self%reading) return
    i = self%group%find(variable)
    if (i > 0) then
      call self%fault(i, allowed)
    else
      call self%report(' '//variable//' (by default): '//allowed)
    end if
  end subroutine require

  !> Variables that have no meaning if `idle`, because of what was chosen: each that is given is a
  !! problem, and none is written. To be called before they are read.
  subroutine without_meaning(self, idle, variables, chosen, remedy)
    class(group_visitor_t), intent(inout) :: self
    logical, intent(in) :: idle
    character(*), intent(in) :: variables   !! one blank between them
    character(*), intent(in) :: chosen      !! as in `law = 'constants'`
    character(*), intent(in) :: remedy      !! what is allowed
    integer :: first, last, i

    if (.not. idle) return
    if (self%writing) self%left_out = self%left_out//variables//' '
    if (.not. self%reading) return
    last = -1
    do while (last < len(variables))
      call next_word(variables, first, last)
      i = self%group%find(variables(first:last))
      if (i > 0) call self%fault(i, 'has no meaning with '//chosen//'; '//remedy)
    end do
  end subroutine without_meaning

  !> Variables that have no meaning because of the physics that was chosen: those given are passed
  !! over with a warning, see `idle_variables_m`.
  subroutine pass_over(self, variables, chosen)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variables   !! one blank between them
    character(*), intent(in) :: chosen      !! as in `physics = 'dry'`
    character(:), allocatable :: names
    integer :: first, last, i, line, n

    names = ''
    n = 0
    last = -1
    do while (last < len(variables))
      call next_word(variables, first, last)
      i = self%group%find(variables(first:last))
      if (i > 0) then
        if (n == 0) line = self%group%assignment(i)%line
        if (n > 0) names = names//', '
        names = names//variables(first:last)
        n = n + 1
      end if
    end do
    if (n > 0) call self%passed_over%add_message('&'//self%group%name//' '//names//': ' &
      //trim(merge('has ', 'have', n == 1))//' no meaning with '//chosen//', passed over', line)
  end subroutine pass_over

  !> Report a problem of the group; `what` goes on right after its name.
  subroutine report(self, what)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: what

    if (.not. self%reading) return
    if (self%group%line > 0) then
      call self%problems%add_message('&'//self%group%name//what, self%group%line)
    else
      call self%problems%add_message('&'//self%group%name//what)
    end if
  end subroutine report

  !> A real number.
  subroutine real_value(self, variable, x, allowed, meaning, example, required)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    real(wp), intent(inout) :: x
    type(allowed_t), intent(in) :: allowed
    character(*), intent(in) :: meaning, example
    logical, intent(in), optional :: required
    real(wp) :: values(1)

    values = x
    call self%real_values(variable, values, allowed, meaning, example, required)
    x = values(1)
  end subroutine real_value

  !> As many real numbers as `x` has elements, or from `allowed%fewest` on; those not given stay.
  subroutine real_values(self, variable, x, allowed, meaning, example, required)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    real(wp), intent(inout) :: x(:)
    type(allowed_t), intent(in) :: allowed
    character(*), intent(in) :: meaning, example
    logical, intent(in), optional :: required
    type(variable_t) :: entry

    entry = described(variable, 'number', to_text(pack(x, is_given(x))), meaning, example, required)
    entry%allowed = allowed
    call self%numbers(entry, .false., x)
  end subroutine real_values

  !> A whole number.
  subroutine integer_value(self, variable, n, allowed, meaning, example, required)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    integer, intent(inout) :: n
    type(allowed_t), intent(in) :: allowed
    character(*), intent(in) :: meaning, example
    logical, intent(in), optional :: required
    integer :: values(1)

    values = n
    call self%integer_values(variable, values, allowed, meaning, example, required)
    n = values(1)
  end subroutine integer_value

  !> As many whole numbers as `n` has elements.
  subroutine integer_values(self, variable, n, allowed, meaning, example, required)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    integer, intent(inout) :: n(:)
    type(allowed_t), intent(in) :: allowed
    character(*), intent(in) :: meaning, example
    logical, intent(in), optional :: required
    type(variable_t) :: entry
    real(wp) :: values(size(n))

    entry = described(variable, 'number', to_text(n), meaning, example, required)
    entry%allowed = allowed
    values = n
    call self%numbers(entry, .true., values)
    n = nint(values)
  end subroutine integer_values

  !> Numbers of either kind.
  subroutine numbers(self, entry, whole, x)
    class(group_visitor_t), intent(inout) :: self
    type(variable_t), intent(inout) :: entry
    logical, intent(in) :: whole
    real(wp), intent(inout) :: x(:)
    character(:), allocatable :: meaning, problem
    real(wp) :: values(size(x))
    integer :: i, j, fewest

    if (.not. self%reading) then
      entry%most = size(x)
      call self%put_variable(entry)
      return
    end if
    meaning = entry%meaning
    if (.not. whole) meaning = meaning//' ['//entry%allowed%unit//']'
    i = self%lookup(entry%name, meaning, entry%required)
    if (i == 0) return
    fewest = merge(entry%allowed%fewest, size(x), entry%allowed%fewest > 0)
    if (.not. self%count_is(i, fewest, size(x))) return
    values = x
    do j = 1, self%group%assignment(i)%n
      call self%read_number(i, j, whole, values(j))
    end do
    if (.not. self%good(entry%name)) return
    problem = entry%allowed%problem(pack(values, is_given(values)))
    if (len(problem) > 0) then
      call self%fault(i, problem)
    else
      x = values
    end if
  end subroutine numbers

  !> A logical; its example is what it is not by default.
  subroutine logical_value(self, variable, flag, meaning)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    logical, intent(inout) :: flag
    character(*), intent(in) :: meaning
    integer :: i, info

    if (.not. self%reading) then
      call self%put_variable(described(variable, 'logical', to_text(flag), meaning, &
                                       to_text(.not. flag)))
      return
    end if
    i = self%lookup(variable, meaning)
    if (i == 0) return
    if (.not. self%count_is(i, 1, 1)) return
    associate (value => self%group%assignment(i)%value(1))
      call parse_logical(value%text, flag, info)
      if (value%quoted) info = value_not_whole
    end associate
    if (info /= value_ok) call self%fault(i, 'must be .true. or .false.')
  end subroutine logical_value

  !> Text of any length.
  subroutine text_value(self, variable, text, meaning, example)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    character(:), allocatable, intent(inout) :: text
    character(*), intent(in) :: meaning, example
    integer :: i
    logical :: ok

    if (.not. self%reading) then
      call self%put_variable(described(variable, 'text', quoted_text(text), meaning, example))
      return
    end if
    i = self%lookup(variable, meaning)
    if (i == 0) return
    if (.not. self%count_is(i, 1, 1)) return
    call self%read_text(i, 1, ok)
    if (.not. ok) return
    text = self%group%assignment(i)%value(1)%text
    if (sanitise(text) /= text) call self%fault(i, 'must hold no control characters')
  end subroutine text_value

  !> The name of something the user made up: letters, digits and `_ - .`, at most `name_length`.
  subroutine name(self, variable, word, meaning, example, required)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    character(name_length), intent(inout) :: word
    character(*), intent(in) :: meaning, example
    logical, intent(in), optional :: required
    character(name_length) :: words(1)

    words = word
    call self%names(variable, words, meaning, example, required)
    word = words(1)
  end subroutine name

  !> One to as many names as `words` has elements; those not given stay.
  subroutine names(self, variable, words, meaning, example, required)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    character(name_length), intent(inout) :: words(:)
    character(*), intent(in) :: meaning, example
    logical, intent(in), optional :: required
    character(*), parameter :: allowed = &
      'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.'
    type(variable_t) :: entry
    integer :: i, j
    logical :: ok

    if (.not. self%reading) then
      entry = described(variable, 'name', words_text(words), meaning, example, required)
      entry%most = size(words)
      call self%put_variable(entry)
      return
    end if
    i = self%lookup(variable, meaning, required)
    if (i == 0) return
    if (.not. self%count_is(i, 1, size(words))) return
    do j = 1, self%group%assignment(i)%n
      call self%read_text(i, j, ok)
      if (.not. ok) return
      associate (text => self%group%assignment(i)%value(j)%text)
        if (len(text) == 0 .or. len(text) > name_length .or. verify(text, allowed) > 0 &
            .or. scan(text//'.', '.') == 1) then
          call self%fault(i, 'a name has 1 to '//to_text(name_length) &
                          //' letters, digits or _ - . and does not begin with a point')
          return
        end if
        words(j) = text
      end associate
    end do
  end subroutine names

  !> One of the words in `allowed`; those this version cannot do are refused as such.
  subroutine option(self, variable, word, allowed, meaning, example, required)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    character(name_length), intent(inout) :: word
    character(*), intent(in) :: allowed   !! the words, one blank between them
    character(*), intent(in) :: meaning, example
    logical, intent(in), optional :: required
    type(variable_t) :: entry
    integer :: i
    logical :: ok

    if (.not. self%reading) then
      entry = described(variable, 'choice', word_text(word), meaning, example, required)
      entry%choices = allowed
      call self%put_variable(entry)
      return
    end if
    i = self%lookup(variable, meaning, required)
    if (i == 0) return
    if (.not. self%count_is(i, 1, 1)) return
    call self%read_text(i, 1, ok)
    if (.not. ok) return
    associate (text => self%group%assignment(i)%value(1)%text)
      if (index(' '//allowed//' ', ' '//text//' ') == 0 .or. scan(text//' ', ' ') <= len(text) &
          .or. len(text) == 0) then
        call self%fault(i, 'unknown, must be one of '//choices(allowed))
      else
        word = text
      end if
    end associate
  end subroutine option

  !> Write a variable that has a value, or add it to the description.
  subroutine put_variable(self, variable)
    class(group_visitor_t), intent(inout) :: self
    type(variable_t), intent(in) :: variable

    if (self%writing) then
      if (len(variable%value) == 0 .or. index(self%left_out, ' '//variable%name//' ') > 0) return
      call self%written%add_line('  '//variable%name//' = '//variable%value)
    else
      self%description%n = self%description%n + 1
      self%description%variable(self%description%n) = variable
    end if
  end subroutine put_variable

  !> Number of the assignment to a variable, 0 if the user gave none (a problem if it is required)
  !! or it is damaged.
  function lookup(self, variable, meaning, required) result(i)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    character(*), intent(in) :: meaning   !! with the unit
    logical, intent(in), optional :: required
    integer :: i

    self%n_known = self%n_known + 1
    self%known(self%n_known) = variable
    if (present(required)) then
      if (required) call self%needed(variable, meaning)
    end if
    i = self%group%find(variable)
    if (i == 0) return
    if (self%group%assignment(i)%faulty) i = 0
  end function lookup

  !> Note what is wrong with assignment i; only the first problem of each is reported.
  subroutine fault(self, i, what)
    class(group_visitor_t), intent(inout) :: self
    integer, intent(in) :: i
    character(*), intent(in) :: what

    associate (a => self%group%assignment(i))
      if (.not. a%faulty) then
        call self%problems%add_message('&'//self%group%name//' '//a%name//' = '//a%shown()//': ' &
                                       //what, a%line)
      end if
      a%faulty = .true.
    end associate
  end subroutine fault

  !> Has assignment i the right number of values?
  function count_is(self, i, least, most) result(yes)
    class(group_visitor_t), intent(inout) :: self
    integer, intent(in) :: i, least, most
    logical :: yes
    character(:), allocatable :: what
    integer :: j

    associate (a => self%group%assignment(i))
      yes = a%n >= least .and. a%n <= most
      if (yes) return
      what = to_text(least)
      if (most > least) what = what//' to '//to_text(most)
      what = ' given, '//what//' needed'
      what = to_text(a%n)//trim(merge(' value ', ' values', a%n == 1))//what
      do j = 2, a%n
        if (a%value(j)%quoted .or. .not. looks_like_name(a%value(j)%text)) cycle
        what = what//'; is an ''='' missing after '//printable(a%value(j)%text)//'?'
        exit
      end do
    end associate
    call self%fault(i, what)
  end function count_is

  !> Value j of assignment i as a number.
  subroutine read_number(self, i, j, whole, x)
    class(group_visitor_t), intent(inout) :: self
    integer, intent(in) :: i, j
    logical, intent(in) :: whole
    real(wp), intent(inout) :: x
    character(:), allocatable :: what, must
    integer :: n, info

    associate (a => self%group%assignment(i))
      must = 'must be '
      if (a%n > 1) must = 'value '//to_text(j)//' must be '
      if (whole) then
        call parse_integer(a%value(j)%text, n, info)
        if (info == value_ok) x = n
        if (a%value(j)%quoted) info = value_not_whole
        what = 'a whole number'
        if (info == value_too_large) what = 'at most '//to_text(huge(n))//' in size'
      else
        call parse_real(a%value(j)%text, x, info)
        what = 'a number'
        if (info == value_too_large) what = '0 or between 1e-20 and 1e20 in size'
        if (info == value_not_finite) what = 'a finite number'
        if (a%value(j)%quoted) info = value_malformed
        if (a%value(j)%quoted) what = 'a number, without quotes'
      end if
    end associate
    if (info /= value_ok) call self%fault(i, must//what)
  end subroutine read_number

  !> Is value j of assignment i a quoted text?
  subroutine read_text(self, i, j, ok)
    class(group_visitor_t), intent(inout) :: self
    integer, intent(in) :: i, j
    logical, intent(out) :: ok

    associate (a => self%group%assignment(i))
      ok = a%value(j)%quoted
      if (.not. ok) then
        call self%fault(i, 'text needs quotes, '//quoted_text(printable(a%value(j)%text)))
      end if
    end associate
  end subroutine read_text

end module group_visitor_m
