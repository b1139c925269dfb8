!> The set-up of a checked case as a file, for pages and other programs: `--check --plan FILE`.
!!
!! Laid out as `run.h5`. Its rows are the starting poses; with fixed bodies that move, these poses
!! over the run. The group `/plan` has what a run does not keep: the line of each body in the case,
!! its place before the random shift, and how far that reaches.
module set_up_file_m
  use kinds_m, only: wp
  use errors_m, only: exit_ok
  use parallel_m, only: is_root
  use case_types_m, only: case_t, drop_input_t, place_t, is_given
  use tet_mesh_m, only: shape_t
  use bed_m, only: bed_t
  use grid_m, only: grid_init
  use drops_m, only: place_of_block
  use rigid_body_m, only: blocks_t, drift, are_driven
  use case_blocks_m, only: blocks_init
  use clock_m, only: clock_init
  use state_m, only: run_state_t
  use diagnostics_m, only: step_report_t, make_row
  use hdf5_file_m, only: as_integer
  use write_run_m, only: run_file_t
  implicit none
  private
  public :: write_set_up

  integer, parameter :: n_poses = 60   !! of bodies that move as prescribed

contains

  !> Write the set-up of a case; `message` is what went wrong, empty: nothing. All processes
  !! call, the root writes and reports.
  subroutine write_set_up(path, case, parameters, shapes, bed, message)
    character(*), intent(in) :: path         !! of the new file
    type(case_t), intent(in) :: case         !! checked
    character(*), intent(in) :: parameters   !! all values of the case as text
    type(shape_t), intent(in) :: shapes(:)   !! one for each `&shape`
    type(bed_t), intent(in) :: bed
    character(:), allocatable, intent(out) :: message
    type(run_state_t) :: state
    type(step_report_t) :: report
    type(run_file_t) :: file
    integer :: i

    call grid_init(case%grid, case%boundary, state%grid)
    call clock_init(case%run, state%clock)
    call blocks_init(case, shapes, state%blocks, bed)
    file%text = case%text
    file%parameters = parameters
    file%row = make_row(case%fluid, 0.0_wp, state, report)
    call file%begin(path, state, bed)
    call write_places(case, state%blocks, file)
    state%blocks%present = state%blocks%fixed .and. are_driven(state%blocks)   ! only they move
    do i = 0, merge(n_poses, 0, any(state%blocks%present))
      file%row = make_row(case%fluid, 0.0_wp, state, report)
      call file%append(i, state)
      call drift(case%run%t_end/n_poses, state%blocks)
      state%clock%t = (i + 1)*case%run%t_end/n_poses
    end do
    call file%finish(exit_ok)
    message = ''
    if (file%file%info /= 0) message = file%file%message
  end subroutine write_set_up

  !> Of each body its line in the case, its place without and with the range of the random shift.
  subroutine write_places(case, blocks, run)
    type(case_t), intent(in) :: case
    type(blocks_t), intent(in) :: blocks
    type(run_file_t), intent(inout) :: run
    type(drop_input_t) :: unshifted
    type(place_t) :: one
    real(wp) :: place(3, blocks%n), spread(3, blocks%n)
    integer :: line(blocks%n), b, i, k

    if (.not. is_root()) return
    place = blocks%x
    spread = 0.0_wp
    line(:size(case%body)) = case%body%line
    b = size(case%body)
    do i = 1, size(case%drop)
      do k = 1, case%drop(i)%count
        b = b + 1
        line(b) = case%drop(i)%line
        spread(:, b) = case%drop(i)%spread
        unshifted = case%drop(i)
        unshifted%spread = 0.0_wp
        one = place_of_block(unshifted, k)
        where (is_given(one%x)) place(:, b) = one%x
      end do
    end do
    associate (file => run%file)
      call file%group('/plan')
      call file%store('/plan/line', '1', real(line, wp), kind=as_integer)
      call file%store('/plan/place', 'm', [place], shape(place))
      call file%store('/plan/spread', 'm', [spread], shape(spread))
    end associate
  end subroutine write_places

end module set_up_file_m
