!> Restart files: the whole state in double precision, checksummed, exact on any number of
!! processes.
!!
!! The caller writes under a temporary name and renames the file then, so a run that is killed
!! meanwhile, or a power cut, leaves the older files whole. Layout (as
!! h5py shows it; faces carry one layer more in each direction, element (d, k, j, i) is the lower
!! face of cell (i, j, k) in direction d):
!!
!!     /            @format = 'mics-restart' @format_version @checksum @version @git_revision
!!                  @namelist @parameters
!!     /clock       t dt step n_rows n_frames rest_began
!!     /energy      what the energy balance has summed
!!     /flow        u (3,nz,ny,nx)  p liquid fluid_volume c alpha (1,nz,ny,nx)
!!                  uf aperture (3,nz+1,ny+1,nx+1) [m/s, 1]  solid_flux (3,nz+1,ny+1,nx+1) [m3/s]
!!                  liquid_initial liquid_inflow, and of each outflow its velocity
!!     /blocks      position quaternion velocity angular_momentum ... (N,..)
!!     /light       with physics = 'light' the level, and of each block wet volume and force
!!     /contacts    the tangential displacements
!!
!! `list_state` names all of it. The volume flux through a face is aperture*area*uf + solid_flux.
module restart_m
  use kinds_m, only: wp
  use errors_m, only: to_text
  use checksum_m, only: checksum_t
  use case_types_m, only: case_t
  use case_input_m, only: parameters_text
  use tet_mesh_m, only: shape_t
  use bed_m, only: bed_t
  use parallel_m, only: nproc, broadcast, global_max, halo_exchange
  use build_info_m, only: version, git_revision
  use grid_m, only: grid_t, n_halo
  use solid_geometry_m, only: solid_geometry_t
  use hdf5_file_m, only: h5_file_t, as_integer
  use state_m, only: run_state_t, state_list_t, item_t, list_state, state_groups
  use file_space_m, only: bytes_for_change
  implicit none
  private
  public :: all_parameters, write_restart, read_restart

  character(*), parameter :: format_name = 'mics-restart'
  integer, parameter :: format_version = 1
  integer, parameter :: max_displacements = 100000000
  character(*), parameter :: no_line = 'nothing'   !! after the last of a text

