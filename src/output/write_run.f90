!> `run.h5`: how the run was made, its grid, shapes and blocks, and one row after another.
!!
!! Only the root process writes. Each row is flushed, so that a fault loses nothing already
!! computed.
module write_run_m
  use kinds_m, only: wp
  use parallel_m, only: is_root, nproc, get_threads
  use timers_m, only: phase, n_phases
  use build_info_m, only: version, git_revision, compiler, flags
  use rigid_body_m, only: blocks_t, own_mass
  use bed_m, only: bed_t
  use errors_m, only: exit_files
  use state_m, only: run_state_t
  use hdf5_file_m, only: h5_file_t, as_double, as_integer
  use table_m, only: result_file_t, appending
  use file_space_m, only: bytes_for_change
  use diagnostics_m, only: quantity_t
  implicit none
  private
  public :: run_file_t

  character(*), parameter :: once_name(*) = [character(12) :: 'release_time', 'entry_time', &
    'exit_time', 'raised', 'impact_speed', 'rest_since', 'status']   !! datasets, a number per block
  character(*), parameter :: once_units(*) = [character(3) :: 's', 's', 's', 'm', 'm/s', 's', '1']
  integer, parameter :: once_kind(*) = [spread(as_double, 1, 6), as_integer]
  integer, parameter :: running = -1         !! exit status until the run ends, or if it was killed

  type, extends(result_file_t) :: run_file_t
    character(:), allocatable :: text, parameters      !! the case: verbatim, and all its values
    type(quantity_t), allocatable :: row(:)            !! of this moment
    real(wp) :: wall_time = 0.0_wp                     !! of the last row when a run goes on [s]
    real(wp), allocatable, private :: q(:, :)          !! as in the last row
    real(wp), allocatable, private :: once(:, :)       !! (blocks, `once_name`) as in the file
  contains
    procedure :: write_head
    procedure :: list_columns
    procedure :: begin => begin_run, find => find_run, go_on, finish
  end type run_file_t

