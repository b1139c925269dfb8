!> What follows when all bodies are voxelised: faces and cells that close, cut cells and their
!! tetrahedra, links that round-off left open.
module finish_solid_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use grid_m, only: grid_t, unit_step
  use solid_geometry_m, only: solid_geometry_t, set_faces
  use share_lists_m, only: body_shares_t, full_cell, full_face
  use voxels_m, only: voxels_t, shorten_link
  implicit none
  private
  public :: make_way, finish_faces, finish_cells, guard_links, tets_of_cut_cells

contains

  !> Where bodies press into the bed, b, its share of a face makes way for theirs: what a moving
  !! body carries through a face has to fit the change of its volume in the cells.
  pure subroutine make_way(b, solid)
    integer, intent(in) :: b
    type(solid_geometry_t), intent(inout) :: solid
    real(wp) :: excess
    integer :: m

    do m = solid%body_face(b), solid%body_face(b + 1) - 1
      associate (f => solid%face(:, m))
        excess = min(max(-solid%aperture(f(1), f(2), f(3), f(4)), 0.0_wp), solid%face_beta(m))
        solid%face_beta(m) = solid%face_beta(m) - excess
        solid%aperture(f(1), f(2), f(3), f(4)) = solid%aperture(f(1), f(2), f(3), f(4)) + excess
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
        total = 1.0_wp - solid%aperture(f(1), f(2), f(3), f(4))
      end associate
      if (total > 1.0_wp - full_face) solid%face_beta(m) = solid%face_beta(m)/total
    end do
    do m = 1, n
      associate (f => solid%face(:, m))
        total = 1.0_wp - solid%aperture(f(1), f(2), f(3), f(4))
        if (total > 1.0_wp - full_face) solid%aperture(f(1), f(2), f(3), f(4)) = 0.0_wp
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

  !> A link from a centre inside to one outside always has a hit, also where round-off sees the
  !! centre now on this, now on that side of the surface: then the wall is at the centre inside.
  subroutine guard_links(voxels, solid)
    type(voxels_t), intent(in) :: voxels
    type(solid_geometry_t), intent(inout) :: solid
    integer :: m, d, b, i(3), n(3)

    do m = 1, solid%body_cell(size(solid%body_cell)) - 1
      i = solid%cell(:, m)
      b = solid%inside(i(1), i(2), i(3))
      if (b == 0) cycle
      do d = 1, 3
        n = i - unit_step(:, d)
        if (n(d) >= voxels%low(d) .and. solid%link_number(i(1), i(2), i(3), d) == 0) then
          if (solid%inside(n(1), n(2), n(3)) == 0) call shorten_link([i, d], 1.0_wp, b, solid)
        end if
        n = i + unit_step(:, d)
        if (n(d) > voxels%high(d)) cycle
        if (solid%inside(n(1), n(2), n(3)) == 0 .and. &
            solid%link_number(n(1), n(2), n(3), d) == 0) call shorten_link([n, d], 0.0_wp, b, solid)
      end do
    end do
  end subroutine guard_links

  !> Lists of tetrahedra by cut cell: those of its bodies one after the other.
  pure subroutine tets_of_cut_cells(body, source, solid)
    type(body_shares_t), intent(in) :: body(:)
    integer, intent(in) :: source(:, :)   !! of `voxels_t`
    type(solid_geometry_t), intent(inout) :: solid
    integer :: b, e, m, n, t, total, from, to

    associate (tets => solid%tets)
      tets%first(1:solid%n_cut + 1) = 0
      do b = 1, size(body)
        do e = solid%body_cell(b), solid%body_cell(b + 1) - 1
          m = number_of_cut(e)
          if (m == 0) cycle
          n = source(1, e)
          tets%first(m) = tets%first(m) + body(b)%first_tet(n + 1) - body(b)%first_tet(n)
        end do
      end do
      total = 0
      do m = 1, solid%n_cut
        total = total + tets%first(m)
        tets%first(m) = total + 1
      end do
      tets%first(solid%n_cut + 1) = total + 1
      call ensure_capacity(total, tets%list)
      do b = size(body), 1, -1
        do e = solid%body_cell(b + 1) - 1, solid%body_cell(b), -1
          tets%of_cell(:, e) = [1, 0]
          m = number_of_cut(e)
          if (m == 0) cycle
          n = source(1, e)
          from = body(b)%first_tet(n)
          to = body(b)%first_tet(n + 1) - 1
          tets%first(m) = tets%first(m) - (to - from + 1)
          tets%of_cell(:, e) = tets%first(m) + [0, to - from]
          do t = from, to
            tets%list(tets%first(m) + t - from) = body(b)%tet(t) + source(2, e)
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

end module finish_solid_m
