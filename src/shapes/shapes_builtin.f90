!> The built-in blocks as tetrahedra; those of cuboids and the sphere are built here.
!!
!! Blocks made of cubes are cut into smaller cuboids and each of these into five tetrahedra,
!! mirrored from one to the next so that they fit. With an even `refinement` the cut has every
!! symmetry of the cube, with an odd one those of the regular tetrahedron.
module shapes_builtin_m
  use kinds_m, only: wp, pi
  use case_types_m, only: shape_input_t, size_count, member_name
  use named_files_m, only: found_file
  use tet_mesh_m, only: shape_t, surface_of_tets
  use vectors_m, only: cube_root, norm, norms, cross
  use convex_parts_m, only: points_t, find_or_add
  use mass_properties_m, only: volume_and_centroid, inertia_about_origin, surface_area
  use armour_units_m, only: build_cylinder, build_tetrapod, build_dolos, tetrapod_tip, dolos_tip
  use rock_m, only: build_rock, share_in_grade
  use contact_sphere_placement_m, only: place_in_tets
  use dense_spheres_m, only: place_densely
  use shape_file_m, only: read_shape_file
  use mesh_check_m, only: check_mesh
  use surface_net_m, only: merge_flat_facets
  use value_text_m, only: quoted_text
  use errors_m, only: to_text
  implicit none
  private
  public :: make_shape, given_size

  integer, parameter :: max_refinement = 8
  real(wp), parameter :: max_cuboids = 1.0e5_wp   !! cuboids of a box
  real(wp), parameter :: max_slender = 300.0_wp   !! height over diameter, refinement 1
  real(wp), parameter :: shortest = 1.0e-6_wp, longest = 1.0e6_wp   !! block from a file [m]
  real(wp), parameter :: min_share = 1.0e-6_wp   !! stones of a grade between its bounds [-]
  real(wp), parameter :: max_spheres = 2.0e4_wp, dense_spacing = 0.1_wp   !! [-], [smallest edge]
  integer, parameter :: sphere_frequency = 2   !! parts of an icosahedron edge per refinement

  !> Places along one direction of a lattice.
  type :: line_t
    real(wp), allocatable :: x(:)        !! (0:parts) planes between the parts [m]
    integer, allocatable :: place(:)     !! (parts) the place a part belongs to
    integer, allocatable :: plane(:)     !! (0:places) the planes between the places, in x
  end type line_t

  real(wp), parameter :: reef_frame = 0.2_wp   !! width of the bars of a reef cube [its edge]

  !> The five tetrahedra of a cuboid; corner 1 + a + 2b + 4c is the upper one in x, y, z where
  !! a, b, c = 1. The second set is the mirror image, for every other cuboid.
  integer, parameter :: five_tets(4, 5, 0:1) = reshape([ &
    1, 2, 3, 5, 4, 3, 2, 8, 6, 2, 5, 8, 7, 5, 3, 8, 2, 3, 5, 8, &
    2, 1, 6, 4, 3, 1, 4, 7, 5, 1, 7, 6, 8, 6, 7, 4, 1, 4, 7, 6], [4, 5, 2])

  !> Corners of the lower and upper face of a cuboid in each direction, outward.
  integer, parameter :: cuboid_face(4, 2, 3) = reshape([ &
    1, 5, 7, 3, 2, 4, 8, 6, 1, 2, 6, 5, 3, 7, 8, 4, 1, 3, 4, 2, 5, 6, 8, 7], [4, 2, 3])

