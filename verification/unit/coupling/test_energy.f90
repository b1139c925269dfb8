!> The book of energy: what a step makes is found, what a release puts in is not, when it is known.
module test_energy_m
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use check_m, only: check, wp
  use energy_m, only: energy_t, energy_parts_t, energy_init, put_in_energy, store_energy, &
    energy_excess
  use one_body_m, only: one_body_t, place, sides
  implicit none
  private
  public :: test_energy

  real(wp), parameter :: tolerance = 1.0e-12_wp
  character(*), parameter :: tank = '&grid cells=3*8 length=3*.8/ &shape name="b" kind="box" ' &
    //'size=3*.2/ '

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
    call put_in_energy(energy_parts_t(0.0_wp, 0.0_wp, m*g*z), book)
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
    call check('over that set free', energy_excess(book), book%excess/(m*g*(2.0_wp - z)), tolerance)
  end subroutine falling_liquid

  !> What a release brings is put in; what dissipates is not missed.
  subroutine release()
    type(energy_t) :: book

    book%known = .true.
    call put_in_energy(energy_parts_t(1.0_wp, 0.0_wp, 10.0_wp), book)
    call store_energy(energy_parts_t(0.5_wp, 0.25_wp, 10.0_wp), book)
    call put_in_energy(energy_parts_t(3.5_wp, 0.25_wp, 11.0_wp), book)
    call check('put in', book%put_in, 15.0_wp, tolerance)
    call store_energy(energy_parts_t(2.0_wp, 0.0_wp, 11.0_wp), book)
    call check('a loss is no excess', book%excess, -0.25_wp, tolerance)
    call check('set free', book%set_free, 4.0_wp, tolerance)
  end subroutine release

  !> Not where a side moves, lets a stream in, is open below or beside, where gravity drives a
  !! period, or a block is driven.
  subroutine when_it_is_known()
    character(*), parameter :: period = 'periodic periodic slip slip slip slip'

    call check('closed tank', knows(sides('slip slip slip slip slip slip')))
    call check('open top', knows(sides('slip slip slip slip slip open')))
    call check('open side', .not. knows(sides('open open slip slip slip slip')))
    call check('period across gravity', knows(sides(period)))
    call check('moving lid', .not. knows('&boundary z_max="no_slip" z_max_velocity=.1,0,0/ '))
    call check('surface tension', .not. knows('&fluid water_level=.1 surface_tension=.07/ '))
    call check('gravity along a period', .not. knows(sides(period)//'&fluid gravity=1,0,-9/ '))
  end subroutine when_it_is_known

  !> A tank of liquids of one density has no energy to set free: round-off is no excess.
  subroutine nothing_set_free()
    type(one_body_t) :: box
    type(energy_t) :: book
    real(wp), parameter :: weight = 0.8_wp**4*1000.0_wp*9.81_wp   !! times a height of the tank [J]

    call place(tank//'&fluid gas_density=1000 liquid_density=1000/ &body shape="b" fixed=T ' &
               //'position=3*.4/', box)
    call energy_init(box%case, box%grid, box%blocks, book)
    call put_in_energy(energy_parts_t(0.0_wp, 0.0_wp, weight), book)
    call store_energy(energy_parts_t(0.0_wp, 0.0_wp, weight), book)
    call store_energy(energy_parts_t(0.0_wp, 0.0_wp, weight*(1.0_wp + 1.0e-15_wp)), book)
    call check('round-off is no excess', energy_excess(book), 0.0_wp, 1.0e-12_wp)
  end subroutine nothing_set_free

  !> Is the energy of a tank with these groups known?
  logical function knows(groups)
    character(*), intent(in) :: groups
    type(one_body_t) :: box
    type(energy_t) :: book

    call place(tank//'&body shape="b" position=3*.4/ '//groups, box)
    call energy_init(box%case, box%grid, box%blocks, book)
    knows = .not. ieee_is_nan(energy_excess(book))
  end function knows

end module test_energy_m
