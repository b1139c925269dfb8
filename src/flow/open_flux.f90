!> Volumes that flow through the open part of the faces in one step, made to fit the moving bodies.
!!
!! In every cell the outflow of a step must be the change of its open volume,
!! $$ \sum_f Q_f = V_t^n - V (1 - \alpha^{n+1}) $$
!! The flux of the projected velocity fits to the order of the step only. The rest r is taken away
!! by `Q_f := Q_f - k_f (phi_up - phi_low)` with `sum_f k_f (phi_c - phi_nb) = r_c` on the band of
!! cells that a body cuts before or after the step and one ring around; k is the open area in the
!! mean of the step. Each connected part of the band keeps its own mean of r (rounding, and in
!! sealed pockets a volume that has nowhere to go) unless it reaches an open side, where it may
!! exchange. With the carried volume Vt on the right the errors of one step are made good by the
!! next.
!!
!! Conjugate gradients on lists of the band's cells; all sums are order-free.
module open_flux_m
  use kinds_m, only: wp, i8
  use grid_m, only: grid_t, n_halo, unit_step, side_open, side_outflow
  use boundary_m, only: is_wall
  use solid_geometry_m, only: solid_geometry_t
  use exact_sum_m, only: exact_sum, exact_add, exact_totals, bin_size, no_terms
  use parallel_m, only: halo_exchange, global_max, global_sum, nproc, my_rank
  implicit none
  private
  public :: open_flux_t, open_flux_init, find_open_flux

  real(wp), parameter :: least_open = 1.0e-9_wp   !! mean open share below which a face is closed

  type :: open_flux_t
    real(wp) :: tolerance = 1.0e-13_wp   !! of the volume balance of a cell [V]
    integer :: max_iterations = 5000
    integer :: iterations = 0            !! of the last step
    real(wp) :: residual = 0.0_wp        !! largest rest in the band after the last step [V]
    real(wp) :: unmatched = 0.0_wp       !! largest mean left in a part of the band [V]
    integer :: parts = 0                 !! connected parts of the band
    integer :: cells = 0                 !! cells of this process in the parts that were solved

    ! Arrays over cells with one halo cell.
    integer, allocatable :: band(:, :, :)    !! 1: in the band; 2 while it is marked: holds solid
    integer, allocatable :: number(:, :, :)  !! place in the lists, 0: not in them
    integer, allocatable :: label(:, :, :)   !! smallest global cell number of the connected part
    real(wp), allocatable :: k(:, :, :, :)   !! conductance of the lower faces, largest face = 1 [-]
    real(wp), allocatable :: p(:, :, :)      !! search direction, in the end the potential [V]

    ! Lists over the band, and over its connected parts.
    integer :: n = 0
    integer, allocatable :: at(:)            !! place in the arrays above, halo included, counted from 1
    integer, allocatable :: root(:), part(:), order(:), spare(:)
    real(wp), allocatable :: r(:), z(:), s(:), phi(:), diagonal(:)
    integer, allocatable :: first(:)         !! (parts + 1) their cells after sorting
    integer(i8), allocatable :: held(:)      !! (0:processes-1) labels that each process gave
    integer(i8), allocatable :: home(:)      !! (parts) labels, rising
    integer(i8), allocatable :: count(:), bins(:, :)
    real(wp), allocatable :: total(:), largest(:)
  end type open_flux_t

