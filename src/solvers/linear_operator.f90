!> What the iterative solvers know of a linear system: how its matrix and a preconditioner act.
!!
!! All vectors are blocks of this process with one halo cell on every side. Halos of an operator's
!! argument are the operator's business; it may count on zeros outside the sides of the domain.
module linear_operator_m
  use kinds_m, only: wp
  use grid_m, only: grid_t
  implicit none
  private
  public :: linear_operator_t, preconditioner_t, jacobi_t, identity_t, seven_points

  integer, parameter :: worth_threads = 8192   !! fewer numbers are the work of one thread

  type, abstract :: linear_operator_t
  contains
    procedure(apply_operator_i), deferred :: apply
  end type linear_operator_t

  type, abstract :: preconditioner_t
  contains
    procedure(apply_preconditioner_i), deferred :: apply
  end type preconditioner_t

  abstract interface
    !> y = A x on the own cells.
    subroutine apply_operator_i(self, x, y)
      import :: linear_operator_t, wp
      implicit none
      class(linear_operator_t), intent(inout) :: self
      real(wp), intent(inout), contiguous :: x(:, :, :)   !! its halo is filled here
      real(wp), intent(inout), contiguous :: y(:, :, :)
    end subroutine apply_operator_i

    !> z = M r on the own cells, with M near the inverse of A, symmetric and positive.
    subroutine apply_preconditioner_i(self, r, r_max, z)
      import :: preconditioner_t, wp
      implicit none
      class(preconditioner_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: r(:, :, :)
      real(wp), intent(in) :: r_max   !! largest |r| of all processes, > 0
      real(wp), intent(inout), contiguous :: z(:, :, :)
    end subroutine apply_preconditioner_i
  end interface

  !> No preconditioner.
  type, extends(preconditioner_t) :: identity_t
  contains
    procedure :: apply => apply_identity
  end type identity_t

  !> Division by the diagonal of the operator with face coefficients `cf`.
  type, extends(preconditioner_t) :: jacobi_t
    real(wp), allocatable :: inverse(:, :, :)   !! of the diagonal, zero in closed cells
  contains
    procedure :: setup => setup_jacobi
    procedure :: apply => apply_jacobi
  end type jacobi_t

contains

  !> y = sum over the faces of a cell of cf (x - x beyond the face).
  subroutine seven_points(cf, x, y, line)
    real(wp), intent(in), contiguous :: cf(:, :, :, :)   !! of the lower faces
    real(wp), intent(in), contiguous :: x(:, :, :)
    real(wp), intent(inout), contiguous :: y(:, :, :)
    integer, intent(in), optional :: line(:, :, :)
      !! (2, j, k) first and last cell of each line that take part; all if not given
    integer :: i, j, k, ends(2)

    !$omp parallel do private(i, j, ends) schedule(static) if (size(x) > worth_threads)
    do k = 2, size(x, 3) - 1
      do j = 2, size(x, 2) - 1
        ends = [2, size(x, 1) - 1]
        if (present(line)) ends = line(:, j, k)
        do i = ends(1), ends(2)
          y(i, j, k) = cf(i, j, k, 1)*(x(i, j, k) - x(i - 1, j, k)) &
                       + cf(i + 1, j, k, 1)*(x(i, j, k) - x(i + 1, j, k)) &
                       + cf(i, j, k, 2)*(x(i, j, k) - x(i, j - 1, k)) &
                       + cf(i, j + 1, k, 2)*(x(i, j, k) - x(i, j + 1, k)) &
                       + cf(i, j, k, 3)*(x(i, j, k) - x(i, j, k - 1)) &
                       + cf(i, j, k + 1, 3)*(x(i, j, k) - x(i, j, k + 1))
        end do
      end do
    end do
  end subroutine seven_points

  subroutine apply_identity(self, r, r_max, z)
    class(identity_t), intent(inout) :: self
    real(wp), intent(in), contiguous :: r(:, :, :)
    real(wp), intent(in) :: r_max
    real(wp), intent(inout), contiguous :: z(:, :, :)

    associate (unused => self, unused_too => r_max)
    end associate
    z = r
  end subroutine apply_identity

  !> Take the diagonal from the coefficients of the lower faces; a first call allocates.
  subroutine setup_jacobi(self, grid, cf)
    class(jacobi_t), intent(inout) :: self
    type(grid_t), intent(in) :: grid
    real(wp), intent(in), contiguous :: cf(grid%lo(1) - 1:, grid%lo(2) - 1:, grid%lo(3) - 1:, :)
    integer :: i, j, k, a(3), b(3)
    real(wp) :: d

    a = grid%lo - 1
    b = grid%hi + 1
    if (.not. allocated(self%inverse)) then
      allocate (self%inverse(a(1):b(1), a(2):b(2), a(3):b(3)), source=0.0_wp)
    end if
    !$omp parallel do private(i, j, d) schedule(static) if (size(cf) > worth_threads)
    do k = grid%lo(3), grid%hi(3)
      do j = grid%lo(2), grid%hi(2)
        do i = grid%lo(1), grid%hi(1)
          d = cf(i, j, k, 1) + cf(i + 1, j, k, 1) + cf(i, j, k, 2) + cf(i, j + 1, k, 2) &
            + cf(i, j, k, 3) + cf(i, j, k + 1, 3)
          self%inverse(i, j, k) = 0.0_wp
          if (d > 0.0_wp) self%inverse(i, j, k) = 1.0_wp/d
        end do
      end do
    end do
  end subroutine setup_jacobi

  subroutine apply_jacobi(self, r, r_max, z)
    class(jacobi_t), intent(inout) :: self
    real(wp), intent(in), contiguous :: r(:, :, :)
    real(wp), intent(in) :: r_max
    real(wp), intent(inout), contiguous :: z(:, :, :)

    integer :: k, below

    associate (unused => r_max)
    end associate
    below = lbound(self%inverse, 3) - 1
    !$omp parallel do schedule(static) if (size(r) > worth_threads)
    do k = 2, size(r, 3) - 1
      z(:, :, k) = self%inverse(:, :, below + k)*r(:, :, k)
    end do
  end subroutine apply_jacobi

end module linear_operator_m
