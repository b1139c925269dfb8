!> Which bodies reach deep into one another, into a wall or the bed, and how it is reported: where a
!! body is pressed harder than contact can hold, it goes through.
module deep_overlaps_m
  use, intrinsic :: iso_fortran_env, only: error_unit
  use kinds_m, only: wp
  use errors_m, only: to_text, brief
  use parallel_m, only: is_root
  use contact_points_m, only: contact_points_t
  use rigid_body_m, only: blocks_t
  implicit none
  private
  public :: deep_overlaps_t, deep_overlaps_init, store_overlap, store_points, ask_for_deep
  public :: size_of_pair, warn_of_overlaps, overlap_fault, reported_share

  real(wp), parameter :: reported_share = 0.05_wp   !! overlap over size to report a body
  real(wp), parameter :: fault_share = 0.2_wp    !! likewise, from which the run ends
  real(wp), parameter :: asked_share = 0.5_wp*reported_share
    !! depth of a contact point over size from which the overlap is asked for

  !> The deepest overlap of each body, (n), where it is above `reported_share`.
  type :: deep_overlaps_t
    logical, allocatable :: asked(:)     !! its overlaps are to be measured
    real(wp), allocatable :: size(:)     !! smallest edge [m]
    real(wp), allocatable :: depth(:)    !! overlap; 0 if none is noted [m]
    real(wp), allocatable :: share(:)    !! of the size of the smaller of the two [-]
    integer, allocatable :: counterpart(:)   !! body, or below 1: wall or bed
    logical, allocatable :: warned(:)    !! has been warned of
  end type deep_overlaps_t

contains

  !> No overlap is known yet.
  pure subroutine deep_overlaps_init(blocks, deep)
    type(blocks_t), intent(in) :: blocks
    type(deep_overlaps_t), intent(out) :: deep
    integer :: b

    allocate (deep%depth(blocks%n), deep%share(blocks%n), source=0.0_wp)
    allocate (deep%counterpart(blocks%n), source=0)
    allocate (deep%warned(blocks%n), deep%asked(blocks%n), source=.false.)
    deep%size = [(blocks%shapes(blocks%shape(b))%smallest_edge, b=1, blocks%n)]
  end subroutine deep_overlaps_init

  !> Ask for the overlaps of bodies that move with a deep contact, and of their counterparts.
  pure subroutine ask_for_deep(points, blocks, deep)
    type(contact_points_t), intent(in) :: points
    type(blocks_t), intent(in) :: blocks
    type(deep_overlaps_t), intent(inout) :: deep
    logical :: still
    integer :: t

    deep%asked = .false.
    do t = 1, points%n
      associate (a => points%item(t)%a, b => points%item(t)%b)
        if (points%item(t)%depth <= asked_share*size_of_pair(a, b, deep)) cycle
        still = blocks%still(a)
        if (b > 0) still = still .and. blocks%still(b)
        if (still) cycle
        deep%asked(a) = .true.
        if (b > 0) deep%asked(b) = .true.
      end associate
    end do
  end subroutine ask_for_deep

  !> Size of the smaller of a body and its counterpart; walls and the bed have none [m].
  pure function size_of_pair(a, b, deep) result(size)
    integer, intent(in) :: a, b   !! body; body, or below 1: wall or bed
    type(deep_overlaps_t), intent(in) :: deep
    real(wp) :: size

    size = deep%size(a)
    if (b > 0) size = min(size, deep%size(b))
  end function size_of_pair

  !> Note an overlap of body a and its counterpart b with both, where it is the deepest of either.
  pure subroutine store_overlap(a, b, depth, deep)
    integer, intent(in) :: a, b         !! body; body, or below 1: wall or bed
    real(wp), intent(in) :: depth       !! [m]
    type(deep_overlaps_t), intent(inout) :: deep
    real(wp) :: share
    integer :: body(2), i

    share = depth/size_of_pair(a, b, deep)
    if (.not. share > reported_share) return
    body = [a, b]
    do i = 1, merge(2, 1, b > 0)
      if (share <= deep%share(body(i))) cycle
      deep%share(body(i)) = share
      deep%depth(body(i)) = depth
      deep%counterpart(body(i)) = body(3 - i)
    end do
  end subroutine store_overlap

  !> Note the overlaps of contact points: of contact spheres, where the true shapes overlap at rest.
  pure subroutine store_points(points, deep)
    type(contact_points_t), intent(in) :: points
    type(deep_overlaps_t), intent(inout) :: deep
    integer :: t

    deep%depth = 0.0_wp
    deep%share = 0.0_wp
    do t = 1, points%n
      call store_overlap(points%item(t)%a, points%item(t)%b, points%item(t)%depth, deep)
    end do
  end subroutine store_points

  !> Warn once of each body that reaches deep into another one, a wall or the bed, or into which one
  !! reaches.
  subroutine warn_of_overlaps(time, deep, warnings)
    real(wp), intent(in) :: time           !! [s]
    type(deep_overlaps_t), intent(inout) :: deep
    integer, intent(inout) :: warnings     !! counted up
    integer :: b

    do b = 1, size(deep%warned)
      if (.not. deep%share(b) > 0.0_wp .or. deep%warned(b)) cycle
      deep%warned(b) = .true.
      if (deep%counterpart(b) > 0) deep%warned(deep%counterpart(b)) = .true.
      warnings = warnings + 1
      if (.not. is_root()) cycle
      write (error_unit, '(5a)') 'mics: warning: ', overlap_text(b, deep), ', t = ', &
        brief(time, 5), ' s'
      flush (error_unit)
    end do
  end subroutine warn_of_overlaps

  !> What is wrong where bodies reach so deep into one another that their contact has failed; empty
  !! if none do.
  function overlap_fault(deep) result(text)
    type(deep_overlaps_t), intent(in) :: deep
    character(:), allocatable :: text
    integer :: b

    text = ''
    if (size(deep%share) == 0) return
    b = maxloc(deep%share, 1)
    if (.not. deep%share(b) > fault_share) return
    text = overlap_text(b, deep)//', above '//brief(100.0_wp*fault_share)//' %: something drives ' &
      //'or presses them harder than their contact holds, or they are too fast for it; a shorter ' &
      //'contact_time (or larger k_n) makes blocks stiffer'
  end function overlap_fault

  !> The deepest overlap of body b in words.
  function overlap_text(b, deep) result(text)
    integer, intent(in) :: b
    type(deep_overlaps_t), intent(in) :: deep
    character(:), allocatable :: text

    text = 'body '//to_text(b)//' and '
    if (deep%counterpart(b) > 0) then
      text = text//'body '//to_text(deep%counterpart(b))
    else
      text = text//'a wall or the bed'
    end if
    text = text//' reach '//brief(deep%depth(b), 3)//' m into one another, ' &
      //brief(100.0_wp*deep%share(b), 3)//' % of the size of the smaller'
  end function overlap_text

end module deep_overlaps_m
