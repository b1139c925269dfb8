!> The form of a bed from a file: a map of heights, or triangles in the STL form.
!!
!! A map of heights is plain text, words between blanks and line ends, `#` begins a remark:
!!
!!     nx ny x0 y0 dx dy      points in x and y, the first of them, their spacing [m]
!!     z z z ...              nx*ny heights [m], x fastest, then y
!!
!! Between four points the bed is two triangles, parted along the diagonal from (i, j) to
!! (i+1, j+1). STL files may be ASCII, with keywords in small or capital letters, or binary, in
!! metres; their normals are not looked at, the corners of a facet run counter-clockwise seen from
!! outside.
module bed_file_m
  use, intrinsic :: iso_fortran_env, only: real32
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use kinds_m, only: wp
  use growing_m, only: ensure_capacity
  use errors_m, only: to_text
  use checksum_m, only: checksum_t
  use value_text_m, only: quoted_text, lower_case
  use vectors_m, only: cross
  use file_words_m, only: words_t, read_whole, next_word, skip_line, get_integer, get_real, &
    expected, report, place_of
  implicit none
  private
  public :: bed_form_t, read_bed_file

  integer, parameter :: max_points = 20000000
  integer, parameter :: stl_head = 84, stl_facet = 50   !! bytes of a binary STL file
  real(real32), parameter :: farthest = 1.0e20_real32   !! coordinate, as in text files [m]
  real(wp), parameter :: coarse = 1.0e3_wp   !! steps of single precision along a form, too few [-]
  real(wp), parameter :: fine = 1.0e5_wp     !! enough of them, whatever the facets are like [-]

  !> Triangles as the file gives them, counter-clockwise from outside.
  type :: bed_form_t
    real(wp), allocatable :: point(:, :)       !! (3, n) [m]
    integer, allocatable :: triangle(:, :)     !! (3, m)
    character(:), allocatable :: checksum      !! of the file
  end type bed_form_t

