!> How long a substep may be.
module test_substep_limits_m
  use check_m, only: check, wp
  use rigid_body_m, only: blocks_t
  use walls_m, only: walls_t
  use contact_detection_m, only: contact_detection_t
  use contact_response_m, only: impact_turn
  use substep_limits_m, only: substep_limit, stiffness_limit, equal_substep
  implicit none
  private
  public :: test_substep_limits

contains

  subroutine test_substep_limits()
    call check_equal_substeps()
    call check_limits()
  end subroutine test_substep_limits

  subroutine check_equal_substeps()
    call check('an equal substep', equal_substep(1.0_wp, 0.3_wp), 0.25_wp)
    call check('no shorter than has to be', equal_substep(1.0_wp, 0.25_wp), 0.25_wp)
    call check('nor for round-off', equal_substep(1.0_wp, 0.25_wp*(1.0_wp - 1.0e-12_wp)), 0.25_wp)
    call check('all that is left', equal_substep(0.2_wp, 1.0_wp), 0.2_wp)
  end subroutine check_equal_substeps

  !> A body above a floor, another far up: each of the limits in turn.
  subroutine check_limits()
    type(contact_detection_t) :: detected
    type(blocks_t) :: blocks
    type(walls_t) :: walls

    blocks%n = 2
    allocate (blocks%x(3, 2), blocks%v(3, 2), blocks%omega(3, 2), source=0.0_wp)
    allocate (blocks%present(2), source=.true.)
    allocate (blocks%still(2), source=.false.)
    allocate (blocks%ahead(2, 2), source=0.0_wp)
    blocks%x(3, :) = [0.1_wp, 5.0_wp]
    walls%n = 1
    walls%normal(3, 1) = -1.0_wp
    detected%bounding_radius = [0.1_wp, 0.1_wp]
    detected%smallest = 0.02_wp
    detected%unlisted_gap = 0.05_wp
    call check('at all', limit(), 0.01_wp)
    blocks%v(3, 2) = -100.0_wp
    call check('no jump into another', limit(), &
      0.05_wp/100.0_wp, 1.0e-18_wp)
    blocks%v(1, 1) = 1.0_wp
    blocks%omega(2, 1) = 30.0_wp
    blocks%v(3, 2) = 0.0_wp
    call check('Courant number', limit(), &
      0.1_wp*0.02_wp/(1.0_wp + 30.0_wp*0.1_wp), 1.0e-18_wp)
    detected%frequency2 = 1.0e6_wp
    call check('stiffness', stiffness_limit(detected), impact_turn/1.0e3_wp, 1.0e-18_wp)
    call check('is one of them', limit(), &
      impact_turn/1.0e3_wp, 1.0e-18_wp)
  contains
    real(wp) function limit()
      limit = substep_limit(walls, detected, blocks, longest=0.01_wp, courant_max=0.1_wp)
    end function limit
  end subroutine check_limits

end module test_substep_limits_m
