!> What the flow has to know about the solids in the grid: shares, open faces, wall distances.
!!
!! Data: `coupling/solid_fraction.f90` fills it from the tetrahedra of the bodies, the flow
!! reads it, and neither package knows the other.
module solid_geometry_m
  use kinds_m, only: wp
  use grid_m, only: grid_t, unit_step
  implicit none
  private
  public :: solid_geometry_t, solid_geometry_init, set_faces, apertures, mean_apertures
  public :: wall_area, edge_in, centre_in_fluid
  public :: link_to_wall, bounded_link
  public :: clear_cells, clear_faces, hand_over_faces

  !> Tetrahedra of all bodies present, in space. Of the bed some may have negative volume: what they
  !! hold is taken away again (see `bed_solid_m`).
  type :: solid_tets_t
    integer :: n = 0
    real(wp), allocatable :: corner(:, :, :)    !! (3, 4, n) [m]
    integer, allocatable :: of_body(:)          !! (n_bodies + 1) of b: of_body(b):of_body(b+1)-1
    !> Those that may reach into cut cell m: `list(first(m):first(m+1)-1)`, body by body; entry e of
    !! the cells by body has the part `list(of_cell(1, e):of_cell(2, e))`, none if it is not cut.
    integer, allocatable :: first(:), list(:)
    integer, allocatable :: of_cell(:, :)       !! (2, *)
  end type solid_tets_t

  type :: solid_geometry_t
    integer :: poses = 0   !! number of the poses of all bodies that it was filled for, 0: of none
    real(wp), allocatable :: alpha(:, :, :)     !! solid share of the cell, all bodies, 0..1 [-]
    real(wp), allocatable :: aperture(:, :, :, :)   !! open share w of the lower face area, 0..1 [-]
    !> Effective aperture, through which pressure moves fluid; what it lacks of `aperture` moves
    !! with a body (`effective_aperture_m`).
    real(wp), allocatable :: effective(:, :, :, :)
    integer, allocatable :: inside(:, :, :)     !! body whose solid holds the cell centre, 0: fluid
    !> Links between the centres of the two cells of a lower face d: `link_number(i,j,k,d)` is the
    !! number of one that meets a surface in the lists, 0 where it is free.
    integer, allocatable :: link_number(:, :, :, :)
    integer :: n_link = 0
    integer, allocatable :: link(:, :)           !! (4, n_link) cell index and direction of the face
    !> Distances from the lower cell (i-1) up to the first surface and from the upper cell (i) down
    !! to the first surface, in units of h(d), 0..1, and the bodies that are hit there.
    real(wp), allocatable :: link_length(:, :)   !! (2, n_link)
    integer, allocatable :: link_body(:, :)      !! (2, n_link)

    type(solid_tets_t) :: tets
    !> Cut cells (0 < alpha < 1): `cut(i,j,k)` is the number m of the cell in the lists, or 0.
    integer :: n_cut = 0
    integer, allocatable :: cut(:, :, :)
    integer, allocatable :: cut_cell(:, :)      !! (3, n_cut)
    real(wp), allocatable :: edge(:)
      !! (n_cut) 0: the wall in the cell is nearly plane, 1: it has an edge (`effective_aperture_m`)

    !> Per body b: cells `body_cell(b):body_cell(b+1)-1` with its own share and its centroid there.
    integer, allocatable :: body_cell(:)        !! (n_bodies + 1)
    integer, allocatable :: cell(:, :)          !! (3, *) cell index
    real(wp), allocatable :: cell_alpha(:)      !! share of the cell volume [-]
    real(wp), allocatable :: cell_centroid(:, :) !! (3, *) centroid of the solid part [m]
    !> Per body b: faces `body_face(b):body_face(b+1)-1` with its own share and its centroid there.
    integer, allocatable :: body_face(:)
    integer, allocatable :: face(:, :)          !! (4, *) cell index and direction of the lower face
    real(wp), allocatable :: face_beta(:)       !! share of the face area [-]
    real(wp), allocatable :: face_centroid(:, :) !! (3, *) [m]
    !> Per body b: faces `first_held(b):first_held(b+1)-1` with fluid that moves with it.
    integer, allocatable :: first_held(:)
    integer, allocatable :: held_face(:, :)     !! (4, *) cell index and direction of the lower face
    real(wp), allocatable :: held_share(:)      !! of the face area [-]
    !> The lists hold the cells and faces of the halo too, also as images in other periods, with the
    !! centroids at the place of the image. What else to clear before the next filling: cells closed
    !! all round because bodies overlap there or the cell is sealed in.
    integer :: n_closed = 0
    integer, allocatable :: closed_cell(:, :)   !! (3, *)
  end type solid_geometry_t

