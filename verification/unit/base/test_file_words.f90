!> Files read word by word: remarks, line numbers, numbers, counts, the first problem.
module test_file_words_m
  use kinds_m, only: wp
  use file_words_m, only: words_t, read_whole, next_word, get_integer, get_real, get_count, &
    report, place_of
  use check_m, only: check
  implicit none
  private
  public :: test_file_words

  character, parameter :: lf = achar(10), tab = achar(9), cr = achar(13)

contains

  subroutine test_file_words()
    call words_and_remarks()
    call numbers()
    call counts()
    call first_problem()
    call files()
  end subroutine test_file_words

  !> A text as if read from a file.
  function text_of(text) result(words)
    character(*), intent(in) :: text
    type(words_t) :: words

    words%text = text
    words%problem = ''
  end function text_of

  subroutine words_and_remarks()
    type(words_t) :: words

    words = text_of('one'//tab//' two # rest'//cr//lf//lf//'#'//lf//' three#four')
    call check('first word', next_word(words) == 'one')
    call check('behind a tab', next_word(words) == 'two')
    call check('behind remarks and empty lines', next_word(words) == 'three#four')
    call check('line of the last word', words%line, 4)
    call check('nothing follows', next_word(words) == '')
    call check('that is no problem', len(words%problem), 0)
    call check('no place without a problem', place_of(words) == '')
    words = text_of(char(239)//char(187)//char(191)//'one '//char(239)//char(187)//char(191))
    call check('behind a byte-order mark', next_word(words) == 'one')
    call check('which is one at the start only', len(next_word(words)), 3)
  end subroutine words_and_remarks

  subroutine numbers()
    type(words_t) :: words
    real(wp) :: x(4)
    integer :: i, n

    words = text_of('-12 1.5 2d-3 1e-400 7')
    call get_integer(words, n)
    call check('whole number', n, -12)
    do i = 1, 3
      call get_real(words, x(i))
    end do
    call get_real(words, x(4))
    call check('numbers; too small is zero', x, [1.5_wp, 2.0e-3_wp, 0.0_wp, 7.0_wp], &
               1.0e-18_wp)
    call check('all were numbers', len(words%problem), 0)
    words = text_of('1e400')
    call get_real(words, x(1))
    call check('too large', len(words%problem) > 0)
    words = text_of(lf//'1.5')
    call get_integer(words, n)
    call check('not whole', index(words%problem, '1.5') > 0 .and. n == 0)
    call check('where', place_of(words) == 'line 2: ')
    words = text_of('  ')
    call get_real(words, x(1))
    call check('the end comes too early', index(words%problem, 'ends') > 0)
  end subroutine numbers

  !> A count cannot be larger than the text behind it.
  subroutine counts()
    type(words_t) :: words
    integer :: n

    words = text_of('3 a b c')
    call get_count(words, 'corners', 1, n)
    call check('count', n, 3)
    words = text_of('3 a b c')
    call get_count(words, 'corners', 3, n)
    call check('more words than the file holds', n == 0 .and. len(words%problem) > 0)
    words = text_of('9 a b c')
    call get_count(words, 'corners', 1, n)
    call check('more than the file holds', n == 0 .and. index(words%problem, '9 corners') > 0)
    words = text_of('-1 a b c')
    call get_count(words, 'corners', 1, n)
    call check('less than none', n == 0 .and. len(words%problem) > 0)
  end subroutine counts

  subroutine first_problem()
    type(words_t) :: words
    integer :: n

    words = text_of('x 5 6')
    call get_integer(words, n)
    call report(words, 'another')
    call check('the first problem stays', index(words%problem, 'x') > 0)
    call check('nothing is read after it', next_word(words) == '')
  end subroutine first_problem

  subroutine files()
    character(*), parameter :: name = 'test_file_words.tmp'
    type(words_t) :: words
    integer :: unit

    open (newunit=unit, file=name, access='stream', form='unformatted', status='replace')
    write (unit) 'a b'//lf//'c'
    close (unit)
    call read_whole(name, words)
    call check('every byte', words%text == 'a b'//lf//'c' .and. len(words%text) == 5)
    call check('from line 1', words%line, 1)
    open (newunit=unit, file=name)
    close (unit, status='delete')
    call read_whole(name, words)
    call check('no file', len(words%problem) > 0)
    call check('and no line', place_of(words) == '')
  end subroutine files

end module test_file_words_m
