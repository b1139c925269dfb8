!> `&start`: free blocks begin where another run left them.
!!
!! Of each shape the first free block of that run becomes the first free block here, and so on, with
!! place, attitude, velocity and spin of the last row until the time asked for; those not released
!! by then begin as the case has them. A shape of which the case names no free block brings its
!! blocks along as bodies. What contacts remember of their past is not taken over.
module start_bodies_m
  use kinds_m, only: wp, name_length
  use moments_m, only: has_come
  use errors_m, only: problems_t, to_text
  use case_types_m, only: case_t, body_input_t, begun_t
  use named_files_m, only: found_file
  use value_text_m, only: quoted_text
  use tet_mesh_m, only: shape_t
  use rigid_body_m, only: blocks_t, let_go, out
  use case_blocks_m, only: blocks_init
  use hdf5_file_m, only: h5_file_t
  implicit none
  private
  public :: read_start, with_begun

  real(wp), parameter :: same_time = 1.0e-9_wp   !! times this close are one, over them [-]
  real(wp), parameter :: same_mass = 1.0e-9_wp   !! masses this close are one [-]

contains

  !> Read the file of `&start` and see which blocks begin there; `case%begun` holds it.
  subroutine read_start(case, shapes, problems)
    type(case_t), intent(inout) :: case
    type(shape_t), intent(in) :: shapes(:)
    type(problems_t), intent(inout) :: problems
    type(begun_t) :: left   ! all blocks of the other run
    logical, allocatable :: free(:), taken(:)
    real(wp), allocatable :: mass(:)   ! [kg]
    logical :: faultless

    if (len_trim(case%start%file) == 0 .or. case%run%physics == 'fluid') return
    faultless = problems%n == 0
    allocate (free(0), taken(0), mass(0))
    call read_left(case, left, free, taken, mass, problems)
    if (.not. faultless .or. problems%n > 0) return   ! what is wrong may be what would match
    call match(case, shapes, left, free, taken, mass, problems)
  end subroutine read_start

  !> Report a problem with the group.
  subroutine report(case, what, problems)
    type(case_t), intent(in) :: case
    character(*), intent(in) :: what
    type(problems_t), intent(inout) :: problems

    call problems%add_message('&start file = '//quoted_text(case%start%file)//': '//what, &
                              case%start%line)
  end subroutine report

  !> The blocks in the file at the time asked for.
  subroutine read_left(case, left, free, taken, mass, problems)
    type(case_t), intent(in) :: case
    type(begun_t), intent(inout) :: left
    logical, allocatable, intent(inout) :: free(:), taken(:)   !! not fixed; and released by then
    real(wp), allocatable, intent(inout) :: mass(:)            !! [kg]
    type(problems_t), intent(inout) :: problems
    type(h5_file_t) :: file
    real(wp), allocatable :: time(:), release_time(:), exit_time(:)
    integer, allocatable :: extent(:), fixed(:), status(:)
    integer :: row

    call file%open(found_file(case%start%file), .false., .false.)
    if (file%info == 0) then
      if (.not. file%has('/bodies/position')) then
        call report(case, 'holds no blocks; must be the run.h5 of a run with blocks', problems)
        call file%close()
        return
      end if
    end if
    call file%shape_of('/bodies/time', extent)
    if (file%info == 0) then
      allocate (time(product(extent)), source=0.0_wp)
      call file%read('/bodies/time', time)
    end if
    call file%shape_of('/bodies/mass', extent)
    if (file%info == 0) left%n = product(extent)
    associate (n => left%n)
      allocate (left%shape(n), release_time(n), exit_time(n), status(n))
      left%name = spread(repeat(' ', name_length), 1, n)
      mass = spread(0.0_wp, 1, n)
      allocate (left%x(3, n), left%q(4, n), left%v(3, n), left%omega(3, n), fixed(n))
      call file%read('/bodies/shape', left%shape)
      if (file%has('/bodies/name')) call file%read('/bodies/name', left%name)
      call file%read('/bodies/mass', mass)
      call file%read('/bodies/fixed', fixed)
      call file%read('/bodies/release_time', release_time)
      call file%read('/bodies/exit_time', exit_time)
      call file%read('/bodies/status', status)
      if (file%info == 0) then
        row = row_of(case, time, problems)
        if (row > 0) then
          left%time = time(row)
          free = fixed == 0
          taken = free .and. has_come(release_time, left%time) .and. (status == let_go &
            .or. (status == out .and. .not. has_come(exit_time, left%time)))
          call read_row('position', 3, left%x)
          call read_row('quaternion', 4, left%q)
          call read_row('velocity', 3, left%v)
          call read_row('angular_velocity', 3, left%omega)
        end if
      end if
    end associate
    if (file%info /= 0) call report(case, file%message, problems)
    call file%close()
  contains
    !> One row of a column of vectors.
    subroutine read_row(name, m, a)
      character(*), intent(in) :: name
      integer, intent(in) :: m   !! components
      real(wp), intent(out) :: a(:, :)
      real(wp) :: values(m*left%n)

      values = 0.0_wp
      call file%read('/bodies/'//name, values, [1, 1, row], [m, left%n, 1])
      a = reshape(values, [m, left%n])
    end subroutine read_row
  end subroutine read_left

  !> The last row until the time of the group; 0 with a problem if the run has none.
  function row_of(case, time, problems) result(row)
    type(case_t), intent(in) :: case
    real(wp), intent(in) :: time(:)   !! of the rows [s]
    type(problems_t), intent(inout) :: problems
    integer :: row

    row = size(time)
    if (case%start%time < 0.0_wp .and. row > 0) return
    row = count(time <= case%start%time*(1.0_wp + same_time))
    if (size(time) == 0) then
      call report(case, 'holds no rows', problems)
    else if (row == 0 .or. case%start%time*(1.0_wp - same_time) > time(size(time))) then
      row = 0
      call problems%add_message('&start time = '//to_text(case%start%time)//': the run in ' &
        //quoted_text(case%start%file)//' goes from '//to_text(time(1))//' to ' &
        //to_text(time(size(time)))//' s', case%start%line)
    end if
  end function row_of

  !> Give the blocks of the other run to those of the case, shape by shape.
  subroutine match(case, shapes, left, free, taken, mass, problems)
    type(case_t), intent(inout) :: case
    type(shape_t), intent(in) :: shapes(:)
    type(begun_t), intent(in) :: left
    logical, intent(in) :: free(:), taken(:)
    real(wp), intent(in) :: mass(:)   !! [kg]
    type(problems_t), intent(inout) :: problems
    type(blocks_t) :: blocks
    integer :: here(left%n)      ! the block of the case that each becomes; 0: none
    integer :: form(left%n), number(left%n)   ! of each there: shape, among the free ones of it
    integer, allocatable :: number_here(:)
    integer :: i, k, s, n_there, n_here, last
    integer :: n_alike(3)                      ! faults of a kind
    character(2*name_length + 120) :: first(3)   ! of them

    n_alike = 0
    call blocks_init(case, shapes, blocks)
    form = [(findloc(shapes%name == left%shape(i), .true., 1), i=1, left%n)]
    number = [(count(free(:i) .and. form(:i) == form(i)), i=1, left%n)]
    allocate (number_here(blocks%n))
    do i = 1, blocks%n
      number_here(i) = count(.not. blocks%fixed(:i) .and. blocks%shape(:i) == blocks%shape(i))
    end do
    here = 0
    do i = 1, left%n
      if (.not. taken(i)) cycle
      if (any(left%shape(:i - 1) == left%shape(i) .and. taken(:i - 1))) cycle   ! has been looked at
      n_there = count(taken .and. left%shape == left%shape(i))
      s = form(i)
      if (s == 0) then
        call differs(1, 'has '//to_text(n_there)//' free blocks of the shape ' &
          //quoted_text(trim(left%shape(i)))//', which no &shape here has')
        cycle
      end if
      if (abs(mass(i) - shapes(s)%density*shapes(s)%volume) > same_mass*mass(i)) then
        call differs(2, 'a block of the shape '//quoted_text(trim(left%shape(i)))//' has ' &
          //to_text(mass(i))//' kg there and '//to_text(shapes(s)%density*shapes(s)%volume) &
          //' kg here; shapes must be the same')
        cycle
      end if
      n_here = count(blocks%shape == s .and. .not. blocks%fixed)
      if (n_here == 0) cycle   ! they come along
      last = maxval(number, taken .and. form == s)
      if (last > n_here) then
        call differs(3, 'has free blocks of the shape '//quoted_text(trim(left%shape(i))) &
          //' up to number '//to_text(last)//', this case names '//to_text(n_here) &
          //'; name as many, or none and they come along')
        cycle
      end if
      do k = 1, left%n   ! the k-th free block of a shape there is the k-th here
        if (taken(k) .and. form(k) == s) here(k) = findloc(blocks%shape == s .and. .not. &
          blocks%fixed .and. number_here == number(k), .true., 1)
      end do
    end do
    do k = 1, size(first)
      if (n_alike(k) > 1) first(k) = trim(first(k))//' (likewise '//to_text(n_alike(k) - 1) &
        //' more shapes)'
      if (n_alike(k) > 0) call report(case, trim(first(k)), problems)
    end do
    if (problems%n > 0) return
    call bring_along(case, left, taken .and. here == 0)
    call keep(case%begun)
  contains
    !> Note a fault of a shape. Of a kind the first is told, and the number of the others.
    subroutine differs(kind, what)
      integer, intent(in) :: kind
      character(*), intent(in) :: what

      n_alike(kind) = n_alike(kind) + 1
      if (n_alike(kind) == 1) first(kind) = what
    end subroutine differs

    !> Remember the blocks that the case names, by drop and number.
    subroutine keep(begun)
      type(begun_t), intent(inout) :: begun
      integer :: named(count(here > 0)), k, d

      named = pack([(k, k=1, left%n)], here > 0)
      begun%n = size(named)
      begun%time = left%time
      begun%shape = left%shape(named)
      begun%name = left%name(named)
      begun%x = left%x(:, named) + spread(case%start%shift, 2, size(named))
      begun%q = left%q(:, named)
      begun%v = left%v(:, named)
      begun%omega = left%omega(:, named)
      begun%block = here(named)
      allocate (begun%drop(size(named)), source=0)
      do k = 1, size(named)
        associate (block => begun%block(k))
          if (block <= size(case%body) - count(taken .and. here == 0)) cycle
          block = block - (size(case%body) - count(taken .and. here == 0))
          do d = 1, size(case%drop)
            begun%drop(k) = d
            if (block <= case%drop(d)%count) exit
            block = block - case%drop(d)%count
          end do
        end associate
      end do
    end subroutine keep
  end subroutine match

  !> The case with the blocks that begin elsewhere as bodies there, for the checks of places.
  function with_begun(case) result(known)
    type(case_t), intent(in) :: case
    type(case_t) :: known
    type(body_input_t), allocatable :: body(:)
    integer :: i, b, n

    known = case
    if (case%begun%n == 0) return
    n = size(case%body)
    allocate (body(n + count(case%begun%drop > 0)))
    body(:n) = case%body
    do i = 1, case%begun%n
      b = case%begun%block(i)
      if (case%begun%drop(i) > 0) then
        n = n + 1
        b = n
        body(b)%shape = case%begun%shape(i)
        body(b)%line = case%start%line
      end if
      body(b)%position = case%begun%x(:, i)
      body(b)%quaternion = case%begun%q(:, i)
      body(b)%velocity = case%begun%v(:, i)
      body(b)%angular_velocity = case%begun%omega(:, i)
      body(b)%release_time = 0.0_wp
    end do
    call move_alloc(body, known%body)
  end function with_begun

  !> Blocks of the other run that become bodies of the case.
  subroutine bring_along(case, left, along)
    type(case_t), intent(inout) :: case
    type(begun_t), intent(in) :: left
    logical, intent(in) :: along(:)
    type(body_input_t), allocatable :: body(:)
    integer :: k, n

    n = size(case%body)
    allocate (body(n + count(along)))
    body(:n) = case%body
    do k = 1, left%n
      if (.not. along(k)) cycle
      n = n + 1
      body(n) = body_input_t(line=case%start%line, shape=left%shape(k), name=left%name(k), &
        position=left%x(:, k) + case%start%shift, quaternion=left%q(:, k), &
        velocity=left%v(:, k), angular_velocity=left%omega(:, k), motion='')
    end do
    call move_alloc(body, case%body)
  end subroutine bring_along

end module start_bodies_m
