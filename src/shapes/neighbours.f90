!> Who is near whom: boxes sorted into bins, and pairs of bodies whose bounding spheres come close.
module neighbours_m
  use kinds_m, only: wp, i8
  use growing_m, only: ensure_capacity
  implicit none
  private
  public :: bins_t, bins_build, join_points, pair_list_t, near_pairs, nearest_shift
  public :: sort_bodies, add_neighbours

  !> Items (points, or boxes that may span several bins) sorted into a block of equal bins.
  type :: bins_t
    integer :: n(3) = 0                      !! bins in each direction
    real(wp) :: low(3) = 0.0_wp              !! lower corner of the block [m]
    real(wp) :: high(3) = 0.0_wp             !! upper corner of the block [m]
    real(wp) :: size(3) = 1.0_wp             !! of a bin [m]
    integer, allocatable :: first(:)   !! (bins + 1): items of bin c are first(c) : first(c+1)-1
    integer, allocatable :: item(:)          !! item numbers, ascending within a bin
  contains
    procedure :: place => bins_place
    procedure :: number => bins_number
  end type bins_t

  !> Pairs of bodies that are near one another, a > b, sorted by a, then b.
  type :: pair_list_t
    integer :: n = 0
    integer, allocatable :: a(:), b(:)       !! bodies
    !> (3, n) what to add to the position of b to get its periodic image near a [m].
    real(wp), allocatable :: shift(:, :)
    integer, allocatable, private :: cell(:, :), chain(:), head(:)   !! work: linked lists
  end type pair_list_t

  interface bins_build
    procedure :: bins_of_boxes, bins_of_sets
  end interface bins_build

