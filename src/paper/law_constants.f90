!> Contact law with constants given, eqs. (1) and (2) of the paper.
module law_constants_m
  use kinds_m, only: wp
  use case_types_m, only: contact_input_t
  use contact_law_m, only: contact_law_t, stiffness_t, power
  implicit none
  private
  public :: law_constants

  type, extends(contact_law_t) :: law_constants_t
    real(wp) :: k_n = 0.0_wp, eta_n = 0.0_wp   !! [N/m^gamma_n], [N s/m]
  contains
    procedure :: normal_constant
    procedure :: normal_stiffness
    procedure :: damping
  end type law_constants_t

contains

  !> The law of a case.
  pure function law_constants(input) result(law)
    type(contact_input_t), intent(in) :: input
    type(law_constants_t) :: law

    law%k_n = input%k_n
    law%gamma_n = input%gamma_n
    law%eta_n = input%eta_n
    law%k_t = input%k_t
    law%gamma_t = input%gamma_t
    law%eta_t = input%eta_t
  end function law_constants

  elemental function normal_constant(law, reduced_mass, load, gravity, rest_overlap) result(k)
    class(law_constants_t), intent(in) :: law
    real(wp), intent(in) :: reduced_mass, load, gravity, rest_overlap
    real(wp) :: k

    associate (unused => [reduced_mass, load, gravity, rest_overlap])
    end associate
    k = law%k_n
  end function normal_constant

  !> F = k d^gamma of eq. (1).
  elemental subroutine normal_stiffness(law, k, d, hard, elastic)
    class(law_constants_t), intent(in) :: law
    real(wp), intent(in) :: k, d, hard
    type(stiffness_t), intent(out) :: elastic

    associate (unused => hard)   ! these springs do not harden
    end associate
    if (abs(law%gamma_n - 1.0_wp) > 0.0_wp) then
      elastic%steepness = law%gamma_n*max(0.0_wp, d)**(law%gamma_n - 1.0_wp)
    end if
    if (.not. d > 0.0_wp) return
    elastic%force = k*power(d, law%gamma_n)
    elastic%energy = elastic%force*d/(law%gamma_n + 1.0_wp)
  end subroutine normal_stiffness

  !> Each contact point damps by itself.
  elemental subroutine damping(law, share, k, total, inverse, eta, decay)
    class(law_constants_t), intent(in) :: law
    real(wp), intent(in) :: share, k, total, inverse
    real(wp), intent(out) :: eta, decay

    associate (unused => k)
    end associate
    eta = share*law%eta_n
    decay = 0.5_wp*law%eta_n*total*inverse
  end subroutine damping

end module law_constants_m
