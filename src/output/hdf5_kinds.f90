!> The kinds of numbers in a file and the types that HDF5 has for them.
module hdf5_kinds_m
  use hdf5, only: hid_t, H5_INTEGER_KIND, H5_REAL_KIND, h5kind_to_type, H5T_IEEE_F32LE
  use hdf5, only: H5T_IEEE_F64LE, H5T_STD_I32LE, H5T_STD_I64LE
  use kinds_m, only: wp, sp, i8
  implicit none
  private
  public :: file_real64, file_real32, file_integer32, file_integer64
  public :: bytes_of, type_in_file, memory_type

  integer, parameter :: file_real64 = 1, file_real32 = 2, file_integer32 = 3, file_integer64 = 4

contains

  !> Bytes of a number of a kind in the file.
  pure integer function bytes_of(kind)
    integer, intent(in) :: kind   !! file_real64, ...

    bytes_of = merge(8, 4, kind == file_real64 .or. kind == file_integer64)
  end function bytes_of

  !> HDF5 type of a kind in the file.
  function type_in_file(kind) result(t)
    integer, intent(in) :: kind
    integer(hid_t) :: t

    select case (kind)
    case (file_real64); t = H5T_IEEE_F64LE
    case (file_real32); t = H5T_IEEE_F32LE
    case (file_integer32); t = H5T_STD_I32LE
    case (file_integer64); t = H5T_STD_I64LE
    case default; error stop 'hdf5_kinds_m: unknown kind'
    end select
  end function type_in_file

  !> HDF5 type of a kind in memory.
  function memory_type(element) result(t)
    integer, intent(in) :: element   !! file_real64, ...
    integer(hid_t) :: t

    select case (element)
    case (file_real64); t = h5kind_to_type(wp, H5_REAL_KIND)
    case (file_real32); t = h5kind_to_type(sp, H5_REAL_KIND)
    case (file_integer32); t = h5kind_to_type(kind(element), H5_INTEGER_KIND)
    case (file_integer64); t = h5kind_to_type(i8, H5_INTEGER_KIND)
    case default; error stop 'hdf5_kinds_m: unknown kind'
    end select
  end function memory_type

end module hdf5_kinds_m
