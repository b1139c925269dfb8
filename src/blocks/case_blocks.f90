!> The blocks of a case at its start: where each is, held, lowered or released.
module case_blocks_m
  use kinds_m, only: wp
  use case_types_m, only: case_t, place_t, handling_t, is_given
  use boundary_kinds_m, only: side_code, is_wall
  use vectors_m, only: rotation_matrix, inverse3, quaternion_from_axis, quaternion_product
  use bed_m, only: bed_t
  use bed_measure_m, only: bed_normal
  use tet_mesh_m, only: shape_t, extent_along
  use drops_m, only: place_of_block, place_of_body, shape_of_place
  use rigid_body_m, only: blocks_t, release_body, to_come
  implicit none
  private
  public :: height_at_level, attitude_on, blocks_init, turn_with_fluid, turning_share

  real(wp), parameter :: turning_share = 0.02_wp
    !! least density with which a body turns, over that of the liquid: that of a layer of 1/250 of
    !! its radius

contains

  !> The bodies of a case at their starting poses; those of `&body` due at t = 0 are released.
  subroutine blocks_init(case, shapes, blocks, bed)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)
    type(blocks_t), intent(out) :: blocks
    type(bed_t), intent(in), optional :: bed   !! on whose slope some lie
    integer :: b, i, k, n

    blocks%n = size(case%body)
    do i = 1, size(case%drop)
      blocks%n = blocks%n + case%drop(i)%count
    end do
    blocks%shapes = shapes
    ! Allocate all arrays over bodies, at rest and without forces.
    n = blocks%n
    allocate (blocks%inverse_inertia(3, 3, n), source=0.0_wp)
    allocate (blocks%shape(n), blocks%contacts(n), blocks%on_floor(n), source=0)
    allocate (blocks%fixed(n), blocks%present(n), blocks%asleep(n), blocks%still(n), &
      source=.false.)
    allocate (blocks%mass(n), blocks%added_mass(n), blocks%release_time(n), blocks%entry_time(n), &
      blocks%raised(n), blocks%goal(n), blocks%sling(n), blocks%speed(n), source=0.0_wp)
    allocate (blocks%exit_time(n), blocks%record%impact_speed(n), blocks%record%rest_since(n), &
      source=0.0_wp)
    allocate (blocks%record%hardest(n), blocks%record%peak(n), source=0.0_wp)
    allocate (blocks%record%approach(3, n), source=0.0_wp)
    allocate (blocks%name(n), blocks%handling(n))
    allocate (blocks%planned(2, n), source=0.0_wp)
    allocate (blocks%on_ground(n), source=.false.)
    allocate (blocks%status(n), source=to_come)
    allocate (blocks%x(3, n), blocks%q(4, n), blocks%v(3, n), blocks%l(3, n), blocks%omega(3, n), &
      blocks%lost(3, n), blocks%upright(3, n), source=0.0_wp)
    allocate (blocks%path(n), blocks%ahead(2, n))
    blocks%ahead = 0.0_wp
    allocate (blocks%given%v(3, n), blocks%given%omega(3, n), source=0.0_wp)
    allocate (blocks%v_start(3, n), blocks%l_start(3, n), source=0.0_wp)
    allocate (blocks%fluid_force(3, n), blocks%fluid_torque(3, n), source=0.0_wp)
    allocate (blocks%lagged_force(6, n), blocks%film_force(6, n), source=0.0_wp)
    allocate (blocks%contact_force(3, n), blocks%contact_torque(3, n), source=0.0_wp)
    do b = 1, size(case%body)
      call put_block(case, place_of_body(case%body(b)), b, blocks)
      blocks%given%omega(:, b) = case%body(b)%angular_velocity
      blocks%path(b) = case%body(b)%path
      if (blocks%release_time(b) <= 0.0_wp) call release_body(0.0_wp, b, blocks)
    end do
    b = size(case%body)
    do i = 1, size(case%drop)
      do k = 1, case%drop(i)%count
        b = b + 1
        blocks%handling(b) = case%drop(i)%handling
        call put_block(case, place_of_block(case%drop(i), k), b, blocks, bed)
      end do
    end do
    call begin_where_left(case, blocks)
  end subroutine blocks_init

  !> Block b where it is placed, before its release. One that is lowered to its place, or to what
  !! lies there, begins with its lowest point at the level of the water; one that is set on what
  !! lies there at once waits over the tank.
  subroutine put_block(case, place, b, blocks, bed)
    type(case_t), intent(in) :: case
    type(place_t), intent(in) :: place
    integer, intent(in) :: b
    type(blocks_t), intent(inout) :: blocks
    type(bed_t), intent(in), optional :: bed

    blocks%shape(b) = shape_of_place(place, blocks%shapes)
    blocks%name(b) = place%name
    blocks%fixed(b) = place%fixed
    blocks%release_time(b) = place%time
    blocks%entry_time(b) = place%time
    blocks%given%v(:, b) = place%v
    blocks%x(:, b) = place%x
    blocks%planned(:, b) = place%planned
    blocks%q(:, b) = place%q
    if (present(bed)) blocks%q(:, b) = attitude_on(bed, blocks%handling(b), place, &
      blocks%shapes(blocks%shape(b)))
    if (blocks%q(1, b) < 0.0_wp) blocks%q(:, b) = -blocks%q(:, b)
    associate (shape => blocks%shapes(blocks%shape(b)), handling => blocks%handling(b))
      blocks%mass(b) = shape%density*shape%volume
      blocks%inverse_inertia(:, :, b) = inverse3(shape%inertia)
      blocks%on_ground(b) = .not. is_given(place%x(3))
      blocks%goal(b) = -huge(1.0_wp)
      if (is_given(place%x(3)) .and. handling%release == 'place') blocks%goal(b) = place%x(3)
      if (handling%lowering_speed > 0.0_wp) blocks%given%v(:, b) = [0.0_wp, 0.0_wp, &
                                                                    -handling%lowering_speed]
      if (blocks%on_ground(b) .or. (handling%lowering_speed > 0.0_wp .and. &
        handling%release == 'place')) blocks%x(3, b) = max(blocks%goal(b), &
        height_at_level(case, shape, blocks%q(:, b), handling%lowering_speed > 0.0_wp))
    end associate
  end subroutine put_block

  !> Attitude of a block at its place: as given, or turned from that so that what is level lies on
  !! the slope of the bed below it.
  pure function attitude_on(bed, handling, place, shape) result(q)
    type(bed_t), intent(in) :: bed
    type(handling_t), intent(in) :: handling
    type(place_t), intent(in) :: place
    type(shape_t), intent(in) :: shape
    real(wp) :: q(4)
    real(wp) :: n(3)

    q = place%q
    if (handling%attitude == 'given' .or. .not. bed%there) return
    n = bed_normal(bed, place%x(:2), shape%radius)
    if (any(abs(n(:2)) > 0.0_wp)) q = quaternion_product(quaternion_from_axis( &
      [-n(2), n(1), 0.0_wp], atan2(hypot(n(1), n(2)), n(3))), q)
  end function attitude_on

  !> Height of the centre of a shape whose lowest point is at the level of the water, or at the top
  !! of the tank where there is none or none is asked for; below a lid it touches that at most [m].
  pure function height_at_level(case, shape, q, at_water) result(height)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shape
    real(wp), intent(in) :: q(4)
    logical, intent(in) :: at_water
    real(wp) :: height
    real(wp) :: turn(3, 3), top

    turn = rotation_matrix(q)
    top = case%grid%origin(3) + case%grid%length(3)
    height = top
    if (at_water .and. case%run%physics /= 'dry' .and. .not. case%fluid%single_phase &
        .and. is_given(case%fluid%water_level)) height = min(top, case%fluid%water_level)
    height = height + extent_along(shape, -turn(3, :))
    if (is_wall(side_code(case%boundary%kind(2, 3)))) height = min(height, &
      top - extent_along(shape, turn(3, :)))
  end function height_at_level

  !> Blocks that another run left somewhere begin there, as they moved then.
  subroutine begin_where_left(case, blocks)
    type(case_t), intent(in) :: case
    type(blocks_t), intent(inout) :: blocks
    integer :: i, b

    associate (begun => case%begun)
      do i = 1, begun%n
        b = begun%block(i)
        if (begun%drop(i) > 0) b = b + size(case%body) + sum(case%drop(:begun%drop(i) - 1)%count)
        if (blocks%name(b) == '') blocks%name(b) = begun%name(i)
        blocks%x(:, b) = begun%x(:, i)
        blocks%planned(:, b) = begun%x(:2, i)
        blocks%q(:, b) = begun%q(:, i)
        if (blocks%q(1, b) < 0.0_wp) blocks%q(:, b) = -blocks%q(:, b)
        blocks%given%v(:, b) = begun%v(:, i)
        blocks%given%omega(:, b) = begun%omega(:, i)
        blocks%handling(b) = handling_t()   ! no crane holds it
        blocks%on_ground(b) = .false.
        call release_body(0.0_wp, b, blocks)
      end do
    end associate
  end subroutine begin_where_left

  !> Blocks lighter than a fiftieth of the liquid turn with the inertia of such a block, before the
  !! first step: what has less than the boundary layer that it drags along would spin up and down
  !! within a step.
  pure subroutine turn_with_fluid(density, blocks)
    real(wp), intent(in) :: density   !! of the liquid [kg/m3]
    type(blocks_t), intent(inout) :: blocks
    real(wp) :: more
    integer :: s, b

    do s = 1, size(blocks%shapes)
      more = max(1.0_wp, turning_share*density/blocks%shapes(s)%density)
      blocks%shapes(s)%inertia = more*blocks%shapes(s)%inertia
    end do
    do b = 1, blocks%n
      more = max(1.0_wp, turning_share*density/blocks%shapes(blocks%shape(b))%density)
      blocks%inverse_inertia(:, :, b) = blocks%inverse_inertia(:, :, b)/more
      if (blocks%present(b)) call release_body(blocks%release_time(b), b, blocks)
    end do
  end subroutine turn_with_fluid

end module case_blocks_m
