!> The one list of everything that a run must remember from step to step.
!!
!! `visit_state` shows each array to a visitor: the restart file is written and read, checksums are
!! formed, numbers that are none are searched, and two states are compared, all by the same walk. An
!! array that is missing here is missing in every one of them.
!!
!! Halo cells are not part of the state: whoever reads one fills them, and computes what follows
!! from the state (density, viscosity, links to the surfaces), before the next step.
module state_m
  use kinds_m, only: wp
  use grid_m, only: grid_t, n_halo, unit_step
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use rigid_body_m, only: blocks_t
  use contacts_m, only: contacts_t
  use light_m, only: light_t
  use displacements_m, only: displacements_t, reserve_displacements
  use clock_m, only: clock_t
  use run_state_m, only: run_state_t
  implicit none
  private
  public :: state_visitor_t, visit_state, owned_part, pack_part, unpack_part, state_groups

  !> Groups of the names below, in their order.
  character(*), parameter :: state_groups(*) = &
    [character(9) :: '/clock', '/energy', '/flow', '/blocks', '/light', '/contacts']

  integer, parameter :: max_displacements = 100000000

  type, abstract :: state_visitor_t
  contains
    procedure(visit_cells), deferred :: cells
    procedure(visit_reals), deferred :: reals
    procedure(visit_integers), deferred :: integers
    procedure :: real_number, whole_number, logicals
  end type state_visitor_t

  abstract interface
    !> An array over the cells or lower faces of the grid; every process shows its part.
    subroutine visit_cells(self, name, units, grid, faces, m, a)
      import :: state_visitor_t, grid_t, wp, n_halo
      implicit none
      class(state_visitor_t), intent(inout) :: self
      character(*), intent(in) :: name, units
      type(grid_t), intent(in) :: grid
      logical, intent(in) :: faces   !! component d lives on the lower faces of direction d
      integer, intent(in) :: m       !! components
      real(wp), intent(inout) :: a(grid%first(1):grid%last(1), &
                                   grid%first(2):grid%last(2), &
                                   grid%first(3):grid%last(3), m)
    end subroutine visit_cells

    !> Reals that are the same on every process.
    subroutine visit_reals(self, name, units, extent, a)
      import :: state_visitor_t, wp
      implicit none
      class(state_visitor_t), intent(inout) :: self
      character(*), intent(in) :: name, units
      integer, intent(in) :: extent(:)
      real(wp), intent(inout) :: a(product(extent))
    end subroutine visit_reals

    !> Integers that are the same on every process.
    subroutine visit_integers(self, name, extent, a)
      import :: state_visitor_t
      implicit none
      class(state_visitor_t), intent(inout) :: self
      character(*), intent(in) :: name
      integer, intent(in) :: extent(:)
      integer, intent(inout) :: a(product(extent))
    end subroutine visit_integers
  end interface

