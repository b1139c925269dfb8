!> One body in the grid by itself: shares, links, tetrahedra of cut cells, counted shares.
module test_body_shares_m
  use check_m, only: check, wp
  use vectors_m, only: quaternion_from_axis
  use polyhedron_m, only: box_clip_moments_below
  use share_lists_m, only: body_shares_t
  use share_row_m, only: share_row_t
  use body_shares_m, only: find_body_shares
  use cut_tets_m, only: cut_tets_t, list_cut_tets, faces_of_tet
  use subcell_shares_m, only: subcell_work_t, count_subcells
  use one_body_m, only: one_body_t, place, slip, body_at => body
  implicit none
  private
  public :: test_body_shares

  character(*), parameter :: tank = '&grid cells=14,15,13 length=.07,.09,.065/ '//slip
  real(wp), parameter :: position(3) = [0.0341_wp, 0.0437_wp, 0.0329_wp]
  type(one_body_t) :: block
  type(share_row_t) :: row
  type(cut_tets_t) :: tets
  type(body_shares_t) :: body
  logical :: changed

contains

  subroutine test_body_shares()
    call faces_look_outward()
    call hexapod()
    call box_on_the_grid()
  end subroutine test_body_shares

  !> Corners lie on the inner side of all faces, also of a tetrahedron turned inside out.
  subroutine faces_look_outward()
    real(wp), parameter :: corner(3, 4) = 0.1_wp*reshape([1, 2, 0, 14, 1, 3, 2, 11, 2, 3, 4, 17], &
      [3, 4])
    real(wp) :: n(3, 4), d(4), middle(3), x(3, 4)
    integer :: s, f

    do s = 1, 2
      x = corner
      if (s == 2) x = corner(:, [2, 1, 3, 4])
      call faces_of_tet(x, n, d)
      middle = sum(x, 2)/4.0_wp
      call check('the middle is inside', all(matmul(middle, n) < d))
      call check('corners are on the faces', all(matmul(transpose(x), n) <= spread(d, 1, 4)))
      do f = 1, 4
        call check('a mirrored corner is outside', dot_product(2.0_wp*(sum(x, 2) - x(:, f))/3.0_wp &
                                                               - x(:, f), n(:, f)) > d(f))
      end do
    end do
  end subroutine faces_look_outward

  !> Volume, centroid and the tetrahedra of each cut cell; nothing is done twice.
  subroutine hexapod()
    real(wp) :: volume, first(3)
    integer :: m

    call place(tank//'&shape name="h" kind="hexapod" size=.02/ '//body_at('h', position, &
               q=quaternion_from_axis([1.0_wp, 2.0_wp, 3.0_wp], 0.7_wp)), block)
    associate (grid => block%grid, shape => block%blocks%shapes(1), q => block%blocks%q(:, 1))
      call find_body_shares(grid, shape, position, q, row, body, changed)
      call check('found', changed)
      call list_cut_tets(tets, body)
      volume = sum(body%alpha(:body%n_cell))*grid%volume
      first = 0.0_wp
      do m = 1, body%n_cell
        first = first + body%alpha(m)*grid%volume*(grid%origin + grid%h &
          *(body%base + body%cell(:, m) - 1 + body%centroid(:, m)))
      end do
      call check('volume', volume, shape%volume, 1.0e-13_wp*shape%volume)
      call check('centroid', first/volume, position, 1.0e-14_wp)
      call check('cut cells by their tetrahedra', worst_cell(), 0.0_wp, 1.0e-12_wp)
      call check('links end in pairs', modulo(body%n_hit, 2), 0)
      call find_body_shares(grid, shape, position, q, row, body, changed)
      call check('known already', .not. changed)
      call find_body_shares(grid, shape, position + [0.0_wp, 0.0_wp, 1.0e-6_wp], q, row, body, &
                            changed)
      call check('it has moved', changed)
    end associate
  end subroutine hexapod

  !> Largest difference between the share of a cut cell and what its tetrahedra fill of it.
  real(wp) function worst_cell() result(worst)
    real(wp) :: share, part, moment(3), low(3)
    integer :: m, t

    worst = 0.0_wp
    do m = 1, body%n_cell
      if (body%alpha(m) >= 1.0_wp) cycle
      low = real(body%cell(:, m) - 1, wp)
      share = 0.0_wp
      do t = body%first_tet(m), body%first_tet(m + 1) - 1
        call box_clip_moments_below(body%corner(:, :, body%tet(t)), low, low + 1.0_wp, &
                                    [0.0_wp, 0.0_wp, 1.0_wp], 1.0e3_wp, part, moment)
        share = share + part
      end do
      worst = max(worst, abs(share - body%alpha(m)))
    end do
  end function worst_cell

  !> A box of 4 x 3 x 3 cells: full cells, closed faces, two hits on each link; counted likewise.
  subroutine box_on_the_grid()
    type(subcell_work_t) :: work
    real(wp) :: beta
    integer :: n_face

    body = body_shares_t()
    call place(tank//'&shape name="b" kind="box" size=.02,.018,.015/ &body shape="b" ' &
               //'position=.03,.039,.0325/', block)
    call find_body_shares(block%grid, block%blocks%shapes(1), block%blocks%x(:, 1), &
                          block%blocks%q(:, 1), row, body, changed)
    call list_cut_tets(tets, body)
    call check('full cells', body%n_cell == 36 .and. all(body%alpha(:body%n_cell) >= 1.0_wp))
    call check('all hold their centres', all(body%inside(:body%n_cell)))
    n_face = 5*3*3 + 4*4*3 + 4*3*4
    beta = minval(body%beta(:body%n_face))
    call check('closed faces', body%n_face == n_face .and. beta >= 1.0_wp)
    call check('two hits on each link', body%n_hit, 2*(3*3 + 4*3 + 4*3))
    call check('half way between', body%at(:body%n_hit), spread(0.5_wp, 1, body%n_hit), 1.0e-12_wp)
    call check('no cell is cut', body%first_tet(body%n_cell + 1), 1)
    call count_subcells(3, work, body)
    call check('counted: the same cells', body%n_cell == 36 .and. all(body%alpha(:36) >= 1.0_wp))
    call check('counted: the same faces', body%n_face, n_face)
  end subroutine box_on_the_grid

end module test_body_shares_m
