!> Velocity of the middle of the step, which the transport carries.
!!
!! With the velocity of the start carried and pressure and weight added after, what a fluid element
!! gains while it is on its way is late by half a step: in front of a body in a stream, where
!! pressure turns the stream, this is a false drag of the first order in the step (a sphere without
!! viscosity, `docs/theory.md`, section 8). So before the transport the liquid gets
!! \( (\Delta t/2)(g - \nabla p/\rho) \) of the start of the step, and afterwards each cell gives
!! back the momentum it got; the velocity stage then adds the whole step.
!!
!! Only liquid away from the surface takes part: at the surface and in the gas beside it density and
!! acceleration jump, and what a cell gives back would no longer be what it got. Cells at an outflow
!! are left out, too: the pressure outside is known after the transport. Not for
!! `coupling = 'mics'`, whose pressure near blocks is that of a mixture.
module mid_step_m
  use kinds_m, only: wp
  use case_types_m, only: fluid_t
  use grid_m, only: grid_t
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use boundary_m, only: fill_velocity_halo
  use momentum_conservative_m, only: mass_through
  use face_velocity_m, only: acceleration_t, acceleration_init, face_acceleration, &
                             cell_mean_of_faces
  implicit none
  private
  public :: mid_step_t, mid_step_init, to_mid_step, from_mid_step

  real(wp), parameter :: full = 1.0_wp - 1.0e-9_wp   !! liquid share of a cell without gas [-]
  real(wp), parameter :: most_solid = 0.5_wp         !! share of a cell that takes part [-]

  type :: mid_step_t
    type(acceleration_t) :: acceleration           !! by weight and pressure, at the start
    real(wp), allocatable :: given(:, :, :, :)     !! momentum given to the cells [kg m/s]
  end type mid_step_t

contains

  !> Allocate for a grid; nothing given.
  subroutine mid_step_init(grid, self)
    type(grid_t), intent(in) :: grid
    type(mid_step_t), intent(out) :: self

    call acceleration_init(grid, self%acceleration)
    allocate (self%given, source=self%acceleration%cell)
  end subroutine mid_step_init

  !> Add half a step of weight and pressure to the velocity of the liquid, halo filled.
  subroutine to_mid_step(grid, fluid, before, after, dt, flow, self)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(solid_geometry_t), intent(in) :: before, after   !! at the start and the end of the step
    real(wp), intent(in) :: dt            !! [s]
    type(flow_t), intent(inout) :: flow   !! of the start of the step
    type(mid_step_t), intent(inout) :: self
    integer :: i, j, k, low(3), high(3)
    real(wp) :: mass

    low = merge(2, 1, flow%sides(1, :)%active)
    high = merge(grid%n - 1, grid%n, flow%sides(2, :)%active)
    associate (a => self%acceleration)
      call face_acceleration(grid, fluid%gravity, flow%rho, flow%rho, flow%p, a%face, flow%sides)
      call cell_mean_of_faces(grid, before%open, a%face, a%cell)
    end associate
    !$omp parallel do private(i, j, mass) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          if (.not. takes_part(i, j, k)) then
            self%given(i, j, k, :) = 0.0_wp
            cycle
          end if
          mass = mass_through(fluid, flow%room(i, j, k), flow%liquid(i, j, k))
          associate (a => self%acceleration%cell(i, j, k, :))
            flow%u(i, j, k, :) = flow%u(i, j, k, :) + 0.5_wp*dt*a
            self%given(i, j, k, :) = 0.5_wp*dt*mass*a
          end associate
        end do
      end do
    end do
    call fill_velocity_halo(grid, flow%u)
  contains
    !> Away from outflows, full of liquid with all cells around, at least half open from start to
    !! end.
    pure function takes_part(i, j, k) result(answer)
      integer, intent(in) :: i, j, k
      logical :: answer

      answer = max(before%alpha(i, j, k), after%alpha(i, j, k)) <= most_solid
      if (answer) answer = all([i, j, k] >= low .and. [i, j, k] <= high)
      if (answer) answer = all(flow%c(i - 1:i + 1, j - 1:j + 1, k - 1:k + 1) >= full)
    end function takes_part
  end subroutine to_mid_step

  !> After the transport: the cells give back the momentum they got, halo filled.
  subroutine from_mid_step(grid, fluid, self, flow)
    type(grid_t), intent(in) :: grid
    type(fluid_t), intent(in) :: fluid
    type(mid_step_t), intent(in) :: self
    type(flow_t), intent(inout) :: flow   !! carried
    integer :: i, j, k
    real(wp) :: mass

    !$omp parallel do private(i, j, mass) schedule(static)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          mass = mass_through(fluid, flow%room(i, j, k), flow%liquid(i, j, k))
          if (mass > 0.0_wp) flow%u(i, j, k, :) = flow%u(i, j, k, :) - self%given(i, j, k, :)/mass
        end do
      end do
    end do
    call fill_velocity_halo(grid, flow%u)
  end subroutine from_mid_step

end module mid_step_m
