!> Timers count calls and seconds; a signal sets the flag and the program goes on.
program test_timers_signals
  use, intrinsic :: iso_c_binding, only: c_int
  use kinds_m, only: wp
  use check_m, only: check, finish_checks
  use parallel_m, only: parallel_init, parallel_final, parallel_pause
  use signals_m, only: catch_signals, signal_caught, signal_interrupt, signal_terminate
  use timers_m, only: timer, tic, toc, wall_clock
  use timers_m, only: timer_count, timer_name, timer_seconds, timer_calls
  implicit none

  interface
    integer(c_int) function c_raise(number) bind(c, name='raise')
      import :: c_int
      implicit none
      integer(c_int), value :: number
    end function c_raise
  end interface

  call parallel_init()
  call test_timers()
  call test_signals()
  call finish_checks()
  call parallel_final()

contains

  subroutine test_timers()
    integer :: outer, inner, i
    real(wp) :: began

    began = wall_clock()
    outer = timer('outer')
    inner = timer('inner')
    call check('same name, same timer', timer('outer'), outer)
    call check('two timers', timer_count(), 2)
    call tic(outer)
    do i = 1, 3
      call tic(inner)
      call parallel_pause(0.01_wp)
      call toc(inner)
    end do
    call toc(outer)
    call check('calls', timer_calls(inner), 3)
    call check('name', timer_name(inner) == 'inner')
    call check('at least the time slept', timer_seconds(inner) >= 0.03_wp)
    call check('the outer holds the inner', timer_seconds(outer) >= timer_seconds(inner))
    call check('not more than passed', timer_seconds(outer) <= wall_clock() - began)
  end subroutine test_timers

  subroutine test_signals()
    integer :: info

    call catch_signals()
    call check('none yet', signal_caught(), 0)
    info = c_raise(int(signal_interrupt, c_int))
    call check('raised', info, 0)
    call check('interrupt', signal_caught(), 2)
    info = c_raise(int(signal_terminate, c_int))
    call check('terminate', signal_caught(), 15)
  end subroutine test_signals

end program test_timers_signals
