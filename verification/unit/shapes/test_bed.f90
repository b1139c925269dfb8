!> The bed: its file, its volume in cells and faces, distances.
module test_bed_m
  use, intrinsic :: iso_fortran_env, only: real32, int32
  use check_m, only: check, wp
  use rotations_m, only: rotate
  use case_types_m, only: case_t
  use case_text_m, only: case_of, slip
  use grid_m, only: grid_t, grid_init, n_halo
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use links_on_grid_m, only: links_t, links_on_grid
  use solid_fraction_m, only: solid_fraction_t, solid_fraction_init, update_solid
  use plic_m, only: unit_volume
  use cut_cell_m, only: cut_cell_t, cut_cell_init, load_cut_cell, open_below
  use shapes_builtin_m, only: make_shape
  use tet_mesh_m, only: shape_t
  use rigid_body_m, only: blocks_t
  use case_blocks_m, only: blocks_init
  use random_counter_m, only: uniform, random_rotation
  use surface_search_m, only: found_t, nowhere
  use walls_m, only: walls_t, walls_init
  use deep_overlaps_m, only: deep_overlaps_t, deep_overlaps_init
  use overlap_m, only: overlap_t, overlap_init, overlap_depth, has_place, max_overlap
  use contact_points_m, only: contact_points_t
  use contact_surface_m, only: contact_surface_t, contact_surface_init, find_surface_points
  use bed_file_m, only: bed_form_t, read_bed_file
  use bed_m, only: bed_t, set_bed, bed_covers, bed_distance, bed_place
  implicit none
  private
  public :: test_bed

  character(*), parameter :: lf = new_line('a')
  real(wp), parameter :: slope(3) = [0.31_wp, -0.17_wp, 0.02_wp]   !! z = slope.(x, y, 1)
  real(wp), parameter :: upright(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
  type(case_t) :: case
  type(bed_form_t) :: form
  type(grid_t) :: grid
  type(solid_geometry_t) :: solid
  type(blocks_t) :: blocks
  type(walls_t) :: walls
  type(bed_t), target :: bed
  type(shape_t) :: shapes(1)
  type(found_t) :: found
  character(:), allocatable :: message
  integer :: unit

contains

  subroutine test_bed()
    call files()
    call volume_of_slope()
    call volume_of_closed_form()
    call periodic_bed()
    call distance_from_slope()
    call distance_from_trench()
    call depth_in_bed()
    call edge_on_saddle()
  end subroutine test_bed

  !> A tank with the form as its bed.
  subroutine lay_bed(groups)
    character(*), intent(in) :: groups

    case = case_of(groups)
    call walls_init(case%grid, case%boundary, walls)
    walls%bed => bed
    walls%n = 0
    call set_bed(case, form, bed, message)
    call check('the bed is made: '//message, walls%bed%there)
  end subroutine lay_bed

  !> A tank with a map of the plane z = slope.(x, y, 1), which ends in a side but for rounding.
  subroutine sloping_tank()
    integer :: i, j

    open (newunit=unit, file='slope.txt', status='replace')
    write (unit, '(a)') '# a plane', '6 5  -0.013 0 0.0226 0.03  # points, first, spacing'
    do j = 0, 4
      write (unit, *) [(dot_product(slope, [-0.013_wp + 0.0226_wp*i, 0.03_wp*j, 1.0_wp]), i=0, 5)]
    end do
    close (unit)
    call read_bed_file('slope.txt', 'heightmap', form, message)
    call lay_bed('&grid cells=7,5,9 length=.1,.08,.09 origin=0,.01,0/ '//slip)
  end subroutine sloping_tank

  !> One triangle in both forms of STL, and a map.
  subroutine files()
    real(real32), parameter :: corner(9) = [0.0, 0.0, 0.1, 1.0, 0.0, 0.2, 0.0, 1.0, 0.3]

    call write_text('a.txt', '2 3 0 1 0.5 0.25 # head'//lf//'1 2'//lf//'3 4'//lf//'5 6'//lf)
    call read_bed_file('a.txt', 'heightmap', form, message)
    call check('map', len(message) == 0 .and. size(form%triangle, 2) == 4)
    call check('its last point', form%point(:, 6), [0.5_wp, 1.5_wp, 6.0_wp])
    call check('its first facets', all(form%triangle(:, :2) == reshape([1, 2, 4, 1, 4, 3], [3, 2])))
    call write_text('a.stl', 'solid a'//lf//'facet normal 0 0 1'//lf//'outer loop'//lf &
      //'vertex 0 0 0.1'//lf//'vertex 1 0 0.2'//lf//'vertex 0 1 0.3'//lf//'endloop'//lf &
      //'endfacet'//lf//'endsolid a'//lf)
    call read_bed_file('a.stl', 'stl', form, message)
    call check('ASCII STL: '//message, [form%point], real(corner, wp), 1.0e-7_wp)
    open (newunit=unit, file='b.stl', access='stream', form='unformatted', status='replace')
    write (unit) 'solid'//repeat(' ', 75), 1_int32, [0.0_real32, 0.0_real32, 1.0_real32], corner, &
      'xx'
    close (unit)
    call read_bed_file('b.stl', 'stl', form, message)
    call check('binary STL: '//message, [form%point], real(corner, wp))
  end subroutine files

  subroutine write_text(file, text)
    character(*), intent(in) :: file, text

    open (newunit=unit, file=file, access='stream', form='unformatted', status='replace')
    write (unit) text
    close (unit)
  end subroutine write_text

  !> Solids of the bed alone.
  subroutine fill()
    type(solid_fraction_t) :: fraction
    type(blocks_t) :: none

    allocate (none%present(0), none%x(3, 0), none%q(4, 0))
    call grid_init(case%grid, case%boundary, grid)
    call solid_geometry_init(grid, solid, 1)
    call solid_fraction_init(grid, none, fraction, bed=walls%bed)
    call update_solid(fraction, grid, none, solid)
  end subroutine fill

  !> Under a plane the solid in a column of cells or of side faces is as high as the plane there.
  subroutine volume_of_slope()
    type(cut_cell_t) :: cut
    real(wp) :: height(3), at
    integer :: i, j, m

    call sloping_tank()
    call fill()
    call cut_cell_init(cut)
    do m = 1, solid%n_cut
      associate (c => solid%cut_cell(:, m))
        call load_cut_cell(solid, m, grid%face(c, [1, 2, 3]), grid%h, cut)
        call check('tetrahedra fill a cut cell', cut%open + solid%alpha(c(1), c(2), c(3)), 1.0_wp, &
          1.0e-13_wp)
      end associate
    end do
    call check('there are many', solid%n_cut > 50)
    i = grid%n(1) + 1
    do j = 1, grid%n(2)
      at = dot_product(slope, [grid%face(i, 1), grid%centre(j, 2), 1.0_wp])
      call check('faces in the far side', grid%h(3)*(9 - sum(solid%aperture(i, j, 1:9, 1))), at, &
        1.0e-15_wp)
    end do
    do j = 1, grid%n(2)
      do i = 1, grid%n(1)
        height = [dot_product(slope, [grid%face(i, 1), grid%centre(j, 2), 1.0_wp]), &
          dot_product(slope, [grid%centre(i, 1), grid%face(j, 2), 1.0_wp]), &
          dot_product(slope, [grid%centre(i, 1), grid%centre(j, 2), 1.0_wp])]
        call check('height of the columns', grid%h(3)*[9 - sum(solid%aperture(i, j, 1:9, 1:2), 1), &
          sum(solid%alpha(i, j, 1:9))], height, 1.0e-15_wp)
        call check('centres inside', all((solid%inside(i, j, 1:9) == 1) &
          .eqv. grid%centre([(m, m=1, 9)], 3) < height(3)))
        at = dot_product(slope, [grid%face(i, 1), grid%face(j, 2), 1.0_wp])
        call check('faces in z, below the line of the slope', solid%aperture(i, j, 1:9, 3), &
          [(unit_volume([slope(:2)*grid%h(:2), 0.0_wp], grid%face(m, 3) - at), m=1, 9)], 1.0e-12_wp)
      end do
    end do
  end subroutine volume_of_slope

  !> A hexapod as a bed, closed and overhanging, fills the grid as the same hexapod does as a body:
  !! shares, faces, links, and the liquid below any plane in its cut cells.
  subroutine volume_of_closed_form()
    type(solid_fraction_t) :: fraction
    type(solid_geometry_t) :: of_body
    type(links_t) :: links, links_of_bed
    type(cut_cell_t) :: a, b
    real(wp) :: m(3), share(2), at
    integer :: pose, c(3), n, v

    call hexapod()
    call cut_cell_init(a)
    call cut_cell_init(b)
    do pose = 1, 6
      case%body(1)%position = 0.05_wp + 0.01_wp*[(uniform(pose, v, 1) - 0.5_wp, v=1, 3)]
      if (pose > 1) case%body(1)%quaternion = random_rotation(7, pose)
      call blocks_init(case, shapes, blocks)
      call grid_init(case%grid, case%boundary, grid)
      call solid_geometry_init(grid, of_body, 1)
      call solid_fraction_init(grid, blocks, fraction)
      call update_solid(fraction, grid, blocks, of_body)
      call lie_as_bed(blocks%x(:, 1), blocks%q(:, 1))
      call fill()
      links = links_on_grid(of_body)
      links_of_bed = links_on_grid(solid)
      call check('body and bed: cells', of_body%alpha - solid%alpha, 0.0_wp, 1.0e-12_wp)
      call check('and faces', of_body%aperture - solid%aperture, 0.0_wp, 1.0e-12_wp)
      call check('links from below', links%low - links_of_bed%low, 0.0_wp, 1.0e-11_wp)
      call check('links from above', links%high - links_of_bed%high, 0.0_wp, 1.0e-11_wp)
      call check('centres', all(of_body%inside == solid%inside))
      do n = 1, of_body%n_cut
        c = of_body%cut_cell(:, n)
        if (any(c < 1 .or. c > grid%n)) cycle
        if (solid%cut(c(1), c(2), c(3)) == 0) cycle
        m = grid%face(c, [1, 2, 3])
        call load_cut_cell(of_body, n, m, grid%h, a)
        call load_cut_cell(solid, solid%cut(c(1), c(2), c(3)), m, grid%h, b)
        m = [(2*uniform(c(1), 10*c(2) + v, c(3)) - 1.0_wp, v=1, 3)]
        at = sum(min(m, 0.0_wp)) + uniform(c(1), 10*c(2), c(3))*sum(abs(m))
        call open_below(a, m, at, share(1))
        call open_below(b, m, at, share(2))
        call check('liquid in a cut cell', share(1), share(2), 1.0e-11_wp)
      end do
    end do
  end subroutine volume_of_closed_form

  !> A tank with a block of a shape, and no bed yet.
  subroutine hexapod()
    case = case_of('&grid cells=9,10,11 length=3*.1/ &shape name="h" kind="hexapod" size=.02/ ' &
      //'&body shape="h" position=3*.05/ '//slip)
    call make_shape(case%shape(1), shapes(1), message)
  end subroutine hexapod

  !> The surface of the shape at a pose as the bed, three corners a triangle as in an STL file.
  subroutine lie_as_bed(x, q)
    real(wp), intent(in) :: x(3), q(4)
    integer :: t, c, n

    form = bed_form_t()
    n = size(shapes(1)%triangle, 2)
    form%point = reshape([((x + rotate(q, shapes(1)%point(:, shapes(1)%triangle(c, t))), c=1, 3), &
      t=1, n)], [3, 3*n])
    form%triangle = reshape([(c, c=1, 3*n)], [3, n])
    form%checksum = ''
    call set_bed(case, form, bed, message)
    call check('the shape is taken: '//message, walls%bed%there)
  end subroutine lie_as_bed

  !> A wavy map in a periodic tank: cells and faces beyond a side are those of the other side.
  subroutine periodic_bed()
    real(wp) :: height(9, 2)
    integer :: i, n(3)

    height = spread([(0.03_wp + 0.01_wp*sin(8*atan(1.0_wp)*(i - 1)/8.0_wp), i=1, 9)], 2, 2)
    open (newunit=unit, file='wave.txt', status='replace')
    write (unit, *) 9, 2, 0.0_wp, 0.0_wp, 0.0125_wp, 0.08_wp, height
    close (unit)
    call read_bed_file('wave.txt', 'heightmap', form, message)
    call lay_bed('&grid cells=8,1,9 length=.1,.08,.09/ &boundary x_min="periodic" ' &
      //'x_max="periodic" y_min="periodic" y_max="periodic" z_min="slip" z_max="slip"/')
    call fill()
    n = grid%n
    call check('cells beyond a periodic side', &
      solid%alpha(-2:0, :, :) - solid%alpha(n(1) - 2:n(1), :, :), 0.0_wp, 1.0e-13_wp)
    call check('faces beyond a periodic side', solid%aperture(1 - n_halo:2, :, 1:9, :) &
      - solid%aperture(n(1) + 1 - n_halo:n(1) + 2, :, 1:9, :), 0.0_wp, 1.0e-13_wp)
    call check('slices of one cell', &
      solid%aperture(1:8, 1, 1:9, 2) - 1.0_wp + solid%alpha(1:8, 1, 1:9), 0.0_wp, 1.0e-13_wp)
    call check('height of a column', sum(solid%alpha(3, 1, 1:9))*grid%h(3), &
      0.5_wp*(height(3, 1) + height(4, 1)), 1.0e-15_wp)
    call check('a place in the tank', bed_place(walls%bed, [0.33_wp, -0.5_wp, 0.4_wp]), &
      [0.03_wp, 0.06_wp, 0.4_wp], 1.0e-15_wp)
  end subroutine periodic_bed

  !> Distance from a plane: the height above it times the cosine of its slope, also inside.
  subroutine distance_from_slope()
    real(wp) :: normal(3), x(3), d, outward(3), exact
    integer :: i, v

    call sloping_tank()
    normal = [-slope(1), -slope(2), 1.0_wp]
    normal = normal/norm2(normal)
    do i = 1, 500
      x = [0.02_wp, 0.03_wp, -0.05_wp] + [(uniform(i, 2, v), v=1, 3)]*[0.06_wp, 0.04_wp, 0.16_wp]
      exact = normal(3)*(x(3) - slope(3)) + dot_product(normal(1:2), x(1:2))
      call check('inside the slope', bed_covers(walls%bed, x) .eqv. exact < 0.0_wp)
      call bed_distance(walls%bed, x, 0.01_wp, 0.015_wp, found, d, outward)
      if (exact > 0.01_wp) then
        call check('no nearer than asked', d >= 0.01_wp)
      else if (exact < -0.015_wp) then
        call check('no less deep than asked', d <= -0.015_wp)
      else
        call check('distance from the slope', d, exact, 1.0e-15_wp)
        call check('direction from the slope', outward, normal, 1.0e-13_wp)
      end if
    end do
  end subroutine distance_from_slope

  !> A trench with vertical walls, closed below: the nearest of bottom, walls and rims.
  subroutine distance_from_trench()
    real(wp) :: d, outward(3)

    call trench()
    call check_distance('bottom', [0.045_wp, 0.052_wp, 0.024_wp], 0.004_wp, 0.0_wp)
    call check_distance('wall', [0.042_wp, 0.052_wp, 0.027_wp], 0.002_wp, 1.0_wp)
    call check_distance('beside it', [0.037_wp, 0.052_wp, 0.044_wp], 0.004_wp, 0.0_wp)
    call check_distance('over the rim', [0.043_wp, 0.052_wp, 0.044_wp], 0.005_wp, 0.6_wp)
    call check_distance('in the wall', [0.037_wp, 0.052_wp, 0.036_wp], -0.003_wp, 1.0_wp)
    call check_distance('below the edge', [0.037_wp, 0.052_wp, 0.016_wp], -0.005_wp, 0.6_wp)
    call bed_distance(walls%bed, [0.05_wp, 0.052_wp, 0.08_wp], 0.02_wp, 0.05_wp, found, d, outward)
    call check('high above', d, nowhere)
  end subroutine distance_from_trench

  !> Distance and direction of a place from the trench.
  subroutine check_distance(name, x, exact, sine)
    character(*), intent(in) :: name
    real(wp), intent(in) :: x(3), exact   !! [m]
    real(wp), intent(in) :: sine          !! x of the direction
    real(wp) :: d, outward(3)

    call bed_distance(walls%bed, x, merge(0.0055_wp, 0.0011_wp, exact > 0.0_wp), 0.05_wp, found, &
      d, outward)
    call check('trench, '//name, d, exact, 1.0e-15_wp)
    call check('trench, direction '//name, outward, [sine, 0.0_wp, sqrt(1.0_wp - sine**2)], &
      1.0e-12_wp)
  end subroutine check_distance

  !> A bed at z = 0.04 with a trench along y, from x = 0.04 to 0.06, down to z = 0.02.
  subroutine trench()
    real(wp), parameter :: x(6) = [0.0_wp, 0.04_wp, 0.04_wp, 0.06_wp, 0.06_wp, 0.1_wp]
    real(wp), parameter :: z(6) = [0.04_wp, 0.04_wp, 0.02_wp, 0.02_wp, 0.04_wp, 0.04_wp]
    integer :: i

    form%point = reshape([([x(i), 0.0_wp, z(i)], i=1, 6), ([x(i), 0.1_wp, z(i)], i=1, 6)], [3, 12])
    form%triangle = reshape([(i, i + 1, i + 7, i, i + 7, i + 6, i=1, 5)], [3, 10])
    form%checksum = ''
    call lay_bed('&grid cells=3*10 length=3*.1/ '//slip)
  end subroutine trench

  !> Depth of a cube in a plane bed: of its lowest corner; and of a hexapod in a hexapod as in a
  !! body. A body has room down to 1 % of its size.
  subroutine depth_in_bed()
    type(overlap_t) :: overlap
    type(deep_overlaps_t) :: deep
    real(wp) :: x(3), depth, exact, worst
    integer :: i, n

    call hexapod()
    x = 0.05_wp
    call walls_init(case%grid, case%boundary, walls)
    walls%bed => bed
    walls%n = 0
    call lie_as_bed(x, upright)
    worst = 0.0_wp
    n = 0
    do i = 1, 400
      case%body(1)%position = x + 0.05_wp*(2*uniform(3, i, 1) - 1.0_wp)*[1.0_wp, 0.3_wp, 0.2_wp]
      case%body(1)%quaternion = random_rotation(9, i)
      call blocks_init(case, shapes, blocks)
      call overlap_init(shapes, overlap)
      call deep_overlaps_init(blocks, deep)
      deep%asked = .true.
      call max_overlap(walls, blocks, overlap, depth, deep)
      exact = overlap_depth(shapes(1), blocks%x(:, 1), blocks%q(:, 1), shapes(1), x, upright)
      if (exact > 0.004_wp) cycle   ! deeper, points inside faces decide: the bed has none
      if (depth > 0.0_wp) n = n + 1
      worst = max(worst, abs(depth - exact))
    end do
    call check('hexapods that touch', n >= 15)
    call check('hexapod in a bed as in a body', worst, 0.0_wp, 1.0e-12_wp)   ! of the same points
    call trench()
    blocks%q(:, 1) = upright
    blocks%x(:, 1) = [0.018_wp, 0.05_wp, 0.0699_wp]
    call max_overlap(walls, blocks, overlap, depth, deep)
    call check('a foot in the bed', depth, 1.0e-4_wp, 1.0e-12_wp)
    call check('has room', has_place(walls, blocks, 1, overlap))
    blocks%x(3, 1) = 0.0697_wp
    call check('has no room', .not. has_place(walls, blocks, 1, overlap))
    blocks%x(3, 1) = -0.05_wp
    call check('deep in the bed has no room', .not. has_place(walls, blocks, 1, overlap))
    blocks%x(:, 1) = [0.05_wp, 0.05_wp, 0.0501_wp]   ! the foot stands in the trench, just as wide
    call max_overlap(walls, blocks, overlap, depth, deep)
    call check('a foot in the trench', depth, 0.0_wp, 1.0e-12_wp)
  end subroutine depth_in_bed

  !> An edge across a saddle of the bed: it rests on the corner where both ridges end.
  subroutine edge_on_saddle()
    type(contact_surface_t) :: contact
    type(contact_points_t) :: points
    real(wp), parameter :: deep = 1.0e-4_wp, edge = 0.02_wp, top = 0.04_wp
    integer, parameter :: round(9) = [2, 3, 6, 9, 8, 7, 4, 1, 2]   ! the points about the fifth
    integer :: i, j

    form%point = reshape([(([0.05_wp*(1 + i), 0.05_wp*(1 + j), top + 0.01_wp*(j**2 - i**2)], &
      i=-1, 1), j=-1, 1)], [3, 9])   ! falls along x, rises along y
    form%triangle = reshape([(5, round(i + 1), round(i), i=1, 8)], [3, 8])
    form%checksum = ''
    call lay_bed('&grid cells=9,10,11 length=3*.1/ &shape name="h" kind="box" size=.06,.02,.02/ ' &
      //'&body shape="h" position=3*.05 axis=1,0,0 angle_deg=45/ '//slip)
    case%body(1)%position(3) = top + edge*sqrt(0.5_wp) - deep
    call make_shape(case%shape(1), shapes(1), message)
    call blocks_init(case, shapes, blocks)
    call contact_surface_init(1.0e-2_wp, blocks, contact)
    call find_surface_points(walls, blocks, 0.0_wp, contact, points)
    call check('an edge on a saddle touches it', points%n > 0)
    call check('its depth', maxval(points%item(:points%n)%depth), deep*sqrt(0.5_wp), 1.0e-12_wp)
  end subroutine edge_on_saddle

end module test_bed_m
