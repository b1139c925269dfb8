!> An initial state that boxes of water cannot give, from an HDF5 file.
!!
!! The file holds one dataset or both, over the cells of the whole grid (as h5py shows them):
!!
!!     liquid    (nz, ny, nx)      share of liquid in the open part of the cell, 0..1 [-]
!!     velocity  (nz, ny, nx, 3)   velocity at the centre of the cell, x y z last [m/s]
!!
!! `liquid` takes the place of `water_level` and `&water` (beside inflows and outflows
!! `water_level` stays, as their level), `velocity` that of `&fluid velocity`. The
!! velocity of the faces is the mean of the two cells, made free of divergence by the first
!! projection. `micstools.cases.initial_state` writes such a file.
module initial_state_m
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use kinds_m, only: wp, i8
  use errors_m, only: problems_t, fatal, to_text, exit_files
  use case_types_m, only: case_t, fluid_t, is_given, has_flow
  use named_files_m, only: found_file
  use grid_m, only: grid_t, unit_step
  use fields_m, only: flow_t
  use boundary_m, only: fill_scalar_halo, fill_velocity_halo
  use liquid_fill_m, only: liquid_volume
  use hdf5_file_m, only: h5_file_t
  use value_text_m, only: quoted_text
  implicit none
  private
  public :: check_initial_state, read_initial_state

  character(*), parameter :: liquid_name = 'liquid', velocity_name = 'velocity'
  real(wp), parameter :: fastest = 1.0e20_wp   !! as in a case [m/s]

contains

  !> Everything that may be wrong with the file of a case, and what must not be given beside it.
  subroutine check_initial_state(case, problems)
    type(case_t), intent(in) :: case
    type(problems_t), intent(inout) :: problems
    type(h5_file_t) :: file
    logical :: liquid, velocity

    if (.not. (is_named(case%fluid) .and. has_flow(case%run))) return
    call file%open(found_file(case%fluid%initial_state), .false., .false.)
    liquid = file%has(liquid_name)
    velocity = file%has(velocity_name)
    if (file%info /= 0) then
      call report(file%message)
      return
    end if
    if (.not. (liquid .or. velocity)) call report( &
      'the file holds neither ''liquid'' nor ''velocity''')
    if (liquid) then
      call check_values(liquid_name, case%grid%cells, 0.0_wp, 1.0_wp, 'shares between 0 and 1')
      if ((is_given(case%fluid%water_level) .and. .not. any(case%boundary%kind == 'inflow' &
        .or. case%boundary%kind == 'outflow')) .or. size(case%water) > 0 &   ! these keep the level
        .or. case%fluid%single_phase) then
        call report('''liquid'' of the file takes the place of water_level, single_phase and '// &
                  '&water, give one only')
      end if
    end if
    if (velocity) then
      call check_values(velocity_name, [3, case%grid%cells], -fastest, fastest, &
                        'finite numbers up to '//to_text(fastest))
      if (any(abs(case%fluid%velocity) > 0.0_wp)) then
        call report('''velocity'' of the file takes the place of &fluid velocity, give one only')
      end if
    end if
    call file%close()
  contains
    subroutine report(what)
      character(*), intent(in) :: what

      call problems%add_message('&fluid initial_state = '// &
                                quoted_text(case%fluid%initial_state)//': '//what, case%fluid%line)
    end subroutine report

    !> Shape of a dataset and the range of its values, layer by layer.
    subroutine check_values(name, extent, least, most, meaning)
      character(*), intent(in) :: name, meaning
      integer, intent(in) :: extent(:)   !! x fastest
      real(wp), intent(in) :: least, most
      real(wp), allocatable :: layer(:)
      integer, allocatable :: first(:), part(:), found(:)
      integer :: k, n

      if (file%info /= 0) return
      call file%shape_of(name, found)
      n = size(extent)
      if (file%info == 0) then
        if (size(found) /= n) then
          call report(name//' has another number of dimensions than (nz, ny, nx'// &
                    trim(merge(', 3)', ')   ', n == 4)))
          return
        else if (case%grid%cells_faulty) then
          return
        else if (any(found /= extent)) then
          call report(name//' does not have the cells of &grid')
          return
        end if
      end if
      first = [(1, k=1, n)]
      part = extent
      part(n) = 1
      allocate (layer(product(part)), source=0.0_wp)
      do k = 1, extent(n)
        first(n) = k
        call file%read(name, layer, first, part)
        if (file%info /= 0) exit
        if (all(ieee_is_finite(layer))) then
          if (all(layer >= least .and. layer <= most)) cycle
        end if
        call report(name//' must hold '//meaning)
        return
      end do
      if (file%info /= 0) call report(file%message)
    end subroutine check_values
  end subroutine check_initial_state

  !> Does the case name a file?
  pure logical function is_named(fluid)
    type(fluid_t), intent(in) :: fluid

    is_named = .false.
    if (allocated(fluid%initial_state)) is_named = len_trim(fluid%initial_state) > 0
  end function is_named

  !> What the file gives, if the case names one, halos filled: the liquid of the open part of every
  !! own cell, whose fluid volume must be set, with the initial volume; the velocity of cells and
  !! faces.
  subroutine read_initial_state(fluid, grid, flow)
    type(fluid_t), intent(in) :: fluid
    type(grid_t), intent(in) :: grid
    type(flow_t), intent(inout) :: flow
    type(h5_file_t) :: file
    real(wp), allocatable :: part(:), values(:, :, :, :)
    integer :: i, j, k, d, e(3), extent(3)

    if (.not. is_named(fluid)) return
    call file%open(found_file(fluid%initial_state), .false., .false.)
    extent = grid%hi - grid%lo + 1
    allocate (part(3_i8*product(extent)), source=0.0_wp)
    associate (a => grid%lo, b => grid%hi, n => product(extent))
      if (file%has(liquid_name)) then
        call file%read(liquid_name, part(:n), a, extent)
        flow%liquid(a(1):b(1), a(2):b(2), a(3):b(3)) = &
          flow%fluid_volume(a(1):b(1), a(2):b(2), a(3):b(3))*reshape(part(:n), extent)
        call fill_scalar_halo(grid, flow%liquid)
        flow%liquid_initial = liquid_volume(grid, flow%liquid)
      end if
      if (file%has(velocity_name)) then
        call file%read(velocity_name, part, [1, a], [3, extent])
        values = reshape(part, [3, extent])
        do d = 1, 3
          flow%u(a(1):b(1), a(2):b(2), a(3):b(3), d) = values(d, :, :, :)
        end do
        call fill_velocity_halo(grid, flow%u)
        do d = 1, 3   ! of the faces: mean of two cells; the halo makes it that of the wall there
          e = unit_step(:, d)
          do k = grid%first(3) + 1, grid%last(3)
            do j = grid%first(2) + 1, grid%last(2)
              do i = grid%first(1) + 1, grid%last(1)
                flow%uf(i, j, k, d) = 0.5_wp*(flow%u(i - e(1), j - e(2), k - e(3), d) &
                                              + flow%u(i, j, k, d))
              end do
            end do
          end do
        end do
      end if
    end associate
    call file%close()
    if (file%info /= 0) call fatal(exit_files, file%message)
  end subroutine read_initial_state

end module initial_state_m
