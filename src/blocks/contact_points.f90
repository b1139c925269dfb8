!> The one list of contact points: every contact model fills it, and the contact forces come from
!! it.
module contact_points_m
  use kinds_m, only: wp
  implicit none
  private
  public :: contact_point_t, contact_points_t, ensure_points, add_point

  !> A contact point of body a and its counterpart b, which has a lower number: another body, a wall
  !! (-6..-1, see `walls_m`) or the bed.
  type :: contact_point_t
    integer :: a = 0, b = 0                  !! body and counterpart
    integer :: id = 0                        !! the sphere or vertex of a in contact; of b: negative
    real(wp) :: arm_a(3) = 0.0_wp            !! from the centre of a to the contact [m]
    real(wp) :: arm_b(3) = 0.0_wp            !! from the (image of the) centre of b [m]
    real(wp) :: normal(3) = 0.0_wp           !! unit vector from a to b [-]
    real(wp) :: depth = 0.0_wp               !! overlap d_n, > 0 where bodies touch [m]
    real(wp) :: weight = 1.0_wp              !! share of the stiffness [-]
    real(wp) :: length = 0.0_wp              !! d_s of the contact Courant number, eq. (6) [m]
    integer :: other = 0                     !! edge or facet of b, for edges and balls
  end type contact_point_t

  !> Contact points of one moment, sorted by a, then b, then id.
  type :: contact_points_t
    integer :: n = 0
    type(contact_point_t), allocatable :: item(:)
  end type contact_points_t

contains

  !> Make room for at least n points.
  pure subroutine ensure_points(n, points)
    integer, intent(in) :: n
    type(contact_points_t), intent(inout) :: points
    integer, parameter :: first_capacity = 16
    type(contact_point_t), allocatable :: longer(:)

    if (.not. allocated(points%item)) allocate (points%item(max(n, first_capacity)))
    if (n <= size(points%item)) return
    allocate (longer(max(n, 2*size(points%item))))
    longer(:points%n) = points%item(:points%n)
    call move_alloc(longer, points%item)
  end subroutine ensure_points

  !> Append a contact point.
  pure subroutine add_point(point, points)
    type(contact_point_t), intent(in) :: point
    type(contact_points_t), intent(inout) :: points

    call ensure_points(points%n + 1, points)
    points%n = points%n + 1
    points%item(points%n) = point
  end subroutine add_point

end module contact_points_m
