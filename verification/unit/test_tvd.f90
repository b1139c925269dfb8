!> Fifth-order TVD value: exact weights on smooth data, order, bounds.
program test_tvd
  use kinds_m, only: wp
  use tvd_m, only: tvd5
  use check_m, only: check, finish_checks
  implicit none
  real(wp) :: q(-2:2), value, error(2), exact
  integer :: i, n, level
  logical :: inside

  ! Where no limiter acts the weights are (2, -13, 47, 27, -3)/60.
  q = [1.0_wp, 2.1_wp, 3.3_wp, 4.6_wp, 6.0_wp]
  call check('weights on gentle data', tvd5(q(-2), q(-1), q(0), q(1), q(2)), &
             dot_product([2.0_wp, -13.0_wp, 47.0_wp, 27.0_wp, -3.0_wp], q)/60.0_wp, 1.0e-14_wp)

  ! Cell means of exp(x): the face value converges with fifth order.
  do level = 1, 2
    n = 16*2**level
    error(level) = 0.0_wp
    do i = 3, n - 3
      exact = exp(real(i, wp)/real(n, wp))
      value = tvd5(mean(i - 2), mean(i - 1), mean(i), mean(i + 1), mean(i + 2))
      error(level) = max(error(level), abs(value - exact))
    end do
  end do
  call check('order on exp(x)', log(error(1)/error(2))/log(2.0_wp), 5.0_wp, 0.15_wp)

  ! The value never leaves the interval between the donor and the next cell.
  inside = .true.
  do i = 1, 2000
    q = [sin(1.7_wp*i), sin(3.1_wp*i), cos(0.9_wp*i), sin(2.3_wp*i), cos(4.1_wp*i)]
    value = tvd5(q(-2), q(-1), q(0), q(1), q(2))
    inside = inside .and. value >= min(q(0), q(1)) - 1.0e-15_wp .and. value <= max(q(0), q(1)) &
      + 1.0e-15_wp
  end do
  call check('between donor and next cell', inside)
  call check('extremum gives the donor', tvd5(0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp), 1.0_wp, &
             0.0_wp)
  call finish_checks()
contains
  !> Mean of exp over the cell that ends at i/n.
  pure function mean(i) result(m)
    integer, intent(in) :: i
    real(wp) :: m

    m = real(n, wp)*(exp(real(i, wp)/real(n, wp)) - exp(real(i - 1, wp)/real(n, wp)))
  end function mean
end program test_tvd
