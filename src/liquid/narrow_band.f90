!> The narrow band of cells around the bodies as a graph: lists of its cells, sorted by connected
!! part.
!!
!! Cells are joined by the conductance k of the face between them; as a linear operator the band is
!! `y_c = sum_f k_f (x_c - x_nb)`. A part that a wall or another
!! body separates from the rest has a volume balance of its own. Parts reach across processes; they
!! are numbered by the smallest cell number in them, so the numbering does not depend on the
!! processes.
module narrow_band_m
  use kinds_m, only: wp, i8
  use growing_m, only: ensure_capacity
  use grid_m, only: grid_t, unit_step
  use boundary_kinds_m, only: no_side
  use exact_sum_m, only: exact_add, exact_totals, accumulator_size, no_terms
  use linear_operator_m, only: linear_operator_t, seven_points
  use parallel_m, only: halo_exchange, global_sum, nproc, my_rank
  implicit none
  private
  public :: narrow_band_t, narrow_band_init, find_parts, sum_by_part, drop_part, find_open_lines

  type, extends(linear_operator_t) :: narrow_band_t
    ! Arrays over cells with one halo cell.
    integer, allocatable :: marked(:, :, :)  !! 1: in the band, else 0
    integer, allocatable :: line(:, :, :)    !! (2, j, k) first and last cell of a line that has
                                             !! an open face, counted from 1 with the halo
    integer, allocatable :: number(:, :, :)  !! place in the list as found, 0: not in it
    integer, allocatable :: label(:, :, :)   !! smallest global cell number of the connected part
    real(wp), allocatable :: k(:, :, :, :)   !! conductance of the lower faces, largest face = 1 [-]

    !> Poses of the bodies before and after the step (`solid%poses`) for which it was found.
    integer :: poses(2) = 0

    !> The cells, sorted by part: those of part c are `first(c):first(c+1)-1`.
    integer :: n = 0
    integer, allocatable :: cell(:, :)       !! (3, n)
    real(wp), allocatable :: r(:)            !! volume balance of the cell [V]
    real(wp), allocatable :: open(:)         !! its open volume at the end of the step [V]

    !> The connected parts, of all processes.
    integer :: parts = 0
    integer, allocatable :: first(:)         !! (parts + 1)
    integer(i8), allocatable :: vents(:)     !! (parts) cells at an open side
    real(wp), allocatable :: total(:)        !! (2 parts) sums of r, then of the open volume [V]
  contains
    procedure :: apply => apply_band
  end type narrow_band_t

