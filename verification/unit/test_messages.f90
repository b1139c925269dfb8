!> Account of what a run asks to be passed: one entry for each sort, however many there are.
program test_messages
  use kinds_m, only: wp
  use messages_m, only: count_from_here, stop_counting, note_asked, begin_search, end_search, &
    asked_what, asked_detail, asked_calls, halo, reduction
  use check_m, only: check, finish_checks
  implicit none
  integer, parameter :: sorts = 3000   !! lengths of the sums over a changing number of parts
  integer :: n, turn

  call note_asked(reduction, [8, 0, 0])
  call check('before counting nothing is kept', size(asked_calls()), 0)
  call count_from_here()
  call note_asked(halo, [8, 3, 1])
  do turn = 1, 2
    do n = 1, sorts
      call note_asked(reduction, [8*n, 0, 0])
    end do
  end do
  call begin_search()
  call note_asked(reduction, [8, 0, 0])
  call end_search()
  call stop_counting()
  call note_asked(halo, [8, 3, 1])
  call check('an entry for each sort', size(asked_calls()), sorts + 2)
  call check('how often', asked_calls(), [1.0_wp, spread(2.0_wp, 1, sorts), 1.0_wp], 0.0_wp)
  call check('bytes of all', all(asked_detail() == reshape([8, 3, 1, ([8*n, 0, 0], n=1, sorts), &
                                                            8, 0, 0], [3, sorts + 2])))
  call check('names', all(asked_what() == [character(9) :: 'halo', spread('reduction', 1, sorts), &
                                           'search']))
  call count_from_here()
  call check('counted anew', size(asked_calls()), 0)
  call finish_checks()
end program test_messages
