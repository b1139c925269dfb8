!> Counted shares: each is the share of points that lie in the block, found without tetrahedra.
module test_subcell_m
  use check_m, only: check, wp
  use vectors_m, only: rotation_matrix, quaternion_from_axis
  use grid_m, only: unit_step
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use solid_fraction_m, only: solid_fraction_t, solid_fraction_init, update_solid
  use one_body_m, only: one_body_t, place, slip, body
  implicit none
  private
  public :: test_subcell

  character(*), parameter :: tank = '&grid cells=14,15,13 length=.07,.09,.065/ '//slip
  real(wp), parameter :: edge = 0.02_wp
  type(one_body_t) :: block
  type(solid_fraction_t) :: fraction
  type(solid_geometry_t) :: solid
  real(wp) :: error(2)

contains

  subroutine test_subcell()
    call place(tank//'&shape name="h" kind="hexapod" size=.02/ '//body('h', [0.0341_wp, &
      0.0437_wp, 0.0329_wp], q=quaternion_from_axis([1.0_wp, 2.0_wp, 3.0_wp], 0.7_wp)), block)
    call count_points(4)
    error(1) = worst_share()
    call count_points(7)
    call recount(16)
    error(2) = worst_share()
    call check('4 sub-cells: largest error of a share', error(1) > 0.01_wp .and. error(1) < 0.1_wp)
    call check('16 sub-cells: smaller error', error(2) < 0.3_wp*error(1))

    ! A box whose sides lie on the grid: exact, and closed all round.
    call place(tank//'&shape name="b" kind="box" size=.02,.018,.015/ &body shape="b" ' &
               //'position=.03,.039,.0325/', block)
    call recount(3)
    call check('box on the grid: shares', worst_share(), 0.0_wp, 1.0e-15_wp)
    call check('box on the grid: faces', solid%aperture - block%solid%aperture, 0.0_wp, 1.0e-15_wp)
    call check('box on the grid: there it is', count(solid%alpha > 0.5_wp), 4*3*3)
  end subroutine test_subcell

  !> Solids by n sub-cells per direction.
  subroutine recount(n)
    integer, intent(in) :: n
    type(solid_fraction_t) :: fresh

    fraction = fresh
    call solid_geometry_init(block%grid, solid, 1)
    call solid_fraction_init(block%grid, block%blocks, fraction, n)
    call update_solid(fraction, block%grid, block%blocks, solid)
  end subroutine recount

  !> Compare cells and faces with counts of points in the hexapod.
  subroutine count_points(n)
    integer, intent(in) :: n
    real(wp) :: share, centroid(3)
    integer :: i, j, k, d, m, low(3)

    call recount(n)
    do k = 1, 13
      do j = 1, 15
        do i = 1, 14
          call points([i, j, k], [n, n, n], 0, share, centroid)
          call check('share of a cell', solid%alpha(i, j, k), share, 1.0e-12_wp)
          do d = 1, 3
            low = [i, j, k] - unit_step(:, d)
            if (any(low < 1)) cycle
            call points([i, j, k], merge(1, n, [1, 2, 3] == d), d, share, centroid)
            if (solid%alpha(i, j, k) >= 1.0_wp) share = 1.0_wp
            if (solid%alpha(low(1), low(2), low(3)) >= 1.0_wp) share = 1.0_wp
            call check('share of a face', 1.0_wp - solid%aperture(i, j, k, d), share, 1.0e-12_wp)
          end do
        end do
      end do
    end do
    do m = 1, solid%body_cell(2) - 1
      call points(solid%cell(:, m), [n, n, n], 0, share, centroid)
      call check('centroid in a cell', solid%cell_centroid(:, m), centroid, 1.0e-12_wp)
    end do
    do m = 1, solid%body_face(2) - 1
      associate (f => solid%face(:, m))
        if (solid%face_beta(m) >= 1.0_wp) cycle
        call points(f(1:3), merge(1, n, [1, 2, 3] == f(4)), f(4), share, centroid)
        call check('centroid on a face', solid%face_centroid(:, m), centroid, 1.0e-12_wp)
      end associate
    end do
    call check('cells are full, cut and empty', any(solid%alpha >= 1.0_wp) .and. solid%n_cut > 50)
  end subroutine count_points

  !> Share and mean of the points of a cell, or of its lower face d, that lie in the hexapod.
  subroutine points(at, n, d, share, centroid)
    integer, intent(in) :: at(3), n(3), d
    real(wp), intent(out) :: share, centroid(3)
    real(wp) :: x(3), y(3), turn(3, 3)
    integer :: m, hits

    turn = rotation_matrix(block%blocks%q(:, 1))
    hits = 0
    centroid = 0.0_wp
    do m = 0, product(n) - 1
      x = (modulo(m/[1, n(1), n(1)*n(2)], n) + 0.5_wp)/n
      if (d > 0) x(d) = 0.0_wp
      x = block%grid%face(at, [1, 2, 3]) + block%grid%h*x
      y = abs(matmul(x - block%blocks%x(:, 1), turn))   ! in the axes of the body
      if (count(y <= 0.5_wp*edge) < 2 .or. maxval(y) > 1.5_wp*edge) cycle
      hits = hits + 1
      centroid = centroid + x
    end do
    share = real(hits, wp)/real(product(n), wp)
    centroid = centroid/max(hits, 1)
  end subroutine points

  !> Largest difference to the exact share of a cell.
  real(wp) function worst_share()
    worst_share = maxval(abs(solid%alpha - block%solid%alpha))
  end function worst_share

end module test_subcell_m
