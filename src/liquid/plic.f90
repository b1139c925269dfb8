!> The plane of the liquid surface in one box cell: constant from the fraction and back, the liquid
!! in a slab beside a face, the normal from the 27 cells around.
!!
!! The liquid of a cell is the part of the box where `n.x <= d`; n points from the liquid to the
!! gas. Scaling by the edges maps every box to the unit cube, `m = n*h`, and leaves all shares as
!! they are; the `unit_*` forms work there. Normals need not have length one.
!!
!! Source: the piecewise cubic of Scardovelli & Zaleski, J. Comput. Phys. 164 (2000). Written as a
!! sum of cubes that never divides a difference by a small component, so that it keeps its digits
!! for planes nearly parallel to faces; its inverse is closed where the piece is linear or quadratic
!! and Newton's method on the cubic pieces.
module plic_m
  use kinds_m, only: wp
  implicit none
  private
  public :: unit_constant, unit_volume, unit_area, unit_slab, unit_normal

  real(wp), parameter :: min_component = 1.0e-13_wp   !! of a normal, relative; below it is zero
  real(wp), parameter :: alike = 1.0e-10_wp           !! differ by round-off: shares, slopes

contains

  !> Share of the unit cube where `m.x <= a`.
  pure function unit_volume(m, a) result(volume)
    real(wp), intent(in) :: m(3), a
    real(wp) :: volume
    real(wp) :: s(3), b, total

    call sorted(m, s, total)
    b = (a - sum(min(m, 0.0_wp)))/total
    if (b <= 0.5_wp) then
      volume = lower_half(s, b)
    else
      volume = 1.0_wp - lower_half(s, 1.0_wp - b)
    end if
  end function unit_volume

  !> Constant a of the plane `m.x = a` that cuts the share `fraction` off the unit cube.
  pure function unit_constant(m, fraction) result(a)
    real(wp), intent(in) :: m(3), fraction
    real(wp) :: a
    real(wp) :: s(3), b, total

    call sorted(m, s, total)
    if (fraction <= 0.5_wp) then
      b = lower_half_inverse(s, max(fraction, 0.0_wp))
    else
      b = 1.0_wp - lower_half_inverse(s, max(1.0_wp - fraction, 0.0_wp))
    end if
    a = b*total + sum(min(m, 0.0_wp))
  end function unit_constant

  !> Derivative of `unit_volume` with respect to a.
  pure function unit_area(m, a) result(area)
    real(wp), intent(in) :: m(3), a
    real(wp) :: area
    real(wp) :: s(3), b, total

    call sorted(m, s, total)
    b = (a - sum(min(m, 0.0_wp)))/total
    area = lower_half_slope(s, min(b, 1.0_wp - b))/total
  end function unit_area

  !> Liquid in a slab of the unit cube beside the lower (1) or upper (2) face of a direction.
  pure function unit_slab(m, a, direction, side, thickness) result(volume)
    real(wp), intent(in) :: m(3), a
    integer, intent(in) :: direction, side
    real(wp), intent(in) :: thickness   !! share of the edge, 0..1
    real(wp) :: volume
    real(wp) :: squeezed(3), b

    volume = 0.0_wp
    if (thickness <= 0.0_wp) return
    b = a
    if (side == 2) b = a - m(direction)*(1.0_wp - thickness)
    squeezed = m
    squeezed(direction) = m(direction)*thickness
    volume = thickness*unit_volume(squeezed, b)
  end function unit_slab

  !> Sizes of the components in rising order, scaled to a sum of one.
  pure subroutine sorted(m, s, total)
    real(wp), intent(in) :: m(3)
    real(wp), intent(out) :: s(3)
    real(wp), intent(out) :: total   !! sum of the sizes
    real(wp) :: p(3), low, high

    p = abs(m)
    total = p(1) + p(2) + p(3)
    p = p/total
    low = min(p(1), p(2))
    high = max(p(1), p(2))
    s(1) = min(low, p(3))
    s(2) = max(low, min(high, p(3)))
    s(3) = max(high, p(3))
  end subroutine sorted

  !> Share of the unit cube below the plane `s.x = b` for 0 <= s1 <= s2 <= s3, sum 1, b <= 1/2.
  !!
  !! $$ V = \frac{b(b-s_1) + s_1^2/3}{2 s_2 s_3} - \frac{(b-s_2)_+^3 + (b-s_3)_+^3}{6 s_1 s_2 s_3}
  !! $$ between s1 and the point where the plane has passed the whole small face (linear from there
  !! on).
  pure function lower_half(s, b) result(volume)
    real(wp), intent(in) :: s(3), b
    real(wp) :: volume
    real(wp) :: s12

    s12 = s(1) + s(2)
    if (b <= 0.0_wp) then
      volume = 0.0_wp
    else if (b < s(1)) then
      volume = (b/s(1))*(b/s(2))*(b/s(3))/6.0_wp
    else if (b <= s(2)) then
      volume = (b*(b - s(1)) + s(1)*s(1)/3.0_wp)/s(2)/(2.0_wp*s(3))
    else if (s12 <= s(3) .and. b >= s12) then
      volume = (2.0_wp*b - s12)/(2.0_wp*s(3))
    else
      volume = (b*(b - s(1)) + s(1)*s(1)/3.0_wp)/s(2)/(2.0_wp*s(3)) &
               - (b - s(2))**2*((b - s(2))/s(1))/(6.0_wp*s(2)*s(3))
      if (b > s(3)) volume = volume - (b - s(3))**2*((b - s(3))/s(1))/(6.0_wp*s(2)*s(3))
    end if
  end function lower_half

  !> Derivative of `lower_half` with respect to b.
  pure function lower_half_slope(s, b) result(slope)
    real(wp), intent(in) :: s(3), b
    real(wp) :: slope
    real(wp) :: s12

    s12 = s(1) + s(2)
    if (b <= 0.0_wp) then
      slope = 0.0_wp
    else if (b < s(1)) then
      slope = (b/s(1))*(b/s(2))/(2.0_wp*s(3))
    else if (b <= s(2)) then
      slope = (2.0_wp*b - s(1))/s(2)/(2.0_wp*s(3))
    else if (s12 <= s(3) .and. b >= s12) then
      slope = 1.0_wp/s(3)
    else
      slope = ((2.0_wp*b - s(1)) - (b - s(2))*((b - s(2))/s(1)))/(2.0_wp*s(2)*s(3))
      if (b > s(3)) slope = slope - (b - s(3))*((b - s(3))/s(1))/(2.0_wp*s(2)*s(3))
    end if
  end function lower_half_slope

  !> Inverse of `lower_half` for volumes up to 1/2.
  pure function lower_half_inverse(s, volume) result(b)
    real(wp), intent(in) :: s(3), volume
    real(wp) :: b
    real(wp) :: product_6, s12

    s12 = s(1) + s(2)
    product_6 = 6.0_wp*s(1)*s(2)*s(3)
    if (volume*6.0_wp*s(2)*s(3) < s(1)*s(1)) then
      b = (product_6*volume)**(1.0_wp/3.0_wp)
    else if (volume <= lower_half(s, s(2)) .and. s(2) > 0.0_wp) then
      b = 0.5_wp*s(1) + sqrt(max(2.0_wp*s(2)*s(3)*volume - s(1)*s(1)/12.0_wp, 0.0_wp))
    else if (s12 <= s(3) .and. 2.0_wp*s(3)*volume >= s12) then
      b = s(3)*volume + 0.5_wp*s12
    else
      b = cubic_inverse(s, volume, s(2), min(s12, 0.5_wp))
    end if
  end function lower_half_inverse

  !> Newton's method, kept in a bracket, on the smooth cubic pieces of `lower_half`.
  pure function cubic_inverse(s, volume, from, to) result(b)
    real(wp), intent(in) :: s(3), volume
    real(wp), intent(in) :: from, to   !! bracket
    real(wp) :: b
    integer, parameter :: max_iterations = 30
    real(wp) :: low, high, residual, next
    integer :: it

    low = from
    high = to
    b = 0.5_wp*(low + high)
    do it = 1, max_iterations
      residual = lower_half(s, b) - volume
      if (residual > 0.0_wp) then
        high = b
      else
        low = b
      end if
      next = b - residual/lower_half_slope(s, b)
      if (next < low .or. next > high) next = 0.5_wp*(low + high)
      if (abs(next - b) <= epsilon(b)*b) exit
      b = next
    end do
    b = next
  end function cubic_inverse

  !> Normal of the surface on the unit cube, from liquid to gas, from the liquid shares around.
  !!
  !! Mixed Youngs-centred: of the three height functions the one whose surface is flattest, unless
  !! the gradient of Youngs (weights 1-2-1) is less aligned with an axis; of those alike their mean
  !! (round-off chooses none). Sizes add up to one; zero where the shares show no direction.
  !! Multiply by 1/h for the direction in space of a box cell.
  !! Source: Aulisa, Manservisi, Scardovelli & Zaleski, J. Comput. Phys. 225 (2007).
  pure function unit_normal(c) result(m)
    real(wp), intent(in) :: c(-1:1, -1:1, -1:1)   !! liquid shares
    real(wp) :: m(3)
    real(wp) :: layer(-1:1, -1:1, 3)   !! sums over the lines of a direction
    real(wp) :: line(-1:1, 3)          !! sums over the layers normal to a direction
    real(wp) :: tilt(3, 3), flat(3), best, young(3)
    integer :: d

    layer(:, :, 1) = c(-1, :, :) + c(0, :, :) + c(1, :, :)
    layer(:, :, 2) = c(:, -1, :) + c(:, 0, :) + c(:, 1, :)
    layer(:, :, 3) = c(:, :, -1) + c(:, :, 0) + c(:, :, 1)
    line(:, 1) = layer(:, -1, 3) + layer(:, 0, 3) + layer(:, 1, 3)
    line(:, 2) = layer(-1, :, 3) + layer(0, :, 3) + layer(1, :, 3)
    line(:, 3) = layer(-1, :, 2) + layer(0, :, 2) + layer(1, :, 2)

    tilt(2:3, 1) = 0.5_wp*[layer(-1, 0, 1) - layer(1, 0, 1), layer(0, -1, 1) - layer(0, 1, 1)]
    tilt([1, 3], 2) = 0.5_wp*[layer(-1, 0, 2) - layer(1, 0, 2), layer(0, -1, 2) - layer(0, 1, 2)]
    tilt(1:2, 3) = 0.5_wp*[layer(-1, 0, 3) - layer(1, 0, 3), layer(0, -1, 3) - layer(0, 1, 3)]
    do d = 1, 3
      tilt(d, d) = sign(1.0_wp, line(-1, d) - line(1, d))
      flat(d) = 0.0_wp
      if (abs(line(-1, d) - line(1, d)) > alike) flat(d) = 1.0_wp/sum(abs(tilt(:, d)))
    end do
    best = maxval(flat)
    m = 0.0_wp
    do d = 1, 3
      if (flat(d) > 0.0_wp .and. flat(d) >= (1.0_wp - alike)*best) m = m + flat(d)*tilt(:, d)
    end do
    young = youngs(c)
    associate (main => maxval(abs(young)))
      if (main > 0.0_wp) then
        if (main < (1.0_wp - alike)*best) m = 0.0_wp
        if (.not. main > (1.0_wp + alike)*best .or. .not. best > 0.0_wp) m = m + young
      end if
    end associate
    where (abs(m) < min_component) m = 0.0_wp
    if (any(abs(m) > 0.0_wp)) m = m/sum(abs(m))
  end function unit_normal

  !> Downhill direction of the shares by Youngs' weights, sizes adding up to one, or zero.
  pure function youngs(c) result(m)
    real(wp), intent(in) :: c(-1:1, -1:1, -1:1)
    real(wp) :: m(3)
    real(wp), parameter :: w(-1:1, -1:1) = &
      reshape([1.0_wp, 2.0_wp, 1.0_wp, 2.0_wp, 4.0_wp, 2.0_wp, 1.0_wp, 2.0_wp, 1.0_wp], [3, 3])
    real(wp) :: total

    m(1) = sum(w*c(-1, :, :)) - sum(w*c(1, :, :))
    m(2) = sum(w*c(:, -1, :)) - sum(w*c(:, 1, :))
    m(3) = sum(w*c(:, :, -1)) - sum(w*c(:, :, 1))
    total = sum(abs(m))
    if (total > 0.0_wp) m = m/total
  end function youngs

end module plic_m
