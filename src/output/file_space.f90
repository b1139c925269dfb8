!> Space on the disk for what is about to be written.
!!
!! HDF5 keeps the structure of a file in memory and changes it in place when the file is flushed. A
!! disk that is full in the middle of that leaves pieces that point to others which are not there.
!! So the end of the file is made longer first, with zeros, by as much as a row or a frame can need:
!! if that fails nothing has been touched, and otherwise nothing that follows can fail for want of
!! space. HDF5 cuts off most of what it did not need when it flushes.
module file_space_m
  use kinds_m, only: i8
  use posix_file_m, only: posix_file_t, cut_file
  implicit none
  private
  public :: lengthen_file, shorten_file, bytes_for_chunks

  integer(i8), parameter, public :: bytes_for_change = 8192
  !! attributes, headers and ends of blocks that a row or a frame may touch [bytes]

contains

  !> Make a file at least `length` bytes long; one for which there is no room stays as it was.
  subroutine lengthen_file(path, length, message)
    character(*), intent(in) :: path
    integer(i8), intent(in) :: length                   !! [bytes]
    character(:), allocatable, intent(out) :: message   !! of an error, else empty
    integer, parameter :: piece = 2**20
    type(posix_file_t) :: file
    character(:), allocatable :: zeros
    integer(i8) :: before, there

    message = ''
    inquire (file=path, size=before)
    if (before >= length) return
    zeros = repeat(char(0), int(min(length - before, int(piece, i8))))
    call file%open(path, 'a')
    there = before
    do while (there < length .and. file%info == 0)
      call file%write(zeros(:int(min(length - there, int(piece, i8)))))
      there = there + piece
    end do
    call file%close()
    if (file%info == 0) return
    call cut_file(path, before)
    message = file%message
  end subroutine lengthen_file

  !> Cut off what a file has beyond `length`.
  subroutine shorten_file(path, length)
    character(*), intent(in) :: path
    integer(i8), intent(in) :: length   !! [bytes]
    integer(i8) :: now

    inquire (file=path, size=now)
    if (now > length) call cut_file(path, length)
  end subroutine shorten_file

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
    integer(i8) :: nodes, n

    bytes = new*chunk_bytes
    if (new == 0) return
    if (compressed) bytes = bytes + new*(chunk_bytes/32 + 512)
    nodes = 1
    n = (old + new)/64
    if (n > 0) nodes = 2 + new/16
    do while (n > 0)
      nodes = nodes + 1
      n = n/32
    end do
    bytes = bytes + nodes*(24 + 64*8 + 65*(8 + 8*(rank + 1)))
  end function bytes_for_chunks

end module file_space_m
