!> Volume, centroid and inertia from tetrahedra against closed forms; integrals over the surface:
!! test_shapes.
module test_mass_properties_m
  use check_m, only: check, wp, pi
  use errors_m, only: to_text
  use case_text_m, only: shape_of
  use tet_mesh_m, only: shape_t
  use mass_properties_m, only: volume_and_centroid, inertia_about_origin
  implicit none
  private
  public :: test_mass_properties

  real(wp), parameter :: rho = 2300.0_wp

contains

  subroutine test_mass_properties()
    call hexapod()
    call box()
    call sphere()
    call moved_block()
    call built_of_parts()
    call tetrapod()
  end subroutine test_mass_properties

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
      s = shape_of('kind="hexapod" size=.02 refinement='//to_text(r))
      call check('hexapod: volume', s%volume, 7*d**3, 1e-14_wp*7*d**3)
      call check('hexapod: inertia', flat(s%inertia), flat(diagonal([j, j, j])), 1e-14_wp*j)
    end do
    call check('hexapod: 3.803e-5 kg m2', j, 3.803e-5_wp, 5e-9_wp)
  end subroutine hexapod

  subroutine box()
    type(shape_t) :: s
    real(wp), parameter :: e(3) = [0.01_wp, 0.025_wp, 0.06_wp]
    real(wp) :: m, want(3)

    s = shape_of('kind="box" size=.01,.025,.06 refinement=2')
    m = rho*product(e)
    want = m/12*[e(2)**2 + e(3)**2, e(3)**2 + e(1)**2, e(1)**2 + e(2)**2]
    call check('box: volume', s%volume, product(e), 1e-14_wp*product(e))
    call check('box: inertia', flat(s%inertia), flat(diagonal(want)), 1e-14_wp*maxval(want))
  end subroutine box

  !> The polyhedron: isotropic, close to the true sphere.
  subroutine sphere()
    type(shape_t) :: s
    real(wp), parameter :: a = 0.03_wp, want = 0.4_wp*rho*(4*pi/3*a**3)*a**2
    real(wp) :: error(2)
    integer :: r

    do r = 1, 2
      s = shape_of('kind="sphere" size=.06 refinement='//to_text(r))
      call check('sphere: isotropic', flat(s%inertia), &
                 flat(diagonal(spread(s%inertia(1, 1), 1, 3))), 1e-13_wp*want)
      error(r) = s%inertia(1, 1)/want - 1
    end do
    call check('sphere: inertia within 0.1 per cent', abs(error(2)) < 1e-3_wp)
    call check('sphere: fourth order, as the volume is right', error(1)/error(2), 16.0_wp, 2.0_wp)
  end subroutine sphere

  !> A shifted mesh: centroid follows, inertia by the parallel axes.
  subroutine moved_block()
    type(shape_t) :: s
    real(wp) :: volume, x(3), want(3, 3), shift(3)
    real(wp), allocatable :: point(:, :)
    integer :: i, j

    s = shape_of('kind="hexapod" size=.02 refinement=2')
    shift = [0.01_wp, -0.02_wp, 0.03_wp]
    point = s%point + spread(shift, 2, size(s%point, 2))
    call volume_and_centroid(point, s%tet, volume, x)
    call check('moved block: centroid', x, shift, 1e-16_wp)
    do concurrent (j=1:3, i=1:3)
      want(i, j) = s%inertia(i, j) - rho*s%volume*shift(i)*shift(j)
      if (i == j) want(i, j) = want(i, j) + rho*s%volume*sum(shift**2)
    end do
    call check('parallel axes', flat(inertia_about_origin(point, s%tet, rho)), flat(want), 1e-18_wp)
  end subroutine moved_block

  !> Volumes against closed forms, and the inertia of a cylinder.
  subroutine built_of_parts()
    type(shape_t) :: s
    real(wp), parameter :: h = 0.06_wp, length = 0.1_wp
    real(wp) :: octagon, a, b, ix
    integer :: r

    ! A dolos: four tapered legs of regular octagons, two stretches of fluke, the shank, and four
    ! wedges of depth u - a and height 2(w - u + a) between u = a and w (half side, half waist).
    octagon = 2*(sqrt(2.0_wp) - 1)
    a = 0.16_wp*tan(pi/8)
    b = 0.16_wp - a
    a = octagon*(4*0.34_wp/3*(0.32_wp**2 + 0.32_wp*0.2_wp + 0.2_wp**2) + 3*0.32_wp**3 &
      + 0.04_wp*0.32_wp**2) + 4*(0.16_wp*b**2 - 2*b**3/3)
    do r = 1, 3
      s = shape_of('kind="dolos" size=.06 refinement='//to_text(r))
      call check('dolos: volume', s%volume, a*h**3, 1e-14_wp*h**3)
      s = shape_of('kind="reef_cube" size=.06 refinement='//to_text(r))   ! 12 bars, 8 corners
      call check('reef cube: volume', s%volume, (12*0.2_wp**2*0.6_wp + 8*0.2_wp**3)*h**3, &
        1e-14_wp*h**3)
      s = shape_of('kind="cylinder" size=.06,.1 refinement='//to_text(r))
      call check('cylinder: volume', s%volume, 0.25_wp*pi*h**2*length, 1e-14_wp*h**3)
      ! a polygon of n sides and the area of the circle has the second moment
      ! A R^2/4 * (2 pi/n) (2 + cos(2 pi/n))/(3 sin(2 pi/n))
      b = 2*pi/(6*r)
      ix = rho*s%volume*h**2/16*b*(2 + cos(b))/(3*sin(b))
      call check('cylinder: inertia', flat(s%inertia), flat(diagonal([1, 1, 0]*rho*s%volume &
        *length**2/12 + [1, 1, 2]*ix)), 1e-13_wp*ix)
    end do
  end subroutine built_of_parts

  !> Inertia the same about every axis; the volume, of second order in the refinement or better,
  !! goes to the 0.280 H^3 that is published for round legs.
  subroutine tetrapod()
    type(shape_t) :: s
    real(wp), parameter :: h = 0.06_wp
    real(wp) :: volume(4), j
    integer :: r

    do r = 1, 4
      s = shape_of('kind="tetrapod" size=.06 refinement='//to_text(r))
      volume(r) = s%volume/h**3
      j = (s%inertia(1, 1) + s%inertia(2, 2) + s%inertia(3, 3))/3
      call check('tetrapod: isotropic', flat(s%inertia), flat(diagonal([j, j, j])), 1e-13_wp*j)
    end do
    call check('tetrapod: volume', volume(4) + (volume(4) - volume(2))/3, 0.280_wp, 5e-4_wp)
    call check('tetrapod: at least second order', volume(2) > volume(4) &
      .and. volume(1) - volume(2) > 4*(volume(2) - volume(4)))
  end subroutine tetrapod

end module test_mass_properties_m