contains

  !> Allocate the arrays over cells for a domain without solids.
  subroutine solid_geometry_init(grid, solid, n_bodies)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(out) :: solid
    integer, intent(in), optional :: n_bodies   !! length of the lists by body
    integer :: a(3), b(3), n

    a = grid%first
    b = grid%last
    allocate (solid%alpha(a(1):b(1), a(2):b(2), a(3):b(3)), source=0.0_wp)
    allocate (solid%aperture(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=1.0_wp)
    allocate (solid%effective, source=solid%aperture)
    allocate (solid%inside(a(1):b(1), a(2):b(2), a(3):b(3)), source=0)
    allocate (solid%link_number(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0)
    allocate (solid%link(4, 0), solid%link_length(2, 0), solid%link_body(2, 0))
    allocate (solid%cut(a(1):b(1), a(2):b(2), a(3):b(3)), source=0)
    allocate (solid%tets%corner(3, 4, 0), solid%tets%list(0), solid%tets%of_cell(2, 0))
    allocate (solid%tets%first(1), source=1)
    n = 0
    if (present(n_bodies)) n = n_bodies
    allocate (solid%body_cell(n + 1), solid%body_face(n + 1), solid%tets%of_body(n + 1), source=1)
    allocate (solid%held_face(4, 0), solid%held_share(0))
    allocate (solid%first_held, source=solid%body_face)
    allocate (solid%cell(3, 0), solid%cell_alpha(0), solid%cell_centroid(3, 0))
    allocate (solid%face(4, 0), solid%face_beta(0), solid%face_centroid(3, 0))
    allocate (solid%edge(0), solid%cut_cell(3, 0))
    allocate (solid%closed_cell(3, 0))
  end subroutine solid_geometry_init

  !> Open shares of the lower (:, 1) and upper (:, 2) faces of cell c.
  pure function apertures(grid, aperture, c) result(w)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: aperture(grid%first(1):, grid%first(2):, grid%first(3):, :)
    integer, intent(in) :: c(3)
    real(wp) :: w(3, 2)
    integer :: d, f(3)

    do d = 1, 3
      f = c + unit_step(:, d)
      w(d, 1) = aperture(c(1), c(2), c(3), d)
      w(d, 2) = aperture(f(1), f(2), f(3), d)
    end do
  end function apertures

  !> Mean aperture of the two faces of each direction: share of the cell's mass that moves with that
  !! component of the velocity.
  pure function mean_apertures(grid, aperture, c) result(w)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: aperture(grid%first(1):, grid%first(2):, grid%first(3):, :)
    integer, intent(in) :: c(3)
    real(wp) :: w(3)

    w = 0.5_wp*sum(apertures(grid, aperture, c), 2)
  end function mean_apertures

  !> Is c a cell of the domain with its centre in the fluid?
  pure function centre_in_fluid(grid, solid, c) result(yes)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: c(3)
    logical :: yes

    yes = .not. grid%outside(c)
    if (yes) yes = solid%inside(c(1), c(2), c(3)) == 0
  end function centre_in_fluid

  !> Area of the wall in cell c as a vector into the fluid: what its open faces lack to close [m2].
  pure function wall_area(grid, solid, c) result(area)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: c(3)
    real(wp) :: area(3)
    real(wp) :: w(3, 2)

    w = apertures(grid, solid%aperture, c)
    area = grid%area*(w(:, 2) - w(:, 1))
  end function wall_area

  !> How much of an edge cell c has, 0 if it is not cut.
  pure function edge_in(solid, c) result(edge)
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: c(3)
    real(wp) :: edge

    edge = 0.0_wp
    if (solid%cut(c(1), c(2), c(3)) > 0) edge = solid%edge(solid%cut(c(1), c(2), c(3)))
  end function edge_in

  !> Length of the link from the centre of cell c along +d or -d to the surface of a body [cells];
  !! 0: it meets none.
  pure function link_to_wall(solid, c, d, sense) result(length)
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: c(3), d, sense
    real(wp) :: length
    integer :: f(3), m

    f = c
    if (sense > 0) f = c + unit_step(:, d)
    m = solid%link_number(f(1), f(2), f(3), d)
    length = 0.0_wp
    if (m > 0) length = bounded_link(solid%link_length(merge(1, 2, sense > 0), m))
  end function link_to_wall

  !> Length of a link that pulls: no centre is nearer to a wall than this [cells].
  elemental function bounded_link(theta) result(length)
    real(wp), intent(in) :: theta   !! to the surface [cells]
    real(wp) :: length
    real(wp), parameter :: least = 1.0e-3_wp

    length = min(max(theta, least), 1.0_wp)
  end function bounded_link

  !> Take away what the lists of the last time say was there: what bodies fill of cells.
  pure subroutine clear_cells(solid)
    type(solid_geometry_t), intent(inout) :: solid
    integer :: m

    do m = 1, solid%body_cell(size(solid%body_cell)) - 1
      associate (i => solid%cell(:, m))
        solid%alpha(i(1), i(2), i(3)) = 0.0_wp
        solid%inside(i(1), i(2), i(3)) = 0
        solid%cut(i(1), i(2), i(3)) = 0
      end associate
    end do
  end subroutine clear_cells

  !> The same of faces, with those of cells closed all round.
  pure subroutine clear_faces(grid, solid)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(inout) :: solid
    integer :: m

    do m = 1, solid%body_face(size(solid%body_face)) - 1
      associate (i => solid%face(:, m))
        solid%aperture(i(1), i(2), i(3), i(4)) = 1.0_wp
      end associate
    end do
    do m = 1, solid%n_closed
      call set_faces(grid, solid%closed_cell(:, m), 1.0_wp, solid)
    end do
    solid%n_closed = 0
  end subroutine clear_faces

  !> Effective apertures and links go from one geometry to another.
  subroutine hand_over_faces(from, to)
    type(solid_geometry_t), intent(inout) :: from, to

    call move_alloc(from%effective, to%effective)
    call move_alloc(from%link_number, to%link_number)
    call move_alloc(from%link, to%link)
    call move_alloc(from%link_length, to%link_length)
    call move_alloc(from%link_body, to%link_body)
    to%n_link = from%n_link
    from%n_link = 0
  end subroutine hand_over_faces

  !> Give the six faces of a cell an open share, as far as they are in the arrays.
  pure subroutine set_faces(grid, cell, aperture, solid)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: cell(3)
    real(wp), intent(in) :: aperture
    type(solid_geometry_t), intent(inout) :: solid
    integer :: d, i(3)

    do d = 1, 3
      solid%aperture(cell(1), cell(2), cell(3), d) = aperture
      i = cell + unit_step(:, d)
      if (i(d) <= grid%last(d)) solid%aperture(i(1), i(2), i(3), d) = aperture
    end do
  end subroutine set_faces

end module solid_geometry_m
