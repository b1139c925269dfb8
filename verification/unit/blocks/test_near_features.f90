!> Two bodies seen from one another, how far their points move, and the lists of what may touch of
!! them: how long they hold, how far their entries are, and that nothing which touches before they
!! are renewed is missing.
module test_near_features_m
  use check_m, only: check, wp
  use vectors_m, only: rotation_matrix, quaternion_from_axis, quaternion_product
  use random_counter_m, only: random_rotation
  use surface_search_m, only: surface_t, nearest_on_surface
  use edge_crossing_m, only: edge_t, crossing_t, cross_edges
  use near_features_m, only: poses_t, view_t, meeting_t, update_views, seen_from, &
    box_in_view, way_between, near_features_t, near_vertices_t, search_t, list_features, &
    edge_in_view
  use two_cubes_m, only: make_solid, random_poses, moved, meeting_at, distance_from_cube, vector
  implicit none
  private
  public :: test_near_features

  real(wp), parameter :: skin = 0.06_wp, ahead = 0.02_wp   !! [m]
  real(wp), parameter :: deep = 0.125_wp   !! no contact is deeper: half the length d_s [m]
  real(wp), parameter :: no_turn(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
  type(surface_t) :: cube, ball
  type(search_t) :: search

contains

  subroutine test_near_features()
    call check_views()
    call check_box()
    call check_way()
    search%skin = skin
    search%lasting = 0.1_wp
    search%ahead = ahead
    call make_solid('cube', cube)
    call make_solid('sphere', ball)
    call check_how_long()
    call check_corner_and_ball()
    call check_edge_in_view()
    call check_nothing_missing()
  end subroutine test_near_features

  !> Lists hold for the skin, for fast bodies as long as they last, at most four skins; of bodies
  !! far from one another for the way to where their spheres may meet.
  subroutine check_how_long()
    real(wp), parameter :: speed(3) = [0.0_wp, 0.1_wp/0.06_wp, 100.0_wp]
    type(near_features_t) :: near
    type(meeting_t) :: now
    integer :: i

    now = meeting_at(poses_t([0.0_wp, 0.0_wp, 0.0_wp], [1.0_wp, 0.0_wp, 0.0_wp], no_turn, no_turn))
    do i = 1, 3
      now%speed = speed(i)
      call list_features(now, cube, cube, search, near)
      call check('skin', near%valid, min(max(skin, speed(i)*search%lasting), 4*skin), 1.0e-15_wp)
    end do
    now = meeting_at(poses_t([0.0_wp, 0.0_wp, 0.0_wp], [0.0_wp, 3.0_wp, 0.0_wp], no_turn, no_turn))
    call list_features(now, cube, cube, search, near)
    call check('way of bodies that are far', near%valid, 3.0_wp - sqrt(3.0_wp) - ahead, 1.0e-14_wp)
    call check('they list nothing', near%of_a%n + near%of_b%n + near%n_crossings, 0)
  end subroutine check_how_long

  !> A cube on edge over the corner of another: its lower corners are as far as Pythagoras says. A
  !! ball is as far as its surface, and is not tested by corners.
  subroutine check_corner_and_ball()
    real(wp), parameter :: apart(3) = [0.02_wp, 0.03_wp, 0.06_wp]   !! of the nearest corners [m]
    type(near_features_t) :: near

    call list_features(meeting_at(poses_t([0.0_wp, 0.0_wp, 0.0_wp], 1.0_wp + apart, no_turn, &
      no_turn)), cube, cube, search, near)
    call check('one corner of each', all([near%of_a%n, near%of_b%n] == 1))
    call check('how far', [near%of_a%away(1), near%of_b%away(1)], [0.07_wp, 0.07_wp], 1.0e-14_wp)
    call check('the corner of b', cube%vertex(:, near%of_b%vertex(1)), -[0.5_wp, 0.5_wp, 0.5_wp])
    call list_features(meeting_at(poses_t([0.0_wp, 0.0_wp, 0.0_wp], [0.4_wp, 0.3_wp, 1.05_wp], &
      no_turn, no_turn)), ball, cube, search, near)
    call check('ball under cube', all([near%of_a%n, near%of_b%n, near%n_crossings] == [1, 0, 0]))
    call check('is as far as its surface', near%of_a%away(1), 0.05_wp, 1.0e-14_wp)
  end subroutine check_corner_and_ball

  !> An edge seen from the other body keeps its ends and the facets beside it.
  subroutine check_edge_in_view()
    type(meeting_t) :: now
    type(edge_t) :: seen

    now = meeting_at(random_poses(1, 1.0_wp, 2.0_wp))
    associate (edge => cube%edge(1), view => now%a_in_b)
      seen = edge_in_view(view, edge)
      call check('one end', seen%start, seen_from(view, edge%start), 1.0e-15_wp)
      call check('the other end', seen%start + seen%extent*seen%along, &
        seen_from(view, edge%start + edge%extent*edge%along), 1.0e-14_wp)
      call check('into one facet', seen%start + seen%into(:, 1), &
        seen_from(view, edge%start + edge%into(:, 1)), 1.0e-14_wp)
      call check('into the other', seen%start + seen%into(:, 2), &
        seen_from(view, edge%start + edge%into(:, 2)), 1.0e-14_wp)
    end associate
  end subroutine check_edge_in_view

  !> After a way shorter than that for which the lists hold, they still have every vertex that
  !! touches, with what it touches, and every pair of edges that cross; and none came sooner than
  !! told.
  subroutine check_nothing_missing()
    type(near_features_t) :: near
    type(meeting_t) :: now
    real(wp) :: way
    integer :: i, n

    n = 0
    do i = 1, 3000
      now = meeting_at(random_poses(i, 0.9_wp, 1.4_wp))
      call list_features(now, cube, cube, search, near)
      now = meeting_at(moved(i, near%valid, now%poses))
      way = way_between(near%when, now%poses, cube%bounding_radius, cube%bounding_radius)
      call check('moved far enough', way <= near%valid .and. way > 0.8_wp*near%valid)
      call check_vertices(now%b_in_a, way, near%of_b, n)
      call check_vertices(now%a_in_b, way, near%of_a, n)
      call check_crossings(now%a_in_b, way, near, n)
    end do
    call check('many touch', n > 3000)
  end subroutine check_nothing_missing

  !> Every vertex of a guest within the cutoff of the host is listed.
  subroutine check_vertices(guest_in_host, way, list, n)
    type(view_t), intent(in) :: guest_in_host
    real(wp), intent(in) :: way                !! since the lists were made [m]
    type(near_vertices_t), intent(in) :: list
    integer, intent(inout) :: n                !! vertices that touch
    real(wp) :: place(3), wanted, distance, outward(3)
    integer :: p, m

    do p = 1, size(cube%weight)
      place = seen_from(guest_in_host, cube%vertex(:, p))
      wanted = distance_from_cube(place)
      if (wanted > ahead) cycle
      n = n + 1
      do m = list%n, 1, -1
        if (list%vertex(m) == p) exit
      end do
      call check('the vertex is listed', m > 0)
      if (m == 0) cycle
      call nearest_on_surface(cube, place, list%facet(list%facet_first(m):list%facet_first(m + 1) &
        - 1), list%edge(list%edge_first(m):list%edge_first(m + 1) - 1), distance, outward)
      call check('with what is nearest to it', distance, wanted, 1.0e-14_wp)
      call check('no sooner than told', list%away(m) <= way + wanted + 1.0e-14_wp)
    end do
  end subroutine check_vertices

  !> Every pair of edges that cross, or will within the way ahead, is listed.
  subroutine check_crossings(a_in_b, way, near, n)
    type(view_t), intent(in) :: a_in_b
    real(wp), intent(in) :: way                !! since the lists were made [m]
    type(near_features_t), intent(in) :: near
    integer, intent(inout) :: n                !! pairs that cross
    type(crossing_t) :: crossing
    integer :: i, j, m

    do i = 1, cube%n_convex
      do j = 1, cube%n_convex
        call cross_edges(edge_in_view(a_in_b, cube%edge(i)), cube%edge(j), -ahead, deep, crossing)
        if (crossing%weight <= 0.0_wp) cycle
        n = n + 1
        do m = near%n_crossings, 1, -1
          if (near%edge_a(m) == i .and. near%edge_b(m) == j) exit
        end do
        call check('the crossing is listed', m > 0)
        if (m > 0) call check('none sooner than told', near%away(m) <= way + ahead)
      end do
    end do
  end subroutine check_crossings

  !> A place of a in space, and from there in the axes of b; and the way back.
  subroutine check_views()
    type(meeting_t) :: now
    real(wp) :: p(3), seen(3)
    integer :: i

    do i = 1, 10
      now%turn_a = rotation_matrix(random_rotation(1, i))
      now%turn_b = rotation_matrix(random_rotation(2, i))
      now%to_b = vector(i, 1)
      call update_views(now)
      p = vector(i, 2)
      seen = matmul(matmul(now%turn_a, p) - now%to_b, now%turn_b)
      call check('a seen from b', seen_from(now%a_in_b, p), seen, 1.0e-15_wp)
      call check('b seen from a', seen_from(now%b_in_a, seen), p, 1.0e-15_wp)
    end do
  end subroutine check_views

  !> A box seen from elsewhere holds its corners, and no more than it has to.
  subroutine check_box()
    type(view_t) :: view
    real(wp) :: low(3), high(3), new_low(3), new_high(3), corner(3, 8)
    integer :: i, c

    do i = 1, 10
      view%turn = rotation_matrix(random_rotation(3, i))
      view%x = vector(i, 3)
      low = vector(i, 4) - 1.0_wp
      high = vector(i, 5) + 1.0_wp
      call box_in_view(view, low, high, new_low, new_high)
      do c = 0, 7
        corner(:, c + 1) = seen_from(view, merge(high, low, btest(c, [0, 1, 2])))
      end do
      call check('lower corner', new_low, minval(corner, 2), 1.0e-14_wp)
      call check('upper corner', new_high, maxval(corner, 2), 1.0e-14_wp)
    end do
  end subroutine check_box

  !> No two points within the radius move further against one another, and some move nearly as far.
  subroutine check_way()
    real(wp), parameter :: radius_a = 2.0_wp, radius_b = 1.0_wp, x(3) = [1.0_wp, 0.0_wp, 0.0_wp], &
      y(3) = [0.0_wp, 1.0_wp, 0.0_wp]
    type(poses_t) :: before, now
    real(wp) :: way, longest, turn
    integer :: i, k

    do i = 1, 10
      turn = 0.02_wp*i
      before = poses_t(vector(i, 6), vector(i, 7), random_rotation(4, i), random_rotation(5, i))
      now = before
      now%x_a = before%x_a + 0.1_wp*vector(i, 8)
      now%q_a = quaternion_product(quaternion_from_axis(y, turn), before%q_a)
      now%q_b = quaternion_product(quaternion_from_axis(x, 2*turn), before%q_b)
      way = way_between(before, now, radius_a, radius_b)
      longest = 0.0_wp
      do k = 1, 100
        longest = max(longest, norm2(place(now%x_a, now%q_a, radius_a, 2*k) &
          - place(before%x_a, before%q_a, radius_a, 2*k) &
          - place(now%x_b, now%q_b, radius_b, 2*k + 1) &
          + place(before%x_b, before%q_b, radius_b, 2*k + 1)))
      end do
      call check('none goes further', longest <= way)
      call check('some nearly as far', longest > 0.6_wp*way)
    end do
    now = before
    now%q_a = quaternion_product(quaternion_from_axis(y, 0.1_wp), before%q_a)
    way = way_between(before, now, radius_a, radius_b)
    call check('a turn alone', way, 4*radius_a*sin(0.1_wp/4), 1.0e-14_wp)
  end subroutine check_way

  !> Point number k at a distance from the centre of a body.
  pure function place(x, q, radius, k) result(p)
    real(wp), intent(in) :: x(3), q(4), radius
    integer, intent(in) :: k
    real(wp) :: p(3)

    p = vector(k, 9)
    p = x + matmul(rotation_matrix(q), radius*p/norm2(p))
  end function place

end module test_near_features_m
