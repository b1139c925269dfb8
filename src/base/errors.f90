!> Exit codes, the list of problems found in the user's input, and the one way to stop.
!!
!! Lower procedures return an integer `info` and never stop; what is wrong with the input is
!! collected in a `problems_t` and reported at once; what else cannot go on ends in `fatal`.
module errors_m
  use, intrinsic :: iso_fortran_env, only: error_unit
  use kinds_m, only: wp
  use parallel_m, only: is_root, parallel_abort, parallel_pause
  use value_text_m, only: sanitise
  implicit none
  private
  public :: problems_t, fatal, to_text, brief
  public :: exit_ok, exit_input, exit_numerics, exit_files

  integer, parameter :: exit_ok = 0        !! the run reached its end
  integer, parameter :: exit_input = 2     !! usage or input; nothing was written
  integer, parameter :: exit_numerics = 3  !! NaN, divergence not reached, a body left the tank
  integer, parameter :: exit_files = 4     !! disk full, no permission, damaged restart

  type :: message_t
    character(:), allocatable :: text
  end type message_t

  !> Problems found in the input, in the order of finding.
  type :: problems_t
    integer :: n = 0   !! number of problems
    type(message_t), allocatable, private :: list(:)
  contains
    procedure :: add => add_value
    procedure :: add_message
    procedure :: message => problems_message
    procedure :: report => problems_report
  end type problems_t

  !> Shortest text that a value can be read back from; commas between several, empty for none.
  interface to_text
    procedure :: integer_text, real_text, logical_text, integers_text, reals_text
  end interface to_text

