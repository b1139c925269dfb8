!> Implicit viscosity with no-slip on the bodies: legs to the exact surface, film cells, and the
!! body velocities as unknowns of the same system.
!!
!! A cell whose centre lies in the fluid is joined to its six neighbours by legs. A leg that meets a
!! surface at distance theta h becomes a wall leg of conductance mu A/(theta h) (symmetric
!! Shortley-Weller legs, Gibou et al. 2002), which is exact for shear past any plane. A cell whose
!! centre lies in a body but which has open faces (film cell) hangs on the wall alone. The force on
!! the body is the sum over its wall legs, so the stage conserves momentum.
!! Departure from the paper: its overlay gives a drag that depends on the time step.
module viscous_m
  use kinds_m, only: wp
  use case_types_m, only: fluid_t
  use vectors_m, only: cross
  use grid_m, only: grid_t, n_halo, unit_step, side_no_slip, side_slip, side_inflow
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t, wall_velocity
  use rigid_flux_m, only: nearest_arm
  use mixture_m, only: harmonic_mean
  use boundary_m, only: fill_velocity_halo
  use exact_sum_m, only: exact_dot, exact_sums
  use parallel_m, only: halo_exchange, global_max
  implicit none
  private
  public :: viscous_t, viscous_init, build_viscous, solve_viscous, open_share
  public :: apply_viscous, force_of_legs, velocity_scale, inertial_momentum, wrench   ! for C-ISMAC

  real(wp), parameter :: least_theta = 1.0e-3_wp    !! shortest leg, in cells
  real(wp), parameter :: least_mass = 1.0e-6_wp     !! share below which a velocity is the wall's
  real(wp), parameter :: tolerance = 1.0e-9_wp      !! of the largest velocity
  integer, parameter :: max_iterations = 500

  type :: viscous_t
    real(wp), allocatable :: mass(:, :, :, :)
      !! rho m V/dt of each component, 0: not an unknown [kg/s]
    real(wp), allocatable :: leg(:, :, :, :)
      !! conductance of the leg across the lower face [kg/s]
    real(wp), allocatable :: diagonal(:, :, :, :)   !! [kg/s]
    real(wp), allocatable :: inverse(:, :, :, :)    !! of the diagonal, 0: not an unknown [s/kg]
    real(wp), allocatable :: r(:, :, :, :), z(:, :, :, :), s(:, :, :, :), y(:, :, :, :)
    integer :: n_wall = 0                      !! wall legs, grouped by body
    integer, allocatable :: first(:)           !! (bodies + 1)
    integer, allocatable :: cell(:, :)         !! (3, *)
    real(wp), allocatable :: k(:)              !! conductance [kg/s]
    real(wp), allocatable :: arm(:, :)         !! (3, *) from the centre of mass to the wall [m]
    real(wp), allocatable :: work(:, :)        !! (*, 6)
    real(wp), allocatable :: body_matrix(:, :, :)
      !! (6, 6, n) wall legs seen by the body [kg/s, kg m, kg m2/s]
    integer :: n_side = 0                      !! half legs to sides that move
    integer, allocatable :: side_cell(:, :)    !! (3, *)
    real(wp), allocatable :: side_pull(:, :)
      !! (3, *) conductance times velocity of the side [kg m/s2]
    real(wp), allocatable :: spin_drag(:)
      !! 2 mu V of the body: torque per angular velocity [N m s]
    integer, allocatable :: wall_body(:)       !! body of each leg as found, before grouping
    integer, allocatable :: found_cell(:, :)
    real(wp), allocatable :: found_k(:), found_arm(:, :)
    real(wp), allocatable :: film(:, :)
      !! (7, cut cells) wall of one body, sum over the walls, as vectors; sum of their sizes [m2]
    real(wp), allocatable :: wall_area(:, :)
      !! (3, cells of the bodies) wall of the body in each film cell as a vector [m2]
  end type viscous_t

