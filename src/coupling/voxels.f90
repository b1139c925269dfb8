!> Bodies with their images in other periods, voxelised into the cells kept here: shares, links,
!! lists.
module voxels_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use grid_m, only: grid_t
  use solid_geometry_m, only: solid_geometry_t, clear_cells, clear_faces
  use share_lists_m, only: body_shares_t
  implicit none
  private
  public :: voxels_t, voxels_init, find_images, ensure_lists, place_bodies
  public :: voxelise_cells, voxelise_faces, voxelise_links, shorten_link

  real(wp), parameter :: min_link = 1.0e-3_wp      !! shortest distance from a centre to a wall [h]
  real(wp), parameter :: no_hit = 2.0_wp            !! longer than any link

  !> What is voxelised where.
  type :: voxels_t
    logical, allocatable :: near(:)               !! (n) present and in the cells kept here
    integer, allocatable :: first(:, :), last(:, :)   !! (3, n) periods its images are shifted by
    !> Images of body b: `first_image(b):first_image(b+1)-1`; of each (4, *) the cell in the place
    !! of the body's cell 0, and the number of its first tetrahedron less one.
    integer, allocatable :: first_image(:), image(:, :)
    !> First and last cell where the solids are kept: own cells and halo, less what is outside.
    integer :: low(3) = 1, high(3) = 0
    !> (2, cells listed) place in the list of the body; number of its first tetrahedron less one.
    integer, allocatable :: source(:, :)
  end type voxels_t

