!> Where, when and how each block of a drop starts: from its group or table, and by chance.
!!
!! Every random number depends on (seed, index of the block within its drop, k) alone, so it is the
!! same on every machine, in any order, and whether or not other drops exist.
module drops_m
  use kinds_m, only: wp, pi
  use case_types_m, only: drop_input_t, body_input_t, place_t, is_given
  use vectors_m, only: quaternion_from_axis, quaternion_product, normalised
  use random_counter_m, only: uniform, random_rotation
  use tet_mesh_m, only: shape_t, is_called
  implicit none
  private
  public :: place_of_block, place_of_body, shape_of_place, count_of_shape

  integer, parameter :: k_shift = 101   !! k_shift .. k_shift+2: shift along x, y, z
  integer, parameter :: k_tilt = 111    !! angle; k_tilt+1, k_tilt+2: axis
  integer, parameter :: k_shape = 121   !! which of several shapes
  integer, parameter :: k_member = 131  !! stone of a family

contains

  !> Block number `index` of a drop as it is placed.
  function place_of_block(drop, index) result(place)
    type(drop_input_t), intent(in) :: drop
    integer, intent(in) :: index       !! 1 .. drop%count
    type(place_t) :: place
    real(wp) :: angle, axis(3), height, azimuth
    integer :: d

    if (allocated(drop%row)) then
      place = drop%row(index)
    else
      place%shape = shape_drawn(drop, index)
      place%x = drop%position
      if (is_given(drop%to(1)) .and. drop%count > 1) place%x = drop%position &
        + (drop%to - drop%position)*(real(index - 1, wp)/real(drop%count - 1, wp))
      place%q = normalised(drop%quaternion)
      place%v = drop%velocity
      place%time = drop%first_time + real(index - 1, wp)*drop%interval
    end if
    place%seed = drop%seed
    place%index = index
    place%planned = place%x(:2)
    do d = 1, 3
      if (is_given(place%x(d))) place%x(d) = place%x(d) + drop%spread(d) &
        *(2*uniform(drop%seed, index, k_shift + d - 1) - 1.0_wp)
    end do
    select case (drop%orientation)
    case ('random')
      place%q = random_rotation(drop%seed, index)
    case ('given')
      angle = uniform(drop%seed, index, k_tilt)*drop%tilt_deg*pi/180.0_wp
      ! An axis uniform over the sphere: the height is uniform and so is the azimuth.
      height = 2*uniform(drop%seed, index, k_tilt + 1) - 1.0_wp
      azimuth = 2*pi*uniform(drop%seed, index, k_tilt + 2)
      axis = [sqrt(1.0_wp - height**2)*[cos(azimuth), sin(azimuth)], height]
      place%q = quaternion_product(quaternion_from_axis(axis, angle), place%q)
    case default; error stop 'place_of_block: no such orientation'
    end select
  end function place_of_block

  !> The shape of a drop, or the one of several that is drawn for a block.
  pure function shape_drawn(drop, index) result(shape)
    type(drop_input_t), intent(in) :: drop
    integer, intent(in) :: index
    character(len(drop%shape)) :: shape
    real(wp) :: left
    integer :: i

    shape = drop%shape
    if (drop%shapes(1) == '') return
    left = uniform(drop%seed, index, k_shape)*sum(drop%weights, is_given(drop%weights))
    do i = 1, count(drop%shapes /= '')
      if (drop%weights(i) <= 0.0_wp) cycle
      shape = drop%shapes(i)
      left = left - drop%weights(i)
      if (left < 0.0_wp) return
    end do
  end function shape_drawn

  !> A body as it is placed.
  pure function place_of_body(body) result(place)
    type(body_input_t), intent(in) :: body
    type(place_t) :: place

    place%shape = body%shape
    place%name = body%name
    place%x = body%position
    place%q = normalised(body%quaternion)
    place%planned = body%position(:2)
    place%v = body%velocity
    place%time = body%release_time
    place%fixed = body%fixed
  end function place_of_body

  !> How many blocks of a drop have a shape or may draw it; those that are fixed only if asked for.
  pure function count_of_shape(drop, shape, with_fixed) result(n)
    type(drop_input_t), intent(in) :: drop
    type(shape_t), intent(in) :: shape
    logical, intent(in) :: with_fixed
    integer :: n
    integer :: k

    n = 0
    if (allocated(drop%row)) then
      n = count(is_called(shape, drop%row%shape) .and. (with_fixed .or. .not. drop%row%fixed))
    else if (drop%shapes(1) == '') then
      if (is_called(shape, drop%shape)) n = drop%count
    else
      n = count([(is_called(shape, shape_drawn(drop, k)), k=1, drop%count)])
    end if
  end function count_of_shape

  !> Number of the shape of a block, or of the stone drawn for it where its shape is a family; 0 if
  !! there is none.
  pure function shape_of_place(place, shapes) result(s)
    type(place_t), intent(in) :: place
    type(shape_t), intent(in) :: shapes(:)
    integer :: s
    integer :: n

    n = count(is_called(shapes, trim(place%shape)))
    if (n > 1) n = 1 + int(n*uniform(place%seed, place%index, k_member))
    do s = 1, size(shapes)
      if (.not. is_called(shapes(s), trim(place%shape))) cycle
      n = n - 1
      if (n == 0) return
    end do
    s = 0
  end function shape_of_place

end module drops_m
