!> Links of the viscous stage: between neighbours, to the exact surface of bodies, to sides.
!!
!! A cell whose centre lies in the fluid is joined to its six neighbours by links. A link that meets
!! a surface at distance theta h becomes a wall link of conductance mu A/(theta h) (symmetric
!! Shortley-Weller links, Gibou et al. 2002), which is exact for shear past any plane. Its mass is
!! that of its group (`merged_cells_m`). A small cell without a target keeps its velocity.
!! Where the cells are too coarse for the boundary layer, wall links pull with the stress of a rough
!! one instead (`wall_layer_m`).
module viscous_links_m
  use kinds_m, only: wp, i8
  use vectors_m, only: cube_root
  use grid_m, only: grid_t, unit_step
  use boundary_kinds_m, only: drags, is_wall, no_side
  use solid_geometry_m, only: solid_geometry_t, bounded_link
  use rigid_motion_m, only: rigid_motion_t
  use rigid_flux_m, only: nearest_arm
  use mixture_m, only: harmonic_mean
  use growing_m, only: ensure_capacity
  use viscous_system_m, only: viscous_t, wall_links_t
  use merged_cells_m, only: merged_cells_t, is_unmerged
  use wall_plane_m, only: distance_of_links
  use wall_layer_m, only: along_share, rough_viscosity
  use exact_sum_m, only: exact_add_columns, exact_totals, accumulator_size, no_terms, terms_at_once
  use parallel_m, only: global_max
  implicit none
  private
  public :: build_viscous

  integer, parameter :: worth_threads = 1000        !! fewer wall links are the work of one thread
  real(wp), parameter :: min_mass = 1.0e-6_wp     !! share below which a velocity is the wall's

