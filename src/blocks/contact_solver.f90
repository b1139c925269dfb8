!> What every solver of contact has: what touches, what is remembered of it, who sleeps, and what
!! contact has done to the bodies in a step.
module contact_solver_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use case_types_m, only: contact_input_t
  use rigid_body_m, only: blocks_t
  use walls_m, only: walls_t
  use bed_m, only: bed_counterpart
  use displacements_m, only: displacements_t, reserve_displacements, comes_before
  use sleep_m, only: sleep_t, sleep_init
  use lubrication_m, only: lubrication_t
  use contact_points_m, only: contact_points_t, ensure_points
  use counterparts_m, only: counterparts_t, counterparts_init
  implicit none
  private
  public :: contact_solver_t, loads_t, contact_report_t, start_solver, met_t, store_counterparts
  public :: list_bodies, equal_substep, energy_in_memory

  !> Contact forces and torques on all counterparts: (3, counterparts).
  type :: loads_t
    real(wp), allocatable :: force(:, :), torque(:, :)   !! of this substep [N], [N m]
    real(wp), allocatable :: impulse(:, :), twist(:, :)  !! of the step [N s], [N m s]
    real(wp), allocatable :: peak(:)                     !! (n) largest force in the step [N]
  end type loads_t

  !> What happened in the substeps of one fluid step.
  type :: contact_report_t
    integer :: substeps = 0
    integer :: info = 0                 !! 1: it would take too many, or NaN
    real(wp) :: energy = 0.0_wp         !! elastic, at the end [J]
    real(wp) :: courant_max = 0.0_wp    !! largest C_s = |v_r.n| dt_b/d_s of a contact point [-]
    real(wp) :: overlap_max = 0.0_wp    !! largest overlap d_n of a contact point [m]
  end type contact_report_t

  !> Some of the bodies: those that a substep may move or wake.
  type :: acting_t
    integer :: n = 0
    integer, allocatable :: body(:)              !! (n) rising
  end type acting_t

  !> Pairs that touched, sorted.
  type :: met_t
    integer :: n = 0
    integer, allocatable :: a(:), b(:)   !! (n)
  end type met_t

  type, abstract :: contact_solver_t
    logical :: exact = .false.                   !! the surfaces touch, not contact spheres
    type(counterparts_t) :: counterparts
    type(contact_points_t) :: points             !! what touches now
    type(acting_t) :: acting
    type(displacements_t) :: displacements       !! the memory: part of the state of a run
    type(sleep_t) :: sleep                       !! blocks at rest: part of the state too
    type(lubrication_t) :: lubrication
    real(wp), allocatable :: share(:)            !! (n) of a contact force that moves the body [-]
    real(wp), allocatable :: steady(:, :)
      !! (6, n) force and torque all through the step [N, N m]
    type(loads_t) :: loads
    type(met_t) :: met                           !! pairs that touched in this step
  contains
    procedure(init_i), pass(contacts), deferred :: init
    procedure(advance_i), pass(contacts), deferred :: advance
    procedure, pass(contacts) :: detect => detect_in_steps
    procedure, pass(contacts) :: energy => energy_of_memory
  end type contact_solver_t

  abstract interface
    !> The solver of a case, without any contact point yet.
    subroutine init_i(input, blocks, contacts)
      import :: contact_input_t, blocks_t, contact_solver_t
      implicit none
      type(contact_input_t), intent(in) :: input
      type(blocks_t), intent(in) :: blocks
      class(contact_solver_t), intent(inout) :: contacts
    end subroutine init_i

    !> Move the bodies through a fluid step, and add what contact does to them to its loads.
    subroutine advance_i(walls, gravity, dt, contacts, blocks, report)
      import :: walls_t, wp, contact_solver_t, blocks_t, contact_report_t
      implicit none
      type(walls_t), intent(in) :: walls
      real(wp), intent(in) :: gravity(3)   !! [m/s2]
      real(wp), intent(in) :: dt           !! fluid step [s]
      class(contact_solver_t), intent(inout) :: contacts
      type(blocks_t), intent(inout) :: blocks
      type(contact_report_t), intent(inout) :: report
    end subroutine advance_i
  end interface

