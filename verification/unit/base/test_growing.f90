!> Lists that grow keep what is in them, and grow by doubling.
module test_growing_m
  use check_m, only: check, wp
  use growing_m, only: ensure_capacity
  implicit none
  private
  public :: test_growing

contains

  subroutine test_growing()
    call check_lists()
    call check_columns()
  end subroutine test_growing

  !> Integers, reals and logicals, entry by entry.
  subroutine check_lists()
    integer, parameter :: n = 100
    integer, allocatable :: whole(:)
    real(wp), allocatable :: x(:)
    logical, allocatable :: even(:)
    integer :: i, changes, capacity

    changes = 0
    capacity = 0
    do i = 1, n
      call ensure_capacity(i, whole)
      call ensure_capacity(i, x)
      call ensure_capacity(i, even)
      whole(i) = i
      x(i) = 0.5_wp*i
      even(i) = modulo(i, 2) == 0
      if (size(whole) /= capacity) changes = changes + 1
      capacity = size(whole)
    end do
    call check('integers are kept', all(whole(:n) == [(i, i=1, n)]))
    call check('reals are kept', x(:n), [(0.5_wp*i, i=1, n)])
    call check('logicals are kept', all(even(:n) .eqv. [(modulo(i, 2) == 0, i=1, n)]))
    call check('room of 16, 32, 64, 128: by doubling', changes, 4)
    call check('no more room than that', capacity, 128)
    call ensure_capacity(1000, whole)
    call ensure_capacity(3, whole)
    call check('as much as asked for at once, never less', size(whole), 1000)
    call check('and still kept', all(whole(:n) == [(i, i=1, n)]))
  end subroutine check_lists

  !> Columns of three, or of as many numbers as said at first.
  subroutine check_columns()
    integer, parameter :: n = 40
    real(wp), allocatable :: x(:, :), quaternion(:, :)
    integer, allocatable :: face(:, :)
    integer :: i

    do i = 1, n
      call ensure_capacity(i, x)
      call ensure_capacity(i, quaternion, rows=4)
      call ensure_capacity(i, face, rows=2)
      x(:, i) = real([i, -i, 2*i], wp)
      quaternion(:, i) = real(i, wp)
      face(:, i) = [i, i + 1]
    end do
    call check('vectors are kept', x(3, :n), [(2.0_wp*i, i=1, n)])
    call check('three numbers each', size(x, 1), 3)
    call check('columns of four', all(shape(quaternion) == [4, 64]))
    call check('columns of two', all(face(2, :n) == [(i + 1, i=1, n)]) .and. size(face, 1) == 2)
  end subroutine check_columns

end module test_growing_m
