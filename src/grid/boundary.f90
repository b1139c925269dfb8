!> Halo cells of every boundary kind, written once for a direction and a side.
!!
!! Each routine exchanges halos between processes (and wraps periodic directions) one direction at a
!! time and fills the halos outside the domain in the same pass, so edges and corners come out
!! right.
module boundary_m
  use kinds_m, only: wp
  use grid_m, only: grid_t, n_halo
  use boundary_kinds_m, only: is_wall, gives_velocity, side_no_slip, side_inflow
  use parallel_m, only: halo_exchange
  implicit none
  private
  public :: fill_scalar_halo, fill_velocity_halo, set_side_velocity

contains

  !> Normal velocity at the sides where it is given: none through walls, that of an inflow.
  pure subroutine set_side_velocity(grid, uf)
    type(grid_t), intent(in) :: grid
    real(wp), intent(inout), contiguous :: uf(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! lower faces [m/s]
    integer :: d, s, a(3), b(3)

    do d = 1, 3
      do s = 1, 2
        if (.not. gives_velocity(grid%side(s, d))) cycle
        call grid%side_faces(s, d, a, b)
        uf(a(1):b(1), a(2):b(2), a(3):b(3), d) = grid%side_velocity(d, s, d)
      end do
    end do
  end subroutine set_side_velocity

  !> Halo of a cell value with zero normal gradient at every side of the domain.
  subroutine fill_scalar_halo(grid, a, layers)
    type(grid_t), intent(in) :: grid
    real(wp), intent(inout), contiguous :: a(grid%first(1):, grid%first(2):, grid%first(3):)
    integer, intent(in), optional :: layers   !! that are read; all by default
    integer :: d, s, m, n_filled

    n_filled = n_halo
    if (present(layers)) n_filled = layers
    do d = 1, 3
      call halo_exchange(a, n_halo, d, layers)
      do s = 1, 2
        if (.not. grid%at_side(s, d) .or. grid%periodic(d)) cycle
        do m = 1, n_filled
          call mirror_plane(a, d, ghost_layer(grid, s, d, m), mirror_layer(grid, s, d, 1), &
                            1.0_wp, 0.0_wp)
        end do
      end do
    end do
  end subroutine fill_scalar_halo

  !> Halo of the cell velocity: walls mirror it (no-slip: odd about the wall velocity; slip: odd in
  !! the normal component only), an inflow has its own velocity outside, open sides and outflows
  !! carry the value of the last cell outward.
  subroutine fill_velocity_halo(grid, u, layers)
    type(grid_t), intent(in) :: grid
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s]
    integer, intent(in), optional :: layers   !! that are read; all by default
    integer :: d, s, c, n_filled

    n_filled = n_halo
    if (present(layers)) n_filled = layers
    do d = 1, 3
      call halo_exchange(u, n_halo, d, layers)
      if (grid%periodic(d)) cycle
      !$omp parallel do collapse(2) schedule(static)
      do c = 1, 3
        do s = 1, 2
          if (grid%at_side(s, d)) call fill_component(grid, s, d, c, n_filled, u(:, :, :, c))
        end do
      end do
    end do
  end subroutine fill_velocity_halo

  !> Halo of component c of the velocity outside side s of direction d, so many layers.
  pure subroutine fill_component(grid, s, d, c, layers, u)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: s, d, c, layers
    real(wp), intent(inout), contiguous :: u(:, :, :)
    real(wp) :: factor, shift
    integer :: m

    factor = 1.0_wp
    shift = 0.0_wp
    if (grid%side(s, d) == side_no_slip .or. (is_wall(grid%side(s, d)) .and. c == d)) then
      factor = -1.0_wp
      shift = 2.0_wp*grid%side_velocity(c, s, d)
    else if (grid%side(s, d) == side_inflow) then
      factor = 0.0_wp
      shift = grid%side_velocity(c, s, d)
    end if
    do m = 1, layers
      call mirror_plane(u, d, ghost_layer(grid, s, d, m), &
                        mirror_layer(grid, s, d, merge(m, 1, is_wall(grid%side(s, d)))), &
                        factor, shift)
    end do
  end subroutine fill_component

  !> Position of halo layer m outside side s, counted in the local array with its halo (first = 1).
  pure function ghost_layer(grid, s, d, m) result(layer)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: s, d, m
    integer :: layer

    layer = merge(n_halo + 1 - m, n_halo + grid%hi(d) - grid%lo(d) + 1 + m, s == 1)
  end function ghost_layer

  !> Position of the m-th layer of cells inside side s; a thin domain repeats its last layer.
  pure function mirror_layer(grid, s, d, m) result(layer)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: s, d, m
    integer :: layer, cells, inner

    cells = grid%hi(d) - grid%lo(d) + 1
    inner = min(m, cells)
    layer = merge(n_halo + inner, n_halo + cells + 1 - inner, s == 1)
  end function mirror_layer

  !> One layer normal to d from another: a(to) = factor*a(from) + shift.
  pure subroutine mirror_plane(a, d, to, from, factor, shift)
    real(wp), intent(inout), contiguous :: a(:, :, :)
    integer, intent(in) :: d, to, from
    real(wp), intent(in) :: factor, shift

    select case (d)
    case (1)
      a(to, :, :) = factor*a(from, :, :) + shift
    case (2)
      a(:, to, :) = factor*a(:, from, :) + shift
    case default
      a(:, :, to) = factor*a(:, :, from) + shift
    end select
  end subroutine mirror_plane

end module boundary_m
