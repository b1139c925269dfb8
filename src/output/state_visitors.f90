!> What can be done with a state besides storing it: a checksum, its size, a search for NaN, a
!! comparison.
module state_visitors_m
  use, intrinsic :: iso_fortran_env, only: int32
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use kinds_m, only: wp, i8
  use errors_m, only: to_text
  use parallel_m, only: global_sum, global_min
  use checksum_m, only: checksum_t
  use grid_m, only: grid_t
  use state_m, only: state_visitor_t, owned_part, pack_part
  implicit none
  private
  public :: checksum_visitor_t, size_visitor_t, finite_visitor_t, image_visitor_t
  public :: checksum_of_cells

  !> Checksum of the whole state, the same on any number of processes.
  type, extends(state_visitor_t) :: checksum_visitor_t
    type(checksum_t) :: sum
  contains
    procedure :: cells => checksum_cells
    procedure :: reals => checksum_reals
    procedure :: integers => checksum_integers
  end type checksum_visitor_t

  !> Counts the bytes that the whole state takes in a file, at most.
  type, extends(state_visitor_t) :: size_visitor_t
    integer(i8) :: bytes = 0
  contains
    procedure :: cells => size_of_cells
    procedure :: reals => size_of_reals
    procedure :: integers => size_of_integers
    procedure, private :: add => add_size
  end type size_visitor_t

  !> Looks for the first number that is infinite or none at all.
  type, extends(state_visitor_t) :: finite_visitor_t
    character(:), allocatable :: found   !! name and place of it; not allocated: all is well
  contains
    procedure :: cells => finite_cells
    procedure :: reals => finite_reals
    procedure :: integers => finite_integers
  end type finite_visitor_t

  type :: item_t
    character(:), allocatable :: name
    integer(i8), allocatable :: bits(:)
  end type item_t

  !> Keeps a copy of a state on its first walk and compares another state with it, bit by bit, on
  !! the next ones. Every process looks at its own part.
  type, extends(state_visitor_t) :: image_visitor_t
    logical :: comparing = .false.
    integer :: n = 0                          !! items visited on this walk
    character(:), allocatable :: difference   !! first item that differs; not allocated: none
    type(item_t), allocatable, private :: item(:)
  contains
    procedure :: compare => image_compare
    procedure :: cells => image_cells
    procedure :: reals => image_reals
    procedure :: integers => image_integers
    procedure, private :: see
  end type image_visitor_t

