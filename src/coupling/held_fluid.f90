!> Fluid that a block holds in a face, where the flow would have to turn in what little fluid an
!! edge of the block leaves in a cut cell.
!!
!! Measure is a plane wall that leaves the cell as much fluid. Where the faces of a direction are
!! open R times as wide as behind that, beyond what the face of a round block makes,
!! $$ R = 1 + \max (0, w_{low} + w_{high} - w_{plane} - 0.1)/w_{plane} $$
!! the inertia of the half of the face in the cell is m times as large,
!! $$ m = \min (R^{7/2}, 1 + \tfrac23 S^2/a), \qquad
!! \frac{w}{w_{free}} = \tfrac12 (m_{low} + m_{high}) $$
!! with w the open share. A layer of depth a before a wall that is seen through the share S of the
!! face, fed from one end, has to move so much faster along the wall than across the face. Pressure
!! moves the free share; the rest moves with the block, as if it were a part of it. Volume and
!! transport know the open share only. 7/2 is measured (docs/decisions/sharp_edges.md).
module held_fluid_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use grid_m, only: grid_t, unit_step
  use solid_geometry_m, only: solid_geometry_t, apertures
  use rigid_flux_m, only: closed_side
  use wall_edges_m, only: min_normal, round_edge
  implicit none
  private
  public :: hold_fluid, more_inertia

  real(wp), parameter :: power = 3.5_wp        !! of R
  real(wp), parameter :: thinnest = 0.01_wp    !! layer [cells]
  real(wp), parameter :: least = 1.0e-6_wp     !! opening, or excess of inertia, that counts
  integer, parameter :: several = -1           !! bodies in a cell

contains

  !> Free shares of the faces, and the list of those with held fluid.
  subroutine hold_fluid(grid, n_blocks, solid)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: n_blocks   !! bodies of `solid` without the bed, which comes last
    type(solid_geometry_t), intent(inout) :: solid
    real(wp) :: more(3, solid%n_cut)   ! m - 1 of the cut cells
    integer :: owner(solid%n_cut)      ! the body that cuts them, or `several`
    integer :: k, m

    call find_owners(solid, owner)
    !$omp parallel
    !$omp do schedule(static)
    do k = grid%first(3), grid%last(3)
      solid%effective(:, :, k, :) = solid%aperture(:, :, k, :)
    end do
    !$omp end do nowait
    !$omp do schedule(dynamic, 64)
    do m = 1, solid%n_cut
      associate (c => solid%cut_cell(:, m))
        more(:, m) = 0.0_wp
        if (all(c < grid%last)) more(:, m) = more_inertia(apertures(grid, solid%aperture, c), &
          solid%behind_plane(:, m), solid%alpha(c(1), c(2), c(3)))
        if (maxval(more(:, m)) < least) cycle
        if (others_around(grid, solid, owner, owner(m), c)) more(:, m) = 0.0_wp
      end associate
    end do
    !$omp end parallel
    call narrow_faces(grid, n_blocks, more, solid)
    do m = 1, solid%first_held(size(solid%first_held)) - 1
      associate (f => solid%held_face(:, m))
        solid%held_share(m) = solid%aperture(f(1), f(2), f(3), f(4)) &
                              - solid%effective(f(1), f(2), f(3), f(4))
      end associate
    end do
  end subroutine hold_fluid

  !> By how much the inertia of each direction of a cell is larger, m - 1.
  pure function more_inertia(w, plane, alpha) result(more)
    real(wp), intent(in) :: w(3, 2)    !! open shares of the lower and upper faces
    real(wp), intent(in) :: plane(3)   !! those of both together behind a plane wall
    real(wp), intent(in) :: alpha      !! solid share of the cell
    real(wp) :: more(3)
    real(wp) :: normal(3), r(3), depth(3)

    more = 0.0_wp
    normal = w(:, 2) - w(:, 1)
    if (maxval(abs(normal)) < min_normal) return
    r = 1.0_wp + max(0.0_wp, sum(w, 2) - plane - round_edge)/max(plane, least)
    depth = 1.0_wp - alpha/max(abs(normal), least)
    more = min(r**power - 1.0_wp, normal**2/(1.5_wp*max(depth, thinnest)))
  end function more_inertia

  !> Make the faces of cut cells narrower, and list them by blocks.
  subroutine narrow_faces(grid, n_blocks, more, solid)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: n_blocks
    real(wp), intent(in) :: more(:, :)   !! (3, cut cells)
    type(solid_geometry_t), intent(inout) :: solid
    integer :: b, d, m, n, s, next, f(4)

    n = size(solid%body_cell)
    if (size(solid%first_held) /= n) then
      deallocate (solid%first_held)
      allocate (solid%first_held(n))
    end if
    next = 1
    do b = 1, n - 1
      solid%first_held(b) = next
      if (b > n_blocks) cycle
      do m = solid%body_cell(b), solid%body_cell(b + 1) - 1
        associate (c => solid%cell(:, m))
          associate (cut => solid%cut(c(1), c(2), c(3)))
            if (cut == 0) cycle
            do d = 1, 3
              if (more(d, cut) < least) cycle
              do s = 0, 1
                f(1:3) = c + s*unit_step(:, d)
                f(4) = d
                call narrow(f, 0.5_wp*more(d, cut))
              end do
            end do
          end associate
        end associate
      end do
    end do
    solid%first_held(n) = next
  contains
    !> Add to w/w_free of face f.
    subroutine narrow(f, part)
      integer, intent(in) :: f(4)
      real(wp), intent(in) :: part

      associate (aperture => solid%aperture(f(1), f(2), f(3), f(4)), &
                 effective => solid%effective(f(1), f(2), f(3), f(4)))
        if (aperture < least .or. closed_side(grid, f(f(4)), f(4))) return
        if (effective >= aperture) then
          call ensure_capacity(next, solid%held_face)
          call ensure_capacity(next, solid%held_share)
          solid%held_face(:, next) = f
          next = next + 1
        end if
        effective = aperture/(aperture/effective + part)
      end associate
    end subroutine narrow
  end subroutine narrow_faces

  !> The body that cuts each cut cell, or `several`.
  subroutine find_owners(solid, owner)
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(out) :: owner(:)   !! (cut cells)
    integer :: b, m

    owner = 0
    do b = 1, size(solid%body_cell) - 1
      do m = solid%body_cell(b), solid%body_cell(b + 1) - 1
        associate (cut => solid%cut(solid%cell(1, m), solid%cell(2, m), solid%cell(3, m)))
          if (cut > 0) owner(cut) = merge(b, several, owner(cut) == 0 .or. owner(cut) == b)
        end associate
      end do
    end do
  end subroutine find_owners

  !> Is another body than b, the owner of cell c, in this cell or one of the 26 around? There the
  !! water beyond an edge is in a gap, not open.
  pure function others_around(grid, solid, owner, b, c) result(yes)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: owner(:)   !! (cut cells)
    integer, intent(in) :: b, c(3)
    logical :: yes
    integer :: i, j, k, found

    yes = b == several
    do k = max(c(3) - 1, grid%first(3)), min(c(3) + 1, grid%last(3))
      do j = max(c(2) - 1, grid%first(2)), min(c(2) + 1, grid%last(2))
        do i = max(c(1) - 1, grid%first(1)), min(c(1) + 1, grid%last(1))
          found = solid%inside(i, j, k)
          if (solid%cut(i, j, k) > 0) found = owner(solid%cut(i, j, k))
          yes = yes .or. (found /= 0 .and. found /= b)
        end do
      end do
    end do
  end function others_around

end module held_fluid_m
