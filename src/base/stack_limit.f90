!> How large the stacks of a process and of its threads may grow, and whether that is enough.
!!
!! Cases of `input` take up to 48 kB of either (gfortran 12). A stack that is too small ends a
!! program without a word, so this is asked first.
module stack_limit_m
  use, intrinsic :: iso_c_binding, only: c_int, c_long
  use kinds_m, only: i8
  use c_library_m, only: c_getrlimit
  use errors_m, only: problems_t, to_text
  use value_text_m, only: lower_case, quoted_text, parse_integer, value_ok
  implicit none
  private
  public :: check_stack

  integer(i8), parameter :: kilobyte = 1024_i8
  integer(i8), parameter :: min_stack = 64*kilobyte    !! of the process or a thread [B]

contains

  !> Add a problem for each stack that is too small; none where the system does not report it.
  subroutine check_stack(problems)
    type(problems_t), intent(inout) :: problems
    integer(c_int), parameter :: rlimit_stack = 3_c_int   ! on Linux
    character(*), parameter :: names(2) = ['OMP_STACKSIZE ', 'GOMP_STACKSIZE']   ! the first rules
    integer(c_long) :: limit(2)
    character(64) :: text
    integer(i8) :: bytes
    integer :: i, status

    limit = -1
    if (c_getrlimit(rlimit_stack, limit) /= 0) limit = -1
    if (limit(1) >= 0 .and. limit(1) < min_stack) call problems%add_message('ulimit -s ' &
      //to_text(int(limit(1)/kilobyte))//': the stack is too small, the program needs at least ' &
      //to_text(int(min_stack/kilobyte))//' kB; 8192 is usual')
    do i = 1, size(names)
      call get_environment_variable(trim(names(i)), text, status=status)
      if (status /= 0) cycle
      bytes = stack_bytes(text)
      if (bytes >= 0 .and. bytes < min_stack) call problems%add_message( &
        'environment variable '//trim(names(i))//' = '//quoted_text(trim(text)) &
        //': the stack of a thread is too small, it needs at least ' &
        //to_text(int(min_stack/kilobyte))//'k; without the variable it has that of ulimit -s')
      return
    end do
  end subroutine check_stack

  !> What a text of `OMP_STACKSIZE` means [B]: a whole number with B, K, M or G, K if none; -1 if it
  !! is not one, which the library ignores.
  pure function stack_bytes(text) result(bytes)
    character(*), intent(in) :: text
    integer(i8) :: bytes
    character(:), allocatable :: word
    integer :: n, info, power

    bytes = -1
    word = trim(adjustl(lower_case(text)))
    if (len(word) == 0) return
    power = index('bkmg', word(len(word):)) - 1
    if (power >= 0) word = trim(word(:len(word) - 1))
    if (power < 0) power = 1
    if (len(word) == 0) return
    n = 0
    call parse_integer(word, n, info)
    if (info == value_ok .and. n >= 0) bytes = n*kilobyte**power
  end function stack_bytes

end module stack_limit_m
