!> What is allowed in a case but is hardly what its author meant: warnings of `--check`.
module case_warnings_m
  use kinds_m, only: wp, i8, pi
  use errors_m, only: problems_t, to_text, brief
  use case_types_m, only: case_t, shape_input_t, place_t, is_given, smallest_spacing, has_flow
  use run_groups_m, only: side_name
  use case_blocks_m, only: turning_share
  use bed_m, only: bed_t, facet_within, max_clip_corners
  use value_text_m, only: quoted_text, fixed_text
  use tet_mesh_m, only: shape_t, extreme_of_family, extent_along
  use vectors_m, only: rotation_matrix
  use polygon_m, only: area_vector
  use drops_m, only: place_of_block, place_of_body, shape_of_place
  use machine_memory_m, only: available_memory
  use memory_plan_m, only: planned_memory, size_text
  use contact_sphere_placement_m, only: height_errors
  use wave_step_m, only: gravity_step
  use rest_depth_m, only: look_at_rest
  use panel_method_m, only: added_inertia_t
  use light_m, only: added_inertia_of
  implicit none
  private
  public :: find_case_warnings

  real(wp), parameter :: min_density = 10.0_wp     !! of a block [kg/m3]
  real(wp), parameter :: largest_block = 10.0_wp     !! [m]
  real(wp), parameter :: min_cells = 10.0_wp       !! along a block
  integer, parameter :: few_tets = 50                !! of a round shape
  integer, parameter :: many_tets = 250000           !! of one shape
  real(wp), parameter :: far_above = 0.5_wp          !! over the top of the tank, over its height
  real(wp), parameter :: compact = 0.1_wp            !! spread of its added mass, in 'light'
  real(wp), parameter :: shallow = 2.0_wp            !! water over the length of a block, in 'light'
  integer, parameter :: max_bodies = 5              !! warned of one by one

