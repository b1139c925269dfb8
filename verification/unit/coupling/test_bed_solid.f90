!> The bed as a solid in the grid: tetrahedra and a closed surface of the right volume.
module test_bed_solid_m
  use kinds_m, only: wp
  use vectors_m, only: cross
  use polyhedron_m, only: tet_volume
  use case_types_m, only: case_t
  use grid_m, only: grid_t, grid_init
  use tet_mesh_m, only: shape_t
  use bed_file_m, only: bed_form_t
  use bed_m, only: bed_t, set_bed
  use bed_solid_m, only: make_bed_solid
  use check_m, only: check
  implicit none
  private
  public :: test_bed_solid

  character(4), parameter :: sides(2, 3) = 'slip'
  real(wp), parameter :: slope(3) = [0.31_wp, -0.17_wp, 0.02_wp]   !! z = slope.(x, y, 1)
  real(wp), parameter :: length(3) = [0.1_wp, 0.08_wp, 0.09_wp]    !! [m]
  integer, parameter :: cells(3) = [7, 5, 9]
  type(grid_t) :: grid
  type(shape_t) :: solid
  real(wp) :: centre(3), expected, tets(4), surface(4)

contains

  subroutine test_bed_solid()
    call slope_across_the_tank()
    expected = product(length(1:2))*(slope(1)*0.5_wp*length(1) + slope(2)*0.5_wp*length(2) &
                                     + slope(3) + grid%h(3))   ! down to a cell below the floor
    tets = by_tets()
    surface = by_surface()
    call check('volume of the tetrahedra', tets(1), expected, 1.0e-13_wp*expected)
    call check('volume inside the surface', surface(1), expected, 1.0e-13_wp*expected)
    call check('the same first moment', tets(2:4), surface(2:4), 1.0e-14_wp*expected)
    call check('the surface is closed', norm2(openness()), 0.0_wp, 1.0e-16_wp)
    call check('about a corner of cells', (centre - grid%origin)/grid%h, &
               anint((centre - grid%origin)/grid%h), 1.0e-12_wp)
  end subroutine test_bed_solid

  !> Two triangles that reach beyond the tank on all sides.
  subroutine slope_across_the_tank()
    type(case_t) :: case
    type(bed_form_t) :: form
    type(bed_t) :: bed
    character(:), allocatable :: message
    integer :: v

    case%grid%cells = cells
    case%grid%length = length
    case%boundary%kind = sides
    allocate (form%point(3, 4))
    form%point(1, :) = [-0.01_wp, 0.12_wp, 0.12_wp, -0.01_wp]
    form%point(2, :) = [-0.02_wp, -0.02_wp, 0.11_wp, 0.11_wp]
    do v = 1, 4
      form%point(3, v) = dot_product(slope, [form%point(1:2, v), 1.0_wp])
    end do
    form%triangle = reshape([1, 2, 3, 1, 3, 4], [3, 2])
    form%checksum = ''
    call grid_init(case%grid, case%boundary, grid)
    call set_bed(case, form, bed, message)
    call check('the bed is made', message == '')
    call make_bed_solid(grid, bed, centre, solid)
  end subroutine slope_across_the_tank

  !> Volume and first moment about the centre, tetrahedron by tetrahedron [m3, m4].
  function by_tets() result(total)
    real(wp) :: total(4)
    integer :: t

    total = 0.0_wp
    do t = 1, size(solid%flow_tet, 2)
      total = total + moments(solid%point(:, solid%flow_tet(:, t)))
    end do
  end function by_tets

  !> The same between the centre and the triangles of the polygons.
  function by_surface() result(total)
    real(wp) :: total(4), corner(3, 4)
    integer :: m, v

    total = 0.0_wp
    corner = 0.0_wp
    do m = 1, size(solid%facet) - 1
      associate (p => solid%facet_point(solid%facet(m):solid%facet(m + 1) - 1))
        do v = 3, size(p)
          corner(:, 2:4) = solid%point(:, [p(1), p(v - 1), p(v)])
          total = total + moments(corner)
        end do
      end associate
    end do
  end function by_surface

  pure function moments(corner) result(m)
    real(wp), intent(in) :: corner(3, 4)
    real(wp) :: m(4)

    m = tet_volume(corner)*[1.0_wp, sum(corner, 2)/4.0_wp]
  end function moments

  !> Sum of the areas as vectors, zero for a closed surface [m2].
  function openness() result(total)
    real(wp) :: total(3)
    integer :: m, v

    total = 0.0_wp
    do m = 1, size(solid%facet) - 1
      associate (p => solid%facet_point(solid%facet(m):solid%facet(m + 1) - 1))
        do v = 3, size(p)
          total = total + 0.5_wp*cross(solid%point(:, p(v - 1)) - solid%point(:, p(1)), &
                                       solid%point(:, p(v)) - solid%point(:, p(1)))
        end do
      end associate
    end do
  end function openness

end module test_bed_solid_m
