!> Which counterparts each body has touched in a step.
module counterparts_met_m
  use growing_m, only: ensure_capacity
  use rigid_body_m, only: blocks_t
  use walls_m, only: floor_wall
  use bed_m, only: bed_counterpart
  use displacements_m, only: comes_before
  implicit none
  private
  public :: met_t, store_counterparts, count_counterparts

  !> Pairs that touched, sorted.
  type :: met_t
    integer :: n = 0
    integer, allocatable :: a(:), b(:)   !! (n)
  end type met_t

contains

  !> Add pairs that touch to those that touched in this step.
  subroutine store_counterparts(points_a, points_b, met)
    integer, intent(in) :: points_a(:), points_b(:)       !! (points) sorted
    type(met_t), intent(inout) :: met
    integer :: t, m, a, b

    a = 0
    b = 0
    m = 1
    do t = 1, size(points_a)
      if (a == points_a(t) .and. b == points_b(t)) cycle
      a = points_a(t)
      b = points_b(t)
      do while (m <= met%n)
        if (.not. comes_before(met%a(m), met%b(m), 0, a, b, 0)) exit
        m = m + 1
      end do
      if (m <= met%n) then
        if (met%a(m) == a .and. met%b(m) == b) cycle
      end if
      call ensure_capacity(met%n + 1, met%a)
      call ensure_capacity(met%n + 1, met%b)
      met%a(m + 1:met%n + 1) = met%a(m:met%n)
      met%b(m + 1:met%n + 1) = met%b(m:met%n)
      met%a(m) = a
      met%b(m) = b
      met%n = met%n + 1
    end do
  end subroutine store_counterparts

  !> Number of counterparts each body met in this step, and whether the floor was one of them.
  pure subroutine count_counterparts(met, blocks)
    type(met_t), intent(in) :: met
    type(blocks_t), intent(inout) :: blocks
    integer :: m, a, b

    blocks%contacts = 0
    blocks%on_floor = 0
    do m = 1, met%n
      a = met%a(m)
      b = met%b(m)
      blocks%contacts(a) = blocks%contacts(a) + 1
      if (b > 0) blocks%contacts(b) = blocks%contacts(b) + 1
      if (b == floor_wall .or. b == bed_counterpart) blocks%on_floor(a) = 1
    end do
  end subroutine count_counterparts

end module counterparts_met_m
