!> The plane in a box cell: constant and volume are inverse, slabs add up, normals are exact.
module test_plic_m
  use check_m, only: check, wp, pi
  use plic_m, only: unit_constant, unit_volume, unit_area, unit_slab, unit_normal
  implicit none
  private
  public :: test_plic

contains

  subroutine test_plic()
    call inverse_of_each_other()
    call against_exact_volumes()
    call nearly_parallel_planes()
    call slopes()
    call slabs_add_up()
    call normals_of_planes()
    call normals_alike()
    call normal_of_sphere()
  end subroutine test_plic

  !> Direction number i of a spiral over the sphere, with every fifth one degenerate.
  function direction(i) result(n)
    integer, intent(in) :: i
    real(wp) :: n(3), z, angle

    z = 2.0_wp*modulo(real(i, wp)*0.754877666_wp, 1.0_wp) - 1.0_wp
    angle = 2.0_wp*pi*modulo(real(i, wp)*0.569840291_wp, 1.0_wp)
    n = [sqrt(1.0_wp - z*z)*cos(angle), sqrt(1.0_wp - z*z)*sin(angle), z]
    if (modulo(i, 5) == 0) n(1 + modulo(i/5, 3)) = 0.0_wp
    if (modulo(i, 35) == 0) n(1 + modulo(i/5 + 1, 3)) = 0.0_wp
    if (modulo(i, 7) == 0) n(1 + modulo(i/7, 3)) = sign(10.0_wp**(-modulo(i/7, 17)), n(1))
  end function direction

  subroutine inverse_of_each_other()
    integer :: i, k
    real(wp) :: n(3), f, share
    real(wp), parameter :: h(3) = [0.005_wp, 0.01_wp, 0.02_wp]

    do i = 1, 4000
      n = direction(i)
      do k = 0, 17
        f = 0.125_wp*real(k, wp)
        if (k == 4) f = modulo(real(i, wp)*0.381966011_wp, 1.0_wp)
        if (k > 8) f = 10.0_wp**(7 - k)
        share = volume_below(n, unit_constant(n*h, f), h)/product(h)
        call check('volume below the constant of a fraction', share, f, 1.0e-14_wp)
        if (k > 8) call check('shares stay within 0 and 1', share >= 0.0_wp .and. share <= 1.0_wp)
      end do
    end do
  end subroutine inverse_of_each_other

  subroutine against_exact_volumes()
    real(wp) :: third

    third = 1.0_wp/3.0_wp
    call check('plane through three corners', unit_volume([1.0_wp, 1.0_wp, 1.0_wp], 1.0_wp), &
               1.0_wp/6.0_wp, 1.0e-15_wp)
    call check('at the centre', unit_volume([0.3_wp, -0.5_wp, 0.2_wp], 0.0_wp), 0.5_wp, 1.0e-15_wp)
    call check('hexagon', unit_volume([third, third, third], 0.4_wp), &
               (1.2_wp**3 - 3.0_wp*0.2_wp**3)/6.0_wp, 1.0e-15_wp)
    call check('flat', unit_volume([0.0_wp, 0.0_wp, -2.0_wp], -0.5_wp), 0.75_wp, 1.0e-15_wp)
    call check('wedge', unit_volume([0.25_wp, 0.75_wp, 0.0_wp], 0.5_wp), 0.5_wp, 1.0e-15_wp)
    call check('box of edges 1, 2, 3', volume_below([1.0_wp, 1.0_wp, 1.0_wp], &
      1.0_wp, [1.0_wp, 2.0_wp, 3.0_wp]), 1.0_wp/6.0_wp, 1.0e-15_wp)
    call check('constant of the plane through three corners', &
               unit_constant([1.0_wp, 1.0_wp, 1.0_wp], 1.0_wp/6.0_wp), 1.0_wp, 1.0e-14_wp)
  end subroutine against_exact_volumes

  !> Components down to 1e-14: the volume must follow the two-dimensional one.
  subroutine nearly_parallel_planes()
    integer :: i, k
    real(wp) :: small, b

    do k = 2, 14
      small = 10.0_wp**(-k)
      do i = 1, 99
        b = 0.01_wp*real(i, wp)
        call check('a tiny component changes nothing but its mean', &
          unit_volume([small, 0.4_wp, 0.6_wp], b), &
          unit_volume([0.0_wp, 0.4_wp, 0.6_wp], b - 0.5_wp*small), small**2 + 1.0e-15_wp)
      end do
    end do
  end subroutine nearly_parallel_planes

  subroutine slopes()
    integer :: i
    real(wp) :: m(3), a
    real(wp), parameter :: step = 1.0e-5_wp

    do i = 1, 500
      m = direction(i)
      if (minval(abs(m)) < 0.01_wp) cycle
      a = unit_constant(m, modulo(0.618_wp*real(i, wp), 1.0_wp))
      call check('area is the derivative of the volume', unit_area(m, a), &
        (unit_volume(m, a + step) - unit_volume(m, a - step))/(2.0_wp*step), 1.0e-6_wp)
    end do
  end subroutine slopes

  subroutine slabs_add_up()
    integer :: i, d
    real(wp) :: m(3), f, a, t, low, high

    do i = 1, 3000
      m = direction(i)
      f = modulo(0.618_wp*real(i, wp), 1.0_wp)
      t = modulo(0.287_wp*real(i, wp), 1.0_wp)
      a = unit_constant(m, f)
      do d = 1, 3
        low = unit_slab(m, a, d, 1, t)
        high = unit_slab(m, a, d, 2, 1.0_wp - t)
        call check('two slabs make the cell', low + high, f, 1.0e-14_wp)
        call check('and hold no more', low >= 0.0_wp .and. low <= t .and. high >= 0.0_wp)
      end do
    end do
    m = [0.0_wp, 0.0_wp, 4.0_wp]   ! normal along z times the edges 1, 2, 4 of a cell of volume 8
    call check('slab below is wet', 8*unit_slab(m, 1.0_wp, 3, 1, 0.125_wp), 1.0_wp, 1.0e-15_wp)
    call check('slab above is dry', 8*unit_slab(m, 1.0_wp, 3, 2, 0.125_wp), 0.0_wp, 1.0e-15_wp)
    call check('slab across', 8*unit_slab(m, 1.0_wp, 1, 2, 0.5_wp), 1.0_wp, 1.0e-15_wp)
  end subroutine slabs_add_up

  !> Shares of the 27 cells below the plane n.x = d; the centre cell is 0..1 in each direction.
  function shares(n, d) result(c)
    real(wp), intent(in) :: n(3), d
    real(wp) :: c(3, 3, 3)
    integer :: i, j, k

    do concurrent (k=1:3, j=1:3, i=1:3)
      c(i, j, k) = unit_volume(n, d - dot_product(n, real([i, j, k] - 2, wp)))
    end do
  end function shares

  subroutine normals_of_planes()
    integer :: i
    real(wp) :: n(3), m(3)

    do i = 1, 200
      n = [0.2_wp*sin(real(i, wp)), 0.2_wp*cos(3.0_wp*real(i, wp)), 1.0_wp]   ! flat enough
      n = cshift(n, i)*merge(1.0_wp, -1.0_wp, modulo(i, 2) == 0)
      n = n/sum(abs(n))
      call check('normal of a plane that stays in its columns', &
        unit_normal(shares(n, unit_constant(n, 0.5_wp))), n, 1.0e-13_wp)
    end do
    m = unit_normal(shares([0.0_wp, 0.0_wp, 1.0_wp], 0.1513_wp))
    call check('normal of level water', all(abs(m - [0.0_wp, 0.0_wp, 1.0_wp]) <= 0.0_wp))
    m = unit_normal(spread(spread(spread(0.3_wp, 1, 3), 2, 3), 3, 3))
    call check('no direction without differences', all(abs(m) <= 0.0_wp))
  end subroutine normals_of_planes

  !> Level water with a rise in two cells, for which heights and Youngs slope alike: the mean of
  !! both, whatever the last digits.
  subroutine normals_alike()
    real(wp), parameter :: little(3) = [0.0_wp, 1.0e-15_wp, -1.0e-15_wp], rise = 0.01_wp
    real(wp) :: c(3, 3, 3), m(3)
    integer :: i

    do i = 1, 3
      c(:, :, 1) = 1.0_wp
      c(:, :, 2) = 0.1_wp
      c(1, 1:2, 2) = 0.1_wp + rise + [little(i), -little(i)]
      c(:, :, 3) = 0.0_wp
      m = unit_normal(c)
      call check('normals alike: their mean', m/m(3), [7, 1, 16]/16.0_wp*[rise, rise, 1.0_wp], &
        1.0e-13_wp)
      m = unit_normal(reshape(c, [3, 3, 3], order=[3, 1, 2]))
      call check('normals alike: along another axis', m([3, 1, 2])/m(2), &
        [7, 1, 16]/16.0_wp*[rise, rise, 1.0_wp], 1.0e-13_wp)
    end do
  end subroutine normals_alike

  !> Angle between the computed and the true normal of a sphere of radius 10 cells: second order.
  subroutine normal_of_sphere()
    integer :: i
    real(wp) :: n(3), m(3), x(3)

    do i = 1, 100
      n = direction(11*i + 1)
      if (minval(abs(n)) < 1.0e-3_wp) cycle
      n = n/norm2(n)
      x = n*10.0_wp
      m = unit_normal(sphere_shares(10.0_wp, floor(x)))
      m = m/norm2(m)
      x = real(floor(x), wp) + 0.5_wp
      call check('normal of a sphere is within 3 degrees', norm2(m - x/norm2(x)) < 0.05_wp)
    end do
  end subroutine normal_of_sphere

  !> Shares of the sphere about the origin in the 27 cells around cell number `at`, by points.
  function sphere_shares(radius, at) result(c)
    real(wp), intent(in) :: radius
    integer, intent(in) :: at(3)
    real(wp) :: c(3, 3, 3)
    integer, parameter :: n = 12
    integer :: i, j, k, m

    c = 0.0_wp
    do concurrent (k=1:3, j=1:3, i=1:3)
      do m = 0, n**3 - 1
        c(i, j, k) = c(i, j, k) + merge(1.0_wp, 0.0_wp, norm2(at + [i, j, k] - 2 &
          + (modulo(m/[1, n, n**2], n) + 0.5_wp)/n) < radius)/n**3
      end do
    end do
  end function sphere_shares

  !> Volume of the box (0,0,0)..h below the plane `normal.x = d` [m3].
  pure real(wp) function volume_below(normal, d, h) result(volume)
    real(wp), intent(in) :: normal(3), d, h(3)   !! [-], [m], [m]

    volume = unit_volume(normal*h, d)*product(h)
  end function volume_below

end module test_plic_m
