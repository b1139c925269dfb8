!> The sling of a crane that sets a block down: close above what lies below, the crane slows down,
!! and lowers the block until the sling is slack. The less the sling carries, the less it holds the
!! block as it hung; so the block comes to lie on what is below, and is caught where it slips.
!!
!! It is a spring with a dashpot, from the block up to an end that goes down slowly while the sling
!! carries something; s is how much longer it is than at rest. It gives way by a share e of the
!! smallest edge d under the weight W. Its force T acts at the radius a of the block above the
!! centre, along the body axis u that pointed up (z) when the block began to hang. Force and torque
!! are those of the end of the step, so that any step is stable; a swivel has no C about u:
!!
!! $$ T = k s + c \dot s \ge 0, \quad k = W/(e d), \quad c = 2 \sqrt{k M}, $$
!! $$ M_T = K u \times z - C \omega, \quad K = T a, \quad C = 2 \sqrt{K I} . $$
module sling_m
  use kinds_m, only: wp
  use vectors_m, only: inverse3, rotation_matrix
  use rigid_body_m, only: blocks_t, release_body, space_tensor, angular_velocity, lowering, &
    fastest_point
  implicit none
  private
  public :: hang, hangs, pull_sling, brace, let_off, slack_share, slows_at

  real(wp), parameter :: gives_way = 0.01_wp     !! e [-]
  real(wp), parameter :: slows_at = 0.1_wp       !! of d: so high over what lies below [-]
  real(wp), parameter :: slow = 0.1_wp           !! of the speed of lowering from there on [-]
  real(wp), parameter :: slack_share = 0.05_wp   !! of the weight: one that carries less is slack

contains

  !> Let a block that was moved down hang in its sling.
  pure subroutine hang(b, blocks)
    integer, intent(in) :: b
    type(blocks_t), intent(inout) :: blocks
    real(wp) :: turn(3, 3)

    blocks%fixed(b) = .false.
    turn = rotation_matrix(blocks%q(:, b))
    blocks%upright(:, b) = turn(3, :)
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

  !> Lower the end of a sling by a step, find its force in that step and let its torque act.
  pure subroutine pull_sling(weight, dt, b, blocks)
    real(wp), intent(in) :: weight   !! of the block, less what the water carries [N]
    real(wp), intent(in) :: dt       !! [s]
    integer, intent(in) :: b
    type(blocks_t), intent(inout) :: blocks
    real(wp) :: down, k, c, rate, stretch, up(3)

    down = 0.0_wp
    if (.not. is_slack(weight, b, blocks)) down = slow*blocks%handling(b)%lowering_speed
    associate (m => blocks%mass(b) + blocks%added_mass(b))
      k = max(weight, 0.0_wp)/(gives_way*blocks%shapes(blocks%shape(b))%smallest_edge)
      c = 2*sqrt(k*m)
      stretch = blocks%goal(b) - blocks%x(3, b)
      rate = dt*weight/m - down - blocks%v(3, b)   ! of the stretch at the end without the sling
      blocks%sling(b) = max(0.0_wp, (k*stretch + (k*dt + c)*rate)/(1.0_wp + (k*dt + c)*dt/m))
      blocks%goal(b) = blocks%goal(b) - dt*down
    end associate
    call brace(dt, b, blocks)
    associate (q => blocks%q(:, b), l => blocks%l(:, b), w => blocks%omega(:, b))
      blocks%l_start(:, b) = matmul(inverse3(space_tensor(q, blocks%inverse_inertia(:, :, b))), w)
      up = matmul(rotation_matrix(q), blocks%upright(:, b))
      l = matmul(space_tensor(q, blocks%shapes(blocks%shape(b))%inertia), w) &
        + dt*lever(b, blocks)*[up(2), -up(1), 0.0_wp]
      w = angular_velocity(q, l, blocks%inverse_inertia(:, :, b))
    end associate
  end subroutine pull_sling

  !> How much harder a block turns in its sling: the inertia grows by dt C + dt^2 K, which are
  !! those parts of the torque that the turn of the step changes.
  pure subroutine brace(dt, b, blocks)
    real(wp), intent(in) :: dt   !! [s]
    integer, intent(in) :: b
    type(blocks_t), intent(inout) :: blocks
    real(wp) :: inertia(3, 3), more, free(3)   ! free: axis of the body that turns freely
    integer :: d

    inertia = blocks%shapes(blocks%shape(b))%inertia
    associate (k => lever(b, blocks))
      more = dt*2*sqrt(k*(inertia(1, 1) + inertia(2, 2) + inertia(3, 3))/3) + dt**2*k
    end associate
    free = merge(blocks%upright(:, b), 0.0_wp, blocks%handling(b)%swivel)
    do d = 1, 3
      inertia(d, d) = inertia(d, d) + more
      inertia(:, d) = inertia(:, d) - more*free(d)*free
    end do
    blocks%inverse_inertia(:, :, b) = inverse3(inertia)
  end subroutine brace

  !> K of a sling [N m].
  pure real(wp) function lever(b, blocks)
    integer, intent(in) :: b
    type(blocks_t), intent(in) :: blocks

    lever = blocks%sling(b)*blocks%shapes(blocks%shape(b))%radius
  end function lever

  !> Does the sling carry next to nothing, after it was pulled?
  pure logical function is_slack(weight, b, blocks)
    real(wp), intent(in) :: weight   !! [N]
    integer, intent(in) :: b
    type(blocks_t), intent(in) :: blocks

    is_slack = blocks%sling(b) < slack_share*weight .and. blocks%goal(b) &
      < blocks%x(3, b) + gives_way*blocks%shapes(blocks%shape(b))%smallest_edge
  end function is_slack

  !> Let a block off, with the velocity that it has, once its sling is slack and it lies still.
  pure subroutine let_off(weight, time, b, blocks)
    real(wp), intent(in) :: weight, time   !! as above [N], [s]
    integer, intent(in) :: b
    type(blocks_t), intent(inout) :: blocks

    associate (shape => blocks%shapes(blocks%shape(b)))
      if (.not. is_slack(weight, b, blocks) .or. fastest_point(blocks, b) &
        > slow**2*blocks%handling(b)%lowering_speed) return
      blocks%sling(b) = 0.0_wp
      blocks%inverse_inertia(:, :, b) = inverse3(shape%inertia)
      blocks%given%v(:, b) = blocks%v(:, b)
      blocks%given%omega(:, b) = blocks%omega(:, b)
    end associate
    call release_body(time, b, blocks)
  end subroutine let_off

end module sling_m
