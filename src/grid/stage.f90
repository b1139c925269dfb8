!> What the stages of a step work on.
module stage_m
  use kinds_m, only: wp
  use grid_m, only: grid_t
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use scratch_m, only: scratch_t
  implicit none
  private
  public :: stage_t

  type :: stage_t
    type(grid_t), pointer :: grid => null()
    type(solid_geometry_t), pointer :: solid => null()
      !! at the end of the step, for `begin` at its start
    type(flow_t), pointer :: flow => null()
    type(scratch_t), pointer :: scratch => null()
    real(wp) :: dt = 0.0_wp   !! [s]
  end type stage_t

end module stage_m
