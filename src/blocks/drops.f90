!> The random part of a drop: where and how each of its blocks starts.
!!
!! Every number depends on (seed, index of the block within its drop, k) alone, so it is the same on
!! every machine, in any order, and whether or not other drops exist.
module drops_m
  use kinds_m, only: wp, pi
  use case_types_m, only: drop_input_t
  use vectors_m, only: quaternion_from_axis, quaternion_product, normalised
  use random_counter_m, only: uniform, random_rotation
  use tet_mesh_m, only: shape_t, is_called
  implicit none
  private
  public :: draw_drop, draw_shape

  integer, parameter :: k_shift = 101   !! k_shift .. k_shift+2: shift along x, y, z
  integer, parameter :: k_tilt = 111    !! angle; k_tilt+1, k_tilt+2: axis
  integer, parameter :: k_member = 131  !! stone of a family

contains

  !> Starting pose of block number `index` of a drop.
  subroutine draw_drop(drop, index, x, q)
    type(drop_input_t), intent(in) :: drop
    integer, intent(in) :: index       !! 1 .. drop%count
    real(wp), intent(out) :: x(3)      !! centre of mass [m]
    real(wp), intent(out) :: q(4)      !! attitude
    real(wp) :: angle
    integer :: d

    do d = 1, 3
      x(d) = drop%position(d) + drop%spread(d)*(2*uniform(drop%seed, index, k_shift + d - 1) &
        - 1.0_wp)
    end do
    select case (drop%orientation)
    case ('random')
      q = random_rotation(drop%seed, index)
    case ('given')
      angle = uniform(drop%seed, index, k_tilt)*drop%tilt_deg*pi/180.0_wp
      q = quaternion_product(quaternion_from_axis(random_axis(drop%seed, index), angle), &
        normalised(drop%quaternion))
    case default; error stop 'draw_drop: no such orientation'
    end select
  end subroutine draw_drop

  !> Number of the shape of that name, or of a stone of that family drawn for block number `index`
  !! of a drop; 0 if there is none.
  pure function draw_shape(name, seed, index, shapes) result(s)
    character(*), intent(in) :: name
    integer, intent(in) :: seed, index
    type(shape_t), intent(in) :: shapes(:)
    integer :: s
    integer :: n

    n = count(is_called(shapes, name))
    if (n > 1) n = 1 + int(n*uniform(seed, index, k_member))
    do s = 1, size(shapes)
      if (.not. is_called(shapes(s), name)) cycle
      n = n - 1
      if (n == 0) return
    end do
    s = 0
  end function draw_shape

  !> A unit vector, uniform over the sphere: the height is uniform and so is the azimuth.
  pure function random_axis(seed, index) result(axis)
    integer, intent(in) :: seed, index
    real(wp) :: axis(3)
    real(wp) :: height, azimuth

    height = 2*uniform(seed, index, k_tilt + 1) - 1.0_wp
    azimuth = 2*pi*uniform(seed, index, k_tilt + 2)
    axis = [sqrt(1.0_wp - height**2)*[cos(azimuth), sin(azimuth)], height]
  end function random_axis

end module drops_m
