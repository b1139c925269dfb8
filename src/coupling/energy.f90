!> Energy of fluid and blocks against what was put in: no step may make any.
!!
!! $$ E = E_{kin} + E_{pot} + E_{contact} \le E(0) + \sum_{releases} \Delta E $$
!! The excess is divided by the energy set free, the most of what was put in that was no potential
!! energy at some time. Known where nothing else does work: no side moves, no stream comes in, only
!! the top is open, no block is driven, no surface tension.
!!
!! The liquid moves with the velocity of the start of a step, and its velocity changes after that.
!! So the velocity of a moment belongs to the mean of its places then and a step later, and the
!! excess of a step is known after the next one.
module energy_m
  use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
  use kinds_m, only: wp
  use vectors_m, only: norm
  use case_types_m, only: case_t
  use boundary_kinds_m, only: is_wall, gives_velocity
  use grid_m, only: grid_t
  use rigid_body_m, only: blocks_t, are_driven
  implicit none
  private
  public :: energy_t, energy_parts_t, energy_init, put_in_energy, store_energy, energy_excess

  !> What is not known of an energy: that of the surface in a cell so high, and of the fall of the
  !! free blocks by so many radii.
  real(wp), parameter :: floor_surface = 0.5_wp   !! [cells]
  real(wp), parameter :: floor_fall = 0.5_wp      !! [radii], a quarter of a length

  !> Of a moment [J].
  type :: energy_parts_t
    real(wp) :: kinetic = 0.0_wp    !! of fluid and blocks
    real(wp) :: contact = 0.0_wp    !! elastic
    real(wp) :: potential = 0.0_wp  !! of fluid and blocks
  end type energy_parts_t

  type :: energy_t
    logical :: known = .false.
    real(wp) :: floor = 0.0_wp      !! energy below which an excess means nothing [J]
    real(wp) :: put_in = 0.0_wp     !! at the start and by releases [J]
    real(wp) :: set_free = 0.0_wp   !! most of it that was no potential energy [J]
    real(wp) :: excess = 0.0_wp     !! of the step before the last over what was put in [J]
    type(energy_parts_t) :: parts   !! at the end of the last step
  end type energy_t

contains

  !> What a case lets one know, and how exact it is: by the surface within a cell, and by the fall
  !! of the blocks through a quarter of their length.
  subroutine energy_init(case, grid, blocks, self)
    type(case_t), intent(in) :: case
    type(grid_t), intent(in) :: grid
    type(blocks_t), intent(in) :: blocks
    type(energy_t), intent(out) :: self
    integer :: b, s, d
    real(wp) :: g

    self%known = case%fluid%surface_tension <= 0.0_wp &
                 .and. .not. any(abs(grid%side_velocity) > 0.0_wp) &
                 .and. .not. any(grid%periodic .and. abs(case%fluid%gravity) > 0.0_wp)
    do d = 1, 3
      do s = 1, 2   ! only the top is open, and no stream comes in
        self%known = self%known .and. .not. grid%is_exit(case%fluid%gravity, s, d) &
                     .and. (is_wall(grid%side(s, d)) .or. .not. gives_velocity(grid%side(s, d)))
      end do
    end do
    associate (told => blocks%fixed .or. blocks%handling%lowering_speed > 0.0_wp)
      self%known = self%known .and. .not. any(told .and. are_driven(blocks))
    end associate
    if (.not. self%known) return
    g = norm(case%fluid%gravity)
    d = maxloc(abs(case%fluid%gravity), 1)
    self%floor = floor_surface*case%fluid%liquid_density*g*grid%h(d)**2*product(grid%length) &
                 /grid%length(d)
    do b = 1, blocks%n
      if (.not. blocks%fixed(b)) self%floor = self%floor + floor_fall*blocks%mass(b)*g &
        *blocks%shapes(blocks%shape(b))%radius
    end do
  end subroutine energy_init

  !> What is there before the first step, or after a release that has changed the energy: velocity
  !! given, liquid lifted.
  subroutine put_in_energy(parts, self)
    type(energy_parts_t), intent(in) :: parts
    type(energy_t), intent(inout) :: self

    self%put_in = self%put_in + sum_of(parts) - sum_of(self%parts)
    self%parts = parts
  end subroutine put_in_energy

  !> After a step.
  subroutine store_energy(parts, self)
    type(energy_parts_t), intent(in) :: parts
    type(energy_t), intent(inout) :: self

    self%excess = sum_of(self%parts) + 0.5_wp*(parts%potential - self%parts%potential) &
                  - self%put_in
    self%set_free = max(self%set_free, self%put_in - parts%potential)
    self%parts = parts
  end subroutine store_energy

  pure real(wp) function sum_of(parts)
    type(energy_parts_t), intent(in) :: parts

    sum_of = parts%kinetic + parts%contact + parts%potential
  end function sum_of

  !> The excess over the energy set free; NaN where it is not known [-].
  pure function energy_excess(self) result(excess)
    type(energy_t), intent(in) :: self
    real(wp) :: excess

    excess = ieee_value(excess, ieee_quiet_nan)
    if (self%known) excess = self%excess/max(self%set_free + self%floor, tiny(excess))
  end function energy_excess

end module energy_m
