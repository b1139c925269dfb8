!> mics: concrete blocks dropped into water.
!!
!! Free-surface flow with colliding rigid bodies of any shape in three dimensions, after Yoshikawa,
!! Ushijima, Makino & Nezu (2008). Reads a case, steps through time, writes results.
program mics
  use, intrinsic :: iso_fortran_env, only: output_unit, error_unit
  use kinds_m, only: wp
  use build_info_m, only: version, git_revision
  use c_library_m, only: c_errno
  use errors_m, only: problems_t, fatal, to_text, exit_ok, exit_input, exit_files
  use parallel_m, only: parallel_init, parallel_final, is_root, nproc, set_threads, broadcast
  use stack_limit_m, only: check_stack
  use signals_m, only: catch_signals
  use stop_requests_m, only: stop_requests_t, stop_asked
  use timers_m, only: wall_clock
  use command_line_m, only: options_t, read_command_line, print_help, restart_command
  use case_types_m, only: case_t
  use case_input_m, only: read_case
  use named_files_m, only: read_case_text, look_beside, found_file
  use placing_table_m, only: read_places
  use motion_file_m, only: read_motions
  use reference_m, only: reference_text
  use case_check_m, only: make_shapes, check_case, check_widths
  use case_plan_m, only: print_plan
  use case_warnings_m, only: find_case_warnings
  use set_up_file_m, only: write_set_up
  use memory_plan_m, only: require_memory
  use tet_mesh_m, only: shape_t
  use bed_m, only: bed_t, make_bed
  use initial_state_m, only: check_initial_state
  use start_bodies_m, only: read_start
  use output_folder_m, only: check_folder, same_folder
  use output_m, only: output_t, name_folder, open_output, write_due_output, close_output
  use restart_m, only: all_parameters, read_restart
  use diagnostics_m, only: step_report_t
  use simulation_m, only: simulation_t, simulation_init, resume, measure
  use step_m, only: take_step, measure_overlap
  use faults_m, only: fault_t, store_places, find_fault, set_fault
  use release_m, only: are_waiting
  implicit none
  save   ! keeps the state off the stack
  type(options_t) :: options
  type(case_t) :: case
  type(shape_t), allocatable :: shapes(:)
  type(bed_t), target :: bed
  type(simulation_t) :: sim
  type(output_t) :: output
  type(step_report_t) :: report
  type(fault_t) :: fault
  type(stop_requests_t) :: stop_requests
  character(:), allocatable :: parameters, message, program_name
  integer :: code, waiting, signal = 0, length
  real(wp) :: began   !! wall clock at the start [s]

  call parallel_init()
  began = wall_clock()
  call read_options()
  call require_memory()
  call read_and_check()
  call require_memory(case, shapes, bed)
  call catch_signals()
  call simulation_init(case, shapes, bed, sim)
  parameters = all_parameters(case, shapes, bed)
  if (len(options%restart) > 0) then   ! the state from there in place of the initial one
    call read_restart(options%restart, parameters, sim%run_state_t, code, message)
    if (code /= 0) call fatal(merge(exit_input, exit_files, code == 2), message)
    call resume(sim)
  end if
  call open_output(case, parameters, options, sim%run_state_t, bed, output)
  if (output%code /= exit_ok) call fatal(output%code, output%message)   ! what was written stays
  call measure(sim, report)
  if (len(options%restart) == 0) then   ! of a run that goes on, what was due has been written
    call measure_overlap(sim, report)
    call write_due_output(sim%run_state_t, report, output)
  end if
  stop_requests = stop_requests_t('', options%max_wall, began, last=wall_clock())
  call store_places(sim, fault)
  do while (.not. sim%clock%finished())
    call take_step(sim, report)
    call find_fault(sim, report, fault)
    signal = stop_asked(output%lock, stop_requests)
    if (sim%clock%finished()) signal = 0   ! there is nothing left to stop
    if (fault%code /= exit_ok .or. signal /= 0 .or. output%code /= exit_ok) exit
    call write_due_output(sim%run_state_t, report, output)
  end do
  waiting = count(are_waiting(sim%clock%t, sim%blocks))
  if (sim%clock%finished() .and. waiting > 0) then
    message = ''
    if (sim%clock%settled()) message = ', and all others are at rest'
    call set_fault(sim, to_text(waiting)//' due block(s) never found room'//message, fault)
  end if

  code = fault%code
  if (code == exit_ok .and. signal /= 0) code = 128 + signal
  call measure_overlap(sim, report)   ! of the last row
  call close_output(code, sim%run_state_t, report, output)
  if (output%code /= exit_ok) call fatal(output%code, output%message)   ! what was written stays
  if (fault%code /= exit_ok) call fatal(code, fault%message)
  if (code /= exit_ok) then
    call get_command_argument(0, length=length)
    allocate (character(length) :: program_name)
    call get_command_argument(0, program_name)
    call fatal(code, stop_requests%reason//'; the run goes on with'//new_line('a')//'  ' &
      //restart_command(program_name, nproc(), options, output%restart_file))
  end if
  call parallel_final()

contains

  !> Options that end the program at once, and the number of threads.
  subroutine read_options()
    type(problems_t) :: problems
    character(:), allocatable :: reference

    reference = ''
    call check_stack(problems)
    call read_command_line(options, problems)
    if (options%help) reference = reference_text(options%topic, problems)
    if (problems%n > 0) call refuse(problems)
    if (options%version) reference = reference//'mics '//version//' '//git_revision//new_line('a')
    if (options%help .or. options%version) then
      if (is_root() .and. options%help .and. len(options%topic) == 0) call print_help(output_unit)
      if (is_root()) write (output_unit, '(a)', advance='no') reference
      call finish()
    end if
    call set_threads(options%threads)
  end subroutine read_options

  !> The case with its shapes; every problem with them is reported at once.
  subroutine read_and_check()
    type(problems_t) :: problems, warnings
    character(:), allocatable :: text, what, path, message
    logical :: there
    integer :: n

    ! mpirun gives the root process the input
    if (is_root()) call read_case_text(options%case_file, text, problems)
    n = problems%n
    call broadcast(n)
    if (n > 0) call refuse(problems)
    call broadcast(text)
    call read_case(text, case, problems, warnings)
    call look_beside(options%case_file)
    call read_places(case, problems, warnings)
    call read_motions(case, problems, warnings)
    call make_shapes(case, shapes, problems)
    call read_start(case, shapes, problems)
    call make_bed(case, bed, problems)
    call check_case(case, shapes, bed, problems)
    call check_widths(case, shapes, problems)
    call check_initial_state(case, problems)
    if (len(options%restart) == 0) then
      call name_folder(case, options, what, path)
      call check_folder(what, path, code, message)
      if (code /= exit_ok) call problems%add_message(message)
      message = found_file(case%start%file)
      if (same_folder(path, message(:index(message, '/', back=.true.)))) call problems%add(what, &
        path, 'would be renamed with the file that &start names; take another')
    end if
    there = .false.
    if (len(options%plan) > 0) inquire (file=options%plan, exist=there)
    if (there) call problems%add('--plan', options%plan, 'is there already, must be a new file')
    if (problems%n > 0) call refuse(problems)
    if (.not. options%check) then
      call warnings%report(error_unit, 'mics: warning: ')
      return
    end if
    if (len(options%output) > 0) case%run%output = options%output
    if (is_root()) call print_plan(case, shapes, bed)
    call find_case_warnings(case, shapes, bed, warnings)
    if (is_root() .and. warnings%n > 0) write (output_unit, '(a)') 'Warnings'
    call warnings%report(output_unit, '  warning: ')
    message = ''
    if (len(options%plan) > 0) call write_set_up(options%plan, case, &
      all_parameters(case, shapes, bed), shapes, bed, message)
    call broadcast(message)
    if (len(message) > 0) call fatal(exit_files, message)
    call finish()
  end subroutine read_and_check

  !> End with code 2 after naming all problems.
  subroutine refuse(problems)
    type(problems_t), intent(in) :: problems

    call problems%report(error_unit)
    call fatal(exit_input, '')
  end subroutine refuse

  !> End in good order before a run began.
  subroutine finish()
    integer, parameter :: lost(2) = [5, 28]   ! EIO, ENOSPC; the library says nothing of them

    flush (output_unit)
    if (any(c_errno() == lost)) call fatal(exit_files, 'standard output cannot be written')
    call parallel_final()
    stop
  end subroutine finish

end program mics
