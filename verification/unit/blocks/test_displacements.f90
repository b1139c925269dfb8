!> Lists of displacements: order, parting, joining; pairs met.
module test_displacements_m
  use check_m, only: check, wp
  use displacements_m, only: displacements_t, reserve_displacements, comes_before, &
    move_displacements
  use contact_solver_m, only: met_t, store_counterparts
  implicit none
  private
  public :: test_displacements

contains

  subroutine test_displacements()
    call check_order()
    call check_moving()
    call check_met()
  end subroutine test_displacements

  subroutine check_order()
    call check('by body', comes_before(1, 9, 9, 2, 0, 0))
    call check('then counterpart', comes_before(2, -7, 9, 2, -1, 0))
    call check('then id', comes_before(2, 1, 3, 2, 1, 4))
    call check('not before itself', .not. comes_before(2, 1, 3, 2, 1, 3))
  end subroutine check_order

  !> A list of displacements of bodies with counterpart 1; all else follows from its body.
  subroutine make(bodies, displacements)
    integer, intent(in) :: bodies(:)
    type(displacements_t), intent(inout) :: displacements
    integer :: i

    call reserve_displacements(size(bodies), displacements)
    displacements%n = size(bodies)
    do i = 1, displacements%n
      displacements%a(i) = bodies(i)
      displacements%b(i) = 1
      displacements%id(i) = 2*bodies(i)
      displacements%other(i) = 9*bodies(i)
      displacements%xi(:, i) = 3.0_wp*bodies(i)
      displacements%k(i) = 4.0_wp*bodies(i)
      displacements%force(:, i) = 5.0_wp*bodies(i)
      displacements%torque_a(:, i) = 6.0_wp*bodies(i)
      displacements%torque_b(:, i) = 7.0_wp*bodies(i)
      displacements%energy(i) = 8.0_wp*bodies(i)
    end do
  end subroutine make

  !> Whether a list is that of some bodies.
  logical function is(displacements, bodies)
    type(displacements_t), intent(in) :: displacements
    integer, intent(in) :: bodies(:)
    type(displacements_t) :: wanted

    call make(bodies, wanted)
    is = displacements%n == wanted%n
    if (is) is = all(abs(content(displacements) - content(wanted)) <= 0.0_wp)
  end function is

  !> All numbers of a list.
  pure function content(list) result(x)
    type(displacements_t), intent(in) :: list
    real(wp), allocatable :: x(:)

    associate (n => list%n)
      x = [real([list%a(:n), list%b(:n), list%id(:n), list%other(:n)], wp), list%k(:n), &
        list%energy(:n), list%xi(:, :n), list%force(:, :n), list%torque_a(:, :n), &
        list%torque_b(:, :n)]
    end associate
  end function content

  !> Chosen displacements go to the other list, whole and in order.
  subroutine check_moving()
    type(displacements_t) :: from, to

    call make([2, 4, 5, 7, 9], from)
    call make([3, 6], to)
    call move_displacements([.false., .true., .false., .true., .true.], from, to)
    call check('those left', is(from, [2, 5]))
    call check('those joined', is(to, [3, 4, 6, 7, 9]))
    call move_displacements([.true., .true.], from, to)
    call check('none left', from%n, 0)
    call check('all joined', is(to, [2, 3, 4, 5, 6, 7, 9]))
  end subroutine check_moving

  !> Pairs met are noted once, sorted.
  subroutine check_met()
    type(met_t) :: met

    call store_counterparts([3, 3, 4], [1, 1, -5], met)
    call store_counterparts([2, 3, 3, 4, 5], [1, -1, 1, -5, 1], met)
    call check('each pair once', met%n, 5)
    call check('sorted', all(met%a(:5) == [2, 3, 3, 4, 5]))
    call check('with their counterparts', all(met%b(:5) == [1, -1, 1, -5, 1]))
  end subroutine check_met

end module test_displacements_m
