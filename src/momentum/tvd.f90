!> Fifth-order value on a face, kept from overshooting in one of two ways.
!!
!! Both have the value (2, -13, 47, 27, -3)/60 where no limiter acts. `tvd5` takes the compact MUSCL
!! structure of Yamamoto & Daiguji (1993), with weights 1/5 and 3/20 in place of their 1/6 (fourth
!! order); `mp5` clips the value itself to the bounds of Suresh & Huynh (1997), which are wider
!! where the data are smooth.
module tvd_m
  use kinds_m, only: wp
  use grid_m, only: grid_t
  implicit none
  private
  public :: face_values, face_row, scheme_of, tvd_scheme, mp_scheme

  integer, parameter :: tvd_scheme = 1      !! fifth-order TVD value
  integer, parameter :: upwind_scheme = 2   !! value of the donor cell
  integer, parameter :: mp_scheme = 3       !! fifth-order value that keeps monotony

  real(wp), parameter :: limit_outer = 4.0_wp   !! b, = (3 - k)/(1 - k) with k = 1/3
  real(wp), parameter :: limit_inner = 2.0_wp   !! b_1
  real(wp), parameter :: steepest = 2.0_wp
    !! alpha: the value is at most this times the step below the cell away from the cell's. With the
    !! mean of the slab monotone while alpha <= 1/(Courant number): 0.5 in liquid, the default of
    !! `cfl_max`. Gas, and liquid in longer steps, may reach C = 0.9 in a sweep: there a step
    !! overshoots by (1 - C)(2 C - 1) of the step before, an eighth of it at most

contains

  !> Scheme of a name of the case file; an unknown one ends the program.
  function scheme_of(name) result(scheme)
    character(*), intent(in) :: name   !! 'mp5' | 'tvd5' | 'upwind'
    integer :: scheme

    select case (name)
    case ('upwind'); scheme = upwind_scheme
    case ('tvd5'); scheme = tvd_scheme
    case ('mp5'); scheme = mp_scheme
    case default; error stop 'scheme_of: no such scheme'
    end select
  end function scheme_of

  !> Values on the lower faces in one direction, from the side where the fluid comes from.
  subroutine face_values(grid, scheme, e, q, u, face)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: scheme   !! `mp_scheme` | `tvd_scheme` | `upwind_scheme`
    integer, intent(in) :: e(3)     !! step along the direction
    real(wp), intent(in), dimension(grid%first(1):, grid%first(2):, grid%first(3):), &
      contiguous :: q, u            !! flux through the lower face, any unit; what is carried
    real(wp), intent(inout), contiguous :: face(grid%first(1):, grid%first(2):, grid%first(3):)
      !! own lower faces and the upper ones of the last cells
    integer :: j, k

    !$omp parallel do private(j) schedule(static)
    do k = grid%lo(3), grid%hi(3) + e(3)
      do j = grid%lo(2), grid%hi(2) + e(2)
        call face_row(grid, scheme, e, [grid%lo(1), j, k], q, u, &
                      face(grid%lo(1):grid%hi(1) + e(1), j, k))
      end do
    end do
  end subroutine face_values

  !> The same for the lower faces of the cells of a line from cell c on. `mp5` is called here only:
  !! so the compiler puts it into the loop, which then is one over vectors.
  subroutine face_row(grid, scheme, e, c, q, u, face)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: scheme, e(3), c(3)
    real(wp), intent(in), dimension(grid%first(1):, grid%first(2):, grid%first(3):), &
      contiguous :: q, u
    real(wp), intent(inout), contiguous :: face(:)
    integer :: i, j, k, a, b
    logical :: forward

    a = c(1)
    j = c(2)
    k = c(3)
    b = a + size(face) - 1
    associate (flux => q(a:b, j, k), &
               u_3 => u(a - 3*e(1):b - 3*e(1), j - 3*e(2), k - 3*e(3)), &
               u_2 => u(a - 2*e(1):b - 2*e(1), j - 2*e(2), k - 2*e(3)), &
               u_1 => u(a - e(1):b - e(1), j - e(2), k - e(3)), &
               v_1 => u(a:b, j, k), &
               v_2 => u(a + e(1):b + e(1), j + e(2), k + e(3)), &
               v_3 => u(a + 2*e(1):b + 2*e(1), j + 2*e(2), k + 2*e(3)))
      select case (scheme)
      case (upwind_scheme)
        face = merge(u_1, v_1, flux > 0.0_wp)
      case (tvd_scheme)
        !$omp simd private(forward)
        do i = 1, size(face)
          forward = flux(i) > 0.0_wp
          face(i) = tvd5(merge(u_3(i), v_3(i), forward), merge(u_2(i), v_2(i), forward), &
                         merge(u_1(i), v_1(i), forward), merge(v_1(i), u_1(i), forward), &
                         merge(v_2(i), u_2(i), forward))
        end do
      case default
        !$omp simd private(forward)
        do i = 1, size(face)
          forward = flux(i) > 0.0_wp
          face(i) = mp5(merge(u_3(i), v_3(i), forward), merge(u_2(i), v_2(i), forward), &
                        merge(u_1(i), v_1(i), forward), merge(v_1(i), u_1(i), forward), &
                        merge(v_2(i), u_2(i), forward))
        end do
      end select
    end associate
  end subroutine face_row

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

  !> Value on the downstream face of cell 0, from the cells -2..2 counted along the flow: that of
  !! fifth order, clipped.
  !!
  !! On monotone data between the values of cell 0 and cell 1 and no steeper than `steepest` times
  !! the step before; beside an extremum of smooth data as far out as its curvature says.
  !! Source: Suresh & Huynh (1997), eqs. (2.1) and (2.24) to (2.27), without their test whether to
  !! clip: a value that passes it lies within the bounds.
  elemental function mp5(q_m2, q_m1, q_0, q_1, q_2) result(q)
    real(wp), intent(in) :: q_m2, q_m1, q_0, q_1, q_2
    real(wp) :: q
    real(wp) :: d_m3, d_m1, d_p1, d_p3   !! differences over the faces -3/2, -1/2, 1/2, 3/2
    real(wp) :: middle, large, low, high !! of the value less that of cell 0

    d_m3 = q_m1 - q_m2
    d_m1 = q_0 - q_m1
    d_p1 = q_1 - q_0
    d_p3 = q_2 - q_1
    middle = 0.5_wp*(d_p1 - min_curvature(d_p1 - d_m1, d_p3 - d_p1))
    large = 0.5_wp*d_m1 + 4.0_wp/3.0_wp*min_curvature(d_m1 - d_m3, d_p1 - d_m1)
    low = max(min(0.0_wp, d_p1, middle), min(0.0_wp, steepest*d_m1, large))
    high = min(max(0.0_wp, d_p1, middle), max(0.0_wp, steepest*d_m1, large))
    q = (24.0_wp*d_p1 + 11.0_wp*d_m1 - 2.0_wp*d_m3 - 3.0_wp*d_p3)/60.0_wp
    q = q_0 + max(low, min(high, q))
  end function mp5

  !> Second difference at a face, from those of the cells beside it: the smallest of a, b, 4a - b
  !! and 4b - a, zero if their signs differ.
  elemental function min_curvature(a, b) result(c)
    real(wp), intent(in) :: a, b
    real(wp) :: c

    c = max(0.0_wp, min(a, b, 4.0_wp*a - b, 4.0_wp*b - a)) &
        + min(0.0_wp, max(a, b, 4.0_wp*a - b, 4.0_wp*b - a))
  end function min_curvature

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
