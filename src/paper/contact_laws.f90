!> The contact laws by their names (a new one is a file and a line here), and what their contact
!! points bear at rest.
module contact_laws_m
  use kinds_m, only: wp
  use case_types_m, only: contact_input_t
  use mass_properties_m, only: surface_area
  use tet_mesh_m, only: shape_t
  use contact_law_m, only: contact_law_t, stiffness_t
  use law_restitution_m, only: law_restitution
  use law_constants_m, only: law_constants
  implicit none
  private
  public :: choose_law, hard_depth, depth_at_rest, rest_overlap_share

  real(wp), parameter :: rest_overlap_share = 0.01_wp
    !! overlap at rest over the size of a block, at most

contains

  !> The law of a case.
  subroutine choose_law(input, law)
    type(contact_input_t), intent(in) :: input
    class(contact_law_t), allocatable, intent(out) :: law

    select case (input%law)
    case ('restitution'); allocate (law, source=law_restitution(input))
    case ('constants'); allocate (law, source=law_constants(input))
    case default; error stop 'choose_law: no such law'
    end select
    law%friction = [input%friction, input%wall_friction, input%bed_friction]
  end subroutine choose_law

  !> Depth at which contact points of a block harden: a quarter of its mean thickness, twice the
  !! volume over the surface [m].
  pure function hard_depth(shape) result(hard)
    type(shape_t), intent(in) :: shape
    real(wp) :: hard

    hard = 0.5_wp*shape%volume/surface_area(shape%point, shape%triangle)
  end function hard_depth

  !> Depth at which the spring of a contact point holds a force, by bisection [m].
  pure function depth_at_rest(law, k, hard, force) result(depth)
    class(contact_law_t), intent(in) :: law
    real(wp), intent(in) :: k       !! of the law, `normal_constant` [N/m^gamma]
    real(wp), intent(in) :: hard    !! depth d_h where contacts harden, > 0 [m]
    real(wp), intent(in) :: force   !! >= 0 [N]
    real(wp) :: depth
    integer, parameter :: halvings = 60
    type(stiffness_t) :: elastic
    real(wp) :: low, high
    integer :: i

    depth = 0.0_wp
    if (.not. force > 0.0_wp) return
    low = 0.0_wp
    high = hard
    do   ! ends: the force grows at least as the depth does
      call law%normal_stiffness(k, high, hard, elastic)
      if (elastic%force >= force) exit
      high = 2*high
    end do
    do i = 1, halvings
      depth = 0.5_wp*(low + high)
      call law%normal_stiffness(k, depth, hard, elastic)
      if (elastic%force < force) then
        low = depth
      else
        high = depth
      end if
    end do
  end function depth_at_rest

end module contact_laws_m
