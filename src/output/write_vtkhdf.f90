!> `fields.vtkhdf` and `blocks.vtkhdf`: the fluid and the surfaces of the blocks, frame by frame, as
!! ParaView and pyvista read them.
!!
!! Layout: VTKHDF 2.0, temporal ImageData (a frame is a row of each dataset) and temporal PolyData
!! (the points of all frames one after another, the triangles once). Numbers are single, but the
!! points double: map coordinates of six digits leave single ones 0.06 m. A frame is complete when
!! `Steps@NSteps` counts it, which is flushed after everything else. Source: VTK, "VTKHDF file
!! format".
module write_vtkhdf_m
  use kinds_m, only: wp, sp, i8
  use parallel_m, only: is_root
  use vectors_m, only: cross, rotation_matrix
  use grid_m, only: grid_t
  use rigid_body_m, only: blocks_t
  use clock_m, only: clock_t
  use run_state_m, only: run_state_t
  use hdf5_file_m, only: h5_file_t
  use file_space_m, only: bytes_for_change
  use table_m, only: table_t, creating, reopening, appending
  implicit none
  private
  public :: field_file_t, create_field_file, reopen_field_file, continue_field_file, &
    write_field_frame
  public :: block_file_t, create_block_file, reopen_block_file, continue_block_file, &
    write_block_frame

  character(*), parameter :: root = '/VTKHDF', steps = '/VTKHDF/Steps', &
    cell_data = '/VTKHDF/CellData/'
  integer, parameter :: frame_chunk = 512   !! of a number per frame [bytes]

  type, extends(table_t) :: field_file_t
    real(sp), allocatable, private :: values(:)   !! of the own cells, three for a vector
  end type field_file_t

  type, extends(table_t) :: block_file_t
    integer, private :: n_points = 0, n_cells = 0
  end type block_file_t