contains

  !> Note what value `what` has and what would be allowed.
  subroutine add_value(self, what, value, allowed, line)
    class(problems_t), intent(inout) :: self
    character(*), intent(in) :: what       !! group and variable, like '&run dt'
    class(*), intent(in) :: value          !! integer, real, logical or text
    character(*), intent(in) :: allowed    !! what is wrong and what is allowed
    integer, intent(in), optional :: line  !! line of the case file
    character(:), allocatable :: text

    select type (value)
    type is (integer); text = to_text(value)
    type is (real(wp)); text = to_text(value)
    type is (logical); text = to_text(value)
    type is (character(*)); text = "'"//trim(value)//"'"
    class default; error stop 'add_value: no such kind of value'
    end select
    call self%add_message(what//' = '//text//': '//allowed, line)
  end subroutine add_value

  !> Note a problem in free words.
  subroutine add_message(self, text, line)
    class(problems_t), intent(inout) :: self
    character(*), intent(in) :: text
    integer, intent(in), optional :: line
    type(message_t), allocatable :: longer(:)

    if (.not. allocated(self%list)) allocate (self%list(8))
    if (self%n == size(self%list)) then
      allocate (longer(2*self%n))
      longer(:self%n) = self%list
      call move_alloc(longer, self%list)
    end if
    self%n = self%n + 1
    self%list(self%n)%text = text
    if (present(line)) self%list(self%n)%text = text//' (line '//to_text(line)//')'
  end subroutine add_message

  !> Text of problem number i, 1 <= i <= n.
  pure function problems_message(self, i) result(text)
    class(problems_t), intent(in) :: self
    integer, intent(in) :: i
    character(:), allocatable :: text

    text = self%list(i)%text
  end function problems_message

  !> Write all problems to `unit`, one on a line; only the root process writes.
  subroutine problems_report(self, unit, before)
    class(problems_t), intent(in) :: self
    integer, intent(in) :: unit
    character(*), intent(in), optional :: before   !! each of them, else the program's name
    character(:), allocatable :: start
    integer :: i

    if (.not. is_root()) return
    start = 'mics: '
    if (present(before)) start = before
    do i = 1, self%n
      write (unit, '(a)') start//sanitise(self%list(i)%text)
    end do
    flush (unit)
  end subroutine problems_report

  !> A number rounded to some digits, for reading.
  pure function brief(x, digits) result(text)
    real(wp), intent(in) :: x
    integer, intent(in), optional :: digits   !! 1 to 9, else 4
    character(:), allocatable :: text
    character(20) :: buffer, form
    real(wp) :: rounded
    integer :: n

    n = 4
    if (present(digits)) n = digits
    write (form, '(a, i0, a)') '(es20.', n - 1, 'e3)'
    write (buffer, form) x
    read (buffer, *) rounded
    text = to_text(rounded)
  end function brief

  !> Say why on standard error and end every process with the exit code `code`.
  !!
  !! All processes may call this with the same message, then the root process prints it; a process
  !! that fails alone waits for the root first and prints the message itself.
  subroutine fatal(code, message)
    integer, intent(in) :: code
    character(*), intent(in) :: message
    real(wp), parameter :: timeout = 1.0_wp   !! time for the root to end the others [s]
    character(len(message)) :: text
    integer :: i

    if (.not. is_root()) call parallel_pause(timeout)
    ! A message without control characters, apart from the ends of its lines.
    text = sanitise(message)
    do i = 1, len(message)
      if (message(i:i) == new_line('a')) text(i:i) = new_line('a')
    end do
    if (len(message) > 0) write (error_unit, '(a)') 'mics: '//text
    flush (error_unit)
    call parallel_abort(code)
  end subroutine fatal

  !> An integer without blanks.
  pure function integer_text(value) result(text)
    integer, intent(in) :: value
    character(:), allocatable :: text
    character(16) :: buffer

    write (buffer, '(i0)') value
    text = trim(buffer)
  end function integer_text

  !> A logical the way a namelist writes it.
  pure function logical_text(value) result(text)
    logical, intent(in) :: value
    character(:), allocatable :: text

    if (value) then
      text = '.true.'
    else
      text = '.false.'
    end if
  end function logical_text

  !> Real numbers between commas.
  pure function reals_text(x) result(text)
    real(wp), intent(in) :: x(:)
    character(:), allocatable :: text
    integer :: j

    text = ''
    do j = 1, size(x)
      if (j > 1) text = text//', '
      text = text//to_text(x(j))
    end do
  end function reals_text

  !> Whole numbers between commas.
  pure function integers_text(n) result(text)
    integer, intent(in) :: n(:)
    character(:), allocatable :: text
    integer :: j

    text = ''
    do j = 1, size(n)
      if (j > 1) text = text//', '
      text = text//to_text(n(j))
    end do
  end function integers_text

  !> A real with as few digits as give the same number back: 0.01, -1, 1.5e-7.
  pure function real_text(value) result(text)
    real(wp), intent(in) :: value
    character(:), allocatable :: text
    character(40) :: buffer, form
    real(wp) :: again
    integer :: digits, power, info

    if (.not. abs(value) <= huge(value)) then
      write (buffer, '(g0)') value
      text = trim(adjustl(buffer))
      return
    end if
    do digits = merge(17, 1, abs(value) > 0.1_wp*huge(value)), 17   ! rounding up may overflow
      write (form, '(a, i0, a)') '(es40.', digits - 1, 'e3)'
      write (buffer, form) value
      read (buffer, *, iostat=info) again
      if (info == 0 .and. .not. abs(again - value) > 0.0_wp) exit
    end do
    read (buffer(37:40), '(i4)') power
    text = plain_digits(trim(adjustl(buffer(:35))), power)
  end function real_text

  !> Text of the number whose first digits are `leading` ('-1.25', '1.') times 10**power.
  pure function plain_digits(leading, power) result(text)
    character(*), intent(in) :: leading
    integer, intent(in) :: power
    character(:), allocatable :: text, sign_text, digits
    integer :: dot

    sign_text = ''
    digits = leading
    if (digits(1:1) == '-') then
      sign_text = '-'
      digits = digits(2:)
    end if
    dot = index(digits, '.')
    digits = digits(:dot - 1)//digits(dot + 1:)
    if (power < -4 .or. power > 6) then
      text = digits(1:1)
      if (len(digits) > 1) text = text//'.'//digits(2:)
      text = sign_text//text//'e'//to_text(power)
    else if (power < 0) then
      text = sign_text//'0.'//repeat('0', -power - 1)//digits
    else if (len(digits) <= power + 1) then
      text = sign_text//digits//repeat('0', power + 1 - len(digits))
    else
      text = sign_text//digits(:power + 1)//'.'//digits(power + 2:)
    end if
  end function plain_digits

end module errors_m
