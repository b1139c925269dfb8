!> Cross-sections of polyhedra, by the corners that a cut puts on its plane: a reference for tests.
module polyhedron_sections_m
  use kinds_m, only: wp
  use vectors_m, only: cross
  use polyhedron_m, only: polyhedron_t, cut_polyhedron
  implicit none
  private
  public :: polyhedron_section

contains

  !> Area and centroid of the cross-section with the plane `n.x = d`.
  !!
  !! Corners on the plane count as below: a face that lies in the plane is the cross-section if the
  !! body stands above it (n points into the body), and there is none if the body hangs below.
  pure subroutine polyhedron_section(p, n, d, area, centroid)
    type(polyhedron_t), intent(in) :: p
    real(wp), intent(in) :: n(3), d
    real(wp), intent(out) :: area          !! [m2]
    real(wp), intent(out) :: centroid(3)   !! of the cross-section, 0 where there is none [m]
    type(polyhedron_t) :: part
    real(wp) :: a(3), b(3), moment(3), twice
    integer :: v, n_kept, first, here

    area = 0.0_wp
    centroid = 0.0_wp
    n_kept = 0
    do v = 1, p%n
      if (n(1)*p%x(1, v) + n(2)*p%x(2, v) + n(3)*p%x(3, v) - d <= 0.0_wp) n_kept = n_kept + 1
    end do
    if (n_kept == 0 .or. n_kept == p%n) return
    part = p
    call cut_polyhedron(part, n, d)
    first = n_kept + 1
    here = part%adjacent(2, first)
    moment = 0.0_wp
    do v = n_kept + 2, part%n
      if (part%adjacent(2, here) == first) exit
      a = part%x(:, here) - part%x(:, first)
      b = part%x(:, part%adjacent(2, here)) - part%x(:, first)
      twice = dot_product(n, cross(a, b))/norm2(n)
      area = area + twice
      moment = moment + twice*(a + b)
      here = part%adjacent(2, here)
    end do
    if (abs(area) > 0.0_wp) centroid = part%x(:, first) + moment/(3.0_wp*area)
    area = 0.5_wp*abs(area)
  end subroutine polyhedron_section

end module polyhedron_sections_m
