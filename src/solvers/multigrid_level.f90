!> One grid of the multigrid cycle: its coefficients and the loops over its cells.
!!
!! The equation of a level is scaled by its diagonal D from both sides, so that its own diagonal
!! is one. With $$ \hat x = D^{1/2} x, \quad \hat b = D^{-1/2} b $$ the Gauss-Seidel update of a
!! cell is $$ \hat x_c = \hat b_c + \sum_f \hat c_f \hat x_{nb} $$ in single precision.
!!
!! Cells i = 2p-1 and i = 2p of a line in x form pair p. Arrays hold (p, m, j, k) with m = 1 for the
!! odd and m = 2 for the even cell, so the cells of one colour of a line lie side by side: colour 0
!! is m = 1 in lines with even j+k and m = 2 in the others. Lines are filled up with empty pairs to
!! a multiple of eight. All indices are global, so the colours do not depend on the processes.
!!
!! Work goes from the first to the last open cell of a line, in whole vectors: a system on few cells
!! costs what these cost.
module multigrid_level_m
  use kinds_m, only: wp, sp
  use parallel_m, only: halo_exchange
  implicit none
  private
  public :: level_t, level_init, set_equations, coarsen_coefficients
  public :: load_line, unload_line, relax_plane, restrict_plane, prolong_plane, fill_halo

  integer, parameter :: vector = 8   !! pairs the machine may treat together

  type :: level_t
    integer :: n(3) = 0                !! cells of the whole level
    integer :: lo(3) = 1, hi(3) = 0    !! first and last cell held here
    logical :: in_parts = .false.      !! each process holds its block; else each holds all cells
    logical :: wraps(3) = .false.      !! periodic, with more than one cell
    logical :: alone(3) = .false.      !! periodic with one cell, which is its own neighbour
    logical :: talks(3) = .false.      !! halo cells have to be filled
    logical :: seam = .false.          !! an odd number of cells wraps: cells of equal colour touch
    logical :: paired(3) = .false.     !! directions in which two cells make one of the next level
    logical :: many = .false.          !! cells enough for several threads
    integer :: a(3) = 1, z(3) = 0      !! bounds of the arrays over (p, j, k)
    integer, allocatable :: line(:, :, :)     !! (2, j, k) first and last pair with work; halo: none
    real(wp), allocatable :: ratio(:, :)      !! (coarse face, d) centre distance to the next one's
    real(wp), allocatable :: cf(:, :, :, :)   !! coefficients of the lower faces; not on the finest
    real(sp), allocatable :: f(:, :, :)       !! cells lo:hi, right side, later the correction
    real(sp), allocatable :: c(:, :, :, :, :) !! scaled coefficients, (p, m, j, k, d)
    real(sp), allocatable :: x(:, :, :, :)    !! scaled unknown
    real(sp), allocatable :: b(:, :, :, :)    !! scaled right side
    real(sp), allocatable :: s(:, :, :, :)    !! D**(-1/2), zero in closed cells
    real(sp), allocatable :: t(:, :, :, :)    !! D**(1/2), zero in closed cells
    real(sp), allocatable :: edge(:, :, :)    !! cells at the ends of the lines, for `fill_ends`
  end type level_t

