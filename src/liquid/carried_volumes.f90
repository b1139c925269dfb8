!> Liquid and open volume while they move, and what goes through the faces.
!!
!! The liquid W and the open volume Vt of the cells run from sweep to sweep; momentum rides on the
!! volumes through the faces.
module carried_volumes_m
  use kinds_m, only: wp
  use grid_m, only: grid_t
  implicit none
  private
  public :: carried_volumes_t, carried_volumes_init, share_of

  type :: carried_volumes_t
    !> Volumes through the lower faces in a part of the step, all and liquid, positive along the
    !! axis; faces lo..hi+1 [m3]. Those of small donors are zero during the sweeps and stand there
    !! after the small cells have given.
    real(wp), allocatable :: q(:, :, :, :), g(:, :, :, :)
    !> Running liquid and open volume, after and before the last sweep or the small cells; the halo
    !! of the open volume is filled [m3].
    real(wp), allocatable :: w(:, :, :), v(:, :, :), w_before(:, :, :), v_before(:, :, :)
    real(wp), allocatable :: c(:, :, :)       !! running C^, for normals; halo filled
  end type carried_volumes_t

contains

  !> Allocate, nothing in the cells.
  subroutine carried_volumes_init(grid, self)
    type(grid_t), intent(in) :: grid
    type(carried_volumes_t), intent(out) :: self
    integer :: a(3), b(3)

    a = grid%first
    b = grid%last
    allocate (self%q(a(1):b(1), a(2):b(2), a(3):b(3), 3), source=0.0_wp)
    allocate (self%g, source=self%q)
    allocate (self%w(a(1):b(1), a(2):b(2), a(3):b(3)), source=0.0_wp)
    allocate (self%v, self%w_before, self%v_before, self%c, source=self%w)
  end subroutine carried_volumes_init

  !> Liquid share of a volume, within 0 and 1.
  elemental function share_of(w, v) result(share)
    real(wp), intent(in) :: w, v
    real(wp) :: share

    share = min(max(w/merge(v, 1.0_wp, v > 0.0_wp), 0.0_wp), 1.0_wp)
  end function share_of

end module carried_volumes_m
