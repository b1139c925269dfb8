!> A case as the user wrote it: one type per namelist group, defaults as initial values.
!!
!! The names are those of the namelist variables. SI units; angles in degrees where a name
!! ends in `_deg`. `case_input_m` fills these types and checks them.
module case_types_m
  use kinds_m, only: wp, name_length
  use given_motion_m, only: given_motion_t
  implicit none
  private
  public :: case_t, run_t, grid_input_t, boundary_input_t, fluid_t, water_t, numerics_t
  public :: contact_input_t, shape_input_t, body_input_t, drop_input_t, bed_input_t
  public :: place_t, handling_t, max_variants
  public :: absent, is_given, size_count, smallest_spacing, has_flow, not_resolved
  public :: member_name
  public :: start_t, begun_t

  real(wp), parameter :: absent = -huge(1.0_wp)   !! value of a real variable the user did not give
  character(*), parameter :: not_resolved = 'light: not resolved, no flow is computed'
  integer, parameter :: max_drop_shapes = 20          !! that a drop draws from

  integer, parameter :: max_variants = 5000   !! stones of a family

  real(wp), parameter :: unturned(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]   !! a quaternion

  !> What the reader knows of a group.
  type :: group_t
    integer :: line = 0                             !! of the case file, where it begins
    logical :: faulty = .false.                     !! its form, place or file is not known
  end type group_t

  type, extends(group_t) :: run_t
    character(:), allocatable :: title, output
    character(name_length) :: physics = 'coupled'   !! 'coupled', 'fluid', 'dry', 'light'
    real(wp) :: t_end = absent                      !! required [s]
    real(wp) :: dt = 1.0e-2_wp                      !! largest fluid time step [s]
    real(wp) :: cfl_max = 0.5_wp                    !! 0: dt stays fixed
    real(wp) :: field_interval = 0.1_wp             !! [s], 0: never
    real(wp) :: history_interval = 0.0_wp           !! [s], 0: every step
    real(wp) :: restart_interval = 1.0_wp           !! [s], 0: only at the end
    logical :: stop_when_settled = .false.
    real(wp) :: rest_speed = 1.0e-3_wp              !! [m/s]
    real(wp) :: rest_time = 0.5_wp                  !! [s]
  end type run_t

  type :: grid_input_t
    integer :: cells(3) = 0                         !! required
    real(wp) :: length(3) = absent                  !! required [m]
    real(wp) :: origin(3) = 0.0_wp                  !! [m]
    logical :: cells_faulty = .false.               !! not known: they are wrong or missing
    logical :: extent_faulty = .false.              !! likewise length and origin
  end type grid_input_t

  !> First index: 1 lower side, 2 upper side; last index: x, y, z.
  type :: boundary_input_t
    character(name_length) :: kind(2, 3) = reshape([character(name_length) :: &
      'no_slip', 'no_slip', 'no_slip', 'no_slip', 'no_slip', 'open'], [2, 3])
    real(wp) :: velocity(3, 2, 3) = 0.0_wp          !! wall or inflow velocity [m/s]
    logical :: faulty(2, 3) = .false.               !! the kind of this side is not known
  end type boundary_input_t

  type, extends(group_t) :: fluid_t
    real(wp) :: liquid_density = 998.2_wp, gas_density = 1.204_wp          !! [kg/m3]
    real(wp) :: liquid_viscosity = 1.002e-3_wp, gas_viscosity = 1.82e-5_wp !! [Pa s]
    real(wp) :: gravity(3) = [0.0_wp, 0.0_wp, -9.81_wp]                    !! [m/s2]
    real(wp) :: water_level = absent                !! [m]; absent: no liquid below a level
    real(wp) :: surface_tension = 0.0_wp            !! [N/m]
    logical :: single_phase = .false.
    real(wp) :: velocity(3) = 0.0_wp                !! uniform initial velocity [m/s]
    character(:), allocatable :: initial_state      !! HDF5 file; '': none
  end type fluid_t

  type, extends(group_t) :: water_t
    real(wp) :: min(3) = absent, max(3) = absent    !! a box of liquid at t = 0 [m]
  end type water_t

  type :: numerics_t
    character(name_length) :: coupling = 'monolithic'
    integer :: coupling_passes = 1
    character(name_length) :: momentum = 'conservative'
    character(name_length) :: advection = 'mp5'
    character(name_length) :: solid_fraction = 'exact'
    integer :: subcells = 4
    character(name_length) :: pressure_solver = 'cg'
    character(name_length) :: preconditioner = 'multigrid'
    real(wp) :: divergence_tolerance = 1.0e-6_wp    !! [1/s]
    integer :: max_pressure_passes = 10
  end type numerics_t

  type :: contact_input_t
    character(name_length) :: model = 'surface'
    character(name_length) :: law = 'restitution'
    character(name_length) :: solver = 'impulses'
    real(wp) :: restitution = 0.3_wp
    real(wp) :: contact_time = 2.0e-3_wp            !! [s]
    real(wp) :: k_n = 1.0e5_wp, gamma_n = 1.0_wp, eta_n = 10.0_wp   !! [N/m^gamma, -, N s/m]
    real(wp) :: k_t = 1.0e5_wp, gamma_t = 1.0_wp, eta_t = 10.0_wp
    real(wp) :: friction = 0.6_wp, wall_friction = 0.4_wp
    real(wp) :: bed_friction = 0.4_wp               !! of `&bed`, or `wall_friction`
    real(wp) :: substep_ratio = 0.05_wp             !! of the paper
    real(wp) :: courant_max = 0.1_wp                !! C_s of eq. (6)
    logical :: sleep = .true., lubrication = .false.
    real(wp) :: cavitation_pressure = 101325.0_wp   !! of a film, one atmosphere [Pa]
  end type contact_input_t

  type, extends(group_t) :: shape_input_t
    character(name_length) :: name = '', kind = ''  !! required
    real(wp) :: size(3) = absent                    !! required [m]
    real(wp) :: density = 2300.0_wp                 !! [kg/m3]
    character(:), allocatable :: file
    real(wp) :: scale = 1.0_wp
    integer :: refinement = 2
    character(name_length) :: spheres = 'centroid'
    real(wp) :: sphere_spacing = 0.0_wp             !! [m]
    real(wp) :: drag_coefficient = 0.55_wp          !! of the facets, in 'light' [-]
    integer :: seed = 1, variants = 20              !! 'rock': the draw, stones of the family
    real(wp) :: mass_50 = 0.1_wp, uniformity = 3.0_wp    !! M50 and n of Rosin and Rammler [kg, -]
    real(wp) :: mass_min = 0.0_wp, mass_max = 0.0_wp     !! [kg], 0: no bound
    real(wp) :: elongation = 1.5_wp, blockiness = 0.5_wp
    integer :: member = 0                           !! this stone of the family; 0: all, or no rock
  end type shape_input_t

  type, extends(group_t) :: body_input_t
    character(name_length) :: shape = ''            !! required
    character(name_length) :: name = ''             !! of a unit of another run
    real(wp) :: position(3) = absent                !! required: centre of mass [m]
    !> w, x, y, z, normalised; axis and angle end up here as well.
    real(wp) :: quaternion(4) = unturned
    real(wp) :: velocity(3) = 0.0_wp                !! [m/s]
    real(wp) :: angular_velocity(3) = 0.0_wp        !! space frame [rad/s]
    logical :: fixed = .false.
    character(:), allocatable :: motion             !! table that moves a fixed body; '': none
    type(given_motion_t) :: path                    !! of the table
    logical :: attitude_given = .false.             !! by the case itself
    real(wp) :: release_time = 0.0_wp               !! [s]
    logical :: time_faulty = .false.                !! when it is there, or whether it moves
  end type body_input_t

  !> One block as it is placed: a row of a table, or drawn for a drop.
  type :: place_t
    character(name_length) :: shape = ''
    character(name_length) :: name = ''             !! of the unit in a plan; '': none
    real(wp) :: x(3) = absent                       !! z absent: on what lies there [m]
    real(wp) :: planned(2) = absent                 !! x, y without the random shift [m]
    real(wp) :: q(4) = unturned
    real(wp) :: v(3) = 0.0_wp                       !! [m/s]
    real(wp) :: time = 0.0_wp                       !! [s]
    logical :: fixed = .false.
    integer :: line = 0                             !! of the table; 0: none
    integer :: seed = 1, index = 1                  !! by which it draws a stone of a family
  end type place_t

  !> How a crane handles a block.
  type :: handling_t
    character(name_length) :: if_blocked = 'wait'   !! 'wait', 'raise' or 'skip'
    real(wp) :: lowering_speed = 0.0_wp             !! [m/s]
    character(name_length) :: release = 'place'     !! 'place', 'height', 'touch' or 'set_down'
    real(wp) :: release_height = 0.0_wp             !! [m]
    logical :: swivel = .false.                     !! a sling free about the vertical
    character(name_length) :: attitude = 'given'    !! 'given', or 'bed': its base on the slope
  end type handling_t

  type, extends(group_t) :: drop_input_t
    character(name_length) :: shape = ''            !! required, or one of the next two
    character(name_length) :: shapes(max_drop_shapes) = ''   !! drawn by weight
    character(:), allocatable :: file               !! with a table of places
    type(place_t), allocatable :: row(:)            !! of the table
    real(wp) :: weights(max_drop_shapes) = [1.0_wp, spread(absent, 1, max_drop_shapes - 1)]
    real(wp) :: position(3) = absent                !! required [m]
    real(wp) :: to(3) = absent                      !! of the last block [m]
    integer :: count = 1
    real(wp) :: first_time = 0.0_wp, interval = 1.0_wp   !! [s]
    real(wp) :: spread(3) = 0.0_wp                  !! [m]
    character(name_length) :: orientation = 'given' !! 'given' or 'random'
    real(wp) :: quaternion(4) = unturned
    real(wp) :: tilt_deg = 0.0_wp
    real(wp) :: velocity(3) = 0.0_wp                !! [m/s]
    integer :: seed = 1
    type(handling_t) :: handling
  end type drop_input_t

  type, extends(group_t) :: start_t
    character(:), allocatable :: file               !! run.h5 of another run; '': none
    real(wp) :: time = -1.0_wp                      !! of that run [s]; -1: its end
    real(wp) :: shift(3) = 0.0_wp                   !! [m]
  end type start_t

  !> Blocks that begin where another run left them.
  type :: begun_t
    integer :: n = 0
    real(wp) :: time = 0.0_wp                       !! of that run [s]
    integer, allocatable :: drop(:), block(:)       !! (n) block of a drop, or (0, body)
    character(name_length), allocatable :: shape(:), name(:)
    real(wp), allocatable :: x(:, :), q(:, :), v(:, :), omega(:, :)   !! (3, n), q (4, n)
  end type begun_t

  type, extends(group_t) :: bed_input_t
    character(:), allocatable :: file
    character(name_length) :: kind = 'heightmap'
    real(wp) :: friction = absent                   !! absent: `wall_friction`
  end type bed_input_t

  type :: case_t
    character(:), allocatable :: text               !! the case file, verbatim
    type(run_t) :: run
    type(grid_input_t) :: grid
    type(boundary_input_t) :: boundary
    type(fluid_t) :: fluid
    type(numerics_t) :: numerics
    type(contact_input_t) :: contact
    type(bed_input_t) :: bed
    type(start_t) :: start
    type(begun_t) :: begun                          !! of the file of `start`
    type(water_t), allocatable :: water(:)
    type(shape_input_t), allocatable :: shape(:)
    type(body_input_t), allocatable :: body(:)
    type(drop_input_t), allocatable :: drop(:)
  end type case_t

