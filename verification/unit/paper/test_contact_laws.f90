!> Load of contact points at rest, and how far they give way.
module test_contact_laws_m
  use check_m, only: check, wp
  use case_types_m, only: contact_input_t
  use contact_law_m, only: contact_law_t, stiffness_t
  use contact_laws_m, only: choose_law, hard_depth, depth_at_rest
  use counterparts_m, only: counterparts_t, counterparts_init, update_counterparts
  use contact_response_m, only: response_t, response_init
  use world_m, only: world_t, set_up
  implicit none
  private
  public :: test_contact_laws

  real(wp), parameter :: g = 9.81_wp, size(2) = [0.02_wp, 0.3_wp]

contains

  subroutine test_contact_laws()
    call check_depth()
    call check_heaviest()
  end subroutine test_contact_laws

  !> The depth at which the spring holds a force, shallow, hardened, and with a power law.
  subroutine check_depth()
    real(wp), parameter :: k = 1.0e4_wp, hard = 1.0e-3_wp, force(4) = [0.0_wp, 1.0_wp, 10.0_wp, &
      1.0e4_wp]
    type(contact_input_t) :: input
    class(contact_law_t), allocatable :: law
    type(stiffness_t) :: elastic
    real(wp) :: depth
    integer :: i

    call choose_law(input, law)
    do i = 1, 4
      depth = depth_at_rest(law, k, hard, force(i))
      call law%normal_stiffness(k, depth, hard, elastic)
      call check('the spring holds the force', elastic%force, force(i), 1.0e-9_wp*force(i))
    end do
    call check('linear where shallow', depth_at_rest(law, k, hard, 1.0_wp), 1.0e-4_wp, 1.0e-7_wp)
    input%law = 'constants'
    input%gamma_n = 1.5_wp
    call choose_law(input, law)
    call check('a power law', depth_at_rest(law, k, hard, 1.0e4_wp*4.0e-3_wp**1.5_wp), 4.0e-3_wp, &
      1.0e-12_wp)
  end subroutine check_depth

  !> Load: the heaviest body that moves freely; each may give way by a hundredth of its edge.
  subroutine check_heaviest()
    type(world_t) :: world
    type(counterparts_t) :: counterparts
    type(response_t) :: response

    call set_up('&run t_end=1 physics="dry"/ &grid cells=3*2 length=3*2/ &shape name="small" ' &
      //'kind="cube" size=.02/ &shape name="large" kind="cube" size=.3/ &body shape="small" ' &
      //'position=3*.5/ &body shape="large" position=3*1/ &body shape="small" position=3*1.5/', &
        world)
    call check('a twelfth of the edge', hard_depth(world%shapes(1)), size(1)/12, 1.0e-15_wp)
    call counterparts_init(3, counterparts)
    call update_counterparts(world%walls, [0.0_wp, 0.0_wp, -g], world%blocks, counterparts)
    call check('the heaviest', counterparts%heaviest, world%blocks%mass(2))
    call check('gravity', counterparts%gravity, g)
    call response_init(contact_input_t(), world%blocks, response)
    call check('may give way', response%rest_overlap(1:3), 0.01_wp*size([1, 2, 1]), 1.0e-15_wp)
    world%blocks%fixed(2) = .true.
    call update_counterparts(world%walls, [0.0_wp, 0.0_wp, -g], world%blocks, counterparts)
    call check('nobody carries a held one', counterparts%heaviest, world%blocks%mass(1))
    world%blocks%fixed = .true.
    call update_counterparts(world%walls, [0.0_wp, 0.0_wp, -g], world%blocks, counterparts)
    call check('all held: no load', counterparts%heaviest, 0.0_wp)
  end subroutine check_heaviest

end module test_contact_laws_m
