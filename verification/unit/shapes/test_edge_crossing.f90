!> Two edges that cross: depth, normal, weight, and how the weight changes with position.
module test_edge_crossing_m
  use check_m, only: check, wp
  use vectors_m, only: rotation_matrix, quaternion_from_axis
  use edge_crossing_m, only: edge_t, crossing_t, cross_edges, weight_slope, turn_before, way_apart
  implicit none
  private
  public :: test_edge_crossing

  real(wp), parameter :: depth = 0.01_wp, most = 0.1_wp
  real(wp) :: sine = 1.0_wp   !! of the angle between keel and ridge

contains

  subroutine test_edge_crossing()
    call check_crossing()
    call check_slope()
    sine = 0.3_wp
    call check_slope()
    sine = 0.05_wp
    call check_slope()
    sine = 1.0_wp
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
  !! below it, over place y of it; shifted, and turned about the middle of the crossing.
  function keel(y, shift, turn) result(edge)
    real(wp), intent(in) :: y, shift(3), turn(3)
    type(edge_t) :: edge
    real(wp) :: r(3, 3), middle(3)

    associate (cosine => sqrt(1.0_wp - sine**2))
      edge%start = [-sine, y - cosine, -depth]
      edge%along = [sine, cosine, 0.0_wp]
      edge%extent = 2.0_wp
      edge%into(:, 1) = sqrt(0.5_wp)*[-cosine, sine, 1.0_wp]
      edge%into(:, 2) = sqrt(0.5_wp)*[cosine, -sine, 1.0_wp]
    end associate
    edge%outward = [0.0_wp, 0.0_wp, -1.0_wp]
    if (norm2(turn) > 0.0_wp) then
      middle = [0.0_wp, y, -0.5_wp*depth]
      r = rotation_matrix(quaternion_from_axis(turn/norm2(turn), norm2(turn)))
      edge%start = middle + matmul(r, edge%start - middle)
      edge%along = matmul(r, edge%along)
      edge%into = matmul(r, edge%into)
      edge%outward = matmul(r, edge%outward)
    end if
    edge%start = edge%start + shift
  end function keel

  subroutine check_crossing()
    type(crossing_t) :: crossing
    type(edge_t) :: above
    real(wp), parameter :: none(3) = 0.0_wp

    call cross_edges(keel(0.3_wp, none, none), ridge(), 0.0_wp, most, crossing)
    call check('depth', crossing%depth, depth, 1.0e-15_wp)
    call check('counts', crossing%weight, 1.0_wp)
    call check('from the keel down', crossing%normal, [0.0_wp, 0.0_wp, -1.0_wp], 1.0e-15_wp)
    call check('half way', crossing%place, [0.0_wp, 0.3_wp, -0.5_wp*depth], 1.0e-15_wp)
    call cross_edges(keel(1.2_wp, none, none), ridge(), 0.0_wp, most, crossing)
    call check('not beyond the end', crossing%weight, 0.0_wp)
    above = keel(0.3_wp, [0.0_wp, 0.0_wp, 2*depth], none)
    call cross_edges(above, ridge(), 0.0_wp, most, crossing)
    call check('not above', crossing%weight, 0.0_wp)
    call cross_edges(above, ridge(), -2*depth, most, crossing)
    call check('but looked at before', crossing%depth, -depth, 1.0e-15_wp)
    call cross_edges(keel(0.3_wp, [0.0_wp, 0.0_wp, -most], none), ridge(), 0.0_wp, most, crossing)
    call check('not too deep', crossing%weight, 0.0_wp)
  end subroutine check_crossing

  !> The slope of depth^2 weight with a shift and a turn of the keel, near an end of the ridge.
  !!
  !! The force of the depth acts along the normal at the crossing; what is left is the slope of the
  !! weight. With a shift that is no steeper than in a hundredth of the edge, whatever the angle.
  subroutine check_slope()
    type(crossing_t) :: crossing, there(2)
    real(wp), parameter :: step = 1.0e-7_wp, none(3) = 0.0_wp, width = 0.02_wp
    real(wp) :: with_shift(3), with_turn(3), unit(3), y, found
    integer :: d, faded

    faded = 0
    y = 1.0_wp - 1.5_wp*width/sine
    do while (y < 1.01_wp)
      call cross_edges(keel(y, none, none), ridge(), 0.0_wp, most, crossing)
      if (crossing%weight > 0.05_wp .and. crossing%weight < 0.95_wp) then
        faded = faded + 1
        call weight_slope(keel(y, none, none), ridge(), crossing, with_shift, with_turn)
        do d = 1, 3
          unit = 0.0_wp
          unit(d) = step
          call cross_edges(keel(y, unit, none), ridge(), 0.0_wp, most, there(2))
          call cross_edges(keel(y, -unit, none), ridge(), 0.0_wp, most, there(1))
          found = (there(2)%weight - there(1)%weight)/(2*step*crossing%weight)
          call check('slope with a shift', with_shift(d), found, 1.0e-3_wp/depth)
          call cross_edges(keel(y, none, unit), ridge(), 0.0_wp, most, there(2))
          call cross_edges(keel(y, none, -unit), ridge(), 0.0_wp, most, there(1))
          found = (there(2)%weight - there(1)%weight)/(2*step*crossing%weight)
          call check('slope with a turn', with_turn(d), found, 1.0e-3_wp)
        end do
        call check('not too steep', norm2(with_shift)*crossing%weight < 2.0_wp/width)
      end if
      y = y + 0.05_wp*width/sine
    end do
    call check('some have faded', faded > 3)
  end subroutine check_slope

  !> A keel on a ridge may cross it at once, two ridges only after a turn, and none before they have
  !! come together: a third of the gap, for the nearest places move further than the bodies.
  subroutine check_bounds()
    type(edge_t) :: back
    real(wp), parameter :: none(3) = 0.0_wp

    call check('may cross at once', turn_before(keel(0.3_wp, none, none), ridge()), 0.0_wp)
    back = keel(0.3_wp, none, none)
    back%into(3, :) = -back%into(3, :)
    call check('two ridges only after a turn', turn_before(back, ridge()) > 0.1_wp)
    call check('touching already', way_apart(keel(0.3_wp, none, none), ridge(), 0.01_wp) <= 0.0_wp)
    call check('a gap to go', way_apart(keel(0.3_wp, [0.0_wp, 0.0_wp, 0.5_wp], none), ridge(), &
      0.01_wp), (0.5_wp - depth)/3, 1.0e-15_wp)
  end subroutine check_bounds

end module test_edge_crossing_m
