!> Stones: convex, of given mass, elongation and blockiness, and graded after Rosin and Rammler.
module test_rock_m
  use check_m, only: check, wp
  use case_types_m, only: shape_input_t
  use vectors_m, only: cross
  use tet_mesh_m, only: shape_t
  use rock_m, only: rock_mass, share_in_grade
  use shapes_builtin_m, only: make_shape
  use surface_nets_m, only: check_net, check_moments
  implicit none
  private
  public :: test_rock

  integer :: k

contains

  subroutine test_rock()
    do k = 1, 40
      call check_stone(k, 1.5_wp, 0.5_wp)
    end do
    do k = 1, 10
      call check_stone(k, 1.0_wp, 0.9_wp)
      call check_stone(k, 3.0_wp, 0.3_wp)
      call check_stone(k, 1.0_wp, 0.3_wp)
    end do
    call check_grade(0.0_wp, 0.0_wp)
    call check_grade(0.06_wp, 0.14_wp)
    call check_same_everywhere()
    call check_refusals()
  end subroutine test_rock

  !> A family with the given form.
  pure function family(elongation, blockiness) result(input)
    real(wp), intent(in) :: elongation, blockiness
    type(shape_input_t) :: input

    input%name = 'r'
    input%kind = 'rock'
    input%variants = 40
    input%density = 2650.0_wp
    input%elongation = elongation
    input%blockiness = blockiness
  end function family

  !> Volume and inertia against sums over the facets; corners against their planes; the box.
  subroutine check_stone(k, elongation, blockiness)
    integer, intent(in) :: k
    real(wp), intent(in) :: elongation, blockiness
    type(shape_input_t) :: input
    type(shape_t) :: s
    character(:), allocatable :: message
    real(wp) :: n(3), edge(3), beyond
    integer :: m, i

    input = family(elongation, blockiness)
    input%member = k
    call make_shape(input, s, message)
    call check('a stone is built', message == '')
    if (message /= '') return
    edge = maxval(s%point, 2) - minval(s%point, 2)
    call check('mass', s%density*s%volume, rock_mass(input, k), 1.0e-14_wp)
    call check('elongation', edge(1)/edge(3), elongation, 1.0e-13_wp)
    call check('blockiness', s%volume/product(edge), blockiness, 1.0e-13_wp)
    call check('x is the longest edge, z the shortest', edge(1) >= edge(2)*(1.0_wp - 1.0e-14_wp) &
      .and. edge(2) >= edge(3)*(1.0_wp - 1.0e-14_wp))
    call check_net('stone', s%point, s%facet, s%facet_point, 2, s%volume)
    call check_moments('stone', s)
    beyond = 0.0_wp
    do m = 1, size(s%facet) - 1
      associate (c => s%point(:, s%facet_point(s%facet(m):s%facet(m + 1) - 1)))
        n = cross(c(:, 2) - c(:, 1), c(:, size(c, 2)) - c(:, 1))
        do i = 1, size(s%point, 2)
          beyond = max(beyond, dot_product(n, s%point(:, i) - c(:, 1))/norm2(n))
        end do
      end associate
    end do
    call check('convex', beyond, 0.0_wp, 1.0e-13_wp*edge(1))
  end subroutine check_stone

  !> The masses of a large family follow the grade: Kolmogorov's distance within that of a share of
  !! 5 % of random samples, 1.36/sqrt(N), and within the 1/N of equal parts; also of the first half.
  subroutine check_grade(mass_min, mass_max)
    real(wp), intent(in) :: mass_min, mass_max   !! [kg]
    integer, parameter :: n = 1000
    type(shape_input_t) :: input
    real(wp) :: mass(n)
    integer :: k

    input = family(1.5_wp, 0.5_wp)
    input%variants = n
    input%mass_min = mass_min
    input%mass_max = mass_max
    do k = 1, n
      mass(k) = rock_mass(input, k)
    end do
    call check('no stone below the least', minval(mass) >= mass_min)
    if (mass_max > 0.0_wp) call check('none above the largest', maxval(mass) <= mass_max)
    call check('family of the grade', distance_from_grade(input, mass), 0.0_wp, 1.0_wp/real(n, wp))
    call check('random order', distance_from_grade(input, mass(:n/2)), 0.0_wp, &
      1.36_wp/sqrt(0.5_wp*n))
    call check('neighbours are independent', abs(correlation(mass(2:), mass(:n - 1))) < 0.1_wp)
  end subroutine check_grade

  !> Largest distance between the share of masses below a mass and that of Rosin and Rammler,
  !! 1 - exp(-ln 2 (M/M50)^n), cut at the least and the largest mass.
  real(wp) function distance_from_grade(input, mass) result(distance)
    type(shape_input_t), intent(in) :: input
    real(wp), intent(in) :: mass(:)
    real(wp) :: ends(2), y, below
    integer :: k

    ends = [0.0_wp, 1.0_wp]
    ends(1) = 1.0_wp - exp(-log(2.0_wp)*(input%mass_min/input%mass_50)**input%uniformity)
    if (input%mass_max > 0.0_wp) ends(2) = 1.0_wp &
      - exp(-log(2.0_wp)*(input%mass_max/input%mass_50)**input%uniformity)
    distance = 0.0_wp
    do k = 1, size(mass)
      y = 1.0_wp - exp(-log(2.0_wp)*(mass(k)/input%mass_50)**input%uniformity)
      y = (y - ends(1))/(ends(2) - ends(1))
      below = real(count(mass < mass(k)), wp)
      distance = max(distance, abs(y - below/size(mass)), abs(y - (below + 1)/size(mass)))
    end do
  end function distance_from_grade

  pure real(wp) function correlation(a, b) result(r)
    real(wp), intent(in) :: a(:), b(:)
    real(wp) :: mean(2)

    mean = [sum(a), sum(b)]/size(a)
    r = sum((a - mean(1))*(b - mean(2)))/sqrt(sum((a - mean(1))**2)*sum((b - mean(2))**2))
  end function correlation

  !> A stone written down once: another machine, compiler or option makes the same one.
  subroutine check_same_everywhere()
    type(shape_input_t) :: input
    type(shape_t) :: s
    character(:), allocatable :: message

    input = family(1.5_wp, 0.5_wp)
    input%seed = 7
    input%member = 3
    call make_shape(input, s, message)
    call check('corners', size(s%point, 2), 35)
    call check('mass', s%density*s%volume, 0.13858619406171710_wp, 1.0e-12_wp)
    call check('first corner', s%point(:, 1), [2.2296317314697556e-2_wp, &
      -2.0361615701992319e-3_wp, -1.7718669460058102e-2_wp], 1.0e-12_wp)
    input%seed = 8
    call check('another seed and mass', abs(rock_mass(input, 3) - s%density*s%volume) > 1e-6_wp)
  end subroutine check_same_everywhere

  subroutine check_refusals()
    type(shape_input_t) :: input
    type(shape_t) :: s
    character(:), allocatable :: message

    input = family(1.5_wp, 0.5_wp)
    input%member = 1
    input%mass_min = 1.0_wp
    call make_shape(input, s, message)
    call check('a grade without stones', index(message, 'mass_min = 1, mass_max = 0: leave ') == 1)
    call check('its share', share_in_grade(input) < 1.0e-100_wp)
    input = family(1.5_wp, 0.5_wp)
    input%member = 1
    input%mass_50 = 1.0e-17_wp
    call make_shape(input, s, message)
    call check('a grain', index(message, 'mass_50 = 1e-17: the stone r-01 is ') == 1)
  end subroutine check_refusals

end module test_rock_m
