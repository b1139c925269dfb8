!> The bodies and the bed in the grid: solid shares, wall distances, cut cells, sealed pockets.
!!
!! Every process fills its own cells and halo, images in other periods included, from the poses of
!! the bodies alone; nothing is exchanged but the flags of pockets, where there are any. The bed is
!! one more fixed body, the last; its shares are found once.
module solid_fraction_m
  use omp_lib, only: omp_get_max_threads, omp_get_thread_num
  use kinds_m, only: wp, i8
  use growing_m, only: ensure_room
  use grid_m, only: grid_t, n_halo, unit_step, side_no_slip, side_slip
  use solid_geometry_m, only: solid_geometry_t, no_hit
  use tet_mesh_m, only: shape_t
  use rigid_body_m, only: blocks_t
  use bed_m, only: bed_t
  use bed_solid_m, only: make_bed_solid
  use body_shares_m, only: body_shares_t, share_work_t, find_body_shares, list_cut_tets, &
    full_cell, full_face
  use subcell_shares_m, only: subcell_work_t, count_subcells
  use parallel_m, only: halo_exchange, global_sum
  implicit none
  private
  public :: solid_fraction_t, solid_fraction_init, update_solid

  real(wp), parameter :: least_leg = 1.0e-3_wp      !! shortest distance from a centre to a wall [h]

  type :: solid_fraction_t
    type(body_shares_t), allocatable :: body(:)   !! (n) what is known of each body, and of the bed
    logical :: has_bed = .false.
    type(shape_t) :: bed                          !! the part of it in the grid, about its centre
    real(wp) :: bed_centre(3) = 0.0_wp            !! [m]
    type(share_work_t), allocatable :: work(:)    !! (threads)
    integer :: subcells = 0                       !! per direction, 0: exact shares
    type(subcell_work_t), allocatable :: count(:) !! (threads)
    logical, allocatable :: near(:)               !! (n) present and in the cells kept here
    integer, allocatable :: first(:, :), last(:, :)   !! (3, n) periods its images are shifted by
    !> First and last cell where the solids are kept: own cells and halo, less what is outside.
    integer :: low(3) = 1, high(3) = 0
    !> (2, cells listed) place in the list of the body; number of its first tetrahedron less one.
    integer, allocatable :: source(:, :)
    logical, allocatable :: reached(:)            !! (cut cells) fluid gets there from uncut cells
    integer, allocatable :: stack(:)
    integer, allocatable :: flag(:, :, :)         !! the same on the grid, for the exchange
  end type solid_fraction_t

