!> Implicit viscosity: exact shear past a wall, small cells, momentum, waves that decay.
module test_viscous_m
  use omp_lib, only: omp_get_max_threads, omp_set_num_threads
  use check_m, only: check, wp, pi
  use errors_m, only: to_text
  use rigid_motion_m, only: set_inertia, wall_velocity
  use viscous_system_m, only: viscous_t, viscous_init
  use viscous_links_m, only: build_viscous
  use merged_cells_m, only: merged_cells_t
  use viscous_m, only: solve_viscous, pull_of_links
  use one_body_m, only: one_body_t, place, sides, slip, body
  implicit none
  private
  public :: test_viscous

  real(wp), parameter :: mu = 2.0e-3_wp, rho = 900.0_wp, speed = 0.7_wp, depth = 1.0_wp, &
    lid = -1.1_wp, long_time = 1.0e14_wp
  real(wp), parameter :: heights(3) = [0.13_wp, 0.22_wp, 0.26_wp]
    !! of the surface, cell height 1/8
  character(*), parameter :: fluid = '&fluid single_phase=T liquid_density=900 ' &
    //'liquid_viscosity=2e-3/ '
  type(one_body_t) :: tank
  type(viscous_t) :: viscous
  type(merged_cells_t) :: merged
  real(wp) :: momentum(2)

