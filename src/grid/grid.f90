!> The Cartesian grid: cells, spacing and the part of it that this process owns.
!!
!! Every array over cells has the *global* cell index and `n_halo` halo cells, so it is declared
!! `a(grid%first(1):, grid%first(2):, grid%first(3):)`. A face array carries the face direction as
!! its last index; element `(i,j,k,d)` is the *lower* face of cell `(i,j,k)` in direction d, so the
!! upper face of the cell is the lower face of its neighbour, and the sides of the tank at the upper
!! end are faces n+1.
module grid_m
  use kinds_m, only: wp
  use case_types_m, only: grid_input_t, boundary_input_t
  use boundary_kinds_m, only: no_side, side_code, side_no_slip, side_periodic, is_wall
  use parallel_m, only: decompose
  implicit none
  private
  public :: grid_t, grid_init, n_halo, unit_step

  integer, parameter :: n_halo = 3
    !! halo width of cell and face arrays: stencil of the fifth-order scheme

  !> `unit_step(:, d)` is the index step to the next cell in direction d.
  integer, parameter :: unit_step(3, 3) = reshape([1, 0, 0, 0, 1, 0, 0, 0, 1], [3, 3])

  type :: grid_t
    integer :: n(3) = 0           !! cells of the whole domain
    integer :: lo(3) = 1          !! first cell of this process (global index)
    integer :: hi(3) = 0          !! last cell of this process
    integer :: first(3) = 1 - n_halo, last(3) = n_halo   !! with the halo
    logical :: periodic(3) = .false.
    logical :: at_side(2, 3) = .true.   !! this process touches the lower / upper side of the domain
    integer :: side(2, 3) = side_no_slip
    real(wp) :: side_velocity(3, 2, 3) = 0.0_wp   !! wall or inflow velocity [m/s]
    real(wp) :: origin(3) = 0.0_wp, length(3) = 0.0_wp   !! [m]
    real(wp) :: h(3) = 0.0_wp     !! spacing [m]
    real(wp) :: volume = 0.0_wp   !! of a cell [m3]
    real(wp) :: area(3) = 0.0_wp  !! of a face normal to each direction [m2]
    real(wp) :: inverse_h2 = 0.0_wp   !! sum of 1/h^2, of directions with several cells [1/m2]
  contains
    procedure :: own => grid_own
    procedure :: face => grid_face
    procedure :: centre => grid_centre
    procedure :: cell_of => grid_cell_of
    procedure :: owns => grid_owns
    procedure :: beyond => grid_beyond
    procedure :: outside => grid_outside
    procedure :: beside => grid_beside
    procedure :: side_of_face => grid_side_of_face
    procedure :: side_faces => grid_side_faces
    procedure :: side_cells => grid_side_cells
    procedure :: min_spacing => grid_min_spacing
    procedure :: is_exit => grid_is_exit
  end type grid_t

