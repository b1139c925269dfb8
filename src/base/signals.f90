!> Signals that ask a run to end set a flag; the time loop looks at it and ends in good order.
!!
!! They come from the keyboard (SIGINT), from a queue (SIGTERM, SIGUSR1, SIGXCPU), from a terminal
!! that closes (SIGHUP) or from a reader of the table that has gone (SIGPIPE).
!! SIGXFSZ, a file beyond the user's limit, is left to the write that then fails: it is an error of
!! files like a full disk.
module signals_m
  use, intrinsic :: iso_c_binding, only: c_int, c_funptr, c_funloc
  use c_library_m, only: c_signal
  use system_m, only: signal_user
  implicit none
  private
  public :: catch_signals, signal_terminate

  ! The numbers that Linux, macOS and the BSDs give them; they differ in SIGUSR1 alone.
  integer, parameter :: signal_hang_up = 1      !! SIGHUP
  integer, parameter :: signal_interrupt = 2    !! SIGINT
  integer, parameter :: signal_pipe = 13        !! SIGPIPE
  integer, parameter :: signal_terminate = 15   !! SIGTERM
  integer, parameter :: signal_cpu_time = 24    !! SIGXCPU
  integer, parameter :: signal_file_size = 25   !! SIGXFSZ
  integer, parameter :: caught_here(*) = [signal_hang_up, signal_interrupt, signal_user, &
    signal_pipe, signal_terminate, signal_cpu_time, signal_file_size]

  integer(c_int), public, protected, volatile :: signal_caught = 0   !! by this process; 0: none

contains

  !> From now on the signals end nothing by themselves. Call it after `parallel_init`.
  subroutine catch_signals()
    type(c_funptr) :: previous
    integer :: i

    do i = 1, size(caught_here)
      previous = c_signal(int(caught_here(i), c_int), c_funloc(remember))
    end do
  end subroutine catch_signals

  !> The handler.
  subroutine remember(number) bind(c)
    integer(c_int), value :: number

    if (number /= signal_file_size) signal_caught = number
  end subroutine remember

end module signals_m
