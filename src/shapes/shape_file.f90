!> Tetrahedra from a file: Gmsh .msh (2.2 and 4.1, ASCII) or the program's own shape file.
!!
!! The own form is plain text: words between blanks and line ends, `#` begins a remark,
!!
!!     mics-shape 1
!!     points 4
!!     0 0 0
!!     ...                    x y z of each point
!!     tets 1
!!     1 2 3 4                the four corners of each tetrahedron, points counted from 1
!!
!! Every problem comes back as one message that names the line.
module shape_file_m
  use kinds_m, only: wp
  use errors_m, only: to_text
  use file_words_m, only: words_t, read_whole, next_word, get_integer, get_real, get_count, &
    expected, complain, place_of
  implicit none
  private
  public :: read_shape_file

  integer, parameter :: highest_tag = 100000000    !! number of a point in a .msh file
  integer, parameter :: tet_type = 4               !! of Gmsh

  !> Nodes of the element types 1, 2, ... of Gmsh, and their dimension.
  integer, parameter :: nodes_of(31) = [2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1, 8, 20, &
                                        15, 13, 9, 10, 12, 15, 15, 21, 4, 5, 6, 20, 35, 56]
  integer, parameter :: dimension_of(31) = [1, 2, 2, 3, 3, 3, 3, 1, 2, 2, 3, 3, 3, 3, 0, 2, 3, &
                                            3, 3, 2, 2, 2, 2, 2, 2, 1, 1, 1, 3, 3, 3]

  !> What a .msh file holds: points by their tags, tetrahedra by tags, other solid elements.
  type :: gmsh_t
    integer :: n_point = 0, n_tet = 0, n_other = 0, n_high = 0
    integer, allocatable :: tag(:), tet(:, :)
    real(wp), allocatable :: x(:, :)
  end type gmsh_t