contains

  !> Show the whole state to a visitor, which may change it.
  subroutine visit_state(visitor, state)
    class(state_visitor_t), intent(inout) :: visitor
    type(run_state_t), intent(inout) :: state

    call visit_clock(visitor, state%clock)
    call visitor%real_number('/energy/put_in', 'J', state%energy%put_in)
    call visitor%real_number('/energy/set_free', 'J', state%energy%set_free)
    call visitor%real_number('/energy/excess', 'J', state%energy%excess)
    associate (parts => state%energy%parts)
      call visitor%real_number('/energy/kinetic', 'J', parts%kinetic)
      call visitor%real_number('/energy/contact', 'J', parts%contact)
      call visitor%real_number('/energy/potential', 'J', parts%potential)
    end associate
    if (allocated(state%flow%u)) call visit_flow(visitor, state%grid, state%flow, state%solid)
    call visit_blocks(visitor, state%blocks)
    if (state%light%on) call visit_light(visitor, state%light)
    call visit_contacts(visitor, state%contacts)
  end subroutine visit_state

  subroutine visit_clock(visitor, clock)
    class(state_visitor_t), intent(inout) :: visitor
    type(clock_t), intent(inout) :: clock

    call visitor%real_number('/clock/t', 's', clock%t)
    call visitor%real_number('/clock/dt', 's', clock%dt)
    call visitor%real_number('/clock/rest_began', 's', clock%rest_began)
    call visitor%whole_number('/clock/step', clock%step)
    call visitor%whole_number('/clock/n_rows', clock%n_rows)
    call visitor%whole_number('/clock/n_frames', clock%n_frames)
  end subroutine visit_clock

  !> The open shares and solid shares follow from the poses of the blocks; they are here so that
  !! fluxes and volumes can be summed from a restart file alone.
  subroutine visit_flow(visitor, grid, flow, solid)
    class(state_visitor_t), intent(inout) :: visitor
    type(grid_t), intent(in) :: grid
    type(flow_t), intent(inout) :: flow
    type(solid_geometry_t), intent(inout) :: solid

    call visitor%cells('/flow/u', 'm/s', grid, .false., 3, flow%u)
    call visitor%cells('/flow/p', 'Pa', grid, .false., 1, flow%p)
    call visitor%cells('/flow/uf', 'm/s', grid, .true., 3, flow%uf)
    call visitor%cells('/flow/solid_flux', 'm3/s', grid, .true., 3, flow%solid_flux)
    call visitor%cells('/flow/liquid', 'm3', grid, .false., 1, flow%liquid)
    call visitor%cells('/flow/fluid_volume', 'm3', grid, .false., 1, flow%fluid_volume)
    call visitor%cells('/flow/c', '1', grid, .false., 1, flow%c)
    call visitor%cells('/flow/alpha', '1', grid, .false., 1, solid%alpha)
    call visitor%cells('/flow/aperture', '1', grid, .true., 3, solid%aperture)
    call visitor%real_number('/flow/liquid_initial', 'm3', flow%liquid_initial)
    call visitor%real_number('/flow/liquid_inflow', 'm3', flow%liquid_inflow)
    call visit_outflows(visitor, flow)
  end subroutine visit_flow

  !> The slowly following velocity of each outflow.
  subroutine visit_outflows(visitor, flow)
    class(state_visitor_t), intent(inout) :: visitor
    type(flow_t), intent(inout) :: flow
    character(5), parameter :: name(2, 3) = reshape(['x_min', 'x_max', 'y_min', 'y_max', &
                                                     'z_min', 'z_max'], [2, 3])
    integer :: s, d

    do d = 1, 3
      do s = 1, 2
        if (.not. flow%sides(s, d)%active) cycle
        associate (mean => flow%sides(s, d)%mean)
          call visitor%reals('/flow/outflow_'//name(s, d), 'm/s', shape(mean), mean)
        end associate
      end do
    end do
  end subroutine visit_outflows

  subroutine visit_blocks(visitor, blocks)
    class(state_visitor_t), intent(inout) :: visitor
    type(blocks_t), intent(inout) :: blocks

    associate (n => blocks%n)
      if (n == 0) return
      call visitor%logicals('/blocks/present', n, blocks%present)
      call visitor%logicals('/blocks/asleep', n, blocks%asleep)
      call visitor%integers('/blocks/status', [n], blocks%status)
      call visitor%logicals('/blocks/still', n, blocks%still)
      call visitor%reals('/blocks/release_time', 's', [n], blocks%release_time)
      call visitor%reals('/blocks/entry_time', 's', [n], blocks%entry_time)
      call visitor%reals('/blocks/raised', 'm', [n], blocks%raised)
      call visitor%reals('/blocks/position', 'm', [3, n], blocks%x)
      call visitor%reals('/blocks/quaternion', '1', [4, n], blocks%q)
      call visitor%reals('/blocks/velocity', 'm/s', [3, n], blocks%v)
      call visitor%reals('/blocks/angular_momentum', 'kg m2/s', [3, n], blocks%l)
      call visitor%reals('/blocks/angular_velocity', 'rad/s', [3, n], blocks%omega)
      call visitor%reals('/blocks/fluid_force', 'N', [3, n], blocks%fluid_force)
      call visitor%reals('/blocks/fluid_torque', 'N m', [3, n], blocks%fluid_torque)
      call visitor%reals('/blocks/lagged_force', 'N, N m', [6, n], blocks%lagged_force)
      call visitor%reals('/blocks/contact_force', 'N', [3, n], blocks%contact_force)
      call visitor%reals('/blocks/contact_torque', 'N m', [3, n], blocks%contact_torque)
      call visitor%integers('/blocks/contacts', [n], blocks%contacts)
      call visitor%integers('/blocks/on_floor', [n], blocks%on_floor)
    end associate
  end subroutine visit_blocks

  !> Level, and what the water does to each block, sleepers too.
  subroutine visit_light(visitor, light)
    class(state_visitor_t), intent(inout) :: visitor
    type(light_t), intent(inout) :: light

    call visitor%real_number('/light/level', 'm', light%level)
    call visitor%reals('/light/wet', 'm3', [size(light%wet)], light%wet)
    call visitor%reals('/light/force', 'N, N m', [6, size(light%wet)], light%force)
  end subroutine visit_light

  !> What the contacts remember: tangential displacements, at work and at rest, and how long blocks
  !! have been slow.
  subroutine visit_contacts(visitor, contacts)
    class(state_visitor_t), intent(inout) :: visitor
    type(contacts_t), intent(inout) :: contacts

    call visit_displacements(visitor, '/contacts/', contacts%by_impulses, contacts%by_impulses, &
                       contacts%displacements)
    associate (quiet => contacts%sleep%quiet, rest => contacts%sleep%rest)
      call visitor%reals('/contacts/quiet', 's', [size(quiet)], quiet)
      call visit_displacements(visitor, '/contacts/rest_', .true., contacts%by_impulses, rest)
    end associate
  end subroutine visit_contacts

  !> A list of tangential displacements.
  subroutine visit_displacements(visitor, name, with_force, with_edge, s)
    class(state_visitor_t), intent(inout) :: visitor
    character(*), intent(in) :: name
    logical, intent(in) :: with_force   !! it remembers forces, torques and energies
    logical, intent(in) :: with_edge    !! and the edge of the counterpart
    type(displacements_t), intent(inout) :: s

    call visitor%whole_number(name//'n', s%n)
    if (s%n < 0 .or. s%n > max_displacements) s%n = 0   ! a damaged file: its checksum shows it
    call reserve_displacements(max(1, s%n), s)
    call visitor%integers(name//'a', [s%n], s%a)
    call visitor%integers(name//'b', [s%n], s%b)
    call visitor%integers(name//'key', [s%n], s%id)
    call visitor%reals(name//'stretch', 'm', [3, s%n], s%xi)
    call visitor%reals(name//'stiffness', 'N/m^gamma', [s%n], s%k)
    if (with_edge) call visitor%integers(name//'edge', [s%n], s%other)
    if (.not. with_force) return
    call visitor%reals(name//'force', 'N', [3, s%n], s%force)
    call visitor%reals(name//'torque_a', 'N m', [3, s%n], s%torque_a)
    call visitor%reals(name//'torque_b', 'N m', [3, s%n], s%torque_b)
    call visitor%reals(name//'energy', 'J', [s%n], s%energy)
  end subroutine visit_displacements

  subroutine real_number(self, name, units, x)
    class(state_visitor_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    real(wp), intent(inout) :: x
    real(wp) :: a(1)

    a = x
    call self%reals(name, units, [1], a)
    x = a(1)
  end subroutine real_number

  subroutine whole_number(self, name, n)
    class(state_visitor_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(inout) :: n
    integer :: a(1)

    a = n
    call self%integers(name, [1], a)
    n = a(1)
  end subroutine whole_number

  !> Logicals, shown as 0 and 1.
  subroutine logicals(self, name, n, yes)
    class(state_visitor_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: n
    logical, intent(inout) :: yes(n)
    integer :: a(n)

    a = merge(1, 0, yes)
    call self%integers(name, [n], a)
    yes = a == 1
  end subroutine logicals

  !> The cells, or lower faces of direction d, that this process answers for: its own, and the upper
  !! side of the domain if it touches it. Every face of the domain belongs to one process.
  pure subroutine owned_part(grid, faces, d, first, last)
    type(grid_t), intent(in) :: grid
    logical, intent(in) :: faces
    integer, intent(in) :: d
    integer, intent(out) :: first(3), last(3)   !! global index

    first = grid%lo
    last = grid%hi
    if (faces .and. grid%hi(d) == grid%n(d)) last = last + unit_step(:, d)
  end subroutine owned_part

  !> Elements first:last of an array with halo, in a row, x fastest.
  pure subroutine pack_part(grid, a, first, last, row)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: a(grid%first(1):, grid%first(2):, grid%first(3):)
    integer, intent(in) :: first(3), last(3)
    real(wp), intent(out) :: row(:)
    integer :: j, k, n, at

    n = last(1) - first(1) + 1
    at = 0
    do k = first(3), last(3)
      do j = first(2), last(2)
        row(at + 1:at + n) = a(first(1):last(1), j, k)
        at = at + n
      end do
    end do
  end subroutine pack_part

  !> The reverse of `pack_part`.
  pure subroutine unpack_part(grid, row, first, last, a)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: row(:)
    integer, intent(in) :: first(3), last(3)
    real(wp), intent(inout), contiguous :: a(grid%first(1):, grid%first(2):, grid%first(3):)
    integer :: j, k, n, at

    n = last(1) - first(1) + 1
    at = 0
    do k = first(3), last(3)
      do j = first(2), last(2)
        a(first(1):last(1), j, k) = row(at + 1:at + n)
        at = at + n
      end do
    end do
  end subroutine unpack_part

end module state_m
