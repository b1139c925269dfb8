!> Bodies in the grid: volumes, shares by cut tetrahedra, degenerate poses, links, pockets, periods.
module test_solid_fraction_m
  use check_m, only: check, wp, pi
  use errors_m, only: to_text
  use case_text_m, only: shape_of
  use vectors_m, only: normalised, quaternion_from_axis, quaternion_product, rotation_matrix
  use random_counter_m, only: uniform, random_rotation
  use box_solid_m, only: simple_grid
  use boundary_kinds_m, only: side_no_slip, side_open, side_periodic
  use grid_m, only: grid_t, n_halo, unit_step
  use polyhedron_m, only: polyhedron_t, polyhedron_of_tet, cut_polyhedron_by_box, polyhedron_moments
  use polyhedron_sections_m, only: polyhedron_section
  use rigid_body_m, only: blocks_t
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use links_on_grid_m, only: links_t, links_on_grid
  use solid_fraction_m, only: solid_fraction_t, solid_fraction_init, update_solid
  use cut_tets_m, only: faces_of_tet
  implicit none
  private
  public :: test_solid_fraction

  real(wp), parameter :: d = 0.02_wp   !! cube edge of the hexapod [m]
  real(wp), parameter :: identity(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
  type(grid_t) :: grid
  type(blocks_t) :: blocks
  type(solid_geometry_t) :: solid
  integer :: n_drawn = 0

contains

  subroutine test_solid_fraction()
    call random_poses('hexapod', [60, 20, 40], 100)
    call random_poses('hexapod', [60, 10, 25], 100)
    call random_poses('cylinder', [60, 20, 40], 40)
    call random_poses('tetrapod', [60, 20, 40], 40)
    call random_poses('dolos', [60, 20, 40], 40)
    call random_poses('reef_cube', [60, 20, 40], 40)
    call faces_look_outward()
    call against_tetrahedra()
    call faces_on_grid_planes()
    call both_sides_alike()
    call degenerate_poses()
    call three_links_on_the_floor()
    call links_of_a_box()
    call partly_outside()
    call bodies_in_contact()
    call sealed_pocket()
    call periods()
    call filled_if_moved()
  end subroutine test_solid_fraction

  !> Repeatable number in 0..1.
  real(wp) function draw()
    n_drawn = n_drawn + 1
    draw = uniform(4712, 1, n_drawn)
  end function draw

  function draw_attitude() result(q)
    real(wp) :: q(4)

    n_drawn = n_drawn + 1
    q = random_rotation(4712, n_drawn)
  end function draw_attitude

  !> The grid, with walls all round.
  subroutine tank(n, length)
    integer, intent(in) :: n(3)
    real(wp), intent(in) :: length(3)   !! [m]
    type(grid_t) :: fresh

    grid = fresh
    call simple_grid(n, length, grid)
    grid%side = side_no_slip
  end subroutine tank

  !> Bodies of one shape, all present; upright if not told otherwise.
  subroutine put(kind, size, x, q)
    character(*), intent(in) :: kind
    real(wp), intent(in) :: size(:), x(:)        !! [m], 3 for each body [m]
    real(wp), intent(in), optional :: q(4)       !! attitude
    type(blocks_t) :: fresh

    blocks = fresh
    blocks%n = ubound(x, 1)/3
    blocks%shapes = [shape_of('kind="'//kind//'" size='//to_text(size))]
    blocks%shape = spread(1, 1, blocks%n)
    blocks%present = spread(.true., 1, blocks%n)
    blocks%x = reshape(x, [3, blocks%n])
    blocks%q = spread(identity, 2, blocks%n)
    if (present(q)) blocks%q(:, 1) = q
  end subroutine put

  subroutine fill()
    call fill_other(solid)
  end subroutine fill

  subroutine fill_other(other)
    type(solid_geometry_t), intent(out) :: other
    type(solid_fraction_t) :: fraction

    call solid_geometry_init(grid, other, blocks%n)
    call solid_fraction_init(grid, blocks, fraction)
    call update_solid(fraction, grid, blocks, other)
  end subroutine fill_other

  !> Shares times cell volumes give the volume and the centroid, in one object moved many times.
  subroutine random_poses(kind, n, poses)
    character(*), intent(in) :: kind
    integer, intent(in) :: n(3), poses
    real(wp), parameter :: length(3) = [0.3_wp, 0.1_wp, 0.2_wp]
    type(solid_fraction_t) :: fraction
    real(wp) :: worst(3, 2), centroid(3), x   ! 2: aligned, with sides moved onto planes
    integer :: p, m, k

    call tank(n, length)
    call put(kind, [merge(d, 2*d, kind == 'hexapod'), spread(2*d, 1, merge(1, 0, kind &
      == 'cylinder'))], 0.5_wp*length)
    call solid_geometry_init(grid, solid, 1)
    call solid_fraction_init(grid, blocks, fraction)
    worst = 0.0_wp
    do p = 1, poses
      blocks%x(:, 1) = 0.5_wp*length + (0.5_wp*length - 0.04_wp)*(2*[draw(), draw(), draw()] - 1)
      if (mod(p, 4) == 0) blocks%x(:, 1) = grid%h*anint(blocks%x(:, 1)/grid%h)
      blocks%q(:, 1) = draw_attitude()
      if (mod(p, 8) == 0) blocks%q(:, 1) = quarter_turns(p/8)
      if (mod(p, 4) == 2) then   ! a corner alone next to a plane
        associate (r => rotation_matrix(blocks%q(:, 1)), point => blocks%shapes(1)%point(:, 1))
          x = (blocks%x(1, 1) + dot_product(r(1, :), point))/grid%h(1)
        end associate
        blocks%x(1, 1) = blocks%x(1, 1) + (anint(x) + 5.0e-6_wp - x)*grid%h(1)
      end if
      call update_solid(fraction, grid, blocks, solid)
      associate (whole => blocks%shapes(1)%volume, last => solid%body_cell(2) - 1)
        centroid = 0.0_wp
        do m = 1, last
          centroid = centroid + solid%cell_alpha(m)*(solid%cell_centroid(:, m) - blocks%x(:, 1))
        end do
        k = merge(2, 1, mod(p, 8) == 0)
        worst(:, k) = max(worst(:, k), [abs(sum(solid%alpha)*grid%volume/whole - 1.0_wp), &
          maxval(abs(centroid))*grid%volume/(whole*d), &
          abs(sum(solid%cell_alpha(:last))*grid%volume/whole - 1.0_wp)])
      end associate
    end do
    call check(kind//': shares add up to the volume', worst([1, 3], 1), 0.0_wp, 1e-12_wp)
    call check(kind//': centroids add up to the centroid', worst(2, 1), 0.0_wp, 1e-12_wp)
    call check(kind//': with sides moved onto planes', worst(:, 2), 0.0_wp, 1e-6_wp)
  end subroutine random_poses

  !> One of the attitudes that turn the axes into each other, with the round-off of real numbers.
  function quarter_turns(m) result(q)
    integer, intent(in) :: m
    real(wp) :: q(4)
    real(wp), parameter :: axis(3, 3) = real(unit_step, wp)

    q = quaternion_product(quaternion_from_axis(axis(:, 1), real(mod(m, 4), wp)*pi/2), &
      quaternion_from_axis(axis(:, 3), real(mod(m/4, 4), wp)*pi/2))
  end function quarter_turns

  !> Corners lie on the inner side of all faces, also of a tetrahedron turned inside out.
  subroutine faces_look_outward()
    real(wp), parameter :: corner(3, 4) = 0.1_wp*reshape([1, 2, 0, 14, 1, 3, 2, 11, 2, 3, 4, 17], &
      [3, 4])
    real(wp) :: n(3, 4), d(4), x(3, 4)
    integer :: s, f

    do s = 1, 2
      x = corner
      if (s == 2) x = corner(:, [2, 1, 3, 4])
      call faces_of_tet(x, n, d)
      call check('the middle is inside', all(matmul(sum(x, 2)/4, n) < d))
      call check('corners are on the faces', all(matmul(transpose(x), n) <= spread(d, 1, 4)))
      call check('a mirrored corner is outside', all([(dot_product(2*(sum(x, 2) - x(:, f))/3 &
        - x(:, f), n(:, f)) > d(f), f=1, 4)]))
    end do
  end subroutine faces_look_outward

  !> Every cell and face against the sum of the clipped tetrahedra of the fine mesh.
  subroutine against_tetrahedra()
    real(wp) :: worst(4)
    integer :: p

    call tank([14, 16, 18], [0.07_wp, 0.08_wp, 0.081_wp])
    worst = 0.0_wp
    do p = 1, 4
      call put(trim(merge('sphere ', 'hexapod', p == 4)), [merge(0.05_wp, d, p == 4)], &
        [0.035_wp, 0.04_wp, 0.04_wp])
      if (p > 1) blocks%q(:, 1) = draw_attitude()
      if (p > 2) blocks%x(:, 1) = blocks%x(:, 1) + 0.005_wp*[draw(), draw(), draw()]
      call fill()
      call compare_with_tets(worst)
    end do
    call check('shares of cells as by the tetrahedra', worst(1), 0.0_wp, 1e-14_wp)
    call check('centroids of cells, shares and centroids of faces', worst(2:), 0.0_wp, 1e-13_wp)
  end subroutine against_tetrahedra

  !> Largest differences of shares, first moments, face shares, face moments (in cells).
  subroutine compare_with_tets(worst)
    real(wp), intent(inout) :: worst(4)
    real(wp), allocatable :: cell(:, :, :, :), face(:, :, :, :, :, :)
    real(wp) :: r(3, 3), corner(3, 4), v, moment(3), area, x(3), low(3)
    type(polyhedron_t) :: p
    integer :: t, i, j, k, e, m, side, from(3), to(3)

    associate (n => grid%n, s => blocks%shapes(1))
      allocate (cell(4, n(1), n(2), n(3)), source=0.0_wp)
      allocate (face(4, n(1), n(2), n(3), 3, 2), source=0.0_wp)
      r = rotation_matrix(blocks%q(:, 1))
      do t = 1, size(s%tet, 2)
        corner = (spread(blocks%x(:, 1), 2, 4) + matmul(r, s%point(:, s%tet(:, t)))) &
          /spread(grid%h, 2, 4)   ! in cells
        where (abs(corner - anint(corner)) < 1e-12_wp) corner = anint(corner)
        from = max(floor(minval(corner, 2)) + 1, 1)
        to = min(floor(maxval(corner, 2)) + 1, n)
        do k = from(3), to(3)
          do j = from(2), to(2)
            do i = from(1), to(1)
              low = real([i, j, k] - 1, wp)
              call polyhedron_of_tet(corner, p)
              call cut_polyhedron_by_box(p, low, low + 1)
              call polyhedron_moments(p, v, moment)
              cell(:, i, j, k) = cell(:, i, j, k) + [v, moment - v*low]
              do e = 1, 3
                do side = 1, 2
                  call face_of_tet(corner, low, e, real(3 - 2*side, wp), area, x)
                  face(:, i, j, k, e, side) = face(:, i, j, k, e, side) + area*[1.0_wp, x - low]
                end do
              end do
            end do
          end do
        end do
      end do
      worst(1) = max(worst(1), maxval(abs(solid%alpha(1:n(1), 1:n(2), 1:n(3)) - cell(1, :, :, :))))
      worst(3) = max(worst(3), maxval(abs(1 - solid%aperture(1:n(1), 1:n(2), 1:n(3), :) &
        - maxval(face(1, :, :, :, :, :), 5))))
      do m = 1, solid%body_cell(2) - 1
        associate (c => solid%cell(:, m))
          if (any(c < 1 .or. c > n)) cycle
          x = solid%cell_centroid(:, m)/grid%h - (c - 1)
          worst(2) = max(worst(2), maxval(abs(solid%cell_alpha(m)*x - cell(2:4, c(1), c(2), c(3)))))
        end associate
      end do
      do m = 1, solid%body_face(2) - 1
        associate (c => solid%face(:, m))
          if (any(c(1:3) < 1 .or. c(1:3) > n)) cycle
          side = maxloc(face(1, c(1), c(2), c(3), c(4), :), 1)
          x = solid%face_centroid(:, m)/grid%h - (c(1:3) - 1)
          worst(4) = max(worst(4), maxval(abs(solid%face_beta(m)*x &
            - face(2:4, c(1), c(2), c(3), c(4), side))))
        end associate
      end do
    end associate
  end subroutine compare_with_tets

  !> Section of a tetrahedron with the lower face e of a unit cell, just above it (side = 1) or just
  !! below it (side = -1): the tetrahedron is first cut to the column of the face.
  subroutine face_of_tet(corner, low, e, side, area, x)
    real(wp), intent(in) :: corner(3, 4), low(3), side
    integer, intent(in) :: e
    real(wp), intent(out) :: area, x(3)
    type(polyhedron_t) :: p
    real(wp) :: from(3), to(3)

    from = low
    to = low + 1
    from(e) = -1e3_wp
    to(e) = 1e3_wp
    call polyhedron_of_tet(corner, p)
    call cut_polyhedron_by_box(p, from, to)
    call polyhedron_section(p, side*real(unit_step(:, e), wp), side*low(e), area, x)
  end subroutine face_of_tet

  !> All axis-parallel poses on the grid: whole cells, whole faces, nothing cut, everything closed.
  subroutine faces_on_grid_planes()
    integer :: p, e, a(3), b(3)

    call tank([20, 20, 40], [0.1_wp, 0.1_wp, 0.2_wp])
    do p = 0, 15
      call put('hexapod', [d], [0.05_wp, 0.05_wp, 0.16_wp], quarter_turns(p))
      call fill()
      call check('on grid planes: cells are full or empty', sum(solid%alpha), 7*64.0_wp)
      call check('on grid planes: none is cut', solid%n_cut, 0)
      call check('on grid planes: all with the centre inside', &
        all([solid%body_cell(2) - 1, count(solid%inside == 1)] == 448))
      ! Along each direction one bar of 12 and four of 4 cells, 4 x 4 wide.
      call check('on grid planes: faces', solid%body_face(2) - 1, 3*(16*13 + 4*16*5))
      call check('on grid planes: by the body', solid%face_beta(:solid%body_face(2) - 1), 1.0_wp)
      do e = 1, 3
        a = 1 - unit_step(:, e)
        b = grid%n - unit_step(:, e)
        call check('on grid planes: all faces of full cells are closed, no other', &
          solid%aperture(1:20, 1:20, 1:40, e) - merge(0.0_wp, 1.0_wp, 0.5_wp < &
          max(solid%alpha(1:20, 1:20, 1:40), solid%alpha(a(1):b(1), a(2):b(2), a(3):b(3)))), 0.0_wp)
      end do
    end do
  end subroutine faces_on_grid_planes

  !> A cube with its sides on planes of the grid or of centres, a little to the left or right of
  !! them: the same cells are inside, the same faces open, the same links end at it on either side.
  subroutine both_sides_alike()
    real(wp), parameter :: edges(2) = [0.04_wp, 0.035_wp]   !! in cells of 5 mm
    real(wp), parameter :: little(3) = [0.0_wp, 3.0e-6_wp, -3.0e-6_wp]   !! [cells]
    integer :: e, m, i

    call tank([20, 20, 20], [0.1_wp, 0.1_wp, 0.1_wp])
    do e = 1, 2
      do m = 1, 3
        call put('cube', edges(e:e), [0.05_wp + 0.005_wp*little(m), 0.05_wp, 0.05_wp])
        call fill()
        do i = 1, 20
          associate (w => solid%aperture, n => solid%link_number)
            call check('both sides alike: centres inside', &
              all(solid%inside(i, 1:20, 1:20) == solid%inside(21 - i, 1:20, 1:20)))
            call check('both sides alike: open faces', &
              w(i, 1:20, 1:20, 1) - w(22 - i, 1:20, 1:20, 1), 0.0_wp)
            call check('both sides alike: links', &
              all((n(i, 1:20, 1:20, 1) > 0) .eqv. (n(22 - i, 1:20, 1:20, 1) > 0)))
          end associate
        end do
      end do
    end do
  end subroutine both_sides_alike

  !> Corners, edges and sides on grid planes and cell centres, or nearly: volume, open and solid
  !! share of each face, a hit on every link between inside and outside.
  subroutine degenerate_poses()
    real(wp), parameter :: angle(8) = [pi*[0.0_wp, 0.25_wp, 0.5_wp, 0.75_wp, 1.0_wp, 0.2_wp], &
      pi/6, atan(sqrt(0.5_wp))]
    real(wp), parameter :: shift(8) = [0.0_wp, 0.5_wp, 0.25_wp, 1e-13_wp, -1e-12_wp, 1e-10_wp, &
      1.0_wp/3, -1e-7_wp]
    real(wp) :: q(4), x(3)
    integer :: p, i

    call tank([16, 16, 16], [0.08_wp, 0.08_wp, 0.08_wp])
    do p = 1, 90
      q = identity
      do i = 1, 3
        q = quaternion_product(quaternion_from_axis(real(unit_step(:, 1 + int(3*draw())), wp), &
          angle(1 + int(8*draw()))), q)
        x(i) = 0.005_wp*(8 + shift(1 + int(8*draw())))
      end do
      select case (mod(p, 3))
      case (0); call put('hexapod', [d], x, q)
      case (1); call put('box', [0.02_wp, 0.03_wp, 0.0075_wp], x, q)
      case default; call put('sphere', [0.04_wp], x, q)
      end select
      call fill()
      ! Sides within 1e-5 of a cell of a plane are put on it: at most that times area h/volume.
      call check('degenerate: volume', sum(solid%alpha)*grid%volume/blocks%shapes(1)%volume, &
        1.0_wp, 1e-5_wp)
      call check('degenerate: open and solid share fill each face', largest_gap(), 0.0_wp, 1e-14_wp)
      call check('degenerate: links to the inside without a hit', links_without_hit(), 0)
      associate (w => solid%aperture)
        call check('degenerate: full cells are closed', all(solid%alpha(1:16, 1:16, 1:16) < 1 &
          .or. sum(w(1:16, 1:16, 1:16, :), 4) + w(2:17, 1:16, 1:16, 1) &
          + w(1:16, 2:17, 1:16, 2) + w(1:16, 1:16, 2:17, 3) <= 0))
      end associate
    end do
  end subroutine degenerate_poses

  !> Largest |1 - open - sum of the shares of the bodies| of a face.
  real(wp) function largest_gap()
    real(wp), allocatable :: rest(:, :, :, :)
    integer :: m

    allocate (rest, source=solid%aperture)
    do m = 1, solid%body_face(size(solid%body_face)) - 1
      associate (f => solid%face(:, m))
        rest(f(1), f(2), f(3), f(4)) = rest(f(1), f(2), f(3), f(4)) + solid%face_beta(m)
      end associate
    end do
    largest_gap = maxval(abs(rest - 1))
  end function largest_gap

  integer function links_without_hit()
    integer :: m, a(3), b(3)

    links_without_hit = 0
    do m = 1, 3
      a = 2 - unit_step(:, m)
      b = grid%n - unit_step(:, m)
      links_without_hit = links_without_hit + count(solid%link_number(2:16, 2:16, 2:16, m) <= 0 &
        .and. solid%inside(2:16, 2:16, 2:16) /= solid%inside(a(1):b(1), a(2):b(2), a(3):b(3)))
    end do
  end function links_without_hit

  !> Cells with fluid and no open face.
  integer function sealed_cells()
    associate (w => solid%aperture, n => grid%n)
      sealed_cells = count(solid%alpha(1:n(1), 1:n(2), 1:n(3)) < 1.0_wp &
        .and. sum(w(1:n(1), 1:n(2), 1:n(3), :), 4) + w(2:n(1) + 1, 1:n(2), 1:n(3), 1) &
        + w(1:n(1), 2:n(2) + 1, 1:n(3), 2) + w(1:n(1), 1:n(2), 2:n(3) + 1, 3) <= 0.0_wp)
    end associate
  end function sealed_cells

  !> The pose of the fixed blocks: three corners on the floor, nothing below it.
  subroutine three_links_on_the_floor()
    call tank([60, 20, 40], [0.3_wp, 0.1_wp, 0.2_wp])
    call put('hexapod', [d], [0.15_wp, 0.05_wp, 2.5_wp*d/sqrt(3.0_wp)], &
      normalised([0.540625_wp, 0.455768_wp, -0.060003_wp, -0.704554_wp]))
    call fill()
    call check('three links: all in the tank', sum(solid%alpha)*grid%volume, 7*d**3, 1e-7_wp*d**3)
    call check('three links: open floor', minval(solid%aperture(1:60, 1:20, 1, 3)), 1.0_wp, 1e-6_wp)
    call check('three links: no pockets', sealed_cells(), 0)
  end subroutine three_links_on_the_floor

  !> Hits against the exact intersections of grid lines with a turned box.
  subroutine links_of_a_box()
    type(links_t) :: links
    real(wp) :: worst, r(3, 3), a(3), b(3), enter, leave, e(3)
    integer :: p, i, j, k, m, n(3)
    logical :: same, flags

    call tank([16, 14, 12], [0.08_wp, 0.056_wp, 0.072_wp])
    worst = 0.0_wp
    same = .true.
    flags = .true.
    do p = 1, 20
      call put('box', [0.012_wp, 0.025_wp, 0.033_wp], [0.04_wp, 0.028_wp, 0.036_wp] &
        + 0.004_wp*[draw(), draw(), draw()], draw_attitude())
      if (p > 15) blocks%shapes(1)%point(1, :) = 0.1_wp*blocks%shapes(1)%point(1, :)   ! a sheet
      e = maxval(blocks%shapes(1)%point, 2)
      call fill()
      links = links_on_grid(solid)
      r = transpose(rotation_matrix(blocks%q(:, 1)))
      do k = 1, grid%n(3)
        do j = 1, grid%n(2)
          do i = 1, grid%n(1)
            b = matmul(r, grid%centre([i, j, k], [1, 2, 3]) - blocks%x(:, 1))
            flags = flags .and. (all(abs(b) <= e) .eqv. solid%inside(i, j, k) == 1)
            do m = 1, 3
              n = [i, j, k] - unit_step(:, m)
              if (n(m) < 1) cycle
              a = matmul(r, grid%centre(n, [1, 2, 3]) - blocks%x(:, 1))
              call cross_box(a, b, e, enter, leave)
              same = same .and. all((enter <= 1) .eqv. [links%low(i, j, k, m) <= 1, &
                links%body_high(i, j, k, m) == 1])
              if (enter > 1 .or. links%low(i, j, k, m) > 1) cycle
              worst = max(worst, abs(links%low(i, j, k, m) - max(enter, 1e-3_wp)), &
                abs(links%high(i, j, k, m) - max(1 - leave, 1e-3_wp)))
            end do
          end do
        end do
      end do
    end do
    call check('box: a link is cut where the line meets the box', same)
    call check('box: centres inside', flags)
    call check('box: places of the first hits', worst, 0.0_wp, 1e-12_wp)
  end subroutine links_of_a_box

  !> First and last place, 0..1 from a to b, of a line on a box of half edges e; 2 if there is none.
  subroutine cross_box(a, b, e, first, last)
    real(wp), intent(in) :: a(3), b(3), e(3)
    real(wp), intent(out) :: first, last
    real(wp) :: enter, leave, t(2)
    integer :: m

    enter = -huge(1.0_wp)
    leave = huge(1.0_wp)
    do m = 1, 3
      t = ([-e(m), e(m)] - a(m))/(b(m) - a(m))
      enter = max(enter, minval(t))
      leave = min(leave, maxval(t))
    end do
    first = 2
    last = 2
    if (enter > leave) return
    if (enter >= 0 .and. enter <= 1) then
      first = enter
      last = enter
      if (leave <= 1) last = leave
    else if (leave >= 0 .and. leave <= 1) then
      first = leave
      last = leave
    end if
  end subroutine cross_box

  !> A box through the open top: what is outside the domain is not in the grid.
  subroutine partly_outside()
    call tank([10, 10, 10], [0.05_wp, 0.05_wp, 0.05_wp])
    call put('box', [0.01_wp, 0.01_wp, 0.02_wp], [0.0275_wp, 0.0275_wp, 0.05_wp])
    call fill()
    call check('half outside: half the volume', sum(solid%alpha)*grid%volume, 1e-6_wp, 1e-18_wp)
    call check('half outside: nothing in the halo', sum(solid%alpha(:, :, 11:)), 0.0_wp)
    call check('half outside: the side', &
      sum(1 - solid%aperture(1:10, 1:10, 11, 3)), 4.0_wp, 1e-12_wp)
    call check('half outside: faces end', maxval(solid%face(3, 1:solid%body_face(2) - 1)), 11)
    call check('half outside: so do cells', maxval(solid%cell(3, 1:solid%body_cell(2) - 1)), 10)
    call check('half outside: no link beyond the side', all(solid%link_number(:, :, 11:, 3) == 0))
    blocks%x(3, 1) = 0.049_wp - 0.01_wp   ! its top 1 mm below the side
    call fill()
    call check('below the side: link from the last centre', &
      solid%link_length(1, solid%link_number(6, 6, 11, 3)), 0.3_wp, 1e-12_wp)
  end subroutine partly_outside

  !> Two boxes that overlap by half a cell, and two that share a cell without overlap.
  subroutine bodies_in_contact()
    real(wp) :: beta
    integer :: m

    call tank([20, 10, 10], [0.1_wp, 0.05_wp, 0.05_wp])   ! 2.5 mm into the other
    call put('cube', [0.02_wp], [0.035_wp, 0.025_wp, 0.025_wp, 0.0525_wp, 0.025_wp, 0.025_wp])
    call fill()
    call check('overlap: shares of a cell end at one', maxval(solid%alpha), 1.0_wp)
    call check('overlap: each body keeps its volume', &
      sum(solid%cell_alpha(:solid%body_cell(3) - 1))*grid%volume, 1.6e-5_wp, 1e-17_wp)
    beta = 0.0_wp
    do m = 1, solid%body_face(3) - 1
      if (all(solid%face(:, m) == [9, 5, 5, 2])) beta = beta + solid%face_beta(m)
    end do
    call check('overlap: shares of a closed face are scaled to one', beta, 1.0_wp, 1e-15_wp)
    call check('overlap: nothing is open below zero', minval(solid%aperture), 0.0_wp)
    blocks%x(1, :) = [0.0375_wp, 0.0575_wp]   ! side by side at x = 47.5 mm, within cell 10
    call fill()
    call check('side by side: the shared cell is full', solid%alpha(10, 5, 5), 1.0_wp)
    call check('side by side: and is no cut cell', solid%cut(10, 5, 5), 0)
    call check('side by side: its faces are closed', solid%aperture(10, 5, 5, 2), 0.0_wp)
    call check('side by side: the centre belongs to one of them', solid%inside(10, 5, 5) > 0)
  end subroutine bodies_in_contact

  !> A lid on a well of 2 x 2 cells, 7..8 x 7..8, down to half a cell above the floor, between four
  !! cubes of 4 cells: closed off, unless the floor is an open side.
  subroutine sealed_pocket()
    call tank([14, 14, 10], [0.14_wp, 0.14_wp, 0.1_wp])
    call put('cube', [0.04_wp], [0.04_wp, 0.06_wp, 0.02_wp, 0.1_wp, 0.08_wp, 0.02_wp, 0.08_wp, &
      0.04_wp, 0.02_wp, 0.06_wp, 0.1_wp, 0.02_wp, 0.07_wp, 0.07_wp, 0.025_wp])
    call fill()
    call check('pocket: four cells are sealed', sealed_cells(), 4)
    call check('pocket: their faces are closed', maxval(solid%aperture(7:8, 7:8, 1, :)), 0.0_wp)
    call check('pocket: other cells are open', solid%aperture(2, 2, 1, 1), 1.0_wp)
    grid%side(1, 3) = side_open
    call fill()
    call check('pocket: open through the floor', sealed_cells(), 0)
    grid%side(1, 3) = side_no_slip
    blocks%x(1, 1) = 0.03_wp   ! one wall gone: a way out
    call fill()
    call check('pocket: a gap lets it out', sealed_cells(), 0)
    blocks%present(5) = .false.
    call fill()
    call check('pocket: a body not present is not there', solid%body_cell(6), solid%body_cell(5))
  end subroutine sealed_pocket

  !> A body across periodic sides, and the same body three periods away: the same bits.
  subroutine periods()
    type(solid_geometry_t) :: other
    type(links_t) :: links
    real(wp) :: worst
    integer :: i, m

    call tank([24, 24, 24], [0.09375_wp, 0.09375_wp, 0.09375_wp])   ! h = 1/256: exact shifts
    grid%periodic = [.true., .false., .true.]
    grid%side(:, [1, 3]) = side_periodic
    call put('hexapod', [0.015_wp], [0.0078125_wp, 0.05_wp, 0.09_wp], draw_attitude())
    call fill()
    blocks%x(1, 1) = blocks%x(1, 1) - 3*grid%length(1)
    call fill_other(other)
    links = links_on_grid(solid)
    call check('periods: the whole volume', sum(solid%alpha(1:24, 1:24, 1:24))*grid%volume, &
      7*0.015_wp**3, 1e-12_wp*0.015_wp**3)
    worst = 0.0_wp
    do i = 1, n_halo
      worst = max(worst, maxval(abs(solid%alpha(i, :, :) - solid%alpha(24 + i, :, :))), &
        maxval(abs(solid%aperture(:, :, i, :) - solid%aperture(:, :, 24 + i, :))), &
        maxval(abs(links%low(1 - i, :, 4:20, :) - links%low(25 - i, :, 4:20, :))))
    end do
    call check('periods: halos are images, bit by bit', worst, 0.0_wp)
    call check('periods: three periods away the same bits', same_bits(solid, other))
    worst = 0.0_wp
    do m = 1, solid%n_cut
      associate (c => solid%cut_cell(:, m))
        worst = max(worst, abs(volume_of_tets(m) - solid%alpha(c(1), c(2), c(3))))
      end associate
    end do
    call check('periods: the tetrahedra listed fill the cut cells', worst, 0.0_wp, 1e-12_wp)
  end subroutine periods

  !> Share of cut cell m by its list of tetrahedra.
  real(wp) function volume_of_tets(m) result(share)
    integer, intent(in) :: m
    real(wp) :: v, moment(3), low(3)
    type(polyhedron_t) :: p
    integer :: t

    share = 0.0_wp
    low = grid%face(solid%cut_cell(:, m), [1, 2, 3])
    do t = solid%tets%first(m), solid%tets%first(m + 1) - 1
      call polyhedron_of_tet(solid%tets%corner(:, :, solid%tets%list(t)), p)
      call cut_polyhedron_by_box(p, low, low + grid%h)
      call polyhedron_moments(p, v, moment)
      share = share + v/grid%volume
    end do
  end function volume_of_tets

  !> Equal bits in all arrays over cells.
  logical function same_bits(a, b) result(same)
    type(solid_geometry_t), intent(in) :: a, b
    type(links_t) :: of_a, of_b

    of_a = links_on_grid(a)
    of_b = links_on_grid(b)
    same = maxval(abs(a%alpha - b%alpha)) <= 0 .and. maxval(abs(a%aperture - b%aperture)) &
      <= 0 .and. maxval(abs(of_a%low - of_b%low)) <= 0 .and. maxval(abs(of_a%high - of_b%high)) &
      <= 0 .and. all(a%inside == b%inside) .and. all(of_a%body_low == of_b%body_low) &
      .and. all(of_a%body_high == of_b%body_high) .and. a%n_cut == b%n_cut .and. all(a%cut == b%cut)
  end function same_bits

  !> Two geometries in turn; one of three bodies only turns, only moves, only comes or goes, or
  !! nothing does: nothing of the old places is left.
  subroutine filled_if_moved()
    real(wp), parameter :: mark = 0.25_wp
    type(solid_geometry_t) :: in_turn(2)
    type(solid_fraction_t) :: fraction
    integer :: s, turn, b

    call tank([20, 16, 20], [0.1_wp, 0.08_wp, 0.1_wp])
    call put('hexapod', [0.015_wp], [0.03_wp, 0.04_wp, 0.03_wp, 0.05_wp, 0.04_wp, 0.05_wp, &
      0.02_wp, 0.07_wp, 0.09_wp])
    call solid_fraction_init(grid, blocks, fraction)
    call solid_geometry_init(grid, in_turn(1), 3)
    call solid_geometry_init(grid, in_turn(2), 3)
    turn = 1
    do s = 1, 24
      b = 1 + mod(s/8, 3)
      if (mod(s, 2) == 0) then   ! the second of two is as the first
        select case (mod(s/2, 4))
        case (1); blocks%q(:, b) = draw_attitude()
        case (2); blocks%x(:, b) = blocks%x(:, b) + [0.003_wp, 0.0_wp, -0.002_wp]
        case default; blocks%present(b) = .not. blocks%present(b)
        end select
      end if
      turn = 3 - turn
      call update_solid(fraction, grid, blocks, in_turn(turn))
      call fill()
      call check('one thing at a time: as if filled afresh', same_bits(in_turn(turn), solid))
    end do
    call update_solid(fraction, grid, blocks, in_turn(1))
    in_turn(1)%alpha(1, 1, 1) = mark
    call update_solid(fraction, grid, blocks, in_turn(1))
    call check('nothing moved: nothing filled', in_turn(1)%alpha(1, 1, 1), mark)
  end subroutine filled_if_moved

end module test_solid_fraction_m
