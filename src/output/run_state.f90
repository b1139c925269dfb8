!> What a run is at a moment: grid, time, fluid, solids, blocks and their contacts.
module run_state_m
  use grid_m, only: grid_t
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use rigid_body_m, only: blocks_t
  use contacts_m, only: contact_solver_t
  use light_m, only: light_t
  use clock_m, only: clock_t
  use energy_m, only: energy_t
  implicit none
  private
  public :: run_state_t

  type :: run_state_t
    type(grid_t) :: grid
    type(clock_t) :: clock
    type(flow_t) :: flow   !! arrays not allocated in a dry run
    type(solid_geometry_t), allocatable :: solid   !! likewise
    type(blocks_t) :: blocks
    class(contact_solver_t), allocatable :: contacts
    type(light_t) :: light
    type(energy_t) :: energy
  end type run_state_t

end module run_state_m