contains

  !> Allocate the work arrays.
  subroutine open_flux_init(grid, self)
    type(grid_t), intent(in) :: grid
    type(open_flux_t), intent(out) :: self
    integer, parameter :: first_size = 4096, first_parts = 64
    integer :: a(3), b(3)

    a = grid%lo - 1
    b = grid%hi + 1
    allocate (self%band(a(1):b(1), a(2):b(2), a(3):b(3)), source=0)
    allocate (self%number, self%label, source=self%band)
    allocate (self%p(a(1):b(1), a(2):b(2), a(3):b(3)), source=0.0_wp)
    allocate (self%k(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
    allocate (self%held(0:nproc() - 1), source=0_i8)
    call allocate_lists(first_size, self)
    call allocate_parts(first_parts, self)
  end subroutine open_flux_init

  subroutine allocate_lists(n, self)
    integer, intent(in) :: n
    type(open_flux_t), intent(inout) :: self

    allocate (self%at(n), self%root(n), self%part(n), self%order(n), self%spare(n))
    allocate (self%r(n), self%z(n), self%s(n), self%phi(n), self%diagonal(n))
  end subroutine allocate_lists

  subroutine allocate_parts(n, self)
    integer, intent(in) :: n
    type(open_flux_t), intent(inout) :: self

    allocate (self%first(n + 1), self%home(n), self%count(2*n), self%bins(bin_size, n))
    allocate (self%total(n), self%largest(n))
  end subroutine allocate_parts

  !> Volumes Q through the lower faces, positive in the direction of the axis, faces lo..hi+1 [m3].
  subroutine find_open_flux(grid, old, new, room, uf, dt, self, q)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old, new   !! bodies at the begin and at the end of the step
    real(wp), intent(in), contiguous :: room(grid%lo(1) - n_halo:, grid%lo(2) - n_halo:, &
                                             grid%lo(3) - n_halo:)      !! carried open volume Vt [m3]
    real(wp), intent(in), contiguous :: uf(grid%lo(1) - n_halo:, grid%lo(2) - n_halo:, &
                                           grid%lo(3) - n_halo:, :)     !! velocity in the open part [m/s]
    real(wp), intent(in) :: dt   !! [s]
    type(open_flux_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: q(grid%lo(1) - n_halo:, grid%lo(2) - n_halo:, &
                                             grid%lo(3) - n_halo:, :)   !! [m3]
    real(wp) :: band_size(1)

    call mark_band(grid, old, new, self)
    call flux_of_velocity(grid, old, new, uf, dt, self, q)
    self%iterations = 0
    self%residual = 0.0_wp
    self%unmatched = 0.0_wp
    self%parts = 0
    call list_band(grid, new, room, q, self)
    band_size = real(self%n, wp)
    call global_max(band_size)
    if (band_size(1) < 0.5_wp) return
    call find_parts(grid, self)
    call balance_parts(grid, self)
    call solve_band(grid, self)
    call correct_flux(grid, self, q)
  end subroutine find_open_flux

  !> Cells with solid at the begin or the end of the step, and the ring around them.
  subroutine mark_band(grid, old, new, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old, new
    type(open_flux_t), intent(inout) :: self
    integer :: i, j, k

    self%band = 0
    !$omp parallel do private(i, j) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          if (old%alpha(i, j, k) > 0.0_wp .or. new%alpha(i, j, k) > 0.0_wp) self%band(i, j, k) = 2
        end do
      end do
    end do
    call halo_exchange(self%band, 1)
    !$omp parallel do private(i, j) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          self%label(i, j, k) = 0
          if (any(self%band(i - 1:i + 1, j - 1:j + 1, k - 1:k + 1) == 2)) self%label(i, j, k) = 1
        end do
      end do
    end do
    !$omp parallel do private(i, j) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          self%band(i, j, k) = self%label(i, j, k)
        end do
      end do
    end do
    call halo_exchange(self%band, 1)
  end subroutine mark_band

  !> What lies at lower face number i of direction d: 0 a neighbour cell, else the code of the side.
  pure function side_at(grid, i, d) result(side)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: i, d
    integer :: side

    side = 0
    if (grid%periodic(d)) return
    if (i == 1) side = grid%side(1, d)
    if (i == grid%n(d) + 1) side = grid%side(2, d)
  end function side_at

  !> Volumes of the velocity through the faces as they are at the begin of the step, and the
  !! conductances of the band.
  subroutine flux_of_velocity(grid, old, new, uf, dt, self, q)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old, new
    real(wp), intent(in), contiguous :: uf(grid%lo(1) - n_halo:, grid%lo(2) - n_halo:, &
                                           grid%lo(3) - n_halo:, :)
    real(wp), intent(in) :: dt
    type(open_flux_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: q(grid%lo(1) - n_halo:, grid%lo(2) - n_halo:, &
                                             grid%lo(3) - n_halo:, :)
    integer :: d, i, j, k, e(3), side
    real(wp) :: w, size_of_face
    logical :: coupled

    do d = 1, 3
      e = unit_step(:, d)
      size_of_face = grid%area(d)/maxval(grid%area)
      !$omp parallel do private(i, j, w, side, coupled) schedule(static)
      do k = grid%lo(3), grid%hi(3) + e(3)
        do j = grid%lo(2), grid%hi(2) + e(2)
          do i = grid%lo(1), grid%hi(1) + e(1)
            w = 0.5_wp*(old%open(i, j, k, d) + new%open(i, j, k, d))
            side = side_at(grid, i*e(1) + j*e(2) + k*e(3), d)
            q(i, j, k, d) = dt*grid%area(d)*old%open(i, j, k, d)*uf(i, j, k, d)
            if (w < least_open .or. is_wall(side)) q(i, j, k, d) = 0.0_wp
            coupled = self%band(i, j, k) + self%band(i - e(1), j - e(2), k - e(3)) == 2
            if (side == side_open .or. side == side_outflow) then
              coupled = self%band(i, j, k) + self%band(i - e(1), j - e(2), k - e(3)) == 1
            end if
            self%k(i, j, k, d) = merge(w*size_of_face, 0.0_wp, coupled .and. w >= least_open &
                                       .and. .not. is_wall(side))
          end do
        end do
      end do
    end do
  end subroutine flux_of_velocity

  !> Cells of the band with a way out, in the order of the grid, and their volume balance r.
  subroutine list_band(grid, new, room, q, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: new
    real(wp), intent(in), contiguous :: room(grid%lo(1) - n_halo:, grid%lo(2) - n_halo:, &
                                             grid%lo(3) - n_halo:)
    real(wp), intent(in), contiguous :: q(grid%lo(1) - n_halo:, grid%lo(2) - n_halo:, &
                                          grid%lo(3) - n_halo:, :)
    type(open_flux_t), intent(inout) :: self
    integer :: i, j, k, n
    real(wp) :: diagonal, outflow

    self%number = 0
    n = 0
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          if (self%band(i, j, k) == 0) cycle
          diagonal = self%k(i, j, k, 1) + self%k(i + 1, j, k, 1) + self%k(i, j, k, 2) &
                     + self%k(i, j + 1, k, 2) + self%k(i, j, k, 3) + self%k(i, j, k + 1, 3)
          if (.not. diagonal > 0.0_wp) cycle
          if (n == size(self%at)) call grow_lists(self, n)
          n = n + 1
          outflow = (q(i + 1, j, k, 1) - q(i, j, k, 1)) + (q(i, j + 1, k, 2) - q(i, j, k, 2)) &
                    + (q(i, j, k + 1, 3) - q(i, j, k, 3))
          self%number(i, j, k) = n
          self%at(n) = place(grid, i, j, k)
          self%diagonal(n) = diagonal
          self%r(n) = ((room(i, j, k) - grid%volume*(1.0_wp - new%alpha(i, j, k))) - outflow)/grid%volume
        end do
      end do
    end do
    self%n = n
  end subroutine list_band

  !> Place of a cell in the arrays with one halo cell, counted from 1.
  pure function place(grid, i, j, k) result(m)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: i, j, k
    integer :: m
    integer :: c(3), extent(3)

    extent = grid%hi - grid%lo + 3
    c = [i, j, k] - grid%lo + 1
    m = 1 + c(1) + extent(1)*(c(2) + extent(2)*c(3))
  end function place

  !> Cell of a place.
  pure function cell_at(grid, m) result(c)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: m
    integer :: c(3)
    integer :: extent(3)

    extent = grid%hi - grid%lo + 3
    c(1) = modulo(m - 1, extent(1))
    c(2) = modulo((m - 1)/extent(1), extent(2))
    c(3) = (m - 1)/(extent(1)*extent(2))
    c = c + grid%lo - 1
  end function cell_at

  !> Number of a cell in the whole domain, from 1.
  pure function global_number(grid, c) result(g)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: c(3)
    integer :: g

    g = c(1) + grid%n(1)*(c(2) - 1 + grid%n(2)*(c(3) - 1))
  end function global_number

  !> Twice the room in the lists, the first n entries kept.
  subroutine grow_lists(self, n)
    type(open_flux_t), intent(inout) :: self
    integer, intent(in) :: n
    integer, allocatable :: at(:)
    real(wp), allocatable :: r(:), diagonal(:)

    call move_alloc(self%at, at)
    call move_alloc(self%r, r)
    call move_alloc(self%diagonal, diagonal)
    deallocate (self%root, self%part, self%order, self%spare, self%z, self%s, self%phi)
    call allocate_lists(2*n, self)
    self%at(1:n) = at(1:n)
    self%r(1:n) = r(1:n)
    self%diagonal(1:n) = diagonal(1:n)
  end subroutine grow_lists

  !> Connected parts of the band, over all processes: `part(l)` and the list `home` of their labels.
  subroutine find_parts(grid, self)
    type(grid_t), intent(in) :: grid
    type(open_flux_t), intent(inout) :: self
    integer :: l, c(3)

    call join_neighbours(grid, self)
    call join_processes(grid, self)
    call list_parts(grid, self)
    do l = 1, self%n
      c = cell_at(grid, self%at(l))
      self%part(l) = position(int(self%label(c(1), c(2), c(3)), i8), self%home(1:self%parts))
    end do
  end subroutine find_parts

  !> Join cells of this process across faces with a conductance: `root` of each cell of the list.
  subroutine join_neighbours(grid, self)
    type(grid_t), intent(in) :: grid
    type(open_flux_t), intent(inout) :: self
    integer :: l, d, c(3), e(3), m, a, b

    do l = 1, self%n
      self%root(l) = l
    end do
    do l = 1, self%n
      c = cell_at(grid, self%at(l))
      do d = 1, 3
        if (.not. self%k(c(1), c(2), c(3), d) > 0.0_wp) cycle
        e = c - unit_step(:, d)
        m = self%number(e(1), e(2), e(3))
        if (m == 0) cycle
        a = root_of(self%root, l)
        b = root_of(self%root, m)
        self%root(max(a, b)) = min(a, b)
      end do
    end do
    do l = 1, self%n
      self%root(l) = root_of(self%root, l)
    end do
  end subroutine join_neighbours

  !> Root of a cell; the path to it is shortened for the next call.
  function root_of(root, l) result(a)
    integer, intent(inout) :: root(:)
    integer, intent(in) :: l
    integer :: a

    a = l
    do while (root(a) /= a)
      root(a) = root(root(a))
      a = root(a)
    end do
  end function root_of

  !> Give all cells of a connected part, on whatever process, the smallest global number in it.
  subroutine join_processes(grid, self)
    type(grid_t), intent(in) :: grid
    type(open_flux_t), intent(inout) :: self
    integer :: l, c(3)
    integer(i8) :: changes(1)

    associate (smallest => self%spare)
      do l = 1, self%n   ! the root stands first in the list, so it has the smallest number of its part
        smallest(l) = global_number(grid, cell_at(grid, self%at(l)))
      end do
      self%label = 0
      do
        do l = 1, self%n
          c = cell_at(grid, self%at(l))
          self%label(c(1), c(2), c(3)) = smallest(self%root(l))
        end do
        call halo_exchange(self%label, 1)
        changes = 0_i8
        do l = 1, self%n
          c = cell_at(grid, self%at(l))
          if (all(c > grid%lo .and. c < grid%hi)) cycle
          call look_across(c, smallest(self%root(l)))
        end do
        call global_sum(changes)
        if (changes(1) == 0_i8) exit
      end do
    end associate
  contains
    !> Take over a smaller label from a halo cell behind an open face.
    subroutine look_across(c, label)
      integer, intent(in) :: c(3)
      integer, intent(inout) :: label
      integer :: d, s, f(3), nb(3)

      do d = 1, 3
        do s = 0, 1
          f = c + s*unit_step(:, d)
          nb = c + (2*s - 1)*unit_step(:, d)
          if (.not. self%k(f(1), f(2), f(3), d) > 0.0_wp) cycle
          if (self%label(nb(1), nb(2), nb(3)) == 0) cycle
          if (self%label(nb(1), nb(2), nb(3)) >= label) cycle
          label = self%label(nb(1), nb(2), nb(3))
          changes = changes + 1_i8
        end do
      end do
    end subroutine look_across
  end subroutine join_processes

  !> The labels of all parts on all processes, rising.
  subroutine list_parts(grid, self)
    type(grid_t), intent(in) :: grid
    type(open_flux_t), intent(inout) :: self
    integer :: l, c(3), rank, offset, n

    rank = my_rank()
    self%held = 0_i8
    do l = 1, self%n
      if (is_home(l)) self%held(rank) = self%held(rank) + 1_i8
    end do
    call global_sum(self%held)
    self%parts = int(sum(self%held))
    offset = int(sum(self%held(0:rank - 1)))
    if (self%parts > size(self%home)) then
      n = 2*self%parts
      deallocate (self%first, self%home, self%count, self%bins, self%total, self%largest)
      call allocate_parts(n, self)
    end if
    self%home(1:self%parts) = 0_i8
    n = offset
    do l = 1, self%n
      if (.not. is_home(l)) cycle
      n = n + 1
      c = cell_at(grid, self%at(l))
      self%home(n) = int(global_number(grid, c), i8)
    end do
    call global_sum(self%home(1:self%parts))
    call sort(self%home(1:self%parts))
  contains
    !> Is this the cell that gave its part the label?
    logical function is_home(l)
      integer, intent(in) :: l
      integer :: c(3)

      c = cell_at(grid, self%at(l))
      is_home = self%label(c(1), c(2), c(3)) == global_number(grid, c)
    end function is_home
  end subroutine list_parts

  !> Rising order, in place; the lists of parts are short.
  pure subroutine sort(a)
    integer(i8), intent(inout) :: a(:)
    integer(i8) :: key
    integer :: i, j

    do i = 2, size(a)
      key = a(i)
      j = i - 1
      do while (j >= 1)
        if (a(j) <= key) exit
        a(j + 1) = a(j)
        j = j - 1
      end do
      a(j + 1) = key
    end do
  end subroutine sort

  !> Place of a label in the rising list that holds it.
  pure function position(label, list) result(p)
    integer(i8), intent(in) :: label, list(:)
    integer :: p
    integer :: high, middle

    p = 1
    high = size(list)
    do while (p < high)
      middle = (p + high)/2
      if (list(middle) < label) then
        p = middle + 1
      else
        high = middle
      end if
    end do
  end function position

  !> Sort the lists by part, take the mean of r out of each part without an open side, and keep the
  !! parts that need a solution.
  subroutine balance_parts(grid, self)
    type(grid_t), intent(in) :: grid
    type(open_flux_t), intent(inout) :: self
    integer :: c, l, n
    real(wp) :: mean

    call sort_by_part(self)
    call sum_parts(grid, self)
    do c = 1, self%parts
      mean = 0.0_wp
      if (self%count(self%parts + c) == 0_i8) mean = self%total(c)/real(self%count(c), wp)
      self%unmatched = max(self%unmatched, abs(mean))
      self%largest(c) = 0.0_wp
      do l = self%first(c), self%first(c + 1) - 1
        self%r(l) = self%r(l) - mean
        self%largest(c) = max(self%largest(c), abs(self%r(l)))
      end do
    end do
    call global_max(self%largest(1:self%parts))
    n = 0
    do c = 1, self%parts
      if (self%largest(c) <= self%tolerance) then
        self%residual = max(self%residual, self%largest(c))
        cycle
      end if
      do l = self%first(c), self%first(c + 1) - 1
        n = n + 1
        self%at(n) = self%at(l)
        self%r(n) = self%r(l)
        self%diagonal(n) = self%diagonal(l)
      end do
    end do
    self%n = n
    self%cells = n
  end subroutine balance_parts

  !> Cells, open sides and the sum of r of each part over all processes.
  subroutine sum_parts(grid, self)
    type(grid_t), intent(in) :: grid
    type(open_flux_t), intent(inout) :: self
    integer :: c, l, n

    n = self%parts
    self%count(1:2*n) = 0_i8
    do c = 1, n
      self%count(c) = int(self%first(c + 1) - self%first(c), i8)
      do l = self%first(c), self%first(c + 1) - 1
        if (at_open_side(cell_at(grid, self%at(l)))) self%count(n + c) = self%count(n + c) + 1_i8
      end do
      self%bins(:, c) = no_terms
      call exact_add(self%r(self%first(c):self%first(c + 1) - 1), self%bins(:, c))
    end do
    call global_sum(self%count(1:2*n))
    call exact_totals(self%bins(:, 1:n), self%total(1:n))
  contains
    !> Can this cell exchange through an open side of the domain?
    logical function at_open_side(c)
      integer, intent(in) :: c(3)
      integer :: d, s, f(3)

      at_open_side = .false.
      do d = 1, 3
        do s = 0, 1
          f = c + s*unit_step(:, d)
          if (side_at(grid, f(d), d) == 0) cycle
          if (self%k(f(1), f(2), f(3), d) > 0.0_wp) at_open_side = .true.
        end do
      end do
    end function at_open_side
  end subroutine sum_parts

  !> Stable sort of the lists by part.
  subroutine sort_by_part(self)
    type(open_flux_t), intent(inout) :: self
    integer :: l, c

    self%first(1:self%parts + 1) = 0
    do l = 1, self%n
      self%first(self%part(l) + 1) = self%first(self%part(l) + 1) + 1
    end do
    self%first(1) = 1
    do c = 1, self%parts
      self%first(c + 1) = self%first(c + 1) + self%first(c)
    end do
    do l = self%n, 1, -1   ! from the back, so that equal parts keep their order
      c = self%part(l)
      self%first(c + 1) = self%first(c + 1) - 1
      self%order(self%first(c + 1)) = l
    end do
    do c = 1, self%parts   ! the ends have moved down to the begins
      self%first(c) = self%first(c + 1)
    end do
    self%first(self%parts + 1) = self%n + 1
    do l = 1, self%n
      self%spare(l) = self%at(self%order(l))
      self%z(l) = self%r(self%order(l))
      self%s(l) = self%diagonal(self%order(l))
    end do
    self%at(1:self%n) = self%spare(1:self%n)
    self%r(1:self%n) = self%z(1:self%n)
    self%diagonal(1:self%n) = self%s(1:self%n)
  end subroutine sort_by_part

  !> Conjugate gradients for the potential; it ends in `p`, halo filled.
  subroutine solve_band(grid, self)
    type(grid_t), intent(in) :: grid
    type(open_flux_t), intent(inout) :: self
    integer :: l, n, it, extent(3)
    real(wp) :: rz, rz_before, ps, step, largest(1)

    n = self%n
    extent = grid%hi - grid%lo + 3
    self%p = 0.0_wp
    self%phi(1:n) = 0.0_wp
    rz_before = 1.0_wp
    largest = 0.0_wp
    do l = 1, n
      largest(1) = max(largest(1), abs(self%r(l)))
    end do
    call global_max(largest)
    do it = 1, self%max_iterations
      if (largest(1) <= self%tolerance) exit
      self%z(1:n) = self%r(1:n)*(self%r(1:n)/self%diagonal(1:n))
      rz = exact_sum(self%z(1:n))
      step = 0.0_wp
      if (it > 1) step = rz/rz_before
      rz_before = rz
      call next_direction(n, self%at, self%r, self%diagonal, step, size(self%p), self%p)
      call halo_exchange(self%p, 1)
      call apply_band(n, self%at, self%diagonal, size(self%p), extent(1), extent(1)*extent(2), &
                      self%k, self%p, self%s, self%z)
      ps = exact_sum(self%z(1:n))
      if (.not. ps > 0.0_wp) exit
      call advance(n, self%at, rz/ps, size(self%p), self%p, self%s, self%phi, self%r, largest(1))
      call global_max(largest)
      self%iterations = it
    end do
    self%residual = max(self%residual, largest(1))
    self%p = 0.0_wp
    call scatter(n, self%at, self%phi, size(self%p), self%p)
    call halo_exchange(self%p, 1)
  end subroutine solve_band

  !> p := r/diagonal + step*p at the cells of the list.
  pure subroutine next_direction(n, at, r, diagonal, step, m, p)
    integer, intent(in) :: n, at(n), m
    real(wp), intent(in) :: r(n), diagonal(n), step
    real(wp), intent(inout) :: p(m)
    integer :: l

    do l = 1, n
      p(at(l)) = r(l)/diagonal(l) + step*p(at(l))
    end do
  end subroutine next_direction

  !> s := A p and the terms p*s of its energy.
  subroutine apply_band(n, at, diagonal, m, in_y, in_z, k, p, s, terms)
    integer, intent(in) :: n, at(n), m
    real(wp), intent(in) :: diagonal(n)
    integer, intent(in) :: in_y, in_z     !! steps to the next cell in y and z
    real(wp), intent(in) :: k(m, 3), p(m)
    real(wp), intent(inout) :: s(n), terms(n)
    integer :: l, c

    !$omp parallel do private(c) schedule(static) if (n > 4096)
    do l = 1, n
      c = at(l)
      s(l) = diagonal(l)*p(c) - ((k(c, 1)*p(c - 1) + k(c + 1, 1)*p(c + 1)) &
                                 + (k(c, 2)*p(c - in_y) + k(c + in_y, 2)*p(c + in_y)) &
                                 + (k(c, 3)*p(c - in_z) + k(c + in_z, 3)*p(c + in_z)))
      terms(l) = p(c)*s(l)
    end do
  end subroutine apply_band

  !> phi := phi + step*p, r := r - step*s, and the largest |r|.
  pure subroutine advance(n, at, step, m, p, s, phi, r, largest)
    integer, intent(in) :: n, at(n), m
    real(wp), intent(in) :: step, p(m), s(n)
    real(wp), intent(inout) :: phi(n), r(n)
    real(wp), intent(out) :: largest
    integer :: l

    largest = 0.0_wp
    do l = 1, n
      phi(l) = phi(l) + step*p(at(l))
      r(l) = r(l) - step*s(l)
      largest = max(largest, abs(r(l)))
    end do
  end subroutine advance

  pure subroutine scatter(n, at, list, m, p)
    integer, intent(in) :: n, at(n), m
    real(wp), intent(in) :: list(n)
    real(wp), intent(inout) :: p(m)
    integer :: l

    do l = 1, n
      p(at(l)) = list(l)
    end do
  end subroutine scatter

  !> Take the gradient of the potential from the volumes.
  subroutine correct_flux(grid, self, q)
    type(grid_t), intent(in) :: grid
    type(open_flux_t), intent(in) :: self
    real(wp), intent(inout), contiguous :: q(grid%lo(1) - n_halo:, grid%lo(2) - n_halo:, &
                                             grid%lo(3) - n_halo:, :)
    integer :: d, i, j, k, e(3)

    do d = 1, 3
      e = unit_step(:, d)
      !$omp parallel do private(i, j) schedule(static)
      do k = grid%lo(3), grid%hi(3) + e(3)
        do j = grid%lo(2), grid%hi(2) + e(2)
          do i = grid%lo(1), grid%hi(1) + e(1)
            if (.not. self%k(i, j, k, d) > 0.0_wp) cycle
            q(i, j, k, d) = q(i, j, k, d) - grid%volume*self%k(i, j, k, d) &
                            *(self%p(i, j, k) - self%p(i - e(1), j - e(2), k - e(3)))
          end do
        end do
      end do
    end do
  end subroutine correct_flux

end module open_flux_m
