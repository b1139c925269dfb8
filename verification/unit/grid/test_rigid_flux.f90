!> Unit fluxes of a block through the faces: sections, balance of cells, forces of pressure fields.
module test_rigid_flux_m
  use check_m, only: check, wp
  use vectors_m, only: cross, quaternion_from_axis
  use grid_m, only: n_halo, unit_step
  use rigid_flux_m, only: rigid_flux_t, rigid_flux_init, build_rigid_flux, solid_face_flux, &
    force_from_faces, force_from_cells, add_cell_flux, nearest_arm, middle_of_face
  use one_body_m, only: one_body_t, place, random_numbers, sides, body
  implicit none
  private
  public :: test_rigid_flux

  character(*), parameter :: closed = 'slip slip slip slip slip slip', &
    periodic = 'periodic periodic periodic periodic slip open'
  integer, parameter :: cells(3) = [12, 10, 8]
  real(wp), parameter :: edges(3) = [0.083_wp, 0.061_wp, 0.077_wp] !! of the box [m]
  real(wp), parameter :: middle(3) = [0.1223_wp, 0.0719_wp, 0.0831_wp]
  type(one_body_t) :: box
  type(rigid_flux_t) :: flux
  logical :: active(1 - n_halo:12 + n_halo, 1 - n_halo:10 + n_halo, 1 - n_halo:8 + n_halo)
  integer :: seed = 20231

