!> The impulses of a contact step: small sub-sweeps of block Gauss-Seidel over its rows, and the
!! restitution of what was hit.
!!
!! Each sub-sweep h lets the bodies fall freely, applies the impulses of the one before, corrects
!! them twice so that no gap closes by more than there is and overlaps open again, moves, and takes
!! away the velocity with which overlaps opened:
!!
!! $$ \Delta\gamma_n = -m_n (v_n + s/h) \;\text{ for gaps } s > 0, \qquad
!!    \Delta\gamma_n = -a_2 a_3 m_n (v_n + \max(r s, -v_p)) - a_3 \gamma_n \;\text{ else}, $$
!!
!! gamma_n >= 0, and friction within mu gamma_n after it, with the tangential way as its memory.
!! Source: Macklin et al. (2019), Small steps in physics simulation; Catto (2024), Solver2D.
module impulse_sweeps_m
  use kinds_m, only: wp
  use vectors_m, only: cross
  use bed_m, only: bed_counterpart
  use impulse_rows_m, only: row_t, rows_t, past, in_space
  implicit none
  private
  public :: solve_rows, restore

  integer, parameter :: n_correct = 2           !! sweeps with bias; one lets the stack creep
  integer, parameter :: n_restore = 6           !! sweeps over impacts
  integer, parameter :: worth_threads = 512     !! fewer rows are the work of one thread
  real(wp), parameter :: settled = 1.0e-5_wp    !! change of a sweep that no longer counts [m/s2]
  real(wp), parameter :: balance = 10.0_wp      !! acceleration left, over that, that counts [-]

