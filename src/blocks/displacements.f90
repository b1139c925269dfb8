!> Tangential displacements: what a contact point remembers from substep to substep.
module displacements_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  implicit none
  private
  public :: displacements_t, reserve_displacements, comes_before, begins_pair, move_displacements

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
    !> Of contact points at rest (`sleep_m`) and of those solved for impulses: force on a, torques
    !! on a and b, energy of the contact point.
    real(wp), allocatable :: force(:, :), torque_a(:, :), torque_b(:, :)   !! (3, n) [N], [N m]
    real(wp), allocatable :: energy(:)           !! (n) [J]
  end type displacements_t

  !> One of them, to move it.
  type :: displacement_t
    integer :: a = 0, b = 0, id = 0, other = 0
    real(wp) :: xi(3) = 0.0_wp, k = 0.0_wp
    real(wp) :: force(3) = 0.0_wp, torque_a(3) = 0.0_wp, torque_b(3) = 0.0_wp
    real(wp) :: energy = 0.0_wp
  end type displacement_t

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

  !> Whether entry g is the first of its pair of counterparts.
  pure function begins_pair(displacements, g) result(yes)
    type(displacements_t), intent(in) :: displacements
    integer, intent(in) :: g
    logical :: yes

    yes = g == 1
    if (.not. yes) yes = displacements%a(g) /= displacements%a(g - 1) &
      .or. displacements%b(g) /= displacements%b(g - 1)
  end function begins_pair

  !> Move the chosen entries of a list to another; both stay sorted.
  subroutine move_displacements(chosen, from, to)
    logical, intent(in) :: chosen(:)         !! (from%n)
    type(displacements_t), intent(inout) :: from, to
    logical :: own_is_next   !! an entry of `to` itself comes after that of `from`
    integer :: i, j, m, kept

    m = to%n + count(chosen(:from%n))
    if (m == to%n) return
    call reserve_displacements(m, to)
    i = to%n
    j = from%n
    to%n = m
    do while (j > 0)   ! from the end, so that none is overwritten before it has moved
      if (.not. chosen(j)) then
        j = j - 1
        cycle
      end if
      own_is_next = i > 0
      if (own_is_next) own_is_next = .not. comes_before(to%a(i), to%b(i), to%id(i), from%a(j), &
                                                        from%b(j), from%id(j))
      if (own_is_next) then
        call put_displacement(displacement_at(to, i), m, to)
        i = i - 1
      else
        call put_displacement(displacement_at(from, j), m, to)
        j = j - 1
      end if
      m = m - 1
    end do
    kept = 0
    do j = 1, from%n
      if (chosen(j)) cycle
      kept = kept + 1
      if (kept < j) call put_displacement(displacement_at(from, j), kept, from)
    end do
    from%n = kept
  end subroutine move_displacements

  !> Entry i of a list.
  pure function displacement_at(displacements, i) result(displacement)
    type(displacements_t), intent(in) :: displacements
    integer, intent(in) :: i
    type(displacement_t) :: displacement

    displacement%a = displacements%a(i)
    displacement%b = displacements%b(i)
    displacement%id = displacements%id(i)
    displacement%other = displacements%other(i)
    displacement%xi = displacements%xi(:, i)
    displacement%k = displacements%k(i)
    displacement%force = displacements%force(:, i)
    displacement%torque_a = displacements%torque_a(:, i)
    displacement%torque_b = displacements%torque_b(:, i)
    displacement%energy = displacements%energy(i)
  end function displacement_at

  !> Put an entry at place i of a list, where there is room.
  pure subroutine put_displacement(displacement, i, displacements)
    type(displacement_t), intent(in) :: displacement
    integer, intent(in) :: i
    type(displacements_t), intent(inout) :: displacements

    displacements%a(i) = displacement%a
    displacements%b(i) = displacement%b
    displacements%id(i) = displacement%id
    displacements%other(i) = displacement%other
    displacements%xi(:, i) = displacement%xi
    displacements%k(i) = displacement%k
    displacements%force(:, i) = displacement%force
    displacements%torque_a(:, i) = displacement%torque_a
    displacements%torque_b(:, i) = displacement%torque_b
    displacements%energy(i) = displacement%energy
  end subroutine put_displacement

end module displacements_m
