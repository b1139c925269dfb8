!> Cutting of tetrahedra and boxes by planes against closed forms and against each other.
module test_polyhedron_m
  use check_m, only: check, wp
  use polyhedron_m, only: polyhedron_t, polyhedron_of_tet, polyhedron_of_box, cut_polyhedron, &
    polyhedron_moments, polyhedron_moments_below, tet_volume, tet_moments_below, &
    box_clip_moments_below
  use random_counter_m, only: uniform
  implicit none
  private
  public :: test_polyhedron

  integer :: n_drawn = 0

contains

  subroutine test_polyhedron()
    call whole_bodies()
    call tet_below_plane()
    call plane_through_corners()
    call cells_fill_the_tet()
  end subroutine test_polyhedron

  !> Random points of the unit cube, the same in each run.
  function draw_points(m) result(x)
    integer, intent(in) :: m
    real(wp) :: x(3, m)
    integer :: d, v

    do v = 1, m
      n_drawn = n_drawn + 1
      x(:, v) = [(uniform(12345, n_drawn, d), d=1, 3)]
    end do
  end function draw_points

  subroutine whole_bodies()
    type(polyhedron_t) :: p
    real(wp) :: c(3, 4), volume, moment(3)

    call polyhedron_of_box([1.0_wp, 2.0_wp, 3.0_wp], [2.0_wp, 4.0_wp, 6.0_wp], p)
    call polyhedron_moments(p, volume, moment)
    call check('volume of a box', volume, 6.0_wp, 1e-14_wp)
    call check('moment of a box', moment, [9.0_wp, 18.0_wp, 27.0_wp], 1e-13_wp)
    c = draw_points(4)
    call polyhedron_of_tet(c, p)
    call polyhedron_moments(p, volume, moment)
    call check('volume of a tetrahedron', volume, abs(tet_volume(c)), 1e-16_wp)
    call check('moment of a tetrahedron', moment, volume*sum(c, 2)/4.0_wp, 1e-16_wp)
  end subroutine whole_bodies

  !> Three ways to the same numbers, and the two sides of a plane add up.
  subroutine tet_below_plane()
    type(polyhedron_t) :: p
    real(wp) :: c(3, 4), n(3), d, v1, m1(3), v2, m2(3), v3, m3(3)
    integer :: t

    do t = 1, 1000
      c = draw_points(4)
      n = 2.0_wp*reshape(draw_points(1), [3]) - 1.0_wp
      d = dot_product(n, reshape(draw_points(1), [3]))
      call tet_moments_below(c, n, d, v1, m1)
      call polyhedron_of_tet(c, p)
      call polyhedron_moments_below(p, n, d, v2, m2)
      call tet_moments_below(c, -n, -d, v3, m3)
      call check('corner graph against closed form', [v1, m1], [v2, m2], 1e-15_wp)
      call check('both sides of a plane add up', [v1 + v3, m1 + m3], &
        abs(tet_volume(c))*[1.0_wp, sum(c, 2)/4.0_wp], 1e-15_wp)
    end do
  end subroutine tet_below_plane

  !> Unit corner tetrahedron and unit box cut exactly through corners, edges and faces.
  subroutine plane_through_corners()
    type(polyhedron_t) :: p
    real(wp) :: c(3, 4), n(3), volume, moment(3), lower, upper
    integer :: a, d

    c = 0.0_wp
    c(1, 2) = 1.0_wp
    c(2, 3) = 1.0_wp
    c(3, 4) = 1.0_wp
    call check('body above the plane', volume_of_part(c, [0.0_wp, 0.0_wp, 1.0_wp], 0.0_wp), 0.0_wp)
    call check('face on the plane, body below', &
      volume_of_part(c, [0.0_wp, 0.0_wp, -1.0_wp], 0.0_wp), 1.0_wp/6.0_wp)
    call check('half by a plane through an edge', &
               volume_of_part(c, [1.0_wp, -1.0_wp, 0.0_wp], 0.0_wp), 1.0_wp/12.0_wp, 1e-17_wp)
    do a = 0, 26
      n = modulo(a/[1, 3, 9], 3) - 1.0_wp
      if (a == 13) cycle   ! no direction
      do d = -3, 3
        call polyhedron_of_box([0.0_wp, 0.0_wp, 0.0_wp], [1.0_wp, 1.0_wp, 1.0_wp], p)
        call polyhedron_moments_below(p, n, real(d, wp), lower, moment)
        call polyhedron_moments_below(p, -n, -real(d, wp), upper, moment)
        call check('box cut through its corners', lower + upper, 1.0_wp, 1e-15_wp)
        call check('no less than nothing', lower >= 0.0_wp)
      end do
    end do
    call polyhedron_of_box([0.0_wp, 0.0_wp, 0.0_wp], [1.0_wp, 1.0_wp, 1.0_wp], p)
    do d = 1, 3
      n = 0.0_wp
      n(d) = 1.0_wp
      call cut_polyhedron(p, n, 1.0_wp)
      call cut_polyhedron(p, n + 1.0_wp, 2.0_wp)
    end do
    call polyhedron_moments(p, volume, moment)
    call check('box cut by three oblique planes through corners', volume, reference_cut(), 1e-15_wp)
  end subroutine plane_through_corners

  !> Volume of the part of a tetrahedron with n.x <= d.
  real(wp) function volume_of_part(corner, n, d) result(volume)
    real(wp), intent(in) :: corner(3, 4), n(3), d
    real(wp) :: moment(3)

    call tet_moments_below(corner, n, d, volume, moment)
  end function volume_of_part

  !> Unit box below x + y + z + x_d <= 2 for d = 1..3, as the tetrahedra of its symmetric sixths.
  real(wp) function reference_cut() result(volume)
    real(wp) :: c(3, 4)

    ! In the sixth x >= y >= z only d = 1 matters: 2x + y + z <= 2 there.
    c = 0.0_wp
    c(1, 2:4) = 1.0_wp
    c(2, 3:4) = 1.0_wp
    c(3, 4) = 1.0_wp
    volume = 6.0_wp*volume_of_part(c, [2.0_wp, 1.0_wp, 1.0_wp], 2.0_wp)
  end function reference_cut

  !> The parts of a tetrahedron in the cells of a box add up to it, also below a plane.
  subroutine cells_fill_the_tet()
    integer, parameter :: m = 4
    real(wp) :: c(3, 4), lo(3), v, mom(3), total, moment(3), whole, whole_moment(3), n(3)
    integer :: t, i

    do t = 1, 20
      c = draw_points(4)
      if (t <= 10) c = anint(c*real(m, wp))/real(m, wp)   ! corners on the planes of the cells
      n = 2.0_wp*reshape(draw_points(1), [3]) - 1.0_wp
      call tet_moments_below(c, n, 0.1_wp, whole, whole_moment)
      total = 0.0_wp
      moment = 0.0_wp
      do i = 0, m**3 - 1
        lo = modulo(i/[1, m, m**2], m)/real(m, wp)
        call box_clip_moments_below(c, lo, lo + 1.0_wp/real(m, wp), n, 0.1_wp, v, mom)
        total = total + v
        moment = moment + mom
      end do
      call check('cells fill the tetrahedron below a plane', [total, moment], &
        [whole, whole_moment], 1e-15_wp)
    end do
  end subroutine cells_fill_the_tet

end module test_polyhedron_m
