!> Forces of the surface at the faces, in balance with the pressure gradient: surface tension, and
!! what the weight gains where the liquid of a cell lies (`weight_at_faces`).
!!
!! $$ f_f = \sigma \kappa_f \frac{C_{high} - C_{low}}{h} $$
!! It joins gravity and the pressure gradient at the same faces, so a pressure that jumps by
!! sigma kappa where C jumps holds a surface of constant curvature at rest to round-off (balanced
!! force: Francois et al., J. Comput. Phys. 213, 2006).
!!
!! The curvature comes from height functions: the liquid in a column of up to seven cells along the
!! main direction of the normal is the height of the surface there, and nine heights give the
!! curvature to second order (Cummins, Francois, Kothe, Comput. Struct. 83, 2005). Each column ends
!! at its first full and its first empty cell, so that another surface beyond does not count. Every
!! cell at the surface keeps its heights, so that a steep neighbour is found up to two cells higher
!! or lower (Popinet, J. Comput. Phys. 228, 2009). Where no direction has nine whole columns, the
!! cell takes the mean of its neighbours that have, and where there are none the divergence of the
!! normals; both are counted.
!!
!! C is the share extended through bodies (`extended_fraction_m`) and repeated at the sides of the
!! domain: the surface meets walls and upright sides of bodies at 90 degrees. A column behind a
!! closed face does not count either; the one before the face stands for it.
module surface_tension_m
  use kinds_m, only: wp, i8, pi
  use case_types_m, only: fluid_t
  use grid_m, only: grid_t, n_halo, unit_step
  use boundary_kinds_m, only: no_side
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t
  use rigid_flux_m, only: rigid_flux_t
  use mixture_m, only: face_mean
  use boundary_m, only: fill_scalar_halo
  use plic_m, only: unit_normal
  use surface_normal_m, only: passable
  use extended_fraction_m, only: nearly_pure
  use exact_sum_m, only: exact_sums
  use parallel_m, only: halo_exchange, global_sum
  implicit none
  private
  public :: surface_tension_t, find_tension, add_tension, force_from_tension, capillary_step

  integer, parameter :: reach = 3    !! cells of a column on either side of its middle
  integer, parameter :: search = 2   !! cells up or down in which a neighbour's height is looked for
  real(wp), parameter :: no_height = huge(1.0_wp)
  !> What is known of the curvature of a cell.
  integer, parameter :: no_surface = 0, wanted = 1, from_heights = 2, from_others = 3

  type :: surface_tension_t
    logical :: acts = .false.
    real(wp), allocatable :: curvature(:, :, :)  !! of the surface, positive around liquid [1/m]
    integer, allocatable :: state(:, :, :)       !! of the curvature, see above
    !> Place of the surface along each direction from the centre of a cell at it [cells].
    real(wp), allocatable :: place(:, :, :, :)
    real(wp), allocatable :: force(:, :, :, :)   !! at the lower faces, per volume [N/m3]
    integer :: n_wanted = 0                      !! cells of this process without heights
    integer, allocatable :: cell(:, :)           !! (3, *) those cells
    real(wp), allocatable :: value(:)            !! (*) their curvature
    integer :: fallback = 0                      !! such cells of all processes
  end type surface_tension_t

