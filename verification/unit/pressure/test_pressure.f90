!> Projection around held and free blocks, hydrostatic balance, pressure in closed cells.
module test_pressure_m
  use check_m, only: check, wp
  use vectors_m, only: quaternion_from_axis
  use grid_m, only: n_halo, unit_step
  use mixture_m, only: mix_fluid, face_mean
  use boundary_m, only: fill_velocity_halo, fill_scalar_halo
  use rigid_flux_m, only: build_rigid_flux, force_from_faces
  use face_velocity_m, only: acceleration_t, acceleration_init, face_acceleration, &
    cell_mean_of_faces, predict_face_velocity
  use pressure_system_m, only: set_pressure_system
  use stage_m, only: stage_t
  use pressure_m, only: pressure_t, pressure_report_t, pressure_init, solve_pressure, both_solves, &
    divergence
  use pressure_extension_m, only: extend_pressure
  use advected_pressure_m, only: advect_pressure
  use rigid_motion_m, only: rigid_motion_t, wall_velocity
  use one_body_m, only: one_body_t, place, random_field, sides, body
  implicit none
  private
  public :: test_pressure

  character(*), parameter :: closed = 'no_slip no_slip no_slip no_slip no_slip no_slip', tank &
    = 'no_slip no_slip slip slip no_slip open', channel = 'periodic periodic slip slip no_slip open'
  integer, parameter :: cells(3) = [12, 8, 12]
  real(wp), parameter :: dt = 1.0e-3_wp                            !! [s]
  real(wp), parameter :: weight(3) = [0.0_wp, 0.0_wp, -9810.0_wp]   !! of water [N/m3]
  type(one_body_t), target :: box
  type(pressure_t) :: pressure
  type(acceleration_t) :: a
  integer :: seed = 77

