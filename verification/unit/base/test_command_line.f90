!> Times of day as options, and the command that goes on. Other options: `verification/*.py`.
module test_command_line_m
  use check_m, only: check
  use command_line_m, only: options_t, argument_t, parse_arguments, restart_command
  use errors_m, only: problems_t
  implicit none
  private
  public :: test_command_line

  type(options_t) :: options

contains

  subroutine test_command_line()
    call parse([argument_t('--max-wall'), argument_t('12:30')])
    call check('hours and minutes', nint(options%max_wall), 45000)
    call parse([argument_t('--max-wall=0:00:07')])
    call check('seconds, too', nint(options%max_wall), 7)
    call parse([argument_t ::])
    call check('how to go on with a case from standard input', &
      restart_command('./mics_mpi', 4, options, "my run/a's.h5") == 'mpirun -n 4 ./mics_mpi ' &
      //"--restart 'my run/a'\''s.h5' < CASE   (CASE: the case file, which came on standard input)")
  end subroutine test_command_line

  subroutine parse(words)
    type(argument_t), intent(in) :: words(:)
    type(problems_t) :: problems

    call parse_arguments(words, options, problems)
  end subroutine parse

end module test_command_line_m
