!> The implicit predictor: amplification of waves at any Courant number, its limit for short steps,
!> balance, uniform velocity, and the viscous stage as the part without advection.
module test_c_ismac_m
  use check_m, only: check, wp, pi
  use grid_m, only: grid_t
  use fields_m, only: flow_t, flow_init
  use boundary_m, only: fill_velocity_halo
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use rigid_motion_m, only: rigid_motion_t, rigid_motion_init
  use viscous_system_m, only: viscous_t, viscous_init
  use viscous_links_m, only: build_viscous
  use viscous_m, only: solve_viscous
  use momentum_c_ismac_m, only: c_ismac_t, c_ismac_init, begin_predictor, solve_predictor, &
                                advected_velocity
  use one_body_m, only: one_body_t, place
  use box_solid_m, only: simple_grid
  implicit none
  private
  public :: test_c_ismac

  real(wp), parameter :: implicit_share = 0.75_wp   !! a of the scheme
  logical, parameter :: everywhere(3) = .true.
  type(grid_t) :: grid
  type(flow_t) :: flow
  type(solid_geometry_t) :: solid
  type(rigid_motion_t) :: none
  type(viscous_t) :: viscous
  type(c_ismac_t) :: predictor

contains

  subroutine test_c_ismac()
    call amplification(0.5_wp)
    call amplification(2.0_wp)
    call amplification(20.0_wp)
    call long_run(1.0_wp)
    call long_run(2.0_wp)
    call short_steps()
    call balance()
    call uniform_velocity()
    call part_of_advection()
    call without_advection()
  end subroutine test_c_ismac

  !> Fluid without solids and all but inviscid, carried by a uniform stream along d.
  subroutine start(n, d, advection)
    integer, intent(in) :: n(3), d
    character(*), intent(in) :: advection

    call simple_grid(n, real(n, wp)/real(n(d), wp), grid, everywhere)
    call flow_init(grid, flow)
    call solid_geometry_init(grid, solid)
    call rigid_motion_init(0, none)
    call viscous_init(grid, 0, viscous)
    call c_ismac_init(grid, 0, advection, predictor)
    flow%rho = 1000.0_wp
    flow%mu = 1.0e-12_wp
  end subroutine start

  !> One step at a Courant number along d.
  subroutine step(courant, d)
    real(wp), intent(in) :: courant
    integer, intent(in) :: d
    logical :: converged

    predictor%q = 0.0_wp
    predictor%q(:, :, :, d) = courant*grid%volume
    call fill_velocity_halo(grid, flow%u)
    call begin_predictor(grid, flow%u, predictor)
    call solve(1.0e-2_wp, converged)
    call check('the predictor converges', converged)
  end subroutine step

  subroutine solve(dt, converged)
    real(wp), intent(in) :: dt
    logical, intent(out) :: converged

    call build_viscous(grid, solid, none, flow%rho, flow%mu, dt, viscous)
    call solve_predictor(grid, flow%rho, none, flow, viscous, predictor)
    converged = viscous%converged
  end subroutine solve

  !> With the donor's value every wave is multiplied by 1 - C l/(1 + a C l), l = 1 - exp(-i k h).
  subroutine amplification(courant)
    real(wp), intent(in) :: courant
    integer, parameter :: n = 12, wave = 2
    complex(wp) :: l, g, mode
    real(wp) :: expected(n)
    integer :: i, d, m(3)

    do d = 1, 3
      m = 4
      m(d) = n
      call start(m, d, 'upwind')
      l = 1.0_wp - exp(cmplx(0.0_wp, -2.0_wp*pi*wave/n, wp))
      g = 1.0_wp - courant*l/(1.0_wp + implicit_share*courant*l)
      do i = 1, n
        mode = exp(cmplx(0.0_wp, 2.0_wp*pi*wave*i/n, wp))
        expected(i) = real(g*mode, wp)
        if (d == 1) flow%u(i, :, :, :) = real(mode, wp)
        if (d == 2) flow%u(:, i, :, :) = real(mode, wp)
        if (d == 3) flow%u(:, :, i, :) = real(mode, wp)
      end do
      call step(courant, d)
      do i = 1, 3
        if (d == 1) call check('wave along x', flow%u(1:n, 2, 3, i), expected, 2.0e-9_wp)
        if (d == 2) call check('wave along y', flow%u(2, 1:n, 3, i), expected, 2.0e-9_wp)
        if (d == 3) call check('wave along z', flow%u(2, 3, 1:n, i), expected, 2.0e-9_wp)
      end do
    end do
  end subroutine amplification

  !> Many steps with the fifth-order right side: a sine and a jump lose energy and keep their mean.
  subroutine long_run(courant)
    real(wp), intent(in) :: courant
    integer, parameter :: n = 40
    real(wp) :: energy(2), before(2), mean(2)
    integer :: i, it
    logical :: decays

    call start([n, 1, 1], 1, 'tvd5')
    do i = 1, n
      flow%u(i, :, :, 2) = sin(2.0_wp*pi*real(i, wp)/n)
      flow%u(i, :, :, 3) = merge(1.0_wp, 0.0_wp, i > 8 .and. i <= 20)
    end do
    mean = total(1)
    energy = total(2)
    decays = .true.
    do it = 1, 200
      before = energy
      call step(courant, 1)
      energy = total(2)
      decays = decays .and. all(energy <= before*(1.0_wp + 1.0e-8_wp))
    end do
    call check('energy never grows', decays)
    call check('mean stays', total(1), mean, 1.0e-7_wp*real(n, wp))
    call check('no overshoot', maxval(abs(flow%u(1:n, 1, 1, 2:3))) < 1.0_wp)
  end subroutine long_run

  !> Sum of a power of the transverse velocities.
  function total(power) result(s)
    integer, intent(in) :: power
    real(wp) :: s(2)

    s = [sum(flow%u(1:grid%n(1), 1, 1, 2)**power), sum(flow%u(1:grid%n(1), 1, 1, 3)**power)]
  end function total

  !> For short steps the predictor is the explicit step; the difference falls with the square.
  subroutine short_steps()
    integer, parameter :: n = 16
    real(wp) :: difference(3), explicit(n), courant
    integer :: i, m

    do m = 1, 3
      call start([n, 1, 1], 1, 'tvd5')
      do i = 1, n
        flow%u(i, :, :, 2) = sin(2.0_wp*pi*real(i, wp)/n) + 0.3_wp*cos(4.0_wp*pi*real(i, wp)/n)
      end do
      courant = 1.0e-2_wp/2.0_wp**m
      explicit = flow%u(1:n, 1, 1, 2)
      call step(courant, 1)
      explicit = explicit + predictor%gain(1:n, 1, 1, 2)/grid%volume
      difference(m) = maxval(abs(flow%u(1:n, 1, 1, 2) - explicit))
      call check('the explicit step changes something', &
                 maxval(abs(predictor%gain(1:n, 1, 1, 2))) > 0.1_wp*courant*grid%volume)
    end do
    call check('to the explicit step', difference(1:2)/difference(2:3), [4.0_wp, 4.0_wp], 0.05_wp)
  end subroutine short_steps

  !> Where forces balance advection nothing changes, whatever the step.
  subroutine balance()
    integer :: i
    logical :: converged
    real(wp), allocatable :: before(:, :, :, :)

    call start([16, 4, 4], 1, 'tvd5')
    do i = 1, 16
      flow%u(i, :, :, 1) = 1.0_wp + 0.5_wp*sin(pi*real(i, wp)/8)
      flow%u(i, :, :, 2) = cos(pi*real(i, wp)/8)
    end do
    call fill_velocity_halo(grid, flow%u)
    allocate (before, source=flow%u)
    predictor%q(:, :, :, 1) = 3.0_wp*grid%volume
    call begin_predictor(grid, flow%u, predictor)
    call check('advection acts', maxval(abs(predictor%gain)) > 0.1_wp*grid%volume)
    flow%u = flow%u - predictor%gain/grid%volume   ! by the forces of the step
    call solve(1.0e-2_wp, converged)
    call check('balance', reshape(flow%u(1:16, 1:4, 1:4, :), [768]), &
               reshape(before(1:16, 1:4, 1:4, :), [768]), 1.0e-8_wp)
  end subroutine balance

  !> A uniform velocity stays in any stream, divergent ones too.
  subroutine uniform_velocity()
    integer :: i, d
    logical :: converged

    call start([12, 8, 6], 1, 'tvd5')
    do d = 1, 3
      flow%u(:, :, :, d) = real(d, wp)
      do i = 1, 12
        predictor%q(i, :, :, d) = grid%volume*sin(real(i*d, wp))
      end do
      predictor%q(13, :, :, d) = predictor%q(1, :, :, d)
    end do
    call begin_predictor(grid, flow%u, predictor)
    call solve(1.0e-2_wp, converged)
    do d = 1, 3
      call check('uniform velocity', flow%u(1:12, 1:8, 1:6, d) - real(d, wp), 0.0_wp, 1.0e-12_wp)
    end do
  end subroutine uniform_velocity

  !> Without forces all that the predictor changes is by advection.
  subroutine part_of_advection()
    real(wp), allocatable :: part(:, :, :, :)
    integer :: i

    call start([16, 4, 4], 1, 'tvd5')
    do i = 1, 16
      flow%u(i, :, :, 3) = cos(pi*real(i, wp)/8)
    end do
    allocate (part, source=flow%u)
    call step(1.5_wp, 1)
    call advected_velocity(grid, flow%rho, 1.0e-2_wp, viscous, predictor, part)
    call check('part of advection', part(1:16, 2, 2, 3), flow%u(1:16, 2, 2, 3), 1.0e-8_wp)
  end subroutine part_of_advection

  !> Without advection the predictor is the viscous stage, with a free body and small cells.
  subroutine without_advection()
    real(wp), parameter :: dt = 0.05_wp
    type(one_body_t) :: block
    type(rigid_motion_t) :: bodies
    real(wp) :: expected(6, 1)
    real(wp), allocatable :: u(:, :, :, :), u_expected(:, :, :, :)
    integer :: c, i, j, k

    call place('&grid cells=3*12 length=3*.12/ &fluid liquid_viscosity=.5/ &boundary ' &
      //'x_min="no_slip" x_max="slip" y_min="periodic" y_max="periodic" z_min="no_slip" ' &
      //'z_max="open" z_min_velocity=.4,0,0/ &shape name="h" kind="hexapod" size=.02/ &body ' &
      //'shape="h" position=.061,.058,.063 velocity=.3,-.2,.1 angular_velocity=2,1,-3/', block)
    do concurrent (c=1:3, k=1:12, j=1:12, i=1:12)
      block%flow%u(i, j, k, c) = sin(0.5_wp*i + c)*cos(0.5_wp*j*c) + 0.1_wp*k
    end do
    call fill_velocity_halo(block%grid, block%flow%u)
    bodies = block%bodies
    allocate (u, source=block%flow%u)
    call viscous_init(block%grid, 1, viscous)
    call build_viscous(block%grid, block%solid, bodies, block%flow%rho, block%flow%mu, dt, viscous)
    call solve_viscous(block%grid, bodies, block%flow, viscous)
    expected = viscous%force
    allocate (u_expected, source=block%flow%u)
    block%flow%u = u
    call c_ismac_init(block%grid, 1, 'tvd5', predictor)
    call begin_predictor(block%grid, 0.9_wp*u, predictor)   ! the rest by the forces of the step
    call solve_predictor(block%grid, block%flow%rho, block%bodies, block%flow, viscous, predictor)
    call check('with a body: converged', viscous%converged)
    call check('with a body: velocity', &
      block%flow%u(1:12, 1:12, 1:12, :) - u_expected(1:12, 1:12, 1:12, :), 0.0_wp, 1.0e-7_wp)
    call check('with a body: motion', block%bodies%motion - bodies%motion, 0.0_wp, 1.0e-6_wp)
    call check('force', viscous%force(:, 1), expected(:, 1), 1.0e-6_wp*norm2(expected(1:3, 1)))
    call check('with a body: it is dragged', norm2(bodies%motion(:, 1) - [0.3_wp, -0.2_wp, 0.1_wp, &
      2.0_wp, 1.0_wp, -3.0_wp]) > 0.1_wp)
  end subroutine without_advection

end module test_c_ismac_m
