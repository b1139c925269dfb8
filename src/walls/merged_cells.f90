!> Small cut cells and the cells with which they are merged (docs/theory.md, section 17).
!!
!! A small cut cell has its centre in a body. The fluid in it has no velocity of its own: it is
!! merged with up to four target cells, with their centre in the fluid across its open faces, else
!! the nearest, by shares that close with the face. A target and its parts of small cells are a
!! group with one momentum (`merged_momentum_m`). A small cell without a target (a gap narrower than
!! a cell) is unmerged.
module merged_cells_m
  use kinds_m, only: wp
  use vectors_m, only: norm
  use growing_m, only: ensure_capacity
  use grid_m, only: grid_t, n_halo, unit_step
  use solid_geometry_m, only: solid_geometry_t, edge_in, centre_in_fluid
  use rigid_motion_m, only: rigid_motion_t
  use rigid_flux_m, only: velocity_in_cell
  use wall_plane_m, only: wall_normal, distance_to_fluid, distance_to_centre, distance_by_links
  implicit none
  private
  public :: merged_cells_t, merged_cells_init, find_merged_cells, order_by_body
  public :: max_targets, is_unmerged, velocity_at_wall, match_densities

  integer, parameter :: halo_layers = 2      !! layers of the halo with small cells that are needed
  integer, parameter :: max_targets = 4  !! of a small cell
  integer, parameter :: here(3) = 0      !! no step

  !> The cells at walls, and the groups among them. A wall cell is a cut cell or a target.
  type :: merged_cells_t
    integer :: poses = 0                         !! of the bodies (`solid%poses`), 0: of none
    integer :: n = 0                             !! wall cells, small cells first
    integer :: n_small = 0
    integer, allocatable :: cell(:, :)           !! (3, *)
    integer, allocatable :: body(:)              !! (*) body whose wall it is
    integer, allocatable :: number(:, :, :)      !! number of a wall cell, else 0
    !> Wall cells of body b: `by_body(first_of_body(b):first_of_body(b+1)-1)`.
    integer, allocatable :: by_body(:), first_of_body(:)
    real(wp), allocatable :: normal(:, :)        !! (3, *) of the wall, into the fluid
    integer, allocatable :: target(:, :)         !! (max_targets, n_small) numbers, 0: none
    real(wp), allocatable :: share(:, :)         !! likewise: of the small cell, sum 1
    real(wp), allocatable :: r_wall(:, :)        !! likewise: distance from the wall over theirs
    real(wp), allocatable :: r(:, :)             !! likewise: nearer to 1 beside light targets
    real(wp), allocatable :: distance(:, :)      !! likewise: of their fluid from the wall [m]
    real(wp), allocatable :: slip(:, :, :)       !! of the layer at the small cell in a cell, 0 to 1
    !> Of a cut cell with its centre in the fluid: distance from the wall of the middle of its fluid
    !! [m], and that of its centre over it; no distance where the centre is no nearer.
    real(wp), allocatable :: middle(:), ratio(:)
    !> Of a wall cell: share of its velocity, seen from the wall, that its centre has.
    real(wp), allocatable :: centre(:)
    real(wp), allocatable :: wall_speed(:)
      !! (at least 2 n_link) of the fluid past the wall at the ends of the links [m/s]
    integer :: n_groups = 0                      !! with a target beside an own cell
    integer, allocatable :: leader(:)            !! (groups) number of the target
    integer, allocatable :: first(:)             !! (groups + 1) of its parts in `part`
    integer, allocatable :: part(:, :)           !! (2, *) small cell, which of its targets
  end type merged_cells_t

