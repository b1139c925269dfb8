!> The part of the viscous stress that acts only where the viscosity changes.
!!
!! The implicit viscous stage solves div(mu grad u). What it leaves out of
!! div(mu (grad u + grad u^T)),
!! $$ \partial_j(\mu\, \partial_i u_j) = (\partial_j \mu)(\partial_i u_j) $$
!! for div u = 0, is zero in one fluid, but makes half of the dissipation of waves: without it the
!! surface is free of mu du/dn instead of free of all stress. It is added explicitly, which bounds
!! the step of very viscous liquids (`viscous_step`). Cells beside bodies
!! are left out: before the viscous stage their thin small cells may carry any velocity (with them a
!! block thrown into water ended two runs).
module surface_stress_m
  use kinds_m, only: wp
  use grid_m, only: grid_t, unit_step
  use mixture_m, only: harmonic_mean, pure_share
  implicit none
  private
  public :: surface_stress

contains

  !> Acceleration of the cells by the transposed stress [m/s2], of own cells:
  !! $$ a_i = \frac{1}{\rho_c} \sum_f \frac{\pm 1}{h_j} (\mu_f - \mu_c) (\partial_i u_j)_f $$
  !! mu_f is the harmonic mean, as in the implicit stage.
  subroutine surface_stress(grid, alpha, rho, mu, u, a)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous, dimension(grid%first(1):, grid%first(2):, grid%first(3):) :: &
      alpha, rho, mu
      !! solid share [-], density that moves [kg/m3], viscosity [Pa s]; halo filled
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s], halo filled
    real(wp), intent(inout), contiguous :: a(grid%first(1):, grid%first(2):, grid%first(3):, :)
    integer :: i, j, k, d, n, s, e(3), f(3), c(3)
    real(wp) :: change, other, total(3), most
    real(wp) :: excess(grid%lo(1):grid%hi(1))   ! of the change to a neighbour above what counts

    !$omp parallel do private(i, j, d, n, s, e, f, c, change, other, total, most, excess) &
    !$omp schedule(dynamic)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        most = 0.0_wp
        !$omp simd reduction(max: most)
        do i = grid%lo(1), grid%hi(1)
          excess(i) = max(abs(mu(i - 1, j, k) - mu(i, j, k)), abs(mu(i + 1, j, k) - mu(i, j, k)), &
                          abs(mu(i, j - 1, k) - mu(i, j, k)), abs(mu(i, j + 1, k) - mu(i, j, k)), &
                          abs(mu(i, j, k - 1) - mu(i, j, k)), abs(mu(i, j, k + 1) - mu(i, j, k))) &
                      - pure_share*mu(i, j, k)
          most = max(most, excess(i))
        end do
        a(grid%lo(1):grid%hi(1), j, k, :) = 0.0_wp
        if (most <= 0.0_wp) cycle
        do i = grid%lo(1), grid%hi(1)
          if (excess(i) <= 0.0_wp) cycle
          c = [i, j, k]
          total = 0.0_wp
          if (any(alpha(i - 1:i + 1, j - 1:j + 1, k - 1:k + 1) > 0.0_wp)) cycle
          do d = 1, 3
            e = unit_step(:, d)
            do s = 0, 1
              f = c + s*e
              other = mu(i + (2*s - 1)*e(1), j + (2*s - 1)*e(2), k + (2*s - 1)*e(3))
              change = real(2*s - 1, wp)*(harmonic_mean(mu(i, j, k), other) - mu(i, j, k)) &
                       /grid%h(d)
              do n = 1, 3
                total(n) = total(n) + change*face_gradient(grid, u(:, :, :, d), f, d, n)
              end do
            end do
          end do
          a(i, j, k, :) = total/rho(i, j, k)
        end do
      end do
    end do
  end subroutine surface_stress

  !> Derivative along n of the velocity component d at the lower face d of a cell [1/s].
  pure function face_gradient(grid, u, f, d, n) result(gradient)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):)
      !! component d [m/s]
    integer, intent(in) :: f(3), d, n
    real(wp) :: gradient
    integer :: low(3), e(3)

    low = f - unit_step(:, d)
    if (n == d) then
      gradient = (u(f(1), f(2), f(3)) - u(low(1), low(2), low(3)))/grid%h(d)
    else
      e = unit_step(:, n)
      gradient = ((u(f(1) + e(1), f(2) + e(2), f(3) + e(3)) &
                   - u(f(1) - e(1), f(2) - e(2), f(3) - e(3))) &
                  + (u(low(1) + e(1), low(2) + e(2), low(3) + e(3)) &
                     - u(low(1) - e(1), low(2) - e(2), low(3) - e(3))))/(4.0_wp*grid%h(n))
    end if
  end function face_gradient

end module surface_stress_m
