!> The bed: a fixed floor of any form in the tank, for contact and flow.
!!
!! It is a surface of triangles, with solid below the facets that look up and none below those that
!! look down. So it may be open (a map of heights, whose border lies at the sides of the tank or
!! outside) or closed (stones, a terrain with sides and bottom). Space axes; between periodic sides
!! the form is repeated.
module bed_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use errors_m, only: problems_t, to_text, brief
  use case_types_m, only: case_t
  use named_files_m, only: found_file
  use value_text_m, only: quoted_text
  use vectors_m, only: cross, norm
  use polygon_m, only: clip_polygon
  use neighbours_m, only: bins_build, join_points
  use surface_features_m, only: set_plane
  use surface_search_m, only: found_t, nearest_on_surface, nowhere
  use bed_surface_m, only: bed_t, make_bed_surface, make_ready
  use bed_file_m, only: bed_form_t, read_bed_file
  implicit none
  private
  public :: bed_t, make_bed, set_bed, bed_counterpart, bed_place, bed_covers, bed_distance, &
    bed_is_near
  public :: facet_within, max_clip_corners, round_off

  integer, parameter :: bed_counterpart = -7   !! its number as a counterpart of the blocks
  integer, parameter :: max_clip_corners = 12  !! of a facet cut at five planes, and more

  real(wp), parameter :: round_off = 1.0e-6_wp   !! of coordinates in files, over the tank [-]
  real(wp), parameter :: same_place = 1.0e-7_wp  !! points nearer are one, over the bed [-]

