!> The one list of touches: every contact model fills it, and the contact forces come from it.
module touches_m
  use kinds_m, only: wp
  use growing_m, only: ensure_room
  implicit none
  private
  public :: touch_t, reserve_touches, set_apart

  !> Touches of one moment, sorted by a, then b, then key.
  !!
  !! Body a has a higher number than its partner b: another body, or a wall (-6..-1, see `walls_m`).
  type :: touch_t
    integer :: n = 0
    integer, allocatable :: a(:), b(:)     !! (n) body and partner
    integer, allocatable :: key(:)         !! (n) the touching sphere or point of a; of b: negative
    real(wp), allocatable :: arm_a(:, :)   !! (3, n) from the centre of a to the contact [m]
    real(wp), allocatable :: arm_b(:, :)   !! (3, n) from the (image of the) centre of b [m]
    real(wp), allocatable :: normal(:, :)  !! (3, n) unit vector from a to b [-]
    real(wp), allocatable :: depth(:)      !! (n) overlap d_n, > 0 where bodies touch [m]
    real(wp), allocatable :: weight(:)     !! (n) share of the stiffness of the law [-]
    real(wp), allocatable :: length(:)     !! (n) d_s of the contact Courant number, eq. (6) [m]
    !> (3, n) relative change of the weight with a shift of a, and with a turn about the contact.
    real(wp), allocatable :: weight_shift(:, :), weight_turn(:, :)   !! [1/m], [1/rad]
  end type touch_t

contains

  !> Make room for at least n touches.
  subroutine reserve_touches(n, touches)
    integer, intent(in) :: n
    type(touch_t), intent(inout) :: touches

    if (allocated(touches%a)) then
      if (n <= size(touches%a)) return
    end if
    call ensure_room(n, touches%a)
    call ensure_room(n, touches%b)
    call ensure_room(n, touches%key)
    call ensure_room(n, touches%arm_a)
    call ensure_room(n, touches%arm_b)
    call ensure_room(n, touches%normal)
    call ensure_room(n, touches%depth)
    call ensure_room(n, touches%weight)
    call ensure_room(n, touches%length)
    call ensure_room(n, touches%weight_shift)
    call ensure_room(n, touches%weight_turn)
  end subroutine reserve_touches

  !> Keep in a list the entries in which the bodies touch, and move the others to a list of their
  !! own; both stay sorted.
  subroutine set_apart(touches, soon)
    type(touch_t), intent(inout) :: touches, soon
    integer :: t, kept

    soon%n = 0
    kept = 0
    do t = 1, touches%n
      if (touches%depth(t) <= 0.0_wp) then
        soon%n = soon%n + 1
        call reserve_touches(soon%n, soon)
        call copy_entry(touches, t, soon, soon%n)
      else
        kept = kept + 1
        if (kept < t) call move_entry(t, kept, touches)
      end if
    end do
    touches%n = kept
  end subroutine set_apart

  !> Copy an entry from one list to another, where there is room.
  pure subroutine copy_entry(from, t, to, m)
    type(touch_t), intent(in) :: from
    integer, intent(in) :: t, m
    type(touch_t), intent(inout) :: to

    to%a(m) = from%a(t)
    to%b(m) = from%b(t)
    to%key(m) = from%key(t)
    to%arm_a(:, m) = from%arm_a(:, t)
    to%arm_b(:, m) = from%arm_b(:, t)
    to%normal(:, m) = from%normal(:, t)
    to%depth(m) = from%depth(t)
    to%weight(m) = from%weight(t)
    to%length(m) = from%length(t)
    to%weight_shift(:, m) = from%weight_shift(:, t)
    to%weight_turn(:, m) = from%weight_turn(:, t)
  end subroutine copy_entry

  !> Move an entry within a list.
  pure subroutine move_entry(t, m, touches)
    integer, intent(in) :: t, m
    type(touch_t), intent(inout) :: touches

    touches%a(m) = touches%a(t)
    touches%b(m) = touches%b(t)
    touches%key(m) = touches%key(t)
    touches%arm_a(:, m) = touches%arm_a(:, t)
    touches%arm_b(:, m) = touches%arm_b(:, t)
    touches%normal(:, m) = touches%normal(:, t)
    touches%depth(m) = touches%depth(t)
    touches%weight(m) = touches%weight(t)
    touches%length(m) = touches%length(t)
    touches%weight_shift(:, m) = touches%weight_shift(:, t)
    touches%weight_turn(:, m) = touches%weight_turn(:, t)
  end subroutine move_entry

end module touches_m
