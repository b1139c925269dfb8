!> The liquid share C^ of every full cell: below the liquid's plane, bodies thought away.
!!
!! W/Vt is the share of the open part only; density, gravity and normals need that of the whole
!! cell. A cell without solid has C^ = W/Vt. A cut cell takes the value of its row, spread sideways
!! through open faces, if the plane of that value holds just the liquid of the cell, and else the
!! share below its own plane. Cells almost or fully solid take the mean of their row. Nothing passes
!! closed faces but into cells without an open side: full ones, and notches open to the top, whose
!! value would else be that of the row above. So level water keeps one and the same value in each
!! row, whatever bodies stand in it.
module extended_fraction_m
  use omp_lib, only: omp_get_max_threads, omp_get_thread_num
  use kinds_m, only: wp, i8
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
    integer, allocatable :: cell(:, :)       ! (3, *) of this process that hold solid
    logical, allocatable :: has_plane(:)     ! (*) cut cell that keeps the share below its own plane
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
    associate (a => grid%lo, b => grid%hi)
      n = count(solid%alpha(a(1):b(1), a(2):b(2), a(3):b(3)) > 0.0_wp)
    end associate
    allocate (cell(3, n))
    n = 0
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          if (solid%alpha(i, j, k) <= 0.0_wp) cycle
          n = n + 1
          cell(:, n) = [i, j, k]
        end do
      end do
    end do
    call spread_sideways(grid, solid, self%vertical%axis, cell, flow)
    allocate (has_plane(n), source=.true.)
    do pass = 1, plane_passes
      call planes_of_cut_cells(grid, solid, cell, pass == 1, self, has_plane, flow)
    end do
    ! Cells almost or fully solid lose their value again, to get that of the finished row.
    do l = 1, n
      associate (at => cell(:, l))
        if (nearly_solid(solid, at)) flow%c(at(1), at(2), at(3)) = unknown
      end associate
    end do
    call spread_sideways(grid, solid, self%vertical%axis, cell, flow)
    call fill_scalar_halo(grid, flow%c)
  end subroutine extend_fraction

  !> Give cells without a value the mean of their neighbours in the row, ring by ring; where a whole
  !! row has none, one step up and down, and on along the row.
  subroutine spread_sideways(grid, solid, axis, cell, flow)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: axis         !! the vertical, 0: there is none
    integer, intent(in) :: cell(:, :)   !! (3, *) with solid
    type(flow_t), intent(inout) :: flow
    integer :: open_list(size(cell, 2))   ! cells still without a value
    integer :: left, l
    integer(i8) :: count(2)   ! values found in this pass, cells left
    logical :: sideways

    left = 0
    do l = 1, size(cell, 2)
      associate (at => cell(:, l))
        if (flow%c(at(1), at(2), at(3)) >= 0.0_wp) cycle
      end associate
      left = left + 1
      open_list(left) = l
    end do
    sideways = axis > 0
    do
      count(2) = int(left, i8)
      call halo_exchange(flow%c, n_halo, layers=1)
      call spread_once(grid, solid, merge(axis, 0, sideways), cell, open_list, left, flow%c)
      count(1) = count(2) - int(left, i8)
      count(2) = int(left, i8)
      call global_sum(count)
      if (count(2) == 0_i8) exit
      if (count(1) > 0_i8) then
        sideways = axis > 0
      else if (sideways) then
        sideways = .false.
      else
        exit
      end if
    end do
    do l = 1, left   ! sealed in: what the cell itself holds
      associate (at => cell(:, open_list(l)))
        flow%c(at(1), at(2), at(3)) = liquid_share(flow%liquid(at(1), at(2), at(3)), &
                                                   flow%fluid_volume(at(1), at(2), at(3)))
      end associate
    end do
    call halo_exchange(flow%c, n_halo, layers=1)
  end subroutine spread_sideways

  !> One ring: new values only from values of before the pass. Cells that find one leave the list.
  subroutine spread_once(grid, solid, across, cell, open_list, left, c)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: across            !! direction that is not looked along; 0: all are
    integer, intent(in) :: cell(:, :)        !! (3, *)
    integer, intent(inout) :: open_list(:)   !! numbers of those without a value
    integer, intent(inout) :: left           !! of them in the list
    real(wp), intent(inout), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp) :: value(left)
    integer :: l, kept, at(3)

    !$omp parallel do schedule(dynamic, 64) if (left > worth_threads)
    do l = 1, left
      value(l) = mean_of_neighbours(cell(:, open_list(l)))
    end do
    kept = 0
    do l = 1, left
      at = cell(:, open_list(l))
      if (value(l) >= 0.0_wp) then
        c(at(1), at(2), at(3)) = value(l)
      else
        kept = kept + 1
        open_list(kept) = open_list(l)
      end if
    end do
    left = kept
  contains
    !> Mean over the neighbours with a value, behind open faces, or behind any for a full cell and
    !! for a notch, all of whose open faces lie across. Equal values give just that value.
    pure function mean_of_neighbours(at) result(mean)
      integer, intent(in) :: at(3)
      real(wp) :: mean
      real(wp) :: first, sum, value
      integer :: d, s, n, nb(3), f(3)
      logical :: is_open(0:1, 3), through

      do d = 1, 3
        do s = 0, 1
          f = at + s*unit_step(:, d)
          is_open(s, d) = passable(solid%aperture(f(1), f(2), f(3), d))
        end do
      end do
      through = solid%alpha(at(1), at(2), at(3)) >= 1.0_wp
      if (across > 0) through = through .or. (any(is_open) .and. count(is_open) &
        == count(is_open(:, across)))
      n = 0
      first = unknown
      sum = 0.0_wp
      do d = 1, 3
        if (d == across) cycle
        do s = 0, 1
          nb = at + (2*s - 1)*unit_step(:, d)
          if (grid%beyond(nb(d), d)) cycle
          value = c(nb(1), nb(2), nb(3))
          if (value < 0.0_wp .or. (.not. through .and. .not. is_open(s, d))) cycle
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
  subroutine planes_of_cut_cells(grid, solid, cell, may_accept, self, has_plane, flow)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: cell(:, :)   !! (3, *) with solid
    logical, intent(in) :: may_accept   !! first pass; later only cells with an own plane take part
    type(extended_fraction_t), intent(inout) :: self
    logical, intent(inout) :: has_plane(:)
    type(flow_t), intent(inout) :: flow
    real(wp) :: value(size(cell, 2))
    integer :: l, at(3)

    !$omp parallel do private(at) schedule(dynamic, 8)
    do l = 1, size(cell, 2)
      at = cell(:, l)
      if (nearly_solid(solid, at)) has_plane(l) = .false.
      if (has_plane(l)) call share_of_cut_cell(at, liquid_share(flow%liquid(at(1), at(2), at(3)), &
        flow%fluid_volume(at(1), at(2), at(3))), has_plane(l), value(l))
    end do
    do l = 1, size(cell, 2)
      at = cell(:, l)
      if (has_plane(l)) flow%c(at(1), at(2), at(3)) = value(l)
    end do
    call halo_exchange(flow%c, n_halo, layers=1)
  contains
    !> Is the row's value, which stands in c, good for a cell (then it has no plane), and which
    !! share lies below its own plane if not?
    subroutine share_of_cut_cell(at, share, has_plane, value)
      integer, intent(in) :: at(3)
      real(wp), intent(in) :: share   !! liquid share of its open part
      logical, intent(inout) :: has_plane
      real(wp), intent(out) :: value
      real(wp) :: m(3), a, held, open, row

      value = share
      row = flow%c(at(1), at(2), at(3))
      open = 1.0_wp - solid%alpha(at(1), at(2), at(3))
      if (may_accept .and. ((row <= same_liquid .and. share*open <= same_liquid) .or. &
          (row >= 1.0_wp - same_liquid .and. (1.0_wp - share)*open <= same_liquid))) then
        has_plane = .false.
        return
      end if
      if (row <= same_liquid .or. row >= 1.0_wp - same_liquid) then
        if (share <= nearly_pure .or. share >= 1.0_wp - nearly_pure) return
      end if
      m = surface_normal(grid, solid, self%vertical, flow%c, at(1), at(2), at(3))
      associate (cut => self%cut(omp_get_thread_num()))
        call load_cut_cell(solid, solid%cut(at(1), at(2), at(3)), grid%face(at, [1, 2, 3]), &
                           grid%h, cut)
        if (may_accept .and. row > 0.0_wp .and. row < 1.0_wp) then
          call open_below(cut, m, unit_constant(m, row), held)
          has_plane = .not. abs(held - share*cut%open) <= same_liquid
          if (.not. has_plane) return
        end if
        if (share <= nearly_pure .or. share >= 1.0_wp - nearly_pure) return
        call open_constant(cut, m, share*cut%open, a)
        value = unit_volume(m, a)
      end associate
    end subroutine share_of_cut_cell
  end subroutine planes_of_cut_cells

  !> Has this cell too little open space for a value of its own?
  pure function nearly_solid(solid, at) result(yes)
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: at(3)
    logical :: yes

    yes = 1.0_wp - solid%alpha(at(1), at(2), at(3)) <= min_open_volume
  end function nearly_solid

end module extended_fraction_m
