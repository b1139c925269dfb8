!> Transport of the liquid with exact volumes around moving bodies.
!!
!! Carried per cell: the liquid W and the open volume Vt. The volumes Q through the faces fit the
!! moving bodies exactly (`open_flux_m`), so W and Vt go through the same balance, direction by
!! direction: in a sweep each cell gives the slab of open volume Q beside its face, and of it the
!! liquid below its plane, G. Slabs of one sweep do not overlap, so 0 <= W <= Vt holds without
!! clipping, nothing is redistributed and pure cells stay pure to the last bit.
!!
!! Small cells (they would give away nearly all they hold, or they open or close in this step)
!! receive in the sweeps and give afterwards: the implicit donor value, which is bounded for any
!! step,
!! $$ C_S = (W_S + \sum_{in} Q\, C_{S'}) / (V_S + \sum_{in} Q) $$
!!
!! Momentum rides on the same volumes: after `sweep`, `q(:,:,:,d)` and `g(:,:,:,d)` hold what has
!! just moved; after `small_cells` the faces behind small donors do. Source and trial of the scheme:
!! docs/theory.md. Departure from the paper: it moves the mixture and knows no open volume.
module liquid_transport_m
  use omp_lib, only: omp_get_max_threads, omp_get_thread_num
  use kinds_m, only: wp, i8
  use case_types_m, only: absent, is_given
  use grid_m, only: grid_t, n_halo, unit_step
  use boundary_kinds_m, only: side_inflow, side_outflow
  use fields_m, only: flow_t
  use boundary_m, only: fill_scalar_halo
  use solid_geometry_m, only: solid_geometry_t
  use plic_m, only: unit_constant, unit_slab
  use cut_cell_m, only: cut_cell_t, cut_cell_init, load_cut_cell, open_constant, open_slab_below
  use surface_normal_m, only: surface_normal
  use open_flux_m, only: open_flux_t, open_flux_init, find_open_flux
  use extended_fraction_m, only: extended_fraction_t, extended_fraction_init, extend_fraction, &
                                 nearly_pure
  use exact_sum_m, only: exact_sum
  use parallel_m, only: halo_exchange, global_max, global_sum
  implicit none
  private
  public :: liquid_transport_t, liquid_transport_init
  public :: transport_liquid, begin_transport, begin_part, sweep, small_cells, finish_transport
  public :: late_values, move_late

  real(wp), parameter :: most_outflow = 0.98_wp     !! share of its volume a cell may give
  real(wp), parameter :: least_volume = 1.0e-6_wp   !! of a cell that is not small [V]
  real(wp), parameter :: immobile = 1.0e-14_wp      !! share of liquid or gas that does not move
  real(wp), parameter :: closed_volume = 1.0e-12_wp !! open volume of a closed cell [V]
  integer, parameter :: max_late_iterations = 1000

  !> The six orders of the directions.
  integer, parameter :: orders(3, 6) = reshape([1, 2, 3, 2, 3, 1, 3, 1, 2, 3, 2, 1, 1, 3, 2, &
                                             2, 1, 3], [3, 6])

  type :: liquid_transport_t
    type(open_flux_t) :: flux
    type(extended_fraction_t) :: extension
    real(wp) :: incoming(2, 3) = 0.0_wp       !! liquid share of what enters through a side
    real(wp) :: level = absent                !! an inflow brings liquid below it [m]
    integer :: order(3) = [1, 2, 3]           !! directions of this step's sweeps
    integer :: parts = 1                      !! equal parts in which the volumes of the step move
    !> Volumes through the lower faces in the whole step, positive along the axis [m3].
    real(wp), allocatable :: q_step(:, :, :, :)
    real(wp) :: inflow = 0.0_wp               !! of liquid through the sides in this step [m3]
    !> Volumes through the lower faces in this part of the step, all and liquid, positive along the
    !! axis; faces lo..hi+1 [m3]. Those of small donors are zero during the sweeps and stand there
    !! after `small_cells`.
    real(wp), allocatable :: q(:, :, :, :), g(:, :, :, :)
    !> Running liquid and open volume, after and before the last `sweep` or `small_cells`; the halo
    !! of the open volume is filled [m3].
    real(wp), allocatable :: w(:, :, :), v(:, :, :), w_before(:, :, :), v_before(:, :, :)
    real(wp), allocatable :: c(:, :, :)       !! running C^, for normals; halo filled
    logical, allocatable :: small(:, :, :)    !! small cells; halo filled
    integer :: n_small = 0                    !! of this process
    integer, allocatable :: small_cell(:, :)  !! (3, *)
    !> Faces whose donor is a small cell.
    integer :: n_late = 0
    integer, allocatable :: late_face(:, :)   !! (4, *) cell and direction of the lower face
    integer, allocatable :: donor(:, :), receiver(:, :)   !! (3, *)
    real(wp), allocatable :: late_q(:), late_g(:)         !! (*) volumes like q and g [m3]
    ! Statistics of the last step, all processes.
    integer :: small_count = 0                !! small cells that gave something
    integer :: small_open = 0                 !! of them without solid: the time step is long
    integer :: late_iterations = 0
    real(wp) :: clamped = 0.0_wp              !! largest change by the round-off guard of a slab [V]
    real(wp) :: held = 0.0_wp                 !! liquid in closed cells until they open [m3]
    ! Work arrays.
    real(wp), allocatable :: out_low(:, :, :), out_high(:, :, :)   !! liquid leaving by either face
    real(wp), allocatable :: value(:, :, :)
    integer, allocatable :: number(:, :, :)   !! of a small cell, 0 for others; halo filled
    integer :: n_mixed = 0
    integer, allocatable :: mixed_cell(:, :), in_plane(:)
    real(wp), allocatable :: amount(:), mass(:), ratio(:), weight(:), side(:)
    type(cut_cell_t), allocatable :: cut(:)   !! one per thread, from 0
  end type liquid_transport_t

contains

  !> Allocate the work arrays once.
  subroutine liquid_transport_init(grid, gravity, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    type(liquid_transport_t), intent(out) :: self
    integer, parameter :: first_size = 1024
    integer :: a(3), b(3), m(3), t

    a = grid%first
    b = grid%last
    call open_flux_init(grid, self%flux)
    call extended_fraction_init(gravity, self%extension)
    allocate (self%q(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
    allocate (self%g, self%q_step, source=self%q)
    allocate (self%w(a(1):b(1), a(2):b(2), a(3):b(3)), source=0.0_wp)
    allocate (self%v, self%w_before, self%v_before, self%c, source=self%w)
    allocate (self%out_low, self%out_high, self%value, source=self%w)
    allocate (self%number(a(1):b(1), a(2):b(2), a(3):b(3)), source=0)
    allocate (self%small(a(1):b(1), a(2):b(2), a(3):b(3)), source=.false.)
    allocate (self%in_plane(grid%lo(3):grid%hi(3) + 1), source=0)
    m = grid%hi - grid%lo + 1
    allocate (self%side(2*(m(1)*m(2) + m(2)*m(3) + m(3)*m(1))), source=0.0_wp)
    call allocate_late(first_size, self)
    call allocate_small(first_size, self)
    allocate (self%mixed_cell(3, first_size))
    allocate (self%cut(0:omp_get_max_threads() - 1))
    do t = 0, size(self%cut) - 1
      call cut_cell_init(self%cut(t))
    end do
  end subroutine liquid_transport_init

  subroutine allocate_late(n, self)
    integer, intent(in) :: n
    type(liquid_transport_t), intent(inout) :: self

    allocate (self%late_face(4, n), self%donor(3, n), self%receiver(3, n))
    allocate (self%late_q(n), self%late_g(n), self%weight(n))
  end subroutine allocate_late

  subroutine allocate_small(n, self)
    integer, intent(in) :: n
    type(liquid_transport_t), intent(inout) :: self

    allocate (self%small_cell(3, n), self%amount(n), self%mass(n), self%ratio(n))
  end subroutine allocate_small

  !> The whole transport of one step, for callers that carry nothing else.
  subroutine transport_liquid(grid, old, new, dt, step, self, flow, parts)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old, new   !! bodies at the begin and the end of the step
    real(wp), intent(in) :: dt     !! [s]
    integer, intent(in) :: step    !! number of the step; it picks the order of the directions
    type(liquid_transport_t), intent(inout) :: self
    type(flow_t), intent(inout) :: flow
    integer, intent(in), optional :: parts   !! in which the volumes of the step move, else 1
    integer :: n, part

    call begin_transport(grid, old, new, dt, self, flow, parts)
    do part = 1, self%parts
      call begin_part(grid, old, part, step, self)
      do n = 1, 3
        call sweep(grid, old, self%order(n), self)
      end do
      call small_cells(grid, self)
    end do
    call finish_transport(grid, new, self, flow)
  end subroutine transport_liquid

  !> Volumes through the faces in the step, running values.
  subroutine begin_transport(grid, old, new, dt, self, flow, parts)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old, new
    real(wp), intent(in) :: dt
    type(liquid_transport_t), intent(inout) :: self
    type(flow_t), intent(in) :: flow   !! liquid, room, c (halo filled) and uf of the begin
    integer, intent(in), optional :: parts
    integer :: k

    self%parts = 1
    if (present(parts)) self%parts = parts
    call find_open_flux(grid, old, new, flow%room, flow%uf, dt, self%flux, self%q_step)
    !$omp parallel do schedule(static)
    do k = grid%first(3), grid%last(3)
      self%w(:, :, k) = flow%liquid(:, :, k)
      self%v(:, :, k) = flow%room(:, :, k)
      self%c(:, :, k) = flow%c(:, :, k)
    end do
    self%clamped = 0.0_wp
    self%inflow = 0.0_wp
  end subroutine begin_transport

  !> An equal part of the step's volumes, and the small cells for it.
  !!
  !! Where the fluid moves further than the sweeps can follow, the same volumes go in several parts.
  !! The open volume of a cell then runs in equal parts too, so the last part ends at that
  !! of the new geometry whatever their number.
  subroutine begin_part(grid, old, part, step, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old
    integer, intent(in) :: part   !! 1..parts
    integer, intent(in) :: step   !! number of the step; both pick the order of the directions
    type(liquid_transport_t), intent(inout) :: self
    integer :: k

    self%order = orders(:, 1 + modulo(step + part - 1, size(orders, 2)))
    !$omp parallel do schedule(static)
    do k = grid%first(3), grid%last(3)
      self%q(:, :, k, :) = self%q_step(:, :, k, :)/real(self%parts, wp)
      self%g(:, :, k, :) = 0.0_wp
    end do
    call find_small_cells(grid, old, self)
    call find_late_faces(grid, self)
  end subroutine begin_part

  !> Cells that would give nearly all they hold, or hold nearly nothing.
  subroutine find_small_cells(grid, old, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old
    type(liquid_transport_t), intent(inout) :: self
    integer, allocatable :: cell(:, :)
    integer :: i, j, k, n
    real(wp) :: outflow, open

    n = 0
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          self%number(i, j, k) = 0
          outflow = max(self%q(i + 1, j, k, 1), 0.0_wp) + max(-self%q(i, j, k, 1), 0.0_wp) &
                    + max(self%q(i, j + 1, k, 2), 0.0_wp) + max(-self%q(i, j, k, 2), 0.0_wp) &
                    + max(self%q(i, j, k + 1, 3), 0.0_wp) + max(-self%q(i, j, k, 3), 0.0_wp)
          open = min(self%v(i, j, k), grid%volume*(1.0_wp - old%alpha(i, j, k)))
          if (outflow <= most_outflow*open .and. open >= least_volume*grid%volume) cycle
          if (n == size(self%amount)) then
            call move_alloc(self%small_cell, cell)
            deallocate (self%amount, self%mass, self%ratio)
            call allocate_small(2*n, self)
            self%small_cell(:, 1:n) = cell
          end if
          n = n + 1
          self%number(i, j, k) = n
          self%small_cell(:, n) = [i, j, k]
        end do
      end do
    end do
    self%n_small = n
    call halo_exchange(self%number, n_halo)
    self%small = self%number > 0
  end subroutine find_small_cells

  !> Faces with a small donor: listed, and taken out of the sweeps.
  subroutine find_late_faces(grid, self)
    type(grid_t), intent(in) :: grid
    type(liquid_transport_t), intent(inout) :: self
    integer :: d, i, j, k, e(3), up(3), low(3), donor(3)

    self%n_late = 0
    do d = 1, 3
      e = unit_step(:, d)
      do k = grid%lo(3), grid%hi(3) + e(3)
        do j = grid%lo(2), grid%hi(2) + e(2)
          do i = grid%lo(1), grid%hi(1) + e(1)
            if (.not. abs(self%q(i, j, k, d)) > 0.0_wp) cycle
            up = [i, j, k]
            low = up - e
            donor = merge(low, up, self%q(i, j, k, d) > 0.0_wp)
            if (.not. self%small(donor(1), donor(2), donor(3))) cycle
            if (self%n_late == size(self%late_q)) call grow_late(self)
            self%n_late = self%n_late + 1
            self%late_face(:, self%n_late) = [i, j, k, d]
            self%donor(:, self%n_late) = donor
            self%receiver(:, self%n_late) = up + low - donor
            self%late_q(self%n_late) = self%q(i, j, k, d)
            self%q(i, j, k, d) = 0.0_wp
          end do
        end do
      end do
    end do
  end subroutine find_late_faces

  !> Twice the room for late faces.
  subroutine grow_late(self)
    type(liquid_transport_t), intent(inout) :: self
    integer, allocatable :: face(:, :), donor(:, :), receiver(:, :)
    real(wp), allocatable :: q(:)
    integer :: n

    n = self%n_late
    call move_alloc(self%late_face, face)
    call move_alloc(self%donor, donor)
    call move_alloc(self%receiver, receiver)
    call move_alloc(self%late_q, q)
    deallocate (self%late_g, self%weight)
    call allocate_late(2*n, self)
    self%late_face(:, 1:n) = face
    self%donor(:, 1:n) = donor
    self%receiver(:, 1:n) = receiver
    self%late_q(1:n) = q
  end subroutine grow_late

  !> Move liquid and open volume in direction d; `g(:,:,:,d)` is new, w and v are updated.
  subroutine sweep(grid, old, d, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old   !! bodies at the begin of the step
    integer, intent(in) :: d
    type(liquid_transport_t), intent(inout) :: self

    call mixed_outflow(grid, d, self)
    call list_mixed_cells(grid, d, self)
    call plane_outflow(grid, old, d, self)
    call halo_exchange(self%out_low, n_halo, d)
    call halo_exchange(self%out_high, n_halo, d)
    call outflow_of_sides(grid, d, self)
    call swap(self%w, self%w_before)
    call swap(self%v, self%v_before)
    call move_volumes(grid, old, d, self)
    call fill_scalar_halo(grid, self%v)
    call fill_scalar_halo(grid, self%c)
  end subroutine sweep

  !> Liquid that leaves each cell if it were well mixed; right for pure cells, bit by bit. Rests at
  !! round-off of liquid in gas or of gas in liquid stay where they are instead of spreading.
  subroutine mixed_outflow(grid, d, self)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: d
    type(liquid_transport_t), intent(inout) :: self
    integer :: i, j, k, e(3)
    real(wp) :: share

    e = unit_step(:, d)
    !$omp parallel do private(i, j, share) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          share = self%w(i, j, k)/merge(self%v(i, j, k), 1.0_wp, self%v(i, j, k) > 0.0_wp)
          if (share < immobile) share = 0.0_wp
          if (share > 1.0_wp - immobile) share = 1.0_wp
          self%out_low(i, j, k) = max(-self%q(i, j, k, d), 0.0_wp)*share
          self%out_high(i, j, k) = max(self%q(i + e(1), j + e(2), k + e(3), d), 0.0_wp)*share
        end do
      end do
    end do
  end subroutine mixed_outflow

  !> Cells with liquid and gas that give volume in direction d, in the order of the grid.
  subroutine list_mixed_cells(grid, d, self)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: d
    type(liquid_transport_t), intent(inout) :: self
    integer :: i, j, k, n

    self%in_plane = 0
    !$omp parallel do private(i, j) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          if (needs_plane(i, j, k)) self%in_plane(k + 1) = self%in_plane(k + 1) + 1
        end do
      end do
    end do
    do k = grid%lo(3), grid%hi(3)
      self%in_plane(k + 1) = self%in_plane(k + 1) + self%in_plane(k)
    end do
    self%n_mixed = self%in_plane(grid%hi(3) + 1)
    if (self%n_mixed > size(self%mixed_cell, 2)) then
      deallocate (self%mixed_cell)
      allocate (self%mixed_cell(3, 2*self%n_mixed))
    end if
    !$omp parallel do private(i, j, n) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      n = self%in_plane(k)
      if (self%in_plane(k + 1) == n) cycle
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          if (.not. needs_plane(i, j, k)) cycle
          n = n + 1
          self%mixed_cell(:, n) = [i, j, k]
        end do
      end do
    end do
  contains
    pure logical function needs_plane(i, j, k)
      integer, intent(in) :: i, j, k
      integer :: f(3)
      real(wp) :: w, v

      needs_plane = .false.
      w = self%w(i, j, k)
      v = self%v(i, j, k)
      if (w <= 0.0_wp .or. w >= v) return
      if (w <= nearly_pure*v .or. v - w <= nearly_pure*v) return
      f = [i, j, k] + unit_step(:, d)
      needs_plane = self%q(i, j, k, d) < 0.0_wp .or. self%q(f(1), f(2), f(3), d) > 0.0_wp
    end function needs_plane
  end subroutine list_mixed_cells

  !> Liquid that leaves the mixed cells, by their planes.
  subroutine plane_outflow(grid, old, d, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old
    integer, intent(in) :: d
    type(liquid_transport_t), intent(inout) :: self
    integer :: l, i, j, k, f(3)
    real(wp) :: m(3), w, v, out(2), liquid(2), clamped, largest

    largest = 0.0_wp
    !$omp parallel do private(i, j, k, f, m, w, v, out, liquid, clamped) reduction(max: largest) &
    !$omp schedule(dynamic, 16)
    do l = 1, self%n_mixed
      i = self%mixed_cell(1, l)
      j = self%mixed_cell(2, l)
      k = self%mixed_cell(3, l)
      f = [i, j, k] + unit_step(:, d)
      w = self%w(i, j, k)
      v = self%v(i, j, k)
      out = [max(-self%q(i, j, k, d), 0.0_wp), max(self%q(f(1), f(2), f(3), d), 0.0_wp)]
      m = surface_normal(grid, old, self%extension%vertical, self%c, i, j, k)
      if (old%cut(i, j, k) == 0) then
        liquid = v*slabs_of_box(m, w/v, d, out/v)
      else
        associate (cut => self%cut(omp_get_thread_num()))
          call load_cut_cell(old, old%cut(i, j, k), grid%face([i, j, k], [1, 2, 3]), grid%h, cut)
          call slabs_of_cut_cell(m, w/v, d, out/v, cut, liquid)
        end associate
        liquid = v*liquid
      end if
      call guard(w, v, out, liquid, clamped)
      largest = max(largest, clamped)
      self%out_low(i, j, k) = liquid(1)
      self%out_high(i, j, k) = liquid(2)
    end do
    self%clamped = max(self%clamped, largest/grid%volume)
  end subroutine plane_outflow

  !> Liquid in the slabs beside the two faces of a cell without solid [share of the cell].
  pure function slabs_of_box(m, share, d, out) result(liquid)
    real(wp), intent(in) :: m(3)     !! normal on the unit cube
    real(wp), intent(in) :: share    !! of liquid
    integer, intent(in) :: d
    real(wp), intent(in) :: out(2)   !! volumes that leave below and above [share of the cell]
    real(wp) :: liquid(2)
    real(wp) :: a

    a = unit_constant(m, share)
    liquid(1) = unit_slab(m, a, d, 1, out(1))
    liquid(2) = unit_slab(m, a, d, 2, out(2))
  end function slabs_of_box

  !> The same for a cut cell, all in shares of its open part.
  subroutine slabs_of_cut_cell(m, share, d, out, cut, liquid)
    real(wp), intent(in) :: m(3), share
    integer, intent(in) :: d
    real(wp), intent(in) :: out(2)
    type(cut_cell_t), intent(inout) :: cut
    real(wp), intent(out) :: liquid(2)
    real(wp) :: a, limit, part, axis(3)

    liquid = out*share
    if (cut%open < least_volume) return
    axis = real(unit_step(:, d), wp)
    call open_constant(cut, m, share*cut%open, a)
    if (out(1) > 0.0_wp) then
      call open_constant(cut, axis, out(1)*cut%open, limit)
      call open_slab_below(cut, m, a, d, limit, part)
      liquid(1) = part/cut%open
    end if
    if (out(2) > 0.0_wp) then
      call open_constant(cut, axis, (1.0_wp - out(2))*cut%open, limit)
      call open_slab_below(cut, m, a, d, limit, part)
      liquid(2) = share - part/cut%open
    end if
  end subroutine slabs_of_cut_cell

  !> Keep the liquid of both slabs within what there is of liquid and of gas: round-off only.
  pure subroutine guard(w, v, out, liquid, clamped)
    real(wp), intent(in) :: w, v, out(2)
    real(wp), intent(inout) :: liquid(2)
    real(wp), intent(out) :: clamped   !! largest change
    real(wp) :: w_left, v_left, before
    integer :: s

    w_left = w
    v_left = v
    clamped = 0.0_wp
    do s = 1, 2
      before = liquid(s)
      liquid(s) = max(liquid(s), out(s) - (v_left - w_left), 0.0_wp)
      liquid(s) = min(liquid(s), out(s), w_left)
      clamped = max(clamped, abs(liquid(s) - before))
      w_left = w_left - liquid(s)
      v_left = v_left - out(s)
    end do
  end subroutine guard

  !> Liquid that comes in through the sides of the domain, as outflow of the halo cell behind them.
  subroutine outflow_of_sides(grid, d, self)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: d
    type(liquid_transport_t), intent(inout) :: self
    integer :: i, j, k, s, e(3), a(3), b(3)

    e = unit_step(:, d)
    do s = 1, 2
      call grid%side_faces(s, d, a, b)
      do k = a(3), b(3)
        do j = a(2), b(2)
          do i = a(1), b(1)
            if (s == 1) then
              self%out_high(i - e(1), j - e(2), k - e(3)) = max(self%q(i, j, k, d), 0.0_wp) &
                *incoming_share(grid, self, s, d, [i, j, k])
            else
              self%out_low(i, j, k) = max(-self%q(i, j, k, d), 0.0_wp) &
                *incoming_share(grid, self, s, d, [i, j, k] - e)
            end if
          end do
        end do
      end do
    end do
  end subroutine outflow_of_sides

  !> Liquid share of what enters through side s of direction d into a cell: an inflow brings liquid
  !! below its level, through an outflow comes back what stands there.
  pure function incoming_share(grid, self, s, d, at) result(share)
    type(grid_t), intent(in) :: grid
    type(liquid_transport_t), intent(in) :: self
    integer, intent(in) :: s, d, at(3)
    real(wp) :: share
    integer :: axis
    real(wp) :: bounds(2)   ! of the face along the vertical

    share = self%incoming(s, d)
    if (grid%side(s, d) == side_outflow) share = self%c(at(1), at(2), at(3))
    if (grid%side(s, d) /= side_inflow .or. .not. is_given(self%level)) return
    axis = maxloc(abs(self%extension%vertical%up), 1)
    bounds = grid%face(at(axis) + [0, 1], axis)
    if (axis == d) bounds = bounds(s)
    if (self%extension%vertical%up(axis) > 0.0_wp) then
      share = self%level - bounds(1)
    else
      share = bounds(2) - self%level
    end if
    if (axis == d) then
      share = merge(1.0_wp, 0.0_wp, share >= 0.0_wp)
    else
      share = min(max(share/grid%h(axis), 0.0_wp), 1.0_wp)
    end if
  end function incoming_share

  !> Exchange two arrays without copying.
  pure subroutine swap(a, b)
    real(wp), allocatable, intent(inout) :: a(:, :, :), b(:, :, :)
    real(wp), allocatable :: c(:, :, :)

    call move_alloc(a, c)
    call move_alloc(b, a)
    call move_alloc(c, b)
  end subroutine swap

  !> Liquid volumes of the faces, and the new running values; W and Vt go through the same
  !! operations.
  subroutine move_volumes(grid, old, d, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old
    integer, intent(in) :: d
    type(liquid_transport_t), intent(inout) :: self
    integer :: i, j, k, e(3)

    e = unit_step(:, d)
    !$omp parallel do private(i, j) schedule(static)
    do k = grid%lo(3), grid%hi(3) + e(3)
      do j = grid%lo(2), grid%hi(2) + e(2)
        do i = grid%lo(1), grid%hi(1) + e(1)
          self%g(i, j, k, d) = self%out_high(i - e(1), j - e(2), k - e(3)) - self%out_low(i, j, k)
        end do
      end do
    end do
    !$omp parallel do private(i, j) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          self%w(i, j, k) = ((self%w_before(i, j, k) - max(-self%g(i, j, k, d), 0.0_wp)) &
                             - max(self%g(i + e(1), j + e(2), k + e(3), d), 0.0_wp)) &
                            + (max(self%g(i, j, k, d), 0.0_wp) &
                               + max(-self%g(i + e(1), j + e(2), k + e(3), d), 0.0_wp))
          self%v(i, j, k) = ((self%v_before(i, j, k) - max(-self%q(i, j, k, d), 0.0_wp)) &
                             - max(self%q(i + e(1), j + e(2), k + e(3), d), 0.0_wp)) &
                            + (max(self%q(i, j, k, d), 0.0_wp) &
                               + max(-self%q(i + e(1), j + e(2), k + e(3), d), 0.0_wp))
          if (old%alpha(i, j, k) <= 0.0_wp) then
            self%c(i, j, k) = share_of(self%w(i, j, k), self%v(i, j, k))
          end if
        end do
      end do
    end do
  end subroutine move_volumes

  !> Liquid share of a volume, within 0 and 1.
  elemental function share_of(w, v) result(share)
    real(wp), intent(in) :: w, v
    real(wp) :: share

    share = min(max(w/merge(v, 1.0_wp, v > 0.0_wp), 0.0_wp), 1.0_wp)
  end function share_of

  !> The small cells give: w and v are final for this part, q and g are complete.
  subroutine small_cells(grid, self)
    type(grid_t), intent(in) :: grid
    type(liquid_transport_t), intent(inout) :: self
    integer :: l, at(3)

    self%w_before = self%w
    self%v_before = self%v
    self%weight(1:self%n_late) = abs(self%late_q(1:self%n_late))
    call late_values(grid, self%w, self%v, self%weight, self, self%value)
    do l = 1, self%n_late
      at = self%donor(:, l)
      self%late_g(l) = self%late_q(l)*min(max(self%value(at(1), at(2), at(3)), 0.0_wp), 1.0_wp)
    end do
    call move_late(grid, self, self%late_g, self%w)
    call move_late(grid, self, self%late_q, self%v)
    call fill_scalar_halo(grid, self%v)
    do l = 1, self%n_late
      associate (f => self%late_face(:, l))
        self%q(f(1), f(2), f(3), f(4)) = self%late_q(l)
        self%g(f(1), f(2), f(3), f(4)) = self%late_g(l)
      end associate
    end do
    self%inflow = self%inflow + inflow_of_sides(grid, self)
  end subroutine small_cells

  !> What small cells hold per mass of a carried quantity once all has come in:
  !! $$ x_S = (a_S + \sum_{in} w\, x_{S'}) / (m_S + \sum_{in} w) $$
  !! Every value follows from those of the pass before, so the result does not depend on any order.
  subroutine late_values(grid, amount, mass, weight, self, value)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: amount(grid%first(1):, grid%first(2):, grid%first(3):)
      !! carried, after the sweeps
    real(wp), intent(in), contiguous :: mass(grid%first(1):, grid%first(2):, grid%first(3):)
      !! mass or volume then
    real(wp), intent(in) :: weight(:)   !! of the late faces, like `mass`, positive
    type(liquid_transport_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: value(grid%first(1):, grid%first(2):, grid%first(3):)
      !! of small cells
    integer(i8) :: faces(1)
    integer :: it, l, s, at(3)
    real(wp) :: change(2)   ! largest change and largest value

    self%late_iterations = 0
    faces = int(self%n_late, i8)
    call global_sum(faces)
    if (faces(1) == 0_i8) return
    do s = 1, self%n_small
      at = self%small_cell(:, s)
      self%mass(s) = mass(at(1), at(2), at(3))
      value(at(1), at(2), at(3)) = 0.0_wp
      if (self%mass(s) > 0.0_wp) then
        value(at(1), at(2), at(3)) = amount(at(1), at(2), at(3))/self%mass(s)
      end if
    end do
    do l = 1, self%n_late
      s = number_of(self%receiver(:, l))
      if (s > 0) self%mass(s) = self%mass(s) + weight(l)
    end do
    do it = 1, max_late_iterations
      call halo_exchange(value, n_halo)
      do s = 1, self%n_small
        at = self%small_cell(:, s)
        self%amount(s) = amount(at(1), at(2), at(3))
      end do
      do l = 1, self%n_late
        s = number_of(self%receiver(:, l))
        if (s == 0) cycle
        at = self%donor(:, l)
        self%amount(s) = self%amount(s) + weight(l)*value(at(1), at(2), at(3))
      end do
      change = 0.0_wp
      do s = 1, self%n_small
        at = self%small_cell(:, s)
        self%ratio(s) = 0.0_wp
        if (self%mass(s) > 0.0_wp) self%ratio(s) = self%amount(s)/self%mass(s)
        change(1) = max(change(1), abs(self%ratio(s) - value(at(1), at(2), at(3))))
        change(2) = max(change(2), abs(self%ratio(s)))
        value(at(1), at(2), at(3)) = self%ratio(s)
      end do
      call global_max(change)
      self%late_iterations = it
      if (change(1) <= 4.0_wp*epsilon(1.0_wp)*change(2)) exit
    end do
    call halo_exchange(value, n_halo)
  contains
    !> Number of the small cell at this place if it is a cell of this process, else 0.
    pure integer function number_of(at)
      integer, intent(in) :: at(3)

      number_of = 0
      if (grid%owns(at)) number_of = self%number(at(1), at(2), at(3))
    end function number_of
  end subroutine late_values

  !> Move what crosses the late faces; `flux` is positive along the axis.
  subroutine move_late(grid, self, flux, amount)
    type(grid_t), intent(in) :: grid
    type(liquid_transport_t), intent(in) :: self
    real(wp), intent(in) :: flux(:)
    real(wp), intent(inout), contiguous :: amount(grid%first(1):, grid%first(2):, grid%first(3):)
    integer :: l, up(3), low(3)

    do l = 1, self%n_late
      up = self%late_face(1:3, l)
      low = up - unit_step(:, self%late_face(4, l))
      if (grid%owns(low)) then
        amount(low(1), low(2), low(3)) = amount(low(1), low(2), low(3)) - flux(l)
      end if
      if (grid%owns(up)) then
        amount(up(1), up(2), up(3)) = amount(up(1), up(2), up(3)) + flux(l)
      end if
    end do
  end subroutine move_late

  !> New liquid, room and C^; liquid through the sides; statistics.
  subroutine finish_transport(grid, new, self, flow)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: new   !! bodies at the end of the step
    type(liquid_transport_t), intent(inout) :: self
    type(flow_t), intent(inout) :: flow
    integer :: k

    !$omp parallel do schedule(static)
    do k = grid%lo(3), grid%hi(3)
      flow%liquid(:, :, k) = self%w(:, :, k)
      flow%room(:, :, k) = self%v(:, :, k)
    end do
    call fill_scalar_halo(grid, flow%liquid)
    call fill_scalar_halo(grid, flow%room)
    call extend_fraction(grid, new, self%extension, flow)
    flow%liquid_inflow = flow%liquid_inflow + self%inflow
    call count_small_cells(grid, new, self)
  end subroutine finish_transport

  !> Liquid that came in through the sides of the domain in this part of the step [m3].
  function inflow_of_sides(grid, self) result(inflow)
    type(grid_t), intent(in) :: grid
    type(liquid_transport_t), intent(inout) :: self
    real(wp) :: inflow
    integer :: d, s, i, j, k, n, a(3), b(3)
    real(wp) :: way

    n = 0
    do d = 1, 3
      do s = 1, 2
        call grid%side_faces(s, d, a, b)
        way = merge(1.0_wp, -1.0_wp, s == 1)
        do k = a(3), b(3)
          do j = a(2), b(2)
            do i = a(1), b(1)
              n = n + 1
              self%side(n) = way*self%g(i, j, k, d)
            end do
          end do
        end do
      end do
    end do
    inflow = exact_sum(self%side(1:n))
  end function inflow_of_sides

  !> Small cells that gave something, and the liquid of closed cells.
  subroutine count_small_cells(grid, new, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: new
    type(liquid_transport_t), intent(inout) :: self
    integer(i8) :: count(2)
    integer :: s, l, n, at(3)

    self%ratio(1:self%n_small) = 0.0_wp
    do l = 1, self%n_late
      at = self%donor(:, l)
      if (.not. grid%owns(at)) cycle
      self%ratio(self%number(at(1), at(2), at(3))) = 1.0_wp
    end do
    count = 0_i8
    n = 0
    do s = 1, self%n_small
      at = self%small_cell(:, s)
      if (self%ratio(s) > 0.0_wp) then
        count(1) = count(1) + 1_i8
        if (new%alpha(at(1), at(2), at(3)) <= 0.0_wp) count(2) = count(2) + 1_i8
      end if
      if (1.0_wp - new%alpha(at(1), at(2), at(3)) > closed_volume) cycle
      n = n + 1
      self%amount(n) = self%w(at(1), at(2), at(3))
    end do
    call global_sum(count)
    self%small_count = int(count(1))
    self%small_open = int(count(2))
    self%held = exact_sum(self%amount(1:n))
  end subroutine count_small_cells

end module liquid_transport_m