contains

  !> Create the file of the fluid without frames; all processes together.
  subroutine create_field_file(path, state, self)
    character(*), intent(in) :: path
    type(run_state_t), intent(in) :: state
    type(field_file_t), intent(out) :: self

    associate (file => self%file, grid => state%grid)
      call file%create(path, .true.)
      call file%reserve(16*bytes_for_change)
      call start_file(file, 'ImageData')
      call file%attribute(root, 'WholeExtent', [0, grid%n(1), 0, grid%n(2), 0, grid%n(3)])
      call file%attribute(root, 'Origin', grid%origin)
      call file%attribute(root, 'Spacing', grid%h)
      call file%attribute(root, 'Direction', [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
        0.0_wp, 0.0_wp, 1.0_wp])
      call file%group(root//'/CellData')
      call start_steps(file)
      call file%group(steps//'/CellDataOffsets')
      self%chunk_bytes = frame_chunk
      call self%begin(creating)
      call list_fields(state, self)
      call file%flush()
    end associate
  end subroutine create_field_file

  !> The columns of the fluid, see `table_m`.
  subroutine list_fields(state, self)
    type(run_state_t), intent(in) :: state
    type(field_file_t), intent(inout) :: self
    character(*), parameter :: name(4) = [character(8) :: 'liquid', 'solid', 'pressure', 'velocity']
    integer :: c, n

    if (.not. allocated(self%values)) then
      allocate (self%values(3*product(state%grid%hi - state%grid%lo + 1)))
    end if
    associate (grid => state%grid, flow => state%flow, first => state%grid%lo, &
      extent => state%grid%hi - state%grid%lo + 1, values => self%values)
      n = product(extent)
      call self%column(steps//'/Values', 's', state%clock%t)
      call liquid_share(grid, flow%liquid, flow%fluid_volume, flow%c, values)
      call self%field(cell_data//'liquid', '1', grid%n, first, extent, values(:n))
      call single(grid, state%solid%alpha, values)
      call self%field(cell_data//'solid', '1', grid%n, first, extent, values(:n))
      call single(grid, flow%p, values)
      call self%field(cell_data//'pressure', 'Pa', grid%n, first, extent, values(:n))
      call single_vector(grid, flow%u, values)
      call self%field(cell_data//'velocity', 'm/s', [3, grid%n], [1, first], [3, extent], &
        values(:3*n))
    end associate
    do c = 1, size(name)
      call self%column(steps//'/CellDataOffsets/'//trim(name(c)), '1', int(self%rows, i8))
    end do
  end subroutine list_fields

  !> The attributes that say what the file is.
  subroutine start_file(file, kind)
    type(h5_file_t), intent(inout) :: file
    character(*), intent(in) :: kind   !! of VTK data

    call file%group(root)
    call file%attribute(root, 'Version', [2, 0])
    call file%fixed_text_attribute(root, 'Type', kind)
  end subroutine start_file

  !> The list of frames, still empty.
  subroutine start_steps(file)
    type(h5_file_t), intent(inout) :: file

    call file%group(steps)
    call file%attribute(steps, 'NSteps', 0)
  end subroutine start_steps

  !> Open the file of a run that goes on; nothing in it is changed yet.
  subroutine reopen_field_file(path, state, self)
    character(*), intent(in) :: path
    type(run_state_t), intent(in) :: state
    type(field_file_t), intent(out) :: self

    call self%file%open(path, .true., .true.)
    call self%begin(reopening)
    call list_fields(state, self)
    call self%find_rows(state%clock%n_frames, state%clock%t)
  end subroutine reopen_field_file

  !> Drop the frames later than the start of a run that goes on.
  subroutine continue_field_file(self)
    type(field_file_t), intent(inout) :: self

    call drop_frames(self%rows, self)
  end subroutine continue_field_file

  !> Keep the first frames.
  subroutine drop_frames(frames, self)
    integer, intent(in) :: frames
    class(table_t), intent(inout) :: self

    call count_frames(self%file, frames)
    call self%keep(frames)
    call self%file%flush()
  end subroutine drop_frames

  !> Say how many frames are complete.
  subroutine count_frames(file, frames)
    type(h5_file_t), intent(inout) :: file
    integer, intent(in) :: frames

    call file%flush()
    call file%attribute(steps, 'NSteps', frames)
    call file%flush()
  end subroutine count_frames

  !> Write a frame as number `frames_before` + 1, in the place of one that only ended an earlier
  !! run.
  subroutine write_field_frame(self, frames_before, state)
    type(field_file_t), intent(inout) :: self
    integer, intent(in) :: frames_before   !! due frames written so far
    type(run_state_t), intent(in) :: state

    if (self%rows /= frames_before) call drop_frames(frames_before, self)
    call self%file%reserve(self%bytes_for_row())
    call self%begin(appending)
    call list_fields(state, self)
    self%rows = self%rows + 1
    call count_frames(self%file, self%rows)
  end subroutine write_field_frame

  !> Share of liquid in the fluid of each cell; in cells without fluid the extended share.
  pure subroutine liquid_share(grid, liquid, fluid_volume, c, values)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous, dimension(grid%first(1):, grid%first(2):, grid%first(3):) :: &
      liquid, fluid_volume
      !! [m3]
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    real(sp), intent(out) :: values(:)
    real(wp), parameter :: no_volume = 1.0e-9_wp   !! of the cell volume
    integer :: i, j, k, m

    m = 0
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          m = m + 1
          if (fluid_volume(i, j, k) > no_volume*grid%volume) then
            values(m) = real(min(1.0_wp, max(0.0_wp, liquid(i, j, k)/fluid_volume(i, j, k))), sp)
          else
            values(m) = real(c(i, j, k), sp)
          end if
        end do
      end do
    end do
  end subroutine liquid_share

  !> The cells of this process in single precision, in a row.
  pure subroutine single(grid, a, values)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: a(grid%first(1):, grid%first(2):, grid%first(3):)
    real(sp), intent(out) :: values(:)
    integer :: i, j, k, m

    m = 0
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          m = m + 1
          values(m) = real(a(i, j, k), sp)
        end do
      end do
    end do
  end subroutine single

  !> The same for a vector, its components next to one another.
  pure subroutine single_vector(grid, a, values)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: a(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(sp), intent(out) :: values(:)
    integer :: i, j, k, m

    m = 0
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          values(m + 1:m + 3) = real(a(i, j, k, :), sp)
          m = m + 3
        end do
      end do
    end do
  end subroutine single_vector

  !> Create the file of the surfaces without frames; the root process alone.
  subroutine create_block_file(path, blocks, self)
    character(*), intent(in) :: path
    type(blocks_t), intent(in) :: blocks
    type(block_file_t), intent(out) :: self

    if (.not. is_root()) return
    self%n_points = count_points(blocks)
    self%n_cells = count_cells(blocks)
    associate (file => self%file)
      call file%create(path, .false.)
      call start_file(file, 'PolyData')
      call file%store_wide_integers(root//'/NumberOfPoints', '1', [self%n_points])
      call write_cells(blocks, file)
      call file%group(root//'/PointData')
      call start_steps(file)
      call file%group(steps//'/CellDataOffsets')
      call file%group(steps//'/PointDataOffsets')
      self%chunk_bytes = frame_chunk
      call self%begin(creating)
      call list_surfaces(0.0_wp, blocks, self)
      call file%flush()
    end associate
  end subroutine create_block_file

  !> The columns of the surfaces, see `table_m`.
  subroutine list_surfaces(t, blocks, self)
    real(wp), intent(in) :: t   !! [s]
    type(blocks_t), intent(in) :: blocks
    type(block_file_t), intent(inout) :: self
    real(wp), allocatable :: x(:, :), v(:, :)

    allocate (x(3, self%n_points), v(3, self%n_points))
    call move_points(blocks, x, v)
    call self%column(steps//'/Values', 's', t)
    call self%points(root//'/Points', 'm', .false., x)
    call self%points(root//'/PointData/velocity', 'm/s', .true., v)
    call self%cells(cell_data//'released', '1', on_cells(blocks, merge(1, 0, blocks%present)))
    associate (frame => int(self%rows, i8), none => [0_i8, 0_i8, 0_i8, 0_i8])
      call self%column(steps//'/PartOffsets', '1', 0_i8)
      call self%column(steps//'/NumberOfParts', '1', 1_i8)
      call self%column(steps//'/PointOffsets', '1', frame*self%n_points)
      call self%column(steps//'/CellOffsets', '1', none)
      call self%column(steps//'/ConnectivityIdOffsets', '1', none)
      call self%column(steps//'/CellDataOffsets/body', '1', 0_i8)
      call self%column(steps//'/CellDataOffsets/fixed', '1', 0_i8)
      call self%column(steps//'/CellDataOffsets/released', '1', frame*self%n_cells)
      call self%column(steps//'/PointDataOffsets/velocity', '1', frame*self%n_points)
    end associate
  end subroutine list_surfaces

  !> Places and velocities of the points of all blocks.
  pure subroutine move_points(blocks, x, v)
    type(blocks_t), intent(in) :: blocks
    real(wp), intent(out) :: x(:, :), v(:, :)   !! (3, points) [m], [m/s]
    real(wp) :: arm(3), r(3, 3)
    integer :: b, i, m

    m = 0
    do b = 1, blocks%n
      r = rotation_matrix(blocks%q(:, b))
      associate (point => blocks%shapes(blocks%shape(b))%point)
        do i = 1, size(point, 2)
          arm = matmul(r, point(:, i))
          m = m + 1
          x(:, m) = blocks%x(:, b) + arm
          v(:, m) = blocks%v(:, b) + cross(blocks%omega(:, b), arm)
        end do
      end associate
    end do
  end subroutine move_points

  pure function count_points(blocks) result(n)
    type(blocks_t), intent(in) :: blocks
    integer :: n, b

    n = 0
    do b = 1, blocks%n
      n = n + size(blocks%shapes(blocks%shape(b))%point, 2)
    end do
  end function count_points

  pure function count_cells(blocks) result(n)
    type(blocks_t), intent(in) :: blocks
    integer :: n, b

    n = 0
    do b = 1, blocks%n
      n = n + size(blocks%shapes(blocks%shape(b))%triangle, 2)
    end do
  end function count_cells

  !> The triangles of all blocks, the number of the block each belongs to, from 1 as in every text
  !! for people, and whether that block is fixed.
  subroutine write_cells(blocks, file)
    type(blocks_t), intent(in) :: blocks
    type(h5_file_t), intent(inout) :: file
    character(*), parameter :: other(3) = [character(8) :: 'Vertices', 'Lines', 'Strips']
    integer, allocatable :: corner(:), body(:), fixed(:)
    integer :: b, m, i, n_cells, points_before

    allocate (corner(0))
    points_before = 0
    do b = 1, blocks%n
      associate (shape => blocks%shapes(blocks%shape(b)))
        m = size(shape%triangle, 2)
        corner = [corner, reshape(shape%triangle - 1 + points_before, [3*m])]
        points_before = points_before + size(shape%point, 2)
      end associate
    end do
    body = on_cells(blocks, [(b, b=1, blocks%n)])
    fixed = on_cells(blocks, merge(1, 0, blocks%fixed))
    n_cells = size(body)
    call write_cell_group(file, root//'/Polygons', corner, [(3*i, i=0, n_cells)])
    do i = 1, size(other)
      call write_cell_group(file, root//'/'//trim(other(i)), [integer ::], [0])
    end do
    call file%group(root//'/CellData')
    call file%store(root//'/CellData/body', '1', body)
    call file%store(root//'/CellData/fixed', '1', fixed)
  end subroutine write_cells

  !> A number of each block on its triangles.
  pure function on_cells(blocks, of_block) result(of_cell)
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: of_block(:)
    integer :: of_cell(count_cells(blocks))
    integer :: b, m, first

    first = 0
    do b = 1, blocks%n
      m = size(blocks%shapes(blocks%shape(b))%triangle, 2)
      of_cell(first + 1:first + m) = of_block(b)
      first = first + m
    end do
  end function on_cells

  !> Cells of one kind.
  subroutine write_cell_group(file, name, corner, offset)
    type(h5_file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer, intent(in) :: corner(:)   !! of all cells, from 0
    integer, intent(in) :: offset(:)   !! where each cell begins, and the end

    call file%group(name)
    call file%store_wide_integers(name//'/NumberOfCells', '1', [size(offset) - 1])
    call file%store_wide_integers(name//'/NumberOfConnectivityIds', '1', [size(corner)])
    call file%store_wide_integers(name//'/Offsets', '1', offset)
    call file%store_wide_integers(name//'/Connectivity', '1', corner)
  end subroutine write_cell_group

  !> Open the file of a run that goes on from `clock`; nothing in it is changed yet.
  subroutine reopen_block_file(path, blocks, clock, self)
    character(*), intent(in) :: path
    type(blocks_t), intent(in) :: blocks
    type(clock_t), intent(in) :: clock
    type(block_file_t), intent(out) :: self

    if (.not. is_root()) return
    self%n_points = count_points(blocks)
    self%n_cells = count_cells(blocks)
    call self%file%open(path, .false., .true.)
    call self%begin(reopening)
    call list_surfaces(clock%t, blocks, self)
    call self%find_rows(clock%n_frames, clock%t)
  end subroutine reopen_block_file

  !> Drop the frames later than the start of a run that goes on.
  subroutine continue_block_file(self)
    type(block_file_t), intent(inout) :: self

    if (is_root()) call drop_frames(self%rows, self)
  end subroutine continue_block_file

  !> Write a frame as number `frames_before` + 1, in the place of one that only ended an earlier
  !! run.
  subroutine write_block_frame(self, frames_before, t, blocks)
    type(block_file_t), intent(inout) :: self
    integer, intent(in) :: frames_before   !! due frames written so far
    real(wp), intent(in) :: t              !! [s]
    type(blocks_t), intent(in) :: blocks

    if (.not. is_root()) return
    if (self%rows /= frames_before) call drop_frames(frames_before, self)
    call self%file%reserve(self%bytes_for_row())
    call self%begin(appending)
    call list_surfaces(t, blocks, self)
    self%rows = self%rows + 1
    call count_frames(self%file, self%rows)
  end subroutine write_block_frame

end module write_vtkhdf_m
