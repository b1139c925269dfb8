!> Blocks from files: the three forms give the block that was written, bad files one clear message.
module test_shape_file_m
  use kinds_m, only: wp
  use check_m, only: check
  use case_types_m, only: shape_input_t
  use tet_mesh_m, only: shape_t
  use polyhedron_m, only: tet_volume
  use shapes_builtin_m, only: make_shape
  implicit none
  private
  public :: test_shape_file

  character(*), parameter :: lf = new_line('a')
  !> A tetrahedron with legs of length 1 along the axes.
  character(*), parameter :: one_tet = 'mics-shape 1'//lf//'points 4'//lf//'0 0 0  1 0 0  0 1 0' &
    //'  0 0 1 # the last'//lf//'tets 1'//lf//'1 2 3 4'//lf
  character(*), parameter :: nodes_22 = '$MeshFormat'//lf//'2.2 0 8'//lf//'$EndMeshFormat'//lf &
    //'$Nodes'//lf//'4'//lf//'1 0 0 0'//lf//'7 1 0 0'//lf//'9 0 1e-0 0'//lf//'4 0 0 1'//lf &
    //'$EndNodes'//lf//'$Elements'//lf

contains

  subroutine test_shape_file()
    call round_trip('hexapod', 30)
    call round_trip('cube', 6)
    call round_trip('dolos', -1)
    call round_trip('tetrapod', -1)
    call round_trip('reef_cube', 86)   ! 72 would do; neighbours are joined in turn
    call small_files()
    call faults_of_form()
    call faults_of_order()
    call faults_of_mesh()
    call merged_net()
  end subroutine test_shape_file

  subroutine write_text(file, text)
    character(*), intent(in) :: file, text
    integer :: unit

    open (newunit=unit, file=file, access='stream', form='unformatted', status='replace')
    write (unit) text
    close (unit)
  end subroutine write_text

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
    type(shape_input_t) :: input
    type(shape_t) :: built, found
    character(:), allocatable :: message
    character(8), parameter :: files(3) = ['own.txt ', 'gmsh.msh', 'gm41.msh']
    real(wp) :: mm(3), x(3, 4)
    integer :: f, t, n

    input%kind = kind
    input%size = 0.02_wp
    call make_shape(input, built, message)
    call write_own(files(1), built)
    call write_gmsh_22(files(2), built)
    call write_gmsh_41(files(3), built)
    do f = 1, 3
      call read_file(trim(files(f)), 1.0e-3_wp, found, message)
      call check(kind//' from '//files(f)//message, len(message) == 0)
      if (len(message) > 0) cycle
      call check(kind//': volume', found%volume, built%volume, 1e-13_wp*built%volume)
      call check(kind//': inertia', reshape(found%inertia, [9]), reshape(built%inertia, [9]), &
                 1e-12_wp*maxval(built%inertia))
      call check(kind//': axes of the file', maxval(abs(maxval(found%point, 2) &
        - maxval(built%point, 2))), 0.0_wp, 1e-15_wp)
      call check(kind//': tetrahedra', size(found%tet, 2), size(built%tet, 2))
      call check(kind//': surface', size(found%triangle, 2), size(built%triangle, 2))
      n = facets
      if (facets < 0) n = size(built%facet) - 1
      call check(kind//': facets', size(found%facet) - 1, n)
      mm = 0.0_wp
      do t = 1, size(found%tet, 2)
        x = found%point(:, found%tet(:, t))
        if (tet_volume(x) <= 0.0_wp) mm = 1.0_wp
      end do
      call check(kind//': tetrahedra of positive volume', maxval(mm), 0.0_wp, 0.0_wp)
    end do
    call check(kind//': smallest edge of a cube of the same volume over surface', &
               kind /= 'cube' .or. abs(found%smallest_edge - 0.02_wp) < 1e-15_wp)
  end subroutine round_trip

  !> Every second tetrahedron turned inside out, and a point nobody uses.
  subroutine write_own(file, s)
    character(*), intent(in) :: file
    type(shape_t), intent(in) :: s
    integer :: unit, i

    open (newunit=unit, file=file, status='replace')
    write (unit, '(a, /, a, i0)') 'mics-shape 1', 'points ', size(s%point, 2) + 1
    do i = 1, size(s%point, 2)
      write (unit, '(3es25.16)') 1000*s%point(:, i) + [7, 8, 9]
    end do
    write (unit, '(a, /, a, i0)') '0 0 0', 'tets ', size(s%tet, 2)
    do i = 1, size(s%tet, 2)
      if (mod(i, 2) == 0) write (unit, '(4(1x, i0))') s%tet(:, i)
      if (mod(i, 2) == 1) write (unit, '(4(1x, i0))') s%tet([2, 1, 3, 4], i)
    end do
    close (unit)
  end subroutine write_own

  !> Points numbered 3, 6, 9 ...; surface triangles among the elements; other sections.
  subroutine write_gmsh_22(file, s)
    character(*), intent(in) :: file
    type(shape_t), intent(in) :: s
    integer :: unit, i

    open (newunit=unit, file=file, status='replace')
    write (unit, '(a)') '$MeshFormat', '2.2 0 8', '$EndMeshFormat', '$PhysicalNames', '1', &
      '3 1 "the block"', '$EndPhysicalNames', '$Nodes'
    write (unit, '(i0)') size(s%point, 2)
    do i = 1, size(s%point, 2)
      write (unit, '(i0, 3es25.16)') 3*i, 1000*s%point(:, i) - [7, 8, 9]
    end do
    write (unit, '(a, /, a)') '$EndNodes', '$Elements'
    write (unit, '(i0)') size(s%tet, 2) + size(s%triangle, 2)
    do i = 1, size(s%triangle, 2)
      write (unit, '(8(1x, i0))') i, 2, 2, 1, 1, 3*s%triangle(:, i)
    end do
    do i = 1, size(s%tet, 2)
      write (unit, '(9(1x, i0))') 100000 + i, 4, 2, 1, 1, 3*s%tet(:, i)
    end do
    write (unit, '(a)') '$EndElements'
    close (unit)
  end subroutine write_gmsh_22

  !> Points in two blocks, the second with parameters; tetrahedra in two blocks.
  subroutine write_gmsh_41(file, s)
    character(*), intent(in) :: file
    type(shape_t), intent(in) :: s
    integer :: unit, i, n, half

    n = size(s%point, 2)
    open (newunit=unit, file=file, status='replace')
    write (unit, '(a)') '$MeshFormat', '4.1 0 8', '$EndMeshFormat', '$Entities', '0 0 0 1', &
      '1 0 0 0 1 1 1 0 0', '$EndEntities', '$Nodes'
    write (unit, '(4(1x, i0))') 2, n, 1, n, 2, 1, 1, n - 3
    do i = 4, n
      write (unit, '(i0)') i
    end do
    do i = 4, n
      write (unit, '(3es25.16, a)') 1000*s%point(:, i), ' 0.25 0.75'
    end do
    write (unit, '(4(1x, i0))') 3, 1, 0, 3, 1, 2, 3
    do i = 1, 3
      write (unit, '(3es25.16)') 1000*s%point(:, i)
    end do
    half = size(s%tet, 2)/2
    write (unit, '(a, /, a)') '$EndNodes', '$Elements'
    write (unit, '(4(1x, i0))') 3, size(s%triangle, 2) + size(s%tet, 2), 1, 9, 2, 1, 2, &
      size(s%triangle, 2)
    do i = 1, size(s%triangle, 2)
      write (unit, '(8(1x, i0))') i, s%triangle(:, i)
    end do
    write (unit, '(4(1x, i0))') 3, 1, 4, half
    do i = 1, half
      write (unit, '(8(1x, i0))') i, s%tet(:, i)
    end do
    write (unit, '(4(1x, i0))') 3, 2, 4, size(s%tet, 2) - half
    do i = half + 1, size(s%tet, 2)
      write (unit, '(8(1x, i0))') i, s%tet(:, i)
    end do
    write (unit, '(a)') '$EndElements'
    close (unit)
  end subroutine write_gmsh_41

  !> The surface net of a block from a file is closed, convex, and bends at every corner, also
  !! where flat regions have inward corners and holes.
  subroutine merged_net()
    type(shape_t) :: s
    character(:), allocatable :: message
    character(9), parameter :: kinds(3) = ['dolos    ', 'reef_cube', 'hexapod  ']
    type(shape_input_t) :: input
    real(wp) :: x(3, 4), total, normal(3), u(3), v(3)
    integer, allocatable :: net(:, :)
    integer :: i, m, k, n, a, b
    logical :: bent, once

    do i = 1, 3
      input%kind = kinds(i)
      input%size = 0.02_wp
      call make_shape(input, s, message)
      call write_own('own', s)
      call read_file('own', 1.0e-3_wp, s, message)
      n = size(s%point, 2)
      if (allocated(net)) deallocate (net)
      allocate (net(n, n), source=0)
      total = 0.0_wp
      bent = .true.
      do m = 1, size(s%facet) - 1
        associate (c => s%facet_point(s%facet(m):s%facet(m + 1) - 1))
          normal = 0.0_wp
          do k = 2, size(c) - 1
            x(:, 1) = 0.0_wp
            x(:, 2:4) = s%point(:, c([1, k, k + 1]))
            total = total + tet_volume(x)
            normal = normal + turn(x(:, 3) - x(:, 2), x(:, 4) - x(:, 2))
          end do
          do k = 1, size(c)
            a = c(k)
            b = c(1 + mod(k, size(c)))
            u = s%point(:, b) - s%point(:, a)
            v = s%point(:, c(1 + mod(k + 1, size(c)))) - s%point(:, b)
            bent = bent .and. dot_product(turn(u, v), normal) &
              > 1e-6_wp*norm2(u)*norm2(v)*norm2(normal)
            net(a, b) = net(a, b) + 1
          end do
        end associate
      end do
      once = all(net <= 1) .and. all(net == transpose(net))
      call check(trim(kinds(i))//': each edge joins two facets', once)
      call check(trim(kinds(i))//': facets bend at every corner', bent)
      call check(trim(kinds(i))//': facets enclose the volume', total, s%volume, &
                 1e-13_wp*s%volume)
    end do
  end subroutine merged_net

  pure function turn(u, v) result(w)
    real(wp), intent(in) :: u(3), v(3)
    real(wp) :: w(3)

    w = [u(2)*v(3) - u(3)*v(2), u(3)*v(1) - u(1)*v(3), u(1)*v(2) - u(2)*v(1)]
  end function turn

  !> Text of every system, numbers next to nothing, a point outside the tetrahedron.
  subroutine small_files()
    type(shape_t) :: s
    character(:), allocatable :: message

    call write_text('a', one_tet)
    call read_file('a', 2.0_wp, s, message)
    call check('one tetrahedron'//message, len(message) == 0)
    call check('one tetrahedron: volume', s%volume, 8.0_wp/6, 1e-15_wp)
    call write_text('a', nodes_22//'1'//achar(13)//lf//'1 4 0 1 7 9 4'//achar(13)//lf)
    call read_file('a', 1.0_wp, s, message)
    call check('Windows line ends'//message, len(message) == 0)
    call write_text('a', 'mics-shape 1 points 4 1e-330 -1.5e-33 0 1 0 0 0 1 0 0 0 1 tets 1 1 2 3 4')
    call read_file('a', 1.0_wp, s, message)
    call check('numbers as good as zero'//message, len(message) == 0)
  end subroutine small_files

  subroutine faults_of_form()
    type(shape_t) :: s
    character(:), allocatable :: message
    character(*), parameter :: neither = 'is neither a Gmsh .msh file ($MeshFormat) nor a ' &
      //'mics-shape file; tools/make_shape.py makes one of .stl, .obj and .step'

    call read_file('missing.msh', 1.0_wp, s, message)
    call check('missing: '//message, message == &
               'file = ''missing.msh'': there is no such file, or it may not be read')
    call expect('', neither)
    call expect('solid cube', neither)
    call expect('mics-shape 2', 'line 1: mics-shape 2 is unknown, this program reads 1')
    call expect('mics-shape 1'//lf//'points 2'//lf//'0 0 0 0 x 0', &
                'line 3: ''x'' stands where a number should')
    call expect('mics-shape 1'//lf//'points 2'//lf//'0 0 0'//lf//'0 nan 0', &
                'line 4: ''nan'' stands where a number should')
    call expect('mics-shape 1 points 2 0 0 0 0', &
                'line 1: the file ends where a number should stand')
    call expect('mics-shape 1 points 1000000000', &
                'line 1: the file does not hold 1000000000 points')
    call expect('mics-shape 1 points -1', 'line 1: the file does not hold -1 points')
    call expect('mics-shape 1 points 1 0 0 0'//lf//'tets 1 1 1 1 2', &
                'line 2: there is no point 2')
    call expect('mics-shape 1 faces', &
                'line 1: ''faces'' stands where ''points'' or ''tets'' should')
    call expect('$MeshFormat'//lf//'2.2 1 8', &
                'line 2: binary .msh files are not read, save it as ASCII')
    call expect('$MeshFormat'//lf//'4 0 8', &
                'line 2: this version of the .msh form is not read, 2.2 and 4.1 are')
    call expect(nodes_22//'1'//lf//'1 4 0 1 7 9', &
                'line 13: the file ends where a whole number should stand')
    call expect(nodes_22//'1'//lf//'1 4 0 1 7 9 5'//lf, &
                'line 13: a tetrahedron has the corner 5, which is no point of the file')
    call expect(nodes_22//'2'//lf//'1 4 0 1 7 9 4'//lf//'2 5 0 1 7 9 4 1 7 9 4'//lf, &
                'line 15: holds 1 solid elements that are not tetrahedra')
    call expect(nodes_22//'1'//lf//'1 11 0 1 7 9 4 1 7 9 4 1 7'//lf, &
                'line 14: holds 1 solid elements of higher order, mesh with order 1')
    call expect(nodes_22//'1'//lf//'1 99 0 1 7 9 4'//lf, 'line 13: element type 99 is unknown')
    call expect(nodes_22//'1'//lf//'1 2 0 1 7 9'//lf, 'holds no tetrahedra; a surface alone has ' &
                //'to be meshed first (tools/make_shape.py)')
  end subroutine faults_of_form

  !> Sections that are missing, stand twice or do not hold what they announce.
  subroutine faults_of_order()
    character(*), parameter :: head = '$MeshFormat'//lf//'2.2 0 8'//lf//'$EndMeshFormat'//lf
    character(*), parameter :: elements = '$Elements'//lf//'1'//lf//'1 4 0 1 2 3 4'//lf
    character(*), parameter :: head_41 = '$MeshFormat 4.1 0 8 $Nodes '

    call expect(head//elements//'$EndElements'//lf, &
                'line 8: the file ends without points, the section $Nodes')
    call expect(one_tet//'points 1'//lf//'0 0 0'//lf, 'line 6: ''points'' stands a second time')
    call expect(one_tet//'tets 1'//lf//'1 2 3 4', 'line 6: ''tets'' stands a second time')
    call expect('mics-shape 1'//lf//'tets 1'//lf//'1 2 3 4', &
                'line 2: ''tets'' stands before any ''points''')
    call expect(nodes_22//'1'//lf//'1 4 0 1 7 9 4'//lf//'$Nodes'//lf//'1'//lf//'1 0 0 0'//lf, &
                'line 14: ''$Nodes'' stands where $EndElements should')
    call expect(nodes_22//'1'//lf//'1 4 0 1 7 9 4'//lf//'$EndElements'//lf//'$Nodes'//lf//'1', &
                'line 15: $Nodes stands a second time')
    call expect(nodes_22//'1'//lf//'1 4 0 1 7 9 4'//lf//'$EndElements'//lf//'$Elements'//lf//'1', &
                'line 15: $Elements stands a second time')
    call expect(head//'$Nodes'//lf//'2'//lf//'1 0 0 0'//lf//'1 1 0 0'//lf//'$EndNodes'//lf &
                //elements, 'line 7: there are two points 1')
    call expect(head//'$Nodes'//lf//'1'//lf//'1 0 0 0'//lf//'2 1 0 0'//lf//'$EndNodes'//lf, &
                'line 7: ''2'' stands where $EndNodes should')
    call expect(head//'$Nodes'//lf//'1'//lf//'-1 0 0 0'//lf, &
                'line 6: a point has the number -1, allowed are 1 to 100000000')
    call expect(head_41//'1 2 1 2 2000000000 1 1 2 1 2 0 0 0 1 1 1 $EndNodes', &
                'line 1: 2000000000 stands where a dimension, 0 to 3, should')
    call expect(head_41//'1 2 1 2 3 1 0 1 1 0 0 0 $EndNodes', &
                'line 1: fewer points than announced')
    call expect(head_41//'1 1 1 1 3 1 0 2 1 2 0 0 0 1 1 1 $EndNodes', &
                'line 1: more points than announced')
    call expect('mics-shape 1'//lf//'points 1'//lf//'0 0 1e30', &
                'line 3: ''1e30'' is too large a number')
    call expect('mics-shape 1'//lf//'points 99999999999', &
                'line 2: ''99999999999'' is too large for a whole number')
    call expect('mics-shape 1 '//repeat('x', 100000), 'line 1: '''//repeat('x', 57) &
                //'...'' stands where ''points'' or ''tets'' should')
  end subroutine faults_of_order

  subroutine faults_of_mesh()
    character(*), parameter :: five = 'mics-shape 1 points 5 0 0 0 1 0 0 0 1 0 0 0 1 '

    call expect('mics-shape 1 points 4 0 0 0 1 0 0 0 1 0 1 1 0 tets 1 1 2 3 4', &
                '1 tetrahedra are flat')
    call expect(five//'1 1 1 tets 2 1 2 3 4 1 2 3 5', 'tetrahedra overlap at 1 of their faces')
    call expect('mics-shape 1 points 6 0 0 0 1 0 0 0 1 0 0 0 1 0 0 -1 .2 .2 -1 ' &
                //'tets 3 1 2 3 4 1 2 3 5 1 2 3 6', 'tetrahedra overlap at 1 of their faces')
    call expect('mics-shape 1 points 8 0 0 0 1 0 0 0 1 0 0 0 1  0 0 0 1 0 0 0 1 0 0 0 -1 ' &
                //'tets 2 1 2 3 4 5 6 7 8', '3 points stand in the place of another, join them')
    call expect('mics-shape 1 points 6 0 0 0 1 0 0 0 1 0 0 0 1  0 -1 0 0 -.2 -1 ' &
                //'tets 2 1 2 3 4 1 2 5 6', 'the surface meets itself along 1 edges')
    call expect('mics-shape 1 points 8 0 0 0 1 0 0 0 1 0 0 0 1  2 0 0 3 0 0 2 1 0 2 0 1 ' &
                //'tets 2 1 2 3 4 5 6 7 8', 'falls into 2 separate pieces')
  end subroutine faults_of_mesh

  !> The file with this text is refused with this message.
  subroutine expect(text, problem)
    character(*), intent(in) :: text, problem
    type(shape_t) :: s
    character(:), allocatable :: message

    call write_text('bad', text)
    call read_file('bad', 1.0_wp, s, message)
    call check('message: '//problem, message == 'file = ''bad'': '//problem)
    if (message /= 'file = ''bad'': '//problem) write (*, '(2a)') '  got: ', message
  end subroutine expect

end module test_shape_file_m
