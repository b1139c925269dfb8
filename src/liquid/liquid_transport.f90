!> Transport of the liquid with exact volumes around moving bodies.
!!
!! Carried per cell: the liquid W and the open volume Vt. The volumes Q through the faces fit the
!! moving bodies exactly (`open_flux_m`), so W and Vt go through the same balance, direction by
!! direction (`liquid_sweep_m`): 0 <= W <= Vt holds without clipping and nothing is redistributed.
!! Small cells receive in the sweeps and give afterwards (`small_cells_m`).
!!
!! Momentum rides on the same volumes: after `sweep_volumes`, `q(:,:,:,d)` and `g(:,:,:,d)` of
!! `volumes` hold what has just moved; after `small_cells` the faces behind small donors do. Source
!! and trial of the scheme: docs/theory.md. Departure from the paper: it moves the mixture and knows
!! no open volume.
module liquid_transport_m
  use kinds_m, only: wp
  use grid_m, only: grid_t
  use fields_m, only: flow_t
  use boundary_m, only: fill_scalar_halo
  use solid_geometry_m, only: solid_geometry_t
  use carried_volumes_m, only: carried_volumes_t, carried_volumes_init
  use elliptic_solver_m, only: elliptic_solver_t
  use narrow_band_m, only: narrow_band_init
  use open_flux_m, only: open_flux_t, flux_of_velocity, fit_to_bodies
  use liquid_sweep_m, only: liquid_sweep_t, liquid_sweep_init
  use small_cells_m, only: small_cells_t, small_cells_init, find_small_cells, give_small_cells, &
                           renew_shares
  use extended_fraction_m, only: extended_fraction_t, extended_fraction_init, extend_fraction
  use exact_sum_m, only: exact_sum
  implicit none
  private
  public :: liquid_transport_t, liquid_transport_init
  public :: begin_transport, begin_subcycle, small_cells, finish_transport

  !> The six orders of the directions.
  integer, parameter :: orders(3, 6) = reshape([1, 2, 3, 2, 3, 1, 3, 1, 2, 3, 2, 1, 1, 3, 2, &
                                             2, 1, 3], [3, 6])

  type :: liquid_transport_t
    type(open_flux_t) :: flux
    type(carried_volumes_t) :: volumes
    type(liquid_sweep_t) :: sweeps
    type(small_cells_t) :: small
    type(extended_fraction_t) :: extension
    integer :: subcycles = 1                 !! equal subcycles in which the volumes of a step move;
                                              !! the caller sets it before the step
    integer :: order(3) = 0                   !! directions of the sweeps of this subcycle
    real(wp) :: inflow = 0.0_wp               !! of liquid through the sides in this step [m3]
    real(wp), allocatable :: side(:)          !! work: liquid through the faces of the sides [m3]
  end type liquid_transport_t

