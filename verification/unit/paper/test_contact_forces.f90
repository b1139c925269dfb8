!> Contact forces: action and reaction, force as slope of energy, friction, damping, memory.
module test_contact_forces_m
  use check_m, only: check, wp
  use case_types_m, only: contact_input_t
  use vectors_m, only: cross
  use bed_m, only: bed_counterpart
  use contact_points_m, only: contact_point_t, contact_points_t, add_point
  use contact_groups_m, only: groups_t, form_groups
  use displacements_m, only: displacements_t, reserve_displacements
  use sleep_m, only: sum_memory
  use contact_laws_m, only: choose_law
  use counterparts_m, only: counterparts_t
  use contact_response_m, only: response_t, respond
  use contact_solver_m, only: loads_t, contact_report_t
  use contact_forces_m, only: match_displacements, integrate_displacements, sum_groups, &
    elastic_energy
  use two_cubes_m, only: vector, free_bodies
  implicit none
  private
  public :: test_contact_forces

  real(wp), parameter :: mass(3) = [2.0_wp, 3.0_wp, 6.0_wp]   !! of three bodies [kg]
  real(wp), parameter :: x(3) = [1.0_wp, 0.0_wp, 0.0_wp], z(3) = [0.0_wp, 0.0_wp, 1.0_wp]
  real(wp), parameter :: k_n = 1.0e4_wp, k_t = 5.0e3_wp       !! [N/m^gamma]
  real(wp), parameter :: mu = 0.5_wp, wall_mu = 0.3_wp        !! friction [-]
  integer, parameter :: floor = -5
  type(contact_points_t) :: points
  type(response_t) :: response
  type(counterparts_t) :: counterparts
  type(loads_t) :: loads
  type(displacements_t) :: rest
  type(contact_report_t) :: report