contains

  !> Create the file with everything but rows; `self` has the case and a row.
  subroutine begin_run(self, path, state, bed)
    class(run_file_t), intent(inout) :: self
    character(*), intent(in) :: path
    type(run_state_t), intent(in) :: state
    type(bed_t), intent(in) :: bed

    call self%create(path, .false., state)
    if (.not. (is_root() .and. bed%there)) return
    ! The surface of the bed, repeated between periodic sides; corners are counted from 0.
    call self%file%group('/bed')
    call self%file%store('/bed/points', 'm', [bed%point], shape(bed%point))
    call self%file%store('/bed/triangles', '1', from_0(bed%triangle), shape(bed%triangle), &
      as_integer)
    call self%file%flush()
  end subroutine begin_run

  !> How the run was made, its grid, shapes and blocks.
  subroutine write_head(self, state)
    class(run_file_t), intent(inout) :: self
    type(run_state_t), intent(in) :: state
    character(*), parameter :: here = '/provenance', axis = 'xyz'
    integer :: d, i

    associate (file => self%file, grid => state%grid, blocks => state%blocks)
      call file%attribute('/', 'format', 'mics-run')
      call file%attribute('/', 'format_version', [1])
      call file%group(here)
      call file%attribute(here, 'namelist', self%text)
      call file%attribute(here, 'parameters', self%parameters)
      call file%attribute(here, 'version', version)
      call file%attribute(here, 'git_revision', git_revision)
      call file%attribute(here, 'compiler', compiler)
      call file%attribute(here, 'flags', flags)
      call file%attribute(here, 'threads', [get_threads()])
      call file%attribute(here, 'ranks', [nproc()])
      call file%attribute(here, 'started', time_now())
      call file%attribute(here, 'finished', '')
      call file%attribute(here, 'exit_status', [running])
      call file%group('/grid')
      do d = 1, 3   ! the coordinates of the faces
        call file%store('/grid/'//axis(d:d), 'm', grid%face([(i, i=1, grid%n(d) + 1)], d))
      end do
      call write_shapes(blocks, file)
      call file%group('/bodies')
      call file%store('/bodies/shape', '1', blocks%shapes(blocks%shape)%name)
      call file%store('/bodies/mass', 'kg', [(own_mass(blocks, i), i=1, blocks%n)])
      call file%store('/bodies/fixed', '1', merge(1.0_wp, 0.0_wp, blocks%fixed), kind=as_integer)
      call file%store('/bodies/name', '1', blocks%name)
      call file%store('/bodies/planned', 'm', [blocks%planned], shape(blocks%planned))
      call store_once(blocks, .true., self)
      call file%attribute('/bodies/status', 'meaning', '0 not there yet, 1 being lowered, ' &
        //'2 released, 3 left out, 4 out of the tank')
      call file%group('/series')
      self%q = merge(blocks%q, -blocks%q, spread(blocks%q(1, :) >= 0.0_wp, 1, 4))   ! w >= 0
    end associate
  end subroutine write_head

  !> The columns, see `table_m`; when a row is appended also what changes once or twice in a run.
  subroutine list_columns(self, state)
    class(run_file_t), intent(inout) :: self
    type(run_state_t), intent(in) :: state
    integer :: b, c

    associate (blocks => state%blocks, row => self%row)   ! of the row the time is first
      if (self%mode == appending) then   ! of the two quaternions that nearer to the row before
        do b = 1, blocks%n
          self%q(:, b) = merge(blocks%q(:, b), -blocks%q(:, b), &
                               dot_product(blocks%q(:, b), self%q(:, b)) >= 0.0_wp)
        end do
      end if
      call self%column('/bodies/time', trim(row(1)%units), row(1)%value)
      call self%column('/bodies/position', 'm', [blocks%x], 3)
      call self%column('/bodies/velocity', 'm/s', [blocks%v], 3)
      call self%column('/bodies/angular_velocity', 'rad/s', [blocks%omega], 3)
      call self%column('/bodies/fluid_force', 'N', [blocks%fluid_force], 3)
      call self%column('/bodies/fluid_torque', 'N m', [blocks%fluid_torque], 3)
      call self%column('/bodies/contact_force', 'N', [blocks%contact_force], 3)
      call self%column('/bodies/contact_torque', 'N m', [blocks%contact_torque], 3)
      call self%column('/bodies/contact_force_max', 'N', blocks%record%hardest)
      call self%column('/bodies/contact_force_peak', 'N', blocks%record%peak)
      call self%column('/bodies/quaternion', '1', [self%q], 4)
      call self%column('/bodies/contacts', '1', real(blocks%contacts, wp), kind=as_integer)
      call self%column('/bodies/on_floor', '1', real(blocks%on_floor, wp), kind=as_integer)
      do c = 1, size(row)
        call self%column('/series/'//trim(row(c)%name), trim(row(c)%units), row(c)%value)
      end do
      if (self%mode == appending) call store_once(blocks, .false., self)
    end associate
  end subroutine list_columns

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

  !> Numbers of points counted from 0, in a row: one copy, for beds are large.
  pure function from_0(number) result(row)
    integer, intent(in) :: number(:, :)   !! from 1
    real(wp) :: row(size(number))
    integer :: i, m

    m = size(number, 1)
    do i = 1, size(number, 2)
      row(m*(i - 1) + 1:m*i) = real(number(:, i) - 1, wp)
    end do
  end function from_0

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
        call file%store(here//'/triangles', '1', from_0(form%triangle), shape(form%triangle), &
          as_integer)
        call file%store(here//'/tets', '1', from_0(form%tet), shape(form%tet), as_integer)
        call file%store(here//'/sphere_centre', 'm', [form%sphere_centre], &
          shape(form%sphere_centre))
        call file%store(here//'/sphere_radius', 'm', form%sphere_radius)
        call file%attribute(here, 'volume', [form%volume])
        call file%attribute(here, 'inertia', [form%inertia], [3, 3])
        call file%attribute(here, 'density', [form%density])
      end associate
    end do
  end subroutine write_shapes

  !> What may change once or twice in a run: overwrite what differs from the file, or all.
  subroutine store_once(blocks, every, self)
    type(blocks_t), intent(in) :: blocks
    logical, intent(in) :: every
    class(run_file_t), intent(inout) :: self
    real(wp) :: values(blocks%n, size(once_name))
    integer :: c

    values = reshape([blocks%release_time, blocks%entry_time, blocks%exit_time, blocks%raised, &
      blocks%record%impact_speed, blocks%record%rest_since, real(blocks%status, wp)], &
      shape(values))   ! by `once_name`
    if (every) self%once = values
    do c = 1, size(once_name)
      if (.not. (every .or. any(abs(values(:, c) - self%once(:, c)) > 0.0_wp))) cycle
      self%once(:, c) = values(:, c)
      call self%file%store('/bodies/'//trim(once_name(c)), trim(once_units(c)), values(:, c), &
        kind=once_kind(c))
    end do
  end subroutine store_once

  !> Open the file of a run that goes on; nothing in it is changed yet.
  subroutine find_run(self, path, state)
    class(run_file_t), intent(inout) :: self
    character(*), intent(in) :: path
    type(run_state_t), intent(in) :: state
    real(wp) :: wall_time(1), q(4*state%blocks%n)

    self%q = state%blocks%q
    call self%reopen(path, .false., state%clock%rows%n, state)
    if (.not. is_root()) return
    wall_time = 0.0_wp
    q = 0.0_wp
    if (size(q) > 0) call self%file%read('/bodies/quaternion', q, [1, 1, state%clock%rows%n], &
      [4, state%blocks%n, 1])   ! the next is like it
    call self%file%read('/series/wall_time', wall_time, [self%rows], [1])
    self%q = reshape(q, [4, state%blocks%n])
    self%wall_time = wall_time(1)
  end subroutine find_run

  !> Drop the rows later than the start of a run that goes on, and say that it does.
  subroutine go_on(self, blocks)
    class(run_file_t), intent(inout) :: self
    type(blocks_t), intent(in) :: blocks

    if (.not. is_root()) return
    associate (file => self%file)
      call file%reserve(bytes_for_change)
      call self%drop(self%rows)
      call file%reserve(bytes_for_change + 2*(len(self%text) + len(self%parameters)))
      call store_once(blocks, .true., self)
      call file%attribute('/provenance', 'namelist', self%text)
      call file%attribute('/provenance', 'parameters', self%parameters)
      call file%attribute('/provenance', 'finished', '')
      call file%attribute('/provenance', 'exit_status', [running])
      call file%flush()
    end associate
  end subroutine go_on

  !> Write the times of the phases, how the run ended and when; close the file.
  subroutine finish(self, exit_status)
    class(run_file_t), intent(inout) :: self
    integer, intent(in) :: exit_status

    if (.not. is_root()) return
    associate (file => self%file, phases => phase(:n_phases))
      call file%reserve(6*bytes_for_change)
      if (file%has('/timers')) call file%remove('/timers')
      call file%group('/timers')
      call file%store('/timers/name', '1', phases%name)
      call file%store('/timers/seconds', 's', phases%seconds)
      call file%store('/timers/calls', '1', real(phases%calls, wp), kind=as_integer)
      call file%attribute('/provenance', 'finished', time_now())
      call file%last_integer('/provenance', 'exit_status', merge(exit_status, exit_files, &
        file%info == 0))
      call file%close()
    end associate
  end subroutine finish

end module write_run_m
