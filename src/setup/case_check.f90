!> Checks of a case that need geometry: bodies inside the tank and apart, room for the drops.
!!
!! What `read_case` found faulty is left out (a side, a shape, a body, but nothing else), so these
!! problems can be listed together with those. Places and overlaps: `scene_m`.
module case_check_m
  use kinds_m, only: wp
  use errors_m, only: problems_t, to_text, brief
  use case_types_m, only: case_t, place_t, is_given, smallest_spacing, has_flow
  use boundary_kinds_m, only: side_code, is_wall
  use run_groups_m, only: side_name
  use value_text_m, only: quoted_text
  use tet_mesh_m, only: shape_t, is_called
  use shapes_builtin_m, only: make_shape, given_size
  use drops_m, only: place_of_block, shape_of_place, count_of_shape
  use wave_step_m, only: capillary_step
  use case_blocks_m, only: height_at_level, attitude_on
  use rest_depth_m, only: n_free
  use start_bodies_m, only: with_begun
  use given_motion_m, only: pose_at, fastest_between
  use bed_m, only: bed_t
  use neighbours_m, only: pair_list_t, sort_bodies, add_neighbours
  use scene_m, only: scene_t, set_scene, subject, held_text, near, is_free_beside, pair_depth, &
    way_out
  use overlap_solid_m, only: expected_samples
  use panels_m, only: surface_triangles
  use panel_method_m, only: max_surface_panels
  implicit none
  private
  public :: make_shapes, check_case, check_widths

  integer, parameter :: max_reported = 20     !! pairs of overlapping bodies named one by one
  integer, parameter :: max_counted = 1000    !! pairs of overlapping bodies looked for
  real(wp), parameter :: max_samples = 1.0e7_wp   !! points on a shape that measure its overlap
  real(wp), parameter :: min_cells_wide = 1.0_wp  !! of a free block