contains

  !> Longest stable step with explicit surface tension [s]; huge without.
  !!
  !! $$ \Delta t = \sqrt{(\rho_l + \rho_g) h^3/(4\pi\sigma)} $$
  !! The shortest wave of the grid must not pass a cell in a step (Brackbill, Kothe, Zemach,
  !! J. Comput. Phys. 100, 1992).
  pure function capillary_step(fluid, h) result(dt)
    type(fluid_t), intent(in) :: fluid
    real(wp), intent(in) :: h   !! smallest spacing of the cells [m]
    real(wp) :: dt

    dt = huge(1.0_wp)
    if (fluid%single_phase .or. fluid%surface_tension <= 0.0_wp) return
    dt = sqrt((fluid%liquid_density + fluid%gas_density)*h**3/(4.0_wp*pi*fluid%surface_tension))
  end function capillary_step

  !> Curvature of the surface and its force at all faces of own cells.
  subroutine find_tension(grid, fluid, solid, c, self)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
      !! C^, halo filled [-]
    type(surface_tension_t), intent(inout) :: self
    integer(i8) :: cells(1)

    self%acts = .not. fluid%single_phase
    if (.not. self%acts) return
    if (.not. allocated(self%force)) call allocate_tension(grid, fluid%surface_tension, self)
    self%force = 0.0_wp
    call weight_at_faces(grid, fluid, c, self%force)
    if (fluid%surface_tension <= 0.0_wp) return
    call find_places(grid, c, self)
    call curvature_from_heights(grid, solid, c, self)
    call list_wanted(grid, self)
    call curvature_from_others(grid, c, self)
    cells = int(self%n_wanted, i8)
    call global_sum(cells)
    self%fallback = int(cells(1))
    call force_at_faces(grid, fluid%surface_tension, c, self)
  end subroutine find_tension

  !> Room for the fields, at the start of a run.
  subroutine allocate_tension(grid, sigma, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: sigma   !! [N/m]
    type(surface_tension_t), intent(inout) :: self
    integer, parameter :: first_size = 1024
    integer :: a(3), b(3)

    a = grid%first
    b = grid%last
    allocate (self%force(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
    if (sigma <= 0.0_wp) return
    allocate (self%curvature(a(1):b(1), a(2):b(2), a(3):b(3)), source=0.0_wp)
    allocate (self%state(a(1):b(1), a(2):b(2), a(3):b(3)), source=no_surface)
    allocate (self%place(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=no_height)
    allocate (self%cell(3, first_size), self%value(first_size))
  end subroutine allocate_tension

  !> Place of the surface in the columns through every cell at it.
  subroutine find_places(grid, c, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    type(surface_tension_t), intent(inout) :: self
    integer :: i, j, k, d, way
    real(wp) :: height
    logical :: found

    do d = 1, 3
      !$omp parallel do private(i, j, way, height, found) schedule(dynamic, 4)
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            self%place(i, j, k, d) = no_height
            way = way_of_gas(grid, c, [i, j, k], d)
            if (way == 0) cycle
            call column_height(grid, c, [i, j, k], d, way, height, found)
            if (found) self%place(i, j, k, d) = real(way, wp)*height
          end do
        end do
      end do
      call fill_scalar_halo(grid, self%place(:, :, :, d))
    end do
  end subroutine find_places

  !> Does the share fall (1) or rise (-1) along direction d at a cell? 0: neither.
  pure function way_of_gas(grid, c, at, d) result(way)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    integer, intent(in) :: at(3), d
    integer :: way
    integer :: up(3), low(3)
    real(wp) :: fall

    up = at + unit_step(:, d)
    low = at - unit_step(:, d)
    fall = c(low(1), low(2), low(3)) - c(up(1), up(2), up(3))
    way = 0
    if (abs(fall) > nearly_pure) way = nint(sign(1.0_wp, fall))
  end function way_of_gas

  !> Curvature of every own cell that holds or borders the surface, where its columns give one.
  subroutine curvature_from_heights(grid, solid, c, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    type(surface_tension_t), intent(inout) :: self
    integer :: i, j, k
    logical :: found

    !$omp parallel do private(i, j, found) schedule(dynamic, 4)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          self%state(i, j, k) = no_surface
          self%curvature(i, j, k) = 0.0_wp
          if (.not. at_surface(grid, c, i, j, k)) cycle
          call height_curvature(grid, solid, c, self%place, [i, j, k], self%curvature(i, j, k), &
                                found)
          self%state(i, j, k) = merge(from_heights, wanted, found)
        end do
      end do
    end do
    call halo_exchange(self%curvature, n_halo)
    call halo_exchange(self%state, n_halo)
  end subroutine curvature_from_heights

  !> Does the surface pass through a cell or through one of its faces?
  pure function at_surface(grid, c, i, j, k) result(yes)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    integer, intent(in) :: i, j, k
    logical :: yes
    real(wp) :: around(6)

    yes = .not. (is_full(c(i, j, k)) .or. is_empty(c(i, j, k)))
    if (yes) return
    around = [c(i - 1, j, k), c(i + 1, j, k), c(i, j - 1, k), c(i, j + 1, k), c(i, j, k - 1), &
              c(i, j, k + 1)]
    if (is_full(c(i, j, k))) then
      yes = any(is_empty(around))
    else
      yes = any(is_full(around))
    end if
  end function at_surface

  elemental function is_full(c) result(yes)
    real(wp), intent(in) :: c
    logical :: yes

    yes = c >= 1.0_wp - nearly_pure
  end function is_full

  elemental function is_empty(c) result(yes)
    real(wp), intent(in) :: c
    logical :: yes

    yes = c <= nearly_pure
  end function is_empty

  !> Curvature at a cell from the heights of nine columns, in the direction of the largest component
  !! of the normal that has them all.
  !!
  !! $$ \kappa = -\frac{h_{xx}(1 + h_y^2) + h_{yy}(1 + h_x^2) - 2 h_x h_y h_{xy}}
  !! {(1 + h_x^2 + h_y^2)^{3/2}} $$
  !! with h the height of the surface from the liquid towards the gas.
  pure subroutine height_curvature(grid, solid, c, place, at, curvature, found)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
      !! C^, halo filled [-]
    real(wp), intent(in), contiguous :: place(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! of the surface [cells]
    integer, intent(in) :: at(3)
    real(wp), intent(out) :: curvature   !! [1/m], 0 if not found
    logical, intent(out) :: found
    real(wp) :: normal(3), height(-1:1, -1:1)
    logical :: tried(3)
    integer :: d, n, x, y

    curvature = 0.0_wp
    found = .false.
    normal = normal_at(grid, c, at)
    tried = abs(normal) <= 0.0_wp
    do n = 1, 3
      if (all(tried)) return
      d = maxloc(abs(normal), 1, .not. tried)
      tried(d) = .true.
      call nine_heights(grid, solid, c, place(:, :, :, d), at, d, &
                        nint(sign(1.0_wp, normal(d))), height, found)
      if (.not. found) cycle
      x = modulo(d, 3) + 1
      y = modulo(d + 1, 3) + 1
      curvature = curvature_of_heights(height*grid%h(d), grid%h(x), grid%h(y))
      return
    end do
  end subroutine height_curvature

  !> Curvature of the surface z = height(x, y) above its liquid [1/m].
  pure function curvature_of_heights(z, dx, dy) result(curvature)
    real(wp), intent(in) :: z(-1:1, -1:1)   !! [m]
    real(wp), intent(in) :: dx, dy          !! [m]
    real(wp) :: curvature
    real(wp) :: zx, zy, zxx, zyy, zxy

    zx = (z(1, 0) - z(-1, 0))/(2.0_wp*dx)
    zy = (z(0, 1) - z(0, -1))/(2.0_wp*dy)
    zxx = ((z(1, 0) - z(0, 0)) + (z(-1, 0) - z(0, 0)))/dx**2
    zyy = ((z(0, 1) - z(0, 0)) + (z(0, -1) - z(0, 0)))/dy**2
    zxy = ((z(1, 1) - z(-1, 1)) - (z(1, -1) - z(-1, -1)))/(4.0_wp*dx*dy)
    curvature = -(zxx*(1.0_wp + zy**2) + zyy*(1.0_wp + zx**2) - 2.0_wp*zx*zy*zxy) &
                /(1.0_wp + zx**2 + zy**2)**1.5_wp
  end function curvature_of_heights

  !> Unit vector from the liquid to the gas at a cell, zero where there is no direction.
  pure function normal_at(grid, c, at) result(normal)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    integer, intent(in) :: at(3)
    real(wp) :: normal(3)

    normal = unit_normal(c(at(1) - 1:at(1) + 1, at(2) - 1:at(2) + 1, at(3) - 1:at(3) + 1))/grid%h
    normal = normal/max(norm2(normal), tiny(1.0_wp))
  end function normal_at

  !> Heights of the surface in the nine columns along direction d around a cell, over the centre of
  !! the cell, in cells.
  pure subroutine nine_heights(grid, solid, c, place, at, d, way, height, found)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in), contiguous, dimension(grid%first(1):, grid%first(2):, grid%first(3):) :: &
      c, place
    integer, intent(in) :: at(3), d, way   !! 1: the gas lies above the liquid along d, -1: below
    real(wp), intent(out) :: height(-1:1, -1:1)
    logical, intent(out) :: found
    logical :: seen(-1:1, -1:1)
    integer :: a, b, ex(3), ey(3)

    ex = unit_step(:, modulo(d, 3) + 1)
    ey = unit_step(:, modulo(d + 1, 3) + 1)
    seen = .true.
    if (any(solid%alpha(at(1) - 1:at(1) + 1, at(2) - 1:at(2) + 1, at(3) - 1:at(3) + 1) &
            > 0.0_wp)) call look_around(solid, at, [modulo(d, 3), modulo(d + 1, 3)] + 1, seen)
    height = 0.0_wp
    do b = -1, 1
      do a = -1, 1
        if (.not. seen(a, b)) cycle
        call nearest_height(grid, c, place, at + a*ex + b*ey, d, way, height(a, b), found)
        if (.not. found) return
      end do
    end do
    do b = -1, 1
      do a = -1, 1
        if (seen(a, b)) cycle
        if (seen(a, 0)) then
          height(a, b) = height(a, 0)
        else if (seen(0, b)) then
          height(a, b) = height(0, b)
        else
          height(a, b) = height(0, 0)
        end if
      end do
    end do
  end subroutine nine_heights

  !> Height of the surface in the column of a cell, over its centre, from the nearest cell of the
  !! column that knows it: upwards if the cell is full, downwards if it is empty.
  pure subroutine nearest_height(grid, c, place, at, d, way, height, found)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous, dimension(grid%first(1):, grid%first(2):, grid%first(3):) :: &
      c, place
    integer, intent(in) :: at(3), d, way
    real(wp), intent(out) :: height   !! [cells]
    logical, intent(out) :: found
    integer :: n, s, cell(3)

    found = .false.
    height = 0.0_wp
    do n = 0, search
      do s = 1, -1, -2
        if (s > 0 .and. is_empty(c(at(1), at(2), at(3))) .and. n > 0) cycle
        if (s < 0 .and. (is_full(c(at(1), at(2), at(3))) .or. n == 0)) cycle
        cell = at + s*way*n*unit_step(:, d)
        if (grid%beyond(cell(d), d)) cycle
        if (place(cell(1), cell(2), cell(3)) >= no_height) cycle
        if (way_of_gas(grid, c, cell, d) /= way) cycle
        height = real(s*n, wp) + real(way, wp)*place(cell(1), cell(2), cell(3))
        found = .true.
        return
      end do
    end do
  end subroutine nearest_height

  !> Which of the eight columns around that of a cell are joined to it by open faces beside it.
  pure subroutine look_around(solid, at, axis, seen)
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: at(3), axis(2)   !! the two directions across the columns
    logical, intent(out) :: seen(-1:1, -1:1)
    integer :: a, b

    seen(0, 0) = .true.
    do a = -1, 1, 2
      seen(a, 0) = through(at, 1, a)
      seen(0, a) = through(at, 2, a)
    end do
    do b = -1, 1, 2
      do a = -1, 1, 2
        seen(a, b) = (seen(a, 0) .and. through(at + a*unit_step(:, axis(1)), 2, b)) .or. &
                     (seen(0, b) .and. through(at + b*unit_step(:, axis(2)), 1, a))
      end do
    end do
  contains
    !> Is the face of a cell towards the next column open?
    pure logical function through(cell, direction, side)
      integer, intent(in) :: cell(3), direction, side
      integer :: f(3)

      f = cell + max(side, 0)*unit_step(:, axis(direction))
      through = passable(solid%open(f(1), f(2), f(3), axis(direction)))
    end function through
  end subroutine look_around

  !> Height of the surface in the column along d through a cell, over its centre, in cells.
  !!
  !! From the surface nearest to the cell the column reaches to the first full cell on one side and
  !! the first empty one on the other, or to a wall. Not found if it is longer than its reach.
  pure subroutine column_height(grid, c, at, d, way, height, found)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    integer, intent(in) :: at(3), d, way
    real(wp), intent(out) :: height
    logical, intent(out) :: found
    real(wp) :: column(-reach:reach)
    integer :: l, low, high, first, last

    height = 0.0_wp
    first = -reach
    last = reach
    if (.not. grid%periodic(d)) then
      if (way > 0) then
        first = max(first, 1 - at(d))
        last = min(last, grid%n(d) - at(d))
      else
        first = max(first, at(d) - grid%n(d))
        last = min(last, at(d) - 1)
      end if
    end if
    do l = first, last
      associate (o => at + way*l*unit_step(:, d))
        column(l) = c(o(1), o(2), o(3))
      end associate
    end do
    low = 0
    do while (is_full(column(low)))   ! up to the surface
      if (low == last) exit
      low = low + 1
    end do
    high = low
    do while (is_empty(column(high)))   ! or down to it
      if (high == first) exit
      high = high - 1
    end do
    low = high
    do while (low > first .and. .not. is_full(column(low)))
      low = low - 1
    end do
    do while (high < last .and. .not. is_empty(column(high)))
      high = high + 1
    end do
    found = ends_well(column(low), is_full(column(low)), first) .and. &
            ends_well(1.0_wp - column(high), is_empty(column(high)), last)
    if (found) height = real(low, wp) - 0.5_wp + sum(column(low:high))
  contains
    !> A column ends in a pure cell, or at a wall behind a cell that holds some of that phase.
    pure logical function ends_well(share, pure_cell, limit)
      real(wp), intent(in) :: share
      logical, intent(in) :: pure_cell
      integer, intent(in) :: limit

      ends_well = pure_cell .or. (abs(limit) < reach .and. .not. is_empty(share))
    end function ends_well
  end subroutine column_height

  !> List the own cells that have no curvature from heights.
  subroutine list_wanted(grid, self)
    type(grid_t), intent(in) :: grid
    type(surface_tension_t), intent(inout) :: self
    integer, allocatable :: longer(:, :)
    integer :: i, j, k, n

    n = 0
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          if (self%state(i, j, k) /= wanted) cycle
          if (n == size(self%value)) then
            allocate (longer(3, 2*n))
            longer(:, 1:n) = self%cell
            call move_alloc(longer, self%cell)
            deallocate (self%value)
            allocate (self%value(2*n))
          end if
          n = n + 1
          self%cell(:, n) = [i, j, k]
        end do
      end do
    end do
    self%n_wanted = n
  end subroutine list_wanted

  !> Mean of the neighbours that have heights, or the divergence of the normals.
  subroutine curvature_from_others(grid, c, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    type(surface_tension_t), intent(inout) :: self
    integer :: l, n

    do l = 1, self%n_wanted
      associate (a => self%cell(:, l) - 1, b => self%cell(:, l) + 1)
        n = count(self%state(a(1):b(1), a(2):b(2), a(3):b(3)) == from_heights)
        if (n > 0) then
          self%value(l) = sum(self%curvature(a(1):b(1), a(2):b(2), a(3):b(3)), &
            self%state(a(1):b(1), a(2):b(2), a(3):b(3)) == from_heights)/real(n, wp)
        else
          self%value(l) = normal_curvature(grid, c, self%cell(:, l))
        end if
      end associate
    end do
    do l = 1, self%n_wanted
      associate (at => self%cell(:, l))
        self%curvature(at(1), at(2), at(3)) = self%value(l)
        self%state(at(1), at(2), at(3)) = from_others
      end associate
    end do
    call halo_exchange(self%curvature, n_halo)
    call halo_exchange(self%state, n_halo)
  end subroutine curvature_from_others

  !> Divergence of the normals of the neighbours [1/m]: rough, but never more than that of a drop of
  !! one cell.
  pure function normal_curvature(grid, c, at) result(curvature)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
      !! C^, halo filled [-]
    integer, intent(in) :: at(3)
    real(wp) :: curvature
    real(wp) :: above(3), below(3)
    integer :: d

    curvature = 0.0_wp
    do d = 1, 3
      above = normal_at(grid, c, at + unit_step(:, d))
      below = normal_at(grid, c, at - unit_step(:, d))
      curvature = curvature + (above(d) - below(d))/(2.0_wp*grid%h(d))
    end do
  end function normal_curvature

  !> Force at the lower faces: the curvature of a face is the mean of its cells that have one. None
  !! on the sides of the domain.
  subroutine force_at_faces(grid, sigma, c, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: sigma   !! [N/m]
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    type(surface_tension_t), intent(inout) :: self
    integer :: i, j, k, d, e(3), known
    integer :: f(3)

    do d = 1, 3
      e = unit_step(:, d)
      !$omp parallel do private(i, j, f, known) schedule(static)
      do k = grid%lo(3), grid%hi(3) + e(3)
        do j = grid%lo(2), grid%hi(2) + e(2)
          do i = grid%lo(1), grid%hi(1) + e(1)
            f = [i, j, k]
            if (grid%side_of_face(f(d), d) /= no_side) cycle
            associate (low => self%state(i - e(1), j - e(2), k - e(3)), &
                       high => self%state(i, j, k))
              known = count([low, high] /= no_surface)
            end associate
            if (known == 0) cycle
            self%force(i, j, k, d) = self%force(i, j, k, d) &
              + sigma*(self%curvature(i - e(1), j - e(2), k - e(3)) &
                       + self%curvature(i, j, k))/real(known, wp) &
              *(c(i, j, k) - c(i - e(1), j - e(2), k - e(3)))/grid%h(d)
          end do
        end do
      end do
    end do
  end subroutine force_at_faces

  !> What the weight at the faces gains where the liquid of a cell does not fill it evenly:
  !! $$ f_f = \frac{1}{2}(\rho_l - \rho_g) g_d (s_{high} q_{high} - s_{low} q_{low}), \quad
  !! q = C (1 - C), \; s = C_{below} - C_{above} $$
  !!
  !! With level liquid at the bottom of a cell (s = 1) the pressure of the cell is then the mean of
  !! the true one, rho g C^2/2, whatever C; with half of C on either face, as the mean density has
  !! it, the layer of the surface moves as if it were half a cell deep, which makes the period of
  !! a wave wrong by up to k h/4, to either side, as the surface lies in its cell (measured: -1.3 %
  !! to 2.5 % at 32 cells per wavelength).
  subroutine weight_at_faces(grid, fluid, c, force)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(inout), contiguous :: force(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [N/m3]
    integer :: i, j, k, d, e(3), f(3)
    real(wp) :: weight

    do d = 1, 3
      weight = 0.5_wp*(fluid%liquid_density - fluid%gas_density)*fluid%gravity(d)
      if (.not. abs(weight) > 0.0_wp) cycle
      e = unit_step(:, d)
      !$omp parallel do private(i, j, f) schedule(static)
      do k = grid%lo(3), grid%hi(3) + e(3)
        do j = grid%lo(2), grid%hi(2) + e(2)
          do i = grid%lo(1), grid%hi(1) + e(1)
            f = [i, j, k]
            if (grid%side_of_face(f(d), d) /= no_side) cycle
            force(i, j, k, d) = weight*(uneven(f) - uneven(f - e))
          end do
        end do
      end do
    end do
  contains
    !> How much more of the liquid of a cell lies in its lower half than in its upper one [-].
    pure real(wp) function uneven(at)
      integer, intent(in) :: at(3)
      real(wp) :: here, below, above

      here = c(at(1), at(2), at(3))
      below = c(at(1) - e(1), at(2) - e(2), at(3) - e(3))
      above = c(at(1) + e(1), at(2) + e(2), at(3) + e(3))
      uneven = max(-1.0_wp, min(1.0_wp, below - above))*here*(1.0_wp - here)
    end function uneven
  end subroutine weight_at_faces

  !> Add the acceleration by surface tension to that of the faces: a_f += f_f/rho_f [m/s2].
  subroutine add_tension(grid, rho, self, a)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! that of the system [kg/m3]
    type(surface_tension_t), intent(in) :: self
    real(wp), intent(inout), contiguous :: a(grid%first(1):, grid%first(2):, grid%first(3):, :)
    integer :: i, j, k, d, e(3)

    if (.not. self%acts) return
    do d = 1, 3
      e = unit_step(:, d)
      !$omp parallel do private(i, j) schedule(static)
      do k = grid%lo(3), grid%hi(3) + e(3)
        do j = grid%lo(2), grid%hi(2) + e(2)
          do i = grid%lo(1), grid%hi(1) + e(1)
            a(i, j, k, d) = a(i, j, k, d) + self%force(i, j, k, d) &
                            /face_mean(rho(i - e(1), j - e(2), k - e(3)), rho(i, j, k))
          end do
        end do
      end do
    end do
  end subroutine add_tension

  !> Add force and torque of the surface on each body to those of the pressure: the tension of the
  !! surface as continued through the body acts on the solid part of the faces, as the pressure
  !! does. With an angle of 90 degrees that is the pull along the line of contact.
  subroutine force_from_tension(grid, solid, bodies, flux, self, work, force)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    type(rigid_flux_t), intent(in) :: flux
    type(surface_tension_t), intent(in) :: self
    real(wp), allocatable, intent(inout) :: work(:, :)   !! (*, 6) grows when needed
    real(wp), intent(inout) :: force(:, :)   !! (6, bodies) about the centre of mass [N, N m]
    integer :: b, m, t, n

    if (.not. self%acts) return
    do b = 1, bodies%n
      n = solid%body_face(b + 1) - solid%body_face(b)
      if (size(work, 1) < n) then
        deallocate (work)
        allocate (work(2*n, 6))
      end if
      t = 0
      do m = solid%body_face(b), solid%body_face(b + 1) - 1
        if (.not. flux%mine(m)) cycle
        t = t + 1
        associate (f => solid%face(:, m))
          work(t, :) = flux%s(:, m)*grid%h(f(4))*self%force(f(1), f(2), f(3), f(4))
        end associate
      end do
      force(:, b) = force(:, b) + exact_sums(work(1:t, :))
    end do
  end subroutine force_from_tension

end module surface_tension_m
