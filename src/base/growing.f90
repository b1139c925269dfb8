!> Lists that grow: room for more entries, by doubling, what is there kept.
module growing_m
  use kinds_m, only: wp
  implicit none
  private
  public :: ensure_capacity

  !> Make room for at least n entries in a list, or n columns in an array of them; the entries
  !! present are kept, the new ones are undefined.
  !!
  !! Columns hold `rows` numbers, three if not said otherwise: only the first call of an array asks.
  interface ensure_capacity
    procedure :: ensure_integers, ensure_integer_columns
    procedure :: ensure_reals, ensure_real_columns
    procedure :: ensure_logicals
  end interface ensure_capacity

  integer, parameter :: first_capacity = 16   !! entries that a list begins with, at least

contains

  !> Size of a list that has to hold n entries and has room for fewer.
  pure function grown(n, capacity) result(size_new)
    integer, intent(in) :: n      !! wanted
    integer, intent(in) :: capacity   !! there is
    integer :: size_new

    size_new = max(n, 2*capacity, first_capacity)
  end function grown

  pure subroutine ensure_integers(n, list)
    integer, intent(in) :: n
    integer, allocatable, intent(inout) :: list(:)
    integer, allocatable :: longer(:)

    if (.not. allocated(list)) allocate (list(grown(n, 0)))
    if (n <= size(list)) return
    allocate (longer(grown(n, size(list))))
    longer(:size(list)) = list
    call move_alloc(longer, list)
  end subroutine ensure_integers

  pure subroutine ensure_integer_columns(n, list, rows)
    integer, intent(in) :: n
    integer, allocatable, intent(inout) :: list(:, :)   !! (rows, :)
    integer, intent(in), optional :: rows
    integer, allocatable :: longer(:, :)

    if (.not. allocated(list)) allocate (list(rows_of(rows), grown(n, 0)))
    if (n <= size(list, 2)) return
    allocate (longer(size(list, 1), grown(n, size(list, 2))))
    longer(:, :size(list, 2)) = list
    call move_alloc(longer, list)
  end subroutine ensure_integer_columns

  pure subroutine ensure_reals(n, list)
    integer, intent(in) :: n
    real(wp), allocatable, intent(inout) :: list(:)
    real(wp), allocatable :: longer(:)

    if (.not. allocated(list)) allocate (list(grown(n, 0)))
    if (n <= size(list)) return
    allocate (longer(grown(n, size(list))))
    longer(:size(list)) = list
    call move_alloc(longer, list)
  end subroutine ensure_reals

  pure subroutine ensure_real_columns(n, list, rows)
    integer, intent(in) :: n
    real(wp), allocatable, intent(inout) :: list(:, :)   !! (rows, :)
    integer, intent(in), optional :: rows
    real(wp), allocatable :: longer(:, :)

    if (.not. allocated(list)) allocate (list(rows_of(rows), grown(n, 0)))
    if (n <= size(list, 2)) return
    allocate (longer(size(list, 1), grown(n, size(list, 2))))
    longer(:, :size(list, 2)) = list
    call move_alloc(longer, list)
  end subroutine ensure_real_columns

  pure subroutine ensure_logicals(n, list)
    integer, intent(in) :: n
    logical, allocatable, intent(inout) :: list(:)
    logical, allocatable :: longer(:)

    if (.not. allocated(list)) allocate (list(grown(n, 0)), source=.false.)
    if (n <= size(list)) return
    allocate (longer(grown(n, size(list))), source=.false.)   ! anything else is no logical
    longer(:size(list)) = list
    call move_alloc(longer, list)
  end subroutine ensure_logicals

  !> Rows of an array of columns: those asked for, else three.
  pure function rows_of(rows) result(n)
    integer, intent(in), optional :: rows
    integer :: n

    n = 3
    if (present(rows)) n = rows
  end function rows_of

end module growing_m
