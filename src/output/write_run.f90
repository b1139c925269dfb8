!> `run.h5`: how the run was made, its grid, shapes and blocks, and one row after another.
!!
!! Only the root process writes. Each row is flushed, so that a fault loses nothing already
!! computed.
module write_run_m
  use kinds_m, only: wp, name_length
  use parallel_m, only: is_root, nproc, get_threads
  use timers_m, only: timer_count, timer_name, timer_seconds, timer_calls
  use build_info_m, only: version, git_revision, compiler, flags
  use grid_m, only: grid_t
  use tet_mesh_m, only: shape_t
  use rigid_body_m, only: blocks_t, own_mass
  use bed_m, only: bed_t
  use errors_m, only: exit_files
  use clock_m, only: clock_t
  use run_state_m, only: run_state_t
  use hdf5_file_m, only: h5_file_t
  use table_m, only: table_t, creating, reopening, appending
  use file_space_m, only: bytes_for_change
  use diagnostics_m, only: quantity_t
  implicit none
  private
  public :: run_file_t, create_run_file, reopen_run_file, continue_run_file, write_row, &
    close_run_file

  character(*), parameter :: once_name(*) = [character(12) :: 'release_time', 'entry_time', &
    'exit_time', 'raised', 'impact_speed', 'rest_since']   !! datasets with a number per block
  character(*), parameter :: once_units(*) = [character(3) :: 's', 's', 's', 'm', 'm/s', 's']
  integer, parameter :: running = -1         !! exit status until the run ends, or if it was killed

  type, extends(table_t) :: run_file_t
    real(wp) :: wall_time = 0.0_wp                     !! of the last row when a run goes on [s]
    real(wp), allocatable, private :: q(:, :)          !! as in the last row
    real(wp), allocatable, private :: once(:, :)       !! (blocks, `once_name`) as in the file
    integer, allocatable, private :: status(:)         !! of the blocks, as in the file
  end type run_file_t

