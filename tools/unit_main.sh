#!/bin/sh
# The main program of unit tests: all of them, or the one that its argument names.
#
# tools/unit_main.sh NAME verification/unit/blocks/test_sleep.f90 ...
name=$1
shift
echo "program $name"
echo "  use check_m, only: wanted, finish_checks"
echo "  use parallel_m, only: parallel_init, parallel_final"
for file; do
  test=$(basename "$file" .f90)
  echo "  use ${test}_m, only: $test"
done
echo "  implicit none"
echo "  call parallel_init()"
for file; do
  test=$(basename "$file" .f90)
  echo "  if (wanted('${test#test_}')) call $test()"
done
echo "  call finish_checks()"
echo "  call parallel_final()"
echo "end program $name"
