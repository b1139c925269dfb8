!> Exact weight of the fluid that each body displaces, and what the faces miss of its mass.
!!
!! The pressure acts on a body through the solid shares of the grid faces, which measure its volume
!! by the trapezoid rule: a submerged block would float by the wrong volume, by some per cent at
!! coarse grids and differently in every pose, and with a body that accelerates the wrong mass of
!! fluid would lie still. The mass and first moment K of the true displaced fluid less that of the
!! faces is therefore found from the tetrahedra, cut by the plane of the liquid where the surface
!! crosses a body; K (a - g) adds to the force of the faces, a being the acceleration of the body.
!! In still water the force is Archimedes' to round-off; a body and the fluid around it that
!! accelerate alike feel nothing of each other but the pressure that does it, on the true volume.
!! The same terms make weight and inertia of the fluid those of its true volume, so they close the
!! momentum of fluid and bodies.
module buoyancy_m
  use kinds_m, only: wp
  use growing_m, only: ensure_rows
  use vectors_m, only: cross
  use case_types_m, only: fluid_t
  use grid_m, only: grid_t, unit_step
  use boundary_kinds_m, only: gives_pressure
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t
  use rigid_flux_m, only: rigid_flux_t, nearest_arm
  use mixture_m, only: face_mean, pure_share
  use plic_m, only: unit_constant
  use fields_m, only: flow_t
  use surface_normal_m, only: surface_normal, vertical_of
  use polyhedron_m, only: polyhedron_t, polyhedron_of_box, polyhedron_moments_below, &
                          box_clip_moments_below
  use exact_sum_m, only: exact_sums
  implicit none
  private
  public :: buoyancy_t, displaced_t, buoyancy_init
  public :: displaced_force, displaced_fluid, uncounted_fluid

  type :: buoyancy_t
    real(wp), allocatable :: work(:, :)   !! (*, 12) terms of the sums
  end type buoyancy_t

  !> Fluid in the true place of a body.
  type :: displaced_t
    real(wp) :: mass = 0.0_wp        !! [kg]
    real(wp) :: moment(3) = 0.0_wp   !! first moment about the centre of mass of the body [kg m]
  end type displaced_t

