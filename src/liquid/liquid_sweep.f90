!> One sweep of the liquid transport: every cell gives volume to its neighbours along one direction.
!!
!! Of the slab of open volume Q beside a face a cell gives the liquid below its plane. Slabs of one
!! sweep do not overlap, so 0 <= W <= Vt holds without clipping, and pure cells stay pure to the
!! last bit. Cells without a plane give what they hold in the mean.
module liquid_sweep_m
  use omp_lib, only: omp_get_max_threads, omp_get_thread_num
  use kinds_m, only: wp
  use case_types_m, only: absent, is_given
  use grid_m, only: grid_t, n_halo, unit_step
  use boundary_kinds_m, only: side_inflow, side_outflow
  use boundary_m, only: fill_scalar_halo
  use solid_geometry_m, only: solid_geometry_t
  use plic_m, only: unit_constant, unit_slab
  use cut_cell_m, only: cut_cell_t, cut_cell_init, load_cut_cell, open_constant, open_slab_below
  use surface_normal_m, only: vertical_t, vertical_of, surface_normal
  use extended_fraction_m, only: nearly_pure
  use carried_volumes_m, only: carried_volumes_t, share_of
  use parallel_m, only: halo_exchange
  implicit none
  private
  public :: liquid_sweep_t, liquid_sweep_init, sweep_volumes

  real(wp), parameter :: immobile = 1.0e-14_wp      !! share of liquid or gas that does not move
  real(wp), parameter :: min_open = 1.0e-6_wp     !! open share of a cut cell that has a plane

  type :: liquid_sweep_t
    type(vertical_t) :: vertical
    real(wp) :: incoming(2, 3) = 0.0_wp       !! liquid share of what enters through a side
    real(wp) :: level = absent                !! an inflow brings liquid below it [m]
    real(wp) :: clamped = 0.0_wp
      !! largest change by the round-off guard of a slab in the step, of this process [V]
    real(wp), allocatable :: out_low(:, :, :), out_high(:, :, :)
      !! liquid that leaves a cell by its lower and its upper face [m3]
    type(cut_cell_t), allocatable :: cut(:)   !! one per thread, from 0
  end type liquid_sweep_t

