!> A block as convex parts glued on whole faces: its tetrahedra and the polygons of its surface.
!!
!! A part is the hull of its faces, which are flat convex polygons. Two parts that touch have a
!! face in common, so everything fits by construction: each part is cut into tetrahedra from its
!! centre, and the faces that belong to one part only are the surface.
module convex_parts_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use polyhedron_m, only: tet_volume
  use neighbours_m, only: join_points
  implicit none
  private
  public :: points_t, parts_t, begin_part, add_face, end_part, add_frustum, find_or_add
  public :: tets_of_parts, net_of_parts

  !> A list of points, each once. Put in points that make up parts before any are cut.
  type :: points_t
    integer :: n = 0
    real(wp), allocatable :: x(:, :)          !! (3, *) [m]
    real(wp) :: same = 0.0_wp                 !! nearer points are one [m]
  end type points_t

  !> Faces of all parts: face f has the corners `corner(first(f):first(f+1)-1)`, outward.
  type :: parts_t
    integer :: n_part = 0, n_face = 0
    integer, allocatable :: first(:), corner(:)
    integer, allocatable :: face_of(:)        !! faces of part p: face_of(p):face_of(p+1)-1
  end type parts_t

contains

  !> Begin a new part; its faces follow.
  pure subroutine begin_part(parts)
    type(parts_t), intent(inout) :: parts

    if (.not. allocated(parts%first)) then
      parts%first = [1]
      parts%face_of = [1]
      allocate (parts%corner(0))
    end if
    parts%n_part = parts%n_part + 1
    parts%face_of = [parts%face_of, parts%n_face + 1]
  end subroutine begin_part

  !> Give the part begun last a face, its corners in order, either way round.
  pure subroutine add_face(x, points, parts)
    real(wp), intent(in) :: x(:, :)           !! (3, corners) [m]
    type(points_t), intent(inout) :: points
    type(parts_t), intent(inout) :: parts
    integer :: c, number(size(x, 2))

    do c = 1, size(x, 2)
      call find_or_add(x(:, c), points, number(c))
    end do
    parts%corner = [parts%corner, number]
    parts%n_face = parts%n_face + 1
    parts%first = [parts%first, size(parts%corner) + 1]
    parts%face_of(parts%n_part + 1) = parts%n_face + 1
  end subroutine add_face

  !> End a part: turn its faces outward.
  pure subroutine end_part(points, parts)
    type(points_t), intent(in) :: points
    type(parts_t), intent(inout) :: parts
    real(wp) :: centre(3)
    integer, allocatable :: c(:)
    integer :: f

    centre = part_centre(points, parts, parts%n_part)
    do f = parts%face_of(parts%n_part), parts%n_face
      c = parts%corner(parts%first(f):parts%first(f + 1) - 1)
      if (tet_volume(reshape([centre, points%x(:, c(1:3))], [3, 4])) < 0.0_wp) then
        parts%corner(parts%first(f):parts%first(f + 1) - 1) = c(size(c):1:-1)
      end if
    end do
  end subroutine end_part

  !> A part between two polygons whose sides are parallel in turn.
  pure subroutine add_frustum(lower, upper, points, parts)
    real(wp), intent(in) :: lower(:, :), upper(:, :)   !! (3, sides) corners [m]
    type(points_t), intent(inout) :: points
    type(parts_t), intent(inout) :: parts
    integer :: k, next

    call begin_part(parts)
    call add_face(lower, points, parts)
    call add_face(upper, points, parts)
    do k = 1, size(lower, 2)
      next = 1 + mod(k, size(lower, 2))
      call add_face(reshape([lower(:, k), lower(:, next), upper(:, next), upper(:, k)], [3, 4]), &
                    points, parts)
    end do
    call end_part(points, parts)
  end subroutine add_frustum

  !> Mean of the corners of a part's faces, inside the part.
  pure function part_centre(points, parts, p) result(centre)
    type(points_t), intent(in) :: points
    type(parts_t), intent(in) :: parts
    integer, intent(in) :: p
    real(wp) :: centre(3)

    associate (c => parts%corner(parts%first(parts%face_of(p)): &
                                 parts%first(parts%face_of(p + 1)) - 1))
      centre = sum(points%x(:, c), 2)/real(size(c), wp)
    end associate
  end function part_centre

  !> Number of a point, added to the list if it is new.
  pure subroutine find_or_add(x, points, number)
    real(wp), intent(in) :: x(3)
    type(points_t), intent(inout) :: points
    integer, intent(out) :: number

    do number = 1, points%n
      if (all(abs(points%x(:, number) - x) <= points%same)) return
    end do
    points%n = number
    call ensure_capacity(number, points%x)
    points%x(:, number) = x
  end subroutine find_or_add

  !> The tetrahedra of the parts, from the centre of each part to the triangles of its faces, and
  !! each of them into `fine`**3 of equal volume.
  !!
  !! Faces are cut from their lowest corner, or with `from_middle` those of more than four corners
  !! from their middle, which makes better tetrahedra; either way alike for both parts at a face.
  pure subroutine tets_of_parts(parts, from_middle, fine, points, tet)
    type(parts_t), intent(in) :: parts
    logical, intent(in) :: from_middle
    integer, intent(in) :: fine
    type(points_t), intent(inout) :: points
    integer, allocatable, intent(out) :: tet(:, :)   !! (4, n) positive volume
    integer, allocatable :: coarse(:, :)
    integer :: centre, f, k, m, p, n, lowest, start
    real(wp) :: middle(3)

    allocate (coarse(4, size(parts%corner)))
    n = 0
    do p = 1, parts%n_part
      call find_or_add(part_centre(points, parts, p), points, centre)
      do f = parts%face_of(p), parts%face_of(p + 1) - 1
        associate (c => parts%corner(parts%first(f):parts%first(f + 1) - 1))
          m = size(c)
          if (from_middle .and. m > 4) then
            ! Mean of the corners of a face, the same bits whatever corner comes first.
            middle = 0.5_wp*(minval(points%x(:, c), 2) + maxval(points%x(:, c), 2))
            middle = middle + sum(points%x(:, c) - spread(middle, 2, size(points%x(:, c), 2)), &
                                  2)/real(size(points%x(:, c), 2), wp)
            call find_or_add(middle, points, start)
            lowest = 1
          else
            lowest = minloc(c, 1)
            start = c(lowest)
          end if
          do k = 1, m
            if (any(c([k, 1 + mod(k, m)]) == start)) cycle
            n = n + 1
            coarse(:, n) = [centre, start, c(k), c(1 + mod(k, m))]
          end do
        end associate
      end do
    end do
    if (fine > 1) call cut_tets(coarse(:, :n), fine, points, tet)
    if (fine == 1) tet = coarse(:, :n)
    do k = 1, size(tet, 2)
      if (tet_volume(points%x(:, tet(:, k))) < 0.0_wp) tet(1:2, k) = tet([2, 1], k)
    end do
  end subroutine tets_of_parts

  !> Cut every tetrahedron into `fine`**3 parts of equal volume, fitting across faces.
  !!
  !! With its corners in ascending order a tetrahedron is mapped to the set
  !! fine >= i >= j >= k >= 0, which whole cubes cut into six along their diagonal fill. Neighbours
  !! find the same bits of a point because their corners come in the same order.
  pure subroutine cut_tets(coarse, fine, points, tet)
    integer, intent(in) :: coarse(:, :)
    integer, intent(in) :: fine
    type(points_t), intent(inout) :: points
    integer, allocatable, intent(out) :: tet(:, :)
    integer, parameter :: order(3, 6) = reshape([1, 2, 3, 1, 3, 2, 2, 1, 3, 2, 3, 1, 3, 1, 2, &
                                                 3, 2, 1], [3, 6])
    real(wp), allocatable :: x(:, :)   ! with the points of each tetrahedron
    integer, allocatable :: place(:)
    integer :: corner(4), number(0:fine, 0:fine, 0:fine), step(3, 4), weight(4), rest(4)
    integer :: t, i, j, k, m, v, n, p

    allocate (tet(4, size(coarse, 2)*fine**3))
    p = points%n
    allocate (x(3, p + size(coarse, 2)*((fine + 1)*(fine + 2)*(fine + 3))/6))
    x(:, :p) = points%x(:, :p)
    n = 0
    do t = 1, size(coarse, 2)
      rest = coarse(:, t)
      do i = 1, 4
        corner(i) = minval(rest)
        rest(minloc(rest, 1)) = huge(1)
      end do
      do k = 0, fine
        do j = k, fine
          do i = j, fine
            p = p + 1
            number(i, j, k) = p
            x(:, p) = 0.0_wp
            weight = [fine - i, i - j, j - k, k]
            do v = 1, 4
              if (weight(v) > 0) x(:, p) = x(:, p) &
                + (real(weight(v), wp)/real(fine, wp))*points%x(:, corner(v))
            end do
          end do
        end do
      end do
      do k = 0, fine - 1
        do j = k, fine - 1
          do i = j, fine - 1
            do m = 1, 6
              step(:, 1) = [i, j, k]
              do v = 1, 3
                step(:, v + 1) = step(:, v)
                step(order(v, m), v + 1) = step(order(v, m), v + 1) + 1
              end do
              if (any(step(1, :) < step(2, :)) .or. any(step(2, :) < step(3, :))) cycle
              n = n + 1
              tet(:, n) = [(number(step(1, v), step(2, v), step(3, v)), v=1, 4)]
            end do
          end do
        end do
      end do
    end do
    call join_points(x, maxval(maxval(x, 2) - minval(x, 2))/real(p, wp)**(1.0_wp/3.0_wp), 0.0_wp, &
      place)
    tet = reshape(place(reshape(tet, [4*n])), [4, n])
    points%n = size(x, 2)
    call move_alloc(x, points%x)
  end subroutine cut_tets

  !> The faces that belong to one part only.
  pure subroutine net_of_parts(parts, facet, facet_point)
    type(parts_t), intent(in) :: parts
    integer, allocatable, intent(out) :: facet(:), facet_point(:)
    logical :: free(parts%n_face)
    integer :: f, g, k

    free = .true.
    do f = 1, parts%n_face
      do g = 1, f - 1
        if (.not. free(g)) cycle
        associate (a => parts%corner(parts%first(f):parts%first(f + 1) - 1), &
                   b => parts%corner(parts%first(g):parts%first(g + 1) - 1))
          if (size(a) /= size(b)) cycle
          if (.not. all([(any(b == a(k)), k=1, size(a))])) cycle
        end associate
        free([f, g]) = .false.
        exit
      end do
    end do
    facet = [1]
    allocate (facet_point(0))
    do f = 1, parts%n_face
      if (.not. free(f)) cycle
      facet_point = [facet_point, parts%corner(parts%first(f):parts%first(f + 1) - 1)]
      facet = [facet, size(facet_point) + 1]
    end do
  end subroutine net_of_parts

end module convex_parts_m
