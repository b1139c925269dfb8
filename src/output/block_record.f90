!> What the results keep of each block between their rows: the hardest contact, how fast it came
!! before it first touched anything, and since when it rests. No number depends on how often rows
!! are written.
module block_record_m
  use kinds_m, only: wp
  use vectors_m, only: norm
  use rigid_body_m, only: blocks_t
  implicit none
  private
  public :: update_record

contains

  !> After a step that ended at a time.
  !!
  !! Below the grid a film of fluid stops a block just before it touches (docs/guide.md), so the
  !! speed of its approach is the largest over the last eighth to quarter of its length: two parts
  !! of the way, of an eighth each, are kept.
  pure subroutine update_record(time, dt, rest_speed, blocks)
    real(wp), intent(in) :: time, dt     !! [s]
    real(wp), intent(in) :: rest_speed   !! a slower block rests [m/s]
    type(blocks_t), intent(inout) :: blocks
    real(wp) :: v
    integer :: b

    associate (record => blocks%record)
      do b = 1, blocks%n
        if (.not. blocks%present(b)) cycle
        record%hardest(b) = max(record%hardest(b), norm(blocks%contact_force(:, b)))
        if (blocks%fixed(b)) cycle
        if (blocks%speed(b) >= rest_speed) then
          record%rest_since(b) = 0.0_wp
        else if (record%rest_since(b) <= 0.0_wp) then
          record%rest_since(b) = time
        end if
        if (record%impact_speed(b) > 0.0_wp) cycle
        v = norm(blocks%v_start(:, b))
        associate (way => record%approach(1, b), now => record%approach(2, b), &
                   before => record%approach(3, b))
          now = max(now, v)
          if (blocks%contacts(b) > 0 .and. way + before > 0.0_wp) then
            record%impact_speed(b) = max(now, before)
          else if (blocks%contacts(b) == 0) then
            way = way + dt*v
            if (way < 0.25_wp*blocks%shapes(blocks%shape(b))%radius) cycle
            before = now
            now = 0.0_wp
            way = 0.0_wp
          end if
        end associate
      end do
    end associate
  end subroutine update_record

end module block_record_m
