!> Contact law from a coefficient of restitution and a contact time: springs that harden with depth,
!! and damping by which an impact at any speed returns the restitution asked for.
module law_restitution_m
  use kinds_m, only: wp
  use case_types_m, only: contact_input_t
  use contact_law_m, only: contact_law_t, stiffness_t
  implicit none
  private
  public :: law_restitution, restitution_of, impact_duration, damping_ratio_of
  public :: min_restitution

  !> Smaller values act as this: contact ends at zero force, so a block comes out of its support
  !! with some speed, and the less, the longer it takes.
  real(wp), parameter :: min_restitution = 1.0e-2_wp   !! [-]

  type, extends(contact_law_t) :: law_restitution_t
    real(wp) :: frequency = 0.0_wp         !! sqrt(k/m*) [1/s]
  contains
    procedure :: normal_constant
    procedure :: normal_stiffness
    procedure :: damping
  end type law_restitution_t

  !> Tangential over normal stiffness: a sphere then swings along and across with one frequency.
  real(wp), parameter :: tangential_share = 2.0_wp/7.0_wp

contains

  !> The law of a case.
  !!
  !! The stiffness is that with which an impact lasts the contact time, up to critical damping
  !! (e = exp(-2)). Beyond, the spring stays that of critical damping: a smaller restitution makes
  !! the dashpot stronger and the impact shorter, and blocks at rest give way no more.
  pure function law_restitution(input) result(law)
    type(contact_input_t), intent(in) :: input
    type(law_restitution_t) :: law
    real(wp), parameter :: critical = 1.0_wp   ! damping ratio [-]

    law%damping_ratio = damping_ratio_of(max(input%restitution, min_restitution))
    law%frequency = impact_duration(min(law%damping_ratio, critical))/input%contact_time
    law%tangential_share = tangential_share
  end function law_restitution

  !> Restitution of an impact on a linear spring and dashpot that never pulls.
  !!
  !! With m x'' + c x' + k x = 0, zeta = c/(2 sqrt(k m)) and time in units of sqrt(m/k) the force
  !! vanishes at t = 2 acos(zeta)/sqrt(1 - zeta^2), and there -x'/v = exp(-zeta t); beyond zeta = 1
  !! the same with acosh and sqrt(zeta^2 - 1).
  elemental function restitution_of(zeta) result(e)
    real(wp), intent(in) :: zeta   !! damping ratio, >= 0 [-]
    real(wp) :: e

    e = exp(-zeta*impact_duration(zeta))
  end function restitution_of

  !> Duration of that impact in units of sqrt(m/k): pi without damping, 2 at zeta = 1.
  elemental function impact_duration(zeta) result(t)
    real(wp), intent(in) :: zeta   !! damping ratio, >= 0 [-]
    real(wp) :: t
    real(wp), parameter :: small = 1.0e-8_wp   !! the series is exact to round-off below
    real(wp) :: s

    s = 1.0_wp - zeta**2
    if (s > small) then
      t = 2*acos(zeta)/sqrt(s)
    else if (s < -small) then
      t = 2*acosh(zeta)/sqrt(-s)
    else
      t = 2.0_wp + s/3.0_wp
    end if
  end function impact_duration

  !> Damping ratio that realises the restitution e, by bisection of `restitution_of`.
  elemental function damping_ratio_of(e) result(zeta)
    real(wp), intent(in) :: e   !! 0 < e <= 1 [-]
    real(wp) :: zeta
    integer, parameter :: halvings = 60
    real(wp) :: low, high
    integer :: i

    low = 0.0_wp
    high = 1.0_wp
    do while (restitution_of(high) > e)
      high = 2*high
    end do
    do i = 1, halvings
      zeta = 0.5_wp*(low + high)
      if (restitution_of(zeta) > e) then
        low = zeta
      else
        high = zeta
      end if
    end do
    if (e >= 1.0_wp) zeta = 0.0_wp
  end function damping_ratio_of

  !> Spring on which an impact takes the contact time; stiffer where it has to carry a load that
  !! would press it in by more than `rest_overlap`, but no stiffer than that of two blocks as heavy
  !! as the load.
  elemental function normal_constant(law, reduced_mass, load, gravity, rest_overlap) result(k)
    class(law_restitution_t), intent(in) :: law
    real(wp), intent(in) :: reduced_mass, load, gravity, rest_overlap
    real(wp) :: k

    k = max(reduced_mass*law%frequency**2, &
            min(0.5_wp*load*law%frequency**2, load*gravity/rest_overlap))
  end function normal_constant

  !> The spring is that of the energy
  !!
  !! $$ E = \frac{k}{2} s^2, \qquad s = d \Big( 1 + \frac{1}{5} (d/d_h)^4 \Big), \qquad
  !!    F = k s \frac{ds}{dd}: $$
  !!
  !! linear as long as the depth is below half of d_h, so that the contact time is that asked for,
  !! and so hard beyond that no block comes out of another one on the wrong side. With the damping
  !! eta ds/dd an impact is that of the linear spring in the variable s and the time t ds/dd: it
  !! returns the restitution asked for at every speed.
  elemental subroutine normal_stiffness(law, k, d, hard, elastic)
    class(law_restitution_t), intent(in) :: law
    real(wp), intent(in) :: k, d, hard
    type(stiffness_t), intent(out) :: elastic
    real(wp) :: h   ! how far into the range where it hardens: (d/d_h)^4 [-]

    associate (unused => law)
    end associate
    h = (max(0.0_wp, d)/hard)**4
    elastic%hardness = (1.0_wp + h)**2   ! the square of ds/dd
    elastic%steepness = 1.0_wp + 4*h*(1.0_wp + 0.2_wp*h)/(1.0_wp + h)**2
    if (.not. d > 0.0_wp) return
    elastic%force = k*d*(1.0_wp + 0.2_wp*h)*(1.0_wp + h)
    elastic%energy = 0.5_wp*k*(d*(1.0_wp + 0.2_wp*h))**2
  end subroutine normal_stiffness

  !> The share of a contact point in the damping of the pair, whose ratio is that of the impact.
  elemental subroutine damping(law, share, k, total, inverse, eta, decay)
    class(law_restitution_t), intent(in) :: law
    real(wp), intent(in) :: share, k, total, inverse
    real(wp), intent(out) :: eta, decay
    real(wp) :: omega2   ! of the pair along the normal

    omega2 = k*total*inverse
    eta = share*k*2*law%damping_ratio/sqrt(omega2)
    decay = law%damping_ratio*sqrt(omega2)
  end subroutine damping

end module law_restitution_m