contains

  subroutine test_pressure()
    call held_box('closed box', closed, '')
    call held_box('open tank', tank, '')
    call held_box('jacobi', tank, 'preconditioner="jacobi"')
    call held_box('bicgstab', tank, 'pressure_solver="bicgstab"')
    call rough_and_fine()
    call without_its_body()
    call free_box()
    call pressed_box()
    call still_water()
    call accelerations_at_faces()
    call closed_cells()
    call carried_with_a_body()
  end subroutine test_pressure

  !> A box in liquid below and gas above, random face velocity through the open faces.
  subroutine build(around, free, position, q, numerics)
    character(*), intent(in) :: around   !! kinds of the sides
    logical, intent(in) :: free
    real(wp), intent(in), optional :: position(3), q(4)   !! else tilted in the middle
    character(*), intent(in), optional :: numerics
    real(wp) :: x(3), attitude(4)
    character(:), allocatable :: more

    x = [0.0613_wp, 0.0389_wp, 0.0571_wp]
    if (present(position)) x = position
    attitude = quaternion_from_axis([1.0_wp, -0.3_wp, 0.5_wp], 0.7_wp)
    if (present(q)) attitude = q
    more = ''
    if (present(numerics)) more = numerics
    call place('&grid cells=12,8,12 length=.12,.08,.12/ &shape name="b" kind="box" ' &
      //'size=.043,.031,.037/ &numerics divergence_tolerance=1e-8 '//more//'/ '//sides(around) &
      //body('b', x, [0.3_wp, -0.2_wp, -0.1_wp], attitude, 'angular_velocity=2,1,-3 fixed=' &
      //merge('F', 'T', free)), box)
    box%flow%c(:, :, 8:) = 0.0_wp
    box%flow%c(:, :, 7) = 0.3_wp
    call mix_fluid(box%case%fluid, box%flow)
    call acceleration_init(box%grid, a)
    call stir()
  end subroutine build

  !> Random face velocity, zero on walls, the same on both sides of a period.
  subroutine stir()
    associate (n => cells, uf => box%flow%uf)
      uf = 0.0_wp
      call random_field(seed, uf(1:n(1) + 1, 1:n(2) + 1, 1:n(3) + 1, :))
      uf = 0.1_wp*uf
      uf(n(1) + 1, :, :, 1) = 0.0_wp
      uf(1, :, :, 1) = 0.0_wp
      uf(:, [1, n(2) + 1], :, 2) = 0.0_wp
      uf(:, :, 1, 3) = 0.0_wp
      if (box%case%boundary%kind(2, 3) /= 'open') uf(:, :, n(3) + 1, 3) = 0.0_wp
    end associate
  end subroutine stir

  subroutine solve(tolerance)
    real(wp), intent(in), optional :: tolerance   !! [1/s]

    call pressure_init(box%grid, 1, box%case%numerics, pressure)
    associate (system => pressure%system)
      call set_pressure_system(box%grid, box%solid%effective, box%flow%rho, system)
      call build_rigid_flux(box%grid, box%solid, box%bodies, system%active, system%operator%flux)
    end associate
    call solve_pressure(stage(), box%flow%rho, box%bodies, pressure, tolerance)
  end subroutine solve

  function stage() result(s)
    type(stage_t) :: s

    s = stage_t(grid=box%grid, solid=box%solid, flow=box%flow, dt=dt)
  end function stage

  !> Largest |div u| of fluid and solid in the cells that can move, worked out here [1/s].
  real(wp) function largest_divergence() result(worst)
    real(wp) :: net(cells(1), cells(2), cells(3))
    integer :: d, s, a(3), b(3)

    net = 0.0_wp
    do d = 1, 3
      do s = 0, 1
        a = 1 + s*unit_step(:, d)
        b = cells + s*unit_step(:, d)
        net = net + (2*s - 1)*(box%flow%solid_flux(a(1):b(1), a(2):b(2), a(3):b(3), d) &
          + box%solid%effective(a(1):b(1), a(2):b(2), a(3):b(3), d)*box%grid%area(d) &
          *box%flow%uf(a(1):b(1), a(2):b(2), a(3):b(3), d))
      end do
    end do
    worst = maxval(abs(net), box%solid%alpha(1:12, 1:8, 1:12) < 1.0_wp)/box%grid%volume
  end function largest_divergence

  !> A moving but held box: the fluid makes way, and the velocity has changed by -dt grad(phi)/rho.
  subroutine held_box(name, around, numerics)
    character(*), intent(in) :: name, around, numerics
    real(wp), allocatable :: before(:, :, :, :)
    real(wp) :: expected
    integer, parameter :: at(3) = [3, 2, 7]

    call build(around, .false., numerics=numerics)
    if (name == 'closed box') box%bodies%motion = 0.0_wp
    allocate (before, source=box%flow%uf)
    call solve()
    call check(name//': converged', pressure%report%converged .and. &
               any(pressure%report%passes == [1, 2]))
    call check(name//': it is told', pressure%report%divergence, largest_divergence(), 1.0e-12_wp)
    call check(name//': divergence', largest_divergence() < 1.0e-8_wp)
    expected = -dt*(box%flow%p(at(1), at(2), at(3)) - box%flow%p(at(1), at(2), at(3) - 1)) &
               /(0.01_wp*0.5_wp*(box%flow%rho(at(1), at(2), at(3) - 1) &
                                 + box%flow%rho(at(1), at(2), at(3))))
    call check(name//': change', box%flow%uf(3, 2, 7, 3) - before(3, 2, 7, 3), expected, 1.0e-12_wp)
    call check(name//': walls stay closed', all(abs(box%flow%uf(1, 1:8, 1:12, 1)) <= 0.0_wp))
  end subroutine held_box

  !> A rough solve leaves more divergence with less work, and a second one goes on from there.
  subroutine rough_and_fine()
    integer :: rough
    type(pressure_report_t) :: both

    call build(tank, .false.)
    call solve(tolerance=1.0e-5_wp)
    rough = pressure%report%iterations
    call check('rough: converged', pressure%report%converged)
    call check('rough: divergence', largest_divergence() < 1.0e3_wp*1.0e-8_wp &
               .and. largest_divergence() > 1.0e-8_wp)
    call solve_pressure(stage(), box%flow%rho, box%bodies, pressure)
    call check('then fine: divergence', largest_divergence() < 1.0e-8_wp)
    call build(tank, .false.)
    call solve()
    call check('rough is less work', rough < pressure%report%iterations)
    both = both_solves(pressure_report_t(3, 20, 0.5_wp, .false.), pressure%report)
    call check('a first solve without end is told', .not. both%converged)
    call check('both: divergence of the first', both%divergence, 0.5_wp)
    both = both_solves(pressure_report_t(3, 20, 0.5_wp, .true.), pressure%report)
    call check('a rough one that ended counts as work only', both%converged &
               .and. both%passes == 3 + pressure%report%passes .and. both%divergence < 1.0e-8_wp)
  end subroutine rough_and_fine

  !> A solve that leaves the body of the run aside knows nothing of the flux that it had before.
  subroutine without_its_body()
    type(rigid_motion_t) :: none

    call build(tank, .false.)
    call solve()
    call check('the box had a flux', any(abs(box%flow%solid_flux) > 0.0_wp))
    call stir()
    none%n = 0
    allocate (none%free(0))
    call solve_pressure(stage(), box%flow%rho, none, pressure)
    call check('without it: none', all(abs(box%flow%solid_flux) <= 0.0_wp))
    call check('without it: divergence', largest_divergence() < 1.0e-8_wp)
  end subroutine without_its_body

  !> A free box: velocity and motion together lose their divergence, and what the one gains in
  !! momentum along the period the other loses.
  subroutine free_box()
    real(wp), allocatable :: before(:, :, :, :)
    real(wp) :: motion(6), force(6, 1), gain(6), fluid_gain

    call build(channel, .true.)
    box%flow%uf(cells(1) + 1, :, :, 1) = box%flow%uf(1, :, :, 1)
    allocate (before, source=box%flow%uf)
    motion = box%bodies%motion(:, 1)
    call solve()
    call check('free box: converged', pressure%report%converged)
    call check('free box: divergence', largest_divergence() < 1.0e-8_wp)
    call check('free box: it was pushed', all(abs(box%bodies%motion(:, 1) - motion) > 1.0e-5_wp))
    gain(1:3) = box%bodies%mass(1)*(box%bodies%motion(1:3, 1) - motion(1:3))
    gain(4:6) = matmul(box%bodies%inertia(:, :, 1), box%bodies%motion(4:6, 1) - motion(4:6))
    call force_from_faces(box%grid, box%bodies, pressure%system%operator%flux, &
                          pressure%phi_total, force)
    call check('free box: momentum is force times step', gain(1:3), dt*force(1:3, 1), 1.0e-14_wp)
    call check('free box: spin is torque times step', gain(4:6), dt*force(4:6, 1), 1.0e-15_wp)
    associate (rho => box%flow%rho(1:12, 1:8, 1:12))
      fluid_gain = box%grid%volume*sum(face_mean(rho, cshift(rho, -1, 1)) &
        *box%solid%effective(1:12, 1:8, 1:12, 1) &
        *(box%flow%uf(1:12, 1:8, 1:12, 1) - before(1:12, 1:8, 1:12, 1)))
    end associate
    call check('free box: momentum of fluid and box', fluid_gain + gain(1), 0.0_wp, 1.0e-13_wp)
    call check('free box: momentum changes hands', abs(gain(1)) > 1.0e-5_wp)
  end subroutine free_box

  !> A free box half a millimetre deep in the floor of a closed box: its 4 x 2 covered cells below
  !! take no part, and all open cells share the volume that they displace on its way down.
  subroutine pressed_box()
    real(wp) :: motion(6), force(6, 1), displaced
    integer, parameter :: open_cells = 12*8*12 - 4*2*3

    call build(closed, .true., [0.0613_wp, 0.0389_wp, 0.018_wp], [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
    box%bodies%motion(4:6, 1) = 0.0_wp
    box%flow%c = 1.0_wp
    call mix_fluid(box%case%fluid, box%flow)
    motion = box%bodies%motion(:, 1)
    call solve()
    call check('pressed box', pressure%report%converged .and. any(pressure%report%passes == [1, 2]))
    associate (m => box%bodies%motion(:, 1), at => [0.06_wp, 0.04_wp] - box%bodies%x(1:2, 1))
      displaced = -8*box%grid%area(3)*(m(3) + m(4)*at(2) - m(5)*at(1))/(open_cells*box%grid%volume)
    end associate
    call divergence(box%grid, box%solid%effective, box%flow, pressure%system%active, &
                    pressure%system%solver%rhs, force(1, 1))
    associate (net => pressure%system%solver%rhs(1:12, 1:8, 1:12)/box%grid%volume)
      call check('pressed box: evenly shared', maxval(abs(net - displaced), &
                 pressure%system%active(1:12, 1:8, 1:12)), 0.0_wp, 1.0e-8_wp)
    end associate
    call check('pressed box: it moves on', abs(displaced) > 1.0e-3_wp)
    call force_from_faces(box%grid, box%bodies, pressure%system%operator%flux, &
                          pressure%phi_total, force)
    call check('pressed box: momentum is force times step', box%bodies%mass(1) &
               *(box%bodies%motion(1:3, 1) - motion(1:3)), dt*force(1:3, 1), 1.0e-13_wp)
  end subroutine pressed_box

  !> Liquid under gas around a held tilted box: nothing moves, the pressure is the weight above.
  subroutine still_water()
    real(wp) :: expected, worst, g(3)
    integer :: k

    call build(tank, .false.)
    g = box%case%fluid%gravity
    box%bodies%motion = 0.0_wp
    box%case%numerics%divergence_tolerance = 1.0e-9_wp
    call face_acceleration(box%grid, g, box%flow%rho, box%flow%rho, box%flow%p, a%face)
    box%flow%uf = dt*a%face
    call solve()
    call check('still water: converged', pressure%report%converged)
    worst = maxval(abs(box%flow%uf(1:12, 1:8, 1:13, :)), &
                   mask=box%solid%aperture(1:12, 1:8, 1:13, :) > 0.0_wp)
    call check('still water stays', worst, 0.0_wp, 1.0e-10_wp)
    expected = 0.0_wp
    do k = cells(3), 1, -1
      expected = expected - g(3)*box%grid%h(3)*face_mean(box%flow%rho(1, 1, k), &
                 merge(0.0_wp, box%flow%rho(1, 1, min(k + 1, cells(3))), k == cells(3)))
      call check('still water: weight above', box%flow%p(2, 3, k), expected, 1.0e-5_wp)
    end do
  end subroutine still_water

  !> Accelerations, their cell means by open shares, the face velocity predicted from cells.
  subroutine accelerations_at_faces()
    real(wp), parameter :: g(3) = [0.5_wp, -0.25_wp, -9.81_wp], rho = 1000.0_wp, nu = 1.0e-3_wp
    real(wp) :: short, largest
    integer :: i

    call build(tank, .false.)
    box%flow%rho = rho
    box%flow%mu = rho*nu
    do i = 1 - n_halo, cells(1) + n_halo
      box%flow%p(i, :, :) = 40.0_wp*box%grid%centre(i, 1)**2
    end do
    call face_acceleration(box%grid, g, box%flow%rho, box%flow%rho, box%flow%p, a%face)
    call check('acceleration: gravity less gradient', a%face(4, 3, 2, 1), &
               0.5_wp - 80.0_wp*box%grid%face(4, 1)/rho, 1.0e-13_wp)
    call check('acceleration: walls', abs(a%face(1, 3, 2, 1)) + abs(a%face(13, 3, 2, 1)), 0.0_wp)
    call check('acceleration: open top', a%face(4, 3, 13, 3), &
               -9.81_wp + box%flow%p(4, 3, 12)/(0.005_wp*rho), 1.0e-12_wp)
    call cell_mean_of_faces(box%grid, box%solid%aperture, a%face, a%cell)
    i = findloc(box%solid%aperture(1:12, 4, 6, 1) > 0.0_wp .and. box%solid%aperture(1:12, 4, 6, 1) &
                < 1.0_wp, .true., 1)
    call check('a face is partly open', i > 1)
    associate (w => box%solid%aperture(i:i + 1, 4, 6, 1))
      call check('mean of faces by open shares', a%cell(i, 4, 6, 1)*sum(w), &
                 dot_product(w, a%face(i:i + 1, 4, 6, 1)), 1.0e-13_wp)
    end associate

    box%flow%u(:, :, :, 1) = 0.7_wp
    call fill_velocity_halo(box%grid, box%flow%u)
    a%face = 2.0_wp
    a%cell = 0.5_wp
    call predict_face_velocity(box%grid, dt, box%flow%rho, a, box%flow)
    short = dt/(1.0_wp + 2.0_wp*nu*dt*3.0_wp/0.01_wp**2)
    call check('predicted velocity', box%flow%uf(5, 3, 3, 1), 0.7_wp + 1.5_wp*short, 1.0e-15_wp)
    call check('predicted: wall', box%flow%uf(1, 3, 3, 1), 0.0_wp)
    call check('predicted: open top', box%flow%uf(5, 3, 13, 3), 1.5_wp*dt, 1.0e-16_wp)
    box%flow%solid_flux = 0.0_wp
    associate (rhs => pressure%system%solver%rhs)
      call divergence(box%grid, 0.0_wp*box%solid%effective + 1.0_wp, box%flow, &
                      pressure%system%active, rhs, largest)
      call check('largest', largest, maxval(abs(rhs(1:12, 1:8, 1:12)))/box%grid%volume, 1.0e-12_wp)
      call check('wall cell', rhs(1, 3, 3), box%grid%area(1)*(0.7_wp + 1.5_wp*short), 1.0e-16_wp)
    end associate
  end subroutine accelerations_at_faces

  !> Cells that cannot move take the pressure of their height; under a closed floor, from above. So
  !! do films, but not cells with one face that is open.
  subroutine closed_cells()
    real(wp), parameter :: g(3) = [0.0_wp, 0.0_wp, -9.81_wp]
    real(wp) :: worst
    integer :: k

    call build(tank, .false.)
    do k = 1, cells(3)
      box%flow%p(:, :, k) = hydrostatic(k)
    end do
    pressure%system%active = .true.
    pressure%system%active(4:8, 3:7, 3:9) = .false.
    pressure%system%active(:, :, 1) = .false.
    pressure%system%active(2:3, 2:3, 2) = .false.
    where (.not. pressure%system%active) box%flow%p = 1.0e9_wp
    box%solid%alpha(9, 4:6, 5) = 0.99_wp   ! next to no water
    box%flow%p(9, 4:6, 5) = 5.0e4_wp
    box%solid%cut_cell(:, 1) = [1, 2, 6]
    box%solid%cut_cell(:, 2) = [11, 2, 6]
    box%flow%p([1, 11], 2, 6) = 7.0e4_wp
    box%solid%aperture(2, 2, 6, 1) = 0.009_wp   ! of the cell in the corner of two walls
    box%solid%aperture(1, 2:3, 6, 2) = 0.009_wp
    box%solid%aperture(1, 2, 6:7, 3) = 0.009_wp
    box%solid%aperture(11:12, 2, 6, 1) = 0.009_wp
    box%solid%aperture(11, 2:3, 6, 2) = [0.009_wp, 0.011_wp]
    box%solid%aperture(11, 2, 6:7, 3) = 0.009_wp
    call extend_pressure(box%grid, g, box%solid, box%flow, pressure)
    call check('films: open at one side', box%flow%p(11, 2, 6), 7.0e4_wp)
    box%flow%p(11, 2, 6) = hydrostatic(6)
    call check('closed cells: next to no water keeps its pressure', box%flow%p(9, 5, 5), 5.0e4_wp)
    box%flow%p(9, 4:6, 5) = hydrostatic(5)
    worst = 0.0_wp
    do k = 1, cells(3)
      worst = max(worst, maxval(abs(box%flow%p(1:12, 1:8, k) - hydrostatic(k))))
    end do
    call check('closed cells: hydrostatic', worst, 0.0_wp, 1.0e-9_wp)
    call check('closed cells: halo', box%flow%p(5, 5, 0), hydrostatic(1), 1.0e-9_wp)
  end subroutine closed_cells

  !> What is quadratic comes from where the way of the body leads back to, but for the weight of
  !! the water; what is far, what does not take part, and everything around a body at rest stays.
  !! What is linear does so beside the body, too, whatever stands in its cells.
  subroutine carried_with_a_body()
    real(wp), dimension(1 - n_halo:cells(1) + n_halo, 1 - n_halo:cells(2) + n_halo, &
                        1 - n_halo:cells(3) + n_halo) :: before, alpha

    call build(tank, .false.)
    alpha = box%solid%alpha
    a%kicked = .true.
    a%kicked(5, 4, 6) = .false.
    box%solid%alpha = 0.0_wp
    call set_bowl(1.0e5_wp)
    before = box%flow%p
    call carry()
    call check('carried pressure: from where the body came', worst(1.0e5_wp), 0.0_wp, 1.0e-9_wp)
    call check('carried pressure: it did move', maxval(abs(box%flow%p - before)) > 0.1_wp)
    call check('carried pressure: far away', box%flow%p(12, 8, 12), before(12, 8, 12))
    box%solid%alpha = alpha
    call set_bowl(0.0_wp)
    where (alpha >= 1.0_wp) box%flow%p = 1.0e9_wp
    call carry()
    call check('carried pressure: continued into the body', worst(0.0_wp), 0.0_wp, 1.0e-9_wp)
    box%solid%alpha = 0.0_wp
    a%kicked = .true.
    box%bodies%x(3, 1) = 0.02_wp   ! the floor is near
    call set_bowl()
    call fill_scalar_halo(box%grid, box%flow%p)
    before = box%flow%p
    call carry()
    call check('carried pressure: water at rest', box%flow%p - before, 0.0_wp, 1.0e-9_wp)
    box%flow%p(4:6, 3:5, 2:4) = box%flow%p(4:6, 3:5, 2:4) + 100.0_wp
    before = box%flow%p
    box%bodies%motion = 0.0_wp
    call carry()
    call check('carried pressure: at rest', box%flow%p - before, 0.0_wp)
  end subroutine carried_with_a_body

  !> One call, of the case as it is.
  subroutine carry()
    call advect_pressure(box%grid, weight, box%solid%alpha, box%bodies, dt, a, box%flow%p)
  end subroutine carry

  !> Largest error of the open cells but for those at the sides, where a wall tells the pressure.
  real(wp) function worst(curvature) result(error)
    real(wp), intent(in) :: curvature
    real(wp) :: way(3), arm(3), share, x(3)
    integer :: i, j, k

    error = 0.0_wp
    do k = 1, cells(3)
      do j = 1, cells(2)
        do i = 1, cells(1)
          if (box%solid%alpha(i, j, k) >= 1.0_wp) cycle
          if (any([i, j, k] == 1 .or. [i, j, k] == cells)) cycle
          x = ([i, j, k] - 0.5_wp)*box%grid%h
          arm = x - box%bodies%x(:, 1)
          share = min(1.0_wp, max(0.0_wp, 3.0_wp - 2.0_wp*norm2(arm)/box%bodies%radius(1)))
          if (.not. a%kicked(i, j, k)) share = 0.0_wp
          way = share*dt*wall_velocity(box%bodies%motion(:, 1), arm)
          error = max(error, abs(box%flow%p(i, j, k) - dot_product(weight, x) &
                                 - bowl(x - way, curvature)))
        end do
      end do
    end do
  end function worst

  !> Pressure of the weight everywhere, and of a bowl.
  subroutine set_bowl(curvature)
    real(wp), intent(in), optional :: curvature
    real(wp) :: x(3)
    integer :: i, j, k

    do concurrent (k=1 - n_halo:cells(3) + n_halo, &
      j=1 - n_halo:cells(2) + n_halo, i=1 - n_halo:cells(1) + n_halo)
      x = ([i, j, k] - 0.5_wp)*box%grid%h
      box%flow%p(i, j, k) = dot_product(weight, x)
      if (present(curvature)) box%flow%p(i, j, k) = box%flow%p(i, j, k) + bowl(x, curvature)
    end do
  end subroutine set_bowl

  !> What moves with the body, all second derivatives there [Pa].
  pure real(wp) function bowl(x, curvature) result(p)
    real(wp), intent(in) :: x(3), curvature   !! [m, Pa/m2]

    p = 3.0e3_wp*x(1) - 2.0e3_wp*x(2) + 1.0e3_wp*x(3) + curvature* &
        (x(1)**2 - 2*x(2)**2 + 3*x(3)**2 + x(1)*x(2) - 2*x(2)*x(3) + 4*x(3)*x(1))
  end function bowl

  !> Weight per area above the centre of the cells of height k, zero half a cell above the top [Pa].
  real(wp) function hydrostatic(k) result(p)
    integer, intent(in) :: k
    integer :: m

    p = 0.5_wp*box%flow%rho(1, 1, cells(3))
    do m = k, cells(3) - 1
      p = p + face_mean(box%flow%rho(1, 1, m), box%flow%rho(1, 1, m + 1))
    end do
    p = 9.81_wp*box%grid%h(3)*p
  end function hydrostatic

end module test_pressure_m
