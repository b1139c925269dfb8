!> Number kinds and the constants every module may need.
module kinds_m
  use, intrinsic :: iso_fortran_env, only: real64, real32, int64
  implicit none
  private
  public :: wp, sp, i8, pi, name_length

  integer, parameter :: wp = real64   !! working precision of all physics
  integer, parameter :: sp = real32   !! result files and multigrid smoothing only
  integer, parameter :: i8 = int64    !! counters that may pass 2**31
  real(wp), parameter :: pi = 3.141592653589793238462643383279502884_wp
  integer, parameter :: name_length = 64   !! longest name of a shape, option or boundary kind

end module kinds_m
