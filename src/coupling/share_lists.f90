!> Lists of what one body fills: cells, faces, and where grid lines meet its surface.
module share_lists_m
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use share_moments_m, only: along, up
  implicit none
  private
  public :: body_shares_t, add_cell, add_face, add_hit, start_lists, full_cell, full_face

  real(wp), parameter :: full_cell = 1.0e-12_wp       !! a cell lacking less is full
  real(wp), parameter :: full_face = 1.0e-9_wp        !! a face lacking less is closed

  !> What is known of one body. Cell i of these lists is cell `base + i` of the grid.
  type :: body_shares_t
    logical :: known = .false.                 !! the lists belong to the pose x, q
    real(wp) :: x(3) = 0.0_wp, q(4) = 0.0_wp
    integer :: base(3) = 0
    integer :: low(3) = 0, high(3) = 0         !! cells of the box around the body
    real(wp), allocatable :: corner(:, :, :)   !! (3, 4, tets) of the parts for the flow [cells]
    integer :: n_cell = 0
    integer, allocatable :: cell(:, :)         !! (3, *)
    logical, allocatable :: inside(:)          !! the body holds the centre of the cell
    real(wp), allocatable :: alpha(:)          !! share of the cell [-]
    real(wp), allocatable :: centroid(:, :)    !! (3, *) of the part, from the cell's corner [cells]
    !> Tetrahedra that may touch cell m, if it is cut: `tet(first_tet(m):first_tet(m+1)-1)`.
    integer, allocatable :: first_tet(:), tet(:)
    integer :: n_face = 0
    integer, allocatable :: face(:, :)         !! (4, *) cell and direction of its lower face
    real(wp), allocatable :: beta(:)           !! share of the face [-]
    real(wp), allocatable :: face_centroid(:, :)   !! (3, *) likewise
    integer :: n_hit = 0
    integer, allocatable :: hit(:, :)          !! (4, *) link: cell and direction of the lower face
    real(wp), allocatable :: at(:)             !! (*) place on the link, 0: lower centre, 1: upper
  end type body_shares_t

contains

  !> Lists that exist, also where a body has no cell, no face or no hit.
  subroutine start_lists(self)
    type(body_shares_t), intent(inout) :: self

    call ensure_capacity(1, self%cell)
    call ensure_capacity(1, self%inside)
    call ensure_capacity(1, self%alpha)
    call ensure_capacity(1, self%centroid)
    call ensure_capacity(1, self%face, rows=4)
    call ensure_capacity(1, self%beta)
    call ensure_capacity(1, self%face_centroid)
    call ensure_capacity(1, self%hit, rows=4)
    call ensure_capacity(1, self%at)
  end subroutine start_lists

  !> Append a cell.
  subroutine add_cell(cell, moment, inside, self)
    integer, intent(in) :: cell(3)
    real(wp), intent(in) :: moment(4)   !! volume, first moment
    logical, intent(in) :: inside
    type(body_shares_t), intent(inout) :: self
    integer :: n

    n = self%n_cell + 1
    self%n_cell = n
    call ensure_capacity(n, self%cell)
    call ensure_capacity(n, self%inside)
    call ensure_capacity(n, self%alpha)
    call ensure_capacity(n, self%centroid)
    self%cell(:, n) = cell
    self%inside(n) = inside
    if (moment(1) > 1.0_wp - full_cell) then
      self%alpha(n) = 1.0_wp
      self%centroid(:, n) = 0.5_wp
    else
      self%alpha(n) = moment(1)
      self%centroid(:, n) = min(max(moment(2:4)/moment(1), 0.0_wp), 1.0_wp)
    end if
  end subroutine add_cell

  !> Append a face.
  subroutine add_face(face, moment, self)
    integer, intent(in) :: face(4)
    real(wp), intent(in) :: moment(3)   !! area, first moments along and up the columns
    type(body_shares_t), intent(inout) :: self
    integer :: n, d

    n = self%n_face + 1
    self%n_face = n
    call ensure_capacity(n, self%face, rows=4)
    call ensure_capacity(n, self%beta)
    call ensure_capacity(n, self%face_centroid)
    self%face(:, n) = face
    d = face(4)
    self%face_centroid(d, n) = 0.0_wp
    if (moment(1) > 1.0_wp - full_face) then
      self%beta(n) = 1.0_wp
      self%face_centroid([along(d), up(d)], n) = 0.5_wp
    else
      self%beta(n) = moment(1)
      self%face_centroid([along(d), up(d)], n) = min(max(moment(2:3)/moment(1), 0.0_wp), 1.0_wp)
    end if
  end subroutine add_face

  !> Append a hit.
  subroutine add_hit(link, at, self)
    integer, intent(in) :: link(4)
    real(wp), intent(in) :: at          !! 0 < at <= 1
    type(body_shares_t), intent(inout) :: self
    integer :: n

    n = self%n_hit + 1
    self%n_hit = n
    call ensure_capacity(n, self%hit, rows=4)
    call ensure_capacity(n, self%at)
    self%hit(:, n) = link
    self%at(n) = at
  end subroutine add_hit

end module share_lists_m
