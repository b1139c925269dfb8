!> Volume, centroid and inertia from tetrahedra against closed forms and surface integrals.
program test_mass_properties
  use kinds_m, only: wp, pi
  use check_m, only: check, finish_checks
  use case_types_m, only: shape_input_t
  use tet_mesh_m, only: shape_t
  use shapes_builtin_m, only: make_shape
  use mass_properties_m, only: volume_and_centroid, inertia_about_origin
  implicit none

  real(wp), parameter :: rho = 2300.0_wp

  call hexapod()
  call box()
  call sphere()
  call moved_block()
  call finish_checks()

contains

  subroutine build(kind, size, refinement, shape)
    character(*), intent(in) :: kind
    real(wp), intent(in) :: size(3)
    integer, intent(in) :: refinement
    type(shape_t), intent(out) :: shape
    type(shape_input_t) :: input
    character(:), allocatable :: message

    input%kind = kind
    input%size = size
    input%refinement = refinement
    input%density = rho
    call make_shape(input, shape, message)
    call check(kind//' is built', message == '')
  end subroutine build

  pure function flat(a) result(b)
    real(wp), intent(in) :: a(3, 3)
    real(wp) :: b(9)

    b = reshape(a, [9])
  end function flat

  pure function diagonal(d) result(a)
    real(wp), intent(in) :: d(3)
    real(wp) :: a(3, 3)
    integer :: i

    a = 0.0_wp
    do i = 1, 3
      a(i, i) = d(i)
    end do
  end function diagonal

  !> V = 7 d^3, J = 31/6 rho d^5, the same about every axis, whatever the mesh.
  subroutine hexapod()
    type(shape_t) :: s
    real(wp), parameter :: d = 0.02_wp, j = 31.0_wp/6.0_wp*rho*d**5
    integer :: r

    do r = 1, 4
      call build('hexapod', [d, 0.0_wp, 0.0_wp], r, s)
      call check('hexapod: volume', s%volume, 7*d**3, 1e-14_wp*7*d**3)
      call check('hexapod: inertia', flat(s%inertia), flat(diagonal([j, j, j])), 1e-14_wp*j)
    end do
    call check('hexapod: 3.803e-5 kg m2', j, 3.803e-5_wp, 5e-9_wp)
  end subroutine hexapod

  subroutine box()
    type(shape_t) :: s
    real(wp), parameter :: e(3) = [0.01_wp, 0.025_wp, 0.06_wp]
    real(wp) :: m, want(3)

    call build('box', e, 2, s)
    m = rho*product(e)
    want = m/12*[e(2)**2 + e(3)**2, e(3)**2 + e(1)**2, e(1)**2 + e(2)**2]
    call check('box: volume', s%volume, product(e), 1e-14_wp*product(e))
    call check('box: inertia', flat(s%inertia), flat(diagonal(want)), 1e-14_wp*maxval(want))
  end subroutine box

  !> The polyhedron: isotropic, equal to its surface integral, close to the true sphere.
  subroutine sphere()
    type(shape_t) :: s
    real(wp), parameter :: a = 0.03_wp, want = 0.4_wp*rho*(4*pi/3*a**3)*a**2
    real(wp) :: error(2)
    integer :: r

    do r = 1, 2
      call build('sphere', [2*a, 0.0_wp, 0.0_wp], r, s)
      call check('sphere: isotropic', flat(s%inertia), &
                 flat(diagonal(spread(s%inertia(1, 1), 1, 3))), 1e-13_wp*want)
      call check('sphere: inertia by the surface', flat(s%inertia), flat(inertia_of_surface(s)), &
                 1e-13_wp*want)
      error(r) = s%inertia(1, 1)/want - 1
    end do
    call check('sphere: inertia within 0.1 per cent', abs(error(2)) < 1e-3_wp)
    call check('sphere: fourth order, since the volume is right', abs(error(1)/error(2) - 16) < 2)
  end subroutine sphere

  !> Divergence theorem: integral of x_i^2 dV = surface integral of x_i^3/3 n_i dA (and so on).
  function inertia_of_surface(s) result(inertia)
    type(shape_t), intent(in) :: s
    real(wp) :: inertia(3, 3), second(3, 3), x(3, 3), normal(3), u(3), v(3), y(3)
    real(wp), parameter :: w(4) = [-27.0_wp, 25.0_wp, 25.0_wp, 25.0_wp]/48.0_wp   ! exact for cubics
    real(wp), parameter :: b(3, 4) = reshape([1.0_wp/3, 1.0_wp/3, 1.0_wp/3, &
      0.6_wp, 0.2_wp, 0.2_wp, 0.2_wp, 0.6_wp, 0.2_wp, 0.2_wp, 0.2_wp, 0.6_wp], [3, 4])
    integer :: t, g, i, j

    second = 0.0_wp
    do t = 1, size(s%triangle, 2)
      x = s%point(:, s%triangle(:, t))
      u = x(:, 2) - x(:, 1)
      v = x(:, 3) - x(:, 1)
      normal = 0.5_wp*[u(2)*v(3) - u(3)*v(2), u(3)*v(1) - u(1)*v(3), u(1)*v(2) - u(2)*v(1)]
      do g = 1, 4
        y = matmul(x, b(:, g))
        do j = 1, 3
          do i = 1, 3
            if (i == j) second(i, i) = second(i, i) + w(g)*y(i)**3*normal(i)/3
            if (i /= j) second(i, j) = second(i, j) + w(g)*0.5_wp*y(i)**2*y(j)*normal(i)
          end do
        end do
      end do
    end do
    inertia = -rho*second
    do i = 1, 3
      inertia(i, i) = rho*(second(1, 1) + second(2, 2) + second(3, 3) - second(i, i))
    end do
  end function inertia_of_surface

  !> A shifted mesh: centroid follows, inertia by the parallel axes.
  subroutine moved_block()
    type(shape_t) :: s
    real(wp) :: volume, x(3), want(3, 3), shift(3)
    real(wp), allocatable :: point(:, :)
    integer :: i, j

    call build('hexapod', [0.02_wp, 0.0_wp, 0.0_wp], 2, s)
    shift = [0.01_wp, -0.02_wp, 0.03_wp]
    point = s%point + spread(shift, 2, size(s%point, 2))
    call volume_and_centroid(point, s%tet, volume, x)
    call check('moved block: centroid', x, shift, 1e-16_wp)
    do j = 1, 3
      do i = 1, 3
        want(i, j) = s%inertia(i, j) - rho*s%volume*shift(i)*shift(j)
        if (i == j) want(i, j) = want(i, j) + rho*s%volume*sum(shift**2)
      end do
    end do
    call check('moved block: parallel axes', flat(inertia_about_origin(point, s%tet, rho)), &
               flat(want), 1e-18_wp)
  end subroutine moved_block

end program test_mass_properties
