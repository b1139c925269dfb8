!> Volume, centroid and inertia from tetrahedra against closed forms and surface integrals.
module test_mass_properties_m
  use check_m, only: check, wp, pi
  use case_types_m, only: shape_input_t
  use tet_mesh_m, only: shape_t
  use shapes_builtin_m, only: make_shape
  use surface_nets_m, only: moments_of_net
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
    integer :: r, m

    do r = 1, 2
      call build('sphere', [2*a, 0.0_wp, 0.0_wp], r, s)
      call check('sphere: isotropic', flat(s%inertia), &
                 flat(diagonal(spread(s%inertia(1, 1), 1, 3))), 1e-13_wp*want)
      call by_surface(s, [(1 + 3*m, m=0, size(s%triangle, 2))], &
                      reshape(s%triangle, [size(s%triangle)]))
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

    call build('hexapod', [0.02_wp, 0.0_wp, 0.0_wp], 2, s)
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

  !> Volumes against closed forms; volume and inertia of every form against integrals over facets.
  subroutine built_of_parts()
    type(shape_t) :: s
    real(wp), parameter :: h = 0.06_wp, size_m(3) = [h, 0.1_wp, 0.0_wp]
    character(9), parameter :: kinds(4) = ['cylinder ', 'tetrapod ', 'dolos    ', 'reef_cube']
    real(wp) :: volume(4), octagon, a, b, ix
    integer :: r, k

    ! A dolos: four tapered legs of regular octagons, two stretches of fluke, the shank, and four
    ! wedges of depth u - a and height 2(w - u + a) between u = a and w (half side, half waist).
    octagon = 2*(sqrt(2.0_wp) - 1)
    a = 0.16_wp*tan(pi/8)
    b = 0.16_wp - a
    volume(3) = octagon*(4*0.34_wp/3*(0.32_wp**2 + 0.32_wp*0.2_wp + 0.2_wp**2) + 3*0.32_wp**3 &
      + 0.04_wp*0.32_wp**2) + 4*(0.16_wp*b**2 - 2*b**3/3)
    volume(4) = 12*0.2_wp**2*0.6_wp + 8*0.2_wp**3   ! twelve bars, eight corners
    do r = 1, 3
      do k = 1, size(kinds)
        call build(trim(kinds(k)), size_m, r, s)
        if (k >= 3) call check(trim(kinds(k))//': volume', s%volume, volume(k)*h**3, 1e-14_wp*h**3)
        call by_surface(s, s%facet, s%facet_point)
      end do
      call build('cylinder', size_m, r, s)
      call check('cylinder: volume', s%volume, 0.25_wp*pi*h**2*size_m(2), 1e-14_wp*h**3)
      ! a polygon of n sides and the area of the circle has the second moment
      ! A R^2/4 * (2 pi/n) (2 + cos(2 pi/n))/(3 sin(2 pi/n))
      b = 2*pi/(6*r)
      ix = rho*s%volume*h**2/16*b*(2 + cos(b))/(3*sin(b))
      call check('cylinder: inertia', flat(s%inertia), flat(diagonal([ix + rho*s%volume &
        *size_m(2)**2/12, ix + rho*s%volume*size_m(2)**2/12, 2*ix])), 1e-13_wp*ix)
    end do
  end subroutine built_of_parts

  !> Volume and inertia of a block from the polygons of its surface, without tetrahedra.
  subroutine by_surface(s, facet, corner)
    type(shape_t), intent(in) :: s
    integer, intent(in) :: facet(:), corner(:)
    real(wp) :: volume, second(3, 3), inertia(3, 3)

    call moments_of_net(s%point, facet, corner, volume, second)
    inertia = rho*(diagonal(spread(second(1, 1) + second(2, 2) + second(3, 3), 1, 3)) - second)
    call check('volume by the surface', s%volume, volume, 1e-13_wp*volume)
    call check('inertia by the surface', flat(s%inertia), flat(inertia), 1e-13_wp*maxval(inertia))
  end subroutine by_surface

  !> Inertia the same about every axis; the volume, of second order in the refinement or better,
  !! goes to the 0.280 H^3 that is published for round legs.
  subroutine tetrapod()
    type(shape_t) :: s
    real(wp), parameter :: h = 0.06_wp
    real(wp) :: volume(4), j
    integer :: r

    do r = 1, 4
      call build('tetrapod', [h, 0.0_wp, 0.0_wp], r, s)
      volume(r) = s%volume/h**3
      j = (s%inertia(1, 1) + s%inertia(2, 2) + s%inertia(3, 3))/3
      call check('tetrapod: isotropic', flat(s%inertia), flat(diagonal([j, j, j])), 1e-13_wp*j)
    end do
    call check('tetrapod: volume', volume(4) + (volume(4) - volume(2))/3, 0.280_wp, 5e-4_wp)
    call check('tetrapod: at least second order', volume(2) > volume(4) &
      .and. volume(1) - volume(2) > 4*(volume(2) - volume(4)))
  end subroutine tetrapod

end module test_mass_properties_m
