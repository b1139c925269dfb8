!> Weight of the fluid at the faces where the liquid of a cell does not fill it evenly.
module face_weight_m
  use kinds_m, only: wp
  use case_types_m, only: fluid_t
  use boundary_kinds_m, only: no_side
  use grid_m, only: grid_t, unit_step
  implicit none
  private
  public :: uneven_share, weight_at_faces

contains

  !> How much more of the liquid of a cell lies in its lower half than in its upper one [-].
  elemental function uneven_share(here, below, above) result(uneven)
    real(wp), intent(in) :: here, below, above   !! liquid shares of the cell and its neighbours
    real(wp) :: uneven

    uneven = max(-1.0_wp, min(1.0_wp, below - above))*here*(1.0_wp - here)
  end function uneven_share

  !> What the weight at the faces gains where the liquid of a cell does not fill it evenly:
  !! $$ f_f = \frac{1}{2}(\rho_l - \rho_g) g_d (s_{high} q_{high} - s_{low} q_{low}), \quad
  !! q = C (1 - C), \; s = C_{below} - C_{above} $$
  !!
  !! With level liquid at the bottom of a cell (s = 1) the pressure of the cell is then the mean of
  !! the true one, rho g C^2/2, whatever C; with half of C on either face, as the mean density has
  !! it, the layer of the surface moves as if it were half a cell deep, which makes the period of
  !! a wave wrong by up to k h/4, to either side, as the surface lies in its cell (measured: -1.3 %
  !! to 2.5 % at 32 cells per wavelength).
  subroutine weight_at_faces(grid, fluid, c, force)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(inout), contiguous :: force(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [N/m3]
    integer :: i, j, k, d, e(3), low(3), high(3)
    real(wp) :: weight

    do d = 1, 3
      weight = 0.5_wp*(fluid%liquid_density - fluid%gas_density)*fluid%gravity(d)
      if (.not. abs(weight) > 0.0_wp) cycle
      e = unit_step(:, d)
      low = grid%lo
      high = grid%hi + e
      if (grid%side_of_face(low(d), d) /= no_side) low = low + e
      if (grid%side_of_face(high(d), d) /= no_side) high = high - e
      !$omp parallel do private(i, j) schedule(static)
      do k = low(3), high(3)
        do j = low(2), high(2)
          !$omp simd
          do i = low(1), high(1)
            associate (il => i - e(1), jl => j - e(2), kl => k - e(3))
              force(i, j, k, d) = weight*( &
                uneven_share(c(i, j, k), c(il, jl, kl), c(i + e(1), j + e(2), k + e(3))) &
                - uneven_share(c(il, jl, kl), c(il - e(1), jl - e(2), kl - e(3)), c(i, j, k)))
            end associate
          end do
        end do
      end do
    end do
  end subroutine weight_at_faces

end module face_weight_m
