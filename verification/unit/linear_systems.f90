!> Linear systems for the tests of the solvers: a tank with waves and blocks, and small random ones.
!!
!! Every number is a function of the global cell index, so any number of processes holds the same
!! system.
module linear_systems_m
  use kinds_m, only: wp, pi
  use errors_m, only: to_text
  use case_text_m, only: grid_of, sides
  use grid_m, only: grid_t, unit_step
  use linear_operator_m, only: linear_operator_t, seven_points
  use krylov_m, only: krylov_work_t, krylov_init
  use multigrid_m, only: multigrid_t
  use parallel_m, only: halo_exchange
  use random_counter_m, only: uniform, random_rotation
  use vectors_m, only: rotation_matrix
  implicit none
  private
  public :: system_t, make_grid, set_tank, set_random, complete

  !> The seven-point operator of the face coefficients `cf`, without bodies.
  type, extends(linear_operator_t) :: face_operator_t
    integer :: lo(3) = 1, hi(3) = 0
    real(wp), allocatable :: cf(:, :, :, :)     !! of the lower faces
    real(wp), allocatable :: aperture(:, :, :, :)   !! open share of the lower faces [-]
  contains
    procedure :: apply => apply_faces
  end type face_operator_t

  !> A system on the grid with its preconditioner and the arrays of the solvers.
  type :: system_t
    type(grid_t) :: grid
    type(face_operator_t) :: op
    type(multigrid_t) :: multigrid
    type(krylov_work_t) :: work
    real(wp), allocatable :: b(:, :, :), x(:, :, :)
  end type system_t

  integer, parameter :: n_blocks = 7, samples = 4   !! blocks in the tank, points per edge of a face
  real(wp), parameter :: edge = 0.02_wp             !! of the seven cubes of a block [m]
  real(wp), parameter :: place(3, n_blocks) = 0.01_wp*reshape([5, 5, 3, 15, 5, 3, 24, 6, 3, &
    10, 4, 6, 20, 6, 7, 14, 5, 10, 23, 4, 13], [3, n_blocks])   !! centres [m]

