!> Curvature from heights and its force at the faces, against surfaces of known curvature.
! ranks: 2 3
module test_surface_tension_m
  use check_m, only: check, wp
  use case_types_m, only: fluid_t
  use grid_m, only: grid_t, unit_step
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use boundary_m, only: fill_scalar_halo
  use parallel_m, only: global_max
  use rigid_flux_m, only: rigid_flux_t, rigid_flux_init, build_rigid_flux, force_from_faces
  use surface_tension_m, only: surface_tension_t, surface_tension_init, find_tension, add_tension, &
                               force_from_tension
  use wave_step_m, only: gravity_step, capillary_step, viscous_step
  use box_solid_m, only: simple_grid, set_boxes
  use one_body_m, only: one_body_t, place, sides
  implicit none
  private
  public :: test_surface_tension

  real(wp), parameter :: length(3) = [1.2_wp, 0.9_wp, 1.0_wp]   !! cells that are no cubes [m]
  integer, parameter :: cells(3) = [16, 14, 18]
  type(grid_t) :: grid
  type(solid_geometry_t) :: solid
  real(wp), allocatable :: c(:, :, :)
  real(wp) :: bow(6)       !! z = bow(1) + bow(2) x + bow(3) y + bow(4) x2 + bow(5) y2 + bow(6) x y
  type(fluid_t) :: fluid
  type(surface_tension_t) :: tension
  real(wp) :: worst, cases   !! of the last look

