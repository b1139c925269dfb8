#!/bin/sh
# A run on many processes under Slurm; hand it in again and again until the run is at its end:
#   sbatch --nodes=4 tools/cluster_job.sh case.nml case-out
#SBATCH --job-name=mics
#SBATCH --nodes=4
#SBATCH --ntasks-per-node=16
#SBATCH --cpus-per-task=1
#SBATCH --time=12:00:00
#SBATCH --output=mics-%j.log

if [ $# -ne 2 ]; then
  echo "usage: sbatch tools/cluster_job.sh CASE.nml FOLDER" >&2
  exit 2
fi
export OMP_NUM_THREADS="${SLURM_CPUS_PER_TASK:-1}"
# Threads that wait spin for some 50 us, not 15 ms; memory comes in large pages (docs/performance.md).
export GOMP_SPINCOUNT="${GOMP_SPINCOUNT-1000}"
export GLIBC_TUNABLES="${GLIBC_TUNABLES-glibc.malloc.hugetlb=1}"
case=$1
folder=$2
# Half an hour before the queue's limit the run writes a restart file and ends with code 143.
set -- --quiet --max-wall 11:30
newest=$(ls -t "$folder"/restart-[ab].h5 2> /dev/null | head -n 1)
if [ -n "$newest" ]; then
  exec srun --cpu-bind=cores ./mics_mpi "$@" --restart "$newest" "$case"
fi
exec srun --cpu-bind=cores ./mics_mpi "$@" --output "$folder" "$case"