contains

  !> Allocate; the work array grows when a body covers more cells than any before.
  subroutine buoyancy_init(self)
    type(buoyancy_t), intent(out) :: self

    allocate (self%work(0, 12))
  end subroutine buoyancy_init

  !> Archimedes' force and torque: minus the weight of the fluid in the true place of each body.
  subroutine displaced_force(grid, fluid, solid, bodies, c, self, force)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
      !! liquid share of the fluid [-]
    type(buoyancy_t), intent(inout) :: self
    real(wp), intent(out) :: force(:, :)   !! (6, bodies), torque about the centre of mass [N, N m]
    type(displaced_t) :: displaced
    integer :: b

    force = 0.0_wp
    do b = 1, bodies%n
      if (.not. bodies%present(b)) cycle
      displaced = displaced_fluid(grid, fluid, solid, bodies, c, b, self)
      force(1:3, b) = -displaced%mass*fluid%gravity
      force(4:6, b) = -cross(displaced%moment, fluid%gravity)
    end do
  end subroutine displaced_force

  !> Mass and first moment of the true displaced fluid less what the faces count of them.
  !!
  !! Column d belongs to an acceleration along d: to the pressures at the faces, which it makes,
  !! `lack(:, d)` times it is to be added for the force and torque on the true body.
  function uncounted_fluid(grid, fluid, solid, bodies, flux, flow, self) result(lack)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    type(rigid_flux_t), intent(in) :: flux
    type(flow_t), intent(in) :: flow
    type(buoyancy_t), intent(inout) :: self
    real(wp) :: lack(6, 3, bodies%n)   !! [kg, kg m]
    type(displaced_t) :: displaced
    real(wp) :: counted(12)
    integer :: b, d, n

    lack = 0.0_wp
    do b = 1, bodies%n
      if (.not. bodies%present(b)) cycle
      displaced = displaced_fluid(grid, fluid, solid, bodies, flow%c, b, self)
      call ensure_rows(solid%body_face(b + 1) - solid%body_face(b), self%work)
      n = mass_at_faces(grid, solid, flux, flow%rho, b, self%work)
      counted = exact_sums(self%work(1:n, :))
      do d = 1, 3
        lack(1:3, d, b) = (displaced%mass - counted(d))*unit_step(:, d)
        lack(4:6, d, b) = cross(displaced%moment, real(unit_step(:, d), wp)) &
                          - counted(3*d + 1:3*d + 3)
      end do
    end do
  end function uncounted_fluid

  !> Fluid in the true place of body b.
  function displaced_fluid(grid, fluid, solid, bodies, c, b, self) result(displaced)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
      !! liquid share of the fluid [-]
    integer, intent(in) :: b
    type(buoyancy_t), intent(inout) :: self
    type(displaced_t) :: displaced
    real(wp) :: liquid, liquid_moment(3), share, total(4)
    integer :: m, n, i(3)

    call ensure_rows(solid%body_cell(b + 1) - solid%body_cell(b), self%work)
    n = 0
    do m = solid%body_cell(b), solid%body_cell(b + 1) - 1
      i = solid%cell(:, m)
      if (any(i < grid%lo) .or. any(i > grid%hi)) cycle
      share = c(i(1), i(2), i(3))
      n = n + 1
      associate (volume => solid%cell_alpha(m)*grid%volume, &
                 arm => nearest_arm(grid, solid%cell_centroid(:, m), bodies%x(:, b)), &
                 gas => fluid%gas_density, more => fluid%liquid_density - fluid%gas_density)
        if (share > pure_share .and. share < 1.0_wp - pure_share) then
          call liquid_part(grid, solid, surface_normal(grid, solid, vertical_of(fluid%gravity), &
                                                       c, i(1), i(2), i(3)), &
                           share, m, liquid, liquid_moment)
          liquid_moment = liquid_moment - liquid*(solid%cell_centroid(:, m) - arm)   ! about x
        else
          liquid = share*volume
          liquid_moment = liquid*arm
        end if
        self%work(n, 1) = gas*volume + more*liquid
        self%work(n, 2:4) = gas*volume*arm + more*liquid_moment
      end associate
    end do
    total = exact_sums(self%work(1:n, 1:4))
    displaced = displaced_t(total(1), total(2:4))
  end function displaced_fluid

  !> Volume and first moment in space of what lies below the liquid plane in entry m of the cells by
  !! body: of the tetrahedra that reach into a cut cell, of the whole cell where the body fills it.
  pure subroutine liquid_part(grid, solid, normal_of_cube, share, m, volume, moment)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: normal_of_cube(3)  !! of the surface, on the unit cube
    real(wp), intent(in) :: share              !! liquid share of the full cell [-]
    integer, intent(in) :: m
    real(wp), intent(out) :: volume, moment(3) !! [m3, m4]
    real(wp) :: lower(3), upper(3), normal(3), d, part, part_moment(3)
    type(polyhedron_t) :: cell
    integer :: a, n

    lower = [(grid%face(solid%cell(a, m), a), a=1, 3)]
    upper = lower + grid%h
    normal = normal_of_cube/grid%h
    d = unit_constant(normal_of_cube, share) + dot_product(normal, lower)
    volume = 0.0_wp
    moment = 0.0_wp
    do n = solid%tets%of_cell(1, m), solid%tets%of_cell(2, m)
      call box_clip_moments_below(solid%tets%corner(:, :, solid%tets%list(n)), lower, upper, &
                                  normal, d, part, part_moment)
      volume = volume + part
      moment = moment + part_moment
    end do
    if (solid%tets%of_cell(2, m) < solid%tets%of_cell(1, m)) then
      call polyhedron_of_box(lower, upper, cell)
      call polyhedron_moments_below(cell, normal, d, volume, moment)
      volume = volume*solid%cell_alpha(m)   ! less than one where bodies share a full cell
      moment = moment*solid%cell_alpha(m)
    end if
  end subroutine liquid_part

  !> What the faces count of the fluid in the place of body b, rho_f h times the flux of the unit
  !! motions: masses along x, y, z, then the torque of a unit acceleration along each.
  function mass_at_faces(grid, solid, flux, rho, b, term) result(n)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_flux_t), intent(in) :: flux
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
    integer, intent(in) :: b
    real(wp), intent(inout) :: term(:, :)
    integer :: n
    integer :: m, d, f(3), low(3)
    real(wp) :: column   !! rho_f h: mass per area between two pressures [kg/m2]

    n = 0
    do m = solid%body_face(b), solid%body_face(b + 1) - 1
      d = solid%face(4, m)
      f = solid%face(1:3, m)
      if (.not. flux%mine(m)) cycle
      low = f - unit_step(:, d)
      if (low(d) == 0 .and. gives_pressure(grid%side(1, d))) then
        column = 0.5_wp*rho(f(1), f(2), f(3))*grid%h(d)
      else if (f(d) == grid%n(d) + 1 .and. gives_pressure(grid%side(2, d))) then
        column = 0.5_wp*rho(low(1), low(2), low(3))*grid%h(d)
      else
        column = face_mean(rho(low(1), low(2), low(3)), rho(f(1), f(2), f(3)))*grid%h(d)
      end if
      n = n + 1
      term(n, :) = 0.0_wp
      term(n, d) = column*flux%s(d, m)
      term(n, 3*d + 1:3*d + 3) = column*flux%s(4:6, m)
    end do
  end function mass_at_faces

end module buoyancy_m
