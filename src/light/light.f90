!> Blocks in a given water whose flow is not resolved (`physics = 'light'`).
!!
!! $$ (M + A) \frac{dU}{dt} = M g + F_b + F_d + F_c, \qquad
!!    F_b = - \rho V_w g, \qquad T_b = - \rho K_w \times g, \qquad A = a \rho V_w $$
!! $$ F_d = - \frac{\rho}{2} \sum_j C |u_j| (u_j \cdot n_j) n_j S_j, \qquad
!!    u_j = U + \omega \times c_j - U_w $$
!!
!! V_w and K_w: volume of the part below the level, exact, and its first moment about the centre of
!! mass; S_j: wet area of facet j, u_j: its velocity relative to the current U_w. The level rises by
!! the volume that blocks displace over the area of the tank. a: `panel_method_m`. The inertia grows
!! likewise, by b rho V_w/(rho_s V) of itself. While A grows, entry takes momentum,
!! (U - U_w) (M + A)^e = const. Source: docs/theory.md, section 16.
!!
!! `blocks%mass` and `blocks%inverse_inertia` hold M + A and the inverse of the grown inertia, so
!! that a force F_b + F_d - A g beside gravity and contact moves a block as above.
module light_m
  use kinds_m, only: wp
  use vectors_m, only: cube_root, cross, norm, rotation_matrix, inverse3
  use case_types_m, only: case_t
  use boundary_kinds_m, only: side_code, gives_pressure
  use tet_mesh_m, only: shape_t
  use polyhedron_m, only: tet_moments_below
  use sling_m, only: hangs
  use rigid_body_m, only: blocks_t, own_mass, drift, angular_velocity, follow_motions
  use bed_m, only: bed_t
  use bed_measure_m, only: bed_volume
  use panels_m, only: panels_t, surface_panels, split_panels
  use panel_method_m, only: added_inertia_t, added_inertia
  implicit none
  private
  public :: light_t, light_init, load_block, step_in_water, enter_water, store_water_force
  public :: added_inertia_of

  real(wp), parameter :: entry_loss = 1.2_wp      !! e [-]
  real(wp), parameter :: way_max = 0.1_wp         !! of a block in a step, in smallest edges [-]
  real(wp), parameter :: facet_max = 0.75_wp      !! edge of a facet over the cube root of V [-]

  type :: light_t
    logical :: on = .false.
    type(panels_t), allocatable :: facets(:)      !! (shapes)
    type(added_inertia_t), allocatable :: added(:)   !! (shapes)
    real(wp), allocatable :: drag(:)              !! (shapes) C [-]
    real(wp) :: density = 0.0_wp                  !! [kg/m3]
    real(wp) :: current(3) = 0.0_wp               !! U_w [m/s]
    real(wp) :: area = 0.0_wp                     !! of the surface; 0: the level stays [m2]
    real(wp) :: level_start = 0.0_wp              !! [m]
    real(wp) :: displaced_start = 0.0_wp          !! below it at t = 0 [m3]
    real(wp) :: bottom = 0.0_wp                   !! of the tank [m]
    real(wp) :: level = 0.0_wp                    !! [m]
    real(wp), allocatable :: wet(:)               !! (n) V_w [m3]
    real(wp), allocatable :: moment(:, :)         !! (3, n) K_w about the centre [m4]
    real(wp), allocatable :: cut_at(:)            !! (n) level at which a block at rest was cut [m]
    real(wp), allocatable :: inverse(:, :, :)     !! (3, 3, shapes) inverse inertia [1/(kg m2)]
    real(wp), allocatable :: force(:, :)          !! (6, n) buoyancy and drag [N, N m]
    real(wp), allocatable :: start(:, :)
      !! (6, n) velocity and own angular momentum at the start of a step [m/s, kg m2/s]
  end type light_t

