!> Pressure of the cells that take no part in the solve.
module pressure_extension_m
  use kinds_m, only: wp, i8
  use grid_m, only: grid_t, n_halo, unit_step
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use rigid_flux_m, only: closed_side
  use cell_list_m, only: list_marked
  use boundary_m, only: fill_scalar_halo
  use mixture_m, only: face_mean
  use pressure_m, only: pressure_t
  use parallel_m, only: global_sum, halo_exchange
  implicit none
  private
  public :: extend_pressure

contains

  !> Pressure of cells without open faces, for the cells that will open, for looking, and for the
  !! force on blocks that touch there: mean of the known neighbours of the same height, and only
  !! where there are none, hydrostatic from above or below. So do films, cells with narrow faces
  !! only: kept as old pressure theirs would carry the block for ever, and contact get no weight.
  !!
  !! Cells that are nearly full of solid do not lend theirs while others can: what water is left
  !! between two faces that lie on one another may have any pressure, and it would push the blocks
  !! apart wherever they touch.
  subroutine extend_pressure(grid, gravity, solid, flow, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    type(solid_geometry_t), intent(in) :: solid
    type(flow_t), intent(inout) :: flow      !! its pressure
    type(pressure_t), intent(in) :: self
    real(wp), parameter :: full = 0.9_wp   ! solid share of a cell that does not lend its pressure
    real(wp), parameter :: film = 0.01_wp       ! aperture of all faces below which it is one
    integer, allocatable :: known(:, :, :)   ! since which pass; -1: not yet, 0: it lends none
    integer, allocatable :: cell(:, :)       ! (3, *) of those that take no part
    real(wp) :: weight(3)   ! along a period it is a plain force [m/s2]
    integer :: k, l, n, pass, round
    integer(i8) :: left(1)

    weight = merge(0.0_wp, gravity, grid%periodic)
    associate (a => grid%first, b => grid%last)
      allocate (known(a(1):b(1), a(2):b(2), a(3):b(3)))
    end associate
    !$omp parallel do schedule(static)
    do k = grid%first(3), grid%last(3)
      known(:, :, k) = merge(0, 1, self%system%active(:, :, k))
    end do
    do l = 1, solid%n_cut
      associate (c => solid%cut_cell(:, l))
        if (is_film(c)) known(c(1), c(2), c(3)) = 1
      end associate
    end do
    call list_marked(grid, grid%first, known, cell, n)
    !$omp parallel do schedule(static)
    do k = grid%first(3), grid%last(3)
      known(:, :, k) = merge(-1, merge(1, 0, solid%alpha(:, :, k) <= full), known(:, :, k) > 0)
    end do
    pass = 1
    do round = 1, 3   ! sideways; from above and below; from cells that are nearly full
      if (round == 3) where (known == 0) known = 1
      do
        call halo_exchange(flow%p, n_halo, layers=1)
        call halo_exchange(known, n_halo, layers=1)
        pass = pass + 1
        left = 0_i8
        do l = 1, n
          if (known(cell(1, l), cell(2, l), cell(3, l)) < 0) call from_neighbours(cell(:, l))
        end do
        call global_sum(left)
        if (left(1) == 0_i8) exit
      end do
    end do
    call fill_scalar_halo(grid, flow%p, layers=1)
  contains
    !> Are all faces of cut cell c through which fluid can move narrow?
    pure logical function is_film(c)
      integer, intent(in) :: c(3)
      integer :: d, f(3)

      is_film = all(c < grid%last)
      do d = 1, 3
        if (.not. is_film) return
        f = c + unit_step(:, d)
        associate (w => solid%aperture)
          is_film = (closed_side(grid, c(d), d) .or. w(c(1), c(2), c(3), d) < film) .and. &
                    (closed_side(grid, f(d), d) .or. w(f(1), f(2), f(3), d) < film)
        end associate
      end do
    end function is_film

    !> Mean over the neighbours known before this pass.
    subroutine from_neighbours(c)
      integer, intent(in) :: c(3)
      integer :: d, s, o(3), count
      real(wp) :: total

      count = 0
      total = 0.0_wp
      do d = 1, 3
        if (round == 1 .and. abs(weight(d)) > 0.0_wp) cycle
        do s = -1, 1, 2
          o = c + s*unit_step(:, d)
          if (any((o < 1 .or. o > grid%n) .and. .not. grid%periodic)) cycle
          if (any(known(o(1), o(2), o(3)) == [-1, 0, pass])) cycle
          count = count + 1
          total = total + flow%p(o(1), o(2), o(3)) - real(s, wp)*weight(d)*grid%h(d) &
                  *face_mean(flow%rho(o(1), o(2), o(3)), flow%rho(c(1), c(2), c(3)))
        end do
      end do
      if (count == 0) return
      flow%p(c(1), c(2), c(3)) = total/real(count, wp)
      known(c(1), c(2), c(3)) = pass
      left = left + 1_i8
    end subroutine from_neighbours
  end subroutine extend_pressure

end module pressure_extension_m