contains

  !> Allocate the arrays of a level whose sizes are set.
  subroutine level_init(self)
    type(level_t), intent(inout) :: self
    integer :: pairs

    self%a = self%lo - 1
    self%z = self%hi + 1
    self%a(1) = (self%lo(1) + 1)/2 - 1
    pairs = (self%hi(1) + 1)/2 - self%a(1)
    self%z(1) = self%a(1) + vector*((pairs + vector - 1)/vector) + 1
    associate (a => self%a, z => self%z)
      allocate (self%line(2, a(2):z(2), a(3):z(3)), source=0)
      self%line(1, :, :) = 1
      allocate (self%x(a(1):z(1), 2, a(2):z(2), a(3):z(3)), source=0.0_sp)
      allocate (self%b, source=self%x)
      allocate (self%s, source=self%x)
      allocate (self%t, source=self%x)
      allocate (self%c(a(1):z(1), 2, a(2):z(2), a(3):z(3), 3), source=0.0_sp)
      if (self%talks(1)) allocate (self%edge(4, a(2):z(2), a(3):z(3)), source=0.0_sp)
    end associate
  end subroutine level_init

  !> Diagonal and scaled coefficients of a level from the coefficients of its lower faces.
  subroutine set_equations(self, cf, unit)
    type(level_t), intent(inout) :: self
    real(wp), intent(in), contiguous :: cf(self%lo(1) - 1:, self%lo(2) - 1:, self%lo(3) - 1:, :)
    real(wp), intent(in) :: unit   !! factor that makes the largest coefficient about one
    integer :: k

    !$omp parallel do schedule(static) if (self%many)
    do k = self%lo(3), self%hi(3)
      call set_diagonal(self, cf, unit, k)
    end do
    call fill_halo(self, self%s)
    !$omp parallel do schedule(static) if (self%many)
    do k = self%lo(3), self%hi(3) + 1
      call scale_faces(self, cf, unit, k)
    end do
  end subroutine set_equations

  !> Roots of the diagonal in plane k, and where its lines have open cells.
  subroutine set_diagonal(self, cf, unit, k)
    type(level_t), intent(inout) :: self
    real(wp), intent(in), contiguous :: cf(self%lo(1) - 1:, self%lo(2) - 1:, self%lo(3) - 1:, :)
    real(wp), intent(in) :: unit
    integer, intent(in) :: k
    real(sp), parameter :: least = 1.0e-30_sp   !! diagonal of open cells: no root overflows
    real(wp) :: w(3)
    real(sp) :: diagonal, root
    integer :: p, m, i, j

    w = merge(0.0_wp, unit, self%alone)
    do j = self%lo(2), self%hi(2)
      do m = 1, 2
        !$omp simd private(i, diagonal, root)
        do p = self%a(1) + 1, (self%hi(1) + 2 - m)/2
          i = 2*p - 2 + m
          diagonal = real(w(1)*(cf(i, j, k, 1) + cf(i + 1, j, k, 1)) &
            + w(2)*(cf(i, j, k, 2) + cf(i, j + 1, k, 2)) &
            + w(3)*(cf(i, j, k, 3) + cf(i, j, k + 1, 3)), sp)
          root = sqrt(max(diagonal, least))
          self%t(p, m, j, k) = merge(root, 0.0_sp, diagonal > 0.0_sp)
          self%s(p, m, j, k) = merge(1.0_sp/root, 0.0_sp, diagonal > 0.0_sp)
        end do
      end do
      ! First and last pair of the vectors that hold the open cells of the line; first > last: none.
      self%line(:, j, k) = [self%z(1), self%a(1)]
      do p = self%a(1) + 1, self%z(1) - 1, vector
        if (all(self%t(p:p + vector - 1, :, j, k) <= 0.0_sp)) cycle
        self%line(1, j, k) = min(self%line(1, j, k), p)
        self%line(2, j, k) = p + vector - 1
      end do
    end do
  end subroutine set_diagonal

  !> Scaled coefficients of the lower faces of plane k, upper sides of the last cells included.
  !!
  !! Beyond a side of the domain `s` is zero, and so is the scaled coefficient of the side: what
  !! is given there stands in the diagonal only.
  subroutine scale_faces(self, cf, unit, k)
    type(level_t), intent(inout) :: self
    real(wp), intent(in), contiguous :: cf(self%lo(1) - 1:, self%lo(2) - 1:, self%lo(3) - 1:, :)
    real(wp), intent(in) :: unit
    integer, intent(in) :: k
    integer :: p, m, j

    do j = self%lo(2), self%hi(2) + 1
      do m = 1, 2
        if (k <= self%hi(3) .and. j <= self%hi(2)) then
          !$omp simd
          do p = self%a(1) + 1, (self%hi(1) + 3 - m)/2
            self%c(p, m, j, k, 1) = real(unit*cf(2*p - 2 + m, j, k, 1), sp) &
              *self%s(p, m, j, k)*self%s(p + m - 2, 3 - m, j, k)
          end do
        end if
        if (k <= self%hi(3)) then
          !$omp simd
          do p = self%a(1) + 1, (self%hi(1) + 2 - m)/2
            self%c(p, m, j, k, 2) = real(unit*cf(2*p - 2 + m, j, k, 2), sp) &
              *self%s(p, m, j, k)*self%s(p, m, j - 1, k)
          end do
        end if
        if (j > self%hi(2)) cycle
        !$omp simd
        do p = self%a(1) + 1, (self%hi(1) + 2 - m)/2
          self%c(p, m, j, k, 3) = real(unit*cf(2*p - 2 + m, j, k, 3), sp) &
            *self%s(p, m, j, k)*self%s(p, m, j, k - 1)
        end do
      end do
    end do
  end subroutine scale_faces

  !> First of the finer cells (or faces) that make coarse cell (or face) number i.
  elemental function first_of(i, paired) result(first)
    integer, intent(in) :: i
    logical, intent(in) :: paired
    integer :: first

    first = merge(2*i - 1, i, paired)
  end function first_of

  !> Last of the finer cells that make coarse cell number i; the last coarse cell may hold one only.
  elemental function last_of(i, paired, hi) result(last)
    integer, intent(in) :: i, hi
    logical, intent(in) :: paired
    integer :: last

    last = min(merge(2*i, i, paired), hi)
  end function last_of

  !> Coefficients of the next level: sum over the finer faces on a coarse face, times the ratio of
  !! the centre distances.
  subroutine coarsen_coefficients(fine, cf, lo, hi, coarse_cf)
    type(level_t), intent(in) :: fine
    real(wp), intent(in), contiguous :: cf(fine%lo(1) - 1:, fine%lo(2) - 1:, fine%lo(3) - 1:, :)
    integer, intent(in) :: lo(3), hi(3)   !! coarse cells to be done
    real(wp), intent(inout), contiguous :: coarse_cf(lo(1) - 1:, lo(2) - 1:, lo(3) - 1:, :)
    integer :: j, k, d, last

    last = hi(1) + 1
    !$omp parallel do private(j, d) schedule(static) if (fine%many)
    do k = lo(3), hi(3) + 1
      do j = lo(2), hi(2) + 1
        do d = 1, 3
          if ((k > hi(3) .and. d /= 3) .or. (j > hi(2) .and. d /= 2)) cycle
          call sum_lines(fine, cf, d, [j, k], lo(1), coarse_cf(lo(1):last, j, k, d))
          associate (line => coarse_cf(lo(1):last, j, k, d))
            select case (d)
            case (1); line = line*fine%ratio(lo(1):last, 1)
            case (2); line = line*fine%ratio(j, 2)
            case default; line = line*fine%ratio(k, 3)
            end select
          end associate
        end do
      end do
    end do
  end subroutine coarsen_coefficients

  !> Sums of the coefficients of the finer faces on a line of coarse faces of direction d.
  subroutine sum_lines(fine, cf, d, at, first, line)
    type(level_t), intent(in) :: fine
    real(wp), intent(in), contiguous :: cf(fine%lo(1) - 1:, fine%lo(2) - 1:, fine%lo(3) - 1:, :)
    integer, intent(in) :: d
    integer, intent(in) :: at(2)   !! j and k of the coarse line
    integer, intent(in) :: first
    real(wp), intent(inout), contiguous :: line(first:)   !! to the upper face of the last cell
    integer :: i, j, k, low(3), high(3), last

    last = ubound(line, 1)
    low = first_of([1, at], fine%paired)
    high = last_of([1, at], fine%paired, fine%hi)
    low(d) = min(low(d), fine%hi(d) + 1)
    high(d) = low(d)
    line = 0.0_wp
    do k = low(3), high(3)
      do j = low(2), high(2)
        if (.not. fine%paired(1)) then
          line = line + cf(first:last, j, k, d)
        else if (d == 1) then
          do i = first, last - 1
            line(i) = line(i) + cf(2*i - 1, j, k, d)
          end do
          line(last) = line(last) + cf(fine%hi(1) + 1, j, k, d)
        else
          do i = first, fine%hi(1)/2
            line(i) = line(i) + (cf(2*i - 1, j, k, d) + cf(2*i, j, k, d))
          end do
          if (modulo(fine%hi(1), 2) == 1) line(last - 1) = line(last - 1) + cf(fine%hi(1), j, k, d)
        end if
      end do
    end do
  end subroutine sum_lines

  !> Take a line of the right side, scaled. The unknown is what a first half sweep over colour 0
  !! makes of zero: the right side there and zero in the other colour, which is relaxed next from
  !! colour 0 alone, unless cells of equal colour touch.
  subroutine load_line(self, line, j, k)
    type(level_t), intent(inout) :: self
    real(sp), intent(in), contiguous :: line(:)   !! unscaled, two cells for each pair
    integer, intent(in) :: j, k
    integer :: m, p

    if (self%line(1, j, k) > self%line(2, j, k)) return
    associate (a => self%a(1), b => self%b, s => self%s)
      !$omp simd
      do p = 1, size(line)/2
        b(a + p, 1, j, k) = s(a + p, 1, j, k)*line(2*p - 1)
        b(a + p, 2, j, k) = s(a + p, 2, j, k)*line(2*p)
      end do
    end associate
    m = 1 + modulo(j + k, 2)
    self%x(:, m, j, k) = self%b(:, m, j, k)
    if (self%seam) self%x(:, 3 - m, j, k) = 0.0_sp
  end subroutine load_line

  !> Give a line of the unscaled unknown.
  subroutine unload_line(self, line, j, k)
    type(level_t), intent(in) :: self
    real(sp), intent(inout), contiguous :: line(:)   !! two cells for each pair
    integer, intent(in) :: j, k
    integer :: p

    if (self%line(1, j, k) > self%line(2, j, k)) then
      line = 0.0_sp
      return
    end if
    associate (a => self%a(1), s => self%s, x => self%x)
      !$omp simd
      do p = 1, size(line)/2
        line(2*p - 1) = s(a + p, 1, j, k)*x(a + p, 1, j, k)
        line(2*p) = s(a + p, 2, j, k)*x(a + p, 2, j, k)
      end do
    end associate
  end subroutine unload_line

  !> Gauss-Seidel update of the cells of one colour in plane k.
  subroutine relax_plane(self, colour, k)
    type(level_t), intent(inout) :: self
    integer, intent(in) :: colour, k
    integer :: p, q, m, o, j

    associate (c => self%c, b => self%b, x => self%x)
      do j = self%a(2) + 1, self%z(2) - 1
        m = 1 + modulo(j + k + colour, 2)
        o = 3 - m
        do q = self%line(1, j, k), self%line(2, j, k), vector
          !$omp simd
          do p = q, q + vector - 1
            x(p, m, j, k) = b(p, m, j, k) &
              + c(p, m, j, k, 1)*x(p + m - 2, o, j, k) &
              + c(p + m - 1, o, j, k, 1)*x(p + m - 1, o, j, k) &
              + c(p, m, j, k, 2)*x(p, m, j - 1, k) + c(p, m, j + 1, k, 2)*x(p, m, j + 1, k) &
              + c(p, m, j, k, 3)*x(p, m, j, k - 1) + c(p, m, j, k + 1, 3)*x(p, m, j, k + 1)
          end do
        end do
      end do
    end associate
  end subroutine relax_plane

  !> Add the residual of a line, unscaled, at the cells m of its pairs.
  subroutine add_residual(self, m, j, k, r)
    type(level_t), intent(in) :: self
    integer, intent(in) :: m, j, k
    real(sp), intent(inout) :: r(self%a(1):self%z(1))
    integer :: p, o

    o = 3 - m
    associate (c => self%c, b => self%b, x => self%x, t => self%t)
      !$omp simd
      do p = self%line(1, j, k), self%line(2, j, k)
        r(p) = r(p) + t(p, m, j, k)*((b(p, m, j, k) - x(p, m, j, k)) &
          + c(p, m, j, k, 1)*x(p + m - 2, o, j, k) &
          + c(p + m - 1, o, j, k, 1)*x(p + m - 1, o, j, k) &
          + c(p, m, j, k, 2)*x(p, m, j - 1, k) + c(p, m, j + 1, k, 2)*x(p, m, j + 1, k) &
          + c(p, m, j, k, 3)*x(p, m, j, k - 1) + c(p, m, j, k + 1, 3)*x(p, m, j, k + 1))
      end do
    end associate
  end subroutine add_residual

  !> Right side of the next level in its plane `kc`: sums of the residuals of the finer cells.
  !!
  !! The cells of colour 1 were relaxed last and have no residual, unless cells of equal colour
  !! touch.
  subroutine restrict_plane(self, kc, lo, hi, f)
    type(level_t), intent(in) :: self
    integer, intent(in) :: kc
    integer, intent(in) :: lo(3), hi(3)   !! coarse cells held here
    real(sp), intent(inout) :: f(lo(1):hi(1), lo(2):hi(2), lo(3):hi(3))
    real(sp) :: r(self%a(1):self%z(1), 2)
    integer :: i, jc, j, k, m, colour
    logical :: empty

    do jc = lo(2), hi(2)
      r = 0.0_sp
      empty = .true.
      do k = first_of(kc, self%paired(3)), last_of(kc, self%paired(3), self%hi(3))
        do j = first_of(jc, self%paired(2)), last_of(jc, self%paired(2), self%hi(2))
          if (self%line(1, j, k) > self%line(2, j, k)) cycle
          empty = .false.
          do colour = 0, merge(1, 0, self%seam)
            m = 1 + modulo(j + k + colour, 2)
            call add_residual(self, m, j, k, r(:, m))
          end do
        end do
      end do
      if (empty) then
        f(:, jc, kc) = 0.0_sp
      else if (self%paired(1)) then
        do i = lo(1), hi(1)
          f(i, jc, kc) = r(i, 1) + r(i, 2)
        end do
      else
        do i = lo(1), hi(1)
          f(i, jc, kc) = r((i + 1)/2, 2 - modulo(i, 2))
        end do
      end if
    end do
  end subroutine restrict_plane

  !> Add the correction of the next level to plane k.
  !!
  !! The cells of colour 1 are relaxed next and need none, unless cells of equal colour touch.
  subroutine prolong_plane(self, k, lo, f)
    type(level_t), intent(inout) :: self
    integer, intent(in) :: k
    integer, intent(in) :: lo(3)   !! first coarse cell held here
    real(sp), intent(in), contiguous :: f(lo(1):, lo(2):, lo(3):)
    integer :: p, m, j, jc, kc, colour

    kc = merge((k + 1)/2, k, self%paired(3))
    do j = self%lo(2), self%hi(2)
      if (self%line(1, j, k) > self%line(2, j, k)) cycle
      jc = merge((j + 1)/2, j, self%paired(2))
      do colour = 0, merge(1, 0, self%seam)
        m = 1 + modulo(j + k + colour, 2)
        if (self%paired(1)) then
          !$omp simd
          do p = self%a(1) + 1, (self%hi(1) + 2 - m)/2
            self%x(p, m, j, k) = self%x(p, m, j, k) + self%t(p, m, j, k)*f(p, jc, kc)
          end do
        else
          !$omp simd
          do p = self%a(1) + 1, (self%hi(1) + 2 - m)/2
            self%x(p, m, j, k) = self%x(p, m, j, k) + self%t(p, m, j, k)*f(2*p - 2 + m, jc, kc)
          end do
        end if
      end do
    end do
  end subroutine prolong_plane

  !> Fill the halo of an array of the level: from the neighbours, or from its own other side.
  subroutine fill_halo(self, x)
    type(level_t), intent(inout) :: self
    real(sp), intent(inout) :: x(self%a(1):self%z(1), 2, self%a(2):self%z(2), self%a(3):self%z(3))

    if (self%talks(1)) call fill_ends(self, x)
    if (self%in_parts) then
      call exchange(x, [2*(self%z(1) - self%a(1) + 1), self%z(2:3) - self%a(2:3) + 1])
    else
      if (self%wraps(2)) then
        x(:, :, self%lo(2) - 1, :) = x(:, :, self%hi(2), :)
        x(:, :, self%hi(2) + 1, :) = x(:, :, self%lo(2), :)
      end if
      if (self%wraps(3)) then
        x(:, :, :, self%lo(3) - 1) = x(:, :, :, self%hi(3))
        x(:, :, :, self%hi(3) + 1) = x(:, :, :, self%lo(3))
      end if
    end if
  contains
    !> Halos in y and z; a line is one row of this view of the array.
    subroutine exchange(view, extent)
      integer, intent(in) :: extent(3)
      real(sp), intent(inout) :: view(extent(1), extent(2), extent(3))
      integer :: d

      do d = 2, 3
        if (self%talks(d)) call halo_exchange(view, 1, d)
      end do
    end subroutine exchange
  end subroutine fill_halo

  !> Fill the cells before and after the lines. With an odd number of cells the cell after the last
  !! stands in the last pair.
  subroutine fill_ends(self, x)
    type(level_t), intent(inout) :: self
    real(sp), intent(inout) :: x(self%a(1):self%z(1), 2, self%a(2):self%z(2), self%a(3):self%z(3))
    integer :: first, last

    first = self%a(1) + 1
    last = (self%hi(1) + 1)/2
    if (self%in_parts) then
      self%edge(2, :, :) = x(first, 1, :, :)
      self%edge(3, :, :) = x(last, 2, :, :)
      call halo_exchange(self%edge, 1, 1)
      x(first - 1, 2, :, :) = self%edge(1, :, :)
      x(last + 1, 1, :, :) = self%edge(4, :, :)
    else if (modulo(self%n(1), 2) == 0) then
      x(first - 1, 2, :, :) = x(last, 2, :, :)
      x(last + 1, 1, :, :) = x(first, 1, :, :)
    else
      x(first - 1, 2, :, :) = x(last, 1, :, :)
      x(last, 2, :, :) = x(first, 1, :, :)
    end if
  end subroutine fill_ends

end module multigrid_level_m
