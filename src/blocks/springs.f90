!> Tangential springs: what a touch remembers from substep to substep.
module springs_m
  use kinds_m, only: wp
  use growing_m, only: ensure_room
  implicit none
  private
  public :: springs_t, reserve_springs, comes_before, move_springs

  !> Tangential springs, one for each sphere or point (key) of a body and the partner it touches.
  !!
  !! The paper keeps one for each pair of spheres; one for each partner survives when a sphere
  !! slides from a sphere of the partner to the next, so that resting blocks do not creep.
  type :: springs_t
    integer :: n = 0
    integer, allocatable :: a(:), b(:), key(:)   !! sorted by these, as in `touch_t`
    real(wp), allocatable :: xi(:, :)            !! (3, n) way of the partner past the body [m]
    real(wp), allocatable :: k(:)                !! (n) k_t when last at work, for the energy [N/m]
    !> Of touches at rest (`sleep_m`) only: force on a, torques on a and b, energy of the touch.
    real(wp), allocatable :: force(:, :), torque_a(:, :), torque_b(:, :)   !! (3, n) [N], [N m]
    real(wp), allocatable :: energy(:)           !! (n) [J]
  end type springs_t

contains

  !> Make room for at least n springs.
  subroutine reserve_springs(n, springs)
    integer, intent(in) :: n
    type(springs_t), intent(inout) :: springs

    call ensure_room(n, springs%a)
    call ensure_room(n, springs%b)
    call ensure_room(n, springs%key)
    call ensure_room(n, springs%k)
    call ensure_room(n, springs%xi)
    call ensure_room(n, springs%force)
    call ensure_room(n, springs%torque_a)
    call ensure_room(n, springs%torque_b)
    call ensure_room(n, springs%energy)
  end subroutine reserve_springs

  !> Order of springs and touches: by body, partner, key.
  pure function comes_before(a1, b1, key1, a2, b2, key2) result(yes)
    integer, intent(in) :: a1, b1, key1, a2, b2, key2
    logical :: yes

    if (a1 /= a2) then
      yes = a1 < a2
    else if (b1 /= b2) then
      yes = b1 < b2
    else
      yes = key1 < key2
    end if
  end function comes_before

  !> Move the chosen springs of a list to another; both stay sorted.
  subroutine move_springs(chosen, from, to)
    logical, intent(in) :: chosen(:)         !! (from%n)
    type(springs_t), intent(inout) :: from, to
    logical :: own_is_next   !! a spring of `to` itself comes after that of `from`
    integer :: i, j, m, kept

    m = to%n + count(chosen(:from%n))
    if (m == to%n) return
    call reserve_springs(m, to)
    i = to%n
    j = from%n
    to%n = m
    do while (j > 0)   ! from the end, so that no spring is overwritten before it has moved
      if (.not. chosen(j)) then
        j = j - 1
        cycle
      end if
      own_is_next = i > 0
      if (own_is_next) own_is_next = .not. comes_before(to%a(i), to%b(i), to%key(i), from%a(j), &
                                                        from%b(j), from%key(j))
      if (own_is_next) then
        call move_spring(i, m, to)
        i = i - 1
      else
        call copy_spring(from, j, to, m)
        j = j - 1
      end if
      m = m - 1
    end do
    kept = 0
    do j = 1, from%n
      if (chosen(j)) cycle
      kept = kept + 1
      if (kept < j) call move_spring(j, kept, from)
    end do
    from%n = kept
  end subroutine move_springs

  !> Copy a spring from one list to another, where there is room.
  pure subroutine copy_spring(from, i, to, m)
    type(springs_t), intent(in) :: from
    integer, intent(in) :: i, m
    type(springs_t), intent(inout) :: to

    to%a(m) = from%a(i)
    to%b(m) = from%b(i)
    to%key(m) = from%key(i)
    to%xi(:, m) = from%xi(:, i)
    to%k(m) = from%k(i)
    to%force(:, m) = from%force(:, i)
    to%torque_a(:, m) = from%torque_a(:, i)
    to%torque_b(:, m) = from%torque_b(:, i)
    to%energy(m) = from%energy(i)
  end subroutine copy_spring

  !> Move a spring within a list.
  pure subroutine move_spring(i, m, springs)
    integer, intent(in) :: i, m
    type(springs_t), intent(inout) :: springs

    springs%a(m) = springs%a(i)
    springs%b(m) = springs%b(i)
    springs%key(m) = springs%key(i)
    springs%xi(:, m) = springs%xi(:, i)
    springs%k(m) = springs%k(i)
    springs%force(:, m) = springs%force(:, i)
    springs%torque_a(:, m) = springs%torque_a(:, i)
    springs%torque_b(:, m) = springs%torque_b(:, i)
    springs%energy(m) = springs%energy(i)
  end subroutine move_spring

end module springs_m
