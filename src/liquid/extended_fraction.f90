!> The liquid share C^ of every full cell: below the liquid's plane, bodies thought away.
!!
!! W/Vt is the share of the open part only; density, gravity and normals need that of the whole
!! cell. A cell without solid has C^ = W/Vt. A cut cell takes the value of its row, spread sideways
!! through open faces, if the plane of that value holds just the liquid of the cell, and else the
!! share below its own plane. Cells almost or fully solid take the mean of their row. Nothing passes
!! closed faces. So level water keeps one and the same value in each row, whatever bodies stand in
!! it.
module extended_fraction_m
  use omp_lib, only: omp_get_max_threads, omp_get_thread_num
  use kinds_m, only: wp, i8
  use growing_m, only: ensure_capacity
  use grid_m, only: grid_t, n_halo, unit_step
  use fields_m, only: flow_t
  use boundary_m, only: fill_scalar_halo
  use solid_geometry_m, only: solid_geometry_t
  use plic_m, only: unit_volume, unit_constant
  use cut_cell_m, only: cut_cell_t, cut_cell_init, load_cut_cell, open_below, open_constant
  use surface_normal_m, only: vertical_t, vertical_of, surface_normal, passable
  use parallel_m, only: halo_exchange, global_sum
  implicit none
  private
  public :: extended_fraction_t, extended_fraction_init, extend_fraction, liquid_share, nearly_pure

  real(wp), parameter :: unknown = -1.0_wp           !! C^ not found yet
  real(wp), parameter :: min_open_volume = 0.02_wp !! open share of a cell with a value of its own
  !> Liquid that the row's value may miss [V]: more than the divergence left by the pressure solve
  !! moves in many steps (1e-8 in a step at the default tolerance), far less than shows.
  real(wp), parameter :: same_liquid = 1.0e-6_wp
  real(wp), parameter :: nearly_pure = 1.0e-8_wp     !! share of gas or liquid that has no plane
  integer, parameter :: plane_passes = 2             !! their normals depend on each other
  integer, parameter :: worth_threads = 500          !! fewer cells are looked at by one thread

  type :: extended_fraction_t
    type(vertical_t) :: vertical
    integer :: n = 0                        !! cells with solid on this process
    integer, allocatable :: cell(:, :)      !! (3, *) those cells
    integer, allocatable :: open_list(:)    !! cells still without a value
    logical, allocatable :: has_plane(:)    !! (*) cut cell that keeps the share below its own plane
    real(wp), allocatable :: value(:)       !! (*)
    type(cut_cell_t), allocatable :: cut(:) !! one per thread, from 0
  end type extended_fraction_t

