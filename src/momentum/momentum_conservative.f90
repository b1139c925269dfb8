!> Transport of momentum with the same volumes that carry the liquid.
!!
!! The control volume of momentum is the cell of the liquid transport. In each sweep the mass that
!! passes a face is
!! $$ m_f = \rho_l G_f + \rho_g (Q_f - G_f) $$
!! with Q and G the volumes of fluid and of liquid that the sweep moved, and momentum moves as
!! `m_f u~_f`. Dividing by the mass of the cell, which saw the same volumes, keeps a uniform
!! velocity to round-off through any interface and any opening or closing cell. u~ is the
!! fifth-order value, carried to the mean over the slab that leaves the donor; that of the donor
!! next to the interface, and everywhere with `advection = 'upwind'`.
!! Source: consistent transport after Rudman (1998); departs from the velocity form of the paper's
!! eq. (5), which moves water momentum into air at a density ratio of 830.
module momentum_conservative_m
  use omp_lib, only: omp_get_max_threads, omp_get_thread_num
  use kinds_m, only: wp
  use case_types_m, only: fluid_t
  use grid_m, only: grid_t, unit_step
  use solid_geometry_m, only: solid_geometry_t
  use boundary_m, only: fill_velocity_halo
  use mixture_m, only: pure_share, mass_through
  use tvd_m, only: face_row, scheme_of, mp_scheme
  use carried_volumes_m, only: carried_volumes_t
  use liquid_transport_m, only: liquid_transport_t, small_cells
  use liquid_sweep_m, only: sweep_volumes
  use small_cells_m, only: implicit_values, move_implicit
  implicit none
  private
  public :: momentum_t, momentum_init, momentum_begin, momentum_sweep, momentum_implicit

  type :: momentum_t
    integer :: scheme = mp_scheme                   !! of the carried velocity
    real(wp), allocatable :: momentum(:, :, :, :)   !! of the fluid in the cell [kg m/s]
    !> Momentum through the lower faces of two planes, work of each thread [kg m/s].
    real(wp), allocatable :: carried(:, :, :, :, :)   !! (i, j, component, parity of k, thread)
    logical, allocatable :: mixed_near(:, :, :)     !! within one cell of the interface
  end type momentum_t

