!> What the faces and the masses of the cells at walls disagree about: none in still water or where
!! they agree, for known changes the sum worked out by hand, and with the fluid no momentum is lost.
module test_wall_balance_m
  use check_m, only: check, wp
  use vectors_m, only: cross
  use grid_m, only: n_halo
  use boundary_m, only: fill_scalar_halo
  use face_velocity_m, only: acceleration_t, acceleration_init, face_acceleration, &
    cell_mean_of_faces
  use effective_aperture_m, only: hold_in_cells
  use solid_geometry_m, only: mean_apertures
  use rigid_motion_m, only: rigid_motion_t, rigid_motion_init, wall_velocity
  use rigid_flux_m, only: rigid_flux_t, rigid_flux_init, build_rigid_flux
  use buoyancy_m, only: mass_defect, held_mass
  use merged_cells_m, only: merged_cells_t, order_by_body
  use merged_momentum_m, only: share_acceleration
  use half_kick_m, only: force_of_half_kick
  use wall_balance_m, only: wall_balance_t, begin_balance, add_push, force_of_walls
  use errors_m, only: to_text
  use one_body_m, only: one_body_t, place, random_numbers, random_field, slip
  implicit none
  private
  public :: test_wall_balance

  integer, parameter :: cells(3) = [8, 8, 9]
  real(wp), parameter :: tank(3) = [0.8_wp, 0.8_wp, 0.9_wp]         !! cells of 0.1 m
  real(wp), parameter :: middle(3) = [0.39_wp, 0.40_wp, 0.43_wp]    !! z 0.245-0.615
  real(wp), parameter :: dt = 0.02_wp                               !! [s]
  real(wp), parameter :: gained(6) = [0.3_wp, -0.5_wp, 0.4_wp, 2.0_wp, -1.0_wp, 3.0_wp]
    !! by the box in the step [m/s, rad/s]
  type(one_body_t) :: box
  type(merged_cells_t) :: merged
  type(wall_balance_t) :: balance
  type(rigid_motion_t) :: at_start
  type(acceleration_t) :: a
  real(wp), allocatable :: kick(:, :, :, :)   !! momentum of the first half [kg m/s]
  real(wp) :: force(6, 1)
  integer :: seed = 91, m

