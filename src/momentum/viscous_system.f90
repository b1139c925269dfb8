!> The system of the viscous stage as data: masses, links between cells, links to walls.
!!
!! `viscous_links_m` fills it, `viscous_m` and `momentum_c_ismac_m` solve it.
module viscous_system_m
  use kinds_m, only: wp
  use grid_m, only: grid_t
  use scratch_m, only: scratch_t, take, give
  implicit none
  private
  public :: viscous_t, wall_links_t, viscous_init
  public :: take_arrays, give_arrays

  !> Links between cells and bodies, grouped by body.
  type :: wall_links_t
    integer :: n = 0
    integer, allocatable :: first(:)          !! (bodies + 1)
    integer, allocatable :: cell(:, :)        !! (3, *)
    real(wp), allocatable :: k(:)             !! conductance [kg/s]
    real(wp), allocatable :: arm(:, :)        !! (3, *) from the centre of mass to the wall [m]
  end type wall_links_t

  !> Half links to sides of the domain that move.
  type :: side_links_t
    integer :: n = 0
    integer, allocatable :: cell(:, :)     !! (3, *)
    real(wp), allocatable :: pull(:, :)    !! (3, *) conductance times velocity [kg m/s2]
  end type side_links_t

  !> The system, what solves it, and what came out.
  type :: viscous_t
    real(wp) :: dt = 0.0_wp   !! [s]
    real(wp), allocatable :: mass(:, :, :)
      !! rho m V/dt, 0: the velocity is not an unknown [kg/s]
    real(wp), allocatable :: link(:, :, :, :)
      !! conductance of the link across the lower face [kg/s]
    real(wp), allocatable :: diagonal(:, :, :, :)   !! 1 where the velocity is not an unknown [kg/s]
    real(wp) :: spread = 1.0_wp
      !! largest share of the diagonal that links to other cells have, of all processes [-]
    type(wall_links_t) :: walls
    type(side_links_t) :: sides
    real(wp), allocatable :: body_matrix(:, :, :)
      !! (6, 6, n) wall links seen by the body [kg/s, kg m, kg m2/s]
    real(wp), allocatable :: spin_drag(:)
      !! 2 mu V of the body: torque per angular velocity [N m s]
    real(wp), allocatable :: r(:, :, :, :)   !! right side; of conjugate gradients the residual
    real(wp), allocatable :: s(:, :, :, :), y(:, :, :, :)   !! direction, the system applied to it
    real(wp), allocatable :: force(:, :)   !! (6, n) of the fluid on each body [N, N m]
    integer :: iterations = 0              !! of the last solve
    logical :: converged = .true.
  end type viscous_t

contains

  !> Allocate the work arrays.
  subroutine viscous_init(grid, n_bodies, self, pooled)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: n_bodies
    type(viscous_t), intent(out) :: self
    logical, intent(in), optional :: pooled   !! arrays over the cells come from `scratch_m` later
    integer :: a(3), b(3), m(3), n

    a = grid%first
    b = grid%last
    m = grid%hi - grid%lo + 1
    n = 2*(m(1)*m(2) + m(2)*m(3) + m(3)*m(1))
    if (.not. any(abs(grid%side_velocity) > 0.0_wp)) n = 0
    allocate (self%sides%cell(3, n), self%sides%pull(3, n))
    if (.not. present(pooled)) then
      allocate (self%mass(a(1):b(1), a(2):b(2), a(3):b(3)), source=0.0_wp)
      allocate (self%link(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
      allocate (self%diagonal, self%r, self%s, self%y, source=self%link)
    end if
    allocate (self%body_matrix(6, 6, n_bodies), source=0.0_wp)
    allocate (self%force(6, n_bodies), source=0.0_wp)
    allocate (self%spin_drag(n_bodies), source=0.0_wp)
    associate (walls => self%walls)
      allocate (walls%first(n_bodies + 1), source=1)
      allocate (walls%cell(3, 0), walls%k(0), walls%arm(3, 0))
    end associate
  end subroutine viscous_init

  !> Take the arrays over the cells, whose content is undefined, for a stage.
  subroutine take_arrays(scratch, self)
    type(scratch_t), intent(inout) :: scratch
    type(viscous_t), intent(inout) :: self

    call take(scratch, self%mass)
    call take(scratch, self%link)
    call take(scratch, self%diagonal)
    call take(scratch, self%r)
    call take(scratch, self%s)
    call take(scratch, self%y)
  end subroutine take_arrays

  !> And give them back.
  subroutine give_arrays(scratch, self)
    type(scratch_t), intent(inout) :: scratch
    type(viscous_t), intent(inout) :: self

    call give(scratch, self%mass)
    call give(scratch, self%link)
    call give(scratch, self%diagonal)
    call give(scratch, self%r)
    call give(scratch, self%s)
    call give(scratch, self%y)
  end subroutine give_arrays

end module viscous_system_m
