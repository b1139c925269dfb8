#!/bin/sh
# Does this compiler compile and link a small program with HDF5 (and MPI)? The exit code tells.
# Usage: try_compiler.sh serial|mpi COMPILER
modules='use hdf5'
if [ "$1" = mpi ]; then modules='use hdf5; use mpi_f08'; fi
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
printf 'program try\n%s\nimplicit none\ninteger :: i\ncall h5open_f(i)\nend program try\n' \
  "$modules" > "$work/try.f90"
cd "$work" && "$2" -fopenmp -o try try.f90 > compiler.log 2>&1