contains

  subroutine test_viscous()
    call shear_above_a_wall()
    call free_body()
    call few_sweeps()
    call body_in_the_system()
    call small_cells()
    call between_two_walls()
    call waves_in_odd_box(0.3_wp)
    call check('odd box: by sweeps', viscous%iterations > 10 .and. viscous%iterations <= 25)   ! 21
    call waves_in_odd_box(5.0_wp)
    call check('odd box, longer step: left to conjugate gradients', viscous%iterations, 2)
    call waves_in_closed_box()
  end subroutine test_viscous

  !> A tank of 4 x 4 x 8 cells, 1 m wide, periodic sideways; a body fills it from below up to a
  !! height and moves along x, and perhaps another one from a height on.
  subroutine make_wall(top, from, lid_speed, free)
    real(wp), intent(in) :: top
    real(wp), intent(in), optional :: from, lid_speed   !! [m], of the tank's upper wall [m/s]
    logical, intent(in), optional :: free               !! does the fluid move the body?
    character(:), allocatable :: text
    integer :: b

    text = '&grid cells=4,4,8 length=3*1/ &boundary x_min="periodic" x_max="periodic" ' &
      //'y_min="periodic" y_max="periodic" z_max="no_slip"'
    if (present(lid_speed)) text = text//' z_max_velocity='//to_text(lid_speed)//',0,0'
    text = text//'/ '//fluid//slab('a', 0.0_wp, -0.5_wp, top)
    if (present(from)) text = text//slab('b', 0.25_wp, from, 1.5_wp)   ! the gap is not sealed
    call place(text, tank, merged)
    associate (bodies => tank%bodies)
      if (present(free)) bodies%free = free
      bodies%mass = 50.0_wp
      bodies%inertia = 0.0_wp
      bodies%inverse_inertia = 0.0_wp
      do b = 1, 3
        bodies%inertia(b, b, :) = 1.0e9_wp
        bodies%inverse_inertia(b, b, :) = 1.0e-9_wp
      end do
      do b = 1, bodies%n
        call set_inertia(b, bodies)
      end do
      call viscous_init(tank%grid, bodies%n, viscous)
    end associate
  end subroutine make_wall

  !> A body across the tank from a place along x on, between two heights.
  function slab(name, x, low, high) result(text)
    character(*), intent(in) :: name
    real(wp), intent(in) :: x, low, high   !! [m]
    character(:), allocatable :: text

    text = '&shape name="'//name//'" kind="box" size='//to_text([1.0_wp - x, 1.0_wp, high - low]) &
      //'/ '//body(name, 0.5_wp*[1.0_wp + x, 1.0_wp, low + high], [speed, 0.0_wp, 0.0_wp], &
      more='fixed=T')
  end function slab

  !> The stage in a step, without merged cells if not asked for.
  subroutine solve(dt, small)
    real(wp), intent(in) :: dt   !! [s]
    logical, intent(in), optional :: small

    call build(dt, small)
    call solve_viscous(tank%grid, tank%bodies, tank%flow, viscous)
  end subroutine solve

  subroutine build(dt, small)
    real(wp), intent(in) :: dt
    logical, intent(in), optional :: small

    associate (flow => tank%flow)
      if (present(small)) then
        call build_viscous(tank%grid, tank%solid, tank%bodies, flow%rho, flow%mu, dt, viscous, &
                           merged)
      else
        call build_viscous(tank%grid, tank%solid, tank%bodies, flow%rho, flow%mu, dt, viscous)
      end if
    end associate
  end subroutine build

  !> A long step brings the steady shear flow between the moving surface and the upper wall.
  subroutine shear_above_a_wall()
    real(wp), parameter :: upper(4) = [0.0_wp, 0.0_wp, 0.0_wp, lid]
    real(wp) :: worst, z
    integer :: k, n

    do n = 1, 4
      associate (top => heights(1 + modulo(n - 1, 3)))
        call make_wall(top, lid_speed=upper(n))
        call solve(long_time)
        worst = 0.0_wp
        do k = 1, 8
          z = (tank%grid%centre(k, 3) - top)/(depth - top)
          if (z < 0.0_wp) cycle
          worst = max(worst, maxval(abs(tank%flow%u(1:4, 1:4, k, 1) - (1.0_wp - z)*speed &
                                        - z*upper(n))))
        end do
        call check('converged', viscous%converged)
        call check('a direction where sweeps would be hundreds', viscous%iterations <= 10)   ! 8
        call check('linear profile above a wall inside a cell', worst, 0.0_wp, 1.0e-7_wp)
        call check('shear force on the wall', viscous%force(1, 1), &
                   -mu*(speed - upper(n))/(depth - top), 1.0e-7_wp*mu*speed)
      end associate
    end do
  end subroutine shear_above_a_wall

  !> A free body and the fluid it drags: the stage gives to one what it takes from the other.
  subroutine free_body()
    call make_wall(heights(2), free=.true.)
    momentum(1) = fluid_momentum() + tank%bodies%mass(1)*tank%bodies%motion(1, 1)
    call solve(5.0_wp)
    momentum(2) = fluid_momentum() + tank%bodies%mass(1)*tank%bodies%motion(1, 1) &
                  + 5.0_wp*sum(2.0_wp*mu*8.0_wp*tank%flow%u(1:4, 1:4, 8, 1))/16.0_wp
    call check('momentum of body, fluid and wall', momentum(2), momentum(1), 1.0e-7_wp*momentum(1))
    call check('the body slows by the force it feels', tank%bodies%mass(1)*(tank%bodies%motion(1, &
      1) - speed), 5.0_wp*viscous%force(1, 1), 1.0e-7_wp*momentum(1))
  end subroutine free_body

  !> A step that moves momentum by a cell or so: as few sweeps as two colours promise. Sweeps that
  !! end too early, or would be too many, are left to conjugate gradients.
  subroutine few_sweeps()
    call make_wall(heights(2), free=.true.)
    call solve(1.0e4_wp)
    call check('links beside the rest', viscous%spread > 0.5_wp .and. viscous%spread < 0.95_wp)
    call check('sweeps as the bound promises', viscous%iterations > 10 .and. viscous%iterations &
      <= 0.7_wp*log(1.0e-9_wp)/log(viscous%spread/(1.0_wp + sqrt(1.0_wp - viscous%spread**2))))
    momentum = [tank%bodies%motion(1, 1), tank%flow%u(2, 3, 4, 1)]
    call make_wall(heights(2), free=.true.)
    call build(1.0e4_wp)
    viscous%spread = 0.1_wp   ! told wrongly
    call solve_viscous(tank%grid, tank%bodies, tank%flow, viscous)
    call check('conjugate gradients end what sweeps began', [tank%bodies%motion(1, 1), &
               tank%flow%u(2, 3, 4, 1)], momentum, 1.0e-8_wp)
    call check('and the sweeps had ended', viscous%iterations > 11)
    call make_wall(heights(2))
    call solve(1.0e7_wp)
    call check('conjugate gradients instead', viscous%spread < 1.0_wp &
               .and. viscous%iterations <= 10)
  end subroutine few_sweeps

  !> Fluid at rest around a body that moves and turns.
  subroutine body_in_the_system()
    integer :: i, j, k

    call make_wall(heights(2))
    tank%bodies%x(:, 1) = [0.3_wp, 0.6_wp, -0.2_wp]
    tank%bodies%motion(:, 1) = [0.3_wp, -0.2_wp, 0.5_wp, 0.7_wp, -0.4_wp, 0.6_wp]
    call build(5.0_wp)
    call pull_of_links(viscous, tank%flow%u, tank%bodies%motion, viscous%force)
    call check('the block of a body in the system holds it as its links do', viscous%force(:, 1), &
               -matmul(viscous%body_matrix(:, :, 1), tank%bodies%motion(:, 1)), 1.0e-13_wp)
    call check('they do', norm2(viscous%force(4:6, 1)) > 1.0e-3_wp)
    call place('&grid cells=3*10 length=3*1/ '//fluid//'&shape name="b" kind="box" size=3*.4/ ' &
      //body('b', [0.5_wp, 0.5_wp, 0.5_wp])//slip, tank)
    tank%bodies%motion(:, 1) = [0.3_wp, -0.2_wp, 0.5_wp, 0.7_wp, -0.4_wp, 0.6_wp]
    do k = 1, 10
      do j = 1, 10
        do i = 1, 10
          tank%flow%u(i, j, k, :) = wall_velocity(tank%bodies%motion(:, 1), &
            tank%grid%centre([i, j, k], [1, 2, 3]) - 0.5_wp)
        end do
      end do
    end do
    call viscous_init(tank%grid, 1, viscous)
    call build(5.0_wp)
    call pull_of_links(viscous, tank%flow%u, tank%bodies%motion, viscous%force)
    call check('what turns as one does not rub', maxval(abs(viscous%force(:, 1))) < 1.0e-12_wp)
  end subroutine body_in_the_system

  !> The small cell above the wall, centre inside, hangs on the cell above it as on a lever, its
  !! middle at r of the distance of that cell from the wall, and has no links. A cell that is known
  !! at its centre is heavier by the part that this has of its velocity.
  subroutine small_cells()
    real(wp) :: open, mass

    call make_wall(heights(2))
    call build(5.0_wp, small=.true.)
    open = 2.0_wp - heights(2)/tank%grid%h(3)   ! share of the second cell
    mass = viscous%mass(2, 2, 3)
    call check('mass of a group', mass, rho*(1.0_wp + (0.5_wp*open/(open + 0.5_wp))**2*open) &
               *tank%grid%volume/5.0_wp, 1.0e-12_wp)
    merged%centre(merged%number(2, 2, 3)) = 0.5_wp
    call build(5.0_wp, small=.true.)
    call check('mass at a centre', viscous%mass(2, 2, 3), 2*mass, 1.0e-12_wp)
    call check('the small is no unknown', viscous%mass(2, 2, 2), 0.0_wp)
  end subroutine small_cells

  !> Between two walls closer than a cell a small cell has no target: viscosity leaves it alone.
  subroutine between_two_walls()
    call make_wall(3.65_wp/8, from=3.95_wp/8)
    tank%flow%u(:, :, :, 1) = lid
    call solve(long_time, small=.true.)
    call check('small between two walls', tank%flow%u(3, 2, 4, 1), lid)
  end subroutine between_two_walls

  !> Fluid alone in a box of cells of 0.1 m.
  subroutine make_box(n, around)
    integer, intent(in) :: n(3)
    character(*), intent(in) :: around   !! the group &boundary

    call place('&grid cells='//to_text(n)//' length='//to_text(0.1_wp*n)//'/ '//fluid//around, tank)
    call viscous_init(tank%grid, 0, viscous)
  end subroutine make_box

  !> A wave in a box with slip walls, on threads that have many planes of cells, two, one or none.
  subroutine waves_in_closed_box()
    integer, parameter :: n(3) = [6, 5, 9], mode(3) = [2, 1, 5], threads(5) = [1, 2, 4, 9, 12]
    real(wp), parameter :: number = 1.5_wp   !! nu dt/h^2
    real(wp) :: wave(n(1), n(2), n(3)), first(n(1), n(2), n(3)), slows, x(3)
    integer :: i, j, k, m, most

    slows = 1.0_wp + 4.0_wp*number*sum(sin(0.5_wp*pi*real(mode, wp)/real(n, wp))**2)
    do concurrent (k=1:n(3), j=1:n(2), i=1:n(1))
      x = pi*real(mode, wp)*(real([i, j, k], wp) - 0.5_wp)/real(n, wp)
      wave(i, j, k) = sin(x(1))*cos(x(2))*cos(x(3))   ! none into the walls
    end do
    most = omp_get_max_threads()
    do m = 1, size(threads)
      call omp_set_num_threads(threads(m))
      call make_box(n, slip)
      associate (u => tank%flow%u(1:n(1), 1:n(2), 1:n(3), 1))
        u = wave
        call solve(number*0.1_wp**2*rho/mu)
        if (m == 1) first = u
        call check('closed box: by sweeps', viscous%converged .and. viscous%iterations > 1)
        call check('closed box: the wave decays', u - wave/slows, 0.0_wp, 1.0e-8_wp)
        call check('closed box: the same bits on any threads', all(abs(u - first) <= 0.0_wp))
      end associate
    end do
    call omp_set_num_threads(most)
  end subroutine waves_in_closed_box

  !> Waves in a periodic box of odd numbers of cells: each decays by its own factor.
  subroutine waves_in_odd_box(number)
    real(wp), intent(in) :: number   !! nu dt/h^2
    integer, parameter :: n(3) = [5, 7, 9], mode(3, 2) = reshape([2, 3, 4, 1, 0, 2], [3, 2])
    real(wp) :: wave(n(1), n(2), n(3), 2), slows(2), x(3)
    integer :: i, j, k, m

    call make_box(n, sides('periodic periodic periodic periodic periodic periodic'))
    do m = 1, 2
      slows(m) = 1.0_wp + 4.0_wp*number*sum(sin(pi*real(mode(:, m), wp)/real(n, wp))**2)
      do concurrent (k=1:n(3), j=1:n(2), i=1:n(1))
        x = 2.0_wp*pi*real(mode(:, m)*[i, j, k], wp)/real(n, wp)
        wave(i, j, k, m) = cos(x(1) + 0.3_wp)*cos(x(2) + 0.2_wp)*cos(x(3) + 0.1_wp)
      end do
    end do
    associate (u => tank%flow%u(1:n(1), 1:n(2), 1:n(3), 1), &
      w => tank%flow%u(1:n(1), 1:n(2), 1:n(3), 3), a => wave(:, :, :, 1), b => wave(:, :, :, 2))
      u = a + b
      w = a - b
      call solve(number*0.1_wp**2*rho/mu)
      call check('odd box: converged', viscous%converged)
      call check('odd box: waves decay', max(maxval(abs(u - a/slows(1) - b/slows(2))), &
                 maxval(abs(w - a/slows(1) + b/slows(2)))), 0.0_wp, 3.0e-9_wp)
    end associate
  end subroutine waves_in_odd_box

  !> Momentum of the unknowns along x [kg m/s].
  real(wp) function fluid_momentum() result(p)
    integer :: k

    p = 0.0_wp
    do k = 1, 8
      p = p + rho*tank%grid%volume*sum(0.5_wp*(tank%solid%aperture(1:4, 1:4, k, 1) &
        + tank%solid%aperture(2:5, 1:4, k, 1))*tank%flow%u(1:4, 1:4, k, 1))
    end do
  end function fluid_momentum

end module test_viscous_m
