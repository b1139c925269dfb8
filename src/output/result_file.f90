!> A result file of a run: a table whose columns one procedure lists from the state of the run, to
!! create the file, to go on in it and to append a row.
!!
!! The root process alone writes it, unless it is shared by all.
module result_file_m
  use parallel_m, only: is_root
  use run_state_m, only: run_state_t
  use table_m, only: table_t, creating, reopening, appending
  implicit none
  private
  public :: result_file_t

  type, abstract, extends(table_t) :: result_file_t
    character(:), allocatable :: counter
      !! group whose `@NSteps` counts the rows, if any does; `list_columns` sets it
  contains
    procedure(of_state), deferred :: write_head     !! all but columns
    procedure(of_state), deferred :: list_columns   !! see `table_m`
    procedure :: create, reopen, drop, append
    procedure, private :: count_rows
  end type result_file_t

  abstract interface
    subroutine of_state(self, state)
      import :: result_file_t, run_state_t
      implicit none
      class(result_file_t), intent(inout) :: self
      type(run_state_t), intent(in) :: state
    end subroutine of_state
  end interface

contains

  !> Create the file without rows.
  subroutine create(self, path, shared, state)
    class(result_file_t), intent(inout) :: self
    character(*), intent(in) :: path
    logical, intent(in) :: shared   !! all processes call and write
    type(run_state_t), intent(in) :: state

    if (.not. (is_root() .or. shared)) return
    call self%file%create(path, shared)
    call self%write_head(state)
    call self%begin(creating)
    call self%list_columns(state)
    if (allocated(self%counter)) call self%file%attribute(self%counter, 'NSteps', 0)
    call self%file%flush()
  end subroutine create

  !> Open the file of a run that goes on from `state`; nothing in it is changed yet.
  subroutine reopen(self, path, shared, counted, state)
    class(result_file_t), intent(inout) :: self
    character(*), intent(in) :: path
    logical, intent(in) :: shared
    integer, intent(in) :: counted   !! rows that the run has counted
    type(run_state_t), intent(in) :: state

    if (.not. (is_root() .or. shared)) return
    call self%file%open(path, shared, .true.)
    call self%begin(reopening)
    call self%list_columns(state)
    call self%find_rows(counted, state%clock%t)
  end subroutine reopen

  !> Keep the first rows.
  subroutine drop(self, rows)
    class(result_file_t), intent(inout) :: self
    integer, intent(in) :: rows

    if (.not. (is_root() .or. self%file%shared)) return
    call self%count_rows(rows)
    call self%keep(rows)
    call self%file%flush()
  end subroutine drop

  !> Write a row as number `rows_before` + 1, in the place of a row that only ended an earlier run.
  subroutine append(self, rows_before, state)
    class(result_file_t), intent(inout) :: self
    integer, intent(in) :: rows_before   !! due rows written so far
    type(run_state_t), intent(in) :: state

    if (.not. (is_root() .or. self%file%shared)) return
    if (self%rows /= rows_before) call self%drop(rows_before)
    call self%file%reserve(self%bytes_for_row())
    call self%begin(appending)
    call self%list_columns(state)
    self%rows = self%rows + 1
    call self%count_rows(self%rows)
  end subroutine append

  !> Say how many rows are complete, once they are in the file.
  subroutine count_rows(self, rows)
    class(result_file_t), intent(inout) :: self
    integer, intent(in) :: rows

    call self%file%flush()
    if (.not. allocated(self%counter)) return
    call self%file%attribute(self%counter, 'NSteps', rows)
    call self%file%flush()
  end subroutine count_rows

end module result_file_m
