!> Geometric multigrid as a preconditioner: one symmetric V-cycle in single precision, two sweeps
!! before and after the coarse correction on the finest level, four on the others.
!!
!! Cells are joined by two in every direction whose spacing is within `alike` of the smallest, down
!! to one cell; an odd number of cells leaves a last cell of half the size, with its true centre
!! distance. Coefficients of a coarse face are sums over its finer faces times the ratio of centre
!! distances, transfers are piecewise constant: sums down, copies up. Red-black Gauss-Seidel with
!! the colours in reversed order after the coarse correction, so the cycle is a symmetric matrix.
!!
!! Finer levels stay on the processes as long as their blocks begin at odd cells and hold more than
!! two; the first level where this ends is put together on every process and solved there, with the
!! same bits as on one process. Levels with many cells are shared by all threads.
module multigrid_m
  use omp_lib, only: omp_get_thread_num, omp_get_num_threads
  use kinds_m, only: wp, sp
  use grid_m, only: grid_t
  use linear_operator_m, only: preconditioner_t
  use multigrid_level_m, only: level_t, level_init, set_equations, coarsen_coefficients, &
    load_line, unload_line, relax_plane, restrict_plane, prolong_plane, fill_halo
  use parallel_m, only: nproc, global_max, gather_all
  implicit none
  private
  public :: multigrid_t

  real(wp), parameter :: alike = 1.9_wp        !! ratio of spacings that are coarsened together
  integer, parameter :: worth_threads = 4000   !! cells of a level from which threads share it
  !> Colours of two sweeps from zero (loading the right side is the first half sweep, of colour 0),
  !! of two more sweeps, and of two sweeps after the coarse correction.
  integer, parameter :: start(3) = [1, 0, 1], down(4) = [0, 1, 0, 1], up(4) = [1, 0, 1, 0]

  !> The planes of a level that a thread works on.
  type :: team_t
    integer :: me = 0   !! this thread, from 0
    integer :: n = 1    !! threads at work
  end type team_t

  type, extends(preconditioner_t) :: multigrid_t
    type(level_t), allocatable :: level(:)      !! from fine to coarse
    integer :: gathered = 0                     !! first level that every process holds as a whole
    integer :: lo(3) = 1, hi(3) = 0             !! cells of this process on the finest level
    integer :: part_lo(3) = 1, part_hi(3) = 0   !! cells of this process on level `gathered`
    real(sp), allocatable :: part(:, :, :)      !! their right side; only with many processes
    real(wp), allocatable :: part_cf(:, :, :, :) !! their coefficients
    integer :: unit_exponent = 0                !! coefficients are scaled by 2**(-unit_exponent)
  contains
    procedure :: init => init_levels
    procedure :: setup => setup_levels
    procedure :: apply => apply_cycle
  end type multigrid_t