contains

  !> Read the bed of a case and look for everything that may be wrong with it.
  subroutine make_bed(case, bed, problems)
    type(case_t), intent(in) :: case
    type(bed_t), intent(out) :: bed
    type(problems_t), intent(inout) :: problems
    type(bed_form_t) :: form
    character(:), allocatable :: message
    integer :: n_before

    if (len_trim(case%bed%file) == 0 .or. case%bed%faulty) return
    call read_bed_file(found_file(trim(case%bed%file)), case%bed%kind, form, &
      message)
    if (len(message) > 0) then
      call report(message)
      return
    end if
    if (case%grid%extent_faulty .or. any(case%boundary%faulty)) return
    n_before = problems%n
    call check_extent()
    if (problems%n > n_before) return
    call set_bed(case, form, bed, message)
    if (len(message) == 0) call check_border(case, bed, message)
    if (len(message) == 0) call check_layers(case, bed, message)
    if (len(message) > 0) call report(message)
  contains
    subroutine report(what)
      character(*), intent(in) :: what

      call problems%add_message('&bed file = '//quoted_text(trim(case%bed%file))//': '//what, &
                                case%bed%line)
    end subroutine report

    !> The size of the form beside that of the tank.
    subroutine check_extent()
      character(1), parameter :: axis(3) = ['x', 'y', 'z']
      real(wp), parameter :: far_too_large = 100.0_wp
      real(wp) :: low(3), high(3), from(3), to(3), slack(3)
      integer :: d

      low = minval(form%point, 2)
      high = maxval(form%point, 2)
      from = case%grid%origin
      to = from + case%grid%length
      slack = round_off*case%grid%length
      if (any(high(1:2) - low(1:2) > far_too_large*maxval(case%grid%length(1:2)))) then
        call report('it is '//to_text(maxval(high(1:2) - low(1:2)))//' m long, more than ' &
          //to_text(nint(far_too_large))//' times the tank; are its coordinates in mm? ' &
          //'They must be in m')
        return
      end if
      if (high(3) - low(3) > far_too_large*maxval(case%grid%length)) then
        call report('it is '//to_text(high(3) - low(3))//' m high, more than ' &
          //to_text(nint(far_too_large))//' times the tank; its coordinates must be in m')
        return
      end if
      do d = 1, 2
        if (case%bed%kind == 'heightmap') then
          if (low(d) > from(d) + slack(d) .or. high(d) < to(d) - slack(d)) then
            call report('the map does not cover the tank, which reaches from '//to_text(from(d)) &
              //' to '//to_text(to(d))//' m in '//axis(d)//'; the map reaches from ' &
              //to_text(low(d))//' to '//to_text(high(d))//' m')
          else if (case%boundary%kind(1, d) == 'periodic' .and. high(d) - low(d) &
                   > case%grid%length(d) + 2*slack(d)) then
            call report('the map must be as long as the period '//to_text(case%grid%length(d)) &
              //' m in '//axis(d))
          end if
        else if (high(d) < from(d) .or. low(d) > to(d)) then
          call report('the bed lies outside the tank in '//axis(d))
        end if
      end do
      if (high(3) <= from(3)) call report('the bed lies below the tank')
      if (case%boundary%kind(1, 3) == 'periodic') call report('a bed needs sides in z that are ' &
        //'not periodic')
    end subroutine check_extent
  end subroutine make_bed

  !> Make a form ready: repeat it between periodic sides, join equal points, sort it.
  subroutine set_bed(case, form, bed, message)
    type(case_t), intent(in) :: case
    type(bed_form_t), intent(inout) :: form   !! used up
    type(bed_t), intent(out) :: bed
    character(:), allocatable, intent(out) :: message   !! empty, or what is wrong
    integer, allocatable :: number(:)
    real(wp) :: area, spacing, extent, within(3, 2)
    integer :: m, n, c(3)

    message = ''
    bed%origin = case%grid%origin
    bed%period = merge(case%grid%length, 0.0_wp, case%boundary%kind(1, :) == 'periodic')
    bed%checksum = form%checksum
    call repeat_form(case, form, bed)
    ! Corners at one place become one point; facets that shrink to a line are dropped.
    extent = maxval(maxval(bed%point, 2) - minval(bed%point, 2))
    call join_points(bed%point, mean_spacing(bed, near_tank(case)), same_place*extent, number, &
      near_tank(case))
    n = 0
    do m = 1, size(bed%triangle, 2)
      c = number(bed%triangle(:, m))
      if (c(1) == c(2) .or. c(2) == c(3) .or. c(3) == c(1)) cycle
      n = n + 1
      bed%triangle(:, n) = c
    end do
    if (n < size(bed%triangle, 2)) bed%triangle = bed%triangle(:, :n)
    area = 0.0_wp
    do m = 1, n
      associate (p => bed%point(:, bed%triangle(:, m)))
        extent = maxval(maxval(p, 2) - minval(p, 2))
        spacing = norm(cross(p(:, 2) - p(:, 1), p(:, 3) - p(:, 1)))
        if (.not. spacing > (same_place*extent)*extent) then
          message = 'the facet at '//point_text(p(:, 1))//' has no area'
          return
        end if
        area = area + 0.5_wp*spacing
      end associate
    end do
    call make_bed_surface(sqrt(area/real(n, wp)), bed)
    within = near_tank(case)
    within(3, :) = 0.0_wp
    call bins_build(bed%point, bed%triangle, mean_spacing(bed, within), bed%columns, &
      within=within)
    bed%there = .true.
  end subroutine set_bed

  !> Copies of the form on both sides of the tank where it is periodic: one period to each side,
  !! or as many as the cells that are kept beyond a side reach.
  subroutine repeat_form(case, form, bed)
    type(case_t), intent(in) :: case
    type(bed_form_t), intent(inout) :: form   !! used up
    type(bed_t), intent(inout) :: bed
    integer, parameter :: cells_beyond = 4
    integer :: times(3), i, j, copy, n, m

    times = 0
    where (bed%period > 0.0_wp) times = max(1, (cells_beyond + case%grid%cells - 1) &
                                            /case%grid%cells)
    n = size(form%point, 2)
    m = size(form%triangle, 2)
    bed%n_given = m
    copy = product(2*times + 1)
    if (copy == 1) then
      call move_alloc(form%point, bed%point)
      call move_alloc(form%triangle, bed%triangle)
      return
    end if
    allocate (bed%point(3, n*copy), bed%triangle(3, m*copy))
    copy = 0
    do j = -times(2), times(2)
      do i = -times(1), times(1)
        bed%point(:, copy*n + 1:(copy + 1)*n) = form%point &
          + spread(bed%period*real([i, j, 0], wp), 2, n)
        bed%triangle(:, copy*m + 1:(copy + 1)*m) = form%triangle + copy*n
        copy = copy + 1
      end do
    end do
  end subroutine repeat_form

  !> Corners of the tank and its surroundings, to which bins move points far away [m].
  pure function near_tank(case) result(corner)
    type(case_t), intent(in) :: case
    real(wp) :: corner(3, 2)

    corner(:, 1) = case%grid%origin - maxval(case%grid%length)
    corner(:, 2) = case%grid%origin + case%grid%length + maxval(case%grid%length)
  end function near_tank

  !> Side of a square that has the mean area of the facets of a bed seen from its largest side,
  !! points far away moved into a box [m].
  pure function mean_spacing(bed, within) result(spacing)
    type(bed_t), intent(in) :: bed
    real(wp), intent(in) :: within(3, 2)   !! corners of the box [m]
    real(wp) :: spacing
    real(wp) :: extent(3)

    extent = min(max(maxval(bed%point, 2), within(:, 1)), within(:, 2)) &
      - min(max(minval(bed%point, 2), within(:, 1)), within(:, 2))
    spacing = sqrt(max(extent(1)*extent(2), extent(2)*extent(3), extent(3)*extent(1)) &
                   /real(max(1, size(bed%triangle, 2)), wp))
  end function mean_spacing

  !> An open edge of the surface inside the tank, or at a periodic side: the solid would end there
  !! without a surface.
  subroutine check_border(case, bed, message)
    type(case_t), intent(in) :: case
    type(bed_t), intent(in) :: bed
    character(:), allocatable, intent(out) :: message
    real(wp) :: p(3, 2), low(3), high(3), slack(3), from, to, at(2)
    integer :: e, d, n

    message = ''
    slack = round_off*case%grid%length   ! a periodic side is inside
    where (case%boundary%kind(1, :) == 'periodic') slack = -slack
    low = case%grid%origin + slack
    high = case%grid%origin + case%grid%length - slack
    n = 0
    do e = 1, size(bed%edge, 2)
      if (bed%edge(4, e) > 0) cycle
      p = bed%point(:, bed%edge(1:2, e))
      if (maxval(p(3, :)) <= low(3)) cycle
      from = 0.0_wp   ! the part of the edge inside the tank, seen from above
      to = 1.0_wp
      do d = 1, 2
        at = [low(d), high(d)]
        if (abs(p(d, 2) - p(d, 1)) <= 0.0_wp) then
          if (p(d, 1) <= at(1) .or. p(d, 1) >= at(2)) to = -1.0_wp
        else
          at = (at - p(d, 1))/(p(d, 2) - p(d, 1))
          from = max(from, minval(at))
          to = min(to, maxval(at))
        end if
      end do
      if (from >= to) cycle
      n = n + 1
      if (n > 1) cycle
      message = point_text(p(:, 1) + 0.5_wp*(from + to)*(p(:, 2) - p(:, 1)))
    end do
    if (n == 0) return
    message = 'the surface has '//to_text(n)//' open edges inside the tank, one at '//message &
      //'; it must be closed, or reach the sides of the tank, have the same height at both ends ' &
      //'of a period, and its facets must all run counter-clockwise seen from outside'
  end subroutine check_border

  !> From above every place of the tank must show the surface in order: into the solid, out of it.
  subroutine check_layers(case, bed, message)
    type(case_t), intent(in) :: case
    type(bed_t), intent(in) :: bed
    character(:), allocatable, intent(out) :: message
    real(wp), allocatable :: height(:)   ! of the facets above and below a place, falling [m]
    integer, allocatable :: way(:)       ! 1: looks up, -1: down
    real(wp) :: p(3, max_clip_corners), low(3), high(3), at(3), top, same, z
    integer :: f, g, n, k, m, bin, depth, turn

    message = ''
    same = round_off*case%grid%length(3)   ! heights nearer than this are equal
    low = case%grid%origin
    high = case%grid%origin + case%grid%length
    top = -huge(top)
    do f = 1, size(bed%triangle, 2)
      call facet_within(bed, f, low, high, n, p)
      if (n < 3) cycle
      top = max(top, maxval(p(3, :n)))
      at = sum(p(:, :n), 2)/real(n, wp)
      n = 0
      bin = column_of(bed, at)
      do m = bed%columns%first(bin), bed%columns%first(bin + 1) - 1
        g = bed%columns%item(m)
        turn = way_of(bed, g, at)
        if (turn == 0) cycle
        z = height_of(bed, g, at)
        n = n + 1
        call ensure_capacity(n, height)
        call ensure_capacity(n, way)
        do k = n, 2, -1   ! equal heights: those that look down first
          if (height(k - 1) > z + same &
              .or. (height(k - 1) > z - same .and. way(k - 1) <= turn)) exit
          height(k) = height(k - 1)
          way(k) = way(k - 1)
        end do
        height(k) = z
        way(k) = turn
      end do
      depth = 0
      do k = 1, n
        depth = depth + way(k)
        if (depth == 0 .or. depth == 1) cycle
        at(3) = height(k)
        if (depth < 0) then
          message = 'the facet at '//point_text(at)//' looks down with no solid above it: its ' &
            //'corners must run counter-clockwise seen from outside'
        else
          message = 'at '//point_text(at)//' solid lies in solid: parts of the bed must not ' &
            //'overlap, and facets must run counter-clockwise seen from outside'
        end if
        return
      end do
    end do
    if (top > high(3)) then
      message = 'the bed reaches up to '//to_text(top)//' m, out of the tank, which ends at ' &
        //to_text(high(3))//' m; coordinates must be in m'
    else if (top <= low(3)) then
      message = 'the bed lies below the tank'
    end if
  end subroutine check_layers

  !> Bin of the facets above and below a place.
  pure function column_of(bed, at) result(bin)
    type(bed_t), intent(in) :: bed
    real(wp), intent(in) :: at(3)
    integer :: bin

    bin = bed%columns%number(bed%columns%place([at(1:2), 0.0_wp]))
  end function column_of

  !> How facet f lies over or under a place: 1 it looks up, -1 down, 0 not at all.
  !!
  !! The winding number of its outline seen from above. Of two facets with a common edge only one
  !! covers a place on the edge: both see the same bits.
  pure function way_of(bed, f, at) result(way)
    type(bed_t), intent(in) :: bed
    integer, intent(in) :: f
    real(wp), intent(in) :: at(3)
    integer :: way
    real(wp) :: p(2), q(2), side
    integer :: c, rise

    way = 0
    do c = 1, 3
      p = bed%point(1:2, bed%triangle(c, f))
      q = bed%point(1:2, bed%triangle(1 + mod(c, 3), f))
      rise = 0
      if (p(2) <= at(2) .and. q(2) > at(2)) then
        rise = 1
        side = (q(1) - p(1))*(at(2) - p(2)) - (at(1) - p(1))*(q(2) - p(2))
      else if (q(2) <= at(2) .and. p(2) > at(2)) then
        rise = -1
        side = (p(1) - q(1))*(at(2) - q(2)) - (at(1) - q(1))*(p(2) - q(2))
      else
        cycle
      end if
      if (side > 0.0_wp) way = way + rise   ! the edge passes on the side of larger x
    end do
  end function way_of

  !> Height of the plane of facet f at a place [m].
  pure function height_of(bed, f, at) result(height)
    type(bed_t), intent(in) :: bed
    integer, intent(in) :: f
    real(wp), intent(in) :: at(3)
    real(wp) :: height
    real(wp) :: n(3), offset

    call set_plane(bed%point(:, bed%triangle(:, f)), n, offset)
    height = (offset - n(1)*at(1) - n(2)*at(2))/n(3)
  end function height_of

  !> Does the solid of the bed hold a point?
  pure function bed_covers(bed, x) result(yes)
    type(bed_t), intent(in) :: bed
    real(wp), intent(in) :: x(3)   !! [m]
    logical :: yes
    integer :: bin, m, f, way, above

    above = 0
    bin = column_of(bed, x)
    do m = bed%columns%first(bin), bed%columns%first(bin + 1) - 1
      f = bed%columns%item(m)
      way = way_of(bed, f, x)
      if (way == 0) cycle
      if (height_of(bed, f, x) > x(3)) above = above + way
    end do
    yes = above > 0
  end function bed_covers

  !> Where a point is seen from the bed: shifted into the tank by whole periods.
  pure function bed_place(bed, x) result(place)
    type(bed_t), intent(in) :: bed
    real(wp), intent(in) :: x(3)   !! never wrapped [m]
    real(wp) :: place(3)

    place = x
    where (bed%period > 0.0_wp) place = x - bed%period &
                                        *floor((x - bed%origin)/max(bed%period, tiny(x)))
  end function bed_place

  !> May the surface of the bed meet a box? By its bins.
  pure function bed_is_near(bed, low, high) result(yes)
    type(bed_t), intent(in) :: bed
    real(wp), intent(in) :: low(3), high(3)   !! [m]
    logical :: yes
    integer :: a(3), b(3), i, j, k, bin

    yes = .false.
    associate (bins => bed%surface%facets)
      if (any(low > bins%high) .or. any(high < bins%low)) return
      a = bins%place(low)
      b = bins%place(high)
      yes = .true.
      do k = a(3), b(3)
        do j = a(2), b(2)
          do i = a(1), b(1)
            bin = bins%number([i, j, k])
            if (bins%first(bin + 1) > bins%first(bin)) return
          end do
        end do
      end do
      yes = .false.
    end associate
  end function bed_is_near

  !> Signed distance of a point from the bed (positive outside), and the unit vector along which it
  !! grows: exact up to `near` outside and up to `far` inside; beyond that `nowhere` or -`far`.
  subroutine bed_distance(bed, x, near, far, found, distance, outward)
    type(bed_t), intent(inout) :: bed     !! made ready where it is searched
    real(wp), intent(in) :: x(3)          !! [m]
    real(wp), intent(in) :: near, far     !! near <= far [m]
    type(found_t), intent(inout) :: found   !! work
    real(wp), intent(out) :: distance     !! [m]
    real(wp), intent(out) :: outward(3)   !! 0 where the distance is not exact
    real(wp), parameter :: least = 0.02_wp   !! share of `far` to begin with
    real(wp) :: cutoff

    cutoff = near
    do
      call make_ready(x - cutoff, x + cutoff, bed, found)
      call nearest_on_surface(bed%surface, x, found%facets%item(:found%facets%n), &
        found%edges%item(:found%edges%n), distance, outward)
      if (abs(distance) <= cutoff) return
      outward = 0.0_wp
      if (cutoff <= near) then
        distance = nowhere
        if (.not. bed_covers(bed, x)) return
      end if
      distance = -far
      if (cutoff >= far) return
      cutoff = min(max(2*cutoff, least*far), far)
    end do
  end subroutine bed_distance

  !> The part of facet f over a rectangle of the ground plane.
  pure subroutine facet_within(bed, f, low, high, n, p)
    type(bed_t), intent(in) :: bed
    integer, intent(in) :: f
    real(wp), intent(in) :: low(:), high(:)       !! in x and y first [m]
    integer, intent(out) :: n                     !! corners, none where they do not meet
    real(wp), intent(out) :: p(3, max_clip_corners)   !! [m]
    integer :: d

    p(:, :3) = bed%point(:, bed%triangle(:, f))
    n = 3
    do d = 1, 2
      call clip_polygon(d, low(d), 1.0_wp, n, p)
      call clip_polygon(d, high(d), -1.0_wp, n, p)
    end do
  end subroutine facet_within

  !> Three coordinates.
  pure function point_text(x) result(text)
    real(wp), intent(in) :: x(3)   !! [m]
    character(:), allocatable :: text

    text = 'x, y, z = '//brief(x(1), 9)//', '//brief(x(2), 9)//', '//brief(x(3), 9)//' m'
  end function point_text

end module bed_m
