!> State of the blocks and their equations of motion; the only place that moves them.
module rigid_body_m
  use kinds_m, only: wp
  use tet_mesh_m, only: shape_t
  implicit none
  private
  public :: blocks_t

  !> All bodies of a run, in the order of the contract: `&body`, then `&drop`.
  type :: blocks_t
    integer :: n = 0
    type(shape_t), allocatable :: shapes(:)
    integer, allocatable :: shape(:)             !! (n) index into shapes
    real(wp), allocatable :: mass(:)             !! (n) [kg]
    logical, allocatable :: fixed(:)             !! (n) held, or moved at its constant given rate
    logical, allocatable :: present(:)           !! (n) released: displaces fluid, touches, moves
    real(wp), allocatable :: release_time(:)     !! (n) due, then true time of release [s]
    real(wp), allocatable :: x(:, :)             !! (3, n) centre of mass [m]
    real(wp), allocatable :: q(:, :)             !! (4, n) attitude w, x, y, z [-]
    real(wp), allocatable :: v(:, :)             !! (3, n) velocity [m/s]
    real(wp), allocatable :: l(:, :)             !! (3, n) angular momentum, space frame [kg m2/s]
    real(wp), allocatable :: omega(:, :)         !! (3, n) angular velocity, space frame [rad/s]
    !> Means over the last fluid step, space frame, torques about the centre of mass [N], [N m].
    real(wp), allocatable :: fluid_force(:, :), fluid_torque(:, :)
    real(wp), allocatable :: contact_force(:, :), contact_torque(:, :)
    integer, allocatable :: contacts(:)          !! (n) different partners touched during the last step
    integer, allocatable :: on_floor(:)          !! (n) 1 if the floor or the bed is one of them
  end type blocks_t

end module rigid_body_m
