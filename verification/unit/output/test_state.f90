!> The list of the state: nothing is missing, every change shows, sums do not know the ranks, and a
!! restart file fits where it is planned. What it holds: `verification/test_bits.py`.
! ranks: 2 3
module test_state_m
  use check_m, only: check, wp, i8
  use parallel_m, only: nproc, is_root
  use restart_m, only: write_restart
  use file_space_m, only: bytes_for_change
  use grid_m, only: grid_t
  use state_m, only: list_state, state_list_t, checksum_of_cells
  use displacements_m, only: displacements_t
  use checksum_m, only: checksum_t
  use case_input_m, only: parameters_text
  use world_m, only: world_t, set_up, body
  implicit none
  private
  public :: test_state

contains

  subroutine test_state()
    call test_every_change_shows()
    call test_checksum_of_cells()
    call test_owned_faces()
    call test_size()
  end subroutine test_state

  !> Change one number of each array in turn: that array has another checksum, none before it in the
  !! list, and so has the state; after the change is undone both agree again.
  subroutine test_every_change_shows()
    type(world_t) :: s
    integer, parameter :: n_changes = 35
    integer :: i
    character(:), allocatable :: name, before
    character(18), allocatable :: each(:)

    call make_sample(0.5_wp, s)
    before = checksum(s)
    each = checksums_of(s)
    do i = 1, n_changes
      call change(s, i, name)
      call check('a change of '//name//' is seen and named', first_change(each, s) == name)
      call check('a change of '//name//' alters the checksum', checksum(s) /= before)
      call make_sample(0.5_wp, s)
    end do
    call check('equal states are equal', first_change(each, s) == 'nothing')
    call check('equal states have equal checksums', checksum(s) == before)
  end subroutine test_every_change_shows

  function checksum(s) result(text)
    type(world_t), intent(inout) :: s
    character(:), allocatable :: text
    type(state_list_t) :: list

    call list_state(s%run_state_t, list)
    text = list%checksum()
  end function checksum

  !> Change number i of the list of all things that a run must remember.
  subroutine change(s, i, name)
    type(world_t), intent(inout) :: s
    integer, intent(in) :: i
    character(:), allocatable, intent(out) :: name
    integer :: at(3), top(3)

    at = s%grid%lo
    top = s%grid%hi
    select case (i)
    case (1); name = '/clock/t'; s%clock%t = nearest(s%clock%t, 1.0_wp)
    case (2); name = '/clock/dt'; s%clock%dt = nearest(s%clock%dt, 1.0_wp)
    case (3); name = '/clock/step'; s%clock%step = s%clock%step + 1
    case (4); name = '/clock/n_rows'; s%clock%rows%n = s%clock%rows%n + 1
    case (5); name = '/clock/n_frames'; s%clock%frames%n = s%clock%frames%n + 1
    case (6); name = '/clock/rest_began'; s%clock%rest_began = 0.0_wp
    case (7); name = '/flow/u'; call touch(s%flow%u(at(1), at(2), at(3), 2))
    case (8); name = '/flow/p'; call touch(s%flow%p(top(1), top(2), top(3)))
    case (9); name = '/flow/uf'; call touch(s%flow%uf(at(1) + 1, at(2), at(3), 3))
    case (10); name = '/flow/solid_flux'; call touch(s%flow%solid_flux(at(1), at(2), at(3), 1))
    case (11); name = '/flow/liquid'; call touch(s%flow%liquid(at(1), at(2), at(3)))
    case (12); name = '/flow/fluid_volume'; call touch(s%flow%fluid_volume(at(1), at(2), at(3)))
    case (13); name = '/flow/c'; call touch(s%flow%c(at(1), at(2), at(3)))
    case (14); name = '/flow/alpha'; call touch(s%solid%alpha(at(1), at(2), at(3)))
    case (15); name = '/flow/aperture'; call touch(s%solid%aperture(at(1), at(2), at(3), 2))
    case (16); name = '/flow/liquid_initial'; call touch(s%flow%liquid_initial)
    case (17); name = '/flow/liquid_inflow'; call touch(s%flow%liquid_inflow)
    case (18); name = '/blocks/present'; s%blocks%present(3) = .not. s%blocks%present(3)
    case (19); name = '/blocks/release_time'; call touch(s%blocks%release_time(3))
    case (20); name = '/blocks/position'; call touch(s%blocks%x(3, 2))
    case (21); name = '/blocks/quaternion'; call touch(s%blocks%q(4, 2))
    case (22); name = '/blocks/velocity'; call touch(s%blocks%v(1, 1))
    case (23); name = '/blocks/angular_momentum'; s%blocks%l(3, 3) = 1.0_wp
    case (24); name = '/blocks/fluid_force'; s%blocks%fluid_force(3, 3) = 1.0_wp
    case (25); name = '/blocks/contact_torque'; s%blocks%contact_torque(1, 3) = 1.0_wp
    case (26); name = '/blocks/on_floor'; s%blocks%on_floor(2) = 1
    case (27); name = '/contacts/n'; s%contacts%displacements%n = 3
    case (28); name = '/contacts/key'; s%contacts%displacements%id(4) = 11
    case (29); name = '/contacts/stretch'; call touch(s%contacts%displacements%xi(3, 4))
    case (30); name = '/contacts/quiet'; call touch(s%contacts%sleep%quiet(1))
    case (31); name = '/contacts/rest_stretch'; call touch(s%contacts%sleep%frozen%xi(2, 3))
    case (32); name = '/contacts/rest_torque_b'; call touch(s%contacts%sleep%frozen%torque_b(1, 1))
    case (33); name = '/contacts/rest_energy'; call touch(s%contacts%sleep%frozen%energy(3))
    case (34); name = '/blocks/asleep'; s%blocks%asleep(2) = .not. s%blocks%asleep(2)
    case default; name = '/contacts/stiffness'; call touch(s%contacts%displacements%k(1))
    end select
  end subroutine change

  !> The smallest change there is.
  subroutine touch(x)
    real(wp), intent(inout) :: x

    x = nearest(x, 1.0_wp)
  end subroutine touch

  !> The sum over the blocks of all processes is that of the domain; exchanged elements show.
  subroutine test_checksum_of_cells()
    type(world_t), target :: s
    type(grid_t), target :: whole
    type(state_list_t) :: list, of_whole
    real(wp), allocatable, target :: a(:, :, :, :)
    integer(i8) :: all_cells(2)

    call make_sample(0.0_wp, s)
    whole = s%grid
    call whole%own([1, 1, 1], whole%n)
    allocate (a(whole%first(1):whole%last(1), whole%first(2):whole%last(2), &
                whole%first(3):whole%last(3), 3))
    call fill_cells(0.3_wp, whole, 3, a)
    of_whole%grid => whole
    call of_whole%add('uf', 'm/s', a, on_faces=.true.)
    list%grid => s%grid
    call list%add('uf', 'm/s', s%flow%uf, on_faces=.true.)
    all_cells = checksum_of_cells(of_whole%item(1), whole)   ! every process adds all of it
    call check('the checksum does not know the processes', &
      all(checksum_of_cells(list%item(1), s%grid)*nproc() == all_cells))
    a(4:5, 3:4, 3, 1) = transpose(a(4:5, 3:4, 3, 1))
    call check('two elements exchanged alter the checksum', &
      any(checksum_of_cells(of_whole%item(1), whole) /= all_cells))
  end subroutine test_checksum_of_cells

  !> The parts of all processes cover every face of the domain once.
  subroutine test_owned_faces()
    type(world_t), target :: s
    type(state_list_t) :: list
    integer :: first(3), last(3)

    call make_sample(0.0_wp, s)
    list%grid => s%grid
    call list%add('uf', 'm/s', s%flow%uf, on_faces=.true.)
    call list%item(1)%part(s%grid, 3, first, last)
    call check('faces of z end at the upper side', last(3), merge(s%grid%n(3) + 1, s%grid%hi(3), &
      s%grid%hi(3) == s%grid%n(3)))
    call check('those of x at the last cell', last(1), s%grid%hi(1))
  end subroutine test_owned_faces

  !> The room asked for before a restart file is written is enough, and not much too large.
  subroutine test_size()
    type(world_t) :: s
    type(state_list_t) :: list
    character(:), allocatable :: parameters, message
    integer(i8) :: there, capacity
    integer :: info, unit

    call make_sample(0.5_wp, s)
    parameters = parameters_text(s%case)
    call write_restart('sample.h5', s%case%text, parameters, s%run_state_t, info, message)
    call check('a restart file is written', info, 0)
    call list_state(s%run_state_t, list)
    if (.not. is_root()) return
    capacity = list%bytes() + len(s%case%text) + len(parameters) + bytes_for_change
    open (newunit=unit, file='sample.h5', status='old')
    inquire (unit, size=there)
    close (unit, status='delete')
    call check('a restart file fits into the room asked for', there <= capacity)
    call check('the room is not much too large', capacity <= 2*there)
  end subroutine test_size

  !> A small tank with three blocks; `start` moves every number of the state.
  subroutine make_sample(start, s)
    real(wp), intent(in) :: start
    type(world_t), intent(out) :: s
    real(wp), parameter :: q(4) = [0.5_wp, -0.5_wp, 0.5_wp, 0.5_wp]
    integer :: b

    call set_up('&run t_end=2/ &grid cells=16,6,20 length=.16,.06,.2/ &shape name="block" ' &
      //'kind="box" size=.02,.015,.01/ &shape name="hexapod" kind="hexapod" size=.01/ ' &
      //body('block', [0.04_wp, 0.03_wp, 0.1_wp], q=q, more='fixed=T') &
      //body('block', [0.08_wp, 0.03_wp, 0.1_wp], q=q) &
      //body('hexapod', [0.12_wp, 0.03_wp, 0.1_wp], q=q, more='release_time=1.5'), s)
    s%clock%t = 1.25_wp
    s%clock%dt = 0.01_wp
    s%clock%step = 130
    s%clock%rows%n = 131
    s%clock%frames%n = 13
    call fill_cells(start + 0.1_wp, s%grid, 3, s%flow%u)
    call fill_cells(start + 0.2_wp, s%grid, 1, s%flow%p)
    call fill_cells(start + 0.3_wp, s%grid, 3, s%flow%uf)
    call fill_cells(start + 0.4_wp, s%grid, 3, s%flow%solid_flux)
    call fill_cells(start + 0.5_wp, s%grid, 1, s%flow%liquid)
    call fill_cells(start + 0.6_wp, s%grid, 1, s%flow%fluid_volume)
    call fill_cells(start + 0.7_wp, s%grid, 1, s%flow%c)
    call fill_cells(start + 0.8_wp, s%grid, 1, s%solid%alpha)
    call fill_cells(start + 0.9_wp, s%grid, 3, s%solid%aperture)
    s%flow%liquid_initial = start + 1.0_wp
    s%flow%liquid_inflow = start + 2.0_wp
    do b = 1, s%blocks%n
      s%blocks%v(:, b) = start + [0.1_wp, 0.2_wp, 0.3_wp]*b
      s%blocks%contact_force(:, b) = start + [1.1_wp, 1.2_wp, 1.3_wp]*b
      s%blocks%contacts(b) = b
    end do
    call fill_displacements(start, 4, s%contacts%displacements)
    call fill_displacements(2*start, 3, s%contacts%sleep%frozen)
    s%contacts%sleep%quiet = [start, 0.0_wp, 1.0_wp]
  end subroutine make_sample

  !> The first n of four.
  subroutine fill_displacements(start, n, s)
    real(wp), intent(in) :: start
    integer, intent(in) :: n
    type(displacements_t), intent(inout) :: s
    integer :: i

    s%n = n
    s%a = [2, 2, 3, 3]
    s%b = [1, -1, 1, 2]
    s%id = [7, 8, 9, 10]
    s%other = [0, 11, 12, 0]
    s%k = [(start + 0.1_wp*i, i=1, 4)]
    s%energy = 3*s%k
    s%xi = reshape([(start + 0.01_wp*i, i=1, 12)], [3, 4])
    s%force = 2*s%xi
    s%torque_a = 3*s%xi
    s%torque_b = 4*s%xi
  end subroutine fill_displacements

  !> Fill an array, halo included, with numbers that tell the cell.
  subroutine fill_cells(start, grid, m, a)
    real(wp), intent(in) :: start
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: m
    real(wp), intent(out) &
      :: a(grid%first(1):grid%last(1), grid%first(2):grid%last(2), grid%first(3):grid%last(3), m)
    integer :: i, j, k, d

    do concurrent (d=1:m, k=grid%first(3):grid%last(3), &
      j=grid%first(2):grid%last(2), i=grid%first(1):grid%last(1))
      a(i, j, k, d) = start + sin(1.0_wp*i + 100.0_wp*j + 10000.0_wp*k + 0.37_wp*d)
    end do
  end subroutine fill_cells

  !> A checksum of each item of the state; all processes call.
  function checksums_of(s) result(text)
    type(world_t), intent(inout) :: s
    character(18), allocatable :: text(:)
    type(state_list_t) :: list
    type(checksum_t) :: sum
    integer :: i

    call list_state(s%run_state_t, list)
    allocate (text(list%n))
    do i = 1, list%n
      sum = checksum_t()
      call list%item(i)%add_to_checksum(list%grid, sum)
      text(i) = sum%text()
    end do
  end function checksums_of

  !> Name of the first item whose checksum has changed, or 'nothing'.
  function first_change(before, s) result(name)
    character(18), intent(in) :: before(:)   !! of `checksums_of`
    type(world_t), intent(inout) :: s
    character(:), allocatable :: name
    type(state_list_t) :: list
    integer :: i

    call list_state(s%run_state_t, list)
    i = findloc(checksums_of(s) /= before, .true., 1)
    name = 'nothing'
    if (i > 0) name = list%item(i)%name
  end function first_change

end module test_state_m