contains

  subroutine checksum_cells(self, name, units, grid, faces, m, a)
    class(checksum_visitor_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    type(grid_t), intent(in) :: grid
    logical, intent(in) :: faces
    integer, intent(in) :: m
    real(wp), intent(inout) :: a(grid%first(1):grid%last(1), &
                                 grid%first(2):grid%last(2), &
                                 grid%first(3):grid%last(3), m)
    integer(i8) :: halves(2)

    call self%sum%add_text(name//units)
    halves = checksum_of_cells(grid, faces, m, a)
    call self%sum%add_integers(4, transfer(halves, [0]))
  end subroutine checksum_cells

  !> Two sums over all processes of scrambled bits, each element with its own place in it, so that
  !! the order of summation does not matter but the place of every element does.
  function checksum_of_cells(grid, faces, m, a) result(halves)
    type(grid_t), intent(in) :: grid
    logical, intent(in) :: faces
    integer, intent(in) :: m
    real(wp), intent(in) :: a(grid%first(1):grid%last(1), &
                              grid%first(2):grid%last(2), &
                              grid%first(3):grid%last(3), m)
    integer(i8) :: halves(2)   !! of the lower and the upper 32 bits
    integer(i8), parameter :: lower_half = 2_i8**32 - 1_i8
    integer(i8) :: place, bits
    integer :: first(3), last(3), d, i, j, k

    halves = 0
    do d = 1, m
      call owned_part(grid, faces, d, first, last)
      do k = first(3), last(3)
        do j = first(2), last(2)
          place = ((int(d, i8)*(grid%n(3) + 2) + k)*(grid%n(2) + 2) + j)*(grid%n(1) + 2)
          do i = first(1), last(1)
            bits = scrambled(ieor(transfer(a(i, j, k, d), bits), scrambled(place + i)))
            halves(1) = halves(1) + iand(bits, lower_half)
            halves(2) = halves(2) + ishft(bits, -32)
          end do
        end do
      end do
    end do
    call global_sum(halves)
  end function checksum_of_cells

  !> Spread a change of one bit over many; different bits stay different.
  elemental function scrambled(bits) result(b)
    integer(i8), intent(in) :: bits
    integer(i8) :: b

    b = ieor(bits, ishft(bits, 13))
    b = ieor(b, ishft(b, -7))
    b = ieor(b, ishft(b, 17))
  end function scrambled

  subroutine checksum_reals(self, name, units, extent, a)
    class(checksum_visitor_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: extent(:)
    real(wp), intent(inout) :: a(product(extent))

    call self%sum%add_text(name//units)
    call self%sum%add_reals(size(a), a)
  end subroutine checksum_reals

  subroutine checksum_integers(self, name, extent, a)
    class(checksum_visitor_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: extent(:)
    integer, intent(inout) :: a(product(extent))

    call self%sum%add_text(name)
    call self%sum%add_integers(size(a), a)
  end subroutine checksum_integers

  subroutine size_of_cells(self, name, units, grid, faces, m, a)
    class(size_visitor_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    type(grid_t), intent(in) :: grid
    logical, intent(in) :: faces
    integer, intent(in) :: m
    real(wp), intent(inout) :: a(grid%first(1):grid%last(1), &
                                 grid%first(2):grid%last(2), &
                                 grid%first(3):grid%last(3), m)

    call self%add(name//units, m*product(int(grid%n + merge(1, 0, faces), i8)), storage_size(a))
  end subroutine size_of_cells

  subroutine size_of_reals(self, name, units, extent, a)
    class(size_visitor_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: extent(:)
    real(wp), intent(inout) :: a(product(extent))

    call self%add(name//units, size(a, kind=i8), storage_size(a))
  end subroutine size_of_reals

  subroutine size_of_integers(self, name, extent, a)
    class(size_visitor_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: extent(:)
    integer, intent(inout) :: a(product(extent))

    call self%add(name, size(a, kind=i8), storage_size(a))
  end subroutine size_of_integers

  !> One more item.
  subroutine add_size(self, words, elements, bits)
    class(size_visitor_t), intent(inout) :: self
    character(*), intent(in) :: words       !! stored with it
    integer(i8), intent(in) :: elements
    integer, intent(in) :: bits             !! of an element
    integer, parameter :: header = 1024     !! what HDF5 keeps about an item, generously [bytes]

    self%bytes = self%bytes + header + len(words) + elements*(bits/8)
  end subroutine add_size

  subroutine finite_cells(self, name, units, grid, faces, m, a)
    class(finite_visitor_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    type(grid_t), intent(in) :: grid
    logical, intent(in) :: faces
    integer, intent(in) :: m
    real(wp), intent(inout) :: a(grid%first(1):grid%last(1), &
                                 grid%first(2):grid%last(2), &
                                 grid%first(3):grid%last(3), m)
    real(wp) :: place(1)   !! number of the first bad element; whole, exact below 2**53
    integer :: first(3), last(3), d, i, j, k, at

    if (allocated(self%found)) return
    place = huge(1.0_wp)
    do d = 1, m
      call owned_part(grid, faces, d, first, last)
      do k = first(3), last(3)
        do j = first(2), last(2)
          if (all(ieee_is_finite(a(first(1):last(1), j, k, d)))) cycle
          do i = first(1), last(1)
            if (ieee_is_finite(a(i, j, k, d))) cycle
            place(1) = min(place(1), ((real(d, wp)*(grid%n(3) + 2) + k)*(grid%n(2) + 2) &
              + j)*(grid%n(1) + 2) + i)
          end do
        end do
      end do
    end do
    call global_min(place)
    if (place(1) >= huge(1.0_wp)) return
    at = int(modulo(place(1), real(product(grid%n + 2), wp)))
    i = modulo(at, grid%n(1) + 2)
    at = at/(grid%n(1) + 2)
    self%found = name//' ['//units//'] at cell '//to_text(i)//', '//to_text(modulo(at, grid%n(2) &
      + 2)) &
      //', '//to_text(at/(grid%n(2) + 2))
  end subroutine finite_cells

  subroutine finite_reals(self, name, units, extent, a)
    class(finite_visitor_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: extent(:)
    real(wp), intent(inout) :: a(product(extent))
    integer :: i

    if (allocated(self%found)) return
    do i = 1, size(a)
      if (ieee_is_finite(a(i))) cycle
      self%found = name//' ['//units//']'
      if (size(extent) > 1) self%found = self%found//' of number '//to_text((i &
        - 1)/product(extent(:size(extent) - 1)) + 1)
      return
    end do
  end subroutine finite_reals

  !> Integers are always finite.
  subroutine finite_integers(self, name, extent, a)
    class(finite_visitor_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: extent(:)
    integer, intent(inout) :: a(product(extent))

    if (size(a) < 0) self%found = name
  end subroutine finite_integers

  !> From now on compare with the state seen so far.
  subroutine image_compare(self)
    class(image_visitor_t), intent(inout) :: self

    self%comparing = .true.
    self%n = 0
    if (allocated(self%difference)) deallocate (self%difference)
  end subroutine image_compare

  subroutine image_cells(self, name, units, grid, faces, m, a)
    class(image_visitor_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    type(grid_t), intent(in) :: grid
    logical, intent(in) :: faces
    integer, intent(in) :: m
    real(wp), intent(inout) :: a(grid%first(1):grid%last(1), &
                                 grid%first(2):grid%last(2), &
                                 grid%first(3):grid%last(3), m)
    real(wp), allocatable :: row(:)
    integer :: first(3), last(3), d

    do d = 1, m
      call owned_part(grid, faces, d, first, last)
      allocate (row(product(last - first + 1)))
      call pack_part(grid, a(:, :, :, d), first, last, row)
      call self%see(name//' ['//units//']', transfer(row, [0_i8]))
      deallocate (row)
    end do
  end subroutine image_cells

  subroutine image_reals(self, name, units, extent, a)
    class(image_visitor_t), intent(inout) :: self
    character(*), intent(in) :: name, units
    integer, intent(in) :: extent(:)
    real(wp), intent(inout) :: a(product(extent))

    call self%see(name//' ['//units//']', transfer(a, [0_i8]))
  end subroutine image_reals

  subroutine image_integers(self, name, extent, a)
    class(image_visitor_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer, intent(in) :: extent(:)
    integer, intent(inout) :: a(product(extent))

    call self%see(name, int(a, i8))
  end subroutine image_integers

  !> Keep the bits of the next item, or compare them with those kept.
  subroutine see(self, name, bits)
    class(image_visitor_t), intent(inout) :: self
    character(*), intent(in) :: name
    integer(i8), intent(in) :: bits(:)
    type(item_t), allocatable :: longer(:)
    integer :: i

    self%n = self%n + 1
    if (self%comparing) then
      if (allocated(self%difference)) return
      if (self%n > size(self%item)) then
        self%difference = name//': not in the other state'
      else if (self%item(self%n)%name /= name .or. size(self%item(self%n)%bits) /= size(bits)) then
        self%difference = name//': another size'
      else
        do i = 1, size(bits)
          if (self%item(self%n)%bits(i) == bits(i)) cycle
          self%difference = name//': element '//to_text(i)
          return
        end do
      end if
      return
    end if
    if (.not. allocated(self%item)) allocate (self%item(0))
    if (self%n > size(self%item)) then
      allocate (longer(self%n))
      longer(:self%n - 1) = self%item
      call move_alloc(longer, self%item)
    end if
    self%item(self%n)%name = name
    self%item(self%n)%bits = bits
  end subroutine see

end module state_visitors_m
