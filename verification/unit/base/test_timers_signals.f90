!> Timers count calls and seconds; a signal sets the flag and the program goes on.
module test_timers_signals_m
  use, intrinsic :: iso_c_binding, only: c_int
  use kinds_m, only: wp
  use check_m, only: check
  use parallel_m, only: parallel_pause
  use signals_m, only: catch_signals, signal_caught, signal_interrupt, signal_terminate
  use timers_m, only: timer, tic, toc, wall_clock, phases
  implicit none
  private
  public :: test_timers_signals

  interface
    integer(c_int) function c_raise(number) bind(c, name='raise')
      import :: c_int
      implicit none
      integer(c_int), value :: number
    end function c_raise

    integer(c_int) function c_getpid() bind(c, name='getpid')
      import :: c_int
      implicit none
    end function c_getpid
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
    others = size(phases())
    outer = timer('outer')
    inner = timer('inner')
    call check('same name, same timer', timer('outer'), outer)
    call check('two timers', size(phases()) - others, 2)
    call tic(outer)
    do i = 1, 3
      call tic(inner)
      call parallel_pause(0.01_wp)
      call toc(inner)
    end do
    call toc(outer)
    associate (phase => phases())
      call check('calls', phase(inner)%calls, 3)
      call check('name', phase(inner)%name == 'inner')
      call check('at least the time slept', phase(inner)%seconds >= 0.03_wp)
      call check('the outer holds the inner', phase(outer)%seconds >= phase(inner)%seconds)
      call check('not more than passed', phase(outer)%seconds <= wall_clock() - began)
    end associate
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
    call check_names()
  end subroutine test_signals

  !> What a shell calls by its name arrives with the number that the system gives it: no signal that
  !! should end a run in good order kills it.
  subroutine check_names()
    character(*), parameter :: names(6) = [character(4) :: 'HUP', 'INT', 'USR1', 'PIPE', 'TERM', &
      'XCPU']
    character(12) :: number
    integer :: i, status

    write (number, '(i0)') c_getpid()
    do i = 1, size(names)
      call send(trim(names(i)), trim(number))
      call execute_command_line('test "$(kill -l '//text_of(128 + signal_caught())//')" = ' &
        //trim(names(i)), exitstat=status)
      call check('caught '//names(i), status, 0)
    end do
    status = signal_caught()
    call send('XFSZ', trim(number))
    call check('a file too large asks for no end', signal_caught(), status)
  end subroutine check_names

  !> Have a shell send a signal while this program does not wait for a shell, which would make it
  !! deaf to SIGINT.
  subroutine send(name, process)
    character(*), intent(in) :: name, process

    call execute_command_line('(sleep 0.2; kill -s '//name//' '//process//') &')
    call parallel_pause(0.6_wp)
  end subroutine send

  !> An integer in words.
  function text_of(n) result(text)
    integer, intent(in) :: n
    character(:), allocatable :: text
    character(12) :: buffer

    write (buffer, '(i0)') n
    text = trim(buffer)
  end function text_of

end module test_timers_signals_m
