!> Random numbers by counter: number k of body `drop` of stream `seed` is a function of these three
!! alone, the same on every machine, in any order and on any number of processes.
module random_counter_m
  use kinds_m, only: wp, i8, pi
  implicit none
  private
  public :: uniform, random_rotation

  integer(i8), parameter :: mask = int(z'FFFFFFFF', i8)   !! 32 bits
  integer(i8), parameter :: start(2) = [int(z'243F6A88', i8), int(z'85A308D3', i8)]  !! digits of pi

contains

  !> Number k of a stream, uniform in [0, 1) with 53 binary digits.
  elemental function uniform(seed, drop, k) result(x)
    integer, intent(in) :: seed   !! of the case
    integer, intent(in) :: drop   !! which body
    integer, intent(in) :: k      !! which number of this body
    real(wp) :: x
    integer(i8) :: high, low

    high = ishft(hash(seed, drop, k, start(1)), -5)   ! 27 bits
    low = ishft(hash(seed, drop, k, start(2)), -6)    ! 26 bits
    x = scale(real(ior(ishft(high, 26), low), wp), -53)
  end function uniform

  !> Rotation as a unit quaternion, uniform over all rotations, from the numbers 1 to 3 of the body.
  !!
  !! Source: Shoemake, Uniform random rotations, Graphics Gems III (1992).
  pure function random_rotation(seed, drop) result(q)
    integer, intent(in) :: seed, drop
    real(wp) :: q(4)   !! w, x, y, z
    real(wp) :: u, a, b

    u = uniform(seed, drop, 1)
    a = 2*pi*uniform(seed, drop, 2)
    b = 2*pi*uniform(seed, drop, 3)
    q = [sqrt(u)*cos(b), sqrt(1 - u)*sin(a), sqrt(1 - u)*cos(a), sqrt(u)*sin(b)]
  end function random_rotation

  !> 32 well mixed bits of the three counters.
  elemental function hash(seed, drop, k, salt) result(h)
    integer, intent(in) :: seed, drop, k
    integer(i8), intent(in) :: salt
    integer(i8) :: h

    h = mixed(ieor(salt, bits(seed)))
    h = mixed(ieor(h, bits(drop)))
    h = mixed(ieor(h, bits(k)))
  end function hash

  !> The 32 bits of an integer as a number from 0 to 2**32 - 1, scattered by an odd factor.
  elemental function bits(i) result(b)
    integer, intent(in) :: i
    integer(i8) :: b

    b = times(iand(int(i, i8), mask), int(z'9E3779B1', i8))
  end function bits

  !> Every bit of the result depends on every bit of h: the last step of the public-domain hash
  !! MurmurHash3 (Appleby), with one more round.
  elemental function mixed(h) result(m)
    integer(i8), intent(in) :: h
    integer(i8) :: m

    m = ieor(h, ishft(h, -16))
    m = times(m, int(z'85EBCA6B', i8))
    m = ieor(m, ishft(m, -13))
    m = times(m, int(z'C2B2AE35', i8))
    m = ieor(m, ishft(m, -16))
    m = times(iand(m + int(z'7ED55D16', i8), mask), int(z'27D4EB2F', i8))
    m = ieor(m, ishft(m, -15))
  end function mixed

  !> Product modulo 2**32, in halves so that no step passes 2**63.
  elemental function times(a, b) result(p)
    integer(i8), intent(in) :: a, b   !! 0 .. 2**32 - 1
    integer(i8) :: p
    integer(i8), parameter :: half = int(z'FFFF', i8)

    p = ishft(iand(a*ishft(b, -16), half), 16)
    p = iand(p + a*iand(b, half), mask)
  end function times

end module random_counter_m
