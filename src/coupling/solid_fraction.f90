!> The bodies and the bed in the grid: solid shares, wall distances, cut cells, sealed pockets.
!!
!! Every process fills its own cells and halo, images in other periods included, from the poses of
!! the bodies alone; nothing is exchanged but the flags of pockets, where there are any. The bed is
!! one more fixed body, the last; its shares are found once. Where nothing has moved nothing is
!! filled.
module solid_fraction_m
  use omp_lib, only: omp_get_max_threads, omp_get_thread_num
  use kinds_m, only: wp
  use grid_m, only: grid_t
  use solid_geometry_m, only: solid_geometry_t
  use tet_mesh_m, only: shape_t
  use rigid_body_m, only: blocks_t
  use bed_m, only: bed_t
  use bed_solid_m, only: make_bed_solid
  use share_lists_m, only: body_shares_t
  use share_row_m, only: share_row_t
  use body_shares_m, only: find_body_shares
  use cut_tets_m, only: list_cut_tets
  use subcell_shares_m, only: count_subcells
  use voxels_m, only: voxels_t, voxels_init, find_images, ensure_lists, place_bodies, &
    voxelise_cells, voxelise_faces, voxelise_links
  use finish_solid_m, only: make_way, finish_faces, finish_cells, guard_links, tets_of_cut_cells
  use effective_aperture_m, only: find_effective_apertures
  use pockets_m, only: close_pockets
  implicit none
  private
  public :: solid_fraction_t, solid_fraction_init, update_solid

  type :: solid_fraction_t
    type(body_shares_t), allocatable :: body(:)   !! (n) what is known of each body, and of the bed
    logical :: has_bed = .false.
    type(shape_t) :: bed                          !! the part of it in the grid, about its centre
    real(wp) :: bed_centre(3) = 0.0_wp            !! [m]
    integer :: subcells = 0                       !! per direction, 0: exact shares
    type(share_row_t), allocatable :: row(:)      !! (threads) work arrays
    type(voxels_t) :: voxels
    integer :: poses = 0                          !! how often a body has moved, come or gone
    real(wp), allocatable :: x(:, :), q(:, :)     !! (3, n), (4, n) the poses of now
    logical, allocatable :: present(:)
  end type solid_fraction_t

contains

  !> Allocate the caches and work arrays.
  subroutine solid_fraction_init(grid, blocks, self, subcells, bed)
    type(grid_t), intent(in) :: grid
    type(blocks_t), intent(in) :: blocks
    type(solid_fraction_t), intent(out) :: self
    integer, intent(in), optional :: subcells   !! counted per direction, else exact shares
    type(bed_t), intent(in), optional :: bed
    integer :: n

    if (present(subcells)) self%subcells = subcells
    if (present(bed)) self%has_bed = bed%there
    if (self%has_bed) call make_bed_solid(grid, bed, self%bed_centre, self%bed)
    n = blocks%n
    allocate (self%x(3, n), self%q(4, n), source=0.0_wp)
    allocate (self%present(n), source=.false.)
    if (self%has_bed) n = n + 1
    allocate (self%body(n), self%row(0:omp_get_max_threads() - 1))
    call voxels_init(grid, n, self%voxels)
  end subroutine solid_fraction_init

  !> Fill the solid geometry for the poses of the bodies present.
  subroutine update_solid(self, grid, blocks, solid)
    type(solid_fraction_t), intent(inout) :: self
    type(grid_t), intent(in) :: grid
    type(blocks_t), intent(in) :: blocks
    type(solid_geometry_t), intent(inout) :: solid
    logical :: same
    integer :: b

    same = self%poses > 0   ! else the poses get another number
    do b = 1, blocks%n
      same = same .and. (blocks%present(b) .eqv. self%present(b)) &
             .and. all(abs(blocks%x(:, b) - self%x(:, b)) <= 0.0_wp) &
             .and. all(abs(blocks%q(:, b) - self%q(:, b)) <= 0.0_wp)
    end do
    if (.not. same) then
      self%poses = self%poses + 1
      self%present = blocks%present
      self%x = blocks%x
      self%q = blocks%q
    end if
    if (solid%poses == self%poses) return
    solid%poses = self%poses
    call find_shares(grid, blocks, self)
    call ensure_lists(self%body, self%voxels, solid)
    call place_bodies(grid, self%body, self%voxels, solid)
    ! what the sections write of `solid` is disjoint: faces, cells, links
    !$omp parallel sections
    !$omp section
    call voxelise_faces(grid, self%body, self%voxels, solid)
    if (self%has_bed) call make_way(size(self%body), solid)
    call finish_faces(solid)
    !$omp section
    call voxelise_cells(grid, self%body, self%voxels, solid)
    !$omp section
    call voxelise_links(grid, self%body, self%voxels, solid)
    !$omp end parallel sections
    !$omp parallel sections
    !$omp section
    call finish_cells(grid, solid)
    call tets_of_cut_cells(self%body, self%voxels%source, solid)
    !$omp section
    call guard_links(self%voxels, solid)
    !$omp end parallel sections
    call close_pockets(grid, self%voxels%low, self%voxels%high, solid)
    call find_effective_apertures(grid, size(self%body) - merge(1, 0, self%has_bed), solid)
  end subroutine update_solid

  !> Shares of every body that is near the cells of this process and has moved.
  subroutine find_shares(grid, blocks, self)
    type(grid_t), intent(in) :: grid
    type(blocks_t), intent(in) :: blocks
    type(solid_fraction_t), intent(inout) :: self
    real(wp), parameter :: upright(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
    logical :: changed
    integer :: b

    if (size(self%row) < omp_get_max_threads()) then
      deallocate (self%row)
      allocate (self%row(0:omp_get_max_threads() - 1))
    end if
    do b = 1, blocks%n
      self%voxels%near(b) = blocks%present(b)
      if (.not. blocks%present(b)) cycle
      call find_images(grid, b, blocks%x(:, b), blocks%shapes(blocks%shape(b))%radius, &
                       self%voxels)
    end do
    !$omp parallel do private(changed) schedule(dynamic, 1) if (count(self%voxels%near) > 1)
    do b = 1, blocks%n
      if (.not. self%voxels%near(b)) cycle
      associate (body => self%body(b))
        call find_body_shares(grid, blocks%shapes(blocks%shape(b)), blocks%x(:, b), &
                              blocks%q(:, b), self%row(omp_get_thread_num()), body, changed)
        if (changed .and. self%subcells > 0) call count_subcells(self%subcells, body)
        if (changed) call list_cut_tets(body)
      end associate
    end do
    if (.not. self%has_bed) return
    ! the bed is near everywhere and has no images
    self%voxels%near(size(self%body)) = .true.
    associate (body => self%body(size(self%body)))
      call find_body_shares(grid, self%bed, self%bed_centre, upright, self%row(0), body, changed)
      if (changed) call list_cut_tets(body)
    end associate
  end subroutine find_shares

end module solid_fraction_m