contains

  !> Nothing is near yet.
  subroutine voxels_init(grid, n, self)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: n   !! bodies
    type(voxels_t), intent(out) :: self

    self%low = merge(grid%first, max(grid%first, 1), grid%periodic)
    self%high = merge(grid%last, min(grid%last, grid%n), grid%periodic)
    allocate (self%near(n), source=.false.)
    allocate (self%first(3, n), self%last(3, n), source=0)
    allocate (self%first_image(n + 1), source=1)
    allocate (self%image(4, 0), self%source(2, 0))
  end subroutine voxels_init

  !> Images of body b, a ball at most, that touch the cells kept here.
  pure subroutine find_images(grid, b, x, radius, self)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: b
    real(wp), intent(in) :: x(3), radius   !! [m]
    type(voxels_t), intent(inout) :: self
    integer :: d, low, high

    do d = 1, 3
      low = grid%cell_of(x(d) - radius, d) - 1
      high = grid%cell_of(x(d) + radius, d) + 1
      if (grid%periodic(d)) then   ! numbers of periods by which they may be shifted
        self%first(d, b) = -floor_ratio(high - self%low(d), grid%n(d))
        self%last(d, b) = floor_ratio(self%high(d) - low, grid%n(d))
      else
        self%first(d, b) = 0
        self%last(d, b) = merge(0, -1, high >= self%low(d) .and. low <= self%high(d))
      end if
    end do
    self%near(b) = all(self%first(:, b) <= self%last(:, b))
  end subroutine find_images

  !> Largest whole number not above a/b, b > 0.
  elemental integer function floor_ratio(a, b)
    integer, intent(in) :: a, b

    floor_ratio = (a - modulo(a, b))/b
  end function floor_ratio

  !> Lists long enough for all bodies in all their images; they grow by doubling.
  subroutine ensure_lists(body, self, solid)
    type(body_shares_t), intent(in) :: body(:)
    type(voxels_t), intent(inout) :: self
    type(solid_geometry_t), intent(inout) :: solid
    integer :: b, copies, images, cells, faces, links, tets, n

    n = size(body) + 1
    if (size(solid%body_cell) /= n) then
      deallocate (solid%body_cell, solid%body_face, solid%tets%of_body)
      allocate (solid%body_cell(n), solid%body_face(n), solid%tets%of_body(n), source=1)
    end if
    images = 0
    cells = 0
    faces = 0
    links = 0
    tets = 0
    do b = 1, n - 1
      if (.not. self%near(b)) cycle
      copies = product(self%last(:, b) - self%first(:, b) + 1)
      images = images + copies
      cells = cells + copies*body(b)%n_cell
      faces = faces + copies*body(b)%n_face
      links = links + copies*(body(b)%n_hit + 6*body(b)%n_cell)
      tets = tets + (1 + copies)*size(body(b)%corner, 3)
    end do
    call ensure_capacity(images, self%image, rows=4)
    call ensure_capacity(cells, solid%cell)
    call ensure_capacity(cells, solid%cell_alpha)
    call ensure_capacity(cells, solid%cell_centroid)
    call ensure_capacity(cells, solid%cut_cell)
    call ensure_capacity(cells + 1, solid%tets%first)
    call ensure_capacity(cells, solid%closed_cell)
    call ensure_capacity(cells, solid%tets%of_cell)
    call ensure_capacity(cells, self%source)
    call ensure_capacity(faces, solid%face)
    call ensure_capacity(faces, solid%face_beta)
    call ensure_capacity(faces, solid%face_centroid)
    call ensure_capacity(links, solid%link)
    call ensure_capacity(links, solid%link_length)
    call ensure_capacity(links, solid%link_body)
    if (size(solid%tets%corner, 3) < tets) then
      tets = max(tets, 2*size(solid%tets%corner, 3))
      deallocate (solid%tets%corner)
      allocate (solid%tets%corner(3, 4, tets))
    end if
  end subroutine ensure_lists

  !> List the images, and put the tetrahedra in space: first of all bodies where they are, then of
  !! their images elsewhere.
  pure subroutine place_bodies(grid, body, self, solid)
    type(grid_t), intent(in) :: grid
    type(body_shares_t), intent(in) :: body(:)
    type(voxels_t), intent(inout) :: self
    type(solid_geometry_t), intent(inout) :: solid
    integer :: b, i, j, k, m, first_tet

    solid%tets%of_body(1) = 1
    solid%tets%n = 0
    do b = 1, size(body)
      if (self%near(b)) call place_tets(grid, body(b), body(b)%base, solid)
      solid%tets%of_body(b + 1) = solid%tets%n + 1
    end do
    m = 0
    do b = 1, size(body)
      self%first_image(b) = m + 1
      if (.not. self%near(b)) cycle
      do k = self%first(3, b), self%last(3, b)
        do j = self%first(2, b), self%last(2, b)
          do i = self%first(1, b), self%last(1, b)
            associate (offset => body(b)%base + [i, j, k]*grid%n)
              first_tet = solid%tets%of_body(b)
              if (any([i, j, k] /= 0)) then
                first_tet = solid%tets%n + 1
                call place_tets(grid, body(b), offset, solid)
              end if
              m = m + 1
              self%image(:, m) = [offset, first_tet - 1]
            end associate
          end do
        end do
      end do
    end do
    self%first_image(size(body) + 1) = m + 1
  end subroutine place_bodies

  !> Append the tetrahedra of a body at the place of one image.
  pure subroutine place_tets(grid, body, offset, solid)
    type(grid_t), intent(in) :: grid
    type(body_shares_t), intent(in) :: body
    integer, intent(in) :: offset(3)
    type(solid_geometry_t), intent(inout) :: solid
    integer :: t, v

    do t = 1, size(body%corner, 3)
      solid%tets%n = solid%tets%n + 1
      do v = 1, 4
        solid%tets%corner(:, v, solid%tets%n) = grid%origin + &
                                          (real(offset, wp) + body%corner(:, v, t))*grid%h
      end do
    end do
  end subroutine place_tets

  !> Shares of cells, and the centres that are inside.
  pure subroutine voxelise_cells(grid, body, self, solid)
    type(grid_t), intent(in) :: grid
    type(body_shares_t), intent(in) :: body(:)
    type(voxels_t), intent(inout) :: self
    type(solid_geometry_t), intent(inout) :: solid
    integer :: b, image, m, n, i(3)

    call clear_cells(solid)
    n = 0
    do b = 1, size(body)
      solid%body_cell(b) = n + 1
      do image = self%first_image(b), self%first_image(b + 1) - 1
        do m = 1, body(b)%n_cell
          i = self%image(1:3, image) + body(b)%cell(:, m)
          if (any(i < self%low) .or. any(i > self%high)) cycle
          n = n + 1
          self%source(:, n) = [m, self%image(4, image)]
          solid%cell(:, n) = i
          solid%cell_alpha(n) = body(b)%alpha(m)
          solid%cell_centroid(:, n) = grid%origin + &
                                      (real(i - 1, wp) + body(b)%centroid(:, m))*grid%h
          solid%alpha(i(1), i(2), i(3)) = solid%alpha(i(1), i(2), i(3)) + body(b)%alpha(m)
          if (body(b)%inside(m) .and. solid%inside(i(1), i(2), i(3)) == 0) then
            solid%inside(i(1), i(2), i(3)) = b
          end if
        end do
      end do
    end do
    solid%body_cell(size(body) + 1) = n + 1
  end subroutine voxelise_cells

  !> Shares of faces, with those on the far sides of the domain.
  pure subroutine voxelise_faces(grid, body, self, solid)
    type(grid_t), intent(in) :: grid
    type(body_shares_t), intent(in) :: body(:)
    type(voxels_t), intent(in) :: self
    type(solid_geometry_t), intent(inout) :: solid
    integer :: b, image, m, n, f(4)

    call clear_faces(grid, solid)
    n = 0
    do b = 1, size(body)
      solid%body_face(b) = n + 1
      do image = self%first_image(b), self%first_image(b + 1) - 1
        do m = 1, body(b)%n_face
          f = body(b)%face(:, m)
          f(1:3) = f(1:3) + self%image(1:3, image)
          if (.not. kept_face(self, grid, f)) cycle
          n = n + 1
          solid%face(:, n) = f
          solid%face_beta(n) = body(b)%beta(m)
          solid%face_centroid(:, n) = grid%origin + &
                                      (real(f(1:3) - 1, wp) + body(b)%face_centroid(:, m))*grid%h
          solid%aperture(f(1), f(2), f(3), f(4)) = solid%aperture(f(1), f(2), f(3), f(4)) &
                                                   - body(b)%beta(m)
        end do
      end do
    end do
    solid%body_face(size(body) + 1) = n + 1
  end subroutine voxelise_faces

  !> Is the lower face f of a cell kept? Those on the far sides of the domain are.
  pure logical function kept_face(self, grid, f)
    type(voxels_t), intent(in) :: self
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: f(4)   !! cell and direction
    integer :: high(3)

    high = self%high
    if (.not. grid%periodic(f(4))) high(f(4)) = min(high(f(4)) + 1, grid%last(f(4)))
    kept_face = all(f(1:3) >= self%low) .and. all(f(1:3) <= high)
  end function kept_face

  !> Nearest hits from both ends of the links; what lies behind a side of the domain does not count.
  pure subroutine voxelise_links(grid, body, self, solid)
    type(grid_t), intent(in) :: grid
    type(body_shares_t), intent(in) :: body(:)
    type(voxels_t), intent(in) :: self
    type(solid_geometry_t), intent(inout) :: solid
    integer :: b, image, m, f(4)

    do m = 1, solid%n_link   ! take away what the list of the last time says was there
      f = solid%link(:, m)
      solid%link_number(f(1), f(2), f(3), f(4)) = 0
    end do
    solid%n_link = 0
    do b = 1, size(body)
      do image = self%first_image(b), self%first_image(b + 1) - 1
        do m = 1, body(b)%n_hit
          f = body(b)%hit(:, m)
          f(1:3) = f(1:3) + self%image(1:3, image)
          if (.not. kept_face(self, grid, f)) cycle
          if (.not. grid%periodic(f(4))) then
            if (f(f(4)) == 1 .and. body(b)%at(m) < 0.5_wp) cycle
            if (f(f(4)) == grid%n(f(4)) + 1 .and. body(b)%at(m) > 0.5_wp) cycle
          end if
          call shorten_link(f, body(b)%at(m), b, solid)
        end do
      end do
    end do
  end subroutine voxelise_links

  !> Body b meets a link at a place between 0 (lower centre) and 1.
  pure subroutine shorten_link(f, at, b, solid)
    integer, intent(in) :: f(4), b
    real(wp), intent(in) :: at
    type(solid_geometry_t), intent(inout) :: solid

    associate (m => solid%link_number(f(1), f(2), f(3), f(4)))
      if (m == 0) then
        solid%n_link = solid%n_link + 1
        m = solid%n_link
        solid%link(:, m) = f
        solid%link_length(:, m) = no_hit
      end if
      where (max([at, 1.0_wp - at], min_link) < solid%link_length(:, m))
        solid%link_length(:, m) = max([at, 1.0_wp - at], min_link)
        solid%link_body(:, m) = b
      end where
    end associate
  end subroutine shorten_link

end module voxels_m
