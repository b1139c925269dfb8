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
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use rigid_body_m, only: blocks_t
  use clock_m, only: clock_t
  use hdf5_file_m, only: h5_file_t, h5_column_t, file_real32, file_real64, file_integer32, &
    file_integer64
  use file_space_m, only: bytes_for_change
  implicit none
  private
  public :: field_file_t, create_field_file, reopen_field_file, continue_field_file, &
    write_field_frame
  public :: block_file_t, create_block_file, reopen_block_file, continue_block_file, &
    write_block_frame

  character(*), parameter :: root = '/VTKHDF', steps = '/VTKHDF/Steps'
  integer, parameter :: n_scalars = 3
  character(*), parameter :: scalar_name(n_scalars) = [character(8) :: 'liquid', 'solid', &
    'pressure']
  character(*), parameter :: scalar_units(n_scalars) = [character(2) :: '1', '1', 'Pa']
  integer, parameter :: chunk_bytes = 2**18    !! of a compressed field
  integer, parameter :: chunk_frames = 64      !! of a number per frame

  type :: field_file_t
    type(h5_file_t) :: file
    integer :: frames = 0
    logical :: up_to_date = .false.   !! a run that goes on has a frame of its very start
    type(h5_column_t), private :: scalar(n_scalars), velocity, time, offset(n_scalars + 1)
    real(sp), allocatable, &
      private :: values(:)   !! of the cells of this process, three for a vector
  end type field_file_t

  type :: block_file_t
    type(h5_file_t) :: file
    integer :: frames = 0
    logical :: up_to_date = .false.   !! a run that goes on has a frame of its very start
    integer, private :: n_points = 0, n_cells = 0
    type(h5_column_t), private :: points, velocity, released, time
    type(h5_column_t), private :: part_offset, parts, point_offset, cell_offset, connectivity_offset
    type(h5_column_t), private :: body_offset, fixed_offset, released_offset, velocity_offset
  end type block_file_t