contains

  !> Allocate; lists grow by doubling.
  subroutine narrow_band_init(grid, self)
    type(grid_t), intent(in) :: grid
    type(narrow_band_t), intent(out) :: self
    integer :: a(3), b(3)

    a = grid%lo - 1
    b = grid%hi + 1
    allocate (self%marked(a(1):b(1), a(2):b(2), a(3):b(3)), source=0)
    allocate (self%number, self%label, source=self%marked)
    allocate (self%k(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
    allocate (self%line(2, size(self%marked, 2), size(self%marked, 3)), source=0)
    allocate (self%cell(3, 0), self%r(0), self%open(0))
  end subroutine narrow_band_init

  !> Number of a cell in the whole domain, from 1.
  pure function global_number(grid, c) result(g)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: c(3)
    integer :: g

    g = c(1) + grid%n(1)*(c(2) - 1 + grid%n(2)*(c(3) - 1))
  end function global_number

  !> y = A x of the conductances; zero outside the sides of the domain.
  subroutine apply_band(self, x, y)
    class(narrow_band_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: x(:, :, :)
    real(wp), intent(inout), contiguous :: y(:, :, :)

    call halo_exchange(x, 1)
    call seven_points(self%k, x, y, self%line)
  end subroutine apply_band

  !> The range of each line in which cells conduct, for the operator and its solver.
  subroutine find_open_lines(cf, line)
    real(wp), intent(in), contiguous :: cf(:, :, :, :)   !! of the lower faces, one halo cell
    integer, intent(inout), contiguous :: line(:, :, :)
    integer :: i, j, k, n

    n = size(cf, 1) - 1
    !$omp parallel do private(i, j) schedule(static)
    do k = 2, size(cf, 3) - 1
      do j = 2, size(cf, 2) - 1
        do i = 2, n
          if (is_open(i, j, k)) exit
        end do
        line(1, j, k) = i
        do i = n, line(1, j, k), -1
          if (is_open(i, j, k)) exit
        end do
        line(2, j, k) = i
      end do
    end do
  contains
    pure logical function is_open(i, j, k)
      integer, intent(in) :: i, j, k

      is_open = cf(i, j, k, 1) + cf(i + 1, j, k, 1) + cf(i, j, k, 2) + cf(i, j + 1, k, 2) &
                + cf(i, j, k, 3) + cf(i, j, k + 1, 3) > 0.0_wp
    end function is_open
  end subroutine find_open_lines

  !> Find the connected parts, on all processes, and sort the list by them.
  subroutine find_parts(grid, self)
    type(grid_t), intent(in) :: grid
    type(narrow_band_t), intent(inout) :: self
    integer :: part(self%n)   ! of a cell: the first of its part here, then the number of its part
    integer(i8), allocatable :: home(:)   ! (parts) labels, rising
    integer :: l, c(3), d, e(3), m, a, b

    ! Join cells of this process across faces with a conductance.
    do l = 1, self%n
      part(l) = l
    end do
    do l = 1, self%n
      c = self%cell(:, l)
      do d = 1, 3
        if (.not. self%k(c(1), c(2), c(3), d) > 0.0_wp) cycle
        e = c - unit_step(:, d)
        m = self%number(e(1), e(2), e(3))
        if (m == 0) cycle
        call find_root(part, l, a)
        call find_root(part, m, b)
        part(max(a, b)) = min(a, b)
      end do
    end do
    do l = 1, self%n
      call find_root(part, l, a)
      part(l) = a
    end do
    call join_processes(grid, part, self)
    call list_parts(grid, self, home)
    do l = 1, self%n
      c = self%cell(:, l)
      part(l) = position(int(self%label(c(1), c(2), c(3)), i8), home)
    end do
    call sort_by_part(part, self)
  end subroutine find_parts

  !> Root of a cell; the path to it is shortened for the next call.
  pure subroutine find_root(root, l, found)
    integer, intent(inout) :: root(:)
    integer, intent(in) :: l
    integer, intent(out) :: found

    found = l
    do while (root(found) /= found)
      root(found) = root(root(found))
      found = root(found)
    end do
  end subroutine find_root

  !> Give all cells of a connected part, on whatever process, the smallest global number in it.
  subroutine join_processes(grid, root, self)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: root(:)   !! of a cell: the first of its part on this process
    type(narrow_band_t), intent(inout) :: self
    integer :: smallest(self%n)   ! number in the part of a root, so far
    integer :: l, c(3), d, s, f(3), nb(3)
    integer(i8) :: changes(1)

    do l = 1, self%n   ! a root stands first in the list and has the smallest number of its part
      smallest(l) = global_number(grid, self%cell(:, l))
    end do
    self%label = 0
    do
      do l = 1, self%n
        c = self%cell(:, l)
        self%label(c(1), c(2), c(3)) = smallest(root(l))
      end do
      call halo_exchange(self%label, 1)
      changes = 0_i8
      do l = 1, self%n
        c = self%cell(:, l)
        if (all(c > grid%lo .and. c < grid%hi)) cycle
        ! Take over a smaller label from a neighbour behind an open face.
        do d = 1, 3
          do s = 0, 1
            f = c + s*unit_step(:, d)
            nb = c + (2*s - 1)*unit_step(:, d)
            if (.not. self%k(f(1), f(2), f(3), d) > 0.0_wp) cycle
            if (self%label(nb(1), nb(2), nb(3)) == 0) cycle
            if (self%label(nb(1), nb(2), nb(3)) >= smallest(root(l))) cycle
            smallest(root(l)) = self%label(nb(1), nb(2), nb(3))
            changes = changes + 1_i8
          end do
        end do
      end do
      call global_sum(changes)
      if (changes(1) == 0_i8) exit
    end do
  end subroutine join_processes

  !> The labels of all parts on all processes, rising.
  subroutine list_parts(grid, self, home)
    type(grid_t), intent(in) :: grid
    type(narrow_band_t), intent(inout) :: self
    integer(i8), allocatable, intent(out) :: home(:)
    integer(i8), allocatable :: held(:)   ! (0:processes-1) labels that each process gave
    integer :: l, c(3), rank, n

    rank = my_rank()
    allocate (held(0:nproc() - 1), source=0_i8)
    do l = 1, self%n
      if (is_home(l)) held(rank) = held(rank) + 1_i8
    end do
    call global_sum(held)
    self%parts = int(sum(held))
    allocate (home(self%parts), source=0_i8)
    n = int(sum(held(0:rank - 1)))
    do l = 1, self%n
      if (.not. is_home(l)) cycle
      n = n + 1
      c = self%cell(:, l)
      home(n) = int(global_number(grid, c), i8)
    end do
    call global_sum(home)
    call sort(home)
  contains
    !> Is this the cell that gave its part the label?
    logical function is_home(l)
      integer, intent(in) :: l
      integer :: c(3)

      c = self%cell(:, l)
      is_home = self%label(c(1), c(2), c(3)) == global_number(grid, c)
    end function is_home
  end subroutine list_parts

  !> Rising order, in place; the lists of parts are short.
  pure subroutine sort(a)
    integer(i8), intent(inout) :: a(:)
    integer(i8) :: key
    integer :: i, j

    do i = 2, size(a)
      key = a(i)
      j = i - 1
      do while (j >= 1)
        if (a(j) <= key) exit
        a(j + 1) = a(j)
        j = j - 1
      end do
      a(j + 1) = key
    end do
  end subroutine sort

  !> Place of a label in the rising list that holds it.
  pure function position(label, list) result(p)
    integer(i8), intent(in) :: label, list(:)
    integer :: p
    integer :: high, middle

    p = 1
    high = size(list)
    do while (p < high)
      middle = (p + high)/2
      if (list(middle) < label) then
        p = middle + 1
      else
        high = middle
      end if
    end do
  end function position

  !> Stable sort of the cells by part; `first` marks where each begins.
  subroutine sort_by_part(part, self)
    integer, intent(inout) :: part(:)   !! of a cell; lost
    type(narrow_band_t), intent(inout) :: self
    integer :: order(self%n), l, c, d

    call ensure_capacity(self%parts + 1, self%first)
    associate (n => self%n)
      self%first(1:self%parts + 1) = 0
      do l = 1, n
        self%first(part(l) + 1) = self%first(part(l) + 1) + 1
      end do
      self%first(1) = 1
      do c = 1, self%parts
        self%first(c + 1) = self%first(c + 1) + self%first(c)
      end do
      do l = n, 1, -1   ! from the back, so that a part keeps its order
        c = part(l)
        self%first(c + 1) = self%first(c + 1) - 1
        order(self%first(c + 1)) = l
      end do
      do c = 1, self%parts       ! the ends have moved down to the begins
        self%first(c) = self%first(c + 1)
      end do
      self%first(self%parts + 1) = n + 1
      associate (moved => part)   ! no longer needed
        do d = 1, 3
          do l = 1, n
            moved(l) = self%cell(d, order(l))
          end do
          self%cell(d, 1:n) = moved
        end do
      end associate
    end associate
  end subroutine sort_by_part

  !> Cells at an open side, sum of r and sum of the open volume of each part, over all processes.
  subroutine sum_by_part(grid, self)
    type(grid_t), intent(in) :: grid
    type(narrow_band_t), intent(inout) :: self
    integer(i8) :: accumulator(accumulator_size, 2*self%parts)
    integer :: c, l, n, d, s, f(3)
    logical :: at_side

    n = self%parts
    self%vents = spread(0_i8, 1, n)
    self%total = spread(0.0_wp, 1, 2*n)
    accumulator = spread(no_terms, 2, 2*n)
    do c = 1, n
      associate (a => self%first(c), b => self%first(c + 1) - 1)
        do l = a, b
          at_side = .false.   ! can it exchange through an open side of the domain?
          do d = 1, 3
            do s = 0, 1
              f = self%cell(:, l) + s*unit_step(:, d)
              if (grid%side_of_face(f(d), d) == no_side) cycle
              at_side = at_side .or. self%k(f(1), f(2), f(3), d) > 0.0_wp
            end do
          end do
          if (at_side) self%vents(c) = self%vents(c) + 1_i8
        end do
        call exact_add(self%r(a:b), accumulator(:, c))
        call exact_add(self%open(a:b), accumulator(:, n + c))
      end associate
    end do
    call global_sum(self%vents)
    call exact_totals(accumulator, self%total)
  end subroutine sum_by_part

  !> Take a part out of the system: its faces conduct nothing.
  subroutine drop_part(c, self)
    integer, intent(in) :: c
    type(narrow_band_t), intent(inout) :: self
    integer :: l, d, at(3), f(3)

    do l = self%first(c), self%first(c + 1) - 1
      self%r(l) = 0.0_wp
      at = self%cell(:, l)
      do d = 1, 3
        f = at + unit_step(:, d)
        self%k(at(1), at(2), at(3), d) = 0.0_wp
        self%k(f(1), f(2), f(3), d) = 0.0_wp
      end do
    end do
  end subroutine drop_part

end module narrow_band_m
