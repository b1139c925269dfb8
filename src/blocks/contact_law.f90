!> Forces of one touch: normal and tangential, from constants or from a coefficient of restitution.
!!
!! Source: Yoshikawa et al. (2008), eqs. (1) and (2). The paper gives no constants; the law
!! 'restitution' finds them from what can be measured.
module contact_law_m
  use kinds_m, only: wp
  use case_types_m, only: contact_input_t
  implicit none
  private
  public :: contact_law_t, contact_law_init
  public :: restitution_of, impact_duration, damping_ratio_of
  public :: normal_constant, tangential_constant, steepness, hardness, elastic_force
  public :: energy_of_force, stored_energy, normal_force, tangential_force, tangential_slip

  type :: contact_law_t
    logical :: constants = .false.         !! constants are given, not found from the restitution
    real(wp) :: damping_ratio = 0.0_wp     !! zeta of the impact [-]
    real(wp) :: frequency = 0.0_wp         !! sqrt(k/m*) of the impact [1/s]
    !> Given constants [N/m^gamma, -, N s/m].
    real(wp) :: k_n = 0.0_wp, gamma_n = 1.0_wp, eta_n = 0.0_wp
    real(wp) :: k_t = 0.0_wp, gamma_t = 1.0_wp, eta_t = 0.0_wp
    real(wp) :: friction = 0.0_wp          !! Coulomb, body on body [-]
    real(wp) :: wall_friction = 0.0_wp     !! Coulomb, body on wall [-]
  end type contact_law_t

  !> Tangential over normal stiffness: a sphere then swings along and across with one frequency.
  real(wp), parameter :: tangential_share = 2.0_wp/7.0_wp

