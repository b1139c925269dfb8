!> Tetrapod, dolos and cylinder: published proportions, symmetry, closed surfaces.
module test_armour_units_m
  use check_m, only: check, wp, pi
  use vectors_m, only: cross, quaternion_from_axis
  use rotations_m, only: rotate
  use tet_mesh_m, only: shape_t
  use armour_units_m, only: build_cylinder, build_tetrapod, build_dolos
  use surface_nets_m, only: check_net
  implicit none
  private
  public :: test_armour_units

  real(wp), parameter :: z(3) = [0.0_wp, 0.0_wp, 1.0_wp]
  integer :: r

contains

  subroutine test_armour_units()
    do r = 1, 3
      call check_tetrapod(r)
      call check_dolos(r)
      call check_cylinder(r)
    end do
  end subroutine test_armour_units

  !> Shore Protection Manual (1984), figure 7-109: for a height of 1 the tips are 0.302 wide, the
  !! roots 0.470, the legs, if round, 0.477 long. Each root meets each other one in a point; turns
  !! that swap the legs change nothing.
  subroutine check_tetrapod(refinement)
    integer, intent(in) :: refinement
    type(shape_t) :: s
    real(wp) :: tip, root, angle
    integer :: d, n

    call build_tetrapod(1.0_wp, refinement, s)
    n = 6*refinement
    tip = maxval(s%point(3, :))
    angle = 2*pi/n
    root = 0.235_wp*sqrt(angle/sin(angle))   ! n triangles root^2/2 sin(angle) make up the circle
    call check('tetrapod: height', tip - minval(s%point(3, :)), 1.0_wp, 1.0e-15_wp)
    call check('tetrapod: tip', area_above(s, tip), pi/4*0.302_wp**2, 1.0e-14_wp)
    if (refinement == 3) call check('tetrapod: legs', tip - root/sqrt(2.0_wp), 0.477_wp, 5.0e-3_wp)
    call check('tetrapod: corners of the roots, six of them shared', &
      count(abs(norm2(s%point, 1) - sqrt(1.5_wp)*root) < 1.0e-9_wp), 4*n - 6)
    do d = 1, 3
      call check('tetrapod: leg for leg', is_kept(s, quaternion_from_axis(z, d*2*pi/3)))
    end do
    call check('tetrapod: first leg for second', is_kept(s, &
      quaternion_from_axis(z + [sqrt(8.0_wp), 0.0_wp, -1.0_wp]/3, pi)))
    call check_net('tetrapod', s%point, s%facet, s%facet_point, 2)
  end subroutine check_tetrapod

  !> Figure 7-111: for a height of 1 the waist is 0.32 wide, the tips 0.20. One fluke is the other
  !! turned by a quarter, and each is its own mirror image.
  subroutine check_dolos(refinement)
    integer, intent(in) :: refinement
    type(shape_t) :: s
    integer :: d

    call build_dolos(1.0_wp, refinement, s)
    call check('dolos: extent', maxval(s%point, 2) - minval(s%point, 2), [1.0_wp, 1.0_wp, 1.0_wp], &
      1.0e-15_wp)
    do d = 1, 2
      associate (tips => pack(s%point(d, :), s%point(3, :) > 0.5_wp - 1.0e-12_wp))
        call check('dolos: tip', maxval(tips) - minval(tips), 0.2_wp, 1.0e-15_wp)
      end associate
    end do
    associate (shank => pack(s%point(3, :), abs(s%point(1, :)) < 0.18_wp + 1.0e-12_wp))
      call check('dolos: waist', maxval(shank) - minval(shank), 0.32_wp, 1.0e-15_wp)
    end associate
    call check('dolos: its tip', area_above(s, 0.5_wp), 2*(sqrt(2.0_wp) - 1)*0.2_wp**2, 1.0e-15_wp)
    call check('dolos: its flukes', is_kept(s, quaternion_from_axis([0.0_wp, 1.0_wp, 1.0_wp], pi)))
    call check('dolos: its mirror image', is_found(s, s%point*spread([1.0_wp, 1.0_wp, -1.0_wp], 2, &
      size(s%point, 2))))
    call check_net('dolos', s%point, s%facet, s%facet_point, 2)
  end subroutine check_dolos

  !> A prism of 6 r sides with ends as large as the circle.
  subroutine check_cylinder(refinement)
    integer, intent(in) :: refinement
    type(shape_t) :: s

    call build_cylinder(2.0_wp, 3.0_wp, refinement, s)
    call check('cylinder: ends', area_above(s, 1.5_wp), pi, 1.0e-13_wp)
    call check('cylinder: side for side', is_kept(s, quaternion_from_axis(z, pi/(3*refinement))))
    call check_net('cylinder', s%point, s%facet, s%facet_point, 2)
    call check('cylinder: faces', size(s%facet) - 1, 2 + 6*refinement)
  end subroutine check_cylinder

  !> Area of the facet that lies at a height.
  pure real(wp) function area_above(s, height) result(area)
    type(shape_t), intent(in) :: s
    real(wp), intent(in) :: height
    real(wp) :: twice(3)
    integer :: f, k, m

    area = 0.0_wp
    do f = 1, size(s%facet) - 1
      associate (c => s%facet_point(s%facet(f):s%facet(f + 1) - 1))
        if (any(abs(s%point(3, c) - height) > 1.0e-12_wp)) cycle
        m = size(c)
        twice = 0.0_wp
        do k = 1, m
          twice = twice + cross(s%point(:, c(k)), s%point(:, c(1 + mod(k, m))))
        end do
        area = area + 0.5_wp*twice(3)
      end associate
    end do
  end function area_above

  !> Whether a turn puts every corner of the surface in the place of another.
  pure logical function is_kept(s, q)
    type(shape_t), intent(in) :: s
    real(wp), intent(in) :: q(4)
    integer :: c

    is_kept = is_found(s, reshape([(rotate(q, s%point(:, c)), c=1, size(s%point, 2))], &
      shape(s%point)))
  end function is_kept

  !> Whether corners of the surface, put elsewhere, are in the place of others.
  pure logical function is_found(s, moved)
    type(shape_t), intent(in) :: s
    real(wp), intent(in) :: moved(:, :)
    integer :: k, c

    is_found = .true.
    do k = 1, size(s%facet_point)
      is_found = is_found .and. any([(norm2(s%point(:, s%facet_point(c)) &
        - moved(:, s%facet_point(k))) < 1.0e-12_wp, c=1, size(s%facet_point))])
    end do
  end function is_found

end module test_armour_units_m
