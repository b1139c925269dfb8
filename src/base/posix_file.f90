!> Files of bytes as the C library gives them: Fortran's own units do not report a full disk.
!!
!! The first error sets `info` and a `message` that names the file and the reason; from then on
!! every procedure of that file returns at once.
module posix_file_m
  use, intrinsic :: iso_c_binding, only: c_int, c_long, c_null_char, c_null_ptr, &
    c_ptr, c_size_t, c_associated
  use c_library_m, only: c_close, c_errno, c_fclose, c_fileno, c_flock, c_fopen, c_fstat, &
    c_ftruncate, c_lseek, c_open, c_pread, c_pwrite, c_stat, c_strerror, stat_size, text_at
  implicit none
  private
  public :: posix_file_t, is_pipe, is_file_at, all_written, system_reason
  public :: lock_refused, lock_unknown

  integer, parameter :: lock_taken = 0, lock_refused = 1
  integer, parameter :: lock_unknown = 2   !! the file system keeps no locks

  type :: posix_file_t
    character(:), allocatable :: path
    integer :: info = 0                    !! 0: no error so far
    character(:), allocatable :: message   !! file and reason of the first error
    type(c_ptr), private :: stream = c_null_ptr
    integer(c_int) :: number = -1          !! of the open file in this process
  contains
    procedure :: open => file_open
    procedure :: close => file_close
    procedure :: write => file_write
    procedure :: rewrite => file_rewrite
    procedure :: read => file_read
    procedure :: lock => file_lock
    procedure :: content
    procedure, private :: check
  end type posix_file_t

contains

  !> Keep an error of `what`, if there is one, in the words of the system.
  subroutine check(self, well, what)
    class(posix_file_t), intent(inout) :: self
    logical, intent(in) :: well
    character(*), intent(in) :: what   !! like 'write'

    if (well .or. self%info /= 0) return
    self%info = 1
    self%message = self%path//': cannot '//what//': '//system_reason()
  end subroutine check

  !> Why the last call of the system failed, in its words.
  function system_reason() result(reason)
    character(:), allocatable :: reason

    reason = text_at(c_strerror(c_errno()))
  end function system_reason

  !> Open a file; `mode` as in C: 'r' to read, 'wx' to write a new one, 'a' to write at the end.
  subroutine file_open(self, path, mode)
    class(posix_file_t), intent(inout) :: self
    character(*), intent(in) :: path, mode

    self%path = path
    self%info = 0
    self%message = ''
    if (is_pipe(path)) then
      self%info = 1
      self%message = path//': cannot open the file: it is a pipe'
      return
    end if
    self%stream = c_fopen(path//c_null_char, mode//c_null_char)
    call self%check(c_associated(self%stream), 'open the file')
    if (self%info == 0) self%number = c_fileno(self%stream)
  end subroutine file_open

  !> Close the file; done even after an error. A lock ends with it.
  subroutine file_close(self)
    class(posix_file_t), intent(inout) :: self

    if (.not. c_associated(self%stream)) return
    call self%check(c_fclose(self%stream) == 0, 'close the file')
    self%stream = c_null_ptr
    self%number = -1
  end subroutine file_close

  !> Write bytes from a place in the file on.
  subroutine file_write(self, place, bytes)
    class(posix_file_t), intent(inout) :: self
    integer(c_long), intent(in) :: place   !! from 0
    character(*), intent(in) :: bytes

    if (self%info == 0) call self%check(all_written(self%number, place, bytes), 'write')
  end subroutine file_write

  !> Replace all that the file holds.
  subroutine file_rewrite(self, bytes)
    class(posix_file_t), intent(inout) :: self
    character(*), intent(in) :: bytes

    if (self%info /= 0) return
    call self%check(c_ftruncate(self%number, 0_c_long) == 0, 'write')
    call self%write(0_c_long, bytes)
  end subroutine file_rewrite

  !> Read the bytes from a place in the file on, at most as many as `bytes` holds.
  subroutine file_read(self, place, bytes, n)
    class(posix_file_t), intent(inout) :: self
    integer(c_long), intent(in) :: place   !! from 0
    character(:), allocatable, intent(inout) :: bytes
    integer, intent(out) :: n              !! how many there were; 0 at the end of the file

    n = 0
    if (self%info /= 0) return
    n = int(c_pread(self%number, bytes, len(bytes, c_size_t), place))
    call self%check(n >= 0, 'read')
  end subroutine file_read

  !> What a short file holds now, wherever it was read or written last.
  function content(self) result(text)
    class(posix_file_t), intent(in) :: self
    character(:), allocatable :: text
    character(400) :: bytes

    text = bytes(:max(0_c_size_t, c_pread(self%number, bytes, len(bytes, c_size_t), 0_c_long)))
  end function content

  !> Try to take a lock on the open file; it ends when the file is closed or the program ends.
  subroutine file_lock(self, alone, outcome)
    class(posix_file_t), intent(inout) :: self
    logical, intent(in) :: alone      !! nobody else may have a lock; otherwise many may
    integer, intent(out) :: outcome   !! lock_taken, lock_refused or lock_unknown
    integer(c_int), parameter :: shared = 1, exclusive = 2, at_once = 4
    integer(c_int), parameter :: would_wait(2) = [11, 35]   ! as Linux and as BSD number it
    integer(c_int) :: number

    outcome = lock_unknown
    if (self%info /= 0) return
    outcome = lock_taken
    if (c_flock(self%number, merge(exclusive, shared, alone) + at_once) == 0) return
    number = c_errno()
    outcome = merge(lock_refused, lock_unknown, any(number == would_wait))
  end subroutine file_lock

  !> Is this a named pipe, or a terminal? To open it, and to read it, would wait until somebody
  !! writes, which may be never. (The number of `at_once` is that of Linux; elsewhere the question
  !! itself may wait.)
  function is_pipe(path) result(yes)
    character(*), intent(in) :: path
    logical :: yes
    integer(c_int), parameter :: at_once = 2048, from_here = 1   ! O_NONBLOCK, SEEK_CUR
    integer(c_int) :: fd

    yes = .false.
    fd = c_open(path//c_null_char, at_once)
    if (fd < 0) return
    yes = c_lseek(fd, 0_c_long, from_here) < 0
    if (c_close(fd) /= 0) return
  end function is_pipe

  !> Does a path lead to the file that is open under a number, and not to another that has its name
  !! now? Device and inode say it.
  function is_file_at(fd, path) result(yes)
    integer(c_int), intent(in) :: fd
    character(*), intent(in) :: path
    logical :: yes
    integer(c_long) :: held(stat_size), found(stat_size)

    yes = c_fstat(fd, held) == 0
    if (yes) yes = c_stat(path//c_null_char, found) == 0
    if (yes) yes = all(held(:2) == found(:2))
  end function is_file_at

  !> Write bytes from a place in an open file on, all of them; false after an error.
  function all_written(fd, place, bytes) result(well)
    integer(c_int), intent(in) :: fd
    integer(c_long), intent(in) :: place   !! from 0
    character(*), intent(in) :: bytes
    logical :: well
    integer(c_size_t) :: there, n

    there = 0
    do while (there < len(bytes))
      n = c_pwrite(fd, bytes(there + 1:), len(bytes, c_size_t) - there, place + there)
      if (n <= 0) exit
      there = there + n
    end do
    well = there == len(bytes)
  end function all_written

end module posix_file_m