contains

  !> Read a file of a kind ('heightmap' or 'stl'); `message` is empty, or says what is wrong.
  subroutine read_bed_file(file, kind, form, message)
    character(*), intent(in) :: file, kind
    type(bed_form_t), intent(out) :: form
    character(:), allocatable, intent(out) :: message
    type(words_t) :: words
    type(checksum_t) :: checksum

    allocate (form%point(3, 0), form%triangle(3, 0))
    form%checksum = ''
    call read_whole(file, words)
    if (len(words%problem) == 0 .and. len(words%text) == 0) then
      words%line = 0
      call report(words, 'the file is empty')
    end if
    if (len(words%problem) == 0) then
      call checksum%add_text(words%text)
      form%checksum = checksum%text()
      select case (kind)
      case ('heightmap')
        call read_heights(words, form)
      case ('stl')
        if (is_binary_stl(words%text)) then
          call read_binary_stl(words, form)
        else
          call read_ascii_stl(words, form)
        end if
        call check_rounding(words, form)
      case default; error stop 'read_bed_file: no such kind'
      end select
    end if
    message = place_of(words)//words%problem
  end subroutine read_bed_file

  !> A map of heights.
  subroutine read_heights(words, form)
    type(words_t), intent(inout) :: words
    type(bed_form_t), intent(inout) :: form
    real(wp), parameter :: mark(*) = [-9999.0_wp, -99999.0_wp, -999999.0_wp, -32768.0_wp, &
      -32767.0_wp, 9999.0_wp, 32767.0_wp]   !! that maps of measured ground write where none is
    character(:), allocatable :: word
    real(wp) :: first(2), spacing(2)
    integer :: n(2), i, j, k

    if (index(words%text, achar(0)) > 0 &
        .or. lower_case(words%text(:min(5, len(words%text)))) == 'solid') then
      words%line = 0
      call report(words, 'looks like an STL or another binary file, not a map of heights; ' &
        //'an STL file is read with kind = ''stl''')
    end if
    do k = 1, 2
      call get_integer(words, n(k))
    end do
    do k = 1, 2
      call get_real(words, first(k))
    end do
    do k = 1, 2
      call get_real(words, spacing(k))
    end do
    if (any(n < 2)) call report(words, 'a map of heights needs two points at least in x and y')
    if (.not. all(spacing > 0.0_wp)) call report(words, 'the spacing must be positive')
    if (real(n(1), wp)*real(n(2), wp) > real(max_points, wp)) then
      call report(words, 'more than '//to_text(max_points)//' points')
    else if (n(1)*n(2) > len(words%text) - words%at + 1) then   ! a character each at least
      call report(words, 'the file does not hold '//to_text(n(1)*n(2))//' heights')
    end if
    if (len(words%problem) > 0) return
    deallocate (form%point, form%triangle)
    allocate (form%point(3, n(1)*n(2)), form%triangle(3, 2*(n(1) - 1)*(n(2) - 1)))
    do j = 1, n(2)
      do i = 1, n(1)
        k = i + (j - 1)*n(1)
        form%point(1:2, k) = first + real([i, j] - 1, wp)*spacing
        associate (z => form%point(3, k))
          call get_real(words, z)
          if (any(abs(z - mark) <= 0.0_wp)) call report(words, 'is the height '//to_text(z) &
            //' a mark of a missing one (NODATA)? Every point needs a height, fill the gaps first')
        end associate
        if (len(words%problem) > 0) return
      end do
    end do
    word = next_word(words)
    if (len(word) > 0) call expected(words, 'the end of '//to_text(n(1)*n(2))//' heights', word)
    do j = 1, n(2) - 1
      do i = 1, n(1) - 1
        k = i + (j - 1)*n(1)
        form%triangle(:, 2*(i + (j - 1)*(n(1) - 1)) - 1) = [k, k + 1, k + 1 + n(1)]
        form%triangle(:, 2*(i + (j - 1)*(n(1) - 1))) = [k, k + 1 + n(1), k + n(1)]
      end do
    end do
  end subroutine read_heights

  !> Triangles between `facet` and `endfacet`.
  subroutine read_ascii_stl(words, form)
    type(words_t), intent(inout) :: words
    type(bed_form_t), intent(inout) :: form
    character(:), allocatable :: word
    integer :: n, k, in_facet, c
    logical :: open_facet

    word = next_word(words)
    if (lower_case(word) /= 'solid') then
      call expected(words, '''solid'', the start of an STL file,', word)
      return
    end if
    call skip_line(words)
    n = 0
    in_facet = 0
    open_facet = .false.
    do
      word = next_word(words)
      if (lower_case(word) == 'end') word = word//next_word(words)   ! some write `end solid`
      select case (lower_case(word))
      case ('')
        exit
      case ('solid', 'endsolid')
        if (open_facet) call report(words, quoted_text(word)//' stands inside a facet')
        call skip_line(words)   ! the name
      case ('facet')
        if (open_facet) call report(words, 'a facet begins before the last one ends')
        open_facet = .true.
        in_facet = 0
      case ('vertex')
        if (.not. open_facet) call report(words, 'a vertex stands outside of a facet')
        in_facet = in_facet + 1
        n = n + 1
        call ensure_capacity(n, form%point)
        do c = 1, 3
          call get_real(words, form%point(c, n))
        end do
      case ('endfacet')
        if (.not. open_facet .or. in_facet /= 3) then
          call report(words, 'a facet of the file does not have three corners')
        end if
        open_facet = .false.
      case default   ! the loop and the normal
        if (.not. open_facet) call expected(words, '''facet'' or ''endsolid''', word)
      end select
    end do
    if (open_facet) call report(words, 'the file ends inside a facet')
    if (n == 0) call report(words, 'the file holds no facets')
    if (len(words%problem) > 0) return
    form%point = form%point(:, :n)
    form%triangle = reshape([(k, k=1, n)], [3, n/3])
  end subroutine read_ascii_stl

  !> Has a text the length of a binary STL file, or less than a facet more, as some writers leave
  !! there? Some of those begin with `solid` too. Four letters in the place of the number would
  !! announce more facets than a file can hold.
  pure function is_binary_stl(text) result(yes)
    character(*), intent(in) :: text
    logical :: yes
    real(wp) :: more   ! bytes behind the facets announced
    real(wp) :: n
    integer :: c

    yes = len(text) >= stl_head
    if (.not. yes) return
    ! Number of facets in the head of a binary STL file, lowest byte first.
    n = 0.0_wp
    do c = stl_head, stl_head - 3, -1
      n = 256.0_wp*n + real(ichar(text(c:c)), wp)
    end do
    more = real(len(text) - stl_head, wp) - stl_facet*n
    yes = more > -0.5_wp .and. more < stl_facet - 0.5_wp
  end function is_binary_stl

  !> Head, number of facets, then normal, three corners and two bytes for each.
  subroutine read_binary_stl(words, form)
    type(words_t), intent(inout) :: words
    type(bed_form_t), intent(inout) :: form
    real(real32) :: x(3)
    integer :: n, f, c, at, k

    n = (len(words%text) - stl_head)/stl_facet
    words%line = 0
    if (n == 0) call report(words, 'the file holds no facets')
    deallocate (form%point)
    allocate (form%point(3, 3*n))
    do f = 1, n
      do c = 1, 3
        at = stl_head + stl_facet*(f - 1) + 12*c
        x = transfer(words%text(at + 1:at + 12), x)
        if (.not. all(ieee_is_finite(x))) x = huge(x)   ! no comparison with NaN
        if (any(abs(x) > farthest)) then
          call report(words, 'facet '//to_text(f)//': a coordinate is no number up to 1e20')
          return
        end if
        form%point(:, 3*(f - 1) + c) = real(x, wp)
      end do
    end do
    form%triangle = reshape([(k, k=1, 3*n)], [3, n])
  end subroutine read_binary_stl

  !> Refuse a form that single precision has spoiled, as it does with the coordinates of a survey.
  subroutine check_rounding(words, form)
    type(words_t), intent(inout) :: words
    type(bed_form_t), intent(in) :: form
    real(wp) :: step, length
    integer :: f

    if (len(words%problem) > 0) return
    step = real(spacing(real(maxval(abs(form%point)), real32)), wp)
    length = maxval(maxval(form%point, dim=2) - minval(form%point, dim=2))
    if (length >= fine*step) return
    if (length >= coarse*step .or. any(abs(form%point - real(real(form%point, real32), wp)) &
                                       > 0.0_wp)) then
      do f = 1, size(form%triangle, 2)   ! has any facet no area?
        associate (p => form%point(:, form%triangle(:, f)))
          if (all(abs(cross(p(:, 2) - p(:, 1), p(:, 3) - p(:, 1))) <= 0.0_wp)) exit
        end associate
      end do
      if (f > size(form%triangle, 2)) return
    end if
    words%line = 0
    call report(words, 'lies too far from zero: coordinates of ' &
      //to_text(maxval(abs(form%point)))//' m are rounded to '//to_text(step) &
      //' m in single precision, and the form is ' &
      //to_text(length)//' m long; move it near zero where it was made, and write it anew')
  end subroutine check_rounding

end module bed_file_m
