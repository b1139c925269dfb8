!> How much of the tank below a height is bed, and how steep the bed is.
module bed_measure_m
  use kinds_m, only: wp
  use vectors_m, only: norm
  use polygon_m, only: clip_polygon, area_vector
  use bed_m, only: bed_t, facet_within, max_clip_corners
  implicit none
  private
  public :: bed_volume, bed_normal

contains

  !> Volume of the bed between a floor and a level, over a rectangle of the ground plane [m3].
  !!
  !! Under a facet that looks up stands a column of solid, under one that looks down it is taken
  !! away again: the areas seen from above have that sign.
  pure function bed_volume(bed, low, high) result(volume)
    type(bed_t), intent(in) :: bed
    real(wp), intent(in) :: low(3), high(3)   !! corners of the space: floor and level in z [m]
    real(wp) :: volume
    real(wp) :: p(3, max_clip_corners), under(3, max_clip_corners), above(3, max_clip_corners)
    integer :: f, n, m

    volume = 0.0_wp
    do f = 1, size(bed%triangle, 2)
      call facet_within(bed, f, low, high, n, p)
      call clip_polygon(3, low(3), 1.0_wp, n, p)
      if (n < 3) cycle
      under = p
      m = n
      call clip_polygon(3, high(3), -1.0_wp, m, under)
      volume = volume + column(under(:, :m), low(3))
      above = p
      m = n
      call clip_polygon(3, high(3), 1.0_wp, m, above)
      above(3, :m) = high(3)
      volume = volume + column(above(:, :m), low(3))
    end do
  end function bed_volume

  !> Volume between a flat polygon and the floor, negative if the polygon runs clockwise seen from
  !! above [m3].
  pure function column(p, floor) result(volume)
    real(wp), intent(in) :: p(:, :)   !! (3, n) corners; less than three have none [m]
    real(wp), intent(in) :: floor     !! [m]
    real(wp) :: volume
    real(wp) :: a(2), b(2)
    integer :: v

    volume = 0.0_wp
    do v = 2, size(p, 2) - 1
      a = p(1:2, v) - p(1:2, 1)
      b = p(1:2, v + 1) - p(1:2, 1)
      volume = volume + 0.5_wp*(a(1)*b(2) - a(2)*b(1)) &
        *((p(3, 1) + p(3, v) + p(3, v + 1))/3.0_wp - floor)
    end do
  end function column

  !> Mean normal of the bed in a square around a place, of what looks up; up where there is none.
  pure function bed_normal(bed, place, half) result(normal)
    type(bed_t), intent(in) :: bed
    real(wp), intent(in) :: place(2), half   !! middle, half of a side [m]
    real(wp) :: normal(3)
    real(wp) :: p(3, max_clip_corners), area(3)
    integer :: f, n

    normal = 0.0_wp
    do f = 1, size(bed%triangle, 2)
      associate (corner => bed%point(:2, bed%triangle(:, f)))
        if (any(minval(corner, 2) > place + half .or. maxval(corner, 2) < place - half)) cycle
      end associate
      call facet_within(bed, f, place - half, place + half, n, p)
      area = area_vector(p(:, :n))
      if (area(3) > 0.0_wp) normal = normal + area
    end do
    if (.not. normal(3) > 0.0_wp) normal = [0.0_wp, 0.0_wp, 1.0_wp]
    normal = normal/norm(normal)
  end function bed_normal

end module bed_measure_m
