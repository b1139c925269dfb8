!> Closed surfaces of polygons: checks of their net, and integrals over what they enclose.
module surface_nets_m
  use kinds_m, only: wp
  use vectors_m, only: cross
  use tet_mesh_m, only: shape_t
  use check_m, only: check
  implicit none
  private
  public :: check_net, check_moments

contains

  !> Each edge joins two polygons, which run it both ways; they are flat and bend at every corner;
  !! corners - edges + faces is Euler's number; the volume within, and the area, to 1e-13.
  subroutine check_net(name, point, facet, corner, euler, volume, area)
    character(*), intent(in) :: name
    real(wp), intent(in) :: point(:, :)
    integer, intent(in) :: facet(:), corner(:)   !! first corners of the polygons and one more; all
    integer, intent(in), optional :: euler
    real(wp), intent(in), optional :: volume, area
    integer, allocatable :: pairs(:, :)
    integer :: f, k, m
    real(wp) :: extent, twice(3), found, second(3, 3), sum_area
    logical :: bent, flat

    allocate (pairs(size(point, 2), size(point, 2)), source=0)
    extent = maxval(abs(point))
    sum_area = 0.0_wp
    bent = .true.
    flat = .true.
    do f = 1, size(facet) - 1
      associate (x => point(:, corner(facet(f):facet(f + 1) - 1)), &
                 c => corner(facet(f):facet(f + 1) - 1))
        m = size(c)
        twice = 0.0_wp
        do k = 2, m - 1
          twice = twice + cross(x(:, k) - x(:, 1), x(:, k + 1) - x(:, 1))
        end do
        sum_area = sum_area + 0.5_wp*norm2(twice)
        do k = 1, m
          pairs(c(k), c(1 + mod(k, m))) = pairs(c(k), c(1 + mod(k, m))) + 1
          associate (u => x(:, 1 + mod(k, m)) - x(:, k), &
                     v => x(:, 1 + mod(k + 1, m)) - x(:, 1 + mod(k, m)))
            flat = flat .and. abs(dot_product(twice, u)) < 1.0e-12_wp*norm2(twice)*extent
            bent = bent .and. dot_product(twice, cross(u, v)) &
                   > 1.0e-4_wp*norm2(u)*norm2(v)*norm2(twice)
          end associate
        end do
      end associate
    end do
    call check(name//': two at each edge', all(pairs <= 1) .and. all(pairs == transpose(pairs)))
    call check(name//': flat', flat)
    call check(name//': bent at every corner', bent)
    if (present(euler)) call check(name//': Euler''s number', count(any(pairs > 0, 2)) &
                                   - sum(pairs)/2 + size(facet) - 1, euler)
    call moments_of_net(point, facet, corner, found, second)
    if (present(volume)) call check(name//': volume within', found, volume, 1.0e-13_wp*volume)
    if (present(area)) call check(name//': area', sum_area, area, 1.0e-13_wp*area)
  end subroutine check_net

  !> Volume and inertia of a block are those by its surface, without tetrahedra.
  subroutine check_moments(name, s)
    character(*), intent(in) :: name
    type(shape_t), intent(in) :: s
    real(wp) :: volume, second(3, 3), inertia(3, 3)
    integer :: j

    call moments_of_net(s%point, s%facet, s%facet_point, volume, second)
    inertia = -s%density*second
    do j = 1, 3
      inertia(j, j) = inertia(j, j) + s%density*(second(1, 1) + second(2, 2) + second(3, 3))
    end do
    call check(name//': volume by the surface', s%volume, volume, 1e-13_wp*volume)
    call check(name//': inertia by the surface', [s%inertia], [inertia], 1e-13_wp*maxval(inertia))
  end subroutine check_moments

  !> Volume and integral of x x^T within: with div(x f) = (3 + m) f for f of degree m,
  !! V = 1/3 sum (x.n) A and int x x^T dV = 1/5 sum (x.n) int x x^T dA.
  pure subroutine moments_of_net(point, facet, corner, volume, second)
    real(wp), intent(in) :: point(:, :)
    integer, intent(in) :: facet(:), corner(:)
    real(wp), intent(out) :: volume, second(3, 3)
    real(wp) :: x(3, 3), height_area
    integer :: m, k, j

    volume = 0.0_wp
    second = 0.0_wp
    do m = 1, size(facet) - 1
      do k = facet(m) + 1, facet(m + 1) - 2
        x = point(:, corner([facet(m), k, k + 1]))
        height_area = dot_product(x(:, 1), cross(x(:, 2), x(:, 3)))/2
        volume = volume + height_area/3
        do j = 1, 3
          second(:, j) = second(:, j) + height_area/60*(matmul(x, x(j, :)) + sum(x, 2)*sum(x(j, :)))
        end do
      end do
    end do
  end subroutine moments_of_net

end module surface_nets_m
