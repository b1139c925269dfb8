!> Acceleration and velocity of the faces, and what the cells take of them.
module face_velocity_m
  use kinds_m, only: wp
  use grid_m, only: grid_t, unit_step
  use fields_m, only: flow_t
  use boundary_kinds_m, only: gives_pressure
  use boundary_m, only: set_side_velocity
  use outflow_m, only: outflow_t, side_distance, pressure_outside, mean_velocity
  use mixture_m, only: face_mean
  implicit none
  private
  public :: acceleration_t, acceleration_init, face_acceleration, push_faces, cell_mean_of_faces
  public :: predict_face_velocity, rhie_chow_time, face_step

  real(wp), parameter :: rhie_chow_courant = 0.125_wp   !! Courant number up to dt

  !> Acceleration of the fluid by weight, pressure and surface tension.
  type :: acceleration_t
    real(wp), allocatable :: face(:, :, :, :)   !! of the lower faces, along their normal [m/s2]
    real(wp), allocatable :: cell(:, :, :, :)   !! mean of the two faces of each direction [m/s2]
    logical, allocatable :: kicked(:, :, :)
      !! cells that have it in their velocity before the faces: all cells around them were full of
      !! liquid at the start of the step (`half_kick_m`)
    logical, allocatable :: in_liquid(:, :, :)  !! those of them that are so at its end, too
  end type acceleration_t

