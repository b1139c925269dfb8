!> `fields.vtkhdf` and `blocks.vtkhdf`: the fluid and the surfaces of the blocks, frame by frame, as
!! ParaView and pyvista read them.
!!
!! Layout: VTKHDF 2.0, temporal ImageData (a frame is a row of each dataset) and temporal PolyData
!! (the points of all frames one after another, the triangles once). Numbers are single, but the
!! points double: map coordinates of six digits leave single ones 0.06 m. A frame is complete when
!! `Steps@NSteps` counts it, which is flushed after everything else. Source: VTK, "VTKHDF file
!! format".
module write_vtkhdf_m
  use kinds_m, only: wp, sp
  use vectors_m, only: cross, rotation_matrix
  use rigid_body_m, only: blocks_t, lowering
  use state_m, only: run_state_t
  use hdf5_file_m, only: h5_file_t, as_integer, as_wide
  use file_space_m, only: bytes_for_change
  use table_m, only: result_file_t
  implicit none
  private
  public :: field_file_t, block_file_t

  character(*), parameter :: root = '/VTKHDF', steps = '/VTKHDF/Steps', &
    cell_data = '/VTKHDF/CellData/'
  integer, parameter :: frame_chunk = 512   !! of a number per frame [bytes]

  type, extends(result_file_t) :: field_file_t
  contains
    procedure :: write_head => write_field_head
    procedure :: list_columns => list_fields
  end type field_file_t

  type, extends(result_file_t) :: block_file_t
  contains
    procedure :: write_head => write_block_head
    procedure :: list_columns => list_surfaces
  end type block_file_t

