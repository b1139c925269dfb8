!> A block in the sling of a crane: how it goes down, what the sling carries, when it lets go.
module test_sling_m
  use kinds_m, only: wp
  use check_m, only: check
  use errors_m, only: to_text
  use rigid_body_m, only: release_body, let_go
  use sling_m, only: hang, hangs, let_off
  use world_m, only: world_t, set_up, move, run
  implicit none
  private
  public :: test_sling

contains

  !> It goes down at the speed of lowering with the weight in the sling and does not turn, at any
  !! step, or comes back; set on an edge it comes to lie flat, slack lets go of it at rest.
  subroutine test_sling()
    real(wp), parameter :: g = 9.81_wp, down = 0.1_wp, dt(3) = [1.0e-4_wp, 2.0e-3_wp, 0.05_wp], &
      hung = cos(acos(-1.0_wp)/36)   ! tilted by 10 degrees
    type(world_t) :: world
    real(wp) :: weight
    integer :: i, k

    do i = 1, 3
      call set_up('&run t_end=1 physics="dry"/ &grid cells=3*2 length=3*1/ &shape name="cube" ' &
        //'kind="cube" size=.1/ &drop shape="cube" position=.5,.5,.3 lowering_speed=1 ' &
        //'release="set_down" axis=1,1,0 angle_deg=10/', world)
      associate (blocks => world%blocks)
        weight = blocks%mass(1)*g
        call release_body(0.0_wp, 1, blocks)
        call check('moved down at first', blocks%fixed(1) .and. .not. hangs(1, blocks))
        call hang(1, blocks)
        call move(world, nint(1.0_wp/dt(i)), dt(i))
        call check('speed, steps of '//to_text(dt(i)), blocks%v(3, 1), -down, 1.0e-3_wp)
        call check('the sling carries it', blocks%sling(1), weight, 0.01_wp*weight)
        call check('told as contact', blocks%contact_force(3, 1), weight, 0.01_wp*weight)
        call check('as it hung', blocks%q(1, 1), hung, 1.0e-9_wp)
        blocks%omega(:, 1) = [3.0_wp, 0.0_wp, 0.0_wp]   ! turns it by .9 rad if nothing holds it
        call move(world, nint(0.3_wp/dt(i)), dt(i))
        call check('as it hung again', blocks%q(1, 1), hung, 1.0e-3_wp)
        call let_off(weight, 0.5_wp, 1, blocks)
        call check('not slack', hangs(1, blocks))
        do k = 1, nint(3.0_wp/dt(i))
          call move(world, 1, dt(i))
          call let_off(weight, 2.0_wp, 1, blocks)
          if (.not. hangs(1, blocks)) exit
        end do
        call check('let go', blocks%status(1), let_go)
        call check('at rest', norm2(blocks%v(:, 1)) < 0.01_wp)
        call check('flat', blocks%q(1, 1), 1.0_wp, 1.0e-5_wp)
      end associate
    end do
    call on_a_swivel('dry', .true., 1.0_wp)
    call on_a_swivel('dry', .false., 0.0_wp)
    call on_a_swivel('coupled', .false., 0.0_wp)
  end subroutine test_sling

  !> What is left, after .5 s, of a spin of 1 rad/s about the vertical; the tilt comes back.
  subroutine on_a_swivel(physics, swivel, left)
    character(*), intent(in) :: physics
    logical, intent(in) :: swivel
    real(wp), intent(in) :: left
    type(world_t) :: world

    call set_up('&run t_end=1 dt=1e-2 cfl_max=0 physics="'//physics//'"/ &grid cells=3*8 ' &
      //'length=3*1/ &fluid single_phase=T/ &shape name="box" kind="box" size=.1,.2,.15/ ' &
      //'&drop shape="box" position=.5,.5,.7 lowering_speed=.1 release="set_down" swivel=' &
      //merge('T', 'F', swivel)//' axis=1,1,0 angle_deg=10/', world)
    associate (blocks => world%blocks)
      call release_body(0.0_wp, 1, blocks)
      call hang(1, blocks)
      blocks%q(:, 1) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]
      blocks%omega(:, 1) = [0.0_wp, 0.0_wp, 1.0_wp]
      call run(world, 50)
      call check('spin about the vertical', blocks%omega(3, 1), left, 0.05_wp)
      call check('tilt, '//physics, sum(blocks%q(2:3, 1)**2), sin(acos(-1.0_wp)/36)**2, 5.0e-4_wp)
    end associate
  end subroutine on_a_swivel

end module test_sling_m
