!> How threads and processes wait for one another, how many threads work while other programs want
!! the cores, and in which pages memory comes.
!!
!! A step is some hundreds of short loops. A thread that sleeps at the end of one must be woken for
!! the next (measured, two threads on two idle cores: 105 ms a step, 57 with a spin of a
!! millisecond, 82 with one thread). A thread that spins while the one waited for is not running
!! keeps it from running (with two other programs there: 460 ms a step, 113 with one thread). So
!! waiting threads spin for about a millisecond, and go on as fewer while there are more running
!! threads on the machine than cores. The number of threads never changes a result.
!!
!! A step runs through some hundred arrays. In pages of 4 kB the processor forgets where they lie;
!! in large ones (2 MB) a step of the main job takes 7 % less CPU. The system gives large pages to
!! those that ask, and glibc asks when it is told to.
!!
!! The libraries of gfortran and of C read both choices before the program begins, so the only way
!! to make them is to begin again.
!!
!! Processes wait in MPI, which asks again and again without giving the core away unless it was told
!! that there are too few cores; what it is told is often wrong, and it knows nothing of other
!! programs. So they always give it away. Measured on two cores with other programs there, a short
!! run in three processes that MPI was told twelve cores for: 5 s, and not done after 60 s without.
module patience_m
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_loc, c_long, c_null_char, c_null_ptr, &
    c_ptr
  use kinds_m, only: wp, i8
  use machine_memory_m, only: may_allocate
  use timers_m, only: wall_clock
  use omp_lib, only: omp_get_max_threads, omp_set_num_threads
  implicit none
  private
  public :: choose_spin_and_pages, choose_messages, share_cores, fair_threads, threads_used

  character(*), parameter :: spin_count = '20000'   !! about a millisecond
  character(*), parameter :: large_pages = 'glibc.malloc.hugetlb=1'
  integer(i8), parameter :: room_for_pages = 100000000_i8
    !! a process that may not have so much gets no large pages: their edges alone would fill it [B]
  character(*), parameter :: largest_layer = '65536'
    !! that is sent at once [bytes]; larger ones wait until the receiver asks for them
  real(wp), parameter :: look_interval = 1.0_wp     !! between two looks at the machine [s]
  integer, parameter :: glances = 3                 !! of which a look is the least, a step apart

  integer :: wanted = 0               !! threads that work when nobody else does; 0: not yet known
  real(wp) :: last_look = 0.0_wp      !! wall clock at its first glance [s]
  integer :: glances_taken = 0        !! of the look at hand
  integer :: least_running = 0        !! threads of all programs seen by these
  real(wp) :: began = 0.0_wp          !! wall clock at the first call [s]
  real(wp) :: last_call = 0.0_wp      !! likewise [s]
  real(wp) :: thread_time = 0.0_wp    !! threads at work times wall time, up to the last call [s]

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

    integer(c_long) function c_sysconf(name) bind(c, name='sysconf')
      import :: c_int, c_long
      implicit none
      integer(c_int), value :: name
    end function c_sysconf
  end interface

