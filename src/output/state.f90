!> What a run is at a moment: grid, time, fluid, solids, blocks and their contacts; and the one list
!! of everything that it must remember from step to step.
!!
!! `list_state` names each array once: restart files are written and read and checksums formed by
!! loops over its list. An array that is missing here is missing in all of them.
!!
!! Halo cells are not part of the state: whoever reads one fills them, and computes what follows
!! from the state (density, viscosity, links to the surfaces), before the next step.
module state_m
  use, intrinsic :: iso_c_binding, only: c_loc, c_f_pointer
  use kinds_m, only: wp, i8
  use parallel_m, only: global_sum
  use checksum_m, only: checksum_t
  use run_groups_m, only: side_name
  use grid_m, only: grid_t, unit_step
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use rigid_body_m, only: blocks_t
  use displacements_m, only: displacements_t, reserve_displacements
  use contacts_m, only: contact_solver_t
  use light_m, only: light_t
  use clock_m, only: clock_t
  use energy_m, only: energy_t
  implicit none
  private
  public :: run_state_t, item_t, state_list_t, list_state, state_groups, checksum_of_cells

  type :: run_state_t
    type(grid_t) :: grid
    type(clock_t) :: clock
    type(flow_t) :: flow   !! arrays not allocated in a dry run
    type(solid_geometry_t), allocatable :: solid   !! likewise
    type(blocks_t) :: blocks
    class(contact_solver_t), allocatable :: contacts
    type(light_t) :: light
    type(energy_t) :: energy
  end type run_state_t

  integer, parameter :: max_items = 100

  !> An array of the state: one of the pointers is associated. Cells are those of this process, with
  !! halo; all else is the same on all processes. The pointers hold as long as the arrays keep their
  !! place.
  type :: item_t
    character(:), allocatable :: name, units   !! name with its group
    logical :: on_faces = .false.              !! component d lives on lower faces of direction d
    integer, allocatable :: extent(:)          !! of the whole array
    real(wp), pointer, contiguous :: cells(:, :, :, :) => null()   !! (i, j, k, component)
    real(wp), pointer, contiguous :: reals(:) => null()            !! any rank, elements in a row
    integer, pointer, contiguous :: integers(:) => null()
    logical, pointer, contiguous :: logicals(:) => null()
  contains
    procedure :: part => owned_part
    procedure :: numbers
    procedure :: add_to_checksum
  end type item_t

  type :: state_list_t
    type(grid_t), pointer :: grid => null()
    integer :: n = 0
    type(item_t), allocatable :: item(:)   !! (`max_items`), not on the stack
  contains
    procedure, private :: add_scalar_field, add_vector_field, add_number, add_reals, add_matrix
    procedure, private :: add_whole_number, add_integers, add_logicals, begin
    generic :: add => add_scalar_field, add_vector_field, add_number, add_reals, add_matrix, &
      add_whole_number, add_integers, add_logicals
    procedure :: checksum, bytes
  end type state_list_t

  !> Groups of the names below, in their order.
  character(*), parameter :: state_groups(*) = &
    [character(9) :: '/clock', '/energy', '/flow', '/blocks', '/light', '/contacts']