contains

  !> What is common to all solvers.
  subroutine start_solver(input, blocks, bounding_radius, contacts)
    type(contact_input_t), intent(in) :: input
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(in) :: bounding_radius(:)   !! (n) farthest point that touches [m]
    class(contact_solver_t), intent(inout) :: contacts

    call counterparts_init(blocks%n, contacts%counterparts)
    allocate (contacts%acting%body(blocks%n), source=0)
    call ensure_points(1, contacts%points)
    associate (loads => contacts%loads, n => blocks%n)
      allocate (loads%force(3, bed_counterpart:n), loads%torque(3, bed_counterpart:n), &
        loads%impulse(3, bed_counterpart:n), loads%twist(3, bed_counterpart:n), source=0.0_wp)
      allocate (contacts%share(n), contacts%steady(6, n), loads%peak(n), source=0.0_wp)
    end associate
    call sleep_init(input%sleep, bounding_radius, contacts%sleep)
    call reserve_displacements(1, contacts%displacements)
  end subroutine start_solver

  !> Find what touches at the start and at the end of a step: not for a solver that does so in its
  !! steps alone.
  subroutine detect_in_steps(walls, contacts, blocks)
    type(walls_t), intent(in) :: walls
    class(contact_solver_t), intent(inout) :: contacts
    type(blocks_t), intent(in) :: blocks

    associate (unused => walls%n, unused_too => contacts%met%n, unused_as_well => blocks%n)
    end associate
  end subroutine detect_in_steps

  !> Elastic energy of all contact points [J].
  pure function energy_of_memory(contacts) result(energy)
    class(contact_solver_t), intent(in) :: contacts
    real(wp) :: energy

    energy = energy_in_memory(contacts%displacements) + energy_in_memory(contacts%sleep%frozen)
  end function energy_of_memory

  !> Add pairs that touch to those that touched in this step.
  subroutine store_counterparts(points_a, points_b, met)
    integer, intent(in) :: points_a(:), points_b(:)       !! (points) sorted
    type(met_t), intent(inout) :: met
    integer :: t, m, a, b

    a = 0
    b = 0
    m = 1
    do t = 1, size(points_a)
      if (a == points_a(t) .and. b == points_b(t)) cycle
      a = points_a(t)
      b = points_b(t)
      do while (m <= met%n)
        if (.not. comes_before(met%a(m), met%b(m), 0, a, b, 0)) exit
        m = m + 1
      end do
      if (m <= met%n) then
        if (met%a(m) == a .and. met%b(m) == b) cycle
      end if
      call ensure_capacity(met%n + 1, met%a)
      call ensure_capacity(met%n + 1, met%b)
      met%a(m + 1:met%n + 1) = met%a(m:met%n)
      met%b(m + 1:met%n + 1) = met%b(m:met%n)
      met%a(m) = a
      met%b(m) = b
      met%n = met%n + 1
    end do
  end subroutine store_counterparts

  !> List the bodies chosen.
  pure subroutine list_bodies(chosen, acting)
    logical, intent(in) :: chosen(:)   !! (bodies)
    type(acting_t), intent(inout) :: acting
    integer :: b

    acting%n = 0
    do b = 1, size(chosen)
      if (.not. chosen(b)) cycle
      acting%n = acting%n + 1
      acting%body(acting%n) = b
    end do
  end subroutine list_bodies

  !> An equal part of the time left, no longer than allowed [s].
  pure function equal_substep(left, longest) result(dt_b)
    real(wp), intent(in) :: left, longest   !! [s]
    real(wp) :: dt_b

    dt_b = left/real(max(1, ceiling(left/longest*(1.0_wp - 1.0e-9_wp))), wp)
  end function equal_substep

  !> Energy of contact points whose energy is remembered [J].
  pure function energy_in_memory(displacements) result(energy)
    type(displacements_t), intent(in) :: displacements
    real(wp) :: energy
    integer :: g

    energy = 0.0_wp
    do g = 1, displacements%n
      energy = energy + displacements%energy(g)
    end do
  end function energy_in_memory

end module contact_solver_m
