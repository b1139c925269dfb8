!> The bodies of a case in their starting places, and what stands in the way of one of them.
!!
!! Measured with the true shapes and the rule of a release (`has_place`): a body has room where
!! nothing reaches deeper into it than 1 % of its size.
module scene_m
  use kinds_m, only: wp
  use errors_m, only: to_text, brief
  use vectors_m, only: norm
  use case_types_m, only: case_t, body_input_t, place_t, is_given
  use boundary_kinds_m, only: side_code, side_periodic, is_wall
  use run_groups_m, only: side_name
  use value_text_m, only: quoted_text
  use tet_mesh_m, only: shape_t
  use rigid_body_m, only: blocks_t, are_driven
  use case_blocks_m, only: blocks_init, attitude_on
  use drops_m, only: place_of_block, shape_of_place
  use walls_m, only: walls_t, walls_init
  use bed_m, only: bed_t
  use neighbours_m, only: nearest_shift
  use overlap_m, only: overlap_t, overlap_init, overlap_depth, wall_depth, has_place
  implicit none
  private
  public :: scene_t, set_scene, subject, held_text, near, is_free_beside, pair_depth, way_out

  !> The bodies of a case in their starting places, and one place more to try drops in.
  type :: scene_t
    type(blocks_t) :: blocks            !! bodies 1..n of the case, and n+1
    type(blocks_t) :: two               !! the two bodies looked at, far from all others
    type(walls_t) :: walls, no_walls    !! the latter with the periods only, no bed either
    type(overlap_t) :: overlap
    integer :: n = 0
    integer :: n_bodies = 0             !! those of `&body`, the others are fixed blocks of tables
    integer, allocatable :: line(:)     !! (n) lines of the bodies in the case file
    integer, allocatable :: origin(:, :)   !! (2, n + 1) drop and block of it, 0 for `&body`
    logical, allocatable :: held(:)     !! (n) fixed and never moved
    logical, allocatable :: outside(:)  !! (n) reported as outside the tank
    logical, allocatable :: dated(:)    !! (n) it is known when they are there
  end type scene_t

