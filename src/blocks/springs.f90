!> Tangential springs: what a contact point remembers from substep to substep.
module springs_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  implicit none
  private
  public :: springs_t, reserve_springs, comes_before, begins_pair, move_springs

  !> Tangential springs, one for each sphere or point (key) of a body and the counterpart it
  !! touches; arrays side by side, as the state of a run is written.
  !!
  !! The paper keeps one for each pair of spheres; one for each counterpart survives when a sphere
  !! slides from a sphere of the counterpart to the next, so that resting blocks do not creep.
  type :: springs_t
    integer :: n = 0
    integer, allocatable :: a(:), b(:), key(:)   !! sorted by these, as in `contact_point_t`
    integer, allocatable :: other(:)
      !! (n) edge of b, of contact points solved for impulses
    real(wp), allocatable :: xi(:, :)            !! (3, n) way of the counterpart past the body [m]
    real(wp), allocatable :: k(:)                !! (n) k_t when last at work, for the energy [N/m]
    !> Of contact points at rest (`sleep_m`) and of those solved for impulses: force on a, torques
    !! on a and b, energy of the contact point.
    real(wp), allocatable :: force(:, :), torque_a(:, :), torque_b(:, :)   !! (3, n) [N], [N m]
    real(wp), allocatable :: energy(:)           !! (n) [J]
  end type springs_t

  !> One of them, to move it.
  type :: spring_t
    integer :: a = 0, b = 0, key = 0, other = 0
    real(wp) :: xi(3) = 0.0_wp, k = 0.0_wp
    real(wp) :: force(3) = 0.0_wp, torque_a(3) = 0.0_wp, torque_b(3) = 0.0_wp
    real(wp) :: energy = 0.0_wp
  end type spring_t

contains

  !> Make room for at least n springs.
  subroutine reserve_springs(n, springs)
    integer, intent(in) :: n
    type(springs_t), intent(inout) :: springs

    call ensure_capacity(n, springs%a)
    call ensure_capacity(n, springs%b)
    call ensure_capacity(n, springs%key)
    call ensure_capacity(n, springs%other)
    call ensure_capacity(n, springs%k)
    call ensure_capacity(n, springs%xi)
    call ensure_capacity(n, springs%force)
    call ensure_capacity(n, springs%torque_a)
    call ensure_capacity(n, springs%torque_b)
    call ensure_capacity(n, springs%energy)
  end subroutine reserve_springs

  !> Order of springs and contact points: by body, counterpart, key.
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

  !> Whether spring g is the first of its pair of counterparts.
  pure function begins_pair(springs, g) result(yes)
    type(springs_t), intent(in) :: springs
    integer, intent(in) :: g
    logical :: yes

    yes = g == 1
    if (.not. yes) yes = springs%a(g) /= springs%a(g - 1) .or. springs%b(g) /= springs%b(g - 1)
  end function begins_pair

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
        call put_spring(spring_at(to, i), m, to)
        i = i - 1
      else
        call put_spring(spring_at(from, j), m, to)
        j = j - 1
      end if
      m = m - 1
    end do
    kept = 0
    do j = 1, from%n
      if (chosen(j)) cycle
      kept = kept + 1
      if (kept < j) call put_spring(spring_at(from, j), kept, from)
    end do
    from%n = kept
  end subroutine move_springs

  !> Spring i of a list.
  pure function spring_at(springs, i) result(spring)
    type(springs_t), intent(in) :: springs
    integer, intent(in) :: i
    type(spring_t) :: spring

    spring%a = springs%a(i)
    spring%b = springs%b(i)
    spring%key = springs%key(i)
    spring%other = springs%other(i)
    spring%xi = springs%xi(:, i)
    spring%k = springs%k(i)
    spring%force = springs%force(:, i)
    spring%torque_a = springs%torque_a(:, i)
    spring%torque_b = springs%torque_b(:, i)
    spring%energy = springs%energy(i)
  end function spring_at

  !> Put a spring at place i of a list, where there is room.
  pure subroutine put_spring(spring, i, springs)
    type(spring_t), intent(in) :: spring
    integer, intent(in) :: i
    type(springs_t), intent(inout) :: springs

    springs%a(i) = spring%a
    springs%b(i) = spring%b
    springs%key(i) = spring%key
    springs%other(i) = spring%other
    springs%xi(:, i) = spring%xi
    springs%k(i) = spring%k
    springs%force(:, i) = spring%force
    springs%torque_a(:, i) = spring%torque_a
    springs%torque_b(:, i) = spring%torque_b
    springs%energy(i) = spring%energy
  end subroutine put_spring

end module springs_m
