!> Time, step and what is due when: rows, frames, restart files, releases, the end.
!!
!! Output never changes the steps. A row or frame is written after the first step that reaches its
!! due time, the multiples of its interval; a step is shortened only to land on a release or on the
!! end.
module clock_m
  use kinds_m, only: wp
  use moments_m, only: has_come
  use case_types_m, only: run_t
  implicit none
  private
  public :: clock_t, clock_init

  !> What is due at the multiples of an interval.
  type :: schedule_t
    real(wp) :: interval = 0.0_wp   !! [s]
    real(wp) :: next = 0.0_wp       !! due time, huge: never [s]
    integer :: n = 0                !! how often it was done when due
  contains
    procedure :: due, done, plan
  end type schedule_t

  type :: clock_t
    real(wp) :: t = 0.0_wp          !! [s]
    real(wp) :: dt = 0.0_wp         !! of the last step, then of the present one [s]
    integer :: step = 0
    type(schedule_t) :: rows, frames, restarts
    real(wp) :: rest_began = -1.0_wp   !! when all blocks came to rest [s]; < 0: they move
    real(wp) :: t_next = 0.0_wp     !! where the present step ends [s]
    type(run_t) :: run              !! intervals, end, the rule for settling
  contains
    procedure :: choose_step, finished, settled
  end type clock_t

contains

  !> The clock at the start of a run: the first row and frame are due.
  subroutine clock_init(run, clock)
    type(run_t), intent(in) :: run
    type(clock_t), intent(out) :: clock

    clock%run = run
    clock%rows%interval = run%history_interval
    clock%frames%interval = run%field_interval
    clock%frames%next = merge(0.0_wp, huge(clock%t), run%field_interval > 0.0_wp)
    clock%restarts%interval = run%restart_interval
    clock%restarts%next = merge(run%restart_interval, huge(clock%t), run%restart_interval > 0.0_wp)
  end subroutine clock_init

  !> Is it due at a time?
  pure function due(self, t) result(yes)
    class(schedule_t), intent(in) :: self
    real(wp), intent(in) :: t   !! [s]
    logical :: yes

    yes = has_come(self%next, t)
  end function due

  !> What was due has been done.
  pure subroutine done(self, t)
    class(schedule_t), intent(inout) :: self
    real(wp), intent(in) :: t   !! [s]

    self%n = self%n + 1
    call self%plan(t)
  end subroutine done

  !> What was due at a time or before has been done, as in a run that goes on.
  pure subroutine plan(self, t)
    class(schedule_t), intent(inout) :: self
    real(wp), intent(in) :: t   !! [s]

    if (self%next < huge(t)) self%next = next_multiple(self%interval, t)
  end subroutine plan

  !> First multiple of an interval that lies after t; t itself if they lie closer than times can be
  !! told apart, so that each step is due.
  pure function next_multiple(interval, t) result(next)
    real(wp), intent(in) :: interval, t   !! [s]
    real(wp) :: next
    real(wp) :: n   ! a whole number, perhaps beyond integers

    next = t
    if (has_come(t + interval, t)) return
    n = aint(t/interval)
    do while (has_come(n*interval, t))
      n = n + 1.0_wp
    end do
    next = n*interval
  end function next_multiple

  !> Choose dt and where the step ends: the longest dt allowed, or less to land on the next release
  !! or on the end. The last two steps before a landing share the way, so that none is tiny.
  pure subroutine choose_step(self, dt_allowed, next_release)
    class(clock_t), intent(inout) :: self
    real(wp), intent(in) :: dt_allowed     !! by stability and `&run dt` [s]
    real(wp), intent(in) :: next_release   !! time of the next one after t; huge if none [s]
    real(wp) :: landing, way

    landing = self%run%t_end
    if (.not. has_come(next_release, self%t)) landing = min(landing, next_release)
    way = landing - self%t
    if (way <= dt_allowed*(1.0_wp + 1.0e-9_wp) .or. has_come(landing, self%t)) then
      self%dt = way
      self%t_next = landing
    else
      self%dt = dt_allowed
      if (way < 2*dt_allowed*(1.0_wp - 1.0e-9_wp)) self%dt = 0.5_wp*way
      self%t_next = self%t + self%dt
    end if
  end subroutine choose_step

  !> Has the run reached its end, or settled?
  pure function finished(self) result(yes)
    class(clock_t), intent(in) :: self
    logical :: yes

    yes = has_come(self%run%t_end, self%t) .or. self%settled()
  end function finished

  !> Have all blocks been at rest for `rest_time`, with none to come, in a run that ends then?
  pure function settled(self) result(yes)
    class(clock_t), intent(in) :: self
    logical :: yes

    yes = self%run%stop_when_settled .and. self%rest_began >= 0.0_wp &
      .and. has_come(self%rest_began + self%run%rest_time, self%t)
  end function settled

end module clock_m
