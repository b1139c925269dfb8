!> Sizes of stacks as OMP_STACKSIZE may write them.
module test_stack_limit_m
  use check_m, only: check
  use errors_m, only: problems_t
  use stack_limit_m, only: stack_bytes, check_stack
  implicit none
  private
  public :: test_stack_limit

contains

  subroutine test_stack_limit()
    call size_of('16', 16384)
    call size_of('16k', 16384)
    call size_of(' 16 K ', 16384)
    call size_of('16384B', 16384)
    call size_of('2m', 2097152)
    call size_of('1G', 1073741824)
    call size_of('0', 0)
    call size_of('', -1)
    call size_of('k', -1)
    call size_of('-1', -1)
    call size_of('1.5M', -1)
    call size_of('16kb', -1)
    call here()
  end subroutine test_stack_limit

  subroutine size_of(text, bytes)
    character(*), intent(in) :: text
    integer, intent(in) :: bytes

    call check('size "'//text//'"', int(stack_bytes(text)), bytes)
  end subroutine size_of

  !> The stack of this program is large enough.
  subroutine here()
    type(problems_t) :: problems

    call check_stack(problems)
    call check('stack of the test', problems%n, 0)
  end subroutine here

end module test_stack_limit_m