contains

  !> Allocate the work arrays once.
  subroutine liquid_transport_init(grid, gravity, self, pooled)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    type(liquid_transport_t), intent(out) :: self
    logical, intent(in), optional :: pooled   !! arrays over the cells come from `scratch_m` later
    integer :: m(3)

    call narrow_band_init(grid, self%flux%band)
    if (.not. present(pooled)) call carried_volumes_init(grid, self%volumes)
    call liquid_sweep_init(grid, gravity, self%sweeps)
    call small_cells_init(grid, self%small)
    call extended_fraction_init(gravity, self%extension)
    m = grid%hi - grid%lo + 1
    allocate (self%side(2*(m(1)*m(2) + m(2)*m(3) + m(3)*m(1))), source=0.0_wp)
  end subroutine liquid_transport_init

  !> Stage 6: the volumes through the faces in a subcycle, made to fit the moving bodies; running
  !! values.
  subroutine begin_transport(grid, old, new, dt, solver, self, flow)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old, new   !! at the start and the end of the step
    real(wp), intent(in) :: dt   !! [s]
    type(elliptic_solver_t), intent(inout) :: solver   !! of the volume balances; keeps nothing
    type(liquid_transport_t), intent(inout) :: self
    type(flow_t), intent(in) :: flow   !! liquid, fluid volume, c (halo filled) and uf of the begin
    integer :: k

    call flux_of_velocity(grid, old, new, flow%uf, dt, self%volumes%q)
    call fit_to_bodies(grid, old, new, flow%fluid_volume, solver, self%flux, self%volumes%q)
    !$omp parallel do schedule(static)
    do k = grid%first(3), grid%last(3)
      self%volumes%w(:, :, k) = flow%liquid(:, :, k)
      self%volumes%v(:, :, k) = flow%fluid_volume(:, :, k)
      self%volumes%c(:, :, k) = flow%c(:, :, k)
      if (self%subcycles > 1) self%volumes%q(:, :, k, :) = self%volumes%q(:, :, k, :) &
                                                       /real(self%subcycles, wp)
    end do
    self%sweeps%clamped = 0.0_wp
    self%small%converged = .true.
    self%inflow = 0.0_wp
  end subroutine begin_transport

  !> The order of the directions and the small cells of a subcycle, an equal part of the step.
  !!
  !! Where the fluid moves further than the sweeps can follow, the same volumes go in several
  !! subcycles. The open volume of a cell then runs in equal steps too, so the last subcycle ends at
  !! that of the new geometry whatever their number.
  subroutine begin_subcycle(grid, old, subcycle, step, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old
    integer, intent(in) :: subcycle   !! 1..subcycles
    integer, intent(in) :: step   !! number of the step; both pick the order of the directions
    type(liquid_transport_t), intent(inout) :: self

    self%order = orders(:, 1 + modulo(step + subcycle - 1, size(orders, 2)))
    if (subcycle > 1) call renew_shares(grid, old, self%small, self%volumes)
    call find_small_cells(grid, old, self%volumes, self%small)
  end subroutine begin_subcycle

  !> The small cells give: the volumes are final for this subcycle.
  subroutine small_cells(grid, self)
    type(grid_t), intent(in) :: grid
    type(liquid_transport_t), intent(inout) :: self
    real(wp) :: inflow, way
    integer :: d, s, i, j, k, n, a(3), b(3)

    call give_small_cells(grid, self%volumes, self%small, self%sweeps%out_low)   ! free by now
    ! Liquid that came in through the sides of the domain in this subcycle [m3].
    n = 0
    do d = 1, 3
      do s = 1, 2
        call grid%side_faces(s, d, a, b)
        way = merge(1.0_wp, -1.0_wp, s == 1)
        do k = a(3), b(3)
          do j = a(2), b(2)
            do i = a(1), b(1)
              n = n + 1
              self%side(n) = way*self%volumes%g(i, j, k, d)
            end do
          end do
        end do
      end do
    end do
    inflow = exact_sum(self%side(1:n))
    self%inflow = self%inflow + inflow
  end subroutine small_cells

  !> New liquid, fluid volume and C^; liquid through the sides; statistics.
  subroutine finish_transport(grid, new, self, flow)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: new   !! bodies at the end of the step
    type(liquid_transport_t), intent(inout) :: self
    type(flow_t), intent(inout) :: flow
    integer :: k

    !$omp parallel do schedule(static)
    do k = grid%first(3), grid%last(3)
      flow%liquid(:, :, k) = self%volumes%w(:, :, k)
      flow%fluid_volume(:, :, k) = self%volumes%v(:, :, k)
      flow%c(:, :, k) = self%volumes%c(:, :, k)
    end do
    call fill_scalar_halo(grid, flow%liquid)
    call fill_scalar_halo(grid, flow%fluid_volume)
    call extend_fraction(grid, new, self%extension, flow)
    flow%liquid_inflow = flow%liquid_inflow + self%inflow
  end subroutine finish_transport

end module liquid_transport_m