contains

  !> Sort the boxes low(:, i) <= x <= high(:, i) into bins of about the given size.
  pure subroutine bins_of_boxes(low, high, size_wanted, bins)
    real(wp), intent(in) :: low(:, :), high(:, :)   !! (3, items) [m]
    real(wp), intent(in) :: size_wanted             !! [m]
    type(bins_t), intent(out) :: bins
    integer :: i, n

    n = size(low, 2)
    call bins_of_sets(reshape([low, high], [3, 2*n]), reshape([(i, n + i, i=1, n)], [2, n]), &
      size_wanted, bins)
  end subroutine bins_of_boxes

  !> Sort the boxes around sets of points into bins of about the given size.
  !!
  !! The size grows where the block would hold more than `max_bins`, or where large boxes would be
  !! listed in too many bins.
  pure subroutine bins_of_sets(point, set, size_wanted, bins, more, within)
    real(wp), intent(in) :: point(:, :)         !! (3, points) [m]
    integer, intent(in) :: set(:, :)            !! (points of each, items) numbers of points
    real(wp), intent(in) :: size_wanted         !! [m]
    type(bins_t), intent(out) :: bins
    real(wp), intent(in), optional :: more      !! by which the boxes are larger, default 0 [m]
    real(wp), intent(in), optional :: within(3, 2)
      !! corners of a box to which theirs are moved: bins stay small where points are far away, and
      !! find all they should, since the order along each axis is kept [m]
    integer, parameter :: max_bins = 200000
    integer(i8), parameter :: often = 100_i8             !! entries of a box on average
    integer(i8), parameter :: few = 10000000_i8, most = 1000000000_i8   !! entries in all
    real(wp) :: extent(3), edge, low(3), high(3), bound(3, 2), add
    integer :: i

    add = 0.0_wp
    if (present(more)) add = more
    bound = spread([-huge(1.0_wp), huge(1.0_wp)], 1, 3)
    if (present(within)) bound = within
    if (size(set, 2) == 0) then
      bins%n = 1
      allocate (bins%first(2), source=1)
      allocate (bins%item(0))
      return
    end if
    bins%low = huge(1.0_wp)
    bins%high = -huge(1.0_wp)
    do i = 1, size(set, 2)
      call get_box(point, set(:, i), add, bound, low, high)
      bins%low = min(bins%low, low)
      bins%high = max(bins%high, high)
    end do
    extent = bins%high - bins%low
    edge = max(size_wanted, maxval(extent)/real(max_bins, wp))
    if (.not. edge > 0.0_wp) edge = 1.0_wp   ! all in one place
    do while (product(extent/edge + 1.0_wp) > real(max_bins, wp))
      edge = 1.25_wp*edge
    end do
    call set_size(extent, edge, bins)
    do while (entries(point, set, add, bound, bins) &
              > min(max(few, often*int(size(set, 2), i8)), most))
      edge = 2*edge
      call set_size(extent, edge, bins)
    end do
    call fill_bins(point, set, add, bound, bins)
  end subroutine bins_of_sets

  !> The box around a set of points.
  pure subroutine get_box(point, set, more, within, low, high)
    real(wp), intent(in) :: point(:, :)           !! (3, points) [m]
    integer, intent(in) :: set(:)                 !! numbers of points
    real(wp), intent(in) :: more, within(3, 2)    !! as in `bins_of_sets`
    real(wp), intent(out) :: low(3), high(3)      !! [m]
    integer :: c

    low = point(:, set(1))
    high = low
    do c = 2, size(set)
      low = min(low, point(:, set(c)))
      high = max(high, point(:, set(c)))
    end do
    low = min(max(low - more, within(:, 1)), within(:, 2))
    high = min(max(high + more, within(:, 1)), within(:, 2))
  end subroutine get_box

  !> Number of the bins and their size, about a given one.
  pure subroutine set_size(extent, edge, bins)
    real(wp), intent(in) :: extent(3), edge   !! [m]
    type(bins_t), intent(inout) :: bins

    bins%n = max(1, ceiling(extent/edge))
    bins%size = merge(extent/real(bins%n, wp), edge, extent > 0.0_wp)
  end subroutine set_size

  !> In how many bins the boxes would be listed, all together.
  pure function entries(point, set, more, within, bins) result(n)
    real(wp), intent(in) :: point(:, :), more, within(3, 2)   !! as in `bins_of_sets`
    integer, intent(in) :: set(:, :)
    type(bins_t), intent(in) :: bins
    integer(i8) :: n
    real(wp) :: low(3), high(3)
    integer :: m

    n = 0
    do m = 1, size(set, 2)
      call get_box(point, set(:, m), more, within, low, high)
      n = n + product(int(bins%place(high) - bins%place(low) + 1, i8))
    end do
  end function entries

  !> List every box in the bins it meets.
  pure subroutine fill_bins(point, set, more, within, bins)
    real(wp), intent(in) :: point(:, :), more, within(3, 2)   !! as in `bins_of_sets`
    integer, intent(in) :: set(:, :)
    type(bins_t), intent(inout) :: bins
    real(wp) :: low(3), high(3)
    integer :: i, j, k, c, m, pass, a(3), b(3)
    integer, allocatable :: next(:)

    allocate (bins%first(product(bins%n) + 1), next(product(bins%n)), source=0)
    do pass = 1, 2   ! count, then fill
      do m = 1, size(set, 2)
        call get_box(point, set(:, m), more, within, low, high)
        a = bins%place(low)
        b = bins%place(high)
        do k = a(3), b(3)
          do j = a(2), b(2)
            do i = a(1), b(1)
              c = bins%number([i, j, k])
              if (pass == 2) bins%item(next(c)) = m
              next(c) = next(c) + 1
            end do
          end do
        end do
      end do
      if (pass == 2) exit
      bins%first(1) = 1
      do c = 1, size(next)
        bins%first(c + 1) = bins%first(c) + next(c)
      end do
      allocate (bins%item(bins%first(size(bins%first)) - 1))
      next = bins%first(:size(next))
    end do
  end subroutine fill_bins

  !> Bin that holds the point x, 1..n in each direction; points outside go to the nearest bin.
  pure function bins_place(self, x) result(p)
    class(bins_t), intent(in) :: self
    real(wp), intent(in) :: x(3)   !! [m]
    integer :: p(3)

    p = int(min(max((x - self%low)/self%size, 0.0_wp), real(self%n - 1, wp))) + 1
  end function bins_place

  !> Number of the bin at place p, 1..product(n).
  pure function bins_number(self, p) result(c)
    class(bins_t), intent(in) :: self
    integer, intent(in) :: p(3)
    integer :: c

    c = p(1) + self%n(1)*(p(2) - 1 + self%n(2)*(p(3) - 1))
  end function bins_number

  !> Let points at one place be one point: the first of them stays, in their order.
  pure subroutine join_points(point, spacing, near, number, within)
    real(wp), allocatable, intent(inout) :: point(:, :)   !! (3, points) [m]
    real(wp), intent(in) :: spacing               !! of the points, about [m]
    real(wp), intent(in) :: near                  !! points nearer in x, y and z are one [m]
    integer, allocatable, intent(out) :: number(:)   !! (points before) of those that stay
    real(wp), intent(in), optional :: within(3, 2)   !! see `bins_of_sets` [m]
    type(bins_t) :: bins
    logical, allocatable :: first(:)
    integer :: i, m, n, bin

    allocate (number(size(point, 2)), first(size(point, 2)))
    call bins_of_sets(point, reshape([(i, i=1, size(number))], [1, size(number)]), spacing, bins, &
      near, within)
    n = 0
    do i = 1, size(number)
      bin = bins%number(bins%place(point(:, i)))
      do m = bins%first(bin), bins%first(bin + 1) - 1
        if (all(abs(point(:, bins%item(m)) - point(:, i)) <= near)) exit
      end do
      first(i) = bins%item(m) == i
      if (first(i)) n = n + 1
      number(i) = n
      if (.not. first(i)) number(i) = number(bins%item(m))
    end do
    point = point(:, pack([(i, i=1, size(number))], first))
  end subroutine join_points

  !> All pairs of active bodies closer than the sum of their radii plus `skin`.
  !!
  !! Work grows with the number of bodies, not of pairs. Of a periodic direction only the nearest
  !! image is looked at: bodies are shorter than half a period.
  subroutine near_pairs(x, radius, active, period, skin, pairs)
    real(wp), intent(in) :: x(:, :)     !! (3, n) centres [m]
    real(wp), intent(in) :: radius(:)   !! (n) bounding spheres [m]
    logical, intent(in) :: active(:)    !! (n) looked at
    real(wp), intent(in) :: period(3)   !! length of the domain, 0 where it is not periodic [m]
    real(wp), intent(in) :: skin        !! [m]
    type(pair_list_t), intent(inout) :: pairs
    integer :: a, cells(3)

    pairs%n = 0
    if (count(active) < 2) return
    call sort_bodies(x, radius, active, period, skin, cells, pairs)
    do a = 1, size(radius)
      if (active(a)) call add_neighbours(a, x, radius, period, skin, cells, pairs)
    end do
  end subroutine near_pairs

  !> Append the pairs of body a with the active bodies before it, after `sort_bodies`.
  subroutine add_neighbours(a, x, radius, period, skin, cells, pairs)
    integer, intent(in) :: a
    real(wp), intent(in) :: x(:, :), radius(:), period(3), skin   !! as in `near_pairs`
    integer, intent(in) :: cells(3)   !! from `sort_bodies`
    type(pair_list_t), intent(inout) :: pairs
    integer :: b, i, j, k, c(3), offset(2, 3), begin
    real(wp) :: d(3), shift(3)

    begin = pairs%n + 1
    offset(1, :) = -1
    offset(2, :) = 1
    where (period > 0.0_wp .and. cells < 3) offset(1, :) = 1 - cells
    where (period > 0.0_wp .and. cells < 3) offset(2, :) = 0
    do k = offset(1, 3), offset(2, 3)
      do j = offset(1, 2), offset(2, 2)
        do i = offset(1, 1), offset(2, 1)
          c = pairs%cell(:, a) + [i, j, k]
          where (period > 0.0_wp) c = modulo(c, cells)
          if (any(c < 0) .or. any(c >= cells)) cycle
          b = pairs%head(1 + c(1) + cells(1)*(c(2) + cells(2)*c(3)))
          do while (b > 0)
            if (b < a) then
              d = x(:, b) - x(:, a)
              shift = nearest_shift(period, d)
              d = d + shift
              if (dot_product(d, d) < (radius(a) + radius(b) + skin)**2) then
                pairs%n = pairs%n + 1
                call ensure_capacity(pairs%n, pairs%a)
                call ensure_capacity(pairs%n, pairs%b)
                call ensure_capacity(pairs%n, pairs%shift)
                pairs%a(pairs%n) = a
                pairs%b(pairs%n) = b
                pairs%shift(:, pairs%n) = shift
              end if
            end if
            b = pairs%chain(b)
          end do
        end do
      end do
    end do
    ! Sort the pairs from `begin` on, all of one body, by counterpart.
    do i = begin + 1, pairs%n
      b = pairs%b(i)
      shift = pairs%shift(:, i)
      j = i - 1
      do while (j >= begin)
        if (pairs%b(j) < b) exit
        pairs%b(j + 1) = pairs%b(j)
        pairs%shift(:, j + 1) = pairs%shift(:, j)
        j = j - 1
      end do
      pairs%b(j + 1) = b
      pairs%shift(:, j + 1) = shift
    end do
  end subroutine add_neighbours

  !> What to add to the distance d so that it points to the nearest periodic image [m].
  pure function nearest_shift(period, d) result(shift)
    real(wp), intent(in) :: period(3)   !! length of the domain, 0 where it is not periodic [m]
    real(wp), intent(in) :: d(3)        !! [m]
    real(wp) :: shift(3)
    integer :: i

    shift = 0.0_wp
    do i = 1, 3
      if (period(i) > 0.0_wp) shift(i) = -period(i)*anint(d(i)/period(i))
    end do
  end function nearest_shift

  !> Put the bodies into cells no smaller than the cutoff of the largest pair.
  subroutine sort_bodies(x, radius, active, period, skin, cells, pairs)
    real(wp), intent(in) :: x(:, :), radius(:), period(3), skin   !! as in `near_pairs`
    logical, intent(in) :: active(:)
    integer, intent(out) :: cells(3)   !! cells in each direction
    type(pair_list_t), intent(inout) :: pairs
    real(wp) :: low(3), high(3), edge(3), cutoff
    integer :: a, c, d, most

    low = huge(1.0_wp)
    high = -huge(1.0_wp)
    do a = 1, size(radius)
      if (.not. active(a)) cycle
      low = min(low, x(:, a))
      high = max(high, x(:, a))
    end do
    where (period > 0.0_wp)
      low = 0.0_wp
      high = period
    end where
    cutoff = 2*maxval(radius, active) + skin
    most = max(1, nint((8.0_wp*size(radius))**(1.0_wp/3.0_wp)))
    do d = 1, 3
      cells(d) = min(max(1, int(min((high(d) - low(d))/cutoff, real(most, wp)))), most)
    end do
    edge = max((high - low)/real(cells, wp), tiny(1.0_wp))
    if (.not. allocated(pairs%chain)) then
      allocate (pairs%chain(size(radius)), pairs%cell(3, size(radius)))
      allocate (pairs%head(max(1, nint((8.0_wp*size(radius))**(1.0_wp/3.0_wp)))**3))
    end if
    pairs%head(:product(cells)) = 0
    do a = size(radius), 1, -1
      if (.not. active(a)) cycle
      pairs%cell(:, a) = floor((x(:, a) - low)/edge)
      where (period > 0.0_wp)
        pairs%cell(:, a) = modulo(pairs%cell(:, a), cells)
      else where
        pairs%cell(:, a) = min(pairs%cell(:, a), cells - 1)
      end where
      c = 1 + pairs%cell(1, a) + cells(1)*(pairs%cell(2, a) + cells(2)*pairs%cell(3, a))
      pairs%chain(a) = pairs%head(c)
      pairs%head(c) = a
    end do
  end subroutine sort_bodies

end module neighbours_m
