!> Timers count calls and seconds.
module test_timers_m
  use check_m, only: check, wp
  use parallel_m, only: parallel_pause
  use timers_m, only: name_phase, tic, toc, wall_clock, phase, n_phases
  implicit none
  private
  public :: test_timers

contains

  subroutine test_timers()
    integer :: outer, inner, i, others   ! timers of other tests in this program
    real(wp) :: began

    began = wall_clock()
    others = n_phases
    call name_phase('outer', outer)
    call name_phase('inner', inner)
    call name_phase('outer', i)
    call check('same name, same phase', i, outer)
    call check('two phases', n_phases - others, 2)
    call tic('outer')
    do i = 1, 3
      call tic('inner')
      call parallel_pause(0.01_wp)
      call toc('inner')
    end do
    call toc('outer')
    call check('calls', phase(inner)%calls, 3)
    call check('name', phase(inner)%name == 'inner')
    call check('at least the time slept', phase(inner)%seconds >= 0.03_wp)
    call check('the outer holds the inner', phase(outer)%seconds >= phase(inner)%seconds)
    call check('not more than passed', phase(outer)%seconds <= wall_clock() - began)
  end subroutine test_timers

end module test_timers_m
