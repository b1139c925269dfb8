!> Everything a run writes: opened once, written when due, closed with the last state in place.
!!
!! After an error `code` is not `exit_ok`, on all processes, and `message` says why, on the root
!! process at least; the caller then closes the output and ends with `fatal`.
module output_m
  use kinds_m, only: wp, i8
  use errors_m, only: exit_ok, exit_files
  use parallel_m, only: broadcast, is_root
  use timers_m, only: name_phase, tic, toc, wall_clock
  use command_line_m, only: options_t
  use case_types_m, only: case_t, fluid_t, not_resolved
  use bed_m, only: bed_t
  use state_m, only: run_state_t
  use hdf5_file_m, only: h5_file_t
  use table_m, only: result_file_t
  use output_folder_m, only: prepare_folder, continue_folder
  use folder_lock_m, only: folder_lock_t
  use diagnostics_m, only: step_report_t, make_row
  use write_run_m, only: run_file_t
  use write_vtkhdf_m, only: field_file_t, block_file_t
  use restart_m, only: write_restart
  use progress_m, only: progress_t, line_interval
  implicit none
  private
  public :: output_t, name_folder, open_output, write_due_output, close_output

  character(*), parameter :: run_name = 'run.h5', field_name = 'fields.vtkhdf', &
    block_name = 'blocks.vtkhdf'
  character(*), parameter :: restart_name(2) = ['restart-a.h5', 'restart-b.h5']
  real(wp), parameter :: look_interval = 0.5_wp     !! wall time between two looks at the folder [s]

  type :: output_t
    integer :: code = exit_ok                !! exit code of the error met
    character(:), allocatable :: message     !! what the error was
    character(:), allocatable :: folder
    character(:), allocatable :: restart_file   !! the newest, empty: none yet
    type(fluid_t), private :: properties     !! of the fluid
    logical, private :: fields = .false., surfaces = .false. !! these files are written
    integer, private :: next_restart = 1     !! file to write next
    !> Step of the last of each; -1: none yet.
    integer, private :: row_step = -1, frame_step = -1, restart_step = -1
    type(run_file_t), private :: run_file
    type(field_file_t), private :: field_file
    type(block_file_t), private :: block_file
    type(folder_lock_t) :: lock              !! of the folder; the root process has it
    real(wp), private :: next_look = 0.0_wp  !! at the folder, on the wall clock [s]
    type(progress_t), private :: progress
  end type output_t

