!> A result file that is held open, and space on the disk for what is about to be written to it.
!!
!! A file is cut, lengthened and deleted as the one that is held: its path may lead to a file of
!! another run by now, where somebody has moved the folder.
!!
!! HDF5 keeps the structure of a file in memory and changes it in place when the file is flushed. A
!! disk that is full in the middle of that leaves pieces that point to others which are not there.
!! So the end of the file is made longer first, with zeros, by as much as a row or a frame can need:
!! if that fails nothing has been touched, and otherwise nothing that follows can fail for want of
!! space. HDF5 cuts off most of what it did not need when it flushes.
module file_space_m
  use, intrinsic :: iso_c_binding, only: c_int, c_long, c_null_char
  use kinds_m, only: i8
  use c_library_m, only: c_close, c_dup, c_fsync, c_ftruncate, c_lseek, c_open, c_unlink
  use posix_file_m, only: is_file_at, all_written, system_reason
  implicit none
  private
  public :: held_file_t, bytes_for_chunks

  integer(i8), parameter, public :: bytes_for_change = 8192
  !! attributes, headers and ends of blocks that a row or a frame may touch [bytes]

  type :: held_file_t
    character(:), allocatable :: path
    integer(c_int), private :: fd = -1   !! its number in this process; -1: none is held
  contains
    procedure :: hold, length, lengthen, shorten, store, discard, let_go
  end type held_file_t

contains

  !> Hold a file that was just opened for writing: that of a number, or else that of the path.
  subroutine hold(self, path, message, number)
    class(held_file_t), intent(inout) :: self
    character(*), intent(in) :: path
    character(:), allocatable, intent(out) :: message   !! reason of an error, else empty
    integer(c_int), intent(in), optional :: number
    integer(c_int), parameter :: read_and_write = 2

    self%path = path
    message = ''
    if (present(number)) then
      self%fd = c_dup(number)
    else
      self%fd = c_open(path//c_null_char, read_and_write)
    end if
    if (self%fd < 0) message = 'cannot open the file: '//system_reason()
  end subroutine hold

  !> Bytes of the file.
  function length(self) result(bytes)
    class(held_file_t), intent(in) :: self
    integer(i8) :: bytes
    integer(c_int), parameter :: from_end = 2

    bytes = int(c_lseek(self%fd, 0_c_long, from_end), i8)
  end function length

  !> Make the file at least `wanted` bytes long; one for which there is no room stays as it was.
  subroutine lengthen(self, wanted, message)
    class(held_file_t), intent(in) :: self
    integer(i8), intent(in) :: wanted                   !! [bytes]
    character(:), allocatable, intent(out) :: message   !! reason of an error, else empty
    integer(i8), parameter :: piece = 2**20
    integer(i8) :: before, there

    message = ''
    before = self%length()
    do there = before, wanted - 1, piece
      if (all_written(self%fd, there, repeat(char(0), int(min(wanted - there, piece))))) cycle
      message = 'cannot write: '//system_reason()
      call self%shorten(before)
      return
    end do
  end subroutine lengthen

  !> Cut off what the file has beyond `wanted`.
  subroutine shorten(self, wanted)
    class(held_file_t), intent(in) :: self
    integer(i8), intent(in) :: wanted   !! [bytes]

    if (self%length() <= wanted) return
    if (c_ftruncate(self%fd, int(wanted, c_long)) /= 0) return   ! it stays as it is
  end subroutine shorten

  !> Have the system write all that it still keeps of the file to the disk; only then is it known
  !! that the file is there, and that it will be after a power cut.
  subroutine store(self, message)
    class(held_file_t), intent(in) :: self
    character(:), allocatable, intent(out) :: message   !! reason of an error, else empty

    message = ''
    if (c_fsync(self%fd) /= 0) message = 'cannot store: '//system_reason()
  end subroutine store

  !> Delete the file; it gives its room back at once.
  subroutine discard(self)
    class(held_file_t), intent(inout) :: self

    if (self%fd < 0) return
    call self%shorten(0_i8)
    if (is_file_at(self%fd, self%path)) then
      if (c_unlink(self%path//c_null_char) /= 0) continue   ! nothing more can be done
    end if
    call self%let_go()
  end subroutine discard

  subroutine let_go(self)
    class(held_file_t), intent(inout) :: self

    if (self%fd < 0) return
    if (c_close(self%fd) /= 0) continue   ! all that was to be said of it has been said
    self%fd = -1
  end subroutine let_go

  !> Most that new chunks of a dataset take at the end of a file [bytes].
  !!
  !! A compressed chunk that does not become smaller is stored as it is, and before it there is a
  !! short one of fill values. The index is a B-tree whose nodes hold 32 to 64 entries, all in one
  !! while there are few; later every level may split a node besides the new leaves. Source: HDF5
  !! File Format Specification 2.0, III.A.
  pure function bytes_for_chunks(chunk_bytes, compressed, old, new, rank) result(bytes)
    integer(i8), intent(in) :: chunk_bytes   !! of one chunk
    logical, intent(in) :: compressed
    integer(i8), intent(in) :: old, new      !! chunks that are there, and that will come
    integer, intent(in) :: rank              !! of the dataset
    integer(i8) :: bytes
    integer, parameter :: deepest = 8   ! levels of the tree, and splits of a leaf
    integer(i8) :: nodes

    bytes = new*chunk_bytes
    if (new == 0) return
    if (compressed) bytes = bytes + new*(chunk_bytes/32 + 512)
    nodes = 1
    if (old + new >= 64) nodes = deepest + new/16
    bytes = bytes + nodes*(24 + 64*8 + 65*(8 + 8*(rank + 1)))
  end function bytes_for_chunks

end module file_space_m