contains

  !> Points and tetrahedra of a file; `message` is empty, or says what is wrong with it.
  subroutine read_shape_file(file, point, tet, message)
    character(*), intent(in) :: file
    real(wp), allocatable, intent(out) :: point(:, :)   !! (3, n) as in the file
    integer, allocatable, intent(out) :: tet(:, :)      !! (4, m) corners
    character(:), allocatable, intent(out) :: message
    type(words_t) :: words
    character(:), allocatable :: word

    allocate (point(3, 0), tet(4, 0))
    call read_whole(file, words)
    word = next_word(words)
    select case (word)
    case ('mics-shape'); call read_own(words, point, tet)
    case ('$MeshFormat'); call read_gmsh(words, point, tet)
    case default
      call complain(words, 'is neither a Gmsh .msh file ($MeshFormat) nor a mics-shape file; ' &
        //'tools/make_shape.py makes one of .stl, .obj and .step')
      words%line = 0
    end select
    message = place_of(words)//words%problem
  end subroutine read_shape_file

  !> The program's own form, after its first word.
  subroutine read_own(words, point, tet)
    type(words_t), intent(inout) :: words
    real(wp), allocatable, intent(inout) :: point(:, :)
    integer, allocatable, intent(inout) :: tet(:, :)
    character(:), allocatable :: word
    integer :: n, i, k

    call get_integer(words, n)
    if (n /= 1) call complain(words, 'mics-shape '//to_text(n)//' is unknown, this program reads 1')
    do
      word = next_word(words)
      select case (word)
      case ('points')
        call get_count(words, 'points', n)
        deallocate (point)
        allocate (point(3, n))
        do i = 1, n
          do k = 1, 3
            call get_real(words, point(k, i))
          end do
        end do
      case ('tets')
        call get_count(words, 'tetrahedra', n)
        deallocate (tet)
        allocate (tet(4, n))
        do i = 1, n
          do k = 1, 4
            call get_integer(words, tet(k, i))
            if (tet(k, i) < 1 .or. tet(k, i) > size(point, 2)) then
              call complain(words, 'there is no point '//to_text(tet(k, i)))
            end if
          end do
        end do
      case ('')
        exit
      case default
        call expected(words, '''points'' or ''tets''', word)
      end select
    end do
  end subroutine read_own

  !> A .msh file after its first word.
  subroutine read_gmsh(words, point, tet)
    type(words_t), intent(inout) :: words
    real(wp), allocatable, intent(inout) :: point(:, :)
    integer, allocatable, intent(inout) :: tet(:, :)
    type(gmsh_t) :: mesh
    character(:), allocatable :: word
    real(wp) :: version
    integer :: form, i, highest
    integer, allocatable :: place(:)

    call get_real(words, version)
    call get_integer(words, form)
    if (nint(10*version) /= 22 .and. nint(10*version) /= 41) then
      call complain(words, 'this version of the .msh form is not read, 2.2 and 4.1 are')
    else if (form /= 0) then
      call complain(words, 'binary .msh files are not read, save it as ASCII')
    end if
    allocate (mesh%tag(0), mesh%x(3, 0), mesh%tet(4, 0))
    do
      word = next_word(words)
      select case (word)
      case ('$Nodes'); call read_nodes(words, version > 4.0_wp, mesh)
      case ('$Elements'); call read_elements(words, version > 4.0_wp, mesh)
      case (''); exit
      case default   ! other sections
      end select
    end do
    if (mesh%n_high > 0) then
      call complain(words, 'holds '//to_text(mesh%n_high) &
                    //' solid elements of higher order, mesh with order 1')
    else if (mesh%n_other > 0) then
      call complain(words, 'holds '//to_text(mesh%n_other) &
                    //' solid elements that are not tetrahedra')
    end if
    if (len(words%problem) > 0) return
    words%line = 0
    point = mesh%x(:, :mesh%n_point)
    tet = mesh%tet(:, :mesh%n_tet)
    if (mesh%n_point == 0 .or. mesh%n_tet == 0) return
    highest = maxval(mesh%tag(:mesh%n_point))
    if (minval(mesh%tag(:mesh%n_point)) < 1 .or. highest > highest_tag) then
      call complain(words, 'points must be numbered from 1 to at most '//to_text(highest_tag))
      return
    end if
    allocate (place(highest), source=0)
    place(mesh%tag(:mesh%n_point)) = [(i, i=1, mesh%n_point)]
    do i = 1, mesh%n_tet
      if (any(tet(:, i) < 1 .or. tet(:, i) > highest)) then
        call complain(words, 'a tetrahedron has a corner that is no point of the file')
        return
      end if
      tet(:, i) = place(tet(:, i))
      if (any(tet(:, i) == 0)) then
        call complain(words, 'a tetrahedron has a corner that is no point of the file')
        return
      end if
    end do
  end subroutine read_gmsh

  !> The section $Nodes: one list (2.2), or blocks of tags followed by coordinates (4.1).
  subroutine read_nodes(words, blocks, mesh)
    type(words_t), intent(inout) :: words
    logical, intent(in) :: blocks
    type(gmsh_t), intent(inout) :: mesh
    integer :: n_block, n, b, i, k, dimension, parametric, in_block, skip
    real(wp) :: parameter

    n_block = 1
    if (blocks) call get_count(words, 'blocks', n_block)
    call get_count(words, 'points', n)
    if (blocks) then
      call get_integer(words, skip)
      call get_integer(words, skip)
    end if
    deallocate (mesh%tag, mesh%x)
    allocate (mesh%tag(n), mesh%x(3, n))
    mesh%n_point = 0
    parametric = 0
    dimension = 0
    do b = 1, n_block
      in_block = n
      if (blocks) then
        call get_integer(words, dimension)
        call get_integer(words, skip)
        call get_integer(words, parametric)
        call get_count(words, 'points', in_block)
        if (mesh%n_point + in_block > n) call complain(words, 'more points than announced')
        if (len(words%problem) > 0) return
        do i = 1, in_block
          call get_integer(words, mesh%tag(mesh%n_point + i))
        end do
      end if
      do i = mesh%n_point + 1, mesh%n_point + in_block
        if (.not. blocks) call get_integer(words, mesh%tag(i))
        do k = 1, 3
          call get_real(words, mesh%x(k, i))
        end do
        do k = 1, merge(dimension, 0, parametric == 1)
          call get_real(words, parameter)
        end do
        if (len(words%problem) > 0) return
      end do
      mesh%n_point = mesh%n_point + in_block
    end do
  end subroutine read_nodes

  !> The section $Elements: one list (2.2), or blocks of one type (4.1). Only tetrahedra are kept.
  subroutine read_elements(words, blocks, mesh)
    type(words_t), intent(inout) :: words
    logical, intent(in) :: blocks
    type(gmsh_t), intent(inout) :: mesh
    integer :: n_block, n, b, i, k, m, in_block, skip, kind, tags

    n_block = 1
    if (blocks) call get_count(words, 'blocks', n_block)
    call get_count(words, 'elements', n)
    if (blocks) then
      call get_integer(words, skip)
      call get_integer(words, skip)
    end if
    deallocate (mesh%tet)
    allocate (mesh%tet(4, n))
    mesh%n_tet = 0
    kind = 0
    do b = 1, n_block
      in_block = n
      if (blocks) then
        call get_integer(words, skip)
        call get_integer(words, skip)
        call get_integer(words, kind)
        call get_count(words, 'elements', in_block)
      end if
      do i = 1, in_block
        call get_integer(words, skip)
        if (.not. blocks) then
          call get_integer(words, kind)
          call get_count(words, 'tags', tags)
          do k = 1, tags
            call get_integer(words, skip)
          end do
        end if
        if (kind < 1 .or. kind > size(nodes_of)) then
          call complain(words, 'element type '//to_text(kind)//' is unknown')
        else if (mesh%n_tet == n) then
          call complain(words, 'more elements than announced')
        end if
        if (len(words%problem) > 0) return
        m = mesh%n_tet + 1
        do k = 1, nodes_of(kind)
          if (kind == tet_type) then
            call get_integer(words, mesh%tet(k, m))
          else
            call get_integer(words, skip)
          end if
        end do
        if (kind == tet_type) mesh%n_tet = m
        if (dimension_of(kind) /= 3 .or. kind == tet_type) cycle
        if (any(kind == [5, 6, 7])) then
          mesh%n_other = mesh%n_other + 1
        else
          mesh%n_high = mesh%n_high + 1
        end if
      end do
    end do
  end subroutine read_elements

end module shape_file_m
