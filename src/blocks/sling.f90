!> The sling of a crane that sets a block down: from the first touch on it holds the attitude of the
!! block, and lowers it until it is slack.
!!
!! It is a spring with a dashpot, from the block up to an end that goes down at the speed of
!! lowering; s is how much longer it is than at rest. It gives way by a share e of the smallest edge
!! d under the weight W, and works on the s of the end of the step, so that any step is stable:
!!
!! $$ T = k s + c \dot s \ge 0, \quad k = W/(e d), \quad c = 2 \sqrt{k M} . $$
module sling_m
  use kinds_m, only: wp
  use vectors_m, only: inverse3
  use rigid_body_m, only: blocks_t, release_body, lowering
  implicit none
  private
  public :: hang, hangs, pull_sling, let_off, slack_share

  real(wp), parameter :: gives_way = 0.01_wp     !! e [-]
  real(wp), parameter :: beyond = 0.1_wp         !! way of the end on below the block, over d [-]
  real(wp), parameter :: slack_share = 0.05_wp   !! of the weight: one that carries less is slack

contains

  !> Let a block that was moved down hang in its sling: it moves freely, but does not turn.
  pure subroutine hang(b, blocks)
    integer, intent(in) :: b
    type(blocks_t), intent(inout) :: blocks

    blocks%fixed(b) = .false.
    blocks%inverse_inertia(:, :, b) = 0.0_wp
    blocks%l(:, b) = 0.0_wp
    blocks%omega(:, b) = 0.0_wp
    blocks%goal(b) = blocks%x(3, b) + gives_way*blocks%shapes(blocks%shape(b))%smallest_edge
  end subroutine hang

  !> Does a block hang in its sling? Its end is known then.
  elemental logical function hangs(b, blocks)
    integer, intent(in) :: b
    type(blocks_t), intent(in) :: blocks

    hangs = blocks%status(b) == lowering .and. blocks%handling(b)%release == 'set_down' &
      .and. blocks%goal(b) > -huge(1.0_wp)
  end function hangs

  !> Lower the end of a sling by a step, and find its force in that step.
  pure subroutine pull_sling(weight, dt, b, blocks)
    real(wp), intent(in) :: weight   !! of the block, less what the water carries [N]
    real(wp), intent(in) :: dt       !! [s]
    integer, intent(in) :: b
    type(blocks_t), intent(inout) :: blocks
    real(wp) :: k, c, rate, stretch

    associate (m => blocks%mass(b) + blocks%added_mass(b), &
      down => blocks%handling(b)%lowering_speed)
      k = max(weight, 0.0_wp)/(gives_way*blocks%shapes(blocks%shape(b))%smallest_edge)
      c = 2*sqrt(k*m)
      stretch = blocks%goal(b) - blocks%x(3, b)
      rate = dt*weight/m - down - blocks%v(3, b)   ! of the stretch at the end without the sling
      blocks%sling(b) = max(0.0_wp, (k*stretch + (k*dt + c)*rate)/(1.0_wp + (k*dt + c)*dt/m))
      blocks%goal(b) = blocks%goal(b) - dt*down
    end associate
  end subroutine pull_sling

  !> Let a block off, with the velocity that it has, once its sling carries next to nothing and the
  !! end has gone on for a while below the block.
  pure subroutine let_off(weight, time, b, blocks)
    real(wp), intent(in) :: weight, time   !! as above [N], [s]
    integer, intent(in) :: b
    type(blocks_t), intent(inout) :: blocks

    associate (shape => blocks%shapes(blocks%shape(b)))
      if (.not. (blocks%sling(b) < slack_share*weight .and. blocks%goal(b) &
        < blocks%x(3, b) - beyond*shape%smallest_edge)) return
      blocks%sling(b) = 0.0_wp
      blocks%inverse_inertia(:, :, b) = inverse3(shape%inertia)
      blocks%given%v(:, b) = blocks%v(:, b)
    end associate
    call release_body(time, b, blocks)
  end subroutine let_off

end module sling_m
