!> Blocks from files: the three forms give the block that was written.
module test_shape_file_m
  use check_m, only: check, wp
  use case_types_m, only: shape_input_t
  use case_text_m, only: shape_of
  use tet_mesh_m, only: shape_t
  use polyhedron_m, only: tet_volume
  use shapes_builtin_m, only: make_shape
  use surface_nets_m, only: check_net
  implicit none
  private
  public :: test_shape_file

contains

  subroutine test_shape_file()
    call round_trip('hexapod', 30)
    call round_trip('cube', 6)
    call round_trip('dolos', -1)
    call round_trip('tetrapod', -1)
    call round_trip('reef_cube', 86)   ! 72 would do; neighbours are joined in turn
    call merged_net()
  end subroutine test_shape_file

  subroutine read_file(file, scale, shape, message)
    character(*), intent(in) :: file
    real(wp), intent(in) :: scale
    type(shape_t), intent(out) :: shape
    character(:), allocatable, intent(out) :: message
    type(shape_input_t) :: input

    input%name = 'block'
    input%kind = 'file'
    input%file = file
    input%scale = scale
    call make_shape(input, shape, message)
  end subroutine read_file

  !> Write a built-in block, moved and in mm, in each form, and read it back.
  subroutine round_trip(kind, facets)
    character(*), intent(in) :: kind
    integer, intent(in) :: facets   !! flat convex regions of the surface; < 0: as built
    type(shape_t) :: built, found
    character(:), allocatable :: message
    character(8), parameter :: files(3) = ['own.txt ', 'gmsh.msh', 'gm41.msh']
    integer :: f, t, n

    built = shape_of('size=.02 kind="'//kind//'"')
    call write_own(files(1), built)
    call write_gmsh_22(files(2), built)
    call write_gmsh_41(files(3), built)
    do f = 1, 3
      call read_file(trim(files(f)), 1.0e-3_wp, found, message)
      call check(kind//' from '//files(f)//message, len(message) == 0)
      if (len(message) > 0) cycle
      call check(kind//': volume', found%volume, built%volume, 1e-13_wp*built%volume)
      call check(kind//': inertia', [found%inertia], [built%inertia], &
                 1e-12_wp*maxval(built%inertia))
      call check(kind//': axes', maxval(found%point, 2) - maxval(built%point, 2), 0.0_wp, 1e-15_wp)
      call check(kind//': tetrahedra', size(found%tet, 2), size(built%tet, 2))
      call check(kind//': surface', size(found%triangle, 2), size(built%triangle, 2))
      n = facets
      if (facets < 0) n = size(built%facet) - 1
      call check(kind//': facets', size(found%facet) - 1, n)
      call check(kind//': tetrahedra of positive volume', &
        all([(tet_volume(found%point(:, found%tet(:, t))) > 0.0_wp, t=1, size(found%tet, 2))]))
    end do
    call check(kind//': smallest edge of a cube of the same volume over surface', &
               kind /= 'cube' .or. abs(found%smallest_edge - 0.02_wp) < 1e-15_wp)
  end subroutine round_trip

  !> Every second tetrahedron turned inside out, and a point nobody uses.
  subroutine write_own(file, s)
    character(*), intent(in) :: file
    type(shape_t), intent(in) :: s
    integer :: unit, i, n

    n = size(s%tet, 2)
    open (newunit=unit, file=file, status='replace')
    write (unit, '(a, /, a, i0)') 'mics-shape 1', 'points ', size(s%point, 2) + 1
    write (unit, '(3es25.16)') (1000*s%point(:, i) + [7, 8, 9], i=1, size(s%point, 2))
    write (unit, '(a, /, a, i0)') '0 0 0', 'tets ', n
    write (unit, '(4(1x, i0))') (merge(s%tet(:, i), s%tet([2, 1, 3, 4], i), mod(i, 2) == 0), &
      i=1, n)
    close (unit)
  end subroutine write_own

  !> Points numbered 3, 6, 9 ...; surface triangles among the elements; other sections.
  subroutine write_gmsh_22(file, s)
    character(*), intent(in) :: file
    type(shape_t), intent(in) :: s
    integer :: unit, i

    associate (n => size(s%point, 2), n_tri => size(s%triangle, 2), n_tet => size(s%tet, 2))
      open (newunit=unit, file=file, status='replace')
      write (unit, '(a)') '$MeshFormat', '2.2 0 8', '$EndMeshFormat', '$PhysicalNames', '1', &
        '3 1 "the block"', '$EndPhysicalNames', '$Nodes'
      write (unit, '(i0)') n
      write (unit, '(i0, 3es25.16)') (3*i, 1000*s%point(:, i) - [7, 8, 9], i=1, n)
      write (unit, '(a, /, a, /, i0)') '$EndNodes', '$Elements', n_tet + n_tri
      write (unit, '(8(1x, i0))') (i, 2, 2, 1, 1, 3*s%triangle(:, i), i=1, n_tri)
      write (unit, '(9(1x, i0))') (100000 + i, 4, 2, 1, 1, 3*s%tet(:, i), i=1, n_tet)
      write (unit, '(a)') '$EndElements'
      close (unit)
    end associate
  end subroutine write_gmsh_22

  !> Points in two blocks, the first with parameters; tetrahedra in two blocks.
  subroutine write_gmsh_41(file, s)
    character(*), intent(in) :: file
    type(shape_t), intent(in) :: s
    integer :: unit, i

    associate (n => size(s%point, 2), n_tri => size(s%triangle, 2), n_tet => size(s%tet, 2), &
      half => size(s%tet, 2)/2)
      open (newunit=unit, file=file, status='replace')
      write (unit, '(a)') '$MeshFormat', '4.1 0 8', '$EndMeshFormat', '$Entities', '0 0 0 1', &
        '1 0 0 0 1 1 1 0 0', '$EndEntities', '$Nodes'
      write (unit, '(4(1x, i0))') 2, n, 1, n, 2, 1, 1, n - 3
      write (unit, '(i0)') (i, i=4, n)
      write (unit, '(3es25.16, a)') (1000*s%point(:, i), ' 0.25 0.75', i=4, n)
      write (unit, '(4(1x, i0))') 3, 1, 0, 3, 1, 2, 3
      write (unit, '(3es25.16)') 1000*s%point(:, :3)
      write (unit, '(a, /, a)') '$EndNodes', '$Elements'
      write (unit, '(4(1x, i0))') 3, n_tri + n_tet, 1, 9, 2, 1, 2, n_tri
      write (unit, '(8(1x, i0))') (i, s%triangle(:, i), i=1, n_tri)
      write (unit, '(4(1x, i0))') 3, 1, 4, half
      write (unit, '(8(1x, i0))') (i, s%tet(:, i), i=1, half)
      write (unit, '(4(1x, i0))') 3, 2, 4, n_tet - half
      write (unit, '(8(1x, i0))') (i, s%tet(:, i), i=half + 1, n_tet)
      write (unit, '(a)') '$EndElements'
      close (unit)
    end associate
  end subroutine write_gmsh_41

  !> The surface net of a block from a file is closed, convex, and bends at every corner, also
  !! where flat regions have inward corners and holes.
  subroutine merged_net()
    type(shape_t) :: s
    character(:), allocatable :: message
    character(9), parameter :: kinds(3) = ['dolos    ', 'reef_cube', 'hexapod  ']
    integer :: i

    do i = 1, 3
      call write_own('own', shape_of('size=.02 kind="'//trim(kinds(i))//'"'))
      call read_file('own', 1.0e-3_wp, s, message)
      call check_net(trim(kinds(i)), s%point, s%facet, s%facet_point, volume=s%volume)
    end do
  end subroutine merged_net

end module test_shape_file_m