contains

  !> Collect everything odd about a checked case; nothing of it forbids a run.
  subroutine find_case_warnings(case, shapes, bed, warnings)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)   !! one for each `&shape`
    type(bed_t), intent(in) :: bed
    type(problems_t), intent(inout) :: warnings
    integer(i8) :: planned, available   ! [B]
    integer :: s

    if (case%fluid%gravity(3) > 0.0_wp) call warnings%add('&fluid gravity', &
      case%fluid%gravity(3), 'in z points up; 0, 0, -9.81 is usual', case%fluid%line)
    if (case%run%physics /= 'dry') call look_at_water(case, warnings)
    if (bed%there .and. size(shapes) > 0) call look_at_slope(case, shapes, bed, warnings)
    if (has_flow(case%run)) call look_at_sides(case, warnings)
    planned = planned_memory(case, shapes, bed)
    available = available_memory()
    if (available > 0 .and. planned > available) call warnings%add_message('&grid cells = ' &
      //to_text(case%grid%cells)//': the run takes about '//size_text(real(planned, wp)) &
      //' of memory, more than the '//size_text(real(available, wp))//' that this machine has left')
    call look_at_contact(case, warnings)
    call look_at_seeds(case, warnings)
    call look_at_rest(case, shapes, warnings)
    call look_at_times(case, warnings)
    call look_at_heights(case, shapes, warnings)
    do s = 1, size(shapes)
      if (extreme_of_family(shapes, s)) call look_at_shape(case, case%shape(s), shapes(s), warnings)
    end do
  end subroutine find_case_warnings

  !> Where the bed, seen over the length of a block, is steeper than its friction holds.
  subroutine look_at_slope(case, shapes, bed, warnings)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)
    type(bed_t), intent(in) :: bed
    type(problems_t), intent(inout) :: warnings
    integer, parameter :: most = 1000            !! squares along a side
    real(wp), allocatable :: up(:, :, :)         ! (3, x, y) area of the facets of a square [m2]
    real(wp) :: p(3, max_clip_corners), area(3), middle(2), size_of(2), share
    integer :: n(2), at(2), f, m, digits

    associate (low => case%grid%origin, length => case%grid%length, mu => case%contact%bed_friction)
      n = max(1, min(most, ceiling(0.5_wp*length(:2)/minval(shapes%radius))))
      size_of = length(:2)/real(n, wp)
      allocate (up(3, n(1), n(2)), source=0.0_wp)
      do f = 1, size(bed%triangle, 2)
        call facet_within(bed, f, low, low + length, m, p)
        area = area_vector(p(:, :m))
        if (.not. area(3) > 0.0_wp) cycle
        at = min(n, 1 + int((sum(p(:2, :m), 2)/m - low(:2))/size_of))
        up(:, at(1), at(2)) = up(:, at(1), at(2)) + area
      end do
      associate (slope => hypot(up(1, :, :), up(2, :, :))/max(up(3, :, :), tiny(1.0_wp)))
        share = sum(up(3, :, :), slope > mu)/sum(up(3, :, :))
        if (.not. share > 0.0_wp) return
        at = maxloc(slope)
        middle = low(:2) + (at - 0.5_wp)*size_of
        digits = max(1, 1 - floor(log10(minval(size_of))))
        call warnings%add_message('&bed file = '//quoted_text(case%bed%file)//': '// &
          brief(100.0_wp*share, 2)//' % of it is steeper than the ' &
          //brief(atan(mu)*180.0_wp/pi, 3)//' degrees that friction = '//to_text(mu) &
          //' holds, near x, y = '//fixed_text(middle(1), digits) &
          //', '//fixed_text(middle(2), digits)//' m ' &
          //brief(atan(slope(at(1), at(2)))*180.0_wp/pi, 3)//' degrees: blocks slide there', &
          case%bed%line)
      end associate
    end associate
  end subroutine look_at_slope

  !> A level outside the tank, or no water at all.
  subroutine look_at_water(case, warnings)
    type(case_t), intent(in) :: case
    type(problems_t), intent(inout) :: warnings
    real(wp) :: low, high, longest
    logical :: below

    longest = gravity_step(case%fluid, smallest_spacing(case%grid))
    if (.not. has_flow(case%run)) longest = huge(longest)
    if (case%run%dt > longest .and. case%run%cfl_max <= 0.0_wp) call warnings%add('&run dt', &
      case%run%dt, 'lets the shortest waves of the grid grow, should be at most ' &
      //brief(longest, 3)//' s; or cfl_max > 0 lets the step shrink', case%run%line)
    if (case%fluid%single_phase .or. len(case%fluid%initial_state) > 0) return
    low = case%grid%origin(3)
    high = low + case%grid%length(3)
    below = .true.
    if (is_given(case%fluid%water_level)) then
      below = case%fluid%water_level <= low
      if (case%fluid%water_level > high) call warnings%add('&fluid water_level', &
        case%fluid%water_level, 'lies above the tank, which ends at '//to_text(high) &
        //' m: there is no surface', case%fluid%line)
      if (below) call warnings%add('&fluid water_level', case%fluid%water_level, &
        'lies below the tank, which begins at '//to_text(low)//' m', case%fluid%line)
    end if
    if (below .and. size(case%water) == 0) call warnings%add('&run physics', &
      trim(case%run%physics), 'without any water; give &fluid water_level or &water', case%run%line)
  end subroutine look_at_water

  !> Inflows without a level, through which gas alone comes in; and open sides without a surface,
  !! whose pressure is 0 from top to bottom, which that of still water is not.
  subroutine look_at_sides(case, warnings)
    type(case_t), intent(in) :: case
    type(problems_t), intent(inout) :: warnings
    integer :: s, d

    do d = 1, 3
      do s = 1, 2
        if (case%boundary%kind(s, d) == 'inflow' .and. .not. (case%fluid%single_phase &
            .or. is_given(case%fluid%water_level))) then
          call warnings%add_message('&boundary '//side_name(s, d) &
            //' = ''inflow'': only gas comes in without &fluid water_level')
        else if (case%boundary%kind(s, d) == 'open' .and. case%fluid%single_phase &
            .and. any(abs(case%fluid%gravity) > 0.0_wp .and. [1, 2, 3] /= d)) then
          call warnings%add_message('&boundary '//side_name(s, d)//' = ''open'': gravity acts ' &
            //'along it and the pressure on it is 0 from top to bottom, so with single_phase the ' &
            //'liquid flows from rest; it stays at rest beside an ''outflow''')
        end if
      end do
    end do
  end subroutine look_at_sides

  !> Parts of the contact that this case does not have.
  subroutine look_at_contact(case, warnings)
    type(case_t), intent(in) :: case
    type(problems_t), intent(inout) :: warnings
    integer :: s

    if (case%run%physics == 'coupled' .and. case%contact%lubrication &
        .and. .not. any(case%shape%kind == 'sphere')) call warnings%add('&contact lubrication', &
      case%contact%lubrication, 'has no effect: only blocks of kind ''sphere'' have such films')
    if (case%contact%model /= 'surface') return
    do s = 1, size(case%shape)
      if (case%shape(s)%member > 1) cycle   ! one of a family is enough
      if (case%shape(s)%spheres /= 'centroid') call warnings%add('&shape spheres', &
        trim(case%shape(s)%spheres), 'of '//trim(case%shape(s)%name)//': no sphere touches with ' &
        //'&contact model = ''surface'', they only come into run.h5', case%shape(s)%line)
    end do
  end subroutine look_at_contact

  !> Blocks that are due only after the end of the run.
  subroutine look_at_times(case, warnings)
    type(case_t), intent(in) :: case
    type(problems_t), intent(inout) :: warnings
    character(:), allocatable :: late
    type(place_t) :: place
    integer :: i, k, n

    late = ' due only after the end of the run, t_end = '//to_text(case%run%t_end)//' s'
    do i = 1, size(case%drop)
      associate (drop => case%drop(i))
        n = 0
        do k = 1, drop%count
          place = place_of_block(drop, k)
          if (place%time > case%run%t_end) n = n + 1
        end do
        if (n > 0) call warnings%add('&drop count', drop%count, to_text(n)//trim(merge(' is ', &
          ' are', n == 1))//late, drop%line)
      end associate
    end do
    do i = 1, size(case%body)
      if (case%body(i)%release_time > case%run%t_end) call warnings%add('&body release_time', &
        case%body(i)%release_time, 'is'//late, case%body(i)%line)
    end do
  end subroutine look_at_times

  !> Blocks that begin far above the tank.
  subroutine look_at_heights(case, shapes, warnings)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)
    type(problems_t), intent(inout) :: warnings
    character(:), allocatable :: group
    integer :: i, k, n

    n = 0
    do i = 1, size(case%drop)
      do k = 1, case%drop(i)%count
        if (k > 1 .and. .not. allocated(case%drop(i)%row)) exit   ! all fall from one place
        group = '&drop'
        if (allocated(case%drop(i)%row)) group = '&drop file = '//quoted_text(case%drop(i)%file) &
          //', block '//to_text(k)//':'
        if (n < max_bodies) call look_at(place_of_block(case%drop(i), k), group, case%drop(i)%line)
      end do
    end do
    do i = 1, size(case%body)
      if (n < max_bodies) call look_at(place_of_body(case%body(i)), '&body', &
                                             case%body(i)%line)
    end do
  contains
    subroutine look_at(place, group, line)
      type(place_t), intent(in) :: place
      character(*), intent(in) :: group
      integer, intent(in) :: line
      real(wp) :: above, turn(3, 3)
      integer :: s

      above = place%x(3) - case%grid%origin(3) - case%grid%length(3)
      if (above <= far_above*case%grid%length(3)) return   ! no need to look closer
      s = shape_of_place(place, shapes)
      if (s == 0) return
      turn = rotation_matrix(place%q)
      above = above - extent_along(shapes(s), -turn(3, :))
      if (above <= far_above*case%grid%length(3)) return
      n = n + 1
      call warnings%add_message(group//' position = '//to_text(place%x)//': begins ' &
        //brief(above, 3)//' m above the tank, which is '//brief(case%grid%length(3), 3) &
        //' m high; is that meant?', line)
    end subroutine look_at
  end subroutine look_at_heights

  !> Random drops of the same seed: their blocks have the same shifts and turns.
  subroutine look_at_seeds(case, warnings)
    type(case_t), intent(in) :: case
    type(problems_t), intent(inout) :: warnings
    logical :: random(size(case%drop))
    integer :: i

    do i = 1, size(case%drop)
      associate (drop => case%drop(i))
        random(i) = any(abs(drop%spread) > 0.0_wp) .or. drop%orientation == 'random' &
          .or. drop%tilt_deg > 0.0_wp .or. drop%shapes(1) /= '' &
          .or. any(case%shape%member > 0 .and. case%shape%name == drop%shape)
        if (.not. random(i)) cycle
        if (.not. any(case%drop(:i - 1)%seed == drop%seed .and. random(:i - 1))) cycle
        call warnings%add('&drop seed', drop%seed, 'is that of another &drop too: their blocks ' &
          //'have the same shifts, turns and stones', drop%line)
      end associate
    end do
  end subroutine look_at_seeds

  !> A block too light, too large, too coarse in the grid or in its own tetrahedra.
  subroutine look_at_shape(case, input, shape, warnings)
    type(case_t), intent(in) :: case
    type(shape_input_t), intent(in) :: input
    type(shape_t), intent(in) :: shape
    type(problems_t), intent(inout) :: warnings
    character(:), allocatable :: name
    real(wp) :: extent, cells, min_turning   ! [m], [cells], [kg/m3]
    real(wp) :: lowest, highest                ! contact spheres over the surface [m]

    name = trim(shape%name)
    extent = maxval(maxval(shape%point, 2) - minval(shape%point, 2))
    if (input%density < min_density) call warnings%add('&shape density', input%density, &
      'of '//name//' is in kg/m3; concrete has about 2300', input%line)
    min_turning = turning_share*case%fluid%liquid_density
    if (case%run%physics == 'coupled' .and. input%density < min_turning) call warnings%add( &
      '&shape density', input%density, 'of '//name//': it turns with the inertia of ' &
      //brief(min_turning, 3)//' kg/m3, for the liquid that it drags along', input%line)
    if (extent > largest_block) then
      if (input%kind == 'file') then
        call warnings%add('&shape scale', input%scale, name//' is '//brief(extent, 3) &
          //' m long; scale = 0.001 makes m of mm', input%line)
      else if (input%kind == 'rock') then
        call warnings%add('&shape mass_50', input%mass_50, name//' is '//brief(extent, 3) &
          //' m long; masses are in kg', input%line)
      else
        call warnings%add('&shape size', input%size(1), name//' is '//brief(extent, 3) &
          //' m long; lengths are in m, not in mm', input%line)
      end if
    end if
    if (case%run%physics == 'coupled') then
      cells = extent/maxval(case%grid%length/real(case%grid%cells, wp), case%grid%cells > 1)
      if (cells < min_cells) call warnings%add_message('&shape '//name//' is ' &
        //brief(cells, 3)//' cells long; below '//to_text(nint(min_cells)) &
        //' the water around it is coarse: more &grid cells', input%line)
    end if
    if (case%run%physics == 'light') call look_at_light(case, input, shape, extent, warnings)
    if (case%contact%model == 'spheres') then
      call height_errors(shape, lowest, highest)
      if (max(-lowest, highest) > 0.0_wp) call warnings%add_message('&shape '//name//': its ' &
        //'contact spheres reach up to '//brief(-lowest, 3)//' m short of its surface and ' &
        //brief(highest, 3)//' m beyond it', input%line)
    end if
    if (size(shape%tet, 2) > many_tets) call warnings%add_message('&shape '//name//' has ' &
      //to_text(size(shape%tet, 2))//' tetrahedra; more than '//to_text(many_tets) &
      //' make every step slow: simplify the drawing', input%line)
    if (any(input%kind == [character(8) :: 'sphere', 'cylinder']) .and. &
        size(shape%tet, 2) < few_tets) call warnings%add('&shape refinement', input%refinement, &
      'cuts '//name//' into '//to_text(size(shape%tet, 2)) &
      //' tetrahedra, more of a prism than round; a larger value cuts it more finely', input%line)
  end subroutine look_at_shape

  !> What a water without flow describes badly: slabs, and shallow water.
  subroutine look_at_light(case, input, shape, extent, warnings)
    type(case_t), intent(in) :: case
    type(shape_input_t), intent(in) :: input
    type(shape_t), intent(in) :: shape
    real(wp), intent(in) :: extent   !! of the shape [m]
    type(problems_t), intent(inout) :: warnings
    type(added_inertia_t) :: added

    added = added_inertia_of(shape)
    if (added%spread > compact) call warnings%add_message('&shape '//trim(input%name)//': its ' &
      //'added mass differs by '//brief(100.0_wp*added%spread, 2)//' % between directions; ' &
      //'''light'' takes the mean, and a tilted one glides as it should not', input%line)
    if (case%fluid%water_level - case%grid%origin(3) < shallow*extent) call warnings%add_message( &
      '&shape '//trim(input%name)//': the water is less than two blocks deep; entry, which ' &
      //'''light'' tells roughly, is all there is', input%line)
  end subroutine look_at_light

end module case_warnings_m
