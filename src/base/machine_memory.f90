!> How much memory there is: of the machine, of the group of processes, of this process.
module machine_memory_m
  use, intrinsic :: iso_fortran_env, only: int8
  use kinds_m, only: i8
  implicit none
  private
  public :: available_memory, may_allocate

  character(*), parameter :: group_folder = '/sys/fs/cgroup'   !! where Linux keeps the limits

contains

  !> Memory that programs may still take [B]: what the machine has free, or the limit of the control
  !! group of this process (queues and containers set it) if that is lower; 0 where the system does
  !! not tell.
  function available_memory() result(bytes)
    integer(i8) :: bytes

    bytes = free_memory()
    if (bytes > 0) bytes = min(bytes, group_limit())
  end function available_memory

  !> Would the system give this process so much memory now? Limits of a process (`ulimit -v`) and
  !! what no machine has are seen here; a system that lends more than it has may promise too much.
  function may_allocate(bytes) result(yes)
    integer(i8), intent(in) :: bytes
    logical :: yes
    integer(int8), allocatable :: room(:)
    integer :: status

    allocate (room(bytes), stat=status)
    yes = status == 0
  end function may_allocate

  !> What the machine could give without pushing other programs out [B]; 0: unknown.
  function free_memory() result(bytes)
    integer(i8) :: bytes
    integer(i8) :: kilobytes
    character(80) :: row
    integer :: unit, status

    bytes = 0
    open (newunit=unit, file='/proc/meminfo', action='read', status='old', iostat=status)
    if (status /= 0) return
    do
      read (unit, '(a)', iostat=status) row
      if (status /= 0) exit
      if (index(row, 'MemAvailable:') /= 1) cycle
      read (row(index(row, ':') + 1:), *, iostat=status) kilobytes
      if (status == 0) bytes = 1024*kilobytes
      exit
    end do
    close (unit)
  end function free_memory

  !> The lowest limit of the control groups around this process [B]; without any the largest number.
  !! Lines of /proc/self/cgroup are number:controllers:path, without controllers in version 2.
  function group_limit() result(bytes)
    integer(i8) :: bytes
    character(4096) :: row
    character(:), allocatable :: controllers, path
    integer :: unit, status, first, second

    bytes = huge(bytes)
    open (newunit=unit, file='/proc/self/cgroup', action='read', status='old', iostat=status)
    if (status /= 0) return
    do
      read (unit, '(a)', iostat=status) row
      if (status /= 0) exit
      first = index(row, ':')
      second = first + index(row(first + 1:), ':')
      if (second <= first) cycle
      controllers = ','//row(first + 1:second - 1)//','
      path = trim(row(second + 1:))
      if (controllers == ',,') then
        bytes = min(bytes, lowest_limit(group_folder, path, 'memory.max'))
      else if (index(controllers, ',memory,') > 0) then
        bytes = min(bytes, lowest_limit(group_folder//'/memory', path, 'memory.limit_in_bytes'))
      end if
    end do
    close (unit)
  end function group_limit

  !> The lowest limit of a group and of those around it [B].
  function lowest_limit(top, path, name) result(bytes)
    character(*), intent(in) :: top, path, name
    integer(i8) :: bytes
    integer :: n

    bytes = huge(bytes)
    n = len(path)
    do while (n >= 0)
      bytes = min(bytes, number_in(top//path(:n)//'/'//name))
      if (n == 0) exit
      n = max(0, index(path(:n), '/', back=.true.) - 1)
    end do
  end function lowest_limit

  !> The number in a file; the largest one if there is none.
  function number_in(file) result(n)
    character(*), intent(in) :: file
    integer(i8) :: n
    integer(i8) :: found
    integer :: unit, status

    n = huge(n)
    open (newunit=unit, file=file, action='read', status='old', iostat=status)
    if (status /= 0) return
    read (unit, *, iostat=status) found   ! `max` is no number
    if (status == 0) n = found
    close (unit)
  end function number_in

end module machine_memory_m
