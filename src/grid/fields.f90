!> The state of the fluid on the grid.
module fields_m
  use kinds_m, only: wp
  use grid_m, only: grid_t
  use outflow_m, only: outflow_t
  implicit none
  private
  public :: flow_t, flow_init, add_product

  type :: flow_t
    real(wp), allocatable :: u(:, :, :, :)      !! velocity at the cell centre, x y z last [m/s]
    real(wp), allocatable :: p(:, :, :)         !! pressure [Pa]
    real(wp), allocatable :: uf(:, :, :, :)
      !! fluid velocity normal to the lower face, open part [m/s]
    real(wp), allocatable :: solid_flux(:, :, :, :)
      !! volume rate of the solids through the lower face [m3/s]
    real(wp), allocatable :: liquid(:, :, :)    !! volume of liquid W in the cell [m3]
    real(wp), allocatable :: fluid_volume(:, :, :)      !! carried open volume Vt of the cell [m3]
    real(wp), allocatable :: c(:, :, :)
      !! C^: liquid share of the full cell below its plane, extended
                                                !! through bodies; gives density, gravity, normals
                                                !! [-]
    real(wp), allocatable :: rho(:, :, :)       !! density of the fluid, from c [kg/m3]
    real(wp), allocatable :: mu(:, :, :)        !! viscosity of the fluid, from c [Pa s]
    type(outflow_t) :: sides(2, 3)              !! what lies outside the sides that are outflows
    real(wp) :: liquid_initial = 0.0_wp         !! sum of `liquid` at t = 0 [m3]
    real(wp) :: liquid_inflow = 0.0_wp          !! time integral of the net inflow of liquid [m3]
  end type flow_t

contains

  !> Allocate a fluid at rest, all gas, without pressure.
  subroutine flow_init(grid, flow)
    type(grid_t), intent(in) :: grid
    type(flow_t), intent(out) :: flow
    integer :: a(3), b(3)

    a = grid%first
    b = grid%last
    allocate (flow%u(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
    allocate (flow%uf, source=flow%u)
    allocate (flow%solid_flux, source=flow%u)
    allocate (flow%p(a(1):b(1), a(2):b(2), a(3):b(3)), source=0.0_wp)
    allocate (flow%liquid, source=flow%p)
    allocate (flow%fluid_volume, source=flow%p)
    allocate (flow%c, source=flow%p)
    allocate (flow%rho, source=flow%p)
    allocate (flow%mu, source=flow%p)
  end subroutine flow_init

  !> b := b + s*a in the own cells, all components.
  subroutine add_product(grid, s, a, b)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: s
    real(wp), intent(in), contiguous :: a(grid%first(1):, grid%first(2):, grid%first(3):, :)
    real(wp), intent(inout), contiguous :: b(grid%first(1):, grid%first(2):, grid%first(3):, :)
    integer :: i, j, k, c

    !$omp parallel do collapse(2) private(i, j) schedule(static)
    do c = 1, size(b, 4)
      do k = grid%lo(3), grid%hi(3)
        do j = grid%lo(2), grid%hi(2)
          do i = grid%lo(1), grid%hi(1)
            b(i, j, k, c) = b(i, j, k, c) + s*a(i, j, k, c)
          end do
        end do
      end do
    end do
  end subroutine add_product

end module fields_m
