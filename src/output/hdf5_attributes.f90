!> Attributes of the objects of an HDF5 file: texts, numbers, vectors and matrices.
module hdf5_attributes_m
  use, intrinsic :: iso_c_binding, only: c_ptr, c_loc, c_char, c_null_char
  use hdf5, only: hid_t, hsize_t, size_t, h5aclose_f, h5acreate_f, h5aexists_f, h5aget_type_f
  use hdf5, only: h5aopen_by_name_f, h5aopen_f, h5aread_f, h5awrite_f, h5oclose_f, h5oopen_f
  use hdf5, only: h5sclose_f, h5screate_f, h5screate_simple_f, h5tclose_f, h5tcopy_f
  use hdf5, only: h5tset_cset_f, h5tset_size_f, H5S_SCALAR_F, H5T_CSET_UTF8_F, H5T_FORTRAN_S1
  use hdf5, only: H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, H5T_STD_I64LE, H5T_STRING
  use c_library_m, only: text_at
  use kinds_m, only: wp, i8
  use hdf5_kinds_m, only: file_integer64, memory_type
  use hdf5_handle_m, only: h5_handle_t
  implicit none
  private
  public :: h5_attributes_t

  !> A file and its attributes.
  type, extends(h5_handle_t) :: h5_attributes_t
  contains
    procedure, private :: attribute_text, attribute_integer, attribute_integers, attribute_real
    procedure, private :: attribute_reals, attribute_matrix
    generic :: attribute => attribute_text, attribute_integer, attribute_integers, attribute_real, &
      attribute_reals, attribute_matrix
    procedure :: fixed_text_attribute, last_integer
    procedure, private :: read_text_attribute, read_integer_attribute
    generic :: read_attribute => read_text_attribute, read_integer_attribute
    procedure, private :: write_attribute
  end type h5_attributes_t

