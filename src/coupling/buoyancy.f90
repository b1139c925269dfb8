!> Exact weight of the fluid that each body displaces, and what the faces miss of its mass.
!!
!! The pressure acts on a body through the solid shares of the grid faces, which measure its volume
!! by the trapezoid rule: a submerged block would float by the wrong volume, by some per cent at
!! coarse grids and differently in every pose, and with a body that accelerates the wrong mass of
!! fluid would lie still. The mass and first moment K of the true displaced fluid less that of the
!! faces is therefore found from the tetrahedra, cut by the plane of the liquid where the surface
!! crosses a body; K (a - g) adds to the force of the faces, a being the acceleration of the body.
!! In still water the force is Archimedes' to round-off; a body and the fluid around it that
!! accelerate alike exert nothing on each other but the pressure that does it, on the true volume.
!! The same terms make weight and inertia of the fluid those of its true volume, so they close the
!! momentum of fluid and bodies.
module buoyancy_m
  use kinds_m, only: wp, i8
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
  use exact_sum_m, only: accumulator_size, no_terms, exact_add_columns, exact_totals, &
    terms_at_once
  implicit none
  private
  public :: displaced_force, displaced_fluid, mass_defect, held_mass

contains

  !> Archimedes' force and torque: minus the weight of the fluid in the true place of each body.
  subroutine displaced_force(grid, fluid, solid, bodies, c, force)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
      !! liquid share of the fluid [-]
    real(wp), intent(out) :: force(:, :)   !! (6, bodies), torque about the centre of mass [N, N m]
    real(wp) :: displaced(4, bodies%n)
    integer :: b

    displaced = displaced_fluid(grid, fluid, solid, bodies, c, bodies%present)
    do b = 1, bodies%n
      force(1:3, b) = -displaced(1, b)*fluid%gravity
      force(4:6, b) = -cross(displaced(2:4, b), fluid%gravity)
    end do
  end subroutine displaced_force

  !> Mass and first moment of the true displaced fluid less what the faces count of them.
  !!
  !! Column d belongs to an acceleration along d: to the pressures at the faces, which it makes,
  !! `defect(:, d)` times it is to be added for the force and torque on the true body.
  function mass_defect(grid, fluid, solid, bodies, flux, flow) result(defect)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    type(rigid_flux_t), intent(in) :: flux
    type(flow_t), intent(in) :: flow
    real(wp) :: defect(6, 3, bodies%n)   !! [kg, kg m]
    real(wp) :: displaced(4, bodies%n)
    real(wp) :: counted(4, 3, bodies%n)
    integer :: b, d

    displaced = displaced_fluid(grid, fluid, solid, bodies, flow%c, bodies%present)
    counted = mass_at_faces(grid, bodies, flux, flux%first_face, flow%rho)
    defect = 0.0_wp
    do b = 1, bodies%n
      if (.not. bodies%present(b)) cycle
      do d = 1, 3
        defect(1:3, d, b) = (displaced(1, b) - counted(1, d, b))*unit_step(:, d)
        defect(4:6, d, b) = cross(displaced(2:4, b), real(unit_step(:, d), wp)) &
                            - counted(2:4, d, b)
      end do
    end do
  end function mass_defect

  !> Mass and first moment of the fluid that each body holds at its faces, as `mass_defect`.
  function held_mass(grid, bodies, flux, rho) result(held)
    type(grid_t), intent(in) :: grid
    type(rigid_motion_t), intent(in) :: bodies
    type(rigid_flux_t), intent(in) :: flux
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! [kg/m3]
    real(wp) :: held(6, 3, bodies%n)   !! [kg, kg m]
    real(wp) :: counted(4, 3, bodies%n)
    integer :: d

    counted = mass_at_faces(grid, bodies, flux, flux%held_from, rho)
    held = 0.0_wp
    do d = 1, 3
      held(d, d, :) = counted(1, d, :)
      held(4:6, d, :) = counted(2:4, d, :)
    end do
  end function held_mass

  !> Mass and first moment, about the centre of mass of the body, of the fluid in the true place of
  !! each body asked for.
  function displaced_fluid(grid, fluid, solid, bodies, c, wanted) result(displaced)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
      !! liquid share of the fluid [-]
    logical, intent(in) :: wanted(:)   !! (bodies)
    real(wp) :: displaced(4, bodies%n)   !! [kg, kg m]
    integer(i8) :: accumulator(accumulator_size, 4*bodies%n)
    real(wp) :: term(terms_at_once, 4), total(4*bodies%n)
    integer :: b, m, n, from, i(3)

    accumulator = spread(no_terms, 2, 4*bodies%n)
    !$omp parallel private(b, m, n, i, term)
    do b = 1, bodies%n
      if (.not. wanted(b)) cycle
      !$omp do schedule(dynamic, 1)
      do from = solid%body_cell(b), solid%body_cell(b + 1) - 1, terms_at_once
        n = 0
        do m = from, min(from + terms_at_once, solid%body_cell(b + 1)) - 1
          i = solid%cell(:, m)
          if (any(i < grid%lo) .or. any(i > grid%hi)) cycle
          n = n + 1
          term(n, :) = fluid_in_cell(grid, fluid, solid, bodies%x(:, b), c, m)
        end do
        call exact_add_columns(term(:n, :), accumulator(:, 4*b - 3:4*b))
      end do
      !$omp end do nowait
    end do
    !$omp end parallel
    call exact_totals(accumulator, total)
    displaced = reshape(total, shape(displaced))
  end function displaced_fluid

  !> Mass and first moment about x of the fluid in entry m of the cells by body.
  pure function fluid_in_cell(grid, fluid, solid, x, c, m) result(total)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(solid_geometry_t), intent(in) :: solid
    real(wp), intent(in) :: x(3)   !! centre of mass of the body [m]
    real(wp), intent(in), contiguous :: c(grid%first(1):, grid%first(2):, grid%first(3):)
    integer, intent(in) :: m
    real(wp) :: total(4)           !! [kg, kg m]
    real(wp) :: liquid, liquid_moment(3), volume, arm(3), share
    integer :: i(3)

    i = solid%cell(:, m)
    share = c(i(1), i(2), i(3))
    volume = solid%cell_alpha(m)*grid%volume
    arm = nearest_arm(grid, solid%cell_centroid(:, m), x)
    if (share > pure_share .and. share < 1.0_wp - pure_share) then
      call liquid_part(grid, solid, surface_normal(grid, solid, vertical_of(fluid%gravity), &
                                                   c, i(1), i(2), i(3)), &
                       share, m, liquid, liquid_moment)
      liquid_moment = liquid_moment - liquid*(solid%cell_centroid(:, m) - arm)   ! about x
    else
      liquid = share*volume
      liquid_moment = liquid*arm
    end if
    associate (gas => fluid%gas_density, more => fluid%liquid_density - fluid%gas_density)
      total(1) = gas*volume + more*liquid
      total(2:4) = gas*volume*arm + more*liquid_moment
    end associate
  end function fluid_in_cell

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

  !> What the faces from `first_face` on count of the fluid in the place of each body present, rho_f
  !! h times the flux of the unit motions: for an acceleration along each direction mass and torque.
  function mass_at_faces(grid, bodies, flux, first_face, rho) result(counted)
    type(grid_t), intent(in) :: grid
    type(rigid_motion_t), intent(in) :: bodies
    type(rigid_flux_t), intent(in) :: flux
    integer, intent(in) :: first_face(:)   !! (bodies) in `flux`
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp) :: counted(4, 3, bodies%n)   !! [kg, kg m]
    integer(i8) :: accumulator(accumulator_size, 12*bodies%n)
    real(wp) :: term(terms_at_once, 4), total(12*bodies%n)
    integer :: b, d, m, n, from, row

    accumulator = spread(no_terms, 2, 12*bodies%n)
    !$omp parallel private(b, d, m, n, row, term)
    do b = 1, bodies%n
      if (.not. bodies%present(b)) cycle
      !$omp do schedule(dynamic)
      do from = first_face(b), flux%first_face(b + 1) - 1, terms_at_once
        do d = 1, 3
          n = 0
          do m = from, min(from + terms_at_once, flux%first_face(b + 1)) - 1
            if (flux%face(4, m) /= d .or. .not. flux%mine(m)) cycle
            n = n + 1
            term(n, :) = mass_between(grid, rho, flux%face(1:3, m), d)*flux%s([d, 4, 5, 6], m)
          end do
          row = 12*(b - 1) + 4*(d - 1)
          call exact_add_columns(term(:n, :), accumulator(:, row + 1:row + 4))
        end do
      end do
      !$omp end do nowait
    end do
    !$omp end parallel
    call exact_totals(accumulator, total)
    counted = reshape(total, shape(counted))
  end function mass_at_faces

  !> rho_f h at the lower face of cell f: mass per area between two pressures [kg/m2].
  pure function mass_between(grid, rho, f, d) result(column)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
    integer, intent(in) :: f(3), d
    real(wp) :: column
    integer :: low(3)

    low = f - unit_step(:, d)
    if (low(d) == 0 .and. gives_pressure(grid%side(1, d))) then
      column = 0.5_wp*rho(f(1), f(2), f(3))*grid%h(d)
    else if (f(d) == grid%n(d) + 1 .and. gives_pressure(grid%side(2, d))) then
      column = 0.5_wp*rho(low(1), low(2), low(3))*grid%h(d)
    else
      column = face_mean(rho(low(1), low(2), low(3)), rho(f(1), f(2), f(3)))*grid%h(d)
    end if
  end function mass_between

end module buoyancy_m
