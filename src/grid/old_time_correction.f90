!> What the faces at the surface know beyond the cells beside them.
!!
!! The face velocity before the pressure stage is a mean of cells, which smooths: of an acceleration
!! of the faces it keeps the mean of the mean. In one fluid that only damps what the grid does not
!! resolve. Across a jump of density the mean to the cells and the mean back to the faces are no
!! longer adjoint in the mass that moves, and a wave gains or loses energy by where its level lies
!! in a cell, whatever the time step (measured: 15 % of its height in a second to either side, at 16
!! cells per wavelength). So a face there keeps what it differs from the mean of its cells, and the
!! cells give it their change only:
!! $$ u_f := \overline{u} + \dots + \theta\, (u_f - \overline{u})^n, \qquad
!! \theta = |\rho_2 - \rho_1|/(\rho_2 + \rho_1) $$
module old_time_correction_m
  use kinds_m, only: wp
  use grid_m, only: grid_t, unit_step
  use mixture_m, only: face_mean
  implicit none
  private
  public :: store_correction

contains

  !> theta (u_f - mean of u) at the lower faces lo..hi+1 at the start of a step [m/s]; zero in one
  !! fluid, at the sides and beside bodies.
  subroutine store_correction(grid, alpha, rho, u, uf, correction)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous, dimension(grid%first(1):, grid%first(2):, grid%first(3):) :: &
      alpha, rho
      !! solid share [-], density [kg/m3]; halo filled
    real(wp), intent(in), dimension(grid%first(1):, grid%first(2):, grid%first(3):, :), &
      contiguous :: u, uf
      !! velocity of cells, halo filled, and of faces [m/s]
    real(wp), intent(inout), contiguous :: &
      correction(grid%first(1):, grid%first(2):, grid%first(3):, :)
    integer :: i, j, k, d, e(3)
    real(wp) :: keep, jump

    do d = 1, 3
      e = unit_step(:, d)
      !$omp parallel do private(i, j, keep, jump) schedule(static)
      do k = grid%lo(3), grid%hi(3) + e(3)
        do j = grid%lo(2), grid%hi(2) + e(2)
          jump = 0.0_wp
          !$omp simd reduction(max: jump)
          do i = grid%lo(1), grid%hi(1) + e(1)
            jump = max(jump, abs(rho(i, j, k) - rho(i - e(1), j - e(2), k - e(3))))
          end do
          if (jump <= 0.0_wp) then
            correction(grid%lo(1):grid%hi(1) + e(1), j, k, d) = 0.0_wp
            cycle
          end if
          do i = grid%lo(1), grid%hi(1) + e(1)
            associate (il => i - e(1), jl => j - e(2), kl => k - e(3))
              keep = abs(rho(i, j, k) - rho(il, jl, kl))/(rho(i, j, k) + rho(il, jl, kl))
              if (alpha(i, j, k) > 0.0_wp .or. alpha(il, jl, kl) > 0.0_wp) keep = 0.0_wp
              correction(i, j, k, d) = keep*(uf(i, j, k, d) - face_mean(u(il, jl, kl, d), &
                                                                      u(i, j, k, d)))
            end associate
          end do
        end do
      end do
    end do
  end subroutine store_correction

end module old_time_correction_m
