!> Everything a run writes: opened once, written when due, closed with the last state in place.
!!
!! After an error `code` is not `exit_ok`, on all processes, and `message` says why, on the root
!! process at least; the caller then closes the output and ends with `fatal`.
module output_m
  use kinds_m, only: wp, i8
  use errors_m, only: problems_t, exit_ok, exit_files
  use parallel_m, only: broadcast, is_root
  use timers_m, only: timer, tic, toc, wall_clock
  use command_line_m, only: options_t
  use case_types_m, only: case_t, fluid_t, not_resolved
  use bed_m, only: bed_t
  use block_record_m, only: begin_row
  use run_state_m, only: run_state_t
  use hdf5_file_m, only: h5_file_t
  use output_folder_m, only: check_folder, prepare_folder, continue_folder
  use folder_lock_m, only: folder_lock_t
  use diagnostics_m, only: step_report_t, quantity_t, make_row
  use write_run_m, only: run_file_t, create_run_file, reopen_run_file, continue_run_file, &
    write_row, close_run_file
  use write_vtkhdf_m, only: field_file_t, create_field_file, reopen_field_file, &
    continue_field_file, write_field_frame
  use write_vtkhdf_m, only: block_file_t, create_block_file, reopen_block_file, &
    continue_block_file, write_block_frame
  use restart_m, only: write_restart
  use progress_m, only: progress_t, progress_start, line_due, store_clips, write_line, &
    write_summary
  implicit none
  private
  public :: output_t, check_output, open_output, write_due_output, close_output

  character(*), parameter :: run_name = 'run.h5', field_name = 'fields.vtkhdf', &
    block_name = 'blocks.vtkhdf'
  character(*), parameter :: restart_name(2) = ['restart-a.h5', 'restart-b.h5']
  real(wp), parameter :: look_interval = 0.5_wp     !! wall time between two looks at the folder [s]

  type :: output_t
    integer :: code = exit_ok                !! exit code of the error met
    character(:), allocatable :: message     !! what the error was
    character(:), allocatable :: folder
    character(:), allocatable :: restart_file   !! the newest, empty: none yet
    character(:), allocatable, private :: text, parameters   !! of the case
    type(fluid_t), private :: properties     !! of the fluid
    logical, private :: quiet = .false.      !! no table
    logical, private :: fluid = .false.      !! there is one
    logical, private :: fields = .false., surfaces = .false. !! these files are written
    integer, private :: next_restart = 1     !! file to write next
    !> Step of the last of each; -1: none yet.
    integer, private :: row_step = -1, frame_step = -1, restart_step = -1
    integer, private :: phase = 0, restart_phase = 0         !! timers
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

    output%message = ''
    output%restart_file = options%restart
    output%phase = timer('output')
    output%restart_phase = timer('restart files')
    call tic(output%phase)
    output%text = case%text
    output%parameters = parameters
    output%properties = case%fluid
    output%quiet = options%quiet
    output%fluid = allocated(state%flow%u)
    output%fields = output%fluid .and. case%run%field_interval > 0.0_wp
    output%surfaces = state%blocks%n > 0 .and. case%run%field_interval > 0.0_wp
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
    call progress_start(options%quiet, output%fluid, state%light%on, state%clock, output%progress)
    call toc(output%phase)
  end subroutine open_output

  !> Folder of a run that starts anew, and who asks for it.
  subroutine name_folder(case, options, what, path)
    type(case_t), intent(in) :: case
    type(options_t), intent(in) :: options
    character(:), allocatable, intent(out) :: what, path

    if (len(options%output) > 0) then
      what = '--output'
      path = trim(options%output)
    else
      what = '&run output'
      path = trim(case%run%output)
    end if
  end subroutine name_folder

  !> Note what forbids the folder of a run that starts anew, nothing is changed. All processes call.
  subroutine check_output(case, options, problems)
    type(case_t), intent(in) :: case
    type(options_t), intent(in) :: options
    type(problems_t), intent(inout) :: problems
    character(:), allocatable :: what, path, message
    integer :: code

    if (len(options%restart) > 0) return
    call name_folder(case, options, what, path)
    call check_folder(what, path, code, message)
    if (code /= exit_ok) call problems%add_message(message)
  end subroutine check_output

  subroutine create_files(state, bed, output)
    type(run_state_t), intent(in) :: state
    type(bed_t), intent(in) :: bed
    type(output_t), intent(inout) :: output

    call create_run_file(output%folder//'/'//run_name, output%text, output%parameters, state, &
      bed, make_row(output%properties, 0.0_wp, state, step_report_t()), &
      output%run_file)
    if (state%light%on .and. is_root()) call output%run_file%file%attribute('/provenance', 'note', &
      not_resolved)
    if (output%fields) call create_field_file(output%folder//'/'//field_name, state, &
      output%field_file)
    if (output%surfaces) call create_block_file(output%folder//'/'//block_name, state%blocks, &
      output%block_file)
    call check_files(output)
    call watch_folder(output)
    if (output%code == exit_ok) return
    call close_files(output)
    call discard(output, run_name)   ! no files that would look like results
    call discard(output, field_name)
    call discard(output, block_name)
  end subroutine create_files

  !> Delete a file that could not be written, if the folder is still that of this run.
  subroutine discard(output, name)
    type(output_t), intent(inout) :: output
    character(*), intent(in) :: name
    character(:), allocatable :: message
    integer :: code

    if (.not. is_root()) return
    code = exit_ok
    message = ''
    call output%lock%verify(code, message)
    if (code == exit_ok) call output%lock%remove(name)
  end subroutine discard

  !> Close all files, unless another run has taken the folder and them. All processes call.
  subroutine close_files(output, exit_code)
    type(output_t), intent(inout) :: output
    integer, intent(in), optional :: exit_code   !! of a run that ends; else it could not begin
    integer :: taken

    taken = merge(1, 0, output%lock%taken)
    call broadcast(taken)
    if (taken == 1) return
    if (present(exit_code)) call close_run_file(output%run_file, exit_code)
    call output%run_file%file%close()
    call output%field_file%file%close()
    call output%block_file%file%close()
  end subroutine close_files

  !> Open the files of the run that goes on, and change them once all are found good.
  subroutine continue_files(options, state, output)
    type(options_t), intent(in) :: options
    type(run_state_t), intent(in) :: state
    type(output_t), intent(inout) :: output
    integer :: up_to_date(2)

    call continue_folder(options%restart, options%output, output%lock, output%folder, &
      output%code, output%message)
    if (output%code /= exit_ok) return
    call reopen_run_file(output%folder//'/'//run_name, state%clock, state%blocks, &
      make_row(output%properties, 0.0_wp, state, step_report_t()), output%run_file)
    if (state%clock%n_frames > 0) then
      if (output%fluid) call reopen_field_file(output%folder//'/'//field_name, state, &
        output%field_file)
      if (state%blocks%n > 0) call reopen_block_file(output%folder//'/'//block_name, state%blocks, &
                                                     state%clock, output%block_file)
    end if
    call check_files(output)
    call watch_folder(output)
    if (output%code /= exit_ok) return
    call continue_run_file(output%text, output%parameters, output%run_file)
    if (output%fluid) call continue_fields(state, output)
    if (state%blocks%n > 0) call continue_surfaces(state, output)
    up_to_date = 0
    if (output%run_file%up_to_date) up_to_date(1) = 1
    if (output%field_file%up_to_date .or. output%block_file%up_to_date) up_to_date(2) = 1
    call broadcast(up_to_date)   ! only the root process knows about its own files
    if (up_to_date(1) == 1) output%row_step = state%clock%step
    if (up_to_date(2) == 1) output%frame_step = state%clock%step
    if (index(options%restart, restart_name(1)) > 0) output%next_restart = 2
    output%restart_step = state%clock%step
  end subroutine continue_files

  !> Go on with the frames of the fluid; without any so far the file begins now, and where no more
  !! are wanted it only loses the later ones.
  subroutine continue_fields(state, output)
    type(run_state_t), intent(in) :: state
    type(output_t), intent(inout) :: output

    if (state%clock%n_frames > 0) then
      call continue_field_file(output%field_file)
      if (.not. output%fields) call output%field_file%file%close()
    else if (output%fields) then
      if (is_root()) call output%lock%remove(field_name)   ! a killed run may have left it
      call create_field_file(output%folder//'/'//field_name, state, output%field_file)
    end if
  end subroutine continue_fields

  !> The same for the frames of the blocks.
  subroutine continue_surfaces(state, output)
    type(run_state_t), intent(in) :: state
    type(output_t), intent(inout) :: output

    if (state%clock%n_frames > 0) then
      call continue_block_file(output%block_file)
      if (.not. output%surfaces) call output%block_file%file%close()
    else if (output%surfaces) then
      if (is_root()) call output%lock%remove(block_name)
      call create_block_file(output%folder//'/'//block_name, state%blocks, output%block_file)
    end if
  end subroutine continue_surfaces

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
    type(quantity_t), allocatable :: row(:)
    logical :: row_wanted, frame_wanted, line_wanted
    real(wp) :: now   ! [s]

    if (output%code /= exit_ok) return
    call tic(output%phase)
    output%progress%warnings = output%progress%warnings + report%warnings
    call store_clips(state%clock%t, report%inertia_clips, output%progress)
    row_wanted = state%clock%row_due() .and. output%row_step /= state%clock%step
    frame_wanted = state%clock%frame_due() .and. output%frame_step /= state%clock%step
    line_wanted = line_due(output%progress)
    line_wanted = line_wanted .or. frame_wanted
    if (row_wanted .or. frame_wanted) then
      call watch_folder(output)
      if (output%code /= exit_ok) return
    else
      call share_outcome(output%quiet, line_wanted)
    end if
    if (row_wanted .or. line_wanted) then
      row = make_row(output%properties, output%run_file%wall_time + wall_clock() &
        - output%progress%began, state, report)
    end if
    if (row_wanted) then
      call write_row(output%run_file, state%clock%n_rows, row, state%blocks)
      call state%clock%row_done()
      call begin_row(state%blocks)
      output%row_step = state%clock%step
    end if
    if (frame_wanted) then
      call write_frames(state, output)
      call state%clock%frame_done()
    end if
    if (line_wanted) call write_line(output%progress, state%clock, row, state%blocks)
    now = wall_clock()
    if (is_root() .and. now > output%next_look) then   ! rows may be far apart
      call output%lock%verify(output%code, output%message)
      output%next_look = now + look_interval
    end if
    call check_files(output)
    call toc(output%phase)
    if (state%clock%restart_due()) then
      call state%clock%restart_done()
      call save_state(state, output)
    end if
  end subroutine write_due_output

  !> Whether a line is wanted depends on the clock of the root process.
  subroutine share_outcome(quiet, wanted)
    logical, intent(in) :: quiet
    logical, intent(inout) :: wanted
    integer :: flag

    if (quiet) return
    flag = merge(1, 0, wanted)
    call broadcast(flag)
    wanted = flag == 1
  end subroutine share_outcome

  !> Write the frames of this moment as the next ones; the caller counts them if they were due.
  subroutine write_frames(state, output)
    type(run_state_t), intent(in) :: state
    type(output_t), intent(inout) :: output

    associate (n => state%clock%n_frames, t => state%clock%t)
      if (output%fields) call write_field_frame(output%field_file, n, state)
      if (output%surfaces) call write_block_frame(output%block_file, n, t, state%blocks)
    end associate
    output%frame_step = state%clock%step
  end subroutine write_frames

  !> Write the restart file whose turn it is under a temporary name, and rename it when it is
  !! complete and on the disk.
  subroutine save_state(state, output)
    type(run_state_t), intent(inout) :: state
    type(output_t), intent(inout) :: output
    character(:), allocatable :: message, part
    integer :: info

    call watch_folder(output)
    if (output%code /= exit_ok) return
    call tic(output%restart_phase)
    associate (name => restart_name(output%next_restart), lock => output%lock)
      part = name//'.part'
      if (is_root()) call lock%remove(part)   ! of a run that was killed
      call write_restart(output%folder//'/'//part, output%text, output%parameters, state, info, &
        message)
      if (is_root() .and. info == 0) call lock%rename(part, name, info, message)
      call broadcast(info)
      if (info == 0) output%restart_file = output%folder//'/'//name
    end associate
    output%next_restart = 3 - output%next_restart
    output%restart_step = state%clock%step
    call toc(output%restart_phase)
    if (info == 0) return
    output%code = exit_files
    output%message = message
    call discard(output, part)   ! the older files may need its room
  end subroutine save_state

  !> Write what a run must end with, its last row, frames and state, say how it ended, and close all
  !! files; after an error of files only close them. All processes call.
  subroutine close_output(exit_code, state, report, output)
    integer, intent(in) :: exit_code
    type(run_state_t), intent(inout) :: state
    type(step_report_t), intent(in) :: report
    type(output_t), intent(inout) :: output
    type(quantity_t), allocatable :: row(:)
    integer :: code
    logical :: row_wanted, frame_wanted

    call watch_folder(output)
    if (output%code == exit_ok) then
      row = make_row(output%properties, output%run_file%wall_time + wall_clock() &
        - output%progress%began, state, report)
      row_wanted = output%row_step /= state%clock%step
      frame_wanted = output%frame_step /= state%clock%step
      if (row_wanted) call write_row(output%run_file, state%clock%n_rows, row, state%blocks)
      if (frame_wanted) call write_frames(state, output)
      call check_files(output)
    end if
    if (output%code == exit_ok) then   ! the state that is saved counts what is there
      if (row_wanted .and. state%clock%row_due()) then
        call state%clock%row_done()
        call begin_row(state%blocks)
      end if
      if (frame_wanted .and. state%clock%frame_due()) call state%clock%frame_done()
      call write_line(output%progress, state%clock, row, state%blocks)
      if (output%restart_step /= state%clock%step) call save_state(state, output)
    end if
    code = merge(exit_code, output%code, output%code == exit_ok)
    call close_files(output, code)
    call output%lock%release()
    call check_files(output)
    if (output%code /= exit_ok) code = output%code
    call write_summary(output%progress, state%clock, product(int(state%grid%n, i8)), code, &
                       output%folder)
  end subroutine close_output

end module output_m
