!> The one list of touches: every contact model fills it, and the contact forces come from it.
module touches_m
  use kinds_m, only: wp
  use neighbours_m, only: reserve
  implicit none
  private
  public :: touch_t, reserve_touches, select_touching

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

    call reserve(n, touches%a)
    call reserve(n, touches%b)
    call reserve(n, touches%key)
    call reserve(n, touches%arm_a)
    call reserve(n, touches%arm_b)
    call reserve(n, touches%normal)
    call reserve(n, touches%depth)
    call reserve(n, touches%weight)
    call reserve(n, touches%length)
    call reserve(n, touches%weight_shift)
    call reserve(n, touches%weight_turn)
  end subroutine reserve_touches

  !> Those entries of a list in which the bodies touch.
  subroutine select_touching(all, touching)
    type(touch_t), intent(in) :: all
    type(touch_t), intent(inout) :: touching
    integer :: t, m

    call reserve_touches(all%n, touching)
    m = 0
    do t = 1, all%n
      if (all%depth(t) <= 0.0_wp) cycle
      m = m + 1
      touching%a(m) = all%a(t)
      touching%b(m) = all%b(t)
      touching%key(m) = all%key(t)
      touching%arm_a(:, m) = all%arm_a(:, t)
      touching%arm_b(:, m) = all%arm_b(:, t)
      touching%normal(:, m) = all%normal(:, t)
      touching%depth(m) = all%depth(t)
      touching%weight(m) = all%weight(t)
      touching%length(m) = all%length(t)
      touching%weight_shift(:, m) = all%weight_shift(:, t)
      touching%weight_turn(:, m) = all%weight_turn(:, t)
    end do
    touching%n = m
  end subroutine select_touching

end module touches_m
