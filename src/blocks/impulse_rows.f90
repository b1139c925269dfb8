!> The contact points of one contact step as constraints: what is solved for the impulses, and what
!! is remembered of them.
!!
!! A row is a contact point that is there or may come in the step. Rows of one pair of counterparts
!! stand together. Pairs have colours: those of one colour share no body that moves, so that the
!! order of their solution does not matter, nor the number of threads.
module impulse_rows_m
  use kinds_m, only: wp, i8, pi
  use growing_m, only: ensure_capacity
  use case_types_m, only: contact_input_t
  use vectors_m, only: cross, norm
  use rigid_body_m, only: blocks_t
  use bed_m, only: bed_counterpart
  use contact_points_m, only: contact_point_t, contact_points_t
  use displacements_m, only: displacements_t, reserve_displacements, comes_before
  use counterparts_m, only: counterparts_t, kind_of
  implicit none
  private
  public :: row_t, rows_t, rows_init, make_rows, store_memory, sum_loads, past, in_space

  !> One contact point: its frame, the masses it works on, and its impulse, on counterpart b. What
  !! tells that it is idle comes first, for most are.
  type :: row_t
    real(wp) :: impulse(3) = 0.0_wp                   !! of a sub-sweep along n, e1, e2 [N s]
    real(wp) :: gap = 0.0_wp                          !! now [m]
    real(wp) :: n(3) = 0.0_wp                         !! normal from a to b [-]
    real(wp) :: lever_a(3) = 0.0_wp, lever_b(3) = 0.0_wp  !! arm x n [m]
    real(wp) :: e1(3) = 0.0_wp, e2(3) = 0.0_wp        !! tangents [-]
    real(wp) :: arm_a(3) = 0.0_wp, arm_b(3) = 0.0_wp  !! from the centres to the contact [m]
    real(wp) :: response(3) = 0.0_wp                  !! K n: velocity by a unit push [1/kg]
    real(wp) :: mass = 0.0_wp                         !! 1/(n.K n) [kg]
    real(wp) :: mass_11 = 0.0_wp, mass_12 = 0.0_wp, mass_22 = 0.0_wp  !! of the tangents [kg]
    real(wp) :: mass_slip = 0.0_wp                    !! one over the largest K along the tangents
    real(wp) :: gap_start = 0.0_wp                    !! when the step began [m]
    real(wp) :: friction = 0.0_wp                     !! [-]
    real(wp) :: rate = 0.0_wp                         !! at which an overlap is taken back [1/s]
    real(wp) :: soft = 1.0_wp, keep = 0.0_wp          !! share of the mass, of the impulse [-]
    real(wp) :: stretch(2) = 0.0_wp                   !! tangential way remembered [m]
    real(wp) :: way(3) = 0.0_wp                       !! of b past a since the step began [m]
  end type row_t

  type :: rows_t
    real(wp) :: friction(3) = 0.0_wp              !! Coulomb, see `kind_of` [-]
    real(wp) :: contact_time = 0.0_wp             !! [s]
    integer :: n = 0
    type(row_t), allocatable :: row(:)
    integer, allocatable :: point(:)              !! (n) number in the list of contact points
    real(wp), allocatable :: closing(:)           !! (n) normal velocity at the start [m/s]
    real(wp), allocatable :: largest(:)           !! (n) largest normal impulse of the step [N s]
    real(wp), allocatable :: total(:, :)          !! (3, n) impulse of the whole step [N s]
    real(wp), allocatable :: base(:, :)           !! (3, n) remembered, of a sub-sweep [N s]
    real(wp), allocatable :: gained(:, :)         !! (3, n) by impacts [N s]
    real(wp), allocatable :: returned(:, :)       !! (3, n) by restitution [N s]
    integer :: n_pairs = 0
    integer, allocatable :: a(:), b(:), first(:)  !! (n_pairs), (n_pairs + 1) rows of each
    integer, allocatable :: colour(:)             !! (n_pairs)
    real(wp), allocatable :: turn(:, :)           !! (3, n_pairs) twist of both by their way [N m s]
    integer :: n_colours = 0
    integer, allocatable :: order(:)              !! (n_pairs) pairs, colour by colour
    integer, allocatable :: begin(:)              !! (n_colours + 1) in `order`
    integer(i8), allocatable :: used(:)           !! (n) work: colours of each body
    integer :: n_active = 0
    integer, allocatable :: active(:)             !! bodies that move and have rows
    logical, allocatable :: busy(:)               !! (counterparts) has rows
    integer, allocatable :: changed(:)
      !! (counterparts) sweep that changed it last, or never
    real(wp), allocatable :: v(:, :)
      !! (6, counterparts) velocity and spin [m/s], [rad/s]
    real(wp), allocatable :: way(:, :)
      !! (6, counterparts) since the step began [m], [rad]
    real(wp), allocatable :: a_free(:, :)
      !! (6, counterparts) without contact [m/s2], [rad/s2]
    real(wp), allocatable :: v_start(:, :)        !! (6, counterparts) when the step began
    real(wp), allocatable :: by_contact(:, :)     !! (6, counterparts) change of v in a sub-sweep
    !> Work where masses differ much: impulses and velocities before a sweep, directions.
    logical :: hard = .false.
    real(wp) :: h = 0.0_wp                        !! sub-sweep [s]
    real(wp) :: push_max = 0.0_wp, fall = 0.0_wp  !! of opening, by gravity in a sub-sweep [m/s]
    logical :: impact = .false.                   !! sweeps are over the impulses of a whole step
    integer :: number = 0                         !! of the sweep, 0: over all pairs
    real(wp) :: small = 0.0_wp                    !! change of a velocity that ends them [m/s]
    logical, allocatable :: reached(:), directed(:)   !! (n_pairs) by them, has a direction now
    real(wp) :: square = 0.0_wp                   !! of the last change of the impulses
    real(wp), allocatable :: kept(:, :), along(:, :)       !! (3, n) [N s]
    real(wp), allocatable :: inverse_mass(:)      !! (counterparts) 0: does not yield [1/kg]
    real(wp), allocatable :: inverse_inertia(:, :, :)   !! (3, 3, counterparts) [1/(kg m2)]
  end type rows_t

  real(wp), parameter :: damping_ratio = 5.0_wp
    !! of the soft contact points: they do not swing [-]
  real(wp), parameter :: sinking = 0.01_wp
    !! overlap by the force remembered, at most, over the length of the contact point [-]
  real(wp), parameter :: min_weight = 0.02_wp     !! of a contact point that counts [-]
  real(wp), parameter :: max_ratio = 10.0_wp      !! of masses that a few sweeps hold [-]
  integer, parameter :: max_colours = 64          !! pairs of the last one are solved one by one

