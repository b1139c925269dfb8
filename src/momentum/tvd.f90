!> Fifth-order TVD value on a face.
!!
!! Source: Yamamoto & Daiguji (1993), compact MUSCL structure; weights 1/5 and 3/20 make the
!! unlimited value (2, -13, 47, 27, -3)/60, fifth order, in place of their 1/6 (fourth order).
module tvd_m
  use kinds_m, only: wp
  implicit none
  private
  public :: tvd5, scheme_of, tvd_scheme, upwind_scheme

  integer, parameter :: tvd_scheme = 1      !! fifth-order TVD value
  integer, parameter :: upwind_scheme = 2   !! value of the donor cell

  real(wp), parameter :: limit_outer = 4.0_wp   !! b, = (3 - k)/(1 - k) with k = 1/3
  real(wp), parameter :: limit_inner = 2.0_wp   !! b_1

contains

  !> Scheme of a name of the case file.
  pure function scheme_of(name) result(scheme)
    character(*), intent(in) :: name   !! 'tvd5' | 'upwind'
    integer :: scheme

    scheme = merge(upwind_scheme, tvd_scheme, trim(name) == 'upwind')
  end function scheme_of

  !> Value on the downstream face of cell 0, from the cells -2..2 counted along the flow.
  !!
  !! Always between the values of cell 0 and cell 1 (the last minmod; it acts on rough data only).
  elemental function tvd5(q_m2, q_m1, q_0, q_1, q_2) result(q)
    real(wp), intent(in) :: q_m2, q_m1, q_0, q_1, q_2
    real(wp) :: q
    real(wp) :: d_m3, d_m1, d_p1, d_p3   !! differences over the faces -3/2, -1/2, 1/2, 3/2
    real(wp) :: up, down

    d_m3 = q_m1 - q_m2
    d_m1 = q_0 - q_m1
    d_p1 = q_1 - q_0
    d_p3 = q_2 - q_1
    up = d_m1 - third_difference(d_m3, d_m1, d_p1)/5.0_wp
    down = d_p1 - third_difference(d_m1, d_p1, d_p3)*(3.0_wp/20.0_wp)
    q = minmod(up, limit_outer*down)/6.0_wp + minmod(down, limit_outer*up)/3.0_wp
    q = q_0 + minmod(q, d_p1)
  end function tvd5

  !> Limited third difference about the middle face, from three neighbouring differences.
  elemental function third_difference(a, b, c) result(t)
    real(wp), intent(in) :: a, b, c
    real(wp) :: t

    t = minmod3(a, limit_inner*b, limit_inner*c) - 2.0_wp*minmod3(b, limit_inner*c, limit_inner*a) &
      + minmod3(c, limit_inner*a, limit_inner*b)
  end function third_difference

  !> The smaller of two numbers of one sign, zero if their signs differ.
  elemental function minmod(a, b) result(m)
    real(wp), intent(in) :: a, b
    real(wp) :: m

    m = merge(sign(min(abs(a), abs(b)), a), 0.0_wp, a*b > 0.0_wp)
  end function minmod

  !> The smallest of three numbers of one sign, zero if their signs differ.
  elemental function minmod3(a, b, c) result(m)
    real(wp), intent(in) :: a, b, c
    real(wp) :: m

    m = merge(sign(min(abs(a), abs(b), abs(c)), a), 0.0_wp, a*b > 0.0_wp .and. a*c > 0.0_wp)
  end function minmod3

end module tvd_m
