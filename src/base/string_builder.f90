!> A text that grows piece by piece, in a time that grows with its length.
module string_builder_m
  implicit none
  private
  public :: string_builder_t

  type :: string_builder_t
    private
    integer :: n = 0                         ! characters in use
    character(:), allocatable :: space
  contains
    procedure :: add, add_line
    procedure :: text => whole_text
  end type string_builder_t

contains

  !> Append a piece.
  pure subroutine add(self, piece)
    class(string_builder_t), intent(inout) :: self
    character(*), intent(in) :: piece
    character(:), allocatable :: longer

    if (.not. allocated(self%space)) allocate (character(1000) :: self%space)
    if (self%n + len(piece) > len(self%space)) then
      allocate (character(2*(self%n + len(piece))) :: longer)
      longer(:self%n) = self%space(:self%n)
      call move_alloc(longer, self%space)
    end if
    self%space(self%n + 1:self%n + len(piece)) = piece
    self%n = self%n + len(piece)
  end subroutine add

  !> Append a line.
  pure subroutine add_line(self, line)
    class(string_builder_t), intent(inout) :: self
    character(*), intent(in) :: line

    call self%add(line)
    call self%add(new_line('a'))
  end subroutine add_line

  !> All that was added.
  pure function whole_text(self) result(text)
    class(string_builder_t), intent(in) :: self
    character(:), allocatable :: text

    text = ''
    if (self%n > 0) text = self%space(:self%n)
  end function whole_text

end module string_builder_m
