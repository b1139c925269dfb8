!> Fifth-order values: exact weights on smooth data, order, bounds, monotony of a step.
module test_tvd_m
  use check_m, only: check, wp
  use grid_m, only: grid_t
  use tvd_m, only: face_row, tvd_scheme, mp_scheme
  implicit none
  private
  public :: test_tvd

  real(wp) :: q(-2:2), value, error(2), exact
  integer :: i, n, level

contains

  subroutine test_tvd()
    ! Where no limiter acts the weights are (2, -13, 47, 27, -3)/60.
    q = [1.0_wp, 2.1_wp, 3.3_wp, 4.6_wp, 6.0_wp]
    call check('weights on gentle data', face_value(tvd_scheme, q), &
               dot_product([2.0_wp, -13.0_wp, 47.0_wp, 27.0_wp, -3.0_wp], q)/60.0_wp, 1.0e-14_wp)

    ! Cell means of exp(x): the face value converges with fifth order.
    do level = 1, 2
      n = 16*2**level
      error(level) = 0.0_wp
      do i = 3, n - 3
        exact = exp(real(i, wp)/real(n, wp))
        value = face_value(tvd_scheme, [mean(i - 2), mean(i - 1), mean(i), mean(i + 1), &
                                          mean(i + 2)])
        error(level) = max(error(level), abs(value - exact))
      end do
    end do
    call check('order on exp(x)', log(error(1)/error(2))/log(2.0_wp), 5.0_wp, 0.15_wp)

    ! The value never leaves the interval between the donor and the next cell.
    do i = 1, 2000
      q = [sin(1.7_wp*i), sin(3.1_wp*i), cos(0.9_wp*i), sin(2.3_wp*i), cos(4.1_wp*i)]
      value = face_value(tvd_scheme, q)
      call check('between donor and next cell', value >= min(q(0), q(1)) - 1.0e-15_wp &
        .and. value <= max(q(0), q(1)) + 1.0e-15_wp)
    end do
    call check('extremum gives the donor', &
      face_value(tvd_scheme, [0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp]), 1.0_wp)

    call clipped()
  end subroutine test_tvd

  !> Value on the downstream face of cell 0, from the cells -2..2 counted along the flow.
  real(wp) function face_value(scheme, q) result(value)
    integer, intent(in) :: scheme   !! `mp_scheme` | `tvd_scheme`
    real(wp), intent(in) :: q(-2:2)
    type(grid_t) :: grid
    real(wp) :: flux(-2:4, 1, 1), u(-2:4, 1, 1), face(2)

    grid%first = [-2, 1, 1]
    grid%lo = 1
    grid%hi = 1
    flux = 1.0_wp
    u = 0.0_wp
    u(-1:3, 1, 1) = q
    call face_row(grid, scheme, [1, 0, 0], grid%lo, flux, u, face)
    value = face(2)
  end function face_value

  !> The value that is clipped: the same on gentle data, of fifth order over an extremum too, and
  !! steps of monotone data stay monotone.
  subroutine clipped()
    integer, parameter :: last = 60
    real(wp), parameter :: courant(3) = [0.1_wp, 0.25_wp, 0.5_wp]
    real(wp) :: line(-2:last), flux(0:last)
    integer :: c, step

    q = [1.0_wp, 2.1_wp, 3.3_wp, 4.6_wp, 6.0_wp]
    call check('clipped: weights on gentle data', face_value(mp_scheme, q), &
               dot_product([2.0_wp, -13.0_wp, 47.0_wp, 27.0_wp, -3.0_wp], q)/60.0_wp, 1.0e-14_wp)
    call check('clipped: foot of a front, twice the step before', &
               face_value(mp_scheme, [0.0_wp, 0.0_wp, 0.1_wp, 1.0_wp, 1.0_wp]), 0.3_wp, 1.0e-14_wp)
    call check('clipped: a single cell', &
               face_value(mp_scheme, [0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp]) <= 1.0_wp)
    do level = 1, 2
      n = 16*2**level
      error(level) = 0.0_wp
      do i = 0, 2*n
        exact = sin(real(i, wp)/real(n, wp))
        value = face_value(mp_scheme, [wave(i - 2), wave(i - 1), wave(i), wave(i + 1), wave(i + 2)])
        error(level) = max(error(level), abs(value - exact))
      end do
    end do
    call check('clipped: order over sin(x)', log(error(1)/error(2))/log(2.0_wp), 5.0_wp, 0.15_wp)

    do c = 1, 3
      line = 0.0_wp
      line(:10) = 1.0_wp
      line(11) = 0.3_wp
      do step = 1, 20
        do i = 0, last - 2
          value = face_value(mp_scheme, line(i - 2:i + 2))
          flux(i) = courant(c)*(line(i) + (1.0_wp - courant(c))*(value - line(i)))
        end do
        line(1:last - 2) = line(1:last - 2) - (flux(1:last - 2) - flux(0:last - 3))
        call check('clipped: stays monotone', all(line(-1:) <= line(:last - 1) + 1.0e-14_wp) &
          .and. all(abs(line - 0.5_wp) <= 0.5_wp + 1.0e-14_wp))
      end do
    end do
  end subroutine clipped

  !> Mean of sin over the cell that ends at i/n.
  pure real(wp) function wave(i) result(m)
    integer, intent(in) :: i

    m = real(n, wp)*(cos(real(i - 1, wp)/real(n, wp)) - cos(real(i, wp)/real(n, wp)))
  end function wave

  !> Mean of exp over the cell that ends at i/n.
  pure real(wp) function mean(i) result(m)
    integer, intent(in) :: i

    m = real(n, wp)*(exp(real(i, wp)/real(n, wp)) - exp(real(i - 1, wp)/real(n, wp)))
  end function mean

end module test_tvd_m
