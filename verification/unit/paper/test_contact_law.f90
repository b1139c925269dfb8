!> The contact law: closed form of the impact, its inversion, forces of one contact point.
module test_contact_law_m
  use check_m, only: check, wp, pi
  use case_types_m, only: contact_input_t
  use contact_law_m, only: contact_law_t, stiffness_t, stored_energy, normal_force, &
    tangential_force, tangential_slip
  use law_restitution_m, only: restitution_of, impact_duration, damping_ratio_of
  use contact_laws_m, only: choose_law
  implicit none
  private
  public :: test_contact_law

  real(wp), parameter :: g = 9.81_wp   !! [m/s2]

contains

  subroutine test_contact_law()
    call check_closed_form()
    call check_integrated_impact()
    call check_hardening()
    call check_constants()
    call check_overdamped()
    call check_load()
    call check_forces()
  end subroutine test_contact_law

  !> Model B (never pulls) of the reference table D2_linear_spring_dashpot.csv, integrated there.
  subroutine check_closed_form()
    real(wp), parameter :: zeta(7) = [0.01_wp, 0.1_wp, 0.2_wp, 0.3_wp, 0.5_wp, 0.7_wp, 0.9_wp]
    real(wp), parameter :: e(7) = [0.9692647505_wp, 0.7440793977_wp, 0.5717400276_wp, &
      0.4509754529_wp, 0.2984360592_wp, 0.2102845644_wp, 0.1552827475_wp]
    real(wp), parameter :: t(7) = [3.1217484116_wp, 2.9560753247_wp, 2.7953544407_wp, &
      2.6544745638_wp, 2.4183991523_wp, 2.2275622815_wp, 2.0694529405_wp]
    real(wp), parameter :: asked(6) = [0.02_wp, 0.1_wp, 0.3_wp, 0.5_wp, 0.9_wp, 0.999_wp]

    call check('restitution of the table', restitution_of(zeta) - e, 0.0_wp, 1.0e-10_wp)
    call check('duration of the table', impact_duration(zeta) - t, 0.0_wp, 1.0e-9_wp)
    call check('undamped duration', impact_duration(0.0_wp), pi, 1.0e-14_wp)
    call check('critical damping', restitution_of(1.0_wp), exp(-2.0_wp), 1.0e-15_wp)
    call check('smooth at zeta = 1', restitution_of([1.0_wp - 1.0e-6_wp, 1.0_wp + 1.0e-6_wp]) &
      - exp(-2.0_wp)*(1.0_wp - [-1, 1]*4.0e-6_wp/3), 0.0_wp, 1.0e-11_wp)
    call check('inverse', restitution_of(damping_ratio_of(asked)) - asked, 0.0_wp, 1.0e-13_wp)
    call check('e = 0.1 is overdamped', damping_ratio_of(0.1_wp), 1.243_wp, 1.0e-3_wp)
    call check('no damping at e = 1', damping_ratio_of(1.0_wp) <= 0.0_wp)
  end subroutine check_closed_form

  !> The spring that hardens: its force is the slope of its energy, it is linear at a tenth of the
  !! depth d_h, and an impact that goes far beyond d_h returns the same share of the speed.
  subroutine check_hardening()
    real(wp), parameter :: zeta(3) = [0.0_wp, 0.4_wp, 1.0_wp], hard = 0.2_wp, step = 1.0e-6_wp
    real(wp), parameter :: linear(3) = [1.0_wp, 0.603_wp, 0.368_wp]   !! depth of the linear spring
    class(contact_law_t), allocatable :: law
    type(stiffness_t) :: elastic, beside(2)
    real(wp) :: d, v, deepest, slope
    integer :: m

    call choose_law(contact_input_t(), law)
    do m = 1, 5
      d = 0.15_wp*hard*real(m, wp)**2
      call law%normal_stiffness(3.0_wp, d + [-step, step], hard, beside)
      call law%normal_stiffness(3.0_wp, d, hard, elastic)
      call check('force is the slope of energy', (beside(2)%energy - beside(1)%energy)/(2*step), &
        elastic%force, 1.0e-6_wp*elastic%force)
      slope = 3.0_wp*elastic%hardness*elastic%steepness
      call check('stiffness', (beside(2)%force - beside(1)%force)/(2*step), slope, 1.0e-6_wp*slope)
    end do
    call law%normal_stiffness(3.0_wp, 0.1_wp*hard, hard, elastic)
    call check('linear where shallow', elastic%force, 0.3_wp*hard, 2.0e-4_wp*elastic%force)
    do m = 1, size(zeta)
      call follow(zeta(m), hard, 400000, v, deepest)
      call check('restitution of a deep impact', v, restitution_of(zeta(m)), 1.0e-3_wp)
      call check('far beyond the depth d_h', deepest > merge(1.7_wp, 1.2_wp, m == 1)*hard)
      call check('but not as deep as the linear spring', deepest < 0.75_wp*linear(m))
    end do
  end subroutine check_hardening

  !> The closed form against an impact followed in small steps with the force of the law itself.
  subroutine check_integrated_impact()
    real(wp), parameter :: zeta(3) = [0.4_wp, 1.0_wp, 3.0_wp]
    real(wp) :: v, deepest
    integer :: m

    do m = 1, size(zeta)
      call follow(zeta(m), 1.0e9_wp, 40000, v, deepest)
      call check('impact followed in time', v, restitution_of(zeta(m)), 1.0e-4_wp)
    end do
  end subroutine check_integrated_impact

  !> An impact of unit mass and speed on a spring of stiffness 1, followed with the law's own force.
  subroutine follow(zeta, hard, steps, back, deepest)
    real(wp), intent(in) :: zeta, hard   !! damping ratio, depth at which the spring hardens
    integer, intent(in) :: steps         !! over four units of time
    real(wp), intent(out) :: back, deepest
    class(contact_law_t), allocatable :: law
    type(stiffness_t) :: elastic
    real(wp) :: d, v, dt, force, eta
    integer :: i

    call choose_law(contact_input_t(), law)
    dt = 4.0_wp/real(steps, wp)
    d = 0.0_wp
    v = 1.0_wp
    deepest = 0.0_wp
    do i = 1, steps
      d = d + 0.5_wp*dt*v
      if (d < 0.0_wp) exit
      deepest = max(deepest, d)
      call law%normal_stiffness(1.0_wp, d, hard, elastic)
      eta = 2*zeta*sqrt(elastic%hardness)
      force = normal_force(elastic%force, eta, -v)
      v = v - dt*force/(1.0_wp + merge(0.5_wp*eta*dt, 0.0_wp, force > 0.0_wp))
      d = d + 0.5_wp*dt*v
    end do
    back = -v
  end subroutine follow

  !> Stiffness and damping found from restitution and contact time, and constants as given.
  subroutine check_constants()
    type(contact_input_t) :: input
    class(contact_law_t), allocatable :: law
    real(wp) :: k, eta, decay

    input%restitution = 1.0_wp
    input%contact_time = 1.0e-3_wp
    call choose_law(input, law)
    k = law%normal_constant(0.25_wp, 0.0_wp, g, 1.0_wp)
    call check('half a period is the contact time', pi*sqrt(0.25_wp/k), 1.0e-3_wp, 1.0e-15_wp)
    input%restitution = 0.3_wp
    call choose_law(input, law)
    k = law%normal_constant(0.25_wp, 0.0_wp, g, 1.0_wp)
    call check('damped', impact_duration(law%damping_ratio)*sqrt(0.25_wp/k), 1.0e-3_wp, 1.0e-15_wp)
    call law%damping(1.0_wp, k, 1.0_wp, 4.0_wp, eta, decay)
    call check('damping of that ratio', eta, 2*law%damping_ratio*sqrt(k*0.25_wp), 1.0e-12_wp*eta)
    call check('its decay', decay, 0.5_wp*eta/0.25_wp, 1.0e-12_wp*decay)
    call law%damping(0.3_wp, k, 1.0_wp, 4.0_wp, eta, decay)
    call check('a share of it', eta, 0.6_wp*law%damping_ratio*sqrt(k*0.25_wp), 1.0e-12_wp*eta)
    call check('across', law%tangential_damping(7.0_wp, 2*k/7, k), 2.0_wp, 1.0e-14_wp)
    call check('tangential stiffness', law%tangential_constant(k), 2*k/7, 1.0e-9_wp*k)
    input%law = 'constants'
    input%eta_n = 3.0_wp
    input%eta_t = 5.0_wp
    call choose_law(input, law)
    call check('given k_n', law%normal_constant(0.25_wp, 0.0_wp, g, 1.0_wp), input%k_n)
    call check('given k_t', law%tangential_constant(5.0_wp), input%k_t)
    call law%damping(0.5_wp, 1.0_wp, 2.0_wp, 4.0_wp, eta, decay)
    call check('given eta_n', eta, 1.5_wp)
    call check('its decay in a pair of weight 2', decay, 12.0_wp)
    call check('given eta_t', law%tangential_damping(9.0_wp, 9.0_wp, 9.0_wp), 5.0_wp)
  end subroutine check_constants

  !> Beyond critical damping the spring stays; the dashpot grows to that of the least restitution.
  subroutine check_overdamped()
    real(wp), parameter :: e(5) = [0.0_wp, 1.0e-6_wp, 1.0e-3_wp, 0.05_wp, 0.1_wp], &
      time = 1.0e-3_wp, mass = 0.25_wp
    type(contact_input_t) :: input
    class(contact_law_t), allocatable :: law
    integer :: m

    input%contact_time = time
    do m = 1, size(e)
      input%restitution = e(m)
      call choose_law(input, law)
      call check('spring of critical damping', law%normal_constant(mass, 0.0_wp, g, 1.0_wp), &
        mass*(2.0_wp/time)**2, 1.0e-9_wp*mass/time**2)
      call check('dashpot', restitution_of(law%damping_ratio), max(e(m), 0.01_wp), 1.0e-12_wp)
    end do
    input%restitution = 0.2_wp
    call choose_law(input, law)
    call check('below critical damping: the contact time', &
      impact_duration(law%damping_ratio)*sqrt(mass/law%normal_constant(mass, 0.0_wp, g, 1.0_wp)), &
      time, 1.0e-15_wp)
  end subroutine check_overdamped

  !> A contact point yields under a load as allowed, but is no stiffer than that of two such blocks.
  subroutine check_load()
    real(wp), parameter :: mass = 0.01_wp, heavy = 100*mass, time = 1.0e-2_wp
    type(contact_input_t) :: input
    class(contact_law_t), allocatable :: law
    real(wp) :: k

    input%restitution = 1.0_wp
    input%contact_time = time
    call choose_law(input, law)
    k = (pi/time)**2   ! of 1 kg
    call check('a light load changes nothing', law%normal_constant(mass, mass, g, &
      1.0e-3_wp), mass*k, 1.0e-9_wp)
    call check('a heavy one gives way by 1 mm', law%normal_constant(mass, heavy, g, &
      1.0e-3_wp), heavy*g/1.0e-3_wp, 1.0e-9_wp)
    call check('no stiffer than two such', law%normal_constant(mass, heavy, g, &
      1.0e-6_wp), 0.5_wp*heavy*k, 1.0e-9_wp*heavy*k)
    input%law = 'constants'
    call choose_law(input, law)
    call check('constants', law%normal_constant(mass, heavy, g, 1.0e-6_wp), input%k_n)
  end subroutine check_load

  !> Equations (1) and (2) for one contact point.
  subroutine check_forces()
    class(contact_law_t), allocatable :: law
    type(contact_input_t) :: input
    type(stiffness_t) :: elastic
    real(wp) :: f(3), xi(3), v(3)

    input%law = 'constants'
    input%gamma_n = 1.5_wp
    call choose_law(input, law)
    call law%normal_stiffness(1.0e5_wp, 1.0e-4_wp, 1.0e-5_wp, elastic)
    call check('spring alone', elastic%force, 0.1_wp, 1.0e-15_wp)
    call check('its energy', elastic%energy, 4.0e-6_wp, 1.0e-20_wp)
    call check('its slope', 1.0e5_wp*elastic%steepness, 1.5e3_wp, 1.0e-10_wp)
    call check('closing adds', normal_force(10.0_wp, 10.0_wp, -0.2_wp), 12.0_wp, 1.0e-13_wp)
    call check('never pulls', normal_force(10.0_wp, 10.0_wp, 2.0_wp), 0.0_wp)
    call check('energy of the spring', stored_energy(3.0_wp, 1.0_wp, 2.0_wp), 6.0_wp, 1.0e-15_wp)
    xi = [3.0e-5_wp, -4.0e-5_wp, 0.0_wp]
    v = [0.1_wp, 0.2_wp, 0.0_wp]
    f = tangential_force(1.0e5_wp, 1.0_wp, 10.0_wp, xi, v)
    call check('tangential force', f, [4.0_wp, -2.0_wp, 0.0_wp], 1.0e-13_wp)
    f = tangential_force(1.0e5_wp, 1.5_wp, 0.0_wp, xi, v)
    call check('its power law', norm2(f), 1.0e5_wp*(5.0e-5_wp)**1.5_wp, 1.0e-12_wp)
    call check('slip undoes the force', tangential_slip(1.0e5_wp, 1.5_wp, &
      2.0_wp, tangential_force(1.0e5_wp, 1.5_wp, 2.0_wp, xi, v), v) - xi, 0.0_wp, 1.0e-17_wp)
  end subroutine check_forces

end module test_contact_law_m
