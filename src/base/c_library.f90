!> The functions of the C library and of POSIX that this program calls, and texts of C.
module c_library_m
  use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_funptr, c_int, c_long, &
    c_null_char, c_ptr, c_size_t
  use system_m, only: c_errno_place
  implicit none
  private
  public :: c_close, c_closedir, c_dup, c_errno, c_exit, c_faccessat, c_fclose, c_fileno, &
    c_flock, c_fopen, c_fstat, c_fsync, c_ftruncate, c_gethostname, c_getpid, c_getrlimit, &
    c_isatty, c_lseek, c_mkdir, c_open, c_opendir, c_pread, c_pwrite, c_read, c_readdir, &
    c_rename, c_renameat, c_setenv, c_signal, c_stat, c_strerror, c_unlink, &
    c_unlinkat, c_usleep
  public :: text_at, text_of_letters

  integer, parameter, public :: stat_size = 64    !! longs, more than any system writes

  interface
    ! Streams.
    type(c_ptr) function c_fopen(path, mode) bind(c, name='fopen')
      import :: c_char, c_ptr
      implicit none
      character(kind=c_char), intent(in) :: path(*), mode(*)
    end function c_fopen

    integer(c_int) function c_fclose(stream) bind(c, name='fclose')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: stream
    end function c_fclose

    integer(c_int) function c_fileno(stream) bind(c, name='fileno')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: stream
    end function c_fileno

    ! Files by their numbers and paths; off_t is a long.
    integer(c_int) function c_open(path, flags) bind(c, name='open')
      import :: c_char, c_int
      implicit none
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: flags
    end function c_open

    integer(c_int) function c_close(fd) bind(c, name='close')
      import :: c_int
      implicit none
      integer(c_int), value :: fd
    end function c_close

    integer(c_long) function c_lseek(fd, offset, whence) bind(c, name='lseek')
      import :: c_int, c_long
      implicit none
      integer(c_int), value :: fd, whence
      integer(c_long), value :: offset
    end function c_lseek

    integer(c_int) function c_flock(fd, operation) bind(c, name='flock')
      import :: c_int
      implicit none
      integer(c_int), value :: fd, operation
    end function c_flock

    integer(c_int) function c_fsync(fd) bind(c, name='fsync')
      import :: c_int
      implicit none
      integer(c_int), value :: fd
    end function c_fsync

    integer(c_int) function c_isatty(fd) bind(c, name='isatty')
      import :: c_int
      implicit none
      integer(c_int), value :: fd
    end function c_isatty

    integer(c_int) function c_ftruncate(fd, length) bind(c, name='ftruncate')
      import :: c_int, c_long
      implicit none
      integer(c_int), value :: fd
      integer(c_long), value :: length
    end function c_ftruncate

    integer(c_int) function c_dup(fd) bind(c, name='dup')
      import :: c_int
      implicit none
      integer(c_int), value :: fd
    end function c_dup

    integer(c_size_t) function c_read(fd, buffer, count) bind(c, name='read')
      import :: c_char, c_int, c_size_t
      implicit none
      integer(c_int), value :: fd
      integer(c_size_t), value :: count
      character(kind=c_char), intent(inout) :: buffer(count)
    end function c_read

    integer(c_size_t) function c_pread(fd, buffer, count, offset) bind(c, name='pread')
      import :: c_char, c_int, c_long, c_size_t
      implicit none
      integer(c_int), value :: fd
      integer(c_size_t), value :: count
      character(kind=c_char), intent(inout) :: buffer(count)
      integer(c_long), value :: offset
    end function c_pread

    integer(c_size_t) function c_pwrite(fd, buffer, count, offset) bind(c, name='pwrite')
      import :: c_char, c_int, c_long, c_size_t
      implicit none
      integer(c_int), value :: fd
      character(kind=c_char), intent(in) :: buffer(*)
      integer(c_size_t), value :: count
      integer(c_long), value :: offset
    end function c_pwrite

    ! What the system knows of a file; it begins with its device and its number there (inode).
    integer(c_int) function c_stat(path, found) bind(c, name='stat')
      import :: c_char, c_int, c_long, stat_size
      implicit none
      character(kind=c_char), intent(in) :: path(*)
      integer(c_long), intent(out) :: found(stat_size)
    end function c_stat

    integer(c_int) function c_fstat(fd, found) bind(c, name='fstat')
      import :: c_int, c_long, stat_size
      implicit none
      integer(c_int), value :: fd
      integer(c_long), intent(out) :: found(stat_size)
    end function c_fstat

    ! Files of an open folder, wherever that has been moved.
    integer(c_int) function c_faccessat(folder, name, mode, flags) bind(c, name='faccessat')
      import :: c_char, c_int
      implicit none
      integer(c_int), value :: folder, mode, flags
      character(kind=c_char), intent(in) :: name(*)
    end function c_faccessat

    integer(c_int) function c_unlinkat(folder, name, flags) bind(c, name='unlinkat')
      import :: c_char, c_int
      implicit none
      integer(c_int), value :: folder, flags
      character(kind=c_char), intent(in) :: name(*)
    end function c_unlinkat

    integer(c_int) function c_renameat(folder, from, to_folder, to) bind(c, name='renameat')
      import :: c_char, c_int
      implicit none
      integer(c_int), value :: folder, to_folder
      character(kind=c_char), intent(in) :: from(*), to(*)
    end function c_renameat

    integer(c_int) function c_unlink(path) bind(c, name='unlink')
      import :: c_char, c_int
      implicit none
      character(kind=c_char), intent(in) :: path(*)
    end function c_unlink

    integer(c_int) function c_rename(from, to) bind(c, name='rename')
      import :: c_char, c_int
      implicit none
      character(kind=c_char), intent(in) :: from(*), to(*)
    end function c_rename

    ! Folders; mode_t is passed like an int.
    integer(c_int) function c_mkdir(path, mode) bind(c, name='mkdir')
      import :: c_char, c_int
      implicit none
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: mode
    end function c_mkdir

    type(c_ptr) function c_opendir(path) bind(c, name='opendir')
      import :: c_char, c_ptr
      implicit none
      character(kind=c_char), intent(in) :: path(*)
    end function c_opendir

    type(c_ptr) function c_readdir(folder) bind(c, name='readdir')
      import :: c_ptr
      implicit none
      type(c_ptr), value :: folder
    end function c_readdir

    integer(c_int) function c_closedir(folder) bind(c, name='closedir')
      import :: c_int, c_ptr
      implicit none
      type(c_ptr), value :: folder
    end function c_closedir

    ! The process and its system.
    integer(c_int) function c_getpid() bind(c, name='getpid')
      import :: c_int
      implicit none
    end function c_getpid

    integer(c_int) function c_gethostname(name, length) bind(c, name='gethostname')
      import :: c_int, c_ptr, c_size_t
      implicit none
      type(c_ptr), value :: name
      integer(c_size_t), value :: length
    end function c_gethostname

    integer(c_int) function c_setenv(name, value, overwrite) bind(c, name='setenv')
      import :: c_char, c_int
      implicit none
      character(kind=c_char), intent(in) :: name(*), value(*)
      integer(c_int), value :: overwrite
    end function c_setenv

    integer(c_int) function c_getrlimit(resource, limit) bind(c, name='getrlimit')
      import :: c_int, c_long
      implicit none
      integer(c_int), value :: resource
      integer(c_long), intent(out) :: limit(2)   !! now, at most; -1: none [B]
    end function c_getrlimit

    integer(c_int) function c_usleep(microseconds) bind(c, name='usleep')
      import :: c_int
      implicit none
      integer(c_int), value :: microseconds
    end function c_usleep

    type(c_funptr) function c_signal(number, handler) bind(c, name='signal')
      import :: c_funptr, c_int
      implicit none
      integer(c_int), value :: number
      type(c_funptr), value :: handler
    end function c_signal

    subroutine c_exit(code) bind(c, name='exit')
      import :: c_int
      implicit none
      integer(c_int), value :: code
    end subroutine c_exit

    type(c_ptr) function c_strerror(number) bind(c, name='strerror')
      import :: c_int, c_ptr
      implicit none
      integer(c_int), value :: number
    end function c_strerror

    integer(c_size_t) function c_strlen(text) bind(c, name='strlen')
      import :: c_ptr, c_size_t
      implicit none
      type(c_ptr), value :: text
    end function c_strlen
  end interface

contains

  !> Number of the last error of a call of C.
  function c_errno() result(number)
    integer(c_int) :: number
    integer(c_int), pointer :: last

    call c_f_pointer(c_errno_place(), last)
    number = last
  end function c_errno

  !> The text that begins at an address, up to its null character.
  function text_at(start) result(text)
    type(c_ptr), intent(in) :: start
    character(:), allocatable :: text
    character(kind=c_char), pointer :: letter(:)

    call c_f_pointer(start, letter, [c_strlen(start)])
    text = text_of_letters(letter)
  end function text_at

  !> The text of letters up to the first null character.
  pure function text_of_letters(letter) result(text)
    character(kind=c_char), intent(in) :: letter(:)
    character(:), allocatable :: text
    integer :: i, n

    n = findloc(letter == c_null_char, .true., 1) - 1
    if (n < 0) n = size(letter)
    allocate (character(n) :: text)
    do i = 1, n
      text(i:i) = letter(i)
    end do
  end function text_of_letters

end module c_library_m
