!> Implicit viscosity: exact shear past a wall inside the cells, small cell cells, momentum of the
!! stage.
module test_viscous_m
  use omp_lib, only: omp_get_max_threads, omp_set_num_threads
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use case_types_m, only: grid_input_t, boundary_input_t
  use grid_m, only: grid_t, grid_init
  use fields_m, only: flow_t, flow_init
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use rigid_motion_m, only: rigid_motion_t, rigid_motion_init, set_inertia
  use viscous_system_m, only: viscous_t, viscous_init
  use viscous_links_m, only: build_viscous
  use merged_cells_m, only: merged_cells_t, merged_cells_init, find_merged_cells
  use viscous_m, only: solve_viscous, force_of_links
  use check_m, only: check
  implicit none
  private
  public :: test_viscous

  type(grid_t) :: grid
  type(flow_t) :: flow
  type(solid_geometry_t) :: solid
  type(rigid_motion_t) :: wall
  type(viscous_t) :: viscous
  type(merged_cells_t) :: merged
  real(wp), parameter :: mu = 2.0e-3_wp, rho = 900.0_wp, speed = 0.7_wp, depth = 1.0_wp, &
    lid = -1.1_wp, long_time = 1.0e14_wp
  real(wp), parameter :: heights(3) = [0.13_wp, 0.22_wp, 0.26_wp]
    !! of the surface, cell height 1/8
  real(wp) :: z, worst, momentum(2), small
  integer :: k, n