contains

  !> Allocate the caches and work arrays.
  subroutine solid_fraction_init(grid, blocks, self, subcells, bed)
    type(grid_t), intent(in) :: grid
    type(blocks_t), intent(in) :: blocks
    type(solid_fraction_t), intent(out) :: self
    integer, intent(in), optional :: subcells   !! counted per direction, else exact shares
    type(bed_t), intent(in), optional :: bed
    integer :: a(3), b(3), n

    a = grid%first
    b = grid%last
    self%low = merge(a, max(a, 1), grid%periodic)
    self%high = merge(b, min(b, grid%n), grid%periodic)
    if (present(subcells)) self%subcells = subcells
    if (present(bed)) self%has_bed = bed%there
    if (self%has_bed) call make_bed_solid(grid, bed, self%bed_centre, self%bed)
    n = blocks%n
    if (self%has_bed) n = n + 1
    allocate (self%body(n), self%work(0:omp_get_max_threads() - 1))
    allocate (self%count(0:omp_get_max_threads() - 1))
    allocate (self%near(n), source=.false.)
    allocate (self%first(3, n), self%last(3, n), source=0)
    allocate (self%source(2, 0), self%reached(0), self%stack(0))
    allocate (self%flag(a(1):b(1), a(2):b(2), a(3):b(3)), source=0)
  end subroutine solid_fraction_init

  !> Fill the solid geometry for the poses of the bodies present.
  subroutine update_solid(self, grid, blocks, solid)
    type(solid_fraction_t), intent(inout) :: self
    type(grid_t), intent(in) :: grid
    type(blocks_t), intent(in) :: blocks
    type(solid_geometry_t), intent(inout) :: solid
    integer :: b

    call clear(grid, solid)
    call find_shares(grid, blocks, self)
    call ensure_lists(self, solid)
    call place_bodies(grid, self, solid)
    do b = 1, size(self%body)
      call paint_body(self, grid, b, solid)
    end do
    if (self%has_bed) call make_way(size(self%body), solid)
    call finish_faces(solid)
    call finish_cells(grid, solid)
    call guard_legs(self, solid)
    call tets_of_cut_cells(self, solid)
    call close_pockets(grid, self, solid)
  end subroutine update_solid

  !> Take away what the lists of the last time say was there.
  subroutine clear(grid, solid)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(inout) :: solid
    integer :: m, n

    n = size(solid%body_cell)
    do m = 1, solid%body_cell(n) - 1
      associate (i => solid%cell(:, m))
        solid%alpha(i(1), i(2), i(3)) = 0.0_wp
        solid%inside(i(1), i(2), i(3)) = 0
        solid%cut(i(1), i(2), i(3)) = 0
      end associate
    end do
    do m = 1, solid%body_face(n) - 1
      associate (i => solid%face(:, m))
        solid%open(i(1), i(2), i(3), i(4)) = 1.0_wp
      end associate
    end do
    do m = 1, solid%n_leg
      associate (i => solid%leg(:, m))
        solid%leg_low(i(1), i(2), i(3), i(4)) = no_hit
        solid%leg_high(i(1), i(2), i(3), i(4)) = no_hit
        solid%leg_body_low(i(1), i(2), i(3), i(4)) = 0
        solid%leg_body_high(i(1), i(2), i(3), i(4)) = 0
      end associate
    end do
    do m = 1, solid%n_closed
      call set_faces(grid, solid%closed_cell(:, m), 1.0_wp, solid)
    end do
    solid%n_leg = 0
    solid%n_closed = 0
  end subroutine clear

  !> Give the six faces of a cell an open share, as far as they are in the arrays.
  pure subroutine set_faces(grid, cell, open, solid)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: cell(3)
    real(wp), intent(in) :: open
    type(solid_geometry_t), intent(inout) :: solid
    integer :: d, i(3)

    do d = 1, 3
      solid%open(cell(1), cell(2), cell(3), d) = open
      i = cell + unit_step(:, d)
      if (i(d) <= grid%last(d)) solid%open(i(1), i(2), i(3), d) = open
    end do
  end subroutine set_faces

  !> Shares of every body that is near the cells of this process and has moved.
  subroutine find_shares(grid, blocks, self)
    type(grid_t), intent(in) :: grid
    type(blocks_t), intent(in) :: blocks
    type(solid_fraction_t), intent(inout) :: self
    real(wp), parameter :: upright(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    integer :: b, t
    logical :: changed

    if (size(self%work) < omp_get_max_threads()) then
      deallocate (self%work, self%count)
      allocate (self%work(0:omp_get_max_threads() - 1), self%count(0:omp_get_max_threads() - 1))
    end if
    do b = 1, blocks%n
      self%near(b) = blocks%present(b)
      if (blocks%present(b)) then
        call find_images(self, grid, b, blocks%x(:, b), blocks%shapes(blocks%shape(b))%radius)
      end if
    end do
    !$omp parallel do private(t, changed) schedule(dynamic, 1) if (count(self%near) > 1)
    do b = 1, blocks%n
      if (.not. self%near(b)) cycle
      t = omp_get_thread_num()
      call find_body_shares(grid, blocks%shapes(blocks%shape(b)), blocks%x(:, b), blocks%q(:, b), &
                            self%work(t), self%body(b), changed)
      if (.not. changed) cycle
      if (self%subcells > 0) call count_subcells(self%subcells, self%count(t), self%body(b))
      call list_cut_tets(self%work(t), self%body(b))
    end do
    if (.not. self%has_bed) return
    b = size(self%body)
    self%near(b) = .true.   ! and it has no images
    call find_body_shares(grid, self%bed, self%bed_centre, upright, self%work(0), self%body(b), &
                          changed)
    if (changed) call list_cut_tets(self%work(0), self%body(b))
  end subroutine find_shares

  !> Images of body b, a ball at most, that touch the cells kept here.
  pure subroutine find_images(self, grid, b, x, radius)
    type(solid_fraction_t), intent(inout) :: self
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: b
    real(wp), intent(in) :: x(3), radius   !! [m]
    integer :: d, low, high

    do d = 1, 3
      low = grid%cell_of(x(d) - radius, d) - 1
      high = grid%cell_of(x(d) + radius, d) + 1
      call images(self, grid, d, low, high, self%first(d, b), self%last(d, b))
    end do
    self%near(b) = all(self%first(:, b) <= self%last(:, b))
  end subroutine find_images

  !> Numbers of periods by which cells low..high may be shifted to touch the cells kept here.
  pure subroutine images(self, grid, d, low, high, first, last)
    type(solid_fraction_t), intent(in) :: self
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: d, low, high
    integer, intent(out) :: first, last

    if (grid%periodic(d)) then
      first = -floor_ratio(high - self%low(d), grid%n(d))
      last = floor_ratio(self%high(d) - low, grid%n(d))
    else
      first = 0
      last = merge(0, -1, high >= self%low(d) .and. low <= self%high(d))
    end if
  end subroutine images

  !> Largest whole number not above a/b, b > 0.
  elemental integer function floor_ratio(a, b)
    integer, intent(in) :: a, b

    floor_ratio = (a - modulo(a, b))/b
  end function floor_ratio

  !> Lists long enough for all bodies in all their images; they grow by doubling.
  subroutine ensure_lists(self, solid)
    type(solid_fraction_t), intent(inout) :: self
    type(solid_geometry_t), intent(inout) :: solid
    integer :: b, copies, cells, faces, legs, tets, n

    n = size(self%body) + 1
    if (size(solid%body_cell) /= n) then
      deallocate (solid%body_cell, solid%body_face, solid%tets%of_body)
      allocate (solid%body_cell(n), solid%body_face(n), solid%tets%of_body(n))
    end if
    solid%body_cell(1) = 1
    solid%body_face(1) = 1
    cells = 0
    faces = 0
    legs = 0
    tets = 0
    do b = 1, n - 1
      if (.not. self%near(b)) cycle
      copies = product(self%last(:, b) - self%first(:, b) + 1)
      cells = cells + copies*self%body(b)%n_cell
      faces = faces + copies*self%body(b)%n_face
      legs = legs + copies*(self%body(b)%n_hit + 6*self%body(b)%n_cell)
      tets = tets + (1 + copies)*size(self%body(b)%corner, 3)
    end do
    call ensure_room(cells, solid%cell)
    call ensure_room(cells, solid%cell_alpha)
    call ensure_room(cells, solid%cell_centroid)
    call ensure_room(cells, solid%cut_cell)
    call ensure_room(cells + 1, solid%tets%first)
    call ensure_room(cells, solid%closed_cell)
    call ensure_room(cells, solid%tets%of_cell)
    call ensure_room(cells, self%source)
    call ensure_room(faces, solid%face)
    call ensure_room(faces, solid%face_beta)
    call ensure_room(faces, solid%face_centroid)
    call ensure_room(legs, solid%leg)
    if (size(solid%tets%corner, 3) < tets) then
      tets = max(tets, 2*size(solid%tets%corner, 3))
      deallocate (solid%tets%corner)
      allocate (solid%tets%corner(3, 4, tets))
    end if
  end subroutine ensure_lists

  !> Add one body with all its images.
  subroutine paint_body(self, grid, b, solid)
    type(solid_fraction_t), intent(inout) :: self
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: b
    type(solid_geometry_t), intent(inout) :: solid
    integer :: i, j, k, first_tet

    solid%body_cell(b + 1) = solid%body_cell(b)
    solid%body_face(b + 1) = solid%body_face(b)
    if (.not. self%near(b)) return
    do k = self%first(3, b), self%last(3, b)
      do j = self%first(2, b), self%last(2, b)
        do i = self%first(1, b), self%last(1, b)
          associate (offset => self%body(b)%base + [i, j, k]*grid%n)
            first_tet = solid%tets%of_body(b)
            if (any([i, j, k] /= 0)) then
              first_tet = solid%tets%n + 1
              call place_tets(grid, self%body(b), offset, solid)
            end if
            call paint_cells(self, grid, b, offset, first_tet, solid)
            call paint_faces(self, grid, self%body(b), b, offset, solid)
            call paint_legs(self, grid, self%body(b), b, offset, solid)
          end associate
        end do
      end do
    end do
  end subroutine paint_body

  !> Shares of cells, and the centres that are inside.
  subroutine paint_cells(self, grid, b, offset, first_tet, solid)
    type(solid_fraction_t), intent(inout) :: self
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: b, offset(3), first_tet
    type(solid_geometry_t), intent(inout) :: solid
    integer :: m, n, i(3)

    n = solid%body_cell(b + 1) - 1
    associate (body => self%body(b))
      do m = 1, body%n_cell
        i = offset + body%cell(:, m)
        if (any(i < self%low) .or. any(i > self%high)) cycle
        n = n + 1
        self%source(:, n) = [m, first_tet - 1]
        solid%cell(:, n) = i
        solid%cell_alpha(n) = body%alpha(m)
        solid%cell_centroid(:, n) = grid%origin + (real(i - 1, wp) + body%centroid(:, m))*grid%h
        solid%alpha(i(1), i(2), i(3)) = solid%alpha(i(1), i(2), i(3)) + body%alpha(m)
        if (body%inside(m) .and. solid%inside(i(1), i(2), i(3)) == 0) then
          solid%inside(i(1), i(2), i(3)) = b
        end if
      end do
    end associate
    solid%body_cell(b + 1) = n + 1
  end subroutine paint_cells

  !> Shares of faces, with those on the far sides of the domain.
  subroutine paint_faces(self, grid, body, b, offset, solid)
    type(solid_fraction_t), intent(in) :: self
    type(grid_t), intent(in) :: grid
    type(body_shares_t), intent(in) :: body
    integer, intent(in) :: b, offset(3)
    type(solid_geometry_t), intent(inout) :: solid
    integer :: m, n, f(4)

    n = solid%body_face(b + 1) - 1
    do m = 1, body%n_face
      f = body%face(:, m)
      f(1:3) = f(1:3) + offset
      if (.not. kept_face(self, grid, f)) cycle
      n = n + 1
      solid%face(:, n) = f
      solid%face_beta(n) = body%beta(m)
      solid%face_centroid(:, n) = grid%origin + &
                                  (real(f(1:3) - 1, wp) + body%face_centroid(:, m))*grid%h
      solid%open(f(1), f(2), f(3), f(4)) = solid%open(f(1), f(2), f(3), f(4)) - body%beta(m)
    end do
    solid%body_face(b + 1) = n + 1
  end subroutine paint_faces

  !> Is the lower face f of a cell kept? Those on the far sides of the domain are.
  pure logical function kept_face(self, grid, f)
    type(solid_fraction_t), intent(in) :: self
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: f(4)   !! cell and direction
    integer :: high(3)

    high = self%high
    if (.not. grid%periodic(f(4))) high(f(4)) = min(high(f(4)) + 1, grid%last(f(4)))
    kept_face = all(f(1:3) >= self%low) .and. all(f(1:3) <= high)
  end function kept_face

  !> Nearest hits from both ends of the legs; what lies behind a side of the domain does not count.
  subroutine paint_legs(self, grid, body, b, offset, solid)
    type(solid_fraction_t), intent(in) :: self
    type(grid_t), intent(in) :: grid
    type(body_shares_t), intent(in) :: body
    integer, intent(in) :: b, offset(3)
    type(solid_geometry_t), intent(inout) :: solid
    integer :: m, f(4)

    do m = 1, body%n_hit
      f = body%hit(:, m)
      f(1:3) = f(1:3) + offset
      if (.not. kept_face(self, grid, f)) cycle
      if (.not. grid%periodic(f(4))) then
        if (f(f(4)) == 1 .and. body%at(m) < 0.5_wp) cycle
        if (f(f(4)) == grid%n(f(4)) + 1 .and. body%at(m) > 0.5_wp) cycle
      end if
      call shorten_leg(f, body%at(m), b, solid)
    end do
  end subroutine paint_legs

  !> Body b meets a leg at a place between 0 (lower centre) and 1.
  subroutine shorten_leg(f, at, b, solid)
    integer, intent(in) :: f(4), b
    real(wp), intent(in) :: at
    type(solid_geometry_t), intent(inout) :: solid

    associate (low => solid%leg_low(f(1), f(2), f(3), f(4)), &
               high => solid%leg_high(f(1), f(2), f(3), f(4)))
      if (low > 1.0_wp) then
        solid%n_leg = solid%n_leg + 1
        solid%leg(:, solid%n_leg) = f
      end if
      if (max(at, least_leg) < low) then
        low = max(at, least_leg)
        solid%leg_body_low(f(1), f(2), f(3), f(4)) = b
      end if
      if (max(1.0_wp - at, least_leg) < high) then
        high = max(1.0_wp - at, least_leg)
        solid%leg_body_high(f(1), f(2), f(3), f(4)) = b
      end if
    end associate
  end subroutine shorten_leg

  !> Where bodies press into the bed, b, its share of a face makes way for theirs: what a moving
  !! body carries through a face has to fit the change of its volume in the cells.
  pure subroutine make_way(b, solid)
    integer, intent(in) :: b
    type(solid_geometry_t), intent(inout) :: solid
    real(wp) :: excess
    integer :: m

    do m = solid%body_face(b), solid%body_face(b + 1) - 1
      associate (f => solid%face(:, m))
        excess = min(max(-solid%open(f(1), f(2), f(3), f(4)), 0.0_wp), solid%face_beta(m))
        solid%face_beta(m) = solid%face_beta(m) - excess
        solid%open(f(1), f(2), f(3), f(4)) = solid%open(f(1), f(2), f(3), f(4)) + excess
      end associate
    end do
  end subroutine make_way

  !> Faces that bodies close: no open share is left, and shares above one are scaled down.
  pure subroutine finish_faces(solid)
    type(solid_geometry_t), intent(inout) :: solid
    real(wp) :: total
    integer :: m, n

    n = solid%body_face(size(solid%body_face)) - 1
    do m = 1, n
      associate (f => solid%face(:, m))
        total = 1.0_wp - solid%open(f(1), f(2), f(3), f(4))
      end associate
      if (total > 1.0_wp - full_face) solid%face_beta(m) = solid%face_beta(m)/total
    end do
    do m = 1, n
      associate (f => solid%face(:, m))
        total = 1.0_wp - solid%open(f(1), f(2), f(3), f(4))
        if (total > 1.0_wp - full_face) solid%open(f(1), f(2), f(3), f(4)) = 0.0_wp
      end associate
    end do
  end subroutine finish_faces

  !> Full cells are closed all round; the others that hold solid are cut cells.
  subroutine finish_cells(grid, solid)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(inout) :: solid
    integer :: m

    solid%n_cut = 0
    do m = 1, solid%body_cell(size(solid%body_cell)) - 1
      associate (i => solid%cell(:, m))
        if (solid%alpha(i(1), i(2), i(3)) > 1.0_wp - full_cell) then
          solid%alpha(i(1), i(2), i(3)) = 1.0_wp
          if (solid%cell_alpha(m) >= 1.0_wp) cycle
          call set_faces(grid, i, 0.0_wp, solid)   ! shared: perhaps not all are closed
          solid%n_closed = solid%n_closed + 1
          solid%closed_cell(:, solid%n_closed) = i
        else if (solid%cut(i(1), i(2), i(3)) == 0) then
          solid%n_cut = solid%n_cut + 1
          solid%cut(i(1), i(2), i(3)) = solid%n_cut
          solid%cut_cell(:, solid%n_cut) = i
        end if
      end associate
    end do
  end subroutine finish_cells

  !> A leg from a centre inside to one outside always has a hit, also where round-off sees the
  !! centre now on this, now on that side of the surface: then the wall is at the centre inside.
  subroutine guard_legs(self, solid)
    type(solid_fraction_t), intent(in) :: self
    type(solid_geometry_t), intent(inout) :: solid
    integer :: m, d, b, i(3), n(3)

    do m = 1, solid%body_cell(size(solid%body_cell)) - 1
      i = solid%cell(:, m)
      b = solid%inside(i(1), i(2), i(3))
      if (b == 0) cycle
      do d = 1, 3
        n = i - unit_step(:, d)
        if (n(d) >= self%low(d) .and. solid%leg_low(i(1), i(2), i(3), d) > 1.0_wp) then
          if (solid%inside(n(1), n(2), n(3)) == 0) call shorten_leg([i, d], 1.0_wp, b, solid)
        end if
        n = i + unit_step(:, d)
        if (n(d) > self%high(d)) cycle
        if (solid%inside(n(1), n(2), n(3)) == 0 .and. &
            solid%leg_low(n(1), n(2), n(3), d) > 1.0_wp) call shorten_leg([n, d], 0.0_wp, b, solid)
      end do
    end do
  end subroutine guard_legs

  !> Tetrahedra of the bodies where they are, in space; those of images elsewhere will follow.
  pure subroutine place_bodies(grid, self, solid)
    type(grid_t), intent(in) :: grid
    type(solid_fraction_t), intent(in) :: self
    type(solid_geometry_t), intent(inout) :: solid
    integer :: b

    solid%tets%of_body(1) = 1
    solid%tets%n = 0
    do b = 1, size(self%body)
      if (self%near(b)) call place_tets(grid, self%body(b), self%body(b)%base, solid)
      solid%tets%of_body(b + 1) = solid%tets%n + 1
    end do
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

  !> Lists of tetrahedra by cut cell: those of its bodies one after the other.
  pure subroutine tets_of_cut_cells(self, solid)
    type(solid_fraction_t), intent(in) :: self
    type(solid_geometry_t), intent(inout) :: solid
    integer :: b, e, m, n, t, total, from, to

    associate (tets => solid%tets)
      tets%first(1:solid%n_cut + 1) = 0
      do b = 1, size(self%body)
        do e = solid%body_cell(b), solid%body_cell(b + 1) - 1
          m = number_of_cut(e)
          if (m == 0) cycle
          n = self%source(1, e)
          tets%first(m) = tets%first(m) + self%body(b)%first_tet(n + 1) - self%body(b)%first_tet(n)
        end do
      end do
      total = 0
      do m = 1, solid%n_cut
        total = total + tets%first(m)
        tets%first(m) = total + 1
      end do
      tets%first(solid%n_cut + 1) = total + 1
      call ensure_room(total, tets%list)
      do b = size(self%body), 1, -1
        do e = solid%body_cell(b + 1) - 1, solid%body_cell(b), -1
          tets%of_cell(:, e) = [1, 0]
          m = number_of_cut(e)
          if (m == 0) cycle
          n = self%source(1, e)
          from = self%body(b)%first_tet(n)
          to = self%body(b)%first_tet(n + 1) - 1
          tets%first(m) = tets%first(m) - (to - from + 1)
          tets%of_cell(:, e) = tets%first(m) + [0, to - from]
          do t = from, to
            tets%list(tets%first(m) + t - from) = self%body(b)%tet(t) + self%source(2, e)
          end do
        end do
      end do
    end associate
  contains
    pure integer function number_of_cut(e)
      integer, intent(in) :: e

      number_of_cut = solid%cut(solid%cell(1, e), solid%cell(2, e), solid%cell(3, e))
    end function number_of_cut
  end subroutine tets_of_cut_cells

  !> Close the faces of cut cells from which no open faces lead to a cell without solid.
  subroutine close_pockets(grid, self, solid)
    type(grid_t), intent(in) :: grid
    type(solid_fraction_t), intent(inout) :: self
    type(solid_geometry_t), intent(inout) :: solid
    integer(i8) :: left(1), changed(1)
    integer :: m

    if (size(self%reached) < solid%n_cut) then
      deallocate (self%reached, self%stack)
      allocate (self%reached(2*solid%n_cut), self%stack(2*solid%n_cut))
    end if
    do m = 1, solid%n_cut
      self%reached(m) = .false.
    end do
    call spread_reach(grid, self, solid)
    left(1) = own_unreached(grid, self, solid)
    call global_sum(left)
    do while (left(1) > 0)
      call exchange_reach(self, solid)
      call spread_reach(grid, self, solid)
      changed(1) = left(1)
      left(1) = own_unreached(grid, self, solid)
      call global_sum(left)
      if (left(1) == changed(1)) exit
    end do
    solid%n_sealed = int(left(1))
    if (left(1) == 0) return
    call exchange_reach(self, solid)
    do m = 1, solid%n_cut
      if (self%reached(m)) cycle
      solid%n_closed = solid%n_closed + 1
      solid%closed_cell(:, solid%n_closed) = solid%cut_cell(:, m)
      call set_faces(grid, solid%cut_cell(:, m), 0.0_wp, solid)
    end do
  end subroutine close_pockets

  !> Own cut cells not yet reached.
  pure function own_unreached(grid, self, solid) result(n)
    type(grid_t), intent(in) :: grid
    type(solid_fraction_t), intent(in) :: self
    type(solid_geometry_t), intent(in) :: solid
    integer(i8) :: n
    integer :: m

    n = 0
    do m = 1, solid%n_cut
      if (self%reached(m)) cycle
      if (any(solid%cut_cell(:, m) < grid%lo) .or. any(solid%cut_cell(:, m) > grid%hi)) cycle
      n = n + 1_i8
    end do
  end function own_unreached

  !> Learn from the owners which cut cells of the halo are reached.
  subroutine exchange_reach(self, solid)
    type(solid_fraction_t), intent(inout) :: self
    type(solid_geometry_t), intent(in) :: solid
    integer :: m

    self%flag = 0
    do m = 1, solid%n_cut
      associate (i => solid%cut_cell(:, m))
        self%flag(i(1), i(2), i(3)) = merge(1, 0, self%reached(m))
      end associate
    end do
    call halo_exchange(self%flag, n_halo)
    do m = 1, solid%n_cut
      associate (i => solid%cut_cell(:, m))
        self%reached(m) = self%flag(i(1), i(2), i(3)) == 1
      end associate
    end do
  end subroutine exchange_reach

  !> Spread the reach through the open faces of the cells kept here.
  subroutine spread_reach(grid, self, solid)
    type(grid_t), intent(in) :: grid
    type(solid_fraction_t), intent(inout) :: self
    type(solid_geometry_t), intent(in) :: solid
    integer :: m, n_stack, d, s, i(3), n(3), f(3)

    n_stack = 0
    do m = 1, solid%n_cut
      if (.not. self%reached(m)) then
        self%reached(m) = touches_free_cell(self, grid, solid, solid%cut_cell(:, m))
      end if
      if (.not. self%reached(m)) cycle
      n_stack = n_stack + 1
      self%stack(n_stack) = m
    end do
    do while (n_stack > 0)
      i = solid%cut_cell(:, self%stack(n_stack))
      n_stack = n_stack - 1
      do d = 1, 3
        do s = 1, 2
          n = i + (2*s - 3)*unit_step(:, d)
          if (any(n < self%low) .or. any(n > self%high)) cycle
          f = merge(i, n, s == 1)
          if (solid%open(f(1), f(2), f(3), d) <= 0.0_wp) cycle
          m = solid%cut(n(1), n(2), n(3))
          if (m == 0) cycle
          if (self%reached(m)) cycle
          self%reached(m) = .true.
          n_stack = n_stack + 1
          self%stack(n_stack) = m
        end do
      end do
    end do
  end subroutine spread_reach

  !> Does a cell share an open face with a cell without solid, or with an open side of the domain?
  pure logical function touches_free_cell(self, grid, solid, i)
    type(solid_fraction_t), intent(in) :: self
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: i(3)
    integer :: d, s, n(3), f(3)

    touches_free_cell = .true.
    do d = 1, 3
      do s = 1, 2
        n = i + (2*s - 3)*unit_step(:, d)
        f = merge(i, n, s == 1)
        if (f(d) > grid%last(d)) cycle
        if (solid%open(f(1), f(2), f(3), d) <= 0.0_wp) cycle
        if (n(d) < self%low(d) .or. n(d) > self%high(d)) then
          if (leads_out(grid, d, s, n(d))) return
        else if (solid%alpha(n(1), n(2), n(3)) <= 0.0_wp) then
          return
        end if
      end do
    end do
    touches_free_cell = .false.
  end function touches_free_cell

  !> Is a cell index beyond a side of the domain through which fluid may pass?
  pure logical function leads_out(grid, d, s, index)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: d, s, index

    leads_out = .false.
    if (grid%periodic(d) .or. (index >= 1 .and. index <= grid%n(d))) return
    leads_out = grid%side(s, d) /= side_no_slip .and. grid%side(s, d) /= side_slip
  end function leads_out

end module solid_fraction_m
