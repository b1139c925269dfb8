!> Volume, centroid and inertia of a body as sums over its tetrahedra.
!!
!! Source: Yoshikawa et al. (2008), section 2 (1): the properties of the solid model are those of
!! its tetrahedra. The integrals over a tetrahedron are exact.
module mass_properties_m
  use kinds_m, only: wp
  use polyhedron_m, only: tet_volume
  use vectors_m, only: norm
  use polygon_m, only: area_vector
  implicit none
  private
  public :: volume_and_centroid, inertia_about_origin, surface_area

contains

  !> Volume and centroid of a set of tetrahedra of positive volume.
  pure subroutine volume_and_centroid(point, tet, volume, centroid)
    real(wp), intent(in) :: point(:, :)      !! (3, n) [m]
    integer, intent(in) :: tet(:, :)         !! (4, m) corners
    real(wp), intent(out) :: volume          !! [m3]
    real(wp), intent(out) :: centroid(3)     !! [m]
    real(wp) :: v
    integer :: t

    volume = 0.0_wp
    centroid = 0.0_wp
    do t = 1, size(tet, 2)
      v = tet_volume(point(:, tet(:, t)))
      volume = volume + v
      centroid = centroid + 0.25_wp*v*sum(point(:, tet(:, t)), 2)
    end do
    centroid = centroid/volume
  end subroutine volume_and_centroid

  !> Inertia tensor about the origin of the coordinates.
  !!
  !! $$ J = \rho \sum_t \int ( |x|^2 I - x x^T ) dV, \quad
  !!    \int x x^T dV = \frac{V}{20} \Big( \sum_a x_a x_a^T + s s^T \Big), \; s = \sum_a x_a $$
  pure function inertia_about_origin(point, tet, density) result(inertia)
    real(wp), intent(in) :: point(:, :)      !! (3, n) [m]
    integer, intent(in) :: tet(:, :)         !! (4, m) corners, positive volume
    real(wp), intent(in) :: density          !! [kg/m3]
    real(wp) :: inertia(3, 3)                !! [kg m2]
    real(wp) :: x(3, 4), s(3), second(3, 3), trace
    integer :: t, i, j

    second = 0.0_wp
    do t = 1, size(tet, 2)
      x = point(:, tet(:, t))
      s = sum(x, 2)
      do j = 1, 3
        do i = 1, 3
          second(i, j) = second(i, j) + &
                         tet_volume(x)/20.0_wp*(dot_product(x(i, :), x(j, :)) + s(i)*s(j))
        end do
      end do
    end do
    trace = second(1, 1) + second(2, 2) + second(3, 3)
    inertia = -density*second
    do i = 1, 3
      inertia(i, i) = density*(trace - second(i, i))
    end do
  end function inertia_about_origin

  !> Area of a surface of triangles [m2].
  pure function surface_area(point, triangle) result(area)
    real(wp), intent(in) :: point(:, :)      !! (3, n) [m]
    integer, intent(in) :: triangle(:, :)    !! (3, m) corners
    real(wp) :: area
    integer :: t

    area = 0.0_wp
    do t = 1, size(triangle, 2)
      area = area + norm(area_vector(point(:, triangle(:, t))))
    end do
  end function surface_area

end module mass_properties_m
