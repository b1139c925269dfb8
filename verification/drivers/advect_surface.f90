!> Liquid carried by given velocities through the transport of the program: Zalesak's disc, the
!! reversed single vortex and the reversed deformation in space, at three resolutions each.
!!
!! One row per run: test, cells, error, change of the volume, largest share past 0 and 1. The face
!! velocities are differences of a stream function, or exact means, so they are free of divergence.
program advect_surface
  use, intrinsic :: iso_fortran_env, only: output_unit
  use kinds_m, only: wp, pi
  use grid_m, only: grid_t
  use fields_m, only: flow_t, flow_init
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use boundary_m, only: fill_scalar_halo
  use extended_fraction_m, only: extend_fraction
  use liquid_transport_m, only: liquid_transport_t, liquid_transport_init
  use liquid_alone_m, only: transport_liquid
  use liquid_fill_m, only: liquid_volume
  use box_solid_m, only: simple_grid
  implicit none
  integer, parameter :: plane(3) = [50, 100, 200]
  integer, parameter :: vortex(3) = [32, 64, 128], space(3) = [32, 48, 64]
  real(wp), parameter :: courant = 0.25_wp   !! of the sum over the directions
  integer :: m

  print '(a)', 'test,cells,error,volume_change,past_bounds'
  do m = 1, 3
    call turn('zalesak', plane(m))
  end do
  do m = 1, 3
    call turn('vortex', vortex(m))
  end do
  do m = 1, 3
    call turn('deformation', space(m))
  end do