contains

  !> Start the program again with the spin and the pages of above, unless the user has chosen how
  !! threads wait and tuned glibc.
  !!
  !! Call it before anything else. It returns when the choices are made, or when the system cannot
  !! start the program again (no /proc): then the libraries do as they do.
  subroutine choose_spin_and_pages()
    character(*), parameter :: began_again = 'MICS_BEGAN_AGAIN'   ! never twice, whatever is kept
    character(kind=c_char), allocatable, target :: text(:, :)
    type(c_ptr), allocatable :: arguments(:)
    character(:), allocatable :: word
    logical :: waits, tuned   ! the user's own, or better left alone
    integer(c_int) :: status
    integer :: i, j, n, length, longest

    if (is_set(began_again)) return
    waits = is_set('OMP_WAIT_POLICY')
    if (.not. waits) waits = is_set('GOMP_SPINCOUNT')
    tuned = is_set('GLIBC_TUNABLES')
    if (.not. tuned) tuned = is_set('OMPI_COMM_WORLD_SIZE')   ! many small processes fill them badly
    if (.not. tuned) tuned = .not. may_allocate(room_for_pages)
    if (waits .and. tuned) return
    status = c_setenv(began_again//c_null_char, '1'//c_null_char, 1_c_int)
    if (status /= 0) return
    if (.not. waits) then
      status = c_setenv('GOMP_SPINCOUNT'//c_null_char, spin_count//c_null_char, 1_c_int)
    end if
    if (.not. tuned) then
      status = c_setenv('GLIBC_TUNABLES'//c_null_char, large_pages//c_null_char, 1_c_int)
    end if
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
  end subroutine choose_spin_and_pages

  !> Let a process that waits for another one give its core away, and let layers go without asking
  !! the other process first, unless the environment says otherwise. Call it before MPI begins. The
  !! names are Open MPI's; other libraries have no such choice. Where it cannot be set MPI does as
  !! it does.
  subroutine choose_messages()
    character(*), parameter :: yield = 'OMPI_MCA_mpi_yield_when_idle', &
      eager(2) = [character(31) :: 'OMPI_MCA_btl_vader_eager_limit', 'OMPI_MCA_btl_sm_eager_limit']
      ! of Open MPI 4 and 5, where either means the same
    integer(c_int) :: status
    integer :: i

    if (.not. is_set(yield)) status = c_setenv(yield//c_null_char, '1'//c_null_char, 1_c_int)
    do i = 1, size(eager)
      if (is_set(trim(eager(i)))) return
    end do
    do i = 1, size(eager)
      status = c_setenv(trim(eager(i))//c_null_char, largest_layer//c_null_char, 1_c_int)
    end do
  end subroutine choose_messages

  !> Let fewer threads work while other programs run on their cores, and all of them afterwards.
  !! Call it every step, outside parallel regions: once a second it looks at the machine. A program
  !! that runs only for a moment, as one that reads the line just printed, counts for nothing.
  subroutine share_cores()
    integer, parameter :: sc_nprocessors_onln = 84   !! of sysconf, on Linux
    integer :: n, cores
    real(wp) :: now

    n = omp_get_max_threads()
    now = wall_clock()
    if (wanted == 0) then
      wanted = n
      began = now
      last_call = now
      last_look = now - look_interval
    end if
    thread_time = thread_time + n*(now - last_call)
    last_call = now
    if (wanted == 1) return
    if (glances_taken == 0) then
      if (now - last_look < look_interval) return
      last_look = now
      least_running = huge(least_running)
    end if
    glances_taken = modulo(glances_taken + 1, glances)
    least_running = min(least_running, running_threads())
    if (glances_taken > 0) return
    cores = int(c_sysconf(sc_nprocessors_onln))
    if (cores == 0 .or. least_running == 0) return
    call omp_set_num_threads(fair_threads(n, wanted, least_running, cores))
  end subroutine share_cores

  !> Threads that leave each other running thread a core: n of those now running are ours.
  pure function fair_threads(n, wanted, running, cores) result(fair)
    integer, intent(in) :: n         !! threads of this program now
    integer, intent(in) :: wanted    !! most of them
    integer, intent(in) :: running   !! threads that run or wait for a core, of all programs
    integer, intent(in) :: cores
    integer :: fair

    fair = max(1, min(wanted, n + cores - running))
  end function fair_threads

  !> Threads of all programs that run or wait for a core, our own team among them; 0 where the
  !! system does not tell.
  function running_threads() result(running)
    integer :: running, unit, info, slash
    character(80) :: line

    running = 0
    open (newunit=unit, file='/proc/loadavg', action='read', status='old', iostat=info)
    if (info /= 0) return
    !$omp parallel
    !$omp barrier   ! all of the team are awake, and spin while the file is read
    !$omp end parallel
    read (unit, '(a)', iostat=info) line
    close (unit)
    if (info /= 0) return
    slash = index(line, '/')        ! 0.31 0.22 0.20 2/91 4711
    if (slash == 0) return
    read (line(index(line(:slash), ' ', back=.true.) + 1:slash - 1), *, iostat=info) running
    if (info /= 0) running = 0
  end function running_threads

  !> How many threads worked since the first call, weighted by wall time, and how many were to.
  subroutine threads_used(mean, most)
    real(wp), intent(out) :: mean
    integer, intent(out) :: most

    most = merge(wanted, omp_get_max_threads(), wanted > 0)
    mean = most
    if (last_call > began) mean = thread_time/(last_call - began)
  end subroutine threads_used

  !> Is there an environment variable of this name?
  function is_set(name) result(yes)
    character(*), intent(in) :: name
    logical :: yes
    integer :: status

    call get_environment_variable(name, status=status)
    yes = status == 0
  end function is_set

end module patience_m
