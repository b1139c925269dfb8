!> Timers count calls and seconds; a signal sets the flag and the program goes on.
module test_timers_signals_m
  use, intrinsic :: iso_c_binding, only: c_int
  use check_m, only: check, wp
  use parallel_m, only: parallel_pause
  use signals_m, only: catch_signals, signal_caught, signal_interrupt, signal_terminate
  use timers_m, only: timer, tic, toc, wall_clock, phase, n_phases
  implicit none
  private
  public :: test_timers_signals

  interface
    integer(c_int) function c_raise(number) bind(c, name='raise')
      import :: c_int
      implicit none
      integer(c_int), value :: number
    end function c_raise
  end interface

contains

  subroutine test_timers_signals()
    call test_timers()
    call test_signals()
  end subroutine test_timers_signals

  subroutine test_timers()
    integer :: outer, inner, i, others   ! timers of other tests in this program
    real(wp) :: began

    began = wall_clock()
    others = n_phases
    outer = timer('outer')
    inner = timer('inner')
    call check('same name, same timer', timer('outer'), outer)
    call check('two timers', n_phases - others, 2)
    call tic(outer)
    do i = 1, 3
      call tic(inner)
      call parallel_pause(0.01_wp)
      call toc(inner)
    end do
    call toc(outer)
    call check('calls', phase(inner)%calls, 3)
    call check('name', phase(inner)%name == 'inner')
    call check('at least the time slept', phase(inner)%seconds >= 0.03_wp)
    call check('the outer holds the inner', phase(outer)%seconds >= phase(inner)%seconds)
    call check('not more than passed', phase(outer)%seconds <= wall_clock() - began)
  end subroutine test_timers

  subroutine test_signals()
    integer :: info

    call catch_signals()
    call check('none yet', signal_caught, 0)
    info = c_raise(int(signal_interrupt, c_int))
    call check('raised', info, 0)
    call check('interrupt', signal_caught, 2)
    info = c_raise(int(signal_terminate, c_int))
    call check('terminate', signal_caught, 15)
  end subroutine test_signals

end module test_timers_signals_m
