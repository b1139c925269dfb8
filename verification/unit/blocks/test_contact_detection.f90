!> What touches now or soon, as a gap tells, for both contact models, and how stiff both are.
module test_contact_detection_m
  use check_m, only: check, wp, pi
  use counterparts_m, only: update_counterparts
  use contact_detection_m, only: detect_contacts
  use world_m, only: world_t, set_up, body
  implicit none
  private
  public :: test_contact_detection

  real(wp), parameter :: r = 0.05_wp                 !! of the balls [m]
  real(wp), parameter :: gap = 1.0e-6_wp             !! [m]
  real(wp), parameter :: fast = 1.0_wp               !! of an impact [m/s]
  real(wp), parameter :: contact_time = 2.0e-3_wp    !! of two balls: half a period [s]
  character(*), parameter :: models(2) = [character(7) :: 'spheres', 'surface']
  integer :: m

contains

  subroutine test_contact_detection()
    do m = 1, size(models)
      call check_frequency(trim(models(m)))
    end do
  end subroutine test_contact_detection

  !> A ball that falls on the floor swings with half a period of the contact time while it touches,
  !! and is known to do so shortly before; another that comes from above adds its own to it.
  subroutine check_frequency(model)
    character(*), intent(in) :: model
    real(wp), parameter :: once = (pi/contact_time)**2, ahead = 2*gap/fast
    type(world_t) :: world

    call set_up('&run t_end=1 physics="dry"/ &grid cells=3*2 length=3*1/ &contact model="'//model &
      //'" restitution=1 contact_time=2e-3/ &shape name="ball" kind="sphere" size=.1/ ' &
      //body('ball', [0.5_wp, 0.5_wp, r + gap], [0.0_wp, 0.0_wp, -fast]) &
      //body('ball', [0.5_wp, 0.5_wp, 0.7_wp]), world)
    associate (walls => world%walls, blocks => world%blocks, detected => world%contacts%detected)
      call update_counterparts(walls, [0.0_wp, 0.0_wp, -9.81_wp], blocks, detected%counterparts)
      call check(model//': the model', detected%exact .eqv. model == 'surface')
      call detect_contacts(walls, blocks, 0.0_wp, detected)
      call check(model//': nothing touches', detected%points%n + detected%soon%n, 0)
      call check(model//': and swings', detected%frequency2, 0.0_wp)
      call detect_contacts(walls, blocks, ahead, detected)
      call check(model//': but soon', all([detected%points%n, detected%soon%n] == [0, 1]))
      call check(model//': it will swing', detected%frequency2, once, 1.0e-6_wp*once)
      blocks%x(3, 1) = r - gap
      call detect_contacts(walls, blocks, ahead, detected)
      call check(model//': touches', all([detected%points%n, detected%soon%n] == [1, 0]))
      call check(model//': swings', detected%frequency2, once, 1.0e-4_wp*once)
      blocks%x(3, 2) = 3*r
      blocks%v(3, 2) = -fast
      blocks%v(3, 1) = fast
      call detect_contacts(walls, blocks, ahead, detected)
      call check(model//': one more soon', all([detected%points%n, detected%soon%n] == [1, 1]))
      call check(model//': with both', detected%response%frequency2(1), 2*once, 1.0e-4_wp*once)
    end associate
  end subroutine check_frequency

end module test_contact_detection_m
