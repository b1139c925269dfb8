!> Flat regions joined to few convex polygons: one where they are convex, nets that stay closed
!! around the same volume, and what edges know of their other sides.
module test_surface_net_m
  use check_m, only: check, wp
  use grid_m, only: unit_step
  use surface_net_m, only: merge_flat_facets, edge_twins
  use surface_nets_m, only: check_net
  implicit none
  private
  public :: test_surface_net

  !> A block of unit cubes and the net of its surface, triangles or squares.
  type :: net_t
    real(wp), allocatable :: point(:, :)
    integer, allocatable :: facet(:), corner(:)
  end type net_t

  integer, parameter :: n = 4   !! places along each edge

contains

  subroutine test_surface_net()
    call check_cuboid()
    call check_corner()
    call check_ring()
    call check_kept()
    call check_twins()
  end subroutine test_surface_net

  !> A cuboid has six rectangles, whatever the net was.
  subroutine check_cuboid()
    logical :: full(0:n + 1, 0:n + 1, 0:n + 1)
    type(net_t) :: net
    integer :: k

    full = .false.
    full(2:4, 1:2, 1:3) = .true.
    do k = 1, 2
      call make_net(full, k == 2, net)
      call merge_flat_facets(net%point, net%facet, net%corner)
      call check_net('cuboid', net%point, net%facet, net%corner, 2, 18.0_wp, 42.0_wp)
      call check('six rectangles', size(net%facet) - 1, 6)
      call check('of four corners', size(net%corner), 24)
    end do
  end subroutine check_cuboid

  !> A block shaped like an L, three cubes: each of its two L needs two convex polygons at least;
  !! all are no more than its fourteen squares.
  subroutine check_corner()
    logical :: full(0:n + 1, 0:n + 1, 0:n + 1)
    type(net_t) :: net
    integer :: k

    full = .false.
    full(1:2, 1, 1) = .true.
    full(1, 2, 1) = .true.
    do k = 1, 2
      call make_net(full, k == 2, net)
      call merge_flat_facets(net%point, net%facet, net%corner)
      call check_net('L', net%point, net%facet, net%corner, 2, 3.0_wp, 14.0_wp)
      call check('six sides and two L', size(net%facet) - 1 >= 6 + 2*2)
      call check('few polygons', size(net%facet) - 1 <= 14)
    end do
  end subroutine check_corner

  !> Eight cubes around a hole keep it; all polygons are fewer than the 32 squares.
  subroutine check_ring()
    logical :: full(0:n + 1, 0:n + 1, 0:n + 1)
    type(net_t) :: net

    full = .false.
    full(1:3, 1:3, 1) = .true.
    full(2, 2, 1) = .false.
    call make_net(full, .true., net)
    call merge_flat_facets(net%point, net%facet, net%corner)
    call check_net('ring', net%point, net%facet, net%corner, 0, 8.0_wp, 32.0_wp)
    call check('fewer polygons', size(net%facet) - 1 < 32)
  end subroutine check_ring

  !> What bends stays: a flat pyramid keeps its five faces.
  subroutine check_kept()
    real(wp), parameter :: point(3, 5) = reshape([0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, &
      1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.5_wp, 0.5_wp, 0.01_wp], [3, 5])
    integer, allocatable :: facet(:), corner(:)

    allocate (facet, source=[1, 4, 7, 10, 13, 17])
    allocate (corner, source=[1, 2, 5, 2, 3, 5, 3, 4, 5, 4, 1, 5, 4, 3, 2, 1])
    call merge_flat_facets(point, facet, corner)
    call check('a flat pyramid', all([size(facet), size(corner)] == [6, 16]))
  end subroutine check_kept

  !> In a closed net every edge is the twin of its twin, which runs back. Where a square is missing
  !! its four neighbours have none, and where four squares meet at an edge none has.
  subroutine check_twins()
    logical :: full(0:n + 1, 0:n + 1, 0:n + 1)
    type(net_t) :: net
    integer, allocatable :: twin(:)
    integer :: e

    full = .false.
    full(2, 2, 2) = .true.
    call make_net(full, .false., net)
    allocate (twin(24))
    call edge_twins(net%facet, net%corner, twin)
    call check('closed', all(twin > 0))
    call check('twins of twins', all(twin(twin) == [(e, e=1, 24)]))
    call check('run back', all(net%corner(twin) == [(net%corner(merge(e - 3, e + 1, &
      modulo(e, 4) == 0)), e=1, 24)]))
    call edge_twins(net%facet(:6), net%corner(:20), twin(:20))
    call check('a square is missing', count(twin(:20) == 0), 4)
    full(3, 3, 2) = .true.
    call make_net(full, .false., net)
    deallocate (twin)
    allocate (twin(48))
    call edge_twins(net%facet, net%corner, twin)
    call check('two cubes touch at an edge', count(twin == 0), 4)
  end subroutine check_twins

  !> The surface of cubes, a square for each free side or two triangles.
  subroutine make_net(full, triangles, net)
    logical, intent(in) :: full(0:, 0:, 0:), triangles   !! none beyond 1..n
    type(net_t), intent(out) :: net
    integer :: i, j, k, d, s, c(4)

    allocate (net%point(3, (n + 1)**3), net%corner(0))
    net%facet = [1]
    do concurrent (k=0:n, j=0:n, i=0:n)
      net%point(:, number([i, j, k])) = real([i, j, k], wp)
    end do
    do k = 1, n
      do j = 1, n
        do i = 1, n
          if (.not. full(i, j, k)) cycle
          do d = 1, 3
            do s = 0, 1
              c(:3) = [i, j, k] + (2*s - 1)*unit_step(:, d)
              if (full(c(1), c(2), c(3))) cycle
              c = side([i, j, k], d, s)
              if (triangles) call add([c(1), c(2), c(3)], net)
              if (triangles) call add([c(1), c(3), c(4)], net)
              if (.not. triangles) call add(c, net)
            end do
          end do
        end do
      end do
    end do
  end subroutine make_net

  subroutine add(polygon, net)
    integer, intent(in) :: polygon(:)
    type(net_t), intent(inout) :: net

    net%corner = [net%corner, polygon]
    net%facet = [net%facet, size(net%corner) + 1]
  end subroutine add

  !> Corners of a side of a cube, counter-clockwise from outside.
  pure function side(cube, d, s) result(c)
    integer, intent(in) :: cube(3), d, s   !! direction; 0: lower, 1: upper side
    integer :: c(4), corner(3), e, f

    corner = cube - 1 + s*unit_step(:, d)
    e = 1 + modulo(d, 3)
    f = 1 + modulo(d + 1, 3)
    associate (a => unit_step(:, e), b => unit_step(:, f))
      c = [number(corner), number(corner + a), number(corner + a + b), number(corner + b)]
    end associate
    if (s == 0) c = c([4, 3, 2, 1])
  end function side

  pure integer function number(place)
    integer, intent(in) :: place(3)   !! from 0

    number = 1 + place(1) + (n + 1)*(place(2) + (n + 1)*place(3))
  end function number

end module test_surface_net_m
