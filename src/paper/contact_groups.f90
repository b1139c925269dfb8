!> Contact points of one sphere with one counterpart form a group: they share a tangential
!! displacement.
module contact_groups_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use vectors_m, only: norm
  use contact_points_m, only: contact_point_t, contact_points_t
  implicit none
  private
  public :: groups_t, form_groups, keep_touching

  !> Contact points with one id and one counterpart act on one tangential displacement.
  type :: groups_t
    integer :: n = 0
    logical, allocatable :: new(:)               !! (n) was not there in the substep before
    integer, allocatable :: first(:)             !! (n + 1) points first(g) : first(g+1)-1
    real(wp), allocatable :: normal(:, :)        !! (3, n) mean, unit [-]
    real(wp), allocatable :: arm_a(:, :), arm_b(:, :)   !! (3, n) mean contact point [m]
  end type groups_t

contains

  !> Leave out what does not touch yet.
  pure subroutine keep_touching(points)
    type(contact_points_t), intent(inout) :: points
    integer :: t, kept

    kept = 0
    do t = 1, points%n
      if (points%item(t)%depth <= 0.0_wp) cycle
      kept = kept + 1
      if (kept < t) points%item(kept) = points%item(t)
    end do
    points%n = kept
  end subroutine keep_touching

  !> Gather the contact points of each id and counterpart.
  pure subroutine form_groups(points, groups)
    type(contact_points_t), intent(in) :: points
    type(groups_t), intent(inout) :: groups
    integer :: t, g, last

    groups%n = 0
    call ensure_capacity(points%n + 1, groups%first)
    call ensure_capacity(points%n, groups%new)
    call ensure_capacity(points%n, groups%normal)
    call ensure_capacity(points%n, groups%arm_a)
    call ensure_capacity(points%n, groups%arm_b)
    t = 1
    do while (t <= points%n)
      g = groups%n + 1
      groups%n = g
      groups%first(g) = t
      do last = t, points%n - 1
        associate (p => points%item(t), q => points%item(last + 1))
          if (p%id /= q%id .or. p%b /= q%b .or. p%a /= q%a) exit   ! not of one displacement
        end associate
      end do
      groups%normal(:, g) = points%item(t)%normal
      groups%arm_a(:, g) = points%item(t)%arm_a
      groups%arm_b(:, g) = points%item(t)%arm_b
      if (last > t) call average(points%item(t:last), groups%normal(:, g), &
        groups%arm_a(:, g), groups%arm_b(:, g))
      t = last + 1
    end do
    groups%first(groups%n + 1) = points%n + 1
  end subroutine form_groups

  !> Mean normal and point of some contact points, weighted by overlap.
  pure subroutine average(point, normal, arm_a, arm_b)
    type(contact_point_t), intent(in) :: point(:)
    real(wp), intent(out) :: normal(3), arm_a(3), arm_b(3)   !! [-], [m]
    real(wp) :: w, total
    integer :: i

    total = 0.0_wp
    normal = 0.0_wp
    arm_a = 0.0_wp
    do i = 1, size(point)
      w = point(i)%depth
      total = total + w
      normal = normal + w*point(i)%normal
      arm_a = arm_a + w*point(i)%arm_a
    end do
    arm_a = arm_a/total
    arm_b = arm_a + (point(1)%arm_b - point(1)%arm_a)
    w = norm(normal)
    if (w > epsilon(w)*total) then
      normal = normal/w
    else
      normal = point(1)%normal
    end if
  end subroutine average

end module contact_groups_m
