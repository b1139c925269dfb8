!> Tangential displacements: what a contact point remembers from substep to substep.
module displacements_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  implicit none
  private
  public :: displacements_t, reserve_displacements, comes_before, move_displacements

  !> Tangential displacements, one for each sphere or point (id) of a body and the counterpart it
  !! touches; arrays side by side, as the state of a run is written.
  !!
  !! The paper keeps one for each pair of spheres; one for each counterpart survives when a sphere
  !! slides from a sphere of the counterpart to the next, so that resting blocks do not creep.
  type :: displacements_t
    integer :: n = 0
    integer, allocatable :: a(:), b(:), id(:)    !! sorted by these, as in `contact_point_t`
    integer, allocatable :: other(:)
      !! (n) edge of b, of contact points solved for impulses
    real(wp), allocatable :: xi(:, :)            !! (3, n) way of the counterpart past the body [m]
    real(wp), allocatable :: k(:)                !! (n) k_t when last at work, for the energy [N/m]
    !> Of the last substep: force on a, torques on a and b, energy of the contact point.
    real(wp), allocatable :: force(:, :), torque_a(:, :), torque_b(:, :)   !! (3, n) [N], [N m]
    real(wp), allocatable :: energy(:)           !! (n) [J]
  end type displacements_t

contains

  !> Make room for at least n displacements.
  subroutine reserve_displacements(n, displacements)
    integer, intent(in) :: n
    type(displacements_t), intent(inout) :: displacements

    call ensure_capacity(n, displacements%a)
    call ensure_capacity(n, displacements%b)
    call ensure_capacity(n, displacements%id)
    call ensure_capacity(n, displacements%other)
    call ensure_capacity(n, displacements%k)
    call ensure_capacity(n, displacements%xi)
    call ensure_capacity(n, displacements%force)
    call ensure_capacity(n, displacements%torque_a)
    call ensure_capacity(n, displacements%torque_b)
    call ensure_capacity(n, displacements%energy)
  end subroutine reserve_displacements

  !> Order of displacements and contact points: by body, counterpart, id.
  pure function comes_before(a1, b1, id1, a2, b2, id2) result(yes)
    integer, intent(in) :: a1, b1, id1, a2, b2, id2
    logical :: yes

    if (a1 /= a2) then
      yes = a1 < a2
    else if (b1 /= b2) then
      yes = b1 < b2
    else
      yes = id1 < id2
    end if
  end function comes_before

  !> Move the chosen entries of a list to another; both stay sorted.
  subroutine move_displacements(chosen, from, to)
    logical, intent(in) :: chosen(:)         !! (from%n)
    type(displacements_t), intent(inout) :: from, to
    type(displacements_t) :: list, own   ! `from` and `to` before
    integer :: i, j

    if (.not. any(chosen(:from%n))) return
    list = from
    own = to
    from%n = 0
    to%n = 0
    i = 1
    do j = 1, list%n
      if (.not. chosen(j)) then
        call append(list, j, from)
        cycle
      end if
      do while (i <= own%n)
        if (.not. comes_before(own%a(i), own%b(i), own%id(i), list%a(j), list%b(j), &
                               list%id(j))) exit
        call append(own, i, to)
        i = i + 1
      end do
      call append(list, j, to)
    end do
    do i = i, own%n
      call append(own, i, to)
    end do
  end subroutine move_displacements

  !> Append entry i of one list to another.
  subroutine append(list, i, to)
    type(displacements_t), intent(in) :: list
    integer, intent(in) :: i
    type(displacements_t), intent(inout) :: to

    to%n = to%n + 1
    call reserve_displacements(to%n, to)
    to%a(to%n) = list%a(i)
    to%b(to%n) = list%b(i)
    to%id(to%n) = list%id(i)
    to%other(to%n) = list%other(i)
    to%xi(:, to%n) = list%xi(:, i)
    to%k(to%n) = list%k(i)
    to%force(:, to%n) = list%force(:, i)
    to%torque_a(:, to%n) = list%torque_a(:, i)
    to%torque_b(:, to%n) = list%torque_b(:, i)
    to%energy(to%n) = list%energy(i)
  end subroutine append

end module displacements_m
