!> Deep overlaps: noted with both bodies, told once, a fault where contact has failed.
module test_deep_overlaps_m
  use kinds_m, only: wp
  use check_m, only: check
  use case_types_m, only: case_t
  use tet_mesh_m, only: shape_t
  use shapes_builtin_m, only: make_shape
  use rigid_body_m, only: blocks_t, blocks_init
  use contact_points_m, only: contact_point_t, contact_points_t, add_point
  use deep_overlaps_m, only: deep_overlaps_t, deep_overlaps_init, store_overlap, store_points, &
    warn_of_overlaps, overlap_fault, size_of_pair, ask_for_all, ask_for_deep
  implicit none
  private
  public :: test_deep_overlaps

  real(wp), parameter :: size(2) = [0.02_wp, 0.3_wp]
  integer, parameter :: floor = -5
  type(deep_overlaps_t) :: deep
  type(contact_points_t) :: points
  type(blocks_t) :: blocks
  integer :: warnings

contains

  subroutine test_deep_overlaps()
    call make_cubes()
    call check('the smaller counts', size_of_pair(2, 1, deep), size(1), 0.0_wp)
    call check('a wall has no size', size_of_pair(2, floor, deep), size(2), 0.0_wp)
    call store_overlap(2, 1, 0.0009_wp, deep)
    call check('4.5 % are not noted', maxval(deep%share), 0.0_wp, 0.0_wp)
    call store_overlap(2, 1, 0.0011_wp, deep)
    call store_overlap(2, floor, 0.024_wp, deep)
    call check('shares of both', deep%share(:3), [0.055_wp, 0.08_wp, 0.0_wp], 1.0e-12_wp)
    call check('the deepest stays', deep%depth(:3), [0.0011_wp, 0.024_wp, 0.0_wp], 0.0_wp)
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
    call check('contact points, those before forgotten', deep%share(:3), [0.0_wp, 0.205_wp, &
      0.205_wp], 1.0e-12_wp)
    call check('a fault from a fifth on', index(overlap_fault(deep), &
      'body 2 and body 3 reach 0.0041 m into one another, 20.5 % of the size of the smaller') == 1)
    call check_asked()
  end subroutine test_deep_overlaps

  !> Between rows, overlaps of the bodies that move with a contact deeper than 2.5 % of the smaller.
  subroutine check_asked()
    call ask_for_all(deep)
    call check('all', all(deep%asked))
    points%n = 0
    call add_point(contact_point_t(2, 1, 1, depth=0.00049_wp), points)
    call ask_for_deep(points, blocks, deep)
    call check('2.45 % is not deep', .not. any(deep%asked))
    call add_point(contact_point_t(2, 1, 2, depth=0.00051_wp), points)
    call ask_for_deep(points, blocks, deep)
    call check('2.55 % is', all(deep%asked .eqv. [.true., .true., .false.]))
    blocks%still(:2) = .true.
    call add_point(contact_point_t(3, floor, 1, depth=0.00051_wp), points)
    call ask_for_deep(points, blocks, deep)
    call check('but not of two still ones', all(deep%asked .eqv. [.false., .false., .true.]))
    blocks%still(2) = .false.
    call ask_for_deep(points, blocks, deep)
    call check('of one still one', all(deep%asked))
  end subroutine check_asked

  !> Three cubes, small, large, small.
  subroutine make_cubes()
    character(:), allocatable :: message
    type(shape_t) :: shapes(2)
    type(case_t) :: case
    integer :: s

    allocate (case%shape(2), case%body(3), case%drop(0))
    case%shape%name = [character(5) :: 'small', 'large']
    case%shape%kind = 'cube'
    do s = 1, 2
      case%shape(s)%size = size(s)
      call make_shape(case%shape(s), shapes(s), message)
    end do
    case%body%shape = [character(5) :: 'small', 'large', 'small']
    do s = 1, 3
      case%body(s)%position = real(s, wp)
    end do
    call blocks_init(case, shapes, blocks)
    call deep_overlaps_init(blocks, deep)
  end subroutine make_cubes

end module test_deep_overlaps_m
