!> Lists of marked cells, made on all threads, in the order of the grid.
module cell_list_m
  use growing_m, only: ensure_capacity
  use grid_m, only: grid_t
  implicit none
  private
  public :: list_marked

contains

  !> List the own cells with a mark, and put their places in the list in place of the marks.
  subroutine list_marked(grid, lower, mark, cell, n)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: lower(3)   !! lower bounds of `mark`
    integer, intent(inout), contiguous :: mark(lower(1):, lower(2):, lower(3):)
      !! own cells: 0 or not on entry; 0 or the place in the list on return. Halo as it was.
    integer, allocatable, intent(inout) :: cell(:, :)   !! (3, *) grows
    integer, intent(out) :: n                           !! cells in the list
    integer :: before(grid%lo(3):grid%hi(3) + 1)        ! cells in the planes before
    integer :: i, j, k, place

    before = 0
    associate (a => grid%lo, b => grid%hi)
      !$omp parallel do schedule(static)
      do k = a(3), b(3)
        before(k + 1) = count(mark(a(1):b(1), a(2):b(2), k) /= 0)
      end do
      do k = a(3), b(3)
        before(k + 1) = before(k + 1) + before(k)
      end do
      n = before(b(3) + 1)
      call ensure_capacity(n, cell, rows=3)
      !$omp parallel do private(i, j, place) schedule(static)
      do k = a(3), b(3)
        place = before(k)
        if (before(k + 1) == place) cycle
        do j = a(2), b(2)
          do i = a(1), b(1)
            if (mark(i, j, k) == 0) cycle
            place = place + 1
            mark(i, j, k) = place
            cell(:, place) = [i, j, k]
          end do
        end do
      end do
    end associate
  end subroutine list_marked

end module cell_list_m