contains

  !> Grid of n cells in a box with walls, and p = 0 at its top if that is open.
  subroutine make_grid(n, length, top, periodic, grid)
    integer, intent(in) :: n(3)
    real(wp), intent(in) :: length(3)   !! [m]
    character(*), intent(in) :: top     !! 'open' or a wall
    logical, intent(in) :: periodic(3)
    type(grid_t), intent(out) :: grid
    character(8) :: kind(2, 3)

    kind = 'slip'
    kind(2, 3) = top
    where (spread(periodic, 1, 2)) kind = 'periodic'
    call grid_of('&grid cells='//to_text(n)//' length='//to_text(length)//'/ ' &
      //sides(kind(1, 1)//' '//kind(2, 1)//' '//kind(1, 2)//' '//kind(2, 2)//' '//kind(1, 3)//' ' &
      //kind(2, 3)), grid)
  end subroutine make_grid

  !> Coefficients w A/(rho h) of water and air (830 to 1) under waves, with blocks of seven cubes.
  !!
  !! Every tenth partly open face is open by as little as 1e-9 only.
  subroutine set_tank(grid, op)
    type(grid_t), intent(in) :: grid
    type(face_operator_t), intent(out) :: op
    real(wp) :: turn(3, 3, n_blocks), w
    integer :: i, j, k, d, e(3), number

    do i = 1, n_blocks
      turn(:, :, i) = rotation_matrix(random_rotation(1, i))
    end do
    call allocate_operator(grid, op)
    do d = 1, 3
      e = unit_step(:, d)
      do k = grid%lo(3), grid%hi(3) + e(3)
        do j = grid%lo(2), grid%hi(2) + e(2)
          do i = grid%lo(1), grid%hi(1) + e(1)
            w = open_share(grid, turn, face_of(wrapped(grid, [i, j, k]), d), d)
            number = number_of(grid, [i, j, k], d)
            if (w > 0.0_wp .and. w < 1.0_wp .and. uniform(2, 1, number) < 0.1_wp) then
              w = 10.0_wp**(-9*uniform(2, 2, number))
            end if
            op%aperture(i, j, k, d) = w
            op%cf(i, j, k, d) = w*grid%area(d)/(grid%h(d)*0.5_wp*(density(grid, [i, j, k]) &
              + density(grid, [i, j, k] - e)))
          end do
        end do
      end do
    end do
    call set_sides(grid, op)
  contains
    pure function face_of(c, d) result(x)
      integer, intent(in) :: c(3), d
      real(wp) :: x(3)   !! centre of the lower face [m]

      x = grid%centre(c, [1, 2, 3])
      x(d) = grid%face(c(d), d)
    end function face_of
  end subroutine set_tank

  !> Density of a cell under a wavy surface, the level of which fits the height of the box.
  pure real(wp) function density(grid, c) result(rho)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: c(3)
    real(wp) :: x(3), level

    x = grid%centre(wrapped(grid, c), [1, 2, 3])
    level = 0.75_wp*grid%length(3) + 0.1_wp*x(1) &
      + 0.008_wp*sin(2*pi*x(1)/0.15_wp + 0.3_wp)*cos(pi*x(2)/0.1_wp)
    rho = 1.2_wp + 996.8_wp*min(max((level - x(3))/grid%h(3) + 0.5_wp, 0.0_wp), 1.0_wp)
  end function density

  !> Share of the sample points of a face that lie outside all blocks.
  pure real(wp) function open_share(grid, turn, x, d) result(w)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: turn(3, 3, n_blocks), x(3)
    integer, intent(in) :: d
    real(wp) :: point(3)
    integer :: p, q, e(2), n_open

    e = merge([2, 3], merge([1, 3], [1, 2], d == 2), d == 1)
    w = 1.0_wp
    if (.not. any(norm2(place - spread(x, 2, n_blocks), 1) < 1.7_wp*edge + maxval(grid%h))) return
    n_open = 0
    do p = 1, samples
      do q = 1, samples
        point = x
        point(e) = x(e) + ((real([p, q], wp) - 0.5_wp)/samples - 0.5_wp)*grid%h(e)
        if (.not. in_block(turn, point)) n_open = n_open + 1
      end do
    end do
    w = real(n_open, wp)/samples**2
  end function open_share

  !> Does a point lie in a block: a cube with a cube on each face?
  pure logical function in_block(turn, x)
    real(wp), intent(in) :: turn(3, 3, n_blocks), x(3)
    real(wp) :: y(3)
    integer :: b

    in_block = .false.
    do b = 1, n_blocks
      y = abs(matmul(x - place(:, b), turn(:, :, b)))
      in_block = in_block .or. (count(y <= 0.5_wp*edge) >= 2 .and. all(y <= 1.5_wp*edge))
    end do
  end function in_block

  !> Random coefficients over three decades; every fourth face is closed, and with it some cells.
  subroutine set_random(grid, seed, op)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: seed
    type(face_operator_t), intent(out) :: op
    integer :: i, j, k, d, e(3), number

    call allocate_operator(grid, op)
    do d = 1, 3
      e = unit_step(:, d)
      do concurrent (k=grid%lo(3):grid%hi(3) + e(3), &
        j=grid%lo(2):grid%hi(2) + e(2), i=grid%lo(1):grid%hi(1) + e(1))
        number = number_of(grid, [i, j, k], d)
        op%aperture(i, j, k, d) = merge(0.0_wp, 1.0_wp, uniform(seed, 1, number) < 0.25_wp)
        op%cf(i, j, k, d) = op%aperture(i, j, k, d)*grid%area(d)/grid%h(d) &
          *10.0_wp**(3*uniform(seed, 2, number))
      end do
    end do
    call set_sides(grid, op)
  end subroutine set_random

  subroutine allocate_operator(grid, op)
    type(grid_t), intent(in) :: grid
    type(face_operator_t), intent(inout) :: op
    integer :: a(3), b(3)

    a = grid%lo - 1
    b = grid%hi + 1
    op%lo = grid%lo
    op%hi = grid%hi
    allocate (op%cf(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
    allocate (op%aperture, source=op%cf)
  end subroutine allocate_operator

  !> Number of a face: the same for a face at both ends of a periodic direction.
  pure integer function number_of(grid, c, d)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: c(3), d
    integer :: i(3)

    i = wrapped(grid, c)
    number_of = d + 3*(i(1) + (grid%n(1) + 1)*(i(2) + (grid%n(2) + 1)*i(3)))
  end function number_of

  !> Cell in the domain of which a cell is a periodic image.
  pure function wrapped(grid, c) result(i)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: c(3)
    integer :: i(3)

    i = c
    where (grid%periodic) i = modulo(c - 1, grid%n) + 1
  end function wrapped

  !> Sides of the domain: closed walls; at an open top p = 0 half a cell away.
  subroutine set_sides(grid, op)
    use boundary_kinds_m, only: side_open
    type(grid_t), intent(in) :: grid
    type(face_operator_t), intent(inout) :: op
    integer :: d, s, a(3), b(3)
    real(wp) :: factor

    do d = 1, 3
      do s = 1, 2
        if (grid%periodic(d) .or. .not. grid%at_side(s, d)) cycle
        a = grid%lo
        b = grid%hi
        a(d) = merge(1, grid%n(d) + 1, s == 1)
        b(d) = a(d)
        factor = merge(2.0_wp, 0.0_wp, grid%side(s, d) == side_open)
        associate (cf => op%cf(a(1):b(1), a(2):b(2), a(3):b(3), d), &
                   aperture => op%aperture(a(1):b(1), a(2):b(2), a(3):b(3), d))
          cf = factor*cf
          aperture = min(factor, 1.0_wp)*aperture
        end associate
      end do
    end do
  end subroutine set_sides

  !> Right side, preconditioner and work arrays of a grid with its operator.
  subroutine complete(system)
    type(system_t), intent(inout) :: system

    call set_right_side(system%grid, system%op, system%b)
    allocate (system%x, source=0*system%b)
    call krylov_init(system%grid, system%work)
    call system%multigrid%init(system%grid)
    call system%multigrid%setup(system%op%cf)
  end subroutine complete

  !> Right side: net flux into each cell of a velocity field through the open faces, smooth plus
  !! rough. So it is zero in closed cells and has no mean where nothing flows out.
  subroutine set_right_side(grid, op, b)
    type(grid_t), intent(in) :: grid
    type(face_operator_t), intent(in) :: op
    real(wp), allocatable, intent(out) :: b(:, :, :)
    integer :: i, j, k, d, e(3)

    allocate (b(grid%lo(1) - 1:grid%hi(1) + 1, grid%lo(2) - 1:grid%hi(2) + 1, &
      grid%lo(3) - 1:grid%hi(3) + 1), source=0.0_wp)
    do d = 1, 3
      e = unit_step(:, d)
      do concurrent (k=grid%lo(3):grid%hi(3), j=grid%lo(2):grid%hi(2), i=grid%lo(1):grid%hi(1))
        b(i, j, k) = b(i, j, k) + flux([i, j, k], d) - flux([i, j, k] + e, d)
      end do
    end do
  contains
    pure real(wp) function flux(c, d)
      integer, intent(in) :: c(3), d
      real(wp) :: x(3)
      integer :: i(3)

      i = wrapped(grid, c)
      x = pi*grid%centre(i, [1, 2, 3])/grid%length
      flux = sum(cos(x*[2, 1, 3]))*cos(2*x(1) + x(2) - x(3)) - 0.5_wp
      flux = flux + uniform(3, d, number_of(grid, i, d))
      flux = flux*op%aperture(c(1), c(2), c(3), d)*grid%area(d)
    end function flux
  end subroutine set_right_side

  !> y = A x.
  subroutine apply_faces(self, x, y)
    class(face_operator_t), intent(inout) :: self
    real(wp), intent(inout), contiguous :: x(:, :, :), y(:, :, :)

    call halo_exchange(x, 1)
    call seven_points(self%cf, x, y)
  end subroutine apply_faces

end module linear_systems_m
