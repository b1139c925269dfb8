!> Fluid that moves along in an impact: of what is displaced, limited, and none at rest.
module test_added_mass_m
  use check_m, only: check, wp
  use added_mass_m, only: update_added_mass
  use one_body_m, only: one_body_t, place, slip
  implicit none
  private
  public :: test_added_mass

  type(one_body_t) :: block
  real(wp) :: displaced, weight

contains

  subroutine test_added_mass()
    call place('&grid cells=3*12 length=3*.12/ &shape name="h" kind="hexapod" size=.02 ' &
               //'density=2500/ &body shape="h" position=3*.06/ '//slip, block)
    displaced = block%case%fluid%liquid_density*block%bodies%volume(1)
    weight = block%blocks%mass(1)*norm2(block%case%fluid%gravity)

    call push('a free body', 0.0_wp, 0.803_wp*displaced)
    call push('a resting body', 2.9_wp, 0.0_wp)
    call push('a body on a film of liquid', 2.9_wp, 0.803_wp*displaced, touched=0)
    call push('an impact', 3.1_wp, 0.803_wp*displaced)
    block%blocks%mass = 0.5_wp*block%blocks%mass
    weight = 0.5_wp*weight
    call push('a light body', 3.1_wp, 0.35_wp*block%blocks%mass(1), clips=1)
    block%flow%c = 0.0_wp
    call push('in air', 0.0_wp, 0.803_wp*block%case%fluid%gas_density*block%bodies%volume(1))
    block%blocks%present = .false.
    call push('before its release', 0.0_wp, 0.0_wp)
  end subroutine test_added_mass

  !> Added mass of a body under a contact force of some weights.
  subroutine push(name, weights, expected, touched, clips)
    character(*), intent(in) :: name
    real(wp), intent(in) :: weights, expected   !! [-], [kg]
    integer, intent(in), optional :: touched    !! counterparts, default: one under a force
    integer, intent(in), optional :: clips      !! bodies whose added mass is cut, default: none
    integer :: n_clipped, n

    block%blocks%contacts = merge(1, 0, weights > 0.0_wp)
    if (present(touched)) block%blocks%contacts = touched
    block%blocks%contact_force(:, 1) = weights*weight*[0.6_wp, 0.0_wp, 0.8_wp]
    call update_added_mass(block%grid, block%case%fluid, block%solid, block%bodies, block%flow%c, &
                         block%blocks, n_clipped)
    n = 0
    if (present(clips)) n = clips
    call check(name//': cut at the limit', n_clipped, n)
    call check(name, block%blocks%added_mass(1), expected, 1.0e-12_wp*displaced)
  end subroutine push

end module test_added_mass_m
