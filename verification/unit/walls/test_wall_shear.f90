!> Stress of the rough layer: the logarithmic law, where it acts, what it leaves alone.
module test_wall_shear_m
  use check_m, only: check, wp
  use wall_plane_m, only: distance_of_links
  use wall_layer_m, only: find_wall_speeds, rough_viscosity
  use viscous_links_m, only: build_viscous
  use viscous_system_m, only: viscous_t, viscous_init
  use merged_cells_m, only: merged_cells_t
  use rigid_motion_m, only: wall_velocity
  use one_body_m, only: one_body_t, place, slip
  implicit none
  private
  public :: test_wall_shear

  character(*), parameter :: tank = '&grid cells=3*10 length=3*1/ '//slip
  real(wp), parameter :: h = 0.1_wp
  real(wp), parameter :: middle(3) = [0.39_wp, 0.35_wp, 0.45_wp]   !! of the box [m]
  real(wp), parameter :: motion(6) = [0.3_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.5_wp]
    !! of the box [m/s, rad/s]
  real(wp), parameter :: stream(3) = [1.1_wp, 0.4_wp, -0.2_wp]     !! [m/s]
  real(wp), parameter :: thin = 1.0e-3_wp, thick = 1.0e3_wp        !! [Pa s]
  integer, parameter :: beside(3) = [7, 4, 5]                      !! its centre .8 h from the wall
  type(one_body_t) :: box
  type(merged_cells_t) :: merged
  real(wp), allocatable :: speed(:)
  real(wp) :: rho
  integer :: d

contains

  subroutine test_wall_shear()
    call place(tank//'&shape name="b" kind="box" size=.36,.46,.46/ &body shape="b" ' &
      //'position=.39,.35,.45 velocity=.3,0,0 angular_velocity=0,0,.5/', box, merged)   ! x .21-.57
    rho = box%case%fluid%liquid_density
    do d = 1, 3
      box%flow%u(:, :, :, d) = stream(d)
    end do
    merged%centre = 1.0_wp
    call find_wall_speeds(box%grid, box%solid, box%bodies, box%flow%u, merged)
    speed = merged%wall_speed
    call law()
    call at_one_wall()
    call what_is_left_alone()
    call across_an_oblique_wall()
  end subroutine test_wall_shear

  !> tau = rho (u/U+)^2 with U+ = ln(1 + 30 y/k_s)/0.41, k_s = 2 h: at half a cell .0367 rho u^2.
  subroutine law()
    real(wp) :: tau

    tau = rough_viscosity(rho, 2.0_wp, 0.5_wp*h, h)*2.0_wp/(0.5_wp*h)
    call check('stress at half a cell', tau, 0.0367_wp*rho*4.0_wp, 1.0e-4_wp*rho*4.0_wp)
    call check('twice as fast, four times the stress', &
      rough_viscosity(rho, 4.0_wp, 0.5_wp*h, h)*4.0_wp/(0.5_wp*h), 4.0_wp*tau, 1.0e-12_wp*tau)
    call check('farther off it pulls less', rough_viscosity(rho, 2.0_wp, h, h)*2.0_wp/h < tau)
    call check('the cell Reynolds number at which it begins', &
               rough_viscosity(rho, 1.0_wp, 0.5_wp*h, h)/(rho*h), 1.0_wp/54.5_wp, 1.0e-4_wp)
  end subroutine law

  !> The link of a cell beside one wall, pulled as the cell runs past that wall.
  subroutine at_one_wall()
    real(wp) :: past, y

    past = norm2(stream - wall_velocity(motion, (beside - 0.5_wp)*h - middle))
    y = distance_of_links(box%grid, box%solid, beside)
    call check('distance from one wall', y, 0.08_wp, 1.0e-12_wp)
    call check('a cell without walls', distance_of_links(box%grid, box%solid, [9, 9, 9]) > 1.0e9_wp)
    call check('pull of the link', link_of(beside, thin, speed), &
               rough_viscosity(rho, past, y, h)*h/0.8_wp, 1.0e-9_wp)
    merged%centre = 0.5_wp
    call check('by the velocity at the centre', link_of(beside, thin, speed), &
               0.5_wp*rough_viscosity(rho, past, y, h)*h/0.8_wp, 1.0e-9_wp)
    merged%centre = 1.0_wp
  end subroutine at_one_wall

  !> Without viscosity, where the grid is fine enough, with the block: to the bit.
  subroutine what_is_left_alone()
    real(wp), allocatable :: none(:)

    call check('no viscosity, no stress', link_of(beside, 0.0_wp, speed), 0.0_wp)
    call check('a resolved layer', link_of(beside, thick, speed), link_of(beside, thick))
    call check('one that is not', link_of(beside, thin, speed) > 10.0_wp*link_of(beside, thin))
    do d = 1, 3
      box%flow%u(:, :, :, d) = motion(d)
    end do
    box%bodies%motion(6, 1) = 0.0_wp
    call find_wall_speeds(box%grid, box%solid, box%bodies, box%flow%u, merged)
    none = merged%wall_speed
    call check('fluid that moves with the block', maxval(none(:2*box%solid%n_link)), 0.0_wp)
    call check('its link', link_of(beside, thin, none), link_of(beside, thin))
  end subroutine what_is_left_alone

  !> A cube of 0.5 m turned by 30 degrees about z: its wall lies at n.x = 0.25 from its middle.
  subroutine across_an_oblique_wall()
    real(wp), parameter :: cos_30 = sqrt(0.75_wp)
    integer, parameter :: beside_wall(3) = [8, 7, 5]   !! 0.25 and 0.15 m from the middle
    type(one_body_t) :: cube

    call place(tank//'&shape name="c" kind="cube" size=.5/ &body shape="c" position=3*.5 ' &
               //'axis=0,0,1 angle_deg=30/', cube)
    call check('distance from an oblique wall', distance_of_links(cube%grid, &
      cube%solid, beside_wall), 0.25_wp*cos_30 + 0.15_wp*0.5_wp - 0.25_wp, 1.0e-12_wp)
  end subroutine across_an_oblique_wall

  !> Conductance of the one wall link of a cell [kg/s].
  real(wp) function link_of(c, mu, wall_speed)
    integer, intent(in) :: c(3)
    real(wp), intent(in) :: mu   !! of the fluid [Pa s]
    real(wp), intent(in), optional :: wall_speed(:)
    type(viscous_t) :: viscous
    integer :: m

    box%flow%mu = mu
    merged%wall_speed = 0.0_wp
    if (present(wall_speed)) merged%wall_speed = wall_speed
    call viscous_init(box%grid, 1, viscous)
    call build_viscous(box%grid, box%solid, box%bodies, box%flow%rho, box%flow%mu, 0.01_wp, &
                       viscous, merged)
    link_of = 0.0_wp
    do m = 1, viscous%walls%n
      if (all(viscous%walls%cell(:, m) == c)) link_of = link_of + viscous%walls%k(m)
    end do
  end function link_of

end module test_wall_shear_m
