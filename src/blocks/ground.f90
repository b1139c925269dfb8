!> How far a block can come straight down before it touches what lies there.
!!
!! The true shapes are compared: over each other in plan, the height between two facets is linear,
!! so the least height between the lower side of a block and the upper sides below it is found at a
!! corner of one over a facet of the other, or where two edges cross in plan. Balls are exact. The
!! result is a minimum, which no order of the work can change.
module ground_m
  use kinds_m, only: wp
  use vectors_m, only: norm, cross, rotation_matrix
  use tet_mesh_m, only: extent_along
  use rigid_body_m, only: blocks_t
  use walls_m, only: walls_t, floor_wall
  use bed_m, only: bed_place
  use neighbours_m, only: bins_t, bins_build, nearest_shift
  use overlap_m, only: overlap_t, release_overlap
  use overlap_solid_m, only: solid_t
  implicit none
  private
  public :: way_down, height_on_top, stands, ground_gap, nothing_below

  real(wp), parameter :: ground_gap = 1.0e-5_wp
    !! left below a block that is set down, over its smallest edge [-]
  real(wp), parameter :: side_share = 1.0e-6_wp
    !! by which a block is made narrower, so that sides that touch do not hold it [-]
  real(wp), parameter :: steepest = 1.0e-9_wp   !! facets nearer to upright are left to their edges
  real(wp), parameter :: nothing_below = huge(1.0_wp)   !! [m]

  !> The lower side of the block that comes down, about its centre, in bins seen from above.
  type :: lower_side_t
    real(wp) :: ball = 0.0_wp, radius = 0.0_wp   !! of the ball, of the bounding sphere [m]
    real(wp), allocatable :: face(:, :, :)       !! (3, 3, n) [m]
    real(wp), allocatable :: low(:, :), high(:, :)   !! (3, n) corners of the boxes around these [m]
    type(bins_t) :: bins
  end type lower_side_t

