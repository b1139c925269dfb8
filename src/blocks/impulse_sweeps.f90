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
!!
!! Where a row was hit, sweeps over the impulses of the whole step go on through the chain of bodies
!! that this reaches until little changes, 160 at most: v = v_c. Then each row gives back e times
!! what its impulse gained beyond the load before, gamma_b, normal and tangential alike (Poisson):
!!
!! $$ \gamma = \gamma_c + e (\gamma_c - \gamma_b), \qquad v = v_c + e (v_c - v_b). $$
!!
!! This makes no energy: the work is (1 + e) (gamma_c - gamma_b).v_c - (1 - e^2)/2 M u.u, u = v_c -
!! v_b, and (gamma_c - gamma_b).v_c <= 0, as what pushes does not open and friction opposes slip.
!!
!! Where masses differ much, sweeps are directions of conjugate gradients: Silcowitz-Hansen et al.
!! (2010), A nonsmooth nonlinear conjugate gradient method.
module impulse_sweeps_m
  use kinds_m, only: wp
  use vectors_m, only: cross, norm
  use parallel_m, only: get_threads
  use impulse_rows_m, only: row_t, rows_t, past, in_space
  implicit none
  private
  public :: solve_rows

  integer, parameter :: n_correct = 2           !! sweeps with bias; one lets the stack creep
  integer, parameter :: n_busy = 16             !! where bodies change much, at most
  real(wp), parameter :: busy = 1.0_wp          !! change of a sweep that asks for another [g]
  integer, parameter :: n_finish = 160          !! sweeps over an impact, at most
  integer, parameter :: n_open = 6              !! sweeps after what it returned
  integer, parameter :: n_hard = 400            !! sweeps where masses differ much, at most
  real(wp), parameter :: max_turn = 0.02_wp     !! by contact in the rest of a step, times e [rad]
  integer, parameter :: never = -2              !! no sweep changed it
  integer, parameter :: worth_threads = 512     !! fewer rows are the work of one thread
  real(wp), parameter :: settled = 1.0e-6_wp    !! change of a sweep that no longer counts [g]
  real(wp), parameter :: balance = 10.0_wp      !! acceleration left, over that, that counts [-]
  real(wp), parameter :: slow_hit = 2.0_wp      !! speed below which no impact bounces, over g dt
  real(wp), parameter :: small = 0.03_wp        !! change that ends an impact, over slow hits [-]
  real(wp), parameter :: fast_share = 2.0e-3_wp !! the same, over the fastest hit [-]
  real(wp), parameter :: residual = 1.0e-7_wp   !! where masses differ much, over the first change