contains

  !> Create the file of the fluid without frames; all processes together.
  subroutine create_field_file(path, grid, self)
    character(*), intent(in) :: path
    type(grid_t), intent(in) :: grid
    type(field_file_t), intent(out) :: self
    integer :: s, layers

    associate (file => self%file, n => grid%n)
      call file%create(path, .true.)
      call start_file(file, 'ImageData')
      call file%attribute(root, 'WholeExtent', [0, n(1), 0, n(2), 0, n(3)])
      call file%attribute(root, 'Origin', grid%origin)
      call file%attribute(root, 'Spacing', grid%h)
      call file%attribute(root, 'Direction', [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
        0.0_wp, 0.0_wp, 1.0_wp])
      call file%group(root//'/CellData')
      layers = max(1, chunk_bytes/(4*n(1)*n(2)))
      do s = 1, n_scalars
        call file%new_compressed_column(root//'/CellData/'//trim(scalar_name(s)), &
                                        trim(scalar_units(s)), file_real32, n, 1, layers, &
                                        self%scalar(s))
      end do
      call file%new_compressed_column(root//'/CellData/velocity', 'm/s', file_real32, [3, n], &
                                      1, max(1, layers/3), self%velocity)
      call start_steps(file, self%time)
      call file%group(steps//'/CellDataOffsets')
      do s = 1, n_scalars + 1
        call file%new_column(offset_name(s), '1', file_integer64, [integer ::], chunk_frames, &
          self%offset(s))
      end do
      call file%flush()
    end associate
    call reserve(grid, self)
  end subroutine create_field_file

  !> Where the offsets of a field stand.
  pure function offset_name(s) result(name)
    integer, intent(in) :: s   !! number of the scalar, or n_scalars + 1 for the velocity
    character(:), allocatable :: name

    name = steps//'/CellDataOffsets/velocity'
    if (s <= n_scalars) name = steps//'/CellDataOffsets/'//trim(scalar_name(s))
  end function offset_name

  subroutine reserve(grid, self)
    type(grid_t), intent(in) :: grid
    type(field_file_t), intent(inout) :: self

    allocate (self%values(3*product(grid%hi - grid%lo + 1)))
  end subroutine reserve

  !> The attributes that say what the file is.
  subroutine start_file(file, kind)
    type(h5_file_t), intent(inout) :: file
    character(*), intent(in) :: kind   !! of VTK data

    call file%group(root)
    call file%attribute(root, 'Version', [2, 0])
    call file%fixed_text_attribute(root, 'Type', kind)
  end subroutine start_file

  !> The list of frames, still empty.
  subroutine start_steps(file, time)
    type(h5_file_t), intent(inout) :: file
    type(h5_column_t), intent(out) :: time

    call file%group(steps)
    call file%attribute(steps, 'NSteps', 0)
    call file%new_column(steps//'/Values', 's', file_real64, [integer ::], chunk_frames, time)
  end subroutine start_steps

  !> Open the file of a run that goes on from `clock`; nothing in it is changed yet.
  subroutine reopen_field_file(path, clock, self)
    character(*), intent(in) :: path
    type(clock_t), intent(in) :: clock
    type(field_file_t), intent(out) :: self
    integer :: s

    associate (file => self%file)
      call file%open(path, .true., .true.)
      do s = 1, n_scalars
        call file%open_column(root//'/CellData/'//trim(scalar_name(s)), file_real32, self%scalar(s))
      end do
      call file%open_column(root//'/CellData/velocity', file_real32, self%velocity)
      call file%open_column(steps//'/Values', file_real64, self%time)
      do s = 1, n_scalars + 1
        call file%open_column(offset_name(s), file_integer64, self%offset(s))
      end do
      call file%count_rows(self%time, clock%n_frames, clock%t, self%frames, self%up_to_date)
    end associate
  end subroutine reopen_field_file

  !> Drop the frames later than the start of a run that goes on.
  subroutine continue_field_file(grid, self)
    type(grid_t), intent(in) :: grid
    type(field_file_t), intent(inout) :: self

    call drop_field_frames(self)
    call reserve(grid, self)
  end subroutine continue_field_file

  !> Keep the first `self%frames` frames.
  subroutine drop_field_frames(self)
    type(field_file_t), intent(inout) :: self
    integer :: s

    associate (file => self%file, frames => self%frames)
      call count_frames(file, frames)
      do s = 1, n_scalars
        call file%resize(self%scalar(s), int(frames, i8))
      end do
      call file%resize(self%velocity, int(frames, i8))
      call file%resize(self%time, int(frames, i8))
      do s = 1, n_scalars + 1
        call file%resize(self%offset(s), int(frames, i8))
      end do
      call file%flush()
    end associate
  end subroutine drop_field_frames

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
  subroutine write_field_frame(self, frames_before, t, grid, flow, solid)
    type(field_file_t), intent(inout) :: self
    integer, intent(in) :: frames_before   !! due frames written so far
    real(wp), intent(in) :: t              !! [s]
    type(grid_t), intent(in) :: grid
    type(flow_t), intent(in) :: flow
    type(solid_geometry_t), intent(in) :: solid
    integer :: s, n

    if (self%frames /= frames_before) then
      self%frames = frames_before
      call drop_field_frames(self)
    end if
    call self%file%reserve(bytes_for_field_frame(self))
    n = product(grid%hi - grid%lo + 1)
    associate (file => self%file, first => grid%lo, extent => grid%hi - grid%lo + 1, &
      values => self%values)
      call liquid_share(grid, flow%liquid, flow%fluid_volume, flow%c, values)
      call file%append_block(self%scalar(1), first, extent, values(:n))
      call single(grid, solid%alpha, values)
      call file%append_block(self%scalar(2), first, extent, values(:n))
      call single(grid, flow%p, values)
      call file%append_block(self%scalar(3), first, extent, values(:n))
      call single_vector(grid, flow%u, values)
      call file%append_block(self%velocity, [1, first], [3, extent], values(:3*n))
      call file%append(self%time, [t])
      do s = 1, n_scalars + 1
        call file%append_wide(self%offset(s), [int(self%frames, i8)])
      end do
      self%frames = self%frames + 1
      call count_frames(file, self%frames)
    end associate
  end subroutine write_field_frame

  !> Most that another frame takes at the end of the file [bytes].
  pure function bytes_for_field_frame(self) result(bytes)
    type(field_file_t), intent(in) :: self
    integer(i8) :: bytes
    integer :: s

    bytes = bytes_for_change + self%velocity%bytes_for(1) + self%time%bytes_for(1)
    do s = 1, n_scalars
      bytes = bytes + self%scalar(s)%bytes_for(1)
    end do
    do s = 1, n_scalars + 1
      bytes = bytes + self%offset(s)%bytes_for(1)
    end do
  end function bytes_for_field_frame

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
    associate (file => self%file, n => self%n_points)
      call file%create(path, .false.)
      call start_file(file, 'PolyData')
      call file%store_wide_integers(root//'/NumberOfPoints', '1', [n])
      call file%new_compressed_column(root//'/Points', 'm', file_real64, [3], n, 3, self%points)
      call write_cells(blocks, file)
      call file%new_column(root//'/CellData/released', '1', file_integer32, [integer ::], &
        self%n_cells, self%released)
      call file%group(root//'/PointData')
      call file%new_compressed_column(root//'/PointData/velocity', 'm/s', file_real32, [3], n, &
                                      3, self%velocity)
      call start_steps(file, self%time)
      call file%group(steps//'/CellDataOffsets')
      call file%group(steps//'/PointDataOffsets')
      call file%new_column(steps//'/PartOffsets', '1', file_integer64, [integer ::], chunk_frames, &
        self%part_offset)
      call file%new_column(steps//'/NumberOfParts', '1', file_integer64, [integer ::], &
        chunk_frames, self%parts)
      call file%new_column(steps//'/PointOffsets', '1', file_integer64, [integer ::], &
        chunk_frames, self%point_offset)
      call file%new_column(steps//'/CellOffsets', '1', file_integer64, [4], chunk_frames, &
        self%cell_offset)
      call file%new_column(steps//'/ConnectivityIdOffsets', '1', file_integer64, [4], &
        chunk_frames, &
                           self%connectivity_offset)
      call file%new_column(steps//'/CellDataOffsets/body', '1', file_integer64, [integer ::], &
        chunk_frames, self%body_offset)
      call file%new_column(steps//'/CellDataOffsets/fixed', '1', file_integer64, [integer ::], &
        chunk_frames, self%fixed_offset)
      call file%new_column(steps//'/CellDataOffsets/released', '1', file_integer64, [integer ::], &
        chunk_frames, self%released_offset)
      call file%new_column(steps//'/PointDataOffsets/velocity', '1', file_integer64, [integer ::], &
        chunk_frames, &
                           self%velocity_offset)
      call file%flush()
    end associate
  end subroutine create_block_file

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
    associate (file => self%file)
      call file%open(path, .false., .true.)
      call file%open_column(root//'/Points', file_real64, self%points)
      call file%open_column(root//'/PointData/velocity', file_real32, self%velocity)
      call file%open_column(root//'/CellData/released', file_integer32, self%released)
      call file%open_column(steps//'/Values', file_real64, self%time)
      call file%open_column(steps//'/PartOffsets', file_integer64, self%part_offset)
      call file%open_column(steps//'/NumberOfParts', file_integer64, self%parts)
      call file%open_column(steps//'/PointOffsets', file_integer64, self%point_offset)
      call file%open_column(steps//'/CellOffsets', file_integer64, self%cell_offset)
      call file%open_column(steps//'/ConnectivityIdOffsets', file_integer64, &
        self%connectivity_offset)
      call file%open_column(steps//'/CellDataOffsets/body', file_integer64, self%body_offset)
      call file%open_column(steps//'/CellDataOffsets/fixed', file_integer64, self%fixed_offset)
      call file%open_column(steps//'/CellDataOffsets/released', file_integer64, &
        self%released_offset)
      call file%open_column(steps//'/PointDataOffsets/velocity', file_integer64, &
        self%velocity_offset)
      call file%count_rows(self%time, clock%n_frames, clock%t, self%frames, self%up_to_date)
    end associate
  end subroutine reopen_block_file

  !> Drop the frames later than the start of a run that goes on.
  subroutine continue_block_file(self)
    type(block_file_t), intent(inout) :: self

    if (is_root()) call drop_block_frames(self)
  end subroutine continue_block_file

  !> Keep the first `self%frames` frames.
  subroutine drop_block_frames(self)
    type(block_file_t), intent(inout) :: self

    associate (file => self%file, frames => self%frames)
      call count_frames(file, frames)
      call file%resize(self%points, int(frames, i8)*self%n_points)
      call file%resize(self%velocity, int(frames, i8)*self%n_points)
      call file%resize(self%released, int(frames, i8)*self%n_cells)
      call file%resize(self%time, int(frames, i8))
      call file%resize(self%part_offset, int(frames, i8))
      call file%resize(self%parts, int(frames, i8))
      call file%resize(self%point_offset, int(frames, i8))
      call file%resize(self%cell_offset, int(frames, i8))
      call file%resize(self%connectivity_offset, int(frames, i8))
      call file%resize(self%body_offset, int(frames, i8))
      call file%resize(self%fixed_offset, int(frames, i8))
      call file%resize(self%released_offset, int(frames, i8))
      call file%resize(self%velocity_offset, int(frames, i8))
      call file%flush()
    end associate
  end subroutine drop_block_frames

  !> Write a frame as number `frames_before` + 1, in the place of one that only ended an earlier
  !! run.
  subroutine write_block_frame(self, frames_before, t, blocks)
    type(block_file_t), intent(inout) :: self
    integer, intent(in) :: frames_before   !! due frames written so far
    real(wp), intent(in) :: t              !! [s]
    type(blocks_t), intent(in) :: blocks
    real(wp), allocatable :: x(:, :), v(:, :)
    real(wp) :: arm(3), r(3, 3)
    integer :: b, i, m

    if (.not. is_root()) return
    if (self%frames /= frames_before) then
      self%frames = frames_before
      call drop_block_frames(self)
    end if
    call self%file%reserve(bytes_for_block_frame(self))
    allocate (x(3, self%n_points), v(3, self%n_points))
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
    associate (file => self%file, n => self%n_points, none => [0_i8, 0_i8, 0_i8, 0_i8])
      call file%append_rows(self%points, n, reshape(x, [3*n]))
      call file%append_rows(self%velocity, n, reshape(v, [3*n]))
      call file%append_integers(self%released, on_cells(blocks, merge(1, 0, blocks%present)), &
        self%n_cells)
      call file%append(self%time, [t])
      call file%append_wide(self%part_offset, [0_i8])
      call file%append_wide(self%parts, [1_i8])
      call file%append_wide(self%point_offset, [int(self%frames, i8)*n])
      call file%append_wide(self%cell_offset, none)
      call file%append_wide(self%connectivity_offset, none)
      call file%append_wide(self%body_offset, [0_i8])
      call file%append_wide(self%fixed_offset, [0_i8])
      call file%append_wide(self%released_offset, [int(self%frames, i8)*self%n_cells])
      call file%append_wide(self%velocity_offset, [int(self%frames, i8)*n])
      self%frames = self%frames + 1
      call count_frames(file, self%frames)
    end associate
  end subroutine write_block_frame

  !> Most that another frame takes at the end of the file [bytes].
  pure function bytes_for_block_frame(self) result(bytes)
    type(block_file_t), intent(in) :: self
    integer(i8) :: bytes

    bytes = bytes_for_change + self%points%bytes_for(self%n_points) &
      + self%velocity%bytes_for(self%n_points) + self%released%bytes_for(self%n_cells) &
      + self%time%bytes_for(1) + self%fixed_offset%bytes_for(1) &
      + self%released_offset%bytes_for(1) + self%part_offset%bytes_for(1) &
      + self%parts%bytes_for(1) + self%point_offset%bytes_for(1) + self%cell_offset%bytes_for(1) &
      + self%connectivity_offset%bytes_for(1) + self%body_offset%bytes_for(1) &
      + self%velocity_offset%bytes_for(1)
  end function bytes_for_block_frame

end module write_vtkhdf_m
