!> Film cells above a box that moves: which components its faces and its wall set, which are left
!! alone, and how those that are set slip along the wall.
program test_film_velocity
  use kinds_m, only: wp
  use grid_m, only: n_halo
  use film_velocity_m, only: films_t, films_init, note_films, shift_films, tie_films
  use rigid_motion_m, only: wall_velocity
  use one_body_m, only: one_body_t, describe, place, random_numbers
  use check_m, only: check, finish_checks
  implicit none
  character(8), parameter :: sides(2, 3) = 'slip'
  integer, parameter :: cells(3) = [8, 8, 6]
  real(wp), parameter :: tank(3) = [0.8_wp, 0.8_wp, 0.6_wp]         !! cells of 0.1 m
  real(wp), parameter :: edges(3) = [0.36_wp, 0.36_wp, 0.37_wp]     !! of the box [m]
  real(wp), parameter :: middle(3) = [0.39_wp, 0.40_wp, 0.185_wp]   !! x 0.21-0.57, y 0.22-0.58
  integer, parameter :: top = 4                                     !! open share 0.3 above the box
  real(wp), parameter :: motion(6) = [0.3_wp, -0.5_wp, 0.4_wp, 2.0_wp, -1.0_wp, 3.0_wp]
    !! of the box [m/s, rad/s]
  type(one_body_t) :: box
  real(wp), dimension(1 - n_halo:cells(1) + n_halo, 1 - n_halo:cells(2) + n_halo, &
                      1 - n_halo:cells(3) + n_halo, 3) :: mass, uf, u, before, change
  type(films_t) :: films
  real(wp) :: faces(2)
  integer :: seed = 77

  call describe(cells, tank, sides, 'box', edges, middle, box%case)
  call place(box)
  call fill(uf)
  call fill(u)
  before = u
  mass = 1.0_wp
  mass(4, 4, top, 2) = 0.0_wp
  box%bodies%motion(:, 1) = motion
  call tie_films(box%grid, box%solid, box%bodies, mass, uf, u, change)
  call check('the cells in the top layer are films', all(box%solid%inside(3:6, 3:6, top) == 1))
  call check('the normal component lies half way to the open face', u(4, 5, top, 3), &
             0.5_wp*(uf(4, 5, top + 1, 3) + wall(4, 5, 3)), 1.0e-14_wp)
  call check('between films the tangential component stays', &
             maxval(abs(u(4:5, 3:6, top, 1) - before(4:5, 3:6, top, 1))), 0.0_wp, 0.0_wp)
  faces = (0.3_wp*[uf(6, 4, top, 1), uf(6, 4, top, 3)] &
           + [uf(7, 4, top, 1), uf(6, 4, top + 1, 3)])/1.3_wp
  call check('at the edge it is the mean by open shares, normal to the edge half way', &
             u(6, 4, top, 1), faces(1) + 0.25_wp*(wall(6, 4, 1) + wall(6, 4, 3) - sum(faces)), &
             1.0e-14_wp)
  call check('components that move with the wall stay', u(4, 4, top, 2), before(4, 4, top, 2), &
             0.0_wp)
  call check('the change is told', maxval(abs(u - before - change)), 0.0_wp, 1.0e-14_wp)
  change(3:6, 3:6, 1:top, :) = 0.0_wp
  call check('cells outside the box stay', maxval(abs(change)), 0.0_wp, 0.0_wp)

  call films_init(films)
  call note_films(box%grid, box%solid, box%bodies, u, films)
  before = u
  call shift_films(box%grid, box%solid, films, -1.0_wp, u)
  call check('without its slip a film moves with the wall', &
             [u(4, 5, top, 3), u(6, 4, top, 1), u(6, 4, top, 3)], &
             [wall(4, 5, 3), wall(6, 4, 1), wall(6, 4, 3)], 1.0e-14_wp)
  call check('what a film does by itself is no slip', &
             maxval(abs(u(4:5, 3:6, top, 1) - before(4:5, 3:6, top, 1))), 0.0_wp, 0.0_wp)
  box%solid%inside(6, 4, top) = 0
  call shift_films(box%grid, box%solid, films, 1.0_wp, u)
  call check('a cell that the box has left has none', u(6, 4, top, 1), wall(6, 4, 1), 1.0e-14_wp)
  u(6, 4, top, :) = before(6, 4, top, :)
  call check('the slip comes back', maxval(abs(u - before)), 0.0_wp, 1.0e-14_wp)
  call finish_checks()

contains

  !> Component d of the velocity of the box at the centre of a cell of the top layer [m/s].
  function wall(i, j, d) result(velocity)
    integer, intent(in) :: i, j, d
    real(wp) :: velocity, v(3)

    v = wall_velocity(motion, 0.1_wp*([i, j, top] - 0.5_wp) - middle)
    velocity = v(d)
  end function wall

  !> Numbers between -1 and 1.
  subroutine fill(a)
    real(wp), intent(out) :: a(:, :, :, :)
    integer :: j, k, d

    do d = 1, 3
      do k = 1, size(a, 3)
        do j = 1, size(a, 2)
          call random_numbers(seed, a(:, j, k, d))
        end do
      end do
    end do
  end subroutine fill
end program test_film_velocity
