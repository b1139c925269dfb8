!> Faces beside a moving box: how long their Rhie-Chow acceleration counts, and that what is normal
!! to the wall goes linearly from the velocity of the cell to that of the wall.
module test_face_velocity_m
  use check_m, only: check, wp
  use grid_m, only: n_halo, unit_step
  use boundary_m, only: fill_velocity_halo
  use face_velocity_m, only: acceleration_t, acceleration_init, predict_face_velocity
  use wall_faces_m, only: face_velocity_at_walls, shorten_at_walls
  use merged_cells_m, only: merged_cells_t
  use rigid_motion_m, only: rigid_motion_t, wall_velocity
  use one_body_m, only: one_body_t, place, random_field, slip
  implicit none
  private
  public :: test_face_velocity

  integer, parameter :: cells(3) = [8, 8, 9]                         !! of 0.1 m
  real(wp), parameter :: middle(3) = [0.39_wp, 0.40_wp, 0.43_wp]     !! x from 0.21 to 0.57
  real(wp), parameter :: motion(6) = [0.3_wp, -0.5_wp, 0.4_wp, 2.0_wp, -1.0_wp, 3.0_wp]
    !! of the box [m/s, rad/s]
  real(wp), parameter :: stream(3) = [0.6_wp, -0.3_wp, 0.2_wp]       !! [m/s]
  real(wp), parameter :: dt = 0.02_wp, nu = 0.01_wp                  !! [s], [m2/s]
  real(wp), parameter :: last(6) = [0.1_wp, -0.2_wp, 0.3_wp, -1.0_wp, 0.5_wp, 2.0_wp]
    !! of the box when the step began [m/s, rad/s]
  real(wp), parameter :: tolerance = 1.0e-13_wp
  type(one_body_t) :: box
  type(merged_cells_t) :: merged
  type(acceleration_t) :: a
  real(wp), dimension(1 - n_halo:cells(1) + n_halo, 1 - n_halo:cells(2) + n_halo, &
                      1 - n_halo:cells(3) + n_halo, 3) :: before, none = 0.0_wp
  integer :: seed = 13, j, k, d

