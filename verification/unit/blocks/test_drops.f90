!> The random part of a drop: reproducible, uniform, and as wide as asked.
module test_drops_m
  use check_m, only: check, wp, pi
  use case_types_m, only: drop_input_t, place_t
  use vectors_m, only: quaternion_from_axis, quaternion_product
  use rotations_m, only: rotate
  use random_counter_m, only: random_rotation
  use drops_m, only: place_of_block, count_of_shape, shape_of_place
  use tet_mesh_m, only: shape_t
  implicit none
  private
  public :: test_drops

contains

  subroutine test_drops()
    call check_shift()
    call check_tilt()
    call check_stones()
    call check_line()
    call check_shapes()
  end subroutine test_drops

  !> Shifts fill their box evenly; the same index draws the same, another seed draws another.
  subroutine check_shift()
    integer, parameter :: n = 20000
    type(drop_input_t) :: drop
    real(wp) :: x(3), q(4), again(3), u(3, n), other(3)
    integer :: i, k

    drop%position = [1.0_wp, 2.0_wp, 3.0_wp]
    call draw(drop, 5, x, q)
    call check('no spread, no shift', x - drop%position, 0.0_wp)
    call check('given attitude', q, [1, 0, 0, 0]*1.0_wp)
    drop%spread = [0.5_wp, 0.1_wp, 0.0_wp]
    do i = 1, n
      call draw(drop, i, x, q)
      u(:, i) = (x - drop%position)/max(drop%spread, 0.01_wp)
    end do
    call draw(drop, 7, again, q)
    call check('drawn again', (again - drop%position)/[0.5_wp, 0.1_wp, 0.01_wp] - u(:, 7), 0.0_wp)
    call check('no shift along z', u(3, :), 0.0_wp)
    call check('within the spread', maxval(abs(u)) <= 1.0_wp .and. maxval(u(1, :)) > 0.999_wp)
    ! standard errors at n = 20000: mean 0.0041, variance 0.0021; four of them
    do k = 1, 2
      call check('mean', sum(u(k, :))/real(n, wp), 0.0_wp, 0.016_wp)
      call check('uniform: its variance', sum(u(k, :)**2)/real(n, wp), 1.0_wp/3.0_wp, 0.009_wp)
    end do
    call check('x and y are independent', sum(u(1, :)*u(2, :))/real(n, wp), 0.0_wp, 0.01_wp)
    call check('so are neighbours', sum(u(1, 2:)*u(1, :n - 1))/real(n, wp), 0.0_wp, 0.01_wp)
    drop%orientation = 'random'
    call draw(drop, 7, again, q)
    call check('any attitude', q, random_rotation(drop%seed, 7))
    drop%seed = 2
    call draw(drop, 7, other, q)
    call check('another seed', norm2(other - again) > 1.0e-6_wp)
  end subroutine check_shift

  !> Each stone of a family as often as another, a single one always; other shapes are passed over.
  subroutine check_stones()
    integer, parameter :: n = 20000
    type(shape_t) :: shapes(5)
    integer :: times(5), i, s

    shapes%name = [character(4) :: 'a-01', 'cube', 'b-01', 'b-02', 'b-03']
    shapes%family = [character(4) :: 'a', '', 'b', 'b', 'b']
    times = 0
    do i = 1, n
      s = drawn('b', i)
      times(s) = times(s) + 1
    end do
    call check('only stones of the family', all(times(:2) == 0))
    ! standard error 67, four of them
    call check('as often', real(times(3:), wp), spread(real(n, wp)/3, 1, 3), 270.0_wp)
    call check('one stone', drawn('b-03', 1), 5)
    call check('another shape', drawn('cube', 1), 2)
    call check('none', drawn('c', 1), 0)
  contains
    !> Number of the shape of block i with a shape of that name.
    integer function drawn(name, i)
      character(*), intent(in) :: name
      integer, intent(in) :: i
      type(place_t) :: place

      place%shape = name
      place%index = i
      drawn = shape_of_place(place, shapes)
    end function drawn
  end subroutine check_stones

  !> Tilts of a given attitude: uniform angle up to the largest, axes in all directions.
  subroutine check_tilt()
    integer, parameter :: n = 20000
    type(drop_input_t) :: drop
    real(wp) :: x(3), q(4), given(4), turn(4), up(3), mean(3), square(3), angle, mean_angle, largest
    integer :: i

    given = quaternion_from_axis([1.0_wp, 2.0_wp, 3.0_wp], 1.0_wp)
    drop%position = 0.0_wp
    drop%quaternion = 3*given
    drop%tilt_deg = 10.0_wp
    mean_angle = 0.0_wp
    largest = 0.0_wp
    mean = 0.0_wp
    square = 0.0_wp
    do i = 1, n
      call draw(drop, i, x, q)
      angle = 2*acos(min(1.0_wp, abs(dot_product(q, given))))*180.0_wp/pi
      mean_angle = mean_angle + angle/real(n, wp)
      largest = max(largest, angle)
      up = rotate(given, [0.0_wp, 0.0_wp, 1.0_wp])
      mean = mean + (rotate(q, [0.0_wp, 0.0_wp, 1.0_wp]) - up)/real(n, wp)
      turn = quaternion_product(q, given*[1, -1, -1, -1])
      square = square + turn(2:4)**2/sum(turn(2:4)**2)/real(n, wp)
    end do
    call check('largest tilt', largest, 10.0_wp, 0.01_wp)
    call check('mean tilt', mean_angle, 5.0_wp, 0.09_wp)   ! standard error 0.02
    call check('about axes of all directions', square - 1.0_wp/3.0_wp, 0.0_wp, 0.009_wp)
    call check('to all sides', norm2(mean - dot_product(mean, up)*up), 0.0_wp, 0.002_wp)
    call check('unit quaternion', norm2(q), 1.0_wp, 1.0e-15_wp)
  end subroutine check_tilt

  !> Place and attitude of a block of a drop.
  subroutine draw(drop, index, x, q)
    type(drop_input_t), intent(in) :: drop
    integer, intent(in) :: index
    real(wp), intent(out) :: x(3), q(4)
    type(place_t) :: place

    place = place_of_block(drop, index)
    x = place%x
    q = place%q
  end subroutine draw

  !> From one place to another in even steps, on time, shifted as a drop at one place is.
  subroutine check_line()
    type(drop_input_t) :: drop, still
    type(place_t) :: place, other
    integer :: k

    drop%position = [1.0_wp, 2.0_wp, 3.0_wp]
    drop%to = [3.0_wp, 2.0_wp, 2.0_wp]
    drop%count = 5
    drop%first_time = 7.0_wp
    do k = 1, 5
      place = place_of_block(drop, k)
      call check('along the line', place%x, [1.0_wp + 0.5_wp*(k - 1), 2.0_wp, &
                                             3.0_wp - 0.25_wp*(k - 1)], 1.0e-15_wp)
      call check('time', place%time, 6.0_wp + k)
    end do
    drop%spread = 0.1_wp
    still = drop
    still%to = still%position
    place = place_of_block(drop, 3)
    other = place_of_block(still, 3)
    call check('shift', place%x - [2.0_wp, 2.0_wp, 2.5_wp], other%x - still%position, 1.0e-15_wp)
  end subroutine check_line

  !> Shapes come as often as their weights say, whatever else is drawn, and never with weight 0.
  subroutine check_shapes()
    integer, parameter :: n = 20000
    type(drop_input_t) :: drop
    type(place_t) :: place
    integer :: found(3), k

    drop%position = 0.0_wp
    drop%count = n
    drop%shapes(:3) = [character(1) :: 'a', 'b', 'c']
    drop%weights(:3) = [1.0_wp, 0.0_wp, 3.0_wp]
    found = [(count_of_shape(drop, shape_t(name=drop%shapes(k)), .true.), k=1, 3)]
    call check('each has one', sum(found), n)
    call check('none of weight 0', found(2), 0)
    ! standard error 0.0031, four of them
    call check('as often as the weights say', real(found(1), wp)/real(n, wp), 0.25_wp, 0.0125_wp)
    place = place_of_block(drop, 1)
    call check('the first of seed 1 on every machine', place%shape == 'a')
  end subroutine check_shapes

end module test_drops_m
