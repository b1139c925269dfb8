!> The old pressure, carried along with the bodies before it acts.
!!
!! Around a body that moves through the grid the pressure moves with it. What the last step has left
!! is the pressure of the middle of that step, and it acts in this one, half before and half after
!! the transport, as the pressure of its middle: where the body was a step ago. The pressure stage
!! makes good what that lacks, but on the surface of the end and after the transport only, and this
!! is a false drag of second order in the step, with large factors since pressure falls off steeply
!! around a body. A body held in a stream has none of it. So the old pressure is taken from where
!! the way w of the body in this step leads back to, \( \tilde p(x) = p(x - w) \), which before a
!! body is nearer to it or in it: there the pressure of the fluid is continued by its slope. No
!! guess of the pressure is wrong, since the pressure stage solves for what it lacks.
module advected_pressure_m
  use kinds_m, only: wp
  use vectors_m, only: norm
  use grid_m, only: grid_t
  use rigid_motion_m, only: rigid_motion_t, wall_velocity
  use rigid_flux_m, only: arm_to_cell
  use face_velocity_m, only: acceleration_t
  use boundary_m, only: fill_scalar_halo
  implicit none
  private
  public :: advect_pressure

  real(wp), parameter :: far = 1.5_wp
    !! radii of a body from its centre, where nothing moves with it (docs/decisions/time_step.md)
  real(wp), parameter :: longest = 1.0_wp   !! way in a step, more is not carried [cells]

