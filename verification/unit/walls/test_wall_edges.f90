!> Openings behind plane walls, which cut cells have an edge, and what a block holds in faces: at
!! the edges of an upright box, and none of a sphere.
module test_wall_edges_m
  use check_m, only: check, wp
  use errors_m, only: to_text
  use wall_plane_m, only: apertures_of_plane
  use effective_aperture_m, only: more_inertia
  use one_body_m, only: one_body_t, place, slip
  implicit none
  private
  public :: test_wall_edges

  type(one_body_t) :: body

contains

  subroutine test_wall_edges()
    call behind_planes()
    call upright_box()
    call turned_box()
    call tip_and_layer()
    call sphere()
  end subroutine test_wall_edges

  !> A triangle of solid with links of a half, one that reaches past the next faces, a flat wall.
  subroutine behind_planes()
    call check('small triangle', apertures_of_plane([1.0_wp, 1.0_wp, 0.0_wp], 0.125_wp), &
               [1.5_wp, 1.5_wp, 1.75_wp], 1.0e-12_wp)
    call check('large triangle, from the other side', apertures_of_plane([0.0_wp, -3.0_wp, &
      3.0_wp], 0.5625_wp), [2.0_wp - 2.0_wp*0.5625_wp, sqrt(0.875_wp), sqrt(0.875_wp)], 1.0e-12_wp)
    call check('flat wall', apertures_of_plane([0.0_wp, 0.0_wp, 0.2_wp], 0.7_wp), &
               [0.6_wp, 0.6_wp, 2.0_wp], 1.0e-12_wp)
  end subroutine behind_planes

  !> x and y from 0.24 to 0.53, z from 0.21 to 0.57, cells of 0.1.
  subroutine upright_box()
    call build('kind="box" size=.29,.29,.36', 'position=.385,.385,.39')
    call check('along a flat side', edge([6, 4, 4]) + edge([4, 6, 4]) + edge([4, 4, 3]), 0.0_wp)
    call check('an edge that holds the centre of its cell', edge([3, 3, 4]), 1.0_wp)
    call check('a corner', edge([3, 3, 3]), 1.0_wp)
    call check('an edge beside the centre of its cell', edge([6, 6, 4]), 0.0_wp)
    call held_at_edge()
    call build('kind="box" size=.29,.29,.36', 'position=.385,.385,.39/ &body shape="b" ' &
      //'position=.045,.385,.39')
    call check('none in a gap', body%solid%effective(3, 3, 4, 1), body%solid%aperture(3, 3, 4, 1))
  end subroutine upright_box

  !> Cell (3, 3, 4) holds 0.36 of solid: a plane wall would leave 2 - sqrt(0.72) of the faces of a
  !! direction open, the edge leaves 1.4.
  subroutine held_at_edge()
    real(wp), parameter :: plane = 2.0_wp - sqrt(0.72_wp)
    real(wp), parameter :: r = 1.0_wp + (1.4_wp - plane - 0.1_wp)/plane
    real(wp), parameter :: inertia = 0.5_wp*(1.0_wp + r**3.5_wp)
    integer :: m, n

    associate (solid => body%solid)
      call check('held beside an edge', solid%effective(3, 3, 4, 1), 1.0_wp/inertia, 1.0e-12_wp)
      call check('and in it', solid%effective(4, 3, 4, 1), 0.4_wp/inertia, 1.0e-12_wp)
      call check('none along the edge', solid%effective(3, 3, 5, 3), solid%aperture(3, 3, 5, 3))
      call check('none at a flat side', solid%effective(4, 6, 4, 2), solid%aperture(4, 6, 4, 2))
      n = 0
      do m = solid%first_held(1), solid%first_held(2) - 1
        if (all(solid%held_face(:, m) == [3, 3, 4, 1])) n = m
      end do
      call check('the list has it', n > 0)
      if (n > 0) call check('its share', solid%held_share(n), 1.0_wp - 1.0_wp/inertia, 1.0e-12_wp)
    end associate
  end subroutine held_at_edge

  !> A slightly turned edge that reaches into a cell by 0.2 through one face, of which it takes 0.4:
  !! behind it are 0.9 of fluid, so the inertia is larger by (2/3) 0.4^2/0.9 only. An edge that
  !! fills a cell but for a layer of 0.1 on two sides: by R or that bound.
  subroutine tip_and_layer()
    real(wp), parameter :: plane = sqrt(2.0_wp*0.19_wp)
    real(wp) :: w(3, 2), more(3), layer

    w(:, 1) = [0.6_wp, 0.99_wp, 0.96_wp]
    w(:, 2) = [1.0_wp, 1.0_wp, 0.96_wp]
    more = more_inertia(w, apertures_of_plane(w(:, 2) - w(:, 1), 0.04_wp), 0.04_wp)
    call check('tip', more(1), 0.16_wp/1.35_wp, 1.0e-12_wp)
    w(:, 1) = [0.1_wp, 0.1_wp, 0.19_wp]
    w(:, 2) = [1.0_wp, 1.0_wp, 0.19_wp]
    more = more_inertia(w, apertures_of_plane(w(:, 2) - w(:, 1), 0.81_wp), 0.81_wp)
    layer = min(0.81_wp/0.15_wp, (1.0_wp/plane)**3.5_wp - 1.0_wp)
    call check('layer', more, [layer, layer, 0.0_wp], 1.0e-10_wp)
  end subroutine tip_and_layer

  !> By 45 degrees about z, its edges on planes of the grid: all walls are plane.
  subroutine turned_box()
    real(wp), parameter :: width = 0.4_wp*sqrt(2.0_wp)

    call build('kind="box" size='//to_text([width, width, 0.4_wp]), 'position=3*.5 axis=0,0,1 ' &
               //'angle_deg=45')
    call check('plane walls', maxval(body%solid%edge(:body%solid%n_cut)), 0.0_wp, 1.0e-9_wp)
    call check('there are some', body%solid%n_cut > 10)
    call check('no held fluid', body%solid%aperture - body%solid%effective, 0.0_wp, 1.0e-9_wp)
  end subroutine turned_box

  !> Eight cells wide.
  subroutine sphere()
    call build('kind="sphere" size=.8', 'position=.513,.487,.505')
    call check('sphere: none', maxval(body%solid%edge(:body%solid%n_cut)), 0.0_wp)
    call check('sphere: little held', maxval(body%solid%aperture - body%solid%effective) < 0.1_wp)
  end subroutine sphere

  !> Variables of &shape and &body.
  subroutine build(shape, variables)
    character(*), intent(in) :: shape, variables

    call place('&grid cells=3*10 length=3*1/ &shape name="b" refinement=5 '//shape &
               //'/ &body shape="b" '//variables//'/ '//slip, body)
  end subroutine build

  real(wp) function edge(c)
    integer, intent(in) :: c(3)

    edge = body%solid%edge(body%solid%cut(c(1), c(2), c(3)))
  end function edge

end module test_wall_edges_m
