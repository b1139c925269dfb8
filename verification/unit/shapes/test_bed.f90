!> The bed: its file, its volume in cells and faces, distances.
module test_bed_m
  use, intrinsic :: iso_fortran_env, only: real32, int32
  use kinds_m, only: wp
  use check_m, only: check
  use rotations_m, only: rotate
  use case_types_m, only: case_t
  use grid_m, only: grid_t, grid_init, n_halo
  use solid_geometry_m, only: solid_geometry_t, solid_geometry_init
  use links_on_grid_m, only: links_t, links_on_grid
  use solid_fraction_m, only: solid_fraction_t, solid_fraction_init, update_solid
  use cut_cell_m, only: cut_cell_t, cut_cell_init, load_cut_cell, open_below
  use shapes_builtin_m, only: make_shape
  use tet_mesh_m, only: shape_t
  use rigid_body_m, only: blocks_t, release_body
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
  character(4), parameter :: sides(2, 3) = 'slip'
  real(wp), parameter :: slope(3) = [0.31_wp, -0.17_wp, 0.02_wp]   !! z = slope.(x, y, 1)

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

  !> A tank with a map of the plane z = slope.(x, y, 1) of n points from x0 on.
  subroutine sloping_tank(case, form)
    type(case_t), intent(out) :: case
    type(bed_form_t), intent(out) :: form
    character(:), allocatable :: message
    integer :: unit, i, j

    case%grid%cells = [7, 5, 9]
    case%grid%length = [0.1_wp, 0.08_wp, 0.09_wp]
    case%grid%origin = [0.0_wp, 0.01_wp, 0.0_wp]
    case%boundary%kind = sides
    case%bed%file = 'slope.txt'
    case%fluid%initial_state = ''
    allocate (case%shape(0), case%body(0), case%drop(0), case%water(0))
    open (newunit=unit, file='slope.txt', status='replace')
    write (unit, '(a)') '# a plane', '6 5  -0.013 0 0.03 0.03  # points, first, spacing'
    do j = 0, 4
      write (unit, *) [(dot_product(slope, [-0.013_wp + 0.03_wp*i, 0.03_wp*j, 1.0_wp]), i=0, 5)]
    end do
    close (unit)
    call read_bed_file('slope.txt', 'heightmap', form, message)
    call check('the map is read: '//message, len(message) == 0)
  end subroutine sloping_tank

  !> One triangle in both forms of STL, and a map.
  subroutine files()
    type(bed_form_t) :: form
    character(:), allocatable :: message
    real(real32), parameter :: corner(9) = [0.0, 0.0, 0.1, 1.0, 0.0, 0.2, 0.0, 1.0, 0.3]

    call write_text('a.txt', '2 3 0 1 0.5 0.25 # head'//lf//'1 2'//lf//'3 4'//lf//'5 6'//lf)
    call read_bed_file('a.txt', 'heightmap', form, message)
    call check('map', len(message) == 0 .and. size(form%triangle, 2) == 4)
    call check('its last point', form%point(:, 6), [0.5_wp, 1.5_wp, 6.0_wp], 0.0_wp)
    call check('its first facets', all(form%triangle(:, :2) == reshape([1, 2, 4, 1, 4, 3], [3, 2])))
    call write_text('a.stl', 'solid a'//lf//'facet normal 0 0 1'//lf//'outer loop'//lf &
      //'vertex 0 0 0.1'//lf//'vertex 1 0 0.2'//lf//'vertex 0 1 0.3'//lf//'endloop'//lf &
      //'endfacet'//lf//'endsolid a'//lf)
    call read_bed_file('a.stl', 'stl', form, message)
    call check('ASCII STL: '//message, size(form%triangle, 2), 1)
    call check('its corners', reshape(form%point, [9]), real(corner, wp), 1.0e-7_wp)
    call write_binary_stl(corner)
    call read_bed_file('b.stl', 'stl', form, message)
    call check('binary STL: '//message, size(form%triangle, 2), 1)
    call check('and its corners', reshape(form%point, [9]), real(corner, wp), 0.0_wp)
  end subroutine files

  !> A binary file of one facet.
  subroutine write_binary_stl(corner)
    real(real32), intent(in) :: corner(9)
    integer :: unit

    open (newunit=unit, file='b.stl', access='stream', form='unformatted', status='replace')
    write (unit) 'solid'//repeat(' ', 75), 1_int32, [0.0_real32, 0.0_real32, 1.0_real32], corner, &
      'xx'
    close (unit)
  end subroutine write_binary_stl

  subroutine write_text(file, text)
    character(*), intent(in) :: file, text
    integer :: unit

    open (newunit=unit, file=file, access='stream', form='unformatted', status='replace')
    write (unit) text
    close (unit)
  end subroutine write_text

  !> Solids of a bed alone.
  subroutine fill(case, form, grid, solid)
    type(case_t), intent(in) :: case
    type(bed_form_t), intent(in) :: form
    type(grid_t), intent(out) :: grid
    type(solid_geometry_t), intent(out) :: solid
    type(solid_fraction_t) :: fraction
    type(blocks_t) :: blocks
    type(bed_t) :: bed
    character(:), allocatable :: message

    call grid_init(case%grid, case%boundary, grid)
    call set_bed(case, form, bed, message)
    call check('the bed is made: '//message, bed%there)
    allocate (blocks%present(0), blocks%x(3, 0), blocks%q(4, 0))
    call solid_geometry_init(grid, solid, 1)
    call solid_fraction_init(grid, blocks, fraction, bed=bed)
    call update_solid(fraction, grid, blocks, solid)
  end subroutine fill

  !> Under a plane the solid in a column of cells is as high as the plane in its middle; a column of
  !! side faces likewise.
  subroutine volume_of_slope()
    type(case_t) :: case
    type(bed_form_t) :: form
    type(grid_t) :: grid
    type(solid_geometry_t) :: solid
    type(cut_cell_t) :: cut
    real(wp) :: worst(5), height
    integer :: i, j, m

    call sloping_tank(case, form)
    call fill(case, form, grid, solid)
    call cut_cell_init(cut)
    worst = 0.0_wp
    do m = 1, solid%n_cut
      associate (c => solid%cut_cell(:, m))
        call load_cut_cell(solid, m, grid%face(c, [1, 2, 3]), grid%h, cut)
        worst(5) = max(worst(5), abs(cut%open - 1.0_wp + solid%alpha(c(1), c(2), c(3))))
      end associate
    end do
    do j = 1, grid%n(2)
      do i = 1, grid%n(1)
        height = dot_product(slope, [grid%centre(i, 1), grid%centre(j, 2), 1.0_wp])
        worst(1) = max(worst(1), abs(sum(solid%alpha(i, j, 1:grid%n(3)))*grid%h(3) - height))
        height = dot_product(slope, [grid%face(i, 1), grid%centre(j, 2), 1.0_wp])
        worst(2) = max(worst(2), abs(sum(1.0_wp - solid%aperture(i, j, 1:grid%n(3), 1))*grid%h(3) &
                                     - height))
        height = dot_product(slope, [grid%centre(i, 1), grid%face(j, 2), 1.0_wp])
        worst(3) = max(worst(3), abs(sum(1.0_wp - solid%aperture(i, j, 1:grid%n(3), 2))*grid%h(3) &
                                     - height))
        height = dot_product(slope, [grid%centre(i, 1), grid%centre(j, 2), 1.0_wp])
        if (any((solid%inside(i, j, 1:grid%n(3)) == 1) .neqv. &
                (grid%centre([(i, i=1, grid%n(3))], 3) < height))) worst(4) = 1.0_wp
      end do
    end do
    call check('height of the columns', worst(1), 0.0_wp, 1.0e-15_wp)
    call check('of the faces in x', worst(2), 0.0_wp, 1.0e-15_wp)
    call check('of the faces in y', worst(3), 0.0_wp, 1.0e-15_wp)
    call check('centres inside', worst(4), 0.0_wp, 0.0_wp)
    call check('its tetrahedra fill the cut cells', worst(5), 0.0_wp, 1.0e-13_wp)
    call check('there are many', solid%n_cut > 50)
    call check('of the faces in z, by points', worst_level_face(grid, solid), 0.0_wp, 0.03_wp)
  end subroutine volume_of_slope

  !> Shares of the faces in z against the points of them that lie under the slope: largest error.
  function worst_level_face(grid, solid) result(worst)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, parameter :: n = 40   ! points in each direction
    real(wp) :: worst, x(3)
    integer :: i, j, k, a, b, below

    worst = 0.0_wp
    do k = 1, grid%n(3)
      do j = 1, grid%n(2)
        do i = 1, grid%n(1)
          below = 0
          do b = 1, n
            do a = 1, n
              x(1) = grid%face(i, 1) + (real(a, wp) - 0.5_wp)/real(n, wp)*grid%h(1)
              x(2) = grid%face(j, 2) + (real(b, wp) - 0.5_wp)/real(n, wp)*grid%h(2)
              if (dot_product(slope, [x(1), x(2), 1.0_wp]) > grid%face(k, 3)) below = below + 1
            end do
          end do
          worst = max(worst, abs(1.0_wp - solid%aperture(i, j, k, 3) &
                                 - real(below, wp)/real(n**2, wp)))
        end do
      end do
    end do
  end function worst_level_face

  !> A hexapod as a bed, closed and overhanging, fills the grid as the same hexapod does as a body:
  !! shares, faces, links, and the liquid below any plane in its cut cells.
  subroutine volume_of_closed_form()
    type(case_t) :: case
    type(grid_t) :: grid
    type(shape_t) :: shapes(1)
    type(blocks_t) :: blocks
    type(solid_fraction_t) :: fraction
    type(solid_geometry_t) :: solid, of_bed
    type(links_t) :: links, links_of_bed
    type(bed_form_t) :: form
    type(cut_cell_t) :: a, b
    character(:), allocatable :: message
    real(wp) :: worst(6), m(3), share(2), at
    integer :: pose, i, j, k, v

    call hexapod_case(case, shapes(1))
    call cut_cell_init(a)
    call cut_cell_init(b)
    worst = 0.0_wp
    do pose = 1, 6
      case%body(1)%position = 0.05_wp + 0.01_wp*[(uniform(pose, v, 1) - 0.5_wp, v=1, 3)]
      if (pose > 1) case%body(1)%quaternion = random_rotation(7, pose)
      call blocks_init(case, shapes, blocks)
      call grid_init(case%grid, case%boundary, grid)
      call solid_geometry_init(grid, solid, 1)
      call solid_fraction_init(grid, blocks, fraction)
      call update_solid(fraction, grid, blocks, solid)
      form = form_of(shapes(1), blocks%x(:, 1), blocks%q(:, 1))
      call fill(case, form, grid, of_bed)
      worst(1) = max(worst(1), maxval(abs(solid%alpha - of_bed%alpha)))
      worst(2) = max(worst(2), maxval(abs(solid%aperture - of_bed%aperture)))
      links = links_on_grid(solid)
      links_of_bed = links_on_grid(of_bed)
      worst(3) = max(worst(3), maxval(abs(links%low - links_of_bed%low)))
      worst(4) = max(worst(4), maxval(abs(links%high - links_of_bed%high)))
      worst(5) = max(worst(5), real(maxval(abs(solid%inside - of_bed%inside)), wp))
      do k = 1, grid%n(3)
        do j = 1, grid%n(2)
          do i = 1, grid%n(1)
            if (solid%cut(i, j, k) == 0 .or. of_bed%cut(i, j, k) == 0) cycle
            m = [grid%face(i, 1), grid%face(j, 2), grid%face(k, 3)]
            call load_cut_cell(solid, solid%cut(i, j, k), m, grid%h, a)
            call load_cut_cell(of_bed, of_bed%cut(i, j, k), m, grid%h, b)
            m = [(2*uniform(i, 10*j + v, k) - 1.0_wp, v=1, 3)]
            at = sum(min(m, 0.0_wp)) + uniform(i, 10*j, k)*sum(abs(m))
            call open_below(a, m, at, share(1))
            call open_below(b, m, at, share(2))
            worst(6) = max(worst(6), abs(share(1) - share(2)))
          end do
        end do
      end do
    end do
    message = 'hexapod as body and as bed: '
    call check(message//'cells', worst(1), 0.0_wp, 1.0e-12_wp)
    call check(message//'faces', worst(2), 0.0_wp, 1.0e-12_wp)
    call check(message//'links up', worst(3), 0.0_wp, 1.0e-11_wp)
    call check(message//'links down', worst(4), 0.0_wp, 1.0e-11_wp)
    call check(message//'centres', worst(5), 0.0_wp, 0.0_wp)
    call check(message//'liquid in cut cells', worst(6), 0.0_wp, 1.0e-11_wp)
  end subroutine volume_of_closed_form

  subroutine hexapod_case(case, shape)
    type(case_t), intent(out) :: case
    type(shape_t), intent(out) :: shape
    character(:), allocatable :: message

    case%grid%cells = [9, 10, 11]
    case%grid%length = 0.1_wp
    case%boundary%kind = sides
    case%fluid%initial_state = ''
    case%bed%file = ''
    allocate (case%shape(1), case%body(1), case%drop(0), case%water(0))
    case%shape(1)%name = 'h'
    case%shape(1)%kind = 'hexapod'
    case%shape(1)%size = 0.02_wp
    case%body(1)%shape = 'h'
    case%body(1)%fixed = .true.
    call make_shape(case%shape(1), shape, message)
  end subroutine hexapod_case

  !> The surface of a shape at a pose, three corners for each triangle, as an STL file has it.
  function form_of(shape, x, q) result(form)
    type(shape_t), intent(in) :: shape
    real(wp), intent(in) :: x(3), q(4)
    type(bed_form_t) :: form
    integer :: t, c, n

    n = size(shape%triangle, 2)
    allocate (form%point(3, 3*n))
    do t = 1, n
      do c = 1, 3
        form%point(:, 3*t - 3 + c) = x + rotate(q, shape%point(:, shape%triangle(c, t)))
      end do
    end do
    allocate (form%triangle, source=reshape([(c, c=1, 3*n)], [3, n]))
    form%checksum = ''
  end function form_of

  !> A wavy map in a periodic tank: cells and faces beyond a side are those of the other side.
  subroutine periodic_bed()
    type(case_t) :: case
    type(bed_form_t) :: form
    type(bed_t) :: bed
    type(grid_t) :: grid
    type(solid_geometry_t) :: solid
    real(wp) :: height(9, 2), x(3)
    character(:), allocatable :: message
    integer :: i, unit, n(3)

    call sloping_tank(case, form)
    case%grid%cells = [8, 1, 9]
    case%grid%origin = 0.0_wp
    case%boundary%kind(:, 1:2) = 'periodic'
    do i = 1, 9
      height(i, :) = 0.03_wp + 0.01_wp*sin(8*atan(1.0_wp)*real(i - 1, wp)/8.0_wp)
    end do
    open (newunit=unit, file='wave.txt', status='replace')
    write (unit, *) 9, 2, 0.0_wp, 0.0_wp, 0.0125_wp, 0.08_wp, height
    close (unit)
    call read_bed_file('wave.txt', 'heightmap', form, message)
    call fill(case, form, grid, solid)
    n = grid%n
    call check('cells beyond a periodic side', maxval(abs(solid%alpha(-2:0, :, :) &
      - solid%alpha(n(1) - 2:n(1), :, :))), 0.0_wp, 1.0e-13_wp)
    call check('faces beyond a periodic side', maxval(abs(solid%aperture(1 - n_halo:2, :, 1:9, :) &
      - solid%aperture(n(1) + 1 - n_halo:n(1) + 2, :, 1:9, :))), 0.0_wp, 1.0e-13_wp)
    call check('slices of one cell', maxval(abs(solid%aperture(1:8, 1, 1:9, 2) &
      - 1.0_wp + solid%alpha(1:8, 1, 1:9))), 0.0_wp, 1.0e-13_wp)
    call check('height of a column', sum(solid%alpha(3, 1, 1:9))*grid%h(3), &
      0.5_wp*(height(3, 1) + height(4, 1)), 1.0e-15_wp)
    call set_bed(case, form, bed, message)
    x = bed_place(bed, [0.33_wp, -0.5_wp, 0.4_wp])
    call check('a place in the tank', x, [0.03_wp, 0.06_wp, 0.4_wp], 1.0e-15_wp)
  end subroutine periodic_bed

  !> From a plane the distance is the height above it times the cosine of its slope; also inside,
  !! as deep as is asked.
  subroutine distance_from_slope()
    type(case_t) :: case
    type(bed_form_t) :: form
    type(bed_t) :: bed
    type(found_t) :: found
    character(:), allocatable :: message
    real(wp) :: normal(3), x(3), d, outward(3), exact, worst(3)
    integer :: i, v

    call sloping_tank(case, form)
    call set_bed(case, form, bed, message)
    normal = [-slope(1), -slope(2), 1.0_wp]
    normal = normal/norm2(normal)
    worst = 0.0_wp
    do i = 1, 500
      x = [0.02_wp, 0.03_wp, -0.05_wp] + [(uniform(i, 2, v), v=1, 3)]*[0.06_wp, 0.04_wp, 0.16_wp]
      exact = normal(3)*(x(3) - slope(3)) + dot_product(normal(1:2), x(1:2))
      if (bed_covers(bed, x) .neqv. exact < 0.0_wp) worst(1) = 1.0_wp
      call bed_distance(bed, x, 0.01_wp, 0.015_wp, found, d, outward)
      if (exact > 0.01_wp) then
        if (d < 0.01_wp) worst(2) = 1.0_wp
      else if (exact < -0.015_wp) then
        if (d > -0.015_wp) worst(2) = 1.0_wp
      else
        worst(2) = max(worst(2), abs(d - exact))
        worst(3) = max(worst(3), norm2(outward - normal))
      end if
    end do
    call check('inside the slope', worst(1), 0.0_wp, 0.0_wp)
    call check('distance from the slope', worst(2), 0.0_wp, 1.0e-15_wp)
    call check('direction from the slope', worst(3), 0.0_wp, 1.0e-13_wp)
  end subroutine distance_from_slope

  !> A trench with vertical walls, closed below: the nearest of bottom, walls and rims.
  subroutine distance_from_trench()
    type(case_t) :: case
    type(bed_form_t) :: form
    type(bed_t) :: bed
    type(found_t) :: found
    character(:), allocatable :: message
    real(wp) :: d, outward(3)

    call trench(case, form)
    call set_bed(case, form, bed, message)
    call check('the trench is made: '//message, bed%there)
    call check_distance(bed, [0.045_wp, 0.052_wp, 0.024_wp], 0.004_wp, [0.0_wp, 0.0_wp, 1.0_wp], &
      'bottom')
    call check_distance(bed, [0.042_wp, 0.052_wp, 0.027_wp], 0.002_wp, [1.0_wp, 0.0_wp, 0.0_wp], &
      'wall')
    call check_distance(bed, [0.037_wp, 0.052_wp, 0.044_wp], 0.004_wp, [0.0_wp, 0.0_wp, 1.0_wp], &
      'beside it')
    call check_distance(bed, [0.043_wp, 0.052_wp, 0.044_wp], 0.005_wp, [0.6_wp, 0.0_wp, 0.8_wp], &
      'over the rim')
    call check_distance(bed, [0.037_wp, 0.052_wp, 0.036_wp], -0.003_wp, [1.0_wp, 0.0_wp, 0.0_wp], &
      'in the wall')
    call check_distance(bed, [0.037_wp, 0.052_wp, 0.016_wp], -0.005_wp, [0.6_wp, 0.0_wp, 0.8_wp], &
      'below the edge')
    call bed_distance(bed, [0.05_wp, 0.052_wp, 0.08_wp], 0.02_wp, 0.05_wp, found, d, &
      outward)
    call check('high above', d, nowhere, 0.0_wp)
  end subroutine distance_from_trench

  subroutine check_distance(bed, x, exact, direction, name)
    type(bed_t), intent(in) :: bed
    real(wp), intent(in) :: x(3), exact, direction(3)
    character(*), intent(in) :: name
    type(found_t) :: found
    real(wp) :: d, outward(3)

    call bed_distance(bed, x, merge(0.0055_wp, 0.0011_wp, exact > 0.0_wp), 0.05_wp, found, &
      d, outward)
    call check('trench, '//name, d, exact, 1.0e-15_wp)
    call check('trench, direction '//name, outward, direction, 1.0e-12_wp)
  end subroutine check_distance

  !> A bed at z = 0.04 with a trench along y, from x = 0.04 to 0.06, down to z = 0.02.
  subroutine trench(case, form)
    type(case_t), intent(out) :: case
    type(bed_form_t), intent(out) :: form
    real(wp), parameter :: x(6) = [0.0_wp, 0.04_wp, 0.04_wp, 0.06_wp, 0.06_wp, 0.1_wp]
    real(wp), parameter :: z(6) = [0.04_wp, 0.04_wp, 0.02_wp, 0.02_wp, 0.04_wp, 0.04_wp]
    integer :: i

    case%grid%cells = 10
    case%grid%length = 0.1_wp
    case%boundary%kind = sides
    allocate (form%point(3, 12), form%triangle(3, 10))
    form%checksum = ''
    do i = 1, 6
      form%point(:, i) = [x(i), 0.0_wp, z(i)]
      form%point(:, i + 6) = [x(i), 0.1_wp, z(i)]
    end do
    do i = 1, 5
      form%triangle(:, 2*i - 1) = [i, i + 1, i + 7]
      form%triangle(:, 2*i) = [i, i + 7, i + 6]
    end do
  end subroutine trench

  !> Depth of a cube in a plane bed: of its lowest corner; and of a hexapod in a hexapod as in a
  !! body. A body has room down to 1 % of its size.
  subroutine depth_in_bed()
    type(case_t) :: case
    type(bed_form_t) :: form
    type(shape_t) :: shapes(1)
    type(blocks_t) :: blocks
    type(walls_t) :: walls
    type(overlap_t) :: overlap
    type(deep_overlaps_t) :: deep
    character(:), allocatable :: message
    real(wp) :: x(3), depth, exact, worst
    integer :: i, n

    call hexapod_case(case, shapes(1))
    x = 0.05_wp
    form = form_of(shapes(1), x, [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
    call walls_init(case%grid, case%boundary, walls)
    walls%n = 0
    call set_bed(case, form, walls%bed, message)
    case%body(1)%fixed = .false.
    worst = 0.0_wp
    n = 0
    do i = 1, 400
      case%body(1)%position = x + 0.05_wp*(2*uniform(3, i, 1) - 1.0_wp)*[1.0_wp, 0.3_wp, 0.2_wp]
      case%body(1)%quaternion = random_rotation(9, i)
      call blocks_init(case, shapes, blocks)
      call overlap_init(shapes, 1, overlap)
      call deep_overlaps_init(blocks, deep)
      deep%asked = .true.
      call max_overlap(walls, blocks, overlap, depth, deep)
      exact = overlap_depth(shapes(1), blocks%x(:, 1), blocks%q(:, 1), shapes(1), x, &
        [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
      if (exact > 0.004_wp) cycle   ! deeper, points inside faces decide: the bed has none
      if (depth > 0.0_wp) n = n + 1
      worst = max(worst, abs(depth - exact))
    end do
    call check('hexapods that touch', n >= 15)
    call check('hexapod in a bed as in a body', worst, 0.0_wp, 1.0e-12_wp)   ! of the same points
    call trench(case, form)
    call set_bed(case, form, walls%bed, message)
    blocks%q(:, 1) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
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
    type(case_t) :: case
    type(bed_form_t) :: form
    type(shape_t) :: shapes(1)
    type(blocks_t) :: blocks
    type(walls_t) :: walls
    type(contact_surface_t) :: contact
    type(contact_points_t) :: points
    character(:), allocatable :: message
    real(wp), parameter :: deep = 1.0e-4_wp, edge = 0.02_wp, top = 0.04_wp
    integer, parameter :: round(9) = [2, 3, 6, 9, 8, 7, 4, 1, 2]   ! the points about the fifth
    integer :: i, j

    call hexapod_case(case, shapes(1))
    case%shape(1)%kind = 'box'
    case%shape(1)%size = [3*edge, edge, edge]
    call make_shape(case%shape(1), shapes(1), message)
    case%body(1)%fixed = .false.
    case%body(1)%position = [0.05_wp, 0.05_wp, top + edge*sqrt(0.5_wp) - deep]
    case%body(1)%quaternion = [cos(atan(1.0_wp)/2), sin(atan(1.0_wp)/2), 0.0_wp, 0.0_wp]
    allocate (form%point(3, 9), form%triangle(3, 8))
    form%checksum = ''
    do j = -1, 1
      do i = -1, 1   ! falls along x, rises along y
        form%point(:, 5 + i + 3*j) = [0.05_wp*(1 + i), 0.05_wp*(1 + j), top + 0.01_wp*(j**2 - i**2)]
      end do
    end do
    do i = 1, 8
      form%triangle(:, i) = [5, round(i + 1), round(i)]
    end do
    call walls_init(case%grid, case%boundary, walls)
    walls%n = 0
    call set_bed(case, form, walls%bed, message)
    call check('a saddle: '//message, len(message) == 0)
    call blocks_init(case, shapes, blocks)
    call contact_surface_init(0.1_wp, 1.0e-3_wp, blocks, contact)
    call find_surface_points(walls, blocks, 0.0_wp, contact, points)
    call check('an edge on a saddle touches it', points%n > 0)
    call check('as deep as it lies', maxval(points%item(:points%n)%depth), deep*sqrt(0.5_wp), &
      1.0e-12_wp)
  end subroutine edge_on_saddle

end module test_bed_m
