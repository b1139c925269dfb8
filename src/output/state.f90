!> The one list of everything that a run must remember from step to step.
!!
!! `list_state` names each array once: restart files are written and read and checksums formed by
!! loops over its list. An array that is missing here is missing in all of them.
!!
!! Halo cells are not part of the state: whoever reads one fills them, and computes what follows
!! from the state (density, viscosity, links to the surfaces), before the next step.
module state_m
  use fields_m, only: flow_t
  use solid_geometry_m, only: solid_geometry_t
  use rigid_body_m, only: blocks_t
  use displacements_m, only: displacements_t, reserve_displacements
  use run_state_m, only: run_state_t
  use state_list_m, only: state_list_t
  implicit none
  private
  public :: list_state, state_groups

  !> Groups of the names below, in their order.
  character(*), parameter :: state_groups(*) = &
    [character(9) :: '/clock', '/energy', '/flow', '/blocks', '/light', '/contacts']

contains

  !> The whole state; the list points into it, and holds until contact points come or go.
  subroutine list_state(state, list)
    type(run_state_t), intent(inout), target :: state
    type(state_list_t), intent(out) :: list

    list%grid => state%grid
    associate (clock => state%clock)
      call list%add('/clock/t', 's', clock%t)
      call list%add('/clock/dt', 's', clock%dt)
      call list%add('/clock/rest_began', 's', clock%rest_began)
      call list%add('/clock/step', clock%step)
      call list%add('/clock/n_rows', clock%rows%n)
      call list%add('/clock/n_frames', clock%frames%n)
    end associate
    associate (energy => state%energy)
      call list%add('/energy/put_in', 'J', energy%put_in)
      call list%add('/energy/set_free', 'J', energy%set_free)
      call list%add('/energy/excess', 'J', energy%excess)
      call list%add('/energy/kinetic', 'J', energy%parts%kinetic)
      call list%add('/energy/contact', 'J', energy%parts%contact)
      call list%add('/energy/potential', 'J', energy%parts%potential)
    end associate
    if (allocated(state%flow%u)) call list_flow(state%flow, state%solid, list)
    if (state%blocks%n > 0) call list_blocks(state%blocks, list)
    if (state%light%on) then   ! level, and what the water does to each block, sleepers too
      call list%add('/light/level', 'm', state%light%level)
      call list%add('/light/wet', 'm3', state%light%wet)
      call list%add('/light/force', 'N, N m', state%light%force)
    end if
    associate (contacts => state%contacts, warm => state%contacts%warm_start)
      call list_displacements('/contacts/', warm, warm, contacts%displacements, list)
      call list%add('/contacts/quiet', 's', contacts%sleep%quiet)
      call list_displacements('/contacts/rest_', .true., warm, contacts%sleep%frozen, list)
    end associate
  end subroutine list_state

  !> The open shares and solid shares follow from the poses of the blocks; they are here so that
  !! fluxes and volumes can be summed from a restart file alone.
  subroutine list_flow(flow, solid, list)
    type(flow_t), intent(in), target :: flow
    type(solid_geometry_t), intent(in), target :: solid
    type(state_list_t), intent(inout) :: list
    character(5), parameter :: side(2, 3) = reshape(['x_min', 'x_max', 'y_min', 'y_max', 'z_min', &
                                                     'z_max'], [2, 3])
    integer :: s, d

    call list%add('/flow/u', 'm/s', flow%u, on_faces=.false.)
    call list%add('/flow/p', 'Pa', flow%p)
    call list%add('/flow/uf', 'm/s', flow%uf, on_faces=.true.)
    call list%add('/flow/solid_flux', 'm3/s', flow%solid_flux, on_faces=.true.)
    call list%add('/flow/liquid', 'm3', flow%liquid)
    call list%add('/flow/fluid_volume', 'm3', flow%fluid_volume)
    call list%add('/flow/c', '1', flow%c)
    call list%add('/flow/alpha', '1', solid%alpha)
    call list%add('/flow/aperture', '1', solid%aperture, on_faces=.true.)
    call list%add('/flow/liquid_initial', 'm3', flow%liquid_initial)
    call list%add('/flow/liquid_inflow', 'm3', flow%liquid_inflow)
    do d = 1, 3   ! of each outflow the velocity that follows slowly
      do s = 1, 2
        if (flow%sides(s, d)%active) then
          call list%add('/flow/outflow_'//side(s, d), 'm/s', flow%sides(s, d)%mean)
        end if
      end do
    end do
  end subroutine list_flow

  subroutine list_blocks(blocks, list)
    type(blocks_t), intent(in), target :: blocks
    type(state_list_t), intent(inout) :: list

    call list%add('/blocks/present', blocks%present)
    call list%add('/blocks/asleep', blocks%asleep)
    call list%add('/blocks/status', blocks%status)
    call list%add('/blocks/still', blocks%still)
    call list%add('/blocks/release_time', 's', blocks%release_time)
    call list%add('/blocks/entry_time', 's', blocks%entry_time)
    call list%add('/blocks/exit_time', 's', blocks%exit_time)
    call list%add('/blocks/raised', 'm', blocks%raised)
    call list%add('/blocks/position', 'm', blocks%x)
    call list%add('/blocks/lost', 'm', blocks%lost)
    call list%add('/blocks/quaternion', '1', blocks%q)
    call list%add('/blocks/velocity', 'm/s', blocks%v)
    call list%add('/blocks/angular_momentum', 'kg m2/s', blocks%l)
    call list%add('/blocks/angular_velocity', 'rad/s', blocks%omega)
    call list%add('/blocks/fluid_force', 'N', blocks%fluid_force)
    call list%add('/blocks/fluid_torque', 'N m', blocks%fluid_torque)
    call list%add('/blocks/lagged_force', 'N, N m', blocks%lagged_force)
    call list%add('/blocks/film_force', 'N, N m', blocks%film_force)
    call list%add('/blocks/contact_force', 'N', blocks%contact_force)
    call list%add('/blocks/contact_torque', 'N m', blocks%contact_torque)
    call list%add('/blocks/contacts', blocks%contacts)
    call list%add('/blocks/on_floor', blocks%on_floor)
    call list%add('/blocks/hardest', 'N', blocks%record%hardest)
    call list%add('/blocks/impact_speed', 'm/s', blocks%record%impact_speed)
    call list%add('/blocks/rest_since', 's', blocks%record%rest_since)
    call list%add('/blocks/approach', 'm, m/s', blocks%record%approach)
  end subroutine list_blocks

  !> The tangential displacements of contact points.
  subroutine list_displacements(name, with_force, with_edge, s, list)
    character(*), intent(in) :: name
    logical, intent(in) :: with_force   !! forces, torques and energies are remembered
    logical, intent(in) :: with_edge    !! and the edge of the counterpart
    type(displacements_t), intent(inout), target :: s
    type(state_list_t), intent(inout) :: list

    call reserve_displacements(max(1, s%n), s)
    call list%add(name//'n', s%n)
    associate (n => s%n)
      call list%add(name//'a', s%a(:n))
      call list%add(name//'b', s%b(:n))
      call list%add(name//'key', s%id(:n))
      call list%add(name//'stretch', 'm', s%xi(:, :n))
      call list%add(name//'stiffness', 'N/m^gamma', s%k(:n))
      if (with_edge) call list%add(name//'edge', s%other(:n))
      if (.not. with_force) return
      call list%add(name//'force', 'N', s%force(:, :n))
      call list%add(name//'torque_a', 'N m', s%torque_a(:, :n))
      call list%add(name//'torque_b', 'N m', s%torque_b(:, :n))
      call list%add(name//'energy', 'J', s%energy(:n))
    end associate
  end subroutine list_displacements

end module state_m
