!> Wall time spent in each phase of the run.
!!
!! A phase is named once, `pressure = timer('pressure')`, then timed with `call tic(pressure)` and
!! `call toc(pressure)`. Phases may nest; the time of the inner one counts in both.
module timers_m
  use kinds_m, only: wp, i8, name_length
  implicit none
  private
  public :: timer, tic, toc, wall_clock

  integer, parameter :: max_timers = 64

  type :: phase_t
    character(name_length) :: name = ''
    real(wp) :: seconds = 0.0_wp   !! total of the finished calls [s]
    real(wp) :: began = 0.0_wp     !! clock at the last tic [s]
    integer :: calls = 0
  end type phase_t

  type(phase_t), public, protected :: phase(max_timers)   !! `n_phases` of them
  integer, public, protected :: n_phases = 0

contains

  !> Number of the phase of this name, new or already known.
  function timer(name) result(id)
    character(*), intent(in) :: name
    integer :: id

    do id = 1, n_phases
      if (phase(id)%name == name) return
    end do
    if (n_phases == max_timers) error stop 'timer: more phases than max_timers'
    n_phases = n_phases + 1
    phase(n_phases)%name = name
    id = n_phases
  end function timer

  !> The phase begins.
  subroutine tic(id)
    integer, intent(in) :: id

    phase(id)%began = wall_clock()
  end subroutine tic

  !> The phase ends.
  subroutine toc(id)
    integer, intent(in) :: id

    phase(id)%seconds = phase(id)%seconds + (wall_clock() - phase(id)%began)
    phase(id)%calls = phase(id)%calls + 1
  end subroutine toc

  !> Seconds since some fixed moment.
  function wall_clock() result(seconds)
    real(wp) :: seconds   !! [s]
    integer(i8) :: ticks, rate

    call system_clock(ticks, rate)
    seconds = real(ticks, wp)/real(rate, wp)
  end function wall_clock

end module timers_m