contains

  !> How far block c can be lowered from where it is until it touches something; below 0 down to
  !! minus the gap that is left under a block if it touches already; `nothing_below` if there is
  !! nothing [m].
  function way_down(walls, blocks, c, overlap) result(way)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: c
    type(overlap_t), intent(in) :: overlap
    real(wp) :: way
    real(wp) :: gap

    gap = gap_of(blocks, c)
    way = min_gap(walls, blocks, c, overlap, -gap)
    if (way < nothing_below) way = way - gap
  end function way_down

  !> Height of the centre of block c when it has come down from far above, at its place in plan, to
  !! just above what lies there; minus `nothing_below` if there is nothing [m].
  function height_on_top(walls, blocks, c, overlap) result(height)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: c
    type(overlap_t), intent(in) :: overlap
    real(wp) :: height

    height = min_gap(walls, blocks, c, overlap, -huge(1.0_wp))
    if (height < nothing_below) then
      height = blocks%x(3, c) - height + gap_of(blocks, c)
    else
      height = -nothing_below
    end if
  end function height_on_top

  !> Does block c stand on something, no further in it than a release allows?
  function stands(walls, blocks, c, overlap) result(yes)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: c
    type(overlap_t), intent(in) :: overlap
    logical :: yes

    associate (edge => blocks%shapes(blocks%shape(c))%smallest_edge)
      yes = min_gap(walls, blocks, c, overlap, -release_overlap*edge) <= gap_of(blocks, c)
    end associate
  end function stands

  !> The gap that is left below a block [m].
  pure real(wp) function gap_of(blocks, c)
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: c

    gap_of = ground_gap*blocks%shapes(blocks%shape(c))%smallest_edge
  end function gap_of

  !> Least height, of those from `least` on, between the lower side of block c and the floor, the
  !! bed and the upper sides of the other present blocks [m].
  function min_gap(walls, blocks, c, overlap, least) result(gap)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: c
    type(overlap_t), intent(in) :: overlap
    real(wp), intent(in) :: least   !! [m]
    real(wp) :: gap
    type(lower_side_t) :: own
    real(wp) :: d(3)
    integer :: b, w

    gap = nothing_below
    associate (x => blocks%x(:, c), turn => rotation_matrix(blocks%q(:, c)))
      do w = 1, walls%n
        if (walls%number(w) == floor_wall) call lower_to(x(3) + walls%offset(w) &
          - extent_along(blocks%shapes(blocks%shape(c)), -turn(3, :)), least, gap)
      end do
      call set_lower_side(overlap%solid(blocks%shape(c)), turn, own)
      if (walls%bed%there) call lower_on_bed(own, walls, x, least, gap)
      do b = 1, blocks%n
        if (b == c .or. .not. blocks%present(b)) cycle
        d = x - blocks%x(:, b)
        d = d - nearest_shift(walls%period, -d)
        associate (other => overlap%solid(blocks%shape(b)))
          if (norm(d(1:2)) >= own%radius + other%radius) cycle
          if (d(3) - own%radius - other%radius >= gap) cycle
          call lower_on_block(own, d, other, rotation_matrix(blocks%q(:, b)), least, gap)
        end associate
      end do
    end associate
  end function min_gap

  !> Take a height between two surfaces if it counts and is the least so far.
  pure subroutine lower_to(here, least, gap)
    real(wp), intent(in) :: here, least   !! [m]
    real(wp), intent(inout) :: gap        !! [m]

    if (here >= least) gap = min(gap, here)
  end subroutine lower_to

  !> The facets of a block that look down, turned.
  subroutine set_lower_side(solid, turn, own)
    type(solid_t), intent(in) :: solid
    real(wp), intent(in) :: turn(3, 3)   !! body to space
    type(lower_side_t), intent(out) :: own
    real(wp) :: face(3, 3)
    integer :: f, n

    own%ball = solid%ball
    own%radius = solid%radius
    n = 0
    allocate (own%face(3, 3, size(solid%face, 3)))
    do f = 1, size(solid%face, 3)
      if (own%ball > 0.0_wp) exit
      face = matmul(turn, solid%face(:, :, f))
      if (slope(face) > -steepest) cycle
      n = n + 1
      own%face(:, :, n) = face
      own%face(1:2, :, n) = (1.0_wp - side_share)*face(1:2, :)
    end do
    own%face = own%face(:, :, :n)
    allocate (own%low(3, n), own%high(3, n), source=0.0_wp)   ! no height: bins are columns
    do f = 1, n
      own%low(1:2, f) = minval(own%face(1:2, :, f), 2)
      own%high(1:2, f) = maxval(own%face(1:2, :, f), 2)
    end do
    call bins_build(own%low, own%high, own%radius/sqrt(real(max(1, n), wp)), own%bins)
    own%low(3, :) = minval(own%face(3, :, :), 1)
  end subroutine set_lower_side

  !> Vertical component of the unit normal of a triangle; 0 for none [-].
  pure function slope(face) result(n_z)
    real(wp), intent(in) :: face(3, 3)
    real(wp) :: n_z
    real(wp) :: n(3)

    n = cross(face(:, 2) - face(:, 1), face(:, 3) - face(:, 1))
    n_z = n(3)/max(norm(n), tiny(n_z))
  end function slope

  !> Lower the block over another one.
  subroutine lower_on_block(own, d, other, turn, least, gap)
    type(lower_side_t), intent(in) :: own
    real(wp), intent(in) :: d(3)           !! centre of the block minus that of the other [m]
    type(solid_t), intent(in) :: other
    real(wp), intent(in) :: turn(3, 3)     !! of the other, body to space
    real(wp), intent(in) :: least
    real(wp), intent(inout) :: gap
    real(wp) :: face(3, 3), mirrored(3, 3)
    integer :: f, k

    if (other%ball > 0.0_wp .and. own%ball > 0.0_wp) then
      call lower_to(d(3) - sqrt(max(0.0_wp, (own%ball + other%ball)**2 - sum(d(1:2)**2))), &
        least, gap)
    else if (other%ball > 0.0_wp) then   ! seen upside down the ball comes down on the block
      do f = 1, size(own%face, 3)
        mirrored = own%face(:, :, f)
        mirrored(3, :) = -mirrored(3, :)
        call lower_ball(other%ball, [-d(1), -d(2), d(3)], mirrored, least, gap)
      end do
    else
      do f = 1, size(other%face, 3)
        face = matmul(turn, other%face(:, :, f))
        if (slope(face) < steepest) cycle
        do k = 1, 3
          face(:, k) = face(:, k) - d
        end do
        call lower_on_face(own, face, least, gap)
      end do
    end if
  end subroutine lower_on_block

  !> Lower the block on the bed.
  subroutine lower_on_bed(own, walls, centre, least, gap)
    type(lower_side_t), intent(in) :: own
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: centre(3)   !! of the block [m]
    real(wp), intent(in) :: least
    real(wp), intent(inout) :: gap
    real(wp) :: x(3), face(3, 3)
    integer :: a(3), b(3), i, j, k, m, bin

    x = bed_place(walls%bed, centre)
    associate (bed => walls%bed, columns => walls%bed%columns)
      a = columns%place([x(1:2) - own%radius, columns%low(3)])
      b = columns%place([x(1:2) + own%radius, columns%low(3)])
      do j = a(2), b(2)
        do i = a(1), b(1)
          bin = columns%number([i, j, a(3)])
          do m = columns%first(bin), columns%first(bin + 1) - 1
            do k = 1, 3
              face(:, k) = bed%point(:, bed%triangle(k, columns%item(m))) - x
            end do
            if (slope(face) >= steepest) call lower_on_face(own, face, least, gap)
          end do
        end do
      end do
    end associate
  end subroutine lower_on_bed

  !> Lower the block on a triangle that looks up, given about the centre of the block.
  subroutine lower_on_face(own, face, least, gap)
    type(lower_side_t), intent(in) :: own
    real(wp), intent(in) :: face(3, 3)   !! [m]
    real(wp), intent(in) :: least
    real(wp), intent(inout) :: gap
    integer :: a(3), b(3), i, j, m, bin, f
    real(wp) :: low(2), high(3)

    low = min(face(1:2, 1), face(1:2, 2), face(1:2, 3))
    high = max(face(:, 1), face(:, 2), face(:, 3))
    if (any(low > own%radius) .or. any(high(1:2) < -own%radius)) return
    if (-own%radius - high(3) >= gap) return
    if (own%ball > 0.0_wp) then
      call lower_ball(own%ball, [0.0_wp, 0.0_wp, 0.0_wp], face, least, gap)
      return
    end if
    associate (bins => own%bins)
      a = bins%place([low, 0.0_wp])
      b = bins%place([high(1:2), 0.0_wp])
      do j = a(2), b(2)
        do i = a(1), b(1)
          bin = bins%number([i, j, 1])
          do m = bins%first(bin), bins%first(bin + 1) - 1
            f = bins%item(m)
            if (any(own%low(1:2, f) > high(1:2)) .or. any(own%high(1:2, f) < low)) cycle
            if (own%low(3, f) - high(3) > gap + side_share*own%radius) cycle   ! round-off apart
            call compare(own%face(:, :, f), face, least, gap)
          end do
        end do
      end do
    end associate
  end subroutine lower_on_face

  !> Least height of a triangle that looks down over one that looks up.
  pure subroutine compare(lower, upper, least, gap)
    real(wp), intent(in) :: lower(3, 3), upper(3, 3)   !! [m]
    real(wp), intent(in) :: least
    real(wp), intent(inout) :: gap
    real(wp) :: e(2), g(2), d(2), det, s, t
    integer :: i, j, i2, j2

    do i = 1, 3
      if (is_over(lower(:, i), upper)) call lower_to(lower(3, i) - height_of(lower(:, i), upper), &
        least, gap)
      if (is_over(upper(:, i), lower)) call lower_to(height_of(upper(:, i), lower) - upper(3, i), &
        least, gap)
    end do
    do i = 1, 3
      i2 = 1 + mod(i, 3)
      e = lower(1:2, i2) - lower(1:2, i)
      do j = 1, 3
        j2 = 1 + mod(j, 3)
        g = upper(1:2, j2) - upper(1:2, j)
        d = upper(1:2, j) - lower(1:2, i)
        det = e(1)*g(2) - e(2)*g(1)
        if (.not. abs(det) > 0.0_wp) cycle
        s = (d(1)*g(2) - d(2)*g(1))/det
        t = (d(1)*e(2) - d(2)*e(1))/det
        if (min(s, t) < 0.0_wp .or. max(s, t) > 1.0_wp) cycle
        call lower_to(lower(3, i) + s*(lower(3, i2) - lower(3, i)) &
          - upper(3, j) - t*(upper(3, j2) - upper(3, j)), least, gap)
      end do
    end do
  end subroutine compare

  !> Does a point lie within a triangle in plan?
  pure function is_over(p, face) result(yes)
    real(wp), intent(in) :: p(3), face(3, 3)
    logical :: yes
    real(wp) :: side(3)
    integer :: i, i2

    do i = 1, 3
      i2 = 1 + mod(i, 3)
      side(i) = (face(1, i2) - face(1, i))*(p(2) - face(2, i)) &
        - (face(2, i2) - face(2, i))*(p(1) - face(1, i))
    end do
    yes = all(side >= 0.0_wp) .or. all(side <= 0.0_wp)
  end function is_over

  !> Height of the plane of a triangle at a place in plan [m].
  pure function height_of(p, face) result(z)
    real(wp), intent(in) :: p(3), face(3, 3)
    real(wp) :: z
    real(wp) :: n(3)

    n = cross(face(:, 2) - face(:, 1), face(:, 3) - face(:, 1))
    z = face(3, 1) - dot_product(n(1:2), p(1:2) - face(1:2, 1))/n(3)
  end function height_of

  !> Lower a ball on a triangle: on its plane, its edges or its corners.
  pure subroutine lower_ball(radius, centre, face, least, gap)
    real(wp), intent(in) :: radius, centre(3)   !! [m]
    real(wp), intent(in) :: face(3, 3)          !! [m]
    real(wp), intent(in) :: least
    real(wp), intent(inout) :: gap
    real(wp) :: n(3), foot(3), e(3), d(2), length, a, b, c, z
    integer :: i

    n = cross(face(:, 2) - face(:, 1), face(:, 3) - face(:, 1))
    n = sign(1.0_wp, n(3))*n/norm(n)
    foot = centre - radius*n
    if (is_over(foot, face)) call lower_to(foot(3) - height_of(foot, face), least, gap)
    do i = 1, 3
      d = centre(1:2) - face(1:2, i)
      if (sum(d**2) < radius**2) call lower_to(centre(3) - face(3, i) &
        - sqrt(radius**2 - sum(d**2)), least, gap)
      e = face(:, 1 + mod(i, 3)) - face(:, i)
      length = norm(e)
      e = e/length
      ! the upper height z over the start at which the centre is as far as the radius from the line
      a = 1.0_wp - e(3)**2
      b = e(3)*dot_product(e(1:2), d)
      c = sum(d**2) - dot_product(e(1:2), d)**2 - radius**2
      if (b**2 < a*c .or. .not. a > 0.0_wp) cycle
      z = (b + sqrt(b**2 - a*c))/a
      if (dot_product(e(1:2), d) + e(3)*z < 0.0_wp .or. &
          dot_product(e(1:2), d) + e(3)*z > length) cycle
      call lower_to(centre(3) - face(3, i) - z, least, gap)
    end do
  end subroutine lower_ball

end module ground_m