contains

  !> Make the folder fit and create its files, or open those of the run that goes on from `clock`.
  subroutine open_output(case, parameters, options, state, bed, output)
    type(case_t), intent(in) :: case
    character(*), intent(in) :: parameters   !! all values of the case as text
    type(options_t), intent(in) :: options
    type(run_state_t), intent(in) :: state
    type(bed_t), intent(in) :: bed
    type(output_t), intent(out) :: output
    character(:), allocatable :: what
    logical :: fluid

    output%message = ''
    output%restart_file = options%restart
    call tic('output')
    call name_phase('restart files')
    output%run_file%text = case%text
    output%run_file%parameters = parameters
    output%properties = case%fluid
    fluid = allocated(state%flow%u)
    output%fields = fluid .and. case%run%field_interval > 0.0_wp
    output%surfaces = state%blocks%n > 0 .and. case%run%field_interval > 0.0_wp
    call set_row(state, step_report_t(), output)
    if (len(options%restart) > 0) then
      call continue_files(options, state, output)
    else
      call name_folder(case, options, what, output%folder)
      call prepare_folder(what, output%folder, output%lock, output%code, output%message)
      if (output%code == exit_ok) call create_files(state, bed, output)
    end if
    call check_files(output)
    if (output%code /= exit_ok) then
      call close_files(output)
      call output%lock%release()
    end if
    call output%progress%start(options%quiet, fluid, state%light%on, state%clock)
    call toc('output')
  end subroutine open_output

  !> Folder of a run that starts anew, and who asks for it.
  subroutine name_folder(case, options, what, path)
    type(case_t), intent(in) :: case
    type(options_t), intent(in) :: options
    character(:), allocatable, intent(out) :: what, path

    what = '--output'
    path = trim(options%output)
    if (len(options%output) > 0) return
    what = '&run output'
    path = trim(case%run%output)
  end subroutine name_folder

  !> The row of this moment.
  subroutine set_row(state, report, output)
    type(run_state_t), intent(in) :: state
    type(step_report_t), intent(in) :: report
    type(output_t), intent(inout) :: output

    output%run_file%row = make_row(output%properties, output%run_file%wall_time + wall_clock() &
      - output%progress%began, state, report)
  end subroutine set_row

  subroutine create_files(state, bed, output)
    type(run_state_t), intent(in) :: state
    type(bed_t), intent(in) :: bed
    type(output_t), intent(inout) :: output

    associate (here => output%folder//'/')
      call output%run_file%begin(here//run_name, state, bed)
      if (state%light%on .and. is_root()) call output%run_file%file%attribute('/provenance', &
        'note', not_resolved)
      if (output%fields) call output%field_file%create(here//field_name, .true., state)
      if (output%surfaces) call output%block_file%create(here//block_name, .false., state)
    end associate
    call check_files(output)
    call watch_folder(output)
    if (output%code == exit_ok) return
    call close_files(output)
    call output%lock%remove(run_name)   ! no files that would look like results
    call output%lock%remove(field_name)
    call output%lock%remove(block_name)
  end subroutine create_files

  !> Close all files, unless another run has taken the folder and them. All processes call.
  subroutine close_files(output, exit_code)
    type(output_t), intent(inout) :: output
    integer, intent(in), optional :: exit_code   !! of a run that ends; else it could not begin
    logical :: taken

    taken = output%lock%taken
    call broadcast(taken)
    if (taken) return
    if (present(exit_code)) call output%run_file%finish(exit_code)
    call output%run_file%file%close()
    call output%field_file%file%close()
    call output%block_file%file%close()
  end subroutine close_files

  !> Open the files of the run that goes on, and change them once all are found good.
  subroutine continue_files(options, state, output)
    type(options_t), intent(in) :: options
    type(run_state_t), intent(in) :: state
    type(output_t), intent(inout) :: output
    logical :: fluid, blocks, row_there, frame_there

    call continue_folder(options%restart, options%output, output%lock, output%folder, &
      output%code, output%message)
    if (output%code /= exit_ok) return
    fluid = allocated(state%flow%u)
    blocks = state%blocks%n > 0
    associate (here => output%folder//'/', n => state%clock%frames%n, lock => output%lock)
      call output%run_file%find(here//run_name, state)
      if (fluid .and. n > 0) call output%field_file%reopen(here//field_name, .true., n, state)
      if (blocks .and. n > 0) call output%block_file%reopen(here//block_name, .false., n, state)
      call check_files(output)
      call watch_folder(output)
      if (output%code /= exit_ok) return
      call output%run_file%go_on(state%blocks)
      if (fluid) call continue_frames(lock, here, field_name, output%fields, .true., state, &
                                      output%field_file)
      if (blocks) call continue_frames(lock, here, block_name, output%surfaces, .false., state, &
                                       output%block_file)
    end associate
    row_there = output%run_file%up_to_date
    frame_there = output%field_file%up_to_date .or. output%block_file%up_to_date
    call broadcast(row_there)   ! only the root process knows about its own files
    call broadcast(frame_there)
    if (row_there) output%row_step = state%clock%step
    if (frame_there) output%frame_step = state%clock%step
    if (index(options%restart, restart_name(1)) > 0) output%next_restart = 2
    output%restart_step = state%clock%step
  end subroutine continue_files

  !> Go on with frames; without any so far the file begins now, and where no more are wanted it only
  !! loses the later ones.
  subroutine continue_frames(lock, here, name, wanted, shared, state, file)
    type(folder_lock_t), intent(inout) :: lock
    character(*), intent(in) :: here, name   !! folder, file
    logical, intent(in) :: wanted            !! more frames
    logical, intent(in) :: shared            !! all processes write them
    type(run_state_t), intent(in) :: state
    class(result_file_t), intent(inout) :: file

    if (state%clock%frames%n > 0) then
      call file%drop(file%rows)
      if (.not. wanted) call file%file%close()
    else if (wanted) then
      call lock%remove(name)   ! a killed run may have left it
      call file%create(here//name, shared, state)
    end if
  end subroutine continue_frames

  !> Keep the first error of any of the files; all processes call.
  subroutine check_files(output)
    type(output_t), intent(inout) :: output

    call look_at(output%run_file%file)
    call look_at(output%field_file%file)
    call look_at(output%block_file%file)
    call broadcast(output%code)   ! the root process alone knows about its own files

  contains

    subroutine look_at(file)
      type(h5_file_t), intent(in) :: file

      if (file%info == 0 .or. output%code /= exit_ok) return
      output%code = exit_files
      output%message = file%message
    end subroutine look_at

  end subroutine check_files

  !> Before anything is written, on all processes: is the folder still that of this run?
  subroutine watch_folder(output)
    type(output_t), intent(inout) :: output

    if (is_root() .and. output%code == exit_ok) call output%lock%verify(output%code, output%message)
    call broadcast(output%code)
  end subroutine watch_folder

  !> After a step, and once before the first: write the row, the frames and the restart file that
  !! are due, and a line of the table. All processes call.
  subroutine write_due_output(state, report, output)
    type(run_state_t), intent(inout) :: state
    type(step_report_t), intent(in) :: report
    type(output_t), intent(inout) :: output
    logical :: row_wanted, frame_wanted, line_wanted
    real(wp) :: now   ! [s]

    if (output%code /= exit_ok) return
    call tic('output')
    output%progress%warnings = output%progress%warnings + report%warnings
    call output%progress%store_clips(state%clock%t, report%inertia_clips)
    row_wanted = state%clock%rows%due(state%clock%t) .and. output%row_step /= state%clock%step
    frame_wanted = state%clock%frames%due(state%clock%t) .and. output%frame_step /= state%clock%step
    now = wall_clock()
    line_wanted = frame_wanted .or. (output%progress%shown &   ! on the root process
                                     .and. now - output%progress%last_line >= line_interval)
    if (row_wanted .or. frame_wanted) call watch_folder(output)
    if (output%code /= exit_ok) return
    if (row_wanted .or. line_wanted) call set_row(state, report, output)
    call write_moment(row_wanted, frame_wanted, state, output)
    if (line_wanted) call output%progress%line(state%clock, output%run_file%row, state%blocks)
    if (is_root() .and. now > output%next_look) then   ! rows may be far apart
      call output%lock%verify(output%code, output%message)
      output%next_look = now + look_interval
    end if
    call check_files(output)
    call toc('output')
    if (state%clock%step > 0 .and. state%clock%restarts%due(state%clock%t)) then
      call state%clock%restarts%done(state%clock%t)   ! what is in it counts it as written
      call save_state(state, output)
    end if
  end subroutine write_due_output

  !> Write the row and the frames of this moment as the next ones, and count them if they were due.
  subroutine write_moment(row, frame, state, output)
    logical, intent(in) :: row, frame   !! which are wanted
    type(run_state_t), intent(inout) :: state
    type(output_t), intent(inout) :: output

    associate (clock => state%clock)
      if (row) call output%run_file%append(clock%rows%n, state)
      if (frame .and. output%fields) call output%field_file%append(clock%frames%n, state)
      if (frame .and. output%surfaces) call output%block_file%append(clock%frames%n, state)
      if (row) output%row_step = clock%step
      if (frame) output%frame_step = clock%step
      call check_files(output)
      if (output%code /= exit_ok) return
      if (frame .and. clock%frames%due(clock%t)) call clock%frames%done(clock%t)
      if (.not. (row .and. clock%rows%due(clock%t))) return
      call clock%rows%done(clock%t)
      state%blocks%record%hardest = 0.0_wp
      state%blocks%record%peak = 0.0_wp
    end associate
  end subroutine write_moment

  !> Write the restart file whose turn it is under a temporary name, and rename it when it is
  !! complete and on the disk.
  subroutine save_state(state, output)
    type(run_state_t), intent(inout) :: state
    type(output_t), intent(inout) :: output
    character(:), allocatable :: message, part
    integer :: info

    call watch_folder(output)
    if (output%code /= exit_ok) return
    call tic('restart files')
    associate (name => restart_name(output%next_restart), lock => output%lock)
      part = name//'.part'
      call lock%remove(part)   ! of a run that was killed
      call write_restart(output%folder//'/'//part, output%run_file%text, &
        output%run_file%parameters, state, info, message)
      if (is_root() .and. info == 0) call lock%rename(part, name, info, message)
      call broadcast(info)
      if (info == 0) output%restart_file = output%folder//'/'//name
    end associate
    output%next_restart = 3 - output%next_restart
    output%restart_step = state%clock%step
    call toc('restart files')
    if (info == 0) return
    output%code = exit_files
    output%message = message
    call output%lock%remove(part)   ! the older files may need its room
  end subroutine save_state

  !> Write what a run must end with, its last row, frames and state, say how it ended, and close all
  !! files; after an error of files only close them. All processes call.
  subroutine close_output(exit_code, state, report, output)
    integer, intent(in) :: exit_code
    type(run_state_t), intent(inout) :: state
    type(step_report_t), intent(in) :: report
    type(output_t), intent(inout) :: output
    integer :: code

    call watch_folder(output)
    if (output%code == exit_ok) then
      call set_row(state, report, output)
      call write_moment(output%row_step /= state%clock%step, output%frame_step /= &
                        state%clock%step, state, output)
    end if
    if (output%code == exit_ok) then   ! the state that is saved counts what is there
      call output%progress%line(state%clock, output%run_file%row, state%blocks)
      if (output%restart_step /= state%clock%step) call save_state(state, output)
    end if
    code = merge(exit_code, output%code, output%code == exit_ok)
    call close_files(output, code)
    call output%lock%release()
    call check_files(output)
    if (output%code /= exit_ok) code = output%code
    call output%progress%summary(state%clock, product(int(state%grid%n, i8)), code, output%folder)
  end subroutine close_output

end module output_m