contains

  !> Impulses, velocities and ways of a contact step of n sub-sweeps.
  !!
  !! Where nothing changes any more, and all is in balance, the rest of the step goes on as it is.
  subroutine solve_rows(h, n, push_max, rows)
    real(wp), intent(in) :: h          !! sub-sweep [s]
    integer, intent(in) :: n           !! sub-sweeps
    real(wp), intent(in) :: push_max   !! largest speed with which overlaps open [m/s]
    type(rows_t), intent(inout) :: rows
    real(wp) :: change, largest
    integer :: s, i, k, left, r

    call apply_remembered(rows)
    do s = 1, n
      call begin_sweep(h, rows)
      change = 0.0_wp
      do i = 1, n_correct
        call sweep(h, push_max, .true., mod(s + i, 2) == 0, rows, largest)
        change = max(change, largest)
      end do
      do k = 1, rows%n_active
        associate (b => rows%active(k))
          rows%way(:, b) = rows%way(:, b) + h*rows%v(:, b)
        end associate
      end do
      ! Let the rows follow the bodies.
      do k = 1, rows%n_pairs
        do r = rows%first(k), rows%first(k + 1) - 1
          rows%row(r)%way = past(rows%way(:, rows%a(k)), rows%way(:, rows%b(k)), rows%row(r))
        end do
      end do
      call sweep(h, push_max, .false., mod(s, 2) == 0, rows, largest)
      change = max(change, largest)
      do k = 1, rows%n_active
        associate (b => rows%active(k))
          rows%by_contact(:, b) = rows%v(:, b) - rows%by_contact(:, b)
        end associate
      end do
      left = 1
      if (change < settled*h .and. s < n) then
        if (balanced(h, rows)) left = n - s + 1
      end if
      ! Count the impulses of a sub-sweep, so many times.
      do r = 1, rows%n
        rows%total(:, r) = rows%total(:, r) + real(left, wp)*rows%row(r)%impulse
      end do
      if (left > 1) then
        call go_on(h, left - 1, rows)
        exit
      end if
    end do
  end subroutine solve_rows

  !> Change of the velocities by the impulses remembered.
  pure subroutine apply_remembered(rows)
    type(rows_t), intent(inout) :: rows
    real(wp) :: p(3)
    integer :: k, r

    do k = 1, rows%n_pairs
      associate (a => rows%a(k), b => rows%b(k))
        do r = rows%first(k), rows%first(k + 1) - 1
          associate (row => rows%row(r))
            p = in_space(row%impulse, row)
            rows%push(:, k) = rows%push(:, k) + p
            call add_impulse(rows%inverse_mass(a), rows%inverse_inertia(:, :, a), row%arm_a, -p, &
                           rows%by_contact(:, a))
            call add_impulse(rows%inverse_mass(b), rows%inverse_inertia(:, :, b), row%arm_b, p, &
                           rows%by_contact(:, b))
          end associate
        end do
      end associate
    end do
  end subroutine apply_remembered

  !> Change of the velocity and spin of a body by an impulse at an arm.
  pure subroutine add_impulse(inverse_mass, inverse_inertia, arm, p, v)
    real(wp), intent(in) :: inverse_mass, inverse_inertia(3, 3)   !! [1/kg], [1/(kg m2)]
    real(wp), intent(in) :: arm(3), p(3)                          !! [m], [N s]
    real(wp), intent(inout) :: v(6)                               !! [m/s], [rad/s]
    real(wp) :: twist(3)

    if (inverse_mass <= 0.0_wp) return
    twist = cross(arm, p)
    v(1:3) = v(1:3) + inverse_mass*p
    v(4:6) = v(4:6) + (inverse_inertia(:, 1)*twist(1) + inverse_inertia(:, 2)*twist(2) &
                       + inverse_inertia(:, 3)*twist(3))
  end subroutine add_impulse

  !> Begin a sub-sweep: free fall and the impulses of the one before. What `by_contact` holds until
  !! the sub-sweep ends are the velocities without contact.
  pure subroutine begin_sweep(h, rows)
    real(wp), intent(in) :: h   !! [s]
    type(rows_t), intent(inout) :: rows
    real(wp) :: free(6)
    integer :: k

    do k = 1, rows%n_active
      associate (b => rows%active(k))
        free = rows%v(:, b) + h*rows%a_free(:, b)
        rows%v(:, b) = free + rows%by_contact(:, b)
        rows%by_contact(:, b) = free
      end associate
    end do
    do k = 1, rows%n_pairs
      rows%turn(:, k) = rows%turn(:, k) + cross(half_way_past(k, rows), rows%push(:, k))
    end do
  end subroutine begin_sweep

  !> Half of the way of a past b: the contact stays between them, and the arm of b is longer, that
  !! of a shorter by this. Zero where one does not yield [m].
  pure function half_way_past(k, rows) result(way)
    integer, intent(in) :: k    !! pair
    type(rows_t), intent(in) :: rows
    real(wp) :: way(3)

    way = 0.0_wp
    associate (a => rows%a(k), b => rows%b(k))
      if (rows%inverse_mass(a) <= 0.0_wp .or. rows%inverse_mass(b) <= 0.0_wp) return
      way = 0.5_wp*(rows%way(1:3, a) - rows%way(1:3, b))
    end associate
  end function half_way_past

  !> One sweep over all pairs, colour by colour, or backwards.
  subroutine sweep(h, push_max, bias, backward, rows, change)
    real(wp), intent(in) :: h, push_max   !! [s], [m/s]
    logical, intent(in) :: bias           !! overlaps open; else their velocity is taken away
    logical, intent(in) :: backward
    type(rows_t), intent(inout) :: rows
    real(wp), intent(out) :: change       !! largest, of a velocity [m/s]
    real(wp) :: most
    integer :: i, c, m, last

    change = 0.0_wp
    last = rows%n_colours
    !$omp parallel private(i, c, m, most) if (rows%n > worth_threads)
    most = 0.0_wp
    do i = 1, last
      c = merge(last + 1 - i, i, backward)
      !$omp do schedule(static)
      do m = rows%begin(c), rows%begin(c + 1) - 1
        call solve_pair(h, push_max, bias, backward, rows%order(m), rows, most)
      end do
      !$omp end do
    end do
    !$omp critical
    change = max(change, most)
    !$omp end critical
    !$omp end parallel
  end subroutine sweep

  !> Correct the impulses of the rows of one pair, one after the other.
  subroutine solve_pair(h, push_max, bias, backward, k, rows, change)
    real(wp), intent(in) :: h, push_max
    logical, intent(in) :: bias, backward
    integer, intent(in) :: k
    type(rows_t), intent(inout) :: rows
    real(wp), intent(inout) :: change
    real(wp) :: va(6), vb(6), p(3), total(3), mass
    integer :: r, from, to, way

    associate (a => rows%a(k), b => rows%b(k))
      from = merge(rows%first(k + 1) - 1, rows%first(k), backward)
      to = merge(rows%first(k), rows%first(k + 1) - 1, backward)
      way = merge(-1, 1, backward)
      va = rows%v(:, a)
      vb = rows%v(:, b)
      mass = rows%inverse_mass(a) + rows%inverse_mass(b)
      total = 0.0_wp
      do r = from, to, way
        associate (row => rows%row(r))
          call correct(h, push_max, bias, past(va, vb, row), row, p)
          rows%largest(r) = max(rows%largest(r), row%impulse(1))
          if (.not. any(abs(p) > 0.0_wp)) cycle
          call add_impulse(rows%inverse_mass(a), rows%inverse_inertia(:, :, a), row%arm_a, -p, va)
          call add_impulse(rows%inverse_mass(b), rows%inverse_inertia(:, :, b), row%arm_b, p, vb)
        end associate
        total = total + p
        change = max(change, (abs(p(1)) + abs(p(2)) + abs(p(3)))*mass)
      end do
      if (rows%inverse_mass(a) > 0.0_wp) rows%v(:, a) = va
      if (rows%inverse_mass(b) > 0.0_wp) rows%v(:, b) = vb
      rows%push(:, k) = rows%push(:, k) + total
      rows%turn(:, k) = rows%turn(:, k) + cross(half_way_past(k, rows), total)
    end associate
  end subroutine solve_pair

  !> Correct the impulse of one row: along the normal, then friction with the velocity after that.
  pure subroutine correct(h, push_max, bias, v, row, p)
    real(wp), intent(in) :: h, push_max   !! [s], [m/s]
    logical, intent(in) :: bias
    real(wp), intent(in) :: v(3)          !! of b past a [m/s]
    type(row_t), intent(inout) :: row
    real(wp), intent(out) :: p(3)         !! change of the impulse on b [N s]
    real(wp) :: gap, v_n, rate, normal, slip(3), before(3)

    gap = row%gap + dot_product(row%n, row%way)
    v_n = dot_product(row%n, v)
    rate = 0.0_wp
    if (gap > 0.0_wp) then
      normal = row%impulse(1) - row%mass*(v_n + gap/h)
    else if (bias) then
      rate = row%rate
      normal = row%impulse(1) - row%soft*row%mass*(v_n + max(rate*gap, -push_max)) &
        - row%keep*row%impulse(1)
    else
      normal = row%impulse(1) - row%mass*v_n
    end if
    normal = max(0.0_wp, normal)
    p = (normal - row%impulse(1))*row%n
    before = row%impulse
    row%impulse(1) = normal
    if (normal > 0.0_wp .or. any(abs(before(2:3)) > 0.0_wp)) then
      slip = v + rate*row%way + (normal - before(1))*row%response
      call rub(row, dot_product(row%e1, slip) + rate*row%stretch(1), &
               dot_product(row%e2, slip) + rate*row%stretch(2), row%impulse)
      p = p + (row%impulse(2) - before(2))*row%e1 + (row%impulse(3) - before(3))*row%e2
    end if
  end subroutine correct

  !> Friction against a slip, within the bound that the normal impulse sets.
  !!
  !! Where the impulse that would stop the slip is too large, the step is taken again along the
  !! slip, and cut: cut alone it would turn, for the masses along the tangents differ.
  pure subroutine rub(row, slip_1, slip_2, impulse)
    type(row_t), intent(in) :: row
    real(wp), intent(in) :: slip_1, slip_2    !! along the tangents [m/s]
    real(wp), intent(inout) :: impulse(3)     !! along normal and tangents [N s]
    real(wp) :: g1, g2, bound, length

    g1 = impulse(2) - (row%mass_11*slip_1 + row%mass_12*slip_2)
    g2 = impulse(3) - (row%mass_12*slip_1 + row%mass_22*slip_2)
    bound = row%friction*impulse(1)
    if (g1**2 + g2**2 > bound**2) then
      g1 = impulse(2) - row%mass_slip*slip_1
      g2 = impulse(3) - row%mass_slip*slip_2
      length = sqrt(g1**2 + g2**2)
      if (length > 0.0_wp) then
        g1 = g1*(bound/max(length, bound))
        g2 = g2*(bound/max(length, bound))
      end if
    end if
    impulse(2) = g1
    impulse(3) = g2
  end subroutine rub

  !> Whether the forces on all bodies that touch balance.
  pure function balanced(h, rows) result(yes)
    real(wp), intent(in) :: h   !! [s]
    type(rows_t), intent(in) :: rows
    logical :: yes
    integer :: k

    yes = .false.
    do k = 1, rows%n_active
      associate (b => rows%active(k))
        if (rows%inverse_mass(b) <= 0.0_wp) cycle
        if (maxval(abs(h*rows%a_free(1:3, b) + rows%by_contact(1:3, b))) &
            > balance*settled*h) return
      end associate
    end do
    yes = .true.
  end function balanced

  !> Let all go on through so many sub-sweeps with the impulses of the last one.
  pure subroutine go_on(h, times, rows)
    real(wp), intent(in) :: h   !! [s]
    integer, intent(in) :: times
    type(rows_t), intent(inout) :: rows
    integer :: s, k
    real(wp) :: free(6)

    do s = 1, times
      do k = 1, rows%n_pairs
        rows%turn(:, k) = rows%turn(:, k) + cross(half_way_past(k, rows), rows%push(:, k))
      end do
      do k = 1, rows%n_active
        associate (b => rows%active(k))
          free = rows%v(:, b) + h*rows%a_free(:, b)
          rows%v(:, b) = free + rows%by_contact(:, b)
          rows%way(:, b) = rows%way(:, b) + h*rows%v(:, b)
        end associate
      end do
    end do
  end subroutine go_on

  !> Restitution after Newton: where a body was hit faster than `slowest`, all its contact points
  !! leave with e times the speed at which they came, v_n = -e v_n(start), unless their impulse of
  !! the whole step would pull. So no energy is made: that of impulses P is the sum of
  !! P (v_n + v_n(start))/2. The arms are those of where the bodies are now.
  pure subroutine restore(e, slowest, rows)
    real(wp), intent(in) :: e         !! [-]
    real(wp), intent(in) :: slowest   !! [m/s]
    type(rows_t), intent(inout) :: rows
    real(wp) :: p(3)
    integer :: i, k, m, r, hits

    if (e <= 0.0_wp) return
    call list_hits(slowest, rows, hits)
    if (hits > 0) call move_arms(hits, rows)
    do i = 1, merge(n_restore, 0, hits > 0)
      k = 1
      do m = 1, hits
        r = rows%hit(m)
        do while (rows%first(k + 1) <= r)
          k = k + 1
        end do
        associate (row => rows%row(r), own => rows%returned(:, m), a => rows%a(k), b => rows%b(k))
          p = in_space(own, row)
          call bounce(e*rows%closing(r), past(rows%v(:, a), rows%v(:, b), row), row, &
                      rows%total(:, r), own)
          p = in_space(own, row) - p
          call add_impulse(rows%inverse_mass(a), rows%inverse_inertia(:, :, a), row%arm_a, -p, &
                         rows%v(:, a))
          call add_impulse(rows%inverse_mass(b), rows%inverse_inertia(:, :, b), row%arm_b, p, &
                         rows%v(:, b))
        end associate
      end do
    end do
    do m = 1, hits
      rows%total(:, rows%hit(m)) = rows%total(:, rows%hit(m)) + rows%returned(:, m)
    end do
  end subroutine restore

  !> List the rows that bore something, of bodies that were hit.
  pure subroutine list_hits(slowest, rows, hits)
    real(wp), intent(in) :: slowest   !! [m/s]
    type(rows_t), intent(inout) :: rows
    integer, intent(out) :: hits
    integer :: k, r

    rows%struck = .false.
    do k = 1, rows%n_pairs
      do r = rows%first(k), rows%first(k + 1) - 1
        if (rows%largest(r) > 0.0_wp .and. rows%closing(r) < -slowest) then
          rows%struck([rows%a(k), rows%b(k)]) = .true.
        end if
      end do
    end do
    hits = 0
    do k = 1, rows%n_pairs
      associate (a => rows%a(k), b => rows%b(k))
        if (.not. (rows%struck(a) .and. rows%inverse_mass(a) > 0.0_wp) .and. &
            .not. (rows%struck(b) .and. rows%inverse_mass(b) > 0.0_wp)) cycle
      end associate
      do r = rows%first(k), rows%first(k + 1) - 1
        if (.not. rows%largest(r) > 0.0_wp) cycle
        if (abs(rows%closing(r)) <= slowest) rows%closing(r) = 0.0_wp
        hits = hits + 1
        rows%hit(hits) = r
        rows%returned(:, hits) = 0.0_wp
      end do
    end do
  end subroutine list_hits

  !> Let all turn by what the way of the bodies added to their arms, and move the contacts of the
  !! rows that were hit half way from a to b, see `half_way_past`. The sum of twists takes the
  !! old arms: what these impulses were until now is added to `turn`.
  pure subroutine move_arms(hits, rows)
    integer, intent(in) :: hits
    type(rows_t), intent(inout) :: rows
    real(wp) :: way(3), p(3), closing
    integer :: k, m, r

    do k = 1, rows%n_pairs
      associate (a => rows%a(k), b => rows%b(k))
        rows%v(4:6, a) = rows%v(4:6, a) + matmul(rows%inverse_inertia(:, :, a), rows%turn(:, k))
        rows%v(4:6, b) = rows%v(4:6, b) + matmul(rows%inverse_inertia(:, :, b), rows%turn(:, k))
      end associate
    end do
    k = 1
    do m = 1, hits
      r = rows%hit(m)
      do while (rows%first(k + 1) <= r)
        k = k + 1
      end do
      way = half_way_past(k, rows)
      associate (row => rows%row(r), total => rows%total(:, r))
        p = in_space(total, row)
        rows%turn(:, k) = rows%turn(:, k) - cross(way, p)
        row%arm_a = row%arm_a - way
        row%arm_b = row%arm_b + way
        if (abs(rows%closing(r)) > 0.0_wp) then
          closing = dot_product(row%n, past(rows%v_start(:, rows%a(k)), rows%v_start(:, &
            rows%b(k)), row))
          rows%closing(r) = merge(min(closing, 0.0_wp), closing, rows%closing(r) < 0.0_wp)
        end if
      end associate
    end do
  end subroutine move_arms

  !> Correct the impulse by which a row of a body that was hit opens at the speed asked for.
  pure subroutine bounce(wanted, v, row, before, own)
    real(wp), intent(in) :: wanted      !! e v_n(start) [m/s]
    real(wp), intent(in) :: v(3)        !! of b past a [m/s]
    type(row_t), intent(in) :: row
    real(wp), intent(in) :: before(3)   !! impulse of the step until now [N s]
    real(wp), intent(inout) :: own(3)   !! that of the restitution [N s]
    real(wp) :: normal, slip(3), whole(3)

    normal = own(1)
    own(1) = max(-before(1), normal - row%mass*(dot_product(row%n, v) + wanted))
    slip = v + (own(1) - normal)*row%response
    whole = before + own
    call rub(row, dot_product(row%e1, slip), dot_product(row%e2, slip), whole)
    own(2:3) = whole(2:3) - before(2:3)
  end subroutine bounce

end module impulse_sweeps_m
