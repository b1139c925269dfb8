!> How many messages pass between processes, and what a run asks to be passed.
!!
!! Two accounts are kept from `count_from_here` on. The *sent* one holds what this process really
!! handed to the others, by kind. The *asked* one holds what the method wanted passed, whether or
!! not there is anybody to pass it to; it is the same on any number of processes, so it tells from
!! a run on one of them what a run on many will send. What the file library sends is in neither.
module messages_m
  use kinds_m, only: wp, i8
  implicit none
  private
  public :: count_from_here, stop_counting, note_sent, note_asked, begin_search, end_search
  public :: sent_kinds, sent_so_far, asked_what, asked_detail, asked_calls, traffic_t

  !> Kinds of messages sent: layers of the neighbours; blocks put together on all processes; sums,
  !! largest and smallest values of all; values of the root process; all that serves to find which
  !! cells belong together, whose rounds depend on how those lie across the processes.
  integer, parameter, public :: halo = 1, gather = 2, reduction = 3, broadcasts = 4, search = 5
  !> Further kinds of what is asked: a cycle of the multigrid, and new coefficients for it.
  integer, parameter, public :: cycle_of_levels = 6, setup_of_levels = 7
  integer, parameter :: what_length = 12
  character(what_length), parameter :: name_of(7) = [character(what_length) :: 'halo', 'gather', &
    'reduction', 'broadcast', 'search', 'cycle', 'setup']
  character(what_length), parameter :: sent_kinds(5) = name_of(:5)

  !> The same thing asked again and again.
  type :: asked_t
    integer :: what = 0           !! halo, gather, ...
    integer :: detail(3) = 0      !! layers: bytes of a cell, width, direction; else: bytes, 0, 0
    integer(i8) :: calls = 0_i8
  end type asked_t

  !> What passed between all processes, by kind.
  type :: traffic_t
    logical :: known = .false.
    integer :: steps = 0                   !! in which it passed
    real(wp) :: messages(5) = 0.0_wp       !! sent by all processes together
    real(wp) :: bytes(5) = 0.0_wp          !! their length [B]
    real(wp) :: messages_most(5) = 0.0_wp  !! of the process that sends most
    real(wp) :: bytes_most(5) = 0.0_wp     !! likewise [B]
  end type traffic_t

  type(asked_t), allocatable :: asked(:)
  integer :: entries = 0
  integer(i8) :: messages(5) = 0_i8, bytes(5) = 0_i8
  logical :: counting = .false., searching = .false.

contains

  !> Begin to count.
  subroutine count_from_here()
    entries = 0
    if (.not. allocated(asked)) allocate (asked(64))
    messages = 0_i8
    bytes = 0_i8
    counting = .true.
  end subroutine count_from_here

  !> What follows is not counted.
  subroutine stop_counting()
    counting = .false.
  end subroutine stop_counting

  !> All that passes until `end_search` is of the kind `search`.
  subroutine begin_search()
    searching = .true.
  end subroutine begin_search

  subroutine end_search()
    searching = .false.
  end subroutine end_search

  !> This process sends a message of so many bytes.
  subroutine note_sent(kind, length)
    integer, intent(in) :: kind     !! halo, gather, reduction or broadcasts
    integer, intent(in) :: length   !! [bytes]
    integer :: k

    if (.not. counting) return
    k = merge(search, kind, searching)
    messages(k) = messages(k) + 1_i8
    bytes(k) = bytes(k) + int(length, i8)
  end subroutine note_sent

  !> The method asks for something to be passed.
  subroutine note_asked(what, detail)
    integer, intent(in) :: what
    integer, intent(in) :: detail(3)   !! see `asked_t`
    type(asked_t) :: wanted
    integer :: e

    if (.not. counting) return
    wanted = asked_t(what, detail)
    if (searching) wanted%what = search
    do e = 1, entries
      if (asked(e)%what == wanted%what .and. all(asked(e)%detail == wanted%detail)) exit
    end do
    if (e > entries) then
      if (e > size(asked)) call double_room()
      entries = e
      asked(e) = wanted
    end if
    asked(e)%calls = asked(e)%calls + 1_i8
  end subroutine note_asked

  !> Room for twice as many entries: sums over parts of the fluid have as many lengths as there were
  !! numbers of parts.
  subroutine double_room()
    type(asked_t), allocatable :: more(:)

    allocate (more(2*size(asked)))
    more(:entries) = asked(:entries)
    call move_alloc(more, asked)
  end subroutine double_room

  !> Messages of this process so far and their bytes, by kind.
  function sent_so_far() result(sent)
    integer(i8) :: sent(5, 2)

    sent(:, 1) = messages
    sent(:, 2) = bytes
  end function sent_so_far

  !> What was asked, one of each sort.
  function asked_what() result(name)
    character(what_length) :: name(entries)
    integer :: e

    do e = 1, entries
      name(e) = name_of(asked(e)%what)
    end do
  end function asked_what

  !> The details of each, see `asked_t`.
  function asked_detail() result(table)
    integer :: table(3, entries)
    integer :: e

    do e = 1, entries
      table(:, e) = asked(e)%detail
    end do
  end function asked_detail

  !> How often each was asked.
  function asked_calls() result(calls)
    real(wp) :: calls(entries)
    integer :: e

    do e = 1, entries
      calls(e) = real(asked(e)%calls, wp)
    end do
  end function asked_calls

end module messages_m