contains

  !> A text of any length as an attribute; h5py shows it as str. An attribute that exists is
  !! replaced.
  subroutine attribute_text(self, object, name, value)
    class(h5_attributes_t), intent(inout) :: self
    character(*), intent(in) :: object, name, value
    character(kind=c_char), target :: buffer(len(value) + 1)
    type(c_ptr), target :: start(1)
    integer :: i
    integer(hid_t) :: text_type
    integer :: status

    if (self%info /= 0) return
    do i = 1, len(value)
      buffer(i) = value(i:i)
    end do
    buffer(len(value) + 1) = c_null_char
    start(1) = c_loc(buffer)
    call h5tcopy_f(H5T_STRING, text_type, status)
    call self%check(status, 'make a text type')
    call h5tset_cset_f(text_type, H5T_CSET_UTF8_F, status)
    call self%check(status, 'make a text type')
    call self%write_attribute(object, name, text_type, text_type, [integer(hsize_t) ::], &
      c_loc(start))
    call h5tclose_f(text_type, status)
  end subroutine attribute_text

  !> A text as an attribute of fixed length in ASCII, the form that VTK asks for.
  subroutine fixed_text_attribute(self, object, name, value)
    class(h5_attributes_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    character(*), intent(in), target :: value
    integer(hid_t) :: text_type
    integer :: status

    if (self%info /= 0) return
    call h5tcopy_f(H5T_FORTRAN_S1, text_type, status)
    call self%check(status, 'make a text type')
    call h5tset_size_f(text_type, int(len(value), size_t), status)
    call self%check(status, 'make a text type')
    call self%write_attribute(object, name, text_type, text_type, [integer(hsize_t) ::], &
                              c_loc(value))
    call h5tclose_f(text_type, status)
  end subroutine fixed_text_attribute

  subroutine attribute_integer(self, object, name, value)
    class(h5_attributes_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    integer, intent(in) :: value
    integer(i8), target :: wide

    if (self%info /= 0) return
    wide = int(value, i8)
    call self%write_attribute(object, name, H5T_STD_I64LE, memory_type(file_integer64), &
                              [integer(hsize_t) ::], c_loc(wide))
  end subroutine attribute_integer

  subroutine attribute_integers(self, object, name, value)
    class(h5_attributes_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    integer, intent(in) :: value(:)
    integer(i8), target :: wide(size(value))

    if (self%info /= 0) return
    wide = int(value, i8)
    call self%write_attribute(object, name, H5T_STD_I64LE, memory_type(file_integer64), &
                              [size(value, kind=hsize_t)], c_loc(wide))
  end subroutine attribute_integers

  subroutine attribute_real(self, object, name, value)
    class(h5_attributes_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    real(wp), intent(in), target :: value

    if (self%info /= 0) return
    call self%write_attribute(object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &
                              [integer(hsize_t) ::], c_loc(value))
  end subroutine attribute_real

  subroutine attribute_reals(self, object, name, value)
    class(h5_attributes_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    real(wp), intent(in), target, contiguous :: value(:)

    if (self%info /= 0) return
    call self%write_attribute(object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &
                              shape(value, kind=hsize_t), c_loc(value))
  end subroutine attribute_reals

  !> A matrix as an attribute; h5py shows its transpose.
  subroutine attribute_matrix(self, object, name, value)
    class(h5_attributes_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    real(wp), intent(in), target, contiguous :: value(:, :)

    if (self%info /= 0) return
    call self%write_attribute(object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &
                              shape(value, kind=hsize_t), c_loc(value))
  end subroutine attribute_matrix

  !> Overwrite an attribute that is there, also when there is no room for anything else.
  subroutine last_integer(self, object, name, value)
    class(h5_attributes_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    integer, intent(in) :: value
    integer :: before

    if (self%broken .or. self%id < 0) return
    before = self%info
    self%info = 0
    call self%attribute(object, name, value)
    call self%flush()
    if (before /= 0) self%info = before
  end subroutine last_integer

  !> Create the attribute, or overwrite the one that is there, which must have the same type and
  !! shape.
  subroutine write_attribute(self, object, name, file_type, mem_type, extent, data)
    class(h5_attributes_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    integer(hid_t), intent(in) :: file_type, mem_type
    integer(hsize_t), intent(in) :: extent(:)   !! empty: a single value
    type(c_ptr), intent(in) :: data

    if (self%info == 0) call put_attribute(self, object, name, file_type, mem_type, extent, data)
    call self%agree()
  end subroutine write_attribute

  !> The work of `write_attribute` on one process.
  subroutine put_attribute(self, object, name, file_type, mem_type, extent, data)
    class(h5_attributes_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    integer(hid_t), intent(in) :: file_type, mem_type
    integer(hsize_t), intent(in) :: extent(:)   !! empty: a single value
    type(c_ptr), intent(in) :: data
    character(:), allocatable :: what
    integer(hid_t) :: space, attribute, owner
    integer :: status
    logical :: exists

    what = 'write '//object//'@'//name
    call h5oopen_f(self%id, object, owner, status)
    call self%check(status, what)
    if (self%info /= 0) return
    call h5aexists_f(owner, name, exists, status)
    call self%check(status, what)
    if (exists) then
      call h5aopen_f(owner, name, attribute, status)
    else
      if (size(extent) == 0) then
        call h5screate_f(H5S_SCALAR_F, space, status)
      else
        call h5screate_simple_f(size(extent), extent, space, status)
      end if
      call self%check(status, what)
      call h5acreate_f(owner, name, file_type, space, attribute, status)
      call self%check(status, what)
      call h5sclose_f(space, status)
    end if
    call self%check(status, what)
    call h5awrite_f(attribute, mem_type, data, status)
    call self%check(status, what)
    call h5aclose_f(attribute, status)
    call h5oclose_f(owner, status)
  end subroutine put_attribute

  !> A text attribute that `attribute` wrote.
  subroutine read_text_attribute(self, object, name, value)
    class(h5_attributes_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    character(:), allocatable, intent(out) :: value
    type(c_ptr), target :: start(1)
    type(c_ptr) :: data
    integer(hid_t) :: attribute, text_type
    integer :: status

    value = ''
    if (self%info /= 0) return
    call h5aopen_by_name_f(self%id, object, name, attribute, status)
    call self%check(status, 'read '//object//'@'//name)
    if (self%info /= 0) return
    call h5aget_type_f(attribute, text_type, status)
    call self%check(status, 'read '//object//'@'//name)
    data = c_loc(start)
    call h5aread_f(attribute, text_type, data, status)
    call self%check(status, 'read '//object//'@'//name)
    if (self%info == 0) value = text_at(start(1))
    call h5tclose_f(text_type, status)
    call h5aclose_f(attribute, status)
  end subroutine read_text_attribute

  subroutine read_integer_attribute(self, object, name, value)
    class(h5_attributes_t), intent(inout) :: self
    character(*), intent(in) :: object, name
    integer, intent(out) :: value
    integer(i8), target :: wide
    type(c_ptr) :: data
    integer(hid_t) :: attribute
    integer :: status

    value = 0
    if (self%info /= 0) return
    wide = 0
    call h5aopen_by_name_f(self%id, object, name, attribute, status)
    call self%check(status, 'read '//object//'@'//name)
    if (self%info /= 0) return
    data = c_loc(wide)
    call h5aread_f(attribute, memory_type(file_integer64), data, status)
    call self%check(status, 'read '//object//'@'//name)
    call h5aclose_f(attribute, status)
    value = int(wide)
  end subroutine read_integer_attribute

end module hdf5_attributes_m