contains

  !> Allocate the work arrays.
  subroutine momentum_init(grid, self, advection, pooled)
    type(grid_t), intent(in) :: grid
    type(momentum_t), intent(out) :: self
    character(*), intent(in), optional :: advection   !! name of the scheme, else 'mp5'
    logical, intent(in), optional :: pooled   !! arrays over the cells come from `scratch_m` later
    integer :: a(3), b(3)

    if (present(advection)) self%scheme = scheme_of(advection)
    a = grid%first
    b = grid%last
    if (.not. present(pooled)) then
      allocate (self%momentum(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
    end if
    allocate (self%carried(grid%lo(1):grid%hi(1) + 1, grid%lo(2):grid%hi(2) + 1, 3, 0:1, &
                           0:omp_get_max_threads() - 1), source=0.0_wp)
    allocate (self%mixed_near(a(1):b(1), a(2):b(2), a(3):b(3)), source=.false.)
  end subroutine momentum_init

  !> Momentum of every cell, and the cells where the first-order value is taken.
  subroutine momentum_begin(grid, fluid, liquid, fluid_volume, c, u, self)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    real(wp), intent(in), dimension(grid%first(1):, grid%first(2):, grid%first(3):), &
      contiguous :: liquid, fluid_volume, c   !! W and Vt [m3], liquid share [-]
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s]
    type(momentum_t), intent(inout) :: self
    integer :: i, j, k, m
    real(wp) :: least, most

    !$omp parallel do private(j, m) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do m = 1, 3
        do j = grid%lo(2), grid%hi(2)
          associate (a => grid%lo(1), b => grid%hi(1))
            self%momentum(a:b, j, k, m) = &
              mass_through(fluid, fluid_volume(a:b, j, k), liquid(a:b, j, k)) &
                                          *u(a:b, j, k, m)
          end associate
        end do
      end do
    end do
    !$omp parallel do private(i, j, least, most) schedule(static)
    do k = grid%lo(3) - 1, grid%hi(3) + 1
      do j = grid%lo(2) - 1, grid%hi(2) + 1
        do i = grid%lo(1) - 1, grid%hi(1) + 1
          least = min(c(i, j, k), c(i - 1, j, k), c(i + 1, j, k), c(i, j - 1, k), c(i, j + 1, k), &
                      c(i, j, k - 1), c(i, j, k + 1))
          most = max(c(i, j, k), c(i - 1, j, k), c(i + 1, j, k), c(i, j - 1, k), c(i, j + 1, k), &
                     c(i, j, k - 1), c(i, j, k + 1))
          self%mixed_near(i, j, k) = least < 1.0_wp - pure_share .and. most > pure_share
        end do
      end do
    end do
  end subroutine momentum_begin

  !> One sweep in direction d of liquid, fluid volume and momentum together.
  subroutine momentum_sweep(grid, fluid, old, d, transport, u, self)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(solid_geometry_t), intent(in) :: old   !! bodies at the start of the step
    integer, intent(in) :: d
    type(liquid_transport_t), intent(inout) :: transport
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
                                               !! halo filled on entry and return [m/s]
    type(momentum_t), intent(inout) :: self
    integer :: k, me, e(3), low, high, at_hand   ! place of the lower and of the upper faces

    call sweep_volumes(grid, old, d, transport%volumes, transport%sweeps)
    ! The momentum after what crosses the faces in direction d. A thread goes through its planes one
    ! by one and keeps what crosses the faces of two.
    e = unit_step(:, d)
    !$omp parallel private(k, me, low, high, at_hand)
    me = omp_get_thread_num()
    at_hand = grid%lo(3) - 1   ! last plane whose lower faces are known
    !$omp do schedule(static)
    do k = grid%lo(3), grid%hi(3)
      low = modulo(k, 2)
      high = modulo(k + e(3), 2)
      if (at_hand < k) call carry_plane(grid, fluid, d, k, transport%volumes, u, self)
      at_hand = k + e(3)
      if (e(3) == 1) call carry_plane(grid, fluid, d, k + 1, transport%volumes, u, self)
      call exchange_in_plane(grid, e, k, self%carried(:, :, :, low, me), &
                             self%carried(:, :, :, high, me), self%momentum)
    end do
    !$omp end parallel
    call velocity_of_momentum(grid, fluid, transport%volumes%w, transport%volumes%v, &
                              self%momentum, u)
  end subroutine momentum_sweep

  !> Momentum of the cells of plane k after what crosses their lower and upper faces.
  subroutine exchange_in_plane(grid, e, k, lower, upper, momentum)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: e(3), k
    real(wp), intent(in), dimension(grid%lo(1):, grid%lo(2):, :), contiguous :: lower, upper
      !! [kg m/s]; one and the same if the direction e lies in the plane
    real(wp), intent(inout), contiguous :: &
      momentum(grid%first(1):, grid%first(2):, grid%first(3):, :)   !! [kg m/s]
    integer :: i, j, m

    do m = 1, 3
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          momentum(i, j, k, m) = momentum(i, j, k, m) - (upper(i + e(1), j + e(2), m) &
                                                         - lower(i, j, m))
        end do
      end do
    end do
  end subroutine exchange_in_plane

  !> Momentum through the lower faces of plane k in direction d: mass times the mean velocity of the
  !! slab that leaves the donor.
  subroutine carry_plane(grid, fluid, d, k, volumes, u, self)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    integer, intent(in) :: d, k
    type(carried_volumes_t), intent(in) :: volumes
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s]
    type(momentum_t), intent(inout) :: self   !! its momentum carried, of plane k and this thread
    real(wp), dimension(grid%lo(1):grid%hi(1) + 1) :: mass, keep   ! of a line
    real(wp) :: donor
    integer :: i, j, m, e(3), low, me

    e = unit_step(:, d)
    low = modulo(k, 2)
    me = omp_get_thread_num()
    associate (a => grid%lo(1), b => grid%hi(1) + e(1))
      do j = grid%lo(2), grid%hi(2) + e(2)
        mass(a:b) = mass_through(fluid, volumes%q(a:b, j, k, d), volumes%g(a:b, j, k, d))
        call share_beyond_donor(grid, d, j, k, volumes, self%mixed_near, keep)
        do m = 1, 3
          call face_row(grid, self%scheme, e, [a, j, k], volumes%q(:, :, :, d), u(:, :, :, m), &
                        self%carried(:b, j, m, low, me))
          !$omp simd private(donor)
          do i = a, b
            donor = merge(u(i - e(1), j - e(2), k - e(3), m), u(i, j, k, m), &
                          volumes%q(i, j, k, d) > 0.0_wp)
            self%carried(i, j, m, low, me) = &
              mass(i)*(donor + keep(i)*(self%carried(i, j, m, low, me) - donor))
          end do
        end do
      end do
    end associate
  end subroutine carry_plane

  !> Share of the value on the faces of line j, k that the mean of the slab has beside the donor's:
  !! 1 - |Q|/V of the donor, none at the interface.
  pure subroutine share_beyond_donor(grid, d, j, k, volumes, near, keep)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: d, j, k
    type(carried_volumes_t), intent(in) :: volumes
    logical, intent(in), contiguous :: near(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(inout), contiguous :: keep(grid%lo(1):)
    real(wp) :: volume
    integer :: i, e(3)
    logical :: forward, mixed

    e = unit_step(:, d)
    !$omp simd private(volume, forward, mixed)
    do i = grid%lo(1), grid%hi(1) + e(1)
      associate (q => volumes%q(i, j, k, d), v => volumes%v_before)
        forward = q > 0.0_wp
        volume = merge(v(i - e(1), j - e(2), k - e(3)), v(i, j, k), forward)
        mixed = merge(near(i - e(1), j - e(2), k - e(3)), near(i, j, k), forward)
        keep(i) = merge(0.0_wp, max(0.0_wp, 1.0_wp - abs(q)/max(volume, tiny(volume))), mixed)
      end associate
    end do
  end subroutine share_beyond_donor

  !> Velocity after the small cells have given what they hold, with the same implicit donor value as
  !! their liquid; moves the volumes of the small cells too (`small_cells`).
  subroutine momentum_implicit(grid, fluid, transport, u, self)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(liquid_transport_t), intent(inout) :: transport
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
                                               !! halo filled on return [m/s]
    type(momentum_t), intent(inout) :: self
    real(wp), dimension(transport%small%n_implicit) :: crossing, flux   ! mass, momentum: of a face
    integer :: m, l, k, at(3)

    ! the sweeps have done with their arrays
    associate (small => transport%small, n => transport%small%n_implicit, &
               mass => transport%sweeps%out_high, value => transport%sweeps%out_low)
      !$omp parallel do schedule(static)
      do k = grid%lo(3), grid%hi(3)
        mass(:, :, k) = mass_through(fluid, transport%volumes%v(:, :, k), &
                                     transport%volumes%w(:, :, k))
      end do
      call small_cells(grid, transport)
      crossing = mass_through(fluid, small%q_implicit(1:n), small%g_implicit(1:n))
      do m = 1, 3
        call implicit_values(grid, self%momentum(:, :, :, m), mass, abs(crossing), small, value)
        do l = 1, n
          at = small%donor(:, l)
          flux(l) = crossing(l)*value(at(1), at(2), at(3))
        end do
        call move_implicit(grid, small, flux, self%momentum(:, :, :, m))
      end do
    end associate
    call velocity_of_momentum(grid, fluid, transport%volumes%w, transport%volumes%v, &
                              self%momentum, u)
  end subroutine momentum_implicit

  !> Velocity of every own cell that holds mass; the others keep theirs. Halo filled.
  subroutine velocity_of_momentum(grid, fluid, liquid, fluid_volume, momentum, u)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    real(wp), intent(in), dimension(grid%first(1):, grid%first(2):, grid%first(3):), &
      contiguous :: liquid, fluid_volume   !! [m3]
    real(wp), intent(in), contiguous :: momentum(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [kg m/s]
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s]
    integer :: i, j, k, m
    real(wp) :: mass

    !$omp parallel do private(i, j, m, mass) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do m = 1, 3
        do j = grid%lo(2), grid%hi(2)
          !$omp simd private(mass)
          do i = grid%lo(1), grid%hi(1)
            mass = mass_through(fluid, fluid_volume(i, j, k), liquid(i, j, k))
            u(i, j, k, m) = merge(momentum(i, j, k, m)/merge(mass, 1.0_wp, mass > 0.0_wp), &
                                  u(i, j, k, m), mass > 0.0_wp)
          end do
        end do
      end do
    end do
    call fill_velocity_halo(grid, u)
  end subroutine velocity_of_momentum

end module momentum_conservative_m