contains

  !> Impulses, velocities and ways of a contact step of n sub-sweeps, or of fewer: the step ends
  !! where contact has changed a spin so much that the bodies would turn far in the rest of it.
  !! Where nothing changes any more, and all is in balance, the rest of the step goes on as it is.
  subroutine solve_rows(h, g, push_max, e, n, rows)
    real(wp), intent(in) :: h, g       !! sub-sweep [s], gravity [m/s2]
    real(wp), intent(in) :: push_max   !! largest speed with which overlaps open [m/s]
    real(wp), intent(in) :: e          !! restitution [-]
    integer, intent(inout) :: n        !! sub-sweeps
    type(rows_t), intent(inout) :: rows
    logical :: backward
    real(wp) :: change, largest, spin
    integer :: s, k, left, r

    rows%h = h
    rows%fall = g*h
    rows%push_max = push_max
    rows%small = busy*rows%fall
    rows%impact = .false.
    call apply_remembered(rows)
    do s = 1, n
      call begin_sweep(h, rows)
      backward = mod(s, 2) /= 0
      call settle(.true., n_correct, backward, rows, change)
      call move(h, rows)
      backward = mod(s, 2) == 0
      call settle(.false., 1, backward, rows, largest)
      change = max(change, largest)
      spin = 0.0_wp
      do k = 1, rows%n_active
        associate (b => rows%active(k))
          rows%by_contact(:, b) = rows%v(:, b) - rows%by_contact(:, b)
          spin = max(spin, norm(rows%v(4:6, b) - rows%v_start(4:6, b)))
        end associate
      end do
      left = 1
      if (change < settled*rows%fall .and. s < n) then
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
      if (e*spin*h*real(n - s, wp) > max_turn) n = s
      if (s >= n) exit
    end do
    call end_impacts(n, e, backward, rows)
  end subroutine solve_rows

  !> Change of the velocities by the impulses remembered.
  pure subroutine apply_remembered(rows)
    type(rows_t), intent(inout) :: rows
    integer :: k, r

    do k = 1, rows%n_pairs
      do r = rows%first(k), rows%first(k + 1) - 1
        associate (row => rows%row(r), a => rows%a(k), b => rows%b(k), p => in_space( &
          rows%row(r)%impulse, rows%row(r)))
          rows%by_contact(:, a) = rows%by_contact(:, a) - by_impulse(a, row%arm_a, p, rows)
          rows%by_contact(:, b) = rows%by_contact(:, b) + by_impulse(b, row%arm_b, p, rows)
        end associate
      end do
    end do
  end subroutine apply_remembered

  !> Change of the velocity and spin of a body by an impulse at an arm.
  pure function by_impulse(b, arm, p, rows) result(dv)
    integer, intent(in) :: b
    real(wp), intent(in) :: arm(3), p(3)   !! [m], [N s]
    type(rows_t), intent(in) :: rows
    real(wp) :: dv(6)                      !! [m/s], [rad/s]
    real(wp) :: twist(3)

    dv = 0.0_wp
    if (rows%inverse_mass(b) <= 0.0_wp) return
    twist = cross(arm, p)
    dv(1:3) = rows%inverse_mass(b)*p
    dv(4:6) = rows%inverse_inertia(:, 1, b)*twist(1) + rows%inverse_inertia(:, 2, b)*twist(2) &
      + rows%inverse_inertia(:, 3, b)*twist(3)
  end function by_impulse

  !> Change of the velocities of pair k by an impulse on b at its row r, also booked as twist.
  pure subroutine push(p, k, r, rows)
    real(wp), intent(in) :: p(3)   !! [N s]
    integer, intent(in) :: k, r
    type(rows_t), intent(inout) :: rows
    real(wp) :: half(3)

    half = half_way_past(k, rows)
    associate (row => rows%row(r), a => rows%a(k), b => rows%b(k))
      rows%v(:, a) = rows%v(:, a) - by_impulse(a, row%arm_a - half, p, rows)
      rows%v(:, b) = rows%v(:, b) + by_impulse(b, row%arm_b + half, p, rows)
    end associate
    rows%turn(:, k) = rows%turn(:, k) + cross(half, p)
  end subroutine push

  !> Begin a sub-sweep: free fall and the impulses of the one before. What `by_contact` holds until
  !! the sub-sweep ends are the velocities without contact.
  pure subroutine begin_sweep(h, rows)
    real(wp), intent(in) :: h   !! [s]
    type(rows_t), intent(inout) :: rows
    real(wp) :: free(6), p(3)
    integer :: k, r

    do k = 1, rows%n_active
      associate (b => rows%active(k))
        free = rows%v(:, b) + h*rows%a_free(:, b)
        rows%v(:, b) = free + rows%by_contact(:, b)
        rows%by_contact(:, b) = free
      end associate
    end do
    do k = 1, rows%n_pairs
      p = 0.0_wp
      do r = rows%first(k), rows%first(k + 1) - 1
        p = p + in_space(rows%row(r)%impulse, rows%row(r))
      end do
      rows%turn(:, k) = rows%turn(:, k) + cross(half_way_past(k, rows), p)
    end do
  end subroutine begin_sweep

  !> Move the bodies and let the rows follow.
  pure subroutine move(h, rows)
    real(wp), intent(in) :: h   !! [s]
    type(rows_t), intent(inout) :: rows
    integer :: k, r

    do k = 1, rows%n_active
      associate (b => rows%active(k))
        rows%way(:, b) = rows%way(:, b) + h*rows%v(:, b)
      end associate
    end do
    do k = 1, rows%n_pairs
      do r = rows%first(k), rows%first(k + 1) - 1
        associate (row => rows%row(r))
          row%way = past(rows%way(:, rows%a(k)), rows%way(:, rows%b(k)), row%arm_a, row%arm_b)
          row%gap = row%gap_start + dot_product(row%n, row%way)
        end associate
      end do
    end do
  end subroutine move

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

  !> So many sweeps and, with bias, more over what still changes; where masses differ much as many
  !! as they need; over an impact until nothing changes.
  subroutine settle(bias, n, backward, rows, change)
    logical, intent(in) :: bias           !! see `correct`
    integer, intent(in) :: n              !! sweeps
    logical, intent(inout) :: backward    !! whether the next sweep is
    type(rows_t), intent(inout) :: rows
    real(wp), intent(out) :: change       !! largest of a velocity [m/s]
    real(wp) :: first, last
    integer :: i, most

    change = 0.0_wp
    first = 0.0_wp
    most = n
    if (rows%hard) then
      most = n_hard
    else if (bias) then
      most = n_busy
    end if
    rows%number = merge(1, 0, rows%impact)
    if (.not. rows%impact) rows%changed = never
    if (rows%hard .or. rows%impact) call begin_directions(rows)
    do i = 1, most
      call sweep(bias, backward, rows, last)
      backward = .not. backward
      change = max(change, last)
      if (i == n) first = last
      if (rows%hard .and. .not. rows%impact) then
        if (i >= n .and. last <= max(residual*first, settled*rows%fall)) exit
      else if (rows%impact .or. i >= n) then
        if (last < rows%small) exit
        rows%number = rows%number + 1
      end if
      if (i < most .and. mod(i, 2) == 0 .and. (rows%hard .or. rows%impact)) call accelerate(rows)
    end do
  end subroutine settle

  !> One sweep over all pairs, colour by colour, or backwards.
  subroutine sweep(bias, backward, rows, change)
    logical, intent(in) :: bias, backward
    type(rows_t), intent(inout) :: rows
    real(wp), intent(out) :: change       !! largest, of a velocity [m/s]
    real(wp) :: most
    integer :: i, c, m, last, chunk

    change = 0.0_wp
    last = rows%n_colours
    !$omp parallel private(i, c, m, chunk, most) if (rows%n > worth_threads)
    most = 0.0_wp
    do i = 1, last
      c = merge(last + 1 - i, i, backward)
      chunk = rows%begin(c + 1) - rows%begin(c)   ! pairs of the last of all may share a body
      if (c < size(rows%begin) - 1) chunk = chunk/get_threads() + 1
      !$omp do schedule(static, chunk)
      do m = rows%begin(c), rows%begin(c + 1) - 1
        call solve_pair(bias, backward, rows%order(m), rows, most)
      end do
      !$omp end do
    end do
    !$omp critical
    change = max(change, most)
    !$omp end critical
    !$omp end parallel
  end subroutine sweep

  !> Correct the impulses of the rows of one pair, one after the other, if it is to be solved.
  subroutine solve_pair(bias, backward, k, rows, change)
    logical, intent(in) :: bias, backward
    integer, intent(in) :: k
    type(rows_t), intent(inout) :: rows
    real(wp), intent(inout) :: change
    real(wp) :: va(6), vb(6), v(3), p(3), total(3), half(3), arm_a(3), arm_b(3), mass, most, h
    integer :: r, from, to, way

    associate (a => rows%a(k), b => rows%b(k))
      if (.not. is_live(k, rows)) return
      rows%reached(k) = .true.
      rows%directed(k) = .true.
      from = merge(rows%first(k + 1) - 1, rows%first(k), backward)
      to = merge(rows%first(k), rows%first(k + 1) - 1, backward)
      way = merge(-1, 1, backward)
      va = rows%v(:, a)
      vb = rows%v(:, b)
      mass = rows%inverse_mass(a) + rows%inverse_mass(b)
      half = half_way_past(k, rows)
      v = vb(1:3) - va(1:3) + cross(va(4:6) + vb(4:6), half)
      total = 0.0_wp
      most = 0.0_wp
      do r = from, to, way
        associate (row => rows%row(r))
          h = rows%h   ! what pushed in an impact counts as closed
          if (row%impulse(1) > 0.0_wp) then
            if (rows%impact) h = huge(h)
          else if (.not. any(abs(row%impulse) > 0.0_wp)) then   ! idle?
            if (dot_product(row%n, v) + dot_product(row%lever_b, vb(4:6)) &
                - dot_product(row%lever_a, va(4:6)) >= opening(h, rows%push_max, bias, row)) cycle
          end if
          arm_a = row%arm_a - half
          arm_b = row%arm_b + half
          call correct(h, rows%push_max, bias, past(va, vb, arm_a, arm_b), row, p)
          rows%largest(r) = max(rows%largest(r), row%impulse(1))
          if (.not. any(abs(p) > 0.0_wp)) cycle
          va = va - by_impulse(a, arm_a, p, rows)
          vb = vb + by_impulse(b, arm_b, p, rows)
          v = vb(1:3) - va(1:3) + cross(va(4:6) + vb(4:6), half)
        end associate
        total = total + p
        most = max(most, (abs(p(1)) + abs(p(2)) + abs(p(3)))*mass)
      end do
      if (rows%inverse_mass(a) > 0.0_wp) rows%v(:, a) = va
      if (rows%inverse_mass(b) > 0.0_wp) rows%v(:, b) = vb
      rows%turn(:, k) = rows%turn(:, k) + cross(half, total)
      change = max(change, most)
      if (most >= rows%small) call mark(rows%number, k, rows)
    end associate
  end subroutine solve_pair

  !> Speed with which a row is to open at least: a gap may close in a sub-sweep [m/s].
  pure real(wp) function opening(h, push_max, bias, row)
    real(wp), intent(in) :: h, push_max   !! [s], [m/s]
    logical, intent(in) :: bias           !! overlaps open; else their velocity is taken away
    type(row_t), intent(in) :: row

    opening = 0.0_wp
    if (row%gap > 0.0_wp) then
      opening = -row%gap/h
    else if (bias) then
      opening = min(-row%rate*row%gap, push_max)
    end if
  end function opening

  !> Correct the impulse of one row: along the normal, then friction with the velocity after that.
  pure subroutine correct(h, push_max, bias, v, row, p)
    real(wp), intent(in) :: h, push_max   !! [s], [m/s]
    logical, intent(in) :: bias           !! overlaps open; else their velocity is taken away
    real(wp), intent(in) :: v(3)          !! of b past a [m/s]
    type(row_t), intent(inout) :: row
    real(wp), intent(out) :: p(3)         !! change of the impulse on b [N s]
    real(wp) :: rate, normal, slip(3), before(3)

    rate = 0.0_wp
    normal = row%mass*(dot_product(row%n, v) - opening(h, push_max, bias, row))
    if (bias .and. row%gap <= 0.0_wp) then
      rate = row%rate
      normal = row%soft*normal + row%keep*row%impulse(1)
    end if
    normal = max(0.0_wp, row%impulse(1) - normal)
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
            > balance*settled*rows%fall) return
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

    do s = 1, times
      call begin_sweep(h, rows)
      do k = 1, rows%n_active
        associate (b => rows%active(k))
          rows%by_contact(:, b) = rows%v(:, b) - rows%by_contact(:, b)
          rows%way(:, b) = rows%way(:, b) + h*rows%v(:, b)
        end associate
      end do
    end do
  end subroutine go_on

  !> Whether a pair is to be solved: all, or later those with a body that changed just now.
  pure function is_live(k, rows) result(yes)
    integer, intent(in) :: k
    type(rows_t), intent(in) :: rows
    logical :: yes

    yes = rows%number == 0
    if (.not. yes) yes = max(rows%changed(rows%a(k)), rows%changed(rows%b(k))) >= rows%number - 2
  end function is_live

  !> Keep the impulses from before the first sweep; there is no direction yet.
  pure subroutine begin_directions(rows)
    type(rows_t), intent(inout) :: rows
    integer :: r

    rows%reached(:rows%n_pairs) = .false.
    rows%directed(:rows%n_pairs) = .false.
    do r = 1, rows%n
      rows%kept(:, r) = rows%row(r)%impulse
      rows%along(:, r) = 0.0_wp
    end do
    rows%square = 0.0_wp
  end subroutine begin_directions

  !> Go on along the last direction of the impulses, and make the next one of this and the change by
  !! two sweeps, there and back: beta is the ratio of the squares of the changes, none above 1.
  pure subroutine accelerate(rows)
    type(rows_t), intent(inout) :: rows
    real(wp) :: square, beta, step(3)
    integer :: k, r

    square = 0.0_wp
    do k = 1, rows%n_pairs
      if (.not. is_live(k, rows)) cycle
      do r = rows%first(k), rows%first(k + 1) - 1
        square = square + sum((rows%row(r)%impulse - rows%kept(:, r))**2)/rows%row(r)%mass
      end do
    end do
    beta = 0.0_wp
    if (square < rows%square) beta = square/rows%square
    rows%square = square
    do k = 1, rows%n_pairs
      if (.not. rows%directed(k)) cycle
      rows%directed(k) = is_live(k, rows)
      do r = rows%first(k), rows%first(k + 1) - 1
        associate (row => rows%row(r), along => rows%along(:, r))
          step = row%impulse - rows%kept(:, r)
          along = beta*along
          if (.not. rows%directed(k)) along = 0.0_wp
          row%impulse = row%impulse + along
          rows%kept(:, r) = row%impulse
          if (any(abs(along) > 0.0_wp)) call push(in_space(along, row), k, r, rows)
          along = along + step
        end associate
      end do
    end do
  end subroutine accelerate

  !> End the impacts of a step of n sub-sweeps in it: nothing closes any more, then the rows reached
  !! give back what they are to, then nothing closes again. None of it is remembered.
  subroutine end_impacts(n, e, backward, rows)
    integer, intent(in) :: n
    real(wp), intent(in) :: e            !! restitution [-]
    logical, intent(inout) :: backward   !! whether the next sweep is
    type(rows_t), intent(inout) :: rows
    real(wp) :: slowest, speed   ! closing speed of a hit, of the fastest [m/s]
    integer :: i, k, r

    slowest = slow_hit*rows%fall*real(n, wp)
    call mark_hits(slowest, rows, speed)
    if (.not. speed > 0.0_wp) return
    rows%small = max(small*slowest, fast_share*speed)
    do r = 1, rows%n
      rows%returned(:, r) = rows%row(r)%impulse
      rows%row(r)%impulse = rows%total(:, r)
    end do
    rows%impact = .true.
    call settle(.false., n_finish, backward, rows, speed)
    do r = 1, rows%n
      associate (row => rows%row(r), gained => rows%gained(:, r))
        rows%total(:, r) = row%impulse
        gained = row%impulse - real(n, wp)*rows%base(:, r)
        row%impulse = rows%base(:, r)
        if (all(abs(gained) <= rows%small*row%mass)) then   ! bears on
          gained = 0.0_wp
          row%impulse = rows%returned(:, r)
        end if
      end associate
      rows%returned(:, r) = 0.0_wp
    end do
    if (e > 0.0_wp) then
      do i = 0, n_open
        do k = 1, rows%n_pairs
          if (rows%reached(k)) call give_back(e, i == 0, k, rows)
        end do
      end do
    end if
    do r = 1, rows%n
      rows%total(:, r) = rows%total(:, r) + rows%returned(:, r)
    end do
  end subroutine end_impacts

  !> Mark the bodies of the pairs that were hit: a row bore more than before that closed faster than
  !! the slowest hit when the step began.
  pure subroutine mark_hits(slowest, rows, speed)
    real(wp), intent(in) :: slowest   !! [m/s]
    type(rows_t), intent(inout) :: rows
    real(wp), intent(out) :: speed    !! largest of a hit, 0: none [m/s]
    integer :: k, r

    speed = 0.0_wp
    rows%changed = never
    do k = 1, rows%n_pairs
      do r = rows%first(k), rows%first(k + 1) - 1
        if (rows%closing(r) >= -slowest .or. .not. rows%largest(r) > 0.0_wp) cycle
        speed = max(speed, -rows%closing(r))
        call mark(0, k, rows)
      end do
    end do
  end subroutine mark_hits

  !> Mark the bodies of a pair that yield as changed by a sweep.
  pure subroutine mark(number, k, rows)
    integer, intent(in) :: number, k
    type(rows_t), intent(inout) :: rows

    if (rows%inverse_mass(rows%a(k)) > 0.0_wp) rows%changed(rows%a(k)) = number
    if (rows%inverse_mass(rows%b(k)) > 0.0_wp) rows%changed(rows%b(k)) = number
  end subroutine mark

  !> Let the rows of a pair give back e times what their impulses changed, within the bounds; or, in
  !! the sweeps after that, let no closed row close, and none return less.
  pure subroutine give_back(e, first, k, rows)
    real(wp), intent(in) :: e      !! [-]
    logical, intent(in) :: first
    integer, intent(in) :: k
    type(rows_t), intent(inout) :: rows
    real(wp) :: least, before(3), whole(3), half(3), bound, length
    integer :: r

    half = half_way_past(k, rows)
    do r = rows%first(k), rows%first(k + 1) - 1
      associate (row => rows%row(r), back => rows%returned(:, r), total => rows%total(:, r), &
        a => rows%a(k), b => rows%b(k))
        before = back
        least = max(e*rows%gained(1, r), -total(1))
        if (first) then
          back = [least, e*rows%gained(2:3, r)]
          whole = total + back
          length = sqrt(whole(2)**2 + whole(3)**2)
          bound = row%friction*whole(1)
          if (length > bound) back(2:3) = whole(2:3)*(bound/length) - total(2:3)
        else if (total(1) > 0.0_wp .or. row%gap <= 0.0_wp) then
          back(1) = max(least, back(1) - row%mass*dot_product(row%n, past(rows%v(:, a), &
            rows%v(:, b), row%arm_a - half, row%arm_b + half)))
        end if
        call push(in_space(back - before, row), k, r, rows)
      end associate
    end do
  end subroutine give_back

end module impulse_sweeps_m
