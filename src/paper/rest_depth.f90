!> How far blocks give way at rest: a warning of `--check`.
module rest_depth_m
  use kinds_m, only: wp
  use vectors_m, only: norm
  use errors_m, only: problems_t, brief
  use case_types_m, only: case_t
  use drops_m, only: count_of_shape
  use tet_mesh_m, only: shape_t, extreme_of_family
  use contact_law_m, only: contact_law_t
  use contact_laws_m, only: choose_law, hard_depth, depth_at_rest, rest_overlap_share
  use law_restitution_m, only: min_restitution
  implicit none
  private
  public :: look_at_rest, heaviest_mass, n_free

contains

  !> Blocks that give way at rest by more than a share of their size, under their own weight or,
  !! as supports, under the heaviest block; and a restitution below the least one.
  subroutine look_at_rest(case, shapes, warnings)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)   !! one for each `&shape`
    type(problems_t), intent(inout) :: warnings
    class(contact_law_t), allocatable :: law
    real(wp) :: heaviest, depth, rest_overlap
    integer :: s

    if (case%contact%solver /= 'springs' .or. size(case%body) + size(case%drop) == 0) return
    if (case%contact%law == 'restitution' .and. case%contact%restitution < min_restitution) then
      call warnings%add('&contact restitution', case%contact%restitution, 'acts as ' &
        //brief(min_restitution)//': blocks leave their supports with that share of the speed ' &
        //'of an impact at least')
    end if
    call choose_law(case%contact, law)
    heaviest = heaviest_mass(case, shapes)
    do s = 1, size(shapes)
      if (n_free(case, shapes(s)) == 0 .or. .not. extreme_of_family(shapes, s)) cycle
      depth = rest_depth(case, shapes(s), law, heaviest)
      rest_overlap = rest_overlap_share*shapes(s)%smallest_edge
      if (.not. depth > 1.000001_wp*rest_overlap) cycle   ! the law itself may aim at it
      if (case%contact%law == 'restitution') then
        call warnings%add('&contact contact_time', case%contact%contact_time, sinks(s) &
          //'; a shorter one makes blocks stiffer')
      else
        call warnings%add('&contact k_n', case%contact%k_n, sinks(s)//'; should be larger')
      end if
    end do
  contains
    function sinks(s) result(text)
      integer, intent(in) :: s
      character(:), allocatable :: text

      text = 'blocks '//trim(shapes(s)%name)//' give way by '//brief(depth, 2)//' m at rest, ' &
        //brief(100.0_wp*depth/shapes(s)%smallest_edge, 2)//' % of their size, above ' &
        //brief(100.0_wp*rest_overlap_share)//' %'
    end function sinks
  end subroutine look_at_rest

  !> Overlap of a block of a shape at rest: the larger of that under its own weight, on the floor or
  !! on another one of its kind, and that of a contact point under a heaviest block that is another
  !! one [m].
  function rest_depth(case, shape, law, heaviest) result(depth)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shape
    class(contact_law_t), intent(in) :: law
    real(wp), intent(in) :: heaviest           !! mass of that block [kg]
    real(wp) :: depth
    real(wp), parameter :: supports = 3.0_wp   ! of a block at rest, at least; of a sphere one
    real(wp) :: gravity, mass, reduced, own, rest_overlap, k

    gravity = norm(case%fluid%gravity)
    mass = shape%density*shape%volume
    own = mass*gravity
    if (shape%kind /= 'sphere') own = own/supports
    rest_overlap = rest_overlap_share*shape%smallest_edge
    reduced = mass
    if (n_free(case, shape) > 1) reduced = 0.5_wp*mass
    k = law%normal_constant(reduced, heaviest, gravity, rest_overlap)
    depth = depth_at_rest(law, k, hard_depth(shape), own)
    if (.not. heaviest > mass) return
    k = law%normal_constant(mass, heaviest, gravity, rest_overlap)
    depth = max(depth, depth_at_rest(law, k, hard_depth(shape), heaviest*gravity))
  end function rest_depth

  !> Mass of the heaviest block that moves freely; 0 if none does [kg].
  pure function heaviest_mass(case, shapes) result(mass)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)   !! one for each `&shape`
    real(wp) :: mass
    integer :: s

    mass = 0.0_wp
    do s = 1, size(shapes)
      if (n_free(case, shapes(s)) > 0) mass = max(mass, shapes(s)%density*shapes(s)%volume)
    end do
  end function heaviest_mass

  !> How many blocks of a shape move freely.
  pure function n_free(case, shape) result(n)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shape
    integer :: n
    integer :: i

    n = count(case%body%shape == shape%name .and. .not. case%body%fixed) &
      + sum([(count_of_shape(case%drop(i), shape, with_fixed=.false.), i=1, size(case%drop))])
  end function n_free

end module rest_depth_m
