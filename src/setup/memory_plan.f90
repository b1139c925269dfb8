!> How much memory a run will take, and whether it can have that.
!!
!! Measured as the peak of runs of 16**3 to 96**3 cells with and without blocks, surface tension
!! and both couplings (gfortran 12): 550 to 820 B for a cell, those of the halo counted, 1240 B
!! with `momentum = 'c_ismac'`; 29 kB for each of 1000 hexapods. When a block lands, lists of all
!! cells come on top (`fit_to_bodies` in `open_flux_m`): 36 B for a cell. Beds: maps of 400**2
!! and 1000**2 heights; each process has its own.
module memory_plan_m
  use, intrinsic :: iso_fortran_env, only: error_unit
  use kinds_m, only: wp, i8
  use errors_m, only: fatal, brief, to_text, exit_files
  use parallel_m, only: nproc, is_root, global_max
  use case_types_m, only: case_t, has_flow
  use tet_mesh_m, only: shape_t
  use bed_m, only: bed_t
  use machine_memory_m, only: available_memory, memory_limit
  implicit none
  private
  public :: planned_memory, require_memory, size_text

  integer(i8), parameter :: bytes_per_cell = 850       !! all arrays: fields, solids, solvers [B]
  integer(i8), parameter :: bytes_of_c_ismac = 470     !! more for each cell [B]
  integer(i8), parameter :: bytes_of_landing = 36      !! more for each cell where blocks land [B]
  integer(i8), parameter :: bytes_per_piece = 1000     !! of a tetrahedron or a sphere [B]
  integer(i8), parameter :: bytes_per_body = 30000     !! contacts and surface of a body [B]
  integer(i8), parameter :: bytes_of_bed(2) = [86, 44]          !! of a facet, of a bent edge [B]
  integer(i8), parameter :: bytes_left = 16000000      !! at rest, without a bed or cells [B]
  integer(i8), parameter :: bytes_at_blocks(2) = [140, 190]     !! the same, made for contact [B]
  integer(i8), parameter :: bytes_of_bed_solid = 2450           !! of a facet, for the flow [B]
  integer(i8), parameter :: bytes_at_rest = 30000000   !! program and libraries [B]
  integer, parameter :: halo = 3                       !! cells beside the domain, on each side

contains

  !> Estimate of the memory of all processes together [B].
  function planned_memory(case, shapes, bed) result(bytes)
    type(case_t), intent(in) :: case
    type(shape_t), intent(in) :: shapes(:)   !! one for each `&shape`
    type(bed_t), intent(in) :: bed
    integer(i8) :: bytes
    integer(i8) :: each, blocks, features(2)
    real(wp) :: share
    integer :: s

    blocks = size(case%body) + sum(int(case%drop%count, i8))
    bytes = bytes_at_rest
    if (has_flow(case%run)) then
      each = bytes_per_cell
      if (case%numerics%momentum == 'c_ismac') each = each + bytes_of_c_ismac
      if (case%run%physics == 'coupled' .and. blocks > 0) each = each + bytes_of_landing
      bytes = bytes + each*product(int(case%grid%cells, i8) + 2*halo)
    end if
    bytes = bytes + bytes_per_body*blocks
    do s = 1, size(shapes)
      bytes = bytes + bytes_per_piece*(size(shapes(s)%tet, 2) + size(shapes(s)%sphere_radius))
    end do
    if (.not. bed%there) return
    features = [size(bed%triangle, 2), size(bed%edge, 2)]
    share = 0.0_wp   ! of the bed that blocks come near, where they fall beside one another
    if (blocks > 0) share = min(1.0_wp, real(blocks, wp)*(3*maxval(shapes%radius))**2 &
      /product(bed%surface%high(:2) - bed%surface%low(:2)))
    bytes = bytes + max(0_i8, nproc()*(sum(bytes_of_bed*features) - bytes_left &
      + int(share*sum(bytes_at_blocks*features), i8)))
    if (has_flow(case%run)) bytes = bytes + nproc()*bytes_of_bed_solid*features(1)
  end function planned_memory

  !> End with code 4 if the share of this process, or of another one, in the memory that the run
  !! will take is above its limit; warn if the run takes more than the machine has left. Call it
  !! before anything is written, and first without a case: is there memory to read one?
  subroutine require_memory(case, shapes, bed)
    type(case_t), intent(in), optional :: case
    type(shape_t), intent(in), optional :: shapes(:)
    type(bed_t), intent(in), optional :: bed
    character(:), allocatable :: asked, left
    integer(i8) :: planned, available
    real(wp) :: beyond(1)

    planned = bytes_at_rest
    asked = 'the program takes '//size_text(real(planned, wp))//' of memory'
    if (present(case)) then
      planned = planned_memory(case, shapes, bed)
      asked = 'the run takes about '//size_text(real(planned, wp))//' of memory'
      if (nproc() > 1) asked = asked//' in '//to_text(nproc())//' processes'
    end if
    available = available_memory()
    left = ''
    if (available > 0) left = ', '//size_text(real(available, wp))//' are left'
    beyond = merge(1.0_wp, 0.0_wp, planned/merge(nproc(), 1, present(case)) > memory_limit())
    call global_max(beyond)
    if (beyond(1) > 0.0_wp) call fatal(exit_files, asked//left &
      //'; the machine has less, or a limit is lower (ulimit -v)')
    if (planned <= available .or. available == 0 .or. .not. (present(case) .and. is_root())) return
    write (error_unit, '(a)') 'mics: warning: '//asked//left//'; it may be killed'
  end subroutine require_memory

  !> An amount of memory or disk.
  pure function size_text(bytes) result(text)
    real(wp), intent(in) :: bytes
    character(:), allocatable :: text
    character(2), parameter :: prefix(4) = ['kB', 'MB', 'GB', 'TB']
    real(wp) :: x
    integer :: i

    x = bytes/1.0e3_wp
    do i = 1, 3
      if (x < 999.5_wp) exit
      x = x/1.0e3_wp
    end do
    text = brief(x)
    if (x >= 10.0_wp .and. x < 1.0e6_wp) text = to_text(nint(x))
    text = text//' '//prefix(min(i, 4))
  end function size_text

end module memory_plan_m
