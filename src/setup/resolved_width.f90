!> Blocks too small for the cells of resolved water.
!!
!! One that hides between the faces of a cell has no drag, and what the cells at its walls hand back
!! to it (`wall_balance_m`), with arms of a cell, spins and throws it (docs/decisions/coupling.md).
module resolved_width_m
  use kinds_m, only: wp
  use errors_m, only: problems_t, brief
  use case_types_m, only: case_t
  use drops_m, only: count_of_shape
  use tet_mesh_m, only: shape_t, is_called
  implicit none
  private
  public :: check_widths, width_of

  real(wp), parameter :: min_cells_wide = 1.0_wp   !! of a free block

contains

  !> Every shape of a free block is at least a cell wide; of a family the smallest stone counts.
  subroutine check_widths(case, shapes, problems)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)   !! one for each `&shape`; a faulty one has no volume
    type(problems_t), intent(inout) :: problems
    real(wp) :: edge, width(size(shapes))    ! largest of a cell, of the shapes [m]
    integer :: s

    if (case%run%physics /= 'coupled') return
    if (case%grid%extent_faulty .or. case%grid%cells_faulty) return
    edge = maxval(case%grid%length/real(case%grid%cells, wp), case%grid%cells > 1)
    width = sqrt(huge(width))   ! of a faulty shape: wide enough, without an overflow below
    do s = 1, size(shapes)
      if (shapes(s)%volume > 0.0_wp) width(s) = width_of(shapes(s))
    end do
    do s = 1, size(shapes)
      if (width(s)*(1.0_wp + 1.0e-9_wp) >= min_cells_wide*edge) cycle   ! round-off apart
      if (shapes(s)%family /= '') then
        if (s /= minloc(width, 1, shapes%family == shapes(s)%family)) cycle
      end if
      if (.not. is_free(case, shapes(s))) cycle
      call problems%add_message('&shape '//trim(shapes(s)%name)//' is '//brief(width(s), 3) &
        //' m wide, '//brief(width(s)/edge, 2)//' of a cell of '//brief(edge, 3) &
        //' m; resolved water needs one cell across a free block: '//cure(shapes(s), width(s), &
        edge), case%shape(s)%line)
    end do
  end subroutine check_widths

  !> What to do about a shape that is too narrow.
  function cure(shape, width, edge) result(text)
    type(shape_t), intent(in) :: shape
    real(wp), intent(in) :: width, edge   !! of the shape, of a cell [m]
    character(:), allocatable :: text

    if (shape%family == '') then
      text = 'a block at least '//brief(min_cells_wide*edge, 3)//' m wide'
    else
      text = 'a mass_min of '//brief(shape%density*shape%volume*(min_cells_wide*edge/width)**3, 3) &
        //' kg'
    end if
    text = 'finer &grid cells, physics = ''light'', or '//text
  end function cure

  !> Width of a shape: the middle one of the three edges of the box around it [m]. Plates thinner
  !! than a cell fall safely, rods do not.
  pure function width_of(shape) result(width)
    type(shape_t), intent(in) :: shape
    real(wp) :: width
    real(wp) :: edge(3)

    edge = maxval(shape%point, 2) - minval(shape%point, 2)
    width = sum(edge) - minval(edge) - maxval(edge)
  end function width_of

  !> Does the water move a block of this shape, or of its family?
  pure function is_free(case, shape) result(yes)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shape
    logical :: yes
    integer :: i

    yes = any(is_called(shape, case%body%shape) .and. .not. case%body%fixed)
    do i = 1, size(case%drop)
      yes = yes .or. count_of_shape(case%drop(i), shape, with_fixed=.false.) > 0
    end do
  end function is_free

end module resolved_width_m
