!> The options of the program.
module command_line_m
  use kinds_m, only: wp
  use errors_m, only: problems_t, to_text
  use parallel_m, only: get_threads
  use value_text_m, only: nearest_name, parse_integer, sanitise, value_ok
  implicit none
  private
  public :: options_t, read_command_line, print_help, restart_command

  type :: options_t
    logical :: check = .false.       !! read, validate, print the plan, write nothing
    character(:), allocatable :: plan        !! file of the set-up that --check writes, empty: none
    logical :: quiet = .false.       !! no progress table
    logical :: version = .false.
    logical :: help = .false.
    character(:), allocatable :: topic       !! what help is wanted on, empty: the options
    integer :: threads = 0           !! 0: not given
    real(wp) :: max_wall = 0.0_wp    !! wall time given [s], 0: no end
    character(:), allocatable :: case_file   !! empty: standard input
    character(:), allocatable :: restart     !! restart file, empty: not given
    character(:), allocatable :: output      !! folder, empty: as the case says
  end type options_t

  integer, parameter :: max_threads = 1024
  character(*), parameter :: allowed_threads = 'must be a whole number from 1 to 1024'

  character(*), parameter :: known(9) = [character(10) :: '--check', '--plan', '--restart', &
    '--output', '--threads', '--max-wall', '--quiet', '--version', '--help']

