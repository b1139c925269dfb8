!> Numbers, logicals and names as text: checked and read from a case file, compared, shown.
!!
!! Nothing here uses a Fortran formatted read on unchecked text: the form of a value is checked
!! character by character first, so a bad value never raises a floating-point exception.
module value_text_m
  use kinds_m, only: wp, i8, name_length
  implicit none
  private
  public :: parse_real, parse_integer, parse_logical
  public :: quoted_text, printable, sanitise, fixed_text
  public :: lower_case, nearest_name, edit_distance, words_of
  public :: byte_order_mark
  public :: value_ok, value_malformed, value_not_finite, value_too_large, value_not_whole

  !> What a parser found.
  integer, parameter :: value_ok = 0, value_malformed = 1, value_not_finite = 2
  integer, parameter :: value_too_large = 3, value_not_whole = 4

  !> Largest size of a real value, and one over its smallest: products of a few such values
  !! (a volume, an inertia) stay inside the range of real64.
  integer, parameter :: largest_exponent = 20

  integer, parameter :: longest_shown = 60   !! characters of a value in a message

  character(*), parameter :: byte_order_mark = char(239)//char(187)//char(191)   !! of UTF-8

contains

  !> Read a real number: digits, at most one point, exponent with `e` or `d`.
  pure subroutine parse_real(text, x, info)
    character(*), intent(in) :: text
    real(wp), intent(inout) :: x      !! changed only when `info` is `value_ok`
    integer, intent(out) :: info
    character(len(text)) :: word
    integer :: mantissa_end, exponent, first, point, power, status, i

    word = lower_case(text)
    info = value_malformed
    associate (unsigned => word(first_digit(word):))
      if (any(unsigned == [character(8) :: 'nan', 'inf', 'infinity']) &
          .or. index(unsigned, 'nan(') == 1) info = value_not_finite
    end associate
    if (info == value_not_finite) return
    mantissa_end = scan(word, 'ed') - 1
    if (mantissa_end < 0) mantissa_end = len(word)
    if (.not. is_decimal(word(:mantissa_end))) return
    exponent = 0
    if (mantissa_end < len(word)) then
      if (.not. is_whole(word(mantissa_end + 2:))) return
      do i = mantissa_end + 2, len(word)   ! cut off at a million: enough to call it too large
        if (scan(word(i:i), '+-') == 0) exponent = min(1000000, 10*exponent + iachar(word(i:i)) &
          - iachar('0'))
      end do
      if (word(mantissa_end + 2:mantissa_end + 2) == '-') exponent = -exponent
      word(mantissa_end + 1:mantissa_end + 1) = 'e'
    end if
    first = scan(word(:mantissa_end), '123456789')
    if (first == 0) then      ! zero, whatever the exponent
      word = word(:mantissa_end)
    else
      point = index(word(:mantissa_end), '.')
      if (point == 0) point = mantissa_end + 1
      power = point - first   ! of ten, of the first digit that is not zero
      if (power > 0) power = power - 1
      if (abs(power + exponent) > largest_exponent) then
        info = value_too_large
        return
      end if
    end if
    read (word, *, iostat=status) x
    if (status == 0) info = value_ok
  end subroutine parse_real

  !> Read a whole number in the range of the default integer.
  pure subroutine parse_integer(text, n, info)
    character(*), intent(in) :: text
    integer, intent(inout) :: n       !! changed only when `info` is `value_ok`
    integer, intent(out) :: info
    integer(i8) :: total
    integer :: i, digit
    real(wp) :: x

    info = value_malformed
    if (.not. is_whole(text)) then
      call parse_real(text, x, i)
      if (i /= value_malformed) info = value_not_whole
      return
    end if
    info = value_too_large
    total = 0_i8
    do i = first_digit(text), len(text)
      digit = iachar(text(i:i)) - iachar('0')
      total = 10_i8*total + int(digit, i8)
      if (total > int(huge(n), i8)) return
    end do
    if (text(1:1) == '-') total = -total
    n = int(total)
    info = value_ok
  end subroutine parse_integer

  !> Read a logical: .true. .false. .t. .f. true false t f, in any case of letters.
  pure subroutine parse_logical(text, flag, info)
    character(*), intent(in) :: text
    logical, intent(inout) :: flag    !! changed only when `info` is `value_ok`
    integer, intent(out) :: info

    info = value_ok
    select case (lower_case(text))
    case ('.true.', '.t.', 'true', 't'); flag = .true.
    case ('.false.', '.f.', 'false', 'f'); flag = .false.
    case default; info = value_malformed
    end select
  end subroutine parse_logical

  !> Text between quotes, the quotes inside it doubled.
  pure function quoted_text(raw) result(text)
    character(*), intent(in) :: raw
    character(:), allocatable :: text
    integer :: i, n

    allocate (character(2*len(raw) + 2) :: text)
    text(1:1) = "'"
    n = 1
    do i = 1, len(raw)
      n = n + 1
      text(n:n) = raw(i:i)
      if (raw(i:i) == "'") then
        n = n + 1
        text(n:n) = "'"
      end if
    end do
    text = text(:n)//"'"
  end function quoted_text

  !> A number with a fixed number of decimals and a digit before the point: 0.20000.
  pure function fixed_text(x, decimals) result(text)
    real(wp), intent(in) :: x
    integer, intent(in) :: decimals   !! at least 1
    character(:), allocatable :: text
    character(400) :: buffer          ! room for the largest number
    character(20) :: form

    write (form, '(a, i0, a)') '(f400.', decimals, ')'
    write (buffer, form) x
    text = trim(adjustl(buffer))
  end function fixed_text

  !> A value as it may stand in a message: no control characters, not too long.
  pure function printable(raw) result(text)
    character(*), intent(in) :: raw
    character(:), allocatable :: text
    integer :: n

    n = len(raw)
    if (n > longest_shown) then
      n = longest_shown - 3
      do while (n > 1)               ! never cut a UTF-8 character in two
        if (iand(ichar(raw(n + 1:n + 1)), 192) /= 128) exit
        n = n - 1
      end do
    end if
    text = sanitise(raw(:n))
    if (n < len(raw)) text = text//'...'
  end function printable

  !> A text as a terminal may see it: each control character, those that UTF-8 writes with two bytes
  !! and older terminals know as one too, is a question mark, but for tabs. A terminal would obey
  !! them: change colours, its title.
  pure function sanitise(raw) result(text)
    character(*), intent(in) :: raw
    character(len(raw)) :: text
    integer :: i, byte, following   ! bytes that belong to the UTF-8 character begun

    text = raw
    following = 0
    do i = 1, len(raw)
      byte = ichar(raw(i:i))
      if ((byte < 32 .and. byte /= 9) .or. byte == 127) text(i:i) = '?'
      if (byte < 128 .or. byte > 191) then
        following = count(byte >= [194, 224, 240] .and. byte < 245)
        cycle
      end if
      if (byte <= 159 .and. following == 0) text(i:i) = '?'
      if (byte <= 159 .and. i > 1) then
        if (ichar(raw(max(1, i - 1):max(1, i - 1))) == 194) text(i - 1:i) = '??'
      end if
      following = max(0, following - 1)
    end do
  end function sanitise

  !> Small letters for A to Z; every other byte stays.
  pure function lower_case(text) result(small)
    character(*), intent(in) :: text
    character(len(text)) :: small
    integer :: i

    small = text
    do i = 1, len(text)
      if (text(i:i) >= 'A' .and. text(i:i) <= 'Z') small(i:i) = achar(iachar(text(i:i)) + 32)
    end do
  end function lower_case

  !> The entry of `known` that is nearest to `name` by edit distance, the first among equals.
  pure function nearest_name(name, known) result(nearest)
    character(*), intent(in) :: name
    character(*), intent(in) :: known(:)
    character(:), allocatable :: nearest
    integer :: i, distance, best

    nearest = ''
    best = huge(best)
    do i = 1, size(known)
      distance = edit_distance(lower_case(name), lower_case(trim(known(i))))
      if (distance >= best) cycle
      best = distance
      nearest = trim(known(i))
    end do
  end function nearest_name

  !> Least number of letters to insert, delete, replace or swap (neighbours) that turns a into b.
  pure function edit_distance(a, b) result(distance)
    character(*), intent(in) :: a, b
    integer :: distance
    integer :: before(0:len(b)), last(0:len(b)), row(0:len(b))
    integer :: i, j, cost

    last = [(j, j=0, len(b))]
    before = last
    do i = 1, len(a)
      row(0) = i
      do j = 1, len(b)
        cost = merge(0, 1, a(i:i) == b(j:j))
        row(j) = min(last(j) + 1, row(j - 1) + 1, last(j - 1) + cost)
      end do
      do j = 2, merge(len(b), 0, i > 1)
        if (a(i:i) == b(j - 1:j - 1) .and. a(i - 1:i - 1) == b(j:j)) then
          row(j) = min(row(j), before(j - 2) + 1)
        end if
      end do
      before = last
      last = row
    end do
    distance = last(len(b))
  end function edit_distance

  !> Place behind a sign.
  pure integer function first_digit(word)
    character(*), intent(in) :: word

    first_digit = merge(2, 1, scan(word, '+-') == 1)
  end function first_digit

  !> Optional sign, digits with at most one point, at least one digit?
  pure function is_decimal(word) result(yes)
    character(*), intent(in) :: word
    logical :: yes
    integer :: i, points

    associate (digits => word(first_digit(word):))
      points = count([(digits(i:i) == '.', i=1, len(digits))])
      yes = verify(digits, '0123456789.') == 0 .and. points <= 1 .and. len(digits) > points
    end associate
  end function is_decimal

  !> Optional sign and at least one digit, nothing else?
  pure function is_whole(word) result(yes)
    character(*), intent(in) :: word
    logical :: yes

    yes = is_decimal(word) .and. index(word, '.') == 0
  end function is_whole

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

end module value_text_m
