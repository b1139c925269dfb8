!> What asks a run to end before its time: a signal, a file `stop` in the folder of the results, or
!! the wall time it was given (`--max-wall`). It ends in good order, with a restart file.
module stop_requests_m
  use kinds_m, only: wp
  use parallel_m, only: is_root, global_max
  use signals_m, only: signal_caught, signal_terminate
  use timers_m, only: wall_clock
  use folder_lock_m, only: folder_lock_t, stop_name
  implicit none
  private
  public :: stop_requests_t, stop_asked

  real(wp), parameter :: look_interval = 0.5_wp   !! wall time between two looks at the folder [s]
  real(wp), parameter :: steps_ahead = 3.0_wp     !! slowest steps that still have to fit in
  real(wp), parameter :: closing = 10.0_wp        !! wall time kept for the last files at most [s]
  real(wp), parameter :: closing_share = 0.05_wp  !! of the time given, if that is less

  type :: stop_requests_t
    character(:), allocatable :: reason      !! why the run ends, on the root process
    real(wp) :: max_wall = 0.0_wp            !! time given [s], 0: no end
    real(wp) :: began = 0.0_wp               !! when the time given began
    real(wp) :: last = 0.0_wp                !! when the last step ended
    real(wp) :: slowest = 0.0_wp             !! longest step so far [s]
    real(wp) :: next_look = 0.0_wp
  end type stop_requests_t

contains

  !> After a step: the signal that ends the run, 0 for none. A file or the time count as SIGTERM.
  !! All processes call and get the same answer.
  function stop_asked(folder, self) result(number)
    type(folder_lock_t), intent(inout) :: folder   !! of the results, on the root process
    type(stop_requests_t), intent(inout) :: self
    integer :: number
    real(wp) :: of_any(1), now, kept

    of_any = real(signal_caught, wp)
    if (is_root() .and. .not. of_any(1) > 0.0_wp) then
      now = wall_clock()
      self%slowest = max(self%slowest, now - self%last)
      self%last = now
      if (self%max_wall > 0.0_wp) then
        kept = steps_ahead*self%slowest + min(closing, closing_share*self%max_wall)
        if (now - self%began + kept >= self%max_wall) self%reason = 'stopped as --max-wall asks'
      end if
      if (now >= self%next_look) then
        self%next_look = now + look_interval
        if (folder%has(stop_name)) then   ! it has served and goes
          call folder%remove(stop_name)
          self%reason = "stopped by the file '"//folder%folder//'/'//stop_name//"', now removed"
        end if
      end if
      if (len(self%reason) > 0) of_any = real(signal_terminate, wp)
    end if
    call global_max(of_any)
    number = nint(of_any(1))
    if (number > 0 .and. len(self%reason) == 0) self%reason = 'stopped by a signal'
  end function stop_asked

end module stop_requests_m
