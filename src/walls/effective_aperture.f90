!> Edges of blocks in cut cells, and the effective apertures beside them: where the flow would have
!! to turn in what little fluid an edge leaves in a cell, the block holds part of it
!! (docs/theory.md, section 17).
!!
!! Measure is a plane wall that leaves the cell as much fluid: an edge leaves its faces open more
!! than that by 0.2 of a face and more where it takes the centre of the cell, a sphere eight cells
!! wide by less than 0.1. Pressure moves the fluid through the effective aperture; what it lacks of
!! the aperture moves with the block. Volume and transport know the aperture only.
module effective_aperture_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use grid_m, only: grid_t, unit_step
  use solid_geometry_m, only: solid_geometry_t, apertures
  use rigid_motion_m, only: rigid_motion_t, wall_velocity
  use rigid_flux_m, only: closed_side, nearest_arm, middle_of_face
  use wall_plane_m, only: apertures_of_plane, min_normal
  implicit none
  private
  public :: find_effective_apertures, more_inertia, hold_in_cells

  real(wp), parameter :: round_edge = 0.1_wp, sharp_edge = 0.2_wp
    !! excess of apertures up to which a wall counts as plane, and from which it has an edge [faces]
  real(wp), parameter :: power = 3.5_wp        !! of R, measured (docs/decisions/sharp_edges.md)
  real(wp), parameter :: thinnest = 0.01_wp    !! layer [cells]
  real(wp), parameter :: least = 1.0e-6_wp     !! opening, or excess of inertia, that counts
  integer, parameter :: several = -1           !! bodies in a cell

contains

  !> Edges of the cut cells (`solid%edge`; 0 behind a wall that is nearly plane, none if the centre
  !! lies in fluid), effective apertures, and the list of the faces in which bodies hold fluid.
  subroutine find_effective_apertures(grid, n_blocks, solid)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: n_blocks   !! bodies of `solid` without the bed, which comes last
    type(solid_geometry_t), intent(inout) :: solid
    real(wp) :: more(3, solid%n_cut)   ! m - 1 of the cut cells
    integer :: owner(solid%n_cut)      ! the body that cuts them, or `several`
    integer :: k, m, b

    call ensure_capacity(solid%n_cut, solid%edge)
    ! The body that cuts each cut cell, or `several`.
    owner = 0
    do b = 1, size(solid%body_cell) - 1
      do m = solid%body_cell(b), solid%body_cell(b + 1) - 1
        associate (cut => solid%cut(solid%cell(1, m), solid%cell(2, m), solid%cell(3, m)))
          if (cut > 0) owner(cut) = merge(b, several, owner(cut) == 0 .or. owner(cut) == b)
        end associate
      end do
    end do
    !$omp parallel
    !$omp do schedule(static)
    do k = grid%first(3), grid%last(3)
      solid%effective(:, :, k, :) = solid%aperture(:, :, k, :)
    end do
    !$omp end do nowait
    !$omp do schedule(dynamic, 64)
    do m = 1, solid%n_cut
      call compare_with_plane(grid, solid, solid%cut_cell(:, m), solid%edge(m), more(:, m))
      if (maxval(more(:, m)) < least) cycle
      if (others_around(grid, solid, owner, owner(m), solid%cut_cell(:, m))) more(:, m) = 0.0_wp
    end do
    !$omp end parallel
    call narrow_faces(grid, n_blocks, more, solid)
    do m = 1, solid%first_held(size(solid%first_held)) - 1
      associate (f => solid%held_face(:, m))
        solid%held_share(m) = solid%aperture(f(1), f(2), f(3), f(4)) &
                              - solid%effective(f(1), f(2), f(3), f(4))
      end associate
    end do
  end subroutine find_effective_apertures

  !> How much of an edge cut cell c has, and by how much the inertia of its faces is larger.
  pure subroutine compare_with_plane(grid, solid, c, edge, more)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    integer, intent(in) :: c(3)
    real(wp), intent(out) :: edge, more(3)
    real(wp) :: w(3, 2), plane(3), excess

    edge = 0.0_wp
    more = 0.0_wp
    if (any(c >= grid%last)) return
    w = apertures(grid, solid%aperture, c)
    if (maxval(abs(w(:, 2) - w(:, 1))) < min_normal) return
    plane = apertures_of_plane(w(:, 2) - w(:, 1), solid%alpha(c(1), c(2), c(3)))
    more = more_inertia(w, plane, solid%alpha(c(1), c(2), c(3)))
    if (solid%inside(c(1), c(2), c(3)) == 0) return
    excess = maxval(sum(w, 2) - plane)
    edge = max(0.0_wp, min(1.0_wp, (excess - round_edge)/(sharp_edge - round_edge)))
  end subroutine compare_with_plane

  !> By how much the inertia of each direction of a cell is larger, m - 1.
  pure function more_inertia(w, plane, alpha) result(more)
    real(wp), intent(in) :: w(3, 2)    !! apertures of the lower and upper faces
    real(wp), intent(in) :: plane(3)   !! those of both together behind a plane wall
    real(wp), intent(in) :: alpha      !! solid share of the cell
    real(wp) :: more(3)
    real(wp) :: normal(3), r(3), depth(3)

    normal = w(:, 2) - w(:, 1)
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
                associate (aperture => solid%aperture(f(1), f(2), f(3), d), &
                           effective => solid%effective(f(1), f(2), f(3), d))
                  if (aperture < least .or. closed_side(grid, f(d), d)) cycle
                  if (effective >= aperture) then
                    call ensure_capacity(next, solid%held_face)
                    call ensure_capacity(next, solid%held_share)
                    solid%held_face(:, next) = f
                    next = next + 1
                  end if
                  effective = aperture/(aperture/effective + 0.5_wp*more(d, cut))   ! w/w_free
                end associate
              end do
            end do
          end associate
        end associate
      end do
    end do
    solid%first_held(n) = next
  end subroutine narrow_faces

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

  !> In the mean of the cells, fluid that a block holds in a face accelerates with the block.
  subroutine hold_in_cells(grid, solid, bodies, a_body, a_face, a_cell)
    type(grid_t), intent(in) :: grid
    type(solid_geometry_t), intent(in) :: solid
    type(rigid_motion_t), intent(in) :: bodies
    real(wp), intent(in) :: a_body(:, :)   !! (6, bodies) rate of their motion [m/s2, rad/s2]
    real(wp), intent(in), contiguous :: a_face(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(inout), contiguous :: a_cell(grid%first(1):, grid%first(2):, grid%first(3):, :)
      !! [m/s2]
    real(wp) :: arm(3), a_wall(3), w(3, 2), missing
    integer :: b, d, m, s, c(3)

    do b = 1, bodies%n
      do m = solid%first_held(b), solid%first_held(b + 1) - 1
        associate (f => solid%held_face(1:3, m))
          d = solid%held_face(4, m)
          arm = nearest_arm(grid, middle_of_face(grid, solid%held_face(:, m)), bodies%x(:, b))
          a_wall = wall_velocity(a_body(:, b), arm)
          missing = solid%held_share(m)*(a_wall(d) - a_face(f(1), f(2), f(3), d))
          do s = 0, 1
            c = f - s*unit_step(:, d)
            if (.not. grid%owns(c)) cycle
            w = apertures(grid, solid%aperture, c)
            a_cell(c(1), c(2), c(3), d) = a_cell(c(1), c(2), c(3), d) + missing/sum(w(d, :))
          end do
        end associate
      end do
    end do
  end subroutine hold_in_cells

end module effective_aperture_m
