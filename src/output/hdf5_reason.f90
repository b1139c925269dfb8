!> Starting HDF5 the way this program needs it, and the reason of its last failure in plain words.
module hdf5_reason_m
  use, intrinsic :: iso_c_binding, only: c_int, c_int64_t, c_ptr, c_null_char, c_funptr, &
    c_funloc, c_loc, c_f_pointer, c_associated
  use c_library_m, only: c_setenv, text_at
  use hdf5, only: h5open_f, h5eset_auto_f, h5dont_atexit_f
  implicit none
  private
  public :: hdf5_start, hdf5_reason

  integer, parameter :: longest_reason = 512

  logical :: started = .false.

  !> What HDF5 notes about one level of a failed call.
  type, bind(c) :: record_t
    integer(c_int64_t) :: class, major, minor
    integer(c_int) :: line
    type(c_ptr) :: function_name, file_name, description
  end type record_t

  interface
    !> Walk the stack of errors; `upward` begins at the innermost.
    integer(c_int) function h5e_walk(stack, direction, visit, data) bind(c, name='H5Ewalk2')
      import :: c_int, c_int64_t, c_funptr, c_ptr
      implicit none
      integer(c_int64_t), value :: stack
      integer(c_int), value :: direction
      type(c_funptr), value :: visit
      type(c_ptr), value :: data
    end function h5e_walk
  end interface

contains

  !> Start HDF5: without file locks, so that a run can be read while it goes on, unless the user has
  !! set `HDF5_USE_FILE_LOCKING`; without its own messages; without a routine at exit, because we
  !! close our files ourselves. Further calls do nothing: HDF5 would keep some 30 kB for each.
  subroutine hdf5_start(status)
    integer, intent(out) :: status   !! < 0: failed
    integer :: ignored

    status = 0
    if (started) return
    status = -1
    if (c_setenv('HDF5_USE_FILE_LOCKING'//c_null_char, 'FALSE'//c_null_char, 0_c_int) /= 0) return
    call h5dont_atexit_f(ignored)   ! fails when HDF5 is already there
    call h5open_f(status)
    if (status >= 0) call h5eset_auto_f(0, status)
    started = status >= 0
  end subroutine hdf5_start

  !> Why the last call of HDF5 failed: the system's words if it was the system, else those of HDF5.
  function hdf5_reason() result(reason)
    character(:), allocatable :: reason
    character(longest_reason), target :: found
    character(*), parameter :: mark = "error message = '"
    integer(c_int) :: status
    integer :: first

    found = ''
    status = h5e_walk(0_c_int64_t, 0_c_int, c_funloc(keep_innermost), c_loc(found))
    reason = trim(found)
    if (status /= 0 .or. len(reason) == 0) reason = 'unknown reason'
    first = index(reason, mark)
    if (first == 0) return
    reason = reason(first + len(mark):)
    reason = reason(:index(reason//"'", "'") - 1)
  end function hdf5_reason

  !> Copy the description of level 0, the innermost, into the text that `data` points to.
  function keep_innermost(level, record, data) result(status) bind(c)
    integer(c_int), value :: level
    type(record_t), intent(in) :: record
    type(c_ptr), value :: data
    integer(c_int) :: status
    character(longest_reason), pointer :: found

    status = 0
    if (level /= 0 .or. .not. c_associated(record%description)) return
    call c_f_pointer(data, found)
    found = text_at(record%description)
  end function keep_innermost

end module hdf5_reason_m
