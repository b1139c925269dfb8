!> How a block will fall, before anything is computed: heights, depth, speeds.
!!
!! In air it falls freely, v**2 = v_0**2 + 2 g h. Under water, after the distance z, its speed is an
!! estimate: weight, buoyancy and a drag coefficient C on the mean projected area A, with the added
!! mass of a sphere,
!!
!! $$ v^2 = v_t^2 + (v_0^2 - v_t^2) \, e^{-2 z / L}, \qquad
!!    L = \frac{2 (\rho_s + \rho / 2) V}{\rho C A}, \qquad
!!    v_t^2 = \frac{2 (\rho_s - \rho) V g}{\rho C A} . $$
!!
!! C = 0.42 * 10**(0.4 (-log10 f)**0.2) with the sphericity f: A. Hoelzer, M. Sommerfeld (2008),
!! Powder Technology 184, 361, for high Reynolds numbers. Resolved falls of armour units are within
!! 20 % of it in drag (verification/cases/settling_units).
module fall_m
  use kinds_m, only: wp, pi
  use vectors_m, only: rotation_matrix, cross
  use case_types_m, only: case_t, place_t, is_given, has_flow
  use boundary_kinds_m, only: side_code, is_wall
  use tet_mesh_m, only: shape_t, extent_along
  use mass_properties_m, only: surface_area
  use bed_m, only: bed_t
  use bed_measure_m, only: bed_height
  implicit none
  private
  public :: fall_t, find_fall, gravity_down, has_level
  public :: projected_area, drag_coefficient, terminal_speed, fall_under_water

  !> The fall of a block.
  type :: fall_t
    real(wp) :: bottom = 0.0_wp           !! height of its lowest point at the start [m]
    logical :: has_floor = .false.
    real(wp) :: floor = 0.0_wp            !! height of the ground below it [m]
    logical :: has_water = .false.
    real(wp) :: level = 0.0_wp            !! of the water [m]
    real(wp) :: at_surface = -1.0_wp      !! speed there; -1: it starts in the water [m/s]
    real(wp) :: at_floor = -1.0_wp        !! speed there; -1: it does not get there [m/s]
    real(wp) :: terminal = -1.0_wp        !! speed of a long fall in water; -1: no water [m/s]
    real(wp) :: drag = 0.0_wp             !! its coefficient, on the mean projected area [-]
  end type fall_t