contains

  !> Allocate the work arrays.
  subroutine viscous_init(grid, n_bodies, self)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: n_bodies
    type(viscous_t), intent(out) :: self
    integer :: a(3), b(3), m(3), n

    a = grid%first
    b = grid%last
    m = grid%hi - grid%lo + 1
    n = 2*(m(1)*m(2) + m(2)*m(3) + m(3)*m(1))
    if (.not. any(abs(grid%side_velocity) > 0.0_wp)) n = 0
    allocate (self%side_cell(3, n), self%side_pull(3, n))
    allocate (self%mass(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
    allocate (self%leg, self%diagonal, self%inverse, self%r, self%z, self%s, self%y, &
              source=self%mass)
    allocate (self%first(n_bodies + 1), source=1)
    allocate (self%body_matrix(6, 6, n_bodies), source=0.0_wp)
    allocate (self%spin_drag(n_bodies), source=0.0_wp)
    allocate (self%cell(3, 0), self%k(0), self%arm(3, 0), self%work(0, 6))
    allocate (self%film(7, 0), self%wall_area(3, 0))
    allocate (self%wall_body(0), self%found_cell(3, 0), self%found_k(0), self%found_arm(3, 0))
  end subroutine viscous_init

  !> Share of the cell's mass that moves with velocity component d: mean of its two open faces.
  elemental function open_share(w_low, w_high) result(m)
    real(wp), intent(in) :: w_low, w_high   !! open shares of the lower and upper face
    real(wp) :: m

    m = 0.5_wp*(w_low + w_high)
  end function open_share

  !> Assemble masses, legs and wall legs for the geometry and the fluid at the end of the step.
  subroutine build_viscous(grid, solid, bodies, rho, mu, dt, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in), dimension(grid%first(1):, grid%first(2):, grid%first(3):), &
      contiguous :: rho, mu      !! [kg/m3], [Pa s]
    real(wp), intent(in) :: dt   !! [s]
    type(viscous_t), intent(inout) :: self
    integer :: d

    self%n_wall = 0
    self%n_side = 0
    self%diagonal = 0.0_wp
    do d = 1, 3
      call unknown_masses(grid, solid, rho, dt, d, self)
    end do
    do d = 1, 3
      call legs_of_direction(grid, solid, bodies, mu, d, self)
    end do
    call film_legs(grid, solid, bodies, mu, self)
    call group_by_body(bodies%n, self)
    call bodies_seen_by_legs(solid, bodies, mu, grid, self)
    self%diagonal = self%diagonal + self%mass
    where (self%mass > 0.0_wp)
      self%inverse = 1.0_wp/self%diagonal
    else where
      self%inverse = 0.0_wp
    end where
  end subroutine build_viscous

  !> Mass over dt of component d in each cell; zero where the velocity is the wall's.
  subroutine unknown_masses(grid, solid, rho, dt, d, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(in) :: dt
    integer, intent(in) :: d
    type(viscous_t), intent(inout) :: self
    integer :: i, j, k, e(3)
    real(wp) :: m

    e = unit_step(:, d)
    !$omp parallel do private(i, j, m) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          m = open_share(solid%open(i, j, k, d), solid%open(i + e(1), j + e(2), k + e(3), d))
          if (m < least_mass) m = merge(least_mass, 0.0_wp, solid%inside(i, j, k) == 0)
          self%mass(i, j, k, d) = rho(i, j, k)*m*grid%volume/dt
        end do
      end do
    end do
  end subroutine unknown_masses

  !> Legs between neighbours in direction d: ordinary, or wall legs of one or both cells.
  subroutine legs_of_direction(grid, solid, bodies, mu, d, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in), contiguous :: mu(grid%first(1):, grid%first(2):, grid%first(3):)
    integer, intent(in) :: d
    type(viscous_t), intent(inout) :: self
    integer :: i, j, k, e(3), low(3), high(3), upper(3)
    real(wp) :: conductance   !! A/h [m]
    logical :: low_wet, high_wet, free_leg

    e = unit_step(:, d)
    upper = grid%hi + e
    conductance = grid%area(d)/grid%h(d)
    do k = grid%lo(3), upper(3)
      do j = grid%lo(2), upper(2)
        do i = grid%lo(1), upper(1)
          high = [i, j, k]
          low = high - e
          self%leg(i, j, k, d) = 0.0_wp
          if (at_domain_side(grid, high(d), d)) then
            call side_leg(high(d))
            cycle
          end if
          low_wet = solid%inside(low(1), low(2), low(3)) == 0
          high_wet = solid%inside(i, j, k) == 0
          free_leg = solid%leg_low(i, j, k, d) > 1.0_wp .and. solid%leg_high(i, j, k, d) > 1.0_wp
          if (low_wet .and. high_wet .and. free_leg) then
            self%leg(i, j, k, d) = conductance &
              *harmonic_mean(mu(low(1), low(2), low(3)), mu(i, j, k))
            call add_diagonal(low, self%leg(i, j, k, d))
            call add_diagonal(high, self%leg(i, j, k, d))
          else
            if (low_wet) call wall_leg(low, solid%leg_low(i, j, k, d), 1, &
                                       solid%leg_body_low(i, j, k, d))
            if (high_wet) call wall_leg(high, solid%leg_high(i, j, k, d), -1, &
                                        solid%leg_body_high(i, j, k, d))
          end if
        end do
      end do
    end do
  contains
    !> Both cells of an ordinary leg, as far as they are ours.
    subroutine add_diagonal(c, value)
      integer, intent(in) :: c(3)
      real(wp), intent(in) :: value

      self%diagonal(c(1), c(2), c(3), :) = self%diagonal(c(1), c(2), c(3), :) + value
    end subroutine add_diagonal

    !> Leg from the centre of cell c along +d or -d to the surface of a body.
    subroutine wall_leg(c, theta, sense, body)
      integer, intent(in) :: c(3), sense, body
      real(wp), intent(in) :: theta   !! [cells]
      real(wp) :: x_wall(3), t
      integer :: a

      if (any(c < grid%lo) .or. any(c > grid%hi)) return
      t = min(max(theta, least_theta), 1.0_wp)
      do a = 1, 3
        x_wall(a) = grid%centre(c(a), a)
      end do
      x_wall(d) = x_wall(d) + real(sense, wp)*t*grid%h(d)
      call add_wall(self, c, body, mu(c(1), c(2), c(3))*conductance/t, &
                    nearest_arm(grid, x_wall, bodies%x(:, body)))
    end subroutine wall_leg

    !> Half a leg to a wall of the domain or to an inflow, which pulls the cell towards the velocity
    !! of the side; slip walls hold the normal component only.
    subroutine side_leg(face)
      integer, intent(in) :: face
      integer :: s, c(3)
      real(wp) :: value

      s = merge(1, 2, face == 1)
      c = merge(high, low, s == 1)
      if (any(c < grid%lo) .or. any(c > grid%hi)) return
      if (solid%inside(c(1), c(2), c(3)) /= 0) return
      value = 2.0_wp*mu(c(1), c(2), c(3))*conductance
      select case (grid%side(s, d))
      case (side_no_slip, side_inflow)
        call add_side(self, c, value, grid%side_velocity(:, s, d))
      case (side_slip)
        self%diagonal(c(1), c(2), c(3), d) = self%diagonal(c(1), c(2), c(3), d) + value
      case default   ! open sides and outflows hold nothing
      end select
    end subroutine side_leg
  end subroutine legs_of_direction

  !> A lower face of index i that lies on a side of the domain with a boundary condition.
  pure function at_domain_side(grid, i, d) result(side)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: i, d
    logical :: side

    side = (i == 1 .or. i == grid%n(d) + 1) .and. .not. grid%periodic(d)
  end function at_domain_side

  !> Film cells: centre inside a body, but with open faces. Their fluid, V_o = V(1 - alpha), lies in
  !! layers of mean thickness V_o/A on the walls: A_b of each body there, A_s of no-slip sides of
  !! the domain, A their sum. With N the sum of the areas as vectors, a wall gets the conductance
  !! mu (3 - |N|^2/A^2) A_b A/V_o: exact for shear with a free side on one wall, 2 mu A/(V_o/A), and
  !! for the parabola between two walls face to face, 3 mu A/(V_o/A).
  subroutine film_legs(grid, solid, bodies, mu, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in), contiguous :: mu(grid%first(1):, grid%first(2):, grid%first(3):)
    type(viscous_t), intent(inout) :: self
    integer :: b, m, n, c(3)
    real(wp) :: least   !! smallest sum of the areas that counts [m2]

    if (size(self%film, 2) < solid%n_cut) then
      deallocate (self%film)
      allocate (self%film(7, 2*solid%n_cut))
    end if
    if (size(self%wall_area, 2) < size(solid%cell, 2)) then
      deallocate (self%wall_area)
      allocate (self%wall_area(3, size(solid%cell, 2)))
    end if
    least = 1.0e-3_wp*minval(grid%area)
    self%film(:, 1:solid%n_cut) = 0.0_wp
    do b = 1, bodies%n
      call find_areas(b)
    end do
    do n = 1, solid%n_cut
      if (film_number(solid%cut_cell(:, n)) > 0) call hold_by_sides(solid%cut_cell(:, n), n)
    end do
    do b = 1, bodies%n
      do m = solid%body_cell(b), solid%body_cell(b + 1) - 1
        c = solid%cell(:, m)
        n = film_number(c)
        if (n == 0) cycle
        if (solid%inside(c(1), c(2), c(3)) /= b .and. &
            .not. any(abs(self%wall_area(:, m)) > 0.0_wp)) cycle
        call add_wall(self, c, b, film_conductance(c, n)*max(norm2(self%wall_area(:, m)), &
                                                            1.0e-3_wp*least), &
                      nearest_arm(grid, [grid%centre(c(1), 1), grid%centre(c(2), 2), &
                                         grid%centre(c(3), 3)], bodies%x(:, b)))
      end do
    end do
  contains
    !> Number of a cut cell if it is an own film cell with a component that is an unknown, else 0.
    pure function film_number(c) result(n)
      integer, intent(in) :: c(3)
      integer :: n

      n = 0
      if (any(c < grid%lo) .or. any(c > grid%hi)) return
      if (solid%inside(c(1), c(2), c(3)) == 0) return
      if (any(self%mass(c(1), c(2), c(3), :) > 0.0_wp)) n = solid%cut(c(1), c(2), c(3))
    end function film_number

    !> Area of body b in each film cell as a vector, what its shares of the faces lack to close, and
    !! its part of the sums.
    subroutine find_areas(b)
      integer, intent(in) :: b
      integer :: m, d, n
      real(wp) :: area

      do m = solid%body_face(b), solid%body_face(b + 1) - 1
        d = solid%face(4, m)
        area = solid%face_beta(m)*grid%area(d)
        n = film_number(solid%face(1:3, m))
        if (n > 0) self%film(d, n) = self%film(d, n) + area
        n = film_number(solid%face(1:3, m) - unit_step(:, d))
        if (n > 0) self%film(d, n) = self%film(d, n) - area
      end do
      do m = solid%body_cell(b), solid%body_cell(b + 1) - 1
        n = film_number(solid%cell(:, m))
        if (n == 0) cycle
        self%wall_area(:, m) = self%film(1:3, n)
        self%film(4:6, n) = self%film(4:6, n) + self%film(1:3, n)
        self%film(7, n) = self%film(7, n) + norm2(self%film(1:3, n))
        self%film(1:3, n) = 0.0_wp
      end do
    end subroutine find_areas

    !> The open parts of no-slip sides are walls too, and hold the film as they hold the cells whose
    !! centre lies in the fluid.
    subroutine hold_by_sides(c, n)
      integer, intent(in) :: c(3), n
      integer :: d, s
      real(wp) :: area(2, 3)

      do d = 1, 3
        area(:, d) = [area_of_side(c, 1, d), area_of_side(c, 2, d)]
        self%film(3 + d, n) = self%film(3 + d, n) + area(1, d) - area(2, d)
        self%film(7, n) = self%film(7, n) + area(1, d) + area(2, d)
      end do
      self%film(7, n) = max(self%film(7, n), least)
      do d = 1, 3
        do s = 1, 2
          if (area(s, d) > 0.0_wp) call add_side(self, c, film_conductance(c, n)*area(s, d), &
                                                 grid%side_velocity(:, s, d))
        end do
      end do
    end subroutine hold_by_sides

    !> Open part of side s of direction d, if cell c lies at it and it is a wall without slip [m2].
    pure function area_of_side(c, s, d) result(area)
      integer, intent(in) :: c(3), s, d
      real(wp) :: area
      integer :: f(3)

      area = 0.0_wp
      if (grid%periodic(d) .or. c(d) /= merge(1, grid%n(d), s == 1)) return
      f = c + merge(0, 1, s == 1)*unit_step(:, d)
      if (grid%side(s, d) == side_no_slip) area = solid%open(f(1), f(2), f(3), d)*grid%area(d)
    end function area_of_side

    !> Conductance of the film of cut cell n per area of a wall [kg/(s m2)].
    pure function film_conductance(c, n) result(conductance)
      integer, intent(in) :: c(3), n
      real(wp) :: conductance, volume

      volume = max(1.0_wp - solid%alpha(c(1), c(2), c(3)), 1.0e-3_wp)*grid%volume
      conductance = mu(c(1), c(2), c(3))*self%film(7, n)/volume &
                    *(3.0_wp - min(1.0_wp, sum((self%film(4:6, n)/self%film(7, n))**2)))
    end function film_conductance
  end subroutine film_legs

  !> Note what a side that may move does to cell c: conductance k and velocity of the side.
  subroutine add_side(self, c, k, velocity)
    type(viscous_t), intent(inout) :: self
    integer, intent(in) :: c(3)
    real(wp), intent(in) :: k             !! [kg/s]
    real(wp), intent(in) :: velocity(3)   !! [m/s]

    self%diagonal(c(1), c(2), c(3), :) = self%diagonal(c(1), c(2), c(3), :) + k
    if (.not. any(abs(velocity) > 0.0_wp)) return
    self%n_side = self%n_side + 1
    self%side_cell(:, self%n_side) = c
    self%side_pull(:, self%n_side) = k*velocity
  end subroutine add_side

  !> Note a wall leg of conductance k between a cell and a body.
  subroutine add_wall(self, c, body, k, arm)
    type(viscous_t), intent(inout) :: self
    integer, intent(in) :: c(3), body
    real(wp), intent(in) :: k        !! [kg/s]
    real(wp), intent(in) :: arm(3)   !! [m]
    integer :: n

    n = self%n_wall + 1
    if (n > size(self%found_k)) call grow(self)
    self%n_wall = n
    self%found_cell(:, n) = c
    self%wall_body(n) = body
    self%found_k(n) = k
    self%found_arm(:, n) = arm
    self%diagonal(c(1), c(2), c(3), :) = self%diagonal(c(1), c(2), c(3), :) + k
  end subroutine add_wall

  !> Double the length of the lists of wall legs.
  subroutine grow(self)
    type(viscous_t), intent(inout) :: self
    integer, allocatable :: cells(:, :), body(:)
    real(wp), allocatable :: k(:), arm(:, :)
    integer :: n, m

    n = self%n_wall
    m = max(1024, 2*n)
    allocate (cells(3, m), body(m), k(m), arm(3, m))
    cells(:, :n) = self%found_cell(:, :n)
    body(:n) = self%wall_body(:n)
    k(:n) = self%found_k(:n)
    arm(:, :n) = self%found_arm(:, :n)
    call move_alloc(cells, self%found_cell)
    call move_alloc(body, self%wall_body)
    call move_alloc(k, self%found_k)
    call move_alloc(arm, self%found_arm)
    deallocate (self%cell, self%k, self%arm, self%work)
    allocate (self%cell(3, m), self%k(m), self%arm(3, m), self%work(m, 6))
  end subroutine grow

  !> Bring the wall legs into the order of the bodies, keeping the order of the cells.
  subroutine group_by_body(n_bodies, self)
    integer, intent(in) :: n_bodies
    type(viscous_t), intent(inout) :: self
    integer :: b, m, place

    self%first = 0
    do m = 1, self%n_wall
      self%first(self%wall_body(m)) = self%first(self%wall_body(m)) + 1
    end do
    place = 1
    do b = 1, n_bodies + 1
      m = self%first(b)
      self%first(b) = place
      place = place + m
    end do
    do m = 1, self%n_wall
      b = self%wall_body(m)
      place = self%first(b)
      self%first(b) = place + 1
      self%cell(:, place) = self%found_cell(:, m)
      self%k(place) = self%found_k(m)
      self%arm(:, place) = self%found_arm(:, m)
    end do
    do b = n_bodies + 1, 2, -1
      self%first(b) = self%first(b - 1)
    end do
    self%first(1) = 1
  end subroutine group_by_body

  !> What the legs do to a body that moves: its 6 x 6 block of the system, with mass and inertia
  !! over dt added by the solver, and 2 mu V Omega, the part of the wall stress that the legs leave
  !! out.
  subroutine bodies_seen_by_legs(solid, bodies, mu, grid, self)
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: mu(grid%first(1):, grid%first(2):, grid%first(3):)
    type(viscous_t), intent(inout) :: self
    integer :: b, c, m, n
    real(wp) :: unit(6)        !! one of the six unit motions
    real(wp) :: mu_volume(6)

    do b = 1, bodies%n
      n = self%first(b + 1) - self%first(b)
      do c = 1, 6
        unit = 0.0_wp
        unit(c) = 1.0_wp
        do m = self%first(b), self%first(b + 1) - 1
          associate (i => self%cell(:, m), arm => self%arm(:, m))
            self%work(m - self%first(b) + 1, :) = &
              wrench(self%k(m)*unknown(self%mass(i(1), i(2), i(3), :), wall_velocity(unit, arm)), &
                     arm)
          end associate
        end do
        self%body_matrix(:, c, b) = exact_sums(self%work(1:n, :))
      end do
      mu_volume = viscosity_times_volume(b)
      self%spin_drag(b) = 2.0_wp*mu_volume(1)
      do c = 4, 6
        self%body_matrix(c, c, b) = self%body_matrix(c, c, b) + self%spin_drag(b)
      end do
    end do
  contains
    !> Integral of the fluid's viscosity over the body, in all six places [Pa s m3].
    function viscosity_times_volume(body) result(total)
      integer, intent(in) :: body
      real(wp) :: total(6)
      integer :: m, n, i(3)

      n = 0
      do m = solid%body_cell(body), solid%body_cell(body + 1) - 1
        i = solid%cell(:, m)
        if (any(i < grid%lo) .or. any(i > grid%hi)) cycle
        n = n + 1
        if (n > size(self%work, 1)) call grow_work(self)
        self%work(n, :) = mu(i(1), i(2), i(3))*solid%cell_alpha(m)*grid%volume
      end do
      total = exact_sums(self%work(1:n, :))
    end function viscosity_times_volume
  end subroutine bodies_seen_by_legs

  !> Double the length of the work array of the sums.
  subroutine grow_work(self)
    type(viscous_t), intent(inout) :: self
    real(wp), allocatable :: longer(:, :)

    allocate (longer(2*size(self%work, 1) + 64, 6), source=0.0_wp)
    longer(1:size(self%work, 1), :) = self%work
    call move_alloc(longer, self%work)
  end subroutine grow_work

  !> Force at a point and its torque about the centre of mass, as one vector of six.
  pure function wrench(f, arm) result(w)
    real(wp), intent(in) :: f(3), arm(3)
    real(wp) :: w(6)

    w(1:3) = f
    w(4:6) = cross(arm, f)
  end function wrench

  !> Solve for the velocity after viscosity, in place, together with the motion of the free bodies.
  !!
  !! On entry `flow%u` and `bodies%motion` are the velocities with all other forces in; on return
  !! with viscosity too. `force` is what the fluid did to each body, fixed ones included [N, N m].
  subroutine solve_viscous(grid, bodies, dt, flow, self, force, iterations, converged)
    type(grid_t), intent(in) :: grid
    type(rigid_motion_t), intent(inout) :: bodies
    real(wp), intent(in) :: dt   !! [s]
    type(flow_t), intent(inout) :: flow
    type(viscous_t), intent(inout) :: self
    real(wp), intent(out) :: force(:, :)   !! (6, bodies)
    integer, intent(out) :: iterations
    logical, intent(out) :: converged
    real(wp), dimension(6, bodies%n) :: r_body, z_body, s_body, y_body, start
    real(wp) :: rz, rz_before, alpha, beta, scale
    real(wp) :: worst   !! largest velocity change that one Jacobi step would make [m/s]
    integer :: b

    start = bodies%motion
    s_body = bodies%motion
    call velocity_scale(grid, flow%u, bodies, scale)
    where (self%mass <= 0.0_wp) flow%u = 0.0_wp   ! the wall's; `impose_rigid_velocity` sets them
    self%s = flow%u
    call apply_viscous(grid, bodies, dt, self, self%s, s_body, self%y, y_body)
    self%r = self%mass*flow%u
    call add_side_pull(self)
    do b = 1, bodies%n
      r_body(:, b) = inertial_momentum(bodies, b, dt, start(:, b))
    end do
    call improve(grid, 1.0_wp, self%y, self%r, self%inverse, self%z, worst)
    r_body = r_body - y_body
    rz = 1.0_wp
    iterations = 0
    do
      call precondition_bodies()
      converged = max(worst, maxval([0.0_wp, abs(z_body(1:3, :))])) <= tolerance*scale
      if (converged .or. iterations == max_iterations) exit
      rz_before = rz
      rz = dot(self%r, self%z) + sum_bodies(r_body, z_body)
      beta = merge(rz/rz_before, 0.0_wp, iterations > 0)
      call new_direction(grid, beta, self%z, self%s)
      s_body = z_body + merge(beta*s_body, 0.0_wp, iterations > 0)
      call apply_viscous(grid, bodies, dt, self, self%s, s_body, self%y, y_body)
      alpha = rz/(dot(self%s, self%y) + sum_bodies(s_body, y_body))
      call improve(grid, -alpha, self%s, flow%u)
      call improve(grid, alpha, self%y, self%r, self%inverse, self%z, worst)
      bodies%motion = bodies%motion + alpha*s_body
      r_body = r_body - alpha*y_body
      iterations = iterations + 1
    end do
    call force_of_legs(bodies, flow, self, force)
  contains
    !> Residual of the bodies over their translational or rotational inertia.
    subroutine precondition_bodies()
      integer :: b, c

      z_body = 0.0_wp
      do b = 1, bodies%n
        if (.not. bodies%free(b)) cycle
        associate (m => self%body_matrix(:, :, b))
          do c = 1, 6
            z_body(c, b) = r_body(c, b)/(bodies%apparent(c, c, b)/dt + m(c, c))
          end do
        end associate
      end do
    end subroutine precondition_bodies

    !> Scalar product over the cells of all processes.
    function dot(a, b) result(total)
      real(wp), intent(in), contiguous :: a(:, :, :, :), b(:, :, :, :)
      real(wp) :: total
      integer :: c

      total = 0.0_wp
      do c = 1, 3
        total = total + exact_dot(a(:, :, :, c), b(:, :, :, c), n_halo)
      end do
    end function dot

    !> Scalar product over the free bodies.
    pure function sum_bodies(a, b) result(total)
      real(wp), intent(in) :: a(:, :), b(:, :)
      real(wp) :: total
      integer :: n

      total = 0.0_wp
      do n = 1, size(a, 2)
        if (bodies%free(n)) total = total + dot_product(a(:, n), b(:, n))
      end do
    end function sum_bodies
  end subroutine solve_viscous

  !> What the moving sides pull goes to the right side.
  pure subroutine add_side_pull(self)
    type(viscous_t), intent(inout) :: self
    integer :: m

    do m = 1, self%n_side
      associate (c => self%side_cell(:, m))
        self%r(c(1), c(2), c(3), :) = self%r(c(1), c(2), c(3), :) + self%side_pull(:, m)
      end associate
    end do
  end subroutine add_side_pull

  !> Largest velocity of the fluid in own cells, of the bodies and of the sides [m/s]; never zero.
  subroutine velocity_scale(grid, u, bodies, scale)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(out) :: scale
    real(wp) :: m(1)

    associate (a => grid%lo, z => grid%hi)
      m = maxval(abs(u(a(1):z(1), a(2):z(2), a(3):z(3), :)))
    end associate
    call global_max(m)
    scale = max(m(1), 1.0e-12_wp, maxval([0.0_wp, abs(bodies%motion(1:3, :))]), &
                maxval(abs(grid%side_velocity)))
  end subroutine velocity_scale

  !> Momentum and angular momentum over dt of a motion of body b.
  pure function inertial_momentum(bodies, b, dt, motion) result(p)
    type(rigid_motion_t), intent(in) :: bodies
    integer, intent(in) :: b
    real(wp), intent(in) :: dt, motion(6)
    real(wp) :: p(6)

    p = matmul(bodies%apparent(:, :, b), motion)/dt
  end function inertial_momentum

  !> x := x - a y on the own cells; with `inverse` also z := x*inverse and the largest |z|.
  subroutine improve(grid, a, y, x, inverse, z, largest)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: a
    real(wp), intent(in), contiguous :: y(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(inout), contiguous :: x(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(in), contiguous, optional :: &
      inverse(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(inout), contiguous, optional :: &
      z(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(out), optional :: largest
    integer :: i, j, k, c
    real(wp) :: most(1)

    most = 0.0_wp
    !$omp parallel do collapse(2) private(i, j) reduction(max: most) schedule(static)
    do c = 1, 3
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            x(i, j, k, c) = x(i, j, k, c) - a*y(i, j, k, c)
          end do
          if (.not. present(inverse)) cycle
          do i = grid%lo(1), grid%hi(1)
            z(i, j, k, c) = x(i, j, k, c)*inverse(i, j, k, c)
            most(1) = max(most(1), abs(z(i, j, k, c)))
          end do
        end do
      end do
    end do
    if (.not. present(largest)) return
    call global_max(most)
    largest = most(1)
  end subroutine improve

  !> s := z + beta s on the own cells.
  subroutine new_direction(grid, beta, z, s)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: beta
    real(wp), intent(in), contiguous :: z(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(inout), contiguous :: s(grid%first(1):, grid%first(2):, grid%first(3):, :)
    integer :: i, j, k, c

    !$omp parallel do collapse(2) private(i, j) schedule(static)
    do c = 1, 3
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            s(i, j, k, c) = z(i, j, k, c) + beta*s(i, j, k, c)
          end do
        end do
      end do
    end do
  end subroutine new_direction

  !> The system applied to velocities x and body motions x_body.
  subroutine apply_viscous(grid, bodies, dt, self, x, x_body, y, y_body)
    type(grid_t), intent(in) :: grid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in) :: dt
    type(viscous_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: x(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(in) :: x_body(:, :)
    real(wp), intent(out), contiguous :: y(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(out) :: y_body(:, :)
    integer :: i, j, k, c, b, m

    call halo_exchange(x, n_halo)
    !$omp parallel do collapse(2) private(i, j) schedule(static)
    do c = 1, 3
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            y(i, j, k, c) = self%diagonal(i, j, k, c)*x(i, j, k, c) &
              - self%leg(i, j, k, 1)*x(i - 1, j, k, c) &
              - self%leg(i + 1, j, k, 1)*x(i + 1, j, k, c) &
              - self%leg(i, j, k, 2)*x(i, j - 1, k, c) &
              - self%leg(i, j + 1, k, 2)*x(i, j + 1, k, c) &
              - self%leg(i, j, k, 3)*x(i, j, k - 1, c) &
              - self%leg(i, j, k + 1, 3)*x(i, j, k + 1, c)
          end do
        end do
      end do
    end do
    do b = 1, bodies%n
      do m = self%first(b), self%first(b + 1) - 1
        associate (n => self%cell(:, m))
          self%work(m - self%first(b) + 1, :) = &
            wrench(self%k(m)*unknown(self%mass(n(1), n(2), n(3), :), x(n(1), n(2), n(3), :)), &
                   self%arm(:, m))
          y(n(1), n(2), n(3), :) = y(n(1), n(2), n(3), :) - self%k(m)*wall_velocity(x_body(:, b), &
              self%arm(:, m))
        end associate
      end do
      y_body(:, b) = 0.0_wp
      if (.not. bodies%free(b)) cycle
      y_body(:, b) = inertial_momentum(bodies, b, dt, x_body(:, b)) &
                   + matmul(self%body_matrix(:, :, b), x_body(:, b)) &
                   - exact_sums(self%work(1:self%first(b + 1) - self%first(b), :))
    end do
  end subroutine apply_viscous

  !> Velocity components that are unknowns; the others move with the wall and pull on nothing.
  pure function unknown(mass, x) result(v)
    real(wp), intent(in) :: mass(3), x(3)
    real(wp) :: v(3)

    v = merge(x, 0.0_wp, mass > 0.0_wp)
  end function unknown

  !> Viscous force and torque on each body, from its wall legs [N, N m].
  subroutine force_of_legs(bodies, flow, self, force)
    type(rigid_motion_t), intent(in) :: bodies
    type(flow_t), intent(in) :: flow
    type(viscous_t), intent(inout) :: self
    real(wp), intent(out) :: force(:, :)
    integer :: b, m
    real(wp) :: slip(3)

    do b = 1, bodies%n
      do m = self%first(b), self%first(b + 1) - 1
        associate (n => self%cell(:, m))
          slip = flow%u(n(1), n(2), n(3), :) - wall_velocity(bodies%motion(:, b), self%arm(:, m))
          self%work(m - self%first(b) + 1, :) = &
            wrench(self%k(m)*unknown(self%mass(n(1), n(2), n(3), :), slip), self%arm(:, m))
        end associate
      end do
      force(:, b) = exact_sums(self%work(1:self%first(b + 1) - self%first(b), :))
      force(4:6, b) = force(4:6, b) - self%spin_drag(b)*bodies%motion(4:6, b)
    end do
  end subroutine force_of_legs

end module viscous_m
