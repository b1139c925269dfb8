!> Options: every form understood, every mistake named with the nearest option.
module test_command_line_m
  use check_m, only: check
  use command_line_m, only: options_t, argument_t, parse_arguments, restart_command
  use errors_m, only: problems_t
  implicit none
  private
  public :: test_command_line

  type(options_t) :: options
  type(problems_t) :: problems

contains

  subroutine test_command_line()
    call parse('')
    call check('nothing given', options%case_file == '' .and. options%output == '' &
      .and. options%restart == '' .and. options%threads == 0 .and. problems%n == 0)
    call check('all off', .not. any([options%check, options%quiet, options%version, options%help]))
    call parse('--check --quiet --version --help')
    call check('switches', all([options%check, options%quiet, options%version, options%help]) &
      .and. problems%n == 0)
    call parse('--help')
    call check('help', options%help .and. options%topic == '')
    call parse('--help contact')
    call check('help on a group', options%help .and. options%topic == 'contact' &
      .and. options%case_file == '' .and. problems%n == 0)
    call parse('--help=json')
    call check('help in another form', options%topic == 'json' .and. problems%n == 0)
    call parse('--help --check')
    call check('help takes no option', options%topic == '' .and. options%check)
    call parse('--restart a.h5 --output=out --threads 3 case.nml')
    call check('values', options%restart == 'a.h5' .and. options%output == 'out' &
      .and. options%threads == 3 .and. options%case_file == 'case.nml' .and. problems%n == 0)
    call parse('-')
    call check('standard input', options%case_file == '' .and. problems%n == 0)
    call parse('--max-wall 12:30')
    call check('hours and minutes', nint(options%max_wall), 45000)
    call parse('--max-wall=0:00:07')
    call check('seconds, too', nint(options%max_wall), 7)
    call parse('--output out --threads 3 --quiet --max-wall 1:05 input/a.nml')
    call check('how to go on', restart_command('./mics', 1, options, 'out/restart-a.h5') &
      == './mics --restart out/restart-a.h5 --threads 3 --max-wall 1:05 --quiet ' &
      //'input/a.nml')
    call parse('')
    call check('how to go on with a case from standard input', &
      restart_command('./mics_mpi', 4, options, "my run/a's.h5") == 'mpirun -n 4 ./mics_mpi ' &
      //"--restart 'my run/a'\''s.h5' < CASE   (CASE: the case file, which came on standard input)")
    call parse('--chek --threads x')
    call check('all problems at once', problems%n, 2)
  end subroutine test_command_line

  !> Parse the words of a line.
  subroutine parse(line)
    character(*), intent(in) :: line
    type(argument_t), allocatable :: arguments(:)
    type(problems_t) :: none
    integer :: first, last

    allocate (arguments(0))
    first = 1
    do while (first <= len(line))
      last = index(line(first:)//' ', ' ') + first - 2
      arguments = [arguments, argument_t(line(first:last))]
      first = last + 2
    end do
    problems = none
    call parse_arguments(arguments, options, problems)
  end subroutine parse

end module test_command_line_m