contains

  subroutine test_contact_forces()
    allocate (loads%force(3, bed_counterpart:3), loads%torque(3, bed_counterpart:3))
    call check_reaction()
    call check_energy()
    call check_friction()
    call check_damping()
    call check_strong_damping()
    call check_new_point()
    call check_memory()
    call check_groups()
  end subroutine test_contact_forces

  !> Three bodies at rest, stiffnesses with the constants above and a normal dashpot.
  subroutine begin(gamma, eta)
    real(wp), intent(in) :: gamma, eta       !! [-], [N s/m]
    type(contact_input_t) :: input
    integer :: b

    input%law = 'constants'
    input%k_n = k_n
    input%k_t = k_t
    input%gamma_n = gamma
    input%gamma_t = gamma
    input%eta_n = eta
    input%eta_t = 0.0_wp
    input%friction = mu
    input%wall_friction = wall_mu
    call free_bodies(mass, counterparts, response)
    call choose_law(input, response%law)
    do b = 1, 3
      counterparts%inverse_inertia(b, b, 1:3) = 1.0_wp
    end do
  end subroutine begin

  !> Contact points and displacements as a substep finds them.
  subroutine detect_again(point, displacements)
    type(contact_point_t), intent(in) :: point(:)
    type(displacements_t), intent(inout) :: displacements
    type(displacements_t) :: before
    integer :: t

    call reserve_displacements(1, displacements)
    call reserve_displacements(1, before)
    points%n = 0
    do t = 1, size(point)
      call add_point(point(t), points)
    end do
    call form_groups(points, response%groups)
    call respond(points, counterparts, response)
    call match_displacements(points, response%groups, before, displacements)
  end subroutine detect_again

  !> Forces of a substep.
  subroutine sum_forces(dt, displacements)
    real(wp), intent(in) :: dt   !! [s]
    type(displacements_t), intent(inout) :: displacements

    loads%force = 0.0_wp
    loads%torque = 0.0_wp
    call sum_groups(dt, points, response, counterparts, displacements, loads, report)
  end subroutine sum_forces

  !> Forces of many contact points in all directions add up to nothing, and so do their moments
  !! about the origin, those on the floor included.
  subroutine check_reaction()
    integer, parameter :: a(8) = [2, 2, 3, 3, 3, 3, 3, 3], b(8) = [1, 1, floor, floor, 1, 1, 1, 2]
    type(displacements_t) :: displacements
    type(contact_point_t) :: point(8)
    real(wp) :: place(3, bed_counterpart:3), p(3), moment(3), remembered(3, 3, 2)
    integer :: t, i

    call begin(1.5_wp, 20.0_wp)
    place = 0.0_wp
    do i = 1, 3
      place(:, i) = vector(i, 1)
      counterparts%v(:, i) = vector(i, 2)
      counterparts%omega(:, i) = vector(i, 3)
    end do
    do t = 1, 8
      p = vector(t, 4)
      point(t) = contact_point_t(a(t), b(t), t/2, p - place(:, a(t)), p - place(:, b(t)), &
        vector(t, 5), 0.01_wp*t, length=1.0_wp)
      point(t)%normal = point(t)%normal/norm2(point(t)%normal)
    end do
    call detect_again(point, displacements)
    call integrate_displacements(0.01_wp, response%groups, counterparts, displacements)
    call sum_forces(1.0e-3_wp, displacements)
    call check('forces add up to nothing', sum(loads%force, 2), 0*x, 1.0e-11_wp)
    moment = sum(loads%torque, 2)
    do i = 1, 3
      moment = moment + cross(place(:, i), loads%force(:, i))
    end do
    call check('and so do moments', moment, 0*x, 1.0e-11_wp)
    call check('all bodies are pushed', minval(norm2(loads%force(:, 1:3), 1)) > 1.0_wp)
    call check('the floor too', norm2(loads%force(:, floor)) > 1.0_wp)
    remembered = 0.0_wp
    call sum_memory(displacements, remembered(:, :, 1), remembered(:, :, 2))
    call check('remembered forces', maxval(abs(remembered(:, :, 1) - loads%force(:, 1:))), 0.0_wp, &
      1.0e-12_wp)
    call check('and torques', maxval(abs(remembered(:, :, 2) - loads%torque(:, 1:))), 0.0_wp, &
      1.0e-12_wp)
  end subroutine check_reaction

  !> The elastic energy grows with depth and with a tangential displacement as their forces tell,
  !! and contact points at rest keep theirs.
  subroutine check_energy()
    real(wp), parameter :: d = 0.02_wp, step = 1.0e-6_wp, stretch = 3.0e-3_wp
    type(displacements_t) :: displacements
    real(wp) :: energy(-1:1)
    integer :: i

    call begin(1.5_wp, 0.0_wp)
    do i = -1, 1
      call detect_again([contact_point_t(2, 1, 1, normal=z, depth=d + i*step, length=1.0_wp)], &
        displacements)
      displacements%xi(:, 1) = 0.0_wp
      call sum_forces(1.0e-3_wp, displacements)
      energy(i) = elastic_energy(points%n, response, displacements, rest)
      if (i == 0) call check('force k d^1.5', loads%force(3, 1), k_n*d**1.5_wp, 1.0e-12_wp*k_n)
    end do
    call check('slope', (energy(1) - energy(-1))/(2*step), k_n*d**1.5_wp, 1.0e-6_wp*k_n*d**1.5_wp)
    do i = -1, 1
      displacements%xi(:, 1) = (stretch + i*step)*x
      call sum_forces(1.0e-3_wp, displacements)
      energy(i) = elastic_energy(points%n, response, displacements, rest)
      if (i == 0) call check('a counterpart that went by pulls along', loads%force(:, 2), &
        k_t*stretch**1.5_wp*x - k_n*(d + step)**1.5_wp*z, 1.0e-12_wp*k_n)
    end do
    call check('slope of its energy', (energy(1) - energy(-1))/(2*step), k_t*stretch**1.5_wp, &
      1.0e-6_wp*k_t*stretch**1.5_wp)
    call check('the energy remembered', displacements%energy(1), energy(1), 1.0e-14_wp)
    call reserve_displacements(2, rest)
    rest%n = 2
    rest%energy(:2) = [1.0_wp, 2.0_wp]
    call check('contact points at rest keep theirs', elastic_energy(points%n, response, &
      displacements, rest), energy(1) + 3.0_wp, 1.0e-14_wp)
  end subroutine check_energy

  !> Friction holds up to its share of the normal force; what slips pulls with just that.
  subroutine check_friction()
    real(wp), parameter :: d = 0.01_wp, push = k_n*d
    type(displacements_t) :: displacements

    call begin(1.0_wp, 0.0_wp)
    call detect_again([contact_point_t(2, floor, 1, normal=-z, depth=d, length=1.0_wp), &
      contact_point_t(3, 1, 1, normal=-z, depth=d, length=1.0_wp)], displacements)
    displacements%xi(:, 1) = 0.99_wp*wall_mu*push/k_t*x
    displacements%xi(:, 2) = 0.99_wp*mu*push/k_t*x
    call sum_forces(1.0e-3_wp, displacements)
    call check('sticks', loads%force([1, 3], 3), push*[0.99_wp*mu, 1.0_wp], 1.0e-12_wp*push)
    call check('sticks to the floor', loads%force(1, 2), 0.99_wp*wall_mu*push, 1.0e-12_wp*push)
    displacements%xi(:, 1:2) = 2*displacements%xi(:, 1:2)
    call sum_forces(1.0e-3_wp, displacements)
    call check('slips', loads%force([1, 3], 3), push*[mu, 1.0_wp], 1.0e-12_wp*push)
    call check('slips on the floor', loads%force(1, 2), wall_mu*push, 1.0e-12_wp*push)
    call check('stretch', displacements%xi(1, 1:2), push/k_t*[wall_mu, mu], 1.0e-12_wp*push/k_t)

    call begin(1.0_wp, 0.0_wp)
    response%law%eta_t = 100.0_wp
    displacements = displacements_t()
    call detect_again([contact_point_t(2, floor, 1, normal=-z, depth=d, length=1.0_wp)], &
      displacements)
    displacements%xi(:, 1) = 2*wall_mu*push/k_t*x
    counterparts%v(1, 2) = -0.1_wp
    call sum_forces(1.0e-3_wp, displacements)
    call check('stretch beside a dashpot', displacements%xi(1, 1), wall_mu*push/k_t, &
      1.0e-12_wp*push/k_t)
  end subroutine check_friction

  !> The force belongs to the velocity in the middle of the substep, which it changes itself; the
  !! report knows the largest overlap, and the way against one another over the length.
  subroutine check_damping()
    real(wp), parameter :: d = 0.01_wp, dt = 0.02_wp, eta = 100.0_wp, closing = 0.8_wp
    type(displacements_t) :: displacements
    type(contact_point_t) :: point
    real(wp) :: force

    call begin(1.0_wp, eta)
    point = contact_point_t(2, floor, 1, normal=-z, depth=d, length=0.5_wp)
    call detect_again([point], displacements)
    call detect_again([point], displacements)   ! it is not new any more
    counterparts%v(3, 2) = -closing
    report = contact_report_t()
    call sum_forces(dt, displacements)
    force = loads%force(3, 2)
    call check('damping', force, k_n*d + eta*(closing - 0.5_wp*dt*force/mass(2)), 1.0e-12_wp*force)
    call check('Courant number', report%courant_max, closing*dt/0.5_wp, 1.0e-15_wp)
    call check('overlap', report%overlap_max, d)
    counterparts%v(3, 2) = 2*k_n*d/eta
    call sum_forces(dt, displacements)
    call check('never pulls', loads%force(3, 2), 0.0_wp)
  end subroutine check_damping

  !> However strong a dashpot is, it stops the motion within a substep and does not turn it round.
  subroutine check_strong_damping()
    real(wp), parameter :: d = 1.0e-6_wp, dt = 0.02_wp, closing = 0.8_wp
    real(wp), parameter :: eta(3) = mass(2)*[1.0e2_wp, 2.0e2_wp, 1.0e5_wp]   ! from D = 1 on
    type(displacements_t) :: displacements
    type(contact_point_t) :: point
    integer :: i

    point = contact_point_t(2, floor, 1, normal=-z, depth=d, length=0.5_wp)
    do i = 1, size(eta)
      call begin(1.0_wp, eta(i))
      call detect_again([point], displacements)
      call detect_again([point], displacements)   ! it is not new any more
      counterparts%v(3, 2) = -closing
      call sum_forces(dt, displacements)
      call check('it stops', dt*loads%force(3, 2)/mass(2), closing + k_n*d/eta(i), 1.0e-12_wp)
    end do
  end subroutine check_strong_damping

  !> A new contact point damps for the time since it began: from where the bodies met up to the end
  !! of the substep, a substep and a half at most.
  subroutine check_new_point()
    real(wp), parameter :: dt = 0.02_wp, eta = 100.0_wp, closing = 0.5_wp, way = closing*dt
    real(wp), parameter :: depth(3) = way*[0.25_wp, 1.0_wp, 3.0_wp], part(3) = [0.75_wp, 1.5_wp, &
      1.5_wp]
    type(displacements_t) :: displacements
    real(wp) :: force
    integer :: i

    call begin(1.0_wp, eta)
    do i = 1, 3
      displacements%n = 0
      call detect_again([contact_point_t(2, floor, 1, normal=-z, depth=depth(i), length=1.0_wp)], &
        displacements)
      counterparts%v(3, 2) = -closing
      call sum_forces(dt, displacements)
      force = loads%force(3, 2)
      call check('damping of a new contact point', force, &
        k_n*depth(i) + part(i)*eta*(closing - 0.5_wp*dt*force/mass(2)), 1.0e-12_wp*force)
    end do
  end subroutine check_new_point

  !> A displacement follows its contact point by body, counterpart and id, lies in the present
  !! plane as long as it was, and grows by the tangential way; others begin anew or are forgotten.
  subroutine check_memory()
    real(wp), parameter :: dt = 0.5_wp
    type(displacements_t) :: displacements
    type(contact_point_t) :: point(3)

    call begin(1.0_wp, 0.0_wp)
    point = [contact_point_t(2, 1, 4, normal=z, depth=1.0_wp), contact_point_t(2, 1, 6, normal=z, &
      depth=1.0_wp), contact_point_t(3, 1, 4, normal=z, depth=1.0_wp, arm_a=2*z)]
    call detect_again(point, displacements)
    call check('all are new', all(response%groups%new(:3)))
    counterparts%v(:, 1) = 3*x + 7*z
    counterparts%omega(:, 3) = [0.0_wp, 1.0_wp, 0.0_wp]
    call integrate_displacements(dt, response%groups, counterparts, displacements)
    call check('tangential way', displacements%xi(:, 1), 3*dt*x, 1.0e-15_wp)
    call check('turning takes part', displacements%xi(:, 3), dt*(3 - 2)*x, 1.0e-15_wp)
    point(1)%id = 5
    point(3)%normal = [0.6_wp, 0.0_wp, 0.8_wp]
    call detect_again(point, displacements)
    call check('one is new', all(response%groups%new(:3) .eqv. [.true., .false., .false.]))
    call check('and begins at nothing', displacements%xi(:, 1), 0*x)
    call check('one stays', displacements%xi(:, 2), 3*dt*x, 1.0e-15_wp)
    call check('one turns', displacements%xi(:, 3), dt*[0.8_wp, 0.0_wp, -0.6_wp], 1.0e-15_wp)
    call detect_again(point(2:2), displacements)
    call detect_again(point, displacements)
    call check('what has parted is forgotten', displacements%xi(:, 3), 0*x)
  end subroutine check_memory

  !> Contact points of one id and counterpart have a mean normal and point, weighted by overlap.
  subroutine check_groups()
    type(contact_points_t) :: list
    type(groups_t) :: groups
    real(wp), parameter :: y(3) = [0.0_wp, 1.0_wp, 0.0_wp]

    call add_point(contact_point_t(2, 1, 5, x, x - y, x, 2.0_wp), list)
    call add_point(contact_point_t(2, 1, 6, x, x - y, x, 3.0_wp), list)
    call add_point(contact_point_t(2, 1, 6, 3*y, 2*y, y, 4.0_wp), list)
    call add_point(contact_point_t(3, 1, 6, y, y, x, 1.0_wp), list)
    call add_point(contact_point_t(3, 1, 6, y, y, -x, 1.0_wp), list)
    call form_groups(list, groups)
    call check('ids and bodies', groups%n, 3)
    call check('where they begin', all(groups%first(:4) == [1, 2, 4, 6]))
    call check('one alone', groups%normal(:, 1), x)
    call check('mean normal', groups%normal(:, 2), [0.6_wp, 0.8_wp, 0.0_wp], 1.0e-15_wp)
    call check('mean point', groups%arm_a(:, 2), (3*x + 12*y)/7, 1.0e-15_wp)
    call check('seen from b', groups%arm_b(:, 2), (3*x + 12*y)/7 - y, 1.0e-15_wp)
    call check('opposite normals', groups%normal(:, 3), x)
  end subroutine check_groups

end module test_contact_forces_m