contains

  !> Carry the pressure of the liquid, less that of its weight at rest, by the way of the bodies in
  !! a step; halo filled.
  subroutine advect_pressure(grid, weight, alpha, bodies, dt, a, p)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: weight(3)            !! of the liquid, rho g [N/m3]
    real(wp), intent(in), contiguous :: alpha(grid%first(1):, grid%first(2):, grid%first(3):)
      !! solid share, at the start of the step
    type(rigid_motion_t), intent(in) :: bodies   !! likewise
    real(wp), intent(in) :: dt                   !! [s]
    type(acceleration_t), intent(inout) :: a
      !! its cells `given` in liquid take part; the rest is room for what is found here
    real(wp), intent(inout), contiguous :: p(grid%first(1):, grid%first(2):, grid%first(3):)
      !! halo filled [Pa]
    integer :: k

    if (.not. any(abs(bodies%motion) > 0.0_wp)) return
    ! A plane of `a%face` is free for the change once its way is known.
    !$omp parallel do schedule(dynamic)
    do k = grid%lo(3), grid%hi(3)
      call find_way(grid, bodies, dt, k, a%face(:, :, :, 1), a%cell)
      call find_change(grid, weight, alpha, p, k, a)
    end do
    !$omp parallel do schedule(static)
    do k = grid%lo(3), grid%hi(3)
      p(:, :, k) = p(:, :, k) + a%face(:, :, k, 1)
    end do
    call fill_scalar_halo(grid, p, layers=1)
  end subroutine advect_pressure

  !> Way of the pressure in plane k: that of the bodies around, each by how near it is.
  subroutine find_way(grid, bodies, dt, k, near, way)
    type(grid_t), intent(in) :: grid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in) :: dt   !! [s]
    integer, intent(in) :: k
    real(wp), intent(inout), contiguous :: near(grid%first(1):, grid%first(2):, grid%first(3):)
      !! 1 within the radius of a body, 0 far from all [-]
    real(wp), intent(inout), contiguous :: way(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [cells]
    real(wp) :: arm(3), share
    integer :: b, d, i, j, a(3), z(3)

    near(:, :, k) = 0.0_wp
    way(:, :, k, :) = 0.0_wp
    do b = 1, bodies%n
      if (.not. bodies%present(b)) cycle
      ! Own cells that hold a ball; in a direction in which it passes the end of a period, all.
      do d = 1, 3
        a(d) = grid%cell_of(bodies%x(d, b) - far*bodies%radius(b), d)
        z(d) = grid%cell_of(bodies%x(d, b) + far*bodies%radius(b), d)
        if (.not. grid%periodic(d) .or. (a(d) >= 1 .and. z(d) <= grid%n(d))) cycle
        a(d) = 1
        z(d) = grid%n(d)
      end do
      a = max(a, grid%lo)
      z = min(z, grid%hi)
      if (k < a(3) .or. k > z(3)) cycle
      do j = a(2), z(2)
        do i = a(1), z(1)
          arm = arm_to_cell(grid, [i, j, k], bodies%x(:, b))
          share = min(1.0_wp, (far - norm(arm)/bodies%radius(b))/(far - 1.0_wp))
          if (share <= 0.0_wp) cycle
          near(i, j, k) = near(i, j, k) + share
          way(i, j, k, :) = way(i, j, k, :) &
                            + share*dt*wall_velocity(bodies%motion(:, b), arm)/grid%h
        end do
      end do
    end do
    do d = 1, 3
      way(:, :, k, d) = way(:, :, k, d)/max(1.0_wp, near(:, :, k))
      way(:, :, k, d) = max(-longest, min(longest, way(:, :, k, d)))
    end do
  end subroutine find_way

  !> What the pressure in plane k changes by, `a%face(:, :, k, 1)` [Pa], to second order in the way
  !! `a%cell` [cells]; beside a cell without
  !! fluid by the slope on the other side. At the sides of the tank it has no slope but by weight,
  !! as beside a plane wall.
  pure subroutine find_change(grid, weight, alpha, p, k, a)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: weight(3)   !! [N/m3]
    real(wp), intent(in), contiguous :: alpha(grid%first(1):, grid%first(2):, grid%first(3):)
    real(wp), intent(in), contiguous :: p(grid%first(1):, grid%first(2):, grid%first(3):)
    integer, intent(in) :: k
    type(acceleration_t), intent(inout) :: a
    real(wp) :: up(3), down(3), twist(3)   !! differences to the cells around [Pa]
    integer :: i, j

    a%face(:, :, k, 1) = 0.0_wp
    do j = grid%lo(2), grid%hi(2)
      do i = grid%lo(1), grid%hi(1)
        if (.not. a%kicked(i, j, k)) cycle
        if (.not. any(abs(a%cell(i, j, k, :)) > 0.0_wp)) cycle
        associate (q => p(i - 1:i + 1, j - 1:j + 1, k - 1:k + 1), w => a%cell(i, j, k, :))
          up = [q(3, 2, 2), q(2, 3, 2), q(2, 2, 3)] - q(2, 2, 2) - weight*grid%h
          down = q(2, 2, 2) - [q(1, 2, 2), q(2, 1, 2), q(2, 2, 1)] - weight*grid%h
          where ([i, j, k] == grid%n .and. .not. grid%periodic) up = 0.0_wp
          where ([i, j, k] == 1 .and. .not. grid%periodic) down = 0.0_wp
          twist = 0.25_wp*[(q(2, 3, 3) - q(2, 1, 3)) - (q(2, 3, 1) - q(2, 1, 1)), &
                           (q(3, 2, 3) - q(1, 2, 3)) - (q(3, 2, 1) - q(1, 2, 1)), &
                           (q(3, 3, 2) - q(1, 3, 2)) - (q(3, 1, 2) - q(1, 1, 2))]
          if (any(alpha(i - 1:i + 1, j - 1:j + 1, k - 1:k + 1) >= 1.0_wp)) then
            where ([alpha(i + 1, j, k), alpha(i, j + 1, k), alpha(i, j, k + 1)] >= 1.0_wp) up = down
            where ([alpha(i - 1, j, k), alpha(i, j - 1, k), alpha(i, j, k - 1)] >= 1.0_wp) down = up
            twist = 0.0_wp
          end if
          a%face(i, j, k, 1) = 0.5_wp*sum(w**2*(up - down)) - 0.5_wp*sum(w*(up + down)) &
            + w(2)*w(3)*twist(1) + w(3)*w(1)*twist(2) + w(1)*w(2)*twist(3)
        end associate
      end do
    end do
  end subroutine find_change

end module advected_pressure_m
