!> Curvature of the surface in the cells that it passes.
!!
!! Nine heights (`surface_heights_m`) give it to second order (Cummins, Francois, Kothe, Comput.
!! Struct. 83, 2005), along the main direction of the normal or the next one that has nine whole
!! columns. Where none has, the cell takes the mean of its neighbours that have heights, and where
!! there are none the divergence of the normals; both are counted.
module surface_curvature_m
  use kinds_m, only: wp, i8
  use vectors_m, only: norm
  use growing_m, only: ensure_capacity
  use grid_m, only: grid_t, n_halo, unit_step
  use solid_geometry_m, only: solid_geometry_t
  use plic_m, only: unit_normal
  use surface_heights_m, only: column_t, find_places, nine_heights, is_full, is_empty
  use parallel_m, only: halo_exchange, global_sum
  implicit none
  private
  public :: surface_curvature_t, find_curvature, no_surface

  !> What is known of the curvature of a cell.
  integer, parameter :: no_surface = 0, wanted = 1, from_heights = 2, from_others = 3

  type :: surface_curvature_t
    real(wp), allocatable :: curvature(:, :, :)  !! of the surface, positive around liquid [1/m]
    integer, allocatable :: state(:, :, :)       !! of the curvature, see above
    !> Place of the surface along each direction from the centre of a cell at it [cells].
    real(wp), allocatable :: place(:, :, :, :)
    integer :: fallback = 0                      !! cells of all processes without heights
  end type surface_curvature_t

contains

  !> Curvature of all cells at the surface, halo filled.
  subroutine find_curvature(grid, solid, c, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
      !! C^, halo filled [-]
    type(surface_curvature_t), intent(inout) :: self
    integer, allocatable :: cell(:, :)   ! (3, *) own cells without heights
    integer(i8) :: cells(1)
    integer :: i, j, k, n
    logical :: found

    call find_places(grid, c, self%place)
    ! Curvature of every own cell that holds or borders the surface, where its columns give one.
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
    ! List the own cells that have no curvature from heights.
    n = 0
    call ensure_capacity(1, cell)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          if (self%state(i, j, k) /= wanted) cycle
          n = n + 1
          call ensure_capacity(n, cell)
          cell(:, n) = [i, j, k]
        end do
      end do
    end do
    call curvature_from_others(grid, c, cell(:, :n), self)
    cells = int(n, i8)
    call global_sum(cells)
    self%fallback = int(cells(1))
  end subroutine find_curvature

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
      call nine_heights(grid, solid, c, place(:, :, :, d), &
                        column_t(at, d, nint(sign(1.0_wp, normal(d)))), height, found)
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
    normal = normal/max(norm(normal), tiny(1.0_wp))
  end function normal_at

  !> Mean of the neighbours that have heights, or the divergence of the normals.
  subroutine curvature_from_others(grid, c, cell, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    integer, intent(in) :: cell(:, :)   !! (3, *) that have none
    type(surface_curvature_t), intent(inout) :: self
    real(wp) :: value(size(cell, 2))    ! their curvature
    integer :: l, n, d
    real(wp) :: above(3), below(3)

    do l = 1, size(cell, 2)
      associate (a => cell(:, l) - 1, b => cell(:, l) + 1)
        n = count(self%state(a(1):b(1), a(2):b(2), a(3):b(3)) == from_heights)
        if (n > 0) then
          value(l) = sum(self%curvature(a(1):b(1), a(2):b(2), a(3):b(3)), &
            self%state(a(1):b(1), a(2):b(2), a(3):b(3)) == from_heights)/real(n, wp)
        else
          ! Divergence of the normals of the neighbours [1/m]: rough, but never more than that of a
          ! drop of one cell.
          value(l) = 0.0_wp
          do d = 1, 3
            above = normal_at(grid, c, cell(:, l) + unit_step(:, d))
            below = normal_at(grid, c, cell(:, l) - unit_step(:, d))
            value(l) = value(l) + (above(d) - below(d))/(2.0_wp*grid%h(d))
          end do
        end if
      end associate
    end do
    do l = 1, size(cell, 2)
      associate (at => cell(:, l))
        self%curvature(at(1), at(2), at(3)) = value(l)
        self%state(at(1), at(2), at(3)) = from_others
      end associate
    end do
    call halo_exchange(self%curvature, n_halo)
    call halo_exchange(self%state, n_halo)
  end subroutine curvature_from_others

end module surface_curvature_m
