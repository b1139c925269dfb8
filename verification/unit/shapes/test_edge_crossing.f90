!> Two edges that cross: depth, normal, weight.
module test_edge_crossing_m
  use check_m, only: check, wp
  use edge_crossing_m, only: edge_t, crossing_t, cross_edges, turn_before, way_apart
  implicit none
  private
  public :: test_edge_crossing

  real(wp), parameter :: depth = 0.01_wp, most = 0.1_wp
  real(wp) :: sine = 1.0_wp   !! of the angle between keel and ridge

contains

  subroutine test_edge_crossing()
    call check_crossing()
    call check_fading()
    call check_bounds()
  end subroutine test_edge_crossing

  !> The ridge of a roof along y, from -1 to 1, at height zero.
  function ridge() result(edge)
    type(edge_t) :: edge

    edge%start = [0.0_wp, -1.0_wp, 0.0_wp]
    edge%along = [0.0_wp, 1.0_wp, 0.0_wp]
    edge%extent = 2.0_wp
    edge%into(:, 1) = sqrt(0.5_wp)*[1.0_wp, 0.0_wp, -1.0_wp]
    edge%into(:, 2) = sqrt(0.5_wp)*[-1.0_wp, 0.0_wp, -1.0_wp]
    edge%outward = [0.0_wp, 0.0_wp, 1.0_wp]
  end function ridge

  !> A keel from -1 to 1, at an angle whose sine is `sine` to the ridge, that hangs down to `depth`
  !! below it, over place y of it; lifted.
  function keel(y, lift) result(edge)
    real(wp), intent(in) :: y
    real(wp), intent(in), optional :: lift
    type(edge_t) :: edge

    associate (cosine => sqrt(1.0_wp - sine**2))
      edge%start = [-sine, y - cosine, -depth]
      edge%along = [sine, cosine, 0.0_wp]
      edge%extent = 2.0_wp
      edge%into(:, 1) = sqrt(0.5_wp)*[-cosine, sine, 1.0_wp]
      edge%into(:, 2) = sqrt(0.5_wp)*[cosine, -sine, 1.0_wp]
    end associate
    edge%outward = [0.0_wp, 0.0_wp, -1.0_wp]
    if (present(lift)) edge%start(3) = edge%start(3) + lift
  end function keel

  subroutine check_crossing()
    type(crossing_t) :: crossing
    type(edge_t) :: above

    call cross_edges(keel(0.3_wp), ridge(), 0.0_wp, most, crossing)
    call check('depth', crossing%depth, depth, 1.0e-15_wp)
    call check('counts', crossing%weight, 1.0_wp)
    call check('from the keel down', crossing%normal, [0.0_wp, 0.0_wp, -1.0_wp], 1.0e-15_wp)
    call check('half way', crossing%place, [0.0_wp, 0.3_wp, -0.5_wp*depth], 1.0e-15_wp)
    call cross_edges(keel(1.2_wp), ridge(), 0.0_wp, most, crossing)
    call check('not beyond the end', crossing%weight, 0.0_wp)
    above = keel(0.3_wp, 2*depth)
    call cross_edges(above, ridge(), 0.0_wp, most, crossing)
    call check('not above', crossing%weight, 0.0_wp)
    call cross_edges(above, ridge(), -2*depth, most, crossing)
    call check('but looked at before', crossing%depth, -depth, 1.0e-15_wp)
    call cross_edges(keel(0.3_wp, -most), ridge(), 0.0_wp, most, crossing)
    call check('not too deep', crossing%weight, 0.0_wp)
  end subroutine check_crossing

  !> Towards the end of the ridge the weight falls, in no less than a hundredth of the edge, and the
  !! further the less the edges cross.
  subroutine check_fading()
    real(wp), parameter :: step = 1.0e-4_wp, width = 0.02_wp, sines(3) = [1.0_wp, 0.3_wp, 0.05_wp]
    real(wp) :: weight(2)
    type(crossing_t) :: crossing
    integer :: i, m, faded

    do m = 1, 3
      sine = sines(m)
      faded = 0
      weight = 1.0_wp
      do i = 0, nint(2*width/(sine*step))
        call cross_edges(keel(1.0_wp - 1.5_wp*width/sine + i*step), ridge(), 0.0_wp, most, crossing)
        weight = [weight(2), crossing%weight]
        call check('falls', weight(2) <= weight(1) .and. weight(1) - weight(2) < 2*step*sine/width &
          + merge(0.02_wp, 0.0_wp, weight(2) <= 0.0_wp))
        if (weight(2) > 0.05_wp .and. weight(2) < 0.95_wp) faded = faded + 1
      end do
      call check('down to nothing', weight(2), 0.0_wp)
      call check('by and by', faded > 30)
    end do
    sine = 1.0_wp
  end subroutine check_fading

  !> A keel on a ridge may cross it at once, two ridges only after a turn, and none before they have
  !! come together: a third of the gap, for the nearest places move further than the bodies.
  subroutine check_bounds()
    type(edge_t) :: back

    call check('may cross at once', turn_before(keel(0.3_wp), ridge()), 0.0_wp)
    back = keel(0.3_wp)
    back%into(3, :) = -back%into(3, :)
    call check('two ridges only after a turn', turn_before(back, ridge()) > 0.1_wp)
    call check('touching already', way_apart(keel(0.3_wp), ridge(), 0.01_wp) <= 0.0_wp)
    call check('a gap to go', way_apart(keel(0.3_wp, 0.5_wp), ridge(), &
      0.01_wp), (0.5_wp - depth)/3, 1.0e-15_wp)
  end subroutine check_bounds

end module test_edge_crossing_m