contains

  !> All that determines a run, as text: the values of its case, then checksums of what its files
  !! held. A run goes on from a restart file of the same parameters only.
  function all_parameters(case, shapes, bed) result(text)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)
    type(bed_t), intent(in) :: bed
    character(:), allocatable :: text
    type(checksum_t) :: sum
    integer :: i, r

    text = parameters_text(case)
    do i = 1, size(shapes)
      if (shapes(i)%kind /= 'file') cycle
      call sum%add_reals(size(shapes(i)%point), shapes(i)%point)
      call sum%add_integers(size(shapes(i)%tet), shapes(i)%tet)
      call add_line('the shape '//trim(shapes(i)%name), [real(wp) ::])
    end do
    do i = 1, size(case%drop)
      if (.not. allocated(case%drop(i)%row)) cycle
      do r = 1, size(case%drop(i)%row)
        associate (row => case%drop(i)%row(r))
          call sum%add_text(row%shape//row%name)
          call sum%add_reals(11, [row%x, row%q, row%v, row%time])
          call sum%add_integers(1, [merge(1, 0, row%fixed)])
        end associate
      end do
      call add_line('the places of &drop '//to_text(i), [real(wp) ::])
    end do
    do i = 1, size(case%body)
      associate (path => case%body(i)%path)
        if (path%n > 0) call add_line('the motion of body '//to_text(i), [path%time, path%x, &
          path%q])
      end associate
    end do
    associate (begun => case%begun)   ! where blocks begin that another run left
      if (begun%n > 0) then
        call sum%add_integers(2*begun%n, [begun%drop, begun%block])
        call add_line('the start', [begun%x, begun%q, begun%v, begun%omega])
      end if
    end associate
    if (bed%there) text = text//'! checksum of the bed '//bed%checksum//new_line('a')

  contains

    !> End the line of a file with its last numbers, and begin the checksum of the next.
    subroutine add_line(what, numbers)
      character(*), intent(in) :: what
      real(wp), intent(in) :: numbers(:)

      call sum%add_reals(size(numbers), numbers)
      text = text//'! checksum of '//what//' '//sum%text()//new_line('a')
      sum = checksum_t()
    end subroutine add_line
  end function all_parameters

  !> Write the state to a new file `path`, all processes together, until it is on the disk.
  subroutine write_restart(path, text, parameters, state, info, message)
    character(*), intent(in) :: path
    character(*), intent(in) :: text, parameters   !! the case: verbatim, and all its values
    type(run_state_t), intent(inout) :: state
    integer, intent(out) :: info                   !! 0: written
    character(:), allocatable, intent(out) :: message
    type(h5_file_t) :: file
    type(state_list_t) :: list
    integer :: i, d, first(3), last(3)

    call list_state(state, list)
    call file%create(path, .true.)
    if (nproc() > 1) then   ! one that failed alone could not stop the others
      call file%reserve(list%bytes() + len(text) + len(parameters) + bytes_for_change)
    end if
    call file%attribute('/', 'format', format_name)
    call file%attribute('/', 'format_version', [format_version])
    call file%attribute('/', 'version', version)
    call file%attribute('/', 'git_revision', git_revision)
    call file%attribute('/', 'namelist', text)
    call file%attribute('/', 'parameters', parameters)
    do i = 1, size(state_groups)
      call file%group(trim(state_groups(i)))
    end do
    do i = 1, list%n
      associate (item => list%item(i))
        if (associated(item%cells)) then   ! each process its part
          do d = 1, item%extent(4)
            call item%part(list%grid, d, first, last)
            call file%write_block(item%name, item%units, item%extent, [first, d], &
              [last - first + 1, 1], [item%cells(first(1):last(1), first(2):last(2), &
              first(3):last(3), d)])
          end do
        else if (associated(item%reals)) then
          call file%store(item%name, item%units, item%reals, item%extent)
        else
          call file%store(item%name, '1', real(item%numbers(), wp), item%extent, as_integer)
        end if
      end associate
    end do
    call file%attribute('/', 'checksum', list%checksum())
    call file%close(stored=.true.)
    info = file%info
    message = ''
    if (info /= 0) message = file%message
    call broadcast(info)
  end subroutine write_restart

  !> Read the state from `path`, all processes together, and check that it is whole and of this
  !! case.
  !!
  !! Afterwards the halos between processes are filled; those at the sides of the domain, and what
  !! follows from the state, are the caller's.
  subroutine read_restart(path, parameters, state, info, message)
    character(*), intent(in) :: path
    character(*), intent(in) :: parameters   !! all values of the case that goes on
    type(run_state_t), intent(inout) :: state   !! its solids stay: they follow from the poses
    integer, intent(out) :: info   !! 0: read; 1: the file is no good; 2: the case has changed
    character(:), allocatable, intent(out) :: message
    character(*), parameter :: last(2) = ['a.h5', 'b.h5']
    type(solid_geometry_t), allocatable :: solid
    logical :: there
    integer :: i, n

    call move_alloc(state%solid, solid)
    allocate (state%solid)
    if (allocated(state%flow%u)) then   ! the shares that the file holds
      allocate (state%solid%alpha, source=solid%alpha)
      allocate (state%solid%aperture, source=solid%aperture)
    end if
    call read_state(path, parameters, state, info, message)
    call move_alloc(solid, state%solid)
    if (info == 1) then
      message = message//'; a run cannot go on from it'
      n = len(path) - len(last)
      do i = 1, 2   ! with the one written before or after it, if it is there
        if (n < 0) exit
        if (path(n + 1:) /= last(i)) cycle
        inquire (file=path(:n)//last(3 - i), exist=there)
        if (there) message = message//'; the other one is there: --restart '//path(:n)//last(3 - i)
      end do
    end if
    if (info /= 0) return
    if (state%clock%run%t_end < state%clock%t) then
      info = 2
      message = '&run t_end: the restart file is already past it'
      return
    end if
    associate (clock => state%clock)
      call clock%rows%plan(clock%t)
      call clock%frames%plan(clock%t)
      call clock%restarts%plan(clock%t)
    end associate
  end subroutine read_restart

  !> Read all of a state, and check that it has its checksum.
  subroutine read_state(path, parameters, state, info, message)
    character(*), intent(in) :: path, parameters
    type(run_state_t), intent(inout) :: state
    integer, intent(out) :: info
    character(:), allocatable, intent(out) :: message
    type(h5_file_t) :: file
    type(state_list_t) :: list
    character(:), allocatable :: written
    integer :: i, n(2)

    written = ''
    n = 0
    call file%open(path, .false., .false.)
    call check_kind(file, parameters, info, message)
    call agree(path, info, message)
    if (info == 0) then
      call file%read('/contacts/n', n(1:1))
      call file%read('/contacts/rest_n', n(2:2))
      where (n < 0 .or. n > max_displacements) n = 0   ! a damaged file: its checksum shows it
      state%contacts%displacements%n = n(1)
      state%contacts%sleep%frozen%n = n(2)
      call list_state(state, list)
      do i = 1, list%n
        call read_item(list%grid, list%item(i), file)
      end do
      call file%read_attribute('/', 'checksum', written)
    end if
    call file%close()
    if (info /= 0) return
    info = file%info
    if (info /= 0) message = file%message
    call agree(path, info, message)
    if (info /= 0) return
    if (list%checksum() == written) return
    info = 1
    message = path//': damaged, its content does not have its checksum'
  end subroutine read_state

  !> An error of any process is one of all.
  subroutine agree(path, info, message)
    character(*), intent(in) :: path
    integer, intent(inout) :: info
    character(:), allocatable, intent(inout) :: message
    real(wp) :: worst(1)

    worst = real(info, wp)
    call global_max(worst)
    if (info == 0 .and. worst(1) > 0.0_wp) message = path//': another process cannot read it'
    info = nint(worst(1))
  end subroutine agree

  !> Is this a restart file of this case?
  subroutine check_kind(file, parameters, info, message)
    type(h5_file_t), intent(inout) :: file
    character(*), intent(in) :: parameters
    integer, intent(out) :: info
    character(:), allocatable, intent(out) :: message
    character(:), allocatable :: kind, before
    integer :: number

    info = 1
    call file%read_attribute('/', 'format', kind)
    call file%read_attribute('/', 'format_version', number=number)
    call file%read_attribute('/', 'parameters', before)
    if (file%info /= 0) then
      message = file%message
    else if (kind /= format_name .or. number /= format_version) then
      message = file%path//': not a restart file of this version'
    else
      message = changes(before, parameters)
      info = merge(0, 2, len(message) == 0)
    end if
  end subroutine check_kind

  !> All values in which two lists of them differ, apart from those that may change, as far as both
  !! have the same groups.
  function changes(before, after) result(message)
    character(*), intent(in) :: before, after
    character(:), allocatable :: message
    character(:), allocatable :: old, new, group
    integer :: at_old, at_new

    message = ''
    group = ''
    at_old = 1
    at_new = 1
    do
      call next_line(before, at_old, old)
      call next_line(after, at_new, new)
      if (old /= new) then
        if (len(message) > 0) message = message//'; '
        if (is_frame(old) .or. is_frame(new)) group = ''
        message = message//group//new//', was '//old
        if (len(group) == 0) exit
      else if (old == no_line) then
        exit
      else if (is_frame(old)) then
        group = old//' '
      end if
    end do
    if (len(message) > 0) message = 'the case differs from that of the restart file: '//message
  end function changes

  !> Does a line begin or end a group, or are there no more?
  pure logical function is_frame(line)
    character(*), intent(in) :: line

    is_frame = line == no_line .or. scan(line(1:1), '&/') == 1
  end function is_frame

  !> The next line that must not change; `no_line` at the end.
  subroutine next_line(text, at, line)
    character(*), intent(in) :: text
    integer, intent(inout) :: at   !! where to go on
    character(:), allocatable, intent(out) :: line
    character(*), parameter :: free(*) = [character(16) :: 't_end', 'output', 'field_interval', &
      'history_interval', 'restart_interval']
    integer :: n

    do while (at <= len(text))
      n = index(text(at:)//new_line('a'), new_line('a')) - 1
      line = trim(adjustl(text(at:at + n - 1)))
      at = at + n + 1
      if (len(line) == 0) cycle
      if (.not. any(free == line(:max(0, index(line, '=') - 1)))) return
    end do
    line = no_line
  end subroutine next_line

  !> Read an item of the state. Faces on the upper side of a periodic domain are those on its lower
  !! side: the exchange fills them.
  subroutine read_item(grid, item, file)
    type(grid_t), intent(in) :: grid
    type(item_t), intent(in) :: item
    type(h5_file_t), intent(inout) :: file
    real(wp), allocatable :: row(:)
    integer, allocatable :: numbers(:)
    integer :: first(3), last(3), d
    logical :: well

    well = file%info == 0
    if (.not. (well .or. associated(item%cells))) return   ! else other processes wait for the halos
    if (associated(item%cells)) then
      do d = 1, item%extent(4)
        call item%part(grid, d, first, last)
        allocate (row(product(last - first + 1)), source=0.0_wp)
        call file%read(item%name, row, [first, d], [last - first + 1, 1])
        item%cells(first(1):last(1), first(2):last(2), first(3):last(3), d) = &
          reshape(row, last - first + 1)
        deallocate (row)
        call halo_exchange(item%cells(:, :, :, d), n_halo)
      end do
    else if (associated(item%reals)) then
      call file%read(item%name, item%reals)
    else
      numbers = item%numbers()
      call file%read(item%name, numbers)
      if (associated(item%integers)) item%integers = numbers
      if (associated(item%logicals)) item%logicals = numbers == 1
    end if
    if (well .and. file%info /= 0 .and. len(item%units) > 0) file%message = file%message//' [' &
      //item%units//']'
  end subroutine read_item

end module restart_m
