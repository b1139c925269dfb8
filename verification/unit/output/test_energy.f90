!> The book of energy: what a step makes is found, what a release puts in is not, when it is known.
module test_energy_m
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use kinds_m, only: wp
  use energy_m, only: energy_t, energy_parts_t, energy_init, begin_energy, store_energy, &
    store_release, energy_excess
  use one_body_m, only: one_body_t, describe, place
  use check_m, only: check
  implicit none
  private
  public :: test_energy

  character(8), parameter :: sides(2, 3) = 'slip'
  real(wp), parameter :: tolerance = 1.0e-12_wp

contains

  subroutine test_energy()
    call falling_liquid()
    call release()
    call when_it_is_known()
    call nothing_set_free()
  end subroutine test_energy

  !> Liquid that falls freely by the rule of the steps, places with the velocity of the start, makes
  !! nothing; what is added to it is found a step later, over the energy set free.
  subroutine falling_liquid()
    real(wp), parameter :: m = 3.0_wp, g = 9.81_wp, dt = 0.01_wp
    type(energy_t) :: book
    real(wp) :: z, v
    integer :: step

    book%known = .true.
    z = 2.0_wp
    v = 0.0_wp
    call begin_energy(energy_parts_t(0.0_wp, 0.0_wp, m*g*z), 0.0_wp, book)
    do step = 1, 50
      z = z + dt*v
      v = v - dt*g
      if (step == 49) v = v - 1.0_wp
      call store_energy(energy_parts_t(0.5_wp*m*v**2, 0.0_wp, m*g*z), book)
      if (step < 50) call check('free fall makes nothing', book%excess, 0.0_wp, tolerance*m*g)
    end do
    v = v + dt*g
    call check('a push is found', book%excess, &
               0.5_wp*m*(v**2 - (v + 1.0_wp)**2) - 0.5_wp*m*g*dt*1.0_wp, 1.0e-10_wp)
    call check('over what was set free', energy_excess(book), book%excess/(m*g*(2.0_wp - z)), &
               tolerance)
  end subroutine falling_liquid

  !> What a release brings is put in; what dissipates is not missed.
  subroutine release()
    type(energy_t) :: book

    book%known = .true.
    call begin_energy(energy_parts_t(1.0_wp, 0.0_wp, 10.0_wp), 0.0_wp, book)
    call store_energy(energy_parts_t(0.5_wp, 0.25_wp, 10.0_wp), book)
    call store_release(energy_parts_t(3.5_wp, 0.25_wp, 11.0_wp), book)
    call check('put in', book%put_in, 15.0_wp, tolerance)
    call store_energy(energy_parts_t(2.0_wp, 0.0_wp, 11.0_wp), book)
    call check('a loss is no excess', book%excess, -0.25_wp, tolerance)
    call check('set free', book%set_free, 4.0_wp, tolerance)
  end subroutine release

  !> Not where a side moves, lets a stream in, is open below or beside, where gravity drives a
  !! period, or a block is driven.
  subroutine when_it_is_known()
    type(one_body_t) :: fresh

    call check('closed tank', knows(fresh, 'slip', 'slip'))
    call check('open top', knows(fresh, 'slip', 'open'))
    call check('open side', .not. knows(fresh, 'open', 'slip'))
    call check('period across gravity', knows(fresh, 'periodic', 'slip'))
    fresh%case%boundary%velocity(1, 2, 3) = 0.1_wp
    call check('moving lid', .not. knows(fresh, 'slip', 'no_slip'))
    fresh%case%boundary%velocity = 0.0_wp
    fresh%case%fluid%surface_tension = 0.07_wp
    call check('surface tension', .not. knows(fresh, 'slip', 'slip'))
    fresh%case%fluid%surface_tension = 0.0_wp
    fresh%case%fluid%gravity = [1.0_wp, 0.0_wp, -9.0_wp]
    call check('gravity along a period', .not. knows(fresh, 'periodic', 'slip'))
  end subroutine when_it_is_known

  !> A tank of liquids of one density has no energy to set free: round-off is no excess.
  subroutine nothing_set_free()
    type(one_body_t) :: box
    type(energy_t) :: book
    real(wp), parameter :: weight = 0.8_wp**4*1000.0_wp*9.81_wp   !! times a height of the tank [J]

    call describe([8, 8, 8], [0.8_wp, 0.8_wp, 0.8_wp], sides, 'box', [0.2_wp, 0.2_wp, 0.2_wp], &
                  [0.4_wp, 0.4_wp, 0.4_wp], box%case)
    box%case%fluid%gas_density = box%case%fluid%liquid_density
    box%case%fluid%gravity = [0.0_wp, 0.0_wp, -9.81_wp]
    call place(box)
    box%blocks%fixed = .true.
    call energy_init(box%case, box%grid, box%blocks, book)
    call begin_energy(energy_parts_t(0.0_wp, 0.0_wp, weight), 0.0_wp, book)
    call store_energy(energy_parts_t(0.0_wp, 0.0_wp, weight), book)
    call store_energy(energy_parts_t(0.0_wp, 0.0_wp, weight*(1.0_wp + 1.0e-15_wp)), book)
    call check('round-off is no excess', energy_excess(book), 0.0_wp, 1.0e-12_wp)
  end subroutine nothing_set_free

  logical function knows(settings, x, top)
    type(one_body_t), intent(in) :: settings
    character(*), intent(in) :: x, top
    type(one_body_t) :: box
    type(energy_t) :: book
    character(8) :: kind(2, 3)

    kind = sides
    kind(:, 1) = x
    kind(2, 3) = top
    call describe([8, 8, 8], [0.8_wp, 0.8_wp, 0.8_wp], kind, 'box', [0.2_wp, 0.2_wp, 0.2_wp], &
                  [0.4_wp, 0.4_wp, 0.4_wp], box%case)
    box%case%fluid = settings%case%fluid
    box%case%boundary%velocity = settings%case%boundary%velocity
    call place(box)
    call energy_init(box%case, box%grid, box%blocks, book)
    knows = .not. ieee_is_nan(energy_excess(book))
  end function knows

end module test_energy_m
