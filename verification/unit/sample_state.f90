!> A state of every kind of array, each element another number, for the tests of output and restart.
module sample_state_m
  use kinds_m, only: wp
  use case_types_m, only: case_t
  use case_text_m, only: case_of, body
  use case_check_m, only: make_shapes
  use errors_m, only: problems_t
  use grid_m, only: grid_t, grid_init
  use fields_m, only: flow_init
  use solid_geometry_m, only: solid_geometry_init
  use tet_mesh_m, only: shape_t
  use case_blocks_m, only: blocks_init
  use contacts_m, only: contacts_init
  use displacements_m, only: displacements_t
  use clock_m, only: clock_init
  use run_state_m, only: run_state_t
  use checksum_m, only: checksum_t
  use state_m, only: list_state
  use state_list_m, only: state_list_t
  implicit none
  private
  public :: sample_t, make_sample, fill_cells, checksums_of, first_change

  type, extends(run_state_t) :: sample_t
    type(case_t) :: case
    character(:), allocatable :: parameters
  end type sample_t

contains

  !> A small tank with three blocks; `start` moves every number of the state.
  subroutine make_sample(start, periodic, s)
    real(wp), intent(in) :: start
    logical, intent(in) :: periodic   !! in x
    type(sample_t), intent(out) :: s
    type(shape_t), allocatable :: shapes(:)
    type(problems_t) :: problems
    real(wp), parameter :: q(4) = [0.5_wp, -0.5_wp, 0.5_wp, 0.5_wp]
    character(*), parameter :: lf = new_line('a')
    integer :: b

    s%case = case_of('&run t_end=2/ &grid cells=16,6,20 length=.16,.06,.2/ &shape name="block" ' &
      //'kind="box" size=.02,.015,.01/ &shape name="hexapod" kind="hexapod" size=.01/ ' &
      //trim(merge('&boundary x_min="periodic" x_max="periodic"/', repeat(' ', 44), periodic)) &
      //body('block', [0.04_wp, 0.03_wp, 0.1_wp], q=q, more='fixed=T') &
      //body('block', [0.08_wp, 0.03_wp, 0.1_wp], q=q) &
      //body('hexapod', [0.12_wp, 0.03_wp, 0.1_wp], q=q, more='release_time=1.5'))
    s%parameters = '&run'//lf//'  t_end = 2'//lf//'  dt = 0.01'//lf//'/'//lf
    call make_shapes(s%case, shapes, problems)
    call grid_init(s%case%grid, s%case%boundary, s%grid)
    call clock_init(s%case%run, s%clock)
    call flow_init(s%grid, s%flow)
    allocate (s%solid)
    call solid_geometry_init(s%grid, s%solid)
    call blocks_init(s%case, shapes, s%blocks)
    call contacts_init(s%case%contact, s%blocks, s%contacts)
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
    s%k = [(start + 0.1_wp*i, i=1, 4)]
    s%energy = 3*s%k
    s%xi = reshape([(start + 0.01_wp*i, i=1, 12)], [3, 4])
    s%force = 2*s%xi
    s%torque_a = 3*s%xi
    s%torque_b = 4*s%xi
  end subroutine fill_displacements

  !> Fill an array, halo included, with numbers that tell the cell; periodic images are equal.
  subroutine fill_cells(start, grid, m, a)
    real(wp), intent(in) :: start
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: m
    real(wp), intent(out) &
      :: a(grid%first(1):grid%last(1), grid%first(2):grid%last(2), grid%first(3):grid%last(3), m)
    integer :: i, j, k, d, e, cell(3)

    do concurrent (d=1:m, k=grid%first(3):grid%last(3), &
      j=grid%first(2):grid%last(2), i=grid%first(1):grid%last(1))
      cell = [i, j, k]
      do e = 1, 3
        if (grid%periodic(e)) cell(e) = modulo(cell(e) - 1, grid%n(e)) + 1
      end do
      a(i, j, k, d) = start + sin(1.0_wp*cell(1) + 100.0_wp*cell(2) + 10000.0_wp*cell(3) &
        + 0.37_wp*d)
    end do
  end subroutine fill_cells

  !> A checksum of each item of the state; all processes call.
  function checksums_of(s) result(text)
    type(sample_t), intent(inout) :: s
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
    type(sample_t), intent(inout) :: s
    character(:), allocatable :: name
    character(18), allocatable :: after(:)
    type(state_list_t) :: list
    integer :: i

    name = 'nothing'
    allocate (after, source=checksums_of(s))
    call list_state(s%run_state_t, list)
    do i = list%n, 1, -1
      if (i > size(before)) then
        name = list%item(i)%name
      else if (after(i) /= before(i)) then
        name = list%item(i)%name
      end if
    end do
  end function first_change

end module sample_state_m