contains

  !> Allocate for a grid; none yet.
  subroutine acceleration_init(grid, self)
    type(grid_t), intent(in) :: grid
    type(acceleration_t), intent(out) :: self
    integer :: a(3), b(3)

    a = grid%first
    b = grid%last
    allocate (self%face(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
    allocate (self%cell, source=self%face)
    allocate (self%kicked(a(1):b(1), a(2):b(2), a(3):b(3)), source=.false.)
    allocate (self%in_liquid, source=self%kicked)
  end subroutine acceleration_init

  !> Acceleration at the faces: a_f = (rho_w,f g - (p_high - p_low)/h)/rho_f [m/s2].
  !!
  !! Gravity, pressure gradient and density live at the same face, so still water stays still. The
  !! density rho_w that has weight is the fluid's; rho is it too, or that of the mixture. Zero on
  !! walls and inflows; on an open side p = 0 half a cell away. Outside an outflow (`sides`) lies
  !! what `outflow_m` says: its pressure comes from weight, so it counts only with gravity, and a
  !! pressure correction sees none.
  subroutine face_acceleration(grid, gravity, rho_w, rho, p, a, sides)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in), dimension(grid%first(1):, grid%first(2):, grid%first(3):), &
      contiguous :: rho_w, rho           !! [kg/m3]
    real(wp), intent(in), contiguous :: p(grid%first(1):, grid%first(2):, grid%first(3):)
      !! [Pa], halo filled
    real(wp), intent(inout), contiguous :: a(grid%first(1):, grid%first(2):, grid%first(3):, :)
    type(outflow_t), intent(in), optional :: sides(2, 3)
    integer :: i, j, k, d, e(3)
    logical :: heavy

    heavy = any(abs(gravity) > 0.0_wp)
    do d = 1, 3
      e = unit_step(:, d)
      !$omp parallel do private(i, j) schedule(static)
      do k = grid%lo(3), grid%hi(3) + e(3)
        do j = grid%lo(2), grid%hi(2) + e(2)
          do i = grid%lo(1), grid%hi(1) + e(1)
            a(i, j, k, d) = &
              (face_mean(rho_w(i - e(1), j - e(2), k - e(3)), rho_w(i, j, k))*gravity(d) &
               - (p(i, j, k) - p(i - e(1), j - e(2), k - e(3)))/grid%h(d)) &
              /face_mean(rho(i - e(1), j - e(2), k - e(3)), rho(i, j, k))
          end do
        end do
      end do
      call sides_of_direction()
    end do
  contains
    subroutine sides_of_direction()
      integer :: s, lower(3), upper(3), c(3)
      real(wp) :: outward, outside, length

      do s = 1, 2
        call grid%side_faces(s, d, lower, upper)
        outward = merge(-1.0_wp, 1.0_wp, s == 1)
        do k = lower(3), upper(3)
          do j = lower(2), upper(2)
            do i = lower(1), upper(1)
              c = [i, j, k] - merge(0, 1, s == 1)*e
              a(i, j, k, d) = 0.0_wp
              if (.not. gives_pressure(grid%side(s, d))) cycle
              outside = 0.0_wp
              if (heavy .and. present(sides)) outside = pressure_outside(sides(s, d), c)
              length = side_distance(grid, s, d, c, rho(c(1), c(2), c(3)), sides)
              a(i, j, k, d) = (rho_w(c(1), c(2), c(3))*gravity(d)*0.5_wp*grid%h(d) &
                + outward*(p(c(1), c(2), c(3)) - outside))/(length*rho(c(1), c(2), c(3)))
            end do
          end do
        end do
      end do
    end subroutine sides_of_direction
  end subroutine face_acceleration

  !> Add to the velocity of the faces what a pressure correction gives them in dt:
  !! u_f += -dt (phi_high - phi_low)/(h rho_f) [m/s], by `face_acceleration` without weight.
  subroutine push_faces(grid, dt, rho, phi, sides, uf)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: dt   !! [s]
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! that of the system [kg/m3]
    real(wp), intent(in), contiguous :: phi(grid%lo(1) - 1:, grid%lo(2) - 1:, grid%lo(3) - 1:)
      !! [Pa], halo of other processes and periods filled
    type(outflow_t), intent(in) :: sides(2, 3)
    real(wp), intent(inout), contiguous :: uf(grid%first(1):, grid%first(2):, grid%first(3):, :)
    integer :: i, j, k, d, e(3), low(3), high(3)

    do d = 1, 3
      e = unit_step(:, d)
      low = grid%lo
      high = grid%hi + e
      if (.not. grid%periodic(d)) then
        if (grid%at_side(1, d)) low = low + e
        if (grid%at_side(2, d)) high = high - e
        call push_sides()
      end if
      !$omp parallel do private(i, j) schedule(static)
      do k = low(3), high(3)
        do j = low(2), high(2)
          do i = low(1), high(1)
            uf(i, j, k, d) = uf(i, j, k, d) &
              - dt*((phi(i, j, k) - phi(i - e(1), j - e(2), k - e(3)))/grid%h(d) &
                    /face_mean(rho(i - e(1), j - e(2), k - e(3)), rho(i, j, k)))
          end do
        end do
      end do
    end do
  contains
    !> Sides where the pressure is given; the correction is zero there.
    subroutine push_sides()
      integer :: s, lower(3), upper(3), c(3)
      real(wp) :: outward

      do s = 1, 2
        if (.not. gives_pressure(grid%side(s, d))) cycle
        call grid%side_faces(s, d, lower, upper)
        outward = merge(-1.0_wp, 1.0_wp, s == 1)
        do k = lower(3), upper(3)
          do j = lower(2), upper(2)
            do i = lower(1), upper(1)
              c = [i, j, k] - merge(0, 1, s == 1)*e
              uf(i, j, k, d) = uf(i, j, k, d) + dt*(outward*phi(c(1), c(2), c(3)) &
                /(side_distance(grid, s, d, c, rho(c(1), c(2), c(3)), sides)*rho(c(1), c(2), c(3))))
            end do
          end do
        end do
      end do
    end subroutine push_sides
  end subroutine push_faces

  !> Cell vector from a face vector: mean of the two faces of each direction by their open shares.
  subroutine cell_mean_of_faces(grid, aperture, a_face, a_cell)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: aperture(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(in), contiguous :: a_face(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(inout), contiguous :: a_cell(grid%first(1):, grid%first(2):, grid%first(3):, :)
    integer :: i, j, k, d, e(3)
    real(wp) :: w_low, w_high

    do d = 1, 3
      e = unit_step(:, d)
      !$omp parallel do private(i, j, w_low, w_high) schedule(static)
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            w_low = aperture(i, j, k, d)
            w_high = aperture(i + e(1), j + e(2), k + e(3), d)
            a_cell(i, j, k, d) = (w_low*a_face(i, j, k, d) &
                                  + w_high*a_face(i + e(1), j + e(2), k + e(3), d)) &
                                 /max(w_low + w_high, tiny(1.0_wp))
          end do
        end do
      end do
    end do
  end subroutine cell_mean_of_faces

  !> Face velocity before the pressure stage, interpolated from the cells:
  !! $$ u_f = \overline{u} + \Delta t' (a_f - \overline{a}), \quad \Delta t' = \Delta t/(1 + 2 \nu
  !! \Delta t \sum_d h_d^{-2}) $$
  !!
  !! The compact face acceleration takes the place of the interpolated one; dt' instead of dt keeps
  !! the steady drag right when viscosity is strong (measured: error 9 % down to 1 %).
  !!
  !! `correction` is what a face at the surface differed from its cells before
  !! (`old_time_correction_m`). It fades with viscosity like the rest that the cells do not see.
  !!
  !! At sides with a given pressure it is the cell's; at an outflow the part of the length
  !! `side_distance` beyond half a cell has the mean velocity of the side. This drag is an
  !! acceleration of the face that `a_face` does not hold, so half of it goes to the cell, too.
  subroutine predict_face_velocity(grid, dt, rho, a, flow, correction)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: dt   !! [s]
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
      !! that of the system [kg/m3]
    type(acceleration_t), intent(in) :: a   !! halo of cells filled
    type(flow_t), intent(inout) :: flow   !! halo of u filled
    real(wp), intent(in), contiguous, optional :: &
      correction(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s]; absent: all cells have their acceleration in `flow%u`, beside gas, too
    integer :: i, j, k, d, s, lower(3), upper(3), f(3)

    do d = 1, 3
      call interpolate(grid, dt, d, rho, a, flow)
      if (present(correction)) then
        call interpolate_beside_gas(grid, dt, d, a, flow)
        call add_correction(grid, dt, d, rho, correction, flow)
      end if
      call sides_of_direction()
    end do
    call set_side_velocity(grid, flow%uf)
    do d = 1, 3
      ! Cells beside an outflow take half of what the face gained by the drag of the side.
      do s = 1, 2
        if (.not. flow%sides(s, d)%active) cycle
        call grid%side_cells(s, d, lower, upper)
        do k = lower(3), upper(3)
          do j = lower(2), upper(2)
            do i = lower(1), upper(1)
              f = [i, j, k] + merge(0, 1, s == 1)*unit_step(:, d)
              flow%u(i, j, k, d) = flow%u(i, j, k, d) + 0.5_wp*(flow%uf(f(1), f(2), f(3), d) &
                - dt*a%face(f(1), f(2), f(3), d) - without_acceleration([i, j, k]))
            end do
          end do
        end do
      end do
    end do
  contains
    !> Sides with a given pressure: the velocity of the last cell.
    subroutine sides_of_direction()
      integer :: s, lower(3), upper(3), c(3)
      real(wp) :: share, mean

      do s = 1, 2
        if (.not. gives_pressure(grid%side(s, d))) cycle
        call grid%side_faces(s, d, lower, upper)
        do k = lower(3), upper(3)
          do j = lower(2), upper(2)
            do i = lower(1), upper(1)
              c = [i, j, k] - merge(0, 1, s == 1)*unit_step(:, d)
              share = 0.5_wp*grid%h(d)/side_distance(grid, s, d, c, rho(c(1), c(2), c(3)), &
                flow%sides)
              mean = merge(-1.0_wp, 1.0_wp, s == 1)*mean_velocity(flow%sides(s, d), c)
              flow%uf(i, j, k, d) = share*without_acceleration(c) + (1.0_wp - share)*mean &
                + dt*a%face(i, j, k, d)
            end do
          end do
        end do
      end do
    end subroutine sides_of_direction

    !> Velocity of a cell in direction d without its acceleration of this step [m/s].
    pure function without_acceleration(c) result(u)
      integer, intent(in) :: c(3)
      real(wp) :: u

      u = flow%u(c(1), c(2), c(3), d)
      if (present(correction) .and. .not. a%kicked(c(1), c(2), c(3))) return
      u = u - dt*a%cell(c(1), c(2), c(3), d)
    end function without_acceleration
  end subroutine predict_face_velocity

  !> Velocity of the lower faces in direction d.
  subroutine interpolate(grid, dt, d, rho, a, flow)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: dt
    integer, intent(in) :: d
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
    type(acceleration_t), intent(in) :: a
    type(flow_t), intent(inout) :: flow
    integer :: i, j, k, e(3)
    real(wp) :: nu

    e = unit_step(:, d)
    !$omp parallel do private(i, j, nu) schedule(static)
    do k = grid%lo(3), grid%hi(3) + e(3)
      do j = grid%lo(2), grid%hi(2) + e(2)
        !$omp simd private(nu)
        do i = grid%lo(1), grid%hi(1) + e(1)
          associate (p => i - e(1), q => j - e(2), r => k - e(3))
            nu = face_mean(flow%mu(p, q, r), flow%mu(i, j, k)) &
                 /face_mean(rho(p, q, r), rho(i, j, k))
            flow%uf(i, j, k, d) = face_mean(flow%u(p, q, r, d), flow%u(i, j, k, d)) &
              + face_step(dt, nu, grid%inverse_h2)*(a%face(i, j, k, d) &
                  - face_mean(a%cell(p, q, r, d), a%cell(i, j, k, d)))
          end associate
        end do
      end do
    end do
  end subroutine interpolate

  !> Velocity of the lower faces in direction d between cells of which one is at or in gas: whatever
  !! the cells have of the old pressure is taken from them, and the face gets it as a whole,
  !! $$ u_f = \overline{u - \Delta t\, a} + \Delta t\, a_f $$
  subroutine interpolate_beside_gas(grid, dt, d, a, flow)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: dt
    integer, intent(in) :: d
    type(acceleration_t), intent(in) :: a
    type(flow_t), intent(inout) :: flow
    integer :: i, j, k, e(3)
    real(wp) :: low, high

    e = unit_step(:, d)
    !$omp parallel do private(i, j, low, high) schedule(static)
    do k = grid%lo(3), grid%hi(3) + e(3)
      do j = grid%lo(2), grid%hi(2) + e(2)
        do i = grid%lo(1), grid%hi(1) + e(1)
          associate (p => i - e(1), q => j - e(2), r => k - e(3))
            if (a%in_liquid(p, q, r) .and. a%in_liquid(i, j, k)) cycle
            low = flow%u(p, q, r, d) - merge(dt, 0.0_wp, a%kicked(p, q, r))*a%cell(p, q, r, d)
            high = flow%u(i, j, k, d) - merge(dt, 0.0_wp, a%kicked(i, j, k))*a%cell(i, j, k, d)
            flow%uf(i, j, k, d) = face_mean(low, high) + dt*a%face(i, j, k, d)
          end associate
        end do
      end do
    end do
  end subroutine interpolate_beside_gas

  !> Add what the faces in direction d differed from their cells.
  subroutine add_correction(grid, dt, d, rho, correction, flow)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: dt
    integer, intent(in) :: d
    real(wp), intent(in), contiguous :: rho(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(in), contiguous :: &
      correction(grid%first(1):, grid%first(2):, grid%first(3):, :)
    type(flow_t), intent(inout) :: flow
    integer :: i, j, k, e(3)
    real(wp) :: nu, most

    e = unit_step(:, d)
    !$omp parallel do private(i, j, nu, most) schedule(static)
    do k = grid%lo(3), grid%hi(3) + e(3)
      do j = grid%lo(2), grid%hi(2) + e(2)
        most = 0.0_wp
        !$omp simd reduction(max: most)
        do i = grid%lo(1), grid%hi(1) + e(1)
          most = max(most, abs(correction(i, j, k, d)))
        end do
        if (most <= 0.0_wp) cycle
        !$omp simd private(nu)
        do i = grid%lo(1), grid%hi(1) + e(1)
          nu = face_mean(flow%mu(i - e(1), j - e(2), k - e(3)), flow%mu(i, j, k)) &
               /face_mean(rho(i - e(1), j - e(2), k - e(3)), rho(i, j, k))
          flow%uf(i, j, k, d) = flow%uf(i, j, k, d) &
            + face_step(dt, nu, grid%inverse_h2)/dt*correction(i, j, k, d)
        end do
      end do
    end do
  end subroutine add_correction

  !> Longest time for which the Rhie-Chow acceleration of a face counts [s].
  !!
  !! The term is a viscosity for pressure: it takes the energy dt' sum m (a_f^2 - mean(a)^2) per
  !! time, which beside a body is a drag of the first order in the step; without it short steps
  !! break up (docs/decisions/cut_cells.md).
  elemental function rhie_chow_time(dt, courant) result(time)
    real(wp), intent(in) :: dt        !! [s]
    real(wp), intent(in) :: courant   !! largest Courant number of the step [-]
    real(wp) :: time

    time = dt*min(1.0_wp, rhie_chow_courant/max(courant, rhie_chow_courant))
  end function rhie_chow_time

  !> Time for which the Rhie-Chow acceleration of a face counts: dt' = dt/(1 + 2 nu dt sum 1/h^2)
  !! [s].
  elemental function face_step(dt, nu, inverse_h2) result(step)
    real(wp), intent(in) :: dt      !! [s]
    real(wp), intent(in) :: nu      !! kinematic viscosity [m2/s]
    real(wp), intent(in) :: inverse_h2   !! sum of 1/h**2 [1/m2]
    real(wp) :: step

    step = dt/(1.0_wp + 2.0_wp*nu*dt*inverse_h2)
  end function face_step

end module face_velocity_m
