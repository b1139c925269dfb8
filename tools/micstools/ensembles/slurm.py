"""A script that runs an ensemble as a Slurm job array."""

import shlex
from pathlib import Path

SCRIPT = """\
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
"""


def script(folder: Path, numbers: list[int], program: Path, options: list[str]) -> str:
    """The text of the script for the runs that are missing; options such as `time=2:00:00`."""
    return SCRIPT.format(
        name=folder.name.replace(" ", "-"),
        array=",".join(map(str, numbers)),
        options="".join(f"#SBATCH --{option}\n" for option in options),
        here=shlex.quote(str(Path.cwd())),
        folder=shlex.quote(str(folder)),
        program=shlex.quote(str(program)),
    )
