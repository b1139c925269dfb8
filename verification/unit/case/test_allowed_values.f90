!> Ranges of numbers: what lies inside, and one wording for the message and the help.
module test_allowed_values_m
  use check_m, only: check
  use kinds_m, only: wp
  use allowed_values_m, only: allowed_t, any_number, positive, not_negative, share, any_whole, &
    at_least, between
  use string_builder_m, only: string_builder_t
  implicit none
  private
  public :: test_allowed_values

contains

  subroutine test_allowed_values()
    call bounds('any number', any_number('m'), -1.0e20_wp, 1.0e20_wp, '')
    call bounds('positive', positive('s'), 1.0e-20_wp, 1.0e20_wp, 'positive')
    call bounds('not negative', not_negative('s', zero='0 means never'), 0.0_wp, 1.0e20_wp, &
      'not negative; 0 means never')
    call bounds('share', share(), 1.0e-20_wp, 1.0_wp, 'above 0 and at most 1')
    call bounds('between', between(0.5_wp, 2.0_wp, 'm'), 0.5_wp, 2.0_wp, 'between 0.5 and 2')
    call bounds('any whole', any_whole(), -5.0_wp, 5.0_wp, '')
    call bounds('at least', at_least(1), 1.0_wp, 1.0e9_wp, '1 or more')
    call bounds('whole', between(1, 8), 1.0_wp, 8.0_wp, 'between 1 and 8')

    call wrong(positive('s'), [0.0_wp], 'must be positive [s]')
    call wrong(not_negative('m'), [1.0_wp, -1.0_wp], 'must not be negative [m]')
    call wrong(not_negative('s', zero='0 means never'), [-1.0_wp], &
      'must not be negative [s]; 0 means never')
    call wrong(share(), [0.0_wp], 'must be above 0 and at most 1')
    call wrong(share(), [1.1_wp], 'must be above 0 and at most 1')
    call wrong(between(0.5_wp, 2.0_wp, 'm'), [0.4_wp], 'must lie between 0.5 and 2 m')
    call wrong(between(0.5_wp, 2.0_wp, 'm'), [1.0_wp, 2.1_wp], 'must lie between 0.5 and 2 m')
    call wrong(between(0.5_wp, 2.0_wp, 'm'), [0.0_wp], 'must be positive [m]')
    call wrong(between(0.0_wp, 180.0_wp, 'degrees'), [-1.0_wp], &
      'must lie between 0 and 180 degrees')
    call wrong(between(1, 8), [0.0_wp], 'must lie between 1 and 8')
    call wrong(at_least(1), [1.0_wp, 0.0_wp], 'must be 1 or more in each direction')
    call test_long_text()
  end subroutine test_allowed_values

  !> The first and last good values, and the words for what is allowed.
  subroutine bounds(name, allowed, low, high, words)
    character(*), intent(in) :: name, words
    type(allowed_t), intent(in) :: allowed
    real(wp), intent(in) :: low, high

    call check(name//': good values', allowed%problem([low, high]) == '')
    call check(name//': words', allowed%words() == words)
    call check(name//': bounded', allowed%bounded_below() .eqv. words /= '')
  end subroutine bounds

  !> Some of the values are bad; the message.
  subroutine wrong(allowed, x, message)
    type(allowed_t), intent(in) :: allowed
    real(wp), intent(in) :: x(:)
    character(*), intent(in) :: message

    call check(message, allowed%problem(x) == message)
  end subroutine wrong

  !> Pieces of any length add up.
  subroutine test_long_text()
    type(string_builder_t) :: long
    integer :: i

    call check('nothing yet', long%text() == '' .and. len(long%text()) == 0)
    do i = 1, 1000
      call long%add('abc ')
    end do
    call long%add_line(repeat('x', 5000))
    call check('length', len(long%text()), 9001)
    call check('content', long%text() == repeat('abc ', 1000)//repeat('x', 5000)//new_line('a'))
  end subroutine test_long_text

end module test_allowed_values_m
