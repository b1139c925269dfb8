!> The six unit motions of each body as volume fluxes through the solid parts of the cell faces.
!!
!! A body pushes the volume `s_f . (U, Omega)` through its part of face f. Summed over the faces of
!! a cell this is J_k, the column of the coupled pressure equation; the same numbers, by summation
!! by parts, turn the pressure into the paper's volume integral of -grad p over the body.
!! Source: Batty, Bertails & Bridson (2007) in the variational form, with exact face areas.
module rigid_flux_m
  use kinds_m, only: wp, i8
  use vectors_m, only: cross
  use grid_m, only: grid_t, unit_step
  use boundary_kinds_m, only: no_side, gives_pressure
  use outflow_m, only: outflow_t, pressure_outside
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t, wall_velocity
  use exact_sum_m, only: accumulator_size, no_terms, exact_add_columns, exact_totals, &
    terms_at_once
  implicit none
  private
  public :: rigid_flux_t, rigid_flux_init, build_rigid_flux, solid_face_flux, all_fluid_of_faces
  public :: force_from_faces, force_from_cells, add_cell_flux, closed_side
  public :: nearest_arm, arm_to_cell, velocity_in_cell, middle_of_face

  integer, parameter :: worth_threads = 1000   !! fewer faces or cells are looked at by one thread

  type :: rigid_flux_t
    !> Faces that body b pushes on: `first_face(b):first_face(b+1)-1`, those that it fills in part,
    !! then from `held_from(b)` those in which it holds fluid.
    integer, allocatable :: first_face(:), held_from(:)
    integer, allocatable :: face(:, :)       !! (4, faces) cell and direction of the lower face
    real(wp), allocatable :: s(:, :)         !! (6, faces) flux of the unit motions [m2, m3]
    logical, allocatable :: mine(:)          !! (faces) this process adds the face to sums
    integer, allocatable :: first(:)
      !! (bodies + 1) entries of each body in the lists below; held bodies have none
    integer, allocatable :: cell(:, :)
      !! (3, *) own cells with open faces that a body pushes on
    real(wp), allocatable :: j(:, :)         !! (*, 6) net unit fluxes out of the cell [m2, m3]
  end type rigid_flux_t

