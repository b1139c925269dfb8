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
    type(checksum_t) :: of_shape, of_places, of_path, of_start
    integer :: i, r

    text = parameters_text(case)
    do i = 1, size(shapes)
      if (shapes(i)%kind /= 'file') cycle
      of_shape = checksum_t()
      call of_shape%add_reals(size(shapes(i)%point), shapes(i)%point)
      call of_shape%add_integers(size(shapes(i)%tet), shapes(i)%tet)
      call add_line('the shape '//trim(shapes(i)%name), of_shape%text())
    end do
    do i = 1, size(case%drop)
      if (.not. allocated(case%drop(i)%row)) cycle
      of_places = checksum_t()
      do r = 1, size(case%drop(i)%row)
        associate (row => case%drop(i)%row(r))
          call of_places%add_text(row%shape//row%name)
          call of_places%add_reals(11, [row%x, row%q, row%v, row%time])
          call of_places%add_integers(1, [merge(1, 0, row%fixed)])
        end associate
      end do
      call add_line('the places of &drop '//to_text(i), of_places%text())
    end do
    do i = 1, size(case%body)
      associate (path => case%body(i)%path)
        if (path%n == 0) cycle
        of_path = checksum_t()
        call of_path%add_reals(path%n, path%time)
        call of_path%add_reals(size(path%x), path%x)
        call of_path%add_reals(size(path%q), path%q)
        call add_line('the motion of body '//to_text(i), of_path%text())
      end associate
    end do
    associate (begun => case%begun)   ! where blocks begin that another run left
      if (begun%n > 0) then
        call of_start%add_integers(begun%n, begun%drop)
        call of_start%add_integers(begun%n, begun%block)
        call of_start%add_reals(size(begun%x), begun%x)
        call of_start%add_reals(size(begun%q), begun%q)
        call of_start%add_reals(size(begun%v), begun%v)
        call of_start%add_reals(size(begun%omega), begun%omega)
        call add_line('the start', of_start%text())
      end if
    end associate
    if (bed%there) call add_line('the bed', bed%checksum)

  contains

    subroutine add_line(what, checksum)
      character(*), intent(in) :: what, checksum

      text = text//'! checksum of '//what//' '//checksum//new_line('a')
    end subroutine add_line
  end function all_parameters

end module all_parameters_m
