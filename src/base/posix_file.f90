!> Files of bytes as the C library gives them: Fortran's own units do not report a full disk.
!!
!! The first error sets `info` and a `message` that names the file and the reason; from then on
!! every procedure of that file returns at once.
module posix_file_m
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_loc, c_long, c_null_char, c_null_ptr, &
    c_ptr, c_size_t, c_associated
  use c_library_m, only: c_close, c_errno, c_fclose, c_ferror, c_fflush, c_fileno, c_flock, &
    c_fopen, c_fread, c_fstat, c_ftruncate, c_fwrite, c_lseek, c_open, c_pread, c_stat, &
    c_strerror, stat_size, text_at, text_of_letters
  implicit none
  private
  public :: posix_file_t, is_pipe, is_file_at, system_reason
  public :: lock_refused, lock_unknown

  integer, parameter :: lock_taken = 0, lock_refused = 1
  integer, parameter :: lock_unknown = 2   !! the file system keeps no locks

  type :: posix_file_t
    character(:), allocatable :: path
    integer :: info = 0                    !! 0: no error so far
    character(:), allocatable :: message   !! file and reason of the first error
    type(c_ptr), private :: stream = c_null_ptr
  contains
    procedure :: open => file_open
    procedure :: close => file_close
    procedure :: write => file_write
    procedure :: rewrite => file_rewrite
    procedure :: read => file_read
    procedure :: lock => file_lock
    procedure :: is_at, content
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
  end subroutine file_open

  !> Close the file; done even after an error. A lock ends with it.
  subroutine file_close(self)
    class(posix_file_t), intent(inout) :: self

    if (.not. c_associated(self%stream)) return
    call self%check(c_fclose(self%stream) == 0, 'close the file')
    self%stream = c_null_ptr
  end subroutine file_close

  !> Write bytes and hand them to the system at once.
  subroutine file_write(self, bytes)
    class(posix_file_t), intent(inout) :: self
    character(*), intent(in) :: bytes
    integer(c_size_t) :: n

    if (self%info /= 0) return
    n = len(bytes, kind=c_size_t)
    call self%check(c_fwrite(bytes, 1_c_size_t, n, self%stream) == n, 'write')
    if (self%info == 0) call self%check(c_fflush(self%stream) == 0, 'write')
  end subroutine file_write

  !> Replace all that the file holds.
  subroutine file_rewrite(self, bytes)
    class(posix_file_t), intent(inout) :: self
    character(*), intent(in) :: bytes

    if (self%info /= 0) return
    call self%check(c_ftruncate(c_fileno(self%stream), 0_c_long) == 0, 'write')
    call self%write(bytes)
  end subroutine file_rewrite

  !> Read the next bytes, at most as many as `bytes` holds.
  subroutine file_read(self, bytes, n)
    class(posix_file_t), intent(inout) :: self
    character(:), allocatable, target, intent(inout) :: bytes
    integer, intent(out) :: n   !! how many there were; 0 at the end of the file

    n = 0
    if (self%info /= 0) return
    n = int(c_fread(c_loc(bytes), 1_c_size_t, len(bytes, kind=c_size_t), self%stream))
    call self%check(c_ferror(self%stream) == 0, 'read')
  end subroutine file_read

  !> What a short file holds now, wherever it was read or written last.
  function content(self) result(text)
    class(posix_file_t), intent(in) :: self
    character(:), allocatable :: text
    integer, parameter :: longest = 400
    character(kind=c_char), target :: letter(longest)
    integer(c_size_t) :: n

    text = ''
    if (.not. c_associated(self%stream)) return
    letter = c_null_char
    n = c_pread(c_fileno(self%stream), c_loc(letter), int(longest, c_size_t), 0_c_long)
    if (n > 0) text = text_of_letters(letter)
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
    if (c_flock(c_fileno(self%stream), merge(exclusive, shared, alone) + at_once) == 0) return
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

  !> Does a path lead to this open file, and not to another that has its name now?
  function is_at(self, path) result(yes)
    class(posix_file_t), intent(in) :: self
    character(*), intent(in) :: path
    logical :: yes

    yes = c_associated(self%stream)
    if (yes) yes = is_file_at(c_fileno(self%stream), path)
  end function is_at

  !> The same for the open file of a number: device and inode say it.
  function is_file_at(fd, path) result(yes)
    integer(c_int), intent(in) :: fd
    character(*), intent(in) :: path
    logical :: yes
    integer(c_long) :: held(stat_size), found(stat_size)

    yes = c_fstat(fd, held) == 0
    if (yes) yes = c_stat(path//c_null_char, found) == 0
    if (yes) yes = all(held(:2) == found(:2))
  end function is_file_at

end module posix_file_m