contains

  !> Allocate for a grid; no cells.
  subroutine merged_cells_init(grid, self)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(out) :: self
    integer :: a(3), b(3)

    a = grid%first
    b = grid%last
    allocate (self%cell(3, 0), self%body(0), self%by_body(0), self%first_of_body(0))
    allocate (self%normal(3, 0), self%leader(0), self%part(2, 0))
    allocate (self%middle(0), self%ratio(0), self%centre(0), self%wall_speed(0))
    allocate (self%target(max_targets, 0), self%share(max_targets, 0))
    allocate (self%r_wall(max_targets, 0), self%r(max_targets, 0), self%distance(max_targets, 0))
    allocate (self%first(1), source=1)
    allocate (self%number(a(1):b(1), a(2):b(2), a(3):b(3)), source=0)
    allocate (self%slip(a(1):b(1), a(2):b(2), a(3):b(3)), source=0.0_wp)
  end subroutine merged_cells_init

  !> Find small cells, targets and groups of a geometry, those of the halo too that own cells belong
  !! to; nothing is done where they are known already.
  subroutine find_merged_cells(grid, solid, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(merged_cells_t), intent(inout) :: self
    integer :: m, d, c(3), e(3)
    logical :: has_fluid

    if (solid%poses > 0 .and. self%poses == solid%poses) return
    self%poses = solid%poses
    do m = 1, self%n
      c = self%cell(:, m)
      self%number(c(1), c(2), c(3)) = 0
    end do
    self%n = 0
    do m = 1, solid%n_cut
      c = solid%cut_cell(:, m)
      if (solid%inside(c(1), c(2), c(3)) == 0 .or. .not. is_near(grid, c, halo_layers)) cycle
      has_fluid = any(solid%aperture(c(1), c(2), c(3), :) > 0.0_wp)
      do d = 1, 3
        e = c + unit_step(:, d)
        has_fluid = has_fluid .or. solid%aperture(e(1), e(2), e(3), d) > 0.0_wp
      end do
      if (has_fluid) call add_cell(c, solid%inside(c(1), c(2), c(3)), self)
    end do
    self%n_small = self%n
    call add_cut_cells(grid, solid, self)
    call find_targets(grid, solid, self)
    call find_middles(grid, solid, self)
    call order_by_body(size(solid%body_cell) - 1, self)
    call group_small_cells(grid, self)
    call ensure_capacity(self%n, self%centre)
    self%centre(:self%n) = 1.0_wp
    call ensure_capacity(2*solid%n_link, self%wall_speed)
    self%wall_speed = 0.0_wp
  end subroutine find_merged_cells

  !> In the domain, and an own cell or one of the layers of the halo that matter.
  pure logical function is_near(grid, c, layers)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: c(3)
    integer, intent(in) :: layers

    is_near = all(c >= grid%lo - layers .and. c <= grid%hi + layers) .and. .not. grid%outside(c)
  end function is_near

  !> A wall cell more, if it is not in the list.
  subroutine add_cell(c, body, self)
    integer, intent(in) :: c(3), body
    type(merged_cells_t), intent(inout) :: self

    if (self%number(c(1), c(2), c(3)) > 0) return
    self%n = self%n + 1
    call ensure_capacity(self%n, self%cell)
    call ensure_capacity(self%n, self%body)
    self%cell(:, self%n) = c
    self%body(self%n) = body
    self%number(c(1), c(2), c(3)) = self%n
  end subroutine add_cell

  !> The same for a cell beyond the first n_known of the list, which several bodies may name: it is
  !! at the wall of the one with the largest share, whatever their order.
  subroutine add_cell_of_most(c, body, share, n_known, most, self)
    integer, intent(in) :: c(3), body, n_known
    real(wp), intent(in) :: share                          !! [-]
    real(wp), intent(inout), allocatable :: most(:)        !! (*) largest so far [-]
    type(merged_cells_t), intent(inout) :: self
    integer :: n

    n = self%number(c(1), c(2), c(3))
    if (n == 0) then
      call add_cell(c, body, self)
      n = self%n
      call ensure_capacity(n, most)
      most(n) = share
    else if (n > n_known) then
      if (share > most(n)) self%body(n) = body
      most(n) = max(most(n), share)
    end if
  end subroutine add_cell_of_most

  !> The cut cells with their centre in the fluid, each at the wall of the body that fills most of
  !! it, and the cells at faces that a body fills, or in which it holds fluid, in part.
  subroutine add_cut_cells(grid, solid, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(merged_cells_t), intent(inout) :: self
    real(wp), allocatable :: most(:)
    integer :: b, m, n_cut, c(3)

    allocate (most(0))
    do b = 1, size(solid%body_cell) - 1
      do m = solid%body_cell(b), solid%body_cell(b + 1) - 1
        c = solid%cell(:, m)
        if (solid%inside(c(1), c(2), c(3)) /= 0 .or. .not. is_near(grid, c, halo_layers)) cycle
        call add_cell_of_most(c, b, solid%cell_alpha(m), self%n_small, most, self)
      end do
    end do
    n_cut = self%n
    do b = 1, size(solid%body_face) - 1
      do m = solid%body_face(b), solid%body_face(b + 1) - 1
        call add_beside(solid%face(1:3, m), solid%face_beta(m))
        call add_beside(solid%face(1:3, m) - unit_step(:, solid%face(4, m)), solid%face_beta(m))
      end do
      do m = solid%first_held(b), solid%first_held(b + 1) - 1
        call add_beside(solid%held_face(1:3, m), solid%held_share(m))
        call add_beside(solid%held_face(1:3, m) - unit_step(:, solid%held_face(4, m)), &
          solid%held_share(m))
      end do
    end do
  contains
    subroutine add_beside(c, share)
      integer, intent(in) :: c(3)
      real(wp), intent(in) :: share   !! of the face that the body fills

      if (.not. is_near(grid, c, halo_layers)) return
      if (solid%alpha(c(1), c(2), c(3)) <= 0.0_wp) call add_cell_of_most(c, b, share, n_cut, &
        most, self)
    end subroutine add_beside
  end subroutine add_cut_cells

  !> The wall cells in the order of their bodies.
  subroutine order_by_body(n_bodies, self)
    integer, intent(in) :: n_bodies
    type(merged_cells_t), intent(inout) :: self
    integer :: b, m

    call ensure_capacity(n_bodies + 1, self%first_of_body)
    call ensure_capacity(self%n, self%by_body)
    associate (first => self%first_of_body)
      first(:n_bodies + 1) = 0
      do m = 1, self%n
        first(self%body(m)) = first(self%body(m)) + 1
      end do
      first(1) = first(1) + 1
      do b = 2, n_bodies + 1   ! behind the end of each
        first(b) = first(b) + first(b - 1)
      end do
      do m = self%n, 1, -1     ! from the back, which brings them down to the begins
        first(self%body(m)) = first(self%body(m)) - 1
        self%by_body(first(self%body(m))) = m
      end do
    end associate
  end subroutine order_by_body

  !> Targets, normal and profile of each small cell: steps to its targets, their shares of it, r,
  !! the distances of their fluid. r and distances as without a wall where there is no normal, r
  !! also where the wall has an edge, which the stream of the targets passes straight.
  subroutine find_targets(grid, solid, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(merged_cells_t), intent(inout) :: self
    real(wp) :: own, fluid   !! distance of the fluid of a small cell [m], its open share
    integer :: m, n, n_known, o(3), body
    real(wp), allocatable :: most(:)
    integer :: step(3, max_targets, self%n_small)   ! from the small cells to their targets

    call ensure_capacity(self%n_small, self%normal)
    call ensure_capacity(self%n_small, self%target)
    call ensure_capacity(self%n_small, self%share)
    call ensure_capacity(self%n_small, self%r_wall)
    call ensure_capacity(self%n_small, self%r)
    call ensure_capacity(self%n_small, self%distance)
    !$omp parallel do private(n, own) schedule(static)
    do m = 1, self%n_small
      associate (c => self%cell(:, m), normal => self%normal(:, m), share => self%share(:, m), &
                 r => self%r_wall(:, m), distance => self%distance(:, m))
        normal = wall_normal(grid, solid, c)
        r = 1.0_wp
        self%r(:, m) = 1.0_wp
        distance = 0.0_wp
        call to_targets(grid, solid, c, normal, step(:, :, m), share)
        if (all(abs(normal) <= 0.0_wp)) cycle
        own = distance_to_fluid(grid, solid, c, here, normal)
        do n = 1, max_targets
          if (share(n) <= 0.0_wp .or. .not. is_near(grid, c + step(:, n, m), n_halo)) cycle
          distance(n) = distance_to_fluid(grid, solid, c, step(:, n, m), normal)
          r(n) = max(0.0_wp, min(1.0_wp, own/max(distance(n), tiny(own))))
          r(n) = r(n) + edge_in(solid, c)*(1.0_wp - r(n))
        end do
        self%r(:, m) = r
      end associate
    end do
    n_known = self%n
    allocate (most(0))
    do m = 1, self%n_small
      body = self%body(m)   ! the list may move as it grows
      fluid = 1.0_wp - solid%alpha(self%cell(1, m), self%cell(2, m), self%cell(3, m))
      self%target(:, m) = 0
      do n = 1, max_targets
        o = self%cell(:, m) + step(:, n, m)
        if (self%share(n, m) <= 0.0_wp .or. .not. is_near(grid, o, n_halo)) cycle
        call add_cell_of_most(o, body, self%share(n, m)*fluid, n_known, most, self)
        self%target(n, m) = self%number(o(1), o(2), o(3))
      end do
    end do
  end subroutine find_targets

  !> r of each small cell and target by their densities,
  !! $$ 1 - r = (1 - r_w) \min(1, \rho_t/\rho_s). $$
  !!
  !! A small cell of momentum excess e changes its target by p e/(m + r p) (`share_momentum`). With
  !! r_w that is up to e/r_w where gas lies beside water, and still water begins to move; with r a
  !! group of water and gas is conditioned as one of gas alone: p/(m + r p) <= 1 for a target of no
  !! less volume. A single phase has r = r_w.
  subroutine match_densities(grid, rho, self)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! of the fluid, halo filled [kg/m3]
    type(merged_cells_t), intent(inout) :: self
    integer :: m, n

    !$omp parallel do private(n) schedule(static)
    do m = 1, self%n_small
      associate (s => self%cell(:, m))
        do n = 1, max_targets
          self%r(n, m) = self%r_wall(n, m)
          if (self%target(n, m) == 0) cycle
          associate (t => self%cell(:, self%target(n, m)), r_wall => self%r_wall(n, m))
            if (rho(s(1), s(2), s(3)) > rho(t(1), t(2), t(3))) self%r(n, m) = 1.0_wp &
              - (1.0_wp - r_wall)*rho(t(1), t(2), t(3))/rho(s(1), s(2), s(3))
          end associate
        end do
      end associate
    end do
  end subroutine match_densities

  !> Of the own cut cells with their centre in the fluid the normal of the wall, and how far from it
  !! their fluid and their centre are.
  subroutine find_middles(grid, solid, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(merged_cells_t), intent(inout) :: self
    real(wp) :: middle, y
    integer :: m

    call ensure_capacity(self%n, self%normal)
    call ensure_capacity(self%n, self%middle)
    call ensure_capacity(self%n, self%ratio)
    !$omp parallel do private(middle, y) schedule(dynamic, 64)
    do m = self%n_small + 1, self%n
      associate (c => self%cell(:, m), n => self%normal(:, m))
        self%middle(m) = 0.0_wp
        if (.not. grid%owns(c) .or. solid%alpha(c(1), c(2), c(3)) <= 0.0_wp) cycle
        n = wall_normal(grid, solid, c)
        if (all(abs(n) <= 0.0_wp)) cycle
        middle = distance_to_fluid(grid, solid, c, here, n)
        y = distance_by_links(grid, solid, c, n)
        if (y <= 0.0_wp) y = max(0.0_wp, distance_to_centre(grid, solid, c, n))
        if (middle <= y) cycle
        self%middle(m) = middle
        self%ratio(m) = y/middle
      end associate
    end do
  end subroutine find_middles

  !> Steps from small cell c to its targets, and their shares of it, zero where there is none: cells
  !! across its open faces whose centre lies in the fluid, by open area along the normal; without
  !! any the one of the 26 around it that is most along the normal, or those that are so alike.
  pure subroutine to_targets(grid, solid, c, normal, steps, share)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: c(3)
    real(wp), intent(in) :: normal(3)   !! of the wall
    integer, intent(out) :: steps(3, max_targets)
    real(wp), intent(out) :: share(max_targets)
    real(wp), parameter :: same = 1.0e-9_wp   ! no more than rounding between directions
    integer :: d, f(3), i, j, k, n
    real(wp) :: along, cosine, way(3)

    steps = 0
    share = 0.0_wp
    do d = 1, 3
      steps(:, d) = nint(sign(1.0_wp, normal(d)))*unit_step(:, d)
      f = c + max(steps(:, d), 0)
      if (.not. centre_in_fluid(grid, solid, c + steps(:, d))) cycle
      share(d) = solid%aperture(f(1), f(2), f(3), d)*(grid%area(d)/grid%area(1))*abs(normal(d))
    end do
    if (any(share > 0.0_wp)) then
      share = share/sum(share)
      return
    end if
    along = 0.0_wp
    n = 0
    do k = -1, 1
      do j = -1, 1
        do i = -1, 1
          if (.not. centre_in_fluid(grid, solid, c + [i, j, k])) cycle
          way = real([i, j, k], wp)*(grid%h/grid%h(1))
          cosine = dot_product(normal, way)/norm(way)
          if (cosine <= along*(1.0_wp - same)) cycle
          if (cosine > along*(1.0_wp + same)) n = 0
          n = min(n + 1, max_targets)
          along = cosine
          steps(:, n) = [i, j, k]
        end do
      end do
    end do
    share(:n) = 1.0_wp/real(max(n, 1), wp)
  end subroutine to_targets

  !> The parts of small cells of each target beside an own cell, in the order of their places around
  !! it, so that sums over a group do not depend on the process.
  subroutine group_small_cells(grid, self)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(inout) :: self
    integer :: m, n, f, g, n_parts, moved(2)
    integer :: group(self%n)   ! of each target; first the number of its parts

    group = 0
    do f = 1, self%n_small   ! count the parts of each target
      do n = 1, max_targets
        m = self%target(n, f)
        if (m > 0) group(m) = group(m) + 1
      end do
    end do
    self%n_groups = 0
    n_parts = 0
    do m = self%n_small + 1, self%n
      if (group(m) == 0) cycle
      n = group(m)
      group(m) = 0
      if (any(self%cell(:, m) < grid%lo - 1) .or. any(self%cell(:, m) > grid%hi + 1)) cycle
      self%n_groups = self%n_groups + 1
      group(m) = self%n_groups
      call ensure_capacity(self%n_groups, self%leader)
      call ensure_capacity(self%n_groups + 1, self%first)
      self%leader(self%n_groups) = m
      n_parts = n_parts + n
      self%first(self%n_groups) = n_parts + 1   ! behind the end, until the parts are there
    end do
    self%first(self%n_groups + 1) = n_parts + 1
    call ensure_capacity(n_parts, self%part, rows=2)
    do f = 1, self%n_small
      do n = 1, max_targets
        m = self%target(n, f)
        if (m == 0) cycle
        g = group(m)
        if (g == 0) cycle
        self%first(g) = self%first(g) - 1
        self%part(:, self%first(g)) = [f, n]
      end do
    end do
    !$omp parallel do private(m, n, moved) schedule(static)
    do g = 1, self%n_groups   ! in the order of the small cells' places around the leader
      do m = self%first(g) + 1, self%first(g + 1) - 1
        moved = self%part(:, m)
        do n = m, self%first(g) + 1, -1
          if (place(g, self%part(1, n - 1)) < place(g, moved(1))) exit
          self%part(:, n) = self%part(:, n - 1)
        end do
        self%part(:, n) = moved
      end do
    end do
  contains
    !> Place of a small cell around the leader of group g, as a number.
    pure integer function place(g, small)
      integer, intent(in) :: g, small

      place = dot_product(self%cell(:, small) - self%cell(:, self%leader(g)), [1, 3, 9])
    end function place
  end subroutine group_small_cells

  !> Is this small cell a group of its own?
  elemental logical function is_unmerged(self, small)
    type(merged_cells_t), intent(in) :: self
    integer, intent(in) :: small

    is_unmerged = all(self%target(:, small) == 0)
  end function is_unmerged

  !> Velocity of the wall of a wall cell at its centre [m/s].
  pure function velocity_at_wall(grid, self, m, bodies) result(v)
    type(grid_t), intent(in) :: grid
    type(merged_cells_t), intent(in) :: self
    integer, intent(in) :: m
    type(rigid_motion_t), intent(in) :: bodies
    real(wp) :: v(3)

    v = velocity_in_cell(grid, bodies, self%body(m), self%cell(:, m))
  end function velocity_at_wall

end module merged_cells_m