contains

  !> The grid of the fluid; all processes together.
  subroutine write_field_head(self, state)
    class(field_file_t), intent(inout) :: self
    type(run_state_t), intent(in) :: state

    associate (file => self%file, grid => state%grid)
      call file%reserve(16*bytes_for_change)
      call start_file('ImageData', self)
      call file%attribute(root, 'WholeExtent', [0, grid%n(1), 0, grid%n(2), 0, grid%n(3)])
      call file%attribute(root, 'Origin', grid%origin)
      call file%attribute(root, 'Spacing', grid%h)
      call file%attribute(root, 'Direction', [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, &
        0.0_wp, 0.0_wp, 1.0_wp])
      call file%group(root//'/CellData')
    end associate
  end subroutine write_field_head

  !> What the file is, and its list of frames, still empty.
  subroutine start_file(kind, self)
    character(*), intent(in) :: kind   !! of VTK data
    class(result_file_t), intent(inout) :: self

    call self%file%group(root)
    call self%file%attribute(root, 'Version', [2, 0])
    call self%file%attribute(root, 'Type', kind, fixed=.true.)
    call self%file%group(steps)
    call self%file%group(steps//'/CellDataOffsets')
    self%chunk_bytes = frame_chunk
  end subroutine start_file

  !> The columns of the fluid: of each field the own cells, three numbers for a vector.
  subroutine list_fields(self, state)
    class(field_file_t), intent(inout) :: self
    type(run_state_t), intent(in) :: state
    real(sp), allocatable :: values(:), velocity(:)
    integer :: n, c

    self%counter = steps
    associate (a => state%grid%lo, b => state%grid%hi, flow => state%flow)
      n = product(b - a + 1)
      call self%column(steps//'/Values', 's', state%clock%t)
      call liquid_share(state, values)
      call add('liquid', '1', [integer ::], values)
      values = reshape(real(state%solid%alpha(a(1):b(1), a(2):b(2), a(3):b(3)), sp), [n])
      call add('solid', '1', [integer ::], values)
      values = reshape(real(flow%p(a(1):b(1), a(2):b(2), a(3):b(3)), sp), [n])
      call add('pressure', 'Pa', [integer ::], values)
      allocate (velocity(3*n))
      do c = 1, 3
        velocity(c::3) = reshape(real(flow%u(a(1):b(1), a(2):b(2), a(3):b(3), c), sp), [n])
      end do
      call add('velocity', 'm/s', [3], velocity)
    end associate
  contains
    subroutine add(name, units, components, a)
      character(*), intent(in) :: name, units
      integer, intent(in) :: components(:)   !! of a vector
      real(sp), intent(in), contiguous :: a(:)

      associate (grid => state%grid)
        call self%field(cell_data//name, units, [components, grid%n], [spread(1, 1, &
          size(components)), grid%lo], [components, grid%hi - grid%lo + 1], a)
      end associate
      call self%column(steps//'/CellDataOffsets/'//name, '1', real(self%rows, wp), as_wide)
    end subroutine add
  end subroutine list_fields

  !> Share of liquid in the fluid of each cell; in cells without fluid the extended share.
  pure subroutine liquid_share(state, values)
    type(run_state_t), intent(in) :: state
    real(sp), allocatable, intent(out) :: values(:)
    real(wp), parameter :: no_volume = 1.0e-9_wp   !! of the cell volume
    integer :: i, j, k, m

    associate (grid => state%grid, flow => state%flow)
      allocate (values(product(grid%hi - grid%lo + 1)))
      m = 0
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            m = m + 1
            if (flow%fluid_volume(i, j, k) > no_volume*grid%volume) then
              values(m) = real(min(1.0_wp, max(0.0_wp, flow%liquid(i, j, k) &
                /flow%fluid_volume(i, j, k))), sp)
            else
              values(m) = real(flow%c(i, j, k), sp)
            end if
          end do
        end do
      end do
    end associate
  end subroutine liquid_share

  !> The triangles of all blocks, the number of the block each belongs to, from 1 as in every text
  !! for people, and whether that block is fixed.
  subroutine write_block_head(self, state)
    class(block_file_t), intent(inout) :: self
    type(run_state_t), intent(in) :: state
    character(*), parameter :: other(3) = [character(8) :: 'Vertices', 'Lines', 'Strips']
    integer, allocatable :: corner(:)
    integer :: b, m, i, n_points

    allocate (corner(0))
    n_points = 0
    associate (file => self%file, blocks => state%blocks)
      call start_file('PolyData', self)
      do b = 1, blocks%n
        associate (shape => blocks%shapes(blocks%shape(b)))
          m = size(shape%triangle, 2)
          corner = [corner, reshape(shape%triangle - 1 + n_points, [3*m])]
          n_points = n_points + size(shape%point, 2)
        end associate
      end do
      call file%store(root//'/NumberOfPoints', '1', [real(n_points, wp)], kind=as_wide)
      call write_cell_group(file, root//'/Polygons', corner, [(3*i, i=0, size(corner)/3)])
      do i = 1, size(other)
        call write_cell_group(file, root//'/'//trim(other(i)), [integer ::], [0])
      end do
      call file%group(root//'/CellData')
      call file%store(cell_data//'body', '1', on_cells(blocks, [(b, b=1, blocks%n)]), &
        kind=as_integer)
      call file%store(cell_data//'fixed', '1', on_cells(blocks, merge(1, 0, blocks%fixed &
        .and. blocks%status /= lowering)), kind=as_integer)
      call file%group(root//'/PointData')
      call file%group(steps//'/PointDataOffsets')
    end associate
  end subroutine write_block_head

  !> Cells of one kind.
  subroutine write_cell_group(file, name, corner, offset)
    type(h5_file_t), intent(inout) :: file
    character(*), intent(in) :: name
    integer, intent(in) :: corner(:)   !! of all cells, from 0
    integer, intent(in) :: offset(:)   !! where each cell begins, and the end

    call file%group(name)
    call file%store(name//'/NumberOfCells', '1', [size(offset) - 1.0_wp], kind=as_wide)
    call file%store(name//'/NumberOfConnectivityIds', '1', [real(size(corner), wp)], kind=as_wide)
    call file%store(name//'/Offsets', '1', real(offset, wp), kind=as_wide)
    call file%store(name//'/Connectivity', '1', real(corner, wp), kind=as_wide)
  end subroutine write_cell_group

  !> A number of each block on its triangles.
  pure function on_cells(blocks, of_block) result(of_cell)
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: of_block(:)
    real(wp), allocatable :: of_cell(:)
    integer :: b, first, n(blocks%n)

    n = [(size(blocks%shapes(blocks%shape(b))%triangle, 2), b=1, blocks%n)]
    allocate (of_cell(sum(n)))
    first = 0
    do b = 1, blocks%n
      of_cell(first + 1:first + n(b)) = of_block(b)
      first = first + n(b)
    end do
  end function on_cells

  !> The columns of the surfaces: places and velocities of the points of all blocks.
  subroutine list_surfaces(self, state)
    class(block_file_t), intent(inout) :: self
    type(run_state_t), intent(in) :: state
    real(wp), allocatable :: x(:, :), v(:, :), released(:)   ! [m], [m/s], [-]
    real(wp) :: arm(3), r(3, 3)
    integer :: b, i, m

    self%counter = steps
    associate (blocks => state%blocks, frame => real(self%rows, wp), &
               none => spread(0.0_wp, 1, 4))
      m = sum([(size(blocks%shapes(blocks%shape(b))%point, 2), b=1, blocks%n)])
      allocate (x(3, m), v(3, m))
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
      released = on_cells(blocks, merge(1, 0, blocks%present))
      call self%column(steps//'/Values', 's', state%clock%t)
      call self%points(root//'/Points', 'm', .false., x)
      call self%points(root//'/PointData/velocity', 'm/s', .true., v)
      call self%cells(cell_data//'released', '1', released)
      call self%column(steps//'/PartOffsets', '1', 0.0_wp, as_wide)
      call self%column(steps//'/NumberOfParts', '1', 1.0_wp, as_wide)
      call self%column(steps//'/PointOffsets', '1', frame*m, as_wide)
      call self%column(steps//'/CellOffsets', '1', none, kind=as_wide)
      call self%column(steps//'/ConnectivityIdOffsets', '1', none, kind=as_wide)
      call self%column(steps//'/CellDataOffsets/body', '1', 0.0_wp, as_wide)
      call self%column(steps//'/CellDataOffsets/fixed', '1', 0.0_wp, as_wide)
      call self%column(steps//'/CellDataOffsets/released', '1', frame*size(released), as_wide)
      call self%column(steps//'/PointDataOffsets/velocity', '1', frame*m, as_wide)
    end associate
  end subroutine list_surfaces

end module write_vtkhdf_m
