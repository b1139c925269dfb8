!> Deep overlaps: noted with both bodies, told once, a fault where contact has failed.
module test_deep_overlaps_m
  use check_m, only: check, wp
  use contact_points_m, only: contact_point_t, contact_points_t, add_point
  use deep_overlaps_m, only: deep_overlaps_t, store_overlap, store_points, warn_of_overlaps, &
    overlap_fault, size_of_pair, ask_for_deep
  use world_m, only: world_t, set_up
  implicit none
  private
  public :: test_deep_overlaps

  real(wp), parameter :: size(2) = [0.02_wp, 0.3_wp]
  integer, parameter :: floor = -5
  type(deep_overlaps_t) :: deep
  type(contact_points_t) :: points
  type(world_t) :: world
  integer :: warnings

contains

  subroutine test_deep_overlaps()
    ! small, large, small
    call set_up('&run t_end=1 physics="dry"/ &grid cells=3*2 length=3*4/ &shape name="small" ' &
      //'kind="cube" size=.02/ &shape name="large" kind="cube" size=.3/ &body shape="small" ' &
      //'position=3*1/ &body shape="large" position=3*2/ &body shape="small" position=3*3/', world)
    deep = world%deep
    call check('the smaller counts', size_of_pair(2, 1, deep), size(1))
    call check('a wall has no size', size_of_pair(2, floor, deep), size(2))
    call store_overlap(2, 1, 0.0009_wp, deep)
    call check('4.5 % are not noted', maxval(deep%share), 0.0_wp)
    call store_overlap(2, 1, 0.0011_wp, deep)
    call store_overlap(2, floor, 0.024_wp, deep)
    call check('shares of both', deep%share(:3), [0.055_wp, 0.08_wp, 0.0_wp], 1.0e-12_wp)
    call check('the deepest stays', deep%depth(:3), [0.0011_wp, 0.024_wp, 0.0_wp])
    call check('with whom', deep%counterpart(1) == 2 .and. deep%counterpart(2) == floor)
    call check('no fault yet', len(overlap_fault(deep)) == 0)
    warnings = 3
    call warn_of_overlaps(0.5_wp, deep, warnings)
    call check('told of one with the other, and of the floor', warnings, 4)
    call check('both are told', deep%warned(1) .and. deep%warned(2) .and. .not. deep%warned(3))
    call warn_of_overlaps(0.6_wp, deep, warnings)
    call check('told once', warnings, 4)
    call add_point(contact_point_t(3, 2, 1, depth=0.0039_wp), points)
    call add_point(contact_point_t(3, 2, 2, depth=0.0041_wp), points)
    call store_points(points, deep)
    call check('those before forgotten', deep%share(:3), [0.0_wp, 0.205_wp, 0.205_wp], 1.0e-12_wp)
    call check('a fault from a fifth on', index(overlap_fault(deep), &
      'body 2 and body 3 reach 0.0041 m into one another, 20.5 % of the size of the smaller') == 1)
    call check_asked()
  end subroutine test_deep_overlaps

  !> Between rows, overlaps of the bodies that move with a contact deeper than 2.5 % of the smaller.
  subroutine check_asked()
    deep%asked = .true.
    call check('all', all(deep%asked))
    points%n = 0
    call add_point(contact_point_t(2, 1, 1, depth=0.00049_wp), points)
    call ask_for_deep(points, world%blocks, deep)
    call check('2.45 % is not deep', .not. any(deep%asked))
    call add_point(contact_point_t(2, 1, 2, depth=0.00051_wp), points)
    call ask_for_deep(points, world%blocks, deep)
    call check('2.55 % is', all(deep%asked .eqv. [.true., .true., .false.]))
    world%blocks%still(:2) = .true.
    call add_point(contact_point_t(3, floor, 1, depth=0.00051_wp), points)
    call ask_for_deep(points, world%blocks, deep)
    call check('but not of two still ones', all(deep%asked .eqv. [.false., .false., .true.]))
    world%blocks%still(2) = .false.
    call ask_for_deep(points, world%blocks, deep)
    call check('of one still one', all(deep%asked))
  end subroutine check_asked

end module test_deep_overlaps_m