contains

  !> The law of a case.
  pure subroutine contact_law_init(input, law)
    type(contact_input_t), intent(in) :: input
    type(contact_law_t), intent(out) :: law

    law%friction = input%friction
    law%wall_friction = input%wall_friction
    law%constants = input%law == 'constants'
    if (law%constants) then
      law%k_n = input%k_n
      law%gamma_n = input%gamma_n
      law%eta_n = input%eta_n
      law%k_t = input%k_t
      law%gamma_t = input%gamma_t
      law%eta_t = input%eta_t
    else
      law%damping_ratio = damping_ratio_of(input%restitution)
      law%frequency = impact_duration(law%damping_ratio)/input%contact_time
    end if
  end subroutine contact_law_init

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

  !> Constant k_n of a touch of weight one: the same whatever else touches, so that the elastic
  !! energy is a function of position only.
  elemental function normal_constant(law, reduced_mass) result(k)
    type(contact_law_t), intent(in) :: law
    real(wp), intent(in) :: reduced_mass   !! of the two bodies, 1/(1/M_a + 1/M_b) [kg]
    real(wp) :: k                          !! [N/m^gamma_n]

    if (law%constants) then
      k = law%k_n
    else
      k = reduced_mass*law%frequency**2
    end if
  end function normal_constant

  !> Constant k_t of a touch whose normal constant is k_n.
  elemental function tangential_constant(law, k_n, weight) result(k)
    type(contact_law_t), intent(in) :: law
    real(wp), intent(in) :: k_n      !! of the touch [N/m^gamma_n]
    real(wp), intent(in) :: weight   !! of the touch [-]
    real(wp) :: k                    !! [N/m^gamma_t]

    k = tangential_share*k_n
    if (law%constants) k = weight*law%k_t
  end function tangential_constant

  !> Elastic force and energy of a touch.
  !!
  !! Where constants are given, F = w k d^gamma of eq. (1) for the weight w. Else the spring is that
  !! of the energy
  !!
  !! $$ E = \frac{k}{2} s^2, \qquad s = u \Big( 1 + \frac{1}{5} (u/d_h)^4 \Big), \qquad
  !!    u = d \sqrt{w}, \qquad F = k s \frac{ds}{dd}: $$
  !!
  !! linear as long as the depth is below half of d_h, so that the contact time is that asked for,
  !! and so hard beyond that no block comes out of another one on the wrong side. With the damping
  !! eta ds/dd an impact is that of the linear spring in the variable s and the time t ds/dd: it
  !! returns the restitution asked for at every speed.
  elemental subroutine elastic_force(law, k, weight, d, hard, force, energy)
    type(contact_law_t), intent(in) :: law
    real(wp), intent(in) :: k               !! where the spring begins, at weight one [N/m^gamma]
    real(wp), intent(in) :: weight          !! of the touch [-]
    real(wp), intent(in) :: d, hard         !! overlap, depth d_h [m]
    real(wp), intent(out) :: force, energy  !! [N], [J]
    real(wp) :: h

    force = 0.0_wp
    energy = 0.0_wp
    if (.not. d > 0.0_wp) return
    if (law%constants) then
      force = weight*k*power(d, law%gamma_n)
      energy = energy_of_force(force, law%gamma_n, d)
    else
      h = beyond(weight, d, hard)
      force = weight*k*d*(1.0_wp + 0.2_wp*h)*(1.0_wp + h)
      energy = 0.5_wp*weight*k*(d*(1.0_wp + 0.2_wp*h))**2
    end if
  end subroutine elastic_force

  !> How far a touch is into the range where it hardens: (u/d_h)^4 [-].
  elemental function beyond(weight, d, hard) result(h)
    real(wp), intent(in) :: weight    !! [-]
    real(wp), intent(in) :: d, hard   !! overlap, depth d_h [m]
    real(wp) :: h

    h = (weight*(max(0.0_wp, d)/hard)**2)**2
  end function beyond

  !> Stiffness over that where the touch begins of the linear spring of the same force and energy:
  !! the square of ds/du [-].
  elemental function hardness(law, weight, d, hard) result(ratio)
    type(contact_law_t), intent(in) :: law
    real(wp), intent(in) :: weight    !! [-]
    real(wp), intent(in) :: d, hard   !! overlap, depth d_h [m]
    real(wp) :: ratio

    ratio = 1.0_wp
    if (.not. law%constants) ratio = (1.0_wp + beyond(weight, d, hard))**2
  end function hardness

  !> Stiffness dF/dd of a touch over w k `hardness`; not touching yet: as where it begins
  !! [m^(gamma-1)].
  elemental function steepness(law, weight, d, hard) result(ratio)
    type(contact_law_t), intent(in) :: law
    real(wp), intent(in) :: weight    !! [-]
    real(wp), intent(in) :: d, hard   !! overlap, depth d_h [m]
    real(wp) :: ratio
    real(wp) :: h

    ratio = 1.0_wp
    if (.not. law%constants) then
      h = beyond(weight, d, hard)
      ratio = 1.0_wp + 4*h*(1.0_wp + 0.2_wp*h)/(1.0_wp + h)**2
    else if (abs(law%gamma_n - 1.0_wp) > 0.0_wp) then
      ratio = law%gamma_n*max(0.0_wp, d)**(law%gamma_n - 1.0_wp)
    end if
  end function steepness

  !> Energy stored in a spring k d^gamma that pushes with a force: force d/(gamma + 1) [J].
  elemental function energy_of_force(force, gamma, d) result(energy)
    real(wp), intent(in) :: force, gamma, d   !! [N, -, m]
    real(wp) :: energy

    energy = force*d/(gamma + 1.0_wp)
  end function energy_of_force

  !> Energy stored in a spring k d^gamma [J].
  elemental function stored_energy(k, gamma, d) result(energy)
    real(wp), intent(in) :: k, gamma, d   !! [N/m^gamma, -, m]
    real(wp) :: energy

    energy = k*d*power(d, gamma)/(gamma + 1.0_wp)
  end function stored_energy

  !> Size of the normal force between two bodies, eq. (1), never pulling [N].
  !!
  !! $$ F_n = k_n d_n^{\gamma_n} - \eta_n (v_r \cdot n) $$
  !!
  !! The paper leaves the sense of v_r open; here it is partner minus self, so that v_r.n < 0 while
  !! closing and the damping dissipates.
  elemental function normal_force(elastic, eta, v_n) result(f)
    real(wp), intent(in) :: elastic   !! k_n d_n^gamma_n, see `elastic_force` [N]
    real(wp), intent(in) :: eta       !! [N s/m]
    real(wp), intent(in) :: v_n       !! v_r.n: > 0 while opening [m/s]
    real(wp) :: f

    f = max(0.0_wp, elastic - eta*v_n)
  end function normal_force

  !> Tangential force on a body before slip, eq. (2) [N].
  !!
  !! $$ F_t = k_t |\xi|^{\gamma_t - 1} \xi + \eta_t v_t $$
  pure function tangential_force(k, gamma, eta, xi, v_t) result(f)
    real(wp), intent(in) :: k, gamma, eta   !! [N/m^gamma, -, N s/m]
    real(wp), intent(in) :: xi(3)           !! way of the partner past the body since they touch [m]
    real(wp), intent(in) :: v_t(3)          !! tangential part of v_r [m/s]
    real(wp) :: f(3)

    f = eta*v_t
    if (abs(gamma - 1.0_wp) > 0.0_wp) then
      if (any(abs(xi) > 0.0_wp)) f = f + k*norm2(xi)**(gamma - 1.0_wp)*xi
    else
      f = f + k*xi
    end if
  end function tangential_force

  !> Spring way at which the tangential force would be f: the way kept in memory while slipping [m].
  pure function tangential_slip(k, gamma, eta, f, v_t) result(xi)
    real(wp), intent(in) :: k, gamma, eta   !! [N/m^gamma, -, N s/m]
    real(wp), intent(in) :: f(3)            !! [N]
    real(wp), intent(in) :: v_t(3)          !! [m/s]
    real(wp) :: xi(3)
    real(wp) :: spring(3), length

    xi = 0.0_wp
    if (k <= 0.0_wp) return
    spring = (f - eta*v_t)/k
    length = norm2(spring)
    if (length > 0.0_wp) xi = spring*length**(1.0_wp/gamma - 1.0_wp)
  end function tangential_slip

  !> d^gamma, quick for the linear spring.
  elemental function power(d, gamma) result(p)
    real(wp), intent(in) :: d, gamma   !! [m, -]
    real(wp) :: p

    p = d
    if (abs(gamma - 1.0_wp) > 0.0_wp) p = d**gamma
  end function power

end module contact_law_m
