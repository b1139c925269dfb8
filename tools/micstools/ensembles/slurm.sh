#!/bin/sh
#SBATCH --job-name={name}
#SBATCH --array={array}
#SBATCH --cpus-per-task=1
#SBATCH --output=/dev/null
{options}# Afterwards the same `mics-tools ensemble` without --slurm makes the table.
cd {here} || exit 1
export OMP_NUM_THREADS=1
folder={folder}/$(printf %04d "$SLURM_ARRAY_TASK_ID")
newest=$(ls -t "$folder"/result/restart-[ab].h5 2> /dev/null | head -n 1)
if [ -n "$newest" ]; then
  exec {program} --quiet --restart "$newest" "$folder/case.nml" 2> "$folder/log.txt"
fi
exec {program} --quiet --output "$folder/result" "$folder/case.nml" 2> "$folder/log.txt"