contains

  !> One whole period of a test on n cells per edge of the unit box.
  subroutine turn(name, n)
    character(*), intent(in) :: name
    integer, intent(in) :: n
    type(grid_t) :: grid
    type(flow_t) :: flow
    type(solid_geometry_t) :: none
    type(liquid_transport_t) :: transport
    real(wp), allocatable :: start(:, :, :), uf(:, :, :, :)
    real(wp) :: period, dt, before, past, error
    integer :: cells(3), step, steps

    cells = n
    if (name /= 'deformation') cells(2) = 1
    call simple_grid(cells, [1.0_wp, 1.0_wp/real(n/cells(2), wp), 1.0_wp], grid, &
                     [.false., cells(2) == 1, .false.])
    if (cells(2) > 1) grid%length(2) = 1.0_wp
    call flow_init(grid, flow)
    call solid_geometry_init(grid, none)
    call liquid_transport_init(grid, [0.0_wp, 0.0_wp, -1.0_wp], transport)
    call fill(name, grid, flow)
    call extend_fraction(grid, none, transport%extension, flow)
    allocate (start, source=flow%liquid)
    allocate (uf, source=flow%uf)
    call set_velocity(name, grid, uf)
    period = merge(8.0_wp, merge(3.0_wp, 1.0_wp, name == 'deformation'), name == 'vortex')
    steps = ceiling(period*maxval(sum(abs(uf), 4))*real(n, wp)/courant)   ! sum over the directions
    dt = period/real(steps, wp)
    before = liquid_volume(grid, flow%liquid)
    past = 0.0_wp
    do step = 1, steps
      flow%uf = uf
      if (name /= 'zalesak') flow%uf = uf*cos(pi*(real(step, wp) - 0.5_wp)/real(steps, wp))
      call transport_liquid(grid, none, none, dt, step, transport, flow)
      past = max(past, -minval(flow%liquid), maxval(flow%liquid - flow%fluid_volume))
    end do
    associate (a => grid%lo, b => grid%hi)
      error = sum(abs(flow%liquid(a(1):b(1), a(2):b(2), a(3):b(3)) &
                      - start(a(1):b(1), a(2):b(2), a(3):b(3))))
      if (name == 'zalesak') error = error/before
      if (name == 'vortex') error = error*real(n, wp)   ! per depth
    end associate
    print '(a, ",", i0, 3(",", es23.15e3))', name, n, error, &
      liquid_volume(grid, flow%liquid)/before - 1.0_wp, past/grid%volume
    flush (output_unit)
  end subroutine turn

  !> Is a point inside the liquid of the start?
  pure logical function inside(name, x)
    character(*), intent(in) :: name
    real(wp), intent(in) :: x(3)

    select case (name)
    case ('deformation')
      inside = sum((x - 0.35_wp)**2) < 0.15_wp**2
    case ('vortex')
      inside = (x(1) - 0.5_wp)**2 + (x(3) - 0.75_wp)**2 < 0.15_wp**2
    case default   ! a slot 0.05 wide and 0.25 deep from below
      inside = (x(1) - 0.5_wp)**2 + (x(3) - 0.75_wp)**2 < 0.15_wp**2 .and. &
               .not. (abs(x(1) - 0.5_wp) < 0.025_wp .and. x(3) < 0.85_wp)
    end select
  end function inside

  !> Liquid by counting points of a cell.
  subroutine fill(name, grid, flow)
    character(*), intent(in) :: name
    type(grid_t), intent(in) :: grid
    type(flow_t), intent(inout) :: flow
    integer :: fine(3), i, j, k, m, found

    fine = 16
    if (grid%n(2) == 1) fine(2) = 1
    do concurrent (k=1:grid%n(3), j=1:grid%n(2), i=1:grid%n(1))
      found = 0
      do m = 0, product(fine) - 1
        if (inside(name, grid%face([i, j, k], [1, 2, 3]) + grid%h*(modulo(m/[1, fine(1), &
          fine(1)*fine(2)], fine) + 0.5_wp)/fine)) found = found + 1
      end do
      flow%liquid(i, j, k) = grid%volume*real(found, wp)/product(fine)
    end do
    flow%fluid_volume = grid%volume
    call fill_scalar_halo(grid, flow%liquid)
  end subroutine fill

  !> Velocity of the lower faces at its largest.
  subroutine set_velocity(name, grid, uf)
    character(*), intent(in) :: name
    type(grid_t), intent(in) :: grid
    real(wp), intent(inout), allocatable :: uf(:, :, :, :)
    real(wp) :: x, y, z, h(3)
    integer :: i, j, k

    uf = 0.0_wp
    h = grid%h
    do concurrent (k=1:grid%n(3) + 1, j=1:grid%n(2) + 1, i=1:grid%n(1) + 1)
      x = grid%face(i, 1)
      y = grid%face(j, 2)
      z = grid%face(k, 3)
      if (name == 'deformation') then
        uf(i, j, k, :) = [2.0_wp*sin(pi*x)**2*mean(y, h(2))*mean(z, h(3)), &
          -mean(x, h(1))*sin(pi*y)**2*mean(z, h(3)), -mean(x, h(1))*mean(y, h(2))*sin(pi*z)**2]
      else
        uf(i, j, k, 1) = (stream(name, x, z + h(3)) - stream(name, x, z))/h(3)
        uf(i, j, k, 3) = -(stream(name, x + h(1), z) - stream(name, x, z))/h(1)
      end if
    end do
  end subroutine set_velocity

  !> Mean of sin(2 pi s) over s..s+h.
  pure real(wp) function mean(s, h)
    real(wp), intent(in) :: s, h

    mean = (cos(2.0_wp*pi*s) - cos(2.0_wp*pi*(s + h)))/(2.0_wp*pi*h)
  end function mean

  !> Stream function: solid rotation up to r = 0.45 that dies out at the walls, or the vortex.
  pure real(wp) function stream(name, x, z)
    character(*), intent(in) :: name
    real(wp), intent(in) :: x, z
    real(wp), parameter :: rigid = 0.45_wp, still = 0.5_wp
    real(wp) :: r, d

    if (name == 'vortex') then
      stream = sin(pi*x)**2*sin(pi*z)**2/pi
      return
    end if
    r = norm2([x - 0.5_wp, z - 0.5_wp])
    stream = 0.5_wp*min(r, rigid)**2
    if (r > rigid) then   ! speed falls evenly from rigid to still
      d = min(r, still) - rigid
      stream = stream + rigid*(d - 0.5_wp*d**2/(still - rigid))
    end if
    stream = 2.0_wp*pi*stream
  end function stream

end program advect_surface