contains

  subroutine test_viscous()
    call make_grid()
    do n = 1, size(heights)
      call make_wall(heights(n))
      ! A long step brings the steady shear flow between moving surface and the tank's upper wall.
      call build_viscous(grid, solid, wall, flow%rho, flow%mu, long_time, viscous)
      call solve_viscous(grid, wall, flow, viscous)
      worst = 0.0_wp
      do k = 1, 8
        z = grid%centre(k, 3)
        if (z < heights(n)) cycle
        worst = max(worst, maxval(abs(flow%u(1:4, 1:4, k, 1) - speed*(depth - z)/(depth &
            - heights(n)))))
      end do
      call check('converged', viscous%converged)
      call check('a direction where sweeps would be hundreds', viscous%iterations <= 10)   ! 8
      call check('linear profile above a wall inside a cell', worst, 0.0_wp, 1.0e-7_wp)
      call check('shear force on the wall', viscous%force(1, 1), -mu*speed/(depth - heights(n)), &
                 1.0e-7_wp*mu*speed)
    end do

    ! A free body and the fluid it drags: the stage gives to one what it takes from the other.
    call make_wall(heights(2))
    wall%free = .true.
    momentum(1) = fluid_momentum() + wall%mass(1)*wall%motion(1, 1)
    call build_viscous(grid, solid, wall, flow%rho, flow%mu, 5.0_wp, viscous)
    call solve_viscous(grid, wall, flow, viscous)
    momentum(2) = fluid_momentum() + wall%mass(1)*wall%motion(1, 1) &
                  + 5.0_wp*sum(2.0_wp*mu*8.0_wp*flow%u(1:4, 1:4, 8, 1))/16.0_wp
    call check('momentum of body, fluid and tank wall', momentum(2), momentum(1), &
               1.0e-7_wp*momentum(1))
    call check('the body slows by the force it feels', wall%mass(1)*(wall%motion(1, 1) - speed), &
               5.0_wp*viscous%force(1, 1), 1.0e-7_wp*momentum(1))

    ! A step that moves momentum by a cell or so: as few sweeps as two colours promise.
    call make_wall(heights(2))
    wall%free = .true.
    call build_viscous(grid, solid, wall, flow%rho, flow%mu, 1.0e4_wp, viscous)
    call solve_viscous(grid, wall, flow, viscous)
    call check('links to other cells beside the rest', viscous%spread > 0.5_wp &
               .and. viscous%spread < 0.95_wp)
    call check('sweeps as the bound promises', viscous%iterations > 10 .and. viscous%iterations &
               <= 0.7_wp*log(1.0e-9_wp)/log(viscous%spread/(1.0_wp + sqrt(1.0_wp &
                                                                         - viscous%spread**2))))
    momentum = [wall%motion(1, 1), flow%u(2, 3, 4, 1)]
    call make_wall(heights(2))
    wall%free = .true.
    call build_viscous(grid, solid, wall, flow%rho, flow%mu, 1.0e4_wp, viscous)
    viscous%spread = 0.1_wp   ! told wrongly, so that the sweeps end too early
    call solve_viscous(grid, wall, flow, viscous)
    call check('conjugate gradients end what sweeps began', [wall%motion(1, 1), &
               flow%u(2, 3, 4, 1)], momentum, 1.0e-8_wp)
    call check('and the sweeps had ended', viscous%iterations > 11)
    call make_wall(heights(2))
    call build_viscous(grid, solid, wall, flow%rho, flow%mu, 1.0e7_wp, viscous)
    call solve_viscous(grid, wall, flow, viscous)
    call check('a thousand sweeps are left to conjugate gradients', viscous%spread < 1.0_wp &
               .and. viscous%iterations <= 10)

    ! Fluid at rest around a body that moves and turns.
    wall%x(:, 1) = [0.3_wp, 0.6_wp, -0.2_wp]
    wall%motion(:, 1) = [0.3_wp, -0.2_wp, 0.5_wp, 0.7_wp, -0.4_wp, 0.6_wp]
    flow%u = 0.0_wp
    call build_viscous(grid, solid, wall, flow%rho, flow%mu, 5.0_wp, viscous)
    call force_of_links(wall, flow, viscous)
    call check('the block of a body in the system holds it as its links do', viscous%force(:, 1), &
               -matmul(viscous%body_matrix(:, :, 1), wall%motion(:, 1)), 1.0e-13_wp)
    call check('they do', norm2(viscous%force(4:6, 1)) > 1.0e-3_wp)

    ! The small cell above the wall, centre inside, hangs on the cell above it as on a lever, its
    ! middle at r of the distance of that cell from the wall, and has no links. A cell that is known
    ! at its centre is heavier by the part that this has of its velocity.
    call make_wall(heights(2))
    call merged_cells_init(grid, merged)
    call find_merged_cells(grid, solid, merged)
    call build_viscous(grid, solid, wall, flow%rho, flow%mu, 5.0_wp, viscous, merged)
    small = 2.0_wp - heights(2)/grid%h(3)   ! open share of the second cell
    call check('mass of a group', viscous%mass(2, 2, 3), &
               rho*(1.0_wp + (0.5_wp*small/(small + 0.5_wp))**2*small)*grid%volume/5.0_wp, &
               1.0e-12_wp)
    merged%centre(merged%number(2, 2, 3)) = 0.5_wp
    small = viscous%mass(2, 2, 3)
    call build_viscous(grid, solid, wall, flow%rho, flow%mu, 5.0_wp, viscous, merged)
    call check('mass at a centre', viscous%mass(2, 2, 3), 2*small, 1.0e-12_wp)
    call check('the small is no unknown', viscous%mass(2, 2, 2), 0.0_wp, 0.0_wp)

    ! The upper side moves too: shear flow between two moving walls.
    grid%side_velocity(1, 2, 3) = lid
    call viscous_init(grid, 1, viscous)
    call make_wall(heights(1))
    call build_viscous(grid, solid, wall, flow%rho, flow%mu, long_time, viscous)
    call solve_viscous(grid, wall, flow, viscous)
    worst = 0.0_wp
    do k = 2, 8
      z = (grid%centre(k, 3) - heights(1))/(depth - heights(1))
      worst = max(worst, maxval(abs(flow%u(1:4, 1:4, k, 1) - (1.0_wp - z)*speed - z*lid)))
    end do
    call check('linear profile below a moving side', worst, 0.0_wp, 1.0e-7_wp)

    ! A small cell between two walls closer than a cell has no target: viscosity leaves it alone.
    grid%side_velocity = 0.0_wp
    call make_gap(3.65_wp*grid%h(3), 3.95_wp*grid%h(3), 2)
    flow%u(:, :, :, 1) = speed
    call find_merged_cells(grid, solid, merged)
    call build_viscous(grid, solid, wall, flow%rho, flow%mu, long_time, viscous, merged)
    call solve_viscous(grid, wall, flow, viscous)
    call check('small between two walls', flow%u(2, 2, 4, 1), speed, 0.0_wp)
    call waves_in_odd_box(0.3_wp)
    call check('odd box: by sweeps', viscous%iterations > 10 .and. viscous%iterations <= 25)   ! 21
    call waves_in_odd_box(5.0_wp)
    call check('odd box, longer step: left to conjugate gradients', viscous%iterations, 2)
    call waves_in_closed_box()
  end subroutine test_viscous

  !> A wave in a box with slip walls, on threads that have many planes of cells, two, one or none.
  subroutine waves_in_closed_box()
    integer, parameter :: n(3) = [6, 5, 9], mode(3) = [2, 1, 5], threads(5) = [1, 2, 4, 9, 12]
    real(wp), parameter :: pi = acos(-1.0_wp), number = 1.5_wp   !! nu dt/h^2
    type(grid_input_t) :: input
    type(boundary_input_t) :: boundary
    type(grid_t) :: box
    real(wp) :: wave(n(1), n(2), n(3)), first(n(1), n(2), n(3)), slows, x(3)
    integer :: i, j, k, m, most

    input%cells = n
    input%length = 0.1_wp*real(n, wp)
    boundary%kind = 'slip'
    call grid_init(input, boundary, box)
    call solid_geometry_init(box, solid, 0)
    call rigid_motion_init(0, wall)
    call viscous_init(box, 0, viscous)
    slows = 1.0_wp + 4.0_wp*number*sum(sin(0.5_wp*pi*real(mode, wp)/real(n, wp))**2)
    do k = 1, n(3)
      do j = 1, n(2)
        do i = 1, n(1)
          x = pi*real(mode, wp)*(real([i, j, k], wp) - 0.5_wp)/real(n, wp)
          wave(i, j, k) = sin(x(1))*cos(x(2))*cos(x(3))   ! none into the walls
        end do
      end do
    end do
    most = omp_get_max_threads()
    do m = 1, size(threads)
      call omp_set_num_threads(threads(m))
      call flow_init(box, flow)
      flow%rho = rho
      flow%mu = mu
      flow%u(1:n(1), 1:n(2), 1:n(3), 1) = wave
      call build_viscous(box, solid, wall, flow%rho, flow%mu, number*0.1_wp**2*rho/mu, viscous)
      call solve_viscous(box, wall, flow, viscous)
      if (m == 1) first = flow%u(1:n(1), 1:n(2), 1:n(3), 1)
      call check('closed box: by sweeps', viscous%converged .and. viscous%iterations > 1)
      call check('closed box: the wave decays', maxval(abs(flow%u(1:n(1), 1:n(2), 1:n(3), 1) &
                                                           - wave/slows)), 0.0_wp, 1.0e-8_wp)
      call check('closed box: the same bits on any threads', &
                 all(abs(flow%u(1:n(1), 1:n(2), 1:n(3), 1) - first) <= 0.0_wp))
    end do
    call omp_set_num_threads(most)
  end subroutine waves_in_closed_box

  !> Waves in a periodic box of odd numbers of cells, where first and last cell are of one colour:
  !! each decays by its own factor.
  subroutine waves_in_odd_box(number)
    real(wp), intent(in) :: number   !! nu dt/h^2
    integer, parameter :: n(3) = [5, 7, 9], mode(3, 2) = reshape([2, 3, 4, 1, 0, 2], [3, 2])
    real(wp), parameter :: pi = acos(-1.0_wp)
    type(grid_input_t) :: input
    type(boundary_input_t) :: boundary
    type(grid_t) :: box
    real(wp) :: wave(n(1), n(2), n(3), 2), slows(2), x(3)
    integer :: i, j, k, m

    input%cells = n
    input%length = 0.1_wp*real(n, wp)
    boundary%kind = 'periodic'
    call grid_init(input, boundary, box)
    call flow_init(box, flow)
    call solid_geometry_init(box, solid, 0)
    call rigid_motion_init(0, wall)
    call viscous_init(box, 0, viscous)
    flow%rho = rho
    flow%mu = mu
    do m = 1, 2
      slows(m) = 1.0_wp + 4.0_wp*number*sum(sin(pi*real(mode(:, m), wp)/real(n, wp))**2)
      do k = 1, n(3)
        do j = 1, n(2)
          do i = 1, n(1)
            x = 2.0_wp*pi*real(mode(:, m)*[i, j, k], wp)/real(n, wp)
            wave(i, j, k, m) = cos(x(1) + 0.3_wp)*cos(x(2) + 0.2_wp)*cos(x(3) + 0.1_wp)
          end do
        end do
      end do
    end do
    flow%u(1:n(1), 1:n(2), 1:n(3), 1) = wave(:, :, :, 1) + wave(:, :, :, 2)
    flow%u(1:n(1), 1:n(2), 1:n(3), 3) = wave(:, :, :, 1) - wave(:, :, :, 2)
    call build_viscous(box, solid, wall, flow%rho, flow%mu, number*0.1_wp**2*rho/mu, viscous)
    call solve_viscous(box, wall, flow, viscous)
    call check('odd box: converged', viscous%converged)
    call check('odd box: waves decay', maxval(abs(flow%u(1:n(1), 1:n(2), 1:n(3), [1, 3]) &
               - (spread(wave(:, :, :, 1), 4, 2)/slows(1) + spread(wave(:, :, :, 2), 4, 2) &
                  *reshape(spread([1.0_wp, -1.0_wp], 1, product(n)), [n, 2])/slows(2)))), 0.0_wp, &
               3.0e-9_wp)
  end subroutine waves_in_odd_box

  !> 4 x 4 x 8 cells of a unit cube, periodic sideways.
  subroutine make_grid()
    type(grid_input_t) :: input
    type(boundary_input_t) :: boundary

    input%cells = [4, 4, 8]
    input%length = 1.0_wp
    boundary%kind(:, 1:2) = 'periodic'
    boundary%kind(:, 3) = 'no_slip'
    call grid_init(input, boundary, grid)
    call viscous_init(grid, 1, viscous)
  end subroutine make_grid

  !> A body that fills everything below height z0 and moves along x.
  subroutine make_wall(z0)
    real(wp), intent(in) :: z0
    integer :: k
    real(wp) :: low, share

    call flow_init(grid, flow)
    call solid_geometry_init(grid, solid, 1)
    call rigid_motion_init(1, wall)
    flow%rho = rho
    flow%mu = mu
    wall%present = .true.
    wall%motion(:, 1) = [speed, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    wall%mass = 50.0_wp
    wall%inertia(:, :, 1) = reshape([1.0e9_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0e9_wp, 0.0_wp, 0.0_wp, &
                                    0.0_wp, 1.0e9_wp], [3, 3])
    wall%inverse_inertia(:, :, 1) = wall%inertia(:, :, 1)*1.0e-18_wp
    call set_inertia(1, wall)
    do k = 1, 8
      low = grid%face(k, 3)
      share = min(max((z0 - low)/grid%h(3), 0.0_wp), 1.0_wp)
      solid%alpha(:, :, k) = share
      solid%aperture(:, :, k, 1:2) = 1.0_wp - share
      if (low < z0) solid%aperture(:, :, k, 3) = 0.0_wp
      if (grid%centre(k, 3) < z0) solid%inside(:, :, k) = 1
      if (k == 1) cycle
      if (grid%centre(k - 1, 3) < z0 .and. grid%centre(k, 3) > z0) then
        call list_links(k, (grid%centre(k, 3) - z0)/grid%h(3))
      end if
    end do
    call list_slab(1, 0.0_wp, z0)
  end subroutine make_wall

  !> The links through the lower faces of the cells of plane k, so long above the wall of body 1.
  subroutine list_links(k, length)
    integer, intent(in) :: k
    real(wp), intent(in) :: length   !! [h]
    integer :: i, j

    call ensure_capacity(product(grid%n), solid%link)
    call ensure_capacity(product(grid%n), solid%link_length)
    call ensure_capacity(product(grid%n), solid%link_body)
    do j = 1, grid%n(2)
      do i = 1, grid%n(1)
        solid%n_link = solid%n_link + 1
        solid%link(:, solid%n_link) = [i, j, k, 3]
        solid%link_number(i, j, k, 3) = solid%n_link
        solid%link_length(:, solid%n_link) = [1.0_wp - length, length]
        solid%link_body(:, solid%n_link) = 1
      end do
    end do
  end subroutine list_links

  !> Two held bodies with a gap between them, or the floor and a body above it that moves along x;
  !! the gap is narrower than a cell, whose centre lies in a body.
  subroutine make_gap(low, high, bodies)
    real(wp), intent(in) :: low, high   !! of the gap [m]
    integer, intent(in) :: bodies       !! above the gap the last, below it the first of two
    integer :: k
    real(wp) :: gap

    call flow_init(grid, flow)
    call solid_geometry_init(grid, solid, bodies)
    call viscous_init(grid, bodies, viscous)
    call rigid_motion_init(bodies, wall)
    wall%present = .true.
    flow%rho = rho
    flow%mu = mu
    do k = 1, 8
      gap = max(min(grid%face(k + 1, 3), high) - max(grid%face(k, 3), low), 0.0_wp)/grid%h(3)
      solid%alpha(:, :, k) = 1.0_wp - gap
      solid%aperture(:, :, k, 1:2) = gap
      solid%aperture(:, :, k, 3) = 0.0_wp
      if (low <= 0.0_wp .and. k == 1) solid%aperture(:, :, k, 3) = 1.0_wp
      solid%inside(:, :, k) = merge(1, bodies, grid%centre(k, 3) < low)
    end do
    if (low > 0.0_wp) call list_slab(1, 0.0_wp, low)
    call list_slab(bodies, high, depth)
  end subroutine make_gap

  !> Append what a slab of body b between two heights covers to the lists; bodies in their order.
  subroutine list_slab(b, low, high)
    integer, intent(in) :: b
    real(wp), intent(in) :: low, high   !! [m]
    integer :: i, j, k, d, n_cell, n_face
    real(wp) :: share

    if (b == 1) then
      n_cell = size(solid%alpha)
      solid%cell = reshape([integer ::], [3, 2*n_cell], [0])
      solid%face = reshape([integer ::], [4, 6*n_cell], [0])
      solid%cut_cell = solid%cell
      solid%cell_alpha = spread(0.0_wp, 1, 2*n_cell)
      solid%face_beta = spread(0.0_wp, 1, 6*n_cell)
    end if
    n_cell = solid%body_cell(b) - 1
    n_face = solid%body_face(b) - 1
    do k = 1, 8
      share = min(high, grid%face(k + 1, 3)) - max(low, grid%face(k, 3))
      share = max(share, 0.0_wp)/grid%h(3)
      do j = lbound(solid%alpha, 2), ubound(solid%alpha, 2)
        do i = lbound(solid%alpha, 1), ubound(solid%alpha, 1)
          do d = 1, 3
            if (d == 3 .and. (grid%face(k, 3) < low .or. grid%face(k, 3) > high)) cycle
            if (d < 3 .and. share <= 0.0_wp) cycle
            n_face = n_face + 1
            solid%face(:, n_face) = [i, j, k, d]
            solid%face_beta(n_face) = merge(1.0_wp, share, d == 3)
          end do
          if (share <= 0.0_wp) cycle
          n_cell = n_cell + 1
          solid%cell(:, n_cell) = [i, j, k]
          solid%cell_alpha(n_cell) = share
          if (solid%alpha(i, j, k) >= 1.0_wp .or. solid%cut(i, j, k) > 0) cycle
          solid%n_cut = solid%n_cut + 1
          solid%cut(i, j, k) = solid%n_cut
          solid%cut_cell(:, solid%n_cut) = [i, j, k]
          call ensure_capacity(solid%n_cut, solid%edge)
          solid%edge(solid%n_cut) = 0.0_wp
        end do
      end do
    end do
    solid%body_cell(b + 1:) = n_cell + 1
    solid%body_face(b + 1:) = n_face + 1
  end subroutine list_slab

  !> Momentum of the unknowns along x [kg m/s].
  function fluid_momentum() result(p)
    real(wp) :: p
    integer :: k

    p = 0.0_wp
    do k = 1, 8
      p = p + rho*grid%volume*sum(0.5_wp*(solid%aperture(1:4, 1:4, k, 1) &
                                          + solid%aperture(2:5, 1:4, k, 1))*flow%u(1:4, 1:4, k, 1))
    end do
  end function fluid_momentum

end module test_viscous_m
