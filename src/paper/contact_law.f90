!> What a contact law provides for a contact point, and what all laws have in common.
!!
!! Source: Yoshikawa et al. (2008), eqs. (1) and (2). The paper gives no constants; the law
!! 'restitution' (`law_restitution_m`) finds them from what can be measured, 'constants'
!! (`law_constants_m`) takes those given. `contact_laws_m` knows them by their names.
module contact_law_m
  use kinds_m, only: wp
  use vectors_m, only: norm
  implicit none
  private
  public :: contact_law_t, stiffness_t
  public :: stored_energy, normal_force, tangential_force, tangential_slip, power

  !> A contact law. Forces are those of springs k d^gamma, along the normal (n) and across (t).
  type, abstract :: contact_law_t
    real(wp) :: gamma_n = 1.0_wp, gamma_t = 1.0_wp   !! powers of the springs [-]
    real(wp) :: damping_ratio = 0.0_wp
      !! zeta of a pair on all its contact points; 0: each by itself
    real(wp) :: friction(3) = 0.0_wp       !! Coulomb: body on body, wall, bed [-]
    real(wp) :: tangential_share = 0.0_wp
      !! tangential over normal stiffness and damping; 0: those that follow [-]
    real(wp) :: k_t = 0.0_wp, eta_t = 0.0_wp   !! [N/m^gamma_t], [N s/m]
  contains
    procedure(normal_constant_i), deferred :: normal_constant
    procedure(normal_stiffness_i), deferred :: normal_stiffness
    procedure(damping_i), deferred :: damping
    procedure, non_overridable :: tangential_constant
    procedure, non_overridable :: tangential_damping
  end type contact_law_t

  !> The elastic part of a contact point at work.
  type :: stiffness_t
    real(wp) :: force = 0.0_wp             !! elastic, 0 where nothing touches yet [N]
    real(wp) :: energy = 0.0_wp            !! elastic [J]
    !> Stiffness over that where the contact point begins of the linear spring of the same force and
    !! energy.
    real(wp) :: hardness = 1.0_wp          !! [-]
    !> dF/dd over k `hardness`; where nothing touches yet, as where it begins.
    real(wp) :: steepness = 1.0_wp         !! [m^(gamma-1)]
  end type stiffness_t

  abstract interface
    !> Constant k_n of a contact point: the same whatever else touches, so that the elastic energy
    !! is a function of position only.
    elemental function normal_constant_i(law, reduced_mass, load, gravity, rest_overlap) result(k)
      import :: contact_law_t, wp
      implicit none
      class(contact_law_t), intent(in) :: law
      real(wp), intent(in) :: reduced_mass   !! of the two bodies, 1/(1/M_a + 1/M_b) [kg]
      real(wp), intent(in) :: load           !! mass that it may have to carry [kg]
      real(wp), intent(in) :: gravity        !! >= 0 [m/s2]
      real(wp), intent(in) :: rest_overlap           !! overlap that it may make at rest, > 0 [m]
      real(wp) :: k                          !! [N/m^gamma_n]
    end function normal_constant_i

    !> The elastic force of a contact point at its depth.
    elemental subroutine normal_stiffness_i(law, k, d, hard, elastic)
      import :: contact_law_t, stiffness_t, wp
      implicit none
      class(contact_law_t), intent(in) :: law
      real(wp), intent(in) :: k               !! where the spring begins [N/m^gamma]
      real(wp), intent(in) :: d, hard         !! overlap, depth d_h at which contacts harden [m]
      type(stiffness_t), intent(out) :: elastic
    end subroutine normal_stiffness_i

    !> Normal damping of a contact point.
    elemental subroutine damping_i(law, share, k, total, inverse, eta, decay)
      import :: contact_law_t, wp
      implicit none
      class(contact_law_t), intent(in) :: law
      real(wp), intent(in) :: share
        !! stiffness of the contact point over k: its hardness [-]
      real(wp), intent(in) :: k         !! where the spring begins [N/m^gamma_n]
      real(wp), intent(in) :: total     !! sum of the shares of the pair along the normal [-]
      real(wp), intent(in) :: inverse   !! of the mass of the pair there [1/kg]
      real(wp), intent(out) :: eta      !! of the contact point [N s/m]
      real(wp), intent(out) :: decay    !! eta of the pair over twice its mass [1/s]
    end subroutine damping_i
  end interface

contains

  !> Constant k_t of a contact point whose normal constant is k_n.
  elemental function tangential_constant(law, k_n) result(k)
    class(contact_law_t), intent(in) :: law
    real(wp), intent(in) :: k_n      !! of the contact point [N/m^gamma_n]
    real(wp) :: k                    !! [N/m^gamma_t]

    k = law%tangential_share*k_n + law%k_t
  end function tangential_constant

  !> Tangential damping of a contact point [N s/m].
  elemental function tangential_damping(law, eta_n, k_t, k_n) result(eta)
    class(contact_law_t), intent(in) :: law
    real(wp), intent(in) :: eta_n     !! along the normal [N s/m]
    real(wp), intent(in) :: k_t, k_n  !! of the contact point [N/m^gamma]
    real(wp) :: eta

    eta = law%eta_t
    if (law%tangential_share > 0.0_wp) eta = eta_n*(k_t/k_n)
  end function tangential_damping

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
  !! The paper leaves the sense of v_r open; here it is counterpart minus self, so that v_r.n < 0
  !! while closing and the damping dissipates.
  elemental function normal_force(elastic, eta, v_n) result(f)
    real(wp), intent(in) :: elastic   !! k_n d_n^gamma_n of the spring [N]
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
    real(wp), intent(in) :: xi(3)
      !! way of the counterpart past the body since they touch [m]
    real(wp), intent(in) :: v_t(3)          !! tangential part of v_r [m/s]
    real(wp) :: f(3)

    f = eta*v_t
    if (abs(gamma - 1.0_wp) > 0.0_wp) then
      if (any(abs(xi) > 0.0_wp)) f = f + k*norm(xi)**(gamma - 1.0_wp)*xi
    else
      f = f + k*xi
    end if
  end function tangential_force

  !> Displacement at which the tangential force would be f: that kept in memory while slipping [m].
  pure function tangential_slip(k, gamma, eta, f, v_t) result(xi)
    real(wp), intent(in) :: k, gamma, eta   !! [N/m^gamma, -, N s/m]
    real(wp), intent(in) :: f(3)            !! [N]
    real(wp), intent(in) :: v_t(3)          !! [m/s]
    real(wp) :: xi(3)
    real(wp) :: stretch(3), length

    xi = 0.0_wp
    if (k <= 0.0_wp) return
    stretch = (f - eta*v_t)/k
    length = norm(stretch)
    if (length > 0.0_wp) xi = stretch*length**(1.0_wp/gamma - 1.0_wp)
  end function tangential_slip

  !> d^gamma, quick for the linear spring.
  elemental function power(d, gamma) result(p)
    real(wp), intent(in) :: d, gamma   !! [m, -]
    real(wp) :: p

    p = d
    if (abs(gamma - 1.0_wp) > 0.0_wp) p = d**gamma
  end function power

end module contact_law_m