contains

  !> Put the good bodies of a case into a scene; without good shapes it stays empty.
  subroutine set_scene(case, shapes, bed, scene)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)
    type(bed_t), intent(in), target :: bed
    type(scene_t), intent(out) :: scene
    type(case_t) :: good          ! the good bodies and one more, no drops
    type(shape_t), allocatable :: made(:)
    logical :: use_it(size(case%body))
    logical, allocatable :: driven(:)
    integer :: n

    if (.not. any(shapes%volume > 0.0_wp)) return
    made = pack(shapes, shapes%volume > 0.0_wp)
    do n = 1, size(case%body)
      use_it(n) = .not. case%body(n)%faulty .and. any(made%name == case%body(n)%shape)
    end do
    good%body = pack(case%body, use_it)
    scene%n_bodies = size(good%body)
    call add_fixed_rows(case, made, bed, good%body, scene)
    scene%n = size(good%body)
    scene%line = good%body%line
    scene%dated = .not. good%body%time_faulty
    good%body = [good%body, body_input_t()]
    allocate (good%drop(0))
    good%body(scene%n + 1)%shape = made(1)%name
    good%body(scene%n + 1)%position = 0.0_wp
    call blocks_init(good, made, scene%blocks)
    good%body = [good%body(scene%n + 1), good%body(scene%n + 1)]
    call blocks_init(good, made, scene%two)
    call overlap_init(made, scene%overlap)
    if (.not. case%grid%extent_faulty) call walls_init(case%grid, case%boundary, scene%walls)
    scene%walls%bed => bed
    scene%no_walls%period = scene%walls%period
    allocate (scene%outside(scene%n), source=.false.)
    driven = are_driven(scene%blocks)
    scene%held = scene%blocks%fixed(:scene%n) .and. scene%dated .and. .not. driven(:scene%n)
  end subroutine set_scene

  !> The fixed blocks of tables, whose height is known, stand there like bodies of the case.
  subroutine add_fixed_rows(case, shapes, bed, body, scene)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)
    type(bed_t), intent(in) :: bed
    type(body_input_t), allocatable, intent(inout) :: body(:)
    type(scene_t), intent(inout) :: scene
    type(body_input_t), allocatable :: all_bodies(:)
    type(place_t) :: place
    integer :: i, k, n, s

    n = size(body)
    do i = 1, size(case%drop)
      if (allocated(case%drop(i)%row)) n = n + count(case%drop(i)%row%fixed)
    end do
    allocate (all_bodies(n), scene%origin(2, n + 1))
    scene%origin = 0
    n = size(body)
    all_bodies(:n) = body
    do i = 1, size(case%drop)
      if (case%drop(i)%faulty .or. .not. allocated(case%drop(i)%row)) cycle
      if (case%drop(i)%handling%if_blocked == 'raise') cycle   ! it may stand higher
      do k = 1, case%drop(i)%count
        if (.not. case%drop(i)%row(k)%fixed) cycle
        place = place_of_block(case%drop(i), k)
        s = shape_of_place(place, shapes)
        if (s == 0 .or. .not. is_given(place%x(3))) cycle
        n = n + 1
        all_bodies(n) = body_input_t(line=case%drop(i)%line, shape=shapes(s)%name, &
          position=place%x, quaternion=attitude_on(bed, case%drop(i)%handling, place, shapes(s)), &
          velocity=place%v, fixed=.true., release_time=place%time)
        scene%origin(:, n) = [i, k]
      end do
    end do
    body = all_bodies(:n)
    scene%origin = scene%origin(:, :n + 1)
  end subroutine add_fixed_rows

  !> How a message about body b of the scene begins.
  function subject(case, scene, b) result(text)
    type(case_t), intent(in) :: case
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: b
    character(:), allocatable :: text

    text = '&body position = '//to_text(scene%blocks%x(:, b))
    if (scene%origin(1, b) == 0) return
    associate (drop => case%drop(scene%origin(1, b)))
      text = '&drop file = '//quoted_text(drop%file)//': line ' &
        //to_text(drop%row(scene%origin(2, b))%line)
    end associate
  end function subject

  !> Where body b of the scene stands in the case.
  function held_text(case, scene, b) result(text)
    type(case_t), intent(in) :: case
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: b
    character(:), allocatable :: text

    text = '&body on line '//to_text(scene%line(b))
    if (scene%origin(1, b) == 0) return
    associate (drop => case%drop(scene%origin(1, b)))
      text = 'block on line '//to_text(drop%row(scene%origin(2, b))%line)//' of '//drop%file
    end associate
  end function held_text

  !> Put body b in place 1 or 2 of the two bodies looked at.
  subroutine place(scene, b, k)
    type(scene_t), intent(inout) :: scene
    integer, intent(in) :: b, k

    scene%two%shape(k) = scene%blocks%shape(b)
    scene%two%x(:, k) = scene%blocks%x(:, b)
    scene%two%q(:, k) = scene%blocks%q(:, b)
  end subroutine place

  !> From body b to the nearest image of body a [m].
  pure function distance(scene, a, b) result(d)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: a, b
    real(wp) :: d(3)

    d = scene%blocks%x(:, a) - scene%blocks%x(:, b)
    d = d + nearest_shift(scene%walls%period, d)
  end function distance

  !> Do the bounding spheres of bodies a and b meet?
  pure function near(scene, a, b) result(yes)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: a, b
    logical :: yes

    associate (shapes => scene%blocks%shapes, shape => scene%blocks%shape)
      yes = norm(distance(scene, a, b)) < shapes(shape(a))%radius + shapes(shape(b))%radius
    end associate
  end function near

  !> Is there room for body b if body a is the only other one, and no wall?
  function is_free_beside(scene, a, b) result(free)
    type(scene_t), intent(inout) :: scene
    integer, intent(in) :: a, b
    logical :: free

    call place(scene, a, 1)
    call place(scene, b, 2)
    scene%two%present = .true.
    free = has_place(scene%no_walls, scene%two, 2, scene%overlap)
  end function is_free_beside

  !> Depth of bodies a and b in one another if it is more than a release allows, else zero [m].
  function pair_depth(scene, a, b) result(depth)
    type(scene_t), intent(inout) :: scene
    integer, intent(in) :: a, b
    real(wp) :: depth
    real(wp) :: d(3)

    depth = 0.0_wp
    if (.not. near(scene, a, b)) return
    if (is_free_beside(scene, a, b)) then
      if (is_free_beside(scene, b, a)) return
    end if
    associate (blocks => scene%blocks)
      d = distance(scene, a, b)
      depth = overlap_depth(blocks%shapes(blocks%shape(a)), blocks%x(:, b) + d, blocks%q(:, a), &
                            blocks%shapes(blocks%shape(b)), blocks%x(:, b), blocks%q(:, b))
    end associate
  end function pair_depth

  !> How body b lies outside the tank: behind a wall, or its centre beyond a side without a wall
  !! other than the top. Empty if it does not.
  function way_out(case, scene, b) result(text)
    type(case_t), intent(in) :: case
    type(scene_t), intent(inout) :: scene
    integer, intent(in) :: b
    character(:), allocatable :: text
    type(walls_t) :: one
    real(wp) :: depth, deepest, beyond
    integer :: w, s, d, side

    text = ''
    call place(scene, b, 1)
    scene%two%present = .false.
    if (.not. has_place(scene%walls, scene%two, 1, scene%overlap)) then
      deepest = 0.0_wp
      do w = 1, scene%walls%n
        one%n = 1
        one%normal(:, 1) = scene%walls%normal(:, w)
        one%offset(1) = scene%walls%offset(w)
        if (has_place(one, scene%two, 1, scene%overlap)) cycle
        depth = wall_depth(scene%blocks%shapes(scene%blocks%shape(b)), scene%blocks%x(:, b), &
                           scene%blocks%q(:, b), one)
        if (depth <= deepest) cycle
        deepest = depth
        s = 2 - mod(-scene%walls%number(w), 2)
        d = (1 - scene%walls%number(w))/2
        text = 'reaches '//brief(depth, 3)//' m through the wall '//side_name(s, d)
      end do
      if (len(text) > 0) return
      text = 'reaches more than 1 % of its size into the bed'
      return
    end if
    do d = 1, 3
      do s = 1, 2
        side = side_code(case%boundary%kind(s, d))
        if (is_wall(side) .or. side == side_periodic) cycle   ! walls have been looked at
        if (case%boundary%faulty(s, d)) cycle
        beyond = scene%blocks%x(d, b) - case%grid%origin(d)
        if (s == 2) beyond = case%grid%length(d) - beyond
        if (beyond < 0.0_wp .and. .not. (s == 2 .and. d == 3)) then
          text = 'its centre lies '//brief(-beyond, 3)//' m beyond '//side_name(s, d)
        end if
      end do
    end do
  end function way_out

end module scene_m
