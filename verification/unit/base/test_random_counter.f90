!> Counter-based random numbers: fixed values, uniform, independent; rotations uniform.
module test_random_counter_m
  use check_m, only: check, wp
  use random_counter_m, only: uniform, random_rotation
  use vectors_m, only: norm
  use rotations_m, only: rotate
  implicit none
  private
  public :: test_random_counter

  integer, parameter :: n = 100000
  integer :: i

contains

  subroutine test_random_counter()
    call test_fixed_values()
    call test_uniform('k', [(uniform(1, 1, i), i=1, n)], [(uniform(1, 1, i + 1), i=1, n)])
    call test_uniform('drop', [(uniform(1, i, 1), i=1, n)], [(uniform(1, i + 1, 1), i=1, n)])
    call test_uniform('seed', [(uniform(i, 1, 1), i=1, n)], [(uniform(i + 1, 1, 1), i=1, n)])
    call test_uniform('k against drop', [(uniform(1, i, 1), i=1, n)], [(uniform(1, i, 2), i=1, n)])
    call test_uniform('seed against drop', [(uniform(i, 7, 1), i=1, n)], &
      [(uniform(7, i, 1), i=1, n)])
    call test_rotations()
  end subroutine test_random_counter

  !> These numbers are part of the contract: the same seed draws the same on every machine.
  subroutine test_fixed_values()
    call check('(1,1,1)', uniform(1, 1, 1), 0.6360824632037586_wp)
    call check('(7,3,102)', uniform(7, 3, 102), 0.9371160440664011_wp)
    call check('(-5,0,huge)', uniform(-5, 0, huge(1)), 0.007129576763056367_wp)
  end subroutine test_fixed_values

  !> Mean, variance, chi-square over 64 classes and correlation within four standard deviations.
  subroutine test_uniform(name, x, y)
    character(*), intent(in) :: name
    real(wp), intent(in) :: x(:), y(:)
    integer, parameter :: classes = 64
    real(wp) :: sigma, chi, share(classes)
    integer :: j

    sigma = 1/sqrt(12.0_wp*n)
    share = [(real(count(int(classes*x) == j - 1), wp), j=1, classes)]
    chi = sum((share - real(n, wp)/classes)**2)*classes/n
    call check(name//': in [0, 1)', all(x >= 0 .and. x < 1))
    call check(name//': mean', sum(x)/n, 0.5_wp, 4*sigma)
    call check(name//': variance', sum((x - 0.5_wp)**2)/n, 1/12.0_wp, 4*sqrt(1/(180.0_wp*n)))
    call check(name//': chi-square', chi, classes - 1.0_wp, 4*sqrt(2.0_wp*classes))
    call check(name//': related', 12*sum((x - 0.5_wp)*(y - 0.5_wp))/n, 0.0_wp, 4/sqrt(real(n, wp)))
  end subroutine test_uniform

  !> A turned axis points evenly in all directions; the quaternions have unit length.
  subroutine test_rotations()
    real(wp) :: q(4), axis(3), mean(3), square(3), off
    integer, parameter :: m = 20000

    mean = 0.0_wp
    square = 0.0_wp
    off = 0.0_wp
    do i = 1, m
      q = random_rotation(3, i)
      off = max(off, abs(norm(q) - 1))
      axis = rotate(q, [0.0_wp, 0.6_wp, 0.8_wp])
      mean = mean + axis/m
      square = square + axis**2/m
    end do
    call check('unit quaternions', off, 0.0_wp, 1.0e-15_wp)
    call check('no preferred direction', mean, [0, 0, 0]*1.0_wp, 4/sqrt(3.0_wp*m))
    call check('no preferred axis', square, [1, 1, 1]/3.0_wp, 4*sqrt(4/(45.0_wp*m)))
  end subroutine test_rotations

end module test_random_counter_m
