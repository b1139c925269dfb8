!> Reads one namelist group. A `visit_...` procedure names each variable of a group once, what it
!! may be and what it means:
!!
!!     call v%real('dt', run%dt, positive('s'), 'largest time step', example='0.005')
!!
!! fills the variable if the user gave it, notes what is wrong with it, and appends an entry. The
!! entries of a group in which the user gives nothing are what help, schema and the text of all
!! parameters are made of; their names are the known names, so an unknown variable and its nearest
!! neighbour need no second list.
module group_visitor_m
  use kinds_m, only: wp, name_length
  use errors_m, only: problems_t, to_text
  use allowed_values_m, only: allowed_t, entry_t, choices
  use case_types_m, only: is_given
  use namelist_text_m, only: group_text_t
  use value_text_m, only: parse_real, parse_integer, parse_logical, nearest_name, &
    edit_distance, quoted_text, printable, sanitise, value_ok, value_not_finite, value_too_large, &
    value_not_whole, value_malformed, lower_case, words_of
  implicit none
  private
  public :: group_visitor_t

  integer, parameter :: max_variables = 64   !! of one group
  integer, parameter :: slip_of_pen = 2       !! letters by which a misspelt name may differ

  type :: group_visitor_t
    type(problems_t) :: problems           !! found in all groups
    type(problems_t) :: passed_over        !! variables without meaning, for warnings
    type(group_text_t) :: group            !! the group being read
    character(:), allocatable :: meaning   !! of the group
    character(:), allocatable :: ways      !! sets of variables of which it needs one, '|' between
    integer :: n = 0                       !! entries
    type(entry_t) :: entry(max_variables)
    character(:), allocatable, private :: left_out   !! names without meaning
    character(:), allocatable, private :: unsure   !! required and missing, or misspelt, it seems
  contains
    procedure :: start, start_empty, about, finish, judge
    procedure :: given, good, needed, require, without_meaning, report, pass_over
    procedure :: name, names, option, text => text_value, logical => logical_value
    procedure :: integer => integer_value
    generic :: real => real_value, real_values
    procedure, private :: real_value, real_values
    procedure, private :: enter, lookup, fault, read_number, read_text
  end type group_visitor_t

