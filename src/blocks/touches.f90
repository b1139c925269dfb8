!> The one list of touches: every contact model fills it, and the contact forces come from it.
module touches_m
  use kinds_m, only: wp
  implicit none
  private
  public :: touch_t, touches_t, ensure_touches, add_touch, set_apart

  !> A touch of body a and its partner b, which has a lower number: another body, a wall (-6..-1,
  !! see `walls_m`) or the bed.
  type :: touch_t
    integer :: a = 0, b = 0                  !! body and partner
    integer :: key = 0                       !! the touching sphere or point of a; of b: negative
    real(wp) :: arm_a(3) = 0.0_wp            !! from the centre of a to the contact [m]
    real(wp) :: arm_b(3) = 0.0_wp            !! from the (image of the) centre of b [m]
    real(wp) :: normal(3) = 0.0_wp           !! unit vector from a to b [-]
    real(wp) :: depth = 0.0_wp               !! overlap d_n, > 0 where bodies touch [m]
    real(wp) :: weight = 1.0_wp              !! share of the stiffness of the law [-]
    real(wp) :: length = 0.0_wp              !! d_s of the contact Courant number, eq. (6) [m]
    !> Relative change of the weight with a shift of a, and with a turn about the contact.
    real(wp) :: weight_shift(3) = 0.0_wp, weight_turn(3) = 0.0_wp   !! [1/m], [1/rad]
    integer :: other = 0                     !! edge of b that crosses that of the key
  end type touch_t

  !> Touches of one moment, sorted by a, then b, then key.
  type :: touches_t
    integer :: n = 0
    type(touch_t), allocatable :: item(:)
  end type touches_t

contains

  !> Make room for at least n touches.
  pure subroutine ensure_touches(n, touches)
    integer, intent(in) :: n
    type(touches_t), intent(inout) :: touches
    integer, parameter :: first_capacity = 16
    type(touch_t), allocatable :: longer(:)

    if (.not. allocated(touches%item)) allocate (touches%item(max(n, first_capacity)))
    if (n <= size(touches%item)) return
    allocate (longer(max(n, 2*size(touches%item))))
    longer(:touches%n) = touches%item(:touches%n)
    call move_alloc(longer, touches%item)
  end subroutine ensure_touches

  !> Append a touch.
  pure subroutine add_touch(touch, touches)
    type(touch_t), intent(in) :: touch
    type(touches_t), intent(inout) :: touches

    call ensure_touches(touches%n + 1, touches)
    touches%n = touches%n + 1
    touches%item(touches%n) = touch
  end subroutine add_touch

  !> Keep in a list the entries in which the bodies touch, and move the others to a list of their
  !! own; both stay sorted.
  pure subroutine set_apart(touches, soon)
    type(touches_t), intent(inout) :: touches, soon
    integer :: t, kept

    soon%n = 0
    kept = 0
    do t = 1, touches%n
      if (touches%item(t)%depth <= 0.0_wp) then
        call add_touch(touches%item(t), soon)
      else
        kept = kept + 1
        if (kept < t) touches%item(kept) = touches%item(t)
      end if
    end do
    touches%n = kept
  end subroutine set_apart

end module touches_m