contains

  !> Allocate for `n` bodies.
  subroutine rigid_flux_init(n, self)
    integer, intent(in) :: n
    type(rigid_flux_t), intent(out) :: self

    allocate (self%first(n + 1), source=1)
    allocate (self%first_face(n + 1), self%held_from(n), source=1)
    allocate (self%face(4, 0), self%s(6, 0), self%mine(0), self%cell(3, 0), self%j(0, 6))
  end subroutine rigid_flux_init

  !> Lever arm from a centre of mass, by the nearest periodic image [m].
  pure function nearest_arm(grid, x, centre) result(arm)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: x(3), centre(3)
    real(wp) :: arm(3)

    arm = x - centre
    if (.not. any(grid%periodic)) return
    where (grid%periodic) arm = arm - grid%length*anint(arm/grid%length)
  end function nearest_arm

  !> The same to the centre of cell c.
  pure function arm_to_cell(grid, c, centre) result(arm)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: c(3)
    real(wp), intent(in) :: centre(3)   !! of mass [m]
    real(wp) :: arm(3)

    arm = nearest_arm(grid, [grid%centre(c(1), 1), grid%centre(c(2), 2), grid%centre(c(3), 3)], &
                      centre)
  end function arm_to_cell

  !> Velocity of body b at the centre of cell c [m/s].
  pure function velocity_in_cell(grid, bodies, b, c) result(u)
    type(grid_t), intent(in) :: grid
    type(rigid_motion_t), intent(in) :: bodies
    integer, intent(in) :: b, c(3)
    real(wp) :: u(3)

    u = wall_velocity(bodies%motion(:, b), arm_to_cell(grid, c, bodies%x(:, b)))
  end function velocity_in_cell

  !> Unit fluxes through the faces, and those of free bodies net for the cells that hold fluid.
  subroutine build_rigid_flux(grid, solid, bodies, active, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    logical, intent(in), contiguous :: active(grid%first(1):, grid%first(2):, grid%first(3):)
      !! cell has an open face
    type(rigid_flux_t), intent(inout) :: self
    integer, allocatable :: slot(:, :, :)   ! entry of a cell for the body at hand
    integer :: b, m, n_face, n_entry, entry_of_body, high(3)
    real(wp) :: s(6)

    n_face = solid%body_face(bodies%n + 1) + solid%first_held(bodies%n + 1) - 2
    call reserve(self, n_face)
    do b = 1, bodies%n
      self%first_face(b) = solid%body_face(b) + solid%first_held(b) - 1
      self%held_from(b) = solid%body_face(b + 1) + solid%first_held(b) - 1
    end do
    self%first_face(bodies%n + 1) = n_face + 1
    !$omp parallel private(b) if (n_face > worth_threads)
    do b = 1, bodies%n
      !$omp do schedule(static)
      do m = solid%body_face(b), solid%body_face(b + 1) - 1
        call set_face(m - solid%body_face(b) + self%first_face(b), b, solid%face(:, m), &
                      solid%face_beta(m), solid%face_centroid(:, m))
      end do
      !$omp end do nowait
      !$omp do schedule(static)
      do m = solid%first_held(b), solid%first_held(b + 1) - 1
        call set_face(m - solid%first_held(b) + self%held_from(b), b, solid%held_face(:, m), &
                      solid%held_share(m), middle_of_face(grid, solid%held_face(:, m)))
      end do
      !$omp end do nowait
    end do
    !$omp end parallel
    associate (a => grid%lo, z => grid%hi)
      allocate (slot(a(1):z(1), a(2):z(2), a(3):z(3)), source=0)
    end associate
    n_entry = 0
    do b = 1, bodies%n
      self%first(b) = n_entry + 1
      if (.not. bodies%free(b)) cycle
      do m = self%first_face(b), self%first_face(b + 1) - 1
        high = self%face(1:3, m)
        if (closed_side(grid, high(self%face(4, m)), self%face(4, m))) cycle
        s = self%s(:, m)
        call add_to_cell(high - unit_step(:, self%face(4, m)), s)
        call add_to_cell(high, -s)
      end do
      do entry_of_body = self%first(b), n_entry
        associate (c => self%cell(:, entry_of_body))
          slot(c(1), c(2), c(3)) = 0
        end associate
      end do
    end do
    self%first(bodies%n + 1) = n_entry + 1
  contains
    !> Face n of the list, a share of which moves with body b.
    subroutine set_face(n, b, f, share, x)
      integer, intent(in) :: n, b, f(4)
      real(wp), intent(in) :: share
      real(wp), intent(in) :: x(3)   !! centroid of the share [m]
      integer :: last(3)

      self%face(:, n) = f
      last = grid%hi   ! a face is of the process of the cell above it; the uppermost of that below
      associate (d => f(4))
        if (grid%hi(d) == grid%n(d) .and. .not. grid%periodic(d)) last(d) = last(d) + 1
      end associate
      self%mine(n) = all(f(1:3) >= grid%lo .and. f(1:3) <= last)
      ! Flux of the unit motions of a body through its share of a face, upwards; none through a
      ! closed side of the domain.
      self%s(:, n) = 0.0_wp
      if (closed_side(grid, f(f(4)), f(4))) return
      self%s(1:3, n) = grid%area(f(4))*share*real(unit_step(:, f(4)), wp)
      self%s(4:6, n) = cross(nearest_arm(grid, x, bodies%x(:, b)), self%s(1:3, n))
    end subroutine set_face

    subroutine add_to_cell(c, outflow)
      integer, intent(in) :: c(3)
      real(wp), intent(in) :: outflow(6)
      integer :: e

      if (.not. grid%owns(c)) return
      if (.not. active(c(1), c(2), c(3))) return
      e = slot(c(1), c(2), c(3))
      if (e == 0) then
        n_entry = n_entry + 1
        e = n_entry
        slot(c(1), c(2), c(3)) = e
        self%cell(:, e) = c
        self%j(e, :) = 0.0_wp
      end if
      self%j(e, :) = self%j(e, :) + outflow
    end subroutine add_to_cell
  end subroutine build_rigid_flux

  !> Middle of a lower face [m].
  pure function middle_of_face(grid, f) result(x)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: f(4)   !! cell and direction
    real(wp) :: x(3)
    integer :: d

    x = [(grid%centre(f(d), d), d=1, 3)]
    x(f(4)) = grid%face(f(f(4)), f(4))
  end function middle_of_face

  !> Lists long enough for n_face faces; a face gives at most two cells.
  subroutine reserve(self, n_face)
    type(rigid_flux_t), intent(inout) :: self
    integer, intent(in) :: n_face

    if (size(self%s, 2) >= n_face) return
    deallocate (self%face, self%s, self%mine, self%cell, self%j)
    allocate (self%face(4, 2*n_face), self%s(6, 2*n_face), self%mine(2*n_face))
    allocate (self%cell(3, 4*n_face), self%j(4*n_face, 6))
  end subroutine reserve

  !> A lower face of index i on a side of the domain where no pressure is given: what a body does
  !! there moves no fluid, and nothing pushes from outside.
  pure function closed_side(grid, i, d) result(closed)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: i, d
    logical :: closed
    integer :: side

    side = grid%side_of_face(i, d)
    closed = side /= no_side .and. .not. gives_pressure(side)
  end function closed_side

  !> Volume rate of all bodies through the lower faces [m3/s], with that of the fluid they hold.
  subroutine solid_face_flux(grid, bodies, self, flux, held)
    type(grid_t), intent(in) :: grid
    type(rigid_motion_t), intent(in) :: bodies
    type(rigid_flux_t), intent(in) :: self
    real(wp), intent(inout), contiguous :: flux(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! none on entry but through faces of the list
    logical, intent(in) :: held
    integer :: b, m

    !$omp parallel private(b) if (self%first_face(bodies%n + 1) > worth_threads)
    !$omp do schedule(static)
    do m = 1, self%first_face(bodies%n + 1) - 1
      flux(self%face(1, m), self%face(2, m), self%face(3, m), self%face(4, m)) = 0.0_wp
    end do
    do b = 1, bodies%n
      if (all(abs(bodies%motion(:, b)) <= 0.0_wp)) cycle
      call add_faces(bodies%motion(:, b), self%first_face(b), self%held_from(b) - 1)
      if (held) call add_faces(bodies%motion(:, b), self%held_from(b), self%first_face(b + 1) - 1)
    end do
    !$omp end parallel
  contains
    !> Faces of the list, none of them twice; each thread some of them.
    subroutine add_faces(motion, from, to)
      real(wp), intent(in) :: motion(6)
      integer, intent(in) :: from, to
      integer :: m, f(4)

      !$omp do schedule(static)
      do m = from, to
        f = self%face(:, m)
        flux(f(1), f(2), f(3), f(4)) = flux(f(1), f(2), f(3), f(4)) + &
                                       dot_product(self%s(:, m), motion)
      end do
    end subroutine add_faces
  end subroutine solid_face_flux

  !> Velocity of all the fluid in a face, the held part included, from that of the free part; and
  !! the volume rate of the bodies alone, as the transport has them.
  subroutine all_fluid_of_faces(grid, solid, bodies, self, uf, flux)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    type(rigid_flux_t), intent(in) :: self
    real(wp), intent(inout), contiguous :: uf(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s]
    real(wp), intent(inout), contiguous :: flux(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m3/s]
    integer :: b, m

    call solid_face_flux(grid, bodies, self, flux, held=.false.)
    do b = 1, bodies%n
      do m = self%held_from(b), self%first_face(b + 1) - 1
        associate (i => self%face(1, m), j => self%face(2, m), k => self%face(3, m), &
                   d => self%face(4, m))
          uf(i, j, k, d) = (solid%effective(i, j, k, d)*uf(i, j, k, d) &
            + dot_product(self%s(:, m), bodies%motion(:, b))/grid%area(d)) &
            /solid%aperture(i, j, k, d)
        end associate
      end do
    end do
  end subroutine all_fluid_of_faces

  !> Force and torque of a cell field of pressure on each body, face by face:
  !! $$ F_k = \sum_f s_f (p_{low} - p_{high}) $$
  !! The pressure of cells without open faces counts as it stands. With `sides` that outside an
  !! outflow counts, too; a pressure correction is zero there.
  subroutine force_from_faces(grid, bodies, self, p, force, sides)
    type(grid_t), intent(in) :: grid
    type(rigid_motion_t), intent(in) :: bodies
    type(rigid_flux_t), intent(in) :: self
    real(wp), intent(in), contiguous :: p(grid%first(1):, grid%first(2):, grid%first(3):)
      !! [Pa], halo filled
    real(wp), intent(out) :: force(:, :)
      !! (6, bodies) force, torque about the centre of mass [N, N m]
    type(outflow_t), intent(in), optional :: sides(2, 3)
    integer(i8) :: accumulator(accumulator_size, 6*bodies%n)
    real(wp) :: total(6*bodies%n), term(terms_at_once, 6)
    integer :: b, m, n, from, f(3), e(3)

    accumulator = spread(no_terms, 2, 6*bodies%n)
    !$omp parallel private(b, m, n, f, e, term) if (self%first_face(bodies%n + 1) > worth_threads)
    do b = 1, bodies%n
      !$omp do schedule(dynamic)
      do from = self%first_face(b), self%first_face(b + 1) - 1, terms_at_once
        n = 0
        do m = from, min(from + terms_at_once, self%first_face(b + 1)) - 1
          if (.not. self%mine(m)) cycle
          f = self%face(1:3, m)
          e = unit_step(:, self%face(4, m))
          n = n + 1
          term(n, :) = self%s(:, m)*(side_value(f - e) - side_value(f))
        end do
        call exact_add_columns(term(:n, :), accumulator(:, 6*b - 5:6*b))
      end do
      !$omp end do nowait
    end do
    !$omp end parallel
    call exact_totals(accumulator, total)
    force(:, :bodies%n) = reshape(total, [6, bodies%n])
  contains
    !> Pressure of a cell, or outside the tank; zero outside an open side.
    pure function side_value(c) result(value)
      integer, intent(in) :: c(3)
      real(wp) :: value
      integer :: d

      value = 0.0_wp
      if (all(c >= grid%lo .and. c <= grid%hi) .or. .not. grid%outside(c)) then
        value = p(c(1), c(2), c(3))
      else if (present(sides)) then
        d = findloc(grid%beyond(c, [1, 2, 3]), .true., 1)
        value = pressure_outside(sides(merge(1, 2, c(d) < 1), d), c)
      end if
    end function side_value
  end subroutine force_from_faces

  !> Force and torque of a pressure correction that is zero in cells without open faces.
  subroutine force_from_cells(bodies, self, phi, lower, force)
    type(rigid_motion_t), intent(in) :: bodies
    type(rigid_flux_t), intent(in) :: self
    integer, intent(in) :: lower(3)        !! lower bounds of phi
    real(wp), intent(in), contiguous :: phi(lower(1):, lower(2):, lower(3):)   !! [Pa]
    real(wp), intent(out) :: force(:, :)   !! (6, bodies) [N, N m]
    integer(i8) :: accumulator(accumulator_size, 6*bodies%n)
    real(wp) :: total(6*bodies%n), term(terms_at_once, 6), pressure
    integer :: b, e, n, from

    force = 0.0_wp
    accumulator = spread(no_terms, 2, 6*bodies%n)
    !$omp parallel private(b, e, n, term, pressure) if (self%first(bodies%n + 1) > worth_threads)
    do b = 1, bodies%n
      if (.not. bodies%free(b)) cycle
      !$omp do schedule(dynamic)
      do from = self%first(b), self%first(b + 1) - 1, terms_at_once
        n = min(terms_at_once, self%first(b + 1) - from)
        do e = 1, n
          associate (c => self%cell(:, from + e - 1))
            pressure = phi(c(1), c(2), c(3))
          end associate
          term(e, :) = self%j(from + e - 1, :)*pressure
        end do
        call exact_add_columns(term(:n, :), accumulator(:, 6*b - 5:6*b))
      end do
      !$omp end do nowait
    end do
    !$omp end parallel
    call exact_totals(accumulator, total)
    force(:, :bodies%n) = reshape(total, [6, bodies%n])
  end subroutine force_from_cells

  !> Add the flux of given motions of the free bodies to a cell field: y += sum_k J_k a_k.
  subroutine add_cell_flux(bodies, self, a, lower, y)
    type(rigid_motion_t), intent(in) :: bodies
    type(rigid_flux_t), intent(in) :: self
    real(wp), intent(in) :: a(:, :)         !! (6, bodies) motions
    integer, intent(in) :: lower(3)         !! lower bounds of y
    real(wp), intent(inout), contiguous :: y(lower(1):, lower(2):, lower(3):)
    integer :: b, e

    do b = 1, bodies%n
      if (.not. bodies%free(b)) cycle
      do e = self%first(b), self%first(b + 1) - 1
        associate (c => self%cell(:, e))
          y(c(1), c(2), c(3)) = y(c(1), c(2), c(3)) + dot_product(self%j(e, :), a(:, b))
        end associate
      end do
    end do
  end subroutine add_cell_flux

end module rigid_flux_m
