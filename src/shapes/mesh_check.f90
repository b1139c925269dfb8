!> Makes a mesh of tetrahedra from outside fit for the program, or says what is wrong with it.
module mesh_check_m
  use kinds_m, only: wp
  use vectors_m, only: norm
  use errors_m, only: to_text
  use polyhedron_m, only: tet_volume
  use tet_mesh_m, only: surface_of_tets
  use surface_net_m, only: edge_twins
  use neighbours_m, only: join_points
  implicit none
  private
  public :: check_mesh

  real(wp), parameter :: flat_tet = 1.0e-9_wp    !! volume over longest edge cubed
  real(wp), parameter :: same_place = 1.0e-9_wp  !! distance of points [size of the block]

contains

  !> Drop points no tetrahedron uses, turn tetrahedra of negative volume, and look for everything
  !! that would make the volume or the surface wrong. `message` is empty if the mesh is good.
  subroutine check_mesh(point, tet, message)
    real(wp), allocatable, intent(inout) :: point(:, :)   !! (3, n)
    integer, allocatable, intent(inout) :: tet(:, :)      !! (4, m)
    character(:), allocatable, intent(out) :: message
    integer, allocatable :: triangle(:, :), triangle_tet(:), number(:)
    real(wp), allocatable :: joined(:, :)
    logical, allocatable :: used(:)
    integer :: n, i, a, b
    real(wp) :: x(3, 4), v, longest, extent

    message = ''
    if (size(tet, 2) == 0) then
      message = 'holds no tetrahedra; a surface alone has to be meshed first (tools/make_shape.py)'
      return
    end if
    allocate (used(size(point, 2)), source=.false.)
    do i = 1, size(tet, 2)
      used(tet(:, i)) = .true.
    end do
    point = point(:, pack([(i, i=1, size(used))], used))
    number = unpack([(i, i=1, size(point, 2))], used, 0)
    ! Give every tetrahedron a positive volume; the number of those without one worth the name.
    n = 0
    do i = 1, size(tet, 2)
      tet(:, i) = number(tet(:, i))
      x = point(:, tet(:, i))
      v = tet_volume(x)
      longest = 0.0_wp
      do a = 1, 3
        do b = a + 1, 4
          longest = max(longest, norm(x(:, a) - x(:, b)))
        end do
      end do
      if (abs(v) <= flat_tet*longest**3) n = n + 1
      if (v < 0.0_wp) tet(1:2, i) = tet([2, 1], i)
    end do
    if (n > 0) call add(to_text(n)//' tetrahedra are flat')
    joined = point
    extent = maxval(maxval(point, 2) - minval(point, 2))
    call join_points(joined, extent/real(size(point, 2), wp)**(1.0_wp/3.0_wp), same_place*extent, &
      number)
    n = size(point, 2) - size(joined, 2)
    if (n > 0) call add(to_text(n)//' points stand in the place of another, join them')
    call surface_of_tets(size(point, 2), tet, triangle, triangle_tet, n)
    if (n > 0) call add('tetrahedra overlap at '//to_text(n)//' of their faces')
    if (len(message) > 0) return
    n = bad_edges(size(point, 2), triangle)
    if (n > 0) call add('the surface meets itself along '//to_text(n)//' edges')
    n = pieces(size(point, 2), tet)
    if (n > 1) call add('falls into '//to_text(n)//' separate pieces')
  contains
    subroutine add(text)
      character(*), intent(in) :: text

      if (len(message) > 0) message = message//'; '
      message = message//text
    end subroutine add
  end subroutine check_mesh

  !> Edges of the surface that do not join just two triangles. They lead from triangle to triangle
  !! both ways equally often, so one way is enough.
  pure function bad_edges(n_point, triangle) result(n)
    integer, intent(in) :: n_point
    integer, intent(in) :: triangle(:, :)
    integer :: n
    integer, allocatable :: twin(:), finish(:), next(:), head(:)
    integer :: i, e, a, g

    allocate (twin(size(triangle)), next(size(triangle)))
    call edge_twins([(1 + 3*i, i=0, size(triangle, 2))], reshape(triangle, [size(triangle)]), twin)
    finish = reshape(cshift(triangle, 1), [size(triangle)])
    allocate (head(n_point), source=0)   ! edges are chained by the point where they begin
    n = 0
    do e = 1, size(twin)
      a = triangle(mod(e - 1, 3) + 1, (e - 1)/3 + 1)
      if (twin(e) > 0 .or. a > finish(e)) cycle
      g = head(a)
      do while (g > 0)
        if (finish(g) == finish(e)) exit
        g = next(g)
      end do
      if (g > 0) cycle
      next(e) = head(a)
      head(a) = e
      n = n + 1
    end do
  end function bad_edges

  !> Parts of the mesh that share no point with one another.
  pure function pieces(n_point, tet) result(n)
    integer, intent(in) :: n_point
    integer, intent(in) :: tet(:, :)
    integer :: n
    integer, allocatable :: root(:)
    integer :: i, k

    allocate (root(n_point), source=[(i, i=1, n_point)])
    do i = 1, size(tet, 2)
      do k = 2, 4
        root(top(root, tet(k, i))) = top(root, tet(1, i))
      end do
    end do
    n = 0
    do i = 1, n_point
      if (root(i) == i) n = n + 1
    end do
  end function pieces

  pure function top(root, i) result(r)
    integer, intent(in) :: root(:), i
    integer :: r

    r = i
    do while (root(r) /= r)
      r = root(r)
    end do
  end function top

end module mesh_check_m
