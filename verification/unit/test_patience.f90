!> The program begins again with its own spin and pages and the same arguments, unless the user has
!! chosen how threads wait and tuned glibc, and leaves its cores to others. It calls itself: with
!! arguments it is the program that begins again.
program test_patience
  use kinds_m, only: wp
  use omp_lib, only: omp_get_max_threads, omp_get_num_procs
  use check_m, only: check, finish_checks
  use patience_m, only: choose_spin_and_pages, share_cores, fair_threads, threads_used
  implicit none
  character(*), parameter :: pages = '-u GLIBC_TUNABLES '

  if (command_argument_count() > 0) then
    call begin_again()
  else
    call check_shares()
    call check('a short spin', &
      status_of(pages//'-u OMP_WAIT_POLICY -u GOMP_SPINCOUNT', 'short'), 0)
    call check('the user''s policy', &
      status_of(pages//'-u GOMP_SPINCOUNT OMP_WAIT_POLICY=active', 'none'), 0)
    call check('the user''s count', &
      status_of(pages//'-u OMP_WAIT_POLICY GOMP_SPINCOUNT=7', 'count'), 0)
    call check('the user''s glibc', &
      status_of('-u OMP_WAIT_POLICY -u GOMP_SPINCOUNT GLIBC_TUNABLES=mine', 'tuned'), 0)
    call check('all of the user', &
      status_of('OMP_WAIT_POLICY=active GOMP_SPINCOUNT=7 GLIBC_TUNABLES=mine', 'all'), 0)
    call check('never twice', status_of(pages//'-u OMP_WAIT_POLICY -u GOMP_SPINCOUNT ' &
                                        //'MICS_BEGAN_AGAIN=1', 'again'), 0)
  end if
  call finish_checks()

contains

  !> Each running thread of the machine has a core, as far as one thread of ours allows.
  subroutine check_shares()
    real(wp) :: mean
    integer :: most, all_of_us

    all_of_us = omp_get_max_threads()
    call check('nobody else', fair_threads(2, 2, 2, 2), 2)
    call check('one other', fair_threads(2, 2, 3, 2), 1)
    call check('many others', fair_threads(8, 8, 30, 8), 1)
    call check('the other has gone', fair_threads(1, 2, 1, 2), 2)
    call check('the other is still there', fair_threads(1, 2, 2, 2), 1)
    call check('never more than wanted', fair_threads(3, 4, 3, 64), 4)
    call threads_used(mean, most)
    call check('before the first look', mean, real(most, wp), 1.0e-12_wp)
    call keep_busy(omp_get_num_procs())
    call share_cores()
    call share_cores()
    call check('a moment of others counts for nothing', omp_get_max_threads(), all_of_us)
    call share_cores()
    call check('others that stay get cores', omp_get_max_threads(), 1)
    call threads_used(mean, most)
    call check('all were wanted', most, all_of_us)
    call check('all worked so far', mean, real(all_of_us, wp), 1.0e-12_wp)
  end subroutine check_shares

  !> Start n programs that do nothing but compute for half a second.
  subroutine keep_busy(n)
    integer, intent(in) :: n
    integer :: i

    do i = 1, n
      call execute_command_line('timeout 0.5 sh -c "while :; do :; done" &')
    end do
    call execute_command_line('sleep 0.2')   ! they are starting
  end subroutine keep_busy

  !> Exit code of this program with arguments, among them one with blanks and one without letters.
  function status_of(settings, wanted) result(status)
    character(*), intent(in) :: settings, wanted
    integer :: status
    character(4096) :: program

    call get_command_argument(0, program)
    call execute_command_line('env -u MICS_BEGAN_AGAIN '//settings//' "'//trim(program)//'" ' &
      //wanted//' "two words" "" > /dev/null', exitstat=status)
  end function status_of

  !> What a program finds once it has called choose_spin_and_pages: a spin and pages that are set
  !! only where the user has said nothing, the spin far below the 300000 of the library, and its
  !! arguments.
  subroutine begin_again()
    character(30) :: wanted, count, tuned
    integer :: length, info, spins

    call choose_spin_and_pages()
    call get_command_argument(1, wanted)
    call get_environment_variable('GOMP_SPINCOUNT', count, status=info)
    call get_environment_variable('GLIBC_TUNABLES', tuned)
    select case (wanted)
    case ('short', 'none', 'count')
      call check('large pages', index(tuned, 'hugetlb=1') > 0)
    case ('again')
      call check('no pages', len_trim(tuned), 0)
    case default
      call check('tuned as it was', tuned == 'mine')
    end select
    select case (wanted)
    case ('short', 'tuned')
      call check('is set', info, 0)
      read (count, *) spins
      call check('is short', spins > 0 .and. spins <= 30000)
    case ('none', 'again')
      call check('is not set', info, 1)
    case ('count', 'all')
      call check('stays', info == 0 .and. count == '7')
    case default
      call check('called as it should be', .false.)
    end select
    call check('three arguments', command_argument_count(), 3)
    call get_command_argument(2, wanted, length)
    call check('one with a blank', wanted == 'two words' .and. length == 9)
    call get_command_argument(3, length=length)
    call check('one without letters', length, 0)
  end subroutine begin_again

end program test_patience
