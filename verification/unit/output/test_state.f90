!> The list of the state: nothing is missing, every change shows, sums do not know the ranks.
! ranks: 2 3
module test_state_m
  use check_m, only: check, wp, i8
  use parallel_m, only: nproc
  use grid_m, only: grid_t
  use state_m, only: list_state
  use state_list_m, only: state_list_t, checksum_of_cells
  use sample_state_m, only: sample_t, make_sample, fill_cells, checksums_of, first_change
  implicit none
  private
  public :: test_state

contains

  subroutine test_state()
    call test_every_change_shows()
    call test_checksum_of_cells()
    call test_owned_faces()
  end subroutine test_state

  !> Change one number of each array in turn: that array has another checksum, none before it in the
  !! list, and so has the state; after the change is undone both agree again.
  subroutine test_every_change_shows()
    type(sample_t) :: s
    integer, parameter :: n_changes = 35
    integer :: i
    character(:), allocatable :: name, before
    character(18), allocatable :: each(:)

    call make_sample(0.5_wp, .false., s)
    before = checksum(s)
    each = checksums_of(s)
    do i = 1, n_changes
      call change(s, i, name)
      call check('a change of '//name//' is seen and named', first_change(each, s) == name)
      call check('a change of '//name//' alters the checksum', checksum(s) /= before)
      call make_sample(0.5_wp, .false., s)
    end do
    call check('equal states are equal', first_change(each, s) == 'nothing')
    call check('equal states have equal checksums', checksum(s) == before)
  end subroutine test_every_change_shows

  function checksum(s) result(text)
    type(sample_t), intent(inout) :: s
    character(:), allocatable :: text
    type(state_list_t) :: list

    call list_state(s%run_state_t, list)
    text = list%checksum()
  end function checksum

  !> Change number i of the list of all things that a run must remember.
  subroutine change(s, i, name)
    type(sample_t), intent(inout) :: s
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
    type(sample_t), target :: s
    type(grid_t), target :: whole
    type(state_list_t) :: list, of_whole
    real(wp), allocatable, target :: a(:, :, :, :)
    integer(i8) :: all_cells(2)

    call make_sample(0.0_wp, .false., s)
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
    type(sample_t), target :: s
    type(state_list_t) :: list
    integer :: first(3), last(3)

    call make_sample(0.0_wp, .false., s)
    list%grid => s%grid
    call list%add('uf', 'm/s', s%flow%uf, on_faces=.true.)
    call list%item(1)%part(s%grid, 3, first, last)
    call check('faces of z end at the upper side', last(3), merge(s%grid%n(3) + 1, s%grid%hi(3), &
      s%grid%hi(3) == s%grid%n(3)))
    call check('those of x at the last cell', last(1), s%grid%hi(1))
  end subroutine test_owned_faces

end module test_state_m
