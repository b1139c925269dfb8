!> Films between spheres and walls: what they take from a fall, whom they push, and where they end.
program test_lubrication
  use kinds_m, only: wp, pi
  use check_m, only: check, finish_checks
  use case_types_m, only: case_t
  use tet_mesh_m, only: shape_t
  use shapes_builtin_m, only: make_shape
  use rigid_body_m, only: blocks_t, blocks_init
  use walls_m, only: walls_t, walls_init
  use lubrication_m, only: lubrication_t, lubrication_init, film_impulse, film_pull
  use contacts_m, only: contacts_t, contacts_init, contact_report_t, move_blocks
  implicit none

  real(wp), parameter :: d = 0.006_wp           !! diameter of the spheres [m]
  real(wp), parameter :: mu = 0.1_wp            !! [Pa s]
  real(wp), parameter :: thick = d/10           !! thickest film [m]
  real(wp), parameter :: dt = 5.0e-4_wp         !! [s]
  type(shape_t) :: shapes(1)

  call make_sphere()
  call check_resistance()
  call check_fall('no_slip', 1.0_wp)
  call check_fall('slip', 0.25_wp)
  call check_pair()
  call check_cavitation()
  call finish_checks()

contains

  subroutine make_sphere()
    type(case_t) :: case
    character(:), allocatable :: message

    allocate (case%shape(1))
    case%shape(1)%name = 'ball'
    case%shape(1)%kind = 'sphere'
    case%shape(1)%size = d
    case%shape(1)%density = 7800.0_wp
    call make_shape(case%shape(1), shapes(1), message)
  end subroutine make_sphere

  !> n spheres in a tank of 1 m, and films.
  subroutine start(kind, x, v, blocks, walls, contacts)
    character(*), intent(in) :: kind          !! of the floor
    real(wp), intent(in) :: x(:, :), v(:, :)  !! (3, n)
    type(blocks_t), intent(out) :: blocks
    type(walls_t), intent(out) :: walls
    type(contacts_t), intent(out) :: contacts
    type(case_t) :: case
    integer :: b

    allocate (case%body(size(x, 2)), case%drop(0))
    case%grid%length = 1.0_wp
    case%boundary%kind(1, 3) = kind
    case%contact%contact_time = 1.0e-4_wp
    do b = 1, size(x, 2)
      case%body(b)%shape = 'ball'
      case%body(b)%position = x(:, b)
      case%body(b)%velocity = v(:, b)
    end do
    call blocks_init(case, shapes, blocks)
    call walls_init(case%grid, case%boundary, walls)
    call contacts_init(case%contact, blocks, contacts)
    call lubrication_init(mu, thick, blocks, contacts%lubrication)
  end subroutine start

  !> The impulse is the integral of the resistance.
  subroutine check_resistance()
    type(blocks_t) :: blocks
    type(walls_t) :: walls
    type(contacts_t) :: contacts
    real(wp), parameter :: share(3) = [0.02_wp, 0.1_wp, 0.7_wp]
    real(wp) :: h, found, step
    integer :: i

    call start('no_slip', reshape([0.5_wp, 0.5_wp, 0.5_wp], [3, 1]), &
               reshape([0.0_wp, 0.0_wp, 0.0_wp], [3, 1]), blocks, walls, contacts)
    do i = 1, 3
      h = share(i)*thick
      step = 1.0e-5_wp*h
      found = (film_impulse(contacts%lubrication, d/2, h + step) &
        - film_impulse(contacts%lubrication, d/2, h - step))/(2*step)
      call check('resistance of a film', found, 6*pi*mu*(d/2)**2*(1/h - 1/thick), 1.0e-6_wp*found)
    end do
    found = film_impulse(contacts%lubrication, d/2, 2*thick)
    call check('none above', found, film_impulse(contacts%lubrication, d/2, thick), 0.0_wp)
    call check('none below', film_impulse(contacts%lubrication, d/2, -h), 0.0_wp, 0.0_wp)
  end subroutine check_resistance

  !> A sphere that flies on to a wall loses what the film takes, just once on its way.
  subroutine check_fall(kind, share)
    character(*), intent(in) :: kind
    real(wp), intent(in) :: share   !! of the resistance of a no-slip wall
    real(wp), parameter :: v = 0.5_wp
    type(blocks_t) :: blocks
    type(walls_t) :: walls
    type(contacts_t) :: contacts
    type(contact_report_t) :: report
    real(wp) :: expected, gap
    integer :: i

    call start(kind, reshape([0.5_wp, 0.5_wp, d/2 + 1.5_wp*thick], [3, 1]), &
               reshape([0.0_wp, 0.0_wp, -v], [3, 1]), blocks, walls, contacts)
    do i = 1, 1000
      call move_blocks(walls, [0.0_wp, 0.0_wp, 0.0_wp], 1.0e-5_wp, contacts, blocks, report)
      gap = blocks%x(3, 1) - d/2
      if (gap < 0.02_wp*thick) exit
    end do
    expected = v - (film_impulse(contacts%lubrication, sqrt(share)*d/2, thick) &
      - film_impulse(contacts%lubrication, sqrt(share)*d/2, gap))/blocks%mass(1)
    call check(kind//': speed lost in the film', -blocks%v(3, 1), expected, &
               1.0e-3_wp*(v - expected))
    call check(kind//': not touched yet', blocks%contacts(1), 0)
  end subroutine check_fall

  !> Two spheres that part hold one another back, with opposite forces, along the line of centres.
  subroutine check_pair()
    type(blocks_t) :: blocks
    type(walls_t) :: walls
    type(contacts_t) :: contacts
    type(contact_report_t) :: report
    real(wp) :: before(3), after(3), expected, gap(2), n(3)

    n = [0.6_wp, 0.0_wp, 0.8_wp]
    call start('no_slip', reshape([0.5_wp + 0*n, 0.5_wp + (d + 0.3_wp*thick)*n], [3, 2]), &
               reshape([0.0_wp, 0.0_wp, 0.0_wp, 0.1_wp*n], [3, 2]), blocks, walls, contacts)
    before = blocks%v(:, 1) + blocks%v(:, 2)
    gap(1) = 0.3_wp*thick
    call move_blocks(walls, [0.0_wp, 0.0_wp, 0.0_wp], dt, contacts, blocks, report)
    after = blocks%v(:, 1) + blocks%v(:, 2)
    gap(2) = norm2(blocks%x(:, 2) - blocks%x(:, 1)) - d
    call check('momentum of a pair', after, before, 1.0e-15_wp)
    expected = 0.1_wp - 2*(film_impulse(contacts%lubrication, d/4, gap(2)) &
      - film_impulse(contacts%lubrication, d/4, gap(1)))/blocks%mass(1)
    call check('speed of parting', dot_product(blocks%v(:, 2) - blocks%v(:, 1), n), expected, &
               1.0e-3_wp*(0.1_wp - expected))
    call check('contact force tells it', blocks%contact_force(:, 2)*dt/blocks%mass(2), &
               blocks%v(:, 2) - 0.1_wp*n, 1.0e-12_wp)
  end subroutine check_pair

  !> A film that opens pulls with its own resistance, or with the atmosphere where it is too thin:
  !! the suction, capped, summed over the film.
  subroutine check_cavitation()
    real(wp), parameter :: v = 0.25_wp, p = 101325.0_wp
    integer, parameter :: n = 200000
    type(blocks_t) :: blocks
    type(walls_t) :: walls
    type(contacts_t) :: contacts
    real(wp) :: h, s, ds, force
    integer :: i

    call start('no_slip', reshape([0.5_wp, 0.5_wp, 0.5_wp], [3, 1]), &
               reshape([0.0_wp, 0.0_wp, 0.0_wp], [3, 1]), blocks, walls, contacts)
    h = 0.4_wp*thick
    call check('thick film', film_pull(contacts%lubrication, d/2, h, v), &
               6*pi*mu*(d/2)**2*v*(1/h - 1/thick), 1.0e-12_wp)
    h = 1.0e-2_wp*thick
    ds = (thick - h)/real(n, wp)
    force = 0.0_wp
    do i = 1, n
      s = h + (real(i, wp) - 0.5_wp)*ds
      force = force + 2*pi*(d/2)*ds*min(p, 3*mu*(d/2)*v/s**2)
    end do
    call check('thin film', film_pull(contacts%lubrication, d/2, h, v), force, 1.0e-4_wp*force)
  end subroutine check_cavitation

end program test_lubrication