contains

  subroutine test_surface_tension()
    fluid%surface_tension = 0.07_wp
    fluid%gravity = 0.0_wp
    call known_curvature(3, 1)
    call known_curvature(3, -1)
    call known_curvature(1, 1)
    call known_curvature(2, -1)
    call small_on_the_floor()
    call curvature_beyond_heights()
    call two_basins()
    call balance_at_faces()
    call weight_of_level_liquid()
    call longest_step()
    call pull_on_a_body()
  end subroutine test_surface_tension

  subroutine start(n)
    integer, intent(in) :: n(3)

    call simple_grid(n, length, grid)
    call solid_geometry_init(grid, solid)
    if (allocated(c)) deallocate (c)
    allocate (c, source=solid%alpha)
  end subroutine start

  !> Fill the side below the bowed surface along direction d, seen from the middle of the tank; with
  !! way = -1 the liquid lies on the upper side. Two Gauss points per direction make the sums over
  !! columns exact.
  subroutine fill_bowed(d, way)
    integer, intent(in) :: d, way
    real(wp), parameter :: point(2) = [-1.0_wp, 1.0_wp]/sqrt(3.0_wp)
    integer :: i, j, k, a, b, x, y, at(3)
    real(wp) :: p, q, z, bottom

    x = modulo(d, 3) + 1
    y = modulo(d + 1, 3) + 1
    do concurrent (k=grid%lo(3):grid%hi(3), j=grid%lo(2):grid%hi(2), i=grid%lo(1):grid%hi(1))
      at = [i, j, k]
      c(i, j, k) = 0.0_wp
      do b = 1, 2
        do a = 1, 2
          p = grid%centre(at(x), x) - 0.5_wp*length(x) + 0.5_wp*grid%h(x)*point(a)
          q = grid%centre(at(y), y) - 0.5_wp*length(y) + 0.5_wp*grid%h(y)*point(b)
          z = bow(1) + bow(2)*p + bow(3)*q + bow(4)*p**2 + bow(5)*q**2 + bow(6)*p*q
          bottom = grid%face(at(d), d) - 0.5_wp*length(d)
          c(i, j, k) = c(i, j, k) + 0.25_wp*min(max((z - bottom)/grid%h(d), 0.0_wp), 1.0_wp)
        end do
      end do
      if (way < 0) c(i, j, k) = 1.0_wp - c(i, j, k)
    end do
    call fill_scalar_halo(grid, c)
  end subroutine fill_bowed

  !> Exact curvature of the bowed surface over the centre of a cell.
  pure real(wp) function exact_curvature(at, d, way)
    integer, intent(in) :: at(3), d, way
    real(wp) :: p, q, zx, zy
    integer :: x, y

    x = modulo(d, 3) + 1
    y = modulo(d + 1, 3) + 1
    p = grid%centre(at(x), x) - 0.5_wp*length(x)
    q = grid%centre(at(y), y) - 0.5_wp*length(y)
    zx = bow(2) + 2.0_wp*bow(4)*p + bow(6)*q
    zy = bow(3) + 2.0_wp*bow(5)*q + bow(6)*p
    exact_curvature = -real(way, wp)*(2.0_wp*bow(4)*(1.0_wp + zy**2) + 2.0_wp*bow(5) &
      *(1.0_wp + zx**2) - 2.0_wp*zx*zy*bow(6))/(1.0_wp + zx**2 + zy**2)**1.5_wp
  end function exact_curvature

  !> Find the tension; largest error of the curvature away from the sides, and whether there is any.
  subroutine find_error(d, way)
    integer, intent(in) :: d, way
    integer :: i, j, k
    real(wp) :: both(2)

    call find_tension(grid, fluid, solid, c, tension)
    both = 0.0_wp
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          if (c(i, j, k) <= 1.0e-6_wp .or. c(i, j, k) >= 1.0_wp - 1.0e-6_wp) cycle
          if (any(([i, j, k] <= 1 .or. [i, j, k] >= grid%n) .and. unit_step(:, d) == 0)) cycle
          both = max(both, [abs(tension%surface%curvature(i, j, k) &
                                - exact_curvature([i, j, k], d, way)), 1.0_wp])
        end do
      end do
    end do
    call global_max(both)
    worst = both(1)
    cases = both(2)
  end subroutine find_error

  !> Heights of a parabola are exact: so is the curvature, along every axis and on either side.
  subroutine known_curvature(d, way)
    integer, intent(in) :: d, way

    call start(cells)
    bow = [0.013_wp, 0.21_wp, -0.13_wp, 0.31_wp, -0.23_wp, 0.17_wp]
    call fill_bowed(d, way)
    call ready(fluid)
    call find_error(d, way)
    call check('there is a surface', cases > 0.0_wp)
    call check('curvature of a parabola [1/m]', worst, 0.0_wp, 1.0e-11_wp)
    call check('all of it from heights', tension%surface%fallback, 0)
    bow(2:3) = [0.45_wp, -0.35_wp]   ! the surface of the next column may lie two cells higher
    bow(4:6) = 0.1_wp*bow(4:6)
    call fill_bowed(d, way)
    call find_error(d, way)
    call check('curvature of a steep parabola [1/m]', worst, 0.0_wp, 1.0e-11_wp)
    bow(4:6) = 0.0_wp
    call fill_bowed(d, way)
    call find_error(d, way)
    call check('a plane has none [1/m]', worst, 0.0_wp, 1.0e-11_wp)
  end subroutine known_curvature

  !> What a force needs, its work arrays, too.
  subroutine ready(liquid)
    type(fluid_t), intent(in) :: liquid
    type(surface_tension_t) :: fresh

    tension = fresh
    call surface_tension_init(grid, liquid, tension)
    allocate (tension%force, source=solid%aperture)
    allocate (tension%surface%place, source=solid%aperture)
    allocate (tension%surface%curvature, source=c)
  end subroutine ready

  !> Columns that end at the floor before a full cell are whole.
  subroutine small_on_the_floor()

    call start(cells)
    bow = [-0.47_wp, 0.0_wp, 0.0_wp, 0.02_wp, 0.03_wp, 0.0_wp]   ! half a cell above the floor
    call fill_bowed(3, 1)
    call ready(fluid)
    call find_error(3, 1)
    call check('a small of half a cell: curvature [1/m]', worst, 0.0_wp, 1.0e-11_wp)
    call check('a small has heights', tension%surface%fallback, 0)
    call check('there is a small', cases > 0.0_wp)
  end subroutine small_on_the_floor

  !> A drop of one cell has no heights: the divergence of the normals, sum of 1/h.
  subroutine curvature_beyond_heights()
    real(wp) :: found(1)

    call start(cells)
    if (grid%owns([8, 7, 9])) c(8, 7, 9) = 0.5_wp
    call fill_scalar_halo(grid, c)
    call ready(fluid)
    call find_tension(grid, fluid, solid, c, tension)
    found = -huge(1.0_wp)
    if (grid%owns([8, 7, 9])) found = tension%surface%curvature(8, 7, 9)
    call global_max(found)
    call check('curvature of a drop of one cell [1/m]', found(1), sum(1.0_wp/grid%h), 1.0e-12_wp)
    call check('counted', tension%surface%fallback, 1)
  end subroutine curvature_beyond_heights

  !> Basins of different level beside one thin wall: the surface of each is level up to the wall.
  subroutine two_basins()
    real(wp) :: largest(1)
    integer :: k

    call start(cells)
    call set_boxes(grid, [0.5_wp, -1.0_wp, -1.0_wp], [0.58_wp, 2.0_wp, 2.0_wp], solid)
    do k = grid%lo(3), grid%hi(3)
      c(:7, :, k) = min(max((0.53_wp - grid%face(k, 3))/grid%h(3), 0.0_wp), 1.0_wp)
      c(8:, :, k) = min(max((0.47_wp - grid%face(k, 3))/grid%h(3), 0.0_wp), 1.0_wp)
    end do
    call fill_scalar_halo(grid, c)
    call ready(fluid)
    call find_tension(grid, fluid, solid, c, tension)
    largest = 0.0_wp
    associate (a => grid%lo, b => grid%hi, curvature => tension%surface%curvature)
      largest = max(maxval(abs(curvature(a(1):min(b(1), 7), a(2):b(2), a(3):b(3)))), &
                    maxval(abs(curvature(max(a(1), 8):b(1), a(2):b(2), a(3):b(3)))))
    end associate
    call global_max(largest)
    call check('no curvature beside a wall of two levels [1/m]', largest(1), 0.0_wp, 1.0e-11_wp)
  end subroutine two_basins

  !> The acceleration at the faces is that of a pressure sigma kappa C, with the sign that pulls a
  !! drop together, and none on the sides of the domain.
  subroutine balance_at_faces()
    real(wp), allocatable :: a(:, :, :, :), rho(:, :, :)
    real(wp) :: largest(2), expected
    integer :: i, j, k, d, e(3)

    call start(cells)
    bow = [0.013_wp, 0.0_wp, 0.0_wp, -0.31_wp, -0.23_wp, 0.0_wp]
    call fill_bowed(3, 1)
    call ready(fluid)
    call find_tension(grid, fluid, solid, c, tension)
    allocate (a, source=solid%aperture)
    allocate (rho, source=c)
    a = 0.0_wp
    rho = 1.2_wp + 998.0_wp*c
    call add_tension(grid, rho, tension, a)
    largest = 0.0_wp
    do d = 1, 3
      e = unit_step(:, d)
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            associate (low => c(i - e(1), j - e(2), k - e(3)), high => c(i, j, k))
              expected = 0.0_wp
              if (.not. any([i, j, k] == 1 .and. e == 1) .and. abs(high - low) > 0.0_wp) then
                expected = fluid%surface_tension*face_curvature([i, j, k] - e, [i, j, k]) &
                  *(high - low)/grid%h(d)/(1.2_wp + 499.0_wp*(low + high))
              end if
              largest = max(largest, abs([a(i, j, k, d) - expected, expected]))
            end associate
          end do
        end do
      end do
    end do
    call global_max(largest)
    call check('acceleration at the faces [m/s2]', largest(1), 0.0_wp, 1.0e-12_wp*largest(2))
    call check('there is some', largest(2) > 0.0_wp)
  end subroutine balance_at_faces

  !> Mean curvature of the two cells of a face over those with a surface.
  pure real(wp) function face_curvature(low, high)
    integer, intent(in) :: low(3), high(3)
    integer :: n

    n = count([tension%surface%state(low(1), low(2), low(3)), &
               tension%surface%state(high(1), high(2), high(3))] > 0)
    face_curvature = (tension%surface%curvature(low(1), low(2), low(3)) &
                      + tension%surface%curvature(high(1), high(2), high(3)))/real(max(n, 1), wp)
  end function face_curvature

  !> Level liquid to a share of a layer: with its weight on the two faces of the layer the pressure
  !! of the layer is the mean of the true one, rho g h C^2/2, on either side of the tank.
  subroutine weight_of_level_liquid()
    real(wp), parameter :: share = 0.3_wp
    type(fluid_t) :: heavy
    real(wp), allocatable :: a(:, :, :, :), one(:, :, :)
    real(wp) :: found(2), jump
    integer :: k, way

    do way = 1, 2   ! the liquid below, then above: gravity turned over with it
      call start(cells)
      do k = grid%lo(3), grid%hi(3)
        if ((k < 9 .and. way == 1) .or. (k > 9 .and. way == 2)) c(:, :, k) = 1.0_wp
        if (k == 9) c(:, :, k) = share
      end do
      call fill_scalar_halo(grid, c)
      heavy = fluid_t()
      heavy%gravity = [0.0_wp, 0.0_wp, merge(-9.81_wp, 9.81_wp, way == 1)]
      call ready(heavy)
      call find_tension(grid, heavy, solid, c, tension)
      allocate (a, source=solid%aperture)
      allocate (one, source=c)
      a = 0.0_wp
      one = 1.0_wp
      call add_tension(grid, one, tension, a)
      jump = heavy%liquid_density - heavy%gas_density
      found = -huge(1.0_wp)
      associate (i => grid%lo(1), j => grid%lo(2), g => heavy%gravity(3))
        do k = grid%lo(3), grid%hi(3)
          if (k == 9) found(way) = a(i, j, 9, 3)/g + jump*0.5_wp*(c(i, j, 8) + share)
          if (k == 10) found(3 - way) = a(i, j, 10, 3)/g + jump*0.5_wp*(c(i, j, 10) + share)
        end do
      end associate
      call global_max(found)
      call check('weight of the face in the liquid [kg/m3]', found(1), &
                 jump*(0.5_wp + share - 0.5_wp*share**2), 1.0e-10_wp)
      call check('weight in the gas [kg/m3]', found(2), jump*0.5_wp*share**2, 1.0e-10_wp)
      deallocate (a, one)
    end do
  end subroutine weight_of_level_liquid

  !> Brackbill's limit for water and air on 1 mm: sqrt(999.404e-9/(4 pi 0.07)) s. For waves under
  !! gravity, sqrt(h/g) without gas.
  subroutine longest_step()
    type(fluid_t) :: light

    call check('capillary step [s]', capillary_step(fluid, 1.0e-3_wp), 1.0659e-3_wp, 1.0e-8_wp)
    call check('viscous step [s]', viscous_step(fluid_t(liquid_density=800.0_wp, &
      liquid_viscosity=4.0_wp, gas_viscosity=1.0_wp), 2.0e4_wp), 2.0_wp/75.0_wp, 1.0e-12_wp)
    call check('none without tension', capillary_step(fluid_t(), 1.0e-3_wp) > 1.0e300_wp)
    light%gas_density = 0.0_wp
    light%gravity = [0.0_wp, 3.0_wp, -4.0_wp]
    call check('gravity step [s]', gravity_step(light, 0.05_wp), 0.1_wp, 1.0e-15_wp)
    light%gas_density = 0.6_wp*light%liquid_density
    call check('of two liquids [s]', gravity_step(light, 0.05_wp), 0.2_wp, 1.0e-15_wp)
    light%gravity = 0.0_wp
    call check('none without gravity', gravity_step(light, 0.05_wp) > 1.0e300_wp)
  end subroutine longest_step

  !> On a body through a surface of one curvature, tension and the pressure that balances it cancel.
  subroutine pull_on_a_body()
    type(one_body_t) :: block
    type(surface_tension_t) :: tension
    type(rigid_flux_t) :: flux
    real(wp), allocatable :: p(:, :, :)
    logical, allocatable :: active(:, :, :)
    real(wp), parameter :: pressure = 3.0_wp   !! sigma kappa [Pa]
    real(wp) :: force(6, 1), pull(6, 1), size_of_force
    integer :: i, j, k, d, e(3)

    call place('&grid cells=16,12,18 length=.16,.12,.18/ &shape name="h" kind="hexapod" ' &
      //'size=.02/ &body shape="h" position=.0771,.0611,.0829/ ' &
      //sides('slip slip periodic periodic slip slip'), block)
    associate (g => block%grid)
      allocate (p, source=block%solid%alpha)
      allocate (active(g%first(1):g%last(1), g%first(2):g%last(2), &
                       g%first(3):g%last(3)), source=.true.)
      do concurrent (k=lbound(p, 3):ubound(p, 3), &
        j=lbound(p, 2):ubound(p, 2), i=lbound(p, 1):ubound(p, 1))
        p(i, j, k) = pressure*min(max(9.3_wp - real(k, wp) + 0.2_wp*real(i - 8, wp), 0.0_wp), &
          1.0_wp)
      end do
      call fill_scalar_halo(g, p)
      allocate (tension%force, source=block%solid%aperture)
      tension%acts = .true.
      tension%force = 0.0_wp
      do d = 1, 3
        e = unit_step(:, d)
        do concurrent (k=g%lo(3):g%hi(3) + e(3), j=g%lo(2):g%hi(2) + e(2), i=g%lo(1):g%hi(1) + e(1))
          tension%force(i, j, k, d) = (p(i, j, k) - p(i - e(1), j - e(2), k - e(3)))/g%h(d)
        end do
      end do
      call rigid_flux_init(1, flux)
      call build_rigid_flux(g, block%solid, block%bodies, active, flux)
      call force_from_faces(g, block%bodies, flux, p, force)
      size_of_force = norm2(force(1:3, 1))
      pull = 0.0_wp
      call force_from_tension(g, block%bodies, flux, tension, pull)
      call check('the pressure pushes the body', size_of_force > 1.0e-5_wp)
      call check('the surface pulls it back', force + pull, 0.0_wp, 1.0e-12_wp*size_of_force)
    end associate
  end subroutine pull_on_a_body

end module test_surface_tension_m
