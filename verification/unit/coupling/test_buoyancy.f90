!> Archimedes' force and torque: submerged, through the level, with the pressures on the faces.
module test_buoyancy_m
  use check_m, only: check, wp
  use vectors_m, only: cross, quaternion_from_axis, rotation_matrix
  use grid_m, only: n_halo
  use mixture_m, only: mix_fluid, face_mean
  use boundary_m, only: fill_scalar_halo
  use polyhedron_m, only: box_clip_moments_below
  use rigid_flux_m, only: rigid_flux_t, rigid_flux_init, build_rigid_flux, force_from_faces
  use buoyancy_m, only: displaced_force, mass_defect
  use errors_m, only: to_text
  use one_body_m, only: one_body_t, place, sides, body
  implicit none
  private
  public :: test_buoyancy

  integer, parameter :: cells(3) = [16, 12, 18]
  real(wp), parameter :: length(3) = [0.16_wp, 0.12_wp, 0.18_wp]   !! [m]
  real(wp), parameter :: level = 0.0913_wp                         !! inside a cell [m]
  type(one_body_t) :: block
  real(wp) :: force(6, 1)

contains

  subroutine test_buoyancy()
    call submerged('hexapod', [0.03_wp], [0.0771_wp, 0.0611_wp, 0.0829_wp])
    call submerged('box', [0.05_wp, 0.031_wp, 0.043_wp], [0.0771_wp, 0.0037_wp, 0.0829_wp])
    call floating_box()
    call through_the_level([0.0771_wp, 0.0611_wp, 0.0887_wp])
    call through_the_level([0.0771_wp, 0.1189_wp, 0.0961_wp])
  end subroutine test_buoyancy

  !> A block, turned by an angle, in still liquid up to a level.
  subroutine build(kind, size, position, angle, height)
    character(*), intent(in) :: kind
    real(wp), intent(in) :: size(:), position(3), angle, height
    integer :: k

    call place('&grid cells=16,12,18 length=.16,.12,.18/ '//sides('slip slip periodic periodic ' &
      //'slip open')//'&shape name="b" kind="'//kind//'" size='//to_text(size)//'/ ' &
      //body('b', position, q=quaternion_from_axis([1.0_wp, -0.4_wp, 0.3_wp], angle)), block)
    do k = 1 - n_halo, cells(3) + n_halo
      block%flow%c(:, :, k) = min(max((height - block%grid%face(k, 3))/block%grid%h(3), 0.0_wp), &
                                  1.0_wp)
    end do
    call fill_scalar_halo(block%grid, block%flow%c)
    call mix_fluid(block%case%fluid, block%flow)
  end subroutine build

  subroutine push()
    call displaced_force(block%grid, block%case%fluid, block%solid, block%bodies, block%flow%c, &
      force)
  end subroutine push

  !> All liquid: -rho V g whatever the pose, the direction of gravity and the period; no torque.
  subroutine submerged(kind, size, position)
    character(*), intent(in) :: kind
    real(wp), intent(in) :: size(:), position(3)
    real(wp) :: weight(3)

    call build(kind, size, position, 0.6_wp, 1.0_wp)
    block%case%fluid%gravity = [1.7_wp, -0.9_wp, -9.5_wp]
    weight = block%case%fluid%liquid_density*block%bodies%volume(1)*block%case%fluid%gravity
    call push()
    call check(kind//': force', force(1:3, 1), -weight, 1.0e-12_wp*norm2(weight))
    call check(kind//': no torque', norm2(force(4:6, 1)), 0.0_wp, 1.0e-12_wp*norm2(weight)*0.05_wp)
    block%bodies%present = .false.
    call push()
    call check(kind//': nothing before its release', all(abs(force) <= 0.0_wp))
  end subroutine submerged

  !> An upright box through the level, by its edges alone.
  subroutine floating_box()
    real(wp), parameter :: size(3) = [0.05_wp, 0.031_wp, 0.043_wp], &
      position(3) = [0.0771_wp, 0.0611_wp, 0.0957_wp]
    real(wp) :: mass, depth

    call build('box', size, position, 0.0_wp, level)
    depth = level - (position(3) - 0.5_wp*size(3))
    mass = size(1)*size(2)*(block%case%fluid%liquid_density*depth &
                            + block%case%fluid%gas_density*(size(3) - depth))
    call push()
    call check('it floats', force(1:3, 1), [0.0_wp, 0.0_wp, 9.81_wp*mass], 1.0e-12_wp*9.81_wp*mass)
    call check('floating box: no torque', norm2(force(4:6, 1)), 0.0_wp, 1.0e-14_wp)
  end subroutine floating_box

  !> A tilted hexapod through the level, against its tetrahedra cut by the one plane; then the same
  !! force from the pressures of still water on the faces and the correction.
  subroutine through_the_level(position)
    real(wp), intent(in) :: position(3)
    type(rigid_flux_t) :: flux
    real(wp) :: defect(6, 3, 1), by_faces(6, 1), expected(6), weight
    real(wp) :: part, part_moment(3)
    logical, allocatable :: active(:, :, :)
    real(wp) :: mass, moment(3), turn(3, 3), corner(3, 4)
    integer :: t

    call build('hexapod', [0.03_wp], position, 0.8_wp, level)
    associate (fluid => block%case%fluid, solid => block%solid)
      mass = fluid%gas_density*block%bodies%volume(1)
      moment = 0.0_wp
      turn = rotation_matrix(block%blocks%q(:, 1))
      do t = 1, size(block%blocks%shapes(1)%tet, 2)
        corner = spread(position, 2, 4) + matmul(turn, block%blocks%shapes(1)%point(:, &
          block%blocks%shapes(1)%tet(:, t)))
        call box_clip_moments_below(corner, -length, 2.0_wp*length, [0.0_wp, 0.0_wp, 1.0_wp], &
                                    level, part, part_moment)
        mass = mass + (fluid%liquid_density - fluid%gas_density)*part
        moment = moment + (fluid%liquid_density - fluid%gas_density)*(part_moment - part*position)
      end do
      expected = [-mass*fluid%gravity, -cross(moment, fluid%gravity)]
      weight = norm2(expected(1:3))
      call push()
      call check('through the level: force', force(1:3, 1), expected(1:3), 1.0e-10_wp*weight)
      call check('in the level: torque', force(4:6, 1), expected(4:6), 1.0e-10_wp*weight*0.03_wp)
      call check('in the level: it would turn', norm2(expected(4:6)) > 1.0e-3_wp*weight*0.03_wp)

      call still_pressure()
      allocate (active(1 - n_halo:cells(1) + n_halo, 1 - n_halo:cells(2) + n_halo, &
                       1 - n_halo:cells(3) + n_halo))
      active = solid%alpha < 1.0_wp
      call rigid_flux_init(1, flux)
      call build_rigid_flux(block%grid, solid, block%bodies, active, flux)
      call force_from_faces(block%grid, block%bodies, flux, block%flow%p, by_faces)
      defect = mass_defect(block%grid, fluid, solid, block%bodies, flux, block%flow)
      force(:, 1) = -matmul(defect(:, :, 1), fluid%gravity)
      call check('by faces', by_faces(1:3, 1) + force(1:3, 1), expected(1:3), 1.0e-10_wp*weight)
      call check('faces and correction: torque', by_faces(4:6, 1) + force(4:6, 1), expected(4:6), &
                 1.0e-10_wp*weight*0.03_wp)
      call check('the correction is not nothing', norm2(force(1:3, 1)) > 1.0e-5_wp*weight)
    end associate
  end subroutine through_the_level

  !> Pressure of the still fluid, zero half a cell above the top.
  subroutine still_pressure()
    integer :: k

    associate (p => block%flow%p, rho => block%flow%rho, h => block%grid%h(3))
      p(:, :, cells(3)) = 0.5_wp*rho(:, :, cells(3))*9.81_wp*h
      do k = cells(3) - 1, 1, -1
        p(:, :, k) = p(:, :, k + 1) + 9.81_wp*h*face_mean(rho(:, :, k), rho(:, :, k + 1))
      end do
    end associate
  end subroutine still_pressure

end module test_buoyancy_m
