!> Wall legs of film cells without a master: their centre lies inside a body, their faces are open.
module film_legs_m
  use kinds_m, only: wp
  use growing_m, only: ensure_room
  use grid_m, only: grid_t, unit_step
  use boundary_kinds_m, only: side_no_slip
  use solid_geometry_m, only: solid_geometry_t
  use rigid_motion_m, only: rigid_motion_t
  use rigid_flux_m, only: arm_to_cell
  use viscous_system_m, only: viscous_t, add_wall, add_side
  implicit none
  private
  public :: film_legs

contains

  !> Film cells: centre inside a body, but with open faces. Their fluid, V_o = V(1 - alpha), lies in
  !! layers of mean thickness V_o/A on the walls: A_b of each body there, A_s of no-slip sides of
  !! the domain, A their sum. With N the sum of the areas as vectors, a wall gets the conductance
  !! mu (3 - |N|^2/A^2) A_b A/V_o: exact for shear with a free side on one wall, 2 mu A/(V_o/A), and
  !! for the parabola between two walls face to face, 3 mu A/(V_o/A).
  subroutine film_legs(grid, solid, bodies, mu, self)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in), contiguous :: mu(grid%first(1):, grid%first(2):, grid%first(3):)
    type(viscous_t), intent(inout) :: self
    integer :: b, m, n
    real(wp) :: least   !! smallest sum of the areas that counts [m2]

    if (.not. self%lone_films) return
    if (size(self%films%sum, 2) < solid%n_cut) then
      deallocate (self%films%sum, self%films%body)
      allocate (self%films%sum(7, 2*solid%n_cut), self%films%body(2*solid%n_cut))
    end if
    least = 1.0e-3_wp*minval(grid%area)
    self%films%n = 0
    self%films%sum(:, 1:solid%n_cut) = 0.0_wp
    self%films%body(1:solid%n_cut) = 0
    do b = 1, bodies%n
      call find_areas(b)
    end do
    do n = 1, solid%n_cut
      if (film_number(solid%cut_cell(:, n)) > 0) call hold_by_sides(solid%cut_cell(:, n), n)
    end do
    do m = 1, self%films%n
      associate (c => solid%cut_cell(:, self%films%wall(1, m)), body => self%films%wall(2, m))
        call add_wall(self, c, body, film_conductance(c, self%films%wall(1, m)) &
                      *max(norm2(self%films%area(:, m)), 1.0e-3_wp*least), &
                      arm_to_cell(grid, c, bodies%x(:, body)))
      end associate
    end do
  contains
    !> Number of a cut cell if it is an own film cell whose velocity is an unknown, else 0.
    pure function film_number(c) result(n)
      integer, intent(in) :: c(3)
      integer :: n

      n = 0
      if (any(c < grid%lo) .or. any(c > grid%hi)) return
      if (solid%inside(c(1), c(2), c(3)) == 0) return
      if (self%mass(c(1), c(2), c(3)) > 0.0_wp) n = solid%cut(c(1), c(2), c(3))
    end function film_number

    !> Area of body b in each film cell as a vector, what its shares of the faces lack to close, and
    !! its part of the sums. The cells are found through the faces, since a flat wall in a plane of
    !! the grid has no share of the cell before it; those whose centre is in the body count even
    !! without an area.
    subroutine find_areas(b)
      integer, intent(in) :: b
      integer :: m, d, side, n
      real(wp) :: area

      do m = solid%body_face(b), solid%body_face(b + 1) - 1
        d = solid%face(4, m)
        area = solid%face_beta(m)*grid%area(d)
        do side = 0, 1
          n = film_number(solid%face(1:3, m) - side*unit_step(:, d))
          if (n > 0) self%films%sum(d, n) = self%films%sum(d, n) + merge(area, -area, side == 0)
        end do
      end do
      do m = solid%body_face(b), solid%body_face(b + 1) - 1
        do side = 0, 1
          n = film_number(solid%face(1:3, m) - side*unit_step(:, solid%face(4, m)))
          if (n == 0) cycle
          if (any(abs(self%films%sum(1:3, n)) > 0.0_wp)) call note_wall(b, n)
        end do
      end do
      do m = solid%body_cell(b), solid%body_cell(b + 1) - 1
        associate (c => solid%cell(:, m))
          if (solid%inside(c(1), c(2), c(3)) /= b) cycle
          n = film_number(c)
        end associate
        if (n == 0) cycle
        if (self%films%body(n) /= b) call note_wall(b, n)
      end do
    end subroutine find_areas

    !> Note body b as a wall of film cell n, with its area.
    subroutine note_wall(b, n)
      integer, intent(in) :: b, n

      associate (films => self%films)
        films%n = films%n + 1
        call ensure_room(films%n, films%wall)
        call ensure_room(films%n, films%area)
        films%wall(:, films%n) = [n, b]
        films%area(:, films%n) = films%sum(1:3, n)
        films%sum(4:6, n) = films%sum(4:6, n) + films%sum(1:3, n)
        films%sum(7, n) = films%sum(7, n) + norm2(films%sum(1:3, n))
        films%sum(1:3, n) = 0.0_wp
        films%body(n) = b
      end associate
    end subroutine note_wall

    !> The open parts of no-slip sides are walls too, and hold the film as they hold the cells whose
    !! centre lies in the fluid.
    subroutine hold_by_sides(c, n)
      integer, intent(in) :: c(3), n
      integer :: d, s
      real(wp) :: area(2, 3)

      do d = 1, 3
        area(:, d) = [area_of_side(c, 1, d), area_of_side(c, 2, d)]
        self%films%sum(3 + d, n) = self%films%sum(3 + d, n) + area(1, d) - area(2, d)
        self%films%sum(7, n) = self%films%sum(7, n) + area(1, d) + area(2, d)
      end do
      self%films%sum(7, n) = max(self%films%sum(7, n), least)
      do d = 1, 3
        do s = 1, 2
          if (area(s, d) > 0.0_wp) call add_side(self, c, film_conductance(c, n)*area(s, d), &
                                                 grid%side_velocity(:, s, d))
        end do
      end do
    end subroutine hold_by_sides

    !> Open part of side s of direction d, if cell c lies at it and it is a wall without slip [m2].
    pure function area_of_side(c, s, d) result(area)
      integer, intent(in) :: c(3), s, d
      real(wp) :: area
      integer :: f(3)

      area = 0.0_wp
      if (grid%periodic(d) .or. c(d) /= merge(1, grid%n(d), s == 1)) return
      f = c + merge(0, 1, s == 1)*unit_step(:, d)
      if (grid%side(s, d) == side_no_slip) area = solid%open(f(1), f(2), f(3), d)*grid%area(d)
    end function area_of_side

    !> Conductance of the film of cut cell n per area of a wall [kg/(s m2)].
    pure function film_conductance(c, n) result(conductance)
      integer, intent(in) :: c(3), n
      real(wp) :: conductance, volume

      volume = max(1.0_wp - solid%alpha(c(1), c(2), c(3)), 1.0e-3_wp)*grid%volume
      conductance = mu(c(1), c(2), c(3))*self%films%sum(7, n)/volume &
                    *(3.0_wp - min(1.0_wp, sum((self%films%sum(4:6, n)/self%films%sum(7, n))**2)))
    end function film_conductance
  end subroutine film_legs

end module film_legs_m
