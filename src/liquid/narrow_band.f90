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
  public :: narrow_band_t, narrow_band_init, reserve, reserve_for_all, find_parts, sum_by_part, &
            drop_part, find_open_lines

  !> Work of finding and sorting the parts.
  type :: part_finder_t
    integer, allocatable :: root(:)          !! of a cell: the first of its part on this process;
                                             !! then the cells by part
    integer, allocatable :: part(:)          !! of a cell: smallest number in its part, then the
                                             !! number of the part; then work
    integer(i8), allocatable :: home(:)      !! (parts) labels, rising
    integer(i8), allocatable :: held(:)      !! (0:processes-1) labels that each process gave
    integer(i8), allocatable :: accumulator(:, :)   !! of the sums
  end type part_finder_t

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
    real(wp), allocatable :: largest(:)      !! (parts) largest |r|, for the user of the band [V]
    real(wp), allocatable :: total(:)        !! (2 parts) sums of r, then of the open volume [V]
    type(part_finder_t) :: finder
  contains
    procedure :: apply => apply_band
  end type narrow_band_t

contains

  !> Allocate; lists grow by doubling.
  subroutine narrow_band_init(grid, self)
    type(grid_t), intent(in) :: grid
    type(narrow_band_t), intent(out) :: self
    integer, parameter :: first_parts = 64
    integer :: a(3), b(3)

    a = grid%lo - 1
    b = grid%hi + 1
    allocate (self%marked(a(1):b(1), a(2):b(2), a(3):b(3)), source=0)
    allocate (self%number, self%label, source=self%marked)
    allocate (self%k(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
    allocate (self%line(2, size(self%marked, 2), size(self%marked, 3)), source=0)
    allocate (self%finder%held(0:nproc() - 1), source=0_i8)
    call ensure_capacity(1, self%cell)
    call reserve(self)
    call allocate_parts(first_parts, self)
  end subroutine narrow_band_init

  subroutine allocate_parts(n, self)
    integer, intent(in) :: n
    type(narrow_band_t), intent(inout) :: self

    allocate (self%first(n + 1), self%vents(n), self%largest(n), self%total(2*n))
    allocate (self%finder%home(n), self%finder%accumulator(accumulator_size, 2*n))
  end subroutine allocate_parts

  !> Room in the lists for all cells.
  subroutine reserve(self)
    type(narrow_band_t), intent(inout) :: self
    integer :: n

    n = size(self%cell, 2)
    call ensure_capacity(n, self%r)
    call ensure_capacity(n, self%open)
    associate (f => self%finder)
      call ensure_capacity(n, f%root)
      call ensure_capacity(n, f%part)
    end associate
  end subroutine reserve

  !> Room in the lists for all own cells and no more; what they held is lost.
  subroutine reserve_for_all(grid, self)
    type(grid_t), intent(in) :: grid
    type(narrow_band_t), intent(inout) :: self
    integer :: n

    n = product(grid%hi - grid%lo + 1)
    if (size(self%cell, 2) >= n) return
    deallocate (self%cell, self%r, self%open, self%finder%root, self%finder%part)
    allocate (self%cell(3, n), self%r(n), self%open(n), self%finder%root(n), self%finder%part(n))
  end subroutine reserve_for_all

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
    integer :: l, c(3), d, e(3), m, a, b

    ! Join cells of this process across faces with a conductance: `root` of each cell of the list.
    do l = 1, self%n
      self%finder%root(l) = l
    end do
    do l = 1, self%n
      c = self%cell(:, l)
      do d = 1, 3
        if (.not. self%k(c(1), c(2), c(3), d) > 0.0_wp) cycle
        e = c - unit_step(:, d)
        m = self%number(e(1), e(2), e(3))
        if (m == 0) cycle
        call find_root(self%finder%root, l, a)
        call find_root(self%finder%root, m, b)
        self%finder%root(max(a, b)) = min(a, b)
      end do
    end do
    do l = 1, self%n
      call find_root(self%finder%root, l, self%finder%part(l))
    end do
    self%finder%root(1:self%n) = self%finder%part(1:self%n)
    call join_processes(grid, self)
    call list_parts(grid, self)
    do l = 1, self%n
      c = self%cell(:, l)
      self%finder%part(l) = position(int(self%label(c(1), c(2), c(3)), i8), &
                                     self%finder%home(1:self%parts))
    end do
    call sort_by_part(self)
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
  subroutine join_processes(grid, self)
    type(grid_t), intent(in) :: grid
    type(narrow_band_t), intent(inout) :: self
    integer :: l, c(3), d, s, f(3), nb(3)
    integer(i8) :: changes(1)

    associate (smallest => self%finder%part)
      do l = 1, self%n   ! a root stands first in the list and has the smallest number of its part
        smallest(l) = global_number(grid, self%cell(:, l))
      end do
      self%label = 0
      do
        do l = 1, self%n
          c = self%cell(:, l)
          self%label(c(1), c(2), c(3)) = smallest(self%finder%root(l))
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
              if (self%label(nb(1), nb(2), nb(3)) >= smallest(self%finder%root(l))) cycle
              smallest(self%finder%root(l)) = self%label(nb(1), nb(2), nb(3))
              changes = changes + 1_i8
            end do
          end do
        end do
        call global_sum(changes)
        if (changes(1) == 0_i8) exit
      end do
    end associate
  end subroutine join_processes

  !> The labels of all parts on all processes, rising.
  subroutine list_parts(grid, self)
    type(grid_t), intent(in) :: grid
    type(narrow_band_t), intent(inout) :: self
    integer :: l, c(3), rank, n

    rank = my_rank()
    self%finder%held = 0_i8
    do l = 1, self%n
      if (is_home(l)) self%finder%held(rank) = self%finder%held(rank) + 1_i8
    end do
    call global_sum(self%finder%held)
    self%parts = int(sum(self%finder%held))
    if (self%parts > size(self%finder%home)) then
      deallocate (self%first, self%vents, self%largest, self%total)
      deallocate (self%finder%home, self%finder%accumulator)
      call allocate_parts(2*self%parts, self)
    end if
    self%finder%home(1:self%parts) = 0_i8
    n = int(sum(self%finder%held(0:rank - 1)))
    do l = 1, self%n
      if (.not. is_home(l)) cycle
      n = n + 1
      c = self%cell(:, l)
      self%finder%home(n) = int(global_number(grid, c), i8)
    end do
    call global_sum(self%finder%home(1:self%parts))
    call sort(self%finder%home(1:self%parts))
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
  subroutine sort_by_part(self)
    type(narrow_band_t), intent(inout) :: self
    integer :: l, c, d

    associate (part => self%finder%part, order => self%finder%root, n => self%n)
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
          self%cell(d, 1:n) = moved(1:n)
        end do
      end associate
    end associate
  end subroutine sort_by_part

  !> Cells at an open side, sum of r and sum of the open volume of each part, over all processes.
  subroutine sum_by_part(grid, self)
    type(grid_t), intent(in) :: grid
    type(narrow_band_t), intent(inout) :: self
    integer :: c, l, n, d, s, f(3)
    logical :: at_side

    n = self%parts
    self%vents(1:n) = 0_i8
    associate (accumulator => self%finder%accumulator)
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
          accumulator(:, c) = no_terms
          accumulator(:, n + c) = no_terms
          call exact_add(self%r(a:b), accumulator(:, c))
          call exact_add(self%open(a:b), accumulator(:, n + c))
        end associate
      end do
      call global_sum(self%vents(1:n))
      call exact_totals(accumulator(:, 1:2*n), self%total(1:2*n))
    end associate
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
