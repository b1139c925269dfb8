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
    expected, report, place_of
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
    integer :: n_tet = 0, n_other = 0, n_high = 0
    integer, allocatable :: tag(:), tet(:, :)
    integer, allocatable :: point_line(:), tet_line(:)   !! where they stand in the file
    real(wp), allocatable :: x(:, :)
  end type gmsh_t

contains

  !> Points and tetrahedra of a file; `message` is empty, or says what is wrong with it: then there
  !! are none of either. Every corner of a tetrahedron is a point.
  subroutine read_shape_file(file, point, tet, message)
    character(*), intent(in) :: file
    real(wp), allocatable, intent(out) :: point(:, :)   !! (3, n) as in the file
    integer, allocatable, intent(out) :: tet(:, :)      !! (4, m) corners
    character(:), allocatable, intent(out) :: message
    type(words_t) :: words
    character(:), allocatable :: word

    call read_whole(file, words)
    word = next_word(words)
    select case (word)
    case ('mics-shape'); call read_own(words, point, tet)
    case ('$MeshFormat'); call read_gmsh(words, point, tet)
    case default
      call report(words, 'is neither a Gmsh .msh file ($MeshFormat) nor a mics-shape file; ' &
        //'tools/make_shape.py makes one of .stl, .obj and .step')
      words%line = 0
    end select
    message = place_of(words)//words%problem
    if (len(message) == 0 .and. allocated(point) .and. allocated(tet)) return
    if (allocated(point)) deallocate (point)
    if (allocated(tet)) deallocate (tet)
    allocate (point(3, 0), tet(4, 0))
  end subroutine read_shape_file

  !> The program's own form, after its first word: points, then tetrahedra, each once.
  subroutine read_own(words, point, tet)
    type(words_t), intent(inout) :: words
    real(wp), allocatable, intent(inout) :: point(:, :)
    integer, allocatable, intent(inout) :: tet(:, :)
    character(:), allocatable :: word
    integer :: n, i, k

    call get_integer(words, n)
    if (n /= 1) call report(words, 'mics-shape '//to_text(n)//' is unknown, this program reads 1')
    do
      word = next_word(words)
      select case (word)
      case ('points')
        if (allocated(point)) call report(words, '''points'' stands a second time')
        call get_count(words, 'points', 3, n)
        if (len(words%problem) > 0) return
        allocate (point(3, n))
        do i = 1, n
          do k = 1, 3
            call get_real(words, point(k, i))
          end do
          if (len(words%problem) > 0) return
        end do
      case ('tets')
        if (.not. allocated(point)) call report(words, '''tets'' stands before any ''points''')
        if (allocated(tet)) call report(words, '''tets'' stands a second time')
        call get_count(words, 'tetrahedra', 4, n)
        if (len(words%problem) > 0) return
        allocate (tet(4, n))
        do i = 1, n
          do k = 1, 4
            call get_integer(words, tet(k, i))
            if (tet(k, i) < 1 .or. tet(k, i) > size(point, 2)) then
              call report(words, 'there is no point '//to_text(tet(k, i)))
            end if
            if (len(words%problem) > 0) return
          end do
        end do
      case ('')
        return
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
    integer :: form

    call get_real(words, version)
    call get_integer(words, form)
    if (.not. (is_version(version, 2.2_wp) .or. is_version(version, 4.1_wp))) then
      call report(words, 'this version of the .msh form is not read, 2.2 and 4.1 are')
    else if (form /= 0) then
      call report(words, 'binary .msh files are not read, save it as ASCII')
    end if
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
      call report(words, 'holds '//to_text(mesh%n_high) &
                    //' solid elements of higher order, mesh with order 1')
    else if (mesh%n_other > 0) then
      call report(words, 'holds '//to_text(mesh%n_other) &
                    //' solid elements that are not tetrahedra')
    else if (.not. allocated(mesh%tag)) then
      call report(words, 'the file ends without points, the section $Nodes')
    end if
    if (len(words%problem) == 0) call number_from_one(words, mesh, point, tet)
  end subroutine read_gmsh

  !> Is a version as written the one wanted?
  pure logical function is_version(version, wanted)
    real(wp), intent(in) :: version, wanted

    is_version = abs(version - wanted) < 0.05_wp
  end function is_version

  !> Points in the order of the file, tetrahedra by the places of their corners in it.
  subroutine number_from_one(words, mesh, point, tet)
    type(words_t), intent(inout) :: words
    type(gmsh_t), intent(in) :: mesh
    real(wp), allocatable, intent(inout) :: point(:, :)
    integer, allocatable, intent(inout) :: tet(:, :)
    integer, allocatable :: place(:)
    integer :: i, k, tag

    allocate (place(max(0, maxval(mesh%tag))), source=0)
    do i = 1, size(mesh%tag)
      if (place(mesh%tag(i)) /= 0) then
        words%line = mesh%point_line(i)
        call report(words, 'there are two points '//to_text(mesh%tag(i)))
        return
      end if
      place(mesh%tag(i)) = i
    end do
    point = mesh%x
    allocate (tet(4, mesh%n_tet))
    do i = 1, mesh%n_tet
      do k = 1, 4
        tag = mesh%tet(k, i)
        tet(k, i) = 0
        if (tag >= 1 .and. tag <= size(place)) tet(k, i) = place(tag)
        if (tet(k, i) > 0) cycle
        words%line = mesh%tet_line(i)
        call report(words, 'a tetrahedron has the corner '//to_text(tag) &
                      //', which is no point of the file')
        return
      end do
    end do
  end subroutine number_from_one

  !> The section $Nodes: one list (2.2), or blocks of tags followed by coordinates (4.1).
  subroutine read_nodes(words, blocks, mesh)
    type(words_t), intent(inout) :: words
    logical, intent(in) :: blocks
    type(gmsh_t), intent(inout) :: mesh
    integer :: n_block, n, b, in_block, found, parameters, dimension, parametric

    if (allocated(mesh%tag)) call report(words, '$Nodes stands a second time')
    n_block = 1
    if (blocks) call get_count(words, 'blocks', 4, n_block)
    call get_count(words, 'points', 4, n)
    if (blocks) call skip_integers(words, 2)
    if (len(words%problem) > 0) return
    allocate (mesh%tag(n), mesh%x(3, n), mesh%point_line(n))
    in_block = n
    parameters = 0
    found = 0
    do b = 1, n_block
      ! Dimension and number of an entity, and how many parameters each of its points carries.
      if (blocks) then
        call get_integer(words, dimension)
        if (dimension < 0 .or. dimension > 3) then
          call report(words, to_text(dimension)//' stands where a dimension, 0 to 3, should')
        end if
        call skip_integers(words, 1)
        call get_integer(words, parametric)
        parameters = merge(dimension, 0, parametric == 1)
        call get_count(words, 'points', 4, in_block)
      end if
      if (in_block > n - found) call report(words, 'more points than announced')
      if (len(words%problem) > 0) return
      call read_node_block(words, blocks, parameters, mesh%tag(found + 1:found + in_block), &
        mesh%x(:, found + 1:found + in_block), mesh%point_line(found + 1:found + in_block))
      if (len(words%problem) > 0) return
      found = found + in_block
    end do
    if (found < n) call report(words, 'fewer points than announced')
    call end_section(words, '$EndNodes')
  end subroutine read_nodes

  !> Points of one block: all tags first (4.1), or each before its coordinates (2.2).
  subroutine read_node_block(words, tags_first, parameters, tag, x, line)
    type(words_t), intent(inout) :: words
    logical, intent(in) :: tags_first
    integer, intent(in) :: parameters       !! words after the coordinates
    integer, intent(out) :: tag(:)
    real(wp), intent(out) :: x(:, :)        !! (3, n)
    integer, intent(out) :: line(:)         !! where they stand in the file
    real(wp) :: parameter
    integer :: i, k

    do i = 1, size(tag)
      if (tags_first) call get_tag(words, tag(i))
      if (len(words%problem) > 0) return
    end do
    do i = 1, size(tag)
      if (.not. tags_first) call get_tag(words, tag(i))
      do k = 1, 3
        call get_real(words, x(k, i))
      end do
      line(i) = words%line
      do k = 1, parameters
        call get_real(words, parameter)
      end do
      if (len(words%problem) > 0) return
    end do
  end subroutine read_node_block

  !> Number of a point.
  subroutine get_tag(words, tag)
    type(words_t), intent(inout) :: words
    integer, intent(out) :: tag

    call get_integer(words, tag)
    if (tag >= 1 .and. tag <= highest_tag) return
    call report(words, 'a point has the number '//to_text(tag)//', allowed are 1 to ' &
                  //to_text(highest_tag))
  end subroutine get_tag

  !> The section $Elements: one list (2.2), or blocks of one type (4.1). Only tetrahedra are kept.
  subroutine read_elements(words, blocks, mesh)
    type(words_t), intent(inout) :: words
    logical, intent(in) :: blocks
    type(gmsh_t), intent(inout) :: mesh
    integer :: n_block, n, b, i, k, in_block, found, kind, tags

    if (allocated(mesh%tet)) call report(words, '$Elements stands a second time')
    n_block = 1
    if (blocks) call get_count(words, 'blocks', 4, n_block)
    call get_count(words, 'elements', 2, n)
    if (blocks) call skip_integers(words, 2)
    if (len(words%problem) > 0) return
    allocate (mesh%tet(4, n), mesh%tet_line(n))
    in_block = n
    kind = 0
    found = 0
    do b = 1, n_block
      if (blocks) call skip_integers(words, 2)
      if (blocks) call get_integer(words, kind)
      if (blocks) call get_count(words, 'elements', 2, in_block)
      if (in_block > n - found) call report(words, 'more elements than announced')
      do i = 1, in_block
        call skip_integers(words, 1)
        if (.not. blocks) then   ! type and tags of version 2.2
          call get_integer(words, kind)
          call get_count(words, 'tags', 1, tags)
          call skip_integers(words, tags)
        end if
        if (kind < 1 .or. kind > size(nodes_of)) then
          call report(words, 'element type '//to_text(kind)//' is unknown')
        end if
        if (len(words%problem) > 0) return
        if (kind == tet_type) then
          mesh%n_tet = mesh%n_tet + 1
          do k = 1, 4
            call get_integer(words, mesh%tet(k, mesh%n_tet))
          end do
          mesh%tet_line(mesh%n_tet) = words%line
        else
          call skip_integers(words, nodes_of(kind))
          if (dimension_of(kind) == 3 .and. any(kind == [5, 6, 7])) then
            mesh%n_other = mesh%n_other + 1
          else if (dimension_of(kind) == 3) then
            mesh%n_high = mesh%n_high + 1
          end if
        end if
        if (len(words%problem) > 0) return
      end do
      found = found + in_block
    end do
    if (found < n) call report(words, 'fewer elements than announced')
    call end_section(words, '$EndElements')
  end subroutine read_elements

  !> Pass over n whole numbers.
  subroutine skip_integers(words, n)
    type(words_t), intent(inout) :: words
    integer, intent(in) :: n
    integer :: k, skip

    do k = 1, n
      if (len(words%problem) > 0) return
      call get_integer(words, skip)
    end do
  end subroutine skip_integers

  !> The mark at the end of a section; the end of the file will do.
  subroutine end_section(words, mark)
    type(words_t), intent(inout) :: words
    character(*), intent(in) :: mark
    character(:), allocatable :: word

    word = next_word(words)
    if (len(word) > 0 .and. word /= mark) call expected(words, mark, word)
  end subroutine end_section

end module shape_file_m