contains

  subroutine test_wall_balance()
    call place_box(0.43_wp, box, merged)
    call acceleration_init(box%grid, a)
    allocate (kick, mold=a%cell)
    at_start = box%bodies
    call still_water()
    call agreement()
    call one_small()
    call part_of_the_wall()
    call momentum_of_all()
    call two_halves()
  end subroutine test_wall_balance

  subroutine begin()
    call begin_balance(box%grid, box%case%fluid, box%solid, merged, box%flow, box%flow%rho, balance)
  end subroutine begin

  !> Force on the box whose motion changes by `change` in the step [N, N m].
  subroutine find(change)
    real(wp), intent(in), optional :: change(6)

    if (present(change)) box%bodies%motion(:, 1) = at_start%motion(:, 1) + change
    call force_of_walls(box%grid, merged, box%bodies, at_start, dt, balance, force)
    box%bodies%motion = at_start%motion
  end subroutine find

  !> The pressure that carries the water accelerates nothing.
  subroutine still_water()
    integer :: k

    associate (grid => box%grid, fluid => box%case%fluid)
      do k = 1, cells(3)
        box%flow%p(:, :, k) = fluid%liquid_density*fluid%gravity(3)*grid%centre(k, 3)
      end do
      call fill_scalar_halo(grid, box%flow%p)
      call face_acceleration(grid, fluid%gravity, box%flow%rho, box%flow%rho, box%flow%p, a%face)
      call cell_mean_of_faces(grid, box%solid%aperture, a%face, a%cell)
      call begin()
      call check('mass of the fluid that is there', balance%mass(merged%number(4, 4, 7)), &
                 0.85_wp*fluid%liquid_density*grid%volume, 1.0e-9_wp)
      call add_push(grid, merged, dt, a%cell, balance)
      call share_acceleration(grid, box%solid%aperture, box%flow%rho, merged, a%cell)
      call add_push(grid, merged, dt, a%cell, balance, taken=.true.)
      call find()
      call check('still water: no force', norm2(force), 0.0_wp, &
                 1.0e-12_wp*fluid%liquid_density*norm2(fluid%gravity)*product(tank))
    end associate
  end subroutine still_water

  !> Faces and masses agree in one direction.
  subroutine agreement()
    call begin()
    a%cell = 0.0_wp
    do m = 1, merged%n
      associate (c => merged%cell(:, m))
        balance%mass(m) = box%case%fluid%liquid_density*box%grid%volume &
          *dot_product([0, 0, 1], mean_apertures(box%grid, box%solid%aperture, c))
        a%cell(c(1), c(2), c(3), 3) = 0.1_wp*sum(c)/dt
      end associate
    end do
    call push_and_gain()
    call find()
    call check('equal masses: no force', norm2(force), 0.0_wp, 1.0e-9_wp)
  end subroutine agreement

  !> Faces and fluid of the cells at walls get the same.
  subroutine push_and_gain()
    call add_push(box%grid, merged, dt, a%cell, balance)
    call add_push(box%grid, merged, dt, a%cell, balance, taken=.true.)
  end subroutine push_and_gain

  !> A small cell at the side of the box, which takes 0.7 of it, and known changes of velocity.
  subroutine one_small()
    real(wp), parameter :: pushed(3) = [0.2_wp, -0.1_wp, 0.3_wp]
    real(wp), parameter :: taken(3) = [0.1_wp, 0.4_wp, 0.2_wp]
    integer, parameter :: c(3) = [6, 4, 5]
    real(wp) :: f(3)

    call begin()
    call check('its open shares', mean_apertures(box%grid, box%solid%aperture, c), &
               [0.5_wp, 0.3_wp, 0.3_wp], 1.0e-12_wp)
    a%cell = 0.0_wp
    a%cell(c(1), c(2), c(3), :) = pushed/dt
    call add_push(box%grid, merged, dt, a%cell, balance)
    a%cell(c(1), c(2), c(3), :) = taken/dt
    call add_push(box%grid, merged, dt, a%cell, balance, taken=.true.)
    call find()
    f = box%case%fluid%liquid_density*box%grid%volume &
        *([0.5_wp, 0.3_wp, 0.3_wp]*pushed - 0.3_wp*taken)/dt
    call check('one small: force', force(1:3, 1), f, 1.0e-10_wp)
    call check('its torque', force(4:6, 1), cross([0.16_wp, -0.05_wp, 0.02_wp], f), 1.0e-10_wp)
  end subroutine one_small

  !> Where all gains as the box does, the wall bears the fluid that no aperture counts; where faces
  !! move only what the box holds, that.
  subroutine part_of_the_wall()
    logical :: active(1 - n_halo:cells(1) + n_halo, 1 - n_halo:cells(2) + n_halo, &
                      1 - n_halo:cells(3) + n_halo)
    type(rigid_flux_t) :: flux
    real(wp) :: defect(6, 3, 1), held(6, 3, 1), change(6)
    integer :: d

    active = box%solid%alpha < 1.0_wp
    call rigid_flux_init(1, flux)
    call build_rigid_flux(box%grid, box%solid, box%bodies, active, flux)
    defect = mass_defect(box%grid, box%case%fluid, box%solid, box%bodies, flux, box%flow)
    held = held_mass(box%grid, box%bodies, flux, box%flow%rho)
    a%face = 0.0_wp
    do d = 1, 6
      change = 0.0_wp
      change(d) = gained(d)
      call begin()
      do m = 1, merged%n
        associate (c => merged%cell(:, m))
          a%cell(c(1), c(2), c(3), :) = wall_velocity(change, box%grid%centre(c, [1, 2, 3]) &
                                                              - middle)/dt
        end associate
      end do
      call push_and_gain()
      call find(change)
      call check('all gains as the box: no torque', norm2(force(4:6, 1)), 0.0_wp, 1.0e-9_wp)
      if (d <= 3) call check('all gains as the box: the fluid no aperture counts', force(1:3, 1), &
                             (defect(1:3, d, 1) + held(1:3, d, 1))*gained(d)/dt, 1.0e-9_wp)
      call begin()
      a%cell = 0.0_wp
      call hold_in_cells(box%grid, box%solid, box%bodies, reshape(change/dt, [6, 1]), a%face, &
                         a%cell)
      call add_push(box%grid, merged, dt, a%cell, balance)
      call find()
      if (d <= 3) then
        call check('held fluid', force(1:3, 1), held(1:3, d, 1)*gained(d)/dt, 1.0e-9_wp)
      else
        call check('held fluid, turned', force(1:3, 1), held(d, :, 1)*gained(d)/dt, 1.0e-9_wp)
      end if
    end do
    call check('some is counted by no face', maxval(abs(defect(1:3, :, 1))) > 1.0_wp)
    call check('some is held', maxval(abs(held(1:3, :, 1))) > 1.0_wp)
  end subroutine part_of_the_wall

  !> What the faces give, the fluid and both bodies get, also where cells share accelerations.
  subroutine momentum_of_all()
    type(rigid_motion_t) :: two
    real(wp) :: from_faces(3), of_fluid(3), forces(6, 2)

    call begin()
    call random_field(seed, a%cell)
    call add_push(box%grid, merged, dt, a%cell, balance)
    from_faces = 0.0_wp
    do m = 1, merged%n
      associate (c => merged%cell(:, m))
        from_faces = from_faces + box%case%fluid%liquid_density*box%grid%volume*dt &
          *mean_apertures(box%grid, box%solid%aperture, c)*a%cell(c(1), c(2), c(3), :)
        if (modulo(sum(c), 3) == 0) merged%body(m) = 2
      end associate
    end do
    call order_by_body(2, merged)
    call share_acceleration(box%grid, box%solid%aperture, box%flow%rho, merged, a%cell)
    call add_push(box%grid, merged, dt, a%cell, balance, taken=.true.)
    of_fluid = 0.0_wp
    do m = 1, merged%n
      associate (c => merged%cell(:, m))
        of_fluid = of_fluid + dt*balance%mass(m)*a%cell(c(1), c(2), c(3), :)
      end associate
    end do
    call rigid_motion_init(2, two)
    two%x = spread(middle, 2, 2)
    call force_of_walls(box%grid, merged, two, two, dt, balance, forces)
    call check('momentum: fluid and bodies get what the faces give', &
               of_fluid + dt*sum(forces(1:3, :), 2), from_faces, 1.0e-12_wp*sum(balance%mass))
    call check('momentum: both bodies get some', all(norm2(forces(1:3, :), 1) > 1.0_wp))
    merged%body(:merged%n) = 1
    call order_by_body(1, merged)
  end subroutine momentum_of_all

  !> The two halves of the old pressure: where they are the same, no force; else what was given on
  !! the surface of the start less what would be on that of the end, wherever there was a wall.
  subroutine two_halves()
    type(one_body_t) :: elsewhere
    type(merged_cells_t) :: before
    real(wp) :: sums(3), turns(3), f(3)
    integer :: i, j, k

    before = merged
    a%kicked = .true.
    call begin()
    call random_field(seed, a%cell)
    do m = 1, 3
      kick(1:8, 1:8, 1:9, m) = 0.5_wp*dt*box%case%fluid%liquid_density &
        *box%flow%fluid_volume(1:8, 1:8, 1:9)*a%cell(1:8, 1:8, 1:9, m)
    end do
    call find_halves(before)
    call check('equal halves: no force', norm2(force), 0.0_wp, 1.0e-9_wp)

    ! The box was elsewhere; a cell gets no second half.
    call place_box(0.56_wp, elsewhere, before)
    a%kicked(6, 4, 5) = .false.
    sums = 0.0_wp
    turns = 0.0_wp
    do k = 1, cells(3)
      do j = 1, cells(2)
        do i = 1, cells(1)
          call random_numbers(seed, kick(i, j, k, :))
          if (max(before%number(i, j, k), merged%number(i, j, k)) == 0) cycle
          f = -kick(i, j, k, :)
          if (a%kicked(i, j, k)) f = f + 0.5_wp*dt*box%case%fluid%liquid_density &
            *box%flow%fluid_volume(i, j, k)*a%cell(i, j, k, :)
          sums = sums + f
          turns = turns + cross(box%grid%centre([i, j, k], [1, 2, 3]) - middle, f)
        end do
      end do
    end do
    call find_halves(before)
    call check('momentum of the halves goes to the body', dt*force(1:3, 1), sums, 1.0e-11_wp)
    call check('and their torque', dt*force(4:6, 1), turns, 1.0e-11_wp)
  end subroutine two_halves

  subroutine find_halves(before)
    type(merged_cells_t), intent(in) :: before

    force = force_of_half_kick(box%grid, box%case%fluid, before, merged, box%bodies, dt, box%flow, &
                               a, kick)
  end subroutine find_halves

  !> The box at a height.
  subroutine place_box(z, at_height, merged_there)
    real(wp), intent(in) :: z   !! [m]
    type(one_body_t), intent(out) :: at_height
    type(merged_cells_t), intent(out) :: merged_there

    call place('&grid cells=8,8,9 length=.8,.8,.9/ &shape name="b" kind="box" size=.36,.36,.37/ ' &
      //'&body shape="b" position=.39,.4,'//to_text(z)//'/ '//slip, at_height, merged_there)
  end subroutine place_box

end module test_wall_balance_m
