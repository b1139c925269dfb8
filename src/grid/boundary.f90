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

  integer, parameter :: depth(n_halo) = [1, 2, 3]   !! of the layers outside a side and inside it

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
    integer :: d, s, l, n_filled, last(n_halo)

    n_filled = n_halo
    if (present(layers)) n_filled = layers
    do d = 1, 3
      call halo_exchange(a, n_halo, d, layers)
      if (grid%periodic(d)) cycle
      !$omp parallel do private(s, last) schedule(static)
      do l = 1, size(a, shared_by(d))
        do s = 1, 2
          if (.not. grid%at_side(s, d)) cycle
          last = inner_layer(grid, s, d, 1)
          call fill_layers(d, l, ghost_layer(grid, s, d, depth), last(:n_filled), 1.0_wp, 0.0_wp, a)
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
    integer :: d, s, c, l, n_filled, from(n_halo)
    real(wp) :: factor, shift

    n_filled = n_halo
    if (present(layers)) n_filled = layers
    do d = 1, 3
      call halo_exchange(u, n_halo, d, layers)
      if (grid%periodic(d)) cycle
      !$omp parallel do private(s, c, factor, shift, from) schedule(static)
      do l = 1, size(u, shared_by(d))
        do c = 1, 3
          do s = 1, 2
            ! Halo of component c of the velocity in plane l outside side s of direction d, so many
            ! layers.
            if (grid%at_side(s, d)) then
              factor = 1.0_wp
              shift = 0.0_wp
              if (grid%side(s, d) == side_no_slip .or. (is_wall(grid%side(s, d)) .and. c == d)) then
                factor = -1.0_wp
                shift = 2.0_wp*grid%side_velocity(c, s, d)
              else if (grid%side(s, d) == side_inflow) then
                factor = 0.0_wp
                shift = grid%side_velocity(c, s, d)
              end if
              from = inner_layer(grid, s, d, merge(depth, 1, is_wall(grid%side(s, d))))
              call fill_layers(d, l, ghost_layer(grid, s, d, depth), from(:n_filled), factor, &
                               shift, u(:, :, :, c))
            end if
          end do
        end do
      end do
    end do
  end subroutine fill_velocity_halo

  !> Direction whose planes the threads share while they fill the halo of direction d.
  pure integer function shared_by(d)
    integer, intent(in) :: d

    shared_by = merge(2, 3, d == 3)
  end function shared_by

  !> Layers outside a side of direction d in plane l: a(to) = factor*a(from) + shift.
  pure subroutine fill_layers(d, l, to, from, factor, shift, a)
    integer, intent(in) :: d
    integer, intent(in) :: l
      !! place of the plane in the local array with its halo, in direction `shared_by(d)`
    integer, intent(in) :: to(n_halo), from(:)   !! outside; inside, of those that are filled
    real(wp), intent(in) :: factor, shift
    real(wp), intent(inout), contiguous :: a(:, :, :)
    integer :: j, m

    select case (d)
    case (1)
      do j = 1, size(a, 2)
        do m = 1, size(from)
          a(to(m), j, l) = factor*a(from(m), j, l) + shift
        end do
      end do
    case (2)
      do m = 1, size(from)
        a(:, to(m), l) = factor*a(:, from(m), l) + shift
      end do
    case default
      do m = 1, size(from)
        a(:, l, to(m)) = factor*a(:, l, from(m)) + shift
      end do
    end select
  end subroutine fill_layers

  !> Position of halo layer m outside side s, counted in the local array with its halo (first = 1).
  elemental function ghost_layer(grid, s, d, m) result(layer)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: s, d, m
    integer :: layer

    layer = merge(n_halo + 1 - m, n_halo + grid%hi(d) - grid%lo(d) + 1 + m, s == 1)
  end function ghost_layer

  !> Position of the m-th layer of cells inside side s; a thin domain repeats its last layer.
  elemental function inner_layer(grid, s, d, m) result(layer)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: s, d, m
    integer :: layer, cells, inner

    cells = grid%hi(d) - grid%lo(d) + 1
    inner = min(m, cells)
    layer = merge(n_halo + inner, n_halo + cells + 1 - inner, s == 1)
  end function inner_layer

end module boundary_m