contains

  !> The shapes of a case; a faulty one stays empty (volume 0).
  subroutine make_shapes(case, shapes, problems)
    type(case_t), intent(in) :: case
    type(shape_t), allocatable, intent(out) :: shapes(:)
    type(problems_t), intent(inout) :: problems
    type(shape_t) :: empty
    character(:), allocatable :: message
    real(wp) :: samples
    logical :: reported(size(case%shape))   ! of stones: that of the first of the family
    integer :: s, first

    reported = .false.
    allocate (shapes(size(case%shape)))
    do s = 1, size(case%shape)
      if (case%shape(s)%faulty) cycle
      call make_shape(case%shape(s), shapes(s), message)
      if (len(message) == 0) then
        samples = expected_samples(shapes(s))
        if (samples > max_samples) message = given_size(case%shape(s))//': so slender a ' &
          //'block would need '//brief(samples)//' points on its surface, at most ' &
          //brief(max_samples)//', as of a box 400 times as long as it is thick'
      end if
      if (len(message) == 0 .and. case%run%physics == 'light') then
        if (surface_triangles(shapes(s)) > max_surface_panels) message = given_size(case%shape(s)) &
          //': a surface of '//to_text(surface_triangles(shapes(s)))//' triangles, physics = ' &
          //'''light'' takes '//to_text(max_surface_panels)//' at most: simplify the drawing'
      end if
      if (len(message) == 0) cycle
      shapes(s) = empty
      first = s - max(case%shape(s)%member - 1, 0)
      if (.not. reported(first)) call problems%add_message('&shape '//message, case%shape(s)%line)
      reported(first) = .true.
    end do
  end subroutine make_shapes

  !> Everything about a case that needs the shapes of its bodies.
  subroutine check_case(case, shapes, bed, problems)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)   !! from `make_shapes`, one for each `&shape`
    type(bed_t), intent(in), target :: bed   !! from `make_bed`
    type(problems_t), intent(inout) :: problems
    type(scene_t) :: scene
    type(case_t) :: known   ! the case without the sides that are wrong
    character(:), allocatable :: where_to, first
    integer :: b, i, n, n_begun   ! outside

    known = with_begun(case)
    where (case%boundary%faulty) known%boundary%kind = 'open'   ! neither a wall nor a period
    if (.not. case%grid%extent_faulty) call check_water(case, problems)
    if (.not. case%grid%extent_faulty) call check_lengths(known, shapes, problems)
    call set_scene(known, shapes, bed, scene)
    if (.not. allocated(scene%line)) return
    n_begun = 0
    first = ''
    do b = 1, merge(0, scene%n_bodies, case%grid%extent_faulty)   ! inside the tank?
      where_to = way_out(known, scene, b)
      scene%outside(b) = len(where_to) > 0
      if (.not. scene%outside(b)) cycle
      where_to = 'position = '//to_text(scene%blocks%x(:, b))//': '//where_to &
        //'; a body must lie inside the tank'
      if (scene%line(b) == case%start%line) then   ! one cause for all of them
        n_begun = n_begun + 1
        if (n_begun == 1) first = where_to
      else
        call problems%add_message('&body '//where_to, scene%line(b))
      end if
    end do
    if (n_begun > 1) first = first//' (likewise '//to_text(n_begun - 1)//' more blocks)'
    if (n_begun > 0) call problems%add_message('&start: '//first, case%start%line)
    n = problems%n
    call check_pairs(known, scene, problems)
    if (problems%n == n .and. .not. case%grid%extent_faulty) call check_ways(known, scene, problems)
    if (case%grid%extent_faulty) return
    do i = 1, size(case%drop)
      if (.not. case%drop(i)%faulty) call check_drop(known, i, scene, problems)
    end do
  end subroutine check_case

  !> Boxes of liquid must reach into the tank; a fixed step must be stable with surface tension.
  subroutine check_water(case, problems)
    type(case_t), intent(in) :: case
    type(problems_t), intent(inout) :: problems
    real(wp) :: limit
    integer :: i

    do i = 1, size(case%water)
      if (case%water(i)%faulty) cycle
      if (any(case%water(i)%min >= case%grid%origin + case%grid%length) .or. &
          any(case%water(i)%max <= case%grid%origin)) then
        call problems%add_message('&water min = '//to_text(case%water(i)%min)//', max = ' &
          //to_text(case%water(i)%max)//': lies outside the tank', case%water(i)%line)
      end if
    end do
    if (case%grid%cells_faulty .or. .not. has_flow(case%run) .or. case%run%cfl_max > 0.0_wp) return
    limit = capillary_step(case%fluid, smallest_spacing(case%grid))
    if (case%run%dt > limit) call problems%add('&run dt', case%run%dt, 'unstable with surface ' &
      //'tension, must be at most '//brief(limit, 3)//' s here; or cfl_max > 0 lets the step ' &
      //'shrink', case%run%line)
  end subroutine check_water

  !> No shape in use is longer than half a period.
  subroutine check_lengths(case, shapes, problems)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)
    type(problems_t), intent(inout) :: problems
    real(wp) :: length, shortest   ! line of a shape, period [m]
    integer :: s, d, i

    shortest = minval(case%grid%length, case%boundary%kind(1, :) == 'periodic')
    do s = 1, size(shapes)
      if (shapes(s)%volume <= 0.0_wp) cycle
      if (.not. any(is_called(shapes(s), case%body%shape)) .and. all([(count_of_shape( &
        case%drop(i), shapes(s), with_fixed=.true.), i=1, size(case%drop))] == 0)) cycle
      if (2*shapes(s)%radius <= 0.5_wp*shortest) cycle   ! no need to look closer
      length = longest_line(shapes(s))
      do d = 1, 3
        if (case%boundary%kind(1, d) /= 'periodic' .or. length <= 0.5_wp*case%grid%length(d)) cycle
        call problems%add_message('&shape name = '//quoted_text(trim(shapes(s)%name))//': ' &
          //brief(length, 3)//' m long, must not be more than half the period ' &
          //to_text(case%grid%length(d))//' m between '//side_name(1, d) &
          //' and '//side_name(2, d), &
          case%shape(s)%line)
      end do
    end do
  end subroutine check_lengths

  !> Largest distance between two points of a shape, which are corners of its facets [m].
  pure function longest_line(shape) result(length)
    type(shape_t), intent(in) :: shape
    real(wp) :: length
    logical :: is_corner(size(shape%point, 2))
    integer, allocatable :: corner(:)
    integer :: i, k

    if (shape%kind == 'sphere') then
      length = 2*shape%sphere_radius(1)
      return
    end if
    is_corner = .false.
    is_corner(shape%facet_point) = .true.
    corner = pack([(i, i=1, size(is_corner))], is_corner)
    length = 0.0_wp
    do i = 1, size(corner)
      do k = i + 1, size(corner)
        length = max(length, sum((shape%point(:, corner(k)) - shape%point(:, corner(i)))**2))
      end do
    end do
    length = sqrt(length)
  end function longest_line

  !> Bodies do not overlap at the start; one that is released later finds no held body in its place.
  subroutine check_pairs(case, scene, problems)
    type(case_t), intent(in) :: case
    type(scene_t), intent(inout) :: scene
    type(problems_t), intent(inout) :: problems
    type(pair_list_t) :: pairs
    real(wp), allocatable :: x(:, :), radius(:)
    character(:), allocatable :: more
    integer :: a, b, n, p, cells(3)
    real(wp) :: depth

    if (count(.not. scene%outside .and. scene%dated) < 2) return
    allocate (x(3, scene%n), radius(scene%n))
    associate (blocks => scene%blocks, period => scene%walls%period)
      do b = 1, scene%n
        x(:, b) = blocks%x(:, b)
        where (period > 0.0_wp) x(:, b) = modulo(x(:, b), period)
        radius(b) = blocks%shapes(blocks%shape(b))%radius
      end do
      call sort_bodies(x, radius, .not. scene%outside .and. scene%dated, period, 0.0_wp, &
        cells, pairs)
    end associate
    n = 0
    do b = 2, scene%n
      if (scene%outside(b) .or. .not. scene%dated(b)) cycle
      pairs%n = 0
      call add_neighbours(b, x, radius, scene%walls%period, 0.0_wp, cells, pairs)
      do p = 1, pairs%n
        a = pairs%b(p)
        associate (time => scene%blocks%release_time)   ! the first may have moved away
          if (n == max_counted .or. .not. ((time(a) <= 0.0_wp .and. time(b) <= 0.0_wp) &
            .or. (scene%held(a) .and. time(a) <= time(b)) &
            .or. (scene%held(b) .and. time(b) <= time(a)))) cycle
        end associate
        depth = pair_depth(scene, a, b)
        if (depth <= 0.0_wp) cycle
        n = n + 1
        if (n > max_reported) cycle
        call problems%add_message(subject(case, scene, b)//': overlaps the ' &
          //held_text(case, scene, a)//' by ' &
          //brief(depth, 3)//' m; bodies must lie apart at the start', scene%line(b))
      end do
      if (n == max_counted) exit
    end do
    if (n > max_reported) then
      more = to_text(n - max_reported)//' more pairs of bodies overlap'
      if (n == max_counted) more = 'at least '//more
      call problems%add_message('&body: '//more)
    end if
  end subroutine check_pairs

  !> A body that a table moves stays in the tank, above the bed and apart from other fixed bodies;
  !! the first time that it does not is told.
  subroutine check_ways(case, scene, problems)
    type(case_t), intent(in) :: case
    type(scene_t), intent(inout) :: scene
    type(problems_t), intent(inout) :: problems
    real(wp), parameter :: part = 0.02_wp, shortest = 0.0005_wp
      !! steps: of the radius of the fastest body and of the time until the end, of the latter [-]
    character(:), allocatable :: trouble
    logical, allocatable :: told(:)
    real(wp) :: t, end, step, depth, v(3), omega(3), fastest(2)
    integer :: a, b

    associate (blocks => scene%blocks, path => scene%blocks%path(:scene%n))
      allocate (told(scene%n), source=scene%outside .or. path%n == 0)
      end = 0.0_wp
      do b = 1, scene%n
        if (.not. told(b)) end = max(end, min(case%run%t_end, path(b)%time(path(b)%n)))
      end do
      t = 0.0_wp
      do while (.not. all(told))
        step = part*end
        do b = 1, scene%n
          if (path(b)%n == 0) cycle
          call pose_at(path(b), t, blocks%x(:, b), blocks%q(:, b), v, omega)
          fastest = fastest_between(path(b), t, t + part*end)
          associate (radius => blocks%shapes(blocks%shape(b))%radius)
            step = min(step, part*radius/max(fastest(1) + radius*fastest(2), tiny(step)))
          end associate
        end do
        do b = 1, scene%n
          if (told(b) .or. blocks%release_time(b) > t) cycle
          trouble = way_out(case, scene, b)
          do a = 1, scene%n
            if (len(trouble) > 0) exit
            if (a == b .or. .not. scene%dated(a) .or. blocks%release_time(a) > t) cycle
            if (.not. scene%held(a) .and. path(a)%n == 0) cycle
            depth = pair_depth(scene, a, b)
            if (depth > 0.0_wp) trouble = 'reaches '//brief(depth, 3)//' m into the ' &
              //held_text(case, scene, a)
          end do
          told(b) = len(trouble) > 0
          if (told(b)) call problems%add_message('&body motion = '//quoted_text(trim(case%body( &
            findloc(case%body%line, scene%line(b), 1))%motion))//': at '//brief(t, 3)//' s it ' &
            //trouble//'; a moved body stays inside the tank and apart from fixed bodies', &
            scene%line(b))
        end do
        if (t >= end) exit
        t = min(end, t + max(step, shortest*end))
      end do
    end associate
  end subroutine check_ways

  !> Every block of a drop has one place, drawn from its seed, spread and tilt included. One whose
  !! place lies in a wall or a held body could wait for ever, so it is a problem now. One that is
  !! set on what lies there, or raised above it, only needs room at the highest place.
  subroutine check_drop(case, i, scene, problems)
    type(case_t), intent(in) :: case
    integer, intent(in) :: i   !! number of the drop
    type(scene_t), intent(inout) :: scene
    type(problems_t), intent(inout) :: problems
    type(place_t) :: place
    character(:), allocatable :: reason, first
    integer :: b, k, n
    logical :: hangs   ! there is nothing to be set on

    b = scene%n + 1
    n = 0
    first = ''
    associate (drop => case%drop(i))
      do k = 1, drop%count
        if (case%begun%n > 0) then   ! where another run left it
          if (any(case%begun%drop == i .and. case%begun%block == k)) cycle
        end if
        place = place_of_block(drop, k)
        scene%blocks%shape(b) = shape_of_place(place, scene%blocks%shapes)
        if (scene%blocks%shape(b) == 0) cycle
        place%q = attitude_on(scene%walls%bed, drop%handling, place, &
          scene%blocks%shapes(scene%blocks%shape(b)))
        scene%blocks%q(:, b) = place%q
        scene%blocks%release_time(b) = place%time
        scene%origin(:, b) = [i, k]
        hangs = .not. (is_given(place%x(3)) .or. scene%walls%bed%there &
                       .or. is_wall(side_code(case%boundary%kind(1, 3))))
        if (.not. is_given(place%x(3)) .or. drop%handling%if_blocked == 'raise') then
          place%x(3) = height_at_level(case, scene%blocks%shapes(scene%blocks%shape(b)), place%q, &
                                       at_water=.false.)
        end if
        scene%blocks%x(:, b) = place%x
        reason = hindrance(case, scene, b)
        if (hangs) reason = 'has neither floor nor bed to lie on'
        if (len(reason) == 0) cycle
        n = n + 1
        if (place%line > 0 .and. n <= max_reported) call problems%add_message('&drop file = ' &
          //quoted_text(drop%file)//': line '//to_text(place%line)//': '//reason &
          //'; it could never be released', drop%line)
        if (n > 1) cycle
        first = reason
        if (drop%count > 1) first = 'block '//to_text(k)//' at '//to_text(place%x)//' '//reason
      end do
      if (n > max_reported .and. allocated(drop%row)) call problems%add_message('&drop file = ' &
        //quoted_text(drop%file)//': '//to_text(n - max_reported)//' more such places', drop%line)
      if (n == 0 .or. allocated(drop%row)) return
      first = first//'; it could never be released'
      if (n > 1) first = first//'; '//to_text(n)//' of '//to_text(drop%count) &
        //' blocks have such places'
      call problems%add_message('&drop position = '//to_text(drop%position)//': '//first, &
        drop%line)
    end associate
  end subroutine check_drop

  !> What stands for ever in the place of body b, the last of the scene; empty if nothing does.
  function hindrance(case, scene, b) result(text)
    type(case_t), intent(in) :: case
    type(scene_t), intent(inout) :: scene
    integer, intent(in) :: b
    character(:), allocatable :: text
    integer :: a

    text = way_out(case, scene, b)
    if (len(text) > 0) return
    if (any(scene%origin(1, :scene%n) == scene%origin(1, b) .and. &
            scene%origin(2, :scene%n) == scene%origin(2, b))) return   ! `check_pairs` has looked
    do a = 1, scene%n
      if (.not. scene%held(a) .or. scene%outside(a)) cycle
      if (scene%blocks%release_time(a) > scene%blocks%release_time(b)) cycle
      if (.not. near(scene, a, b)) cycle
      if (is_free_beside(scene, a, b)) cycle
      text = 'lies inside the fixed '//held_text(case, scene, a)
      exit
    end do
  end function hindrance

  !> In resolved water every shape of a free block is at least a cell wide; of a family the smallest
  !! stone counts. One that hides between the faces of a cell has no drag, and what the cells at its
  !! walls hand back to it (`wall_balance_m`), with arms of a cell, spins and throws it
  !! (docs/decisions/coupling.md).
  subroutine check_widths(case, shapes, problems)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)   !! one for each `&shape`; a faulty one has no volume
    type(problems_t), intent(inout) :: problems
    character(:), allocatable :: cure
    real(wp) :: edge, width(size(shapes))    ! largest of a cell, of the shapes [m]
    real(wp) :: box(3)                       ! edges [m]
    integer :: s

    if (case%run%physics /= 'coupled') return
    if (case%grid%extent_faulty .or. case%grid%cells_faulty) return
    edge = maxval(case%grid%length/real(case%grid%cells, wp), case%grid%cells > 1)
    cure = ''
    width = sqrt(huge(width))   ! of a faulty shape: wide enough, without an overflow below
    do s = 1, size(shapes)   ! the middle edge of the box around it: plates fall safely, rods do not
      if (shapes(s)%volume <= 0.0_wp) cycle
      box = maxval(shapes(s)%point, 2) - minval(shapes(s)%point, 2)
      width(s) = sum(box) - minval(box) - maxval(box)
    end do
    do s = 1, size(shapes)
      if (width(s)*(1.0_wp + 1.0e-9_wp) >= min_cells_wide*edge) cycle   ! round-off apart
      if (shapes(s)%family /= '') then
        if (s /= minloc(width, 1, shapes%family == shapes(s)%family)) cycle
      end if
      if (n_free(case, shapes(s)) == 0) cycle
      cure = 'block at least '//brief(min_cells_wide*edge, 3)//' m wide'
      if (shapes(s)%family /= '') cure = 'mass_min of '//brief(shapes(s)%density &
        *shapes(s)%volume*(min_cells_wide*edge/width(s))**3, 3)//' kg'
      call problems%add_message('&shape '//trim(shapes(s)%name)//' is '//brief(width(s), 3) &
        //' m wide, '//brief(width(s)/edge, 2)//' of a cell of '//brief(edge, 3) &
        //' m; resolved water needs one cell across a free block: finer &grid cells, physics = ' &
        //'''light'', or a '//cure, case%shape(s)%line)
    end do
  end subroutine check_widths

end module case_check_m