contains

  !> Create the file with everything but rows.
  subroutine create_run_file(path, text, parameters, state, bed, row, self)
    character(*), intent(in) :: path
    character(*), intent(in) :: text, parameters   !! the case: verbatim, and all its values
    type(run_state_t), intent(in) :: state
    type(bed_t), intent(in) :: bed
    type(quantity_t), intent(in) :: row(:)         !! any: its columns are created
    type(run_file_t), intent(out) :: self
    integer :: c

    if (.not. is_root()) return
    associate (file => self%file, blocks => state%blocks)
      call file%create(path, .false.)
      call file%attribute('/', 'format', 'mics-run')
      call file%attribute('/', 'format_version', 1)
      call write_provenance(text, parameters, file)
      call write_grid(state%grid, file)
      if (bed%there) call write_bed(bed, file)
      call write_shapes(blocks, file)
      call write_bodies(blocks, file)
      call file%group('/series')
      self%once = reshape([(once_values(blocks, c), c=1, size(once_name))], &
                          [blocks%n, size(once_name)])
      self%status = blocks%status
      self%q = first_sign(blocks%q)
      call self%begin(creating)
      call list_columns(row, blocks, self)
      call file%flush()
    end associate
  end subroutine create_run_file

  !> The columns, see `table_m`.
  subroutine list_columns(row, blocks, self)
    type(quantity_t), intent(in) :: row(:)       !! the time first
    type(blocks_t), intent(in) :: blocks
    type(run_file_t), intent(inout) :: self
    integer :: c

    call self%column('/bodies/time', trim(row(1)%units), row(1)%value)
    call self%column('/bodies/position', 'm', blocks%x)
    call self%column('/bodies/velocity', 'm/s', blocks%v)
    call self%column('/bodies/angular_velocity', 'rad/s', blocks%omega)
    call self%column('/bodies/fluid_force', 'N', blocks%fluid_force)
    call self%column('/bodies/fluid_torque', 'N m', blocks%fluid_torque)
    call self%column('/bodies/contact_force', 'N', blocks%contact_force)
    call self%column('/bodies/contact_torque', 'N m', blocks%contact_torque)
    call self%column('/bodies/contact_force_max', 'N', blocks%record%hardest)
    call self%column('/bodies/quaternion', '1', self%q)
    call self%column('/bodies/contacts', '1', blocks%contacts)
    call self%column('/bodies/on_floor', '1', blocks%on_floor)
    do c = 1, size(row)
      call self%column('/series/'//trim(row(c)%name), trim(row(c)%units), row(c)%value)
    end do
  end subroutine list_columns

  !> Attitudes with w >= 0.
  pure function first_sign(q) result(signed)
    real(wp), intent(in) :: q(:, :)
    real(wp) :: signed(size(q, 1), size(q, 2))
    integer :: b

    do b = 1, size(q, 2)
      signed(:, b) = merge(q(:, b), -q(:, b), q(1, b) >= 0.0_wp)
    end do
  end function first_sign

  subroutine write_provenance(text, parameters, file)
    character(*), intent(in) :: text, parameters
    type(h5_file_t), intent(inout) :: file
    character(*), parameter :: here = '/provenance'

    call file%group(here)
    call file%attribute(here, 'namelist', text)
    call file%attribute(here, 'parameters', parameters)
    call file%attribute(here, 'version', version)
    call file%attribute(here, 'git_revision', git_revision)
    call file%attribute(here, 'compiler', compiler)
    call file%attribute(here, 'flags', flags)
    call file%attribute(here, 'threads', get_threads())
    call file%attribute(here, 'ranks', nproc())
    call file%attribute(here, 'started', time_now())
    call file%attribute(here, 'finished', '')
    call file%attribute(here, 'exit_status', running)
  end subroutine write_provenance

  !> Date and time with the shift of the time zone, as in 2026-11-21T07:30:00+09:00.
  function time_now() result(text)
    character(25) :: text
    character(8) :: date
    character(10) :: time
    character(5) :: zone

    call date_and_time(date, time, zone)
    text = date(:4)//'-'//date(5:6)//'-'//date(7:8)//'T'//time(:2)//':'//time(3:4)//':'//time(5:6) &
      //zone(:3)//':'//zone(4:5)
  end function time_now

  !> The coordinates of the faces.
  subroutine write_grid(grid, file)
    type(grid_t), intent(in) :: grid
    type(h5_file_t), intent(inout) :: file
    character(*), parameter :: axis = 'xyz'
    integer :: d, i

    call file%group('/grid')
    do d = 1, 3
      call file%store('/grid/'//axis(d:d), 'm', grid%face([(i, i=1, grid%n(d) + 1)], d))
    end do
  end subroutine write_grid

  !> The surface of the bed, repeated between periodic sides; corners are counted from 0.
  subroutine write_bed(bed, file)
    type(bed_t), intent(in) :: bed
    type(h5_file_t), intent(inout) :: file

    call file%group('/bed')
    call file%store('/bed/points', 'm', [bed%point], shape(bed%point))
    call file%store('/bed/triangles', '1', [bed%triangle - 1], shape(bed%triangle))
  end subroutine write_bed

  !> The shapes; corners are counted from 0, as h5py and VTK do.
  subroutine write_shapes(blocks, file)
    type(blocks_t), intent(in) :: blocks
    type(h5_file_t), intent(inout) :: file
    integer :: s

    call file%group('/shapes')
    do s = 1, size(blocks%shapes)
      associate (form => blocks%shapes(s), here => '/shapes/'//trim(blocks%shapes(s)%name))
        call file%group(here)
        call file%store(here//'/points', 'm', [form%point], shape(form%point))
        call file%store(here//'/triangles', '1', [form%triangle - 1], shape(form%triangle))
        call file%store(here//'/tets', '1', [form%tet - 1], shape(form%tet))
        call file%store(here//'/sphere_centre', 'm', [form%sphere_centre], &
          shape(form%sphere_centre))
        call file%store(here//'/sphere_radius', 'm', form%sphere_radius)
        call file%attribute(here, 'volume', form%volume)
        call file%attribute(here, 'inertia', [form%inertia], [3, 3])
        call file%attribute(here, 'density', form%density)
      end associate
    end do
  end subroutine write_shapes

  !> What is said once of each block.
  subroutine write_bodies(blocks, file)
    type(blocks_t), intent(in) :: blocks
    type(h5_file_t), intent(inout) :: file
    character(name_length) :: name(blocks%n)
    integer :: b, c

    do b = 1, blocks%n
      name(b) = blocks%shapes(blocks%shape(b))%name
    end do
    call file%group('/bodies')
    call file%store('/bodies/shape', '1', name)
    call file%store('/bodies/mass', 'kg', [(own_mass(blocks, b), b=1, blocks%n)])
    call file%store('/bodies/fixed', '1', merge(1, 0, blocks%fixed))
    call file%store('/bodies/name', '1', blocks%name)
    do c = 1, size(once_name)
      call file%store('/bodies/'//trim(once_name(c)), trim(once_units(c)), once_values(blocks, c))
    end do
    call file%store('/bodies/planned', 'm', [blocks%planned], shape(blocks%planned))
    call file%store('/bodies/status', '1', blocks%status)
    call file%attribute('/bodies/status', 'meaning', '0 not there yet, 1 being lowered, ' &
      //'2 released, 3 left out, 4 out of the tank')
  end subroutine write_bodies

  !> What may change once or twice in a run, of all blocks.
  pure function once_values(blocks, c) result(values)
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: c   !! number of its name
    real(wp) :: values(blocks%n)

    select case (c)
    case (1); values = blocks%release_time
    case (2); values = blocks%entry_time
    case (3); values = blocks%exit_time
    case (4); values = blocks%raised
    case (5); values = blocks%record%impact_speed
    case default; values = blocks%record%rest_since
    end select
  end function once_values

  !> Overwrite those that differ from what is in the file.
  subroutine rewrite_once(blocks, self)
    type(blocks_t), intent(in) :: blocks
    type(run_file_t), intent(inout) :: self
    real(wp) :: values(blocks%n)
    integer :: c

    do c = 1, size(once_name)
      values = once_values(blocks, c)
      if (.not. any(abs(values - self%once(:, c)) > 0.0_wp)) cycle
      self%once(:, c) = values
      call self%file%store('/bodies/'//trim(once_name(c)), trim(once_units(c)), values)
    end do
    if (all(blocks%status == self%status)) return
    self%status = blocks%status
    call self%file%store('/bodies/status', '1', self%status)
  end subroutine rewrite_once

  !> Open the file of a run that goes on from `clock`; nothing in it is changed yet.
  subroutine reopen_run_file(path, clock, blocks, row, self)
    character(*), intent(in) :: path
    type(clock_t), intent(in) :: clock
    type(blocks_t), intent(in) :: blocks
    type(quantity_t), intent(in) :: row(:)         !! any: its columns are opened
    type(run_file_t), intent(out) :: self
    integer :: c
    real(wp) :: wall_time(1), q(4*blocks%n)

    if (.not. is_root()) return
    call self%file%open(path, .false., .true.)
    self%q = blocks%q
    call self%begin(reopening)
    call list_columns(row, blocks, self)
    call self%find_rows(clock%n_rows, clock%t)
    wall_time = 0.0_wp
    q = 0.0_wp
    call self%read_row('/bodies/quaternion', clock%n_rows, q)   ! the next is like the last due
    call self%read_row('/series/wall_time', self%rows, wall_time)
    self%q = reshape(q, [4, blocks%n])
    self%wall_time = wall_time(1)
    self%once = reshape([(once_values(blocks, c), c=1, size(once_name))], &
                        [blocks%n, size(once_name)])
    self%status = blocks%status
  end subroutine reopen_run_file

  !> Drop the rows later than the start of a run that goes on, and say that it does.
  subroutine continue_run_file(text, parameters, self)
    character(*), intent(in) :: text, parameters   !! the case as it is now
    type(run_file_t), intent(inout) :: self
    integer :: c

    if (.not. is_root()) return
    associate (file => self%file)
      call file%reserve(bytes_for_change + 2*(len(text) + len(parameters)))
      call self%keep(self%rows)
      do c = 1, size(once_name)
        call file%store('/bodies/'//trim(once_name(c)), trim(once_units(c)), self%once(:, c))
      end do
      call file%store('/bodies/status', '1', self%status)
      call file%attribute('/provenance', 'namelist', text)
      call file%attribute('/provenance', 'parameters', parameters)
      call file%attribute('/provenance', 'finished', '')
      call file%attribute('/provenance', 'exit_status', running)
      call file%flush()
    end associate
  end subroutine continue_run_file

  !> Write a row as number `rows_before` + 1, in the place of a row that only ended an earlier run.
  subroutine write_row(self, rows_before, row, blocks)
    type(run_file_t), intent(inout) :: self
    integer, intent(in) :: rows_before   !! due rows written so far
    type(quantity_t), intent(in) :: row(:)
    type(blocks_t), intent(in) :: blocks

    if (.not. is_root()) return
    if (self%rows /= rows_before) then
      call self%keep(rows_before)
      call self%file%flush()
    end if
    call self%file%reserve(self%bytes_for_row())
    call follow_sign(blocks%q, self%q)
    call self%begin(appending)
    call list_columns(row, blocks, self)
    call rewrite_once(blocks, self)
    call self%file%flush()
    self%rows = self%rows + 1
  end subroutine write_row

  !> Of the two quaternions of each attitude take the one nearer to that of the row before.
  pure subroutine follow_sign(q, followed)
    real(wp), intent(in) :: q(:, :)            !! (4, n)
    real(wp), intent(inout) :: followed(:, :)  !! (4, n)
    integer :: b

    do b = 1, size(q, 2)
      followed(:, b) = merge(q(:, b), -q(:, b), dot_product(q(:, b), followed(:, b)) >= 0.0_wp)
    end do
  end subroutine follow_sign

  !> Write the times of the phases, how the run ended and when; close the file.
  subroutine close_run_file(self, exit_status)
    type(run_file_t), intent(inout) :: self
    integer, intent(in) :: exit_status
    character(name_length), allocatable :: name(:)
    integer :: i

    if (.not. is_root()) return
    allocate (name(timer_count()))
    do i = 1, timer_count()
      name(i) = timer_name(i)
    end do
    associate (file => self%file)
      call file%reserve(6*bytes_for_change)
      if (file%has('/timers')) call file%remove('/timers')
      call file%group('/timers')
      call file%store('/timers/name', '1', name)
      call file%store('/timers/seconds', 's', [(timer_seconds(i), i=1, timer_count())])
      call file%store('/timers/calls', '1', [(timer_calls(i), i=1, timer_count())])
      call file%attribute('/provenance', 'finished', time_now())
      call file%last_integer('/provenance', 'exit_status', merge(exit_status, exit_files, &
        file%info == 0))
      call file%close()
    end associate
  end subroutine close_run_file

end module write_run_m
