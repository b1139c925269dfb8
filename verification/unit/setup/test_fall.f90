!> What is predicted of a fall: drag, shadow, terminal speed, the way to it, heights and speeds.
module test_fall_m
  use check_m, only: check
  use kinds_m, only: wp, pi
  use errors_m, only: problems_t
  use case_types_m, only: case_t
  use case_input_m, only: read_case
  use case_check_m, only: make_shapes
  use tet_mesh_m, only: shape_t
  use bed_m, only: bed_t
  use drops_m, only: place_of_block
  use fall_m, only: fall_t, find_fall, gravity_down, drag_coefficient, projected_area, &
    terminal_speed, fall_under_water
  implicit none
  private
  public :: test_fall

  real(wp), parameter :: g = 9.81_wp, water = 1000.0_wp
  character(*), parameter :: shapes_text = &
    '&shape name=''c'' kind=''cube'' size=1 density=2500/' &
    //'&shape name=''s'' kind=''sphere'' size=1 density=500/' &
    //'&shape name=''t'' kind=''tetrapod'' size=1/'

contains

  subroutine test_fall()
    call forms()
    call ways()
    call falls()
  end subroutine test_fall

  !> A case in a tank of 10 x 10 x 10 m that begins at z = -2 m, and its shapes.
  subroutine make(text, case, shapes)
    character(*), intent(in) :: text
    type(case_t), intent(out) :: case
    type(shape_t), allocatable, intent(inout) :: shapes(:)
    type(problems_t) :: problems

    call read_case('&run t_end=1 /&grid cells=3*10 length=3*10 origin=0,0,-2 /'//shapes_text &
      //text, case, problems)
    call make_shapes(case, shapes, problems)
    call check('case of a fall', problems%n, 0)
  end subroutine make

  !> Shadows and drag of forms that are known.
  subroutine forms()
    type(case_t) :: case
    type(shape_t), allocatable :: shapes(:)
    real(wp), parameter :: mean = (3.0_wp + 6*sqrt(2.0_wp) + 4*sqrt(3.0_wp))/13.0_wp

    call make('', case, shapes)
    call check('shadow of a cube', projected_area(shapes(1)), mean, 0.02_wp*mean)
    call check('shadow of a sphere', projected_area(shapes(2)), pi/4, 1.0e-15_wp)
    call check('drag of a sphere', drag_coefficient(shapes(2)), 0.42_wp, 1.0e-15_wp)
    ! the values of the sources in verification/cases/settling_units, there on the area of a sphere
    call check('drag of a cube', drag_coefficient(shapes(1))*1.23_wp, 0.92_wp, 0.01_wp)
    call check('drag of a tetrapod', drag_coefficient(shapes(3))*1.32_wp, 1.02_wp, 0.01_wp)
    call check('shadow of a tetrapod', projected_area(shapes(3)), &
      1.32_wp*pi/4*(6*shapes(3)%volume/pi)**(2.0_wp/3.0_wp), 0.03_wp)
    call check('balance at the terminal speed', 0.5_wp*water*0.3_wp &
      *terminal_speed(2.5_wp, 1.0_wp, 0.3_wp, g)**2, 1500*g, 1.0e-9_wp)
    call check('gravity down', gravity_down([0.0_wp, 0.0_wp, -g]), g, 0.0_wp)
    call check('gravity aside', gravity_down([0.1_wp, 0.0_wp, -g]), 0.0_wp, 0.0_wp)
    call check('gravity up', gravity_down([0.0_wp, 0.0_wp, g]), 0.0_wp, 0.0_wp)
  end subroutine forms

  !> The speed after a way is that of stepping the equation of motion.
  subroutine ways()
    type(case_t) :: case
    type(shape_t), allocatable :: shapes(:)
    real(wp), parameter :: dt = 1.0e-4_wp
    real(wp) :: v, z, before, start, half, pull
    integer :: i

    call make('', case, shapes)
    pull = 0.5_wp*water*drag_coefficient(shapes(1))*projected_area(shapes(1))
    do i = 0, 2
      start = 6.0_wp*i
      v = start
      z = 0.0_wp
      do while (z < 1.5_wp)
        before = v
        half = v + 0.5_wp*dt*acceleration(pull, v)
        v = v + dt*acceleration(pull, half)
        z = z + 0.5_wp*dt*(before + v)
      end do
      call check('speed after 1.5 m', under_water(shapes(1), start, 1.5_wp), v, &
        1.0e-3_wp)
    end do
    call check('no way', under_water(shapes(1), 3.0_wp, 0.0_wp), 3.0_wp, 1.0e-14_wp)
    call check('a long way', under_water(shapes(1), 30.0_wp, 1.0e3_wp), &
      terminal_speed(2.5_wp, 1.0_wp, 2*pull/water, g), 1.0e-12_wp)
  end subroutine ways

  !> Speed of a cube of 2500 kg/m3 after a way in water [m/s].
  function under_water(cube, start, way) result(speed)
    type(shape_t), intent(in) :: cube
    real(wp), intent(in) :: start, way   !! [m/s], [m]
    real(wp) :: speed

    speed = fall_under_water(2.5_wp, cube%volume, drag_coefficient(cube)*projected_area(cube), g, &
      start, way)
  end function under_water

  !> Of a cube of 2500 kg/m3 in water, with the added mass of a sphere [m/s2].
  pure function acceleration(pull, v) result(a)
    real(wp), intent(in) :: pull   !! of the water over the square of the speed [kg/m]
    real(wp), intent(in) :: v      !! [m/s]
    real(wp) :: a

    a = (1500*g - pull*v**2)/3000
  end function acceleration

  !> Heights, depth and speeds of drops in air, into water, in water, without floor or water.
  subroutine falls()
    type(case_t) :: case
    type(shape_t), allocatable :: shapes(:)
    type(fall_t) :: fall
    type(bed_t) :: bed

    call make('&fluid water_level=3 liquid_density=1000/ &drop shape=''c'' position=5,5,5.5 ' &
      //'velocity=1,0,-2/ &drop shape=''s'' position=5,5,5/ &drop shape=''c'' position=5,5,2/ ' &
      //'&drop shape=''c'' position=5,5,5.5 axis=1,0,0 angle_deg=45/', case, shapes)
    call find_fall(case, place_of_block(case%drop(1), 1), shapes(1), bed, fall)
    call check('lowest point', fall%bottom, 5.0_wp, 1.0e-14_wp)
    call check('floor', fall%floor, -2.0_wp, 0.0_wp)
    call check('level', fall%level, 3.0_wp, 0.0_wp)
    call check('at the surface', fall%at_surface, sqrt(4 + 4*g), 1.0e-14_wp)
    call check('at the floor', fall%at_floor, under_water(shapes(1), &
      fall%at_surface, 5.0_wp), 1.0e-14_wp)
    call find_fall(case, place_of_block(case%drop(2), 1), shapes(2), bed, fall)
    call check('a light one floats', fall%at_surface > 0.0_wp .and. fall%terminal < 0.0_wp &
      .and. fall%at_floor < 0.0_wp)
    call find_fall(case, place_of_block(case%drop(3), 1), shapes(1), bed, fall)
    call check('in the water at once', fall%at_surface, -1.0_wp, 0.0_wp)
    call check('from there to the floor', fall%at_floor, under_water(shapes(1), &
      0.0_wp, 3.5_wp), 1.0e-14_wp)
    call find_fall(case, place_of_block(case%drop(4), 1), shapes(1), bed, fall)
    call check('lowest edge', fall%bottom, 5.5_wp - sqrt(0.5_wp), 1.0e-14_wp)
    call make('&fluid water_level=3/ &boundary z_min=''open''/ &drop shape=''c'' ' &
      //'position=5,5,2/', case, shapes)
    call find_fall(case, place_of_block(case%drop(1), 1), shapes(1), bed, fall)
    call check('no floor', .not. fall%has_floor .and. fall%at_floor < 0.0_wp &
      .and. fall%terminal > 0.0_wp)
    call make('&fluid water_level=-5/ &drop shape=''c'' position=5,5,2/', case, shapes)
    call find_fall(case, place_of_block(case%drop(1), 1), shapes(1), bed, fall)
    call check('no water there', .not. fall%has_water)
    call check('free fall to the floor', fall%at_floor, sqrt(2*g*3.5_wp), 1.0e-14_wp)
  end subroutine falls

end module test_fall_m