contains

  !> Gravity if it points straight down, else zero [m/s2].
  pure function gravity_down(gravity) result(g)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp) :: g

    g = 0.0_wp
    if (.not. any(abs(gravity(1:2)) > 0.0_wp)) g = max(0.0_wp, -gravity(3))
  end function gravity_down

  !> Does the case begin with a level of the liquid, or full of it?
  pure function has_level(case) result(yes)
    type(case_t), intent(in) :: case
    logical :: yes

    yes = case%run%physics == 'light'
    if (has_flow(case%run)) yes = len_trim(case%fluid%initial_state) == 0 &
      .and. (case%fluid%single_phase .or. is_given(case%fluid%water_level))
  end function has_level

  !> What to expect of a block that is let go.
  subroutine find_fall(case, place, shape, bed, fall)
    type(case_t), intent(in) :: case
    type(place_t), intent(in) :: place
    type(shape_t), intent(in) :: shape
    type(bed_t), intent(in) :: bed
    type(fall_t), intent(out) :: fall
    real(wp) :: turn(3, 3), g, speed, ground, top, drag_area

    turn = rotation_matrix(place%q)
    fall%bottom = place%x(3) - extent_along(shape, -turn(3, :))
    fall%has_floor = bed%there .or. is_wall(side_code(case%boundary%kind(1, 3)))
    fall%floor = bed_height(bed, place%x, case%grid%origin(3))
    ground = merge(fall%floor, -huge(ground), fall%has_floor)
    top = case%grid%origin(3) + case%grid%length(3)
    if (has_level(case)) then
      fall%level = top
      if (.not. case%fluid%single_phase) fall%level = min(top, case%fluid%water_level)
      fall%has_water = fall%level > max(ground, case%grid%origin(3))
    end if
    g = gravity_down(case%fluid%gravity)
    if (g <= 0.0_wp) return
    speed = -place%v(3)
    if (fall%has_water) then
      if (fall%bottom > fall%level) then
        speed = speed_after(speed, g, fall%bottom - fall%level)
        fall%at_surface = speed
      end if
      call find_drag(case, shape, fall%drag, drag_area)
      if (shape%density <= case%fluid%liquid_density) return
      associate (s => shape%density/case%fluid%liquid_density)
        fall%terminal = terminal_speed(s, shape%volume, drag_area, g)
        if (fall%has_floor) fall%at_floor = fall_under_water(s, shape%volume, drag_area, g, &
          max(0.0_wp, speed), max(0.0_wp, min(fall%bottom, fall%level) - fall%floor))
      end associate
    else if (fall%has_floor .and. (.not. has_flow(case%run) .or. has_level(case))) then
      fall%at_floor = speed_after(speed, g, max(0.0_wp, fall%bottom - fall%floor))
    end if
  end subroutine find_fall

  !> Drag coefficient of a shape, and that times the area to which it belongs: its mean shadow, in
  !! 'light' a third of its surface.
  subroutine find_drag(case, shape, drag, drag_area)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shape
    real(wp), intent(out) :: drag        !! [-]
    real(wp), intent(out) :: drag_area   !! [m2]

    if (case%run%physics == 'light') then
      drag = sum(case%shape%drag_coefficient, case%shape%name == shape%name)
      drag_area = drag*surface_area(shape%point, shape%triangle)/3.0_wp
    else
      drag = drag_coefficient(shape)
      drag_area = drag*projected_area(shape)
    end if
  end subroutine find_drag

  !> Speed after a free fall [m/s].
  elemental function speed_after(speed, g, height) result(v)
    real(wp), intent(in) :: speed    !! downward at the start [m/s]
    real(wp), intent(in) :: g        !! > 0 [m/s2]
    real(wp), intent(in) :: height   !! >= 0 [m]
    real(wp) :: v

    v = sqrt(speed**2 + 2*g*height)
  end function speed_after

  !> Area of the shadow of a shape, the mean over thirteen directions [m2].
  function projected_area(shape) result(area)
    type(shape_t), intent(in) :: shape
    real(wp) :: area
    integer, parameter :: directions(3, 13) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 0, 1, -1, &
      0, 1, 0, 1, 1, 0, -1, 0, 1, 1, 0, 1, -1, 1, 1, 1, 1, 1, -1, 1, -1, 1, 1, -1, -1], [3, 13])
    integer :: d

    if (shape%kind == 'sphere') then
      area = pi*shape%sphere_radius(1)**2
      return
    end if
    area = 0.0_wp
    do d = 1, size(directions, 2)
      area = area + shadow(shape, real(directions(:, d), wp))/real(size(directions, 2), wp)
    end do
  end function projected_area

  !> Area of the shadow of a shape along a direction, on a fine raster [m2].
  function shadow(shape, direction) result(area)
    type(shape_t), intent(in) :: shape
    real(wp), intent(in) :: direction(3)
    real(wp) :: area
    integer, parameter :: n = 128   ! points of the raster across the shape
    logical, allocatable :: dark(:, :)
    real(wp) :: u(3), v(3), p(2, 3), step, low(2), side(3), at(2)
    integer :: t, i, j, c, from(2), to(2)

    u = cross(direction, cshift([1.0_wp, 0.0_wp, 0.0_wp], -maxloc(abs(direction), 1)))
    u = u/norm2(u)
    v = cross(direction/norm2(direction), u)
    low = -shape%radius
    step = 2*shape%radius/n
    allocate (dark(n, n), source=.false.)
    do t = 1, size(shape%triangle, 2)
      do c = 1, 3
        p(:, c) = [dot_product(u, shape%point(:, shape%triangle(c, t))), &
                   dot_product(v, shape%point(:, shape%triangle(c, t)))]
      end do
      from = max(1, ceiling((minval(p, 2) - low)/step + 0.5_wp))
      to = min(n, floor((maxval(p, 2) - low)/step + 0.5_wp))
      do j = from(2), to(2)
        do i = from(1), to(1)
          at = low + (real([i, j], wp) - 0.5_wp)*step
          do c = 1, 3
            associate (a => p(:, c), b => p(:, 1 + mod(c, 3)))
              side(c) = (b(1) - a(1))*(at(2) - a(2)) - (b(2) - a(2))*(at(1) - a(1))
            end associate
          end do
          if (all(side >= 0.0_wp) .or. all(side <= 0.0_wp)) dark(i, j) = .true.
        end do
      end do
    end do
    area = count(dark)*step**2
  end function shadow

  !> Drag coefficient of a shape on its mean projected area, at high Reynolds numbers [-]. Source:
  !! Hoelzer and Sommerfeld (2008), see above.
  pure function drag_coefficient(shape) result(drag)
    type(shape_t), intent(in) :: shape
    real(wp) :: drag
    real(wp) :: sphericity

    drag = 0.42_wp
    if (shape%kind == 'sphere') return
    sphericity = min(1.0_wp, (pi*(6*shape%volume)**2)**(1.0_wp/3.0_wp) &
      /surface_area(shape%point, shape%triangle))
    drag = drag*10.0_wp**(0.4_wp*max(0.0_wp, -log10(sphericity))**0.2_wp)
  end function drag_coefficient

  !> Speed at which weight, buoyancy and drag are in balance [m/s], see above.
  elemental function terminal_speed(s, volume, drag_area, g) result(speed)
    real(wp), intent(in) :: s           !! density over that of the liquid, above 1 [-]
    real(wp), intent(in) :: volume      !! [m3]
    real(wp), intent(in) :: drag_area   !! drag coefficient times area [m2]
    real(wp), intent(in) :: g           !! [m/s2]
    real(wp) :: speed

    speed = sqrt(2*(s - 1.0_wp)*volume*g/drag_area)
  end function terminal_speed

  !> Speed after a way down through still liquid [m/s], see above.
  elemental function fall_under_water(s, volume, drag_area, g, start, way) result(speed)
    real(wp), intent(in) :: s, volume, drag_area, g   !! as for `terminal_speed`
    real(wp), intent(in) :: start                     !! speed downward at the start [m/s]
    real(wp), intent(in) :: way                       !! [m]
    real(wp) :: speed
    real(wp), parameter :: added_mass = 0.5_wp   ! of a sphere [-]
    real(wp) :: length, terminal

    length = 2*(s + added_mass)*volume/drag_area
    terminal = terminal_speed(s, volume, drag_area, g)
    speed = sqrt(terminal**2 + (start**2 - terminal**2)*exp(-2*way/length))
  end function fall_under_water

end module fall_m
