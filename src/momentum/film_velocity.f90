!> Velocity of film cells, whose centre lies in a body, from that of the wall and their open faces.
!!
!! A face between a film cell and one whose centre lies in fluid takes its velocity from the latter
!! alone (`face_velocity_at_walls`). Pressure and weight at such faces accelerate the film cell too,
!! but nothing it does is felt by the flow, so no pressure would ever stop it: water at rest would
!! keep films that run for ever. So a component with such a face is tied: it ends every step as the
!! mean of its faces (`tie_films`); what of it is normal to the wall goes linearly from the faces to
!! the wall, so half way. Along the wall the film slips with the cells beside it. The legs of those
!! cells hold all of this shear already (`viscous_legs_m`), so the legs of the film must not hold it
!! a second time: they hold what the step adds to the velocity of its start (`note_films`), pressure
!! and weight that the inertia of the film does not balance.
module film_velocity_m
  use kinds_m, only: wp
  use grid_m, only: grid_t, unit_step
  use boundary_kinds_m, only: gives_pressure
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t, wall_velocity
  use rigid_flux_m, only: nearest_arm
  implicit none
  private
  public :: films_t, films_init, note_films, shift_films, tie_films

  type :: films_t
    integer :: n = 0                    !! film cells with a tied component
    integer, allocatable :: cell(:, :)  !! (3, *)
    real(wp), allocatable :: slip(:, :)
      !! (3, *) velocity of the tied components against the wall at the start of the step [m/s]
  end type films_t

contains

  !> No films yet.
  subroutine films_init(self)
    type(films_t), intent(out) :: self

    allocate (self%cell(3, 0), self%slip(3, 0))
  end subroutine films_init

  !> Note how the films move against their walls at the start of a step.
  subroutine note_films(grid, solid, bodies, u, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! of the cells [m/s]
    type(films_t), intent(inout) :: self
    integer :: b, m, c(3), most
    logical :: ties(3)

    most = solid%body_cell(bodies%n + 1) - 1
    if (size(self%cell, 2) < most) then
      deallocate (self%cell, self%slip)
      allocate (self%cell(3, 2*most), self%slip(3, 2*most))
    end if
    self%n = 0
    do b = 1, bodies%n
      do m = solid%body_cell(b), solid%body_cell(b + 1) - 1
        c = solid%cell(:, m)
        if (.not. is_film(grid, solid, b, c)) cycle
        ties = is_tied(grid, solid, c)
        if (.not. any(ties)) cycle
        self%n = self%n + 1
        self%cell(:, self%n) = c
        self%slip(:, self%n) = merge(u(c(1), c(2), c(3), :) - wall_at(grid, bodies, b, c), 0.0_wp, &
                                     ties)
      end do
    end do
  end subroutine note_films

  !> Add `times` the slip of the start of the step to cells that are films still.
  subroutine shift_films(grid, solid, self, times, u)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(films_t), intent(in) :: self
    real(wp), intent(in) :: times
    real(wp), intent(inout), contiguous :: u(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s]
    integer :: m

    do m = 1, self%n
      associate (c => self%cell(:, m))
        if (solid%inside(c(1), c(2), c(3)) == 0) cycle
        u(c(1), c(2), c(3), :) = u(c(1), c(2), c(3), :) + times*self%slip(:, m)
      end associate
    end do
  end subroutine shift_films

  !> Set the tied components of film cells to the mean of their faces by open share,
  !! with the part normal to the wall half way to the velocity of the wall.
  subroutine tie_films(grid, solid, bodies, mass, uf, u, change)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in), dimension(grid%first(1):, grid%first(2):, grid%first(3):, :), &
      contiguous :: mass, uf     !! over dt, 0: moves with the wall [kg/s]; free of divergence [m/s]
    real(wp), intent(inout), dimension(grid%first(1):, grid%first(2):, grid%first(3):, :), &
      contiguous :: u, change    !! of the cells; what was added to it, else zero [m/s]
    integer :: m, b, d, c(3), n(3)
    real(wp) :: low(3), high(3)   !! open shares
    real(wp) :: v(3)              !! of the film [m/s]
    real(wp) :: area(3)           !! of the wall, a vector into the fluid [m2]

    change = 0.0_wp
    do b = 1, bodies%n
      do m = solid%body_cell(b), solid%body_cell(b + 1) - 1
        c = solid%cell(:, m)
        if (.not. is_film(grid, solid, b, c)) cycle
        v = u(c(1), c(2), c(3), :)
        do d = 1, 3
          n = c + unit_step(:, d)
          low(d) = solid%open(c(1), c(2), c(3), d)
          high(d) = solid%open(n(1), n(2), n(3), d)
          if (low(d) + high(d) > 0.0_wp) v(d) = (low(d)*uf(c(1), c(2), c(3), d) &
            + high(d)*uf(n(1), n(2), n(3), d))/(low(d) + high(d))
        end do
        area = grid%area*(high - low)
        v = v + 0.5_wp*area*dot_product(area, wall_at(grid, bodies, b, c) - v) &
                /max(dot_product(area, area), tiny(1.0_wp))
        associate (film => u(c(1), c(2), c(3), :))
          v = merge(v, film, is_tied(grid, solid, c) .and. mass(c(1), c(2), c(3), :) > 0.0_wp)
          change(c(1), c(2), c(3), :) = v - film
          film = v
        end associate
      end do
    end do
  end subroutine tie_films

  !> Is c an own cell whose centre lies in body b?
  pure function is_film(grid, solid, b, c) result(answer)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: b, c(3)
    logical :: answer

    answer = all(c >= grid%lo .and. c <= grid%hi)
    if (answer) answer = solid%inside(c(1), c(2), c(3)) == b
  end function is_film

  !> Velocity of body b at the centre of cell c [m/s].
  pure function wall_at(grid, bodies, b, c) result(v)
    type(grid_t), intent(in) :: grid
    type(rigid_motion_t), intent(in) :: bodies
    integer, intent(in) :: b, c(3)
    real(wp) :: v(3)

    v = wall_velocity(bodies%motion(:, b), nearest_arm(grid, [grid%centre(c(1), 1), &
      grid%centre(c(2), 2), grid%centre(c(3), 3)], bodies%x(:, b)))
  end function wall_at

  !> Components of film cell c with an open face that takes nothing from them.
  pure function is_tied(grid, solid, c) result(answer)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: c(3)
    logical :: answer(3)
    integer :: d, n(3)

    do d = 1, 3
      n = c + unit_step(:, d)
      answer(d) = solid%open(c(1), c(2), c(3), d) > 0.0_wp
      if (answer(d)) answer(d) = .not. seen(grid, solid, c, c - unit_step(:, d), d)
      if (answer(d)) cycle
      answer(d) = solid%open(n(1), n(2), n(3), d) > 0.0_wp
      if (answer(d)) answer(d) = .not. seen(grid, solid, n, n, d)
    end do
  end function is_tied

  !> Does the velocity of an open face f depend on the film cell on one side of it?
  pure function seen(grid, solid, f, beyond, d) result(answer)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: f(3), beyond(3), d   !! the face, the cell on its other side, direction
    logical :: answer

    if ((beyond(d) < 1 .or. beyond(d) > grid%n(d)) .and. .not. grid%periodic(d)) then
      answer = gives_pressure(grid%side(merge(1, 2, beyond(d) < 1), d))
      return
    end if
    answer = solid%inside(beyond(1), beyond(2), beyond(3)) /= 0 &
             .or. solid%leg_low(f(1), f(2), f(3), d) > 1.0_wp
  end function seen

end module film_velocity_m
