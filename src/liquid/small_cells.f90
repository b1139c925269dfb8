!> Small cells of the liquid transport: they give after the sweeps, when all has come in.
!!
!! A small cell would give away nearly all it holds, or it opens or closes in this step. It receives
!! in the sweeps and gives afterwards, of the implicit donor value, which is bounded for any step:
!! $$ C_S = (W_S + \sum_{in} Q\, C_{S'}) / (V_S + \sum_{in} Q) $$
!! Momentum goes the same way, with its mass in place of the volume (`implicit_values`,
!! `move_implicit`).
module small_cells_m
  use kinds_m, only: wp, i8
  use growing_m, only: ensure_capacity
  use cell_list_m, only: list_marked
  use grid_m, only: grid_t, n_halo, unit_step
  use boundary_m, only: fill_scalar_halo
  use solid_geometry_m, only: solid_geometry_t
  use carried_volumes_m, only: carried_volumes_t, share_of
  use parallel_m, only: halo_exchange, global_max, global_sum
  implicit none
  private
  public :: small_cells_t, small_cells_init, find_small_cells, give_small_cells
  public :: renew_shares, implicit_values, move_implicit

  real(wp), parameter :: max_outflow = 0.98_wp     !! share of its volume a cell may give
  real(wp), parameter :: min_volume = 1.0e-6_wp   !! of a cell that is not small [V]
  integer, parameter :: max_implicit_iterations = 10000
  real(wp), parameter :: implicit_tolerance = 1.0e-14_wp
    !! change of a pass, of the largest value; on closed rings rounding alone makes some 1e-15

  type :: small_cells_t
    integer :: n = 0                          !! of this process
    integer, allocatable :: cell(:, :)        !! (3, *)
    integer, allocatable :: number(:, :, :)   !! of a small cell, 0 for others; halo filled
    !> Implicit faces, whose donor is a small cell.
    integer :: n_implicit = 0
    integer, allocatable :: face(:, :)        !! (4, *) cell and direction of the lower face
    integer, allocatable :: donor(:, :), receiver(:, :)   !! (3, *)
    real(wp), allocatable :: q_implicit(:), g_implicit(:)
      !! (*) volume and liquid through these faces, positive along the axis [m3]
    integer :: iterations = 0                 !! of the last donor values
    logical :: converged = .true.             !! all donor values of the step
  end type small_cells_t

contains

  !> Allocate the lists; they grow.
  subroutine small_cells_init(grid, self)
    type(grid_t), intent(in) :: grid
    type(small_cells_t), intent(out) :: self
    integer, parameter :: first_size = 1024
    integer :: a(3), b(3)

    a = grid%first
    b = grid%last
    allocate (self%number(a(1):b(1), a(2):b(2), a(3):b(3)), source=0)
    allocate (self%cell(3, first_size))
    allocate (self%face(4, first_size), self%donor(3, first_size), self%receiver(3, first_size))
  end subroutine small_cells_init

  !> Cells that would give nearly all they hold, or hold nearly nothing, and the faces they give
  !! through: what goes there is taken out of the sweeps.
  subroutine find_small_cells(grid, old, volumes, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old
    type(carried_volumes_t), intent(inout) :: volumes
    type(small_cells_t), intent(inout) :: self
    integer :: i, j, k
    real(wp) :: outflow, open

    ! One for small cells, zero for others.
    !$omp parallel do private(i, j, outflow, open) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          outflow = max(volumes%q(i + 1, j, k, 1), 0.0_wp) + max(-volumes%q(i, j, k, 1), 0.0_wp) &
                    + max(volumes%q(i, j + 1, k, 2), 0.0_wp) + max(-volumes%q(i, j, k, 2), 0.0_wp) &
                    + max(volumes%q(i, j, k + 1, 3), 0.0_wp) + max(-volumes%q(i, j, k, 3), 0.0_wp)
          open = min(volumes%v(i, j, k), grid%volume*(1.0_wp - old%alpha(i, j, k)))
          self%number(i, j, k) = merge(0, 1, outflow <= max_outflow*open &
                                       .and. open >= min_volume*grid%volume)
        end do
      end do
    end do
    call list_marked(grid, lbound(self%number), self%number, self%cell, self%n)
    call halo_exchange(self%number, n_halo, layers=1)
    call find_implicit_faces(grid, volumes, self)
  end subroutine find_small_cells

  !> Faces with a small donor: listed, and taken out of the sweeps.
  subroutine find_implicit_faces(grid, volumes, self)
    type(grid_t), intent(in) :: grid
    type(carried_volumes_t), intent(inout) :: volumes
    type(small_cells_t), intent(inout) :: self
    integer :: in_row(grid%lo(2):grid%hi(2) + 1, grid%lo(3):grid%hi(3) + 1)   ! of a direction
    integer :: d, i, j, k, m, n, e(3), up(3), low(3), donor(3)

    m = 0
    do d = 1, 3
      e = unit_step(:, d)
      associate (q => volumes%q, number => self%number)   ! how many there are in each row
        !$omp parallel do private(i, j, n) schedule(static)
        do k = grid%lo(3), grid%hi(3) + e(3)
          do j = grid%lo(2), grid%hi(2) + e(2)
            n = 0
            !$omp simd reduction(+: n)
            do i = grid%lo(1), grid%hi(1) + e(1)
              n = n + merge(1, 0, &
                (q(i, j, k, d) > 0.0_wp .and. number(i - e(1), j - e(2), k - e(3)) > 0) &
                .or. (q(i, j, k, d) < 0.0_wp .and. number(i, j, k) > 0))
            end do
            in_row(j, k) = n
          end do
        end do
      end associate
      do k = grid%lo(3), grid%hi(3) + e(3)
        do j = grid%lo(2), grid%hi(2) + e(2)
          if (in_row(j, k) == 0) cycle
          do i = grid%lo(1), grid%hi(1) + e(1)
            if (.not. abs(volumes%q(i, j, k, d)) > 0.0_wp) cycle
            up = [i, j, k]
            low = up - e
            donor = merge(low, up, volumes%q(i, j, k, d) > 0.0_wp)
            if (self%number(donor(1), donor(2), donor(3)) == 0) cycle
            m = m + 1
            call ensure_capacity(m, self%face)
            call ensure_capacity(m, self%donor)
            call ensure_capacity(m, self%receiver)
            call ensure_capacity(m, self%q_implicit)
            self%face(:, m) = [i, j, k, d]
            self%donor(:, m) = donor
            self%receiver(:, m) = up + low - donor
            self%q_implicit(m) = volumes%q(i, j, k, d)
            volumes%q(i, j, k, d) = 0.0_wp
          end do
        end do
      end do
    end do
    self%n_implicit = m
    call ensure_capacity(m, self%q_implicit)
    call ensure_capacity(m, self%g_implicit)
  end subroutine find_implicit_faces

  !> The small cells give what they hold once all has come in: w, v, q and g are complete.
  subroutine give_small_cells(grid, volumes, self, share)
    type(grid_t), intent(in) :: grid
    type(carried_volumes_t), intent(inout) :: volumes
    type(small_cells_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: share(grid%first(1):, grid%first(2):, grid%first(3):)
      !! work: liquid share of what the small cells give
    integer :: l, n, at(3)

    n = self%n_implicit
    call implicit_values(grid, volumes%w, volumes%v, abs(self%q_implicit(1:n)), self, share)
    do l = 1, n
      at = self%donor(:, l)
      self%g_implicit(l) = self%q_implicit(l)*min(max(share(at(1), at(2), at(3)), 0.0_wp), 1.0_wp)
    end do
    call move_implicit(grid, self, self%g_implicit, volumes%w)
    call move_implicit(grid, self, self%q_implicit, volumes%v)
    call fill_scalar_halo(grid, volumes%v)
    do l = 1, n
      associate (f => self%face(:, l))
        volumes%q(f(1), f(2), f(3), f(4)) = self%q_implicit(l)
        volumes%g(f(1), f(2), f(3), f(4)) = self%g_implicit(l)
      end associate
    end do
  end subroutine give_small_cells

  !> C^ of what gave and got implicitly in the subcycle before, for the next one; that of cells with
  !! solid stays that of the begin, as in the sweeps.
  subroutine renew_shares(grid, old, self, volumes)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old
    type(small_cells_t), intent(in) :: self
    type(carried_volumes_t), intent(inout) :: volumes
    integer :: l

    do l = 1, self%n_implicit
      call renew(self%donor(:, l))
      call renew(self%receiver(:, l))
    end do
    call fill_scalar_halo(grid, volumes%c)
  contains
    subroutine renew(at)
      integer, intent(in) :: at(3)

      if (.not. grid%owns(at)) return
      if (old%alpha(at(1), at(2), at(3)) > 0.0_wp) return
      volumes%c(at(1), at(2), at(3)) = share_of(volumes%w(at(1), at(2), at(3)), &
                                                volumes%v(at(1), at(2), at(3)))
    end subroutine renew
  end subroutine renew_shares

  !> What small cells hold per mass of a carried quantity once all has come in:
  !! $$ x_S = (a_S + \sum_{in} w\, x_{S'}) / (m_S + \sum_{in} w) $$
  !! Every value follows from those of the pass before, so the result does not depend on any order.
  subroutine implicit_values(grid, amount, mass, weight, self, value)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: amount(grid%first(1):, grid%first(2):, grid%first(3):)
      !! carried, after the sweeps
    real(wp), intent(in), contiguous :: mass(grid%first(1):, grid%first(2):, grid%first(3):)
      !! mass or volume then
    real(wp), intent(in) :: weight(:)   !! of the implicit faces, like `mass`, positive
    type(small_cells_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: value(grid%first(1):, grid%first(2):, grid%first(3):)
      !! of small cells
    real(wp), dimension(self%n) :: held, of_cell   ! what each small cell holds, its mass
    integer(i8) :: faces(1)
    integer :: it, l, s, at(3)
    real(wp) :: change(2)   ! largest change and largest value of a pass
    real(wp) :: ratio

    self%iterations = 0
    faces = int(self%n_implicit, i8)
    call global_sum(faces)
    if (faces(1) == 0_i8) return
    ! What they hold after the sweeps, and their mass with all that comes in.
    do s = 1, self%n
      at = self%cell(:, s)
      of_cell(s) = mass(at(1), at(2), at(3))
      value(at(1), at(2), at(3)) = 0.0_wp
      if (of_cell(s) > 0.0_wp) value(at(1), at(2), at(3)) = amount(at(1), at(2), at(3))/of_cell(s)
    end do
    do l = 1, self%n_implicit
      s = number_of(self%receiver(:, l))
      if (s > 0) of_cell(s) = of_cell(s) + weight(l)
    end do
    do it = 1, max_implicit_iterations
      call halo_exchange(value, n_halo, layers=1)
      do s = 1, self%n   ! one pass over the cells, and how much it changes
        at = self%cell(:, s)
        held(s) = amount(at(1), at(2), at(3))
      end do
      do l = 1, self%n_implicit
        s = number_of(self%receiver(:, l))
        if (s == 0) cycle
        at = self%donor(:, l)
        held(s) = held(s) + weight(l)*value(at(1), at(2), at(3))
      end do
      change = 0.0_wp
      do s = 1, self%n
        at = self%cell(:, s)
        ratio = 0.0_wp
        if (of_cell(s) > 0.0_wp) ratio = held(s)/of_cell(s)
        change(1) = max(change(1), abs(ratio - value(at(1), at(2), at(3))))
        change(2) = max(change(2), abs(ratio))
        value(at(1), at(2), at(3)) = ratio
      end do
      call global_max(change)
      self%iterations = it
      if (change(1) <= max(implicit_tolerance*change(2), tiny(1.0_wp))) exit
    end do
    if (it > max_implicit_iterations) self%converged = .false.
    call halo_exchange(value, n_halo, layers=1)
  contains
    !> Number of the small cell at this place if it is a cell of this process, else 0.
    pure integer function number_of(at)
      integer, intent(in) :: at(3)

      number_of = 0
      if (grid%owns(at)) number_of = self%number(at(1), at(2), at(3))
    end function number_of
  end subroutine implicit_values

  !> Move what crosses the implicit faces; `flux` is positive along the axis.
  subroutine move_implicit(grid, self, flux, amount)
    type(grid_t), intent(in) :: grid
    type(small_cells_t), intent(in) :: self
    real(wp), intent(in) :: flux(:)
    real(wp), intent(inout), contiguous :: amount(grid%first(1):, grid%first(2):, grid%first(3):)
    integer :: l, up(3), low(3)

    do l = 1, self%n_implicit
      up = self%face(1:3, l)
      low = up - unit_step(:, self%face(4, l))
      if (grid%owns(low)) then
        amount(low(1), low(2), low(3)) = amount(low(1), low(2), low(3)) - flux(l)
      end if
      if (grid%owns(up)) then
        amount(up(1), up(2), up(3)) = amount(up(1), up(2), up(3)) + flux(l)
      end if
    end do
  end subroutine move_implicit

end module small_cells_m