contains

  !> Options given to this run; what is wrong with them goes into `problems`.
  subroutine read_command_line(options, problems)
    type(options_t), intent(out) :: options
    type(problems_t), intent(inout) :: problems
    character(:), allocatable :: word, value
    integer :: i, equals, length, threads
    logical :: has_value

    options%case_file = ''
    options%plan = ''
    options%restart = ''
    options%output = ''
    options%topic = ''
    do i = 1, command_argument_count()
      word = argument(i)
      if (sanitise(word) /= word) call problems%add_message('control characters in '//word)
    end do
    i = 0
    do while (i < command_argument_count())
      i = i + 1
      word = argument(i)
      if (index(word, '-') /= 1 .or. word == '-') then
        ! A word that is not an option: the case file.
        if (len(options%case_file) > 0) then
          call problems%add_message("two case files given, '"//options%case_file &
            //"' and '"//word//"'")
        else if (len(word) == 0) then
          call problems%add_message('the name of the case file is empty')
        else if (word /= '-') then
          options%case_file = word
        end if
        cycle
      end if
      equals = index(word, '=')
      has_value = equals > 0
      value = ''
      if (has_value) then
        value = word(equals + 1:)
        word = word(:equals - 1)
      else if (len(needs(word)) > 0 .or. word == '--help') then
        value = argument(i + 1)
        has_value = i < command_argument_count() .and. index(value, '--') /= 1
        if (has_value) i = i + 1
        if (.not. has_value) value = ''
      end if
      call take_option(word, has_value, value, options, problems)
    end do
    if (len(options%plan) > 0 .and. .not. options%check) call problems%add('--plan', options%plan, &
      'goes with --check')
    call get_environment_variable('OMP_NUM_THREADS', length=length)
    threads = get_threads()
    if (options%threads == 0 .and. length > 0 .and. threads > max_threads) then
      call problems%add('OMP_NUM_THREADS', threads, allowed_threads)
    end if
  contains
    !> Word i; empty behind the last.
    function argument(i) result(text)
      integer, intent(in) :: i
      character(:), allocatable :: text
      integer :: n

      call get_command_argument(i, length=n)
      allocate (character(n) :: text)
      call get_command_argument(i, text)
    end function argument
  end subroutine read_command_line

  !> What an option needs behind it; empty: nothing.
  pure function needs(word) result(what)
    character(*), intent(in) :: word
    character(:), allocatable :: what

    select case (word)
    case ('--plan', '--restart'); what = 'a file name'
    case ('--output'); what = 'a folder'
    case ('--threads'); what = 'a number'
    case ('--max-wall'); what = 'hours and minutes, HH:MM,'
    case default; what = ''
    end select
  end function needs

  !> One option with its value, if it has one.
  subroutine take_option(word, has_value, value, options, problems)
    character(*), intent(in) :: word, value
    logical, intent(in) :: has_value
    type(options_t), intent(inout) :: options
    type(problems_t), intent(inout) :: problems
    integer, parameter :: most(3) = [100000, 59, 59]
    integer :: n, info, part(3), i, first, colon

    if (all(known /= word)) then
      call problems%add_message("unknown option '"//word//"'; the nearest is " &
        //nearest_name(word, known)//' (see --help)')
      return
    end if
    if (has_value .and. len(needs(word)) == 0 .and. word /= '--help') then
      call problems%add_message('option '//word//" takes no value, got '"//value//"'")
      return
    end if
    if (len(needs(word)) > 0 .and. len(value) == 0) then
      call problems%add_message('option '//word//' needs '//needs(word)//' behind it')
      return
    end if
    select case (word)
    case ('--check'); options%check = .true.
    case ('--plan'); options%plan = value
    case ('--quiet'); options%quiet = .true.
    case ('--version'); options%version = .true.
    case ('--help')
      options%help = .true.
      options%topic = value
    case ('--restart'); options%restart = value
    case ('--output'); options%output = value
    case ('--threads')
      n = 0
      call parse_integer(value, n, info)
      if (info /= value_ok .or. n < 1 .or. n > max_threads) then
        call problems%add('--threads', value, allowed_threads)
      else
        options%threads = n
      end if
    case ('--max-wall')   ! hours and minutes, perhaps seconds: 12:00, 0:30, 1:30:00
      part = 0
      first = 1
      info = value_ok
      do i = 1, 3
        if (first > len(value) + 1 .or. info /= value_ok) exit
        colon = index(value(first:)//':', ':') + first - 1
        call parse_integer(value(first:colon - 1), part(i), info)
        first = colon + 1
      end do
      if (info /= value_ok .or. index(value, ':') == 0 .or. first <= len(value) + 1 &
          .or. any(part < 0 .or. part > most) .or. all(part == 0)) then
        call problems%add('--max-wall', value, 'must be a time HH:MM or HH:MM:SS above 0:00')
      else
        options%max_wall = 3600.0_wp*part(1) + 60.0_wp*part(2) + part(3)
      end if
    case default; error stop 'take_option: an option is known but not handled'
    end select
  end subroutine take_option

  !> The command line that goes on from a restart file, as a shell reads it.
  !!
  !! The results of a run that goes on stay in the folder of that file, so `--output` is not said
  !! again. What stood on standard input has no name: `CASE` stands for it.
  pure function restart_command(program, processes, options, restart_file) result(command)
    character(*), intent(in) :: program        !! as it was called
    integer, intent(in) :: processes           !! of a parallel run
    type(options_t), intent(in) :: options     !! of the run that stopped
    character(*), intent(in) :: restart_file
    character(:), allocatable :: command
    character(16) :: time
    integer :: s

    command = ''
    if (processes > 1) command = 'mpirun -n '//to_text(processes)//' '
    command = command//shell_word(program)//' --restart '//shell_word(restart_file)
    if (options%threads > 0) command = command//' --threads '//to_text(options%threads)
    if (options%max_wall > 0.0_wp) then
      s = nint(options%max_wall)
      write (time, '(i0, 2(":", i2.2))') s/3600, modulo(s/60, 60), modulo(s, 60)
      command = command//' --max-wall '//time(:len_trim(time) - merge(3, 0, modulo(s, 60) == 0))
    end if
    if (options%quiet) command = command//' --quiet'
    if (len(options%case_file) > 0) then
      command = command//' '//shell_word(options%case_file)
    else
      command = command//' < CASE   (CASE: the case file, which came on standard input)'
    end if
  end function restart_command

  !> A word between quotes where a shell would take it apart.
  pure function shell_word(word) result(text)
    character(*), intent(in) :: word
    character(:), allocatable :: text
    character(*), parameter :: plain = 'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ' &
      //'0123456789_-+=.,:/@%'
    integer :: i

    text = word
    if (verify(word, plain) == 0) return
    text = "'"
    do i = 1, len(word)
      if (word(i:i) == "'") then
        text = text//"'\''"
      else
        text = text//word(i:i)
      end if
    end do
    text = text//"'"
  end function shell_word

  !> How to use the program.
  subroutine print_help(unit)
    integer, intent(in) :: unit
    character(*), parameter :: lines(*) = [character(80) :: &
      'Concrete blocks dropped into water: fluid and rigid bodies in three dimensions.', &
      '', &
      'Usage:  mics [options] [case.nml]     without a file name the case is read from', &
      '                                      standard input: mics < case.nml', &
      '', &
      '  --check         read and validate the case, print the plan, write nothing', &
      '  --plan FILE     with --check: write the set-up there, laid out as run.h5', &
      '  --restart FILE  go on from a restart file', &
      '  --output DIR    folder for the results, instead of the one named in the case', &
      '  --threads N     threads (default OMP_NUM_THREADS, else all cores;', &
      '                  1 for each process under mpirun)', &
      '  --max-wall HH:MM', &
      '                  stop in good order before this much wall time has passed', &
      '  --quiet         no progress table', &
      '  --version       version and revision of the source', &
      '  --help [GROUP]  this text, or every variable of a group of the case', &
      '  --help=json     all groups as a JSON schema', &
      '', &
      'Exit codes: 0 done, 2 wrong usage or input, 3 numerical trouble, 4 files,', &
      '            128 + N ended by signal N, 143 also by a file named stop in the', &
      '            folder of the results or --max-wall; a restart file was written.', &
      '']
    integer :: i

    do i = 1, size(lines)
      write (unit, '(a)') trim(lines(i))
    end do
  end subroutine print_help

end module command_line_m