contains

  subroutine test_face_velocity()
    call place('&grid cells=8,8,9 length=.8,.8,.9/ &shape name="b" kind="box" size=.36,.36,.37/ ' &
               //'&body shape="b" position=.39,.4,.43/ '//slip, box, merged)
    box%bodies%motion(:, 1) = motion
    box%flow%mu = nu*box%flow%rho
    call acceleration_init(box%grid, a)
    call random_field(seed, a%face)
    call random_field(seed, a%cell)
    do d = 1, 3
      box%flow%u(:, :, :, d) = stream(d)
    end do
    call fill_velocity_halo(box%grid, box%flow%u)
    a%kicked = .true.
    a%in_liquid = .true.
    call short_times()
    call normal_to_the_wall()
    call next_to_gas()
    call between_gas()
    call along_the_wall()
  end subroutine test_face_velocity

  !> Faces of cells at walls, each once, in liquid only.
  subroutine short_times()
    integer :: i

    a%in_liquid(7, 4, 5) = .false.
    call predict_face_velocity(box%grid, dt, box%flow%rho, a, box%flow)
    before = box%flow%uf
    call shorten_at_walls(box%grid, dt, box%bodies, merged, box%flow%rho, a, box%flow)
    do d = 1, 3
      do k = 2, cells(3)
        do j = 2, cells(2)
          do i = 2, cells(1)
            call check('face for the time of its Courant number', box%flow%uf(i, j, k, d), &
              merge(shortened([i, j, k], d), before(i, j, k, d), at_wall([i, j, k], d)), tolerance)
          end do
        end do
      end do
    end do
    call check('some change', maxval(abs(box%flow%uf - before)) > 1.0e-3_wp)
    a%in_liquid = .true.
  end subroutine short_times

  !> Does a cell beside the lower face of cell f belong to a wall, both in liquid?
  logical function at_wall(f, d)
    integer, intent(in) :: f(3), d

    associate (low => f - unit_step(:, d))
      at_wall = max(merged%number(f(1), f(2), f(3)), merged%number(low(1), low(2), low(3))) > 0 &
        .and. a%in_liquid(f(1), f(2), f(3)) .and. a%in_liquid(low(1), low(2), low(3))
    end associate
  end function at_wall

  !> Its velocity with the time in which the flow past the wall goes an eighth of a cell [m/s].
  real(wp) function shortened(f, d)
    integer, intent(in) :: f(3), d
    integer :: low(3)

    low = f - unit_step(:, d)
    shortened = stream(d) + time(0.05_wp*(low + f - 1.0_wp))*(a%face(f(1), f(2), f(3), d) &
      - 0.5_wp*(a%cell(low(1), low(2), low(3), d) + a%cell(f(1), f(2), f(3), d)))
  end function shortened

  !> dt' of the stream past the wall at x [s].
  real(wp) function time(x)
    real(wp), intent(in) :: x(3)   !! [m]

    time = min(dt, 0.125_wp*0.1_wp/sum(abs(stream - wall_velocity(motion, x - middle))))
    time = time/(1.0_wp + 2.0_wp*nu*time*3.0_wp/0.1_wp**2)
  end function time

  !> The wall 0.8 cells below the centre of a cell, and 0.6 cells above that of another.
  subroutine normal_to_the_wall()
    real(wp) :: x(3)

    call at_walls()
    x = [0.57_wp, 0.35_wp, 0.45_wp]
    call check('face above a wall', box%flow%uf(7, 4, 5, 1), between(x, 0.3_wp/0.8_wp) &
               + time(x)*(a%face(7, 4, 5, 1) - a%cell(7, 4, 5, 1)), tolerance)
    x(1) = 0.21_wp
    call check('face below a wall', box%flow%uf(3, 4, 5, 1), between(x, 0.1_wp/0.6_wp) &
               + time(x)*(a%face(3, 4, 5, 1) - a%cell(2, 4, 5, 1)), tolerance)
  end subroutine normal_to_the_wall

  !> Next to gas the old pressure, which `flow%u` has in it, acts on the face as a whole, and the
  !! wall is that of the start of the step: whatever the cell got of it is of no account.
  subroutine next_to_gas()
    real(wp), parameter :: share = 0.3_wp/0.8_wp   !! of the cell's distance from the wall
    real(wp), parameter :: x(3) = [0.57_wp, 0.35_wp, 0.45_wp]
    real(wp) :: wall(3), expected

    a%in_liquid(7, 4, 5) = .false.
    wall = wall_velocity(last, x - middle)
    expected = wall(1) + share*(stream(1) - wall(1)) + dt*a%face(7, 4, 5, 1)
    a%cell(7, 4, 5, :) = 1.0e3_wp*a%cell(7, 4, 5, :)
    box%flow%u(7, 4, 5, :) = stream + dt*a%cell(7, 4, 5, :)
    call at_walls()
    call check('next to gas: by the face alone', box%flow%uf(7, 4, 5, 1), expected, 1.0e-11_wp)
    a%kicked(7, 4, 5) = .false.
    box%flow%u(7, 4, 5, :) = stream
    call at_walls()
    call check('next to gas: not given yet', box%flow%uf(7, 4, 5, 1), expected, 1.0e-11_wp)
    a%kicked(7, 4, 5) = .true.
    box%flow%u(7, 4, 5, :) = stream
    a%in_liquid(7, 4, 5) = .true.
  end subroutine next_to_gas

  !> Away from walls: a face with gas on one side depends on what its cells have without the old
  !! acceleration, and on the whole of its own; whether they have been given theirs tells nothing.
  subroutine between_gas()
    integer, parameter :: f(3) = [8, 2, 2]
    real(wp) :: expected

    a%in_liquid(f(1), f(2), f(3)) = .false.
    expected = stream(1) + dt*a%face(f(1), f(2), f(3), 1)
    box%flow%u(8, 2, 2, :) = stream + dt*a%cell(8, 2, 2, :)
    box%flow%u(7, 2, 2, :) = stream + dt*a%cell(7, 2, 2, :)
    call predict_face_velocity(box%grid, dt, box%flow%rho, a, box%flow, none)
    call check('beside gas: given', box%flow%uf(8, 2, 2, 1), expected, tolerance)
    a%kicked(8, 2, 2) = .false.
    box%flow%u(8, 2, 2, :) = stream
    call predict_face_velocity(box%grid, dt, box%flow%rho, a, box%flow, none)
    call check('beside gas: not yet given', box%flow%uf(8, 2, 2, 1), expected, tolerance)
    a%in_liquid(f(1), f(2), f(3)) = .true.
    a%kicked(8, 2, 2) = .true.
    box%flow%u(7, 2, 2, :) = stream
  end subroutine between_gas

  !> The box as it moved when the step began.
  type(rigid_motion_t) function at_start()
    at_start = box%bodies
    at_start%motion(:, 1) = last
  end function at_start

  !> At an edge of the box at rest, taken for a plane wall: with a line to the wall the velocity of
  !! a face comes from the same component of the cell, with free slip the wall turns the rest of it.
  !! As far as it is an edge, the face has what it had.
  subroutine along_the_wall()
    real(wp), parameter :: share = 0.3_wp/0.8_wp   !! of the cell's distance from the wall

    a%face = 0.0_wp
    a%cell = 0.0_wp
    box%bodies%motion = 0.0_wp
    merged%slip = 0.0_wp
    call check('the box has edges', box%solid%edge(box%solid%cut(6, 6, 5)), 1.0_wp)
    box%flow%uf(7, 6, 5, 1) = 5.0_wp
    call at_walls()
    call check('at an edge', box%flow%uf(7, 6, 5, 1), 5.0_wp)
    box%solid%edge = 0.75_wp
    call at_walls()
    call check('three quarters of an edge', box%flow%uf(7, 6, 5, 1), &
               0.75_wp*5.0_wp + 0.25_wp*share*stream(1), tolerance)
    box%solid%edge = 0.0_wp
    call at_walls()
    call check('a line to the wall', box%flow%uf(7, 6, 5, 1), share*stream(1), tolerance)
    call check('a face partly open', box%flow%uf(6, 4, 7, 3), &
      0.5_wp*0.3_wp*1.15_wp/(0.35_wp*0.7_wp)*stream(3), tolerance)
    merged%slip = 0.25_wp
    call at_walls()
    associate (n => [0.8_wp, 0.7_wp, 0.0_wp]/norm2([0.8_wp, 0.7_wp]), s => share/(share + 3.0_wp))
      call check('a layer along the wall', box%flow%uf(7, 6, 5, 1), share*stream(1) &
                 + s*(1.0_wp - share)*(stream(1) - n(1)*dot_product(n, stream)), tolerance)
    end associate
  end subroutine along_the_wall

  subroutine at_walls()
    call face_velocity_at_walls(box%grid, box%solid, at_start(), box%bodies, merged, dt, &
                                .false., box%flow%rho, a, box%flow)
  end subroutine at_walls

  !> Velocity in x at a share of the way from the wall at x to the cell [m/s].
  real(wp) function between(x, share)
    real(wp), intent(in) :: x(3), share
    real(wp) :: wall(3)

    wall = wall_velocity(motion, x - middle)
    between = share*stream(1) + (1.0_wp - share)*wall(1)
  end function between

end module test_face_velocity_m