contains

  !> Room for the counterparts of a case.
  subroutine rows_init(input, n, rows)
    type(contact_input_t), intent(in) :: input
    integer, intent(in) :: n                      !! bodies
    type(rows_t), intent(out) :: rows

    rows%friction = [input%friction, input%wall_friction, input%bed_friction]
    rows%contact_time = input%contact_time
    allocate (rows%v(6, bed_counterpart:n), rows%v_start(6, bed_counterpart:n), source=0.0_wp)
    allocate (rows%way(6, bed_counterpart:n), rows%a_free(6, bed_counterpart:n), &
      rows%by_contact(6, bed_counterpart:n), rows%inverse_mass(bed_counterpart:n), &
      rows%inverse_inertia(3, 3, bed_counterpart:n), source=0.0_wp)
    allocate (rows%used(n), source=0_i8)
    allocate (rows%active(n + 1 - bed_counterpart), source=0)
    allocate (rows%busy(bed_counterpart:n), source=.false.)
    allocate (rows%changed(bed_counterpart:n), source=0)
    allocate (rows%begin(max_colours + 1), source=1)
  end subroutine rows_init

  !> Rows of all contact points of a contact step, with the impulses and stretches remembered.
  !!
  !! The soft contact point is a spring of the frequency 1/contact_time of what it pushes, and at
  !! least as stiff as holds the force F of the last step at a small overlap d, w^2 = F/(m_n d);
  !! damped so much that it creeps back: a1 = 2 zeta + h w, a2 = h w a1, a3 = 1/(1 + a2); Catto,
  !! Solver2D (2024).
  subroutine make_rows(h, points, counterparts, blocks, memory, rows)
    real(wp), intent(in) :: h                     !! sub-sweep [s]
    type(contact_points_t), intent(in) :: points
    type(counterparts_t), intent(in) :: counterparts
    type(blocks_t), intent(in) :: blocks
    type(displacements_t), intent(in) :: memory
    type(rows_t), intent(inout) :: rows
    real(wp) :: w, a1, a2
    integer :: t, m, r, b

    call copy_counterparts(counterparts, blocks, rows)
    call reserve_rows(points%n, rows)
    rows%n = 0
    rows%n_pairs = 0
    rows%hard = .false.
    m = 1
    do t = 1, points%n
      associate (point => points%item(t))
        if (point%weight < min_weight) cycle
        r = rows%n + 1
        rows%n = r
        rows%point(r) = t
        call begin_pair(point%a, point%b, rows)
        rows%row(r) = row_t(n=point%normal, arm_a=point%arm_a, arm_b=point%arm_b, &
          gap=-point%depth, gap_start=-point%depth, &
          lever_a=cross(point%arm_a, point%normal), lever_b=cross(point%arm_b, point%normal), &
          friction=rows%friction(kind_of(point%b)))
        call weigh(point%a, point%b, counterparts, rows, rows%row(r))
        call recall(point, h, memory, m, rows%row(r))
        associate (row => rows%row(r))
          w = sqrt(max(point%weight*(2*pi/rows%contact_time)**2, &
            row%impulse(1)/(h*row%mass*sinking*point%length)))
          a1 = 2*damping_ratio + h*w
          a2 = h*w*a1
          row%rate = w/a1
          row%soft = a2/(1.0_wp + a2)
          row%keep = 1.0_wp/(1.0_wp + a2)
        end associate
        rows%closing(r) = dot_product(past(rows%v(:, point%a), rows%v(:, point%b), &
          point%arm_a, point%arm_b), point%normal)
        rows%largest(r) = 0.0_wp
        rows%total(:, r) = 0.0_wp
        rows%base(:, r) = rows%row(r)%impulse
      end associate
    end do
    rows%first(rows%n_pairs + 1) = rows%n + 1
    ! List the counterparts that have rows and move.
    rows%n_active = 0
    do b = bed_counterpart, blocks%n
      if (.not. rows%busy(b)) cycle
      if (rows%inverse_mass(b) <= 0.0_wp .and. all(abs(rows%v(:, b)) <= 0.0_wp)) cycle
      rows%n_active = rows%n_active + 1
      rows%active(rows%n_active) = b
    end do
    call colour_pairs(rows)
  end subroutine make_rows

  !> Velocities and inverse inertia of the counterparts; what is held, sleeps or is moved at a given
  !! rate does not yield.
  pure subroutine copy_counterparts(counterparts, blocks, rows)
    type(counterparts_t), intent(in) :: counterparts
    type(blocks_t), intent(in) :: blocks
    type(rows_t), intent(inout) :: rows
    integer :: b

    do b = bed_counterpart, blocks%n
      rows%v(1:3, b) = counterparts%v(:, b)
      rows%v(4:6, b) = counterparts%omega(:, b)
      rows%v_start(:, b) = rows%v(:, b)
      rows%way(:, b) = 0.0_wp
      rows%by_contact(:, b) = 0.0_wp
      rows%busy(b) = .false.
      rows%inverse_mass(b) = counterparts%inverse_mass(b)
      rows%inverse_inertia(:, :, b) = counterparts%inverse_inertia(:, :, b)
      if (b < 1) cycle
      if (.not. blocks%fixed(b) .and. .not. blocks%asleep(b)) cycle
      rows%inverse_mass(b) = 0.0_wp
      rows%inverse_inertia(:, :, b) = 0.0_wp
    end do
  end subroutine copy_counterparts

  !> Make room for n rows and pairs.
  subroutine reserve_rows(n, rows)
    integer, intent(in) :: n
    type(rows_t), intent(inout) :: rows

    if (allocated(rows%row)) then
      if (n > size(rows%row)) deallocate (rows%row)
    end if
    if (.not. allocated(rows%row)) allocate (rows%row(2*n + 16))
    call ensure_capacity(n, rows%point)
    call ensure_capacity(n, rows%closing)
    call ensure_capacity(n, rows%largest)
    call ensure_capacity(n, rows%total)
    call ensure_capacity(n, rows%base)
    call ensure_capacity(n, rows%gained)
    call ensure_capacity(n, rows%returned)
    call ensure_capacity(n, rows%kept)
    call ensure_capacity(n, rows%along)
    call ensure_capacity(n, rows%a)
    call ensure_capacity(n, rows%b)
    call ensure_capacity(n + 1, rows%first)
    call ensure_capacity(n, rows%colour)
    call ensure_capacity(n, rows%order)
    call ensure_capacity(n, rows%reached)
    call ensure_capacity(n, rows%directed)
    call ensure_capacity(n, rows%turn)
  end subroutine reserve_rows

  !> Begin a new pair with row `rows%n`, unless it goes on with the last one.
  pure subroutine begin_pair(a, b, rows)
    integer, intent(in) :: a, b
    type(rows_t), intent(inout) :: rows
    real(wp) :: ratio

    if (rows%n_pairs > 0) then
      if (rows%a(rows%n_pairs) == a .and. rows%b(rows%n_pairs) == b) return
    end if
    rows%n_pairs = rows%n_pairs + 1
    rows%a(rows%n_pairs) = a
    rows%b(rows%n_pairs) = b
    rows%first(rows%n_pairs) = rows%n
    rows%turn(:, rows%n_pairs) = 0.0_wp
    rows%busy([a, b]) = .true.
    if (min(rows%inverse_mass(a), rows%inverse_mass(b)) <= 0.0_wp) return
    ratio = rows%inverse_mass(a)/rows%inverse_mass(b)
    rows%hard = rows%hard .or. max(ratio, 1.0_wp/ratio) > max_ratio
  end subroutine begin_pair

  !> Tangents of a row and the masses that two counterparts set against an impulse at it,
  !! K = J M^-1 J^T; of a sleeper that something moved touches as of one awake, so that it wakes.
  pure subroutine weigh(a, b, counterparts, rows, row)
    integer, intent(in) :: a, b
    type(counterparts_t), intent(in) :: counterparts
    type(rows_t), intent(in) :: rows
    type(row_t), intent(inout) :: row
    real(wp), parameter :: far_from_x = 0.6_wp   !! the normal is, below this cosine
    real(wp) :: k(3, 3), along_1(3), along_2(3), k_11, k_12, k_22, determinant

    if (abs(row%n(1)) < far_from_x) then
      row%e1 = [0.0_wp, row%n(3), -row%n(2)]
    else
      row%e1 = [-row%n(3), 0.0_wp, row%n(1)]
    end if
    row%e1 = row%e1/norm(row%e1)
    row%e2 = cross(row%n, row%e1)
    k = 0.0_wp
    call add_response(rows%inverse_mass(a), rows%inverse_inertia(:, :, a), row%arm_a, k)
    call add_response(rows%inverse_mass(b), rows%inverse_inertia(:, :, b), row%arm_b, k)
    if (max(rows%inverse_mass(a), rows%inverse_mass(b)) <= 0.0_wp) then
      associate (of => counterparts)
        call add_response(of%inverse_mass(a), of%inverse_inertia(:, :, a), row%arm_a, k)
        call add_response(of%inverse_mass(b), of%inverse_inertia(:, :, b), row%arm_b, k)
      end associate
    end if
    row%response = matmul(k, row%n)
    row%mass = 1.0_wp/dot_product(row%n, row%response)
    along_1 = matmul(k, row%e1)
    along_2 = matmul(k, row%e2)
    k_11 = dot_product(row%e1, along_1)
    k_12 = dot_product(row%e2, along_1)
    k_22 = dot_product(row%e2, along_2)
    determinant = k_11*k_22 - k_12**2
    row%mass_11 = k_22/determinant
    row%mass_12 = -k_12/determinant
    row%mass_22 = k_11/determinant
    row%mass_slip = 1.0_wp/(0.5_wp*(k_11 + k_22) + sqrt(0.25_wp*(k_11 - k_22)**2 + k_12**2))
  end subroutine weigh

  !> Add what a counterpart yields at its arm to a unit impulse: 1/m - [r] I^-1 [r].
  pure subroutine add_response(inverse_mass, inverse_inertia, arm, k)
    real(wp), intent(in) :: inverse_mass, inverse_inertia(3, 3), arm(3)   !! [1/kg], [1/(kg m2)]
    real(wp), intent(inout) :: k(3, 3)           !! [1/kg]
    real(wp) :: lever(3, 3)
    integer :: i

    if (inverse_mass <= 0.0_wp) return
    lever(:, 1) = [0.0_wp, arm(3), -arm(2)]
    lever(:, 2) = [-arm(3), 0.0_wp, arm(1)]
    lever(:, 3) = [arm(2), -arm(1), 0.0_wp]
    k = k + matmul(transpose(lever), matmul(inverse_inertia, lever))
    do i = 1, 3
      k(i, i) = k(i, i) + inverse_mass
    end do
  end subroutine add_response

  !> Velocity or way of the contact on b past that on a.
  pure function past(a, b, arm_a, arm_b) result(v)
    real(wp), intent(in) :: a(6), b(6)
    real(wp), intent(in) :: arm_a(3), arm_b(3)   !! from the centres [m]
    real(wp) :: v(3)

    v(1) = (b(1) - a(1)) + b(5)*arm_b(3) - b(6)*arm_b(2) - a(5)*arm_a(3) + a(6)*arm_a(2)
    v(2) = (b(2) - a(2)) + b(6)*arm_b(1) - b(4)*arm_b(3) - a(6)*arm_a(1) + a(4)*arm_a(3)
    v(3) = (b(3) - a(3)) + b(4)*arm_b(2) - b(5)*arm_b(1) - a(4)*arm_a(2) + a(5)*arm_a(1)
  end function past

  !> An impulse along the normal and the tangents of a row in space axes.
  pure function in_space(part, row) result(p)
    real(wp), intent(in) :: part(3)   !! [N s]
    type(row_t), intent(in) :: row
    real(wp) :: p(3)

    p = part(1)*row%n + part(2)*row%e1 + part(3)*row%e2
  end function in_space

  !> What is remembered of a contact point: the force that it bore, and its tangential way. Both
  !! lists are sorted; m is the place in the memory.
  pure subroutine recall(point, h, memory, m, row)
    type(contact_point_t), intent(in) :: point
    real(wp), intent(in) :: h                    !! sub-sweep [s]
    type(displacements_t), intent(in) :: memory
    integer, intent(inout) :: m
    type(row_t), intent(inout) :: row

    do while (m <= memory%n)
      if (.not. comes_before(memory%a(m), memory%b(m), memory%id(m), &
                             point%a, point%b, point%id)) then
        if (memory%a(m) /= point%a .or. memory%b(m) /= point%b .or. memory%id(m) /= point%id &
            .or. memory%other(m) >= point%other) exit
      end if
      m = m + 1
    end do
    if (m > memory%n) return
    if (memory%a(m) /= point%a .or. memory%b(m) /= point%b .or. memory%id(m) /= point%id &
        .or. memory%other(m) /= point%other) return
    row%impulse(1) = max(0.0_wp, -h*dot_product(memory%force(:, m), row%n))
    row%impulse(2) = -h*dot_product(memory%force(:, m), row%e1)
    row%impulse(3) = -h*dot_product(memory%force(:, m), row%e2)
    row%stretch(1) = dot_product(memory%xi(:, m), row%e1)
    row%stretch(2) = dot_product(memory%xi(:, m), row%e2)
  end subroutine recall

  !> Give each pair the first colour that none of its bodies has yet, and sort the pairs by colour.
  pure subroutine colour_pairs(rows)
    type(rows_t), intent(inout) :: rows
    integer :: k, c, place(max_colours)
    integer(i8) :: taken

    rows%used = 0_i8
    place = 0
    do k = 1, rows%n_pairs
      taken = 0_i8
      if (yields(rows, rows%a(k))) taken = rows%used(rows%a(k))
      if (yields(rows, rows%b(k))) taken = ior(taken, rows%used(rows%b(k)))
      c = min(trailz(not(taken)) + 1, max_colours)
      if (yields(rows, rows%a(k))) rows%used(rows%a(k)) = ibset(rows%used(rows%a(k)), c - 1)
      if (yields(rows, rows%b(k))) rows%used(rows%b(k)) = ibset(rows%used(rows%b(k)), c - 1)
      rows%colour(k) = c
      place(c) = place(c) + 1
    end do
    rows%n_colours = 0
    rows%begin(1) = 1
    do c = 1, max_colours
      rows%begin(c + 1) = rows%begin(c) + place(c)
      if (place(c) > 0) rows%n_colours = c
      place(c) = rows%begin(c)
    end do
    do k = 1, rows%n_pairs
      c = rows%colour(k)
      rows%order(place(c)) = k
      place(c) = place(c) + 1
    end do
  end subroutine colour_pairs

  !> Whether a counterpart is a body that yields to impulses.
  pure function yields(rows, b) result(yes)
    type(rows_t), intent(in) :: rows
    integer, intent(in) :: b
    logical :: yes

    yes = b > 0
    if (yes) yes = rows%inverse_mass(b) > 0.0_wp
  end function yields

  !> Mean forces and torques of the step on all counterparts, and the change of these forces where
  !! the impulse of an impact acts for a contact time, not for the step.
  pure subroutine sum_loads(step, rows, force, torque, spread)
    real(wp), intent(in) :: step                                   !! [s]
    type(rows_t), intent(in) :: rows
    real(wp), intent(inout) :: force(:, bed_counterpart:), torque(:, bed_counterpart:)
      !! (3, counterparts) [N], [N m]
    real(wp), intent(inout) :: spread(:, bed_counterpart:)   !! (3, counterparts) [N]
    real(wp) :: p(3)
    integer :: k, r

    force = 0.0_wp
    torque = 0.0_wp
    spread = 0.0_wp
    do k = 1, rows%n_pairs
      associate (a => rows%a(k), b => rows%b(k))
        do r = rows%first(k), rows%first(k + 1) - 1
          associate (row => rows%row(r))
            p = in_space(rows%total(:, r), row)/step
            force(:, a) = force(:, a) - p
            force(:, b) = force(:, b) + p
            torque(:, a) = torque(:, a) - cross(row%arm_a, p)
            torque(:, b) = torque(:, b) + cross(row%arm_b, p)
            if (.not. rows%impact) cycle
            p = in_space(rows%gained(:, r) + rows%returned(:, r), row) &
              *(1.0_wp/rows%contact_time - 1.0_wp/step)
            spread(:, a) = spread(:, a) - p
            spread(:, b) = spread(:, b) + p
          end associate
        end do
        torque(:, a) = torque(:, a) + rows%turn(:, k)/step
        torque(:, b) = torque(:, b) + rows%turn(:, k)/step
      end associate
    end do
  end subroutine sum_loads

  !> Remember the rows that bear something: force and torques of the last sub-sweep, and the
  !! tangential way where friction holds. They store no energy: overlaps open without speed.
  subroutine store_memory(h, points, rows, memory)
    real(wp), intent(in) :: h                    !! sub-sweep [s]
    type(contact_points_t), intent(in) :: points
    type(rows_t), intent(in) :: rows
    type(displacements_t), intent(inout) :: memory
    real(wp), parameter :: sticking = 0.999_wp   !! of the bound of friction: below it nothing slips
    real(wp) :: way(3), p(3)
    integer :: k, r, m

    call reserve_displacements(rows%n, memory)
    m = 0
    do k = 1, rows%n_pairs
      do r = rows%first(k), rows%first(k + 1) - 1
        associate (row => rows%row(r), point => points%item(rows%point(r)))
          if (.not. row%impulse(1) > 0.0_wp) cycle
          m = m + 1
          memory%a(m) = point%a
          memory%b(m) = point%b
          memory%id(m) = point%id
          memory%other(m) = point%other
          memory%k(m) = 0.0_wp
          way = past(rows%way(:, point%a), rows%way(:, point%b), row%arm_a, row%arm_b)
          memory%xi(:, m) = 0.0_wp
          if (norm(row%impulse(2:3)) < sticking*row%friction*row%impulse(1)) then
            memory%xi(:, m) = row%stretch(1)*row%e1 + row%stretch(2)*row%e2 &
              + way - dot_product(way, row%n)*row%n
          end if
          p = in_space(row%impulse, row)/h
          memory%force(:, m) = -p
          memory%torque_a(:, m) = -cross(row%arm_a, p)
          memory%torque_b(:, m) = cross(row%arm_b, p)
          memory%energy(m) = 0.0_wp
        end associate
      end do
    end do
    memory%n = m
  end subroutine store_memory

end module impulse_rows_m
