!> The short list of a pair: how long it holds, and that nothing which touches meanwhile is missing.
module test_short_list_m
  use check_m, only: check, wp
  use surface_search_m, only: surface_t, nearest_on_surface
  use edge_crossing_m, only: crossing_t, cross_edges
  use near_features_m, only: poses_t, view_t, meeting_t, seen_from, way_between, near_features_t, &
    search_t, list_features, edge_in_view
  use short_list_m, only: short_list_t, short_list_holds, choose_features, n_chosen
  use two_cubes_m, only: make_solid, random_poses, moved, meeting_at, distance_from_cube
  implicit none
  private
  public :: test_short_list

  real(wp), parameter :: skin = 0.06_wp, gap = 0.004_wp   !! [m]
  real(wp), parameter :: deep = 0.125_wp   !! no contact is deeper: half the length d_s [m]
  type(surface_t) :: cube
  type(search_t) :: search
  type(near_features_t) :: near
  type(short_list_t) :: short
  type(meeting_t) :: now

contains

  subroutine test_short_list()
    search%skin = skin
    search%ahead = 0.02_wp
    call make_solid('cube', cube)
    call check_how_long()
    call check_nothing_missing()
  end subroutine test_short_list

  logical function holds()
    holds = short_list_holds(now, cube%bounding_radius, cube%bounding_radius, short)
  end function holds

  !> A short list holds until the way since then and the gap that counts as a contact point are as
  !! told; no longer than the lists it was chosen from, and as long as these where they are empty.
  subroutine check_how_long()
    real(wp), parameter :: none(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    real(wp) :: left

    now = meeting_at(poses_t([0.0_wp, 0.0_wp, 0.0_wp], [0.0_wp, 0.0_wp, 1.001_wp], none, none))
    call check('none yet', .not. holds())
    now%gap = gap
    call list_features(now, cube, cube, search, near)
    call choose_features(now, 0.0_wp, search, cube, cube, near, short)
    call check('corners and inner points of both faces', all([short%n_of_a, short%n_of_b] == 8))
    call check('features', n_chosen(short), 16 + short%n_edges)
    left = short%until - gap
    now%poses%x_b(1) = 0.999_wp*left
    call check('holds', holds())
    now%poses%x_b(1) = 1.001_wp*left
    call check('moved too far', .not. holds())
    now%gap = 0.9_wp*gap
    call check('less counts', holds())
    now%poses = short%when
    call choose_features(now, near%valid - 0.5_wp*gap, search, cube, cube, near, short)
    now%poses%x_b(1) = 0.49_wp*gap
    call check('held', holds())
    now%poses%x_b(1) = 0.51_wp*gap
    call check('no longer than the lists', .not. holds())
    now = meeting_at(poses_t([0.0_wp, 0.0_wp, 0.0_wp], [0.0_wp, 0.0_wp, 3.0_wp], none, none))
    call list_features(now, cube, cube, search, near)
    call choose_features(now, 0.0_wp, search, cube, cube, near, short)
    now%poses%x_b(3) = 3.0_wp - 0.999_wp*near%valid
    call check('empty lists', holds())
  end subroutine check_how_long

  !> As long as it holds, a short list made some time after the lists has every vertex that touches
  !! or soon will, with what it touches, and every pair of edges that cross.
  subroutine check_nothing_missing()
    real(wp) :: way
    integer :: i, n

    n = 0
    do i = 1, 3000
      now = meeting_at(random_poses(i, 0.9_wp, 1.4_wp))
      call list_features(now, cube, cube, search, near)
      now = meeting_at(moved(i, 0.5_wp*near%valid, now%poses))
      now%gap = gap
      way = way_between(near%when, now%poses, cube%bounding_radius, cube%bounding_radius)
      call choose_features(now, way, search, cube, cube, near, short)
      now = meeting_at(moved(i, min(short%until - gap, short%left), now%poses))
      now%gap = gap
      call check('holds', holds())
      call check_vertices(now%b_in_a, short%item(:short%of_a - 1), n)
      call check_vertices(now%a_in_b, short%item(short%of_a:short%edges - 1), n)
      call check_crossings(now%a_in_b, short%item(short%edges:short%n), n)
    end do
    call check('many touch', n > 3000)
  end subroutine check_nothing_missing

  !> Every vertex of a guest within the gap of the host is in its part of the list.
  subroutine check_vertices(guest_in_host, item, n)
    type(view_t), intent(in) :: guest_in_host
    integer, intent(in) :: item(:)
    integer, intent(inout) :: n                !! vertices that touch
    real(wp) :: place(3), wanted, distance, outward(3)
    integer :: p, m

    do p = 1, size(cube%weight)
      place = seen_from(guest_in_host, cube%vertex(:, p))
      wanted = distance_from_cube(place)
      if (wanted > gap) cycle
      n = n + 1
      m = 1
      do while (m <= size(item))
        if (item(m) == p) exit
        m = m + 3 + item(m + 1) + item(m + 2)
      end do
      call check('the vertex is listed', m <= size(item))
      if (m > size(item)) cycle
      associate (facets => item(m + 3:m + 2 + item(m + 1)), &
        edges => item(m + 3 + item(m + 1):m + 2 + item(m + 1) + item(m + 2)))
        call nearest_on_surface(cube, place, facets, edges, distance, outward)
      end associate
      call check('with what is nearest to it', distance, wanted, 1.0e-14_wp)
    end do
  end subroutine check_vertices

  !> Every pair of edges that cross, or are within the gap of it, is in its part of the list.
  subroutine check_crossings(a_in_b, item, n)
    type(view_t), intent(in) :: a_in_b
    integer, intent(in) :: item(:)
    integer, intent(inout) :: n                !! pairs that cross
    type(crossing_t) :: crossing
    integer :: i, j

    do i = 1, cube%n_convex
      do j = 1, cube%n_convex
        call cross_edges(edge_in_view(a_in_b, cube%edge(i)), cube%edge(j), -gap, deep, crossing)
        if (crossing%weight <= 0.0_wp) cycle
        n = n + 1
        call check('the crossing is listed', any(item(1::2) == i .and. item(2::2) == j))
      end do
    end do
  end subroutine check_crossings

end module test_short_list_m