contains

  subroutine test_rigid_flux()
    call sections_of_a_box()
    call linear_pressure()
    call cells_and_faces()
    call box_across_periods()
    call box_at_the_sides()
  end subroutine test_rigid_flux

  !> A block in a tank; fluid can move in all cells that are not full.
  subroutine build(around, position, turned)
    character(*), intent(in) :: around   !! kinds of the sides
    real(wp), intent(in) :: position(3)
    logical, intent(in) :: turned

    call place('&grid cells=12,10,8 length=.24,.15,.16/ &shape name="b" kind="box" ' &
      //'size=.083,.061,.077/ '//sides(around)//body('b', position, q=quaternion_from_axis( &
      [1.0_wp, 2.0_wp, -1.0_wp], merge(0.6_wp, 0.0_wp, turned))), box)
    active(:, :, :) = box%solid%alpha < 1.0_wp
    call rigid_flux_init(1, flux)
    call build_rigid_flux(box%grid, box%solid, box%bodies, active, flux)
  end subroutine build

  !> Each grid plane through the box carries its section, and the section's moment.
  subroutine sections_of_a_box()
    real(wp) :: total(6), area, arm(3), expected(6)
    integer :: d, i, m, planes

    call build(closed, middle, .false.)
    planes = 0
    do d = 1, 3
      area = product(edges)/edges(d)
      do i = 1, cells(d) + 1
        total = 0.0_wp
        do m = 1, box%solid%body_face(2) - 1
          if (all(box%solid%face([4, d], m) == [d, i])) total = total + flux%s(:, m)
        end do
        arm = (box%grid%face(i, d) - middle(d))*unit_step(:, d)
        expected = 0.0_wp
        if (abs(arm(d)) <= 0.5_wp*edges(d)) then
          planes = planes + 1
          expected = area*[real(unit_step(:, d), wp), cross(arm, real(unit_step(:, d), wp))]
        end if
        call check('unit fluxes of a plane', total, expected, 1.0e-16_wp)
      end do
    end do
    call check('planes that cut the box', planes, 12)
  end subroutine sections_of_a_box

  !> Pressure a.x + b pushes by minus its gradient times the volume that the faces measure.
  subroutine linear_pressure()
    real(wp), parameter :: gradient(3) = [300.0_wp, -170.0_wp, 911.0_wp]   !! [Pa/m]
    real(wp) :: force(6, 1), expected(6), volume(3), solid_volume(3), part, x(3)
    integer :: i, j, k, m, n, d

    call build(closed, middle, .true.)
    do concurrent (k=1:cells(3), j=1:cells(2), i=1:cells(1))
      box%flow%p(i, j, k) = 50.0_wp + dot_product(gradient, box%grid%centre([i, j, k], [1, 2, 3]))
    end do
    call force_from_faces(box%grid, box%bodies, flux, box%flow%p, force)
    expected = 0.0_wp
    volume = 0.0_wp
    n = box%solid%body_face(2) - 1
    do m = 1, n + box%solid%first_held(2) - 1
      if (m <= n) then
        d = box%solid%face(4, m)
        part = box%grid%volume*box%solid%face_beta(m)
        x = box%solid%face_centroid(:, m)
      else
        d = box%solid%held_face(4, m - n)
        part = box%grid%volume*box%solid%held_share(m - n)
        x = middle_of_face(box%grid, box%solid%held_face(:, m - n))
      end if
      volume(d) = volume(d) + part
      if (m == n) solid_volume = volume
      expected(4:6) = expected(4:6) - part*cross(x - middle, gradient(d)*unit_step(:, d))
    end do
    expected(1:3) = -gradient*volume
    call check('some fluid is held', box%solid%first_held(2) > 10)
    call check('linear pressure: force', force(1:3, 1), expected(1:3), 1.0e-12_wp)
    call check('linear pressure: torque', force(4:6, 1), expected(4:6), 1.0e-13_wp)
    call check('volume by faces is near the volume', &
               maxval(abs(solid_volume/product(edges) - 1.0_wp)) < 0.03_wp)
  end subroutine linear_pressure

  !> Net fluxes of cells, the transposed product, and the force by cells against that by faces.
  subroutine cells_and_faces()
    real(wp), allocatable :: rate(:, :, :, :), net(:, :, :), phi(:, :, :)
    real(wp) :: force(6, 1), by_faces(6, 1), motion(6, 1), row(cells(1)), work(2), outflow
    integer :: i, j, k, lower(3)

    call build(closed, middle, .true.)
    call random_numbers(seed, motion(:, 1))
    box%bodies%motion = motion
    allocate (rate, source=box%flow%uf)
    allocate (net, phi, source=box%flow%p)
    lower = lbound(net)
    call solid_face_flux(box%grid, box%bodies, flux, rate, held=.true.)
    call add_cell_flux(box%bodies, flux, motion, lower, net)
    work = 0.0_wp
    do k = 1, cells(3)
      do j = 1, cells(2)
        call random_numbers(seed, row)
        do i = 1, cells(1)
          if (.not. active(i, j, k)) cycle
          phi(i, j, k) = row(i)
          outflow = rate(i + 1, j, k, 1) - rate(i, j, k, 1) + rate(i, j + 1, k, 2) &
                    - rate(i, j, k, 2) + rate(i, j, k + 1, 3) - rate(i, j, k, 3)
          call check('net flux of a cell is the balance of its faces', net(i, j, k), outflow, &
            1.0e-17_wp)
          work(1) = work(1) + net(i, j, k)*phi(i, j, k)
        end do
      end do
    end do
    call check('some cells are full', count(.not. active(1:12, 1:10, 1:8)) > 10)
    call force_from_cells(box%bodies, flux, phi, lower, force)
    work(2) = dot_product(motion(:, 1), force(:, 1))
    call check('power of the pressure by cells and by motions', work(2), work(1), 1.0e-16_wp)
    call force_from_faces(box%grid, box%bodies, flux, phi, by_faces)
    call check('force by cells as by faces', force(:, 1), by_faces(:, 1), 1.0e-16_wp)
    call check('there is a force', all(abs(force(:, 1)) > 1.0e-8_wp))

    box%bodies%free = .false.
    net = 0.0_wp
    call add_cell_flux(box%bodies, flux, motion, lower, net)
    call check('a held body answers to nothing', all(abs(net) <= 0.0_wp))
    call force_from_cells(box%bodies, flux, phi, lower, force)
    call check('a held body is given no force', all(abs(force) <= 0.0_wp))
  end subroutine cells_and_faces

  !> A block across the corner of two periods has the fluxes of one in the middle.
  subroutine box_across_periods()
    real(wp) :: total(6, 2), shift(3)
    integer :: m

    shift = [6, 5, 0]*box%grid%h
    call build(periodic, middle, .true.)
    total(:, 1) = signed_sum()
    m = count(flux%mine(1:box%solid%body_face(2) - 1))
    call build(periodic, middle + shift, .true.)
    total(:, 2) = signed_sum()
    call check('across periods: faces', count(flux%mine(1:box%solid%body_face(2) - 1)), m)
    call check('across periods: fluxes', total(:, 2), total(:, 1), 1.0e-16_wp)
    call check('across periods: nearest image', nearest_arm(box%grid, [0.23_wp, 0.14_wp, 0.1_wp], &
      [0.01_wp, 0.01_wp, 0.0_wp]), [-0.02_wp, -0.02_wp, 0.1_wp], 1.0e-16_wp)
  end subroutine box_across_periods

  !> Sum of the unit fluxes through own faces.
  function signed_sum() result(total)
    real(wp) :: total(6)
    integer :: m

    total = 0.0_wp
    do m = 1, box%solid%body_face(2) - 1
      if (flux%mine(m)) total = total + flux%s(:, m)
    end do
  end function signed_sum

  !> Through a wall nothing is pushed; outside an open side the pressure is zero.
  subroutine box_at_the_sides()
    real(wp) :: force(6, 1), area, pushed
    integer :: m, n

    area = product(edges(1:2))
    call build(closed, [middle(1), middle(2), 0.02_wp], .false.)
    n = 0
    pushed = 0.0_wp
    do m = 1, box%solid%body_face(2) - 1
      if (box%solid%face(4, m) /= 3 .or. box%solid%face(3, m) /= 1) cycle
      n = n + 1
      pushed = max(pushed, maxval(abs(flux%s(:, m))))
    end do
    call check('the box covers part of the wall', n > 0)
    call check('nothing is pushed through a wall', pushed, 0.0_wp)

    call build(periodic, [middle(1), middle(2), 0.14_wp], .false.)
    box%flow%p = 7.0_wp
    call force_from_faces(box%grid, box%bodies, flux, box%flow%p, force)
    call check('through an open top: uniform pressure lifts the section', force(1:3, 1), &
               [0.0_wp, 0.0_wp, 7.0_wp*area], 1.0e-15_wp)
  end subroutine box_at_the_sides

end module test_rigid_flux_m
