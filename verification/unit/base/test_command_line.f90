!> The command that goes on. Other options: `verification/*.py`.
module test_command_line_m
  use check_m, only: check
  use command_line_m, only: options_t, restart_command
  implicit none
  private
  public :: test_command_line

contains

  subroutine test_command_line()
    type(options_t) :: options

    options%case_file = ''
    call check('how to go on with a case from standard input', &
      restart_command('./mics_mpi', 4, options, "my run/a's.h5") == 'mpirun -n 4 ./mics_mpi ' &
      //"--restart 'my run/a'\''s.h5' < CASE   (CASE: the case file, which came on standard input)")
  end subroutine test_command_line

end module test_command_line_m
