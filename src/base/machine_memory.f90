!> How much memory there is: of the machine, of the group of processes, of this process.
module machine_memory_m
  use kinds_m, only: i8
  implicit none
  private
  public :: available_memory, memory_limit

  character(*), parameter :: group_folder = '/sys/fs/cgroup'   !! where Linux keeps the limits

contains

  !> Memory that programs may still take [B]: what the machine has free, or the limit of the control
  !! group of this process (queues and containers set it) if that is lower; 0 where the system does
  !! not report it.
  function available_memory() result(bytes)
    integer(i8) :: bytes

    bytes = 1024*number_after('MemAvailable:', '/proc/meminfo', 0_i8)
    if (bytes > 0) bytes = min(bytes, group_limit())
  end function available_memory

  !> The most that this process can ever hold [B]: all memory of the machine, swap space included,
  !! or the limit of its address space (`ulimit -v`) if that is lower; the largest number where the
  !! system does not report it.
  function memory_limit() result(bytes)
    integer(i8) :: bytes
    integer(i8) :: memory

    bytes = number_after('Max address space', '/proc/self/limits', huge(bytes))
    memory = number_after('MemTotal:', '/proc/meminfo', 0_i8)
    if (memory > 0) bytes = min(bytes, 1024*(memory &
                                             + number_after('SwapTotal:', '/proc/meminfo', 0_i8)))
  end function memory_limit

  !> The number after a name at the beginning of a row of a file, or `otherwise`.
  function number_after(name, file, otherwise) result(number)
    character(*), intent(in) :: name   !! empty: the number in the first row
    character(*), intent(in) :: file
    integer(i8), intent(in) :: otherwise
    integer(i8) :: number
    integer(i8) :: found
    character(120) :: row
    integer :: unit, status

    number = otherwise
    open (newunit=unit, file=file, action='read', status='old', iostat=status)
    if (status /= 0) return
    do
      read (unit, '(a)', iostat=status) row
      if (status /= 0) exit
      if (index(row, name) /= 1) cycle
      read (row(len(name) + 1:), *, iostat=status) found   ! `max`, `unlimited` are no numbers
      if (status == 0) number = found
      exit
    end do
    close (unit)
  end function number_after

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
      bytes = min(bytes, number_after('', top//path(:n)//'/'//name, huge(bytes)))
      if (n == 0) exit
      n = max(0, index(path(:n), '/', back=.true.) - 1)
    end do
  end function lowest_limit

end module machine_memory_m
