!> Load of contact points at rest, and how far they give way.
module test_contact_load_m
  use kinds_m, only: wp
  use check_m, only: check
  use case_types_m, only: contact_input_t, case_t
  use tet_mesh_m, only: shape_t
  use shapes_builtin_m, only: make_shape
  use contact_law_m, only: contact_law_t, load_t, stiffness_t
  use contact_laws_m, only: choose_law
  use contact_load_m, only: load_of, hard_depth, depth_at_rest
  use rigid_body_m, only: blocks_t, blocks_init
  use walls_m, only: walls_t
  use counterparts_m, only: counterparts_t, counterparts_init, update_counterparts
  implicit none
  private
  public :: test_contact_load

  real(wp), parameter :: g = 9.81_wp, size(2) = [0.02_wp, 0.3_wp]
  type(shape_t) :: shapes(2)

contains

  subroutine test_contact_load()
    call make_cubes()
    call check_depth()
    call check_heaviest()
  end subroutine test_contact_load

  subroutine make_cubes()
    character(:), allocatable :: message
    type(case_t) :: case
    integer :: s

    allocate (case%shape(2))
    case%shape%name = [character(5) :: 'small', 'large']
    case%shape%kind = 'cube'
    do s = 1, 2
      case%shape(s)%size = size(s)
      call make_shape(case%shape(s), shapes(s), message)
    end do
    call check('a cube hardens at a twelfth of its edge', hard_depth(shapes(1)), size(1)/12, &
      1.0e-15_wp)
  end subroutine make_cubes

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
      call law%normal_stiffness(k, 1.0_wp, depth, hard, elastic)
      call check('the spring holds the force', elastic%force, force(i), 1.0e-9_wp*force(i))
    end do
    call check('as a linear spring where shallow', depth_at_rest(law, k, hard, 1.0_wp), 1.0e-4_wp, &
      1.0e-7_wp)
    input%law = 'constants'
    input%gamma_n = 1.5_wp
    call choose_law(input, law)
    call check('a power law', depth_at_rest(law, k, hard, 1.0e4_wp*4.0e-3_wp**1.5_wp), 4.0e-3_wp, &
      1.0e-12_wp)
  end subroutine check_depth

  !> What the counterparts of a case carry: the heaviest body that moves freely; and each may give
  !! way by a hundredth of its edge.
  subroutine check_heaviest()
    type(case_t) :: case
    type(blocks_t) :: blocks
    type(walls_t) :: walls
    type(counterparts_t) :: counterparts
    type(load_t) :: load
    integer :: b

    allocate (case%body(3), case%drop(0))
    do b = 1, 3
      case%body(b)%shape = merge('large', 'small', b == 2)
      case%body(b)%position = 0.5_wp*b
    end do
    call blocks_init(case, shapes, blocks)
    call counterparts_init(blocks, counterparts)
    call update_counterparts(walls, [0.0_wp, 0.0_wp, -g], blocks, counterparts)
    load = load_of(blocks%mass(2), g)
    call check('the heaviest', counterparts%load%mass, blocks%mass(2), 0.0_wp)
    call check('its weight', counterparts%load%weight, blocks%mass(2)*g, 1.0e-12_wp*load%weight)
    call check('may give way', counterparts%give(1:3), 0.01_wp*size([1, 2, 1]), 1.0e-15_wp)
    case%body(2)%fixed = .true.
    call blocks_init(case, shapes, blocks)
    call update_counterparts(walls, [0.0_wp, 0.0_wp, -g], blocks, counterparts)
    call check('nobody carries a held one', counterparts%load%mass, blocks%mass(1), 0.0_wp)
    case%body%fixed = .true.
    call blocks_init(case, shapes, blocks)
    call update_counterparts(walls, [0.0_wp, 0.0_wp, -g], blocks, counterparts)
    call check('all held: no load', counterparts%load%mass, 0.0_wp, 0.0_wp)
  end subroutine check_heaviest

end module test_contact_load_m
