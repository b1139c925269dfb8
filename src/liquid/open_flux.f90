!> Volumes that flow through the open part of the faces in one step, made to fit the moving bodies.
!!
!! In every cell the outflow of a step must be the change of its open volume,
!! $$ \sum_f Q_f = V_t^n - V (1 - \alpha^{n+1}) $$
!! The flux of the projected velocity fits to the order of the step only. The rest r is taken away
!! by `Q_f := Q_f - k_f (phi_up - phi_low)` with `sum_f k_f (phi_c - phi_nb) = r_c` on the narrow
!! band of cells that a body cuts before or after the step and one ring around; k is the open area
!! in the mean of the step. What the r of a connected part of the band sum up to (rounding; the
!! volume that has nowhere to go in a sealed pocket; bodies that overlap) stays in its cells as an
!! equal share of their open volume, unless the part reaches an open side, where it may exchange.
!! With the carried volume Vt on the right the errors of one step are made good by the next.
!!
!! A block that lands moves other than the velocity that the last step ended with: contact stops
!! it. Where it stands on a wall or on another block without fluid between, the fluid that followed
!! it is too much for its band, and no flux within the band mends that. In such a step all cells of
!! the domain are the band: the excess leaves through an open side, or a closed box shares it out.
module open_flux_m
  use kinds_m, only: wp, i8
  use grid_m, only: grid_t, unit_step
  use boundary_kinds_m, only: is_wall, gives_pressure
  use solid_geometry_m, only: solid_geometry_t
  use narrow_band_m, only: narrow_band_t, find_parts, sum_by_part, drop_part, find_open_lines
  use growing_m, only: ensure_capacity
  use cell_list_m, only: list_marked
  use krylov_m, only: conjugate_gradient
  use elliptic_solver_m, only: elliptic_solver_t
  use solve_control_m, only: solve_control_t, solve_report_t
  use parallel_m, only: halo_exchange, global_max
  implicit none
  private
  public :: open_flux_t, flux_of_velocity, fit_to_bodies

  real(wp), parameter :: min_open = 1.0e-9_wp   !! mean open share below which a face is closed

  real(wp), parameter :: excess_max = 5.0e-7_wp
    !! of fluid that a part of the band may keep, over the cells beside it [open volumes]

  !> Of the volume balance of a cell [V].
  type(solve_control_t), parameter :: control = solve_control_t(tolerance=1.0e-12_wp, &
    max_iterations=200)

  type :: open_flux_t
    integer :: iterations = 0            !! of the last step
    real(wp) :: residual = 0.0_wp        !! largest rest in the band after the last step [V]
    real(wp) :: unmatched = 0.0_wp       !! largest mean left in a part of the band [V]
    type(narrow_band_t) :: band
  end type open_flux_t

