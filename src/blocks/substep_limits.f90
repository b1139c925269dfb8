!> How long a substep of contact may be.
module substep_limits_m
  use kinds_m, only: wp
  use case_types_m, only: contact_input_t
  use vectors_m, only: distance, norm
  use rigid_body_m, only: blocks_t, haste
  use walls_m, only: walls_t
  use bed_m, only: bed_is_near, bed_place
  use neighbours_m, only: pair_list_t
  use contact_detection_m, only: contact_detection_t
  use contact_response_m, only: impact_turn, pile_turn
  implicit none
  private
  public :: longest_substep_of, substep_limit, stiffness_limit, equal_substep

contains

  !> Longest substep at all: a twentieth of the contact time [s].
  pure function longest_substep_of(input) result(longest)
    type(contact_input_t), intent(in) :: input
    real(wp) :: longest

    longest = input%contact_time/20.0_wp
  end function longest_substep_of

  !> Longest substep allowed now [s].
  !!
  !! The smallest of the longest at all, the limit of stiffness, and the Courant limit of eq. (6)
  !! with the highest relative speed of any two points of two bodies near one another or of a body
  !! near a wall. Bodies that are not near stay apart.
  pure function substep_limit(walls, detected, blocks, longest, courant_max) result(limit)
    type(walls_t), intent(in) :: walls
    type(contact_detection_t), intent(in) :: detected
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(in) :: longest       !! at all [s]
    real(wp), intent(in) :: courant_max   !! C_s of eq. (6) [-]
    real(wp) :: limit
    real(wp) :: speed, near, fastest(2)
    integer :: b

    limit = min(longest, stiffness_limit(detected))
    if (detected%exact) then
      near = fastest_near(blocks, detected, detected%surface%near)
    else
      near = fastest_near(blocks, detected, detected%spheres%near)
    end if
    fastest = 0.0_wp
    associate (radius => detected%bounding_radius)
      do b = 1, blocks%n
        if (.not. blocks%present(b) .or. blocks%still(b)) cycle
        speed = norm(blocks%v(:, b)) + norm(blocks%omega(:, b))*radius(b) &
          + haste(blocks, b, radius(b))
        if (.not. speed <= fastest(2)) fastest(2) = speed
        if (.not. fastest(2) <= fastest(1)) fastest = fastest([2, 1])
        if (.not. speed <= near) then
          if (near_wall(walls, blocks%x(:, b), radius(b) + detected%unlisted_gap)) near = speed
        end if
      end do
    end associate
    if (.not. near*limit <= courant_max*detected%smallest) then
      limit = courant_max*detected%smallest/near
    end if
    speed = sum(fastest)
    if (.not. speed*limit <= detected%unlisted_gap) limit = detected%unlisted_gap/speed
  end function substep_limit

  !> Highest relative speed of any two points of pairs of bodies that are near now [m/s]. The list
  !! holds more pairs, the more the longer it stands.
  pure function fastest_near(blocks, detected, near) result(fastest)
    type(blocks_t), intent(in) :: blocks
    type(contact_detection_t), intent(in) :: detected
    type(pair_list_t), intent(in) :: near
    real(wp) :: fastest
    real(wp) :: speed
    integer :: p

    fastest = 0.0_wp
    do p = 1, near%n
      associate (a => near%a(p), b => near%b(p), radius => detected%bounding_radius)
        if (blocks%still(a) .and. blocks%still(b)) cycle
        if (distance(blocks%x(:, a), blocks%x(:, b) + near%shift(:, p)) &
            > radius(a) + radius(b) + detected%unlisted_gap) cycle
        speed = distance(blocks%v(:, a), blocks%v(:, b)) + norm(blocks%omega(:, a))*radius(a) &
          + norm(blocks%omega(:, b))*radius(b) + haste(blocks, a, radius(a)) &
          + haste(blocks, b, radius(b))
      end associate
      if (.not. speed <= fastest) fastest = speed
    end do
  end function fastest_near

  !> Whether a wall or the bed is within a radius of a place.
  pure function near_wall(walls, x, radius) result(yes)
    type(walls_t), intent(in) :: walls
    real(wp), intent(in) :: x(3), radius   !! [m]
    logical :: yes
    real(wp) :: place(3)
    integer :: w

    yes = .true.
    do w = 1, walls%n
      if (dot_product(walls%normal(:, w), x) + radius > walls%offset(w)) return
    end do
    yes = walls%bed%there
    if (.not. yes) return
    place = bed_place(walls%bed, x)
    yes = bed_is_near(walls%bed, place - radius, place + radius)
  end function near_wall

  !> Longest substep the present contacts allow [s].
  !!
  !! For one pair of bodies a sixth of the bound of stability, which keeps the restitution within
  !! 0.01, or a third where they are slow; for all pairs together little more than half of it, also
  !! where bodies turn, and for the dashpots of several pairs.
  pure function stiffness_limit(detected) result(limit)
    type(contact_detection_t), intent(in) :: detected
    real(wp) :: limit
    real(wp), parameter :: damping_turn = 4.0_wp   ! the sums are twice too large, 2 is stable

    limit = huge(1.0_wp)
    if (detected%frequency2 > 0.0_wp) limit = impact_turn/sqrt(detected%frequency2)
    associate (frequency2 => detected%sum_frequency2, damping => detected%damping)
      if (frequency2 > 0.0_wp) limit = min(limit, pile_turn/sqrt(frequency2))
      if (damping > 0.0_wp) limit = min(limit, damping_turn/damping)
    end associate
  end function stiffness_limit

  !> An equal part of the time left, no longer than allowed [s].
  pure function equal_substep(left, longest) result(dt_b)
    real(wp), intent(in) :: left, longest   !! [s]
    real(wp) :: dt_b

    dt_b = left/real(max(1, ceiling(left/longest*(1.0_wp - 1.0e-9_wp))), wp)
  end function equal_substep

end module substep_limits_m
