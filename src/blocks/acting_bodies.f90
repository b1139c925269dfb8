!> The bodies that a substep may move or wake: those awake, and those asleep that something touches.
!! What nothing touches costs nothing in a substep.
module acting_bodies_m
  use rigid_body_m, only: blocks_t
  use contact_points_m, only: contact_points_t
  implicit none
  private
  public :: acting_t, acting_init, list_acting, list_present

  type :: acting_t
    integer :: n = 0
    integer, allocatable :: body(:)               !! (n) rising
    logical, allocatable, private :: listed(:)    !! (bodies) work
  end type acting_t

contains

  !> Room for all bodies.
  pure subroutine acting_init(n, acting)
    integer, intent(in) :: n   !! bodies
    type(acting_t), intent(out) :: acting

    allocate (acting%body(n), source=0)
    allocate (acting%listed(n), source=.false.)
  end subroutine acting_init

  !> Those awake, and those of the contact points that are or may soon be.
  pure subroutine list_acting(blocks, points, soon, acting)
    type(blocks_t), intent(in) :: blocks
    type(contact_points_t), intent(in) :: points, soon
    type(acting_t), intent(inout) :: acting

    acting%listed = blocks%present .and. .not. blocks%asleep
    call add(points, acting)
    call add(soon, acting)
    call pack_listed(acting)
  end subroutine list_acting

  pure subroutine add(points, acting)
    type(contact_points_t), intent(in) :: points
    type(acting_t), intent(inout) :: acting
    integer :: t

    do t = 1, points%n
      acting%listed(points%item(t)%a) = .true.
      if (points%item(t)%b > 0) acting%listed(points%item(t)%b) = .true.
    end do
  end subroutine add

  !> All that are there.
  pure subroutine list_present(blocks, acting)
    type(blocks_t), intent(in) :: blocks
    type(acting_t), intent(inout) :: acting

    acting%listed = blocks%present
    call pack_listed(acting)
  end subroutine list_present

  pure subroutine pack_listed(acting)
    type(acting_t), intent(inout) :: acting
    integer :: b

    acting%n = 0
    do b = 1, size(acting%listed)
      if (.not. acting%listed(b)) cycle
      acting%n = acting%n + 1
      acting%body(acting%n) = b
    end do
  end subroutine pack_listed

end module acting_bodies_m
