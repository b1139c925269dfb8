!> Two cubes with edges of 1 m that meet: poses near one another, small moves, and the distance of a
!! point from such a cube in closed form.
module two_cubes_m
  use kinds_m, only: wp
  use case_text_m, only: shape_of
  use random_counter_m, only: uniform, random_rotation
  use vectors_m, only: rotation_matrix, quaternion_exp, quaternion_product
  use surface_features_m, only: surface_init
  use surface_search_m, only: surface_t
  use counterparts_m, only: counterparts_t, counterparts_init
  use contact_response_m, only: response_t
  use near_features_m, only: poses_t, meeting_t, update_views
  implicit none
  private
  public :: make_solid, random_poses, moved, meeting_at, distance_from_cube, vector
  public :: free_bodies

contains

  !> The surface of a cube or a ball 1 m wide.
  subroutine make_solid(kind, surface)
    character(*), intent(in) :: kind
    type(surface_t), intent(out) :: surface

    call surface_init(shape_of('size=1 kind="'//kind//'"'), surface)
  end subroutine make_solid

  !> Number i of many poses: b turned at random, its centre at some distance from that of a.
  pure function random_poses(i, least, most) result(poses)
    integer, intent(in) :: i
    real(wp), intent(in) :: least, most   !! of the distance [m]
    type(poses_t) :: poses
    real(wp) :: way(3)

    way = vector(i, 1)
    poses = poses_t(vector(i, 2), 0.0_wp, random_rotation(1, i), random_rotation(2, i))
    poses%x_b = poses%x_a + (least + (most - least)*uniform(i, 3, 1))*way/norm2(way)
  end function random_poses

  !> Poses in which a has come nearer to b, or b has turned, or both, so that points of the two have
  !! moved against one another by less than a way, and most of it at some points.
  pure function moved(i, way, before) result(now)
    integer, intent(in) :: i
    real(wp), intent(in) :: way   !! [m]
    type(poses_t), intent(in) :: before
    type(poses_t) :: now
    real(wp), parameter :: shares(0:2) = [0.97_wp, 0.5_wp, 0.03_wp]
    real(wp) :: shift(3), turn(3), share

    share = shares(modulo(i, 3))
    shift = 0.2_wp*vector(i, 4) + (before%x_b - before%x_a)/norm2(before%x_b - before%x_a)
    turn = vector(i, 5)
    now = before
    now%x_a = before%x_a + share*way*shift/norm2(shift)
    now%q_b = quaternion_product(quaternion_exp((1 - share)*way*turn/norm2(turn)), before%q_b)
  end function moved

  !> The meeting in given poses.
  pure function meeting_at(poses) result(now)
    type(poses_t), intent(in) :: poses
    type(meeting_t) :: now

    now%poses = poses
    now%turn_a = rotation_matrix(poses%q_a)
    now%turn_b = rotation_matrix(poses%q_b)
    now%to_b = poses%x_b - poses%x_a
    call update_views(now)
  end function meeting_at

  !> Signed distance of a point from the cube, in its axes [m].
  pure real(wp) function distance_from_cube(p) result(distance)
    real(wp), intent(in) :: p(3)   !! [m]

    distance = maxval(abs(p)) - 0.5_wp
    if (distance > 0.0_wp) distance = norm2(max(0.0_wp, abs(p) - 0.5_wp))
  end function distance_from_cube

  !> Three numbers between -1/2 and 1/2.
  pure function vector(i, k) result(v)
    integer, intent(in) :: i, k
    real(wp) :: v(3)

    v = [uniform(i, k, 1), uniform(i, k, 2), uniform(i, k, 3)] - 0.5_wp
  end function vector

  !> Bodies that do not turn, at rest, as counterparts; contact points of theirs do not harden.
  pure subroutine free_bodies(mass, counterparts, response)
    real(wp), intent(in) :: mass(:)   !! [kg]
    type(counterparts_t), intent(out) :: counterparts
    type(response_t), intent(out) :: response   !! without a law

    call counterparts_init(size(mass), counterparts)
    counterparts%inverse_mass(1:) = 1/mass
    allocate (response%hard, response%rest_overlap, mold=counterparts%inverse_mass)
    response%hard = 1.0_wp
    response%rest_overlap = 1.0_wp
  end subroutine free_bodies

end module two_cubes_m
