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

    bytes = 1024*kilobytes_in('/proc/meminfo', 'MemAvailable:')
    if (bytes > 0) bytes = min(bytes, group_limit())
  end function available_memory

  !> The most that this process can ever hold [B]: all memory of the machine, swap space included,
  !! or the limit of its address space (`ulimit -v`) if that is lower; the largest number where the
  !! system does not report it.
  function memory_limit() result(bytes)
    integer(i8) :: bytes
    integer(i8) :: memory

    bytes = address_limit()
    memory = kilobytes_in('/proc/meminfo', 'MemTotal:')
    if (memory > 0) bytes = min(bytes, 1024*(memory + kilobytes_in('/proc/meminfo', 'SwapTotal:')))
  end function memory_limit

  !> Limit of the address space of this process [B]; the largest number if there is none.
  function address_limit() result(bytes)
    integer(i8) :: bytes
    character(*), parameter :: name = 'Max address space'
    character(:), allocatable :: row
    integer(i8) :: found
    integer :: status

    bytes = huge(bytes)
    row = row_of('/proc/self/limits', name)
    if (len(row) == 0) return
    read (row, *, iostat=status) found   ! `unlimited` is no number
    if (status == 0) bytes = found
  end function address_limit

  !> The number after a name at the beginning of a row of a file; 0 if there is none.
  function kilobytes_in(file, name) result(kilobytes)
    character(*), intent(in) :: file, name
    integer(i8) :: kilobytes
    character(:), allocatable :: row
    integer :: status

    kilobytes = 0
    row = row_of(file, name)
    if (len(row) == 0) return
    read (row, *, iostat=status) kilobytes
    if (status /= 0) kilobytes = 0
  end function kilobytes_in

  !> What follows a name at the beginning of a row of a file; empty if there is none.
  function row_of(file, name) result(text)
    character(*), intent(in) :: file, name
    character(:), allocatable :: text
    character(120) :: row
    integer :: unit, status

    text = ''
    open (newunit=unit, file=file, action='read', status='old', iostat=status)
    if (status /= 0) return
    do
      read (unit, '(a)', iostat=status) row
      if (status /= 0) exit
      if (index(row, name) /= 1) cycle
      text = trim(row(len(name) + 1:))
      exit
    end do
    close (unit)
  end function row_of

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
