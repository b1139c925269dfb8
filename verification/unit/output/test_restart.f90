!> Restart files: the state comes back bit by bit, damage and a changed case are noticed.
! ranks: 2 3
module test_restart_m
  use check_m, only: check, checked, wp, i8
  use parallel_m, only: is_root, nproc, broadcast
  use restart_m, only: write_restart, read_restart
  use state_m, only: list_state
  use state_list_m, only: state_list_t
  use file_space_m, only: bytes_for_change
  use sample_state_m, only: sample_t, make_sample, checksums_of, first_change
  implicit none
  private
  public :: test_restart

  character(*), parameter :: path = 'test-restart-a.h5'

contains

  subroutine test_restart()
    call test_size()
    call test_comes_back(.false.)
    call test_comes_back(.true.)
    call test_dry()
    call test_damage()
    if (is_root()) call remove(path)
  end subroutine test_restart

  !> The room asked for before a restart file is written is enough, and not much too large.
  subroutine test_size()
    type(sample_t) :: s
    type(state_list_t) :: list
    character(:), allocatable :: message
    integer(i8) :: there, capacity
    integer :: info

    call make_sample(0.5_wp, .false., s)
    call write_sample(s, info, message)
    call list_state(s%run_state_t, list)
    if (.not. is_root()) return
    capacity = list%bytes() + len(s%case%text) + len(s%parameters) + bytes_for_change
    inquire (file=path, size=there)
    call check('a restart file fits into the room asked for', there <= capacity)
    call check('the room is not much too large', capacity <= 2*there)
  end subroutine test_size

  subroutine remove(name)
    character(*), intent(in) :: name
    integer :: unit, info

    open (newunit=unit, file=name, iostat=info)
    if (info == 0) close (unit, status='delete')
  end subroutine remove

  subroutine write_sample(s, info, message)
    type(sample_t), intent(inout) :: s
    integer, intent(out) :: info
    character(:), allocatable, intent(out) :: message

    if (is_root()) call remove(path)
    call meet()
    call write_restart(path, s%case%text, s%parameters, s%run_state_t, info, message)
  end subroutine write_sample

  subroutine read_sample(s, info, message)
    type(sample_t), intent(inout) :: s
    integer, intent(out) :: info
    character(:), allocatable, intent(out) :: message

    call read_restart(path, s%parameters, s%run_state_t, info, message)
  end subroutine read_sample

  subroutine test_comes_back(periodic)
    logical, intent(in) :: periodic
    type(sample_t) :: s, other
    character(18), allocatable :: before(:)
    integer :: info
    character(:), allocatable :: message
    logical :: there

    call make_sample(0.5_wp, periodic, s)
    before = checksums_of(s)
    call write_sample(s, info, message)
    call check('a restart file is written', info, 0)
    inquire (file=path//'.part', exist=there)
    call check('no unfinished file is left', .not. there)
    call make_sample(7.0_wp, periodic, other)
    other%contacts%displacements%n = 0
    call read_sample(other, info, message)
    call check('a restart file is read', info, 0)
    if (info /= 0) print '(a)', message
    call check('the solids in the grid stay', abs(other%solid%alpha(4, 4, s%grid%lo(3)) &
               - s%solid%alpha(4, 4, s%grid%lo(3))), 6.5_wp, 1.0e-12_wp)
    other%solid = s%solid
    call check('the state comes back bit by bit', first_change(before, other) == 'nothing')
    if (periodic) call check('periodic halos are filled', &
      all(abs(other%flow%uf(:, 1, other%grid%lo(3):other%grid%hi(3), 1) &
              - s%flow%uf(:, 1, s%grid%lo(3):s%grid%hi(3), 1)) <= 0.0_wp))
    call check('halos between processes are filled', all(abs( &
      other%flow%p(4, 4, max(1, s%grid%first(3)):min(s%grid%n(3), s%grid%last(3))) &
      - s%flow%p(4, 4, max(1, s%grid%first(3)):min(s%grid%n(3), s%grid%last(3)))) <= 0.0_wp))
  end subroutine test_comes_back

  !> Without fluid and without displacements.
  subroutine test_dry()
    type(sample_t) :: s, other
    integer :: info
    character(:), allocatable :: message

    call make_sample(0.5_wp, .false., s)
    deallocate (s%flow%u)
    s%contacts%displacements%n = 0
    call write_sample(s, info, message)
    call check('a dry restart file is written', info, 0)
    call make_sample(7.0_wp, .false., other)
    deallocate (other%flow%u)
    call read_sample(other, info, message)
    call check('a dry restart file is read', info, 0)
    call check('no displacements come back', other%contacts%displacements%n, 0)
    call check('blocks come back', other%blocks%v(3, 2), s%blocks%v(3, 2))
  end subroutine test_dry

  !> Overwrite one byte after the other: what is read is either whole or refused.
  subroutine test_damage()
    type(sample_t) :: s, other
    character(18), allocatable :: before(:)
    integer :: info, unit, bytes, i, at, n_noticed, n_silent, n_places
    character(:), allocatable :: message
    character(1) :: byte

    call make_sample(0.5_wp, .false., s)
    before = checksums_of(s)
    call write_sample(s, info, message)
    inquire (file=path, size=bytes)
    n_places = merge(12, 60, checked .or. nproc() > 1)   ! slow on several processes, too
    n_noticed = 0
    n_silent = 0
    do i = 1, n_places
      at = 1 + int((real(i, wp) - 0.5_wp)/n_places*bytes)
      if (is_root()) then
        open (newunit=unit, file=path, access='stream', form='unformatted', status='old')
        read (unit, pos=at) byte
        write (unit, pos=at) achar(ieor(iachar(byte), 16))
        close (unit)
      end if
      call meet()
      call make_sample(0.5_wp, .false., other)
      call read_sample(other, info, message)
      if (info /= 0) then
        n_noticed = n_noticed + 1
      else   ! a byte that nobody needs
        if (first_change(before, other) /= 'nothing') n_silent = n_silent + 1
      end if
      call meet()
      if (is_root()) then
        open (newunit=unit, file=path, access='stream', form='unformatted', status='old')
        write (unit, pos=at) byte
        close (unit)
      end if
      call meet()
    end do
    call check('damage never passes for a state', n_silent, 0)
    call check('damage of most places is noticed', n_noticed > n_places/2)
    call read_sample(s, info, message)
    call check('the file mended is read again', info, 0)
  end subroutine test_damage

  !> Wait until all processes are here.
  subroutine meet()
    integer :: n

    n = 0
    call broadcast(n)
    call broadcast(n)
  end subroutine meet

end module test_restart_m
