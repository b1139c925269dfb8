!> Open part of a cell that a box cuts: volumes below planes and in slabs against the exact ones.
module test_cut_cell_m
  use check_m, only: check, wp
  use solid_geometry_m, only: solid_geometry_t
  use grid_m, only: grid_t
  use box_solid_m, only: simple_grid, set_boxes
  use plic_m, only: unit_volume, unit_slab
  use cut_cell_m, only: cut_cell_t, cut_cell_init, load_cut_cell, open_below, open_constant, &
                        open_slab_below
  implicit none
  private
  public :: test_cut_cell

  real(wp), parameter :: low(3) = [0.3_wp, -0.1_wp, 0.02_wp], h(3) = [0.005_wp, 0.01_wp, 0.02_wp]
  type(cut_cell_t) :: cut

contains

  subroutine test_cut_cell()
    call cut_cell_init(cut)
    call box_in_cell([-0.3_wp, 0.2_wp, 0.1_wp], [0.6_wp, 1.7_wp, 0.8_wp], 'box that sticks out')
    call box_in_cell([0.25_wp, 0.3_wp, 0.35_wp], [0.75_wp, 0.6_wp, 0.9_wp], 'box inside')
    call box_in_cell([-2.0_wp, -3.0_wp, -1.0_wp], [0.999999_wp, 2.0_wp, 1.5_wp], &
                     'box that fills nearly all')
    call box_in_cell([0.5_wp, 0.0_wp, 0.0_wp], [1.0_wp, 1.0_wp, 1.0_wp], 'box on the faces')
    call cell_without_open_part()
  end subroutine test_cut_cell

  !> A box from a to b, in shares of the cell; half of it is put there, then doubled, so that it may
  !! fill all.
  subroutine set_box(a, b, solid)
    real(wp), intent(in) :: a(3), b(3)
    type(solid_geometry_t), intent(inout) :: solid
    type(grid_t) :: grid

    call simple_grid([1, 1, 1], h, grid)
    grid%origin = low
    call set_boxes(grid, low + 0.5_wp*h*a, low + 0.5_wp*h*b, solid)
    solid%tets%corner = 2*solid%tets%corner &
      - spread(spread(low, 2, 4), 3, size(solid%tets%corner, 3))
  end subroutine set_box

  subroutine box_in_cell(a, b, name)
    real(wp), intent(in) :: a(3), b(3)
    character(*), intent(in) :: name
    type(solid_geometry_t) :: solid
    real(wp) :: from(3), edge(3), m(3), s, share, exact, limit, c
    integer :: i, d

    call set_box(a, b, solid)
    call load_cut_cell(solid, 1, low, h, cut)
    from = max(a, 0.0_wp)
    edge = min(b, 1.0_wp) - from
    call check(name//': open share', cut%open, 1.0_wp - product(edge), 1.0e-13_wp)
    do i = 1, 300
      m = [sin(real(i, wp)), cos(2.3_wp*real(i, wp)), sin(0.7_wp*real(i, wp) + 1.0_wp)]
      if (modulo(i, 4) == 0) m(1 + modulo(i, 3)) = 0.0_wp
      if (modulo(i, 12) == 0) m(1 + modulo(i + 1, 3)) = 0.0_wp
      s = sum(min(m, 0.0_wp)) + modulo(0.618_wp*real(i, wp), 1.0_wp)*sum(abs(m))
      call open_below(cut, m, s, share)
      exact = unit_volume(m, s) - product(edge)*unit_volume(m*edge, s - dot_product(m, from))
      call check(name//': open volume below a plane', share, exact, 1.0e-13_wp)
      call open_constant(cut, m, exact, c)
      call open_below(cut, m, c, share)
      call check(name//': plane of an open volume', share, exact, 1.0e-13_wp)
      d = 1 + modulo(i, 3)
      limit = modulo(0.381_wp*real(i, wp), 1.0_wp)
      call open_slab_below(cut, m, s, d, limit, share)
      exact = unit_slab(m, s, d, 1, limit)
      if (limit > from(d)) exact = exact - product(edge)* &
        unit_slab(m*edge, s - dot_product(m, from), d, 1, min((limit - from(d))/edge(d), 1.0_wp))
      call check(name//': open volume in a slab below a plane', share, exact, 1.0e-13_wp)
    end do
  end subroutine box_in_cell

  subroutine cell_without_open_part()
    type(solid_geometry_t) :: solid
    real(wp) :: c

    call set_box([0.0_wp, 0.0_wp, 0.0_wp], [1.0_wp, 1.0_wp, 1.0_wp], solid)
    call load_cut_cell(solid, 1, low, h, cut)
    call check('full cell has no open part', cut%open, 0.0_wp, 1.0e-13_wp)
    call open_constant(cut, [0.0_wp, 0.0_wp, 1.0_wp], 0.0_wp, c)
    call check('and still a plane', c >= 0.0_wp .and. c <= 1.0_wp)
    call load_cut_cell(solid, 0, low, h, cut)
    call check('no body, all open', cut%open, 1.0_wp)
  end subroutine cell_without_open_part

end module test_cut_cell_m