contains

  !> Begin to read a group.
  subroutine start(self, group)
    class(group_visitor_t), intent(inout) :: self
    type(group_text_t), intent(in) :: group

    self%group = group
    self%n = 0
    self%unsure = ' '
    self%left_out = ' '
  end subroutine start

  !> Begin a group that the user did not write.
  subroutine start_empty(self, name)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: name
    type(group_text_t) :: nothing

    nothing%name = trim(name)
    allocate (nothing%assignment(0))
    call self%start(nothing)
  end subroutine start_empty

  !> What the group is about, in a line; and, if it can be given in several ways, those.
  subroutine about(self, meaning, ways)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: meaning
    character(*), intent(in), optional :: ways   !! as in `shape position|file`

    self%meaning = meaning
    self%ways = ''
    if (present(ways)) self%ways = ways
  end subroutine about

  !> End a group: report the variables nobody asked for.
  subroutine finish(self)
    class(group_visitor_t), intent(inout) :: self
    character(:), allocatable :: nearest
    integer :: i

    do i = 1, size(self%group%assignment)
      associate (name => self%group%assignment(i)%name)
        if (any(self%entry(:self%n)%name == name)) cycle
        nearest = nearest_name(name, self%entry(:self%n)%name)
        call self%fault(i, 'unknown variable, nearest known: '//nearest)
        if (edit_distance(name, nearest) <= slip_of_pen) self%unsure = self%unsure//nearest//' '
      end associate
    end do
  end subroutine finish

  !> The last statement on a group whose geometry is checked later: can some of its variables not be
  !! relied on?
  subroutine judge(self, variables, faulty)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variables   !! one blank between them
    logical, intent(out) :: faulty

    call self%finish()   ! a name that is not known may be meant for one of them
    faulty = self%group%faulty .or. .not. self%good(variables)
  end subroutine judge

  !> Did the user write this variable?
  pure function given(self, variable) result(yes)
    class(group_visitor_t), intent(in) :: self
    character(*), intent(in) :: variable
    logical :: yes

    yes = self%group%find(variable) > 0
  end function given

  !> Is nothing wrong with these variables so far? A default is good, unless the variable is
  !! required, or an unknown name looks like it (that is known after `finish`).
  pure function good(self, variables) result(yes)
    class(group_visitor_t), intent(in) :: self
    character(*), intent(in) :: variables   !! one blank between them
    logical :: yes
    integer :: w, i

    yes = .true.
    associate (words => words_of(variables))
      do w = 1, size(words)
        i = self%group%find(words(w))
        if (i > 0) yes = yes .and. .not. self%group%assignment(i)%faulty
        if (index(self%unsure, ' '//trim(words(w))//' ') > 0) yes = .false.
      end do
    end associate
  end function good

  !> Report a required variable that is missing.
  subroutine needed(self, variable, meaning)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    character(*), intent(in) :: meaning   !! what it stands for, with its unit
    character(:), allocatable :: where

    if (self%group%faulty .or. self%given(variable)) return
    self%unsure = self%unsure//trim(variable)//' '
    where = ''
    if (self%group%line == 0) where = ' (there is no group &'//self%group%name//')'
    call self%report(' '//trim(variable)//': missing, required: '//meaning//where)
  end subroutine needed

  !> Report what is wrong with a variable unless `ok`; only the first problem of each is reported.
  subroutine require(self, variable, ok, allowed)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    logical, intent(in) :: ok
    character(*), intent(in) :: allowed   !! what is wrong and what is allowed
    integer :: i

    if (ok) return
    i = self%group%find(variable)
    if (i > 0) then
      call self%fault(i, allowed)
    else
      call self%report(' '//variable//' (by default): '//allowed)
    end if
  end subroutine require

  !> Variables that have no meaning if `idle`, because of the kind or the form of what the group
  !! describes: each that is given is a problem, and its entry is idle. To be called before they are
  !! read.
  subroutine without_meaning(self, idle, variables, chosen, remedy)
    class(group_visitor_t), intent(inout) :: self
    logical, intent(in) :: idle
    character(*), intent(in) :: variables   !! one blank between them
    character(*), intent(in) :: chosen      !! as in `law = 'constants'`
    character(*), intent(in) :: remedy      !! what is allowed
    integer :: w, i

    if (.not. idle) return
    self%left_out = self%left_out//variables//' '
    associate (words => words_of(variables))
      do w = 1, size(words)
        i = self%group%find(words(w))
        if (i > 0) call self%fault(i, 'has no meaning with '//chosen//'; '//remedy)
      end do
    end associate
  end subroutine without_meaning

  !> Variables that a switch leaves idle: those given are passed over with a warning, so that one
  !! word switches. To be called before they are read, but for the physics (`find_idle`).
  subroutine pass_over(self, variables, chosen)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variables   !! one blank between them
    character(*), intent(in) :: chosen      !! as in `physics = 'dry'`
    character(:), allocatable :: names
    integer :: w, i, line, n

    self%left_out = self%left_out//variables//' '
    names = ''
    n = 0
    associate (words => words_of(variables))
      do w = 1, size(words)
        i = self%group%find(words(w))
        if (i == 0) cycle
        if (n == 0) line = self%group%assignment(i)%line
        if (n > 0) names = names//', '
        names = names//trim(words(w))
        n = n + 1
      end do
    end associate
    if (n > 0) call self%passed_over%add_message('&'//self%group%name//' '//names//': ' &
      //trim(merge('has ', 'have', n == 1))//' no meaning with '//chosen//', passed over', line)
  end subroutine pass_over

  !> Report a problem of the group; `what` goes on right after its name.
  subroutine report(self, what)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: what

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

  !> A whole number.
  subroutine integer_value(self, variable, n, allowed, meaning, example, required)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    integer, intent(inout) :: n
    type(allowed_t), intent(in) :: allowed
    character(*), intent(in) :: meaning, example
    logical, intent(in), optional :: required
    real(wp) :: values(1)

    values = n
    call self%real_values(variable, values, allowed, meaning, example, required)
    n = nint(values(1))
  end subroutine integer_value

  !> As many numbers as `x` has elements, or from `allowed%fewest` on; those not given stay.
  subroutine real_values(self, variable, x, allowed, meaning, example, required)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    real(wp), intent(inout) :: x(:)
    type(allowed_t), intent(in) :: allowed
    character(*), intent(in) :: meaning, example
    logical, intent(in), optional :: required
    character(:), allocatable :: problem
    real(wp) :: values(size(x))
    integer :: i, j

    call self%enter(variable, 'number', meaning, example, required)
    self%entry(self%n)%allowed = allowed
    self%entry(self%n)%most = size(x)
    i = self%lookup()
    if (i > 0) then
      values = x
      do j = 1, size(self%group%assignment(i)%value)
        call self%read_number(i, j, allowed%whole, values(j))
      end do
      problem = allowed%problem(pack(values, is_given(values)))
      if (len(problem) > 0) call self%fault(i, problem)
      if (self%good(variable) .and. .not. self%entry(self%n)%idle) x = values
    end if
    self%entry(self%n)%number = pack(x, is_given(x))
  end subroutine real_values

  !> A logical; its example is what it is not by default.
  subroutine logical_value(self, variable, flag, meaning)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    logical, intent(inout) :: flag
    character(*), intent(in) :: meaning
    integer :: i, info

    call self%enter(variable, 'logical', meaning, to_text(.not. flag))
    i = self%lookup()
    if (i > 0) then
      associate (value => self%group%assignment(i)%value(1))
        call parse_logical(value%text, flag, info)
        if (value%quoted .or. info /= value_ok) call self%fault(i, 'must be .true. or .false.')
      end associate
    end if
    self%entry(self%n)%text = to_text(flag)
  end subroutine logical_value

  !> Text of any length.
  subroutine text_value(self, variable, text, meaning, example)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    character(:), allocatable, intent(inout) :: text
    character(*), intent(in) :: meaning, example
    integer :: i

    if (.not. allocated(text)) text = ''
    call self%enter(variable, 'text', meaning, example)
    i = self%lookup()
    if (i > 0) call self%read_text(i, 1, text)
    if (i > 0 .and. sanitise(text) /= text) then
      call self%fault(i, 'must hold no control characters')
    end if
    self%entry(self%n)%text = quoted_text(text)
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
    character(:), allocatable :: word
    integer :: i, j, n

    call self%enter(variable, 'name', meaning, example, required)
    self%entry(self%n)%most = size(words)
    self%entry(self%n)%allowed%fewest = 1
    i = self%lookup()
    n = 0
    if (i > 0) n = size(self%group%assignment(i)%value)
    do j = 1, n
      word = ''
      call self%read_text(i, j, word)
      if (len(word) == 0 .or. len(word) > name_length .or. verify(word, allowed) > 0 &
          .or. scan(word//'.', '.') == 1) call self%fault(i, 'a name has 1 to ' &
        //to_text(name_length)//' letters, digits or _ - . and does not begin with a point')
      if (.not. self%good(variable)) exit
      words(j) = word
    end do
    self%entry(self%n)%text = choices(words)
  end subroutine names

  !> One of the words in `allowed`; those this version cannot do are refused as such.
  subroutine option(self, variable, word, allowed, meaning, example, required)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable
    character(name_length), intent(inout) :: word
    character(*), intent(in) :: allowed   !! the words, one blank between them
    character(*), intent(in) :: meaning, example
    logical, intent(in), optional :: required
    character(:), allocatable :: text
    integer :: i

    call self%enter(variable, 'choice', meaning, example, required)
    self%entry(self%n)%choices = allowed
    i = self%lookup()
    if (i > 0) then
      text = ''
      call self%read_text(i, 1, text)
      if (index(' '//allowed//' ', ' '//text//' ') == 0 .or. index(text, ' ') > 0 &
          .or. len(text) == 0) call self%fault(i, 'unknown, must be one of ' &
        //choices(words_of(allowed)))
      if (self%good(variable)) word = text
    end if
    self%entry(self%n)%text = choices([word])
  end subroutine option

  !> Append the entry of a variable that is about to be read.
  subroutine enter(self, variable, kind, meaning, example, required)
    class(group_visitor_t), intent(inout) :: self
    character(*), intent(in) :: variable, kind, meaning
    character(*), intent(in) :: example   !! its value, or assignments with this one as the last
    logical, intent(in), optional :: required

    self%n = self%n + 1
    self%entry(self%n) = entry_t(name=variable, kind=kind)
    associate (new => self%entry(self%n))
      new%meaning = meaning
      new%example = example
      if (index(example, ' = ') == 0) new%example = trim(variable)//' = '//example
      new%choices = ''
      new%idle = index(self%left_out, ' '//trim(variable)//' ') > 0
      if (present(required)) new%required = required
    end associate
  end subroutine enter

  !> Number of the assignment to the last variable entered; 0 if the user gave none (a problem if
  !! it is required), or it is damaged or has a wrong number of values.
  function lookup(self) result(i)
    class(group_visitor_t), intent(inout) :: self
    integer :: i
    character(:), allocatable :: what
    character(*), parameter :: small = 'abcdefghijklmnopqrstuvwxyz'
    integer :: j, fewest, info
    logical :: flag

    flag = .false.
    associate (entry => self%entry(self%n))
      if (entry%required) call self%needed(entry%name, entry%with_unit())
      i = self%group%find(entry%name)
      if (i == 0) return
      if (.not. self%good(entry%name)) i = 0
      if (i == 0) return
      fewest = merge(entry%allowed%fewest, entry%most, entry%allowed%fewest > 0)
      associate (a => self%group%assignment(i), n => size(self%group%assignment(i)%value))
        if (n >= fewest .and. n <= entry%most) return
        what = to_text(fewest)
        if (entry%most > fewest) what = what//' to '//to_text(entry%most)
        what = to_text(n)//trim(merge(' value ', ' values', n == 1))//' given, '//what &
          //' needed'
        do j = 2, n
          if (a%value(j)%quoted) cycle   ! else it may be a variable whose '=' was forgotten
          call parse_logical(a%value(j)%text, flag, info)
          if (info == value_ok .or. scan(lower_case(a%value(j)%text(1:1)), small) == 0) cycle
          what = what//'; is an ''='' missing after '//printable(a%value(j)%text)//'?'
          exit
        end do
      end associate
    end associate
    call self%fault(i, what)
    i = 0
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
      if (size(a%value) > 1) must = 'value '//to_text(j)//' must be '
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

  !> Value j of assignment i, which must be a quoted text.
  subroutine read_text(self, i, j, text)
    class(group_visitor_t), intent(inout) :: self
    integer, intent(in) :: i, j
    character(:), allocatable, intent(inout) :: text   !! stays where the value is none

    associate (value => self%group%assignment(i)%value(j))
      if (value%quoted) then
        text = value%text
      else
        call self%fault(i, 'text needs quotes, '//quoted_text(printable(value%text)))
      end if
    end associate
  end subroutine read_text

end module group_visitor_m
