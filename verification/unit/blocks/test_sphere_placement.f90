!> Contact spheres: heights of a hexapod at rest, spheres inside the block, and their spacing.
module test_sphere_placement_m
  use check_m, only: check, wp
  use errors_m, only: to_text
  use case_text_m, only: shape_of
  use vectors_m, only: cross
  use tet_mesh_m, only: shape_t
  use contact_sphere_placement_m, only: height_errors
  implicit none
  private
  public :: test_sphere_placement

  real(wp), parameter :: d = 0.02_wp                     !! edge of the cubes of the hexapod [m]
  !> Heights on one, two, three legs: 3/2 d, sqrt(2) d, 5/2 d/sqrt(3).
  real(wp), parameter :: true_heights(3) = d*[1.5_wp, sqrt(2.0_wp), 2.5_wp/sqrt(3.0_wp)]

contains

  subroutine test_sphere_placement()
    call centroid_heights()
    call inscribed_spheres()
    call dense_heights()
    call dense_inside('hexapod  ')
    call dense_inside('tetrapod ')
    call dense_inside('dolos    ')
    call dense_inside('cylinder ')
    call spacing()
  end subroutine test_sphere_placement

  !> A hexapod of cubes of that edge, or another shape three times as large.
  subroutine build(variables, s)
    character(*), intent(in) :: variables   !! of &shape
    type(shape_t), intent(out) :: s

    s = shape_of(variables//' size='//trim(merge('.02    ', merge('.06,.06', '.06    ', &
      index(variables, 'cylinder') > 0), index(variables, 'hexapod') > 0)))
  end subroutine build

  !> Height of the centroid over a floor below direction -u, by the spheres [m].
  pure real(wp) function height(s, u) result(h)
    type(shape_t), intent(in) :: s
    integer, intent(in) :: u(3)

    h = maxval(matmul(u/norm2(real(u, wp)), s%sphere_centre) + s%sphere_radius)
  end function height

  pure function heights(s) result(h)
    type(shape_t), intent(in) :: s
    real(wp) :: h(3)

    h = [height(s, [1, 0, 0]), height(s, [1, 1, 0]), height(s, [1, 1, 1])]
  end function heights

  !> The table of theory.md [m].
  subroutine centroid_heights()
    type(shape_t) :: s
    real(wp) :: lowest, highest

    call build('kind="hexapod" spheres="centroid" refinement=1', s)
    call check('centroid 1: heights', heights(s), [31.83e-3_wp, 28.04e-3_wp, 27.04e-3_wp], 5e-6_wp)
    call check('they differ from the true ones', any(abs(heights(s) - true_heights) > 1.5e-3_wp))
    call height_errors(s, lowest, highest)
    call check('warned of: too low', lowest < minval(heights(s) - true_heights) + 1e-4_wp)
    call check('warned of: beyond it', highest > maxval(heights(s) - true_heights) - 3e-4_wp)
    call build('kind="sphere" refinement=1', s)
    call height_errors(s, lowest, highest)
    call check('sphere: no warning', [lowest, highest], [0.0_wp, 0.0_wp])
  end subroutine centroid_heights

  !> A sphere inscribed in a tetrahedron under the surface touches all four faces.
  subroutine inscribed_spheres()
    type(shape_t) :: s
    real(wp) :: x(3, 4), n(3)
    integer :: t, m, a
    integer, parameter :: others(3, 4) = reshape([2, 3, 4, 1, 3, 4, 1, 2, 4, 1, 2, 3], [3, 4])

    call build('kind="tetrapod" spheres="inscribed" refinement=2', s)
    m = 0
    do t = 1, size(s%tet, 2)
      if (.not. any(s%triangle_tet == t)) cycle
      m = m + 1
      x = s%point(:, s%tet(:, t))
      do a = 1, 4
        associate (o => others(:, a))
          n = cross(x(:, o(2)) - x(:, o(1)), x(:, o(3)) - x(:, o(1)))
          call check('inscribed: each touches four faces', abs(dot_product(s%sphere_centre(:, m) &
            - x(:, o(1)), n))/norm2(n)/s%sphere_radius(m), 1.0_wp, 1e-12_wp)
        end associate
      end do
    end do
    call check('inscribed: one for each tetrahedron at the surface', size(s%sphere_radius), m)
    call build('kind="hexapod" spheres="inscribed" refinement=1', s)
    call check('inscribed 1: heights', heights(s), [30.00e-3_wp, 26.53e-3_wp, 25.77e-3_wp], 5e-6_wp)
  end subroutine inscribed_spheres

  !> Within 0.5 mm of the true heights in all three poses, and in their order.
  subroutine dense_heights()
    type(shape_t) :: s
    real(wp) :: h(3), lowest, highest
    integer :: r

    do r = 1, 2
      call build('kind="hexapod" spheres="dense" refinement='//to_text(r), s)
      h = heights(s)
      call check('hexapod, dense: heights', h, true_heights, 0.5e-3_wp)
      call check('hexapod, dense: order of the heights', h(2) < h(3) .and. h(3) < h(1))
      call height_errors(s, lowest, highest)
      call check('hexapod, dense: never beyond the surface', highest, 0.0_wp, 1e-9_wp)
      call check('hexapod, dense: never 0.5 mm short of it', lowest > -0.5e-3_wp)
      call check('dense: number', size(s%sphere_radius) > 1500 .and. size(s%sphere_radius) < 3000)
    end do
  end subroutine dense_heights

  !> No ball reaches through the surface, and every point of the surface has a ball near. Farthest
  !! are points half way between two balls of the first ring, at a right edge: sqrt(1/4 + 1/8) - 1/4
  !! of the spacing.
  subroutine dense_inside(kind)
    character(*), intent(in) :: kind
    type(shape_t) :: s
    real(wp) :: p(3), q(3, 3), gap, out, a, w(2)
    integer :: m, i, k
    integer, parameter :: n = 8   ! samples along each edge of a triangle

    call build('kind="'//trim(kind)//'" spheres="dense" refinement=1', s)
    a = 0.1_wp*s%smallest_edge
    out = 0.0_wp
    gap = 0.0_wp
    do m = 1, size(s%triangle, 2)
      q = s%point(:, s%triangle(:, m))
      do i = 0, n
        do k = 0, n - i
          w = real([i, k], wp)/n
          p = q(:, 1) + w(1)*(q(:, 2) - q(:, 1)) + w(2)*(q(:, 3) - q(:, 1))
          associate (depth => norm2(s%sphere_centre - spread(p, 2, size(s%sphere_radius)), 1) &
                     - s%sphere_radius)
            out = max(out, -minval(depth))
            gap = max(gap, minval(depth))
          end associate
        end do
      end do
    end do
    call check(trim(kind)//', dense: no ball reaches out of the surface', out, 0.0_wp, 1e-7_wp*a)
    call check(trim(kind)//', dense: every point of the surface has a ball near', gap, 0.0_wp, &
               (sqrt(0.375_wp) - 0.25_wp)*a*1.02_wp)
  end subroutine dense_inside

  !> The number of balls goes with the inverse square of the spacing.
  subroutine spacing()
    type(shape_t) :: s
    integer :: n(2), i

    do i = 1, 2
      call build('kind="hexapod" spheres="dense" refinement=1 sphere_spacing=' &
        //to_text(0.002_wp/i), s)
      n(i) = size(s%sphere_radius)
    end do
    call check('half the spacing, four times the balls', real(n(2), wp)/n(1), 4.0_wp, 0.6_wp)
  end subroutine spacing

end module test_sphere_placement_m