contains

  !> The block a `&shape` group asks for; `message` is empty, or says what is wrong.
  subroutine make_shape(input, shape, message)
    type(shape_input_t), intent(in) :: input
    type(shape_t), intent(out) :: shape
    character(:), allocatable, intent(out) :: message
    real(wp) :: centroid(3)
    integer :: m

    message = problem_with(input)
    if (len(message) > 0) return
    shape%name = member_name(input, input%member)
    if (input%member > 0) shape%family = input%name
    shape%kind = input%kind
    shape%density = input%density
    select case (trim(input%kind))
    case ('file'); call build_from_file(input, shape, message)
    case ('rock'); call build_stone(input, shape, message)
    case default; call build_form(input, shape)
    end select
    if (len(message) > 0) return
    ! Surface and, where the flow has no coarser parts, its parts: flat regions of a file become
    ! single facets.
    call surface_of_tets(size(shape%point, 2), shape%tet, shape%triangle, shape%triangle_tet)
    if (.not. allocated(shape%flow_tet)) then
      shape%flow_tet = shape%tet
      shape%facet = [(1 + 3*m, m=0, size(shape%triangle, 2))]
      shape%facet_point = reshape(shape%triangle, [size(shape%triangle)])
      if (trim(input%kind) == 'file') call merge_flat_facets(shape%point, shape%facet, &
        shape%facet_point)
    end if
    if (shape%smallest_edge <= 0.0_wp) then   ! of the cube with the same volume over surface
      call volume_and_centroid(shape%point, shape%tet, shape%volume, centroid)
      shape%smallest_edge = 6.0_wp*shape%volume/surface_area(shape%point, shape%triangle)
    end if
    if (trim(input%kind) == 'rock' .and. &
        (shape%smallest_edge < shortest .or. shape%smallest_edge > longest)) then
      message = given_size(input)//': the stone '//trim(shape%name)//' is ' &
        //to_text(shape%smallest_edge)//' m thick, it must be between '//to_text(shortest) &
        //' and '//to_text(longest)//' m'
      return
    end if
    ! Mass: the sums over the fewest tetrahedra have the least round-off.
    call volume_and_centroid(shape%point, shape%flow_tet, shape%volume, centroid)
    shape%point = shape%point - spread(centroid, 2, size(shape%point, 2))
    shape%inertia = inertia_about_origin(shape%point, shape%flow_tet, shape%density)
    call place_spheres(input, shape, message)
    if (len(message) > 0) return
    shape%radius = max(maxval(norms(shape%point)), &
                       maxval(norms(shape%sphere_centre) + shape%sphere_radius))
  end subroutine make_shape

  !> Contact spheres as the group asks for; `message` says if they would be too many.
  subroutine place_spheres(input, shape, message)
    type(shape_input_t), intent(in) :: input
    type(shape_t), intent(inout) :: shape
    character(:), allocatable, intent(out) :: message
    real(wp) :: spacing, expected

    message = ''
    if (shape%kind == 'sphere') then
      allocate (shape%sphere_centre(3, 1), source=0.0_wp)
      allocate (shape%sphere_radius(1), source=0.5_wp*input%size(1))   ! the true radius
      return
    end if
    select case (trim(input%spheres))
    case ('dense')
      spacing = input%sphere_spacing
      if (spacing <= 0.0_wp) spacing = dense_spacing*shape%smallest_edge
      expected = max(surface_area(shape%point, shape%triangle)/spacing**2, &
                     real(size(shape%facet), wp))
      if (expected > max_spheres) then
        message = 'sphere_spacing = '//to_text(spacing)//': about '//to_text(nint(min(expected, &
          1.0e9_wp)))//' contact spheres, at most '//to_text(nint(max_spheres))
      else if (spacing > shape%smallest_edge) then
        message = 'sphere_spacing = '//to_text(spacing)//': leaves gaps as wide as the block, ' &
          //'must be at most its smallest edge, '//to_text(shape%smallest_edge)//' m'
      end if
      if (len(message) > 0) return
      call place_densely(spacing, shape)
      if (size(shape%sphere_radius) == 0) message = 'sphere_spacing = '//to_text(spacing) &
        //': no contact sphere finds room, it must be smaller'
    case ('inscribed', 'centroid')
      call place_in_tets(trim(input%spheres) == 'inscribed', shape)
    case default; error stop 'place_spheres: no such contact spheres'
    end select
  end subroutine place_spheres

  !> Tetrahedra of a file, in its axes.
  subroutine build_from_file(input, shape, message)
    type(shape_input_t), intent(in) :: input
    type(shape_t), intent(inout) :: shape
    character(:), allocatable, intent(out) :: message
    real(wp) :: extent

    call read_shape_file(found_file(input%file), shape%point, shape%tet, message)
    if (len(message) == 0) call check_mesh(shape%point, shape%tet, message)
    if (len(message) > 0) then
      message = 'file = '//quoted_text(input%file)//': '//message
      return
    end if
    shape%point = input%scale*shape%point
    extent = maxval(maxval(shape%point, 2) - minval(shape%point, 2))
    if (extent < shortest .or. extent > longest) then
      message = 'scale = '//to_text(input%scale)//': the block of '//quoted_text(input%file) &
        //' is '//to_text(extent)//' m long, it must be between '//to_text(shortest)//' and ' &
        //to_text(longest)//' m'
    end if
  end subroutine build_from_file

  !> A stone of a family.
  subroutine build_stone(input, shape, message)
    type(shape_input_t), intent(in) :: input
    type(shape_t), intent(inout) :: shape
    character(:), allocatable, intent(out) :: message
    logical :: found

    message = ''
    if (.not. share_in_grade(input) >= min_share) then
      message = 'mass_min = '//to_text(input%mass_min)//', mass_max = '//to_text(input%mass_max) &
        //': leave '//to_text(max(share_in_grade(input), 0.0_wp))//' of the stones of mass_50 = ' &
        //to_text(input%mass_50)//' and uniformity = '//to_text(input%uniformity) &
        //', must leave at least '//to_text(min_share)
      return
    end if
    call build_rock(input, shape, found)
    if (.not. found) message = 'blockiness = '//to_text(input%blockiness)//': no stone ' &
      //trim(shape%name)//' of this blockiness was found; try another seed'
  end subroutine build_stone

  !> Points, tetrahedra, facets and smallest edge of a block.
  subroutine build_form(input, shape)
    type(shape_input_t), intent(in) :: input
    type(shape_t), intent(inout) :: shape
    integer, parameter :: single(1, 1, 1) = 1
    type(line_t) :: line(3)
    real(wp) :: bar(3), edge
    integer :: r, d

    r = input%refinement
    associate (size => input%size)
      shape%smallest_edge = size(1)
      select case (trim(input%kind))
      case ('hexapod')
        do d = 1, 3
          line(d) = line_of(spread(size(1), 1, 3), [r, r, r])
        end do
        call build_cuboids(hexapod_cubes(), line, shape)
      case ('cube')
        do d = 1, 3
          line(d) = line_of(size(1:1), [r])
        end do
        call build_cuboids(single, line, shape)
      case ('box')
        edge = minval(size)   ! of the cuboids, longer in a plate that would have too many
        do while (product(max(1.0_wp, anint(size/edge))) > max_cuboids/real(r, wp)**3)
          edge = 2*edge
        end do
        do d = 1, 3
          line(d) = line_of(size(d:d), [r*max(1, nint(size(d)/edge))])
        end do
        call build_cuboids(single, line, shape)
        shape%smallest_edge = minval(size)
      case ('reef_cube')
        bar = [reef_frame, 1.0_wp - 2.0_wp*reef_frame, reef_frame]
        do d = 1, 3
          line(d) = line_of(bar*size(1), r*nint(bar/reef_frame))
        end do
        call build_cuboids(1 - hexapod_cubes(), line, shape)   ! the frame around a hexapod
        shape%smallest_edge = reef_frame*size(1)
      case ('sphere')
        call build_sphere(0.5_wp*size(1), sphere_frequency*r, shape)
      case ('cylinder')
        call build_cylinder(size(1), size(2), r, shape)
        shape%smallest_edge = minval(size(:2))
      case ('tetrapod')
        call build_tetrapod(size(1), r, shape)
        shape%smallest_edge = tetrapod_tip*size(1)
      case ('dolos')
        call build_dolos(size(1), r, shape)
        shape%smallest_edge = dolos_tip*size(1)
      case default
        error stop 'build_form: unknown kind'
      end select
    end associate
  end subroutine build_form

  !> What is wrong with a `&shape` group; empty if nothing is.
  pure function problem_with(input) result(message)
    type(shape_input_t), intent(in) :: input
    character(:), allocatable :: message
    real(wp) :: most

    message = ''
    select case (trim(input%kind))
    case ('hexapod', 'cube', 'sphere', 'tetrapod', 'dolos', 'reef_cube', 'box', 'cylinder', &
      'rock', 'file')
    case default
      message = 'kind = '''//trim(input%kind)//''' is unknown'
      return
    end select
    if (any(input%size(:size_count(input%kind)) <= 0.0_wp)) message = 'size must be positive [m]'
    if (input%density <= 0.0_wp) message = 'density must be positive [kg/m3]'
    if (input%refinement < 1 .or. input%refinement > max_refinement) then
      message = 'refinement must be 1 to 8'
    end if
    if (len(message) > 0) return
    if (input%kind == 'cylinder') then   ! its proportions say how finely it is cut
      most = aint(max_slender/sqrt(real(input%refinement, wp)))
      if (input%size(2) > most*input%size(1)) message = given_size(input)//': so slender a ' &
        //'cylinder would be cut too finely, its height must be at most '//to_text(nint(most)) &
        //' diameters with refinement = '//to_text(input%refinement)
    end if
  end function problem_with

  !> What says how large a block is, as the case may have it: `size = 1, 2`, `file = 'stone'`.
  pure function given_size(input) result(text)
    type(shape_input_t), intent(in) :: input
    character(:), allocatable :: text

    if (trim(input%kind) == 'file') then
      text = 'file = '//quoted_text(input%file)
      return
    end if
    text = 'size = '//to_text(input%size(:size_count(input%kind)))
    if (trim(input%kind) == 'rock') text = 'mass_50 = '//to_text(input%mass_50)
  end function given_size

  !> Occupied places of a hexapod in a block of 3 x 3 x 3 cubes.
  pure function hexapod_cubes() result(full)
    integer :: full(3, 3, 3)

    full = 0
    full(:, 2, 2) = 1
    full(2, :, 2) = 1
    full(2, 2, :) = 1
  end function hexapod_cubes

  !> Places along one direction: their widths, centred, each cut into parts of equal width.
  pure function line_of(width, parts) result(line)
    real(wp), intent(in) :: width(:)   !! [m]
    integer, intent(in) :: parts(:)
    type(line_t) :: line
    integer :: m, k, i

    allocate (line%x(0:sum(parts)), line%place(sum(parts)), line%plane(0:size(parts)))
    line%plane(0) = 0
    line%x(0) = -0.5_wp*sum(width)
    i = 0
    do m = 1, size(width)
      do k = 1, parts(m)
        i = i + 1
        line%place(i) = m
        line%x(i) = sum(width(:m - 1)) - 0.5_wp*sum(width) + width(m)*real(k, wp)/real(parts(m), wp)
      end do
      line%plane(m) = i
    end do
  end function line_of

  !> Tetrahedra and facets of a body made of cuboids on a lattice, centred at the origin.
  pure subroutine build_cuboids(full, line, shape)
    integer, intent(in) :: full(:, :, :)   !! 1 where a cuboid stands
    type(line_t), intent(in) :: line(3)    !! places in x, y, z
    type(shape_t), intent(inout) :: shape
    integer :: fine(size(line(1)%place), size(line(2)%place), size(line(3)%place))
    integer, allocatable :: number(:, :, :), corner(:, :, :)
    integer :: i, j, k, m

    fine = full(line(1)%place, line(2)%place, line(3)%place)
    allocate (number(0:size(fine, 1), 0:size(fine, 2), 0:size(fine, 3)), source=0)
    allocate (shape%tet(4, 5*sum(fine)), shape%flow_tet(4, 5*sum(full)))
    do k = 1, size(fine, 3)
      do j = 1, size(fine, 2)
        do i = 1, size(fine, 1)
          if (fine(i, j, k) == 1) number(i - 1:i, j - 1:j, k - 1:k) = 1
        end do
      end do
    end do
    allocate (shape%point(3, sum(number)))
    m = 0
    do k = 0, size(fine, 3)
      do j = 0, size(fine, 2)
        do i = 0, size(fine, 1)
          if (number(i, j, k) == 0) cycle
          m = m + 1
          number(i, j, k) = m
          shape%point(:, m) = [line(1)%x(i), line(2)%x(j), line(3)%x(k)]
        end do
      end do
    end do
    call cut_into_tets(fine, number, shape%tet)
    allocate (corner(size(full, 1) + 1, size(full, 2) + 1, size(full, 3) + 1), &
              source=number(line(1)%plane, line(2)%plane, line(3)%plane))
    call cut_into_tets(full, corner, shape%flow_tet)
    call cuboid_facets(full, corner, shape)
  end subroutine build_cuboids

  !> Five tetrahedra in every cuboid present.
  pure subroutine cut_into_tets(full, number, tet)
    integer, intent(in) :: full(:, :, :)        !! 1 where a cuboid stands
    integer, intent(in) :: number(:, :, :)      !! of the lattice points
    integer, intent(out) :: tet(:, :)           !! (4, 5*cuboids)
    integer :: corner(8), i, j, k, m, t

    m = 0
    do k = 1, size(full, 3)
      do j = 1, size(full, 2)
        do i = 1, size(full, 1)
          if (full(i, j, k) == 0) cycle
          corner = reshape(number(i:i + 1, j:j + 1, k:k + 1), [8])
          do t = 1, 5
            m = m + 1
            tet(:, m) = corner(five_tets(:, t, mod(i + j + k, 2)))
          end do
        end do
      end do
    end do
  end subroutine cut_into_tets

  !> The free faces of the cuboids.
  pure subroutine cuboid_facets(full, number, shape)
    integer, intent(in) :: full(:, :, :)
    integer, intent(in) :: number(:, :, :)   !! of the lattice points
    type(shape_t), intent(inout) :: shape
    integer :: around(0:size(full, 1) + 1, 0:size(full, 2) + 1, 0:size(full, 3) + 1)
    integer :: face(4, 6*sum(full)), corner(8), i, j, k, d, s, m, c(3)

    around = 0
    around(1:size(full, 1), 1:size(full, 2), 1:size(full, 3)) = full
    m = 0
    do k = 1, size(full, 3)
      do j = 1, size(full, 2)
        do i = 1, size(full, 1)
          if (full(i, j, k) == 0) cycle
          corner = reshape(number(i:i + 1, j:j + 1, k:k + 1), [8])
          do d = 1, 3
            do s = 1, 2
              c = [i, j, k]
              c(d) = c(d) + 2*s - 3
              if (around(c(1), c(2), c(3)) == 1) cycle
              m = m + 1
              face(:, m) = corner(cuboid_face(:, s, d))
            end do
          end do
        end do
      end do
    end do
    shape%facet = [(1 + 4*i, i=0, m)]
    shape%facet_point = reshape(face(:, 1:m), [4*m])
  end subroutine cuboid_facets

  !> A sphere: an icosahedron with each face cut into frequency**2 triangles, blown up.
  !!
  !! The corners stand slightly outside the sphere so that the volume is the true one: mass and
  !! buoyancy are right. Each tetrahedron goes from the centre to a triangle.
  pure subroutine build_sphere(radius, frequency, shape)
    real(wp), intent(in) :: radius          !! [m]
    integer, intent(in) :: frequency        !! parts of an edge of the icosahedron
    type(shape_t), intent(inout) :: shape
    real(wp) :: vertex(3, 12), direction(3), volume
    real(wp), parameter :: same = 1.0e-8_wp   !! far below the spacing of the points [-]
    type(points_t) :: points
    integer :: face(3, 20), number(0:frequency, 0:frequency), centre, n_tet, f, i, j

    call make_icosahedron(vertex, face)
    points%same = same
    call find_or_add([0.0_wp, 0.0_wp, 0.0_wp], points, centre)
    n_tet = 0
    allocate (shape%tet(4, 20*frequency**2))
    do f = 1, 20
      do j = 0, frequency
        do i = 0, frequency - j
          direction = matmul(vertex(:, face(:, f)), real([frequency - i - j, i, j], wp))
          call find_or_add(direction/norm(direction), points, number(i, j))
        end do
      end do
      do j = 0, frequency - 1
        do i = 0, frequency - j - 1
          n_tet = n_tet + 1
          shape%tet(:, n_tet) = [centre, number(i, j), number(i + 1, j), number(i, j + 1)]
          if (i + j == frequency - 1) cycle
          n_tet = n_tet + 1
          shape%tet(:, n_tet) = [centre, number(i + 1, j), number(i + 1, j + 1), &
            number(i, j + 1)]
        end do
      end do
    end do
    shape%point = points%x(:, :points%n)
    call volume_and_centroid(shape%point, shape%tet, volume, direction)
    shape%point = shape%point*(radius*cube_root(4.0_wp*pi/(3.0_wp*volume)))
  end subroutine build_sphere

  !> Corners (edge 2) and outward faces of an icosahedron.
  pure subroutine make_icosahedron(vertex, face)
    real(wp), intent(out) :: vertex(3, 12)
    integer, intent(out) :: face(3, 20)
    real(wp), parameter :: golden = 0.5_wp*(1.0_wp + sqrt(5.0_wp))
    integer :: d, s, t, a, b, c, m

    m = 0
    do d = 0, 2
      do s = -1, 1, 2
        do t = -1, 1, 2
          m = m + 1
          vertex(:, m) = cshift([0.0_wp, real(s, wp), golden*real(t, wp)], d)
        end do
      end do
    end do
    m = 0
    do a = 1, 12
      do b = a + 1, 12
        do c = b + 1, 12
          if (.not. (joined(a, b) .and. joined(b, c) .and. joined(c, a))) cycle
          m = m + 1
          face(:, m) = [a, b, c]
          if (dot_product(vertex(:, a), cross(vertex(:, b), vertex(:, c))) < 0.0_wp) then
            face(:, m) = [a, c, b]
          end if
        end do
      end do
    end do
  contains
    pure logical function joined(i, j)
      integer, intent(in) :: i, j

      joined = norm(vertex(:, i) - vertex(:, j)) < 2.1_wp
    end function joined
  end subroutine make_icosahedron

end module shapes_builtin_m