contains

  !> The whole state; the list points into it, and holds until contact points come or go.
  subroutine list_state(state, list)
    type(run_state_t), intent(inout), target :: state
    type(state_list_t), intent(out) :: list

    list%grid => state%grid
    associate (clock => state%clock)
      call list%add('/clock/t', 's', clock%t)
      call list%add('/clock/dt', 's', clock%dt)
      call list%add('/clock/rest_began', 's', clock%rest_began)
      call list%add('/clock/step', clock%step)
      call list%add('/clock/n_rows', clock%rows%n)
      call list%add('/clock/n_frames', clock%frames%n)
    end associate
    associate (energy => state%energy)
      call list%add('/energy/put_in', 'J', energy%put_in)
      call list%add('/energy/set_free', 'J', energy%set_free)
      call list%add('/energy/excess', 'J', energy%excess)
      call list%add('/energy/kinetic', 'J', energy%parts%kinetic)
      call list%add('/energy/contact', 'J', energy%parts%contact)
      call list%add('/energy/potential', 'J', energy%parts%potential)
    end associate
    if (allocated(state%flow%u)) call list_flow(state%flow, state%solid, list)
    if (state%blocks%n > 0) call list_blocks(state%blocks, list)
    if (state%light%on) then   ! level, and what the water does to each block, sleepers too
      call list%add('/light/level', 'm', state%light%level)
      call list%add('/light/wet', 'm3', state%light%wet)
      call list%add('/light/force', 'N, N m', state%light%force)
    end if
    associate (contacts => state%contacts)
      call list_displacements('/contacts/', contacts%exact, contacts%displacements, list)
      call list%add('/contacts/quiet', 's', contacts%sleep%quiet)
      call list_displacements('/contacts/rest_', contacts%exact, contacts%sleep%frozen, list)
    end associate
  end subroutine list_state

  !> The open shares and solid shares follow from the poses of the blocks; they are here so that
  !! fluxes and volumes can be summed from a restart file alone.
  subroutine list_flow(flow, solid, list)
    type(flow_t), intent(in), target :: flow
    type(solid_geometry_t), intent(in), target :: solid
    type(state_list_t), intent(inout) :: list
    integer :: s, d

    call list%add('/flow/u', 'm/s', flow%u, on_faces=.false.)
    call list%add('/flow/p', 'Pa', flow%p)
    call list%add('/flow/uf', 'm/s', flow%uf, on_faces=.true.)
    call list%add('/flow/solid_flux', 'm3/s', flow%solid_flux, on_faces=.true.)
    call list%add('/flow/liquid', 'm3', flow%liquid)
    call list%add('/flow/fluid_volume', 'm3', flow%fluid_volume)
    call list%add('/flow/c', '1', flow%c)
    call list%add('/flow/alpha', '1', solid%alpha)
    call list%add('/flow/aperture', '1', solid%aperture, on_faces=.true.)
    call list%add('/flow/liquid_initial', 'm3', flow%liquid_initial)
    call list%add('/flow/liquid_inflow', 'm3', flow%liquid_inflow)
    do d = 1, 3   ! of each outflow the velocity that follows slowly
      do s = 1, 2
        if (flow%sides(s, d)%active) then
          call list%add('/flow/outflow_'//side_name(s, d), 'm/s', flow%sides(s, d)%mean)
        end if
      end do
    end do
  end subroutine list_flow

  subroutine list_blocks(blocks, list)
    type(blocks_t), intent(in), target :: blocks
    type(state_list_t), intent(inout) :: list

    call list%add('/blocks/present', blocks%present)
    call list%add('/blocks/asleep', blocks%asleep)
    call list%add('/blocks/status', blocks%status)
    call list%add('/blocks/still', blocks%still)
    call list%add('/blocks/release_time', 's', blocks%release_time)
    call list%add('/blocks/entry_time', 's', blocks%entry_time)
    call list%add('/blocks/exit_time', 's', blocks%exit_time)
    call list%add('/blocks/raised', 'm', blocks%raised)
    call list%add('/blocks/goal', 'm', blocks%goal)
    call list%add('/blocks/sling', 'N', blocks%sling)
    call list%add('/blocks/upright', '-', blocks%upright)
    call list%add('/blocks/position', 'm', blocks%x)
    call list%add('/blocks/lost', 'm', blocks%lost)
    call list%add('/blocks/quaternion', '1', blocks%q)
    call list%add('/blocks/velocity', 'm/s', blocks%v)
    call list%add('/blocks/angular_momentum', 'kg m2/s', blocks%l)
    call list%add('/blocks/angular_velocity', 'rad/s', blocks%omega)
    call list%add('/blocks/fluid_force', 'N', blocks%fluid_force)
    call list%add('/blocks/fluid_torque', 'N m', blocks%fluid_torque)
    call list%add('/blocks/lagged_force', 'N, N m', blocks%lagged_force)
    call list%add('/blocks/film_force', 'N, N m', blocks%film_force)
    call list%add('/blocks/contact_force', 'N', blocks%contact_force)
    call list%add('/blocks/contact_torque', 'N m', blocks%contact_torque)
    call list%add('/blocks/contacts', blocks%contacts)
    call list%add('/blocks/on_floor', blocks%on_floor)
    call list%add('/blocks/hardest', 'N', blocks%record%hardest)
    call list%add('/blocks/peak', 'N', blocks%record%peak)
    call list%add('/blocks/impact_speed', 'm/s', blocks%record%impact_speed)
    call list%add('/blocks/rest_since', 's', blocks%record%rest_since)
    call list%add('/blocks/approach', 'm, m/s', blocks%record%approach)
  end subroutine list_blocks

  !> The tangential displacements of contact points.
  subroutine list_displacements(name, with_edge, s, list)
    character(*), intent(in) :: name
    logical, intent(in) :: with_edge    !! the edge of the counterpart is remembered
    type(displacements_t), intent(inout), target :: s
    type(state_list_t), intent(inout) :: list

    call reserve_displacements(max(1, s%n), s)
    call list%add(name//'n', s%n)
    associate (n => s%n)
      call list%add(name//'a', s%a(:n))
      call list%add(name//'b', s%b(:n))
      call list%add(name//'key', s%id(:n))
      call list%add(name//'stretch', 'm', s%xi(:, :n))
      call list%add(name//'stiffness', 'N/m^gamma', s%k(:n))
      if (with_edge) call list%add(name//'edge', s%other(:n))
      call list%add(name//'force', 'N', s%force(:, :n))
      call list%add(name//'torque_a', 'N m', s%torque_a(:, :n))
      call list%add(name//'torque_b', 'N m', s%torque_b(:, :n))
      call list%add(name//'energy', 'J', s%energy(:n))
    end associate
  end subroutine list_displacements

  !> A cell array without components.
  subroutine add_scalar_field(self, name, units, a)
    class(state_list_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    real(wp), intent(in), target, contiguous :: a(:, :, :)   !! with halo

    call self%begin(name, units, [self%grid%n, 1])
    associate (item => self%item(self%n), first => self%grid%first, last => self%grid%last)
      item%cells(first(1):last(1), first(2):last(2), first(3):last(3), 1:1) => a
    end associate
  end subroutine add_scalar_field

  !> Three components of cells, or of faces: those of all directions are stored up to n + 1.
  subroutine add_vector_field(self, name, units, a, on_faces)
    class(state_list_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    real(wp), intent(in), target, contiguous :: a(:, :, :, :)   !! with halo
    logical, intent(in) :: on_faces

    call self%begin(name, units, [self%grid%n + merge(1, 0, on_faces), size(a, 4)])
    associate (item => self%item(self%n), first => self%grid%first)
      item%on_faces = on_faces
      item%cells(first(1):, first(2):, first(3):, 1:) => a
    end associate
  end subroutine add_vector_field

  subroutine add_number(self, name, units, x)
    class(state_list_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    real(wp), intent(in), target :: x

    call self%begin(name, units, [1])
    call c_f_pointer(c_loc(x), self%item(self%n)%reals, [1])
  end subroutine add_number

  subroutine add_reals(self, name, units, a)
    class(state_list_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    real(wp), intent(in), target, contiguous :: a(:)

    call self%begin(name, units, shape(a))
    self%item(self%n)%reals => a
  end subroutine add_reals

  subroutine add_matrix(self, name, units, a)
    class(state_list_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    real(wp), intent(in), target, contiguous :: a(:, :)

    call self%begin(name, units, shape(a))
    self%item(self%n)%reals(1:size(a)) => a
  end subroutine add_matrix

  subroutine add_whole_number(self, name, i)
    class(state_list_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(in), target :: i

    call self%begin(name, '', [1])
    call c_f_pointer(c_loc(i), self%item(self%n)%integers, [1])
  end subroutine add_whole_number

  subroutine add_integers(self, name, a)
    class(state_list_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(in), target, contiguous :: a(:)

    call self%begin(name, '', shape(a))
    self%item(self%n)%integers => a
  end subroutine add_integers

  !> Stored as 0 and 1.
  subroutine add_logicals(self, name, a)
    class(state_list_t), intent(inout) :: self
    character(*), intent(in) :: name
    logical, intent(in), target, contiguous :: a(:)

    call self%begin(name, '', shape(a))
    self%item(self%n)%logicals => a
  end subroutine add_logicals

  !> One more item, whose pointer is to be set.
  subroutine begin(self, name, units, extent)
    class(state_list_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: extent(:)

    if (.not. allocated(self%item)) allocate (self%item(max_items))
    if (self%n == max_items) error stop 'state_list: max_items is too small'
    self%n = self%n + 1
    associate (item => self%item(self%n))
      item%name = name
      item%units = units
      item%extent = extent
    end associate
  end subroutine begin

  !> The cells, or lower faces of direction d, that this process answers for: its own, and the upper
  !! side of the domain if it touches it. Every face of the domain belongs to one process.
  pure subroutine owned_part(self, grid, d, first, last)
    class(item_t), intent(in) :: self
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: d
    integer, intent(out) :: first(3), last(3)   !! global index

    first = grid%lo
    last = grid%hi
    if (self%on_faces .and. grid%hi(d) == grid%n(d)) last = last + unit_step(:, d)
  end subroutine owned_part

  !> Integers, or logicals as 0 and 1.
  pure function numbers(self) result(a)
    class(item_t), intent(in) :: self
    integer :: a(product(self%extent))

    if (associated(self%integers)) a = self%integers
    if (associated(self%logicals)) a = merge(1, 0, self%logicals)
  end function numbers

  !> Checksum of the whole state, the same on any number of processes.
  function checksum(self) result(text)
    class(state_list_t), intent(in) :: self
    character(:), allocatable :: text
    type(checksum_t) :: sum
    integer :: i

    do i = 1, self%n
      call self%item(i)%add_to_checksum(self%grid, sum)
    end do
    text = sum%text()
  end function checksum

  !> Add an item to a checksum; all processes call.
  subroutine add_to_checksum(self, grid, sum)
    class(item_t), intent(in) :: self
    type(grid_t), intent(in) :: grid
    type(checksum_t), intent(inout) :: sum

    call sum%add_text(self%name//self%units)
    if (associated(self%cells)) then
      call sum%add_integers(4, transfer(checksum_of_cells(self, grid), [0]))
    else if (associated(self%reals)) then
      call sum%add_reals(size(self%reals), self%reals)
    else
      call sum%add_integers(product(self%extent), self%numbers())
    end if
  end subroutine add_to_checksum

  !> Two sums over all processes of scrambled bits, each element with its own place in it, so that
  !! the order of summation does not matter but the place of every element does.
  function checksum_of_cells(item, grid) result(halves)
    type(item_t), intent(in) :: item
    type(grid_t), intent(in) :: grid
    integer(i8) :: halves(2)   !! of the lower and the upper 32 bits
    integer(i8), parameter :: lower_half = 2_i8**32 - 1_i8
    integer(i8) :: place, bits
    integer :: first(3), last(3), d, i, j, k

    halves = 0
    do d = 1, size(item%cells, 4)
      call item%part(grid, d, first, last)
      do k = first(3), last(3)
        do j = first(2), last(2)
          place = ((int(d, i8)*(grid%n(3) + 2) + k)*(grid%n(2) + 2) + j)*(grid%n(1) + 2)
          do i = first(1), last(1)
            bits = scrambled(ieor(transfer(item%cells(i, j, k, d), bits), scrambled(place + i)))
            halves(1) = halves(1) + iand(bits, lower_half)
            halves(2) = halves(2) + ishft(bits, -32)
          end do
        end do
      end do
    end do
    call global_sum(halves)
  end function checksum_of_cells

  !> Spread a change of one bit over many; different bits stay different.
  elemental function scrambled(bits) result(b)
    integer(i8), intent(in) :: bits
    integer(i8) :: b

    b = ieor(bits, ishft(bits, 13))
    b = ieor(b, ishft(b, -7))
    b = ieor(b, ishft(b, 17))
  end function scrambled

  !> Bytes that the whole state takes in a file, at most.
  pure function bytes(self) result(n)
    class(state_list_t), intent(in) :: self
    integer(i8) :: n
    integer, parameter :: header = 1024   !! what HDF5 keeps about an item, generously [bytes]
    integer :: i

    n = 0
    do i = 1, self%n
      associate (item => self%item(i))
        n = n + header + len(item%name//item%units) + product(int(item%extent, i8)) &
          *merge(8, 4, associated(item%cells) .or. associated(item%reals))
      end associate
    end do
  end function bytes

end module state_m