contains

  !> Grid of a case, cut into blocks of cells for the processes of this run.
  subroutine grid_init(input, boundary, grid)
    type(grid_input_t), intent(in) :: input
    type(boundary_input_t), intent(in) :: boundary
    type(grid_t), intent(out) :: grid
    integer :: s, d, lo(3), hi(3)

    grid%n = input%cells
    grid%origin = input%origin
    grid%length = input%length
    grid%h = input%length/real(input%cells, wp)
    grid%volume = product(grid%h)
    grid%area = grid%volume/grid%h
    grid%inverse_h2 = sum(1.0_wp/grid%h**2, grid%n > 1)   ! the width of a slice says nothing
    grid%side_velocity = boundary%velocity
    do d = 1, 3
      do s = 1, 2
        grid%side(s, d) = side_code(boundary%kind(s, d))
      end do
      grid%periodic(d) = grid%side(1, d) == side_periodic
    end do
    call decompose(grid%n, grid%periodic, lo, hi, grid%at_side)
    call grid%own(lo, hi)
  end subroutine grid_init

  !> The cells lo to hi belong to this process.
  pure subroutine grid_own(self, lo, hi)
    class(grid_t), intent(inout) :: self
    integer, intent(in) :: lo(3), hi(3)

    self%lo = lo
    self%hi = hi
    self%first = lo - n_halo
    self%last = hi + n_halo
  end subroutine grid_own

  !> Coordinate of lower face number i in direction d [m].
  elemental function grid_face(self, i, d) result(x)
    class(grid_t), intent(in) :: self
    integer, intent(in) :: i, d
    real(wp) :: x

    x = self%origin(d) + real(i - 1, wp)*self%h(d)
  end function grid_face

  !> Coordinate of the centre of cell number i in direction d [m].
  elemental function grid_centre(self, i, d) result(x)
    class(grid_t), intent(in) :: self
    integer, intent(in) :: i, d
    real(wp) :: x

    x = self%origin(d) + (real(i, wp) - 0.5_wp)*self%h(d)
  end function grid_centre

  !> Number of the cell that holds coordinate x in direction d; may lie outside 1..n.
  elemental function grid_cell_of(self, x, d) result(i)
    class(grid_t), intent(in) :: self
    real(wp), intent(in) :: x   !! [m]
    integer, intent(in) :: d
    integer :: i

    i = floor((x - self%origin(d))/self%h(d)) + 1
  end function grid_cell_of

  !> Is this a cell of this process?
  pure function grid_owns(self, c) result(yes)
    class(grid_t), intent(in) :: self
    integer, intent(in) :: c(3)
    logical :: yes

    yes = all(c >= self%lo .and. c <= self%hi)
  end function grid_owns

  !> Does cell number i of direction d lie outside the domain? Nothing does in a periodic direction.
  elemental function grid_beyond(self, i, d) result(yes)
    class(grid_t), intent(in) :: self
    integer, intent(in) :: i, d
    logical :: yes

    yes = (i < 1 .or. i > self%n(d)) .and. .not. self%periodic(d)
  end function grid_beyond

  !> Does a cell lie outside the domain, in whatever direction?
  pure function grid_outside(self, c) result(yes)
    class(grid_t), intent(in) :: self
    integer, intent(in) :: c(3)
    logical :: yes

    yes = any((c < 1 .or. c > self%n) .and. .not. self%periodic)
  end function grid_outside

  !> Is cell number i of direction d the last one before the lower (s = 1) or upper (2) side?
  elemental function grid_beside(self, i, s, d) result(yes)
    class(grid_t), intent(in) :: self
    integer, intent(in) :: i, s, d
    logical :: yes

    yes = i == merge(1, self%n(d), s == 1) .and. .not. self%periodic(d)
  end function grid_beside

  !> The kind of side that lower face number i of direction d lies on, `no_side` between two cells.
  elemental function grid_side_of_face(self, i, d) result(side)
    class(grid_t), intent(in) :: self
    integer, intent(in) :: i, d
    integer :: side

    side = no_side
    if (self%periodic(d)) return
    if (i == 1) side = self%side(1, d)
    if (i == self%n(d) + 1) side = self%side(2, d)
  end function grid_side_of_face

  !> The lower faces lower..upper on the lower (s = 1) or upper (2) side of direction d; none if the
  !! direction is periodic or the side belongs to other processes.
  pure subroutine grid_side_faces(self, s, d, lower, upper)
    class(grid_t), intent(in) :: self
    integer, intent(in) :: s, d
    integer, intent(out) :: lower(3), upper(3)

    lower = self%lo
    upper = self%hi
    lower(d) = merge(1, self%n(d) + 1, s == 1)
    upper(d) = lower(d)
    if (self%periodic(d) .or. .not. self%at_side(s, d)) upper(d) = lower(d) - 1
  end subroutine grid_side_faces

  !> The cells lower..upper beside such a side, none likewise.
  pure subroutine grid_side_cells(self, s, d, lower, upper)
    class(grid_t), intent(in) :: self
    integer, intent(in) :: s, d
    integer, intent(out) :: lower(3), upper(3)

    call self%side_faces(s, d, lower, upper)
    if (s == 1) return
    lower(d) = lower(d) - 1
    upper(d) = upper(d) - 1
  end subroutine grid_side_cells

  !> Least spacing of the directions that have more than one cell [m]: the thickness of a slice says
  !! nothing.
  pure function grid_min_spacing(self) result(h)
    class(grid_t), intent(in) :: self
    real(wp) :: h

    h = minval(self%h, self%n > 1)
  end function grid_min_spacing

  !> Does what passes this side leave the tank? Not through a wall or a period, nor through an open
  !! top, from where it falls back.
  pure function grid_is_exit(self, gravity, s, d) result(yes)
    class(grid_t), intent(in) :: self
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    integer, intent(in) :: s, d          !! side 1 or 2 of a direction
    logical :: yes

    yes = .not. (self%periodic(d) .or. is_wall(self%side(s, d))) &
      .and. .not. (d == maxloc(abs(gravity), 1) &
                   .and. merge(gravity(d), -gravity(d), s == 1) > 0.0_wp)
  end function grid_is_exit

end module grid_m
