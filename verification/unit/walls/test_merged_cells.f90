!> Small cells and their targets at a box, and what groups share: momentum is kept with what the
!! wall bears, a small cell moves between its target and the wall, what moves as one keeps moving as
!! one.
module test_merged_cells_m
  use check_m, only: check, wp
  use grid_m, only: n_halo, unit_step
  use merged_cells_m, only: merged_cells_t, find_merged_cells, is_unmerged, match_densities
  use merged_momentum_m, only: share_momentum, share_acceleration, follow_targets
  use rigid_motion_m, only: wall_velocity
  use one_body_m, only: one_body_t, place, random_numbers, random_field, slip
  implicit none
  private
  public :: test_merged_cells

  real(wp), parameter :: middle(3) = [0.39_wp, 0.40_wp, 0.185_wp]   !! x 0.21-0.57, y 0.22-0.58
  integer, parameter :: top = 4                                     !! open share 0.3 above the box
  real(wp), parameter :: motion(6) = [0.3_wp, -0.5_wp, 0.4_wp, 2.0_wp, -1.0_wp, 3.0_wp]
    !! of the box [m/s, rad/s]
  real(wp), parameter :: r = 0.15_wp/0.8_wp   !! middle of a top cell over its target, from the wall
  type(one_body_t) :: box
  type(merged_cells_t) :: merged
  real(wp), dimension(1 - n_halo:8 + n_halo, 1 - n_halo:8 + n_halo, 1 - n_halo:7 + n_halo, 3) :: &
    u, before
  real(wp), allocatable :: mass(:), noted(:, :), to_wall(:, :)
  real(wp) :: total(3)
  integer :: seed = 77, m

