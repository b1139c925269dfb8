!> All that the contacts of a run hold, and how it begins.
module contact_state_m
  use kinds_m, only: wp
  use case_types_m, only: contact_input_t
  use rigid_body_m, only: blocks_t
  use bed_m, only: bed_counterpart
  use displacements_m, only: displacements_t, reserve_displacements
  use sleep_m, only: sleep_t, sleep_init
  use lubrication_m, only: lubrication_t
  use contact_detection_m, only: contact_detection_t, detection_init
  use contact_forces_m, only: loads_t
  use substep_limits_m, only: limits_t, limits_init, longest_substep_of
  use counterparts_met_m, only: met_t
  use impulse_rows_m, only: rows_t, rows_init
  implicit none
  private
  public :: contacts_t, contacts_init

  !> Where bodies were when a substep began: (3, n), (4, n), (3, n), (3, n).
  type :: start_t
    real(wp), allocatable :: x(:, :), q(:, :), l(:, :), omega(:, :)
  end type start_t

  type :: contacts_t
    type(contact_detection_t) :: detected        !! what touches now
    type(limits_t) :: limits
    type(displacements_t) :: displacements       !! the memory: part of the state of a run
    type(displacements_t) :: before              !! work: displacements of the substep before
    type(sleep_t) :: sleep                       !! blocks at rest: part of the state too
    logical, allocatable :: woken(:)             !! (n) work
    type(lubrication_t) :: lubrication
    real(wp), allocatable :: share(:)            !! (n) of a contact force that moves the body [-]
    real(wp), allocatable :: steady(:, :)        !! (3, n) force all through the step [N]
    real(wp), allocatable :: held(:, :)          !! (6, n) what holds those asleep at its start
    type(loads_t) :: loads
    type(start_t) :: start                       !! the place to go back to
    type(met_t) :: met                           !! pairs that touched in this step
    logical :: by_impulses = .false.             !! solver = 'impulses', else springs
    type(rows_t) :: rows                         !! its work
    real(wp), allocatable :: gain(:)             !! (n) work: speed gained in free fall [m/s]
    real(wp) :: contact_time = 0.0_wp            !! [s]
    real(wp) :: restitution = 0.0_wp             !! [-]
    real(wp) :: smallest_edge = 0.0_wp           !! of all blocks [m]
  end type contacts_t

contains

  !> The contacts of a case, without any contact point yet.
  subroutine contacts_init(input, blocks, contacts)
    type(contact_input_t), intent(in) :: input
    type(blocks_t), intent(in) :: blocks
    type(contacts_t), intent(out) :: contacts
    integer :: n, b

    call detection_init(input, longest_substep_of(input), blocks, contacts%detected)
    call limits_init(input, contacts%detected, contacts%limits)
    n = blocks%n
    associate (loads => contacts%loads, start => contacts%start)
      allocate (loads%force(3, bed_counterpart:n), loads%torque(3, bed_counterpart:n), &
        source=0.0_wp)
      allocate (loads%impulse(3, bed_counterpart:n), loads%twist(3, bed_counterpart:n), &
        source=0.0_wp)
      allocate (loads%film(3, bed_counterpart:n), source=0.0_wp)
      allocate (start%x(3, n), start%q(4, n), start%l(3, n), start%omega(3, n))
    end associate
    allocate (contacts%share(n), contacts%steady(3, n), contacts%held(6, n), source=0.0_wp)
    call reserve_displacements(1, contacts%displacements)
    call reserve_displacements(1, contacts%before)
    call sleep_init(input%sleep, contacts%limits%bounding_radius, contacts%sleep)
    allocate (contacts%woken(n), source=.false.)
    select case (input%solver)
    case ('springs'); return
    case ('impulses'); contacts%by_impulses = .true.
    case default; error stop 'contacts_init: no such solver'
    end select
    contacts%contact_time = input%contact_time
    contacts%restitution = input%restitution
    contacts%smallest_edge = minval([(blocks%shapes(blocks%shape(b))%smallest_edge, b=1, n)])
    call rows_init(n, contacts%rows)
    allocate (contacts%gain(n), source=0.0_wp)
    associate (search => contacts%detected%surface%search)
      search%lasting = 2*input%contact_time   ! lists of fast bodies: two steps
      search%lasting_gaps = 1.0_wp
    end associate
  end subroutine contacts_init

end module contact_state_m
