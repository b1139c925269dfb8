!> What touches now or soon, found by the model of the case, and how each contact point responds.
module contact_detection_m
  use kinds_m, only: wp
  use case_types_m, only: contact_input_t
  use rigid_body_m, only: blocks_t
  use walls_m, only: walls_t
  use contact_points_m, only: contact_points_t, groups_t, ensure_points, set_apart, &
    form_groups
  use contact_spheres_m, only: contact_spheres_t, contact_spheres_init, find_sphere_points
  use contact_surface_m, only: contact_surface_t, contact_surface_init, find_surface_points
  use contact_law_m, only: contact_law_t
  use contact_laws_m, only: choose_law
  use counterparts_m, only: counterparts_t, counterparts_init, update_motion, update_inertia
  use contact_response_m, only: response_t, respond, add_frequencies, highest_frequency2, &
    bound_by_sums
  implicit none
  private
  public :: contact_detection_t, detection_init, detect_contacts, list_bodies

  !> The bodies that a substep may move or wake: those awake, and those asleep that something
  !! touches. What nothing touches costs nothing in a substep.
  type :: acting_t
    integer :: n = 0
    integer, allocatable :: body(:)              !! (n) rising
  end type acting_t

  type :: contact_detection_t
    class(contact_law_t), allocatable :: law
    logical :: exact = .false.                   !! the exact surfaces touch, not contact spheres
    type(contact_spheres_t) :: spheres
    type(contact_surface_t) :: surface
    real(wp), allocatable :: bounding_radius(:)  !! (n) farthest point that touches [m]
    real(wp) :: smallest = 0.0_wp                !! smallest d_s of eq. (6) [m]
    real(wp) :: unlisted_gap = 0.0_wp            !! way of bodies that are not near to touch [m]
    type(counterparts_t) :: counterparts
    type(acting_t) :: acting                     !! bodies that are awake or touch
    type(contact_points_t) :: points
    type(contact_points_t) :: soon               !! those that may come before the substep ends
    type(groups_t) :: groups
    type(response_t) :: response, response_soon
    real(wp) :: frequency2 = 0.0_wp              !! square of the highest frequency, or above [1/s2]
    real(wp) :: sum_frequency2 = 0.0_wp          !! by `bound_by_sums` [1/s2]
    real(wp) :: damping = 0.0_wp                 !! rate of the dashpots, likewise [1/s]
  end type contact_detection_t

contains

  !> The contact law and model of a case, without any contact point yet.
  subroutine detection_init(input, longest_substep, blocks, self)
    type(contact_input_t), intent(in) :: input
    real(wp), intent(in) :: longest_substep      !! [s]
    type(blocks_t), intent(in) :: blocks
    type(contact_detection_t), intent(out) :: self

    call choose_law(input, self%law)
    select case (input%model)
    case ('surface'); self%exact = .true.
    case ('spheres'); self%exact = .false.
    case default; error stop 'detection_init: no such model'
    end select
    if (self%exact) then
      call contact_surface_init(input%courant_max, longest_substep, blocks, self%surface)
      self%bounding_radius = self%surface%bounding_radius
      self%smallest = self%surface%smallest
      self%unlisted_gap = self%surface%unlisted_gap
    else
      call contact_spheres_init(input%courant_max, blocks, self%spheres)
      self%bounding_radius = self%spheres%bounding_radius
      self%smallest = self%spheres%smallest
      self%unlisted_gap = self%spheres%unlisted_gap
    end if
    call counterparts_init(blocks, self%counterparts)
    allocate (self%acting%body(blocks%n), source=0)
    call ensure_points(1, self%points)
    call ensure_points(1, self%soon)
  end subroutine detection_init

  !> Find what touches at the present poses, how each contact point responds, and how stiff all is
  !! together, counting also what may touch within a time `ahead`.
  subroutine detect_contacts(walls, blocks, ahead, self)
    type(walls_t), intent(in) :: walls
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(in) :: ahead   !! [s]
    type(contact_detection_t), intent(inout) :: self
    logical :: acts(blocks%n)
    integer :: t

    if (self%exact) then
      call find_surface_points(walls, blocks, ahead, self%surface, self%points)
    else
      call find_sphere_points(walls, blocks, ahead, self%spheres, self%points)
    end if
    acts = blocks%present .and. .not. blocks%asleep
    do t = 1, self%points%n   ! also sleepers that are touched, or may be soon
      acts(self%points%item(t)%a) = .true.
      if (self%points%item(t)%b > 0) acts(self%points%item(t)%b) = .true.
    end do
    call list_bodies(acts, self%acting)
    call set_apart(self%points, self%soon)
    call form_groups(self%points, self%groups)
    self%frequency2 = 0.0_wp
    self%sum_frequency2 = 0.0_wp
    self%damping = 0.0_wp
    associate (acting => self%acting%body(:self%acting%n))
      call update_motion(blocks, acting, self%counterparts)
      if (self%points%n + self%soon%n == 0) return
      call update_inertia(blocks, acting, self%counterparts)
    end associate
    call respond(self%points, self%law, self%counterparts, self%response)
    if (self%soon%n > 0) then
      call respond(self%soon, self%law, self%counterparts, self%response_soon)
      call add_frequencies(self%points, self%soon, self%response, self%response_soon)
      self%frequency2 = highest_frequency2(self%soon, self%response_soon)
    end if
    self%frequency2 = max(self%frequency2, highest_frequency2(self%points, self%response))
    call bound_by_sums(self%points, self%response, self%sum_frequency2, self%damping)
  end subroutine detect_contacts

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

end module contact_detection_m