contains

  !> Did the user give this real variable a value?
  elemental function is_given(x) result(yes)
    real(wp), intent(in) :: x
    logical :: yes

    yes = x > absent
  end function is_given

  !> Is the flow of water and air computed?
  pure function has_flow(run) result(yes)
    type(run_t), intent(in) :: run
    logical :: yes

    yes = run%physics == 'coupled' .or. run%physics == 'fluid'
  end function has_flow

  !> How many lengths the size of a kind of shape has; 0 where it comes from a file or a mass.
  pure function size_count(kind) result(n)
    character(*), intent(in) :: kind
    integer :: n

    select case (kind)
    case ('box'); n = 3
    case ('cylinder'); n = 2
    case ('file', 'rock'); n = 0
    case default; n = 1
    end select
  end function size_count

  !> The name of a stone of a family, as in `rock-07`; of other shapes their own.
  pure function member_name(shape, member) result(name)
    type(shape_input_t), intent(in) :: shape
    integer, intent(in) :: member   !! 1 .. variants; 0: the family
    character(name_length) :: name
    character(4) :: number

    name = shape%name
    if (member == 0) return
    write (number, '(i4.4)') member
    if (shape%variants < 1000) number = number(2:)
    if (shape%variants < 100) number = number(2:)
    name = trim(name)//'-'//number
  end function member_name

  !> Shortest edge of a cell, of the directions that have more than one [m].
  pure function smallest_spacing(grid) result(h)
    type(grid_input_t), intent(in) :: grid
    real(wp) :: h

    h = minval(grid%length/real(grid%cells, wp), grid%cells > 1)
  end function smallest_spacing

end module case_types_m
