!> Added mass and added inertia of a body in boundless liquid, by source panels.
!!
!! The flow about a body that moves with the normal velocity n.U is that of sources sigma on its
!! surface,
!!
!! $$ \frac{\sigma}{2} + \frac{1}{4 \pi} \int \sigma \frac{(x - y) \cdot n_x}{|x - y|^3} dS_y
!!    = n \cdot U, \qquad
!!    \phi = - \frac{1}{4 \pi} \int \frac{\sigma}{|x - y|} dS_y, \qquad
!!    A_{ij} = - \rho \int \phi_i \frac{\partial \phi_j}{\partial n} dS . $$
!!
!! For translations A_ij = rho (int sigma_i x_j dS - V delta_ij) (Taylor's theorem). Panels are flat
!! with constant sigma, the condition holds at their centres, integrals over a panel are exact.
!! Source: J. L. Hess, A. M. O. Smith (1964), J. Ship Research 8, 22; J. N. Newman (1977), Marine
!! Hydrodynamics, sections 4.10 and 4.13. The error falls with a power of the length of the panels
!! that the edges of the body set; two sets of panels are extrapolated with it.
module panel_method_m
  use kinds_m, only: wp, pi
  use vectors_m, only: norm, cross
  use panels_m, only: panels_t, split_panels
  implicit none
  private
  public :: added_inertia_t, added_inertia, max_surface_panels

  integer, parameter :: min_panels = 96             !! of the coarser set
  integer, parameter :: many_panels = 500           !! of it; above, the finer has but twice as many
  integer, parameter :: max_surface_panels = 1500   !! triangles of a surface that are taken
  real(wp), parameter :: edge_order = 1.14_wp
    !! power of the panels' length; cube, hexapod and tetrapod from 48 to 3072 panels: 1.1 to 1.3

  !> Mean over the axes, and the spread of the translation over that mean.
  type :: added_inertia_t
    real(wp) :: mass = 0.0_wp      !! over the displaced mass [-]
    real(wp) :: inertia = 0.0_wp   !! over that of the displaced liquid [-]
    real(wp) :: spread = 0.0_wp    !! largest less smallest of A_xx, A_yy, A_zz over their mean [-]
  end type added_inertia_t

contains

  !> Added mass and inertia of the body inside closed panels, about the origin.
  function added_inertia(surface, moment) result(added)
    type(panels_t), intent(in) :: surface   !! of the body
    real(wp), intent(in) :: moment          !! trace of its inertia for the density 1 [m5]
    type(added_inertia_t) :: added
    type(panels_t) :: coarse, fine
    real(wp) :: a(6), finest(6), volume
    integer :: i

    coarse = surface
    do while (coarse%n < min_panels)
      coarse = split_panels(coarse, 0.0_wp)
    end do
    fine = split_panels(coarse, 0.0_wp)
    if (coarse%n <= many_panels) fine = split_panels(fine, 0.0_wp)
    finest = added_diagonal(fine)
    a = finest - (added_diagonal(coarse) - finest) &
        /(sqrt(real(fine%n, wp)/real(coarse%n, wp))**edge_order - 1.0_wp)
    volume = 0.0_wp
    do i = 1, fine%n
      volume = volume + fine%area(i)*dot_product(fine%centre(:, i), fine%normal(:, i))/3.0_wp
    end do
    added%mass = sum(a(1:3))/(3.0_wp*volume)
    added%spread = (maxval(a(1:3)) - minval(a(1:3)))/(added%mass*volume)
    added%inertia = max(0.0_wp, sum(a(4:6))/moment)
  end function added_inertia

  !> The diagonal of the added inertia for the density 1: along and about x, y, z [m3, m5].
  function added_diagonal(panels) result(a)
    type(panels_t), intent(in) :: panels
    real(wp) :: a(6)
    real(wp) :: given(6, panels%n), sigma(6, panels%n), change(6, panels%n), potential(6)
    real(wp) :: pull(3)
    real(wp), allocatable :: speed(:, :), inverse_distance(:, :)   ! (sources, places) [-], [m]
    integer :: i, j, round
    real(wp), parameter :: relaxation = 1.3_wp, tolerance = 1.0e-8_wp
    integer, parameter :: max_rounds = 300

    allocate (speed(panels%n, panels%n), inverse_distance(panels%n, panels%n))
    ! Normal velocity and potential (times -4 pi) at the centre of each panel from each panel with
    ! sources of strength one.
    !$omp parallel do private(i, j, pull) schedule(static)
    do i = 1, panels%n
      do j = 1, panels%n
        call integrate_panel(panels%corner(:, :, j), panels%normal(:, j), panels%centre(:, i), &
                             inverse_distance(j, i), pull)
        speed(j, i) = -dot_product(pull, panels%normal(:, i))/(4.0_wp*pi)
        if (j == i) speed(j, i) = 0.5_wp
      end do
    end do
    !$omp end parallel do
    do i = 1, panels%n
      given(1:3, i) = panels%normal(:, i)
      given(4:6, i) = cross(panels%centre(:, i), panels%normal(:, i))
    end do
    ! Sources that give the normal velocities: sigma += relaxation (given - velocity). The operator
    ! has its eigenvalues in (0, 1], those of a sphere (l + 1)/(2 l + 1).
    sigma = given
    do round = 1, max_rounds
      !$omp parallel do private(i) schedule(static)
      do i = 1, panels%n
        change(:, i) = relaxation*(given(:, i) - matmul(sigma, speed(:, i)))
      end do
      !$omp end parallel do
      sigma = sigma + change
      if (all(maxval(abs(change), 2) <= tolerance*maxval(abs(sigma), 2))) exit
    end do
    a = 0.0_wp
    do i = 1, panels%n
      a(1:3) = a(1:3) + panels%area(i)*sigma(1:3, i)*panels%centre(:, i)
      a(1:3) = a(1:3) - panels%area(i)*panels%normal(:, i)*panels%centre(:, i)   ! the volume
      potential = -matmul(sigma, inverse_distance(:, i))/(4.0_wp*pi)
      a(4:6) = a(4:6) - panels%area(i)*potential(4:6)*given(4:6, i)
    end do
  end function added_diagonal

  !> Integrals of 1/r and of (y - x)/r^3 over a triangle, r = |y - x|.
  pure subroutine integrate_panel(corner, normal, x, inverse, pull)
    real(wp), intent(in) :: corner(3, 3)   !! y, counter-clockwise about the normal [m]
    real(wp), intent(in) :: normal(3)
    real(wp), intent(in) :: x(3)           !! not on an edge [m]
    real(wp), intent(out) :: inverse       !! [m]
    real(wp), intent(out) :: pull(3)       !! [-]
    real(wp) :: r(3, 3), length(3), edge(3), out(3), log_term, angle, height, edge_length
    integer :: k, m

    do k = 1, 3
      r(:, k) = corner(:, k) - x
      length(k) = norm(r(:, k))
    end do
    height = dot_product(r(:, 1), normal)
    angle = 2.0_wp*atan2(dot_product(r(:, 1), cross(r(:, 2), r(:, 3))), &
      product(length) + dot_product(r(:, 1), r(:, 2))*length(3) &
      + dot_product(r(:, 2), r(:, 3))*length(1) + dot_product(r(:, 3), r(:, 1))*length(2))
    inverse = -height*angle
    pull = angle*normal
    do k = 1, 3
      m = 1 + mod(k, 3)
      edge = r(:, m) - r(:, k)
      edge_length = norm(edge)
      out = cross(edge, normal)/edge_length   ! in the plane, out of the triangle
      log_term = log((length(k) + length(m) + edge_length)/(length(k) + length(m) - edge_length))
      inverse = inverse + dot_product(r(:, k), out)*log_term
      pull = pull - log_term*out
    end do
  end subroutine integrate_panel

end module panel_method_m