contains

  !> The water of a case with the bodies that are there at t = 0.
  subroutine light_init(case, bed, blocks, light)
    type(case_t), intent(in) :: case
    type(bed_t), intent(in) :: bed
    type(blocks_t), intent(in) :: blocks
    type(light_t), intent(out) :: light
    real(wp), parameter :: slice = 1.0e-3_wp   ! of the height of the tank
    real(wp) :: low(3), high(3), thickness
    integer :: s, b

    light%on = .true.
    light%density = case%fluid%liquid_density
    light%current = case%fluid%velocity
    light%level_start = case%fluid%water_level
    light%level = light%level_start
    light%bottom = case%grid%origin(3)
    ! Area of the surface of the water, without what of the bed stands out of it [m2]. Zero where
    ! water finds a way out through a side: the sea outside keeps the level.
    if (.not. any(gives_pressure([side_code(case%boundary%kind(:, 1:2))]))) then
      light%area = product(case%grid%length(1:2))
      if (bed%there) then
        low = case%grid%origin
        high = low + case%grid%length
        thickness = slice*case%grid%length(3)
        high(3) = case%fluid%water_level + 0.5_wp*thickness
        light%area = light%area - bed_volume(bed, low, high)/thickness
        high(3) = high(3) - thickness
        light%area = light%area + bed_volume(bed, low, high)/thickness
      end if
    end if
    light%drag = case%shape%drag_coefficient
    allocate (light%facets(size(blocks%shapes)), light%added(size(blocks%shapes)), &
      light%inverse(3, 3, size(blocks%shapes)))
    do s = 1, size(blocks%shapes)
      associate (shape => blocks%shapes(s))
        light%facets(s) = split_panels(surface_panels(shape), &
                                       facet_max*cube_root(shape%volume))
        light%added(s) = added_inertia_of(shape)
        light%inverse(:, :, s) = inverse3(shape%inertia)
      end associate
    end do
    allocate (light%wet(blocks%n), source=0.0_wp)
    allocate (light%cut_at(blocks%n), source=-huge(1.0_wp))
    allocate (light%moment(3, blocks%n), light%force(6, blocks%n), light%start(6, blocks%n), &
      source=0.0_wp)
    do b = 1, blocks%n
      if (blocks%present(b)) call submerge(blocks, b, light%level, light%wet(b), &
                                           light%moment(:, b))
    end do
    light%displaced_start = sum(light%wet)
    light%wet = 0.0_wp   ! counted with the first step, as for a block that is released
  end subroutine light_init

  !> Coefficients of the added mass of a shape; of a sphere they are known (Lamb, art. 92).
  function added_inertia_of(shape) result(added)
    type(shape_t), intent(in) :: shape
    type(added_inertia_t) :: added
    integer :: d

    if (shape%kind == 'sphere') then
      added%mass = 0.5_wp
    else
      added = added_inertia(surface_panels(shape), &
                            sum([(shape%inertia(d, d), d=1, 3)])/shape%density)
    end if
  end function added_inertia_of

  !> Longest step: no block moves by more than `way_max` smallest edges in it [s].
  pure function step_in_water(gravity, blocks, light) result(dt)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    type(blocks_t), intent(in) :: blocks
    type(light_t), intent(in) :: light
    real(wp) :: dt
    real(wp) :: way, speed
    integer :: b

    dt = huge(dt)
    do b = 1, blocks%n
      if (.not. blocks%present(b) .or. blocks%fixed(b) .or. blocks%asleep(b)) cycle
      associate (shape => blocks%shapes(blocks%shape(b)))
        way = way_max*shape%smallest_edge
        speed = max(norm(blocks%v(:, b)), norm(blocks%v(:, b) - light%current)) &
                + norm(blocks%omega(:, b))*shape%radius
      end associate
      dt = min(dt, way/(speed + sqrt(way*norm(gravity)) + tiny(dt)))
    end do
  end function step_in_water

  !> What the water does to the blocks in the step that begins: the level, what each carries along,
  !! the loss of entry, and the forces, at the poses of the middle of the step, so that a float
  !! gains no energy. Blocks that have just appeared enter without a loss.
  subroutine enter_water(gravity, dt, blocks, initialised, light)
    real(wp), intent(in) :: gravity(3)   !! straight down [m/s2]
    real(wp), intent(in) :: dt           !! the step [s]
    type(blocks_t), intent(inout) :: blocks
    logical, intent(inout) :: initialised(:)    !! (n) blocks that were here before
    type(light_t), intent(inout) :: light
    real(wp), dimension(3, blocks%n) :: x, lost   ! poses at the start of the step
    real(wp) :: q(4, blocks%n)
    real(wp) :: wet(blocks%n), time               ! V_w in the step before [m3]; its end [s]
    logical :: rests
    integer :: b
    real(wp) :: left, turned   ! of the velocity relative to the water, of the spin

    wet = light%wet
    x = blocks%x
    lost = blocks%lost
    q = blocks%q
    time = blocks%time
    call drift(0.5_wp*dt, blocks)
    call find_level(blocks, light)
    do b = 1, blocks%n
      if (.not. blocks%present(b)) cycle
      light%start(1:3, b) = blocks%v(:, b)
      light%start(4:6, b) = blocks%l(:, b)/growth(light, blocks, b, wet(b))
      rests = blocks%asleep(b) .or. (blocks%fixed(b) .and. all(abs(blocks%v(:, b)) <= 0.0_wp) &
                                     .and. all(abs(blocks%omega(:, b)) <= 0.0_wp))
      if (.not. (initialised(b) .and. rests .and. abs(light%wet(b) - wet(b)) <= 0.0_wp)) then
        ! Let free block b carry what is below the level now. Water that comes along takes momentum
        ! from it, water left behind takes its own away.
        if (.not. blocks%fixed(b)) then
          call load_block(b, light, blocks)
          left = (loaded_mass(light, blocks, b, wet(b))/blocks%mass(b))**entry_loss
          turned = growth(light, blocks, b, wet(b))/growth(light, blocks, b, light%wet(b))
          if (initialised(b) .and. light%wet(b) > wet(b)) then
            blocks%v(:, b) = light%current + left*(blocks%v(:, b) - light%current)
            blocks%omega(:, b) = turned*blocks%omega(:, b)
          else
            blocks%l(:, b) = blocks%l(:, b)/turned
          end if
        end if
        call find_force(gravity, b, blocks, light)
      end if
      initialised(b) = .true.
      blocks%fluid_force(:, b) = light%force(1:3, b) &
        - (blocks%mass(b) - own_mass(blocks, b))*gravity
      blocks%fluid_torque(:, b) = light%force(4:6, b)
    end do
    blocks%x = x
    blocks%lost = lost
    blocks%q = q
    call follow_motions(time, blocks)
    do b = 1, blocks%n
      if (.not. blocks%present(b) .or. blocks%fixed(b) .or. blocks%asleep(b)) cycle
      blocks%omega(:, b) = angular_velocity(blocks%q(:, b), blocks%l(:, b), &
        blocks%inverse_inertia(:, :, b))
    end do
  end subroutine enter_water

  !> The forces of the water in the step that ends, with what the water that the blocks carry takes:
  !! M dU/dt = F_fluid + F_contact + M g.
  subroutine store_water_force(gravity, dt, blocks, light)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    real(wp), intent(in) :: dt           !! the step [s]
    type(blocks_t), intent(inout) :: blocks
    type(light_t), intent(in) :: light
    integer :: b

    do b = 1, blocks%n
      if (.not. blocks%present(b) .or. blocks%fixed(b)) cycle
      blocks%fluid_force(:, b) = own_mass(blocks, b)*((blocks%v(:, b) - light%start(1:3, b))/dt &
        - gravity) - blocks%contact_force(:, b)
      blocks%fluid_torque(:, b) = (blocks%l(:, b)/growth(light, blocks, b, light%wet(b)) &
        - light%start(4:6, b))/dt - blocks%contact_torque(:, b)
    end do
  end subroutine store_water_force

  !> The level at which the volume below it less what the blocks displace is that of the start, and
  !! what each block displaces then.
  subroutine find_level(blocks, light)
    type(blocks_t), intent(in) :: blocks
    type(light_t), intent(inout) :: light
    integer, parameter :: max_rounds = 50
    real(wp) :: residual, residual_before, level_before, step
    integer :: round

    where (.not. blocks%present) light%wet = 0.0_wp   ! those that have left
    residual = level_residual()
    step = residual
    do round = 1, max_rounds
      if (abs(residual) <= 4.0_wp*epsilon(residual)*abs(light%level - light%bottom)) exit
      residual_before = residual
      level_before = light%level
      light%level = light%level + step
      residual = level_residual()
      if (abs(residual - residual_before) <= 0.0_wp) exit
      step = -residual*(light%level - level_before)/(residual - residual_before)   ! secant
    end do
  contains
    !> How much higher the level ought to be for what it makes the blocks displace [m].
    real(wp) function level_residual()
      integer :: b

      do b = 1, blocks%n
        if (.not. blocks%present(b)) cycle
        if (blocks%asleep(b) .and. abs(light%level - light%cut_at(b)) <= 0.0_wp) cycle
        call submerge(blocks, b, light%level, light%wet(b), light%moment(:, b))
        light%cut_at(b) = merge(light%level, -huge(1.0_wp), blocks%asleep(b))
      end do
      level_residual = 0.0_wp
      if (light%area > 0.0_wp) level_residual = light%level_start - light%level &
        + (sum(light%wet) - light%displaced_start)/light%area
    end function level_residual
  end subroutine find_level

  !> Volume of block b below the level, and its first moment about the centre of mass, space axes.
  pure subroutine submerge(blocks, b, level, volume, moment)
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: b
    real(wp), intent(in) :: level        !! [m]
    real(wp), intent(out) :: volume      !! [m3]
    real(wp), intent(out) :: moment(3)   !! [m4]
    real(wp) :: turn(3, 3), part, k(3)
    integer :: t

    volume = 0.0_wp
    moment = 0.0_wp
    associate (shape => blocks%shapes(blocks%shape(b)), height => level - blocks%x(3, b))
      if (height >= shape%radius) volume = shape%volume
      if (abs(height) >= shape%radius) return
      turn = rotation_matrix(blocks%q(:, b))
      do t = 1, size(shape%flow_tet, 2)
        call tet_moments_below(shape%point(:, shape%flow_tet(:, t)), turn(3, :), height, part, k)
        volume = volume + part
        moment = moment + k
      end do
      moment = matmul(turn, moment)
    end associate
  end subroutine submerge

  !> Inertia of block b with the water that it carries over its own [-].
  pure real(wp) function growth(light, blocks, b, wet)
    type(light_t), intent(in) :: light
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: b
    real(wp), intent(in) :: wet   !! V_w [m3]

    growth = 1.0_wp
    if (.not. blocks%fixed(b)) growth = 1.0_wp + light%added(blocks%shape(b))%inertia &
      *light%density*wet/own_mass(blocks, b)
  end function growth

  !> Mass of block b with the water that it carries [kg].
  pure real(wp) function loaded_mass(light, blocks, b, wet)
    type(light_t), intent(in) :: light
    type(blocks_t), intent(in) :: blocks
    integer, intent(in) :: b
    real(wp), intent(in) :: wet   !! V_w [m3]

    loaded_mass = own_mass(blocks, b) + light%added(blocks%shape(b))%mass*light%density*wet
  end function loaded_mass

  !> Mass and inertia of a free block with the water that it carries.
  subroutine load_block(b, light, blocks)
    integer, intent(in) :: b
    type(light_t), intent(in) :: light
    type(blocks_t), intent(inout) :: blocks

    associate (s => blocks%shape(b))
      blocks%mass(b) = loaded_mass(light, blocks, b, light%wet(b))
      if (hangs(b, blocks)) return   ! in its sling (`brace`)
      blocks%inverse_inertia(:, :, b) = light%inverse(:, :, s) &
        /growth(light, blocks, b, light%wet(b))
    end associate
  end subroutine load_block

  !> Buoyancy and drag of block b.
  subroutine find_force(gravity, b, blocks, light)
    real(wp), intent(in) :: gravity(3)   !! [m/s2]
    integer, intent(in) :: b
    type(blocks_t), intent(in) :: blocks
    type(light_t), intent(inout) :: light
    real(wp) :: turn(3, 3), force(3), torque(3), height, v(3), omega(3), u(3), f(3)
    integer :: j

    light%force(1:3, b) = -light%density*light%wet(b)*gravity
    light%force(4:6, b) = -light%density*cross(light%moment(:, b), gravity)
    if (light%wet(b) <= 0.0_wp) return
    associate (s => blocks%shape(b))
      turn = rotation_matrix(blocks%q(:, b))
      height = min(light%level - blocks%x(3, b), blocks%shapes(s)%radius)
      v = matmul(blocks%v(:, b) - light%current, turn)   ! body axes from here on
      omega = matmul(blocks%omega(:, b), turn)
      force = 0.0_wp
      torque = 0.0_wp
      associate (facets => light%facets(s))
        do j = 1, facets%n   ! |u| (u.n) n S and its moment about the centre of mass
          u = v + cross(omega, facets%centre(:, j))
          f = wet_share(matmul(turn(3, :), facets%corner(:, :, j)) - height)*facets%area(j) &
            *norm(u)*dot_product(u, facets%normal(:, j))*facets%normal(:, j)
          force = force + f
          torque = torque + cross(facets%centre(:, j), f)
        end do
      end associate
      force = 0.5_wp*light%density*light%drag(s)*matmul(turn, force)
      torque = 0.5_wp*light%density*light%drag(s)*matmul(turn, torque)
    end associate
    light%force(1:3, b) = light%force(1:3, b) - force
    light%force(4:6, b) = light%force(4:6, b) - torque
  end subroutine find_force

  !> Share of a triangle below the level [-].
  pure function wet_share(h) result(share)
    real(wp), intent(in) :: h(3)   !! heights of its corners over the level [m]
    real(wp) :: share
    real(wp) :: low, middle, high

    low = minval(h)
    high = maxval(h)
    middle = sum(h) - low - high
    if (high <= 0.0_wp) then
      share = 1.0_wp
    else if (low >= 0.0_wp) then
      share = 0.0_wp
    else if (middle <= 0.0_wp) then
      share = 1.0_wp - high**2/((high - low)*(high - middle))
    else
      share = low**2/((middle - low)*(high - low))
    end if
  end function wet_share

end module light_m