contains

  subroutine test_merged_cells()
    call place('&grid cells=8,8,7 length=.8,.8,.7/ &shape name="b" kind="box" ' &
               //'size=.36,.36,.37/ &body shape="b" position=.39,.4,.185/ '//slip, box, merged)
    box%bodies%motion(:, 1) = motion
    call find_merged_cells(box%grid, box%solid, merged)   ! from what the first time has left
    call the_targets()
    allocate (mass(merged%n), noted(3, merged%n), to_wall(3, merged%n))
    call random_numbers(seed, mass)
    mass = 2.0_wp + mass
    call the_shares()
    call the_accelerations()
    call the_rest()
    call water_under_gas()
    call closing_face()
    call narrow_cells()
  end subroutine test_merged_cells

  !> In cells half as wide in y a small cell at an edge shares by the areas of its faces.
  subroutine narrow_cells()
    real(wp) :: w(3)
    integer :: d, f(3), edges

    call place('&grid cells=8,16,7 length=.8,.8,.7/ &shape name="b" kind="box" ' &
               //'size=.36,.36,.37/ &body shape="b" position=.39,.4,.185/ '//slip, box, merged)
    edges = 0
    do m = 1, merged%n_small
      if (count(merged%share(:3, m) > 0.0_wp) < 2) cycle
      edges = edges + 1
      do d = 1, 3
        f = merged%cell(:, m) + merge(unit_step(:, d), 0, merged%normal(d, m) > 0.0_wp)
        w(d) = merge(box%solid%aperture(f(1), f(2), f(3), d)*box%grid%area(d) &
          *abs(merged%normal(d, m)), 0.0_wp, merged%share(d, m) > 0.0_wp)
      end do
      call check('shares by area', merged%share(:3, m), w/sum(w), 1.0e-12_wp)
    end do
    call check('there are edges', edges > 4)
  end subroutine narrow_cells

  !> Who belongs to whom.
  subroutine the_targets()
    call check('all know their body', all(merged%body(:merged%n) == 1))
    call check('each cell once', count(merged%number > 0) == merged%n)
    call check('small have their centre in the box', all([(centre_in_box(m), m=1, merged%n_small)]))
    call check('the top layer belongs to those above', all(target_of(4, 5, top) == [4, 5, top + 1]))
    call check('at an edge to both beside it, most to the one along the normal', &
      merged%share(:3, merged%number(4, 6, top)), [0.0_wp, 0.7_wp, 0.8_wp]/1.5_wp, 1.0e-12_wp)
    call check('no profile at an edge', merged%r(:3, merged%number(4, 6, top)), &
               spread(1.0_wp, 1, 3))
    call check('the normal of the top', merged%normal(:, merged%number(4, 5, top)), &
               [0.0_wp, 0.0_wp, 1.0_wp], 1.0e-12_wp)
    call check('the middle of a small one', merged%r(3, merged%number(4, 5, top)), r, 1.0e-12_wp)
    call check('no small is alone', .not. any([(is_unmerged(merged, m), m=1, merged%n_small)]))
    call check('the shares of a small are one', sum(merged%share(:, :merged%n_small), 1), &
               spread(1.0_wp, 1, merged%n_small), 1.0e-13_wp)
    call check('every part is in one group', merged%first(merged%n_groups + 1) - 1, &
               count(merged%target(:, :merged%n_small) > 0))
  end subroutine the_targets

  !> Momentum, profile, and a fluid that moves with the box.
  subroutine the_shares()
    merged%slip = 1.0_wp
    call random_field(seed, u)
    total = momentum(u)
    call share()
    call check('the momentum is kept', momentum(u), total, 1.0e-11_wp*sum(mass))
    call check('with free slip the wall bears nothing', to_wall, 0.0_wp, 1.0e-14_wp*sum(mass))
    call check('across the wall a small lies between wall and target', u(4, 5, top, 3), &
               r*u(4, 5, top + 1, 3) + (1.0_wp - r)*wall(4, 5, 3), 1.0e-12_wp)
    call check('with slip all move alike', u(4, 5, top, 1:2), u(4, 5, top + 1, 1:2), 1.0e-12_wp)
    merged%slip = 0.25_wp/(0.25_wp + 0.75_wp*r)   ! 0.25 at the small cell
    call random_field(seed, u)
    total = momentum(u)
    before = u
    call share()
    call check('with a layer it is kept', momentum(u) + sum(to_wall, 2), total, &
               1.0e-11_wp*sum(mass))
    call the_lever(before(4, 5, top, :), before(4, 5, top + 1, :))
    call check('along the wall a small has more of the velocity of its target', u(4, 5, top, 1:2), &
               [(wall(4, 5, m) + (r + (1.0_wp - r)*0.25_wp)*(u(4, 5, top + 1, m) - wall(4, 5, m)), &
                 m=1, 2)], 1.0e-12_wp)
    before = u
    call share()
    call check('sharing twice is sharing once', u - before, 0.0_wp, 1.0e-11_wp)
    box%bodies%motion(4:6, 1) = 0.0_wp
    do m = 1, 3
      u(:, :, :, m) = motion(m)
    end do
    call share()
    do m = 1, 3
      u(:, :, :, m) = u(:, :, :, m) - motion(m)
    end do
    call check('what moves with the box goes on so', u, 0.0_wp, 1.0e-13_wp)
    box%bodies%motion(:, 1) = motion
  end subroutine the_shares

  !> A small cell of the top and its only target: along the wall it has a share t of the target's
  !! velocity and gives it the share t of what it has too much.
  subroutine the_lever(small, target)
    real(wp), intent(in) :: small(3), target(3)   !! velocities before [m/s]
    real(wp), parameter :: t = r + (1.0_wp - r)*0.25_wp
    real(wp) :: excess, change
    integer :: f, d

    f = merged%number(4, 5, top)
    associate (m_small => mass(f), m => mass(merged%target(3, f)))
      do d = 1, 2
        excess = small(d) - wall(4, 5, d) - t*(target(d) - wall(4, 5, d))
        change = t*m_small*excess/(m + t**2*m_small)
        call check('the end of the target', u(4, 5, top + 1, d), target(d) + change, 1.0e-12_wp)
        call check('the wall the other one', to_wall(d, f), &
                   (1.0_wp - t)*m_small*(excess - t*change), 1.0e-12_wp)
      end do
      excess = small(3) - wall(4, 5, 3) - r*(target(3) - wall(4, 5, 3))
      call check('across the wall the target gets all', u(4, 5, top + 1, 3), &
                 target(3) + m_small*excess/(m + r*m_small), 1.0e-12_wp)
    end associate
  end subroutine the_lever

  subroutine report()
    do m = 1, merged%n
      associate (c => merged%cell(:, m))
        noted(:, m) = u(c(1), c(2), c(3), :)
      end associate
    end do
    to_wall = 0.0_wp
  end subroutine report

  subroutine share()
    call report()
    call share_momentum(box%grid, merged, mass, box%bodies, noted, u, to_wall)
  end subroutine share

  !> The mean by the mass that the faces move.
  subroutine the_accelerations()
    real(wp) :: w

    box%flow%rho(4, 5, top) = 3.0_wp
    box%flow%rho(4, 5, top + 1) = 1.0_wp
    call random_field(seed, u)
    before = u
    call share_acceleration(box%grid, box%solid%aperture, box%flow%rho, merged, u)
    w = 3.0_wp*0.5_wp   ! its lower face is closed
    call check('up: the small counts half', u(4, 5, top, 3), &
               (w*before(4, 5, top, 3) + before(4, 5, top + 1, 3))/(w + 1.0_wp), 1.0e-13_wp)
    w = 3.0_wp*0.3_wp
    call check('along the wall by its open share', u(4, 5, top, 1), &
               (w*before(4, 5, top, 1) + before(4, 5, top + 1, 1))/(w + 1.0_wp), 1.0e-13_wp)
    call check('the target likewise', u(4, 5, top + 1, :), u(4, 5, top, :))
    call check('others keep theirs', u(1, 1, :, :) - before(1, 1, :, :), 0.0_wp)
    box%flow%rho = box%case%fluid%liquid_density
  end subroutine the_accelerations

  !> Small cells follow what their targets do, along the wall and across it by their share there.
  subroutine the_rest()
    real(wp) :: t
    integer :: small, n
    real(wp), parameter :: change(3) = [1.0_wp, 2.0_wp, 3.0_wp]

    small = merged%number(4, 5, top)
    t = r + (1.0_wp - r)*0.25_wp
    call random_field(seed, u)
    call report()
    before = u
    u(4, 5, top + 1, :) = u(4, 5, top + 1, :) + change
    u(4, 5, top, :) = 99.0_wp
    call follow_targets(box%grid, merged, mass, noted, u, to_wall)
    call check('small as targets', u(4, 5, top, :) - before(4, 5, top, :), t*change, 1.0e-14_wp)
    call check('others do not', u(5, 5, top, :) - before(5, 5, top, :), 0.0_wp, 1.0e-14_wp)
    n = merged%target(3, small)
    call check('targets, small and wall have what the merged viscous mass has', &
               mass(small)*t*change + to_wall(:, small), mass(small)*t**2*change, 1.0e-13_wp)
    call check('a target of one small', count(merged%target(:, :merged%n_small) == n), 1)
  end subroutine the_rest

  !> What water in a small cell does does not throw about the gas beside it: without the densities
  !! the gas gets 1/r = 5.3 times the velocity of the water. In one phase the profile is kept.
  subroutine water_under_gas()
    real(wp), parameter :: ratio(3) = [1.0_wp, 10.0_wp, 5000.0_wp]
    integer :: small, target, n

    small = merged%number(4, 5, top)
    target = merged%target(3, small)
    box%bodies%motion = 0.0_wp
    do n = 1, size(ratio)
      box%flow%rho = 1.0_wp
      box%flow%rho(4, 5, top) = ratio(n)
      mass(:merged%n) = 1.0e-3_wp
      mass(small) = 0.3e-3_wp*ratio(n)
      call match_densities(box%grid, box%flow%rho, merged)
      u = 0.0_wp
      u(4, 5, top, 3) = 1.0_wp
      total = momentum(u)
      call share()
      call check('a light target moves no faster than the water did', &
                 u(4, 5, top + 1, 3) > 0.0_wp .and. u(4, 5, top + 1, 3) <= 1.0_wp)
      call check('the momentum of water and gas is kept', momentum(u), total, 1.0e-15_wp)
      if (n == 1) call check('one phase keeps the profile of the wall', &
                             u(4, 5, top, 3)/u(4, 5, top + 1, 3), r, 1.0e-13_wp)
    end do
    box%bodies%motion(:, 1) = motion
    box%flow%rho = box%case%fluid%liquid_density
  end subroutine water_under_gas

  !> The share of a target goes with the open part of the face to it.
  subroutine closing_face()
    associate (small => merged%number(4, 6, top))
      box%solid%aperture(4, 7, top, 2) = 0.5_wp
      box%solid%poses = 0   ! another geometry
      call find_merged_cells(box%grid, box%solid, merged)
      call check('shares close with the face', merged%share(:3, small), &
                 [0.0_wp, 0.5_wp*0.2_wp, 0.8_wp]/0.9_wp, 1.0e-12_wp)
    end associate
  end subroutine closing_face

  logical function centre_in_box(m)
    integer, intent(in) :: m

    associate (c => merged%cell(:, m))
      centre_in_box = box%solid%inside(c(1), c(2), c(3)) == 1
    end associate
  end function centre_in_box

  !> Cell of the target above small cell i, j, k.
  function target_of(i, j, k) result(c)
    integer, intent(in) :: i, j, k
    integer :: c(3)

    c = merged%cell(:, merged%target(3, merged%number(i, j, k)))
  end function target_of

  !> Momentum of the wall cells [kg m/s].
  function momentum(u) result(p)
    real(wp), intent(in) :: u(1 - n_halo:, 1 - n_halo:, 1 - n_halo:, :)
    real(wp) :: p(3)
    integer :: n

    p = 0.0_wp
    do n = 1, merged%n
      associate (c => merged%cell(:, n))
        p = p + mass(n)*u(c(1), c(2), c(3), :)
      end associate
    end do
  end function momentum

  !> Component d of the velocity of the box at the centre of a cell of the top layer [m/s].
  function wall(i, j, d) result(velocity)
    integer, intent(in) :: i, j, d
    real(wp) :: velocity, v(3)

    v = wall_velocity(motion, 0.1_wp*([i, j, top] - 0.5_wp) - middle)
    velocity = v(d)
  end function wall

end module test_merged_cells_m
