!> Wall time spent in each phase of the run.
!!
!! A phase is timed from `call tic('blocks')` to `call toc('blocks')`; phases may nest, the time of
!! the inner one counts in both. One that is named before is listed even if it never begins.
module timers_m
  use kinds_m, only: wp, i8, name_length
  implicit none
  private
  public :: name_phase, tic, toc, wall_clock

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

  !> Number of the phase of this name, which is new or already known.
  subroutine name_phase(name, number)
    character(*), intent(in) :: name
    integer, intent(out), optional :: number
    integer :: id

    do id = 1, n_phases
      if (phase(id)%name == name) exit
    end do
    if (id > max_timers) error stop 'name_phase: more phases than max_timers'
    phase(id)%name = name
    n_phases = max(n_phases, id)
    if (present(number)) number = id
  end subroutine name_phase

  !> The phase begins.
  subroutine tic(name)
    character(*), intent(in) :: name
    integer :: id

    call name_phase(name, id)
    phase(id)%began = wall_clock()
  end subroutine tic

  !> The phase ends.
  subroutine toc(name)
    character(*), intent(in) :: name
    integer :: id

    call name_phase(name, id)
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