contains

  !> The vertical is the main axis of gravity.
  subroutine extended_fraction_init(gravity, self)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    type(extended_fraction_t), intent(out) :: self
    integer :: t

    self%vertical = vertical_of(gravity)
    allocate (self%cut(0:omp_get_max_threads() - 1))
    do t = 0, size(self%cut) - 1
      call cut_cell_init(self%cut(t))
    end do
  end subroutine extended_fraction_init

  !> Liquid share of the open part of a cell.
  elemental function liquid_share(liquid, fluid_volume) result(c)
    real(wp), intent(in) :: liquid, fluid_volume   !! W and Vt [m3]
    real(wp) :: c

    c = 0.0_wp
    if (fluid_volume > 0.0_wp) c = min(max(liquid/fluid_volume, 0.0_wp), 1.0_wp)
  end function liquid_share

  !> C^ of all cells from the liquid and the fluid volume, halo filled.
  subroutine extend_fraction(grid, solid, self, flow)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid   !! of the same time as the liquid
    type(extended_fraction_t), intent(inout) :: self
    type(flow_t), intent(inout) :: flow
    integer :: pass, i, j, k, l, n

    ! C^ = W/Vt where there is no solid, unknown elsewhere.
    !$omp parallel do private(i, j) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          flow%c(i, j, k) = unknown
          if (solid%alpha(i, j, k) <= 0.0_wp) then
            flow%c(i, j, k) = liquid_share(flow%liquid(i, j, k), flow%fluid_volume(i, j, k))
          end if
        end do
      end do
    end do
    ! The cells of this process that hold solid; all of them still lack a value.
    n = 0
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          if (solid%alpha(i, j, k) <= 0.0_wp) cycle
          n = n + 1
          call ensure_capacity(n, self%cell)
          self%cell(:, n) = [i, j, k]
        end do
      end do
    end do
    self%n = n
    call ensure_capacity(n, self%open_list)
    call ensure_capacity(n, self%has_plane)
    call ensure_capacity(n, self%value)
    call spread_sideways(grid, solid, flow%liquid, flow%fluid_volume, self, flow%c)
    self%has_plane(1:self%n) = .true.
    do pass = 1, plane_passes
      call planes_of_cut_cells(grid, solid, flow%liquid, flow%fluid_volume, pass == 1, self, flow%c)
    end do
    ! Cells almost or fully solid lose their value again, to get that of the finished row.
    do l = 1, self%n
      associate (at => self%cell(:, l))
        if (nearly_solid(solid, at)) flow%c(at(1), at(2), at(3)) = unknown
      end associate
    end do
    call spread_sideways(grid, solid, flow%liquid, flow%fluid_volume, self, flow%c)
    call fill_scalar_halo(grid, flow%c)
  end subroutine extend_fraction

  !> Give cells without a value the mean of their neighbours in the row, ring by ring; where a whole
  !! row has none, one step up and down, and on along the row.
  subroutine spread_sideways(grid, solid, liquid, fluid_volume, self, c)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in), contiguous, dimension(grid%first(1):, grid%first(2):, grid%first(3):) :: &
      liquid, fluid_volume
    type(extended_fraction_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    integer :: left, l
    integer(i8) :: count(2)   ! values found in this pass, cells left
    logical :: sideways

    left = 0
    do l = 1, self%n
      associate (at => self%cell(:, l))
        if (c(at(1), at(2), at(3)) >= 0.0_wp) cycle
      end associate
      left = left + 1
      self%open_list(left) = l
    end do
    sideways = self%vertical%axis > 0
    do
      count(2) = int(left, i8)
      call halo_exchange(c, n_halo, layers=1)
      call spread_once(grid, solid, sideways, self, left, c)
      count(1) = count(2) - int(left, i8)
      count(2) = int(left, i8)
      call global_sum(count)
      if (count(2) == 0_i8) exit
      if (count(1) > 0_i8) then
        sideways = self%vertical%axis > 0
      else if (sideways) then
        sideways = .false.
      else
        exit
      end if
    end do
    do l = 1, left   ! sealed in: what the cell itself holds
      associate (at => self%cell(:, self%open_list(l)))
        c(at(1), at(2), at(3)) = liquid_share(liquid(at(1), at(2), at(3)), &
                                              fluid_volume(at(1), at(2), at(3)))
      end associate
    end do
    call halo_exchange(c, n_halo, layers=1)
  end subroutine spread_sideways

  !> One ring: new values only from values of before the pass. Cells that find one leave the list.
  subroutine spread_once(grid, solid, sideways, self, left, c)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    logical, intent(in) :: sideways   !! only within the row
    type(extended_fraction_t), intent(inout) :: self
    integer, intent(inout) :: left    !! cells in the list
    real(wp), intent(inout), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    integer :: l, kept, at(3)

    !$omp parallel do schedule(dynamic, 64) if (left > worth_threads)
    do l = 1, left
      self%value(self%open_list(l)) = mean_of_neighbours(self%cell(:, self%open_list(l)))
    end do
    kept = 0
    do l = 1, left
      at = self%cell(:, self%open_list(l))
      if (self%value(self%open_list(l)) >= 0.0_wp) then
        c(at(1), at(2), at(3)) = self%value(self%open_list(l))
      else
        kept = kept + 1
        self%open_list(kept) = self%open_list(l)
      end if
    end do
    left = kept
  contains
    !> Mean over the neighbours with a value, behind open faces; a full cell looks through its own
    !! faces. Equal values give just that value.
    pure function mean_of_neighbours(at) result(mean)
      integer, intent(in) :: at(3)
      real(wp) :: mean
      real(wp) :: first, sum, value
      integer :: d, s, n, nb(3), f(3)

      n = 0
      first = unknown
      sum = 0.0_wp
      do d = 1, 3
        if (sideways .and. d == self%vertical%axis) cycle
        do s = 0, 1
          f = at + s*unit_step(:, d)
          nb = at + (2*s - 1)*unit_step(:, d)
          if (grid%beyond(nb(d), d)) cycle
          value = c(nb(1), nb(2), nb(3))
          if (value < 0.0_wp) cycle
          if (solid%alpha(at(1), at(2), at(3)) < 1.0_wp .and. .not. &
              passable(solid%aperture(f(1), f(2), f(3), d))) cycle
          if (n == 0) first = value
          n = n + 1
          sum = sum + (value - first)
        end do
      end do
      mean = first
      if (n > 0) mean = first + sum/real(n, wp)
    end function mean_of_neighbours
  end subroutine spread_once

  !> Cut cells: accept the row's value, which stands in c, or put the share below the own plane
  !! there.
  subroutine planes_of_cut_cells(grid, solid, liquid, fluid_volume, may_accept, self, c)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in), contiguous, dimension(grid%first(1):, grid%first(2):, grid%first(3):) :: &
      liquid, fluid_volume
    logical, intent(in) :: may_accept   !! first pass; later only cells with an own plane take part
    type(extended_fraction_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    integer :: l, at(3)

    !$omp parallel do private(at) schedule(dynamic, 8)
    do l = 1, self%n
      at = self%cell(:, l)
      if (nearly_solid(solid, at)) self%has_plane(l) = .false.
      if (.not. self%has_plane(l)) cycle
      call share_of_cut_cell(grid, solid, liquid_share(liquid(at(1), at(2), at(3)), &
        fluid_volume(at(1), at(2), at(3))), may_accept, c, l, self)
    end do
    do l = 1, self%n
      at = self%cell(:, l)
      if (self%has_plane(l)) c(at(1), at(2), at(3)) = self%value(l)
    end do
    call halo_exchange(c, n_halo, layers=1)
  end subroutine planes_of_cut_cells

  !> Cell l of the list: is the row's value, which stands in c, good for it (then it has no plane),
  !! and which share lies below its own plane if not?
  subroutine share_of_cut_cell(grid, solid, share, may_accept, c, l, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: share         !! liquid share of its open part
    logical, intent(in) :: may_accept
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    integer, intent(in) :: l
    type(extended_fraction_t), intent(inout) :: self
    real(wp) :: m(3), a, held, open, row

    associate (at => self%cell(:, l), cut => self%cut(omp_get_thread_num()))
      self%value(l) = share
      row = c(at(1), at(2), at(3))
      open = 1.0_wp - solid%alpha(at(1), at(2), at(3))
      if (may_accept .and. ((row <= same_liquid .and. share*open <= same_liquid) .or. &
          (row >= 1.0_wp - same_liquid .and. (1.0_wp - share)*open <= same_liquid))) then
        self%has_plane(l) = .false.
        return
      end if
      if (row <= same_liquid .or. row >= 1.0_wp - same_liquid) then
        if (share <= nearly_pure .or. share >= 1.0_wp - nearly_pure) return
      end if
      m = surface_normal(grid, solid, self%vertical, c, at(1), at(2), at(3))
      call load_cut_cell(solid, solid%cut(at(1), at(2), at(3)), grid%face(at, [1, 2, 3]), grid%h, &
                         cut)
      if (may_accept .and. row > 0.0_wp .and. row < 1.0_wp) then
        call open_below(cut, m, unit_constant(m, row), held)
        self%has_plane(l) = .not. abs(held - share*cut%open) <= same_liquid
        if (.not. self%has_plane(l)) return
      end if
      if (share <= nearly_pure .or. share >= 1.0_wp - nearly_pure) return
      call open_constant(cut, m, share*cut%open, a)
      self%value(l) = unit_volume(m, a)
    end associate
  end subroutine share_of_cut_cell

  !> Has this cell too little open space for a value of its own?
  pure function nearly_solid(solid, at) result(yes)
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: at(3)
    logical :: yes

    yes = 1.0_wp - solid%alpha(at(1), at(2), at(3)) <= min_open_volume
  end function nearly_solid

end module extended_fraction_m
