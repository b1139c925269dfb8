!> Velocity of the faces at the walls of bodies, before the pressure stage: between that of the cell
!! and that of the wall.
module wall_faces_m
  use kinds_m, only: wp
  use vectors_m, only: norm
  use grid_m, only: grid_t, unit_step
  use fields_m, only: flow_t
  use boundary_kinds_m, only: no_side
  use solid_geometry_m, only: solid_geometry_t, wall_area, edge_in
  use rigid_motion_m, only: rigid_motion_t, wall_velocity
  use rigid_flux_m, only: nearest_arm, velocity_in_cell
  use mixture_m, only: face_mean
  use merged_cells_m, only: merged_cells_t
  use wall_layer_m, only: scaled_to_wall, share_along
  use face_velocity_m, only: acceleration_t, rhie_chow_time, face_step
  implicit none
  private
  public :: face_velocity_at_walls, shorten_at_walls

contains

  !> Faces of the cells at walls: their Rhie-Chow acceleration counts for `rhie_chow_time` by the
  !! Courant number of the flow past the wall instead of for dt; in liquid alone, since gas needs
  !! all of its damping and has no drag worth the name.
  subroutine shorten_at_walls(grid, dt, bodies, merged, rho, a, flow)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: dt                   !! [s]
    type(rigid_motion_t), intent(in) :: bodies
    type(merged_cells_t), intent(in) :: merged
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! that of the system [kg/m3]
    type(acceleration_t), intent(in) :: a
    type(flow_t), intent(inout) :: flow
    integer :: m, d, c(3)

    !$omp parallel do private(d, c) schedule(dynamic, 64)
    do m = 1, merged%n
      do d = 1, 3
        call shorten(merged%cell(:, m), d)
        c = merged%cell(:, m) + unit_step(:, d)
        if (c(d) > grid%hi(d) + 1) cycle
        if (merged%number(c(1), c(2), c(3)) == 0) call shorten(c, d)
      end do
    end do
  contains
    !> The lower face of cell f in direction d, of which f or the cell below is a wall cell.
    subroutine shorten(f, d)
      integer, intent(in) :: f(3), d
      integer :: low(3), m_low, m_up
      real(wp) :: nu, past(3), time

      if (any(f < grid%lo) .or. any(f > grid%hi + unit_step(:, d))) return
      if (grid%side_of_face(f(d), d) /= no_side) return
      low = f - unit_step(:, d)
      associate (i => f(1), j => f(2), k => f(3), p => low(1), q => low(2), r => low(3))
        if (.not. (a%in_liquid(p, q, r) .and. a%in_liquid(i, j, k))) return
        m_low = merge(merged%number(p, q, r), merged%number(i, j, k), merged%number(p, q, r) > 0)
        m_up = merge(merged%number(i, j, k), merged%number(p, q, r), merged%number(i, j, k) > 0)
        past = face_mean(flow%u(p, q, r, :) - velocity_in_cell(grid, bodies, merged%body(m_low), &
          low), flow%u(i, j, k, :) - velocity_in_cell(grid, bodies, merged%body(m_up), f))
        time = rhie_chow_time(dt, dt*sum(abs(past)/grid%h))
        if (time >= dt) return   ! as everywhere
        nu = face_mean(flow%mu(p, q, r), flow%mu(i, j, k))/face_mean(rho(p, q, r), rho(i, j, k))
        flow%uf(i, j, k, d) = flow%uf(i, j, k, d) &
          - (face_step(dt, nu, grid%inverse_h2) - face_step(time, nu, grid%inverse_h2)) &
          *(a%face(i, j, k, d) - face_mean(a%cell(p, q, r, d), a%cell(i, j, k, d)))
      end associate
    end subroutine shorten
  end subroutine shorten_at_walls

  !> Faces beside a moving surface: between the velocity of the cell and that of the wall, where the
  !! line through the face ends, as the layer along the wall has it. A wide open face before a cell
  !! with an edge keeps the mean of its cells instead, as `solid%edge` goes to 1: the stream leaves
  !! the edge straight.
  !!
  !! A face that opens or closes under a flat side then does so with the velocity of the wall. With
  !! the mean of the two cells each layer of faces that the side crosses takes an impulse of about
  !! rho A h (U - u) from the body, whatever grid and step (docs/decisions/coupling.md).
  !!
  !! In liquid both cell and wall have the old pressure in their velocity. Next to gas neither has:
  !! a cell of gas accelerates up to 830 times as much as the wall, and the old pressure is only a
  !! guess there, which the solve must be free to replace (docs/decisions/cavity.md).
  subroutine face_velocity_at_walls(grid, solid, at_start, predicted, merged, dt, c_ismac, rho, &
                                    a, flow)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: at_start   !! motion when the step began
    type(rigid_motion_t), intent(in) :: predicted   !! motion as far as the old pressure makes it
    type(merged_cells_t), intent(in) :: merged     !! with the slip of the layer at small cells
    real(wp), intent(in) :: dt                   !! [s]
    logical, intent(in) :: c_ismac
      !! all cells are given their acceleration, and the compact one counts for dt
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! that of the system [kg/m3]
    type(acceleration_t), intent(in) :: a
    type(flow_t), intent(inout) :: flow
    integer :: m

    !$omp parallel do schedule(static)
    do m = 1, solid%n_link
      call set_face(m, solid%link(1:3, m), solid%link(4, m))
    end do
  contains
    !> The lower face of cell f in direction d, with link m: mean of what the cells of the link see.
    subroutine set_face(m, f, d)
      integer, intent(in) :: m, f(3), d
      integer :: low(3), sides
      real(wp) :: total, plane

      low = f - unit_step(:, d)
      if (any(f < grid%lo) .or. any(f > grid%hi + unit_step(:, d))) return
      if (any((low < 1 .or. f > grid%n) .and. .not. grid%periodic)) return
      sides = 0
      total = 0.0_wp
      associate (i => f(1), j => f(2), k => f(3))
        if (solid%aperture(i, j, k, d) <= 0.0_wp) return
        if (solid%inside(low(1), low(2), low(3)) == 0) then
          sides = sides + 1
          total = total + seen_from(low, 1, solid%link_length(1, m), solid%link_body(1, m), f, d)
        end if
        if (solid%inside(i, j, k) == 0) then
          sides = sides + 1
          total = total + seen_from(f, -1, solid%link_length(2, m), solid%link_body(2, m), f, d)
        end if
        if (sides == 0) return
        ! Is what lies behind face f a plane wall, 1, or an edge that the stream passes straight, 0?
        plane = 1.0_wp
        if (solid%aperture(f(1), f(2), f(3), d) >= 1.0_wp) then
          plane = 1.0_wp - max(edge_in(solid, low), edge_in(solid, f))
        end if
        flow%uf(i, j, k, d) = (1.0_wp - plane)*flow%uf(i, j, k, d) + plane*(total/real(sides, wp))
      end associate
    end subroutine set_face

    !> Velocity of face f as seen from cell c, whose link along +d or -d ends at theta cells.
    pure function seen_from(c, sense, theta, body, f, d) result(velocity)
      integer, intent(in) :: c(3), sense, body, f(3), d
      real(wp), intent(in) :: theta   !! [cells]
      real(wp) :: velocity
      integer :: o(3)
      real(wp) :: x_wall(3), arm(3), wall(3), u(3), n(3), r, along, gain, time

      x_wall = [grid%centre(c(1), 1), grid%centre(c(2), 2), grid%centre(c(3), 3)]
      x_wall(d) = x_wall(d) + real(sense, wp)*theta*grid%h(d)
      arm = nearest_arm(grid, x_wall, predicted%x(:, body))
      n = wall_area(grid, solid, f - unit_step(:, d)) + wall_area(grid, solid, f)
      n = n/max(norm(n), tiny(1.0_wp))
      u = flow%u(c(1), c(2), c(3), :)
      if (a%in_liquid(c(1), c(2), c(3))) then
        wall = wall_velocity(predicted%motion(:, body), arm)
        ! Time for which the Rhie-Chow acceleration at a wall counts in liquid [s].
        time = dt
        if (.not. c_ismac) time = rhie_chow_time(dt, dt*sum(abs(u - wall)/grid%h))
        time = face_step(time, flow%mu(c(1), c(2), c(3))/rho(c(1), c(2), c(3)), &
                         grid%inverse_h2)
        gain = time*(a%face(f(1), f(2), f(3), d) - a%cell(c(1), c(2), c(3), d))
      else
        wall = wall_velocity(at_start%motion(:, body), arm)
        gain = dt*a%face(f(1), f(2), f(3), d)
        if (c_ismac .or. a%kicked(c(1), c(2), c(3))) u = u - dt*a%cell(c(1), c(2), c(3), :)
      end if
      r = middle_of_face(theta, n, d, solid%aperture(f(1), f(2), f(3), d))
      o = c + sense*unit_step(:, d)
      along = 1.0_wp   ! free slip where there is fluid beyond the wall again
      if (solid%inside(o(1), o(2), o(3)) /= 0) along = share_along(r, merged%slip(o(1), o(2), o(3)))
      u = wall + scaled_to_wall(u - wall, n, along, r)
      velocity = u(d) + gain
    end function seen_from

    !> r of the middle of the open part of the face: 0 at the wall, 1 as far as the centre of the
    !! cell.
    pure function middle_of_face(theta, n, d, aperture) result(r)
      real(wp), intent(in) :: theta, n(3), aperture   !! link [cells], normal, open share
      integer, intent(in) :: d                    !! direction of the link
      real(wp) :: r
      real(wp) :: ratio, cell, face   !! distances from the wall [spacings along the link]
      integer :: a, b

      cell = theta*abs(n(d))
      if (aperture >= 1.0_wp) then
        face = (theta - 0.5_wp)*abs(n(d))
      else
        ! Spacing of the cells across direction d towards the wall, over that along d: 1 for cubes.
        a = 1 + mod(d, 3)
        b = 1 + mod(d + 1, 3)
        ratio = sqrt(max((n(a)*(grid%h(a)/grid%h(d)))**2 + (n(b)*(grid%h(b)/grid%h(d)))**2, &
                         tiny(1.0_wp))/max(n(a)**2 + n(b)**2, tiny(1.0_wp)))
        face = 0.5_wp*aperture*ratio*sqrt(max(1.0_wp - n(d)**2, 0.0_wp))
      end if
      r = max(min(1.0_wp, face/max(cell, tiny(1.0_wp))), 0.0_wp)
    end function middle_of_face
  end subroutine face_velocity_at_walls

end module wall_faces_m