contains

  !> Allocate the work arrays once.
  subroutine liquid_sweep_init(grid, gravity, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    type(liquid_sweep_t), intent(out) :: self
    integer :: a(3), b(3), t

    a = grid%first
    b = grid%last
    self%vertical = vertical_of(gravity)
    allocate (self%out_low(a(1):b(1), a(2):b(2), a(3):b(3)), source=0.0_wp)
    allocate (self%out_high, source=self%out_low)
    allocate (self%cut(0:omp_get_max_threads() - 1))
    do t = 0, size(self%cut) - 1
      call cut_cell_init(self%cut(t))
    end do
  end subroutine liquid_sweep_init

  !> Move liquid and open volume in direction d; `g(:,:,:,d)` is new, w, v and c are updated.
  subroutine sweep_volumes(grid, old, d, volumes, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old   !! bodies at the begin of the step
    integer, intent(in) :: d
    type(carried_volumes_t), intent(inout) :: volumes
    type(liquid_sweep_t), intent(inout) :: self
    integer :: i, j, k, e(3), s, a(3), b(3)
    integer, allocatable :: mixed(:, :)   ! (3, *) cells whose planes are needed
    real(wp), allocatable :: spare(:, :, :)
    real(wp) :: share

    ! Liquid that leaves each cell if it were well mixed; right for pure cells, bit by bit. Rests at
    ! round-off of liquid in gas or of gas in liquid stay where they are instead of spreading.
    e = unit_step(:, d)
    !$omp parallel do private(i, j, share) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          share = volumes%w(i, j, k)/merge(volumes%v(i, j, k), 1.0_wp, volumes%v(i, j, k) > 0.0_wp)
          if (share < immobile) share = 0.0_wp
          if (share > 1.0_wp - immobile) share = 1.0_wp
          self%out_low(i, j, k) = max(-volumes%q(i, j, k, d), 0.0_wp)*share
          self%out_high(i, j, k) = max(volumes%q(i + e(1), j + e(2), k + e(3), d), 0.0_wp)*share
        end do
      end do
    end do
    call list_mixed_cells(grid, d, volumes, mixed)
    call plane_outflow(grid, old, d, mixed, volumes, self)
    call halo_exchange(self%out_low, n_halo, d)
    call halo_exchange(self%out_high, n_halo, d)
    ! Liquid that comes in through the sides of the domain, as outflow of the halo cell behind them.
    e = unit_step(:, d)
    do s = 1, 2
      call grid%side_faces(s, d, a, b)
      do k = a(3), b(3)
        do j = a(2), b(2)
          do i = a(1), b(1)
            if (s == 1) then
              self%out_high(i - e(1), j - e(2), k - e(3)) = max(volumes%q(i, j, k, d), 0.0_wp) &
                *incoming_share(grid, volumes%c, self, s, d, [i, j, k])
            else
              self%out_low(i, j, k) = max(-volumes%q(i, j, k, d), 0.0_wp) &
                *incoming_share(grid, volumes%c, self, s, d, [i, j, k] - e)
            end if
          end do
        end do
      end do
    end do
    call move_alloc(volumes%w_before, spare)   ! change places
    call move_alloc(volumes%w, volumes%w_before)
    call move_alloc(spare, volumes%w)
    call move_alloc(volumes%v_before, spare)
    call move_alloc(volumes%v, volumes%v_before)
    call move_alloc(spare, volumes%v)
    call move_volumes(grid, old, d, self, volumes)
    call fill_scalar_halo(grid, volumes%v)
    call fill_scalar_halo(grid, volumes%c)
  end subroutine sweep_volumes

  !> Cells with liquid and gas that give volume in direction d, in the order of the grid.
  subroutine list_mixed_cells(grid, d, volumes, cell)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: d
    type(carried_volumes_t), intent(in) :: volumes
    integer, allocatable, intent(out) :: cell(:, :)       !! (3, *)
    integer :: in_plane(grid%lo(3):grid%hi(3) + 1)   ! such cells below a plane of cells
    integer :: i, j, k, n

    in_plane = 0
    !$omp parallel do private(i, j) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          if (needs_plane(i, j, k)) in_plane(k + 1) = in_plane(k + 1) + 1
        end do
      end do
    end do
    do k = grid%lo(3), grid%hi(3)
      in_plane(k + 1) = in_plane(k + 1) + in_plane(k)
    end do
    allocate (cell(3, in_plane(grid%hi(3) + 1)))
    !$omp parallel do private(i, j, n) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      n = in_plane(k)
      if (in_plane(k + 1) == n) cycle
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          if (.not. needs_plane(i, j, k)) cycle
          n = n + 1
          cell(:, n) = [i, j, k]
        end do
      end do
    end do
  contains
    pure logical function needs_plane(i, j, k)
      integer, intent(in) :: i, j, k
      integer :: f(3)
      real(wp) :: w, v

      needs_plane = .false.
      w = volumes%w(i, j, k)
      v = volumes%v(i, j, k)
      if (w <= 0.0_wp .or. w >= v) return
      if (w <= nearly_pure*v .or. v - w <= nearly_pure*v) return
      f = [i, j, k] + unit_step(:, d)
      needs_plane = volumes%q(i, j, k, d) < 0.0_wp .or. volumes%q(f(1), f(2), f(3), d) > 0.0_wp
    end function needs_plane
  end subroutine list_mixed_cells

  !> Liquid that leaves the mixed cells, by their planes.
  subroutine plane_outflow(grid, old, d, mixed, volumes, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old
    integer, intent(in) :: d
    integer, intent(in) :: mixed(:, :)   !! (3, *) those cells
    type(carried_volumes_t), intent(in) :: volumes
    type(liquid_sweep_t), intent(inout) :: self
    integer :: l, i, j, k, f(3), s
    real(wp) :: m(3), w, v, out(2), liquid(2), clamped, largest, a, w_left, v_left, before

    largest = 0.0_wp
    !$omp parallel do private(i, j, k, f, m, w, v, out, liquid, clamped, w_left, v_left, before, &
    !$omp a, s) reduction(max: largest) schedule(dynamic, 16)
    do l = 1, size(mixed, 2)
      i = mixed(1, l)
      j = mixed(2, l)
      k = mixed(3, l)
      f = [i, j, k] + unit_step(:, d)
      w = volumes%w(i, j, k)
      v = volumes%v(i, j, k)
      out = [max(-volumes%q(i, j, k, d), 0.0_wp), max(volumes%q(f(1), f(2), f(3), d), 0.0_wp)]
      m = surface_normal(grid, old, self%vertical, volumes%c, i, j, k)
      if (old%cut(i, j, k) == 0) then
        ! Liquid in the slabs beside the two faces of a cell without solid [share of the cell].
        a = unit_constant(m, w/v)
        liquid(1) = unit_slab(m, a, d, 1, out(1)/v)
        liquid(2) = unit_slab(m, a, d, 2, out(2)/v)
        liquid = v*liquid
      else
        associate (cut => self%cut(omp_get_thread_num()))
          call load_cut_cell(old, old%cut(i, j, k), grid%face([i, j, k], [1, 2, 3]), grid%h, cut)
          call slabs_of_cut_cell(m, w/v, d, out/v, cut, liquid)
        end associate
        liquid = v*liquid
      end if
      ! Keep the liquid of both slabs within what there is of liquid and of gas: round-off only.
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
      largest = max(largest, clamped)
      self%out_low(i, j, k) = liquid(1)
      self%out_high(i, j, k) = liquid(2)
    end do
    self%clamped = max(self%clamped, largest/grid%volume)
  end subroutine plane_outflow

  !> The same for a cut cell, all in shares of its open part.
  subroutine slabs_of_cut_cell(m, share, d, out, cut, liquid)
    real(wp), intent(in) :: m(3), share
    integer, intent(in) :: d
    real(wp), intent(in) :: out(2)
    type(cut_cell_t), intent(inout) :: cut
    real(wp), intent(out) :: liquid(2)
    real(wp) :: a, limit, part, axis(3)

    liquid = out*share
    if (cut%open < min_open) return
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

  !> Liquid share of what enters through side s of direction d into a cell: an inflow brings liquid
  !! below its level, through an outflow comes back what stands there.
  pure function incoming_share(grid, c, self, s, d, at) result(share)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
      !! C^
    type(liquid_sweep_t), intent(in) :: self
    integer, intent(in) :: s, d, at(3)
    real(wp) :: share
    integer :: axis
    real(wp) :: bounds(2)   ! of the face along the vertical

    share = self%incoming(s, d)
    if (grid%side(s, d) == side_outflow) share = c(at(1), at(2), at(3))
    if (grid%side(s, d) /= side_inflow .or. .not. is_given(self%level)) return
    axis = maxloc(abs(self%vertical%up), 1)
    bounds = grid%face(at(axis) + [0, 1], axis)
    if (axis == d) bounds = bounds(s)
    if (self%vertical%up(axis) > 0.0_wp) then
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

  !> Liquid volumes of the faces, and the new running values; W and Vt go through the same
  !! operations.
  subroutine move_volumes(grid, old, d, self, volumes)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old
    integer, intent(in) :: d
    type(liquid_sweep_t), intent(in) :: self
    type(carried_volumes_t), intent(inout) :: volumes
    integer :: i, j, k, e(3)

    e = unit_step(:, d)
    !$omp parallel do private(i, j) schedule(static)
    do k = grid%lo(3), grid%hi(3) + e(3)
      do j = grid%lo(2), grid%hi(2) + e(2)
        do i = grid%lo(1), grid%hi(1) + e(1)
          volumes%g(i, j, k, d) = self%out_high(i - e(1), j - e(2), k - e(3)) &
                                  - self%out_low(i, j, k)
        end do
      end do
    end do
    !$omp parallel do private(i, j) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          volumes%w(i, j, k) = &
            after_exchange(volumes%w_before(i, j, k), volumes%g(i, j, k, d), &
                           volumes%g(i + e(1), j + e(2), k + e(3), d))
          volumes%v(i, j, k) = &
            after_exchange(volumes%v_before(i, j, k), volumes%q(i, j, k, d), &
                           volumes%q(i + e(1), j + e(2), k + e(3), d))
          if (old%alpha(i, j, k) <= 0.0_wp) then
            volumes%c(i, j, k) = share_of(volumes%w(i, j, k), volumes%v(i, j, k))
          end if
        end do
      end do
    end do
  end subroutine move_volumes

  !> A volume less what leaves it, then with what enters through its lower and its upper face.
  pure function after_exchange(volume, low, high) result(left)
    real(wp), intent(in) :: volume, low, high   !! fluxes positive along the axis
    real(wp) :: left

    left = ((volume - max(-low, 0.0_wp)) - max(high, 0.0_wp)) &
           + (max(low, 0.0_wp) + max(-high, 0.0_wp))
  end function after_exchange

end module liquid_sweep_m