contains

  !> Assemble masses, links and wall links for the geometry and the fluid at the end of the step.
  subroutine build_viscous(grid, solid, bodies, rho, mu, dt, self, merged)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in), dimension(grid%first(1):, grid%first(2):, grid%first(3):), &
      contiguous :: rho, mu      !! [kg/m3], [Pa s]
    real(wp), intent(in) :: dt   !! [s]
    type(viscous_t), intent(inout) :: self
    type(merged_cells_t), intent(in), optional :: merged
      !! none where there are no small cells and no rough layers
    integer :: d, k, i, j

    self%dt = dt
    self%walls%n = 0
    self%sides%n = 0
    !$omp parallel do schedule(static)
    do k = lbound(self%diagonal, 3), ubound(self%diagonal, 3)
      self%diagonal(:, :, k, :) = 0.0_wp
    end do
    ! Mass over dt of each cell with its centre in the fluid; none of the others.
    !$omp parallel do private(i, j) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          self%mass(i, j, k) = &
            merge(rho(i, j, k)*max(1.0_wp - solid%alpha(i, j, k), min_mass)*grid%volume/dt, &
                  0.0_wp, solid%inside(i, j, k) == 0)
        end do
      end do
    end do
    if (present(merged)) call masses_of_groups(grid, solid, rho, dt, merged, self)
    do d = 1, 3
      call ordinary_links(grid, solid, mu, d, self%link(:, :, :, d))
      call links_to_sides(grid, solid, mu, d, self)
    end do
    call links_to_bodies(grid, solid, bodies, rho, mu, self, merged)
    call bodies_seen_by_links(solid, bodies, mu, grid, self)
    call finish_diagonal(grid, self%link, self%mass, self%diagonal, self%spread)
  end subroutine build_viscous

  !> The ordinary links and the masses into the diagonal, which is 1 where there is no unknown.
  !! `spread` is the largest share of the links.
  subroutine finish_diagonal(grid, link, mass, diagonal, spread)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: link(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(in), contiguous :: mass(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(inout), contiguous :: &
      diagonal(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(out) :: spread
    integer :: i, j, k, c
    real(wp) :: links, most(1)

    most = 0.0_wp
    !$omp parallel do collapse(2) private(i, j, links) reduction(max: most) schedule(static)
    do c = 1, 3
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            links = link(i, j, k, 1) + link(i + 1, j, k, 1) + link(i, j, k, 2) &
                    + link(i, j + 1, k, 2) + link(i, j, k, 3) + link(i, j, k + 1, 3)
            diagonal(i, j, k, c) = merge(diagonal(i, j, k, c) + mass(i, j, k) + links, 1.0_wp, &
                                         mass(i, j, k) > 0.0_wp)
            if (mass(i, j, k) > 0.0_wp) most(1) = max(most(1), links/diagonal(i, j, k, c))
          end do
        end do
      end do
    end do
    call global_max(most)
    spread = most(1)
  end subroutine finish_diagonal

  !> The small cells' mass goes to their targets, as the lever has it (`merged_momentum_m`); those
  !! without one are unknowns themselves. Of cut cells the unknown is the velocity at the centre
  !! (`wall_layer_m`).
  subroutine masses_of_groups(grid, solid, rho, dt, merged, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(in) :: dt
    type(merged_cells_t), intent(in) :: merged
    type(viscous_t), intent(inout) :: self
    integer :: g, m

    do g = 1, merged%n_groups
      associate (c => merged%cell(:, merged%leader(g)))
        if (.not. grid%owns(c)) cycle
        do m = merged%first(g), merged%first(g + 1) - 1
          associate (small => merged%part(1, m), target => merged%part(2, m))
            self%mass(c(1), c(2), c(3)) = self%mass(c(1), c(2), c(3)) &
              + merged%share(target, small) &
              *along_share(merged, small, target)**2*small_mass(merged%cell(:, small))
          end associate
        end do
      end associate
    end do
    do m = 1, merged%n
      associate (c => merged%cell(:, m))
        if (.not. grid%owns(c)) cycle
        if (m > merged%n_small) then
          self%mass(c(1), c(2), c(3)) = self%mass(c(1), c(2), c(3))/merged%centre(m)
        else if (is_unmerged(merged, m)) then
          self%mass(c(1), c(2), c(3)) = small_mass(c)
        end if
      end associate
    end do
  contains
    pure real(wp) function small_mass(c)
      integer, intent(in) :: c(3)

      small_mass = rho(c(1), c(2), c(3))*(1.0_wp - solid%alpha(c(1), c(2), c(3)))*grid%volume/dt
    end function small_mass
  end subroutine masses_of_groups

  !> Ordinary links in direction d, between neighbours with their centres in the fluid and nothing
  !! between them; none where a cell would be its own neighbour.
  subroutine ordinary_links(grid, solid, mu, d, link)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in), contiguous :: mu(grid%first(1):, grid%first(2):, grid%first(3):)
    integer, intent(in) :: d
    real(wp), intent(inout), contiguous :: link(grid%first(1):, grid%first(2):, grid%first(3):)
    integer :: i, j, k, e(3), upper(3)
    real(wp) :: conductance   !! A/h [m]
    logical :: ordinary

    e = unit_step(:, d)
    upper = grid%hi + e
    conductance = grid%area(d)/grid%h(d)
    if (grid%n(d) == 1) conductance = 0.0_wp
    !$omp parallel do private(i, j, ordinary) schedule(static)
    do k = grid%lo(3), upper(3)
      do j = grid%lo(2), upper(2)
        do i = grid%lo(1), upper(1)
          ordinary = solid%inside(i, j, k) == 0 &
                     .and. solid%inside(i - e(1), j - e(2), k - e(3)) == 0 &
                     .and. solid%link_number(i, j, k, d) == 0
          link(i, j, k) = merge(conductance*harmonic_mean(mu(i - e(1), j - e(2), k - e(3)), &
                                                         mu(i, j, k)), 0.0_wp, ordinary)
        end do
      end do
    end do
  end subroutine ordinary_links

  !> Wall links, of one or both cells of each face through which a link meets a surface, grouped by
  !! body.
  subroutine links_to_bodies(grid, solid, bodies, rho, mu, self, merged)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in), dimension(grid%first(1):, grid%first(2):, grid%first(3):), &
      contiguous :: rho, mu
    type(viscous_t), intent(inout) :: self
    type(merged_cells_t), intent(in), optional :: merged
    type(wall_links_t) :: found             ! as they are found
    integer :: body_of(2*solid%n_link)      ! of each; 0: none
    real(wp) :: spacing
    integer :: m, f(3)

    spacing = cube_root(grid%volume)
    if (count(grid%n > 1) == 2) spacing = sqrt(product(grid%h, grid%n > 1))   ! a slice
    found%n = 2*solid%n_link
    allocate (found%cell(3, found%n), found%k(found%n), found%arm(3, found%n))
    !$omp parallel do private(f) schedule(static)
    do m = 1, solid%n_link
      body_of(2*m - 1:2*m) = 0
      f = solid%link(1:3, m)
      associate (d => solid%link(4, m), theta => solid%link_length(:, m), &
                 body => solid%link_body(:, m))
        if (grid%side_of_face(f(d), d) /= no_side) cycle
        call wall_link(2*m - 1, f - unit_step(:, d), d, theta(1), 1, body(1))
        call wall_link(2*m, f, d, theta(2), -1, body(2))
      end associate
    end do
    call group_by_body(bodies%n, found, body_of, self)
  contains
    !> Link n from the centre of an own cell c in the fluid along +d or -d to the surface of a body.
    subroutine wall_link(n, c, d, theta, sense, body)
      integer, intent(in) :: n, c(3), d, sense, body
      real(wp), intent(in) :: theta   !! [cells]
      real(wp) :: x_wall(3), t, viscosity
      real(wp) :: at_centre   ! velocity there over the mean
      integer :: a

      if (any(c < grid%lo) .or. any(c > grid%hi)) return
      if (solid%inside(c(1), c(2), c(3)) /= 0) return
      t = bounded_link(theta)
      do a = 1, 3
        x_wall(a) = grid%centre(c(a), a)
      end do
      x_wall(d) = x_wall(d) + real(sense, wp)*t*grid%h(d)
      viscosity = mu(c(1), c(2), c(3))
      if (present(merged)) then   ! that of a rough layer; a fluid without viscosity slips
        if (viscosity > 0.0_wp .and. merged%wall_speed(n) > 0.0_wp) then
          at_centre = 1.0_wp
          if (merged%number(c(1), c(2), c(3)) > 0) at_centre = &
            merged%centre(merged%number(c(1), c(2), c(3)))
          viscosity = max(viscosity, rough_viscosity(rho(c(1), c(2), c(3)), &
            at_centre*merged%wall_speed(n), distance_of_links(grid, solid, c), spacing))
        end if
      end if
      found%cell(:, n) = c
      body_of(n) = body
      found%k(n) = viscosity*grid%area(d)/(grid%h(d)*t)
      found%arm(:, n) = nearest_arm(grid, x_wall, bodies%x(:, body))
    end subroutine wall_link
  end subroutine links_to_bodies

  !> Half a link in direction d to a wall of the domain or to an inflow, which pulls the cell
  !! towards the velocity of the side; slip walls hold the normal component only.
  subroutine links_to_sides(grid, solid, mu, d, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in), contiguous :: mu(grid%first(1):, grid%first(2):, grid%first(3):)
    integer, intent(in) :: d
    type(viscous_t), intent(inout) :: self
    integer :: s, i, j, k, a(3), b(3), c(3)
    real(wp) :: value

    do s = 1, 2
      call grid%side_faces(s, d, a, b)
      self%link(a(1):b(1), a(2):b(2), a(3):b(3), d) = 0.0_wp
      ! Only a side that moves goes into a list.
      !$omp parallel do collapse(2) private(i, c, value) schedule(static) &
      !$omp if (all(abs(grid%side_velocity(:, s, d)) <= 0.0_wp))
      do k = a(3), b(3)
        do j = a(2), b(2)
          do i = a(1), b(1)
            c = [i, j, k] - merge(0, 1, s == 1)*unit_step(:, d)
            if (solid%inside(c(1), c(2), c(3)) /= 0) cycle
            value = 2.0_wp*mu(c(1), c(2), c(3))*grid%area(d)/grid%h(d)
            if (drags(grid%side(s, d))) then
              self%diagonal(c(1), c(2), c(3), :) = self%diagonal(c(1), c(2), c(3), :) + value
              if (.not. any(abs(grid%side_velocity(:, s, d)) > 0.0_wp)) cycle
              self%sides%n = self%sides%n + 1
              self%sides%cell(:, self%sides%n) = c
              self%sides%pull(:, self%sides%n) = value*grid%side_velocity(:, s, d)
            else if (is_wall(grid%side(s, d))) then
              self%diagonal(c(1), c(2), c(3), d) = self%diagonal(c(1), c(2), c(3), d) + value
            end if
          end do
        end do
      end do
    end do
  end subroutine links_to_sides

  !> Bring the wall links into the order of the bodies, keeping the order in which they were found,
  !! and into the diagonal.
  subroutine group_by_body(n_bodies, found, body_of, self)
    integer, intent(in) :: n_bodies
    type(wall_links_t), intent(in) :: found
    integer, intent(in) :: body_of(:)   !! each of them; 0: none
    type(viscous_t), intent(inout) :: self
    integer :: b, m, place

    associate (walls => self%walls)
      call ensure_capacity(found%n, walls%cell)
      call ensure_capacity(found%n, walls%k)
      call ensure_capacity(found%n, walls%arm)
      walls%first = 0
      do m = 1, found%n
        b = body_of(m)
        if (b > 0) walls%first(b) = walls%first(b) + 1
      end do
      place = 1
      do b = 1, n_bodies + 1
        m = walls%first(b)
        walls%first(b) = place
        place = place + m
      end do
      do m = 1, found%n
        b = body_of(m)
        if (b == 0) cycle
        associate (c => found%cell(:, m))
          self%diagonal(c(1), c(2), c(3), :) = self%diagonal(c(1), c(2), c(3), :) + found%k(m)
        end associate
        place = walls%first(b)
        walls%first(b) = place + 1
        walls%cell(:, place) = found%cell(:, m)
        walls%k(place) = found%k(m)
        walls%arm(:, place) = found%arm(:, m)
      end do
      do b = n_bodies + 1, 2, -1
        walls%first(b) = walls%first(b - 1)
      end do
      walls%first(1) = 1
      walls%n = walls%first(n_bodies + 1) - 1
    end associate
  end subroutine group_by_body

  !> What the links do to a body that moves: its 6 x 6 block of the system, with mass and inertia
  !! over dt added by the solver. With the sums K = sum k, S = sum k r, M = sum k r r^T over the
  !! links of arm r, a motion (v, w) is held by the force K v + w x S and the torque
  !! S x v + (tr(M) 1 - M) w; and by 2 mu V w, the part of the wall stress that the links leave out.
  subroutine bodies_seen_by_links(solid, bodies, mu, grid, self)
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: mu(grid%first(1):, grid%first(2):, grid%first(3):)
    type(viscous_t), intent(inout) :: self
    integer, parameter :: sums = 11   ! K, S, M and viscosity times volume
    integer(i8) :: accumulator(accumulator_size, sums*bodies%n)
    real(wp) :: total(sums*bodies%n), term(terms_at_once, 1), moment(terms_at_once, 10)
    integer :: b, c, m, n, from, i(3)

    accumulator = spread(no_terms, 2, sums*bodies%n)
    !$omp parallel private(b, from, n, m, i, term, moment) if (self%walls%n > worth_threads)
    do b = 1, bodies%n
      ! K, S and M (xx, yy, zz, xy, yz, zx) of the links of the body; the threads share the work.
      !$omp do schedule(dynamic)
      do from = self%walls%first(b), self%walls%first(b + 1) - 1, terms_at_once
        n = min(terms_at_once, self%walls%first(b + 1) - from)
        do m = 1, n
          associate (k => self%walls%k(from + m - 1), r => self%walls%arm(:, from + m - 1))
            moment(m, 1) = k
            moment(m, 2:4) = k*r
            moment(m, 5:7) = k*r**2
            moment(m, 8:10) = k*[r(1)*r(2), r(2)*r(3), r(3)*r(1)]
          end associate
        end do
        call exact_add_columns(moment(:n, :), accumulator(:, sums*b - 10:sums*b - 1))
      end do
      !$omp end do nowait
      ! Integral of the fluid's viscosity over the own cells of the body [Pa s m3].
      !$omp do schedule(dynamic)
      do from = solid%body_cell(b), solid%body_cell(b + 1) - 1, terms_at_once
        n = 0
        do m = from, min(from + terms_at_once, solid%body_cell(b + 1)) - 1
          i = solid%cell(:, m)
          if (any(i < grid%lo) .or. any(i > grid%hi)) cycle
          n = n + 1
          term(n, 1) = mu(i(1), i(2), i(3))*solid%cell_alpha(m)*grid%volume
        end do
        call exact_add_columns(term(:n, :), accumulator(:, sums*b:sums*b))
      end do
      !$omp end do nowait
    end do
    !$omp end parallel
    call exact_totals(accumulator, total)
    do b = 1, bodies%n
      self%body_matrix(:, :, b) = held_by(total(sums*b - 10:sums*b - 1))
      self%spin_drag(b) = 2.0_wp*total(sums*b)
      do c = 4, 6
        self%body_matrix(c, c, b) = self%body_matrix(c, c, b) + self%spin_drag(b)
      end do
    end do
  end subroutine bodies_seen_by_links

  !> The 6 x 6 block from K, S and M.
  pure function held_by(moment) result(matrix)
    real(wp), intent(in) :: moment(10)   !! K, S, M (xx, yy, zz, xy, yz, zx)
    real(wp) :: matrix(6, 6)
    real(wp) :: s_cross(3, 3)
    integer :: c

    associate (k => moment(1), s => moment(2:4), m => moment(5:7), xy => moment(8), &
               yz => moment(9), zx => moment(10))
      s_cross = reshape([0.0_wp, s(3), -s(2), -s(3), 0.0_wp, s(1), s(2), -s(1), 0.0_wp], [3, 3])
      matrix = 0.0_wp
      matrix(4:6, 1:3) = s_cross
      matrix(1:3, 4:6) = -s_cross
      matrix(4:6, 4:6) = -reshape([m(1), xy, zx, xy, m(2), yz, zx, yz, m(3)], [3, 3])
      do c = 1, 3
        matrix(c, c) = k
        matrix(c + 3, c + 3) = sum(m) - m(c)
      end do
    end associate
  end function held_by

end module viscous_links_m