contains

  !> Plan and allocate all levels.
  subroutine init_levels(self, grid)
    class(multigrid_t), intent(out) :: self
    type(grid_t), intent(in) :: grid
    real(wp) :: h(3), width(maxval(grid%n), 3)
    integer :: l, n(3)

    n = grid%n
    h = grid%h
    l = 1
    do while (any(n > 1))
      call join(n, h)
      l = l + 1
    end do
    allocate (self%level(l))
    self%lo = grid%lo
    self%hi = grid%hi
    self%part_lo = grid%lo
    self%part_hi = grid%hi
    n = grid%n
    h = grid%h
    width = spread(h, 1, size(width, 1))
    do l = 1, size(self%level)
      call plan_level(grid, n, h, width, l, self)
      call level_init(self%level(l))
      call join(n, h)
    end do
  end subroutine init_levels

  !> Directions in which the cells of a level are joined by two.
  pure function joined(n, h)
    integer, intent(in) :: n(3)     !! cells
    real(wp), intent(in) :: h(3)    !! spacing [m]
    logical :: joined(3)

    joined = n > 1
    joined = joined .and. h/alike < minval(h, mask=joined)
  end function joined

  !> Cells and spacing of the next level.
  pure subroutine join(n, h)
    integer, intent(inout) :: n(3)
    real(wp), intent(inout) :: h(3)
    logical :: paired(3)

    paired = joined(n, h)
    where (paired)
      n = (n + 1)/2
      h = 2*h
    end where
  end subroutine join

  !> Sizes, neighbours and arrays of level l; widths and the own part become those of the next.
  subroutine plan_level(grid, n, h, width, l, self)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: n(3), l
    real(wp), intent(in) :: h(3)
    real(wp), intent(inout) :: width(:, :)   !! (cell, d) [m]
    class(multigrid_t), intent(inout) :: self
    integer :: d

    associate (level => self%level(l))
      level%n = n
      level%paired = joined(n, h)
      level%wraps = grid%periodic .and. n > 1
      level%alone = grid%periodic .and. n == 1
      level%seam = any(level%wraps .and. modulo(n, 2) == 1)
      if (self%gathered == 0) then
        if (nproc() > 1) level%in_parts = can_be_in_parts(level, self%part_lo, self%part_hi)
        if (.not. level%in_parts) self%gathered = l
      end if
      level%lo = merge(self%part_lo, 1, level%in_parts)
      level%hi = merge(self%part_hi, n, level%in_parts)
      level%talks = level%wraps &
        .or. (level%in_parts .and. .not. (grid%at_side(1, :) .and. grid%at_side(2, :)))
      level%many = product(real(level%hi - level%lo + 1, wp)) >= worth_threads
      allocate (level%ratio(maxval(n) + 1, 3), source=1.0_wp)
      do d = 1, 3
        if (level%paired(d)) call join_widths(n(d), level%wraps(d), width(:, d), level%ratio(:, d))
      end do
      if (l > 1 .or. gathers(self, l)) call allocate_system(level%lo, level%hi, level%f, level%cf)
      if (gathers(self, l)) then
        call allocate_system(self%part_lo, self%part_hi, self%part, self%part_cf)
      else
        self%part_lo = merge((self%part_lo + 1)/2, self%part_lo, level%paired .and. level%in_parts)
        self%part_hi = merge((self%part_hi + 1)/2, self%part_hi, level%paired .and. level%in_parts)
      end if
    end associate
  end subroutine plan_level

  !> Arrays for a right side and coefficients of some cells.
  subroutine allocate_system(lo, hi, f, cf)
    integer, intent(in) :: lo(3), hi(3)
    real(sp), allocatable, intent(out) :: f(:, :, :)
    real(wp), allocatable, intent(out) :: cf(:, :, :, :)
    integer :: a(3), b(3)

    a = lo - 1
    b = hi + 1
    allocate (f(lo(1):hi(1), lo(2):hi(2), lo(3):hi(3)), source=0.0_sp)
    allocate (cf(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
  end subroutine allocate_system

  !> May the level stay on the processes? All give the same answer.
  function can_be_in_parts(level, lo, hi) result(can)
    type(level_t), intent(in) :: level
    integer, intent(in) :: lo(3), hi(3)   !! block of this process
    logical :: can
    real(wp) :: no(1)

    can = modulo(lo(1), 2) == 1 .and. all(modulo(lo, 2) == 1 .or. .not. level%paired) &
      .and. all(hi - lo > 1 .or. .not. level%paired)
    can = can .and. .not. (level%wraps(1) .and. modulo(level%n(1), 2) == 1)
    no = merge(0.0_wp, 1.0_wp, can)
    call global_max(no)
    can = no(1) <= 0.0_wp
  end function can_be_in_parts

  !> Is level l put together from the blocks of many processes?
  logical function gathers(self, l)
    class(multigrid_t), intent(in) :: self
    integer, intent(in) :: l

    gathers = l == self%gathered .and. nproc() > 1
  end function gathers

  !> Widths of the cells of the next level, and how the distances of the centres change.
  pure subroutine join_widths(n, wraps, width, ratio)
    integer, intent(in) :: n                   !! cells of this level
    logical, intent(in) :: wraps
    real(wp), intent(inout) :: width(:)        !! of the cells of this, then of the next level [m]
    real(wp), intent(inout) :: ratio(:)        !! (coarse face) distance here to that on the next
    integer :: i, n_next

    n_next = (n + 1)/2
    do i = 1, n_next + 1
      ratio(i) = distance(min(2*i - 1, n + 1), n)
    end do
    do i = 1, n_next
      width(i) = sum(width(2*i - 1:min(2*i, n)))
    end do
    do i = 1, n_next + 1
      ratio(i) = ratio(i)/distance(i, n_next)
    end do
  contains
    !> Distance of the centres beside lower face i of m cells; half a cell at sides of the domain.
    pure real(wp) function distance(i, m)
      integer, intent(in) :: i, m

      distance = 0.0_wp
      if (i > 1) distance = distance + 0.5_wp*width(i - 1)
      if (i <= m) distance = distance + 0.5_wp*width(i)
      if (wraps .and. (i == 1 .or. i > m)) distance = 0.5_wp*(width(1) + width(m))
    end function distance
  end subroutine join_widths

  !> Coefficients of all levels from those of the lower faces of the finest.
  subroutine setup_levels(self, cf)
    class(multigrid_t), intent(inout) :: self
    real(wp), intent(in), contiguous :: cf(self%lo(1) - 1:, self%lo(2) - 1:, self%lo(3) - 1:, :)
    real(wp) :: largest(1)
    integer :: l, i, j, k, d, e(3)

    ! Largest coefficient of the own faces.
    largest = 0.0_wp
    !$omp parallel do private(i, j, d, e) reduction(max: largest) schedule(static) &
    !$omp if (size(cf) > 3*worth_threads)
    do k = self%lo(3), self%hi(3) + 1
      do d = 1, 3
        e = 0
        e(d) = 1
        if (k > self%hi(3) + e(3)) cycle
        do j = self%lo(2), self%hi(2) + e(2)
          !$omp simd reduction(max: largest)
          do i = self%lo(1), self%hi(1) + e(1)
            largest = max(largest, cf(i, j, k, d))
          end do
        end do
      end do
    end do
    call global_max(largest)
    self%unit_exponent = exponent(largest(1))
    if (gathers(self, 1)) then
      call gather_coefficients(self%part_lo, self%part_hi, cf, self%level(1))
      call set_level(1, self%level(1)%cf)
    else
      call set_level(1, cf)
    end if
    do l = 2, size(self%level)
      call set_level(l, self%level(l)%cf)
    end do
  contains
    !> Set level l, and the coefficients of the next.
    subroutine set_level(l, cf)
      integer, intent(in) :: l
      real(wp), intent(in), contiguous :: cf(:, :, :, :)

      call set_equations(self%level(l), cf, scale(1.0_wp, -self%unit_exponent))
      if (l == size(self%level)) return
      if (gathers(self, l + 1)) then
        call coarsen_coefficients(self%level(l), cf, self%part_lo, self%part_hi, self%part_cf)
        call gather_coefficients(self%part_lo, self%part_hi, self%part_cf, self%level(l + 1))
      else
        call coarsen_coefficients(self%level(l), cf, self%level(l + 1)%lo, self%level(l + 1)%hi, &
          self%level(l + 1)%cf)
      end if
    end subroutine set_level
  end subroutine setup_levels

  !> Put the coefficients of the blocks of all processes together.
  subroutine gather_coefficients(lo, hi, part, level)
    integer, intent(in) :: lo(3), hi(3)   !! block of this process
    real(wp), intent(in), contiguous :: part(lo(1) - 1:, lo(2) - 1:, lo(3) - 1:, :)
    type(level_t), intent(inout) :: level
    integer :: d, b(3), n(3)

    do d = 1, 3
      b = hi
      n = level%n
      n(d) = n(d) + 1
      if (hi(d) == level%n(d)) b(d) = n(d)   ! the upper side of the domain too
      call gather_all(part(lo(1):b(1), lo(2):b(2), lo(3):b(3), d), lo, b, &
        level%cf(1:n(1), 1:n(2), 1:n(3), d))
    end do
  end subroutine gather_coefficients

  !> z = M r: one V-cycle from zero.
  subroutine apply_cycle(self, r, r_max, z)
    class(multigrid_t), intent(inout) :: self
    real(wp), intent(in), contiguous :: r(:, :, :)
    real(wp), intent(in) :: r_max
    real(wp), intent(inout), contiguous :: z(:, :, :)
    type(team_t) :: team

    !$omp parallel private(team) if (self%level(1)%many)
    team%me = omp_get_thread_num()
    team%n = omp_get_num_threads()
    ! no infinite power of two in a run that is lost: its fault is found after the step
    call run_cycle(self, team, r, exponent(min(r_max, huge(r_max))), z)
    !$omp end parallel
  end subroutine apply_cycle

  !> The V-cycle of one thread. Levels with few cells are the business of the first thread alone.
  subroutine run_cycle(self, team, r, r_exponent, z)
    class(multigrid_t), intent(inout) :: self
    type(team_t), intent(in) :: team
    real(wp), intent(in), contiguous :: r(self%lo(1) - 1:, self%lo(2) - 1:, self%lo(3) - 1:)
    integer, intent(in) :: r_exponent   !! of the largest r of all processes
    real(wp), intent(inout), contiguous :: z(self%lo(1) - 1:, self%lo(2) - 1:, self%lo(3) - 1:)
    type(team_t) :: crew
    integer :: l, coarsest

    coarsest = size(self%level)
    do l = 1, coarsest
      if (.not. has_work(self%level(l), team, crew)) cycle
      call load(self, crew, l, scale(1.0_wp, -r_exponent), r)
      if (l == coarsest) exit
      call smooth(self%level(l), crew, start)
      if (l > 1) call smooth(self%level(l), crew, down)
      call restrict(self, crew, l)
    end do
    do l = coarsest, 1, -1
      if (.not. has_work(self%level(l), team, crew)) cycle
      if (l < coarsest) then
        call prolong(self, crew, l)
        if (l > 1) call smooth(self%level(l), crew, up)
        call smooth(self%level(l), crew, up)
      end if
      call unload(self, crew, l, scale(1.0_wp, r_exponent - self%unit_exponent), z)
    end do
  end subroutine run_cycle

  !> Is there work on a level for this thread, and for which crew?
  logical function has_work(level, team, crew)
    type(level_t), intent(in) :: level
    type(team_t), intent(in) :: team
    type(team_t), intent(out) :: crew

    has_work = level%many .or. team%me == 0
    if (level%many) crew = team
  end function has_work

  !> Wait for the rest of the crew.
  subroutine wait(crew)
    type(team_t), intent(in) :: crew

    if (crew%n == 1) return
    !$omp barrier
  end subroutine wait

  !> The planes of this thread: its share of the planes first to last.
  pure subroutine my_planes(crew, first, last, mine_first, mine_last)
    type(team_t), intent(in) :: crew
    integer, intent(in) :: first, last
    integer, intent(out) :: mine_first, mine_last
    integer :: n

    n = last - first + 1
    mine_first = first + (n*crew%me)/crew%n
    mine_last = first + (n*(crew%me + 1))/crew%n - 1
  end subroutine my_planes

  !> Right side and first unknown of level l, from the residual r or from the level above.
  subroutine load(self, crew, l, factor, r)
    class(multigrid_t), intent(inout) :: self
    type(team_t), intent(in) :: crew
    integer, intent(in) :: l
    real(wp), intent(in) :: factor   !! brings the largest r to about one
    real(wp), intent(in), contiguous :: r(self%lo(1) - 1:, self%lo(2) - 1:, self%lo(3) - 1:)
    real(sp) :: line(2*(self%level(l)%z(1) - self%level(l)%a(1) - 1))
    integer :: j, k, n, first, last
    logical :: direct

    direct = l == 1 .and. .not. gathers(self, 1)
    n = self%level(l)%hi(1) - self%level(l)%lo(1) + 1
    line(n + 1:) = 0.0_sp
    ! Put the right side of level l together from the blocks of all processes.
    if (gathers(self, l)) then
      if (crew%me == 0) then
        if (l == 1) self%part = real(factor*r(self%lo(1):self%hi(1), self%lo(2):self%hi(2), &
                                              self%lo(3):self%hi(3)), sp)
        call gather_all(self%part, self%part_lo, self%part_hi, self%level(l)%f)
      end if
      call wait(crew)
    end if
    associate (level => self%level(l))
      call my_planes(crew, level%lo(3), level%hi(3), first, last)
      do k = first, last
        do j = level%lo(2), level%hi(2)
          if (direct) then
            line(:n) = real(factor*r(level%lo(1):level%hi(1), j, k), sp)
          else
            line(:n) = level%f(:, j, k)
          end if
          call load_line(level, line, j, k)
        end do
      end do
      call finish_sweep(level, crew)
    end associate
  end subroutine load

  !> Correction that level l has found: into the unknown z, or for the finer level.
  subroutine unload(self, crew, l, factor, z)
    class(multigrid_t), intent(inout) :: self
    type(team_t), intent(in) :: crew
    integer, intent(in) :: l
    real(wp), intent(in) :: factor   !! back to the size of the unknown
    real(wp), intent(inout), contiguous :: z(self%lo(1) - 1:, self%lo(2) - 1:, self%lo(3) - 1:)
    real(sp) :: line(2*(self%level(l)%z(1) - self%level(l)%a(1) - 1))
    integer :: j, k, first, last, low(3), high(3), offset

    associate (level => self%level(l), lo => self%lo, hi => self%hi)
      offset = 1 - level%lo(1)
      low = merge(lo, level%lo, l == 1)
      high = merge(hi, level%hi, l == 1)
      call my_planes(crew, low(3), high(3), first, last)
      do k = first, last
        do j = low(2), high(2)
          call unload_line(level, line, j, k)
          if (l == 1) then
            z(lo(1):hi(1), j, k) = factor*real(line(offset + lo(1):offset + hi(1)), wp)
          else
            level%f(:, j, k) = line(:high(1) - low(1) + 1)
          end if
        end do
      end do
    end associate
    call wait(crew)
  end subroutine unload

  !> After the unknown has changed: wait for the others and fill the halo.
  subroutine finish_sweep(level, crew)
    type(level_t), intent(inout) :: level
    type(team_t), intent(in) :: crew

    call wait(crew)
    if (.not. any(level%talks)) return
    if (crew%me == 0) call fill_halo(level, level%x)
    call wait(crew)
  end subroutine finish_sweep

  !> Half sweeps over the colours given.
  subroutine smooth(level, crew, colours)
    type(level_t), intent(inout) :: level
    type(team_t), intent(in) :: crew
    integer, intent(in) :: colours(:)
    integer :: first, last, s, k, front, low, high

    call my_planes(crew, level%lo(3), level%hi(3), first, last)
    if (any(level%talks) .or. (level%hi(3) - level%lo(3) + 1)/crew%n < 2*size(colours)) then
      ! One colour after the other.
      do s = 1, size(colours)
        do k = first, last
          call relax_plane(level, colours(s), k)
        end do
        call finish_sweep(level, crew)
      end do
    else
      ! All colours in one go through the planes, each one plane behind the one before, while the
      ! planes are still near the processor. At planes of other threads each half sweep stops one
      ! plane earlier; the wedge left open there is filled by the thread above it.
      low = merge(1, 0, first > level%lo(3))
      high = merge(1, 0, last < level%hi(3))
      do front = first, last + size(colours) - 1
        do s = 1, size(colours)
          k = front - s + 1
          if (k < first + low*(s - 1) .or. k > last - high*(s - 1)) cycle
          call relax_plane(level, colours(s), k)
        end do
      end do
      call wait(crew)
      do s = 2, low*size(colours)
        do k = first - s + 1, first + s - 2
          call relax_plane(level, colours(s), k)
        end do
      end do
      call wait(crew)
    end if
  end subroutine smooth

  !> Right side of the next level from the residual of level l.
  subroutine restrict(self, crew, l)
    class(multigrid_t), intent(inout) :: self
    type(team_t), intent(in) :: crew
    integer, intent(in) :: l

    if (gathers(self, l + 1)) then
      call restrict_to(self%part_lo, self%part_hi, self%part)
    else
      call restrict_to(self%level(l + 1)%lo, self%level(l + 1)%hi, self%level(l + 1)%f)
    end if
    call wait(crew)
  contains
    subroutine restrict_to(lo, hi, f)
      integer, intent(in) :: lo(3), hi(3)
      real(sp), intent(inout), contiguous :: f(:, :, :)
      integer :: k, first, last

      call my_planes(crew, lo(3), hi(3), first, last)
      do k = first, last
        call restrict_plane(self%level(l), k, lo, hi, f)
      end do
    end subroutine restrict_to
  end subroutine restrict

  !> Add the correction of the next level to level l.
  subroutine prolong(self, crew, l)
    class(multigrid_t), intent(inout) :: self
    type(team_t), intent(in) :: crew
    integer, intent(in) :: l
    integer :: k, first, last

    associate (level => self%level(l))
      call my_planes(crew, level%lo(3), level%hi(3), first, last)
      call wait(crew)
      do k = first, last
        call prolong_plane(level, k, self%level(l + 1)%lo, self%level(l + 1)%f)
      end do
      call finish_sweep(level, crew)
    end associate
  end subroutine prolong

end module multigrid_m