contains

  !> Make the volumes Q through the lower faces, positive in the direction of the axis, faces
  !! lo..hi+1, fit the bodies: in each cell of the band their sum is the loss of fluid volume.
  subroutine fit_to_bodies(grid, old, new, fluid_volume, solver, self, q)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old, new   !! bodies before and after the step
    real(wp), intent(in), contiguous :: &
      fluid_volume(grid%first(1):, grid%first(2):, grid%first(3):)   !! carried [m3]
    type(elliptic_solver_t), intent(inout) :: solver   !! of the potential for the rests r [V]
    type(open_flux_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: q(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! those of the velocity on entry [m3]
    logical :: balanced
    type(solve_report_t) :: report   ! the next step makes good what is left
    integer :: d, e(3), i, j, k, l

    self%iterations = 0
    self%residual = 0.0_wp
    self%unmatched = 0.0_wp
    call find_band(grid, old, new, self%band)
    if (self%band%parts == 0) return
    call find_balances(grid, new, fluid_volume, q, self%band)
    call sum_by_part(grid, self%band)
    if (excess_stays(grid, fluid_volume, self%band)) then
      ! All cells of the domain are the band, in this step.
      self%band%poses = 0
      self%band%marked = 0
      self%band%marked(grid%lo(1):grid%hi(1), grid%lo(2):grid%hi(2), grid%lo(3):grid%hi(3)) = 1
      call halo_exchange(self%band%marked, 1)
      call find_conductances(grid, old%aperture, new%aperture, self%band)
      l = product(grid%hi - grid%lo + 1)   ! room for them and no more
      if (size(self%band%cell, 2) < l) then
        deallocate (self%band%cell, self%band%r, self%band%open)
        allocate (self%band%cell(3, l), self%band%r(l), self%band%open(l))
      end if
      call list_band(grid, self%band)
      call find_parts(grid, self%band)
      call find_balances(grid, new, fluid_volume, q, self%band)
      call sum_by_part(grid, self%band)
    end if
    call balance_parts(self, balanced)
    if (balanced) return
    ! Solve `sum_f k_f (phi_c - phi_nb) = r_c` on the band; the potential is zero elsewhere.
    !$omp parallel do schedule(static)
    do k = lbound(solver%rhs, 3), ubound(solver%rhs, 3)
      solver%rhs(:, :, k) = 0.0_wp
      solver%x(:, :, k) = 0.0_wp
    end do
    do l = 1, self%band%n
      associate (c => self%band%cell(:, l))
        solver%rhs(c(1), c(2), c(3)) = self%band%r(l)
      end associate
    end do
    call find_open_lines(self%band%k, self%band%line)
    solver%work%line = self%band%line
    solver%work%singular = .false.   ! parts without an open side have been balanced
    call solver%multigrid%setup(self%band%k)
    call conjugate_gradient(self%band, solver%multigrid, solver%rhs, solver%x, control, &
                            report, solver%work)
    call halo_exchange(solver%x, 1)
    self%iterations = report%iterations
    self%residual = report%residual
    ! Take the gradient of the potential from the volumes.
    do d = 1, 3
      e = unit_step(:, d)
      !$omp parallel do private(i, j) schedule(static)
      do k = grid%lo(3), grid%hi(3) + e(3)
        do j = grid%lo(2), grid%hi(2) + e(2)
          do i = grid%lo(1), grid%hi(1) + e(1)
            q(i, j, k, d) = q(i, j, k, d) - grid%volume*self%band%k(i, j, k, d) &
                            *(solver%x(i, j, k) - solver%x(i - e(1), j - e(2), k - e(3)))
          end do
        end do
      end do
    end do
  end subroutine fit_to_bodies

  !> The narrow band, its conductances and parts; no parts without solids. If the bodies are where
  !! they were in the last step only the conductances are found again, which stand in a work array.
  subroutine find_band(grid, old, new, band)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old, new
    type(narrow_band_t), intent(inout) :: band
    real(wp) :: cells(1), of_all(1)
    integer :: i, j, k, most

    if (all([old%poses, new%poses] > 0) .and. all(band%poses == [old%poses, new%poses])) then
      if (band%parts > 0) call find_conductances(grid, old%aperture, new%aperture, band)
      return
    end if
    band%poses = [old%poses, new%poses]
    band%parts = 0
    ! Mark the own cells with solid at the begin or the end of the step.
    most = 0
    !$omp parallel do private(i, j) reduction(max: most) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          band%marked(i, j, k) = merge(1, 0, old%alpha(i, j, k) > 0.0_wp &
                                       .or. new%alpha(i, j, k) > 0.0_wp)
          most = max(most, band%marked(i, j, k))
        end do
      end do
    end do
    of_all = real(most, wp)
    call global_max(of_all)
    if (of_all(1) <= 0.0_wp) return
    ! The marked cells and the ring around them.
    call halo_exchange(band%marked, 1)
    call widen(1, band%marked, band%label)
    call widen(2, band%label, band%number)
    call widen(3, band%number, band%marked)
    call halo_exchange(band%marked, 1)
    call find_conductances(grid, old%aperture, new%aperture, band)
    call list_band(grid, band)
    cells = real(band%n, wp)
    call global_max(cells)
    if (cells(1) > 0.5_wp) call find_parts(grid, band)
  end subroutine find_band

  !> Marks of cells and their neighbours in direction d. Called for the directions in their order,
  !! it treats own cells in those up to d, and the halo in those that follow.
  subroutine widen(d, mark, wide)
    integer, intent(in) :: d
    integer, intent(in), contiguous :: mark(:, :, :)      !! with one halo cell
    integer, intent(inout), contiguous :: wide(:, :, :)
    integer :: i, j, k, e(3), a(3), b(3)

    e = unit_step(:, d)
    a = 1
    b = shape(mark)
    a(1:d) = 2
    b(1:d) = b(1:d) - 1
    !$omp parallel do private(i, j) schedule(static)
    do k = a(3), b(3)
      do j = a(2), b(2)
        do i = a(1), b(1)
          wide(i, j, k) = max(mark(i, j, k), mark(i - e(1), j - e(2), k - e(3)), &
                              mark(i + e(1), j + e(2), k + e(3)))
        end do
      end do
    end do
  end subroutine widen

  !> Volumes of the velocity through the faces as they are at the begin of the step.
  subroutine flux_of_velocity(grid, old, new, uf, dt, q)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: old, new
    real(wp), intent(in), contiguous :: uf(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! of the open part [m/s]
    real(wp), intent(in) :: dt   !! [s]
    real(wp), intent(inout), contiguous :: q(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m3]
    integer :: d, s, i, j, k, a(3), b(3)
    real(wp) :: open_area

    do d = 1, 3
      open_area = dt*grid%area(d)
      a = grid%lo
      b = grid%hi + unit_step(:, d)
      !$omp parallel do private(i, j) schedule(static)
      do k = a(3), b(3)
        do j = a(2), b(2)
          do i = a(1), b(1)
            q(i, j, k, d) = merge(open_area*old%aperture(i, j, k, d)*uf(i, j, k, d), 0.0_wp, &
              0.5_wp*(old%aperture(i, j, k, d) + new%aperture(i, j, k, d)) >= min_open)
          end do
        end do
      end do
      do s = 1, 2
        if (.not. is_wall(grid%side(s, d))) cycle
        call grid%side_faces(s, d, a, b)
        q(a(1):b(1), a(2):b(2), a(3):b(3), d) = 0.0_wp
      end do
    end do
  end subroutine flux_of_velocity

  !> Conductances of the faces in the band: their open share in the mean of the step.
  subroutine find_conductances(grid, old_open, new_open, band)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), dimension(grid%first(1):, grid%first(2):, grid%first(3):, :), &
      contiguous :: old_open, new_open
    type(narrow_band_t), intent(inout) :: band
    integer :: d, s, a(3), b(3)

    do d = 1, 3
      call faces_between(2, grid%lo, grid%hi + unit_step(:, d))
      do s = 1, 2
        call grid%side_faces(s, d, a, b)
        if (is_wall(grid%side(s, d))) then
          band%k(a(1):b(1), a(2):b(2), a(3):b(3), d) = 0.0_wp
        else if (gives_pressure(grid%side(s, d))) then
          call faces_between(1, a, b)
        end if
      end do
    end do
  contains
    !> Faces a..b of direction d; they conduct if this many of their two cells are in the band.
    subroutine faces_between(cells, a, b)
      integer, intent(in) :: cells, a(3), b(3)
      integer :: i, j, k, e(3)
      real(wp) :: w, size_of_face

      e = unit_step(:, d)
      size_of_face = grid%area(d)/maxval(grid%area)
      !$omp parallel do private(i, j, w) schedule(static)
      do k = a(3), b(3)
        do j = a(2), b(2)
          do i = a(1), b(1)
            w = 0.5_wp*(old_open(i, j, k, d) + new_open(i, j, k, d))
            band%k(i, j, k, d) = merge(w*size_of_face, 0.0_wp, w >= min_open .and. &
              band%marked(i, j, k) + band%marked(i - e(1), j - e(2), k - e(3)) == cells)
          end do
        end do
      end do
    end subroutine faces_between
  end subroutine find_conductances

  !> Cells of the band with a way out, in the order of the grid.
  subroutine list_band(grid, band)
    type(grid_t), intent(in) :: grid
    type(narrow_band_t), intent(inout) :: band
    integer :: i, j, k

    !$omp parallel do private(i, j) schedule(static)
    do k = lbound(band%number, 3), ubound(band%number, 3)
      band%number(:, :, k) = 0
      if (k < grid%lo(3) .or. k > grid%hi(3)) cycle
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          if (band%marked(i, j, k) == 0) cycle
          band%number(i, j, k) = merge(1, 0, band%k(i, j, k, 1) + band%k(i + 1, j, k, 1) &
            + band%k(i, j, k, 2) + band%k(i, j + 1, k, 2) &
            + band%k(i, j, k, 3) + band%k(i, j, k + 1, 3) > 0.0_wp)
        end do
      end do
    end do
    call list_marked(grid, lbound(band%number), band%number, band%cell, band%n)
    call ensure_capacity(band%n, band%r)
    call ensure_capacity(band%n, band%open)
  end subroutine list_band

  !> Volume balance r of the cells of the band.
  subroutine find_balances(grid, new, fluid_volume, q, band)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: new
    real(wp), intent(in), contiguous :: fluid_volume(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(in), contiguous :: q(grid%first(1):, grid%first(2):, grid%first(3):, :)
    type(narrow_band_t), intent(inout) :: band
    integer :: i, j, k, l
    real(wp) :: outflow, volume_left

    !$omp parallel do private(i, j, k, outflow, volume_left) schedule(static)
    do l = 1, band%n
      i = band%cell(1, l)
      j = band%cell(2, l)
      k = band%cell(3, l)
      outflow = (q(i + 1, j, k, 1) - q(i, j, k, 1)) + (q(i, j + 1, k, 2) - q(i, j, k, 2)) &
                + (q(i, j, k + 1, 3) - q(i, j, k, 3))
      volume_left = fluid_volume(i, j, k) - grid%volume*(1.0_wp - new%alpha(i, j, k))
      band%r(l) = (volume_left - outflow)/grid%volume
      band%open(l) = 1.0_wp - new%alpha(i, j, k)
    end do
  end subroutine find_balances

  !> Excess of fluid in a part of the band, which its cells share; none with an open side
  !! [open volumes].
  pure function share_of_part(band, c) result(share)
    type(narrow_band_t), intent(in) :: band
    integer, intent(in) :: c   !! number of the part
    real(wp) :: share

    share = 0.0_wp
    if (band%vents(c) == 0_i8) share = band%total(c)/max(band%total(band%parts + c), tiny(share))
  end function share_of_part

  !> Would a part of the band keep more or less fluid than the cells beside it have? All processes
  !! get the same.
  function excess_stays(grid, fluid_volume, band) result(yes)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: fluid_volume(grid%first(1):, grid%first(2):, grid%first(3):)
    type(narrow_band_t), intent(in) :: band
    logical :: yes
    real(wp) :: share, most(1)
    integer :: c, l, d, s, nb(3)

    most = 0.0_wp
    do c = 1, band%parts
      if (band%vents(c) > 0_i8) cycle
      share = share_of_part(band, c)
      !$omp parallel do private(d, s, nb) reduction(max: most) schedule(static)
      do l = band%first(c), band%first(c + 1) - 1
        do d = 1, 3
          do s = -1, 1, 2
            nb = band%cell(:, l) + s*unit_step(:, d)
            if (grid%beyond(nb(d), d)) cycle
            if (band%marked(nb(1), nb(2), nb(3)) /= 0) cycle
            most = max(most, abs(share - (fluid_volume(nb(1), nb(2), nb(3))/grid%volume - 1.0_wp)))
          end do
        end do
      end do
    end do
    call global_max(most)
    yes = most(1) > excess_max
  end function excess_stays

  !> What the balances of a part without an open side sum up to is taken out of its cells in
  !! proportion to their open volume, so that closing cells still empty. Parts that balance then
  !! need no solution; all of them do if `balanced`.
  subroutine balance_parts(self, balanced)
    type(open_flux_t), intent(inout) :: self
    logical, intent(out) :: balanced
    real(wp) :: largest(self%band%parts)   ! rest |r| in each part [V]
    real(wp) :: share
    integer :: c, l

    largest = 0.0_wp
    associate (band => self%band)
      do c = 1, band%parts
        share = share_of_part(band, c)
        self%unmatched = max(self%unmatched, abs(share))
        do l = band%first(c), band%first(c + 1) - 1
          band%r(l) = band%r(l) - share*band%open(l)
          largest(c) = max(largest(c), abs(band%r(l)))
        end do
      end do
      call global_max(largest)
      balanced = all(largest <= control%tolerance)
      if (balanced) return
      do c = 1, band%parts
        if (largest(c) <= control%tolerance) call drop_part(c, band)
      end do
    end associate
  end subroutine balance_parts

end module open_flux_m
