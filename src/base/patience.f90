!> How long a thread spins at a barrier before it goes to sleep.
!!
!! The OpenMP library of gfortran lets waiting threads spin for milliseconds. On a machine that
!! others use too the thread waited for may not be running, and a step of many short loops takes up
!! to a hundred times as long (measured: 28 to 101 s against 0.9 s at a load of 6 to 9 on two
!! cores). The library reads its settings before the program begins, so the only way to choose a
!! short spin is to begin again.
module patience_m
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_loc, c_null_char, c_null_ptr, c_ptr
  implicit none
  private
  public :: spin_briefly

  character(*), parameter :: spin_count = '500'   !! about ten microseconds

  interface
    integer(c_int) function c_setenv(name, value, overwrite) bind(c, name='setenv')
      import :: c_char, c_int
      implicit none
      character(kind=c_char), intent(in) :: name(*), value(*)
      integer(c_int), value :: overwrite
    end function c_setenv

    integer(c_int) function c_execv(path, arguments) bind(c, name='execv')
      import :: c_char, c_int, c_ptr
      implicit none
      character(kind=c_char), intent(in) :: path(*)
      type(c_ptr), intent(in) :: arguments(*)
    end function c_execv
  end interface

contains

  !> Start the program again with a short spin, unless the user has chosen how threads wait.
  !!
  !! Call it before anything else. It returns when the choice is made, or when the system cannot
  !! start the program again (no /proc): then threads wait as the library does.
  subroutine spin_briefly()
    character(kind=c_char), allocatable, target :: text(:, :)
    type(c_ptr), allocatable :: arguments(:)
    character(:), allocatable :: word
    integer :: i, j, n, length, longest

    if (is_set('OMP_WAIT_POLICY')) return
    if (is_set('GOMP_SPINCOUNT')) return
    if (c_setenv('GOMP_SPINCOUNT'//c_null_char, spin_count//c_null_char, 1_c_int) /= 0) return
    n = command_argument_count()
    longest = 0
    do i = 0, n
      call get_command_argument(i, length=length)
      longest = max(longest, length)
    end do
    allocate (text(longest + 1, 0:n), source=c_null_char)
    allocate (arguments(0:n + 1))
    allocate (character(longest) :: word)
    do i = 0, n
      call get_command_argument(i, word, length)
      do j = 1, length
        text(j, i) = word(j:j)
      end do
      arguments(i) = c_loc(text(1, i))
    end do
    arguments(n + 1) = c_null_ptr
    if (c_execv('/proc/self/exe'//c_null_char, arguments) /= 0) return   ! it goes on as it is
  end subroutine spin_briefly

  !> Is there an environment variable of this name?
  function is_set(name) result(yes)
    character(*), intent(in) :: name
    logical :: yes
    integer :: status

    call get_environment_variable(name, status=status)
    yes = status == 0
  end function is_set

end module patience_m
