!> One monolithic step of a free block in liquid: momentum, divergence, added mass, free fall.
module test_coupling_m
  use check_m, only: check, wp
  use errors_m, only: to_text
  use vectors_m, only: quaternion_from_axis
  use scratch_m, only: scratch_t, scratch_init
  use stage_m, only: stage_t
  use monolithic_m, only: monolithic_t, monolithic_init
  use flow_start_m, only: start_flow
  use rigid_motion_m, only: set_inertia
  use coupling_m, only: copy_motion, start_of_stages, motion_after_fluid
  use boundary_m, only: fill_velocity_halo
  use case_types_m, only: case_t
  use case_text_m, only: case_of, sides, body
  use one_body_m, only: one_body_t, place
  implicit none
  private
  public :: test_coupling

  real(wp), parameter :: dt = 1.0e-3_wp, g = 9.81_wp
  type(case_t) :: case
  type(one_body_t), target :: block
  type(monolithic_t) :: coupling
  type(scratch_t), target :: scratch
  logical :: begun = .false.   !! has `begin` gone before?

contains

  subroutine test_coupling()
    call let_go(2.3_wp)
    call let_go(0.1_wp)
    call moving_box()
    call block_at_rest()
    call fall_together('kind="hexapod" size=.02', 2300.0_wp)
    call fall_together('kind="box" size=.043,.031,.037', 600.0_wp)
    call fall_together('kind="sphere" size=.05', 2300.0_wp, across_the_corner=.true.)
    call wherever_it_lies()
    call momentum_kept('in the open', spread(0.06_wp, 1, 3))
    call momentum_kept('at a wall', [0.033_wp, 0.06_wp, 0.06_wp])   ! it turns
    call goes_on_as_before()
    call gas_in_a_cut_cell()
    call limited()
  end subroutine test_coupling

  !> A block in the middle of a tank full of liquid that is at rest, pressure in balance.
  subroutine build(cells, shape, density)
    integer, intent(in) :: cells
    character(*), intent(in) :: shape   !! variables of &shape
    real(wp), intent(in) :: density

    case = case_of('&run t_end=1 dt=1e-3/ &grid cells=3*'//to_text(cells)//' length=3*' &
      //to_text(0.01_wp*cells)//'/ &fluid single_phase=T liquid_density=1000/ &numerics ' &
      //'divergence_tolerance=1e-8/ &shape name="b" '//shape//' density='//to_text(density)//'/ ' &
      //sides('slip slip slip slip slip open')//body('b', spread(0.005_wp*cells, 1, 3) &
      + [0.0013_wp, -0.0007_wp, 0.0021_wp], q=quaternion_from_axis([1.0_wp, -0.3_wp, 0.5_wp], &
      0.7_wp)))
  end subroutine build

  subroutine ready()
    logical :: converged

    call place(case, block)
    call scratch_init(block%grid, scratch)
    call monolithic_init(block%grid, 1, case, coupling)
    call copy_motion(block%blocks, coupling%bodies)
    call start_flow(stage(), coupling, converged)
    call check('the start converged', converged)
    call fill_velocity_halo(block%grid, block%flow%u)
    block%blocks%v_start = block%blocks%v
    block%blocks%l_start = block%blocks%l
  end subroutine ready

  function stage() result(s)
    type(stage_t) :: s

    s = stage_t(block%grid, block%solid, block%flow, scratch, dt)
  end function stage

  subroutine begin()
    call coupling%begin(stage(), block%blocks)
    begun = .true.
  end subroutine begin

  !> The stages of a step after the transport, of which `begin` may have gone before.
  subroutine advance()
    call start_of_stages(case%fluid%gravity, dt, block%blocks, coupling)
    call stages()
    call motion_after_fluid(case%fluid%gravity, dt, block%blocks, coupling)
    call coupling%close(stage(), block%blocks)
  end subroutine advance

  !> Those between two looks at the motion of the block. Without `begin` nothing has been given
  !! before the transport, and the faces are as their cells.
  subroutine stages()
    if (.not. begun) then
      coupling%correction = 0.0_wp
      coupling%kick = 0.0_wp
    end if
    begun = .false.
    call coupling%average_momentum(stage())
    call coupling%build_pressure_system(stage())
    call coupling%add_forces(stage())
    call coupling%add_viscosity(stage())
    call coupling%predict_faces(stage())
    call coupling%project(stage())
  end subroutine stages

  !> Before its first step the sphere has the force of that fall, and the fluid the pressure of it,
  !! at which its next step starts; nothing moves yet.
  subroutine let_go(s)
    real(wp), intent(in) :: s   !! density ratio
    real(wp), parameter :: dipole = 0.5_wp*0.025_wp**3*(1.0_wp/0.0471_wp**2 + 1.0_wp/0.0429_wp**2)
      !! R^3/(2 r^2) below and above the sphere [m]
    real(wp) :: force(6, 1), a(3), expected
    real(wp), allocatable :: p(:, :, :), uf(:, :, :, :)

    call build(16, 'kind="sphere" size=.05', 1000.0_wp*s)
    call ready()
    allocate (p, source=block%flow%p)
    allocate (uf, source=block%flow%uf)
    call coupling%force_at_release(stage(), [.true.], force)
    a(1:3) = force(1:3, 1)/block%blocks%mass(1) - [0.0_wp, 0.0_wp, g]
    expected = (s - 1.0_wp)/(s + 0.5_wp)
    call check('let go: acceleration', -a(3)/g, expected, 0.02_wp*abs(expected))
    call check('let go: no velocity yet', &
      maxval(abs(block%flow%uf - uf)) + maxval(abs(coupling%bodies%motion)), 0.0_wp)
    p = block%flow%p - p
    call check('let go: the pressure of a dipole, more between walls', (p(8, 8, 4) - p(8, 8, 13)) &
               /(-1000.0_wp*a(3)*dipole), 1.0_wp, 0.3_wp)
    if (s < 1.0_wp) return   ! 12 cells instead of 5 are needed: case free_sphere
    block%blocks%fluid_force(:, 1) = force(1:3, 1)
    block%blocks%fluid_torque(:, 1) = force(4:6, 1)
    call begin()
    call advance()
    call check('let go: first step', -block%blocks%v(3, 1)/(dt*g), expected, 0.02_wp*abs(expected))
  end subroutine let_go

  !> A box that moves and spins: the motion found with the pressure is that of the forces.
  subroutine moving_box()
    real(wp) :: motion(6), gain(6), arm(3)

    call build(12, 'kind="box" size=.043,.031,.037', 1700.0_wp)
    case%body(1)%velocity = [0.3_wp, -0.2_wp, 0.1_wp]
    case%body(1)%angular_velocity = [2.0_wp, 1.0_wp, -3.0_wp]
    call ready()
    call start_of_stages(case%fluid%gravity, dt, block%blocks, coupling)
    motion = coupling%bodies%motion(:, 1)
    coupling%at_start = coupling%bodies
    call stages()
    gain(1:3) = block%blocks%mass(1)*(coupling%bodies%motion(1:3, 1) - motion(1:3))
    gain(4:6) = matmul(coupling%bodies%inertia(:, :, 1), &
                       coupling%bodies%motion(4:6, 1) - motion(4:6))
    call check('box: converged', coupling%pressure%report%converged &
               .and. coupling%viscous%converged)
    call check('box: divergence', coupling%pressure%report%divergence < 1.0e-8_wp)
    ! To the tolerance of the viscous solver.
    call check('box: momentum by the solve is that of the force', gain(1:3), &
               dt*coupling%total(1:3, 1), 1.0e-9_wp*norm2(gain(1:3)))
    call check('box: spin by the solve is that of the torque', gain(4:6), &
               dt*coupling%total(4:6, 1), 1.0e-7_wp*norm2(gain(4:6)))
    call check('box: torque acts', norm2(gain(4:6)) > 1.0e-8_wp)
    arm = block%grid%centre(6, [1, 2, 3]) - block%blocks%x(:, 1)
    call check('box: closed cells move with it', block%flow%u(6, 6, 6, 1), &
               coupling%bodies%motion(1, 1) + coupling%bodies%motion(5, 1)*arm(3) &
               - coupling%bodies%motion(6, 1)*arm(2), 1.0e-14_wp)
  end subroutine moving_box

  !> A block that a contact carries, with its weight under water, stays at rest; so does the water.
  subroutine block_at_rest()
    call build(12, 'kind="hexapod" size=.02', 2300.0_wp)
    case%fluid%liquid_viscosity = 10.0_wp
    call ready()
    block%blocks%contact_force(3, 1) = 1300.0_wp*coupling%bodies%volume(1)*g
    call advance()
    call check('block at rest: stays', block%blocks%v, 0.0_wp, 1.0e-8_wp)
    call check('block at rest: the water too', block%flow%u(1:12, 1:12, 1:12, :), 0.0_wp, 1.0e-8_wp)
  end subroutine block_at_rest

  !> Where nothing holds block and water, they fall together, whatever their densities: no force
  !! acts between them. Across the corner walls of its images stand in the last halo layers.
  subroutine fall_together(shape, density, across_the_corner)
    character(*), intent(in) :: shape
    real(wp), intent(in) :: density
    logical, intent(in), optional :: across_the_corner
    integer :: d

    call build(12, shape, density)
    if (present(across_the_corner)) case%body(1)%position = 0.119_wp
    case%boundary%kind = 'periodic'
    case%fluid%gravity = [1.7_wp, -0.9_wp, -9.5_wp]
    case%fluid%liquid_viscosity = 1.0e-9_wp   ! faces at walls take dt', see `face_velocity_m`
    call ready()
    block%flow%p = 0.0_wp
    coupling%extrapolated(1:3, 1) = dt*case%fluid%gravity   ! it has fallen before
    call advance()
    associate (fall => dt*case%fluid%gravity)
      call check(shape//' falls: velocity', block%blocks%v(:, 1), fall, 1.0e-8_wp*norm2(fall))
      call check(shape//' falls: it does not turn', norm2(block%blocks%omega(:, 1)), 0.0_wp, &
                 1.0e-8_wp*norm2(fall)/0.05_wp)
      do d = 1, 3
        call check(shape//' falls: the water too', &
          block%flow%u(1:12, 1:12, 1:12, d) - fall(d), 0.0_wp, 1.0e-8_wp*norm2(fall))
      end do
    end associate
  end subroutine fall_together

  !> The added mass of a sphere five cells wide hardly depends on its place between the cells; the
  !! volume that its faces count does, by 8 %.
  subroutine wherever_it_lies()
    real(wp), parameter :: place(3) = [0.0_wp, 0.25_wp, 0.5_wp]   !! [cells]
    real(wp) :: a(3)
    integer :: n

    do n = 1, 3
      call build(16, 'kind="sphere" size=.05', 1100.0_wp)
      case%body(1)%position = 0.08_wp + 0.01_wp*place(n)
      call ready()
      call advance()
      a(n) = -block%blocks%v(3, 1)/dt
    end do
    call check('sphere: the same wherever it lies', maxval(a)/minval(a) - 1.0_wp, 0.0_wp, 0.01_wp)
  end subroutine wherever_it_lies

  !> A hexapod with corners of few cells starts to move in still water, between two slip walls in a
  !! periodic box: along the walls fluid and block keep their momentum, after one step and after
  !! two, if what the next step adds is counted. That is little.
  subroutine momentum_kept(name, position)
    character(*), intent(in) :: name
    real(wp), intent(in) :: position(3)
    real(wp), parameter :: rest = 1.0e-10_wp   !! that may be missing, of what is exchanged
    real(wp) :: before(3), after(3), motion(3), late

    call build(12, 'kind="hexapod" size=.02', 2300.0_wp)
    case%boundary%kind = 'periodic'
    case%boundary%kind(:, 1) = 'slip'
    case%fluid%gravity = 0.0_wp
    case%body(1)%position = position
    case%body(1)%velocity = [0.0_wp, 0.3_wp, -0.4_wp]
    call ready()
    motion = block%blocks%v(:, 1)
    before = momentum()
    call advance()
    late = dt*norm2(block%blocks%lagged_force(2:3, 1))
    after = momentum() + dt*block%blocks%lagged_force(1:3, 1)
    motion = block%blocks%v(:, 1) - motion
    call check('momentum '//name//': the water took some', norm2(motion) > 0.05_wp)
    call check('momentum '//name//': fluid and block keep it', after(2:3), before(2:3), &
               rest*block%blocks%mass(1)*norm2(motion))
    call check('momentum '//name//': something is late', &
               late > 1.0e-5_wp*block%blocks%mass(1)*norm2(motion))
    call check('momentum '//name//': a ten-thousandth at most', &
               late < 1.0e-4_wp*block%blocks%mass(1)*norm2(motion))
    block%blocks%v_start = block%blocks%v
    block%blocks%l_start = block%blocks%l
    call advance()
    after = momentum() + dt*block%blocks%lagged_force(1:3, 1)
    call check('momentum '//name//': what is late comes', after(2:3), before(2:3), &
               rest*block%blocks%mass(1)*norm2(motion))
  end subroutine momentum_kept

  !> The motion predicted for the end of the step is that of the last forces, for this step.
  subroutine goes_on_as_before()
    real(wp), parameter :: spin(3) = [2.0_wp, 1.0_wp, -3.0_wp]
    real(wp), parameter :: forces(3, 4) = reshape([0.02_wp, -0.03_wp, 0.5_wp, 0.01_wp, 0.02_wp, &
      0.03_wp, 2.0e-6_wp, 1.0e-6_wp, -3.0e-6_wp, 1.0e-6_wp, 4.0e-6_wp, 1.0e-6_wp], [3, 4])
      !! of fluid and contact [N], torque of fluid and contact [N m]
    real(wp) :: gain(6)

    call build(12, 'kind="box" size=.043,.031,.037', 1700.0_wp)
    case%body(1)%velocity = [0.3_wp, -0.2_wp, 0.1_wp]
    case%body(1)%angular_velocity = spin
    call ready()
    block%blocks%fluid_force(:, 1) = forces(:, 1)
    block%blocks%contact_force(:, 1) = forces(:, 2)
    block%blocks%fluid_torque(:, 1) = forces(:, 3)
    block%blocks%contact_torque(:, 1) = forces(:, 4)
    gain(1:3) = case%fluid%gravity + (forces(:, 1) + forces(:, 2))/block%blocks%mass(1)
    gain(4:6) = matmul(coupling%bodies%inverse_inertia(:, :, 1), forces(:, 3) + forces(:, 4))
    call begin()
    call check('predicted: the last acceleration', coupling%extrapolated(:, 1), dt*gain, 1.0e-12_wp)
  end subroutine goes_on_as_before

  !> A cut cell weighs by its level, but gas in its open part has the inertia of gas.
  subroutine gas_in_a_cut_cell()
    integer :: c(3)

    call build(12, 'kind="box" size=.043,.031,.037', 1700.0_wp)
    case%body(1)%fixed = .true.
    call ready()
    c = findloc(block%solid%alpha(1:12, 1:12, 1:12) > 0.3_wp &
                .and. block%solid%alpha(1:12, 1:12, 1:12) < 0.7_wp, .true.)
    block%flow%liquid(c(1), c(2), c(3)) = 0.0_wp
    call advance()
    associate (fluid => case%fluid)
      call check('inertia: of the gas that is there', coupling%rho(c(1), c(2), c(3)), &
                 fluid%gas_density, 1.0e-12_wp*fluid%gas_density)
      coupling%rho(c(1), c(2), c(3)) = fluid%liquid_density
      call check('inertia: of the liquid elsewhere', coupling%rho(1:12, 1:12, 1:12) &
        - fluid%liquid_density, 0.0_wp, 1.0e-9_wp*fluid%liquid_density)
    end associate
  end subroutine gas_in_a_cut_cell

  !> Momentum of fluid and block [kg m/s].
  function momentum() result(p)
    real(wp) :: p(3)
    integer :: d

    associate (n => case%grid%cells)
      do d = 1, 3
        p(d) = sum(block%flow%fluid_volume(1:n(1), 1:n(2), 1:n(3)) &
                   *block%flow%u(1:n(1), 1:n(2), 1:n(3), d))
      end do
    end associate
    p = case%fluid%liquid_density*p + block%blocks%mass(1)*block%blocks%v(:, 1)
  end function momentum

  !> However much the faces miss of a light body, its inertia stays positive.
  subroutine limited()
    real(wp) :: defect(6, 6), z(6)
    integer :: d

    call build(12, 'kind="box" size=.043,.031,.037', 30.0_wp)
    call place(case, block)
    defect = 0.0_wp
    do d = 1, 3
      defect(d, d) = (-1.0_wp)**d*10.0_wp*block%blocks%mass(1)
      defect(d, 4:6) = [0.02_wp, -0.01_wp, 0.03_wp]*block%blocks%mass(1)
      defect(4:6, d) = defect(d, 4:6)
    end do
    call set_inertia(1, block%bodies, defect)
    call check('limited: counted', block%bodies%clipped(1))
    call set_inertia(1, block%bodies, 0.01_wp*defect)
    call check('a small part is not cut', .not. block%bodies%clipped(1))
    call set_inertia(1, block%bodies, defect)
    associate (m => block%bodies%apparent(:, :, 1))
      z = matmul(m, [1.0_wp, -2.0_wp, 0.5_wp, 30.0_wp, 70.0_wp, -50.0_wp])
      call check('limited: symmetric', m - transpose(m), 0.0_wp, 1.0e-15_wp*m(1, 1))
      call check('limited: inverse', matmul(block%bodies%mobility(:, :, 1), z), &
                 [1.0_wp, -2.0_wp, 0.5_wp, 30.0_wp, 70.0_wp, -50.0_wp], 1.0e-9_wp)
      call check('limited: positive', smallest_pivot(m) > 0.0_wp)
    end associate
  end subroutine limited

  !> Smallest pivot of the elimination; a symmetric matrix is positive if it is.
  pure real(wp) function smallest_pivot(matrix)
    real(wp), intent(in) :: matrix(6, 6)
    real(wp) :: a(6, 6)
    integer :: i, p

    a = matrix
    smallest_pivot = a(1, 1)
    do p = 1, 6
      smallest_pivot = min(smallest_pivot, a(p, p))
      do i = p + 1, 6
        a(i, :) = a(i, :) - a(i, p)/a(p, p)*a(p, :)
      end do
    end do
  end function smallest_pivot

end module test_coupling_m
