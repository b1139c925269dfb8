!> Liquid at the start of a run, and the rise of its surface when a block appears in it.
module liquid_fill_m
  use kinds_m, only: wp, i8
  use case_types_m, only: fluid_t, water_t, absent
  use grid_m, only: grid_t, unit_step
  use fields_m, only: flow_t
  use boundary_m, only: fill_scalar_halo
  use solid_geometry_m, only: solid_geometry_t
  use plic_m, only: unit_constant
  use cut_cell_m, only: cut_cell_t, cut_cell_init, load_cut_cell, open_below
  use surface_normal_m, only: vertical_t, vertical_of, surface_normal
  use extended_fraction_m, only: extended_fraction_t, extend_fraction, liquid_share, nearly_pure
  use exact_sum_m, only: exact_sum, exact_add, exact_totals, accumulator_size, no_terms
  use parallel_m, only: global_max
  implicit none
  private
  public :: fill_liquid, raise_surface, liquid_volume

  real(wp), parameter :: no_surface = -huge(1.0_wp)   !! column of cells without a free surface

contains

  !> Liquid volume of the whole domain [m3].
  function liquid_volume(grid, liquid) result(volume)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: liquid(grid%first(1):, grid%first(2):, grid%first(3):)
      !! W [m3]
    real(wp) :: volume
    integer(i8) :: accumulator(accumulator_size, 1)
    real(wp) :: total(1)
    integer :: j, k

    accumulator(:, 1) = no_terms
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        call exact_add(liquid(grid%lo(1):grid%hi(1), j, k), accumulator(:, 1))
      end do
    end do
    call exact_totals(accumulator, total)
    volume = total(1)
  end function liquid_volume

  !> Fill the open space below the water level and in boxes; overlaps count once, cut cells get the
  !! exact share. Sets liquid and fluid volume, halo filled, and the initial volume; C^ follows from
  !! `extend_fraction`.
  subroutine fill_liquid(grid, fluid, water, solid, flow)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid       !! its level counts along the vertical
    type(water_t), intent(in) :: water(:)    !! boxes
    type(solid_geometry_t), intent(in) :: solid
    type(flow_t), intent(inout) :: flow
    type(cut_cell_t) :: cut
    type(vertical_t) :: vertical
    real(wp) :: low(3, size(water) + 1), high(3, size(water) + 1)
    integer :: i, j, k, m, axis

    call cut_cell_init(cut)
    ! The boxes of the case, and the level as a box without other bounds.
    do m = 1, size(water)
      low(:, m) = water(m)%min
      high(:, m) = water(m)%max
    end do
    m = size(water) + 1
    low(:, m) = grid%origin - grid%length
    high(:, m) = grid%origin + 2.0_wp*grid%length
    vertical = vertical_of(fluid%gravity)
    axis = maxloc(abs(vertical%up), 1)
    if (vertical%up(axis) > 0.0_wp) then
      high(axis, m) = fluid%water_level
    else
      low(axis, m) = fluid%water_level
    end if
    if (fluid%water_level <= absent) high(:, m) = low(:, m)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          flow%fluid_volume(i, j, k) = grid%volume*(1.0_wp - solid%alpha(i, j, k))
          flow%liquid(i, j, k) = flow%fluid_volume(i, j, k)
          if (fluid%single_phase .or. flow%fluid_volume(i, j, k) <= 0.0_wp) cycle
          flow%liquid(i, j, k) = flow%fluid_volume(i, j, k)*share_in_boxes([i, j, k])
        end do
      end do
    end do
    call fill_scalar_halo(grid, flow%liquid)
    call fill_scalar_halo(grid, flow%fluid_volume)
    flow%liquid_initial = liquid_volume(grid, flow%liquid)
    flow%liquid_inflow = 0.0_wp
  contains
    !> Share of the open part of a cell that lies in one box at least.
    real(wp) function share_in_boxes(at) result(share)
      integer, intent(in) :: at(3)
      real(wp), dimension(3, size(water) + 1) :: a, b
      real(wp) :: corner(3)
      integer :: m, n

      corner = grid%face(at, [1, 2, 3])
      share = 0.0_wp
      n = 0
      do m = 1, size(low, 2)
        a(:, n + 1) = min(max((low(:, m) - corner)/grid%h, 0.0_wp), 1.0_wp)
        b(:, n + 1) = min(max((high(:, m) - corner)/grid%h, 0.0_wp), 1.0_wp)
        if (any(b(:, n + 1) <= a(:, n + 1))) cycle
        n = n + 1
        if (all(a(:, n) <= 0.0_wp .and. b(:, n) >= 1.0_wp)) share = 1.0_wp
      end do
      if (n == 0 .or. share >= 1.0_wp) return
      call open_union(grid, solid, at, a(:, 1:n), b(:, 1:n), cut, share)
    end function share_in_boxes
  end subroutine fill_liquid

  !> Open volume of a cell in the union of boxes, as a share of its open volume.
  !!
  !! The faces of all boxes cut the cell into bricks; each lies in a box or outside all.
  subroutine open_union(grid, solid, at, a, b, cut, share)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: at(3)
    real(wp), intent(in) :: a(:, :), b(:, :)    !! (3, n) boxes in shares of the cell, not empty
    type(cut_cell_t), intent(inout) :: cut
    real(wp), intent(out) :: share
    real(wp) :: x(2*size(a, 2), 3), p(3), q(3), middle(3), corner(3), total
    integer :: n, m, d, i, j, k, l

    n = size(a, 2)
    m = solid%cut(at(1), at(2), at(3))
    corner = grid%face(at, [1, 2, 3])
    do d = 1, 3
      x(1:n, d) = a(d, :)
      x(n + 1:, d) = b(d, :)
      call sort(x(:, d))
    end do
    call load_cut_cell(solid, m, corner, grid%h, cut)
    total = cut%open
    share = 0.0_wp
    do k = 1, 2*n - 1
      do j = 1, 2*n - 1
        do i = 1, 2*n - 1
          p = [x(i, 1), x(j, 2), x(k, 3)]
          q = [x(i + 1, 1), x(j + 1, 2), x(k + 1, 3)]
          if (any(q <= p)) cycle
          middle = 0.5_wp*(p + q)
          if (.not. any([(all(middle > a(:, l) .and. middle < b(:, l)), l=1, n)])) cycle
          call load_cut_cell(solid, m, corner + grid%h*p, grid%h*(q - p), cut)
          share = share + cut%open*product(q - p)
        end do
      end do
    end do
    share = min(share/max(total, tiny(total)), 1.0_wp)
  end subroutine open_union

  !> Rising order, in place.
  pure subroutine sort(x)
    real(wp), intent(inout) :: x(:)
    real(wp) :: key
    integer :: i, j

    do i = 2, size(x)
      key = x(i)
      j = i - 1
      do while (j >= 1)
        if (x(j) <= key) exit
        x(j + 1) = x(j)
        j = j - 1
      end do
      x(j + 1) = key
    end do
  end subroutine sort

  !> Make room for solids that have appeared and give the liquid in their place back as an equal
  !! rise of the free surface.
  !!
  !! The surface stands still while the solids appear: a cell keeps what its smaller open part holds
  !! below the plane. What was displaced goes on top of the surface, in all columns of cells equally
  !! high, in the open part only. Where a column has several surfaces it is the highest with two wet
  !! cells below. Without a free surface (all liquid, or a tank full to the top) there is no such
  !! place: the rest has left the tank and is booked as outflow, so that the balance of the run
  !! stays closed.
  subroutine raise_surface(grid, before, after, extension, flow, rest)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: before, after   !! without and with the new solids
    type(extended_fraction_t), intent(inout) :: extension
    type(flow_t), intent(inout) :: flow
    real(wp), intent(out), optional :: rest   !! liquid that found no place [m3]
    real(wp) :: displaced, left

    call take_from_solid(grid, before, after, extension%vertical, flow, displaced)
    left = displaced
    if (displaced > 0.0_wp) call add_layer(grid, after, extension%vertical, displaced, flow, left)
    flow%liquid_inflow = flow%liquid_inflow - left
    call fill_scalar_halo(grid, flow%liquid)
    call fill_scalar_halo(grid, flow%fluid_volume)
    call extend_fraction(grid, after, extension, flow)
    if (present(rest)) rest = left
  end subroutine raise_surface

  !> Fluid volume and liquid of the cells whose solid share has changed, and the liquid that was in
  !! the way.
  subroutine take_from_solid(grid, before, after, vertical, flow, displaced)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: before, after
    type(vertical_t), intent(in) :: vertical
    type(flow_t), intent(inout) :: flow
    real(wp), intent(out) :: displaced   !! [m3]
    type(cut_cell_t) :: cut
    integer(i8) :: accumulator(accumulator_size, 1)
    real(wp) :: share, m(3), below, fluid_volume, kept, total(1)
    integer :: i, j, k

    call cut_cell_init(cut)
    accumulator(:, 1) = no_terms
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          if (.not. abs(after%alpha(i, j, k) - before%alpha(i, j, k)) > 0.0_wp) cycle
          fluid_volume = grid%volume*(1.0_wp - after%alpha(i, j, k))
          share = liquid_share(flow%liquid(i, j, k), flow%fluid_volume(i, j, k))
          kept = share*fluid_volume
          if (share > nearly_pure .and. share < 1.0_wp - nearly_pure &
              .and. fluid_volume > 0.0_wp) then
            m = surface_normal(grid, before, vertical, flow%c, i, j, k)
            call load_cut_cell(after, after%cut(i, j, k), grid%face([i, j, k], [1, 2, 3]), &
                               grid%h, cut)
            call open_below(cut, m, unit_constant(m, flow%c(i, j, k)), below)
            kept = fluid_volume*min(max(below/max(cut%open, tiny(below)), 0.0_wp), 1.0_wp)
          end if
          call exact_add([flow%liquid(i, j, k), -kept], accumulator(:, 1))
          flow%liquid(i, j, k) = kept
          flow%fluid_volume(i, j, k) = fluid_volume
        end do
      end do
    end do
    call exact_totals(accumulator, total)
    displaced = total(1)
  end subroutine take_from_solid

  !> Put a volume on the free surface as a layer of equal height.
  subroutine add_layer(grid, solid, vertical, volume, flow, rest)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(vertical_t), intent(in) :: vertical
    real(wp), intent(in) :: volume   !! [m3], > 0
    type(flow_t), intent(inout) :: flow
    real(wp), intent(out) :: rest    !! volume that found no place, or < 0: came without [m3]
    integer, parameter :: max_iterations = 100
    type(cut_cell_t) :: cut
    real(wp), allocatable :: surface(:, :), gain(:)
    integer, allocatable :: cell(:, :)
    real(wp) :: rise, low, high, f_low, f_high, f   ! height of the layer [m], volumes missing [m3]
    integer :: it, l, axis

    axis = maxloc(abs(vertical%up), 1)
    call cut_cell_init(cut)
    call find_surface(grid, vertical, flow%c, surface)
    call cells_above(grid, axis, vertical%up(axis), surface, flow, cell)
    allocate (gain(size(cell, 2)))
    low = 0.0_wp
    f_low = -volume
    high = grid%length(axis)
    f_high = layer_volume(high) - volume
    rise = high
    f = f_high
    if (f_high > 0.0_wp) then
      do it = 1, max_iterations   ! false position, the kept end weakened (Illinois)
        rise = low - f_low*(high - low)/(f_high - f_low)
        if (.not. (rise > low .and. rise < high)) exit
        f = layer_volume(rise) - volume
        if (abs(f) <= 0.1_wp*epsilon(f)*volume) exit
        if (f > 0.0_wp) then
          high = rise
          f_high = f
          f_low = 0.5_wp*f_low
        else
          low = rise
          f_low = f
          f_high = 0.5_wp*f_high
        end if
      end do
    end if
    f = layer_volume(rise) - volume
    do l = 1, size(cell, 2)
      associate (at => cell(:, l))
        flow%liquid(at(1), at(2), at(3)) = flow%liquid(at(1), at(2), at(3)) + gain(l)
      end associate
    end do
    rest = -f
    if (abs(rest) <= 100.0_wp*epsilon(f)*volume) rest = 0.0_wp
  contains
    !> Volume of a layer of this height; `gain` holds the share of each cell.
    real(wp) function layer_volume(height) result(total)
      real(wp), intent(in) :: height
      integer :: n, other(2)

      do n = 1, size(gain)
        other = pack(cell(:, n), [1, 2, 3] /= axis)   ! its column
        call layer_in_cell(grid, solid, vertical, cell(:, n), &
                           surface(other(1), other(2)) + [0.0_wp, height], cut, gain(n))
        associate (at => cell(:, n))
          gain(n) = min(gain(n), flow%fluid_volume(at(1), at(2), at(3)) &
                        - flow%liquid(at(1), at(2), at(3)))
        end associate
      end do
      total = exact_sum(gain)
    end function layer_volume
  end subroutine add_layer

  !> Open volume of a cell between two heights along the vertical [m3].
  subroutine layer_in_cell(grid, solid, vertical, at, heights, cut, volume)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(vertical_t), intent(in) :: vertical
    integer, intent(in) :: at(3)
    real(wp), intent(in) :: heights(2)   !! rising [m]
    type(cut_cell_t), intent(inout) :: cut
    real(wp), intent(out) :: volume
    real(wp) :: bottom, from, to, share(2)
    integer :: axis

    axis = maxloc(abs(vertical%up), 1)
    bottom = min(vertical%up(axis)*grid%face(at(axis), axis), &
                 vertical%up(axis)*grid%face(at(axis) + 1, axis))
    from = min(max((heights(1) - bottom)/grid%h(axis), 0.0_wp), 1.0_wp)
    to = min(max((heights(2) - bottom)/grid%h(axis), 0.0_wp), 1.0_wp)
    volume = 0.0_wp
    if (to <= from) return
    if (solid%cut(at(1), at(2), at(3)) == 0) then
      volume = grid%volume*(to - from)
      return
    end if
    call load_cut_cell(solid, solid%cut(at(1), at(2), at(3)), grid%face(at, [1, 2, 3]), grid%h, cut)
    call open_below(cut, vertical%up, along(from), share(1))
    call open_below(cut, vertical%up, along(to), share(2))
    volume = grid%volume*max(share(2) - share(1), 0.0_wp)
  contains
    !> Constant of the level plane at a share of the cell's height.
    pure real(wp) function along(t)
      real(wp), intent(in) :: t

      along = t + min(vertical%up(axis), 0.0_wp)
    end function along
  end subroutine layer_in_cell

  !> Height of the free surface of every column of the domain, along the vertical, or `no_surface`.
  subroutine find_surface(grid, vertical, c, surface)
    type(grid_t), intent(in) :: grid
    type(vertical_t), intent(in) :: vertical
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
      !! C^, halo filled
    real(wp), allocatable, intent(out) :: surface(:, :)   !! over the two other directions [m]
    integer :: i, j, k, axis, other(2), n(2), e(3), at(3), m
    real(wp) :: here, under, under_2, up, z
    logical :: on_floor, below_lid
    real(wp), allocatable :: all_columns(:)

    axis = maxloc(abs(vertical%up), 1)
    up = vertical%up(axis)
    e = nint(up)*unit_step(:, axis)
    n = pack(grid%n, [1, 2, 3] /= axis)
    allocate (all_columns(n(1)*n(2)), source=no_surface)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          at = [i, j, k]
          other = pack(at, [1, 2, 3] /= axis)
          m = other(1) + n(1)*(other(2) - 1)
          here = c(i, j, k)
          under = c(i - e(1), j - e(2), k - e(3))
          under_2 = c(i - 2*e(1), j - 2*e(2), k - 2*e(3))
          z = min(up*grid%face(at(axis), axis), up*grid%face(at(axis) + 1, axis))
          on_floor = grid%beside(at(axis), merge(1, 2, up > 0.0_wp), axis)
          below_lid = grid%beside(at(axis), merge(2, 1, up > 0.0_wp), axis)
          if (on_floor) then
            if (here <= 0.0_wp) cycle
            under = 1.0_wp
            under_2 = 1.0_wp
          end if
          if (here >= merge(1.0_wp, 0.5_wp, below_lid)) cycle   ! else in the cell above
          if (under < 0.5_wp .or. under_2 < 0.5_wp) cycle
          z = z + (here + under - 1.0_wp)*grid%h(axis)
          all_columns(m) = max(all_columns(m), z)
        end do
      end do
    end do
    call global_max(all_columns)
    surface = reshape(all_columns, n)
  end subroutine find_surface

  !> Cells of this process with open volume above the surface of their column.
  subroutine cells_above(grid, axis, up, surface, flow, cell)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: axis
    real(wp), intent(in) :: up, surface(:, :)
    type(flow_t), intent(in) :: flow
    integer, allocatable, intent(out) :: cell(:, :)   !! (3, *)
    integer :: i, j, k, n, pass, other(2), at(3)
    real(wp) :: top

    do pass = 1, 2
      n = 0
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            if (flow%fluid_volume(i, j, k) <= flow%liquid(i, j, k)) cycle
            other = pack([i, j, k], [1, 2, 3] /= axis)
            if (surface(other(1), other(2)) <= no_surface) cycle
            at = [i, j, k]
            top = max(up*grid%face(at(axis), axis), up*grid%face(at(axis) + 1, axis))
            if (top <= surface(other(1), other(2))) cycle
            n = n + 1
            if (pass == 2) cell(:, n) = [i, j, k]
          end do
        end do
      end do
      if (pass == 1) allocate (cell(3, n))
    end do
  end subroutine cells_above

end module liquid_fill_m
