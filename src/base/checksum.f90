!> A checksum of 64 bits of numbers and text in a given order, for restart files.
!!
!! Two sums over 32-bit words modulo the prime 2**32 + 15, the second one weighted by position: one
!! changed, lost or exchanged word always shows, other damage all but once in 2**64.
!!
!! Source: Fletcher, IEEE Trans. Commun. COM-30 (1982); the modulus is above all words, so that
!! words of zeros and of ones differ.
module checksum_m
  use, intrinsic :: iso_fortran_env, only: int32
  use kinds_m, only: wp, i8
  implicit none
  private
  public :: checksum_t

  integer, parameter :: chunk = 4096                        !! numbers turned into words at a time
  integer(i8), parameter :: modulus = 2_i8**32 + 15_i8
  integer(i8), parameter :: mask = 2_i8**32 - 1_i8

  type :: checksum_t
    integer(i8), private :: plain = 1_i8, weighted = 0_i8   !! both in 0 .. modulus - 1
  contains
    procedure :: add_reals => checksum_add_reals
    procedure :: add_integers => checksum_add_integers
    procedure :: add_text => checksum_add_text
    procedure :: text => checksum_text
    procedure, private :: add_words
  end type checksum_t

contains

  !> Add n reals of an array of any rank.
  subroutine checksum_add_reals(self, n, x)
    class(checksum_t), intent(inout) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n)
    integer :: first, last

    do first = 1, n, chunk
      last = min(first + chunk - 1, n)
      call self%add_words(transfer(x(first:last), [0_int32]))
    end do
  end subroutine checksum_add_reals

  !> Add n integers of an array of any rank.
  subroutine checksum_add_integers(self, n, x)
    class(checksum_t), intent(inout) :: self
    integer, intent(in) :: n
    integer, intent(in) :: x(n)
    integer :: first, last

    do first = 1, n, chunk
      last = min(first + chunk - 1, n)
      call self%add_words(transfer(x(first:last), [0_int32]))
    end do
  end subroutine checksum_add_integers

  !> Add a text and its length.
  subroutine checksum_add_text(self, text)
    class(checksum_t), intent(inout) :: self
    character(*), intent(in) :: text
    integer :: first, i

    call self%add_words([int(len(text), int32)])
    do first = 1, len(text), 4*chunk
      call self%add_words([(ichar(text(i:i), int32), i=first, min(first + 4*chunk - 1, len(text)))])
    end do
  end subroutine checksum_add_text

  !> Checksum so far as 18 hexadecimal digits.
  function checksum_text(self) result(text)
    class(checksum_t), intent(in) :: self
    character(18) :: text

    write (text, '(2z9.9)') self%weighted, self%plain
  end function checksum_text

  !> Add up to 2**14 words; the sums stay below 2**62 between the reductions.
  pure subroutine add_words(self, words)
    class(checksum_t), intent(inout) :: self
    integer(int32), intent(in) :: words(:)
    integer :: i

    do i = 1, size(words)
      self%plain = self%plain + iand(int(words(i), i8), mask)
      self%weighted = self%weighted + self%plain
    end do
    self%plain = modulo(self%plain, modulus)
    self%weighted = modulo(self%weighted, modulus)
  end subroutine add_words

end module checksum_m
