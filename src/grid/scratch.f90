!> Work arrays over cells that stages of a step take and give back.
!!
!! The stages of a step need more arrays than the state has, but not at once. A stage takes what it
!! needs when it begins and gives it back when it ends; the pool grows until no stage has to wait.
!! What an array holds when it is taken is undefined.
module scratch_m
  use kinds_m, only: wp
  use grid_m, only: grid_t
  implicit none
  private
  public :: scratch_t, scratch_init, take, give

  type :: scalar_t
    real(wp), allocatable :: a(:, :, :)
  end type scalar_t

  type :: vector_t
    real(wp), allocatable :: a(:, :, :, :)
  end type vector_t

  type :: scratch_t
    private
    integer :: first(3) = 1, last(3) = 0   !! cells of the arrays, with the halo
    integer :: n_scalars = 0, n_vectors = 0   !! that are free
    type(scalar_t), allocatable :: scalars(:)
    type(vector_t), allocatable :: vectors(:)
  end type scratch_t

  !> An array of the cells with their halo, of one number or of three a cell.
  interface take
    module procedure take_scalar, take_vector
  end interface take

  interface give
    module procedure give_scalar, give_vector
  end interface give

contains

  !> An empty pool for a grid.
  subroutine scratch_init(grid, self)
    type(grid_t), intent(in) :: grid
    type(scratch_t), intent(out) :: self
    integer, parameter :: most = 32   !! arrays of a kind in use at once

    self%first = grid%first
    self%last = grid%last
    allocate (self%scalars(most), self%vectors(most))
  end subroutine scratch_init

  subroutine take_scalar(self, a)
    type(scratch_t), intent(inout) :: self
    real(wp), allocatable, intent(inout) :: a(:, :, :)

    if (self%n_scalars > 0) then
      call move_alloc(self%scalars(self%n_scalars)%a, a)
      self%n_scalars = self%n_scalars - 1
    else
      associate (f => self%first, l => self%last)
        allocate (a(f(1):l(1), f(2):l(2), f(3):l(3)), source=0.0_wp)
      end associate
    end if
  end subroutine take_scalar

  subroutine take_vector(self, a)
    type(scratch_t), intent(inout) :: self
    real(wp), allocatable, intent(inout) :: a(:, :, :, :)

    if (self%n_vectors > 0) then
      call move_alloc(self%vectors(self%n_vectors)%a, a)
      self%n_vectors = self%n_vectors - 1
    else
      associate (f => self%first, l => self%last)
        allocate (a(f(1):l(1), f(2):l(2), f(3):l(3), 3), source=0.0_wp)
      end associate
    end if
  end subroutine take_vector

  subroutine give_scalar(self, a)
    type(scratch_t), intent(inout) :: self
    real(wp), allocatable, intent(inout) :: a(:, :, :)

    self%n_scalars = self%n_scalars + 1
    call move_alloc(a, self%scalars(self%n_scalars)%a)
  end subroutine give_scalar

  subroutine give_vector(self, a)
    type(scratch_t), intent(inout) :: self
    real(wp), allocatable, intent(inout) :: a(:, :, :, :)

    self%n_vectors = self%n_vectors + 1
    call move_alloc(a, self%vectors(self%n_vectors)%a)
  end subroutine give_vector

end module scratch_m
