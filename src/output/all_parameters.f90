!> All that determines a run, as text: the values of its case and checksums of what its files held.
!!
!! A run goes on from a restart file of the same parameters only.
module all_parameters_m
  use errors_m, only: to_text
  use checksum_m, only: checksum_t
  use case_types_m, only: case_t
  use case_input_m, only: parameters_text
  use tet_mesh_m, only: shape_t
  use bed_m, only: bed_t
  implicit none
  private
  public :: all_parameters

contains

  !> Values of the case, then a line for each file.
  function all_parameters(case, shapes, bed) result(text)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)
    type(bed_t), intent(in) :: bed
    character(:), allocatable :: text
    type(checksum_t) :: sum
    integer :: i, r

    text = parameters_text(case)
    do i = 1, size(shapes)
      if (shapes(i)%kind /= 'file') cycle
      call sum%add_reals(size(shapes(i)%point), shapes(i)%point)
      call sum%add_integers(size(shapes(i)%tet), shapes(i)%tet)
      call add_line('the shape '//trim(shapes(i)%name))
    end do
    do i = 1, size(case%drop)
      if (.not. allocated(case%drop(i)%row)) cycle
      do r = 1, size(case%drop(i)%row)
        associate (row => case%drop(i)%row(r))
          call sum%add_text(row%shape//row%name)
          call sum%add_reals(11, [row%x, row%q, row%v, row%time])
          call sum%add_integers(1, [merge(1, 0, row%fixed)])
        end associate
      end do
      call add_line('the places of &drop '//to_text(i))
    end do
    do i = 1, size(case%body)
      associate (path => case%body(i)%path)
        if (path%n == 0) cycle
        call sum%add_reals(path%n, path%time)
        call sum%add_reals(size(path%x), path%x)
        call sum%add_reals(size(path%q), path%q)
        call add_line('the motion of body '//to_text(i))
      end associate
    end do
    associate (begun => case%begun)   ! where blocks begin that another run left
      if (begun%n > 0) then
        call sum%add_integers(begun%n, begun%drop)
        call sum%add_integers(begun%n, begun%block)
        call sum%add_reals(size(begun%x), begun%x)
        call sum%add_reals(size(begun%q), begun%q)
        call sum%add_reals(size(begun%v), begun%v)
        call sum%add_reals(size(begun%omega), begun%omega)
        call add_line('the start')
      end if
    end associate
    if (bed%there) text = text//'! checksum of the bed '//bed%checksum//new_line('a')

  contains

    !> End the line of a file, and begin the checksum of the next.
    subroutine add_line(what)
      character(*), intent(in) :: what

      text = text//'! checksum of '//what//' '//sum%text()//new_line('a')
      sum = checksum_t()
    end subroutine add_line
  end function all_parameters

end module all_parameters_m
